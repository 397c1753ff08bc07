"""Simulated students' scans, read once and stored, so that they can be judged many times.

The kinds of sheets are those that instructors get: flatbed scans of plain and printed sheets, 1-bit copies,
photos, and sloppy hands. Half of the drawings are right, a third have one mistake, the others two. Force
sheets, plain and printed, are a kind of their own: a third are right, the others have one mistake in forces;
those of a further kind have two.
"""

import pickle
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from grader.pipeline import read_submission, scan
from grader.records import PageRef, Reading
from grader.rubric import asked_of
from grader.tables.measurements import StudentSubmission
from reference.authored.assignment import Variant
from reference.construction.graph import Vector
from samples.simulation import Settings, SimulatedSheet, any_settings, simulate
from samples.simulation.forces import any_drawer_of_forces
from samples.simulation.mixture import Device
from samples.simulation.student import drawn_by
from samples.simulation.wording import declared_texts
from tests.bench.judging_students import (
    HANDS,
    Kind,
    StudentKey,
    StudentWork,
    assignment_named,
    codes_of,
    is_hidden,
    vectors_of,
)
from tests.bench.reading_scenes import answer_sheets

_TRIES = 40
SCANNED = ("pump", "press", "engine", "shaper", "piston")
WITH_FORCES = ("pump-forces", "press-forces")
KIND_SHARES: Mapping[Kind, float] = {"right": 0.5, "single": 0.35, "pair": 0.15}
FORCE_SHARES: Mapping[Kind, float] = {"right": 0.35, "single": 0.65}


@dataclass(frozen=True, slots=True)
class SheetKind:
    """A kind of sheet: device, resolution, paper and hands."""

    title: str
    device: Device = "flatbed"
    dpi: float | None = 300.0
    printed: bool = False
    hands: tuple[str, ...] = ("careful", "typical")
    assignments: tuple[str, ...] = SCANNED
    shares: Mapping[Kind, float] = field(default_factory=lambda: KIND_SHARES)


SHEET_KINDS: Mapping[str, SheetKind] = {
    "flatbed": SheetKind("flatbed 300 dpi, plain sheet"),
    "printed": SheetKind("flatbed 300 dpi, answer sheet", printed=True),
    "copies": SheetKind("1-bit copies", device="copier"),
    "phone": SheetKind("phone photos, answer sheet", device="phone", dpi=None, printed=True),
    "sloppy": SheetKind("flatbed 300 dpi, sloppy hands", hands=("sloppy",)),
    "forces": SheetKind("force sheets", assignments=(*WITH_FORCES, "shaper-forces"), shares=FORCE_SHARES),
    "forces-two": SheetKind(
        "force sheets, two mistakes", assignments=(*WITH_FORCES, "shaper-forces"), shares={"pair": 1.0}
    ),
    "forces-printed": SheetKind(
        "force sheets, answer sheet", printed=True, assignments=WITH_FORCES, shares=FORCE_SHARES
    ),
}


@dataclass(frozen=True, slots=True)
class ReadWork:
    """A student's sheets as they were read, and the scales as the student declares them."""

    kind: str
    work: StudentWork
    readings: tuple[Reading, ...]
    declared: Mapping[str, str]


def read_works(kind: str, seeds: Sequence[int], kept: Path | None = None) -> Iterator[ReadWork]:
    """Students of a kind of sheets, each drawn, scanned and read, or taken from the folder `kept`.

    Students whose mistakes cannot be drawn are left out.
    """
    for seed in seeds:
        path = None if kept is None else kept / f"{kind}-{seed}.pkl"
        read = stored(path, partial(_read, kind, seed))
        if read is not None:
            yield read


Read = TypeVar("Read")


def stored(path: Path | None, read: Callable[[], Read | None]) -> Read | None:
    """Load a result from a file; if there is no file, call `read` and store its result unless it is None."""
    if path is not None and path.exists():
        return pickle.loads(path.read_bytes())  # type: ignore[no-any-return]  # noqa: S301 - written below
    found = read()
    if found is not None and path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(found))
    return found


def _read(kind: str, seed: int) -> ReadWork | None:
    made = drawn_on(SHEET_KINDS[kind], *_student(kind, seed))
    if made is None:
        return None
    work, pages = made
    declared = declared_texts(work.task.declared)
    return ReadWork(kind, work, read_under(work, work.variant, declared, pages), declared)


