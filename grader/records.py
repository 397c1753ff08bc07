"""The records passed between the stages, frozen, with arrays inside.

Sheet coordinates are millimetres from the upright sheet's top left corner, x right, y down.
Where a record holds a *complex* position it is x - i y: y points up, so that the argument of a
difference is the direction counter-clockwise from the sheet's +x, as in `reference`.
"""

import cmath
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from reference.errors import InputFileError, Parameter, PlanmarkError
from reference.geometry import degrees
from reference.quantities import zone_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
GreyImage = NDArray[np.uint8]
Value = Parameter
Box = tuple[float, float, float, float]
"""x, y, width, height in sheet millimetres."""

ZONE_SLACK_MM = 2.0
"""Half of the gap between the zones of a printed sheet: a line may extend a little past its zone's edge."""

MECHANISM = "mechanism"
VELOCITY_PLAN = "velocity_plan"
ACCELERATION_PLAN = "acceleration_plan"


@dataclass(frozen=True, slots=True)
class Reason:
    """A reason, problem or flaw as data: `grader.texts` makes a sentence of it in the reader's language.

    Attributes
    ----------
    code : stable, as in `docs/errors.md` or `grader.outcomes`
    parameters : values used in the sentence: numbers (`_mm`, `_deg`, `_px`, `_s`, `_percent` end the names of
        those with a unit), names of vectors and nodes, texts as written; `why` and `advice` are codes of
        clauses of their own
    file : the file that it concerns
    """

    code: str
    parameters: Mapping[str, Value] = field(default_factory=dict)
    file: str | None = None


def of_error(error: PlanmarkError, file: str | None = None) -> Reason:
    """Convert an error to a problem: its parameters, and its own words, if it has any, as the `detail`."""
    if error.message:
        return Reason(error.code, {**error.parameters, "detail": error.message}, file)
    known = dict(error.parameters)
    named = str(known.pop("file", ""))
    return Reason(error.code, known, file or named or None)


def as_error(problem: Reason) -> InputFileError:
    """Return the error that `of_error` made the problem from."""
    known: dict[str, Any] = {**problem.parameters}
    named = {"file": problem.file} if problem.file else {}
    return InputFileError(problem.code, str(known.pop("detail", "")), **{**named, **known})


def on_sheet(at: complex) -> tuple[float, float]:
    """Return a complex position as x and y in sheet millimetres, y down."""
    return at.real, -at.imag


@dataclass(frozen=True, slots=True)
class Ruling:
    """The printed squares of a page.

    Attributes
    ----------
    lines_per_px : (2, 2) level and upright lines that a step to the right and down crosses in the middle
    """

    lines_per_px: FloatArray


@dataclass(frozen=True, slots=True)
class Page:
    """One page as stored in its file, before any rotation.

    Attributes
    ----------
    source, page : file name as the user gave it, and page number from 1
    grey : (h, w) uint8, 255 = paper, printed squares removed
    dpi : horizontal and vertical resolution that the file states, or None
    turn_deg : counter-clockwise turn that the file asks viewers to apply (EXIF, PDF), 0/90/180/270
    paper_mm : width and height of the stored image on paper if the file states it (PDF), or None
    damage : first and last damaged row, if the file shows damage; empty for a whole page
    turn_is_sure : a person confirmed the turn: no other orientation is tried
    ruling : the printed squares of its paper, or None
    device : `camera` or `scanner`, where the file says so; else empty
    tilt_rad : as in `PageRef`
    """

    source: str
    page: int
    grey: GreyImage
    dpi: tuple[float, float] | None = None
    turn_deg: int = 0
    paper_mm: tuple[float, float] | None = None
    damage: tuple[int, ...] = ()
    turn_is_sure: bool = False
    ruling: Ruling | None = None
    device: str = ""
    tilt_rad: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Identity:
    """The owner of a page, according to its QR code."""

    assignment: str
    student_id: str
    n: int | None
    position: int | None
    kind: str
    """The drawing that the page is for: `all`, `velocity` or `acceleration`."""


