"""One grade per student for a gradebook, and which ones are held back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from grader.documents import ReportDocument, ResultsDocument
from reference.errors import CallError


@dataclass(frozen=True, slots=True)
class Person:
    """Who a student is outside; what is not known is empty.

    Attributes
    ----------
    participant : number of the assignment's worksheet, where somebody knows it
    """

    name: str = ""
    email: str = ""
    username: str = ""
    participant: int | None = None


@dataclass(frozen=True, slots=True)
class Grade:
    """A student's grade, or why there is none yet."""

    student_id: str
    score: float | None
    max_score: float
    reports: tuple[ReportDocument, ...]
    withheld: str = ""


COMBINE = ("sum", "mean")


def grades_of(
    results: ResultsDocument, *, position: int | None = None, combine: str | None = None
) -> list[Grade]:
    """A grade per student.

    A student with several positions needs a choice: one `position`, or `combine` by ``sum`` or
    ``mean``. A sum or mean waits for all of its parts.

    Raises CallError where the choice is missing or not one.
    """
    if combine is not None and combine not in COMBINE:
        known = " or ".join(COMBINE)
        raise CallError("combine", f"'{combine}' is no way to combine positions: choose {known}")
    if position is not None and combine is not None:
        raise CallError("combine", "either one position or a way to combine them, not both")
    found = []
    for student_id, reports in _by_student(results.reports).items():
        chosen = tuple(r for r in reports if position is None or r.position == position)
        if len(chosen) > 1 and combine is None:
            raise CallError(
                "several_positions",
                f"{student_id} has {len(chosen)} positions and the file has room for one grade:"
                " choose a position, or combine them by sum or mean",
            )
        if chosen:
            found.append(_grade(student_id, chosen, combine))
    if not found:
        raise CallError("nothing_to_export", "the results hold no report that could be exported")
    return found


def _by_student(reports: Sequence[ReportDocument]) -> Mapping[str, list[ReportDocument]]:
    students: dict[str, list[ReportDocument]] = {}
    for report in reports:
        students.setdefault(report.student_id, []).append(report)
    return students


def _grade(student_id: str, reports: tuple[ReportDocument, ...], combine: str | None) -> Grade:
    maximum = sum(report.max_score for report in reports)
    waiting = [report for report in reports if report.score is None]
    parts = len(reports) if combine == "mean" else 1
    if waiting:
        return Grade(student_id, None, maximum / parts, reports, _why(waiting))
    score = sum(report.score for report in reports if report.score is not None)
    return Grade(student_id, score / parts, maximum / parts, reports)


def _why(waiting: list[ReportDocument]) -> str:
    """In words for the terminal."""
    words = {
        "needs_review": "needs review",
        "unreadable": "unreadable",
        "missing": "nothing handed in",
        "graded": "has no score",
    }
    told = []
    for report in waiting:
        where = "" if report.position is None else f"position {report.position}: "
        told.append(where + words[report.status])
    return ", ".join(told)


def rescaled(grade: Grade, maximum: float, *, rescale: bool) -> float | None:
    """The score out of another maximum.

    Raises CallError where the maxima differ and nobody asked for rescaling: a silent 9 of 10 would
    become a 9 of 100.
    """
    if grade.score is None:
        return None
    if abs(maximum - grade.max_score) <= 1e-6 * max(1.0, maximum):
        return grade.score
    if not rescale:
        raise CallError(
            "maximum_differs",
            f"the grade's maximum there is {maximum:g}, the rubric's is {grade.max_score:g}:"
            " set the same maximum there, or ask for rescaling",
        )
    if grade.max_score <= 0.0:
        raise CallError("maximum_differs", f"{grade.student_id}: the rubric's maximum is {grade.max_score:g}")
    return grade.score * maximum / grade.max_score
