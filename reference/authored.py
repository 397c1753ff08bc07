"""Authored files: mechanisms and assignments in TOML, validated, all faults of a file at once."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    ValidationError,
    WithJsonSchema,
    model_validator,
)

from reference import formula
from reference.errors import AuthoredFileError, Finding
from reference.formula import Formula

MOST_VARIANTS = 1_000_000
"""Of a range of n or position: more is a slip of the pen."""
LENGTH_UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}


Model = TypeVar("Model", bound=BaseModel)


class Authored(BaseModel):
    """A table of an authored file: frozen, nothing unknown, nothing coerced."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, arbitrary_types_allowed=True)


def _read_formula(value: object) -> Formula:
    if isinstance(value, Formula):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError('a number or a formula in quotes, such as "2*(30+n)", is expected')  # noqa: TRY004
    return formula.parse(value)


def _check_joint(name: str) -> str:
    if not name.isalnum() or not name[0].isupper() or name.lower() in {"o", "n"}:
        # A joint's image in the plans is its name in lower case: the two must differ.
        raise ValueError(f"'{name}' is no joint's name: a capital, then letters or digits (not O or N)")
    return name


FormulaText = Annotated[
    Formula,
    BeforeValidator(_read_formula),
    PlainSerializer(lambda f: f.text),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]}),
]
Joint = Annotated[str, Field(min_length=1, max_length=4), AfterValidator(_check_joint)]
Identifier = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$")]
LinkName = Annotated[str, Field(pattern=r"^[A-Za-z0-9]{1,4}$")]
Point = Annotated[list[FormulaText], Field(min_length=2, max_length=2)]
TwoJoints = Annotated[list[Joint], Field(min_length=2, max_length=2)]
TwoFormulas = Annotated[list[FormulaText], Field(min_length=2, max_length=2)]


class Text(Authored):
    """A text in the languages of feedback; English is required."""

    en: str
    ro: str | None = None
    ru: str | None = None

    def in_language(self, language: str) -> str:
        """The text in a language, or in English where it is not given."""
        return getattr(self, language, None) or self.en


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
    group: list[GroupTable] = []

    @model_validator(mode="after")
    def _has_one_driver(self) -> Self:
        if (self.crank is None) == (self.driven_slider is None):
            raise ValueError("needs one driven link: either [crank] or [driven_slider]")
        return self


class Range(Authored):
    """Whole numbers from .. to, both included."""

    first: Annotated[int, Field(alias="from")]
    last: Annotated[int, Field(alias="to")]

    @model_validator(mode="after")
    def _is_no_more_than_can_be_graded(self) -> Self:
        if self.last - self.first >= MOST_VARIANTS:
            raise ValueError(f"is a range of more than {MOST_VARIANTS} numbers")
        return self

    @property
    def values(self) -> range:
        """The numbers."""
        return range(self.first, self.last + 1)


