"""The printed squares of graph paper: known by period, phase and direction, and taken out of a page.

Lines of a ruling are numbered; which line a pixel lies on is a smooth function of its place (a polynomial), so
that a turn, a copier's bend and a lens are followed. What the lines have in common across themselves is their
darkness; each pixel is divided by the light that they leave. Ink upon a line stays by what it takes more, and a
stroke that crosses one is led through it.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage, Ruling
from grader.scan.pixels import Flat, flatten, is_black_and_white, shrink

_LONG_SIDE_PX = 2480
"""Resolution at which lines are looked for: about 6 px/mm on A3, so that millimetres are six pixels."""
_AROUND_PX = 81
_CLIP = 16
"""Of 255: a line counts as much as a stroke, whatever their darkness."""
_STRIP_PX = 16
"""Narrow enough that a line 5 degrees askew stays within its own width."""
_WINDOW_PX = 512
_PITCH_PX = (4.5, 110.0)
"""From 1 mm on a photo that shows more than the sheet, to 10 mm on A4."""
_HIGHEST = 0.45
"""Of the sampling rate: harmonics up to it."""
_FLOOR_BINS = 25
_LOG_CAP = 4.0
_WITHIN = 0.04
"""Relative change of the pitch over a page in perspective."""
_LEAST_SCORE = 3.0
_DEGREE = 4


@cache
def _combs() -> tuple[FloatArray, FloatArray]:
    """(p,) pitches and (p, f) weights of the frequencies that are their harmonics."""
    low, high = np.log(_PITCH_PX)
    pitch = np.exp(np.arange(low, high, 0.004))
    weights = np.zeros((len(pitch), _WINDOW_PX // 2 + 1))
    for row, one in enumerate(pitch):
        at = np.arange(1, int(_HIGHEST * one) + 1) * _WINDOW_PX / one
        at = at[at >= 2.5] if len(at) else at
        base = at.astype(int)
        np.add.at(weights[row], base, 1.0 - (at - base))
        np.add.at(weights[row], base + 1, at - base)
        weights[row] /= max(np.sqrt(int(_HIGHEST * one)), 1.0)
    return pitch, weights


def _darkness(small: GreyImage) -> GreyImage:
    """How much darker than around it each pixel is, up to a limit."""
    around = cv2.blur(small, (_AROUND_PX, _AROUND_PX))
    return np.asarray(cv2.min(cv2.subtract(around, small), _CLIP), dtype=np.uint8)


def find_pitch(dark: GreyImage) -> tuple[float, float]:
    """Pitch of level lines all over a picture, px, and how clearly they show."""
    pitch, weights = _combs()
    strips = cv2.resize(dark, (dark.shape[1] // _STRIP_PX, dark.shape[0]), interpolation=cv2.INTER_AREA).astype(
        np.float32
    )
    window = np.hanning(_WINDOW_PX).astype(np.float32)[:, None]
    scores, powers = [], []
    for top in np.linspace(0, dark.shape[0] - _WINDOW_PX, max(2, round(2 * dark.shape[0] / _WINDOW_PX))).astype(int):
        piece = strips[top : top + _WINDOW_PX]
        power = np.abs(np.fft.rfft((piece - piece.mean(axis=0)) * window, axis=0)) ** 2
        count = power.shape[1] // 16
        block = power[:, : count * 16].reshape(len(power), count, 16).mean(axis=2).T
        side = _FLOOR_BINS // 2
        padded = np.pad(block, ((0, 0), (side, side)), mode="reflect")
        floor = np.median(np.lib.stride_tricks.sliding_window_view(padded, _FLOOR_BINS, axis=1), axis=2)
        shown = np.clip(np.log(np.maximum(block, 1e-6) / np.maximum(floor, 1e-3)), 0.0, _LOG_CAP)
        scores.append(shown @ weights.T)
        powers.append((block - floor).mean(axis=0))
    score = np.concatenate(scores)
    wide = round(_WITHIN / 0.004) * 2 + 1
    best = cv2.dilate(score.astype(np.float32), np.ones((1, wide), np.uint8))
    total = np.median(best, axis=0)
    raw = np.mean(score, axis=0)
    k = int(np.argmax(total))
    near = slice(max(0, k - wide), k + wide + 1)
    k = near.start + int(np.argmax(raw[near]))
    # A multiple of the pitch has the same harmonics, but not the lowest.
    power = np.mean(powers, axis=0)
    order = np.arange(1, int(_HIGHEST * pitch[k]) + 1)[:12]
    at = np.rint(order * _WINDOW_PX / pitch[k]).astype(int)
    strong = np.max([power[np.clip(at + step, 0, len(power) - 1)] for step in (-1, 0, 1)], axis=0)
    finer = order[np.argmax(strong >= 0.3 * strong.max())]
    return float(pitch[k] / finer), float(total[k])


# Which line a place lies on --------------------------------------------------------------------------

_PERIODS = 8
"""In a window that tells the phase: few enough that a pitch 3 per cent off stays within half a turn."""


_ORDERS = np.array([(i, j) for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)]).T
"""Of the polynomial's terms, along x and along y."""


