"""Mistakes as operators on the construction: one step or parameter is changed, the rest follows.

A mistake is data; `commit` gives the drawing with that mistake in it. The reading uses mistakes as
hypotheses, the diagnosis as explanations. Their codes are part of the published formats.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from reference.construction.elements import (
    Along,
    Balance,
    Coriolis,
    Direction,
    Fixed,
    Line,
    Moments,
    Normal,
    Parameters,
    Scaled,
    View,
    data_in,
    is_force,
)
from reference.construction.graph import Construction, Vector, coincident
from reference.construction.steps import (
    ArcAndLine,
    Given,
    Local,
    Similar,
    Step,
    TwoArcs,
    TwoLines,
)
from reference.quantities import DRAWN, OF_MOTION, scale_of

Code = Literal[
    "parallel_for_perpendicular",
    "wrong_link",
    "sense_reversed",
    "rpm_not_converted",
    "scale_wrong",
    "normal_reversed",
    "normal_missing",
    "normal_from_absolute",
    "other_variant",
    "other_assembly",
    "image_mirrored",
    "wrong_intersection",
    "vector_missing",
    "labels_swapped",
    "figure_rotated",
    "arithmetic",
    "units",
    "data_misread",
    "inertia_reversed",
    "force_missing",
    "force_reversed",
    "couple_missing",
    "couple_reversed",
    "wrong_arm",
]
CODES: tuple[Code, ...] = get_args(Code)
OF_FORCES = frozenset[str](
    ("inertia_reversed", "force_missing", "force_reversed", "couple_missing", "couple_reversed")
)
"""Mistakes in what acts on a link: its moments and its polygon have them alike."""
OF_ALL = ("F_i", "G_", "M_i")  # places of a mistake in all acts of a kind: their names begin so
FACTORS: dict[str, float | None] = {
    "sense_reversed": -1.0,
    "normal_reversed": -1.0,
    "inertia_reversed": -1.0,
    "force_reversed": -1.0,
    "normal_missing": 0.0,
    "force_missing": 0.0,
    "arithmetic": None,
    "scale_wrong": None,
}
"""By which a mistake multiplies a length that is laid off; None: by its own factor."""
RPM_FACTOR = 30.0 / math.pi
"""Error factor of omega = n instead of omega = pi n / 30."""
SLIP, RIGHT_TRIANGLE = "arithmetic", "right_triangle"
"""A computed length that is wrong, and its cause if the length was drawn by the right triangle at scales that
do not allow it (`Mistake.other`)."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """A construction with its parameters: all that is needed to draw it."""

    construction: Construction
    parameters: Parameters


@dataclass(frozen=True, slots=True)
class Mistake:
    """One mistake.

    Attributes
    ----------
    code : one of `CODES`
    at : the node, vector, scale or figure where it is made
    slot : index of the step's line (0 or 1), or of the force with a wrong arm
    other : what is used instead: two joints, a node, a vector (for its line), the two nodes swapped; of a
        wrong length its cause
    factor : of a length, speed or scale
    quarters : quarter turns of a figure or of the driving link's vector, counter-clockwise
    n, position : the other student's variant
    parameters : that variant's parameters that differ; for misread data, the values used
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


def commit(mistake: Mistake, drawing: Drawing) -> Drawing:
    """Return the drawing with the mistake in it; later steps follow from it.

    Raises ValueError for a mistake that cannot be made at that step.
    """
    construction, parameters = drawing.construction, drawing.parameters
    match mistake.code:
        case "rpm_not_converted":
            return Drawing(construction, _with_speed(parameters, mistake.factor))
        case "scale_wrong" if mistake.at in DRAWN:
            scaled = np.asarray(parameters[mistake.at] * mistake.factor)
            return Drawing(construction, {**parameters, mistake.at: scaled})
        case "other_variant" | "data_misread":
            scales = {name: parameters[name] for name in (*DRAWN, "turn") if name in parameters}
            return Drawing(construction, {**parameters, **mistake.parameters, **scales})
        case _ if mistake.parameters:
            return Drawing(construction, {**parameters, **mistake.parameters})
        case "vector_missing":
            kept = {name: one for name, one in construction.vectors.items() if name != mistake.at}
            return Drawing(replace(construction, vectors=kept), parameters)
        case "labels_swapped":
            return Drawing(_with_labels_swapped(construction, mistake.other), parameters)
        case "figure_rotated":
            return Drawing(_with_figure_turned(construction, mistake.at, mistake.quarters), parameters)
        case _:
            changed = changed_step(mistake, construction)
            return Drawing(construction.with_step(changed), parameters)


