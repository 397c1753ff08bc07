"""Plans of requests: bodies as the platforms' documentation has them, ids, levels, whole points."""

import json
import zipfile
from xml.etree import ElementTree as ET

import jsonschema
import pytest

from grader.cli.exporting import schema
from grader.lms.export import export
from grader.lms.grades import Options, Person
from reference.errors import CallError, InputFileError
from tests.unit.lms.classroom import left_out, marked, notes, report, results
from tests.unit.lms.importers import canvas_rating

PLACE = {"course_id": "12", "assignment_id": "345"}
CLASS = (
    marked("s01", 5.0, 2.5),
    marked("s02", 0.0, None),
    marked("s03", 5.0, 5.0, status="needs_review"),
    report("s04", None, status="missing"),
)
SCHEMAS = {
    "canvas-api": {"rubric": "canvas-rubric", "student-grade": "canvas-assessment"},
    "openedx": {"student-grade": "openedx-assessment"},
    "google-classroom": {"rubric": "google-rubric", "student-grade": "google-grade"},
    "ms-education": {
        "rubric": "ms-rubric",
        **{f"student-{kind}": f"ms-{kind}-outcome" for kind in ("rubric", "points", "feedback")},
    },
}
"""The schema of each body, by the end of its file's name."""


def planned(tmp_path, to, *reports, **how):
    """Export to a platform's API; the delivery, the plan, and every file by its name."""
    for name in ("criteria", "submissions"):
        if name in how:
            path = tmp_path / f"{name}.json"
            path.write_text(json.dumps(how[name]), encoding="utf-8")
            how[name] = path
    out = tmp_path / "out.zip"
    delivery = export(results(*(reports or CLASS)), out, Options(to=to, **how))
    with zipfile.ZipFile(out) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    plan = json.loads(files["plan.json"])
    jsonschema.validate(plan, schema("api-plan"))
    for call in plan["calls"]:
        what = call["body"].removesuffix(".json").rpartition("-")[2]
        kind = SCHEMAS[to].get(f"student-{what}" if "student_id" in call else what)
        if kind is not None:
            jsonschema.validate(json.loads(files[call["body"]]), schema(kind))
    assert all(call["body"] in files for call in plan["calls"])
    return delivery, plan["calls"], {name: json.loads(data) for name, data in files.items() if "json" in name}


# Canvas -------------------------------------------------------------------------------------------


def canvas_rubric(body):
    """Criteria as Canvas stores them (app/models/rubric.rb, generate_criteria)."""
    stored = []
    for index, data in body["rubric"]["criteria"].items():
        ratings = sorted(data["ratings"].values(), key=lambda one: -float(one["points"]))
        best = max(rating["points"] for rating in ratings)
        stored.append((int(index), data["id"].strip(), data["description"].strip(), best))
    return [entry[1:] for entry in sorted(stored)]


def test_canvas_has_the_rubric_with_its_assignment_then_every_students_points(tmp_path):
    delivery, calls, files = planned(tmp_path, "canvas-api", **PLACE, item="Pump")
    assert [(call["method"], call["path"]) for call in calls] == [
        ("POST", "/api/v1/courses/12/rubrics"),
        ("PUT", "/api/v1/courses/12/assignments/345/submissions/sis_user_id:s01"),
        ("PUT", "/api/v1/courses/12/assignments/345/submissions/sis_user_id:s02"),
    ]
    rubric = files["001-rubric.json"]
    assert canvas_rubric(rubric) == [("c1", "c1: Vector 1", 5.0), ("c2", "c2: Vector 2", 5.0)]
    ratings = rubric["rubric"]["criteria"]["1"]["ratings"].values()
    named = [(one["description"], one["points"]) for one in ratings]
    assert [canvas_rating(named, points) for points in (5.0, 2.5, 0.0)] == [
        "Full marks", "Partial marks", "No marks",
    ]  # fmt: skip
    assert rubric["rubric_association"] == {
        "association_id": 345, "association_type": "Assignment", "use_for_grading": True,
        "purpose": "grading",
    }  # fmt: skip
    assert rubric["rubric"]["title"] == "Pump"
    first = files["002-s01-grade.json"]
    assert {name: one["points"] for name, one in first["rubric_assessment"].items()} == {"c1": 5.0, "c2": 2.5}
    assert first["submission"]["posted_grade"] == "7.5"
    assert (delivery.written, set(delivery.withheld)) == (("s01", "s02"), {"s03", "s04"})


def test_the_ids_that_canvas_gave_are_used_and_the_rubric_is_not_made_twice(tmp_path):
    answer = {
        "rubric": {
            "id": 9, "title": "Pump",
            "data": [
                {"id": "9_77", "description": "c1: Vector 1", "points": 5.0, "ratings": []},
                {"id": "9_12", "description": "c2: Vector 2", "points": 5.0, "ratings": []},
            ],
        },
        "rubric_association": {"id": 4},
    }  # fmt: skip
    _, calls, files = planned(tmp_path, "canvas-api", **PLACE, criteria=answer)
    assert [call["method"] for call in calls] == ["PUT", "PUT"]
    assert set(files["001-s01-grade.json"]["rubric_assessment"]) == {"9_77", "9_12"}


