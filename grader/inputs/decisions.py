"""What people decided: a CSV file beside the submissions, which the program keeps and people may edit.

Columns ``student_id,position,criterion,verdict,points,comment,by,at,basis``. Comma or semicolon separated; in
a semicolon-separated file `points` has a decimal comma. `criterion` says what a row is about:

| criterion | verdict | points |
|---|---|---|
| an id of the rubric | `full`, `partial`, `none`, `follow_through`, `not_judged` | blank, or as given |
| `node:FIGURE:NODE` | the node's place, ``x,y`` in millimetres of the sheet | blank |
| `audit:ID` | ``right; said=full``: whether the settled verdict is right (or `wrong`, `unclear`) | blank |
| `page:FILE#N` | ``owner=s03; turn=90; corners=x,y x,y x,y x,y``, at least one of them | blank |
| `total` | blank | added, or taken away with a minus |
| `comment` | blank | blank |

A fault of the whole file raises InputFileError. A line that cannot be used costs that line alone: it is told,
and kept as it stands when the file is written.
"""

import csv
import io
import math
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Literal

from grader.files import OutputError, guarded, make_folder, sync_folder, unguarded, write_whole
from grader.inputs.decision_texts import (
    LARGEST,
    AuditAnswer,
    PageDecision,
    audit_answer,
    page_decision,
    place,
)
from grader.inputs.roster import (
    ScanRef,
    parse_scan,
    short,
    surplus_of,
    whole_number,
    why_no_id,
)
from grader.language import ID_RULES
from reference.authored.variant_table import delimiter_of, table_lines
from reference.errors import CallError, Finding, InputFileError, PlanmarkError, lines_of, near_names

FILE_NAME = "decisions.csv"
COLUMNS = ("student_id", "position", "criterion", "verdict", "points", "comment", "by", "at", "basis")
_REQUIRED = ("student_id", "criterion", "verdict")
VERDICTS = ("full", "partial", "none", "follow_through", "not_judged")
Kind = Literal["verdict", "audit", "node", "page", "total", "comment"]
Key = tuple[str, int | None, str]
"""What a row is about: student, position, criterion; of a page the page alone."""

_MAX_BYTES = 50_000_000
"""`_MAX_LINES` lines with a comment of 250 characters each."""
_MAX_LINES = 200_000
"""A thousand students with two hundred decisions each."""
_LONGEST = 4_000
"""Characters of a cell: two pages of a comment."""
_REMEMBERED = 20_000
"""Lines understood before: a file is read again at every decision, and differs in one."""
_LOCK_S = 20.0
"""A write takes some milliseconds; one that waits longer than this waits for a process that hangs."""
_NO_TEXT = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")
_POINTS = re.compile(r"[+-]?(?:[0-9]+(?:[.][0-9]*)?|[.][0-9]+)")


class ClashError(PlanmarkError):
    """Somebody else has decided the same in the meantime; `rows` are the rows that stand there now."""

    def __init__(self, message: str, rows: "tuple[Decision, ...]" = ()) -> None:
        super().__init__("decision_clash", message)
        self.rows = rows


