"""Points by criterion, so that they add up to the grade, and the criteria of a whole class."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from grader.documents import CriterionDocument, ReportDocument, Verdict
from grader.i18n import Tongue, tongue
from grader.lms.documents import CLOSE
from grader.lms.draft import ready
from grader.lms.faults import listed
from grader.lms.grades import Grade
from grader.lms.options import Options
from grader.scene import MARKS
from reference.errors import CallError, InputFileError

DECIMALS = 6


@dataclass(frozen=True, slots=True)
class Mark:
    """A criterion's points for one student.

    Attributes
    ----------
    points : of what was not judged its share of the rest, as the total is scaled
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
        """Whether nothing is lost."""
        return math.isclose(self.points, self.max_points, abs_tol=CLOSE)


def marks_of(grade: Grade, lang: str) -> list[Mark]:
    """The marks behind a grade, report by report; `lang` is of remarks' few words of their own.

    Raises InputFileError where they do not add up to the score.
    """
    marks = outline(grade, lang)
    found = math.fsum(mark.points for mark in marks)
    meant = math.fsum(report.score or 0.0 for report in grade.reports)
    if not math.isclose(found, meant, abs_tol=CLOSE):
        raise InputFileError(
            "results_wrong",
            f"{grade.student_id}: the criteria give {found:g} points together, the score is {meant:g};"
            " grade again, or export grades without criteria",
        )
    return marks


def outline(grade: Grade, lang: str = "en") -> list[Mark]:
    """The marks of a grade that may still be open: what is under review counts nothing here."""
    speaker = tongue(lang)
    return [mark for report in grade.reports for mark in _of_report(report, speaker)]


def _of_report(report: ReportDocument, speaker: Tongue) -> list[Mark]:
    share = (report.score or 0.0) / report.max_score
    return [
        Mark(
            one.id,
            one.title,
            round(share * one.max_points if one.points is None else one.points, DECIMALS),
            one.max_points,
            one.verdict,
            _remark(one, speaker),
            report.position,
        )
        for one in report.criteria
    ]


def _remark(one: CriterionDocument, speaker: Tongue) -> str:
    words = [speaker.gettext("not judged")] if one.verdict == "not_judged" else []
    said = ": ".join([*words, *([" ".join(one.feedback.split())] if one.feedback.strip() else [])])
    return f"{MARKS[one.verdict]} {said}".strip()


def together(marks: Sequence[Mark], combine: str | None) -> list[Mark]:
    """One mark for each criterion, of all positions: their sum, or their mean."""
    by_criterion: dict[str, list[Mark]] = {}
    for mark in marks:
        by_criterion.setdefault(mark.criterion, []).append(mark)
    found = []
    for same in by_criterion.values():
        parts = len(same) if combine == "mean" else 1
        first = same[0]
        remarks = [one.remark if len(same) == 1 else f"{one.position}: {one.remark}" for one in same]
        found.append(
            Mark(
                first.criterion,
                first.title,
                round(math.fsum(one.points for one in same) / parts, DECIMALS),
                round(math.fsum(one.max_points for one in same) / parts, DECIMALS),
                first.verdict if len(same) == 1 else "partial",
                "\n".join(remarks),
            )
        )
    return found


# The criteria of a class --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Criterion:
    """A criterion of the rubric; `titles` are in all languages that students were told it in."""

    id: str
    titles: tuple[str, ...]
    max_points: float

    @property
    def name(self) -> str:
        """On a platform: the id tells it from others, in whatever language the title is."""
        return f"{self.id}: {self.titles[0]}"

    def is_named(self, name: str) -> bool:
        """Whether a criterion of a platform is this one, by its name there."""
        head = name.partition(":")[0]
        return self.id in (name.strip(), head.strip()) or name.strip() in self.titles


def class_marks(grades: Sequence[Grade], options: Options) -> list[tuple[Grade, list[Mark]]]:
    """Everybody's marks who has a grade, one for each criterion."""
    return [
        (grade, together(marks_of(grade, options.lang_of(grade.student_id)), options.combine))
        for grade in ready(grades)
    ]


def class_criteria(grades: Sequence[Grade], options: Options) -> list[Criterion]:
    """The rubric as the reports show it, those under review too; CallError where there are none."""
    seen = [grade for grade in grades if all(report.criteria for report in grade.reports)]
    if not seen:
        raise CallError("nothing_to_export", "no report has criteria: nothing was handed in that was read")
    return _criteria_of([(grade.student_id, together(outline(grade), options.combine)) for grade in seen])


def _criteria_of(students: Sequence[tuple[str, Sequence[Mark]]]) -> list[Criterion]:
    """The criteria that all students were marked by.

    Raises InputFileError where some were marked by others.
    """
    first, expected = students[0][0], {mark.criterion: mark.max_points for mark in students[0][1]}
    faults = []
    titles: dict[str, list[str]] = {criterion: [] for criterion in expected}
    for student, marks in students:
        if {mark.criterion: mark.max_points for mark in marks} != expected:
            faults.append(f"{student}: other criteria or points than {first}")
            continue
        for mark in marks:
            titles[mark.criterion].append(mark.title)
    if faults:
        raise InputFileError(
            "criteria_differ",
            "one rubric cannot hold all; grade all with one rubric, or choose a position" + listed(faults),
        )
    return [
        Criterion(one, tuple(sorted(dict.fromkeys(titles[one]), key=titles[one].count, reverse=True)), most)
        for one, most in expected.items()
    ]
