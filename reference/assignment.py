"""An assignment at work: its variants, the mechanism of each, the scales.

Built from authored files (`reference.authored`), found by name in the library of built-in ones or
by path. Everything is evaluated on arrays over variants.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np

from reference import authored
from reference.assembly import LARGEST, build_driver, build_mechanism
from reference.assignment_file import AssignmentFile
from reference.checking import check_mechanism
from reference.errors import AuthoredFileError, CallError, Finding
from reference.formula import Formula, FormulaError, Value
from reference.geometry import FloatArray
from reference.mechanism import Crank, Driver, Mechanism
from reference.mechanism_file import MechanismFile


@dataclass(frozen=True, slots=True)
class Variant:
    """One student's task: the number n and the position, None where the assignment has none."""

    n: int | None = None
    position: int | None = None

    def __str__(self) -> str:
        told = [
            f"{name} = {value}"
            for name, value in (("n", self.n), ("position", self.position))
            if value is not None
        ]
        return ", ".join(told) or "the only variant"


@dataclass(frozen=True, slots=True)
class Scales:
    """Real units per millimetre on paper: m/mm, (m/s)/mm, (m/s^2)/mm."""

    kL: FloatArray  # noqa: N815 - the field's own name for it
    kv: FloatArray
    ka: FloatArray


@dataclass(frozen=True, slots=True)
class Assignment:
    """An assignment and its mechanism, as authored, and where they came from."""

    file: AssignmentFile
    mechanism_file: MechanismFile
    path: Path

    @property
    def id(self) -> str:
        """Its name."""
        return self.file.id

    def variants(self) -> list[Variant]:
        """Every variant there is, numbers first, positions within."""
        spec = self.file.variant
        numbers = list(spec.n.values) if spec.n else [None]
        positions = list(spec.position.values) if spec.position else [None]
        return [Variant(n, position) for n in numbers for position in positions]

    def variant(self, n: int | None, position: int | None = None) -> Variant:
        """The variant asked for; raises CallError that says what is missing or out of range."""
        spec = self.file.variant
        chosen: dict[str, int | None] = {}
        for name, given, allowed in (("n", n, spec.n), ("position", position, spec.position)):
            if allowed is None:
                chosen[name] = None
                continue
            told = f"{name} from {allowed.first} to {allowed.last}"
            if given is None:
                raise CallError(f"{name}_needed", f"assignment {self.id} needs --{name} ({told})")
            if given not in allowed.values:
                raise CallError(f"{name}_range", f"{name} = {given}: assignment {self.id} has {told}")
            chosen[name] = given
        return Variant(**chosen)

    def values(self, variants: list[Variant]) -> dict[str, Value]:
        """The variants' data by name, arrays of shape (N,)."""
        known: dict[str, Value] = {}
        for name in ("n", "position"):
            numbers = [getattr(variant, name) for variant in variants]
            if numbers and numbers[0] is not None:
                known[name] = np.array(numbers, dtype=np.float64)
        for name, formula in self.file.variant.values.items():
            known[name] = formula(known)
        return known

    def mechanism(self, variants: list[Variant]) -> Mechanism:
        """The mechanism of every variant, SI, arrays of shape (N,)."""
        return build_mechanism(self.mechanism_file, self.values(variants), len(variants))

    def scales(
        self,
        variants: list[Variant],
        *,
        crank_mm: float | FloatArray | None = None,
        kL: float | FloatArray | None = None,  # noqa: N803
        kv: float | FloatArray | None = None,
        ka: float | FloatArray | None = None,
    ) -> Scales:
        """The scales: those declared, the others by the assignment's rule.

        A declared kL, or the drawn crank, replaces the proposed length of the crank.
        """
        known = self.values(variants)
        known |= _speeds(build_driver(self.mechanism_file, known, len(variants)))
        rule = self.file.scales
        if crank_mm is not None:
            known["crank_mm"] = np.asarray(crank_mm, float)
        elif rule.crank_mm is not None:
            known["crank_mm"] = rule.crank_mm(known)
        declared = {"kL": kL, "kv": kv, "ka": ka}
        for name in ("kL", "kv", "ka"):
            given = declared[name]
            known[name] = getattr(rule, name)(known) if given is None else np.asarray(given, float)
            if name == "kL" and given is not None and "crank_m" in known:
                known["crank_mm"] = np.asarray(known["crank_m"]) / known[name]
        shape = (len(variants),)
        return Scales(*(np.broadcast_to(known[name], shape) for name in ("kL", "kv", "ka")))


