"""Slips of entering: a whole submission in another unit, sense or axis, and single entries mistyped.

Each is a transformation of everything that was entered, tried before any mistake of a single step: the
entries as they stand, the entries undone, and entries that fit nothing are compared by their likelihood.
A slip of the drawing's entries counts only where both plans show it; what is left of the drawing is then
explained both ways, and the slip is undone where that explains it better.
"""

import cmath
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, product

import numpy as np

from grader.comparison.evidence import DrawnVector, Submission
from grader.comparison.scales import Scale
from grader.comparison.task import Task
from grader.outcomes import UsedScale
from grader.records import Reading, ReadVector
from reference.construction.elements import Scaled
from reference.construction.graph import Vector
from reference.construction.mistakes import RPM_FACTOR, Mistake
from reference.geometry import FloatArray, degrees
from reference.quantities import OF_MOTION, KindName, group_of, kind_of
from reference.replay.explanations import AREA_MM
from reference.replay.nothing import NOTHING_FITS

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
UNITS = "units"
PRICE = 12.0
"""Cost of each slip, -2 log of its probability: as rare as any other mistake."""
STRAY = 0.1
"""Share of the entries that may be anything: slips of units come with other mistakes."""
CARES = (0.5, 1.0, 2.0, 8.0)
"""Standard errors to try, as multiples of half a tolerance: large ones fit a drawing with mistakes."""
FITS = 4.0
"""Standard errors within which an entry fits: twice its tolerance."""
LEAST_ENTRIES = 2
"""Least entries of each plan: fewer do not show what all of them have in common."""
MOST_FIT = 0.5
"""Largest share of entries that fit as they stand: above it, there is no slip in all of them."""
SURE = 0.9
"""A slip less probable than this is not undone."""
DEGREE = math.pi / 180.0


@dataclass(frozen=True, slots=True)
class Undone:
    """A submission without its slips of units, and the slips, each with its probability.

    `entries` : how many vectors were measured
    """

    submission: Submission
    slips: tuple[tuple[Mistake, float], ...]
    entries: int = 0

    @property
    def is_drawing_changed(self) -> bool:
        """True if a slip is in the drawing's entries."""
        return any(one.at in {"directions", "lengths"} for one, _ in self.slips)

    @property
    def price(self) -> float:
        """The cost of the slips that change the drawing's entries, beside the cost of what was meant.

        Costs are of densities per millimetre: what was entered lies closer together than what was meant.
        """
        of_drawing = [one for one, _ in self.slips if one.at in {"directions", "lengths"}]
        closer = sum(2.0 * math.log(one.factor) for one in of_drawing if one.at == "lengths")
        return PRICE * len(of_drawing) - closer * self.entries


def undone(
    task: Task, submission: Submission, drawn: Mapping[str, DrawnVector], settled: Mapping[str, Scale]
) -> Undone | None:
    """The submission with slips of units undone; None where it has none.

    Arguments: `drawn` are its measured vectors, `settled` the scales used for marking.
    """
    scales = {name: scale.used for name, scale in settled.items()}
    slips: list[tuple[Mistake, float]] = []
    if submission.measured is not None and not submission.readings:
        entries = _Entries.of(task, drawn, scales)
        for found in (_directions(entries), _lengths(entries)):
            if found is not None:
                submission = replace(submission, measured=_changed(submission.measured, found.change))
                slips += [(one, found.probability) for one in found.mistakes]
    # Lengths in another unit looked like another scale.
    are_lengths_off = any(mistake.at == "lengths" for mistake, _ in slips)
    of_values = _values(task, submission.values, {} if are_lengths_off else settled)
    if of_values is not None:
        mistake, names, probability = of_values
        values = {
            name: value / mistake.factor if name in names else value
            for name, value in submission.values.items()
        }
        submission = replace(submission, values=values)
        slips.append((mistake, probability))
    return Undone(submission, tuple(slips), len(drawn)) if slips else None


