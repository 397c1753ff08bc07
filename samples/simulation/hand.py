"""The student's drawing: the intended construction with its mistakes, step by step with instruments.

Later steps start from what is on the paper, so that errors and mistakes are followed through.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from reference.authored.assignment import Assignment, Scales, Variant
from reference.construction.derive import construction_of
from reference.construction.graph import evaluate, parameters_of
from reference.mechanism import Mechanism
from reference.plan import exact_plan
from reference.quantities import scale_of
from samples.simulation.drawing import drawn_nodes
from samples.simulation.force_orders import in_other_orders
from samples.simulation.mistakes import (
    CODES,
    Intent,
    Occasion,
    StudentMistake,
    possible,
    scalars,
    with_mistake,
)
from samples.simulation.settings import ACCELERATION, FORCES, MECHANISM, PLANS, VELOCITY, HandStyle, Student
from samples.simulation.strokes import Rng

Nodes = Mapping[str, complex]


@dataclass(frozen=True, slots=True)
class DrawingTask:
    """One student's drawing task, as it should be and with the student's mistakes.

    Attributes
    ----------
    right : the drawing without mistakes, at the scales that the student uses
    wrong : the drawing as the student understands it, with the mistakes
    mistakes : the mistakes made
    declared : kL, kv, ka as the sheet says
    """

    assignment: Assignment
    variant: Variant
    mechanism: Mechanism
    right: Intent
    wrong: Intent
    mistakes: tuple[StudentMistake, ...]
    declared: Mapping[str, float]

    @property
    def used(self) -> dict[str, float]:
        """The scales used in the drawing."""
        return {name: float(self.wrong.parameters[name]) for name in drawn_at(self.wrong)}

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
    nodes : as drawn; intended : as a perfect hand would have drawn them, mistakes included
    """

    name: str
    nodes: Nodes
    intended: Nodes


@dataclass(frozen=True, slots=True)
class DrawnSheet:
    """The figures of one sheet of paper, and what kind of sheet it is."""

    kind: str
    figures: tuple[DrawnFigure, ...]


def task_of(assignment: Assignment, variant: Variant, student: Student, rng: Rng) -> DrawingTask:
    """The student's task, with mistakes chosen among those that can be made.

    Raises ValueError for a code that this drawing does not admit.
    """
    right = _right_drawing(assignment, variant, student)
    if student.force_order != "usual":
        in_order = in_other_orders(right.construction, student.force_order, rng)
        right = Intent(in_order, right.parameters)
    occasion = Occasion(assignment, variant, right)
    wrong, made = right, []
    for code in student.mistakes:
        choices = possible(code, occasion)
        if not choices:
            raise ValueError(f"{code} cannot be made in {assignment.id} {variant}")
        made.append(choices[rng.integers(len(choices))])
        wrong = with_mistake(wrong, made[-1])
    # Who computes a wrong speed of the crank declares the scales that follow from it.
    declaring = wrong if "rpm_not_converted" in student.mistakes else right
    declared = {name: float(declaring.parameters[name]) for name in drawn_at(right)}
    return DrawingTask(
        assignment, variant, assignment.mechanism([variant]), right, wrong, tuple(made), declared
    )


def drawn_at(intent: Intent) -> list[str]:
    """The scales of a drawing's figures, each once, in their order."""
    return list(dict.fromkeys(scale_of(figure) for figure in intent.construction.figures))


def _right_drawing(assignment: Assignment, variant: Variant, student: Student) -> Intent:
    scales = assignment.scales([variant], crank_mm=student.crank_mm)
    if student.shrunk != 1.0:
        scales = assignment.scales([variant], kL=scales.kL / student.shrunk)
    scales = Scales(scales.kL, scales.kv * student.kv_ratio, scales.ka * student.ka_ratio)
    if assignment.forces is not None:
        return _right_forces(assignment, variant, student, scales)
    by_similarity = student.similarity
    if by_similarity is None:
        by_similarity = assignment.file.plate_images == "similarity"
    mechanism = assignment.mechanism([variant])
    construction = construction_of(mechanism, plate_by_similarity=by_similarity)
    parameters = scalars(parameters_of(mechanism, scales.kL, scales.kv, scales.ka))
    return Intent(construction, {**parameters, "turn": np.asarray(np.radians(student.turn_deg))})


