"""The closed forms of the driving links and of the Assur groups: positions, velocities, accelerations.

Written once, on numbers of any kind (`reference.numbers`): arrays over variants, Python's own for a
single variant, or many digits near a singularity. No inverse trigonometry, no absolute
thresholds; every formula keeps its relative accuracy up to the conditioning of the figure itself.

Complex numbers are vectors, x + i y in metres; a body turns by v_B = v_A + i omega (B - A) and
a_B = a_A + (i epsilon - omega^2)(B - A). `d` is the vector between a group's outer joints; the RRR
group is solved in the frame of `d`, where a kite's flat position (d -> 0) is as smooth as its motion.
Derivations: the rigid-body equations of each group with one unknown eliminated, see docs/solver.md.
"""

import math

from reference.numbers import (
    Complex,
    Number,
    cosine,
    cross,
    dot,
    larger,
    nearest,
    quarters,
    root,
    sine,
    where,
)


def arm(length: Number, angle: Number) -> tuple[Complex, Complex]:
    """Length e^(i angle) as the arm along the nearest axis and the small rest, each accurate by itself.

    The rest of a turn by psi from the axis is length (-2 sin^2(psi/2) + i sin psi): without the
    cancellation of cos psi - 1.
    """
    turns, rest = quarters(angle)
    half_sine, half_cosine = sine(0.5 * rest), cosine(0.5 * rest)
    quarter = turns - 4.0 * nearest(0.25 * turns)
    axis = (1.0 - abs(quarter)) + 1j * (quarter * (2.0 - abs(quarter)))
    doubled = 2.0 * length * half_sine
    return length * axis, axis * (1j * (doubled * half_cosine) - doubled * half_sine)


def heading(angle: Number) -> Complex:
    """The unit vector at an angle."""
    axis, rest = arm(1.0, angle)
    return axis + rest


def exact_sum(a: Complex, b: Complex) -> tuple[Complex, Complex]:
    """A sum and what rounding took from it (Knuth's two-sum, on both parts)."""
    total = a + b
    second = total - a
    return total, (a - (total - second)) + (b - second)


def turned(arm_: Complex, omega: Number, epsilon: Number) -> Complex:
    """The acceleration of an arm's end about its start."""
    return (1j * epsilon - omega * omega) * arm_


# RRR ----------------------------------------------------------------------------------------------


def rrr_place(d: Complex, first: Number, second: Number, side: Number) -> tuple[Number, Number, Number]:
    """The node as P + d (along + i across), and the sine of the transmission angle between the links.

    Heron's formula in factors: 16 K^2 = (s - |d|)(s + |d|)(|d| - m)(|d| + m), s and m the sum and
    the difference of the links' lengths; nan where the triangle does not close.
    """
    square = dot(d, d)
    distance = root(square)
    total, difference = first + second, first - second
    area = 0.5 * root(
        ((total - distance) * (total + distance)) * ((distance - difference) * (distance + difference))
    )
    return 0.5 + 0.5 * (difference * total) / square, side * area / square, area / (first * second)


def rrr_turns(along: Number, across: Number, stretch: Complex) -> tuple[Number, Number]:
    """Angular velocities of both links from `stretch` = (v_Q - v_P) / d.

    The base's turn Im(stretch) and what its growth Re(stretch) bends the triangle by.
    """
    bend = stretch.real / across
    return stretch.imag + bend * (along - 1.0), stretch.imag + bend * along


def rrr_accelerations(
    along: Number, across: Number, stretch: Complex, growth: Complex, omega: tuple[Number, Number]
) -> tuple[Number, Number]:
    """Angular accelerations of both links from `growth` = (a_Q - a_P) / d; no difference of squares."""
    first, second = omega
    bend = (growth.real + first * first * along + second * second * (1.0 - along)) / across
    turn = growth.imag - stretch.real * (first + second)
    return turn + bend * (along - 1.0), turn + bend * along


def plate_growth(shape: Complex) -> Number:
    """By how much rounding of a triangle's sides grows in its shape: 1 / sine of the angle at its node.

    1 where the three points are in line: there the shape is a ratio of two lengths.
    """
    height = abs(shape.imag)
    flat = height == 0.0
    return larger(1.0, abs(shape) * abs(1.0 - shape) / where(flat, math.inf, height))


# RRP ----------------------------------------------------------------------------------------------


def rrp_place(
    height: Number, height_rest: Number, length: Number, side: Number
) -> tuple[Number, Number, Number]:
    """Return the slider's distance along the guide from the pin's foot; the pin's height; the sine.

    Arguments: the pin's height over the guide (to its left) and what rounding took from it. The
    half chord is sqrt((l - h)(l + h)); nan where the rod does not reach the guide.
    """
    half = root(((length - height) - height_rest) * ((length + height) + height_rest))
    return side * half, height + height_rest, half / length


def rrp_velocity(reach: Number, height: Number, along: Complex, relative: Complex) -> tuple[Number, Number]:
    """The rod's angular velocity, and the speed along the guide.

    Arguments: `relative` is the pin's velocity about the guide's point under the slider.
    """
    omega = -cross(along, relative) / reach
    return omega, dot(along, relative) + omega * height


def rrp_acceleration(
    reach: Number, height: Number, along: Complex, relative: Complex, omega: Number, coriolis: Number
) -> tuple[Number, Number]:
    """The rod's angular acceleration, and the sliding acceleration.

    Arguments: `coriolis` = 2 omega_guide speed, to the guide's left.
    """
    epsilon = -(cross(along, relative) + omega * omega * height - coriolis) / reach
    return epsilon, dot(along, relative) + epsilon * height - omega * omega * reach


# RPR ----------------------------------------------------------------------------------------------


def rpr_place(d: Complex, offset: Number, side: Number) -> tuple[Number, Complex, Number]:
    """Return the pin's distance from the pivot along the guide, the guide's direction, and the sine.

    Arguments: `d` from the pivot to the pin. d = u (s + i offset), nan where |d| < |offset|.
    """
    square = dot(d, d)
    distance = root(square)
    reach = side * root((distance - offset) * (distance + offset))
    return reach, d * (reach - 1j * offset) / square, abs(reach) / distance


def rpr_velocity(reach: Number, offset: Number, along: Complex, relative: Complex) -> tuple[Number, Number]:
    """The slotted link's angular velocity, and the pin's sliding speed; `relative` = v_pin - v_pivot."""
    omega = cross(along, relative) / reach
    return omega, dot(along, relative) + omega * offset


def rpr_acceleration(
    reach: Number, offset: Number, along: Complex, relative: Complex, rates: tuple[Number, Number]
) -> Number:
    """The slotted link's angular acceleration; `rates` are its angular velocity and the sliding speed."""
    omega, speed = rates
    return (cross(along, relative) - 2.0 * omega * speed + omega * omega * offset) / reach


# PRP and RPP --------------------------------------------------------------------------------------


def cross_place(between: Complex, first: Complex, second: Complex) -> tuple[Number, Number]:
    """Return the distance along the first line to the second, and the sine of their angle (signed).

    Arguments: from the first line's point to the second's; the lines' unit vectors.
    """
    crossing = cross(first, second)
    return cross(between, second) / crossing, crossing


def cross_slides(
    between: Complex, first: Complex, second: Complex, crossing: Number
) -> tuple[Number, Number]:
    """Both sliding speeds (or accelerations) from the difference of the lines' own at the crossing."""
    return cross(between, second) / crossing, cross(between, first) / crossing
