"""Feedback as the short HTML that goes beside a grade."""

from collections.abc import Sequence

from markupsafe import Markup

from grader.documents import ReportDocument
from grader.i18n import Tongue, tongue
from grader.scene import MARKS

SAID = {"partial", "none", "review", "follow_through"}
"""The verdicts that are worth a comment."""


def comment(reports: Sequence[ReportDocument], lang: str) -> str:
    """What is to be said to a student in a few lines: what is not simply right. HTML, one line."""
    speaker = tongue(lang)
    return str(Markup("").join(_of_report(report, speaker, many=len(reports) > 1) for report in reports))


def _of_report(report: ReportDocument, speaker: Tongue, *, many: bool) -> Markup:
    head = Markup("")
    if many:
        head = Markup("<p><b>{} {}</b></p>").format(speaker.gettext("Position"), report.position)
    said = [criterion for criterion in report.criteria if criterion.verdict in SAID]
    if not said:
        return head + Markup("<p>{}</p>").format(speaker.gettext("Everything is right."))
    items = Markup("").join(
        Markup("<li>{} <b>{}</b>: {}</li>").format(
            MARKS[criterion.verdict], criterion.title, " ".join(criterion.feedback.split())
        )
        for criterion in said
    )
    return head + Markup("<ul>{}</ul>").format(items)
