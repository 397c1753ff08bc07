"""``planmark check``."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from grader.cli.app import check_language
from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.documents import Quantity
from grader.feedback.sentences import mistake_feedback, reason_sentence
from grader.files import write_whole
from grader.inputs.measurements import Measurements, names_of, read_measurements
from grader.language import Tongue, tongue
from grader.marking.mark import judge
from grader.marking.self_check import LEVELS, Checked, Level, checked_values, is_all_right, likely_mistakes
from grader.rubric import RubricFile, rubric_of
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.errors import CallError

MARKS = {"right": ("✓", "green"), "off": ("✗", "red"), "open": ("?", "magenta")}


def check_measured(
    name: str,
    n: int | None,
    position: int | None,
    file: Path,
    lang: str,
    level: str,
    page: Path | None = None,
) -> bool:
    """Print right or off for every value of a measurement file; whether anything is off.

    With a `page`, one student's values are drawn and told in that file, too.
    """
    check_language(lang)
    if page is not None and page.suffix.lower() != ".html":
        raise CallError("page_file", f"--page {page}: the name must end in .html; print the page for paper")
    wanted = checked_level(level)
    assignment = load_assignment(name)
    rubric = rubric_of(assignment)
    words = tongue(lang)
    console = Console()
    all_right = True
    students = read_measurements(file, names_of(assignment))
    if page is not None and len(students) != 1:
        raise CallError("page_students", f"--page is one student's: {file} holds {len(students)}")
    for entered in students:
        variant = _variant(assignment, entered, n, position)
        _tell_head(console, entered, variant)
        if page is not None:
            _write_page(page, assignment, rubric, variant, entered, lang, wanted)
        submission = Submission(measured=entered.reading, values=entered.values, declared=entered.scales)
        judgement = judge(task_of(assignment, rubric, variant), submission)
        checked = checked_values(judgement, wanted)
        _tell(console, checked, wanted, words, assignment)
        for mistake in likely_mistakes(judgement, wanted):
            sentences = mistake_feedback(mistake, lang, "full", assignment.file.names)
            console.print(f"  {mistake.code}: {sentences}", highlight=False, markup=False)
        all_right = all_right and is_all_right(checked) and bool(checked) and not entered.problems
    return not all_right


def checked_level(level: str) -> Level:
    """A level of feedback; raises CallError for another word."""
    wanted = next((known for known in LEVELS if known == level), None)
    if wanted is None:
        raise CallError("unknown_level", f"--level {level}: known are {', '.join(LEVELS)}")
    return wanted


def _write_page(
    page: Path,
    assignment: Assignment,
    rubric: RubricFile,
    variant: Variant,
    entered: Measurements,
    lang: str,
    level: Level,
) -> None:
    """The same as a page, with the plans drawn as measured."""
    from grader.feedback.student_page import About, feedback_page
    from grader.inputs.measurements import StudentSubmission
    from grader.pipeline import mark

    submission = StudentSubmission(entered.student_id or "", variant, measured=entered, lang=lang)
    report, pictures = mark(submission, (), assignment, rubric, level)
    about = About(assignment.file.title.in_language(lang), "", assignment.file.names)
    write_whole(page, feedback_page(report, pictures, lang, level, about))


def _variant(assignment: Assignment, entered: Measurements, n: int | None, position: int | None) -> Variant:
    """The variant of the call or the file; raises CallError where they contradict each other."""
    chosen = []
    for what, called, filed in (("n", n, entered.n), ("position", position, entered.position)):
        if called is not None and filed is not None and called != filed:
            raise CallError(
                f"{what}_disagrees",
                f"--{what} {called}, but {entered.source} says {what} {filed}: which is right?",
            )
        chosen.append(filed if called is None else called)
    return assignment.variant(*chosen)


def _tell_head(console: Console, entered: Measurements, variant: Variant) -> None:
    who = f"{entered.student_id}, " if entered.student_id else ""
    console.print(f"{who}{variant}", style="bold", highlight=False, markup=False)
    for problem in (*entered.problems, *entered.reading.problems):
        console.print(f"  {problem.message}", style="yellow", highlight=False, markup=False)


def _tell(
    console: Console, checked: tuple[Checked, ...], level: Level, words: Tongue, assignment: Assignment
) -> None:
    if not checked:
        console.print("  nothing that this assignment asks for was measured", style="yellow")
        return
    table = Table(box=None, show_header=False)
    names = assignment.file.names
    for value in checked:
        mark, style = MARKS[value.result]
        # What is right needs one reason: the others say what would be off, had it not been accepted.
        shown = value.reasons[:1] if value.result == "right" else value.reasons
        sentence = " ".join(reason_sentence(reason, words, level, names) for reason in shown)
        numbers = ""
        if level == "full" and value.measured and value.expected:
            numbers = f"{_number(value.measured)} / {_number(value.expected)}"
        table.add_row(f"[{style}]{mark}[/{style}]", names.get(value.name, value.name), numbers, sentence)
    console.print(table, highlight=False)


def _number(quantity: Quantity) -> str:
    if quantity.length_mm is not None:
        return f"{quantity.length_mm:.2f} mm"
    return "-" if quantity.value is None else f"{quantity.value:.4g} {quantity.unit or ''}"
