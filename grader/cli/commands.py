"""The commands and their options; each imports its work when it runs."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from grader.cli import terminal
from grader.cli.app import (
    AssignmentArgument,
    AssignmentOption,
    FolderArgument,
    JobsOption,
    OutOption,
    ResultsArgument,
    RosterOption,
    app,
)
from grader.cli.terminal import gettext, note, shown_command, tell_next
from grader.language import N_
from grader.options import (
    CheckOptions,
    CycleOptions,
    ExportCall,
    GradeOptions,
    PlanOptions,
    ReviewOptions,
    SendOptions,
    ServeOptions,
    VariantOptions,
)


@app.command()
def plan(assignment: AssignmentArgument, options: PlanOptions) -> None:
    """Compute the exact plan of one variant, or of all: a table, JSON, or a drawing true to scale."""
    if options.every or options.csv is not None:
        from grader.cli.variants import show_class

        raise typer.Exit(1 if show_class(assignment, options) else 0)
    from grader.cli.plans import show_plan

    show_plan(assignment, options)


@app.command()
def lint(
    assignment: AssignmentArgument,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
    svg: Annotated[
        Path | None,
        typer.Option("--svg", help="Draw the variant that is hardest to draw into this SVG file."),
    ] = None,
) -> None:
    """Check an assignment and its rubric against every variant, and list all findings."""
    from grader.cli.linting import lint_assignment

    if lint_assignment(assignment, as_json=as_json, svg=svg):
        raise typer.Exit(1)
    if not as_json:
        tell_next("sheet", assignment, "--roster", "roster.csv", "-o", "sheets.pdf")


@app.command()
def new(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="NAME.assignment.toml; mechanism and rubric go beside it.")
    ],
    like: Annotated[
        str | None,
        typer.Option("--like", help="Start from this assignment: a built-in name or a .toml file."),
    ] = None,
    mechanism: Annotated[
        str | None,
        typer.Option(
            "--mechanism",
            help="Start from a four-bar (default), slider-crank, ..., or from your own: a .toml file.",
        ),
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option("--table", help="For your own mechanism: a CSV with the data of each variant."),
    ] = None,
) -> None:
    """Write a commented assignment to start from: three files, ready for lint and plan."""
    from grader.authoring.new import new_assignment
    from reference.authored.assignment import load_assignment

    written = new_assignment(file, like=like, mechanism=mechanism, table=table)
    first = load_assignment(written.assignment).variants()[0]
    chosen = [f"--{name}={value}" for name, value in asdict(first).items() if value is not None]
    for path in (written.assignment, written.mechanism, written.rubric):
        told = N_("kept: %(file)s") if mechanism == str(path) else N_("written: %(file)s")
        note(gettext(told, file=path))
    seen = shown_command("planmark", "plan", written.assignment, *chosen, "--svg", "plan.svg")
    note(gettext("see it: %(command)s", command=seen))
    tell_next("lint", written.assignment, before=N_("change them, then %(command)s"))


@app.command()
def cycle(assignment: AssignmentArgument, options: CycleOptions) -> None:
    """Velocities and accelerations over the cycle: a table of extremes, a CSV file, or a diagram.

    Over 0 to 360 degrees of the crank, or the range in which it can turn; followed without branch jumps.

    In every position the driving link has the variant's own speed and acceleration.
    """
    from grader.cli.variants import show_cycle

    show_cycle(assignment, options)


@app.command()
def schema(name: Annotated[str, typer.Argument(help="report, results, reading, measurements, ...")]) -> None:
    """Print the JSON Schema of a document or authored file."""
    import json

    from grader.cli import exporting

    terminal.say(json.dumps(exporting.schema(name), indent=2, ensure_ascii=False))


@app.command()
def grade(
    folder: FolderArgument, assignment: AssignmentOption, out: OutOption, options: GradeOptions
) -> None:
    """Grade a folder of scans (JPEG, PNG, TIFF, HEIC, PDF) and measurement files (CSV, JSON)."""
    from grader.cli.grading import grade_folder, tell_next_of_class
    from grader.folder.batch import needs_person

    graded = grade_folder(folder, assignment, out, options)
    tell_next_of_class(graded, out, options.to)
    raise typer.Exit(1 if needs_person(graded) else 0)


@app.command()
def review(results: ResultsArgument, options: ReviewOptions) -> None:
    """Decide open questions on a web page; decisions go to decisions.csv beside the submissions."""
    from grader.cli.reviewing import review_class

    review_class(results, options)


@app.command()
def collect(
    folder: ResultsArgument,
    file: Annotated[Path, typer.Option("--to", help="The .zip file to write; F.preview is made beside it.")],
    jobs: JobsOption = None,
) -> None:
    """Collect sheets without names, with the decisions as truth; a person checks each page first."""
    from grader.cli.collecting import collect_class

    raise typer.Exit(1 if collect_class(folder, file, jobs) else 0)


@app.command()
def serve(
    options: ServeOptions,
    data: Annotated[
        Path, typer.Argument(help="The folder for all data; created if it does not exist.")
    ] = Path("planmark-data"),
) -> None:
    """Serve students' self-check and instructors' classes as a web application."""
    from grader.cli.serving import serve as serve_folder

    serve_folder(data, options)


@app.command()
def check(assignment: AssignmentArgument, options: CheckOptions) -> None:
    """Check measured values or a photo: right, or how they are off, without giving the answer away."""
    from grader.cli.checking import check_measured, check_photo

    is_off = (check_photo if options.photo is not None else check_measured)(assignment, options)
    raise typer.Exit(1 if is_off else 0)


@app.command()
def demo(
    out: OutOption = Path("planmark-demo"),
    jobs: JobsOption = None,
) -> None:
    """Grade the bundled samples, scans and entered measurements, and say where to look."""
    from grader.cli.grading import demo as run_demo

    run_demo(out, jobs)


@app.command()
def read(
    scans: Annotated[list[Path], typer.Argument(help="Scans of one student's sheets.")],
    assignment: AssignmentOption,
    variant: VariantOptions,
    as_json: Annotated[bool, typer.Option("--json", help="Print the readings as JSON.")] = False,
) -> None:
    """Read scans and print the values with their standard errors, without grading."""
    from grader.cli.grading import read_scans

    raise typer.Exit(1 if read_scans(scans, assignment, variant, as_json=as_json) else 0)


@app.command()
def sheet(
    assignment: AssignmentArgument,
    out: Annotated[Path, typer.Option("--out", "-o", help="The PDF file to write.")],
    roster: RosterOption = None,
    layout: Annotated[
        Path | None, typer.Option("--layout", help="Write the positions of everything as JSON.")
    ] = None,
    calibration: Annotated[
        bool, typer.Option("--calibration", help="Print the page that measures printer and scanner instead.")
    ] = False,
) -> None:
    """Make printable A3 answer sheets for a class: markers, QR code, data, zones."""
    from grader.cli.sheets import print_sheets

    print_sheets(assignment, roster, out, layout, calibration=calibration)
    if calibration:
        tell_next("calibrate", "SCAN", before=N_("print it, scan it, then %(command)s"))
    else:
        handed_in = ("--assignment", assignment, "--roster", roster, "-o", "results")
        before = N_("print the sheets, scan them when they are drawn, then %(command)s")
        tell_next("grade", "SCANS", *handed_in, before=before)


@app.command()
def handout(
    assignment: AssignmentArgument,
    out: Annotated[Path, typer.Option("--out", "-o", help="The PDF file to write.")],
    variant: VariantOptions,
    roster: RosterOption = None,
    example: Annotated[
        int | None,
        typer.Option(
            "--example", help="Work out this n (position, if there is no n) of nobody's at the end."
        ),
    ] = None,
) -> None:
    """Make A4 task sheets for a class or for one --n: scheme, data, empty tables, no solution."""
    from grader.cli.sheets import print_handout

    print_handout(assignment, roster, variant, out, example)


@app.command()
def calibrate(
    scans: Annotated[list[Path], typer.Argument(help="Scans of the calibration page.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the measurements as JSON.")] = False,
    svg: Annotated[
        Path | None,
        typer.Option("--svg", help="Draw the errors of the first scan's page, 200 times enlarged."),
    ] = None,
) -> None:
    """Measure errors of printer and scanner on scans of the page that `sheet --calibration` prints."""
    from grader.cli.sheets import calibrate_scans

    raise typer.Exit(1 if calibrate_scans(scans, svg, as_json=as_json) else 0)


@app.command()
def match(
    folder: FolderArgument,
    assignment: AssignmentOption,
    roster: Annotated[Path, typer.Option("--roster", help="The class: roster.csv.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="The draft of the roster to write, a CSV file.")],
    pages_per_student: Annotated[int | None, typer.Option("--pages-per-student")] = None,
) -> None:
    """Suggest owners of pages: a draft of the roster's `scans`, and a contact sheet to check it."""
    from grader.cli.sheets import draft_matches

    open_ends = draft_matches(folder, assignment, roster, out, pages_per_student)
    known = ("--assignment", assignment, "--roster", out, "-o", "results")
    tell_next("grade", folder, *known, before=N_("correct the column `scans`, then %(command)s"))
    raise typer.Exit(1 if open_ends else 0)


