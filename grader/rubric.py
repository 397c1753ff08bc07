"""Rubrics: the requested criteria, their points, and the tolerances.

All numbers that judge a student are data of the rubric: the tolerances on paper and the drafting errors
for which they are widened, the bands of partial points, the verdict on what was not handed in.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Literal, Self, TypedDict, cast

from pydantic import Field, model_validator

from grader.documents import ScaleName
from grader.records import MECHANISM
from reference.authored.assignment import Assignment, file_kind, load_assignment, locate
from reference.authored.toml_file import Authored, Identifier, Text, is_file, load, table_of
from reference.construction.graph import ON_SKETCH, Construction
from reference.errors import AuthoredFileError, CallError, FaultError, Faults, Finding, look_alikes
from reference.plan import construction_for
from reference.quantities import KindName, kind_of, value_name

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class Band(Authored):
    """Partial points: this share for an error up to `factor` times the tolerance."""

    factor: Annotated[float, Field(ge=1.0, allow_inf_nan=False)]
    share: Annotated[float, Field(ge=0.0, le=1.0)]


class ToleranceTable(Authored):
    """Largest errors for full marks.

    Length: the larger of `length_mm` and `length_relative` of the expected length. Direction: the larger of
    `direction_deg` and the angle at which the vector's end is `across_mm` off. Vectors shorter than
    `least_mm` (expected) have no direction to judge. Up to `partial_factor` times the tolerance gives half
    points; `bands` replaces it by several steps. If the verdict on a scan changes within `certain_errors`
    standard errors of the reading, a person decides: 1.645 leaves one in twenty of the cases just at a limit
    on its wrong side.
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
    bands: list[Band] | None = None

    @model_validator(mode="after")
    def _bands_fall(self) -> Self:
        if self.bands is None:
            return self
        if {"partial_factor", "partial_share"} & self.model_fields_set:
            raise FaultError("bands_beside")
        pairs = zip(self.bands, self.bands[1:], strict=False)
        if not all(one.factor < other.factor and one.share > other.share for one, other in pairs):
            raise FaultError("bands_order")
        return self

    @property
    def all_bands(self) -> tuple[tuple[float, float], ...]:
        """Factors and shares, the nearest first."""
        if self.bands is None:
            return ((self.partial_factor, self.partial_share),)
        return tuple((band.factor, band.share) for band in self.bands)

    @property
    def farthest(self) -> float:
        """The largest multiple of the tolerance that still gives points."""
        return self.all_bands[-1][0] if self.all_bands else 1.0

    def length_at(self, expected_mm: float) -> float:
        """Return the tolerance of a length, mm: the larger of the absolute and the relative one."""
        return max(self.length_mm, self.length_relative * expected_mm)

    def direction_at(self, expected_mm: float) -> float | None:
        """Return the tolerance of a direction, deg: the larger of the fixed one and that of the end across.

        None if the vector is too short to judge its direction.
        """
        if expected_mm < self.least_mm or expected_mm == 0.0:
            return None
        return max(self.direction_deg, math.degrees(math.atan(self.across_mm / expected_mm)))


class HandTable(Authored):
    """Errors of careful drawing, standard deviations of one act, for which tolerances are widened.

    `angle_deg`: a line set along or across another; `place_mm`: a length transferred, an arc opened, half of
    it for the foot of a line; `mark_mm`: a point marked. `ruler_mm` and `protractor_deg`: a length and a
    direction measured and written down. A right drawing may deviate by `sigmas` standard deviations of their
    combined effect; 0 leaves the tolerances unchanged. No tolerance grows to more than `at_most` times
    itself: a mistake could hide in it. A larger error that careful drawing can still explain goes to a
    person.

    Careful plotting is good to 0.1-0.4 mm, 0.25 mm usually taken; at both ends of a line of 70 mm that is 0.3
    degrees. Rulers are read to half a millimetre, protractors to a degree.
    """

    angle_deg: NotNegative = 0.3
    place_mm: NotNegative = 0.25
    mark_mm: NotNegative = 0.1
    ruler_mm: NotNegative = 0.2
    protractor_deg: NotNegative = 0.4
    sigmas: NotNegative = 4.0
    at_most: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 2.5


