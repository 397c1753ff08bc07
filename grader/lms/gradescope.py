"""Gradescope's `results.json`, one for each student: criteria as test cases.

Gradescope guesses a missing status from the points, so each test has one. What was not judged has
neither passed nor failed: it is no test, and is named beside them. Who has no grade yet has no file.
"""

from collections.abc import Sequence
from typing import get_args

from grader.lms.comments import plain_comment
from grader.lms.documents import GradescopeDocument, Visibility
from grader.lms.draft import Draft, document, json_text, ready, withheld
from grader.lms.grades import Grade
from grader.lms.marks import Mark, marks_of
from grader.lms.options import Options
from grader.lms.table import number
from reference.errors import CallError


def results(grades: Sequence[Grade], options: Options) -> Draft:
    """A folder for each student with its results.json; raises CallError for an unknown visibility."""
    visibility = options.visibility or "visible"
    known = get_args(Visibility)
    if visibility not in known:
        raise CallError("visibility", f"'{visibility}' is no visibility: choose {', '.join(known)}")
    told = ready(grades)
    files = {
        f"{grade.student_id}/results.json": json_text(_results(grade, visibility, options)).encode()
        for grade in told
    }
    return Draft(files, tuple(one.student_id for one in told), withheld=withheld(grades))


def _results(grade: Grade, visibility: str, options: Options) -> GradescopeDocument:
    parts = len(grade.reports) if options.combine == "mean" else 1
    marks = marks_of(grade, options.lang_of(grade.student_id))
    judged = [mark for mark in marks if mark.verdict != "not_judged"]
    tests = [_test(str(place), mark, parts, visibility) for place, mark in enumerate(judged, start=1)]
    others = [f"{_name(mark)}: {mark.remark}" for mark in marks if mark.verdict == "not_judged"]
    told = {
        "score": float(number(grade.score or 0.0)),
        "output": "\n".join([plain_comment(grade.reports, options.lang_of(grade.student_id)), *others]),
        "visibility": visibility,
        "tests": tests,
        "extra_data": {
            "assignment": grade.reports[0].assignment,
            "student_id": grade.student_id,
            "max_score": grade.max_score,
        },
    }
    return document(GradescopeDocument, told, f"results.json of {grade.student_id}")


def _test(place: str, mark: Mark, parts: int, visibility: str) -> dict[str, object]:
    return {
        "name": _name(mark),
        "number": place,
        "score": mark.points / parts,
        "max_score": mark.max_points / parts,
        "status": "passed" if mark.is_full else "failed",
        "output": mark.remark,
        "visibility": visibility,
        "extra_data": {"criterion": mark.criterion, "position": mark.position, "verdict": mark.verdict},
    }


def _name(mark: Mark) -> str:
    where = "" if mark.position is None else f" ({mark.position})"
    return f"{mark.criterion}: {mark.title}{where}"
