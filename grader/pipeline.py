"""Mark a sheet: the whole way of one submission, top to bottom.

    file -> page (pixels) -> sheet (millimetres) -> ink (strokes) -> reading (named vectors)
         -> judgement (verdicts, mistakes, points) -> report and pictures

`scan` takes one page as far as its ink and needs to know nothing of its owner. `read_submission` names
what is on the pages of one student. `mark` judges it, with entered measurements, which are a reading, too.
Only this module knows the order of the stages. A bad file or drawing becomes a problem of its page or
report, never an error.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial

from grader.comparison.evidence import Submission
from grader.comparison.scales import Declarations, Source, declarations
from grader.comparison.task import Task, task_of
from grader.documents import ReportDocument
from grader.feedback.redo_steps import with_mistakes_explained
from grader.feedback.sentences import criterion_feedback
from grader.marking.answers import NONE_DECIDED, answers_of
from grader.marking.decided import decide, open_again, with_decisions, with_ink, with_nodes
from grader.marking.mark import judge
from grader.marking.report import reading_document, report_of, unjudged_report
from grader.marking.trust import opened_by_audit, with_said
from grader.options import Level
from grader.outcomes import Judgement
from grader.overlay.backdrop import backdrop
from grader.overlay.measured import measured_picture
from grader.overlay.picture import overlay
from grader.overlay.scene import Picture
from grader.printed.layout import cells_of, position_zones, values_of
from grader.reading import page_scale
from grader.reading.another import told_instead
from grader.reading.corrected import corrected
from grader.reading.read import read_figures
from grader.reading.sketch import drawings
from grader.records import PageRef, Reading, Reason, ScannedPage, Value, of_error
from grader.rubric import Asked, RubricFile
from grader.scan.handwriting import captions
from grader.scan.handwriting.fields import written_numbers
from grader.scan.page import open_page, timed, turned, writing_on
from grader.scan.strokes.nodes import node_places
from grader.tables.measurements import NOTHING_MEASURED, Measurements, StudentSubmission
from grader.tables.scale_text import SURE, declared_scales, sure_texts, understood_scales
from reference.authored.assignment import Assignment, Variant
from reference.construction.graph import Construction
from reference.construction.mistakes import Drawing
from reference.errors import MechanismError

# One page: pixels to strokes ----------------------------------------------------------------------


def scan(ref: PageRef, asked: Asked) -> ScannedPage:
    """A page as far as it can be taken without its owner, its pixels left behind."""
    page = open_page(ref, asked.figures, asked.units)
    if page.image is None:
        return page
    reading = page.reading
    if page.sheet is not None and page.sheet.zones and asked.assignment is not None:
        here = asked.assignment, tuple(page.sheet.zones), asked.entries
        written = written_numbers(page.image, page.sheet, cells_of(*here), values_of(*here))
        reading = replace(reading, lengths=written)
    return replace(page, image=None, reading=reading, backdrop=backdrop(page.image, page.sheet))


# One student's pages: strokes to named vectors ------------------------------------------------------


def read_submission(
    submission: StudentSubmission, pages: Sequence[ScannedPage], assignment: Assignment, asked: Asked
) -> list[ScannedPage]:
    """The submission's pages with every vector of the figures that are asked for."""
    own = partial(_of_position, assignment=assignment, variant=submission.variant)
    scales = [name for name in assignment.scale_names if name in submission.undeclared]
    pages = [own(_with_captions(page, assignment, scales)) for page in pages]
    read = read_pages(pages, assignment, submission.variant, submission.declared, asked.vectors)
    drawn = {figure for page in read for figure in page.reading.figures}
    if any(page.narrowed for page in pages) and not asked.figures <= drawn:
        # A figure is not in its zone: people draw where they like.
        all_of_it = replace(asked, figures=frozenset())
        whole = [own(scan(page.ref, all_of_it)) if page.narrowed else page for page in pages]
        read = read_pages(whole, assignment, submission.variant, submission.declared, asked.vectors)
    read = told_instead(read, assignment, submission.variant, asked.vectors)
    return [_with_number_compared(page, submission.variant, assignment) for page in read]


