"""Graph paper's squares told from drawing."""

import numpy as np

from grader.scan.strokes.seeds import PX_PER_MM, squares_darkness, without_squares

SHAPE = (round(290 * PX_PER_MM), round(410 * PX_PER_MM))
PRINTED, PENCIL = 30, 130
NEAR = 3.0


def squares(pitch_mm=5.0, skew=0.005, dark=PRINTED):
    """Contrast of printed squares, turned a little as a scanner turns them."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32) / np.float32(PX_PER_MM)
    picture = np.zeros(SHAPE, dtype=np.uint8)
    for across in (x + skew * y, y - skew * x):
        picture[np.abs((across + pitch_mm / 2) % pitch_mm - pitch_mm / 2) < 0.12] = dark
    return picture


def drawn(picture):
    """A drawing's long pencil strokes, level, upright and slanted."""
    picture[600:603, 300:1500] = PENCIL
    picture[300:1500, 800:803] = PENCIL
    for step in range(1000):
        picture[400 + step // 2, 1000 + step : 1003 + step] = PENCIL
    return picture


def test_squares_are_as_dark_as_they_were_printed():
    for pitch in (5.0, 4.0):
        assert abs(squares_darkness(squares(pitch)) - PRINTED) < NEAR


def test_a_drawing_and_a_table_have_no_squares():
    picture = drawn(np.zeros(SHAPE, dtype=np.uint8))
    for row in range(8):
        picture[1300 + 40 * row : 1302 + 40 * row, 1400:2400] = PENCIL
        picture[1300:1600, 1400 + 120 * row : 1402 + 120 * row] = PENCIL
    assert squares_darkness(picture) == 0.0
    assert without_squares(picture) is picture


def test_hatching_has_no_squares():
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    picture = np.where((x + y) % 30 < 3, PENCIL, 0).astype(np.uint8)
    assert squares_darkness(picture) == 0.0


def test_strokes_stay_where_squares_are_left_out():
    clean = without_squares(drawn(squares()))
    assert (clean[600:603, 300:1500] == PENCIL).all()
    assert np.count_nonzero(clean) == np.count_nonzero(clean == PENCIL)
