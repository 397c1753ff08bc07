"""What an overlay shows, in sheet millimetres (x right, y down): arrows with verdicts, nodes, labels.

Painters draw a scene on the scan: `grader.picture` as pixels, `grader.feedback.overlay` as SVG.
Right and wrong differ by colour, mark *and* line: wrong ones are thick, nearly right ones have long
dashes, doubtful ones short ones, expected ones dots. Nothing rests on colour alone.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from grader.outcomes import Outcome
from grader.records import MECHANISM, Reading
from reference.construction import Vector

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
"""What is wrong is thicker: seen in a grey print, too."""
ARROWHEAD_MM = (3.2, 1.0)
"""Length and half width."""
LEAST_ARROW_MM = 0.05
"""Shorter ones are not drawn."""
DASH_MM = (2.2, 1.5)
"""Of doubtful arrows: dash, gap."""
NEARLY_MM = (5.0, 1.0)
"""Of nearly right ones."""
GHOST_COLOUR = "#59626d"
GHOST_DASH_MM = (0.35, 1.0)
GHOST_WIDTH_MM = 0.5
"""Expected vectors are dotted."""
NODE_COLOUR = "#24303c"


@dataclass(frozen=True, slots=True)
class Arrow:
    """A named vector as read; `verdict` is `not_judged` where the rubric does not ask for it.

    A link of the mechanism has no head (`is_link`), and its name stands beside it only where it is not right.
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
        """Whether its mark and name are shown."""
        return not self.is_link or self.verdict != "full"

    @property
    def length(self) -> float:
        """Millimetres."""
        return math.dist(self.tail, self.tip)

    @property
    def dash(self) -> XY | None:
        """Dash and gap of its shaft, None for a solid one."""
        if self.doubtful:
            return DASH_MM
        return NEARLY_MM if self.verdict == "partial" else None

    def neck(self, size: float = 1.0) -> XY:
        """Where the shaft ends and the head begins."""
        if self.is_link:
            return self.tip
        head = min(ARROWHEAD_MM[0] * size, 0.45 * self.length)
        share = 1.0 - head / self.length if self.length > 0.0 else 1.0
        return between(self.tail, self.tip, share)

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
class Ghost:
    """The vector that was expected, laid off from where the drawn one starts; `verdict` on the drawn one."""

    name: str
    figure: str
    tail: XY
    tip: XY
    verdict: str = "none"


@dataclass(frozen=True, slots=True)
class Dot:
    """A node as read; `lettered` where no drawing beneath has its letter."""

    name: str
    at: XY
    doubtful: bool
    lettered: bool = False
    figure: str = ""


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
    scan : the cleaned scan alone, upright, for the page that draws the scene as SVG; a PNG or JPEG file,
        whichever is smaller; empty where nothing was scanned
    width_px, height_px : of both
    scene : what is drawn on it; its page_mm spans the whole picture
    """

    source: str
    page: int
    png: bytes
    scan: bytes
    width_px: int
    height_px: int
    scene: Scene


_NO_LINKS: Mapping[str, tuple[str, str]] = {}


def scene_of(
    page_mm: XY,
    reading: Reading,
    vectors: Mapping[str, Vector],
    outcomes: Mapping[str, Outcome],
    *,
    show_expected: bool,
    links: Mapping[str, tuple[str, str]] = _NO_LINKS,
) -> Scene:
    """The scene of one sheet's reading; `outcomes` by the vector's or link's name."""
    arrows = [*_arrows(reading, vectors, outcomes), *_links(reading, links, outcomes)]
    dots = tuple(
        Dot(name, _xy(node.at), node.confidence < LEAST_SURE, figure=kind)
        for kind, figure in reading.figures.items()
        for name, node in figure.nodes.items()
    )
    ghosts = tuple(_ghosts(arrows, outcomes)) if show_expected else ()
    return Scene(page_mm, tuple(arrows), ghosts, dots)


def _xy(at: complex) -> XY:
    return (at.real, -at.imag)


def between(start: XY, end: XY, share: float) -> XY:
    """The point at a share of the way."""
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


def _links(
    reading: Reading, links: Mapping[str, tuple[str, str]], outcomes: Mapping[str, Outcome]
) -> Iterator[Arrow]:
    """The links of the sketch that were judged."""
    sketch = reading.figures.get(MECHANISM)
    for name, (tail, head) in links.items():
        outcome = outcomes.get(name)
        if sketch is None or outcome is None or tail not in sketch.nodes or head not in sketch.nodes:
            continue
        if outcome.verdict != "not_judged":
            ends = (_xy(sketch.nodes[tail].at), _xy(sketch.nodes[head].at))
            doubtful = outcome.verdict == "review"
            yield Arrow(name, MECHANISM, *ends, outcome.verdict, doubtful, is_link=True)


def _ghosts(arrows: list[Arrow], outcomes: Mapping[str, Outcome]) -> Iterator[Ghost]:
    """What was expected of the vectors that are off, or wait for a person."""
    for arrow in arrows:
        if arrow.verdict not in {"none", "partial", "review"}:
            continue
        expected = outcomes[arrow.name].expected
        if expected.length_mm is None or expected.direction_deg is None:
            continue
        angle = math.radians(expected.direction_deg)
        x, y = arrow.tail
        tip = (x + expected.length_mm * math.cos(angle), y - expected.length_mm * math.sin(angle))
        yield Ghost(arrow.name, arrow.figure, arrow.tail, tip, arrow.verdict)