class DoubtTable(Authored):
    """Conditions under which a verdict needs no person.

    A verdict whose probability is at least `settle` is settled. `in_doubt` decides cases within
    `certain_errors` standard errors of a limit: for the `student` (it counts), by a `person`, or `strict`
    (only what is certainly within the limit counts); these are the decision rules of ISO 14253-1 and JCGM
    106. If no more than `stake` of the maximum is open, it is settled in the student's favour.
    `other_variant`: another student's data go to a `person`, earn `none`, or are marked as any mistake
    (`follow`).
    """

    settle: Annotated[float, Field(ge=0.5, le=1.0)] = 0.97
    in_doubt: Literal["student", "person", "strict"] = "student"
    stake: Annotated[float, Field(ge=0.0, le=1.0)] = 0.01
    other_variant: Literal["person", "none", "follow"] = "person"


Section = Literal["mechanism", "scales", "velocity_plan", "acceleration_plan", "angular", "force_plans"]
SECTIONS: dict[KindName, Section] = {
    "velocity": "velocity_plan", "acceleration": "acceleration_plan",
    "omega": "angular", "epsilon": "angular", "force": "force_plans", "moment": "force_plans",
}  # fmt: skip
"""The section of each kind of vector and turning quantity."""


class WeightsTable(Authored):
    """The weight of each section of the rubric, whatever the sum of its points."""

    mechanism: Positive | None = None
    scales: Positive | None = None
    velocity_plan: Positive | None = None
    acceleration_plan: Positive | None = None
    angular: Positive | None = None
    force_plans: Positive | None = None


class CriterionTable(Authored):
    """One criterion and its points: exactly one of what a rubric may ask for.

    It is a `vector`, its computed `value`, an `angular` quantity, a `moment`, the `sense` of one of these, a
    `scale`, `link` or `point`. `figure = "mechanism"`: the vector as drawn again at its point on the sketch.
    A `point` of the sketch is an instantaneous centre (``I3``) or an acceleration pole (``J3``). `optional`:
    not judged if it was not handed in. `direction = false`: only the length counts. `tolerance` replaces the
    rubric's for this criterion, so does `follow_through`.
    """

    id: Identifier
    title: Text
    points: Positive
    vector: str | None = None
    value: str | None = None
    angular: str | None = None
    moment: str | None = None
    sense: str | None = None
    scale: ScaleName | None = None
    link: str | None = None
    point: str | None = None
    figure: Literal["mechanism"] | None = None
    optional: bool = False
    direction: bool = True
    follow_through: bool | None = None
    tolerance: ToleranceTable | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if sum(getattr(self, kind) is not None for kind in ASKED) != 1:
            raise FaultError("one_kind", texts=ASKED)
        if self.figure and not self.vector:
            raise FaultError("figure_of_vector")
        if self.point and not self.direction:
            raise FaultError("point_direction")
        return self

    @property
    def turning(self) -> str | None:
        """The angular quantity or moment that is asked for, or whose sense is."""
        return self.angular or self.moment or self.sense

    @property
    def name(self) -> str:
        """The requested quantity by its column: ``a_D``, ``a_D_sketch``, ``v_D_value``, ``kL``, ``J3``."""
        of_value = None if self.value is None else value_name(self.value)
        sense = self.sense and f"{self.sense}_sense"
        if self.vector and self.figure:
            return f"{self.vector}{ON_SKETCH}"
        told = (self.vector, of_value, self.angular, self.moment, sense, self.scale, self.link, self.point)
        return next(filter(None, told), "")

    @property
    def is_on_sketch(self) -> bool:
        """True for a point of the sketch, and for a vector drawn again on it."""
        return bool(self.point or self.figure)

    @property
    def section(self) -> Section:
        """The part of the work that it belongs to."""
        if self.link is not None or self.is_on_sketch:
            return "mechanism"
        if self.scale is not None:
            return "scales"
        return SECTIONS.get(kind_of(self.turning or self.name).name, "acceleration_plan")


