"""Draw the links of a force plan with the forces at their points, and Zhukovsky's lever."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from reference.construction.draft import image_name
from reference.construction.elements import Couple
from reference.construction.equations import moment_sums
from reference.construction.forces import reaction
from reference.construction.graph import Vector
from reference.drawing import symbols
from reference.drawing.canvas import CONSTRUCTION, INK, Area, Piece, Ring, Shape, Stroke, shifted
from reference.drawing.labels import Style, Wanted, lengths_inside, letters, segments_of
from reference.drawing.sketch import LETTER_MM, PLATE_FILL, SMALL_LETTER_MM, captioned
from reference.drawing.subject import PLAN_COLOURS, DrawnFigure, Part, Subject
from reference.drawing.symbols import HAIR_MM, LINK_MM, THIN_MM, Bar, bars, blocks, point
from reference.drawing.symbols import unit as unit_vector
from reference.drawing.tables import four_digits
from reference.mechanism import Plate, named_links, short_names, turning
from reference.quantities import group_of

SCHEME_MM, APART_MM = 55.0, 10.0
"""Largest size of the links on a scheme; its distance from the polygon."""
SHARES = (1.0, 0.5, 0.4, 0.25, 0.2, 0.1, 0.05, 0.04, 0.025, 0.02, 0.01)
"""The mechanism's size on a scheme: its scale is as round as the mechanism's own."""
FORCE_MM, GIVEN_MM, FOUND_MM = 15.0, 0.5, 0.25
"""Length of a force's arrow, and its width where the force is given or found before, or is found now."""
FORCE_LETTER_MM, ARM_LETTER_MM = 3.2, 2.6
COUPLE_MM, COUPLE_START, COUPLE_SWEEP = 6.5, -0.6, 4.2
ARM_HEAD_MM, LINE_DASH = (1.8, 0.3), (1.2, 1.0)
LEAST_M = 1e-6
"""A guide's force nearer to its joint than this passes through it."""
SAMPLES = 16
"""Places along an arrow where it is looked whether other lines are near."""
SHIFTS = {0.0: 0.0, -1.0: 0.5, 1.05: 5.0, -2.05: 6.0}
"""Starts of an arrow, in lengths from its point, and how many touched places each is worth."""
COLOUR = PLAN_COLOURS["force_plan"]
POLE, LEVER = "o", "lever"


@dataclass(frozen=True, slots=True)
class Acting:
    """A force or a couple on a link, at one of its points.

    Attributes
    ----------
    force : N, complex; zero of a couple
    moment : N m, counter-clockwise positive; zero of a force
    is_found : by the plan itself; else it is given, or found before
    aside_m : from the point to the line of a guide's force, along the guide, complex
    """

    name: str
    link: str
    at: str
    force: complex
    moment: float = 0.0
    is_found: bool = False
    aside_m: complex = 0j

    @property
    def aside(self) -> str:
        """The name of that distance."""
        return f"x_{self.name.partition('_')[2]}"


def links_of_plan(subject: Subject, figure: str) -> tuple[str, ...]:
    """Return the links whose forces a force plan shows: of its group, or the driving link.

    With that link come those of the cylinder that drives it, if forces act on them.
    """
    mechanism, named = subject.plan.mechanism, named_links(subject.plan.mechanism)
    cylinder = getattr(mechanism.driver, "cylinder", None)
    moved = next((links for links in named.values() if links[:1] == (cylinder,)), ())
    is_loaded = any(subject.plan.construction.acting.get(link) for link in moved)
    return named.get(group_of(figure), (*(moved if is_loaded else ()), mechanism.driver.link))


def acting_on(subject: Subject, figure: str) -> list[Acting]:
    """Return what acts on a plan's links: given forces and couples, what is taken over, reactions found."""
    view, found = subject.view, dict[str, Acting]()
    for link in links_of_plan(subject, figure):
        for one in subject.plan.construction.acting.get(link, ()):
            if isinstance(one, Couple):
                moment = float(one.at(view))
                found.setdefault(one.name, Acting(one.name, link, _centre(subject, one), 0j, moment))
            else:
                force = complex(one.along.at(view) * one.size.at(view) * view.parameters["kF"])
                found[one.name] = Acting(one.name, link, one.point, force)
    for reacting in _reactions(subject, figure):
        found.setdefault(reacting.name, reacting)
    return [one for one in found.values() if one.force != 0.0 or one.moment != 0.0]


