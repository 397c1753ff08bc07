"""Find whose data a drawing follows: the student's own, another variant's, misread ones, or nobody's.

The evidence is what a student is given and may not choose: the directions of links and vectors relative to
the ground, and the ratios of lengths. A declared scale changes none of them. Nothing is followed through
here: each part of the drawing (sketch, velocity plan, acceleration plan) is compared with the exact drawing
by each set of data, with propagated drafting errors; a vector that does not fit is an outlier, so that one or
two mistakes hide no owner. The posterior includes "somebody's data, but these" and "own data, with a
mistake".
"""

import cmath
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain, combinations

import numpy as np

from grader.comparison.evidence import DrawnVector, Evidence
from grader.comparison.task import Task
from grader.given_data.fit import fit_of, nobodys
from grader.given_data.rows import joined, rows_of
from grader.given_data.sets import (
    CRANK,
    ELSEWHERE,
    HALF_COPIED,
    LEAST_TURNED_MM,
    NOBODYS,
    Data,
    DrawnParts,
    ExactDrawings,
    drawn_by_variants,
    own_first,
    sets_of,
)
from grader.outcomes import NamedMistake
from grader.records import ACCELERATION_PLAN, MECHANISM, VELOCITY_PLAN
from grader.tables.scale_text import Declared, parsed_scales
from reference.construction.elements import Scaled
from reference.construction.mistakes import Mistake
from reference.construction.steps import Given
from reference.geometry import FloatArray
from reference.quantities import OF_MOTION, group_of, kind_of, sort_of


@dataclass(frozen=True, slots=True)
class Owner:
    """The set of data that a drawing, or a part of it, follows.

    Attributes
    ----------
    data : the likeliest set
    part : the plan that follows them while the rest follows the own data; ``mechanism`` for the whole drawing
    probability : that the part follows these data
    not_own : that it does not follow the own data, whosever it follows
    rivals : other sets that it may follow as well, with their probabilities
    has_directions : whether any direction is known, not lengths alone
    """

    data: Data
    part: str
    probability: float
    not_own: float
    rivals: tuple[tuple[Data, float], ...] = ()
    has_directions: bool = True

    @property
    def is_sure(self) -> bool:
        """True if it is sure enough to be reported."""
        return self.not_own >= (NAMED if self.has_directions else NAMED_BY_LENGTHS)

    @property
    def of_whole(self) -> Data | None:
        """The data that the whole drawing follows, or None if that is not sure."""
        return self.data if self.part == MECHANISM and self.is_sure else None

    @property
    def likeliest(self) -> NamedMistake:
        """The mistake of the likeliest set of data, if it is one."""
        others = tuple(_named(data, self.part, chance) for data, chance in self.rivals)
        return _named(self.data, self.part, self.probability, others)

    @property
    def named(self) -> NamedMistake | None:
        """The mistake, or None if it is not sure."""
        return self.likeliest if self.is_sure else None


NAMED, NAMED_BY_LENGTHS = 0.9, 0.99
"""Probability from which the owner of the data is named; below, a person is asked. Two mistakes may produce
the lengths of another variant, hardly its directions."""


def _named(data: Data, part: str, chance: float, rivals: tuple[NamedMistake, ...] = ()) -> NamedMistake:
    """Return a set of data as a mistake."""
    n, position = (data.variant.n, data.variant.position) if data.kind == "other_variant" else (None, None)
    mistake = Mistake(data.kind, part, n=n, position=position, parameters=data.parameters)
    return NamedMistake(mistake, (), chance, rivals=rivals)


# The posterior --------------------------------------------------------------------------------------

LIKELY = 0.05
"""From this probability of other than the own data, single mistakes are tried beside them; if it stays as
high, a person is asked: a copy marked in silence is as bad as twenty questions about honest sheets. The
priors together are less."""
APART = 0.01
"""Probability that the parts were not drawn from each other: a sketch drawn anew after the plans, a plan
drawn with another care."""
CRANK_ASKED = 0.15
"""Probability given to a crank that was sketched beyond all tolerances and not followed."""
LEAST_RIVAL = 0.04
"""A likelier set of data is named beside the best. Between sets that are not the own, differences of the
likelihood count half: drafting errors are more alike than independent ones."""


def owner_of(task: Task, evidence: Evidence, declared: Mapping[str, str]) -> Owner | None:
    """Return whose data the drawing follows; None if nothing contradicts the own ones.

    Arguments: `declared` are the scales as declared, text by name.
    """
    drawn = {part: vectors for part, vectors in _drawn(task, evidence).items() if vectors}
    if not drawn:
        return None
    everybody = own_first(drawn_by_variants(task), task)
    parsed = parsed_scales(task.assignment, declared).items()
    scales = {name: one.per_mm for name, one in parsed if isinstance(one, Declared)}
    for mistakes in (False, True):
        # Single mistakes are tried only if other data than the own are likely.
        sets = sets_of(task, drawn, everybody, mistakes=mistakes)
        posterior = posterior_of(task, evidence, drawn, sets, scales)
        if posterior.not_own < LIKELY:
            return _crank_elsewhere(task, drawn)
    directed = any(one.direction_rad is not None for vectors in drawn.values() for one in vectors.values())
    return replace(posterior.owner(), has_directions=directed)


