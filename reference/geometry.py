"""Plane geometry on complex numbers: x + i y, y up. Everything works on arrays and broadcasts.

No inverse trigonometry, no absolute thresholds: each formula keeps its relative accuracy at any
scale, up to the conditioning of the figure itself.
"""

import math

import numpy as np
from numpy.typing import NDArray

from reference import numbers

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]


def cross(u: ComplexArray, v: ComplexArray) -> FloatArray:
    """The cross product of u and v, positive when v lies to the left of u."""
    return np.asarray(numbers.cross(u, v))


def dot(u: ComplexArray, v: ComplexArray) -> FloatArray:
    """The scalar product of u and v."""
    return np.asarray(numbers.dot(u, v))


def unit(u: ComplexArray) -> ComplexArray:
    """The unit vector along u; nan where u is zero (or too small to divide by), which has no direction."""
    with np.errstate(all="ignore"):
        return np.asarray(u / np.abs(u))


def direction(angle_rad: FloatArray) -> ComplexArray:
    """The unit vector at an angle counter-clockwise from +x."""
    return np.asarray(np.cos(angle_rad) + 1j * np.sin(angle_rad))


def degrees(angle_rad: float) -> float:
    """Return an angle in degrees from 0 up to, not including, 360; a little below 0 is 0."""
    return math.degrees(angle_rad) % 360.0 % 360.0


def meet(p: ComplexArray, u: ComplexArray, q: ComplexArray, v: ComplexArray) -> ComplexArray:
    """Intersection of the line through p along u with the line through q along v; nan if parallel."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(p + u * (cross(q - p, v) / cross(u, v)))


def two_arcs(
    p: ComplexArray, p_radius: FloatArray, q: ComplexArray, q_radius: FloatArray, side: int | FloatArray
) -> ComplexArray:
    """The third corner of a triangle on pq, given its other two sides; nan if the triangle does not close.

    Heron's formula in factors: 16 K^2 = (s - d)(s + d)(d - m)(d + m), s and m the sum and the
    difference of the radii, d = |pq|. Well conditioned up to the flat triangle itself.

    Arguments: `side` is +1 for the corner to the left of the directed line pq, -1 to the right.
    """
    base = q - p
    distance = np.abs(base)
    total, difference = p_radius + q_radius, p_radius - q_radius
    sixteen_area2 = (
        (total - distance) * (total + distance) * (distance - difference) * (distance + difference)
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        along = 0.5 + 0.5 * (difference / distance) * (total / distance)
        across = 0.5 * np.sqrt(sixteen_area2) / distance**2
    return np.asarray(p + base * (along + 1j * side * across))


def arc_and_line(
    p: ComplexArray, radius: FloatArray, q: ComplexArray, u: ComplexArray, side: int | FloatArray
) -> ComplexArray:
    """Intersection of the arc about p with the line through q along the unit vector u; nan if there is none.

    Arguments: `side` is +1 for the crossing ahead of p along u, -1 for the one behind.
    """
    height = cross(u, p - q)
    with np.errstate(invalid="ignore"):
        half_chord = np.sqrt((radius - height) * (radius + height))
    return np.asarray(p - 1j * u * height + u * (side * half_chord))


def similar(
    p: ComplexArray, q: ComplexArray, model_p: ComplexArray, model_q: ComplexArray, model_r: ComplexArray
) -> ComplexArray:
    """The point r such that triangle p q r is directly similar to the model (Mehmke's image)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(p + (q - p) * ((model_r - model_p) / (model_q - model_p)))
