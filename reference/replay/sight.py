"""What was seen of one node, and how well places for it agree with that."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from reference.construction import Construction
from reference.geometry import ComplexArray, FloatArray
from reference.replay.costs import ANYWHERE, SOMETHING_ELSE

STIFFNESS = 1e-3
"""How little a node is held to where its step puts it, against what was seen of it."""
TINY = 1e-6
"""Millimetres; a shorter vector has no direction."""
SETTLING = 2
"""Steps in which a node is moved to the lengths seen of it."""

Spread = tuple[float, float, float]
"""mm^2: variance along x, covariance, variance along y."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A node, or a vector that ends in it, as drawn.

    Attributes
    ----------
    node : where it ends
    tail : the node from which it is seen; None for a place about the figure's origin
    value : complex millimetres, or a length where it has no direction
    spread : how far it may be missed; of what has a direction by its reading alone, the hand's own errors
        come to it
    """

    node: str
    tail: str | None
    value: complex
    spread: Spread
    has_direction: bool = True


@dataclass(frozen=True, slots=True)
class Work:
    """What somebody drew.

    Attributes
    ----------
    seen : its nodes and vectors
    sketches : by plan, the mechanism's joints as drawn beside it, where that is a sketch of its own
    """

    seen: tuple[Seen, ...]
    sketches: Mapping[str, Mapping[str, complex]] = field(default_factory=dict)


def by_node(construction: Construction, seen: Iterable[Seen]) -> dict[str, tuple[Seen, ...]]:
    """What was seen, by the end that is made later; vectors seen the other way round are turned."""
    order = {step.node: index for index, step in enumerate(construction.steps)}
    found: dict[str, tuple[Seen, ...]] = {}
    for one in seen:
        if one.tail is not None and order[one.tail] > order[one.node]:
            value = -one.value if one.has_direction else one.value
            one = replace(one, node=one.tail, tail=one.node, value=value)  # noqa: PLW2901 - the same vector
        found[one.node] = (*found.get(one.node, ()), one)
    return found


def seen_later(construction: Construction, seen: Mapping[str, tuple[Seen, ...]]) -> frozenset[str]:
    """The nodes that were seen, or that something seen is made from or reckoned from, rightly or wrongly."""
    wanted = set(seen) | {one.tail for ones in seen.values() for one in ones if one.tail is not None}
    # A wrong line may be taken by any link, and through a pole.
    wanted.update(step.node for step in construction.figures["mechanism"])
    wanted.update(construction.poles.values())
    for step in reversed(construction.steps):
        if step.node in wanted:
            wanted.update(step.needs)
    return frozenset(wanted)


@dataclass(frozen=True, slots=True)
class Sight:
    """What was seen of one node. Arrays of places end in the branches' axis.

    Attributes
    ----------
    turned : (branches,) factor by which its plan is turned as a whole, None where in no branch
    care : (branches,) how many times a usual hand's standard deviations
    """

    seen: tuple[Seen, ...]
    turned: ComplexArray | None
    care: FloatArray

    def __bool__(self) -> bool:
        return bool(self.seen)

    def value(self, one: Seen) -> ComplexArray | complex:
        """As it would stand in a plan that is not turned."""
        if self.turned is None or not one.has_direction:
            return one.value
        return np.asarray(one.value / self.turned)

    @property
    def tells_place(self) -> bool:
        """Whether what was seen leaves the node only one place."""
        return any(one.has_direction for one in self.seen)

    @property
    def freedom(self) -> int:
        """How many numbers were seen."""
        return sum(2 if one.has_direction else 1 for one in self.seen)

    @property
    def anywhere(self) -> float:
        """What any place at all costs."""
        return SOMETHING_ELSE + ANYWHERE * min(self.freedom, 2)

    def held_against(
        self, place: ComplexArray, moved: ComplexArray | None, nodes: Mapping[str, ComplexArray]
    ) -> tuple[FloatArray, FloatArray]:
        """The squared misfit of places in standard deviations, infinite where there is none, and its cost.

        The cost is -2 log of the density of what was seen, millimetres: wide errors make each place rarer.

        Arguments: `place` (ways, branches); `moved` (ways, acts, branches) is how far the acts of a usual
        hand move it.
        """
        misfit, width = np.zeros(place.shape), np.zeros(place.shape)
        for one in self.seen:
            vector = place if one.tail is None else place - nodes[one.tail]
            if one.has_direction:
                squared, variance = _off(self.value(one) - vector, one.spread, moved)
            else:
                squared, variance = _off_length(abs(one.value), vector, one.spread)
            misfit += squared
            width += np.log(variance)
        misfit /= self.care**2
        whole = misfit + width + self.freedom * np.log(math.tau * self.care**2)
        is_there = np.isfinite(whole)
        return np.where(is_there, misfit, np.inf), np.where(is_there, whole, np.inf)

    def settled(self, place: ComplexArray, nodes: Mapping[str, ComplexArray]) -> ComplexArray:
        """Places moved to what was seen, by as little as possible where that leaves it open."""
        first = self.seen[0]
        if first.has_direction:
            tail = 0.0 if first.tail is None else nodes[first.tail]
            return np.broadcast_to(tail + self.value(first), place.shape)
        for _ in range(SETTLING):
            moved = place + self._shift(place, nodes)
            place = np.where(np.isfinite(moved), moved, place)
        return place

    def _shift(self, place: ComplexArray, nodes: Mapping[str, ComplexArray]) -> ComplexArray:
        """A Gauss-Newton step towards the lengths seen."""
        tails = [one.tail for one in self.seen]
        vectors = np.array([place if tail is None else place - nodes[tail] for tail in tails])
        lengths = np.abs(vectors)
        is_long = lengths > TINY
        along = np.where(is_long, vectors / np.maximum(lengths, TINY), 0.0)
        wanted = np.array([abs(one.value) for one in self.seen])[:, None]
        pull = (along * (wanted - lengths)).sum(axis=0)
        x, y = along.real, along.imag
        xx, yy, xy = (x * x).sum(axis=0) + STIFFNESS, (y * y).sum(axis=0) + STIFFNESS, (x * y).sum(axis=0)
        x, y = pull.real, pull.imag
        return np.asarray(((yy * x - xy * y) + 1j * (xx * y - xy * x)) / (xx * yy - xy**2))


def _off(off: ComplexArray, spread: Spread, moved: ComplexArray | None) -> tuple[FloatArray, FloatArray]:
    """Deviations squared, in standard deviations, and the determinants of their covariances."""
    x, y = off.real, off.imag
    xx, xy, yy = (np.asarray(one) for one in spread)
    if moved is not None:
        across, up = moved.real, moved.imag
        xx = xx + np.einsum("kah,kah->kh", across, across)
        xy = xy + np.einsum("kah,kah->kh", across, up)
        yy = yy + np.einsum("kah,kah->kh", up, up)
    determinant = xx * yy - xy * xy
    return np.asarray((yy * x * x - 2.0 * xy * x * y + xx * y * y) / determinant), np.asarray(determinant)


def _off_length(seen_mm: float, vector: ComplexArray, spread: Spread) -> tuple[FloatArray, FloatArray]:
    """Deviations of lengths squared, in standard deviations, and their variances."""
    length, x, y = np.abs(vector), vector.real, vector.imag
    xx, xy, yy = spread
    along = (xx * x * x + 2.0 * xy * x * y + yy * y * y) / np.maximum(length, TINY) ** 2
    variance = np.where(length > TINY, along, xx + yy)
    return np.asarray((seen_mm - length) ** 2 / variance), variance