ASKED = ("vector", "value", "angular", "moment", "sense", "scale", "link", "point")
"""The keys of a criterion that say what it asks for."""


class RubricFile(Authored):
    """A rubric as authored.

    `accelerations`: the inertia forces of force plans follow from accelerations that are given, or from the
    student's own plan; by default from the own one where a page shows it.
    """

    schema_version: Literal[1]
    id: Identifier
    title: Text
    tolerance: ToleranceTable = ToleranceTable()
    hand: HandTable = HandTable()
    doubt: DoubtTable = DoubtTable()
    weights: WeightsTable = WeightsTable()
    missing: Literal["review", "none", "not_judged"] = "none"
    """The verdict on a requested item that was not handed in; a blank in a table is never `review`."""
    least_confidence: Annotated[float, Field(ge=0.0, le=1.0)] = 0.9
    """A value read with less confidence is no evidence for follow-through."""
    follow_through: bool = True
    least_followed_share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.2
    """If an earlier answer makes a vector shorter than this share of the right length, it is not judged: such
    a follow-through is trivial."""
    accelerations: Literal["given", "own"] | None = None
    values_alone: bool = False
    """True if a computed value counts for a vector without its drawn length."""
    criterion: Annotated[list[CriterionTable], Field(min_length=1)]

    @property
    def max_score(self) -> float:
        """All points."""
        return sum(self.points.values())

    @property
    def vectors(self) -> tuple[str, ...]:
        """The requested vectors of the plans."""
        return tuple(one.vector for one in self.criterion if one.vector and not one.figure)

    @property
    def on_sketch(self) -> tuple[str, ...]:
        """The requested points and vectors of the sketch."""
        return tuple(one.name for one in self.criterion if one.is_on_sketch)

    @property
    def values(self) -> tuple[str, ...]:
        """The vectors whose computed value has a criterion of its own."""
        return tuple(criterion.value for criterion in self.criterion if criterion.value)

    @property
    def moments(self) -> tuple[str, ...]:
        """The moments that are asked for, or whose sense is."""
        names = (one.moment or one.sense or "" for one in self.criterion)
        return tuple(dict.fromkeys(name for name in names if kind_of(name).name == "moment"))

    @property
    def entries(self) -> tuple[str, ...]:
        """The numbers that have cells on a printed sheet: lengths of vectors, and ``NAME_value``."""
        return (*self.vectors, *map(value_name, (*self.values, *self.moments)))

    @property
    def needs_accelerations(self) -> bool:
        """True if any criterion needs the acceleration plan."""
        return any(kind_of(c.name).omegas == 2 or (c.point or "").startswith("J") for c in self.criterion)

    def tolerance_of(self, asked: CriterionTable | str) -> ToleranceTable:
        """Return the tolerance of a criterion, or of the vector, angular quantity, scale or link so named.

        It is the criterion's own, else the rubric's; of a computed value, that of its vector. If several
        criteria ask for the same name, the first one with a tolerance of its own counts for it.
        """
        if not isinstance(asked, str):
            return asked.tolerance or (self.tolerance_of(asked.value) if asked.value else self.tolerance)
        own = (one.tolerance for one in self.criterion if one.tolerance is not None and one.name == asked)
        return next(own, self.tolerance)

    def follows_through(self, criterion: CriterionTable) -> bool:
        """Return whether full marks are given for values that follow from an earlier wrong value."""
        return self.follow_through if criterion.follow_through is None else criterion.follow_through

    @property
    def points(self) -> Mapping[str, float]:
        """Points by criterion, scaled so that each section has its weight, which they add up to in cents."""
        found, before, authored = dict[str, float](), dict[Section, float](), self.sections
        for one in self.criterion:
            section, found[one.id] = one.section, one.points
            weight = self.weight_of(section)
            if weight is not None:
                exact, first = one.points * weight / authored[section], before.get(section, 0.0)
                before[section] = last = first + exact
                end = weight if math.isclose(last, weight) else round(last, 2)
                found[one.id] = round(end - round(first, 2), 6) or exact
        return found

    def weight_of(self, section: Section) -> float | None:
        """Return the weight of a section; None if its points determine it."""
        weight: float | None = getattr(self.weights, section)
        return weight

    @property
    def sections(self) -> Mapping[Section, float]:
        """The points of each section as authored."""
        found: dict[Section, float] = {}
        for criterion in self.criterion:
            section = criterion.section
            found[section] = found.get(section, 0.0) + criterion.points
        return found


