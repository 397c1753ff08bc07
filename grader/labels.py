"""Where the marks and names of arrows stand: beside them, clear of other arrows and labels."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grader.records import Box, FloatArray
from grader.scene import XY, Arrow, between

LABEL_HEIGHT_MM = 3.4
LETTER_MM = 1.75
BADGE_MM = 3.8
LEADER_FROM_MM = 3.0
"""A label farther than this from its arrow gets a thin line to it."""

SHARES = (0.55, 0.4, 0.7, 0.25, 0.85)
GAPS_MM = (1.2, 3.5, 6.0, 9.0, 12.0, 16.0, 21.0, 27.0)
"""Where along an arrow and how far beside it a label may stand, the best first."""
OVERLAP_COST = 16.0
"""Of a square millimetre on another label; a millimetre of distance costs a half,"""
CROSSING_COST = 2.0
"""and a millimetre of another arrow under the label this much."""


@dataclass(frozen=True, slots=True)
class Label:
    """Where an arrow's mark and name stand; `size` as of `labels_of`."""

    arrow: Arrow
    box: Box
    size: float

    @property
    def badge(self) -> tuple[XY, float]:
        """Centre and radius of the disc with the mark."""
        x, y, _width, height = self.box
        return (x + self.size * (BADGE_MM / 2 + 0.1), y + height / 2), self.size * (BADGE_MM / 2 - 0.15)

    @property
    def foot(self) -> XY:
        """Where the name's line begins."""
        return (self.box[0] + self.size * (BADGE_MM + 0.6), self.box[1] + self.box[3] - self.size * 1.25)

    @property
    def leader(self) -> tuple[XY, XY] | None:
        """From a label that stands apart to its arrow."""
        x, y, width, height = self.box
        middle = between(self.arrow.tail, self.arrow.tip, 0.55)
        near = (min(max(middle[0], x), x + width), min(max(middle[1], y), y + height))
        return (near, middle) if math.dist(near, middle) > self.size * LEADER_FROM_MM else None


def labels_of(arrows: Sequence[Arrow], within: Box, size: float = 1.0) -> list[Label]:
    """A place for each arrow's mark and name; `size` 1 suits a whole sheet, less a close-up.

    Greedy, long arrows first: each label takes the cheapest of its places.
    """
    taken = np.zeros((0, 4))
    labels = []
    for arrow in sorted(arrows, key=lambda one: -one.length):
        others = np.array([(*one.tail, *one.tip) for one in arrows if one is not arrow]).reshape(-1, 4)
        far, boxes = _places(arrow, within, size)
        crowded = OVERLAP_COST * _overlaps(boxes, taken) + CROSSING_COST * _crossings(boxes, others)
        best = boxes[int(np.argmin(far + crowded / size**2))]
        taken = np.vstack([taken, best])
        labels.append(Label(arrow, (float(best[0]), float(best[1]), float(best[2]), float(best[3])), size))
    return labels


def _places(arrow: Arrow, within: Box, size: float) -> tuple[FloatArray, FloatArray]:
    """How far-fetched each place is, (p,), and the places, (p, 4): x, y, width, height."""
    letters = len(arrow.name.replace("_", ""))
    box = size * np.array([BADGE_MM + 0.8 + LETTER_MM * letters, LABEL_HEIGHT_MM + 0.6])
    tail, along = np.array(arrow.tail), np.array([1.0, 0.0])
    step = np.array(arrow.tip) - tail
    if arrow.length > 0.0:
        along = step / arrow.length
    across = np.array([-along[1], along[0]])
    reach = float(np.abs(across) @ box) / 2.0
    share, gap, side = (one.ravel() for one in np.meshgrid(SHARES, GAPS_MM, (1.0, -1.0), indexing="ij"))
    middles = tail + share[:, None] * step + (side * (reach + size * gap))[:, None] * across
    room = np.maximum(np.array(within[2:]) - box, 1.0)
    corners = np.clip(middles - box / 2.0, np.array(within[:2]) + 0.5, np.array(within[:2]) + room - 0.5)
    return 0.5 * gap + np.abs(share - SHARES[0]), np.hstack([corners, np.broadcast_to(box, corners.shape)])


def _overlaps(boxes: FloatArray, taken: FloatArray) -> FloatArray:
    """Area that each of (p, 4) boxes shares with (t, 4) others."""
    low = np.maximum(boxes[:, None, :2], taken[:, :2])
    high = np.minimum(boxes[:, None, :2] + boxes[:, None, 2:], taken[:, :2] + taken[:, 2:])
    shared: FloatArray = np.prod(np.maximum(high - low, 0.0), axis=2).sum(axis=1)
    return shared


def _crossings(boxes: FloatArray, arrows: FloatArray) -> FloatArray:
    """Length of (a, 4) arrows inside each of (p, 4) boxes (Liang and Barsky's clipping)."""
    tails, steps = arrows[:, :2], arrows[:, 2:] - arrows[:, :2]
    # An arrow along an axis never meets the sides across it: a tiny step puts them at infinity.
    steps = np.where(np.abs(steps) < 1e-9, 1e-9, steps)
    low = (boxes[:, None, :2] - tails) / steps
    high = (boxes[:, None, :2] + boxes[:, None, 2:] - tails) / steps
    enter = np.maximum(np.minimum(low, high).max(axis=2), 0.0)
    leave = np.minimum(np.maximum(low, high).min(axis=2), 1.0)
    lengths = np.hypot(arrows[:, 2] - arrows[:, 0], arrows[:, 3] - arrows[:, 1])
    inside: FloatArray = (np.maximum(leave - enter, 0.0) * lengths).sum(axis=1)
    return inside
