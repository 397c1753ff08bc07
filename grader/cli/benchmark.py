"""``planmark bench``."""

import json

import typer
from rich.console import Console
from rich.progress import Progress


def show_benchmark(*, quick: bool, as_json: bool, solver_only: bool) -> None:
    """Measure the solver and, unless it alone is asked for, the reading; print the figures."""
    from grader.bench.reading import RESOLUTIONS_DPI, measure_reading
    from grader.bench.report import Report
    from grader.bench.solver import SolverBench

    bench, rows = SolverBench(quick), []
    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("the solver", total=bench.steps)
        for measured in bench.run():
            progress.update(bar, advance=1, description=measured)
        if not solver_only:
            reading = progress.add_task("reading sheets", total=len(RESOLUTIONS_DPI))
            for row in measure_reading(quick=quick):
                rows.append(row)
                progress.advance(reading)
    report = Report(bench.figures, tuple(rows))
    typer.echo(json.dumps(report.as_json(), indent=2) if as_json else report.as_text())
