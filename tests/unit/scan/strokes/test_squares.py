"""Graph paper's squares told from drawing."""

import numpy as np
import pytest

from grader.scan.strokes.seeds import PX_PER_MM, find_squares, without_squares

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


@pytest.mark.parametrize("pitch", [5.0, 4.0, 2.0, 1.0])
@pytest.mark.parametrize("skew", [0.005, 0.03])
def test_squares_are_known_by_their_pitch_and_darkness(pitch, skew):
    found = find_squares(squares(pitch, skew))
    assert abs(found.dark - PRINTED) < NEAR
    assert abs(found.pitch_px - pitch * PX_PER_MM) < 0.02 * pitch * PX_PER_MM


def test_squares_covered_with_writing_are_found():
    rng = np.random.default_rng(3)
    picture = squares()
    for x, y in rng.uniform(0.1, 0.85, (1500, 2)) * np.array(SHAPE[::-1]):
        picture[int(y) : int(y) + 24, int(x) : int(x) + 3] = PENCIL
        picture[int(y) : int(y) + 3, int(x) : int(x) + 24] = PENCIL
    assert abs(find_squares(picture).pitch_px - 5.0 * PX_PER_MM) < 0.5


def test_lines_of_writing_are_no_squares():
    rng = np.random.default_rng(3)
    picture = np.zeros(SHAPE, dtype=np.uint8)
    for row in range(60, SHAPE[0] - 60, 45):
        for x in np.cumsum(rng.uniform(9, 30, 100)).astype(int):
            picture[row : row + 18, x : x + 3] = PENCIL
            picture[row : row + 3, x : x + 12] = PENCIL
    assert find_squares(picture) is None


def test_a_drawing_and_a_table_have_no_squares():
    picture = drawn(np.zeros(SHAPE, dtype=np.uint8))
    for row in range(8):
        picture[1300 + 40 * row : 1302 + 40 * row, 1400:2400] = PENCIL
        picture[1300:1600, 1400 + 120 * row : 1402 + 120 * row] = PENCIL
    assert find_squares(picture) is None
    assert without_squares(picture, None) is picture


def test_hatching_has_no_squares():
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    picture = np.where((x + y) % 30 < 3, PENCIL, 0).astype(np.uint8)
    assert find_squares(picture) is None


def test_strokes_stay_where_squares_are_left_out():
    picture = drawn(squares())
    clean = without_squares(picture, find_squares(picture))
    assert (clean[600:603, 300:1500] == PENCIL).all()
    assert np.count_nonzero(clean) == np.count_nonzero(clean == PENCIL)
