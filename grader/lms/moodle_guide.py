"""Moodle's marking guide through its web services: the rubric as a guide, and students' points in it.

Moodle checks neither the points' range nor that all criteria are filled: both are checked here.
"""

from collections.abc import Sequence
from html import escape

from grader.lms.documents import MoodleMarksDocument, MoodleRubricDocument
from grader.lms.draft import Draft, document, json_text, withheld
from grader.lms.grades import Grade
from grader.lms.marks import Criterion, Mark, class_criteria, class_marks
from grader.lms.options import Options
from grader.lms.platform_ids import Place, numbered, place_of
from reference.errors import CallError

_LONGEST_NAME = 255
_NO_TAGS = str.maketrans("<>", "‹›")
"""Moodle refuses names in which it sees a tag."""


def guide(grades: Sequence[Grade], options: Options) -> Draft:
    """The call that makes the rubric a marking guide of an assignment.

    Raises CallError where nothing says which assignment, and where it has a guide already: saving
    another would delete it with everybody's points.
    """
    cmid, context_id = _free_place(options)
    made = int(options.moment.timestamp())
    criteria = class_criteria(grades, options)
    definition = {
        "name": (options.item.strip() or grades[0].reports[0].assignment).translate(_NO_TAGS),
        "timecreated": made,
        "timemodified": made,
        "guide": {
            "guide_criteria": [_criterion(order, one) for order, one in enumerate(criteria, start=1)],
            "guide_comments": [{"sortorder": 1, "description": "See the feedback file."}],
        },
    }
    told = {
        "assignment": grades[0].reports[0].assignment,
        "arguments": {"areas": [{"cmid": cmid, "contextid": context_id, "definitions": [definition]}]},
    }
    return Draft(json_text(document(MoodleRubricDocument, told, "the marking guide")), ())


def _free_place(options: Options) -> tuple[int, int]:
    """The numbers of the activity and its context; CallError where they are not told or a form is there."""
    place = place_of(options.criteria) if options.criteria else Place(None, None, ())
    cmid, context_id = options.cmid or place.cmid, options.context_id or place.context_id
    if cmid is None or context_id is None:
        raise CallError(
            "place_needed",
            "which assignment? Give Moodle's answer to core_grading_get_definitions (--criteria),"
            " or --cmid and --context-id",
        )
    if place.method not in ("", "guide"):
        raise CallError(
            "guide_exists",
            f"{options.criteria}: the assignment is graded by '{place.method}', and saving a guide would put"
            " that aside; choose 'Marking guide' or 'Simple direct grading' in Moodle first",
        )
    if place.criteria:
        raise CallError(
            "guide_exists",
            f"{options.criteria}: the assignment has a marking guide already, and saving another would"
            " delete it with everybody's points; delete it in Moodle first if that is meant",
        )
    return cmid, context_id


def _criterion(order: int, one: Criterion) -> dict[str, object]:
    return {
        "sortorder": order,
        "shortname": one.name.translate(_NO_TAGS)[:_LONGEST_NAME],
        "description": one.titles[0],
        "descriptionmarkers": "",
        "maxscore": one.max_points,
    }


def fillings(grades: Sequence[Grade], options: Options) -> Draft:
    """Everybody's points in the guide, a call for each student.

    Raises CallError where the assignment or the criteria's numbers are not told, InputFileError where
    they are not the rubric's.
    """
    if options.assignment_id is None or options.criteria is None:
        raise CallError(
            "place_needed",
            "Moodle's number of the assignment (--assignment-id) and of the criteria (--criteria: its answer"
            " to core_grading_get_definitions, or a CSV table criterion,id) are needed",
        )
    marked = class_marks(grades, options)
    criteria = numbered(class_criteria(grades, options), options.criteria)
    numbers = {one.criterion: one.id for one in criteria}
    calls, missing = [], {}
    for grade, marks in marked:
        user = options.person(grade.student_id).platform_id
        if not user:
            missing[grade.student_id] = "the table of ids (--ids) has no id: Moodle's number of the user"
            continue
        filled = [_filled(mark, numbers[mark.criterion]) for mark in marks]
        arguments = {
            "assignmentid": options.assignment_id,
            "userid": user,
            "advancedgradingdata": {"guide": {"criteria": filled}},
        }
        calls.append({"student_id": grade.student_id, "arguments": arguments})
    if missing and not calls:
        raise CallError(
            "ids_needed", "nobody's number in Moodle is known: give a table student_id,id (--ids)"
        )
    told = {"assignment": grades[0].reports[0].assignment, "criteria": criteria, "calls": calls}
    text = json_text(document(MoodleMarksDocument, told, "the marking guide's points"))
    written = tuple(grade.student_id for grade, _ in marked if grade.student_id not in missing)
    return Draft(text, written, withheld=withheld(grades), not_found=missing)


def _filled(mark: Mark, number: str) -> dict[str, object]:
    """A remark is shown as HTML."""
    remark = escape(mark.remark, quote=False).replace("\n", "<br>")
    filling = {"criterionid": number, "score": mark.points, "remark": remark}
    return {"criterionid": number, "fillings": [filling]}
