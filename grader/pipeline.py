"""A submission's whole way, from the pages of its files to a mark.

    page -> sheet (millimetres) -> ink (strokes) -> reading (named vectors) -> judgement -> report

Measurements typed in by hand join at the judgement: they are a reading made by hand. Only this
module knows the order of the stages.
"""

import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader.documents import ReadingDocument, ReportDocument
from grader.feedback import Level, criterion_feedback
from grader.ink import find_ink
from grader.intake import is_blank, page_of
from grader.judging import Submission, Task, judge, report_of, task_of, unjudged_report
from grader.measurements import Measurements
from grader.outcomes import Judgement
from grader.picture import overlay
from grader.quantities import ByRule, Declared, parse_scale
from grader.reading import read_figures
from grader.reading_document import reading_document
from grader.records import Ink, Page, Problem, Reading, Sheet
from grader.rubric import RubricFile
from grader.scene import Picture
from grader.sheet import rectify, straighten
from reference.assignment import Assignment, Scales, Variant
from reference.construction import Vector
from reference.errors import InputFileError, MechanismError
from reference.mechanism import Crank


@dataclass(frozen=True, slots=True)
class Place:
    """A page of a file, from 1; `name` is the file as the user knows it."""

    path: Path
    page: int
    name: str


@dataclass(frozen=True, slots=True)
class Work:
    """What one student handed in for one variant.

    Attributes
    ----------
    variant : None where nothing says the student's number or position
    declared : scales as declared, text by ``kL``, ``kv``, ``ka``
    measured : entered measurements, or None
    problems : what was noticed before marking
    """

    student_id: str
    variant: Variant | None
    pages: tuple[Place, ...] = ()
    declared: Mapping[str, str] = field(default_factory=dict)
    measured: Measurements | None = None
    lang: str = "en"
    name: str = ""
    problems: tuple[Problem, ...] = ()


@dataclass(frozen=True, slots=True)
class Seen:
    """A page and what is on it, before names are given.

    `page`, `sheet` and `ink` are None from where the way ended; `problems` says why.
    """

    place: Place
    page: Page | None = None
    sheet: Sheet | None = None
    ink: Ink | None = None
    problems: tuple[Problem, ...] = ()
    timing_ms: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Marked:
    """A submission's report and a picture of each of its pages."""

    work: Work
    report: ReportDocument
    pictures: tuple[Picture, ...] = ()


def mark(work: Work, assignment: Assignment, rubric: RubricFile, level: Level = "full") -> Marked:
    """Mark one submission. A bad file or drawing becomes a problem of its report, never an error."""
    seen = [see(place) for place in work.pages]
    readings = read(seen, assignment, work.variant, work.declared, rubric.vectors)
    documents = documents_of(seen, readings, work.student_id)
    judged = _judged(work, assignment, rubric, readings)
    if isinstance(judged, Problem):
        problems = (*work.problems, *_problems_of(seen), judged)
        report = unjudged_report(
            assignment, rubric, work.variant or Variant(), work.student_id,
            "unreadable" if work.pages or work.measured else "missing", problems=problems, sheets=documents,
        )  # fmt: skip
        return Marked(work, report, _pictures(seen, readings, {}, None, level))
    task, judgement = judged
    names = assignment.file.names
    report = report_of(
        task,
        judgement,
        work.student_id,
        language=work.lang,
        sentences={
            outcome.criterion: criterion_feedback(outcome, work.lang, level, names)
            for outcome in judgement.outcomes
        },
        problems=(*work.problems, *_problems_of(seen), *_measuring_problems(work)),
        sheets=documents,
    )
    return Marked(work, report, _pictures(seen, readings, task.construction.vectors, judgement, level))


def see(place: Place) -> Seen:
    """A page to millimetres and strokes."""
    timing: dict[str, float] = {}
    try:
        with _timed(timing, "decode"):
            page = replace(page_of(place.path, place.page), source=place.name)
    except InputFileError as error:
        return Seen(place, problems=(Problem(error.code, error.message, place.name),), timing_ms=timing)
    if is_blank(page):
        problem = Problem("page_blank", f"{place.name}: page {place.page} is blank", place.name)
        return Seen(place, page, problems=(problem,), timing_ms=timing)
    with _timed(timing, "sheet"):
        sheet = rectify(page)
        if isinstance(sheet, Sheet):
            page, sheet = straighten(page, sheet)
    if not isinstance(sheet, Sheet):
        problem = Problem("sheet_refused", f"{place.name}: page {place.page}: {sheet.reason}", place.name)
        return Seen(place, page, problems=(problem,), timing_ms=timing)
    with _timed(timing, "ink"):
        ink = find_ink(page, sheet)
    problems = tuple(replace(problem, file=place.name) for problem in sheet.problems)
    return Seen(place, page, sheet, ink, problems, timing)


