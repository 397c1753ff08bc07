"""The mechanism sketch at the scale kL, and the vector polygons of the plans."""

from collections.abc import Iterator, Sequence

import numpy as np

from reference.construction.elements import Line, View
from reference.construction.graph import Vector
from reference.construction.steps import Given, Step, TwoLines
from reference.drawing import symbols
from reference.drawing.canvas import CONSTRUCTION, INK, Area, Curve, Label, Shape, Stroke, Text, pieces_of
from reference.drawing.labels import Style, Wanted, lengths_inside, letters, names_of_vectors, segments_of
from reference.drawing.subject import PLAN_COLOURS, DrawnFigure, Part, Subject
from reference.drawing.symbols import HAIR_MM, LINK_MM, THIN_MM, Bar, bars, blocks, point, unit
from reference.drawing.triangles import altitudes
from reference.geometry import FloatArray
from reference.mechanism import (
    Crank,
    DrivingSlider,
    Mechanism,
    Plate,
    PointOnLine,
    SlotPoint,
    Triad,
    members,
    slotted_links,
)
from reference.quantities import group_of, sort_of

LETTER_MM, SMALL_LETTER_MM = 4.2, 3.2
LINK_NUMBER_MM = 3.0
PLATE_FILL = "#eef1f4"
CAPTION_GAP_MM, CAPTION_MM = 6.0, 3.5


def sketch(subject: Subject) -> DrawnFigure:
    """Return the mechanism of one variant, with its title and scale."""
    return captioned(subject, "mechanism", scheme(subject).parts, INK)


def scheme(subject: Subject) -> DrawnFigure:
    """Return the mechanism of one variant: links, joints, guides, their names, the driving arrow."""
    nodes = subject.nodes("mechanism")
    thin = altitudes(subject, nodes)
    layers = (_plates(subject, nodes), thin.lines, *_layers(subject, nodes), thin.vectors)
    drawn = [part for layer in layers for part in layer]
    style = Style(LETTER_MM, SMALL_LETTER_MM, INK, symbols.JOINT_RADIUS_MM)
    others = [*_link_numbers(subject, nodes), *drive_letter(subject, nodes), *thin.letters]
    named = letters(subject, nodes, [part.shape for part in drawn], style, others)
    return DrawnFigure("mechanism", (*drawn, *named))


def captioned(
    subject: Subject, name: str, parts: tuple[Part, ...], colour: str, text: Text = ""
) -> DrawnFigure:
    """Return a figure with its title and scale, or another text, above it."""
    left, top, _right, _bottom = DrawnFigure(name, parts).bounds
    caption = Label((left, top - CAPTION_GAP_MM), text or subject.caption(name), CAPTION_MM, colour=colour)
    return DrawnFigure(name, (*parts, Part("", caption)))


def _layers(subject: Subject, nodes: dict[str, complex]) -> Iterator[Iterator[Part]]:
    """Yield the layers over plates and thin lines, the lowest first."""
    driver = subject.plan.mechanism.driver.pin
    yield _guides(subject, nodes)
    yield (
        Part(bar.node, Stroke(point(bar.ends[0]), point(bar.ends[1]), LINK_MM))
        for bar in bars(subject, nodes)
    )
    yield (Part(block.node, symbols.block(block.at, block.along)) for block in blocks(subject, nodes))
    yield _grounds(subject, nodes)
    yield _joints(subject, nodes)
    yield (Part(driver, shape) for shape in drive_arrow(subject, nodes))


def _plates(subject: Subject, nodes: dict[str, complex]) -> Iterator[Part]:
    for group in subject.plan.mechanism.groups:
        if isinstance(group, Plate | Triad):
            joints = (*group.base, group.node) if isinstance(group, Plate) else group.corners
            yield Part(group.node, Area(tuple(point(nodes[joint]) for joint in joints), PLATE_FILL))
        if isinstance(group, Triad):
            crossing = subject.plan.construction.step(group.assur_point)
            lines = construction_lines(crossing, subject.view, nodes)
            yield from (Part(group.assur_point, line) for line in lines)


