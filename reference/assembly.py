"""From an authored mechanism file to a mechanism with numbers."""

from collections.abc import Iterator, Mapping
from itertools import permutations

import numpy as np

from reference.authored import (
    LENGTH_UNITS_M,
    DyadTable,
    MechanismFile,
    PlateTable,
    PointOnLineTable,
    SliderTable,
)
from reference.errors import Finding
from reference.formula import Formula, FormulaError, Value
from reference.geometry import ComplexArray, FloatArray
from reference.mechanism import Crank, Dyad, Group, Mechanism, Plate, PointOnLine, Slider

IN_LINE_TOLERANCE = 1e-9
"""Relative: lengths that sum up this nearly are meant to be in line."""

LARGEST = 1e9
SHORTEST_M = 1e-9
"""No number of an authored file is larger, no length shorter: their squares then neither over- nor
underflow."""

SIDES = {"left": 1, "right": -1, "ahead": 1, "behind": -1}


def check_mechanism(file: MechanismFile) -> Iterator[Finding]:
    """What the file's own form cannot show: joints not yet placed, placed twice, bases of two links."""
    placed = {*file.ground}
    rigid: dict[str, set[str]] = {}
    if file.crank.pivot not in file.ground:
        yield Finding("$.crank.pivot", _unknown(file.crank.pivot, set(file.ground), "a ground pivot"))
    if file.crank.pin in placed:
        yield Finding("$.crank.pin", f"{file.crank.pin} is a ground pivot already")
    placed.add(file.crank.pin)
    rigid[file.crank.link] = {file.crank.pivot, file.crank.pin}
    for index, group in enumerate(file.group):
        where = f"$.group[{index}]"
        for key, pin in _pins(group):
            if pin not in placed:
                yield Finding(f"{where}.{key}", _unknown(pin, placed, "placed above"))
        if group.node in placed:
            yield Finding(f"{where}.node", f"{group.node} has a place already: over-constrained")
        placed.add(group.node)
        yield from _check_rigid(group, rigid, where)
    yield from _read_alike(placed)
    lower = [joint.lower() for joint in placed]
    for joint in sorted(placed):
        if lower.count(joint.lower()) > 1:
            yield Finding("$", f"joint {joint}: another one has the same letters in another case")


def _read_alike(joints: set[str]) -> Iterator[Finding]:
    """Names that run together: v_BA is B about A, so no third joint may be called BA."""
    read_as: dict[str, tuple[str, ...]] = {joint: (joint,) for joint in sorted(joints)}
    for first, second in permutations(sorted(joints), 2):
        other = read_as.setdefault(first + second, (first, second))
        if other != (first, second):
            told = f"{first + second} would mean both {' about '.join(other)} and {first} about {second}"
            yield Finding("$", f"joints {', '.join(sorted({*other, first, second}))}: {told}; rename one")


def _pins(group: DyadTable | SliderTable | PlateTable | PointOnLineTable) -> list[tuple[str, str]]:
    match group:
        case DyadTable():
            return [("pins[0]", group.pins[0]), ("pins[1]", group.pins[1])]
        case SliderTable():
            return [("pin", group.pin)]
        case _:
            return [("base[0]", group.base[0]), ("base[1]", group.base[1])]


def _check_rigid(
    group: DyadTable | SliderTable | PlateTable | PointOnLineTable, rigid: dict[str, set[str]], where: str
) -> Iterator[Finding]:
    """Plates and points on a line need a base that is one link."""
    match group:
        case DyadTable():
            if group.pins[0] == group.pins[1]:
                yield Finding(f"{where}.pins", "the two pins must be different joints")
            for index, (pin, link) in enumerate(zip(group.pins, group.links, strict=True)):
                yield from _add_link(link, {pin, group.node}, rigid, f"{where}.links[{index}]")
        case SliderTable():
            yield from _add_link(group.link, {group.pin, group.node}, rigid, f"{where}.link")
        case _:
            members = rigid.setdefault(group.link, set())
            if not set(group.base) <= members or group.base[0] == group.base[1]:
                held = ", ".join(sorted(members)) or "no joints yet"
                yield Finding(f"{where}.base", f"must be two joints of link {group.link} ({held})")
            members.add(group.node)


def _add_link(link: str, joints: set[str], rigid: dict[str, set[str]], where: str) -> Iterator[Finding]:
    """A group's links are new bodies: under a name that is taken, two bodies would pass for one."""
    if link in rigid:
        yield Finding(where, f"there is a link {link} already: each link needs a name of its own")
    rigid.setdefault(link, joints)


