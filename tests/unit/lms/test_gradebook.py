"""Moodle's gradebook import file, and the grade that a student gets."""

import csv
import io

import pytest

from grader.lms.export import export, read_results
from grader.lms.grades import Options, Person, grades_of
from grader.lms.marks import comment
from grader.lms.moodle import gradebook as drafted
from reference.errors import CallError, InputFileError
from tests.unit.lms.classroom import criterion, report, results


def rows(text):
    return list(csv.reader(io.StringIO(text, newline="")))


def gradebook(*reports, people=None, item="Pump", **how):
    options = Options(to="moodle", people=people or {}, item=item, **how)
    return drafted(grades_of(results(*reports)), options).content


def grades(text):
    return [row[:2] for row in rows(text)]


def test_users_by_idnumber_with_dots_and_nobody_who_has_no_grade_yet():
    text = gradebook(report("s01", 7.5), report("s02", None, status="needs_review"))
    assert grades(text) == [["idnumber", "Pump"], ["s01", "7.5"]]


def test_a_score_under_review_is_withheld_too():
    text = gradebook(report("s01", 7.5), report("s02", 5.0, status="needs_review"))
    assert grades(text)[1:] == [["s01", "7.5"]]


def test_users_by_address_come_from_the_roster():
    text = gradebook(report("s01", 7.5), people={"s01": Person(email="ion@x.ro")}, identity="email")
    assert grades(text)[1] == ["ion@x.ro", "7.5"]


@pytest.mark.parametrize(
    ("people", "identity", "told"),
    [
        ({}, "email", "s01: the roster gives no email"),
        ({"s01": Person(email="ion")}, "email", "is no email"),
        ({"s01": Person(email="=1@x.ro")}, "email", "formula"),
        ({"s01": Person(username="Ion Pop")}, "username", "is no username"),
        ({}, "username", "the table of ids gives no username"),
        ({}, "id", "is no id"),
        ({}, "phone", "not by 'phone'"),
    ],
)
def test_a_row_that_would_abort_moodles_import_is_refused(people, identity, told):
    with pytest.raises(CallError, match=told):
        gradebook(report("s01", 7.5), people=people, identity=identity)


def test_two_students_with_one_address_are_refused_together_with_all_other_faults():
    people = {"s01": Person(email="a@x.ro"), "s02": Person(email="A@x.ro")}
    with pytest.raises(CallError, match=r"(?s)s02: has the same email.*s03: the roster gives no"):
        gradebook(report("s01", 1.0), report("s02", 2.0), report("s03", 3.0), people=people, identity="email")


def test_users_by_moodles_own_number_come_from_the_table_of_ids():
    text = gradebook(report("s01", 7.5), people={"s01": Person(platform_id="42")}, identity="id")
    assert grades(text)[1] == ["42", "7.5"]


def test_a_grade_item_is_called_as_the_assignment_where_nothing_is_said_and_never_as_a_formula():
    assert grades(gradebook(report("s01", 7.5), item=" "))[0][1] == "pump"
    with pytest.raises(CallError, match="grade item"):
        gradebook(report("s01", 7.5), item="=1")


@pytest.mark.parametrize(
    ("reports", "told"),
    [
        ([report("s01", 12.0)], "12 is not between 0 and 10"),
        ([report("s01", 0.0, max_score=0.0)], "maximum is 0"),
        ([report("s01", 1.0), report("s01", 2.0)], "s01: has two reports"),
        ([report("..", 1.0)], "no student_id"),
        ([report("a/b", 1.0)], "no student_id"),
    ],
)
def test_results_that_contradict_themselves_are_refused(reports, told):
    with pytest.raises(InputFileError, match=told):
        gradebook(*reports)


def test_grades_above_a_hundred_are_told_to_be_more_than_most_sites_allow():
    options = Options(to="moodle")
    draft = drafted(grades_of(results(report("s01", 150.0, max_score=200.0))), options)
    assert "above 100" in draft.notes[0]


