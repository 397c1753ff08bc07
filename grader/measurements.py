"""Measurement files: drawn lengths, directions and computed values, entered by hand.

CSV for a class: ``student_id,n,position,kL,kv,ka``, then vector names (drawn millimetres),
``NAME_deg`` (directions counter-clockwise from the assignment's +x) and ``NAME_value`` (SI; angular
quantities counter-clockwise positive). Semicolon-separated files have decimal commas; blank means
not measured. JSON for one student: `grader.documents.MeasurementsDocument`.

A fault of the whole file (an unknown column, no CSV at all) raises InputFileError with all of them.
A value that is refused costs that value alone: it is a problem of that student, and `Reading.unread`
names what it was entered for, so that no criterion is judged without it.
"""

import csv
import io
import json
import math
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pydantic import ValidationError

from grader.documents import MeasurementsDocument
from grader.quantities import MAX_LENGTH as LONGEST_SCALE
from grader.records import (
    ACCELERATION_PLAN,
    VELOCITY_PLAN,
    Figure,
    PageRef,
    Problem,
    Reading,
    ReadVector,
    Unread,
)
from grader.roster import MAX_LINES, delimiter_of, why_no_id
from reference.assignment import Assignment, Variant
from reference.authored import findings_of
from reference.construction import Construction
from reference.derivation import construction_of
from reference.errors import MOST_FINDINGS, Finding, InputFileError, lines_of, near_names
from reference.outline import coincident

KEYS = ("student_id", "n", "position")
SCALES = ("kL", "kv", "ka")
TABLES = {"segments_mm": "", "directions_deg": "_deg", "values": "_value"}
"""The tables of a JSON file, and what a CSV file's columns add to the names in them."""
MAX_BYTES = 1_000_000
"""A class of a thousand with every length, direction and value writes half of it."""
_LONG = f"a scale has at most {LONGEST_SCALE} characters"
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
    is_usable : False where nothing of the line can be used
    further_scales : as declared in further files or lines of the same student
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
    is_usable: bool = True
    further_scales: tuple[Mapping[str, str], ...] = ()

    @property
    def place(self) -> str:
        """Where they stand: the file, and the line of one that has lines."""
        return self.source if self.line is None else f"{self.source}, line {self.line}"

    @property
    def numbers(self) -> dict[str, float]:
        """What was entered by the names of a CSV file's columns: mm, ``NAME_deg``, ``NAME_value``."""
        entered: dict[str, float] = {}
        for figure in self.reading.figures.values():
            for name, vector in figure.vectors.items():
                if vector.length_mm is not None:
                    entered[name] = vector.length_mm
                if vector.direction_deg is not None:
                    entered[f"{name}_deg"] = vector.direction_deg
        return entered | {f"{name}_value": value for name, value in self.values.items()}


NOTHING_MEASURED = Measurements(None, None, None, {}, Reading({}), {}, "")


@dataclass(frozen=True, slots=True)
class StudentSubmission:
    """What one student handed in for one variant.

    Attributes
    ----------
    variant : None where nothing says the student's number or position
    declared : scales as declared, text by ``kL``, ``kv``, ``ka``
    measured : entered measurements, or None
    problems : what was noticed before marking
    has_unusable : whether something was handed in that cannot be used; `problems` say what
    """

    student_id: str
    variant: Variant | None
    pages: tuple[PageRef, ...] = ()
    declared: Mapping[str, str] = field(default_factory=dict)
    measured: Measurements | None = None
    lang: str = "en"
    name: str = ""
    problems: tuple[Problem, ...] = ()
    has_unusable: bool = False


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


def read_measurements(path: Path | str, names: Names, file: str | None = None) -> tuple[Measurements, ...]:
    """Read a CSV file of a class, or a JSON file of one student.

    Arguments: `file` is the name that the user knows it by, if that is not the path's own.

    Raises InputFileError with every fault of the file as a whole.
    """
    path = Path(path)
    file = file or path.name
    text = _text_of(path, file)
    if path.suffix.lower() == ".json":
        return (_parse_json(text, file, names),)
    return tuple(_parse_csv(text, file, names))


