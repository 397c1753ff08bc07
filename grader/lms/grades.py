"""One grade per student for a gradebook, and which ones are held back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from grader.documents import ReportDocument, ResultsDocument
from grader.roster import why_no_id
from reference.errors import CallError, InputFileError


@dataclass(frozen=True, slots=True)
class Person:
    """Who a student is outside; what is not known is empty.

    Attributes
    ----------
    platform_id : the platform's own number or name of the student
    participant : number in the assignment's worksheet
    lang : in which the feedback is
    """

    name: str = ""
    email: str = ""
    username: str = ""
    platform_id: str = ""
    participant: int | None = None
    lang: str = ""


@dataclass(frozen=True, slots=True)
class Grade:
    """A student's grade, or why there is none yet.

    Attributes
    ----------
    folders : of each report below the results: the student's, with several positions one for each
    """

    student_id: str
    score: float | None
    max_score: float
    reports: tuple[ReportDocument, ...]
    withheld: str = ""
    folders: tuple[str, ...] = ()


COMBINE = ("sum", "mean")


def grades_of(
    results: ResultsDocument, *, position: int | None = None, combine: str | None = None
) -> list[Grade]:
    """A grade per student.

    A student with several positions needs a choice: one `position`, or `combine` by ``sum`` or
    ``mean``. A sum or mean waits for all of its parts.

    Raises CallError where the choice is missing or not one, InputFileError for results that
    contradict themselves.
    """
    if combine is not None and combine not in COMBINE:
        known = " or ".join(COMBINE)
        raise CallError("combine", f"'{combine}' is no way to combine positions: choose {known}")
    if position is not None and combine is not None:
        raise CallError("combine", "either one position or a way to combine them, not both")
    _check(results.reports)
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
            folders = tuple(_folder(report, len(reports)) for report in chosen)
            found.append(_grade(student_id, chosen, combine, folders))
    if not found:
        raise CallError("nothing_to_export", "the results hold no report that could be exported")
    return found


def _check(reports: Sequence[ReportDocument]) -> None:
    """Results that somebody has changed by hand, or a program has mixed up."""
    faults = []
    seen = set()
    for report in reports:
        who = report.student_id if report.position is None else f"{report.student_id} at {report.position}"
        if why_no_id(report.student_id) is not None:
            faults.append(f"'{report.student_id}' is no student_id")
        if (report.student_id, report.position) in seen:
            faults.append(f"{who}: has two reports")
        seen.add((report.student_id, report.position))
        if report.score is not None and not 0.0 <= report.score <= report.max_score + 1e-9:
            faults.append(f"{who}: the score {report.score:g} is not between 0 and {report.max_score:g}")
        if report.max_score <= 0.0:
            faults.append(f"{who}: the maximum is {report.max_score:g}")
    if faults:
        told = "\n".join(f"  {fault}" for fault in faults)
        raise InputFileError("results_wrong", f"results.json contradicts itself; grade again\n{told}")


def _by_student(reports: Sequence[ReportDocument]) -> Mapping[str, list[ReportDocument]]:
    students: dict[str, list[ReportDocument]] = {}
    for report in reports:
        students.setdefault(report.student_id, []).append(report)
    return students


def _folder(report: ReportDocument, of_the_student: int) -> str:
    if of_the_student == 1:
        return report.student_id
    return f"{report.student_id}/{'unknown' if report.position is None else report.position}"


def _grade(
    student_id: str, reports: tuple[ReportDocument, ...], combine: str | None, folders: tuple[str, ...]
) -> Grade:
    maximum = sum(report.max_score for report in reports)
    parts = len(reports) if combine == "mean" else 1
    waiting = [report for report in reports if report.status != "graded" or report.score is None]
    if waiting:
        return Grade(student_id, None, maximum / parts, reports, _why(waiting), folders)
    score = sum(report.score for report in reports if report.score is not None)
    return Grade(student_id, score / parts, maximum / parts, reports, folders=folders)


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
            " set the same maximum there, or ask for rescaling (--rescale)",
        )
    return grade.score * maximum / grade.max_score
