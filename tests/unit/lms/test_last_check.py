"""The last look before a file is written: what was rendered is read back, and a difference stops it."""

import zipfile

import pytest
from pydantic import ValidationError

from grader.files import OutputError
from grader.lms import table
from grader.lms.canvas import CanvasMarksDocument
from grader.lms.export import export
from grader.lms.grades import Options, Person
from grader.lms.marks import PlatformCriterion
from grader.lms.moodle_guide import MoodleFilled, MoodleGuide
from grader.lms.scores import GradescopeTest, LtiDocument
from grader.lms.table import RawTable
from reference.errors import CallError
from tests.unit.lms.classroom import marked, report, results

ONE = results(marked("s01", 5.0, 2.5))
WORKSHEET = "Identifier,Grade,Last modified (grade)\nParticipant 1,,-\n"
GRADEBOOK = (
    "LastName,FirstName,ID,SIS User ID,SIS Login ID,Section,Pump (1)\n"
    "    Points Possible,,,,,,10\nPopescu,Ion,1,s01,,1,\n"
)


def refused(tmp_path, options, name="out.csv"):
    before = set(tmp_path.iterdir())
    with pytest.raises(OutputError, match="does not read back as it was meant"):
        export(ONE, tmp_path / name, options)
    assert set(tmp_path.iterdir()) == before


def form(tmp_path, text):
    path = tmp_path / "form.csv"
    path.write_text(text)
    return path


def test_a_table_that_reads_otherwise_is_not_written(tmp_path, monkeypatch):
    monkeypatch.setattr(table.csv, "reader", lambda *_, **__: [["something else"]])
    refused(tmp_path, Options(to="csv"))


def test_a_filled_in_file_that_reads_otherwise_is_not_written(tmp_path, monkeypatch):
    whole = RawTable.text
    monkeypatch.setattr(RawTable, "text", lambda self: whole(self).replace("7.5", "75"))
    people = {"s01": Person(participant=1)}
    refused(tmp_path, Options(to="moodle", form=form(tmp_path, WORKSHEET), people=people))
    refused(tmp_path, Options(to="canvas", form=form(tmp_path, GRADEBOOK)))


def test_a_document_that_reads_otherwise_is_not_written(tmp_path, monkeypatch):
    text = '{"assignment": "press", "scores": []}'
    monkeypatch.setattr(LtiDocument, "model_dump_json", lambda *_, **__: text)
    refused(tmp_path, Options(to="lti"))


@pytest.mark.parametrize("broken", ["read", "namelist"])
def test_an_archive_that_reads_otherwise_is_not_written(tmp_path, monkeypatch, broken):
    monkeypatch.setattr(zipfile.ZipFile, broken, lambda *_: [])
    refused(tmp_path, Options(to="gradescope"), "out.zip")


def test_a_gradebook_with_names_apart_is_filled_in(tmp_path):
    path = form(tmp_path, GRADEBOOK)
    for people in ({}, {"x1": Person(name="Ion Popescu")}, {"x1": Person(name="Popescu, Ion")}):
        student = next(iter(people), "s01")
        export(
            results(report(student, 7.5)), tmp_path / "o.csv", Options(to="canvas", form=path, people=people)
        )
        assert (tmp_path / "o.csv").read_text() == GRADEBOOK.replace("s01,,1,", "s01,,1,7.5")


def test_maxima_that_differ_have_no_one_row_of_points(tmp_path):
    two = results(report("s01", 5.0), report("s02", 5.0, max_score=20.0))
    for to in ("canvas", "moodle", "lti", "gradescope"):
        with pytest.raises(CallError, match=r"(?s)maxima differ.*10: s01\n  20: s02"):
            export(two, tmp_path / "o.csv", Options(to=to))
    with pytest.raises(CallError, match="maxima differ"):
        export(two, tmp_path / "o.csv", Options(to="moodle", rescale=True))
    with pytest.raises(CallError, match="--rescale"):
        export(two, tmp_path / "o.csv", Options(to="canvas", maximum=10.0))
    export(two, tmp_path / "o.csv", Options(to="canvas", maximum=10.0, rescale=True))
    assert (tmp_path / "o.csv").read_text().splitlines()[3].endswith(",2.5")


def test_two_students_of_one_number_have_no_place_in_canvas(tmp_path):
    people = {"s01": Person(platform_id="1"), "s02": Person(platform_id="1")}
    criteria = form(tmp_path, "criterion,id\nc1,_1\n")
    with pytest.raises(CallError, match="same number in Canvas"):
        export(
            results(marked("s01", 5.0), marked("s02", 5.0)),
            tmp_path / "o.json",
            Options(to="canvas", what="marks", criteria=criteria, people=people),
        )


CRITERION = {"criterion": "c1", "id": "_1", "max_points": 5.0}
CALL = {
    "student_id": "s01",
    "path": "/p",
    "body": {
        "submission": {"posted_grade": "5"},
        "comment": {"text_comment": "x"},
        "rubric_assessment": {"_1": {"points": 5.0, "comments": ""}},
    },
}
BULK = {"posted_grade": "5", "text_comment": "x", "rubric_assessment": {}}
TEST = {
    "name": "x", "number": "1", "score": 6.0, "max_score": 5.0, "status": "passed", "output": "",
    "visibility": "visible", "extra_data": {"criterion": "c1", "verdict": "full"},
}  # fmt: skip
FILLING = {"criterionid": 2, "score": 1, "remark": ""}
GUIDED = {"shortname": "a", "description": "", "descriptionmarkers": "", "maxscore": 1}


@pytest.mark.parametrize(
    ("model", "told", "why"),
    [
        (GradescopeTest, TEST, "6 of 5 points"),
        (MoodleFilled, {"criterionid": 1, "fillings": [FILLING]}, "as 2"),
        (
            MoodleGuide,
            {
                "guide_criteria": [{**GUIDED, "sortorder": 1}, {**GUIDED, "sortorder": 2}],
                "guide_comments": [{"sortorder": 1, "description": "x"}],
            },
            "criterion a stands twice",
        ),
        (
            CanvasMarksDocument,
            {
                "assignment": "pump", "criteria": [CRITERION], "calls": [CALL],
                "bulk": {"path": "/b", "body": {"grade_data": {}}},
            },
            "different students",
        ),
        (
            CanvasMarksDocument,
            {
                "assignment": "pump", "criteria": [{**CRITERION, "id": "_2"}], "calls": [CALL],
                "bulk": {"path": "/b", "body": {"grade_data": {"1": BULK}}},
            },
            r"criteria \['_1'\] are filled, \['_2'\] are there",
        ),
        (
            CanvasMarksDocument,
            {
                "assignment": "pump", "criteria": [CRITERION],
                "calls": [{**CALL, "body": {**CALL["body"], "submission": {"posted_grade": "4"}}}],
                "bulk": {"path": "/b", "body": {"grade_data": {"1": BULK}}},
            },
            "s01: the criteria give 5 together",
        ),
        (PlatformCriterion, {**CRITERION, "more": 1}, "more"),
    ],
)  # fmt: skip
def test_documents_that_a_platform_would_misread_are_none(model, told, why):
    with pytest.raises(ValidationError, match=why):
        model.model_validate(told)
