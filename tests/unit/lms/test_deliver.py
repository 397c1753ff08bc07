"""One door for all exports: what is refused, how files are called, how long a large class takes."""

import time
import unicodedata

import pytest

from grader.documents import AlikeDocument
from grader.files import OutputError
from grader.lms.export import KINDS, export, usual_name
from grader.lms.grades import Options, Person, in_a_row
from grader.lms.table import match_rows
from reference.errors import CallError
from tests.unit.lms.classroom import marked, report, results

SECONDS_FOR_2000 = 5.0
"""Generous: the machine may be busy. Looking every student up in every row took minutes."""


NEEDED = {
    ("moodle", "feedback"): {"people": {"s09": Person(participant=1)}},
    ("moodle", "rubric"): {"cmid": 1, "context_id": 2},
    ("moodle", "marks"): {"criteria": "c1,11", "assignment_id": 17},
    ("canvas", "marks"): {"criteria": "c1,11"},
}


@pytest.mark.parametrize("key", KINDS)
def test_where_nobody_has_a_grade_the_file_has_nobody_and_everybody_is_told(key, tmp_path):
    options = dict(NEEDED.get(key, {}))
    if "criteria" in options:
        table = tmp_path / "criteria.csv"
        table.write_text(f"criterion,id\n{options['criteria']}\n")
        options["criteria"] = table
    options = Options(to=key[0], what=key[1], **options)
    path = tmp_path / usual_name(options)
    waiting = marked("s01", 5.0, status="needs_review")
    delivery = export(results(waiting, report("s02", None, status="missing")), path, options)
    assert path.is_file()
    if key[0] != "csv" and key[1] != "rubric":
        assert delivery.written == ()
        assert set(delivery.withheld) == {"s01", "s02"}
        assert delivery.notes[0].startswith("nobody has a grade yet")


@pytest.mark.parametrize(
    ("options", "name"),
    [
        (Options(to="csv"), "export-csv.csv"),
        (Options(to="csv", what="grades"), "export-csv-grades.csv"),
        (Options(to="moodle"), "export-moodle.csv"),
        (Options(to="moodle", what="feedback"), "export-moodle-feedback.zip"),
        (Options(to="canvas", what="marks"), "export-canvas-marks.json"),
        (Options(to="gradescope"), "export-gradescope.zip"),
        (Options(to="lti"), "export-lti.json"),
    ],
)
def test_files_are_called_by_platform_and_thing(options, name):
    assert usual_name(options) == name


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (Options(to="lti", item="x"), "--item has no meaning for lti grades"),
        (Options(to="csv", position=1), "--position has no meaning for csv marks"),
        (Options(to="canvas", identity="email"), "--identity has no meaning"),
        (Options(to="canvas", what="marks", rescale=True), "--rescale has no meaning"),
        (Options(to="gradescope", maximum=5.0), "--maximum has no meaning"),
        (Options(to="moodle", cmid=5), "--cmid has no meaning"),
        (Options(to="moodle", what="rubric", assignment_id=5), "--assignment-id has no meaning"),
    ],
)
def test_an_option_without_meaning_is_refused_not_passed_over(options, told, tmp_path):
    with pytest.raises(CallError, match=told):
        export(results(marked("s01", 5.0)), tmp_path / "x", options)


@pytest.mark.parametrize("option", [{"item": "Pump"}, {"identity": "email"}, {"maximum": 10.0}])
def test_a_worksheet_says_itself_what_options_would(option, tmp_path):
    form = tmp_path / "w.csv"
    form.write_text("Identifier,Grade,Last modified (grade)\nParticipant 1,,-\n")
    with pytest.raises(CallError, match="no meaning beside --worksheet"):
        export(results(marked("s01", 5.0)), tmp_path / "x", Options(to="moodle", form=form, **option))


def test_a_place_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    for to, name in (("moodle", "x.csv"), ("gradescope", "x.zip"), ("gradescope", "folder")):
        with pytest.raises(OutputError, match="cannot be written"):
            export(results(marked("s01", 5.0)), tmp_path / "file" / name, Options(to=to))
    assert [one.name for one in tmp_path.iterdir()] == ["file"]


def test_a_long_row_of_names_ends_with_how_many_more():
    assert in_a_row(["a", "b"]) == "a, b"
    assert in_a_row(20 * ["a"] + ["b", "c"]).endswith("a and 2 more")


def test_names_are_found_however_their_accents_are_written():
    name = "Țuțu Ștefănescu-Ильин"
    rows = {1: {"name": unicodedata.normalize("NFD", name)}, 2: {"name": "other"}}
    assert match_rows(rows, {"s01": (("name", name.upper()),)}, "the table").rows == {"s01": 1}


