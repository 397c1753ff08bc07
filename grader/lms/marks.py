"""The parts of a grade: points and remarks by criterion, comments, and the platform's own criteria."""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from markupsafe import Markup

from grader.documents import CriterionDocument, ReportDocument, Verdict
from grader.language import Tongue, tongue
from grader.lms.grades import Grade, Options, ready
from grader.lms.table import bytes_of, parsed, read_table
from grader.overlay.scene import MARKS
from grader.records import Reason, Value
from grader.texts.spoken import failure
from reference.errors import CallError, InputFileError

DECIMALS = 6
"""Decimals of points: more than any platform stores, fewer than rounding errors change."""
CLOSE = 1e-4
"""Sums of points that are written with five decimals agree to this."""


# Documents that platforms take --------------------------------------------------------------------


def json_text(content: Mapping[str, object]) -> str:
    """A document as JSON; what it holds stands in a schema, `grader/lms/schemas`, for each platform."""
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def own_document(grades: Sequence[Grade], **content: object) -> str:
    """A document of planmark's own form as JSON: its version, the assignment, and the content."""
    return json_text({"schema_version": 1, "assignment": grades[0].assignment, **content})


def check_unique(names: Iterable[str], what: str) -> None:
    """Raises InputFileError where a name stands twice; `what` says of what it is."""
    known = set()
    for name in names:
        if name in known:
            raise failure(InputFileError, "export_refused", "named_twice", what=what, name=name)
        known.add(name)


@dataclass(frozen=True, slots=True)
class PlatformCriterion:
    """A criterion, and its number on the platform."""

    criterion: str
    id: str
    max_points: float


# Comments -----------------------------------------------------------------------------------------

_COMMENTED = {"partial", "none", "review", "follow_through"}
"""The verdicts that are worth a comment."""
Remark = tuple[str, str, str]
"""Sign of the verdict, title of the criterion, sentence."""


def comment(grade: Grade) -> str:
    """Feedback on what is not simply right, in a few lines that go beside a grade: HTML, one line."""
    html = Markup("")
    for heading, remarks in _comments(grade):
        if heading:
            html += Markup("<p><b>{}</b></p>").format(heading)
        items = [Markup("<li>{} <b>{}</b>: {}</li>").format(*remark) for remark in remarks]
        html += Markup("<ul>{}</ul>").format(Markup("").join(items)) if items else ""
        html += "" if items else Markup("<p>{}</p>").format(_everything_is_right(grade))
    return str(html)


def plain_comment(grade: Grade) -> str:
    """The same as plain text, a line for each remark."""
    lines = []
    for heading, remarks in _comments(grade):
        lines += [heading] if heading else []
        lines += [f"{sign} {title}: {text}" for sign, title, text in remarks] or [_everything_is_right(grade)]
    return "\n".join(lines)


def _everything_is_right(grade: Grade) -> str:
    return tongue(grade.person.lang).gettext("Everything is right.")


def _comments(grade: Grade) -> Iterator[tuple[str, list[Remark]]]:
    """For each report: a heading where there are several, and marks, titles and sentences."""
    speaker = tongue(grade.person.lang)
    position = speaker.gettext("Position")
    for report in grade.reports:
        commented = [each for each in report.criteria if each.verdict in _COMMENTED or _by_person(each)]
        remarks = [(MARKS[each.verdict], each.title, _sentence(each)) for each in commented]
        if report.comment or report.added:
            sign = f"{report.added:+g}" if report.added else ""
            remarks.append((sign, speaker.gettext("Comment on the whole"), _one_line(report.comment)))
        yield f"{position} {report.position}" if len(grade.reports) > 1 else "", remarks


def _by_person(criterion: CriterionDocument) -> str:
    """Return the comment of the person who decided a criterion."""
    return "" if criterion.decided is None else criterion.decided.comment


def _sentence(criterion: CriterionDocument) -> str:
    return _one_line(f"{criterion.feedback} {_by_person(criterion)}")


def _one_line(text: str) -> str:
    return " ".join(text.split())


# Points -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Mark:
    """A criterion's points for one student.

    Attributes
    ----------
    points : for what was not judged its share of the rest, as the total is scaled
    remark : plain text
    """

    criterion: str
    title: str
    points: float
    max_points: float
    verdict: Verdict
    remark: str
    position: int | None = None

    @property
    def is_full(self) -> bool:
        """Return whether no points are lost."""
        return math.isclose(self.points, self.max_points, abs_tol=CLOSE)


def marks_of(grade: Grade) -> list[Mark]:
    """The marks behind a grade, report by report.

    Raises InputFileError where they do not add up to the score, or one is not between 0 and its maximum.
    """
    marks = outline(grade)
    faults = [
        Reason(
            "points_range",
            {"cell": mark.criterion, "given_points": mark.points, "most_points": mark.max_points},
        )
        for mark in marks
        if not -CLOSE <= mark.points <= mark.max_points + CLOSE or mark.max_points <= 0.0
    ]
    if faults:
        known = {"student": grade.student_id}
        raise failure(InputFileError, "results_wrong", "points_impossible", faults=faults, **known)
    total = math.fsum(mark.points for mark in marks)
    score = math.fsum(report.score or 0.0 for report in grade.reports)
    if not math.isclose(total, score, abs_tol=CLOSE):
        told = {"student": grade.student_id, "total": total, "score": score}
        raise failure(InputFileError, "results_wrong", "points_sum", **told)
    return marks