def _speeds(driver: Driver) -> dict[str, Value]:
    """What the rule for the scales knows of the driven link."""
    if isinstance(driver, Crank):
        return {"omega": np.abs(driver.omega), "crank_m": driver.length_m}
    return {"speed": np.abs(driver.speed)}


SUFFIXES = {"assignment": ".assignment.toml", "mechanism": ".mechanism.toml", "rubric": ".rubric.toml"}


def library() -> Path:
    """The folder of built-in files: inside the installed package, or beside it in a checkout."""
    installed = Path(str(files("reference"))) / "rubrics"
    return installed if installed.is_dir() else Path(__file__).resolve().parent.parent / "rubrics"


def built_in() -> list[str]:
    """The names of the built-in assignments."""
    suffix = SUFFIXES["assignment"]
    return sorted(path.name.removesuffix(suffix) for path in library().glob(f"*{suffix}"))


def locate(kind: str, name: str, beside: Path | None = None) -> Path:
    """The file of an authored thing: a path ending in .toml, a neighbour, or a built-in name."""
    if name.endswith(".toml") or os.sep in name:
        path = Path(name)
        return path if path.is_absolute() or beside is None else beside.parent / path
    file = f"{name}{SUFFIXES[kind]}"
    if beside is not None and authored.is_file(beside.parent / file):
        return beside.parent / file
    return library() / file


def load_assignment(name: str | Path) -> Assignment:
    """A built-in assignment by its name, or one from the path of its file.

    Raises CallError for an unknown name (naming the known ones), AuthoredFileError with every
    fault of the files.
    """
    path = locate("assignment", str(name))
    if not authored.is_file(path) and not str(name).endswith(".toml"):
        raise CallError(
            "unknown_assignment",
            f"there is no assignment '{name}': built in are {', '.join(built_in())};"
            " or give the path of an assignment file (.toml)",
        )
    return _load(path.resolve(), path.stat().st_mtime_ns if authored.is_file(path) else 0)


@cache
def _load(path: Path, _changed_ns: int) -> Assignment:
    file = authored.load(AssignmentFile, path)
    source, mechanism = path, file.mechanism
    if isinstance(mechanism, str):
        source = locate("mechanism", mechanism, path)
        mechanism = authored.load(MechanismFile, source)
    faults = tuple(check_mechanism(mechanism))
    if faults:
        raise AuthoredFileError(str(source), faults)
    assignment = Assignment(file, mechanism, path)
    findings = _check_formulas(assignment)
    if findings:
        raise AuthoredFileError(str(path), tuple(findings))
    return assignment


def _check_formulas(assignment: Assignment) -> list[Finding]:
    """Names that no formula above defines; formulas that fail for some variant."""
    variants = assignment.variants()
    if not variants:
        return [Finding("$.variant", "the range of n or position is empty: 'from' must not exceed 'to'")]
    findings: list[Finding] = []

    def proposed_scales(variants: list[Variant]) -> None:
        scales = assignment.scales(variants)
        for name in ("kL", "kv", "ka"):
            if not np.all((getattr(scales, name) > 1.0 / LARGEST) & (getattr(scales, name) < LARGEST)):
                raise FormulaError(f"{name} must be above zero for every variant")

    def told(formula: Formula) -> Callable[[list[Variant]], object]:
        return lambda variants: formula(assignment.values(variants))

    for what, path in (
        (assignment.values, "$.variant.values"),
        (assignment.mechanism, "$.mechanism"),
        (proposed_scales, "$.scales"),
        *((told(one.value), f"$.given[{index}].value") for index, one in enumerate(assignment.file.given)),
    ):
        try:
            what(variants)
        except FormulaError as error:
            findings.append(Finding(path, str(error)))
            break
    return findings
