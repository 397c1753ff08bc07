"""Tables of what acts on the links of a force plan, moments about joints, the check by Zhukovsky's lever."""

from collections.abc import Iterator, Sequence

import numpy as np

from grader.language import N_
from grader.solution.formulas import Formula, Fraction, Grid, Name
from grader.solution.sentences import Speaker
from reference.construction.elements import Balance, Couple, Inertia, Length, Same
from reference.construction.equations import Arm, MomentSum, moment_sums
from reference.construction.steps import Given
from reference.drawing.canvas import Piece
from reference.drawing.forces import LEAST_M, acting_on, links_of_plan, on_lever
from reference.geometry import dot
from reference.mechanism import Crank, short_names, turning
from reference.quantities import group_of, unit_of

COUNTER_CLOCKWISE, CLOCKWISE = N_("counter-clockwise"), N_("clockwise")
FORCE, VALUE = N_("force, couple"), N_("value")
HEADINGS = (N_("on link"), FORCE, N_("at"), N_("size"), VALUE, N_("on paper, mm"), N_("direction"))
ON_LEVER = (FORCE, VALUE, N_("arm, mm"), N_("angular velocity"), N_("power"))
GIVEN = N_("given")
LEVER = N_(
    "The velocity plan is turned by 90° clockwise, and every given force and inertia force acts at the "
    "image of its point. The sum of the moments about the pole, with that of the balancing moment, is "
    "zero. A force times its arm times %(scale)s is its power; a couple's power is the couple times the "
    "angular velocity of its link."
)
TIMES = " · "


def table_of(speaker: Speaker, figure: str) -> Grid:
    """Return what acts on the links of a force plan before it is drawn, one force or couple a row."""
    subject, _ = speaker.subject, speaker.tongue.gettext
    acting, names = subject.plan.construction.acting, short_names(subject.plan.mechanism)
    rows: list[tuple[Formula, ...]] = [tuple(map(_, HEADINGS))]
    found = {one.name: one for one in acting_on(subject, figure) if not one.is_found}
    for link in links_of_plan(subject, figure):
        for one in (one for one in acting.get(link, ()) if one.name in found):
            told = found.pop(one.name)
            size = None if isinstance(one, Couple) else force_formula(speaker, one.size)
            size = size or product_of(speaker, one.name)
            value = abs(told.moment) if isinstance(one, Couple) else abs(told.force)
            paper = "" if told.moment else speaker.tongue.number(value / speaker.scale_value("kF"), 2)
            angle = _(sense(told.moment)) if told.moment else speaker.degrees(told.force)
            rows.append((
                names[link], speaker.symbol(one.name), speaker.symbol(told.at), _in_full(size) or _(GIVEN),
                speaker.real(value, unit_of(one.name)), paper, angle,
            ))  # fmt: skip
    return Grid(tuple(rows), (0,) * len(HEADINGS))


def _in_full(formula: tuple[Formula, ...] | None) -> Formula:
    return (formula[0], " = ", formula[1]) if formula and formula[1] else formula[0] if formula else ""


def sense(turn: float) -> str:
    """Return the words for the sense of a moment or a rate, not yet translated."""
    return COUNTER_CLOCKWISE if turn > 0.0 else CLOCKWISE


def force_formula(speaker: Speaker, size: Length) -> tuple[Formula, Formula] | None:
    """Return how a force follows, in names and in numbers: m a, m g, or as another; None for a datum."""
    match size:
        case Same(tail=tail, head=head):
            return speaker.symbol(speaker.vector(tail, head)), ""
        case Inertia(mass=mass):
            return product_of(speaker, f"F_i{mass.partition('_')[2]}")
    return product_of(speaker, getattr(size, "quantity", ""))


