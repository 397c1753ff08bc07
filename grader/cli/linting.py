"""``planmark lint``."""

import typer

from grader.lint import lint
from grader.rubric import load_rubric
from reference.assignment import load_assignment


def lint_assignment(name: str) -> bool:
    """Print every remark on an assignment and its rubric; whether there are any."""
    assignment = load_assignment(name)
    rubric = load_rubric(assignment.file.rubric, beside=assignment.path)
    remarks = lint(assignment, rubric)
    for remark in remarks:
        typer.echo(str(remark))
    count = len(assignment.variants())
    typer.echo(f"{assignment.id}: {count} variants, {len(remarks) or 'no'} finding(s)")
    return bool(remarks)
