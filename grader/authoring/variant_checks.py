"""Checks of single variants and of pairs: unsolvable ones, badly conditioned plans, equal drawings."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from grader.authoring.findings import (
    BoolArray,
    LintFinding,
    chosen,
    first_of,
    group_of_image,
    group_place,
    mechanism_place,
    named,
)
from grader.authoring.round_scales import AskedVectors
from grader.rubric import RubricFile
from reference.authored.assignment import Assignment, Variant
from reference.authored.flat_positions import other_assemblies
from reference.errors import MechanismError, Parameter
from reference.geometry import FloatArray
from reference.kinematics.motion import move_where_possible, reason_at
from reference.plan import Plan, conditioning

LEAST_TRANSMISSION = 0.25
"""|sin| of a transmission angle of about 15 degrees: below it, plans are hard to draw."""
LEAST_CROSSING_DEG = 20.0
"""Smallest angle between construction lines that can be intersected by hand: below it, an error across one of
them moves the node by three times as much."""
LARGEST_ERROR = 1e-9
"""Relative error of a computed plan above which it is reported: far below a pencil's, far above rounding."""
SAME_MM = 0.5
"""Drawings whose nodes all lie this close are the same drawing: the tolerance of drawing by hand."""
MOST_PAIRS = 100_000
"""Largest number of pairs searched: if all variants are equal, the pairs are their number squared."""

Pairs = tuple[np.ndarray, np.ndarray]


# Variants whose mechanism cannot be solved --------------------------------------------------------


Broken = Mapping[Variant, MechanismError]
"""The variants that cannot be solved, and why."""


def broken_variants(assignment: Assignment, variants: list[Variant]) -> Broken:
    """Return the variants that do not assemble or are singular, with the reason of each."""
    mechanism = assignment.mechanism(variants)
    lost = ~np.isfinite(move_where_possible(mechanism).predicted_error)
    return {variants[index]: reason_at(mechanism, int(index)) for index in np.flatnonzero(lost)}


def broken_findings(assignment: Assignment, broken: Broken) -> Iterator[LintFinding]:
    """Report a fault for each group and reason, with all its variants and the range of the gaps."""
    by_reason: dict[str, list[Variant]] = defaultdict(list)
    for variant, error in broken.items():
        by_reason[error.template].append(variant)
    for variants in by_reason.values():
        error = broken[variants[0]]
        gaps = sorted(gap for variant in variants if (gap := broken[variant].gap_m) is not None)
        known: dict[str, Parameter] = {"node": error.group or ""}
        if gaps:
            known["texts"] = " .. ".join(dict.fromkeys(f"{gap:.3g} m" for gap in (gaps[0], gaps[-1])))
        elif "texts" in error.parameters:
            known["texts"] = error.parameters["texts"]
        place = group_place(assignment, error.group)
        yield LintFinding("fault", error.code, *place, known, tuple(variants))


def assembly_findings(assignment: Assignment, variants: Sequence[Variant]) -> Iterator[LintFinding]:
    """Report variants whose side means another assembly than their neighbours', by n or by position."""
    mechanism = assignment.mechanism([*variants])
    by_node: dict[str, set[int]] = defaultdict(set)
    for of_one in (attrgetter("position"), attrgetter("n")):
        chains: dict[int | None, list[int]] = defaultdict(list)
        for row, variant in enumerate(variants):
            chains[of_one(variant)].append(row)
        for chain in chains.values():
            for node, rows in other_assemblies(mechanism, chain).items():
                by_node[node].update(rows)
    for node, others in by_node.items():
        file, path = group_place(assignment, node)
        meant = tuple(variants[row] for row in sorted(others))
        yield LintFinding("warning", "another_assembly", file, f"{path}.side", {"node": node}, meant)


# Conditioning: transmission angles, crossing angles, predicted error ------------------------------


@dataclass(frozen=True, slots=True)
class Conditions:
    """Arrays of shape (N,) by joint, node or force; `error` is the predicted relative error of the plan."""

    transmission: Mapping[str, FloatArray]
    crossing_deg: Mapping[str, FloatArray]
    error: FloatArray


