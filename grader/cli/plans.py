"""``planmark plan``."""

from pathlib import Path

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from grader.files import write_whole
from grader.plan_document import plan_document
from reference.assignment import Assignment, load_assignment
from reference.canvas import svg as as_svg
from reference.draw import reference_drawing
from reference.errors import CallError
from reference.plan import Plan, exact_plan


def show_plan(
    name: str,
    n: int | None,
    position: int | None,
    crank_mm: float | None,
    *,
    as_json: bool,
    svg: Path | None,
    pdf: Path | None,
) -> None:
    """Print the exact plan of a variant, and draw it where files are named."""
    check_crank(crank_mm)
    assignment = load_assignment(name)
    variants = [assignment.variant(n, position)]
    plan = exact_plan(assignment, variants, assignment.scales(variants, crank_mm=crank_mm))
    _draw(assignment, plan, svg, pdf)
    if as_json:
        typer.echo(plan_document(assignment, plan).model_dump_json(indent=2))
        return
    _print_table(assignment, plan)
    for file in (svg, pdf):
        if file is not None:
            typer.echo(f"Drawn in {file}")


def check_crank(crank_mm: float | None) -> None:
    """Refuse a drawn length that no crank on paper has."""
    if crank_mm is not None and not 0.0 < crank_mm < 1000.0:
        raise CallError(
            "crank_mm", f"--crank-mm {crank_mm:g}: a length in mm above 0 and below 1000 is needed"
        )


def _draw(assignment: Assignment, plan: Plan, svg: Path | None, pdf: Path | None) -> None:
    if svg is None and pdf is None:
        return
    sheets = [sheet.shapes for sheet in reference_drawing(assignment, plan)]
    if svg is not None:
        write_whole(svg, as_svg(sheets))
    if pdf is not None:
        from grader.plan_pdf import pdf as as_pdf

        write_whole(pdf, as_pdf(sheets, f"{assignment.file.title.en}, {plan.variants[0]}"))


def _print_table(assignment: Assignment, plan: Plan) -> None:
    document = plan_document(assignment, plan)
    scales = document.scales
    console = Console()
    console.print(f"[bold]{assignment.file.title.en}[/bold], {plan.variants[0]}", highlight=False)
    console.print(
        f"kL = {scales.kL:.6g} m/mm   kv = {scales.kv:.6g} (m/s)/mm   ka = {scales.ka:.6g} (m/s^2)/mm",
        highlight=False,
    )
    table = Table("vector", box=None, header_style="bold")
    for heading in ("drawn mm", "value", "unit", "direction deg"):
        table.add_column(heading, justify="left" if heading == "unit" else "right")
    for vector, row in document.vectors.items():
        direction = "-" if row.direction_deg is None else f"{row.direction_deg:.2f}"
        table.add_row(vector, f"{row.drawn_mm:.2f}", f"{row.value:.4f}", row.unit, direction)
    for rate, value in document.angular.items():
        unit = "rad/s" if rate.startswith("omega") else "rad/s^2"
        table.add_row(rate, "", f"{value + 0.0:.4f}", unit, "")
    console.print(table)
    worst = min((float(np.min(sine)) for sine in plan.motion.transmission.values()), default=1.0)
    if worst < 0.2:
        console.print(
            f"near a singular position: the sine of a transmission angle is {worst:.3f}", style="yellow"
        )
