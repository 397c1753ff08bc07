"""``planmark check``."""

import shutil
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import typer

from grader.cli import terminal
from grader.documents import Quantity
from grader.feedback.sentences import mistake_feedback
from grader.files import shown_text, write_whole
from grader.language import N_, Tongue, tongue
from grader.options import CheckOptions, Level, VariantOptions
from grader.rubric import rubric_of
from grader.self_check.advice import RESULTS, CheckedLine
from grader.self_check.results import LEVELS, likely_mistakes
from grader.self_check.values import check_values
from grader.tables.measurements import Measurements, columns_of, names_of, read_measurements
from grader.tables.reader import written
from grader.texts.spoken import failure, message, problem_documents
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.errors import CallError

STYLES = {"right": "green", "off": "red", "open": "magenta"}
NOTHING = N_("nothing that this assignment asks for was measured")
WRITTEN = N_("%(file)s: fill in what is below the comments, then check it by --measured %(file)s")
HOW_TO_FILL_IN = N_(
    "# Drawn lengths in mm; _deg: directions counter-clockwise from the horizontal to the right; _value:"
    " computed values, counter-clockwise positive or with their sense (2.09 cw); scales with their units in"
    " the cell (0.005 m/mm). Points I and J from the driving link's pivot; _sketch: as drawn on the"
    " mechanism. Blank cells are not checked; lines that begin with # are ignored. A class's table has"
    " a column student_id, too."
)


def check_measured(name: str, options: CheckOptions) -> bool:
    """Print right or off for every value of a measurement file; whether anything is off.

    With a `page`, one student's values are drawn and told in that file, too. With a `template`, the file
    to fill in is written, with a line for each position unless one is named.
    """
    lang, file, page = options.lang, options.measured, options.page
    speaker = tongue(lang)
    if page is not None and page.suffix.lower() != ".html":
        raise failure(CallError, "page_file", file=page)
    wanted = checked_level(options.level)
    assignment = load_assignment(name)
    rubric = rubric_of(assignment)
    if options.template is not None:
        named = [replace(options, position=one) for one in assignment.positions(options.position)]
        variants = [_variant(assignment, None, one) for one in named]
        _write_template(options.template, columns_of(assignment, rubric), variants, speaker)
    if file is None:
        if options.template is None:
            raise failure(CallError, "measured_needed")
        return False
    all_right = True
    students = read_measurements(file, names_of(assignment), is_own=True)
    if page is not None and len(students) != 1:
        raise failure(CallError, "page_students", file=file, count=len(students))
    # Of a table with a line for each position, those that are still blank wait.
    students = tuple(one for one in students if one.numbers or one.scales or one.problems) or students[:1]
    if not students:
        typer.secho(speaker.gettext(NOTHING), fg="yellow")
    for entered in students:
        variant = _variant(assignment, entered, options)
        _tell_head(entered, variant, speaker)
        check = check_values(entered, assignment, variant, speaker, wanted)
        _tell(check.lines, wanted, speaker)
        likely = likely_mistakes(check.judgement, wanted)
        mistakes = [mistake_feedback(mistake, lang, "full", assignment.names) for mistake in likely]
        for mistake, sentences in zip(likely, mistakes, strict=True):
            _print(f"{mistake.code}: {sentences}", "  ")
        if page is not None:
            _write_page(options, assignment, variant, entered, check.lines, mistakes)
        all_right = all_right and check.is_all_right and not entered.problems
    return not (all_right and students)


def check_photo(name: str, options: CheckOptions) -> bool:
    """Print what spoils a photo, and right or off for every value read on it; whether anything is off."""
    from grader.folder.workers import Limits, Workers, result_of
    from grader.self_check.photo import photo_check

    lang, file, speaker = options.lang, cast("Path", options.photo), tongue(options.lang)
    if any((options.measured, options.page, options.template)):
        alone = {"option": "--measured, --page, --template", "other": "--photo"}
        raise failure(CallError, "photo_alone", "unused_beside", **alone)
    wanted = checked_level(options.level)
    assignment = load_assignment(name)
    variant = _variant(assignment, None, options)
    with Workers(1, Limits(), photo_check.__module__) as workers:
        told = result_of(workers, photo_check, file, assignment, rubric_of(assignment), variant, lang, wanted)
    typer.secho(f"{shown_text(file.name)}, {terminal.named(variant.numbers)}", bold=True)
    for text in (*told.flaws.values(), *told.problems):
        _print(text, "  ", "yellow")
    if told.judgement is not None:
        _tell(told.lines, wanted, speaker)
    return not told.is_all_right


def checked_level(level: str) -> Level:
    """A level of feedback; raises CallError for another word."""
    wanted = next((known for known in LEVELS if known == level), None)
    if wanted is None:
        raise failure(CallError, "unknown_level", level=level, names=tuple(LEVELS))
    return wanted


