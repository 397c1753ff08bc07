"""Which way up: the title block is at the bottom right of an upright sheet; else as the file says."""

import numpy as np

from grader.records import FloatArray
from grader.sheet.fitting import apply, inverted
from grader.sheet.longlines import RIDGE, LongLine
from grader.sheet.models import PAGE_MM

_CORNER_MM = (215.0, 80.0)
_INSET_MM = 7.0
"""The frame's own bottom line, and the paper's edge, are no part of the block."""
_SQUARE_MM = 2.5
_LEAST_MM = 12.0
_LEAST_LEVEL = 2
_OTHERS = 0.8


def drawn_ends(lines: list[LongLine]) -> FloatArray:
    """(n, 2, 2) ends in pixels of the drawn lines among long lines."""
    return np.array([line.ends for line in lines if line.kind == RIDGE]).reshape(-1, 2, 2)


def title_block_mm(mm_to_px: FloatArray, drawn: FloatArray) -> float:
    """Length of ruled lines, mm, in the corner where an upright sheet has its title block.

    What the other corners have too (squared paper has it everywhere) does not count.
    """
    mm = apply(inverted(mm_to_px), drawn.reshape(-1, 2)).reshape(-1, 2, 2)
    page = np.array(PAGE_MM)
    own = _ruled_mm(mm)
    turned = (
        page - mm,
        np.stack([page[0] - mm[..., 0], mm[..., 1]], -1),
        np.stack([mm[..., 0], page[1] - mm[..., 1]], -1),
    )
    return max(0.0, own - _OTHERS * max(_ruled_mm(other) for other in turned))


def _ruled_mm(ends: FloatArray) -> float:
    """Length of level and upright lines in the bottom right corner, 0 for fewer than two level ones."""
    if len(ends) == 0:
        return 0.0
    span = np.abs(ends[:, 1] - ends[:, 0])
    low, high = ends.min(axis=1), ends.max(axis=1)
    level = span[:, 0] > span[:, 1]
    near = (low[:, 0] > PAGE_MM[0] - _CORNER_MM[0]) & (low[:, 1] > PAGE_MM[1] - _CORNER_MM[1])
    inner = (high[:, 0] < PAGE_MM[0]) & np.where(
        level, high[:, 1] < PAGE_MM[1] - _INSET_MM, high[:, 1] < PAGE_MM[1]
    )
    ruled = near & inner & (span.min(axis=1) < _SQUARE_MM) & (span.max(axis=1) > _LEAST_MM)
    if np.count_nonzero(ruled & level) < _LEAST_LEVEL:
        return 0.0
    return float(span[ruled].max(axis=1).sum())


def off_turn_deg(mm_to_px: FloatArray, turn_deg: int) -> float:
    """How far a map's upright is from the turn that the file asks for (EXIF, PDF), 0 to 180 degrees.

    Evidence where nothing drawn tells a half turn from none: people turn what they see upside down.
    """
    middle = np.array([PAGE_MM]) / 2.0
    right = (apply(mm_to_px, middle + np.array([10.0, 0.0])) - apply(mm_to_px, middle))[0]
    turned = np.degrees(np.arctan2(right[1], right[0])) - turn_deg
    return float(abs((turned + 180.0) % 360.0 - 180.0))
