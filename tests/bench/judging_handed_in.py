"""A simulated student's drawing as handed in without pictures, and the part of it that can be seen.

The same drawing is handed in three ways: as a perfect reader would read it (`nodes`), as its owner would
measure it with ruler and protractor (`directions`), and with the ruler alone (`lengths`). Some hand in values
computed from it: each follows from the student's own drawn length, the declared scale and the link's real
length, its sense from the own drawing, rounded to three digits. So it deserves its points whatever was drawn
before, except for a slip: one value of a right drawing wrong by a factor.
"""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

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
    Reason,
    Swapped,
    Unread,
)
from grader.rubric import CriterionTable, ToleranceTable
from reference.construction.graph import AngularRate, evaluate
from reference.geometry import cross
from samples.simulation.mistakes import Intent
from samples.simulation.wording import declared_texts
from tests.bench.judging_students import (
    ON_SHEETS,
    SOURCES,
    Source,
    StudentKey,
    StudentWork,
    student,
    vectors_of,
)

Due = Literal["right", "follows", "wrong", "either", "missed", "absent"]
CLEAR, PLAIN = 2.5, 1.0
"""Multiples of the rubric's tolerance beyond which it is clearly wrong, and up to which it is right."""
SHORT = 1.5
"""A value from a vector shorter than so many times the least to be judged may be taken for trivial."""


@dataclass(frozen=True, slots=True)
class Visible:
    """The vectors and links that the judge can see, and whether their directions are known."""

    directed: Mapping[str, bool]

    @classmethod
    def of(cls, handed_in: Submission, links: Mapping[str, tuple[str, str]]) -> "Visible":
        """Make it from a submission; a link is seen if both of its joints are."""
        readings = [*handed_in.readings, *([handed_in.measured] if handed_in.measured else [])]
        joints = {
            joint for one in readings if MECHANISM in one.figures for joint in one.figures[MECHANISM].nodes
        }
        vectors = {
            name: vector.direction_deg is not None
            for reading in readings
            for figure in reading.figures.values()
            for name, vector in figure.vectors.items()
        }
        return cls({**vectors, **{name: True for name, ends in links.items() if joints.issuperset(ends)}})


def off(drawn: complex, due: complex, tolerance: ToleranceTable, *, directed: bool) -> float:
    """The distance of two vectors in the rubric's plain tolerances; infinite if one is missing."""
    if not cmath.isfinite(due) or not cmath.isfinite(drawn):
        return math.inf
    allowed = max(tolerance.length_mm, tolerance.length_relative * abs(due))
    far = abs(abs(drawn) - abs(due)) / allowed
    if directed and min(abs(drawn), abs(due)) >= max(tolerance.least_mm, 1e-9):
        across = math.degrees(math.atan(tolerance.across_mm / abs(due)))
        turned = abs(math.degrees(math.remainder(cmath.phase(drawn) - cmath.phase(due), math.tau)))
        far = max(far, turned / max(tolerance.direction_deg, across))
    return far


SHARE = 0.4
"""Share of students who hand in angular quantities."""
RULER_MM = 0.2
DIGITS = 3
FACTORS = (0.1, 10.0, 0.5, 2.0, -1.0)
LEAST_SLIPPED_MM = 10.0
"""Slips are made in what is long enough to show them."""
LEAST_SINE = 0.5
"""A vector nearer to its link's own direction does not tell in which sense it turns it."""


@dataclass(frozen=True, slots=True)
class Computed:
    """The values that one student computed.

    Attributes
    ----------
    values : as handed in, SI, by vector or angular quantity
    right : as they follow from the student's own drawing
    slip : the value computed wrongly, None if there is none
    """

    values: Mapping[str, float] = field(default_factory=dict)
    right: Mapping[str, float] = field(default_factory=dict)
    slip: str | None = None
    factor: float = 1.0


