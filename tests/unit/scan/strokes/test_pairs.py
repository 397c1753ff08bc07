"""Neighbours by a k-d tree and neighbours by comparing every two strokes are the same; memory is bounded.

So are pieces joined block by block, stretches reached and pieces of ink, against what is plainly computed.
"""

import tracemalloc

import cv2
import numpy as np
import pytest

from grader.scan.pixels import connected, reached
from grader.scan.strokes import regions
from grader.scan.strokes.centreline import Fitted, Pen, _neighbours, crossings, rejoined
from grader.scan.strokes.ink import _family_size, _linked, distinct
from grader.scan.strokes.regions import PROBES, distances, join, near_pairs

UNIT = 12.0
"""Pixels in a millimetre, about 300 dpi."""
A3_PX = np.array([420.0, 297.0]) * UNIT
MEGABYTE = 1 << 20
MOST_MEGABYTES = 900
"""Comparing 20,000 strokes each with each at 13 places needs 20,000 of them."""


def segments(count, rng, longest_mm=60.0, sheet_px=A3_PX):
    middle = rng.uniform(0, 1, (count, 2)) * sheet_px
    turn, length = rng.uniform(0, np.pi, count), rng.uniform(1.0, longest_mm, count) * UNIT
    half = 0.5 * length[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    return np.stack([middle - half, middle + half], axis=1)


def strokes(ends, rng):
    count = len(ends)
    return Fitted(ends, rng.uniform(3.0, 9.0, count), *np.ones((5, count)))


def every_distance(ends):
    """(k, p, k) distances of places along each segment from every segment, in single precision."""
    ends = ends.astype(np.float32)
    span = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.hypot(span[:, 0], span[:, 1]), np.float32(1e-6))
    u = span / length[:, None]
    points = ends[:, None, 0] + np.linspace(0.04, 0.96, PROBES, dtype=np.float32)[:, None] * span[:, None, :]
    x, y = points[..., 0, None] - ends[:, 0, 0], points[..., 1, None] - ends[:, 0, 1]
    along = x * u[:, 0] + y * u[:, 1]
    along -= np.clip(along, np.float32(0.0), length)
    return np.hypot(along, x * u[:, 1] - y * u[:, 0])


