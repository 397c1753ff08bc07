"""Measurement files: drawn lengths, directions and computed values, entered by hand.

CSV for a class: ``student_id,n,position,kL,kv,ka``, then vector names (drawn millimetres),
``NAME_deg`` (directions counter-clockwise from the assignment's +x) and ``NAME_value`` (SI; angular
quantities counter-clockwise positive). Semicolon-separated files have decimal commas; blank means
not measured. JSON for one student: `grader.documents.MeasurementsDocument`.

A fault of the whole file (an unknown column, no CSV at all) raises InputFileError with all of them;
a fault of one line is a problem of that student, whose other numbers still count, and of nobody else.
"""

import csv
import difflib
import io
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import ValidationError

from grader.documents import MeasurementsDocument
from grader.records import ACCELERATION_PLAN, VELOCITY_PLAN, Figure, Problem, Reading, ReadVector
from grader.roster import STUDENT_ID, delimiter_of
from reference.assignment import Assignment
from reference.authored import findings_of
from reference.construction import Construction
from reference.derivation import construction_of
from reference.errors import Finding, InputFileError
from reference.outline import coincident

KEYS = ("student_id", "n", "position")
SCALES = ("kL", "kv", "ka")
MAX_BYTES = 20_000_000
MAX_LENGTH_MM = 2000.0
"""Longer than any sheet: a length in other units, or a slip of the pen."""


@dataclass(frozen=True, slots=True)
class Measurements:
    """What one student measured, for one variant.

    Attributes
    ----------
    student_id : None where a JSON file does not say
    scales : as declared, text with a unit
    reading : lengths and directions, standard error zero: measured by hand
    values : computed values, SI, by vector or angular quantity
    problems : faults of this student's line or file
    line : line of a CSV file, from 1
    """

    student_id: str | None
    n: int | None
    position: int | None
    scales: Mapping[str, str]
    reading: Reading
    values: Mapping[str, float]
    source: str
    line: int | None = None
    problems: tuple[Problem, ...] = ()


@dataclass(frozen=True, slots=True)
class Names:
    """What can be measured: vectors with the plan each is in, and angular quantities."""

    vectors: Mapping[str, str]
    rates: tuple[str, ...]
    unused: frozenset[str] = frozenset()
    """Vectors that make sense in this mechanism, but that its plans are drawn without."""

    @property
    def values(self) -> tuple[str, ...]:
        """What has a computed value."""
        return (*self.vectors, *self.rates)


def names_of(assignment: Assignment) -> Names:
    """The names that an assignment's measurement files may hold."""
    mechanism = assignment.mechanism(assignment.variants()[:1])
    construction: Construction = construction_of(mechanism)
    plans = {"v": VELOCITY_PLAN, "a": ACCELERATION_PLAN}
    joints = mechanism.joints
    abouts = [*joints, *(f"{head}{tail}" for head in joints for tail in joints if head != tail)]
    possible = [f"v_{about}" for about in abouts]
    possible += [f"a_{about}{part}" for about in abouts for part in ("", "_n", "_t")]
    under = [
        f"{one}{other}" for pair in coincident(construction).items() for one, other in (pair, pair[::-1])
    ]
    possible += [f"a_{about}_{part}" for about in under for part in ("c", "r")]
    unused = frozenset(possible) - construction.vectors.keys()
    vectors = {name: plans[name[0]] for name in (*construction.vectors, *sorted(unused))}
    return Names(vectors, tuple(construction.rates), unused)


def read_measurements(path: Path | str, names: Names) -> tuple[Measurements, ...]:
    """Read a CSV file of a class, or a JSON file of one student.

    Raises InputFileError with every fault of the file as a whole.
    """
    path = Path(path)
    text = _text_of(path)
    if path.suffix.lower() == ".json":
        return (_parse_json(text, path.name, names),)
    return tuple(_parse_csv(text, path.name, names))


def _text_of(path: Path) -> str:
    if path.exists() and not path.is_file():
        told = f"{path.name}: cannot be read: it is a folder or a pipe, not a file"
        raise InputFileError("measurements_unreadable", told)
    try:
        size = path.stat().st_size
        content = path.read_bytes() if size <= MAX_BYTES else b""
    except OSError as error:
        told = f"{path.name}: cannot be read: {error.strerror or error}"
        raise InputFileError("measurements_unreadable", told) from error
    if size > MAX_BYTES:
        raise InputFileError("measurements_unreadable", f"{path.name}: {size} bytes are no measurements")
    try:
        return content.decode("utf-16" if content[:2] in {b"\xff\xfe", b"\xfe\xff"} else "utf-8-sig")
    except UnicodeDecodeError as error:
        told = f"{path.name}: is not UTF-8 text; save it as CSV in UTF-8"
        raise InputFileError("measurements_encoding", told) from error


