"""pylinkage: components, solved by `step_with_derivatives` with no step of time at the crank's angle."""

import cmath
import math
from collections.abc import Callable
from typing import Any

from pylinkage.actuators import Crank
from pylinkage.components import Ground
from pylinkage.dyads import FixedDyad, RRPDyad, RRRDyad
from pylinkage.exceptions import UnbuildableError
from pylinkage.simulation import Linkage

from grader.bench.peers import Answer, NoAnswerError, Places, Plain, Rod, Triangle


class Pylinkage:
    """One linkage; of two assemblies pylinkage takes the one nearer to where its parts were put last."""

    def __init__(self, plain: Plain) -> None:
        self.plain = plain
        self.parts: dict[str, Any] = {
            joint: Ground(place.real, place.imag, name=joint) for joint, place in plain.ground.items()
        }
        self.crank = self.parts[plain.pin] = Crank(
            anchor=self.parts[plain.pivot], radius=plain.length, angular_velocity=0.0
        )
        guides: list[Any] = []
        for group in plain.groups:
            if isinstance(group, Rod):
                guides += self._add_rod(group)
            else:
                self._add_triangle(group)
        self.linkage = Linkage([*self.parts.values(), *guides])

    def _add_rod(self, rod: Rod) -> list[Any]:
        """Returns two points of its guide, which are parts as well."""
        ends = rod.through, rod.through + cmath.rect(rod.length, rod.angle)
        guide = [Ground(end.real, end.imag) for end in ends]
        self.parts[rod.node] = RRPDyad(self.parts[rod.pin], *guide, rod.length, 0.0, 0.0)
        return guide

    def _add_triangle(self, group: Triangle) -> None:
        anchors = (self.parts[pin] for pin in group.pins)
        if group.shape is None:
            self.parts[group.node] = RRRDyad(*anchors, *group.lengths, 0.0, 0.0)
        else:
            self.parts[group.node] = FixedDyad(*anchors, group.lengths[0], cmath.phase(group.shape))

    def put(self, pin: complex, start: Places) -> None:
        """Put the crank's pin and, as a starting place, each group's node."""
        self.crank.set_coord(pin.real, pin.imag)
        for group in self.plain.groups:
            self.parts[group.node].set_coord(start[group.node].real, start[group.node].imag)

    def solve(self, index: int, start: Places, *, accelerations: bool = True) -> Callable[[], Answer]:
        """It has no call for velocities alone: `accelerations` makes no difference."""
        del accelerations
        plain = self.plain
        self.put(plain.ground[plain.pivot] + plain.arm(index), start)
        self.linkage.set_input_velocity(self.crank, plain.omega[index], plain.epsilon[index])
        try:
            for _ in self.linkage.step_with_derivatives(iterations=1, dt=0.0):
                pass
        except UnbuildableError as error:
            raise NoAnswerError(str(error)) from error
        return self._answer

    def _answer(self) -> Answer:
        def read(name: str) -> Places:
            told = {joint: getattr(part, name) for joint, part in self.parts.items()}
            return {joint: complex(*pair) if pair else complex(math.nan) for joint, pair in told.items()}

        return Answer(read("position"), read("velocity"), read("acceleration"))
