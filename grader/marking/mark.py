"""Judging one submission: comparison, diagnosis and points, in their order."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grader.comparison.criteria import NOT_DRAWN, Comparison, compare
from grader.comparison.evidence import Evidence, Submission
from grader.comparison.follow_through import ReplayResult
from grader.comparison.own import PlanBasis
from grader.comparison.scales import Scale
from grader.comparison.task import Task
from grader.documents import Verdict
from grader.marking.diagnosis import LEAST_CONFIDENCE, Case, Lost, drawn_instead, explained, named
from grader.marking.settling import at_stake, charged_where_made, of_another
from grader.outcomes import Judgement, NamedMistake, Outcome, Score
from grader.rubric import CriterionTable, RubricFile
from reference.authored.assignment import SCALE_NAMES
from reference.construction.elements import Coriolis, Normal, Parameters
from reference.construction.mistakes import Drawing, Mistake
from reference.construction.steps import Given
from reference.construction.uncertainty import trace
from reference.geometry import ComplexArray
from reference.plan import exact_plan
from reference.replay.explanations import Covariance, Observation, Observations

CHARGED = frozenset({"none", "partial"})
LOST = CHARGED | {"follow_through", "review"}
"""Verdicts for which the diagnosis seeks a cause, also where a person has still to decide."""


def judge(task: Task, submission: Submission) -> Judgement:
    """Verdicts, mistakes and points of one submission for one variant."""
    comparison = compare(task, submission, explain)
    mistakes = _named(task, comparison)
    mistakes = (*mistakes, *_swapped_letters(task, submission, mistakes), *_not_drawn(task, comparison))
    outcomes = charged_where_made(task, comparison.outcomes, mistakes)
    outcomes = at_stake(task.rubric, of_another(task.rubric, outcomes, mistakes))
    outcomes = tuple(with_mistake(outcome, mistakes) for outcome in outcomes)
    return Judgement(outcomes, mistakes, comparison.scales, score(task.rubric, outcomes))


def _named(task: Task, comparison: Comparison) -> tuple[NamedMistake, ...]:
    """The mistakes that explain lost points, or points that may be lost."""
    scales, vectors = comparison.settled, task.construction.vectors
    lost = [one for one in comparison.outcomes if one.verdict in LOST]
    by_vector = {one.name: one.criterion for one in lost if one.name in vectors}
    by_scale = {one.name: one.criterion for one in lost if one.name in scales and one.verdict in CHARGED}
    is_other_scale = any(scale.other and not scale.used.assumed for scale in scales.values())
    if not by_vector and not is_other_scale and not _is_nearer_to_another(task, comparison):
        return ()
    explanation = comparison.explanation or explain(task, comparison.evidence, scales)
    return named(explanation.explanations, task.construction, Lost(by_vector, by_scale))


CLEARLY_NEARER = 6.0
"""By so much the squared residuals, in halves of a tolerance, must fall with another student's data before
the whole drawing is searched for them."""


def _is_nearer_to_another(task: Task, comparison: Comparison) -> bool:
    """Whether the drawing fits another variant's exact vectors better than its own, however little is off.

    Neighbouring variants may differ by less than the tolerances.
    """
    evidence, vectors = comparison.evidence, task.construction.vectors
    own = {name: drawn for name in vectors if (drawn := evidence.vector(name)) is not None}
    if not own or len(task.assignment.variants()) < 2:
        return False
    variants = task.assignment.variants()
    exact = task.cached(("everybody",), lambda: _everybody(task))
    misfits = np.zeros(len(variants))
    for name, drawn in own.items():
        scale, at = comparison.scales[vectors[name].scale], drawn.as_complex
        right = exact[name] / (exact[vectors[name].scale] if scale.assumed else scale.used)
        residual = np.abs(right) - drawn.length_mm if at is None else right - at
        misfits += np.abs(2.0 * residual / task.rubric.tolerance_of(name).length_at(drawn.length_mm)) ** 2
    return bool(misfits[variants.index(task.variant)] - misfits.min() > CLEARLY_NEARER)


def _everybody(task: Task) -> Mapping[str, ComplexArray]:
    """The exact vectors (SI) and the rule's scales of all variants, an array each."""
    accelerations = task.rubric.needs_accelerations
    plan = exact_plan(task.assignment, task.assignment.variants(), accelerations=accelerations)
    scales = {name: np.asarray(getattr(plan.scales, name), np.complex128) for name in SCALE_NAMES}
    return {**plan.vectors_si, **scales}


