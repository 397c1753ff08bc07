"""Judging measured on simulated classes whose truth is known: verdicts, mistakes named, time.

Who draws what stands in `judging_students`, what is due in `judging_truth`. One case again, told in full::

    python -m tests.bench.judging --case pump typical single 17
"""

import argparse
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence

from grader.comparison.task import Task, task_of
from grader.marking.mark import judge
from grader.outcomes import Quantity
from tests.bench.judging_assignments import ASSIGNMENTS
from tests.bench.judging_handed_in import submission
from tests.bench.judging_students import HANDS, KINDS, SOURCES, Key, Kind, Source, Work, student
from tests.bench.judging_tables import judging_tables
from tests.bench.judging_tally import ClassTime, JudgingFigures, Result, Times, result_of
from tests.bench.plain_text import as_text

__all__ = ["ASSIGNMENTS", "JudgingBench", "Key", "judged"]

STUDENTS: Mapping[Kind, int] = {"right": 96, "single": 48, "pair": 48, "slip": 12}
"""Of each kind for an assignment and a hand: 2,016 right drawings in all."""
QUICK = 4
"""In a quick run so many of each kind."""
ROWS, ROWS_QUICK = 1000, 50
"""Of a class's measurements."""
SCANNED = ("pump", "press", "engine", "shaper")
SCANS: Mapping[Kind, int] = {"right": 1, "single": 4}
"""Students of each kind, for a mechanism of these and a hand, whose scans are read."""


def judged(key: Key, times: Times | None = None, sources: Sequence[Source] = SOURCES) -> list[Result]:
    """One student's work judged from each source, against what was due. Raises ValueError for no such one."""
    work = student(key)
    noted = times if times is not None else Times()
    start = time.process_time()
    task = task_of(work.assignment, work.rubric, work.variant)
    noted.task.append(1000.0 * (time.process_time() - start))
    return [_judged_from(work, task, source, noted) for source in sources]


def _judged_from(work: Work, task: Task, source: Source, noted: Times) -> Result:
    handed_in = submission(work, source)
    start = time.process_time()
    judgement = judge(task, handed_in)
    spent = 1000.0 * (time.process_time() - start)
    (noted.wrong if work.task.mistakes else noted.right).append(spent)
    return result_of(work, source, handed_in, judgement)


class JudgingBench:
    """The whole benchmark of judging; `run` tells what was measured, step by step.

    Arguments: `students` of each kind for an assignment and a hand. Where wanted, `whole_class` measures a
    class of so many rows through the whole program (`tests.bench.judging_class`), and `scan` a student's
    simulated scans (`tests.bench.judging_scans`): careful and typical hands, fewer of each kind.
    """

    def __init__(
        self,
        *,
        quick: bool = False,
        students: int | None = None,
        assignments: Sequence[str] = ASSIGNMENTS,
        whole_class: Callable[[int], ClassTime] | None = None,
        scan: Callable[[Key, Times], list[Result]] | None = None,
    ) -> None:
        few = students or (QUICK if quick else None)
        self._counts = dict.fromkeys(KINDS, few) if few else STUDENTS
        self._classes = [(name, hand) for name in assignments for hand in HANDS]
        self._whole_class = whole_class
        self._rows = ROWS_QUICK if quick else ROWS
        self._scan = None if quick else scan
        self._scanned = [one for one in self._classes if one[0] in SCANNED and one[1] != "sloppy"]
        self.figures = JudgingFigures()
        self.steps = (
            len(self._classes) + (whole_class is not None) + (self._scan is not None) * len(self._scanned)
        )

    def run(self) -> Iterator[str]:
        """Measure, naming what was measured."""
        for name, hand in self._classes:
            for kind, count in self._counts.items():
                for seed in range(1, count + 1):
                    self._measure(Key(name, hand, kind, seed), judged)
            yield f"judging: {name}, {hand} hands"
        if self._scan is not None:
            for name, hand in self._scanned:
                for kind, count in SCANS.items():
                    for seed in range(1, count + 1):
                        self._measure(Key(name, hand, kind, seed), self._scan)
                yield f"judging: {name}, {hand} hands, scans"
        if self._whole_class is not None:
            self.figures.classes.append(self._whole_class(self._rows))
            yield "judging: a class's measurements"

    def _measure(self, key: Key, how: Callable[[Key, Times], list[Result]]) -> None:
        try:
            results = how(key, self.figures.times)
        except ValueError as error:
            self.figures.refused.append(str(error))
        else:
            self.figures.results.extend(results)


def main(arguments: Sequence[str] | None = None) -> None:
    """The benchmark, or one case of it, as text."""
    parser = argparse.ArgumentParser(description="Judging measured on simulated classes.")
    parser.add_argument("--case", nargs=4, metavar=("ASSIGNMENT", "HAND", "KIND", "SEED"))
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--students", type=int)
    parser.add_argument("--assignments", nargs="+", default=list(ASSIGNMENTS))
    parser.add_argument("--failures", type=int, default=0, metavar="N", help="list the first N failures")
    chosen = parser.parse_args(arguments)
    if chosen.case:
        name, hand, kind, seed = chosen.case
        print(*_in_full(Key(name, hand, kind, int(seed))), sep="\n")
        return
    bench = JudgingBench(quick=chosen.quick, students=chosen.students, assignments=chosen.assignments)
    for _ in bench.run():
        pass
    print(as_text(judging_tables(bench.figures)))
    print(*bench.figures.failures[: chosen.failures], sep="\n")


def _in_full(key: Key) -> Iterator[str]:
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
    """What a criterion was measured as, or should be."""
    if quantity.length_mm is None:
        return "-" if quantity.value is None else f"{quantity.value:.4g}"
    turn = "" if quantity.direction_deg is None else f" at {quantity.direction_deg:.1f}"
    return f"{quantity.length_mm:.2f} mm{turn}"


if __name__ == "__main__":
    main()
