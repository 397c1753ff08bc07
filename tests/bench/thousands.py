"""A class of thousands: the time of a first run and of a cached one, sheets a minute, memory.

    OMP_NUM_THREADS=1 python -m tests.bench.thousands real --count 200 --jobs 1 2
    OMP_NUM_THREADS=1 python -m tests.bench.thousands cached --count 3000

`real` grades a class of bundled samples under many ids, 5 % of it broken, and tells sheets a minute with
each number of processes against one process's time a sheet, and the memory of the parent and of all
processes along the run. `cached` grades each sample once, writes the cache of a whole class from these,
each submission with nodes and ink of its own, and times the runs that follow as a user calls them.
"""

import argparse
import contextlib
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from grader.documents import ReportDocument
from grader.folder import batch as folder_batch
from grader.folder import cache, inventory
from grader.folder.batch import Batch, Job, grade
from grader.folder.cache import PageCache
from grader.folder.workers import guarded
from grader.records import PageRef, Reason
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment
from tests import hostile

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples" / "pump"
NUMBERS = {"s01": 7, "s02": 12, "s03": 3, "s07": 15, "s08": 21}
"""Students of the bundled samples, with their n."""
BROKEN_EVERY = 20
"""One submission of 20 is broken: 5 %."""
BROKEN: Sequence[tuple[str, Callable[[], bytes]]] = (
    (".jpg", lambda: b""),
    (".jpg", lambda: (SAMPLES / "s01_1.jpg").read_bytes()[:60_000]),
    (".png", hostile.thin_picture),
    (".pdf", lambda: b"%PDF-1.7\nnothing more"),
)
"""An empty file, half a scan, a picture that is no sheet, a PDF without pages."""


def make_class(folder: Path, count: int) -> dict[str, str]:
    """A folder of so many submissions and their roster; whose sample each is, by student.

    Scans differ in bytes that are no picture, as no two files that people hand in are the same.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lines, of = ["student_id,name,n"], {}
    names = list(NUMBERS)
    for number in range(count):
        student, sample = f"g{number:05d}", names[number % len(names)]
        lines.append(f"{student},Student {number},{NUMBERS[sample]}")
        if number % BROKEN_EVERY == BROKEN_EVERY - 1:
            ends, content = BROKEN[number // BROKEN_EVERY % len(BROKEN)]
            (folder / f"{student}{ends}").write_bytes(content())
            continue
        of[student] = sample
        for path in sorted(SAMPLES.glob(f"{sample}[._]*")):
            target = folder / path.name.replace(sample, student, 1)
            if path.suffix == ".json":
                entered = json.loads(path.read_text(encoding="utf-8"))
                target.write_text(json.dumps({**entered, "student_id": student}), encoding="utf-8")
            else:
                target.write_bytes(_marked(path.read_bytes(), student.encode()))
    (folder / "roster.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return of


def _marked(data: bytes, mark: bytes) -> bytes:
    """An image with a remark that no decoder shows."""
    if data.startswith(b"\xff\xd8"):
        return data[:2] + b"\xff\xfe" + (len(mark) + 2).to_bytes(2, "big") + mark + data[2:]
    return data + mark


# A class that was graded, without the hours that it takes -------------------------------------------


@dataclass
class Copying:
    """A pool that runs each sample's calls once and copies the results for the others of that sample.

    Attributes
    ----------
    of : the sample of each student
    """

    of: dict[str, str]
    pages: dict[tuple[str, int], PageRef] = field(default_factory=dict)
    jobs: dict[str, tuple[Job, ReportDocument]] = field(default_factory=dict)
    dice: np.random.Generator = field(default_factory=lambda: np.random.default_rng(5))

    def run(
        self, function: Callable[..., Any], calls: Sequence[tuple[Any, ...]], sheets: Sequence[int] = ()
    ) -> Iterator[tuple[int, Any]]:
        """As `grader.folder.workers.Pool`."""
        del sheets
        known = {inventory.identify_page: self._page, folder_batch._mark_one: self._mark}
        for index, call in enumerate(calls):
            yield index, known[function](*call) if function in known else guarded(function, *call)

    def _page(self, scans: PageCache, ref: PageRef) -> PageRef | Reason:
        student, _, end = Path(ref.file).stem.partition("_")
        key = self.of.get(student, ref.file) + end, ref.page
        if key not in self.pages:
            page = guarded(inventory.identify_page, scans, ref)
            if isinstance(page, Reason) or page.problem is not None:
                return page
            self.pages[key] = page
            return page
        page = replace(self.pages[key], file=ref.file, digest=ref.digest, path=ref.path)
        # A scan's own name is of no account: the cache gives the page as it is asked for.
        _linked(
            str(scans.path_of(replace(self.pages[key], blank=False, identity=None))), str(scans.path_of(ref))
        )
        return page

    def _mark(self, batch: Batch, scans: PageCache, job: Job) -> ReportDocument | Reason:
        student = job.submission.student_id
        sample = self.of.get(student)
        if sample is None or sample not in self.jobs:
            report = guarded(folder_batch._mark_one, batch, scans, job)
            if sample is not None and not isinstance(report, Reason):
                self.jobs[sample] = job, report
            return report
        first, known = self.jobs[sample]
        report = self._other_drawing(known.model_copy(update={"student_id": student}))
        self._copy_files(batch, first, job)
        text = report.model_dump_json(indent=2).replace(f'"{first.folder}_', f'"{student}_')
        cache.write_whole(batch.out / job.folder / "report.json", text)
        cache.write_whole(batch.out / cache_folder() / f"{job.name}.key", job.key)
        return ReportDocument.model_validate_json(text)

    def _other_drawing(self, report: ReportDocument) -> ReportDocument:
        """The report with each figure elsewhere and each node a little off: another student's hand."""
        data = report.model_dump(mode="json")
        for sheet in data["reading"]["sheets"]:
            for figure in sheet["figures"].values():
                shift = self.dice.normal(0.0, 15.0, 2)
                for node in figure["nodes"].values():
                    x, y = shift + self.dice.normal(0.0, 0.4, 2)
                    node["x_mm"], node["y_mm"] = round(node["x_mm"] + x, 3), round(node["y_mm"] + y, 3)
        return ReportDocument.model_validate(data)

    def _copy_files(self, batch: Batch, first: Job, job: Job) -> None:
        readings = batch.out / cache_folder() / "readings"
        shutil.copytree(
            batch.out / first.folder, batch.out / job.folder, dirs_exist_ok=True, copy_function=_linked
        )
        with contextlib.suppress(FileNotFoundError):
            _, printed, pages = cache.loaded((readings / f"{first.name}.reading").read_bytes())
            refs = {(ref.file.partition("_")[2], ref.page): ref for ref in job.submission.pages}
            pages = [replace(one, ref=refs[one.ref.file.partition("_")[2], one.ref.page]) for one in pages]
            cache.write_whole(
                readings / f"{job.name}.reading", cache.dumped((job.reading_key, printed, pages))
            )
            maps = cache.cached_maps(readings, first.name)
            moved = [np.roll(one, self.dice.integers(-20, 20, 2), (0, 1)) for one in maps]
            cache.write_whole(readings / f"{job.name}.ink", cache.zlib.compress(np.array(moved).tobytes()))


