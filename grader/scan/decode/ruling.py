"""The printed squares of graph paper: found by period, phase and direction, and removed from a page.

Lines are numbered, and the number of the line on which a place lies is a polynomial of the place: so a turn,
a copier's bend and a lens are followed. How dark a line is across itself is the same all along it and at its
likes; so much is taken off, and ink on a line stays by what it has more. A stroke that crosses a line is led
through it: it is as dark there as on both sides, where the page was so dark.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage, Ruling
from grader.scan.pixels import Flat, Float32Array, averaged, flatten, is_black_and_white

_LONG_SIDE_PX = 2480
"""Resolution at which lines are looked for: 6 px/mm on A3, so that a line in each millimetre is seen."""


def without_ruling(grey: GreyImage) -> tuple[GreyImage, Ruling | None]:
    """The page without its printed squares, and these; the page itself, and None, where there are none."""
    scale = min(1.0, _LONG_SIDE_PX / max(grey.shape))
    size = [round(side * scale) for side in grey.shape[::-1]]
    dark = _darkness(np.asarray(cv2.resize(averaged(grey, int(1.0 / scale)), size), dtype=np.uint8))
    if min(dark.shape) < _WINDOW_PX:
        return grey, None
    pitches = []
    for picture in (dark, np.ascontiguousarray(dark.T)):
        pitch, score = find_pitch(picture)
        if score < _LEAST_SCORE:
            return grey, None
        pitches.append((picture, pitch))
    flat = flatten(grey)
    families = [
        _family(flat, picture, pitch, scale, upright=upright)
        for upright, (picture, pitch) in zip((False, True), pitches, strict=True)
    ]
    slopes = np.array([_slope(family, grey.shape) for family in families])
    if np.any(np.abs([slopes[0, 0], slopes[1, 1]]) > _MOST_ASKEW * np.abs([slopes[0, 1], slopes[1, 0]])):
        return grey, None
    clean = _lightened(flat, families)
    for family in families:
        clean = _led_through(clean, grey, family)
    if is_black_and_white(grey):
        clean = np.asarray(cv2.threshold(clean, 127, 255, cv2.THRESH_BINARY)[1], dtype=np.uint8)
    return clean, Ruling(slopes)


# Whether there are squares --------------------------------------------------------------------------

_AROUND_PX = 81
"""As wide as the widest squares."""
_CLIP = 16
"""Most darkness of a pixel, of 255: a line counts as much as a stroke, whatever their darkness."""
_STRIP_PX = 16
"""Narrow enough that a line 5 degrees askew stays near its own width."""
_WINDOW_PX = 512
"""Five lines at 10 mm on A4."""
_PITCH_PX, _PITCH_STEP = (4.5, 110.0), 0.004
"""From 1 mm on a photo that shows more than the sheet, to 10 mm on A4; relative distance of those tried."""
_HIGHEST = 0.45
"""Highest harmonic, as a share of the sampling rate."""
_LEAST_BIN = 2.5
"""Lower frequencies are the light's and the window's."""
_STRIPS = 16
"""Number of strips whose power is added: a part of the page 40 mm wide."""
_FLOOR_BINS = 25
"""Frequencies around a harmonic whose median is that of what is drawn."""
_LOG_CAP = 4.0
"""Clearer harmonics count no more: one stroke does not make squares."""
_WITHIN = 0.04
"""Relative change of the pitch over a page in perspective."""
_LEAST_SCORE = 3.5
"""Squares have 5 to 19, drawings, tables, text and photos up to 1.7."""
_MOST_ASKEW = 0.13
"""Tangent of 7 degrees: hatching all over a page has another direction."""
_ORDERS, _LOWEST = 12, 0.3
"""Multiples of a pitch have its harmonics, too, but lack the lowest: this share of the strongest's power."""


