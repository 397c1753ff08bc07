"""Lines made of strokes, beliefs corrected by them, nodes placed by them."""

import cmath
from dataclasses import replace

import numpy as np
import pytest

from grader.reading import nodes
from grader.reading.expected import DraftingErrors, Edge, Expected, Pose, Slack, expect, links_of, vectors_of
from grader.reading.lines import Lines, lines_of
from grader.reading.matching import Beliefs, Constraint, EndPrior, StrokeAssignment, assign_strokes, updated
from grader.reading.nodes import fit_nodes
from grader.reading.vectors import Signs, within
from grader.records import VELOCITY_PLAN
from reference.plan import exact_plan
from tests.bench.force_sheets import task_with_forces
from tests.unit.reading.drawn import ink_of, task

PLACE_MM = 0.15
AT_MM = EndPrior().at_mm


def explanation(at: list[complex], edges: tuple[Edge, ...], rows: list[int]) -> StrokeAssignment:
    """Nodes about where they are, each edge with its stroke."""
    count = len(at)
    names = tuple("oabcde"[:count])
    expected = Expected(names, np.array(at), np.eye(2 * count), edges)
    return StrokeAssignment(expected, np.array(rows), np.zeros(len(edges), dtype=bool), 0.0)


def fan(*overruns: float) -> tuple[Lines, list[complex]]:
    """Strokes from nodes 50 mm away to a pole at zero, two degrees apart, each run on past the pole."""
    directions = [cmath.rect(1.0, np.radians(2.0 * index)) for index in range(len(overruns))]
    lines = [(50.0 * u, -over * u) for u, over in zip(directions, overruns, strict=True)]
    return lines_of(ink_of(lines)), [0.3 + 0j, *(50.0 * u for u in directions)]


def fitted_fan(*overruns: float):
    lines, at = fan(*overruns)
    edges = tuple(Edge(f"v{head}", 0, head) for head in range(1, len(at)))
    return fit_nodes(explanation(at, edges, list(range(len(edges)))), lines)


def test_the_cap_of_the_pen_is_no_length():
    (row,) = lines_of(ink_of([(0j, 40 + 0j)])).length
    assert row == pytest.approx(40.0, abs=1e-9)


def test_pieces_on_one_line_are_offered_joined():
    lines = lines_of(ink_of([(0j, 20 + 0j), (22 + 0.1j, 45 + 0.1j), (0 - 9j, 30 - 9j)]))
    assert any(length == pytest.approx(45.0, abs=0.2) for length in lines.length)
    assert sum(length > 40 for length in lines.length) == 1


def test_pieces_beside_one_another_are_not_joined():
    lines = lines_of(ink_of([(0j, 20 + 0j), (22 + 1.2j, 45 + 1.2j)]))
    assert len(lines) == 2


def test_a_node_lies_where_strokes_end_together():
    fit = fitted_fan(0.0, 0.0, 0.0)
    assert abs(fit.at[0]) < PLACE_MM


def test_one_stroke_run_on_past_the_node_does_not_move_it():
    fit = fitted_fan(0.0, 0.0, 3.0)
    assert abs(fit.at[0]) < PLACE_MM


def test_ends_that_disagree_leave_the_node_unsure_along_the_bundle():
    agreed, scattered = fitted_fan(0.0, 0.0, 0.0), fitted_fan(0.5, 1.4, 2.6)
    assert scattered.cov[0, 0] > 2.0 * agreed.cov[0, 0]


def test_crossing_lines_place_a_node_whatever_their_ends():
    lines = lines_of(ink_of([(-40 + 0j, 6 + 0j), (-30j, 9j)]))
    fit = fit_nodes(
        explanation([0.4 + 0.2j, -40 + 0j, -30j], (Edge("v", 1, 0), Edge("w", 2, 0)), [0, 1]), lines
    )
    assert abs(fit.at[0]) < PLACE_MM


