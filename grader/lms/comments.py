"""Feedback as the few lines that go beside a grade, as HTML and as plain text."""

from collections.abc import Sequence

from markupsafe import Markup

from grader.documents import CriterionDocument, ReportDocument
from grader.i18n import Tongue, tongue
from grader.scene import MARKS

SAID = {"partial", "none", "review", "follow_through"}
"""The verdicts that are worth a comment."""


def comment(reports: Sequence[ReportDocument], lang: str) -> str:
    """What is to be said to a student in a few lines: what is not simply right. HTML, one line."""
    speaker = tongue(lang)
    return str(Markup("").join(_of_report(report, speaker, many=len(reports) > 1) for report in reports))


def plain_comment(reports: Sequence[ReportDocument], lang: str) -> str:
    """The same as plain text, a line for each thing said."""
    speaker = tongue(lang)
    lines = []
    for report in reports:
        if len(reports) > 1:
            lines.append(f"{speaker.gettext('Position')} {report.position}")
        said = [
            f"{MARKS[criterion.verdict]} {criterion.title}: {_sentence(criterion)}"
            for criterion in _said(report)
        ]
        lines += said or [speaker.gettext("Everything is right.")]
    return "\n".join(lines)


def _said(report: ReportDocument) -> list[CriterionDocument]:
    return [criterion for criterion in report.criteria if criterion.verdict in SAID]


def _sentence(criterion: CriterionDocument) -> str:
    return " ".join(criterion.feedback.split())


def _of_report(report: ReportDocument, speaker: Tongue, *, many: bool) -> Markup:
    head = Markup("")
    if many:
        head = Markup("<p><b>{} {}</b></p>").format(speaker.gettext("Position"), report.position)
    said = _said(report)
    if not said:
        return head + Markup("<p>{}</p>").format(speaker.gettext("Everything is right."))
    items = Markup("").join(
        Markup("<li>{} <b>{}</b>: {}</li>").format(
            MARKS[criterion.verdict], criterion.title, _sentence(criterion)
        )
        for criterion in said
    )
    return head + Markup("<ul>{}</ul>").format(items)
