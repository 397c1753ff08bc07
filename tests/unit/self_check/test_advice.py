"""A self-check adds one line of advice to right and off: a law, and no answer."""

import re

import pytest

from grader.comparison.evidence import Submission
from grader.feedback.mistakes import ALONG_GUIDE, DRIVING_ACROSS, DRIVING_ALONG, MISTAKES, OF_FORCE
from grader.language import tongue
from grader.marking.mark import judge
from grader.outcomes import NamedMistake
from grader.records import Reason
from grader.self_check.advice import ADVICE, LAWS, advice_on, checked_lines, law_of
from grader.texts.reasons import HINTS
from reference.authored.assignment import load_assignment
from reference.construction.mistakes import Mistake
from tests.hands import changed, measured, task_for

PUMP = task_for("pump", 7)
EN = tongue("en")


def lines_of(reading, level="hint", **declared):
    judgement = judge(PUMP, Submission(measured=reading, declared=declared))
    return {line.name: line for line in checked_lines(judgement, level, EN, load_assignment("pump"))}


@pytest.mark.parametrize("name", ["v_A", "v_D", "v_BA", "a_BA_n", "a_B_t", "a_D"])
@pytest.mark.parametrize("change", [{"length_mm": 99.0}, {"direction_deg": 33.0}])
def test_each_value_that_is_off_has_one_line_of_advice_without_a_number(name, change):
    line = lines_of(changed(measured(PUMP), name, **change))[name]
    assert line.result == "off"
    assert line.advice
    assert "\n" not in line.advice
    assert not re.search(r"\d{2}", line.hint + line.advice)


def test_what_is_right_needs_no_advice():
    lines = lines_of(measured(PUMP))
    assert {line.result for line in lines.values()} == {"right"}
    assert not any(line.advice for line in lines.values())


@pytest.mark.parametrize("level", ["symbol", "full"])
def test_other_levels_have_none(level):
    lines = lines_of(changed(measured(PUMP), "v_D", length_mm=99.0), level)
    assert not any(line.advice for line in lines.values())


@pytest.mark.parametrize(
    "mistake",
    [
        Mistake("normal_from_absolute", "n_BA"),
        Mistake("normal_reversed", "n_B"),
        Mistake("parallel_for_perpendicular", "b", 0),
        Mistake("sense_reversed", "a"),
    ],
    ids=lambda mistake: mistake.code,
)
def test_a_mistake_that_is_certain_is_told_once_by_its_law(mistake):
    lines = lines_of(measured(PUMP, mistakes=(mistake,)))
    laws = [line for line in lines.values() if line.advice == LAWS[mistake.code]]
    assert len(laws) == 1
    others = [line.advice for line in lines.values() if line.advice.startswith("The same mistake")]
    assert set(others) <= {f"The same mistake as at {laws[0].name}."}


def test_a_scale_without_a_unit_is_told_how_to_write_it():
    line = lines_of(measured(PUMP), kv="0,22")["kv"]
    assert line.result == "open"
    assert "“0.22” has no unit" in line.hint
    assert "0.036 (m/s)/mm" in line.hint


def test_every_mistake_but_a_missing_vector_has_a_law():
    assert LAWS.keys() == MISTAKES.keys() - {"vector_missing"}


@pytest.mark.parametrize(
    ("mistake", "line", "word"),
    [
        (Mistake("normal_missing", "k_A3"), "", "2·ω·v"),
        (Mistake("parallel_for_perpendicular", "d"), ALONG_GUIDE, "along its guide"),
        (Mistake("parallel_for_perpendicular", "a"), DRIVING_ACROSS, "across the line to the pivot"),
        (Mistake("parallel_for_perpendicular", "a'"), DRIVING_ALONG, "along the link"),
        (Mistake("wrong_link", "d"), ALONG_GUIDE, "its own guide"),
        (Mistake("arithmetic", "F_i3"), OF_FORCE, "real value / scale"),
        (Mistake("arithmetic", "R_34_t"), OF_FORCE, "moments"),
        (Mistake("force_reversed", "F_i3"), "", "m·a"),
        (Mistake("force_reversed", "R_43"), "", "R_ij"),
        (Mistake("arithmetic", "n_B", other=("right_triangle",)), "", "only where kL·ka = kv²"),
    ],
)
def test_a_law_suits_the_line_that_the_mistake_was_made_in(mistake, line, word):
    assert word in law_of(NamedMistake(mistake, (), 1.0, {"line": line} if line else {}))


@pytest.mark.parametrize(
    ("name", "word"),
    [("F_i3", "m·a"), ("G_D", "m·g"), ("R_34_t", "moments"), ("R_34", "lines"), ("F_b", "lines")],
)
def test_the_size_of_a_force_is_sought_where_it_comes_from(name, word):
    assert word in advice_on([Reason("too_short")], name, "A")


@pytest.mark.parametrize(("code", "word"), [("value_reversed", "against them"), ("value_too_small", "N m")])
def test_advice_on_a_moment_is_of_forces_and_arms(code, word):
    assert word in advice_on([Reason(code)], "M_b", "A")


def test_advice_is_on_reasons_that_exist():
    assert ADVICE.keys() <= HINTS.keys()
    assert advice_on((Reason("right"),), "v_A", "A") == ""
