"""Bodies and loads of an assignment: the tables of masses, centres and given forces, and their checks."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, Self, cast

import numpy as np
from pydantic import Field, model_validator

from reference.authored.assembly import Numbers
from reference.authored.formula import Formula
from reference.authored.mechanism import MechanismFile, PointOnLineTable, PointTable, check_mechanism
from reference.authored.toml_file import Authored, FormulaText, Joint, LinkName, Point, TwoJoints
from reference.authored.variant_table import formulas_in
from reference.errors import FaultError, Finding, Parameter, nearest
from reference.geometry import FloatArray
from reference.kinematics import assur
from reference.mechanism import (
    GROUND,
    SLIDER,
    Body,
    FixedGuide,
    Load,
    Mechanism,
    hinged_at,
    points_of,
    short_name,
    sliders_of,
    with_arrays,
)

BodyName = Annotated[str, Field(pattern=r"^(slider_)?[A-Za-z0-9]{1,6}$")]
"""A link's name; of a slider ``slider_`` and its joint, of the second one there a 2 behind it."""

Points = Mapping[str, tuple[str, ...]]
"""The joints and points fixed on each link."""


def _or_a_joint(schema: dict[str, Any]) -> None:
    """Add to a centre's schema that a joint's name may replace it."""
    schema["anyOf"] += [{"type": "string"}]


class CentreTable(Authored):
    """The centre of mass of a link: one of its joints (a name alone), or a further point.

    The point lies on the line through `base` by `ratio`, or is given by local coordinates `at`, as groups of
    type ``point_on_line`` and ``point`` have it.
    """

    joint: Joint | None = None
    base: TwoJoints | None = None
    ratio: FormulaText | None = None
    at: Point | None = None

    @model_validator(mode="before")
    @classmethod
    def _by_its_name(cls, data: Any) -> Any:  # noqa: ANN401 - not yet validated
        if not isinstance(data, str | dict):
            raise FaultError("centre_form")
        return {"joint": data} if isinstance(data, str) else data

    @model_validator(mode="after")
    def _is_given_once(self) -> Self:
        given = tuple(one is not None for one in (self.joint, self.base, self.ratio, self.at))
        if given in {(True, False, False, False), (False, True, True, False), (False, True, False, True)}:
            return self
        raise FaultError("centre_form")


class BodyTable(Authored):
    """The mass of a link (kg), its moment of inertia about its centre of mass (kg m^2), the pins it carries.

    `pins` are joints of three or more links; those that come later are hinged to this link.
    """

    link: BodyName
    mass: FormulaText | None = None
    inertia: FormulaText | None = None
    centre: Annotated[CentreTable | None, Field(json_schema_extra=_or_a_joint)] = None
    pins: list[Joint] = Field(default=[])

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if self.mass is None and self.inertia is None and not self.pins:
            raise FaultError("body_needs")
        return self

    @property
    def has_mass(self) -> bool:
        """True if it has a mass or an inertia, and thus a centre."""
        return self.mass is not None or self.inertia is not None


class LoadTable(Authored):
    """A given force (N) on a link at one of its points, or a couple (N m, counter-clockwise positive).

    The force has a direction, or goes along or against the motion of a slider.
    """

    name: LinkName | None = None
    link: BodyName
    point: Joint | None = None
    force: FormulaText | None = None
    angle_deg: FormulaText | None = None
    motion: Literal["along", "against"] | None = None
    couple: FormulaText | None = None

    @model_validator(mode="after")
    def _is_one_kind(self) -> Self:
        if (self.force is None) == (self.couple is None):
            raise FaultError("load_needs")
        directions = (self.angle_deg is not None) + (self.motion is not None)
        if self.couple is not None and directions:
            raise FaultError("couple_direction")
        if self.force is not None and directions != 1:
            raise FaultError("force_direction")
        return self


class Masses(Authored):
    """Masses and given forces of an assignment. Without bodies and loads it has no forces."""

    gravity: FormulaText | None = None
    """Acceleration of gravity, m/s^2, downwards; weights are neglected where it is left out."""
    body: list[BodyTable] = Field(default=[])
    load: list[LoadTable] = Field(default=[])

    @property
    def has_forces(self) -> bool:
        """True if there is a body or a load."""
        return bool(self.body or self.load)

    @property
    def formulas(self) -> Iterator[tuple[str, str, Formula]]:
        """Every formula, with its path and its key."""
        for name in Masses.model_fields:
            for path, key, leaf in formulas_in(getattr(self, name), f"$.{name}", name):
                yield path, key, cast("Formula", leaf)