@dataclass(frozen=True, slots=True)
class Decision:
    """One row.

    Attributes
    ----------
    student_id : empty only for a page, whose owner stands in its verdict
    position : of a student with several; of a page, its owner's
    criterion : what was decided, see the table above
    verdict : what it was decided to be; a place ``x,y`` of a node; owner, turn and corners of a page
    points : for `total` those added or taken away; None where the rubric's share counts
    by, at : who, and when (ISO 8601 with zone); free text in rows that people write
    basis : digest of what it was about; empty, and it applies as long as it stands
    line : of the file, from 2; 0 where it was not read from one. It does not count where rows are compared.
    """

    student_id: str
    position: int | None
    criterion: str
    verdict: str
    points: float | None = None
    comment: str = ""
    by: str = ""
    at: str = ""
    basis: str = ""
    line: int = field(default=0, compare=False, repr=False)

    @property
    def kind(self) -> Kind:
        """What sort of thing it is about."""
        start = self.criterion.partition(":")[0]
        match start:
            case "audit" | "node" | "page" if ":" in self.criterion:
                return start
            case "total" | "comment":
                return start
        return "verdict"

    @property
    def key(self) -> Key:
        """What it is about; two rows with the same key decide the same."""
        if self.kind != "page":
            return self.student_id, self.position, self.criterion
        ref = parse_scan(self.criterion.removeprefix("page:"))
        return "", None, self.criterion if isinstance(ref, str) else f"page:{ref.file}#{ref.page or 1}"

    @property
    def scan(self) -> ScanRef:
        """The page that it is about. Raises ValueError where it is about none."""
        ref = parse_scan(self.criterion.removeprefix("page:"))
        if self.kind != "page" or isinstance(ref, str):
            raise ValueError(f"{self.criterion} is no page")
        return ref

    @property
    def node(self) -> tuple[str, str]:
        """The figure and the node that it is about. Raises ValueError where it is about none."""
        parts = self.criterion.split(":")
        if self.kind != "node" or len(parts) != 3 or not all(parts):
            raise ValueError(f"{self.criterion} is no node")
        return parts[1], parts[2]

    @property
    def place(self) -> tuple[float, float]:
        """Where the node was put, x and y in mm of the sheet, y down. Raises ValueError."""
        return place(self.verdict)

    @property
    def audited(self) -> tuple[str, AuditAnswer]:
        """The criterion whose settled verdict was audited, and the answer. Raises ValueError."""
        return self.criterion.partition(":")[2], audit_answer(self.verdict)

    @property
    def page(self) -> PageDecision:
        """What was decided on the page. Raises ValueError."""
        return page_decision(self.verdict)


# Reading ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the file.

    Attributes
    ----------
    row : what was understood of it
    key : what it is about; None where that was not understood
    cells : of a line that cannot be used: its cells as they stand, in the order of `COLUMNS`
    """

    row: Decision
    key: Key | None
    cells: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class DecisionTable:
    """The content of a file.

    Attributes
    ----------
    lines : in the file's order
    faults : of lines that cannot be used, each with its number
    delimiter, has_mark : how the file is written: ``,`` or ``;``, and whether a byte order mark comes first
    """

    lines: tuple[Line, ...] = ()
    faults: tuple[Finding, ...] = ()
    delimiter: str = ","
    # Without the mark spreadsheets take letters with accents for others.
    has_mark: bool = True

    @property
    def rows(self) -> list[Decision]:
        """The decisions that can be used, in the file's order."""
        return [line.row for line in self.lines if not line.cells]


def read_table(path: Path) -> DecisionTable:
    """A file's content, empty where there is no file. Raises InputFileError for a fault of the whole file."""
    try:
        with path.open("rb") as stream:
            content = stream.read(_MAX_BYTES + 1)
    except FileNotFoundError:
        return DecisionTable()
    except OSError as error:
        finding = Finding("$", f"cannot be read: {error.strerror or error}")
        raise _refused(path.name, [finding]) from error
    if len(content) > _MAX_BYTES:
        raise _refused(path.name, [Finding("$", f"is larger than {_MAX_BYTES // 1_000_000} MB")])
    try:
        is_wide = content[:2] in {b"\xff\xfe", b"\xfe\xff"}
        text = "\ufeff" + content.decode("utf-16") if is_wide else content.decode("utf-8")
    except UnicodeDecodeError as error:
        finding = Finding("$", "is not UTF-8 text; save it as CSV in UTF-8")
        raise _refused(path.name, [finding]) from error
    return parse_table(text, path.name)


def parse_table(text: str, file: str = FILE_NAME) -> DecisionTable:
    """The content of a file's text; raises as `read_table` does."""
    has_mark, text = text.startswith("\ufeff"), text.removeprefix("\ufeff")
    if not text.strip():
        return DecisionTable()
    delimiter = delimiter_of(text)
    lines, findings = table_lines(text, delimiter, _MAX_LINES)
    header = [name.strip().lower() for name in lines[0][1]] if lines else []
    findings = findings or list(_check_header(header))
    if findings:
        raise _refused(file, findings)
    named = tuple(header)
    table: list[Line] = []
    faults: list[Finding] = []
    for number, cells in lines[1:]:
        line, found = _line(number, named, tuple(cells), delimiter)
        table.append(line)
        faults += [Finding(f"line {number}{where}", why, line=number) for where, why in found]
    table, again = _without_repeated(table, delimiter)
    ordered = sorted([*faults, *again], key=lambda fault: fault.line)
    return DecisionTable(tuple(table), tuple(ordered), delimiter, has_mark)


