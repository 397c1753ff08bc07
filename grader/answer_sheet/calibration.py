"""The calibration page: markers and segments of known length, to measure printer and scanner."""

import numpy as np

from grader.answer_sheet.drawing import Drawing
from grader.answer_sheet.page import draw_ruler
from grader.answer_sheet.sheets import Sheets
from grader.i18n import N_, tongue
from grader.layout import CALIBRATION, Layout, PageLayout, marker_places
from grader.records import FloatArray

_PEN_MM = 0.3
_ADVICE = N_(
    "Calibration page of planmark. Print it on A3 at 100 %, scan it as the drawings will be scanned, and let"
    " planmark read it: the segments are known, so their errors are the printer's and the scanner's."
)
_LENGTHS_MM = (5.0, 10.0, 20.0, 40.0, 80.0)
_ANGLES_DEG = tuple(range(0, 180, 15))


def calibration_segments() -> FloatArray:
    """(n, 2, 2) ends of the printed segments in mm, y down: stars of directions, ladders of lengths.

    A star has twelve diameters of 60 mm, 15 degrees apart, with its middle left free; a ladder has
    horizontal or vertical segments of 5 to 80 mm.
    """
    segments: list[tuple[complex, complex]] = []
    for centre in (85.0 + 100.0j, 215.0 + 100.0j, 345.0 + 100.0j):
        for angle in _ANGLES_DEG:
            along = np.exp(-1j * np.radians(angle))
            segments.append((centre + 12.0 * along, centre + 40.0 * along))
            segments.append((centre - 12.0 * along, centre - 40.0 * along))
    for row, length in enumerate(_LENGTHS_MM):
        y = 165.0 + 18.0 * row
        segments.extend((x + 1j * y, x + length + 1j * y) for x in (40.0, 140.0, 240.0))
    for column, length in enumerate(_LENGTHS_MM):
        x = 335.0 + 14.0 * column
        segments.append((x + 160.0j, x + 1j * (160.0 + length)))
    return np.array([[(end.real, end.imag) for end in ends] for ends in segments])


def make_calibration(lang: str = "en") -> Sheets:
    """The page that `planmark sheet --calibration` prints."""
    words = tongue(lang)
    drawing = Drawing.begin(words.gettext(N_("Calibration page")))
    drawing.frame()
    drawing.markers(CALIBRATION)
    drawing.paragraphs((39.0, 16.0, 103.0, 36.0), [words.gettext(_ADVICE)], (9.0, 8.0, 7.0), pitch=1.3)
    for (x0, y0), (x1, y1) in calibration_segments().tolist():
        drawing.line((x0, y0, x1, y1), _PEN_MM)
    draw_ruler(drawing, words)
    drawing.next_page()
    page = PageLayout(kind="calibration", markers=marker_places(CALIBRATION), zones={"fields": {}})
    return Sheets(drawing.finish(), Layout(pages=[page]))