# What was entered ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Entries:
    """Measured vectors beside the exact ones; arrays over the vectors.

    Attributes
    ----------
    exact_mm, drawn_mm : lengths
    exact_rad, drawn_rad : directions; nan where none was entered, or where the vector is too short for one
    sigma_mm, sigma_rad : standard errors, half of a tolerance
    plan : index of the plan
    given : 1 where the vector is laid off from the data alone, 0 where it follows from others
    """

    exact_mm: FloatArray
    drawn_mm: FloatArray
    exact_rad: FloatArray
    drawn_rad: FloatArray
    sigma_mm: FloatArray
    sigma_rad: FloatArray
    plan: FloatArray
    given: FloatArray

    @classmethod
    def of(cls, task: Task, drawn: Mapping[str, DrawnVector], scales: Mapping[str, UsedScale]) -> "_Entries":
        """The measured vectors that are asked for."""
        # A scale that nobody declared was taken from the lengths themselves.
        used = {**task.rule_scales, **{name: one.used for name, one in scales.items() if not one.assumed}}
        rows, plans = [], [*task.construction.poles]
        for name, one in drawn.items():
            if name not in task.construction.vectors:
                continue
            segment, table = task.segments[name], task.rubric.tolerance_of(name)
            # As entered, in the vector's own sense.
            exact, turn = segment.drawn(used) * cmath.rect(1.0, segment.turn_rad), one.turn_rad
            length = abs(exact)
            is_directed = one.direction_rad is not None and length >= max(table.least_mm, 1.0)
            turned = one.direction_rad + turn if is_directed and one.direction_rad is not None else math.nan
            across = math.atan(table.across_mm / max(length, table.across_mm))
            step = task.construction.laid_off(segment.tail, segment.head)
            is_given = step is not None and isinstance(step.length, Scaled)
            rows.append(
                (
                    length,
                    one.length_mm,
                    float(np.angle(exact)),
                    turned,
                    table.length_at(length) / 2.0,
                    max(math.radians(table.direction_deg), across) / 2.0,
                    float(plans.index(task.construction.figure_of(segment.head))),
                    float(is_given),
                )
            )
        return cls(*np.array(rows or np.zeros((0, 8)), np.float64).reshape(-1, 8).T)

    def only(self, which: BoolArray) -> "_Entries":
        """Some of the entries."""
        return _Entries(*(getattr(self, name)[which] for name in self.__slots__))

    def turned_by(self, convention: "_Convention") -> FloatArray:
        """Residuals (rad) of the directions entered by a convention; half a turn where they cannot be."""
        turned = (
            np.remainder(convention.undone(self.drawn_rad) - self.exact_rad + math.pi, math.tau) - math.pi
        )
        return np.where(np.isfinite(turned), turned, math.pi)

    def slip(
        self, residuals: Sequence[FloatArray], prices: Sequence[float], sigmas: FloatArray, anywhere: float
    ) -> tuple[int, float] | None:
        """The likeliest way in which all was entered, and its probability; None for the first, the right one.

        It must be likelier in each plan, as one plan alone has another mistake, and explain most of what is
        given and differs by it, as a mistake follows through; most must not fit as they stand.

        Arguments: of each way residuals and price; standard errors, and the range of any entry.
        """
        plans = [self.plan == index for index in range(max(2, int(self.plan.max(initial=0.0)) + 1))]
        if min(map(np.sum, plans)) < LEAST_ENTRIES:
            return None
        costs = [_cost(one, sigmas, anywhere) + price for one, price in zip(residuals, prices, strict=True)]
        best, probability = _chosen(costs, 2.0 * math.log(anywhere) * len(self.plan))
        if best == 0 or probability < SURE or _share(residuals[0], sigmas) > MOST_FIT:
            return None
        shown = (self.given > 0.0) & (np.abs(residuals[best] - residuals[0]) > FITS * sigmas)
        if shown.any() and _share(residuals[best][shown], sigmas[shown]) <= MOST_FIT:
            return None
        for plan in plans:
            found, right = (_cost(residuals[way][plan], sigmas[plan], anywhere) for way in (best, 0))
            if found >= right:
                return None
        return best, probability


def _cost(residuals: FloatArray, sigmas: FloatArray, anywhere: float) -> float:
    """-2 log of the likelihood of residuals, some of which may be anything within a range."""
    broad = STRAY / anywhere
    costs = []
    for care in CARES:
        sigma = care * sigmas
        density = np.exp(-0.5 * (residuals / sigma) ** 2) / (sigma * math.sqrt(math.tau))
        costs.append(float(-2.0 * np.log((1.0 - STRAY) * density + broad).sum()))
    return min(costs)


def _share(residuals: FloatArray, sigmas: FloatArray) -> float:
    """The share of the entries that fit."""
    return float(np.mean(np.abs(residuals) <= FITS * sigmas))


@dataclass(frozen=True, slots=True)
class _Found:
    """Slips, how each vector is undone, and their probability."""

    mistakes: tuple[Mistake, ...]
    change: Callable[[ReadVector], ReadVector]
    probability: float


