"""Measurement files: drawn lengths, directions and computed values, entered by hand.

CSV for a class: ``student_id,n,position,kL,kv,ka``, then vector names (drawn millimetres),
``NAME_deg`` (directions counter-clockwise from the assignment's +x) and ``NAME_value`` (SI; angular
quantities counter-clockwise positive, or with a sense: ``2.09 cw``, or cw in ``NAME_sense``). On the sketch
``a_D_sketch`` is a vector drawn again, ``J3`` and ``J3_deg`` are a centre's distance and direction from the
driving link's pivot. Semicolon-separated files have decimal commas; blank means not measured; a line that
begins with ``#`` is a comment. JSON for one student: `grader.documents.MeasurementsDocument`.

A fault of the whole file (no student_id, no CSV at all) raises TableError with all of them. A value
that is refused costs that value alone, and so does a column that is not known: it is a problem of that
student, and `Reading.unread` names what it was entered for, so that no criterion is judged without it.
"""

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeGuard

from grader.documents import LikeDocument, MeasurementsDocument
from grader.files import shown_text
from grader.language import tongue
from grader.records import (
    MECHANISM,
    Figure,
    PageRef,
    Reading,
    ReadVector,
    Reason,
    Unread,
    Value,
)
from grader.rubric import RubricFile, scales_asked
from grader.tables.reader import (
    MARK,
    Row,
    TableError,
    TableKind,
    at,
    decoded,
    near,
    real_number,
    refused_id,
    short,
    turned,
    why_no_id,
)
from grader.tables.scale_text import MAX_LENGTH as LONGEST_SCALE
from reference.authored.assignment import SCALE_NAMES, USUAL_SCALES, Assignment, Variant
from reference.authored.variant_table import delimiter_of
from reference.construction.derive import construction_of
from reference.construction.graph import Construction, coincident
from reference.errors import MOST_FINDINGS, writable
from reference.quantities import kind_of, unit_of, value_name

if TYPE_CHECKING:
    from grader.tables.decisions import Decision

KEYS = ("student_id", "n", "position")
TABLES = {"segments_mm": "", "directions_deg": "_deg", "values": "_value"}
"""The tables of a JSON file, and what a CSV file's columns add to the names in them."""
UNITS = {"segments_mm": "mm", "directions_deg": "°"}
"""The unit of a table's numbers; those of values have the unit of each quantity."""
MAX_BYTES = 1_000_000
"""A class of a thousand with every length, direction and value writes half of it."""
CLASS_TABLE = TableKind(
    "measurements", KEYS, ("student_id",), MAX_BYTES, 20_000,
    has_comments=True, unreadable="measurements_unreadable", encoding="measurements_encoding",
)  # fmt: skip
OWN_TABLE = replace(CLASS_TABLE, required=())
"""One student's own, who need not be named in it."""
MAX_LENGTH_MM = 2000.0
"""Longer than any sheet: a length in other units, or a slip of the pen."""
NO_SIZE = 1e-12
"""Smaller values are zero: nothing is drawn or computed so finely, and a quotient by it may overflow."""


@dataclass(frozen=True, slots=True)
class Measurements:
    """The measurements of one student, for one variant.

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
    problems: tuple[Reason, ...] = ()
    is_usable: bool = True
    further_scales: tuple[Mapping[str, str], ...] = ()

    @property
    def place(self) -> str:
        """The file, and after a colon the line if the file has lines."""
        return self.source if self.line is None else f"{self.source}:{self.line}"

    @property
    def numbers(self) -> dict[str, float]:
        """The entered numbers by the names of a CSV file's columns: mm, ``NAME_deg``, ``NAME_value``."""
        entered: dict[str, float] = {}
        for figure in self.reading.figures.values():
            for name, vector in figure.vectors.items():
                if vector.length_mm is not None:
                    entered[name] = vector.length_mm
                if vector.direction_deg is not None:
                    entered[f"{name}_deg"] = vector.direction_deg
        ends = {name: "" if name.endswith("_sense") else "_value" for name in self.values}
        return entered | {f"{name}{ends[name]}": value for name, value in self.values.items()}