@dataclass(frozen=True, slots=True)
class PageRef:
    """A page of a submitted file, and what is known about it.

    Attributes
    ----------
    file, page, pages : the file's name as the user knows it, the page from 1, the number of pages in the file
    blank : nobody drew on it
    identity : from its QR code, or None
    digest : of the file's content, empty if any content will do
    problem : why the page cannot be used, or None; such a page is not opened again
    path : path of the file
    content : digest of its pixels, empty before it is decoded: the same page may come in another file
    turn_deg : counter-clockwise turn that makes it upright, if a person gave it
    corners_px : the sheet's corners, from the upright sheet's top left clockwise, stored pixels, if a person
        gave them; else empty
    tilt_rad : angle from the image's x axis or y axis to the sheet's nearest one, y down, and its standard
        error, where the drawing has shown it; else None
    """

    file: str
    page: int = 1
    pages: int = 1
    blank: bool = False
    identity: Identity | None = None
    digest: str = ""
    problem: Reason | None = None
    path: Path = Path()
    content: str = ""
    turn_deg: int | None = None
    corners_px: tuple[tuple[float, float], ...] = ()
    tilt_rad: tuple[float, float] | None = None

    def __str__(self) -> str:
        return self.file if self.pages == 1 else f"{self.file}#{self.page}"


@dataclass(frozen=True, slots=True)
class Lens:
    """Distortion of the picture by the camera's lens, see `grader.scan.register.distortion`.

    Attributes
    ----------
    bend : first radial term
    stored : (3, 3) sheet mm to stored pixels, the homography that fits best in spite of the bend
    straight : (3, 3) sheet mm to pixels of the straightened picture
    residual_mm, scale_se : as in `Sheet`, of the straightened picture
    """

    bend: float
    stored: FloatArray
    straight: FloatArray
    residual_mm: float
    scale_se: float


@dataclass(frozen=True, slots=True)
class Sheet:
    """A page in millimetres.

    Attributes
    ----------
    mm_to_px : (3, 3) homography, upright sheet mm (y down) to stored pixels; the centre of the
        stored image's top left pixel is (0, 0)
    page_mm : the paper's width and height
    method : `markers`, or `combined` (frame, paper and dpi weighed together)
    px_per_mm : mean resolution
    rotation_deg : counter-clockwise turn that makes the stored image upright
    residual_mm : root mean square misfit of the evidence used
    scale_se, turn_se_rad : relative standard error of a length, and without a frame that of a direction,
        common to the whole sheet
    drawable_mm : the box inside the frame, where drawings can be
    zones : the printed sheet's zones by name, empty for a plain sheet
    identity : from the QR code, or None
    problems : evidence that disagrees or is missing
    lens : where the camera's bend was found; `mm_to_px` holds for the stored picture until
        `grader.scan.register.distortion.straighten`, then for the straightened one
    """

    mm_to_px: FloatArray
    page_mm: tuple[float, float]
    method: str
    px_per_mm: float
    rotation_deg: float
    residual_mm: float
    scale_se: float
    drawable_mm: Box
    zones: Mapping[str, Box] = field(default_factory=dict)
    identity: Identity | None = None
    problems: tuple[Reason, ...] = ()
    lens: Lens | None = None
    turn_se_rad: float = 0.0

    def cov_of(self, span: complex) -> FloatArray:
        """Return the covariance (2, 2) that the scale and the turn add to a vector, complex mm."""
        moves = np.array([self.scale_se * span, self.turn_se_rad * 1j * span])
        shifts = np.array([moves.real, moves.imag])
        return np.asarray(shifts @ shifts.T)

    def longer(self, factor: float, scale_se: float) -> "Sheet":
        """Return the page with every length scaled by a factor."""
        shorter = np.diag([1.0 / factor, 1.0 / factor, 1.0])
        matrix, lens = self.mm_to_px @ shorter, self.lens
        if lens is not None:
            lens = replace(lens, stored=lens.stored @ shorter, straight=matrix, scale_se=scale_se)
        x, y, wide, high = (factor * side for side in self.drawable_mm)
        return replace(
            self, mm_to_px=matrix, px_per_mm=self.px_per_mm / factor, residual_mm=factor * self.residual_mm,
            scale_se=scale_se, drawable_mm=(x, y, wide, high), lens=lens,
        )  # fmt: skip

    def boxes_of(self, figures: Collection[str]) -> list[Box] | None:
        """Return the zones of these figures with the gap around them, unless they are all of the sheet's.

        None stands for the whole sheet; the sketch alone has no boxes.
        """
        asked = set(map(zone_of, figures))
        if not asked or self.zones.keys() <= asked:
            return None
        zones = {figure: box for figure, box in self.zones.items() if figure in asked}
        if zones.keys() <= {MECHANISM}:
            return []
        gap = ZONE_SLACK_MM
        return [(x - gap, y - gap, wide + 2 * gap, high + 2 * gap) for x, y, wide, high in zones.values()]


