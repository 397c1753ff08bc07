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

from grader.declaring import Declarations, Source, declarations, sure_texts
from grader.documents import ReadingDocument, ReportDocument
from grader.feedback.sentences import Level, criterion_feedback
from grader.feedback.telling import with_mistakes_told
from grader.ink import find_ink
from grader.intake import changed, is_blank, load, page_of
from grader.judging import Submission, Task, judge, task_of
from grader.letters import find_letters, written_lengths, written_scales
from grader.measurements import Measurements
from grader.outcomes import Judgement
from grader.picture import Backdrop, backdrop, overlay
from grader.quantities import ByRule, Declared, parse_scale
from grader.reading import read_figures
from grader.reading_document import reading_document
from grader.records import MECHANISM, Box, Ink, Page, Problem, Reading, Sheet, Unread, Written
from grader.reports import report_of, unjudged_report
from grader.rubric import RubricFile
from grader.scene import Picture
from grader.scene_measured import measured_picture
from grader.sheet import rectify, straighten
from reference.assignment import Assignment, Scales, Variant
from reference.construction import Construction
from reference.derivation import construction_of
from reference.errors import InputFileError, MechanismError
from reference.mechanism import Crank

ZONE_SLACK_MM = 2.0
"""Half of the gap between the zones of a printed sheet."""


@dataclass(frozen=True, slots=True)
class Place:
    """A page of a file, from 1; `name` is the file as the user knows it.

    Attributes
    ----------
    digest : of the content whose page is meant; empty where any content will do
    problem : why the page cannot be used, where that is known already: then it is not opened
    """

    path: Path
    page: int
    name: str
    digest: str = ""
    problem: Problem | None = None


@dataclass(frozen=True, slots=True)
class Work:
    """What one student handed in for one variant.

    Attributes
    ----------
    variant : None where nothing says the student's number or position
    declared : scales as declared, text by ``kL``, ``kv``, ``ka``
    measured : entered measurements, or None
    problems : what was noticed before marking
    has_unusable : whether something was handed in that cannot be used; `problems` say what
    """

    student_id: str
    variant: Variant | None
    pages: tuple[Place, ...] = ()
    declared: Mapping[str, str] = field(default_factory=dict)
    measured: Measurements | None = None
    lang: str = "en"
    name: str = ""
    problems: tuple[Problem, ...] = ()
    has_unusable: bool = False


@dataclass(frozen=True, slots=True)
class Seen:
    """A page and what is on it, before names are given.

    `page`, `sheet` and `ink` are None from where the way ended; `problems` says why. `narrowed` where
    zones of the printed sheet were passed over because nothing in them is asked for. `written` holds
    what stands in the printed boxes for scales.
    """

    place: Place
    page: Page | None = None
    sheet: Sheet | None = None
    ink: Ink | None = None
    problems: tuple[Problem, ...] = ()
    timing_ms: dict[str, float] = field(default_factory=dict)
    narrowed: bool = False
    written: Mapping[str, Written] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Looked:
    """One page as read, without its pixels: all that marking needs, and what a later run may keep.

    Attributes
    ----------
    document : the reading as it is reported
    backdrop : the cleaned scan to draw on; None where the page could not be decoded
    """

    document: ReadingDocument
    reading: Reading
    problems: tuple[Problem, ...] = ()
    backdrop: Backdrop | None = None


@dataclass(frozen=True, slots=True)
class Marked:
    """A submission's report and a picture of each of its pages."""

    work: Work
    report: ReportDocument
    pictures: tuple[Picture, ...] = ()


def mark(work: Work, assignment: Assignment, rubric: RubricFile, level: Level = "full") -> Marked:
    """Mark one submission. A bad file or drawing becomes a problem of its report, never an error."""
    return mark_looked(work, assignment, rubric, look(work, assignment, rubric), level)


def look(work: Work, assignment: Assignment, rubric: RubricFile) -> tuple[Looked, ...]:
    """All pages of a submission as read: every vector of the figures that the rubric asks anything of."""
    figures, wanted = asked_of(assignment, rubric)
    seen = [see(place, figures) for place in work.pages]
    readings = read(seen, assignment, work.variant, work.declared, wanted)
    found = {figure for reading in readings for figure in reading.figures}
    if any(one.narrowed for one in seen) and not figures <= found:
        # Not in its zone: people draw where they like.
        seen = [see(one.place) if one.narrowed else one for one in seen]
        readings = read(seen, assignment, work.variant, work.declared, wanted)
    readings = [
        replace(reading, lengths=_lengths(one, assignment, rubric))
        for one, reading in zip(seen, readings, strict=True)
    ]
    documents = documents_of(seen, readings, work.student_id)
    return tuple(
        Looked(document, reading, one.problems, None if one.page is None else backdrop(one.page, one.sheet))
        for document, reading, one in zip(documents, readings, seen, strict=True)
    )