@app.command()
def bench(
    quick: Annotated[bool, typer.Option("--quick", help="One student of each class, fewer runs.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Measure run time and error of the solver, and of reading the bundled samples."""
    from grader.cli.benchmark import show_benchmark

    show_benchmark(quick=quick, as_json=as_json)


@app.command()
def export(results: ResultsArgument, options: ExportCall) -> None:
    """Write the results for a learning platform, validated before anything is written."""
    from grader.cli.exporting import export_results

    is_open, path = export_results(results, options)
    if options.assignment_id or options.cmid or options.criteria:
        tell_next("send", path)  # calls, which alone have a place
    elif options.to in {"csv", "json"}:
        note(gettext("next: open %(file)s", file=path))
    else:
        told = N_("next: upload %(file)s to %(to)s; the documentation of exports says how")
        note(gettext(told, file=path, to=options.to))
    raise typer.Exit(1 if is_open else 0)


@app.command()
def send(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What `planmark export` wrote.")],
    options: SendOptions,
) -> None:
    """Send an exported rubric and marks to a platform; a second run sends only what is open or changed.

    The platform's token is read from the environment: PLANMARK_TOKEN. Without --yes nothing is sent.
    """
    from grader.cli.sending import send_export

    raise typer.Exit(1 if send_export(file, options) else 0)
