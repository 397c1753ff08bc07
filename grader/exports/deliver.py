"""One door for all exports: read the results, choose, validate, write."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from pydantic import ValidationError

from grader.documents import ResultsDocument
from grader.exports.comments import comment
from grader.exports.grades import Grade, Person, grades_of
from grader.exports.moodle_gradebook import gradebook_text
from grader.exports.summary import criteria_text
from grader.exports.worksheet import fill
from grader.files import write_whole
from reference.errors import CallError, InputFileError

Target = Literal["csv", "moodle"]
TARGETS: tuple[Target, ...] = ("csv", "moodle")

_NOBODY: Mapping[str, Person] = {}


@dataclass(frozen=True, slots=True)
class Delivery:
    """What was written, and who is not in it.

    Attributes
    ----------
    written : students with a grade in the file
    withheld : students without one, with why (they wait for a person, or handed in nothing)
    not_found : students whom the file has no place for, with why
    notes : what the person who uploads it should know
    """

    path: Path
    written: tuple[str, ...]
    withheld: Mapping[str, str] = field(default_factory=dict)
    not_found: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def is_complete(self) -> bool:
        """Whether everybody's grade is in the file."""
        return not self.withheld and not self.not_found


def read_results(out_dir: Path) -> ResultsDocument:
    """`results.json` of an output folder; InputFileError where it is missing or not one."""
    path = out_dir / "results.json"
    try:
        return ResultsDocument.model_validate_json(path.read_bytes())
    except FileNotFoundError as error:
        raise InputFileError(
            "results_missing", f"{path}: there is no such file; run planmark grade first"
        ) from error
    except OSError as error:
        raise InputFileError("results_missing", f"{path}: cannot be read ({error.strerror})") from error
    except (ValidationError, json.JSONDecodeError) as error:
        first = str(error).splitlines()
        raise InputFileError(
            "results_wrong", f"{path}: is not a planmark results file ({' '.join(first[:3])}); grade again"
        ) from error


def export(  # noqa: PLR0913 - an option each of the command
    results: ResultsDocument,
    to: str,
    path: Path,
    *,
    people: Mapping[str, Person] = _NOBODY,
    worksheet: Path | None = None,
    identity: str = "idnumber",
    item: str = "",
    position: int | None = None,
    combine: str | None = None,
    maximum: float | None = None,
    rescale: bool = False,
    lang: str = "en",
) -> Delivery:
    """Write an export file.

    Arguments
    ---------
    to : ``csv`` (a row per criterion) or ``moodle``: the gradebook import file, or with `worksheet`
        the teacher's downloaded offline grading worksheet, filled in
    people : names and addresses by student_id, from the roster
    identity : how the gradebook file names users: idnumber (the student_id), email, username, id
    item : the grade item's name in the gradebook; the assignment's id where empty
    position, combine : which of a student's positions counts, or ``sum`` or ``mean`` of all
    maximum, rescale : the grade item's maximum, and leave to convert to it
    lang : of the feedback comments' few words of their own

    Raises CallError for a call that cannot be carried out, InputFileError for a worksheet that Moodle
    would not take, OutputError where the file cannot be written. Nothing is written then.
    """
    if to == "csv":
        write_whole(path, criteria_text(results))
        return Delivery(path, tuple(dict.fromkeys(report.student_id for report in results.reports)))
    if to != "moodle":
        raise CallError("unknown_target", f"'{to}' is no export target: known are {', '.join(TARGETS)}")
    grades = grades_of(results, position=position, combine=combine)
    comments = {grade.student_id: comment(grade.reports, lang) for grade in grades}
    if worksheet is not None:
        return _worksheet(grades, people, comments, worksheet, path, rescale=rescale)
    text = gradebook_text(
        grades,
        people,
        identity=identity,
        item=item or results.assignment,
        maximum=maximum,
        rescale=rescale,
        comments=comments,
    )
    write_whole(path, text)
    written = tuple(grade.student_id for grade in grades if grade.score is not None)
    return Delivery(path, written, _withheld(grades))


def _worksheet(
    grades: list[Grade],
    people: Mapping[str, Person],
    comments: Mapping[str, str],
    worksheet: Path,
    path: Path,
    *,
    rescale: bool,
) -> Delivery:
    try:
        data = worksheet.read_bytes()
    except OSError as error:
        raise InputFileError("worksheet", f"{worksheet}: cannot be read ({error.strerror})") from error
    filled = fill(data, worksheet.name, grades, people, comments, rescale=rescale)
    write_whole(path, filled.data)
    missing = dict(filled.not_found)
    missing.update(dict.fromkeys(filled.locked, "Moodle says that this grade cannot be changed"))
    return Delivery(path, filled.written, _withheld(grades), missing, filled.notes)


def _withheld(grades: list[Grade]) -> dict[str, str]:
    return {grade.student_id: grade.withheld for grade in grades if grade.score is None}
