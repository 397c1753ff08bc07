"""A sheet of paper while it is being drawn on: strokes, letters, and data for the truth."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from samples.simulation.lettering import Handwriting, WrittenSign, WrittenText, write
from samples.simulation.settings import HandStyle, PageStyle, PenStyle
from samples.simulation.strokes import ComplexArray, Dash, InkStroke, PenWidth, Rng, dashed, inked, straight

Segment = tuple[complex, complex]
PRINT_LAYER, MAIN_LAYER, PLAN_LAYER, SQUARES_LAYER = "print", "main", "plan", "squares"
CHAIN = Dash(9.0, 1.6, 0.5)
DASHES = Dash(4.0, 1.8)


@dataclass(frozen=True, slots=True)
class WrittenLabel:
    """A text on the sheet: what it names, its box (low, high corners) and its signs."""

    text: str
    names: str
    low: complex
    high: complex
    signs: tuple[WrittenSign, ...] = ()


@dataclass(slots=True)
class SheetSketch:
    """All that is drawn on one side of one sheet so far.

    Attributes
    ----------
    strokes : in the order of drawing
    labels : letters and texts
    lines : the strokes of named vectors and links, as ruled, by figure and name
    construction : thin construction lines, as ruled, by figure
    index, pole_index : written behind each letter, or behind a pole's, where a sheet has several positions
    with_supports : the fixed pivots' symbols are drawn, not there already
    """

    rng: Rng
    hand: HandStyle
    style: PenStyle
    page: PageStyle
    writing: Handwriting
    strokes: list[InkStroke] = field(default_factory=list)
    labels: list[WrittenLabel] = field(default_factory=list)
    lines: dict[tuple[str, str], Segment] = field(default_factory=dict)
    construction: dict[str, list[Segment]] = field(default_factory=dict)
    index: str = ""
    pole_index: str = ""
    with_supports: bool = True

    def pen(self, kind: str, *, plan: bool = False) -> PenWidth:
        """The student's pen for a kind of line: line, thin, text or print."""
        style = self.style
        layer = PLAN_LAYER if plan and style.plan_colour is not None else MAIN_LAYER
        match kind:
            case "line":
                return PenWidth(layer, style.line_mm, style.dark, style.pressure, style.wobble_mm)
            case "thin":
                return PenWidth(layer, style.thin_mm, style.thin_dark, style.pressure, style.wobble_mm)
            case "ghost":
                return PenWidth(layer, style.line_mm * 1.2, style.ghost_dark, 0.4, 0.08)
            case "print":
                return PenWidth(PRINT_LAYER, 0.35, 0.95, 0.0, 0.0)
            case _:
                return PenWidth(MAIN_LAYER, 0.8 * style.line_mm, 0.92 * style.dark, style.pressure, 0.0)

    def line(self, pen: PenWidth, p: complex, q: complex, dash: Dash | None = None) -> None:
        """Draw a straight stroke from p to q, exact but for its wobble."""
        if abs(q - p) < 0.05:
            return
        stroke = straight(self.rng, pen, p, q)
        self.strokes.extend([stroke] if dash is None else dashed(self.rng, stroke, dash))

    def curve(self, pen: PenWidth, points: ComplexArray, dash: Dash | None = None) -> None:
        """Draw a stroke through points."""
        stroke = inked(self.rng, pen, points)
        self.strokes.extend([stroke] if dash is None else dashed(self.rng, stroke, dash))

    def redrawn(self, p: complex, q: complex) -> Segment:
        """The ends of a stroke that should join two points: they miss them a little."""
        miss = self.hand.redraw_mm * (self.rng.standard_normal(2) + 1j * self.rng.standard_normal(2)) / 1.4
        along = (q - p) / max(abs(q - p), 1e-9)
        short = self.rng.normal(0.0, 0.6 * self.hand.redraw_mm, 2)
        return p + complex(miss[0]) - along * short[0], q + complex(miss[1]) + along * short[1]

    def chance(self, share: float) -> bool:
        """Return True with this probability."""
        return bool(self.rng.random() < share)

    # Writing ----------------------------------------------------------------------------------

    def text(self, at: complex, text: str, height_mm: float, *, names: str = "") -> WrittenText:
        """Write a text with its base line's start at a point."""
        written = write(self.rng, self.pen("text"), text, height_mm, self.writing).moved(at)
        self.strokes.extend(written.strokes)
        self.labels.append(WrittenLabel(text, names, written.low, written.high, written.signs))
        return written

    def letter(self, near: complex, text: str, height_mm: float, *, names: str, distance_mm: float) -> None:
        """Write a short text beside a point, in the emptiest of a few directions tried."""
        written = write(self.rng, self.pen("text"), text, height_mm, self.writing)
        middle = (written.low + written.high) / 2.0
        reach = distance_mm + abs(written.high - written.low) / 2.0
        if self.page.letters_touch and self.chance(self.page.letters_touch):
            reach *= float(self.rng.uniform(0.35, 0.8))
        angles = self.rng.uniform(0, 2 * np.pi) + np.arange(8) * (2 * np.pi / 8)
        tried = [near + reach * self.rng.uniform(0.75, 1.15) * complex(np.exp(1j * a)) for a in angles]
        centre = max(tried, key=self._room())
        placed = written.moved(centre - middle)
        self.strokes.extend(placed.strokes)
        self.labels.append(WrittenLabel(text, names, placed.low, placed.high, placed.signs))

    def _room(self) -> Callable[[complex], float]:
        """A function that gives the distance to the nearest ink, at most a letter's width, with noise."""
        ink = np.concatenate([stroke.points for stroke in self.strokes[-400:]] or [np.array([1e6 + 0j])])

        def room(centre: complex) -> float:
            return min(float(np.abs(ink - centre).min()), 3.5) + float(self.rng.normal(0.0, 0.5))

        return room