def _linked(source: str, target: str) -> None:
    """A copy that takes no room: files of results are replaced, never written into."""
    Path(target).unlink(missing_ok=True)
    Path(target).hardlink_to(source)


def cache_folder() -> str:
    """Where a run keeps what the next one uses."""
    return folder_batch.CACHE_FOLDER


# Measuring ---------------------------------------------------------------------------------------------


@dataclass
class Run:
    """A run of the program: seconds, and memory along it in MB, by seconds from its start."""

    seconds: float = 0.0
    parent_mb: list[tuple[float, float]] = field(default_factory=list)
    all_mb: float = 0.0
    lines: list[str] = field(default_factory=list)

    def at(self, share: float) -> float:
        """Memory of the parent after this share of the run, its median nearby."""
        near = [mb for s, mb in self.parent_mb if abs(s / self.seconds - share) < 0.05]
        return float(np.median(near)) if near else float("nan")


def run(folder: Path, out: Path, jobs: int) -> Run:
    """Grade a folder as a user does, and sample the memory of the parent and of all processes."""
    call = [sys.executable, "-m", "grader", "grade", str(folder), "--assignment", "pump", "--out", str(out)]
    told, start = Run(), time.monotonic()
    with subprocess.Popen(  # noqa: S603 - our own program
        [*call, "--jobs", str(jobs)], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        main = psutil.Process(process.pid)
        while process.poll() is None:
            with contextlib.suppress(psutil.NoSuchProcess):
                parent = main.memory_info().rss / 1e6
                others = sum(child.memory_info().rss for child in main.children(recursive=True)) / 1e6
                told.parent_mb.append((time.monotonic() - start, parent))
                told.all_mb = max(told.all_mb, parent + others)
            time.sleep(0.2)
        told.seconds = time.monotonic() - start
        told.lines = process.stdout.read().splitlines() if process.stdout else []
    return told


def cached(count: int, folder: Path) -> None:
    """Write the cache of a class, and time two runs over it."""
    handed_in, out = folder / "in", folder / "out"
    of = make_class(handed_in, count)
    assignment = load_assignment("pump")
    start = time.monotonic()
    grade(Batch(assignment, rubric_of(assignment), handed_in, out), lambda *_: None, Copying(of))
    print(f"cache of {count} submissions written in {time.monotonic() - start:.0f} s")
    for name in ("first", "second", "third"):
        _tell(f"{name} cached run", run(handed_in, out, 2))
    (out / cache_folder() / folder_batch.ALIKE_NOTE).unlink()
    _tell("cached run that compares all sheets anew", run(handed_in, out, 2))


def real(count: int, jobs: Sequence[int], folder: Path) -> None:
    """Grade a class for real with each number of processes."""
    handed_in = folder / "in"
    make_class(handed_in, count)
    sheets = len([path for path in handed_in.iterdir() if path.suffix not in {".csv", ".json"}])
    print(f"{count} submissions, {sheets} scans, {count // BROKEN_EVERY} broken")
    for number in jobs:
        out = folder / f"out{number}"
        told = run(handed_in, out, number)
        _tell(f"--jobs {number}", told)
        print(
            f"  {60.0 * sheets / told.seconds:.1f} sheets a minute,"
            f" {told.seconds / sheets * number:.2f} s a sheet and process"
        )
        _tell(f"--jobs {number}, cached", run(handed_in, out, number))


def _tell(name: str, told: Run) -> None:
    memory = ", ".join(f"{told.at(share):.0f}" for share in (0.1, 0.5, 0.9))
    print(
        f"{name}: {told.seconds:.1f} s; parent {memory} MB at 10, 50, 90 %; all together {told.all_mb:.0f} MB"
    )


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("real", "cached"))
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--folder", type=Path, help="left there; a temporary one if absent")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = asked.folder or Path(temporary)
        if asked.what == "cached":
            cached(asked.count, folder)
        else:
            real(asked.count, asked.jobs, folder)


if __name__ == "__main__":
    main()
