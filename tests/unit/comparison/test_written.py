from dataclasses import replace

import pytest

from grader.comparison.evidence import DrawnVector, Submission, gather, held_against_cells
from grader.records import OtherReading
from grader.rubric import ToleranceTable
from grader.texts.reasons import FULL, HINTS
from tests.hands import sheet, task_for

TOLERANCE = ToleranceTable(length_mm=1.0, length_relative=0.02)
SURE, LEAST = 0.97, 0.9
RULER_MM = 0.5
PUMP = task_for("pump", 7)


def held(drawn_mm, written, se_mm=0.05, confidence=SURE, others=()):
    drawn = DrawnVector(drawn_mm, se_mm, 0.0, 0.1, confidence, others=others)
    vector = held_against_cells(drawn, *written, TOLERANCE, LEAST)
    return vector.confidence, vector.remarks


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


def test_doubtful_digits_that_agree_say_less_and_those_that_differ_nothing():
    agreeing = [held(46.4, (46.5, certain), confidence=0.4)[0] for certain in (0.0, 0.6, SURE)]
    assert agreeing == sorted(agreeing)
    assert agreeing[0] == pytest.approx(0.4)
    assert agreeing[1] > 0.85
    assert held(46.4, (64.4, 0.6)) == (SURE, ())


def test_a_length_does_not_tell_a_vector_from_another_reading_as_long():
    turned, longer = OtherReading(46.6, 20.0, 0.6), OtherReading(60.0, 20.0, 0.6)
    assert held(46.4, (46.5, SURE), confidence=0.4, others=(turned,))[0] == pytest.approx(0.65, abs=0.03)
    assert held(46.4, (46.5, SURE), confidence=0.4, others=(longer,))[0] > 0.9


def test_a_reading_that_ends_where_this_one_does_is_no_rival():
    near = OtherReading(46.6, 0.5, 0.6)
    assert held(46.4, (46.5, SURE), confidence=0.4, others=(near,))[0] > 0.9


def test_another_reading_that_has_the_written_length_becomes_the_likelier_one():
    drawn = DrawnVector(46.4, 0.05, 0.0, 0.1, 0.4, others=(OtherReading(60.0, 20.0, 0.6),))
    vector = held_against_cells(drawn, 60.2, SURE, TOLERANCE, LEAST)
    assert vector.confidence < 0.1
    assert vector.others[0].confidence > 0.8


def test_a_vague_drawing_contradicts_less():
    assert held(46.4, (48.0, SURE))[1]
    assert held(46.4, (48.0, SURE), se_mm=0.5)[1] == ()


def test_a_node_is_as_sure_as_a_vector_there_whose_length_is_written():
    read = sheet(PUMP, confidence=0.8)
    drawn = read.figures["velocity_plan"].vectors["v_D"].length_mm
    known = [
        gather(PUMP, Submission((replace(read, lengths=lengths),))).nodes.keys()
        for lengths in ({}, {"v_D": (drawn + RULER_MM, SURE)}, {"v_D": (drawn + 20.0, SURE)})
    ]
    assert ["d" in nodes for nodes in known] == [False, True, False]
    assert not any("c" in nodes for nodes in known)
