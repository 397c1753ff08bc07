"""Explain the whole construction step by step: sentences, the numbers behind them, and the results."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from markupsafe import Markup

from grader.language import N_, Tongue
from grader.solution import sentences
from grader.solution.equations import driving_speed, grid_of, scale_formula, size_formula
from grader.solution.forces import LEVER as ON_THE_LEVER
from grader.solution.forces import (
    balance_of,
    lever_lines,
    lever_table,
    moment_lines,
    results,
    table_of,
    turning_as,
)
from grader.solution.formulas import Formula, Fraction, Grid, Name, grid_text, plain
from grader.solution.sentences import TITLES, Speaker, speaker_of
from reference.construction.elements import Length, Scaled
from reference.construction.equations import Equation, equations
from reference.construction.graph import AngularRate, Vector
from reference.construction.steps import Given, Step
from reference.drawing.canvas import Piece
from reference.drawing.forces import LEVER
from reference.drawing.subject import Subject
from reference.quantities import group_of, kind_of, scale_of, sort_of, unit_of

CENTRES = "centres"
INTRODUCTIONS = {
    "kL": N_("Every real length is divided by %(scale)s."),
    "kv": N_("Every velocity is divided by %(scale)s; directions are taken from the mechanism sketch."),
    "ka": N_(
        "Every acceleration is divided by %(scale)s; normal components point towards the centre of rotation."
    ),
    "kF": N_(
        "Every force is divided by %(scale)s; each vector begins where the one before it ends, in any order."
    ),
    CENTRES: N_(
        "Points of a moving link that have no velocity (instantaneous centres I) or no acceleration "
        "(acceleration poles J) at this moment, by Mehmke's similarity."
    ),
}
LENGTHS_MM = N_("Directions count counter-clockwise from the horizontal to the right.")


EQUATIONS = N_(
    "Below each vector of an equation stand its size and its direction: ✓ is known from an earlier step, "
    "? is not known. A vector underlined twice is known in both, a vector underlined once in one of them; "
    "an equation gives two unknowns."
)
NOTES = (LENGTHS_MM, EQUATIONS)


@dataclass(frozen=True, slots=True)
class ExplainedStep:
    """One step: its vector equation, what is computed before, what is drawn, what can be measured afterwards.

    An equation stands at the first step that draws a part of it.
    """

    number: int
    step: Step
    sentence: Markup
    before: tuple[Formula, ...] = ()
    after: tuple[Formula, ...] = ()
    equation: Grid | None = None

    @property
    def text(self) -> str:
        """The whole text, line by line."""
        before, after = (
            [plain(line, in_unicode=True) for line in lines] for lines in (self.before, self.after)
        )
        equation = [grid_text(self.equation)] if self.equation else []
        return "\n".join((*equation, *before, self.sentence.unescape(), *after))


@dataclass(frozen=True, slots=True)
class PlanSection:
    """The steps of one figure; `formulas` and a `table` come before them, `rates` after them."""

    figure: str
    title: str
    introduction: Markup
    steps: tuple[ExplainedStep, ...]
    formulas: tuple[Formula, ...] = ()
    rates: tuple[Formula, ...] = ()
    table: Grid | None = None


def explain(
    subject: Subject, tongue: Tongue, write: Callable[[Name], Markup] = sentences.markup_of
) -> list[PlanSection]:
    """Return every figure's steps, in the order in which they are drawn; `write` shows names in sentences."""
    speaker = speaker_of(subject, tongue, write)
    construction = subject.plan.construction
    known = equations(construction)
    sections, number = [], 0
    for figure, steps in construction.figures.items():
        told = []
        for step in steps:
            number += 1
            equation = known.get(step.node)
            is_first = equation is not None and equation.sums and equation.nodes[0] == step.node
            told.append(_explanation(speaker, number, step, equation if is_first else None))
        scale = scale_of(figure)
        introduction = speaker.say(INTRODUCTIONS[scale], scale=speaker.write(speaker.scale(scale)))
        formulas = [*driving_speed(speaker)] if scale == "kv" else []
        formulas.append(scale_formula(speaker, scale))
        vectors = {vector.name for vector in construction.vectors_of(figure)}
        found = (one for one in construction.rates.values() if one.vector in vectors and not one.drives)
        rates = [*(_turning(speaker, rate) for rate in found), *results(speaker, figure)]
        title = tongue.gettext(TITLES[subject.title_key(sort_of(figure), figure)])
        title = title.replace("{group}", subject.shown(group_of(figure)))
        table = table_of(speaker, figure) if group_of(figure) else None
        sections.append(
            PlanSection(figure, title, introduction, tuple(told), tuple(formulas), tuple(rates), table)
        )
    if subject.plan.forces is not None:
        introduction = speaker.say(ON_THE_LEVER, scale=speaker.write(speaker.scale("kv")))
        lines, table = tuple(lever_lines(speaker)), lever_table(speaker)
        sections.append(PlanSection(LEVER, tongue.gettext(TITLES[LEVER]), introduction, (), (), lines, table))
    on_paper = subject.centres
    shown = (step for name, step in construction.centres.items() if name in on_paper)
    centres = tuple(
        ExplainedStep(k, step, sentences.sentence(speaker, step))
        for k, step in enumerate(shown, start=number + 1)
    )
    if centres:
        introduction = speaker.say(INTRODUCTIONS[CENTRES])
        sections.append(PlanSection(CENTRES, tongue.gettext(TITLES[CENTRES]), introduction, centres))
    return sections


