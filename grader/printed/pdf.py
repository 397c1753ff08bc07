"""Fonts, texts and shapes of printed PDFs."""

import io
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import groupby

import cv2
import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from reportlab.lib.colors import Color, HexColor
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject
from reportlab.platypus import Flowable, Paragraph, SimpleDocTemplate

from grader.printed.layout import (
    FRAME_MM,
    MARKER_CELLS,
    MARKER_CORNERS,
    MARKER_DICTIONARY,
    MARKER_MM,
    PAGE_MM,
    Template,
)
from grader.records import Box
from reference.drawing.canvas import (
    SLANT,
    Area,
    Bounds,
    Curve,
    Label,
    Piece,
    Point,
    Ring,
    Shape,
    Stroke,
    set_pieces,
)

# Markers ------------------------------------------------------------------------------------------


def cells(marker_id: int) -> NDArray[np.bool_]:
    """Return (6, 6), True where a marker's cell is white, upright, rows downwards."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, MARKER_DICTIONARY))
    image = cv2.aruco.generateImageMarker(dictionary, marker_id, MARKER_CELLS, borderBits=1)
    return np.asarray(image > 127)


# Fonts and texts ----------------------------------------------------------------------------------

REGULAR, BOLD = "DejaVuSansCondensed", "DejaVuSansCondensed-Bold"


@cache
def embed_fonts() -> None:
    """Make the fonts known to reportlab; they hold Latin, Romanian, Greek and Cyrillic letters."""
    for name in (REGULAR, BOLD):
        path = files("grader") / "data" / "fonts" / f"{name}.ttf"
        pdfmetrics.registerFont(TTFont(name, str(path)))


def width_mm(text: str, font: str, size_pt: float) -> float:
    """Return the width of a text."""
    embed_fonts()
    return float(pdfmetrics.stringWidth(text, font, size_pt) / mm)


def unprintable(text: str) -> str:
    """Return the letters of a text that the font does not have."""
    embed_fonts()
    known = pdfmetrics.getFont(BOLD).face.charToGlyph
    return "".join(
        dict.fromkeys(letter for letter in text if not letter.isspace() and ord(letter) not in known)
    )


PRINTED = {
    "<i>": "",
    "</i>": "",
    "<sub>": '<sub rise="2" size="70%">',
    "<sup>": '<super rise="3" size="70%">',
    "</sup>": "</super>",
    "✓": "√",
}
"""Marks as reportlab reads them; the embedded font has no slanted letters and no tick."""


def with_marks(text: str) -> str:
    """Return a text, or markup with indices, as reportlab's paragraphs read it."""
    written = str(Markup.escape(text))
    for mark, printed in PRINTED.items():
        written = written.replace(mark, printed)
    return written


def paragraph(text: str, size: float, font: str = REGULAR, leading: float = 1.3) -> Paragraph:
    """Return a text or markup as a paragraph of an A4 document; its size in points."""
    embed_fonts()
    style = ParagraphStyle(f"{font}{size}", fontName=font, fontSize=size, leading=leading * size)
    return Paragraph(with_marks(text), style)


def a4_document(title: str, parts: Iterable[Flowable], beside_pt: float, above_pt: float) -> bytes:
    """Return paragraphs, tables and drawings as an A4 document with margins."""
    buffer = io.BytesIO()
    document = SimpleDocTemplate(
        buffer, pagesize=A4, title=title, creator="planmark", invariant=1,
        leftMargin=beside_pt, rightMargin=beside_pt, topMargin=above_pt, bottomMargin=above_pt,
    )  # fmt: skip
    document.build([*parts])
    return buffer.getvalue()


def number(value: float, decimal_mark: str) -> str:
    """Format a datum to six significant digits, with a language's decimal mark and a real minus."""
    text = f"{value:.6g}"
    if "e" in text and 1e-6 < abs(value) < 1e9:
        text = f"{value:.6f}".rstrip("0").rstrip(".") if abs(value) < 1.0 else f"{value:.0f}"
    return re.sub("^-", "−", text).replace(".", decimal_mark)


def pieces_width_mm(pieces: Iterable[Piece], font: str, size_pt: float) -> float:
    """Return the width of a name."""
    return sum(width_mm(piece.text, font, piece.size(size_pt)) for piece in pieces)


def wrap(text: str, font: str, size_pt: float, wide_mm: float) -> list[str]:
    """Break a text into lines no wider than `wide_mm`; a single long word is cut."""
    lines: list[str] = []
    line = ""
    for word in text.split():
        longer = f"{line} {word}".strip()
        if width_mm(longer, font, size_pt) <= wide_mm:
            line = longer
            continue
        if line:
            lines.append(line)
        line = word
        while width_mm(line, font, size_pt) > wide_mm:
            keep = next(
                n
                for n in range(len(line) - 1, 0, -1)
                if n == 1 or width_mm(line[:n], font, size_pt) <= wide_mm
            )
            lines.append(line[:keep])
            line = line[keep:]
    return [*lines, line] if line else lines