def _text_of(path: Path, file: str) -> str:
    if path.exists() and not path.is_file():
        why = f"{file}: cannot be read: it is a folder or a pipe, not a file"
        raise InputFileError("measurements_unreadable", why)
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        why = f"{file}: cannot be read: {error.strerror or error}"
        raise InputFileError("measurements_unreadable", why) from error
    if len(content) > MAX_BYTES:
        why = f"{file}: is larger than {MAX_BYTES // 1_000_000} MB: these are no measurements"
        raise InputFileError("measurements_unreadable", why)
    try:
        return content.decode("utf-16" if content[:2] in {b"\xff\xfe", b"\xfe\xff"} else "utf-8-sig")
    except UnicodeDecodeError as error:
        why = f"{file}: is not UTF-8 text; save it as CSV in UTF-8"
        raise InputFileError("measurements_encoding", why) from error


def students_in(path: Path) -> tuple[str, ...]:
    """The students whom a file names that cannot be used as a whole, as far as they can be made out."""
    try:
        if not path.is_file():
            return ()
        with path.open("rb") as stream:
            text = stream.read(MAX_BYTES).decode(errors="replace").removeprefix("\ufeff")
    except OSError:
        return ()
    if path.suffix.lower() == ".json":
        named = re.findall(r'"student_id"\s*:\s*"([^"\n]{1,64})"', text)
    else:
        header, *lines = text.splitlines()[:MAX_LINES] or [""]
        delimiter = delimiter_of(header)
        columns = [cell.strip(' "') for cell in header.split(delimiter)]
        column = columns.index("student_id") if "student_id" in columns else len(columns)
        rows = (line.split(delimiter, column + 1) for line in lines)
        named = [cells[column].strip(' "') for cells in rows if len(cells) > column]
    return tuple(name for name in dict.fromkeys(named) if why_no_id(name) is None)


def _refuse(file: str, findings: Sequence[Finding]) -> InputFileError:
    return InputFileError("measurements", f"{file}: cannot be used\n{lines_of(findings)}")


def _columns(names: Names) -> Mapping[str, tuple[str, str]]:
    """The columns of a CSV file that hold numbers: the table of each, and the name in it."""
    known = {"segments_mm": names.vectors, "directions_deg": names.vectors, "values": names.values}
    return {f"{name}{end}": (table, name) for table, end in TABLES.items() for name in known[table]}


@dataclass(slots=True)
class _Entries:
    """The numbers of one student while they are being read; what is refused costs that number alone."""

    names: Names
    columns: Mapping[str, tuple[str, str]]
    file: str
    tables: dict[str, dict[str, float]] = field(default_factory=lambda: {table: {} for table in TABLES})
    faults: list[Finding] = field(default_factory=list)
    unread: list[Unread] = field(default_factory=list)

    def take(self, column: str, value: float) -> str | None:
        """Keep a number of a column that is known; why it is refused where it cannot be what it is for."""
        table, name = self.columns[column]
        if not math.isfinite(value):
            return "is no finite number"
        if table == "segments_mm" and not 0.0 <= value <= MAX_LENGTH_MM:
            return f"a drawn length is from 0 to {MAX_LENGTH_MM:g} mm"
        if table == "directions_deg" and abs(value) > 360.0:
            return "a direction is from -360 to 360 degrees"
        self.tables[table][name] = value
        return None

    def refuse(self, name: str, column: str, text: str) -> None:
        """Note that something entered for a name is not used."""
        self.unread.append(Unread(name, f"{column}: '{text}'"))

    def values(self) -> dict[str, float]:
        """The computed values, in the order of the construction."""
        values = self.tables["values"]
        return {name: values[name] for name in self.names.values if name in values}

    def reading(self) -> Reading:
        """Lengths and directions as a reading, with what was refused."""
        lengths, directions = self.tables["segments_mm"], self.tables["directions_deg"]
        return replace(reading_of(self.names.vectors, lengths, directions), unread=tuple(self.unread))

    def problems(self) -> tuple[Problem, ...]:
        """The faults, no more than a person reads, and what was entered and is not asked for."""
        problems = [
            Problem("measurement_fault", str(fault), self.file) for fault in self.faults[:MOST_FINDINGS]
        ]
        if len(self.faults) > MOST_FINDINGS:
            more = f"... and {len(self.faults) - MOST_FINDINGS} more faults"
            problems.append(Problem("measurement_fault", more, self.file))
        given = {name for table in self.tables.values() for name in table}
        return (*problems, *_unused(self.names, given, self.file))


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
    columns = _columns(names)
    for number, cells in lines[1:]:
        yield _Row(number, header, cells, delimiter, _Entries(names, columns, file)).read()


