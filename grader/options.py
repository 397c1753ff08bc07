"""The options of commands, one record each, used by all code that offers, stores or reads them.

The command line makes its options of a record's fields, `planmark.toml` its keys, the web its bodies and
queries; the note of a run and the work itself are the record and more.
"""

from collections.abc import Collection, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, Optional, get_args, get_type_hints

from grader.language import LANGUAGES

Level = Literal["symbol", "hint", "full"]


@dataclass(frozen=True, slots=True)
class Option:
    """The way in which a field is offered.

    Attributes
    ----------
    help : what it does, in a sentence
    flags : as they are typed; ``--`` and the field's name if empty
    key : its key in `planmark.toml`, empty for none
    least, most : of a number
    longest : of a text
    choices : what a text may be, if not any
    """

    help: str
    flags: tuple[str, ...] = ()
    key: str = ""
    least: float | None = None
    most: float | None = None
    longest: int | None = None
    choices: tuple[str, ...] = ()
    metavar: str | None = None
    hidden: bool = False


def option(help_: str, *flags: str, default: Any = None, **more: Any) -> Any:  # noqa: ANN401 - as `field`
    """A field of a record that is offered as an option; its default may be `MISSING`."""
    return field(default=default, metadata={"option": Option(help_, flags, **more)})


def offered(record: type) -> list[tuple[Field[Any], Option]]:
    """The fields of a record that are offered, in their order."""
    return [(one, one.metadata["option"]) for one in fields(record) if "option" in one.metadata]


def is_record(kind: Any) -> bool:  # noqa: ANN401 - any annotation
    """Return whether it is a record that is offered as options."""
    return is_dataclass(kind) and isinstance(kind, type) and bool(offered(kind))


def taken(record: type, source: object) -> dict[str, Any]:
    """The options of a record by name, as they are in another record that has them."""
    return {one.name: getattr(source, one.name) for one, _ in offered(record)}


PRINTABLE = r"^[^\x00-\x1f\x7f]*$"
"""Texts from the web have no control characters: PostgreSQL stores no NUL, others mean nothing in a line."""


def model_of(
    name: str,
    record: type,
    base: type,
    only: Collection[str] = (),
    kinds: Mapping[Any, Any] = MappingProxyType({}),
    **more: Any,  # noqa: ANN401 - as pydantic's create_model
) -> Any:  # noqa: ANN401 - a class that is made here
    """A model of pydantic whose fields are options of a record, all of which may be left out.

    Arguments
    ---------
    base : the model's own base
    only : the names of the fields; those with a key in `planmark.toml`, by their keys, if empty
    kinds : other types for some types
    more : fields besides
    """
    from pydantic import Field, create_model  # noqa: PLC0415 - the command line needs none

    types, made = get_type_hints(record), dict[str, Any]()
    for one, told in offered(record):
        if one.name in only or (told.key and not only):
            kind = next(
                (part for part in get_args(types[one.name]) if part is not type(None)), types[one.name]
            )
            kind = Literal[told.choices] if told.choices else kinds.get(kind, kind)
            is_text = kind is str and told.longest
            bounds = Field(
                ge=told.least, le=told.most, max_length=told.longest, pattern=PRINTABLE if is_text else None
            )
            field_ = Field(default=None, description=told.help)
            made[one.name if only else told.key] = (Optional[Annotated[kind, bounds]], field_)  # noqa: UP045
    return create_model(name, __base__=base, **made, **more)


def _lang(help_: str = "Language of feedback: en, ro or ru.", default: str | None = "en") -> Any:  # noqa: ANN401
    return option(help_, default=default, key="language", choices=LANGUAGES)


def _jobs() -> Any:  # noqa: ANN401 - as above
    return option("Number of processes (default: all processors).", least=1)


def _port(default: int) -> Any:  # noqa: ANN401 - as above
    return option("Port; 0 takes any free one.", default=default, least=0, most=65535)


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonOptions:
    """The options of every command; a record of its own may have another `lang`."""

    lang: str = _lang("Language of messages and of what is written: en, ro or ru.")
    quiet: bool = option(
        "Print only results and what needs a person, no progress.", "--quiet", "-q", default=False
    )
    verbose: bool = option("Also print the log.", "--verbose", "-v", default=False)
    log: Path | None = option("Append to this file: times, versions, each submission's outcome, tracebacks.")