def changed_step(mistake: Mistake, construction: Construction) -> Step:
    """Return the step of a node with a mistake in it.

    Raises ValueError for a mistake that cannot be made at that step.
    """
    step = construction.step(mistake.at)
    match mistake.code, step:
        case "arithmetic", Given(length=Normal() as length) if mistake.other == (RIGHT_TRIANGLE,):
            return replace(step, length=replace(length, by_triangle=True))
        case code, Given() if code in FACTORS:
            factor = FACTORS[code]
            return replace(step, factor=step.factor * (mistake.factor if factor is None else factor))
        case "wrong_arm", Given(length=Balance(moments=moments) as length):
            wrong = replace(moments.forces[mistake.slot], whole_arm=True)
            forces = (*moments.forces[: mistake.slot], wrong, *moments.forces[mistake.slot + 1 :])
            return replace(step, length=replace(length, moments=replace(moments, forces=forces)))
        case "normal_from_absolute", Given(length=Normal() as length):
            return replace(step, length=replace(length, tail=construction.poles["velocity_plan"]))
        case "parallel_for_perpendicular", Given():
            return replace(step, along=_quarter(step.along, mistake.quarters or 1))
        case "parallel_for_perpendicular", TwoLines():
            return _with_line(step, mistake.slot, lambda line: replace(line, along=_quarter(line.along, 1)))
        case "wrong_link", TwoLines():
            tail, head = mistake.other
            return _with_line(step, mistake.slot, lambda line: _by_link(line, tail, head))
        case "wrong_intersection", TwoLines():
            (instead,) = mistake.other
            if instead in construction.vectors:
                drawn = line_of(construction.vectors[instead], construction)
                return _with_line(step, mistake.slot, lambda line: drawn or line)
            return _with_line(step, mistake.slot, lambda line: replace(line, through=instead))
        case "image_mirrored", _ if mistake.at in construction.images:
            return replace(construction.images[mistake.at], mirrored=True)
        case "other_assembly", TwoArcs() | ArcAndLine():
            return replace(step, side=-step.side)
    raise ValueError(f"{mistake.code} cannot be made at the step of {mistake.at}")


def line_of(vector: Vector, construction: Construction) -> Line | None:
    """Return the line on which a vector is drawn from its tail; None if its head is found by other means."""
    match construction.step(vector.head):
        case TwoLines(first=first, second=second):
            lines = (one for one in (first, second) if isinstance(one, Line) and one.through == vector.tail)
            return next(lines, None)
        case Given(start=start, along=along) if start == vector.tail:
            return Line(start, along)
    return None


def _with_line(step: TwoLines, slot: int, change: Callable[[Line], Line]) -> TwoLines:
    """Return the step with one of its two lines changed; raises ValueError for a fixed guide."""
    lines = [step.first, step.second]
    line = lines[slot]
    if not isinstance(line, Line):
        raise ValueError(f"line {slot} of {step.node} is a guide on the ground: it is given")  # noqa: TRY004
    lines[slot] = change(line)
    return TwoLines(step.node, *lines)


def _by_link(line: Line, tail: str, head: str) -> Line:
    """Return the line by another link: across it, or along it if the right line runs along a guide."""
    turned = isinstance(line.along, Along) and line.along.quarters % 2 == 0
    return replace(line, along=Along(tail, head, 0 if turned else 1))


def _quarter(along: Direction, quarters: int) -> Direction:
    return replace(along, quarters=along.quarters + quarters)


def _with_speed(parameters: Parameters, factor: float) -> Parameters:
    """Return the parameters at another crank speed: v changes by the factor, a by its square."""
    powers = {"v": 1, "a": 2}
    speeds = {
        name: np.asarray(value * factor ** powers[name[0]])
        for name, value in parameters.items()
        if name[:2] in {"v_", "a_"} and not name.endswith("_t")
    }
    return {**parameters, **speeds}


