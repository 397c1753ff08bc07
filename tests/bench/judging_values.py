"""What simulated students compute from their drawings: angular quantities, and values of vectors.

A value follows from the student's own drawn length, at the scale declared and the real length of the
link, its sense from the own drawing, rounded to three digits. So it is due its marks whatever was drawn
before, but for a slip: a right drawing's one value off by a factor.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from grader.rubric import CriterionTable
from reference.construction.graph import AngularRate, evaluate
from reference.construction.mistakes import Drawing
from reference.geometry import cross
from tests.bench.judging_rules import CLEAR, PLAIN, SHORT, Due, Seen
from tests.bench.judging_students import ON_SHEETS, SOURCES, Source, Work

SHARE = 0.4
"""Of students hand in angular quantities."""
RULER_MM = 0.2
DIGITS = 3
FACTORS = (0.1, 10.0, 0.5, 2.0, -1.0)
LEAST_SLIPPED_MM = 10.0
"""Slips are made in what is long enough to show them."""
LEAST_SINE = 0.5
"""A vector nearer to its link's own direction does not tell in which sense it turns it."""


@dataclass(frozen=True, slots=True)
class Computed:
    """What one student computed.

    Attributes
    ----------
    values : as handed in, SI, by vector or angular quantity
    right : as they follow from the own drawing
    slip : the one computed wrongly, None without one
    """

    values: Mapping[str, float] = field(default_factory=dict)
    right: Mapping[str, float] = field(default_factory=dict)
    slip: str | None = None
    factor: float = 1.0


def computed(work: Work) -> Computed:
    """The values of one student; most have none."""
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


def _vector(work: Work, name: str) -> str:
    """The vector that a value comes from."""
    rates = work.construction.rates
    return rates[name].vector if name in rates else name


def _rates(work: Work, lot: np.random.Generator) -> dict[str, float]:
    asked = {one.angular for one in work.rubric.criterion if one.angular}
    return {
        name: _rate(work, rate, _drawn(work, rate.vector), lot.normal(0.0, RULER_MM))
        for name, rate in work.construction.rates.items()
        if name in asked and rate.vector not in work.left_out
    }


def _rate(work: Work, rate: AngularRate, drawn: complex, slip_mm: float) -> float:
    link = _link(work, rate)
    length_m = length_of(work.task.wrong, rate, abs(link) * work.task.declared["kL"])
    scale = work.task.declared[work.construction.vectors[rate.vector].scale]
    return math.copysign(1.0, across(work, rate)) * max(abs(drawn) + slip_mm, 0.0) * scale / length_m


def _link(work: Work, rate: AngularRate) -> complex:
    own = work.own(work.construction.figure_of(work.construction.vectors[rate.vector].head))
    return own[rate.link[1]] - own[rate.link[0]]


def across(work: Work, rate: AngularRate) -> float:
    """The sine from a rate's link, as sketched, to its vector, as drawn: its sign is the sense."""
    link, drawn = _link(work, rate), _drawn(work, rate.vector)
    size = abs(link) * abs(drawn)
    return (link.conjugate() * drawn).imag / size if size else 0.0


def length_of(drawing: Drawing, rate: AngularRate, sketched_m: float) -> float:
    """The real length of a rate's link: given, or as on the sketch to the point of a slotted link."""
    given = drawing.parameters.get(rate.length)
    return sketched_m if given is None else float(given)


def _of_vectors(work: Work, lot: np.random.Generator) -> dict[str, float]:
    poles = set(work.construction.poles.values())
    return {
        name: max(abs(_drawn(work, name)) + lot.normal(0.0, RULER_MM), 0.0) * work.task.declared[vector.scale]
        for name, vector in work.construction.vectors.items()
        if vector.tail in poles and name in work.rubric.vectors and name not in work.left_out
    }


def _drawn(work: Work, name: str) -> complex:
    vector = work.construction.vectors[name]
    own = work.own(work.construction.figure_of(vector.head))
    return own[vector.head] - own[vector.tail]


def exact_rates(work: Work) -> dict[str, tuple[float, float]]:
    """Of each angular quantity its exact value, and what a millimetre of its vector is worth."""
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


def rate_due(work: Work, source: Source, criterion: CriterionTable, told: Computed, seen: Seen) -> Due:
    """Of a value rightly computed from the own drawing."""
    name = criterion.name
    if source not in SOURCES or name not in told.values:
        return "absent"
    exact, per_mm = exact_rates(work)[name]
    tolerance, value = work.rubric.tolerance_of(criterion), told.values[name]
    allowed = max(tolerance.length_mm, tolerance.length_relative * abs(exact) / per_mm) * per_mm
    apart = abs(value - exact) / allowed
    if apart <= PLAIN:
        return "right"
    rate = work.construction.rates[name]
    # A sense that came out the other way cannot be told from lengths, nor without the own sketch; nothing
    # can of a vector that was not seen, or of one that runs along the link instead of across.
    codes = {one.code for one in work.task.mistakes}
    sketch_seen = source in ON_SHEETS or not codes & {"other_assembly", "other_variant"}
    knows_sense = seen.directed.get(rate.vector, False) and sketch_seen
    is_told = rate.vector in seen.directed and (knows_sense or value * exact > 0.0)
    is_told &= abs(across(work, rate)) > LEAST_SINE and (rate.length in _lengths(work) or sketch_seen)
    # Speeds taken for rev/min are in these values though the drawing does not show them.
    is_told &= work.declares or "rpm_not_converted" not in codes
    if not is_told or abs(value) / per_mm < SHORT * tolerance.least_mm:
        return "either"
    return "follows" if apart > CLEAR else "right"


def _lengths(work: Work) -> set[str]:
    """Lengths that are given, and the same in the data that the student took."""
    right, taken = (one.parameters for one in (work.task.right, work.task.wrong))
    return {name for name, value in right.items() if name in taken and float(value) == float(taken[name])}