def _refuse(file: str, findings: Iterable[Finding]) -> InputFileError:
    lines = "\n".join(f"  {finding}" for finding in findings)
    return InputFileError("measurements", f"{file}: cannot be used\n{lines}")


# CSV ----------------------------------------------------------------------------------------------


def _parse_csv(text: str, file: str, names: Names) -> Iterator[Measurements]:
    delimiter = delimiter_of(text)
    lines = _lines(text, delimiter, file)
    if not lines:
        raise _refuse(file, [Finding("line 1", "the file is empty; its first line must name the columns")])
    header = [cell.strip() for cell in lines[0][1]]
    faults = list(_check_header(header, names))
    if faults:
        raise _refuse(file, faults)
    seen: dict[tuple[str | None, int | None], int] = {}
    for number, cells in lines[1:]:
        yield _Row(file, number, header, cells, delimiter, names).read(seen)


def _lines(text: str, delimiter: str, file: str) -> list[tuple[int, list[str]]]:
    """Lines that are not blank, with their numbers from 1."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    lines: list[tuple[int, list[str]]] = []
    first = 1
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                lines.append((first, cells))
            first = reader.line_num + 1
    except csv.Error as error:
        raise _refuse(file, [Finding(f"line {first}", f"is no CSV: {error}; check its quotes")]) from error
    return lines


def _columns(names: Names) -> tuple[str, ...]:
    directions = (f"{name}_deg" for name in names.vectors)
    values = (f"{name}_value" for name in names.values)
    return (*KEYS, *SCALES, *names.vectors, *directions, *values)


def _check_header(header: list[str], names: Names) -> Iterator[Finding]:
    known = _columns(names)
    if "student_id" not in header:
        yield Finding("line 1", "column student_id is missing")
    for name in dict.fromkeys(header):
        if header.count(name) > 1 and name:
            yield Finding("line 1", f"column {name} is there {header.count(name)} times")
        if name and name not in known:
            yield Finding("line 1", f"column '{name}' is not known{_near(name, known)}")


def _near(name: str, known: Iterable[str]) -> str:
    by_lower = {one.lower(): one for one in known}
    found = difflib.get_close_matches(name.lower(), by_lower, n=2, cutoff=0.6)
    return f"; did you mean {' or '.join(by_lower[one] for one in found)}?" if found else ""


@dataclass(frozen=True, slots=True)
class _Row:
    """One line of a class file while it is being read; its faults gather in `faults`."""

    file: str
    line: int
    header: list[str]
    cells: list[str]
    delimiter: str
    names: Names
    faults: list[Problem] = field(default_factory=list)

    def read(self, seen: dict[tuple[str | None, int | None], int]) -> Measurements:
        """What the line says; what it says wrongly is left out and told."""
        cells = [cell.strip() for cell in self.cells]
        if any(cells[len(self.header) :]):
            told = f"has {len(cells)} fields, the first line names {len(self.header)} columns"
            self.fault("", f"{told}; quote a field that holds a '{self.delimiter}'; nothing of it is used")
            cells = cells[: 1 if self.header[0] == "student_id" else 0]
        known = {name: cell for name, cell in zip(self.header, cells, strict=False) if cell and name}
        student = self.student(known)
        n, position = (self.whole(name, known.get(name, "")) for name in ("n", "position"))
        key = (student, position)
        if student is not None and key in seen:
            self.fault(
                "student_id", f"{student} is on line {seen[key]} already; nothing of this line is used"
            )
            known = {}
        seen.setdefault(key, self.line)
        lengths = {name: self.length(name, known.get(name)) for name in self.names.vectors}
        directions = {name: self.direction(known.get(f"{name}_deg"), name) for name in self.names.vectors}
        values = {
            name: self.number(f"{name}_value", known.get(f"{name}_value")) for name in self.names.values
        }
        self.faults.extend(_unused(self.names, known, self.file))
        return Measurements(
            student_id=student,
            n=n,
            position=position,
            scales={name: known[name] for name in SCALES if name in known},
            reading=reading_of(self.names, lengths, directions),
            values={name: value for name, value in values.items() if value is not None},
            source=self.file,
            line=self.line,
            problems=tuple(self.faults),
        )

    def fault(self, column: str, told: str) -> None:
        """Note a fault of this line."""
        where = f"line {self.line}, {column}" if column else f"line {self.line}"
        self.faults.append(Problem("measurement_fault", f"{where}: {told}", self.file))

    def student(self, known: Mapping[str, str]) -> str | None:
        """The student's id, None with a fault where it is missing or refused."""
        text = known.get("student_id", "")
        if STUDENT_ID.fullmatch(text) is None or set(text) == {"."}:
            allowed = "letters A-Z a-z, digits, '.', '_' and '-', at most 64"
            self.fault("student_id", f"'{text[:40]}' is refused: {allowed} are allowed")
            return None
        return text

    def whole(self, name: str, text: str) -> int | None:
        """A whole number; spreadsheets may have added zeros as decimals."""
        if not text:
            return None
        mark = "," if self.delimiter == ";" else r"\."
        found = re.fullmatch(rf"([+-]?\d{{1,9}})(?:{mark}0+)?", text, re.ASCII)
        if found is None:
            self.fault(name, f"'{text[:40]}' is no whole number")
            return None
        return int(found[1])

    def number(self, column: str, text: str | None) -> float | None:
        """A finite number, None where blank or, with a fault, where it is none."""
        if not text:
            return None
        plain = text.replace("\N{MINUS SIGN}", "-")
        if self.delimiter == ";":
            plain = plain.replace(",", ".", 1)
        if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", plain, re.ASCII) is None:
            comma = "," in text and self.delimiter == ","
            advice = "; write a decimal point, or separate fields by semicolons" if comma else ""
            self.fault(column, f"'{text[:40]}' is no number{advice}")
            return None
        value = float(plain)
        if not math.isfinite(value):
            self.fault(column, f"'{text[:40]}' is no finite number")
            return None
        return value

    def length(self, name: str, text: str | None) -> float | None:
        """A drawn length, not negative and no longer than a sheet."""
        value = self.number(name, text)
        if value is not None and not 0.0 <= value <= MAX_LENGTH_MM:
            self.fault(name, f"{text}: a drawn length is from 0 to {MAX_LENGTH_MM:g} mm")
            return None
        return value

    def direction(self, text: str | None, name: str) -> float | None:
        """A direction, in degrees, at most one turn."""
        value = self.number(f"{name}_deg", text)
        if value is not None and abs(value) > 360.0:
            self.fault(f"{name}_deg", f"{text}: a direction is from -360 to 360 degrees")
            return None
        return value


