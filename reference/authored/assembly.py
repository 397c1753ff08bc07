"""From an authored mechanism file to a mechanism with numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from reference.authored.formula import Formula, FormulaError, Value
from reference.authored.mechanism import (
    AnyGroupTable,
    CrankTable,
    CrossSliderTable,
    CylinderTable,
    DyadTable,
    GuideTable,
    MechanismFile,
    PlateTable,
    PointOnLineTable,
    PointTable,
    SliderTable,
    SlottedLinkTable,
    TriadTable,
)
from reference.authored.toml_file import LENGTH_UNITS_M, SideText
from reference.errors import nearest
from reference.geometry import ComplexArray, FloatArray, cross, dot
from reference.kinematics import assur
from reference.mechanism import (
    Array,
    Crank,
    CrossSlider,
    Driver,
    DrivingSlider,
    Dyad,
    FixedGuide,
    Group,
    Guide,
    Mechanism,
    MovingGuide,
    Plate,
    PointOnLine,
    Side,
    Slider,
    SlotPoint,
    SlottedLink,
    Triad,
    Yoke,
    with_arrays,
)

IN_LINE_TOLERANCE = 1e-9
"""Relative tolerance: lengths that sum up this closely are meant to be in line."""

LEAST_SINE = 1e-6
"""Sine of the angle between a driving cylinder and its crank; below it the two are in line."""
LARGEST = 1e9
SHORTEST_M = 1e-9
"""No number of an authored file is larger, no length shorter: their squares then neither over- nor
underflow."""


class Numbers:
    """Evaluates formulas to arrays in SI, of shape (N,) or, if they do not depend on the variant, (1,)."""

    def __init__(self, values: Mapping[str, Value], count: int, unit_m: float) -> None:
        self.values, self.count, self.unit_m = values, count, unit_m

    def number(self, formula: Formula) -> FloatArray:
        """Return a number as written; raises FormulaError for one beyond any mechanism."""
        numbers = formula(self.values)
        if np.abs(numbers).max(initial=0.0) > LARGEST:
            raise FormulaError("limit", np.abs(numbers) > LARGEST, text=formula.text, limit=f"<= {LARGEST:g}")
        return numbers if numbers.ndim else numbers[None]

    def length(self, formula: Formula, what: str) -> FloatArray:
        """Return a length above zero, m; raises FormulaError, which calls it `what`, for any other."""
        lengths = self.distance(formula)
        for limit, is_short in (("> 0", lengths <= 0.0), (f">= {SHORTEST_M:g} m", lengths < SHORTEST_M)):
            if np.any(is_short):
                raise FormulaError("limit", is_short, text=formula.text, name=what, limit=limit)
        return lengths

    def distance(self, formula: Formula) -> FloatArray:
        """Return a length with a sign, m."""
        # Division by the unit's inverse: 30 cm is then exactly the double nearest to 0.3 m.
        return np.asarray(self.number(formula) / round(1.0 / self.unit_m))

    def amount(self, formula: Formula, what: str) -> FloatArray:
        """Return a number that is not negative; raises FormulaError, which calls it `what`, for any other."""
        numbers = self.number(formula)
        if np.any(numbers < 0.0):
            raise FormulaError("limit", numbers < 0.0, text=formula.text, name=what, limit=">= 0")
        return numbers

    def angle(self, formula: Formula) -> FloatArray:
        """Return an angle given in degrees in radians."""
        return np.asarray(np.radians(self.number(formula)))

    def side(self, text: SideText) -> Side:
        """Return +1 or -1; for a formula an array, whether or not it differs between these variants."""
        if isinstance(text.side, int):
            return text.side
        first, second = text.words
        known = {"text": text.side.text, "first": first, "second": second}
        unknown = text.side.names - self.values.keys()
        if unknown:
            raise FormulaError("side_unknown", **known, **nearest(min(unknown), self.values, 2))
        signs = np.sign(self.number(text.side))
        if np.any(signs == 0.0):
            raise FormulaError("side_zero", signs == 0.0, **known)
        return signs

    def point(self, point: list[Formula]) -> ComplexArray:
        """Return coordinates, m, as x + iy."""
        x, y = (self.distance(formula) for formula in point)
        return np.asarray(x + 1j * y)

    def for_all(self, numbers: Array) -> Array:
        """Return an array of shape (N,), read only; a number that all variants share is stored once."""
        if numbers.size != 1 or self.count == 1:
            return numbers
        shared = np.ndarray((self.count,), numbers.dtype, numbers, strides=(0,))
        shared.flags.writeable = False
        return shared


@dataclass(slots=True)
class _LinkAxes:
    """Joints of each link in the link's own axes, metres; and the slotted links."""

    axes: dict[str, dict[str, ComplexArray]] = field(default_factory=dict)
    slots: dict[str, str] = field(default_factory=dict)
    """Node of each slotted link."""

    def carry(self, link: str, origin: str, joint: str, length: FloatArray) -> None:
        """Add a new link from its origin to a joint, along its own x axis."""
        self.axes[link] = {origin: np.zeros(np.shape(length), complex), joint: np.asarray(length + 0j)}

    def link_of(self, joints: tuple[str, str]) -> str:
        """The link that carries both joints."""
        return next(link for link, held in self.axes.items() if set(joints) <= held.keys())


