"""Students of tests: what they measure or draw, exactly or with a known change."""

import cmath
import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from grader.comparison.evidence import Submission
from grader.comparison.task import Task, task_of
from grader.records import Figure, Reading, ReadNode, ReadVector
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment
from reference.construction.graph import evaluate
from reference.construction.mistakes import Drawing, Mistake, commit
from samples.simulation import HandStyle
from samples.simulation.drawing import drawn_nodes as drawn_with_instruments
from samples.simulation.wording import declared_texts

ZERO_MM = 1e-9


@cache
def task_for(name: str, n: int | None = None, position: int | None = None) -> Task:
    """A built-in task."""
    assignment = load_assignment(name)
    return task_of(assignment, rubric_of(assignment), assignment.variant(n, position))


def rule_scales(task: Task) -> dict[str, float]:
    """The assignment's own scales."""
    return dict(task.rule_scales)


def measured(
    task: Task,
    scales: Mapping[str, float] | None = None,
    *,
    directions: bool = True,
    mistakes: tuple[Mistake, ...] = (),
    by_similarity: bool = False,
) -> Reading:
    """All vectors as a perfect hand measures them, at some scales, with some mistakes followed through."""
    nodes = drawn_nodes(task, scales, mistakes, by_similarity=by_similarity)
    figures = {}
    for plan in task.construction.poles:
        vectors = {}
        for vector in task.construction.vectors_of(plan):
            drawn = nodes[vector.head] - nodes[vector.tail]
            known = directions and abs(drawn) > ZERO_MM
            # As the arrow points.
            drawn = -drawn if vector.reversed else drawn
            degrees = math.degrees(cmath.phase(drawn)) % 360.0 if known else None
            vectors[vector.name] = ReadVector(abs(drawn), 0.0, degrees, 0.0 if known else None, 1.0)
        figures[plan] = Figure({}, vectors)
    return Reading(figures)


def drawn_nodes(
    task: Task,
    scales: Mapping[str, float] | None = None,
    mistakes: tuple[Mistake, ...] = (),
    *,
    by_similarity: bool = False,
) -> dict[str, complex]:
    """All nodes as a perfect hand draws and names them; images of plates' points by lines or similarity."""
    used = scales or rule_scales(task)
    parameters = {**task.parameters, **{name: np.asarray(one) for name, one in used.items()}}
    drawing = Drawing(task.by_similarity if by_similarity else task.construction, parameters)
    for mistake in mistakes:
        drawing = commit(mistake, drawing)
    found = evaluate(drawing.construction, drawing.parameters)
    nodes = {name: complex(np.ravel(place)[0]) for name, place in found.items()}
    for mistake in mistakes:
        if mistake.code == "labels_swapped":
            first, second = mistake.other
            nodes[first], nodes[second] = nodes[second], nodes[first]
    return nodes


def changed(reading: Reading, name: str, **change: Any) -> Reading:
    """A reading with one vector changed."""
    figures = {}
    for plan, figure in reading.figures.items():
        vectors = dict(figure.vectors)
        if name in vectors:
            vectors[name] = replace(vectors[name], **change)
        figures[plan] = Figure(figure.nodes, vectors)
    return replace(reading, figures=figures)


def without(reading: Reading, *names: str) -> Reading:
    """A reading without some vectors."""
    figures = {
        plan: Figure(figure.nodes, {name: one for name, one in figure.vectors.items() if name not in names})
        for plan, figure in reading.figures.items()
    }
    return replace(reading, figures=figures)


