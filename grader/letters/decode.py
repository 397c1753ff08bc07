"""The likeliest texts of a line of writing among those that a scale's box may hold."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from grader.letters.alphabet import COLUMN, JUNK
from grader.letters.grammar import State, moves, start
from grader.letters.line import Lattice, Segment
from grader.records import FloatArray

_BEAM = 60
_SKIPPED = -2.0
"""A piece of ink taken for no sign: beside its own probability of being none."""
_MISPLACED = -4.0
_SMALL = 0.35
"""Of the line's height: lower is a point or a comma, no digit."""
_TALL = 0.6
_POINTS = frozenset(".'")
_FLAT = frozenset("-=:")
_LOW, _HIGH = 0.72, 0.35
"""Of the line's height from its top: middles below the first, above the second."""
_FOOT = 0.45
_CERTAIN = float(np.log(0.95))
_MERGED = -0.7
"""For each further piece of ink that a sign is taken to be made of."""


@dataclass(frozen=True, slots=True)
class Text:
    """A text that may be written, and the logarithm of its likelihood."""

    text: str
    log: float


def texts_of(lattice: Lattice, name: str) -> tuple[list[Text], float]:
    """Texts that the box of a scale may hold, likeliest first; and the log likelihood of signs at will.

    The second value is what the ink would be worth if any signs might stand in any order: a text that
    is much less likely than that was read into the ink.
    """
    line = _line(lattice)
    beams: list[dict[tuple[State, str], float]] = [{} for _ in range(lattice.count + 1)]
    beams[0][start(name), ""] = 0.0
    free = np.full(lattice.count + 1, -np.inf)
    free[0] = 0.0
    for piece in range(lattice.count):
        best = sorted(beams[piece].items(), key=lambda item: -item[1])[:_BEAM]
        for segment in lattice.starting(piece):
            told = _placed(segment, line) + _MERGED * (segment.last - piece - 1)
            skipped = segment.last == piece + 1
            alone = float(segment.log[COLUMN[JUNK]]) + _SKIPPED
            free[segment.last] = max(
                free[segment.last], free[piece] + float(told[: COLUMN[JUNK]].max()), free[piece] + alone
            )
            for (state, text), score in best:
                target = beams[segment.last]
                for move in moves(name, state):
                    _keep(target, (move.state, text + move.text), score + float(told[COLUMN[move.sign]]))
                if skipped:
                    _keep(target, (state, text), score + alone)
    ended: dict[str, float] = {}
    for (state, text), score in beams[-1].items():
        if state.is_end:
            ended[text] = max(score, ended.get(text, -np.inf))
    found = sorted((Text(text, score) for text, score in ended.items()), key=lambda one: -one.log)
    return found, float(free[-1])


def _keep(target: dict[tuple[State, str], float], key: tuple[State, str], score: float) -> None:
    if score > target.get(key, -np.inf):
        target[key] = score


def _line(lattice: Lattice) -> tuple[float, float, float]:
    """Height of the line's signs, and its top and bottom, px."""
    boxes = np.array([s.box for s in lattice.segments if s.last == s.first + 1], dtype=np.float64)
    if len(boxes) == 0:
        return 1.0, 0.0, 1.0
    high = float(np.quantile(boxes[:, 3], 0.75))
    tall = boxes[boxes[:, 3] > 0.5 * high]
    return high, float(np.median(tall[:, 1])), float(np.median(tall[:, 1] + tall[:, 3]))


def _placed(segment: Segment, line: tuple[float, float, float]) -> FloatArray:
    """(signs,) log probabilities with what size and place in the line say of each sign.

    Shapes alone do not tell a point from an o: a small mark at the foot of the line is a point or a
    comma, whatever it looks like.
    """
    high, top, bottom = line
    _, y, _, h = segment.box
    share = h / max(high, 1.0)
    middle = (y + h / 2.0 - top) / max(bottom - top, 1.0)
    found = segment.log.copy()
    if share < _FOOT and middle > _LOW:
        found[[COLUMN[sign] for sign in _POINTS]] = _CERTAIN
    for sign, column in _COLUMNS.items():
        if sign in _POINTS:
            found[column] += _MISPLACED * (float(share > _TALL) + float(middle < _HIGH))
        elif sign not in _FLAT and share < _SMALL:
            found[column] += _MISPLACED
    return found


_COLUMNS: Mapping[str, int] = {sign: column for sign, column in COLUMN.items() if sign}
