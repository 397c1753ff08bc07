"""The Assur group of the third class with turning pairs alone: a ternary link D E F on legs A-D, B-E, C-F.

With u the unit vector from D to E the three loops are |z| = a, |z + P| = b, |z + Q| = c, where z = D - A,
P = A - B + l u, Q = A - C + w u. The last two less the first are linear in z; put into the first they give a
trigonometric polynomial of degree three in the direction of u: at most six assemblies, all found as
eigenvalues of its companion matrix and brought to full accuracy by Newton's method on the loops.
Source: the loop equations with one unknown eliminated; see docs/solver.md.
"""

from typing import Any

import numpy as np

from reference.geometry import ComplexArray, FloatArray
from reference.numbers import Complex, Number, cross, dot, larger

DEGREE, SAMPLES = 6, 8
"""Degree of the polynomial in u; points of the unit circle that give its seven coefficients."""
NEAR_CIRCLE = 1e-3
"""An eigenvalue this near to the unit circle is tried: rounding moves a double one by the root of EPSILON."""
CLOSED = 1e-14
"""Largest gap of a loop after Newton's method, relative to the longest length."""
LEAST_SINE = 1e-7
"""Least determinant; below it doubles do not tell the assembly from the one that it is about to meet."""
SAME = 1e-6
"""Assemblies nearer than this (rad) are one, unless their determinants differ in sign: two that meet."""
CLEAR_RAD, KNOWN_RAD = np.radians(20.0), 0.05
"""Farthest direction that still tells an assembly, the next one being at least twice as far; and the farthest
from directions that are followed."""
STEPS = 20
"""Steps of Newton's method: near a singular position a step halves the error, elsewhere it squares it."""
Loops = tuple[Any, ...]
"""A - B, A - C (m), the lengths of the legs a, b, c, and the sides l = |DE| and w = (F - D) / u."""


def parts(loops: Loops, z: Complex, u: Complex) -> tuple[Complex, Complex]:
    """Return E - B and F - C, m, for z = D - A and the direction u of D E."""
    p, q, _, _, _, side, shape = loops
    return z + p + side * u, z + q + shape * u


def coefficients(loops: Loops, z: Complex, u: Complex) -> tuple[Number, Number, Number, Number]:
    """Return by what a turn of leg A D and of the ternary link moves E along its leg and F along its own."""
    _, _, _, second, third, side, shape = loops
    e, f = parts(loops, z, u)
    e, f = e / second, f / third
    return dot(e, 1j * z), dot(e, 1j * side * u), dot(f, 1j * z), dot(f, 1j * shape * u)


def sine(loops: Loops, z: Complex, u: Complex) -> Number:
    """Return the group's determinant, signed: zero where the lines of the legs concur.

    It is 1 for an equilateral ternary link whose legs are across the lines from its centre.
    """
    g, h, m, n = coefficients(loops, z, u)
    side, shape = loops[5], loops[6]
    size = larger(larger(side, abs(shape)), abs(shape - side))
    return (g * n - h * m) / (loops[2] * (1.5 * size))


def turns(loops: Loops, z: Complex, u: Complex, along: tuple[Number, Number]) -> tuple[Number, Number]:
    """Return the turns of leg A D and of the ternary link that move E and F along their legs by so much."""
    g, h, m, n = coefficients(loops, z, u)
    first, second = along
    determinant = g * n - h * m
    return (first * n - h * second) / determinant, (g * second - first * m) / determinant


def polished(loops: Loops, z: Complex, u: Complex, steps: int = STEPS) -> tuple[Complex, Complex]:
    """Return z and u after some steps of Newton's method, in the numbers of `loops`."""
    for _ in range(steps):
        e, f = parts(loops, z, u)
        gaps = (loops[3] - abs(e)), (loops[4] - abs(f))
        first, second = turns(loops, z, u, gaps)
        z, u = z * (1.0 + 1j * first), u * (1.0 + 1j * second)
        z, u = z * (loops[2] / abs(z)), u / abs(u)
    return z, u


