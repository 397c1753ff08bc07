"""The measure over real drawings, held against a painted page of which all is known."""

import json

import cv2
import numpy as np

from tests.bench.real_paper import measure, table


def test_what_was_found_on_a_page_is_counted(tmp_path):
    page = np.full((1400, 1800), 245, np.uint8)
    cv2.line(page, (300, 400), (1200, 500), 60, 4, cv2.LINE_AA)
    cv2.line(page, (340, 900), (1200, 900), 60, 4, cv2.LINE_AA)
    cv2.circle(page, (325, 900), 14, 60, 4, cv2.LINE_AA)
    cv2.imwrite(str(tmp_path / "drawn.png"), page)
    segments = [
        {"name": "drawn", "a": [300, 400], "b": [1200, 500], "ends": "--"},
        {"name": "joint", "a": [325, 900], "b": [1200, 900], "ends": "o-"},
        {"name": "not drawn", "a": [300, 1100], "b": [1200, 1200], "ends": "o>"},
    ]
    truth = {"picture": "drawn.png", "dpi_assumed": 300, "ruled": True, "segments": segments}
    (tmp_path / "truth-drawn.json").write_text(json.dumps(truth))
    (row,) = measure(tmp_path)
    assert (row.whole, row.segments) == (2, 3)
    assert max(row.off_mm) < 0.1
    assert (row.circles, row.joints) == (1, 2)
    assert (row.tips, row.tips_wrong, row.heads) == (0, 0, 1)
    _, _, (_, total) = table("painted", [row])
    assert total[1] == "2 of 3"
