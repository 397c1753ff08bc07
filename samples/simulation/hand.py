"""What a student draws: the construction with a hand's errors and mistakes, followed through.

Every figure is one evaluation of the assignment's own construction. The errors of each line, arc
and mark enter where they are made; later steps start from what was drawn.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from reference.authored.assignment import Assignment, Scales, Variant
from reference.construction.derive import construction_of
from reference.construction.graph import Construction, evaluate, parameters_of
from reference.construction.mistakes import CODES, RPM_FACTOR, Drawing, Mistake, commit, single_mistakes
from reference.construction.uncertainty import Act, Skill, acts
from reference.geometry import FloatArray
from reference.mechanism import Mechanism
from samples.simulation.settings import Hand, Student
from samples.simulation.strokes import Rng

MECHANISM, VELOCITY, ACCELERATION = "mechanism", "velocity_plan", "acceleration_plan"
PLANS = (VELOCITY, ACCELERATION)
_HEAVY_TAIL = 0.08
"""Share of acts that go wrong by about twice as much."""

Nodes = Mapping[str, complex]


@dataclass(frozen=True, slots=True)
class Task:
    """What one student has to draw.

    Attributes
    ----------
    right : the drawing without mistakes, at the scales that the student uses
    wrong : the drawing as the student understands it, mistakes made
    mistakes : those made
    declared : kL, kv, ka as the sheet says
    """

    assignment: Assignment
    variant: Variant
    mechanism: Mechanism
    right: Drawing
    wrong: Drawing
    mistakes: tuple[Mistake, ...]
    declared: Mapping[str, float]

    @property
    def used(self) -> dict[str, float]:
        """The scales that the drawing follows."""
        return {name: float(self.wrong.parameters[name]) for name in ("kL", "kv", "ka")}

    @property
    def missing(self) -> frozenset[str]:
        """Vectors left out."""
        return frozenset(mistake.at for mistake in self.mistakes if mistake.code == "vector_missing")

    def letter_of(self, node: str) -> str:
        """The node whose letter this student writes at a node."""
        for mistake in self.mistakes:
            if mistake.code == "labels_swapped" and node in mistake.other:
                first, second = mistake.other
                return second if node == first else first
        return node


@dataclass(frozen=True, slots=True)
class DrawnFigure:
    """One figure as drawn, in millimetres about its own origin, y up.

    Attributes
    ----------
    nodes : as they came out; intended : as a perfect hand would have drawn them, mistakes included
    """

    name: str
    nodes: Nodes
    intended: Nodes


@dataclass(frozen=True, slots=True)
class DrawnSheet:
    """The figures of one sheet of paper, and what kind of sheet it is."""

    kind: str
    figures: tuple[DrawnFigure, ...]


def task_of(assignment: Assignment, variant: Variant, student: Student, rng: Rng) -> Task:
    """The student's task, with mistakes chosen among those that can be made.

    Raises ValueError for a code that no step admits.
    """
    right = _right_drawing(assignment, variant, student)
    wrong, made = right, []
    for code in student.mistakes:
        mistake = choose_mistake(code, assignment, variant, right, rng)
        if code == "rpm_not_converted":
            wrong = _with_own_scales(wrong, mistake.factor)
        # Swapped letters change what is written, not what is drawn.
        wrong = wrong if code == "labels_swapped" else commit(mistake, wrong)
        made.append(mistake)
    told = wrong if "rpm_not_converted" in student.mistakes else right
    declared = {name: float(told.parameters[name]) for name in ("kL", "kv", "ka")}
    return Task(assignment, variant, assignment.mechanism([variant]), right, wrong, tuple(made), declared)


def _with_own_scales(drawing: Drawing, factor: float) -> Drawing:
    """Scales that follow from a wrong crank speed: the plan then has its proper size."""
    known = drawing.parameters
    scales = {"kv": np.asarray(known["kv"] * factor), "ka": np.asarray(known["ka"] * factor**2)}
    return Drawing(drawing.construction, {**known, **scales})


def _right_drawing(assignment: Assignment, variant: Variant, student: Student) -> Drawing:
    scales = assignment.scales([variant], crank_mm=student.crank_mm)
    if student.shrunk != 1.0:
        scales = assignment.scales([variant], kL=scales.kL / student.shrunk)
    scales = Scales(scales.kL, scales.kv * student.kv_ratio, scales.ka * student.ka_ratio)
    by_similarity = student.similarity
    if by_similarity is None:
        by_similarity = assignment.file.plate_images == "similarity"
    mechanism = assignment.mechanism([variant])
    construction = construction_of(mechanism, plate_by_similarity=by_similarity)
    parameters = scalars(parameters_of(mechanism, scales.kL, scales.kv, scales.ka))
    return Drawing(construction, {**parameters, "turn": np.asarray(np.radians(student.turn_deg))})


def scalars(parameters: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """The parameters of a single variant."""
    return {name: np.asarray(np.asarray(value).reshape(-1)[0]) for name, value in parameters.items()}


def choose_mistake(code: str, assignment: Assignment, variant: Variant, right: Drawing, rng: Rng) -> Mistake:
    """A mistake of this kind, at a step chosen by lot.

    Raises ValueError where the drawing offers no place for it.
    """
    choices = _choices(code, assignment, variant, right)
    if not choices:
        raise ValueError(f"{code} cannot be made in {assignment.id} {variant}")
    chosen = choices[rng.integers(len(choices))]
    return _other_variant(assignment, chosen) if code == "other_variant" else chosen


def possible_mistakes(
    assignment: Assignment, variant: Variant, student: Student, codes: Sequence[str] = CODES
) -> tuple[str, ...]:
    """Those of the codes of mistakes for which this student's drawing offers a place."""
    right = _right_drawing(assignment, variant, student)
    return tuple(code for code in codes if _choices(code, assignment, variant, right))


