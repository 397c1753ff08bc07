"""The closed forms of single groups: known triangles, every kind of number, no digit lost without need."""

import math

import numpy as np
import pytest
from mpmath import mp

from reference.kinematics import assur
from reference.numbers import cosine, larger, nearest, root, sine

EPSILON = float(np.finfo(np.float64).eps)
ULPS = 3 * EPSILON
KITE_ANGLES = [1e-1, 1e-4, 1e-8, 1e-12, 1e-15]


def kinds(*values):
    """The same values as Python's numbers, as arrays, in many digits."""
    yield values
    yield tuple(np.array([value]) for value in values)
    yield tuple(mp.mpmathify(value) for value in values)


def plain(value) -> complex:
    return complex(value[0] if isinstance(value, np.ndarray) else value)


@pytest.mark.parametrize(("side", "across"), [(1.0, 0.48), (-1.0, -0.48)])
def test_the_corner_of_a_right_triangle_is_found_on_either_side_in_every_kind_of_number(side, across):
    # Sides 3 and 4 over the hypotenuse 5: foot of the height at 9/5, height 12/5.
    for d, first, second, where in kinds(5 + 0j, 3.0, 4.0, side):
        along, height, sharp = assur.rrr_place(d, first, second, where)
        assert plain(along) == pytest.approx(9 / 25, rel=ULPS)
        assert plain(height) == pytest.approx(across, rel=ULPS)
        assert plain(sharp) == pytest.approx(1.0, rel=ULPS)


def test_a_triangle_that_does_not_close_is_nan_in_every_kind_of_number():
    for d, first, second, side in kinds(8 + 0j, 3.0, 4.0, 1.0):
        with np.errstate(invalid="ignore"):
            _, height, sharp = assur.rrr_place(d, first, second, side)
        assert math.isnan(plain(height).real)
        assert math.isnan(plain(sharp).real)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, np.pi / 2, 2.0, np.pi, -2.5, 40.0, -1000.0])
def test_a_turned_arm_is_exact_to_rounding_and_its_rest_from_the_axis_by_itself(angle):
    axis, rest = assur.arm(2.0, angle)
    arrays = assur.arm(np.array([2.0]), np.array([angle]))
    with mp.workdps(50):
        true = 2 * mp.expj(mp.mpf(angle))
        off = true - mp.mpmathify(complex(axis))
        assert abs(mp.mpmathify(complex(axis + rest)) - true) <= ULPS * 2
        assert abs(mp.mpmathify(complex(rest)) - off) <= ULPS * abs(off) + 1e-27
    assert abs(complex(rest)) <= 4 * math.sin(math.pi / 8) + ULPS
    assert axis + rest == pytest.approx(complex((arrays[0] + arrays[1])[0]), rel=ULPS)


def test_a_sum_keeps_what_rounding_took():
    total, lost = assur.exact_sum(1.0 + 1e9j, 1e-20 + 1e-9j)
    assert (total, lost) == (1.0 + 1e9j, 1e-20 + 1e-9j)


@pytest.mark.parametrize("angle", KITE_ANGLES)
def test_a_kite_near_its_flat_position_moves_as_smoothly_as_anywhere(angle):
    """Crank = ground = 0.3, coupler = rocker = 0.5: the rocker's rate from the kite's own angles."""
    axis, rest = assur.arm(0.3, angle)
    d = (0.3 - axis) - rest  # from A to O2
    along, across, _ = assur.rrr_place(d, 0.5, 0.5, 1.0)
    velocity = -1j * (axis + rest)  # v_O2 - v_A, at 1 rad/s
    _, rocker = assur.rrr_turns(along, across, velocity / d)
    assert along == 0.5
    # The kite's axis turns at half the crank's speed, the rocker about it as acos(0.6 sin(phi / 2)) grows.
    growth = 0.3 * math.cos(angle / 2) / math.sqrt(1.0 - (0.6 * math.sin(angle / 2)) ** 2)
    assert min(abs(rocker - 0.5 - growth), abs(rocker - 0.5 + growth)) <= 20 * EPSILON


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_slider_five_from_a_pin_three_above_its_guide_is_four_along_it(side):
    for height, rest, length, where in kinds(3.0, 0.0, 5.0, side):
        reach, high, sharp = assur.rrp_place(height, rest, length, where)
        assert plain(reach) == pytest.approx(4.0 * side, rel=ULPS)
        assert plain(high) == 3.0
        assert plain(sharp) == pytest.approx(0.8, rel=ULPS)


@pytest.mark.parametrize(("offset", "side"), [(3.0, 1.0), (3.0, -1.0), (-3.0, 1.0), (0.0, -1.0)])
def test_the_guide_of_a_slotted_link_has_the_pin_at_its_offset_and_on_its_side(offset, side):
    for d, aside, where in kinds(3 + 4j, offset, side):
        reach, along, sharp = assur.rpr_place(d, aside, where)
        assert abs(plain(along)) == pytest.approx(1.0, rel=ULPS)
        assert plain(along) * complex(plain(reach).real, offset) == pytest.approx(3 + 4j, rel=ULPS)
        assert plain(reach) == pytest.approx(side * math.sqrt(25 - offset**2), rel=ULPS)
        assert plain(sharp) == pytest.approx(abs(plain(reach)) / 5, rel=ULPS)


def test_two_lines_meet_and_both_slides_make_up_the_difference_of_their_motion():
    between, first, second = 2 + 1j, 1 + 0j, 0.6 + 0.8j
    reach, crossing = assur.cross_place(between, first, second)
    back = (first * reach - between) / second
    assert abs(back.imag) <= ULPS
    one, other = assur.cross_slides(between, first, second, crossing)
    assert one * first - other * second == pytest.approx(between, rel=ULPS)


def test_functions_of_numbers_agree_for_every_kind():
    for (x,) in kinds(0.7):
        assert plain(root(x)) == pytest.approx(math.sqrt(0.7), rel=ULPS)
        assert plain(sine(x)) == pytest.approx(math.sin(0.7), rel=ULPS)
        assert plain(cosine(x)) == pytest.approx(math.cos(0.7), rel=ULPS)
        assert plain(nearest(x)) == 1.0
        assert plain(larger(x, 2 * x)) == 1.4
    for (x,) in kinds(-0.7):
        with np.errstate(invalid="ignore"):
            assert math.isnan(plain(root(x)).real)
        assert math.isnan(plain(larger(x, x * math.nan)).real)
