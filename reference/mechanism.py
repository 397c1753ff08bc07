"""A planar mechanism for one variant or for many: ground, a driven crank, Assur groups in order.

All numbers are SI and arrays that broadcast over variants and positions, shape (N,). Angles are
counter-clockwise from +x. Branches are explicit signs, never starting guesses: `side` is +1 to the
left of the directed line between the group's pins (for a slider: ahead along its guide), -1 to the
right (behind).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from reference.geometry import ComplexArray, FloatArray

Pins = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Crank:
    """The driven link: pivot on the ground, pin at its end; `omega` may be negative (clockwise)."""

    link: str
    pivot: str
    pin: str
    length_m: FloatArray
    angle_rad: FloatArray
    omega: FloatArray
    epsilon: FloatArray
    accelerated: bool
    """Whether the mechanism has a crank acceleration at all: if not, a_A has no tangential part."""


@dataclass(frozen=True, slots=True)
class Dyad:
    """Assur group RRR: `node` joins two links, hinged at `pins`, of the lengths given."""

    node: str
    pins: Pins
    links: tuple[str, str]
    lengths_m: tuple[FloatArray, FloatArray]
    side: int


@dataclass(frozen=True, slots=True)
class Slider:
    """Assur group RRP: `node` slides on a fixed guide, a rod of `length_m` joins it to `pin`."""

    node: str
    pin: str
    link: str
    length_m: FloatArray
    guide_m: ComplexArray
    guide_rad: FloatArray
    side: int


@dataclass(frozen=True, slots=True)
class Plate:
    """A third point of a link that already carries `base`, by its distances from both.

    Where the three points are in line, `line_ratio` says where (as in `PointOnLine`): then the
    perpendiculars through the images of the base coincide, and the image must come by similarity.
    """

    node: str
    base: Pins
    link: str
    lengths_m: tuple[FloatArray, FloatArray]
    side: int
    line_ratio: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class PointOnLine:
    """A point of a link on the line through `base`: node = base[0] + ratio (base[1] - base[0])."""

    node: str
    base: Pins
    link: str
    ratio: FloatArray


Group = Dyad | Slider | Plate | PointOnLine


@dataclass(frozen=True, slots=True)
class Mechanism:
    """Ground pivots (complex metres), the crank, and the groups in the order of assembly."""

    ground_m: Mapping[str, ComplexArray]
    crank: Crank
    groups: tuple[Group, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """All named points: ground pivots, the crank's pin, then each group's node."""
        return (*self.ground_m, self.crank.pin, *(group.node for group in self.groups))

    def is_ground(self, joint: str) -> bool:
        """Whether a joint does not move."""
        return joint in self.ground_m
