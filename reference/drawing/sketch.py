"""The mechanism sketch: links, joints, ground and guides, as symbols at the scale kL."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from reference.canvas import INK, Area, Label, Stroke
from reference.drawing import symbols
from reference.drawing.labelling import Wanted, lengths_inside, place_labels, segments_of, together
from reference.drawing.subject import TOUCHING_MM, Figure, Part, Subject
from reference.drawing.symbols import LINK_MM, point
from reference.geometry import direction
from reference.lettering import Piece, pieces_of
from reference.mechanism import Crank, Dyad, Group, Plate, PointOnLine, Slider

LETTER_MM = 4.2
LINK_NUMBER_MM, RATE_MM = 3.0, 3.4
PLATE_FILL = "#eef1f4"
GUIDE_REACH_MM = 13.0
AXIS_REACH_MM = 18.0
NUMBER_SHARES = (0.5, 0.36, 0.64, 0.25, 0.75)
"""Where along its longest stretch a link's number may stand, the best first."""
STEEP_ROD = 0.25
"""Sine of a rod's angle to the guide beyond which the ground lies on the guide's other side."""
TURN_RADIUS_MM, TURN_SWEEP = 9.0, 0.9
SUPPORTS = (-1j, 1j, -1.0 + 0j, 1.0 + 0j)
"""Where the ground of a pivot may lie, the best first."""
SUPPORT_CLEAR_COSINE = 0.62
"""Of the angle between a link and the ground of its pivot, at most."""
CAPTION_GAP_MM, CAPTION_MM = 6.0, 3.5


@dataclass(frozen=True, slots=True)
class Bar:
    """A straight stretch of a link: drawn at its node's step."""

    node: str
    link: str
    ends: tuple[str, str]


def sketch(subject: Subject) -> Figure:
    """The mechanism of one variant."""
    nodes = subject.nodes("mechanism")
    drawn = [part for layer in _layers(subject, nodes) for part in layer]
    return captioned(subject, "mechanism", (*drawn, *_letters(subject, nodes, drawn)), INK)


def captioned(subject: Subject, name: str, parts: tuple[Part, ...], colour: str) -> Figure:
    """A figure with its title and scale above it."""
    left, top, _right, _bottom = Figure(name, parts).bounds
    caption = Label((left, top - CAPTION_GAP_MM), subject.caption(name), CAPTION_MM, colour=colour)
    return Figure(name, (*parts, Part("", caption)))


def _layers(subject: Subject, nodes: dict[str, complex]) -> Iterator[Iterator[Part]]:
    """What lies undermost first."""
    groups = subject.plan.mechanism.groups
    yield (part for group in groups for part in _underneath(subject, group, nodes))
    yield (
        Part(bar.node, Stroke(point(nodes[bar.ends[0]]), point(nodes[bar.ends[1]]), LINK_MM))
        for bar in bars(subject)
    )
    yield (part for group in groups for part in _blocks(subject, group, nodes))
    yield _grounds(subject, nodes)
    yield _joints(subject, nodes)
    yield _drive(subject, nodes)


def bars(subject: Subject) -> Iterator[Bar]:
    """The links as straight stretches between joints."""
    crank: Crank = subject.plan.mechanism.crank
    yield Bar(crank.pin, crank.link, (crank.pivot, crank.pin))
    for group in subject.plan.mechanism.groups:
        match group:
            case Dyad(node=node, pins=pins, links=links):
                yield from (Bar(node, link, (pin, node)) for pin, link in zip(pins, links, strict=True))
            case Plate(node=node, base=base, link=link):
                yield from (Bar(node, link, (pin, node)) for pin in base)
            case PointOnLine(node=node, base=(p, q), link=link, ratio=ratio):
                share = subject.one(np.asarray(ratio))
                if share < 0.0:
                    yield Bar(node, link, (p, node))
                elif share > 1.0:
                    yield Bar(node, link, (q, node))
            case Slider(node=node, pin=pin, link=link):
                yield Bar(node, link, (pin, node))


def _underneath(subject: Subject, group: Group, nodes: dict[str, complex]) -> Iterator[Part]:
    match group:
        case Plate(node=node, base=(p, q)):
            yield Part(node, Area(tuple(point(nodes[corner]) for corner in (p, q, node)), PLATE_FILL))
        case Slider(node=node, pin=pin):
            yield from _fixed_guide(node, nodes, _guide_direction(subject, node), nodes[pin])


