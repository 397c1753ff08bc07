"""One door for all exports: read the results, choose, validate, write."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pydantic import ValidationError

from grader.documents import ResultsDocument
from grader.files import write_whole
from grader.lms import (
    canvas_gradebook,
    canvas_rubric,
    gradescope,
    lti,
    moodle_feedback,
    moodle_gradebook,
    moodle_guide,
    moodle_worksheet,
)
from grader.lms.archive import write_files
from grader.lms.comments import comment
from grader.lms.draft import Draft, ready
from grader.lms.faults import faults_of, in_a_row, listed
from grader.lms.grades import Grade, grades_of
from grader.lms.options import TARGETS, Options
from grader.lms.summary import criteria_text, summary_text
from grader.versions import current
from reference.errors import CallError, InputFileError


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
        return ResultsDocument.model_validate(current(json.loads(path.read_bytes()), str(path)))
    except FileNotFoundError as error:
        raise InputFileError(
            "results_missing", f"{path}: there is no such file; run planmark grade first"
        ) from error
    except OSError as error:
        raise InputFileError("results_missing", f"{path}: cannot be read ({error.strerror})") from error
    except ValidationError as error:
        raise InputFileError(
            "results_wrong", f"{path}: is not a planmark results file; grade again{listed(faults_of(error))}"
        ) from error
    except (ValueError, RecursionError) as error:
        raise InputFileError("results_wrong", f"{path}: is not JSON ({error}); grade again") from error


# What there is to deliver -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Kind:
    """A file that a platform takes: what makes it, its ending, the options that it heeds."""

    draft: Callable[[ResultsDocument, Options], Draft]
    ending: str
    used: frozenset[str]


_POSITION = frozenset({"position", "combine"})
_MAXIMUM = frozenset({"maximum", "rescale"})


def _of_grades(
    draft: Callable[[list[Grade], Options], Draft],
) -> Callable[[ResultsDocument, Options], Draft]:
    """A draft of results by one of grades; who has no such position is withheld, too."""

    def of_results(results: ResultsDocument, options: Options) -> Draft:
        grades = grades_of(results, position=options.position, combine=options.combine)
        _check_maxima(grades, options)
        drafted = draft(grades, options)
        here = {grade.student_id for grade in grades}
        others = dict.fromkeys(
            (one.student_id for one in results.reports if one.student_id not in here),
            f"has no position {options.position}",
        )
        return replace(drafted, withheld={**drafted.withheld, **others})

    return of_results


def _check_maxima(grades: Sequence[Grade], options: Options) -> None:
    """Points out of 10 and out of 20 are no column of one gradebook; CallError unless all are converted."""
    maxima: dict[float, list[str]] = {}
    for grade in ready(grades):
        maxima.setdefault(round(grade.max_score, 6), []).append(grade.student_id)
    is_converted = options.rescale and (options.maximum is not None or options.form is not None)
    if len(maxima) > 1 and not is_converted and what_of(options) != "feedback":
        told = [f"{most:g}: {in_a_row(students)}" for most, students in sorted(maxima.items())]
        raise CallError(
            "maximum_differs",
            "students' maxima differ: choose one position, combine them by mean, or convert all to one"
            f" maximum (--maximum and --rescale, where the platform is given grades){listed(told)}",
        )


def _table(text: Callable[[ResultsDocument], str]) -> Callable[[ResultsDocument, Options], Draft]:
    """A plain table of everything."""
    return lambda results, _: Draft(
        text(results), tuple(dict.fromkeys(report.student_id for report in results.reports))
    )


def _moodle_grades(grades: list[Grade], options: Options) -> Draft:
    if options.form is None:
        return moodle_gradebook.gradebook(grades, options)
    for name in ("item", "identity", "maximum"):
        if getattr(options, name) is not None and getattr(options, name) != "":
            raise CallError("option_unused", f"--{name} has no meaning beside --worksheet: leave it out")
    comments = {
        grade.student_id: comment(grade.reports, options.lang_of(grade.student_id)) for grade in ready(grades)
    }
    return moodle_worksheet.fill(_bytes(options.form), options.form.name, grades, options, comments)


def _moodle_feedback(grades: list[Grade], options: Options) -> Draft:
    worksheet = None if options.form is None else _bytes(options.form)
    return moodle_feedback.feedback_files(grades, options, worksheet)


def _canvas_grades(grades: list[Grade], options: Options) -> Draft:
    if options.form is None:
        return canvas_gradebook.gradebook(grades, options)
    if options.maximum is not None:
        raise CallError("option_unused", "--maximum has no meaning beside --gradebook: it states its own")
    return canvas_gradebook.fill(_bytes(options.form), options.form.name, grades, options)


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputFileError("form_missing", f"{path}: cannot be read ({error.strerror})") from error


KINDS: Mapping[tuple[str, str], _Kind] = {
    ("csv", "marks"): _Kind(_table(criteria_text), ".csv", frozenset()),
    ("csv", "grades"): _Kind(_table(summary_text), ".csv", frozenset()),
    ("moodle", "grades"): _Kind(
        _of_grades(_moodle_grades), ".csv", _POSITION | _MAXIMUM | {"form", "identity", "item"}
    ),
    ("moodle", "feedback"): _Kind(_of_grades(_moodle_feedback), ".zip", _POSITION | {"form"}),
    ("moodle", "rubric"): _Kind(
        _of_grades(moodle_guide.guide), ".json", _POSITION | {"criteria", "cmid", "context_id", "item"}
    ),
    ("moodle", "marks"): _Kind(
        _of_grades(moodle_guide.fillings), ".json", _POSITION | {"criteria", "assignment_id"}
    ),
    ("canvas", "grades"): _Kind(_of_grades(_canvas_grades), ".csv", _POSITION | _MAXIMUM | {"form", "item"}),
    ("canvas", "rubric"): _Kind(_of_grades(canvas_rubric.rubric), ".csv", _POSITION | {"item"}),
    ("canvas", "marks"): _Kind(
        _of_grades(canvas_rubric.assessments), ".json", _POSITION | {"criteria", "course_id", "assignment_id"}
    ),
    ("gradescope", "marks"): _Kind(_of_grades(gradescope.results), ".zip", _POSITION | {"visibility"}),
    ("lti", "grades"): _Kind(_of_grades(lti.scores), ".json", _POSITION | _MAXIMUM),
}
"""By platform and what; a platform's first is what it is given where nothing is said."""


