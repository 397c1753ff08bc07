"""Random mechanisms at a given distance from each kind of singular position.

The distance `delta` is relative: of a length to the one at which the group is flat, of an angle (rad)
to the one at which lines are parallel. Doubles cannot represent every distance, so each case is made
near the distance asked for, and its actual distance is computed exactly from its doubles.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from mpmath import mp, mpf

from reference.mechanism import (
    Crank,
    CrossSlider,
    Dyad,
    FixedGuide,
    Group,
    Mechanism,
    MovingGuide,
    Plate,
    Slider,
    SlotPoint,
    SlottedLink,
    Yoke,
)
from tests.bench.oracle import DIGITS

QUARTER = 0.5 * np.pi
STEP = 2.0**-20
"""Lengths of turned kites are multiples of this, so that 3, 4 and 5 times them are exact."""


@dataclass(frozen=True, slots=True)
class Case:
    """One mechanism and its exact relative distance from the singular position."""

    mechanism: Mechanism
    delta: float


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of singular position.

    Attributes
    ----------
    smooth : the motion itself is smooth through the position: no accuracy need be lost there
    draw : a random case at about the distance given
    plain : made of groups that others know too (four-bars and slider-cranks)
    """

    id: str
    title: str
    draw: Callable[[np.random.Generator, float], Case]
    smooth: bool = False
    plain: bool = True


def _array(value: complex) -> Any:
    return np.array([value])


def _crank(length: float, angle: float, rng: np.random.Generator) -> Crank:
    omega, epsilon = rng.uniform(1.0, 20.0), rng.uniform(-50.0, 50.0)
    return Crank(
        link="1",
        pivot="O1",
        pin="A",
        length_m=_array(length),
        angle_rad=_array(angle),
        omega=_array(omega),
        epsilon=_array(epsilon),
        accelerated=True,
    )


def _mechanism(crank: Crank, ground: Mapping[str, complex], *groups: Group) -> Mechanism:
    places = {joint: _array(complex(z)) for joint, z in {"O1": 0j, **ground}.items()}
    return Mechanism(places, crank, groups)


def _pin(crank: Crank) -> complex:
    """The crank's pin, rounded, to place the rest."""
    return complex(crank.length_m[0] * np.exp(1j * crank.angle_rad[0]))


def _exact_pin(crank: Crank) -> Any:
    return mpf(float(crank.length_m[0])) * mp.expj(mpf(float(crank.angle_rad[0])))


def _exact(z: complex) -> Any:
    return mp.mpc(z.real, z.imag)


def _carried(crank: Crank, rng: np.random.Generator, *, by_plate: bool) -> tuple[tuple[Plate, ...], str, Any]:
    """Groups, and the joint that carries the singular group (the pin, or a plate's), with its exact place."""
    if not by_plate:
        with mp.workdps(DIGITS):
            return (), crank.pin, _exact_pin(crank)
    base, side = float(crank.length_m[0]), _side(rng)
    first, second = (base * rng.uniform(0.6, 1.2) for _ in range(2))
    with mp.workdps(DIGITS):
        along = (1 + (mpf(first) / base) ** 2 - (mpf(second) / base) ** 2) / 2
        shape = mp.mpc(along, side * mp.sqrt((mpf(first) / base) ** 2 - along**2))
        lengths = (_array(first), _array(second))
        plate = Plate("C", (crank.pivot, crank.pin), crank.link, lengths, side, _array(complex(shape)))
        return (plate,), "C", shape * _exact_pin(crank)


def _side(rng: np.random.Generator) -> int:
    return int(rng.choice((-1, 1)))


def _dyad(first: float, second: float, side: int, pin: str = "A") -> Dyad:
    return Dyad("B", (pin, "O2"), ("2", "3"), (_array(first), _array(second)), side)


def _flat_dyad(rng: np.random.Generator, delta: float, *, stretched: bool, by_plate: bool = False) -> Case:
    """A four-bar whose dyad is nearly in line: |A O2| = (l1 + l2)(1 - delta), |l1 - l2|(1 + delta).

    `by_plate`: it is attached to a point of the crank instead of the crank's pin.
    """
    crank = _crank(rng.uniform(0.2, 1.0), rng.uniform(-np.pi, np.pi), rng)
    first = rng.uniform(0.5, 2.0)
    second = first * rng.uniform(1.5, 3.0) ** _side(rng)
    flat = first + second if stretched else abs(first - second)
    span = flat * (1.0 - delta if stretched else 1.0 + delta)
    plates, pin, place = _carried(crank, rng, by_plate=by_plate)
    pivot = complex(complex(place) + span * np.exp(1j * rng.uniform(-np.pi, np.pi)))
    with mp.workdps(DIGITS):
        true_span = abs(_exact(pivot) - place)
        true_flat = mpf(first) + mpf(second) if stretched else abs(mpf(first) - mpf(second))
        apart = float(abs(true_span - true_flat) / true_flat)
    dyad = _dyad(first, second, _side(rng), pin)
    return Case(_mechanism(crank, {"O2": pivot}, *plates, dyad), apart)


