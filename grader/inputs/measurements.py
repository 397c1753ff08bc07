"""Measurement files: drawn lengths, directions and computed values, entered by hand.

CSV for a class: ``student_id,n,position,kL,kv,ka``, then vector names (drawn millimetres),
``NAME_deg`` (directions counter-clockwise from the assignment's +x) and ``NAME_value`` (SI; angular
quantities counter-clockwise positive). Semicolon-separated files have decimal commas; blank means
not measured; a line that begins with ``#`` is a comment. JSON for one student:
`grader.documents.MeasurementsDocument`.

A fault of the whole file (no student_id, no CSV at all) raises InputFileError with all of them. A value
that is refused costs that value alone, and so does a column that is not known: it is a problem of that
student, and `Reading.unread` names what it was entered for, so that no criterion is judged without it.
"""

import csv
import io
import json
import math
import re
import stat
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeGuard

from grader.documents import LikeDocument, MeasurementsDocument
from grader.files import shown_text
from grader.inputs.roster import MAX_LINES, short, surplus_of, whole_number, why_no_id
from grader.inputs.scale_text import MAX_LENGTH as LONGEST_SCALE
from grader.language import N_, ROOT_LANGUAGE, Tongue, tongue
from grader.records import (
    Figure,
    PageRef,
    Reading,
    ReadVector,
    Reason,
    Unread,
    Value,
)
from grader.rubric import RubricFile
from grader.texts.spoken import clause
from reference.authored.assignment import SCALE_NAMES, Assignment, Variant
from reference.authored.variant_table import delimiter_of, table_lines
from reference.construction.derive import construction_of
from reference.construction.graph import Construction, coincident
from reference.errors import MOST_FINDINGS, Finding, InputFileError, lines_of, near_names
from reference.quantities import SCALE_UNITS, kind_of, unit_of

if TYPE_CHECKING:
    from grader.inputs.decisions import Decision

KEYS = ("student_id", "n", "position")
TABLES = {"segments_mm": "", "directions_deg": "_deg", "values": "_value"}
"""The tables of a JSON file, and what a CSV file's columns add to the names in them."""
MAX_BYTES = 1_000_000
"""A class of a thousand with every length, direction and value writes half of it."""
MAX_LENGTH_MM = 2000.0
"""Longer than any sheet: a length in other units, or a slip of the pen."""
NO_SIZE = 1e-12
"""What is smaller is zero: nothing is drawn or computed so finely, and a quotient by it may overflow."""


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
    problems: tuple[Reason, ...] = ()
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
    joints = mechanism.joints
    abouts = [*joints, *(f"{head}{tail}" for head in joints for tail in joints if head != tail)]
    possible = [f"v_{about}" for about in abouts]
    possible += [f"a_{about}{part}" for about in abouts for part in ("", "_n", "_t")]
    under = [
        f"{one}{other}" for pair in coincident(construction).items() for one, other in (pair, pair[::-1])
    ]
    possible += [f"a_{about}_{part}" for about in under for part in ("c", "r")]
    unused = frozenset(possible) - construction.vectors.keys()
    vectors = {name: kind_of(name).figure for name in (*construction.vectors, *sorted(unused))}
    return Names(vectors, tuple(construction.rates), unused)


def columns_of(rubric: RubricFile) -> dict[str, str]:
    """The columns of a file with all that a rubric asks for, each with its unit."""
    columns = {name: unit for name, unit in SCALE_UNITS.items() if name != "ka" or rubric.needs_accelerations}
    for criterion in rubric.criterion:
        if criterion.vector:
            columns[criterion.vector] = "mm"
            columns |= {f"{criterion.vector}_deg": "°"} if criterion.direction else {}
        elif criterion.angular:
            columns[f"{criterion.angular}_value"] = unit_of(criterion.angular)
    return columns


