"""Simulated students without pictures: mechanisms, drawings, and the same drawn by a perfect hand.

A student follows from a `StudentKey` and is the same in every run: the variant, the scales, a turned sketch,
vectors not drawn, the mistakes and the hand's errors. Two mechanisms add structures that the built-in
assignments lack: a plate inside a six-bar of two dyads; an offset slider with a dyad attached to its rod.
Their rubrics are those that `planmark new` would write.
"""

import tomllib
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from grader.outcomes import NamedMistake as Named
from grader.rubric import RubricFile, rubric_of
from reference.authored.assignment import Assignment, AssignmentFile, Variant, load_assignment
from reference.authored.mechanism import check_mechanism
from reference.authored.toml_file import validate
from reference.construction.elements import View
from reference.construction.graph import Construction, evaluate, parameters_of
from reference.construction.mistakes import Drawing, Mistake, commit, single_mistakes
from reference.errors import AuthoredFileError
from samples.simulation import CAREFUL, SLOPPY, TYPICAL, HandStyle
from samples.simulation.hand import DrawingTask, DrawnSheet, draw, task_of
from samples.simulation.mistakes import CODES, CODES_OF_FORCES, Intent, StudentMistake, scalars, with_mistake
from samples.simulation.settings import Student
from tests.bench.force_students import force_task
from tests.whole_rubric import rubric_for

_SCALES = 'scales = { crank_mm = 50, kL = "crank_m / crank_mm", kv = "omega * kL", ka = "kv**2 / kL" }'
_PAGES = """
[[page]]
kind = "velocity"
figures = ["mechanism", "velocity_plan"]

[[page]]
kind = "acceleration"
figures = ["mechanism", "acceleration_plan"]
"""

STEPHENSON = f"""
schema_version = 1
id = "stephenson"
title = {{ en = "Six-bar of Stephenson's third kind" }}
task = {{ en = "Draw the plans." }}
rubric = "stephenson"
variant = {{ n = {{ from = 1, to = 14 }}, values = {{ phi_deg = "334 + 2*n", n1_rpm = "90 + 5*n" }} }}
{_SCALES}
{_PAGES}
[mechanism]
schema_version = 1
id = "stephenson"
title = {{ en = "Six-bar of Stephenson's third kind" }}
length_unit = "mm"
ground = {{ O1 = [0, 0], O2 = [260, -40], O3 = [330, 240] }}
crank = {{ pivot = "O1", pin = "A", length = 90, angle_deg = "phi_deg", rpm = "n1_rpm" }}
group = [
  {{ type = "RRR", node = "B", pins = ["A", "O2"], links = ["2", "3"], lengths = [240, 180], side = "left" }},
  {{ type = "plate", node = "C", base = ["A", "B"], link = "2", lengths = [170, 150], side = "left" }},
  {{ type = "RRR", node = "D", pins = ["C", "O3"], links = ["4", "5"], lengths = [160, 150], side = "left" }},
]
"""

OFFSET = f"""
schema_version = 1
id = "offset"
title = {{ en = "Offset slider-crank with a dyad on its rod" }}
task = {{ en = "Draw the plans." }}
rubric = "offset"
variant = {{ n = {{ from = 1, to = 12 }}, values = {{ phi_deg = "36 + 2*n", n1_rpm = "150 + 10*n" }} }}
{_SCALES}
{_PAGES}
[mechanism]
schema_version = 1
id = "offset"
title = {{ en = "Offset slider-crank with a dyad on its rod" }}
length_unit = "mm"
ground = {{ O1 = [0, 0], O3 = [220, 260] }}
crank = {{ pivot = "O1", pin = "A", length = 80, angle_deg = "phi_deg", rpm = "n1_rpm" }}

[[mechanism.group]]
type = "RRP"
node = "B"
pin = "A"
link = "2"
length = 260
guide = {{ through = [0, -50], angle_deg = 0 }}
side = "ahead"

[[mechanism.group]]
type = "point_on_line"
node = "C"
base = ["A", "B"]
link = "2"
ratio = 0.6

[[mechanism.group]]
type = "RRR"
node = "D"
pins = ["C", "O3"]
links = ["4", "5"]
lengths = [200, 140]
side = "left"
"""

_OWN = {"stephenson": STEPHENSON, "offset": OFFSET}
ASSIGNMENTS = ("pump", "press", "engine", "shaper", "piston", *_OWN)


@cache
def assignment_named(name: str) -> tuple[Assignment, RubricFile]:
    """An assignment and its rubric by name. Raises CallError for an unknown one."""
    if name == "shaper-forces":
        return force_task("shaper")
    if name not in _OWN:
        assignment = load_assignment(name)
        return assignment, rubric_of(assignment)
    file = validate(AssignmentFile, tomllib.loads(_OWN[name]), name)
    if isinstance(file.mechanism, str):  # pragma: no cover - the tables above hold theirs
        raise TypeError(file.mechanism)
    faults = tuple(check_mechanism(file.mechanism))
    if faults:
        raise AuthoredFileError(name, faults)
    assignment = Assignment(file, file.mechanism, Path(f"{name}.assignment.toml"))
    mechanism = assignment.mechanism(assignment.variants()[:1])
    return assignment, rubric_for(name, file.title, mechanism)