def _with_labels_swapped(construction: Construction, nodes: tuple[str, ...]) -> Construction:
    first, second = nodes
    other = {first: second, second: first}

    def relabelled(vector: Vector) -> Vector:
        return replace(
            vector, tail=other.get(vector.tail, vector.tail), head=other.get(vector.head, vector.head)
        )

    return replace(construction, vectors={name: relabelled(v) for name, v in construction.vectors.items()})


def _with_figure_turned(construction: Construction, figure: str, quarters: int) -> Construction:
    def turned(step: Step) -> Step:
        match step:
            case Given():
                return replace(step, along=_quarter(step.along, quarters))
            case TwoLines(first=Line() as first, second=Line() as second):
                lines = (replace(line, along=_quarter(line.along, quarters)) for line in (first, second))
                return TwoLines(step.node, *lines)
        return step

    figures = {
        name: tuple(
            turned(step) if name == figure else _coriolis_of_turned_plan(step, figure, quarters)
            for step in steps
        )
        for name, steps in construction.figures.items()
    }
    return replace(construction, figures=figures)


def _coriolis_of_turned_plan(step: Step, figure: str, quarters: int) -> Step:
    """Adapt a Coriolis component to a turned velocity plan: it depends on lengths and senses only."""
    if figure == "velocity_plan" and isinstance(step, Given) and isinstance(step.length, Coriolis):
        return replace(step, length=replace(step.length, quarters=step.length.quarters + quarters))
    return step


# What could have gone wrong -----------------------------------------------------------------------


def single_mistakes(drawing: Drawing, figure: str) -> Iterator[Mistake]:
    """Yield every mistake that could be made in one step of a figure, and in the figure as a whole.

    Mistakes of scale are offered at common factors: powers of ten, halves and doubles.
    """
    for step in drawing.construction.figures[figure]:
        for mistake in mistakes_of_step(step, drawing.construction):
            if mistake.code != "image_mirrored" or not _is_in_line(step, drawing):
                yield mistake
    if figure != "mechanism":
        scale = scale_of(figure)
        yield from (Mistake("scale_wrong", scale, factor=f) for f in (0.1, 0.5, 2.0, 10.0))
        yield from (Mistake("figure_rotated", figure, quarters=q) for q in (1, 2, 3))
        if "angle crank" in drawing.parameters and scale in OF_MOTION:
            yield Mistake("rpm_not_converted", figure, factor=RPM_FACTOR)


def mistakes_of_step(step: Step, construction: Construction) -> Iterator[Mistake]:
    """Yield every mistake that could be made in one step."""
    figure = construction.figure_of(step.node)
    match step:
        case Given():
            yield from _mistakes_of_given(step, construction)
        case TwoLines() if figure != "mechanism":
            yield from _mistakes_of_lines(step, construction, figure)
        case TwoArcs() | ArcAndLine():
            yield Mistake("other_assembly", step.node)
    if step.node in construction.images and figure != "mechanism":
        yield Mistake("image_mirrored", step.node)


def _is_in_line(step: Step, drawing: Drawing) -> bool:
    """Return whether a point of a slotted link lies on its guide's line: mirroring changes nothing."""
    if not isinstance(step, Similar):
        return False
    joint = drawing.construction.step(step.model[2])
    return isinstance(joint, Local) and not np.any(joint.y.at(View({}, drawing.parameters)))


def _mistakes_of_given(step: Given, construction: Construction) -> Iterator[Mistake]:
    match step.length:
        case Normal() | Coriolis():
            yield Mistake("normal_missing", step.node)
            yield Mistake("normal_reversed", step.node)
            if isinstance(step.length, Normal) and step.length.tail != construction.poles["velocity_plan"]:
                yield Mistake("normal_from_absolute", step.node)
        case Balance(moments=Moments(forces=forces, about=about)):
            yield Mistake("sense_reversed", step.node)
            yield from (
                Mistake("wrong_arm", step.node, slot)
                for slot, force in enumerate(forces)
                if force.point != about
            )
        case _ if is_force(step.length):
            # In the polygon alone: the moments had it right.
            name = laid_off(step, construction)
            yield Mistake("inertia_reversed" if name.startswith("F_i") else "force_reversed", step.node)
            yield Mistake("force_missing", step.node)
        case _ if not isinstance(step.along, Fixed) or step.start in construction.poles.values():
            yield Mistake("sense_reversed", step.node)


