"""Drawings that follow another student's data: how many are found, and how many honest ones are accused.

::

    python -m tests.bench.copying --students 300
    python -m tests.bench.copying --students 0 --scans 40 --kept FOLDER

Simulated students enter measurements: each draws all or one plan with another variant's data, and hands it
in under the student's own name with the own scales, the other's or none; as many honest students draw rightly
or with mistakes. With `--scans`, sheets drawn with another variant's data are read under the student's own
number, and as many under the number that they were drawn with (some 5 s each; readings are kept in the
folder). The first seeds were used to set the constants of `grader.given_data`; the others are for measuring.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
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
from tests.bench.judging_scans import SCANNED, SHEET_KINDS, SheetKind, drawn_on, read_under, stored
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
"""Share of sketches that are turned on their sheets."""
LEAST_APART = 3
"""Variants with closer numbers may have the same drawing: they are counted separately."""


@dataclass(frozen=True, slots=True)
class Copied:
    """One submission and the program's result."""

    key: StudentKey
    source: Source
    how: str
    apart: int
    said: "Said"


@dataclass(frozen=True, slots=True)
class Said:
    """The program's result for one submission.

    Attributes
    ----------
    is_named : another variant's data are named as a mistake
    is_asked : a person is asked whether the data are another variant's
    has_number : the number that the data belong to is among those named or asked about
    waits : it is not marked without a person
    share : share of the points that it may get
    """

    is_named: bool
    is_asked: bool
    has_number: bool
    waits: bool
    share: float


def work_of(key: StudentKey, assignment: Assignment, variant: Variant, turn: float) -> StudentWork:
    """The right drawing of a variant by a key's student, with the sketch turned by some degrees."""
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
    """A student's task and submission, and the variant whose data all or part of it follows."""
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
    """A student's submission with another's plan in it."""

    def with_plan(one: Reading, other: Reading) -> Reading:
        if plan not in one.figures or plan not in other.figures:
            return one
        return replace(one, figures={**one.figures, plan: other.figures[plan]})

    if mine.measured is not None and theirs.measured is not None:
        return replace(mine, measured=with_plan(mine.measured, theirs.measured))
    pairs = zip(mine.readings, theirs.readings, strict=True)
    return replace(mine, readings=tuple(with_plan(one, other) for one, other in pairs))


def judged_copy(key: StudentKey, source: Source, how: How) -> Copied:
    """Judge a copied submission."""
    task, handed_in, other = copied(key, source, how)
    judgement = judge(task, handed_in)
    return Copied(key, source, how, _apart(task.variant, other), _said(judgement, other))


def _apart(one: Variant, other: Variant) -> int:
    """The distance of two variants: the sum of the differences of number and position."""
    return abs((one.n or 0) - (other.n or 0)) + abs((one.position or 0) - (other.position or 0))


def _said(judgement: Judgement, other: Variant | None) -> Said:
    named = [one for one in judgement.mistakes if one.code in OWNERS]
    asked = {
        str(reason.parameters["whose"])
        for one in judgement.outcomes
        for reason in one.reasons
        if reason.code == "data_unclear"
    }
    numbers = {f"{each.mistake.n}, {each.mistake.position}" for one in named for each in (one, *one.rivals)}
    numbers |= {_number(one) for each in asked for one in each.split("; ")}
    has_number = other is not None and f"{other.n}, {other.position}" in numbers
    waits = judgement.needs_review or judgement.score.high == 0.0
    share = judgement.score.high / judgement.score.maximum
    return Said(bool(named), bool(asked), has_number, waits, share)


def _number(whose: str) -> str:
    """The number and position named in a question."""
    said = dict(one.split(" = ") for one in whose.split(", "))
    return f"{said.get('n')}, {said.get('position')}"


def honest(key: StudentKey, source: Source) -> Copied | None:
    """Judge a submission that follows the student's own data; None if it cannot be drawn."""
    try:
        work = student(key)
    except ValueError:
        return None
    if any(one.code == "other_variant" for one in work.task.mistakes):
        return None
    judgement = judge(task_of(work.assignment, work.rubric, work.variant), submission(work, source))
    return Copied(key, source, "honest", 0, _said(judgement, None))


# Scans ---------------------------------------------------------------------------------------------

SCANS: Mapping[str, SheetKind] = {
    "flatbed": SHEET_KINDS["flatbed"],
    "100 dpi": SheetKind("flatbed 100 dpi", dpi=100.0),
    "copies": SHEET_KINDS["copies"],
}


@dataclass(frozen=True, slots=True)
class ReadCopy:
    """Sheets drawn with one variant's data and read under another's number, or under the same one."""

    key: StudentKey
    own: Variant
    drawn: Variant
    declared: Mapping[str, str]
    readings: tuple[Reading, ...]


def read_copy(kind: str, seed: int, kept: Path | None, *, honest: bool) -> ReadCopy | None:
    """Read a sheet, or take its reading from the folder `kept`; None if it cannot be drawn."""
    path = None if kept is None else kept / f"{kind}-{seed}-{'honest' if honest else 'copied'}.pkl"
    return stored(path, partial(_read_copy, kind, seed, honest=honest))


