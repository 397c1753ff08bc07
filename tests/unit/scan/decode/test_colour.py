"""Coloured pages in grey: strokes of any pencil stay in sight, the paper's rulings do not."""

import cv2
import numpy as np
import pytest

from grader.scan.decode.pictures import to_grey

WIDE, HIGH = 1260, 891
PAPER = (246, 246, 242)
GRAPHITE = (110, 110, 112)
PENCILS = {"red": (220, 90, 90), "green": (90, 180, 105), "blue": (90, 115, 205), "yellow": (250, 228, 80),
           "orange": (245, 165, 75)}  # fmt: skip
RULINGS = {"blue": (160, 195, 240), "orange": (245, 180, 130), "green": (150, 215, 165)}
IN_SIGHT, OUT_OF_SIGHT = 0.25, 0.15
"""Contrasts: a stroke's that is found on paper with grain, and a ruling's that squared paper has in grey."""


def page(strokes=(), ruling=None, tint=PAPER):
    image = np.full((HIGH, WIDE, 3), tint, np.uint8)
    lines = np.zeros((HIGH, WIDE), np.uint8)
    for at in range(7, WIDE, 15) if ruling else ():
        cv2.line(lines, (at, 0), (at, HIGH), 255, 2)
        cv2.line(lines, (0, at), (WIDE, at), 255, 2)
    if ruling:
        image[lines > 0] = ruling
    masks = []
    for row, colour in enumerate(strokes):
        mask = np.zeros((HIGH, WIDE), np.uint8)
        cv2.line(mask, (100 + 150 * row, 150), (190 + 150 * row, 700), 255, 5)
        image[mask > 0] = colour
        masks.append(mask > 0)
    noisy = image + np.random.default_rng(1).normal(0.0, 3.0, image.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8), masks, lines > 0


def contrast(grey, mask):
    return 1.0 - grey[mask].mean() / np.median(grey)


@pytest.mark.parametrize("rgb", [True, False])
@pytest.mark.parametrize("tint", [PAPER, (250, 235, 205)], ids=["white", "warm"])
def test_a_stroke_of_any_pencil_is_in_sight(tint, rgb):
    image, masks, _ = page([GRAPHITE, *PENCILS.values()], tint=tint)
    grey = to_grey(image if rgb else image[..., ::-1], rgb=rgb)
    assert min(contrast(grey, mask) for mask in masks) > IN_SIGHT
    assert abs(np.median(grey) - np.median(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))) <= 1


@pytest.mark.parametrize("ruling", RULINGS.values(), ids=RULINGS)
def test_coloured_rulings_of_the_paper_go_and_strokes_stay(ruling):
    strokes = [GRAPHITE, PENCILS["red"], PENCILS["blue"]]
    image, masks, lines = page(strokes, ruling)
    grey, luma = to_grey(image, rgb=True), cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    ruled = lines & ~np.any(masks, axis=0)
    assert contrast(luma, ruled) > OUT_OF_SIGHT > contrast(grey, ruled)
    for mask in masks:
        assert contrast(grey, mask) > contrast(luma, mask) - 0.01


def test_a_page_without_colours_is_its_luma():
    image, _, _ = page([GRAPHITE])
    assert np.array_equal(to_grey(image, rgb=True), cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))


def test_grey_rulings_are_no_colour():
    image, _, _ = page([GRAPHITE], (190, 190, 190))
    assert np.array_equal(to_grey(image, rgb=True), cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
