"""Write the table and the picture of the rooms into architecture.md: `python -m docs.make_architecture`.

The ceilings of rooms, tests and laboratory fall to what these have now, in `tests/docs/ceilings.toml`.
A room is a folder of modules; a module that lies directly in a package is a room of its own. What it holds is
the first line of its docstring. Arrows are the imports in the files, those inside functions too; the picture
leaves out an arrow that a longer way says already.
"""

import ast
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
PAGE, PICTURE = HERE / "architecture.md", HERE / "rooms.svg"
CEILINGS = ROOT / "tests" / "docs" / "ceilings.toml"
PACKAGES = ("grader", "reference")
FIRST, LAST = "<!-- rooms: written by make_architecture.py -->\n", "<!-- rooms: end -->"

Arrows = Mapping[str, frozenset[str]]
"""The rooms that each room imports from."""


@dataclass(frozen=True, slots=True)
class Room:
    """A room: its path without the ending, what it holds, how many lines."""

    name: str
    holds: str
    lines: int


# What there is ------------------------------------------------------------------------------------


def modules() -> dict[str, Path]:
    """The file of every module, by its dotted name."""
    paths = (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")))
    return {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for path in paths
    }


def room_of(path: Path) -> str:
    """The room of a file: its folder, or itself where it lies directly in a package."""
    relative = path.relative_to(ROOT)
    is_loose = len(relative.parts) == 2 and path.stem != "__init__"
    return (relative.with_suffix("") if is_loose else relative.parent).as_posix()


def rooms() -> list[Room]:
    """Every room, by name. Packages themselves are none: their files are rooms."""
    files: dict[str, list[Path]] = {}
    for path in modules().values():
        files.setdefault(room_of(path), []).append(path)
    return [
        Room(name, _first_line(paths), _lines(paths))
        for name, paths in sorted(files.items())
        if name not in PACKAGES
    ]


def _lines(paths: Iterable[Path]) -> int:
    return sum(len(_text(path).splitlines()) for path in paths)


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def _first_line(paths: list[Path]) -> str:
    """The first line of what a room's own module says of it."""
    own = next((path for path in paths if path.stem == "__init__"), paths[0])
    return (ast.get_docstring(ast.parse(_text(own))) or "").partition("\n")[0]


def arrows() -> Arrows:
    """The rooms from which each room imports."""
    files = modules()
    found: dict[str, set[str]] = {room.name: set() for room in rooms()}
    for path in files.values():
        here = room_of(path)
        there = {room_of(files[name]) for name in _imported(path, files)} - {here, *PACKAGES}
        if here in found:
            found[here] |= there
    return {name: frozenset(others) for name, others in found.items()}


def _imported(path: Path, files: Mapping[str, Path]) -> Iterator[str]:
    """Modules of the packages that a file imports."""
    for node in ast.walk(ast.parse(_text(path))):
        match node:
            case ast.Import(names=names):
                yield from (one.name for one in names if one.name in files)
            case ast.ImportFrom(module=str(module), names=names):
                dotted = [f"{module}.{one.name}" for one in names]
                yield from (
                    name if name in files else module for name in dotted if {name, module} & files.keys()
                )


# Levels -------------------------------------------------------------------------------------------


def reach(imports: Arrows) -> dict[str, set[str]]:
    """All rooms that each room reaches by one arrow or more."""
    reached = {name: set(others) for name, others in imports.items()}
    for middle in imports:
        for others in reached.values():
            if middle in others:
                others.update(reached[middle])
    return reached


def levels(imports: Arrows) -> dict[str, int]:
    """Each room above all that it imports from; rooms of a cycle on one level. 0 is the lowest."""
    reached = reach(imports)
    level: dict[str, int] = {}
    for name in sorted(imports, key=lambda one: len(reached[one] - {one})):
        below = [level[one] + (name not in reached[one]) for one in reached[name] if one in level]
        level[name] = max(below, default=0)
    return level


def shortened(imports: Arrows) -> Arrows:
    """The arrows without those that a longer way says already."""
    reached = reach(imports)
    return {
        name: frozenset(one for one in others if not any(one in reached[by] for by in others - {one}))
        for name, others in imports.items()
    }


# Table and picture --------------------------------------------------------------------------------


def table() -> str:
    """The table of the rooms as Markdown, by package."""
    rows = (f"| `{room.name}` | {room.holds} |" for room in rooms())
    return "\n".join(["| room | holds |", "| --- | --- |", *rows])


WIDE, HIGH, GAP_X, GAP_Y, MARGIN = 132, 28, 10, 44, 12
"""Sizes of boxes and gaps between them, in pixels."""
IN_A_ROW = 8
FILLS = {"grader": "#eef4fb", "reference": "#eef7ee"}


def picture() -> str:
    """The rooms as boxes, each above what it imports from, as SVG."""
    imports = arrows()
    places = _places(levels(imports))
    low = max(y for _, y in places.values()) + HIGH + MARGIN
    wide = MARGIN + IN_A_ROW * (WIDE + GAP_X)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {low}" font-family="sans-serif">',
        '<defs><marker id="tip" markerWidth="7" markerHeight="6" refX="6" refY="3" orient="auto">',
        '<path d="M0,0 L7,3 L0,6 z" fill="#667"/></marker></defs>',
    ]
    for name, others in sorted(shortened(imports).items()):
        lines += [_arrow(places[name], places[other]) for other in sorted(others)]
    for name, place in places.items():
        lines += _box(name, place)
    return "\n".join([*lines, "</svg>\n"])


