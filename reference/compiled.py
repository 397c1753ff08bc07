"""Motion of many variants by compiled code: the formulas of `reference.groups`, several times faster.

For thousands of variants: a fine cycle, a search over dimensions, a survey. Needs numba (the extra
`fast`), which nothing else here asks for. The machine is compiled at the first call after installation
(some seconds) and kept on disk; a mechanism of a new form costs some milliseconds once in a process,
since only the list of its steps is written down anew, nothing is compiled. For a class of thirty
NumPy is as good.
"""

from collections.abc import Callable

import numpy as np

from reference.errors import CallError
from reference.form import Array, leaves_of
from reference.geometry import ComplexArray, FloatArray
from reference.lowering import Steps, lower
from reference.mechanism import Mechanism
from reference.motion import Motion, move, predicted_error_of
from reference.program import Program, write_down

BLOCK = 256
"""Variants that the machine takes at once: some dozens of registers of 2 KiB, near the processor."""
DOUBLES = (np.dtype(np.float64), np.dtype(np.complex128))
FORMS = 64
"""Programs that are kept."""


def move_compiled(mechanism: Mechanism, *, accelerations: bool = True) -> Motion:
    """As `reference.motion.move`: the same motion to a few roundings, the same errors and refusals.

    Raises CallError where numba is not installed, MechanismError as `move` does.
    """
    return move(mechanism, accelerations=accelerations, solver=by_machine)


def by_machine(mechanism: Mechanism, count: int, accelerations: bool) -> Motion:
    """A solver for `reference.motion.move`: unchecked, in double precision.

    Raises ValueError for an array that holds neither one number nor one for each variant.
    """
    run = _machine()
    leaves, form = leaves_of(mechanism)
    shared = tuple(leaf.size == 1 or (leaf.size > 1 and leaf.strides == (0,)) for leaf in leaves)
    key = (form, shared, accelerations)
    if key not in _prepared:
        _prepare(mechanism, key)
    program, steps = _prepared[key]
    data = [_fitting(leaf, None if one else count) for leaf, one in zip(leaves, shared, strict=True)]
    addresses = np.array([leaf.ctypes.data for leaf in data], dtype=np.int64)
    registers = np.empty((steps.registers, min(BLOCK, max(count, 1))))
    planes = np.empty((len(program.planes), count), dtype=np.complex128)
    reals = np.empty((len(program.reals), count))
    pairs = planes.view(np.float64).reshape(*planes.shape, 2)
    run((steps.once, steps.each, steps.constants), addresses, pairs, reals, registers)
    return _motion(program, planes, reals, accelerations)


Key = tuple[tuple[object, ...], tuple[bool, ...], bool]
_prepared: dict[Key, tuple[Program, Steps]] = {}
"""By a mechanism's form, which of its data all variants share, and whether accelerations are asked for."""


def _prepare(mechanism: Mechanism, key: Key) -> None:
    _, shared, accelerations = key
    program = write_down(mechanism, shared, accelerations=accelerations)
    if len(_prepared) >= FORMS:
        _prepared.clear()
    _prepared[key] = (program, lower(program))


def _machine() -> Callable[..., None]:
    try:
        from reference.machine import run  # noqa: PLC0415 - an extra, and slow to import
    except ImportError as error:
        told = "compiled code needs numba: pip install 'planmark[fast]', or solve without it"
        raise CallError("numba_needed", told) from error
    found: Callable[..., None] = run
    return found


def _fitting(leaf: Array, count: int | None) -> Array:
    """The data as the machine reads them: doubles, one after another; no count where all share the first."""
    if leaf.dtype not in DOUBLES:
        leaf = leaf.astype(np.complex128 if np.iscomplexobj(leaf) else np.float64)
    if count is None:
        return leaf
    if leaf.shape != (count,):
        raise ValueError(f"data of shape {leaf.shape} for {count} variants; expected (1,) or ({count},)")
    return np.ascontiguousarray(leaf)


def _motion(program: Program, planes: ComplexArray, reals: FloatArray, accelerations: bool) -> Motion:
    joints, rows = len(program.joints), iter(reals)
    position, velocity, acceleration = (
        dict(zip(program.joints, planes[order * joints :], strict=False)) for order in range(3)
    )
    return Motion(
        position,
        velocity,
        acceleration if accelerations else {},
        dict(zip(program.omega, rows, strict=False)),
        dict(zip(program.epsilon, rows, strict=False)),
        dict(zip(program.transmission, rows, strict=False)),
        predicted_error_of(reals[-1]),
        np.zeros(reals.shape[1], dtype=np.bool_),
    )
