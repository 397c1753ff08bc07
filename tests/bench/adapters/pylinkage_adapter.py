"""pylinkage: components, solved by `step_with_derivatives` with no step of time at the crank's angle."""

import cmath
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from pylinkage.actuators import Crank
from pylinkage.components import Ground
from pylinkage.dyads import FixedDyad, RRPDyad, RRRDyad
from pylinkage.exceptions import UnbuildableError
from pylinkage.simulation import Linkage

from tests.bench.peers import Answer, NoAnswerError, Places, Plain, Rod, Triangle


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


class PylinkageCycle:
    """Its compiled road (numba): a cycle of equally spaced crank angles at one speed.

    It has none for variants: their speeds are reckoned in afterwards, velocities being proportional to
    the crank's speed, accelerations to its square (without an angular acceleration).
    """

    def __init__(self, plain: Plain) -> None:
        self.single, self.plain = Pylinkage(plain), plain
        self.count = len(plain.angle)
        self.step = (plain.angle[-1] - plain.angle[0]) / max(self.count - 1, 1)
        self.single.crank.angular_velocity = self.step
        self.single.linkage.compile()
        self.speeds = np.array(plain.omega)[:, None, None]

    def run(self, start: Places) -> tuple[Any, Any, Any]:
        """Positions, velocities and accelerations, (N, parts, 2); `start` is the first variant's sketch."""
        plain, linkage = self.plain, self.single.linkage
        before = cmath.rect(plain.length, plain.angle[0] - self.step)
        self.single.put(plain.ground[plain.pivot] + before, start)
        linkage.set_input_velocity(self.single.crank, 1.0)
        place, turn, bend = linkage.step_fast_with_kinematics(self.count)
        return place, turn * self.speeds, bend * self.speeds**2

    def answers(self, start: Places) -> list[Answer]:
        """By variant."""
        place, velocity, acceleration = (rates[..., 0] + 1j * rates[..., 1] for rates in self.run(start))
        names = tuple(self.single.parts)

        def read(rates: Any) -> Places:
            return dict(zip(names, rates.tolist(), strict=False))

        return [
            Answer(read(place[row]), read(velocity[row]), read(acceleration[row]))
            for row in range(self.count)
        ]
