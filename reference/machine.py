"""The compiled machine that carries out steps (`reference.lowering`) on blocks of variants; needs numba.

It knows real numbers only, and no mechanism: it is compiled once per installation (some seconds) and
kept on disk. Each step is a loop over a block that fits the processor's nearest memory, several
variants at a time. Nothing is reordered or approximated: without `fastmath`, on one thread.
"""

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from reference.geometry import FloatArray
from reference.noted import Op

Steps = NDArray[np.int32]
Addresses = NDArray[np.int64]
REDUCED = 0.8
"""An angle up to here (an eighth of a turn) has the short series."""

S1, S2, S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
S4, S5, S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
C1, C2, C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
C4, C5, C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11
"""Coefficients of sine and cosine on an eighth of a turn, as in fdlibm: below one unit of the last place."""

LOAD, LOAD_PART, LOAD_SHARED = int(Op.LOAD), int(Op.LOAD_PART), int(Op.LOAD_SHARED)
STORE, STORE_PLANE = int(Op.STORE), int(Op.STORE_PLANE)
ADD, SUB, MUL, DIV = int(Op.ADD), int(Op.SUB), int(Op.MUL), int(Op.DIV)
MUL_ADD, MUL_SUB, SUB_MUL = int(Op.MUL_ADD), int(Op.MUL_SUB), int(Op.SUB_MUL)
CROSS, DOT = int(Op.CROSS), int(Op.DOT)
ROOT, ABS, LARGER, NEAREST = int(Op.ROOT), int(Op.ABS), int(Op.LARGER), int(Op.NEAREST)
SINE, COSINE = int(Op.SINE), int(Op.COSINE)


def _kept(**options: Any) -> Callable[[Callable[..., Any]], Any]:  # noqa: ANN401 - numba's options
    """A decorator: compiled at the first call, and kept on disk where there is a place for it."""

    def decorate(function: Callable[..., Any]) -> Any:  # noqa: ANN401 - numba has no types
        try:
            return numba.njit(cache=True, error_model="numpy", **options)(function)
        except RuntimeError:  # neither beside the module nor in the user's own cache
            return numba.njit(error_model="numpy", **options)(function)

    return decorate


compiled = _kept(nogil=True)
part = _kept(no_cpython_wrapper=True)
"""For functions that only compiled ones call."""


@intrinsic
def floats_at(_typing: Any, _address: Any) -> Any:  # noqa: ANN401 - numba's own protocol, without types
    """The memory at an address, for `numba.carray`."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:  # noqa: ANN401
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.int64), generate


@intrinsic
def rint(_typing: Any, _x: Any) -> Any:  # noqa: ANN401 - as above
    """The processor's own instruction for the nearest whole number, as `numpy.rint`."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:  # noqa: ANN401
        nearest = builder.module.declare_intrinsic("llvm.rint", [ir.DoubleType()])
        return builder.call(nearest, arguments)

    return types.float64(types.float64), generate


@part
def are_reduced(r: FloatArray, a: int, width: int) -> bool:
    """Whether all angles of a register are within an eighth of a turn."""
    far = 0
    for i in range(width):
        far |= abs(r[a, i]) > REDUCED
    return far == 0


@part
def sine(r: FloatArray, to: int, a: int, width: int) -> None:
    """The sine of a register."""
    if not are_reduced(r, a, width):
        for i in range(width):
            r[to, i] = math.sin(r[a, i])
        return
    for i in range(width):
        x = r[a, i]
        z = x * x
        p = S2 + z * (S3 + z * (S4 + z * (S5 + z * S6)))
        r[to, i] = x + z * x * (S1 + z * p)


@part
def cosine(r: FloatArray, to: int, a: int, width: int) -> None:
    """The cosine of a register; 1 - z/2 with what rounding took from it."""
    if not are_reduced(r, a, width):
        for i in range(width):
            r[to, i] = math.cos(r[a, i])
        return
    for i in range(width):
        z = r[a, i] * r[a, i]
        p = C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * C6))))
        half = 0.5 * z
        most = 1.0 - half
        r[to, i] = most + (((1.0 - most) - half) + z * (z * p))