def _refused(file: str, findings: Sequence[Finding]) -> InputFileError:
    return InputFileError("decisions", f"{file}: {len(findings)} fault(s)\n{lines_of(findings)}")


def _check_header(header: Sequence[str]) -> Iterator[Finding]:
    for name in _REQUIRED:
        if name not in header:
            yield Finding("line 1", f"column {name} is missing; the columns are {','.join(COLUMNS)}")
    for name in dict.fromkeys(filter(None, header)):
        if header.count(name) > 1:
            yield Finding("line 1", f"column {short(name)} is there {header.count(name)} times; leave one")
        elif name not in COLUMNS:
            near = near_names(name, COLUMNS, most=1)
            advice = f"did you mean {near[0]}?" if near else "remove it, or move what it says to comment"
            yield Finding("line 1", f"column '{short(name)}' is not known; {advice}")


@lru_cache(_REMEMBERED)
def _line(
    number: int, header: tuple[str, ...], cells: tuple[str, ...], delimiter: str
) -> tuple[Line, list[tuple[str, str]]]:
    """A line, and what is wrong with it: where in the line, and why."""
    given = dict(zip(header, cells, strict=False))
    text = {name: given.get(name, "").strip() for name in COLUMNS}
    position, points = whole_number(text["position"], delimiter), _points(text["points"], delimiter)
    row = Decision(
        student_id=text["student_id"],
        position=position,
        criterion=text["criterion"],
        verdict=text["verdict"],
        points=points,
        comment=unguarded(text["comment"]),
        by=unguarded(text["by"]),
        at=text["at"],
        basis=text["basis"],
        line=number,
    )
    if row.kind == "verdict":
        row = replace(row, verdict=re.sub(r"[\s-]+", "_", row.verdict.lower()))
    faults = dict(faults_of(row))
    if text["points"] and points is None:
        mark = "comma" if delimiter == ";" else "point"
        faults["points"] = f"'{short(text['points'])}' is no number; write it with a decimal {mark}"
    key: Key | None = row.key
    if text["position"] and position is None:
        key = None
        faults["position"] = f"'{short(text['position'])}' is no whole number"
    told = [(f", {column}", why) for column, why in faults.items()]
    strangers = [cell for name, cell in zip(header, cells, strict=False) if not name and cell.strip()]
    surplus = surplus_of(header, cells, delimiter)
    if strangers and surplus is None:
        surplus = f"'{short(strangers[0].strip())}' stands in a column without a name; move it to comment"
    if surplus is not None:
        key, told = None, [("", surplus)]
    as_it_stands = (*(given.get(name, "") for name in COLUMNS), *strangers, *cells[len(header) :])
    return Line(row, key, as_it_stands if told else ()), told


def _without_repeated(lines: Sequence[Line], delimiter: str) -> tuple[list[Line], list[Finding]]:
    """The lines, those that decide the same as others not to be used, and what is wrong with these."""
    numbers: dict[Key, list[int]] = defaultdict(list)
    for line in lines:
        if line.key is not None and not line.cells:
            numbers[line.key].append(line.row.line)
    faults: list[Finding] = []
    kept: list[Line] = []
    for line in lines:
        same = [] if line.key is None or line.cells else numbers[line.key]
        others = [str(number) for number in same if number != line.row.line]
        if others:
            why = (
                f"{line.row.criterion} is decided on line {', '.join(others[:3])} too; leave one line of them"
            )
            number = line.row.line
            faults.append(Finding(f"line {number}, criterion", why, line=number))
            line = replace(line, cells=_cells(line.row, delimiter))  # noqa: PLW2901 - as it is kept
        kept.append(line)
    return kept, faults