def _lines(text: str, delimiter: str, file: str) -> list[tuple[int, list[str]]]:
    """Lines that are not blank, with their numbers from 1."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    lines: list[tuple[int, list[str]]] = []
    first = 1
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                lines.append((first, cells))
            if len(lines) > MAX_LINES:
                raise _refuse(file, [Finding(f"line {first}", f"more than {MAX_LINES} lines are no class")])
            first = reader.line_num + 1
    except csv.Error as error:
        raise _refuse(file, [Finding(f"line {first}", f"is no CSV: {error}; check its quotes")]) from error
    return lines


def _check_header(header: list[str], names: Names) -> Iterator[Finding]:
    known = frozenset((*KEYS, *SCALES, *_columns(names)))
    if "student_id" not in header:
        yield Finding("line 1", "column student_id is missing")
    for index, (name, count) in enumerate(Counter(filter(None, header)).items()):
        if count > 1:
            yield Finding("line 1", f"column {name} is there {count} times")
        if name not in known:
            near = near_names(name, sorted(known)) if index < MOST_FINDINGS + len(known) else []
            yield Finding("line 1", f"column '{name}' is not known{_did_you_mean(near)}")


def _did_you_mean(near: Sequence[str]) -> str:
    return f"; did you mean {' or '.join(near)}?" if near else ""


@dataclass(frozen=True, slots=True)
class _Row:
    """One line of a class file while it is being read."""

    line: int
    header: list[str]
    cells: list[str]
    delimiter: str
    entries: _Entries

    def read(self) -> Measurements:
        """What the line says; what it says wrongly is left out and told."""
        cells = [cell.strip() for cell in self.cells]
        known = {name: cell for name, cell in zip(self.header, cells, strict=False) if cell and name}
        if any(cells[len(self.header) :]):
            told = f"has {len(cells)} fields, the first line names {len(self.header)} columns"
            self.fault("", f"{told}; quote a field that holds a '{self.delimiter}'; nothing of it is used")
            known = {"student_id": cells[0]} if self.header[0] == "student_id" else {}
        student = self.student(known.get("student_id", ""))
        n, position = (self.whole(name, known.get(name, "")) for name in ("n", "position"))
        # Without its student, n and position nobody knows what it is held against.
        is_usable = not self.entries.faults
        for column, text in known.items():
            if column in self.entries.columns:
                self.number(column, text)
        return Measurements(
            student_id=student,
            n=n,
            position=position,
            scales=self.scales(known),
            reading=self.entries.reading(),
            values=self.entries.values(),
            source=self.entries.file,
            line=self.line,
            problems=self.entries.problems(),
            is_usable=is_usable,
        )

    def scales(self, known: Mapping[str, str]) -> dict[str, str]:
        """The scales as declared."""
        scales = {name: known[name] for name in SCALES if name in known}
        for name in [name for name, text in scales.items() if len(text) > LONGEST_SCALE]:
            self.fault(name, f"'{scales[name][:40]}...': {_LONG}")
            self.entries.refuse(name, name, f"{scales.pop(name)[:40]}...")
        return scales

    def fault(self, column: str, why: str) -> None:
        """Note a fault of this line."""
        where = f"line {self.line}, {column}" if column else f"line {self.line}"
        self.entries.faults.append(Finding(where, why))

    def student(self, text: str) -> str | None:
        """The student's id, None with a fault where it is missing or refused."""
        why = why_no_id(text)
        if why is not None:
            self.fault("student_id", f"'{text[:40]}' is refused: {why}")
        return text if why is None else None

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

    def number(self, column: str, text: str) -> None:
        """Enter the number that stands in a column, or note why it is refused."""
        plain = text.replace("\N{MINUS SIGN}", "-")
        if self.delimiter == ";":
            plain = plain.replace(",", ".", 1)
        if _NUMBER.fullmatch(plain) is None:
            comma = "," in text and self.delimiter == ","
            advice = "; write a decimal point, or separate fields by semicolons" if comma else ""
            why: str | None = f"is no number{advice}"
        else:
            why = self.entries.take(column, float(plain))
        if why is not None:
            self.fault(column, f"'{text[:40]}': {why}")
            self.entries.refuse(self.entries.columns[column][1], column, text[:40])


