"""Moodle's marking guide through web services, and the archive of feedback files."""

import json
import zipfile
from datetime import UTC, datetime

import jsonschema
import pytest

from grader.cli.schemas import schema
from grader.lms.export import export
from grader.lms.grades import Options, Person
from reference.errors import CallError, InputFileError
from tests.unit.lms import importers
from tests.unit.lms.classroom import marked, report, results

NOW = datetime(2026, 11, 22, 5, 0, tzinfo=UTC)
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
        told = {"areas": [{**AREA, "definitions": list(definitions), **area}], "warnings": []}
        path.write_text(json.dumps(told), encoding="utf-8")
        return path

    return write


def moodle(tmp_path, what, *reports, name="out.json", **how):
    path = tmp_path / name
    delivery = export(results(*reports), path, Options(to="moodle", what=what, now=NOW, **how))
    return delivery, path


# Marking guide ------------------------------------------------------------------------------------


def test_the_rubric_becomes_a_marking_guide_of_the_activity(tmp_path, answer):
    reports = marked("s01", 5.0, 2.5), marked("s02", 5.0, 0.0, status="needs_review")
    delivery, path = moodle(tmp_path, "rubric", *reports, criteria=answer(), item="Pump")
    told = json.loads(path.read_bytes())
    jsonschema.validate(told, schema("moodle-rubric"))
    assert told["wsfunction"] == "core_grading_save_definitions"
    (area,) = told["arguments"]["areas"]
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


def test_the_activity_may_be_told_by_its_numbers(tmp_path):
    _, path = moodle(tmp_path, "rubric", marked("s01", 5.0), cmid=1, context_id=2)
    assert json.loads(path.read_bytes())["arguments"]["areas"][0]["contextid"] == 2


def test_an_activity_that_nobody_tells_is_asked_for(tmp_path, answer):
    with pytest.raises(CallError, match="--cmid and --context-id"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), cmid=1)
    with pytest.raises(CallError, match="--cmid and --context-id"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=answer(contextid="57"))


def test_a_guide_is_never_written_over_another(tmp_path, answer):
    with pytest.raises(CallError, match="has a marking guide already"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=answer(GUIDE))
    assert not (tmp_path / "out.json").exists()


def test_another_way_of_grading_is_never_put_aside(tmp_path, answer):
    with pytest.raises(CallError, match="graded by 'rubric'"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=answer(activemethod="rubric"))
    moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=answer(activemethod=None))


@pytest.mark.parametrize("told", ["[]", "{}", '{"areas": []}', '{"areas": [1]}', '{"areas": [{}, {}]}', "x"])
def test_an_answer_that_is_not_moodles_is_refused(tmp_path, told):
    path = tmp_path / "definitions.json"
    path.write_text(told)
    with pytest.raises(InputFileError, match=r"definitions\.json"):
        moodle(tmp_path, "rubric", marked("s01", 5.0), criteria=path)


def test_points_fill_every_criterion_of_the_guide(tmp_path, answer):
    delivery, path = moodle(
        tmp_path, "marks", marked("s01", 5.0, 2.5), marked("s02", 3.0, None), marked("s03", 1.0, 1.0),
        criteria=answer(GUIDE), people=PEOPLE, assignment_id=17,
    )  # fmt: skip
    told = json.loads(path.read_bytes())
    jsonschema.validate(told, schema("moodle-marks"))
    first, second = told["calls"]
    assert first["wsfunction"] == "mod_assign_save_grade"
    arguments = first["arguments"]
    assert (arguments["assignmentid"], arguments["userid"], arguments["grade"]) == (17, 101, -1)
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
    ("how", "told"),
    [
        ({"assignment_id": None}, "--assignment-id"),
        ({"criteria": None}, "--criteria"),
        ({"people": {}}, "nobody's number in Moodle is known"),
    ],
)
def test_places_and_people_that_nobody_tells_are_asked_for(tmp_path, answer, how, told):
    known = {"criteria": answer(GUIDE), "people": PEOPLE, "assignment_id": 17, **how}
    with pytest.raises(CallError, match=told):
        moodle(tmp_path, "marks", marked("s01", 5.0, 2.5), **known)


