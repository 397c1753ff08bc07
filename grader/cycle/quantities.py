"""Quantities of a cycle by name, and their table: vectors of the plans, rates of links, paths of points.

``v_B`` is a speed, ``v_B_x`` and ``v_B_y`` its components; likewise ``a_B``, ``v_BA``, ``a_BA_n``;
``omega_3``, ``epsilon_3`` counter-clockwise positive; ``D`` the path of point D.
"""

import csv
import difflib
import io
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from reference.construction import Construction
from reference.cycle import Cycle
from reference.derivation import construction_of
from reference.errors import CallError
from reference.geometry import ComplexArray, FloatArray
from reference.mechanism import Mechanism
from reference.motion import Motion, move_where_possible
from reference.plan import vectors_of

Kind = Literal["velocity", "acceleration", "omega", "epsilon"]
UNITS: dict[Kind, str] = {"velocity": "m/s", "acceleration": "m/s²", "omega": "rad/s", "epsilon": "rad/s²"}
AXES: tuple[Literal["x", "y"], ...] = ("x", "y")
_LETTERS: dict[str, Kind] = {"v": "velocity", "a": "acceleration"}
FINE = 361
"""Samples of a cycle among which extremes and dead points are sought: one degree of a full turn."""
MANY = 24
"""An error message lists at most so many known names."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number that changes over the cycle: a vector's length or component, or a link's rate."""

    name: str
    kind: Kind
    of: str
    """The vector's or the rate's own name."""
    axis: Literal["", "x", "y"] = ""

    @property
    def unit(self) -> str:
        """SI."""
        return UNITS[self.kind]


@dataclass(frozen=True, slots=True)
class Selection:
    """What a table or a diagram shows: quantities, and points whose paths are drawn."""

    quantities: tuple[Quantity, ...]
    points: tuple[str, ...] = ()


class Subject:
    """A mechanism on its cycle, with every quantity of it by name."""

    def __init__(self, cycle: Cycle) -> None:
        self.cycle = cycle
        self.structure = cycle.following.mechanism
        self.construction: Construction = construction_of(self.structure)
        moving = [joint for joint in self.structure.joints if not self.structure.is_ground(joint)]
        self.points = tuple(moving)
        self._known = self._quantities()

    def _quantities(self) -> dict[str, Quantity]:
        kinds: dict[str, Kind] = {"kv": "velocity", "ka": "acceleration"}
        vectors: dict[str, Kind] = {
            name: kinds[vector.scale] for name, vector in self.construction.vectors.items()
        }
        vectors |= {f"{letter}_{joint}": kind for letter, kind in _LETTERS.items() for joint in self.points}
        known = {}
        for name, kind in vectors.items():
            known[name] = Quantity(name, kind, name)
            for axis in AXES:
                known[f"{name}_{axis}"] = Quantity(f"{name}_{axis}", kind, name, axis)
        for link in self.cycle.motion.omega:
            known[f"omega_{link}"] = Quantity(f"omega_{link}", "omega", f"omega_{link}")
            known[f"epsilon_{link}"] = Quantity(f"epsilon_{link}", "epsilon", f"epsilon_{link}")
        return known

    def select(self, names: list[str]) -> Selection:
        """The quantities and points of some names; speeds and accelerations of all points for none.

        Raises CallError with the near names for one that is unknown.
        """
        if not names:
            every = [f"{letter}_{joint}" for letter in _LETTERS for joint in self.points]
            return Selection(tuple(self._known[name] for name in every))
        for name in names:
            if name not in self._known and name not in self.points:
                raise CallError("unknown_quantity", self._unknown(name))
        chosen = dict.fromkeys(names)
        return Selection(
            tuple(self._known[name] for name in chosen if name in self._known),
            tuple(name for name in chosen if name in self.points),
        )

    def _unknown(self, name: str) -> str:
        plain = [known for known in self._known if not known.endswith(("_x", "_y"))]
        everything = [*self.points, *plain]
        by_case = {known.lower(): known for known in [*self.points, *self._known]}
        same = by_case.get(name.lower())
        near = [same] if same else difflib.get_close_matches(name, everything, n=2, cutoff=0.5)
        meant = f" (did you mean {' or '.join(near)}?)" if near else ""
        listed = ", ".join(everything[:MANY]) + (", ..." if len(everything) > MANY else "")
        return (
            f"nothing on this cycle is called '{name}'{meant}: known are {listed}; _x or _y for a component"
        )

    @cached_property
    def fine(self) -> tuple[FloatArray, Motion]:
        """Driven coordinates close enough to find extremes and dead points by, and the motion there."""
        cycle = self.cycle
        if cycle.driven.size >= FINE:
            return cycle.driven, cycle.motion
        driven = np.linspace(cycle.driven[0], cycle.driven[-1], FINE)
        driven = driven if cycle.turns else driven[1:-1]
        return driven, self.motion_at(driven)

    def values(self, quantity: Quantity, motion: Motion | None = None) -> FloatArray:
        """A quantity over the cycle, or in another motion of the mechanism, SI, (N,).

        What is smaller than its own predicted error (relative to the largest of its kind) is zero.
        """
        motion = motion or self.cycle.motion
        values = self._values(quantity, motion)
        with np.errstate(invalid="ignore"):
            is_rounding = np.abs(values) <= motion.predicted_error * _largest(quantity.kind, motion)
        return np.where(is_rounding, 0.0, values)

    def size(self, quantity: Quantity) -> float:
        """How large the largest of a kind usually is over the cycle: against it others are small."""
        return float(np.nanmedian(_largest(quantity.kind, self.fine[1])))

    def _values(self, quantity: Quantity, motion: Motion) -> FloatArray:
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
            return (motion.velocity if name[0] == "v" else motion.acceleration)[joint]
        with np.errstate(all="ignore"):
            return vectors_of(self.construction, self.structure, motion)[name]

    def values_at(self, quantity: Quantity, driven: FloatArray) -> FloatArray:
        """A quantity at other driven coordinates, nan in singular ones."""
        return self.values(quantity, self.motion_at(driven))

    def motion_at(self, driven: FloatArray) -> Motion:
        """The motion at other driven coordinates, nan in singular ones."""
        mechanism: Mechanism = self.cycle.following.at(driven)
        return move_where_possible(mechanism)