NOT_NEGATIVE = {"mass", "inertia", "gravity"}
"""Keys of numbers that are zero or more."""


def with_centres(file: MechanismFile, bodies: Sequence[BodyTable]) -> MechanismFile:
    """Return the mechanism's file with the centres of mass that are no joints yet as points of its links."""
    tables = [table for table in map(_centre_table, bodies) if table is not None]
    return file.model_copy(update={"group": [*file.group, *tables]}) if tables else file


def _centre_table(body: BodyTable) -> PointOnLineTable | PointTable | None:
    centre = body.centre
    if centre is None or centre.base is None:
        return None
    where: dict[str, Any] = {"node": _point_name(body), "base": centre.base, "link": body.link}
    # The formulas are parsed already.
    if centre.ratio is not None:
        return PointOnLineTable.model_construct(type="point_on_line", ratio=centre.ratio, **where)
    return PointTable.model_construct(type="point", at=cast("list[Formula]", centre.at), **where)


def _point_name(body: BodyTable) -> str:
    return f"S{body.link}"


def with_masses(mechanism: Mechanism, numbers: Numbers, masses: Masses) -> Mechanism:
    """Return the mechanism with its bodies, loads, gravity and pins; it has their centres as joints."""
    points = points_of(mechanism)

    def amount(formula: Formula | None, what: str) -> FloatArray | None:
        return None if formula is None else numbers.amount(formula, what)

    def body(table: BodyTable) -> Body:
        centre = table.centre
        at = points[table.link][0] if centre is None else centre.joint or _point_name(table)
        return Body(table.link, at, amount(table.mass, "mass"), amount(table.inertia, "inertia"))

    def load(table: LoadTable) -> Load:
        point = table.point or points[table.link][0]
        name = _load_name(table, points)
        if table.force is None:
            couple = numbers.number(cast("Formula", table.couple))
            return Load(name, table.link, point, couple=couple)
        force = numbers.number(table.force) + 0j
        if table.angle_deg is not None:
            force = force * np.asarray(assur.heading(numbers.angle(table.angle_deg)))
        elif table.motion == "against":
            force = -force
        slider = point if table.motion else None
        return Load(name, table.link, point, np.asarray(force), slider=slider)

    gravity = None if masses.gravity is None else numbers.amount(masses.gravity, "gravity")
    bodies = tuple(body(table) for table in masses.body if table.has_mass)
    added = (bodies, tuple(load(table) for table in masses.load), gravity)
    bodies, loads, gravity = with_arrays(added, numbers.for_all)
    pins = {joint: table.link for table in masses.body for joint in table.pins}
    return replace(mechanism, bodies=bodies, loads=loads, gravity=gravity, pins=pins)


def _load_name(load: LoadTable, points: Points) -> str:
    if load.couple is not None:
        return load.name or short_name(load.link)
    return load.name or load.point or points[load.link][0]


# Checks --------------------------------------------------------------------------------------------


def check_masses(masses: Masses, file: MechanismFile, mechanism: Mechanism) -> Iterator[Finding]:
    """Report bodies and loads that do not fit the mechanism, whose file has passed its own checks.

    Arguments: `mechanism` is that of the file, without centres of mass.
    """
    bodies, points = masses.body, points_of(mechanism)
    if masses.gravity is not None and not any(body.mass is not None for body in bodies):
        yield Finding("$.gravity", "gravity_alone")
    if not masses.has_forces:
        return
    faults = [*_check_names(points), *_check_tables(mechanism, points, bodies)]
    faults += [] if faults else _check_centres(file, bodies)
    yield from faults
    held = dict(points)
    for body in bodies if not faults else ():
        if _centre_table(body) is not None:
            held[body.link] = (*held[body.link], _point_name(body))
    yield from _check_loads(mechanism, held, masses.load)


def _check_names(points: Points) -> Iterator[Finding]:
    """Report links whose forces would have the same names."""
    by_name: dict[str, str] = {GROUND: GROUND}
    for link in points:
        short = short_name(link)
        if short in by_name:
            yield Finding("$.body", "forces_alike", {"link": link, "other": by_name[short], "name": short})
        by_name.setdefault(short, link)


