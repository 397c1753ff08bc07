"""``planmark sheet``, ``planmark handout``, ``planmark match`` and ``planmark calibrate``."""

import json
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from reportlab.platypus import Flowable

from grader.authoring.lint import lint
from grader.authoring.round_scales import suggestions
from grader.cli import terminal
from grader.cli.app import progress
from grader.cli.terminal import gettext, named, note
from grader.documents import CalibrationDocument
from grader.files import write_whole
from grader.folder.cache import PageCache
from grader.folder.inventory import submissions, take_inventory
from grader.folder.workers import Limits, Workers, result_of
from grader.language import N_
from grader.options import VariantOptions
from grader.owners.draft_roster import SURE, contact_sheet, draft_csv, suggest, thumbnail
from grader.printed.answer_sheet import make_calibration, make_sheets
from grader.printed.handout import make_handout
from grader.records import FloatArray, PageRef, Reason, Unread, as_error
from grader.rubric import rubric_of
from grader.scan.decode.pages import count_pages
from grader.scan.register.calibration import ALL_IS_WELL, advice_of, calibrate, residual_map
from grader.solution.pages import EXAMPLE, printed_steps
from grader.solution.sentences import wording_of
from grader.tables.measurements import names_of
from grader.tables.roster import RosterRow, read_roster
from grader.texts.spoken import MORE_LINES, failure, message
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.drawing.subject import Subject
from reference.errors import CallError
from reference.plan import exact_plan

# calibrate ----------------------------------------------------------------------------------------


def calibrate_scans(scans: Sequence[Path], svg: Path | None, *, as_json: bool) -> bool:
    """Measure scans of the calibration page and print the result; whether anything is to be done."""
    documents: list[CalibrationDocument] = []
    unread = False
    with Workers(1, Limits(), __name__) as workers:
        pages = [(path, page + 1) for path in scans for page in range(result_of(workers, count_pages, path))]
        for path, page in pages:
            document = result_of(workers, calibrate, path, page)
            if isinstance(document, Unread):
                unread = True
                at = gettext("%(file)s, page %(page)s", file=path.name, page=page)
                terminal.say(f"{at}: {message(document.reason, terminal.speaker())}", err=True)
                continue
            documents.append(document)
            if not as_json:
                _print_page(document)
    if as_json:
        terminal.say(json.dumps([document.model_dump(mode="json") for document in documents], indent=2))
    if svg is not None and documents:
        write_whole(svg, residual_map(documents[0]))
        terminal.say(gettext("%(file)s: where the page is off, magnified", file=svg), err=True)
    return unread or any(document.advice != [ALL_IS_WELL] for document in documents)


def _print_page(page: CalibrationDocument) -> None:
    terminal.say(gettext("%(file)s, page %(page)s", file=page.source, page=page.page))
    parts, told = page.segments, []
    if page.scale_x is not None and page.scale_y is not None and page.scale_se is not None:
        along, across, se = (100.0 * one for one in (page.scale_x, page.scale_y, page.scale_se))
        text = N_("scale along the sheet %(along).3f %%, across it %(across).3f %% (± %(se).3f)")
        told.append(gettext(text, along=along, across=across, se=se))
    if page.unequal is not None:
        text = N_("unequal scale %(unequal)+.3f %%, right angles off by %(skew)+.3f°")
        told.append(gettext(text, unequal=100.0 * page.unequal, skew=page.skew_deg))
    told.append(gettext("markers off an even map by %(off).3f mm", off=page.residual_mm))
    told.append(gettext("segments read: %(count)s of %(total)s", count=parts.read, total=parts.printed))
    if parts.length_rms_mm is not None:
        text = N_("lengths off by %(length_mean_mm)+.3f mm on average, %(length_rms_mm).3f mm rms,"
            " %(length_worst_mm).3f mm at most; directions %(direction_rms_deg).3f° rms,"
            " places %(place_rms_mm).3f mm rms")  # fmt: skip
        told.append(gettext(text, **parts.model_dump()))
    for line in (*told, *advice_of(page, terminal.speaker())):
        terminal.say(f"  {line}")


# sheet --------------------------------------------------------------------------------------------

SHOWN_VARIANTS = 12


def print_sheets(
    name: str, roster: Path | None, out: Path, layout: Path | None, *, calibration: bool
) -> None:
    """Write the PDF of a class's answer sheets, and where everything is on them."""
    lang = terminal.speaker().lang
    if calibration:
        sheets = make_calibration(lang)
    elif roster is None:
        raise failure(CallError, "roster_needed")
    else:
        students = read_roster(roster)
        assignment = load_assignment(name)
        rubric = rubric_of(assignment)
        sheets = make_sheets(assignment, students.rows, lang, roster=students.file, asked=rubric.entries)
    write_whole(out, sheets.pdf)
    note(gettext("%(file)s: print it on A3 at 100 %%, not fitted to the page", file=out))
    if layout is not None:
        write_whole(layout, sheets.layout.model_dump_json(indent=2))
        note(gettext("%(file)s: where markers, zones and boxes are", file=layout))
    for problem in sheets.problems:
        terminal.say(gettext("note: %(text)s", text=message(problem, terminal.speaker())), err=True)
    if not calibration and roster is not None:
        _suggest_scales(name, roster)