def _centre(subject: Subject, couple: Couple) -> str:
    """Return the point at which a couple is drawn: its body's centre, its load's point."""
    mechanism, names = subject.plan.mechanism, short_names(subject.plan.mechanism)
    points = {f"M_i{names[body.link]}": body.centre for body in mechanism.bodies}
    return (points | {f"M_{load.name}": load.point for load in mechanism.loads})[couple.name]


def _reactions(subject: Subject, figure: str) -> Iterator[Acting]:
    """Yield the reactions that a plan finds, in parts where it has them; not those between its links."""
    plan, links, names = subject.plan, links_of_plan(subject, figure), short_names(subject.plan.mechanism)
    driver, solved, places = plan.mechanism.driver, plan.forces, dict[str, tuple[str, str, str, complex]]()
    for one in (*solved.hinges.values(), *solved.guides.values()) if solved else ():
        away = 0j if one.along is None else subject.vector(np.nan_to_num(one.lever_m) * one.along)
        for on, by in ((one.on, one.by), (one.by, one.on)):
            places[reaction(names, by, on)] = (one.joint, on, by, away)
    told = [vector for vector in plan.construction.vectors_of(figure) if not vector.is_sum]
    known = [places[name] for vector in told if (name := whole(vector)) in places]
    outer = {joint for joint, _, by, _ in known if by not in links}
    # Of a cylinder and its crank together no inner force is shown: neither the thrust nor that of its tube.
    inside = {*links, ""} if len(links) > 2 else set[str]()
    for vector in told:
        joint, on, by, away = places.get(whole(vector), (driver.pin, driver.link, "", 0j))
        is_shown = on in links and by not in inside and (by not in links or joint not in outer)
        if is_shown and not subject.is_zero(vector.name):
            force = subject.vector(plan.vectors_si[vector.name])
            yield Acting(vector.name, on, joint, force, is_found=True, aside_m=away)
    if group_of(figure) == driver.pin:
        for name in plan.construction.moments:
            moment = subject.number(plan.rates[name])
            yield Acting(name, driver.link, getattr(driver, "pivot", ""), 0j, moment, is_found=True)


def whole(vector: Vector) -> str:
    """Return the name of the reaction of which a vector is a part, or its own."""
    return vector.name.removesuffix(f"_{vector.part}") if vector.part else vector.name


# Pictures ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Dimension:
    """An arm on a picture, from a joint to its foot on the line of a force, which starts at a point."""

    name: str
    mm: float
    foot: complex
    joint: complex
    start: complex


def with_scheme(subject: Subject, polygon: DrawnFigure) -> DrawnFigure:
    """Return a force plan with the scheme of its links to its left, or above it where that is smaller."""
    scheme = scheme_of(subject, polygon.name)
    (left, top, *_), (x, y, end, low) = polygon.bounds, scheme.bounds
    options = (
        DrawnFigure(polygon.name, (*polygon.parts, *(Part("", shifted(one, by)) for one in scheme.shapes)))
        for by in ((left - APART_MM - end, top - y), (left - x, top - APART_MM - low))
    )
    return min(options, key=lambda one: float(np.hypot(one.size[0], one.size[1])))


def scheme_of(subject: Subject, figure: str) -> DrawnFigure:
    """Return a force plan's links at a round share of the mechanism's scale, with forces, couples, arms."""
    acting, view, full = acting_on(subject, figure), subject.view, subject.nodes("mechanism")
    links, group = links_of_plan(subject, figure), group_of(figure)
    ends = [end for bar in bars(subject, full) if _is_of(bar, links, group) for end in bar.ends] or [0j]
    size = max(np.ptp(np.real(ends)), np.ptp(np.imag(ends)))
    share = next((one for one in SHARES if one * size <= SCHEME_MM), SHARES[-1])
    nodes: dict[str, complex] = {name: share * at for name, at in full.items()}
    scale = subject.number(subject.plan.scales.kL)
    arms = [
        Dimension(
            arm.name, 1e3 * scale * arm.mm(view), share * arm.foot(view), nodes[arm.about], nodes[force.point]
        )
        for total in moment_sums(subject.plan.construction, figure, view)
        for arm in total.named_arms
        for force in (arm.force,)
    ]
    for one in acting:
        if abs(one.aside_m) > LEAST_M:
            foot = nodes[one.at] + share / scale * one.aside_m
            arms.append(Dimension(one.aside, 1e3 * abs(one.aside_m), foot, nodes[one.at], foot))
    drawn = [Part("", shape) for shape in _links(subject, links, group, nodes)]
    named = {joint for bar in bars(subject, full) if _is_of(bar, links, group) for joint in bar.joints}
    points = {name: at for name, at in nodes.items() if name in named or name in {one.at for one in acting}}
    parts = _picture(subject, points, drawn, acting, arms, share / scale)
    text = subject.captioned(subject.title_of("scheme", figure), "kL", 1.0 / share)
    return captioned(subject, "scheme", parts, INK, text)


