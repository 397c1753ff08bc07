"""Real drawings, with segments, arrow tips and circles whose places were read by eye."""

import pytest

from tests.bench.real_paper import measure
from tests.samples.test_foreign_images import REAL

SEGMENTS, TIPS, CIRCLES = 34, 6, 12
"""Floors out of 37, 12 and 18; small heads drawn over printed dots are removed with the dots."""


@pytest.mark.skipif(not REAL.is_dir(), reason="the real images are not here")
def test_segments_tips_and_circles_of_real_drawings_are_found():
    rows = measure(REAL / "ruled")
    assert sum(row.segments for row in rows) == 37
    assert sum(row.whole for row in rows) >= SEGMENTS
    assert sum(row.tips for row in rows) >= TIPS
    assert sum(row.circles for row in rows) >= CIRCLES
    assert sum(row.tips_wrong for row in rows) == 0
    assert max(off for row in rows for off in row.off_mm) < 0.5