def _upright_rod(rng: np.random.Generator, delta: float, *, by_plate: bool = False) -> Case:
    """A slider-crank whose rod is nearly perpendicular to the guide: the pin's height is L (1 - delta)."""
    crank = _crank(rng.uniform(0.2, 1.0), rng.uniform(-np.pi, np.pi), rng)
    length, guide_angle = rng.uniform(0.5, 2.0), rng.uniform(-np.pi, np.pi)
    along = np.exp(1j * guide_angle)
    height = length * (1.0 - delta) * _side(rng)
    plates, pin, place = _carried(crank, rng, by_plate=by_plate)
    through = complex(complex(place) - 1j * along * height + along * rng.uniform(-1.0, 1.0))
    with mp.workdps(DIGITS):
        arm = (place - _exact(through)) * mp.expj(-mpf(guide_angle))
        apart = float(abs(mpf(length) - abs(arm.imag)) / mpf(length))
    guide = FixedGuide(_array(through), _array(guide_angle))
    slider = Slider("B", pin, "2", _array(length), guide, _side(rng))
    return Case(_mechanism(crank, {}, *plates, slider), apart)


def _kite(rng: np.random.Generator, delta: float) -> Case:
    """Crank = ground, coupler = rocker, the ground along an axis, the crank's pin near its other end."""
    quarter = int(rng.integers(4))
    radius, length = rng.uniform(0.2, 0.9), rng.uniform(1.0, 2.0)
    angle = quarter * QUARTER + delta * _side(rng)
    with mp.workdps(DIGITS):
        apart = float(abs(mpf(angle) - quarter * mp.pi / 2))
    pivot = radius * (1 + 0j, 1j, -1 + 0j, -1j)[quarter]
    crank = _crank(radius, angle, rng)
    return Case(_mechanism(crank, {"O2": pivot}, _dyad(length, length, _side(rng))), apart)


def _turned_kite(rng: np.random.Generator, delta: float) -> Case:
    """The same with the ground along (3, 4): there the crank's angle is no whole quarter turn."""
    fifth = STEP * int(rng.integers(40_000, 180_000))
    length, base = rng.uniform(1.0, 2.0), float(np.arctan2(4.0, 3.0))
    angle = base + delta * _side(rng)
    with mp.workdps(DIGITS):
        apart = float(abs(mpf(angle) - mp.atan2(4, 3)))
    crank = _crank(5.0 * fifth, angle, rng)
    pivot = complex(3.0 * fifth, 4.0 * fifth)
    return Case(_mechanism(crank, {"O2": pivot}, _dyad(length, length, _side(rng))), apart)


def _isosceles(rng: np.random.Generator, delta: float) -> Case:
    """A slider-crank with crank = rod on a guide through the pivot, the crank nearly upright on it."""
    radius = rng.uniform(0.2, 2.0)
    angle = QUARTER * _side(rng) - delta * _side(rng)
    with mp.workdps(DIGITS):
        apart = float(abs(abs(mpf(angle)) - mp.pi / 2))
    guide = FixedGuide(_array(0j), _array(0.0))
    slider = Slider("B", "A", "2", _array(radius), guide, _side(rng))
    return Case(_mechanism(_crank(radius, angle, rng), {}, slider), apart)


def _whitworth(rng: np.random.Generator, delta: float) -> Case:
    """A slotted link pivoted at the crank's radius, the pin passing over the pivot: smooth, i = 1 : 2."""
    quarter = int(rng.integers(4))
    radius, angle = rng.uniform(0.2, 2.0), quarter * QUARTER + delta * _side(rng)
    with mp.workdps(DIGITS):
        apart = float(abs(mpf(angle) - quarter * mp.pi / 2))
    pivot = radius * (1 + 0j, 1j, -1 + 0j, -1j)[quarter]
    crank = _crank(radius, angle, rng)
    return Case(_mechanism(crank, {"O2": pivot}, *_slotted(0.0, rng)), apart)


def _slotted(offset: float, rng: np.random.Generator) -> tuple[SlottedLink, SlotPoint]:
    """The link, and a point of it far from the pin, whose motion shows how the link turns."""
    local = complex(rng.uniform(0.5, 1.0), rng.uniform(-0.5, 0.5))
    foot = "F" if offset else None
    link = SlottedLink("A3", "A", "O2", "3", _array(offset), foot, _side(rng))
    return link, SlotPoint("S", "A3", "3", _array(local))


