"""The order in which a student lays off the forces of a polygon, and at which end it begins.

The sides of a closed polygon form a ring: the forces of a chain, then those that close it. Whoever lays the
forces off in another order, or begins at the other end, draws the same sides as another ring.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

from reference.construction.elements import Line
from reference.construction.graph import Construction, Vector
from reference.construction.steps import Given, Step, TwoLines
from samples.simulation.settings import FORCES
from samples.simulation.strokes import Rng

Ends = tuple[str, str]
HABITS = ("usual", "mixed", "backwards", "parts first", "parts last")


def in_other_orders(construction: Construction, habit: str, rng: Rng) -> Construction:
    """The construction with every force polygon in an order of this student's own.

    Arguments: `habit` is ``usual``, ``mixed`` (given forces in any order), ``backwards`` (from the other
    link's part across), ``parts first`` or ``parts last``.
    """
    for figure in [name for name in construction.figures if name.startswith(FORCES)]:
        construction = _in_other_order(construction, figure, habit, rng)
    return construction


def _in_other_order(construction: Construction, figure: str, habit: str, rng: Rng) -> Construction:
    steps = construction.figures[figure]
    chain = [step for step in steps if isinstance(step, Given)]
    starts = [step.node for step in steps[: len(chain)]]
    if habit == "usual" or [step.start for step in chain] != starts or len(chain) < 2:
        return construction
    vectors = construction.vectors_of(figure)
    drawn = {(one.tail, one.head): one for one in vectors if not one.is_sum}
    parts = [step for step in chain if drawn[step.start, step.node].part == "t"]
    ways = [habit, "mixed", "usual"]
    for way in ways:
        mixed = [step for step in chain if step not in parts]
        if way != "usual":
            mixed = [mixed[index] for index in rng.permutation(len(mixed))]
        first = [step for step in parts if step is chain[0]]
        last = [step for step in parts if step is not chain[0]]
        match way:
            case "backwards":
                first, last = last, first
            case "parts first":
                first, last = [*first, *last], []
            case "parts last":
                first, last = [], [*first, *last]
        ordered = _ordered(construction, figure, [*first, *mixed, *last], backwards=way == "backwards")
        if ordered is not None:
            return ordered
    return construction


def _ordered(
    construction: Construction, figure: str, chain: Sequence[Given], *, backwards: bool
) -> Construction | None:
    """The polygon with its chain in this order; None if a vector that is needed later is no side then."""
    steps, pole = construction.figures[figure], construction.poles[figure]
    old = [step for step in steps if isinstance(step, Given)]
    end, closing = old[-1].node, steps[-1]
    names = [pole, *(step.node for step in old)]
    moved: list[Step] = [steps[0]]
    for index, step in enumerate(chain, start=1):
        moved.append(replace(step, node=names[index], start=names[index - 1]))
    ring: list[Ends] = [(step.start, step.node) for step in old]
    now: list[Ends] = [(step.start, step.node) for step in chain]
    if isinstance(closing, TwoLines):
        by_end, by_pole = closing.first, closing.second
        if backwards and isinstance(by_end, Line) and isinstance(by_pole, Line):
            by_end, by_pole = replace(by_pole, through=end), replace(by_end, through=pole)
        moved.append(TwoLines(closing.node, by_end, by_pole))
        closers = [(end, closing.node), (closing.node, pole)]
        ring += closers
        now += reversed(closers) if backwards else closers
    else:
        ring, now = [*ring, (end, pole)], [*now, (end, pole)]
    corners = [*names, closing.node] if isinstance(closing, TwoLines) else names
    ends: dict[Ends, Ends] = {}
    for vector in construction.vectors_of(figure):
        found = _side(vector, ring, now, corners)
        if found is not None:
            ends[vector.tail, vector.head] = found
    later = list(construction.figures)[list(construction.figures).index(figure) + 1 :]
    needs = {need for name in later for step in construction.figures[name] for need in step.needs}
    needs |= {need for one in construction.moments.values() for need in one.needs}
    for vector in construction.vectors_of(figure):
        if {vector.tail, vector.head} <= needs and (vector.tail, vector.head) not in ends:
            return None
    figures = {**construction.figures, figure: tuple(moved)}
    for name in later:
        figures[name] = tuple(_renamed(step, ends) for step in figures[name])
    own = {vector.name for vector in construction.vectors_of(figure)}
    vectors = {}
    for name, vector in construction.vectors.items():
        if name not in own:
            vectors[name] = vector
        elif (vector.tail, vector.head) in ends:
            tail, head = ends[vector.tail, vector.head]
            vectors[name] = replace(vector, tail=tail, head=head)
    moments = {name: _renamed(one, ends) for name, one in construction.moments.items()}
    return replace(construction, figures=figures, vectors=vectors, moments=moments)


def _side(vector: Vector, ring: list[Ends], now: list[Ends], corners: list[str]) -> Ends | None:
    """The corners between which a vector runs in the new ring; None if its sides do not adjoin there."""
    count = len(ring)
    begin, end = (corners.index(node) for node in (vector.tail, vector.head))
    sides = {ring[index % count] for index in range(begin, begin + (end - begin) % count)}
    inside = [side in sides for side in now]
    entries = [index for index in range(count) if inside[index] and not inside[index - 1]]
    if len(entries) != 1:
        return None
    return corners[entries[0]], corners[(entries[0] + len(sides)) % count]


def _renamed(part: Any, ends: Mapping[Ends, Ends]) -> Any:  # noqa: ANN401 - any part of a construction
    """The part with vectors by their new ends."""
    if isinstance(part, tuple):
        return tuple(_renamed(one, ends) for one in part)
    if not is_dataclass(part) or isinstance(part, type):
        return part
    changed = {field.name: _renamed(getattr(part, field.name), ends) for field in fields(part)}
    if (changed.get("tail"), changed.get("head")) in ends:
        changed["tail"], changed["head"] = ends[changed["tail"], changed["head"]]
    return replace(part, **changed)