@pytest.mark.parametrize("to", ["canvas-api", "google-classroom", "ms-education"])
def test_the_place_of_a_rubric_must_be_told(tmp_path, to):
    with pytest.raises(CallError, match="needs --course-id, --assignment-id"):
        planned(tmp_path, to)


def test_two_students_with_one_user_are_refused(tmp_path):
    people = {"s01": Person(platform_id="sis_user_id:s02")}
    with pytest.raises(InputFileError, match="submissions/sis_user_id:s02 appears twice"):
        planned(tmp_path, "canvas-api", **PLACE, people=people)


def test_a_student_may_be_called_as_a_file_is(tmp_path):
    _, calls, _ = planned(tmp_path, "canvas-api", marked("rubric", 5.0), marked("a--b", 5.0), **PLACE)
    assert [call.get("student_id") for call in calls] == [None, "rubric", "a--b"]


# Open edX -----------------------------------------------------------------------------------------

ORA = {
    "submissions": {
        "u-1": {"submissionUUID": "u-1", "username": "ion", "teamName": None},
        "u-2": {"submissionUUID": "u-2", "username": "s02", "teamName": None},
    }
}


def test_open_edx_has_whole_points_and_options_that_are_in_its_rubric(tmp_path):
    block = "block-v1:U+TMM+1+type@openassessment+block@ab"
    people = {"s01": Person(username="ion")}
    delivery, calls, files = planned(tmp_path, "openedx", submissions=ORA, assignment_id=block, people=people)
    jsonschema.validate(files["rubric.json"], schema("openedx-rubric"))
    options = {
        criterion["name"]: {option["name"]: option["points"] for option in criterion["options"]}
        for criterion in files["rubric.json"]["criteria"]
    }
    assert options == {"c1": {"0": 0, "5": 10}, "c2": {"0": 0, "2.5": 5, "5": 10}}
    where = "oraLocation=block-v1%3AU%2BTMM%2B1%2Btype%40openassessment%2Bblock%40ab&submissionUUID=u-1"
    assert [call["path"] for call in calls[:2]] == [
        f"/api/ora_staff_grader/submission/lock?{where}", f"/api/ora_staff_grader/submission/grade?{where}",
    ]  # fmt: skip
    assert [call["student_id"] for call in calls] == ["s01", "s01", "s02", "s02"]
    grade = files["002-s01-grade.json"]
    assert [(one["name"], one["selectedOption"]) for one in grade["criteria"]] == [("c1", "5"), ("c2", "2.5")]
    assert all(one["selectedOption"] in options[one["name"]] for one in grade["criteria"])
    assert "all are multiplied by 2, 10 become 20" in notes(delivery)[0]


def test_points_finer_than_hundredths_are_rounded_and_told(tmp_path):
    delivery, _, files = planned(tmp_path, "openedx", marked("s01", 5.0, 1.0 / 3.0))
    assert files["rubric.json"]["criteria"][1]["options"][1] == {
        "order_num": 1, "name": "0.33", "label": "0.33", "explanation": "", "points": 33,
    }  # fmt: skip
    assert any("rounded to hundredths: the points of s01" in note for note in notes(delivery))


def test_the_rubric_is_there_in_the_courses_own_form_too(tmp_path):
    planned(tmp_path, "openedx")
    with zipfile.ZipFile(tmp_path / "out.zip") as archive:
        root = ET.fromstring(archive.read("rubric.xml"))
    assert [one.findtext("name") for one in root.iter("criterion")] == ["c1", "c2"]
    assert [one.get("points") for one in root[1].iter("option")] == ["0", "5", "10"]


# Google Classroom ---------------------------------------------------------------------------------

TURNED_IN = {"studentSubmissions": [{"id": "Cg1", "userId": "u1"}, {"id": "Cg2", "userId": "s02"}]}


def test_classroom_has_the_rubric_and_grades_of_two_decimals(tmp_path):
    third = marked("s01", 5.0, 1.0 / 3.0)
    people = {"s01": Person(platform_id="u1")}
    delivery, calls, files = planned(
        tmp_path, "google-classroom", third, CLASS[1], **PLACE, submissions=TURNED_IN, people=people
    )
    assert files["001-rubric.json"]["criteria"][0]["levels"] == [
        {"title": "5 / 5", "points": 5.0},
        {"title": "2.5 / 5", "points": 2.5},
        {"title": "0 / 5", "points": 0.0},
    ]
    assert calls[0]["path"] == "/v1/courses/12/courseWork/345/rubrics"
    assert calls[1]["method"] == "PATCH"
    assert calls[1]["path"] == (
        "/v1/courses/12/courseWork/345/studentSubmissions/Cg1?updateMask=draftGrade,assignedGrade"
    )
    assert files["002-s01-grade.json"] == {"draftGrade": 5.33, "assignedGrade": 5.33}
    assert delivery.written == ("s01", "s02")