@np.errstate(all="ignore")
def assemblies(loops: Loops) -> tuple[ComplexArray, ComplexArray]:
    """Return z (m) and u of all assemblies, shape (N, 6), nan where there are fewer, of N loops."""
    wide = columns(loops)
    ring = np.exp(2j * np.pi * np.arange(SAMPLES) / SAMPLES)
    (numerator, denominator), scale = _linear(wide, ring), np.max(np.abs(wide), axis=0)
    values = (np.abs(numerator) ** 2 - (wide[2] * denominator) ** 2) / scale**6
    powers = np.arange(-3, 4)
    polynomial = values @ (ring[:, None] ** -powers) / SAMPLES
    leading = np.where(polynomial[:, -1:] == 0.0, np.finfo(float).tiny, polynomial[:, -1:])
    companion = np.zeros((len(values), DEGREE, DEGREE), np.complex128)
    companion[:, 1:, :-1] = np.eye(DEGREE - 1)
    companion[:, :, -1] = -polynomial[:, :-1] / leading
    known = np.isfinite(companion).all(axis=(1, 2))
    companion[~known] = 0.0
    roots = np.linalg.eigvals(companion)
    u = np.where(np.abs(np.log(np.abs(roots))) < NEAR_CIRCLE, roots / np.abs(roots), np.nan)
    z, u = polished(wide, _nearest_to_closing(wide, u), u)
    e, f = parts(wide, z, u)
    gap = np.maximum(np.abs(np.abs(e) - wide[3]), np.abs(np.abs(f) - wide[4]))
    determinant = sine(wide, z, u)
    known = (gap <= CLOSED * scale) & (np.abs(determinant) >= LEAST_SINE)
    z, u = (np.where(known, each, np.nan) for each in (z, u))
    apart = (np.abs(one[:, :, None] - one[:, None, :]) for one in (u, z / wide[2]))
    alike = np.sign(determinant[:, :, None]) == np.sign(determinant[:, None, :])
    twice = np.tril((sum(apart) < SAME) & alike, -1).any(axis=2)
    return np.where(twice, np.nan, z), np.where(twice, np.nan, u)


def _linear(loops: Loops, u: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Return z as numerator and denominator, from the two equations that are linear in it."""
    p, q, first, second, third, side, shape = loops
    p, q = p + side * u, q + shape * u
    to_e = 0.5 * (second**2 - first**2 - np.abs(p) ** 2)
    to_f = 0.5 * (third**2 - first**2 - np.abs(q) ** 2)
    return 1j * (to_f * p - to_e * q), cross(p, q)


def _nearest_to_closing(loops: Loops, u: ComplexArray) -> ComplexArray:
    """Return z for each direction: from the linear equations or, where these are dependent, from two arcs."""
    p, _, first, second, third, side, _ = loops
    numerator, denominator = _linear(loops, u)
    base = p + side * u
    distance = np.abs(base)
    along = (second**2 - first**2 - distance**2) / (2.0 * distance)
    across = np.sqrt(np.maximum(first**2 - along**2, 0.0))
    unit = base / distance
    choices = np.stack([numerator / denominator, unit * (along + 1j * across), unit * (along - 1j * across)])
    choices *= first / np.abs(choices)
    e, f = parts(loops, choices, u)
    gaps = np.nan_to_num(np.abs(np.abs(e) - second) + np.abs(np.abs(f) - third), nan=np.inf)
    best = np.argmin(gaps, axis=0)[None]
    return np.asarray(np.take_along_axis(choices, best, axis=0)[0])


@np.errstate(all="ignore")
def chosen(
    loops: Loops, direction: FloatArray, leg: FloatArray | None, sign: int
) -> tuple[ComplexArray, ComplexArray]:
    """Return z and u of one assembly, shape (N,); nan where none is near the directions told.

    Arguments: the `direction` of D E and, where it is followed, that of the `leg` A D, rad, and the `sign` of
    the determinant, else None and 0. Without a leg the assembly must be the nearest one clearly.
    """
    z, u = assemblies(loops)
    off = _angle_to(u, direction) + (0.0 if leg is None else _angle_to(z, leg))
    off[~np.isfinite(off) | (sign * sine(columns(loops), z, u) < 0.0)] = np.inf
    order = np.argsort(off, axis=1)
    near, after = (np.take_along_axis(off, order[:, k : k + 1], axis=1) for k in (0, 1))
    told = near <= (KNOWN_RAD if leg is not None else np.minimum(CLEAR_RAD, 0.5 * after))
    z, u = (np.where(told, np.take_along_axis(each, order[:, :1], axis=1), np.nan)[:, 0] for each in (z, u))
    return z, u


def _angle_to(vectors: ComplexArray, direction: FloatArray) -> FloatArray:
    """Return the angles between vectors, shape (N, 6), and a direction (N,) or (1,), rad."""
    return np.asarray(np.abs(np.angle(vectors * np.exp(-1j * np.atleast_1d(direction))[:, None])))


def columns(loops: Loops) -> Loops:
    """Return the loops in columns, shape (N, 1), to go with all assemblies."""
    return tuple(part[:, None] for part in np.broadcast_arrays(*loops))