SCALES = ("kL", "kv", "ka")
ALIKE_MM = 0.3
"""Two mistakes whose drawings differ by less in every observed vector count as each other."""


def with_mistakes(right: Intent, mistakes: Sequence[Mistake | StudentMistake]) -> Intent:
    """The intended drawing with these mistakes in it; swapped letters change no node.

    A student's mistakes are made by the simulation's rules, those named in a report by the program's.
    Raises ValueError where a mistake cannot be made.
    """
    drawing = right
    for mistake in mistakes:
        if isinstance(mistake, StudentMistake):
            named_only = mistake.code == "vector_missing"
            drawing = drawing if named_only else with_mistake(drawing, mistake)
        elif mistake.code not in {"labels_swapped", "vector_missing", "rpm_not_converted"}:
            redrawn = commit(mistake, Drawing(drawing.construction, drawing.parameters))
            drawing = Intent(redrawn.construction, redrawn.parameters)
    return drawing


def vectors_of(right: Intent, mistakes: Sequence[Mistake | StudentMistake]) -> dict[str, complex]:
    """Every vector and link, mm, by the letters at its ends. Raises ValueError as above."""
    drawing = with_mistakes(right, mistakes)
    nodes = evaluate(drawing.construction, drawing.parameters)
    swaps = [(one.other[0], one.other[1]) for one in mistakes if one.code == "labels_swapped"]
    named = relabelled({name: complex(place) for name, place in nodes.items()}, swaps)
    vectors = {name: (one.tail, one.head) for name, one in right.construction.vectors.items()}
    ends = {**vectors, **right.construction.links}
    return {name: named[head] - named[tail] for name, (tail, head) in ends.items()}


def relabelled(nodes: Mapping[str, complex], swaps: Sequence[tuple[str, str]]) -> dict[str, complex]:
    """Nodes by the letters written beside them."""
    named = dict(nodes)
    for first, second in swaps:
        if first in named and second in named:
            named[first], named[second] = named[second], named[first]
    return named


# Mistakes named in a report -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Asked:
    """The variant that a student was asked to draw, and its right drawing."""

    assignment: Assignment
    variant: Variant
    right: Intent


def meant(asked: Asked, named: Named) -> Iterator[Mistake]:
    """The mistakes that one named in a report may stand for: itself, in either line of its step.

    A factor may also be given as its inverse.
    """
    mistake, construction = named.mistake, asked.right.construction
    right = Drawing(construction, asked.right.parameters)
    match mistake.code:
        case "vector_missing" | "labels_swapped" | "figure_rotated":
            yield mistake
        case "other_variant":
            yield from _other_variant(asked, mistake)
        case "scale_wrong" | "rpm_not_converted" | "arithmetic":
            factors = (mistake.factor, 1.0 / mistake.factor if mistake.factor else 0.0)
            yield from (replace(mistake, factor=factor) for factor in factors)
        case _:
            for figure in construction.figures:
                for single in single_mistakes(right, figure):
                    if (single.code, single.at, single.other) == (mistake.code, mistake.at, mistake.other):
                        yield single


def _other_variant(asked: Asked, named: Mistake) -> Iterator[Mistake]:
    other = Variant(named.n, named.position)
    if other == asked.variant or other not in asked.assignment.variants():
        return
    scales = asked.assignment.scales([other])
    parameters = parameters_of(asked.assignment.mechanism([other]), scales.kL, scales.kv, scales.ka)
    yield replace(named, parameters=scalars(parameters))


def is_same(made: StudentMistake, named: Named) -> bool:
    """Return whether a report names this mistake, by code and place."""
    if made.code != named.code:
        return False
    match made.code:
        case "labels_swapped":
            return set(made.other) == set(named.mistake.other)
        case "other_variant":
            return (named.mistake.n, named.mistake.position) == (made.n, made.position)
        case "rpm_not_converted":
            return True
        case "figure_rotated":
            return made.at == named.at and named.mistake.quarters % 4 == made.quarters % 4
    return made.at == named.at


Kind = Literal["right", "single", "pair", "slip"]
"""Slip: rightly drawn, one value wrongly computed from it."""
Source = Literal["scans", "nodes", "directions", "lengths"]
KINDS: tuple[Kind, ...] = get_args(Kind)
SOURCES: tuple[Source, ...] = ("nodes", "directions", "lengths")
"""Without pictures."""
ON_SHEETS = frozenset({"scans", "nodes"})
HANDS: Mapping[str, HandStyle] = {"careful": CAREFUL, "typical": TYPICAL, "sloppy": SLOPPY}
_TRIES = 60