def _chosen(costs: Sequence[float], anything: float) -> tuple[int, float]:
    """The likeliest hypothesis and its probability beside the others and beside entries that may be any."""
    best = int(np.argmin(costs))
    others = [*costs[:best], *costs[best + 1 :], NOTHING_FITS + anything]
    return best, 1.0 / (1.0 + sum(math.exp(min(costs[best] - one, 0.0) / 2.0) for one in others))


def _changed(measured: Reading, change: Callable[[ReadVector], ReadVector]) -> Reading:
    figures = {
        plan: replace(figure, vectors={name: change(one) for name, one in figure.vectors.items()})
        for plan, figure in measured.figures.items()
    }
    return replace(measured, figures=figures)


# Directions ---------------------------------------------------------------------------------------

AXES = ("+x", "+y", "-x", "-y")
"""From which directions were measured, by quarter turns counter-clockwise from +x."""
MOST_RADIANS = 2.0 * math.pi + 0.01


@dataclass(frozen=True, slots=True)
class _Convention:
    """A way to enter directions: unit, sense, and axis."""

    radians: bool
    clockwise: bool
    quarters: int

    def undone(self, entered_rad: FloatArray) -> FloatArray:
        """Directions, counter-clockwise from +x, nan where the entry cannot be one of these."""
        angle = np.remainder(entered_rad, math.tau)
        if self.radians:
            # What was typed are degrees here; negative ones have become nearly 360.
            typed = np.where(angle > math.pi, angle - math.tau, angle) / DEGREE
            angle = np.where(np.abs(typed) <= MOST_RADIANS, typed, np.nan)
        return np.asarray((-angle if self.clockwise else angle) + self.quarters * math.pi / 2.0)

    @property
    def mistakes(self) -> Iterator[Mistake]:
        """The slips, one for each difference from the convention."""
        if self.radians:
            yield Mistake(UNITS, "directions", other=("radians",), factor=1.0 / DEGREE)
        if self.clockwise:
            yield Mistake(UNITS, "directions", other=("clockwise",), factor=-1.0)
        if self.quarters:
            yield Mistake(UNITS, "directions", other=("axis", AXES[self.quarters]))


CONVENTIONS = tuple(_Convention(*one) for one in product((False, True), (False, True), range(4)))
"""The first one is the right one."""


def _directions(entries: _Entries) -> _Found | None:
    """The slips in all directions, if any."""
    entries = entries.only(np.isfinite(entries.drawn_rad))
    found = entries.slip(
        [entries.turned_by(one) for one in CONVENTIONS],
        [PRICE * len([*one.mistakes]) for one in CONVENTIONS],
        entries.sigma_rad,
        math.tau,
    )
    if found is None:
        return None
    convention, probability = CONVENTIONS[found[0]], found[1]

    def change(vector: ReadVector) -> ReadVector:
        if vector.direction_deg is None:
            return vector
        angle = convention.undone(np.array([math.radians(vector.direction_deg)]))[0]
        if not math.isfinite(angle):
            return vector
        return replace(vector, direction_deg=degrees(angle))

    return _Found(tuple(convention.mistakes), change, probability)


# Lengths ------------------------------------------------------------------------------------------

LENGTH_UNITS: Mapping[str, float] = {"cm": 10.0, "m": 1000.0}
PAPER_MM = 420.0
"""Longest vector on an A3 sheet: if declared scales ask for longer ones, these are wrong, not the lengths."""


def _lengths(entries: _Entries) -> _Found | None:
    """The unit of all lengths, where that is not millimetres."""
    factors = {"mm": 1.0}
    if entries.exact_mm.max(initial=0.0) <= PAPER_MM:
        factors |= LENGTH_UNITS
    found = entries.slip(
        [entries.drawn_mm * factor - entries.exact_mm for factor in factors.values()],
        [0.0 if unit == "mm" else PRICE for unit in factors],
        entries.sigma_mm,
        AREA_MM,
    )
    if found is None:
        return None
    (unit, factor), probability = [*factors.items()][found[0]], found[1]

    def change(vector: ReadVector) -> ReadVector:
        return vector if vector.length_mm is None else replace(vector, length_mm=vector.length_mm * factor)

    return _Found((Mistake(UNITS, "lengths", other=("lengths", unit), factor=factor),), change, probability)


# Values -------------------------------------------------------------------------------------------

