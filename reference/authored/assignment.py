"""An assignment: its variants, scales, sheets and names, and the mechanisms of its variants.

Built from authored files, found by name in the library of built-in ones or by path. Everything is
evaluated on arrays over variants.
"""

import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any, Literal, Self, cast

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from reference.authored import toml_file
from reference.authored.assembly import LARGEST, Numbers, build_driver, build_mechanism
from reference.authored.bodies import NOT_NEGATIVE, Masses, check_masses, with_centres, with_masses
from reference.authored.flat_positions import signs_of, with_signs
from reference.authored.formula import CONSTANTS, FUNCTIONS, Formula, FormulaError, Value
from reference.authored.mechanism import MechanismFile, check_mechanism
from reference.authored.toml_file import LENGTH_UNITS_M, Authored, FormulaText, Identifier, SideText, Text
from reference.authored.variant_table import (
    KEYS,
    LENGTHS,
    MOST_VARIANTS,
    DataTable,
    VariantRows,
    formulas_in,
    misused_columns,
    or_its_file,
    read_rows,
)
from reference.errors import (
    AuthoredFileError,
    CallError,
    FaultError,
    Faults,
    Finding,
    Parameter,
    nearest,
    ranges_of,
)
from reference.geometry import FloatArray
from reference.kinematics.motion import BoolArray
from reference.mechanism import Crank, Driver, Mechanism, Triad, members_of
from reference.quantities import FIGURE, FORCE_PLAN, FORCE_PLANS, SCALE_UNITS, group_of, scale_of, zone_of


class Range(Authored):
    """Whole numbers from .. to, both included."""

    first: Annotated[int, Field(alias="from")]
    last: Annotated[int, Field(alias="to")]

    @property
    def values(self) -> range:
        """The numbers."""
        return range(self.first, self.last + 1)


