"""A grade for each student, or the reason why there is none yet; options and result of an export."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from grader.documents import ReportDocument, ResultsDocument
from grader.files import result_folders
from grader.language import Tongue
from grader.options import ExportOptions
from grader.records import Reason, Value
from grader.tables.reader import refused_id
from grader.tables.roster import read_roster
from grader.texts.spoken import AND_MORE, ENGLISH, failure
from reference.errors import CallError, InputFileError

Content = Mapping[str, bytes | Path]
"""Names, and the content of each: bytes, or a file that is read when it is written."""
COMBINE = ("sum", "mean")


@dataclass(frozen=True, slots=True)
class Person:
    """A student as platforms know one; what is not known is empty.

    Attributes
    ----------
    platform_id : the platform's own number or name of the student
    participant : number in the assignment's worksheet
    lang : language of the feedback
    """

    name: str = ""
    email: str = ""
    username: str = ""
    platform_id: str = ""
    participant: int | None = None
    lang: str = ""


def people_of(roster: Path) -> dict[str, Person]:
    """The students of a roster; raises AuthoredFileError for one with faults."""
    return {
        row.student_id: Person(name=row.name, email=row.email or "", lang=row.lang or "")
        for row in read_roster(roster).rows
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Options(ExportOptions):
    """An export's options, and what they lead to.

    Attributes
    ----------
    out : the folder of results; only ``feedback`` needs it
    people : names, addresses and the platform's numbers by student_id
    titles : the criteria's, in the language of the class, by id; `export` takes them from the results
    form : the platform's own file to fill in: Moodle's worksheet, an exported gradebook
    called : what people call that file, where it is stored under another name
    now : time of the export; the clock's if None
    """

    out: Path | None = None
    people: Mapping[str, Person] = field(default_factory=lambda: MappingProxyType({}))
    titles: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    form: Path | None = None
    called: str = ""
    now: datetime | None = None

    @property
    def form_name(self) -> str:
        """The name of the platform's own file, as messages have it."""
        return self.called or (self.form.name if self.form is not None else "")

    @property
    def moment(self) -> datetime:
        """The time of the export, with its zone."""
        return self.now or datetime.now(UTC)


@dataclass(frozen=True, slots=True)
class Grade:
    """A student's grade.

    Attributes
    ----------
    score : None where there is none yet
    person : the student, with the language of the comments
    withheld : why there is none yet: of each position that is open
    folders : of each report below the results: the student's, with several positions one for each
    """

    student_id: str
    score: float | None
    max_score: float
    reports: tuple[ReportDocument, ...]
    person: Person = Person()
    withheld: tuple[Reason, ...] = ()
    folders: tuple[str, ...] = ()

    @property
    def assignment(self) -> str:
        """The assignment's id."""
        return self.reports[0].assignment

    def out_of(self, maximum: float | None, *, rescale: bool, file: str = "") -> float:
        """The score out of a platform's maximum, which a `file` may say; None is the rubric's own.

        Raises CallError where the maxima differ and nobody asked for rescaling: a silent 9 of 10 would
        become a 9 of 100.
        """
        score = self.score or 0.0
        if maximum is None or abs(maximum - self.max_score) <= 1e-6 * max(1.0, maximum):
            return score
        if not rescale:
            cause = "maximum_in_file" if file else ""
            raise failure(CallError, "maximum_differs", cause, there=maximum, here=self.max_score, file=file)
        return score * maximum / self.max_score


@dataclass(frozen=True, slots=True)
class Delivery:
    """An export's content, and the students who are not in it.

    Attributes
    ----------
    content : the file's; of several files by their names, for an archive or a folder
    written : students with a grade in it
    withheld : students without one, with why (they wait for a person, or handed in nothing)
    unplaced : students for whom the platform's file has no place, with why
    notes : what the person who uploads it should know
    """

    content: str | bytes | Content
    written: tuple[str, ...] = ()
    withheld: Mapping[str, tuple[Reason, ...]] = field(default_factory=dict)
    unplaced: Mapping[str, Reason] = field(default_factory=dict)
    notes: tuple[Reason, ...] = ()

    @property
    def is_complete(self) -> bool:
        """Return whether everybody's grade is in the file."""
        return not self.withheld and not self.unplaced

    def left_out(self) -> Iterator[tuple[str, Literal["withheld", "unplaced"], tuple[Reason, ...]]]:
        """The students who are not in the file, with why."""
        for student, reasons in self.withheld.items():
            yield student, "withheld", reasons
        for student, reason in self.unplaced.items():
            yield student, "unplaced", (reason,)

    def among(self, grades: Sequence[Grade]) -> "Delivery":
        """The same delivery, with the students who are written and those who are withheld."""
        students = [grade.student_id for grade in ready(grades)]
        return replace(
            self,
            written=tuple(student for student in students if student not in self.unplaced),
            withheld={grade.student_id: grade.withheld for grade in grades if grade.score is None},
        )


