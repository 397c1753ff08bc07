"""Letters, captions and table texts of the reference drawing touch no stroke and no other text.

Measured in the SVG, with the font's own metrics (not those that the drawing reckons with).
"""

import math
import xml.etree.ElementTree as ET
from functools import cache
from importlib.resources import files

import numpy as np
import pytest
from PIL import ImageFont

from grader.language import tongue
from grader.solution.sentences import wording_of
from reference.drawing.canvas import svg
from reference.drawing.sheets import reference_drawing
from tests.drawn import CASES, planned
from tests.examples import slow

SVG = "{http://www.w3.org/2000/svg}"
TOUCH_MM = 0.1
"""Largest overlap of a letter with a stroke's edge or another letter: a fifth of a thin line's width."""
SLANT = math.tan(math.radians(12.0))
FONT_PX = 200
FAR_MM = 2.0
"""Edges farther than this from a text are not looked at."""


@cache
def font():
    return ImageFont.truetype(str(files("grader") / "data/fonts/DejaVuSansCondensed.ttf"), FONT_PX)


def ink_box(text, x, base, size, anchor, slanted):
    """Left, top, right, bottom of the letters' ink, millimetres."""
    left, top, right, bottom = (value * size / FONT_PX for value in font().getbbox(text, anchor="ls"))
    shift = {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * font().getlength(text) * size / FONT_PX
    lean = SLANT * -top if slanted else 0.0
    return (x - shift + left, base + top, x - shift + right + lean, base + bottom)


def texts(root):
    """Every text with the boxes of its pieces."""
    found = []
    for text in root.iter(f"{SVG}text"):
        slanted, anchor = text.get("font-style") == "italic", text.get("text-anchor", "start")
        pieces = list(text.iter(f"{SVG}tspan")) or [text]
        boxes = [
            ink_box(
                piece.text, float(piece.get("x")), float(piece.get("y")), float(piece.get("font-size")),
                anchor, slanted,
            )
            for piece in pieces
        ]  # fmt: skip
        found.append(("".join(text.itertext()), boxes))
    return found


def strokes(root):
    """Every edge drawn: both ends and half its width."""
    for line in root.iter(f"{SVG}line"):
        ends = tuple(float(line.get(key)) for key in ("x1", "y1", "x2", "y2"))
        yield (*ends, float(line.get("stroke-width")) / 2)
    for kind, closed in (("polygon", True), ("polyline", False)):
        for shape in root.iter(f"{SVG}{kind}"):
            points = [tuple(map(float, pair.split(","))) for pair in shape.get("points").split()]
            following = [*points[1:], points[0]] if closed else points[1:]
            for p, q in zip(points, following, strict=False):
                yield (*p, *q, float(shape.get("stroke-width", 0.0)) / 2)
    for ring in root.iter(f"{SVG}circle"):
        x, y, radius = (float(ring.get(key)) for key in ("cx", "cy", "r"))
        for k in range(24):
            a, b = (radius * np.exp(1j * math.tau * turn / 24) for turn in (k, k + 1))
            yield (x + a.real, y + a.imag, x + b.real, y + b.imag, float(ring.get("stroke-width")) / 2)


def least_distance(box, edges):
    """The least distance of sampled points of the edges' middle lines from a box, less half their width."""
    x0, x1 = np.minimum(edges[:, 0], edges[:, 2]), np.maximum(edges[:, 0], edges[:, 2])
    y0, y1 = np.minimum(edges[:, 1], edges[:, 3]), np.maximum(edges[:, 1], edges[:, 3])
    near = (x0 < box[2] + FAR_MM) & (x1 > box[0] - FAR_MM) & (y0 < box[3] + FAR_MM) & (y1 > box[1] - FAR_MM)
    edges = edges[near]
    if not len(edges):
        return FAR_MM
    share = np.linspace(0.0, 1.0, 1000)[:, None]
    x = edges[:, 0] + share * (edges[:, 2] - edges[:, 0])
    y = edges[:, 1] + share * (edges[:, 3] - edges[:, 1])
    dx = np.maximum(np.maximum(box[0] - x, x - box[2]), 0.0)
    dy = np.maximum(np.maximum(box[1] - y, y - box[3]), 0.0)
    inside = np.minimum(np.minimum(x - box[0], box[2] - x), np.minimum(y - box[1], box[3] - y))
    away = np.where(inside > 0.0, -inside, np.hypot(dx, dy))
    return np.min(away - edges[:, 4])


def overlap(one, other):
    return min(min(one[2], other[2]) - max(one[0], other[0]), min(one[3], other[3]) - max(one[1], other[1]))


@pytest.mark.parametrize("lang", ["ru", *slow("en")])
@pytest.mark.parametrize("case", CASES)
def test_no_text_touches_a_stroke_or_another_text(case, lang, tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawn")
    assignment, plan = planned(case, folder)
    for sheet in reference_drawing(assignment, plan, wording=wording_of(tongue(lang))):
        root = ET.fromstring(svg([sheet.shapes]))
        told, edges = texts(root), np.array(list(strokes(root)))
        assert len(told) > 20
        for k, (text, boxes) in enumerate(told):
            for box in boxes:
                assert least_distance(box, edges) >= -TOUCH_MM, text
                for other, others in told[k + 1 :]:
                    assert max(overlap(box, one) for one in others) <= TOUCH_MM, (text, other)


def test_the_measure_itself_sees_a_letter_on_a_line():
    root = ET.fromstring(
        '<svg xmlns="http://www.w3.org/2000/svg"><line x1="0" y1="9" x2="30" y2="9" stroke-width="0.3"/>'
        '<text x="10" y="10" font-size="4">a</text><text x="11" y="10" font-size="4">b</text></svg>'
    )
    (_, [a]), (_, [b]) = texts(root)
    assert least_distance(a, np.array(list(strokes(root)))) < -TOUCH_MM
    assert overlap(a, b) > TOUCH_MM
