"""A student's score as JSON: Gradescope's `results.json`, and Scores of LTI Advantage.

Gradescope: criteria are test cases. Gradescope guesses a missing status from the points, so each test has
a status. A criterion that was not judged has neither passed nor failed: it is no test, and is named in the
output. Students without a grade have no file.

LTI (Assignment and Grade Services 2.0): a sheet that waits for a person is `PendingManual`, without a
score: anything but `FullyGraded` takes a grade back. Students who have handed in nothing have no Score:
posting a Score would hand in for them.
"""

from collections.abc import Sequence
from typing import Literal, get_args

from grader.lms.grades import Delivery, Grade, Options, ready
from grader.lms.marks import Mark, check_unique, json_text, marks_of, own_document, plain_comment
from grader.lms.table import number
from grader.records import Reason
from grader.texts.spoken import failure
from reference.errors import CallError

# Gradescope ---------------------------------------------------------------------------------------

Visibility = Literal["hidden", "after_due_date", "visible", "after_published"]


def results(grades: Sequence[Grade], options: Options) -> Delivery:
    """A folder for each student with its results.json; raises CallError for an unknown visibility."""
    visibility = options.visibility or "visible"
    known = get_args(Visibility)
    if visibility not in known:
        raise failure(CallError, "visibility", text=visibility, names=known)
    return Delivery(
        {
            f"{grade.student_id}/results.json": _results(grade, visibility, options).encode()
            for grade in ready(grades)
        }
    )


def _results(grade: Grade, visibility: str, options: Options) -> str:
    parts = len(grade.reports) if options.combine == "mean" else 1
    marks = marks_of(grade)
    judged = [mark for mark in marks if mark.verdict != "not_judged"]
    others = [f"{_name(mark)}: {mark.remark}" for mark in marks if mark.verdict == "not_judged"]
    content = {
        "score": float(number(grade.score or 0.0)),
        "output": "\n".join([plain_comment(grade), *others]),
        "output_format": "text",
        "visibility": visibility,
        "stdout_visibility": "hidden",
        "tests": [_test(index, mark, parts, visibility) for index, mark in enumerate(judged, start=1)],
        # The version stands here: Gradescope's own keys are all taken.
        "extra_data": {
            "schema_version": 1,
            "assignment": grade.assignment,
            "student_id": grade.student_id,
            "max_score": grade.max_score,
        },
    }
    return json_text(content)


def _test(index: int, mark: Mark, parts: int, visibility: str) -> dict[str, object]:
    where = {} if mark.position is None else {"position": mark.position}
    return {
        "name": _name(mark),
        "number": str(index),
        "score": mark.points / parts,
        "max_score": mark.max_points / parts,
        "status": "passed" if mark.is_full else "failed",
        "output": mark.remark,
        "output_format": "text",
        "visibility": visibility,
        "extra_data": {"criterion": mark.criterion, **where, "verdict": mark.verdict},
    }


def _name(mark: Mark) -> str:
    where = "" if mark.position is None else f" ({mark.position})"
    return f"{mark.criterion}: {mark.title}{where}"


# LTI ----------------------------------------------------------------------------------------------

_DECIMALS = 5
"""Decimals of a score, as in the tables."""


def scores(grades: Sequence[Grade], options: Options) -> Delivery:
    """A Score for everybody who has handed in."""
    is_mapped = any(person.platform_id for person in options.people.values())
    missing, posted = {}, []
    for grade in grades:
        user = grade.person.platform_id
        if grade.score is None and all(report.status == "missing" for report in grade.reports):
            continue
        if is_mapped and not user:
            missing[grade.student_id] = Reason("id_absent", {"platform": "LTI"})
            continue
        posted.append(
            {
                "userId": user or grade.student_id,
                "timestamp": options.moment.isoformat(timespec="milliseconds"),
                "activityProgress": "Completed",
                **_graded(grade, options),
            }
        )
    notes = [] if is_mapped else [Reason("users_by_id")]
    if pending := sum("scoreGiven" not in score for score in posted):
        notes.append(Reason("pending", {"count": pending}))
    assignment = grades[0].assignment
    line_item = {
        "label": options.item.strip() or assignment,
        "scoreMaximum": options.maximum or grades[0].max_score,
        "resourceId": assignment,
        "tag": "grade",
    }
    check_unique((str(score["userId"]) for score in posted), "userId")
    content = own_document(grades, lineItem=line_item, scores=posted)
    return Delivery(content, unplaced=missing, notes=tuple(notes))


def _graded(grade: Grade, options: Options) -> dict[str, object]:
    if grade.score is None:
        return {"gradingProgress": "PendingManual"}
    return {
        "gradingProgress": "FullyGraded",
        "scoreGiven": round(grade.out_of(options.maximum, rescale=options.rescale), _DECIMALS),
        "scoreMaximum": options.maximum or grade.max_score,
        "comment": plain_comment(grade),
    }
