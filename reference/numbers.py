"""Functions for three kinds of numbers: arrays, Python's own, and numbers of many digits (mpmath).

With them the closed forms of `reference.kinematics.assur` are written once. A root of a negative number
is nan: the figure does not close there.
"""

import math
from typing import Any

import numpy as np

Number = Any
"""float, mpf, or an array of shape (N,) of floats."""
Complex = Any
"""complex, mpc, or an array of shape (N,) of complex numbers."""


def root(x: Number) -> Number:
    """The square root; nan below zero."""
    if isinstance(x, float):
        return math.sqrt(x) if x >= 0.0 else math.nan
    if isinstance(x, np.ndarray):
        return np.sqrt(x)
    return x.sqrt() if x >= 0 else x * math.nan


def sine(x: Number) -> Number:
    """The sine."""
    return math.sin(x) if isinstance(x, float) else _library(x).sin(x)


def cosine(x: Number) -> Number:
    """The cosine."""
    return math.cos(x) if isinstance(x, float) else _library(x).cos(x)


def nearest(x: Number) -> Number:
    """The nearest whole number."""
    if isinstance(x, float):
        return float(round(x))
    return np.rint(x) if isinstance(x, np.ndarray) else _mp().nint(x)


def _library(x: Number) -> Any:  # noqa: ANN401 - a module, or mpmath's context, which has no types
    """Return the library for numbers of this kind (not for Python's own)."""
    return np if isinstance(x, np.ndarray) else _mp()


IN_QUARTERS = 0.6366197723675814
"""Quarter turns in a radian."""
QUARTER_1, QUARTER_2, QUARTER_3 = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
"""A quarter turn in three parts, the first two of 33 bits: the Cody-Waite reduction of an angle."""


def quarters(angle: Number) -> tuple[Number, Number]:
    """Split an angle into the nearest number of quarter turns and the rest, which keeps its own accuracy."""
    if not isinstance(angle, (float, np.ndarray)):  # a tuple: faster to ask than a union
        mp = _mp()
        turns = mp.nint(2 * angle / mp.pi)
        return turns, angle - turns * (mp.pi / 2)
    turns = nearest(angle * IN_QUARTERS)
    return turns, ((angle - turns * QUARTER_1) - turns * QUARTER_2) - turns * QUARTER_3


def larger(x: Number, y: Number) -> Number:
    """The larger of two numbers; nan if either is nan."""
    if isinstance(x, np.ndarray) or isinstance(y, np.ndarray):
        return np.maximum(x, y)
    return x if x > y or x != x else y  # noqa: PLR0124 - only nan differs from itself


def where(condition: Any, x: Number, y: Number) -> Number:  # noqa: ANN401 - one truth, or an array of them
    """Select x where a condition holds, y elsewhere."""
    if isinstance(condition, np.ndarray):
        return np.where(condition, x, y)
    return x if condition else y


def _mp() -> Any:  # noqa: ANN401 - mpmath has no types
    from mpmath import mp  # noqa: PLC0415 - only where many digits are needed

    return mp


def cross(u: Complex, v: Complex) -> Number:
    """The cross product, positive when v lies to the left of u."""
    return u.real * v.imag - u.imag * v.real


def dot(u: Complex, v: Complex) -> Number:
    """The scalar product."""
    return u.real * v.real + u.imag * v.imag
