"""Which variant a drawing looks like: its strokes held against the exact figures of every variant.

A figure is laid on the strokes by an anchor, one of its longest lines: each stroke of about its
direction and length proposes a place and a scale. What the figure's lines then match is its likeness.
It is a suggestion for a person and no reading: students who made mistakes look less like themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grader.records import FloatArray
from reference.assignment import Assignment, Variant
from reference.construction import Construction, evaluate
from reference.derivation import construction_of
from reference.outline import bars
from reference.parameters import parameters_of

_ANCHOR_OFF_RAD = np.radians(2.5)
_SCALES = (0.4, 1.6)
"""Drawn size over the one that the assignment proposes."""
_LEAST_ANCHOR_MM = 15.0
_LEAST_LINE_MM = 8.0
"""Shorter lines are found anywhere."""
_OFF_MM = 0.6
"""Of a line's ends, across: a usual hand."""
_COVERED = 0.6
_AMISS = 0.5
"""What a line without a stroke takes off, as a share of what one with a stroke adds."""
_ANCHORS = 4
_TRIED = 24
"""Strokes tried as the anchor, those nearest in direction."""


@dataclass(frozen=True, slots=True)
class _Outline:
    """The lines of one figure, in drawn mm at the proposed scales, y up; arrays over variants.

    Attributes
    ----------
    tails, heads : (lines, variants)
    """

    tails: FloatArray
    heads: FloatArray


def likeness(ends_mm: FloatArray, assignment: Assignment, variants: Sequence[Variant]) -> FloatArray:
    """How much a sheet's strokes look like each variant's figures.

    Arguments: `ends_mm` (n, 2, 2) strokes in sheet millimetres, y down. Returns (variants,), the
    length of lines that lie on strokes less half of that of lines that do not, mm, summed over the
    figures: what a dead point's few lines match counts less than a whole plan.
    """
    strokes = ends_mm[..., 0] - 1j * ends_mm[..., 1]
    strokes = strokes[np.abs(strokes[:, 1] - strokes[:, 0]) >= _LEAST_LINE_MM]
    outlines = _outlines(assignment, list(variants))
    if not len(strokes) or not len(variants):
        return np.zeros(len(variants))
    found = [
        [_most_matched(outline, index, strokes) for outline in outlines] for index in range(len(variants))
    ]
    return np.asarray(np.sum(found, axis=1))


def _outlines(assignment: Assignment, variants: list[Variant]) -> list[_Outline]:
    mechanism, scales = assignment.mechanism(variants), assignment.scales(variants)
    construction = construction_of(
        mechanism, plate_by_similarity=assignment.file.plate_images == "similarity"
    )
    nodes = evaluate(construction, parameters_of(mechanism, scales.kL, scales.kv, scales.ka))
    shape = (len(variants),)
    found = []
    for pairs in _pairs(construction):
        ends = [[np.broadcast_to(nodes[name], shape) for name in pair] for pair in pairs]
        found.append(_Outline(np.array([pair[0] for pair in ends]), np.array([pair[1] for pair in ends])))
    return found


def _pairs(construction: Construction) -> list[list[tuple[str, str]]]:
    """The lines of each figure by their ends."""
    plans = [
        [(vector.tail, vector.head) for vector in construction.vectors_of(plan)]
        for plan in construction.poles
    ]
    return [list(bars(construction)), *plans]


def _most_matched(outline: _Outline, variant: int, strokes: FloatArray) -> float:
    """What the figure's lines match in the best of all places that its anchors propose; 0 at least."""
    tails, heads = outline.tails[:, variant], outline.heads[:, variant]
    size = np.abs(heads - tails)
    if not np.isfinite(size).all():
        return 0.0
    judged = size >= _LEAST_LINE_MM
    best = 0.0
    for anchor in np.argsort(-size)[:_ANCHORS]:
        placed = _proposed(heads[anchor] - tails[anchor], strokes)
        if size[anchor] < _LEAST_LINE_MM or not len(placed):
            continue
        begin, scale = placed[:, :1], placed[:, 1:].real
        # One row per place, one column per line.
        tail = begin + scale * (tails[judged] - tails[anchor])
        head = begin + scale * (heads[judged] - tails[anchor])
        good = _on_strokes(tail, head, strokes)
        net = (good - _AMISS * (1.0 - good)) @ size[judged]
        best = max(best, float(net.max()))
    return best


def _proposed(anchor: complex, strokes: FloatArray) -> FloatArray:
    """(places, 2) where the anchor begins, and its scale, for strokes of about its direction and length."""
    run = strokes[:, 1] - strokes[:, 0]
    off = np.abs(np.angle((run / anchor) ** 2)) / 2.0
    scale = np.abs(run) / abs(anchor)
    fit = (
        (off < _ANCHOR_OFF_RAD)
        & (scale > _SCALES[0])
        & (scale < _SCALES[1])
        & (np.abs(run) >= _LEAST_ANCHOR_MM)
    )
    chosen = np.flatnonzero(fit)
    chosen = chosen[np.argsort(off[chosen])][:_TRIED]
    forward = (run[chosen] / anchor).real > 0
    begin = np.where(forward, strokes[chosen, 0], strokes[chosen, 1])
    return np.stack([begin, scale[chosen].astype(np.complex128)], axis=1)


def _on_strokes(tail: FloatArray, head: FloatArray, strokes: FloatArray) -> FloatArray:
    """(places, lines) how well the best stroke lies under each line, 0..1."""
    start, run = strokes[:, 0], strokes[:, 1] - strokes[:, 0]
    length = np.abs(run)
    along = run / length
    # Both ends of a line in each stroke's own axes: along it, and across.
    p = (tail[..., None] - start) * np.conj(along)
    q = (head[..., None] - start) * np.conj(along)
    across = np.maximum(np.abs(p.imag), np.abs(q.imag))
    low, high = np.minimum(p.real, q.real), np.maximum(p.real, q.real)
    covered = np.minimum(high, length) - np.maximum(low, 0.0)
    good = np.exp(-0.5 * (across / (2.0 * _OFF_MM)) ** 2)
    return np.asarray(np.where(covered >= _COVERED * (high - low), good, 0.0).max(axis=-1))
