"""How a sheet becomes a mark: one submission, top to bottom.

    file -> page (pixels) -> sheet (millimetres) -> ink (strokes) -> reading (named vectors)
         -> judgement (verdicts, mistakes, points) -> report and pictures

`scan` takes one page as far as its ink and needs to know nothing of its owner. `read_submission` names
what is on the pages of one student. `mark` judges it, together with measurements that were entered by
hand: they are a reading, too. Only this module knows the order of the stages. A bad file or drawing
becomes a problem of its page or report, never an error.
"""

import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from hashlib import blake2b

from grader.comparison.evidence import Submission
from grader.comparison.scales import Declarations, Source, declarations
from grader.comparison.task import Task, task_of
from grader.documents import ReportDocument
from grader.feedback.redo_steps import with_mistakes_explained
from grader.feedback.sentences import criterion_feedback
from grader.inputs.measurements import NOTHING_MEASURED, Measurements, StudentSubmission
from grader.inputs.scale_text import SURE, declared_scales, sure_texts, understood_scales
from grader.marking.answers import NONE_DECIDED, answers_of
from grader.marking.decided import decide, open_again, with_decisions, with_nodes
from grader.marking.mark import judge
from grader.marking.report import reading_document, report_of, unjudged_report
from grader.marking.trust import opened_by_audit, with_said
from grader.options import Level
from grader.outcomes import Judgement
from grader.overlay.backdrop import backdrop
from grader.overlay.measured import measured_picture
from grader.overlay.picture import overlay
from grader.overlay.scene import Picture
from grader.printed.layout import cells_of
from grader.reading import page_scale
from grader.reading.corrected import corrected
from grader.reading.read import read_figures
from grader.reading.sketch import drawings
from grader.records import PageRef, Reading, Reason, ScannedPage, Sheet, Unread, Value
from grader.rubric import Asked, RubricFile
from grader.scan.decode.pages import decode, is_blank
from grader.scan.handwriting.captions import (
    NUMBER_WORDS,
    POSITION_WORDS,
    Spotter,
    captioned_scales,
    spotters,
    surer,
    written_number,
)
from grader.scan.handwriting.fields import writing, written_lengths, written_scales
from grader.scan.handwriting.letters import STAND_UPRIGHT, find_letters, upright_nats
from grader.scan.quality import flaws
from grader.scan.register.distortion import straighten
from grader.scan.register.registration import register
from grader.scan.strokes.ink import find_ink
from grader.scan.strokes.nodes import node_places
from grader.texts.spoken import of_error
from reference.authored.assignment import SCALE_NAMES, Assignment, Scales, Variant
from reference.construction.graph import Construction
from reference.construction.mistakes import Drawing
from reference.errors import InputFileError, MechanismError

# One page: pixels to strokes ----------------------------------------------------------------------


def scan(ref: PageRef, asked: Asked) -> ScannedPage:
    """A page as far as it can be taken without its owner, its pixels left behind."""
    page = open_page(ref, asked.figures, asked.units)
    if page.image is None:
        return page
    reading = page.reading
    if page.sheet is not None and page.sheet.zones and asked.assignment is not None:
        cells = cells_of(asked.assignment, tuple(page.sheet.zones), asked.entries)
        reading = replace(reading, lengths=written_lengths(page.image, page.sheet, cells))
    return replace(page, image=None, reading=reading, backdrop=backdrop(page.image, page.sheet))


