"""Students' feedback pages as the archive that Moodle's *Upload multiple feedback files* takes.

A folder `Participant_<n>_assignfeedback_file` for each student. Underscores part a folder's name into
what Moodle reads, so a file's own name has none.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from grader.lms.draft import Draft, ready, withheld
from grader.lms.faults import listed
from grader.lms.grades import Grade
from grader.lms.moodle_worksheet import LOCKED, open_worksheet
from grader.lms.options import Options
from reference.errors import CallError, InputFileError

FEEDBACK_FILES = ("feedback.html", "feedback.pdf")
"""The page must be there; the PDF may."""


def feedback_files(grades: Sequence[Grade], options: Options, worksheet: bytes | None) -> Draft:
    """The archive's files.

    `worksheet` is the teacher's: it says which number Moodle gave each participant; without it the
    table of ids must.

    Raises CallError where nothing tells the numbers, InputFileError for pages that are missing or of
    another run.
    """
    told = ready(grades)
    notes: list[str] = []
    numbers, missing = _numbers(grades, options, worksheet, notes)
    missing = {grade.student_id: missing[grade.student_id] for grade in told if grade.student_id in missing}
    files: dict[str, Path] = {}
    faults: list[str] = []
    for grade in told:
        if grade.student_id in numbers:
            folder = f"Participant_{numbers[grade.student_id]}_assignfeedback_file"
            files.update(_pages(grade, options.out or Path(), folder, faults))
    if faults:
        raise InputFileError(
            "feedback_missing", f"not all feedback is there; grade again, nothing was written{listed(faults)}"
        )
    if missing and not files:
        raise CallError("nothing_to_export", f"no student has a number in Moodle{listed(_lines(missing))}")
    return Draft(
        files,
        tuple(grade.student_id for grade in told if grade.student_id in numbers),
        withheld=withheld(grades),
        not_found=missing,
        notes=(
            "upload grades before feedback files: they make Moodle take a worksheet for outdated",
            *notes,
        ),
    )


def _lines(missing: Mapping[str, str]) -> list[str]:
    return [f"{student}: {why}" for student, why in missing.items()]


def _numbers(
    grades: Sequence[Grade], options: Options, worksheet: bytes | None, notes: list[str]
) -> tuple[dict[str, int], dict[str, str]]:
    """Moodle's number of each participant, and why others have none; what to look at goes to `notes`."""
    people = {grade.student_id: options.person(grade.student_id) for grade in grades}
    if worksheet is None:
        numbers = {one: who.participant for one, who in people.items() if who.participant is not None}
        if all(who.participant is None for who in options.people.values()):
            raise CallError(
                "worksheet_needed",
                "Moodle's numbers of participants are needed: give the downloaded grading worksheet"
                " (--worksheet), or a table with the columns student_id,participant (--ids)",
            )
        return numbers, {one: "the table of ids has no participant" for one in people if one not in numbers}
    sheet = open_worksheet(worksheet, options.form.name if options.form else "worksheet")
    found = sheet.whose({**options.people, **people})
    numbers, missing = {}, {one: why for one, why in found.missing.items() if one in people}
    for student in people:
        row = found.rows.get(student)
        participant = None if row is None else sheet.participant(row)
        if row is not None and sheet.is_locked(row):
            missing[student] = LOCKED
        elif participant is not None:
            numbers[student] = participant
    notes.extend(found.notes_on([one.student_id for one in ready(grades) if one.student_id in numbers]))
    return numbers, missing


def _pages(grade: Grade, out: Path, folder: str, faults: list[str]) -> Iterator[tuple[str, Path]]:
    """A student's pages by their names in the archive; what is missing or of another run goes to `faults`."""
    for report, where in zip(grade.reports, grade.folders, strict=True):
        before = "" if len(grade.reports) == 1 else f"position-{where.rpartition('/')[2]}-"
        try:
            own = json.loads((out / where / "report.json").read_bytes())
            if (own["status"], own["score"]) != (report.status, report.score):
                faults.append(f"{grade.student_id}: {out / where} holds another result than results.json")
        except (OSError, ValueError, KeyError, TypeError) as error:
            faults.append(f"{grade.student_id}: {out / where}: {getattr(error, 'strerror', None) or error}")
        page, *printable = (out / where / name for name in FEEDBACK_FILES)
        if not page.is_file():
            faults.append(f"{grade.student_id}: {page} is not there")
        for file in (page, *printable):
            if file.is_file():
                yield f"{folder}/{before}{file.name}", file
