"""Why a mechanism has no motion: which group, by how much, and what to do."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reference.errors import MechanismError
from reference.mechanism import (
    Crank,
    CrossSlider,
    Dyad,
    Group,
    Mechanism,
    Plate,
    Slider,
    SlottedLink,
    Yoke,
)
from reference.numbers import cross
from reference.solving import Solution, one_variant, rail_of, solve

ROUNDING = 1e-14
"""Relative to the mechanism's reach."""
WHAT_IS_IN_LINE = {
    Dyad: "its links are in line",
    Slider: "its rod is perpendicular to the guide",
    SlottedLink: "the pin is at the link's pivot, or as near to it as the offset lets it",
    CrossSlider: "its guides are parallel",
    Yoke: "slot and guide are parallel",
}


def reason(mechanism: Mechanism, broken: NDArray[np.bool_]) -> MechanismError:
    """The error for the first of the broken variants, which says how many there are."""
    first = int(np.argmax(broken))
    where = f" ({int(broken.sum())} of {broken.size} variant(s), the first at index {first})"
    return reason_at(mechanism, first, "" if broken.size == 1 else where)


def reason_at(mechanism: Mechanism, index: int, where: str = "") -> MechanismError:
    """The error for the variant at an index, from the first group that fails there."""
    take = one_variant(index, _quiet)
    groups = mechanism.groups
    driven = "crank angle" if isinstance(mechanism.driver, Crank) else "displacement of the driven slider"
    with np.errstate(all="ignore"):
        for count, group in enumerate(groups):
            before = solve(replace(mechanism, groups=groups[:count]), take)
            try:
                after = solve(replace(mechanism, groups=groups[: count + 1]), take)
            except ZeroDivisionError:
                break
            node = after.joints[group.node]
            if not np.isfinite(node.position) or np.isnan(after.transmission.get(group.node, 1.0)):
                gap, reach = _gap(group, before), max(abs(one.position) for one in before.joints.values())
                # A gap of rounding alone: the group is flat, and its data say so as well as they can.
                if gap > ROUNDING * reach:
                    return _open(group, gap, where, driven)
                return _singular(group, where, driven)
            if not np.isfinite(node.amplification * np.abs(node.acceleration + node.velocity)):
                break
        else:
            group = min(groups, key=lambda one: float(after.transmission.get(one.node, 1.0)))
    return _singular(group, where, driven)


def _quiet(number: complex) -> np.generic:
    """NumPy's own scalar: it divides by zero without an error."""
    scalar: np.generic = np.asarray(number)[()]  # type: ignore[assignment]
    return scalar


def _open(group: Group, gap_m: float, where: str, driven: str) -> MechanismError:
    return MechanismError(
        "does_not_assemble",
        f"the group of {group.node} does not assemble: its links miss each other by {{gap}}{where};"
        f" check the lengths, the {driven}, and the sides of the groups before it",
        group=group.node,
        gap_m=gap_m,
    )


def _singular(group: Group, where: str, driven: str) -> MechanismError:
    advice = "give slot and guide two directions" if isinstance(group, Yoke) else f"choose another {driven}"
    why = WHAT_IS_IN_LINE.get(type(group), "its base has no length")
    message = f"the velocities of the group of {group.node} are not determined: {why}{where}; {advice}"
    return MechanismError("singular", message, group=group.node)


def _gap(group: Group, before: Solution) -> float:
    """By how much a group fails to close, metres; the group's pins are where `before` has them."""
    at = {name: joint.position for name, joint in before.joints.items()}
    take = before.take
    match group:
        case Dyad(pins=(p, q)) | Plate(base=(p, q)):
            distance, first, second = abs(at[q] - at[p]), *map(take, group.lengths_m)
            gap = max(distance - (first + second), abs(first - second) - distance)
        case Slider(pin=pin):
            rail = rail_of(before, group.guide)
            gap = abs(cross(rail.along, at[pin] - rail.joint.position)) - take(group.length_m)
        case SlottedLink(pin=pin, pivot=pivot):
            gap = abs(take(group.offset_m)) - abs(at[pin] - at[pivot])
        case _:
            gap = 0.0
    return float(gap)
