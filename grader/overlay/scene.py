"""The contents of an overlay, in sheet millimetres (x right, y down): arrows with verdicts, nodes, labels.

Painters draw a scene on the scan: `grader.overlay.picture` as pixels, `grader.overlay.closeup` as SVG. Right
and wrong differ by colour, mark *and* line: wrong ones are thick, nearly right ones have long dashes,
doubtful ones short ones, expected ones dots. Colour alone distinguishes nothing.
"""

import cmath
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.documents import CriterionDocument
from grader.language import NO_NAMES
from grader.outcomes import CHARGED, Outcome
from grader.records import MECHANISM, Box, FloatArray, Reading, ReadVector, on_sheet
from reference.construction.graph import ON_SKETCH, Vector
from reference.drawing import symbols
from reference.drawing.canvas import PAPER, Area, Curve, Label, Ring, Shape, Stroke, Text, pieces_of, width_of
from reference.drawing.labels import lengths_inside

XY = tuple[float, float]

LEAST_SURE = 0.9
"""Confidence below which an arrow is shown as doubtful whatever its verdict."""

COLOURS = {
    "full": "#00594f",
    "partial": "#9a6f00",
    "none": "#98200c",
    "follow_through": "#2b6cd4",
    "review": "#7a1580",
    "not_judged": "#73767a",
}
"""Colours of the verdicts: apart in lightness and hue for every kind of colour vision."""

MARKS = {
    "full": "✓",
    "partial": "~",
    "none": "✗",
    "follow_through": "→",
    "review": "?",
    "not_judged": "–",
}

MARK_STROKES: dict[str, tuple[tuple[XY, ...], ...]] = {
    "full": (((-1.0, 0.05), (-0.3, 0.8), (1.0, -0.8)),),
    "none": (((-0.75, -0.75), (0.75, 0.75)), ((-0.75, 0.75), (0.75, -0.75))),
    "partial": (((-1.0, 0.25), (-0.5, -0.3), (0.5, 0.3), (1.0, -0.25)),),
    "review": (
        ((-0.6, -0.55), (-0.3, -0.95), (0.3, -0.95), (0.6, -0.55), (0.5, -0.2), (0.0, 0.1), (0.0, 0.35)),
        ((0.0, 0.9), (0.0, 0.92)),
    ),
    "follow_through": (((-1.0, 0.0), (0.95, 0.0)), ((0.3, -0.6), (0.95, 0.0), (0.3, 0.6))),
    "not_judged": (((-0.8, 0.0), (0.8, 0.0)),),
}
"""The marks as strokes, in units of about a millimetre, y down: no font is needed for them."""

ARROW_WIDTH_MM: Mapping[str, float] = {
    "full": 0.5, "partial": 0.75, "none": 0.95, "follow_through": 0.5, "review": 0.5, "not_judged": 0.3,
}  # fmt: skip
"""Wrong arrows are thicker: they are visible in a grey print, too."""
ARROWHEAD_MM = (3.2, 1.0)
"""Length and half width."""
LEAST_ARROW_MM = 0.05
"""Shorter arrows are not drawn."""
DASH_MM = (2.2, 1.5)
"""Doubtful arrows: dash, gap."""
NEARLY_MM = (5.0, 1.0)
"""Nearly right arrows: dash, gap."""
GHOST_COLOUR = "#59626d"
GHOST_DASH_MM = (0.35, 1.0)
GHOST_WIDTH_MM = 0.5
"""Expected vectors are dotted."""
NODE_COLOUR = "#24303c"
INK_COLOUR, INK_MM = "#c4007a", 0.7
"""Free ink: no verdict has this colour."""
HAS_GHOST = CHARGED | {"review"}
"""Verdicts of vectors that have a ghost."""


