"""A mechanism as its author writes it: the tables of a mechanism file."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from reference.authored import (
    Authored,
    FormulaText,
    Identifier,
    Joint,
    LinkName,
    Point,
    Text,
    TwoFormulas,
    TwoJoints,
)


class CrankTable(Authored):
    """The driven crank. Its speed is `omega` (rad/s), or `rpm` through a gear of `gear_ratio`.

    Counter-clockwise positive.
    """

    link: LinkName = "1"
    pivot: Joint
    pin: Joint
    length: FormulaText
    angle_deg: FormulaText
    omega: FormulaText | None = None
    rpm: FormulaText | None = None
    gear_ratio: FormulaText | None = None
    epsilon: FormulaText | None = None

    @model_validator(mode="after")
    def _has_one_speed(self) -> Self:
        if (self.omega is None) == (self.rpm is None):
            raise ValueError("needs one speed: either omega (rad/s) or rpm (rev/min)")
        if self.gear_ratio is not None and self.rpm is None:
            raise ValueError("gear_ratio goes with rpm: the crank then turns at rpm / gear_ratio")
        return self


class FixedGuideTable(Authored):
    """A fixed straight guide: a point of it and its direction, degrees counter-clockwise from +x."""

    through: Point
    angle_deg: FormulaText


class GuideTable(Authored):
    """A straight guide: fixed (`through`, `angle_deg`), or the line through two joints of a moving link.

    `coincident` names the moving link's point under the slider, as in ``D5`` under ``D``.
    """

    through: Point | None = None
    angle_deg: FormulaText | None = None
    joints: TwoJoints | None = None
    coincident: Joint | None = None

    @model_validator(mode="after")
    def _is_one_kind(self) -> Self:
        fixed = (self.through is not None, self.angle_deg is not None)
        moving = (self.joints is not None, self.coincident is not None)
        if (all(fixed) and not any(moving)) or (all(moving) and not any(fixed)):
            return self
        raise ValueError(
            "needs through and angle_deg (a fixed guide), or joints and coincident (a guide on a moving link)"
        )


class DrivenSliderTable(Authored):
    """The driven slider, in place of a crank: where it is along its fixed guide, and how it moves.

    In `length_unit`, `length_unit`/s and `length_unit`/s^2, along the guide's direction.
    """

    link: LinkName = "1"
    pin: Joint
    guide: FixedGuideTable
    displacement: FormulaText
    speed: FormulaText
    acceleration: FormulaText | None = None


class DyadTable(Authored):
    """Assur group RRR: two links that meet in `node`."""

    type: Literal["RRR"]
    node: Joint
    pins: TwoJoints
    links: Annotated[list[LinkName], Field(min_length=2, max_length=2)]
    lengths: TwoFormulas
    side: Literal["left", "right"]
    """Of the directed line pins[0] -> pins[1]."""


class SliderTable(Authored):
    """Assur group RRP: a rod from `pin` to the slider `node` on a guide."""

    type: Literal["RRP"]
    node: Joint
    pin: Joint
    link: LinkName
    length: FormulaText
    guide: GuideTable
    side: Literal["ahead", "behind"]
    """Where the slider is, seen from the pin along the guide's direction."""


class SlottedLinkTable(Authored):
    """Assur group RPR: `link` turns about `pivot`; a block hinged at `pin` slides along its guide."""

    type: Literal["RPR"]
    node: Joint
    """The point of the link under the pin, as in ``B3`` under ``B``."""
    pin: Joint
    pivot: Joint
    link: LinkName
    offset: FormulaText | None = None
    """How far the pin lies to the left of the parallel to the guide through the pivot."""
    foot: Joint | None = None
    """The guide's nearest point to the pivot, where there is an offset."""
    side: Literal["ahead", "behind"] = "ahead"
    """Where the pin is, seen from the pivot along the guide's direction."""

    @model_validator(mode="after")
    def _has_foot_and_offset(self) -> Self:
        if (self.offset is None) != (self.foot is None):
            raise ValueError("offset and foot go together; foot names the guide's nearest point to the pivot")
        return self


class CrossSliderTable(Authored):
    """Assur group PRP: `node` hinges two blocks, each on a guide."""

    type: Literal["PRP"]
    node: Joint
    guides: Annotated[list[GuideTable], Field(min_length=2, max_length=2)]


class YokeTable(Authored):
    """Assur group RPP: a block hinged at `pin` slides in a yoke's slot, the yoke on a fixed guide."""

    type: Literal["RPP"]
    node: Joint
    """The yoke's point where slot and guide cross."""
    pin: Joint
    slot_deg: FormulaText
    guide: FixedGuideTable


class PlateTable(Authored):
    """A third point of the link through `base`, by its distances from base[0] and base[1]."""

    type: Literal["plate"]
    node: Joint
    base: TwoJoints
    link: LinkName
    lengths: TwoFormulas
    side: Literal["left", "right"] | None = None
    """Of the directed line base[0] -> base[1]; needed unless the three are in line for every variant."""


class PointOnLineTable(Authored):
    """A point of the link through `base`: base[0] + ratio (base[1] - base[0])."""

    type: Literal["point_on_line"]
    node: Joint
    base: TwoJoints
    link: LinkName
    ratio: FormulaText


class PointTable(Authored):
    """A point of a link by local coordinates: x from base[0] towards base[1], y to the left of it.

    On a slotted link the base is its pivot and its node, and x runs along the guide.
    """

    type: Literal["point"]
    node: Joint
    base: TwoJoints
    link: LinkName
    at: Point


LinkPointTable = PlateTable | PointOnLineTable | PointTable
AnyGroupTable = DyadTable | SliderTable | SlottedLinkTable | CrossSliderTable | YokeTable | LinkPointTable
GroupTable = Annotated[AnyGroupTable, Field(discriminator="type")]


class MechanismFile(Authored):
    """A mechanism: lengths in `length_unit`, numbers or formulas of the assignment's values."""

    schema_version: Literal[1]
    id: Identifier
    title: Text
    length_unit: Literal["m", "cm", "mm"]
    ground: Annotated[dict[Joint, Point], Field(min_length=1)]
    crank: CrankTable | None = None
    driven_slider: DrivenSliderTable | None = None
    group: list[GroupTable] = Field(default=[])

    @model_validator(mode="after")
    def _has_one_driver(self) -> Self:
        if (self.crank is None) == (self.driven_slider is None):
            raise ValueError("needs one driven link: either [crank] or [driven_slider]")
        return self