NOTHING_MEASURED = Measurements(None, None, None, {}, Reading({}), {}, "")


@dataclass(frozen=True, slots=True)
class StudentSubmission:
    """One student's submission for one variant.

    Attributes
    ----------
    variant : None where nothing says the student's number or position
    declared : scales as declared, text by ``kL``, ``kv``, ``ka``
    measured : entered measurements, or None
    problems : what was noticed before marking
    has_unusable : whether something was handed in that cannot be used; `problems` say what
    decided : what people decided of it, to be applied
    opened : settled verdicts that an audit of the class found to be no longer trusted
    """

    student_id: str
    variant: Variant | None
    pages: tuple[PageRef, ...] = ()
    declared: Mapping[str, str] = field(default_factory=dict)
    measured: Measurements | None = None
    lang: str = "en"
    name: str = ""
    problems: tuple[Reason, ...] = ()
    has_unusable: bool = False
    decided: "tuple[Decision, ...]" = ()
    opened: tuple[LikeDocument, ...] = ()

    @property
    def undeclared(self) -> tuple[str, ...]:
        """The scales that neither the roster nor measurements declare: looked for on plain paper."""
        measured = {} if self.measured is None else self.measured.scales
        return tuple(name for name in SCALE_NAMES if name not in self.declared and name not in measured)

    @property
    def position(self) -> int | None:
        """The variant's position; None where there is none or it is not known."""
        return None if self.variant is None else self.variant.position


@dataclass(frozen=True, slots=True)
class Names:
    """Names of measurable quantities: vectors with the plan each is in, rates and moments, scales."""

    vectors: Mapping[str, str]
    rates: tuple[str, ...]
    unused: frozenset[str] = frozenset()
    """Vectors that make sense in this mechanism, but that its plans are drawn without."""
    scales: tuple[str, ...] = USUAL_SCALES

    @property
    def values(self) -> tuple[str, ...]:
        """Names of the quantities with a computed value."""
        return (*self.vectors, *self.rates, *(f"{name}_sense" for name in self.rates))


def names_of(assignment: Assignment) -> Names:
    """The names that an assignment's measurement files may hold."""
    mechanism = assignment.mechanism(assignment.variants()[:1])
    construction: Construction = construction_of(mechanism, forces=assignment.forces)
    joints = mechanism.joints
    abouts = [*joints, *(f"{head}{tail}" for head in joints for tail in joints if head != tail)]
    possible = [f"v_{about}" for about in abouts]
    possible += [f"a_{about}{part}" for about in abouts for part in ("", "_n", "_t")]
    under = [
        f"{one}{other}" for pair in coincident(construction).items() for one, other in (pair, pair[::-1])
    ]
    possible += [f"a_{about}_{part}" for about in under for part in ("c", "r")]
    unused = frozenset(possible) - construction.vectors.keys()
    vectors = {name: construction.figure_of(one.head) for name, one in construction.vectors.items()}
    vectors |= {name: kind_of(name).figure for name in sorted(unused)}
    vectors |= dict.fromkeys(construction.on_sketch, MECHANISM)
    rates = (*construction.rates, *construction.moments)
    return Names(vectors, rates, unused, assignment.scale_names)


def columns_of(assignment: Assignment, rubric: RubricFile) -> dict[str, str]:
    """The columns of a file with all that a rubric asks for, each with its unit."""
    columns = {name: unit_of(name) for name in scales_asked(assignment, rubric)}
    for criterion in rubric.criterion:
        if criterion.vector or criterion.point:
            columns[criterion.name] = "mm"
            columns |= {f"{criterion.name}_deg": "°"} if criterion.direction else {}
        elif criterion.value:
            columns[criterion.name] = unit_of(criterion.value)
        elif criterion.sense:
            columns[criterion.name] = "cw/ccw"
        elif criterion.turning:
            columns[value_name(criterion.turning)] = unit_of(criterion.turning)
    return columns


