"""Plans as a student measured them: drawn from the entered lengths and directions, without a scan.

Each vector starts at the end of the one before it, from the pole on, so that gaps are visible. A length
without a direction can only be drawn along the expected direction, if that may be shown.
"""

import cmath
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from grader.outcomes import Outcome
from grader.overlay.scene import (
    LEAST_ARROW_MM,
    XY,
    Arrow,
    Dot,
    Ghost,
    Picture,
    Scene,
    expected_vector,
    ghosts_of,
)
from grader.records import Reading, on_sheet
from reference.construction.graph import Construction, Vector
from reference.quantities import group_of

MARGIN_MM = 14.0
GAP_MM = 22.0


def measured_picture(
    source: str,
    reading: Reading,
    construction: Construction,
    outcomes: Mapping[str, Outcome],
    *,
    show_expected: bool,
) -> Picture | None:
    """Return the plans as measured; None if too little was entered to draw them.

    Arguments
    ---------
    reading : the entered lengths and directions
    outcomes : by vector name
    show_expected : whether expected vectors may be shown: as ghosts, and for missing directions
    """
    drawn = {}
    for figure, pole in construction.poles.items():
        if figure in reading.figures:
            plan = _plan(figure, pole, reading, construction, outcomes, show_expected=show_expected)
            if plan.arrows:
                drawn[figure] = plan
    if not drawn:
        return None
    return Picture(source, 1, b"", b"", _side_by_side(list(drawn.values())))


def _plan(
    figure: str,
    pole: str,
    reading: Reading,
    construction: Construction,
    outcomes: Mapping[str, Outcome],
    *,
    show_expected: bool,
) -> Scene:
    """Return one plan about its pole."""
    entered = reading.figures[figure].vectors
    expected = {name: expected_vector(outcomes.get(name)) for name in entered} if show_expected else {}
    steps: dict[str, complex] = {}
    for name, one in entered.items():
        if one.length_mm is None:
            continue
        direction = one.direction_deg
        along = expected.get(name)
        if one.length_mm < LEAST_ARROW_MM:
            steps[name] = 0j
        elif direction is not None:
            steps[name] = cmath.rect(one.length_mm, math.radians(direction))
        elif along:
            steps[name] = one.length_mm * along / abs(along)
    vectors = [vector for vector in construction.vectors_of(figure) if vector.name in steps]
    steps |= {vector.name: -steps[vector.name] for vector in vectors if vector.reversed}
    nodes, end = {pole: 0j}, pole
    _extend(nodes, vectors, steps)
    for step in construction.figures[figure] if group_of(figure) else ():
        if step.node not in nodes and any(vector.tail == step.node for vector in vectors):
            # Forces that were not entered come between: the chain goes on from where it ended.
            nodes[step.node] = nodes[end]
            _extend(nodes, vectors, steps)
        end = step.node if step.node in nodes else end
    arrows = tuple(_arrows(figure, vectors, steps, nodes, outcomes))
    ghosts = tuple(ghosts_of(arrows, outcomes)) if show_expected else ()
    dots = tuple(
        Dot(name, on_sheet(place), doubtful=False, lettered=not group_of(figure), figure=figure)
        for name, place in nodes.items()
    )
    return Scene((0.0, 0.0), arrows, ghosts, dots)


def _extend(nodes: dict[str, complex], vectors: list[Vector], steps: Mapping[str, complex]) -> None:
    """Add the nodes that the vectors lead to from known ones on."""
    for _ in vectors:
        for vector in vectors:
            if vector.tail in nodes and vector.head not in nodes:
                nodes[vector.head] = nodes[vector.tail] + steps[vector.name]


def _arrows(
    figure: str,
    vectors: list[Vector],
    steps: Mapping[str, complex],
    nodes: Mapping[str, complex],
    outcomes: Mapping[str, Outcome],
) -> Iterator[Arrow]:
    for vector in vectors:
        if vector.tail in nodes:
            first, outcome = nodes[vector.tail], outcomes.get(vector.name)
            verdict = "not_judged" if outcome is None else outcome.verdict
            ends = on_sheet(first), on_sheet(first + steps[vector.name])
            tail, tip = ends[::-1] if vector.reversed else ends
            yield Arrow(vector.name, figure, tail, tip, verdict, doubtful=verdict == "review")


def _side_by_side(plans: list[Scene]) -> Scene:
    """Place the plans beside each other on a page just large enough."""
    left, height = MARGIN_MM, 0.0
    arrows: list[Arrow] = []
    ghosts: list[Ghost] = []
    dots: list[Dot] = []
    for plan in plans:
        lines: list[Arrow | Ghost] = [*plan.arrows, *plan.ghosts]
        xs, ys = zip(*(point for line in lines for point in (line.tail, line.tip)), strict=True)
        by = (left - min(xs), MARGIN_MM - min(ys))
        arrows += [replace(a, tail=_by(a.tail, by), tip=_by(a.tip, by)) for a in plan.arrows]
        ghosts += [replace(g, tail=_by(g.tail, by), tip=_by(g.tip, by)) for g in plan.ghosts]
        dots += [replace(d, at=_by(d.at, by)) for d in plan.dots]
        left += max(xs) - min(xs) + GAP_MM
        height = max(height, max(ys) - min(ys))
    page = (left - GAP_MM + MARGIN_MM, height + 2 * MARGIN_MM)
    return Scene(page, tuple(arrows), tuple(ghosts), tuple(dots))


def _by(at: XY, by: XY) -> XY:
    return (at[0] + by[0], at[1] + by[1])