def _mistakes_of_lines(step: TwoLines, construction: Construction, figure: str) -> Iterator[Mistake]:
    pole = construction.poles[figure]
    under = coincident(construction)
    for slot, line in enumerate((step.first, step.second)):
        if isinstance(line.along, Fixed) and line.along.quarters % 2:
            # A reaction along a fixed guide, not across it.
            yield Mistake("parallel_for_perpendicular", step.node, slot)
        if not isinstance(line, Line) or not isinstance(line.along, Along):
            continue
        own = {under.get(joint, joint) for joint in line.along.needs}
        yield Mistake("parallel_for_perpendicular", step.node, slot)
        for link in construction.pairs:
            places = {under.get(joint, joint) for joint in link}
            if len(places) > 1 and places != own:
                yield Mistake("wrong_link", step.node, slot, other=link)
        yield from _wrong_feet(step, slot, line, construction, pole)


def _wrong_feet(
    step: TwoLines, slot: int, line: Line, construction: Construction, pole: str
) -> Iterator[Mistake]:
    """Yield lines drawn through the start of a normal component, or the pole, instead of its end."""
    other = step.second if slot == 0 else step.first
    other_foot = other.through if isinstance(other, Line) else ""
    feet = [pole]
    foot = construction.step(line.through)
    if isinstance(foot, Given):
        feet.append(foot.start)
    for name in dict.fromkeys(feet):
        if name not in {line.through, other_foot}:
            yield Mistake("wrong_intersection", step.node, slot, other=(name,))


def rarer_mistakes_of_step(step: Step, construction: Construction) -> Iterator[Mistake]:
    """Yield rarer mistakes in one step of a plan, in addition to `mistakes_of_step`.

    The driving link's vector along the link instead of across it, or across instead of along; a Coriolis
    component along the sliding velocity; a normal component by the right triangle (a mistake only at scales
    that do not allow it); a line across a fixed guide, or by the radius from a pivot that carries no link; a
    line through any earlier point, or any earlier line.
    """
    figure = construction.figure_of(step.node)
    if figure == "mechanism":
        return
    match step:
        case Given(length=Scaled() | Coriolis(), along=Along()):
            yield from (Mistake("parallel_for_perpendicular", step.node, quarters=one) for one in (1, 3))
        case Given(length=Normal()):
            yield Mistake(SLIP, step.node, other=(RIGHT_TRIANGLE,))
    if not isinstance(step, TwoLines):
        return
    known = {(one.code, one.slot, frozenset(one.other)) for one in mistakes_of_step(step, construction)}
    for slot, line in enumerate((step.first, step.second)):
        if isinstance(line.along, Fixed) and line.along.quarters % 2 == 0:
            yield Mistake("parallel_for_perpendicular", step.node, slot)
        if isinstance(line, Line) and isinstance(line.along, Along):
            for mistake in _further_lines(step, slot, line, construction):
                if (mistake.code, slot, frozenset(mistake.other)) not in known:
                    yield mistake


def _further_lines(step: TwoLines, slot: int, line: Line, construction: Construction) -> Iterator[Mistake]:
    """Yield other lines: by a pivot's radius to a joint, through an earlier node, or an earlier line."""
    given = [joint.node for joint in construction.figures["mechanism"] if not joint.needs]
    for pivot in given:
        for joint in line.along.needs:
            if joint != pivot and {pivot, joint} != set(line.along.needs):
                yield Mistake("wrong_link", step.node, slot, other=(pivot, joint))
    other = step.second if slot == 0 else step.first
    foot = other.through if isinstance(other, Line) else ""
    earlier = [one.node for one in construction.figures[construction.figure_of(step.node)]]
    earlier = earlier[: earlier.index(step.node)]
    for node in earlier:
        if node not in {line.through, foot}:
            yield Mistake("wrong_intersection", step.node, slot, other=(node,))
    for vector in construction.vectors.values():
        # With a line through the other foot, the two lines would meet at that foot.
        is_apart = vector.head in earlier and foot not in {vector.tail, vector.head}
        if is_apart and line_of(vector, construction) not in {None, line, other}:
            yield Mistake("wrong_intersection", step.node, slot, other=(vector.name,))