def build_mechanism(file: MechanismFile, values: Mapping[str, Value], count: int) -> Mechanism:
    """Return the mechanism of `count` variants whose data are `values` (arrays of shape (count,)).

    Raises FormulaError for a number or length that no mechanism can have. The file must have passed
    `reference.authored.mechanism.check_mechanism`.
    """
    numbers = Numbers(values, count, LENGTH_UNITS_M[file.length_unit])
    bodies = _LinkAxes()
    driver = _driver(file, numbers)
    if isinstance(driver, Crank):
        bodies.carry(driver.link, driver.pivot, driver.pin, driver.length_m)
    ground = {joint: numbers.point(point) for joint, point in file.ground.items()}
    groups_ = (_located(index, table, numbers, bodies) for index, table in file.in_order)
    mechanism: Mechanism = with_arrays(Mechanism(ground, driver, tuple(groups_)), numbers.for_all)
    return mechanism


def build_driver(file: MechanismFile, values: Mapping[str, Value], count: int) -> Driver:
    """Return the driving link alone, as `build_mechanism` makes it."""
    numbers = Numbers(values, count, LENGTH_UNITS_M[file.length_unit])
    driver: Driver = with_arrays(_driver(file, numbers), numbers.for_all)
    return driver


def _located(index: int, table: AnyGroupTable, numbers: Numbers, bodies: _LinkAxes) -> Group:
    """Return one group; an error in its numbers names its place in the file."""
    try:
        return _group(table, numbers, bodies)
    except FormulaError as error:
        error.path = f".group[{index}]"
        raise


def _driver(file: MechanismFile, numbers: Numbers) -> Driver:
    zero, table = np.zeros(1), file.driver
    if isinstance(table, CrankTable) and table.cylinder is not None:
        return _by_cylinder(table, table.cylinder, file, numbers)
    if isinstance(table, CrankTable):
        rpm = None if table.rpm is None else numbers.number(table.rpm)
        ratio = None if table.gear_ratio is None else numbers.number(table.gear_ratio)
        return Crank(
            link=table.link,
            pivot=table.pivot,
            pin=table.pin,
            length_m=numbers.length(table.length, "crank"),
            angle_rad=numbers.angle(cast("Formula", table.angle_deg)),
            omega=_omega(table, numbers, rpm, ratio),
            epsilon=zero if table.epsilon is None else numbers.number(table.epsilon),
            accelerated=table.epsilon is not None,
            rpm=rpm,
            gear_ratio=ratio,
        )
    guide = cast("FixedGuide", _guide(table.guide, numbers, _LinkAxes()))
    return DrivingSlider(
        link=table.link,
        pin=table.pin,
        guide_m=guide.through_m,
        guide_rad=guide.angle_rad,
        displacement_m=numbers.distance(table.displacement),
        speed=numbers.distance(table.speed),
        acceleration=zero if table.acceleration is None else numbers.distance(table.acceleration),
    )