def _of_position(page: ScannedPage, assignment: Assignment, variant: Variant | None) -> ScannedPage:
    """The page with what is drawn for the variant's position, if a printed sheet has a zone for each."""
    zones = position_zones(assignment, page.sheet.zones) if page.sheet else {}
    zone = None if variant is None else zones.get(variant.position or 0)
    if zone is None or page.ink is None or page.sheet is None:
        return page
    own = dict.fromkeys(page.sheet.zones, zone)
    return replace(page, ink=page.ink.within(zone), sheet=replace(page.sheet, zones=own))


def _with_number_compared(page: ScannedPage, variant: Variant | None, assignment: Assignment) -> ScannedPage:
    """A plain page; told where the drawing is not the variant's and another number stands on it."""
    if variant is None or page.ink is None or page.sheet is None or page.sheet.zones:
        return page
    if not page_scale.is_drawn_otherwise(page.reading, drawings(assignment, [variant], None)[0]):
        return page
    told = {"n": captions.NUMBER_WORDS, "position": captions.POSITION_WORDS}
    for which, words in list(told.items())[: 1 if assignment.shared_positions else None]:
        numbers = {getattr(other, which) for other in assignment.variants()} - {None}
        for closely in (False, True) if len(numbers) > 1 else ():
            read = captions.written_number(writing_on(page, closely=closely), sorted(numbers), words)
            if read is None or read.confidence < SURE:
                continue
            if read.text != str(getattr(variant, which)):
                seen: dict[str, Value] = {"what": which, "read": read.text, "confidence": read.confidence}
                differs = Reason("number_differs", {**seen, "graded": str(variant)}, page.ref.file)
                page = replace(page, problems=(*page.problems, differs))
            break
    return page


def _with_captions(page: ScannedPage, assignment: Assignment, names: Collection[str]) -> ScannedPage:
    """A plain page with those of these scales that stand on it; looked at closely where in doubt."""
    units: Mapping[str, str] = dict(assignment.file.scales.bare_units.items())
    lines = writing_on(page) if names else []
    if not lines:
        return page
    written = captions.captioned_scales(lines, names, units)
    doubtful = [name for name in names if name not in written or written[name].confidence < SURE]
    if doubtful:
        closer = captions.captioned_scales(writing_on(page, closely=True), doubtful, units)
        read = {name: captions.surer(written.get(name), closer.get(name)) for name in doubtful}
        written |= {name: one for name, one in read.items() if one is not None}
    return replace(page, reading=replace(page.reading, written=written))


def read_pages(
    pages: Sequence[ScannedPage],
    assignment: Assignment,
    variant: Variant | None,
    declared: Mapping[str, str],
    wanted: Collection[str],
) -> list[ScannedPage]:
    """A student's pages with what was drawn on each; nothing on those that were refused."""

    def readings_of(pages: Sequence[ScannedPage]) -> list[Reading]:
        drawn = [(page.ink, page.sheet) for page in pages if page.ink is not None and page.sheet is not None]
        found = iter(read_figures(drawn, assignment, variant, scales, wanted, node_places) if drawn else ())
        return [Reading({}) if page.ink is None else next(found) for page in pages]

    timing: dict[str, float] = {}
    with timed(timing, "reading"):
        known = {**sure_texts([page.reading.written for page in pages if page.ink is not None]), **declared}
        scales = None if variant is None else declared_scales(assignment, variant, known)
        readings = readings_of(pages)
        right = None if variant is None else drawings(assignment, [variant], scales)[0]
        sure: Collection[str] = () if variant is None else understood_scales(assignment, variant, known)
        for at_drawing in (_upright, _level, partial(page_scale.at_drawn_scales, declared=sure)):
            placed = at_drawing(pages, readings, right)
            if any(one is not page for one, page in zip(placed, pages, strict=True)):
                pages, readings = placed, readings_of(placed)
    drawn = sum(page.ink is not None for page in pages)
    read = []
    for page, reading in zip(pages, readings, strict=True):
        told = replace(reading, written=page.reading.written, lengths=page.reading.lengths, problems=())
        problems = (*page.problems, *(replace(one, file=page.ref.file) for one in reading.problems))
        told = page_scale.no_surer_than_turn(told, page)
        spent = timing["reading"] / drawn if page.ink is not None else 0.0
        times = {**page.timing_ms, "reading": spent}
        read.append(replace(page, reading=told, problems=problems, timing_ms=times))
    return read