@dataclass(frozen=True, slots=True)
class Arrow:
    """A named vector as read; `verdict` is `not_judged` if the rubric does not ask for it.

    A link of the mechanism has no head (`is_link`), and its name is shown only if it is not right.
    """

    name: str
    figure: str
    tail: XY
    tip: XY
    verdict: str
    doubtful: bool
    is_link: bool = False

    @property
    def is_named(self) -> bool:
        """True if its mark and name are shown."""
        return not self.is_link or self.verdict != "full"

    @property
    def length(self) -> float:
        """Length, mm."""
        return math.dist(self.tail, self.tip)

    @property
    def dash(self) -> XY | None:
        """Dash and gap of its shaft, None for a solid one."""
        if self.doubtful:
            return DASH_MM
        return NEARLY_MM if self.verdict == "partial" else None


@dataclass(frozen=True, slots=True)
class Ghost:
    """The expected vector, drawn from the start of the drawn one; `verdict` is that of the drawn one."""

    name: str
    figure: str
    tail: XY
    tip: XY
    verdict: str = "none"


@dataclass(frozen=True, slots=True)
class Dot:
    """A node as read; `lettered` if no drawing beneath has its letter."""

    name: str
    at: XY
    doubtful: bool
    lettered: bool = False
    figure: str = ""


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything drawn on one sheet."""

    page_mm: XY
    arrows: tuple[Arrow, ...] = ()
    ghosts: tuple[Ghost, ...] = ()
    dots: tuple[Dot, ...] = ()
    ink: tuple[tuple[XY, ...], ...] = ()
    """Strokes that a person drew for the student."""


@dataclass(frozen=True, slots=True)
class Picture:
    """One page with its scene: for the feedback page and for ``overlay.png``.

    Attributes
    ----------
    png : the overlay, painted
    scan : the cleaned scan alone, upright, for the page that draws the scene as SVG; a PNG or JPEG file,
        whichever is smaller; empty if nothing was scanned
    scene : its marks; its page_mm spans the whole picture
    """

    source: str
    page: int
    png: bytes
    scan: bytes
    scene: Scene


_NO_LINKS: Mapping[str, tuple[str, str]] = {}


Judged = Outcome | CriterionDocument
"""A verdict and the expected vector."""


def scene_of(
    page_mm: XY,
    reading: Reading,
    vectors: Mapping[str, Vector],
    outcomes: Mapping[str, Judged],
    *,
    show_expected: bool,
    links: Mapping[str, tuple[str, str]] = _NO_LINKS,
) -> Scene:
    """Return the scene of one sheet's reading; `outcomes` by the vector's or link's name."""
    arrows = [*_arrows(reading, vectors, outcomes), *_links(reading, links, outcomes)]
    dots = tuple(
        Dot(name, on_sheet(node.at), node.confidence < LEAST_SURE, figure=kind)
        for kind, figure in reading.figures.items()
        for name, node in (figure.nodes.items() if not figure.drawn else ())
    )
    ghosts = tuple(ghosts_of(arrows, outcomes)) if show_expected else ()
    return Scene(page_mm, tuple(arrows), ghosts, dots)


def between(start: XY, end: XY, share: float) -> XY:
    """Return the point at a share of the way."""
    return (start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))


def _arrows(
    reading: Reading, vectors: Mapping[str, Vector], outcomes: Mapping[str, Judged]
) -> Iterator[Arrow]:
    for kind, figure in reading.figures.items():
        for name, read in figure.vectors.items():
            ends = vectors.get(name)
            if ends is None or ends.tail not in figure.nodes or ends.head not in figure.nodes:
                continue
            places = figure.drawn.get(name) or tuple(figure.nodes[node].at for node in ends.arrow)
            outcome = outcomes.get(name)
            verdict = "not_judged" if outcome is None else outcome.verdict
            start, end = map(on_sheet, places)
            doubtful = verdict == "review" or read.confidence < LEAST_SURE
            yield Arrow(name, kind, start, end, verdict, doubtful)


