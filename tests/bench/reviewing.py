"""Measure a review without a person: the number of questions, and the totals if one only presses Enter.

::

    python -m tests.bench.reviewing --seeds 1001 1100 --kept FOLDER

Sheets of simulated students, read once (`judging_scans`), are reviewed twice. *Enter* takes each default, or
the first choice if there is none. *Truth* answers by the true drawing: it chooses the point where the node
lies, or drags it there, and the verdict that a perfect reading of the same drawing gives. The total of that
perfect reading is the one due in both reviews.

A perfect reader is sure of what it sees, and measures as accurately as the program: so a rubric's rule for
reading errors decides alike. It sees two nodes in one point as a vector of length zero, where a point is
due. A criterion that it does not judge is not judged by an honest person either; if the reason is that a
point is due and drawn, crediting it is right, too. A vector covered by other lines counts as drawn
(`judging_scans`). Totals are the rubric's, without criteria that are not judged; they are not sums of points.
"""

import argparse
import cmath
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from grader.comparison.task import Task, task_of
from grader.documents import ReportDocument
from grader.pipeline import mark
from grader.records import Figure, PageRef, ReadNode, ReadVector, ScannedPage
from grader.review.doubts import doubts_of, figures_read
from grader.tables.decisions import Decision
from grader.tables.measurements import StudentSubmission
from tests.bench.judging_handed_in import submission
from tests.bench.judging_scans import SHEET_KINDS, ReadWork, read_works
from tests.bench.judging_students import StudentWork
from tests.bench.plain_text import Table, as_text

NEAR_MM = 1.0
"""A place this near to where a node was drawn is the right one."""
MOST_QUESTIONS = 60
BINS = (0.0, 0.5, 0.6, 0.8, 0.9, 0.95, 1.01)
CREDITED, CHARGED = {"full", "follow_through"}, {"none", "partial"}


@dataclass(frozen=True, slots=True)
class Answered:
    """One answer that was offered, its probability, and whether it is right."""

    kind: str
    probability: float
    is_right: bool


@dataclass(slots=True)
class Review:
    """One student's sheets under review, without a page or a server."""

    task: Task
    student: StudentSubmission
    pages: list[ScannedPage]
    rows: list[Decision] = field(default_factory=list)

    def report(self) -> ReportDocument:
        """The report with the decisions so far."""
        task, student = self.task, replace(self.student, decided=tuple(self.rows))
        return mark(student, self.pages, task.assignment, task.rubric)[0]

    def answer(self, rows: Sequence[tuple[str, str]]) -> None:
        """Add decisions; a row on the same criterion replaces the one before."""
        said = {name for name, _ in rows}
        self.rows = [one for one in self.rows if one.criterion not in said]
        self.rows += [Decision("s", None, name, verdict) for name, verdict in rows]


@dataclass(frozen=True, slots=True)
class Truth:
    """The truth: verdicts and total of a perfect reading, nodes on the sheet (complex mm) by figure.

    `points` are the criteria of vectors that should be a point, and are drawn as one: they are not judged.
    """

    verdicts: Mapping[str, str]
    total: float
    nodes: Mapping[tuple[str, str], complex]
    points: frozenset[str]


def truth_of(read: ReadWork, task: Task, student: StudentSubmission) -> Truth:
    """The truth that a perfect reader would find on a student's sheets."""
    perfect = submission(replace(read.work, left_out=_left_out(read.work, task)), "nodes")
    sure = (
        replace(one, figures={name: _sure(drawn, _errors(read, name)) for name, drawn in one.figures.items()})
        for one in perfect.readings
    )
    pages = [ScannedPage(PageRef(f"{number}.jpg"), reading=one) for number, one in enumerate(sure)]
    review = Review(task, student, pages)
    report = review.report()
    verdicts = {one.id: one.proposed or one.verdict for one in report.criteria}
    points = frozenset(
        one.id
        for one in report.criteria
        if one.verdict == "not_judged" and {"too_short_to_judge", "made_trivial"} & set(one.reasons)
    )
    return Truth(verdicts, _total(review, report), _on_sheets(read), points)


def _left_out(work: StudentWork, task: Task) -> frozenset[str]:
    """The vectors that are not drawn, except those that should be a point, and are drawn as one."""
    scales = {name: float(one) for name, one in work.task.declared.items()}

    def is_point(name: str) -> bool:
        vector, least = work.construction.vectors[name], task.rubric.tolerance_of(name).least_mm
        own = work.own(work.construction.figure_of(vector.head))
        return (
            name not in work.task.missing
            and abs(task.segments[name].drawn(scales)) < least
            and abs(own[vector.head] - own[vector.tail]) < least
        )

    return frozenset(name for name in work.left_out if not is_point(name))


