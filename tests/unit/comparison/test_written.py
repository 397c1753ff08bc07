import pytest

from grader.comparison.criteria import compared_with_cells
from grader.comparison.evidence import DrawnVector
from grader.comparison.verdicts import MarkRange
from grader.feedback.sentences import FULL, HINTS
from grader.rubric import ToleranceTable

TOLERANCE = ToleranceTable(length_mm=1.0, length_relative=0.02)
SURE, LEAST = 0.99, 0.9
RIGHT = MarkRange(1.0, 1.0, 1.0, ())
RULER_MM = 0.5


def held(drawn_mm, written, se_mm=0.05):
    return compared_with_cells(RIGHT, DrawnVector(drawn_mm, se_mm, 0.0, 0.1, SURE), written, TOLERANCE, LEAST)


def test_a_written_length_far_from_the_drawn_one_is_for_a_person_whatever_the_mark_would_be():
    mark = held(46.4, (64.4, SURE))
    assert (mark.worst, mark.best) == (0.0, 1.0)
    assert mark.reasons[0].code == "written_disagrees"
    assert "written_disagrees" in HINTS.keys() & FULL.keys()
    assert dict(mark.reasons[0].params) == {"drawn": 46.4, "written": 64.4, "unit": "mm"}


@pytest.mark.parametrize("off_mm", [-RULER_MM, 0.0, RULER_MM, 0.9])
def test_a_rulers_error_is_no_contradiction(off_mm):
    assert held(46.4, (46.4 + off_mm, SURE)) is RIGHT


def test_what_is_not_written_or_not_read_for_certain_contradicts_nothing():
    assert held(46.4, None) is RIGHT
    assert held(46.4, (64.4, 0.6)) is RIGHT


def test_a_vague_drawing_contradicts_less():
    assert held(46.4, (48.0, SURE)).reasons
    assert held(46.4, (48.0, SURE), se_mm=0.5) is RIGHT
