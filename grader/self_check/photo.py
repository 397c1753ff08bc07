"""The check of a photo: values that are right, off or not read, and flaws that impair reading."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from grader.files import shown_text
from grader.language import N_, Tongue, tongue
from grader.options import Level
from grader.overlay.picture import overlay
from grader.pipeline import judged, pictures_of, read_submission, scan
from grader.records import ACCELERATION_PLAN, VELOCITY_PLAN, PageRef, Reason, ScannedPage
from grader.rubric import RubricFile, asked_of
from grader.scan.decode.pages import count_pages
from grader.self_check.advice import checked_lines
from grader.self_check.values import SelfCheck
from grader.tables.measurements import NOTHING_MEASURED, StudentSubmission
from grader.texts.spoken import message, sentence
from reference.authored.assignment import Assignment, Variant
from reference.errors import InputFileError
from reference.quantities import sort_of


def photo_check(
    path: Path, assignment: Assignment, rubric: RubricFile, variant: Variant, lang: str, level: Level = "hint"
) -> SelfCheck:
    """Check a student's photo, scan, or PDF of several.

    Raises InputFileError for a file that is not there, CallError for an unknown language.
    """
    speaker = tongue(lang)
    try:
        count = count_pages(path)
    except InputFileError as error:
        if error.code == "file_missing":
            raise
        # The page will say why.
        count = 1
    refs = [PageRef(shown_text(path.name), number, count, path=path) for number in range(1, count + 1)]
    submission = StudentSubmission("", variant, tuple(refs), lang=lang)
    asked = asked_of(assignment, rubric)
    pages = read_submission(submission, [scan(ref, asked) for ref in refs], assignment, asked)
    pages = [page.asked_only(rubric.vectors) for page in pages]
    spoilt = {flaw.code: sentence(flaw, speaker) for page in pages for flaw in page.flaws}
    readings = [page.reading for page in pages]
    problems = [problem for page in pages for problem in (*page.problems, *_other_number(page, variant))]
    answer = judged(submission, assignment, rubric, readings)
    if isinstance(answer, Reason):
        known = [*problems, answer]
        pictures = tuple(overlay(page.backdrop, page.reading, {}, {}) for page in pages if page.backdrop)
        return SelfCheck(problems=_said(known, speaker), flaws=spoilt, pictures=pictures)
    task, judgement, _ = answer
    drawn = {figure for reading in readings for figure in reading.figures}
    figures = {
        name: task.construction.figure_of(vector.head) for name, vector in task.construction.vectors.items()
    }
    unread = {name for name, figure in figures.items() if figure in drawn}
    asked_for = {figures.get(one) for one in rubric.vectors} - drawn
    absent = dict.fromkeys(sort_of(figure) for figure in task.construction.poles if figure in asked_for)
    told = [*(speaker.gettext(PLANS_UNSEEN[figure]) for figure in absent), *_said(problems, speaker)]
    lines = checked_lines(judgement, level, speaker, assignment, unread)
    pictures = pictures_of(pages, NOTHING_MEASURED, task.construction, judgement, show_expected=False)
    return SelfCheck(tuple(lines), tuple(told), judgement, spoilt, pictures)


PLANS_UNSEEN = {
    VELOCITY_PLAN: N_("No velocity plan was found: if it is on another sheet, check that one, too."),
    ACCELERATION_PLAN: N_("No acceleration plan was found: if it is on another sheet, check that one, too."),
    "force_plan": N_("No force plan was found: if it is on another sheet, check that one, too."),
}
"""Shown for a photo on which the plan of this name was not found."""
_OF_NO_USE = frozenset(
    {"resolution_wrong", "resolution_assumed", "paper_assumed", "upright_unsure", "title_block_unsure"}
)
"""Problems about which somebody with a phone can do nothing."""


def _said(problems: Sequence[Reason], speaker: Tongue) -> tuple[str, ...]:
    """Return the problems as a student reads them, each once."""
    told = [
        sentence(one, speaker, brief=True) or message(one) for one in problems if one.code not in _OF_NO_USE
    ]
    return tuple(dict.fromkeys(told))


def _other_number(page: ScannedPage, variant: Variant) -> Iterator[Reason]:
    """Report a number or position in a printed sheet's code that differs from the student's."""
    code = page.ref.identity
    for what in ("n", "position"):
        printed = None if code is None else getattr(code, what)
        if printed is not None and printed != getattr(variant, what):
            known = {"printed": printed, "given": str(variant)}
            yield Reason(f"{what}_disagrees", known, page.ref.file)
