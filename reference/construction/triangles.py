"""Right triangles on the sketch, whose altitudes give normal components, as steps of a construction."""

from dataclasses import dataclass

from reference.construction.elements import Along, Component, Line, Normal
from reference.construction.graph import Construction, Vector
from reference.construction.steps import Given, Step, TwoLines


@dataclass(frozen=True, slots=True)
class Triangle:
    """The right triangle of one normal component, at the joint that turns about the pin.

    Attributes
    ----------
    velocity : ends, in the velocity plan, of the joint's velocity relative to the pin
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
        """The steps from the velocity, drawn at the joint, to the normal component."""
        across, outward = Along(self.pin, self.joint, 1), Along(self.pin, self.joint)
        inward = Along(self.joint, self.pin)
        return (
            Given(self.end, self.joint, Component(*self.velocity, across), across),
            TwoLines(self.beyond, Line(self.end, Along(self.pin, self.end, 1)), Line(self.joint, outward)),
            Given(self.turned, self.joint, Component(self.beyond, self.joint, inward), inward),
        )


def triangles(construction: Construction) -> tuple[Triangle, ...]:
    """Return a triangle for each normal component that the acceleration plan takes from a velocity."""
    found = []
    for step in construction.figures.get("acceleration_plan", ()):
        if isinstance(step, Given) and isinstance(step.length, Normal):
            vector = next(one for one in construction.vectors.values() if one.head == step.node)
            pin, joint = vector.link or ("", "")
            about = vector.name.split("_")[1]
            nodes = (f"{joint.lower()}{mark}_{about}" for mark in ("''", "'''", "IV"))
            found.append(Triangle(vector, pin, joint, (step.length.tail, step.length.head), *nodes))
    return tuple(found)
