"""Tell at which ends of its forces the arrowheads of a force polygon stand."""

from collections.abc import Iterator

import numpy as np

from grader.reading.expected import Edge
from grader.reading.plans import PlanReading
from grader.records import InkMap

LEAST_MM = 12.0
"""Least length of a force whose arrowhead is looked for."""
BARB_MM, ASIDE_MM = (1.0, 3.4), 0.45
"""Places of an arrowhead's ink, along its force from the end and beside it."""
MIDDLE = 0.3, 0.7
"""Arrowheads in the middle of a force have their ink between these shares of its length."""
CLEAR_MM = 0.7
"""Another side of the polygon that comes nearer has its own ink there, or its arrowhead's."""
SPECK_MM2 = 1e-9
"""Least squared length of a side, so that it can be divided by."""
BACKWARDS = -0.6
"""A sum of more ink at heads than at tails, below which the arrowheads stand at the tails: of 232 polygons
read rightly one was below, and 77 would have been if turned round."""
Segment = tuple[complex, complex]


def points_backwards(plan: PlanReading, where: InkMap) -> bool:
    """Return whether the arrowheads of a force polygon stand at the tails of its forces.

    Sides in another order and the opposite sense leave the same lines. Two opposite forces in one line have
    an arrowhead at both ends in either sense.
    """
    sides = {edge: _ends(plan, edge) for edge in plan.assignment.expected.edges if not edge.optional}
    forward = 0.0
    for edge, (tail, head) in sides.items():
        if abs(head - tail) > LEAST_MM and not is_double(plan, edge):
            others = [ends for other, ends in sides.items() if other is not edge]
            for *both, middle in _beside(tail, head):
                is_clear = not any(_is_near(place, one) for place in both for one in others)
                if is_clear and where.share_inked(*middle, 0) == 0.0:
                    at_head, at_tail = (where.share_inked(*place, 0) for place in both)
                    forward += at_head - at_tail
    return forward < BACKWARDS


def is_double(plan: PlanReading, edge: Edge) -> bool:
    """Return whether another vector, an opposite force, has the same two ends."""
    edges = plan.assignment.expected.edges
    return sum({one.tail, one.head} == {edge.tail, edge.head} for one in edges) > 1


def _ends(plan: PlanReading, edge: Edge) -> Segment:
    return complex(plan.fit.at[edge.tail]), complex(plan.fit.at[edge.head])


def _beside(tail: complex, head: complex) -> Iterator[tuple[Segment, Segment, Segment]]:
    """Yield for each side of a force the segments beside its head, its tail and its middle."""
    out = (head - tail) / abs(head - tail)
    near, far = (along * out for along in BARB_MM)
    first, last = (tail + share * (head - tail) for share in MIDDLE)
    for aside in (ASIDE_MM * 1j * out, -ASIDE_MM * 1j * out):
        yield (
            (head - near + aside, head - far + aside),
            (tail + near + aside, tail + far + aside),
            (first + aside, last + aside),
        )


def _is_near(place: Segment, side: Segment) -> bool:
    """Return whether the middle half of a segment comes near another side of the polygon."""
    span, along = side[1] - side[0], np.array((0.25, 0.5, 0.75))
    from_tail = place[0] + along * (place[1] - place[0]) - side[0]
    share = np.clip((from_tail * np.conj(span)).real / max(abs(span) ** 2, SPECK_MM2), 0.0, 1.0)
    return bool((np.abs(from_tail - share * span) < CLEAR_MM).any())
