"""Places of a plan's nodes, by a network that sees the ink about each and where vectors are expected."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from grader.records import FloatArray, InkMap, NodePlaces, NodeView
from grader.scan.pixels import BoolArray, Float32Array
from reference.geometry import ComplexArray

PX_PER_MM = 6.0
HALF_MM, SIDE_PX, CELLS = 4.0, 48, 12
"""Reach of a window from its middle; its pixels, and the network's cells, along a side."""
LINE_MM = 0.17
"""Standard deviation of the blur with which expected vectors are drawn."""
AT_NODE_MM = 0.3
"""An end this near to a node is at it."""
FARTHEST_MM = 1.45 * HALF_MM
"""A line farther from the middle is not in the window, however it is turned."""
NARROWEST, WIDEST, USUAL = -3.3, 0.5, -1.5
"""Bounds of a standard error's logarithm, and its value where the network says zero."""
HEAVY_TAILS = 1.5
"""Variance of Student's distribution with six degrees of freedom, which was learnt, of a unit scale."""

_STEPS = (np.arange(SIDE_PX) + 0.5) / PX_PER_MM - HALF_MM
_PIXELS = (_STEPS + 1j * _STEPS[:, None]).astype(np.complex64)
_MIDDLES = (np.arange(CELLS) + 0.5) * (2.0 * HALF_MM / CELLS) - HALF_MM


def node_places(where: InkMap, views: Sequence[NodeView]) -> NodePlaces:
    """Return the places of nodes by the ink about each; `views` are one or more."""
    network = _network()
    network.setInput(np.stack([window_of(where, view) for view in views]))
    cells, nowhere = (np.asarray(told, np.float64) for told in network.forward(["cells", "none"]))
    odds = np.concatenate([cells[:, 0].reshape(len(views), -1), nowhere], axis=1)
    share = np.exp(odds - odds.max(axis=1, keepdims=True))
    share /= share.sum(axis=1, keepdims=True)
    x, y = cells[:, 1] + _MIDDLES, cells[:, 2] + _MIDDLES[:, None]
    middle = np.array([view.at for view in views])[:, None]
    at = middle + (x - 1j * y).reshape(len(views), -1)
    se = np.exp(np.clip(cells[:, 3] + USUAL, NARROWEST, WIDEST)) * np.sqrt(HEAVY_TAILS)
    return NodePlaces(at, se.reshape(len(views), -1), share[:, :-1])


@cache
def _network() -> cv2.dnn.Net:
    return cv2.dnn.readNetFromONNX(str(Path(__file__).with_name("nodes.onnx")))


def window_of(where: InkMap, view: NodeView, turn: complex = 1.0) -> Float32Array:
    """(4, 48, 48) the ink about a node, and the vectors that begin at it, end at it, and the others.

    Arguments: `turn`, of length 1, turns the window's axes on the sheet.
    """
    ends = np.conj((view.vectors - view.at) * np.conj(turn))
    at_node = np.abs(ends) < AT_NODE_MM
    begin, end = at_node[:, 0], at_node[:, 1] & ~at_node[:, 0]
    other = ~at_node.any(axis=1) & _in_reach(ends)
    parts = [_ink(where, view.at, turn), *(_drawn(ends[rows]) for rows in (begin, end, other))]
    return np.stack(parts).astype(np.float32)


def _ink(where: InkMap, at: complex, turn: complex) -> FloatArray:
    """(48, 48) ink 0..1 about a place, its axes turned."""
    # From the window's pixels to the map's, y down.
    step = np.array([[turn.real, turn.imag], [-turn.imag, turn.real]]) * where.px_per_mm / PX_PER_MM
    corner = np.array([at.real, -at.imag]) * where.px_per_mm + step @ np.full(2, 0.5 - HALF_MM * PX_PER_MM)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    window = cv2.warpAffine(where.ink, np.column_stack([step, corner]), (SIDE_PX, SIDE_PX), flags=flags)
    return np.asarray(window / 255.0)


def _in_reach(ends: ComplexArray) -> BoolArray:
    """(k,) whether a segment (k, 2) may be in the window."""
    span = ends[:, 1] - ends[:, 0]
    square = np.maximum(np.abs(span) ** 2, 1e-12)
    share = np.clip(-(ends[:, 0] * np.conj(span)).real / square, 0.0, 1.0)
    return np.asarray(np.abs(ends[:, 0] + share * span) < FARTHEST_MM)


def _drawn(ends: ComplexArray) -> FloatArray:
    """(48, 48) segments (k, 2), relative to the window's middle, y down, with soft borders."""
    if not len(ends):
        return np.zeros((SIDE_PX, SIDE_PX))
    tail, head = ends.astype(np.complex64).T[:, :, None, None]
    length = np.maximum(np.abs(head - tail), 1e-6)
    local = (_PIXELS - tail) * np.conj((head - tail) / length)
    beyond = local.real - np.clip(local.real, 0.0, length)
    return np.asarray(np.exp(-0.5 * (beyond**2 + local.imag**2) / LINE_MM**2).max(axis=0))
