"""Motion in 50 digits by an independent road: the closure equations, differentiated.

Positions solve the equations of the links' lengths, (N - P).(N - P) = l^2, by Newton's method;
velocities and accelerations solve the same equations differentiated once and twice. Data are taken
from the authored file in decimal, so that rounding of the data themselves counts as an error too.
Nothing of `reference.motion` is used but its position, where Newton starts: it names the branch.
"""

import ast
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mpmath import mp, mpf

from reference.assignment import Assignment, Variant
from reference.authored import (
    DyadTable,
    MechanismFile,
    PlateTable,
    PointOnLineTable,
    SliderTable,
)
from reference.construction import Vector
from reference.formula import Formula
from reference.motion import move

DIGITS = 50
CONVERGED = mpf(10) ** -45
SAME_BRANCH = 1e-9
"""How far, relative to the mechanism, the double-precision start may be from the root."""
MAX_STEPS = 12

Pair = tuple[Any, Any]
"""x and y, 50 digits."""
_UNITS = {"m": 1, "cm": 100, "mm": 1000}


@dataclass(slots=True)
class ExactMotion:
    """Positions, velocities and accelerations of the joints, SI, 50 digits."""

    position: dict[str, Pair] = field(default_factory=dict)
    velocity: dict[str, Pair] = field(default_factory=dict)
    acceleration: dict[str, Pair] = field(default_factory=dict)

    def vector(self, vector: Vector) -> complex:
        """A named vector of the plans, rounded once at the end."""
        kind, _, part = vector.name.partition("_")
        rates = self.velocity if kind == "v" else self.acceleration
        if vector.link is None:
            return _rounded(rates[part])
        tail, head = vector.link
        relative = _minus(rates[head], rates[tail])
        if part.endswith(("_n", "_t")):
            normal = self._normal(tail, head)
            relative = normal if part.endswith("_n") else _minus(relative, normal)
        return _rounded(relative)

    def rate(self, vector: Vector) -> float:
        """The angular velocity or acceleration of the link that a vector turns."""
        tail, head = vector.link or ("", "")
        rates = self.velocity if vector.name.startswith("v") else self.acceleration
        arm = _minus(self.position[head], self.position[tail])
        return float(_cross(arm, _minus(rates[head], rates[tail])) / _dot(arm, arm))

    def _normal(self, tail: str, head: str) -> Pair:
        arm = _minus(self.position[head], self.position[tail])
        relative = _minus(self.velocity[head], self.velocity[tail])
        share = -_dot(relative, relative) / _dot(arm, arm)
        return arm[0] * share, arm[1] * share


@dataclass(slots=True)
class _Row:
    """One equation of a node: its gradient, its residual, and what its derivatives ask for."""

    gradient: Pair
    residual: Any
    velocity: Any
    acceleration: Any = 0


def exact_motion(assignment: Assignment, variant: Variant) -> ExactMotion:
    """The motion of one variant in 50 digits.

    Raises ArithmeticError where Newton's method does not converge to the branch of the closed form.
    """
    values = _values(assignment, variant)
    start = move(assignment.mechanism([variant]), accelerations=False).position
    places = {joint: (mpf(float(z[0].real)), mpf(float(z[0].imag))) for joint, z in start.items()}
    with mp.workdps(DIGITS):
        return _solve(assignment.mechanism_file, values, places)


def _values(assignment: Assignment, variant: Variant) -> dict[str, Any]:
    known: dict[str, Any] = {
        name: mpf(number)
        for name, number in (("n", variant.n), ("position", variant.position))
        if number is not None
    }
    with mp.workdps(DIGITS):
        for name, formula in assignment.file.variant.values.items():
            known[name] = _number(formula.tree, known)
    return known


