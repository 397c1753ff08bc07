"""Other programs that solve the same mechanisms, each through the calls that it recommends itself.

They are optional: a peer that is not installed is left out, and said so. Each is told the branch as
well as its interface lets a user tell it: where it takes a starting place, it gets that of a sketch in
which each dyad and rod is opened a little further than it is (`sketch`), so that the nearer of two
assemblies is the one meant. The adapters stand in `tests.bench.adapters`.
"""

import cmath
import importlib
import importlib.util
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import Protocol

import numpy as np

from reference.geometry import ComplexArray
from reference.mechanism import Dyad, FixedGuide, Mechanism, Plate, Slider
from reference.motion import Motion

OPENED = 0.05
"""How far a sketch opens a group: this share of its link's length."""

Places = Mapping[str, complex]


class NoAnswerError(Exception):
    """The peer says that it has no answer, and why."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What a solver gives for one variant, by joint, SI; nan where it gives no number.

    `predicted_error` where it tells one, relative to the largest of each plan.
    """

    position: Places
    velocity: Places
    acceleration: Places
    predicted_error: float | None = None


def answer_of(motion: Motion, index: int) -> Answer:
    """The closed form's, of one variant."""

    def read(rates: Mapping[str, ComplexArray]) -> Places:
        return {joint: complex(values[index]) for joint, values in rates.items()}

    predicted = float(motion.predicted_error[index])
    return Answer(read(motion.position), read(motion.velocity), read(motion.acceleration), predicted)


def error_of(found: Places, truth: Places) -> float:
    """The largest error, relative to the largest of the plan; nan where a joint has no number."""
    errors = [abs(found[joint] - exact) for joint, exact in truth.items() if joint in found]
    return math.nan if any(map(math.isnan, errors)) else max(errors) / max(map(abs, truth.values()))


@dataclass(frozen=True, slots=True)
class Triangle:
    """A node held by two lengths to two joints; `shape` where all three are of one link (a plate)."""

    node: str
    pins: tuple[str, str]
    lengths: tuple[float, float]
    shape: complex | None


@dataclass(frozen=True, slots=True)
class Rod:
    """A node held by a length to a joint and by a fixed guide."""

    node: str
    pin: str
    length: float
    through: complex
    angle: float


@dataclass(frozen=True, slots=True)
class Plain:
    """A mechanism in Python's own numbers, as a peer's user would have it: metres, radians.

    The lengths are the same in all variants; the crank's angle, speed and acceleration are by variant.
    """

    ground: Places
    pivot: str
    pin: str
    length: float
    angle: list[float]
    omega: list[float]
    epsilon: list[float]
    groups: tuple[Triangle | Rod, ...]

    def arm(self, index: int) -> complex:
        """From the crank's pivot to its pin."""
        return cmath.rect(self.length, self.angle[index])


def plain(mechanism: Mechanism) -> Plain:
    """Raises NoAnswerError for groups that no peer here knows."""
    crank = mechanism.crank
    angle, omega, epsilon = np.broadcast_arrays(crank.angle_rad, crank.omega, crank.epsilon)
    return Plain(
        ground={joint: complex(place.flat[0]) for joint, place in mechanism.ground_m.items()},
        pivot=crank.pivot,
        pin=crank.pin,
        length=float(crank.length_m.flat[0]),
        angle=angle.ravel().tolist(),
        omega=omega.ravel().tolist(),
        epsilon=epsilon.ravel().tolist(),
        groups=tuple(map(_plain_group, mechanism.groups)),
    )


def _plain_group(group: object) -> Triangle | Rod:
    match group:
        case Slider(guide=FixedGuide(through_m=through, angle_rad=angle)):
            numbers = float(group.length_m.flat[0]), complex(through.flat[0]), float(angle.flat[0])
            return Rod(group.node, group.pin, *numbers)
        case Dyad(pins=pins) | Plate(base=pins):
            shape = complex(group.shape.flat[0]) if isinstance(group, Plate) else None
            first, second = (float(length.flat[0]) for length in group.lengths_m)
            return Triangle(group.node, pins, (first, second), shape)
    raise NoAnswerError(f"no adapter for {type(group).__name__}")


def sketch(mechanism: Mechanism, position: Mapping[str, ComplexArray]) -> dict[str, ComplexArray]:
    """Where the joints are in a sketch that shows plainly on which side each group lies."""
    told = dict(position)
    for group in mechanism.groups:
        if isinstance(group, Dyad):
            p, q = (position[pin] for pin in group.pins)
            away = 1j * (q - p) / np.abs(q - p)
            length = np.minimum(*group.lengths_m)
        elif isinstance(group, Slider) and isinstance(group.guide, FixedGuide):
            away, length = np.exp(1j * group.guide.angle_rad), group.length_m
        else:
            continue
        told[group.node] = position[group.node] + OPENED * length * group.side * away
    return told


class Peer(Protocol):
    """A solver built once for a mechanism whose lengths are the same in all variants."""

    def solve(self, index: int, start: Places, *, accelerations: bool = True) -> Callable[[], Answer]:
        """Solve one variant; what it returns reads the answer.

        Raises NoAnswerError where the peer says so.
        """


@dataclass(frozen=True, slots=True)
class Package:
    """A peer: the name shown, its distribution, the module it needs, and its adapter's class.

    `velocities_alone` where it can leave out the accelerations.
    """

    name: str
    distribution: str
    module: str
    adapter: str
    velocities_alone: bool = True

    @property
    def version(self) -> str | None:
        """The installed version; None where it is not installed."""
        return version(self.distribution) if importlib.util.find_spec(self.module) else None

    def build(self, mechanism: Mechanism) -> Peer:
        """The peer's solver for a mechanism."""
        where = importlib.import_module(f"tests.bench.adapters.{self.module}_adapter")
        solver: Peer = getattr(where, self.adapter)(plain(mechanism))
        return solver


PYLINKAGE = Package("pylinkage", "pylinkage", "pylinkage", "Pylinkage", velocities_alone=False)
PEERS = (
    PYLINKAGE,
    Package("mechanism", "mechanism", "mechanism", "VectorLoops"),
    Package("scipy fsolve", "scipy", "scipy", "Fsolve"),
)