def _lengths(one: Seen, assignment: Assignment, rubric: RubricFile) -> dict[str, tuple[float, float]]:
    """The measured lengths that stand in a printed sheet's cells."""
    if one.page is None or one.sheet is None or not one.sheet.zones:
        return {}
    from grader.answer_sheet.sheets import cells_of  # noqa: PLC0415 - brings the PDF writer; plain sheets do without

    return written_lengths(one.page, one.sheet, cells_of(assignment, tuple(one.sheet.zones), rubric.vectors))


def asked_of(assignment: Assignment, rubric: RubricFile) -> tuple[frozenset[str], tuple[str, ...]]:
    """The figures that a rubric asks anything of, with the sketch, and all their vectors.

    Both are empty where it asks for no vector: then everything is read.
    """
    construction = construction_of(
        assignment.mechanism(assignment.variants()[:1]),
        accelerations=rubric.needs_accelerations,
        plate_by_similarity=assignment.file.plate_images == "similarity",
    )
    known = [construction.vectors[name] for name in rubric.vectors if name in construction.vectors]
    plans = dict.fromkeys(construction.figure_of(vector.head) for vector in known)
    names = tuple(vector.name for plan in plans for vector in construction.vectors_of(plan))
    return (frozenset({MECHANISM, *plans}), names) if plans else (frozenset(), ())


def mark_looked(
    work: Work,
    assignment: Assignment,
    rubric: RubricFile,
    looked: Sequence[Looked],
    level: Level = "full",
    *,
    with_ghosts: bool = True,
) -> Marked:
    """Mark a submission whose pages were read, now or in an earlier run.

    Arguments: pictures show expected vectors beside wrong ones at level `full`, unless without `with_ghosts`.
    """
    with_ghosts = with_ghosts and level == "full"
    looked = [_only(one, rubric.vectors) for one in looked]
    readings = [one.reading for one in looked]
    documents = [one.document for one in looked]
    judged = _judged(work, assignment, rubric, readings)
    if isinstance(judged, Problem):
        problems = (*work.problems, *_problems_of(looked), judged)
        report = unjudged_report(
            assignment, rubric, work.variant or Variant(), work.student_id,
            "unreadable" if work.pages or work.measured or work.has_unusable else "missing",
            problems=problems, sheets=documents,
        )  # fmt: skip
        return Marked(work, report, _pictures(looked, None, None, show_expected=with_ghosts))
    task, judgement, declared = judged
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
        problems=(*work.problems, *_problems_of(looked), *_measuring_problems(work), *declared.problems),
        sheets=documents,
    )
    report = _with_sources(report, declared.sources)
    report = with_mistakes_told(report, judgement, assignment, task.variant, work.lang, level)
    pictures = _pictures(looked, task.construction, judgement, show_expected=with_ghosts)
    return Marked(work, report, pictures or _as_measured(work, task, judgement, show_expected=with_ghosts))


def _only(one: Looked, names: Collection[str]) -> Looked:
    """What could not be read of a page, as far as it is asked for."""
    if not names:
        return one
    unread = tuple(gap for gap in one.reading.unread if gap.name in names)
    told = [gap for gap in one.document.unread if gap.name in names]
    document = one.document.model_copy(update={"unread": told})
    return replace(one, document=document, reading=replace(one.reading, unread=unread))


def see(place: Place, figures: Collection[str] = ()) -> Seen:
    """A page to millimetres and strokes.

    Arguments: of a printed sheet, only the zones of these `figures` are looked at; all of it by default.
    """
    timing: dict[str, float] = {}
    if place.problem is not None:
        return Seen(place, problems=(place.problem,))
    try:
        with _timed(timing, "decode"):
            page = _decoded(place)
    except InputFileError as error:
        return Seen(place, problems=(Problem(error.code, error.message, place.name),), timing_ms=timing)
    if page.damage:
        problem = Problem(
            "image_damaged_rows",
            f"{place.name}: page {place.page}: {page.damage} are damaged in the file, so that lengths read"
            " there would be wrong: scan the sheet again, or grade it by hand",
            place.name,
        )
        return Seen(place, page, problems=(problem,), timing_ms=timing)
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
    boxes = _asked_zones(sheet, figures)
    ink = None
    with _timed(timing, "ink"):
        if boxes is None or boxes:
            drawn = find_ink(page, sheet, boxes)
            if isinstance(drawn, Unread):
                message = f"{place.name}: page {place.page} is no drawing: {drawn.reason}"
                problem = Problem("page_not_a_drawing", message, place.name)
                return Seen(place, page, sheet, problems=(problem,), timing_ms=timing)
            ink = replace(drawn, letters=find_letters(drawn, boxes))
        written = written_scales(page, sheet)
    problems = tuple(replace(problem, file=place.name) for problem in sheet.problems)
    return Seen(place, page, sheet, ink, problems, timing, narrowed=boxes is not None, written=written)


