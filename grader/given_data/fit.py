"""How well one part of a drawing fits each set of data: likelihoods with outliers and propagated errors."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grader.given_data.rows import ZERO, Rows
from grader.given_data.sets import BoolArray
from reference.geometry import FloatArray

CARES = ((0.7, 0.3), (1.3, 0.4), (2.4, 0.2), (4.0, 0.1))
"""Drafting errors as multiples of the rubric's hand, and how often they are met."""
TURNS = ((0.7, 0.85), (25.0, 0.15))
"""By how many degrees a drawing is turned on its sheet (standard deviation), and how often."""
ALIKE = ((0.7, 1.0),)
"""The same of a plan beside a sketch: how far it is turned is known from that."""
FITS_WELL = 2.0
"""Nats a row above nobody's data from which on the own data fit as a part lies: it is not tried turned."""
ANY_SCALE = 2.0
"""Standard deviation of a scale's logarithm: any is possible."""
ANY_LENGTH = 1.0 / 3.0
"""Density of the logarithm of a length that is wrong."""
BACKWARDS, BACKWARDS_TOGETHER = 1.5, 4.0
"""Cost (nats) of one direction that is reversed; and of all of a plan, reversed by one mistake."""
QUARTER, ACROSS, QUARTER_RAD = 0.02, 0.2, math.radians(1.5)
"""Probabilities that a plan is turned by a quarter, and that a direction which is wrong is off by a quarter
(along for across); and how exactly."""
SCREENED = 8
"""So many sets of data, the nearest ones, are held against a part in full."""


@dataclass(frozen=True, slots=True)
class Fit:
    """How well a part fits each set of data.

    Attributes
    ----------
    likely : (sets,) the logarithm of the probability of the part's rows
    turn_rad : how far the part is turned on its sheet by the set that fits best; None where none fits
    """

    likely: FloatArray
    turn_rad: float | None


def fit_of(rows: Rows, is_own: BoolArray, turns: Sequence[tuple[float, float]], *, is_plan: bool) -> Fit:
    """How well a part fits each set of data; the first is the own.

    Of plans the own data are also held against one that was turned by a quarter as a whole.

    Arguments: `turns` as `TURNS`.
    """
    found = np.full(len(rows.residuals), -np.inf)
    is_there: BoolArray = np.asarray(np.isfinite(rows.residuals).all(axis=1))
    residuals = np.where(is_there[:, None], rows.residuals, OUTLYING)
    chosen = np.nonzero(_is_near(rows, residuals, is_own) & is_there)[0]
    has_own = bool(len(chosen)) and chosen[0] == 0
    best, turn_rad = nobodys(rows), None
    for turn_deg, turn_share in turns if rows.is_angle.any() else ALIKE:
        if turn_deg > ALIKE[0][0] and found[0] > nobodys(rows) + FITS_WELL * len(rows):
            break
        for care, care_share in CARES:
            share = math.log(turn_share * care_share)
            each, turned, _ = _fitted(rows, residuals[chosen], care, math.radians(turn_deg))
            each += share
            if each.max(initial=-np.inf) > best:
                best, turn_rad = float(each.max()), float(turned[each.argmax()])
            found[chosen] = np.logaddexp(found[chosen], each)
            if is_plan and has_own and rows.is_angle.any():
                quarter = _fitted(rows, _turned(rows, residuals[:1]), care, math.radians(turn_deg))[0]
                found[0] = np.logaddexp(found[0], quarter[0] + share + math.log(QUARTER))
    # A mistake in another part leaves this one as it is.
    found[(np.abs(residuals - residuals[0]) < ZERO).all(axis=1)] = found[0]
    found -= np.minimum(BACKWARDS * rows.reversed.sum(axis=1), BACKWARDS_TOGETHER)
    return Fit(np.where(is_there, np.maximum(found, nobodys(rows) - FAR), -np.inf), turn_rad)


def _turned(rows: Rows, residuals: FloatArray) -> FloatArray:
    """The residuals with all directions turned by a quarter."""
    return np.where(rows.is_angle, residuals - np.copysign(math.pi / 2.0, residuals), residuals)


FAR = 30.0
"""Nats below nobody's data: what was screened out, or fits nothing."""


def nobodys(rows: Rows) -> float:
    """The logarithm of the probability of a part's rows where they follow no data."""
    return float(np.where(rows.is_angle, -math.log(math.pi), math.log(ANY_LENGTH)).sum())


def _is_near(rows: Rows, residuals: FloatArray, is_own: BoolArray) -> BoolArray:
    """Which sets of data come nearest, each row by itself: of the own ones, and of all others."""
    near = _apart_from(rows, residuals)
    near[0] = -np.inf
    chosen = np.zeros(len(near), np.bool_)
    for these in (is_own, ~is_own):
        if these.any():
            limit = np.sort(near[these])[min(SCREENED, int(these.sum())) - 1]
            chosen |= these & (near <= limit)
    chosen &= ~(np.abs(residuals - residuals[0]) < ZERO).all(axis=1)
    chosen[0] = True
    return chosen