@dataclass(frozen=True, slots=True)
class Strokes:
    """Straight strokes of a sheet, a row each, in millimetres, y down.

    Attributes
    ----------
    ends : (n, 2, 2) the two ends, on the fitted centre line
    width : (n,) mean width of the ink
    se_offset : (n,) standard error of the line's position across, at the stroke's middle
    se_angle : (n,) standard error of its direction, radians
    se_end : (n, 2) standard error along the line of each end
    darkness : (n,) mean contrast to the paper, 0..1
    """

    ends: FloatArray
    width: FloatArray
    se_offset: FloatArray
    se_angle: FloatArray
    se_end: FloatArray
    darkness: FloatArray

    def __len__(self) -> int:
        return len(self.width)


HEAD_AHEAD, HEAD_BACK, TAIL_AHEAD, TAIL_BACK = range(4)
"""Values of `Tips.kind`: a vector's head or tail, of a vector along its stroke or against it."""


@dataclass(frozen=True, slots=True)
class Tips:
    """Ends of vectors along strokes, found by arrowheads, dots, circles and lines that meet there.

    Attributes
    ----------
    stroke : (k,) row of the stroke, from 0
    along : (k,) mm from the stroke's first end
    kind : (k,) ``HEAD_AHEAD``, ``HEAD_BACK``, ``TAIL_AHEAD`` or ``TAIL_BACK``
    sure : (k,) probability, 0..1
    """

    stroke: IntArray
    along: FloatArray
    kind: IntArray
    sure: FloatArray

    def __len__(self) -> int:
        return len(self.stroke)


NO_TIPS = Tips(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64), np.zeros(0))


FAINT = 25
"""Ink map values up to this, of 255, are paper."""
BESIDE_PX = 3
"""Half a millimetre beside a segment still belongs to it."""


@dataclass(frozen=True, slots=True)
class InkMap:
    """A coarse map of the ink, which shows whether something is drawn.

    Attributes
    ----------
    ink : (h, w) uint8, 0 = paper .. 255 = full ink, upright, y down
    px_per_mm : resolution; sheet point (x, y) mm is at column x * px_per_mm, row y * px_per_mm
    """

    ink: GreyImage
    px_per_mm: float

    def share_inked(self, first: complex, last: complex, beside_px: int = BESIDE_PX) -> float:
        """Return the share of a segment's middle part (complex mm) with ink on it or beside it, 0..1."""
        along = np.linspace(0.25, 0.75, max(int(abs(last - first)), 4))
        beside = 1j * np.exp(1j * np.angle(last - first)) * np.arange(-beside_px, beside_px + 1)
        at = first + along * (last - first)
        return float(np.mean(self.is_inked(at[:, None] + beside / self.px_per_mm).any(axis=1)))

    def is_inked(self, at: NDArray[np.complex128]) -> NDArray[np.bool_]:
        """Return which places, complex mm, have ink."""
        rows = np.clip(np.rint(-at.imag * self.px_per_mm).astype(int), 0, self.ink.shape[0] - 1)
        columns = np.clip(np.rint(at.real * self.px_per_mm).astype(int), 0, self.ink.shape[1] - 1)
        return np.asarray(self.ink[rows, columns] > FAINT)


@dataclass(frozen=True, slots=True)
class NodeView:
    """A node of a plan, `at`, and tails and heads (k, 2) of the plan's vectors, as far as known: mm, y up."""

    at: complex
    vectors: NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class NodePlaces:
    """Places of nodes by the ink about them: a mixture of normal distributions for each.

    Attributes
    ----------
    at : (r, c) means, complex mm, y up
    se_mm : (r, c) standard errors along x and along y
    share : (r, c) probabilities; what a row lacks to 1 is that the node is nowhere near
    """

    at: NDArray[np.complex128]
    se_mm: FloatArray
    share: FloatArray

    def take(self, row: int) -> "NodePlaces":
        """The places of one node (c,)."""
        return NodePlaces(self.at[row], self.se_mm[row], self.share[row])


