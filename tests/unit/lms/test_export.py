"""The door of all exports: what is refused, names of files, and the last check before one is written."""

import csv
import io
import zipfile

import pytest

from grader.documents import AlikeDocument
from grader.files import OutputError
from grader.lms import table
from grader.lms.export import KINDS, export, usual_name
from grader.lms.grades import Options, Person
from grader.lms.table import RawTable
from reference.errors import CallError
from tests.unit.lms.classroom import NAMES_APART, a_class, form, left_out, marked, notes, report, results

NEEDED = {
    ("moodle", "feedback"): {"people": {"s09": Person(participant=1)}},
    ("moodle", "marks"): {"criteria": "c1,11", "assignment_id": 17},
    ("canvas-api", "marks"): {"course_id": "1", "assignment_id": "2"},
    ("google-classroom", "marks"): {"course_id": "1", "assignment_id": "2"},
    ("ms-education", "marks"): {"course_id": "a", "assignment_id": "b"},
    ("blackboard", "grades"): {"form": "Last Name,Username,Pump [Total Pts: 5 Score] |7\nPopescu,s01,\n"},
    ("ilias", "grades"): {
        "form": "update,usr_id,login,status,mark,comment\n0,7,s01,notgraded,,\n",
        "maximum": 5.0,
    },
    ("ilias", "feedback"): {"form": {"multi_feedback_Pump_3/Popescu_Ion_s01_7/": b""}},
}


def filled_in_there(path, content):
    if isinstance(content, str):
        path.write_text(content, encoding="utf-8")
        return path
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in content.items():
            archive.writestr(name, data)
    return path


@pytest.mark.parametrize("key", KINDS)
def test_where_nobody_has_a_grade_the_file_has_nobody_and_everybody_is_told(key, tmp_path):
    options = dict(NEEDED.get(key, {}))
    if key == ("moodle", "rubric"):
        options["criteria"] = tmp_path / "definitions.json"
        options["criteria"].write_text('{"areas": [{"cmid": 1, "contextid": 2}]}')
    elif "criteria" in options:
        table = tmp_path / "criteria.csv"
        table.write_text(f"criterion,id\n{options['criteria']}\n")
        options["criteria"] = table
    if "form" in options:
        options["form"] = filled_in_there(tmp_path / "form", options["form"])
    options = Options(to=key[0], what=key[1], **options)
    path = tmp_path / usual_name(options)
    waiting = marked("s01", 5.0, status="needs_review")
    delivery = export(results(waiting, report("s02", None, status="missing")), path, options)
    assert path.is_file()
    if key[0] not in {"csv", "json"} and key[1] != "rubric":
        assert delivery.written == ()
        assert set(delivery.withheld) == {"s01", "s02"}
        assert notes(delivery)[0].startswith("nobody has a grade yet")


@pytest.mark.parametrize(
    ("options", "name"),
    [
        (Options(to="csv"), "export-csv.csv"),
        (Options(to="csv", what="grades"), "export-csv-grades.csv"),
        (Options(to="json"), "export-json.zip"),
        (Options(to="moodle"), "export-moodle.csv"),
        (Options(to="moodle", what="feedback"), "export-moodle-feedback.zip"),
        (Options(to="canvas-api"), "export-canvas-api.zip"),
        (Options(to="gradescope"), "export-gradescope.zip"),
        (Options(to="lti"), "export-lti.json"),
    ],
)
def test_files_are_called_by_platform_and_thing(options, name):
    assert usual_name(options) == name


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (Options(to="lti", identity="x"), "--identity has no meaning for lti grades"),
        (Options(to="csv", position=1), "--position has no meaning for csv marks"),
        (Options(to="canvas", identity="email"), "--identity has no meaning"),
        (Options(to="canvas-api", rescale=True), "--rescale has no meaning"),
        (Options(to="gradescope", maximum=5.0), "--maximum has no meaning"),
        (Options(to="moodle", cmid=5), "--cmid has no meaning"),
        (Options(to="moodle", what="rubric", assignment_id=5), "--assignment-id has no meaning"),
    ],
)
def test_an_option_without_meaning_is_refused_not_passed_over(options, message, tmp_path):
    with pytest.raises(CallError, match=message):
        export(results(marked("s01", 5.0)), tmp_path / "x", options)


@pytest.mark.parametrize("option", [{"item": "Pump"}, {"identity": "email"}])
def test_a_worksheet_says_itself_what_options_would(option, tmp_path):
    form = tmp_path / "w.csv"
    form.write_text("Identifier,Grade,Maximum grade,Last modified (grade)\nParticipant 1,,10.00,-\n")
    with pytest.raises(CallError, match="no meaning beside --worksheet"):
        export(results(marked("s01", 5.0)), tmp_path / "x", Options(to="moodle", form=form, **option))


def test_a_place_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    for to, name in (("moodle", "x.csv"), ("gradescope", "x.zip"), ("gradescope", "folder")):
        with pytest.raises(OutputError, match="cannot be written"):
            export(results(marked("s01", 5.0)), tmp_path / "file" / name, Options(to=to))
    assert [one.name for one in tmp_path.iterdir()] == ["file"]