VALUE_UNITS: Mapping[str, tuple[tuple[KindName, ...], float]] = {
    "cm/s": (("velocity", "acceleration"), 100.0),
    "mm/s": (("velocity", "acceleration"), 1000.0),
    "rev/min": (("omega",), RPM_FACTOR),
    "deg/s": (("omega", "epsilon"), 1.0 / DEGREE),
    "kN": (("force",), 0.001),
    "kN m": (("moment",), 0.001),
    "N mm": (("moment",), 1000.0),
}
"""By unit, the kinds of the quantities that are in it, and the factor of all of them."""
RELATIVE_SIGMA = 0.03
"""Standard error of a value's logarithm: of a length measured by hand and a scale."""
VALUE_RANGE = 10.0
"""Range of a wrong value's logarithm: anything between a hundredth and a hundredfold."""


def _values(
    task: Task, values: Mapping[str, float], settled: Mapping[str, Scale]
) -> tuple[Mistake, frozenset[str], float] | None:
    """The unit of all computed values of a kind, where that is not the SI's, and which values these are.

    They are computed at the scales declared, right or wrong. A unit is held against any other common factor.
    """
    followed = {name: one.used.used / (one.other or one.used.used) for name, one in settled.items()}
    vectors = task.construction.vectors
    right = {name: abs(real) * followed.get(vectors[name].scale, 1.0) for name, real in task.real.items()}
    for name, rate in task.construction.rates.items():
        right[name] = task.rates[name] * followed.get(vectors[rate.vector].scale, 1.0)
    ratios = {name: abs(value / float(right[name])) for name, value in values.items() if right.get(name)}
    known = {name: ratio for name, ratio in ratios.items() if 0.0 < ratio < math.inf}
    for unit, (kinds, factor) in VALUE_UNITS.items():
        names = [name for name in known if kind_of(name).name in kinds]
        if len(names) < LEAST_ENTRIES:
            continue
        logs = np.log([known[name] for name in names])
        sigmas = np.full(len(names), RELATIVE_SIGMA)
        residuals = (logs, logs - math.log(factor))
        as_asked, in_unit = (_cost(one, sigmas, VALUE_RANGE) for one in residuals)
        any_factor = min(_cost(logs - one, sigmas, VALUE_RANGE) for one in logs)
        any_factor += 2.0 * math.log(VALUE_RANGE * math.sqrt(len(names) / math.tau) / RELATIVE_SIGMA)
        costs = (as_asked, in_unit + PRICE, any_factor + PRICE)
        best, probability = _chosen(costs, 2.0 * math.log(VALUE_RANGE) * len(names))
        if best == 1 and probability >= SURE and _share(residuals[0], sigmas) <= MOST_FIT:
            mistake = Mistake(UNITS, "values", other=("values", unit), factor=factor)
            return mistake, frozenset(names), probability
    return None


def slip_of_value(name: str, ratio: float) -> Mistake:
    """The slip by which one value is so many times the right one: of a moment, perhaps its unit."""
    if kind_of(name).name == "moment":
        for unit, (kinds, factor) in VALUE_UNITS.items():
            if "moment" in kinds and math.isclose(abs(ratio), factor, rel_tol=2.0 * RELATIVE_SIGMA):
                return Mistake(UNITS, name, other=("moment", unit), factor=factor)
    return Mistake("arithmetic", name, factor=ratio)


# Scales -------------------------------------------------------------------------------------------

EXCHANGED = Mistake(UNITS, "scales", other=("exchanged",))


def with_scales_exchanged(submission: Submission) -> Submission | None:
    """The submission with what was declared as kv and ka exchanged; None unless both were declared."""
    kv, ka = (submission.declared.get(name, "").strip() for name in OF_MOTION)
    if not kv or not ka or kv == ka:
        return None
    return replace(submission, declared={**submission.declared, "kv": ka, "ka": kv})


# Single entries -----------------------------------------------------------------------------------

CLOSES, CONTRADICTS = 6.0, 30.0
"""Largest squared misfit, in standard errors, for each polygon of measured vectors if all close; and the
least that an entry put right must remove: as rare as any wrong entry."""
LEAST_POLYGONS = 2
"""A single polygon is closed by some change too often by chance."""
UNLIKE = 10.0
"""An entry that was less likely mistyped by so much, -2 log of the odds, is no rival of the likeliest."""
SINGLE = frozenset({"typing", "entries"})
"""The kinds of slips in single entries."""


