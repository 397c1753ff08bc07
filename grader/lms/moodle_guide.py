"""Moodle's marking guide through its web services: the rubric as a guide, and students' points in it.

Texts and limits are those of Moodle 4.5, which checks neither the points' range nor that all criteria
are filled: both are checked here.
"""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from grader.lms.grades import Delivery, Grade, Options
from grader.lms.marks import (
    Criterion,
    Filled,
    Id,
    Mark,
    NotNegative,
    Payload,
    PlatformCriterion,
    Positive,
    Version,
    check_points,
    check_unique,
    class_criteria,
    comment,
    criteria_in,
    json_document,
    platform_marks,
    read_answer,
)
from reference.errors import CallError, InputFileError

_LONGEST_NAME = 255
"""Characters of a criterion's name that Moodle stores."""
_NO_TAGS = str.maketrans("<>", "‹›")
"""Moodle refuses names in which it sees a tag."""


# What Moodle takes --------------------------------------------------------------------------------

PlainText = Literal[2]
Html = Literal[1]
"""Moodle's FORMAT_PLAIN and FORMAT_HTML."""


class MoodleCriterion(Payload):
    """A criterion of a marking guide."""

    sortorder: Id
    shortname: Annotated[str, Field(min_length=1, max_length=255)]
    description: str
    descriptionformat: PlainText = 2
    descriptionmarkers: str
    descriptionmarkersformat: PlainText = 2
    maxscore: Positive


class MoodleComment(Payload):
    """A frequent comment; Moodle reads the list of them even where it is empty, so there is one."""

    sortorder: Id
    description: Filled
    descriptionformat: PlainText = 2


class MoodleGuide(Payload):
    """A marking guide's content."""

    guide_criteria: Annotated[list[MoodleCriterion], Field(min_length=1)]
    guide_comments: Annotated[list[MoodleComment], Field(min_length=1)]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        check_unique((criterion.shortname for criterion in self.guide_criteria), "criterion")
        return self


class MoodleDefinition(Payload):
    """A marking guide ready for use. Who made it when is set by Moodle, but must be in the call."""

    method: Literal["guide"] = "guide"
    name: Filled
    description: str = ""
    descriptionformat: PlainText = 2
    status: Literal[20] = 20
    timecreated: Annotated[int, Field(ge=0)]
    usercreated: Literal[0] = 0
    timemodified: Annotated[int, Field(ge=0)]
    usermodified: Literal[0] = 0
    guide: MoodleGuide


class MoodleArea(Payload):
    """Where the guide belongs."""

    cmid: Id
    contextid: Id
    component: Literal["mod_assign"] = "mod_assign"
    areaname: Literal["submissions"] = "submissions"
    activemethod: Literal["guide"] = "guide"
    definitions: Annotated[list[MoodleDefinition], Field(min_length=1, max_length=1)]


class MoodleAreas(Payload):
    """Arguments of the call."""

    areas: Annotated[list[MoodleArea], Field(min_length=1, max_length=1)]


class MoodleRubricDocument(Payload):
    """The call that makes the rubric a marking guide of an assignment.

    `fillings_lost` says how many points of students may go with a guide that is there; None: none may be.
    """

    schema_version: Version = 1
    assignment: str
    fillings_lost: Annotated[int, Field(ge=0)] | None = None
    wsfunction: Literal["core_grading_save_definitions"] = "core_grading_save_definitions"
    arguments: MoodleAreas


class MoodleFilling(Payload):
    """Points and remark on a criterion."""

    criterionid: Id
    score: NotNegative
    remark: str
    remarkformat: Html = 1


class MoodleFilled(Payload):
    """A criterion filled."""

    criterionid: Id
    fillings: Annotated[list[MoodleFilling], Field(min_length=1, max_length=1)]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.fillings[0].criterionid != self.criterionid:
            raise ValueError(f"criterion {self.criterionid} is filled as {self.fillings[0].criterionid}")
        return self


class MoodleGuideFilled(Payload):
    """A marking guide filled."""

    criteria: list[MoodleFilled]


class MoodleAdvanced(Payload):
    """Advanced grading by marking guide."""

    guide: MoodleGuideFilled


class MoodleEditor(Payload):
    """The comment on the whole."""

    text: str
    format: Html = 1


class MoodlePlugins(Payload):
    """What feedback plugins take; Moodle aborts in the midst where the one for comments is given nothing.

    So in mod/assign/feedback/comments/locallib.php, `is_feedback_modified`, where a comment exists.
    """

    assignfeedbackcomments_editor: MoodleEditor


class MoodleGrade(Payload):
    """Arguments of the call.

    `grade` is -1, none: Moodle works it out from the guide, and where the assignment has none it
    must not take points for a grade out of another maximum.
    """

    assignmentid: Id
    userid: Id
    grade: Literal[-1] = -1
    attemptnumber: Literal[-1] = -1
    """The latest."""
    addattempt: Literal[0] = 0
    workflowstate: Literal[""] = ""
    applytoall: Literal[0] = 0
    plugindata: MoodlePlugins
    advancedgradingdata: MoodleAdvanced


class MoodleCall(Payload):
    """One student's call."""

    student_id: str
    wsfunction: Literal["mod_assign_save_grade"] = "mod_assign_save_grade"
    arguments: MoodleGrade