def product_of(speaker: Speaker, name: str) -> tuple[Formula, Formula] | None:
    """Return m a, m g or I epsilon of a body, in names and in numbers, by the name of what it makes."""
    plan, turns = speaker.subject.plan, turning(speaker.subject.plan.mechanism)
    for body in plan.mechanism.bodies:
        own, link = short_names(plan.mechanism)[body.link], turns.get(body.link, ("",))[0]
        mass, inertia = (f"m_{own}", body.mass), (f"I_{own}", body.inertia)
        found = {
            f"F_i{own}": (mass, (f"a_{body.centre}", plan.motion.acceleration[body.centre])),
            f"G_{own}": (mass, ("g", plan.mechanism.gravity)),
            f"M_i{own}": (inertia, (f"epsilon_{link}", plan.motion.epsilon.get(link))),
        }
        if name in found:
            names = tuple(speaker.symbol(letter) for letter, _ in found[name])
            values = (speaker.subject.number(np.abs(np.asarray(value))) for _, value in found[name])
            numbers = tuple(map(speaker.bare, values))
            return (names[0], TIMES, names[1]), (numbers[0], TIMES, numbers[1])
    return None


# Moments -------------------------------------------------------------------------------------------


def moments_of(speaker: Speaker, figure: str) -> list[MomentSum]:
    """Return the sums of moments of a plan; none of a plan without forces."""
    construction = speaker.subject.plan.construction
    return moment_sums(construction, figure, speaker.view) if group_of(figure) else []


def balance_of(speaker: Speaker, node: str) -> MomentSum | None:
    """Return the sum of moments from which the vector follows that ends in a node."""
    construction = speaker.subject.plan.construction
    step = construction.step(node)
    if not isinstance(step, Given) or not isinstance(step.length, Balance):
        return None
    name = speaker.vector(step.start, node)
    return next(one for one in moments_of(speaker, construction.figure_of(node)) if one.unknown == name)


def moment_lines(speaker: Speaker, total: MomentSum) -> Iterator[Formula]:
    """Yield the arms, and the sum of the moments, which is zero."""
    kL = speaker.scale_value("kL")  # noqa: N806 - the scale's own name
    terms = _terms(speaker, total)
    if not terms:
        return
    for arm in total.named_arms:
        mm = arm.mm(speaker.view)
        drawn = (speaker.tongue.number(mm, 2), TIMES, speaker.bare(kL))
        yield (speaker.symbol(arm.name), " = ", *drawn, " = ", speaker.real(mm * kL, "m"))
    unknown = speaker.symbol(total.unknown)
    lever = (unknown, TIMES, _lever_name(speaker, total.lever)) if total.lever else unknown
    is_positive = sum(value for value, _, _ in terms) > 0.0
    signed = [(value, name) for value, name, _ in terms] + [(-1.0 if is_positive else 1.0, lever)]
    yield (_sum_name(speaker, total.about), " = ", *_signed(signed), " = ", "0")


def _sum_name(speaker: Speaker, joint: str) -> Name:
    shown = speaker.subject.shown(joint)
    return Name((Piece("ΣM"), Piece(shown, -1)), f"ΣM_{shown}")


def moment_formula(speaker: Speaker, total: MomentSum) -> tuple[Formula, Formula] | None:
    """Return the unknown force or moment from the others' moments, in names and in numbers."""
    terms = _terms(speaker, total)
    if not terms:
        return None
    flip = 1.0 if sum(value for value, _, _ in terms) > 0.0 else -1.0
    names = _signed([(flip * value, name) for value, name, _ in terms])
    numbers = _signed([(flip * value, number) for value, _, number in terms])
    if total.lever is None:
        return names, numbers
    arm = speaker.bare(total.lever.mm(speaker.view) * speaker.scale_value("kL"))
    return Fraction(names, _lever_name(speaker, total.lever)), Fraction(numbers, arm)


def _terms(speaker: Speaker, total: MomentSum) -> list[tuple[float, Formula, Formula]]:
    """Return each moment, N m: its value with its sign, and its size in names and in numbers."""
    view, scale = speaker.view, speaker.scale_value("kL")
    found: list[tuple[float, Formula, Formula]] = []
    for arm in total.arms:
        moment, metres = arm.moment(view), arm.mm(view) * scale
        numbers = (speaker.bare(abs(moment) / metres), TIMES, speaker.bare(metres))
        found.append((moment, (speaker.symbol(arm.force.name), TIMES, speaker.symbol(arm.name)), numbers))
    for couple in total.couples:
        value = float(couple.at(view))
        found.append((value, speaker.symbol(couple.name), speaker.bare(abs(value))))
    return found


def _signed(terms: Sequence[tuple[float, Formula]]) -> tuple[Formula, ...]:
    """Write a sum: each term with its sign, the first without a plus."""
    signs = [
        (" + " if value >= 0.0 else " − ") if at else ("" if value >= 0.0 else "−")
        for at, (value, _) in enumerate(terms)
    ]
    return tuple(part for sign, (_, term) in zip(signs, terms, strict=True) for part in (sign, term) if part)


