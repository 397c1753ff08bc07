"""Students' mistakes, as changes of the drawing that they intend.

Based on what is known of students' work, not on what the grader looks for: feet of lines anywhere
among the points drawn before, perpendiculars to lines that are not links, speeds computed without 2 pi or
without the 60, squares forgotten, digits exchanged, scales rounded otherwise than declared. A mistake has a
code of the published formats, so that a report can be compared with it.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from reference.authored.assignment import Assignment, Variant
from reference.construction.elements import (
    Along,
    AnyLine,
    Balance,
    Coriolis,
    Direction,
    Inertia,
    Line,
    Normal,
    Parameters,
    Same,
    Scaled,
)
from reference.construction.graph import Construction, evaluate, parameters_of
from reference.construction.steps import ArcAndLine, Coincide, Given, Similar, Step, TwoArcs, TwoLines
from samples.simulation.settings import ACCELERATION, MECHANISM, PLANS, VELOCITY

SCALE_OF = {VELOCITY: "kv", ACCELERATION: "ka"}
SPEED_FACTORS = (30.0 / math.pi, 60.0, 1.0 / math.tau)
"""The crank's speed taken as n; as 2 pi n, without the 60; as n / 60, without 2 pi."""
SCALE_FACTORS = (0.1, 0.5, 0.8, 1.25, 2.0, 10.0)
"""A scale misplaced by a decimal, halved or doubled, or rounded otherwise than declared."""
ARITHMETIC_FACTORS = (0.1, 0.5, 2.0, 10.0)
"""A decimal point, a half forgotten or put in; `_computing_errors` has those that depend on the numbers."""
VISIBLE_ERROR = 0.15
"""An error in computing that changes a length by a smaller share is none."""


@dataclass(frozen=True, slots=True)
class Intent:
    """The drawing that somebody intends: its steps, and the data and scales used."""

    construction: Construction
    parameters: Parameters


