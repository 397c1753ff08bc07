"""``planmark bench``."""

import importlib.util
import json

import typer
from rich.console import Console
from rich.progress import Progress

from reference.errors import CallError


def show_benchmark(*, quick: bool, as_json: bool) -> None:
    """Measure the solver and the reading, and print the figures."""
    if importlib.util.find_spec("mpmath") is None:
        raise CallError("mpmath_missing", "the benchmark needs mpmath: pip install 'planmark[bench]'")
    from grader.bench.reading import RESOLUTIONS_DPI, measure_reading
    from grader.bench.report import Report
    from grader.bench.solver import measure_solver

    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("measuring", total=1 + len(RESOLUTIONS_DPI))
        solver = measure_solver(quick=quick)
        progress.advance(bar)
        rows = []
        for row in measure_reading(quick=quick):
            rows.append(row)
            progress.advance(bar)
    report = Report(solver, tuple(rows))
    typer.echo(json.dumps(report.as_json(), indent=2) if as_json else report.as_text())
