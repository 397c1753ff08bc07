"""Moodle's marking guide through its web services: the rubric as a guide, and students' points in it.

Texts and limits are those of Moodle 4.5, which checks neither the points' range nor that all criteria
are filled: both are checked here.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any

from grader.lms.grades import Delivery, Grade, Options
from grader.lms.marks import (
    Criterion,
    Mark,
    check_unique,
    class_criteria,
    comment,
    criteria_in,
    own_document,
    platform_marks,
    read_answer,
)
from grader.records import Reason
from grader.texts.spoken import failure
from reference.errors import CallError, InputFileError

_LONGEST_NAME = 255
"""Characters of a criterion's name that Moodle stores."""
_NO_TAGS = str.maketrans("<>", "‹›")
"""Moodle refuses names in which it sees a tag."""
_PLAIN, _HTML = 2, 1
"""Moodle's FORMAT_PLAIN and FORMAT_HTML."""
_READY = 20
"""Status of a definition that is ready for use."""
_NUMBER = re.compile("[1-9][0-9]*")


# The calls ----------------------------------------------------------------------------------------


def guide(grades: Sequence[Grade], options: Options) -> Delivery:
    """The call that makes the rubric a marking guide of an assignment.

    Raises CallError where nothing says which assignment, and where it has or may have a guide: saving
    another deletes it with everybody's points. `replace_guide` allows that, by Moodle's answer to
    core_grading_get_gradingform_instances, which holds what goes.
    """
    cmid, context_id = _place(options)
    moment = int(options.moment.timestamp())
    criteria = class_criteria(grades, options)
    # Moodle reads the list of frequent comments even where it is empty, so there is one.
    frequent = {"sortorder": 1, "description": "See the feedback file.", "descriptionformat": _PLAIN}
    definition = {
        "method": "guide",
        "name": (options.item.strip() or grades[0].assignment).translate(_NO_TAGS),
        "description": "",
        "descriptionformat": _PLAIN,
        "status": _READY,
        # Moodle sets these four by itself, but they must be in the call.
        "timecreated": moment,
        "usercreated": 0,
        "timemodified": moment,
        "usermodified": 0,
        "guide": {
            "guide_criteria": [_criterion(order, each) for order, each in enumerate(criteria, start=1)],
            "guide_comments": [frequent],
        },
    }
    area = {
        "cmid": cmid, "contextid": context_id, "component": "mod_assign", "areaname": "submissions",
        "activemethod": "guide", "definitions": [definition],
    }  # fmt: skip
    call: dict[str, object] = {
        "wsfunction": "core_grading_save_definitions",
        "arguments": {"areas": [area]},
    }
    notes = []
    if options.replace_guide is not None:
        lost = _fillings(options.replace_guide)
        call["fillings_lost"] = sum(lost)
        notes = [Reason("guide_lost", {"count": sum(lost), "grades": len(lost)})]
    return Delivery(own_document(grades, **call), notes=tuple(notes))


def _place(options: Options) -> tuple[int, int]:
    """The numbers of an activity and of its context; CallError where there are none, or it has a guide."""
    area = _area(options)
    cmid = options.cmid or _number(area.get("cmid"))
    context_id = options.context_id or _number(area.get("contextid"))
    method = area.get("activemethod") or ""
    if cmid is None or context_id is None:
        raise failure(CallError, "place_needed", "guide_place")
    if method not in ("", "guide"):
        raise failure(CallError, "guide_exists", "other_method", file=options.criteria, text=method)
    if options.replace_guide is None and (not area or any(criteria_in(area))):
        raise failure(CallError, "guide_exists")
    return cmid, context_id


def fillings_in(answer: Any) -> list[int]:  # noqa: ANN401 - whatever Moodle answers
    """Count the points of each grade in Moodle's answer; LookupError and others for another answer."""
    # An instance that nobody filled in has no guide.
    return [len((each.get("guide") or {}).get("criteria", ())) for each in answer["instances"]]