def _links(
    reading: Reading, links: Mapping[str, tuple[str, str]], outcomes: Mapping[str, Judged]
) -> Iterator[Arrow]:
    """Yield the links of the sketch that were judged, and what was added to it."""
    sketch = reading.figures.get(MECHANISM)
    for name, (tail, head) in links.items():
        outcome = outcomes.get(name)
        if sketch is None or outcome is None or tail not in sketch.nodes:
            continue
        start, added = sketch.nodes[tail].at, _along(sketch.vectors.get(name))
        end = start + added if added is not None else sketch.nodes[head].at if head in sketch.nodes else None
        if end is not None and outcome.verdict != "not_judged":
            is_link = not name.endswith(ON_SKETCH)
            doubtful, ends = outcome.verdict == "review", (on_sheet(start), on_sheet(end))
            yield Arrow(name, MECHANISM, *ends, outcome.verdict, doubtful, is_link=is_link)


def _along(read: ReadVector | None) -> complex | None:
    if read is None or read.length_mm is None or read.direction_deg is None:
        return None
    return cmath.rect(read.length_mm, math.radians(read.direction_deg))


def ghosts_of(arrows: Iterable[Arrow], outcomes: Mapping[str, Judged]) -> Iterator[Ghost]:
    """Yield the expected vectors for those that are wrong or wait for a person."""
    for arrow in arrows:
        expected = expected_vector(outcomes.get(arrow.name))
        if arrow.verdict in HAS_GHOST and expected is not None:
            yield ghost_of(arrow, expected)


def expected_vector(outcome: Judged | None) -> complex | None:
    """Return the expected vector, complex mm, y up; None if it is not known."""
    if outcome is None or outcome.expected.length_mm is None or outcome.expected.direction_deg is None:
        return None
    return cmath.rect(outcome.expected.length_mm, math.radians(outcome.expected.direction_deg))


def ghost_of(arrow: Arrow, expected: complex) -> Ghost:
    """Return the expected vector, drawn from the start of the drawn one."""
    tip = (arrow.tail[0] + expected.real, arrow.tail[1] - expected.imag)
    return Ghost(arrow.name, arrow.figure, arrow.tail, tip, arrow.verdict)


# Labels --------------------------------------------------------------------------------------------

LABEL_HEIGHT_MM = 3.4
NAME_MM, BOLD_SHARE = 3.1, 1.1
"""Size of names; pages set them bold, wider by this factor than the font that `width_of` measures."""
BADGE_MM = 3.8
LEADER_FROM_MM = 3.0
"""A label farther than this from its arrow gets a thin line to it."""

SHARES = (0.55, 0.4, 0.7, 0.25, 0.85)
GAPS_MM = (1.2, 3.5, 6.0, 9.0, 12.0, 16.0, 21.0, 27.0)
"""Possible distances of a label from its arrow, the best first."""
OVERLAP_COST = 16.0
"""Cost of a square millimetre on another label; a millimetre of distance costs a half,"""
CROSSING_COST = 2.0
"""and a millimetre of another arrow under the label this much."""
ARROW_OPACITY, FAINT, GROUND_OPACITY = 0.85, 0.3, 0.82
"""The drawing stays visible under arrows, and faintly under the ground of labels."""


@dataclass(frozen=True, slots=True)
class ArrowLabel:
    """Position of an arrow's mark and name; `size` as of `labels_of`."""

    arrow: Arrow
    text: Text
    box: Box
    size: float

    @property
    def badge(self) -> tuple[XY, float]:
        """Centre and radius of the disc with the mark."""
        x, y, _width, height = self.box
        return (x + self.size * (BADGE_MM / 2 + 0.1), y + height / 2), self.size * (BADGE_MM / 2 - 0.15)

    @property
    def foot(self) -> XY:
        """Start of the name's line."""
        return (self.box[0] + self.size * (BADGE_MM + 0.6), self.box[1] + self.box[3] - self.size * 1.25)

    @property
    def leader(self) -> tuple[XY, XY] | None:
        """Line from a distant label to its arrow."""
        x, y, width, height = self.box
        middle = between(self.arrow.tail, self.arrow.tip, 0.55)
        near = (min(max(middle[0], x), x + width), min(max(middle[1], y), y + height))
        return (near, middle) if math.dist(near, middle) > self.size * LEADER_FROM_MM else None


