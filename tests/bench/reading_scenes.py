"""Scenes in which reading is measured: the student, the drawing, the paper and the scanner.

Foreign pages too, without the drawing asked for: nothing should be read on them.
"""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from grader.pipeline import read_pages
from grader.printed.answer_sheet import make_sheets
from grader.records import PageRef, ScannedPage
from grader.rubric import RubricFile, load_rubric
from grader.scan.page import open_page
from grader.tables.roster import RosterRow
from reference.authored.assignment import Assignment, Variant, load_assignment
from samples.simulation import (
    CAREFUL,
    SLOPPY,
    TYPICAL,
    HandStyle,
    PrintedSheet,
    Scan,
    Settings,
    SimulatedSheet,
    any_settings,
    simulate,
)
from samples.simulation.lettering import any_handwriting
from samples.simulation.mixture import Device
from samples.simulation.page import FRAMES_MM, draw_frame, print_squares
from samples.simulation.printing import printed_sheets
from samples.simulation.scanner import Background, DrawnPaper, digitise
from samples.simulation.settings import Colour, Habit
from samples.simulation.sketch import SheetSketch
from samples.simulation.view import view_of
from samples.simulation.wording import CAPTIONS, WORDS, declared_texts
from tests.bench.plain_text import Table
from tests.bench.reading_truth import SURE

_TRIES = 20


@dataclass(frozen=True, slots=True)
class ReadingScene:
    """A kind of sheet.

    Attributes
    ----------
    hands : one is chosen at random for each student
    mistakes : mean number of mistakes; with `wrong` at least one
    dpi : None for a random one
    printed : drawn on the printed answer sheet
    hardship : factor of the usual chance that a sheet is hard to read
    changed : the scene's change of a student's settings
    """

    name: str
    title: str
    assignment: str = "pump"
    hands: tuple[HandStyle, ...] = (CAREFUL, TYPICAL)
    mistakes: float = 0.0
    wrong: bool = False
    device: Device = "flatbed"
    dpi: float | None = 300.0
    printed: bool = False
    hardship: float = 1.0
    changed: Callable[[Settings], Settings] = lambda settings: settings


ALL_HANDS = (CAREFUL, TYPICAL, SLOPPY)
SCENES = (
    ReadingScene("plain", "flatbed 300 dpi, plain sheet"),
    ReadingScene("printed", "flatbed 300 dpi, answer sheet", printed=True),
    ReadingScene("sloppy", "sloppy hands", hands=(SLOPPY,)),
    ReadingScene("wrong", "wrong drawings", mistakes=1.0, wrong=True),
    ReadingScene("hard", "hard sheets", hardship=4.0),
    ReadingScene("150", "flatbed 150 dpi", dpi=150.0),
    ReadingScene("copies", "1-bit copies", device="copier"),
    ReadingScene("phone", "phone photos, answer sheet", device="phone", dpi=None, printed=True),
    ReadingScene("press", "press", assignment="press", hands=ALL_HANDS, mistakes=0.3),
    ReadingScene("engine", "engine", assignment="engine", hands=ALL_HANDS, mistakes=0.3),
    ReadingScene("shaper", "shaper", assignment="shaper", hands=ALL_HANDS, mistakes=0.3),
    ReadingScene("piston", "piston", assignment="piston", hands=ALL_HANDS, mistakes=0.3),
)


def _left(*habits: Habit) -> Callable[[Settings], Settings]:
    """A student who leaves these extras on the sheet."""
    return lambda own: replace(own, student=replace(own.student, habits=habits))


def _drawn(**pen: Any) -> Callable[[Settings], Settings]:
    """A student with another pen."""
    return lambda own: replace(own, pen=replace(own.pen, **pen))


def _seen(**scan: Any) -> Callable[[Settings], Settings]:
    """A student with another scanner."""
    return lambda own: replace(own, scan=replace(own.scan, **scan))


