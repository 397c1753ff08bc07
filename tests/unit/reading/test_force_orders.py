"""Force polygons may be drawn in any order of their sides: the vectors stay, and the usual corners follow."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from grader.reading.arrowheads import TOLD_MM, forward_mm
from grader.reading.corrected import corrected
from grader.reading.expected import Edge, Expected
from grader.reading.lines import lines_of
from grader.reading.orders import ends_on_sheet, orders_by_ink, reordered, ring_of, to_usual
from grader.reading.plans import ARROWS_PER_MM, MOST_BY_ARROWS, _nats_by_arrows
from grader.reading.read import BACKWARDS, _find_forces, _readings, read_figures
from grader.reading.vectors import MOST_OPEN, _is_inferred, _may_pass_a_tiny_side
from grader.records import (
    Figure,
    InkMap,
    NodePlaces,
    NodeView,
    PageRef,
    Reading,
    ReadNode,
    ReadVector,
    ScannedPage,
)
from reference.construction.graph import evaluate
from reference.construction.mistakes import commit, mistakes_of_forces
from reference.plan import exact_plan
from tests.bench.force_sheets import MASSES, judged, read, task_with_forces, work, work_with_mistake
from tests.unit.reading.drawn import draw, ink_of

ROUNDING_MM = 1e-9
WIDTH_MM, LONG_MM = 0.5, 5.0


def an_order(ring, lot):
    """The sides of a ring in some order, the closing ones last, those in either order."""
    count = len(ring.vectors)
    chain, closing = np.arange(count - ring.closing), np.arange(count - ring.closing, count)
    return (*map(int, lot.permutation(chain)), *map(int, lot.permutation(closing)))


@pytest.mark.parametrize("name", list(MASSES))
def test_vectors_and_usual_corners_are_those_of_the_exact_plan_in_any_order(name):
    assignment, lot = task_with_forces(name), np.random.default_rng(3)
    plan = exact_plan(assignment, assignment.variants()[1:2])
    right = evaluate(plan.construction, plan.drawing.parameters)
    rings = {figure: ring_of(plan.construction, figure) for figure in plan.construction.poles}
    assert any(rings.values())
    for figure, ring in rings.items():
        for _ in range(6 if ring else 0):
            order = an_order(ring, lot)
            changed = reordered(plan.construction, figure, ring, order)
            names = [step.node for step in changed.figures[figure]]
            # What later plans take over is not asked here.
            nodes = evaluate(changed, plan.drawing.parameters, wanted=names)
            for vector in changed.vectors_of(figure):
                tail, tip = vector.arrow
                drawn = nodes[tip] - nodes[tail]
                assert abs(drawn - plan.drawn_mm(vector.name))[0] < ROUNDING_MM, (vector.name, order)
            sides = {one.name for one in ring.vectors}
            assert sides <= {vector.name for vector in changed.vectors_of(figure)}
            usual = to_usual(order) @ np.array([complex(np.ravel(nodes[node])[0]) for node in names])
            for node, at in zip(names, usual, strict=True):
                assert abs(at - complex(np.ravel(right[node])[0])) < ROUNDING_MM, (node, order)


def test_sides_too_short_for_a_stroke_stand_beside_their_neighbours():
    plan = exact_plan(task_with_forces("pump"), task_with_forces("pump").variants()[:1])
    ring = ring_of(plan.construction, "force_plan_B")
    long, closing = np.arange(len(ring.vectors) - 2), np.arange(len(ring.vectors) - 2, len(ring.vectors))
    spans = np.exp(2j * np.pi * np.arange(len(ring.vectors)) / len(long)) * 20.0
    spans[closing] = 0.1
    at = np.concatenate([[0j], np.cumsum(spans)[:-1]])
    ends = np.stack([at, at + spans], axis=1)[long]
    expected = Expected(tuple(map(str, range(len(at)))), at, np.eye(2 * len(at)), ())
    lines = lines_of(ink_of([tuple(pair) for pair in ends]))
    orders = orders_by_ink(expected, ring, lines)
    # Both orders of the closing sides are told: strokes elsewhere may fit the wrong one better.
    assert {order[-2:] for order in orders} == {tuple(closing), tuple(closing[::-1])}


def test_the_usual_order_changes_nothing():
    plan = exact_plan(task_with_forces("pump"), task_with_forces("pump").variants()[:1])
    ring = ring_of(plan.construction, "force_plan_B")
    assert reordered(plan.construction, "force_plan_B", ring, ring.usual) == plan.construction
    assert (to_usual(ring.usual) == np.eye(len(ring.vectors))).all()


@pytest.mark.slow
@pytest.mark.parametrize("order", ["mixed", "backwards", "parts last"])
def test_a_polygon_drawn_in_another_order_is_read(order):
    one = work("pump", 95006, order=order)
    with tempfile.TemporaryDirectory() as folder:
        pages = read(one, Path(folder))
    drawn = [vector for vector in judged(one, pages) if not vector.true.missing and not vector.short]
    assert sum(vector.error_mm < WIDTH_MM for vector in drawn) >= 0.85 * len(drawn)
    assert not any(vector.misread for vector in drawn)
    # Where the sides are laid off otherwise, the overlay needs their places on the sheet.
    figure = pages[0].reading.figures["force_plan_B"]
    assert figure.drawn.keys() >= {"R_13_t", "F_i3", "R_43", "F_i2"}
    # A centre of mass is a dot beside its link: the joints place it, no stroke.
    joints = pages[0].reading.figures["mechanism"].nodes
    assert joints["S4"].at == pytest.approx((joints["C"].at + joints["D"].at) / 2.0)
    assert joints["S4"].se_mm < 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seed"),
    [("shaper", 96404), ("shaper", 99301), ("shaper", 96402), ("press", 96421)],
    ids=[
        "reversed",
        "reversed, no arrowheads at ends",
        "one line fits two sums",
        "opposite forces on a letter",
    ],
)
def test_what_the_ink_does_not_tell_is_not_asserted(name, seed):
    one = work_with_mistake(name, seed)
    with tempfile.TemporaryDirectory() as folder:
        pages = read(one, Path(folder))
    assert not any(vector.misread for vector in judged(one, pages))


def nowhere(where: InkMap, views: Sequence[NodeView]) -> NodePlaces:
    """Ink that tells of no node."""
    del where
    nothing = np.zeros((len(views), 1))
    return NodePlaces(nothing.astype(complex), nothing + 1.0, nothing)


def test_a_polygon_that_a_mistake_moves_is_read_where_it_lies():
    assignment = task_with_forces("pump")
    variant = assignment.variants()[1]
    right = exact_plan(assignment, [variant]).drawing
    load = right.construction.vectors["F_D"].head
    mistake = next(one for one in mistakes_of_forces(right) if (one.code, one.at) == ("force_reversed", load))
    places = {"mechanism": 120.0 - 190.0j, "force_plan_D": 300.0 - 150.0j}
    drawn = draw(commit(mistake, right), places)
    (reading,) = read_figures([(drawn.ink, drawn.sheet)], assignment, variant, None, (), nowhere)
    read_as = reading.figures["force_plan_D"].vectors
    for name, vector in drawn.vectors.items():
        if abs(vector) > LONG_MM:
            assert read_as[name].length_mm == pytest.approx(abs(vector), abs=WIDTH_MM), name


def test_arrowheads_speak_for_a_polygon_or_against_it_up_to_a_limit():
    told = [
        _nats_by_arrows(SimpleNamespace(arrows=lambda _, forward=forward: forward), None)
        for forward in (-20.0, 2.0, None)
    ]
    assert told == [-MOST_BY_ARROWS, 2.0 * ARROWS_PER_MM, 0.0]
    assert _nats_by_arrows(SimpleNamespace(arrows=None), None) == 0.0


def test_a_doubtful_sketch_among_force_polygons_is_none_beside_a_sure_one(monkeypatch):
    monkeypatch.setattr("grader.reading.read._find_plan", lambda *_: None)
    scores = [67.0, 16.0]
    pages = [SimpleNamespace(sketch=SimpleNamespace(score=score), plans={}) for score in scores]
    for figures, kept in (({"velocity_plan": ()}, [67.0, 16.0]), ({"force_plan_D": ()}, [67.0])):
        drawing = SimpleNamespace(construction=SimpleNamespace(figures=figures))
        _find_forces(pages, drawing, {}, {})
        assert [one.sketch.score for one in pages if one.sketch] == kept


@pytest.mark.parametrize(
    ("tip", "pen"), [(1.0, 2), (0.55, 2), (1.0, 6)], ids=["at the end", "in the middle", "of a broad pencil"]
)
def test_arrowheads_anywhere_on_its_sides_tell_the_sense_of_a_polygon(tip, pen):
    at, ink = np.array([10.0 - 10.0j, 50.0 - 20.0j, 20.0 - 40.0j]), np.zeros((300, 360), np.uint8)
    around = [(0, 1), (1, 2), (2, 0)]

    def forward(sides):
        edges = tuple(Edge(f"F_{tail}", tail, head) for tail, head in sides)
        drawn = SimpleNamespace(expected=SimpleNamespace(edges=edges), stroke=np.arange(len(edges)))
        plan = SimpleNamespace(assignment=drawn, fit=SimpleNamespace(at=at))
        return forward_mm(plan, InkMap(ink, 6.0))

    def line(start, end):
        first, last = ((round(6.0 * place.real), round(-6.0 * place.imag)) for place in (start, end))
        cv2.line(ink, first, last, 255, pen)

    for tail, head in around:
        line(at[tail], at[head])
    assert abs(forward(around)) < TOLD_MM
    for tail, head in around:
        point, out = at[tail] + tip * (at[head] - at[tail]), (at[head] - at[tail]) / abs(at[head] - at[tail])
        for barb in (0.25, -0.25):
            line(point, point - 3.5 * out * np.exp(1j * barb))
    assert forward(around) > TOLD_MM
    assert forward([(head, tail) for tail, head in around]) < -TOLD_MM
    assert forward([(0, 1), (1, 0)]) is None


def test_a_polygon_that_its_arrowheads_contradict_is_hardly_believed(monkeypatch):
    figure, vector = "force_plan_D", ReadVector.of(40.0 + 0.0j, np.eye(2) * 0.01, 0.9)
    monkeypatch.setattr("grader.reading.read.figure_of_plan", lambda *_: (Figure({}, {"F_D": vector}), []))
    drawing = SimpleNamespace(construction=SimpleNamespace(on_sketch=()), where=None)
    page = SimpleNamespace(sketch=None, plans={figure: None}, sheet=None, ink=drawing, apart={}, beside={})
    for forward, sure in ((40.0, 0.9), (1.0, MOST_OPEN), (-40.0, BACKWARDS)):
        monkeypatch.setattr("grader.reading.read.forward_mm", lambda *_, told=forward, **__: told)
        (reading,) = _readings([page], drawing, ())
        assert reading.figures[figure].vectors["F_D"].confidence == sure


def test_a_piece_of_a_line_is_not_the_stroke_of_a_sum():
    edges = Edge("F_3", 0, 1), Edge("R_34", 1, 2, optional=True)
    expected = SimpleNamespace(edges=edges)
    drawn = SimpleNamespace(expected=expected, stroke=np.arange(2), shared=np.zeros(2, dtype=bool))
    plan = SimpleNamespace(assignment=drawn, fit=SimpleNamespace(at=np.array([0.0, 30.0j, 80.0 + 30.0j])))
    vectors = dict.fromkeys(("F_3", "R_34"), SimpleNamespace(part=""))
    plan.hypothesis = SimpleNamespace(drawing=SimpleNamespace(construction=SimpleNamespace(vectors=vectors)))
    for length_mm in (79.0, 32.0):
        plan.lines = SimpleNamespace(length=np.array([30.0, length_mm]))
        assert _is_inferred(plan, 1) == (length_mm < 40.0)


@pytest.mark.parametrize(
    ("end", "tiny", "is_open"), [(81.4, 1.4, True), (80.1, 1.4, False), (81.4, 0.1, False)]
)
def test_a_force_may_end_where_a_tiny_one_would_put_its_end(end, tiny, is_open):
    edges = Edge("F_3", 0, 1), Edge("F_4", 1, 2)
    at = 20.0 - 100.0j + np.array([0.0, 80.0, 80.0 + tiny])
    tips = np.array([[0.0, end]]), np.ones((1, 2))
    lines = SimpleNamespace(along=[1.0], start=at, tips_towards=lambda *_: tips)
    plan = SimpleNamespace(lines=lines, placed=SimpleNamespace(edges=edges))
    plan.expected, plan.pose = SimpleNamespace(at=at), SimpleNamespace(size=1.0)
    assert _may_pass_a_tiny_side(plan, SimpleNamespace(at=at), edges[0], 0) == is_open


@pytest.mark.slow
def test_sides_at_an_acute_corner_are_no_arrowheads():
    one = work("pump", 96321)
    with tempfile.TemporaryDirectory() as folder:
        pages = read(one, Path(folder))
    asserted = [vector.true.name for vector in judged(one, pages) if vector.sure]
    assert {"R_13_t", "F_i3", "R_43", "F_i2"} <= set(asserted)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seed", "sure"),
    [
        pytest.param("pump", 96706, {"R_02_n", "R_D4", "R_34"}, id="rough prediction, part next to nothing"),
        pytest.param("pump", 219010, {"F_i4"}, id="explanations that differ by less than a millimetre"),
        pytest.param("shaper", 219007, {"R_A1", "R_01"}, id="the base of an arrowhead is no end"),
    ],
)
def test_a_force_is_asserted_where_other_explanations_would_seldom_be_right(name, seed, sure):
    one = work(name, seed)
    with tempfile.TemporaryDirectory() as folder:
        pages = read(one, Path(folder))
    asserted = [vector.true.name for vector in judged(one, pages) if vector.sure and vector.right]
    assert sure <= set(asserted)


def test_a_corner_is_moved_where_it_lies_on_the_sheet():
    plan = exact_plan(task_with_forces("pump"), task_with_forces("pump").variants()[1:2])
    figure, lot = "force_plan_B", np.random.default_rng(4)
    ring = ring_of(plan.construction, figure)
    changed = reordered(plan.construction, figure, ring, an_order(ring, lot))
    names = [step.node for step in changed.figures[figure]]
    nodes = evaluate(changed, plan.drawing.parameters, wanted=names)
    at = {node: 200.0 - 150.0j + complex(np.ravel(nodes[node])[0]) for node in names}
    # One corner was read 3 mm beside its place: two sides are wrong.
    astray = names[2]
    read = {**at, astray: at[astray] + 3.0}
    drawn = {one.name: tuple(read[node] for node in one.arrow) for one in changed.vectors_of(figure)}
    spans = {name: ReadVector.of(head - tail, np.eye(2) * 0.01, 0.6) for name, (tail, head) in drawn.items()}
    known = dict.fromkeys(names, ReadNode(200.0 - 150.0j, np.eye(2) * 0.01, 0.6))
    page = ScannedPage(PageRef("s.png"), reading=Reading({figure: Figure(known, spans, drawn)}))
    ends = ends_on_sheet(plan.construction, figure, page.reading.figures[figure])
    moved = next(node for node, place in ends.items() if place == read[astray])
    places = {(figure, moved): (at[astray].real, -at[astray].imag)}
    (right,), _ = corrected([page], places, plan.construction)
    fixed = right.reading.figures[figure]
    for name, vector in fixed.vectors.items():
        assert vector.length_mm == pytest.approx(abs(plan.drawn_mm(name))[0], abs=WIDTH_MM / 10), name
    corners = [fixed.nodes[node].at for node in names]
    usual = [complex(np.ravel(plan.nodes_mm[figure][node])[0]) for node in names]
    assert np.allclose(np.subtract(corners, corners[0]), np.subtract(usual, usual[0]), atol=ROUNDING_MM)
    assert ends_on_sheet(plan.construction, figure, fixed)[moved] == pytest.approx(at[astray])