def _points(text: str, delimiter: str) -> float | None:
    plain = text.replace("\N{MINUS SIGN}", "-")
    plain = plain.replace(",", ".", 1) if delimiter == ";" else plain
    return float(plain) if len(plain) < 20 and _POINTS.fullmatch(plain) else None


def faults_of(row: Decision) -> Iterator[tuple[str, str]]:
    """The columns of a decision whose text cannot be used whatever the class, and why."""
    why = why_no_id(row.student_id)
    if not row.student_id and row.kind != "page":
        yield "student_id", "is empty: say whose submission was decided"
    elif row.student_id and why is not None:
        yield "student_id", f"'{short(row.student_id)}' is refused: {ID_RULES[why.code]}"
    for column in COLUMNS:
        text = str(getattr(row, column) or "")
        if len(text) > _LONGEST:
            yield column, f"has more than {_LONGEST} characters"
        elif _NO_TEXT.search(text):
            yield column, "has signs that are no text"
    yield from _faults_of_kind(row)
    if row.points is not None and not abs(row.points) <= LARGEST:
        yield "points", "is no number of points"
    elif row.points is not None and row.kind in {"audit", "node", "page", "comment"}:
        yield "points", f"must be empty for {row.criterion.partition(':')[0]}"
    elif row.points is not None and row.kind == "verdict" and row.points < 0.0:
        yield "points", "are below 0; points are taken away in a row `total`"


def _faults_of_kind(row: Decision) -> Iterator[tuple[str, str]]:
    match row.kind:
        case "verdict":
            if not row.criterion:
                yield "criterion", "is empty: write a criterion's id, total, comment, node:... or page:..."
            if row.verdict not in VERDICTS:
                yield "verdict", f"'{short(row.verdict)}' is none of {', '.join(VERDICTS)}"
        case "audit":
            yield from _fault("verdict", lambda: row.audited)
        case "node":
            yield from _fault("criterion", lambda: row.node, "; node:FIGURE:NODE is right")
            yield from _fault("verdict", lambda: row.place)
        case "page":
            yield from _fault("criterion", lambda: row.scan, "; page:FILE#NUMBER is right, from 1")
            yield from _fault("verdict", lambda: row.page)
        case "total":
            if row.points is None:
                yield "points", "is empty: write the points to add, or to take away with a minus"
            if row.verdict:
                yield "verdict", "must be empty for total"
        case "comment":
            if not row.comment:
                yield "comment", "is empty: write it there, or remove the line"
            if row.verdict:
                yield "verdict", "must be empty for comment"


def _fault(column: str, read: Callable[[], object], advice: str = "") -> Iterator[tuple[str, str]]:
    try:
        read()
    except ValueError as error:
        yield column, f"{error}{advice}"


# Writing ------------------------------------------------------------------------------------------