def fitted(
    texts: list[str], font: str, sizes_pt: tuple[float, ...], box_mm: tuple[float, float]
) -> tuple[float, list[str]]:
    """Return the largest of some sizes at which paragraphs fit a box, and their lines; the smallest cuts."""
    wide, high = box_mm
    for size in sizes_pt:
        lines = [line for text in texts for line in wrap(text, font, size, wide)]
        room = int(high / (1.25 * size / mm))
        if len(lines) <= room:
            return size, lines
    cut = lines[: max(room, 1)]
    return size, [*cut[:-1], f"{cut[-1].rstrip('.,;')} …"] if cut else []


# Shapes of drawings -------------------------------------------------------------------------------


def put_shapes(canvas: Canvas, shapes: Iterable[Shape], origin: tuple[float, float], unit: float) -> None:
    """Draw shapes whose (0, 0) lies at `origin` (points, y up); a millimetre is `unit` points long."""
    canvas.saveState()
    canvas.translate(*origin)
    canvas.scale(unit, unit)
    canvas.setLineCap(1)
    for shape in shapes:
        _put(canvas, shape)
    canvas.restoreState()


class Drawing(Flowable):  # type: ignore[misc]  # reportlab has no types
    """Shapes within a box (mm) as a part of a printed page; a millimetre is `unit` points long.

    Arguments: `room` is the width of its place, in points, in which it is centred; its own by default.
    """

    def __init__(self, shapes: Sequence[Shape], box: Bounds, unit: float, room: float | None = None) -> None:
        super().__init__()
        left, top, right, bottom = box
        self.shapes, self.unit = shapes, unit
        self.width = (right - left) * unit if room is None else room
        self.height = (bottom - top) * unit
        self.origin = ((self.width - (left + right) * unit) / 2.0, bottom * unit)

    def draw(self) -> None:
        """Draw the shapes; the page calls it."""
        put_shapes(self.canv, self.shapes, self.origin, self.unit)


@cache
def ink(colour: str) -> Color:
    """Return a colour that leaves the canvas's opacity unchanged."""
    made = HexColor(colour)
    made.alpha = None
    return made


def _put(canvas: Canvas, shape: Shape) -> None:
    """Draw one shape; the canvas's unit is the millimetre, y up."""
    match shape:
        case Stroke(start=(x1, y1), end=(x2, y2)):
            _pen(canvas, shape.width, shape.colour, shape.dash)
            canvas.line(x1, -y1, x2, -y2)
        case Ring(centre=(x, y)):
            _pen(canvas, shape.width, shape.colour)
            filled = shape.fill != "none"
            if filled:
                canvas.setFillColor(ink(shape.fill))
            canvas.circle(x, -y, shape.radius, stroke=int(shape.width > 0), fill=int(filled))
        case Area(points=points):
            _pen(canvas, shape.width, shape.colour)
            canvas.setFillColor(ink(shape.fill))
            canvas.drawPath(_path(canvas, points, closed=True), stroke=int(shape.width > 0), fill=1)
        case Curve(points=points):
            _pen(canvas, shape.width, shape.colour, shape.dash)
            canvas.drawPath(_path(canvas, points, closed=False), stroke=1, fill=0)
        case Label():
            _write(canvas, shape)


def _path(canvas: Canvas, points: Sequence[Point], *, closed: bool) -> PDFPathObject:
    path = canvas.beginPath()
    path.moveTo(points[0][0], -points[0][1])
    for x, y in points[1:]:
        path.lineTo(x, -y)
    if closed:
        path.close()
    return path


def _write(canvas: Canvas, label: Label) -> None:
    """Draw a text, each of its pieces positioned."""
    canvas.setFillColor(ink(label.colour))
    for piece in set_pieces(label.text, label.size):
        canvas.saveState()
        slant = SLANT if label.italic else 0.0
        canvas.transform(1.0, 0.0, slant, 1.0, label.left + piece.right, piece.above - label.at[1])
        canvas.setFont(REGULAR, piece.size)
        canvas.drawString(0.0, 0.0, piece.text)
        canvas.restoreState()


def _pen(canvas: Canvas, width_mm: float, colour: str, dash: tuple[float, ...] = ()) -> None:
    canvas.setDash(list(dash))
    canvas.setLineWidth(width_mm)
    canvas.setStrokeColor(ink(colour))


# Pages --------------------------------------------------------------------------------------------

BLACK, GREY = 0.0, 0.55
_FRAME_PEN_MM = 0.7