def _read_copy(kind: str, seed: int, *, honest: bool) -> ReadCopy | None:
    hand = list(HANDS)[seed % 2]
    key = StudentKey(
        SCANNED[seed % len(SCANNED)], hand, "single" if honest and seed % 4 > 1 else "right", seed
    )
    made = drawn_on(SCANS[kind], key, key.lot(f"scan {kind}"))
    if made is None:
        return None
    work, pages = made
    if any(one.code == "other_variant" for one in work.task.mistakes):
        return None
    own, variants = work.variant, work.assignment.variants()
    if not honest:
        others = [one for one in variants if one != work.variant]
        own = others[int(key.lot("own").integers(len(others)))]
    scales = task_of(work.assignment, work.rubric, own).rule_scales
    declared = declared_texts(work.task.declared if honest else scales)
    return ReadCopy(key, own, work.variant, declared, read_under(work, own, declared, pages))


def judged_scan(kind: str, read: ReadCopy) -> Copied:
    """Judge sheets that were read under the student's own number."""
    assignment, rubric = assignment_named(read.key.assignment)
    task = task_of(assignment, rubric, read.own)
    drawn = tuple(one for one in read.readings if one.figures)
    is_copy = read.own != read.drawn
    how = f"{kind}, copied" if is_copy else "honest"
    if not drawn:
        unread = Said(is_named=False, is_asked=False, has_number=False, waits=True, share=0.0)
        return Copied(read.key, "scans", how, 99, unread)
    judgement = judge(task, Submission(readings=drawn, declared=read.declared))
    return Copied(read.key, "scans", how, _apart(read.own, read.drawn), _said(judgement, read.drawn))


def tables(submissions: Sequence[Copied]) -> Iterator[Table]:
    """Copies found, by kind and source; honest submissions accused, by hand."""
    copies = [one for one in submissions if one.how != "honest"]
    groups = {f"{source}, {how}": [one for one in copies if (one.source, one.how) == (source, how)]
              for source in SOURCES for how in HOWS}  # fmt: skip
    groups |= {f"scans, {kind}": [one for one in copies if one.how == f"{kind}, copied"] for kind in SCANS}
    groups["all"] = copies
    groups["all but neighbours"] = [one for one in copies if one.apart >= LEAST_APART]
    heads = [
        "copies", "submissions", "named", "told with the number", "settled without a person",
        "of it neighbours", "of it right by the own data",
    ]  # fmt: skip
    yield "Copies", heads, [_row(name, ones) for name, ones in groups.items() if ones]
    own = [one for one in submissions if one.how == "honest"]
    groups = {f"{hand}, {kind}, {source}": [
        one for one in own if (one.key.hand, one.key.kind, one.source) == (hand, kind, source)]
        for hand in HANDS for kind in KINDS for source in (*SOURCES, "scans")}  # fmt: skip
    groups["all"] = own
    heads = ["own data", "submissions", "accused", "a person asked"]
    yield "Honest submissions", heads, [_honest_row(name, ones) for name, ones in groups.items() if ones]


def _honest_row(name: str, ones: Sequence[Copied]) -> list[str]:
    counts = len(ones), sum(one.said.is_named for one in ones), sum(one.said.is_asked for one in ones)
    return [name, *map(str, counts)]


RIGHT = 0.95
"""From this share of the points on a drawing counts as right by the own data."""


def _row(name: str, ones: Sequence[Copied]) -> list[str]:
    settled = [one for one in ones if not one.said.waits]
    return [
        name,
        str(len(ones)),
        _percent(sum(one.said.is_named for one in ones), len(ones)),
        _percent(sum(one.said.has_number for one in ones), len(ones)),
        str(len(settled)),
        str(sum(one.apart < LEAST_APART for one in settled)),
        str(sum(one.said.share >= RIGHT for one in settled)),
    ]


def _percent(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f} %" if whole else "-"


KINDS: tuple[Kind, ...] = ("right", "single", "pair")


def measure(students: int, first: int = FIRST_SEED) -> Iterator[Copied]:
    """Judge this many copies, and as many honest submissions."""
    for seed in range(first, first + students):
        name = ASSIGNMENTS[seed % len(ASSIGNMENTS)]
        hand = list(HANDS)[seed // len(ASSIGNMENTS) % len(HANDS)]
        source = SOURCES[seed % len(SOURCES)]
        how = HOWS[seed // len(SOURCES) % len(HOWS)]
        if hand != "sloppy" or seed % 2:
            yield judged_copy(StudentKey(name, hand, "right", seed), source, how)
        kind = KINDS[seed % len(KINDS)]
        one = honest(StudentKey(name, hand, kind, seed), SOURCES[seed // 2 % len(SOURCES)])
        if one is not None:
            yield one


def measure_scans(students: int, first: int, kept: Path | None) -> Iterator[Copied]:
    """Judge this many copied sheets, and as many under the number that they were drawn with."""
    for seed in range(first, first + students):
        kind = list(SCANS)[seed % len(SCANS)]
        for is_honest in (False, True):
            read = read_copy(kind, seed, kept, honest=is_honest)
            if read is not None:
                yield judged_scan(kind, read)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark and print its tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else "")
    parser.add_argument("--students", type=int, default=100)
    parser.add_argument("--scans", type=int, default=0, help="copied sheets, and as many honest ones")
    parser.add_argument("--kept", type=Path, help="folder in which readings are kept")
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    chosen = parser.parse_args(arguments)
    submissions = [*measure(chosen.students, chosen.first)]
    submissions += measure_scans(chosen.scans, chosen.first, chosen.kept)
    print(as_text(tables(submissions)))


if __name__ == "__main__":
    main()
