"""Instantaneous centres and acceleration poles of the links, from the exact motion.

The centre of two links is the point that moves alike on both; of a link and the ground (link 0), the
one at rest. The acceleration pole of a link is its point without acceleration. The construction finds
those of single links by Mehmke's similarity (`Construction.centres`); this is the other road.
"""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from reference.construction import Construction
from reference.geometry import ComplexArray, FloatArray
from reference.mechanism import Crank, Mechanism
from reference.motion import Motion

NO_TURN = 1e-12
"""A link that turns so slowly, over the mechanism's reach and relative to its largest speed, does not."""


def instantaneous_centres(
    mechanism: Mechanism, construction: Construction, motion: Motion
) -> dict[str, ComplexArray]:
    """Centres ``I3`` of links about the ground, ``I34`` of two links; complex metres, shape (N,).

    nan where there is none: links that do not turn, or turn alike.
    """
    joints = _joints_of_links(mechanism, construction)
    fields = {link: _spin(motion, joint, motion.omega[link]) for link, joint in joints.items()}
    still = (np.zeros(1, dtype=np.complex128), np.zeros(1))
    least = NO_TURN * _largest(motion.velocity) / _largest(motion.position)
    centres = {f"I{link}": _alike(field, still, least) for link, field in fields.items()}
    for first, second in combinations(fields, 2):
        centres[f"I{first}{second}"] = _alike(fields[first], fields[second], least)
    return centres


def acceleration_poles(
    mechanism: Mechanism, construction: Construction, motion: Motion
) -> dict[str, ComplexArray]:
    """``J3`` of every link that turns; complex metres, nan where it neither turns nor speeds up."""
    poles = {}
    least = NO_TURN * _largest(motion.acceleration) / _largest(motion.position)
    for link, joint in _joints_of_links(mechanism, construction).items():
        swing = np.asarray(1j * motion.epsilon[link] - motion.omega[link] ** 2)
        poles[f"J{link}"] = motion.position[joint] - _divided(motion.acceleration[joint], swing, least)
    return poles


def _largest(of_joints: Mapping[str, ComplexArray]) -> FloatArray:
    return np.asarray(np.max([np.abs(values) for values in of_joints.values()], axis=0))


def _joints_of_links(mechanism: Mechanism, construction: Construction) -> Mapping[str, str]:
    """A joint of each link that turns."""
    driver = mechanism.driver
    links = {driver.link: driver.pin} if isinstance(driver, Crank) else {}
    rates = {name.partition("_")[2]: rate for name, rate in construction.rates.items()}
    return {**links, **{link: rate.link[1] for link, rate in rates.items()}}


def _spin(motion: Motion, joint: str, omega: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """A link's velocities as c + i omega z: c and omega."""
    at, velocity = motion.position[joint], motion.velocity[joint]
    return np.asarray(velocity - 1j * omega * at), omega


def _alike(
    first: tuple[ComplexArray, FloatArray], second: tuple[ComplexArray, FloatArray], least: FloatArray
) -> ComplexArray:
    return _divided(second[0] - first[0], np.asarray(1j * (first[1] - second[1])), least)


def _divided(over: ComplexArray, under: ComplexArray, least: FloatArray) -> ComplexArray:
    with np.errstate(all="ignore"):
        return np.where(np.abs(under) > least, over / under, np.nan)
