"""Tables of variants: a row of data for each n or position, in the assignment's file or in a CSV beside it.

Every cell is checked; a fault names the row and the column. A column's unit stands in its heading,
``a [cm]``; without one the numbers are in the units of the mechanism's keys in which they are used.
"""

import csv
import io
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, model_validator

from reference.authored.formula import CONSTANTS, FUNCTIONS, Formula
from reference.authored.toml_file import (
    AHEAD_BEHIND,
    LEFT_RIGHT,
    LENGTH_UNITS_M,
    SIDES,
    Authored,
    SideText,
    text_of,
)
from reference.errors import AuthoredFileError, FaultError, Finding, Parameter, look_alikes
from reference.geometry import FloatArray

MEASURES = {
    **dict.fromkeys(("length", "lengths", "offset", "through", "at", "ground", "displacement"), "length"),
    **dict.fromkeys(("angle_deg", "slot_deg"), "angle"),
    **{key: key for key in ("rpm", "omega", "epsilon", "speed", "acceleration")},
    **{key: key for key in ("mass", "inertia", "force", "couple")},
}
"""The kind of quantity that a key of a mechanism, a body or a load holds, as `UNITS` names it."""
LENGTHS = {"length", "lengths"}
"""Keys of lengths that must be above zero; coordinates need not be."""
MOST_VARIANTS = 10_000
"""Largest number of variants: more than any class has students, and all are computed before use."""
LARGEST_KEY = 1e9
"""A roster's numbers have nine digits at most."""
SPREADSHEETS = {".xlsx", ".xls", ".ods", ".numbers"}
KEYS = ("n", "position")
"""Columns that identify the variant of a row."""

UNITS = {
    **{unit: ("length", unit) for unit in LENGTH_UNITS_M},
    **{f"{unit}/s": ("speed", unit) for unit in LENGTH_UNITS_M},
    **{f"{unit}/s^2": ("acceleration", unit) for unit in LENGTH_UNITS_M},
    **dict.fromkeys(("deg", "°", "rad"), ("angle", "")),
    **dict.fromkeys(("rpm", "rev/min"), ("rpm", "")),
    "rad/s": ("omega", ""),
    "rad/s^2": ("epsilon", ""),
    "kg": ("mass", ""),
    "kg m^2": ("inertia", ""),
    "N": ("force", ""),
    "N m": ("couple", ""),
}
"""The kind of quantity of a unit in a heading, and its unit of length."""
_LETTERS = str.maketrans({"м": "m", "с": "s", "²": "^2", "р": "r", "а": "a", "д": "d"})
"""Cyrillic letters of units that look like or stand for the Latin ones."""
_SPELT = {
    "об/мин": "rpm", "rot/min": "rpm", "min^-1": "rpm", "1/min": "rpm", "град": "deg", "1/s": "rad/s",
    **dict.fromkeys(("n", "н"), "N"), **dict.fromkeys(("nm", "n·m", "n*m", "нм", "н·м", "н*м"), "N m"),
    "кг": "kg", **dict.fromkeys(("kgm^2", "kg·m^2", "kg*m^2", "кгм^2", "кг·м^2", "кг*м^2"), "kg m^2"),
}  # fmt: skip
"""Other spellings."""

_HEADING = re.compile(r"\s*([^\s\[\](),]+)\s*(?:[\[(]\s*([^\[\]()]*?)\s*[\])]|,\s*(\S+))?\s*")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)


VariantKey = tuple[int | None, int | None]
"""n and position, None if there is none."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of numbers, one for each row.

    Attributes
    ----------
    unit : as the heading has it; empty if it has none
    numbers : in degrees or in the mechanism's unit of length, if the unit is one of these
    words : the sides written in it, in place of +1 and -1
    """

    name: str
    unit: str
    numbers: tuple[float, ...] = ()
    words: tuple[str, ...] = ()