def _choices(code: str, assignment: Assignment, variant: Variant, right: Drawing) -> list[Mistake]:
    """Every mistake of this kind that can be made and drawn."""
    vectors = right.construction.vectors.items()
    match code:
        case "other_variant":
            others = (one for one in assignment.variants() if one != variant)
            return [Mistake(code, "", n=other.n, position=other.position) for other in others]
        case "vector_missing":
            return [Mistake(code, name) for name, vector in vectors if vector.part not in {"n", "c"}]
        case "labels_swapped":
            return list(_swaps(right))
        case "rpm_not_converted":
            turns = "angle crank" in right.parameters
            return [Mistake(code, VELOCITY, factor=RPM_FACTOR)] if turns else []
        case "arithmetic":
            ends = [vector.head for _, vector in vectors if vector.part in {"n", "c"}]
            return [Mistake(code, end, factor=factor) for end in ends for factor in (0.5, 2.0, 0.1, 1.4)]
    offered = [m for figure in (*PLANS, MECHANISM) for m in single_mistakes(right, figure) if m.code == code]
    return [m for m in offered if drawable(commit(m, right), right)]


def _swaps(right: Drawing) -> Iterator[Mistake]:
    """Two letters of a plan changed over; the pole keeps its own."""
    for plan in PLANS:
        steps = right.construction.figures[plan]
        nodes = [step.node for step in steps if not step.node.startswith(("n_", "k_"))]
        for pair in combinations(nodes[1:], 2):
            yield Mistake("labels_swapped", plan, other=pair)


def drawable(drawing: Drawing, right: Drawing) -> bool:
    """Whether a drawing can be drawn at all: every node exists, none far off the paper."""
    nodes = evaluate(drawing.construction, drawing.parameters)
    proper = evaluate(right.construction, right.parameters)
    size = max(abs(complex(node)) for node in proper.values())
    limit = max(1.6 * size + 40.0, 220.0)
    return all(np.isfinite(node) and abs(complex(node)) < limit for node in nodes.values())


def _other_variant(assignment: Assignment, chosen: Mistake) -> Mistake:
    """The mistake with the other student's data in it."""
    other = Variant(chosen.n, chosen.position)
    scales = assignment.scales([other])
    parameters = parameters_of(assignment.mechanism([other]), scales.kL, scales.kv, scales.ka)
    at = "n" if other.n is not None else "position"
    return replace(chosen, at=at, parameters=scalars(parameters))


# The hand -----------------------------------------------------------------------------------------


def slips(construction: Construction, hand: Hand, rng: Rng) -> dict[Act, FloatArray]:
    """One draw of a hand's errors for every step, as `reference.construction.graph.evaluate` takes them."""
    skill = Skill(hand.angle_deg, hand.place_mm, hand.mark_mm)
    errors: dict[Act, FloatArray] = {}
    for act in acts(construction):
        tail = 2.0 if rng.random() < _HEAVY_TAIL else 1.0
        errors[act] = np.asarray(tail * skill.deviation(act[2]) * rng.standard_normal())
    return errors


def draw(task: Task, hand: Hand, student: Student, rng: Rng) -> tuple[DrawnSheet, ...]:
    """The student's sheets.

    With two sheets the mechanism is drawn anew on the second, and the acceleration plan follows the
    second sketch's directions and the first sheet's velocities.
    """
    first = _evaluated(task, hand, rng, {})
    if student.sheets == 1:
        return (DrawnSheet("all", tuple(_figure(task, name, first) for name in (MECHANISM, *PLANS))),)
    velocities = {step.node: first[step.node] for step in task.wrong.construction.figures[VELOCITY]}
    second = _evaluated(task, hand, rng, velocities)
    return (
        DrawnSheet("velocity", (_figure(task, MECHANISM, first), _figure(task, VELOCITY, first))),
        DrawnSheet("acceleration", (_figure(task, MECHANISM, second), _figure(task, ACCELERATION, second))),
    )


def _evaluated(task: Task, hand: Hand, rng: Rng, given: Mapping[str, complex]) -> dict[str, complex]:
    construction, parameters = task.wrong.construction, task.wrong.parameters
    taken = {name: np.asarray(node) for name, node in given.items()}
    for _ in range(20):
        nodes = evaluate(construction, parameters, given=taken, errors=slips(construction, hand, rng))
        if all(np.isfinite(node) for node in nodes.values()):
            return {name: complex(node) for name, node in nodes.items()}
    raise ValueError(f"the drawing of {task.variant} does not close with this hand")


def _figure(task: Task, name: str, nodes: Mapping[str, complex]) -> DrawnFigure:
    own = [step.node for step in task.wrong.construction.figures[name]]
    ideal = evaluate(task.wrong.construction, task.wrong.parameters)
    return DrawnFigure(
        name, {node: nodes[node] for node in own}, {node: complex(ideal[node]) for node in own}
    )
