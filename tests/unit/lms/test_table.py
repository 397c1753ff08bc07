"""Tables: what is written, what is changed in single cells, what is read, and whose rows they are."""

import csv
import io
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.files import guarded
from grader.lms import table
from grader.lms.grades import Person
from grader.lms.table import (
    criteria_text,
    csv_text,
    match_rows,
    number,
    parse,
    quoted,
    summary_text,
    with_ids,
)
from grader.records import Reason
from reference.errors import InputFileError
from tests.unit.lms.classroom import a_class, criterion, report, results

# Plain tables --------------------------------------------------------------------------------------


def rows(text):
    return list(csv.DictReader(io.StringIO(text, newline="")))


def test_a_row_per_student_with_points_per_criterion():
    table_rows = rows(summary_text(a_class()))
    assert [row["student_id"] for row in table_rows] == ["s01", "s02", "s03", "s04"]
    assert (
        table_rows[0] | {"v_A": "5", "v_B": "2.5", "score": "7.5", "mistakes": "sense_reversed@v_B"}
        == table_rows[0]
    )
    assert table_rows[3]["problems"] == "pdf_encrypted"


def test_a_score_under_review_is_blank_with_its_range():
    waiting = rows(summary_text(a_class()))[1]
    table_rows = [waiting[name] for name in ("score", "score_low", "score_high", "v_B")]
    assert table_rows == ["", "5", "10", ""]


def test_each_position_has_its_row():
    both = results(report("s01", 3.0, position=1), report("s01", 4.0, position=2))
    assert [(row["position"], row["score"]) for row in rows(summary_text(both))] == [("1", "3"), ("2", "4")]


def test_a_criterion_named_as_a_column_does_not_hide_it():
    odd = results(report("s01", 2.0, criteria=[criterion("score", "partial", 2.0)]))
    row = rows(summary_text(odd))[0]
    assert (row["score"], row["criterion_score"]) == ("2", "2")


def test_the_table_of_criteria_tells_measured_and_expected():
    first = rows(criteria_text(a_class()))[0]
    assert (first["measured_mm"], first["expected_mm"], first["tolerance_deg"]) == ("47.25", "46.4", "1.5")
    assert len(rows(criteria_text(a_class()))) == 4


def test_titles_are_those_of_the_class():
    named = a_class().model_copy(update={"titles": {"v_B": "Velocity of B"}})
    told = {row["criterion"]: row["title"] for row in rows(criteria_text(named))}
    assert told["v_B"] == "Velocity of B"


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


# Files changed in single cells ---------------------------------------------------------------------
cells = st.text(alphabet=st.sampled_from('ab,;"\n\r é'), max_size=6)
tables = st.lists(st.lists(cells, min_size=2, max_size=4), min_size=1, max_size=4)
# Python's writer leaves a lone carriage return bare unless line ends have one too.
styles = st.sampled_from([("\n", csv.QUOTE_ALL), ("\r\n", csv.QUOTE_ALL), ("\r\n", csv.QUOTE_MINIMAL)])


@given(tables, styles, st.booleans())
def test_a_file_read_and_written_is_the_same_file(rows, style, mark):
    end, quoting = style
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator=end, quoting=quoting).writerows(rows)
    data = ("\ufeff" if mark else "").encode() + buffer.getvalue().encode()
    table = parse(data, "f.csv")
    assert table.text().encode() == data
    assert [[table.value(i, j) for j in range(len(row))] for i, row in enumerate(table.rows)] == rows


@given(tables, cells)
def test_a_changed_cell_means_what_was_put_and_the_others_stay(rows, text):
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\r\n", quoting=csv.QUOTE_ALL).writerows(rows)
    table = parse(buffer.getvalue().encode(), "f.csv")
    table.put(0, 1, text)
    changed = [list(row) for row in rows]
    changed[0][1] = text
    assert list(csv.reader(io.StringIO(table.text(), newline=""))) == changed


@pytest.mark.parametrize("text", ["", "a,b", "a,b\r\n1,2", "a\n\n", "a,\n,b\n", "a,b,"])
def test_odd_ends_of_files_are_kept(text):
    assert parse(text.encode(), "f").text() == text


def test_a_cell_that_means_the_same_stays_as_it_is_written():
    table = parse(b'"7.5",b\n', "f")
    table.put(0, 0, "7.5")
    assert table.text() == '"7.5",b\n'