def laid_off(step: Given, construction: Construction) -> str:
    """Return the name of the vector that a step lays off; empty for a link of the sketch."""
    vectors = construction.vectors.values()
    return next((one.name for one in vectors if (one.tail, one.head) == (step.start, step.node)), "")


def mistakes_of_forces(drawing: Drawing) -> Iterator[Mistake]:
    """Yield mistakes in what acts on links: of one force or couple, and of all of one kind.

    An inertia force along the acceleration, a force or couple left out or with the wrong sense, among them a
    reaction taken over from another group with the sense that it had there. One force's is made at the node
    where it ends.
    """
    changes: dict[tuple[str, float], dict[str, str]] = {}
    vectors = drawing.construction.vectors
    for name, datum in _data_of_forces(drawing.construction):
        kind = "couple" if name.startswith("M_") else "inertia" if name.startswith("F_i") else "force"
        if not name.startswith("G_"):
            changes.setdefault((f"{kind}_reversed", -1.0), {})[name] = datum
        if not name.startswith("R_"):
            code = "couple_missing" if kind == "couple" else "force_missing"
            changes.setdefault((code, 0.0), {})[name] = datum
    for (code, factor), data in changes.items():
        for name, datum in data.items():
            at = vectors[name].head if name in vectors else name
            yield Mistake(code, at, factor=factor, parameters=_changed(drawing, factor, datum))
        for start in OF_ALL:
            alike = [datum for name, datum in data.items() if name.startswith(start)]
            if len(alike) > 1:
                yield Mistake(code, start, factor=factor, parameters=_changed(drawing, factor, *alike))


def _data_of_forces(construction: Construction) -> Iterator[tuple[str, str]]:
    """Yield each force that is laid off, and each couple, with the name of its datum."""
    for vector in construction.vectors.values():
        step = construction.step(vector.head)
        if isinstance(step, Given) and is_force(step.length) and laid_off(step, construction) == vector.name:
            (datum,) = data_in(step.length)
            yield vector.name, datum
    lengths = [step.length for step in construction.steps if isinstance(step, Given)]
    balances = [length.moments for length in lengths if isinstance(length, Balance)]
    for moments in (*balances, *construction.moments.values()):
        yield from ((one.name, one.inertia or one.name) for one in moments.couples)


def _changed(drawing: Drawing, factor: float, *names: str) -> Parameters:
    return {name: np.asarray(factor * drawing.parameters.get(name, 1.0)) for name in names}


def made_at(mistake: Mistake, construction: Construction) -> frozenset[str]:
    """Return the nodes at which a mistake is made: of a couple, those of the moments that it changes."""
    nodes = {step.node for step in construction.steps}
    if mistake.at in nodes or not mistake.parameters or mistake.code not in OF_FORCES:
        return frozenset((mistake.at,))
    vectors = (one for one in construction.vectors.values() if one.name.startswith(mistake.at))
    if not mistake.at.startswith("M_"):
        return frozenset(one.head for one in vectors)
    found = frozenset(_with_data(mistake.parameters, construction))
    return found or frozenset((next(iter(construction.moments), mistake.at),))


def _with_data(data: Iterable[str], construction: Construction) -> Iterator[str]:
    """Yield the nodes that are laid off by some data of forces or couples."""
    for step in construction.steps:
        if isinstance(step, Given) and not data_in(step.length).isdisjoint(data):
            yield step.node


def affected(mistake: Mistake, construction: Construction) -> frozenset[str]:
    """Return the nodes that a mistake moves: its own and those drawn from it."""
    is_of_data = mistake.code in {"other_variant", "data_misread"} and mistake.at not in construction.poles
    if mistake.at in DRAWN or mistake.code == "rpm_not_converted" or is_of_data:
        return frozenset(step.node for step in construction.steps)
    if mistake.at in construction.figures:
        return frozenset(step.node for step in construction.figures[mistake.at])
    at = {mistake.at}
    if mistake.parameters and mistake.code not in {"other_variant", "data_misread"}:
        at.update(_with_data(mistake.parameters, construction))
    return frozenset(one.node for one in construction.steps if at & construction.upstream(one.node))