def open_page(
    ref: PageRef, figures: Collection[str] = (), units: Mapping[str, str] | None = None
) -> ScannedPage:
    """A page decoded, registered, and its strokes found; `problems` say where the way ended.

    Arguments: of a printed sheet, only the zones of these `figures` are looked at; all of it by default.
    `units` are those of scales in its boxes that are bare numbers, by scale.
    """
    if ref.problem is not None:
        return ScannedPage(ref, problems=(ref.problem,))
    timing: dict[str, float] = {}
    try:
        with _timed(timing, "decode"):
            image = decode(ref)
    except InputFileError as error:
        page = _refused(ScannedPage(ref, timing_ms=timing), of_error(error))
        return replace(page, ref=replace(ref, problem=page.problems[0]))
    if ref.turn_deg is not None:
        image = replace(image, turn_deg=ref.turn_deg, turn_is_sure=True)
    ref = replace(ref, content=blake2b(image.grey.tobytes(), digest_size=8).hexdigest())
    page = ScannedPage(ref, image, timing_ms=timing)
    # Rows that a decoder has filled with white are not blank.
    if not image.damage and is_blank(image):
        page = replace(page, ref=replace(ref, blank=True))
        return _refused(page, Reason("page_blank"))
    with _timed(timing, "sheet"):
        sheet, identity = register(image, ref.corners_px)
        page = replace(page, ref=replace(ref, identity=identity))
        if isinstance(sheet, Sheet) and not image.damage:
            image, sheet = straighten(image, sheet)
        page = replace(page, flaws=flaws(image, sheet if isinstance(sheet, Sheet) else None))
    if image.damage:
        first, last = image.damage
        return _refused(page, Reason("image_damaged_rows", {"first": first, "last": last}))
    if not isinstance(sheet, Sheet):
        return _refused(page, sheet.reason)
    problems = tuple(replace(problem, file=ref.file) for problem in sheet.problems)
    boxes = sheet.boxes_of(figures)
    page = replace(page, image=image, sheet=sheet, problems=problems)
    with _timed(timing, "ink"):
        if boxes is None or boxes:
            ink = find_ink(image, sheet, boxes)
            if isinstance(ink, Unread):
                return _refused(page, ink.reason)
            problems += tuple(replace(problem, file=ref.file) for problem in ink.problems)
            page = replace(page, ink=replace(ink, letters=find_letters(ink, boxes)), problems=problems)
        reading = Reading({}, written=written_scales(image, sheet, units))
    page = replace(page, reading=reading, narrowed=boxes is not None)
    return page if sheet.zones or image.turn_is_sure else _as_letters_stand(page)


def _as_letters_stand(page: ScannedPage) -> ScannedPage:
    """A plain page the way up that its letters stand; as it is where they do not tell."""
    if (nats := upright_nats(page.ink)) is None:
        return page
    other = page if nats > STAND_UPRIGHT else _turned(page)
    is_told = other is page or (upright_nats(other.ink) or nats) > nats + STAND_UPRIGHT
    return page_scale.surely_upright(other) if is_told else page


def _refused(page: ScannedPage, why: Reason) -> ScannedPage:
    where = {"page": page.ref.page} if page.ref.pages > 1 else {}
    return replace(page, problems=(Reason(why.code, {**where, **why.parameters}, page.ref.file),))


# One student's pages: strokes to named vectors ------------------------------------------------------


def read_submission(
    submission: StudentSubmission, pages: Sequence[ScannedPage], assignment: Assignment, asked: Asked
) -> list[ScannedPage]:
    """The submission's pages with every vector of the figures that are asked for."""
    pages = [_with_captions(page, assignment, missing_scales(submission)) for page in pages]
    read = read_pages(pages, assignment, submission.variant, submission.declared, asked.vectors)
    drawn = {figure for page in read for figure in page.reading.figures}
    if any(page.narrowed for page in pages) and not asked.figures <= drawn:
        # A figure is not in its zone: people draw where they like.
        all_of_it = replace(asked, figures=frozenset())
        whole = [scan(page.ref, all_of_it) if page.narrowed else page for page in pages]
        read = read_pages(whole, assignment, submission.variant, submission.declared, asked.vectors)
    return [_with_number_compared(page, submission.variant, assignment) for page in read]


def _with_number_compared(page: ScannedPage, variant: Variant | None, assignment: Assignment) -> ScannedPage:
    """A plain page; told where the drawing is not the variant's and another number stands on it."""
    if variant is None or page.ink is None or page.sheet is None or page.sheet.zones:
        return page
    if not page_scale.is_drawn_otherwise(page.reading, drawings(assignment, [variant], None)[0]):
        return page
    for which, words in (("n", NUMBER_WORDS), ("position", POSITION_WORDS)):
        numbers = {getattr(other, which) for other in assignment.variants()} - {None}
        for closely in (False, True) if len(numbers) > 1 else ():
            read = written_number(writing_on(page, closely=closely), sorted(numbers), words)
            if read is None or read.confidence < SURE:
                continue
            if read.text != str(getattr(variant, which)):
                seen: dict[str, Value] = {"what": which, "read": read.text, "confidence": read.confidence}
                differs = Reason("number_differs", {**seen, "graded": str(variant)}, page.ref.file)
                page = replace(page, problems=(*page.problems, differs))
            break
    return page


