"""Borders between bright and dark, followed at full resolution."""

import numpy as np

from grader.pixels import Flat
from grader.records import FloatArray

_STEP_PX = 0.5
_OVER = 4
"""Samples between which the change of brightness is taken: two pixels."""
_STRONG = 0.4


def edge_offsets(flat: Flat, ends: FloatArray, bright: float, cuts: int, reach_px: float) -> FloatArray:
    """(cuts,) how far across the line `ends` (2, 2) its edge lies, px along (-dy, dx); nan where none is.

    `bright` is +1 where the bright side is towards (-dy, dx), -1 where it is the other one.
    """
    span = ends[1] - ends[0]
    u = span / np.hypot(*span)
    across = np.arange(-reach_px, reach_px + _STEP_PX, _STEP_PX)
    share = (np.arange(cuts) + 0.5) / cuts
    at = ends[0] + share[:, None, None] * span + across[None, :, None] * np.array([-u[1], u[0]])
    level = flat.brightness(at[..., 0], at[..., 1]).astype(np.float64)
    rise = (level[:, _OVER:] - level[:, :-_OVER]) * bright
    places = across[_OVER // 2 : -_OVER // 2]
    strong = rise.max(axis=1)
    near = np.abs(np.arange(rise.shape[1]) - rise.argmax(axis=1)[:, None]) <= _OVER
    weight = np.clip(rise - 0.5 * strong[:, None], 0.0, None) * near
    offset = (weight * places).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-9)
    return np.where(strong > _STRONG * np.median(strong), offset, np.nan)


def bright_towards(ends: FloatArray, bright: int, *, across: bool) -> float:
    """The side that `edge_offsets` wants, of a line bright below or right (+1), above or left (-1)."""
    span = ends[1] - ends[0]
    towards = span[0] if across else -span[1]
    return float(bright * np.sign(towards))