def crowded(seed, count=250):
    """Strokes on a quarter of a postcard, many of them nearly on one another."""
    rng = np.random.default_rng(seed)
    ends = segments(count, rng, 30.0, np.array([60.0, 40.0]) * UNIT)
    copies = ends[: count // 3] + rng.normal(0.0, 1.5, (count // 3, 2, 2))
    return strokes(np.concatenate([ends, copies]), rng)


@pytest.mark.parametrize("seed", range(4))
def test_no_pair_within_reach_is_left_out_and_distances_are_the_same_to_the_bit(seed):
    ends = crowded(seed).ends
    off, reach = every_distance(ends), 14.0
    first, second = near_pairs(ends, ends, reach)
    assert (np.diff(first * len(ends) + second) > 0).all()
    assert np.array_equal(distances(ends, first, second), off[first, :, second])
    paired = np.zeros((len(ends), len(ends)), dtype=bool)
    paired[first, second] = True
    assert not (off.min(axis=1) < reach)[~paired].any()
    assert paired.mean() < 0.9


@pytest.mark.parametrize("seed", range(4))
def test_neighbours_are_those_of_comparing_every_two_strokes(seed):
    fitted = crowded(seed)
    reach = 0.5 * (fitted.width[:, None] + fitted.width[None, :]) + 0.3 * UNIT
    near = (every_distance(fitted.ends) < reach[:, None, :]).mean(axis=1)
    near = np.maximum(near, near.T)
    near[fitted.length[None, :] < np.minimum(fitted.length, 20.0 * UNIT)[:, None]] = 0.0
    np.fill_diagonal(near, 0.0)
    order = np.argsort(-near, axis=1, kind="stable")[:, :6]
    expected = np.where(np.take_along_axis(near, order, axis=1) > 0, order, -1)
    assert (expected >= 0).mean() > 0.2
    assert np.array_equal(_neighbours(fitted, Pen(UNIT, 5.0)), expected)


@pytest.mark.parametrize("share", [1.0, 0.85])
def test_strokes_with_ink_of_their_own_are_those_of_comparing_every_two(share):
    fitted = crowded(7)
    off = every_distance(fitted.ends)
    along, inside = (off < 0.2 * UNIT).all(axis=1), off < 0.6 * fitted.width
    keep = np.zeros(len(fitted), dtype=bool)
    for row in np.argsort(-fitted.length):
        covered = fitted.length[row] < 6.0 * UNIT and inside[row][:, keep].any(axis=1).mean() > share
        keep[row] = not covered and not along[row][keep].any()
    assert 0 < keep.sum() < len(keep)
    assert np.array_equal(distinct(fitted, UNIT, share), keep)


def test_a_cut_meets_a_stroke_where_their_lines_cross():
    ends = np.array([[[0.0, 0.0], [100.0, 0.0]], [[0.0, 0.0], [100.0, 0.0]]])
    taken = np.array([[[0.0, -10.0], [100.0, 30.0]], [[80.0, 5.0], [100.0, 5.0]]])
    offset, _ = crossings(ends, taken, np.array([[25.0, 50.0], [20.0, 90.0]]), 0.3 * UNIT)
    assert offset == pytest.approx(np.array([[0.0, 10.0], [np.inf, 5.0]]))


def test_families_of_parallel_strokes_are_those_of_spreading_labels():
    rng = np.random.default_rng(2)
    ends = np.concatenate([segments(200, rng, 20.0, np.array([150.0, 100.0])) / 1.0])
    ends = np.concatenate([ends, ends[:60] + np.array([1.5, 1.0])])
    length, weight = np.hypot(*(ends[:, 1] - ends[:, 0]).T), rng.uniform(0.3, 0.4, len(ends))
    first, second, aside = _linked(ends, length, weight)
    assert len(first) > 0
    links = set(zip(first.tolist(), second.tolist(), strict=True))
    assert {(other, one) for one, other in links} == links
    assert ((np.abs(aside) > 0.5) & (np.abs(aside) < 6.0)).all()
    label = np.arange(len(ends))
    for _ in range(len(ends)):
        np.minimum.at(label, first, label[second])
    expected = np.bincount(label)[label]
    assert np.array_equal(_family_size(first, second, len(ends)), expected)


@pytest.mark.slow
def test_twenty_thousand_strokes_are_compared_in_bounded_memory():
    rng = np.random.default_rng(3)
    fitted = strokes(segments(20_000, rng, 20.0), rng)
    tracemalloc.start()
    try:
        beside = _neighbours(fitted, Pen(UNIT, 5.0))
        keep = distinct(fitted, UNIT)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < MOST_MEGABYTES * MEGABYTE
    assert (beside >= 0).any()
    assert keep.any()


# Joined -------------------------------------------------------------------------------------------


def broken(rng, count=40):
    """Strokes cut into three pieces each, with gaps of 1 mm, and a little noise."""
    whole = segments(count, rng, 60.0)
    cuts = np.array([[0.0, 0.3], [0.33, 0.6], [0.63, 1.0]])
    span = (whole[:, 1] - whole[:, 0])[:, None, None]
    pieces = whole[:, None, None, 0] + cuts[..., None] * span
    return pieces.reshape(-1, 2, 2) + rng.normal(0.0, 0.2, (3 * count, 2, 2))


def test_pieces_are_joined_alike_whether_lone_ones_are_passed_over_or_searched(monkeypatch):
    ends = broken(np.random.default_rng(5))
    width = np.full(len(ends), 4.0)
    at_once = join(ends, width, 0.25 * UNIT, 2.3 * UNIT)
    monkeypatch.setattr(regions, "_BLOCK", 1)
    one_by_one = join(ends, width, 0.25 * UNIT, 2.3 * UNIT)
    assert [list(rows) for rows in at_once.members] == [list(rows) for rows in one_by_one.members]
    assert np.array_equal(at_once.ends, one_by_one.ends)
    assert max(len(rows) for rows in at_once.members) >= 3
    assert sorted(np.concatenate(at_once.members)) == list(range(len(ends)))


def test_stretches_are_reached_over_gaps_one_after_another():
    rng = np.random.default_rng(6)
    for _ in range(200):
        low = rng.uniform(-50.0, 50.0, 12)
        high = low + rng.uniform(0.0, 6.0, 12)
        taken, (near, far) = np.zeros(12, dtype=bool), (0.0, 3.0)
        for _ in range(12):
            taken |= (low <= far + 2.0) & (high >= near - 2.0)
            near, far = min([near, *low[taken]]), max([far, *high[taken]])
        assert np.array_equal(reached(low, high, (0.0, 3.0), 2.0), taken)


def test_pieces_of_ink_have_the_labels_and_boxes_of_opencv():
    mask = (np.random.default_rng(7).uniform(size=(120, 170)) < 0.2).astype(np.uint8)
    labels, boxes = connected(mask)
    _, expected, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    assert np.array_equal(labels, expected)
    assert np.array_equal(boxes, stats[1:, :4])
    assert connected(np.zeros((4, 5), np.uint8))[1].shape == (0, 4)


def test_strokes_that_overlap_on_one_line_are_one_and_those_that_abut_stay():
    line = np.array([[[0.0, 0.0], [30.0, 0.0]], [[20.0, 0.05], [60.0, 0.05]], [[61.0, 0.0], [90.0, 0.0]]])
    ends, stay = rejoined(strokes(UNIT * line, np.random.default_rng(8)), UNIT)
    assert stay.tolist() == [False, True, True]
    assert ends[1] == pytest.approx(UNIT * np.array([[0.0, 0.05], [60.0, 0.05]]))