@part
def carry_out(  # noqa: PLR0912, PLR0913, PLR0917 - a call for each step would cost as much as it
    steps: Steps,
    addresses: Addresses,
    planes: FloatArray,
    reals: FloatArray,
    start: int,
    width: int,
    r: FloatArray,
) -> None:
    """All steps for the variants of one block: data into registers, calculation, registers into results.

    Arguments: `addresses` of the data, by leaf; complex results (P, N, 2) and real ones (Q, N); the
    block's first variant and how many it has; the registers (R, block).
    """
    for step in range(steps.shape[0]):
        op, to = steps[step, 0], steps[step, 1]
        a, b, c, d = steps[step, 2], steps[step, 3], steps[step, 4], steps[step, 5]
        if op == LOAD:
            data = numba.carray(floats_at(addresses[a]), (start + width,), np.float64)
            for i in range(width):
                r[to, i] = data[start + i]
        elif op == LOAD_PART:
            pairs = numba.carray(floats_at(addresses[a]), (start + width, 2), np.float64)
            for i in range(width):
                r[to, i] = pairs[start + i, b]
        elif op == LOAD_SHARED:
            number = numba.carray(floats_at(addresses[a]), (2,), np.float64)[b]
            for i in range(width):
                r[to, i] = number
        elif op == STORE:
            for i in range(width):
                reals[to, start + i] = r[a, i]
        elif op == STORE_PLANE:
            for i in range(width):
                planes[to, start + i, 0] = r[a, i]
                planes[to, start + i, 1] = r[b, i]
        elif op == ADD:
            for i in range(width):
                r[to, i] = r[a, i] + r[b, i]
        elif op == SUB:
            for i in range(width):
                r[to, i] = r[a, i] - r[b, i]
        elif op == MUL:
            for i in range(width):
                r[to, i] = r[a, i] * r[b, i]
        elif op == DIV:
            for i in range(width):
                r[to, i] = r[a, i] / r[b, i]
        elif op == MUL_ADD:
            for i in range(width):
                r[to, i] = r[a, i] * r[b, i] + r[c, i]
        elif op == MUL_SUB:
            for i in range(width):
                r[to, i] = r[a, i] * r[b, i] - r[c, i]
        elif op == SUB_MUL:
            for i in range(width):
                r[to, i] = r[c, i] - r[a, i] * r[b, i]
        elif op == CROSS:
            for i in range(width):
                r[to, i] = r[a, i] * r[b, i] - r[c, i] * r[d, i]
        elif op == DOT:
            for i in range(width):
                r[to, i] = r[a, i] * r[b, i] + r[c, i] * r[d, i]
        elif op == ROOT:
            for i in range(width):
                r[to, i] = math.sqrt(r[a, i])
        elif op == ABS:
            for i in range(width):
                r[to, i] = abs(r[a, i])
        elif op == LARGER:
            for i in range(width):
                x, y = r[a, i], r[b, i]
                r[to, i] = x if x > y or x != x else y  # noqa: PLR0124 - only nan differs from itself
        elif op == NEAREST:
            for i in range(width):
                r[to, i] = rint(r[a, i])
        elif op == SINE:
            sine(r, to, a, width)
        elif op == COSINE:
            cosine(r, to, a, width)


@compiled
def run(
    program: tuple[Steps, Steps, FloatArray],
    addresses: Addresses,
    planes: FloatArray,
    reals: FloatArray,
    r: FloatArray,
) -> None:
    """Carry out a program: constants, once what all variants share, then block after block."""
    once, each, constants = program
    count, block = reals.shape[1], r.shape[1]
    for place in range(constants.shape[0]):
        for i in range(block):
            r[place, i] = constants[place]
    carry_out(once, addresses, planes, reals, 0, block, r)
    for start in range(0, count, block):
        carry_out(each, addresses, planes, reals, start, min(block, count - start), r)
