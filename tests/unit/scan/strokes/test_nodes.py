"""The network of nodes finds where drawn vectors meet, and nothing on bare paper."""

import cv2
import numpy as np
import pytest

from grader.records import InkMap, NodeView
from grader.scan.strokes.nodes import PX_PER_MM, node_places

NODE = 40.3 - 30.2j
TAIL, HEAD = NODE - 25.0, NODE + 20.0 * np.exp(1.2j)


def drawn(px_per_mm: float, width_mm: float = 0.5) -> InkMap:
    """Two vectors that meet in `NODE`, the first with its arrowhead there."""
    ink = np.zeros((round(60 * px_per_mm), round(80 * px_per_mm)), np.uint8)
    barbs = (NODE + 3.0 * np.exp(1j * np.radians(180.0 + turn)) for turn in (-12.0, 12.0))
    for start, end in ((TAIL, NODE), (NODE, HEAD), *((NODE, barb) for barb in barbs)):
        ends = [
            (round(64 * (p.real * px_per_mm - 0.5)), round(64 * (-p.imag * px_per_mm - 0.5)))
            for p in (start, end)
        ]
        cv2.line(ink, *ends, 160, round(width_mm * px_per_mm), cv2.LINE_AA, shift=6)
    return InkMap(ink, px_per_mm)


def view_from(at: complex) -> NodeView:
    return NodeView(at, np.array([[TAIL, at], [at, HEAD]]))


@pytest.mark.parametrize("px_per_mm", [PX_PER_MM, 4.5])
@pytest.mark.parametrize("off", [0j, 0.5 + 0.3j, -0.4 - 0.6j])
def test_the_place_at_which_vectors_meet_is_found(off: complex, px_per_mm: float) -> None:
    places = node_places(drawn(px_per_mm), [view_from(NODE + off)])
    near = np.abs(places.at[0] - NODE) < 0.25
    assert places.share[0, near].sum() > 0.8


def test_bare_paper_tells_no_place_as_exactly_as_ink_does() -> None:
    blank = InkMap(np.zeros((360, 480), np.uint8), PX_PER_MM)
    on_paper, in_ink = (node_places(where, [view_from(NODE)]) for where in (blank, drawn(PX_PER_MM)))
    exactly = [places.se_mm[0, places.share[0].argmax()] for places in (on_paper, in_ink)]
    assert exactly[0] > 3.0 * exactly[1]


def test_views_are_answered_each_by_itself() -> None:
    views = [view_from(NODE), NodeView(HEAD, np.array([[NODE, HEAD]]))]
    together = node_places(drawn(PX_PER_MM), views)
    for row, view in enumerate(views):
        alone = node_places(drawn(PX_PER_MM), [view])
        assert np.allclose(together.at[row], alone.at[0], atol=1e-4)
        assert np.allclose(together.share[row], alone.share[0], atol=1e-4)