_AGAIN = (
    "this file was made before: if Moodle has it already, it skips what it holds, unless the worksheet was"
    " downloaded afresh or the box for updating records is ticked at the upload"
)


def what_of(options: Options) -> str:
    """What is delivered; CallError for a target or a thing that there is not."""
    if options.to not in TARGETS:
        raise CallError(
            "unknown_target", f"'{options.to}' is no export target: known are {', '.join(TARGETS)}"
        )
    known = [what for to, what in KINDS if to == options.to]
    if options.what is not None and options.what not in known:
        raise CallError(
            "unknown_target", f"{options.to} is given no '{options.what}': known are {', '.join(known)}"
        )
    return options.what or known[0]


def usual_name(options: Options) -> str:
    """The file's name where nobody gives one."""
    what = what_of(options)
    is_first = next(key for key in KINDS if key[0] == options.to) == (options.to, what)
    return f"export-{options.to}{'' if is_first else '-' + what}{KINDS[options.to, what].ending}"


def export(results: ResultsDocument, path: Path, options: Options) -> Delivery:
    """Write an export file, or of several files an archive; into a folder where `path` has no ``.zip``.

    Raises CallError for a call that cannot be carried out, InputFileError for a file of the platform
    or results that cannot be used, OutputError where nothing can be written. Nothing is written then.
    """
    what = what_of(options)
    kind = KINDS[options.to, what]
    options.refuse_unused(kind.used, f"{options.to} {what}")
    if options.maximum is not None and not (math.isfinite(options.maximum) and options.maximum > 0.0):
        raise CallError("maximum", f"a grade's maximum is a positive number, not {options.maximum:g}")
    draft = kind.draft(results, options)
    is_again = options.to == "moodle" and options.form is not None and what == "grades" and path.exists()
    if isinstance(draft.content, Mapping):
        if (options.to, what) == ("moodle", "feedback") and path.suffix.lower() != ".zip":
            raise CallError("archive_name", f"{path}: Moodle takes an archive; let its name end with .zip")
        write_files(path, draft.content)
    else:
        write_whole(path, draft.content)
    notes = (*draft.notes, *([_AGAIN] if is_again else []))
    if what == "feedback":
        notes = (f"{path.stat().st_size / 1e6:.1f} MB: the site's upload limit must allow it", *notes)
    if draft.withheld and not draft.written:
        notes = ("nobody has a grade yet: there is nothing to upload", *notes)
    notes = (*notes, *_alike(results, draft.written))
    return Delivery(path, draft.written, draft.withheld, draft.not_found, notes)


def _alike(results: ResultsDocument, written: Sequence[str]) -> list[str]:
    """Sheets that look alike among those whose grades go out."""
    found = [list(dict.fromkeys(one.students)) for one in results.alike]
    return [
        f"the sheets of {' and '.join(students)} look alike: look at them before their grades are out"
        for students in found
        if set(students) & set(written)
    ]
