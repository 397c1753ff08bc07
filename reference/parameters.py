"""The construction's parameters: what a student is given and takes from tables, in SI."""

import numpy as np

from reference.geometry import FloatArray
from reference.mechanism import (
    Crank,
    CrossSlider,
    DrivenSlider,
    Driver,
    Dyad,
    FixedGuide,
    Group,
    Guide,
    Mechanism,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Yoke,
)


def pair(pin: str, node: str) -> str:
    """The name of the real length between two joints among the parameters."""
    return f"{pin}{node}"


def parameters_of(
    mechanism: Mechanism, k_length: FloatArray, k_velocity: FloatArray, k_acceleration: FloatArray
) -> dict[str, FloatArray]:
    """The construction's parameters: real lengths, crank data, guides and the three scales.

    Arguments: scales in real units per millimetre on paper (m/mm, (m/s)/mm, (m/s^2)/mm).
    """
    known: dict[str, FloatArray] = {"kL": k_length, "kv": k_velocity, "ka": k_acceleration}
    known.update(_driver_parameters(mechanism.driver))
    for joint, place in mechanism.ground_m.items():
        known[f"x {joint}"], known[f"y {joint}"] = np.asarray(place.real), np.asarray(place.imag)
    for group in mechanism.groups:
        known.update(_group_parameters(group))
    return known


def _driver_parameters(driver: Driver) -> dict[str, FloatArray]:
    pin = driver.pin
    match driver:
        case Crank(length_m=arm):
            return {
                "angle crank": driver.angle_rad,
                pair(driver.pivot, pin): arm,
                f"v_{pin}": driver.omega * arm,
                f"a_{pin}_n": driver.omega**2 * arm,
                f"a_{pin}_t": driver.epsilon * arm,
            }
        case DrivenSlider():
            guide = FixedGuide(driver.guide_m, driver.guide_rad)
            return {
                f"s {pin}": driver.displacement_m,
                f"v_{pin}": driver.speed,
                f"a_{pin}": driver.acceleration,
                **_guide_parameters(pin, guide),
            }


def _guide_parameters(node: str, guide: Guide) -> dict[str, FloatArray]:
    if not isinstance(guide, FixedGuide):
        return {}
    return {
        f"x guide {node}": np.asarray(guide.through_m.real),
        f"y guide {node}": np.asarray(guide.through_m.imag),
        f"angle guide {node}": guide.angle_rad,
    }


def _group_parameters(group: Group) -> dict[str, FloatArray]:
    match group:
        case Dyad(node=node, pins=pins, lengths_m=lengths) | Plate(node=node, base=pins, lengths_m=lengths):
            known = {pair(pin, node): length for pin, length in zip(pins, lengths, strict=True)}
            if isinstance(group, Plate) and group.line_ratio is not None:
                known[f"ratio {node}"] = group.line_ratio
            return known
        case PointOnLine(node=node, ratio=ratio):
            return {f"ratio {node}": ratio}
        case Slider(node=node, guide=guide):
            return {pair(group.pin, node): group.length_m, **_guide_parameters(node, guide)}
        case CrossSlider(node=node, guides=(first, second)):
            return {**_guide_parameters(node, first), **_guide_parameters(node, second)}
        case Yoke(node=node, guide=guide):
            return {f"angle slot {node}": group.slot_rad, **_guide_parameters(node, guide)}
        case SlottedLink(node=node):
            return {f"offset {node}": group.offset_m}
        case SlotPoint(node=node, local_m=local):
            return {f"x {node}": np.asarray(local.real), f"y {node}": np.asarray(local.imag)}
