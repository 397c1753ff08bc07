"""The mechanism sketch: links, joints, ground and guides, as symbols at the scale kL."""

from collections.abc import Iterator, Sequence

import numpy as np

from reference.canvas import INK, Area, Label, Stroke
from reference.drawing import symbols
from reference.drawing.drive import drive_arrow, drive_letter
from reference.drawing.labelling import Style, Wanted, letters
from reference.drawing.links import Bar, bars, blocks, hinged_on, unit
from reference.drawing.subject import Figure, Part, Subject
from reference.drawing.symbols import LINK_MM, point
from reference.drawing.triangles import altitudes
from reference.mechanism import DrivenSlider, Mechanism, Plate, PointOnLine, SlotPoint, SlottedLink

LETTER_MM, SMALL_LETTER_MM = 4.2, 3.2
LINK_NUMBER_MM = 3.0
PLATE_FILL = "#eef1f4"
GUIDE_REACH_MM, NEAR_GUIDE_MM = 13.0, 7.0
AXIS_REACH_MM = 18.0
NUMBER_SHARES = (0.5, 0.36, 0.64, 0.25, 0.75)
"""Where along its longest stretch a link's number may stand, the best first."""
SHORTEST_GUIDE_MM, ROD_CLEAR_MM = 7.0, 1.0
"""A guide ends where the rod comes nearer to it than this; a shorter one lies on the block's other side."""
SUPPORTS = (-1j, 1j, -1.0 + 0j, 1.0 + 0j)
"""Where the ground of a pivot may lie, the best first."""
SUPPORT_CLEAR_COSINE = 0.62
"""Of the angle between a link and the ground of its pivot, at most."""
CAPTION_GAP_MM, CAPTION_MM = 6.0, 3.5


def sketch(subject: Subject) -> Figure:
    """The mechanism of one variant."""
    nodes = subject.nodes("mechanism")
    thin = altitudes(subject, nodes)
    layers = (_plates(subject, nodes), thin.lines, *_layers(subject, nodes), thin.vectors)
    drawn = [part for layer in layers for part in layer]
    style = Style(LETTER_MM, SMALL_LETTER_MM, INK, symbols.JOINT_RADIUS_MM)
    others = [*_link_numbers(subject, nodes), *drive_letter(subject, nodes), *thin.letters]
    named = letters(subject, nodes, [part.shape for part in drawn], style, others)
    return captioned(subject, "mechanism", (*drawn, *named), INK)


def captioned(subject: Subject, name: str, parts: tuple[Part, ...], colour: str) -> Figure:
    """A figure with its title and scale above it."""
    left, top, _right, _bottom = Figure(name, parts).bounds
    caption = Label((left, top - CAPTION_GAP_MM), subject.caption(name), CAPTION_MM, colour=colour)
    return Figure(name, (*parts, Part("", caption)))


def _layers(subject: Subject, nodes: dict[str, complex]) -> Iterator[Iterator[Part]]:
    """Over plates and thin lines: what lies undermost first."""
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
        if isinstance(group, Plate):
            corners = tuple(point(nodes[corner]) for corner in (*group.base, group.node))
            yield Part(group.node, Area(corners, PLATE_FILL))


def _guides(subject: Subject, nodes: dict[str, complex]) -> Iterator[Part]:
    """Ground below a block, or away from a rod that comes from there; the line along which it moves."""
    for block in blocks(subject, nodes):
        if not block.grounded:
            continue
        at, along = block.at, block.along
        below = 1 if along.real < 0.0 else -1
        rod = complex(np.conj(along) * block.rod)
        side = below if _before_rod(rod, below) >= SHORTEST_GUIDE_MM else -below
        behind, ahead = (
            min(_reach(at, sign * along, nodes), _before_rod(rod, side) if rod.real * sign > 0.0 else np.inf)
            for sign in (-1, 1)
        )
        for shape in symbols.guide(at, along, side, (behind, ahead)):
            yield Part(block.node, shape)
        yield Part(block.node, symbols.axis(at - along * AXIS_REACH_MM, at + along * AXIS_REACH_MM))


def _before_rod(rod: complex, side: int) -> float:
    """How far the ground on one side may reach before the rod (in the guide's axes) crosses it."""
    if rod.imag * side <= 0.0:
        return float("inf")
    return (symbols.BLOCK_MM[1] - ROD_CLEAR_MM) * abs(rod.real / rod.imag)


def _reach(at: complex, along: complex, nodes: dict[str, complex]) -> float:
    """How far a guide goes: short of a joint that lies near its line."""
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
    """Where the ground of a pivot lies: below, unless a link goes there."""
    towards = [end - at for ends in links for end in ends if abs(end - at) > 0.0]
    if not towards:
        return SUPPORTS[0]

    def nearest(support: complex) -> float:
        return max(float((np.conj(support) * link).real) / abs(link) for link in towards)

    clear = [support for support in SUPPORTS if nearest(support) <= SUPPORT_CLEAR_COSINE]
    return clear[0] if clear else min(SUPPORTS, key=nearest)


def _joints(subject: Subject, nodes: dict[str, complex]) -> Iterator[Part]:
    """Rings where links are hinged, a dot at a point of one link alone."""
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
            yield from _welds(group, subject.one(np.asarray(ratio)), subject, nodes)


def _free_points(mechanism: Mechanism) -> set[str]:
    """Points of a link at which nothing is hinged."""
    kinds = PointOnLine | Plate | SlotPoint
    points = {group.node for group in mechanism.groups if isinstance(group, kinds)}
    points.update(group.foot for group in mechanism.groups if isinstance(group, SlottedLink) and group.foot)
    return points - {joint for group in mechanism.groups for joint in hinged_on(group)}


def _welds(
    group: PointOnLine | Plate, share: float, subject: Subject, nodes: dict[str, complex]
) -> Iterator[Part]:
    """A rigid link through three joints: a bow over the one in the middle, away from what hangs there."""
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
    """A number at the longest stretch of each link, in a plate's middle, at a driven slider."""
    driver = subject.plan.mechanism.driver
    if isinstance(driver, DrivenSlider):
        yield Wanted(
            driver.pin, point(nodes[driver.pin]), driver.link, LINK_NUMBER_MM, INK, symbols.BLOCK_MM[1],
            italic=False,
        )  # fmt: skip
    plates = {group.link for group in subject.plan.mechanism.groups if isinstance(group, Plate)}
    stretches: dict[str, list[Bar]] = {}
    for bar in bars(subject, nodes):
        stretches.setdefault(bar.link, []).append(bar)
    for link, parts in stretches.items():
        if link:
            at = _middle(parts) if link in plates else _beside(parts, nodes)
            yield Wanted(parts[0].node, point(at), link, LINK_NUMBER_MM, INK, 0.2, italic=False)


def _middle(parts: Sequence[Bar]) -> complex:
    corners = {end for bar in parts for end in bar.ends}
    return sum(corners) / len(corners)


def _beside(parts: Sequence[Bar], nodes: dict[str, complex]) -> complex:
    """The place on a link's longest stretch that is farthest from all joints, its middle if that will do."""
    start, end = max((bar.ends for bar in parts), key=lambda ends: abs(ends[1] - ends[0]))
    places = (start + share * (end - start) for share in NUMBER_SHARES)
    return max(places, key=lambda at: min(10.0, *(abs(at - place) for place in nodes.values())))