def conditions_of(plan: Plan) -> Conditions:
    """Return the conditioning of every variant of a plan."""
    count = len(plan.variants)
    figures = {name: np.broadcast_to(values, (count,)) for name, values in conditioning(plan).items()}
    transmission, crossing = (
        {name.removeprefix(kind): values for name, values in figures.items() if name.startswith(kind)}
        for kind in ("transmission ", "crossing ")
    )
    crossing = {plan.construction.drawn_at(node)[0]: angle for node, angle in crossing.items()}
    return Conditions(transmission, crossing, figures.get("predicted_error", np.zeros(count)))


def condition_findings(assignment: Assignment, plan: Plan, conditions: Conditions) -> Iterator[LintFinding]:
    """Report groups near a singular position, lines that meet at a small angle, results that lose digits."""
    variants, whole = plan.variants, mechanism_place(assignment)
    for node, sine in conditions.transmission.items():
        if np.any(weak := sine < LEAST_TRANSMISSION):
            known: dict[str, Parameter] = {"node": node, "least_number": float(np.min(sine))}
            place = group_place(assignment, node)
            yield LintFinding("warning", "transmission", *place, known, chosen(variants, weak))
    for nodes, angle in _joined(conditions.crossing_deg).items():
        if np.any(flat := angle < LEAST_CROSSING_DEG):
            least = float(np.min(angle))
            error_mm = 1.0 / np.sin(np.radians(max(least, 1e-3)))
            known = {"nodes": nodes, "angle_deg": least, "off_number": float(error_mm)}
            place = group_of_image(assignment, nodes[0])
            yield LintFinding("warning", "crossing", *place, known, chosen(variants, flat))
    sines = [np.ones(len(variants)), *plan.motion.transmission.values()]
    again = plan.motion.recomputed & (np.min(sines, axis=0) < LEAST_TRANSMISSION)
    if np.any(again):
        yield LintFinding("hint", "recomputed", *whole, variants=chosen(variants, again))
    if np.any(lost := conditions.error > LARGEST_ERROR):
        known = {"text": f"{np.max(conditions.error):.1g}"}
        yield LintFinding("warning", "predicted_error", *whole, known, chosen(variants, lost))


def _joined(angles: Mapping[str, FloatArray]) -> dict[tuple[str, ...], FloatArray]:
    """Return the angles, with nodes joined whose lines meet at equal angles in every variant (b and b')."""
    joined: dict[tuple[str, ...], FloatArray] = {}
    for node, angle in angles.items():
        same = [names for names, other in joined.items() if np.allclose(angle, other, rtol=0, atol=1e-6)]
        if same:
            joined = {(*names, node) if names in same[:1] else names: a for names, a in joined.items()}
        else:
            joined[node,] = angle
    return joined


# Pairs of variants with the same drawing ----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Ties:
    """Pairs of variants, indices into the plan's.

    Attributes
    ----------
    same : every node of every figure has the same position
    passing : every requested vector of either would get full marks for the other
    """

    same: Pairs
    passing: Pairs


def ties_of(rubric: RubricFile, plan: Plan, asked: AskedVectors) -> Ties:
    """Return which variants have the same drawing, and which could be copied from each other."""
    nodes = np.stack(
        [
            np.broadcast_to(place, (len(plan.variants),))
            for figure in plan.nodes_mm.values()
            for place in figure.values()
        ]
    )

    def is_same(i: np.ndarray, j: np.ndarray) -> BoolArray:
        return np.asarray(np.max(np.abs(nodes[:, i] - nodes[:, j]), axis=0) <= SAME_MM)

    spread = np.vstack([nodes.real, nodes.imag])
    same = _pairs(spread, np.full(len(spread), SAME_MM), is_same)
    return Ties(same, _passing(rubric, plan, asked))


def _passing(rubric: RubricFile, plan: Plan, asked: AskedVectors) -> Pairs:
    """Return pairs whose requested vectors are all within the rubric's tolerance of each other."""
    if not asked.names:
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    vectors = np.stack([plan.drawn_mm(name) for name in asked.names])
    length, turn = _tolerances(rubric, asked)

    def is_passing(i: np.ndarray, j: np.ndarray) -> BoolArray:
        off = np.abs(asked.length_mm[:, i] - asked.length_mm[:, j])
        crossed = vectors[:, i] * np.conj(vectors[:, j])
        turned = np.abs(np.angle(crossed))
        near_in_length = off <= np.minimum(length[:, i], length[:, j])
        near_in_turn = turned <= np.minimum(turn[:, i], turn[:, j])
        return np.asarray((near_in_length & near_in_turn).all(axis=0))

    reach = np.max(length + asked.length_mm * np.minimum(turn, 2.0), axis=1)
    spread = np.vstack([vectors.real, vectors.imag])
    return _pairs(spread, np.concatenate([reach, reach]), is_passing)


