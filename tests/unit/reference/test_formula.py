"""Formulas of authored files: what they mean, and that hostile ones cost nothing."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference.authored.formula import MAX_DEPTH, MAX_LENGTH, FormulaError, parse
from tests.told import tells

HOSTILE = [
    "__import__('os').system('true')",
    "().__class__.__bases__",
    "n.real",
    "n[0]",
    "lambda: 1",
    "(lambda n: n)(1)",
    "'text'",
    "b'1'",
    'f"{n}"',
    "[1, 2]",
    "{1: 2}",
    "[x for x in (1, 2)]",
    "1 if n else 2",
    "n and 1",
    "n < 1",
    "not n",
    "~1",
    "1 // 2",
    "1 << 9999",
    "1 @ 2",
    "1; 2",
    "n = 1",
    "(n := 1)",
    "yield",
    "await n",
    "*n",
    "sqrt(2, 3)",
    "atan2(1)",
    "atan2(1, 2, 3)",
    "min(1)",
    "max()",
    "max(*n)",
    "sqrt(x=2)",
    "sqrt(*n)",
    "sqrt",
    "exec('1')",
    "eval('1')",
    "True",
    "None",
    "...",
    "1j",
    "",
    "   ",
    "()",
    "1 +",
    "\x00",
    "1\n2",
    "2**n",
    "2**(1/2)",
    "10**10**10",
    "9**99999999",
    "9**-17",
    "1e999",
    "9" * (MAX_LENGTH + 1),
    "(" * 100 + "1" + ")" * 100,
    "-" * 100 + "1",
    "+".join(["1"] * 90),
    "1" + "+(1" * 40 + ")" * 40,
    "9" * 150 + "**16",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_a_hostile_formula_is_refused_with_a_reason(text):
    with pytest.raises(FormulaError) as error:
        parse(text)({"n": 2.0})
    assert str(error.value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2*(30+n)", 74.0),
        ("2^3", 8.0),
        ("2**-2", 0.25),
        ("-n", -7.0),
        ("+n % 4", 3.0),
        ("sqrt(0.55)", math.sqrt(0.55)),
        ("pi*1350/(30*23.5)", math.pi * 1350 / (30 * 23.5)),
        ("floor(n/2) + ceil(n/2)", 7.0),
        ("sin(radians(30))", 0.5),
        ("abs(-3)", 3.0),
        ("degrees(pi)", 180.0),
        ("asin(0.5)", math.pi / 6),
        ("acos((3**2 + 4**2 - 5**2) / (2*3*4))", math.pi / 2),
        ("acos(1 + 1/10**15)", 0.0),
        ("atan(1)", math.pi / 4),
        ("atan2(-1, -1)", -0.75 * math.pi),
        ("min(n, 5, 9)", 5.0),
        ("max(2*n, 5)", 14.0),
        (30, 30.0),
        (0.1, 0.1),
    ],
)
def test_a_formula_means_what_it_says(text, value):
    assert float(parse(text)({"n": 7.0})) == pytest.approx(value, rel=1e-15)


def test_a_formula_works_on_whole_classes():
    numbers = np.arange(1.0, 31.0)
    np.testing.assert_array_equal(parse("300 + 10*n")({"n": numbers}), 300 + 10 * numbers)


def test_functions_of_several_numbers_work_on_whole_classes():
    numbers = np.arange(1.0, 31.0)
    np.testing.assert_array_equal(
        parse("min(n, 31 - n, 10)")({"n": numbers}), np.clip(numbers, 0, 10).clip(max=31 - numbers)
    )


def test_a_wrong_count_of_numbers_is_told():
    with pytest.raises(FormulaError, check=tells("numbers that atan2 takes is 2")):
        parse("atan2(1)")
    with pytest.raises(FormulaError, check=tells("numbers that min takes is 2..20")):
        parse("min(3)")


def test_a_decimal_comma_is_answered_by_a_point():
    with pytest.raises(FormulaError, check=tells(r"'9,81\*n': write a decimal point")):
        parse("9,81*n")


def test_an_unknown_name_is_told_with_the_near_ones():
    with pytest.raises(FormulaError, check=tells("unknown name phi_dge \\(did you mean phi_deg")):
        parse("phi_dge")({"phi_deg": 1.0})
    with pytest.raises(FormulaError, check=tells("unknown name sqr \\(did you mean sqrt")):
        parse("sqr(2)")


@pytest.mark.parametrize(
    "text", ["1/n", "sqrt(-1-n)", "acos(1.1+n)", "asin(-2-n)", "0*(1/n)", "tan(pi/2)/n", "1e200*1e200"]
)
def test_a_result_that_is_no_number_is_an_error_and_never_nan(text):
    with pytest.raises(FormulaError, check=tells("does not give a finite number")):
        parse(text)({"n": 0.0})


def test_letters_of_other_alphabets_are_names_and_look_alikes_are_told_apart():
    assert float(parse("φ + 1")({"φ": 2.0})) == 3.0
    with pytest.raises(FormulaError, check=tells("unknown name")):
        parse("\u0440i")({"n": 1.0})  # a Cyrillic letter in what looks like pi


def test_a_formula_may_be_as_deep_as_allowed():
    text = "-" * MAX_DEPTH + "1"
    assert float(parse(text)({})) == 1.0


@given(st.text(max_size=60))
def test_any_text_is_a_number_or_a_formula_error(text):
    try:
        value = parse(text)({"n": 2.0})
    except FormulaError:
        return
    assert np.all(np.isfinite(value))


SYMBOLS = st.lists(
    st.sampled_from(["1", "2.5", "n", "pi", "+", "-", "*", "/", "**", "%", "(", ")", "sqrt(", "sin(", "e"]),
    max_size=25,
)


@given(SYMBOLS)
def test_any_arrangement_of_symbols_is_a_number_or_a_formula_error(symbols):
    try:
        value = parse("".join(symbols))({"n": 2.0})
    except FormulaError:
        return
    assert np.all(np.isfinite(value))


@given(
    st.floats(-1e6, 1e6),
    st.floats(-1e6, 1e6),
    st.sampled_from([("+", lambda x, y: x + y), ("-", lambda x, y: x - y), ("*", lambda x, y: x * y)]),
)
def test_arithmetic_is_that_of_floating_point(x, y, operation):
    sign, exact = operation
    assert float(parse(f"({x!r}) {sign} ({y!r})")({})) == exact(x, y)
