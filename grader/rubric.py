"""Rubrics: what is asked for, how many points it gives, and how far a drawing may be off.

Everything that judges a student stands here as data: the tolerances of a careful hand on paper,
the band of half points, what happens with what was not handed in.
"""

from functools import cache
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from reference.assignment import Assignment, locate
from reference.authored import Authored, Identifier, Text, load
from reference.construction import Construction
from reference.derivation import construction_of
from reference.errors import AuthoredFileError, CallError, Finding

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class ToleranceTable(Authored):
    """How far off full marks may be.

    Length: the larger of `length_mm` and `length_relative` of the expected length. Direction: the
    larger of `direction_deg` and the angle at which the vector's end is `across_mm` off. Vectors
    shorter than `least_mm` (expected) have no direction that could be judged. Up to
    `partial_factor` times the tolerance gives half points. A verdict on a scan that is another one
    within `certain_errors` standard errors of the reading goes to a person: 1.645 leaves one in
    twenty that lie just at a limit on the wrong side of it.
    """

    length_mm: Positive = 1.0
    length_relative: NotNegative = 0.02
    direction_deg: Positive = 1.5
    across_mm: NotNegative = 0.5
    least_mm: NotNegative = 3.0
    scale_relative: Positive = 0.02
    certain_errors: NotNegative = 1.645
    partial_factor: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 2.0
    partial_share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5


class CriterionTable(Authored):
    """One criterion: exactly one of a `vector`, an `angular` quantity or a `scale`, and its points.

    `optional`: not judged where it was not handed in. `direction = false`: only the length counts.
    `tolerance` replaces the rubric's for this criterion.
    """

    id: Identifier
    title: Text
    points: Positive
    vector: str | None = None
    angular: str | None = None
    scale: Literal["kL", "kv", "ka"] | None = None
    optional: bool = False
    direction: bool = True
    tolerance: ToleranceTable | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if sum(kind is not None for kind in (self.vector, self.angular, self.scale)) != 1:
            raise ValueError("must have exactly one of vector, angular and scale")
        return self

    @property
    def name(self) -> str:
        """The vector, angular quantity or scale asked for."""
        return self.vector or self.angular or self.scale or ""


class RubricFile(Authored):
    """A rubric as authored."""

    schema_version: Literal[1]
    id: Identifier
    title: Text
    tolerance: ToleranceTable = ToleranceTable()
    missing: Literal["review", "none", "not_judged"] = "review"
    """The verdict on a criterion that is asked for and was not handed in."""
    least_confidence: Annotated[float, Field(ge=0.0, le=1.0)] = 0.9
    """A reading less certain than this goes to a person."""
    follow_through: bool = True
    least_followed_share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.2
    """No credit for what follows from an earlier answer that makes it shorter than this share of the
    right length: such a follow-through is trivial."""
    criterion: Annotated[list[CriterionTable], Field(min_length=1)]

    @property
    def max_score(self) -> float:
        """All points."""
        return sum(criterion.points for criterion in self.criterion)

    @property
    def vectors(self) -> tuple[str, ...]:
        """The vectors asked for."""
        return tuple(criterion.vector for criterion in self.criterion if criterion.vector)

    @property
    def needs_accelerations(self) -> bool:
        """Whether anything asked for needs the acceleration plan."""
        return any(c.name.startswith(("a_", "epsilon_")) or c.scale == "ka" for c in self.criterion)

    def tolerance_of(self, criterion: CriterionTable) -> ToleranceTable:
        """The criterion's own tolerance, else the rubric's."""
        return criterion.tolerance or self.tolerance


def check_rubric(rubric: RubricFile, construction: Construction) -> list[Finding]:
    """Names in the rubric that the construction does not know."""
    known = {"vector": tuple(construction.vectors), "angular": tuple(construction.rates)}
    return [
        Finding(f"$.criterion[{index}].{key}", f"{name} is not in this mechanism: {', '.join(names)}")
        for index, criterion in enumerate(rubric.criterion)
        for key, names in known.items()
        if (name := getattr(criterion, key)) is not None and name not in names
    ]


def rubric_of(assignment: Assignment) -> RubricFile:
    """The rubric of an assignment, held against its mechanism.

    Raises AuthoredFileError with every fault, names that the mechanism does not have among them.
    """
    rubric = load_rubric(assignment.file.rubric, beside=assignment.path)
    mechanism = assignment.mechanism(assignment.variants()[:1])
    by_similarity = assignment.file.plate_images == "similarity"
    findings = check_rubric(rubric, construction_of(mechanism, plate_by_similarity=by_similarity))
    if findings:
        path = locate("rubric", assignment.file.rubric, assignment.path)
        raise AuthoredFileError(str(path), tuple(findings))
    return rubric


def load_rubric(name: str | Path, *, beside: Path | None = None) -> RubricFile:
    """A rubric by its built-in name, a neighbour of the assignment's file, or its path.

    Raises CallError for an unknown name, AuthoredFileError with every fault of the file.
    """
    path = locate("rubric", str(name), beside)
    if not path.is_file() and not str(name).endswith(".toml"):
        places = "among the built-in ones" if beside is None else f"in {beside.parent} and the built-in ones"
        raise CallError("unknown_rubric", f"there is no rubric '{name}': {path.name} was looked for {places}")
    return _load(path.resolve(), path.stat().st_mtime_ns if path.is_file() else 0)


@cache
def _load(path: Path, _changed_ns: int) -> RubricFile:
    rubric = load(RubricFile, path)
    ids = [criterion.id for criterion in rubric.criterion]
    twice = [
        Finding(f"$.criterion[{index}].id", f"{name} is there already")
        for index, name in enumerate(ids)
        if name in ids[:index]
    ]
    if twice:
        raise AuthoredFileError(str(path), tuple(twice))
    return rubric