@pytest.mark.parametrize(
    ("people", "told"),
    [
        ({"s01": Person(platform_id="x")}, r"calls\[0\]\.arguments\.userid"),
        ({"s01": Person(platform_id="0")}, r"calls\[0\]\.arguments\.userid"),
        ({"s01": Person(platform_id="5"), "s02": Person(platform_id="05")}, "user 5 stands twice"),
    ],
)
def test_numbers_that_are_none_are_refused_with_the_place(tmp_path, answer, people, told):
    with pytest.raises(InputFileError, match=told):
        moodle(
            tmp_path, "marks", marked("s01", 5.0, 2.5), marked("s02", 5.0, 2.5),
            criteria=answer(GUIDE), people=people, assignment_id=17,
        )  # fmt: skip
    assert not (tmp_path / "out.json").exists()


def test_points_above_a_criterions_maximum_are_refused(tmp_path, answer):
    wrong = marked("s01", 5.0, 2.5)
    wrong = wrong.model_copy(
        update={
            "score": 9.5,
            "criteria": [wrong.criteria[0].model_copy(update={"points": 7.0}), wrong.criteria[1]],
        }
    )
    with pytest.raises(InputFileError, match="criterion 11: 7 is above its maximum 5"):
        moodle(tmp_path, "marks", wrong, criteria=answer(GUIDE), people=PEOPLE, assignment_id=17)


# Feedback files -----------------------------------------------------------------------------------

WORKSHEET = (
    "Identifier,Full name,Email address,Grade,Maximum grade,Grade can be changed,Last modified (grade)\r\n"
    "Participant 101,A,a@x.ro,,10.00,Yes,-\r\n"
    "Participant 102,B,b@x.ro,,10.00,No,-\r\n"
    "Participant 103,C,c@x.ro,,10.00,Yes,-\r\n"
)
BY_MAIL = {
    "s01": Person(email="a@x.ro"),
    "s02": Person(email="b@x.ro"),
    "s_3": Person(email="c@x.ro"),
    "s09": Person(email="none@x.ro"),
}


def pages(out, report, text="page", where=None, printable=None):
    folder = out / (where or report.student_id)
    folder.mkdir(parents=True)
    (folder / "report.json").write_text(report.model_dump_json(), encoding="utf-8")
    (folder / "feedback.html").write_text(text, encoding="utf-8")
    if printable is not None:
        (folder / "feedback.pdf").write_bytes(printable)


def archive(tmp_path, *reports, worksheet=WORKSHEET, name="out.zip", **how):
    form = tmp_path / "w.csv"
    form.write_text(worksheet, encoding="utf-8", newline="")
    return moodle(
        tmp_path, "feedback", *reports, name=name, out=tmp_path / "marks", form=form, people=BY_MAIL, **how
    )


def test_moodle_finds_everybodys_pages_in_the_archive(tmp_path):
    first, locked, third = marked("s01", 5.0), marked("s02", 5.0), marked("s_3", 2.5)
    for one, printable in ((first, b"%PDF"), (locked, None), (third, None)):
        pages(tmp_path / "marks", one, f"page of {one.student_id}", printable=printable)
    waiting = report("s04", None, status="needs_review")
    delivery, path = archive(tmp_path, first, locked, third, waiting, marked("s09", 5.0))
    assert importers.moodle_feedback(path.read_bytes(), {101, 102, 103}) == {
        101: {"feedback.html": b"page of s01", "feedback.pdf": b"%PDF"},
        103: {"feedback.html": b"page of s_3"},
    }
    assert delivery.written == ("s01", "s_3")
    assert delivery.withheld == {"s04": "needs review"}
    assert "cannot be changed" in delivery.unplaced["s02"]
    assert set(delivery.unplaced) == {"s02", "s09"}
    with zipfile.ZipFile(path) as opened:
        assert all("_" not in name.partition("/")[2] for name in opened.namelist())


