"""Moodle's marking guide through web services."""

import json

import jsonschema
import pytest

from grader.cli.exporting import schema
from grader.lms.grades import Person
from reference.errors import CallError, InputFileError, PlanmarkError
from tests.unit.lms.classroom import marked, moodle, notes

AREA = {
    "cmid": 31,
    "contextid": 57,
    "component": "mod_assign",
    "areaname": "submissions",
    "activemethod": "guide",
    "definitions": [],
}
GUIDE = {
    "id": 3,
    "method": "guide",
    "name": "Pump",
    "status": 20,
    "guide": {
        "guide_criteria": [
            {"id": 11, "sortorder": 1, "shortname": "c1: Vector 1", "maxscore": 5},
            {"id": 12, "sortorder": 2, "shortname": "c2: Vector 2", "maxscore": 5.0},
        ],
        "guide_comments": [{"id": 1, "sortorder": 1, "description": "c1"}],
    },
}
PEOPLE = {"s01": Person(platform_id="101"), "s02": Person(platform_id="102")}


@pytest.fixture
def answer(tmp_path):
    path = tmp_path / "definitions.json"

    def write(*definitions, **area):
        document = {"areas": [{**AREA, "definitions": list(definitions), **area}], "warnings": []}
        path.write_text(json.dumps(document), encoding="utf-8")
        return path

    return write


def test_the_rubric_becomes_a_marking_guide_of_the_activity(tmp_path, answer):
    reports = marked("s01", 5.0, 2.5), marked("s02", 5.0, 0.0, status="needs_review")
    delivery, path = moodle(tmp_path, "rubric", *reports, criteria=answer(), item="Pump")
    document = json.loads(path.read_bytes())
    jsonschema.validate(document, schema("moodle-rubric"))
    assert document["wsfunction"] == "core_grading_save_definitions"
    (area,) = document["arguments"]["areas"]
    assert {key: area[key] for key in AREA if key != "definitions"} == {
        key: AREA[key] for key in AREA if key != "definitions"
    }
    (definition,) = area["definitions"]
    assert (definition["name"], definition["status"], definition["timecreated"]) == ("Pump", 20, 1795323600)
    criteria = definition["guide"]["guide_criteria"]
    assert [(one["sortorder"], one["shortname"], one["maxscore"]) for one in criteria] == [
        (1, "c1: Vector 1", 5.0),
        (2, "c2: Vector 2", 5.0),
    ]
    # Moodle walks through this list even where it is empty, and a form cannot tell an empty one.
    assert definition["guide"]["guide_comments"]
    assert delivery.is_complete


def test_names_have_nothing_that_moodle_takes_for_a_tag(tmp_path, answer):
    _, path = moodle(
        tmp_path, "rubric", marked("s01", 5.0, title="v <{}> " + 300 * "x"), criteria=answer(), item="<Pump>"
    )
    (definition,) = json.loads(path.read_bytes())["arguments"]["areas"][0]["definitions"]
    (one,) = definition["guide"]["guide_criteria"]
    assert one["shortname"].startswith("c1: v ‹1› ")
    assert len(one["shortname"]) == 255
    assert definition["name"] == "‹Pump›"


@pytest.fixture
def points(tmp_path):
    path = tmp_path / "instances.json"
    filled = [{"id": at, "guide": {"criteria": [{"id": 1}, {"id": 2}, {"id": 3}]}} for at in range(2)]
    filled.append({"id": 2})
    path.write_text(json.dumps({"instances": filled, "warnings": []}))
    return path


def test_an_activity_told_by_its_numbers_alone_may_have_a_guide(tmp_path, points):
    with pytest.raises(CallError, match=r"may have one .* another deletes it"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), cmid=1, context_id=2)
    delivery, path = moodle(
        tmp_path, "rubric", marked("s01", 5.0), cmid=1, context_id=2, replace_guide=points
    )
    assert json.loads(path.read_bytes())["arguments"]["areas"][0]["contextid"] == 2
    assert "6 fillings of 3 grades" in notes(delivery)[0]


def test_an_activity_that_nobody_tells_is_asked_for(tmp_path, answer):
    with pytest.raises(CallError, match="--cmid, --context-id"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), cmid=1)
    with pytest.raises(CallError, match="--cmid, --context-id"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=answer(contextid="57"))


def test_a_guide_is_never_written_over_another(tmp_path, answer):
    with pytest.raises(CallError, match="has a guide, or"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=answer(GUIDE))
    assert not (tmp_path / "out.json").exists()


