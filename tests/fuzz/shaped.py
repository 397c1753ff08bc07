"""Mutations that keep a file well formed: its tree, or its table, is changed and written as before."""

import copy
import csv
import io
import json
import random
import string
import tomllib
from collections.abc import Iterator
from typing import Any

SHAPED = (
    "measurements", "roster", "decisions", "authored", "variants", "settings", "worksheet", "gradebook",
    "results",
)  # fmt: skip
"""The doors whose files have a form that can be kept."""
ODD: tuple[Any, ...] = (
    None, True, False, 0, -1, 1e308, -1e308, 5e-324, 10**400, float("nan"), float("inf"), float("-inf"), "",
    " ", "x" * 100_000, "Студент", "学生", "ș̦", "\u202etxt.exe", "a\nb", "=1+1", "1,5", "NaN", "1e400", "٣",
    "½", "0x10", "2026-01-01", "../../x", "s1;s2", "\x7f", "\ud800", [], {}, [[]], {"a": {"b": [None]}},
)  # fmt: skip
"""Values of other types, sizes and scripts."""
ENCODINGS = ("utf-8-sig", "utf-16", "utf-16-be", "cp1251", "latin-1", "utf-7")


class Pairs(list[tuple[str, Any]]):
    """An object whose keys may be there twice."""


def shaped(data: bytes, dice: random.Random) -> bytes:
    """A file changed in one to eight places, well formed; sometimes in another encoding."""
    text = data.decode("utf-16" if data[:2] in {b"\xff\xfe", b"\xfe\xff"} else "utf-8-sig", errors="replace")
    for parse, write in ((_json, json_text), (_toml, toml_text), (_table, _table_text)):
        try:
            tree = parse(text)
        except (ValueError, RecursionError, csv.Error):
            continue
        for _ in range(dice.choice((1, 1, 1, 2, 3, 8))):
            change = _change_table if parse is _table else _change_tree
            change(tree, dice)
        text = write(tree)
        break
    encoding = "utf-8" if dice.random() < 0.9 else dice.choice(ENCODINGS)
    return text.encode(encoding, errors="surrogatepass" if encoding.startswith("utf-8") else "replace")


# Trees --------------------------------------------------------------------------------------------


def _json(text: str) -> Pairs:
    tree = json.loads(text, object_pairs_hook=Pairs)
    if isinstance(tree, Pairs):
        return tree
    raise ValueError("no object")


def _toml(text: str) -> Pairs:
    tree = tomllib.loads(text)
    if not tree:
        raise ValueError("no table")
    return _as_pairs(tree)


def _as_pairs(value: Any) -> Any:
    if isinstance(value, dict):
        return Pairs((name, _as_pairs(one)) for name, one in value.items())
    return [_as_pairs(one) for one in value] if type(value) is list else value


def _nodes(tree: Any) -> Iterator[list[Any]]:
    """All lists and objects of a tree."""
    yield tree
    for one in tree:
        inner = one[1] if isinstance(tree, Pairs) else one
        if isinstance(inner, list):
            yield from _nodes(inner)


def _change_tree(tree: Pairs, dice: random.Random) -> None:
    nodes = list(_nodes(tree))
    node = dice.choice(nodes)
    if not node:
        node.append(("n", 1) if isinstance(node, Pairs) else 1)
    at = dice.randrange(len(node))
    name, value = node[at] if isinstance(node, Pairs) else ("", node[at])
    match dice.randrange(8):
        case 0 | 1:
            value = dice.choice([one for one in ODD if type(one) is type(value)] or ODD)
        case 2:
            other = dice.choice(nodes)
            value = dice.choice(other)[-1] if isinstance(other, Pairs) and other else other
        case 3:
            value = dice.choice(([value], {"a": value}, str(value), [value] * 50, _nested(value, 60)))
        case 4:
            name = dice.choice((name + "s", name.upper(), "", "n", "\u0430", "id", string.capwords(name)))
        case 5:
            node.insert(dice.randrange(len(node) + 1), node[at])
        case 6:
            del node[at]
            return
        case 7:
            value = -value if type(value) in {int, float} else dice.choice(ODD)
    value = copy.deepcopy(_as_pairs(value))
    node[at] = (name, value) if isinstance(node, Pairs) else value


def _nested(value: Any, depth: int) -> Any:
    for _ in range(depth):
        value = [value]
    return value


def json_text(tree: Any) -> str:
    """A tree as JSON, with NaN, infinities and keys that are there twice."""
    if isinstance(tree, Pairs):
        return "{" + ", ".join(f"{json.dumps(name)}: {json_text(one)}" for name, one in tree) + "}"
    if isinstance(tree, list):
        return "[" + ", ".join(map(json_text, tree)) + "]"
    return json.dumps(tree, ensure_ascii=False, default=str)


def toml_text(tree: Pairs) -> str:
    """A tree as TOML."""
    return "\n".join(f"{json.dumps(name)} = {_toml_value(one)}" for name, one in tree)


def _toml_value(value: Any) -> str:
    if isinstance(value, Pairs):
        return "{" + ", ".join(f"{json.dumps(name)} = {_toml_value(one)}" for name, one in value) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml_value, value)) + "]"
    if isinstance(value, float):
        return repr(value)  # inf, nan
    text = '""' if value is None else json.dumps(value, ensure_ascii=False, default=str)
    return text.replace("\x7f", "\\u007f")


# Tables -------------------------------------------------------------------------------------------


def _table(text: str) -> list[list[str]]:
    first = text.partition("\n")[0]
    mark = max(",;\t", key=first.count)
    rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=mark))
    if not rows:
        raise ValueError("no rows")
    return [[mark], *rows]


def _table_text(table: list[list[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, delimiter=table[0][0]).writerows(table[1:])
    return text.getvalue()


def _change_table(table: list[list[str]], dice: random.Random) -> None:
    rows = table[1:] or [[""]]
    row, other = dice.choice(rows), dice.choice(rows)
    at, to = (dice.randrange(len(row) + 1) for _ in range(2))
    match dice.randrange(9):
        case 0 | 1 | 2:
            odd = dice.choice(ODD)
            row[at : at + 1] = ["" if odd is None else str(odd)[:100_000]]
        case 3:
            for each in rows:  # a column twice, or elsewhere
                each.insert(to, each[at] if at < len(each) else "")
        case 4:
            for each in rows:
                del each[at : at + 1]
        case 5:
            names = (*rows[0], "n", "position", "STUDENT_ID", "v_A_deg", "kL", "\u0430")
            rows[0][at : at + 1] = [dice.choice(names)]
        case 6:
            table.insert(dice.randrange(1, len(table) + 1), list(row))
        case 7:
            row[:] = other[: dice.randrange(len(other) + 1)]
        case 8:
            table[0][0] = dice.choice(",;\t|")
            if len(table) > 2 and dice.random() < 0.5:
                del table[dice.randrange(1, len(table))]
