"""Tables of variants: what a row means, and that a fault names file, row and column."""

import numpy as np
import pytest

from grader.texts.spoken import fault
from reference.authored.assignment import Variant, load_assignment
from reference.errors import AuthoredFileError, CallError, ranges_of
from reference.plan import exact_plan
from tests import conveyor
from tests.told import by_path

MECHANISM = (
    conveyor.MECHANISM.replace('"course"', '"six"')
    .replace("rpm = 120", 'rpm = "n1"')
    .replace("[210, 165]", '["b", "c"]')
    .replace("length = 320", 'length = "e"')
    .replace("[0, 150]", '["d", "h"]')
    .replace('"left"', '"side_B"')
    .replace('"ahead"', '"side_C"')
)
ASSIGNMENT = """
schema_version = 1
id = "six"
mechanism = "six"
rubric = "four-bar"
title = { en = "Crank-rocker with a slider" }
task = { en = "Draw." }
[scales]
kL = 0.002
kv = 0.02
ka = 0.2
[[page]]
kind = "all"
figures = ["mechanism", "velocity_plan", "acceleration_plan"]
[variant]
"""
HEADING = "n;a [mm];b;c;d;e [cm];h;phi [°];n1 [rpm];side_B;side_C"
ROWS = (
    "9;50;130;90;140;18;90;120;90;left;ahead",
    "1;40;120;80;130;16;80;30;120;left;ahead",
    "2;42,5;120;80;130;16;80;45;120;right;ahead",
    "4;45;125;85;135;17;85;60;150;left;behind",
)


@pytest.fixture
def course(tmp_path):
    """Writes a course whose data stand in six.csv, with lines of that and keys of [variant] replaced."""

    def write(*lines: str, variant: str = 'table = "six.csv"', mechanism=(), encoding="utf-8"):
        text = MECHANISM
        for old, new in mechanism:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "six.mechanism.toml").write_text(text, encoding="utf-8")
        (tmp_path / "six.csv").write_text("\n".join(lines or (HEADING, *ROWS)) + "\n", encoding=encoding)
        path = tmp_path / "six.assignment.toml"
        path.write_text(ASSIGNMENT + variant + "\n", encoding="utf-8")
        return path

    return write


def faults(path) -> tuple[str, dict[str, str]]:
    with pytest.raises(AuthoredFileError) as error:
        load_assignment(path)
    return error.value.file, by_path(error.value.findings)


def test_rows_are_variants_in_the_order_of_n_with_gaps(course):
    assignment = load_assignment(course())
    assert assignment.variants() == [Variant(1), Variant(2), Variant(4), Variant(9)]
    data = assignment.values(assignment.variants())
    np.testing.assert_array_equal(data["a"], [40, 42.5, 45, 50])
    np.testing.assert_array_equal(data["side_B"], [1, -1, 1, 1])


def test_a_unit_in_the_heading_becomes_the_files_unit(course):
    assignment = load_assignment(course())
    np.testing.assert_array_equal(assignment.values([Variant(9), Variant(1)])["e"], [180.0, 160.0])
    turned = load_assignment(
        course(
            "n,x [rad],y [m],z",
            "1,3.141592653589793,0.07,5",
            variant='table = "six.csv"\n[variant.values]\n'
            + "\n".join(f"{name} = 50" for name in ("a", "c", "d", "e", "h", "phi", "n1"))
            + "\nb = 60\nside_B = 1\nside_C = 1",
        )
    ).values([Variant(1)])
    assert [float(turned[name][0]) for name in "xyz"] == [180.0, 70.0, 5.0]


def test_each_variant_is_in_the_assembly_of_its_row(course):
    plan = exact_plan(assignment := load_assignment(course()), assignment.variants())
    place = plan.motion.position
    turned = np.imag(np.conj(place["O2"] - place["A"]) * (place["B"] - place["A"]))
    np.testing.assert_array_equal(np.sign(turned), [1, -1, 1, 1])
    np.testing.assert_array_equal(np.sign(np.real(place["C"] - place["B"])), [1, 1, -1, 1])


def test_the_same_table_stands_in_the_file_itself(course):
    columns = '["n", "a [mm]", "b", "c", "d", "e [cm]", "h", "phi [deg]", "n1 [rpm]", "side_B", "side_C"]'
    one = '[1, 40, 120, 80, 130, 16, 80, 30, 120, "left", "ahead"]'
    rows = f'[[2, 42.5, 120, 80, 130, 16, 80, 45, 120, "right", "ahead"], {one}]'
    inside = load_assignment(course(variant=f"[variant.table]\ncolumns = {columns}\nrows = {rows}"))
    own = exact_plan(inside, inside.variants())
    beside = exact_plan(load_assignment(course()), [Variant(1), Variant(2)])
    for name, vector in own.vectors_si.items():
        np.testing.assert_allclose(vector, beside.vectors_si[name], rtol=1e-12)


