"""Likelihoods of parts of a drawing under each set of data, with outliers and propagated errors."""

import math
import statistics

import numpy as np

from grader.given_data.rows import ZERO, Rows
from grader.given_data.sets import BoolArray
from reference.geometry import FloatArray

CARES = ((0.7, 0.3), (1.3, 0.4), (2.4, 0.2), (4.0, 0.1))
"""Drafting errors as multiples of the rubric's, and their frequencies."""
TURNS = ((0.7, 0.85), (25.0, 0.15))
"""Standard deviations of a drawing's turn on its sheet, degrees, and their frequencies."""
AS_IT_LIES = ((0.0, 1.0),)
FITS_WELL = 2.0
"""From this many nats a row above nobody's data, the own data fit a drawing without turning it, if its own
directions lie within `STRAIGHT_DEG` of theirs."""
STRAIGHT_DEG = 1.4
ALIKE_RAD = math.radians(0.7)
"""Standard deviation of a figure's turn relative to the others of a sheet."""
ANY_SCALE = 2.0
"""Standard deviation of a scale's logarithm: any scale is possible."""
ANY_LENGTH = 1.0 / 3.0
"""Density of the logarithm of a wrong length."""
BACKWARDS, BACKWARDS_TOGETHER = 1.5, 4.0
"""Cost (nats) of one reversed direction, and of a whole part reversed by one mistake."""
ACROSS, QUARTER_RAD = 0.2, math.radians(1.5)
"""Probability that a wrong direction is off by a quarter (along for across), and its standard deviation."""
SCREENED = 8
"""Number of nearest sets of data for which a part is evaluated in full."""


def fit_of(rows: Rows, is_own: BoolArray) -> FloatArray:
    """Return the log probability of rows under each set of data, the own one first; (sets,).

    Sets that are far from all rows are -inf.
    """
    found = np.full(len(rows.residuals), -np.inf)
    is_there: BoolArray = np.asarray(np.isfinite(rows.residuals).all(axis=1))
    residuals = np.where(is_there[:, None], rows.residuals, OUTLYING)
    is_like_own = (np.abs(residuals - residuals[0]) < ZERO).all(axis=1)
    chosen = _nearest(np.where(is_there & ~is_like_own, _apart_from(rows, residuals), np.inf), is_own)
    chosen[0] = is_there[0]
    for turn_deg, share in TURNS if rows.is_angle.any() else AS_IT_LIES:
        if found[0] > nobodys(rows) + FITS_WELL * len(rows) and _lies_straight(rows, residuals[0]):
            break
        fitted = math.log(share) + _fitted(rows, residuals[chosen], math.radians(turn_deg))
        found[chosen] = np.logaddexp(found[chosen], fitted)
    # A mistake in another part leaves these as they are.
    found[is_like_own] = found[0]
    for part in sorted(set(rows.part.tolist())):
        back = rows.reversed[:, rows.part == part].sum(axis=1)
        found -= np.minimum(BACKWARDS * back, BACKWARDS_TOGETHER)
    return found


def _lies_straight(rows: Rows, residuals: FloatArray) -> bool:
    """Return whether no sheet is turned, by the medians of its directions' residuals against the own data."""
    turned = (residuals[rows.is_angle & (rows.sheet == sheet)].tolist() for sheet in set(rows.sheet.tolist()))
    # numpy's median loads masked arrays.
    return all(abs(statistics.median(one)) <= math.radians(STRAIGHT_DEG) for one in turned if one)


def nobodys(rows: Rows) -> float:
    """Return the log probability of a part's rows if they follow no data."""
    return float(np.where(rows.is_angle, -math.log(math.pi), math.log(ANY_LENGTH)).sum())


def _nearest(apart: FloatArray, is_own: BoolArray) -> BoolArray:
    """Return which sets of data are the nearest: of the own ones, and of all others."""
    chosen = np.zeros(len(apart), np.bool_)
    for these in (is_own, ~is_own):
        if these.any():
            limit = np.sort(apart[these])[min(SCREENED, int(these.sum())) - 1]
            chosen |= these & (apart <= limit) & np.isfinite(apart)
    return chosen