def _errors(read: ReadWork, name: str) -> Figure:
    """A figure as the program read it; the perfect reader gets its standard errors."""
    return next((one.figures[name] for one in read.readings if name in one.figures), Figure({}, {}))


def _sure(figure: Figure, errors: Figure) -> Figure:
    """A figure read for certain, with another reading's standard errors where it has them."""
    nodes = {
        name: replace(one, confidence=1.0, cov=errors.nodes.get(name, one).cov)
        for name, one in figure.nodes.items()
    }
    vectors = {name: _with_errors(one, errors.vectors.get(name, one)) for name, one in figure.vectors.items()}
    return Figure(nodes, vectors)


def _with_errors(drawn: ReadVector, errors: ReadVector) -> ReadVector:
    se_deg = None if drawn.direction_deg is None else errors.se_deg or drawn.se_deg
    return replace(drawn, confidence=1.0, se_mm=errors.se_mm, se_deg=se_deg)


def _on_sheets(read: ReadWork) -> dict[tuple[str, str], complex]:
    """True positions of the nodes on their sheets: the drawing fitted to the nodes read with confidence."""
    found: dict[tuple[str, str], complex] = {}
    for reading in read.readings:
        for name, figure in reading.figures.items():
            own = read.work.named(read.work.own(name), "nodes")
            names = [node for node in figure.nodes if node in own]
            if len(names) >= 2:
                moved = _laid_onto([own[one] for one in names], [figure.nodes[one] for one in names])
                steps = [step.node for step in read.work.construction.figures[name]]
                found |= {(name, one): moved[0] * own[one] + moved[1] for one in steps if one in own}
    return found


def _laid_onto(own: Sequence[complex], read: Sequence[ReadNode]) -> tuple[complex, complex]:
    """The turn (unit) and shift that fit a drawing to its reading; doubtful nodes hardly count."""
    drawn, at = np.array(own), np.array([one.at for one in read])
    weights = np.array([max(one.confidence, 0.01) ** 8 for one in read])
    for _ in range(8):
        centre, middle = np.average(drawn, weights=weights), np.average(at, weights=weights)
        turn = cmath.phase(complex(np.sum(weights * (at - middle) * np.conj(drawn - centre))))
        shift = middle - cmath.rect(1.0, turn) * centre
        apart = np.abs(cmath.rect(1.0, turn) * drawn + shift - at)
        weights = np.array([one.confidence**2 for one in read]) / (1.0 + (apart / 0.5) ** 2) + 1e-9
    return cmath.rect(1.0, turn), complex(shift)


# The two reviews ------------------------------------------------------------------------------------


def walked(review: Review, truth: Truth | None) -> tuple[int, list[Answered], float]:
    """Walk through a review; the number of questions, the answers offered, and the final total.

    Arguments: `truth` answers if it is given; else Enter does.
    """
    asked, offered = 0, list[Answered]()
    report = review.report()
    while asked < MOST_QUESTIONS:
        questions = doubts_of(review.task, report, figures_read(report, review.pages))
        if not questions:
            break
        first, asked = questions[0], asked + 1
        if truth is None:
            review.answer((first.default or first.choices[0]).rows)
        else:
            right, best = _right(first, truth), first.likeliest
            if best is not None and best.probability is not None and first.kind != "owner":
                offered.append(Answered(first.kind, best.probability, _is_same(best, right, truth)))
            review.answer(right)
        report = review.report()
    return asked, offered, _total(review, report)


def _right(question, truth: Truth) -> list[tuple[str, str]]:  # type: ignore[no-untyped-def]
    """The rows that an honest person would write."""
    if question.kind == "owner":
        return [(name, truth.verdicts[name]) for name in question.criteria]
    if question.kind == "node":
        figure, node = question.id.split(":")[1:]
        at = truth.nodes.get((figure, node))
        if at is None:
            return list(question.choices[-1].rows)
        for choice in question.choices:
            if choice.at is not None and abs(complex(choice.at[0], -choice.at[1]) - at) <= NEAR_MM:
                return list(choice.rows)
        return [(question.id, f"{at.real:.3f},{-at.imag:.3f}")]
    names = {name for choice in question.choices for name, _ in choice.rows}
    return [(name, truth.verdicts[name]) for name in sorted(names)]