def _largest(kind: Kind, motion: Motion) -> FloatArray:
    """The size of all that is of a kind, at each sample; angular accelerations are squares of velocities."""
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


def cycle_csv(subject: Subject, selection: Selection, *, decimal_comma: bool = False) -> str:
    """The driven coordinate and the selected quantities at each sample; the reason where there is none.

    Numbers with all their digits (they read back as the same doubles), blank where there is none; the
    file begins as ``crank angle [deg],v_B [m/s],x_D [m]`` and ends with the column ``note``. With decimal
    commas fields are separated by semicolons. UTF-8 without a mark, CRLF.
    """
    cycle = subject.cycle
    first = (
        ("crank angle [deg]", np.degrees(cycle.driven))
        if cycle.is_turned
        else ("displacement [m]", cycle.driven)
    )
    columns: list[tuple[str, FloatArray]] = [first]
    for quantity in selection.quantities:
        unit = quantity.unit.replace("s²", "s^2")
        columns.append((f"{quantity.name} [{unit}]", subject.values(quantity)))
    for point in selection.points:
        place = np.broadcast_to(cycle.motion.position[point], cycle.driven.shape)
        columns += [(f"x_{point} [m]", place.real), (f"y_{point} [m]", place.imag)]
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\r\n", delimiter=";" if decimal_comma else ",")
    writer.writerow([*(heading for heading, _ in columns), "note"])
    for row in range(cycle.driven.size):
        numbers = [_written(float(values[row]), decimal_comma) for _, values in columns]
        writer.writerow([*numbers, cycle.untold.get(row, "")])
    return buffer.getvalue()


def _written(value: float, decimal_comma: bool) -> str:
    if not np.isfinite(value):
        return ""
    # Adding zero turns minus zero into zero.
    text = repr(value + 0.0)
    return text.replace(".", ",") if decimal_comma else text
