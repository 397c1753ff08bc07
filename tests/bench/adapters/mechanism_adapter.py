"""mechanism: loops of vectors, solved by `calculate` from guessed angles."""

import cmath
import math
import warnings
from collections.abc import Callable
from typing import Any

import mechanism as peer
import numpy as np

from tests.bench.peers import Answer, NoAnswerError, Places, Plain, Rod, Triangle


class VectorLoops:
    """One loop per group: along both its vectors to the node, and back through what they start from."""

    def __init__(self, plain: Plain) -> None:
        self.plain, self.origin = plain, plain.ground[plain.pivot]
        joints = (*plain.ground, plain.pin, *(group.node for group in plain.groups))
        self.joints = {joint: peer.Joint(joint) for joint in joints}
        self.still: dict[str, Any] = {}
        for joint, place in plain.ground.items():
            if joint != plain.pivot:
                self._add_still(joint, self.joints[joint], place)
        self.arm = peer.Vector((self.joints[plain.pivot], self.joints[plain.pin]), r=plain.length)
        self.pairs = [self._pair(group) for group in plain.groups]
        vectors = [self.arm, *self.still.values(), *(vector for pair in self.pairs for vector in pair[:2])]
        self.peer = peer.Mechanism(
            vectors=vectors, origin=self.joints[plain.pivot], loops=self._loops, pos=0.0
        )

    def _add_still(self, name: str, joint: Any, place: complex) -> None:
        length, angle = cmath.polar(place - self.origin)
        self.still[name] = peer.Vector((self.joints[self.plain.pivot], joint), length, angle)

    def _pair(self, group: Triangle | Rod) -> tuple[Any, Any, str, str]:
        """Both vectors that meet in the group's node, and the names of what they start from."""
        node = self.joints[group.node]
        if isinstance(group, Triangle):
            (p, q), (first, second) = group.pins, group.lengths
            ends = (self.joints[p], node), (self.joints[q], node)
            return peer.Vector(ends[0], r=first), peer.Vector(ends[1], r=second), p, q
        foot, start = f"guide of {group.node}", self.joints[self.plain.pivot]
        if group.through != self.origin:
            start = peer.Joint(foot)
            self._add_still(foot, start, group.through)
        rod = peer.Vector((self.joints[group.pin], node), r=group.length)
        return rod, peer.Vector((start, node), theta=group.angle), group.pin, foot

    def _loops(self, x: Any, driven: float) -> Any:
        at: dict[str, Any] = {self.plain.pin: self.arm(driven)}
        at.update({joint: vector() for joint, vector in self.still.items()})
        gaps = np.zeros((len(self.pairs), 2))
        for k, (first, second, p, q) in enumerate(self.pairs):
            head = at.get(p, 0.0) + first(x[2 * k])
            gaps[k] = head - second(x[2 * k + 1]) - at.get(q, 0.0)
            at[self.plain.groups[k].node] = head
        return gaps.flatten()

    def _guess(self, start: Places) -> Any:
        told: list[float] = []
        for (_, _, p, q), group in zip(self.pairs, self.plain.groups, strict=True):
            told.append(cmath.phase(start[group.node] - start[p]))
            if isinstance(group, Rod):
                along = (start[group.node] - group.through) * cmath.rect(1.0, -group.angle)
                told.append(along.real)
            else:
                told.append(cmath.phase(start[group.node] - start[q]))
        return np.array(told)

    def solve(self, index: int, start: Places, *, accelerations: bool = True) -> Callable[[], Answer]:
        """Velocities and accelerations too are found by fsolve there: from zero."""
        solver, plain = self.peer, self.plain
        zero = np.zeros(2 * len(self.pairs))
        solver.guess = (self._guess(start), zero, zero)
        solver.pos, solver.vel = plain.angle[index], plain.omega[index]
        solver.acc = plain.epsilon[index] if accelerations else None
        solver.clear_joints()
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            try:
                solver.calculate()
            except RuntimeWarning as warning:
                raise NoAnswerError(str(warning)) from warning
        return self._answer

    def _answer(self) -> Answer:
        def read(what: str) -> dict[str, complex]:
            told = {}
            for name, joint in self.joints.items():
                x, y = getattr(joint, f"x_{what}"), getattr(joint, f"y_{what}")
                told[name] = complex(math.nan) if x is None or y is None else complex(x, y)
            return told

        place = {name: self.origin + arm for name, arm in read("pos").items()}
        return Answer(place, read("vel"), read("acc"))
