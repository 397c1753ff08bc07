import pytest

from grader.comparison.evidence import DrawnVector, held_against_cells
from grader.rubric import ToleranceTable
from grader.texts.reasons import FULL, HINTS

TOLERANCE = ToleranceTable(length_mm=1.0, length_relative=0.02)
SURE, LEAST = 0.97, 0.9
RULER_MM = 0.5


def held(drawn_mm, written, se_mm=0.05, confidence=SURE):
    drawn = DrawnVector(drawn_mm, se_mm, 0.0, 0.1, confidence)
    return held_against_cells(drawn, written, TOLERANCE, LEAST)


def test_a_written_length_far_from_the_drawn_one_makes_the_reading_doubtful_and_is_said():
    confidence, reasons = held(46.4, (64.4, SURE))
    assert confidence < 0.9
    assert reasons[0].code == "written_disagrees"
    assert "written_disagrees" in HINTS.keys() & FULL.keys()
    assert dict(reasons[0].parameters) == {"drawn": 46.4, "written": 64.4, "unit": "mm"}


@pytest.mark.parametrize("off_mm", [-RULER_MM, 0.0, RULER_MM, 0.9])
def test_a_written_length_that_agrees_makes_a_doubtful_reading_surer(off_mm):
    confidence, reasons = held(46.4, (46.4 + off_mm, SURE), confidence=0.4)
    assert confidence > 0.9
    assert reasons == ()


def test_what_is_not_written_or_not_read_for_certain_says_nothing():
    assert held(46.4, None) == (SURE, ())
    assert held(46.4, (64.4, 0.6)) == (SURE, ())


def test_a_vague_drawing_contradicts_less():
    assert held(46.4, (48.0, SURE))[1]
    assert held(46.4, (48.0, SURE), se_mm=0.5)[1] == ()