@dataclass(frozen=True, slots=True)
class _Source:
    """The file that is read, and how its faults are told.

    Attributes
    ----------
    file : the name that the user knows it by
    is_own : whether it is one student's own, who need not be named in it
    """

    file: str
    names: Names
    speaker: Tongue
    is_own: bool

    def say(self, text: str, /, **known: object) -> str:
        """A sentence in the reader's language."""
        return self.speaker.gettext(text) % known if known else self.speaker.gettext(text)

    def line(self, number: int) -> str:
        """A line of the file, as a place of a fault."""
        return self.say(N_("line %(number)s"), number=number)

    def refuse(self, findings: Sequence[Finding]) -> InputFileError:
        """The error that says everything that is wrong with the file as a whole."""
        head = self.say(N_("%(file)s: cannot be used"), file=self.file)
        return InputFileError("measurements", f"{head}\n{lines_of(findings)}")


def read_measurements(
    path: Path | str,
    names: Names,
    file: str | None = None,
    *,
    lang: str = ROOT_LANGUAGE,
    is_own: bool = False,
) -> tuple[Measurements, ...]:
    """Read a CSV file of a class, or a JSON file of one student.

    Arguments
    ---------
    file : the name that the user knows it by, if that is not the path's own
    lang : of all that is told of its faults
    is_own : whether it is one student's own file: a CSV file then needs no ``student_id``

    Raises InputFileError with every fault of the file as a whole.
    """
    path = Path(path)
    source = _Source(file or shown_text(path.name), names, tongue(lang), is_own)
    text = _text_of(path, source)
    if path.suffix.lower() == ".json":
        return (_parse_json(text, source),)
    return tuple(_parse_csv(text, source))


def measurements_in(cells: Mapping[str, str], names: Names, file: str, lang: str) -> Measurements:
    """What one student typed into a form: texts by columns of a CSV file, with decimal commas or points.

    Arguments are those of `read_measurements`; raises as it does.
    """
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerows([list(cells), [value.strip() for value in cells.values()]])
    source = _Source(file, names, tongue(lang), is_own=True)
    return next(_parse_csv(text.getvalue(), source), replace(NOTHING_MEASURED, source=file))


def _text_of(path: Path, source: _Source) -> str:
    def unreadable(text: str, /, **known: object) -> InputFileError:
        return InputFileError("measurements_unreadable", f"{source.file}: {source.say(text, **known)}")

    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise unreadable(N_("it is a folder or a pipe, not a file"))
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except FileNotFoundError as error:
        raise unreadable(N_("there is no such file")) from error
    except OSError as error:
        raise unreadable(N_("cannot be read: %(why)s"), why=error.strerror or error) from error
    if len(content) > MAX_BYTES:
        most = MAX_BYTES // 1_000_000
        raise unreadable(N_("is larger than %(most)s MB: these are no measurements"), most=most)
    try:
        return content.decode("utf-16" if content[:2] in {b"\xff\xfe", b"\xfe\xff"} else "utf-8-sig")
    except UnicodeDecodeError as error:
        why = source.say(N_("is not UTF-8 text; save it as CSV in UTF-8"))
        raise InputFileError("measurements_encoding", f"{source.file}: {why}") from error


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


def _columns(names: Names) -> Mapping[str, tuple[str, str]]:
    """The columns of a CSV file that hold numbers: the table of each, and the name in it."""
    known = {"segments_mm": names.vectors, "directions_deg": names.vectors, "values": names.values}
    return {f"{name}{end}": (table, name) for table, end in TABLES.items() for name in known[table]}


@dataclass(frozen=True, slots=True)
class _NoValue:
    """What stands in a file in place of a value, and why it is none: a key of the catalogues."""

    text: str
    why: str

    def __str__(self) -> str:
        return self.text


def _entry(name: str, column: str, shown: str) -> Unread:
    """What cannot be used of an entry, as it was written: not read for the vector of this name."""
    return Unread(name, Reason("entry", {"entries": (f"{column}: {shown}",)}))


