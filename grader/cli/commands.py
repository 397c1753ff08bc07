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
    LanguageOption,
    NumberOption,
    OutOption,
    PositionOption,
    ResultsArgument,
    RosterOption,
    app,
)
from grader.cli.terminal import note, shown_command, tell_next


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
    pdf: Annotated[
        Path | None,
        typer.Option("--pdf", help="Draw the plan into this PDF file; with --all the tables too."),
    ] = None,
    steps: Annotated[
        Path | None,
        typer.Option(
            "--steps", help="Write the construction step by step, in words and pictures: .html or .pdf."
        ),
    ] = None,
    altitude: Annotated[
        bool,
        typer.Option("--altitude", help="Draw normal components by right triangles on the mechanism too."),
    ] = False,
    every: Annotated[
        bool, typer.Option("--all", help="All variants, for the instructor's own records.")
    ] = False,
    csv: Annotated[
        Path | None, typer.Option("--csv", help="With --all: a table for spreadsheets, a row per variant.")
    ] = None,
    drawings: Annotated[
        bool,
        typer.Option("--drawings/--no-drawings", help="With --all --pdf: a drawing of each variant too."),
    ] = True,
    lang: LanguageOption = "en",
) -> None:
    """The exact plan of a variant: a table, JSON, or a drawing true to scale; or those of all variants."""
    if every or csv is not None:
        from grader.cli.variants import refuse_single, show_class

        single = {
            "--n": n,
            "--position": position,
            "--svg": svg,
            "--steps": steps,
            "--altitude": altitude or None,
        }
        refuse_single(every=every, options=single)
        is_open = show_class(
            assignment, crank_mm, as_json=as_json, csv=csv, pdf=pdf, drawings=drawings, lang=lang
        )
        raise typer.Exit(1 if is_open else 0)
    from grader.cli.plans import Drawings, show_plan

    drawn = Drawings(svg, pdf, steps, lang, altitude=altitude)
    show_plan(assignment, n, position, crank_mm, as_json=as_json, drawings=drawn)


@app.command()
def lint(
    assignment: AssignmentArgument,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
    svg: Annotated[
        Path | None,
        typer.Option("--svg", help="Draw the variant that is hardest to draw into this SVG file."),
    ] = None,
) -> None:
    """Hold an assignment and its rubric against every variant: all findings at once."""
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
        typer.Option("--table", help="Of your own mechanism: a CSV with the data of each variant."),
    ] = None,
) -> None:
    """Write a commented assignment to start from: three files that lint and plan take as they are."""
    from grader.authoring.new import new_assignment
    from reference.authored.assignment import load_assignment

    written = new_assignment(file, like=like, mechanism=mechanism, table=table)
    first = load_assignment(written.assignment).variants()[0]
    chosen = [f"--{name}={value}" for name, value in asdict(first).items() if value is not None]
    for path in (written.assignment, written.mechanism, written.rubric):
        note(f"written: {path}")
    note(f"see it: {shown_command('planmark', 'plan', written.assignment, *chosen, '--svg', 'plan.svg')}")
    tell_next("lint", written.assignment, before="change them, then ")


@app.command()
def cycle(
    assignment: AssignmentArgument,
    n: NumberOption = None,
    position: PositionOption = None,
    of: Annotated[
        list[str] | None,
        typer.Option(
            "--of",
            help="What to tell: v_B, a_B, v_BA, a_BA_n (with _x or _y a component), omega_3, epsilon_3, D"
            " (the path of point D); several with commas. All speeds and accelerations if absent.",
        ),
    ] = None,
    samples: Annotated[int, typer.Option("--samples", help="Positions over the cycle.")] = 361,
    csv: Annotated[Path | None, typer.Option("--csv", help="Write every position to this CSV file.")] = None,
    svg: Annotated[Path | None, typer.Option("--svg", help="Draw the diagram into this SVG file.")] = None,
    pdf: Annotated[Path | None, typer.Option("--pdf", help="Draw the diagram into this PDF file.")] = None,
    lang: LanguageOption = "en",
) -> None:
    """Velocities and accelerations over the cycle: a table of extremes, a CSV file, or a diagram.

    Over 0 to 360 degrees of the crank, or the range in which it can turn; followed without branch jumps.

    In every position the driven link has the variant's own speed and acceleration.
    """
    from grader.cli.variants import show_cycle

    show_cycle(assignment, n, position, of=of or [], samples=samples, csv=csv, svg=svg, pdf=pdf, lang=lang)


