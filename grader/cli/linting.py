"""``planmark lint``."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from grader.files import write_whole
from grader.lint import Least, Lint, Proposal, Row, lint, lint_document, named
from grader.lint.scales import ratio_text
from grader.rubric import load_rubric
from reference.assignment import load_assignment
from reference.canvas import svg as as_svg
from reference.draw import reference_drawing
from reference.geometry import FloatArray

SHOWN_ROWS = 40
"""More variants than that are told in ranges."""
COLOURS = {"fault": "bold red", "warning": "yellow", "hint": "cyan"}


def lint_assignment(name: str, *, as_json: bool, svg: Path | None) -> bool:
    """Print every finding on an assignment and its rubric; whether any needs a person."""
    assignment = load_assignment(name)
    found = lint(assignment, load_rubric(assignment.file.rubric, beside=assignment.path))
    if svg is not None and found.plan is not None and found.worst is not None:
        sheets = [sheet.shapes for sheet in reference_drawing(assignment, found.plan, found.worst.index)]
        write_whole(svg, as_svg(sheets))
    if as_json:
        typer.echo(lint_document(found).model_dump_json(indent=2))
        return found.needs_a_person
    console = Console()
    console.print(f"[bold]{assignment.file.title.en}[/bold]", highlight=False)
    console.print(_variants_table(found.rows))
    if found.scales and found.plan is not None:
        console.print(_scales_table(found.scales))
    _tell_findings(console, found)
    _tell_end(found, svg)
    return found.needs_a_person


def _variants_table(rows: Sequence[Row]) -> Table:
    table = Table("variant", "assembles", box=None, header_style="bold")
    for heading in (
        "transmission\nsine",
        "crossing\ndegrees",
        "shortest asked\nmm",
        "under\n8 mm",
        "fits\ntimes",
    ):
        table.add_column(heading, justify="right")
    for group in _ranges(rows):
        broken = [row for row in group if row.problem]
        assembles = "yes" if not broken else "no" if len(broken) == len(group) else f"{len(broken)} do not"
        table.add_row(
            _named_range(group),
            f"[red]{assembles}[/red]" if broken else assembles,
            _worst_of([row.transmission for row in group], "{:.2f}"),
            _worst_of([row.crossing_deg for row in group], "{:.1f}"),
            _worst_of([row.shortest_mm for row in group], "{:.2f}"),
            str(sum(row.short for row in group)),
            _worst_of([row.room for row in group], "{:.2f}", named_below=1.0),
        )
    return table


def _ranges(rows: Sequence[Row]) -> list[Sequence[Row]]:
    """A row each, or of many variants about thirty stretches."""
    if len(rows) <= SHOWN_ROWS:
        return [[row] for row in rows]
    long = -(-len(rows) // 30)
    return [rows[start : start + long] for start in range(0, len(rows), long)]


def _named_range(group: Sequence[Row]) -> str:
    return str(group[0].variant) if len(group) == 1 else named([row.variant for row in group])


def _worst_of(figures: Sequence[Least | None], form: str, named_below: float = np.inf) -> str:
    known = [figure for figure in figures if figure is not None]
    if not known:
        return "-"
    least = min(known, key=lambda figure: figure.value)
    return form.format(least.value) + (f" {least.at}" if least.value < named_below else "")


def _scales_table(scales: Sequence[Proposal]) -> Table:
    told = {"proposed": "as proposed", "round": "round, one for all", "round_each": "round, each its own"}
    table = Table("scales", box=None, header_style="bold")
    for heading in (
        "kL", "kv\n(m/s)/mm", "ka\n(m/s^2)/mm", "fits\ntimes",
        "shortest asked\nmm", "under\n8 mm", "shortest\nlink mm",
    ):  # fmt: skip
        table.add_column(heading, justify="right")
    for one in scales:
        lengths = sorted({ratio_text(float(kL)) for kL in _ends(one.scales.kL)}, key=len)
        table.add_row(
            told[one.name],
            " .. ".join(lengths),
            _span(one.scales.kv),
            _span(one.scales.ka),
            f"{one.room:.2f}",
            "-" if one.shortest_mm is None else f"{one.shortest_mm:.2f} {one.shortest}",
            f"{one.under_8_mm} of {one.asked}",
            f"{one.link_mm:.1f}",
        )
    return table


def _ends(values: FloatArray) -> tuple[float, float]:
    return float(np.min(values)), float(np.max(values))


def _span(values: FloatArray) -> str:
    low, high = (f"{end:.0f}" if end >= 1e4 else f"{end:.4g}" for end in _ends(values))
    return low if low == high else f"{low} .. {high}"


def _tell_findings(console: Console, found: Lint) -> None:
    """A line each, which terminals break and programs can search."""
    for finding in found.findings:
        word = f"[{COLOURS[finding.severity]}]{finding.severity:<8}[/]"
        console.print(f"{word} ", end="")
        console.print(str(finding), markup=False, highlight=False, soft_wrap=True)


def _tell_end(found: Lint, svg: Path | None) -> None:
    if found.worst is not None and found.plan is not None:
        variant = found.plan.variants[found.worst.index]
        typer.echo(f"hardest to draw: {variant}: {found.worst.why}")
        if svg is not None:
            typer.echo(f"drawn in {svg}")
    elif svg is not None:
        typer.echo("nothing drawn: no variant can be solved")
    counts = {
        severity: sum(finding.severity == severity for finding in found.findings)
        for severity in ("fault", "warning", "hint")
    }
    told = ", ".join(
        f"{count} {severity}{'' if count == 1 else 's'}" for severity, count in counts.items() if count
    )
    typer.echo(f"{found.assignment.id}: {len(found.rows)} variants, {told or 'no findings'}")
