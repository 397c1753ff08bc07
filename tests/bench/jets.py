"""Numbers that carry their first two derivatives by time, in many digits.

An equation written once in jets gives its value and, by the product rule, both its derivatives:
no derivative of a closure equation is ever worked out by hand.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mpmath import mp, mpf

CONVERGED = mpf(10) ** -40
"""Newton's last step, relative to the mechanism's size."""
MAX_STEPS = 40
ZERO = mpf(0)

Pair = tuple[Any, Any]
"""x and y, many digits."""


@dataclass(frozen=True, slots=True)
class Jet:
    """A number and its first and second derivative by time."""

    value: Any
    rate: Any = ZERO
    second: Any = ZERO

    def __add__(self, other: "Jet") -> "Jet":
        return Jet(self.value + other.value, self.rate + other.rate, self.second + other.second)

    def __sub__(self, other: "Jet") -> "Jet":
        return Jet(self.value - other.value, self.rate - other.rate, self.second - other.second)

    def __mul__(self, other: "Jet") -> "Jet":
        return Jet(
            self.value * other.value,
            self.rate * other.value + self.value * other.rate,
            self.second * other.value + 2 * self.rate * other.rate + self.value * other.second,
        )


@dataclass(frozen=True, slots=True)
class Point:
    """A moving point or vector of the plane."""

    x: Jet
    y: Jet

    def __add__(self, other: "Point") -> "Point":
        return Point(self.x + other.x, self.y + other.y)

    def __sub__(self, other: "Point") -> "Point":
        return Point(self.x - other.x, self.y - other.y)

    def times(self, factor: Pair) -> "Point":
        """Turned and stretched by a constant complex number."""
        across, along = Jet(factor[1]), Jet(factor[0])
        return Point(along * self.x - across * self.y, along * self.y + across * self.x)

    @property
    def place(self) -> Pair:
        """Where it is now."""
        return self.x.value, self.y.value

    @property
    def velocity(self) -> Pair:
        """Its velocity."""
        return self.x.rate, self.y.rate

    @property
    def acceleration(self) -> Pair:
        """Its acceleration."""
        return self.x.second, self.y.second


def fixed(place: Pair) -> Point:
    """A point that does not move."""
    return moving(place, (mpf(0), mpf(0)), (mpf(0), mpf(0)))


def moving(place: Pair, velocity: Pair, acceleration: Pair) -> Point:
    """A point whose motion is known."""
    return Point(Jet(place[0], velocity[0], acceleration[0]), Jet(place[1], velocity[1], acceleration[1]))


def dot(u: Point, v: Point) -> Jet:
    """The scalar product."""
    return u.x * v.x + u.y * v.y


def cross(u: Point, v: Point) -> Jet:
    """The cross product, positive when v lies to the left of u."""
    return u.x * v.y - u.y * v.x


Equations = Callable[[Point], tuple[Jet, Jet]]
"""Two closure equations of an unknown point; both jets vanish on the motion sought."""


def follow(equations: Equations, start: Pair, size: Any) -> Point:
    """The moving point that keeps both equations, by Newton's method from a place near it.

    The equations differentiated once are linear in the velocity, differentiated twice in the
    acceleration, both with the matrix of Newton's last step. `size` is the mechanism's.

    Raises ArithmeticError where Newton's method does not converge.
    """
    zero = mpf(0), mpf(0)
    place = start
    for _ in range(MAX_STEPS):
        columns = _columns(equations, place)
        residual = equations(fixed(place))
        step = _solve(columns, (-residual[0].value, -residual[1].value))
        place = place[0] + step[0], place[1] + step[1]
        if mp.hypot(*step) <= CONVERGED * max(size, mp.hypot(*place)):
            break
    else:
        raise ArithmeticError("Newton's method does not converge")
    columns = _columns(equations, place)
    still = equations(fixed(place))
    velocity = _solve(columns, (-still[0].rate, -still[1].rate))
    coasting = equations(moving(place, velocity, zero))
    acceleration = _solve(columns, (-coasting[0].second, -coasting[1].second))
    return moving(place, velocity, acceleration)


def _columns(equations: Equations, place: Pair) -> tuple[Pair, Pair]:
    """The equations' derivatives by x and by y: their rates along each axis, less those at rest."""
    zero, one = mpf(0), mpf(1)
    rest = equations(fixed(place))
    told = []
    for axis in ((one, zero), (zero, one)):
        along = equations(moving(place, axis, (zero, zero)))
        told.append((along[0].rate - rest[0].rate, along[1].rate - rest[1].rate))
    return told[0], told[1]


def _solve(columns: tuple[Pair, Pair], right: Pair) -> Pair:
    (a, c), (b, d) = columns
    area = a * d - b * c
    return (right[0] * d - b * right[1]) / area, (a * right[1] - c * right[0]) / area
