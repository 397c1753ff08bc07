"""Measurement files: drawn lengths, directions and computed values, entered by hand.

CSV for a class: ``student_id,n,position,kL,kv,ka``, then vector names (drawn millimetres),
``NAME_deg`` (directions counter-clockwise from the assignment's +x) and ``NAME_value`` (SI; angular
quantities counter-clockwise positive). Semicolon-separated files have decimal commas; blank means
not measured. JSON for one student: `grader.documents.MeasurementsDocument`.

A fault of the whole file (an unknown column, no CSV at all) raises InputFileError with all of them.
A value that is refused costs that value alone: it is a problem of that student, and `Reading.unread`
names what it was entered for, so that no criterion is judged without it.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeGuard

from pydantic import ValidationError

from grader.documents import MeasurementsDocument
from grader.inputs.decisions import Decision
from grader.inputs.roster import MAX_LINES, surplus_of, whole_number, why_no_id
from grader.inputs.scale_text import MAX_LENGTH as LONGEST_SCALE
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
from reference.authored.assignment import SCALE_NAMES, Assignment, Variant
from reference.authored.toml_file import findings_of
from reference.authored.variant_table import delimiter_of, table_lines
from reference.construction.derive import construction_of
from reference.construction.graph import Construction, coincident
from reference.errors import MOST_FINDINGS, Finding, InputFileError, lines_of, near_names

KEYS = ("student_id", "n", "position")
TABLES = {"segments_mm": "", "directions_deg": "_deg", "values": "_value"}
"""The tables of a JSON file, and what a CSV file's columns add to the names in them."""
MAX_BYTES = 1_000_000
"""A class of a thousand with every length, direction and value writes half of it."""
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
    decided : what people decided of it, to be applied
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
    decided: tuple[Decision, ...] = ()

    @property
    def position(self) -> int | None:
        """The variant's position; None where there is none or it is not known."""
        return None if self.variant is None else self.variant.position


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


@dataclass(frozen=True, slots=True)
class _NoValue:
    """What stands in a JSON file in place of a value, and why it is none."""

    text: str
    why: str

    def __str__(self) -> str:
        return self.text


@dataclass(slots=True)
class _Entries:
    """What one student entered, while it is being read; what is refused costs that entry alone.

    Attributes
    ----------
    columns : by a CSV file's columns, the table and the name in it
    line : of a CSV file
    """

    names: Names
    columns: Mapping[str, tuple[str, str]]
    file: str
    line: int | None = None
    scales: dict[str, str] = field(default_factory=dict)
    tables: dict[str, dict[str, float]] = field(default_factory=lambda: {table: {} for table in TABLES})
    faults: list[Finding] = field(default_factory=list)
    unread: list[Unread] = field(default_factory=list)

    def fault(self, path: str, why: str) -> None:
        """Note what is wrong, where a path or a column says; the whole line for none."""
        if self.line is not None:
            path = f"line {self.line}, {path}" if path else f"line {self.line}"
        self.faults.append(Finding(path, why))

    def number(self, path: str, column: str, text: str, value: float | _NoValue) -> None:
        """Enter the number that a column or table has, or note why it is refused."""
        why = value.why if isinstance(value, _NoValue) else self._refusal(column, value)
        if why is None and isinstance(value, float):
            table, name = self.columns[column]
            self.tables[table][name] = value
        else:
            self.fault(path, f"'{text}': {why}")
            self.unread.append(Unread(self.columns[column][1], f"{column}: '{text}'"))

    def _refusal(self, column: str, value: float) -> str | None:
        """Why a number cannot be what it is entered for, or None."""
        table, _ = self.columns[column]
        if not math.isfinite(value):
            return "is no finite number"
        if table == "segments_mm" and not 0.0 <= value <= MAX_LENGTH_MM:
            return f"a drawn length is from 0 to {MAX_LENGTH_MM:g} mm"
        if table == "directions_deg" and abs(value) > 360.0:
            return "a direction is from -360 to 360 degrees"
        return None

    def scale(self, path: str, name: str, text: str | _NoValue) -> None:
        """Enter a scale as declared, or note why it is refused."""
        if isinstance(text, str) and len(text) > LONGEST_SCALE:
            text = _NoValue(f"{text[:40]}...", f"a scale has at most {LONGEST_SCALE} characters")
        if isinstance(text, str):
            self.scales[name] = text
        else:
            self.fault(path, f"'{text}': {text.why}")
            self.unread.append(Unread(name, f"{name}: '{text}'"))

    def measurements(
        self, student_id: str | None, n: int | None, position: int | None, *, is_usable: bool = True
    ) -> Measurements:
        """All that was entered, in the order of the construction."""
        lengths, directions, values = (self.tables[table] for table in TABLES)
        reading = reading_of(self.names.vectors, lengths, directions)
        problems = [
            Problem("measurement_fault", str(fault), self.file) for fault in self.faults[:MOST_FINDINGS]
        ]
        if len(self.faults) > MOST_FINDINGS:
            more = f"... and {len(self.faults) - MOST_FINDINGS} more faults"
            problems.append(Problem("measurement_fault", more, self.file))
        unused = sorted(self.names.unused.intersection({*lengths, *directions, *values}))
        if unused:
            message = f"{', '.join(unused)}: not drawn in this mechanism's plans, and not judged"
            problems.append(Problem("measurement_not_used", message, self.file))
        return Measurements(
            student_id=student_id,
            n=n,
            position=position,
            scales=self.scales,
            reading=replace(reading, unread=tuple(self.unread)),
            values={name: values[name] for name in self.names.values if name in values},
            source=self.file,
            line=self.line,
            problems=tuple(problems),
            is_usable=is_usable,
        )


