"""Explain the whole construction step by step: sentences, the numbers behind them, and the results."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from grader.language import N_, Tongue
from grader.solution import sentences
from grader.solution.sentences import TITLES, Speaker, speaker_of
from reference.construction.elements import Coriolis, Normal, Scaled
from reference.construction.graph import Vector
from reference.construction.steps import Given, Step
from reference.drawing.subject import Subject
from reference.mechanism import Crank
from reference.quantities import SCALE_OF, kind_of, unit_of

INTRODUCTIONS = {
    "mechanism": N_("Every real length is divided by %(scale)s."),
    "velocity_plan": N_(
        "Every velocity is divided by %(scale)s; directions are taken from the mechanism sketch."
    ),
    "acceleration_plan": N_(
        "Every acceleration is divided by %(scale)s; normal components point towards the centre of rotation."
    ),
    "centres": N_(
        "Points of a moving link that have no velocity (instantaneous centres I) or no acceleration "
        "(acceleration poles J) at this moment, by Mehmke's similarity."
    ),
}
CENTRES = "centres"
COUNTER_CLOCKWISE, CLOCKWISE = N_("counter-clockwise"), N_("clockwise")
LENGTHS_MM = N_("Directions count counter-clockwise from the horizontal to the right.")


@dataclass(frozen=True, slots=True)
class ExplainedStep:
    """One step: what is computed before, what is drawn, what can be measured afterwards."""

    number: int
    step: Step
    before: tuple[Markup, ...]
    sentence: Markup
    after: tuple[Markup, ...]

    @property
    def text(self) -> Markup:
        """The whole text, line by line."""
        return Markup("\n").join((*self.before, self.sentence, *self.after))


@dataclass(frozen=True, slots=True)
class PlanSection:
    """The steps of one figure."""

    figure: str
    title: str
    introduction: Markup
    steps: tuple[ExplainedStep, ...]


def explain(subject: Subject, tongue: Tongue) -> list[PlanSection]:
    """Return every figure's steps, in the order in which they are drawn."""
    speaker = speaker_of(subject, tongue)
    sections, number = [], 0
    for figure, steps in subject.plan.construction.figures.items():
        told = []
        for step in steps:
            number += 1
            told.append(_explanation(speaker, number, step))
        introduction = speaker.say(INTRODUCTIONS[figure], scale=speaker.scale_with_value(SCALE_OF[figure]))
        sections.append(PlanSection(figure, tongue.gettext(TITLES[figure]), introduction, tuple(told)))
    centres = tuple(
        ExplainedStep(number + k, step, (), sentences.sentence(speaker, step), ())
        for k, step in enumerate(_centre_steps(speaker), start=1)
    )
    if centres:
        introduction = speaker.say(INTRODUCTIONS[CENTRES])
        sections.append(PlanSection(CENTRES, tongue.gettext(TITLES[CENTRES]), introduction, centres))
    return sections


def _centre_steps(speaker: Speaker) -> list[Step]:
    """Return the steps of the centres that lie on the paper."""
    on_paper = speaker.subject.centres
    return [step for name, step in speaker.subject.plan.construction.centres.items() if name in on_paper]


def _explanation(speaker: Speaker, number: int, step: Step) -> ExplainedStep:
    before = tuple(computed(speaker, step))
    after = tuple(_read_off(speaker, step))
    return ExplainedStep(number, step, before, sentences.sentence(speaker, step), after)


def computed(speaker: Speaker, step: Step) -> Iterator[Markup]:
    """Yield the lengths that the step draws, from data or from earlier figures."""
    if isinstance(step, Given) and not isinstance(step.length, Scaled):
        yield from _component(speaker, step)
        return
    for length in sentences.scaled_names(step):
        name, real = _datum(speaker, step, length)
        if real == 0.0:
            continue
        formula = _crank_formula(speaker, length)
        if formula is not None:
            yield Markup("{} = {} = {}").format(name, formula, speaker.real(real, kind_of(length.scale).unit))
        yield _divided(speaker, name, real, length.scale)


def _datum(speaker: Speaker, step: Step, length: Scaled) -> tuple[Markup, float]:
    """Return a given quantity's name and value."""
    real = abs(float(speaker.view.parameters[length.quantity]))
    if length.scale == "kL" and " " not in length.quantity:
        return speaker.name(length.quantity), real
    if isinstance(step, Given):
        return speaker.vector(step.start, step.node), real
    letter, _, node = length.quantity.partition(" ")
    return Markup("<i>{}</i><sub>{}</sub>").format({"offset": "e"}.get(letter, letter), node), real