@dataclass(frozen=True, slots=True)
class StudentKey:
    """The key of a student: the same key gives the same drawing."""

    assignment: str
    hand: str
    kind: Kind
    seed: int

    def lot(self, purpose: str) -> np.random.Generator:
        """A random generator for one purpose, independent of all others."""
        told = f"{self.assignment}/{self.hand}/{self.kind}/{purpose}"
        return np.random.default_rng([self.seed, zlib.crc32(told.encode())])

    def __str__(self) -> str:
        return f"{self.assignment} {self.hand} {self.kind} {self.seed}"


@dataclass(frozen=True, slots=True)
class StudentWork:
    """One student's drawing, with the task.

    Attributes
    ----------
    task : the drawing as it should be and as the student understood it
    sheets : the figures as drawn by hand
    declares : whether the scales are declared
    letters : whether swapped letters are read as letters, and nodes by their lines
    left_out : vectors that are not drawn, by mistake or because they need not be
    """

    key: StudentKey
    assignment: Assignment
    rubric: RubricFile
    task: DrawingTask
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
        """The student's own nodes that a plan depends on: those of its sheet's sketch, and the velocities."""
        sheet = next(one for one in self.sheets if figure in {drawn.name for drawn in one.figures})
        nodes: dict[str, complex] = {}
        for one in (self.sheets[0], sheet):
            for drawn in one.figures:
                nodes.update(drawn.nodes)
        return nodes

    def changed_by(self, mistake: StudentMistake) -> frozenset[str]:
        """The nodes that a mistake in forces lays off wrongly from right earlier nodes."""
        right = self.task.right
        nodes = evaluate(right.construction, right.parameters)

        def placed(drawing: Intent, node: str) -> complex:
            return complex(drawing.construction.step(node).place(View(nodes, drawing.parameters)))

        wrong = with_mistake(right, mistake)
        return frozenset(node for node in nodes if abs(placed(right, node) - placed(wrong, node)) > ALIKE_MM)

    def swaps(self) -> list[tuple[str, str]]:
        """Pairs of nodes whose letters are swapped."""
        return [(one.other[0], one.other[1]) for one in self.task.mistakes if one.code == "labels_swapped"]

    def named(self, nodes: Mapping[str, complex], source: Source) -> dict[str, complex]:
        """The nodes by the names under which they are handed in."""
        return dict(nodes) if self.by_letters(source) else relabelled(nodes, self.swaps())

    def by_letters(self, source: Source) -> bool:
        """Return whether swapped letters are handed in as letters, and nodes named by their lines."""
        return source in ON_SHEETS and self.letters


def student(key: StudentKey) -> StudentWork:
    """The student of a key.

    Raises ValueError if no drawing of this kind can be made in many tries.
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
        return StudentWork(key, assignment, rubric, task, sheets, declares, letters, left_out)
    raise ValueError(f"{key}: no such drawing in {_TRIES} tries")


def _habits(key: StudentKey, assignment: Assignment, lot: np.random.Generator) -> Student:
    """Scales, turn, sheets and mistakes."""
    own = lot.random() < 0.3
    crank = float(lot.choice([30.0, 40.0, 50.0, 60.0])) if own and lot.random() < 0.5 else None
    ratios = [float(lot.choice([0.8, 1.25])) if own else 1.0 for _ in range(2)]
    has_crank = assignment.mechanism_file.crank is not None
    codes = codes_of(key, lot)
    # From a wrong sketch with a single pivot nobody could tell by how much it is turned.
    tells = len(assignment.mechanism_file.ground) > 1 or not {"other_variant", "other_assembly"} & set(codes)
    # Nobody turns a sketch by a degree or two on purpose.
    turn = float(lot.uniform(5.0, 25.0) * lot.choice([-1, 1])) if tells and lot.random() < 0.3 else 0.0
    pages = {page.kind for page in assignment.file.page}
    return Student(
        crank_mm=crank if has_crank else None, kv_ratio=ratios[0], ka_ratio=ratios[1], turn_deg=turn,
        similarity=True if lot.random() < 0.2 else None, mistakes=codes, sheets=1 if "all" in pages else 2,
    )  # fmt: skip


def codes_of(key: StudentKey, lot: np.random.Generator) -> tuple[str, ...]:
    """Codes of the mistakes to make; another student's data come first, as the others follow from them."""
    if key.kind in {"right", "slip"}:
        return ()
    codes = CODES_OF_FORCES if key.assignment.endswith("-forces") else CODES
    turn = codes[(key.seed + zlib.crc32(f"{key.assignment} {key.hand}".encode())) % len(codes)]
    first = turn if lot.random() < 0.9 else str(lot.choice(list(codes)))
    if key.kind == "single":
        return (first,)
    second = str(lot.choice([code for code in codes if code != first]))
    return tuple(sorted((first, second), key=lambda code: code != "other_variant"))


def is_hidden(task: DrawingTask) -> bool:
    """Return whether one of two mistakes hides the other: at the same line, or both in a scale."""
    places = [(one.at, one.slot) for one in task.mistakes]
    in_scales = {"scale_wrong", "rpm_not_converted"} <= {one.code for one in task.mistakes}
    return len(set(places)) < len(places) or in_scales
