"""Nodes of a plan moved to where the ink about them has them."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from grader.reading.expected import Edge, xy
from grader.reading.nodes import TIED_MM, NodeFit
from grader.records import FloatArray, NodePlaces, NodeView

Look = Callable[[Sequence[NodeView]], NodePlaces]
"""Tells of views where their nodes lie, as `grader.scan.strokes.nodes.node_places` does of a sheet's ink."""

ANYWHERE = 1.0 / 64.0
"""Density per mm2 of a node that may lie anywhere in a window of 8 mm."""
UNSEEN = 1e-4
"""Density per mm2 that is left to other places than the network's, however sure it is."""
WIDER = 1.2
"""Factor of standard errors: strokes and windows show the same ink."""


def held_against_ink(fit: NodeFit, edges: Sequence[Edge], look: Look) -> NodeFit:
    """Move the nodes at which vectors begin or end to where the ink has them.

    What the ink says of a node is replaced by a Gaussian with the moments that the node has in the light of
    strokes and ink together.
    """
    ends = np.array([(edge.tail, edge.head) for edge in edges]).reshape(-1, 2)
    nodes = np.unique(ends)
    places = look([NodeView(complex(fit.at[node]), fit.at[ends]) for node in nodes])
    precision = np.linalg.inv(fit.cov)
    pull = precision @ xy(fit.at)
    for row, node in enumerate(nodes.tolist()):
        # Nodes at one point are seen in one window: it counts once.
        if np.abs(fit.at[nodes[:row]] - fit.at[node]).min(initial=np.inf) > TIED_MM:
            block = slice(2 * node, 2 * node + 2)
            added, towards = _site(xy(fit.at[[node]]), fit.cov[block, block], places.take(row))
            precision[block, block] += added
            pull[block] += towards
    cov = np.asarray(np.linalg.inv(precision))
    state = cov @ pull
    return replace(fit, at=state[0::2] + 1j * state[1::2], cov=WIDER**2 * cov)


def _site(at: FloatArray, cov: FloatArray, places: NodePlaces) -> tuple[FloatArray, FloatArray]:
    """Precision (2, 2), and precision times mean (2,), that the places of one node add to it."""
    off = np.column_stack([places.at.real - at[0], places.at.imag - at[1]])
    inverse = np.linalg.inv(cov + places.se_mm[:, None, None] ** 2 * np.eye(2))
    distance = np.einsum("ci,cij,cj->c", off, inverse, off)
    weight = places.share * np.exp(-0.5 * distance) * np.sqrt(np.linalg.det(inverse)) / (2.0 * np.pi)
    elsewhere = (1.0 - places.share.sum()) * ANYWHERE + UNSEEN
    weight, elsewhere = weight / (weight.sum() + elsewhere), elsewhere / (weight.sum() + elsewhere)
    gain = cov @ inverse
    move = np.einsum("cij,cj->ci", gain, off)
    mean = weight @ move
    square = cov - gain @ cov + move[:, :, None] * move[:, None, :]
    spread = np.einsum("c,cij->ij", weight, square) + elsewhere * cov - np.outer(mean, mean)
    before, after = np.linalg.inv(cov), np.linalg.inv(spread)
    size, axes = np.linalg.eigh(after - before)
    if size.min() >= 0.0:
        return after - before, after @ (at + mean) - before @ at
    # Along an axis on which places contradict one another they say nothing.
    added = (axes * np.maximum(size, 0.0)) @ axes.T
    return added, added @ (at + mean)