_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)


def _unused(names: Names, given: Collection[str], file: str) -> Iterator[Problem]:
    """Vectors measured that nothing can be held against."""
    unused = sorted(names.unused.intersection(given))
    if unused:
        message = f"{', '.join(unused)}: not drawn in this mechanism's plans, and not judged"
        yield Problem("measurement_not_used", message, file)


def reading_of(
    plans: Mapping[str, str], lengths: Mapping[str, float], directions: Mapping[str, float]
) -> Reading:
    """A reading made by hand: vectors without nodes, certain and without a standard error.

    Arguments: `plans` are the figures that the vectors are in, by vector.
    """
    figures: dict[str, dict[str, ReadVector]] = {}
    for name, plan in plans.items():
        length, direction = lengths.get(name), directions.get(name)
        if length is None and direction is None:
            continue
        turned = None if direction is None else direction % 360.0 % 360.0
        se_deg = None if direction is None else 0.0
        figures.setdefault(plan, {})[name] = ReadVector(length, 0.0, turned, se_deg, 1.0)
    return Reading({plan: Figure({}, vectors) for plan, vectors in figures.items()})


def combined(sets: Sequence[Measurements]) -> Measurements:
    """All that several files or lines of one student give.

    Where they contradict each other, no value is used: a problem says which they are, and
    `Reading.unread` what they were entered for. Scales are left to `further_scales`.
    """
    first, *others = sets
    if not others:
        return first
    places = " and ".join(each.place for each in sets)
    problems = [Problem("measurements_twice", f"{first.student_id} is in {places}: both count", first.source)]
    given: dict[str, dict[float, str]] = {}
    for each in sets:
        for column, value in each.numbers.items():
            given.setdefault(column, {}).setdefault(value, each.place)
    unread = [gap for each in sets for gap in each.reading.unread]
    for column, where in given.items():
        if len(where) > 1:
            unread.append(
                Unread(_name_of(column), f"{column}: {' / '.join(f'{value:g}' for value in where)}")
            )
            values = ", ".join(f"{value:g} ({place})" for value, place in where.items())
            problems.append(Problem("measurements_disagree", f"{column}: {values}; none of them is used"))
    agreed = {column: next(iter(where)) for column, where in given.items() if len(where) == 1}
    figures = [figure for each in sets for figure in each.reading.figures.items()]
    plans = {name: plan for plan, figure in figures for name in figure.vectors}
    directions = {name: agreed[f"{name}_deg"] for name in plans if f"{name}_deg" in agreed}
    return replace(
        first,
        reading=replace(reading_of(plans, agreed, directions), unread=tuple(unread)),
        values={_name_of(column): value for column, value in agreed.items() if column.endswith("_value")},
        problems=(*(problem for each in sets for problem in each.problems), *problems),
        further_scales=tuple(each.scales for each in others),
    )


def _name_of(column: str) -> str:
    """The vector or angular quantity that a column is about."""
    return column.removesuffix("_deg").removesuffix("_value")


# JSON ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _NoValue:
    """What stands in a JSON file in place of a value, and why it is none."""

    text: str
    why: str

    def __str__(self) -> str:
        return self.text


def _object(pairs: Sequence[tuple[str, object]]) -> dict[str, object]:
    """An object of JSON; a key that is there twice has no value: nothing says which is meant."""
    table: dict[str, object] = {}
    for key, value in pairs:
        # A half of a surrogate pair can be written in JSON, and in no file of ours.
        name, read = _encodable(key), _encodable(value) if isinstance(value, str) else value
        if name in table:
            read = _NoValue(f"{_shown(table[name])} and {_shown(read)}", "is there more than once")
        table[name] = read
    return table


def _encodable(text: str) -> str:
    return text.encode("utf-8", "backslashreplace").decode()


def _shown(value: object) -> str:
    return "a list or table" if isinstance(value, list | dict) else str(value)[:40]


def _whole_number(digits: str) -> int | float:
    """Python refuses to read whole numbers of thousands of digits, and no number here has so many."""
    return int(digits) if len(digits) <= MOST_DIGITS else float(digits)


