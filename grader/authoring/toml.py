"""Authored models as TOML text with a comment for every key.

A key's comment stands at its first place in the file; keys that are not set are shown commented
out, so that all there is can be seen.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from grader.authoring.explained import KEYS, TABLES, Key
from reference.formula import Formula

WIDTH = 100
NUMBER = re.compile(r"-?\d+(\.\d+)?")
BARE = re.compile(r"[A-Za-z0-9_-]+")


def commented(model: BaseModel, head: str) -> str:
    """The text of a file: its head, then every table and key with what it means."""
    lines = [*_remark(head), *_Writer().table(model, "")]
    return "\n".join(lines).rstrip() + "\n"


def _remark(text: str) -> Iterator[str]:
    """A comment, wrapped; a line of its own where the text has one."""
    for paragraph in text.splitlines():
        line = "#"
        for word in paragraph.split(" "):
            if len(line) + 1 + len(word) > WIDTH:
                yield line
                line = "#"
            line += f" {word}"
        yield line.rstrip()


class _Writer:
    """Writes tables, and remembers what it has explained."""

    def __init__(self) -> None:
        self.said: set[tuple[str, str]] = set()

    def table(self, model: BaseModel, path: str, *, flat: bool = False) -> Iterator[str]:
        """The keys of a table, then the tables within it (`flat`: on the keys' lines)."""
        kind = type(model).__name__
        tables: list[tuple[str, object]] = []
        for field, info in type(model).model_fields.items():
            value, name = getattr(model, field), info.alias or field
            is_set = value is not None and (field in model.model_fields_set or info.is_required())
            if is_set and _is_table(value) and not flat:
                tables.append((name, value))
            elif is_set and value not in ([], {}):
                yield from self._line(kind, field, f"{_bare(name)} = {_spread(value)}")
            else:
                yield from self._offer(kind, field, name)
        for name, value in tables:
            yield from self._within(kind, name, value, f"{path}.{_bare(name)}" if path else _bare(name))

    def _within(self, kind: str, name: str, value: object, path: str) -> Iterator[str]:
        """A table, a dictionary or a list of tables under its heading."""
        if isinstance(value, list):
            for model in value:
                yield ""
                yield from self._heading(type(model).__name__)
                yield f"[[{path}]]"
                yield from self.table(model, path, flat=True)
        elif isinstance(value, BaseModel):
            yield ""
            yield from self._heading(type(value).__name__, KEYS.get(kind, {}).get(name))
            if not _is_empty(value):
                yield f"[{path}]"
            yield from self.table(value, path)
        elif isinstance(value, Mapping):
            yield ""
            key = KEYS.get(kind, {}).get(name)
            yield from _remark(key.text) if key else ()
            yield f"[{path}]"
            yield from (f"{_bare(one)} = {inline(held)}" for one, held in value.items())

    def _heading(self, kind: str, key: Key | None = None) -> Iterator[str]:
        if kind == "Text":
            yield from _remark(key.text) if key else ()
        elif (kind, "") not in self.said:
            self.said.add((kind, ""))
            yield from _remark(TABLES.get(kind, ""))

    def _line(self, kind: str, field: str, line: str) -> Iterator[str]:
        """A key with its comment, behind it where there is room."""
        key = KEYS.get(kind, {}).get(field)
        if key is None or kind == "Text" or (kind, field) in self.said:
            yield line
            return
        self.said.add((kind, field))
        if len(line) + 4 + len(key.text) <= WIDTH:
            yield f"{line}  # {key.text}"
        else:
            yield from _remark(key.text)
            yield line

    def _offer(self, kind: str, field: str, name: str) -> Iterator[str]:
        """A key that is not set, commented out, once."""
        key = KEYS.get(kind, {}).get(field)
        if key is not None and key.example and (kind, field) not in self.said:
            self.said.add((kind, field))
            yield f"# {name} = {key.example}  # {key.text}"


def _is_empty(model: BaseModel) -> bool:
    """Whether a table has only tables within it."""
    return all(_is_table(getattr(model, field)) for field in model.model_fields_set)


def _is_table(value: object) -> bool:
    """What stands under a heading of its own: larger tables, and lists of tables."""
    if isinstance(value, list):
        return bool(value) and isinstance(value[0], BaseModel) and type(value[0]).__name__ in TABLES
    if isinstance(value, Mapping):
        return bool(value)
    return isinstance(value, BaseModel) and type(value).__name__ in TABLES


def inline(value: Any) -> str:  # noqa: ANN401 - whatever stands in an authored file
    """A value on one line."""
    match value:
        case bool():
            return "true" if value else "false"
        case int() | float():
            return repr(value)
        case str():
            return quoted(value)
        case Formula(text=text):
            return text if NUMBER.fullmatch(text) else quoted(text)
        case list() | tuple():
            return f"[{', '.join(inline(one) for one in value)}]"
        case BaseModel():
            fields = type(value).model_fields
            told = {
                info.alias or field: getattr(value, field)
                for field, info in fields.items()
                if getattr(value, field) is not None
                and (field in value.model_fields_set or info.is_required())
            }
            return inline(told)
        case Mapping():
            return f"{{ {', '.join(f'{_bare(name)} = {inline(one)}' for name, one in value.items())} }}"
    raise ValueError(f"expected what an authored file may hold, got {type(value).__name__}")


def _spread(value: object) -> str:
    """A value; a long list with a line for each of its members."""
    text = inline(value)
    if not isinstance(value, list) or len(text) <= WIDTH:
        return text
    return "\n".join(["[", *(f"  {inline(one)}," for one in value), "]"])


def quoted(text: str) -> str:
    """A TOML basic string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    escaped = "".join(
        letter if letter >= " " and letter != "\x7f" else f"\\u{ord(letter):04x}" for letter in escaped
    )
    return f'"{escaped}"'


def _bare(name: str) -> str:
    return name if BARE.fullmatch(name) else quoted(name)
