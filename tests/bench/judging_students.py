"""Simulated students without pictures: what they drew.

A student is told by a `Key` and is the same in every run: the variant, the scales, a turned sketch,
vectors not drawn out, the mistakes and the hand's errors all follow from it.
"""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from grader.records import ACCELERATION_PLAN
from grader.rubric import RubricFile
from reference.authored.assignment import Assignment, Variant
from reference.construction.graph import Construction
from reference.construction.mistakes import CODES
from samples.simulation import CAREFUL, SLOPPY, TYPICAL, Hand
from samples.simulation.hand import DrawnSheet, Task, draw, task_of
from samples.simulation.settings import Student
from tests.bench.judging_assignments import assignment_named
from tests.bench.judging_redrawn import relabelled

Kind = Literal["right", "single", "pair", "slip"]
"""Slip: rightly drawn, one value wrongly computed from it."""
Source = Literal["scans", "nodes", "directions", "lengths"]
KINDS: tuple[Kind, ...] = get_args(Kind)
SOURCES: tuple[Source, ...] = ("nodes", "directions", "lengths")
"""Without pictures."""
ON_SHEETS = frozenset({"scans", "nodes"})
HANDS: Mapping[str, Hand] = {"careful": CAREFUL, "typical": TYPICAL, "sloppy": SLOPPY}
_TRIES = 60


@dataclass(frozen=True, slots=True)
class Key:
    """Which student: the same key gives the same drawing."""

    assignment: str
    hand: str
    kind: Kind
    seed: int

    def lot(self, purpose: str) -> np.random.Generator:
        """Chance for one purpose, apart from all others."""
        told = f"{self.assignment}/{self.hand}/{self.kind}/{purpose}"
        return np.random.default_rng([self.seed, zlib.crc32(told.encode())])

    def __str__(self) -> str:
        return f"{self.assignment} {self.hand} {self.kind} {self.seed}"


@dataclass(frozen=True, slots=True)
class Work:
    """What one student drew.

    Attributes
    ----------
    task : with the drawing as it should be and as it was understood
    sheets : what the hand made of it
    declares : whether the scales are declared
    letters : whether swapped letters are seen as letters, the nodes read by their lines
    left_out : vectors that are not drawn, by mistake or as they need not be
    """

    key: Key
    assignment: Assignment
    rubric: RubricFile
    task: Task
    sheets: tuple[DrawnSheet, ...]
    declares: bool
    letters: bool
    left_out: frozenset[str]

    @property
    def variant(self) -> Variant:
        """The student's."""
        return self.task.variant

    @property
    def construction(self) -> Construction:
        """As the student should have drawn it."""
        return self.task.right.construction

    def own(self, figure: str) -> dict[str, complex]:
        """The student's own nodes as they are when a plan is drawn: its sheet's sketch, the velocities."""
        sheet = self.sheets[-1] if figure == ACCELERATION_PLAN else self.sheets[0]
        nodes: dict[str, complex] = {}
        for one in (self.sheets[0], sheet):
            for drawn in one.figures:
                nodes.update(drawn.nodes)
        return nodes

    def swaps(self) -> list[tuple[str, str]]:
        """Pairs of nodes with each other's letter."""
        return [(one.other[0], one.other[1]) for one in self.task.mistakes if one.code == "labels_swapped"]

    def named(self, nodes: Mapping[str, complex], source: Source) -> dict[str, complex]:
        """The nodes under the names by which they are handed in."""
        return dict(nodes) if self.by_letters(source) else relabelled(nodes, self.swaps())

    def by_letters(self, source: Source) -> bool:
        """Whether swapped letters are told as such, beside nodes named by their lines."""
        return source in ON_SHEETS and self.letters


def student(key: Key) -> Work:
    """The student of a key.

    Raises ValueError where no drawing of this kind comes about in many tries.
    """
    assignment, rubric = assignment_named(key.assignment)
    variants = assignment.variants()
    lot = key.lot("student")
    variant = variants[int(lot.integers(len(variants)))]
    for _ in range(_TRIES):
        habits = _habits(key, assignment, lot)
        try:
            task = task_of(assignment, variant, habits, lot)
            sheets = draw(task, HANDS[key.hand], habits, lot)
        except ValueError:  # a mistake that cannot be made here, or beside the other one
            continue
        if is_hidden(task):
            continue
        optional = [one.name for one in rubric.criterion if one.optional and one.vector]
        skipped = {name for name in optional if lot.random() < 0.7} if lot.random() < 0.3 else set()
        own_scales = habits.crank_mm is not None or (habits.kv_ratio, habits.ka_ratio) != (1.0, 1.0)
        declares = bool(lot.random() < 0.7) or own_scales
        letters = bool(lot.random() < 0.5)
        left_out = frozenset(skipped) | task.missing
        return Work(key, assignment, rubric, task, sheets, declares, letters, left_out)
    raise ValueError(f"{key}: no such drawing in {_TRIES} tries")


def _habits(key: Key, assignment: Assignment, lot: np.random.Generator) -> Student:
    """Scales, turn, sheets and mistakes."""
    own = lot.random() < 0.3
    crank = float(lot.choice([30.0, 40.0, 50.0, 60.0])) if own and lot.random() < 0.5 else None
    ratios = [float(lot.choice([0.8, 1.25])) if own else 1.0 for _ in range(2)]
    has_crank = assignment.mechanism_file.crank is not None
    codes = codes_of(key, lot)
    # A sketch drawn wrongly about a single pivot would not tell how far it is turned.
    tells = len(assignment.mechanism_file.ground) > 1 or not {"other_variant", "other_assembly"} & set(codes)
    # Nobody turns a sketch by a degree or two on purpose.
    turn = float(lot.uniform(5.0, 25.0) * lot.choice([-1, 1])) if tells and lot.random() < 0.3 else 0.0
    pages = {page.kind for page in assignment.file.page}
    return Student(
        crank_mm=crank if has_crank else None, kv_ratio=ratios[0], ka_ratio=ratios[1], turn_deg=turn,
        similarity=True if lot.random() < 0.2 else None, mistakes=codes, sheets=1 if "all" in pages else 2,
    )  # fmt: skip


def codes_of(key: Key, lot: np.random.Generator) -> tuple[str, ...]:
    """Codes of the mistakes to make; another student's data come before what is done with them."""
    if key.kind in {"right", "slip"}:
        return ()
    turn = CODES[(key.seed + zlib.crc32(f"{key.assignment} {key.hand}".encode())) % len(CODES)]
    first = turn if lot.random() < 0.9 else str(lot.choice(list(CODES)))
    if key.kind == "single":
        return (first,)
    second = str(lot.choice([code for code in CODES if code != first]))
    return tuple(sorted((first, second), key=lambda code: code != "other_variant"))


def is_hidden(task: Task) -> bool:
    """Whether one of two mistakes hides the other: at one line of one step, or both in a scale."""
    places = [(one.at, one.slot) for one in task.mistakes]
    in_scales = {"scale_wrong", "rpm_not_converted"} <= {one.code for one in task.mistakes}
    return len(set(places)) < len(places) or in_scales
