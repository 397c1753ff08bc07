"""The exact plan of one or many variants: named nodes and vectors, in SI and in millimetres on paper.

Taken from the closed form of `reference.kinematics.motion`, not from the construction: the two are
independent, and tests compare them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reference.authored.assignment import Assignment, Scales, Variant
from reference.construction.derive import construction_of
from reference.construction.draft import image_name
from reference.construction.elements import Normal, View
from reference.construction.forces import Accelerations, reaction
from reference.construction.graph import Construction, Vector, evaluate, parameters_of
from reference.construction.mistakes import Drawing
from reference.construction.steps import Given, TwoLines
from reference.geometry import ComplexArray, FloatArray, cross, dot, unit
from reference.kinematics.motion import Motion, move
from reference.kinetics import Forces, forces_of
from reference.mechanism import Mechanism, short_names
from reference.quantities import group_of

ZERO_SHARE = 1e-9
"""A vector shorter than this share of its plan's size is a zero vector and has no direction."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Exact plans of N variants; arrays of shape (N,), y up.

    Attributes
    ----------
    nodes_mm : by figure and node, complex, millimetres from the figure's origin (a plan's pole)
    vectors_si : by name, complex, m/s, m/s^2 and N, in the vector's own sense
    rates : omega_k, epsilon_k, rad/s and rad/s^2, and M_b, N m, counter-clockwise positive
    forces : None where the assignment has neither bodies nor loads, or accelerations are not asked for
    """

    variants: tuple[Variant, ...]
    mechanism: Mechanism
    motion: Motion
    scales: Scales
    drawing: Drawing
    nodes_mm: Mapping[str, Mapping[str, ComplexArray]]
    vectors_si: Mapping[str, ComplexArray]
    rates: Mapping[str, FloatArray]
    forces: Forces | None = None

    @property
    def construction(self) -> Construction:
        """The construction that draws the plan."""
        return self.drawing.construction

    def drawn_mm(self, vector: str) -> ComplexArray:
        """A vector on paper, complex millimetres."""
        scale = getattr(self.scales, self.construction.vectors[vector].scale)
        return np.asarray(self.vectors_si[vector] / scale)

    def size_mm(self, figure: str) -> FloatArray:
        """The largest distance of a plan's node from its pole."""
        return np.asarray(np.max([np.abs(node) for node in self.nodes_mm[figure].values()], axis=0))

    def is_zero(self, vector: str) -> NDArray[np.bool_]:
        """Return whether a vector's true length is zero, apart from rounding, relative to its plan's size."""
        figure = self.construction.figure_of(self.construction.vectors[vector].head)
        return np.asarray(np.abs(self.drawn_mm(vector)) <= ZERO_SHARE * self.size_mm(figure))

    def direction_deg(self, vector: str) -> FloatArray:
        """Direction counter-clockwise from +x, 0 <= d < 360; nan for a zero vector."""
        angle = np.degrees(np.angle(self.drawn_mm(vector))) % 360.0 % 360.0
        return np.where(self.is_zero(vector), np.nan, angle)


def construction_for(
    assignment: Assignment,
    variants: list[Variant] | None = None,
    *,
    accelerations: bool = True,
    forces: Accelerations | None = None,
) -> Construction:
    """Return the construction of an assignment's plans for some variants (default: the first one).

    Arguments: `forces`, whence the accelerations of its force plans come (default: as its pages have it).
    """
    whence = assignment.forces and (forces or assignment.forces)
    return construction_of(
        assignment.mechanism(assignment.variants()[:1] if variants is None else variants),
        # Forces that follow from the student's own accelerations are not drawn without them.
        accelerations=accelerations or whence == "own",
        plate_by_similarity=assignment.file.plate_images == "similarity",
        forces=whence,
    )


def parameters_for(assignment: Assignment, variants: list[Variant], scales: Scales) -> dict[str, FloatArray]:
    """Return the parameters of some variants' drawings, without lengths that are measured on the sketch.

    Raises MechanismError where a variant of an assignment with force plans does not assemble.
    """
    mechanism = assignment.mechanism(variants)
    known = parameters_of(mechanism, scales.kL, scales.kv, scales.ka)
    if assignment.forces is None or scales.kF is None:
        return known
    return {**known, "kF": scales.kF, **data_of_forces(mechanism, forces_of(mechanism, move(mechanism)))}


