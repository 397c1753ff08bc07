"""However a variant is solved, it is the same motion; its predicted error is kept; no branch is missed."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from reference.kinematics.motion import _on_arrays, move, move_where_possible
from reference.kinematics.solving import one_variant, solve
from reference.mechanism import Crank, Dyad, FixedGuide, Mechanism, Slider, SlottedLink
from tests.laws.mechanisms import KINDS, after, array, random_mechanism

TRUE_DIGITS = 60
MANY = 100_000
CLOSED = 1e-12
"""Relative to the links: how exactly their ends meet."""
BARELY = 1e-9
"""Nearer than this to not closing at all, either answer is right."""
a_mechanism = st.from_type(Mechanism)


def true_rates(mechanism, *, anew=True):
    """Velocities and accelerations in many digits; None where there is no motion.

    Shapes of links come from their lengths, or, not `anew`, as the mechanism holds them.
    """
    with mp.workdps(TRUE_DIGITS):
        try:
            joints = solve(mechanism, one_variant(0, mp.mpmathify), anew=anew).joints
        except ZeroDivisionError:
            return None
        rates = [{name: getattr(joint, what) for name, joint in joints.items()} for what in ORDERS]
        return rates if all(mp.isfinite(z) for rate in rates for z in rate.values()) else None


ORDERS = ("velocity", "acceleration")


def error_of(motion, truth) -> float:
    """Relative to the largest velocity or acceleration, as the predicted error is."""
    errors = []
    for what, exact in zip(ORDERS, truth, strict=True):
        found = getattr(motion, what)
        size = max(abs(z) for z in exact.values())
        if size > 0:
            errors.append(
                max(abs(mp.mpmathify(complex(found[name][0])) - z) for name, z in exact.items()) / size
            )
    return float(max(errors))


@pytest.mark.parametrize("block", range(4))
def test_the_error_never_exceeds_the_predicted_one_however_near_a_singular_position(block):
    lot = np.random.default_rng(block)
    seen = near = 0
    for number in range(80):
        chain = list(lot.choice(KINDS, size=lot.integers(1, 5)))
        mechanism = random_mechanism(
            int(lot.integers(2**31)), chain, slider_drives=number % 3 == 0, least_sine=1e-9
        )
        truth = true_rates(mechanism)
        if truth is None or not mechanism.groups:
            continue
        with np.errstate(all="ignore"):
            plain = _on_arrays(mechanism, 1, True)  # noqa: FBT003 - as the core calls it
        refined = move_where_possible(mechanism)
        for motion in (plain, refined):
            if np.isfinite(motion.predicted_error[0]):
                assert error_of(motion, truth) <= motion.predicted_error[0], (block, number)
                seen += 1
        near += bool(refined.recomputed[0])
    assert seen > 100
    assert near > 10


@given(a_mechanism)
def test_one_variant_few_and_many_are_solved_alike(mechanism):
    moments = np.linspace(0.0, 1e-3, 5)
    many = after(mechanism, moments)
    motions = {5: move_where_possible(many)}
    for count in (1, 2, 3):
        driver = many.driver
        fields = {name: getattr(driver, name) for name in driver.__dataclass_fields__}
        some = {name: z[:count] for name, z in fields.items() if isinstance(z, np.ndarray)}
        motions[count] = move_where_possible(replace(many, driver=replace(driver, **some)))
    whole = motions.pop(5)
    for count, motion in motions.items():
        share = whole.predicted_error[:count] + motion.predicted_error
        for what in ("position", *ORDERS):
            rates, others = getattr(whole, what), getattr(motion, what)
            size = np.max([np.abs(z[:count]) for z in rates.values()], axis=0)
            assert rates.keys() == others.keys()
            for name, z in rates.items():
                assert others[name].shape == (count,)
                assert np.all(np.abs(z[:count] - others[name])[share < 1] <= (share * size)[share < 1])


@given(a_mechanism)
def test_velocities_are_the_same_with_and_without_accelerations(mechanism):
    whole, part = move(mechanism), move(mechanism, accelerations=False)
    assert part.acceleration == part.epsilon == {}
    for joint, v in whole.velocity.items():
        np.testing.assert_array_equal(v, part.velocity[joint])


# 10^5 of each of the common mechanisms, as a class of any size is solved ------------------------


def cranks(lot, count=MANY) -> Crank:
    return Crank(
        link="1",
        pivot="O1",
        pin="A",
        length_m=lot.uniform(0.1, 1.5, count),
        angle_rad=lot.uniform(-np.pi, np.pi, count),
        omega=lot.uniform(-30, 30, count),
        epsilon=lot.uniform(-50, 50, count),
        accelerated=True,
    )


def four_bars(lot):
    lengths = tuple(lot.uniform(0.1, 2.0, MANY) for _ in range(2))
    side = lot.choice([-1.0, 1.0], MANY)
    ground = {"O1": array(0j), "O2": lot.uniform(0.1, 2.0, MANY) + 0j}
    mechanism = Mechanism(ground, cranks(lot), (Dyad("B", ("A", "O2"), ("3", "2"), lengths, side),))
    first, second = lengths

    def slack(at):
        base = np.abs(at["A"] - ground["O2"])
        return np.minimum(first + second - base, base - np.abs(first - second))

    def meets(at):
        gaps = [np.abs(np.abs(at["B"] - at[p]) - length) for p, length in (("A", first), ("O2", second))]
        turn = ((ground["O2"] - at["A"]).conj() * (at["B"] - at["A"])).imag
        return np.max(gaps, axis=0), np.sign(turn) == side

    return mechanism, slack, meets


def slider_cranks(lot):
    length, side = lot.uniform(0.1, 2.0, MANY), lot.choice([-1.0, 1.0], MANY)
    guide = FixedGuide(lot.normal(0, 0.5, MANY) + 1j * lot.normal(0, 0.5, MANY), lot.uniform(-3, 3, MANY))
    mechanism = Mechanism({"O1": array(0j)}, cranks(lot), (Slider("B", "A", "2", length, guide, side),))
    along = np.exp(1j * guide.angle_rad)

    def height(at, joint):
        return (along.conj() * (at[joint] - guide.through_m)).imag

    def meets(at):
        gaps = [np.abs(np.abs(at["B"] - at["A"]) - length), np.abs(height(at, "B"))]
        return np.max(gaps, axis=0), np.sign((along.conj() * (at["B"] - at["A"])).real) == side

    return mechanism, lambda at: length - np.abs(height(at, "A")), meets


def whitworths(lot):
    offset, side = lot.normal(0, 0.3, MANY), lot.choice([-1.0, 1.0], MANY)
    ground = {"O1": array(0j), "O2": lot.uniform(0.1, 2.0, MANY) * np.exp(1j * lot.uniform(-3, 3, MANY))}
    group = SlottedLink("A3", "A", "O2", "3", offset, "F", side)
    mechanism = Mechanism(ground, cranks(lot), (group,))

    def meets(at):
        foot, pin = at["F"] - ground["O2"], at["A"] - at["F"]
        gaps = [np.abs((pin.conj() * foot).real), np.abs(np.abs(foot) - np.abs(offset))]
        # The guide runs from the foot to the pin where the pin lies ahead, and has the foot to its left.
        return np.max(gaps, axis=0), np.sign((pin.conj() * foot).imag) == np.sign(offset) * side

    return mechanism, lambda at: np.abs(at["A"] - ground["O2"]) - np.abs(offset), meets


@pytest.mark.parametrize("kind", [four_bars, slider_cranks, whitworths])
def test_of_many_random_mechanisms_none_is_in_the_other_assembly_and_none_is_nan_untold(kind):
    mechanism, slack, meets = kind(np.random.default_rng(20))
    motion = move_where_possible(mechanism)
    told = np.isfinite(motion.predicted_error)
    slack = slack(motion.position)
    assert np.all(told[slack > BARELY])
    assert not np.any(told[slack < -BARELY])
    gap, right = meets(motion.position)
    sure = told & (slack > BARELY)
    assert np.max(gap[sure]) <= CLOSED
    assert np.all(right[sure])
    for rates in (motion.velocity, motion.acceleration, motion.omega, motion.epsilon):
        for values in rates.values():
            assert np.all(np.isfinite(values) == told)
    assert 0.3 * MANY < told.sum() < MANY