def _on(
    pitch_mm: float, colour: Colour, mode: Literal["grey", "colour"], **squares: float
) -> Callable[[Settings], Settings]:
    """A student who draws on squared paper, its lines further described as in `PageStyle`."""

    def changed(own: Settings) -> Settings:
        told: dict[str, Any] = {f"squares_{name}": value for name, value in squares.items()}
        page = replace(own.page, squared_mm=pitch_mm, squares=colour, **told)
        return replace(own, page=page, scan=replace(own.scan, mode=mode))

    return changed


def _in_pencil(on: Callable[[Settings], Settings]) -> Callable[[Settings], Settings]:
    """The same with a pencil that is no darker than many squares."""
    pencil = _drawn(
        line_mm=0.35, thin_mm=0.22, dark=0.55, thin_dark=0.38, grain=0.4, colour=_LEAD, plan_colour=None
    )
    return lambda own: on(pencil(own))


def _faint(own: Settings) -> Settings:
    """A hard pencil, half of which a copier loses."""
    pen = replace(own.pen, line_mm=0.35, thin_mm=0.2, dark=0.36, thin_dark=0.2, grain=0.4, colour=_LEAD)
    return replace(own, pen=replace(pen, plan_colour=None))


def _worn(own: Settings) -> Settings:
    """Folded twice, punched, with two stains of coffee."""
    return replace(own, scan=replace(own.scan, fold=True, crease=3.0, punched=True, stains=2))


def _office(**scan: Any) -> Callable[[Settings], Settings]:
    """An office scanner: paper made white, faint lines thin and dotted, 200 dpi, coarse JPEG."""
    usual: dict[str, Any] = {"mode": "grey", "container": "jpg", "jpeg_quality": 75}
    usual |= {"dpi_tag": 200.0, "levels": (50.0, 215.0)}
    return _seen(**(usual | scan))


_LEAD: Colour = (78, 78, 82)
_YELLOW: Colour = (236, 200, 40)
_ORANGE: Colour = (240, 170, 110)
_GREEN: Colour = (150, 205, 160)
_BROWN: Colour = (170, 130, 100)
PAPER_SCENES = tuple(
    replace(scene, hardship=0.0)
    for scene in (
        ReadingScene("erased", "vectors rubbed out", changed=_left("erased")),
        ReadingScene("struck", "a vector anew beside a struck one", changed=_left("struck")),
        ReadingScene("double", "lines drawn twice", changed=_drawn(doubled=1.0)),
        ReadingScene("sums", "full relative accelerations, dashed", changed=_drawn(sums="dashed")),
        ReadingScene("sums-full", "full relative accelerations", changed=_drawn(sums="full")),
        ReadingScene("helpers", "helper lines to the edge", changed=_left("long helpers")),
        ReadingScene("dimensions", "dimension lines", changed=_left("dimensions")),
        ReadingScene("sections", "hatched sections", changed=_left("hatched sections")),
        ReadingScene("overlapping", "overlapping figures", changed=_left("overlapping")),
        ReadingScene("third", "a third figure", changed=_left("third figure")),
        ReadingScene("yellow", "vectors in yellow", changed=lambda own: _drawn(plan_colour=_YELLOW)(
            _seen(mode="colour")(own))),
        ReadingScene("orange-1", "orange 1 mm paper, colour", changed=_on(1.0, _ORANGE, "colour")),
        ReadingScene("green-1-grey", "green 1 mm paper, grey scan", changed=_on(1.0, _GREEN, "grey")),
        ReadingScene("pencil-5", "pencil, dark broken 5 mm squares", changed=_in_pencil(
            _on(5.0, _LEAD, "grey", width_mm=0.25, dark=0.75, broken=0.5))),
        ReadingScene("pencil-1", "pencil, brown bent 1 mm paper", changed=_in_pencil(
            _on(1.0, _BROWN, "grey", dark=0.9, bent_mm=0.4))),
        ReadingScene("pencil-7", "pencil, 7 mm squares turned", changed=_in_pencil(
            _on(7.0, _LEAD, "grey", width_mm=0.2, dark=0.75, turn_deg=-2.5, bent_mm=0.5))),
        ReadingScene("worn", "folds, holes, coffee", changed=_worn),
        ReadingScene("sharpened", "unsharp mask, coarse JPEG",
                     changed=_seen(sharpen=1.2, jpeg_tables="web_low", container="jpg")),
        ReadingScene("faint", "faint 1-bit copies", device="copier", changed=_faint),
        ReadingScene("dithered", "1 bit, dithered", device="copier", changed=_seen(dithered=True)),
        ReadingScene("office", "office scanner, 200 dpi", dpi=200.0, changed=_office()),
        ReadingScene("office-hard", "office scanner, lines dotted", dpi=200.0, changed=_office(
            levels=(90.0, 190.0), container="pdf")),
        ReadingScene("cropped", "office scanner, cropped and deskewed", dpi=200.0, changed=_office(
            skew_deg=0.03, cropped_mm=4.0)),
        ReadingScene("office-printed", "office scanner, answer sheet", dpi=200.0, printed=True,
                     changed=_office(skew_deg=0.03, cropped_mm=4.0)),
        ReadingScene("curled", "photos of a curled answer sheet", device="phone", dpi=None, printed=True,
                     changed=_seen(curl_mm=2.5)),
    )
)  # fmt: skip
"""Paper, habits and copies that the other scenes have seldom or never, each by itself."""