def missing_scales(submission: StudentSubmission) -> tuple[str, ...]:
    """The scales that neither the roster nor measurements declare: those are looked for on plain paper."""
    measured = {} if submission.measured is None else submission.measured.scales
    return tuple(name for name in SCALE_NAMES if name not in submission.declared and name not in measured)


def writing_on(page: ScannedPage, *, closely: bool = False) -> list[Spotter]:
    """The lines of writing on a plain page; none on a printed sheet, which has boxes, and on one refused.

    Arguments: `closely` decodes the page again, if its pixels were left behind; else its ink map must do.
    """
    sheet = page.sheet
    if page.ink is None or sheet is None or sheet.zones:
        return []
    if not closely:
        return spotters(page.ink.where)
    try:
        image = page.image or straighten(decode(page.ref), sheet)[0]
    except InputFileError:
        return []
    return spotters(page.ink.where, lambda box: writing(image, sheet, box, 0.0))


def _with_captions(page: ScannedPage, assignment: Assignment, names: Collection[str]) -> ScannedPage:
    """A plain page with those of these scales that stand on it; looked at closely where in doubt."""
    units: Mapping[str, str] = dict(assignment.file.scales.bare_units.items())
    lines = writing_on(page) if names else []
    if not lines:
        return page
    written = captioned_scales(lines, names, units)
    doubtful = [name for name in names if name not in written or written[name].confidence < SURE]
    if doubtful:
        closer = captioned_scales(writing_on(page, closely=True), doubtful, units)
        read = {name: surer(written.get(name), closer.get(name)) for name in doubtful}
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
    timing: dict[str, float] = {}
    with _timed(timing, "reading"):
        known = {**sure_texts([page.reading.written for page in pages if page.ink is not None]), **declared}
        scales = None if variant is None else declared_scales(assignment, variant, known)
        readings = _readings(pages, assignment, variant, scales, wanted)
        right = None if variant is None else drawings(assignment, [variant], scales)[0]
        sure: Collection[str] = () if variant is None else understood_scales(assignment, variant, known)
        for at_drawing in (_upright, partial(page_scale.at_drawn_scales, declared=sure)):
            if (placed := at_drawing(pages, readings, right)) is not None:
                pages, readings = placed, _readings(placed, assignment, variant, scales, wanted)
    drawn = sum(page.ink is not None for page in pages)
    read = []
    for page, reading in zip(pages, readings, strict=True):
        told = replace(reading, written=page.reading.written, lengths=page.reading.lengths)
        told = page_scale.no_surer_than_turn(told, page)
        spent = timing["reading"] / drawn if page.ink is not None else 0.0
        read.append(replace(page, reading=told, timing_ms={**page.timing_ms, "reading": spent}))
    return read


def _upright(
    pages: Sequence[ScannedPage], readings: Sequence[Reading], right: Drawing | None
) -> list[ScannedPage] | None:
    """The pages, the other way up where nothing but a drawing says so; None where none is."""
    turned = [
        _turned(page) if page_scale.turn_doubts(page) and page_scale.is_upside_down(reading, right) else page
        for page, reading in zip(pages, readings, strict=True)
    ]
    return turned if any(one is not page for one, page in zip(turned, pages, strict=True)) else None


def _turned(page: ScannedPage) -> ScannedPage:
    """A page opened the other way up, as letters are read upright only; itself where nothing is found so."""
    if page.sheet is None:
        return page
    turn_deg = (90 * round(page.sheet.rotation_deg / 90.0) + 180) % 360
    turned = open_page(replace(page.ref, turn_deg=turn_deg))
    if turned.image is None or turned.sheet is None:
        return page
    behind = backdrop(turned.image, turned.sheet) if page.backdrop is not None else None
    problems = (*turned.problems, *page_scale.turn_doubts(page))
    return replace(turned, image=page.image and turned.image, backdrop=behind, problems=problems)


def _readings(
    pages: Sequence[ScannedPage],
    assignment: Assignment,
    variant: Variant | None,
    scales: Scales | None,
    wanted: Collection[str],
) -> list[Reading]:
    """What is drawn on each page; nothing on those that were refused."""
    drawn = [(page.ink, page.sheet) for page in pages if page.ink is not None and page.sheet is not None]
    readings = iter(read_figures(drawn, assignment, variant, scales, wanted, node_places) if drawn else ())
    return [Reading({}) if page.ink is None else next(readings) for page in pages]