def sheet(
    task: Task,
    scales: Mapping[str, float] | None = None,
    *,
    mistakes: tuple[Mistake, ...] = (),
    moved: Mapping[str, complex] | None = None,
    turn_deg: float = 0.0,
    se_mm: float = 0.02,
    confidence: float = 0.99,
    figures: tuple[str, ...] | None = None,
) -> Reading:
    """A sheet as read: every node exactly where it was drawn, the whole turned on the paper.

    Arguments: `moved` shifts single nodes, millimetres, after everything is drawn; `figures` are on it, all
    of them by default.
    """
    nodes = drawn_nodes(task, scales, mistakes)
    shift = {name: nodes[name] + (moved or {}).get(name, 0j) for name in nodes}
    turn = cmath.rect(1.0, math.radians(turn_deg))
    places = {"mechanism": 100 - 90j, "velocity_plan": 300 - 90j, "acceleration_plan": 200 - 220j}
    found, drawn_ones = {}, task.construction.figures
    for figure in (figure for figure in figures or drawn_ones if figure in drawn_ones):
        names = [step.node for step in task.construction.figures[figure]]
        read = {
            name: ReadNode(
                places.get(figure, 300 - 150j) + shift[name] * turn, np.eye(2) * se_mm**2, confidence
            )
            for name in names
        }
        vectors = {}
        for vector in task.construction.vectors_of(figure):
            # As the arrow points.
            drawn = (shift[vector.head] - shift[vector.tail]) * (-turn if vector.reversed else turn)
            length = abs(drawn)
            known = length > ZERO_MM
            degrees = math.degrees(cmath.phase(drawn)) % 360.0 if known else None
            se_deg = min(math.degrees(1.4 * se_mm / length), 90.0) if known else None
            vectors[vector.name] = ReadVector(length, 1.4 * se_mm, degrees, se_deg, confidence)
        found[figure] = Figure(read, vectors)
    return Reading(found)


# Hands that err -----------------------------------------------------------------------------------

SOURCES = ("sheet", "directions", "lengths")
RULER_MM, PROTRACTOR_DEG = 0.5, 1.0
"""To which a student reads a length and a direction."""


def drawn_by(
    task: Task, hand: HandStyle, lot: np.random.Generator, mistakes: tuple[Mistake, ...] = ()
) -> dict[str, complex]:
    """All nodes as a hand draws them, with some mistakes followed through."""
    drawing = Drawing(task.construction, task.parameters)
    for mistake in mistakes:
        drawing = commit(mistake, drawing)
    return drawn_with_instruments(drawing.construction, drawing.parameters, hand, lot)


def handed_in(
    task: Task, nodes: Mapping[str, complex], source: str, declared: Mapping[str, str] | None = None
) -> Submission:
    """Drawn nodes as a sheet that was read, or as measured with ruler and protractor or the ruler alone."""
    declared = declared or declared_texts(rule_scales(task))
    exact = drawn_nodes(task)
    moved = {name: nodes[name] - exact[name] for name in nodes}
    read = sheet(task, moved=moved)
    if source == "sheet":
        return Submission(readings=(read,), declared=declared)
    figures = {}
    for plan in task.construction.poles:
        vectors = {
            name: _measured_by_hand(one, with_direction=source == "directions")
            for name, one in read.figures[plan].vectors.items()
        }
        figures[plan] = Figure({}, vectors)
    return Submission(measured=Reading(figures), declared=declared)


def _measured_by_hand(one: ReadVector, *, with_direction: bool) -> ReadVector:
    length = round((one.length_mm or 0.0) / RULER_MM) * RULER_MM
    if not with_direction or one.direction_deg is None or not length:
        return ReadVector(length, 0.0, None, None, 1.0)
    turned = round(one.direction_deg / PROTRACTOR_DEG) * PROTRACTOR_DEG % 360.0
    return ReadVector(length, 0.0, turned, 0.0, 1.0)


# Nobody's drawing ---------------------------------------------------------------------------------

LONGEST_MM = 120.0
HALF_PAPER_MM = 80.0


def nonsense(
    task: Task,
    lot: np.random.Generator,
    *,
    closed: bool,
    directed: bool,
    plans: tuple[str, ...] | None = None,
) -> Reading:
    """Measured vectors that follow no construction: of random points (closed), or each at random.

    Arguments: `plans` are those that are nonsense (all by default); the others are drawn by a perfect hand.
    """
    right, figures = measured(task, directions=directed), {}
    for plan in task.construction.poles:
        if plans is not None and plan not in plans:
            figures[plan] = right.figures[plan]
            continue
        places = {
            step.node: complex(*lot.uniform(-HALF_PAPER_MM, HALF_PAPER_MM, 2))
            for step in task.construction.figures[plan]
        }
        vectors = {}
        for vector in task.construction.vectors_of(plan):
            turn = float(lot.uniform(0.0, math.tau))
            along = cmath.rect(float(lot.uniform(3.0, LONGEST_MM)), turn)
            if closed:
                along = places[vector.head] - places[vector.tail]
            as_read = ReadVector(abs(along), 0.0, math.degrees(cmath.phase(along)) % 360.0, 0.0, 1.0)
            vectors[vector.name] = _measured_by_hand(as_read, with_direction=directed)
        figures[plan] = Figure({}, vectors)
    return Reading(figures)