class VariantTable(Authored):
    """What a student's number n (and a position) sets: formulas, each may use those above it."""

    n: Range | None = None
    position: Range | None = None
    values: dict[Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")], FormulaText] = {}


class ScalesTable(Authored):
    """The assignment's own rule for the scales.

    Formulas of the variant's values and of `crank_mm` (drawn length of the crank), `crank_m` (its
    real length), `omega`, then `kL`, then `kv`; where a slider drives, of `speed` instead (m/s).
    """

    crank_mm: FormulaText | None = None
    kL: FormulaText  # noqa: N815 - the field's own name for it
    kv: FormulaText
    ka: FormulaText
    bare_units: dict[Literal["kL", "kv", "ka"], str] = {}
    """The unit of a scale that a student writes as a bare number, where the assignment says one."""


class PageTable(Authored):
    """A sheet that a student hands in, with the figures drawn on it."""

    kind: Literal["all", "velocity", "acceleration"]
    figures: Annotated[list[Literal["mechanism", "velocity_plan", "acceleration_plan"]], Field(min_length=1)]


class GivenTable(Authored):
    """One datum as told to the student: label = value unit."""

    label: str
    value: FormulaText
    unit: str = ""


TRADITIONS: dict[str, dict[str, str]] = {
    "o": {},
    "p": {"o": "p", "o'": "π", "kL": "μl", "kv": "μv", "ka": "μa"},
}
"""What students call poles and scales: o, o', kL, kv, ka; or p, π, μl, μv, μa."""


class AssignmentFile(Authored):
    """An assignment: a mechanism, what varies, the scales, the sheets, the names students see.

    `tradition` fills `names` with those of a school; names given one by one go before it.
    """

    schema_version: Literal[1]
    id: Identifier
    title: Text
    task: Text
    mechanism: str | MechanismFile
    rubric: str
    variant: VariantTable = VariantTable()
    scales: ScalesTable
    plate_images: Literal["perpendiculars", "similarity"] = "perpendiculars"
    page: Annotated[list[PageTable], Field(min_length=1)]
    given: list[GivenTable] = []
    tradition: Literal["o", "p"] = "o"
    names: dict[str, str] = {}
    assumptions: list[str] = []

    @model_validator(mode="before")
    @classmethod
    def _with_names_of_its_tradition(cls, data: Any) -> Any:  # noqa: ANN401 - not yet validated
        if not isinstance(data, dict) or not isinstance(data.get("names", {}), dict):
            return data
        of_the_school = TRADITIONS.get(str(data.get("tradition", "o")), {})
        return {**data, "names": {**of_the_school, **data.get("names", {})}}


def load(model: type[Model], path: Path) -> Model:
    """Read and validate one authored file.

    Raises AuthoredFileError with every fault found, each with its path in the file.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise AuthoredFileError(str(path), (Finding("$", "there is no such file"),)) from error
    except OSError as error:
        raise AuthoredFileError(str(path), (Finding("$", f"cannot be read: {error.strerror}"),)) from error
    except UnicodeDecodeError as error:
        raise AuthoredFileError(str(path), (Finding("$", "is not UTF-8 text"),)) from error
    except tomllib.TOMLDecodeError as error:
        raise AuthoredFileError(str(path), (Finding("$", f"is not TOML: {error}"),)) from error
    return validate(model, data, str(path))


def validate(model: type[Model], data: dict[str, Any], file: str) -> Model:
    """Validate a table; raises AuthoredFileError with every fault."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise AuthoredFileError(file, tuple(findings_of(error, model))) from error


def findings_of(error: ValidationError, model: type[BaseModel]) -> Iterator[Finding]:
    """Pydantic's faults as paths and plain sentences."""
    for fault in error.errors():
        *above, last = fault["loc"] or ("",)
        is_field = fault["type"] in {"extra_forbidden", "missing"}
        path = "$" + "".join(map(_path_part, above)) + (f".{last}" if is_field else _path_part(last))
        message = fault["msg"].removeprefix("Value error, ").replace(" after validation", "")
        if fault["type"] == "extra_forbidden":
            message = _not_known(str(fault["loc"][-1]), model)
        elif fault["type"] == "missing":
            message = "is missing" + _WHY_NEEDED.get(str(fault["loc"][-1]), "")
        elif fault["type"].startswith("union_tag"):
            message = f"needs a type, one of {', '.join(_GROUP_TYPES)}"
        yield Finding(path, message)


_GROUP_TYPES = ("RRR", "RRP", "RPR", "PRP", "RPP", "plate", "point_on_line", "point")
_UNION_TAGS = {*_GROUP_TYPES, "str", "MechanismFile"}


_WHY_NEEDED = {
    "side": ": without it two assemblies are possible, and the mechanism is never guessed",
}


def _path_part(part: str | int) -> str:
    if isinstance(part, int):
        return f"[{part}]"
    return "" if not part or part in _UNION_TAGS or part.startswith("function-") else f".{part}"


def _not_known(name: str, model: type[BaseModel]) -> str:
    import difflib  # noqa: PLC0415 - only on the way to an error message

    fields = {field for kind in _models_in(model, set()) for field in kind.model_fields}
    if name in fields:
        return "does not belong here: another kind of table has it; leave it out"
    near = difflib.get_close_matches(name, sorted(fields), n=1)
    return "is not known here; check its spelling" + (f" (did you mean {near[0]}?)" if near else "")


def _models_in(model: type[BaseModel], seen: set[type[BaseModel]]) -> set[type[BaseModel]]:
    from typing import get_args  # noqa: PLC0415

    if model in seen:
        return seen
    seen.add(model)
    waiting: list[Any] = [field.annotation for field in model.model_fields.values()]
    while waiting:
        kind = waiting.pop()
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            _models_in(kind, seen)
        else:
            waiting.extend(get_args(kind))
    return seen