def _is_of(bar: Bar, links: Sequence[str], group: str) -> bool:
    """Return whether a bar belongs to some links, or to the link without a name of a group."""
    return bar.link in links or (not bar.link and bar.node == group)


def _links(subject: Subject, links: Sequence[str], group: str, nodes: dict[str, complex]) -> Iterator[Shape]:
    for one in subject.plan.mechanism.groups:
        if isinstance(one, Plate) and one.link in links:
            yield Area(tuple(point(nodes[corner]) for corner in (*one.base, one.node)), PLATE_FILL)
    own = [bar for bar in bars(subject, nodes) if _is_of(bar, links, group)]
    mechanism = subject.plan.mechanism
    moved = {node for node, added in named_links(mechanism).items() if added and {*added} <= {*links}}
    moved |= {mechanism.driver.pin} if mechanism.driver.link in links else set()
    for block in blocks(subject, nodes):
        if block.node in moved:
            reach = 2.0 * symbols.BLOCK_MM[0] * block.along
            yield symbols.axis(block.at - reach, block.at + reach)
            yield symbols.block(block.at, block.along)
    for bar in own:
        yield Stroke(point(bar.ends[0]), point(bar.ends[1]), LINK_MM)
    joints = dict.fromkeys(joint for bar in own for joint in bar.joints)
    yield from (symbols.joint(nodes[joint]) for joint in joints)


def _picture(
    subject: Subject,
    nodes: dict[str, complex],
    base: list[Part],
    acting: Sequence[Acting],
    arms: Sequence[Dimension],
    per_metre: float,
) -> tuple[Part, ...]:
    """Return forces, couples and arms over what they act on, with the names of all.

    Arguments: `nodes`, the points to name; `per_metre`, millimetres of the picture.
    """
    shapes: list[Shape] = []
    wanted: list[Wanted] = []
    hinges = {part.shape.centre for part in base if isinstance(part.shape, Ring)}
    for one in acting:
        at, width = nodes[one.at] + per_metre * one.aside_m, FOUND_MM if one.is_found else GIVEN_MM
        if one.force:
            start, tip = _clear(at, unit_vector(one.force), [*(part.shape for part in base), *shapes])
            along = unit_vector(tip - at) if abs(tip - at) > abs(start - at) else unit_vector(start - at)
            shapes += symbols.arrow(start, tip, width, COLOUR)
            tip = max((start, tip), key=lambda end: abs(end - at))
        else:
            sweep, along = float(np.copysign(COUPLE_SWEEP, one.moment)), complex(np.exp(1j * COUPLE_START))
            shapes += symbols.turning(at, COUPLE_MM, COUPLE_START, sweep, COLOUR)
            tip = at + COUPLE_MM * along
        wanted.append(Wanted("", point(tip), subject.letter(one.name), FORCE_LETTER_MM, COLOUR, 0.8, along))
    for arm in arms:
        shapes += [Stroke(point(arm.start), point(arm.foot), HAIR_MM, CONSTRUCTION, LINE_DASH)]
        for start, end in ((arm.joint, arm.foot), (arm.foot, arm.joint)):
            shapes += symbols.arrow(start, end, HAIR_MM, CONSTRUCTION, ARM_HEAD_MM)
        length = f"{subject.wording.number(four_digits(arm.mm))} {subject.wording.unit('mm')}"
        text, middle = (*subject.letter(arm.name), Piece(f" = {length}")), point((arm.joint + arm.foot) / 2.0)
        wanted.append(Wanted("", middle, text, ARM_LETTER_MM, CONSTRUCTION, 0.4, italic=False))
    marked = {nodes[one.at] for one in acting if point(nodes[one.at]) not in hinges}
    shapes += map(symbols.marked_point, sorted(marked, key=abs))
    drawn = [*base, *(Part("", shape) for shape in shapes)]
    style = Style(LETTER_MM, SMALL_LETTER_MM, INK, symbols.JOINT_RADIUS_MM)
    return (*drawn, *letters(subject, nodes, [part.shape for part in drawn], style, wanted))


