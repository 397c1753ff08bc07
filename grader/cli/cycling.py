"""``planmark cycle``."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import typer

from grader.cli.progress import new_table
from grader.cycle.quantities import Selection, Subject, cycle_csv
from grader.cycle.strokes import Extreme, extremes, strokes_of
from grader.files import write_whole
from grader.i18n import Tongue, tongue
from reference.assignment import Assignment, Variant, load_assignment
from reference.cycle import cycle
from reference.errors import CallError

if TYPE_CHECKING:
    from rich.table import Table

CONSTANT = 1e-9
"""What changes by less over a cycle, against the largest of its kind, is constant but for rounding."""
ZERO = 1e-8
"""Against the largest of its kind: a least value below it is zero but for rounding."""


def show_cycle(
    name: str,
    n: int | None,
    position: int | None,
    *,
    of: list[str],
    samples: int,
    csv: Path | None,
    svg: Path | None,
    pdf: Path | None,
    lang: str,
) -> None:
    """Write a variant's cycle as a table or a diagram; without files, print its extremes and strokes."""
    words = tongue(lang)
    assignment = load_assignment(name)
    variant = assignment.variant(n, position)
    subject = Subject(cycle(assignment.mechanism([variant]), samples))
    selection = subject.select([part.strip() for text in of for part in text.split(",") if part.strip()])
    drawn_in = {kind: file for kind, file in (("svg", svg), ("pdf", pdf)) if file is not None}
    diagrams = _diagrams(assignment, variant, subject, selection, words, list(drawn_in))
    if csv is not None:
        write_whole(csv, cycle_csv(subject, selection, decimal_comma=words.decimal_mark == ","))
        typer.echo(f"Written to {csv}")
    for file, diagram in zip(drawn_in.values(), diagrams, strict=True):
        write_whole(file, diagram)
        typer.echo(f"Drawn in {file}")
    if csv is None and not drawn_in:
        _print(assignment, variant, subject, selection)


def _diagrams(
    assignment: Assignment,
    variant: Variant,
    subject: Subject,
    selection: Selection,
    words: Tongue,
    formats: list[str],
) -> list[bytes]:
    """The diagram as files of some formats; raises CallError where matplotlib is not installed."""
    if not formats:
        return []
    try:
        from grader.cycle.diagram import Setting, cycle_diagram
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        message = "a diagram of a cycle needs matplotlib: install it with pip install 'planmark[plots]'"
        raise CallError("matplotlib_needed", message) from error
    return cycle_diagram(subject, selection, Setting(assignment, variant, words), formats)


def _print(assignment: Assignment, variant: Variant, subject: Subject, selection: Selection) -> None:
    """The range, strokes, and the extremes of the selected quantities."""
    from rich.console import Console

    console = Console()
    console.print(f"[bold]{assignment.file.title.en}[/bold], {variant}", highlight=False)
    for line in (*_range(subject), *_strokes(subject)):
        console.print(line, highlight=False, soft_wrap=True)
    where = "at deg" if subject.cycle.is_turned else "at mm"
    table = new_table("", "unit", "least", where, "largest", where, "here", left=("unit",))
    for quantity in selection.quantities:
        least, largest = extremes(subject, quantity)
        here = float(subject.values_at(quantity, np.array([subject.cycle.start]))[0])
        unit = quantity.unit.replace("²", "^2")
        size = subject.size(quantity)
        if largest.value - least.value <= CONSTANT * size:
            told = here if abs(here) > ZERO * size else 0.0
            table.add_row(quantity.name, unit, "constant", "", "", "", f"{told:.6g}")
            continue
        cells = (*_told(subject, least, size), *_told(subject, largest, size), f"{here + 0.0:.6g}")
        table.add_row(quantity.name, unit, *cells)
    for point in selection.points:
        _path_rows(subject, point, table)
    console.print(table)
    console.print("every position: --csv FILE; as a diagram: --svg FILE, --pdf FILE", style="dim")


def _path_rows(subject: Subject, point: str, table: "Table") -> None:
    """How far a point's path reaches each way, by its samples."""
    place = np.broadcast_to(subject.cycle.motion.position[point], subject.cycle.driven.shape)
    here = complex(subject.motion_at(np.array([subject.cycle.start])).position[point][0])
    for axis, values, own in (("x", place.real, here.real), ("y", place.imag, here.imag)):
        ends = [int(np.nanargmin(values)), int(np.nanargmax(values))]
        cells = [
            cell
            for end in ends
            for cell in (f"{values[end] + 0.0:.6g}", _number(subject, float(subject.cycle.driven[end])))
        ]
        table.add_row(f"{axis}_{point}", "m", *cells, f"{own + 0.0:.6g}")


def _told(subject: Subject, extreme: Extreme, size: float) -> tuple[str, str]:
    value = extreme.value if abs(extreme.value) > ZERO * size else 0.0
    if math.isinf(value):
        text = "∞" if value > 0.0 else "-∞"
    else:
        text = "-" if math.isnan(value) else f"{value + 0.0:.6g}"
    return text, ", ".join(_number(subject, at) for at in extreme.at)


def _at(subject: Subject, driven: float) -> str:
    """A driven coordinate with its unit."""
    return f"{_number(subject, driven)} {'deg' if subject.cycle.is_turned else 'mm'}"


def _number(subject: Subject, driven: float) -> str:
    """A driven coordinate in degrees or millimetres, without a minus zero."""
    if subject.cycle.is_turned:
        return f"{round(math.degrees(driven), 2) + 0.0:.2f}"
    return f"{round(1e3 * driven, 3) + 0.0:.3f}"


def _range(subject: Subject) -> Iterator[str]:
    """How far the driven link goes, what stops it, and what it passes."""
    found = subject.cycle
    what = "crank" if found.is_turned else "driven slider"
    here = f"this variant: {_at(subject, found.start)}"
    if found.turns:
        yield f"the crank turns fully; {here}"
    else:
        ends = [_at(subject, float(end)) for end in (found.driven[0], found.driven[-1])]
        yield f"the {what} moves from {ends[0]} to {ends[1]}; {here}"
        for stop in found.following.stops:
            if stop is None:
                yield "  nothing stops it on one side"
            else:
                yield f"  {_at(subject, stop.at)}: {stop.node}, {stop.why}"
    if found.turns > 1:
        yield "after a turn it is in its other assembly: the cycle is two turns"
    for low, high in found.elsewhere:
        yield f"it assembles from {_at(subject, low)} to {_at(subject, high)} as well, out of reach from here"
    flat: dict[str, list[str]] = {}
    for event in found.passed:
        flat.setdefault(event.node, []).append(_at(subject, event.at))
    for node, places in flat.items():
        yield f"flat position of {node} at {' and '.join(places)}: passed smoothly, nothing is told in it"


def _strokes(subject: Subject) -> Iterator[str]:
    """What goes to and fro."""
    for stroke in strokes_of(subject):
        whose = f"link {stroke.name}" if stroke.is_angle else stroke.name
        places = " and ".join(_at(subject, at) for at in stroke.dead_points)
        text = f"{whose}: dead point{'s' if len(stroke.dead_points) > 1 else ''} at {places}"
        if stroke.travel is not None and stroke.time_ratio is not None:
            far = (
                f"{math.degrees(stroke.travel):.3f} deg"
                if stroke.is_angle
                else f"{1e3 * stroke.travel:.3f} mm"
            )
            text += f", travel {far}, time ratio of the strokes {stroke.time_ratio:.4f}"
        yield text
