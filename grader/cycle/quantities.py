"""Strokes of reciprocating and rocking members: dead points, travel, time ratio; extremes of quantities."""

import difflib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from grader.files import guarded
from grader.tables.reader import written
from grader.texts.spoken import failure
from reference.construction.derive import construction_of
from reference.construction.graph import Construction
from reference.errors import CallError
from reference.geometry import ComplexArray, FloatArray, direction, dot
from reference.kinematics.continuation import change
from reference.kinematics.cycle import Cycle
from reference.kinematics.motion import Motion, move_where_possible
from reference.mechanism import FixedGuide, Mechanism, members
from reference.plan import vectors_of
from reference.quantities import KindName, kind_of, unit_of

# Quantities ---------------------------------------------------------------------------------------

AXES: tuple[Literal["x", "y"], ...] = ("x", "y")
_LETTERS = ("v", "a")
FINE = 361
"""Samples of a cycle searched for extremes and dead points: one degree of a full turn."""
MANY = 24
"""Most known names listed in an error message."""


@dataclass(frozen=True, slots=True)
class CycleQuantity:
    """A number that changes over the cycle: a vector's length or component, or a link's rate."""

    name: str
    kind: KindName
    of: str
    """The vector's or the rate's own name."""
    axis: Literal["", "x", "y"] = ""

    @property
    def unit(self) -> str:
        """Its SI unit."""
        return unit_of(self.of)


@dataclass(frozen=True, slots=True)
class Selection:
    """The contents of a table or a diagram: quantities, and points whose paths are drawn."""

    quantities: tuple[CycleQuantity, ...]
    points: tuple[str, ...] = ()


