"""Measure reading on simulated sheets whose truth is known, scene by scene.

`tests.bench.reading_truth` defines right readings and silent misreads.
"""

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from grader.feedback.student_page import About, feedback_page, write_feedback
from grader.overlay.backdrop import backdrop
from grader.pipeline import mark, read_pages
from grader.reading import expected
from grader.records import PageRef, ScannedPage
from grader.rubric import asked_of
from grader.scan.page import open_page
from grader.tables.measurements import StudentSubmission
from reference.construction.derive import construction_of
from tests.bench.plain_text import Table
from tests.bench.reading_memory import peak_mb
from tests.bench.reading_scenes import (
    BREAKDOWNS,
    SCENES,
    ReadingScene,
    SceneWork,
    scene_named,
    works,
)
from tests.bench.reading_tally import ReadingTally, SceneRow, pair, percent, row_of
from tests.bench.reading_truth import figures_of

SCENES_QUICK = ("plain", "printed")


def measure_reading(
    students: int, scenes: Sequence[ReadingScene] = SCENES, *, quick: bool = False
) -> Iterator[SceneRow]:
    """A row per scene, the same students in each run; a quick run has few scenes and no memory."""
    for scene in scenes:
        if not quick or scene.name in SCENES_QUICK:
            yield measure_scene(scene, students, memory=not quick)


def measure_scene(
    scene: ReadingScene,
    students: int,
    first_seed: int = 1,
    *,
    memory: bool = True,
    narrowed: bool = False,
) -> SceneRow:
    """Simulate and read every student of a scene, and compare with the truth; peak memory of the first.

    Arguments: `narrowed` to the zones of the figures that the rubric asks for, as a class is graded.
    """
    tally, peak = ReadingTally(), None
    with tempfile.TemporaryDirectory() as folder:
        for work in works(scene, students, first_seed):
            paths = [sheet.save(Path(folder) / f"{number}") for number, sheet in enumerate(work.sheets)]
            _read_one(tally, work, paths, narrowed=narrowed)
            if memory and peak is None:
                peak = peak_mb(scene.assignment, work.variant, paths)
    return row_of(scene.name, scene.title, tally, peak)


def _read_one(tally: ReadingTally, work: SceneWork, paths: Sequence[Path], *, narrowed: bool) -> None:
    start, clock = time.process_time(), time.perf_counter()
    figures = asked_of(work.assignment, work.rubric).figures if narrowed else ()
    scans = [open_page(PageRef(path.name, path=path), figures) for path in paths]
    pages, failed = read_all(scans, work)
    marking = {} if failed else _marking_ms(work, pages, paths[0].parent / "marked")
    spent, passed = time.process_time() - start, time.perf_counter() - clock
    construction = construction_of(work.assignment.mechanism([work.variant]))
    tally.students += 1
    tally.failed += failed
    for sheet, page in zip(work.sheets, pages, strict=True):
        tally.add_times({**page.timing_ms, **marking}, spent / passed, 1000.0 * spent / len(pages))
        true = figures_of(sheet.truth, construction)
        tally.add_sheet(sheet.truth, true, work.rubric.vectors, page, page.reading)


def _marking_ms(work: SceneWork, pages: Sequence[ScannedPage], out: Path) -> dict[str, float]:
    """Milliseconds of judging, pictures and the student's page for each sheet, by the clock."""
    refs = tuple(page.ref for page in pages)
    submission = StudentSubmission("s01", work.variant, refs, work.declared)
    clock = [time.perf_counter()]
    mark(submission, pages, work.assignment, work.rubric)
    clock.append(time.perf_counter())
    shown = [
        page if page.image is None else replace(page, backdrop=backdrop(page.image, page.sheet))
        for page in pages
    ]
    report, painted = mark(submission, shown, work.assignment, work.rubric)
    pictures = painted("full")
    clock.append(time.perf_counter())
    about = About(work.assignment.file.title.in_language("en"), "s01", work.assignment.file.names)
    write_feedback(feedback_page(report, pictures, "en", about=about), pictures, out)
    clock.append(time.perf_counter())
    judging, judging_and_picture, page_ms = (1000.0 / len(pages) * np.diff(clock)).tolist()
    return {"judging": judging, "picture": max(judging_and_picture - judging, 0.0), "page": page_ms}