class VariantTable(Authored):
    """The values that follow from a student's number n (and a position): a table's data, then formulas."""

    n: Range | None = None
    position: Range | None = None
    table: Annotated[DataTable | None, Field(json_schema_extra=or_its_file)] = None
    values: dict[Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")], FormulaText] = Field(default={})

    @model_validator(mode="after")
    def _has_no_more_than_can_be_graded(self) -> Self:
        count = 1
        for numbers in (self.n, self.position):
            count *= 1 if numbers is None else max(numbers.last - numbers.first + 1, 0)
        if count > MOST_VARIANTS:
            raise FaultError("variants_many", count=count, most=MOST_VARIANTS)
        return self


class ScalesTable(Authored):
    """The assignment's own rule for the scales.

    Formulas of the variant's values and of `crank_mm` (drawn length of the crank), `crank_m` (its
    real length), `omega`, then `kL`, then `kv`; where a slider drives, of `speed` instead (m/s). kF, for
    force plans, may use `force`, too (N): the variant's largest given force.
    """

    crank_mm: FormulaText | None = None
    kL: FormulaText  # noqa: N815 - the field's own name for it
    kv: FormulaText
    ka: FormulaText
    kF: FormulaText | None = None  # noqa: N815
    bare_units: dict[Literal["kL", "kv", "ka", "kF"], str] = Field(default={})
    """The unit of a scale that a student writes as a bare number, where the assignment says one."""

    @property
    def rules(self) -> dict[str, Formula]:
        """The formulas of the scales, by name, in the order in which each may follow from those before."""
        return {name: rule for name in SCALE_NAMES if (rule := getattr(self, name)) is not None}


PageKind = Literal["all", "velocity", "acceleration", "mechanism", "forces"]
GridSide = Annotated[int, Field(ge=1, le=6)]


def _of_a_figure(name: str) -> str:
    if not re.fullmatch(FIGURE, name):
        known = "mechanism, velocity_plan, acceleration_plan"
        raise FaultError("one_of", names=f"{known}, {FORCE_PLAN}JOINT")
    return name


FigureName = Annotated[str, AfterValidator(_of_a_figure), Field(json_schema_extra={"pattern": FIGURE})]


class PageTable(Authored):
    """A sheet that a student hands in, with the figures drawn on it.

    With a `grid` (columns, rows) it has one figure in all positions: each in a zone of its own, from the
    left, row after row; all in one zone where it is 1 by 1, as a mechanism about its fixed pivots.
    """

    kind: PageKind
    figures: Annotated[list[FigureName], Field(min_length=1)]
    grid: Annotated[list[GridSide], Field(min_length=2, max_length=2)] | None = None

    @model_validator(mode="after")
    def _has_one_figure_in_a_grid(self) -> Self:
        if self.grid is not None and len(self.figures) > 1:
            raise FaultError("grid_one_figure")
        return self


class GivenTable(Authored):
    """One item of the given data as the student reads it: label = value unit."""

    label: str
    value: FormulaText
    unit: str = ""


TRADITIONS: dict[str, dict[str, str]] = {
    "o": {},
    "p": {"o": "p", "o'": "π", "kL": "μl", "kv": "μv", "ka": "μa", "kF": "μF"},
}
"""Names that schools use for poles and scales: o, o', kL, kv, ka, kF; or p, π, μl, μv, μa, μF."""


class AssignmentFile(Masses):
    """An assignment: a mechanism, its variants, the scales, the sheets, the names that students see.

    `tradition` fills `names` with those of a school; names given one by one take precedence.
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

    @model_validator(mode="after")
    def _has_a_zone_for_each_position(self) -> Self:
        position = self.variant.position
        for page in self.page:
            columns, rows = page.grid or (1, 1)
            if page.grid and position is None:
                raise FaultError("grid_positions")
            if position and 1 < columns * rows < len(position.values):
                raise FaultError("grid_small", columns=columns, rows=rows)
        return self

    @model_validator(mode="before")
    @classmethod
    def _with_names_of_its_tradition(cls, data: Any) -> Any:  # noqa: ANN401 - not yet validated
        if not isinstance(data, dict) or not isinstance(data.get("names", {}), dict):
            return data
        of_the_school = TRADITIONS.get(str(data.get("tradition", "o")), {})
        return {**data, "names": {**of_the_school, **data.get("names", {})}}


@dataclass(frozen=True, slots=True)
class Variant:
    """One student's task: the number n and the position, None if the assignment has none."""

    n: int | None = None
    position: int | None = None

    @property
    def numbers(self) -> dict[str, int]:
        """The number and the position by name, as far as the assignment has them."""
        return {name: value for name in KEYS if (value := getattr(self, name)) is not None}

    def __str__(self) -> str:
        return ", ".join(f"{name} = {value}" for name, value in self.numbers.items()) or "the only variant"


SCALE_NAMES = tuple(SCALE_UNITS)
USUAL_SCALES = SCALE_NAMES[:3]
"""Those of an assignment without forces."""


@dataclass(frozen=True, slots=True)
class Scales:
    """Real units per millimetre on paper: m/mm, (m/s)/mm, (m/s^2)/mm; N/mm where an assignment has forces."""

    kL: FloatArray  # noqa: N815 - the field's own name for it
    kv: FloatArray
    ka: FloatArray
    kF: FloatArray | None = None  # noqa: N815

    @property
    def by_name(self) -> dict[str, FloatArray]:
        """Every scale that there is, by name."""
        return {name: scale for name in SCALE_NAMES if (scale := getattr(self, name)) is not None}


@dataclass(frozen=True, slots=True)
class Assignment:
    """An assignment and its mechanism, as authored, and the files they came from."""

    file: AssignmentFile
    mechanism_file: MechanismFile
    path: Path
    rows: VariantRows | None = None
    """Rows of the table of variants, if there is one."""
    signs: Mapping[str, Mapping[Variant, float]] = field(default_factory=dict)
    """-1 for each group and variant that has passed a flat position on its way from the first position."""
    speed: tuple[float, float] = (1.0, 1.0)
    """A student's own omega and epsilon of the crank, as factors of the given ones."""
    is_at_given_scales: bool = False
    """True if the rule for the scales takes the given omega nevertheless."""

    @property
    def id(self) -> str:
        """Its name."""
        return self.file.id

    @property
    def own_files(self) -> tuple[Path, ...]:
        """The assignment's file, and the CSV of its variants where it has one."""
        table = self.file.variant.table
        return (self.path, *([self.path.parent / table.file] if table and table.file else []))

    @property
    def shared_positions(self) -> tuple[int, ...]:
        """The positions, where a sheet has all of them; else none."""
        is_shared = any(page.grid for page in self.file.page)
        return tuple(self.numbers("position") or ()) if is_shared else ()

    @property
    def figures(self) -> tuple[str, ...]:
        """The figures on its pages, each once."""
        return tuple(dict.fromkeys(figure for page in self.file.page for figure in page.figures))

    @property
    def forces(self) -> Literal["given", "own"] | None:
        """Whence the accelerations of its force plans come: data, or its pages' own plan; None without."""
        if not any(group_of(figure) for figure in self.figures):
            return None
        return "own" if "acceleration_plan" in self.figures else "given"

    @property
    def names(self) -> dict[str, str]:
        """The names that students see instead of others; the driving link's force plan has a title's key."""
        return {**self.file.names, f"{FORCE_PLAN}{self.mechanism_file.driver.pin}": "driving_force_plan"}

    @property
    def scale_names(self) -> tuple[str, ...]:
        """The scales of the drawings: kL, kv and ka; with force plans from given accelerations, kL and kF."""
        drawn = {scale_of(figure) for figure in self.figures}
        usual = USUAL_SCALES if self.forces != "given" else USUAL_SCALES[:1]
        return tuple(name for name in SCALE_NAMES if name in drawn or name in usual)

    def variants(self) -> list[Variant]:
        """Return every variant, by number, then by position."""
        spec = self.file.variant
        numbers = list(spec.n.values) if spec.n else [None]
        positions = list(spec.position.values) if spec.position else [None]
        if self.rows is None:
            return [Variant(n, position) for n in numbers for position in positions]
        numbered, positioned = self.rows.has
        keys = {
            (key[0] if numbered else n, key[1] if positioned else position)
            for key in self.rows.keys
            for n in numbers
            for position in positions
        }
        return [Variant(*key) for key in sorted(keys, key=lambda key: (key[0] or 0, key[1] or 0))]

    def numbers(self, name: str) -> list[int] | None:
        """Values of `n` or `position`, ascending; None if the assignment has none."""
        known = {getattr(variant, name) for variant in self.variants()}
        return None if None in known else sorted(known)

    def positions(self, position: int | None) -> list[int | None]:
        """Return the position asked for; every one if none is named, and None where there are none."""
        every = self.numbers("position") if position is None else None
        return [position] if every is None else [*every]

    def variant(self, n: int | None, position: int | None = None) -> Variant:
        """Return the requested variant; raises CallError that says what is missing or out of range."""
        variants = self.variants()
        for name, given in (("n", n), ("position", position)):
            known = sorted({getattr(variant, name) for variant in variants} - {None})
            if not known:
                continue
            ranges, by = ranges_of(known), self.rows.source if self.rows else ""
            told: dict[str, Parameter] = {"name": name, "texts": ranges + (f" ({by})" if by else "")}
            said = f"{name} = {ranges}" + (f", by {by}" if by else "")
            if given is None:
                message = f"assignment {self.id} needs --{name} ({said})"
                raise CallError(f"{name}_needed", message, cause="number_needed", **told)
            if given not in known:
                message = f"{name} = {given}: assignment {self.id} has {said}"
                raise CallError(f"{name}_range", message, cause="number_range", value=given, **told)
            variants = [variant for variant in variants if getattr(variant, name) == given]
        return variants[0]

    def values(self, variants: list[Variant]) -> dict[str, Value]:
        """Return the variants' data by name, arrays of shape (N,)."""
        known: dict[str, Value] = {}
        for name in KEYS:
            numbers = [getattr(variant, name) for variant in variants]
            if numbers and numbers[0] is not None:
                known[name] = np.array(numbers, dtype=np.float64)
        if self.rows is not None:
            known |= self.rows.data([(variant.n, variant.position) for variant in variants])
        for name, formula in self.file.variant.values.items():
            known[name] = formula(known)
        return known

    def given(self, variant: Variant) -> Iterator[tuple[GivenTable, float | str]]:
        """Yield each given datum with its number, or with the side that the table states in words."""
        values = self.values([variant])
        for datum in self.file.given:
            number = float(np.ravel(datum.value(values))[0])
            column = self.rows.columns.get(datum.value.text) if self.rows else None
            yield datum, column.words[number < 0.0] if column and column.words else number

    def mechanism(self, variants: list[Variant]) -> Mechanism:
        """Return the mechanism of every variant, SI, arrays of shape (N,).

        The positions of one n are one motion: sides hold in the first position that is not flat, and each
        flat position on the way reverses them. With bodies, it has their centres of mass as points.
        """
        file, values, count = self.file, self.values(variants), len(variants)
        mechanism = build_mechanism(with_centres(self.mechanism_file, file.body), values, count)
        if file.has_forces:
            numbers = Numbers(values, count, LENGTH_UNITS_M[self.mechanism_file.length_unit])
            mechanism = with_masses(mechanism, numbers, file)
        return with_signs(
            replace(mechanism, driver=self._at_speed(mechanism.driver)),
            {node: np.array([sign[variant] for variant in variants]) for node, sign in self.signs.items()},
        )

    def scales(
        self,
        variants: list[Variant],
        *,
        crank_mm: float | FloatArray | None = None,
        **declared: float | FloatArray | None,
    ) -> Scales:
        """Return the scales: those declared, the others by the assignment's rule.

        A declared kL, or the drawn crank, replaces the proposed length of the crank.
        """
        known = self.scale_values(variants, crank_mm=crank_mm, **declared)
        return Scales(
            **{name: np.broadcast_to(known[name], (len(variants),)) for name in self.file.scales.rules}
        )

    def scale_values(
        self,
        variants: list[Variant],
        *,
        crank_mm: float | FloatArray | None = None,
        **declared: float | FloatArray | None,
    ) -> dict[str, Value]:
        """Return the values of `scales`, and those that its rule may use."""
        known = self.values(variants)
        driver = build_driver(self.mechanism_file, known, len(variants))
        driver = driver if self.is_at_given_scales else self._at_speed(driver)
        if isinstance(driver, Crank):
            known |= {"omega": np.abs(driver.omega), "crank_m": driver.length_m}
        else:
            known["speed"] = np.abs(driver.speed)
        rule = self.file.scales
        if crank_mm is not None:
            known["crank_mm"] = np.asarray(crank_mm, float)
        elif rule.crank_mm is not None:
            known["crank_mm"] = rule.crank_mm(known)
        if rule.kF is not None:
            known |= self._forces(variants)
        for name, formula in rule.rules.items():
            given = declared.get(name)
            known[name] = formula(known) if given is None else np.asarray(given, float)
            if name == "kL" and given is not None and "crank_m" in known:
                known["crank_mm"] = np.asarray(known["crank_m"]) / known[name]
        return known

    def _forces(self, variants: list[Variant]) -> dict[str, Value]:
        """Return the values of the forces that the rule for kF may use: ``force``, the largest given one."""
        forces = [np.abs(load.force) for load in self.mechanism(variants).loads if load.force is not None]
        return {"force": np.max(np.broadcast_arrays(*forces), axis=0)} if forces else {}

    def _at_speed(self, driver: Driver) -> Driver:
        if not isinstance(driver, Crank):
            return driver
        omega, epsilon = self.speed
        return replace(driver, omega=driver.omega * omega, epsilon=driver.epsilon * epsilon)


# Files ---------------------------------------------------------------------------------------------

SUFFIXES = {"assignment": ".assignment.toml", "mechanism": ".mechanism.toml", "rubric": ".rubric.toml"}


def library() -> Path:
    """Return the folder of built-in files: inside the installed package, or beside it in a checkout."""
    installed = Path(__file__).resolve().parents[1] / "rubrics"
    return installed if installed.is_dir() else installed.parents[1] / "rubrics"


def names_in(folder: Path, kind: str) -> list[str]:
    """Return the names of the authored files of one kind in a folder."""
    suffix = SUFFIXES[kind]
    return sorted(path.name.removesuffix(suffix) for path in folder.glob(f"*{suffix}"))


def built_in() -> list[str]:
    """The names of the built-in assignments."""
    return names_in(library(), "assignment")


def locate(kind: str, name: str, beside: Path | None = None) -> Path:
    """Return the file that a reference means: a path ending in .toml, a neighbour, or a built-in name."""
    if name.endswith(".toml") or os.sep in name:
        path = Path(name)
        return path if path.is_absolute() or beside is None else beside.parent / path
    file = f"{name}{SUFFIXES[kind]}"
    if beside is not None and toml_file.is_file(beside.parent / file):
        return beside.parent / file
    return library() / file


_KEYS_OF = {"assignment": "scales", "mechanism": "ground", "rubric": "criterion"}
"""A key of each kind of file that no other kind has."""
_GIVEN = {"mechanism": "mechanism_given", "rubric": "rubric_given"}
Kind = Literal["assignment", "mechanism", "rubric", "table"]


def file_kind(path: Path) -> Kind:
    """Return the kind of an authored file, by what it holds, else by its name; a table is no TOML."""
    if path.suffix != ".toml":
        return "table"
    data: dict[str, Any] = {}
    with Faults():  # whatever faults it has
        data = toml_file.table_of(path)
    kinds = [kind for kind, key in _KEYS_OF.items() if key in data]
    kinds += [kind for kind, suffix in SUFFIXES.items() if path.name.endswith(suffix)]
    return cast("Kind", next(iter(kinds), "assignment"))


def load_assignment(name: str | Path, unknown: Faults | None = None) -> Assignment:
    """Load a built-in assignment by its name, or one from the path of its file.

    Raises CallError for an unknown name (naming the known ones), AuthoredFileError with every
    fault of the files.

    Arguments: `unknown` gathers the keys that the files cannot have, where these are their only faults.
    """
    path = locate("assignment", str(name))
    if not toml_file.is_file(path) and not str(name).endswith(".toml"):
        raise CallError("unknown_assignment", name=str(name), names=tuple(built_in()))
    assignment, found = _load(path.resolve(), path.stat().st_mtime_ns if toml_file.is_file(path) else 0)
    found.pass_to(unknown)
    return assignment


@cache
def _load(path: Path, _changed_ns: int) -> tuple[Assignment, Faults]:
    """Return an assignment, and the keys that its files cannot have; raises them with any other faults."""
    unknown, assignment = Faults(), None
    with unknown:
        assignment = _read(path, unknown)
    if assignment is None:
        unknown.tell()
    return cast("Assignment", assignment), unknown


def _read(path: Path, unknown: Faults) -> Assignment:
    data, faults = toml_file.table_of(path), Faults()
    if (kind := file_kind(path)) in _GIVEN:
        own = path.with_name(path.name.replace(SUFFIXES[kind], SUFFIXES["assignment"]))
        known: dict[str, Parameter] = {"near": own.name} if own != path and own.is_file() else {}
        faults.add(path, [Finding("$", _GIVEN[kind], known)])
        with faults:
            _mechanism_of(str(path) if kind == "mechanism" else None, path, faults)
        faults.tell()
    try:
        file = toml_file.validate(AssignmentFile, data, str(path), unknown)
    except AuthoredFileError as error:
        faults.errors.append(error)
        with faults:
            _mechanism_of(data.get("mechanism"), path, unknown)
        faults.tell()
        raise
    source, mechanism, rows = path, file.mechanism, None
    with faults:
        source, mechanism = _mechanism_of(mechanism, path, unknown)
    if file.variant.table is not None:
        unit = mechanism.length_unit if isinstance(mechanism, MechanismFile) else "m"
        with faults:
            table, rows = read_rows(file.variant.table, path, LENGTH_UNITS_M[unit])
            file = file.model_copy(update={"variant": file.variant.model_copy(update={"table": table})})
    faults.add(path, _check_values(file))
    faults.tell()
    assignment = Assignment(file, cast("MechanismFile", mechanism), path, rows)
    faults.add(path, _check_table(assignment))
    faults.tell()
    _check_formulas(assignment, source).tell()
    faults.add(path, _check_force_plans(assignment))
    faults.tell()
    variants = assignment.variants()
    if not assignment.numbers("position"):
        return assignment
    signs = signs_of(assignment.mechanism(variants), [variant.n for variant in variants])
    by_variant = {node: dict(zip(variants, passed.tolist(), strict=True)) for node, passed in signs.items()}
    return replace(assignment, signs=by_variant)


def _mechanism_of(named: object, beside: Path, unknown: Faults) -> tuple[Path, Any]:
    """Return the file of an assignment's mechanism, and the mechanism, checked; of the assignment if none."""
    source, within, faults = beside, "$.mechanism", Faults()
    if isinstance(named, str):
        source, within = locate("mechanism", named, beside), "$"
        if not toml_file.is_file(source):
            known = (*names_in(beside.parent, "mechanism"), *names_in(library(), "mechanism"))
            looked = {"text": named, "file": source.name, **nearest(named, known)}
            raise AuthoredFileError(str(beside), (Finding("$.mechanism", "no_file_of_name", looked),))
        named = toml_file.load(MechanismFile, source, unknown)
    if isinstance(named, MechanismFile):
        found = check_mechanism(named)
        faults.add(source, [replace(one, path=one.path.replace("$", within, 1)) for one in found])
    faults.tell()
    return source, named


def _check_values(file: AssignmentFile) -> Iterator[Finding]:
    """Report names that formulas already define, and empty ranges."""
    for name in file.variant.values:
        if name in CONSTANTS or name in FUNCTIONS or name in KEYS:
            yield Finding(f"$.variant.values.{name}", "name_of_formulas", {"name": name})
    for name in KEYS:
        numbers = getattr(file.variant, name)
        if numbers is not None and not numbers.values:
            yield Finding(f"$.variant.{name}", "range_empty")


def _check_table(assignment: Assignment) -> Iterator[Finding]:
    """Check a table's columns against the keys beside it, and its units against the keys that use them."""
    spec, rows = assignment.file.variant, assignment.rows
    if rows is None:
        return
    for name, has in zip(KEYS, rows.has, strict=True):
        if has and getattr(spec, name) is not None:
            yield Finding(f"$.variant.{name}", "column_too", {"name": name, "file": rows.source})
    if (count := len(assignment.variants())) > MOST_VARIANTS:
        yield Finding("$.variant", "variants_many", {"count": count, "most": MOST_VARIANTS})
    for name in spec.values:
        if name in rows.columns:
            yield Finding(f"$.variant.values.{name}", "column_too", {"name": name, "file": rows.source})
    named, place = assignment.file.mechanism, "$.mechanism"
    if isinstance(named, str):
        place = f"{locate('mechanism', named, assignment.path).name} $"
    yield from misused_columns(assignment.mechanism_file, rows, place)
    yield from misused_columns(assignment.file.body, rows, "$.body")
    yield from misused_columns(assignment.file.load, rows, "$.load")


def _check_formulas(assignment: Assignment, source: Path) -> Faults:
    """Report names that no formula above defines, and formulas that fail for some variant, one by one.

    A formula that depends on a faulty value is not reported.

    Arguments: `source` is the mechanism's file.
    """
    variants, file = assignment.variants(), assignment.file
    spec = file.variant.model_copy(update={"values": {}})
    known = replace(assignment, file=file.model_copy(update={"variant": spec})).values(variants)
    broken: set[str] = set()

    def check(path: str, names: frozenset[str], evaluate: Callable[[], object]) -> list[Finding]:
        try:
            if not broken & names:
                evaluate()
        except FormulaError as error:
            return [error.at(path + error.path, **_failing(variants, error.which))]
        return []

    own: list[Finding] = []
    for name, formula in file.variant.values.items():
        own += check(f"$.variant.values.{name}", formula.names, partial(formula, known))
        if own or broken & formula.names:
            broken.add(name)
        else:
            known[name] = formula(known)
    top = "$.mechanism" if isinstance(file.mechanism, MechanismFile) else "$"
    numbers = Numbers(known, len(variants), LENGTH_UNITS_M[assignment.mechanism_file.length_unit])
    of_mechanism: list[Finding] = []
    for path, key, leaf in formulas_in(assignment.mechanism_file, top):
        if isinstance(leaf, SideText):
            names = leaf.side.names if isinstance(leaf.side, Formula) else frozenset()
            of_mechanism += check(path, names, partial(numbers.side, leaf))
        else:
            read = partial(numbers.length, what=key) if key in LENGTHS else numbers.number
            of_mechanism += check(path, leaf.names, partial(read, leaf))
    for path, key, formula in file.formulas:
        read = partial(numbers.amount, what=key) if key in NOT_NEGATIVE else numbers.number
        own += check(path, formula.names, partial(read, formula))
    faults = Faults()
    if not (own or of_mechanism):
        none = {name: field.default for name, field in Masses.model_fields.items()}
        plain = replace(assignment, file=file.model_copy(update=none))
        of_mechanism += check(top, frozenset(), partial(plain.mechanism, variants))
        own += [] if of_mechanism else check_masses(file, plain.mechanism_file, plain.mechanism(variants[:1]))
        if file.has_forces and not (own or of_mechanism):
            own += check("$.body", frozenset(), partial(assignment.mechanism, variants))
        own += [] if own or of_mechanism else _check_scales(assignment, variants)
    for index, datum in enumerate(file.given):
        own += check(f"$.given[{index}].value", datum.value.names, partial(datum.value, known))
    faults.add(assignment.path, own)
    faults.add(source, of_mechanism)
    return faults


def _check_scales(assignment: Assignment, variants: list[Variant]) -> Iterator[Finding]:
    """Report the first scale that cannot be computed, or is not above zero; the others follow from it."""
    rules = assignment.file.scales.rules
    known: dict[str, FloatArray | float] = dict.fromkeys(rules, 1.0)
    for name in tuple(known):
        del known[name]
        try:
            known[name] = getattr(assignment.scales(variants, **known), name)
        except FormulaError as error:
            yield error.at(f"$.scales.{name}", **_failing(variants, error.which))
            return
        if np.any(wrong := np.logical_not((known[name] > 1.0 / LARGEST) & (known[name] < LARGEST))):
            limit = "> 0" if np.any(known[name] <= 1.0 / LARGEST) else f"< {LARGEST:g}"
            told = {"text": rules[name].text, "name": name, "limit": limit, **_failing(variants, wrong)}
            yield Finding(f"$.scales.{name}", "limit", told)
            return


def _check_force_plans(assignment: Assignment) -> Iterator[Finding]:
    """Report force plans of joints that name no group, and a missing scale of forces."""
    if "kF" not in assignment.scale_names:
        return
    if assignment.file.scales.kF is None:
        yield Finding("$.scales.kF", "force_scale_missing")
    mechanism = assignment.mechanism(assignment.variants()[:1])
    for triad in (group for group in mechanism.groups if isinstance(group, Triad)):
        yield Finding("$.page", "force_plan_of_triad", {"joint": triad.node})
    # A cylinder that drives stands in the plan of its crank.
    driving = getattr(mechanism.driver, "cylinder", None)
    groups = [group for group in reversed(mechanism.groups) if members_of(group)]
    joints = [group.node for group in groups if driving is None or getattr(group, "link", "") != driving]
    known = tuple(f"{FORCE_PLAN}{joint}" for joint in (*joints, mechanism.driver.pin))
    for index, page in enumerate(assignment.file.page):
        others = {zone_of(figure) for figure in page.figures} - {FORCE_PLANS, "mechanism"}
        if others and any(map(group_of, page.figures)):
            yield Finding(f"$.page[{index}].figures", "force_plans_apart", {"figures": tuple(sorted(others))})
        for place, figure in enumerate(page.figures):
            if (joint := group_of(figure)) and joint not in (*joints, mechanism.driver.pin):
                told: dict[str, Parameter] = {"joint": joint, "texts": known}
                yield Finding(f"$.page[{index}].figures[{place}]", "force_plan_unknown", told)


def _failing(variants: list[Variant], which: BoolArray | None) -> dict[str, Parameter]:
    """Return, as parameters, the first variant for which a formula fails, and how many more there are."""
    if which is None or which.shape != (len(variants),) or len(variants) == 1:
        return {}
    first, more = str(variants[int(np.argmax(which))]), int(which.sum()) - 1
    return {"variant": first, "more": more} if more else {"variant": first}
