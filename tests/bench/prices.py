"""Measure the price of one mistake: the share of the maximum that it costs, by kind.

    python -m tests.bench.prices [--students N] [--first SEED]

Simulated students of seven assignments, careful and typical hands, each with exactly one mistake. The loss
is that of the expected score. The first row, a right drawing by the same hands, shows the price of drafting
errors. The table is in `docs/marking.md`.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from grader.comparison.task import task_of
from grader.marking.mark import judge
from tests.bench.judging_handed_in import submission
from tests.bench.judging_students import ASSIGNMENTS, SOURCES, Source, StudentKey, student

HANDS = ("careful", "typical")
STUDENTS = 32
"""Number for each assignment and hand: every kind of mistake is made at least twice."""

Losses = Mapping[tuple[str, Source], Sequence[float]]


def losses(students: int, first: int = 1) -> Losses:
    """Lost shares of the maximum, by the mistake's code (none: a right drawing) and by source."""
    found: dict[tuple[str, Source], list[float]] = defaultdict(list)
    for key in _keys(students, first):
        try:
            work = student(key)
        except ValueError:
            continue
        task = task_of(work.assignment, work.rubric, work.variant)
        code = work.task.mistakes[0].code if work.task.mistakes else "none"
        for source in SOURCES:
            score = judge(task, submission(work, source)).score
            if score.expected is not None:
                found[code, source].append(1.0 - score.expected / score.maximum)
    return found


def _keys(students: int, first: int) -> Iterator[StudentKey]:
    for assignment in ASSIGNMENTS:
        for hand in HANDS:
            for seed in range(first, first + students):
                yield StudentKey(assignment, hand, "single", seed)
                if seed % 4 == 0:
                    yield StudentKey(assignment, hand, "right", seed)


def table(found: Losses) -> Iterator[str]:
    """The lines of a Markdown table: mean loss in percent, and how many students."""
    yield "| mistake | nodes read | lengths and directions | lengths | students |"
    yield "|---|---|---|---|---|"
    for code in sorted({code for code, _ in found}, key=lambda one: (one != "none", one)):
        means = (f"{100.0 * np.mean(found[code, source]):.1f} %" for source in SOURCES)
        yield f"| {code} | {' | '.join(means)} | {len(found[code, SOURCES[0]])} |"


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser("python -m tests.bench.prices", description=__doc__)
    parser.add_argument("--students", type=int, default=STUDENTS, help="of each assignment and hand")
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    asked = parser.parse_args()
    print(*table(losses(asked.students, asked.first)), sep="\n")


if __name__ == "__main__":
    main()
