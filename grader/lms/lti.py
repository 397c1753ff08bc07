"""Scores for LTI Advantage's Assignment and Grade Services.

A sheet that waits for a person is told as `PendingManual`, without a score: anything but `FullyGraded`
takes a grade back. Who has handed in nothing has no Score: posting one would hand in for them.
"""

from collections.abc import Sequence

from grader.lms.comments import plain_comment
from grader.lms.documents import LtiDocument
from grader.lms.draft import Draft, document, json_text, withheld
from grader.lms.grades import Grade, rescaled
from grader.lms.options import Options

DECIMALS = 5


def scores(grades: Sequence[Grade], options: Options) -> Draft:
    """A Score for everybody who has handed in."""
    moment = options.moment.isoformat(timespec="milliseconds")
    waiting = dict(withheld(grades))
    is_mapped = any(person.platform_id for person in options.people.values())
    missing, told, pending = {}, [], 0
    for grade in grades:
        person = options.person(grade.student_id)
        if grade.score is None and all(report.status == "missing" for report in grade.reports):
            continue
        if is_mapped and not person.platform_id:
            missing[grade.student_id] = "the table of ids (--ids) has no id: the platform's userId"
            continue
        pending += grade.score is None
        told.append(
            {
                "userId": person.platform_id or grade.student_id,
                "timestamp": moment,
                "activityProgress": "Completed",
                **_graded(grade, options),
            }
        )
    whole = {"assignment": grades[0].reports[0].assignment, "scores": told}
    notes = []
    if not is_mapped:
        notes.append("userId is the student_id: where the platform knows users otherwise, give --ids")
    if pending:
        notes.append(f"{pending} of the withheld are told as PendingManual: the platform shows no grade")
    return Draft(
        json_text(document(LtiDocument, whole, "the Scores")),
        tuple(one.student_id for one in grades if one.score is not None and one.student_id not in missing),
        withheld=waiting,
        not_found=missing,
        notes=tuple(notes),
    )


def _graded(grade: Grade, options: Options) -> dict[str, object]:
    if grade.score is None:
        return {"gradingProgress": "PendingManual"}
    maximum = grade.max_score if options.maximum is None else options.maximum
    score = rescaled(grade, maximum, rescale=options.rescale) or 0.0
    return {
        "gradingProgress": "FullyGraded",
        "scoreGiven": round(score, DECIMALS),
        "scoreMaximum": maximum,
        "comment": plain_comment(grade.reports, options.lang_of(grade.student_id)),
    }
