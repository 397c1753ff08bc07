"""A node that a person points at is read again from the ink there, and the vectors follow it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.reading.corrected import POINTED_MM, REACH_MM, corrected, snapped
from grader.records import MECHANISM, VELOCITY_PLAN, PageRef, Reading, Reason, ScannedPage, Unread
from reference.authored.assignment import Variant
from tests.unit.reading.drawn import Pen, draw, ink_of, task

CLOSE_MM = 0.25
CROSSING = ink_of([(100 - 100j, 140 - 100j), (100 - 60j, 130 - 120j), (160 - 100j, 160 - 150j)])
MEET = 120 - 100j
"""The crossing of the first two strokes."""


def pointed_at(ink, at, figure=VELOCITY_PLAN):
    return snapped(ink, at.real, -at.imag, figure)


@given(x=st.floats(-1.2, 1.2), y=st.floats(-1.2, 1.2))
def test_a_place_near_a_crossing_is_the_crossing(x, y):
    node = pointed_at(CROSSING, MEET + complex(x, y))
    assert abs(node.at - MEET) < CLOSE_MM
    assert node.se_mm < CLOSE_MM
    assert node.confidence == 1.0


def test_what_was_snapped_stays_where_it_is():
    once = pointed_at(CROSSING, MEET + 0.9 - 0.7j)
    assert abs(pointed_at(CROSSING, once.at).at - once.at) < 0.01


def test_a_place_near_the_end_of_a_stroke_is_the_end():
    node = pointed_at(CROSSING, 160.8 - 100.9j)
    assert abs(node.at - (160 - 100j)) < 0.5


@pytest.mark.parametrize("ink", [None, CROSSING])
def test_a_place_without_ink_is_taken_as_it_is(ink):
    node = pointed_at(ink, 300 - 200j)
    assert node.at == 300 - 200j
    assert np.allclose(node.cov, np.eye(2) * POINTED_MM**2)


def test_along_a_single_stroke_the_person_says_where():
    node = pointed_at(CROSSING, 110.0 - 100.8j)
    assert node.at.imag == pytest.approx(-100.0, abs=0.1)
    assert node.at.real == pytest.approx(110.0, abs=0.3)


def test_a_joint_is_the_middle_of_its_circle():
    _, _, drawing = task("pump", Variant(7))
    drawn = draw(drawing)
    at = drawn.nodes["B"]
    assert abs(pointed_at(drawn.ink, at + 0.8 - 0.9j, MECHANISM).at - at) < CLOSE_MM


@given(x=st.floats(-1000, 1000), y=st.floats(-1000, 1000))
def test_wherever_a_person_points_the_node_lies_within_reach(x, y):
    node = snapped(CROSSING, x, y, VELOCITY_PLAN)
    assert abs(node.at - complex(x, -y)) <= REACH_MM
    assert np.linalg.eigvalsh(node.cov).min() > 0.0


# Readings -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sheet():
    """A drawn sheet as a page, its true nodes, and the construction."""
    _, _, drawing = task("pump", Variant(7))
    drawn = draw(drawing, pen=Pen(left_out=frozenset({"v_DB"})))
    return ScannedPage(PageRef("s07.png"), sheet=drawn.sheet, ink=drawn.ink), drawn, drawing.construction


def read_as(page, drawn, construction, shift):
    """The page with the velocity plan read, node d `shift` mm beside its place and unsure."""
    nodes, vectors = {}, {}
    place = {step.node: drawn.nodes[step.node] for step in construction.figures[VELOCITY_PLAN]}
    changed, _ = corrected(
        [page], {(VELOCITY_PLAN, name): (at.real, -at.imag) for name, at in place.items()}, construction
    )
    figure = changed[0].reading.figures[VELOCITY_PLAN]
    d = figure.nodes["d"]
    nodes = {**figure.nodes, "d": replace(d, at=d.at + shift, confidence=0.4)}
    vectors = {
        name: replace(read, confidence=0.4) if "d" in ends_of(construction, name) else read
        for name, read in figure.vectors.items()
    }
    return replace(page, reading=Reading({VELOCITY_PLAN: replace(figure, nodes=nodes, vectors=vectors)}))


def ends_of(construction, name):
    return {construction.vectors[name].tail, construction.vectors[name].head}


def test_vectors_follow_a_moved_node_and_are_as_sure_as_their_other_end(sheet):
    page, drawn, construction = sheet
    wrong = read_as(page, drawn, construction, 6.0 + 3.0j)
    true = drawn.nodes["d"]
    (right,), astray = corrected([wrong], {(VELOCITY_PLAN, "d"): (true.real + 0.5, -true.imag)}, construction)
    figure = right.reading.figures[VELOCITY_PLAN]
    assert astray == []
    assert abs(figure.nodes["d"].at - true) < CLOSE_MM
    length = abs(drawn.vectors["v_D"])
    assert figure.vectors["v_D"].length_mm == pytest.approx(length, abs=0.4)
    assert figure.vectors["v_D"].confidence == 1.0
    untouched = {name for name in figure.vectors if "d" not in ends_of(construction, name)}
    assert all(
        figure.vectors[name] is wrong.reading.figures[VELOCITY_PLAN].vectors[name] for name in untouched
    )


def test_a_vector_is_no_surer_than_its_other_end(sheet):
    page, drawn, construction = sheet
    wrong = read_as(page, drawn, construction, 6.0 + 0j)
    figure = wrong.reading.figures[VELOCITY_PLAN]
    doubtful = {**figure.nodes, "o": replace(figure.nodes["o"], confidence=0.7)}
    wrong = replace(wrong, reading=Reading({VELOCITY_PLAN: replace(figure, nodes=doubtful)}))
    true = drawn.nodes["d"]
    (right,), _ = corrected([wrong], {(VELOCITY_PLAN, "d"): (true.real, -true.imag)}, construction)
    assert right.reading.figures[VELOCITY_PLAN].vectors["v_D"].confidence == 0.7


def test_what_was_not_drawn_is_not_read_between_moved_nodes(sheet):
    page, drawn, construction = sheet
    wrong = read_as(page, drawn, construction, 6.0 + 0j)
    gaps = tuple(Unread(name, Reason("not_found")) for name in ("v_DB", "d", "v_BA"))
    wrong = replace(wrong, reading=replace(wrong.reading, unread=gaps))
    true = drawn.nodes["d"]
    (right,), _ = corrected([wrong], {(VELOCITY_PLAN, "d"): (true.real, -true.imag)}, construction)
    assert "v_DB" not in right.reading.figures[VELOCITY_PLAN].vectors
    assert [gap.name for gap in right.reading.unread if gap.name != "v_BA"] == ["v_DB"]


def test_a_node_of_a_figure_that_was_not_read_goes_to_the_only_page(sheet):
    page, drawn, construction = sheet
    true = drawn.nodes["d"]
    place = {(VELOCITY_PLAN, "d"): (true.real, -true.imag)}
    (right,), _ = corrected([page], place, construction)
    assert set(right.reading.figures[VELOCITY_PLAN].nodes) == {"d"}
    assert corrected([page, page], place, construction) == ([page, page], [(VELOCITY_PLAN, "d")])
