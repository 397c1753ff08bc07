"""A mechanism's calculation written down once, for a machine that repeats it for every variant.

`reference.solving` and its kernels run a single time on numbers that only note what is done with them
(`reference.noted`). What they noted is a `Program`: the same formulas in the same order, whatever the
mechanism. `reference.lowering` turns it into steps for `reference.machine`.
"""

from dataclasses import dataclass
from functools import reduce
from typing import cast

import numpy as np

from reference.form import Array, with_arrays
from reference.mechanism import Mechanism
from reference.noted import Node, Notes, Number, Op, Plane, Real, parts_of
from reference.numbers import larger
from reference.solving import solve


@dataclass(frozen=True, slots=True)
class Program:
    """What to calculate of a mechanism, and where it goes.

    Attributes
    ----------
    nodes : all operations, each after those it needs
    shared : by leaf, whether it is one number for all variants
    planes : the real and imaginary node of each complex result: positions of all joints, their
        velocities, their accelerations
    reals : the node of each real result: omega, epsilon, transmission, the amplification of errors
    joints, omega, epsilon, transmission : the names of the results, in order
    """

    nodes: tuple[Node, ...]
    shared: tuple[bool, ...]
    planes: tuple[tuple[int, int], ...]
    reals: tuple[int, ...]
    joints: tuple[str, ...]
    omega: tuple[str, ...]
    epsilon: tuple[str, ...]
    transmission: tuple[str, ...]


def write_down(mechanism: Mechanism, shared: tuple[bool, ...], *, accelerations: bool) -> Program:
    """The program of a mechanism, for any data of this form; `shared` says which leaves hold one number."""
    notes, seen = Notes(), iter(range(len(shared)))

    def note(leaf: Array) -> Number:
        order = next(seen)
        if not np.iscomplexobj(leaf):
            return Real(notes, notes.index((Op.INPUT, order)))
        return Plane(*(Real(notes, notes.index((Op.INPUT, order, part))) for part in (0, 1)))

    solution = solve(with_arrays(mechanism, note), accelerations=accelerations)
    joints = solution.joints.values()
    orders = ("position", "velocity", "acceleration") if accelerations else ("position", "velocity")
    planes = [getattr(joint, order) for order in orders for joint in joints]
    epsilon = solution.epsilon if accelerations else {}
    rates = (*solution.omega.values(), *epsilon.values(), *solution.transmission.values())
    amplification = reduce(larger, [joint.amplification for joint in joints])
    ends = [tuple(map(notes.operand, parts_of(plane))) for plane in planes]
    reals = [notes.operand(rate) for rate in (*rates, amplification)]
    return Program(
        tuple(notes.nodes),
        shared,
        cast("tuple[tuple[int, int], ...]", tuple(ends)),
        tuple(reals),
        *map(tuple, (solution.joints, solution.omega, epsilon, solution.transmission)),
    )
