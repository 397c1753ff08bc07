"""Numbers that only note what is done with them: the calculation as steps on real numbers.

Equal steps are noted once. What is known beforehand (Python's own floats) is calculated at once; sums
with nothing and products with nothing or one disappear.
"""

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, cast

from reference.numbers import Noted


class Op(IntEnum):
    """What a step does with its operands a, b (c, d)."""

    INPUT = 0
    CONSTANT = 1
    ADD = 2
    SUB = 3
    MUL = 4
    DIV = 5
    MUL_ADD = 6
    """a b + c"""
    MUL_SUB = 7
    """a b - c"""
    SUB_MUL = 8
    """c - a b"""
    CROSS = 9
    """a b - c d"""
    DOT = 10
    """a b + c d"""
    ROOT = 11
    ABS = 12
    LARGER = 13
    NEAREST = 14
    SINE = 15
    COSINE = 16
    LOAD = 17
    LOAD_PART = 18
    LOAD_SHARED = 19
    STORE = 20
    STORE_PLANE = 21


Node = tuple[Any, ...]
"""An operation and its operands, indices of earlier nodes; ``(INPUT, leaf, part)``, ``(CONSTANT, x)``."""


@dataclass(slots=True)
class Notes:
    """All that has been calculated so far, each thing once."""

    nodes: list[Node] = field(default_factory=list)
    known: dict[Node, int] = field(default_factory=dict)

    def index(self, node: Node) -> int:
        """Where a node stands; it is added if it is new."""
        if node not in self.known:
            self.known[node] = len(self.nodes)
            self.nodes.append(node)
        return self.known[node]

    def operand(self, x: "Scalar") -> int:
        """The node of a number."""
        return x.index if isinstance(x, Real) else self.index((Op.CONSTANT, float(x)))

    def real(self, op: Op, *operands: "Scalar") -> "Real":
        """A new number from others."""
        places = [self.operand(x) for x in operands]
        if op is Op.ADD or op is Op.MUL:
            places.sort()
        return Real(self, self.index((op, *places)))


class _Arithmetic:
    """Sums, differences and products of real and complex numbers alike."""

    __slots__ = ()

    def __add__(self, other: "Number") -> "Number":
        return _sum(cast("Number", self), other)

    __radd__ = __add__

    def __sub__(self, other: "Number") -> "Number":
        return _difference(cast("Number", self), other)

    def __rsub__(self, other: "Number") -> "Number":
        return _difference(other, cast("Number", self))

    def __mul__(self, other: "Number") -> "Number":
        return _product(cast("Number", self), other)

    __rmul__ = __mul__


@dataclass(frozen=True, slots=True, eq=False)
class Real(_Arithmetic, Noted):
    """A real number that notes what is done with it."""

    notes: Notes
    index: int

    def root(self) -> "Real":
        """Its square root."""
        return self.notes.real(Op.ROOT, self)

    def sine(self) -> "Real":
        """Its sine."""
        return self.notes.real(Op.SINE, self)

    def cosine(self) -> "Real":
        """Its cosine."""
        return self.notes.real(Op.COSINE, self)

    def nearest(self) -> "Real":
        """The nearest whole number."""
        return self.notes.real(Op.NEAREST, self)

    def larger(self, other: "Scalar") -> "Real":
        """The larger of two."""
        return self.notes.real(Op.LARGER, self, other)

    def __abs__(self) -> "Real":
        return self.notes.real(Op.ABS, self)

    def __neg__(self) -> "Scalar":
        op, *operands = self.notes.nodes[self.index]
        if op is Op.SUB:
            return Real(self.notes, self.notes.index((op, *reversed(operands))))
        return _times(-1.0, self)

    def __truediv__(self, other: "Scalar") -> "Scalar":
        return _over(self, other)

    def __rtruediv__(self, other: "Scalar") -> "Scalar":
        return _over(other, self)

    def __pow__(self, exponent: int) -> "Scalar":
        if exponent != 2:
            raise ValueError(f"a power of {exponent}: only squares are noted")
        return _times(self, self)


@dataclass(frozen=True, slots=True, eq=False)
class Plane(_Arithmetic):
    """A complex number of two such; known parts are plain floats."""

    real: "Scalar"
    imag: "Scalar"

    def conjugate(self) -> "Plane":
        """Mirrored in the real axis."""
        return Plane(self.real, -self.imag)

    def __abs__(self) -> "Scalar":
        square = _plus(_times(self.real, self.real), _times(self.imag, self.imag))
        return square.root() if isinstance(square, Real) else square**0.5

    def __neg__(self) -> "Plane":
        return Plane(-self.real, -self.imag)

    def __truediv__(self, other: "Scalar") -> "Plane":
        return Plane(_over(self.real, other), _over(self.imag, other))


Scalar = Real | float
Number = Real | Plane | complex
"""Python's own numbers are among them: what is known beforehand."""


def _plus(x: Scalar, y: Scalar) -> Scalar:
    if isinstance(x, Real):
        return x if _is(y, 0.0) else x.notes.real(Op.ADD, x, y)
    return _plus(y, x) if isinstance(y, Real) else x + y


def _minus(x: Scalar, y: Scalar) -> Scalar:
    if isinstance(x, Real):
        return x if _is(y, 0.0) else x.notes.real(Op.SUB, x, y)
    if isinstance(y, Real):
        return -y if x == 0.0 else y.notes.real(Op.SUB, x, y)
    return x - y


def _times(x: Scalar, y: Scalar) -> Scalar:
    """The product; nothing times anything is nothing: the other part of a complex number tells of nan."""
    if isinstance(x, Real):
        if _is(y, 0.0):
            return 0.0
        return x if _is(y, 1.0) else x.notes.real(Op.MUL, x, y)
    return _times(y, x) if isinstance(y, Real) else x * y


def _over(x: Scalar, y: Scalar) -> Scalar:
    for number in (x, y):
        if isinstance(number, Real):
            return number.notes.real(Op.DIV, x, y)
    return cast("float", x) / cast("float", y)


def _is(x: Scalar, number: float) -> bool:
    return not isinstance(x, Real) and x == number


def parts_of(x: Number) -> tuple[Scalar, Scalar]:
    """Real and imaginary part."""
    return (x, 0.0) if isinstance(x, Real) else (x.real, x.imag)


def _number(real: Scalar, imag: Scalar, *made_of: Number) -> Number:
    """A complex number, or a real one where it is made of such."""
    if any(isinstance(x, Plane | complex) for x in made_of):
        return Plane(real, imag)
    return real


def _sum(x: Number, y: Number) -> Number:
    (a, b), (c, d) = parts_of(x), parts_of(y)
    return _number(_plus(a, c), _plus(b, d), x, y)


def _difference(x: Number, y: Number) -> Number:
    (a, b), (c, d) = parts_of(x), parts_of(y)
    return _number(_minus(a, c), _minus(b, d), x, y)


def _product(x: Number, y: Number) -> Number:
    (a, b), (c, d) = parts_of(x), parts_of(y)
    real = _minus(_times(a, c), _times(b, d))
    return _number(real, _plus(_times(a, d), _times(b, c)), x, y)