def _upright(
    pages: Sequence[ScannedPage], readings: Sequence[Reading], right: Drawing | None
) -> list[ScannedPage]:
    """The pages, the other way up where nothing but a drawing says so."""
    return [
        _opened_again(page, turned(page))
        if page_scale.turn_doubts(page) and page_scale.is_upside_down(reading, right)
        else page
        for page, reading in zip(pages, readings, strict=True)
    ]


def _level(
    pages: Sequence[ScannedPage], readings: Sequence[Reading], right: Drawing | None
) -> list[ScannedPage]:
    """The pages, those without a frame turned as their drawings lie, the way up that they were read."""
    tilts = [page_scale.drawn_tilt(*both, right) for both in zip(pages, readings, strict=True)]
    return [
        _opened_again(page, open_page(replace(page.ref, tilt_rad=tilt, turn_deg=page.turn_deg)))
        if tilt
        else page
        for page, tilt in zip(pages, tilts, strict=True)
    ]


def _opened_again(page: ScannedPage, other: ScannedPage) -> ScannedPage:
    """A page as opened another way, with the doubts about its turn; itself where nothing is found so."""
    if other is page or other.image is None or other.ink is None:
        return page
    behind = backdrop(other.image, other.sheet) if page.backdrop is not None else None
    doubts = tuple(one for one in page_scale.turn_doubts(page) if one not in other.problems)
    return replace(
        other, image=page.image and other.image, backdrop=behind, problems=(*other.problems, *doubts)
    )


# One student's mark ---------------------------------------------------------------------------------

_SURELY = 0.9
"""Confidence from which a vector is not told to be doubtful."""
Painter = Callable[[Level], tuple[Picture, ...]]
"""Paints the pages, at level `full` with expected vectors beside wrong ones; that takes most of the time."""


def mark(
    submission: StudentSubmission,
    pages: Sequence[ScannedPage],
    assignment: Assignment,
    rubric: RubricFile,
    level: Level = "full",
) -> tuple[ReportDocument, Painter]:
    """The report of a submission whose pages were read, and what paints a picture of each page."""
    pages = [page.asked_only(rubric.vectors) for page in pages]
    pages, astray = with_nodes(with_ink(pages, submission.decided), submission, assignment)
    sheets = [reading_document(page, submission.student_id) for page in pages]
    problems = (*submission.problems, *(problem for page in pages for problem in page.problems), *astray)
    doubtful = [page for page in pages if _is_doubtful(page.reading)]
    problems += tuple(replace(flaw, file=page.ref.file) for page in doubtful for flaw in page.flaws)
    answer = judged(submission, assignment, rubric, [page.reading for page in pages])
    if isinstance(answer, Reason):
        is_there = submission.pages or submission.measured or submission.has_unusable
        report = unjudged_report(
            assignment, rubric, submission.variant or Variant(), submission.student_id,
            "unreadable" if is_there else "missing", problems=(*problems, answer), sheets=sheets,
        )  # fmt: skip
        plain = [(page.backdrop, page.reading) for page in pages if page.backdrop]
        return with_decisions(report, submission), lambda _: tuple(overlay(*one, {}, {}) for one in plain)
    task, own, declared = answer
    learnt, judgement = answers_of(task, own, pages, submission.decided), own
    if learnt:
        pages = corrected(pages, learnt.places, task.construction)[0]
        sheets = [reading_document(page, submission.student_id) for page in pages]
        again = judged(submission, assignment, rubric, [page.reading for page in pages], learnt.verdicts)
        judgement = own if isinstance(again, Reason) else again[1]
    judgement = decide(opened_by_audit(judgement, rubric, submission.opened), rubric, submission.decided)
    names, lang, measured = assignment.names, submission.lang, submission.measured or NOTHING_MEASURED
    report = report_of(
        task, judgement, submission.student_id,
        language=lang,
        sentences={one.criterion: criterion_feedback(one, lang, level, names) for one in judgement.outcomes},
        problems=(*problems, *measured.problems, *measured.reading.problems, *declared.problems),
        sheets=sheets,
        sources=declared.sources,
    )  # fmt: skip
    report = with_mistakes_explained(report, judgement, assignment, task.variant, lang, level)
    report = with_said(report, own, {row.criterion for row in submission.decided})
    report = with_decisions(report, submission, own, task.construction)
    return report, lambda shown: pictures_of(
        pages, measured, task.construction, judgement, show_expected=shown == "full"
    )