class MoodleMarksDocument(Payload):
    """Points by criterion of a marking guide: a call for each student."""

    schema_version: Version = 1
    assignment: str
    criteria: list[PlatformCriterion]
    calls: list[MoodleCall]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        check_unique((each.id for each in self.criteria), "criterion")
        check_unique((call.arguments.userid for call in self.calls), "user")
        for call in self.calls:
            filled = call.arguments.advancedgradingdata.guide.criteria
            check_unique((each.criterionid for each in filled), "criterion")
            points = {str(each.criterionid): each.fillings[0].score for each in filled}
            check_points(self.criteria, points)
        return self


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
    definition = {
        "name": (options.item.strip() or grades[0].assignment).translate(_NO_TAGS),
        "timecreated": moment,
        "timemodified": moment,
        "guide": {
            "guide_criteria": [_criterion(order, each) for order, each in enumerate(criteria, start=1)],
            "guide_comments": [{"sortorder": 1, "description": "See the feedback file."}],
        },
    }
    content: dict[str, object] = {
        "assignment": grades[0].assignment,
        "arguments": {"areas": [{"cmid": cmid, "contextid": context_id, "definitions": [definition]}]},
    }
    notes = []
    if options.replace_guide is not None:
        lost = _fillings(options.replace_guide)
        content["fillings_lost"] = sum(lost)
        notes = [f"saving this guide deletes the one there with {sum(lost)} fillings of {len(lost)} grades"]
    return Delivery(json_document(MoodleRubricDocument, content, "the marking guide"), notes=tuple(notes))


def _place(options: Options) -> tuple[int, int]:
    """The numbers of an activity and of its context; CallError where there are none, or it has a guide."""
    area = _area(options)
    cmid = options.cmid or _number(area.get("cmid"))
    context_id = options.context_id or _number(area.get("contextid"))
    method = area.get("activemethod") or ""
    if cmid is None or context_id is None:
        raise CallError(
            "place_needed",
            "which assignment? Give Moodle's answer to core_grading_get_definitions (--criteria),"
            " or --cmid and --context-id",
        )
    if method not in ("", "guide"):
        raise CallError(
            "guide_exists",
            f"{options.criteria}: the assignment is graded by '{method}', and saving a guide would put"
            " that aside; choose 'Marking guide' or 'Simple direct grading' in Moodle first",
        )
    if options.replace_guide is None and (not area or any(criteria_in(area))):
        known = "has a guide already" if area else "may have a guide (Moodle's answer, --criteria, tells)"
        raise CallError(
            "guide_exists",
            f"the assignment {known}, and saving another deletes it with everybody's points. If that is meant"
            " give Moodle's answer to core_grading_get_gradingform_instances, which tells how many"
            " (--replace-guide)",
        )
    return cmid, context_id


def _fillings(path: Path) -> list[int]:
    """How many points each grade by a guide holds, by Moodle's answer; InputFileError for another."""
    answer = read_answer(path)
    try:
        # An instance that nobody filled in has no guide.
        return [len((each.get("guide") or {}).get("criteria", ())) for each in answer["instances"]]
    except (LookupError, TypeError, AttributeError) as error:
        message = "is not Moodle's answer to core_grading_get_gradingform_instances"
        raise InputFileError("criteria", f"{path}: {message}") from error


def _area(options: Options) -> Mapping[str, object]:
    """An activity in Moodle's answer to core_grading_get_definitions; empty where there is no answer."""
    if options.criteria is None:
        return {}
    answer = read_answer(options.criteria)
    areas = answer.get("areas") if isinstance(answer, dict) else None
    if not isinstance(areas, list) or len(areas) != 1 or not isinstance(areas[0], dict):
        message = "is not Moodle's answer to core_grading_get_definitions for one activity"
        raise InputFileError("criteria", f"{options.criteria}: {message}")
    return areas[0]


def _number(value: object) -> int | None:
    return value if isinstance(value, int) and not isinstance(value, bool) and value > 0 else None


def _criterion(order: int, criterion: Criterion) -> dict[str, object]:
    return {
        "sortorder": order,
        "shortname": criterion.name.translate(_NO_TAGS)[:_LONGEST_NAME],
        "description": criterion.titles[0],
        "descriptionmarkers": "",
        "maxscore": criterion.max_points,
    }


def fillings(grades: Sequence[Grade], options: Options) -> Delivery:
    """Everybody's points in the guide, a call for each student.

    Raises CallError where the numbers of the assignment or of the criteria are not given,
    InputFileError where the criteria are not the rubric's.
    """
    if options.assignment_id is None or options.criteria is None:
        raise CallError(
            "place_needed",
            "Moodle's number of the assignment (--assignment-id) and of the criteria (--criteria: its answer"
            " to core_grading_get_definitions, or a CSV table criterion,id) are needed",
        )
    criteria, marked = platform_marks(grades, options, options.criteria)
    calls, missing = [], {}
    for grade, marks in marked:
        user = grade.person.platform_id
        if not user:
            missing[grade.student_id] = "the table of ids (--ids) has no id: Moodle's number of the user"
            continue
        filled = [_filled(number, mark) for number, mark in marks.items()]
        arguments = {
            "assignmentid": options.assignment_id,
            "userid": user,
            "plugindata": {"assignfeedbackcomments_editor": {"text": comment(grade)}},
            "advancedgradingdata": {"guide": {"criteria": filled}},
        }
        calls.append({"student_id": grade.student_id, "arguments": arguments})
    if missing and not calls:
        raise CallError(
            "ids_needed", "nobody's number in Moodle is known: give a table student_id,id (--ids)"
        )
    content = {"assignment": grades[0].assignment, "criteria": criteria, "calls": calls}
    document = json_document(MoodleMarksDocument, content, "the marking guide's points")
    note = "each call also replaces the student's feedback comment: without one Moodle stores half of it"
    return Delivery(document, unplaced=missing, notes=(note,))


def _filled(number: str, mark: Mark) -> dict[str, object]:
    """A remark is shown as HTML."""
    remark = escape(mark.remark, quote=False).replace("\n", "<br>")
    filling = {"criterionid": number, "score": mark.points, "remark": remark}
    return {"criterionid": number, "fillings": [filling]}