def _fillings(path: Path) -> list[int]:
    """Count the points in an answer of Moodle; InputFileError for another answer."""
    answer = read_answer(path)
    try:
        return fillings_in(answer)
    except (LookupError, TypeError, AttributeError) as error:
        known = {"file": path, "asked": "core_grading_get_gradingform_instances"}
        raise failure(InputFileError, "criteria", "no_answer_to", **known) from error


def _area(options: Options) -> Mapping[str, object]:
    """An activity in Moodle's answer to core_grading_get_definitions; empty where there is no answer."""
    if options.criteria is None:
        return {}
    answer = read_answer(options.criteria)
    areas = answer.get("areas") if isinstance(answer, dict) else None
    if not isinstance(areas, list) or len(areas) != 1 or not isinstance(areas[0], dict):
        known = {"file": options.criteria, "asked": "core_grading_get_definitions"}
        raise failure(InputFileError, "criteria", "no_answer_to", **known)
    return areas[0]


def _number(value: object) -> int | None:
    return value if isinstance(value, int) and not isinstance(value, bool) and value > 0 else None


def _criterion(order: int, criterion: Criterion) -> dict[str, object]:
    return {
        "sortorder": order,
        "shortname": criterion.name.translate(_NO_TAGS)[:_LONGEST_NAME],
        "description": criterion.titles[0],
        "descriptionformat": _PLAIN,
        "descriptionmarkers": "",
        "descriptionmarkersformat": _PLAIN,
        "maxscore": criterion.max_points,
    }


def fillings(grades: Sequence[Grade], options: Options) -> Delivery:
    """Everybody's points in the guide, a call for each student.

    Raises CallError where the numbers of the assignment or of the criteria are not given,
    InputFileError where the criteria are not the rubric's.
    """
    if options.assignment_id is None or options.criteria is None:
        raise failure(CallError, "place_needed", "guide_numbers")
    criteria, marked = platform_marks(grades, options, options.criteria)
    for each in criteria:
        if not _NUMBER.fullmatch(each.id):
            known = {"file": options.criteria, "name": each.criterion, "text": each.id}
            raise failure(InputFileError, "criteria", "criterion_number", **known)
    calls, missing = [], {}
    for grade, marks in marked:
        user = grade.person.platform_id
        if not user:
            missing[grade.student_id] = Reason("id_absent", {"platform": "Moodle"})
            continue
        if not _NUMBER.fullmatch(user):
            raise failure(CallError, "ids", student=grade.student_id, text=user, platform="Moodle")
        filled = [_filled(int(number), mark) for number, mark in marks.items()]
        arguments = {
            "assignmentid": int(options.assignment_id),
            "userid": int(user),
            # None: Moodle works it out from the guide, and where the assignment has none it must not take
            # points for a grade out of another maximum.
            "grade": -1,
            "attemptnumber": -1,  # the latest
            "addattempt": 0,
            "workflowstate": "",
            "applytoall": 0,
            # Moodle aborts in the midst where a comment exists and none is given
            # (mod/assign/feedback/comments/locallib.php, `is_feedback_modified`).
            "plugindata": {"assignfeedbackcomments_editor": {"text": comment(grade), "format": _HTML}},
            "advancedgradingdata": {"guide": {"criteria": filled}},
        }
        call = {"student_id": grade.student_id, "wsfunction": "mod_assign_save_grade", "arguments": arguments}
        calls.append(call)
    if missing and not calls:
        raise failure(CallError, "ids_needed")
    check_unique((grade.person.platform_id for grade, _ in marked if grade.person.platform_id), "user")
    content = own_document(grades, criteria=[asdict(each) for each in criteria], calls=calls)
    return Delivery(content, unplaced=missing, notes=(Reason("comments_go_too"),))


def _filled(number: int, mark: Mark) -> dict[str, object]:
    """A remark is shown as HTML."""
    remark = escape(mark.remark, quote=False).replace("\n", "<br>")
    filling = {"criterionid": number, "score": mark.points, "remark": remark, "remarkformat": _HTML}
    return {"criterionid": number, "fillings": [filling]}
