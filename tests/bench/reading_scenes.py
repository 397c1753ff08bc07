"""Scenes in which reading is measured: who drew what on which paper, and how it became a file."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from grader.inputs.roster import RosterRow
from grader.printed.answer_sheet import make_sheets
from grader.rubric import RubricFile, load_rubric
from reference.authored.assignment import Assignment, Variant, load_assignment
from samples.simulation import (
    CAREFUL,
    SLOPPY,
    TYPICAL,
    Hand,
    PrintedSheet,
    Settings,
    SimulatedSheet,
    any_settings,
    simulate,
)
from samples.simulation.mixture import Device
from samples.simulation.printing import printed_sheets

_UNITS = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s^2)/mm"}
_TRIES = 20


@dataclass(frozen=True, slots=True)
class Scene:
    """A kind of sheet.

    Attributes
    ----------
    hands : drawn by lot for each student
    mistakes : mean number of mistakes; with `wrong` one at least
    dpi : None as it comes
    printed : drawn on the printed answer sheet
    hardship : how much more often than usual sheets are hard to read
    """

    name: str
    title: str
    assignment: str = "pump"
    hands: tuple[Hand, ...] = (CAREFUL, TYPICAL)
    mistakes: float = 0.0
    wrong: bool = False
    device: Device = "flatbed"
    dpi: float | None = 300.0
    printed: bool = False
    hardship: float = 1.0


ALL_HANDS = (CAREFUL, TYPICAL, SLOPPY)
SCENES = (
    Scene("plain", "flatbed 300 dpi, plain sheet"),
    Scene("printed", "flatbed 300 dpi, answer sheet", printed=True),
    Scene("sloppy", "sloppy hands", hands=(SLOPPY,)),
    Scene("wrong", "wrong drawings", mistakes=1.0, wrong=True),
    Scene("hard", "hard sheets", hardship=4.0),
    Scene("150", "flatbed 150 dpi", dpi=150.0),
    Scene("copies", "1-bit copies", device="copier"),
    Scene("phone", "phone photos, answer sheet", device="phone", dpi=None, printed=True),
    Scene("press", "press", assignment="press", hands=ALL_HANDS, mistakes=0.3),
    Scene("engine", "engine", assignment="engine", hands=ALL_HANDS, mistakes=0.3),
    Scene("shaper", "shaper", assignment="shaper", hands=ALL_HANDS, mistakes=0.3),
    Scene("piston", "piston", assignment="piston", hands=ALL_HANDS, mistakes=0.3),
)


@dataclass(frozen=True, slots=True)
class Work:
    """One student's sheets and what is known about them without looking."""

    scene: Scene
    seed: int
    assignment: Assignment
    variant: Variant
    rubric: RubricFile
    sheets: Sequence[SimulatedSheet]

    @property
    def declared(self) -> dict[str, str]:
        """The scales as the student declares them."""
        scales: Mapping[str, float] = self.sheets[0].truth["scales"]["declared"]
        return {name: f"{value!r} {_UNITS[name]}" for name, value in scales.items()}


def scene_named(name: str) -> Scene:
    """One of the scenes. Raises KeyError."""
    return {scene.name: scene for scene in SCENES}[name]


def works(scene: Scene, students: int, first_seed: int = 1) -> Iterator[Work]:
    """So many students of a scene; the same seeds give the same sheets."""
    for seed in range(first_seed, first_seed + students):
        yield work(scene, seed)


def work(scene: Scene, seed: int) -> Work:
    """One student of a scene."""
    assignment, rubric = task_named(scene.assignment)
    variants = assignment.variants()
    variant = variants[seed % len(variants)]
    settings = _settings(scene, assignment, variant, seed)
    printed = answer_sheets(assignment, variant) if scene.printed else None
    sheets = simulate(assignment, variant, seed, settings, printed=printed)
    return Work(scene, seed, assignment, variant, rubric, sheets)


@cache
def task_named(name: str) -> tuple[Assignment, RubricFile]:
    """A built-in assignment and its rubric."""
    assignment = load_assignment(name)
    return assignment, load_rubric(assignment.file.rubric, beside=assignment.path)


def _settings(scene: Scene, assignment: Assignment, variant: Variant, seed: int) -> Settings:
    """Somebody of the scene, drawn by lot; for wrong drawings somebody who makes a mistake."""
    lot = np.random.default_rng([seed, 9])
    hand = scene.hands[int(lot.integers(len(scene.hands)))]
    for again in range(_TRIES):
        settings = any_settings(
            seed + 100_000 * again, device=scene.device, dpi=scene.dpi, mistakes=scene.mistakes,
            work=(assignment, variant), hardship=scene.hardship,
        )  # fmt: skip
        if settings.student.mistakes or not scene.wrong:
            break
    return replace(settings, hand=hand)


def answer_sheets(assignment: Assignment, variant: Variant) -> Mapping[str, PrintedSheet]:
    """The answer sheet that this student is given."""
    row = RosterRow("s01", "", n=variant.n, position=variant.position)
    sheets = make_sheets(assignment, [row])
    return printed_sheets(sheets.pdf, sheets.layout)