@dataclass(frozen=True, slots=True)
class SceneWork:
    """One student's sheets, with their assignment, variant and rubric."""

    scene: ReadingScene
    seed: int
    assignment: Assignment
    variant: Variant
    rubric: RubricFile
    sheets: Sequence[SimulatedSheet]

    @property
    def declared(self) -> dict[str, str]:
        """The scales as the student declares them."""
        return declared_texts(self.sheets[0].truth["scales"]["declared"])


def scene_named(name: str) -> ReadingScene:
    """The scene of this name. Raises KeyError."""
    return {scene.name: scene for scene in (*SCENES, *PAPER_SCENES)}[name]


def works(scene: ReadingScene, students: int, first_seed: int = 1) -> Iterator[SceneWork]:
    """Students of a scene; the same seeds give the same sheets."""
    for seed in range(first_seed, first_seed + students):
        yield work(scene, seed)


def work(scene: ReadingScene, seed: int, most: int | None = None) -> SceneWork:
    """One student of a scene; of more sheets than `most` only the first."""
    assignment, rubric = task_named(scene.assignment)
    variants = assignment.variants()
    variant = variants[seed % len(variants)]
    settings = _settings(scene, assignment, variant, seed)
    printed = answer_sheets(assignment, variant) if scene.printed else None
    sheets = simulate(assignment, variant, seed, settings, printed=printed, most=most)
    return SceneWork(scene, seed, assignment, variant, rubric, sheets)


@cache
def task_named(name: str) -> tuple[Assignment, RubricFile]:
    """A built-in assignment and its rubric."""
    assignment = load_assignment(name)
    return assignment, load_rubric(assignment.file.rubric, beside=assignment.path)


def _settings(scene: ReadingScene, assignment: Assignment, variant: Variant, seed: int) -> Settings:
    """A random student's settings for the scene; for wrong drawings, of one who makes a mistake."""
    lot = np.random.default_rng([seed, 9])
    hand = scene.hands[int(lot.integers(len(scene.hands)))]
    for again in range(_TRIES):
        settings = any_settings(
            seed + 100_000 * again, device=scene.device, dpi=scene.dpi, mistakes=scene.mistakes,
            work=(assignment, variant), hardship=scene.hardship,
        )  # fmt: skip
        if settings.student.mistakes or not scene.wrong:
            break
    return scene.changed(replace(settings, hand=hand))


def answer_sheets(assignment: Assignment, variant: Variant) -> Mapping[str, PrintedSheet]:
    """The answer sheet given to this student."""
    row = RosterRow("s01", "", n=variant.n, position=variant.position)
    sheets = make_sheets(assignment, [row])
    return printed_sheets(sheets.pdf, sheets.layout)