def test_another_maximum_needs_leave_to_rescale():
    with pytest.raises(CallError, match="rescaling"):
        gradebook(report("s01", 7.5), maximum=100.0)
    assert grades(gradebook(report("s01", 7.5), maximum=100.0, rescale=True))[1] == ["s01", "75"]


def test_several_positions_need_a_choice():
    both = results(report("s01", 4.0, position=1), report("s01", 5.0, position=2))
    with pytest.raises(CallError, match="has 2 positions"):
        grades_of(both)
    assert [grade.score for grade in grades_of(both, combine="sum")] == [9.0]
    assert [(g.score, g.max_score) for g in grades_of(both, combine="mean")] == [(4.5, 10.0)]
    assert [grade.score for grade in grades_of(both, position=2)] == [5.0]


@pytest.mark.parametrize(
    ("choice", "told"),
    [
        ({"combine": "best"}, "sum or mean"),
        ({"combine": "sum", "position": 1}, "not both"),
        ({"position": 7}, "no report"),
    ],
)
def test_a_choice_that_is_none_is_refused(choice, told):
    with pytest.raises(CallError, match=told):
        grades_of(results(report("s01", 4.0, position=1)), **choice)


def test_comments_on_several_positions_say_which_is_which():
    both = [
        report("s01", 4.0, position=1, criteria=[criterion("v_A", "full", 5.0)]),
        report("s01", 5.0, position=2, criteria=[criterion("v_B", "none", 0.0, "Too long.")]),
    ]
    told = comment(both, "ro")
    assert told == (
        "<p><b>Poziție 1</b></p><p>Totul este corect.</p>"
        "<p><b>Poziție 2</b></p><ul><li>✗ <b>Vector v_B</b>: Too long.</li></ul>"
    )


def test_a_sum_waits_for_all_its_parts():
    half = results(report("s01", 4.0, position=1), report("s01", None, position=2, status="missing"))
    (grade,) = grades_of(half, combine="sum")
    assert (grade.score, grade.withheld) == (None, "position 2: nothing handed in")


def test_export_writes_one_file_and_says_who_is_in_it(a_class, tmp_path):
    told = export(a_class, tmp_path / "moodle.csv", Options(to="moodle", item="Pump"))
    assert told.written == ("s01",)
    assert told.withheld == {"s02": "needs review", "s03": "nothing handed in", "s04": "unreadable"}
    header, first = rows((tmp_path / "moodle.csv").read_text(encoding="utf-8"))
    assert header == ["idnumber", "Pump", "Pump (feedback)"]
    assert first[2] == "<ul><li>~ <b>Vector v_B</b>: It is too long.</li></ul>"


def test_the_csv_target_is_the_table_of_criteria(a_class, tmp_path):
    export(a_class, tmp_path / "criteria.csv", Options(to="csv"))
    assert len(rows((tmp_path / "criteria.csv").read_text(encoding="utf-8"))) == 5


def test_an_unknown_target_is_refused_with_the_known_ones(a_class, tmp_path):
    with pytest.raises(CallError, match="csv, moodle, canvas, gradescope, lti"):
        export(a_class, tmp_path / "x.csv", Options(to="blackboard"))
    with pytest.raises(CallError, match="lti is given no 'feedback': known are grades"):
        export(a_class, tmp_path / "x.csv", Options(to="lti", what="feedback"))


def test_results_are_read_back_as_they_were_written(a_class, tmp_path):
    (tmp_path / "results.json").write_text(a_class.model_dump_json(), encoding="utf-8")
    assert read_results(tmp_path) == a_class


@pytest.mark.parametrize("content", [None, "", "[]", '{"schema_version": 1}', "\udcff"])
def test_results_that_are_none_are_refused_with_what_to_do(content, tmp_path):
    if content is not None:
        (tmp_path / "results.json").write_text(content, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(InputFileError, match="grade"):
        read_results(tmp_path)
