"""Judge one submission: comparison, diagnosis and points, in this order."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from grader.comparison.criteria import NOT_DRAWN, Comparison, compare
from grader.comparison.evidence import DrawnVector, Submission, at_least, gather
from grader.comparison.outcomes import settled_as
from grader.comparison.scales import Scale
from grader.comparison.task import Task, tasks_at_speed
from grader.comparison.verdicts import FULL, NONE
from grader.given_data.owner import Owner, owner_of
from grader.marking.altitudes import with_causes, with_sources
from grader.marking.drawn import case_of, explain
from grader.marking.lettering import exchanged_pair, letters_charged, with_letters_exchanged, with_turned
from grader.marking.naming import LEAST_CONFIDENCE, Lost, drawn_instead, named, not_explained, speed_mistake
from grader.marking.settling import at_stake, is_of, of_another, of_nothing, settled
from grader.marking.units import (
    EXCHANGED,
    SINGLE,
    Undone,
    retyped,
    slip_of_value,
    undone,
    with_scales_exchanged,
)
from grader.outcomes import CHARGED, CREDITED, Judgement, NamedMistake, Outcome, Score
from grader.records import FloatArray, Reason
from grader.rubric import CriterionTable, RubricFile
from reference.authored.assignment import SCALE_NAMES
from reference.construction.graph import evaluate
from reference.construction.mistakes import OF_ALL, Mistake
from reference.quantities import OF_MOTION, kind_of, vector_of_value
from reference.replay.replay import Replay

LOST = CHARGED | {"follow_through", "review"}
"""Verdicts for which the diagnosis seeks a cause, also where a person has still to decide."""
AGREES, BY_CHANCE = 0.95, 0.03
"""Probabilities that a vector lies where it is predicted: of one read rightly, and of another stroke."""


def judge(task: Task, submission: Submission) -> Judgement:
    """Verdicts, mistakes and points of one submission for one variant.

    A wrong omega of the crank costs points once where more follows from it than from the right one. The omega
    of another variant whose data the drawing follows is no slip, unless the rubric marks that as any mistake.
    """
    best = judgement = _judged_as_entered(task, submission)
    slips = _speed_slips(task, submission.values)
    is_anothers = any(one.code == "other_variant" for one in judgement.mistakes)
    if not slips or (is_anothers and task.rubric.doubt.other_variant != "follow"):
        return judgement
    by = {one.at.partition("_")[0]: one.factor for one in slips}
    in_rpm = any(one.code == "units" and one.at == "values" for one in judgement.mistakes)
    entered, charged = compare(task, submission).outcomes, [(one, SLIPPED) for one in slips]
    for own in tasks_at_speed(task, (by.get("omega", 1.0), by.get("epsilon", 1.0))):
        meant = _judged_as_entered(own, submission)
        outcomes = _by_own_speed(task, judgement.outcomes, entered, meant.outcomes, slips[0].at)
        found = with_slips_charged(task.rubric, replace(meant, outcomes=outcomes), entered, charged)
        better = _earned(task.rubric, found) - _earned(task.rubric, best)
        if better > 0.0 or (in_rpm and best is judgement and better == 0.0):
            best = found
    if best is not judgement or in_rpm:
        return best
    asked = {criterion.angular for criterion in task.rubric.criterion}
    charged = [one for one in charged if one[0].at in asked]
    return with_slips_charged(task.rubric, judgement, entered, charged)


def _earned(rubric: RubricFile, judgement: Judgement) -> float:
    """The points likely earned, whatever else was judged: at a wrong scale vectors seem too short."""
    judged = (one for one in judgement.outcomes if one.verdict != "not_judged")
    return round(sum(rubric.points[one.criterion] * one.proposed for one in judged), DECIMALS)


MOST_SPEED = 1e4
"""A speed wrong by a larger factor is no speed: nothing is drawn from it."""


def _speed_slips(task: Task, values: Mapping[str, float]) -> list[Mistake]:
    """Return the mistakes in the omega and epsilon of the crank that were entered."""
    found = []
    for name in sorted(task.construction.driving, reverse=True):
        value, right = values.get(name, 0.0), task.rates[name]
        # A magnitude without its sense has only lost that.
        size = -value if value > 0.0 > right and not values.get(f"{name}_sense") else value
        within, factor = task.rubric.tolerance_of(name).scale_relative, size / right if right else 0.0
        if abs(factor - 1.0) > within and 1.0 / MOST_SPEED < abs(factor) < MOST_SPEED:
            is_turned = abs(factor + 1.0) <= within
            slip = Mistake("sense_reversed" if is_turned else "arithmetic", name, factor=factor)
            is_speed = name.startswith("omega") and not is_turned
            found.append(speed_mistake(slip, task.gear_ratio) if is_speed else slip)
    return found


def _by_own_speed(
    task: Task, right: Sequence[Outcome], entered: Sequence[Outcome], own: Sequence[Outcome], of: str
) -> tuple[Outcome, ...]:
    """The outcomes by the student's own omega; that itself, as it was entered.

    Arguments: `right` are those by the right omega, `of` is the quantity from which the others follow.
    """
    follows, found = (Reason("follows", {"what": "value", "of": of}),), []
    for criterion, by_right, raw, meant in zip(task.rubric.criterion, right, entered, own, strict=True):
        is_new = meant.verdict == "full" and raw.verdict != "full"
        outcome = settled_as(meant, "follow_through", FULL, follows) if is_new else meant
        outcome = outcome if task.rubric.follows_through(criterion) else by_right
        found.append(raw if criterion.turning in task.construction.driving else outcome)
    return tuple(found)


def _judged_as_entered(task: Task, submission: Submission) -> Judgement:
    """The judgement by the given data, slips of units undone."""
    owner = owner_of(task, gather(task, submission), submission.declared)
    comparison = compare(task, submission, partial(explain, owner=owner))
    slips: list[tuple[Mistake, float]] = []
    as_entered = comparison.outcomes
    if any(one.verdict in LOST for one in comparison.outcomes):
        exchanged = _with_scales_exchanged(task, submission, comparison)
        if exchanged is not None:
            submission, comparison = exchanged
            slips.append((EXCHANGED, SLIPPED))
        as_meant = undone(task, submission, comparison.evidence.measured, comparison.settled)
        meant = None if as_meant is None else compare(task, as_meant.submission, explain)
        if as_meant and meant and _is_explained_better(task, meant, comparison, as_meant):
            submission, comparison = as_meant.submission, meant
            slips += as_meant.slips
        right = {one.name for one in comparison.outcomes if one.verdict in CREDITED}
        as_meant = retyped(task, submission, right)
        meant = None if as_meant is None else compare(task, as_meant.submission, explain)
        if as_meant and meant and not _charges_more(meant, comparison):
            submission, comparison = as_meant.submission, meant
            slips += as_meant.slips
    if slips:
        owner = owner_of(task, comparison.evidence, submission.declared)
        comparison = comparison if owner is None else compare(task, submission, partial(explain, owner=owner))
    judgement = _with_arrows_turned(task, submission, comparison, owner)
    return with_slips_charged(task.rubric, judgement, as_entered, slips) if slips else judgement


def _charges_more(meant: Comparison, entered: Comparison) -> bool:
    """Return whether anything is charged in what was meant and not in what was entered."""
    pairs = zip(meant.outcomes, entered.outcomes, strict=True)
    return any(new.verdict in CHARGED and old.verdict not in CHARGED for new, old in pairs)


def _with_scales_exchanged(
    task: Task, submission: Submission, comparison: Comparison
) -> tuple[Submission, Comparison] | None:
    """The submission with kv and ka exchanged, compared; None where that does not put both right."""
    other = with_scales_exchanged(submission)
    if other is None or not all(_is_off(comparison.settled[name]) for name in OF_MOTION):
        return None
    exchanged = compare(task, other, explain)
    scales, after = ([one.settled[name] for name in OF_MOTION] for one in (comparison, exchanged))
    are_other_units = all(one.used.refused for one in scales) and not any(one.used.refused for one in after)
    return (other, exchanged) if are_other_units or not any(map(_is_off, after)) else None


def _is_explained_better(task: Task, meant: Comparison, entered: Comparison, slips: Undone) -> bool:
    """Return whether a submission is explained better without its slips of units, these at their price."""
    if not slips.is_drawing_changed:
        return True
    without = _cost_of(task, meant)
    with_slips = None if without is None else _cost_of(task, entered)
    return without is None or (with_slips is not None and without + slips.price < with_slips)


def _cost_of(task: Task, comparison: Comparison) -> float | None:
    """The cost of the likeliest explanation of a drawing; None where it may be right."""
    found = comparison.explanation or explain(task, comparison.evidence, comparison.settled)
    return found.explanations[0].cost if found.explanations else None


def _is_off(scale: Scale) -> bool:
    """Return whether a declared scale was not understood, or is not the one that the drawing follows."""
    return scale.used.refused is not None or (scale.other is not None and not scale.used.assumed)


def _with_arrows_turned(
    task: Task, submission: Submission, comparison: Comparison, owner: Owner | None
) -> Judgement:
    """The judgement of a submission; forces that are right but for their arrows are turned, and charged.

    Such a force is credited once it is turned, and nothing else is charged for it. One mistake that explains
    all and was made in that force itself stays.
    """
    judgement, as_entered, slips = _judged(task, submission, comparison, owner), comparison.outcomes, []
    named_here = [one.at for one in judgement.mistakes]
    in_all = tuple(at for at in named_here if at in OF_ALL)
    is_reversed = any(one.code == "inertia_reversed" for one in judgement.mistakes)
    for index, one in enumerate(as_entered):
        is_force = one.name in task.construction.vectors and kind_of(one.name).name == "force"
        if not is_force or one.verdict not in CHARGED or named_here == [one.name]:
            continue
        if one.name.startswith(in_all):
            continue  # All of its kind are.
        turned = with_turned(submission, one.name)
        meant = compare(task, turned, partial(explain, owner=owner))
        if meant.outcomes[index].verdict in CREDITED and not _charges_more(meant, comparison):
            submission, comparison = turned, meant
            is_alike = is_reversed and one.name.startswith("F_i")
            code = "inertia_reversed" if is_alike else "force_reversed"
            slips.append((Mistake(code, one.name), SLIPPED))
    if not slips:
        return judgement
    judgement = _judged(task, submission, comparison, owner)
    return with_slips_charged(task.rubric, judgement, as_entered, slips)


def _judged(task: Task, submission: Submission, comparison: Comparison, owner: Owner | None) -> Judgement:
    """The judgement of a submission that was compared."""
    search = partial(explain, owner=owner)
    surer = _confirmed(task, submission, comparison)
    if surer is not None:
        submission, comparison = surer, compare(task, surer, search)
    explanations, mistakes = _diagnosed(task, comparison, owner)
    pair = exchanged_pair(mistakes)
    used = {name: scale.used for name, scale in comparison.scales.items()}
    if pair is not None:
        letters = [one for one in mistakes if one.code == "labels_swapped"]
        submission = with_letters_exchanged(task, submission, pair, used)
        comparison = compare(task, submission, search)
        explanations, others = _diagnosed(task, comparison, owner)
        mistakes = (*letters, *(one for one in others if one.code != "labels_swapped"))
    read = _swapped_letters(task, submission, mistakes)
    mistakes = (*mistakes, *read)
    mistakes = (*mistakes, *_not_drawn(task, comparison, mistakes))
    mistakes = (*mistakes, *_slips(task, comparison, mistakes))
    outcomes = letters_charged(
        task,
        comparison.outcomes,
        mistakes,
        read,
        lambda pair: compare(task, with_letters_exchanged(task, submission, pair, used)).outcomes,
    )
    outcomes = _left_out(task, outcomes, mistakes)
    outcomes, unfit = of_nothing(task, outcomes, not_explained(explanations))
    outcomes = at_stake(task.rubric, outcomes)
    if unfit is None or (owner is not None and owner.named is not None):
        outcomes = of_another(task, outcomes, owner)
    outcomes = tuple(with_sources(task, comparison, submission.readings, outcomes))
    mistakes = with_causes(task.construction, outcomes, mistakes)
    outcomes = tuple(with_mistake(outcome, mistakes) for outcome in outcomes)
    return Judgement(outcomes, mistakes, comparison.scales, score(task.rubric, outcomes), unfit)


def _diagnosed(
    task: Task, comparison: Comparison, owner: Owner | None
) -> tuple[Sequence[Replay], tuple[NamedMistake, ...]]:
    """Return the explanations of lost points, and the mistakes named; whose data they are goes first."""
    explanations, lost = _explanations(task, comparison, owner)
    other = None if owner is None else owner.named
    directed = any(one.direction_rad is not None for one in comparison.evidence.drawn.values())
    mistakes = named(explanations, task.construction, lost, has_directions=directed)
    if owner is not None and other is not None:
        losing = [one for one in comparison.outcomes if one.verdict in LOST]
        explained = tuple(one.criterion for one in losing if is_of(task, one.name, owner.part))
        mistakes = (replace(other, explains=explained), *mistakes)
    return explanations, mistakes


def _explanations(task: Task, comparison: Comparison, owner: Owner | None) -> tuple[Sequence[Replay], Lost]:
    """Return the explanations of lost points, or of points that may be lost, and the criteria concerned.

    Where one plan follows other data than the rest, nothing explains what is drawn from it, or into it.
    """
    scales, vectors = comparison.settled, task.construction.vectors
    lost = [one for one in comparison.outcomes if one.verdict in LOST]
    links = task.construction.links
    by_vector = {one.name: one.criterion for one in lost if one.name in vectors or one.name in links}
    by_scale = {one.name: one.criterion for one in lost if one.name in scales and one.verdict in CHARGED}
    is_other_scale = any(scale.other and not scale.used.assumed for scale in scales.values())
    explanations: Sequence[Replay] = ()
    is_of_two = owner is not None and owner.named is not None and owner.of_whole is None
    if (by_vector or is_other_scale) and not is_of_two:
        explanation = comparison.explanation or explain(task, comparison.evidence, scales, owner=owner)
        explanations = explanation.explanations
    right = {one.name for one in comparison.outcomes if one.verdict in CREDITED and one.name in vectors}
    return explanations, Lost(by_vector, by_scale, task.gear_ratio, frozenset(right))


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


def _not_drawn(task: Task, comparison: Comparison, known: Sequence[NamedMistake]) -> list[NamedMistake]:
    """Vectors that are asked for and not on the sheet, or left blank in a table of measurements.

    None of a component that is known to have been left out.
    """
    left_out = {one.at for one in known if one.code in {"normal_missing", "force_missing"}}
    evidence, vectors = comparison.evidence, task.construction.vectors
    found = []
    for one in comparison.outcomes:
        is_table = bool(evidence.measured) and not evidence.has_sheets
        is_left_blank = "not_measured" in one.codes and is_table and one.verdict == "none"
        is_left_out = one.name.startswith(tuple(left_out))
        if one.name not in vectors or is_left_out or vectors[one.name].head in left_out:
            continue
        if "not_drawn" in one.codes or is_left_blank:
            sure = NOT_DRAWN if evidence.has_sheets else 1.0
            found.append(NamedMistake(Mistake("vector_missing", one.name), (one.criterion,), sure))
    return found


def _left_out(task: Task, outcomes: Sequence[Outcome], known: Sequence[NamedMistake]) -> tuple[Outcome, ...]:
    """Return the outcomes; unread components are lost with the probability that they were left out."""
    sure = {one.at: one.confidence for one in known if one.code == "normal_missing"}
    vectors = task.construction.vectors

    def likely(one: Outcome) -> Outcome:
        at = vectors[one.name].head if one.name in vectors else ""
        is_unread = one.verdict == "review" and one.measured.length_mm is None
        return replace(one, probability=max(one.probability, sure[at])) if is_unread and at in sure else one

    return tuple(map(likely, outcomes))


VALUE_OFF = frozenset({"value_too_large", "value_too_small"})
LEAST_SLIPPED_MM = 10.0
"""A value from a shorter vector may be off because it was read badly."""
LEAST_SLIP = 0.2
"""An angular quantity that is wrong by a smaller share may come from lengths measured badly."""
SLIPPED = 0.95
"""Confidence in a slip: the drawing that the value comes from is right."""


def _slips(task: Task, comparison: Comparison, known: Sequence[NamedMistake]) -> list[NamedMistake]:
    """Values that were computed wrongly from a right vector, and centres of links from a mirrored triangle.

    Of angular quantities only where no mistake is known: they depend on links and senses, too.
    """
    sure = {
        one.name
        for one in comparison.outcomes
        if one.verdict == "full" and (one.measured.length_mm or 0.0) >= LEAST_SLIPPED_MM and not known
    }
    of_vectors, of_rates = [], []
    for one in comparison.outcomes:
        rate = task.construction.rates.get(one.name)
        is_value_off = one.verdict in CHARGED and VALUE_OFF & one.codes
        value, right = one.measured.value, one.expected.value
        factor = value / right if value and right else 1.0
        at = vector_of_value(one.name) or one.name
        slip = NamedMistake(slip_of_value(at, factor), (one.criterion,), SLIPPED)
        is_unit = slip.code == "units" and one.verdict in CHARGED and "value_reversed" in one.codes
        is_moment_off = one.name in task.construction.moments and (is_value_off or is_unit)
        if one.mistake == "arithmetic" or is_moment_off:
            of_vectors.append(slip)
        elif one.mistake == "image_mirrored":
            of_vectors.append(replace(slip, mistake=Mistake("image_mirrored", one.name)))
        elif rate is None or rate.drives:
            continue
        elif rate.vector in sure and is_value_off and abs(factor - 1.0) >= LEAST_SLIP:
            of_rates.append(slip)
    # Several of them have one cause that is elsewhere.
    return of_vectors + (of_rates if len(of_rates) == 1 else [])


def with_mistake(outcome: Outcome, mistakes: Sequence[NamedMistake]) -> Outcome:
    """The outcome with the mistake that explains its loss."""
    found = next((one for one in mistakes if outcome.criterion in one.explains), None)
    if found is None or outcome.verdict not in CHARGED or outcome.mistake is not None:
        return outcome
    return replace(outcome, mistake=found.code, cause=found)


def with_slips_charged(
    rubric: RubricFile,
    judgement: Judgement,
    as_entered: Sequence[Outcome],
    slips: Sequence[tuple[Mistake, float]],
) -> Judgement:
    """The judgement of what was meant, with each slip of units charged once: where it shows first.

    Arguments: `as_entered` are the outcomes of what was entered.
    """
    outcomes, named_slips = list(judgement.outcomes), []
    asked = {one.name: index for index, one in enumerate(rubric.criterion)}
    for slip, probability in slips:
        places = (
            index
            for index, (meant, entered) in enumerate(zip(outcomes, as_entered, strict=True))
            if meant.verdict in CREDITED and _shows(slip, entered)
        )
        is_single = not SINGLE.isdisjoint(slip.other[:1])
        index = asked.get(slip.at, None if is_single else next(places, None))
        criteria = () if index is None else (outcomes[index].criterion,)
        one = NamedMistake(slip, criteria, probability)
        named_slips.append(one)
        if index is not None:
            lost = as_entered[index]
            if is_single and lost.verdict not in CHARGED:
                lost = replace(settled(lost, NONE, probability), reasons=())
            lost = lost if slip.at in asked else settled(lost, NONE, probability)
            outcomes[index] = replace(lost, mistake=one.code, cause=one)
    return replace(
        judgement,
        outcomes=tuple(outcomes),
        mistakes=(*named_slips, *judgement.mistakes),
        score=score(rubric, outcomes),
    )


def _shows(slip: Mistake, entered: Outcome) -> bool:
    """Return whether a criterion as entered loses by a slip of units: values apart from what was drawn."""
    if slip.at == "scales":
        return entered.name in SCALE_NAMES and entered.verdict not in CREDITED
    return entered.verdict in CHARGED and (slip.at != "values" or bool(VALUE_OFF & entered.codes))


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
    points: dict[str, float | None] = {}
    wholes: dict[str, float] = defaultdict(float)
    # By section: the points that were judged, those at worst, at best, and in the mean.
    sums: dict[str, FloatArray] = defaultdict(lambda: np.zeros(4))
    for outcome in outcomes:
        criterion, most = criteria[outcome.criterion], worth[outcome.criterion]
        section = criterion.section if rubric.weight_of(criterion.section) is not None else ""
        wholes[section] += most
        points[criterion.id] = None
        if outcome.verdict != "not_judged":
            worst, best = _shares(rubric, criterion, outcome)
            sums[section] += most * np.array([1.0, worst, best, _expected_share(outcome, worst, best)])
            if outcome.verdict != "review":
                points[criterion.id] = round(worst * most, DECIMALS)
    maximum = rubric.max_score
    if not sums:
        return Score(points, None, 0.0, maximum, maximum)
    kept = [each * (wholes[section] / each[0] if section else 1.0) for section, each in sums.items()]
    judged, *ends = np.sum(kept, axis=0).tolist()
    low, high, expected = (round(end * maximum / judged, DECIMALS) for end in ends)
    is_open = any(outcome.verdict == "review" for outcome in outcomes)
    return Score(points, None if is_open else low, low, high, maximum, expected)


def _shares(rubric: RubricFile, criterion: CriterionTable, outcome: Outcome) -> tuple[float, float]:
    """The shares of a criterion's points that its verdict leaves, at worst and at best.

    Where the verdict alone says it, a partial one gives that of the nearest band.
    """
    bands = rubric.tolerance_of(criterion).all_bands
    partial_share = bands[0][1] if bands else NONE
    of: Mapping[str, float] = {"full": FULL, "follow_through": FULL, "partial": partial_share, "none": NONE}
    worst, best = outcome.shares or (of[end] for end in outcome.possible)
    return worst, best


def _expected_share(outcome: Outcome, worst: float, best: float) -> float:
    """The mean share of the points over what the verdict may be."""
    is_open = outcome.verdict == "review"
    proposed = outcome.proposed if is_open else worst
    low, high = (worst, best) if is_open else (0.0, 1.0)
    otherwise = min(max(low + high - proposed, 0.0), 1.0)
    return outcome.probability * proposed + (1.0 - outcome.probability) * otherwise


# Vectors read in doubt that the explanation of the drawing predicts --------------------------------


def _confirmed(task: Task, submission: Submission, comparison: Comparison) -> Submission | None:
    """The submission, surer of what its explanation predicts; None where that changes nothing.

    Where it is nearly certain what was done, the explanation predicts every vector of the drawing. One that
    was read in doubt and lies just where it is predicted was read rightly, however wrong it is. Of what is
    doubted with its force polygon it is no evidence: the reader looked there for it.
    """
    explanations = () if comparison.explanation is None else comparison.explanation.explanations
    least, evidence = task.rubric.least_confidence, comparison.evidence
    waiting = {one.name for one in comparison.outcomes if one.verdict == "review"}
    read = {name for one in submission.readings for figure in one.figures.values() for name in figure.vectors}
    doubtful = {
        name: one
        for name, one in evidence.drawn.items()
        if (one.confidence < least or name in waiting) and not one.is_doubted and name in read
    }
    if not doubtful or not explanations:
        return None
    instead, wrong = drawn_instead(explanations, case_of(task, evidence, comparison.settled))
    if not wrong:
        return None
    own = {name: np.asarray(place) for name, place in evidence.nodes.items()}
    nodes = evaluate(instead.construction, instead.parameters, given=own)
    surer = {}
    for name, drawn in doubtful.items():
        vector = task.construction.vectors.get(name)
        if vector is not None and vector.tail in nodes and vector.head in nodes:
            predicted = complex(np.ravel(nodes[vector.head] - nodes[vector.tail])[0])
            if _lies_there(task, name, drawn, predicted):
                right = drawn.confidence * AGREES
                surer[name] = right / (right + (1.0 - drawn.confidence) * BY_CHANCE)
    if not surer:
        return None
    readings = tuple(
        replace(
            one,
            figures={
                plan: at_least(figure, surer, task.construction) for plan, figure in one.figures.items()
            },
        )
        for one in submission.readings
    )
    return replace(submission, readings=readings)


def _lies_there(task: Task, name: str, drawn: DrawnVector, predicted: complex) -> bool:
    """Return whether a vector's end was read within twice a length's tolerance of its predicted place."""
    at, tolerance = drawn.as_complex, task.rubric.tolerance_of(name)
    is_long = abs(predicted) >= tolerance.least_mm
    return at is not None and is_long and abs(at - predicted) <= 2.0 * tolerance.length_at(abs(predicted))
