"""``planmark bench``."""

import json

import typer
from rich.console import Console
from rich.progress import Progress


def show_benchmark(
    *, quick: bool, as_json: bool, only: str | None = None, students: int | None = None
) -> None:
    """Measure the solver and the reading, or the one of them that is asked for; print the figures.

    Arguments: `only` is ``solver`` or ``reading``; `students` per scene of the reading.
    """
    from grader.bench.reading import ReadingBench
    from grader.bench.report import Report
    from grader.bench.solver import SolverBench

    solver = None if only == "reading" else SolverBench(quick)
    reading = None if only == "solver" else ReadingBench(quick=quick, students=students)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        for bench in (solver, reading):
            if bench is None:
                continue
            bar = progress.add_task("", total=bench.steps)
            for told in bench.run():
                progress.update(bar, advance=1, description=told)
    report = Report(
        None if solver is None else solver.figures,
        () if reading is None else tuple(reading.rows),
        () if reading is None else tuple(reading.foreign),
        None if reading is None else reading.lines,
    )
    typer.echo(json.dumps(report.as_json(), indent=2) if as_json else report.as_text())
