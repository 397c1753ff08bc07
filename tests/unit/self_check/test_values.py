"""Measured values checked: command line and web ask the one room for it."""

from pathlib import Path

import pytest

import grader
from grader.language import tongue
from grader.self_check.values import check_values
from grader.tables.measurements import NOTHING_MEASURED, measurements_in, names_of
from reference.authored.assignment import Variant, load_assignment

PUMP = load_assignment("pump")


def check(**cells):
    entered = measurements_in(cells, names_of(PUMP), "", "en") if cells else NOTHING_MEASURED
    return check_values(entered, PUMP, Variant(7), tongue("en"), "hint")


def test_what_is_off_is_told_and_what_is_missing_is_not():
    told = check(v_A="90")
    assert [(line.name, line.result) for line in told.lines] == [("v_A", "off")]
    assert not told.is_all_right


def test_nothing_handed_in_is_not_all_right():
    assert not check().is_all_right


def test_nothing_is_told_of_a_plan_in_which_nothing_was_entered():
    forces = load_assignment("pump-forces")
    told = check_values(NOTHING_MEASURED, forces, Variant(7), tongue("en"), "hint")
    assert told.lines == ()


def test_an_entry_that_cannot_be_used_is_told():
    assert check(v_A="90", v_D="long").problems


@pytest.mark.parametrize("module", ["cli/checking.py", "web/self_check.py"])
def test_who_asks_for_a_check_judges_nothing(module):
    text = (Path(grader.__file__).parent / module).read_text(encoding="utf-8")
    assert "check_values" in text
    assert "checked_lines" not in text
    assert "grader.marking.mark" not in text