# Guides and grounds --------------------------------------------------------------------------------

GUIDE_REACH_MM, NEAR_GUIDE_MM = 13.0, 7.0
AXIS_REACH_MM = 18.0
SHORTEST_GUIDE_MM, ROD_CLEAR_MM = 7.0, 1.0
"""A guide stops this far from the rod; if that leaves it shorter, it lies on the block's other side."""
SUPPORTS = (-1j, 1j, -1.0 + 0j, 1.0 + 0j)
"""Possible directions of a pivot's ground, the best first."""
SUPPORT_CLEAR_COSINE = 0.62
"""Largest cosine of the angle between a link and the ground of its pivot."""


def _guides(subject: Subject, nodes: dict[str, complex]) -> Iterator[Part]:
    """Draw ground below a block, or away from a rod that comes from there; and the line of its motion."""
    for block in blocks(subject, nodes):
        if not block.grounded:
            continue
        at, along = block.at, block.along
        below = 1 if along.real < 0.0 else -1
        rod = complex(np.conj(along) * block.rod)
        side = below if _before_rod(rod, below) >= SHORTEST_GUIDE_MM else -below
        behind, ahead = (
            min(
                _guide_length(at, sign * along, nodes),
                _before_rod(rod, side) if rod.real * sign > 0.0 else np.inf,
            )
            for sign in (-1, 1)
        )
        for shape in symbols.guide(at, along, side, (behind, ahead)):
            yield Part(block.node, shape)
        yield Part(block.node, symbols.axis(at - along * AXIS_REACH_MM, at + along * AXIS_REACH_MM))


def _before_rod(rod: complex, side: int) -> float:
    """Return how far the ground on one side may extend before the rod (in the guide's axes) crosses it."""
    if rod.imag * side <= 0.0:
        return float("inf")
    return (symbols.BLOCK_MM[1] - ROD_CLEAR_MM) * abs(rod.real / rod.imag)


def _guide_length(at: complex, along: complex, nodes: dict[str, complex]) -> float:
    """Return the length of a guide, which stops short of a joint near its line."""
    reach = GUIDE_REACH_MM
    for place in nodes.values():
        away = np.conj(along) * (place - at)
        if abs(away.imag) < NEAR_GUIDE_MM and away.real > 1.0:
            reach = min(reach, max(float(away.real) - NEAR_GUIDE_MM + 0.5, symbols.BLOCK_MM[0] + 1.0))
    return reach


def _grounds(subject: Subject, nodes: dict[str, complex]) -> Iterator[Part]:
    links = bars(subject, nodes)
    for joint in subject.plan.mechanism.ground_m:
        away = support_direction(nodes[joint], [bar.ends for bar in links if joint in bar.joints])
        for shape in symbols.pivot(nodes[joint], away):
            yield Part(joint, shape)


def support_direction(at: complex, links: Sequence[tuple[complex, complex]]) -> complex:
    """Return the direction of a pivot's ground: below, unless a link goes there."""
    towards = [end - at for ends in links for end in ends if abs(end - at) > 0.0]
    if not towards:
        return SUPPORTS[0]

    def nearest(support: complex) -> float:
        return max(float((np.conj(support) * link).real) / abs(link) for link in towards)

    clear = [support for support in SUPPORTS if nearest(support) <= SUPPORT_CLEAR_COSINE]
    return clear[0] if clear else min(SUPPORTS, key=nearest)


# Joints and links ----------------------------------------------------------------------------------

NUMBER_SHARES = (0.5, 0.36, 0.64, 0.25, 0.75)
"""Positions of a link's number along its longest stretch, the best first."""