def ready(grades: Sequence[Grade]) -> list[Grade]:
    """The grades that have a score."""
    return [grade for grade in grades if grade.score is not None]


def in_a_row(names: Sequence[str], most: int = 20, speaker: Tongue = ENGLISH) -> str:
    """Names in one line, of many only the first."""
    told, more = ", ".join(names[:most]), len(names) - most
    return told if more <= 0 else speaker.gettext(AND_MORE) % {"names": told, "more": more}


def grades_of(results: ResultsDocument, options: Options) -> list[Grade]:
    """A grade per student.

    A student with several positions needs a choice: one `position`, or `combine` by ``sum`` or
    ``mean``. A sum or mean waits for all of its parts.

    Raises CallError where the choice is missing or not one, InputFileError for results that
    contradict themselves.
    """
    position, combine = options.position, options.combine
    if combine is not None and combine not in COMBINE:
        raise failure(CallError, "combine", combine=combine)
    if position is not None and combine is not None:
        raise failure(CallError, "combine", "position_or_combine")
    _check(results.reports)
    students: dict[str, list[ReportDocument]] = {}
    for report in results.reports:
        students.setdefault(report.student_id, []).append(report)
    grades = []
    for student_id, reports in students.items():
        folder_of = zip(reports, result_folders(reports), strict=True)
        chosen = [(report, folder) for report, folder in folder_of if position in (None, report.position)]
        if len(chosen) > 1 and combine is None:
            raise failure(CallError, "several_positions", student=student_id, count=len(chosen))
        if chosen:
            grades.append(_grade(student_id, chosen, options))
    if not grades:
        raise failure(CallError, "nothing_to_export")
    return grades


def _check(reports: Sequence[ReportDocument]) -> None:
    """Check the results; raises InputFileError where they contradict themselves."""
    faults: list[Reason] = []
    keys = set()
    for report in reports:
        who: dict[str, Value] = {
            "cell": "/".join(map(str, filter(None, (report.student_id, report.position))))
        }
        if (refused := refused_id(report.student_id)) is not None:
            faults.append(refused)
        if (report.student_id, report.position) in keys:
            faults.append(Reason("two_reports", who))
        keys.add((report.student_id, report.position))
        if report.score is not None and not 0.0 <= report.score <= report.max_score + 1e-9:
            known = {**who, "score_points": report.score, "most_points": report.max_score}
            faults.append(Reason("score_range", known))
        if report.max_score <= 0.0:
            faults.append(Reason("no_maximum", {**who, "most_points": report.max_score}))
    if faults:
        raise failure(InputFileError, "results_wrong", "results_contradict", faults=faults)


_OPEN = {
    "needs_review": "needs_review", "unreadable": "unreadable", "missing": "missing", "graded": "no_score",
}  # fmt: skip
"""The reason, by status, for which a report has no grade yet."""


def _grade(student_id: str, chosen: Sequence[tuple[ReportDocument, str]], options: Options) -> Grade:
    """The grade of a student's reports, each with its folder."""
    reports, folders = tuple(report for report, _ in chosen), tuple(folder for _, folder in chosen)
    person = options.people.get(student_id, Person())
    person = replace(person, lang=person.lang or options.lang or "en")
    maximum = sum(report.max_score for report in reports)
    score = sum(report.score or 0.0 for report in reports)
    parts = len(reports) if options.combine == "mean" else 1
    why = tuple(
        Reason(_OPEN[report.status], {} if report.position is None else {"position": report.position})
        for report in reports
        if report.status != "graded" or report.score is None
    )
    return Grade(student_id, None if why else score / parts, maximum / parts, reports, person, why, folders)