# What a rubric asks to be read ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Asked:
    """The figures and vectors to read on pages; everything if no figure is named.

    Attributes
    ----------
    figures : those that a rubric has criteria for, and the sketch
    vectors : all vectors of these figures, and what is asked for on the sketch
    entries : the vectors and values that have cells on the printed sheets of the `assignment`
    """

    figures: frozenset[str] = frozenset()
    vectors: tuple[str, ...] = ()
    entries: tuple[str, ...] = ()
    assignment: Assignment | None = None

    @property
    def units(self) -> dict[str, str]:
        """The units of scales that are written as bare numbers, by scale."""
        return {} if self.assignment is None else dict(self.assignment.file.scales.bare_units.items())


def asked_of(assignment: Assignment, rubric: RubricFile) -> Asked:
    """Return what must be read for a rubric."""
    construction = construction_for(assignment, **plans_asked(assignment, rubric))
    known = [construction.vectors[name] for name in rubric.vectors if name in construction.vectors]
    plans = dict.fromkeys(construction.figure_of(vector.head) for vector in known)
    figures = frozenset({MECHANISM, *plans} if plans else ())
    vectors = tuple(vector.name for plan in plans for vector in construction.vectors_of(plan))
    return Asked(figures, (*vectors, *rubric.on_sketch), rubric.entries, assignment)


def scales_asked(assignment: Assignment, rubric: RubricFile) -> tuple[str, ...]:
    """Return the scales that students declare: the assignment's, ka only if accelerations are needed."""
    needed = plans_asked(assignment, rubric)["accelerations"]
    return tuple(name for name in assignment.scale_names if name != "ka" or needed)


def accelerations_of(assignment: Assignment, rubric: RubricFile) -> Literal["given", "own"] | None:
    """Return where the accelerations of the inertia forces are from; None if no page shows a force plan."""
    return assignment.forces and (rubric.accelerations or assignment.forces)


class PlansAsked(TypedDict):
    """The plans that a construction needs, as its function takes them."""

    accelerations: bool
    forces: Literal["given", "own"] | None


def plans_asked(assignment: Assignment, rubric: RubricFile) -> PlansAsked:
    """Return which plans the construction of an assignment needs for a rubric."""
    forces = accelerations_of(assignment, rubric)
    return {"accelerations": rubric.needs_accelerations or forces == "own", "forces": forces}


def check_accelerations(assignment: Assignment, rubric: RubricFile) -> Iterator[Finding]:
    """Report accelerations that no page shows, and those for which there is no force plan."""
    told = rubric.accelerations
    if told is not None and accelerations_of(assignment, rubric) is None:
        yield Finding("$.accelerations", "no_force_plans")
    elif told == "own" and "acceleration_plan" not in assignment.figures:
        yield Finding("$.accelerations", "no_own_accelerations")


def check_rubric(rubric: RubricFile, construction: Construction) -> list[Finding]:
    """Report names in the rubric that the construction does not know."""
    known = {
        "vector": tuple(construction.vectors),
        "value": tuple(construction.vectors),
        "angular": tuple(construction.rates),
        "moment": tuple(construction.moments),
        "sense": (*construction.rates, *construction.moments),
        "link": tuple(construction.links),
        "point": tuple(construction.centres),
    }
    on_sketch = tuple(name for name in construction.vectors if f"{name}{ON_SKETCH}" in construction.on_sketch)
    return [
        Finding(
            f"$.criterion[{index}].{key}",
            "not_in_mechanism",
            {"name": name, **({"texts": tuple(names)} if names else {}), **look_alikes(name)},
        )
        for index, criterion in enumerate(rubric.criterion)
        for key, all_names in known.items()
        for names in (on_sketch if key == "vector" and criterion.figure else all_names,)
        if (name := getattr(criterion, key)) is not None and name not in names
    ]


