"""summary.csv and the table of criteria."""

import csv
import io

import pytest

from grader.lms.table import criteria_text, csv_text, guarded, number, summary_text, write_summary
from tests.unit.lms.classroom import criterion, report, results


def rows(text):
    return list(csv.DictReader(io.StringIO(text, newline="")))


def test_a_row_per_student_with_points_per_criterion(a_class, tmp_path):
    write_summary(a_class, tmp_path / "summary.csv")
    found = rows((tmp_path / "summary.csv").read_bytes().decode("utf-8"))
    assert [row["student_id"] for row in found] == ["s01", "s02", "s03", "s04"]
    assert found[0] | {"v_A": "5", "v_B": "2.5", "score": "7.5", "mistakes": "sense_reversed@v_B"} == found[0]
    assert found[3]["problems"] == "pdf_encrypted"


def test_a_score_under_review_is_blank_with_its_range(a_class):
    waiting = rows(summary_text(a_class))[1]
    found = [waiting[name] for name in ("score", "score_low", "score_high", "v_B")]
    assert found == ["", "5", "10", ""]


def test_each_position_has_its_row():
    both = results(report("s01", 3.0, position=1), report("s01", 4.0, position=2))
    assert [(row["position"], row["score"]) for row in rows(summary_text(both))] == [("1", "3"), ("2", "4")]


def test_a_criterion_named_as_a_column_does_not_hide_it():
    odd = results(report("s01", 2.0, criteria=[criterion("score", "partial", 2.0)]))
    row = rows(summary_text(odd))[0]
    assert (row["score"], row["criterion_score"]) == ("2", "2")


def test_the_table_of_criteria_tells_measured_and_expected(a_class):
    first = rows(criteria_text(a_class))[0]
    assert (first["measured_mm"], first["expected_mm"], first["tolerance_deg"]) == ("47.25", "46.4", "1.5")
    assert len(rows(criteria_text(a_class))) == 4


@pytest.mark.parametrize(
    "text",
    ["=cmd|' /C calc'!A0", "+1", "-1+2", "@SUM(A1)", "\t=1", "\r=1", " =1", "\ufeff=1", "＝1+1"],
)
def test_what_a_spreadsheet_would_run_is_quoted(text):
    assert guarded(text) == f"'{text}"


def test_ordinary_text_and_numbers_are_left_alone():
    assert guarded("Ion - grupa 3 = 10") == "Ion - grupa 3 = 10"
    assert rows(csv_text(["a"], [[-1.5]]))[0]["a"] == "-1.5"


def test_a_students_formula_does_not_reach_the_spreadsheet():
    hostile = results(report("s01", 5.0, criteria=[criterion("v_A", "none", 0.0, '=HYPERLINK("http://x")')]))
    assert rows(criteria_text(hostile))[0]["feedback"].startswith("'=")


@pytest.mark.parametrize(
    ("value", "text"),
    [(7.5, "7.5"), (10.0, "10"), (1 / 3, "0.33333"), (-0.0, "0"), (1234.5, "1234.5"), (1e-9, "0")],
)
def test_numbers_have_a_dot_and_no_needless_digits(value, text):
    assert number(value) == text