def _tolerances(rubric: RubricFile, asked: AskedVectors) -> tuple[FloatArray, FloatArray]:
    """Return (V, N) tolerances, length in mm and direction in radians; pi if a direction is not judged."""
    tables = [rubric.tolerance_of(rubric.criterion[index]) for index in asked.criteria]
    rows = list(zip(tables, asked.length_mm.tolist(), strict=True))
    length = np.array([[table.length_at(mm) for mm in lengths] for table, lengths in rows])
    turn = np.array([[table.direction_at(mm) or 180.0 for mm in lengths] for table, lengths in rows])
    judged = np.array([rubric.criterion[index].direction for index in asked.criteria])[:, None]
    return length.reshape(asked.length_mm.shape), np.where(judged, np.radians(turn), np.pi)


def _pairs(
    coordinates: FloatArray, reach: FloatArray, judge: Callable[[np.ndarray, np.ndarray], BoolArray]
) -> Pairs:
    """Return pairs i < j that a judge accepts, among those within reach in the most distinctive coordinate.

    Arguments: `coordinates` (C, N) and `reach` (C,): pairs farther apart than that in any coordinate are
    never accepted.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.nan_to_num(np.ptp(coordinates, axis=1) / reach, posinf=0.0)
    best = int(np.argmax(apart))
    key, limit = coordinates[best], reach[best]
    order = np.argsort(key, kind="stable")
    pairs: list[Pairs] = [(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp))]
    for step in range(1, len(order)):
        near = np.flatnonzero(key[order[step:]] - key[order[:-step]] <= limit)
        if not len(near) or sum(len(first) for first, _ in pairs) >= MOST_PAIRS:
            break
        i, j = order[near], order[near + step]
        accepted = judge(i, j)
        pairs.append((np.minimum(i, j)[accepted], np.maximum(i, j)[accepted]))
    return np.concatenate([first for first, _ in pairs]), np.concatenate([second for _, second in pairs])


def groups_of(pairs: Pairs, count: int) -> list[list[int]]:
    """Return groups of variants connected by pairs, each in ascending order."""
    from scipy.sparse import coo_array  # noqa: PLC0415 - of all commands lint alone needs it
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415 - as above

    graph = coo_array((np.ones(len(pairs[0]), dtype=np.int8), pairs), shape=(count, count))
    _, component = connected_components(graph, directed=False)
    groups: dict[int, list[int]] = defaultdict(list)
    for index in np.unique(np.concatenate(pairs)).tolist():
        groups[int(component[index])].append(index)
    return list(groups.values())


def tie_findings(plan: Plan, ties: Ties) -> Iterator[LintFinding]:
    """Report groups with the same drawing, and how many further pairs could be copied unseen."""
    variants = plan.variants
    groups = groups_of(ties.same, len(variants))
    if groups:
        members = sorted(index for group in groups for index in group)
        meant = tuple(variants[index] for index in members)
        listed = first_of([named([variants[index] for index in group]) for group in groups], "; ")
        known: dict[str, Parameter] = {"least_number": SAME_MM, "text": listed}
        yield LintFinding("warning", "ties", "assignment", "$.variant", known, meant, names_them=True)
    count = len(variants)
    further = np.setdiff1d(ties.passing[0] * count + ties.passing[1], ties.same[0] * count + ties.same[1])
    if len(further):
        i, j = divmod(int(further[0]), count)
        least = ">= " if len(ties.passing[0]) >= MOST_PAIRS else ""
        known = {"count": f"{least}{len(further)}", "first": str(variants[i]), "second": str(variants[j])}
        members = np.unique(np.concatenate(divmod(further, count))).tolist()
        meant = tuple(variants[index] for index in members)
        yield LintFinding("hint", "near_ties", "assignment", "$.variant", known, meant)