def labels_of(
    arrows: Sequence[Arrow], within: Box, size: float = 1.0, names: Mapping[str, str] = NO_NAMES
) -> list[ArrowLabel]:
    """Return the position of each arrow's mark and name; `size` 1 suits a whole sheet, less a close-up.

    Greedy, long arrows first: each label takes the cheapest of its candidates.
    """
    taken = np.zeros((0, 4))
    labels = []
    for arrow in sorted(arrows, key=lambda one: -one.length):
        others = np.array([(*one.tail, *one.tip, 0.0) for one in arrows if one is not arrow]).reshape(-1, 5)
        text = pieces_of(names.get(arrow.name, arrow.name).removesuffix(ON_SKETCH))
        wide = BADGE_MM + 1.0 + BOLD_SHARE * width_of(text, NAME_MM)
        far, boxes = _candidates(arrow, within, size, wide)
        corners = np.hstack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]])
        crossed = lengths_inside(corners, others, clear=0.0).sum(axis=1)
        crowded = OVERLAP_COST * _overlaps(boxes, taken) + CROSSING_COST * crossed
        best = boxes[int(np.argmin(far + crowded / size**2))]
        taken = np.vstack([taken, best])
        x, y, width, height = best.tolist()
        labels.append(ArrowLabel(arrow, text, (x, y, width, height), size))
    return labels


def _candidates(arrow: Arrow, within: Box, size: float, wide_mm: float) -> tuple[FloatArray, FloatArray]:
    """Return costs of a label's candidates by distance, (p,), and boxes, (p, 4): x, y, width, height."""
    box = size * np.array([wide_mm, LABEL_HEIGHT_MM + 0.6])
    tail, along = np.array(arrow.tail), np.array([1.0, 0.0])
    step = np.array(arrow.tip) - tail
    if arrow.length > 0.0:
        along = step / arrow.length
    across = np.array([-along[1], along[0]])
    reach = float(np.abs(across) @ box) / 2.0
    share, gap, side = (one.ravel() for one in np.meshgrid(SHARES, GAPS_MM, (1.0, -1.0), indexing="ij"))
    middles = tail + share[:, None] * step + (side * (reach + size * gap))[:, None] * across
    room = np.maximum(np.array(within[2:]) - box, 1.0)
    corners = np.clip(middles - box / 2.0, np.array(within[:2]) + 0.5, np.array(within[:2]) + room - 0.5)
    return 0.5 * gap + np.abs(share - SHARES[0]), np.hstack([corners, np.broadcast_to(box, corners.shape)])


def _overlaps(boxes: FloatArray, taken: FloatArray) -> FloatArray:
    """Return the area that each of (p, 4) boxes shares with (t, 4) others."""
    low = np.maximum(boxes[:, None, :2], taken[:, :2])
    high = np.minimum(boxes[:, None, :2] + boxes[:, None, 2:], taken[:, :2] + taken[:, 2:])
    shared: FloatArray = np.prod(np.maximum(high - low, 0.0), axis=2).sum(axis=1)
    return shared


# Marks as shapes ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Layer:
    """Shapes of equal opacity."""

    shapes: tuple[Shape, ...]
    opacity: float = 1.0


