"""The reference drawing as a PDF, true to size, from the same shapes as its SVG."""

import io
from collections.abc import Iterable, Sequence
from functools import cache

from reportlab.lib.colors import Color, HexColor
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject

from grader.answer_sheet.words import REGULAR, embed_fonts
from reference.canvas import A3_MM, SLANT, Area, Curve, Label, Point, Ring, Shape, Stroke
from reference.lettering import set_pieces


def pdf(sheets: Sequence[Sequence[Shape]], title: str, page_mm: tuple[float, float] = A3_MM) -> bytes:
    """The sheets as the pages of a PDF document; `page_mm` is their width and height."""
    embed_fonts()
    buffer = io.BytesIO()
    canvas = Canvas(buffer, pagesize=(page_mm[0] * mm, page_mm[1] * mm), invariant=1)
    canvas.setTitle(title)
    # Viewers must not shrink the page when it is printed.
    canvas.setViewerPreference("PrintScaling", "None")
    for shapes in sheets:
        put_shapes(canvas, shapes, (0.0, page_mm[1] * mm), mm)
        canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def put_shapes(canvas: Canvas, shapes: Iterable[Shape], origin: tuple[float, float], unit: float) -> None:
    """Draw shapes whose (0, 0) lies at `origin` (points, y up); a millimetre is `unit` points long."""
    canvas.saveState()
    canvas.translate(*origin)
    canvas.scale(unit, unit)
    canvas.setLineCap(1)
    for shape in shapes:
        _put(canvas, shape)
    canvas.restoreState()


@cache
def ink(colour: str) -> Color:
    """A colour that leaves the canvas as opaque as it is set."""
    made = HexColor(colour)
    made.alpha = None
    return made


def _put(canvas: Canvas, shape: Shape) -> None:
    """One shape; the canvas' unit is the millimetre, y up."""
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
    """A text: each of its pieces in its own place."""
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