def read_measurements(
    path: Path | str, names: Names, file: str | None = None, *, is_own: bool = False
) -> tuple[Measurements, ...]:
    """Read a CSV file of a class, or a JSON file of one student.

    Arguments
    ---------
    file : the name that the user knows it by, if that is not the path's own
    is_own : whether it is one student's own file: a CSV file then needs no ``student_id``

    Raises TableError with every fault of the file as a whole.
    """
    path = Path(path)
    name, first = file or shown_text(path.name), next(iter(names.vectors), "v_A")
    examples = (*KEYS, *names.scales, *(f"{first}{end}" for end in TABLES.values()))
    kind = replace(OWN_TABLE if is_own else CLASS_TABLE, columns=examples)
    text = kind.text(path, name)
    if path.suffix.lower() == ".json":
        return (_parse_json(text, name, names),)
    columns = _columns(names)
    table = kind.table(text, name, lambda header: _faults_of(header, names.scales, columns))
    meant = _unknown(table.header, names.scales, columns)
    return tuple(_line(row, meant, _Entries(name, names, columns, row), is_own=is_own) for row in table.rows)


def measurements_in(cells: Mapping[str, str], names: Names, file: str, lang: str) -> Measurements:
    """Read what one student typed into a form: texts by columns of a CSV file, with decimal commas or points.

    Raises TableError, in the language, where none of the columns is known.
    """
    row, columns = Row(0, tuple(cells.values()), tuple(cells), ";"), _columns(names)
    if faults := list(_faults_of(row.header, names.scales, columns)):
        raise TableError(CLASS_TABLE.code, file, faults, tongue(lang))
    meant = _unknown(row.header, names.scales, columns)
    return _line(row, meant, _Entries(file, names, columns, row), is_own=True)


def students_in(path: Path) -> tuple[str, ...]:
    """The students whom a file names that cannot be used as a whole, as far as they can be made out."""
    try:
        if not path.is_file():
            return ()
        with path.open("rb") as stream:
            text = decoded(stream.read(MAX_BYTES), "replace").removeprefix(MARK)
    except OSError:
        return ()
    if path.suffix.lower() == ".json":
        named = re.findall(r'"student_id"\s*:\s*"([^"\n]{1,64})"', text)
    else:
        header, *lines = text.splitlines()[: CLASS_TABLE.most_lines] or [""]
        delimiter = delimiter_of(header)
        columns = [cell.strip(' "') for cell in header.split(delimiter)]
        column = columns.index("student_id") if "student_id" in columns else len(columns)
        rows = (line.split(delimiter, column + 1) for line in lines)
        named = [cells[column].strip(' "') for cells in rows if len(cells) > column]
    return tuple(name for name in dict.fromkeys(named) if why_no_id(name) is None)


def _columns(names: Names) -> Mapping[str, tuple[str, str]]:
    """The columns of a CSV file that hold numbers: the table of each, and the name in it."""
    vectors = tuple(names.vectors)
    known = {"segments_mm": vectors, "directions_deg": vectors, "values": (*vectors, *names.rates)}
    columns = {f"{name}{end}": (table, name) for table, end in TABLES.items() for name in known[table]}
    return columns | {f"{name}_sense": ("values", name) for name in names.rates}


def _faults_of(
    header: Sequence[str], scales: Sequence[str], columns: Mapping[str, object]
) -> Iterator[Reason]:
    if not {*scales, *columns}.intersection(header):
        yield Reason("no_measurements", {"line": 1, "names": tuple(columns)[:3]})


def _unknown(
    header: Sequence[str], scales: Sequence[str], columns: Mapping[str, object]
) -> dict[str, tuple[str, ...]]:
    """The columns that are not known, each with those it may be meant for that are not there."""
    known, names = {"", *KEYS, *scales, *columns}, sorted(columns)
    unknown = [name for name in header if name not in known][:MOST_FINDINGS]
    meant = {name: near(name, names, most=2).get("near", ()) for name in unknown}
    return {name: tuple(one for one in near_it if one not in header) for name, near_it in meant.items()}


