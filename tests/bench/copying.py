"""Drawings that follow another student's data: how many are told, and how many honest ones are accused.

::

    python -m tests.bench.copying --students 300

simulated students enter measurements: each draws with another variant's data, the whole or one plan, and
hands it in under the own name with the own scales, the other's or none; as many honest ones draw rightly or
with mistakes. The first seeds were used to set the constants of `grader.given_data`; the rest measure.
"""

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

from grader.comparison.evidence import Submission
from grader.comparison.task import Task, task_of
from grader.marking.mark import judge
from grader.outcomes import Judgement
from grader.records import ACCELERATION_PLAN, VELOCITY_PLAN, Reading
from reference.authored.assignment import Assignment, Variant
from samples.simulation.hand import draw
from samples.simulation.hand import task_of as drawing_task
from samples.simulation.settings import Student
from samples.simulation.wording import declared_texts
from tests.bench.judging_handed_in import submission
from tests.bench.judging_students import (
    ASSIGNMENTS,
    HANDS,
    Kind,
    Source,
    StudentKey,
    StudentWork,
    assignment_named,
    student,
)
from tests.bench.plain_text import Table, as_text

FIRST_SEED = 5001
"""Students before it were used to set constants."""
How = Literal["own scales", "other's scales", "no scales", "velocities", "accelerations"]
HOWS: tuple[How, ...] = get_args(How)
"""A whole drawing, and the scales that are declared; or one plan of it."""
SOURCES: tuple[Source, ...] = ("directions", "lengths", "nodes")
OWNERS = frozenset({"other_variant", "data_misread"})
TURNED = 0.1
"""Of sketches are turned on their sheets."""
LEAST_APART = 3
"""Variants of nearer numbers may draw the same: they are counted apart."""


@dataclass(frozen=True, slots=True)
class Copied:
    """One submission and what was made of it."""

    key: StudentKey
    source: Source
    how: str
    apart: int
    is_told: bool
    is_named_rightly: bool
    waits: bool
    share: float


def work_of(key: StudentKey, assignment: Assignment, variant: Variant, turn: float) -> StudentWork:
    """The right drawing of a variant by the student of a key, with a sketch turned by some degrees."""
    lot = key.lot("copied")
    pages = {page.kind for page in assignment.file.page}
    habits = Student(sheets=1 if "all" in pages else 2, turn_deg=turn)
    task = drawing_task(assignment, variant, habits, lot)
    _, rubric = assignment_named(key.assignment)
    sheets = draw(task, HANDS[key.hand], habits, lot)
    return StudentWork(
        key, assignment, rubric, task, sheets, declares=True, letters=True, left_out=frozenset()
    )


def copied(key: StudentKey, source: Source, how: How) -> tuple[Task, Submission, Variant]:
    """The task of a student, what was handed in, and the variant whose data (part of) it follows."""
    assignment, rubric = assignment_named(key.assignment)
    variants, lot = assignment.variants(), key.lot("pair")
    own, other = (variants[int(index)] for index in lot.choice(len(variants), 2, replace=False))
    turn = float(lot.uniform(5.0, 20.0)) if lot.random() < TURNED else 0.0
    task, theirs = task_of(assignment, rubric, own), work_of(key, assignment, other, turn)
    scales = declared_texts({name: float(task.parameters[name]) for name in ("kL", "kv", "ka")})
    handed_in = submission(theirs, source)
    if how in {"own scales", "other's scales", "no scales"}:
        declared = {"own scales": scales, "other's scales": handed_in.declared, "no scales": {}}[how]
        return task, replace(handed_in, declared=declared, values={}), other
    mine = submission(work_of(replace(key, seed=key.seed + 10_000_000), assignment, own, turn), source)
    plan = VELOCITY_PLAN if how == "velocities" else ACCELERATION_PLAN
    return task, replace(_merged(mine, handed_in, plan), declared=scales, values={}), other


def _merged(mine: Submission, theirs: Submission, plan: str) -> Submission:
    """The own submission with another's plan in it."""

    def with_plan(one: Reading, other: Reading) -> Reading:
        if plan not in one.figures or plan not in other.figures:
            return one
        return replace(one, figures={**one.figures, plan: other.figures[plan]})

    if mine.measured is not None and theirs.measured is not None:
        return replace(mine, measured=with_plan(mine.measured, theirs.measured))
    pairs = zip(mine.readings, theirs.readings, strict=True)
    return replace(mine, readings=tuple(with_plan(one, other) for one, other in pairs))