def exact_plan(
    assignment: Assignment,
    variants: list[Variant],
    scales: Scales | None = None,
    *,
    accelerations: bool = True,
    forces: Accelerations | None = None,
) -> Plan:
    """Return the exact plans of some variants, at the given scales or those that the assignment proposes.

    Arguments: see `construction_for`.

    Raises MechanismError where a variant does not assemble.
    """
    mechanism = assignment.mechanism(variants)
    scales = scales or assignment.scales(variants)
    construction = construction_for(assignment, variants, accelerations=accelerations, forces=forces)
    motion = move(mechanism, accelerations=accelerations or assignment.forces is not None)
    nodes = _nodes(construction, mechanism, motion, scales)
    rates = {name: _rate(motion, name) for name in construction.rates}
    parameters = parameters_of(mechanism, scales.kL, scales.kv, scales.ka)
    parameters = {**_measured(construction, motion), **parameters}
    acts = motion.acceleration and (mechanism.bodies or mechanism.loads)
    solved = forces_of(mechanism, motion) if acts else None
    if solved is not None and assignment.forces is not None and scales.kF is not None:
        nodes |= force_nodes(construction, mechanism, motion, solved, scales.kF)
        rates |= dict.fromkeys(construction.moments, solved.balancing.moment)
        parameters |= {"kF": scales.kF, **data_of_forces(mechanism, solved)}
    vectors = {}
    for name, vector in construction.vectors.items():
        figure, sense = nodes[construction.figure_of(vector.head)], -1.0 if vector.reversed else 1.0
        vectors[name] = (figure[vector.head] - figure[vector.tail]) * (sense * getattr(scales, vector.scale))
    drawing = Drawing(construction, parameters)
    return Plan(tuple(variants), mechanism, motion, scales, drawing, nodes, vectors, rates, solved)


def _nodes(
    construction: Construction, mechanism: Mechanism, motion: Motion, scales: Scales
) -> dict[str, dict[str, ComplexArray]]:
    """Return every node from the closed form: images of the joints, and ends of normal components."""
    figures = {"mechanism": {joint: np.asarray(r / scales.kL) for joint, r in motion.position.items()}}
    for figure, pole in construction.poles.items():
        if group_of(figure):
            continue
        primed = figure == "acceleration_plan"
        rate, scale = (motion.acceleration, scales.ka) if primed else (motion.velocity, scales.kv)
        zero = np.zeros(np.shape(scale), dtype=np.complex128)
        nodes: dict[str, ComplexArray] = {pole: zero}
        for joint in mechanism.joints:
            if not mechanism.is_ground(joint):
                nodes[image_name(joint, primed=primed)] = np.asarray(rate[joint] / scale)
        for vector in construction.vectors_of(figure):
            if vector.part in {"n", "c"}:
                nodes[vector.head] = nodes[vector.tail] + _component(motion, vector) / scales.ka
        figures[figure] = {step.node: nodes[step.node] for step in construction.figures[figure]}
    return figures


def force_nodes(
    construction: Construction, mechanism: Mechanism, motion: Motion, forces: Forces, scale: FloatArray
) -> dict[str, dict[str, ComplexArray]]:
    """Return the nodes of the force plans: the ends of forces laid off one after another."""
    names, values = short_names(mechanism), {one.name: one.force for one in forces.given}
    for one in (*forces.hinges.values(), *forces.guides.values()):
        values[reaction(names, one.by, one.on)] = one.force
        values[reaction(names, one.on, one.by)] = -one.force
    values["F_b"] = forces.balancing.force
    figures = {}
    for figure, pole in construction.poles.items():
        if not group_of(figure):
            continue
        nodes = {pole: np.zeros(np.shape(scale), np.complex128)}
        for vector in construction.vectors_of(figure):
            if vector.tail in nodes and vector.head not in nodes:
                force = values[vector.name.removesuffix(f"_{vector.part}")]
                if vector.part:
                    pin, inner = vector.link or ("", "")
                    along = unit(motion.position[inner] - motion.position[pin])
                    axis = along if vector.part == "n" else 1j * along
                    force = np.asarray(axis * dot(axis, force))
                sense = -1.0 if vector.reversed else 1.0
                nodes[vector.head] = np.asarray(nodes[vector.tail] + sense * force / scale)
        figures[figure] = {step.node: nodes[step.node] for step in construction.figures[figure]}
    return figures