class CycleSubject:
    """A mechanism on its cycle, with every quantity of it by name."""

    def __init__(self, cycle: Cycle) -> None:
        self.cycle = cycle
        self.structure = cycle.following.mechanism
        self.construction: Construction = construction_of(self.structure)
        moving = [joint for joint in self.structure.joints if not self.structure.is_ground(joint)]
        self.points = tuple(moving)
        self._known = self._quantities()

    def _quantities(self) -> dict[str, CycleQuantity]:
        vectors = [
            *self.construction.vectors,
            *(f"{letter}_{at}" for letter in _LETTERS for at in self.points),
        ]
        rates = [f"{rate}_{link}" for link in self.cycle.motion.omega for rate in ("omega", "epsilon")]
        known = {}
        for name in dict.fromkeys((*vectors, *rates)):
            known[name] = CycleQuantity(name, kind_of(name).name, name)
            for axis in AXES if name in vectors else ():
                known[f"{name}_{axis}"] = CycleQuantity(f"{name}_{axis}", kind_of(name).name, name, axis)
        return known

    def select(self, names: list[str]) -> Selection:
        """Return the named quantities and points; without names, speeds and accelerations of all points.

        Raises CallError with the near names for an unknown one.
        """
        if not names:
            every = [f"{letter}_{joint}" for letter in _LETTERS for joint in self.points]
            return Selection(tuple(self._known[name] for name in every))
        for name in names:
            if name not in self._known and name not in self.points:
                raise self._unknown(name)
        chosen = dict.fromkeys(names)
        return Selection(
            tuple(self._known[name] for name in chosen if name in self._known),
            tuple(name for name in chosen if name in self.points),
        )

    def _unknown(self, name: str) -> CallError:
        plain = [known for known in self._known if not known.endswith(("_x", "_y"))]
        everything = [*self.points, *plain]
        by_case = {known.lower(): known for known in [*self.points, *self._known]}
        same = by_case.get(name.lower())
        near = [same] if same else difflib.get_close_matches(name, everything, n=2, cutoff=0.5)
        listed = (*everything[:MANY], *(["..."] if len(everything) > MANY else []))
        known = {"text": name, "near": tuple(near), "names": listed}
        return failure(CallError, "unknown_quantity", "quantity_near" if near else "", **known)

    @cached_property
    def fine(self) -> tuple[FloatArray, Motion]:
        """Driving coordinates dense enough to find extremes and dead points, and the motion there."""
        cycle = self.cycle
        if cycle.driving.size >= FINE:
            return cycle.driving, cycle.motion
        driving = np.linspace(cycle.driving[0], cycle.driving[-1], FINE)
        driving = driving if cycle.turns else driving[1:-1]
        return driving, self.motion_at(driving)

    def values(self, quantity: CycleQuantity, motion: Motion | None = None) -> FloatArray:
        """Return a quantity over the cycle, or in another motion of the mechanism, SI, (N,).

        A value smaller than its own predicted error (relative to the largest of its kind) is zero.
        """
        motion = motion or self.cycle.motion
        values = self._values(quantity, motion)
        with np.errstate(invalid="ignore"):
            is_rounding = np.abs(values) <= motion.predicted_error * _largest(quantity.kind, motion)
        return np.where(is_rounding, 0.0, values)

    def size(self, quantity: CycleQuantity) -> float:
        """Return the usual size of the largest quantity of a kind over the cycle, for comparison."""
        return float(np.nanmedian(_largest(quantity.kind, self.fine[1])))

    def _values(self, quantity: CycleQuantity, motion: Motion) -> FloatArray:
        if quantity.kind in {"omega", "epsilon"}:
            rates: Mapping[str, FloatArray] = motion.omega if quantity.kind == "omega" else motion.epsilon
            return rates[quantity.of.partition("_")[2]]
        vector = self._vector(quantity.of, motion)
        match quantity.axis:
            case "x":
                return np.asarray(vector.real)
            case "y":
                return np.asarray(vector.imag)
        return np.abs(vector)

    def _vector(self, name: str, motion: Motion) -> ComplexArray:
        joint = name[2:]
        if joint in self.points:
            return (motion.velocity if kind_of(name).name == "velocity" else motion.acceleration)[joint]
        with np.errstate(all="ignore"):
            return vectors_of(self.construction, self.structure, motion)[name]

    def values_at(self, quantity: CycleQuantity, driving: FloatArray) -> FloatArray:
        """Return a quantity at other driving coordinates, nan in singular ones."""
        return self.values(quantity, self.motion_at(driving))

    def motion_at(self, driving: FloatArray) -> Motion:
        """Return the motion at other driving coordinates, nan in singular ones."""
        mechanism: Mechanism = self.cycle.following.at(driving)
        return move_where_possible(mechanism)


def _largest(kind: KindName, motion: Motion) -> FloatArray:
    """Return the largest of a kind at each sample; angular accelerations are squares of velocities."""
    match kind:
        case "velocity":
            parts = [np.abs(one) for one in motion.velocity.values()]
        case "acceleration":
            parts = [np.abs(one) for one in motion.acceleration.values()]
        case "omega":
            parts = [np.abs(one) for one in motion.omega.values()]
        case "epsilon":
            parts = [np.abs(one) for one in motion.epsilon.values()]
            parts += [one * one for one in motion.omega.values()]
    return np.asarray(np.max(parts, axis=0))


def cycle_csv(subject: CycleSubject, selection: Selection, *, decimal_comma: bool = False) -> str:
    """Return the driving coordinate and the selected quantities at each sample, or the reason for none.

    Numbers with all their digits (they read back as the same doubles), blank where there is none; the file
    begins as ``crank angle [deg],v_B [m/s],x_D [m]`` and ends with the column ``note``. With decimal commas
    fields are separated by semicolons. UTF-8 without a mark, CRLF.
    """
    cycle = subject.cycle
    first = (
        ("crank angle [deg]", np.degrees(cycle.driving))
        if cycle.is_turned
        else ("displacement [m]", cycle.driving)
    )
    columns: list[tuple[str, FloatArray]] = [first]
    columns += [(f"{one.name} [{one.unit}]", subject.values(one)) for one in selection.quantities]
    for point in selection.points:
        place = np.broadcast_to(cycle.motion.position[point], cycle.driving.shape)
        columns += [(f"x_{point} [m]", place.real), (f"y_{point} [m]", place.imag)]
    rows = [[*(guarded(heading) for heading, _ in columns), "note"]]
    for row in range(cycle.driving.size):
        numbers = [_written(float(values[row]), decimal_comma) for _, values in columns]
        rows.append([*numbers, guarded(cycle.undetermined.get(row, ""))])
    return written(rows, ";" if decimal_comma else ",")