def test_sheets_that_look_alike_are_told_before_their_grades_are_out(tmp_path):
    pair = AlikeDocument(students=["s01", "s02"], positions=[None, None], why=["same_numbers"], measure=0.01)
    two = results(marked("s01", 5.0), marked("s02", 5.0, status="needs_review"))
    delivery = export(two.model_copy(update={"alike": [pair]}), tmp_path / "o", Options(to="lti"))
    assert delivery.notes[-1].startswith("the sheets of s01 and s02 look alike")
    one = results(marked("s01", 5.0, status="needs_review"))
    delivery = export(one.model_copy(update={"alike": [pair]}), tmp_path / "o", Options(to="lti"))
    assert not any("alike" in note for note in delivery.notes)


def test_a_worksheet_filled_in_again_is_told_to_be_skipped_by_moodle(tmp_path):
    form = tmp_path / "w.csv"
    form.write_text("Identifier,Grade,Last modified (grade)\nParticipant 1,,-\n")
    options = Options(to="moodle", form=form, people={"s01": Person(participant=1)})
    one = results(marked("s01", 5.0))
    assert not any("made before" in note for note in export(one, tmp_path / "o.csv", options).notes)
    assert any("made before" in note for note in export(one, tmp_path / "o.csv", options).notes)


def test_who_has_no_such_position_is_told(tmp_path):
    two = results(marked("s01", 5.0, position=1), marked("s02", 5.0, position=2))
    delivery = export(two, tmp_path / "o.csv", Options(to="moodle", position=2))
    assert delivery.written == ("s02",)
    assert delivery.withheld == {"s01": "has no position 2"}


def matched(rows, **students):
    return match_rows(dict(enumerate(rows, start=1)), students, "it")


ION = {"email": "ion@x.ro", "name": "Ion"}
ANA = {"email": "ana@x.ro", "name": "Ana"}


def test_a_namesake_with_another_address_is_not_the_student():
    told = matched(
        [ION, ANA],
        s01=[("email", "other@x.ro"), ("name", "Ion")],
        s02=[("email", "ana@x.ro"), ("name", "Ana")],
    )
    assert told.rows == {"s02": 2}
    assert told.missing == {"s01": "row 2 of it has the name, but another email"}


def test_addresses_of_another_kind_do_not_speak_against_names_which_are_told_to_be_all_there_is():
    told = matched(
        [ION, ANA],
        s01=[("email", "s01@private.ro"), ("name", "Ion")],
        s02=[("email", ""), ("name", "Ana")],
    )
    assert told.rows == {"s01": 1, "s02": 2}
    assert told.notes_on(["s01"]) == ["found by name alone, look whether they are these: s01"]
    assert told.notes_on([]) == []


def test_two_students_with_a_row_between_them_have_none_even_if_one_is_withheld(tmp_path):
    form = tmp_path / "w.csv"
    form.write_text("Identifier,Full name,Grade,Last modified (grade)\nParticipant 1,Ion,,-\n")
    people = {"s01": Person(name="Ion"), "s02": Person(name="Ion")}
    both = results(marked("s01", 5.0), marked("s02", 5.0, status="needs_review"))
    delivery = export(both, tmp_path / "o.csv", Options(to="moodle", form=form, people=people))
    assert delivery.written == ()
    assert "fits s01 and s02 alike" in delivery.unplaced["s01"]
    assert set(delivery.withheld) == {"s02"}


# Two thousand students ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def large():
    reports = [marked(f"s{one:04}", 5.0, 2.5, None, n=one) for one in range(2000)]
    people = {
        one.student_id: Person(name=f"Nume {one.student_id}", email=f"{one.student_id}@x.ro")
        for one in reports
    }
    return results(*reports), people


def timed(large, tmp_path, **options):
    begin = time.process_time()
    delivery = export(large[0], tmp_path / "out", Options(people=large[1], **options))
    assert len(delivery.written) == 2000
    assert time.process_time() - begin < SECONDS_FOR_2000


def test_a_worksheet_of_two_thousand_students_is_filled_in_quickly(large, tmp_path):
    form = tmp_path / "w.csv"
    lines = [f"Participant {one},Nume s{one:04},,15.00,-" for one in range(2000)]
    form.write_text("\n".join(["Identifier,Full name,Grade,Maximum grade,Last modified (grade)", *lines]))
    timed(large, tmp_path, to="moodle", form=form)


def test_a_canvas_gradebook_of_two_thousand_students_is_filled_in_quickly(large, tmp_path):
    form = tmp_path / "g.csv"
    lines = [f"Nume s{one:04},{one + 1},x{one},y{one},1," for one in range(2000)]
    head = ["Student,ID,SIS User ID,SIS Login ID,Section,Pump (1)", "    Points Possible,,,,,15"]
    form.write_text("\n".join([*head, *lines]))
    timed(large, tmp_path, to="canvas", form=form)


@pytest.mark.parametrize("to", ["lti", "csv", "moodle"])
def test_files_of_two_thousand_students_are_made_quickly(large, tmp_path, to):
    timed(large, tmp_path, to=to)
