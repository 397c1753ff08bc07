"""The same motion by other methods: loops closed by Newton's method in many digits, textbook formulas."""

import math

import numpy as np
import pytest
from mpmath import mp, mpc

from reference.kinematics.motion import move
from reference.mechanism import Yoke
from tests.authorities.test_published_results import solved
from tests.bench.oracle import ExactMotion
from tests.laws.mechanisms import random_mechanism

DIGITS = 40
NEWTON_STEPS = 10
DOUBLE_PRECISION = 1e-12
"""Share of the largest velocity or acceleration; the mechanisms here are well conditioned."""
OMEGA, EPSILON = 3.0, -7.0
CRANK = {"pivot": "A", "pin": "B", "length": 0.15, "angle_deg": 70, "omega": OMEGA, "epsilon": EPSILON}
B3 = {"type": "RPR", "node": "B3", "pin": "B", "pivot": "C", "link": "3"}


def turn(angle):
    return mp.expj(angle)


def crank_pin(time):
    """The crank's end at a time, in many digits."""
    angle = mp.mpf(math.radians(70)) + OMEGA * time + mp.mpf(EPSILON) * time**2 / 2
    return mp.mpf(0.15) * turn(angle)


# Each case: the mechanism; its unknowns at the start, near enough; the loops, as complex equations
# that vanish; and the joint's place from them.

SLOTTED = {"ground": {"A": [0, 0], "C": [-0.3, 0.05]}, "crank": CRANK}


def six_bar_of_two_slotted_links():
    """R-RTR-RTR: a second block on the crank's shaft line slides on the first slotted link's end."""
    groups = [
        B3,
        {"type": "point", "node": "D", "base": ["C", "B3"], "link": "3", "at": [0.2, 0]},
        {"type": "RPR", "node": "D5", "pin": "D", "pivot": "E", "link": "5", "side": "ahead"},
        {"type": "point", "node": "F", "base": ["E", "D5"], "link": "5", "at": [0.4, 0.03]},
    ]
    mechanism = {**SLOTTED, "ground": {**SLOTTED["ground"], "E": [0.1, -0.3]}, "group": groups}

    def loops(time, first, reach, second, other):
        c, e = mpc(-0.3, 0.05), mpc(0.1, -0.3)
        pin = c + mp.mpf(0.2) * turn(first)
        return (c + reach * turn(first) - crank_pin(time), e + other * turn(second) - pin)

    def place(unknowns):
        return mpc(0.1, -0.3) + mpc(0.4, 0.03) * turn(unknowns[2])

    return mechanism, (0.3, 0.4, 2.0, 0.4), loops, "F", place


def shaper_with_an_offset_slot():
    groups = [
        {**B3, "offset": 0.04, "foot": "P"},
        {"type": "point", "node": "D", "base": ["C", "B3"], "link": "3", "at": [0.5, 0.02]},
        {
            "type": "RRP", "node": "G", "pin": "D", "length": 0.3, "link": "4", "side": "behind",
            "guide": {"through": [0, 0.4], "angle_deg": 12},
        },
    ]  # fmt: skip

    def loops(time, angle, reach, rod, slide):
        c = mpc(-0.3, 0.05)
        guide = turn(mp.mpf(math.radians(12)))
        return (
            c + mpc(reach, 0.04) * turn(angle) - crank_pin(time),
            c + mpc(0.5, 0.02) * turn(angle) + mp.mpf(0.3) * turn(rod) - mpc(0, 0.4) - slide * guide,
        )

    def place(unknowns):
        return mpc(0, 0.4) + unknowns[3] * turn(mp.mpf(math.radians(12)))

    return {**SLOTTED, "group": groups}, (0.1, 0.36, 2.0, -0.1), loops, "G", place