def _by_cylinder(crank: CrankTable, cylinder: CylinderTable, file: MechanismFile, numbers: Numbers) -> Crank:
    """Return the crank that a cylinder drives, from the triangle of both pivots and the pin.

    With u along the cylinder and r along the crank, the pin's velocity has the component s' along u, its
    acceleration s'' - omega_cylinder^2 s.
    """
    foot, pivot = (numbers.point(file.ground[joint]) for joint in (cylinder.pivot, crank.pivot))
    arm, length = numbers.length(crank.length, "crank"), numbers.length(cylinder.length, "cylinder")
    base = pivot - foot
    with np.errstate(all="ignore"):
        along, across, sine = assur.rrr_place(base, length, arm, numbers.side(cylinder.side))
    if np.any(~(sine > LEAST_SINE)):
        least, most = np.abs(np.abs(base) - arm).max(), (np.abs(base) + arm).min()
        limits = {"least": f"{least:g}", "most": f"{most:g}"}
        raise FormulaError("cylinder_length", ~(sine > LEAST_SINE), text=cylinder.length.text, **limits)
    reach = base * (along + 1j * across)
    u, r = reach / length, reach - base
    speed = numbers.distance(cylinder.speed)
    growth = np.zeros(1) if cylinder.acceleration is None else numbers.distance(cylinder.acceleration)
    omega = -speed / cross(u, r)
    swing = cross(u, 1j * omega * r) / length
    epsilon = -(growth - swing**2 * length + omega**2 * dot(u, r)) / cross(u, r)
    slots = (table for table in file.group if isinstance(table, SlottedLinkTable))
    link = next(slot.link for slot in slots if (slot.pivot, slot.pin) == (cylinder.pivot, crank.pin))
    joints = (crank.link, crank.pivot, crank.pin)
    return Crank(*joints, arm, np.angle(r), omega, epsilon, accelerated=True, cylinder=link)


def _omega(
    crank: CrankTable, numbers: Numbers, rpm: FloatArray | None, ratio: FloatArray | None
) -> FloatArray:
    """The crank's angular velocity, rad/s, directly or from rev/min through a gear."""
    if rpm is None:
        return numbers.number(cast("Formula", crank.omega))  # the table has one of the two
    if ratio is not None and np.any(ratio == 0.0):
        text = cast("Formula", crank.gear_ratio).text
        raise FormulaError("limit", text=text, name="gear_ratio", limit="!= 0")
    return np.asarray(np.pi * (rpm if ratio is None else rpm / ratio) / 30.0)


def _guide(guide: GuideTable, numbers: Numbers, bodies: _LinkAxes) -> Guide:
    if guide.joints is None or guide.coincident is None:
        # A table without joints has a point and a direction.
        through, angle_deg = cast("list[Formula]", guide.through), cast("Formula", guide.angle_deg)
        return FixedGuide(numbers.point(through), numbers.angle(angle_deg))
    base = (guide.joints[0], guide.joints[1])
    return MovingGuide(bodies.link_of(base), base, guide.coincident)


def _group(table: AnyGroupTable, numbers: Numbers, bodies: _LinkAxes) -> Group:
    """Return one group; `bodies` collects the joints that each link carries."""
    node = table.node
    if isinstance(table, PlateTable | PointOnLineTable | PointTable):
        return _link_point(table, numbers, bodies)
    match table:
        case DyadTable():
            (p, q), (link_p, link_q) = table.pins, table.links
            first, second = (numbers.length(length, node) for length in table.lengths)
            bodies.carry(link_p, p, node, first)
            bodies.carry(link_q, q, node, second)
            return Dyad(node, (p, q), (link_p, link_q), (first, second), numbers.side(table.side))
        case SliderTable():
            length = numbers.length(table.length, node)
            guide = _guide(table.guide, numbers, bodies)
            bodies.carry(table.link, table.pin, node, length)
            return Slider(node, table.pin, table.link, length, guide, numbers.side(table.side))
        case SlottedLinkTable():
            return _slotted_link(table, numbers, bodies)
        case CrossSliderTable():
            first_guide, second_guide = (_guide(guide, numbers, bodies) for guide in table.guides)
            return CrossSlider(node, (first_guide, second_guide))
        case TriadTable():
            return _triad(table, numbers, bodies)
        case _:
            slot = np.zeros(1) if table.slot_deg is None else numbers.angle(table.slot_deg)
            return Yoke(node, table.pin, slot, _guide(table.guide, numbers, bodies), table.link or "")