def _swapped_letters(task: Task, submission: Submission, known: Sequence[NamedMistake]) -> list[NamedMistake]:
    """Letters read at each other's node on a sheet; the diagnosis uses lines alone and cannot find them."""
    vectors = task.construction.vectors
    pairs = {one.mistake.other for one in known if one.code == "labels_swapped"}
    found = []
    for swap in (swap for reading in submission.readings for swap in reading.swapped):
        pair = swap.first, swap.second
        if swap.confidence < LEAST_CONFIDENCE or {pair, pair[::-1]} & pairs:
            continue
        pairs.add(pair)
        explains = tuple(
            one.id
            for one in task.rubric.criterion
            if one.name in vectors and {vectors[one.name].tail, vectors[one.name].head} & set(pair)
        )
        mistake = Mistake("labels_swapped", swap.first, other=pair)
        found.append(NamedMistake(mistake, explains, swap.confidence))
    return found


def _not_drawn(task: Task, comparison: Comparison) -> list[NamedMistake]:
    """Vectors that are asked for and not on the sheet, or left blank in a table of measurements."""
    evidence, vectors = comparison.evidence, task.construction.vectors
    found = []
    for one in comparison.outcomes:
        codes = {reason.code for reason in one.reasons}
        is_left_blank = "not_measured" in codes and not evidence.has_sheets and one.verdict == "none"
        if one.name in vectors and ("not_drawn" in codes or is_left_blank):
            sure = NOT_DRAWN if evidence.has_sheets else 1.0
            found.append(NamedMistake(Mistake("vector_missing", one.name), (one.criterion,), sure))
    return found


def with_mistake(outcome: Outcome, mistakes: Sequence[NamedMistake]) -> Outcome:
    """The outcome with the mistake that explains its loss."""
    if outcome.verdict not in {"none", "partial"}:
        return outcome
    found = next((one for one in mistakes if outcome.criterion in one.explains), None)
    if found is None or outcome.mistake is not None:
        return outcome
    return replace(outcome, mistake=found.code, cause=found)


# Points --------------------------------------------------------------------------------------------

DECIMALS = 6
"""Decimals of points; further ones are rounding errors."""


def score(rubric: RubricFile, outcomes: Sequence[Outcome]) -> Score:
    """The points of all criteria and their total.

    What was not judged counts neither for nor against: a section that has a weight keeps it as long as
    any of it was judged, and the total is scaled to the rubric's. While anything is under review there
    is no total, only what it lies between. Where nothing at all was judged, the score is open between
    nothing and everything.
    """
    criteria, worth = {one.id: one for one in rubric.criterion}, rubric.points
    weighted = {section for section in rubric.sections if getattr(rubric.weights, section) is not None}
    points: dict[str, float | None] = {}
    totals: dict[str, _Total] = {}
    for outcome in outcomes:
        criterion = criteria[outcome.criterion]
        section = criterion.section if criterion.section in weighted else ""
        total = totals.setdefault(section, _Total(is_weighted=bool(section)))
        total.whole += worth[criterion.id]
        points[criterion.id] = None
        if outcome.verdict != "not_judged":
            worst, best = _shares(rubric, criterion, outcome)
            given = total.add(worth[criterion.id], worst, best, _expected_share(outcome, worst, best))
            points[criterion.id] = None if outcome.verdict == "review" else given
    maximum = rubric.max_score
    judged = sum(total.in_full for total in totals.values())
    if judged == 0.0:
        return Score(points, None, 0.0, maximum, maximum)
    low, high, expected = (
        round(sum(ends) * maximum / judged, DECIMALS)
        for ends in zip(*(total.ends for total in totals.values()), strict=True)
    )
    is_open = any(outcome.verdict == "review" for outcome in outcomes)
    return Score(points, None if is_open else low, low, high, maximum, expected)