def _solve(file: MechanismFile, values: Mapping[str, Any], start: Mapping[str, Pair]) -> ExactMotion:
    motion = ExactMotion()
    unit = _UNITS[file.length_unit]

    def number(formula: Formula) -> Any:  # noqa: ANN401 - mpf has no types
        return _number(formula.tree, values)

    for joint, (x, y) in file.ground.items():
        motion.position[joint] = number(x) / unit, number(y) / unit
        motion.velocity[joint] = motion.acceleration[joint] = (mpf(0), mpf(0))
    _drive(motion, file, values)
    for group in file.group:
        _assemble(motion, group, number, unit, start[group.node])
    return motion


def _drive(motion: ExactMotion, file: MechanismFile, values: Mapping[str, Any]) -> None:
    crank = file.crank
    length = _number(crank.length.tree, values) / _UNITS[file.length_unit]
    angle = _number(crank.angle_deg.tree, values) * mp.pi / 180
    omega = _number(crank.omega.tree, values)
    epsilon = mpf(0) if crank.epsilon is None else _number(crank.epsilon.tree, values)
    x, y = length * mp.cos(angle), length * mp.sin(angle)
    x0, y0 = motion.position[crank.pivot]
    motion.position[crank.pin] = x0 + x, y0 + y
    motion.velocity[crank.pin] = -omega * y, omega * x
    motion.acceleration[crank.pin] = -epsilon * y - omega**2 * x, epsilon * x - omega**2 * y


def _assemble(motion: ExactMotion, group: Any, number: Any, unit: int, start: Pair) -> None:  # noqa: ANN401
    """Newton for the node's place, then the differentiated equations for its rates."""
    node, place = group.node, start
    motion.velocity[node] = motion.acceleration[node] = (mpf(0), mpf(0))
    for _ in range(MAX_STEPS):
        motion.position[node] = place
        first, second = _rows(motion, group, number, unit)
        step = _solve_2x2(first, second, -first.residual, -second.residual)
        place = place[0] + step[0], place[1] + step[1]
        if mp.hypot(*step) < CONVERGED:
            break
    else:
        raise ArithmeticError(f"Newton's method does not converge at {node}")
    size = max(mp.hypot(*_minus(place, other)) for other in motion.position.values())
    if mp.hypot(*_minus(place, start)) > SAME_BRANCH * max(size, mpf(1) / unit):
        raise ArithmeticError(f"{node} converged to another branch")
    motion.position[node] = place
    first, second = _rows(motion, group, number, unit)
    motion.velocity[node] = _solve_2x2(first, second, first.velocity, second.velocity)
    first, second = _rows(motion, group, number, unit)
    motion.acceleration[node] = _solve_2x2(first, second, first.acceleration, second.acceleration)


def _rows(motion: ExactMotion, group: Any, number: Any, unit: int) -> tuple[_Row, _Row]:  # noqa: ANN401
    match group:
        case DyadTable(pins=pins):
            lengths = [number(length) / unit for length in group.lengths]
            return _link(motion, group.node, pins[0], lengths[0]), _link(
                motion, group.node, pins[1], lengths[1]
            )
        case PlateTable(base=base):
            lengths = [number(length) / unit for length in group.lengths]
            ratio = _ratio_in_line(motion, base, lengths)
            if ratio is not None:
                return _divided(motion, group.node, base, ratio)
            return _link(motion, group.node, base[0], lengths[0]), _link(
                motion, group.node, base[1], lengths[1]
            )
        case PointOnLineTable(base=base):
            return _divided(motion, group.node, base, number(group.ratio))
        case SliderTable(pin=pin):
            rod = _link(motion, group.node, pin, number(group.length) / unit)
            return rod, _guided(motion, group, number, unit)
    raise AssertionError(f"an unknown group {group!r}")


def _link(motion: ExactMotion, node: str, pin: str, length: Any) -> _Row:  # noqa: ANN401
    """u.u = l^2 with u = N - P; u.(v_N - v_P) = 0; u.(a_N - a_P) = -(v_N - v_P).(v_N - v_P)."""
    arm = _minus(motion.position[node], motion.position[pin])
    relative = _minus(motion.velocity[node], motion.velocity[pin])
    return _Row(
        arm,
        (_dot(arm, arm) - length**2) / 2,
        _dot(arm, motion.velocity[pin]),
        _dot(arm, motion.acceleration[pin]) - _dot(relative, relative),
    )


