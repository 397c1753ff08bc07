"""The truth of a drawing, and the rules by which a reading is judged.

*Right*: the length is within 0.3 mm of the drawing, and the direction within 0.3 degrees or the end
within 0.3 mm across. The drawing is either the two nodes or the stroke between them, whichever is
nearer: a hand's stroke may miss the nodes that it joins, and no reader can know which was meant.

*Silent misread*: reported with confidence above 0.9 and wrong by more than 1 mm; a wrong name counts
as well. A vector that was **not** drawn is misread if it is reported with that confidence, with one
exception: real geometry in its place. Then both nodes exist, the reading is within 1 mm of the vector
between them, and either they coincide (a vector of true length zero) or strokes of the same figure
cover the whole distance (a vector on the same line as a longer one, the side of a similar triangle,
a construction line that was not drawn over). In that case the picture alone cannot show whether the
vector was drawn, its value is that of the student's own nodes, and it counts neither for nor against.
A vector that was left out and would lie on bare paper is a misread.

A sheet without a frame lies as its drawing does (docs/decisions/31-turn-by-the-drawing.md). There a drawing
that was turned as a whole is judged by directions relative to it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from grader.records import ACCELERATION_PLAN, VELOCITY_PLAN, Figure, FloatArray, ReadVector, Sheet
from reference.construction.graph import Construction
from reference.geometry import ComplexArray
from reference.quantities import group_of

_PAPER_WIDTH_MM = 420.0
_FAR_MM = (60 - 60j, 360 - 60j, 60 - 240j)
"""A corner of the drawing, and places far along and far down from it."""


class OnPaper:
    """The map from sheet millimetres as read to the true millimetres of the paper.

    With a hand-ruled frame or a paper's edge the sheet's millimetres have another origin than the truth's.
    So a point is mapped to its pixel and from there by the truth's own map: the difference is the error
    of the reading, not that of the origin. Errors of scale and turn are reported separately.
    """

    def __init__(self, truth: Mapping[str, Any], sheet: Sheet, shape: tuple[int, ...]) -> None:
        self.truth, self.sheet, self.shape = truth, sheet, shape

    def __call__(self, at: ComplexArray) -> ComplexArray:
        """Complex (n,) as read to complex (n,) in truth, y up."""
        px = self.pixels(at)
        lens = self.sheet.lens
        if lens is not None and self.sheet.mm_to_px is lens.straight:
            height, width = self.shape[:2]
            centre = np.array([(width - 1) / 2.0, (height - 1) / 2.0])
            arm = (px - centre) / np.hypot(width / 2.0, height / 2.0)
            px = centre + (px - centre) * (1.0 + lens.bend * (arm**2).sum(axis=1, keepdims=True))
        true = true_places(self.truth, np.asarray(px))
        return np.asarray(true[:, 0] - 1j * true[:, 1])

    def pixels(self, at: ComplexArray) -> FloatArray:
        """Pixels (n, 2) of the page as it was read."""
        lifted = np.column_stack([at.real, -at.imag, np.ones(len(at))]) @ self.sheet.mm_to_px.T
        return np.asarray(lifted[:, :2] / lifted[:, 2:])

    def back(self, true: ComplexArray) -> ComplexArray:
        """True points as they would be read: by the affine map that best inverts this one."""
        grid = np.array([complex(x, -y) for x in (20, 150, 280, 400) for y in (20, 110, 200, 280)])
        there = self(grid)
        columns = np.column_stack([there, np.conj(there), np.ones(len(there))])
        weights = np.linalg.lstsq(columns, grid, rcond=None)[0]
        return np.asarray(np.column_stack([true, np.conj(true), np.ones(len(true))]) @ weights)

    def scale_and_turn(self) -> tuple[FloatArray, FloatArray]:
        """Errors of scale (relative) and turn (degrees), along the sheet and across it: (2,) each."""
        near, along, across = _FAR_MM
        ends = self(np.array(_FAR_MM))
        spans = (ends[1:] - ends[0]) / np.array([along - near, across - near])
        return np.asarray(np.abs(spans) - 1.0), np.degrees(np.angle(spans))


def true_places(truth: Mapping[str, Any], px: FloatArray) -> FloatArray:
    """Stored pixels (n, 2) to the sheet's true millimetres (n, 2), y down, by the truth's own map."""
    lens = truth.get("lens")
    if lens:
        centre = np.array(lens.get("centre") or (lens["cx"], lens["cy"]))
        arm = px - centre
        px = centre + arm * (1.0 + lens["k1"] * (arm**2).sum(axis=1, keepdims=True) / lens["r"] ** 2)
    lifted = np.column_stack([px, np.ones(len(px))]) @ np.linalg.inv(np.array(truth["homography"])).T
    flat = lifted[:, :2] / lifted[:, 2:]
    bow = truth.get("curl_mm") or 0.0
    lift = bow * np.sin(np.pi * np.clip(flat[:, 0] / _PAPER_WIDTH_MM, 0.0, 1.0))
    return np.asarray(flat + np.column_stack([np.zeros_like(lift), lift]))


RIGHT_MM, RIGHT_DEG = 0.3, 0.3
MISREAD_MM = 1.0
NEAR_MM = 0.5
"""A confidence is the probability of lying within this."""
LEAST_MM = 5.0
"""Shorter vectors are counted apart: their ends lie under arrowheads and letters."""
SURE = 0.9
PLANS = (VELOCITY_PLAN, ACCELERATION_PLAN)

_ZERO_MM = 0.8
"""Nodes nearer than this are one point to a pen."""
_COVER_MM, _COVER_RAD, _COVER_STEP_MM = 0.5, 0.1, 0.5
_COVERED = 0.9

Segment = tuple[complex, complex]


@dataclass(frozen=True, slots=True)
class TrueVector:
    """A vector of a plan, drawn or not; complex sheet millimetres, y up.

    Attributes
    ----------
    ends : its two nodes, None where one of them is not on the sheet
    stroke : the stroke as ruled, None where it is not drawn (or not noted)
    missing : why it is not drawn, empty where it is
    covered : it is not drawn, and real geometry is in its place
    """

    name: str
    figure: str
    ends: Segment | None
    stroke: Segment | None
    missing: str = ""
    covered: bool = False

    @property
    def ways(self) -> list[complex]:
        """The vector from node to node, and that along the stroke."""
        return [head - tail for tail, head in filter(None, (self.ends, self.stroke))]

    @property
    def length_mm(self) -> float:
        """Distance of the nodes, else length of the stroke."""
        return abs(self.ways[0]) if self.ways else 0.0


@dataclass(frozen=True, slots=True)
class TrueFigure:
    """A plan as drawn: its nodes, its vectors, and every stroke known to belong to it."""

    name: str
    nodes: Mapping[str, complex]
    vectors: Mapping[str, TrueVector]
    strokes: Sequence[Segment]


@dataclass(frozen=True, slots=True)
class Judged:
    """One vector compared with the truth.

    Attributes
    ----------
    counts : False if it is neither drawn nor reported, or if real geometry is in its place
    error_mm : distance of its end from the true end with both starts aligned; infinite if unread
    node_error_mm : error of its length against the nodes; None if unread
    confidence : 0 if it is unread
    """

    true: TrueVector
    counts: bool = True
    reported: bool = False
    right: bool = False
    error_mm: float = float("inf")
    node_error_mm: float | None = None
    se_mm: float = 0.0
    confidence: float = 0.0

    @property
    def short(self) -> bool:
        """True if it is too short to count with the others."""
        return self.true.length_mm < LEAST_MM

    @property
    def sure(self) -> bool:
        """True if it would be marked without a person."""
        return self.confidence >= SURE

    @property
    def misread(self) -> bool:
        """True if it is a silent misread."""
        return self.counts and self.confidence > SURE and self.error_mm > MISREAD_MM


def figures_of(truth: Mapping[str, Any], construction: Construction) -> dict[str, TrueFigure]:
    """The plans of one sheet from its truth.

    Arguments: `truth` as `samples.simulation` writes it, or as a folder of sheets has it (there the
    acceleration plan's nodes have no primes); `construction` names the ends of vectors not drawn.
    """
    return {
        name: _figure(name, drawn, construction)
        for name, drawn in truth["figures"].items()
        if name in PLANS or group_of(name)
    }


def _figure(name: str, drawn: Mapping[str, Any], construction: Construction) -> TrueFigure:
    own = {step.node for step in construction.figures[name]}
    nodes = {node if node in own else f"{node}'": _complex(at) for node, at in drawn["nodes"].items()}
    lines = [vector["line_mm"] for vector in drawn["vectors"].values() if vector.get("line_mm")]
    lines += [*drawn.get("sides", {}).values(), *drawn.get("construction", [])]
    strokes = [_segment(line) for line in lines]
    vectors = {}
    for vector in construction.vectors_of(name):
        ends, told = None, drawn["vectors"].get(vector.name)
        # The sides of a force polygon may be drawn in another order.
        drawn_ends = drawn.get("ends", {}).get(vector.name, ("", "")) if group_of(name) else None
        tail, head = drawn_ends or (vector.tail, vector.head)
        tail, head = (head, tail) if vector.reversed and group_of(name) else (tail, head)
        if tail in nodes and head in nodes:
            ends = nodes[tail], nodes[head]
        if told is None:
            missing = drawn.get("missing", {}).get(vector.name, "not part of this drawing")
            stands = ends is not None and _stands_in(ends, strokes)
            vectors[vector.name] = TrueVector(vector.name, name, ends, None, missing, stands)
        else:
            stroke = _segment(told["line_mm"]) if told.get("line_mm") else None
            vectors[vector.name] = TrueVector(vector.name, name, ends, stroke)
    return TrueFigure(name, nodes, vectors, strokes)


def _complex(at: Sequence[float]) -> complex:
    return complex(at[0], -at[1])


def _segment(line: Sequence[Sequence[float]]) -> Segment:
    return _complex(line[0]), _complex(line[1])


def _stands_in(ends: Segment, strokes: Sequence[Segment]) -> bool:
    """Return whether the ends coincide, or strokes cover the distance between them."""
    tail, head = ends
    length = abs(head - tail)
    if length < _ZERO_MM:
        return True
    points = tail + (head - tail) * np.linspace(0.0, 1.0, max(2, round(length / _COVER_STEP_MM)))
    covered = np.zeros(len(points), dtype=bool)
    for start, end in strokes:
        span = end - start
        if abs(span) < _ZERO_MM or abs(np.sin(np.angle((head - tail) / span))) > _COVER_RAD:
            continue
        share = np.clip(((points - start) / span).real, 0.0, 1.0)
        covered |= np.abs(points - start - share * span) < _COVER_MM
    return bool(covered.mean() >= _COVERED)


def judged(true: TrueVector, found: ReadVector | None, turn_deg: float = 0.0) -> Judged:
    """Compare one vector's reading with the truth; directions are relative to a drawing so turned."""
    if found is None or found.length_mm is None:
        return Judged(true, counts=not true.missing)
    read = found.length_mm * complex(np.exp(1j * np.radians((found.direction_deg or 0.0) + turn_deg)))
    if not true.ways:
        # The vector is not on the sheet: its whole reading is an error.
        return Judged(true, reported=True, error_mm=abs(read), se_mm=found.se_mm, confidence=found.confidence)
    error = min(abs(read - way) for way in true.ways)
    stands_in = true.covered and error <= MISREAD_MM
    return Judged(
        true,
        counts=not (true.missing and stands_in),
        reported=True,
        right=not true.missing and any(_is_right(read, way) for way in true.ways),
        error_mm=error if not true.missing or stands_in else max(error, abs(read)),
        node_error_mm=found.length_mm - abs(true.ways[0]),
        se_mm=found.se_mm,
        confidence=found.confidence,
    )


def _is_right(read: complex, way: complex) -> bool:
    if abs(abs(read) - abs(way)) > RIGHT_MM:
        return False
    if abs(way) == 0.0 or abs(read) == 0.0:
        return True
    turn = abs(float(np.angle(read / way)))
    return turn <= np.radians(RIGHT_DEG) or (turn < 1.0 and abs(read) * np.sin(turn) <= RIGHT_MM)


def each_vector(
    figures: Mapping[str, TrueFigure],
    wanted: Sequence[str],
    read: Mapping[str, Figure],
    turn_deg: float = 0.0,
) -> Iterator[Judged]:
    """Judge every vector asked for on a sheet; `read` has the figures of a reading by name.

    Arguments: directions are read relative to a drawing that is turned by `turn_deg` on its paper.
    """
    for name, figure in figures.items():
        found = read.get(name)
        for vector in figure.vectors.values():
            if vector.name in wanted:
                yield judged(vector, found.vectors.get(vector.name) if found else None, turn_deg)
