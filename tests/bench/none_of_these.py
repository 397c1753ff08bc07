"""Benchmark of "none of these" as an explanation: random sheets, confidence shown.

    python -m tests.bench.none_of_these [--sheets N] [--students N] [--first SEED]

- Random sheets: vectors at random and random closed polygons, with directions and without, over the
  mechanisms of `judging_students`: how many get a mistake named with 0.9 or more, how many are said to
  fit nothing.
- The confidence shown with mistakes, by tenths, and how many of them were made.
"""

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.marking.mark import judge
from samples.simulation.wording import declared_texts
from tests.bench.judging import judged
from tests.bench.judging_students import ASSIGNMENTS, StudentKey, assignment_named
from tests.bench.judging_tally import Count, Result
from tests.bench.plain_text import Table, as_text
from tests.hands import nonsense

SURE = 0.9
HANDS = ("careful", "typical")
TENTHS = 10


# Random sheets ------------------------------------------------------------------------------------


@dataclass(slots=True)
class RandomSheets:
    """Random sheets of one kind: those with a mistake named at `SURE`, and those said to fit nothing."""

    named: Count = field(default_factory=Count)
    unfit: Count = field(default_factory=Count)
    codes: Counter[str] = field(default_factory=Counter)


def random_sheets(first: int, count: int) -> dict[tuple[str, str], RandomSheets]:
    """Judge sheets of every kind and mechanism; every other one declares its scales."""
    found: dict[tuple[str, str], RandomSheets] = {}
    for name in ASSIGNMENTS:
        assignment, rubric = assignment_named(name)
        variants = assignment.variants()
        for closed in (False, True):
            for directed in (True, False):
                kind = "polygons" if closed else "vectors", "directions" if directed else "lengths"
                tally = found.setdefault(kind, RandomSheets())
                for seed in range(first, first + count):
                    lot = np.random.default_rng([seed, len(name), closed, directed])
                    task = task_of(assignment, rubric, variants[int(lot.integers(len(variants)))])
                    declared = declared_texts(task.rule_scales) if seed % 2 else {}
                    reading = nonsense(task, lot, closed=closed, directed=directed)
                    judgement = judge(task, Submission(measured=reading, declared=declared))
                    sure = [one.code for one in judgement.mistakes if one.confidence >= SURE]
                    sure = [code for code in sure if code != "vector_missing"]
                    tally.named.add(bool(sure))
                    tally.unfit.add(judgement.unfit is not None)
                    tally.codes.update(sure)
    return found


# The confidence shown -----------------------------------------------------------------------------


def calibration(first: int, count: int) -> list[Count]:
    """Counts of named mistakes that were made, by tenths of confidence; the last one is from 0.9."""
    found = [Count() for _ in range(TENTHS)]
    for result in _judged(first, count):
        for one in result.mistakes:
            tenth = min(int(one.confidence * TENTHS), TENTHS - 1)
            found[tenth].add(one not in result.not_made)
    return found


def _judged(first: int, count: int) -> Iterator[Result]:
    for name in ASSIGNMENTS:
        for hand in HANDS:
            for kind in ("single", "pair"):
                for seed in range(first, first + count):
                    try:
                        yield from judged(StudentKey(name, hand, kind, seed))
                    except ValueError:
                        continue


# Tables -------------------------------------------------------------------------------------------


def tables(first: int, sheets: int, students: int) -> Iterator[Table]:
    """Measure, and give everything as tables."""
    rows = [
        [*kind, _of(one.named), _of(one.unfit), ", ".join(f"{code} {n}" for code, n in one.codes.items())]
        for kind, one in random_sheets(first, sheets).items()
    ]
    yield "Random sheets", ["of", "with", "named at 0.9", "said to fit nothing", "names"], rows
    rows = [
        [f"{tenth / TENTHS:.1f}", _of(one), "" if one.share is None else f"{one.share:.3f}"]
        for tenth, one in enumerate(calibration(first, students))
        if one.of
    ]
    yield "Confidence shown, by tenths from", ["confidence", "made", "share"], rows


def _of(count: Count) -> str:
    return f"{count.hits} of {count.of}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description="Explanations held against none of these.")
    parser.add_argument("--sheets", type=int, default=36, help="random sheets of a kind and mechanism")
    parser.add_argument("--students", type=int, default=8, help="of a kind, mechanism and hand")
    parser.add_argument("--first", type=int, default=1001, help="the first seed")
    chosen = parser.parse_args(arguments)
    print(as_text(tables(chosen.first, chosen.sheets, chosen.students)))


if __name__ == "__main__":
    main()