@dataclass(frozen=True, slots=True)
class Letters:
    """Pieces of ink that may be written signs, one per row, with the probability of each sign.

    Attributes
    ----------
    box_mm : (k, 4) x, y, width, height in sheet mm, y down
    probability : (k, s) of each sign; a row's sum is 1, including the probability that it is no sign
    whole : (k,) a separate piece of ink; otherwise what was left after strokes were removed
    column : the columns of `probability` by sign; `""` is no sign, and signs that look alike at any size (o,
        O and 0) share one
    """

    box_mm: FloatArray
    probability: FloatArray
    whole: NDArray[np.bool_]
    column: Mapping[str, int]

    def __len__(self) -> int:
        return len(self.whole)

    @property
    def at(self) -> NDArray[np.complex128]:
        """(k,) middles of the boxes, x - i y."""
        x, y, w, h = self.box_mm.T
        return np.asarray(x + w / 2.0 - 1j * (y + h / 2.0))

    @property
    def height_mm(self) -> FloatArray:
        """(k,) heights of the boxes."""
        return self.box_mm[:, 3]

    def chance(self, sign: str) -> FloatArray:
        """(k,) probability of a sign. Raises KeyError for a sign that is not distinguished."""
        return self.probability[:, self.column[sign]]


@dataclass(frozen=True, slots=True)
class Ink:
    """All ink of a sheet as shapes, in millimetres, y down.

    Attributes
    ----------
    strokes : straight strokes
    circles : (m, 3) small circles (joints, pivots) and arcs closed enough to have a centre: x, y, r
    marks : (j, 4) boxes x, y, w, h of everything else: letters, digits, hatching, blobs
    where : the ink map
    letters : possible written signs, None if they were not looked for
    tips : ends of vectors along the strokes
    problems : parts of the page that were, or may have been, left out
    """

    strokes: Strokes
    circles: FloatArray
    marks: FloatArray
    where: InkMap
    letters: Letters | None = None
    tips: Tips = NO_TIPS
    problems: tuple[Reason, ...] = ()

    def within(self, box: Box) -> "Ink":
        """Return the ink of a zone: strokes that begin, end or have their middle in it; the map is whole."""
        slack = np.array([-ZONE_SLACK_MM, ZONE_SLACK_MM])
        x, y = box[0] + slack + (0.0, box[2]), box[1] + slack + (0.0, box[3])

        def inside(at: FloatArray) -> NDArray[np.bool_]:
            return np.asarray(np.all((at > (x[0], y[0])) & (at < (x[1], y[1])), axis=-1))

        def middle(boxes: FloatArray) -> FloatArray:
            return np.asarray(boxes[:, :2] + boxes[:, 2:4] / 2.0)

        ends, letters, tips = self.strokes.ends, self.letters, self.tips
        drawn = inside(ends).any(axis=1) | inside(ends.mean(axis=1))
        row, pointed = np.cumsum(drawn) - 1, drawn[tips.stroke]
        return replace(
            self,
            strokes=_rows(self.strokes, drawn),
            circles=self.circles[inside(self.circles[:, :2])],
            marks=self.marks[inside(middle(self.marks))],
            letters=letters and _rows(letters, inside(middle(letters.box_mm))),
            tips=replace(_rows(tips, pointed), stroke=row[tips.stroke[pointed]]),
        )

    def mirrored(self) -> "Ink":
        """Return the ink as it shows through the back of the sheet, without letters."""
        wide = np.array([(self.where.ink.shape[1] - 1) / self.where.px_per_mm, 0.0, 0.0])
        flip, where = np.array([-1.0, 1.0, 1.0]), replace(self.where, ink=self.where.ink[:, ::-1])
        strokes = replace(self.strokes, ends=wide[:2] + flip[:2] * self.strokes.ends)
        circles = wide + flip * self.circles
        return replace(
            self, strokes=strokes, circles=circles, marks=self.marks[:0], where=where, letters=None
        )

    def longer(self, factor: float) -> "Ink":
        """Return the ink with every length scaled by a factor."""
        strokes, letters = self.strokes, self.letters
        return replace(
            self,
            strokes=replace(
                strokes, ends=factor * strokes.ends, width=factor * strokes.width,
                se_offset=factor * strokes.se_offset, se_end=factor * strokes.se_end,
            ),
            circles=factor * self.circles,
            marks=factor * self.marks,
            where=replace(self.where, px_per_mm=self.where.px_per_mm / factor),
            letters=None if letters is None else replace(letters, box_mm=factor * letters.box_mm),
            tips=replace(self.tips, along=factor * self.tips.along),
        )  # fmt: skip


