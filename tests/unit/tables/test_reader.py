"""One reader under all tables: what it takes, and what it says of a file that is none, whatever the table."""

import pytest

from grader.language import LANGUAGES, tongue
from grader.lms.table import with_ids
from grader.records import of_error
from grader.tables.decisions import read_table
from grader.tables.measurements import names_of, read_measurements
from grader.tables.reader import TableError, real_number, whole_number
from grader.tables.roster import read_roster
from reference.authored.assignment import load_assignment

NAMES = names_of(load_assignment("pump"))
TABLES = {
    "roster": (read_roster, "student_id,name", "s1,Ștefan"),
    "class": (lambda path: read_measurements(path, NAMES), "student_id,v_A", "s1,60"),
    "decisions": (read_table, "student_id,criterion,verdict,comment", "s1,v_A,full,așa"),
    "ids": (lambda path: with_ids({}, path), "student_id,username", "s1,Ștefan"),
}


@pytest.fixture(params=TABLES)
def table(request, tmp_path):
    """A file's path, what reads it, its first line and a good one."""
    read, head, row = TABLES[request.param]
    return tmp_path / f"{request.param}.csv", read, head, row


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_every_table_may_be_written_by_any_spreadsheet(table, encoding, mark):
    path, read, head, row = table
    first = head.replace("student_id", "Student_ID ")
    path.write_bytes(f"{first}\r\n\r\n{row}\r\n".replace(",", mark).encode(encoding))
    assert read(path)


@pytest.mark.parametrize(
    ("content", "why", "line"),
    [
        (b"student_id\xe9,x\n", "not_utf8", None),
        (b"\n \n", "table_empty", 1),
        (b"HEAD\nROW\n" + b"\n" * 200_001 + b"ROW\n", "too_many_lines", None),
        (b'HEAD\nROW\n\ns2,"open\n', "no_csv", 4),
        (b"HEAD,HEAD\n", "column_twice", 1),
        (b"colour,v_A\n1,2\n", "column_missing", 1),
        (b" " * 50_000_001, "too_large", None),
    ],
)
def test_what_is_no_such_table_is_told_with_its_line(table, content, why, line):
    path, read, head, row = table
    path.write_bytes(content.replace(b"HEAD", head.encode()).replace(b"ROW", row.encode()))
    if path.stem == "decisions" and why == "table_empty":
        assert not read(path).lines  # what the program makes when it writes the first one
        return
    with pytest.raises(TableError) as caught:
        read(path)
    fault = caught.value.faults[0]
    assert fault.code == why
    assert line is None or fault.parameters["line"] == line
    assert of_error(caught.value).parameters["why"] == why
    told = {caught.value.told(tongue(lang)).message for lang in LANGUAGES}
    assert len(told) == len(LANGUAGES)
    assert all(path.name in one for one in told)


def test_a_table_that_is_not_there_is_told_so_with_what_to_do(table):
    path, read, _, _ = table
    if path.stem == "decisions":
        assert not read(path).lines
        return
    with pytest.raises(TableError, match="there is no such file; check its path, or write a CSV table with"):
        read(path)


@pytest.mark.parametrize(("text", "mark", "number"), [("7,0", ";", 7), ("7.0", ",", 7), ("+3", ",", 3)])
def test_whole_numbers_may_have_the_zeros_of_a_spreadsheet(text, mark, number):
    assert whole_number(text, mark) == number


@pytest.mark.parametrize(
    ("text", "mark", "read"),
    [("−1,5", ";", -1.5), ("1.5e2", ",", 150.0), ("1,5", ",", "no_decimal_point"), ("1_5", ";", "no_number")],
)
def test_a_number_has_the_decimal_mark_of_its_table(text, mark, read):
    found = real_number(text, mark)
    assert getattr(found, "code", found) == read