def _entry(name: str, column: str, shown: str) -> Unread:
    """Return an entry that cannot be used, as it was written: the vector of this name is unread."""
    return Unread(name, Reason("entry", {"entries": (f"{column}: {shown}",)}))


@dataclass(slots=True)
class _Entries:
    """The entries of one student while they are read; a refused one is left out alone.

    Attributes
    ----------
    columns : by a CSV file's columns, the table and the name in it
    row : the line of a CSV file, or one of no file at all for JSON, with what is wrong
    """

    file: str
    names: Names
    columns: Mapping[str, tuple[str, str]]
    row: Row = field(default_factory=lambda: Row(0, (), (), ""))
    scales: dict[str, str] = field(default_factory=dict)
    tables: dict[str, dict[str, float]] = field(default_factory=lambda: {table: {} for table in TABLES})
    problems: list[Reason] = field(default_factory=list)
    unread: list[Unread] = field(default_factory=list)

    def number(self, path: str, column: str, text: str, value: float | Reason) -> None:
        """Enter the number that a column or table has, or note why it is refused."""
        table, name = self.columns[column]
        found = value if isinstance(value, Reason) else _checked(table, text, value)
        if isinstance(found, Reason):
            self.row.fault(path, found)
            self.unread.append(_entry(name, column, f"'{text}'"))
        else:
            self.tables[table][name] = found

    def turning(self, path: str, name: str, cells: tuple[str, str], delimiter: str, *, asks: bool) -> None:
        """Enter an angular quantity and its sense, told in the same cell, beside it, or by the sign.

        Arguments: `asks` that there is a column for the sense, which may be blank.
        """
        text, beside = " ".join(cells).strip(), turned(cells[1], delimiter)
        is_sense = not cells[1] or (isinstance(beside, tuple) and beside[1])
        no_sense = Reason("no_sense", {"text": short(cells[1])})
        found = turned(text, delimiter, unit_of(name)) if is_sense else no_sense
        value, sense = found if isinstance(found, tuple) else (found, 0.0)
        if value is not None:
            self.number(path, f"{name}_value", short(text), value)
        if sense or (asks and text):
            self.tables["values"][f"{name}_sense"] = sense

    def unknown(self, column: str, text: str, meant: tuple[str, ...]) -> None:
        """Tell that a column is not known; what it may be meant for is not judged without it."""
        known: dict[str, Value] = {"near": meant} if meant else {}
        self.problems.append(Reason("measurement_columns", {"column": short(column), **known}))
        self.unread += [_entry(self.columns[one][1], column, f"'{text}'") for one in meant]

    def scale(self, path: str, name: str, text: str | Reason) -> None:
        """Enter a scale as declared, or note why it is refused."""
        found = text
        if isinstance(text, str) and len(text) > LONGEST_SCALE:
            found = Reason("too_long", {"most": LONGEST_SCALE, "text": f"{text[:40]}..."})
        if isinstance(found, Reason):
            self.row.fault(path, found)
            self.unread.append(_entry(name, name, f"'{found.parameters['text']}'"))
        else:
            self.scales[name] = found

    def measurements(
        self, student_id: str | None, n: int | None, position: int | None, *, is_usable: bool = True
    ) -> Measurements:
        """All that was entered, in the order of the construction."""
        lengths, directions, values = (self.tables[table] for table in TABLES)
        faults, names = self.row.faults, self.names
        shown = faults[:MOST_FINDINGS]
        problems = [Reason("measurement_fault", {"why": one.code, **one.parameters}) for one in shown]
        if len(faults) > MOST_FINDINGS:
            problems.append(Reason("measurement_fault", {"more": len(faults) - MOST_FINDINGS}))
        problems += self.problems[:MOST_FINDINGS]
        unused = sorted(names.unused.intersection({*lengths, *directions, *values}))
        if unused:
            problems.append(Reason("measurement_not_used", {"columns": tuple(unused)}))
        return Measurements(
            student_id=student_id,
            n=n,
            position=position,
            scales=self.scales,
            reading=replace(reading_of(names.vectors, lengths, directions), unread=tuple(self.unread)),
            values={name: values[name] for name in names.values if name in values},
            source=self.file,
            line=self.row.line or None,
            problems=tuple(replace(problem, file=self.file) for problem in problems),
            is_usable=is_usable,
        )