def _crank_formula(speaker: Speaker, length: Scaled) -> Markup | None:
    """Return the formula for a velocity or acceleration of the crank's pin from the crank's motion."""
    driver = speaker.subject.plan.mechanism.driver
    if not isinstance(driver, Crank) or length.scale == "kL":
        return None
    turns = length.quantity == f"a_{driver.pin}_t"
    rate, power = (driver.epsilon, "") if turns else (driver.omega, "")
    if length.quantity == f"a_{driver.pin}_n":
        power = "²"
    symbol = speaker.rate(f"{'epsilon' if turns else 'omega'}_{driver.link}")
    arm = speaker.name(driver.pivot, driver.pin)
    numbers = (
        speaker.bare(abs(speaker.subject.number(np.asarray(value)))) for value in (rate, driver.length_m)
    )
    return Markup("{}{} · {} = {}{} · {}").format(symbol, power, arm, next(numbers), power, next(numbers))


def _component(speaker: Speaker, step: Given) -> Iterator[Markup]:
    """Yield a normal or Coriolis component, from velocities of the plan drawn before."""
    mm = abs(float(step.length.at(speaker.view)))
    if speaker.is_nothing(step.node, mm):
        return
    name, real = speaker.vector(step.start, step.node), mm * speaker.scale_value("ka")
    unit = kind_of("ka").unit
    if isinstance(step.length, Normal):
        squared, arm = _speed(speaker, (step.length.tail, step.length.head)), _arm(speaker, step.length)
        link = speaker.link_of(step.node)
        yield Markup("{} = {}² / {} = {}² / {} = {}").format(
            name, squared[0], link, speaker.bare(squared[1]), speaker.bare(arm), speaker.real(real, unit)
        )
    if isinstance(step.length, Coriolis):
        slide = _speed(speaker, step.length.slide)
        carrier = speaker.carrier_of(step.node)
        rate, turn = f"omega_{carrier}", speaker.subject.plan.motion.omega[carrier]
        omega = abs(speaker.subject.number(np.asarray(turn)))
        yield Markup("{} = 2 · {} · {} = 2 · {} · {} = {}").format(
            name, speaker.rate(rate), slide[0], speaker.bare(omega), speaker.bare(slide[1]),
            speaker.real(real, unit),
        )  # fmt: skip
    yield _divided(speaker, name, real, "ka")


def _speed(speaker: Speaker, ends: tuple[str, str]) -> tuple[Markup, float]:
    """Return a velocity of the plan by its ends: its name and its value."""
    return speaker.vector(*ends), speaker.distance(*ends) * speaker.scale_value("kv")


def _arm(speaker: Speaker, length: Normal) -> float:
    view = speaker.view
    if length.measured is not None:
        return float(view.real_length(*length.measured))
    return float(view.parameters[length.length])


def _divided(speaker: Speaker, name: Markup, real: float, scale: str) -> Markup:
    """Write a real value converted to paper: real / scale = millimetres."""
    by = speaker.scale_value(scale)
    numbers = Markup("{} / {} = {}").format(speaker.bare(real), speaker.bare(by), speaker.mm(real / by))
    return Markup("{} / {} = {}").format(name, speaker.scale(scale), numbers)


def _read_off(speaker: Speaker, step: Step) -> Iterator[Markup]:
    """Yield the vectors that end in the step's node, and the rates that follow from them."""
    construction = speaker.subject.plan.construction
    laid_off = (step.start, step.node) if isinstance(step, Given) else None
    for vector in construction.vectors.values():
        if vector.head != step.node:
            continue
        if (vector.tail, vector.head) != laid_off:
            yield _measured(speaker, vector)
        for rate in construction.rates.values():
            if rate.vector == vector.name and not rate.drives:
                yield _turning(speaker, rate.name, vector)


def _measured(speaker: Speaker, vector: Vector) -> Markup:
    """Write a measured vector: drawn length times scale."""
    mm = 0.0 if speaker.subject.is_zero(vector.name) else speaker.distance(vector.tail, vector.head)
    by = speaker.scale_value(vector.scale)
    return Markup("{} = {} · {} = {} · {} = {}").format(
        speaker.name(vector.name), speaker.name(vector.tail, vector.head), speaker.scale(vector.scale),
        speaker.tongue.number(mm, 2), speaker.bare(by), speaker.real(mm * by, unit_of(vector.name)),
    )  # fmt: skip


def _turning(speaker: Speaker, name: str, vector: Vector) -> Markup:
    """Write an angular velocity or acceleration: relative vector over length, with its sense."""
    plan = speaker.subject.plan
    rate = plan.construction.rates[name]
    arm = float(speaker.view.parameters[rate.length])
    zero = speaker.subject.is_zero(vector.name)
    turn = 0.0 if zero else speaker.subject.number(plan.rates[name])
    told = Markup("{} = {} / {} = {} / {} = {}").format(
        speaker.rate(name), speaker.name(vector.name), speaker.name(*rate.link),
        speaker.bare(abs(turn) * arm), speaker.bare(arm), speaker.real(abs(turn), unit_of(name)),
    )  # fmt: skip
    if turn == 0.0:
        return told
    return Markup("{}, {}").format(told, speaker.tongue.gettext(COUNTER_CLOCKWISE if turn > 0 else CLOCKWISE))
