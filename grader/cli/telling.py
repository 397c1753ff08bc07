"""What the terminal says of a graded class."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import typer

from grader.documents import AlikeDocument, MovedDocument, ResultsDocument
from grader.feedback.class_page import CAUSES, SIGNS
from grader.feedback.statistics import waiting
from grader.moved import told_standing

SHOWN = 12
CRITERIA = 4
"""Criteria named of each student whose marks moved."""


def tell_class(results: ResultsDocument, out: Path) -> None:
    """States, what moved, what looks alike, what waits for a person, and where everything is."""
    states = Counter(report.status for report in results.reports)
    told = ", ".join(f"{count} {state.replace('_', ' ')}" for state, count in states.most_common())
    typer.echo(f"{len(results.reports)} submissions: {told or 'none'}")
    page = out / "index.html"
    _list(f"Moved since the last run: {len(results.moved)}", [_moved(one) for one in results.moved], page)
    _list(
        "Look alike (no accusation; hold both beside each other):",
        [_alike(one) for one in results.alike],
        page,
    )
    _list("A person must look at:", list(_waiting(results)), page)
    typer.echo(f"Look at {page}; for programs there is {out / 'results.json'}")


def _list(title: str, lines: Sequence[str], page: Path) -> None:
    if lines:
        typer.echo(title)
        for line in lines[:SHOWN]:
            typer.echo(f"  {line}")
        if len(lines) > SHOWN:
            typer.echo(f"  ... and {len(lines) - SHOWN} more, all in {page}")


def _waiting(results: ResultsDocument) -> Iterator[str]:
    """What matches nobody, then that first which one look decides most of, then what is missing."""
    for one in results.unmatched:
        yield f"{one.file}{'' if one.page is None else f'#{one.page}'}: {one.message}"
    for wait in waiting(results):
        report = results.reports[wait.index]
        count = f"{len(wait.criteria)} {'criterion' if len(wait.criteria) == 1 else 'criteria'}"
        about = f", {count}, {wait.points:.4g} points at stake" if wait.criteria else ""
        problem = f"; {report.problems[0].message}" if report.problems else ""
        who = _who(report.student_id, report.position)
        yield f"{who}: {report.status.replace('_', ' ')}{about}{problem}"
    for report in results.reports:
        if report.status == "missing":
            problem = f"; {report.problems[0].message}" if report.problems else ""
            yield f"{_who(report.student_id, report.position)}: missing{problem}"


def _moved(one: MovedDocument) -> str:
    """A student's standing before and now, why, and the criteria."""
    parts = [f"{told_standing(one.before)} -> {told_standing(one.after)}"]
    if one.before is not None and one.after is not None:
        parts += [", ".join(CAUSES[cause] for cause in one.why)]
    criteria = [
        f"{each.id} {(each.before or '-').replace('_', ' ')} -> {(each.after or '-').replace('_', ' ')}"
        for each in one.criteria[:CRITERIA]
    ]
    more = len(one.criteria) - CRITERIA
    parts += [", ".join([*criteria, *([f"{more} more"] if more > 0 else [])])]
    return f"{_who(one.student_id, one.position)}: {'; '.join(part for part in parts if part)}"


def _alike(one: AlikeDocument) -> str:
    who = ", ".join(_who(*key) for key in zip(one.students, one.positions, strict=True))
    chance = "" if one.measure is None else f" ({one.measure:.1g} such pairs by chance)"
    return f"{who}: {'; '.join(SIGNS[sign] for sign in one.why)}{chance}"


def _who(student: str, position: int | None) -> str:
    return student if position is None else f"{student}, position {position}"