@dataclass(slots=True)
class _Entries:
    """What one student entered, while it is being read; what is refused costs that entry alone.

    Attributes
    ----------
    columns : by a CSV file's columns, the table and the name in it
    line : of a CSV file
    """

    source: _Source
    columns: Mapping[str, tuple[str, str]]
    line: int | None = None
    scales: dict[str, str] = field(default_factory=dict)
    tables: dict[str, dict[str, float]] = field(default_factory=lambda: {table: {} for table in TABLES})
    faults: list[Finding] = field(default_factory=list)
    problems: list[Reason] = field(default_factory=list)
    unread: list[Unread] = field(default_factory=list)

    def fault(self, path: str, why: str) -> None:
        """Note what is wrong, where a path or a column says; the whole line for none."""
        if self.line is not None:
            line = self.source.line(self.line)
            path = f"{line}, {path}" if path else line
        self.faults.append(Finding(path, why))

    def number(self, path: str, column: str, text: str, value: float | _NoValue) -> None:
        """Enter the number that a column or table has, or note why it is refused."""
        say = self.source.say
        why = say(value.why) if isinstance(value, _NoValue) else self._refusal(column, value)
        if why is None and isinstance(value, float):
            table, name = self.columns[column]
            self.tables[table][name] = value if abs(value) >= NO_SIZE else 0.0
        else:
            self.fault(path, f"'{text}': {why}")
            self.unread.append(_entry(self.columns[column][1], column, f"'{text}'"))

    def _refusal(self, column: str, value: float) -> str | None:
        """Why a number cannot be what it is entered for, or None."""
        table, _ = self.columns[column]
        if not math.isfinite(value):
            return self.source.say(NOT_FINITE)
        if table == "segments_mm" and not 0.0 <= value <= MAX_LENGTH_MM:
            most = f"{MAX_LENGTH_MM:g}"
            return self.source.say(N_("a drawn length is from 0 to %(most)s mm"), most=most)
        if table == "directions_deg" and abs(value) > 360.0:
            return self.source.say(N_("a direction is from -360 to 360 degrees"))
        return None

    def unknown(self, column: str, text: str, near: Sequence[str]) -> None:
        """Tell that a column is not known; what it may be meant for is not judged without it."""
        known = {"near": tuple(near)} if near else {}
        self.problems.append(Reason("measurement_columns", {"column": short(column), **known}))
        self.unread += [_entry(self.columns[meant][1], column, f"'{text}'") for meant in near]

    def scale(self, path: str, name: str, text: str | _NoValue) -> None:
        """Enter a scale as declared, or note why it is refused."""
        if isinstance(text, str) and len(text) > LONGEST_SCALE:
            text = _NoValue(f"{text[:40]}...", TOO_LONG_A_SCALE)
        if isinstance(text, str):
            self.scales[name] = text
        else:
            self.fault(path, f"'{text}': {self.source.say(text.why)}")
            self.unread.append(_entry(name, name, f"'{text}'"))

    def measurements(
        self, student_id: str | None, n: int | None, position: int | None, *, is_usable: bool = True
    ) -> Measurements:
        """All that was entered, in the order of the construction."""
        lengths, directions, values = (self.tables[table] for table in TABLES)
        names, file = self.source.names, self.source.file
        reading = reading_of(names.vectors, lengths, directions)
        problems = [
            Reason("measurement_fault", {"detail": str(fault)}, file) for fault in self.faults[:MOST_FINDINGS]
        ]
        if len(self.faults) > MOST_FINDINGS:
            problems.append(Reason("measurement_fault", {"more": len(self.faults) - MOST_FINDINGS}, file))
        problems += [replace(problem, file=file) for problem in self.problems[:MOST_FINDINGS]]
        unused = sorted(names.unused.intersection({*lengths, *directions, *values}))
        if unused:
            problems.append(Reason("measurement_not_used", {"columns": tuple(unused)}, file))
        return Measurements(
            student_id=student_id,
            n=n,
            position=position,
            scales=self.scales,
            reading=replace(reading, unread=tuple(self.unread)),
            values={name: values[name] for name in names.values if name in values},
            source=file,
            line=self.line,
            problems=tuple(problems),
            is_usable=is_usable,
        )


# CSV ----------------------------------------------------------------------------------------------


NOT_FINITE, NO_NUMBER = N_("is no finite number"), N_("is no number")
TOO_LONG_A_SCALE = N_("is too long for a scale")
NO_WHOLE_NUMBER = N_("'%(text)s' is no whole number")
NO_ID = N_("'%(text)s' is refused: %(why)s")
_COMMENT = re.compile(r'^[ \t]*"?#[^\n]*', re.MULTILINE)