def share_of(rubric: RubricFile, criterion: CriterionTable, verdict: Verdict) -> float:
    """The share of a criterion's points that a verdict gives: of a partial one, that of the nearest band."""
    bands = rubric.tolerance_of(criterion).all_bands
    shares: Mapping[str, float] = {
        "full": 1.0,
        "follow_through": 1.0,
        "partial": bands[0][1] if bands else 0.0,
        "none": 0.0,
    }
    return shares[verdict]


def _shares(rubric: RubricFile, criterion: CriterionTable, outcome: Outcome) -> tuple[float, float]:
    """The shares of a criterion's points that its verdict leaves, at worst and at best."""
    if outcome.shares:
        return outcome.shares[0], outcome.shares[-1]
    worst, best = (share_of(rubric, criterion, end) for end in outcome.possible)
    return worst, best


def _expected_share(outcome: Outcome, worst: float, best: float) -> float:
    """The mean share of the points over what the verdict may be."""
    is_open = outcome.verdict == "review"
    proposed = outcome.proposed if is_open else worst
    low, high = (worst, best) if is_open else (0.0, 1.0)
    otherwise = min(max(low + high - proposed, 0.0), 1.0)
    return outcome.probability * proposed + (1.0 - outcome.probability) * otherwise


@dataclass(slots=True)
class _Total:
    """The points of a section with a weight of its own, or of all that have none."""

    low: float = 0.0
    high: float = 0.0
    expected: float = 0.0
    judged: float = 0.0
    whole: float = 0.0
    is_weighted: bool = False

    def add(self, worth: float, worst: float, best: float, expected: float) -> float:
        """Count one criterion; returns its points at worst."""
        self.low, self.high = self.low + worst * worth, self.high + best * worth
        self.expected += expected * worth
        self.judged += worth
        return round(worst * worth, DECIMALS)

    @property
    def scale(self) -> float:
        """The factor that makes up for the criteria that were not judged."""
        return self.whole / self.judged if self.is_weighted and self.judged else 1.0

    @property
    def in_full(self) -> float:
        """The points it could give."""
        return self.judged * self.scale

    @property
    def ends(self) -> tuple[float, float, float]:
        """The points it gives at worst, at best, and in the mean."""
        return self.low * self.scale, self.high * self.scale, self.expected * self.scale


# What was drawn, for the diagnosis -----------------------------------------------------------------

LEAST_ERROR_MM = 0.15
"""Least standard error of a node, however well it is drawn and read."""
NO_ERRORS: ComplexArray = np.zeros(0, np.complex128)


def explain(task: Task, evidence: Evidence, settled: Mapping[str, Scale]) -> ReplayResult:
    """The explanations of a drawing, and the basis of its plans where that is certain."""
    case = case_of(task, evidence, settled)
    explanations = explained(case)
    drawn, wrong = drawn_instead(explanations, case)
    # Where a sheet shows the drawn mechanism and no plan is turned, the own nodes are enough.
    is_needed = wrong and (wrong & task.construction.poles.keys() or not evidence.has_sheets)
    basis = PlanBasis("instead", drawn.construction, drawn.parameters, wrong) if is_needed else None
    return ReplayResult(explanations, basis)


