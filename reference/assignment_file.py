"""An assignment as its author writes it: what varies, the scales, the sheets, the names."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from reference.authored import Authored, FormulaText, Identifier, Text
from reference.mechanism_file import MechanismFile

MOST_VARIANTS = 10_000
"""Of an assignment: more than any class has students, and all of them are computed before it is used."""


class Range(Authored):
    """Whole numbers from .. to, both included."""

    first: Annotated[int, Field(alias="from")]
    last: Annotated[int, Field(alias="to")]

    @property
    def values(self) -> range:
        """The numbers."""
        return range(self.first, self.last + 1)


class VariantTable(Authored):
    """What a student's number n (and a position) sets: formulas, each may use those above it."""

    n: Range | None = None
    position: Range | None = None
    values: dict[Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")], FormulaText] = Field(default={})

    @model_validator(mode="after")
    def _has_no_more_than_can_be_graded(self) -> Self:
        count = 1
        for numbers in (self.n, self.position):
            count *= 1 if numbers is None else max(numbers.last - numbers.first + 1, 0)
        if count > MOST_VARIANTS:
            raise ValueError(f"has {count} variants, more than {MOST_VARIANTS}: narrow n or position")
        return self


class ScalesTable(Authored):
    """The assignment's own rule for the scales.

    Formulas of the variant's values and of `crank_mm` (drawn length of the crank), `crank_m` (its
    real length), `omega`, then `kL`, then `kv`; where a slider drives, of `speed` instead (m/s).
    """

    crank_mm: FormulaText | None = None
    kL: FormulaText  # noqa: N815 - the field's own name for it
    kv: FormulaText
    ka: FormulaText
    bare_units: dict[Literal["kL", "kv", "ka"], str] = Field(default={})
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
    given: list[GivenTable] = Field(default=[])
    tradition: Literal["o", "p"] = "o"
    names: dict[str, str] = Field(default={})
    assumptions: list[str] = Field(default=[])

    @model_validator(mode="before")
    @classmethod
    def _with_names_of_its_tradition(cls, data: Any) -> Any:  # noqa: ANN401 - not yet validated
        if not isinstance(data, dict) or not isinstance(data.get("names", {}), dict):
            return data
        of_the_school = TRADITIONS.get(str(data.get("tradition", "o")), {})
        return {**data, "names": {**of_the_school, **data.get("names", {})}}