# A variant ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class VariantOptions:
    """The choice of a variant."""

    n: int | None = option("The student's number, if the data depend on it.")
    position: int | None = option("The position, if the assignment has any.")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanOptions(VariantOptions):
    """The options of ``planmark plan``."""

    crank_mm: float | None = option("Drawn length of the crank, mm; the scales follow.")
    as_json: bool = option("Print the plan as JSON.", "--json", default=False)
    svg: Path | None = option("Draw the plan into this SVG file.")
    pdf: Path | None = option("Draw the plan into this PDF file; with --all the tables too.")
    steps: Path | None = option("Write the construction step by step: .html, .pdf or .txt; - prints it.")
    altitude: bool = option(
        "Draw normal components by right triangles on the mechanism too.", "--altitude", default=False
    )
    every: bool = option("All variants, for the instructor's own records.", "--all", default=False)
    csv: Path | None = option("With --all: a table for spreadsheets, a row per variant.")
    drawings: bool = option(
        "With --all --pdf: a drawing of each variant too.", "--drawings/--no-drawings", default=True
    )
    lang: str = _lang()

    @property
    def drawn(self) -> tuple[Path, ...]:
        """The files that a plan is drawn into."""
        return tuple(file for file in (self.svg, self.pdf, self.steps) if file is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class CycleOptions(VariantOptions):
    """The options of ``planmark cycle``."""

    of: list[str] | None = option(
        "Quantities: v_B, a_B, v_BA, a_BA, a_BA_n (with _x or _y a component), omega_3, epsilon_3, D (the"
        " path of point D); several with commas. All speeds and accelerations if absent."
    )
    samples: int = option("Positions over the cycle.", default=361)
    csv: Path | None = option("Write every position to this CSV file.")
    svg: Path | None = option("Draw the diagram into this SVG file.")
    pdf: Path | None = option("Draw the diagram into this PDF file.")
    lang: str = _lang()


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckOptions(VariantOptions):
    """The options of ``planmark check``."""

    measured: Path | None = option("Measurement file, CSV or JSON.")
    photo: Path | None = option("Photo or scan of the drawn sheet, instead of measurements.")
    lang: str = _lang()
    level: Level = option("symbol (right or off), hint (how it is off), full (numbers).", default="hint")
    page: Path | None = option("Also write the result to this HTML file.")
    template: Path | None = option("Write the CSV file to fill in.")


# Grading ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassOptions:
    """Options that stay the same whenever a class is graded again: a run's note keeps it."""

    roster: Path | None = option("The class: roster.csv.", key="roster")
    pages_per_student: int | None = option("Of one class file, in the roster's order.", key="pages", least=1)
    lang: str = _lang()
    level: Level = option("Feedback for students: symbol, hint, or full (with the answers).", default="full")
    with_ghosts: bool = option(
        "With --level full: draw expected vectors, dotted.", "--ghosts/--no-ghosts", default=True
    )
    decisions: Path | None = option("File of decisions (default: decisions.csv in the folder).")


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeOptions(ClassOptions):
    """The options of ``planmark grade``."""

    jobs: int | None = _jobs()
    time_limit: float = option("Time limit for a file or a sheet, seconds.", default=60.0, least=1.0)
    memory_limit: int = option("Memory limit for a file or a sheet, megabytes.", default=1500, least=300)
    watch: bool = option("Also grade new files in the folder, until Ctrl+C.", "--watch", default=False)
    every: float = option("With --watch: seconds between two checks.", default=5.0, least=0.1)
    cluster: str | None = option(
        "Scheduler of a Dask cluster that does the work; FOLDER may be s3://bucket/class then.",
        metavar="ADDRESS",
    )
    to: str | None = option("The platform, for the line on what is next.", key="platform", hidden=True)


# Exports ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportOptions:
    """Options of an export; None or empty if not given."""

    to: str = option(
        "csv, json, moodle, canvas, canvas-api, openedx, google-classroom, ms-education, brightspace,"
        " blackboard, ilias, gradescope or lti.",
        default=MISSING,
        key="platform",
    )
    what: str | None = option(
        "grades (totals), marks (points by criterion), rubric (the criteria), feedback (the pages).",
        longest=20,
    )
    criteria: Path | None = option("The platform's criteria: its JSON answer, or a CSV criterion,id.")
    submissions: Path | None = option("The platform's answer that lists the students' submissions.")
    identity: str | None = option("How Moodle's gradebook knows users: idnumber, email, username, id.")
    item: str = option(
        "The grade item's, assignment's or rubric's name; the assignment's id if absent.",
        default="",
        longest=200,
    )
    position: int | None = option("The position, where there are some.")
    combine: str | None = option("Of several positions: sum or mean.", longest=20)
    maximum: float | None = option("The grade item's maximum.")
    rescale: bool = option("Convert points to the platform's.", "--rescale", default=False)
    visibility: str | None = option("Gradescope: visible, hidden, after_due_date, after_published.")
    course_id: str | None = option("The platform's ID of the course or class.", longest=200)
    assignment_id: str | None = option("The platform's ID of the assignment.", longest=200)
    cmid: int | None = option("Moodle's number of the activity: the id in its address.", least=1)
    context_id: int | None = option("Moodle's number of the activity's context.", least=1)
    replace_guide: Path | None = option(
        "Delete the guide there: Moodle's core_grading_get_gradingform_instances tells the points."
    )
    groups: bool | None = option("Whether students hand in as groups.", "--groups/--no-groups")
    lang: str | None = _lang("Language of comments: en, ro or ru (default: as graded).", None)


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportCall(ExportOptions):
    """The options of ``planmark export``: an export's, and the files that it reads and writes."""

    file: Path | None = option("The file to write; OUT/export-... if absent.", "--file", "-o")
    roster: Path | None = option("The class: roster.csv.", key="roster")
    worksheet: Path | None = option("Moodle's downloaded offline grading worksheet, to fill in.")
    gradebook: Path | None = option(
        "The gradebook as the platform exports it (ILIAS: status.csv), to fill in."
    )
    ids: Path | None = option("The platform's numbers: a CSV student_id,id[,username,participant].")


@dataclass(frozen=True, slots=True, kw_only=True)
class SendOptions:
    """The options of ``planmark send``."""

    site: str | None = option("The platform's address: https://NAME.")
    yes: bool = option("Send; without it nothing is sent, only told.", "--yes", default=False)
    allow_http: bool = option(
        "Also send without https: others can read the token on its way.", "--allow-http", default=False
    )


# On the web ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class PublicationOptions:
    """Settings of a publication by an instructor; None leaves one as it is."""

    title: str | None = option("as students see it", longest=120)
    term: str | None = option("of which all publications can be deleted at once", longest=40)
    assignment: str | None = option("a built-in name, or an uploaded file's", longest=120)
    lang: str | None = option("of the pages of feedback", choices=LANGUAGES)
    level: str | None = option("of hints; students are never told the answers", choices=("symbol", "hint"))
    attempts: int | None = option(
        "allowed for each student and variant; 0 allows any number", least=0, most=1000
    )
    pages_per_student: int | None = option(
        "of one class file in the roster's order; 0 where pages are told otherwise", least=0, most=20
    )
    is_open: bool | None = option("whether students may check")
    is_released: bool | None = option("whether students see their feedback")
    takes_sheets: bool | None = option("whether students may hand in sheets")
    deadline: str | None = option(
        "until when: 2026-12-01T23:59, in the server's time where no zone is given; empty for none",
        longest=40,
    )
    release_at: str | None = option("from when released feedback is seen, as the deadline", longest=40)


# Servers ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ReviewOptions:
    """The options of ``planmark review``."""

    host: str = option("Address to listen on; other machines need the --token, too.", default="127.0.0.1")
    token: str = option("Secret required in the address: at least 8 characters.", default="")
    port: int = _port(8321)
    jobs: int | None = _jobs()
    lang: str | None = _lang("Language of the page: en, ro or ru (default: as graded).", None)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeOptions:
    """The options of ``planmark serve``."""

    host: str = option("Address to listen on; 0.0.0.0 admits other machines.", default="127.0.0.1")
    port: int = _port(8000)
    address: str | None = option("The address that students use: https://NAME.")
    database: str | None = option("postgresql+psycopg://... (default: SQLite in the folder).")
    mail: str | None = option("Mail server for links to new passwords: smtps://USER@HOST/SENDER.")
    jobs: int | None = _jobs()
