"""How well the plans can be computed and drawn: transmission angles, crossing angles, predicted error."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from grader.lint.findings import LintFinding, chosen
from grader.lint.places import group_of_image, group_place, mechanism_place
from reference.assignment import Assignment
from reference.geometry import FloatArray
from reference.plan import Plan, conditioning

LEAST_TRANSMISSION = 0.25
"""|sin| of a transmission angle of about 15 degrees: below it, plans are hard to draw."""
LEAST_CROSSING_DEG = 20.0
"""Construction lines that meet at less are hard to intersect by hand: an error across one of them
moves the node by three times as much."""
LARGEST_ERROR = 1e-9
"""Relative error of a computed plan that is told: far below a pencil's, far above a rounding's."""


@dataclass(frozen=True, slots=True)
class Conditions:
    """Arrays of shape (N,) by joint or node; `error` is the predicted relative error of the plan."""

    transmission: Mapping[str, FloatArray]
    crossing_deg: Mapping[str, FloatArray]
    error: FloatArray


def conditions_of(plan: Plan) -> Conditions:
    """The figures of every variant of a plan."""
    count = len(plan.variants)
    found: dict[str, dict[str, FloatArray]] = {"transmission": {}, "crossing": {}}
    error = np.zeros(count)
    for name, values in conditioning(plan).items():
        kind, _, node = name.partition(" ")
        whole = np.broadcast_to(values, (count,))
        if kind in found:
            found[kind][node] = whole
        elif kind == "predicted_error":
            error = whole
    return Conditions(found["transmission"], found["crossing"], error)


def condition_findings(assignment: Assignment, plan: Plan, conditions: Conditions) -> Iterator[LintFinding]:
    """Groups near a singular position, lines that meet at a small angle, results that lose digits."""
    for node, sine in conditions.transmission.items():
        weak = sine < LEAST_TRANSMISSION
        if np.any(weak):
            told = f"near a singular position: the sine of the transmission angle at {node} falls to"
            yield LintFinding(
                "warning", "transmission", *group_place(assignment, node),
                f"{told} {np.min(sine):.2g}", chosen(plan.variants, weak),
            )  # fmt: skip
    for nodes, angle in _alike(conditions.crossing_deg).items():
        flat = angle < LEAST_CROSSING_DEG
        if np.any(flat):
            least = float(np.min(angle))
            moved = (
                f"; a line {1:g} mm off moves the node by {1.0 / np.sin(np.radians(max(least, 1e-3))):.2g} mm"
            )
            yield LintFinding(
                "warning", "crossing", *group_of_image(assignment, nodes[0]),
                f"the construction lines of {' and '.join(nodes)} meet at only {least:.1f} degrees{moved}",
                chosen(plan.variants, flat),
            )  # fmt: skip
    sines = [np.ones(len(plan.variants)), *plan.motion.transmission.values()]
    again = plan.motion.recomputed & (np.min(sines, axis=0) < LEAST_TRANSMISSION)
    if np.any(again):
        told = "would lose a digit or two in double precision, and was computed with more"
        yield LintFinding(
            "hint", "recomputed", *mechanism_place(assignment), told, chosen(plan.variants, again)
        )
    lost = conditions.error > LARGEST_ERROR
    if np.any(lost):
        told = f"the computed plan may be off by {np.max(conditions.error):.1g} of its size"
        yield LintFinding(
            "warning", "predicted_error", *mechanism_place(assignment), told, chosen(plan.variants, lost)
        )


def _alike(angles: Mapping[str, FloatArray]) -> dict[tuple[str, ...], FloatArray]:
    """Nodes whose lines meet at the same angles in every variant (b and b') told as one."""
    found: list[tuple[list[str], FloatArray]] = []
    for node, angle in angles.items():
        same = next((names for names, other in found if np.allclose(angle, other, rtol=0, atol=1e-6)), None)
        if same is None:
            found.append(([node], angle))
        else:
            same.append(node)
    return {tuple(names): angle for names, angle in found}