# One student's mark ---------------------------------------------------------------------------------

_SURELY = 0.9
"""Confidence from which a vector is not told to be doubtful."""


def mark(
    submission: StudentSubmission,
    pages: Sequence[ScannedPage],
    assignment: Assignment,
    rubric: RubricFile,
    level: Level = "full",
    *,
    with_ghosts: bool = True,
) -> tuple[ReportDocument, tuple[Picture, ...]]:
    """The report of a submission whose pages were read, and a picture of each page.

    Arguments: pictures show expected vectors beside wrong ones at level `full`, unless without `with_ghosts`.
    """
    report, painted = _marked(submission, pages, assignment, rubric, level)
    return report, painted(with_ghosts and level == "full")


def report_on(
    submission: StudentSubmission,
    pages: Sequence[ScannedPage],
    assignment: Assignment,
    rubric: RubricFile,
    level: Level = "full",
) -> ReportDocument:
    """The report alone, as of `mark`: pictures take most of its time."""
    return _marked(submission, pages, assignment, rubric, level)[0]


def _marked(
    submission: StudentSubmission,
    pages: Sequence[ScannedPage],
    assignment: Assignment,
    rubric: RubricFile,
    level: Level,
) -> tuple[ReportDocument, Callable[[bool], tuple[Picture, ...]]]:
    """The report, and what paints the pages, with expected vectors or without."""
    pages = [page.asked_only(rubric.vectors) for page in pages]
    pages, astray = with_nodes(pages, submission, assignment)
    sheets = [reading_document(page, submission.student_id) for page in pages]
    problems = (*submission.problems, *(problem for page in pages for problem in page.problems), *astray)
    problems += tuple(
        replace(flaw, file=page.ref.file)
        for page in pages
        if _is_doubtful(page.reading)
        for flaw in page.flaws
    )
    answer = judged(submission, assignment, rubric, [page.reading for page in pages])
    if isinstance(answer, Reason):
        is_there = submission.pages or submission.measured or submission.has_unusable
        report = unjudged_report(
            assignment, rubric, submission.variant or Variant(), submission.student_id,
            "unreadable" if is_there else "missing", problems=(*problems, answer), sheets=sheets,
        )  # fmt: skip
        plain = [(page.backdrop, page.reading) for page in pages if page.backdrop]
        report = with_decisions(report, submission)
        return report, lambda _ghosts: tuple(overlay(scan, reading, {}, {}) for scan, reading in plain)
    task, own, declared = answer
    learnt = answers_of(task, own, pages, submission.decided)
    judgement = own
    if learnt:
        pages = corrected(pages, learnt.places, task.construction)[0]
        sheets = [reading_document(page, submission.student_id) for page in pages]
        again = judged(submission, assignment, rubric, [page.reading for page in pages], learnt.verdicts)
        judgement = own if isinstance(again, Reason) else again[1]
    judgement = decide(opened_by_audit(judgement, rubric, submission.opened), rubric, submission.decided)
    names, lang, measured = assignment.file.names, submission.lang, submission.measured or NOTHING_MEASURED
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
    return report, lambda ghosts: pictures_of(
        pages, measured, task.construction, judgement, show_expected=ghosts
    )


def _is_doubtful(reading: Reading) -> bool:
    """Whether something that was asked for was not read surely: then what spoils the picture is told."""
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
        if not submission.pages:
            return Reason("nothing_handed_in")
        return Reason("nothing_read")
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
    vectors, links = construction.vectors, construction.links
    pictures = [
        overlay(page.backdrop, page.reading, vectors, outcomes, links, show_expected=show_expected)
        for page in pages
        if page.backdrop is not None
    ]
    if not pictures:
        source, reading = measured.source, measured.reading
        drawn = measured_picture(source, reading, construction, outcomes, show_expected=show_expected)
        pictures = [] if drawn is None else [drawn]
    return tuple(pictures)


@contextmanager
def _timed(timing_ms: dict[str, float], stage: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        timing_ms[stage] = 1000.0 * (time.perf_counter() - start)