class DecisionFile:
    """One file of decisions, safe for several threads and processes, and for people who edit it in between.

    Every change reads the file, changes it and writes it whole, under a lock on a file beside it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def all(self) -> list[Decision]:
        """The decisions as they stand in the file now; `table` also tells of lines that cannot be used.

        Raises InputFileError for a fault of the whole file.
        """
        return self.table().rows

    def table(self) -> DecisionTable:
        """The file's content now. Raises InputFileError for a fault of the whole file."""
        return read_table(self.path)

    def add(self, *decisions: Decision, expected: Iterable[Decision] | None = None) -> list[Decision]:
        """Write decisions, each in the place of what was decided on the same before; returns those rows.

        Arguments: `expected` are rows that the caller has read, all of them if you like. What they say
        about the same must still stand in the file, and where they say nothing, nothing may.

        Raises ClashError, with nothing written, where that is not so; CallError for a decision that could not
        be read again; InputFileError for a fault of the whole file; OutputError where it cannot be written.
        """
        rows = [_clean(row) for row in decisions]
        for row in rows:
            faults = [Finding(column, why) for column, why in faults_of(row)]
            if faults:
                raise CallError(
                    "decision_refused", f"{row.criterion}: cannot be decided so\n{lines_of(faults)}"
                )
        keys = [row.key for row in rows]
        if len(set(keys)) < len(keys):
            raise CallError("decision_refused", "the same is decided twice in one call")
        with self._open() as table:
            there = {row.key: row for row in table.rows}
            if expected is not None:
                read = {row.key: row for row in expected}
                seen = [_clean(read[key]) if key in read else None for key in keys]
                _check_unchanged([(row, there.get(key)) for row, key in zip(seen, keys, strict=True)])
            self._write(table, keys, rows)
            return [there[key] for key in keys if key in there]

    def remove(self, *decisions: Decision, restored: Iterable[Decision] = ()) -> None:
        """Take rows out again, and put those back that they stood in the place of: what `add` returned.

        Raises as `add`: ClashError where a row is not as given any more.
        """
        rows, back = [_clean(row) for row in decisions], [_clean(row) for row in restored]
        with self._open() as table:
            there = {row.key: row for row in table.rows}
            _check_unchanged([(row, there.get(row.key)) for row in rows])
            self._write(table, [row.key for row in (*rows, *back)], back)

    @contextmanager
    def _open(self) -> Iterator[DecisionTable]:
        """The file's content, which nobody else changes meanwhile."""
        from filelock import FileLock, Timeout  # noqa: PLC0415 - slow to import, and seldom needed

        make_folder(self.path.parent)
        lock = FileLock(self.path.with_name(f".{self.path.name}.lock"), timeout=_LOCK_S)
        try:
            lock.acquire()
        except Timeout as error:
            why = f"another program holds it for more than {_LOCK_S:g} s; end that program"
            raise OutputError("cannot_write", f"{self.path}: cannot be written: {why}") from error
        except (OSError, NotImplementedError) as error:
            why = f"{getattr(error, 'strerror', None) or error}"
            raise OutputError(
                "cannot_write", f"{self.path}: cannot be written: its folder takes no lock file ({why})"
            ) from error
        try:
            yield self.table()
        finally:
            lock.release()

    def _write(self, table: DecisionTable, out: Iterable[Key], rows: Sequence[Decision]) -> None:
        """Write the table without what was decided on some things, and with new rows."""
        gone, waiting = set(out), {row.key: row for row in rows}
        cells: list[tuple[str, ...]] = []
        for line in table.lines:
            if line.key not in gone:
                cells.append(line.cells or _cells(line.row, table.delimiter))
            elif line.key in waiting:
                cells.append(_cells(waiting.pop(line.key), table.delimiter))
        cells += [_cells(row, table.delimiter) for row in waiting.values()]
        buffer = io.StringIO()
        csv.writer(buffer, delimiter=table.delimiter, lineterminator="\r\n").writerows([COLUMNS, *cells])
        write_whole(self.path, ("\ufeff" if table.has_mark else "") + buffer.getvalue())
        sync_folder(self.path.parent)


def _check_unchanged(pairs: Sequence[tuple[Decision | None, Decision | None]]) -> None:
    """Raise ClashError where what was read and what stands there are not the same."""
    now = [there for read, there in pairs if read != there]
    if now:
        rows = tuple(row for row in now if row is not None)
        what = "; ".join(f"{row.criterion}: {row.verdict} by {row.by or 'somebody'}" for row in rows[:3])
        raise ClashError(
            f"decided by somebody else in the meantime ({what or 'taken back'}); look again", rows
        )


def _clean(row: Decision) -> Decision:
    """A decision as it reads back: without blanks around texts, points to six decimals, no line."""
    points = None if row.points is None or not math.isfinite(row.points) else round(row.points, 6) + 0.0
    texts = {name: getattr(row, name).strip() for name in COLUMNS if name not in {"position", "points"}}
    return replace(row, **texts, points=row.points if points is None else points, line=0)


@lru_cache(_REMEMBERED)
def _cells(row: Decision, delimiter: str) -> tuple[str, ...]:
    """A row's cells in the order of `COLUMNS`."""
    points = "" if row.points is None else f"{row.points:.6f}".rstrip("0").rstrip(".")
    texts = {
        "position": "" if row.position is None else str(row.position),
        "points": points.replace(".", ",") if delimiter == ";" else points,
        "comment": guarded(row.comment),
        "by": guarded(row.by),
    }
    return tuple(texts[name] if name in texts else str(getattr(row, name)) for name in COLUMNS)