def _read_cell(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise FaultError("no_number", text=str(value), sides=tuple(SIDES))
    return value


class DataTable(Authored):
    """Data of the variants, row by row: `columns` and `rows` here, or the `file` of a CSV beside this one.

    Also read: columns by their names (`a = [40, 45]`), and rows as tables of their own.
    """

    file: str | None = None
    columns: list[str] | None = None
    rows: list[list[Annotated[float | int | str, BeforeValidator(_read_cell)]]] | None = None

    @model_validator(mode="before")
    @classmethod
    def _by_rows(cls, data: Any) -> Any:  # noqa: ANN401 - not yet validated
        if isinstance(data, str):
            return {"file": data}
        if not isinstance(data, dict | list):
            raise FaultError("table_forms")
        if isinstance(data, list) and data and all(isinstance(row, dict) for row in data):
            columns = [*dict.fromkeys(name for row in data for name in row)]
            return {"columns": columns, "rows": [[row.get(name, "") for name in columns] for row in data]}
        if isinstance(data, dict) and data and cls.model_fields.keys().isdisjoint(data):
            if not all(isinstance(cells, list) for cells in data.values()):
                return data
            rows = zip_longest(*data.values(), fillvalue="")
            return {"columns": [*data], "rows": [[*cells] for cells in rows]}
        return data

    @model_validator(mode="after")
    def _has_rows_once(self) -> Self:
        inside = (self.columns is not None, self.rows is not None)
        if (self.file is None) != all(inside) or (self.file is not None and any(inside)):
            raise FaultError("table_forms")
        return self


def or_its_file(schema: dict[str, Any]) -> None:
    """Add to a table's schema that a CSV's name, a list of rows, or lists by column may replace it."""
    cell = {"type": ["number", "string"]}
    lists = {"type": "object", "additionalProperties": {"type": "array", "items": cell}, "minProperties": 1}
    rows = {"type": "array", "items": {"type": "object", "additionalProperties": cell}, "minItems": 1}
    schema["anyOf"] += [{"type": "string"}, lists, rows]


@dataclass(frozen=True, slots=True)
class VariantRows:
    """A table that was read: the variant of each row, and the columns.

    Attributes
    ----------
    source : its name in messages
    keys : n and position of each row, None if the table has no such column; ascending
    lines : the number of each row, in a CSV of its line
    columns : by name, in the order of the rows
    """

    source: str
    keys: tuple[VariantKey, ...]
    columns: dict[str, Column]
    lines: tuple[int, ...]

    @property
    def has(self) -> tuple[bool, bool]:
        """Two flags: the table has a column n, and a column position."""
        n, position = self.keys[0]
        return n is not None, position is not None

    def data(self, variants: Sequence[VariantKey]) -> dict[str, FloatArray]:
        """Return the columns' numbers for some variants, shape (N,) each."""
        row_of = {key: row for row, key in enumerate(self.keys)}
        n, position = self.has
        rows = [row_of[key[0] if n else None, key[1] if position else None] for key in variants]
        return {name: np.array(column.numbers)[rows] for name, column in self.columns.items()}


def delimiter_of(text: str) -> str:
    """Return the delimiter (`,`, `;` or a tab) that the first line of a CSV text has most of; else `;`.

    In a table of one column, commas are decimal commas or belong to a name.
    """
    first = next((line for line in text.splitlines() if line.strip()), "")
    return max(",;\t", key=first.count) if any(sign in first for sign in ",;\t") else ";"


def table_lines(text: str, delimiter: str, most: int) -> tuple[list[tuple[int, list[str]]], list[Finding]]:
    """Lines of a CSV text that are not blank, and the fault that ends them before the text does.

    A record of several lines has the number of its first, from 1. More than `most` lines are a fault.
    """
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    lines: list[tuple[int, list[str]]] = []
    number = 1
    try:
        for cells in reader:
            if number > most:
                return lines, [Finding("", "too_many_lines", {"most": most}, number)]
            if any(cell.strip() for cell in cells):
                lines.append((number, cells))
            number = reader.line_num + 1
    except csv.Error:
        return lines, [Finding("", "no_csv", line=number)]
    return lines, []


Cell = float | int | str


def read_rows(table: DataTable, beside: Path, length_unit_m: float) -> tuple[DataTable, VariantRows]:
    """Read an assignment's table; return it with its rows inside, and the data in them.

    Arguments: the assignment's file; the mechanism's unit of length. Raises AuthoredFileError with every
    fault, each with its row and column.
    """
    if table.file is None:
        lines: list[tuple[int, list[Cell]]] = [(0, [*(table.columns or ())])]
        lines += enumerate(table.rows or (), 1)
        reader = _Reader("$.variant.table", "", length_unit_m, [])
        source, name = str(beside), "[variant.table]"
    else:
        path = beside.parent / table.file
        if path.suffix.lower() in SPREADSHEETS:
            raise AuthoredFileError(str(path), (Finding("$", "is_spreadsheet"),))
        if not path.is_file():
            missing = Finding("$.variant.table", "no_file_beside", {"file": table.file})
            raise AuthoredFileError(str(beside), (missing,))
        text = text_of(path)
        delimiter = delimiter_of(text)
        split, findings = table_lines(text, delimiter, MOST_VARIANTS)
        lines = [(number, [cell.strip() for cell in cells]) for number, cells in split]
        reader = _Reader("", delimiter, length_unit_m, findings)
        source, name = str(path), path.name
    keys, columns, numbers = reader.read(lines)
    if reader.findings:
        raise AuthoredFileError(source, tuple(reader.findings))
    cells = [cells for _, cells in lines]
    whole = table.model_copy(update={"columns": [str(cell) for cell in cells[0]], "rows": cells[1:]})
    return whole, VariantRows(name, keys, columns, numbers)


@dataclass(slots=True)
class _Reader:
    """Reads the lines of a table and collects what is wrong with them.

    Attributes
    ----------
    table : the path of a table in the assignment's file; empty for a CSV
    delimiter : of a CSV; with semicolons or tabs, 4,5 is a number
    """

    table: str
    delimiter: str
    length_unit_m: float
    findings: list[Finding]

    def fault(self, fault: FaultError, number: int | None = None, column: str = "") -> None:
        """Note a fault of a row by its number, of the heading if there is none, or of a cell."""
        path = ".".join(filter(None, (self.table, column)))
        row = {"table_row": number} if self.table and number is not None else {}
        self.findings.append(fault.at(path, 0 if self.table else number or 1, **row))

    def read(
        self, lines: Sequence[tuple[int, Sequence[Cell]]]
    ) -> tuple[tuple[VariantKey, ...], dict[str, Column], tuple[int, ...]]:
        """Return the variant and number of each row, and the columns, in the order of the variants."""
        headings = self._headings(lines[0][1] if lines else ())
        rows = lines[1:]
        if self.findings:
            return (), {}, ()
        if not rows:
            self.fault(FaultError("no_rows"))
        for number, cells in rows:
            if any(cell != "" for cell in cells[len(headings) :]):
                self.fault(FaultError("cells_surplus", fields=len(cells), columns=len(headings)), number)
        if self.findings:
            return (), {}, ()
        columns = {
            heading.name: self._column(
                heading, [(number, cells[k] if k < len(cells) else "") for number, cells in rows]
            )
            for k, heading in enumerate(headings)
        }
        keys = self._keys(columns, [number for number, _ in rows])
        if self.findings:
            return (), {}, ()
        order = sorted(range(len(keys)), key=lambda row: [number or 0 for number in keys[row]])
        in_order = {
            name: replace(column, numbers=tuple(column.numbers[row] for row in order))
            for name, column in columns.items()
            if name not in KEYS
        }
        return tuple(keys[row] for row in order), in_order, tuple(rows[row][0] for row in order)

    def _headings(self, cells: Sequence[Cell]) -> list[Column]:
        """Return the columns as their headings name them, without numbers."""
        headings: list[Column] = []
        texts = [str(cell).strip() for cell in cells]
        while texts and not texts[-1]:
            texts.pop()
        for place, text in enumerate(texts, 1):
            where = f"[{place}]"
            parts = _HEADING.fullmatch(text)
            name = parts[1] if parts else text
            if parts is None or not _NAME.fullmatch(name):
                known: dict[str, Parameter] = {"text": text, **look_alikes(name)} if text else {}
                self.fault(FaultError("no_heading", **known), column=where)
            elif name in CONSTANTS or name in FUNCTIONS:
                self.fault(FaultError("name_of_formulas", name=name), column=where)
            elif name in {heading.name for heading in headings}:
                self.fault(FaultError("column_twice", name=name, count=2), column=where)
            else:
                headings.append(Column(name, self._unit(where, parts[2] or parts[3] or "")))
        if not self.findings and not {heading.name for heading in headings} & {*KEYS}:
            first: dict[str, Parameter] = {"near": headings[0].name} if headings else {}
            self.fault(FaultError("column_n_missing", **first))
        return headings

    def _unit(self, where: str, text: str) -> str:
        """Return a heading's unit in one spelling; empty if there is none."""
        unit = _unit_of(text)
        if unit and unit not in UNITS:
            self.fault(FaultError("unit_unknown", text=text, texts=tuple(UNITS)), column=where)
            return ""
        return unit

    def _column(self, heading: Column, cells: Sequence[tuple[int, Cell]]) -> Column:
        """Return a column with its numbers, in degrees and in the mechanism's unit of length."""
        sides = [word for _, cell in cells if (word := str(cell).lower()) in SIDES]
        words = max((LEFT_RIGHT, AHEAD_BEHIND), key=lambda pair: sum(map(sides.count, pair))) if sides else ()
        numbers: list[float] = []
        for number, cell in cells:
            try:
                value = (
                    _side_in(cell, words)
                    if words
                    else _number_in(cell, heading.name, decimal_comma=self.delimiter in {";", "\t"})
                )
            except FaultError as error:
                self.fault(error, number, heading.name)
                value = math.nan
            numbers.append(self._in_file_units(value, heading.unit))
        return replace(heading, numbers=tuple(numbers), words=words)

    def _in_file_units(self, number: float, unit: str) -> float:
        """Convert radians to degrees, and lengths to the mechanism's unit."""
        if unit == "rad":
            return math.degrees(number)
        length = UNITS.get(unit, ("", ""))[1]
        if not length:
            return number
        # Whole numbers of parts of a metre: 3 cm are then exactly 30 mm.
        return number * round(1.0 / self.length_unit_m) / round(1.0 / LENGTH_UNITS_M[length])

    def _keys(self, columns: Mapping[str, Column], lines: Sequence[int]) -> list[VariantKey]:
        """Return the variant of each row; two rows of one variant are a fault."""
        keys: list[VariantKey] = []
        first: dict[VariantKey, int] = {}
        named = [name for name in KEYS if name in columns]
        for row, line in enumerate(lines):
            numbers = {name: columns[name].numbers[row] for name in named}
            if any(map(math.isnan, numbers.values())):
                continue
            broken = [name for name in named if numbers[name] % 1.0 or abs(numbers[name]) > LARGEST_KEY]
            for name in broken:
                self.fault(FaultError("no_whole_number", text=f"{numbers[name]:g}"), line, name)
            if broken:
                continue
            n, position = (int(numbers[name]) if name in numbers else None for name in KEYS)
            if (n, position) in first:
                whose = ", ".join(f"{name} = {numbers[name]:g}" for name in named)
                self.fault(FaultError("row_twice", text=whose, first=first[n, position]), line)
            first.setdefault((n, position), line)
            keys.append((n, position))
        return keys


def _unit_of(text: str) -> str:
    """Return a unit in the spelling of `UNITS`, if it is one of them."""
    plain = text.lower().replace(" ", "").replace("²", "^2")
    return _SPELT.get(plain, plain.translate(_LETTERS))


def _side_in(cell: Cell, words: tuple[str, ...]) -> float:
    """Convert a word to +1 or -1."""
    if str(cell).lower() not in words:
        raise FaultError("no_side", text=str(cell), names=words) if cell != "" else FaultError("cell_empty")
    return float(SIDES[str(cell).lower()])


def number_of(text: str, *, decimal_comma: bool) -> float | None:
    """Return the number that a text is, also with a typeset minus; None for any other text."""
    plain = text.replace("\N{MINUS SIGN}", "-")
    plain = plain.replace(",", ".", 1) if decimal_comma else plain
    return float(plain) if _NUMBER.fullmatch(plain) else None


def _number_in(cell: Cell, name: str, *, decimal_comma: bool) -> float:
    if not isinstance(cell, str):
        return float(cell)
    if not cell:
        raise FaultError("cell_empty")
    number = number_of(cell, decimal_comma=decimal_comma)
    if number is not None:
        return number
    if "," in cell:
        raise FaultError("no_decimal_point", text=cell)
    parts = re.fullmatch(r"([-+\N{MINUS SIGN}0-9.,]+)\s*(\D.*)", cell)
    if parts is not None and (unit := _unit_of(parts[2])) in UNITS:
        raise FaultError("unit_in_cell", text=cell, name=name, unit=unit)
    raise FaultError("no_number", text=cell, **({"sides": tuple(SIDES)} if "side" in name.lower() else {}))


def formulas_in(thing: object, path: str, key: str = "") -> Iterator[tuple[str, str, Formula | SideText]]:
    """Yield every formula and side of an authored table, at any depth: its path, the format's key, itself."""
    inside: list[tuple[str, str, object]] = []
    if isinstance(thing, Formula | SideText):
        yield path, key, thing
    elif isinstance(thing, BaseModel):
        inside = [(f"{path}.{name}", name, getattr(thing, name)) for name in type(thing).model_fields]
    elif isinstance(thing, dict):
        inside = [(f"{path}.{name}", key or name, part) for name, part in thing.items()]
    elif isinstance(thing, list):
        inside = [(f"{path}[{index}]", key, part) for index, part in enumerate(thing)]
    for where, name, part in inside:
        yield from formulas_in(part, where, name)


def misused_columns(thing: object, rows: VariantRows, path: str) -> Iterator[Finding]:
    """Report columns used alone in a key of another kind, and lengths not above zero."""
    for where, key, leaf in formulas_in(thing, path):
        formula = leaf.side if isinstance(leaf, SideText) else leaf
        column = rows.columns.get(formula.text) if isinstance(formula, Formula) else None
        if column is None:
            continue
        misuse = _misuse(column, key, leaf.words if isinstance(leaf, SideText) else ())
        if misuse:
            yield misuse.at(where, name=column.name, file=rows.source)
        elif key in LENGTHS:
            for line, number in zip(rows.lines, column.numbers, strict=True):
                if number <= 0.0:
                    negative = FaultError("column_not_positive", text=f"{number:g}", table_row=line)
                    yield negative.at(where, name=column.name, file=rows.source)


def _misuse(column: Column, key: str, words: tuple[str, ...]) -> FaultError | None:
    """Return what is wrong with a column in a key; None if nothing is."""
    if words and (column.unit or not {*column.words} <= {*words}):
        return FaultError("column_holds", values=column.words or column.unit, names=words)
    if column.words and not words:
        return FaultError("column_holds", values=column.words)
    measures, needed = UNITS.get(column.unit, ("", ""))[0], MEASURES.get(key)
    if column.unit and measures != needed:
        units = tuple(unit for unit, (kind, _) in UNITS.items() if kind == needed)
        return FaultError("column_holds", values=column.unit, **({"names": units} if units else {}))
    return None