def _crank_elsewhere(task: Task, drawn: DrawnParts) -> Owner | None:
    """Return the own data with the crank as sketched; None unless it is followed beyond all tolerances.

    What is drawn correctly from a wrong crank is the student's own work, its angle is not.
    """
    link = task.yardstick
    if link is None or task.omega is None:
        return None
    sketched = _turned_by(task, drawn, f"{link.tail}{link.head}")
    followed = [_turned_by(task, drawn, task.driving_vector(scale)) for scale in OF_MOTION]
    table = task.rubric.tolerance_of(task.driving_vector("kv"))
    limit = math.radians(table.direction_deg) * table.farthest
    if abs(sketched) <= limit or not any(abs(one - sketched) < limit < abs(one) for one in followed):
        return None
    angle = float(task.parameters[CRANK]) + sketched
    data = Data("data_misread", task.variant, ELSEWHERE, {**task.parameters, CRANK: np.asarray(angle)})
    return Owner(data, MECHANISM, CRANK_ASKED, CRANK_ASKED)


def _turned_by(task: Task, drawn: DrawnParts, name: str) -> float:
    """Return a vector's or link's turn from the given direction, radians; 0 if that is not sure."""
    found = next((vectors[name] for vectors in drawn.values() if name in vectors), None)
    real = task.segments[name].real if name in task.segments else 0j
    if found is None or found.direction_rad is None or not real:
        return 0.0
    if found.confidence < task.rubric.least_confidence or found.length_mm < LEAST_TURNED_MM:
        return 0.0
    return math.remainder(found.direction_rad - cmath.phase(real), math.tau)


def _drawn(task: Task, evidence: Evidence) -> dict[str, dict[str, DrawnVector]]:
    """Return the drawn vectors by part, as read, else as measured; all force plans are one part.

    Of forces only those laid off from the data count: a mistake of any kind follows through to all others.
    """
    parts: dict[str, str] = {}
    for figure in (MECHANISM, *task.construction.poles):
        parts.setdefault(sort_of(figure), figure)
    found: dict[str, dict[str, DrawnVector]] = {part: {} for part in parts.values()}
    for name, segment in task.segments.items():
        one = evidence.vector(name)
        figure, step = task.construction.figure_of(segment.head), task.construction.step(segment.head)
        follows = group_of(figure) and not (isinstance(step, Given) and isinstance(step.length, Scaled))
        if one is not None and one.length_mm > 0.0 and not follows:
            found[parts[sort_of(figure)]][name] = one
    return found


