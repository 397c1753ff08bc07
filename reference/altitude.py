"""Normal components by the right-triangle (altitude) method, as construction steps on the sketch.

At B put v_BA as drawn, perpendicular to AB; join its end b'' to A; the perpendicular to Ab'' through b''
meets the line AB beyond B in b'''; half a turn about B brings b''' to b^IV. By the altitude theorem
B b''' = v^2 / AB in drawn lengths, so that B b^IV, from B towards A, is a_BA^n as drawn, exactly where
kL ka = kv^2.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from reference.construction import Construction, Vector, evaluate
from reference.elements import Along, Component, Line, Normal
from reference.errors import CallError
from reference.geometry import ComplexArray
from reference.plan import Plan
from reference.steps import Given, Step, TwoLines

FIGURE = "altitude"
RATIO_TOLERANCE = 1e-6
"""Of kL ka / kv^2 from 1: far below what a ruler shows."""


@dataclass(frozen=True, slots=True)
class Triangle:
    """The right triangle of one normal component, at the joint that turns about the pin.

    Attributes
    ----------
    velocity : ends, in the velocity plan, of the joint's velocity about the pin
    end, beyond, turned : nodes b'', b''' and b^IV
    """

    vector: Vector
    pin: str
    joint: str
    velocity: tuple[str, str]
    end: str
    beyond: str
    turned: str

    @property
    def steps(self) -> tuple[Step, ...]:
        """From the velocity, put at the joint, to the normal component."""
        across, outward = Along(self.pin, self.joint, 1), Along(self.pin, self.joint)
        inward = Along(self.joint, self.pin)
        return (
            Given(self.end, self.joint, Component(*self.velocity, across), across),
            TwoLines(self.beyond, Line(self.end, Along(self.pin, self.end, 1)), Line(self.joint, outward)),
            Given(self.turned, self.joint, Component(self.beyond, self.joint, inward), inward),
        )


def triangles(construction: Construction) -> tuple[Triangle, ...]:
    """One for each normal component that the acceleration plan takes from a velocity."""
    found = []
    for step in construction.figures.get("acceleration_plan", ()):
        if isinstance(step, Given) and isinstance(step.length, Normal):
            vector = next(one for one in construction.vectors.values() if one.head == step.node)
            pin, joint = vector.link or ("", "")
            about = vector.name.split("_")[1]
            nodes = (f"{joint.lower()}{mark}_{about}" for mark in ("''", "'''", "IV"))
            found.append(Triangle(vector, pin, joint, (step.length.tail, step.length.head), *nodes))
    return tuple(found)


def with_triangles(construction: Construction) -> Construction:
    """The same construction with one figure more: the triangles on the mechanism sketch."""
    steps = tuple(step for triangle in triangles(construction) for step in triangle.steps)
    return replace(construction, figures={**construction.figures, FIGURE: steps})


def altitude_nodes(plan: Plan) -> Mapping[str, ComplexArray]:
    """The triangles' nodes on the sketch, complex millimetres.

    Raises CallError where the scales do not allow the method: kL ka is not kv^2.
    """
    check_scales(plan)
    nodes = evaluate(with_triangles(plan.construction), plan.drawing.parameters)
    made = (triangle for triangle in triangles(plan.construction))
    return {
        node: nodes[node] for triangle in made for node in (triangle.end, triangle.beyond, triangle.turned)
    }


def check_scales(plan: Plan) -> None:
    """Refuse scales at which B b^IV is not the normal component; says the ratio and what to do."""
    scales = plan.scales
    ratios = np.atleast_1d(scales.kL * scales.ka / scales.kv**2)
    worst = float(ratios[np.argmax(np.abs(ratios - 1.0))])
    if abs(worst - 1.0) > RATIO_TOLERANCE:
        wanted = float(np.ravel(scales.kv**2 / scales.kL)[0])
        raise CallError(
            "altitude",
            f"the altitude method needs kL ka = kv^2, but kL ka / kv^2 = {worst:.6g}: normal components"
            f" would come out {worst:.4g} times as long as at the scale ka; choose"
            f" ka = kv^2 / kL = {wanted:.6g} (m/s^2)/mm, or lay off v^2/l computed",
        )