def outline(grade: Grade) -> list[Mark]:
    """The marks of a grade that may still be open: what is under review counts nothing here."""
    speaker = tongue(grade.person.lang)
    return [
        mark
        for report in grade.reports
        for mark in _with_added([_mark(each, report, speaker) for each in report.criteria], report.added)
    ]


def _with_added(marks: list[Mark], added: float) -> list[Mark]:
    """The marks with points that a person added to the whole: platforms add up the criteria themselves.

    Points are taken from each criterion in proportion to its points, and added to what each lacks.
    """
    rooms = [mark.points if added < 0.0 else mark.max_points - mark.points for mark in marks]
    whole = math.fsum(rooms)
    if not added or whole <= 0.0:
        return marks
    return [
        replace(mark, points=round(mark.points + added * room / whole, DECIMALS))
        for mark, room in zip(marks, rooms, strict=True)
    ]


def _mark(criterion: CriterionDocument, report: ReportDocument, speaker: Tongue) -> Mark:
    share = ((report.score or 0.0) - report.added) / report.max_score * criterion.max_points
    points = share if criterion.points is None else criterion.points
    words = [speaker.gettext("not judged") if criterion.verdict == "not_judged" else ""]
    words.append(_sentence(criterion))
    remark = f"{MARKS[criterion.verdict]} {': '.join(filter(None, words))}".strip()
    return Mark(
        criterion.id, criterion.title, round(points, DECIMALS), criterion.max_points, criterion.verdict,
        remark, report.position,
    )  # fmt: skip


def ready_marks(grades: Sequence[Grade], options: Options) -> list[tuple[Grade, list[Mark]]]:
    """The marks of graded students, one for each criterion of the class."""
    return [(grade, together(marks_of(grade), options.combine)) for grade in ready(grades)]


def together(marks: Sequence[Mark], combine: str | None) -> list[Mark]:
    """One mark for each criterion, of all positions: their sum, or their mean."""
    by_criterion: dict[str, list[Mark]] = {}
    for mark in marks:
        by_criterion.setdefault(mark.criterion, []).append(mark)
    return [_combined(same, combine) for same in by_criterion.values()]


def _combined(marks: Sequence[Mark], combine: str | None) -> Mark:
    first, parts = marks[0], len(marks) if combine == "mean" else 1
    is_single = len(marks) == 1
    return Mark(
        first.criterion,
        first.title,
        round(math.fsum(mark.points for mark in marks) / parts, DECIMALS),
        round(math.fsum(mark.max_points for mark in marks) / parts, DECIMALS),
        first.verdict if is_single else "partial",
        first.remark if is_single else "\n".join(f"{mark.position}: {mark.remark}" for mark in marks),
    )


# The criteria of a class --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Criterion:
    """A criterion of the rubric; `titles`: that of the class, then those that students read."""

    id: str
    titles: tuple[str, ...]
    max_points: float

    @property
    def name(self) -> str:
        """On a platform: the id tells it from others, in whatever language the title is."""
        return f"{self.id}: {self.titles[0]}"

    def is_named(self, name: str) -> bool:
        """Return whether a platform's criterion of this name is this one."""
        head = name.partition(":")[0]
        return self.id in (name.strip(), head.strip()) or name.strip() in self.titles


def class_criteria(grades: Sequence[Grade], options: Options) -> list[Criterion]:
    """The rubric as the reports show it, those under review too.

    Raises CallError where no report has criteria, InputFileError where students were marked by others.
    """
    students = {
        grade.student_id: together(outline(grade), options.combine)
        for grade in grades
        if all(report.criteria for report in grade.reports)
    }
    if not students:
        raise failure(CallError, "nothing_to_export", "no_criteria")
    first = next(iter(students))
    maxima = {mark.criterion: mark.max_points for mark in students[first]}
    faults = []
    titles: dict[str, list[str]] = {criterion: [] for criterion in maxima}
    for student, marks in students.items():
        if {mark.criterion: mark.max_points for mark in marks} != maxima:
            faults.append(Reason("other_criteria", {"cell": student, "other": first}))
            continue
        for mark in marks:
            titles[mark.criterion].append(mark.title)
    if faults:
        raise failure(InputFileError, "criteria_differ", faults=faults)
    return [
        Criterion(each, _titles(titles[each], options.titles.get(each)), most)
        for each, most in maxima.items()
    ]


def _titles(titles: Sequence[str], first: str | None) -> tuple[str, ...]:
    """The titles that students read, the commonest first, after that of the class."""
    by_number = sorted(dict.fromkeys(titles), key=titles.count, reverse=True)
    return tuple(dict.fromkeys([first, *by_number] if first else by_number))