def retyped(task: Task, submission: Submission, right: Collection[str]) -> Undone | None:
    """The submission with mistyped entries put right, one in each plan of motion; None where there are none.

    Only polygons of vectors show them, however wrong the drawing is: they close once a number is ten times
    larger or smaller, has two digits or its sense exchanged, or once two entries are exchanged; and no other
    entry explains that. Entries that are `right` are not mistyped.
    """
    if submission.measured is None or submission.readings:
        return None
    figures, slips = dict(submission.measured.figures), list[tuple[Mistake, float]]()
    for plan in (one for one in task.construction.poles if one in figures and not group_of(one)):
        read = figures[plan].vectors
        vectors = [one for one in task.construction.vectors_of(plan) if _is_whole(read.get(one.name))]
        ways = [one for one in _ways_to_enter(vectors, read) if one[1].keys().isdisjoint(right)]
        polygons = len(vectors) + 1 - len({end for one in vectors for end in (one.tail, one.head)})
        closes = CLOSES * polygons
        if not ways or polygons < LEAST_POLYGONS:
            continue
        if _misfit_and_cost(task, vectors, read)[0] <= closes + CONTRADICTS:
            continue
        fits = [_misfit_and_cost(task, vectors, {**read, **changed}) for _, changed in ways]
        (misfit, cost), (slip, meant) = min(zip(fits, ways, strict=True), key=lambda one: one[0][1])
        near = [way for (_, other), (_, way) in zip(fits, ways, strict=True) if other < cost + UNLIKE]
        if misfit <= closes and all(way.keys() == meant.keys() for way in near):
            figures[plan] = replace(figures[plan], vectors={**read, **meant})
            slips.append((slip, SURE))
    measured = replace(submission.measured, figures=figures)
    return Undone(replace(submission, measured=measured), tuple(slips)) if slips else None


def _is_whole(one: ReadVector | None) -> bool:
    return one is not None and bool(one.length_mm) and one.direction_deg is not None


def _misfit_and_cost(
    task: Task, vectors: Sequence[Vector], entries: Mapping[str, ReadVector]
) -> tuple[float, float]:
    """The squared gaps in the polygons of these vectors, in standard errors of measuring, and their cost.

    The cost is -2 log of the density of the entries per mm: wide errors make each entry rarer.
    """
    nodes, hand = dict.fromkeys(end for one in vectors for end in (one.tail, one.head)), task.rubric.hand
    read = [(entries[one.name], one.turn_rad) for one in vectors]
    lengths = np.array([one.length_mm for one, _ in read], np.float64)
    turns = np.array([math.radians(one.direction_deg or 0.0) - turn for one, turn in read])
    sigmas = math.sqrt(2.0) * np.hypot(hand.ruler_mm, lengths * math.radians(hand.protractor_deg))
    ends = [[float(node == one.head) - float(node == one.tail) for node in nodes] for one in vectors]
    rows, drawn = np.array(ends) / sigmas[:, None], lengths * np.exp(1j * turns) / sigmas
    left = drawn - rows @ np.linalg.lstsq(rows, drawn)[0]
    misfit = float(np.vdot(left, left).real)
    return misfit, misfit + 4.0 * float(np.log(sigmas).sum())


def _ways_to_enter(
    vectors: Sequence[Vector], read: Mapping[str, ReadVector]
) -> Iterator[tuple[Mistake, dict[str, ReadVector]]]:
    """Yield what may have been meant by one entry, or by two, with the slip."""
    for name, one in ((vector.name, read[vector.name]) for vector in vectors):
        size, turn = one.length_mm or 0.0, one.direction_deg or 0.0
        meant = [(size, number, replace(one, length_mm=number)) for number in _numbers(size)]
        turns = [number % 360.0 for number in (*_numbers(turn), turn + 180.0)]
        meant += [(turn, number, replace(one, direction_deg=number)) for number in turns]
        for typed, number, changed in meant:
            other = ("typing", f"{typed:.6g}", f"{number:.6g}")
            yield Mistake(UNITS, name, other=other), {name: changed}
    for first, second in combinations((vector.name for vector in vectors), 2):
        exchanged = {first: read[second], second: read[first]}
        yield Mistake(UNITS, first, other=("entries", second)), exchanged


def _numbers(entered: float) -> Iterator[float]:
    """Yield the numbers that may have been meant: with another decimal point, or two digits exchanged."""
    yield from (10.0 * entered, 0.1 * entered)
    text = f"{entered:.6g}"
    for i, j in pairwise(place for place, sign in enumerate(text) if sign.isdigit()):
        yield float(text[:i] + text[j] + text[i + 1 : j] + text[i] + text[j + 1 :])
