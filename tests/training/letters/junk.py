"""Pictures that are not signs: pieces of strokes, crossings, arrowheads, arcs, hatching, joined letters."""

from collections.abc import Sequence

import cv2
import numpy as np

from tests.training.letters.glyphs import Glyph
from tests.training.letters.scans import as_segmented, on_glass, scanned

_SIDE = 64


def junk(glyphs: Sequence[Glyph], rng: np.random.Generator) -> tuple[np.ndarray, tuple[int, int]] | None:
    """((28, 28) picture, (width, height) of its crop), None if no ink is left."""
    lot = rng.random()
    if lot < 0.22:
        return _run_together(glyphs, rng)
    if lot < 0.3:
        return _half(glyphs[rng.integers(len(glyphs))], rng)
    picture = np.zeros((_SIDE, _SIDE), np.float32)
    pen = int(rng.integers(2, 6))
    kinds = (_crossing, _arrowhead, _open_arrowhead, _arc, _hatching, _fork, _joint, _blob)
    kinds[rng.integers(len(kinds))](picture, pen, rng)
    scale = np.exp(rng.uniform(np.log(0.2), np.log(0.8)))
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return as_segmented(on_glass(cv2.copyMakeBorder(small, 4, 4, 4, 4, cv2.BORDER_CONSTANT), rng))


def _run_together(glyphs: Sequence[Glyph], rng: np.random.Generator) -> tuple | None:
    letters = [glyph for glyph in glyphs if glyph.sign not in {".", "'", "-", ":", "=", "1", "/", "(", ")"}]
    one, two = (letters[index].picture for index in rng.integers(len(letters), size=2))
    gap = int(rng.uniform(-0.05, 0.12) * 96) - 24
    high = max(one.shape[0], two.shape[0]) + 20
    picture = np.zeros((high, one.shape[1] + two.shape[1] + gap + 4), np.uint8)
    picture[: one.shape[0], : one.shape[1]] = one
    left, top = one.shape[1] + gap, int(rng.uniform(0, high - two.shape[0]))
    part = picture[top : top + two.shape[0], left : left + two.shape[1]]
    np.maximum(part, two[:, : part.shape[1]], out=part)
    return scanned(Glyph("", picture, None), rng)


def _half(glyph: Glyph, rng: np.random.Generator) -> tuple | None:
    picture = glyph.picture.copy()
    high, wide = picture.shape
    share = rng.uniform(0.35, 0.55)
    if rng.random() < 0.5:
        picture[: int(share * high)] = 0
    else:
        picture[:, int(share * wide) :] = 0
    return scanned(Glyph("", picture, None), rng)


def _place(rng: np.random.Generator, low: float = 0.15, high: float = 0.85) -> np.ndarray:
    return rng.uniform(low * _SIDE, high * _SIDE, 2)


def _line(picture: np.ndarray, start: np.ndarray, end: np.ndarray, pen: int) -> None:
    cv2.line(picture, tuple(map(int, start)), tuple(map(int, end)), 255.0, pen, cv2.LINE_AA)


def _unit(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def _crossing(picture: np.ndarray, pen: int, rng: np.random.Generator) -> None:
    middle, first = _place(rng, 0.35, 0.65), rng.uniform(0, np.pi)
    for angle in (first, first + rng.uniform(0.15, 0.7), first - rng.uniform(0.3, 1.0))[: rng.integers(2, 4)]:
        _line(
            picture,
            middle - rng.uniform(12, 40) * _unit(angle),
            middle + rng.uniform(12, 40) * _unit(angle),
            pen,
        )


def _fork(picture: np.ndarray, pen: int, rng: np.random.Generator) -> None:
    middle, first = _place(rng, 0.3, 0.7), rng.uniform(0, 2 * np.pi)
    for angle in (first, first + rng.uniform(0.1, 0.6), first + rng.uniform(2.4, 3.8))[: rng.integers(2, 4)]:
        _line(picture, middle, middle + rng.uniform(14, 34) * _unit(angle), pen)


def _arrowhead(picture: np.ndarray, pen: int, rng: np.random.Generator) -> None:
    tip, along = _place(rng, 0.3, 0.7), _unit(rng.uniform(0, 2 * np.pi))
    across = np.array([-along[1], along[0]])
    length, half = rng.uniform(16, 34), rng.uniform(3, 8)
    corners = np.array([tip, tip - length * along + half * across, tip - length * along - half * across])
    cv2.fillConvexPoly(picture, corners.astype(np.int32), 255.0, cv2.LINE_AA)
    if rng.random() < 0.5:
        _line(picture, tip, tip - rng.uniform(length, 2 * length) * along, max(1, pen - 1))


def _open_arrowhead(picture: np.ndarray, pen: int, rng: np.random.Generator) -> None:
    tip, angle = _place(rng, 0.3, 0.7), rng.uniform(0, 2 * np.pi)
    spread, length = rng.uniform(0.15, 0.5), rng.uniform(14, 32)
    for turn in (-spread, spread):
        _line(picture, tip, tip - length * _unit(angle + turn), pen)
    if rng.random() < 0.6:
        _line(picture, tip, tip - rng.uniform(1.0, 1.6) * length * _unit(angle), pen)


def _arc(picture: np.ndarray, pen: int, rng: np.random.Generator) -> None:
    radius, start = rng.uniform(25, 70), rng.uniform(0, 360)
    middle = np.array([32.0, 32.0]) - radius * _unit(np.radians(start + 20))
    span = rng.uniform(25, 70)
    cv2.ellipse(
        picture, tuple(map(int, middle)), (int(radius),) * 2, 0, start, start + span, 255.0, pen, cv2.LINE_AA
    )
    if rng.random() < 0.5:
        angle = rng.uniform(0, np.pi)
        _line(picture, np.array([32, 32]) - 24 * _unit(angle), np.array([32, 32]) + 24 * _unit(angle), pen)


def _hatching(picture: np.ndarray, pen: int, rng: np.random.Generator) -> None:
    angle, pitch = rng.uniform(0.3, 1.2) * rng.choice([-1, 1]), rng.uniform(7, 14)
    for index in range(int(rng.integers(3, 7))):
        start = np.array([6 + index * pitch, 20 + rng.normal(0, 1.5)])
        _line(picture, start, start + rng.uniform(14, 26) * _unit(angle), max(1, pen - 2))
    if rng.random() < 0.6:
        _line(picture, np.array([2, 20]), np.array([62, 20]), pen)


def _joint(picture: np.ndarray, pen: int, rng: np.random.Generator) -> None:
    middle, radius = np.array([32.0, 32.0]), rng.uniform(8, 18)
    cv2.circle(picture, (32, 32), int(radius), 255.0, pen, cv2.LINE_AA)
    for angle in rng.uniform(0, 2 * np.pi, rng.integers(1, 4)):
        inner = radius if rng.random() < 0.7 else 0.0
        _line(
            picture,
            middle + inner * _unit(angle),
            middle + rng.uniform(1.3, 2.2) * radius * _unit(angle),
            pen,
        )


def _blob(picture: np.ndarray, pen: int, rng: np.random.Generator) -> None:
    for _ in range(int(rng.integers(1, 4))):
        axes = (pen + int(rng.uniform(1, 10)), pen + int(rng.uniform(1, 10)))
        at = tuple(map(int, _place(rng, 0.35, 0.65)))
        cv2.ellipse(picture, at, axes, rng.uniform(0, 180), 0, 360, 255.0, -1, cv2.LINE_AA)