def platform_marks(
    grades: Sequence[Grade], options: Options, path: Path
) -> tuple[list[PlatformCriterion], list[tuple[Grade, dict[str, Mark]]]]:
    """The criteria with the platform's numbers from `path`, and the marks of graded students by number.

    Raises InputFileError where the platform's criteria are not the rubric's.
    """
    marked = ready_marks(grades, options)
    criteria = numbered(class_criteria(grades, options), path)
    numbers = {each.criterion: each.id for each in criteria}
    return criteria, [(grade, {numbers[mark.criterion]: mark for mark in marks}) for grade, marks in marked]


# The platform's criteria --------------------------------------------------------------------------

CRITERION_COLUMNS = ("criterion", "id")
PlatformEntry = tuple[str, str, float | None]
"""A criterion in a platform's answer: its number, its name, and its points where they are given."""


def numbered(criteria: Sequence[Criterion], path: Path) -> list[PlatformCriterion]:
    """The platform's number of each criterion, from a table ``criterion,id`` or the platform's own JSON.

    Raises InputFileError where one is missing, stands there twice, or has other points there.
    """
    result, faults = matched(criteria, _criteria_of(path))
    if faults:
        raise failure(InputFileError, "criteria", faults=faults, file=path)
    return result


def matched(
    criteria: Sequence[Criterion], known: Sequence[PlatformEntry]
) -> tuple[list[PlatformCriterion], list[Reason]]:
    """The platform's number of each criterion, and in what its criteria are not these."""
    names = tuple(f"'{name}'" for _, name, _ in known)
    faults: list[Reason] = []
    result: list[PlatformCriterion] = []
    for criterion in criteria:
        same = [(number, points) for number, name, points in known if criterion.is_named(name)]
        if len(same) != 1:
            found: dict[str, Value] = {"count": len(same)} if same else {"names": names}
            faults.append(Reason("criterion_absent", {"cell": criterion.name, **found}))
            continue
        (number, points), most = same[0], criterion.max_points
        if points is not None and abs(points - most) > CLOSE:
            found = {"cell": criterion.name, "there_points": points, "here_points": most}
            faults.append(Reason("points_differ", found))
        result.append(PlatformCriterion(criterion=criterion.id, id=number, max_points=most))
    numbers = {each.id for each in result}
    faults += [
        Reason("criterion_extra", {"cell": f"'{name}'"}) for number, name, _ in known if number not in numbers
    ]
    if len(numbers) < len(result):
        faults.append(Reason("one_number"))
    return result, faults


def _criteria_of(path: Path) -> list[PlatformEntry]:
    """The criteria in a table ``criterion,id`` or in a platform's answer."""
    if path.suffix.lower() == ".csv":
        _, rows = read_table(path, CRITERION_COLUMNS)
        return [(row["id"], row["criterion"], None) for row in rows if row["id"]]
    known = list(criteria_in(read_answer(path)))
    if not known:
        raise failure(InputFileError, "criteria", "answer_without_criteria", file=path)
    return known


def read_answer(path: Path) -> Any:  # noqa: ANN401 - whatever a platform answers
    """A platform's JSON; InputFileError for what is none."""
    try:
        return parsed(bytes_of(path, "criteria"))
    except ValueError as error:
        raise failure(InputFileError, "criteria", "no_json_answer", file=path, error=error) from error


_LISTS = ("guide_criteria", "qualities", "criteria", "data", "rubric", "rubrics")
_NESTS = ("areas", "definitions", "guide", "rubric")
_OF_A_CRITERION = {"maxscore", "points", "levels", "qualityId"}


def criteria_in(answer: object) -> Iterator[PlatformEntry]:
    """Criteria in an answer: of a Moodle guide, or of a rubric of Canvas, Classroom or Microsoft."""
    if isinstance(answer, list):
        for each in answer:
            yield from criteria_in(each)
    if not isinstance(answer, dict):
        return
    name = answer.get("shortname", answer.get("description" if "levels" not in answer else "title"))
    name = name.get("content") if isinstance(name, dict) else name
    number = answer.get("id", answer.get("qualityId"))
    if isinstance(name, str) and isinstance(number, str | int) and _OF_A_CRITERION & set(answer):
        levels = answer.get("levels")
        listed = levels if isinstance(levels, list) else []
        of_levels = [each.get("points") for each in listed if isinstance(each, dict)]
        best = max((each for each in of_levels if isinstance(each, int | float)), default=None)
        points = answer.get("maxscore", answer.get("points", best))
        yield str(number), name, float(points) if isinstance(points, int | float) else None
        return
    # A Canvas rubric has its criteria as `data` and again as `criteria`: the first that is there counts.
    lists = [answer[key] for key in _LISTS if isinstance(answer.get(key), list)]
    for inner in lists[:1] or [answer[key] for key in _NESTS if key in answer]:
        yield from criteria_in(inner)