def _is_doubtful(reading: Reading) -> bool:
    """Return whether something asked for was not read surely: then what spoils the picture is told."""
    vectors = [vector for figure in reading.figures.values() for vector in figure.vectors.values()]
    return not vectors or bool(reading.unread) or any(one.confidence < _SURELY for one in vectors)


def judged(
    submission: StudentSubmission,
    assignment: Assignment,
    rubric: RubricFile,
    readings: Sequence[Reading],
    verdicts: Mapping[str, str] = NONE_DECIDED,
) -> tuple[Task, Judgement, Declarations] | Reason:
    """The judgement and the scales that counted as declared, or why there is none.

    Arguments: `verdicts` are what people decided of what waited, by vector, angular quantity or scale.
    """
    drawn = tuple(reading for reading in readings if reading.figures)
    is_empty = not drawn and submission.measured is None
    if submission.variant is None:
        return Reason("variant_unknown")
    if is_empty and not any(row.kind == "verdict" for row in submission.decided):
        if submission.has_unusable:
            return Reason("nothing_usable")
        return Reason("nothing_read") if submission.pages else Reason("nothing_handed_in")
    try:
        task = task_of(assignment, rubric, submission.variant)
    except MechanismError as error:
        return of_error(error)
    measured = submission.measured or NOTHING_MEASURED
    entered: dict[Source, Mapping[str, str]]
    entered = {"roster": submission.declared, "measurements": measured.scales}
    declared = declarations(task, entered, readings, measured.further_scales)
    by_hand = replace(measured.reading, unread=(*measured.reading.unread, *declared.unread))
    evidence = Submission(drawn, by_hand, measured.values, declared.texts, verdicts)
    judgement = judge(task, evidence)
    return task, open_again(judgement, rubric, submission) if is_empty else judgement, declared


def pictures_of(
    pages: Sequence[ScannedPage],
    measured: Measurements,
    construction: Construction,
    judgement: Judgement,
    *,
    show_expected: bool,
) -> tuple[Picture, ...]:
    """Each page with what was judged on it; without pages, the plans as the measurements draw them."""
    outcomes = {outcome.name: outcome for outcome in judgement.outcomes}
    vectors, links = construction.vectors, construction.all_on_sketch
    shown = [(page.backdrop, page.reading) for page in pages if page.backdrop is not None]
    if not shown:
        source, reading = measured.source, measured.reading
        drawn = measured_picture(source, reading, construction, outcomes, show_expected=show_expected)
        return () if drawn is None else (drawn,)
    return tuple(
        overlay(scan, reading, vectors, outcomes, links, show_expected=show_expected)
        for scan, reading in shown
    )