PAGES, PAGES_QUICK = 2, 1
READ_AS = ("pump", "press")
OTHERS = ("press", "engine", "shaper", "piston")
BREAKDOWNS = (ArithmeticError, LookupError, ValueError)
"""Errors that the reader must never raise; a page with one counts as a breakdown."""
_FIRST_SEED = 700


@dataclass(frozen=True, slots=True)
class ForeignRow:
    """A kind of foreign page: the number of pages, and of vectors read on them.

    Attributes
    ----------
    readings : each page is read as several assignments
    vectors, confident : those reported, and those reported with confidence
    failed : readings in which the reader broke down
    """

    kind: str
    readings: int
    vectors: int
    confident: int
    failed: int = 0


def measure_foreign(*, quick: bool = False) -> Iterator[ForeignRow]:
    """Measure every kind of foreign page; a quick run reads one each of a few kinds, as one assignment."""
    pages, names = (PAGES_QUICK, READ_AS[:1]) if quick else (PAGES, READ_AS)
    seeds = range(_FIRST_SEED, _FIRST_SEED + pages)
    for kind, draw in _WRITTEN.items():
        yield _row(kind, [(_page(draw, seed), names) for seed in seeds])
    if not quick:
        yield _row("answer sheet left empty", [(_empty_form(_FIRST_SEED), READ_AS[:1])])
    for other in OTHERS[: 1 if quick else None]:
        foreign = [name for name in names if name != other]
        drawn = [(sheet, foreign) for seed in seeds for sheet in _drawing(other, seed)]
        yield _row(f"a drawing for {other}", drawn)


def foreign_tables(rows: Sequence[ForeignRow]) -> Iterator[Table]:
    """The rows as a table, where there are any."""
    if rows:
        heads = ["page", "readings", "vectors reported", "with confidence", "broken down"]
        cells = [
            [row.kind, *map(str, (row.readings, row.vectors, row.confident, row.failed))] for row in rows
        ]
        yield "Reading: pages without the drawing asked for", heads, cells


def _row(kind: str, pages: Sequence[tuple[SimulatedSheet, Sequence[str]]]) -> ForeignRow:
    """Read each page as each of the assignments."""
    row = ForeignRow(kind, 0, 0, 0)
    with tempfile.TemporaryDirectory() as folder:
        for number, (sheet, names) in enumerate(pages):
            path = sheet.save(Path(folder) / f"{number}")
            page = open_page(PageRef(path.name, path=path))
            for name in names:
                row = _counted(row, _confidences(page, name, number))
    return row


def _counted(row: ForeignRow, found: Sequence[float] | None) -> ForeignRow:
    """Add one reading by the confidences of its vectors; None if the reader broke down."""
    sure = sum(confidence >= SURE for confidence in found or ())
    return ForeignRow(
        row.kind, row.readings + 1, row.vectors + len(found or ()), row.confident + sure,
        row.failed + (found is None),
    )  # fmt: skip


def _confidences(page: ScannedPage, name: str, number: int) -> list[float] | None:
    """Confidences of the vectors reported when a page is read as an assignment; None if that breaks down."""
    assignment, rubric = task_named(name)
    variants = assignment.variants()
    try:
        variant = variants[number % len(variants)]
        reading = read_pages([page], assignment, variant, {}, rubric.vectors)[0].reading
    except BREAKDOWNS:
        return None
    return [one.confidence for figure in reading.figures.values() for one in figure.vectors.values()]


def _drawing(name: str, seed: int) -> list[SimulatedSheet]:
    """A student's work for another assignment."""
    assignment, _ = task_named(name)
    variants = assignment.variants()
    variant = variants[seed % len(variants)]
    settings = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.0)
    return simulate(assignment, variant, seed, settings)


def _empty_form(seed: int) -> SimulatedSheet:
    """A printed answer sheet as handed out."""
    assignment, _ = task_named(READ_AS[0])
    printed = answer_sheets(assignment, assignment.variants()[0])
    return _page(lambda _: None, seed, next(iter(printed.values())).background)