def _decoded(place: Place) -> Page:
    """The page's pixels; raises InputFileError, also where the file has changed since it was surveyed."""
    file = load(place.path)
    if place.digest and place.digest != file.digest:
        raise changed(place.name)
    return replace(page_of(file, place.page), source=place.name)


def _asked_zones(sheet: Sheet, figures: Collection[str]) -> list[Box] | None:
    """The zones to look at, none where only the sketch would be left; None for the whole sheet."""
    if not figures or sheet.zones.keys() <= set(figures):
        return None
    asked = [figure for figure in sheet.zones if figure in figures]
    return [] if set(asked) <= {MECHANISM} else [_grown(sheet.zones[figure]) for figure in asked]


def _grown(zone: Box) -> Box:
    """A zone with the gap around it: a line may run a little past its edge."""
    x, y, wide, high = zone
    return (x - ZONE_SLACK_MM, y - ZONE_SLACK_MM, wide + 2 * ZONE_SLACK_MM, high + 2 * ZONE_SLACK_MM)


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
        known = {**sure_texts([one.written for one in usable]), **declared}
        scales = None if variant is None else _declared_scales(assignment, variant, known)
        inks = [one.ink for one in usable if one.ink is not None]
        sheets = [one.sheet for one in usable if one.sheet is not None]
        found = iter(read_figures(inks, sheets, assignment, variant, scales, wanted) if usable else ())
    readings = []
    for one in seen:
        is_read = one.sheet is not None and one.ink is not None
        reading = next(found) if is_read else Reading({})
        readings.append(replace(reading, written=one.written))
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
) -> tuple[Task, Judgement, Declarations] | Problem:
    """The judgement and the scales that counted as declared, or why there is none."""
    drawn = tuple(reading for reading in readings if reading.figures)
    if work.variant is None:
        return Problem(
            "variant_unknown", "nothing says this student's number or position: add it to the roster"
        )
    if not drawn and work.measured is None:
        if work.has_unusable:
            return Problem("nothing_usable", "nothing that was handed in can be used")
        if not work.pages:
            return Problem("nothing_handed_in", "nothing was handed in")
        return Problem("nothing_read", "no figure of this assignment could be read on the pages handed in")
    try:
        task = task_of(assignment, rubric, work.variant)
    except MechanismError as error:
        return Problem(error.code, error.message)
    measured = work.measured
    entered: dict[Source, Mapping[str, str]] = {"roster": work.declared}
    if measured is not None:
        entered["measurements"] = measured.scales
    further = () if measured is None else measured.further_scales
    declared = declarations(task, entered, readings, further)
    by_hand = Reading({}) if measured is None else measured.reading
    submission = Submission(
        readings=drawn,
        measured=replace(by_hand, unread=(*by_hand.unread, *declared.unread)),
        values={} if measured is None else measured.values,
        declared=declared.texts,
    )
    return task, judge(task, submission), declared


def _with_sources(report: ReportDocument, sources: Mapping[str, Source]) -> ReportDocument:
    """The report, telling where each scale was declared."""
    scales = {
        name: scale.model_copy(update={"source": sources.get(name)}) for name, scale in report.scales.items()
    }
    return report.model_copy(update={"scales": scales})


def _problems_of(looked: Sequence[Looked]) -> list[Problem]:
    return [problem for one in looked for problem in one.problems]


def _measuring_problems(work: Work) -> tuple[Problem, ...]:
    return () if work.measured is None else (*work.measured.problems, *work.measured.reading.problems)


def _pictures(
    looked: Sequence[Looked],
    construction: Construction | None,
    judgement: Judgement | None,
    *,
    show_expected: bool,
) -> tuple[Picture, ...]:
    outcomes = {} if judgement is None else {outcome.name: outcome for outcome in judgement.outcomes}
    vectors, links = ({}, {}) if construction is None else (construction.vectors, construction.links)
    return tuple(
        overlay(one.backdrop, one.reading, vectors, outcomes, links, show_expected=show_expected)
        for one in looked
        if one.backdrop is not None
    )


def _as_measured(work: Work, task: Task, judgement: Judgement, *, show_expected: bool) -> tuple[Picture, ...]:
    """The plans as entered measurements draw them, where no page shows them."""
    if work.measured is None:
        return ()
    outcomes = {outcome.name: outcome for outcome in judgement.outcomes}
    picture = measured_picture(
        work.measured.source, work.measured.reading, task.construction, outcomes,
        show_expected=show_expected,
    )  # fmt: skip
    return () if picture is None else (picture,)


@contextmanager
def _timed(timing_ms: dict[str, float], stage: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        timing_ms[stage] = 1000.0 * (time.perf_counter() - start)