def _parse_csv(text: str, source: _Source) -> Iterator[Measurements]:
    text = _COMMENT.sub("", text)
    delimiter = delimiter_of(text)
    lines, faults = table_lines(text, delimiter, MAX_LINES, source.speaker.gettext)
    if not lines and not faults:
        why = source.say(N_("the file is empty; its first line must name the columns"))
        faults = [Finding(source.line(1), why)]
    header = [cell.strip() for cell in lines[0][1]] if lines else []
    columns = _columns(source.names)
    faults = faults or list(_check_header(header, columns, source))
    if faults:
        raise source.refuse(faults)
    known = frozenset((*KEYS, *SCALE_NAMES, *columns))
    unknown = [name for name in header if name and name not in known][:MOST_FINDINGS]
    near = {name: [one for one in near_names(name, sorted(columns)) if one not in header] for name in unknown}
    for number, cells in lines[1:]:
        yield _line(header, cells, delimiter, near, _Entries(source, columns, number))


def _check_header(
    header: list[str], columns: Mapping[str, tuple[str, str]], source: _Source
) -> Iterator[Finding]:
    line = source.line(1)
    if "student_id" not in header and not source.is_own:
        yield Finding(line, source.say(N_("column student_id is missing")))
    if not {*SCALE_NAMES, *columns}.intersection(header):
        example = ", ".join(list(columns)[:3])
        why = N_("no column of measurements is known here; there are %(names)s, ...")
        yield Finding(line, source.say(why, names=example))
    for name, count in Counter(filter(None, header)).items():
        if count > 1:
            why = N_("column %(name)s is there %(count)s times")
            yield Finding(line, source.say(why, name=short(name), count=count))


DID_YOU_MEAN, OR = N_("did you mean %(names)s?"), N_("or")


def _did_you_mean(near: Sequence[str], source: _Source) -> str:
    either = f" {source.say(OR)} ".join(near)
    return f"; {source.say(DID_YOU_MEAN, names=either)}" if near else ""


def _line(
    header: list[str],
    cells: list[str],
    delimiter: str,
    near: Mapping[str, Sequence[str]],
    entries: _Entries,
) -> Measurements:
    """What one line says; what is wrong in it is left out and reported."""
    source = entries.source
    known = {name: cell.strip() for name, cell in zip(header, cells, strict=False) if name and cell.strip()}
    surplus = surplus_of(header, cells, delimiter, source.speaker)
    if surplus is not None:
        entries.fault("", source.say(N_("%(why)s; nothing of it is used"), why=surplus))
        known = {"student_id": cells[0].strip()} if header[0] == "student_id" else {}
    student = known.get("student_id", "")
    why = None if source.is_own and not student else why_no_id(student)
    if why is not None:
        entries.fault("student_id", source.say(NO_ID, text=student[:40], why=clause(why, source.speaker)))
    numbers = {name: whole_number(known[name], delimiter) for name in ("n", "position") if name in known}
    for name, number in numbers.items():
        if number is None:
            entries.fault(name, source.say(NO_WHOLE_NUMBER, text=known[name][:40]))
    # Without its student, n and position nobody knows what it is held against.
    is_usable = not entries.faults
    for column, text in known.items():
        if column in entries.columns:
            entries.number(column, column, text[:40], _number(text, delimiter))
        elif column in near:
            entries.unknown(column, text[:40], near[column])
    for scale in SCALE_NAMES:
        if scale in known:
            entries.scale(scale, scale, known[scale])
    owner = None if why else student or None
    return entries.measurements(owner, numbers.get("n"), numbers.get("position"), is_usable=is_usable)


_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)


def _number(text: str, delimiter: str) -> float | _NoValue:
    plain = text.replace("\N{MINUS SIGN}", "-")
    if delimiter == ";":
        plain = plain.replace(",", ".", 1)
    if _NUMBER.fullmatch(plain) is not None:
        return float(plain)
    if "," in text and delimiter == ",":
        return _NoValue(text, N_("is no number; write a decimal point, or separate fields by semicolons"))
    return _NoValue(text, NO_NUMBER)


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
            read = _NoValue(f"{_shown(table[name])} and {_shown(read)}", N_("is there more than once"))
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