def case_of(task: Task, evidence: Evidence, settled: Mapping[str, Scale]) -> Case:
    """The drawing to explain at the scales used, with the scales that the drawing follows instead."""
    assumed = frozenset(name for name, scale in settled.items() if scale.used.assumed)
    others = {name: scale.other for name, scale in settled.items() if scale.other}
    used = {
        name: np.asarray(others.get(name, scale.used.used) if name in assumed else scale.used.used)
        for name, scale in settled.items()
    }
    parameters = {**task.parameters, **used}
    return Case(
        drawing=Drawing(task.construction, parameters),
        observations=Observations(tuple(_observations(task, evidence, parameters)), evidence.sketches),
        assignment=task.assignment,
        variant=task.variant,
        skill=task.skill,
        followed={
            name: other
            for name, other in others.items()
            if name not in assumed and other != settled[name].used.used
        },
        assumed=assumed,
    )


def _observations(task: Task, evidence: Evidence, parameters: Parameters) -> list[Observation]:
    """The student's own nodes, and the vectors that lead to none of them."""
    construction = task.construction
    given = {*construction.poles.values(), *task.ground}
    entries = [
        Observation(name, None, place, _reading_covariance(task, evidence, name))
        for name, place in evidence.nodes.items()
        if name not in given
    ]
    traced = None
    for name, vector in construction.vectors.items():
        drawn = evidence.vector(name)
        if drawn is None or drawn.confidence < task.rubric.least_confidence or vector.head in evidence.nodes:
            continue
        value, read_mm = drawn.as_complex, math.hypot(LEAST_ERROR_MM, drawn.se_mm, task.rubric.hand.ruler_mm)
        if value is not None:
            entries.append(Observation(vector.head, vector.tail, value, _covariance(NO_ERRORS, read_mm)))
            continue
        # The nodes before a length are not known: it contains all earlier errors.
        traced = traced or trace(construction, parameters, task.skill)
        spread = _covariance(traced.shifts(vector.tail, vector.head), read_mm)
        entries.append(Observation(vector.head, vector.tail, drawn.length_mm, spread, has_direction=False))
    return entries


def _reading_covariance(task: Task, evidence: Evidence, node: str) -> Covariance:
    """The covariance (mm^2) of a node by reading, or by the measurements that give it."""
    vectors = [one for one in task.construction.vectors.values() if one.head == node]
    hand = task.rubric.hand
    rows: list[ComplexArray] = [NO_ERRORS]
    each_mm = LEAST_ERROR_MM if evidence.has_sheets else hand.ruler_mm
    for vector in vectors[:1]:
        drawn = evidence.vector(vector.name)
        along = None if drawn is None else drawn.as_complex
        if along and not evidence.has_sheets:
            # Both ends of a step are measured.
            turned = 1j * along * math.radians(hand.protractor_deg)
            rows.append(
                math.sqrt(2.0) * np.array([hand.ruler_mm * along / abs(along), turned], np.complex128)
            )
        if along:
            share = _computed_within(task, evidence, node, math.sqrt(2.0) * each_mm)
            rows.append(np.array([along * share], np.complex128))
    return _covariance(np.concatenate(rows), LEAST_ERROR_MM)


def _computed_within(task: Task, evidence: Evidence, node: str, each_mm: float) -> float:
    """The relative error of a component that is computed from read or measured velocities."""
    sources: tuple[tuple[str, str, float], ...]
    match task.construction.step(node):
        case Given(length=Normal(tail=tail, head=head)):
            sources = ((tail, head, 2.0),)
        case Given(length=Coriolis(slide=slide, turn=turn)):
            sources = ((*slide, 1.0), (*turn, 1.0))
        case _:
            return 0.0
    ends = {
        name: place for one in sources for name in one[:2] if (place := evidence.nodes.get(name)) is not None
    }
    errors = [
        power * each_mm / max(abs(ends[head] - ends[tail]), each_mm)
        for tail, head, power in sources
        if tail in ends and head in ends
    ]
    return math.hypot(*errors)


def _covariance(shifts: ComplexArray, least_mm: float) -> Covariance:
    """The covariance (mm^2) of an end from independent errors, and a least error along both axes."""
    x, y = shifts.real, shifts.imag
    return float(x @ x) + least_mm**2, float(x @ y), float(y @ y) + least_mm**2
