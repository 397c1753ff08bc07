"""Simulated students, pens and scanners, with the truth of what was drawn.

``simulate(assignment, variant, seed, settings)`` gives a student's sheets as images with their
truth; ``any_settings(seed)`` draws a random student of a mixed class. The same seed gives the same
drawing whatever the scanner: hand, page, pen and scanner have random streams of their own.
"""

from samples.simulation.desk import PrintedSheet
from samples.simulation.habits import HABITS
from samples.simulation.mixture import HARDSHIPS, PENS, any_settings, with_hardships
from samples.simulation.settings import (
    CAREFUL,
    CLEAN_SCAN,
    PERFECT,
    SLOPPY,
    TYPICAL,
    HandStyle,
    PageStyle,
    PenStyle,
    Scan,
    Settings,
    Student,
)
from samples.simulation.student import (
    SimulatedSheet,
    blank_back,
    encoded,
    measured_by,
    simulate,
    write_pdf,
    write_truth,
)

__all__ = [
    "CAREFUL",
    "CLEAN_SCAN",
    "HABITS",
    "HARDSHIPS",
    "PENS",
    "PERFECT",
    "SLOPPY",
    "TYPICAL",
    "HandStyle",
    "PageStyle",
    "PenStyle",
    "PrintedSheet",
    "Scan",
    "Settings",
    "SimulatedSheet",
    "Student",
    "any_settings",
    "blank_back",
    "encoded",
    "measured_by",
    "simulate",
    "with_hardships",
    "write_pdf",
    "write_truth",
]