def _unknown(joint: str, known: set[str], what: str) -> str:
    return f"{joint} is not {what}: known so far are {', '.join(sorted(known))}"


class _Numbers:
    """Formulas to arrays of shape (N,), in SI."""

    def __init__(self, values: Mapping[str, Value], count: int, unit_m: float) -> None:
        self.values, self.count, self.unit_m = values, count, unit_m

    def number(self, formula: Formula) -> FloatArray:
        numbers = np.broadcast_to(formula(self.values), (self.count,)).astype(np.float64)
        if np.any(np.abs(numbers) > LARGEST):
            raise FormulaError(f"'{formula.text}' is larger than {LARGEST:g}: beyond any mechanism")
        return numbers

    def length(self, formula: Formula, what: str) -> FloatArray:
        # Division by the unit's inverse: 30 cm is then exactly the double nearest to 0.3 m.
        lengths = self.number(formula) / round(1.0 / self.unit_m)
        if np.any(lengths <= 0.0):
            raise FormulaError(f"'{formula.text}' ({what}) must be a positive length")
        if np.any(lengths < SHORTEST_M):
            raise FormulaError(f"'{formula.text}' ({what}) is shorter than {SHORTEST_M:g} m")
        return lengths

    def point(self, point: list[Formula]) -> ComplexArray:
        x, y = (self.number(formula) / round(1.0 / self.unit_m) for formula in point)
        return np.asarray(x + 1j * y)


def build_mechanism(file: MechanismFile, values: Mapping[str, Value], count: int) -> Mechanism:
    """The mechanism of `count` variants whose data are `values` (arrays of shape (count,))."""
    numbers = _Numbers(values, count, LENGTH_UNITS_M[file.length_unit])
    crank = _crank(file, numbers)
    spans: dict[frozenset[str], FloatArray] = {frozenset((crank.pivot, crank.pin)): crank.length_m}
    ground = {joint: numbers.point(point) for joint, point in file.ground.items()}
    groups = tuple(_group(table, numbers, spans) for table in file.group)
    return Mechanism(ground, crank, groups)


def _crank(file: MechanismFile, numbers: _Numbers) -> Crank:
    table = file.crank
    zero = np.zeros(numbers.count)
    return Crank(
        link=table.link,
        pivot=table.pivot,
        pin=table.pin,
        length_m=numbers.length(table.length, "crank"),
        angle_rad=np.radians(numbers.number(table.angle_deg)),
        omega=numbers.number(table.omega),
        epsilon=zero if table.epsilon is None else numbers.number(table.epsilon),
        accelerated=table.epsilon is not None,
    )


def _group(
    table: DyadTable | SliderTable | PlateTable | PointOnLineTable,
    numbers: _Numbers,
    spans: dict[frozenset[str], FloatArray],
) -> Group:
    """One group; `spans` collects the known distances within links."""
    node = table.node
    match table:
        case DyadTable():
            first, second = (numbers.length(length, node) for length in table.lengths)
            p, q = table.pins
            spans[frozenset((p, node))], spans[frozenset((q, node))] = first, second
            links = (table.links[0], table.links[1])
            return Dyad(node, (p, q), links, (first, second), SIDES[table.side])
        case SliderTable():
            length = numbers.length(table.length, node)
            spans[frozenset((table.pin, node))] = length
            guide = numbers.point(table.guide.through)
            angle = np.radians(numbers.number(table.guide.angle_deg))
            return Slider(node, table.pin, table.link, length, guide, angle, SIDES[table.side])
        case PlateTable():
            first, second = (numbers.length(length, node) for length in table.lengths)
            p, q = table.base
            base = spans.get(frozenset((p, q)))
            ratio = None if base is None else _line_ratio(base, first, second)
            spans[frozenset((p, node))], spans[frozenset((q, node))] = first, second
            return Plate(node, (p, q), table.link, (first, second), SIDES[table.side], ratio)
        case PointOnLineTable():
            p, q = table.base
            ratio = numbers.number(table.ratio)
            base = spans.get(frozenset((p, q)))
            if base is not None:
                spans[frozenset((p, node))] = np.abs(ratio) * base
                spans[frozenset((q, node))] = np.abs(1.0 - ratio) * base
            return PointOnLine(node, (p, q), table.link, ratio)


def _line_ratio(base: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray | None:
    """Where a plate's third point lies on the line of its base, None unless always in line."""
    slack = IN_LINE_TOLERANCE * (base + first + second)
    for gap, ratio in (
        (base - first - second, first / base),
        (first - base - second, first / base),
        (second - base - first, -first / base),
    ):
        if np.all(np.abs(gap) <= slack):
            return ratio
    return None