def _check_link(link: str, points: Points, where: str) -> Iterator[Finding]:
    if link in points:
        return
    near = {"near": SLIDER + link} if SLIDER + link in points else nearest(link, points)
    yield Finding(where, "link_unknown", {"link": link, "names": tuple(points), **near})


def _check_tables(mechanism: Mechanism, points: Points, bodies: Sequence[BodyTable]) -> Iterator[Finding]:
    """Check each body's link, its centre if that is a joint, and its pins."""
    seen: set[str] = set()
    pinned: dict[str, str] = {}
    sliding = sliders_of(mechanism)
    for index, body in enumerate(bodies):
        where, link, centre = f"$.body[{index}]", body.link, body.centre
        yield from _check_link(link, points, f"{where}.link")
        if link in seen:
            yield Finding(f"{where}.link", "body_twice", {"link": link})
        if link in seen or link not in points:
            continue
        seen.add(link)
        if link in sliding and centre is not None and centre.joint not in points[link]:
            yield Finding(f"{where}.centre", "slider_centre", {"names": points[link]})
        elif link not in sliding and centre is None and body.has_mass:
            yield Finding(f"{where}.centre", "centre_form")
        elif centre is not None and centre.joint is not None and centre.joint not in points[link]:
            yield _not_carried(f"{where}.centre", centre.joint, link, points)
        elif centre is not None and centre.base is not None and _point_name(body) in mechanism.joints:
            yield Finding(f"{where}.centre", "centre_is_joint", {"joint": _point_name(body)})
        yield from _check_pins(mechanism, points, body, pinned, where)


def _not_carried(where: str, joint: str, link: str, points: Points) -> Finding:
    return Finding(where, "not_carried", {"joint": joint, "link": link, "names": points[link]})


def _check_pins(
    mechanism: Mechanism,
    points: Points,
    body: BodyTable,
    pinned: dict[str, str],
    where: str,
) -> Iterator[Finding]:
    hinged = hinged_at(mechanism)
    for index, joint in enumerate(body.pins):
        path = f"{where}.pins[{index}]"
        if joint not in points[body.link]:
            yield _not_carried(path, joint, body.link, points)
        elif body.link not in hinged[joint]:
            known: dict[str, Parameter] = {"link": body.link, "joint": joint, "names": tuple(hinged[joint])}
            yield Finding(path, "hinged_later", known)
        elif joint in pinned:
            yield Finding(path, "pinned_twice", {"joint": joint, "link": pinned[joint]})
        pinned.setdefault(joint, body.link)


def _check_centres(file: MechanismFile, bodies: Sequence[BodyTable]) -> Iterator[Finding]:
    """Check the bases of centres of mass as those of any further point of a link."""
    tables = [index for index, body in enumerate(bodies) if _centre_table(body) is not None]
    extended = with_centres(file, bodies)
    if extended is file:
        return
    for finding in check_mechanism(extended):
        path, sign, key = finding.path.removeprefix("$.group[").partition("]")
        if sign and path.isdigit() and int(path) >= len(file.group):
            index = tables[int(path) - len(file.group)]
            yield replace(finding, path=f"$.body[{index}].centre{key}")
        else:
            yield replace(finding, path="$.body")


def _check_loads(mechanism: Mechanism, points: Points, loads: Sequence[LoadTable]) -> Iterator[Finding]:
    sliding = sliders_of(mechanism)
    names = {"b", *(f"i{short_name(link)}" for link in points)}
    for index, load in enumerate(loads):
        where, link = f"$.load[{index}]", load.link
        yield from _check_link(link, points, f"{where}.link")
        if link not in points:
            continue
        if load.point is not None and load.point not in points[link]:
            yield _not_carried(f"{where}.point", load.point, link, points)
        elif load.point is None and load.force is not None and link not in sliding:
            yield Finding(f"{where}.point", "load_point", {"link": link, "names": points[link]})
        if load.motion is not None and not isinstance(sliding.get(link), FixedGuide):
            yield Finding(f"{where}.motion", "motion_no_slider", {"link": link})
        name = _load_name(load, points)
        if name in names:
            yield Finding(f"{where}.name", "force_name", {"name": name})
        names.add(name)