ROUND_SCALES = (1.0, 1.25, 2.0, 2.5, 4.0, 5.0, 8.0)


def _right_forces(assignment: Assignment, variant: Variant, student: Student, scales: Scales) -> Intent:
    """The drawing with force plans, at a round scale: the largest force is about as long as wished."""
    plan = exact_plan(assignment, [variant], replace(scales, kF=np.ones(1)))
    forces = [name for name, vector in plan.construction.vectors.items() if vector.scale == "kF"]
    wished = max(abs(complex(plan.vectors_si[name][0])) for name in forces) / student.largest_force_mm
    decade = 10.0 ** math.floor(math.log10(wished))
    scale = decade * min(ROUND_SCALES, key=lambda one: abs(one - wished / decade))
    known = scalars({**plan.drawing.parameters, "kF": np.asarray([scale])})
    return Intent(plan.construction, {**known, "turn": np.asarray(np.radians(student.turn_deg))})


def possible_mistakes(
    assignment: Assignment, variant: Variant, student: Student, codes: Sequence[str] = CODES
) -> tuple[str, ...]:
    """The codes of mistakes that this student's drawing admits."""
    occasion = Occasion(assignment, variant, _right_drawing(assignment, variant, student))
    return tuple(code for code in codes if possible(code, occasion))


def draw(task: DrawingTask, hand: HandStyle, student: Student, rng: Rng) -> tuple[DrawnSheet, ...]:
    """Draw the student's sheets.

    With two sheets the mechanism is drawn anew on the second, and the acceleration plan follows the
    second sketch's directions and the first sheet's velocities. Raises ValueError where a drawing does not
    close.
    """
    construction, parameters = task.wrong.construction, task.wrong.parameters
    exact = evaluate(construction, parameters)

    def figures(names: Sequence[str], nodes: Nodes) -> tuple[DrawnFigure, ...]:
        steps = {name: [step.node for step in construction.figures[name]] for name in names}
        return tuple(
            DrawnFigure(
                name, {node: nodes[node] for node in own}, {node: complex(exact[node]) for node in own}
            )
            for name, own in steps.items()
        )

    first = drawn_nodes(construction, parameters, hand, rng)
    forces = [name for name in construction.figures if name.startswith(FORCES)]
    pages = {page.kind for page in task.assignment.file.page}
    if forces and "mechanism" in pages:
        return (
            DrawnSheet("mechanism", figures((MECHANISM,), first)),
            DrawnSheet("forces", figures(forces, first)),
        )
    if forces and VELOCITY not in construction.figures:
        return (DrawnSheet("forces", figures((MECHANISM, *forces), first)),)
    if forces:
        plans = {step.node: first[step.node] for name in PLANS for step in construction.figures[name]}
        again = drawn_nodes(construction, parameters, hand, rng, plans)
        return (
            DrawnSheet("all", figures((MECHANISM, *PLANS), first)),
            DrawnSheet("forces", figures((MECHANISM, *forces), again)),
        )
    if student.sheets == 1:
        return (DrawnSheet("all", figures((MECHANISM, *PLANS), first)),)
    velocities = {step.node: first[step.node] for step in construction.figures[VELOCITY]}
    second = drawn_nodes(construction, parameters, hand, rng, velocities)
    return (
        DrawnSheet("velocity", figures((MECHANISM, VELOCITY), first)),
        DrawnSheet("acceleration", figures((MECHANISM, ACCELERATION), second)),
    )
