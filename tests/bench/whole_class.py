"""Grade a whole class as a user does: time and memory.

    OMP_NUM_THREADS=1 python -m tests.bench.whole_class --count 200 --jobs 1 2

Bundled samples under many ids, 5 % of the files broken: sheets a minute for each number of processes, memory
of the parent and of all processes along the run, and the same for a second run with nothing changed.
"""

import argparse
import contextlib
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil

from tests import hostile

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples" / "pump"
NUMBERS = {"s01": 7, "s02": 12, "s03": 3, "s07": 15, "s08": 21}
"""Students of the bundled samples, with their n; the last one handed in measured values."""
BROKEN_EVERY = 20
"""One submission of 20 is broken: 5 %."""
BROKEN: Sequence[tuple[str, Callable[[], bytes]]] = (
    (".jpg", lambda: b""),
    (".jpg", lambda: (SAMPLES / "s01_1.jpg").read_bytes()[:60_000]),
    (".png", hostile.thin_picture),
    (".pdf", lambda: b"%PDF-1.7\nnothing more"),
)
"""An empty file, half a scan, a picture that is no sheet, a PDF without pages."""


def make_class(folder: Path, count: int) -> None:
    """Make a folder of submissions and their roster.

    Scans differ in bytes that do not change the picture, as no two files that people hand in are equal.
    """
    folder.mkdir(parents=True)
    lines = ["student_id,name,n"]
    for number in range(count):
        student, sample = f"g{number:05d}", list(NUMBERS)[number % len(NUMBERS)]
        lines.append(f"{student},Student {number},{NUMBERS[sample]}")
        if number % BROKEN_EVERY == BROKEN_EVERY - 1:
            ends, content = BROKEN[number // BROKEN_EVERY % len(BROKEN)]
            (folder / f"{student}{ends}").write_bytes(content())
            continue
        for path in sorted(SAMPLES.glob(f"{sample}[._]*")):
            target = folder / path.name.replace(sample, student, 1)
            if path.suffix == ".json":
                entered = json.loads(path.read_text(encoding="utf-8"))
                target.write_text(json.dumps({**entered, "student_id": student}), encoding="utf-8")
            else:
                target.write_bytes(_marked(path.read_bytes(), student.encode()))
    (folder / "roster.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _marked(data: bytes, mark: bytes) -> bytes:
    """An image with a comment that no decoder shows."""
    if data.startswith(b"\xff\xd8"):
        return data[:2] + b"\xff\xfe" + (len(mark) + 2).to_bytes(2, "big") + mark + data[2:]
    return data + mark


@dataclass
class Run:
    """Time and memory of one run of the program.

    Attributes
    ----------
    parent_mb : memory of the main process, by seconds from the start
    peak_mb : peak memory of all processes together
    """

    seconds: float = 0.0
    parent_mb: list[tuple[float, float]] = field(default_factory=list)
    peak_mb: float = 0.0

    def sample(self, process: subprocess.Popen, passed: float) -> None:
        """Record memory."""
        memory = 0.0
        with contextlib.suppress(psutil.NoSuchProcess):
            main = psutil.Process(process.pid)
            self.parent_mb.append((passed, main.memory_info().rss / 1e6))
            for one in (main, *main.children(recursive=True)):
                with contextlib.suppress(psutil.NoSuchProcess):
                    memory += one.memory_info().rss / 1e6
        self.peak_mb = max(self.peak_mb, memory)

    def __str__(self) -> str:
        near = (
            [mb for passed, mb in self.parent_mb if abs(passed / self.seconds - share) < 0.05]
            for share in (0.1, 0.9)
        )
        parent = ", ".join(f"{np.median(mbs):.0f}" if mbs else "-" for mbs in near)
        return f"{self.seconds:.1f} s; parent {parent} MB at 10 and 90 %, all together {self.peak_mb:.0f} MB"


def run(folder: Path, out: Path, jobs: int) -> Run:
    """Grade; record time and memory."""
    call = [sys.executable, "-m", "grader", "grade", str(folder), "--assignment", "pump", "--out", str(out)]
    start, found = time.monotonic(), Run()
    with subprocess.Popen(  # noqa: S603 - our own program
        [*call, "--jobs", str(jobs)], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        while process.poll() is None:
            time.sleep(0.05)
            found.sample(process, time.monotonic() - start)
    found.seconds = time.monotonic() - start
    return found


def measure_sheets(top: Path, count: int, jobs: Sequence[int]) -> None:
    """Grade a class with each number of processes, then again with nothing changed."""
    folder = top / "in"
    make_class(folder, count)
    sheets = len([path for path in folder.iterdir() if path.suffix not in {".csv", ".json"}])
    print(f"{count} submissions, {sheets} scans, {count // BROKEN_EVERY} broken")
    for number in jobs:
        first = run(folder, top / f"out{number}", number)
        print(f"{number} processes: {first}, {60.0 * sheets / first.seconds:.1f} sheets a minute")
        print(f"    unchanged: {run(folder, top / f'out{number}', number)}")


def main() -> None:
    """Make the class, grade it, and print what was measured."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200, help="submissions")
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as top:
        measure_sheets(Path(top), asked.count, asked.jobs)


if __name__ == "__main__":
    main()