@app.command()
def schema(name: Annotated[str, typer.Argument(help="report, results, reading, measurements, ...")]) -> None:
    """The JSON Schema of a document or authored file."""
    import json

    from grader.cli import exporting

    terminal.say(json.dumps(exporting.schema(name), indent=2, ensure_ascii=False))


@app.command()
def grade(
    folder: FolderArgument,
    assignment: AssignmentOption,
    out: OutOption,
    roster: RosterOption = None,
    pages_per_student: Annotated[
        int | None, typer.Option("--pages-per-student", help="Of one class file, in the roster's order.")
    ] = None,
    jobs: JobsOption = None,
    lang: LanguageOption = "en",
    level: Annotated[
        str, typer.Option("--level", help="What students are told: symbol, hint, or full (with the answers).")
    ] = "full",
    ghosts: Annotated[
        bool, typer.Option("--ghosts/--no-ghosts", help="With --level full: draw expected vectors, dotted.")
    ] = True,
    decisions: Annotated[
        Path | None,
        typer.Option("--decisions", help="What people decided; decisions.csv in the folder if absent."),
    ] = None,
    time_limit: Annotated[
        float, typer.Option("--time-limit", min=1.0, help="Seconds that a file or a sheet may take.")
    ] = 60.0,
    memory_limit: Annotated[
        int, typer.Option("--memory-limit", min=300, help="Megabytes that a file or a sheet may take.")
    ] = 1500,
    watch: Annotated[
        bool, typer.Option("--watch", help="Grade what comes into the folder, too, until Ctrl+C.")
    ] = False,
    every: Annotated[
        float, typer.Option("--every", min=0.1, help="With --watch: seconds between two looks.")
    ] = 5.0,
    cluster: Annotated[
        str | None,
        typer.Option(
            "--cluster",
            metavar="ADDRESS",
            help="Scheduler of a Dask cluster that does the work; FOLDER may be s3://bucket/class then.",
        ),
    ] = None,
    to: Annotated[
        str | None, typer.Option("--to", hidden=True, help="The platform, for the line on what is next.")
    ] = None,
) -> None:
    """Grade a folder of scans (JPEG, PNG, TIFF, PDF) and measurement files (CSV, JSON)."""
    from grader.cli.grading import grade_folder, tell_next_of_class
    from grader.folder.batch import needs_person
    from grader.folder.workers import Limits

    graded = grade_folder(
        folder, assignment, out, roster=roster, pages_per_student=pages_per_student, jobs=jobs, lang=lang,
        limits=Limits(time_limit, memory_limit), level=level, with_ghosts=ghosts,
        decisions=decisions, watch_s=every if watch else None, cluster=cluster,
    )  # fmt: skip
    tell_next_of_class(graded, out, to)
    raise typer.Exit(1 if needs_person(graded) else 0)


@app.command()
def review(
    results: ResultsArgument,
    host: Annotated[
        str, typer.Option("--host", help="Address to listen on; other machines need the --token, too.")
    ] = "127.0.0.1",
    token: Annotated[
        str, typer.Option("--token", help="What people must have in the address: 8 signs or more.")
    ] = "",
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="0: any that is free.")] = 8321,
    jobs: JobsOption = None,
    lang: Annotated[
        str | None, typer.Option("--lang", help="Of the page: en, ro or ru; as graded if absent.")
    ] = None,
) -> None:
    """Settle what waits on a web page; decisions go to decisions.csv beside the submissions."""
    from grader.cli.reviewing import review_class

    review_class(results, host=host, token=token, port=port, jobs=jobs, lang=lang)