def _clear(at: complex, along: complex, drawn: Sequence[Shape]) -> tuple[complex, complex]:
    """Return the ends of an arrow that starts or ends at a point, or beyond another arrow, clear of lines."""
    lines = segments_of(drawn)

    def touched(ends: tuple[complex, complex]) -> float:
        places = [point(ends[0] + share * (ends[1] - ends[0])) for share in np.linspace(0.0, 1.0, SAMPLES)]
        boxes = np.hstack([np.array(places), np.array(places)])
        return float(np.any(lengths_inside(boxes, lines) > 0.0, axis=1).sum())

    starts = [at + shift * FORCE_MM * along for shift in SHIFTS]
    ends = {shift: (start, start + FORCE_MM * along) for shift, start in zip(SHIFTS, starts, strict=True)}
    return ends[min(SHIFTS, key=lambda shift: touched(ends[shift]) + SHIFTS[shift])]


# Zhukovsky's lever ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class OnLever:
    """A given force at the image of its point on the velocity plan turned clockwise, or a couple.

    Attributes
    ----------
    arm_mm : of the force about the pole, millimetres at the scale kv; the sign is the moment's
    power : W, of the force or the couple
    """

    acting: Acting
    image: complex
    arm_mm: float
    power: float


def on_lever(subject: Subject) -> list[OnLever]:
    """Return what acts on the lever; a force's moment about the pole is its power."""
    plan, found = subject.plan, list[OnLever]()
    kv, turns = subject.number(plan.scales.kv), turning(plan.mechanism)
    for one in plan.forces.given if plan.forces else ():
        image = -1j * subject.vector(plan.motion.velocity[one.point]) / kv
        force, couple = subject.vector(one.force), subject.number(one.couple)
        if force:
            # Rounded: a force through the pole has no arm, not one of 1e-15 mm.
            arm = round(float((np.conj(image) * unit_vector(force)).imag), 10)
            found.append(
                OnLever(Acting(one.name, one.link, one.point, force), image, arm, abs(force) * arm * kv)
            )
        if couple and one.link in turns:
            omega = plan.motion.omega[turns[one.link][0]]
            acting = Acting(f"M_{one.name.partition('_')[2]}", one.link, one.point, 0j, couple)
            found.append(OnLever(acting, image, 0.0, couple * subject.number(omega)))
    return found


def lever_of(subject: Subject) -> DrawnFigure:
    """Return the velocity plan, turned a quarter clockwise, with the forces at the images of their points."""
    plan, kv = subject.plan, subject.number(subject.plan.scales.kv)
    images = {joint: -1j * subject.vector(at) / kv for joint, at in plan.motion.velocity.items()}
    fixed = [joint for joint in images if plan.mechanism.is_ground(joint)]
    names = {joint: POLE if joint in fixed else image_name(joint) for joint in images}
    nodes = {names[joint]: at for joint, at in images.items()}
    shown = [
        [names.get(joint, POLE) for joint in bar.joints] for bar in bars(subject, subject.nodes("mechanism"))
    ]
    base = [Part("", Stroke(point(nodes[p]), point(nodes[q]), THIN_MM)) for p, q in shown if p != q]
    forces = [one for one in on_lever(subject) if one.acting.force]
    acting = [replace(one.acting, at=names[one.acting.at]) for one in forces]
    arms = [
        Dimension(f"h_{k}", abs(one.arm_mm), foot, 0j, one.image)
        for k, one in enumerate(forces, start=1)
        if abs(foot := complex(-1j * unit_vector(one.acting.force) * one.arm_mm)) > 0.0
    ]
    parts = _picture(subject, {POLE: 0j, **nodes}, base, acting, arms, 1.0)
    return captioned(subject, LEVER, parts, COLOUR, subject.captioned(subject.wording.titles[LEVER], "kv"))