def _suggest_scales(name: str, roster: Path) -> None:
    """Print whose drawing would be easier to read at other scales, and at which."""
    assignment = load_assignment(name)
    result = lint(assignment, rubric_of(assignment))
    if result.plan is None:
        return
    drawn = {figure for page in assignment.file.page for figure in page.figures}
    texts = suggestions(result.scales, result.plan, drawn, terminal.speaker())
    lines: dict[Variant, str] = {}
    for row in read_roster(roster).rows:
        variant = assignment.variant(row.n, row.position)
        if variant in texts:
            lines.setdefault(variant, texts[variant])
    if not lines:
        return
    told = N_("note: these scales fit the zones too, and are easier to read than the assignment's:")
    terminal.say(gettext(told), err=True)
    for variant, line in list(lines.items())[:SHOWN_VARIANTS]:
        terminal.say(f"  {named(variant.numbers)}: {line}", err=True)
    if len(lines) > SHOWN_VARIANTS:
        terminal.say("  " + gettext(MORE_LINES, more=len(lines) - SHOWN_VARIANTS), err=True)
    told = N_("students write them into the scale boxes, or you write them into the roster (%(names)s)")
    terminal.say("  " + gettext(told, names=", ".join(assignment.scale_names)), err=True)


# handout ------------------------------------------------------------------------------------------


def print_handout(
    name: str, roster: Path | None, variant: VariantOptions, out: Path, example: int | None = None
) -> None:
    """Write the PDF of task sheets, of a class or of one variant, and a worked example.

    Without a roster, all positions are printed if none is named.
    """
    if out.suffix.lower() != ".pdf":
        raise failure(CallError, "handout_file", "ending", option="--out", file=out, names=".pdf")
    if roster is not None and variant != VariantOptions():
        raise failure(CallError, "option_unused", "unused_beside", option="--n, --position", other="--roster")
    assignment = load_assignment(name)
    if roster is None:
        asked = [assignment.variant(variant.n, one) for one in assignment.positions(variant.position)]
        rows = tuple(RosterRow("", n=one.n, position=one.position) for one in asked)
    else:
        rows = read_roster(roster).rows
    file = "" if roster is None else roster.name
    worked = [] if example is None else _example(assignment, rows, example)
    rubric, lang = rubric_of(assignment), terminal.speaker().lang
    sheets = make_handout(assignment, rubric, rows, lang, roster=file, example=worked)
    write_whole(out, sheets)
    note(gettext("%(file)s: task sheets on A4, without the solution: %(count)s", file=out, count=len(rows)))


def _example(assignment: Assignment, rows: Sequence[RosterRow], number: int) -> list[Flowable]:
    """Return the steps of a variant that no row has; `number` is its n, or its position if there is no n."""
    by = "position" if assignment.numbers("n") is None else "n"
    if number in {getattr(row, by) for row in rows}:
        raise failure(CallError, "example_taken", option="--example", what=by, value=number)
    position = next(iter(assignment.numbers("position") or ()), None) if by == "n" else number
    variant = assignment.variant(number if by == "n" else None, position)
    plan, speaker = exact_plan(assignment, [variant]), terminal.speaker()
    subject = Subject(assignment, plan, 0, wording_of(speaker))
    title = speaker.gettext(EXAMPLE) % {"title": subject.title}
    return [*printed_steps(subject, speaker, title)]


# match --------------------------------------------------------------------------------------------


def draft_matches(
    folder: Path, name: str, roster_file: Path, out: Path, pages_per_student: int | None
) -> bool:
    """Write the draft of the roster and its contact sheet; whether anything needs to be checked."""
    if not folder.is_dir():
        raise failure(CallError, "folder_missing", folder=folder)
    assignment, roster = load_assignment(name), read_roster(roster_file)
    paths = submissions(folder, roster_file, (out, *assignment.own_files))
    with (
        progress() as tell,
        tempfile.TemporaryDirectory() as notes,
        Workers(os.cpu_count() or 1, Limits(), __name__) as workers,
    ):
        cache = PageCache(Path(notes) / "pages")
        contents = take_inventory(paths, folder, names_of(assignment), workers, tell, cache)
        sources = [page for content in contents for page in content.pages]
        draft = suggest(sources, roster, assignment, pages_per_student=pages_per_student)
        loose = [suggestion.source for suggestion in draft.suggestions if not suggestion.sure]
        strokes: dict[PageRef, FloatArray] = {}
        for done, (index, ends) in enumerate(
            workers.run(_strokes, [(cache, page) for page in loose]), start=1
        ):
            if not isinstance(ends, Reason | None):
                strokes[loose[index]] = ends
            tell("reading", done, len(loose))
        draft = suggest(
            sources, roster, assignment, strokes_of=strokes.get, pages_per_student=pages_per_student
        )
        shown = [suggestion.source for suggestion in draft.suggestions]
        thumbnails = dict(workers.run(_thumbnail, [(cache, page) for page in shown]))
    entries = []
    for index, suggestion in enumerate(draft.suggestions):
        picture = thumbnails[index]
        if isinstance(picture, Reason):
            terminal.say(f"{suggestion.source}: {message(picture, terminal.speaker())}", err=True)
        else:
            entries.append((suggestion, picture))
    sheet = out.with_suffix(".html")
    write_whole(out, draft_csv(roster, draft))
    write_whole(sheet, contact_sheet(entries, terminal.speaker().lang))
    open_ends = sum(not suggestion.sure for suggestion in draft.suggestions)
    told = N_("%(file)s: a draft; pages to check: %(count)s of %(total)s (%(sure)s = certain)")
    terminal.say(gettext(told, file=out, count=open_ends, total=len(draft.suggestions), sure=SURE))
    note(gettext("Check %(page)s", page=sheet))
    return open_ends > 0


def _strokes(cache: PageCache, ref: PageRef) -> FloatArray | None:
    """(n, 2, 2) strokes drawn on a page, sheet millimetres; None where there are none to be had."""
    ink = cache.page(ref).ink
    return None if ink is None else ink.strokes.ends


def _thumbnail(cache: PageCache, ref: PageRef) -> bytes:
    page = cache.page(ref)
    if page.backdrop is None:
        raise as_error(page.problems[0])
    return thumbnail(page.backdrop.scan)
