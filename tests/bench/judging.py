"""Measure judging on simulated classes whose truth is known: verdicts, mistakes named, time.

The students are made in `judging_students`, the verdicts due in `judging_truth`. To show one case in full::

    python -m tests.bench.judging --case pump typical single 17
"""

import argparse
import csv
import math
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import product
from pathlib import Path

from grader.comparison.evidence import Submission
from grader.comparison.task import Task, task_of
from grader.documents import Quantity
from grader.folder.batch import Batch, grade
from grader.marking.mark import judge
from grader.rubric import RubricFile
from grader.tables.measurements import names_of, read_measurements
from reference.authored.assignment import Assignment
from tests.bench.judging_handed_in import measured_line, submission
from tests.bench.judging_students import (
    ASSIGNMENTS,
    HANDS,
    KINDS,
    SOURCES,
    Kind,
    Source,
    StudentKey,
    StudentWork,
    assignment_named,
    student,
)
from tests.bench.judging_tally import ClassTime, JudgingFigures, Result, Times, judging_tables, result_of
from tests.bench.plain_text import as_text

MANY = 40
"""So many different students; the class repeats them under other names."""


def measure_class(rows: int, assignment: str = "pump") -> ClassTime:
    """Time a class measured with ruler and protractor, half of it right, half with a mistake."""
    task, rubric = assignment_named(assignment)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "handed-in").mkdir()
        _write(place / "handed-in" / "class.csv", assignment, rows)
        start = time.process_time()
        _judge_all(place / "handed-in" / "class.csv", task, rubric)
        judging = time.process_time() - start
        batch = Batch(task, rubric, place / "handed-in", place / "out", jobs=1)
        start, clock = time.process_time(), time.perf_counter()
        results = grade(batch, _silent)
        spent, passed = time.process_time() - start, time.perf_counter() - clock
    return ClassTime(assignment, rows, len(results.reports), judging, spent, passed)


def _judge_all(path: Path, assignment: Assignment, rubric: RubricFile) -> None:
    """Read the file and judge every line of it, without writing."""
    for line in read_measurements(path, names_of(assignment)):
        variant = assignment.variant(line.n, line.position)
        handed_in = Submission(measured=line.reading, values=line.values, declared=line.scales)
        judge(task_of(assignment, rubric, variant), handed_in)


def _silent(what: str, done: int, of: int) -> None:
    del what, done, of


def _write(path: Path, assignment: str, rows: int) -> None:
    keys = [
        StudentKey(assignment, "typical", "right" if seed % 2 else "single", seed) for seed in range(MANY)
    ]
    lines = [measured_line(key, with_directions=True) for key in keys]
    heads = list(dict.fromkeys(name for line in lines for name in line))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["student_id", *heads], restval="")
        writer.writeheader()
        writer.writerows({"student_id": f"s{row:04d}", **lines[row % len(lines)]} for row in range(rows))


STUDENTS: Mapping[Kind, int] = {"right": 96, "single": 48, "pair": 48, "slip": 12}
"""Number of each kind for an assignment and a hand: 2,016 right drawings in all."""
QUICK = 4
"""Number of each kind in a quick run."""


def judged(key: StudentKey, times: Times | None = None, sources: Sequence[Source] = SOURCES) -> list[Result]:
    """Judge a student's work from each source against the truth. Raises ValueError if it cannot be drawn."""
    work = student(key)
    noted = times if times is not None else Times()
    start = time.process_time()
    task = task_of(work.assignment, work.rubric, work.variant)
    noted.task.append(1000.0 * (time.process_time() - start))
    return [_judged_from(work, task, source, noted) for source in sources]


def _judged_from(work: StudentWork, task: Task, source: Source, noted: Times) -> Result:
    handed_in = submission(work, source)
    start = time.process_time()
    judgement = judge(task, handed_in)
    spent = 1000.0 * (time.process_time() - start)
    (noted.wrong if work.task.mistakes else noted.right).append(spent)
    return result_of(work, source, handed_in, judgement)


def measure_judging(
    students: int | None = None,
    *,
    quick: bool = False,
    assignments: Sequence[str] = ASSIGNMENTS,
) -> JudgingFigures:
    """Judge students of each assignment, hand and kind.

    Arguments: `students` of each kind for an assignment and a hand, by default `STUDENTS`.
    """
    few = students or (QUICK if quick else None)
    figures = JudgingFigures()
    for name, hand in product(assignments, HANDS):
        for kind, count in (dict.fromkeys(KINDS, few) if few else STUDENTS).items():
            for seed in range(1, count + 1):
                # Some students cannot be drawn.
                with suppress(ValueError):
                    figures.results += judged(StudentKey(name, hand, kind, seed), figures.times)
    return figures


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the benchmark, or one case of it."""
    parser = argparse.ArgumentParser(description="Judging measured on simulated classes.")
    parser.add_argument("--case", nargs=4, metavar=("ASSIGNMENT", "HAND", "KIND", "SEED"))
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--students", type=int)
    parser.add_argument("--assignments", nargs="+", default=list(ASSIGNMENTS))
    parser.add_argument("--failures", type=int, default=0, metavar="N", help="list the first N failures")
    chosen = parser.parse_args(arguments)
    if chosen.case:
        name, hand, kind, seed = chosen.case
        print(*_in_full(StudentKey(name, hand, kind, int(seed))), sep="\n")
        return
    figures = measure_judging(chosen.students, quick=chosen.quick, assignments=chosen.assignments)
    print(as_text(judging_tables(figures)))
    print(*figures.failures[: chosen.failures], sep="\n")


def _in_full(key: StudentKey) -> Iterator[str]:
    work = student(key)
    yield f"{key}: {work.variant}, {'scales declared' if work.declares else 'nothing declared'}"
    turn = math.degrees(float(work.task.right.parameters["turn"]))
    yield f"sketch turned by {turn:.0f} degrees; not drawn: {', '.join(sorted(work.left_out)) or 'nothing'}"
    task = task_of(work.assignment, work.rubric, work.variant)
    for source in SOURCES:
        handed_in = submission(work, source)
        judgement = judge(task, handed_in)
        result = result_of(work, source, handed_in, judgement)
        yield f"-- {result}"
        for one, outcome in zip(result.criteria, judgement.outcomes, strict=True):
            said = ", ".join(reason.code for reason in outcome.reasons)
            seen = f"{_short(outcome.measured)} for {_short(outcome.expected)}"
            yield f"   {one.criterion:10} due {one.due:8} {one.verdict:14} {seen}  {said}"


def _short(quantity: Quantity) -> str:
    """A measured or expected quantity as text."""
    if quantity.length_mm is None:
        return "-" if quantity.value is None else f"{quantity.value:.4g}"
    turn = "" if quantity.direction_deg is None else f" at {quantity.direction_deg:.1f}"
    return f"{quantity.length_mm:.2f} mm{turn}"


if __name__ == "__main__":
    main()
