"""Numbers as a table's cells, and the line that says how they become the score."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.documents import Quantity, Tolerance
from grader.feedback.class_statistics import waiting
from grader.feedback.numbers import (
    points_text,
    quantity_cells,
    scale_text,
    score_line,
    score_text,
    tolerance_cells,
)
from grader.language import tongue
from tests.unit.feedback.works import criterion, report, results


@pytest.mark.parametrize(("direction", "shown"), [(359.96, "0.0"), (359.94, "359.9"), (0.04, "0.0")])
def test_directions_are_written_below_360_degrees(direction, shown):
    assert quantity_cells(Quantity(direction_deg=direction), tongue("en")) == [f"∠\u00a0{shown}°"]


def test_a_vector_is_told_on_paper_and_in_reality():
    one = Quantity(length_mm=46.4, direction_deg=12.3, value=1.6704, unit="m/s")
    assert quantity_cells(one, tongue("ru")) == ["46,4\u00a0мм ∠\u00a012,3°", "1,670\u00a0м/с"]


def test_the_tolerance_of_a_value_has_its_unit_and_that_of_a_vector_needs_none():
    assert tolerance_cells(Tolerance(value=0.0123), "rad/s", tongue("ro")) == ["±0,012\u00a0rad/s"]
    both = Tolerance(length_mm=1.0, direction_deg=1.5, value=0.1)
    assert tolerance_cells(both, "m/s", tongue("en")) == ["±1.0\u00a0mm ±1.5°"]


def test_what_is_not_known_is_a_dash_or_nothing():
    assert scale_text(None, "kv", tongue("en")) == "–"
    assert quantity_cells(Quantity(), tongue("en")) == []
    assert tolerance_cells(Tolerance(), "", tongue("en")) == []


def line(*criteria, **changes):
    return score_line(report(criteria=list(criteria), **changes), tongue("en"))


def test_points_that_are_all_judged_just_add_up():
    assert line(criterion("v_A", points=5.0), criterion("v_B", "none", 0.0), max_score=10.0, score=5.0) == (
        "The points of all criteria add up to 5."
    )


def test_what_was_not_judged_is_scaled_away_and_the_line_says_how():
    told = line(
        criterion("v_A", points=5.0), criterion("v_B", "partial", 2.5), criterion("v_C", "not_judged", None),
        max_score=15.0, score=11.25,
    )  # fmt: skip
    assert "add up to 7.5 of 10" in told
    assert told.endswith("7.5 × 15 / 10 = 11.25.")


@pytest.mark.parametrize(
    ("earned", "judged", "most", "told"),
    # 31 * 43 / 40 is 33.325, and a little less as it is computed: it was 33.33 above, and 33.32 below.
    [(31.0, 40.0, 43.0, "33.325"), (0.375, 41.0, 43.0, "0.39"), (26.1, 37.0, 43.0, "30.33")],
)
def test_the_score_is_the_same_above_and_below(earned, judged, most, told):
    left = criterion("v_C", "not_judged", None).model_copy(update={"max_points": most - judged})
    row = criterion("v_A", "partial", earned).model_copy(update={"max_points": judged})
    made = report(criteria=[row, left], max_score=most, score=round(earned * most / judged, 6))
    assert score_text(made, tongue("en")) == told
    assert score_line(made, tongue("en")).endswith(f" = {told}.")


@settings(max_examples=300)
@given(st.lists(st.tuples(st.sampled_from([0.25, 0.5, 1.0, 2.0]), st.sampled_from([0.75, 0.5, 0.33]))))
def test_what_is_shown_adds_up(rows):
    points = [most * share for most, share in rows]
    each = [float(points_text(one, tongue("en"))) for one in points]
    assert points_text(sum(each), tongue("en")) == points_text(sum(points), tongue("en"))


def test_a_range_and_what_is_open_in_it_agree():
    row = criterion("v_A", points=30.0).model_copy(update={"max_points": 31.0})
    left = criterion("v_C", "not_judged", None).model_copy(update={"max_points": 4.0})
    ends = (30.0 * 40.0 / 36.0, 33.0 * 40.0 / 36.0)
    made = report(
        criteria=[row, criterion("v_B", "review", None), left],
        max_score=40.0, score=None, score_range=ends, status="needs_review",
    )  # fmt: skip
    assert score_text(made, tongue("en")) == "33.33–36.67"
    assert "= 33.33. Criteria under review add 0 to 3.34." in score_line(made, tongue("en"))
    (waits,) = waiting(results(made))
    assert points_text(waits.points, tongue("en")) == "3.34"


def test_a_section_with_a_weight_keeps_it():
    weighted = [
        criterion("v_A", points=5.0).model_copy(update={"section": "velocity_plan"}),
        criterion("v_B", "not_judged", None).model_copy(update={"section": "velocity_plan"}),
        criterion("a_A", "partial", 2.5).model_copy(update={"section": "acceleration_plan"}),
    ]
    # Velocities are worth 10 whatever was judged of them, accelerations 5.
    assert "5 × 2 + 2.5 × 1 = 12.5." in line(*weighted, max_score=15.0, score=12.5)


def test_what_waits_and_what_a_person_added_is_told():
    told = line(
        criterion("v_A", points=5.0), criterion("v_B", "review", None),
        max_score=10.0, score=None, score_range=(6.0, 11.0), added=1.0,
    )  # fmt: skip
    assert told == (
        "The points of all criteria add up to 5. Criteria under review add 0 to 5. A person added 1."
    )
    assert line(criterion("v_A"), max_score=5.0, score=4.5, added=-0.5).endswith("A person took off 0.5.")


def test_nothing_judged_has_no_line():
    assert line(criterion("v_A", "not_judged", None), max_score=5.0) == ""