@pytest.mark.parametrize("off_mm", [0.0, 0.4])
def test_where_lines_meet_exactly_nodes_lie_there_though_all_lines_end_short(off_mm):
    corners = [0j, 40 + 5j, 33 + 40j, -6 + 28j, 14 + 62j]
    pairs = [(first, second) for second in range(5) for first in range(second)]
    drawn = []
    for index, (first, second) in enumerate(pairs):
        along = corners[second] - corners[first]
        along /= abs(along)
        beside = off_mm * (-1) ** index * 1j * along
        drawn.append((corners[first] + 0.4 * along + beside, corners[second] - 0.4 * along + beside))
    edges = tuple(Edge(f"{first}{second}", first, second) for first, second in pairs)
    fit = fit_nodes(explanation(corners, edges, list(range(len(edges)))), lines_of(ink_of(drawn)))
    off = np.abs(fit.at - np.array(corners))
    assert (off.max() < 0.12) == (off_mm == 0.0)


def test_two_vectors_on_one_stroke_meet_where_the_data_have_it():
    lines = lines_of(ink_of([(0j, 60 + 0j)]))
    edges = (Edge("v", 0, 1), Edge("w", 1, 2))
    drawn = replace(explanation([0j, 23 + 0j, 60 + 0j], edges, [0, 0]), shared=np.array([False, True]))
    given = Expected(("o", "a", "b"), np.array([1j, 20 + 1j, 60 + 1j]), 0.1 * np.eye(6), edges)
    assert abs(fit_nodes(drawn, lines, prior=given).at[1] - 20) < 3.0 * PLACE_MM
    assert abs(fit_nodes(drawn, lines).at[1] - 20) > 1.0


def test_a_stroke_moves_what_is_believed_of_other_nodes():
    cov = np.eye(4) + np.kron(np.ones((2, 2)), 9.0 * np.eye(2))
    belief = Beliefs(np.array([[0j, 50 + 0j]]), cov[None])
    lines = lines_of(ink_of([(3j, 50 + 3j)]))
    not_shared, not_ended = np.zeros(1, dtype=bool), np.zeros((1, 2), dtype=bool)
    after = updated(belief, (0, 1), lines, not_shared, not_ended, AT_MM)
    assert after.at[0].imag == pytest.approx([3.0, 3.0], abs=0.2)
    assert np.linalg.eigvalsh(after.cov[0]).min() > 0.0
    assert np.trace(after.cov[0]) < np.trace(cov)


def test_beliefs_side_by_side_are_corrected_as_each_alone():
    rng = np.random.default_rng(5)
    root = rng.normal(size=(3, 6, 6))
    many = Beliefs(rng.normal(0.0, 20.0, (3, 3)) + 1j * rng.normal(size=(3, 3)), root @ root.mT + np.eye(6))
    lines = lines_of(ink_of([(2j * row, 50 + 3j * row) for row in range(3)]))
    shared, ended = np.array([False, True, False]), rng.random((3, 2)) > 0.5
    together = updated(many, (0, 2), lines, shared, ended, AT_MM)
    for row in range(3):
        one = np.array([row])
        alone = updated(many.take(one), (0, 2), lines.take(one), shared[one], ended[one], AT_MM)
        assert alone.at[0] == pytest.approx(together.at[row])
        assert alone.cov[0] == pytest.approx(together.cov[row])


def test_strokes_are_told_apart_by_where_they_should_lie():
    _, _, drawing = task()
    edges = vectors_of(drawing.construction, VELOCITY_PLAN)
    expected = expect(drawing, VELOCITY_PLAN, {}, DraftingErrors(), edges)
    at = dict(zip(expected.names, expected.at, strict=True))
    names = [expected.names[edge.tail] + expected.names[edge.head] for edge in edges]
    order = np.random.default_rng(0).permutation(len(edges))
    strokes = [(complex(at[names[k][0]]), complex(at[names[k][1]])) for k in order]
    found = assign_strokes([expected], lines_of(ink_of(strokes)), EndPrior())[0][0]
    assert [int(order[row]) for row in found.stroke] == list(range(len(edges)))


