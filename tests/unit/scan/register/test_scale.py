"""The sheet's scale is known as well as it says, also where the file's resolution is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from grader.records import Sheet
from grader.scan.decode.pages import page_of
from grader.scan.register.registration import rectify
from reference.authored.assignment import load_assignment
from samples.simulation import any_settings, simulate
from tests.examples import slow

PUMP = load_assignment("pump")
STANDARD_ERRORS = 4.0


OTHERS = [(1, 150.0), (3, 150.0), (4, 150.0), (2, 300.0)]
"""Sheets (seed, dpi). On 2 and 36 the paper's shadowed edges pass for an ISO frame, 8 % larger."""


def log_scale(mm_to_px) -> float:
    """The logarithm of the resolution at the sheet's middle."""
    corners = np.array([[210.0, 148.0, 1.0], [211.0, 148.0, 1.0], [210.0, 149.0, 1.0]])
    found = corners @ np.asarray(mm_to_px).T
    at, right, down = found[:, :2] / found[:, 2:]
    return 0.5 * np.log(abs(np.linalg.det(np.column_stack([right - at, down - at]))))


@pytest.mark.parametrize(
    ("seed", "dpi"),
    [(0, 150.0), *slow((36, 300.0), *OTHERS)],
)
def test_a_wrong_resolution_never_gives_a_wrong_scale_with_confidence(seed, dpi, tmp_path):
    settings = any_settings(seed, device="flatbed", dpi=dpi, mistakes=0.0)
    settings = replace(settings, scan=replace(settings.scan, dpi_tag=dpi / 2.0))
    (drawn, *_) = simulate(PUMP, PUMP.variant(7), seed, settings)
    sheet = rectify(page_of(drawn.save(tmp_path / "s01"), 1))
    if not isinstance(sheet, Sheet):
        return  # refused with a reason: nobody is misled
    off = abs(log_scale(sheet.mm_to_px) - log_scale(drawn.truth["homography"]))
    assert off <= STANDARD_ERRORS * sheet.scale_se
