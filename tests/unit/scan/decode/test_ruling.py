"""Printed squares taken out of a page, and what is drawn on them kept."""

from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

from grader.scan.decode.pages import page_of
from grader.scan.decode.ruling import without_ruling

REAL = Path(__file__).resolve().parents[5] / "shared" / "real"
SHAPE, PX_PER_MM = (1000, 1400), 6.0
PAPER, PENCIL, SUBPIXEL = 244, 110, 8
LEFT = 0.06
"""Contrast of what is left of squares at most: the faintest strokes have 0.1."""
STROKES = [((30, 30), (110, 71)), ((150, 40), (110, 130)), ((40, 130), (120, 94))]
"""Up to 24 degrees from the lines, mm."""


def fixed(points):
    return np.rint((np.asarray(points, dtype=float) * PX_PER_MM - 0.5) * 2**SUBPIXEL).astype(np.int32)


def lined(grey, lines, dark, width_mm):
    """Lines (n points each) in mm drawn into a picture four times as large, so that fine ones are even."""
    large = cv2.resize(np.full_like(grey, 255), None, fx=4, fy=4)
    for points in lines:
        at = np.rint(((np.asarray(points) * PX_PER_MM) * 4 - 0.5) * 2**SUBPIXEL).astype(np.int32)
        wide = max(1, round(4 * width_mm * PX_PER_MM))
        pen = {"thickness": wide, "lineType": cv2.LINE_AA, "shift": SUBPIXEL}
        cv2.polylines(large, [at], isClosed=False, color=0, **pen)
    cover = 1.0 - cv2.resize(large, grey.shape[::-1], interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    return grey * (1.0 - cover * (1.0 - dark / PAPER))


def squared(pitch, dark=150, *, turn_deg=0.4, bend_mm=0.0, broken=0.0, heavy=1, width_mm=0.2):
    """Paper with squares; every `heavy`-th line twice as dark."""
    grey = np.full(SHAPE, PAPER, dtype=np.float32)
    along = np.linspace(-60.0, 300.0, 73)
    cos, sin = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    for which in range(heavy):
        numbers = np.arange(-60, 300 / pitch)
        lines = []
        for number in numbers[(numbers % heavy == 0) == (which == 0)] if which < 2 else ():
            across = 0.37 * pitch + number * pitch + bend_mm * np.sin(along / 60.0)
            for x, y in ((along, across), (across, along)):
                lines.append(np.column_stack([cos * x - sin * y, sin * x + cos * y]))
        grey = lined(grey, lines, dark if which == 0 else (PAPER + dark) / 2, width_mm)
    if broken:
        grain = cv2.GaussianBlur(np.random.default_rng(3).normal(size=SHAPE), (0, 0), 0.8)
        grain = np.clip(1.0 + broken * grain / grain.std(), 0.0, 1.6).astype(np.float32)
        grey = PAPER - (PAPER - grey) * grain
    return grey


def scanned(grey, strokes=STROKES, width_mm=0.35):
    """As a scanner sees a drawing on paper."""
    soft = cv2.GaussianBlur(lined(grey, strokes, PENCIL, width_mm), (0, 0), 0.7)
    return np.clip(soft + np.random.default_rng(1).normal(0, 2, SHAPE), 0, 255).astype(np.uint8)


def contrast_along(grey, start, end):
    """Darkest contrast across a stroke, at each millimetre along it."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = np.hypot(*(end - start))
    u = (end - start) / length
    at = start + np.linspace(0.02, 0.98, int(length))[:, None] * (end - start)
    beside = np.arange(-1.5, 1.6, 0.5)[None, :, None] / PX_PER_MM * np.array([-u[1], u[0]])
    x, y = ((at[:, None] + beside) * PX_PER_MM - 0.5).astype(np.float32).transpose(2, 0, 1)
    return 1.0 - cv2.remap(grey, x.copy(), y.copy(), cv2.INTER_LINEAR).min(axis=1) / PAPER


def left_of_squares(clean):
    """The darkness of the darkest hundredth of the areas without drawing."""
    bare = clean[20:160, 800:1380], clean[820:, 20:1380]
    return 1.0 - float(np.quantile(np.concatenate([part.ravel() for part in bare]), 0.01)) / PAPER


PAPERS = {
    "1 mm": partial(squared, 1.0, 190, width_mm=0.12),
    "1 mm, heavier at 5 mm": partial(squared, 1.0, 150, heavy=5, width_mm=0.12),
    "2.5 mm": partial(squared, 2.5),
    "4 mm, pale": partial(squared, 4.0, 215),
    "5 mm, as dark as a pencil": partial(squared, 5.0, PENCIL),
    "5 mm, broken": partial(squared, 5.0, PENCIL, broken=0.4),
    "7 mm, turned by 3 degrees": partial(squared, 7.0, turn_deg=-3.0),
    "10 mm, bent": partial(squared, 10.0, turn_deg=1.0, bend_mm=0.8),
}
PITCH = {name: float(name.split()[0]) for name in PAPERS}


@pytest.mark.parametrize("name", PAPERS)
def test_squares_go_and_strokes_that_cross_them_stay_whole(name):
    grey = scanned(PAPERS[name]())
    clean, ruling = without_ruling(grey)
    pitches = 1.0 / np.hypot(*ruling.lines_per_px.T) / PX_PER_MM
    assert np.abs(pitches / PITCH[name] - 1.0).max() < 0.005
    assert left_of_squares(clean) < LEFT
    for start, end in STROKES:
        contrast = contrast_along(clean, start, end)
        assert np.median(contrast) > 0.35
        assert contrast.min() > 0.15


@pytest.mark.parametrize("dark", [PENCIL, 190])
def test_a_stroke_along_a_line_is_kept_by_what_it_has_more(dark):
    grey = squared(5.0, dark, turn_deg=0.0)
    y = 0.37 * 5.0 + 14 * 5.0
    stroke = ((40.0, y), (120.0, y))
    clean, _ = without_ruling(scanned(grey, [*STROKES, stroke], width_mm=0.45))
    beyond = contrast_along(clean, (150.0, y), (220.0, y))
    assert np.median(contrast_along(clean, *stroke)) > 0.15
    assert beyond.max() < LEFT + 0.03


def test_a_copy_in_black_and_white_stays_one():
    grey = np.where(scanned(squared(5.0, PENCIL)) < 180, 0, 255).astype(np.uint8)
    clean, ruling = without_ruling(grey)
    assert ruling is not None
    assert set(np.unique(clean)) <= {0, 255}
    assert np.mean(clean[820:] == 0) < 0.1 * np.mean(grey[820:] == 0)


def plain(lines=(), **pen):
    return scanned(np.full(SHAPE, PAPER, dtype=np.float32), [*STROKES, *lines], **pen)


def writing():
    grey, rng = plain(), np.random.default_rng(3)
    for row in range(40, SHAPE[0] - 40, 45):
        for x in np.cumsum(rng.uniform(9, 30, 60)).astype(int):
            grey[row : row + 18, x : x + 3] = PENCIL
            grey[row : row + 3, x : x + 12] = PENCIL
    return grey


TABLE = [((130, 70 + 7 * k), (225, 70 + 7 * k)) for k in range(9)]
TABLE += [((130 + 19 * k, 70), (130 + 19 * k, 126)) for k in range(6)]
HATCHING = [((4 * k, 0), (4 * k - 60, 160)) for k in range(75)]
OTHERS = {
    "a drawing": plain,
    "a table": partial(plain, TABLE),
    "hatching": partial(plain, HATCHING),
    "writing": writing,
}


@pytest.mark.parametrize("name", OTHERS)
def test_what_has_no_squares_is_left_as_it_is(name):
    grey = OTHERS[name]()
    clean, ruling = without_ruling(grey)
    assert ruling is None
    assert clean is grey


PADS = {
    "hdBPMN/ex07_writer0049.jpg": 5.0,
    "hdBPMN/ex10_writer0077.jpg": 5.0,
    "ruled/tr18-p1.png": 4.0,
    "ruled/t16-p5.png": 5.0,
}


@pytest.mark.skipif(not REAL.is_dir(), reason="the real images are not here")
@pytest.mark.parametrize("name", PADS)
def test_the_squares_of_a_real_pad_are_a_ruler(name):
    page = page_of(REAL / name, 1)
    pitches = 1.0 / np.hypot(*page.ruling.lines_per_px.T) / 300.0 * 25.4
    assert np.abs(pitches / PADS[name] - 1.0).max() < 0.06


@pytest.mark.skipif(not REAL.is_dir(), reason="the real images are not here")
def test_a_real_drawing_on_plain_paper_has_no_squares():
    assert page_of(REAL / "ruled" / "ap1-p3.png", 1).ruling is None