def _is_same(choice, right: Sequence[tuple[str, str]], truth: Truth) -> bool:  # type: ignore[no-untyped-def]
    """Return whether a choice is right: the right point, or credit where credit is due."""
    if choice.at is not None:
        return list(choice.rows) == list(right)
    due = dict(right)
    return all(
        said == due.get(name)
        or (said in CREDITED and (due.get(name) in CREDITED or name in truth.points))
        or (said in CHARGED and due.get(name) in CHARGED)
        for name, said in choice.rows
    )


def _total(review: Review, report: ReportDocument) -> float:
    """The score, with open verdicts taken as proposed."""
    waiting = [(one.id, one.proposed or "none") for one in report.criteria if one.verdict == "review"]
    if waiting:
        review.answer(waiting)
        report = review.report()
    return report.score or 0.0


# All students ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Walked:
    """One student: questions by Enter and by truth, and the differences of both totals from the due one."""

    asked: int
    honest: int
    off: float
    honest_off: float
    offered: tuple[Answered, ...]


def reviewed(read: ReadWork) -> Walked | None:
    """Review a student's sheets; None if nothing was read, or the data are another student's."""
    drawn = [one for one in read.readings if one.figures]
    if not drawn or any(one.code == "other_variant" for one in read.work.task.mistakes):
        return None
    work = read.work
    task = task_of(work.assignment, work.rubric, work.variant)
    student = StudentSubmission("s", work.variant, (), read.declared)
    pages = [ScannedPage(PageRef(f"{number}.jpg"), reading=one) for number, one in enumerate(drawn)]
    truth = truth_of(read, task, student)
    asked, _, total = walked(Review(task, student, pages), None)
    honest, offered, known = walked(Review(task, student, pages), truth)
    return Walked(asked, honest, total - truth.total, known - truth.total, tuple(offered))


def tables(students: Sequence[Walked]) -> Iterator[Table]:
    """Tables of questions asked, errors of the totals, and shares of offered answers that were right."""
    due, honest = [one.off for one in students], [one.honest_off for one in students]
    apart = [one.off - one.honest_off for one in students]
    heads = [
        "answers", "sheets", "questions a sheet", "within 1 point of due", "of the honest review",
        "mean |off|",
    ]  # fmt: skip
    rows = [
        [name, str(len(students)), f"{np.mean(counts):.2f}", _near(offs), beside, f"{_mean(offs):.2f}"]
        for name, counts, offs, beside in (
            ("Enter", [one.asked for one in students], due, _near(apart)),
            ("truth", [one.honest for one in students], honest, "-"),
        )
    ]
    yield "Review: questions and totals", heads, rows
    offered = [answer for one in students for answer in one.offered]
    kinds = sorted({one.kind for one in offered})
    heads = ["offered with", *kinds, "all"]
    rows = []
    for low, high in pairwise(BINS):
        within = [one for one in offered if low <= one.probability < high]
        rows.append(
            [
                f"{low:g}-{min(high, 1.0):g}",
                *(_share([o for o in within if o.kind == kind]) for kind in kinds),
                _share(within),
            ]
        )
    yield "Review: proposals that are right, by their probability", heads, rows


def _near(offs: Sequence[float]) -> str:
    """The share of totals within a point."""
    return f"{100.0 * np.mean([abs(off) <= 1.0 for off in offs]):.0f} %" if offs else "-"


def _mean(offs: Sequence[float]) -> float:
    return float(np.mean(np.abs(offs))) if offs else 0.0


def _share(answers: Sequence[Answered]) -> str:
    if not answers:
        return "-"
    return f"{100.0 * sum(one.is_right for one in answers) / len(answers):.0f} % of {len(answers)}"


def main(arguments: Sequence[str] | None = None) -> None:
    """The benchmark as text."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else "")
    parser.add_argument("--seeds", type=int, nargs=2, default=(1001, 1020), help="first and last")
    parser.add_argument("--kinds", nargs="+", default=["flatbed"], choices=list(SHEET_KINDS))
    parser.add_argument("--kept", type=Path, help="folder in which readings are kept")
    chosen = parser.parse_args(arguments)
    seeds = range(chosen.seeds[0], chosen.seeds[1] + 1)
    works = (read for kind in chosen.kinds for read in read_works(kind, seeds, chosen.kept))
    print(as_text(tables([one for read in works if (one := reviewed(read)) is not None])))


if __name__ == "__main__":
    main()
