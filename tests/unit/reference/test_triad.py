"""Triads: all assemblies against a dense search, rates against differences in many digits, the cycle."""

from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp

from reference.errors import MechanismError
from reference.geometry import two_arcs
from reference.kinematics import triad
from reference.kinematics.cycle import cycle
from reference.kinematics.motion import move
from reference.kinematics.solving import one_variant, solve
from reference.mechanism import Crank, Mechanism, Triad

CLOSED = 1e-12
"""Gap of a loop relative to the links."""
TURN = 2.0 * np.pi
DENSE = 40_001
DIGITS, STEP = 60, "1e-20"
"""A central difference is then right to forty digits."""


def array(value):
    return np.array([value])


def linkage(crank_m: float = 0.025, direction_deg: float = -110.0, angle_deg: float = 50.0) -> Mechanism:
    """A six-bar whose crank of 25 mm turns fully."""
    (first, second, third), (near, across, far) = (0.094, 0.087, 0.087), (0.054, 0.069, 0.065)
    along = (near**2 + far**2 - across**2) / (2 * near**2)
    shape = complex(along, np.sqrt((far / near) ** 2 - along**2))
    driver = Crank(
        "1",
        "O",
        "A",
        array(crank_m),
        array(np.radians(angle_deg)),
        array(10.0),
        array(-7.0),
        accelerated=True,
    )
    group = Triad(
        ("D", "E", "F"), ("A", "B", "C"), "S", ("2", "3", "4", "5"),
        (array(first), array(second), array(third)), (array(near), array(across), array(far)), 1,
        array(shape), array(np.radians(direction_deg)),
    )  # fmt: skip
    ground = {"O": array(0j), "B": array(0.143 - 0.054j), "C": array(0.146 + 0.082j)}
    return Mechanism(ground, driver, (group,))


def random_loops(seed: int, count: int):
    """Loops of triads whose joints lie anywhere, with the assembly that they were made from."""
    lot = np.random.default_rng(seed)
    a, b, c, d, e, f = lot.normal(size=(6, count)) + 1j * lot.normal(size=(6, count))
    u = (e - d) / np.abs(e - d)
    return (a - b, a - c, np.abs(d - a), np.abs(e - b), np.abs(f - c), np.abs(e - d), (f - d) / u), d - a, u


def found_densely(loops) -> int:
    """Count assemblies: directions of leg A D, with E on either side, at which the third loop closes."""
    p, q, first, second, third, side, shape = loops
    z = first * np.exp(1j * np.linspace(0.0, TURN, DENSE))
    count = 0
    for hand in (1, -1):
        # With A as the origin, B is at -p.
        e = two_arcs(z, side, np.asarray(-p), second, hand)
        gap = np.abs(z + shape * (e - z) / side + q) - third
        turned = np.sign(gap[1:]) * np.sign(gap[:-1]) < 0
        count += int(np.count_nonzero(turned))
    return count


@pytest.mark.parametrize("seed", [183101, 183102, 183103])
def test_every_assembly_that_a_dense_search_finds_is_found_and_no_other(seed):
    loops, _, _ = random_loops(seed, 30)
    _, u = triad.assemblies(loops)
    counts = np.isfinite(u).sum(axis=1)
    assert set(counts) <= {2, 4, 6}
    agree = [found_densely([part[row] for part in loops]) == counts[row] for row in range(counts.size)]
    # Two assemblies about to meet lie between two samples of the search, or at the end of an arc's range.
    assert np.mean(agree) > 0.9


def test_of_many_triads_the_assembly_that_they_were_made_from_is_among_those_found_and_all_close():
    loops, z, u = random_loops(183104, 20_000)
    many, directions = triad.assemblies(loops)
    nearest = np.nanmin(np.abs(directions - u[:, None]) + np.abs(many - z[:, None]), axis=1)
    assert nearest.max() < 1e-8
    assert set(np.isfinite(directions).sum(axis=1)) == {2, 4, 6}
    wide = triad.columns(loops)
    for arm, length in zip(triad.parts(wide, many, directions), wide[3:5], strict=True):
        assert np.nanmax(np.abs(np.abs(arm) - length)) < 1e-10


