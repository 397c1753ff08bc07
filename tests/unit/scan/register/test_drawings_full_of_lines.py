"""Pages that are A3 by their stated resolution, with long lines that look like a frame seen askew."""

import cv2
import numpy as np
import pytest

from grader.records import Page, Sheet
from grader.scan.register.registration import register
from reference.drawing.canvas import MM_PER_INCH

A3_MM = (420.0, 297.0)


def assembly_drawing(seed: int, dpi: float) -> Page:
    """Four long lines that make a crooked quadrilateral, and shorter ones within it."""
    lot, px_per_mm = np.random.default_rng(seed), dpi / MM_PER_INCH
    paper = np.full((int(A3_MM[1] * px_per_mm), int(A3_MM[0] * px_per_mm)), 246, np.uint8)
    left, right = lot.uniform(25, 90), lot.uniform(330, 400)
    top, bottom = lot.uniform(20, 70), lot.uniform(220, 275)
    corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    corners += lot.normal(0.0, 2.5, (4, 2))
    lines = [(corners[side], corners[(side + 1) % 4]) for side in range(4)]
    for _ in range(14):
        middle, turn = lot.uniform([60, 50], [360, 240]), lot.uniform(0.0, np.pi)
        half = lot.uniform(10, 45) * np.array([np.cos(turn), np.sin(turn)])
        lines.append((middle - half, middle + half))
    for first, last in lines:
        ends = [tuple(int(value) for value in end * px_per_mm) for end in (first, last)]
        cv2.line(paper, *ends, 75, max(1, round(0.4 * px_per_mm)), cv2.LINE_AA)
    grey = np.clip(paper + lot.normal(0.0, 3.0, paper.shape), 0, 255).astype(np.uint8)
    return Page("assembly.png", 1, grey, (dpi, dpi))


@pytest.mark.parametrize("seed", range(8))
def test_lines_of_a_drawing_are_no_frame_where_the_page_says_how_large_it_is(seed):
    dpi = (200.0, 300.0)[seed % 2]
    sheet, _ = register(assembly_drawing(seed, dpi))
    assert isinstance(sheet, Sheet)
    assert sheet.px_per_mm * MM_PER_INCH == pytest.approx(dpi, rel=0.005)


def test_a_camera_may_have_seen_what_is_not_in_the_shape_of_the_sheet():
    """The same lines in a picture of 4 to 3 may be a sheet's frame seen askew: no scale is certain."""
    page = assembly_drawing(1, 300.0)
    more = round(page.grey.shape[1] * 0.75) - page.grey.shape[0]
    tall = np.pad(page.grey, ((0, more), (0, 0)), mode="edge")
    sheet, _ = register(Page("photo.jpg", 1, tall, (72.0, 72.0)))
    assert not isinstance(sheet, Sheet) or sheet.problems