def test_a_guide_is_replaced_only_with_a_count_of_the_points_that_go(tmp_path, answer, points):
    with_guide = answer(GUIDE)
    delivery, path = moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=with_guide, replace_guide=points)
    assert json.loads(path.read_bytes())["fillings_lost"] == 6
    assert "deletes the one there with 6 fillings of 3 grades" in notes(delivery)[0]
    with pytest.raises(InputFileError, match="core_grading_get_gradingform_instances"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=with_guide, replace_guide=with_guide)


def test_another_way_of_grading_is_never_put_aside(tmp_path, answer):
    with pytest.raises(CallError, match="graded by 'rubric'"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=answer(activemethod="rubric"))
    moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=answer(activemethod=None))


@pytest.mark.parametrize(
    "document", ["[]", "{}", '{"areas": []}', '{"areas": [1]}', '{"areas": [{}, {}]}', "x"]
)
def test_an_answer_that_is_not_moodles_is_refused(tmp_path, document):
    path = tmp_path / "definitions.json"
    path.write_text(document)
    with pytest.raises(InputFileError, match=r"definitions\.json"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=path)


def test_points_fill_every_criterion_of_the_guide(tmp_path, answer):
    delivery, path = moodle(
        tmp_path, "marks", marked("s01", 5.0, 2.5), marked("s02", 3.0, None), marked("s03", 1.0, 1.0),
        criteria=answer(GUIDE), people=PEOPLE, assignment_id=17,
    )  # fmt: skip
    document = json.loads(path.read_bytes())
    jsonschema.validate(document, schema("moodle-marks"))
    first, second = document["calls"]
    assert first["wsfunction"] == "mod_assign_save_grade"
    arguments = first["arguments"]
    assert (arguments["assignmentid"], arguments["userid"], arguments["grade"]) == (17, 101, -1)
    # Moodle reads this where a comment exists: feedback/comments/locallib.php, is_feedback_modified.
    assert arguments["plugindata"]["assignfeedbackcomments_editor"] == {
        "text": "<ul><li>~ <b>Vector 2</b>: Told &lt;why&gt; &amp; how.</li></ul>", "format": 1,
    }  # fmt: skip
    assert arguments["advancedgradingdata"]["guide"]["criteria"][1] == {
        "criterionid": 12,
        "fillings": [
            {"criterionid": 12, "score": 2.5, "remark": "~ Told &lt;why&gt; &amp; how.", "remarkformat": 1}
        ],
    }
    assert [
        one["fillings"][0]["score"] for one in second["arguments"]["advancedgradingdata"]["guide"]["criteria"]
    ] == [3.0, 3.0]
    assert list(delivery.unplaced) == ["s03"]
    assert delivery.written == ("s01", "s02")


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"assignment_id": None}, "--assignment-id"),
        ({"criteria": None}, "--criteria"),
        ({"people": {}}, "nobody's number in Moodle is known"),
    ],
)
def test_places_and_people_that_nobody_tells_are_asked_for(tmp_path, answer, how, message):
    known = {"criteria": answer(GUIDE), "people": PEOPLE, "assignment_id": 17, **how}
    with pytest.raises(CallError, match=message):
        moodle(tmp_path, "marks", marked("s01", 5.0, 2.5), **known)


@pytest.mark.parametrize(
    ("people", "message"),
    [
        ({"s01": Person(platform_id="x")}, "s01: 'x' is no number of a user of Moodle"),
        ({"s01": Person(platform_id="0")}, "s01: '0' is no number"),
        ({"s01": Person(platform_id="5"), "s02": Person(platform_id="05")}, "s02: '05' is no number"),
        ({"s01": Person(platform_id="5"), "s02": Person(platform_id="5")}, "user 5 appears twice"),
    ],
)
def test_numbers_that_are_none_are_refused_with_the_student(tmp_path, answer, people, message):
    with pytest.raises(PlanmarkError, match=message):
        moodle(
            tmp_path, "marks", marked("s01", 5.0, 2.5), marked("s02", 5.0, 2.5),
            criteria=answer(GUIDE), people=people, assignment_id=17,
        )  # fmt: skip
    assert not (tmp_path / "out.json").exists()


def test_a_criterion_that_has_no_number_of_moodle_is_refused(tmp_path):
    path = tmp_path / "criteria.csv"
    path.write_text("criterion,id\nc1,x\nc2,12\n")
    with pytest.raises(InputFileError, match="c1: 'x' is no number of a criterion in Moodle"):
        moodle(tmp_path, "marks", marked("s01", 5.0, 2.5), criteria=path, people=PEOPLE, assignment_id=17)