# CSV ----------------------------------------------------------------------------------------------


def _parse_csv(text: str, file: str, names: Names) -> Iterator[Measurements]:
    delimiter = delimiter_of(text)
    lines, faults = table_lines(text, delimiter, MAX_LINES)
    if not lines and not faults:
        faults = [Finding("line 1", "the file is empty; its first line must name the columns")]
    header = [cell.strip() for cell in lines[0][1]] if lines else []
    faults = faults or list(_check_header(header, names))
    if faults:
        raise _refuse(file, faults)
    columns = _columns(names)
    for number, cells in lines[1:]:
        yield _line(header, cells, delimiter, _Entries(names, columns, file, number))


def _check_header(header: list[str], names: Names) -> Iterator[Finding]:
    known = frozenset((*KEYS, *SCALE_NAMES, *_columns(names)))
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


def _line(header: list[str], cells: list[str], delimiter: str, entries: _Entries) -> Measurements:
    """What one line says; what is wrong in it is left out and reported."""
    known = {name: cell.strip() for name, cell in zip(header, cells, strict=False) if name and cell.strip()}
    surplus = surplus_of(header, cells, delimiter)
    if surplus is not None:
        entries.fault("", f"{surplus}; nothing of it is used")
        known = {"student_id": cells[0].strip()} if header[0] == "student_id" else {}
    student = known.get("student_id", "")
    why = why_no_id(student)
    if why is not None:
        entries.fault("student_id", f"'{student[:40]}' is refused: {why}")
    numbers = {name: whole_number(known[name], delimiter) for name in ("n", "position") if name in known}
    for name, number in numbers.items():
        if number is None:
            entries.fault(name, f"'{known[name][:40]}' is no whole number")
    # Without its student, n and position nobody knows what it is held against.
    is_usable = not entries.faults
    for column, text in known.items():
        if column in entries.columns:
            entries.number(column, column, text[:40], _number(text, delimiter))
    for scale in SCALE_NAMES:
        if scale in known:
            entries.scale(scale, scale, known[scale])
    owner = None if why else student
    return entries.measurements(owner, numbers.get("n"), numbers.get("position"), is_usable=is_usable)


_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)


def _number(text: str, delimiter: str) -> float | _NoValue:
    plain = text.replace("\N{MINUS SIGN}", "-")
    if delimiter == ";":
        plain = plain.replace(",", ".", 1)
    if _NUMBER.fullmatch(plain) is not None:
        return float(plain)
    comma = "," in text and delimiter == ","
    advice = "; write a decimal point, or separate fields by semicolons" if comma else ""
    return _NoValue(text, f"is no number{advice}")


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


MOST_DIGITS = 18
"""Of a whole number that fits 64 bits."""


def _whole_number(digits: str) -> int | float:
    """Python refuses to read whole numbers of thousands of digits, and no number here has so many."""
    return int(digits) if len(digits) <= MOST_DIGITS else float(digits)


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
    for name, value in _take(data, "scales"):
        if name not in SCALE_NAMES:
            entries.fault(f"$.scales.{name[:40]}", f"is not known here; there are {', '.join(SCALE_NAMES)}")
        else:
            declared = str(value) if _is_number(value) else value
            if not isinstance(declared, str | _NoValue):
                declared = _NoValue(_shown(value), "is no number")
            entries.scale(f"$.scales.{name}", name, declared)
    for table, end in TABLES.items():
        _enter(dict(_take(data, table)), table, end, entries)
    about = _about(data, file)
    return entries.measurements(about.student_id, about.n, about.position)


def _take(data: dict[str, object], key: str) -> list[tuple[str, object]]:
    """The pairs of a table, taken out of `data`; what is no table stays, and is a fault of the whole file."""
    table = data.get(key)
    if not isinstance(table, dict):
        return []
    del data[key]
    return list(table.items())


def _is_number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _enter(given: Mapping[str, object], table: str, end: str, entries: _Entries) -> None:
    """Enter the numbers of a table."""
    known = entries.names.values if table == "values" else tuple(entries.names.vectors)
    for name, value in given.items():
        path, shown = f"$.{table}.{name[:40]}", _shown(value)
        if name not in known:
            near = near_names(name, known) if len(entries.faults) < MOST_FINDINGS else []
            entries.fault(path, f"is not known here{_did_you_mean(near)}")
            entries.unread += [Unread(meant, f"{name}: '{shown}'") for meant in near if meant not in given]
        elif _is_number(value):
            entries.number(path, f"{name}{end}", shown, float(value))
        else:
            refused = value if isinstance(value, _NoValue) else _NoValue(shown, "is no number")
            entries.number(path, f"{name}{end}", shown, refused)


def _about(data: Mapping[str, object], file: str) -> MeasurementsDocument:
    """Whose they are and for which variant. Raises InputFileError with all faults in what is left."""
    faults = [
        Finding(f"$.{key[:40]}", f"{value.why}: {value}")
        for key, value in data.items()
        if isinstance(value, _NoValue)
    ]
    rest = {key: value for key, value in data.items() if not isinstance(value, _NoValue)}
    try:
        document = MeasurementsDocument.model_validate(rest)
    except ValidationError as error:
        raise _refuse(file, [*faults, *findings_of(error, MeasurementsDocument)]) from error
    why = None if document.student_id is None else why_no_id(document.student_id)
    if why is not None:
        faults.append(Finding("$.student_id", f"'{_shown(document.student_id)}' is refused: {why}"))
    if faults:
        raise _refuse(file, faults)
    return document