def read(
    seen: Sequence[Seen],
    assignment: Assignment,
    variant: Variant | None,
    declared: Mapping[str, str],
    wanted: Collection[str],
) -> list[Reading]:
    """What was drawn on each page, with names; an empty reading where the way ended before."""
    usable = [one for one in seen if one.sheet is not None and one.ink is not None]
    timing: dict[str, float] = {}
    with _timed(timing, "reading"):
        scales = None if variant is None else _declared_scales(assignment, variant, declared)
        inks = [one.ink for one in usable if one.ink is not None]
        sheets = [one.sheet for one in usable if one.sheet is not None]
        found = iter(read_figures(inks, sheets, assignment, variant, scales, wanted) if usable else ())
    readings = []
    for one in seen:
        is_read = one.sheet is not None and one.ink is not None
        readings.append(next(found) if is_read else Reading({}))
        one.timing_ms["reading"] = timing["reading"] / len(usable) if is_read else 0.0
    return readings


def _declared_scales(assignment: Assignment, variant: Variant, declared: Mapping[str, str]) -> Scales:
    """The scales as declared where they can be understood, else by the assignment's rule."""
    known: dict[str, float] = {}
    units = assignment.file.scales.bare_units
    for name, text in declared.items():
        match parse_scale(name, text, bare_unit=units.get(name)):  # type: ignore[call-overload]
            case Declared(per_mm=value):
                known[name] = value
            case ByRule() as rule:
                values = {**_crank_speed(assignment, variant), **known}
                if rule.powers.keys() <= values.keys():
                    known[name] = rule.per_mm(values)
    return assignment.scales([variant], **known)


def _crank_speed(assignment: Assignment, variant: Variant) -> dict[str, float]:
    """Omega of the crank; nothing where a slider drives."""
    driver = assignment.mechanism([variant]).driver
    return {"omega": abs(float(driver.omega[0]))} if isinstance(driver, Crank) else {}


def documents_of(
    seen: Sequence[Seen], readings: Sequence[Reading], student_id: str | None
) -> list[ReadingDocument]:
    """The pages' readings as documents."""
    return [
        reading_document(
            one.place.name, one.place.page, student_id, one.sheet,
            replace(reading, problems=(*one.problems, *reading.problems)), one.timing_ms,
        )
        for one, reading in zip(seen, readings, strict=True)
    ]  # fmt: skip


def _judged(
    work: Work, assignment: Assignment, rubric: RubricFile, readings: Sequence[Reading]
) -> tuple[Task, Judgement] | Problem:
    """The judgement, or why there is none."""
    drawn = tuple(reading for reading in readings if reading.figures)
    if work.variant is None:
        return Problem(
            "variant_unknown", "nothing says this student's number or position: add it to the roster"
        )
    if not drawn and work.measured is None:
        if not work.pages:
            return Problem("nothing_handed_in", "nothing was handed in")
        return Problem("nothing_read", "no figure of this assignment could be read on the pages handed in")
    measured = work.measured
    submission = Submission(
        readings=drawn,
        measured=None if measured is None else measured.reading,
        values={} if measured is None else measured.values,
        declared={**work.declared, **({} if measured is None else measured.scales)},
    )
    try:
        task = task_of(assignment, rubric, work.variant)
    except MechanismError as error:
        return Problem(error.code, error.message)
    return task, judge(task, submission)


def _problems_of(seen: Sequence[Seen]) -> list[Problem]:
    return [problem for one in seen for problem in one.problems]


def _measuring_problems(work: Work) -> tuple[Problem, ...]:
    return () if work.measured is None else (*work.measured.problems, *work.measured.reading.problems)


def _pictures(
    seen: Sequence[Seen],
    readings: Sequence[Reading],
    vectors: Mapping[str, Vector],
    judgement: Judgement | None,
    level: Level,
) -> tuple[Picture, ...]:
    outcomes = {} if judgement is None else {outcome.name: outcome for outcome in judgement.outcomes}
    return tuple(
        overlay(one.page, one.sheet, reading, vectors, outcomes, show_expected=level == "full")
        for one, reading in zip(seen, readings, strict=True)
        if one.page is not None
    )


@contextmanager
def _timed(timing_ms: dict[str, float], stage: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        timing_ms[stage] = 1000.0 * (time.perf_counter() - start)