def _basis(x: FloatArray, y: FloatArray) -> FloatArray:
    """(n, terms) powers of places, given from -1 to 1 over the page."""
    return np.stack([x**i * y**j for i, j in zip(*_ORDERS, strict=True)], axis=-1)


def _fitted(x: FloatArray, y: FloatArray, value: FloatArray, weight: FloatArray) -> FloatArray:
    """Coefficients of the polynomial through values, strays left out."""
    terms = _basis(x, y)
    own = weight.copy()
    for _ in range(6):
        weighed = terms * own[:, None]
        solved = np.linalg.lstsq(weighed.T @ terms, weighed.T @ value, rcond=None)[0]
        off = value - terms @ solved
        scale = max(1.4826 * float(np.median(np.abs(off[weight > 0]))), 1e-3)
        own = weight * np.clip(1.0 - (off / (4.7 * scale)) ** 2, 0.0, None) ** 2
    return solved


def _unit(at: FloatArray, size: int) -> FloatArray:
    """Pixels of one axis, from -1 to 1 over the picture."""
    return (at + 0.5) / size * 2.0 - 1.0


def _numbers(terms: FloatArray, x: FloatArray, y: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """(len(y), len(x)) polynomial on a lattice of pixels of a picture."""
    powers = [np.vander(_unit(at, size), _DEGREE + 1, increasing=True) for at, size in ((x, shape[1]), (y, shape[0]))]
    table = np.zeros((_DEGREE + 1, _DEGREE + 1))
    table[_ORDERS[0], _ORDERS[1]] = terms
    return np.asarray(powers[1] @ table.T @ powers[0].T)


def find_numbers(dark: GreyImage, pitch: float) -> FloatArray:
    """Coefficients of the lines' numbers over the picture, by the phase of the pitch in windows of it."""
    high, wide = dark.shape
    strips = cv2.resize(dark, (wide // _STRIP_PX, high), interpolation=cv2.INTER_AREA).astype(np.float32)
    count = strips.shape[1]
    size = int(np.clip(_PERIODS * pitch, 96, _WINDOW_PX))
    tops = np.arange(0, high - size + 1, size // 4)
    at_x = (np.arange(count) + 0.5) * wide / count - 0.5
    at_y = tops + (size - 1) / 2.0
    x, y = (part.ravel() for part in np.meshgrid(_unit(at_x, wide), _unit(at_y, high)))
    # The first guess: lines that are level and equally spaced.
    terms = np.zeros(len(_ORDERS[0]))
    terms[0], terms[1] = (high - 1) / 2.0 / pitch, high / 2.0 / pitch
    for _ in range(2):
        number = _numbers(terms, at_x, np.arange(high), dark.shape)
        wave = strips * np.exp(-2j * np.pi * number.astype(np.float32))
        window = np.hanning(size).astype(np.float32)
        shown = np.stack([window @ wave[top : top + size] for top in tops])
        shown /= np.maximum(np.abs(shown), np.median(np.abs(shown)))
        row, column = np.mgrid[: shown.shape[0], : shown.shape[1]]
        steps = (shown[1:] * shown[:-1].conj()).sum(), (shown[:, 1:] * shown[:, :-1].conj()).sum()
        tilt = np.angle(steps[0]) * row + np.angle(steps[1]) * column
        level = shown * np.exp(-1j * tilt)
        level = cv2.GaussianBlur(level.real, (0, 0), 3.0) + 1j * cv2.GaussianBlur(level.imag, (0, 0), 3.0)
        turns = np.unwrap(np.unwrap(np.angle(level), axis=1), axis=0) + tilt
        weight = np.abs(level).ravel() ** 2
        more = _fitted(x, y, turns.ravel() / (2.0 * np.pi), weight)
        terms = terms + more
    return terms


# Out of the page ----------------------------------------------------------------------------------

_REACH_PX = 3.5
"""To either side of a line, at the reduced size: 0.6 mm."""
_STEP_PX = 0.5
_SEGMENTS = 25
"""Of each line: shorter ones are of one stroke."""
_COLUMNS = 100
"""Places along each line that tell how dark the lines are."""
_QUANTILE = 0.93
"""Of the darkness along the lines: what is left of lines that were printed or scanned unevenly."""
_LEAST = 0.012
_MARGIN = 1.1
_PERIODS_OF_LINES = (1, 2, 4, 5, 10)
"""Every second, fifth or tenth line may be heavier."""
_OWN = (0.8, 1.15)
"""How far the darkness of a line may be from its likes: more is a stroke along it."""
_BINS = 256
"""Of the distance between two lines: finer than half a pixel."""
_COARSE_PX = 32
_BAND_PX = 64
_LEANS = (-2.5, -1.2, -0.5, 0.0, 0.5, 1.2, 2.5)
"""Of strokes that cross a line, against its normal: up to 68 degrees."""
_SEEN = 0.03
"""Contrast from which a line's border is seen."""


@dataclass(frozen=True, slots=True)
class _Cuts:
    """A family of lines cut across, on the page turned so that they are level.

    Attributes
    ----------
    lines : (n,) their numbers
    x, at : (m,) places along them, and (n, m) where they lie there, px
    across : (k,) places beside them, px
    dark : (n, m, k) contrast, nan beyond the page
    """

    lines: NDArray[np.intp]
    x: FloatArray
    at: FloatArray
    across: FloatArray
    dark: FloatArray


def _cut(flat: Flat, terms: FloatArray, reach: float, *, upright: bool) -> _Cuts:
    high, wide = flat.grey.shape[::-1] if upright else flat.grey.shape
    x = (np.arange(_COLUMNS) + 0.5) / _COLUMNS * wide - 0.5
    y = np.linspace(-0.5, high - 0.5, 97)
    number = _numbers(terms, x, y, (high, wide))
    lines = np.arange(int(np.floor(number.min())), int(np.ceil(number.max())) + 1)
    at = np.stack([np.interp(lines, column, y, left=np.nan, right=np.nan) for column in number.T], axis=1)
    count = int(reach / _STEP_PX)
    across = np.arange(-count, count + 1) * _STEP_PX
    down = (at[:, :, None] + across).reshape(-1, len(across)).astype(np.float32)
    along = np.broadcast_to(x.astype(np.float32)[:, None], (*at.shape, len(across))).reshape(down.shape)
    known = np.isfinite(at.ravel())
    places = (down[known], along[known]) if upright else (along[known], down[known])
    dark = np.full(down.shape, np.nan, dtype=np.float32)
    dark[known] = flat.contrast(*places)
    return _Cuts(lines, x, at, across, dark.reshape(*at.shape, -1))


def _refitted(cuts: _Cuts, shape: tuple[int, ...]) -> FloatArray:
    """Coefficients of the numbers through the middles of the lines' darkness."""
    segments = cuts.dark.reshape(len(cuts.lines), -1, _COLUMNS // _SEGMENTS, len(cuts.across))
    shown = segments.mean(axis=2)
    shown = (shown - shown.min(axis=2, keepdims=True)) ** 2
    weight = shown.sum(axis=2)
    off = shown @ cuts.across / np.maximum(weight, 1e-9)
    at = cuts.at.reshape(len(cuts.lines), _SEGMENTS, -1).mean(axis=2) + off
    x = np.broadcast_to(cuts.x.reshape(_SEGMENTS, -1).mean(axis=1), at.shape)
    number = np.broadcast_to(cuts.lines[:, None].astype(np.float64), at.shape)
    known = np.isfinite(at)
    root = np.minimum(np.sqrt(weight[known]), np.median(np.sqrt(weight[known])))
    return _fitted(_unit(x[known], shape[1]), _unit(at[known], shape[0]), number[known], root)


def _profiles(cuts: _Cuts, pitch: float) -> tuple[NDArray[np.uint8], int]:
    """(n, bins) darkness across each line, of 255, and half the width of the widest, px."""
    inside = np.isfinite(cuts.dark).all(axis=2)
    whole = inside.mean(axis=1) > 0.5
    middle = cuts.dark[:, :, np.abs(cuts.across) <= 2.0 * _STEP_PX].max(axis=2)
    level = np.array([np.median(row[known]) if known.any() else 0.0 for row, known in zip(middle, inside, strict=True)])
    period = _period(cuts.lines[whole], level[whole])
    phase = (np.arange(_BINS) + 0.5) / _BINS - 0.5
    table = np.zeros((len(cuts.lines), _BINS))
    half = _STEP_PX
    for group in range(period):
        own = cuts.lines % period == group
        members = cuts.dark[own][inside[own]]
        if not len(members):
            continue
        # What crosses the lines is as dark beside them; where they are broken, they are darker than on the mean.
        profile = members.mean(axis=0)
        profile -= profile.min()
        strongest = int(profile.argmax())
        darkest = np.quantile(members[:, strongest], _QUANTILE)
        profile = np.maximum(profile * darkest / max(profile[strongest], _LEAST) - _LEAST, 0.0)
        share = np.clip(level[own] / max(float(np.median(level[own & whole])), _LEAST), *_OWN)
        table[own] = share[:, None] * np.interp(phase * pitch, cuts.across, profile, left=0.0, right=0.0)
        half = max(half, float(np.abs(cuts.across[profile > _SEEN]).max(initial=0.0)))
    return np.rint(255.0 * np.clip(table, 0.0, 1.0)).astype(np.uint8), int(np.ceil(half))


def _period(lines: NDArray[np.intp], level: FloatArray) -> int:
    """After how many lines their darkness repeats."""
    spread = np.array([
        np.mean(np.concatenate([
            np.abs(own - np.median(own))
            for group in range(count) if len(own := level[lines % count == group])
        ])) if len(lines) >= 6 * count else np.inf
        for count in _PERIODS_OF_LINES
    ])  # fmt: skip
    return _PERIODS_OF_LINES[int(np.argmax(spread <= 1.25 * spread.min() + 0.002))]


def _taken(
    shape: tuple[int, ...], terms: FloatArray, table: NDArray[np.uint8], first: int, *, upright: bool
) -> Callable[[slice], GreyImage]:
    """What a family of lines takes of the light, of 255, in given rows of a page."""
    high, wide = shape
    x, y = ((np.arange(-1, -(-size // _COARSE_PX) + 1) + 0.5) * _COARSE_PX - 0.5 for size in (wide, high))
    number = _numbers(terms, y, x, shape[::-1]).T if upright else _numbers(terms, x, y, shape)
    # A line is in the middle of its bins, and what is beyond the last has none.
    index = ((number - first + 0.5) * _BINS).astype(np.float32)
    taken = np.concatenate([table.ravel(), np.zeros(_BINS, np.uint8)])

    def of(rows: slice) -> GreyImage:
        own = index[rows.start // _COARSE_PX : -(-rows.stop // _COARSE_PX) + 2]
        fine = cv2.resize(own, (len(x) * _COARSE_PX, len(own) * _COARSE_PX), interpolation=cv2.INTER_LINEAR)
        inner = fine[_COARSE_PX : _COARSE_PX + rows.stop - rows.start, _COARSE_PX : _COARSE_PX + wide]
        return np.asarray(taken.take(inner.astype(np.int32), mode="clip"))

    return of


def _slope(terms: FloatArray, shape: tuple[int, ...], *, upright: bool) -> FloatArray:
    """(2,) change of the lines' number in the middle of a page, for each pixel to the right and down."""
    first = [terms[(np.array(order)[:, None] == _ORDERS).all(axis=0)][0] for order in ((1, 0), (0, 1))]
    slope = np.array(first[::-1] if upright else first)
    return np.asarray(2.0 * slope / np.array(shape[::-1]))


def _led_through(clean: GreyImage, grey: GreyImage, half: int, *, upright: bool) -> GreyImage:
    """A page without lines, as dark on these as on both sides of them where it was so dark before."""
    high, wide = clean.shape
    edge = round(max(_LEANS) * half)
    framed = cv2.copyMakeBorder(clean, edge, edge, edge, edge, cv2.BORDER_REPLICATE)
    result = np.empty_like(clean)
    for rows in _bands(high):

        def moved(down: int, right: int, rows: slice = rows) -> GreyImage:
            return framed[edge + down + rows.start : edge + down + rows.stop, edge + right : edge + right + wide]

        through = np.full_like(clean[rows], 255)
        for lean in _LEANS:
            step = (round(lean * half), half) if upright else (half, round(lean * half))
            cv2.min(through, cv2.max(moved(*step), moved(-step[0], -step[1])), dst=through)
        cv2.min(clean[rows], cv2.max(through, grey[rows]), dst=result[rows])
    return result


def _bands(high: int) -> Iterator[slice]:
    """Rows of a page whose pictures fit the processor's cache together."""
    for top in range(0, high, _BAND_PX):
        yield slice(top, min(top + _BAND_PX, high))


def without_ruling(grey: GreyImage) -> tuple[GreyImage, Ruling | None]:
    """The page without its printed squares, and these; the page itself where there are none."""
    scale = min(1.0, _LONG_SIDE_PX / max(grey.shape))
    small = shrink(grey, scale)
    if min(small.shape) < _WINDOW_PX:
        return grey, None
    dark = _darkness(small)
    pictures = (dark, np.asarray(cv2.transpose(dark)))
    pitches = []
    for picture in pictures:
        pitch, score = find_pitch(picture)
        if score < _LEAST_SCORE:
            return grey, None
        pitches.append(pitch)
    flat = flatten(grey)
    paper = cv2.resize(flat.paper, grey.shape[::-1], interpolation=cv2.INTER_LINEAR)
    takers, halves, slopes = [], [], []
    for upright, (picture, pitch) in enumerate(zip(pictures, pitches, strict=True)):
        terms = find_numbers(picture, pitch)
        shape = grey.shape[::-1] if upright else grey.shape
        reach = min(_REACH_PX, pitch / 2.0) / scale
        for _ in range(2):
            terms = _refitted(_cut(flat, terms, reach, upright=bool(upright)), shape)
        cuts = _cut(flat, terms, reach, upright=bool(upright))
        table, half = _profiles(cuts, pitch / scale)
        takers.append(_taken(grey.shape, terms, table, int(cuts.lines[0]), upright=bool(upright)))
        halves.append(half)
        slopes.append(_slope(terms, grey.shape, upright=bool(upright)))
    clean = np.empty_like(grey)
    for rows in _bands(len(grey)):
        own, level = grey[rows], paper[rows]
        for taken in takers:
            more = cv2.add(own, cv2.multiply(taken(rows), level, scale=_MARGIN / 255.0))
            own = cv2.max(own, cv2.min(more, level))
        clean[rows] = own
    for upright, half in enumerate(halves):
        clean = _led_through(clean, grey, half, upright=bool(upright))
    if is_black_and_white(grey):
        _, clean = cv2.threshold(clean, 127, 255, cv2.THRESH_BINARY)
    return np.asarray(clean, dtype=np.uint8), Ruling(np.array(slopes))
