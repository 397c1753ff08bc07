"""Exports: read the results, choose what a platform takes, validate it, write it whole or not at all."""

import math
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from grader.documents import SCHEMA_VERSION, ResultsDocument
from grader.files import create_whole, replacing, write_whole
from grader.lms import gradebooks, moodle, moodle_guide, scores
from grader.lms.api import canvas, classroom, graph, openedx
from grader.lms.assessments import documents, write_documents
from grader.lms.grades import Content, Delivery, Grade, Options, grades_of, ready
from grader.lms.table import criteria_text, not_as_meant, parsed, summary_text
from grader.records import Reason
from grader.texts.spoken import failure
from reference.authored.toml_file import findings_of
from reference.errors import CallError, InputFileError


def read_results(out_dir: Path) -> ResultsDocument:
    """`results.json` of an output folder; InputFileError where it is missing or not one."""
    path = out_dir / "results.json"
    try:
        return ResultsDocument.model_validate(_of_a_known_version(parsed(path.read_bytes()), path))
    except FileNotFoundError as error:
        raise failure(InputFileError, "results_missing", file=path) from error
    except OSError as error:
        raise failure(
            InputFileError, "results_missing", "unreadable", file=path, error=error.strerror
        ) from error
    except ValidationError as error:
        faults = tuple(findings_of(error, ResultsDocument))
        raise failure(InputFileError, "results_wrong", "no_results", faults=faults, file=path) from error
    except ValueError as error:
        raise failure(InputFileError, "results_wrong", "results_no_json", file=path, error=error) from error


def _of_a_known_version(document: Any, path: Path) -> Any:  # noqa: ANN401 - whatever a JSON file holds
    """The document; InputFileError where a later version of the program wrote it."""
    version = document.get("schema_version") if isinstance(document, dict) else None
    if isinstance(version, int) and version > SCHEMA_VERSION:
        raise failure(InputFileError, "results_newer", file=path, version=version, known=SCHEMA_VERSION)
    return document


# What can be exported -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Kind:
    """A file that a platform takes: its ending, and what makes it out of grades or else of the results."""

    ending: str
    used: frozenset[str] = frozenset()
    """The options that it heeds, besides those that all do."""
    of_grades: Callable[[list[Grade], Options], Delivery] | None = None
    of_results: Callable[[ResultsDocument], str | Content] | None = None


def _of_grades(ending: str, make: Callable[[list[Grade], Options], Delivery], options: str) -> _Kind:
    return _Kind(ending, frozenset({"position", "combine", *options.split()}), make)


KINDS: Mapping[tuple[str, str], _Kind] = {
    ("csv", "marks"): _Kind(".csv", of_results=criteria_text),
    ("csv", "grades"): _Kind(".csv", of_results=summary_text),
    ("json", "marks"): _Kind(".zip", of_results=documents),
    ("moodle", "grades"): _of_grades(".csv", moodle.grades_file, "maximum rescale form identity item"),
    ("moodle", "feedback"): _of_grades(".zip", moodle.feedback_files, "form groups"),
    ("moodle", "rubric"): _of_grades(
        ".json", moodle_guide.guide, "criteria cmid context_id replace_guide item"
    ),
    ("moodle", "marks"): _of_grades(".json", moodle_guide.fillings, "criteria assignment_id"),
    ("canvas", "grades"): _of_grades(".csv", gradebooks.grades_file, "maximum rescale form item"),
    ("canvas", "rubric"): _of_grades(".csv", canvas.rubric, "item"),
    ("canvas-api", "marks"): _of_grades(".zip", canvas.canvas_api, "item criteria course_id assignment_id"),
    ("openedx", "marks"): _of_grades(".zip", openedx.openedx, "submissions assignment_id"),
    ("google-classroom", "marks"): _of_grades(
        ".zip", classroom.google_classroom, "criteria submissions course_id assignment_id maximum rescale"
    ),
    ("ms-education", "marks"): _of_grades(
        ".zip", graph.ms_education, "item criteria submissions course_id assignment_id maximum rescale"
    ),
    ("brightspace", "grades"): _of_grades(".csv", gradebooks.grades_file, "maximum rescale form item"),
    ("blackboard", "grades"): _of_grades(".csv", gradebooks.grades_file, "maximum rescale form item"),
    ("ilias", "grades"): _of_grades(".csv", gradebooks.grades_file, "maximum rescale form"),
    ("ilias", "feedback"): _of_grades(".zip", gradebooks.feedback_files, "form"),
    ("gradescope", "marks"): _of_grades(".zip", scores.results, "visibility"),
    ("lti", "grades"): _of_grades(".json", scores.scores, "maximum rescale item"),
}
"""By platform and thing; the first thing of a platform is the default."""

_NUMBERED = {"moodle", "canvas", "canvas-api"}
"""Their ids are numbers; those of others are texts."""
TARGETS = tuple(dict.fromkeys(to for to, _ in KINDS))
_COMMON = frozenset({"to", "what", "out", "people", "titles", "lang", "called", "now"})
"""Options of every export."""


def what_of(options: Options) -> str:
    """Return the thing that is exported; CallError for an unknown target or thing."""
    known = [what for to, what in KINDS if to == options.to]
    if not known:
        raise failure(CallError, "unknown_target", to=options.to, names=TARGETS)
    if options.what is not None and options.what not in known:
        others = [to for to, what in KINDS if what == options.what and to.startswith(options.to)]
        cause, other = ("thing_elsewhere", others[0]) if others else ("unknown_thing", "")
        told = {"to": options.to, "what": options.what, "names": tuple(known), "other": other}
        raise failure(CallError, "unknown_target", cause, **told)
    return options.what or known[0]