_Columns = TypeVar("_Columns", Strokes, Tips, Letters)


def _rows(columns: _Columns, chosen: NDArray[np.bool_]) -> _Columns:
    """Return a record of arrays with the chosen rows of each."""
    arrays: dict[str, Any] = {one.name: getattr(columns, one.name) for one in fields(columns)}
    rows = {name: of[chosen] for name, of in arrays.items() if isinstance(of, np.ndarray)}
    return replace(columns, **rows)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class ReadNode:
    """A named node as drawn.

    Attributes
    ----------
    at : complex, x - i y in sheet millimetres
    cov : (2, 2) covariance in mm^2, axes x and y up
    confidence : probability that the name is right and the position within 0.5 mm of what was drawn
    """

    at: complex
    cov: FloatArray
    confidence: float

    @property
    def se_mm(self) -> float:
        """Root mean square of the two principal standard errors."""
        return float(np.sqrt(np.trace(self.cov) / 2.0))

    def vector_to(self, head: "ReadNode") -> "ReadVector":
        """Return the vector to another node, as sure as the less sure of them."""
        return ReadVector.of(head.at - self.at, self.cov + head.cov, min(self.confidence, head.confidence))


@dataclass(frozen=True, slots=True)
class OtherReading:
    """The vector that another explanation gives the same name.

    `confidence`: probability that the vector is this one, or one listed before it.
    """

    length_mm: float
    direction_deg: float
    confidence: float


@dataclass(frozen=True, slots=True)
class ReadVector:
    """A named vector as drawn, or as measured by the student.

    Attributes
    ----------
    length_mm, se_mm : length on paper; None if only a direction or value is known
    direction_deg, se_deg : counter-clockwise from the sheet's +x, 0 <= d < 360; None if not known
    confidence : probability that this is the vector named, within 0.5 mm
    others : other possible readings, likeliest first
    """

    length_mm: float | None
    se_mm: float
    direction_deg: float | None
    se_deg: float | None
    confidence: float
    others: tuple[OtherReading, ...] = ()

    @staticmethod
    def of(span: complex, cov: FloatArray, confidence: float) -> "ReadVector":
        """Return the vector of a span, complex mm, with covariance (2, 2)."""
        length = float(abs(span))
        along = np.array([span.real, span.imag]) / max(length, 1e-9)
        across = np.array([-along[1], along[0]])
        se_along, se_across = (math.sqrt(max(float(axis @ cov @ axis), 0.0)) for axis in (along, across))
        se_deg = math.degrees(math.atan2(se_across, max(length, 1e-9)))
        direction = degrees(cmath.phase(span)) if length > se_across else None
        return ReadVector(length, se_along, direction, se_deg, confidence)