@pytest.mark.parametrize(
    "table",
    [
        "[variant.table]\nn = [2, 1]\na = [41, 40]\nside_B = ['right', 'left']",
        (
            "[[variant.table]]\nn = 2\na = 41\nside_B = 'right'\n"
            "[[variant.table]]\nn = 1\nside_B = 'left'\na = 40"
        ),
        "table.columns = ['n', 'a', 'side_B']\ntable.rows = [[2, 41, 'right'], [1, 40, 'left']]",
    ],
)
def test_columns_by_name_and_rows_as_tables_are_the_same_table(course, table):
    rest = "\n[variant.values]\nb = 120\nc = 80\nd = 130\ne = 160\nh = 80\nphi = 30\nn1 = 120\nside_C = 1"
    data = load_assignment(course(variant=table + rest)).values([Variant(1), Variant(2)])
    np.testing.assert_array_equal([data["a"], data["side_B"]], [[40, 41], [1, -1]])


def test_columns_of_unequal_length_and_rows_that_lack_a_cell_are_told(course):
    _, told = faults(course(variant="[variant.table]\nn = [2, 1]\na = [41]"))
    assert told == {"$.variant.table.a": "is empty"}
    _, told = faults(course(variant="[[variant.table]]\nn = 2\na = 41\n[[variant.table]]\nn = 1"))
    assert told == {"$.variant.table.a": "is empty"}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
@pytest.mark.parametrize("mark", [";", ",", "\t"])
def test_csv_as_spreadsheets_write_it(course, mark, encoding):
    lines = [line.replace(",", "." if mark == "," else ",").replace(";", mark) for line in (HEADING, *ROWS)]
    path = course(*lines, "", mark * 10, encoding=encoding)
    assert float(load_assignment(path).values([Variant(2)])["a"][0]) == 42.5


def test_every_faulty_cell_is_told_at_once_with_row_and_column(course):
    path = course(
        HEADING,
        "1;40 mm;120;80;130;16;80;30;120;left;ahead",
        "2;;120;8o;130;16;80;45;120;up;ahead",
        "2;42;1.2.3;80;130;16;80;45;120;left;left",
        "2.5;42;120;80;130;16;80;45;120;left;behind",
        "x;42;120;80;130;16;80;45;120;left;behind",
    )
    file, told = faults(path)
    assert file.endswith("six.csv")
    assert set(told) == {
        "line 2, a", "line 3, a", "line 3, c", "line 3, side_B",
        "line 4", "line 4, b", "line 4, side_C", "line 5, n", "line 6, n",
    }  # fmt: skip
    assert "heading, as a [mm]" in told["line 2, a"]
    assert told["line 3, a"] == "is empty"
    assert "sides are left, right" in told["line 3, side_B"]
    assert told["line 4"] == "n = 2 has a row already (3)"
    assert told["line 5, n"] == "'2.5' is not a whole number"


@pytest.mark.parametrize(
    ("heading", "where", "words"),
    [
        ("n;a, mm;b (stone)", "line 1, [3]", "'stone' is no unit"),
        ("n;a [inch]", "line 1, [2]", "'inch' is no unit known here"),
        ("n;l AB", "line 1, [2]", "is no heading"),
        ("n;;a", "line 1, [2]", "has no heading"),
        ("n;a;a", "line 1, [3]", "column a is there 2 times"),
        ("n;pi", "line 1, [2]", "has a meaning in formulas already"),
        ("number;a", "line 1", "no column n (or position), which says whose row it is (did you mean number"),
        ("n;\u0430", "line 1, [2]", "'\u0430' is CYRILLIC SMALL LETTER A"),
    ],
)
def test_a_heading_that_is_none_is_told(course, heading, where, words):
    _, told = faults(course(heading, "1;2;3"))
    assert words in told[where]


def test_too_many_cells_an_empty_table_and_no_table_are_told(course):
    assert "12 cells" in faults(course(HEADING, ROWS[1] + ";7"))[1]["line 2"]
    assert "no rows" in faults(course(HEADING))[1]["line 1"]
    assert faults(course(variant='table = "seven.csv"'))[1] == {
        "$.variant.table": "there is no file seven.csv; write its path relative to the folder of this file"
    }
    assert "either file" in faults(course(variant="[variant.table]\nrows = [[1]]"))[1]["$.variant.table"]


@pytest.mark.parametrize(
    ("table", "path", "words"),
    [
        ("table = 3", "$.variant.table", "either file"),
        (
            "table = { columns = ['n', 'a'], rows = [[1, true]] }",
            "$.variant.table.rows[0][1]",
            "a side is left, right",
        ),
        ("table = {}", "$.variant.table", "either file"),
    ],
)
def test_what_is_no_table_is_told_once(course, table, path, words):
    _, told = faults(course(variant=table))
    assert list(told) == [path]
    assert words in told[path]