def test_the_same_pages_make_the_same_archive(tmp_path):
    one = marked("s01", 5.0)
    pages(tmp_path / "marks", one)
    _, path = archive(tmp_path, one)
    first = path.read_bytes()
    archive(tmp_path, one)
    assert path.read_bytes() == first


def test_numbers_may_come_from_the_table_of_ids(tmp_path):
    one = marked("s01", 5.0)
    pages(tmp_path / "marks", one)
    people = {"s01": Person(participant=7)}
    _, path = moodle(
        tmp_path, "feedback", one, marked("s02", 5.0), name="o.zip", out=tmp_path / "marks", people=people
    )
    assert list(importers.moodle_feedback(path.read_bytes(), {7})) == [7]
    with pytest.raises(CallError, match="--worksheet"):
        moodle(tmp_path, "feedback", one, name="o.zip", out=tmp_path / "marks")


def test_pages_of_several_positions_stand_side_by_side(tmp_path):
    both = marked("s01", 5.0, position=1), marked("s01", 2.5, position=2)
    for one in both:
        pages(tmp_path / "marks", one, where=f"s01/{one.position}")
    _, path = archive(tmp_path, *both, combine="sum")
    assert set(importers.moodle_feedback(path.read_bytes(), {101})[101]) == {
        "position-1-feedback.html",
        "position-2-feedback.html",
    }
    _, path = archive(tmp_path, *both, position=2)
    assert set(importers.moodle_feedback(path.read_bytes(), {101})[101]) == {"feedback.html"}


@pytest.mark.parametrize("broken", ["feedback.html", "report.json", None])
def test_pages_that_are_missing_or_of_another_run_are_refused(tmp_path, broken):
    one = marked("s01", 5.0)
    pages(tmp_path / "marks", one if broken else marked("s01", 2.5))
    if broken:
        (tmp_path / "marks" / "s01" / broken).unlink()
    with pytest.raises(InputFileError, match=r"grade again, nothing was written\n  s01: "):
        archive(tmp_path, one)
    assert not (tmp_path / "out.zip").exists()


def test_moodle_takes_no_folder(tmp_path):
    one = marked("s01", 5.0)
    pages(tmp_path / "marks", one)
    with pytest.raises(CallError, match=r"end with \.zip"):
        archive(tmp_path, one, name="folder")
    assert not (tmp_path / "folder").exists()


def test_a_class_that_moodle_does_not_know_has_no_archive(tmp_path):
    one = marked("s77", 5.0)
    pages(tmp_path / "marks", one)
    with pytest.raises(CallError, match="no student has a number in Moodle"):
        archive(tmp_path, one)


# Grades -------------------------------------------------------------------------------------------


def test_moodle_stores_the_worksheets_grades_as_they_are_meant(tmp_path):
    header = WORKSHEET.replace("(grade)\r\n", "(grade),Feedback comments\r\n").replace(",-\r\n", ",-,\r\n")
    form = tmp_path / "w.csv"
    form.write_text(header, encoding="utf-8", newline="")
    reports = (
        marked("s01", 5.0, 2.5),
        marked("s02", 5.0, 5.0),
        marked("s_3", None, 2.5, status="needs_review"),
    )
    delivery, path = moodle(tmp_path, "grades", *reports, name="o.csv", form=form, people=BY_MAIL)
    stored = importers.moodle_worksheet(path.read_bytes(), 10.0)
    assert stored == {101: (7.5, "<ul><li>~ <b>Vector 2</b>: Told &lt;why&gt; &amp; how.</li></ul>")}
    assert set(delivery.unplaced) == {"s02"}
    assert set(delivery.withheld) == {"s_3"}


def test_a_new_item_of_moodles_gradebook_has_no_zero_for_who_is_withheld(tmp_path):
    reports = marked("s01", 5.0, 2.5), marked("s02", None, 2.5, status="needs_review")
    _, path = moodle(tmp_path, "grades", *reports, name="o.csv")
    assert importers.moodle_gradebook(path.read_text(encoding="utf-8"), {"s01", "s02"}) == {"s01": 7.5}