def _explanation(speaker: Speaker, number: int, step: Step, equation: Equation | None) -> ExplainedStep:
    grid = None if equation is None else grid_of(speaker, equation, with_numbers=True)
    before, after = tuple(computed(speaker, step)), tuple(_read_off(speaker, step))
    return ExplainedStep(number, step, sentences.sentence(speaker, step), before, after, grid)


def computed(speaker: Speaker, step: Step) -> Iterator[Formula]:
    """Yield the lengths that the step draws, from data or from earlier figures."""
    figure = speaker.subject.plan.construction.figure_of(step.node)
    on_plan = figure != "mechanism"
    for length in [step.length] if isinstance(step, Given) else sentences.scaled_names(step):
        mm = abs(float(length.at(speaker.view)))
        scale = length.scale if isinstance(length, Scaled) else scale_of(figure)
        real = mm * speaker.scale_value(scale)
        if real == 0.0 or speaker.is_nothing(step.node, mm):
            continue
        if (total := balance_of(speaker, step.node)) is not None:
            yield from moment_lines(speaker, total)
        if isinstance(step, Given) and on_plan:
            name = speaker.symbol(speaker.vector(step.start, step.node))
        else:
            name = _datum(speaker, length)
        formula = size_formula(speaker, length, step.node)
        if formula is not None:
            shown = (part for one in formula if one for part in (" = ", one))
            yield (name, *shown, " = ", speaker.real(real, kind_of(scale).unit))
        numbers = Fraction(speaker.bare(real), speaker.bare(speaker.scale_value(scale)))
        yield (Fraction(name, speaker.scale(scale)), " = ", numbers, " = ", speaker.mm(mm))


def _datum(speaker: Speaker, length: Length) -> Name:
    """Return a given quantity's name."""
    quantity = getattr(length, "quantity", "")
    letter, _, node = quantity.partition(" ")
    if not node:
        return speaker.symbol(quantity)
    return Name((Piece({"offset": "e"}.get(letter, letter)), Piece(node, -1)), f"{letter}_{node}")


def _read_off(speaker: Speaker, step: Step) -> Iterator[Formula]:
    """Yield the vectors that end in the step's node and were not laid off."""
    laid_off = (step.start, step.node) if isinstance(step, Given) else None
    vectors = speaker.subject.plan.construction.vectors
    for vector in vectors.values():
        if vector.head == step.node and (vector.tail, vector.head) != laid_off:
            parts = [f"{vector.name}_{part}" for part in "nt"]
            if not speaker.has_letters(step.node) and vectors.keys() >= {*parts}:
                whole, n, t = (
                    replace(speaker.symbol(name), is_vector=True) for name in (vector.name, *parts)
                )
                yield (whole, " = ", n, " + ", t)
            yield _measured(speaker, vector)


def _measured(speaker: Speaker, vector: Vector) -> Formula:
    """Write a measured vector: drawn length times scale."""
    mm = 0.0 if speaker.subject.is_zero(vector.name) else speaker.distance(vector.tail, vector.head)
    by = speaker.scale_value(vector.scale)
    numbers = f"{speaker.tongue.number(mm, 2)} · {speaker.bare(by)}"
    real = speaker.real(mm * by, unit_of(vector.name))
    if speaker.has_letters(vector.head):
        drawn = (speaker.symbol(vector.tail, vector.head), " · ", speaker.scale(vector.scale))
        return (speaker.symbol(vector.name), " = ", drawn, " = ", numbers, " = ", real)
    value = speaker.subject.vector(speaker.subject.plan.vectors_si[vector.name])
    angle = f", {speaker.degrees(value)}" if mm else ""
    return (speaker.symbol(vector.name), " = ", numbers, " = ", real, angle)


def _turning(speaker: Speaker, rate: AngularRate) -> Formula:
    """Write an angular velocity or acceleration: relative vector over length, with its sense."""
    plan, name = speaker.subject.plan, rate.name
    arm = float(speaker.view.parameters[rate.length])
    zero = speaker.subject.is_zero(rate.vector)
    turn = 0.0 if zero else speaker.subject.number(plan.rates[name])
    numbers = Fraction(speaker.bare(abs(turn) * arm), speaker.bare(arm))
    names = Fraction(speaker.symbol(rate.vector), speaker.symbol(*rate.link))
    return turning_as(speaker, name, turn, " = ", names, " = ", numbers)
