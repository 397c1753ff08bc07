"""CSV files kept to the byte."""

import csv
import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.lms.table import parse, quoted
from reference.errors import InputFileError

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
    ("data", "told"),
    [(b'a,"b\n', "never closed"), (b'"a"b,c\n', "follows a closing quote"), (b"\xff\xfea", "not UTF-8")],
)
def test_broken_files_are_refused_with_the_place(data, told):
    with pytest.raises(InputFileError, match=told):
        parse(data, "f.csv")


def test_only_what_needs_quotes_gets_them():
    assert [quoted(text, ",") for text in ("a b", "a,b", 'a"b', " a")] == ["a b", '"a,b"', '"a""b"', '" a"']
