"""A mechanism's data in many digits: from its doubles, or from the authored file as it is written."""

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from mpmath import mp, mpf

from reference.assignment import Assignment, Variant
from reference.formula import Formula
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
    Pins,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Yoke,
)
from reference.mechanism_file import (
    CrankTable,
    DyadTable,
    FixedGuideTable,
    GuideTable,
    PlateTable,
    PointOnLineTable,
    PointTable,
    SliderTable,
    SlottedLinkTable,
    YokeTable,
)
from tests.bench.arrays import one_of

DIGITS = 60
"""50 digits of the results, and some for what near-singular positions cost."""
PER_METRE = {"m": 1, "cm": 100, "mm": 1000}


@dataclass(frozen=True, slots=True)
class LocalPoint:
    """A point of a link at x (from base[0] towards base[1]) and y (to the left), metres."""

    node: str
    base: Pins
    at: tuple[Any, Any]


@dataclass(frozen=True, slots=True)
class ExactMechanism:
    """As `Mechanism`, of one variant, every number in many digits."""

    ground_m: Mapping[str, Any]
    driver: Driver
    groups: tuple[Group | LocalPoint, ...]


def exactly(mechanism: Mechanism, index: int) -> ExactMechanism:
    """One variant of a mechanism; its doubles are taken as exact."""
    one = one_of(mechanism, index, mp.mpmathify)
    return ExactMechanism(one.ground_m, one.driver, one.groups)


def authored_exactly(assignment: Assignment, variant: Variant) -> ExactMechanism:
    """One variant of an assignment; decimals are taken as they are written.

    Which group joins what, and on which side, is taken from the assembled mechanism; every number is
    read again from the file.
    """
    file = assignment.mechanism_file
    rough = exactly(assignment.mechanism([variant]), 0)
    read = _Reader(_values(assignment, variant), PER_METRE[file.length_unit])
    ground = {joint: read.point(point) for joint, point in file.ground.items()}
    pairs = zip(rough.groups, file.group, strict=True)
    groups = tuple(_group(group, table, read) for group, table in pairs)
    driver = _driver(rough.driver, file.crank or file.driven_slider, read)
    return ExactMechanism(ground, driver, groups)


def _values(assignment: Assignment, variant: Variant) -> dict[str, Any]:
    known: dict[str, Any] = {
        name: mpf(number)
        for name, number in (("n", variant.n), ("position", variant.position))
        if number is not None
    }
    for name, formula in assignment.file.variant.values.items():
        known[name] = evaluated(formula.tree, known)
    return known


@dataclass(frozen=True, slots=True)
class _Reader:
    """Formulas to numbers of many digits, SI."""

    values: Mapping[str, Any]
    per_metre: int

    def number(self, formula: Formula) -> Any:
        return evaluated(formula.tree, self.values)

    def optional(self, formula: Formula | None) -> Any:
        return mpf(0) if formula is None else self.number(formula)

    def length(self, formula: Formula) -> Any:
        return self.number(formula) / self.per_metre

    def angle(self, formula: Formula) -> Any:
        return self.number(formula) * mp.pi / 180

    def point(self, point: list[Formula]) -> Any:
        return mp.mpc(self.length(point[0]), self.length(point[1]))

    def guide(self, guide: Guide, table: GuideTable | FixedGuideTable) -> Guide:
        """A fixed guide's numbers; a moving one has none."""
        if not isinstance(guide, FixedGuide) or table.through is None or table.angle_deg is None:
            return guide
        return FixedGuide(self.point(table.through), self.angle(table.angle_deg))


def _driver(driver: Driver, table: Any, read: _Reader) -> Driver:
    if isinstance(driver, Crank):
        return replace(
            driver,
            length_m=read.length(table.length),
            angle_rad=read.angle(table.angle_deg),
            omega=_speed(table, read),
            epsilon=read.optional(table.epsilon),
        )
    return DrivenSlider(
        driver.link,
        driver.pin,
        read.point(table.guide.through),
        read.angle(table.guide.angle_deg),
        read.length(table.displacement),
        read.length(table.speed),
        read.optional(table.acceleration) / read.per_metre,
    )


def _speed(table: CrankTable, read: _Reader) -> Any:
    if table.rpm is None:
        return read.optional(table.omega)
    ratio = mpf(1) if table.gear_ratio is None else read.number(table.gear_ratio)
    return mp.pi * read.number(table.rpm) / (30 * ratio)


def _group(group: Group | LocalPoint, table: Any, read: _Reader) -> Group | LocalPoint:
    match group, table:
        case Dyad() | Plate(), DyadTable() | PlateTable():
            first, second = (read.length(length) for length in table.lengths)
            return replace(group, lengths_m=(first, second))
        case Slider(), SliderTable():
            guide = read.guide(group.guide, table.guide)
            return replace(group, length_m=read.length(table.length), guide=guide)
        case SlottedLink(), SlottedLinkTable():
            return replace(group, offset_m=read.optional(table.offset) / read.per_metre)
        case CrossSlider(), _:
            first_guide, second_guide = map(read.guide, group.guides, table.guides)
            return replace(group, guides=(first_guide, second_guide))
        case Yoke(), YokeTable():
            fixed = FixedGuide(read.point(table.guide.through), read.angle(table.guide.angle_deg))
            return Yoke(group.node, group.pin, read.angle(table.slot_deg), fixed)
        case SlotPoint(), PointTable():
            return replace(group, local_m=read.point(table.at))
        case _, PointTable():
            at = read.point(table.at)
            return LocalPoint(group.node, (table.base[0], table.base[1]), (at.real, at.imag))
        case PointOnLine(), PointOnLineTable():
            return replace(group, ratio=read.number(table.ratio))
    raise AssertionError(f"an unknown group {group!r}")


_OPERATORS: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda x, y: x + y,
    ast.Sub: lambda x, y: x - y,
    ast.Mult: lambda x, y: x * y,
    ast.Div: lambda x, y: x / y,
    ast.Mod: lambda x, y: x % y,
    ast.Pow: lambda x, y: x**y,
}


def evaluated(node: ast.expr, values: Mapping[str, Any]) -> Any:
    """A formula of an authored file; decimals are taken as they are written."""
    match node:
        case ast.Constant(value=value):
            return mpf(repr(value))
        case ast.Name(id="pi"):
            return +mp.pi
        case ast.Name(id=name):
            return values[name]
        case ast.UnaryOp(op=operator, operand=operand):
            inner = evaluated(operand, values)
            return -inner if isinstance(operator, ast.USub) else inner
        case ast.Call(func=ast.Name(id=function), args=[argument]):
            return getattr(mp, {"abs": "fabs"}.get(function, function))(evaluated(argument, values))
        case ast.BinOp(left=left, op=operator, right=right):
            return _OPERATORS[type(operator)](evaluated(left, values), evaluated(right, values))
    raise AssertionError(f"an unchecked node {node!r}")