@dataclass(frozen=True, slots=True)
class Posterior:
    """Probabilities of whose data each part follows.

    Attributes
    ----------
    data : the sets, the own one first
    whole : (sets,) that the drawing as a whole follows a set
    parts : by part, (sets,) that this part alone follows it, while the whole follows the own data
    nobody : by part, that it follows no data
    """

    data: tuple[Data, ...]
    whole: FloatArray
    parts: Mapping[str, FloatArray]

    @property
    def is_own(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """(sets,) of the own data."""
        return np.array([one.kind == "own" for one in self.data])

    @property
    def not_own(self) -> float:
        """The probability that the drawing, or a part of it, does not follow the own data."""
        return float(sum(one[~self.is_own].sum() for one in (self.whole, *self.parts.values())))

    def owner(self) -> Owner:
        """Return the likeliest owner that is not the student."""
        each = {MECHANISM: self.whole, **self.parts}
        part = max(each, key=lambda name: float(each[name][~self.is_own].sum()))
        chances = np.where(self.is_own, 0.0, each[part])
        tempered = np.sqrt(chances) * (self.not_own / np.sqrt(chances).sum())
        order = np.argsort(-chances)
        best, *others = [(self.data[index], float(tempered[index])) for index in order[:4]]
        rivals = tuple((data, chance) for data, chance in others if chance >= LEAST_RIVAL)
        return Owner(best[0], part, best[1], self.not_own, rivals)


def posterior_of(
    task: Task,
    evidence: Evidence,
    drawn: DrawnParts,
    sets: tuple[ExactDrawings, FloatArray],
    scales: Mapping[str, float],
) -> Posterior:
    """Return the posterior of whose data each part follows.

    Arguments: `sets` are the exact drawings with their prior probabilities, `scales` those declared.
    """
    exact, prior = sets
    is_own = np.array([one.kind == "own" for one in exact.data])
    is_other = np.array([one.kind == "other_variant" for one in exact.data])
    second = () if _has_one_sketch(task, evidence) else (ACCELERATION_PLAN,)
    rows = {
        part: rows_of(task, evidence, vectors, exact, sheet=int(part in second))
        for part, vectors in drawn.items()
    }
    fits = {
        parts: fit_of(joined([rows[part] for part in parts]), is_own)
        for parts in _subsets(tuple(drawn))
        if parts
    }
    scaled = {part: _by_scale(task, drawn[part], scales, exact) for part in drawn}

    def likely(parts: tuple[str, ...]) -> FloatArray:
        """Return the log probability of parts that follow each set of data, some of them possibly none."""
        ways = []
        for follow in _subsets(parts):
            none = sum(math.log(NOBODYS) + nobodys(rows[part]) for part in parts if part not in follow)
            none += len(follow) * math.log1p(-NOBODYS)
            ways.append(none + fits.get(follow, np.zeros(len(prior))))
            if len(follow) > 1:
                apart = np.sum([fits[(part,)] for part in follow], axis=0)
                ways.append(none + math.log(APART) + apart)
        return np.asarray(np.logaddexp.reduce(ways) + sum(scaled[part] for part in parts))

    whole = np.log(prior) + likely(tuple(drawn))
    half = np.where(is_other, math.log(HALF_COPIED / max(int(is_other.sum()), 1)), -np.inf)
    parts = {}
    for part in drawn:
        rest = tuple(one for one in drawn if one != part)
        if part != MECHANISM and rest:
            of_rest = np.logaddexp.reduce((np.log(prior) + likely(rest))[is_own])
            parts[part] = half + likely((part,)) + of_rest
    every = np.concatenate([whole, *parts.values()])
    top = float(every.max())
    total = float(np.exp(every - top).sum())
    chances = {part: np.exp(one - top) / total for part, one in parts.items()}
    return Posterior(exact.data, np.exp(whole - top) / total, chances)


def _has_one_sketch(task: Task, evidence: Evidence) -> bool:
    """Return whether both plans follow the same sketch: as read, else as the assignment has its pages."""
    sketches = list(evidence.sketches.values())
    if len(sketches) > 1:
        return all(one == sketches[0] for one in sketches)
    pages = task.assignment.file.page
    return any({VELOCITY_PLAN, ACCELERATION_PLAN} <= set(page.figures) for page in pages)


def _subsets(parts: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Return all subsets of parts, in their order, including the empty one."""
    return chain.from_iterable(combinations(parts, count) for count in range(len(parts) + 1))


# Declared scales: weak evidence of whose data a plan follows ----------------------------------------

WRONG_SCALE, OF_ANY = 0.1, 0.5
"""Probability that a plan follows the rule's scale instead of the declared one, and any other scale; density
of the logarithm of the factor then."""
AT_DECLARED, AT_OWN_RULE = 0.4, 0.4
"""Probability that a copied plan follows the scale declared beside it, or that of its original author."""
SET_OFF_SHARE, SET_OFF_MM = 0.006, 0.4
"""Standard errors of the driving vector's length: from its rounded scale, and from drawing it."""


def _driving(
    task: Task, drawn: Mapping[str, DrawnVector], scales: Mapping[str, float]
) -> tuple[str, float] | None:
    """Return the driving link's vector of a plan, and its declared scale; None if either is missing."""
    for scale in OF_MOTION:
        name = task.driving_vector(scale)
        has_length = name in drawn and drawn[name].length_mm > 0.0
        if has_length and scale in scales and task.real.get(name):
            return name, scales[scale]
    return None


def _off_scale(drawn: DrawnVector, scale: float, real: FloatArray) -> tuple[FloatArray, float]:
    """Return the log ratio of a drawn length to a real value at a scale, and its standard error."""
    with np.errstate(all="ignore"):
        off = np.log(drawn.length_mm * scale / real)
    sigma = math.hypot(SET_OFF_SHARE, SET_OFF_MM / drawn.length_mm)
    return np.where(np.isfinite(off), off, np.inf), sigma


def _by_scale(
    task: Task, drawn: Mapping[str, DrawnVector], scales: Mapping[str, float], exact: ExactDrawings
) -> FloatArray:
    """Return the log probability of a plan's declared scale given its driving vector; (sets,).

    A copy may have the copied scale or the student's own: the scale says little, and never hides a copy.
    """
    found = _driving(task, drawn, scales)
    if found is None:
        return np.zeros(len(exact.data))
    name, declared = found
    real = np.abs(exact.real[name])
    is_other = np.array([one.kind == "other_variant" for one in exact.data])
    rule = np.array([one.rule.get(kind_of(name).scale, declared) for one in exact.data])
    at_declared, at_rule = (
        np.exp(-0.5 * (off / sigma) ** 2) / (sigma * math.sqrt(math.tau))
        for off, sigma in (_off_scale(drawn[name], declared, real), _off_scale(drawn[name], 1.0, real / rule))
    )
    copied = AT_DECLARED * at_declared + AT_OWN_RULE * at_rule + (1.0 - AT_DECLARED - AT_OWN_RULE) * OF_ANY
    own = (1.0 - 2.0 * WRONG_SCALE) * at_declared[0] + WRONG_SCALE * (at_rule[0] + OF_ANY)
    return np.asarray(np.log(np.where(is_other, copied, own)))