def _guided(motion: ExactMotion, group: SliderTable, number: Any, unit: int) -> _Row:  # noqa: ANN401
    angle = number(group.guide.angle_deg) * mp.pi / 180
    across = -mp.sin(angle), mp.cos(angle)
    through = number(group.guide.through[0]) / unit, number(group.guide.through[1]) / unit
    return _Row(across, _dot(across, _minus(motion.position[group.node], through)), mpf(0), mpf(0))


def _divided(motion: ExactMotion, node: str, base: list[str], ratio: Any) -> tuple[_Row, _Row]:  # noqa: ANN401
    """N = (1 - t) P + t Q, and so for both derivatives."""
    told = []
    for rates in (motion.position, motion.velocity, motion.acceleration):
        (px, py), (qx, qy) = rates[base[0]], rates[base[1]]
        told.append((px + ratio * (qx - px), py + ratio * (qy - py)))
    here = motion.position[node]
    return (
        _Row((mpf(1), mpf(0)), here[0] - told[0][0], told[1][0], told[2][0]),
        _Row((mpf(0), mpf(1)), here[1] - told[0][1], told[1][1], told[2][1]),
    )


def _ratio_in_line(motion: ExactMotion, base: list[str], lengths: list[Any]) -> Any:  # noqa: ANN401
    """Where a flat plate's point divides its base; None for a plate that is a triangle."""
    span = mp.hypot(*_minus(motion.position[base[1]], motion.position[base[0]]))
    first, second = lengths
    for gap, ratio in (
        (span - first - second, first / span),
        (first - span - second, first / span),
        (second - span - first, -first / span),
    ):
        if abs(gap) < CONVERGED ** mpf("0.5") * span:
            return ratio
    return None


def _solve_2x2(first: _Row, second: _Row, p: Any, q: Any) -> Pair:  # noqa: ANN401
    (a, b), (c, d) = first.gradient, second.gradient
    area = a * d - b * c
    return (p * d - b * q) / area, (a * q - c * p) / area


def _number(node: ast.expr, values: Mapping[str, Any]) -> Any:  # noqa: ANN401
    """A formula of an authored file in 50 digits; decimals are taken as they are written."""
    match node:
        case ast.Constant(value=value):
            return mpf(repr(value))
        case ast.Name(id="pi"):
            return +mp.pi
        case ast.Name(id=name):
            return values[name]
        case ast.UnaryOp(op=operator, operand=operand):
            inner = _number(operand, values)
            return -inner if isinstance(operator, ast.USub) else inner
        case ast.Call(func=ast.Name(id=function), args=[argument]):
            functions = {"abs": mp.fabs}
            return functions.get(function, getattr(mp, function))(_number(argument, values))
        case ast.BinOp(left=left, op=operator, right=right):
            x, y = _number(left, values), _number(right, values)
            match operator:
                case ast.Add():
                    return x + y
                case ast.Sub():
                    return x - y
                case ast.Mult():
                    return x * y
                case ast.Div():
                    return x / y
                case ast.Mod():
                    return x % y
                case ast.Pow():
                    return x**y
    raise AssertionError(f"an unchecked node {node!r}")


def _minus(p: Pair, q: Pair) -> Pair:
    return p[0] - q[0], p[1] - q[1]


def _dot(p: Pair, q: Pair) -> Any:  # noqa: ANN401
    return p[0] * q[0] + p[1] * q[1]


def _cross(p: Pair, q: Pair) -> Any:  # noqa: ANN401
    return p[0] * q[1] - p[1] * q[0]


def _rounded(pair: Pair) -> complex:
    return complex(float(pair[0]), float(pair[1]))
