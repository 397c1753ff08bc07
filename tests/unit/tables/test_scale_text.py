"""Declared scales: what students write, and what must not be guessed."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.tables.scale_text import EXAMPLES, ByRule, Declared, Refused, parse_scale
from grader.texts.spoken import ENGLISH, clause

ROUNDING = 1e-12


@pytest.mark.parametrize(
    ("name", "text", "per_mm"),
    [
        ("kL", "1:5", 0.005),
        ("kL", "M 1:5", 0.005),
        ("kL", "масштаб 1:5", 0.005),
        ("kL", "1 cm : 5 cm", 0.005),
        ("kL", "1 cm = 5 cm", 0.005),
        ("kL", "5 cm/cm", 0.005),
        ("kL", "0.006 m/mm", 0.006),
        ("kL", "0,006 м/мм", 0.006),
        ("kL", "kL = 0.3 m / 60 mm = 0.005 m/mm", 0.005),
        ("kL", "0.3 m/60 mm", 0.005),
        ("kL", "5:1", 0.0002),
        ("kv", "0.036 (m/s)/mm", 0.036),
        ("kv", "0.036 m/s·mm", 0.036),
        ("kv", "0.036 m/s mm", 0.036),
        ("kv", "0.036 m/(s·mm)", 0.036),
        ("kv", "0,036 (м/с)/мм", 0.036),
        ("kv", "μv = 0.036 м·с⁻¹/мм", 0.036),
        ("kv", "36 mm/s/mm", 0.036),
        ("kv", "3,6·10⁻² (m/s)/mm", 0.036),
        ("kv", "3.6e-2 m/s/mm", 0.036),
        ("kv", "1 mm = 0.036 m/s", 0.036),
        ("kv", "10 mm ≙ 0.36 m/s", 0.036),
        ("kv", "kv 0.036 (m/s)/mm", 0.036),
        ("ka", "ka=ω2kL=16,59 (m/s2)/mm", 16.59),
        ("ka", "0.108 m/s²·mm", 0.108),
        ("ka", "0,108 (м/с²)/мм", 0.108),
        ("ka", "0.108 m*s^-2/mm", 0.108),
        ("ka", "0.108 m/s^(2)/mm", 0.108),
        ("ka", "0.108 [m/s**2]/mm", 0.108),
        ("kF", "25 N/mm", 25.0),
        ("kF", "0,025 кН/мм", 25.0),
        ("kF", "μF = 250 Н/см", 25.0),
        ("kF", "1 mm = 25 N", 25.0),
        ("kF", "1 cm : 0.25 kN", 25.0),
    ],
)
def test_a_scale_with_its_unit_is_understood(name, text, per_mm):
    parsed = parse_scale(name, text)
    assert isinstance(parsed, Declared)
    assert parsed.per_mm == pytest.approx(per_mm, rel=ROUNDING)


@pytest.mark.parametrize(
    ("name", "text", "powers"),
    [
        ("kv", "kv = omega kL", {"omega": 1, "kL": 1}),
        ("kv", "ω1·kL", {"omega": 1, "kL": 1}),
        ("kv", "ω·μl", {"omega": 1, "kL": 1}),
        ("ka", "ω²kL", {"omega": 2, "kL": 1}),
        ("ka", "ka = ω2kL", {"omega": 2, "kL": 1}),
        ("ka", "kv^2/kL", {"kv": 2, "kL": -1}),
        ("ka", "omega * kv", {"omega": 1, "kv": 1}),
    ],
)
def test_a_rule_is_understood(name, text, powers):
    parsed = parse_scale(name, text)
    assert parsed == ByRule(powers)
    known = {"omega": -3.0, "kL": 0.005, "kv": 0.015}
    assert parsed.per_mm(known) == pytest.approx(0.015 if name == "kv" else 0.045, rel=ROUNDING)


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("kv", "0,036", "no unit"),
        ("kv", 0.036, "no unit"),
        ("kL", "1/5", "no unit"),
        ("kv", "1:5", "ratio of lengths"),
        ("kv", "0.036 m/s", "not a velocity per length"),
        ("kv", "0.036 m/s^2/mm", "not a velocity per length"),
        ("ka", "0.108 (m/s)/mm", "not an acceleration per length"),
        ("kL", "5 m", "not a length per length"),
        ("kv", "omega^2 kL", "no rule for kv"),
        ("kv", "ω2kL", "no rule for kv"),
        ("kv", "kv = omega kv", "no rule for kv"),
        ("kL", "0.3 m : 60 mm", "does not begin with one unit"),
        ("kL", "1:5 cm", "does not begin with one unit"),
        ("kL", "1:2:3", "not a ratio"),
        ("kL", "1:", "not a ratio"),
        ("kL", "0:5", "positive"),
        ("kL", "1:0", "positive"),
        ("kv", "0 m/s/mm", "positive"),
        ("kv", "1e999 m/s/mm", "nothing can be drawn at the scale"),
        ("kv", "1e-300 m/s/mm", "nothing can be drawn at the scale"),
        ("kv", "(1e300)^6 m/s/mm", "too large"),
        ("kv", "-0.1 m/s/mm", "not understood"),
        ("kv", "1.234,5 m/s/mm", "two numbers"),
        ("kv", "1 234 m/s/mm", "two numbers"),
        ("kv", "1/0 m/s/mm", "divides by zero"),
        ("kv", "0^2 m/s/mm", "power of zero"),
        ("kv", "0.036 mps/mm", "“mps” is not understood"),
        ("kv", "0.036 (m/s/mm", "not closed"),
        ("kv", "0.036 m/s^(2/mm", "not closed"),
        ("kv", "0.036 m/s^x", "power"),
        ("kv", "0.036 m/s-x", "power"),
        ("kv", "0.036 m/s)/mm", "not understood"),
        ("kv", "0.036 $/mm", r"“\$” is not understood"),
        ("kv", "((((((((((1", "not understood"),
        ("kv", "v = x = 5 m/s", "not a velocity per length"),
        ("kv", "0 mm = 5 m/s", "not a velocity per length"),
        ("kv", "5 s = 5 m/s", "not a velocity per length"),
        ("kv", "", "nothing is written"),
        ("kv", " . ", "nothing is written"),
        ("kv", "kv =", "equals sign"),
        ("kv", "1" * 200, "characters"),
    ],
)
def test_what_is_not_certain_is_refused_with_the_reason_and_an_example(name, text, why):
    parsed = parse_scale(name, text)
    assert isinstance(parsed, Refused)
    assert not parsed
    told = clause(parsed.why, ENGLISH)
    assert re.search(why, told), told
    assert parsed.why.parameters["examples"] == EXAMPLES[name]


def test_a_bare_number_counts_where_the_assignment_says_its_unit():
    assert parse_scale("kv", "0,036", bare_unit="(m/s)/mm") == Declared(0.036)
    assert parse_scale("kL", 5, bare_unit="cm/cm") == Declared(0.005)
    assert parse_scale("kL", "0.006 m/mm", bare_unit="cm/cm") == Declared(0.006)


@given(st.sampled_from(["kL", "kv", "ka"]), st.text(max_size=40))
def test_no_text_breaks_the_parser(name, text):
    parsed = parse_scale(name, text)
    assert not isinstance(parsed, Declared) or 0.0 < parsed.per_mm < float("inf")


@given(st.floats(1e-6, 1e6))
def test_every_spelling_of_a_value_gives_the_same_scale(value):
    spellings = [
        f"{value!r} (m/s)/mm",
        f"kv = {value!r} m/s·mm",
        f"{value!r}".replace(".", ",") + " (м/с)/мм",
    ]
    for spelling in spellings:
        assert parse_scale("kv", spelling).per_mm == pytest.approx(value, rel=ROUNDING)