def data_of_forces(mechanism: Mechanism, forces: Forces) -> dict[str, FloatArray]:
    """Return the parameters of force plans: masses, and sizes, directions and couples of given forces."""
    known: dict[str, FloatArray] = {}
    for one in forces.given:
        known |= {one.name: np.abs(one.force), f"angle {one.name}": np.angle(one.force)}
        known[f"M_{one.name.partition('_')[2]}"] = one.couple
    for body in mechanism.bodies:
        name = short_names(mechanism)[body.link]
        known |= {f"m_{name}": body.mass} if body.mass is not None else {}
        known |= {f"I_{name}": body.inertia} if body.inertia is not None else {}
    return known


def vectors_of(construction: Construction, mechanism: Mechanism, motion: Motion) -> dict[str, ComplexArray]:
    """Return every vector of the plans from the closed form, complex, m/s and m/s^2, shape (N,)."""
    one = np.ones(1)
    nodes = _nodes(construction, mechanism, motion, Scales(one, one, one))
    return {
        vector.name: nodes[figure][vector.head] - nodes[figure][vector.tail]
        for figure in construction.poles
        for vector in construction.vectors_of(figure)
    }


def _component(motion: Motion, vector: Vector) -> ComplexArray:
    """Return a normal component v^2 / l towards the link's first joint, or a Coriolis one 2 i omega v."""
    pin, node = vector.link or ("", "")
    relative = motion.velocity[node] - motion.velocity[pin]
    if vector.turning is not None:
        return np.asarray(2j * motion.omega[vector.turning] * relative)
    arm = motion.position[node] - motion.position[pin]
    return np.asarray(-arm * (dot(relative, relative) / dot(arm, arm)))


def _measured(construction: Construction, motion: Motion) -> dict[str, FloatArray]:
    """Return the real lengths that the construction measures on the sketch, of slotted links."""
    steps = (step.length for step in construction.steps if isinstance(step, Given))
    normals = (length for length in steps if isinstance(length, Normal) and length.measured)
    links = {length.length: length.measured for length in normals if length.measured}
    links |= {rate.length: rate.link for rate in construction.rates.values()}
    return {
        name: np.abs(motion.position[head] - motion.position[tail]) for name, (tail, head) in links.items()
    }


def _rate(motion: Motion, name: str) -> FloatArray:
    kind, _, link = name.partition("_")
    return motion.omega[link] if kind == "omega" else motion.epsilon[link]


def conditioning(plan: Plan) -> dict[str, FloatArray]:
    """Return measures of how well the plan can be computed and drawn.

    ``transmission X``: |sin| on which joint X hangs; ``predicted_error``: relative error of the
    computed velocities and accelerations; ``predicted_error_forces``: that of forces, relative to the
    largest; ``crossing X``: the angle in degrees at which the construction lines of node X meet (90 is best).
    """
    transmission = plan.motion.transmission
    conditions: dict[str, FloatArray] = {f"transmission {node}": sine for node, sine in transmission.items()}
    conditions["predicted_error"] = plan.motion.predicted_error
    if plan.forces is not None:
        conditions["predicted_error_forces"] = plan.forces.predicted_error
    nodes = evaluate(plan.construction, plan.drawing.parameters)
    return {**conditions, **crossings_deg(plan.construction, plan.drawing, nodes)}


def crossings_deg(
    construction: Construction, drawing: Drawing, nodes: Mapping[str, ComplexArray]
) -> dict[str, FloatArray]:
    """Return the angle between the two construction lines of each node that two lines determine."""
    view = View(nodes, drawing.parameters)
    angles = {}
    for step in construction.steps:
        if isinstance(step, TwoLines):
            u, v = step.first.along.at(view), step.second.along.at(view)
            angles[f"crossing {step.node}"] = np.degrees(np.arcsin(np.minimum(np.abs(cross(u, v)), 1.0)))
    return angles
