"""``planmark bench``."""

import json
from collections.abc import Collection

import typer
from rich.console import Console
from rich.progress import Progress

PARTS = frozenset({"solver", "reading", "judging"})


def show_benchmark(
    *, quick: bool, as_json: bool, parts: Collection[str] = PARTS, students: int | None = None
) -> None:
    """Measure the parts asked for, of `PARTS`, and print the figures.

    Arguments: `students` per scene of the reading, per kind, hand and mechanism of the judging.
    """
    from grader.bench.judging import JudgingBench
    from grader.bench.judging_class import measure_class
    from grader.bench.judging_scans import judged_scan
    from grader.bench.reading import ReadingBench
    from grader.bench.report import Report
    from grader.bench.solver import SolverBench

    solver = SolverBench(quick) if "solver" in parts else None
    reading = ReadingBench(quick=quick, students=students) if "reading" in parts else None
    judging = None
    if "judging" in parts:
        judging = JudgingBench(quick=quick, students=students, whole_class=measure_class, scan=judged_scan)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        for bench in (solver, reading, judging):
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
        None if judging is None else judging.figures,
    )
    typer.echo(json.dumps(report.as_json(), indent=2) if as_json else report.as_text())