def _written(value: float, decimal_comma: bool) -> str:
    if not np.isfinite(value):
        return ""
    # Adding zero turns minus zero into zero.
    text = repr(value + 0.0)
    return text.replace(".", ",") if decimal_comma else text


# Strokes and extremes -----------------------------------------------------------------------------

POINTS = 17
ROUNDS = 11
APPROACH = np.array([1e-3, 1e-4, 1e-5])
"""Distances from the end, as shares of the range, at which a quantity is tested for growing without bound."""
GROWS = 1.8
"""Least growth from each of these to the next: of 1 / sqrt(distance) it is 3.2."""
REST = 1e-9
"""A rate below this share of its largest is rounding: the part is at rest."""


@dataclass(frozen=True, slots=True)
class OutputStroke:
    """A stroke between two dead points.

    Attributes
    ----------
    name : the slider's point, or the link that rocks
    is_angle : whether `travel` is an angle (rad) or a length (m)
    dead_points : driving coordinates at which it turns back, ascending
    travel : between its two ends, None if it turns back more than twice a cycle
    time_ratio : of the slower stroke to the faster one, at constant crank speed; None as above
    """

    name: str
    is_angle: bool
    dead_points: tuple[float, ...]
    travel: float | None
    time_ratio: float | None


@dataclass(frozen=True, slots=True)
class Extreme:
    """A largest or smallest value and its place; infinite towards ends of the range if unbounded."""

    value: float
    at: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Output:
    """A member that may reciprocate or rock: its rate, and its position along the guide or its arm."""

    name: str
    is_angle: bool
    rate: Callable[[Motion], FloatArray]
    place: Callable[[Motion], ComplexArray]


def strokes_of(subject: CycleSubject) -> tuple[OutputStroke, ...]:
    """Return strokes of all sliders on fixed guides and all links hinged to the ground that turn back."""
    strokes = (_stroke(subject, output) for output in _outputs(subject))
    return tuple(stroke for stroke in strokes if stroke.dead_points)


def _outputs(subject: CycleSubject) -> Iterator[_Output]:
    for link, member, group in members(subject.structure):
        if isinstance(member.guide, FixedGuide):
            yield _slider(group.node, member.guide)
        elif not member.slides and subject.structure.is_ground(member.points[0]):
            yield _rocker(link, member.points[0], group.node)


def _slider(node: str, guide: FixedGuide) -> _Output:
    along = direction(guide.angle_rad)

    def rate(motion: Motion) -> FloatArray:
        return dot(along, motion.velocity[node])

    def place(motion: Motion) -> ComplexArray:
        return np.asarray(dot(along, motion.position[node]) + 0j)

    return _Output(node, False, rate, place)  # noqa: FBT003 - the field's name says it


def _rocker(link: str, pin: str, node: str) -> _Output:
    def rate(motion: Motion) -> FloatArray:
        return motion.omega[link]

    def place(motion: Motion) -> ComplexArray:
        return np.asarray(motion.position[node] - motion.position[pin])

    return _Output(link, True, rate, place)  # noqa: FBT003 - as above


def _stroke(subject: CycleSubject, output: _Output) -> OutputStroke:
    cycle = subject.cycle
    dead = tuple(sorted(set(_turning_points(subject, output))))
    if not cycle.turns or len(dead) != 2:
        return OutputStroke(output.name, output.is_angle, dead, None, None)
    first, second = dead
    period = float(cycle.driving[-1] - cycle.driving[0])
    ways = (second - first, period - (second - first))
    return OutputStroke(
        output.name, output.is_angle, dead, _travel(subject, output, dead), max(ways) / min(ways)
    )