def _apart_from(rows: Rows, residuals: FloatArray) -> FloatArray:
    """Return the distance of the rows from each set of data: squared standard deviations; (sets,).

    Each row counts by itself. A part's scale and turn are those at which one of its rows fits exactly.
    """
    sigma = np.sqrt((2.0 * rows.drafting**2).sum(axis=1) + rows.reading**2)
    by_each = np.where(rows.is_angle, 1.0, rows.by_scale)
    found = np.zeros(len(residuals))
    for part in sorted(set(rows.part.tolist())):
        for of_kind in (rows.is_angle, ~rows.is_angle):
            these = of_kind & (rows.part == part)
            if these.any():
                own, each = residuals[:, these], by_each[these]
                # (sets, rows, by each row; the last one as it is)
                moved = own[:, :, None] - each[:, None] * np.pad(own / each, ((0, 0), (0, 1)))[:, None, :]
                fits = np.minimum((moved / sigma[these][:, None]) ** 2, OUTLYING).sum(axis=1)
                found += fits.min(axis=1)
    return found


CANCELLED = 1e-13
"""If this share or less of a row's precision is left, it is lost in rounding errors."""
OUTLYING = 16.0
"""Squared standard deviations beyond which the size of a row's error does not matter."""


def _fitted(rows: Rows, residuals: FloatArray, turn_rad: float) -> FloatArray:
    """Return the log likelihoods of residuals over all sizes of drafting errors; (sets,).

    The rows are jointly normal: errors propagate, so that one error of the crank turns all of them. Outliers
    are left out one by one; the effect of leaving a row out follows from the precision matrix in closed form
    (a Cholesky factorisation of it with pivots).
    """
    covariance = np.array([_covariance(rows, care, turn_rad) for care, _ in CARES])
    start = np.linalg.inv(covariance)
    sets, count = residuals.shape
    care = np.repeat(np.arange(len(CARES)), sets)
    every = np.arange(len(care))
    pull = (residuals @ start).reshape(len(care), count)
    outlier = np.tile(_of_outliers(rows, residuals) - np.log1p(-rows.doubt), (len(CARES), 1))
    likely = -0.5 * (pull * np.tile(residuals, (len(CARES), 1))).sum(axis=1)
    likely += np.log1p(-rows.doubt).sum() - 0.5 * np.linalg.slogdet(math.tau * covariance)[1][care]
    own = np.diagonal(start, axis1=1, axis2=2)[care]
    least, kept = CANCELLED * own, np.ones_like(pull, np.bool_)
    columns = np.zeros((len(care), count, count))
    for step in range(count):
        gain = np.where(kept, 0.5 * pull**2 / own + 0.5 * np.log(math.tau / own) + outlier, -np.inf)
        worst = gain.argmax(axis=1)
        best = gain[every, worst]
        is_left = best > 0.0
        if not is_left.any():
            break
        likely += np.where(is_left, best, 0.0)
        before = columns[:, :step]
        column = start[care, :, worst] - (before * before[every, :, worst][:, :, None]).sum(axis=1)
        column *= (is_left / np.sqrt(own[every, worst]))[:, None]
        pull -= column * (pull[every, worst] / np.sqrt(own[every, worst]))[:, None]
        own = np.maximum(own - column**2, least)
        kept[every, worst] &= ~is_left
        kept &= own > least
        pull[~kept] = 0.0
        columns[:, step] = column
    shares = np.log([share for _, share in CARES])
    return np.asarray(np.logaddexp.reduce(likely.reshape(len(CARES), sets) + shares[:, None]))


def _covariance(rows: Rows, care: float, turn_rad: float) -> FloatArray:
    """Return the covariance matrix of the rows for one size of drafting errors and of turns on the sheet."""
    moved, angles = care * rows.drafting, np.outer(rows.is_angle, rows.is_angle)
    same = rows.part[:, None] == rows.part
    covariance = moved @ moved.T + np.diag(rows.reading**2)
    covariance += ANY_SCALE**2 * same * np.outer(rows.by_scale, rows.by_scale)
    covariance += ALIKE_RAD**2 * same * angles
    return np.asarray(covariance + turn_rad**2 * angles * (rows.sheet[:, None] == rows.sheet))


def _of_outliers(rows: Rows, residuals: FloatArray) -> FloatArray:
    """Return the log density of each row if it is an outlier: anywhere, or a direction off by a quarter."""
    off = (np.abs(residuals) - math.pi / 2.0) / QUARTER_RAD
    across = np.exp(-0.5 * off**2) / (QUARTER_RAD * math.sqrt(math.tau))
    anyhow = np.where(rows.is_angle, (1.0 - ACROSS) / math.pi + ACROSS * across, ANY_LENGTH)
    return np.asarray(np.log(rows.doubt) + np.log(anyhow))