@pytest.mark.parametrize(
    ("data", "why"),
    [(b'a,"b\n', "never closed"), (b'"a"b,c\n', "follows a closing quote"), (b"\xff\xfea", "not UTF-8")],
)
def test_broken_files_are_refused_with_the_place(data, why):
    with pytest.raises(InputFileError, match=why):
        parse(data, "f.csv")


def test_only_what_needs_quotes_gets_them():
    assert [quoted(text, ",") for text in ("a b", "a,b", 'a"b', " a")] == ["a b", '"a,b"', '"a""b"', '" a"']


# The platform's numbers of students ----------------------------------------------------------------


def ids_of(tmp_path, text, people=None):
    path = tmp_path / "ids.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return with_ids(people or {}, path)


def test_numbers_join_what_the_roster_tells(tmp_path):
    roster = {"s01": Person(name="Ion", email="ion@x.ro"), "s02": Person(name="Ana")}
    people = ids_of(tmp_path, "student_id,id,username,participant\ns01,4711,ion,103\ns03,,,\n", roster)
    assert people == {
        "s01": Person("Ion", "ion@x.ro", "ion", "4711", 103),
        "s02": Person(name="Ana"),
        "s03": Person(),
    }


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "line 1: the file is empty"),
        ("student_id,id\n", "line 2: there are no rows"),
        ("student,id\ns01,1\n", "the columns are student_id, id, username, participant"),
        ("student_id,mail\ns01,1\n", "column 'mail' is not known"),
        ("student_id,id,id\ns01,1,2\n", "column id is there 2 times"),
        ("student_id,id\ns01\n", "line 2: has 1 fields"),
        ("student_id,id\n,5\n", "line 2, student_id: is empty"),
        ("student_id,id\ns01,1\nS01,2\n", "line 3, student_id: 'S01' is on line 2 already"),
        ("student_id,id\ns01,1\ns02,1\n", "line 3, id: '1' is on line 2 already"),
        ("student_id,participant\ns01,Participant 5\n", "'Participant 5' is no participant's number"),
        ('student_id,id\n"s01,1\n', "line 2: from here on it is no CSV"),
        (b"\xff\xfa", "not UTF-8"),
    ],
)
def test_a_table_with_faults_is_refused_with_the_line(tmp_path, text, why):
    with pytest.raises(InputFileError, match=why):
        ids_of(tmp_path, text)


# Whose row is whose --------------------------------------------------------------------------------


def test_names_match_however_their_accents_are_written():
    name = "Țuțu Ștefănescu-Ильин"
    rows = {1: {"name": unicodedata.normalize("NFD", name)}, 2: {"name": "other"}}
    assert match_rows(rows, {"s01": (("name", name.upper()),)}).rows == {"s01": 1}


def matched(rows, **students):
    return match_rows(dict(enumerate(rows, start=1)), students)


ION = {"email": "ion@x.ro", "name": "Ion"}
ANA = {"email": "ana@x.ro", "name": "Ana"}


def test_a_namesake_with_another_address_is_not_the_student():
    matches = matched(
        [ION, ANA],
        s01=[("email", "other@x.ro"), ("name", "Ion")],
        s02=[("email", "ana@x.ro"), ("name", "Ana")],
    )
    assert matches.rows == {"s02": 2}
    assert matches.missing == {"s01": Reason("row_contrary", {"row": 2, "column": "name", "other": "email"})}


def test_addresses_of_another_kind_do_not_speak_against_names_which_are_all_there_is():
    matches = matched(
        [ION, ANA],
        s01=[("email", "s01@private.ro"), ("name", "Ion")],
        s02=[("email", ""), ("name", "Ana")],
    )
    assert matches.rows == {"s01": 1, "s02": 2}
    assert matches.notes_on(["s01"]) == [Reason("by_name_alone", {"students": ("s01",)})]
    assert matches.notes_on([]) == []
    assert matches.notes_on(iter(["s01", "s02"]))[0].parameters == {"students": ("s01", "s02")}


def test_the_work_of_matching_grows_with_the_class_not_with_its_square(monkeypatch):
    compared = []
    key = table._key
    monkeypatch.setattr(table, "_key", lambda *cell: compared.append(cell) or key(*cell))
    rows = {row: {"email": f"s{row}@x.ro", "name": f"Nume {row}"} for row in range(300)}
    students = {f"s{row}": (("email", f"s{row}@x.ro"), ("name", f"Nume {row}")) for row in rows}
    assert match_rows(rows, students).rows == {f"s{row}": row for row in rows}
    assert len(compared) == 4 * len(rows)