def _joints(subject: Subject, nodes: dict[str, complex]) -> Iterator[Part]:
    """Draw rings where links are hinged, a dot at a point of one link alone."""
    mechanism = subject.plan.mechanism
    hinged = {joint for bar in bars(subject, nodes) for joint in bar.joints}
    hinged.update(block.node for block in blocks(subject, nodes))
    free = _free_points(mechanism)
    for node in mechanism.joints:
        if node in free:
            yield Part(node, symbols.marked_point(nodes[node]))
        elif node in hinged or mechanism.is_ground(node):
            yield Part(node, symbols.joint(nodes[node]))
    for group in mechanism.groups:
        ratio = group.ratio if isinstance(group, PointOnLine) else getattr(group, "line_ratio", None)
        if isinstance(group, PointOnLine | Plate) and ratio is not None:
            yield from _welds(group, subject.number(np.asarray(ratio)), subject, nodes)


def _free_points(mechanism: Mechanism) -> set[str]:
    """Return points of a link at which nothing is hinged."""
    kinds = PointOnLine | Plate | SlotPoint
    points = {group.node for group in mechanism.groups if isinstance(group, kinds)}
    points.update(group.assur_point for group in mechanism.groups if isinstance(group, Triad))
    points.update(link.foot for link in slotted_links(mechanism).values() if link.foot)
    return points - {member.points[0] for _, member, _ in members(mechanism)}


def _welds(
    group: PointOnLine | Plate, share: float, subject: Subject, nodes: dict[str, complex]
) -> Iterator[Part]:
    """Mark a rigid link through three joints with a bow over the middle one, away from other links there."""
    shares = {group.base[0]: 0.0, group.base[1]: 1.0, group.node: share}
    start, middle, end = sorted(shares, key=lambda joint: shares[joint])
    if middle in _free_points(subject.plan.mechanism) or nodes[start] == nodes[end]:
        return
    along = unit(nodes[end] - nodes[start])
    hanging = [bar.joints for bar in bars(subject, nodes) if middle in bar.joints]
    others = [joint for joints in hanging for joint in joints if joint not in shares]
    left = sum(float((np.conj(along) * (nodes[joint] - nodes[middle])).imag) for joint in others)
    yield Part(group.node, symbols.weld(nodes[middle], along, -1 if left > 0.0 else 1))


def _link_numbers(subject: Subject, nodes: dict[str, complex]) -> Iterator[Wanted]:
    """Place a number at the longest stretch of each link, in a plate's middle, at a driving slider."""
    driver = subject.plan.mechanism.driver
    if isinstance(driver, DrivingSlider):
        yield Wanted(
            driver.pin, point(nodes[driver.pin]), driver.link, LINK_NUMBER_MM, INK, symbols.BLOCK_MM[1],
            italic=False,
        )  # fmt: skip
    groups, dots = subject.plan.mechanism.groups, subject.plan.construction.dots
    plates = {group.link for group in groups if isinstance(group, Plate) and group.node not in dots}
    plates.update(group.links[3] for group in groups if isinstance(group, Triad))
    stretches: dict[str, list[Bar]] = {}
    for bar in bars(subject, nodes):
        stretches.setdefault(bar.link, []).append(bar)
    for link, parts in stretches.items():
        if link:
            places = _within(parts) if link in plates else _beside(parts)
            # Farthest from all joints and points, of several such places the first.
            at = max(places, key=lambda place: min(10.0, *(abs(place - one) for one in nodes.values())))
            yield Wanted(parts[0].node, point(at), link, LINK_NUMBER_MM, INK, 0.2, italic=False)


def _within(parts: Sequence[Bar]) -> list[complex]:
    """Return places in a plate, its middle first."""
    corners = list(dict.fromkeys(end for bar in parts for end in bar.ends))
    middle = sum(corners) / len(corners)
    return [middle, *((middle + corner) / 2.0 for corner in corners)]


def _beside(parts: Sequence[Bar]) -> list[complex]:
    """Return places along a link's longest stretch, its middle first."""
    start, end = max((bar.ends for bar in parts), key=lambda ends: abs(ends[1] - ends[0]))
    return [start + share * (end - start) for share in NUMBER_SHARES]


# The arrow at the driving link ----------------------------------------------------------------------