def _student(kind: str, seed: int) -> tuple[StudentKey, np.random.Generator]:
    lot = np.random.default_rng([seed, sum(map(ord, kind)), 77])
    own = SHEET_KINDS[kind]
    hand = own.hands[int(lot.integers(len(own.hands)))]
    what: Kind = lot.choice(list(own.shares), p=list(own.shares.values()))
    return StudentKey(own.assignments[seed % len(own.assignments)], hand, what, seed), lot


def drawn_on(
    kind: SheetKind, key: StudentKey, lot: np.random.Generator
) -> tuple[StudentWork, list[SimulatedSheet]] | None:
    """Draw a student's work and its pages; None if it cannot be drawn in many tries."""
    assignment, rubric = assignment_named(key.assignment)
    variants = assignment.variants()
    variant = variants[int(lot.integers(len(variants)))]
    printed = answer_sheets(assignment, variant) if kind.printed else None
    for _ in range(_TRIES):
        seed = int(lot.integers(10_000_000))
        settings = any_settings(seed, device=kind.device, dpi=kind.dpi, mistakes=0.0)
        habits = replace(settings.student, mistakes=codes_of(key, lot))
        settings = replace(settings, hand=HANDS[key.hand], student=habits)
        if assignment.forces is not None:
            settings = with_forces(settings, lot)
        try:
            desk, drawn = drawn_by(assignment, variant, seed, settings, printed=printed)
        except ValueError:  # a mistake that cannot be made here
            continue
        if is_hidden(desk.task) or (printed and not all(sheet.kind in printed for sheet in drawn)):
            continue
        pages = simulate(assignment, variant, seed, settings, printed=printed)
        figures = [figure for page in pages for figure in page.truth["figures"].values()]
        due = vectors_of(desk.task.right, ())
        left_out = {
            name
            for figure in figures
            for name, reason in figure.get("missing", {}).items()
            if not _lies_under_lines(figure, desk.task.right.construction.vectors[name])
            # A force that is laid off with no length by mistake is wrong, not left out.
            and not (reason == "too short to draw" and abs(due[name]) > SHORT_MM)
        }
        work = StudentWork(
            key,
            assignment,
            rubric,
            desk.task,
            drawn,
            declares=True,
            letters=True,
            left_out=frozenset(left_out),
        )
        return work, pages
    return None


def with_forces(settings: Settings, lot: np.random.Generator) -> Settings:
    """Return the settings with habits in force polygons; a force without an arrowhead is none."""
    pen = replace(settings.pen, arrow="open") if settings.pen.arrow == "none" else settings.pen
    return replace(settings, student=any_drawer_of_forces(settings.student, lot), pen=pen)


ON_LINE_MM, STEPS, SHORT_MM = 0.6, 50, 4.0


def _lies_under_lines(figure: Mapping[str, Any], vector: Vector) -> bool:
    """Return whether other lines of a plan, as thick as vectors, cover a vector that is not drawn.

    On the sheet nobody could see that it is not drawn.
    """
    lines = [one["line_mm"] for one in figure["vectors"].values()] + [*figure["sides"].values()]
    ends = np.array([[complex(*p), complex(*q)] for p, q in filter(None, lines)]).reshape(-1, 2)
    tail, head = (complex(*figure["nodes"][end]) for end in (vector.tail, vector.head))
    points = tail + (head - tail) * np.linspace(0.0, 1.0, STEPS)[:, None]
    along = ends[:, 1] - ends[:, 0]
    share = np.clip(((points - ends[:, 0]) * np.conj(along)).real / np.abs(along) ** 2, 0.0, 1.0)
    apart = np.abs(points - ends[:, 0] - share * along)
    is_point = abs(head - tail) < 2.0 * ON_LINE_MM
    return not is_point and bool((apart.min(axis=1, initial=np.inf) <= ON_LINE_MM).all())


def read_under(
    work: StudentWork, variant: Variant, declared: Mapping[str, str], pages: Sequence[SimulatedSheet]
) -> tuple[Reading, ...]:
    """The pages as read for a variant and these scales."""
    asked = asked_of(work.assignment, work.rubric)
    with tempfile.TemporaryDirectory() as folder:
        paths = [page.save(Path(folder) / str(number)) for number, page in enumerate(pages)]
        refs = tuple(PageRef(path.name, path=path) for path in paths)
        submission = StudentSubmission("s", variant, refs, declared)
        read = read_submission(submission, [scan(ref, asked) for ref in refs], work.assignment, asked)
    return tuple(page.reading for page in read)
