"""People's decisions: a CSV file beside the submissions, which the program keeps and people may edit.

Columns ``student_id,position,criterion,verdict,points,comment,by,at,basis``. Comma or semicolon separated; in
a semicolon-separated file `points` has a decimal comma. `criterion` says what a row is about:

| criterion | verdict | points |
|---|---|---|
| an id of the rubric | `full`, `partial`, `none`, `follow_through`, `not_judged` | blank, or as given |
| `node:FIGURE:NODE` | the node's place, ``x,y`` in millimetres of the sheet | blank |
| `audit:ID` | ``right; said=full``: whether the settled verdict is right (or `wrong`, `unclear`) | blank |
| `second:ID` | ``none; said=full``: a second person's verdict, and the first one's | how many more it gives |
| `ink:K:FILE#N` | a stroke on a page, the K-th: places ``x,y x,y ...`` in millimetres of the sheet | blank |
| `page:FILE#N` | ``owner=s03; turn=90; corners=x,y x,y x,y x,y``, at least one of them | blank |
| `total` | blank | added, or taken away with a minus |
| `comment` | blank | blank |

A fault of the whole file raises TableError. A line that cannot be used costs that line alone: it is told,
and kept as it stands when the file is written.
"""

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
from grader.records import Reason, Value
from grader.tables.decision_texts import (
    ANSWERS,
    LARGEST,
    AuditAnswer,
    PageDecision,
    audit_answer,
    page_decision,
    place,
)
from grader.tables.reader import (
    MARK,
    Row,
    TableError,
    TableKind,
    at,
    real_number,
    refused_id,
    short,
    whole_number,
    written,
)
from grader.tables.roster import ScanRef, parse_scan
from grader.tables.scale_text import TextError
from grader.texts.spoken import failure
from reference.errors import PlanmarkError

FILE_NAME = "decisions.csv"
COLUMNS = ("student_id", "position", "criterion", "verdict", "points", "comment", "by", "at", "basis")
VERDICTS = ("full", "partial", "none", "follow_through", "not_judged")
Kind = Literal["verdict", "audit", "second", "node", "ink", "page", "total", "comment"]
Key = tuple[str, int | None, str]
"""Subject of a row: student, position, criterion; of a page the page alone."""

_TABLE = TableKind(
    "decisions", COLUMNS, ("student_id", "criterion", "verdict"), 50_000_000, 200_000, is_strict=True
)
"""A thousand students with two hundred decisions each, and a comment of 250 characters at each."""
_LONGEST = 4_000
"""Characters of a cell: two pages of a comment."""
_REMEMBERED = 20_000
"""Lines understood before: a file is read again at every decision, and differs in one."""
_LOCK_S = 20.0
"""A write takes some milliseconds; one that waits longer than this waits for a process that hangs."""
_NO_TEXT = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")


class ClashError(PlanmarkError):
    """Somebody else has decided the same in the meantime; `rows` are the rows that stand there now."""

    def __init__(self, rows: "tuple[Decision, ...]") -> None:
        super().__init__("decision_clash", "decided by somebody else in the meantime; look again")
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
        """The kind of decision, by its criterion."""
        start = self.criterion.partition(":")[0]
        match start:
            case "audit" | "second" | "node" | "ink" | "page" if ":" in self.criterion:
                return start
            case "total" | "comment":
                return start
        return "verdict"

    @property
    def key(self) -> Key:
        """The subject; two rows with the same key decide the same."""
        if self.kind != "page":
            return self.student_id, self.position, self.criterion
        ref = parse_scan(self.criterion.removeprefix("page:"))
        return "", None, f"page:{ref.file}#{ref.page or 1}" if isinstance(ref, ScanRef) else self.criterion

    @property
    def scan(self) -> ScanRef:
        """The page that it is about. Raises TextError where it is about none."""
        name = self.criterion.split(":", 2 if self.kind == "ink" else 1)[-1]
        ref = parse_scan(name)
        if self.kind not in {"page", "ink"} or not isinstance(ref, ScanRef):
            raise TextError("no_scan", text=short(name))
        return ref

    @property
    def stroke(self) -> tuple[tuple[float, float], ...]:
        """The points of a stroke of ink, x and y in mm of the sheet, y down. Raises TextError."""
        return tuple(place(each) for each in self.verdict.split() or [""])

    @property
    def node(self) -> tuple[str, str]:
        """The figure and the node that it is about. Raises TextError where it is about none."""
        parts = self.criterion.split(":")
        if self.kind != "node" or len(parts) != 3 or not all(parts):
            raise TextError("no_node", text=short(self.criterion))
        return parts[1], parts[2]

    @property
    def place(self) -> tuple[float, float]:
        """The place of the node, x and y in mm of the sheet, y down. Raises TextError."""
        return place(self.verdict)

    @property
    def audited(self) -> tuple[str, AuditAnswer]:
        """The criterion that was audited or marked a second time, and the answer. Raises TextError."""
        known = VERDICTS if self.kind == "second" else ANSWERS
        return self.criterion.partition(":")[2], audit_answer(self.verdict, known)

    @property
    def page(self) -> PageDecision:
        """The decision on the page. Raises TextError."""
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
    faults : of lines that cannot be used
    delimiter, has_mark : how the file is written: ``,`` or ``;``, and whether a byte order mark comes first
    """

    lines: tuple[Line, ...] = ()
    faults: tuple[Reason, ...] = ()
    delimiter: str = ","
    has_mark: bool = True

    @property
    def rows(self) -> list[Decision]:
        """The decisions that can be used, in the file's order."""
        return [line.row for line in self.lines if not line.cells]