def _near_pivot(rng: np.random.Generator, delta: float) -> Case:
    """A slotted link whose pin passes its pivot at the distance delta of the crank's length."""
    crank = _crank(rng.uniform(0.2, 1.0), rng.uniform(-np.pi, np.pi), rng)
    radius = float(crank.length_m[0])
    pivot = complex(_pin(crank) + radius * delta * np.exp(1j * rng.uniform(-np.pi, np.pi)))
    with mp.workdps(DIGITS):
        apart = float(abs(_exact(pivot) - _exact_pin(crank)) / mpf(radius))
    return Case(_mechanism(crank, {"O2": pivot}, *_slotted(0.0, rng)), apart)


def _offset_slot(rng: np.random.Generator, delta: float) -> Case:
    """A slotted link with an offset guide, the pin nearly at its foot: |A O2| = offset (1 + delta)."""
    crank = _crank(rng.uniform(0.2, 1.0), rng.uniform(-np.pi, np.pi), rng)
    offset = rng.uniform(0.2, 1.0) * _side(rng)
    turn = np.exp(1j * rng.uniform(-np.pi, np.pi))
    pivot = complex(_pin(crank) + abs(offset) * (1.0 + delta) * turn)
    with mp.workdps(DIGITS):
        span = abs(_exact(pivot) - _exact_pin(crank))
        apart = float(abs(span - abs(mpf(offset))) / abs(mpf(offset)))
    return Case(_mechanism(crank, {"O2": pivot}, *_slotted(offset, rng)), apart)


def _parallel_guides(rng: np.random.Generator, delta: float) -> Case:
    """A block on the crank's own line and on a fixed guide nearly parallel to it."""
    angle = rng.uniform(-np.pi, np.pi)
    crank = _crank(rng.uniform(0.2, 1.0), angle, rng)
    guide_angle = angle - delta * _side(rng)
    with mp.workdps(DIGITS):
        apart = float(abs(mpf(angle) - mpf(guide_angle)))
    through = complex(rng.uniform(0.2, 1.0) * np.exp(1j * rng.uniform(-np.pi, np.pi)))
    guide = FixedGuide(_array(through), _array(guide_angle))
    cross = CrossSlider("B", (MovingGuide("1", ("O1", "A"), "B1"), guide))
    return Case(_mechanism(crank, {}, cross), apart)


def _parallel_slot(rng: np.random.Generator, delta: float) -> Case:
    """A yoke whose slot is nearly parallel to its guide."""
    crank = _crank(rng.uniform(0.2, 1.0), rng.uniform(-np.pi, np.pi), rng)
    slot = rng.uniform(-np.pi, np.pi)
    guide_angle = slot - delta * _side(rng)
    with mp.workdps(DIGITS):
        apart = float(abs(mpf(slot) - mpf(guide_angle)))
    guide = FixedGuide(_array(0j), _array(guide_angle))
    return Case(_mechanism(crank, {}, Yoke("B", "A", _array(slot), guide)), apart)


KINDS = (
    Kind("rrr_stretched", "RRR, coupler and rocker nearly stretched", partial(_flat_dyad, stretched=True)),
    Kind("rrr_folded", "RRR, coupler and rocker nearly folded", partial(_flat_dyad, stretched=False)),
    Kind("rrp_upright", "RRP, rod nearly perpendicular to the guide", _upright_rod),
    Kind("kite", "kite: crank = ground, coupler = rocker, pin near the rocker's pivot", _kite, smooth=True),
    Kind("kite_turned", "the kite with its ground along (3, 4)", _turned_kite),
    Kind("isosceles", "slider-crank with rod = crank, crank nearly upright", _isosceles, smooth=True),
    Kind("rpr_kite", "RPR, crank = ground, pin near the pivot", _whitworth, smooth=True, plain=False),
    Kind("rpr_pivot", "RPR, pin passing near the pivot", _near_pivot, plain=False),
    Kind("rpr_offset", "RPR with offset, pin nearly at the guide's foot", _offset_slot, plain=False),
    Kind("prp_parallel", "PRP, guides nearly parallel", _parallel_guides, plain=False),
    Kind("rpp_parallel", "RPP, slot and guide nearly parallel", _parallel_slot, plain=False),
    Kind(
        "rrr_plate",
        "RRR nearly stretched, behind a plate",
        partial(_flat_dyad, stretched=True, by_plate=True),
        plain=False,
    ),
    Kind(
        "rrp_plate",
        "RRP, rod nearly perpendicular, behind a plate",
        partial(_upright_rod, by_plate=True),
        plain=False,
    ),
)
