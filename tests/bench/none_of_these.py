"""Benchmark of "none of these" as an explanation: random sheets, slips of units, confidence shown.

    python -m tests.bench.none_of_these [--sheets N] [--students N] [--first SEED]

- Random sheets: vectors at random and random closed polygons, with directions and without, over the
  mechanisms of `judging_students`: how many get a mistake named with 0.9 or more, how many are said to
  fit nothing.
- Slips of units: right drawings and drawings with one mistake, entered in radians, clockwise, from another
  axis, in centimetres and metres, with kv and ka exchanged, with values in other units.
- The confidence shown with mistakes, by tenths, and how many of them were made.
"""

import argparse
import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.records import ReadVector
from reference.construction.mistakes import RPM_FACTOR
from samples.simulation.wording import declared_texts
from tests.bench.judging import judged
from tests.bench.judging_handed_in import submission
from tests.bench.judging_students import ASSIGNMENTS, StudentKey, StudentWork, assignment_named, student
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


# Slips of units -----------------------------------------------------------------------------------

Enter = Callable[[Submission], Submission]


def _vectors(change: Callable[[ReadVector], ReadVector]) -> Enter:
    def enter(one: Submission) -> Submission:
        if one.measured is None:
            return one
        figures = {
            plan: replace(figure, vectors={name: change(vector) for name, vector in figure.vectors.items()})
            for plan, figure in one.measured.figures.items()
        }
        return replace(one, measured=replace(one.measured, figures=figures))

    return enter


def _turned(convention: Callable[[float], float]) -> Enter:
    def change(one: ReadVector) -> ReadVector:
        if one.direction_deg is None:
            return one
        return replace(one, direction_deg=convention(one.direction_deg) % 360.0)

    return _vectors(change)


def _shorter(factor: float, digits: int) -> Enter:
    def change(one: ReadVector) -> ReadVector:
        length = None if one.length_mm is None else round(one.length_mm / factor, digits)
        return replace(one, length_mm=length)

    return _vectors(change)


def _exchanged(one: Submission) -> Submission:
    declared = {**one.declared, "kv": one.declared["ka"], "ka": one.declared["kv"]}
    return replace(one, declared=declared)


def _values(kinds: str, factor: float) -> Enter:
    def enter(one: Submission) -> Submission:
        values = {name: value * factor if name[0] in kinds else value for name, value in one.values.items()}
        return replace(one, values=values)

    return enter


SLIPS: Mapping[str, tuple[Enter, dict[str, str]]] = {
    "radians": (_turned(lambda deg: round(math.radians(deg), 2)), {"slip": "radians"}),
    "clockwise": (_turned(lambda deg: -deg), {"slip": "clockwise"}),
    "from +y": (_turned(lambda deg: deg - 90.0), {"slip": "axis", "axis": "+y"}),
    "from -x": (_turned(lambda deg: deg - 180.0), {"slip": "axis", "axis": "-x"}),
    "cm": (_shorter(10.0, 2), {"slip": "lengths", "unit": "cm"}),
    "m": (_shorter(1000.0, 4), {"slip": "lengths", "unit": "m"}),
    "kv and ka exchanged": (_exchanged, {"slip": "exchanged"}),
    "values in cm/s": (_values("va", 100.0), {"slip": "values", "unit": "cm/s"}),
    "values in rev/min": (_values("o", RPM_FACTOR), {"slip": "values", "unit": "rev/min"}),
}
OF_DIRECTIONS = ("radians", "clockwise", "from +y", "from -x")


def _handed_in(work: StudentWork, slip: str, source: str) -> Submission | None:
    """A student's measurements with a slip of units in them; None where it cannot be made."""
    one = submission(work, "directions" if source == "directions" else "lengths")
    if (slip in OF_DIRECTIONS and source == "lengths") or (
        slip == "kv and ka exchanged" and not one.declared
    ):
        return None
    if slip.startswith("values"):
        if work.task.mistakes:
            return None
        task = task_of(work.assignment, work.rubric, work.variant)
        asked = {**{name: abs(real) for name, real in task.real.items() if name in work.rubric.vectors}}
        values = {name: value for name, value in {**asked, **task.rates}.items() if value}
        kinds = "va" if slip.endswith("cm/s") else "o"
        if sum(name[0] in kinds for name in values) <= 1:
            return None
        one = replace(one, values=values)
    return SLIPS[slip][0](one)


def unit_slips(first: int, count: int) -> dict[tuple[str, str, str], Count]:
    """Counts of slips named rightly, with no other slip of units, by slip, kind of student and source."""
    found: dict[tuple[str, str, str], Count] = {}
    for key in (
        StudentKey(name, hand, kind, seed)
        for name in ASSIGNMENTS
        for hand in HANDS
        for kind in ("right", "single")
        for seed in range(first, first + count)
    ):
        try:
            work = student(key)
        except ValueError:
            continue
        task = task_of(work.assignment, work.rubric, work.variant)
        for slip, (_, detail) in SLIPS.items():
            for source in ("directions", "lengths"):
                handed_in = _handed_in(work, slip, source)
                if handed_in is not None:
                    judgement = judge(task, handed_in)
                    named = [one for one in judgement.mistakes if one.code == "units"]
                    is_named = len(named) == 1 and named[0].detail.items() >= detail.items()
                    found.setdefault((slip, key.kind, source), Count()).add(is_named)
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
    rows = [[*kind, _of(one)] for kind, one in sorted(unit_slips(first, students).items())]
    yield "Slips of units named", ["slip", "drawing", "entered with", "named"], rows
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
