"""The page of a self-check: values that are right, off or open, and the plans as measured; no points."""

from collections.abc import Sequence

from grader.documents import ReportDocument
from grader.feedback.student_page import About, StudentPage
from grader.feedback.words import environment
from grader.language import tongue
from grader.overlay.scene import Picture
from grader.self_check.advice import RESULTS, CheckedLine

VERDICTS = {"right": "full", "off": "none", "open": "not_judged"}
"""The verdict whose colour each result has."""


def check_page(
    report: ReportDocument,
    pictures: Sequence[Picture],
    lines: Sequence[CheckedLine],
    mistakes: Sequence[str],
    lang: str,
    about: About,
) -> str:
    """Return the page as HTML.

    Arguments
    ---------
    report : its variant, its problems and the names of its criteria are shown, none of its verdicts
    lines : the result for each value, from `grader.self_check.advice.checked_lines`
    mistakes : sentences on mistakes; empty if none may be shown
    """
    speaker = tongue(lang)
    page = StudentPage(report, tuple(pictures), speaker, about=about)
    groups = [
        (result, [line for line in lines if line.result == result]) for result in ("off", "open", "right")
    ]
    return (
        environment(speaker.lang)
        .get_template("check.html")
        .render(
            page=page, title=about.title, groups=groups, mistakes=mistakes, results=RESULTS, tone=VERDICTS
        )
    )