def read_table(path: Path) -> DecisionTable:
    """A file's content, empty where there is no file. Raises TableError for a fault of the whole file."""
    return parse_table(_TABLE.text(path, path.name), path.name) if path.exists() else DecisionTable()


def parse_table(text: str, file: str = FILE_NAME) -> DecisionTable:
    """The content of a file's text; raises as `read_table` does."""
    if not text.removeprefix(MARK).strip():
        return DecisionTable()
    table = _TABLE.table(text, file)
    read = [_line(row.line, row.header, row.cells, row.delimiter) for row in table.rows]
    lines, again = _without_repeated([line for line, _ in read], table.delimiter)
    faults = [*(one for _, found in read for one in found), *again]
    in_order = sorted(faults, key=lambda one: int(str(one.parameters["line"])))
    return DecisionTable(tuple(lines), tuple(in_order), table.delimiter, table.has_mark)


@lru_cache(_REMEMBERED)
def _line(
    number: int, header: tuple[str, ...], cells: tuple[str, ...], delimiter: str
) -> tuple[Line, list[Reason]]:
    """A line, and what is wrong with it."""
    given = Row(number, cells, header, delimiter)
    position, points = (read(given[name], delimiter) for read, name in _NUMBERS)
    row = Decision(
        student_id=given["student_id"],
        position=position if isinstance(position, int) else None,
        criterion=given["criterion"],
        verdict=given["verdict"],
        points=_rounded(points) if isinstance(points, float) else None,
        comment=unguarded(given["comment"]),
        by=unguarded(given["by"]),
        at=given["at"],
        basis=given["basis"],
        line=number,
    )
    if row.kind == "verdict":
        row = replace(row, verdict=re.sub(r"[\s-]+", "_", row.verdict.lower()))
    faults = dict(faults_of(row))
    for (_, name), found in zip(_NUMBERS, (position, points), strict=True):
        if given[name] and isinstance(found, Reason):
            faults[name] = found
    key = None if given["position"] and "position" in faults else row.key
    strangers = [cell for name, cell in zip(header, cells, strict=False) if not name and cell.strip()]
    if given.is_too_wide():
        key = None
    elif strangers:
        key, text = None, short(strangers[0].strip())
        given.fault("", Reason("field_without_column", {"text": text}))
    else:
        given.faults = [at(why, number, column) for column, why in faults.items()]
    raw = dict(zip(header, cells, strict=False))
    as_it_stands = (*(raw.get(name, "") for name in COLUMNS), *strangers, *cells[len(header) :])
    return Line(row, key, as_it_stands if given.faults else ()), given.faults


_NUMBERS = ((whole_number, "position"), (real_number, "points"))


def _without_repeated(lines: Sequence[Line], delimiter: str) -> tuple[list[Line], list[Reason]]:
    """The lines, those that decide the same as others not to be used, and what is wrong with these."""
    numbers: dict[Key, list[int]] = defaultdict(list)
    for line in lines:
        if line.key is not None and not line.cells:
            numbers[line.key].append(line.row.line)
    faults: list[Reason] = []
    kept: list[Line] = []
    for line in lines:
        same = [] if line.key is None or line.cells else numbers[line.key]
        others = tuple(str(number) for number in same if number != line.row.line)
        if others:
            known: dict[str, Value] = {"criterion": line.row.criterion, "lines": others[:3]}
            faults.append(at(Reason("decided_twice", known), line.row.line, "criterion"))
            line = replace(line, cells=_cells(line.row, delimiter))  # noqa: PLW2901 - as it is kept
        kept.append(line)
    return kept, faults