def read_all(pages: Sequence[ScannedPage], work: SceneWork) -> tuple[list[ScannedPage], bool]:
    """A student's pages as read; an empty list, and True, if the reader breaks down."""
    try:
        wanted = work.rubric.vectors
        return read_pages(pages, work.assignment, work.variant, work.declared, wanted), False
    except BREAKDOWNS:
        return list(pages), True


# Time against error -------------------------------------------------------------------------------

RESOLUTIONS = (150, 200, 300, 400, 600)
RESOLUTIONS_QUICK = (150,)


@dataclass(frozen=True, slots=True)
class CurveRow:
    """A kind of sheet at one resolution, with one setting.

    Attributes
    ----------
    way : the shortcut that is left out, if any
    row : the results for its sheets
    """

    way: str
    dpi: int
    row: SceneRow


def _every_stroke() -> AbstractContextManager[object]:
    """Keep even the farthest strokes when poses of figures are weighed."""
    return patch.object(expected, "FARTHEST_SQUARED", 1500.0)


WAYS: Sequence[tuple[str, str, bool, Callable[[], AbstractContextManager[object]]]] = (
    ("plain sheet", "plain", False, nullcontext),
    ("plain sheet, far strokes weighed too", "plain", False, _every_stroke),
    ("answer sheet, zones asked for", "printed", True, nullcontext),
    ("answer sheet, all of it", "printed", False, nullcontext),
)
"""Each curve's title, its scene, whether reading is limited to zones, and the setting changed."""


def measure_curve(students: int, *, quick: bool = False) -> Iterator[CurveRow]:
    """Measure each kind of sheet with each setting at each resolution, the same students."""
    for way, scene, narrowed, switched in WAYS:
        for dpi in RESOLUTIONS_QUICK if quick else RESOLUTIONS:
            at = replace(scene_named(scene), dpi=float(dpi))
            with switched():
                row = measure_scene(at, students, memory=False, narrowed=narrowed)
            yield CurveRow(way, dpi, row)


def curve_tables(rows: Sequence[CurveRow]) -> Iterator[Table]:
    """The curves as a table, where any was measured."""
    if rows:
        heads = ["sheet", "dpi", "ms a page", "node, mm (median / p95)", "right", "confident", "misreads"]
        cells = [
            [
                one.way, str(one.dpi), f"{one.row.processor_ms:.0f}", pair(one.row.node_mm),
                percent(one.row.right), percent(one.row.confident), str(one.row.misreads),
            ]
            for one in rows
        ]  # fmt: skip
        yield "Reading: time against error by resolution, all stages", heads, cells


def curve_picture(rows: Sequence[CurveRow], path: Path) -> None:
    """The curves as a picture: median error of nodes over processor time."""
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for way in dict.fromkeys(one.way for one in rows):
        known = [(one.row, one.dpi) for one in rows if one.way == way]
        time_ms = [row.processor_ms for row, _ in known]
        error_mm = [np.nan if row.node_mm[0] is None else row.node_mm[0] for row, _ in known]
        axes.plot(time_ms, error_mm, marker="o", label=way)
        for x, y, (_, dpi) in zip(time_ms, error_mm, known, strict=True):
            axes.annotate(str(dpi), (x, y), textcoords="offset points", xytext=(4, 4), fontsize=8)
    axes.set(xlabel="processor time per page, ms", ylabel="median error of a node, mm", xlim=(0, None))
    axes.set_ylim(bottom=0)
    axes.legend(loc="lower left")
    with rc_context({"svg.hashsalt": "curve", "svg.fonttype": "none"}):
        figure.savefig(path, metadata={"Date": None})
