"""Positions of one motion: beyond a flat position (of a parallelogram, a kite) a group is on its other side.

As `planmark cycle` follows a motion: where two branches meet, the motion goes on smoothly, by velocity.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from reference.geometry import FloatArray
from reference.kinematics.continuation import TURN, may_pass, signs_between
from reference.kinematics.motion import BoolArray, move_where_possible
from reference.mechanism import (
    Array,
    Crank,
    Mechanism,
    driving_of,
    rows_of,
    with_arrays,
)

FLAT = 1e-3
"""The sine of a transmission angle below which a position does not distinguish the two assemblies."""


def signs_of(mechanism: Mechanism, numbers: Sequence[int | None]) -> dict[str, FloatArray]:
    """Return by node, (N,): -1 where flat positions since the first position of the same n reverse its group.

    Arguments: the mechanism of N variants with the sides of its file; n of each, equal ones together. The
    first position that counts is one that is not flat itself. Groups that pass no flat position are left out.
    """
    driving, sound = _driving(mechanism), _sound(mechanism)
    signs: dict[str, FloatArray] = {}
    motions = [[*rows] for _, rows in groupby(range(len(numbers)), lambda row: numbers[row])]
    motions = [rows for rows in motions if sound[rows].any() and _is_one_motion(mechanism, rows)]
    if isinstance(mechanism.driver, Crank):
        for rows in motions:
            driving[rows] = np.unwrap(driving[rows])
    starts = [next(row for row in rows if sound[row]) for rows in motions]
    low, high = (np.array([choose(driving[rows]) for rows in motions]) for choose in (np.min, np.max))
    for index in np.flatnonzero(may_pass(rows_of(mechanism, starts), low, high)) if motions else ():
        rows, start = motions[index], starts[index]
        passed = signs_between(rows_of(mechanism, [start]), driving[start], driving[rows])
        for node, sign in passed.items():
            signs.setdefault(node, np.ones(len(numbers)))[rows] = sign
    return {node: sign for node, sign in signs.items() if np.any(sign < 0.0)}


def other_assemblies(mechanism: Mechanism, chain: Sequence[int]) -> dict[str, list[int]]:
    """Return by node the indices of variants whose side means another assembly than in the variants before.

    Arguments: the mechanism of N variants; some of them, neighbours in this order. Each is driven from its
    own position to its neighbour's, a crank the shorter way round: if a flat position lies between, the same
    assembly needs the other side. Variants that are flat themselves are skipped.
    """
    driving, sound = _driving(mechanism), _sound(mechanism)
    rows = np.array([row for row in chain if sound[row]], dtype=np.intp)
    if rows.size < 2:
        return {}
    start, end = driving[rows[1:]], driving[rows[:-1]]
    if isinstance(mechanism.driver, Crank):
        end = start + (end - start + 0.5 * TURN) % TURN - 0.5 * TURN
    near = may_pass(rows_of(mechanism, rows[1:]), np.minimum(start, end), np.maximum(start, end))
    reversals = {group.node: np.ones(rows.size) for group in mechanism.groups}
    for index in np.flatnonzero(near):
        own = rows_of(mechanism, rows[index + 1 : index + 2])
        for node, sign in signs_between(own, start[index], end[index : index + 1]).items():
            reversals[node][index + 1] = sign[0]
    found: dict[str, list[int]] = {}
    for group in mechanism.groups:
        side = np.broadcast_to(getattr(group, "side", 1), driving.shape)[rows]
        kept = np.append(1.0, side[1:] * side[:-1])
        other = np.cumprod(np.where(reversals[group.node] < 0.0, -kept, 1.0)) < 0.0
        if other.any():
            found[group.node] = rows[other].tolist()
    return found


def with_signs(mechanism: Mechanism, signs: Mapping[str, FloatArray]) -> Mechanism:
    """Return the mechanism with some groups' sides times a sign, (N,) each."""
    groups = tuple(
        replace(group, side=group.side * signs[group.node]) if group.node in signs else group  # type: ignore[union-attr,arg-type]
        for group in mechanism.groups
    )
    return replace(mechanism, groups=groups)


def _driving(mechanism: Mechanism) -> FloatArray:
    return np.array(driving_of(mechanism.driver))


def _sound(mechanism: Mechanism) -> BoolArray:
    """(N,) whether a variant assembles and is not flat."""
    transmission = move_where_possible(mechanism, accelerations=False).transmission.values()
    count = driving_of(mechanism.driver).size
    return np.asarray(np.min([np.ones(count), *transmission], axis=0) > FLAT)


def _is_one_motion(mechanism: Mechanism, rows: Sequence[int]) -> bool:
    """Return whether some variants differ only in the position and the speed of their driving link."""
    same: list[bool] = []

    def compare(values: Array) -> Array:
        same.append(bool(np.all(values[rows] == values[rows[0]])))
        return values

    driver = mechanism.driver
    fixed = (driver.length_m,) if isinstance(driver, Crank) else (driver.guide_m, driver.guide_rad)
    with_arrays((mechanism.ground_m, mechanism.groups, fixed), compare)
    return all(same)