def _fixed_guide(node: str, nodes: dict[str, complex], along: complex, pin: complex) -> Iterator[Part]:
    """Ground below a block, or away from a rod that comes from there; the line along which it moves."""
    at = nodes[node]
    below = 1 if along.real < 0.0 else -1
    rod = np.conj(along) * (pin - at)
    side = -below if rod.imag * below > STEEP_ROD * abs(rod) else below
    behind, ahead = (_reach(at, sign * along, nodes, node) for sign in (-1, 1))
    for shape in symbols.guide(at, along, side, (behind, ahead)):
        yield Part(node, shape)
    yield Part(node, symbols.axis(at - along * AXIS_REACH_MM, at + along * AXIS_REACH_MM))


def _reach(at: complex, along: complex, nodes: dict[str, complex], node: str) -> float:
    """How far a guide goes: short of a joint that lies near its line."""
    reach = GUIDE_REACH_MM
    for other, place in nodes.items():
        away = np.conj(along) * (place - at)
        if other != node and abs(away.imag) < 7.0 and away.real > 0.0:
            reach = min(reach, max(float(away.real) - 6.5, symbols.BLOCK_MM[0] + 1.0))
    return reach


def _guide_direction(subject: Subject, node: str) -> complex:
    """The direction of a slider's fixed guide."""
    angle = subject.one(subject.plan.drawing.parameters[f"angle guide {node}"])
    return complex(direction(np.asarray(angle)))


def _blocks(subject: Subject, group: Group, nodes: dict[str, complex]) -> Iterator[Part]:
    match group:
        case Slider(node=node):
            yield Part(node, symbols.block(nodes[node], _guide_direction(subject, node)))


def _grounds(subject: Subject, nodes: dict[str, complex]) -> Iterator[Part]:
    links = list(bars(subject))
    for joint in subject.plan.mechanism.ground_m:
        away = support_direction(joint, nodes, links)
        for shape in symbols.pivot(nodes[joint], away):
            yield Part(joint, shape)


def support_direction(joint: str, nodes: dict[str, complex], links: list[Bar]) -> complex:
    """Where the ground of a pivot lies: below, unless a link goes there."""
    at = nodes[joint]
    others = [end for bar in links if joint in bar.ends for end in bar.ends if end != joint]
    towards = [nodes[end] - at for end in others if abs(nodes[end] - at) > 0.0]
    if not towards:
        return SUPPORTS[0]

    def nearest(support: complex) -> float:
        return max(float((np.conj(support) * link).real) / abs(link) for link in towards)

    clear = [support for support in SUPPORTS if nearest(support) <= SUPPORT_CLEAR_COSINE]
    return clear[0] if clear else min(SUPPORTS, key=nearest)


def _joints(subject: Subject, nodes: dict[str, complex]) -> Iterator[Part]:
    """Rings where links are hinged, a dot at a point of one link alone."""
    links = list(bars(subject))
    hinged = {end for bar in links for end in bar.ends}
    for node in subject.plan.mechanism.joints:
        if node in _free_points(subject):
            yield Part(node, symbols.marked_point(nodes[node]))
        elif node in hinged or subject.plan.mechanism.is_ground(node):
            yield Part(node, symbols.joint(nodes[node]))
    for group in subject.plan.mechanism.groups:
        match group:
            case PointOnLine(ratio=ratio):
                yield from _welds(group, subject.one(np.asarray(ratio)), subject, nodes)
            case Plate(line_ratio=ratio) if ratio is not None:
                yield from _welds(group, subject.one(np.asarray(ratio)), subject, nodes)


def _free_points(subject: Subject) -> set[str]:
    """Points of a link at which nothing else is hinged."""
    groups = subject.plan.mechanism.groups
    points = {group.node for group in groups if isinstance(group, PointOnLine | Plate)}
    for group in groups:
        points.difference_update(needed_by(group))
    return points


def needed_by(group: Group) -> tuple[str, ...]:
    """The joints that a group hangs on with links of its own."""
    match group:
        case Dyad(pins=pins):
            return pins
        case Slider(pin=pin):
            return (pin,)
        case _:
            return ()


def _welds(
    group: PointOnLine | Plate, share: float, subject: Subject, nodes: dict[str, complex]
) -> Iterator[Part]:
    """A rigid link through three joints: a bow over the one in the middle, away from what hangs there."""
    shares = {group.base[0]: 0.0, group.base[1]: 1.0, group.node: share}
    start, middle, end = sorted(shares, key=lambda joint: shares[joint])
    if middle in _free_points(subject) or nodes[start] == nodes[end]:
        return
    along = (nodes[end] - nodes[start]) / abs(nodes[end] - nodes[start])
    ends = [joint for bar in bars(subject) if middle in bar.ends for joint in bar.ends if joint not in shares]
    left = sum(float((np.conj(along) * (nodes[joint] - nodes[middle])).imag) for joint in ends)
    yield Part(group.node, symbols.weld(nodes[middle], along, -1 if left > 0.0 else 1))


