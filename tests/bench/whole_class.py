"""Grade a whole class as a user does: time and memory; with hostile files, killed and interrupted.

    OMP_NUM_THREADS=1 python -m tests.bench.whole_class sheets --count 200 --jobs 1 2
    OMP_NUM_THREADS=1 python -m tests.bench.whole_class hostile [--checkout OTHER]

Both grade bundled samples under many ids. `sheets`: 5 % of the files are broken; sheets a minute for each
number of processes, memory of the parent and of all processes along the run, and the same for a second run
with nothing changed. `hostile`: some hostile files among 40 good submissions, compared with the same class
without them: reports of the good ones byte for byte (except times), peak memory of all processes, time of
the run. `--checkout` also times another checkout on the good files.
"""

import argparse
import contextlib
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import psutil

from tests import hostile

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples" / "pump"
NUMBERS = {"s01": 7, "s02": 12, "s03": 3, "s07": 15, "s08": 21}
"""Students of the bundled samples, with their n; the last one handed in measured values."""
GOOD = 40
BROKEN_EVERY = 20
"""One submission of 20 is broken: 5 %."""
BROKEN: Sequence[tuple[str, Callable[[], bytes]]] = (
    (".jpg", lambda: b""),
    (".jpg", lambda: (SAMPLES / "s01_1.jpg").read_bytes()[:60_000]),
    (".png", hostile.thin_picture),
    (".pdf", lambda: b"%PDF-1.7\nnothing more"),
)
"""An empty file, half a scan, a picture that is no sheet, a PDF without pages."""


def negative() -> bytes:
    """A good scan with its tones inverted."""
    grey = cv2.imread(str(SAMPLES / "s01_1.jpg"), cv2.IMREAD_GRAYSCALE)
    return cv2.imencode(".jpg", 255 - grey)[1].tobytes()


def noise() -> bytes:
    """An A3 page of grey noise at 300 dpi: no drawing, and strokes everywhere."""
    grey = np.random.default_rng(1).integers(0, 256, (3508, 4961), np.uint8)
    return cv2.imencode(".jpg", grey)[1].tobytes()


FILES = {
    "h01.png": hostile.thin_picture,
    "h02.png": hostile.tiny_picture,
    "h03.png": hostile.png_of_deep_pixels,
    "h04.tif": hostile.tiff_of_many_samples,
    "h05.pdf": hostile.pdf_of_nested_forms,
    "h06.pdf": hostile.pdf_of_a_narrow_pattern,
    "h07.jpg": hostile.jpeg_of_many_scans,
    "h08.jpg": negative,
    "h09.jpg": noise,
    "h10.pdf": hostile.pdf_of_a_class,
    "h11.pdf": hostile.pdf_of_a_shading_by_a_program,
}
NO_FILES = {
    "h12.pdf": hostile.link_to_itself,
    "h13.jpg": hostile.link_to_nothing,
    "h14.jpg": hostile.link_out,
    "h15.png": hostile.pipe,
    "h16_\n\x1b[2J.jpg": lambda path: path.write_bytes(b"junk"),
    "h17_Иванов \u202egpj.jpg": lambda path: path.write_bytes(b"junk"),
}


