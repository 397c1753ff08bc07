"""`summary.csv`, a row per student and position; and the long table, a row per criterion."""

from pathlib import Path

from grader.documents import CriterionDocument, ReportDocument, ResultsDocument
from grader.files import write_whole
from grader.lms.table import Cell, csv_text

_FIXED = ("student_id", "n", "position", "status", "score", "max_score", "score_low", "score_high")
_LAST = ("mistakes", "problems")


def write_summary(results: ResultsDocument, path: Path) -> None:
    """Write a row per student and position, with a column per criterion; raises OutputError."""
    write_whole(path, summary_text(results))


def summary_text(results: ResultsDocument) -> str:
    """The summary as CSV text; points are blank where a criterion is under review or not judged."""
    criteria = list(
        dict.fromkeys(criterion.id for report in results.reports for criterion in report.criteria)
    )
    header = [*_FIXED, *(_column(criterion) for criterion in criteria), *_LAST]
    return csv_text(header, (_summary_row(report, criteria) for report in results.reports))


def _column(criterion: str) -> str:
    """A criterion's column; one that is named as a fixed column is told apart."""
    return f"criterion_{criterion}" if criterion in {*_FIXED, *_LAST} else criterion


def _summary_row(report: ReportDocument, criteria: list[str]) -> list[Cell]:
    points = {criterion.id: criterion.points for criterion in report.criteria}
    low, high = report.score_range or (None, None)
    return [
        report.student_id,
        report.variant.get("n"),
        report.position,
        report.status,
        report.score,
        report.max_score,
        low,
        high,
        *(points.get(criterion) for criterion in criteria),
        " ".join(f"{mistake.code}@{mistake.at}" for mistake in report.mistakes),
        " ".join(dict.fromkeys(problem.code for problem in report.problems)),
    ]


_LONG = (
    "student_id", "n", "position", "status", "criterion", "title", "name", "verdict", "points", "max_points",
    "measured_mm", "measured_deg", "measured_value", "expected_mm", "expected_deg", "expected_value", "unit",
    "tolerance_mm", "tolerance_deg", "confidence", "mistake", "feedback",
)  # fmt: skip


def criteria_text(results: ResultsDocument) -> str:
    """A row per student, position and criterion, with all that was measured and expected."""
    rows = (_criterion_row(report, criterion) for report in results.reports for criterion in report.criteria)
    return csv_text(_LONG, rows)


def _criterion_row(report: ReportDocument, criterion: CriterionDocument) -> list[Cell]:
    measured, expected, tolerance = criterion.measured, criterion.expected, criterion.tolerance
    return [
        report.student_id, report.variant.get("n"), report.position, report.status,
        criterion.id, criterion.title, criterion.vector, criterion.verdict,
        criterion.points, criterion.max_points,
        measured.length_mm, measured.direction_deg, measured.value,
        expected.length_mm, expected.direction_deg, expected.value, expected.unit or measured.unit,
        tolerance.length_mm, tolerance.direction_deg,
        criterion.confidence, criterion.mistake, criterion.feedback,
    ]  # fmt: skip
