"""How a simulated student's drawing reaches the judge, without pictures.

The same drawing is handed in three ways: as a perfect reader would read it (`nodes`), as its owner would
measure it with ruler and protractor (`directions`), and with the ruler alone (`lengths`).
"""

import cmath
import math
from collections.abc import Mapping

import numpy as np

from grader.comparison.evidence import Submission
from grader.records import (
    ACCELERATION_PLAN,
    MECHANISM,
    VELOCITY_PLAN,
    Figure,
    Reading,
    ReadNode,
    ReadVector,
    Swapped,
    Unread,
)
from tests.bench.judging_redrawn import vectors_of
from tests.bench.judging_students import Source, Work
from tests.bench.judging_values import computed

UNITS = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s^2)/mm"}
SE_MM = (0.05, 0.1)
"""A perfect reader's standard errors of a node lie between these."""
SURE = (0.95, 0.99)
RULER_MM, RULER_STEP_MM, PROTRACTOR_DEG, LEAST_TURN_MM = 0.2, 0.5, 0.4, 5.0
DRAWN_MM = 0.8
"""Shorter than this is a dot, not a vector: it is not measured unless it should be that short."""
PAPER = {MECHANISM: 100 - 90j, VELOCITY_PLAN: 300 - 90j, ACCELERATION_PLAN: 200 - 220j}

# As a perfect reader reads it -----------------------------------------------------------------------


def submission(work: Work, source: Source) -> Submission:
    """The student's work as it is handed in, without pictures."""
    declared = texts(work.task.declared) if work.declares else {}
    values, lot = computed(work).values, work.key.lot(source)
    if source == "nodes":
        return Submission(readings=_readings(work, lot), values=values, declared=declared)
    measured = _measured(work, lot, with_turn=source == "directions")
    return Submission(measured=measured, values=values, declared=declared)


def texts(scales: Mapping[str, float]) -> dict[str, str]:
    """Scales as they are declared."""
    return {name: f"{value!r} {UNITS[name]}" for name, value in scales.items()}


def _readings(work: Work, lot: np.random.Generator) -> tuple[Reading, ...]:
    se = float(lot.uniform(*SE_MM))
    readings = []
    for sheet in work.sheets:
        figures, unread, swapped = {}, [], []
        for drawn in sheet.figures:
            named = work.named(drawn.nodes, "nodes")
            places = {
                name: PAPER[drawn.name] + place + se * complex(*lot.standard_normal(2))
                for name, place in named.items()
            }
            nodes = {
                name: ReadNode(place, np.eye(2) * se**2, float(lot.uniform(*SURE)))
                for name, place in places.items()
            }
            figures[drawn.name] = Figure(nodes, _vectors(work, drawn.name, nodes, se))
            unread += [
                Unread(vector.name, f"no stroke between {vector.tail} and {vector.head} could be told apart")
                for vector in work.construction.vectors_of(drawn.name)
                if vector.name in work.left_out
            ]
            swapped += [
                Swapped(drawn.name, first, second, 0.97)
                for first, second in (work.swaps() if work.by_letters("nodes") else ())
                if first in nodes
            ]
        readings.append(Reading(figures, tuple(unread), swapped=tuple(swapped)))
    return tuple(readings)


def _vectors(work: Work, figure: str, nodes: Mapping[str, ReadNode], se: float) -> dict[str, ReadVector]:
    vectors = {}
    for vector in work.construction.vectors_of(figure):
        if vector.name in work.left_out:
            continue
        tail, head = nodes[vector.tail], nodes[vector.head]
        drawn = head.at - tail.at
        se_mm = math.sqrt(2.0) * se
        se_deg = min(math.degrees(se_mm / abs(drawn)), 90.0) if drawn else None
        turn = math.degrees(cmath.phase(drawn)) % 360.0 if drawn else None
        sure = min(tail.confidence, head.confidence)
        vectors[vector.name] = ReadVector(abs(drawn), se_mm, turn, se_deg, sure)
    return vectors


# As its owner measures it ---------------------------------------------------------------------------


def _measured(work: Work, lot: np.random.Generator, *, with_turn: bool) -> Reading:
    figures = {}
    right = vectors_of(work.task.right, ())
    for figure in work.construction.poles:
        vectors = {}
        named = work.named(work.own(figure), "lengths")
        for vector in work.construction.vectors_of(figure):
            drawn = named[vector.head] - named[vector.tail]
            ruled = abs(drawn) + lot.normal(0.0, RULER_MM)
            protracted = math.degrees(cmath.phase(drawn)) + lot.normal(0.0, PROTRACTOR_DEG)
            is_dot = abs(drawn) < DRAWN_MM < abs(right[vector.name])
            if vector.name in work.left_out or is_dot:
                continue
            length = max(0.0, round(ruled / RULER_STEP_MM) * RULER_STEP_MM)
            turn = None
            if with_turn and abs(drawn) > LEAST_TURN_MM:
                sketch = math.degrees(float(work.task.right.parameters["turn"]))
                turn = round(protracted - sketch) % 360.0
            vectors[vector.name] = ReadVector(length, 0.0, turn, None if turn is None else 0.0, 1.0)
        figures[figure] = Figure({}, vectors)
    return Reading(figures)