@pytest.mark.parametrize("angle_deg", [0.0, 50.0, 201.0])
def test_velocities_and_accelerations_are_differences_of_positions_in_sixty_digits(angle_deg):
    mechanism = linkage(angle_deg=angle_deg)
    motion, driver = move(mechanism), mechanism.driver
    with mp.workdps(DIGITS):
        step = mp.mpf(STEP)

        def at(time):
            angle = mp.mpf(driver.angle_rad[0]) + 10 * time - mp.mpf(7) / 2 * time**2
            later = replace(driver, angle_rad=np.array([angle], dtype=object))
            joints = solve(replace(mechanism, driver=later), one_variant(0, mp.mpmathify), anew=True).joints
            return {name: joints[name].position for name in "DEF"}

        before, now, after = at(-step), at(mp.mpf(0)), at(step)
        for name in "DEF":
            speed = (after[name] - before[name]) / (2 * step)
            growth = (after[name] - 2 * now[name] + before[name]) / step**2
            assert abs(speed - complex(motion.velocity[name][0])) < CLOSED
            assert abs(growth - complex(motion.acceleration[name][0])) < 100 * CLOSED


def gaps(mechanism: Mechanism, at) -> float:
    (group,) = mechanism.groups
    d, e, f = group.corners
    ends = (*zip(group.pins, group.corners, strict=True), (d, e), (e, f), (f, d))
    lengths = (*group.legs_m, *group.sides_m)
    return max(
        np.max(np.abs(np.abs(at[q] - at[p]) - length)) for (p, q), length in zip(ends, lengths, strict=True)
    )


def test_the_assembly_is_kept_over_a_full_turn():
    found = cycle(linkage(), 361)
    at = found.motion.position
    assert (found.turns, found.undetermined) == (1, {})
    assert gaps(found.mechanism, at) < CLOSED
    for name in "DEF":
        mean = 0.5 * (found.motion.velocity[name][1:] + found.motion.velocity[name][:-1]) / 10.0
        assert np.max(np.abs(np.diff(at[name]) - mean * np.diff(found.driving))) < 1e-6
        assert abs(at[name][-1] - at[name][0]) < CLOSED


def test_a_range_ends_where_the_lines_of_the_legs_meet_in_one_point():
    found = cycle(linkage(crank_m=0.08, direction_deg=-125.0, angle_deg=90.0), 361)
    assert found.turns == 0
    assert [stop.node for stop in found.following.stops] == ["F", "F"]
    assert found.motion.transmission["F"][1] > 1e-3
    near = found.following.at(np.array([found.following.low + 1e-12, found.following.high - 1e-12]))
    assert np.max(move(near).transmission["F"]) < 1e-4


def test_a_direction_that_tells_no_assembly_clearly_is_refused_with_those_that_there_are():
    with pytest.raises(MechanismError, match=r"clearly; there are -?\d+\.\d°, ") as told:
        move(linkage(direction_deg=-30.0))
    assert told.value.code == "assembly_unclear"


def test_a_triad_that_does_not_assemble_is_refused_by_its_joint():
    with pytest.raises(MechanismError, match="the triad of F does not assemble") as told:
        move(linkage(crank_m=2.0))
    assert (told.value.code, told.value.group) == ("does_not_assemble", "F")


def parallel(reach: complex) -> Mechanism:
    """A triad whose first two legs are parallel; the line of the third one, of this direction, is not."""
    driver = Crank("1", "O", "A", array(1.0), array(0.0), array(1.0), array(0.0), accelerated=False)
    shape, c = complex(0.5, 0.5), complex(0.5, 1.5) + reach
    sides = (array(1.0), array(abs(1 - shape)), array(abs(shape)))
    group = Triad(
        ("D", "E", "F"), ("A", "B", "C"), "S", ("2", "3", "4", "5"),
        (array(1.0), array(2.0), array(abs(reach))), sides, 1, array(shape), array(0.0),
    )  # fmt: skip
    return Mechanism({"O": array(-1 + 0j), "B": array(1 - 1j), "C": array(c)}, driver, (group,))


def test_parallel_first_legs_have_no_assur_point_and_are_refused():
    with pytest.raises(MechanismError, match="those of the first two are parallel"):
        move(parallel(1 + 0.1j))


def test_three_parallel_legs_are_refused():
    with pytest.raises(MechanismError, match=r"its legs' lines meet in one point|tells none"):
        move(parallel(1j))
