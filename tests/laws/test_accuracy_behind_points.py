"""The predicted error holds behind points of links, however near a later group is to a singular position.

A link's point is held by its shape over its base, rounded to doubles; the data are the file's lengths
or coordinates. The truth here takes the shape from those data in many digits.
"""

from dataclasses import replace
from itertools import cycle, product

import numpy as np
import pytest
from mpmath import mp

from reference.authored.assembly import build_mechanism
from reference.authored.mechanism import MechanismFile
from reference.authored.toml_file import validate
from reference.kinematics.motion import _on_arrays, move_where_possible
from reference.mechanism import Plate, PointOnLine
from tests.laws.test_accuracy import error_of, true_rates

NEAR = (1e-4, 1e-6, 1e-8, 1e-10)
LAST = ("RRP", "stretched", "folded")
COUPLER, SECOND = 0.9, 0.8
"""Lengths of the links that carry points, metres."""
TRUE_DIGITS = 60


def plate(node, base, link, lengths, side="left"):
    return {"node": node, "type": "plate", "base": base, "link": link, "lengths": lengths, "side": side}


def point(node, base, link, at):
    return {"node": node, "type": "point", "base": base, "link": link, "at": at}


def by_lengths(node, base, link, length):
    return [plate(node, base, link, [0.7 * length, 0.61])]


def by_coordinates(node, base, link, length):
    del length
    return [point(node, base, link, [0.37, -0.23])]


def thin(node, base, link, length):
    return [plate(node, base, link, [0.4 * length, 0.6 * length * (1 + 1e-6)], "right")]


def in_line_by_lengths(node, base, link, length):
    return [plate(node, base, link, [0.3 * length, 0.7 * length])]


def in_line_by_coordinates(node, base, link, length):
    del length
    return [point(node, base, link, [-0.17, 0.0])]


def on_another_plate(node, base, link, length):
    between = f"{node}0"
    return [
        plate(between, base, link, [0.83, 0.9 * length]),
        plate(node, [between, base[1]], link, [0.71, 0.47], "right"),
    ]


POINTS = (
    by_lengths, by_coordinates, thin, in_line_by_lengths, in_line_by_coordinates, on_another_plate,
)  # fmt: skip


def built(groups, ground):
    crank = {"pivot": "O1", "pin": "A", "length": 0.23, "angle_deg": 47.3, "omega": 7.1, "epsilon": -3.3}
    table = {"schema_version": 1, "id": "chain", "title": {"en": "chain"}, "length_unit": "m"}
    table |= {"ground": ground, "crank": crank, "group": groups}
    return build_mechanism(validate(MechanismFile, table, "the file"), {}, 1)


def near_the_limit(last, delta, behind):
    """A mechanism whose last group hangs on a point of a link and is flat but for `delta`."""
    ground = {"O1": [0.1, 0.2], "O2": [0.9, 0.1], "O3": [1.4, 1.7]}
    groups = [
        {"node": "B", "type": "RRR", "pins": ["A", "O2"], "links": ["2", "3"], "side": "left"}
        | {"lengths": [COUPLER, 0.7]},
        *behind[0]("C", ["A", "B"], "2", COUPLER),
        {"node": "D", "type": "RRR", "pins": ["C", "O3"], "links": ["4", "5"], "side": "right"}
        | {"lengths": [SECOND, 1.3]},
        *behind[1]("E", ["C", "D"], "4", SECOND),
    ]
    pin = complex(move_where_possible(built(groups, ground)).position["E"][0])
    if last == "RRP":
        foot = pin - 1j * np.exp(0.3j) * 0.6 * (1.0 - delta)
        guide = {"through": [foot.real, foot.imag], "angle_deg": "degrees(0.3)"}
        group = {"node": "F", "type": "RRP", "pin": "E", "link": "6", "length": 0.6, "guide": guide}
        return built([*groups, group | {"side": "ahead"}], ground)
    lengths = [0.9, 0.5]
    span = sum(lengths) * (1.0 - delta) if last == "stretched" else (lengths[0] - lengths[1]) * (1.0 + delta)
    pivot = pin + span * np.exp(-1.1j)
    group = {"node": "F", "type": "RRR", "pins": ["E", "O4"], "links": ["6", "7"], "lengths": lengths}
    return built([*groups, group | {"side": "left"}], ground | {"O4": [pivot.real, pivot.imag]})


def with_exact_shapes(mechanism):
    """The mechanism with the shape of every point of a link in many digits, from lengths or coordinates."""
    lengths = {"A B": COUPLER, "C D": SECOND, "C0 B": 0.9 * COUPLER, "E0 D": 0.9 * SECOND}
    with mp.workdps(TRUE_DIGITS):
        groups = tuple(_exact(group, lengths) for group in mechanism.groups)
    return replace(mechanism, groups=groups)


def _exact(group, lengths):
    if not isinstance(group, Plate | PointOnLine):
        return group
    span = mp.mpf(lengths[" ".join(group.base)])
    if group.local_m is not None:
        shape = mp.mpmathify(group.local_m.item()) / span
    else:
        first, second = (mp.mpf(length.item()) for length in group.lengths_m)
        along = (span**2 + first**2 - second**2) / (2 * span**2)
        flat = group.shape.item().imag == 0.0
        across = 0 if flat else group.side * mp.sqrt((first / span) ** 2 - along**2)
        shape = mp.mpc(first / span if flat else along, across)
    name = "ratio" if isinstance(group, PointOnLine) else "shape"
    return replace(group, **{name: np.array([shape])})


@pytest.mark.parametrize("delta", NEAR)
@pytest.mark.parametrize(
    ("first", "second", "last"), [(*pair, last) for pair, last in zip(product(POINTS, POINTS), cycle(LAST))]
)
def test_the_predicted_error_holds_behind_points_of_links(first, second, last, delta):
    mechanism = near_the_limit(last, delta, (first, second))
    truth = true_rates(with_exact_shapes(mechanism), anew=False)
    assert truth is not None
    with np.errstate(all="ignore"):
        plain = _on_arrays(mechanism, 1, True)  # noqa: FBT003 - as the core calls it
    many = replace(
        mechanism, driver=replace(mechanism.driver, angle_rad=mechanism.driver.angle_rad.repeat(5))
    )
    for motion in (plain, move_where_possible(mechanism), move_where_possible(many)):
        assert error_of(motion, truth) <= motion.predicted_error[0]


def test_a_six_bar_is_solved_once_all_round():
    ground = {"O1": [0.0, 0.0], "O2": [0.3, 0.0], "O3": [0.6, 0.1]}
    crank = {"pivot": "O1", "pin": "A", "length": 0.1, "angle_deg": "n", "omega": 5.0}
    groups = [
        {"node": "B", "type": "RRR", "pins": ["A", "O2"], "links": ["2", "3"], "side": "left"}
        | {"lengths": [0.35, 0.25]},
        plate("C", ["A", "B"], "2", [0.22, 0.22]),
        {"node": "D", "type": "RRR", "pins": ["C", "O3"], "links": ["4", "5"], "side": "right"}
        | {"lengths": [0.4, 0.35]},
    ]
    table = {"schema_version": 1, "id": "six", "title": {"en": "six"}, "length_unit": "m"}
    file = validate(MechanismFile, table | {"ground": ground, "crank": crank, "group": groups}, "the file")
    motion = move_where_possible(build_mechanism(file, {"n": np.arange(0.0, 360.0)}, 360))
    assert np.all(np.isfinite(motion.predicted_error))
    assert not motion.recomputed.any()