def _parse_json(text: str, source: _Source) -> Measurements:
    try:
        data = json.loads(
            text,
            object_pairs_hook=_object,
            parse_int=_whole_number,
            parse_constant=lambda name: _NoValue(name, NOT_FINITE),
        )
    except (ValueError, RecursionError) as error:
        line, column = getattr(error, "lineno", 1), getattr(error, "colno", 1)
        why = source.say(
            N_("is not JSON: look at line %(line)s, column %(column)s"), line=line, column=column
        )
        raise source.refuse([Finding("$", why)]) from error
    if not isinstance(data, dict):
        why = source.say(N_("is no table: a file of measurements begins with a brace"))
        raise source.refuse([Finding("$", why)])
    entries = _Entries(source, _columns(source.names))
    for name, value in _take(data, "scales"):
        if name not in SCALE_NAMES:
            known = source.say(N_("is not known here; there are %(names)s"), names=", ".join(SCALE_NAMES))
            entries.fault(f"$.scales.{name[:40]}", known)
        else:
            declared = str(value) if _is_number(value) else value
            if not isinstance(declared, str | _NoValue):
                declared = _NoValue(_shown(value), NO_NUMBER)
            entries.scale(f"$.scales.{name}", name, declared)
    for table, end in TABLES.items():
        _enter(dict(_take(data, table)), table, end, entries)
    return entries.measurements(*_about(data, source))


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
    names = entries.source.names
    known = names.values if table == "values" else tuple(names.vectors)
    for name, value in given.items():
        path, shown = f"$.{table}.{name[:40]}", _shown(value)
        if name not in known:
            near = near_names(name, known) if len(entries.faults) < MOST_FINDINGS else []
            why = entries.source.say(NOT_KNOWN)
            entries.fault(path, f"{why}{_did_you_mean(near, entries.source)}")
            entries.unread += [_entry(meant, name, f"'{shown}'") for meant in near if meant not in given]
        elif _is_number(value):
            entries.number(path, f"{name}{end}", shown, float(value))
        else:
            refused = value if isinstance(value, _NoValue) else _NoValue(shown, NO_NUMBER)
            entries.number(path, f"{name}{end}", shown, refused)


NOT_KNOWN = N_("is not known here")
NO_TABLE = N_("must be a table in braces")
KEYS_OF_DOCUMENT = tuple(MeasurementsDocument.model_fields)


def _about(data: Mapping[str, object], source: _Source) -> tuple[str | None, int | None, int | None]:
    """Whose they are, n and position. Raises InputFileError with all faults in what is left of the file."""
    faults: list[Finding] = []
    for key, value in data.items():
        why = ""
        if isinstance(value, _NoValue):
            why = f"{source.say(value.why)}: {value}"
        elif key not in KEYS_OF_DOCUMENT:
            why = source.say(NOT_KNOWN) + _did_you_mean(near_names(key, KEYS_OF_DOCUMENT), source)
        elif key in {"scales", *TABLES}:
            why = source.say(NO_TABLE)
        elif key == "schema_version":
            why = "" if value == 1 else source.say(N_("must be 1"))
        elif value is not None:
            why = _misfit(key, value, source)
        if why:
            faults.append(Finding(f"$.{key[:40]}", why))
    if faults:
        raise source.refuse(faults)
    student, n, position = (data.get(key) for key in KEYS)
    return (
        student if isinstance(student, str) else None,
        n if isinstance(n, int) else None,
        position if isinstance(position, int) else None,
    )


def _misfit(key: str, value: object, source: _Source) -> str:
    """Why a value cannot be a student's id, n or position; empty where it can."""
    if key != "student_id":
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        return "" if is_whole else source.say(NO_WHOLE_NUMBER, text=_shown(value))
    if not isinstance(value, str):
        return source.say(N_("must be text in quotes"))
    why = why_no_id(value)
    return "" if why is None else source.say(NO_ID, text=_shown(value), why=clause(why, source.speaker))