def test_sheets_that_look_alike_are_told_before_their_grades_are_out(tmp_path):
    pair = AlikeDocument(students=["s01", "s02"], positions=[None, None], why=["same_numbers"], measure=0.01)
    two = results(marked("s01", 5.0), marked("s02", 5.0, status="needs_review"))
    delivery = export(two.model_copy(update={"alike": [pair]}), tmp_path / "o", Options(to="lti"))
    assert notes(delivery)[-1].startswith("these sheets look alike")
    one = results(marked("s01", 5.0, status="needs_review"))
    delivery = export(one.model_copy(update={"alike": [pair]}), tmp_path / "o", Options(to="lti"))
    assert not any("alike" in note for note in notes(delivery))


def test_a_worksheet_filled_in_again_is_told_to_be_skipped_by_moodle(tmp_path):
    form = tmp_path / "w.csv"
    form.write_text("Identifier,Grade,Maximum grade,Last modified (grade)\nParticipant 1,,5.00,-\n")
    options = Options(to="moodle", form=form, people={"s01": Person(participant=1)})
    one = results(marked("s01", 5.0))
    assert not any("made before" in note for note in notes(export(one, tmp_path / "o.csv", options)))
    assert any("made before" in note for note in notes(export(one, tmp_path / "o.csv", options)))


def test_who_has_no_such_position_is_told(tmp_path):
    two = results(marked("s01", 5.0, position=1), marked("s02", 5.0, position=2))
    delivery = export(two, tmp_path / "o.csv", Options(to="moodle", position=2))
    assert delivery.written == ("s02",)
    assert left_out(delivery) == {"s01": "has no position 2"}


def test_two_students_with_a_row_between_them_have_none_even_if_one_is_withheld(tmp_path):
    form = tmp_path / "w.csv"
    form.write_text("Identifier,Full name,Grade,Last modified (grade)\nParticipant 1,Ion,,-\n")
    people = {"s01": Person(name="Ion"), "s02": Person(name="Ion")}
    both = results(marked("s01", 5.0), marked("s02", 5.0, status="needs_review"))
    delivery = export(both, tmp_path / "o.csv", Options(to="moodle", form=form, people=people))
    assert delivery.written == ()
    assert "fits several students: s01 (Ion), s02 (Ion)" in left_out(delivery)["s01"]
    assert set(delivery.withheld) == {"s02"}


def test_export_writes_one_file_and_says_who_is_in_it(tmp_path):
    delivery = export(a_class(), tmp_path / "moodle.csv", Options(to="moodle", item="Pump"))
    assert delivery.written == ("s01",)
    assert left_out(delivery) == {"s02": "needs review", "s03": "nothing handed in", "s04": "unreadable"}
    text = (tmp_path / "moodle.csv").read_text(encoding="utf-8")
    header, first = csv.reader(io.StringIO(text, newline=""))
    assert header == ["idnumber", "Pump", "Pump (feedback)"]
    assert first[2] == "<ul><li>~ <b>Vector v_B</b>: It is too long.</li></ul>"


# What is rendered is read back, and a difference stops it ------------------------------------------
ONE = results(marked("s01", 5.0, 2.5))
WORKSHEET = "Identifier,Grade,Maximum grade,Last modified (grade)\nParticipant 1,,10.00,-\n"


def refused(tmp_path, options, name="out.csv"):
    before = set(tmp_path.iterdir())
    with pytest.raises(OutputError, match="would be read back differently"):
        export(ONE, tmp_path / name, options)
    assert set(tmp_path.iterdir()) == before


def test_a_table_that_reads_otherwise_is_not_written(tmp_path, monkeypatch):
    monkeypatch.setattr(table.csv, "reader", lambda *_, **__: [["something else"]])
    refused(tmp_path, Options(to="csv"))


def test_a_filled_in_file_that_reads_otherwise_is_not_written(tmp_path, monkeypatch):
    whole = RawTable.text
    monkeypatch.setattr(RawTable, "text", lambda *rows: whole(*rows).replace("7.5", "5.5"))
    people = {"s01": Person(participant=1)}
    refused(tmp_path, Options(to="moodle", form=form(tmp_path, WORKSHEET), people=people))
    refused(tmp_path, Options(to="canvas", form=form(tmp_path, NAMES_APART)))


@pytest.mark.parametrize("broken", ["read", "namelist"])
def test_an_archive_that_reads_otherwise_is_not_written(tmp_path, monkeypatch, broken):
    monkeypatch.setattr(zipfile.ZipFile, broken, lambda *_: [])
    refused(tmp_path, Options(to="gradescope"), "out.zip")


def test_maxima_that_differ_have_no_one_row_of_points(tmp_path):
    two = results(report("s01", 5.0), report("s02", 5.0, max_score=20.0))
    for to in ("canvas", "moodle", "lti", "gradescope"):
        with pytest.raises(CallError, match=r"(?s)maxima differ.*10 points: s01\n  20 points: s02"):
            export(two, tmp_path / "o.csv", Options(to=to))
    with pytest.raises(CallError, match="maxima differ"):
        export(two, tmp_path / "o.csv", Options(to="moodle", rescale=True))
    with pytest.raises(CallError, match="--rescale"):
        export(two, tmp_path / "o.csv", Options(to="canvas", maximum=10.0))
    export(two, tmp_path / "o.csv", Options(to="canvas", maximum=10.0, rescale=True))
    assert (tmp_path / "o.csv").read_text().splitlines()[3].endswith(",2.5")
