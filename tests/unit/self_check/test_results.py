"""The self-check: right, or off and in which way, and the answer not given away."""

import pytest

from grader.comparison.evidence import Submission
from grader.marking.mark import judge
from grader.self_check.results import Checked, checked_values
from tests.hands import changed, measured, sheet, task_for, without

PUMP = task_for("pump", 7)
TOO_LONG = changed(measured(PUMP), "v_D", length_mm=99.0)


def self_check(task, submission, level="hint"):
    return checked_values(judge(task, submission), level)


def is_all_right(checked):
    return all(one.result == "right" for one in checked)


def found(checked, name):
    return next(one for one in checked if one.name == name)


@pytest.mark.parametrize("level", ["symbol", "hint", "full"])
def test_right_values_are_right_at_every_level(level):
    checked = self_check(PUMP, Submission(measured=measured(PUMP), declared={"kL": "1:5"}), level)
    assert is_all_right(checked)
    drawn = {name for name, vector in PUMP.construction.vectors.items() if not vector.is_sum}
    assert {one.name for one in checked} == {"kL", *drawn}


def test_a_symbol_says_right_or_off_and_nothing_else():
    checked = self_check(PUMP, Submission(measured=TOO_LONG), "symbol")
    one = found(checked, "v_D")
    assert one == Checked("v_D", "v_D", "off")
    assert not is_all_right(checked)


def test_a_hint_says_in_which_way_without_a_number():
    one = found(self_check(PUMP, Submission(measured=TOO_LONG), "hint"), "v_D")
    assert one.reasons[0].code == "too_long"
    assert one.expected is None
    for checked in self_check(PUMP, Submission(measured=TOO_LONG), "hint"):
        for reason in checked.reasons:
            assert not any(isinstance(value, float) for value in reason.parameters.values())


def test_an_instructor_sees_the_numbers():
    one = found(self_check(PUMP, Submission(measured=TOO_LONG), "full"), "v_D")
    assert one.measured.length_mm == 99.0
    assert one.expected.length_mm == pytest.approx(abs(PUMP.real["v_D"]) / float(PUMP.parameters["kv"]))
    assert "expected_mm" in one.reasons[0].parameters


def test_what_was_not_handed_in_is_passed_over():
    only = without(measured(PUMP), *(name for name in PUMP.real if name != "v_A"))
    checked = self_check(PUMP, Submission(measured=only))
    assert [one.name for one in checked] == ["v_A"]
    assert is_all_right(checked)


def test_a_refused_scale_is_open_and_told_with_its_reason():
    submission = Submission(measured=measured(PUMP), declared={"kv": "0,22"})
    one = found(self_check(PUMP, submission), "kv")
    assert one.result == "open"
    assert one.reasons[0].parameters["why"] == "no_unit"
    assert not is_all_right((one,))


def test_an_unverifiable_scale_is_open():
    checked = self_check(PUMP, Submission(declared={"kv": "0.3 (m/s)/mm"}))
    assert [(one.name, one.result) for one in checked] == [("kv", "open")]


def test_what_follows_from_an_own_mistake_is_right():
    judgement = judge(PUMP, Submission(readings=(sheet(PUMP, moved={"b": 0j}),)))
    assert is_all_right(checked_values(judgement, "hint"))