# Files ---------------------------------------------------------------------------------------------


def rubric_of(assignment: Assignment) -> RubricFile:
    """Return the rubric of an assignment, checked against its mechanism.

    Raises AuthoredFileError with every fault, including names that the mechanism does not have.
    """
    rubric = load_rubric(assignment.file.rubric, beside=assignment.path)
    findings = check_rubric(rubric, construction_for(assignment))
    findings += check_accelerations(assignment, rubric)
    if findings:
        path = locate("rubric", assignment.file.rubric, assignment.path)
        raise AuthoredFileError(str(path), tuple(findings))
    return rubric


def load_both(name: str | Path) -> tuple[Assignment, RubricFile]:
    """Load an assignment and its rubric; raises AuthoredFileError with the faults of all their files."""
    faults, assignment, rubric = Faults(), None, None
    path = locate("assignment", str(name)).resolve()
    with faults:
        assignment = load_assignment(name, faults)
    with faults:
        # Whatever faults the assignment has, its rubric is read; or the rubric that was named in its place.
        named = str(path) if file_kind(path) == "rubric" else table_of(path).get("rubric")
        if isinstance(named, str):
            rubric = load_rubric(named, beside=path, unknown=faults)
    if faults.errors and assignment and rubric:
        file = locate("rubric", assignment.file.rubric, assignment.path).resolve()
        faults.add(file, check_rubric(rubric, construction_for(assignment)))
    faults.tell()
    return cast("Assignment", assignment), cast("RubricFile", rubric)


def load_rubric(name: str | Path, *, beside: Path | None = None, unknown: Faults | None = None) -> RubricFile:
    """Load a rubric by its built-in name, from beside the assignment's file, or by its path.

    Raises CallError for an unknown name, AuthoredFileError with every fault of the file. Arguments: `unknown`
    as for `load_assignment`.
    """
    path = locate("rubric", str(name), beside)
    if not is_file(path) and not str(name).endswith(".toml"):
        if beside is None:
            raise CallError("unknown_rubric", name=str(name))
        missing = Finding("$.rubric", "no_file_of_name", {"text": str(name), "file": path.name})
        raise AuthoredFileError(str(beside), (missing,))
    rubric, found = _load(path.resolve(), path.stat().st_mtime_ns if is_file(path) else 0)
    found.pass_to(unknown)
    return rubric


@cache
def _load(path: Path, _changed_ns: int) -> tuple[RubricFile, Faults]:
    found = Faults()
    rubric = load(RubricFile, path, found)
    found.add(path, [*_twice(rubric), *_reserved(rubric), *_idle_weights(rubric)])
    return rubric, found


def _twice(rubric: RubricFile) -> Iterator[Finding]:
    ids = [criterion.id for criterion in rubric.criterion]
    for index, name in enumerate(ids):
        if name in ids[:index]:
            yield Finding(f"$.criterion[{index}].id", "there_twice", {"text": name})


def _reserved(rubric: RubricFile) -> Iterator[Finding]:
    """Report ids that have another meaning in people's decisions."""
    for index, criterion in enumerate(rubric.criterion):
        if criterion.id in {"total", "comment"}:
            yield Finding(f"$.criterion[{index}].id", "id_of_decisions", {"name": criterion.id})


def _idle_weights(rubric: RubricFile) -> Iterator[Finding]:
    """Report weights of sections without criteria."""
    kinds = {
        "mechanism": "link",
        "scales": "scale",
        "velocity_plan": "vector",
        "acceleration_plan": "vector",
        "angular": "angular",
        "force_plans": "vector",
    }
    for section, kind in kinds.items():
        if getattr(rubric.weights, section) is not None and section not in rubric.sections:
            yield Finding(f"$.weights.{section}", "weight_idle", {"name": kind})
