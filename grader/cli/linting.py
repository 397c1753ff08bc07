"""``planmark lint``."""

import typer

from grader.lint import lint
from grader.rubric import load_rubric
from reference.assignment import load_assignment


def lint_assignment(name: str) -> bool:
    """Print every finding on an assignment and its rubric; whether there are any."""
    assignment = load_assignment(name)
    findings = lint(assignment, load_rubric(assignment.file.rubric, beside=assignment.path))
    for finding in findings:
        typer.echo(str(finding))
    typer.echo(f"{assignment.id}: {len(assignment.variants())} variants, {len(findings) or 'no'} finding(s)")
    return bool(findings)
