"""``planmark export``."""

from pathlib import Path

import typer

from grader.cli.grading import check_language
from grader.exports import Person, export, read_results
from grader.roster import read_roster


def export_results(
    folder: Path,
    to: str,
    file: Path | None,
    *,
    roster: Path | None,
    worksheet: Path | None,
    identity: str,
    item: str,
    position: int | None,
    combine: str | None,
    maximum: float | None,
    rescale: bool,
    lang: str,
) -> bool:
    """Write the export file and tell who is not in it; whether anybody is missing."""
    check_language(lang)
    results = read_results(folder)
    people = {}
    if roster is not None:
        people = {
            row.student_id: Person(name=row.name, email=row.email or "") for row in read_roster(roster).rows
        }
    path = file or folder / f"export-{to}.csv"
    delivery = export(
        results, to, path, people=people, worksheet=worksheet, identity=identity, item=item,
        position=position, combine=combine, maximum=maximum, rescale=rescale, lang=lang,
    )  # fmt: skip
    typer.echo(f"{len(delivery.written)} students written to {delivery.path}")
    for told, students in (("withheld", delivery.withheld), ("no place in the file", delivery.not_found)):
        for student, why in students.items():
            typer.echo(f"  {student}: {told}: {why}")
    for note in delivery.notes:
        typer.echo(f"  note: {note}")
    return not delivery.is_complete