def test_a_spreadsheet_is_no_csv(course, tmp_path):
    (tmp_path / "six.xlsx").write_bytes(b"PK\x03\x04" + bytes(100))
    assert faults(course(variant='table = "six.xlsx"'))[1] == {
        "$": "is a spreadsheet: save it as CSV in UTF-8"
    }


def test_a_faulty_row_in_the_file_itself_is_told_with_its_path(course):
    table = '[variant.table]\ncolumns = ["n", "a"]\nrows = [[1, 40], [2, "4O"]]'
    file, told = faults(course(variant=table))
    assert file.endswith("six.assignment.toml")
    assert told == {"$.variant.table.a": "'4O' is no number"}


def test_a_table_and_a_range_of_one_number_contradict_each_other(course):
    _, told = faults(course(variant='n = { from = 1, to = 4 }\ntable = "six.csv"\n[variant.values]\na = 3'))
    assert set(told) == {"$.variant.n", "$.variant.values.a"}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('rpm = "n1"', 'omega = "n1"', "holds rpm; here it must hold rad/s"),
        ('length = "a"', 'length = "phi"', "holds °; here it must hold m, cm, mm"),
        ('side = "side_B"', 'side = "side_C"', "holds ahead, behind; here it must hold left, right"),
        ('length = "a"', 'length = "side_B"', "holds left, right; a number without a unit is needed"),
    ],
)
def test_a_column_in_a_key_of_another_kind_is_told(course, old, new, words):
    _, told = faults(course(mechanism=[(old, new)]))
    assert any(words in message for message in told.values())


def test_lengths_that_are_none_are_told_row_by_row(course):
    lines = [line.replace(";45;125;", ";-45;0;").replace(";50;130;", ";50;-1;") for line in (HEADING, *ROWS)]
    with pytest.raises(AuthoredFileError) as error:
        load_assignment(course(*lines))
    told = [fault(finding) for finding in error.value.findings]
    assert [one.removesuffix(": a length must be above zero") for one in told] == [
        f"row {row}, six.mechanism.toml $.{place}: {number} in column {name} of six.csv"
        for number, name, row, place in (
            ("-45", "a", 5, "crank.length"),
            ("0", "b", 5, "group[0].lengths[0]"),
            ("-1", "b", 2, "group[0].lengths[0]"),
        )
    ]


def test_a_formula_that_fails_names_the_first_row_where_it_does(course):
    _, told = faults(course(mechanism=[('length = "a"', 'length = "a - 42"')]))
    assert told["$.crank.length"] == "'a - 42' (length) must be > 0 (for n = 1)"
    _, told = faults(course(mechanism=[('length = "e"', 'length = "sqrt(42 - a)"')]))
    assert told["$.group[1].length"].endswith("(for n = 2 and 2 more)")


def test_a_number_that_is_not_in_the_table_is_refused_with_those_that_are(course):
    assignment = load_assignment(course())
    with pytest.raises(CallError, match=r"n = 3: assignment six has n = 1, 2, 4, 9, by six.csv"):
        assignment.variant(3)
    with pytest.raises(CallError, match=r"needs --n \(n = 1, 2, 4, 9, by six.csv\)"):
        assignment.variant(None)


def test_a_table_by_position_and_a_table_by_both(course):
    lines = [line.replace("n;", "position;", 1) for line in (HEADING, *ROWS)]
    both = load_assignment(course(*lines, variant='n = { from = 7, to = 8 }\ntable = "six.csv"'))
    assert both.variants()[:5] == [*(Variant(7, k) for k in (1, 2, 4, 9)), Variant(8, 1)]
    pairs = load_assignment(
        course(
            HEADING.replace("n;", "n;position;", 1),
            *(f"{n};{row}" for n, row in zip("1122", ROWS, strict=True)),
        )
    )
    assert pairs.variants() == [Variant(1, 1), Variant(1, 9), Variant(2, 2), Variant(2, 4)]
    with pytest.raises(CallError, match="position = 9: assignment six has position = 2, 4"):
        pairs.variant(2, 9)


def test_a_side_is_a_formula_of_the_data(course):
    assignment = load_assignment(course(mechanism=[('side = "side_B"', 'side = "3 - n"')]))
    mechanism = assignment.mechanism(assignment.variants())
    np.testing.assert_array_equal(mechanism.groups[0].side, [1, 1, -1, -1])
    _, told = faults(course(mechanism=[('side = "side_B"', 'side = "2 - n"')]))
    assert "is zero: above zero is left, below right (for n = 2)" in told["$.group[0].side"]
    _, told = faults(course(mechanism=[('side = "side_B"', 'side = "side_D"')]))
    assert "neither left nor right, nor data of a variant" in told["$.group[0].side"]


def test_numbers_in_words():
    assert ranges_of([4]) == "4"
    assert ranges_of([1, 2, 3]) == "1..3"
    assert ranges_of([1, 2, 3, 5, 6, 9]) == "1..3, 5, 6, 9"
