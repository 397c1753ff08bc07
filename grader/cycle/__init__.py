"""A mechanism's cycle as people ask for it: named quantities, extremes and strokes, a table, a diagram."""

from grader.cycle.quantities import Asked, Quantity, Subject
from grader.cycle.strokes import Extreme, Stroke, extremes, strokes_of
from grader.cycle.table import cycle_csv

__all__ = ["Asked", "Extreme", "Quantity", "Stroke", "Subject", "cycle_csv", "extremes", "strokes_of"]