def _drive(subject: Subject, nodes: dict[str, complex]) -> Iterator[Part]:
    """The sense in which the crank turns."""
    crank = subject.plan.mechanism.crank
    place = _turn_place(subject, nodes)
    if place is not None:
        radius, start, sweep = place
        for shape in symbols.turning(nodes[crank.pivot], radius, start, sweep):
            yield Part(crank.pin, shape)


def _turn_place(subject: Subject, nodes: dict[str, complex]) -> tuple[float, float, float] | None:
    """Radius, start and sweep of the crank's turning arrow, where it meets the fewest links."""
    crank = subject.plan.mechanism.crank
    rate = subject.one(np.asarray(crank.omega))
    arm = nodes[crank.pin] - nodes[crank.pivot]
    if rate == 0.0 or abs(arm) == 0.0:
        return None
    sign = float(np.sign(rate))
    strokes = [Stroke(point(nodes[p]), point(nodes[q])) for p, q in (bar.ends for bar in bars(subject))]
    links = segments_of(strokes)

    def meets(place: tuple[float, float, float]) -> int:
        radius, start, sweep = place
        bow = symbols.arc(nodes[crank.pivot], radius, start, sweep, LINK_MM).points
        boxes = np.array([(x - 0.8, y - 0.8, x + 0.8, y + 0.8) for x, y in bow])
        return int(np.any(lengths_inside(boxes, links) > 0.0, axis=0).sum())

    largest = min(TURN_RADIUS_MM, 0.45 * abs(arm))
    tried = [
        (radius, float(np.angle(arm)) + sign * turn, sign * TURN_SWEEP)
        for radius in (largest, 0.7 * largest)
        for turn in (0.25, -0.25 - TURN_SWEEP, 1.5, -1.5 - TURN_SWEEP, 2.5)
    ]
    return min(tried, key=meets)


def _letters(subject: Subject, nodes: dict[str, complex], drawn: list[Part]) -> Iterator[Part]:
    """The joints' letters, the links' numbers, the crank's rate."""
    wanted = [*_joint_letters(subject, nodes), *_link_numbers(subject, nodes), *_rate_letter(subject, nodes)]
    for standing in place_labels(wanted, [part.shape for part in drawn]):
        for shape in standing.shapes:
            yield Part(standing.wanted.node, shape)


def _joint_letters(subject: Subject, nodes: dict[str, complex]) -> Iterator[Wanted]:
    middle = sum(nodes.values()) / len(nodes)
    for same, at in together(nodes, TOUCHING_MM):
        yield Wanted(
            same[-1], point(at), joined(subject, same), LETTER_MM, INK, symbols.JOINT_RADIUS_MM, at - middle
        )


def joined(subject: Subject, nodes: tuple[str, ...]) -> tuple[Piece, ...]:
    """The letters of nodes that fall on one point."""
    pieces: list[Piece] = []
    for node in nodes:
        pieces += [*([Piece(", ")] if pieces else []), *subject.letter(node)]
    return tuple(pieces)


def _link_numbers(subject: Subject, nodes: dict[str, complex]) -> Iterator[Wanted]:
    """A number at the longest stretch of each link, in a plate's middle."""
    stretches: dict[str, list[Bar]] = {}
    for bar in bars(subject):
        stretches.setdefault(bar.link, []).append(bar)
    for link, bars_of in stretches.items():
        if any(isinstance(g, Plate) and g.link == link for g in subject.plan.mechanism.groups):
            corners = {end for bar in bars_of for end in bar.ends}
            at = sum(nodes[end] for end in corners) / len(corners)
        else:
            longest = max(bars_of, key=lambda bar: abs(nodes[bar.ends[1]] - nodes[bar.ends[0]]))
            start, end = (nodes[joint] for joint in longest.ends)
            at = max(
                (start + share * (end - start) for share in NUMBER_SHARES),
                key=lambda at: min(10.0, *(abs(at - place) for place in nodes.values())),
            )
        yield Wanted(bars_of[0].node, point(at), link, LINK_NUMBER_MM, INK, 0.2, italic=False)


def _rate_letter(subject: Subject, nodes: dict[str, complex]) -> Iterator[Wanted]:
    crank = subject.plan.mechanism.crank
    place = _turn_place(subject, nodes)
    if place is not None:
        radius, start, sweep = place
        turn = complex(np.exp(1j * (start + 0.5 * sweep)))
        at = nodes[crank.pivot] + radius * turn
        yield Wanted(crank.pin, point(at), pieces_of(f"omega_{crank.link}"), RATE_MM, INK, 0.6, turn)
