"""``planmark export``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from grader.cli.app import LanguageOption, PositionOption, app, check_language
from grader.cli.commands import RosterOption

if TYPE_CHECKING:
    from grader.lms.grades import Delivery, Options


@app.command()
def export(
    results: Annotated[Path, typer.Argument(metavar="OUT", help="The folder that `planmark grade` wrote.")],
    to: Annotated[str, typer.Option("--to", help="csv, moodle, canvas, gradescope or lti.")],
    what: Annotated[
        str | None,
        typer.Option(
            "--what",
            help="grades (totals), marks (points by criterion), rubric (the criteria), feedback (the pages).",
        ),
    ] = None,
    file: Annotated[
        Path | None, typer.Option("--file", help="The file to write; OUT/export-... if absent.")
    ] = None,
    roster: RosterOption = None,
    worksheet: Annotated[
        Path | None,
        typer.Option("--worksheet", help="Moodle's downloaded offline grading worksheet, to fill in."),
    ] = None,
    gradebook: Annotated[
        Path | None, typer.Option("--gradebook", help="Canvas's exported gradebook, to fill in.")
    ] = None,
    ids: Annotated[
        Path | None,
        typer.Option("--ids", help="The platform's numbers: a CSV student_id,id[,username,participant]."),
    ] = None,
    criteria: Annotated[
        Path | None,
        typer.Option("--criteria", help="The platform's criteria: its JSON answer, or a CSV criterion,id."),
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
    course_id: Annotated[int | None, typer.Option("--course-id", min=1, help="Canvas's.")] = None,
    assignment_id: Annotated[
        int | None, typer.Option("--assignment-id", min=1, help="Canvas's or Moodle's.")
    ] = None,
    cmid: Annotated[
        int | None,
        typer.Option("--cmid", min=1, help="Moodle's number of the activity: the id in its address."),
    ] = None,
    context_id: Annotated[
        int | None, typer.Option("--context-id", min=1, help="Moodle's number of the activity's context.")
    ] = None,
    lang: LanguageOption = "en",
) -> None:
    """Write the results for a learning platform, validated before anything is written."""
    from grader.lms.grades import Options
    from reference.errors import CallError

    if worksheet is not None and (gradebook is not None or to != "moodle"):
        raise CallError("option_unused", "--worksheet is Moodle's: give it with --to moodle alone")
    if gradebook is not None and to != "canvas":
        raise CallError("option_unused", "--gradebook is Canvas's: give it with --to canvas alone")
    options = Options(
        to=to, what=what, form=worksheet or gradebook, criteria=criteria, identity=identity, item=item,
        position=position, combine=combine, maximum=maximum, rescale=rescale, visibility=visibility,
        course_id=course_id, assignment_id=assignment_id, cmid=cmid, context_id=context_id, lang=lang,
    )  # fmt: skip
    raise typer.Exit(1 if _export(results, file, options, roster, ids) else 0)


def _export(
    folder: Path, file: Path | None, options: "Options", roster: Path | None, ids: Path | None
) -> bool:
    """Write the export file and report who is not in it; whether anybody is missing."""
    from dataclasses import replace

    from grader.lms.export import export as deliver
    from grader.lms.export import read_results, usual_name
    from grader.lms.grades import Person
    from grader.lms.table import with_ids
    from grader.roster import read_roster
    from reference.errors import CallError

    check_language(options.lang)
    path = file or folder / usual_name(options)
    for source in (folder / "results.json", options.form, options.criteria, roster, ids):
        if source is not None and path.resolve() == source.resolve():
            raise CallError("file_exists", f"{path}: is read for this export; name another file (--file)")
    results = read_results(folder)
    people = {}
    if roster is not None:
        people = {
            row.student_id: Person(name=row.name, email=row.email or "", lang=row.lang or "")
            for row in read_roster(roster).rows
        }
    if ids is not None:
        people = with_ids(people, ids)
    delivery = deliver(results, path, replace(options, people=people, out=folder))
    _report(delivery, path)
    return not delivery.is_complete


def _report(delivery: "Delivery", path: Path) -> None:
    is_of_students = delivery.written or delivery.withheld or delivery.unplaced
    who = f"{len(delivery.written)} students " if is_of_students else ""
    typer.echo(f"{who}written to {path}")
    for reason, students in (("withheld", delivery.withheld), ("no place in the file", delivery.unplaced)):
        for student, why in students.items():
            typer.echo(f"  {student}: {reason}: {why}")
    for note in delivery.notes:
        typer.echo(f"  note: {note}")
