"""Numbers as a table's cells."""

import pytest

from grader.documents import QuantityDocument, ToleranceDocument
from grader.feedback.student_page import quantity_cells, scale_text, tolerance_cells
from grader.language import tongue


@pytest.mark.parametrize(("direction", "shown"), [(359.96, "0.0"), (359.94, "359.9"), (0.04, "0.0")])
def test_directions_are_written_below_360_degrees(direction, shown):
    assert quantity_cells(QuantityDocument(direction_deg=direction), tongue("en")) == [f"∠\u00a0{shown}°"]


def test_a_vector_is_told_on_paper_and_in_reality():
    one = QuantityDocument(length_mm=46.4, direction_deg=12.3, value=1.6704, unit="m/s")
    assert quantity_cells(one, tongue("ru")) == ["46,4\u00a0мм ∠\u00a012,3°", "1,670\u00a0м/с"]


def test_the_tolerance_of_a_value_has_its_unit_and_that_of_a_vector_needs_none():
    assert tolerance_cells(ToleranceDocument(value=0.0123), "rad/s", tongue("ro")) == ["±0,012\u00a0rad/s"]
    both = ToleranceDocument(length_mm=1.0, direction_deg=1.5, value=0.1)
    assert tolerance_cells(both, "m/s", tongue("en")) == ["±1.0\u00a0mm ±1.5°"]


def test_what_is_not_known_is_a_dash_or_nothing():
    assert scale_text(None, "kv", tongue("en")) == "–"
    assert quantity_cells(QuantityDocument(), tongue("en")) == []
    assert tolerance_cells(ToleranceDocument(), "", tongue("en")) == []