def _unused(names: Names, given: Iterable[str], file: str) -> Iterator[Problem]:
    """Vectors measured that nothing can be held against."""
    found = sorted({name.removesuffix("_deg").removesuffix("_value") for name in given} & names.unused)
    if found:
        told = f"{', '.join(found)}: not drawn in this mechanism's plans, and not judged"
        yield Problem("measurement_not_used", told, file)


def reading_of(
    names: Names, lengths: Mapping[str, float | None], directions: Mapping[str, float | None]
) -> Reading:
    """A reading made by hand: vectors without nodes, certain and without a standard error."""
    figures: dict[str, dict[str, ReadVector]] = {}
    for name, plan in names.vectors.items():
        length, direction = lengths.get(name), directions.get(name)
        if length is None and direction is None:
            continue
        turned = None if direction is None else direction % 360.0 % 360.0
        se_deg = None if direction is None else 0.0
        figures.setdefault(plan, {})[name] = ReadVector(length, 0.0, turned, se_deg, 1.0)
    return Reading({plan: Figure({}, vectors) for plan, vectors in figures.items()})


# JSON ---------------------------------------------------------------------------------------------


def _parse_json(text: str, file: str, names: Names) -> Measurements:
    try:
        json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _refuse(file, [Finding("$", f"is not JSON: {error}")]) from error
    try:
        document = MeasurementsDocument.model_validate_json(text)
    except ValidationError as error:
        raise _refuse(file, findings_of(error, MeasurementsDocument)) from error
    faults = list(_check_document(document, names))
    if faults:
        raise _refuse(file, faults)
    reading = reading_of(names, document.segments_mm, document.directions_deg)
    given = (*document.segments_mm, *document.directions_deg, *document.values)
    return Measurements(
        student_id=document.student_id,
        n=document.n,
        position=document.position,
        scales={str(name): str(scale) for name, scale in document.scales.items()},
        reading=reading,
        values=dict(document.values),
        source=file,
        problems=tuple(_unused(names, given, file)),
    )


def _check_document(document: MeasurementsDocument, names: Names) -> Iterator[Finding]:
    student = document.student_id
    if student is not None and (STUDENT_ID.fullmatch(student) is None or set(student) == {"."}):
        yield Finding("$.student_id", "letters A-Z a-z, digits, '.', '_' and '-', at most 64, are allowed")
    tables = {
        "segments_mm": (document.segments_mm, tuple(names.vectors)),
        "directions_deg": (document.directions_deg, tuple(names.vectors)),
        "values": (document.values, names.values),
    }
    for table, (given, known) in tables.items():
        for name in given:
            if name not in known:
                yield Finding(f"$.{table}.{name}", f"is not known here{_near(name, known)}")
    for name, length in document.segments_mm.items():
        if length > MAX_LENGTH_MM:
            told = f"a drawn length is from 0 to {MAX_LENGTH_MM:g} mm"
            yield Finding(f"$.segments_mm.{name}", told)
    for name, direction in document.directions_deg.items():
        if abs(direction) > 360.0:
            yield Finding(f"$.directions_deg.{name}", "a direction is from -360 to 360 degrees")
