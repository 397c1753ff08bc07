"""Reading measured on simulated sheets whose truth is known, scene by scene.

What counts as right, and what as a silent misread, stands in `tests.bench.reading_truth`.
`ReadingBench` adds pages without the drawing asked for, and strokes by themselves.
"""

import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2

from grader.pipeline import open_page, read_pages
from grader.records import PageRef, ScannedPage
from reference.construction.derive import construction_of
from tests.bench.lines import LinesFigures, measure_lines
from tests.bench.reading_memory import peak_mb
from tests.bench.reading_scenes import (
    BREAKDOWNS,
    SCENES,
    ForeignRow,
    ReadingScene,
    SceneWork,
    measure_foreign,
    works,
)
from tests.bench.reading_tally import STAGES, ReadingTally, SceneRow, row_of
from tests.bench.reading_truth import figures_of

__all__ = ["SCENES", "STAGES", "STUDENTS", "ReadingBench", "SceneRow", "measure_reading"]

STUDENTS, STUDENTS_QUICK = 6, 1
SCENES_QUICK = ("plain", "printed")


class ReadingBench:
    """The whole benchmark of reading; `run` tells what was measured, step by step.

    Arguments: `students` per scene, by default 6, in a quick run 1 of two scenes only.
    """

    def __init__(self, *, quick: bool = False, students: int | None = None) -> None:
        self.quick = quick
        self.students = students or (STUDENTS_QUICK if quick else STUDENTS)
        self.scenes = tuple(scene for scene in SCENES if not quick or scene.name in SCENES_QUICK)
        self.rows: list[SceneRow] = []
        self.foreign: list[ForeignRow] = []
        self.lines: LinesFigures | None = None
        self.steps = len(self.scenes) + 2

    def run(self) -> Iterator[str]:
        """Measure, naming what was measured."""
        # One core: what a class needs is sheets per core.
        threads = cv2.getNumThreads()
        cv2.setNumThreads(1)
        try:
            for scene in self.scenes:
                self.rows.append(measure_scene(scene, self.students, memory=not self.quick))
                yield f"reading: {scene.title}"
            self.foreign.extend(measure_foreign(quick=self.quick))
            yield "reading: foreign pages"
            self.lines = measure_lines(quick=self.quick)
            yield "lines"
        finally:
            cv2.setNumThreads(threads)


def measure_reading(
    *, students: int = STUDENTS, first_seed: int = 1, scenes: Sequence[ReadingScene] = SCENES
) -> Iterator[SceneRow]:
    """A row per scene; the same students in each run."""
    for scene in scenes:
        yield measure_scene(scene, students, first_seed)


def measure_scene(
    scene: ReadingScene, students: int, first_seed: int = 1, *, memory: bool = True
) -> SceneRow:
    """Every student of a scene simulated, read and held against the truth; peak memory of the first."""
    tally, peak = ReadingTally(), None
    with tempfile.TemporaryDirectory() as folder:
        for work in works(scene, students, first_seed):
            paths = [sheet.save(Path(folder) / f"{number}") for number, sheet in enumerate(work.sheets)]
            _read_one(tally, work, paths)
            if memory and peak is None:
                peak = peak_mb(scene.assignment, work.variant, paths)
    return row_of(scene.name, scene.title, tally, peak)


def _read_one(tally: ReadingTally, work: SceneWork, paths: Sequence[Path]) -> None:
    start, clock = time.process_time(), time.perf_counter()
    scans = [open_page(PageRef(path.name, path=path)) for path in paths]
    pages, failed = read_all(scans, work)
    spent, passed = time.process_time() - start, time.perf_counter() - clock
    construction = construction_of(work.assignment.mechanism([work.variant]))
    tally.students += 1
    tally.failed += failed
    for sheet, page in zip(work.sheets, pages, strict=True):
        tally.add_times(page.timing_ms, spent / passed, 1000.0 * spent / len(pages))
        figures = figures_of(sheet.truth, construction)
        tally.add_sheet(sheet.truth, figures, work.rubric.vectors, page, page.reading)


def read_all(pages: Sequence[ScannedPage], work: SceneWork) -> tuple[list[ScannedPage], bool]:
    """A student's pages with what is read on them; nothing, and True, where the reader breaks down."""
    try:
        wanted = work.rubric.vectors
        return read_pages(pages, work.assignment, work.variant, work.declared, wanted), False
    except BREAKDOWNS:
        return list(pages), True