def _page(
    draw: Callable[[SheetSketch], None], seed: int, background: Background | None = None
) -> SimulatedSheet:
    """Draw a page and scan it."""
    rng = np.random.default_rng([seed, 11])
    settings = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.0)
    settings = replace(settings, scan=replace(settings.scan, dpi_tag=300.0))
    sketch = SheetSketch(rng, settings.hand, settings.pen, settings.page, any_handwriting(rng))
    draw(sketch)
    return _scanned(sketch, settings, background)


def _scanned(sketch: SheetSketch, settings: Settings, background: Background | None) -> SimulatedSheet:
    scan: Scan = settings.scan
    view = view_of(scan, sketch.rng)
    image = digitise(DrawnPaper(sketch.strokes, settings.pen, background), scan, view, sketch.rng)
    return SimulatedSheet(image, {}, settings)


# Contents of the pages -------------------------------------------------------------------------------


def _text(sketch: SheetSketch) -> None:
    """Draw a page of notes inside a frame."""
    draw_frame(sketch)
    words = [word for texts in CAPTIONS.values() for kinds in texts.values() for word in kinds]
    words += [word for told in WORDS.values() for word in told.values()]
    x, y, w, h = FRAMES_MM["iso"]
    height = 4.5
    for row in range(round((h - 20.0) / (2.2 * height))):
        at = x + 8.0
        while at < x + w - 70.0:
            word = str(sketch.rng.choice(words))
            place = complex(at, -(y + 12.0 + 2.2 * height * row) - height)
            at = sketch.text(place, word, height).high.real + 4.0


def _table(sketch: SheetSketch) -> None:
    """Draw a ruled table with numbers in its cells."""
    draw_frame(sketch)
    x, y, w, h = FRAMES_MM["iso"]
    columns = np.linspace(x + 15.0, x + w - 15.0, int(sketch.rng.integers(6, 12)))
    rows = np.linspace(y + 15.0, y + h - 30.0, int(sketch.rng.integers(10, 20)))
    pen = sketch.pen("line")
    for at in columns:
        sketch.line(pen, complex(at, -rows[0]), complex(at, -rows[-1]))
    for at in rows:
        sketch.line(pen, complex(columns[0], -at), complex(columns[-1], -at))
    for left in columns[:-1]:
        for top in rows[1:]:
            sketch.text(complex(left + 3.0, -top + 3.0), f"{sketch.rng.uniform(0, 99):.2f}", 3.5)


def _squares(sketch: SheetSketch) -> None:
    """Draw empty squared paper."""
    sketch.page = replace(sketch.page, squared_mm=5.0)
    print_squares(sketch)


def _curves(sketch: SheetSketch) -> None:
    """Draw diagrams of curves over time, with axes: another part of the same course."""
    draw_frame(sketch)
    pen = sketch.pen("line")
    for left in (40.0, 235.0):
        for top in (25.0, 115.0, 205.0):
            corner = complex(left, -top - 60.0)
            sketch.line(pen, corner, corner + 65j)
            sketch.line(pen, corner, corner + 165.0)
            share = np.linspace(0.0, 1.0, 60)
            wave = sum(
                sketch.rng.normal(0.0, 12.0 / k) * np.sin(2 * np.pi * k * share + sketch.rng.uniform(0, 6))
                for k in (1, 2, 3)
            )
            points = corner + 160.0 * share + 1j * (30.0 + np.clip(wave, -28.0, 28.0))
            sketch.curve(pen, np.asarray(points, dtype=np.complex128))
            sketch.text(corner + 68j, str(sketch.rng.choice(["s(t)", "v(t)", "a(t)"])), 4.5)


_WRITTEN: Mapping[str, Callable[[SheetSketch], None]] = {
    "blank paper": lambda _: None,
    "text": _text,
    "a table": _table,
    "squared paper": _squares,
    "curves with axes": _curves,
}