def _write_template(file: Path, asked: dict[str, str], variants: Sequence[Variant], speaker: Tongue) -> None:
    """Write the file that a student fills in: columns, a comment with units, a line for each variant."""
    if file.suffix.lower() != ".csv":
        known = {"option": "--template", "file": file, "names": ".csv"}
        raise failure(CallError, "template_file", "ending", **known)
    if file.exists():
        raise failure(CallError, "template_exists", file=file)
    columns = dict.fromkeys(variants[0].numbers, "") | asked
    units = [speaker.unit(unit) for unit in columns.values()]
    head = [list(columns), [f"# {units[0]}".strip(), *units[1:]], [speaker.gettext(HOW_TO_FILL_IN)]]
    lines = [[str(one.numbers.get(name, "")) for name in columns] for one in variants]
    # Spreadsheets of languages with decimal commas separate fields by semicolons.
    text = written([*head, *lines], "," if speaker.decimal_mark == "." else ";")
    # With a byte order mark: spreadsheets take the file for UTF-8.
    write_whole(file, text.encode("utf-8-sig"))
    terminal.say(speaker.gettext(WRITTEN) % {"file": file})


def _write_page(
    options: CheckOptions,
    assignment: Assignment,
    variant: Variant,
    entered: Measurements,
    lines: Sequence[CheckedLine],
    mistakes: list[str],
) -> None:
    """The same as a page, with the plans drawn as measured."""
    from grader.feedback.student_page import About
    from grader.pipeline import mark
    from grader.self_check.page import check_page
    from grader.tables.measurements import StudentSubmission

    page, lang = cast("Path", options.page), options.lang
    submission = StudentSubmission(entered.student_id or "", variant, measured=entered, lang=lang)
    report, painted = mark(submission, (), assignment, rubric_of(assignment), options.level)
    problems = [*entered.problems, *entered.reading.problems]
    told = [*problem_documents(problems)]
    about = About(assignment.file.title.in_language(lang), "", assignment.names)
    report = report.model_copy(update={"problems": told})
    write_whole(page, check_page(report, painted(options.level), lines, mistakes, lang, about))


def _variant(assignment: Assignment, entered: Measurements | None, options: VariantOptions) -> Variant:
    """The variant of the call or the file; raises CallError where they contradict each other."""
    chosen: dict[str, int | None] = {}
    for what, called in (("n", options.n), ("position", options.position)):
        filed = None if entered is None else getattr(entered, what)
        if entered is not None and called is not None and filed is not None and called != filed:
            known = {"what": what, "called": called, "filed": filed, "file": entered.source}
            raise failure(CallError, f"{what}_disagrees", "number_disagrees", **known)
        chosen[what] = filed if called is None else called
    return assignment.variant(chosen["n"], chosen["position"])


def _tell_head(entered: Measurements, variant: Variant, speaker: Tongue) -> None:
    who = [entered.student_id] if entered.student_id else []
    numbers = [terminal.named(variant.numbers)] if variant.numbers else []
    if parts := [*who, *numbers]:
        typer.secho(", ".join(parts), bold=True)
    for problem in (*entered.problems, *entered.reading.problems):
        _print(message(problem, speaker), "  ", "yellow")


def _tell(lines: Sequence[CheckedLine], level: Level, speaker: Tongue) -> None:
    if not lines:
        typer.secho(f"  {speaker.gettext(NOTHING)}", fg="yellow")
        return
    wide = max(len(line.name) for line in lines)
    for line in lines:
        one, hint = line.checked, line.hint
        if level == "full" and one.measured and one.expected:
            hint = f"{_number(one.measured)} / {_number(one.expected)}  {hint}"
        typer.secho(f" {RESULTS[line.result][0]}", fg=STYLES[line.result], nl=False)
        terminal.say(f"  {line.name:{wide}}  ", nl=False)
        _print(hint, " " * (wide + 6), is_begun=True)
        if line.advice:
            _print(f"→ {line.advice}", " " * (wide + 6))


def _print(text: str, indent: str, colour: str | None = None, *, is_begun: bool = False) -> None:
    """Print a text wrapped to the terminal, every line but one that is begun already behind an indent."""
    wide = max(shutil.get_terminal_size().columns - 1, len(indent) + 30)
    text = terminal.shown(text)
    lines = textwrap.wrap(text, wide, initial_indent=indent, subsequent_indent=indent) or [indent]
    typer.secho("\n".join(lines).removeprefix(indent if is_begun else ""), fg=colour)


def _number(quantity: Quantity) -> str:
    if quantity.length_mm is not None:
        return f"{quantity.length_mm:.2f} mm"
    return "-" if quantity.value is None else f"{quantity.value:.4g} {quantity.unit or ''}"
