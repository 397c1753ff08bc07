"""The commands."""

from pathlib import Path
from typing import Annotated

import typer

from grader.cli.app import AssignmentArgument, NumberOption, PositionOption, app


@app.command()
def plan(
    assignment: AssignmentArgument,
    n: NumberOption = None,
    position: PositionOption = None,
    crank_mm: Annotated[
        float | None, typer.Option("--crank-mm", help="Drawn length of the crank, mm; the scales follow.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the plan as JSON.")] = False,
    svg: Annotated[Path | None, typer.Option("--svg", help="Draw the plan into this SVG file.")] = None,
    pdf: Annotated[Path | None, typer.Option("--pdf", help="Draw the plan into this PDF file.")] = None,
) -> None:
    """The exact plan of a variant: a table, JSON, or a drawing true to scale."""
    from grader.cli.plans import show_plan

    show_plan(assignment, n, position, crank_mm, as_json=as_json, svg=svg, pdf=pdf)


@app.command()
def schema(name: Annotated[str, typer.Argument(help="report, results, reading, measurements, ...")]) -> None:
    """The JSON Schema of a document or authored file."""
    import json

    from grader import documents

    typer.echo(json.dumps(documents.schema(name), indent=2, ensure_ascii=False))