RADIUS_MM, SWEEP, THRUST_MM = 9.0, 0.9, 10.0
DRIVE_LETTER_MM = 3.4
CLEAR_MM = 0.8
STARTS = (0.25, -0.25 - SWEEP, 1.5, -1.5 - SWEEP, 2.5)
"""Starting angles of a turning arrow, from the crank on in its sense, the best first."""
Turn = tuple[float, float, float]
"""Radius, start and sweep."""


def drive_arrow(subject: Subject, nodes: dict[str, complex]) -> Iterator[Shape]:
    """Yield the arrow, unless the driving link stands still."""
    driver = subject.plan.mechanism.driver
    if _stands_still(subject):
        return
    if isinstance(driver, DrivingSlider):
        yield from symbols.arrow(*_thrust(subject, driver, nodes), THIN_MM, INK)
    else:
        yield from symbols.turning(nodes[driver.pivot], *_turn(subject, driver, nodes))


def drive_letter(subject: Subject, nodes: dict[str, complex]) -> Iterator[Wanted]:
    """Yield the angular velocity or the velocity that the arrow stands for."""
    driver = subject.plan.mechanism.driver
    if _stands_still(subject):
        return
    if isinstance(driver, DrivingSlider):
        at = point(sum(_thrust(subject, driver, nodes)) / 2.0)
        yield Wanted(driver.pin, at, subject.letter(f"v_{driver.pin}"), DRIVE_LETTER_MM, INK, 0.6)
    else:
        radius, start, sweep = _turn(subject, driver, nodes)
        outward = complex(np.exp(1j * (start + 0.5 * sweep)))
        at = point(nodes[driver.pivot] + radius * outward)
        yield Wanted(driver.pin, at, pieces_of(f"omega_{driver.link}"), DRIVE_LETTER_MM, INK, 0.6, outward)


def _rate(subject: Subject) -> float:
    """Return the crank's angular velocity, or the driving slider's speed."""
    driver = subject.plan.mechanism.driver
    return subject.number(np.asarray(driver.speed if isinstance(driver, DrivingSlider) else driver.omega))


def _stands_still(subject: Subject) -> bool:
    return _rate(subject) == 0.0


def _thrust(subject: Subject, driver: DrivingSlider, nodes: dict[str, complex]) -> tuple[complex, complex]:
    """Return an arrow beside the block, in the sense of its velocity, where it meets the fewest links."""
    block = next(block for block in blocks(subject, nodes) if block.node == driver.pin)
    along = block.along * float(np.sign(_rate(subject)))
    above = 1j * block.along * (1 if block.along.real >= 0.0 else -1)
    length, width = symbols.BLOCK_MM
    starts = (
        block.at + above * (width + up) + along * ahead
        for up in (3.0, 7.0)
        for ahead in (-length, 2.0, -THRUST_MM - 2.0)
    )
    links = _links(subject, nodes)
    arrows = [(start, start + THRUST_MM * along) for start in starts]
    return min(arrows, key=lambda arrow: _meets(Curve((point(arrow[0]), point(arrow[1]))), links))


def _turn(subject: Subject, crank: Crank, nodes: dict[str, complex]) -> Turn:
    """Return an arrow about the crank's pivot, in its sense, where it meets the fewest links."""
    centre = nodes[crank.pivot]
    arm = nodes[crank.pin] - centre
    sign, largest = float(np.sign(_rate(subject))), min(RADIUS_MM, 0.45 * abs(arm))
    links = _links(subject, nodes)
    turns = [
        (radius, float(np.angle(arm)) + sign * start, sign * SWEEP)
        for radius in (largest, 0.7 * largest)
        for start in STARTS
    ]

    def met(turn: Turn) -> int:
        radius, start, sweep = turn
        return _meets(symbols.arc(centre, radius, start, sweep, THIN_MM), links)

    return min(turns, key=met)


def _links(subject: Subject, nodes: dict[str, complex]) -> FloatArray:
    """Return the links as segments, millimetres, y down."""
    return segments_of(Stroke(point(bar.ends[0]), point(bar.ends[1])) for bar in bars(subject, nodes))


