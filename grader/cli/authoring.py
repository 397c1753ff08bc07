"""``planmark new``."""

from pathlib import Path

import typer

from grader.authoring.new import new_assignment
from reference.assignment import load_assignment


def write_new(file: Path, like: str | None, mechanism: str | None) -> None:
    """Write the files of a new assignment and say what to do next."""
    written = new_assignment(file, like=like, mechanism=mechanism)
    first = load_assignment(written.assignment).variants()[0]
    chosen = "".join(
        f" --{name} {value}"
        for name, value in (("n", first.n), ("position", first.position))
        if value is not None
    )
    for path in (written.assignment, written.mechanism, written.rubric):
        typer.echo(f"written: {path}")
    typer.echo("next: change them, then")
    typer.echo(f"  planmark plan {written.assignment}{chosen} --svg plan.svg")
    typer.echo(f"  planmark lint {written.assignment}")