def _apart_from(rows: Rows, residuals: FloatArray) -> FloatArray:
    """How far a part is from each set of data: squared standard deviations, each row by itself; (sets,).

    The plan's scale, and how far it is turned, are those at which one of the rows fits exactly.
    """
    sigma = np.sqrt((2.0 * rows.drafting**2).sum(axis=1) + rows.reading**2)
    found = np.zeros(len(residuals))
    for these, by in ((rows.is_angle, np.ones(len(rows))), (~rows.is_angle, rows.by_scale)):
        if these.any():
            own, each = residuals[:, these], by[these]
            # (sets, rows, by each row; the last one as it is)
            moved = own[:, :, None] - each[:, None] * np.pad(own / each, ((0, 0), (0, 1)))[:, None, :]
            fits = np.minimum((moved / sigma[these][:, None]) ** 2, OUTLYING).sum(axis=1)
            found += fits.min(axis=1)
    return found


OUTLYING = 16.0
"""Squared standard deviations from which on it does not matter how far a row is off."""


def _fitted(
    rows: Rows, residuals: FloatArray, care: float, turn_rad: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The log likelihoods with one size of drafting errors, how far the part is turned, and which rows count.

    Outliers are left out one by one. The rows are jointly normal: errors propagate, so that one error of the
    crank turns all of them. What leaving a row out changes follows from the precision matrix in closed form.
    """
    moved, angles = care * rows.drafting, rows.is_angle.astype(float)
    covariance = moved @ moved.T + np.diag(rows.reading**2) + turn_rad**2 * np.outer(angles, angles)
    covariance += ANY_SCALE**2 * np.outer(rows.by_scale, rows.by_scale)
    start = np.linalg.inv(covariance)
    sets, count = residuals.shape
    precision = np.broadcast_to(start, (sets, count, count)).copy()
    kept, going = np.ones((sets, count)), np.arange(sets)
    outlier = _of_outliers(rows, residuals) - np.log1p(-rows.doubt)
    likely = -0.5 * np.einsum("hi,ij,hj->h", residuals, start, residuals)
    likely += np.log1p(-rows.doubt).sum() - 0.5 * np.linalg.slogdet(math.tau * covariance)[1]
    for _ in range(count):
        part = precision[going]
        pull = np.matmul(part, residuals[going][:, :, None])[:, :, 0]
        own = np.maximum(np.diagonal(part, axis1=1, axis2=2), ZERO)
        gain = 0.5 * pull**2 / own + 0.5 * np.log(math.tau / own) + outlier[going]
        gain = np.where(kept[going] > 0.0, gain, -np.inf)
        worst, best = gain.argmax(axis=1), gain.max(axis=1)
        left = best > 0.0
        if not left.any():
            break
        going, worst, part = going[left], worst[left], part[left]
        likely[going] += best[left]
        kept[going, worst] = 0.0
        precision[going] = _without(part, worst)
    pull = np.matmul(precision, residuals[:, :, None])[:, :, 0]
    return likely, turn_rad**2 * (pull @ angles), kept


def _of_outliers(rows: Rows, residuals: FloatArray) -> FloatArray:
    """The logarithm of each row's density if it is an outlier: anywhere, or a direction a quarter off."""
    off = (np.abs(residuals) - math.pi / 2.0) / QUARTER_RAD
    across = np.exp(-0.5 * off**2) / (QUARTER_RAD * math.sqrt(math.tau))
    anyhow = np.where(rows.is_angle, (1.0 - ACROSS) / math.pi + ACROSS * across, ANY_LENGTH)
    return np.asarray(np.log(rows.doubt) + np.log(anyhow))


def _without(precision: FloatArray, row: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> FloatArray:
    """Precision matrices (sets, rows, rows) with one row of each left out."""
    index = np.arange(len(row))
    column = precision[index, :, row]
    left = precision - column[:, :, None] * column[:, None, :] / precision[index, row, row][:, None, None]
    left[index, row, :] = 0.0
    left[index, :, row] = 0.0
    return np.asarray(left)


CLEARLY = 6.0
"""Squared standard deviations by which another set of data may be nearer than the own, which fit."""


def is_clearly_own(rows: Rows) -> bool:
    """Whether a part fits the own data without an outlier, and no others much better."""
    if not len(rows):
        return True
    if not np.isfinite(rows.residuals[0]).all():
        return False
    residuals = np.where(np.isfinite(rows.residuals), rows.residuals, OUTLYING)
    apart = _apart_from(rows, residuals)
    if apart[0] - apart.min() > CLEARLY:
        return False
    return bool(_fitted(rows, residuals[:1], CARES[1][0], math.radians(TURNS[0][0]))[2].all())