def test_a_rubric_of_more_criteria_than_classroom_takes_is_refused(tmp_path):
    with pytest.raises(CallError, match="takes 50 criteria, not 51"):
        planned(tmp_path, "google-classroom", marked("s01", *[5.0] * 51), **PLACE)


def test_a_classrooms_rubric_that_is_there_is_not_made_again(tmp_path):
    levels = [{"id": "l1", "points": 5.0, "title": "5"}, {"id": "l2", "points": 0.0, "title": "0"}]
    answer = {
        "courseId": "12", "id": "r",
        "criteria": [
            {"id": "x", "title": "c1: Vector 1", "description": "Vector 1", "levels": levels},
            {"id": "y", "title": "c2: Vector 2", "levels": levels},
        ],
    }  # fmt: skip
    delivery, calls, _ = planned(
        tmp_path,
        "google-classroom",
        **PLACE,
        criteria=answer,
        submissions=TURNED_IN,
        maximum=100,
        rescale=True,
    )
    assert [call["body"] for call in calls] == ["001-s02-grade.json"]
    assert "nobody in the platform's file has" in left_out(delivery)["s01"]


# Microsoft ----------------------------------------------------------------------------------------


def graph_answer(body):
    """The rubric as Graph answers it: with ids."""
    qualities = [{"qualityId": f"q{at}", **one} for at, one in enumerate(body["qualities"], 1)]
    levels = [{"levelId": f"l{at}", **one} for at, one in enumerate(body["levels"], 1)]
    return {**body, "id": "r-1", "qualities": qualities, "levels": levels}


OUTCOMES = [
    {"@odata.type": f"#microsoft.graph.education{kind}Outcome", "id": f"o-{kind}"}
    for kind in ("Feedback", "Points", "Rubric")
]
VALUE = {
    "value": [
        {"id": "sub1", "recipient": {"userId": "u1"}, "outcomes": OUTCOMES},
        {"id": "sub2", "recipient": {"userId": "s02"}, "outcomes": OUTCOMES[:2]},
    ]
}


def test_graph_takes_the_rubric_then_its_place_then_the_outcomes(tmp_path):
    delivery, calls, files = planned(tmp_path, "ms-education", **PLACE)
    rubric = files["001-rubric.json"]
    attach = "/v1.0/education/classes/12/assignments/345/rubric/$ref"
    assert [call["path"] for call in calls] == ["/v1.0/education/me/rubrics", attach]
    assert [one["weight"] for one in rubric["qualities"]] == [50.0, 50.0]
    assert rubric["levels"][0]["grading"] == {
        "@odata.type": "#microsoft.graph.educationAssignmentPointsGradeType", "maxPoints": 100.0,
    }  # fmt: skip
    assert "--criteria" in left_out(delivery)["s01"]

    answer = graph_answer(rubric)
    _, calls, files = planned(tmp_path, "ms-education", **PLACE, criteria=answer)
    assert [(call["method"], call["path"]) for call in calls] == [("PUT", attach)]
    assert files["001-attach.json"] == {
        "@odata.id": "https://graph.microsoft.com/v1.0/education/me/rubrics/r-1"
    }

    people = {"s01": Person(platform_id="u1")}
    delivery, calls, files = planned(
        tmp_path, "ms-education", **PLACE, criteria=answer, submissions=VALUE, people=people
    )
    base = "/v1.0/education/classes/12/assignments/345/submissions/sub1/outcomes"
    assert [call["path"] for call in calls] == [f"{base}/o-Rubric", f"{base}/o-Points", f"{base}/o-Feedback"]
    levels = files["001-s01-rubric.json"]["rubricQualitySelectedLevels"]
    assert levels == [{"qualityId": "q1", "columnId": "l1"}, {"qualityId": "q2", "columnId": "l3"}]
    assert files["002-s01-points.json"]["points"]["points"] == 7.5
    assert files["001-s01-rubric.json"]["rubricQualityFeedback"][1]["feedback"]["content"].startswith(
        "2.5 / 5. "
    )
    assert "no outcomes of all kinds" in left_out(delivery)["s02"]
    # Nearly all points are not rated as all, nor a few as none.
    near = marked("s01", 4.9, 0.1)
    _, _, files = planned(
        tmp_path, "ms-education", near, **PLACE, criteria=answer, submissions=VALUE, people=people
    )
    levels = files["001-s01-rubric.json"]["rubricQualitySelectedLevels"]
    assert [level["columnId"] for level in levels] == ["l2", "l4"]


def test_a_rubric_without_its_id_is_refused(tmp_path):
    answer = {"qualities": [
        {"qualityId": f"q{at}", "description": {"content": f"c{at}: Vector {at}"}} for at in (1, 2)
    ]}  # fmt: skip
    with pytest.raises(CallError, match="is no educationRubric with its id and levels"):
        planned(tmp_path, "ms-education", **PLACE, criteria=answer)
