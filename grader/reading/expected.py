"""What is expected of a figure: where its nodes lie, and how surely, as the hand's errors propagate.

The covariance of the nodes comes from the construction's own derivative with respect to every line
and length that a hand draws. Seeing one vector thus corrects what is expected of the next:
follow-through needs no rule of its own.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from grader.records import FloatArray
from reference.construction import Construction, evaluate
from reference.elements import Scaled
from reference.geometry import ComplexArray
from reference.mistakes import Drawing
from reference.outline import bars, coincident
from reference.steps import (
    ArcAndLine,
    Coincide,
    Divide,
    Given,
    Local,
    OnGuide,
    Similar,
    Step,
    Tangent,
    TwoArcs,
    TwoLines,
)

STEP_OF_DERIVATIVE = 1e-5


@dataclass(frozen=True, slots=True)
class Hand:
    """Standard errors of a hand that draws without much care."""

    angle_rad: float = float(np.radians(0.8))
    shift_mm: float = 0.35
    length_mm: float = 0.7
    relative: float = 0.02
    mark_mm: float = 0.15


@dataclass(frozen=True, slots=True)
class Edge:
    """A straight piece of a figure between two of its nodes, by their places in the figure's list."""

    name: str
    tail: int
    head: int
    drawn: bool = True
    """False for a helping line that nobody needs to draw (and whose absence costs nothing)."""


@dataclass(frozen=True, slots=True)
class Expected:
    """Nodes expected of one figure.

    Attributes
    ----------
    names : nodes in order
    at : (n,) complex mm; a plan about its own pole until it is placed
    cov : (2n, 2n) covariance, x and y of each node in turn
    edges : what should be drawn between them
    tied : pairs of nodes that lie in one place
    """

    names: tuple[str, ...]
    at: ComplexArray
    cov: FloatArray
    edges: tuple[Edge, ...]
    tied: tuple[tuple[int, int], ...] = ()

    def placed(self, at: complex, size: float, turn_rad: float, slack: "Slack") -> "Expected":
        """The same figure somewhere on the sheet, with the freedom left to it."""
        spin = size * np.exp(1j * turn_rad)
        moved = at + spin * self.at
        rotate = np.kron(np.eye(len(self.at)), np.array([[spin.real, -spin.imag], [spin.imag, spin.real]]))
        arm = moved - at
        free = np.column_stack(
            [
                _pairs(np.full(len(moved), slack.shift_mm + 0j)),
                _pairs(np.full(len(moved), slack.shift_mm * 1j)),
                _pairs(1j * slack.turn_rad * arm),
                _pairs(slack.relative * arm),
            ]
        )
        return replace(self, at=moved, cov=rotate @ self.cov @ rotate.T + free @ free.T)


@dataclass(frozen=True, slots=True)
class Slack:
    """How well a figure's place is known before its strokes are told apart."""

    shift_mm: float = 2.0
    turn_rad: float = float(np.radians(1.0))
    relative: float = 0.04


def expect(
    drawing: Drawing, figure: str, given: Mapping[str, ComplexArray], hand: Hand, edges: Iterable[Edge]
) -> Expected:
    """The nodes of one figure, given the nodes of others, with the covariance of a hand's errors."""
    construction, parameters = drawing.construction, drawing.parameters
    steps = construction.figures[figure]
    names = tuple(step.node for step in steps)
    nominal = evaluate(construction, parameters, given=given, wanted=names)
    sources = list(_sources(steps, nominal, hand))
    errors = {}
    for row, (key, _) in enumerate(sources):
        errors[key] = np.zeros(len(sources))
        errors[key][row] = STEP_OF_DERIVATIVE
    at = np.array([complex(np.ravel(nominal[name])[0]) for name in names])
    bent = evaluate(construction, parameters, given=given, errors=errors, wanted=names)
    with np.errstate(invalid="ignore"):
        moves = np.stack([np.broadcast_to(bent[name], len(sources)) for name in names]) - at[:, None]
    moves = np.where(np.isfinite(moves), moves, 0.0) / STEP_OF_DERIVATIVE
    moves = moves * np.array([sigma for _, sigma in sources])
    slopes = np.concatenate([_pairs(column)[:, None] for column in moves.T], axis=1) if sources else None
    cov = np.zeros((2 * len(names), 2 * len(names))) if slopes is None else slopes @ slopes.T
    under = coincident(construction)
    tied = tuple((names.index(one), names.index(under[one])) for one in names if one in under)
    return Expected(names, at, cov, tuple(edges), tied)


def _pairs(values: ComplexArray) -> FloatArray:
    """X and y in turn."""
    return np.column_stack([values.real, values.imag]).ravel()


def _sources(
    steps: Iterable[Step], nominal: Mapping[str, ComplexArray], hand: Hand
) -> Iterable[tuple[tuple[str, int, str], float]]:
    """Every error of the hand in these steps, with its standard error."""
    for step in steps:
        node = step.node
        if isinstance(step, Coincide):
            continue
        mark = hand.length_mm if isinstance(step, Similar) else hand.mark_mm
        yield (node, 0, "x"), mark
        yield (node, 0, "y"), mark
        match step:
            case Given():
                size = abs(complex(np.ravel(nominal[node])[0]) - complex(np.ravel(nominal[step.start])[0]))
                share = hand.relative if isinstance(step.length, Scaled) else 2.0 * hand.relative
                yield (node, 0, "length"), hand.length_mm + share * size
                yield (node, 0, "angle"), hand.angle_rad
                yield (node, 0, "shift"), hand.shift_mm
            case TwoLines():
                for slot in (0, 1):
                    yield (node, slot, "angle"), hand.angle_rad
                    yield (node, slot, "shift"), hand.shift_mm
            case TwoArcs():
                yield (node, 0, "length"), hand.length_mm
                yield (node, 1, "length"), hand.length_mm
            case ArcAndLine():
                yield (node, 0, "length"), hand.length_mm
                yield (node, 1, "angle"), hand.angle_rad
                yield (node, 1, "shift"), hand.shift_mm
            case Divide() | Tangent():
                yield (node, 0, "length"), hand.length_mm
            case Local() | OnGuide():
                yield (node, 0, "length"), hand.length_mm
                yield (node, 0, "angle"), hand.angle_rad
                yield (node, 0, "shift"), hand.shift_mm


# What is drawn between the nodes ------------------------------------------------------------------


def links_of(construction: Construction) -> tuple[Edge, ...]:
    """The links of a mechanism sketch: every bar that its steps lay between two joints."""
    steps = construction.figures["mechanism"]
    place = {step.node: index for index, step in enumerate(steps)}
    return tuple(Edge(f"{tail}{head}", place[tail], place[head]) for tail, head in bars(construction))


def vectors_of(construction: Construction, figure: str, absent: Iterable[str] = ()) -> tuple[Edge, ...]:
    """The vectors of a plan, without those at nodes that are not drawn."""
    steps = construction.figures[figure]
    place = {step.node: index for index, step in enumerate(steps)}
    gone = set(absent)
    return tuple(
        Edge(vector.name, place[vector.tail], place[vector.head])
        for vector in construction.vectors_of(figure)
        if not {vector.tail, vector.head} & gone and vector.tail in place
    )