MOST_DIGITS = 18
"""Of a whole number that fits 64 bits."""


def _parse_json(text: str, file: str, names: Names) -> Measurements:
    try:
        data = json.loads(
            text,
            object_pairs_hook=_object,
            parse_int=_whole_number,
            parse_constant=lambda name: _NoValue(name, "is no finite number"),
        )
    except (ValueError, RecursionError) as error:
        raise _refuse(file, [Finding("$", f"is not JSON: {error}")]) from error
    if not isinstance(data, dict):
        raise _refuse(file, [Finding("$", "is no table: a file of measurements begins with a brace")])
    entries = _Entries(names, _columns(names), file)
    document = _Document(data, entries)
    scales = document.scales()
    for table, end in TABLES.items():
        document.numbers(table, end)
    about = document.rest()
    return Measurements(
        student_id=about.student_id,
        n=about.n,
        position=about.position,
        scales=scales,
        reading=entries.reading(),
        values=entries.values(),
        source=file,
        problems=entries.problems(),
    )


@dataclass(frozen=True, slots=True)
class _Document:
    """A JSON file while it is being read: what is understood is taken out of `data`."""

    data: dict[str, object]
    entries: _Entries

    def fault(self, path: str, why: str) -> None:
        """Note a fault of one value."""
        self.entries.faults.append(Finding(f"$.{path}", why))

    def scales(self) -> dict[str, str]:
        """The scales as text; a number is a text without a unit."""
        scales: dict[str, str] = {}
        for name, value in self.table("scales"):
            if name not in SCALES:
                self.fault(f"scales.{name[:40]}", f"is not known here; there are {', '.join(SCALES)}")
            elif isinstance(value, str) and len(value) > LONGEST_SCALE:
                self.refuse(name, name, f"scales.{name}", _NoValue(value, _LONG))
            elif isinstance(value, str | int | float) and not isinstance(value, bool):
                scales[name] = str(value)
            else:
                self.refuse(name, name, f"scales.{name}", value)
        return scales

    def numbers(self, table: str, end: str) -> None:
        """Enter the numbers of a table."""
        names = self.entries.names
        known = names.values if table == "values" else tuple(names.vectors)
        given = dict(self.table(table))
        for name, value in given.items():
            path = f"{table}.{name[:40]}"
            if name not in known:
                near = near_names(name, known) if len(self.entries.faults) < MOST_FINDINGS else []
                self.fault(path, f"is not known here{_did_you_mean(near)}")
                for meant in near:
                    if meant not in given:
                        self.entries.refuse(meant, name, _shown(value))
            elif isinstance(value, int | float) and not isinstance(value, bool):
                why = self.entries.take(f"{name}{end}", float(value))
                if why is not None:
                    self.refuse(name, f"{name}{end}", path, _NoValue(_shown(value), why))
            else:
                self.refuse(name, f"{name}{end}", path, value)

    def table(self, key: str) -> list[tuple[str, object]]:
        """The pairs of a table; what is none stays in `data`, and is a fault of the whole file."""
        value = self.data.get(key)
        return list(self.data.pop(key).items()) if isinstance(value, dict) else []  # type: ignore[attr-defined]

    def refuse(self, name: str, column: str, path: str, value: object) -> None:
        """Note that a value is not used, and why."""
        why = value.why if isinstance(value, _NoValue) else "is no number"
        self.fault(path, f"'{_shown(value)}': {why}")
        self.entries.refuse(name, column, _shown(value))

    def rest(self) -> MeasurementsDocument:
        """Whose they are and for which variant. Raises InputFileError with all faults in what is left."""
        faults = [
            Finding(f"$.{key[:40]}", f"{value.why}: {value}")
            for key, value in self.data.items()
            if isinstance(value, _NoValue)
        ]
        data = {key: value for key, value in self.data.items() if not isinstance(value, _NoValue)}
        try:
            document = MeasurementsDocument.model_validate(data)
        except ValidationError as error:
            raise _refuse(self.entries.file, [*faults, *findings_of(error, MeasurementsDocument)]) from error
        why = None if document.student_id is None else why_no_id(document.student_id)
        if why is not None:
            faults.append(Finding("$.student_id", f"'{_shown(document.student_id)}' is refused: {why}"))
        if faults:
            raise _refuse(self.entries.file, faults)
        return document
