"""Pairs found by one coordinate's order are those that comparing each with each finds."""

import numpy as np
import pytest

from grader.authoring.round_scales import asked_vectors
from grader.authoring.variant_checks import MOST_PAIRS, SAME_MM, _pairs, groups_of, ties_of
from grader.rubric import load_rubric
from reference.authored.assignment import load_assignment
from reference.plan import exact_plan


def every_pair(points: np.ndarray, reach: float) -> set[tuple[int, int]]:
    distance = np.max(np.abs(points[:, :, None] - points[:, None, :]), axis=0)
    i, j = np.nonzero(np.triu(distance <= reach, 1))
    return set(zip(i.tolist(), j.tolist(), strict=True))


@pytest.mark.parametrize("seed", range(5))
def test_no_pair_is_missed(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.0, 20.0, (4, 120)).round(1)
    points[2] = points[0]

    def is_near(i, j):
        return np.max(np.abs(points[:, i] - points[:, j]), axis=0) <= 3.0

    i, j = _pairs(points, np.full(4, 3.0), is_near)
    assert np.all(i < j)
    assert set(zip(i.tolist(), j.tolist(), strict=True)) == every_pair(points, 3.0)


def test_a_coordinate_that_tells_nothing_apart_is_not_sorted_by():
    points = np.vstack([np.zeros(50), np.arange(50.0)])
    compared = []

    def judge(i, _j):
        compared.append(len(i))
        return np.ones(len(i), dtype=np.bool_)

    _pairs(points, np.array([1.0, 1.0]), judge)
    assert sum(compared) == 49


def test_a_class_that_is_all_alike_does_not_take_its_number_squared():
    points = np.zeros((2, 3000))
    i, _ = _pairs(points, np.ones(2), lambda i, _j: np.ones(len(i), dtype=np.bool_))
    assert MOST_PAIRS <= len(i) < MOST_PAIRS + 3000
    assert [len(group) for group in groups_of((i, _), 3000)] == [3000]


def test_variants_hang_together_in_groups():
    pairs = np.array([0, 4, 1]), np.array([3, 5, 3])
    assert groups_of(pairs, 7) == [[0, 1, 3], [4, 5]]
    none = np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    assert groups_of(none, 7) == []


def near_ties(folder, step_deg):
    """The engine with variants a few tenths of a degree apart: its plan, its rubric, its ties."""
    engine = load_assignment("engine")
    text = engine.path.read_text(encoding="utf-8").replace('"15*n - 5"', f'"40 + {step_deg}*n"')
    (folder / "near.assignment.toml").write_text(text, encoding="utf-8")
    near = load_assignment(folder / "near.assignment.toml")
    plan, rubric = exact_plan(near, near.variants()), load_rubric("engine")
    return plan, rubric, ties_of(rubric, plan, asked_vectors(rubric, plan))


def test_a_tie_is_two_drawings_whose_nodes_all_lie_together(tmp_path):
    plan, _, found = near_ties(tmp_path, 0.5)
    nodes = np.stack(
        [at for figure in plan.nodes_mm.values() for at in np.broadcast_arrays(*figure.values())]
    )
    distance = np.max(np.abs(nodes[:, :, None] - nodes[:, None, :]), axis=0)
    i, j = np.nonzero(np.triu(distance <= SAME_MM, 1))
    assert set(zip(*map(np.ndarray.tolist, found.same), strict=True)) == set(
        zip(i.tolist(), j.tolist(), strict=True)
    )


def test_what_could_be_copied_would_get_full_marks(tmp_path):
    """By the rubric's own words: lengths and directions of every asked vector within its limits."""
    plan, rubric, found = near_ties(tmp_path, 0.4)
    passing = set(zip(*map(np.ndarray.tolist, found.passing), strict=True))
    limits = rubric.tolerance

    def passes(right: int, drawn: int) -> bool:
        for name in rubric.vectors:
            one, other = plan.drawn_mm(name)[right], plan.drawn_mm(name)[drawn]
            length = abs(one)
            if abs(length - abs(other)) > max(limits.length_mm, limits.length_relative * length):
                return False
            allowed = max(limits.direction_deg, np.degrees(np.arctan(limits.across_mm / length)))
            turned = abs(np.degrees(np.angle(one * np.conj(other))))
            if length >= limits.least_mm and turned > allowed:
                return False
        return True

    count = len(plan.variants)
    both = {(i, j) for i in range(count) for j in range(i + 1, count) if passes(i, j) and passes(j, i)}
    either = {(i, j) for i in range(count) for j in range(i + 1, count) if passes(i, j) or passes(j, i)}
    assert both <= either
    assert passing == both
    assert passing
