"""Ties between variants: two students with the same drawing."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from grader.lint.findings import BoolArray, LintFinding, chosen, named
from grader.lint.lengths import Asked
from grader.rubric import RubricFile
from reference.geometry import FloatArray
from reference.plan import Plan

SAME_MM = 0.5
"""Drawings whose nodes all lie within this of each other cannot be told apart: a hand's tolerance."""
NAMED_GROUPS = 3
MOST_PAIRS = 100_000
"""No more are looked for: where all variants are alike, there are as many as their number squared."""

Pairs = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, slots=True)
class Ties:
    """Pairs of variants, indices into the plan's.

    Attributes
    ----------
    same : every node of every figure lies in the same place
    passing : every asked vector of one would get full marks for the other
    """

    same: Pairs
    passing: Pairs


def ties_of(rubric: RubricFile, plan: Plan, asked: Asked) -> Ties:
    """Which variants have the same drawing, and which could be copied from each other."""
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


def _passing(rubric: RubricFile, plan: Plan, asked: Asked) -> Pairs:
    """Pairs in which either's asked vectors are all within the rubric's tolerance of the other's."""
    if not asked.names:
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    vectors = np.stack([plan.drawn_mm(name) for name in asked.names])
    length, turn = _tolerances(rubric, asked)

    def is_passing(i: np.ndarray, j: np.ndarray) -> BoolArray:
        off = np.abs(asked.length_mm[:, i] - asked.length_mm[:, j])
        crossed = vectors[:, i] * np.conj(vectors[:, j])
        turned = np.abs(np.angle(crossed))
        near = (off <= np.minimum(length[:, i], length[:, j])) & (
            turned <= np.minimum(turn[:, i], turn[:, j])
        )
        return np.asarray(near.all(axis=0))

    reach = np.max(length + asked.length_mm * np.minimum(turn, 2.0), axis=1)
    spread = np.vstack([vectors.real, vectors.imag])
    return _pairs(spread, np.concatenate([reach, reach]), is_passing)


def _tolerances(rubric: RubricFile, asked: Asked) -> tuple[FloatArray, FloatArray]:
    """(V, N) of length in mm and of direction in radians; pi where a direction is not judged."""
    tables = [rubric.tolerance_of(rubric.criterion[index]) for index in asked.criteria]
    column = {
        key: np.array([getattr(table, key) for table in tables])[:, None]
        for key in ("length_mm", "length_relative", "direction_deg", "across_mm", "least_mm")
    }
    length = np.maximum(column["length_mm"], column["length_relative"] * asked.length_mm)
    with np.errstate(divide="ignore"):
        turn = np.maximum(
            np.radians(column["direction_deg"]), np.arctan(column["across_mm"] / asked.length_mm)
        )
    judged = np.array([rubric.criterion[index].direction for index in asked.criteria])[:, None]
    free = (asked.length_mm < column["least_mm"]) | ~judged
    return np.asarray(length), np.where(free, np.pi, turn)


def _pairs(
    coordinates: FloatArray, reach: FloatArray, judge: Callable[[np.ndarray, np.ndarray], BoolArray]
) -> Pairs:
    """Pairs i < j that a judge accepts, of those within reach in the coordinate that tells most apart.

    Arguments: `coordinates` (C, N) and `reach` (C,), such that pairs further apart than that in any
    coordinate are never accepted.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.nan_to_num(np.ptp(coordinates, axis=1) / reach, posinf=0.0)
    best = int(np.argmax(apart))
    key, limit = coordinates[best], reach[best]
    order = np.argsort(key, kind="stable")
    found: list[Pairs] = []
    total = 0
    for step in range(1, len(order)):
        near = np.flatnonzero(key[order[step:]] - key[order[:-step]] <= limit)
        if not len(near):
            break
        i, j = order[near], order[near + step]
        accepted = judge(i, j)
        found.append((np.minimum(i, j)[accepted], np.maximum(i, j)[accepted]))
        total += int(accepted.sum())
        if total >= MOST_PAIRS:
            break
    first = np.concatenate([pair[0] for pair in found]) if found else np.empty(0, dtype=np.intp)
    second = np.concatenate([pair[1] for pair in found]) if found else np.empty(0, dtype=np.intp)
    return first, second


def groups_of(pairs: Pairs, count: int) -> list[list[int]]:
    """Variants that hang together by pairs, each group in rising order."""
    graph = coo_array((np.ones(len(pairs[0]), dtype=np.int8), pairs), shape=(count, count))
    _, group = connected_components(graph, directed=False)
    tied = np.unique(np.concatenate(pairs))
    found: dict[int, list[int]] = {}
    for one in tied.tolist():
        found.setdefault(int(group[one]), []).append(one)
    return list(found.values())


def tie_findings(plan: Plan, ties: Ties) -> Iterator[LintFinding]:
    """Groups with the same drawing; and how many further pairs could be copied unseen."""
    variants = plan.variants
    groups = groups_of(ties.same, len(variants))
    if groups:
        meant = np.zeros(len(variants), dtype=np.bool_)
        meant[[one for group in groups for one in group]] = True
        told = "; ".join(named([variants[one] for one in group]) for group in groups[:NAMED_GROUPS])
        more = f" and {len(groups) - NAMED_GROUPS} more groups" if len(groups) > NAMED_GROUPS else ""
        message = f"the same drawing within {SAME_MM:g} mm: {told}{more}"
        yield LintFinding(
            "warning", "ties", "assignment", "$.variant", message, chosen(variants, meant), names_them=True
        )
    count = len(variants)
    further = np.setdiff1d(ties.passing[0] * count + ties.passing[1], ties.same[0] * count + ties.same[1])
    if len(further):
        i, j = divmod(int(further[0]), count)
        least = "at least " if len(ties.passing[0]) >= MOST_PAIRS else ""
        message = (
            f"{least}{len(further)} pair(s) of variants differ by less than the rubric's tolerance: a copied"
            f" drawing would get full marks, such as that of {variants[i]} for {variants[j]}"
        )
        meant = np.zeros(count, dtype=np.bool_)
        meant[np.concatenate(divmod(further, count))] = True
        yield LintFinding("hint", "near_ties", "assignment", "$.variant", message, chosen(variants, meant))
