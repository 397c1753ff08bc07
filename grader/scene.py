"""What an overlay shows, in sheet millimetres (x right, y down): arrows with verdicts, nodes, labels.

Painters draw a scene on the scan: `grader.picture` as pixels, `grader.feedback.overlay` as SVG.
Right and wrong differ by colour *and* by mark, doubtful ones are dashed: nothing rests on colour alone.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from grader.outcomes import Outcome
from grader.records import MECHANISM, Box, Reading
from reference.construction import Vector

XY = tuple[float, float]

LEAST_SURE = 0.9
"""Confidence below which an arrow is shown as doubtful whatever its verdict."""

COLOURS = {
    "full": "#00725c",
    "partial": "#9a6700",
    "none": "#c2410c",
    "follow_through": "#1d5fa8",
    "review": "#6d3fb5",
    "not_judged": "#5b6470",
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

LABEL_HEIGHT_MM = 3.4
LETTER_MM = 1.75
BADGE_MM = 3.8
ARROW_WIDTH_MM = 0.5
ARROWHEAD_MM = (3.2, 1.0)
"""Length and half width."""
DASH_MM = (2.2, 1.5)
"""Of doubtful arrows: dash, gap."""
GHOST_COLOUR = "#7d8590"
NODE_COLOUR = "#24303c"
LEADER_FROM_MM = 3.0
"""A label farther than this from its arrow gets a thin line to it."""


@dataclass(frozen=True, slots=True)
class Arrow:
    """A named vector as read; `verdict` is `not_judged` where the rubric does not ask for it."""

    name: str
    figure: str
    tail: XY
    tip: XY
    verdict: str
    doubtful: bool

    @property
    def length(self) -> float:
        """Millimetres."""
        return math.dist(self.tail, self.tip)

    def neck(self, size: float = 1.0) -> XY:
        """Where the shaft ends and the head begins."""
        head = min(ARROWHEAD_MM[0] * size, 0.45 * self.length)
        share = 1.0 - head / self.length if self.length > 0.0 else 1.0
        return _between(self.tail, self.tip, share)

    def head(self, size: float = 1.0) -> tuple[XY, XY, XY]:
        """The three corners of the arrowhead."""
        neck, half = self.neck(size), ARROWHEAD_MM[1] / ARROWHEAD_MM[0]
        across = (-(self.tip[1] - neck[1]) * half, (self.tip[0] - neck[0]) * half)
        return (
            self.tip,
            (neck[0] + across[0], neck[1] + across[1]),
            (neck[0] - across[0], neck[1] - across[1]),
        )


@dataclass(frozen=True, slots=True)
class Label:
    """Where an arrow's mark and name stand; `size` as of `labels_of`."""

    arrow: Arrow
    box: Box
    size: float

    @property
    def badge(self) -> tuple[XY, float]:
        """Centre and radius of the disc with the mark."""
        x, y, _width, height = self.box
        return (x + self.size * (BADGE_MM / 2 + 0.1), y + height / 2), self.size * (BADGE_MM / 2 - 0.15)

    @property
    def foot(self) -> XY:
        """Where the name's line begins."""
        return (self.box[0] + self.size * (BADGE_MM + 0.6), self.box[1] + self.box[3] - self.size * 1.25)

    @property
    def leader(self) -> tuple[XY, XY] | None:
        """From a label that stands apart to its arrow."""
        x, y, width, height = self.box
        middle = _between(self.arrow.tail, self.arrow.tip, 0.55)
        near = (min(max(middle[0], x), x + width), min(max(middle[1], y), y + height))
        return (near, middle) if math.dist(near, middle) > self.size * LEADER_FROM_MM else None


@dataclass(frozen=True, slots=True)
class Ghost:
    """The vector that was expected, laid off from where the drawn one starts."""

    tail: XY
    tip: XY


@dataclass(frozen=True, slots=True)
class Dot:
    """A node as read."""

    name: str
    at: XY
    doubtful: bool


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything to be drawn on one sheet."""

    page_mm: XY
    arrows: tuple[Arrow, ...] = ()
    ghosts: tuple[Ghost, ...] = ()
    dots: tuple[Dot, ...] = ()


@dataclass(frozen=True, slots=True)
class Picture:
    """One page with its scene: for the feedback page and for ``overlay.png``.

    Attributes
    ----------
    png : the overlay, painted
    jpeg : the cleaned scan alone, upright, for the page that draws the scene as SVG
    width_px, height_px : of both
    scene : what is drawn on it; its page_mm spans the whole picture
    """

    source: str
    page: int
    png: bytes
    jpeg: bytes
    width_px: int
    height_px: int
    scene: Scene


def scene_of(
    page_mm: XY,
    reading: Reading,
    vectors: Mapping[str, Vector],
    outcomes: Mapping[str, Outcome],
    *,
    show_expected: bool,
) -> Scene:
    """The scene of one sheet's reading; `outcomes` by vector name."""
    arrows = list(_arrows(reading, vectors, outcomes))
    dots = tuple(
        Dot(name, _xy(node.at), node.confidence < LEAST_SURE)
        for figure in reading.figures.values()
        for name, node in figure.nodes.items()
    )
    ghosts = tuple(_ghosts(arrows, outcomes)) if show_expected else ()
    return Scene(page_mm, tuple(arrows), ghosts, dots)