def _checked(table: str, text: str, value: float) -> float | Reason:
    """A number that may be entered in a table; or why it cannot be what it is entered for."""
    if not math.isfinite(value):
        return Reason("not_finite", {"text": text})
    if table == "segments_mm" and not 0.0 <= value <= MAX_LENGTH_MM:
        return Reason("length_range", {"text": text, "most_mm": int(MAX_LENGTH_MM)})
    if table == "directions_deg" and abs(value) > 360.0:
        return Reason("direction_range", {"text": text})
    return value if abs(value) >= NO_SIZE else 0.0


def _line(row: Row, meant: Mapping[str, tuple[str, ...]], entries: _Entries, *, is_own: bool) -> Measurements:
    """Read one line; faulty entries are left out and reported."""
    if row.is_too_wide():
        row.text = {"student_id": row["student_id"]} if row.header[0] == "student_id" else {}
    student = row.student(may_be_blank=is_own)
    n, position = row.whole("n"), row.whole("position")
    # Without its student, n and position nobody knows what it is held against.
    is_usable = not row.faults
    for name in entries.names.rates:
        cells = row[f"{name}_value"], row[f"{name}_sense"]
        if any(cells):
            path = f"{name}_{'value' if cells[0] else 'sense'}"
            entries.turning(path, name, cells, row.delimiter, asks=f"{name}_sense" in row.text)
    for column, text in row.text.items():
        if text and column in entries.columns and entries.columns[column][1] not in entries.names.rates:
            table, name = entries.columns[column]
            unit = UNITS.get(table) or unit_of(name)
            entries.number(column, column, short(text), real_number(text, row.delimiter, unit))
        elif text and column in meant:
            entries.unknown(column, short(text), meant[column])
    for scale in entries.names.scales:
        if row[scale]:
            entries.scale(scale, scale, row[scale])
    return entries.measurements(student, n, position, is_usable=is_usable)


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
    twice: dict[str, Value] = {
        "student": first.student_id or "",
        "places": tuple(each.place for each in sets),
    }
    problems = [Reason("measurements_twice", twice, first.source)]
    given: dict[str, dict[float, str]] = {}
    for each in sets:
        for column, value in each.numbers.items():
            given.setdefault(column, {}).setdefault(value, each.place)
    unread = [gap for each in sets for gap in each.reading.unread]
    for column, where in given.items():
        if len(where) > 1:
            unread.append(_entry(_name_of(column), column, " / ".join(f"{value:g}" for value in where)))
            values = tuple(f"{value:g} ({place})" for value, place in where.items())
            problems.append(Reason("measurements_disagree", {"column": column, "values": values}))
    agreed = {column: next(iter(where)) for column, where in given.items() if len(where) == 1}
    figures = [figure for each in sets for figure in each.reading.figures.items()]
    plans = {name: plan for plan, figure in figures for name in figure.vectors}
    directions = {name: agreed[f"{name}_deg"] for name in plans if f"{name}_deg" in agreed}
    return replace(
        first,
        reading=replace(reading_of(plans, agreed, directions), unread=tuple(unread)),
        values={_name_of(name): one for name, one in agreed.items() if name.endswith(("_value", "_sense"))},
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
        name, read = writable(key), writable(value) if isinstance(value, str) else value
        if name in table:
            read = Reason("there_twice", {"text": f"{_shown(table[name])} / {_shown(read)}"})
        table[name] = read
    return table


def _shown(value: object) -> str:
    if isinstance(value, Reason):
        return str(value.parameters["text"])
    return "[...]" if isinstance(value, list) else "{...}" if isinstance(value, dict) else short(str(value))


MOST_DIGITS = 18
"""Most digits of a whole number that fits 64 bits."""


def _whole_number(digits: str) -> int | float:
    """Python refuses to read whole numbers of thousands of digits, and no number here has so many."""
    return int(digits) if len(digits) <= MOST_DIGITS else float(digits)


def _parse_json(text: str, file: str, names: Names) -> Measurements:
    try:
        data = json.loads(
            text.removeprefix(MARK),
            object_pairs_hook=_object,
            parse_int=_whole_number,
            parse_constant=lambda name: Reason("not_finite", {"text": name}),
        )
    except (ValueError, RecursionError) as error:
        known = {"row": getattr(error, "lineno", 1), "sign": getattr(error, "colno", 1)}
        raise TableError(CLASS_TABLE.code, file, [Reason("no_json", known)]) from error
    if not isinstance(data, dict):
        raise TableError(CLASS_TABLE.code, file, [Reason("no_braces")])
    entries = _Entries(file, names, _columns(names))
    for name, value in _take(data, "scales"):
        path = f"$.scales.{name[:40]}"
        if name not in names.scales:
            entries.row.fault(path, Reason("not_known", {"names": names.scales}))
        else:
            entries.scale(path, name, str(value) if _is_number(value) else _text_or_fault(value))
    for table, end in TABLES.items():
        _enter(dict(_take(data, table)), table, end, entries)
    return entries.measurements(*_about(data, file))


def _text_or_fault(value: object) -> str | Reason:
    return value if isinstance(value, str | Reason) else Reason("no_number", {"text": _shown(value)})


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
    pairs = {name: [given.get(name), given.get(f"{name}_sense")] for name in entries.names.rates}
    told = {name: cells for name, cells in pairs.items() if table == "values" and str in map(type, cells)}
    for name, cells in told.items():
        first, second = (str(one) if isinstance(one, str) or _is_number(one) else "" for one in cells)
        entries.turning(f"$.values.{name}", name, (first, second), ";", asks=f"{name}_sense" in given)
    for name, value in given.items():
        if name.removesuffix("_sense") in told:
            continue
        path, shown = f"$.{table}.{name[:40]}", _shown(value)
        if name not in known:
            meant = near(name, known, most=2) if len(entries.row.faults) < MOST_FINDINGS else {}
            entries.row.fault(path, Reason("not_known", meant))
            entries.unread += [
                _entry(one, name, f"'{shown}'") for one in meant.get("near", ()) if one not in given
            ]
        elif _is_number(value):
            entries.number(path, f"{name}{end}", shown, float(value))
        else:
            why = value if isinstance(value, Reason) else Reason("no_number", {"text": shown})
            entries.number(path, f"{name}{end}", shown, why)


def _about(data: Mapping[str, object], file: str) -> tuple[str | None, int | None, int | None]:
    """Return the student, n and position. Raises TableError with all faults in what is left of the file."""
    found = [(key, why) for key, value in data.items() if (why := _misfit(key, value)) is not None]
    if found:
        faults = [at(why, None, f"$.{key[:40]}") for key, why in found]
        raise TableError(CLASS_TABLE.code, file, faults)
    student, n, position = (data.get(key) for key in KEYS)
    return (
        student if isinstance(student, str) else None,
        n if isinstance(n, int) else None,
        position if isinstance(position, int) else None,
    )


def _misfit(key: str, value: object) -> Reason | None:
    """Return why a key of a document, or its value, cannot be used; None if it can."""
    if isinstance(value, Reason):
        return value
    if key not in MeasurementsDocument.model_fields:
        return Reason("not_known", near(key, MeasurementsDocument.model_fields, most=2))
    if key in {"scales", *TABLES}:
        return Reason("no_braces_inside")
    if key == "schema_version":
        return None if value == 1 else Reason("must_be_one")
    if value is None:
        return None
    if key != "student_id":
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        return None if is_whole else Reason("no_whole_number", {"text": _shown(value)})
    return refused_id(value) if isinstance(value, str) else Reason("no_quotes")
