"""The benchmark of settling counts rightly, and sheets on which it found something are still read."""

import pytest

from tests.bench.judging_scans import read_works
from tests.bench.settling import Marked, Verdict, tables

RIGHT = Verdict(is_settled=True, is_right=True, is_charge=False, probability=0.99, length_mm=40.0)
WRONG = Verdict(is_settled=True, is_right=False, is_charge=True, probability=0.98, length_mm=4.0)
OPEN = Verdict(is_settled=False, is_right=True, is_charge=False, probability=0.6, length_mm=40.0)
FAIR = Verdict(is_settled=True, is_right=None, is_charge=True, probability=0.99, length_mm=40.0)


def student(*verdicts, was_read=True, of_another=False):
    return Marked(
        "flatbed", "careful", is_drawn_right=True, of_another=of_another, was_read=was_read, verdicts=verdicts
    )


def test_sheets_are_counted_as_they_are():
    students = [
        student(RIGHT, FAIR), student(RIGHT, OPEN), student(WRONG), student(was_read=False),
        student(OPEN, of_another=True),
    ]  # fmt: skip
    assert [one.is_finished for one in students] == [True, False, True, False, False]
    (_, heads, rows), (_, _, shares), _ = tables(students)
    row = dict(zip(heads, rows[0], strict=True))
    assert row["students"] == "5"
    assert row["finished"] == "50.0 %"
    assert row["criteria waiting"] == "20.0 %"
    assert (row["charged wrongly"], row["credited wrongly"]) == ("1 of 4", "0 of 4")
    assert (row["right drawings that lose"], row["not read"]) == ("1 of 5", "1")
    by_name = {cells[0]: cells[1:] for cells in shares}
    assert "0.0 % of 1" in by_name["vectors of 0 to 5 mm"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1007, 1027], ids=["the plans look alike", "all is turned by 7 degrees"])
def test_a_velocity_plan_in_its_zone_is_found(seed):
    (read,) = read_works("printed", [seed])
    (reading,) = read.readings
    assert {"velocity_plan", "acceleration_plan"} == reading.figures.keys() - {"mechanism"}
    # As drawn: there, the second one has its slider elsewhere.
    right = {"v_A": 60.0, "v_B": 48.5, "v_BA": 26.0} if seed == 1027 else {"v_A": 60.0}
    found = reading.figures["velocity_plan"].vectors
    assert {name: found[name].length_mm for name in right} == pytest.approx(right, abs=1.0)