def _turning_points(subject: CycleSubject, output: _Output) -> Iterator[float]:
    """Yield positions where the rate changes its sign, refined; the ends of a full cycle are one."""
    cycle = subject.cycle
    samples, motion = subject.fine
    rate = output.rate(motion)
    told = np.isfinite(rate) & (np.abs(rate) > REST * np.nanmax(np.abs(rate), initial=0.0))
    driving, signs = samples[told], np.sign(rate[told])
    if cycle.turns and driving.size:
        period = cycle.driving[-1] - cycle.driving[0]
        driving, signs = np.append(driving, driving[0] + period), np.append(signs, signs[0])
    for k in np.flatnonzero(signs[1:] != signs[:-1]):

        def holds(points: FloatArray, sign: float = signs[k]) -> np.ndarray:
            return np.asarray(output.rate(subject.motion_at(points)) * sign > 0.0)

        at = change(holds, float(driving[k]), float(driving[k + 1]))[0]
        if cycle.turns:
            # A dead point at the cycle's end, but for rounding, is the one at its beginning.
            at = at % period
            at = 0.0 if period - at < REST * period else at
        yield at


def _travel(subject: CycleSubject, output: _Output, dead: tuple[float, ...]) -> float:
    """Return the travel between two dead points, an angle followed from sample to sample."""
    driving, _ = subject.fine
    between = driving[(driving > dead[0]) & (driving < dead[1])]
    place = output.place(subject.motion_at(np.array([dead[0], *between, dead[1]])))
    if not output.is_angle:
        return abs(float((place[-1] - place[0]).real))
    turned = np.angle(place[1:] / place[:-1])
    return abs(float(np.nansum(turned)))


def extremes(subject: CycleSubject, quantity: CycleQuantity) -> tuple[Extreme, Extreme]:
    """Return the smallest and the largest value over the cycle, not only at its samples."""
    values = subject.values(quantity, subject.fine[1])
    smallest, largest = (_refined(subject, quantity, values, sign) for sign in (-1.0, 1.0))
    ends = list(unbounded_ends(subject, quantity))
    falls, grows = (tuple(end for end, way in ends if way == sign) for sign in (-1.0, 1.0))
    return (
        Extreme(-np.inf, falls) if falls else smallest,
        Extreme(np.inf, grows) if grows else largest,
    )


def _refined(subject: CycleSubject, quantity: CycleQuantity, values: FloatArray, sign: float) -> Extreme:
    driving, _ = subject.fine
    if not np.isfinite(values).any():
        return Extreme(np.nan, ())
    best = int(np.nanargmax(sign * values))
    at, value = float(driving[best]), float(values[best])
    low, high = driving[max(best - 1, 0)], driving[min(best + 1, driving.size - 1)]
    if np.ptp(values[np.isfinite(values)]) <= REST * abs(value):
        return Extreme(value, (at,))
    for _ in range(ROUNDS):
        points = np.linspace(low, high, POINTS)
        signed = sign * subject.values_at(quantity, points)
        k = int(np.nanargmax(signed)) if np.isfinite(signed).any() else 0
        if signed[k] > sign * value:
            at, value = float(points[k]), sign * float(signed[k])
        low, high = points[max(k - 1, 0)], points[min(k + 1, POINTS - 1)]
    return Extreme(value, (at,))


def unbounded_ends(subject: CycleSubject, quantity: CycleQuantity) -> Iterator[tuple[float, float]]:
    """Yield ends of the range towards which a quantity grows without bound, and its sign there."""
    cycle: Cycle = subject.cycle
    low, high = float(cycle.driving[0]), float(cycle.driving[-1])
    for stop, inward in zip(cycle.following.stops, (1.0, -1.0), strict=True):
        if stop is None or cycle.turns:
            continue
        values = subject.values_at(quantity, stop.at + inward * (high - low) * APPROACH)
        if np.all(np.abs(values[1:]) > GROWS * np.abs(values[:-1])):
            yield stop.at, float(np.sign(values[-1]))