@dataclass(frozen=True, slots=True)
class PdfDrawing:
    """A PDF being drawn."""

    canvas: Canvas
    buffer: io.BytesIO

    @classmethod
    def begin(cls, title: str) -> "PdfDrawing":
        """Start an empty A3 landscape document, whose bytes depend on its contents alone."""
        embed_fonts()
        buffer = io.BytesIO()
        canvas = Canvas(buffer, pagesize=(PAGE_MM[0] * mm, PAGE_MM[1] * mm), pageCompression=1, invariant=1)
        canvas.setTitle(title)
        canvas.setCreator("planmark")
        # Viewers must not shrink the page when it is printed.
        canvas.setViewerPreference("PrintScaling", "None")
        return cls(canvas, buffer)

    def finish(self) -> bytes:
        """Return the document."""
        self.canvas.save()
        return self.buffer.getvalue()

    def next_page(self) -> None:
        """End this page."""
        self.canvas.showPage()

    def line(self, ends: tuple[float, float, float, float], pen_mm: float, grey: float = BLACK) -> None:
        """Draw a line from x, y to x, y."""
        x0, y0, x1, y1 = ends
        self.canvas.setLineWidth(pen_mm * mm)
        self.canvas.setStrokeGray(grey)
        self.canvas.line(x0 * mm, _up(y0), x1 * mm, _up(y1))

    def box(self, box: Box, pen_mm: float, grey: float = BLACK) -> None:
        """Draw a rectangle, its pen centred on the edge."""
        x, y, w, h = box
        self.canvas.setLineWidth(pen_mm * mm)
        self.canvas.setStrokeGray(grey)
        self.canvas.rect(x * mm, _up(y + h), w * mm, h * mm)

    def cells(
        self, corner: tuple[float, float], cell_mm: float, filled: Iterable[tuple[int, int, int]], grey: float
    ) -> None:
        """Fill rows of cells (row, first column, number of columns), as one path without seams."""
        path = self.canvas.beginPath()
        x, y = corner
        for row, first, count in filled:
            path.rect(
                (x + first * cell_mm) * mm, _up(y + (row + 1) * cell_mm), count * cell_mm * mm, cell_mm * mm
            )
        self.canvas.setFillGray(grey)
        self.canvas.drawPath(path, stroke=0, fill=1)

    def text(
        self, at: tuple[float, float], text: str, size_pt: float, font: str = REGULAR, grey: float = BLACK
    ) -> None:
        """Draw text whose base line begins at a point."""
        self.canvas.setFillGray(grey)
        self.canvas.setFont(font, size_pt)
        self.canvas.drawString(at[0] * mm, _up(at[1]), text)

    def paragraphs(
        self,
        box: Box,
        texts: list[str],
        sizes_pt: tuple[float, ...],
        font: str = REGULAR,
        *,
        lines_down: int = 0,
        pitch: float = 1.2,
    ) -> None:
        """Draw wrapped texts at the largest size that fits a box.

        The first base line is `lines_down` lines below the box's upper side; lines are `pitch` times their
        size apart.
        """
        x, y, wide, high = box
        size, lines = fitted(texts, font, sizes_pt, (wide, high))
        for row, line in enumerate(lines):
            self.text((x, y + (row + lines_down) * pitch * size / mm), line, size, font)

    def pieces(
        self, at: tuple[float, float], pieces: Iterable[Piece], size_pt: float, font: str = REGULAR
    ) -> float:
        """Draw a name with its indices; return its right end. An index above stands over one below."""
        x, y = at
        begin, below = x, x
        for piece in pieces:
            start = begin if piece.height == 1 else x
            self.text((start, y - piece.rise(size_pt) / mm), piece.text, piece.size(size_pt), font)
            end = start + width_mm(piece.text, font, piece.size(size_pt))
            if piece.height == -1:
                begin = x
            below = max(below, end)
            x = below
        return x

    def frame(self) -> None:
        """Draw the drawing frame of ISO 5457."""
        self.box(FRAME_MM, _FRAME_PEN_MM)

    def markers(self, template: Template) -> None:
        """Draw all markers of a template."""
        side = MARKER_MM / MARKER_CELLS
        for number, corners in zip(template.marker_ids, MARKER_CORNERS, strict=True):
            corner = (float(corners[0, 0]), float(corners[0, 1]))
            self.cells(corner, side, ((row, 0, MARKER_CELLS) for row in range(MARKER_CELLS)), BLACK)
            self.cells(corner, side, runs(cells(number).tolist()), 1.0)


def runs(rows: Iterable[Iterable[bool]]) -> Iterable[tuple[int, int, int]]:
    """Yield stretches of True in a grid: row, first column, number of columns."""
    for number, row in enumerate(rows):
        first = 0
        for filled, cells in groupby(row):
            count = len(list(cells))
            if filled:
                yield number, first, count
            first += count


def _up(y_mm: float) -> float:
    """Convert to PDF points from the bottom edge."""
    return float((PAGE_MM[1] - y_mm) * mm)