def layers_of(
    scene: Scene,
    box: Box,
    named: Collection[Arrow],
    names: Mapping[str, str],
    *,
    size: float = 1.0,
    faint: Collection[Arrow] = (),
) -> tuple[Layer, ...]:
    """Return the marks of a scene as shapes, the lowest first.

    Arguments
    ---------
    box : the visible part of the page
    named : the arrows that get a label
    names : from names of vectors and links to those that students know
    size : of marks and letters; 1 suits a whole sheet, less a close-up
    faint : arrows shown for orientation only
    """
    labels = labels_of(list(named), box, size, names)
    dots = [dot for dot in scene.dots if is_in(dot.at, box)]
    layers = (
        Layer(tuple(shape for arrow in faint for shape in _arrow(arrow, size)), FAINT),
        Layer(tuple(shape for ghost in scene.ghosts for shape in _ghost(ghost, size))),
        Layer(tuple(shape for arrow in scene.arrows for shape in _arrow(arrow, size)), ARROW_OPACITY),
        Layer(tuple(shape for dot in dots for shape in _dot(dot, size))),
        Layer(tuple(_ground(label) for label in labels), GROUND_OPACITY),
        Layer(tuple(shape for label in labels for shape in _label(label))),
        Layer(tuple(ink_of(scene.ink))),
    )
    return tuple(layer for layer in layers if layer.shapes)


def ink_of(strokes: Iterable[tuple[XY, ...]]) -> Iterator[Shape]:
    """Yield the shapes of strokes that a person drew."""
    return (Curve(points, INK_MM, INK_COLOUR) for points in strokes)


def is_in(at: XY, box: Box) -> bool:
    """Return whether a point is inside a box."""
    return box[0] <= at[0] <= box[0] + box[2] and box[1] <= at[1] <= box[1] + box[3]


def _ghost(ghost: Ghost, size: float) -> Iterator[Shape]:
    width = GHOST_WIDTH_MM * size
    dash = tuple(length * size for length in GHOST_DASH_MM)
    yield Stroke(ghost.tail, ghost.tip, width, GHOST_COLOUR, dash)
    yield Ring(ghost.tip, 0.9 * size, 0.3 * size, GHOST_COLOUR, "none")


def _dot(dot: Dot, size: float) -> Iterator[Shape]:
    colour = COLOURS["review"] if dot.doubtful else NODE_COLOUR
    yield Ring(dot.at, 0.8 * size, 0.3 * size, colour, "none")
    if dot.lettered:
        at = (dot.at[0] + 1.3 * size, dot.at[1] - 1.3 * size)
        yield Label(at, pieces_of(dot.name), 3.0 * size, "start", colour)


def _arrow(arrow: Arrow, size: float) -> Iterator[Shape]:
    if arrow.length < LEAST_ARROW_MM:
        return
    colour, width = COLOURS[arrow.verdict], ARROW_WIDTH_MM[arrow.verdict] * size
    dash = tuple(length * size for length in arrow.dash or ())
    if arrow.is_link:
        yield Stroke(arrow.tail, arrow.tip, width, colour, dash)
        return
    start, end = (complex(x, -y) for x, y in (arrow.tail, arrow.tip))
    head_mm = (ARROWHEAD_MM[0] * size, ARROWHEAD_MM[1] * size)
    yield from symbols.arrow(start, end, width, colour, head_mm, dash)


def _ground(label: ArrowLabel) -> Shape:
    x, y, width, height = label.box
    return Area(((x, y), (x + width, y), (x + width, y + height), (x, y + height)), PAPER)


def _label(label: ArrowLabel) -> Iterator[Shape]:
    """Draw the mark in a disc and the name, with a thin line to a distant arrow."""
    arrow, size = label.arrow, label.size
    colour = COLOURS[arrow.verdict]
    if label.leader is not None:
        yield Stroke(*label.leader, 0.2 * size, colour)
    (x, y), radius = label.badge
    yield Ring((x, y), radius, 0.0, colour, colour)
    for stroke in MARK_STROKES[arrow.verdict]:
        points = tuple((x + 0.95 * size * dx, y + 0.95 * size * dy) for dx, dy in stroke)
        yield Curve(points, 0.42 * size, PAPER)
    yield Label(label.foot, label.text, NAME_MM * size, "start", colour)
