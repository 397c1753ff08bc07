"""Which way up: the title block is at the bottom right, the binding margin on the left."""

import numpy as np

from grader.records import FloatArray
from grader.sheet.fitting import apply
from grader.sheet.longlines import RIDGE, LongLine
from grader.sheet.models import PAGE_MM

_BLOCK_MM = (200.0, 75.0)
_SQUARE_MM = 1.5
_LEAST_MM = 12.0


def title_block_mm(mm_to_px: FloatArray, lines: list[LongLine]) -> float:
    """Length of ruled lines, mm, in the corner where an upright sheet has its title block."""
    inverse = np.linalg.inv(mm_to_px)
    total = 0.0
    for line in lines:
        if line.kind != RIDGE:
            continue
        ends = apply(inverse, line.ends)
        span = np.abs(ends[1] - ends[0])
        low, high = ends.min(axis=0), ends.max(axis=0)
        inside = low[0] > PAGE_MM[0] - 10.0 - _BLOCK_MM[0] and low[1] > PAGE_MM[1] - 5.0 - _BLOCK_MM[1]
        inner = high[0] < PAGE_MM[0] and high[1] < PAGE_MM[1] - 7.0 or span[1] > span[0]
        if inside and inner and span.min() < _SQUARE_MM and span.max() > _LEAST_MM:
            total += float(span.max())
    return total