def _slotted_link(table: SlottedLinkTable, numbers: Numbers, bodies: _LinkAxes) -> SlottedLink:
    zero = np.zeros(1)
    offset = zero if table.offset is None else numbers.distance(table.offset)
    bodies.axes[table.link] = {table.pivot: np.zeros(1, complex)}
    if table.foot is not None:
        if np.any(offset == 0.0):
            raise FormulaError("offset_zero", link=table.link)
        bodies.axes[table.link][table.foot] = np.asarray(1j * offset)
    bodies.slots[table.link] = table.node
    side = numbers.side(table.side)
    return SlottedLink(table.node, table.pin, table.pivot, table.link, offset, table.foot, side)


def _triad(table: TriadTable, numbers: Numbers, bodies: _LinkAxes) -> Triad:
    (d, e, f), (a, b, c), (*legs, ternary) = table.nodes, table.pins, table.links
    first, second, third, near, across, far = (numbers.length(length, f) for length in table.lengths)
    for link, pin, node, length in zip(legs, (a, b, c), (d, e, f), (first, second, third), strict=True):
        bodies.carry(link, pin, node, length)
    side = numbers.side(table.side)
    shape = _shape(near, far, across, side)
    if np.any(flat := ~np.isfinite(shape) | (shape.imag == 0.0)):
        raise FormulaError("no_triangle", flat, names=(d, e, f))
    bodies.axes[ternary] = {d: 0.0 * shape, e: near + 0.0 * shape, f: near * shape}
    links, sides = (legs[0], legs[1], legs[2], ternary), (near, across, far)
    told = table.assur_point, links, (first, second, third), sides, side, shape
    return Triad((d, e, f), (a, b, c), *told, numbers.angle(table.angle_deg))


def _link_point(
    table: PlateTable | PointOnLineTable | PointTable, numbers: Numbers, bodies: _LinkAxes
) -> Group:
    """Return a further point of a link, rigid with its base, whichever way it is given."""
    node, link, (p, q) = table.node, table.link, table.base
    axes = bodies.axes[link]
    if isinstance(table, PointTable) and q == bodies.slots.get(link):
        axes[node] = numbers.point(table.at)
        return SlotPoint(node, q, link, axes[node])
    base = axes[q] - axes[p]
    local: ComplexArray | None = None
    match table:
        case PointOnLineTable():
            ratio = numbers.number(table.ratio)
            axes[node] = axes[p] + ratio * base
            return PointOnLine(node, (p, q), link, ratio)
        case PlateTable():
            first, second = (numbers.length(length, node) for length in table.lengths)
            side = numbers.side(table.side) if table.side else 1
            shape = _shape(np.abs(base), first, second, side)
            if table.side is None and np.any(shape.imag != 0.0):
                raise FormulaError("side_of_plate", joint=node, first=p, second=q)
        case _:
            local = numbers.point(table.at)
            shape = np.asarray(local / np.abs(base))
            if np.all(shape.imag == 0.0):
                axes[node] = axes[p] + shape * base
                return PointOnLine(node, (p, q), link, np.asarray(shape.real), np.asarray(local.real))
            sides = np.where(shape.imag < 0.0, -1, 1)
            side = sides
            first, second = np.abs(shape * base), np.abs((1.0 - shape) * base)
    axes[node] = axes[p] + shape * base
    return Plate(node, (p, q), link, (first, second), side, shape, local)


def _shape(base: FloatArray, first: FloatArray, second: FloatArray, side: Side) -> ComplexArray:
    """Return a plate's third point over its base, (C - A) / (B - A); exactly real if it is in line."""
    with np.errstate(all="ignore"):
        along, across, _ = assur.rrr_place(base + 0j, first, second, side)
        shape = np.asarray(along + 1j * across)
    slack = IN_LINE_TOLERANCE * (base + first + second)
    for gap, ratio in (
        (base - first - second, first / base),
        (first - base - second, first / base),
        (second - base - first, -first / base),
    ):
        shape = np.where(np.abs(gap) <= slack, ratio + 0j, shape)
    return shape