def faults_of(row: Decision) -> Iterator[tuple[str, Reason]]:
    """The columns of a decision whose text cannot be used whatever the class, and why."""
    if not row.student_id and row.kind != "page":
        yield "student_id", Reason("student_empty")
    elif row.student_id and (why := refused_id(row.student_id)) is not None:
        yield "student_id", why
    for column in COLUMNS:
        text = str(getattr(row, column) or "")
        if len(text) > _LONGEST:
            yield column, Reason("too_long", {"most": _LONGEST})
        elif _NO_TEXT.search(text):
            yield column, Reason("signs_no_text")
    yield from _faults_of_kind(row)
    if row.points is not None and not abs(row.points) <= LARGEST:
        yield "points", Reason("no_points")
    elif row.points is not None and row.kind in {"audit", "node", "ink", "page", "comment"}:
        yield "points", Reason("not_blank", {"kind": row.kind})
    elif row.points is not None and row.kind == "verdict" and row.points < 0.0:
        yield "points", Reason("points_negative")


def _faults_of_kind(row: Decision) -> Iterator[tuple[str, Reason]]:
    match row.kind:
        case "verdict":
            if not row.criterion:
                yield "criterion", Reason("criterion_empty")
            if row.verdict not in VERDICTS:
                yield "verdict", Reason("verdict_unknown", {"text": short(row.verdict), "names": VERDICTS})
        case "audit" | "second":
            yield from _fault("verdict", lambda: row.audited)
        case "node":
            yield from _fault("criterion", lambda: row.node)
            yield from _fault("verdict", lambda: row.place)
        case "ink":
            yield from _fault("criterion", lambda: row.scan)
            yield from _fault("verdict", lambda: row.stroke)
        case "page":
            yield from _fault("criterion", lambda: row.scan)
            yield from _fault("verdict", lambda: row.page)
        case kind:
            if kind == "total" and row.points is None:
                yield "points", Reason("points_empty")
            if kind == "comment" and not row.comment:
                yield "comment", Reason("comment_empty")
            if row.verdict:
                yield "verdict", Reason("not_blank", {"kind": kind})


def _fault(column: str, read: Callable[[], object]) -> Iterator[tuple[str, Reason]]:
    try:
        read()
    except TextError as error:
        yield column, error.reason


# Writing ------------------------------------------------------------------------------------------


@contextmanager
def held(path: Path) -> Iterator[None]:
    """Hold a file that nobody else changes meanwhile; OutputError where another program holds it."""
    from filelock import FileLock, Timeout  # noqa: PLC0415 - slow to import, and seldom needed

    make_folder(path.parent)
    lock = FileLock(path.with_name(f".{path.name}.lock"), timeout=_LOCK_S)
    try:
        lock.acquire()
    except Timeout as error:
        raise failure(OutputError, "cannot_write", "held", file=path, limit=_LOCK_S) from error
    except (OSError, NotImplementedError) as error:
        known = {"file": path, "error": getattr(error, "strerror", None) or error}
        raise failure(OutputError, "cannot_write", "no_lock", **known) from error
    try:
        yield
    finally:
        lock.release()


class DecisionFile:
    """One file of decisions, safe for several threads and processes, and for people who edit it in between.

    Every change reads the file, changes it and writes it whole, under a lock on a file beside it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def all(self) -> list[Decision]:
        """The decisions as they stand in the file now. Raises TableError for a fault of the whole file."""
        return read_table(self.path).rows

    def add(self, *decisions: Decision, expected: Iterable[Decision] | None = None) -> list[Decision]:
        """Write decisions, each in the place of what was decided on the same before; returns those rows.

        Arguments: `expected` are rows that the caller has read, all of them if you like. What they say
        about the same must still stand in the file, and where they say nothing, nothing may.

        Raises ClashError, with nothing written, where that is not so; TableError for a decision that could
        not be read again, and for a fault of the whole file; OutputError where it cannot be written.
        """
        rows = [_clean(row) for row in decisions]
        keys = [row.key for row in rows]
        for row in rows:
            faults = [at(why, None, column) for column, why in faults_of(row)]
            if keys.count(row.key) > 1:
                faults.append(
                    Reason("decided_twice", {"criterion": row.criterion, "student": row.student_id})
                )
            if faults:
                raise TableError("decision_refused", row.criterion, faults)
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
        with held(self.path):
            yield read_table(self.path)

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
        text = written([COLUMNS, *cells], table.delimiter)
        write_whole(self.path, (MARK if table.has_mark else "") + text)
        sync_folder(self.path.parent)


def _check_unchanged(pairs: Sequence[tuple[Decision | None, Decision | None]]) -> None:
    """Raise ClashError where what was read and what stands there are not the same."""
    now = [there for read, there in pairs if read != there]
    if now:
        raise ClashError(tuple(row for row in now if row is not None))


def _clean(row: Decision) -> Decision:
    """A decision as it reads back: without blanks around texts, points to six decimals, no line."""
    texts = {name: getattr(row, name).strip() for name in COLUMNS if name not in {"position", "points"}}
    return replace(row, **texts, points=None if row.points is None else _rounded(row.points), line=0)


def _rounded(points: float) -> float:
    """Points as the file holds them: to six decimals, and never a zero with a minus."""
    return round(points, 6) + 0.0 if math.isfinite(points) else points


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
