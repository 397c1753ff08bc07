"""``planmark export``."""

from dataclasses import replace
from pathlib import Path

import typer

from grader.cli.app import check_language
from grader.inputs.roster import read_roster
from grader.lms.export import export as deliver
from grader.lms.export import read_results, usual_name
from grader.lms.grades import Delivery, Options, Person
from grader.lms.table import with_ids
from reference.errors import CallError


def export_results(
    folder: Path, file: Path | None, options: Options, roster: Path | None, ids: Path | None
) -> bool:
    """Write the export file and report who is not in it; whether anybody is missing."""
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


def _report(delivery: Delivery, path: Path) -> None:
    is_of_students = delivery.written or delivery.withheld or delivery.unplaced
    who = f"{len(delivery.written)} students " if is_of_students else ""
    typer.echo(f"{who}written to {path}")
    for reason, students in (("withheld", delivery.withheld), ("no place in the file", delivery.unplaced)):
        for student, why in students.items():
            typer.echo(f"  {student}: {reason}: {why}")
    for note in delivery.notes:
        typer.echo(f"  note: {note}")