@dataclass(frozen=True, slots=True)
class Figure:
    """A mechanism sketch or a plan as read.

    The forces of a force polygon may be drawn in another order than the construction's: its nodes are where
    the vectors put them in that order, and `drawn` has the ends of each vector on the sheet.
    """

    nodes: Mapping[str, ReadNode]
    vectors: Mapping[str, ReadVector]
    drawn: Mapping[str, tuple[complex, complex]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Written:
    """Handwriting as read: a scale in its printed box or behind its label on plain paper, or a number.

    Attributes
    ----------
    text : the likeliest text; empty if nothing could be read
    confidence : probability that this is what was written, whatever its spelling
    others : texts of other meaning with their probabilities, likeliest first
    """

    text: str
    confidence: float
    others: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Unread:
    """A requested node or vector that was not read, and why. False in a condition.

    `is_blank`: there is no ink where it must be, in a figure that was read.
    """

    name: str
    reason: Reason
    is_blank: bool = False

    def __bool__(self) -> bool:
        return False


@dataclass(frozen=True, slots=True)
class Swapped:
    """Two nodes of a plan whose letters are exchanged, with the probability of it."""

    figure: str
    first: str
    second: str
    confidence: float


@dataclass(frozen=True, slots=True)
class Altitude:
    """A right triangle on a sketch: the velocity laid off at a joint, and how far off its foot lies."""

    velocity_mm: float
    foot_mm: float


@dataclass(frozen=True, slots=True)
class Reading:
    """A drawing as read (or as measured by hand), with names.

    Attributes
    ----------
    figures : by `mechanism`, `velocity_plan`, `acceleration_plan`; absent if not on the sheet
    unread : requested nodes and vectors that were not read
    problems : what a person should know
    written : contents of the printed boxes, or of captions on plain paper, by scale; empty boxes are left out
    lengths : measured lengths from the printed cells, mm, with their probability, by vector; and computed
        values, SI, by ``NAME_value``, moments with their sign and ``NAME_sense``: 1, -1 or 0
    swapped : exchanged letters; the figures keep the construction's names
    altitudes : right triangles on the sketch, by the normal component that each gives
    """

    figures: Mapping[str, Figure]
    unread: tuple[Unread, ...] = ()
    problems: tuple[Reason, ...] = ()
    written: Mapping[str, Written] = field(default_factory=dict)
    lengths: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    swapped: tuple[Swapped, ...] = ()
    altitudes: Mapping[str, Altitude] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Backdrop:
    """A page cleaned for drawing on it: upright if registered, else turned as its file asks.

    Attributes
    ----------
    scan : (h, w) uint8
    page_mm : its whole width and height on paper
    registered : whether sheet millimetres are known on it
    ink : strokes that a person drew for the student, points in mm of the sheet
    """

    source: str
    page: int
    scan: GreyImage
    page_mm: tuple[float, float]
    registered: bool
    ink: tuple[tuple[tuple[float, float], ...], ...] = ()


@dataclass(frozen=True, slots=True)
class ScannedPage:
    """One page with the results of the steps of `grader.pipeline`, each of which adds its own.

    Attributes
    ----------
    image : its pixels; None before it is decoded, and once they are no longer needed
    sheet, ink : its registration and its strokes; None if the page was refused, `problems` say why
    reading : handwriting and drawing, with names
    timing_ms : by stage
    narrowed : zones of the printed sheet were skipped because nothing in them is asked for
    backdrop : the cleaned scan to draw on; None if the page could not be decoded
    flaws : flaws of the picture that impair reading
    """

    ref: PageRef
    image: Page | None = None
    sheet: Sheet | None = None
    ink: Ink | None = None
    reading: Reading = field(default_factory=lambda: Reading({}))
    problems: tuple[Reason, ...] = ()
    timing_ms: Mapping[str, float] = field(default_factory=dict)
    narrowed: bool = False
    backdrop: Backdrop | None = None
    flaws: tuple[Reason, ...] = ()

    @property
    def turn_deg(self) -> int | None:
        """The turn that made it upright, as `PageRef` has it; None where it was not placed."""
        return None if self.sheet is None else 90 * round(self.sheet.rotation_deg / 90.0) % 360

    def longer(self, factor: float, scale_se: float) -> "ScannedPage":
        """Return the page, before it is read, with every length scaled by a factor."""
        sheet, ink, behind = self.sheet, self.ink, self.backdrop
        if behind is not None:
            wide, high = behind.page_mm
            behind = replace(behind, page_mm=(factor * wide, factor * high))
        return replace(
            self,
            sheet=None if sheet is None else sheet.longer(factor, scale_se),
            ink=None if ink is None else ink.longer(factor),
            backdrop=behind,
        )

    def asked_only(self, names: Collection[str]) -> "ScannedPage":
        """Return the page with only the requested names among its unread ones; unchanged without `names`."""
        unread = tuple(gap for gap in self.reading.unread if not names or gap.name in names)
        return replace(self, reading=replace(self.reading, unread=unread))
