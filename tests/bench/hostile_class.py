"""A class of 40 good submissions and some hostile ones, graded whole, killed and interrupted on the way.

    OMP_NUM_THREADS=1 python -m tests.bench.hostile_class [--checkout OTHER]

Held against the same class without the hostile files: the reports of the good ones byte for byte but
times, peak memory of all processes together, time of the run. `--checkout` times another checkout on the
good files in the same run.
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
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import psutil

from tests import hostile

ROOT = Path(__file__).parents[2]
GOOD = 40
MEASURED_EVERY = 4
NUMBERS = {"s01": 7, "s02": 12, "s03": 3, "s06": 9, "s07": 15}
"""Students of the bundled samples who handed in scans, with their n."""


def negative() -> bytes:
    """A good scan with its tones inverted."""
    grey = cv2.imread(str(ROOT / "samples" / "pump" / "s01_1.jpg"), cv2.IMREAD_GRAYSCALE)
    return cv2.imencode(".jpg", 255 - grey)[1].tobytes()


def noise() -> bytes:
    """A3 at 300 dpi of grey noise: no drawing, and strokes everywhere."""
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


def make_class(folder: Path) -> None:
    """40 good submissions from the bundled samples: their scans, and every fourth measured values."""
    samples = ROOT / "samples" / "pump"
    lines = ["student_id,name,n"]
    students = list(NUMBERS)
    for number in range(GOOD):
        student, of = f"g{number:02d}", students[number % len(students)]
        lines.append(f"{student},Student {number},{21 if number % MEASURED_EVERY == 0 else NUMBERS[of]}")
        if number % MEASURED_EVERY == 0:
            entered = json.loads((samples / "s08.json").read_text(encoding="utf-8"))
            (folder / f"{student}.json").write_text(
                json.dumps({**entered, "student_id": student}), encoding="utf-8"
            )
            continue
        for path in sorted(samples.glob(f"{of}_*")):
            shutil.copy(path, folder / path.name.replace(of, student, 1))
    lines += [f"{name[:3]},Hostile,7" for name in (*FILES, *NO_FILES)]
    (folder / "roster.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


@dataclass
class Watch:
    """The processes of a run while it goes on."""

    process: subprocess.Popen
    peak_mb: float = 0.0
    seconds: float = 0.0

    def sample(self) -> list[psutil.Process]:
        """The workers that live; the memory of all processes together is noted."""
        workers, memory = [], 0
        with contextlib.suppress(psutil.NoSuchProcess):
            main = psutil.Process(self.process.pid)
            for one in (main, *main.children(recursive=True)):
                with contextlib.suppress(psutil.NoSuchProcess):
                    memory += one.memory_info().rss
                    if "spawn_main" in " ".join(one.cmdline()):
                        workers.append(one)
        self.peak_mb = max(self.peak_mb, memory / 1e6)
        return workers


def run(checkout: Path, folder: Path, out: Path, jobs: int, *, kill_workers: bool = False, end_after: int = 0,
        sent: int = signal.SIGKILL) -> Watch:  # fmt: skip
    """Grade, killing workers at random, or ending the main process once `end_after` reports are there."""
    call = [sys.executable, "-m", "grader", "grade", str(folder), "--assignment", "pump", "--out", str(out)]
    start = time.monotonic()
    dice, next_kill = random.Random(3), 8.0
    with subprocess.Popen(  # noqa: S603 - our own program
        [*call, "--jobs", str(jobs)], cwd=checkout, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        watch = Watch(process)
        while process.poll() is None:
            workers = watch.sample()
            passed = time.monotonic() - start
            if kill_workers and workers and passed > next_kill:
                dice.choice(workers).kill()
                next_kill = passed + dice.uniform(5.0, 15.0)
            if end_after and len(list(out.glob("*/report.json"))) >= end_after:
                asked = time.monotonic()
                process.send_signal(sent)
                process.wait()
                psutil.wait_procs(workers, timeout=60)
                watch.seconds = time.monotonic() - asked
                return watch
            time.sleep(0.05)
    watch.seconds = time.monotonic() - start
    return watch


def reports(out: Path) -> dict[str, str]:
    """Each report without times, by student."""

    def timeless(value: object) -> object:
        if isinstance(value, dict):
            return {key: timeless(one) for key, one in value.items() if key != "timing_ms"}
        return [timeless(one) for one in value] if isinstance(value, list) else value

    found = {}
    for path in sorted(out.glob("*/report.json")):
        found[path.parent.name] = json.dumps(timeless(json.loads(path.read_text(encoding="utf-8"))))
    return found


def same(first: dict[str, str], second: dict[str, str]) -> int:
    """How many good submissions have the same report."""
    good = [student for student in first if student.startswith("g")]
    return sum(first[student] == second.get(student) for student in good)


def main() -> None:
    """Make the class, grade it in every way, and print a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--checkout", type=Path)
    parser.add_argument("--jobs", type=int, nargs="*", default=[1, 2])
    asked = parser.parse_args()
    other = asked.checkout
    with tempfile.TemporaryDirectory() as top:
        good, mixed = Path(top) / "good", Path(top) / "mixed"
        good.mkdir()
        make_class(good)
        shutil.copytree(good, mixed)
        for name, make in FILES.items():
            (mixed / name).write_bytes(make())
        for name, put in NO_FILES.items():
            put(mixed / name)
        for jobs in asked.jobs:
            out = Path(top) / f"{jobs}"
            if other is not None:
                before = run(other, good, out / "before", jobs)
                print(
                    f"{jobs} processes, good files, {other}: {before.seconds:.1f} s, {before.peak_mb:.0f} MB"
                )
            alone = run(ROOT, good, out / "good", jobs)
            print(f"{jobs} processes, good files: {alone.seconds:.1f} s, {alone.peak_mb:.0f} MB")
            clean = reports(out / "good")
            for name, kill in (("mixed", False), ("mixed, workers killed", True)):
                watch = run(ROOT, mixed, out / name, jobs, kill_workers=kill)
                found = reports(out / name)
                codes = Counter(
                    problem["code"] for student, text in found.items() if student.startswith("h")
                    for problem in json.loads(text)["problems"]
                )  # fmt: skip
                kept = f"{same(clean, found)} of {GOOD} as without"
                print(f"{jobs} processes, {name}: {watch.seconds:.1f} s, {watch.peak_mb:.0f} MB, {kept}")
                print(f"    problems of the hostile: {dict(codes)}")
            for name, sent in (("main killed", signal.SIGKILL), ("interrupted", signal.SIGINT)):
                ended = run(ROOT, mixed, out / name, jobs, end_after=12, sent=sent)
                there = len(list((out / name).glob("*/report.json")))
                again = run(ROOT, mixed, out / name, jobs)
                kept = f"{same(clean, reports(out / name))} of {GOOD} as without"
                print(
                    f"{jobs} processes, {name}: ended after {ended.seconds:.2f} s with {there} reports there;"
                )
                print(f"    the next run took {again.seconds:.1f} s, {kept}")


if __name__ == "__main__":
    main()