def judged_copy(key: StudentKey, source: Source, how: How) -> Copied:
    """A copied submission, judged."""
    task, handed_in, other = copied(key, source, how)
    judgement = judge(task, handed_in)
    numbers = [(one.n or 0, one.position or 0) for one in (task.variant, other)]
    apart = abs(numbers[0][0] - numbers[1][0]) + abs(numbers[0][1] - numbers[1][1])
    return Copied(key, source, how, apart, *_said(judgement, other))


def _said(judgement: Judgement, other: Variant | None) -> tuple[bool, bool, bool, float]:
    told = [one for one in judgement.mistakes if one.code in OWNERS]
    numbers = {(each.mistake.n, each.mistake.position) for one in told for each in (one, *one.rivals)}
    is_right = other is not None and (other.n, other.position) in numbers
    waits = judgement.needs_review or judgement.score.high == 0.0
    return bool(told), is_right, waits, judgement.score.high / judgement.score.maximum


def honest(key: StudentKey, source: Source) -> Copied | None:
    """A submission by the own data, judged; None where no such drawing comes about."""
    try:
        work = student(key)
    except ValueError:
        return None
    if any(one.code == "other_variant" for one in work.task.mistakes):
        return None
    judgement = judge(task_of(work.assignment, work.rubric, work.variant), submission(work, source))
    return Copied(key, source, "honest", 0, *_said(judgement, None))


@dataclass(slots=True)
class CopyingFigures:
    """All submissions, and their tables."""

    submissions: list[Copied] = field(default_factory=list)

    def tables(self) -> Iterator[Table]:
        """Copies told, by how and by source; honest submissions accused, by hand."""
        heads = [
            "copies",
            "submissions",
            "told",
            "with the number",
            "settled without a person",
            "of it neighbours",
        ]
        copies = [one for one in self.submissions if one.how != "honest"]
        groups = {f"{source}, {how}": [one for one in copies if (one.source, one.how) == (source, how)]
                  for source in SOURCES for how in HOWS}  # fmt: skip
        groups["all"] = copies
        groups["all but neighbours"] = [one for one in copies if one.apart >= LEAST_APART]
        yield "Copies", heads, [_row(name, ones) for name, ones in groups.items()]
        own = [one for one in self.submissions if one.how == "honest"]
        groups = {f"{hand}, {kind}, {source}": [
            one for one in own if (one.key.hand, one.key.kind, one.source) == (hand, kind, source)]
            for hand in HANDS for kind in ("right", "single", "pair") for source in SOURCES}  # fmt: skip
        groups["all"] = own
        yield (
            "Honest submissions",
            ["own data", "submissions", "accused"],
            [[name, str(len(ones)), str(sum(one.is_told for one in ones))] for name, ones in groups.items()],
        )


def _row(name: str, ones: Sequence[Copied]) -> list[str]:
    missed = [one for one in ones if not one.waits]
    count = Counter({True: sum(one.apart < LEAST_APART for one in missed)})
    return [
        name, str(len(ones)), _percent(sum(one.is_told for one in ones), len(ones)),
        _percent(sum(one.is_named_rightly for one in ones), len(ones)), str(len(missed)), str(count[True]),
    ]  # fmt: skip


def _percent(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f} %" if whole else "-"


KINDS: tuple[Kind, ...] = ("right", "single", "pair")


def measure(students: int, first: int = FIRST_SEED) -> CopyingFigures:
    """So many copies, and as many honest submissions."""
    found = CopyingFigures()
    for seed in range(first, first + students):
        name = ASSIGNMENTS[seed % len(ASSIGNMENTS)]
        hand = list(HANDS)[seed // len(ASSIGNMENTS) % len(HANDS)]
        source = SOURCES[seed % len(SOURCES)]
        how = HOWS[seed // len(SOURCES) % len(HOWS)]
        if hand != "sloppy" or seed % 2:
            found.submissions.append(judged_copy(StudentKey(name, hand, "right", seed), source, how))
        kind = KINDS[seed % len(KINDS)]
        one = honest(StudentKey(name, hand, kind, seed), SOURCES[seed // 2 % len(SOURCES)])
        if one is not None:
            found.submissions.append(one)
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """The benchmark as text."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else "")
    parser.add_argument("--students", type=int, default=100)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    chosen = parser.parse_args(arguments)
    print(as_text(measure(chosen.students, chosen.first).tables()))


if __name__ == "__main__":
    main()