def _box(room: str, place: tuple[int, int]) -> list[str]:
    package, _, name = room.partition("/")
    x, y, middle = *place, place[0] + WIDE // 2
    outline = f'width="{WIDE}" height="{HIGH}" rx="4" fill="{FILLS[package]}" stroke="#556"'
    return [
        f'<rect x="{x}" y="{y}" {outline}/>',
        f'<text x="{middle}" y="{y + 18}" font-size="11" text-anchor="middle">{escape(name)}</text>',
    ]


def _places(level: Mapping[str, int]) -> dict[str, tuple[int, int]]:
    """The top left corner of each box: levels from above, in rows."""
    places, y = {}, MARGIN
    for height in range(max(level.values()), -1, -1):
        here = sorted(name for name, one in level.items() if one == height)
        for start in range(0, len(here), IN_A_ROW):
            row = here[start : start + IN_A_ROW]
            left = MARGIN + (IN_A_ROW - len(row)) * (WIDE + GAP_X) // 2
            places.update({name: (left + index * (WIDE + GAP_X), y) for index, name in enumerate(row)})
            y += HIGH + GAP_Y
    return places


def _arrow(start: tuple[int, int], end: tuple[int, int]) -> str:
    """From the lower edge of a box to the upper edge of another; upwards and sideways in red."""
    is_down = end[1] > start[1]
    x1, y1, x2 = start[0] + WIDE / 2, start[1] + HIGH * is_down, end[0] + WIDE / 2
    colour = "#99a" if is_down else "#c33"
    y2 = end[1] if is_down else end[1] + HIGH
    line = f'x1="{x1:g}" y1="{y1}" x2="{x2:g}" y2="{y2}"'
    return f'<line {line} stroke="{colour}" stroke-width="0.8" marker-end="url(#tip)"/>'


# Ceilings -----------------------------------------------------------------------------------------

ROUND = 50
"""A ceiling is the next multiple of so many lines."""
LABORATORY = ("samples/simulation", "tests/bench", "tests/synthetic", "tests/training")


def sizes() -> dict[str, int]:
    """The lines of each room, of the package, of the tests and of the laboratory."""
    found = {room.name: room.lines for room in rooms()}
    laboratory = {path for folder in LABORATORY for path in (ROOT / folder).rglob("*.py")}
    tests = set((ROOT / "tests").rglob("*.py")) - laboratory
    return {**found, "package": sum(found.values()), "tests": _lines(tests), "laboratory": _lines(laboratory)}


def ceilings() -> dict[str, int]:
    """The most lines that each may have."""
    return dict(tomllib.loads(_text(CEILINGS))["lines"])


def lowered() -> str:
    """The file of ceilings, with those lowered that are too high; a new room gets one, too."""
    head, _, _ = _text(CEILINGS).partition("[lines]")
    known = ceilings()
    rows = (
        f'"{name}" = {min(known.get(name, size + ROUND), -(-size // ROUND) * ROUND)}'
        for name, size in sizes().items()
    )
    return head + "\n".join(["[lines]", *rows, ""])


def main() -> None:
    """Write all three."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(FIRST)
    _, _, after = rest.partition(LAST)
    PAGE.write_text(f"{before}{FIRST}\n{table()}\n\n{LAST}{after}", encoding="utf-8")
    PICTURE.write_text(picture(), encoding="utf-8")
    CEILINGS.write_text(lowered(), encoding="utf-8")


if __name__ == "__main__":
    main()