def computed(work: StudentWork) -> Computed:
    """The values that a student computed; most computed none."""
    lot = work.key.lot("values")
    has_slip = work.key.kind == "slip"
    if (lot.random() >= SHARE and not has_slip) or any(work.swaps()):
        return Computed()
    right = {name: _rounded(value) for name, value in _rates(work, lot).items()}
    if not has_slip:
        return Computed(right, right)
    right |= {name: _rounded(value) for name, value in _of_vectors(work, lot).items()}
    able = [name for name in right if abs(_drawn(work, _vector(work, name))) > LEAST_SLIPPED_MM]
    if not able:
        return Computed(right, right)
    slip = able[int(lot.integers(len(able)))]
    factors = [one for one in FACTORS if one > 0.0 or slip in work.construction.rates]
    factor = float(lot.choice(factors))
    return Computed({**right, slip: right[slip] * factor}, right, slip, factor)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _vector(work: StudentWork, name: str) -> str:
    """The vector from which a value is computed."""
    rates = work.construction.rates
    return rates[name].vector if name in rates else name


def _rates(work: StudentWork, lot: np.random.Generator) -> dict[str, float]:
    asked = {one.angular for one in work.rubric.criterion if one.angular}
    return {
        name: _rate(work, rate, _drawn(work, rate.vector), lot.normal(0.0, RULER_MM))
        for name, rate in work.construction.rates.items()
        if name in asked and rate.vector not in work.left_out
    }


def _rate(work: StudentWork, rate: AngularRate, drawn: complex, slip_mm: float) -> float:
    link = _link(work, rate)
    length_m = length_of(work.task.wrong, rate, abs(link) * work.task.declared["kL"])
    scale = work.task.declared[work.construction.vectors[rate.vector].scale]
    return math.copysign(1.0, across(work, rate)) * max(abs(drawn) + slip_mm, 0.0) * scale / length_m


def _link(work: StudentWork, rate: AngularRate) -> complex:
    own = work.own(work.construction.figure_of(work.construction.vectors[rate.vector].head))
    return own[rate.link[1]] - own[rate.link[0]]


def across(work: StudentWork, rate: AngularRate) -> float:
    """The sine of the angle from a rate's sketched link to its drawn vector; its sign is the sense."""
    link, drawn = _link(work, rate), _drawn(work, rate.vector)
    size = abs(link) * abs(drawn)
    return (link.conjugate() * drawn).imag / size if size else 0.0


def length_of(drawing: Intent, rate: AngularRate, sketched_m: float) -> float:
    """The real length of a rate's link: as given, else as measured on the sketch."""
    given = drawing.parameters.get(rate.length)
    return sketched_m if given is None else float(given)


def _of_vectors(work: StudentWork, lot: np.random.Generator) -> dict[str, float]:
    poles = set(work.construction.poles.values())
    return {
        name: max(abs(_drawn(work, name)) + lot.normal(0.0, RULER_MM), 0.0) * work.task.declared[vector.scale]
        for name, vector in work.construction.vectors.items()
        if vector.tail in poles and name in work.rubric.vectors and name not in work.left_out
    }


def _drawn(work: StudentWork, name: str) -> complex:
    vector = work.construction.vectors[name]
    own = work.own(work.construction.figure_of(vector.head))
    return own[vector.head] - own[vector.tail]


def exact_rates(work: StudentWork) -> dict[str, tuple[float, float]]:
    """Each angular quantity's exact value, and its change for a millimetre of its vector."""
    drawing = work.task.right
    nodes = evaluate(drawing.construction, drawing.parameters)
    found = {}
    for name, rate in drawing.construction.rates.items():
        vector = drawing.construction.vectors[rate.vector]
        link = nodes[rate.link[1]] - nodes[rate.link[0]]
        drawn = nodes[vector.head] - nodes[vector.tail]
        length_m = length_of(drawing, rate, abs(complex(link)) * float(drawing.parameters["kL"]))
        per_mm = float(drawing.parameters[vector.scale]) / length_m
        sense = math.copysign(1.0, float(cross(np.asarray(link), np.asarray(drawn))))
        found[name] = sense * abs(complex(drawn)) * per_mm, per_mm
    return found


