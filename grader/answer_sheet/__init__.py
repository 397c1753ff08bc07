"""Printable answer sheets: true-size A3 pages with markers, code, data, zones and boxes."""

from grader.answer_sheet.calibration import calibration_segments, make_calibration
from grader.answer_sheet.sheets import Sheets, cells_of, make_sheets, page_layouts

__all__ = ["Sheets", "calibration_segments", "cells_of", "make_calibration", "make_sheets", "page_layouts"]