@cache
def _combs() -> tuple[FloatArray, FloatArray]:
    """(p,) pitches, px, and (p, f) weights of the frequencies that are their harmonics."""
    low, high = np.log(_PITCH_PX).tolist()
    pitch = np.exp(np.arange(low, high, _PITCH_STEP))
    weights = np.zeros((len(pitch), _WINDOW_PX // 2 + 1))
    for weight, one in zip(weights, pitch, strict=True):
        order = np.arange(1, int(_HIGHEST * one) + 1)
        at = order * _WINDOW_PX / one
        at = at[at >= _LEAST_BIN]
        bins = at.astype(int)
        np.add.at(weight, bins, 1.0 - (at - bins))
        np.add.at(weight, bins + 1, at - bins)
    weights /= np.sqrt((_HIGHEST * pitch).astype(int))[:, None]
    return pitch, weights


def _darkness(small: GreyImage) -> GreyImage:
    """Return how much darker each pixel is than its surroundings, up to a limit."""
    around = cv2.blur(small, (_AROUND_PX, _AROUND_PX))
    return np.asarray(np.minimum(cv2.subtract(around, small), _CLIP), dtype=np.uint8)


def _in_strips(dark: GreyImage) -> Float32Array:
    """Means over strips along the lines."""
    size = (dark.shape[1] // _STRIP_PX, dark.shape[0])
    return np.asarray(cv2.resize(dark, size, interpolation=cv2.INTER_AREA), dtype=np.float32)


def find_pitch(dark: GreyImage) -> tuple[float, float]:
    """Distance of level lines that are all over a picture, px, and how clearly they show.

    The power of the harmonics of each pitch over that of the frequencies around them, in most parts.
    """
    pitch, weights = _combs()
    strips = _in_strips(dark)
    window = np.hanning(_WINDOW_PX).astype(np.float32)[:, None]
    tops = np.linspace(0, len(dark) - _WINDOW_PX, max(2, round(2 * len(dark) / _WINDOW_PX))).astype(int)
    count, side = strips.shape[1] // _STRIPS, _FLOOR_BINS // 2
    scores, powers = [], []
    for top in tops:
        piece = strips[top : top + _WINDOW_PX, : count * _STRIPS]
        power = np.abs(np.fft.rfft((piece - piece.mean(axis=0)) * window, axis=0)) ** 2
        part = power.reshape(-1, count, _STRIPS).mean(axis=2).T
        beside = np.pad(part, ((0, 0), (side, side)), mode="reflect")
        floor = np.median(np.lib.stride_tricks.sliding_window_view(beside, _FLOOR_BINS, axis=1), axis=2)
        scores.append(
            np.clip(np.log(np.maximum(part, 1e-6) / np.maximum(floor, 1e-3)), 0.0, _LOG_CAP) @ weights.T
        )
        powers.append((part - floor).mean(axis=0))
    score = np.concatenate(scores)
    wide = round(_WITHIN / _PITCH_STEP)
    near = cv2.dilate(score.astype(np.float32), np.ones((1, 2 * wide + 1), np.uint8))
    shown = np.median(near, axis=0)
    best = int(shown.argmax())
    around = slice(max(0, best - wide), best + wide + 1)
    found = float(pitch[around][score[:, around].mean(axis=0).argmax()])
    power = np.asarray(cv2.dilate(np.mean(powers, axis=0)[None, :], np.ones((1, 3), np.uint8)))[0]
    order = np.arange(1, min(int(_HIGHEST * found), _ORDERS) + 1)
    harmonics = power[np.rint(order * _WINDOW_PX / found).astype(int)]
    return found / float(order[(harmonics >= _LOWEST * harmonics.max()).argmax()]), float(shown[best])


# Which line a place lies on --------------------------------------------------------------------------

_DEGREE = 4
"""Degree of the polynomial: perspective, a lens's bend, and paper that a copier drew in unevenly."""
_TERMS = np.array([(i, j) for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)]).T
"""Powers of x and of y in each term."""
_PERIODS = 8
"""In a window that tells the phase: few enough that a pitch 3 per cent off stays within half a turn."""
_LEAST_WINDOW_PX = 96
_SMOOTH = 3.0
"""Windows and strips whose phases are taken together."""
_ROUNDS, _TUKEY = 6, 4.7
"""Rounds and Tukey's constant of a robust fit: enough to settle; outliers are left out as usual."""
_REACH_PX, _STEP_PX = 3.5, 0.5
"""To either side of a line, at the reduced size: 0.6 mm; distance of samples there, at the full one."""
_COLUMNS, _SEGMENTS = 100, 25
"""Places along each line that are looked at, and parts of it whose middles are."""
_REFITS = 2


@dataclass(frozen=True, slots=True)
class _Family:
    """Parallel lines of a page; coordinates are turned for upright lines, so that they are level.

    Attributes
    ----------
    upright : whether they are
    terms : coefficients of the number of the line on which a place lies
    first : the number of the first of them
    profiles : (n, bins) what each line takes of the light, of 255, from half-way to its neighbours
    half_px : half the width of the widest
    """

    upright: bool
    terms: FloatArray
    first: int
    profiles: NDArray[np.uint8]
    half_px: int


def _family(flat: Flat, dark: GreyImage, pitch: float, scale: float, *, upright: bool) -> _Family:
    """Lines at a distance of `pitch` in the reduced picture `dark`, measured at the full size."""
    terms = _by_phase(dark, pitch)
    reach = min(_REACH_PX, pitch / 2.0) / scale
    shape = flat.grey.shape[::-1] if upright else flat.grey.shape
    for _ in range(_REFITS):
        terms = _by_middles(_cut(flat, terms, reach, upright=upright), shape)
    cuts = _cut(flat, terms, reach, upright=upright)
    return _Family(upright, terms, int(cuts.lines[0]), *_profiles(cuts, pitch / scale))


def _unit(at: FloatArray, size: int) -> FloatArray:
    """Pixels of one axis, from -1 to 1 over the picture."""
    return (at + 0.5) / size * 2.0 - 1.0


def _numbers(terms: FloatArray, x: FloatArray, y: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """(len(y), len(x)) the polynomial at pixels of a picture."""
    along, down = (
        np.vander(_unit(at, size), _DEGREE + 1, increasing=True)
        for at, size in zip((x, y), shape[::-1], strict=True)
    )
    table = np.zeros((_DEGREE + 1, _DEGREE + 1))
    table[tuple(_TERMS)] = terms
    return np.asarray(down @ table.T @ along.T)


def _fitted(x: FloatArray, y: FloatArray, number: FloatArray, weight: FloatArray) -> FloatArray:
    """Coefficients by Tukey's biweight through numbers (n,) at places from -1 to 1."""
    powers = np.stack([x**i * y**j for i, j in _TERMS.T], axis=-1)
    own = weight
    for _ in range(_ROUNDS):
        weighed = powers * own[:, None]
        terms = np.linalg.lstsq(weighed.T @ powers, weighed.T @ number, rcond=None)[0]
        off = number - powers @ terms
        scale = max(1.4826 * float(np.median(np.abs(off))), 1e-3)
        own = weight * np.clip(1.0 - (off / (_TUKEY * scale)) ** 2, 0.0, None) ** 2
    return np.asarray(terms)


def _by_phase(dark: GreyImage, pitch: float) -> FloatArray:
    """Coefficients by the phase that the pitch has in windows all over a picture."""
    high, wide = dark.shape
    strips = _in_strips(dark)
    size = int(np.clip(_PERIODS * pitch, _LEAST_WINDOW_PX, _WINDOW_PX))
    tops, window = np.arange(0, high - size + 1, size // 4), np.hanning(size).astype(np.float32)
    at_x = (np.arange(strips.shape[1]) + 0.5) * wide / strips.shape[1] - 0.5
    x, y = (part.ravel() for part in np.meshgrid(_unit(at_x, wide), _unit(tops + (size - 1) / 2.0, high)))
    # First level lines at equal distances, then what they were found to be.
    terms = np.zeros(_TERMS.shape[1])
    terms[:2] = (high - 1) / 2.0 / pitch, high / 2.0 / pitch
    for _ in range(2):
        number = _numbers(terms, at_x, np.arange(high, dtype=np.float64), dark.shape)
        wave = strips * np.exp(-2j * np.pi * number.astype(np.float32))
        shown = np.stack([window @ wave[top : top + size] for top in tops])
        shown /= np.maximum(np.abs(shown), np.median(np.abs(shown)))
        # The mean change from window to window goes first: what is left is smooth.
        down, right = (
            np.angle((after * before.conj()).sum())
            for after, before in ((shown[1:], shown[:-1]), (shown[:, 1:], shown[:, :-1]))
        )
        row, column = np.indices(shown.shape)
        tilt = down * row + right * column
        left = shown * np.exp(-1j * tilt)
        left = cv2.GaussianBlur(left.real, (0, 0), _SMOOTH) + 1j * cv2.GaussianBlur(
            left.imag, (0, 0), _SMOOTH
        )
        turns = (np.unwrap(np.unwrap(np.angle(left), axis=1), axis=0) + tilt) / (2.0 * np.pi)
        terms = terms + _fitted(x, y, turns.ravel(), np.abs(left).ravel() ** 2)
    return terms


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
    dark: Float32Array


def _cut(flat: Flat, terms: FloatArray, reach: float, *, upright: bool) -> _Cuts:
    """The lines that reach into a page, cut across at equal distances."""
    high, wide = flat.grey.shape[::-1] if upright else flat.grey.shape
    x = (np.arange(_COLUMNS) + 0.5) / _COLUMNS * wide - 0.5
    y = np.linspace(-0.5, high - 0.5, _COLUMNS)
    number = _numbers(terms, x, y, (high, wide))
    lines = np.arange(int(np.floor(number.min())), int(np.ceil(number.max())) + 1)
    at = np.stack([np.interp(lines, column, y, left=np.nan, right=np.nan) for column in number.T], axis=1)
    count = int(reach / _STEP_PX)
    across = np.asarray(np.arange(-count, count + 1) * _STEP_PX, dtype=np.float64)
    down = (at[:, :, None] + across).reshape(-1, len(across)).astype(np.float32)
    along = np.broadcast_to(x.astype(np.float32)[:, None], (*at.shape, len(across))).reshape(down.shape)
    known = np.isfinite(at.ravel())
    places = (down[known], along[known]) if upright else (along[known], down[known])
    dark = np.full(down.shape, np.nan, dtype=np.float32)
    dark[known] = flat.contrast(*places)
    return _Cuts(lines, x, at, across, dark.reshape(*at.shape, -1))


def _middles(cuts: _Cuts) -> tuple[FloatArray, FloatArray]:
    """(n, segments) how far beside the lines their darkness has its middle, px, and how dark it is."""
    shown = cuts.dark.reshape(len(cuts.lines), _SEGMENTS, -1, len(cuts.across)).mean(axis=2)
    shown = (shown - shown.min(axis=2, keepdims=True)) ** 2
    weight = shown.sum(axis=2)
    return shown @ cuts.across / np.maximum(weight, 1e-9), np.sqrt(weight)


def _by_middles(cuts: _Cuts, shape: tuple[int, ...]) -> FloatArray:
    """Coefficients through the middles of the lines' darkness."""
    off, weight = _middles(cuts)
    at = cuts.at.reshape(len(cuts.lines), _SEGMENTS, -1).mean(axis=2) + off
    line, segment = np.nonzero(np.isfinite(at))
    x = cuts.x.reshape(_SEGMENTS, -1).mean(axis=1)[segment]
    y, dark = at[line, segment], weight[line, segment]
    number = cuts.lines[line].astype(np.float64)
    # A dark stroke along a line counts no more than the line.
    return _fitted(_unit(x, shape[1]), _unit(y, shape[0]), number, np.minimum(dark, np.median(dark)))


# Out of the page ------------------------------------------------------------------------------------

_QUANTILE = 0.93
"""Quantile of the darkness along the lines: lines that were printed or scanned unevenly are seldom darker."""
_LEAST, _MARGIN = 0.012, 1.1
"""Contrast that is paper, and what is taken off for each of darkness: no specks are left."""
_REPEATS, _REPEATED = (1, 2, 4, 5, 10), 6
"""Every second, fourth, fifth or tenth line may be heavier, if there are so many of them."""
_OWN = (0.8, 1.4)
"""Bounds of a line's darkness relative to similar lines: a stroke along it adds more."""
_OWN_PX = 1.5
"""Farthest that a line may be printed from its place."""
_BINS = 256
"""From one line to the next."""
_COARSE_PX = 32
"""Between the places at which the numbers are computed."""
_BAND_PX = 64
"""Rows of a page whose pictures fit the processor's cache together."""
_LEANS = (-2.5, -1.2, -0.5, 0.0, 0.5, 1.2, 2.5)
"""Slopes of strokes that cross a line, from its normal: up to 68 degrees. More joins separate strokes."""
_SEEN = 0.03
"""Contrast at a line's border."""


def _profiles(cuts: _Cuts, pitch: float) -> tuple[NDArray[np.uint8], int]:
    """(n, bins) what each line takes of the light, of 255, and half the width of the widest, px."""
    inside = np.asarray(np.isfinite(cuts.dark).all(axis=2))
    middle = cuts.dark[:, :, np.abs(cuts.across) <= 2.0 * _STEP_PX].max(axis=2)
    level = np.array([
        np.median(row[known]) if known.any() else 0.0 for row, known in zip(middle, inside, strict=True)
    ])  # fmt: skip
    whole = inside.mean(axis=1) > 0.5
    repeat = _repeat(cuts.lines[whole], level[whole])
    beside = ((np.arange(_BINS) + 0.5) / _BINS - 0.5) * pitch
    off, _ = _middles(cuts)
    off[~np.isfinite(off).any(axis=1)] = 0.0
    off = np.clip(np.nanmedian(off, axis=1), -_OWN_PX, _OWN_PX)
    taken, half = np.zeros((len(cuts.lines), _BINS)), _STEP_PX
    for group in range(repeat):
        own = cuts.lines % repeat == group
        dark = cuts.dark[own][inside[own]]
        if not len(dark):
            continue
        # What crosses the lines is as dark beside them; where they are broken, they are darker.
        profile = dark.mean(axis=0)
        profile -= profile.min()
        peak = int(profile.argmax())
        profile *= np.quantile(dark[:, peak], _QUANTILE) / max(float(profile[peak]), _LEAST)
        profile = np.maximum(profile - _LEAST, 0.0)
        share = np.clip(level[own] / max(float(np.median(level[own])), _LEAST), *_OWN)
        places = beside - off[own, None]
        taken[own] = share[:, None] * np.interp(places, cuts.across, profile, left=0.0, right=0.0)
        half = max(half, float(np.abs(cuts.across[profile > _SEEN]).max(initial=0.0)))
    return np.rint(255.0 * np.clip(_MARGIN * taken, 0.0, 1.0)).astype(np.uint8), int(np.ceil(half))


def _repeat(lines: NDArray[np.intp], level: FloatArray) -> int:
    """After how many lines their darkness repeats."""

    def spread(count: int) -> float:
        likes = [own for group in range(count) if len(own := level[lines % count == group])]
        return float(np.concatenate([np.abs(own - np.median(own)) for own in likes]).mean())

    tried = [count for count in _REPEATS if len(lines) >= _REPEATED * count]
    spreads = np.array([spread(count) for count in tried])
    return tried[int((spreads <= 1.25 * spreads.min() + _LEAST / 6.0).argmax())] if tried else 1


def _lightened(flat: Flat, families: Sequence[_Family]) -> GreyImage:
    """The page with so much light more as the lines take, up to the paper's."""
    grey = flat.grey
    paper = cv2.resize(flat.paper, grey.shape[::-1], interpolation=cv2.INTER_LINEAR)
    taken = [_taken(grey.shape, family) for family in families]
    clean = np.empty_like(grey)
    for rows in _bands(len(grey)):
        own, level = np.asarray(grey[rows]), paper[rows]
        for of in taken:
            more = cv2.add(own, cv2.multiply(of(rows), level, scale=1.0 / 255.0))
            own = np.maximum(own, np.minimum(more, level))
        clean[rows] = own
    return clean


def _taken(shape: tuple[int, ...], family: _Family) -> Callable[[slice], GreyImage]:
    """Return a function that gives a family's darkness, of 255, in some rows of a page."""
    high, wide = shape
    # One place beyond each border.
    x, y = (
        np.asarray((np.arange(-1, -(-size // _COARSE_PX) + 1) + 0.5) * _COARSE_PX - 0.5)
        for size in (wide, high)
    )
    if family.upright:
        number = _numbers(family.terms, y, x, shape[::-1]).T
    else:
        number = _numbers(family.terms, x, y, shape)
    # A line is in the middle of its bins; what is beyond the last has none.
    at = ((number - family.first + 0.5) * _BINS).astype(np.float32)
    taken = np.append(family.profiles.ravel(), np.zeros(_BINS, np.uint8))

    def of(rows: slice) -> GreyImage:
        near = at[rows.start // _COARSE_PX : -(-rows.stop // _COARSE_PX) + 2]
        fine = cv2.resize(near, (len(x) * _COARSE_PX, len(near) * _COARSE_PX), interpolation=cv2.INTER_LINEAR)
        inner = fine[_COARSE_PX : _COARSE_PX + rows.stop - rows.start, _COARSE_PX : _COARSE_PX + wide]
        return np.asarray(taken.take(inner.astype(np.int32), mode="clip"))

    return of


def _led_through(clean: GreyImage, grey: GreyImage, family: _Family) -> GreyImage:
    """A page without lines, as dark on these as on both sides of them where it was so dark before."""
    high, wide = clean.shape
    half, edge = family.half_px, round(max(_LEANS) * family.half_px)
    framed = cv2.copyMakeBorder(clean, edge, edge, edge, edge, cv2.BORDER_REPLICATE)
    result = np.empty_like(clean)
    for rows in _bands(high):
        through = np.full_like(clean[rows], 255)
        for lean in _LEANS:
            steps = (half, round(lean * half))
            down, right = steps[::-1] if family.upright else steps
            one, other = (
                framed[edge + sign * down + rows.start : edge + sign * down + rows.stop,
                       edge + sign * right : edge + sign * right + wide]
                for sign in (1, -1)
            )  # fmt: skip
            cv2.min(through, cv2.max(one, other), dst=through)
        cv2.min(clean[rows], cv2.max(through, grey[rows]), dst=result[rows])
    return result


def _bands(high: int) -> Iterator[slice]:
    for top in range(0, high, _BAND_PX):
        yield slice(top, min(top + _BAND_PX, high))


def _slope(family: _Family, shape: tuple[int, ...]) -> FloatArray:
    """(2,) change of the lines' number in the middle of a page, for each pixel to the right and down."""
    down, along = family.terms[[1, _DEGREE + 1]]
    slope = (down, along) if family.upright else (along, down)
    return np.asarray(2.0 * np.array(slope) / np.array(shape[::-1]))