def rod_on_a_coupler_and_blocks_between():
    """RRR, then RRP on its coupler, then PRP between that rod and the rocker."""
    groups = [
        {
            "type": "RRR", "node": "D", "pins": ["B", "C"], "links": ["2", "3"], "lengths": [0.4, 0.3],
            "side": "right",
        },
        {
            "type": "RRP", "node": "G", "pin": "E", "length": 0.35, "link": "4", "side": "ahead",
            "guide": {"joints": ["B", "D"], "coincident": "G2"},
        },
        {
            "type": "PRP", "node": "H",
            "guides": [
                {"joints": ["E", "G"], "coincident": "H4"}, {"joints": ["C", "D"], "coincident": "H3"}
            ],
        },
    ]  # fmt: skip
    ground = {"A": [0, 0], "C": [0.45, 0.05], "E": [0.1, -0.2]}

    def loops(time, coupler, rocker, rod, *along_links):
        along, first, second = along_links
        b, c, e = crank_pin(time), mpc(0.45, 0.05), mpc(0.1, -0.2)
        return (
            b + mp.mpf(0.4) * turn(coupler) - c - mp.mpf(0.3) * turn(rocker),
            e + mp.mpf(0.35) * turn(rod) - b - along * turn(coupler),
            e + first * turn(rod) - c - second * turn(rocker),
        )

    def place(unknowns):
        return mpc(0.1, -0.2) + unknowns[4] * turn(unknowns[2])

    return {"ground": ground, "crank": CRANK, "group": groups}, None, loops, "H", place


def start_of_the_third(motion):
    at = {name: complex(z[0]) for name, z in motion.position.items()}
    coupler, rocker, rod = at["D"] - at["B"], at["D"] - at["C"], at["G"] - at["E"]
    angles = [math.atan2(z.imag, z.real) for z in (coupler, rocker, rod)]
    return (
        *angles,
        ((at["G"] - at["B"]) / coupler * abs(coupler)).real,
        ((at["H"] - at["E"]) / rod * abs(rod)).real,
        ((at["H"] - at["C"]) / rocker * abs(rocker)).real,
    )