@app.command()
def collect(
    folder: ResultsArgument,
    file: Annotated[Path, typer.Option("--to", help="The .zip file to write; F.preview is made beside it.")],
    jobs: JobsOption = None,
) -> None:
    """Give away sheets without names, with the decisions as truth; each page is looked at before."""
    from grader.cli.collecting import collect_class

    raise typer.Exit(1 if collect_class(folder, file, jobs) else 0)


@app.command()
def serve(
    data: Annotated[
        Path, typer.Argument(help="The folder that everything is kept in; made if it is not there.")
    ] = Path("planmark-data"),
    host: Annotated[
        str, typer.Option("--host", help="Address to listen at; others reach 0.0.0.0.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="0 takes any that is free.")] = 8000,
    address: Annotated[
        str | None, typer.Option("--address", help="Under which students reach it: https://NAME.")
    ] = None,
    database: Annotated[
        str | None,
        typer.Option("--database", help="postgresql+psycopg://...; SQLite in the folder if not given."),
    ] = None,
    mail: Annotated[
        str | None, typer.Option("--mail", help="smtps://USER@HOST/SENDER sends links to new passwords.")
    ] = None,
    jobs: JobsOption = None,
) -> None:
    """Serve students' self-check and instructors' classes as a web application."""
    from grader.cli.serving import serve as serve_folder

    serve_folder(data, host=host, port=port, address=address, database=database, mail=mail, jobs=jobs)


@app.command()
def check(
    assignment: AssignmentArgument,
    measured: Annotated[
        Path | None, typer.Option("--measured", help="Measurement file, CSV or JSON.")
    ] = None,
    photo: Annotated[
        Path | None,
        typer.Option("--photo", help="Photo or scan of the drawn sheet, instead of measurements."),
    ] = None,
    n: NumberOption = None,
    position: PositionOption = None,
    lang: LanguageOption = "en",
    level: Annotated[
        str, typer.Option("--level", help="symbol (right or off), hint (in which way), full (numbers).")
    ] = "hint",
    page: Annotated[
        Path | None, typer.Option("--page", help="Draw and tell it in this HTML file, too.")
    ] = None,
    template: Annotated[
        Path | None, typer.Option("--template", help="Write the CSV file to fill in.")
    ] = None,
) -> None:
    """Check measured values, or a photo: right, or off and in which way, without giving the answer away."""
    from grader.cli.checking import check_measured, check_photo
    from reference.errors import CallError

    if photo is not None:
        if measured is not None or page is not None or template is not None:
            raise CallError("photo_alone", "--photo goes without --measured, --page and --template")
        raise typer.Exit(1 if check_photo(assignment, n, position, photo, lang, level) else 0)
    is_off = check_measured(assignment, n, position, measured, lang, level, page, template)
    raise typer.Exit(1 if is_off else 0)


@app.command()
def demo(
    out: OutOption = Path("planmark-demo"),
    jobs: JobsOption = None,
    lang: LanguageOption = "en",
) -> None:
    """Grade the bundled samples, scans and entered measurements, and say where to look."""
    from grader.cli.grading import demo as run_demo

    run_demo(out, lang, jobs)


@app.command()
def read(
    scans: Annotated[list[Path], typer.Argument(help="Scans of one student's sheets.")],
    assignment: AssignmentOption,
    n: NumberOption = None,
    position: PositionOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the readings as JSON.")] = False,
) -> None:
    """What is read on scans, with standard errors; no grading."""
    from grader.cli.grading import read_scans

    raise typer.Exit(1 if read_scans(scans, assignment, n, position, as_json=as_json) else 0)


@app.command()
def sheet(
    assignment: AssignmentArgument,
    out: Annotated[Path, typer.Option("--out", "-o", help="The PDF file to write.")],
    roster: RosterOption = None,
    layout: Annotated[
        Path | None, typer.Option("--layout", help="Write where everything is, as JSON.")
    ] = None,
    lang: LanguageOption = "en",
    calibration: Annotated[
        bool, typer.Option("--calibration", help="Print the page that measures printer and scanner instead.")
    ] = False,
) -> None:
    """Printable A3 answer sheets of a class: markers, QR code, data, zones."""
    from grader.cli.sheets import print_sheets

    print_sheets(assignment, roster, out, layout, lang, calibration=calibration)
    if calibration:
        tell_next("calibrate", "SCAN", before="print it, scan it, then ")
    else:
        handed_in = ("--assignment", assignment, "--roster", roster, "-o", "results")
        tell_next("grade", "SCANS", *handed_in, before="print them, let them be drawn on, scan, then ")


@app.command()
def handout(
    assignment: AssignmentArgument,
    out: Annotated[Path, typer.Option("--out", "-o", help="The PDF file to write.")],
    roster: RosterOption = None,
    n: NumberOption = None,
    position: PositionOption = None,
    lang: LanguageOption = "en",
) -> None:
    """Task sheets on A4, of a class or of one --n: scheme, data, empty tables, and no solution."""
    from grader.cli.sheets import print_handout

    print_handout(assignment, roster, n, position, out, lang)


@app.command()
def calibrate(
    scans: Annotated[list[Path], typer.Argument(help="Scans of the calibration page.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print what was measured as JSON.")] = False,
    svg: Annotated[
        Path | None, typer.Option("--svg", help="Draw where the first scan's page is off, 200 times.")
    ] = None,
) -> None:
    """What printer and scanner do to millimetres, by scans of the page `sheet --calibration` prints."""
    from grader.cli.sheets import calibrate_scans

    raise typer.Exit(1 if calibrate_scans(scans, svg, as_json=as_json) else 0)


@app.command()
def match(
    folder: FolderArgument,
    assignment: AssignmentOption,
    roster: Annotated[Path, typer.Option("--roster", help="The class: roster.csv.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="The draft of the roster to write, a CSV file.")],
    pages_per_student: Annotated[int | None, typer.Option("--pages-per-student")] = None,
    lang: LanguageOption = "en",
) -> None:
    """Draft the roster's `scans` where nothing says whose page is whose, with a contact sheet."""
    from grader.cli.sheets import draft_matches

    open_ends = draft_matches(folder, assignment, roster, out, pages_per_student, lang)
    known = ("--assignment", assignment, "--roster", out, "-o", "results")
    tell_next("grade", folder, *known, before="correct the column `scans`, then ")
    raise typer.Exit(1 if open_ends else 0)


@app.command()
def bench(
    quick: Annotated[bool, typer.Option("--quick", help="One student of each class, fewer runs.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Run time against error: of the solver, and of the reading of the bundled samples."""
    from grader.cli.benchmark import show_benchmark

    show_benchmark(quick=quick, as_json=as_json)


def _platforms() -> list[str]:
    """What there are exports for, for a shell that completes it."""
    from grader.lms.export import TARGETS

    return list(TARGETS)


@app.command()
def export(
    results: ResultsArgument,
    to: Annotated[
        str,
        typer.Option(
            "--to",
            help="csv, moodle, canvas, canvas-api, openedx, google-classroom, ms-education, brightspace,"
            " blackboard, ilias, gradescope or lti.",
            autocompletion=_platforms,
        ),
    ],
    what: Annotated[
        str | None,
        typer.Option(
            "--what",
            help="grades (totals), marks (points by criterion), rubric (the criteria), feedback (the pages).",
        ),
    ] = None,
    file: Annotated[
        Path | None, typer.Option("--file", "-o", help="The file to write; OUT/export-... if absent.")
    ] = None,
    roster: RosterOption = None,
    worksheet: Annotated[
        Path | None,
        typer.Option("--worksheet", help="Moodle's downloaded offline grading worksheet, to fill in."),
    ] = None,
    gradebook: Annotated[
        Path | None,
        typer.Option(
            "--gradebook", help="The gradebook as the platform exports it (ILIAS: status.csv), to fill in."
        ),
    ] = None,
    ids: Annotated[
        Path | None,
        typer.Option("--ids", help="The platform's numbers: a CSV student_id,id[,username,participant]."),
    ] = None,
    criteria: Annotated[
        Path | None,
        typer.Option("--criteria", help="The platform's criteria: its JSON answer, or a CSV criterion,id."),
    ] = None,
    submissions: Annotated[
        Path | None,
        typer.Option("--submissions", help="The platform's answer that lists the students' submissions."),
    ] = None,
    identity: Annotated[
        str | None,
        typer.Option("--identity", help="How Moodle's gradebook knows users: idnumber, email, username, id."),
    ] = None,
    item: Annotated[
        str, typer.Option("--item", help="The grade item's, assignment's or rubric's name.")
    ] = "",
    position: PositionOption = None,
    combine: Annotated[
        str | None, typer.Option("--combine", help="Of several positions: sum or mean.")
    ] = None,
    maximum: Annotated[float | None, typer.Option("--maximum", help="The grade item's maximum.")] = None,
    rescale: Annotated[bool, typer.Option("--rescale", help="Convert points to the platform's.")] = False,
    visibility: Annotated[
        str | None,
        typer.Option("--visibility", help="Gradescope: visible, hidden, after_due_date, after_published."),
    ] = None,
    course_id: Annotated[
        str | None, typer.Option("--course-id", help="The platform's own, of the course or class.")
    ] = None,
    assignment_id: Annotated[
        str | None, typer.Option("--assignment-id", help="The platform's own, of the assignment.")
    ] = None,
    cmid: Annotated[
        int | None,
        typer.Option("--cmid", min=1, help="Moodle's number of the activity: the id in its address."),
    ] = None,
    context_id: Annotated[
        int | None, typer.Option("--context-id", min=1, help="Moodle's number of the activity's context.")
    ] = None,
    replace_guide: Annotated[
        Path | None,
        typer.Option(
            "--replace-guide",
            help="Delete the guide there: Moodle's core_grading_get_gradingform_instances tells the points.",
        ),
    ] = None,
    groups: Annotated[
        bool | None, typer.Option("--groups/--no-groups", help="Whether students hand in as groups.")
    ] = None,
    lang: LanguageOption = "en",
) -> None:
    """Write the results for a learning platform, validated before anything is written."""
    from grader.cli.exporting import export_results
    from grader.lms.grades import Options
    from reference.errors import CallError

    if worksheet is not None and (gradebook is not None or to != "moodle"):
        raise CallError("option_unused", "--worksheet is Moodle's: give it with --to moodle alone")
    if gradebook is not None and to in {"moodle", "canvas-api"}:
        raise CallError("option_unused", f"--gradebook has no meaning for {to}: leave it out")
    options = Options(
        to=to, what=what, form=worksheet or gradebook, criteria=criteria, submissions=submissions,
        identity=identity, item=item,
        position=position, combine=combine, maximum=maximum, rescale=rescale, visibility=visibility,
        course_id=course_id, assignment_id=assignment_id, cmid=cmid, context_id=context_id,
        replace_guide=replace_guide, groups=groups, lang=lang,
    )  # fmt: skip
    is_open, path = export_results(results, file, options, roster, ids)
    where = "" if to == "csv" else f" to {to}; the documentation of exports says how"
    note(f"next: {'upload' if where else 'open'} {path}{where}")
    raise typer.Exit(1 if is_open else 0)