def rate_due(
    work: StudentWork, source: Source, criterion: CriterionTable, handed_in: Computed, visible: Visible
) -> Due:
    """The verdict due to a value rightly computed from the student's own drawing."""
    name = criterion.name
    if source not in SOURCES or name not in handed_in.values:
        return "absent"
    exact, per_mm = exact_rates(work)[name]
    tolerance, value = work.rubric.tolerance_of(criterion), handed_in.values[name]
    allowed = max(tolerance.length_mm, tolerance.length_relative * abs(exact) / per_mm) * per_mm
    apart = abs(value - exact) / allowed
    if apart <= PLAIN:
        return "right"
    rate = work.construction.rates[name]
    # A reversed sense cannot be found from lengths, nor without the student's own sketch; nothing can be
    # found for a vector that was not seen, or that is parallel to the link instead of perpendicular.
    codes = {one.code for one in work.task.mistakes}
    sketch_seen = source in ON_SHEETS or not codes & {"other_assembly", "other_variant"}
    knows_sense = visible.directed.get(rate.vector, False) and sketch_seen
    is_told = rate.vector in visible.directed and (knows_sense or value * exact > 0.0)
    is_told &= abs(across(work, rate)) > LEAST_SINE and (rate.length in _lengths(work) or sketch_seen)
    # Speeds mistaken for rev/min affect these values though the drawing does not show them.
    is_told &= work.declares or "rpm_not_converted" not in codes
    if not is_told or abs(value) / per_mm < SHORT * tolerance.least_mm:
        return "either"
    return "follows" if apart > CLEAR else "right"


def _lengths(work: StudentWork) -> set[str]:
    """The lengths that are given and equal in the data that the student took."""
    right, taken = (one.parameters for one in (work.task.right, work.task.wrong))
    return {name for name, value in right.items() if name in taken and float(value) == float(taken[name])}


SE_MM = (0.05, 0.1)
"""A perfect reader's standard errors of a node lie between these."""
SURE = (0.95, 0.99)
RULER_MM, RULER_STEP_MM, PROTRACTOR_DEG, LEAST_TURN_MM = 0.2, 0.5, 0.4, 5.0
DRAWN_MM = 0.8
"""Shorter than this is a dot, not a vector: it is not measured unless it should be that short."""
PAPER = {MECHANISM: 100 - 90j, VELOCITY_PLAN: 300 - 90j, ACCELERATION_PLAN: 200 - 220j}

# As a perfect reader reads it -----------------------------------------------------------------------


def submission(work: StudentWork, source: Source) -> Submission:
    """The student's work as handed in, without pictures."""
    declared = declared_texts(work.task.declared) if work.declares else {}
    values, lot = computed(work).values, work.key.lot(source)
    if source == "nodes":
        return Submission(readings=_readings(work, lot), values=values, declared=declared)
    measured = _measured(work, lot, with_turn=source == "directions")
    return Submission(measured=measured, values=values, declared=declared)


def _readings(work: StudentWork, lot: np.random.Generator) -> tuple[Reading, ...]:
    se = float(lot.uniform(*SE_MM))
    readings = []
    for sheet in work.sheets:
        figures, unread, swapped = {}, [], []
        for drawn in sheet.figures:
            named = work.named(drawn.nodes, "nodes")
            origin = PAPER.get(drawn.name, PAPER[VELOCITY_PLAN])
            places = {
                name: origin + place + se * complex(*lot.standard_normal(2)) for name, place in named.items()
            }
            nodes = {
                name: ReadNode(place, np.eye(2) * se**2, float(lot.uniform(*SURE)))
                for name, place in places.items()
            }
            figures[drawn.name] = Figure(nodes, _vectors(work, drawn.name, nodes, se))
            unread += [
                Unread(
                    vector.name, Reason("blank", {"start": vector.tail, "end": vector.head}), is_blank=True
                )
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


def _vectors(
    work: StudentWork, figure: str, nodes: Mapping[str, ReadNode], se: float
) -> dict[str, ReadVector]:
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


def _measured(work: StudentWork, lot: np.random.Generator, *, with_turn: bool) -> Reading:
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


def measured_line(key: StudentKey, *, with_directions: bool) -> dict[str, object]:
    """A student's line in a table of measurements. Raises ValueError if the drawing cannot be made."""
    work = student(key)
    handed_in = submission(work, "directions" if with_directions else "lengths")
    line: dict[str, object] = {"n": work.variant.n, "position": work.variant.position, **handed_in.declared}
    for figure in (handed_in.measured or Reading({})).figures.values():
        for name, vector in figure.vectors.items():
            line[name] = vector.length_mm
            if vector.direction_deg is not None:
                line[f"{name}_deg"] = vector.direction_deg
    line.update({f"{name}_value": value for name, value in handed_in.values.items()})
    return {name: value for name, value in line.items() if value is not None}