def usual_name(options: Options) -> str:
    """The file's default name."""
    what = what_of(options)
    is_first = what == what_of(replace(options, what=None))
    return f"export-{options.to}{'' if is_first else '-' + what}{KINDS[options.to, what].ending}"


def draft(results: ResultsDocument, options: Options) -> Delivery:
    """An export before it is written; raises as `export` does."""
    what = what_of(options)
    kind = KINDS[options.to, what]
    for each in fields(options):
        is_given = getattr(options, each.name) not in (None, "", False)
        if is_given and each.name not in kind.used | _COMMON:
            cause, option = "form_unused" if each.name == "form" else "", _flag(each.name)
            raise failure(CallError, "option_unused", cause, option=option, what=f"{options.to} {what}")
    for name in ("course_id", "assignment_id"):
        value = getattr(options, name)
        if value is not None and options.to in _NUMBERED and not re.fullmatch("[1-9][0-9]*", str(value)):
            raise failure(CallError, "number", option=_flag(name), text=value, to=options.to)
    if options.maximum is not None and not (math.isfinite(options.maximum) and options.maximum > 0.0):
        raise failure(CallError, "maximum", maximum=options.maximum)
    students = tuple(dict.fromkeys(report.student_id for report in results.reports))
    if kind.of_grades is None:
        return Delivery(kind.of_results(results) if kind.of_results else "", students)
    options = replace(options, titles=results.titles, lang=options.lang or results.lang)
    grades = grades_of(results, options)
    _check_maxima(grades, options, what)
    delivery = kind.of_grades(grades, options)
    if what != "rubric":
        delivery = delivery.among(grades)
    here = {grade.student_id for grade in grades}
    others = [student for student in students if student not in here]
    why = (Reason("position_absent", {"position": options.position or 0}),)
    return replace(delivery, withheld={**delivery.withheld, **dict.fromkeys(others, why)})


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")


def _check_maxima(grades: Sequence[Grade], options: Options, what: str) -> None:
    """Points out of 10 and out of 20 are no column of one gradebook; CallError unless all are converted."""
    maxima: dict[float, list[str]] = {}
    for grade in ready(grades):
        maxima.setdefault(round(grade.max_score, 6), []).append(grade.student_id)
    is_converted = options.rescale and (options.maximum is not None or options.form is not None)
    if len(maxima) > 1 and not is_converted and what != "feedback":
        faults = [
            Reason("maximum_of", {"most_points": most, "names": tuple(students)})
            for most, students in sorted(maxima.items())
        ]
        raise failure(CallError, "maximum_differs", "maxima_differ", faults=faults)


def export(results: ResultsDocument, path: Path, options: Options) -> Delivery:
    """Write an export file, or of several files an archive; into a folder where `path` has no ``.zip``.

    Raises CallError for a call that cannot be carried out, InputFileError for a file of the platform
    or results that cannot be used, OutputError where nothing can be written. Nothing is written then.
    """
    delivery = draft(results, options)
    kind = options.to, what_of(options)
    is_again = kind == ("moodle", "grades") and options.form is not None and path.exists()
    if kind[0] == "json" and path == options.out:
        write_documents(path, results)
    elif isinstance(delivery.content, Mapping):
        if kind[1] == "feedback" and path.suffix.lower() != ".zip":
            raise failure(CallError, "archive_name", file=path, to=options.to)
        _write_files(path, delivery.content)
    else:
        write_whole(path, delivery.content)
    again = [Reason("made_before")] if is_again else []
    notes = [*delivery.notes, *again, *_similar(results, delivery.written)]
    if kind[1] == "feedback":
        notes.insert(0, Reason("archive_size", {"size_mb": path.stat().st_size / 1e6}))
    if delivery.withheld and not delivery.written and not delivery.unplaced:
        notes.insert(0, Reason("nobody_ready"))
    return replace(delivery, notes=tuple(notes))


def _similar(results: ResultsDocument, written: Sequence[str]) -> list[Reason]:
    """Notes on similar sheets among those whose grades go out."""
    pairs = [tuple(dict.fromkeys(pair.students)) for pair in results.alike]
    return [
        Reason("look_alike", {"students": students}) for students in pairs if set(students) & set(written)
    ]


# Several files ------------------------------------------------------------------------------------


def _write_files(path: Path, content: Content) -> None:
    """Write an archive where the name ends with ``.zip``, else files below a new folder; one alone as it is.

    Raises CallError for a folder that holds such a file already and for a file's name for several,
    OutputError with the system's reason.
    """
    if path.suffix.lower() == ".zip":
        write_archive(path, content)
    elif path.suffix.lower() in {".json", ".csv"}:
        if len(content) != 1:
            raise failure(CallError, "archive_name", "several_files", file=path, count=len(content))
        write_whole(path, *(_bytes(data) for data in content.values()))
    else:
        create_whole({path / name: _bytes(data).decode("utf-8") for name, data in content.items()})


def _bytes(data: bytes | Path) -> bytes:
    return data if isinstance(data, bytes) else data.read_bytes()


def write_archive(path: Path, content: Content) -> None:
    """Write an archive, one file after another: a class's pages may be a gigabyte.

    Raises OutputError where it cannot be written, or does not read back as it was meant.
    """
    with replacing(path) as temporary:
        with zipfile.ZipFile(temporary, "x", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for name, data in content.items():
                # Without a date the same files make the same archive. Unpacked, all may read it.
                entry = zipfile.ZipInfo(name)
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, _bytes(data), zipfile.ZIP_DEFLATED, 1)
        with zipfile.ZipFile(temporary) as archive:
            is_same = archive.namelist() == list(content)
            if not is_same or any(archive.read(name) != _bytes(data) for name, data in content.items()):
                raise not_as_meant()
