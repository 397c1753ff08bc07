"""Nodes are moved to where the ink has them, as far as strokes and ink allow."""

from collections.abc import Sequence

import numpy as np
import pytest

from grader.reading.by_ink import held_against_ink
from grader.reading.expected import Edge
from grader.reading.nodes import NodeFit
from grader.records import NodePlaces, NodeView

EDGES = (Edge("v_A", 0, 1), Edge("v_BA", 1, 2))
TRUE = np.array([10.0 - 10.0j, 50.0 - 10.0j, 50.0 - 40.0j])


def fit_at(at: np.ndarray, se_mm: float = 0.3) -> NodeFit:
    return NodeFit(at, se_mm**2 * np.eye(2 * len(at)), np.zeros((len(EDGES), 2)))


def ink_with(places: Sequence[tuple[complex, float, float]]):
    """A look at the ink that gives all nodes the same places relative to the true ones: (off, se, share)."""

    def look(views: Sequence[NodeView]) -> NodePlaces:
        true = np.array([TRUE[np.abs(TRUE - view.at).argmin()] for view in views])
        off, se, share = (np.array(values) for values in zip(*places, strict=True))
        each = np.ones((len(views), 1))
        return NodePlaces(true[:, None] + off, se * each, share * each)

    return look


def test_nodes_move_to_where_sure_ink_has_them_and_are_known_better() -> None:
    fit = fit_at(TRUE + 0.4j)
    held = held_against_ink(fit, EDGES, ink_with([(0j, 0.05, 0.95)]))
    assert np.abs(held.at - TRUE).max() < 0.05
    assert np.diag(held.cov).max() < np.diag(fit.cov).min() / 4.0


def test_ink_that_shows_no_node_leaves_them_where_they_are() -> None:
    held = held_against_ink(fit_at(TRUE + 0.4j), EDGES, ink_with([(0j, 0.05, 1e-6)]))
    assert np.abs(held.at - TRUE - 0.4j).max() < 0.02


def test_places_far_away_pull_less_than_near_ones() -> None:
    fit = fit_at(TRUE)
    held = held_against_ink(fit, EDGES, ink_with([(2.0 + 0j, 0.05, 0.6), (0.1j, 0.05, 0.3)]))
    assert np.abs(held.at - (TRUE + 0.1j)).max() < 0.05


def test_two_places_that_contradict_one_another_say_nothing_of_the_axis_between_them() -> None:
    fit = fit_at(TRUE)
    held = held_against_ink(fit, EDGES, ink_with([(0.5 + 0j, 0.05, 0.5), (-0.5 + 0j, 0.05, 0.5)]))
    assert np.abs(held.at - TRUE).max() < 0.02
    assert np.diag(held.cov)[0] > 0.8 * np.diag(fit.cov)[0]


@pytest.mark.parametrize("apart_mm", [0.0, 5.0])
def test_nodes_at_one_point_count_their_window_once(apart_mm: float) -> None:
    at = np.array([TRUE[0], TRUE[1], TRUE[1] + apart_mm])
    fit = fit_at(at)
    held = held_against_ink(fit, EDGES, lambda views: NodePlaces(
        np.array([[view.at] for view in views]), np.full((len(views), 1), 0.1), np.ones((len(views), 1))
    ))  # fmt: skip
    assert (np.diag(held.cov)[4] < np.diag(fit.cov)[4] / 2.0) == (apart_mm > 0.0)