def _xy(at: complex) -> XY:
    return (at.real, -at.imag)


def _between(start: XY, end: XY, share: float) -> XY:
    return (start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))


def _arrows(
    reading: Reading, vectors: Mapping[str, Vector], outcomes: Mapping[str, Outcome]
) -> Iterator[Arrow]:
    for kind, figure in reading.figures.items():
        if kind == MECHANISM:
            continue
        for name, read in figure.vectors.items():
            ends = vectors.get(name)
            if ends is None or ends.tail not in figure.nodes or ends.head not in figure.nodes:
                continue
            outcome = outcomes.get(name)
            verdict = "not_judged" if outcome is None else outcome.verdict
            tail, tip = _xy(figure.nodes[ends.tail].at), _xy(figure.nodes[ends.head].at)
            doubtful = verdict == "review" or read.confidence < LEAST_SURE
            yield Arrow(name, kind, tail, tip, verdict, doubtful)


def _ghosts(arrows: list[Arrow], outcomes: Mapping[str, Outcome]) -> Iterator[Ghost]:
    """What was expected of the vectors that are off."""
    for arrow in arrows:
        if arrow.verdict not in {"none", "partial"}:
            continue
        expected = outcomes[arrow.name].expected
        if expected.length_mm is None or expected.direction_deg is None:
            continue
        angle = math.radians(expected.direction_deg)
        x, y = arrow.tail
        tip = (x + expected.length_mm * math.cos(angle), y - expected.length_mm * math.sin(angle))
        yield Ghost(arrow.tail, tip)


# Labels: beside their arrow, clear of other arrows and labels where there is room ------------------


def labels_of(arrows: Sequence[Arrow], within: Box, size: float = 1.0) -> list[Label]:
    """A place for each arrow's mark and name; `size` 1 suits a whole sheet, less a close-up."""
    taken: list[Box] = []
    labels = []
    for arrow in sorted(arrows, key=lambda one: -one.length):
        others = [other for other in arrows if other is not arrow]
        _cost, box = min(
            (far + _crowding(box, taken, others) / size**2, box) for far, box in _places(arrow, within, size)
        )
        taken.append(box)
        labels.append(Label(arrow, box, size))
    return labels


def _places(arrow: Arrow, within: Box, size: float) -> Iterator[tuple[float, Box]]:
    """Places for a label with how far-fetched each is."""
    letters = len(arrow.name.replace("_", ""))
    width, height = size * (BADGE_MM + 0.8 + LETTER_MM * letters), size * (LABEL_HEIGHT_MM + 0.6)
    length = max(arrow.length, 1e-6)
    along = ((arrow.tip[0] - arrow.tail[0]) / length, (arrow.tip[1] - arrow.tail[1]) / length)
    across = (-along[1], along[0])
    reach = abs(across[0]) * width / 2 + abs(across[1]) * height / 2
    for share in (0.55, 0.4, 0.7, 0.25, 0.85):
        middle = _between(arrow.tail, arrow.tip, share)
        for gap in (1.2, 3.5, 7.0, 12.0, 18.0):
            for side in (1.0, -1.0):
                off = side * (reach + size * gap)
                x = _inside(middle[0] + off * across[0] - width / 2, within[0], within[2] - width)
                y = _inside(middle[1] + off * across[1] - height / 2, within[1], within[3] - height)
                yield 0.5 * gap + abs(share - 0.55), (x, y, width, height)


def _inside(at: float, start: float, room: float) -> float:
    return min(max(at, start + 0.5), start + max(room, 1.0) - 0.5)


def _crowding(box: Box, taken: list[Box], arrows: list[Arrow]) -> float:
    overlaps = sum(_overlap(box, other) for other in taken)
    crossed = sum(_length_inside(box, arrow) for arrow in arrows)
    return 4.0 * overlaps + 2.0 * crossed


def _overlap(a: Box, b: Box) -> float:
    wide = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    high = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return max(0.0, wide) * max(0.0, high)


def _length_inside(box: Box, arrow: Arrow) -> float:
    """How much of an arrow runs through a box (Liang and Barsky's clipping)."""
    enter, leave = 0.0, 1.0
    for axis in (0, 1):
        start, step = arrow.tail[axis], arrow.tip[axis] - arrow.tail[axis]
        low, high = box[axis], box[axis] + box[axis + 2]
        if abs(step) < 1e-9:
            if not low <= start <= high:
                return 0.0
            continue
        first, second = sorted(((low - start) / step, (high - start) / step))
        enter, leave = max(enter, first), min(leave, second)
    return max(0.0, leave - enter) * arrow.length
