"""Open edX: the rubric of an open response assessment in whole points, and staff assessments."""

import math
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote
from xml.etree import ElementTree as ET

from grader.lms.api.requests import Plan, place_of, students_submissions
from grader.lms.grades import Delivery, Grade, Options
from grader.lms.marks import CLOSE, class_criteria, json_text, plain_comment, ready_marks
from grader.lms.table import number
from grader.records import Reason

_FACTORS = (1, 2, 4, 5, 10, 20, 25, 50, 100)
"""Factors that make points whole; finer points than hundredths are rounded, and a note says so."""


def openedx(grades: Sequence[Grade], options: Options) -> Delivery:
    """The rubric as JSON and as OLX, and the staff assessments of the students whose submissions are known.

    Open response assessments take whole points: all are times one number.
    """
    criteria = class_criteria(grades, options)
    marked = {grade.student_id: marks for grade, marks in ready_marks(grades, options)}
    given = {each.id: {0.0, each.max_points} for each in criteria}
    for mark in (mark for marks in marked.values() for mark in marks):
        given[mark.criterion].add(mark.points)
    points = [one for each in given.values() for one in each]
    factor = next((one for one in _FACTORS if all(_is_whole(point * one) for point in points)), _FACTORS[-1])
    rubric_body = {
        "criteria": [
            {
                "order_num": at,
                "name": each.id,
                "label": each.titles[0],
                "prompt": each.titles[0],
                "feedback": "optional",
                "options": [
                    {"order_num": place, "name": number(whole / factor), "label": number(whole / factor),
                     "explanation": "", "points": whole}
                    for place, whole in enumerate(sorted({round(one * factor) for one in given[each.id]}))
                ],
            }
            for at, each in enumerate(criteria)
        ],
        "feedback_prompt": "",
        "feedback_default_text": "",
    }  # fmt: skip
    plan = Plan(
        "Open edX",
        "https://courses.example.org",
        [
            "openedx/edx-ora2: openassessment/xblock/schema.py (EDITOR_UPDATE_SCHEMA)",
            "openedx/edx-ora2: openassessment/xblock/xml.py (serialize_rubric)",
            "openedx/edx-platform: lms/djangoapps/ora_staff_grader (urls.py, StaffAssessSerializer)",
        ],
    )
    plan.files["rubric.json"] = json_text(rubric_body).encode()
    plan.files["rubric.xml"] = _olx(rubric_body)
    known, missing = students_submissions(grades, options, "/api/ora_staff_grader/initialize?oraLocation=...")
    (block,) = place_of(options, "assignment_id") if known else ("",)
    by_id = {grade.student_id: grade for grade in grades}
    for student, submission in known.items():
        where = f"oraLocation={block}&submissionUUID={quote(submission.id, safe='')}"
        body = {
            "overallFeedback": plain_comment(by_id[student]),
            "criteria": [
                {
                    "name": mark.criterion,
                    "feedback": mark.remark,
                    "selectedOption": number(round(mark.points * factor) / factor),
                }
                for mark in marked[student]
            ],
        }
        base = "/api/ora_staff_grader/submission"
        plan.add(f"POST {base}/lock?{where}", {}, "lock", student)
        plan.add(f"POST {base}/grade?{where}", body, "grade", student)
    total = math.fsum(each.max_points for each in criteria)
    whole = {"times": factor, "total_points": total, "become_points": factor * total}
    notes = [Reason("whole_points", whole), Reason("options_of_class")]
    rough = tuple(
        student
        for student, marks in marked.items()
        if not all(_is_whole(mark.points * factor) for mark in marks)
    )
    if rough:
        notes.insert(1, Reason("rounded", {"students": rough}))
    return plan.delivery(grades, unplaced=missing, notes=tuple(notes))


def _is_whole(value: float) -> bool:
    return math.isclose(value, round(value), abs_tol=CLOSE)


def _olx(rubric_body: Mapping[str, Any]) -> bytes:
    """The rubric as it stands in an exported course, to be put into its `openassessment`."""
    root = ET.Element("rubric")
    for criterion in rubric_body["criteria"]:
        element = ET.SubElement(root, "criterion", feedback="optional")
        for name in ("name", "label", "prompt"):
            ET.SubElement(element, name).text = criterion[name]
        for option in criterion["options"]:
            inner = ET.SubElement(element, "option", points=str(option["points"]))
            for name in ("name", "label", "explanation"):
                ET.SubElement(inner, name).text = option[name]
    ET.indent(root)
    return ET.tostring(root, encoding="unicode").encode() + b"\n"
