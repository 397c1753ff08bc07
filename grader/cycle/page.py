"""What the parts of a diagram share: whose cycle it is, colours, sizes of letters, what is drawn of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from grader.cycle.marks import Mark, marks_of
from grader.cycle.quantities import Quantity, Subject
from grader.i18n import Tongue
from reference.assignment import Assignment, Variant
from reference.geometry import FloatArray
from reference.lettering import Text, pieces_of

TEXT_MM, TICK_MM, NAME_MM = 3.4, 3.1, 3.8
GREY = "#5b6470"
COLOURS = ("#0b62a8", "#c8501e", "#11806a", "#8e3b8c", "#b07a00", "#4a4f57", "#d1306e", "#3f8fd0")
DRAWN_AT_MOST = 1500
MARGIN = 0.035
"""Of a range, shown beyond each of its ends."""


@dataclass(frozen=True, slots=True)
class Setting:
    """Whose cycle it is, and in what language it is told."""

    assignment: Assignment
    variant: Variant
    words: Tongue

    def shown(self, name: str) -> Text:
        """A name as students see it."""
        return pieces_of(self.assignment.file.names.get(name, name))


@dataclass(slots=True)
class Sheet:
    """What the panels of a page share.

    Attributes
    ----------
    chosen : indices of the samples that are drawn
    across : their driven coordinates as told, degrees or millimetres
    view : what the axis shows
    """

    subject: Subject
    setting: Setting
    chosen: NDArray[np.intp]
    across: FloatArray
    view: tuple[float, float]
    marks: Sequence[Mark]
    colours: dict[str, str] = field(default_factory=dict)

    def colour(self, quantity: Quantity) -> str:
        """One for each vector's or link's own, the same in every panel."""
        whose = quantity.of.partition("_")[2]
        return self.colours.setdefault(whose, COLOURS[len(self.colours) % len(COLOURS)])

    def colours_of(self, points: Sequence[str]) -> dict[str, str]:
        """Of paths: that of the point's velocity, where it has one, else one that is free."""
        free = [colour for colour in COLOURS if colour not in self.colours.values()] or list(COLOURS)
        others = [point for point in points if point not in self.colours]
        own = {point: free[k % len(free)] for k, point in enumerate(others)}
        return {point: own.get(point) or self.colours[point] for point in points}


def sheet_of(subject: Subject, setting: Setting) -> Sheet:
    """A page for a cycle; of very many samples some are drawn."""
    cycle = subject.cycle
    told = as_told(subject, cycle.driven)
    step = max(1, math.ceil(told.size / DRAWN_AT_MOST))
    chosen = np.unique(np.append(np.arange(0, told.size, step), told.size - 1))
    margin = 0.0 if cycle.turns else MARGIN * float(told[-1] - told[0])
    view = (float(told[0]) - margin, float(told[-1]) + margin)
    return Sheet(subject, setting, chosen, told[chosen], view, marks_of(subject, setting.words))


def as_told(subject: Subject, driven: FloatArray) -> FloatArray:
    """Driven coordinates in degrees or millimetres."""
    return np.asarray(np.degrees(driven) if subject.cycle.is_turned else 1e3 * driven)
