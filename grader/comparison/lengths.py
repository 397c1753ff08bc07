"""Nodes that measured vectors lead to, with directions or from their lengths alone.

Two lengths from nodes that are known meet in two points, one length and the right direction in one.
Which of two it is, the lengths that follow tell: all accounts are drawn at once, as branches, and
the one that fits the rest best counts. A node is not known where its lengths do not determine it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeGuard

import numpy as np

from grader.comparison.evidence import DrawnVector, Evidence
from grader.comparison.sketches import Sketch
from grader.comparison.task import Task
from reference.construction import Vector
from reference.elements import Coriolis, Normal, View
from reference.geometry import ComplexArray, FloatArray
from reference.hand import Own
from reference.steps import Given, Step

LEAST_SINE = 0.2
"""Of the angle at which two lengths meet: of a flatter triangle only its line tells where the corner is."""
MISS_MM = 3.0
"""By so much two lengths may fail to reach each other, by the hand's and the ruler's errors."""
BRANCHES = 32
WITHIN = 26.0
"""Accounts dearer than the cheapest by more than two surprises are dropped."""
UNKNOWN = 1.0
"""What it costs to take a node as not known."""
AS_EXPECTED = 3.0
"""Standard deviations within which a node is taken to lie where its step puts it."""
OFF = 12.0
"""What a node costs that lies elsewhere, and one that lies the other way round from its start."""
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


@dataclass(frozen=True, slots=True)
class _Seen:
    """A measured vector that ends in a node."""

    vector: Vector
    drawn: DrawnVector


def nodes_from_lengths(task: Task, evidence: Evidence, sketch: Sketch) -> dict[str, Own]:
    """The nodes that measured vectors determine, with the errors of measuring them."""
    tracking = _Tracking(task, evidence.measured)
    view = View(tracking.nodes, sketch.parameters)
    poles = task.construction.poles.values()
    with np.errstate(all="ignore"):
        for step in sketch.construction.steps:
            seen = tracking.seen.get(step.node, [])
            made = np.asarray(step.place(view)) + np.zeros(len(tracking.cost))
            if seen:
                tracking.settle(step, made, seen)
            elif _is_component(step) and step.node not in poles:
                tracking.part(step.node, [tracking.nodes[step.start]], made, [], [])
            else:
                tracking.nodes[step.node] = made
    return tracking.best()


@dataclass(slots=True)
class _Tracking:
    """All accounts so far: arrays of shape (branches,)."""

    task: Task
    measured: Mapping[str, DrawnVector]
    seen: dict[str, list[_Seen]] = field(default_factory=dict)
    nodes: dict[str, ComplexArray] = field(default_factory=dict)
    cost: FloatArray = field(default_factory=lambda: np.zeros(1))
    sources: dict[str, Sequence[_Seen]] = field(default_factory=dict)
    is_known: dict[str, BoolArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        vectors = self.task.construction.vectors
        for name, drawn in self.measured.items():
            if name in vectors:
                self.seen.setdefault(vectors[name].head, []).append(_Seen(vectors[name], drawn))

    @property
    def sigma_mm(self) -> float:
        """How far a node may be off by the hand and the ruler, roughly: half the tolerance."""
        return self.task.rubric.tolerance.length_mm / 2.0

    def settle(self, step: Step, made: ComplexArray, seen: Sequence[_Seen]) -> None:
        """Where a node lies in each account; accounts part where its lengths admit two places."""
        directed = next((one for one in seen if one.drawn.direction_rad is not None), None)
        if directed is not None:
            self.nodes[step.node] = self.nodes[directed.vector.tail] + (directed.drawn.as_complex or 0j)
            self.is_known[step.node] = np.ones(len(self.cost), np.bool_)
            self.sources[step.node] = [directed]
        elif len(seen) == 1:
            self.part(step.node, self._along(step, made, seen[0]), made, seen, seen)
        else:
            pair, places = self._meeting(seen)
            self.part(step.node, places, made, pair, seen)

    def _along(self, step: Step, made: ComplexArray, one: _Seen) -> list[ComplexArray]:
        """By one length along the direction of the step; normal components the other way round too."""
        start = self.nodes[one.vector.tail]
        reach = made - start
        along = np.where(np.abs(reach) > 1e-9, reach / np.abs(reach), np.nan)
        senses = (1.0, -1.0) if isinstance(step, Given) else (1.0,)
        return [start + sense * one.drawn.length_mm * along for sense in senses]

    def _meeting(self, seen: Sequence[_Seen]) -> tuple[Sequence[_Seen], list[ComplexArray]]:
        """The two points where the two lengths meet that cross at the best angle."""
        pairs = [(one, other) for index, one in enumerate(seen) for other in seen[:index]]
        crossings = [_crossing(self.nodes, pair) for pair in pairs]
        best = max(range(len(pairs)), key=lambda index: float(np.nan_to_num(crossings[index][2]).min()))
        first, second, _ = crossings[best]
        return pairs[best], [first, second]

    def part(
        self,
        node: str,
        places: Sequence[ComplexArray],
        made: ComplexArray,
        sources: Sequence[_Seen],
        seen: Sequence[_Seen],
    ) -> None:
        """Go on with each place, and where none is as expected, with the node where its step puts it."""
        count, ways = len(self.cost), len(places) + 1
        every, index = np.concatenate([*places, made]), np.tile(np.arange(count), ways)
        is_known = np.arange(len(index)) < count * len(places)
        off = np.abs(every - made[index]) / self.sigma_mm
        is_expected = off <= AS_EXPECTED
        total = self.cost[index] + np.where(is_expected, off**2, OFF) + np.where(is_known, 0.0, UNKNOWN)
        for one in seen:
            length = np.abs(every - self.nodes[one.vector.tail][index])
            total += np.minimum(((length - one.drawn.length_mm) / self.sigma_mm) ** 2, OFF)
        found = np.asarray((is_expected & is_known).reshape(ways, count).any(axis=0))
        total = np.where(np.isfinite(total) & (is_known | ~found[index]), total, np.inf)
        order = np.argsort(total, kind="stable")[:BRANCHES]
        order = order[(total[order] < total[order[0]] + WITHIN) | (np.arange(len(order)) == 0)]
        self.take(index[order])
        self.cost, self.nodes[node] = total[order], every[order]
        self.is_known[node], self.sources[node] = is_known[order], sources

    def take(self, index: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> None:
        """Only these accounts, in this order."""
        for name, places in self.nodes.items():
            self.nodes[name] = places[index]
        for name, flags in self.is_known.items():
            self.is_known[name] = flags[index]

    def best(self) -> dict[str, Own]:
        """The nodes of the cheapest account that are known in it."""
        columns = {name: 2 * index for index, name in enumerate(self.measured)}
        found: dict[str, Own] = {}
        moved: dict[str, ComplexArray] = {
            pole: np.zeros(2 * len(columns), np.complex128) for pole in self.task.construction.poles.values()
        }
        for name, sources in self.sources.items():
            place = complex(self.nodes[name][0])
            if self.is_known[name][0] and all(one.vector.tail in moved for one in sources):
                moved[name] = self._moved(place, sources, columns, moved)
                found[name] = Own(place, moved[name])
        return found

    def _moved(
        self,
        place: complex,
        sources: Sequence[_Seen],
        columns: Mapping[str, int],
        moved: Mapping[str, ComplexArray],
    ) -> ComplexArray:
        """What one standard deviation of each measurement makes of a node."""
        hand = self.task.rubric.hand
        rows = []
        for one in sources:
            reach = place - complex(self.nodes[one.vector.tail][0])
            along = reach / abs(reach) if abs(reach) > 0.0 else 1.0 + 0j
            row = np.array(moved[one.vector.tail])
            column = columns[one.vector.name]
            row[column] += hand.ruler_mm * along
            rows.append((along, row, column, reach))
        if not rows:
            return np.zeros(2 * len(columns), np.complex128)
        if len(rows) == 1:
            along, row, column, reach = rows[0]
            # Across, its direction's error: measured, or the hand's in drawing it.
            deg = hand.protractor_deg if sources[0].drawn.direction_rad is not None else hand.angle_deg
            row[column + 1] += 1j * reach * math.radians(deg)
            return row
        (u, first, _, p), (v, second, column, q) = rows
        # |x - p| and |x - q| are given: u.dx = u.dp + dr, v.dx = v.dq + ds.
        r, s = (first * np.conj(u)).real, (second * np.conj(v)).real
        cross = (np.conj(u) * v).imag
        if abs(cross) >= LEAST_SINE:
            return np.asarray((1j * (u * s - v * r)) / cross)
        apart = max(abs(p - q), 1e-9)
        across = 1j * u * math.sqrt(2.0 * hand.ruler_mm * abs(p) * abs(q) / apart)
        row = np.asarray(u * r)
        row[column + 1] += across
        return row


def _is_component(step: Step) -> TypeGuard[Given]:
    """Whether a step lays off a normal or Coriolis component: it may be missing, or reversed."""
    return isinstance(step, Given) and isinstance(step.length, Normal | Coriolis)


def _crossing(
    nodes: Mapping[str, ComplexArray], pair: tuple[_Seen, _Seen]
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Both points at two distances from two nodes, and the sine of the angle between them there.

    A flat triangle's are one, on the line; two lengths that do not reach each other have none.
    """
    (p, r), (q, s) = ((nodes[one.vector.tail], one.drawn.length_mm) for one in pair)
    base = q - p
    distance = np.abs(base)
    along = 0.5 + 0.5 * (r - s) * (r + s) / distance**2
    across2 = (r / distance) ** 2 - along**2
    across = np.sqrt(np.maximum(across2, 0.0))
    sine = across * distance**2 / (r * s) if r and s else 0.0 * across
    is_flat = sine < LEAST_SINE
    misses_mm = np.maximum(np.maximum(distance - r - s, np.abs(r - s) - distance), 0.0)
    across = np.where(is_flat, 0.0, across)
    base = np.where(misses_mm > MISS_MM, np.nan, base)
    return p + base * (along + 1j * across), p + base * (along - 1j * across), sine