def _meets(curve: Curve, links: FloatArray) -> int:
    """Count the links that a curve meets, or nearly so."""
    corners = np.array(curve.points)
    share = np.linspace(0.0, len(corners) - 1.0, 24)
    places = np.stack(
        [np.interp(share, np.arange(len(corners)), corners[:, axis]) for axis in (0, 1)], axis=1
    )
    boxes = np.hstack([places - CLEAR_MM, places + CLEAR_MM])
    return int(np.any(lengths_inside(boxes, links) > 0.0, axis=0).sum())


# Polygons of the plans -----------------------------------------------------------------------------

NODE_LETTER_MM, SMALL_NODE_LETTER_MM = 4.2, 3.4
OVERRUN_MM = 5.0
"""Length by which a construction line extends past its foot and past the node that it finds."""
ABSOLUTE_MM, RELATIVE_MM = 0.5, 0.3
"""Widths of vectors from the pole, and of all others."""
SUM_DASH, SUM_HEAD_MM = (2.2, 1.2), (2.4, 0.45)
"""Dash and arrowhead of a full relative acceleration, a thin line between the ends of other vectors."""


def polygon(subject: Subject, figure: str) -> DrawnFigure:
    """Return one plan of one variant."""
    colour, nodes = PLAN_COLOURS[sort_of(figure)], subject.nodes(figure)
    drawn = [*_lines(subject, figure, nodes), *_vectors(subject, figure, nodes)]
    pole = subject.plan.construction.poles[figure]
    drawn.append(Part(pole, symbols.marked_point(nodes[pole], colour)))
    style = Style(NODE_LETTER_MM, SMALL_NODE_LETTER_MM, colour, symbols.POINT_RADIUS_MM)
    make = names_of_vectors if group_of(figure) else letters
    named = make(subject, nodes, [part.shape for part in drawn], style)
    return captioned(subject, figure, (*drawn, *named), colour)


def _lines(subject: Subject, figure: str, nodes: dict[str, complex]) -> Iterator[Part]:
    view = subject.view
    for step in subject.plan.construction.figures[figure]:
        for shape in construction_lines(step, view, nodes):
            yield Part(step.node, shape)


def construction_lines(step: Step, view: View, nodes: dict[str, complex]) -> Iterator[Shape]:
    """Yield the thin lines that determine a node, extended a little at both ends."""
    lines = (step.first, step.second) if isinstance(step, TwoLines) else ()
    drawn = [(line.through, complex(line.along.at(view))) for line in lines if isinstance(line, Line)]
    for through, along in drawn:
        foot, node = nodes[through], nodes[step.node]
        sign = 1.0 if (np.conj(along) * (node - foot)).real >= 0.0 else -1.0
        over = sign * OVERRUN_MM * along
        yield Stroke(point(foot - over), point(node + over), HAIR_MM, CONSTRUCTION)


def _vectors(subject: Subject, figure: str, nodes: dict[str, complex]) -> Iterator[Part]:
    """Draw each vector of non-zero length; of several along one line, the longest lowest."""
    colour = PLAN_COLOURS[sort_of(figure)]
    for vector in subject.plan.construction.vectors_of(figure):
        if subject.is_zero(vector.name):
            continue
        width = ABSOLUTE_MM if _is_main(subject, figure, vector) else RELATIVE_MM
        style = (THIN_MM, colour, SUM_HEAD_MM, SUM_DASH) if vector.is_sum else (width, colour)
        ends = (nodes[vector.tail], nodes[vector.head])
        for shape in symbols.arrow(*(ends[::-1] if vector.reversed else ends), *style):
            yield Part(vector.head, shape)


def _is_main(subject: Subject, figure: str, vector: Vector) -> bool:
    """Return whether a vector is drawn wide: from a pole that has a letter, or a force that is known."""
    construction = subject.plan.construction
    if not group_of(figure):
        return vector.tail == construction.poles[figure]
    step = construction.step(vector.head)
    return isinstance(step, Given) and step.start == vector.tail and not vector.part