@dataclass(frozen=True, slots=True)
class StudentMistake:
    """One mistake.

    Attributes
    ----------
    code : one of `CODES`
    at : the node, vector, scale or figure where it is made
    slot : which of a step's two lines
    other : the two joints or the node taken instead; the two nodes whose letters are exchanged
    factor : factor of a length, speed or scale
    quarters : quarter turns of a figure, counter-clockwise
    n, position : another student's variant; parameters : its data
    """

    code: str
    at: str
    slot: int = 0
    other: tuple[str, ...] = ()
    factor: float = 1.0
    quarters: int = 0
    n: int | None = None
    position: int | None = None
    parameters: Parameters = field(default_factory=dict, repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class Occasion:
    """A student's right drawing, in which mistakes can be made."""

    assignment: Assignment
    variant: Variant
    right: Intent

    @property
    def construction(self) -> Construction:
        """The construction as it should be drawn."""
        return self.right.construction

    def steps(self, *figures: str) -> Iterator[Step]:
        """The steps of some figures."""
        for figure in figures:
            yield from self.construction.figures.get(figure, ())


def possible(code: str, occasion: Occasion) -> list[StudentMistake]:
    """Every mistake of a kind that the drawing admits, and with which it stays on the paper."""
    found = list({**_PLACES, **_OF_FORCES}[code](occasion))
    if code in {"other_variant", "vector_missing", "labels_swapped", "rpm_not_converted"}:
        return found
    if code in _OF_FORCES:
        found = [one for one in found if _is_seen(with_mistake(occasion.right, one), occasion.right)]
    return [one for one in found if fits_paper(with_mistake(occasion.right, one), occasion.right)]


SEEN_MM = 2.0
"""A mistake in forces that moves no node by more is none: a couple that is zero, an arm across the link."""


def _is_seen(drawing: Intent, right: Intent) -> bool:
    nodes = evaluate(drawing.construction, drawing.parameters)
    proper = evaluate(right.construction, right.parameters)
    return any(abs(complex(nodes[name]) - complex(proper[name])) > SEEN_MM for name in proper)


def fits_paper(drawing: Intent, right: Intent) -> bool:
    """Return whether every node exists and none lies far off the paper."""
    nodes = evaluate(drawing.construction, drawing.parameters)
    proper = evaluate(right.construction, right.parameters)
    limit = max(1.6 * max(abs(complex(node)) for node in proper.values()) + 40.0, 220.0)
    return all(np.isfinite(node) and abs(complex(node)) < limit for node in nodes.values())


# Possible mistakes --------------------------------------------------------------------------------


def _laid_off_backwards(occasion: Occasion) -> Iterator[StudentMistake]:
    """The driving link's vector reversed: the sign of a clockwise crank."""
    for step in occasion.steps(*PLANS):
        if isinstance(step, Given) and isinstance(step.length, Scaled):
            yield StudentMistake("sense_reversed", step.node)


def _components(occasion: Occasion) -> Iterator[Given]:
    """The steps of computed components."""
    for step in occasion.steps(ACCELERATION):
        if isinstance(step, Given) and isinstance(step.length, Normal | Coriolis):
            yield step


def _normal_forgotten(occasion: Occasion) -> Iterator[StudentMistake]:
    yield from (StudentMistake("normal_missing", step.node) for step in _components(occasion))


def _normal_from_the_wrong_side(occasion: Occasion) -> Iterator[StudentMistake]:
    yield from (StudentMistake("normal_reversed", step.node) for step in _components(occasion))


def _normal_by_the_absolute_velocity(occasion: Occasion) -> Iterator[StudentMistake]:
    """v_B in place of v_BA in v^2 / l."""
    pole = occasion.construction.poles[VELOCITY]
    for step in _components(occasion):
        if isinstance(step.length, Normal) and step.length.tail != pole:
            yield StudentMistake("normal_from_absolute", step.node)


def _computing_errors(occasion: Occasion) -> Iterator[StudentMistake]:
    nodes = evaluate(occasion.construction, occasion.right.parameters)
    kv = float(occasion.right.parameters["kv"])
    for step in _components(occasion):
        size = abs(complex(nodes[step.node] - nodes[step.start]))
        factors = list(ARITHMETIC_FACTORS)
        if isinstance(step.length, Normal):
            speed = abs(complex(nodes[step.length.head] - nodes[step.length.tail])) * kv
            factors += [1.0 / speed] if speed else []  # v in place of v^2
        ones, tens = round(size) % 10, round(size) // 10 % 10
        factors += [(size - 9.0 * (tens - ones)) / size] if size >= 10.0 else []  # 36 for 63
        for factor in factors:
            if abs(factor - 1.0) > VISIBLE_ERROR:
                yield StudentMistake("arithmetic", step.node, factor=factor)


def _lines(occasion: Occasion) -> Iterator[tuple[TwoLines, int, Line]]:
    """The lines of the plans that are drawn by directions of the sketch: step, which line, the line."""
    for step in occasion.steps(*PLANS):
        if isinstance(step, TwoLines):
            for slot, line in enumerate((step.first, step.second)):
                if isinstance(line, Line) and isinstance(line.along, Along):
                    yield step, slot, line


def _along_for_across(occasion: Occasion) -> Iterator[StudentMistake]:
    """A line drawn parallel to the link instead of perpendicular; the driving link's vector too."""
    for step, slot, _ in _lines(occasion):
        yield StudentMistake("parallel_for_perpendicular", step.node, slot)
    for drawn in occasion.steps(*PLANS):
        if isinstance(drawn, Given) and isinstance(drawn.length, Scaled) and isinstance(drawn.along, Along):
            yield StudentMistake("parallel_for_perpendicular", drawn.node)


def _across_another_link(occasion: Occasion) -> Iterator[StudentMistake]:
    """A line perpendicular to another link at the same joint, or to the line to the fixed pivot."""
    construction = occasion.construction
    under = {s.node: s.other for s in occasion.steps(MECHANISM) if isinstance(s, Coincide)}
    pivots = [step.node for step in occasion.steps(MECHANISM) if not step.needs]
    for step, slot, line in _lines(occasion):
        mine = {under.get(joint, joint) for joint in line.along.needs}
        links = [pair for pair in construction.links.values() if mine & {under.get(one, one) for one in pair}]
        radii = [
            (pivot, joint) for pivot in pivots for joint in line.along.needs if pivot in _joints(occasion)
        ]
        for pair in dict.fromkeys((*links, *radii)):
            places = {under.get(joint, joint) for joint in pair}
            if len(places) == 2 and places != mine:
                yield StudentMistake("wrong_link", step.node, slot, other=pair)


def _joints(occasion: Occasion) -> frozenset[str]:
    return frozenset(joint for pair in occasion.construction.links.values() for joint in pair)


def _through_another_point(occasion: Occasion) -> Iterator[StudentMistake]:
    """A line drawn through any earlier point of the plan except the two right ones."""
    for step, slot, line in _lines(occasion):
        right = {one.through for one in (step.first, step.second) if isinstance(one, Line)}
        for before in occasion.steps(occasion.construction.figure_of(step.node)):
            if before.node == step.node:
                break
            if before.node not in right | {line.through}:
                yield StudentMistake("wrong_intersection", step.node, slot, other=(before.node,))


def _triangle_turned_over(occasion: Occasion) -> Iterator[StudentMistake]:
    nodes = evaluate(occasion.construction, occasion.right.parameters)
    for node, image in occasion.construction.images.items():
        if node not in {step.node for step in occasion.steps(*PLANS)}:
            continue
        first, second, third = (complex(nodes[corner]) for corner in image.model)
        if abs(((third - first) / (second - first)).imag) > VISIBLE_ERROR:
            yield StudentMistake("image_mirrored", node)


def _other_crossing(occasion: Occasion) -> Iterator[StudentMistake]:
    for step in occasion.steps(MECHANISM):
        if isinstance(step, TwoArcs | ArcAndLine):
            yield StudentMistake("other_assembly", step.node)


def _other_scale(occasion: Occasion) -> Iterator[StudentMistake]:
    del occasion
    for plan in PLANS:
        yield from (StudentMistake("scale_wrong", SCALE_OF[plan], factor=one) for one in SCALE_FACTORS)


def _turned_plan(occasion: Occasion) -> Iterator[StudentMistake]:
    del occasion
    for plan in PLANS:
        yield from (StudentMistake("figure_rotated", plan, quarters=quarters) for quarters in (1, 2, 3))


def _speed_unconverted(occasion: Occasion) -> Iterator[StudentMistake]:
    if "angle crank" in occasion.right.parameters:
        yield from (StudentMistake("rpm_not_converted", VELOCITY, factor=one) for one in SPEED_FACTORS)


def _vector_left_out(occasion: Occasion) -> Iterator[StudentMistake]:
    for name, vector in occasion.construction.vectors.items():
        if vector.part not in {"n", "c"} and not vector.is_sum:
            yield StudentMistake("vector_missing", name)


def _letters_exchanged(occasion: Occasion) -> Iterator[StudentMistake]:
    for plan in PLANS:
        nodes = [step.node for step in occasion.steps(plan) if not step.node.startswith(("n_", "k_"))]
        yield from (StudentMistake("labels_swapped", plan, other=pair) for pair in combinations(nodes[1:], 2))


def _data_of_another(occasion: Occasion) -> Iterator[StudentMistake]:
    for other in occasion.assignment.variants():
        if other != occasion.variant:
            scales = occasion.assignment.scales([other])
            known = parameters_of(occasion.assignment.mechanism([other]), scales.kL, scales.kv, scales.ka)
            at = "n" if other.n is not None else "position"
            yield StudentMistake(
                "other_variant", at, n=other.n, position=other.position, parameters=scalars(known)
            )


# In force plans


def _forces_laid_off(occasion: Occasion) -> Iterator[tuple[str, str]]:
    """The forces whose size is a datum or taken over, with the datum that a mistake changes."""
    known: set[str] = set()
    for vector in occasion.construction.vectors.values():
        step = occasion.construction.step(vector.head)
        if vector.scale != "kF" or not isinstance(step, Given) or step.node in known:
            continue
        known.add(step.node)
        match step.length:
            case Scaled(quantity=datum) | Inertia(mass=datum) | Same(sense=datum):
                yield vector.name, datum


def _couples_on_links(occasion: Occasion) -> Iterator[str]:
    for step in occasion.construction.steps:
        if isinstance(step, Given) and isinstance(step.length, Balance):
            yield from (one.inertia or one.name for one in step.length.moments.couples)


def _changed_data(
    code: str, occasion: Occasion, at: str, factor: float, names: Collection[str]
) -> StudentMistake:
    known = occasion.right.parameters
    changed = {name: np.asarray(factor * known.get(name, 1.0)) for name in names}
    return StudentMistake(code, at, factor=factor, parameters=changed)


def _along_the_acceleration(occasion: Occasion) -> Iterator[StudentMistake]:
    """All inertia forces along the acceleration, as people have it who do not know d'Alembert, or one."""
    data = {name: datum for name, datum in _forces_laid_off(occasion) if name.startswith("F_i")}
    yield _changed_data("inertia_reversed", occasion, "F_i", -1.0, {*data.values()})
    for name, datum in data.items():
        yield _changed_data("inertia_reversed", occasion, name, -1.0, {datum})


def _force_forgotten(occasion: Occasion) -> Iterator[StudentMistake]:
    for name, datum in _forces_laid_off(occasion):
        if not name.startswith("R_"):
            yield _changed_data("force_missing", occasion, name, 0.0, {datum})


def _force_the_wrong_way(occasion: Occasion) -> Iterator[StudentMistake]:
    """A load or a reaction taken over from another group, in the sense that it had there."""
    for name, datum in _forces_laid_off(occasion):
        if not name.startswith(("F_i", "G_")):
            yield _changed_data("force_reversed", occasion, name, -1.0, {datum})


def _couple_forgotten(occasion: Occasion) -> Iterator[StudentMistake]:
    for name in dict.fromkeys(_couples_on_links(occasion)):
        yield _changed_data("couple_missing", occasion, name, 0.0, {name})


def _couple_the_wrong_way(occasion: Occasion) -> Iterator[StudentMistake]:
    for name in dict.fromkeys(_couples_on_links(occasion)):
        yield _changed_data("couple_reversed", occasion, name, -1.0, {name})


def _arm_to_the_point(occasion: Occasion) -> Iterator[StudentMistake]:
    """The distance of a force's point for its arm."""
    for step in occasion.construction.steps:
        if isinstance(step, Given) and isinstance(step.length, Balance):
            moments = step.length.moments
            for slot, force in enumerate(moments.forces):
                if force.point != moments.about:
                    yield StudentMistake("wrong_arm", step.node, slot)


_OF_FORCES: Mapping[str, Callable[[Occasion], Iterator[StudentMistake]]] = {
    "inertia_reversed": _along_the_acceleration,
    "force_missing": _force_forgotten,
    "force_reversed": _force_the_wrong_way,
    "couple_missing": _couple_forgotten,
    "couple_reversed": _couple_the_wrong_way,
    "wrong_arm": _arm_to_the_point,
}
CODES_OF_FORCES = tuple(_OF_FORCES)
"""The codes of mistakes in force plans."""
_PLACES: Mapping[str, Callable[[Occasion], Iterator[StudentMistake]]] = {
    "parallel_for_perpendicular": _along_for_across,
    "wrong_link": _across_another_link,
    "sense_reversed": _laid_off_backwards,
    "rpm_not_converted": _speed_unconverted,
    "scale_wrong": _other_scale,
    "normal_reversed": _normal_from_the_wrong_side,
    "normal_missing": _normal_forgotten,
    "normal_from_absolute": _normal_by_the_absolute_velocity,
    "other_variant": _data_of_another,
    "other_assembly": _other_crossing,
    "image_mirrored": _triangle_turned_over,
    "wrong_intersection": _through_another_point,
    "vector_missing": _vector_left_out,
    "labels_swapped": _letters_exchanged,
    "figure_rotated": _turned_plan,
    "arithmetic": _computing_errors,
}
CODES = tuple(_PLACES)
"""The codes of mistakes in velocity and acceleration plans."""


def scalars(parameters: Parameters) -> dict[str, np.ndarray]:
    """The parameters of a single variant."""
    return {name: np.asarray(np.asarray(value).reshape(-1)[0]) for name, value in parameters.items()}


# Making it ----------------------------------------------------------------------------------------


def with_mistake(intent: Intent, mistake: StudentMistake) -> Intent:
    """The intended drawing with this mistake in it; later steps follow from it.

    Exchanged letters change nothing that is drawn. Raises ValueError if the mistake cannot be made.
    """
    construction, known = intent.construction, intent.parameters
    match mistake.code:
        case "labels_swapped":
            return intent
        case "vector_missing":
            left = {name: one for name, one in construction.vectors.items() if name != mistake.at}
            return Intent(replace(construction, vectors=left), known)
        case "other_variant":
            own = {name: known[name] for name in ("kL", "kv", "ka", "turn") if name in known}
            return Intent(construction, {**mistake.parameters, **own})
        case "scale_wrong":
            return Intent(construction, {**known, mistake.at: np.asarray(known[mistake.at] * mistake.factor)})
        case "rpm_not_converted":
            return Intent(construction, _at_another_speed(construction, known, mistake.factor))
        case code if code in _OF_FORCES and mistake.parameters:
            return Intent(construction, {**known, **mistake.parameters})
        case "figure_rotated":
            return Intent(_turned(construction, mistake.at, mistake.quarters), known)
        case _:
            return Intent(construction.with_step(_done_wrongly(construction, mistake)), known)


def _at_another_speed(construction: Construction, known: Parameters, factor: float) -> dict[str, np.ndarray]:
    """Data with the driving link's values and the scales proportional to them changed: the plans stay."""
    powers = {"kv": 1, "ka": 2}
    for steps in construction.figures.values():
        for step in steps:
            if isinstance(step, Given) and isinstance(step.length, Scaled) and step.length.scale in powers:
                tangential = step.length.quantity.endswith("_t")
                powers[step.length.quantity] = 0 if tangential else powers[step.length.scale]
    return {name: np.asarray(value * factor ** powers.get(name, 0)) for name, value in known.items()}


def _done_wrongly(construction: Construction, mistake: StudentMistake) -> Step:
    """A node's step with the mistake in it. Raises ValueError where it cannot be made."""
    step = construction.step(mistake.at)
    match mistake.code, step:
        case (("sense_reversed" | "normal_reversed"), Given()):
            return replace(step, along=_quarters(step.along, 2))
        case "parallel_for_perpendicular", Given():
            return replace(step, along=_quarters(step.along, 1))
        case "normal_missing", Given():
            return Coincide(step.node, step.start)
        case "normal_from_absolute", Given(length=Normal() as length):
            return replace(step, length=replace(length, tail=construction.poles[VELOCITY]))
        case "arithmetic", Given():
            return replace(step, factor=mistake.factor * step.factor)
        case "wrong_arm", Given(length=Balance(moments=moments) as length):
            forces = list(moments.forces)
            forces[mistake.slot] = replace(forces[mistake.slot], whole_arm=True)
            return replace(step, length=replace(length, moments=replace(moments, forces=tuple(forces))))
        case "image_mirrored", _ if mistake.at in construction.images:
            image = construction.images[mistake.at]
            return Similar(image.node, image.base, image.model, mirrored=not image.mirrored)
        case "other_assembly", TwoArcs() | ArcAndLine():
            return replace(step, side=-step.side)
        case _, TwoLines():
            lines = [step.first, step.second]
            lines[mistake.slot] = _line_drawn_wrongly(lines[mistake.slot], mistake)
            return TwoLines(step.node, *lines)
    raise ValueError(f"{mistake.code} cannot be made at {mistake.at}")


def _line_drawn_wrongly(line: AnyLine, mistake: StudentMistake) -> Line:
    if isinstance(line, Line):
        match mistake.code, line.along, mistake.other:
            case "parallel_for_perpendicular", along, _:
                return replace(line, along=_quarters(along, 1))
            case "wrong_link", Along() as along, (tail, head):
                return replace(line, along=Along(tail, head, along.quarters % 2))
            case "wrong_intersection", _, (foot,):
                return replace(line, through=foot)
    raise ValueError(f"{mistake.code} cannot be made at {mistake.at}")


def _quarters(along: Direction, quarters: int) -> Direction:
    return replace(along, quarters=along.quarters + quarters)


def _turned(construction: Construction, figure: str, quarters: int) -> Construction:
    """The construction with every line of a plan turned by the same quarters."""

    def turned(step: Step) -> Step:
        match step:
            case Given():
                return replace(step, along=_quarters(step.along, quarters))
            case TwoLines(first=Line() as first, second=Line() as second):
                both = (replace(line, along=_quarters(line.along, quarters)) for line in (first, second))
                return TwoLines(step.node, *both)
        return step

    figures = dict(construction.figures)
    figures[figure] = tuple(turned(step) for step in figures[figure])
    if figure == VELOCITY:
        # A student computes a Coriolis component while looking at the plan, and so gets it right.
        figures[ACCELERATION] = tuple(_seen_turned(step, quarters) for step in figures[ACCELERATION])
    return replace(construction, figures=figures)


def _seen_turned(step: Step, quarters: int) -> Step:
    if isinstance(step, Given) and isinstance(step.length, Coriolis):
        return replace(step, length=replace(step.length, quarters=step.length.quarters + quarters))
    return step