def closed(loops, start):
    """Solve loops by Newton's method with derivatives from differences: real unknowns, complex loops."""

    def parts(unknowns):
        return mp.matrix([part for loop in loops(unknowns) for part in (loop.real, loop.imag)])

    unknowns, step = [mp.mpf(one) for one in start], mp.mpf(10) ** (-DIGITS // 2)
    for _ in range(NEWTON_STEPS):
        here = parts(unknowns)
        slopes = mp.matrix(len(unknowns))
        for column in range(len(unknowns)):
            moved = [one + step * (index == column) for index, one in enumerate(unknowns)]
            slopes[:, column] = (parts(moved) - here) / step
        change = mp.lu_solve(slopes, here)
        unknowns = [one - by for one, by in zip(unknowns, change, strict=True)]
    assert mp.norm(parts(unknowns)) < mp.mpf(10) ** (-DIGITS + 5)
    return unknowns


@pytest.mark.parametrize(
    "case",
    [six_bar_of_two_slotted_links, shaper_with_an_offset_slot, rod_on_a_coupler_and_blocks_between],
)
def test_loops_closed_by_newtons_method_and_differentiated_give_the_same_motion(case):
    mechanism, start, loops, joint, place = case()
    motion = solved(mechanism)
    start = start or start_of_the_third(motion)
    with mp.workdps(DIGITS):

        def at(time):
            return place(closed(lambda unknowns: loops(time, *unknowns), start))

        exact = [at(mp.mpf(0)), mp.diff(at, 0), mp.diff(at, 0, 2)]
    rates = (motion.position, motion.velocity, motion.acceleration)
    for rate, true in zip(rates, exact, strict=True):
        size = max(float(np.abs(z)[0]) for z in rate.values())
        assert abs(complex(rate[joint][0]) - complex(true)) <= DOUBLE_PRECISION * size


def test_a_scotch_yoke_moves_harmonically():
    """x = r cos phi, x' = -r omega sin phi, x'' = -r omega^2 cos phi - r epsilon sin phi."""
    yoke = {"type": "RPP", "node": "D", "pin": "B", "slot_deg": 90}
    yoke |= {"guide": {"through": [0, 0], "angle_deg": 0}}
    motion = solved({"ground": {"A": [0, 0]}, "crank": CRANK, "group": [yoke]})
    x, y = 0.15 * math.cos(math.radians(70)), 0.15 * math.sin(math.radians(70))
    for rate, true in (
        (motion.position, x),
        (motion.velocity, -OMEGA * y),
        (motion.acceleration, -(OMEGA**2) * x - EPSILON * y),
    ):
        assert rate["D"][0] == pytest.approx(true, rel=DOUBLE_PRECISION, abs=DOUBLE_PRECISION)


def test_an_oscillating_cylinder_has_the_rates_of_its_triangle():
    """s^2 = r^2 + d^2 + 2 r d sin phi for a pivot d below the crank's; s' and theta' from derivatives."""
    r, d, phi = 0.15, 0.4, math.radians(70)
    mechanism = {"ground": {"A": [0, 0], "C": [0, -d]}, "crank": CRANK, "group": [B3]}
    motion = solved(mechanism)
    s = math.sqrt(r * r + d * d + 2 * r * d * math.sin(phi))
    slide = r * d * math.cos(phi) * OMEGA / s
    swing = OMEGA * r * (r + d * math.sin(phi)) / s**2
    relative = motion.velocity["B"][0] - motion.velocity["B3"][0]
    assert abs(relative) == pytest.approx(abs(slide), rel=DOUBLE_PRECISION)
    assert motion.omega["3"][0] == pytest.approx(swing, rel=DOUBLE_PRECISION)
    # (s^2 theta')' = r (r + d sin phi) epsilon + r d cos phi omega^2
    growth = r * (r + d * math.sin(phi)) * EPSILON + r * d * math.cos(phi) * OMEGA**2
    assert motion.epsilon["3"][0] == pytest.approx(
        (growth - 2 * s * slide * swing) / s**2, rel=DOUBLE_PRECISION
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_yoke_on_a_moving_guide_moves_as_loops_solved_in_many_digits(seed):
    mechanism = random_mechanism(seed, ["RRR", "RPP on a link", "plate", "RPP on a link"])
    motion, exact = move(mechanism), ExactMotion(mechanism)
    yokes = [group for group in mechanism.groups if isinstance(group, Yoke)]
    assert yokes
    for joint in [joint for yoke in yokes for joint in (yoke.node, yoke.guide.coincident)]:
        for what in ("velocity", "acceleration"):
            rates, true = getattr(motion, what), getattr(exact, what)
            size = max(float(np.abs(z)[0]) for z in rates.values())
            assert abs(rates[joint][0] - complex(true[joint])) <= DOUBLE_PRECISION * size


def test_the_cross_of_an_oldham_coupling_slides_harmonically_in_both_discs():
    """Shafts d apart: along the slots the cross's centre is d cos phi from one, d sin phi from the other."""
    d, phi = 0.06, math.radians(70)
    cross = {"type": "RPP", "node": "C3", "pin": "C", "link": "3"}
    cross |= {"guide": {"joints": ["A", "B"], "coincident": "C1"}}
    motion = solved({"ground": {"A": [0, 0], "C": [d, 0]}, "crank": CRANK, "group": [cross]})
    along = complex(math.cos(phi), math.sin(phi))
    for rate, first, second, coriolis in (
        (motion.velocity, -OMEGA * math.sin(phi), OMEGA * math.cos(phi), 0),
        (
            motion.acceleration,
            -EPSILON * math.sin(phi) - OMEGA**2 * math.cos(phi),
            EPSILON * math.cos(phi) - OMEGA**2 * math.sin(phi),
            2j * OMEGA,
        ),
    ):
        slip = motion.velocity["C3"][0] - motion.velocity["C1"][0]
        in_first = d * first * along + coriolis * slip
        assert rate["C3"][0] - rate["C1"][0] == pytest.approx(in_first, rel=DOUBLE_PRECISION)
        in_second = d * second * 1j * along + coriolis * motion.velocity["C3"][0]
        assert rate["C3"][0] == pytest.approx(in_second, rel=DOUBLE_PRECISION)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_cylinder_of_driven_length_turns_its_crank(side):
    length, speed, growth, arm = 0.35, 0.2, -0.3, 0.25
    cylinder = {"pivot": "C", "length": length, "speed": speed, "acceleration": growth, "side": side}
    crank = {"pivot": "A", "pin": "B", "link": "2", "length": arm, "cylinder": cylinder}
    mechanism = {"ground": {"A": [0.3, 0.2], "C": [0, 0]}, "crank": crank, "group": [B3]}
    motion = solved(mechanism)
    sign = 1 if side == "left" else -1

    def pin(time):
        s, r, base = length + speed * time + growth * time**2 / 2, mp.mpf(arm), mpc(0.3, 0.2)
        d = abs(base)
        return base / d * s * mp.expj(sign * mp.acos((s * s + d * d - r * r) / (2 * s * d)))

    for order, rate in enumerate((motion.position, motion.velocity, motion.acceleration)):
        with mp.workdps(DIGITS):
            true = complex(mp.diff(pin, 0, order))
        assert rate["B"][0] == pytest.approx(true, rel=DOUBLE_PRECISION)
    assert abs(motion.velocity["B"][0] - motion.velocity["B3"][0]) == pytest.approx(speed)


def test_the_equivalent_linkage_of_a_gear_pair_has_the_gears_ratio():
    """The line of action between the base circles, at a pressure angle of 20 degrees."""
    first, second, alpha = 0.05, 0.12, math.radians(20)
    gear = {"type": "RRR", "node": "D", "pins": ["B", "C"], "links": ["2", "3"], "side": "right"}
    gear["lengths"] = [(first + second) * math.sin(alpha), second * math.cos(alpha)]
    crank = CRANK | {"length": first * math.cos(alpha), "angle_deg": 20}
    motion = solved({"ground": {"A": [0, 0], "C": [first + second, 0]}, "crank": crank, "group": [gear]})
    assert motion.omega["3"][0] == pytest.approx(-OMEGA * first / second, rel=DOUBLE_PRECISION)
    assert motion.epsilon["3"][0] == pytest.approx(-EPSILON * first / second, rel=DOUBLE_PRECISION)


def test_an_elliptic_trammels_rod_turns_as_its_ends_slide_on_crossed_guides():
    """A rod of length l between two guides at right angles: its point at l/2 runs on a circle."""
    length, place, speed, growth = 0.5, 0.3, 0.7, -1.1
    driving = {"pin": "B", "guide": {"through": [0, 0], "angle_deg": 0}}
    driving |= {"displacement": place, "speed": speed, "acceleration": growth}
    rod = {"type": "RRP", "node": "D", "pin": "B", "length": length, "link": "2", "side": "ahead"}
    rod |= {"guide": {"through": [0, 0], "angle_deg": 90}}
    middle = {"type": "point_on_line", "node": "E", "base": ["B", "D"], "link": "2", "ratio": 0.5}
    motion = solved({"ground": {"A": [0, 0]}, "driving_slider": driving, "group": [rod, middle]})
    y = math.sqrt(length**2 - place**2)
    y_speed = -place * speed / y
    y_growth = -(speed**2 + place * growth + y_speed**2) / y
    assert motion.velocity["D"][0] == pytest.approx(1j * y_speed, rel=DOUBLE_PRECISION)
    assert motion.acceleration["D"][0] == pytest.approx(1j * y_growth, rel=DOUBLE_PRECISION)
    assert motion.omega["2"][0] == pytest.approx(speed / y, rel=DOUBLE_PRECISION)
    centre = motion.position["E"][0]
    assert abs(centre) == pytest.approx(length / 2, rel=DOUBLE_PRECISION)
    assert abs((centre.conjugate() * motion.velocity["E"][0]).real) <= DOUBLE_PRECISION