def make_class(folder: Path, count: int, *, broken: bool, others: Sequence[str] = ()) -> None:
    """Make a folder of submissions and their roster, with the files `others` in it.

    Scans differ in bytes that do not change the picture, as no two files that people hand in are equal.
    """
    folder.mkdir(parents=True)
    lines = ["student_id,name,n"]
    for number in range(count):
        student, sample = f"g{number:05d}", list(NUMBERS)[number % len(NUMBERS)]
        lines.append(f"{student},Student {number},{NUMBERS[sample]}")
        if broken and number % BROKEN_EVERY == BROKEN_EVERY - 1:
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
    lines += [f"{name[:3]},Hostile,7" for name in others]
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
    seconds : time of the run, or from the signal to the end of all processes
    parent_mb : memory of the main process, by seconds from the start
    peak_mb : peak memory of all processes together
    """

    seconds: float = 0.0
    parent_mb: list[tuple[float, float]] = field(default_factory=list)
    peak_mb: float = 0.0

    def sample(self, process: subprocess.Popen, passed: float) -> list[psutil.Process]:
        """Record memory; return the live workers."""
        workers, memory = [], 0.0
        with contextlib.suppress(psutil.NoSuchProcess):
            main = psutil.Process(process.pid)
            self.parent_mb.append((passed, main.memory_info().rss / 1e6))
            for one in (main, *main.children(recursive=True)):
                with contextlib.suppress(psutil.NoSuchProcess):
                    memory += one.memory_info().rss / 1e6
                    if "spawn_main" in " ".join(one.cmdline()):
                        workers.append(one)
        self.peak_mb = max(self.peak_mb, memory)
        return workers

    def __str__(self) -> str:
        near = (
            [mb for passed, mb in self.parent_mb if abs(passed / self.seconds - share) < 0.05]
            for share in (0.1, 0.9)
        )
        parent = ", ".join(f"{np.median(mbs):.0f}" if mbs else "-" for mbs in near)
        return f"{self.seconds:.1f} s; parent {parent} MB at 10 and 90 %, all together {self.peak_mb:.0f} MB"


def run(folder: Path, out: Path, jobs: int, *, checkout: Path = ROOT, kill_workers: bool = False,
        end_after: int = 0, sent: int = signal.SIGKILL) -> Run:  # fmt: skip
    """Grade; kill workers at random, or end the main process once there are `end_after` reports."""
    call = [sys.executable, "-m", "grader", "grade", str(folder), "--assignment", "pump", "--out", str(out)]
    start, found = time.monotonic(), Run()
    dice, next_kill = random.Random(3), 8.0
    with subprocess.Popen(  # noqa: S603 - our own program
        [*call, "--jobs", str(jobs)], cwd=checkout, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        while process.poll() is None:
            time.sleep(0.05)
            passed = time.monotonic() - start
            workers = found.sample(process, passed)
            if kill_workers and workers and passed > next_kill:
                dice.choice(workers).kill()
                next_kill = passed + dice.uniform(5.0, 15.0)
            if end_after and len(list(out.glob("*/report.json"))) >= end_after:
                start = time.monotonic()
                process.send_signal(sent)
                process.wait()
                psutil.wait_procs(workers, timeout=60)
    found.seconds = time.monotonic() - start
    return found


def measure_sheets(top: Path, count: int, jobs: Sequence[int]) -> None:
    """Grade a class with each number of processes, then again with nothing changed."""
    folder = top / "in"
    make_class(folder, count, broken=True)
    sheets = len([path for path in folder.iterdir() if path.suffix not in {".csv", ".json"}])
    print(f"{count} submissions, {sheets} scans, {count // BROKEN_EVERY} broken")
    for number in jobs:
        first = run(folder, top / f"out{number}", number)
        print(f"{number} processes: {first}, {60.0 * sheets / first.seconds:.1f} sheets a minute")
        print(f"    unchanged: {run(folder, top / f'out{number}', number)}")


def reports(out: Path) -> dict[str, str]:
    """Each report without times, by student."""

    def timeless(value: object) -> object:
        if isinstance(value, dict):
            return {key: timeless(one) for key, one in value.items() if key != "timing_ms"}
        return [timeless(one) for one in value] if isinstance(value, list) else value

    return {
        path.parent.name: json.dumps(timeless(json.loads(path.read_text(encoding="utf-8"))))
        for path in sorted(out.glob("*/report.json"))
    }


def same(first: Mapping[str, str], second: Mapping[str, str]) -> str:
    """The number of good submissions with the same report, as text."""
    good = [student for student in first if student.startswith("g")]
    return f"{sum(first[student] == second.get(student) for student in good)} of {GOOD} as without"


def measure_hostile(top: Path, jobs: Sequence[int], other: Path | None) -> None:
    """Grade a class with hostile files and without, in every way."""
    good, mixed = top / "good", top / "mixed"
    make_class(good, GOOD, broken=False, others=(*FILES, *NO_FILES))
    shutil.copytree(good, mixed)
    for name, make in FILES.items():
        (mixed / name).write_bytes(make())
    for name, put in NO_FILES.items():
        put(mixed / name)
    for number in jobs:
        out, told = top / f"{number}", f"{number} processes"
        if other is not None:
            print(f"{told}, good files, {other}: {run(good, out / 'before', number, checkout=other)}")
        print(f"{told}, good files: {run(good, out / 'good', number)}")
        clean = reports(out / "good")
        for name, kill in (("mixed", False), ("mixed, workers killed", True)):
            whole = run(mixed, out / name, number, kill_workers=kill)
            found = reports(out / name)
            codes = Counter(
                problem["code"] for student, text in found.items() if student.startswith("h")
                for problem in json.loads(text)["problems"]
            )  # fmt: skip
            print(f"{told}, {name}: {whole}, {same(clean, found)}")
            print(f"    problems of the hostile: {dict(codes)}")
        for name, sent in (("main killed", signal.SIGKILL), ("interrupted", signal.SIGINT)):
            ended = run(mixed, out / name, number, end_after=12, sent=sent)
            there = len(list((out / name).glob("*/report.json")))
            again = run(mixed, out / name, number)
            print(f"{told}, {name}: ended after {ended.seconds:.2f} s with {there} reports there;")
            print(f"    the next run took {again.seconds:.1f} s, {same(clean, reports(out / name))}")


def main() -> None:
    """Make the class, grade it, and print what was measured."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("sheets", "hostile"))
    parser.add_argument("--count", type=int, default=200, help="submissions of `sheets`")
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--checkout", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as top:
        if asked.what == "sheets":
            measure_sheets(Path(top), asked.count, asked.jobs)
        else:
            measure_hostile(Path(top), asked.jobs, asked.checkout)


if __name__ == "__main__":
    main()