def _lever_name(speaker: Speaker, lever: Arm) -> Name:
    return speaker.symbol(lever.name) if lever.name else speaker.symbol(lever.force.point, lever.about)


def results(speaker: Speaker, figure: str) -> Iterator[Formula]:
    """Yield where the guides' reactions act, and the balancing moment from those on the driving link."""
    if not group_of(figure):
        return
    for one in acting_on(speaker.subject, figure):
        if one.is_found and (metres := abs(one.aside_m)) > LEAST_M:
            force = abs(one.force)
            names = Fraction(_sum_name(speaker, one.at), speaker.symbol(one.name))
            numbers = Fraction(speaker.bare(force * metres), speaker.bare(force))
            yield (speaker.symbol(one.aside), " = ", names, " = ", numbers, " = ", speaker.real(metres, "m"))
    for total in moments_of(speaker, figure):
        formula = moment_formula(speaker, total) if total.lever is None else None
        if formula is not None:
            yield from moment_lines(speaker, total)
            value = speaker.subject.number(speaker.subject.plan.rates[total.unknown])
            yield turning_as(speaker, total.unknown, value, " = ", formula[0], " = ", formula[1])


def turning_as(speaker: Speaker, name: str, value: float, *between: Formula) -> Formula:
    """Write a moment or a rate with its value and its sense."""
    told = (speaker.symbol(name), *between, " = ", speaker.real(abs(value), unit_of(name)))
    return (*told, f", {speaker.tongue.gettext(sense(value))}") if value else told


# The lever -----------------------------------------------------------------------------------------


def lever_table(speaker: Speaker) -> Grid:
    """Return the forces and couples on the lever with their arms and powers, and the powers' sum."""
    tongue = speaker.tongue
    rows: list[tuple[Formula, ...]] = [tuple(map(tongue.gettext, ON_LEVER))]
    omega, turns = speaker.subject.plan.motion.omega, turning(speaker.subject.plan.mechanism)
    for one in on_lever(speaker.subject):
        acting = one.acting
        value = speaker.real(abs(acting.force) or abs(acting.moment), unit_of(acting.name))
        rate = (
            ""
            if acting.force
            else speaker.real(speaker.subject.number(np.abs(omega[turns[acting.link][0]])), "rad/s")
        )
        arm = tongue.number(abs(one.arm_mm), 2) if acting.force else ""
        rows.append((speaker.symbol(acting.name), value, arm, rate, _power(speaker, one.power)))
    return Grid(tuple(rows), (0,) * len(ON_LEVER))


def _power(speaker: Speaker, watts: float) -> str:
    return ("−" if watts < 0.0 else "") + speaker.real(abs(watts), "W")


def lever_lines(speaker: Speaker) -> Iterator[Formula]:
    """Yield the balancing moment or force from the sum of the powers."""
    subject = speaker.subject
    plan, driver, solved = subject.plan, subject.plan.mechanism.driver, subject.plan.forces
    if solved is None:
        return
    loose, last = abs(sum(one.power for one in on_lever(subject))), solved.balancing
    if isinstance(driver, Crank) and last.along is None:
        unknown, rate, speed = "M_b", f"omega_{driver.link}", abs(subject.number(np.asarray(driver.omega)))
    else:
        # A cylinder pushes the pin away from its own point under it.
        under = [one.node for one in plan.mechanism.groups if getattr(one, "link", "") == last.by]
        velocity = plan.motion.velocity
        slide = velocity[last.joint] - (velocity[under[0]] if under else 0.0)
        unknown, rate = "F_b", f"v_{under[0] if under else ''}{last.joint}"
        speed = abs(subject.number(dot(np.asarray(last.along), np.asarray(slide))))
    names = speaker.symbol(unknown), speaker.symbol(rate)
    yield ("Σ", speaker.symbol("P"), " + ", names[0], TIMES, names[1], " = ", "0")
    if speed:
        fraction = Fraction(speaker.real(loose, "W"), speaker.bare(speed))
        yield (names[0], " = ", fraction, " = ", speaker.real(loose / speed, unit_of(unknown)))