def velocity_plan_drawn():
    """The expected velocity plan, and lines at the expected places."""
    _, _, drawing = task()
    edges = vectors_of(drawing.construction, VELOCITY_PLAN)
    expected = expect(drawing, VELOCITY_PLAN, {}, DraftingErrors(), edges)
    return expected, lines_of(ink_of([(expected.at[edge.tail], expected.at[edge.head]) for edge in edges]))


def test_figures_explained_side_by_side_are_explained_as_each_alone():
    expected, lines = velocity_plan_drawn()
    off = [expected.placed(Pose(at, 1.0, 0.0, 1.0), Slack()) for at in (0.5 + 0.3j, -1.0 + 0.4j, 200 + 0j)]
    for together, figure in zip(assign_strokes(off, lines, EndPrior()), off, strict=True):
        alone = assign_strokes([figure], lines, EndPrior())[0]
        assert [one.stroke.tolist() for one in together] == [one.stroke.tolist() for one in alone]
        assert [one.score for one in together] == pytest.approx([one.score for one in alone])
        assert together[0].expected.at == pytest.approx(alone[0].expected.at)


def test_what_is_settled_is_not_asked_again():
    expected, lines = velocity_plan_drawn()
    free = assign_strokes([expected], lines, EndPrior())[0][0].stroke
    without = Constraint({0: -1, 1: int(free[1])}, barred=(2, int(free[2])))
    (found,) = (
        each[0].stroke for each in assign_strokes([expected], lines, EndPrior(), constraints=[without])
    )
    assert found[0] == -1
    assert found[1] == free[1]
    assert found[2] != free[2]


def test_an_edge_without_a_stroke_is_left_without():
    _, _, drawing = task()
    edges = vectors_of(drawing.construction, VELOCITY_PLAN)
    expected = expect(drawing, VELOCITY_PLAN, {}, DraftingErrors(), edges)
    ends = [(complex(expected.at[edge.tail]), complex(expected.at[edge.head])) for edge in edges]
    found = assign_strokes([expected], lines_of(ink_of(ends[:-1])), EndPrior())[0][0]
    assert found.stroke[-1] == -1 or found.shared[-1]


def test_expectations_propagate_the_hands_errors():
    _, _, drawing = task()
    careless = expect(drawing, VELOCITY_PLAN, {}, DraftingErrors(angle_rad=0.02), ())
    careful = expect(
        drawing, VELOCITY_PLAN, {}, DraftingErrors(angle_rad=0.001, length_mm=0.1, shift_mm=0.05), ()
    )
    d = 2 * careful.names.index("d")
    assert careless.cov[d, d] > careful.cov[d, d] > 0.0
    assert careless.at == pytest.approx(careful.at)


def test_links_of_a_press_are_its_bars():
    _, _, drawing = task("press")
    links = {"O1A", "AB", "O2B", "O2C", "CD"}
    assert {edge.name for edge in links_of(drawing.construction)} == links
    weighed = task_with_forces("press")
    plan = exact_plan(weighed, weighed.variants()[:1])
    assert plan.construction.step("S3")
    assert {edge.name for edge in links_of(plan.construction)} == links


def test_probability_within_half_a_millimetre_falls_with_the_error():
    shares = [within(np.diag([s**2, s**2])) for s in (0.05, 0.2, 0.5, 2.0)]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] > 0.999
    assert shares[-1] < 0.1


@pytest.mark.parametrize(
    "worse",
    [{"placed": 0.6}, {"named": 0.3}, {"off_mm": 1.2}, {"marked": 0.0}],
    ids=lambda worse: next(iter(worse)),
)
def test_every_bad_sign_lowers_the_confidence(worse):
    good = Signs(placed=0.98, named=0.99)
    assert replace(good, **worse).confidence() < good.confidence()


def test_ends_that_reach_a_node_side_by_side_count_as_one():
    def outward(node, angle_deg):
        row = np.zeros(4)
        row[2 * node : 2 * node + 2] = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
        return row

    rows = np.array([outward(0, 10), outward(0, 14), outward(0, 18), outward(0, 100), outward(1, 10)])
    assert nodes._repeated(rows) == pytest.approx([2 / 3, 2 / 3, 2 / 3, 0.0, 0.0])
