"""The reference drawing as a PDF, true to size, from the same shapes as its SVG."""

import io
from collections.abc import Sequence

from reportlab.lib.colors import HexColor
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from grader.answer_sheet.words import REGULAR, embed_fonts
from reference.canvas import A3_MM, Area, Label, Ring, Shape, Stroke


def pdf(sheets: Sequence[Sequence[Shape]], title: str, page_mm: tuple[float, float] = A3_MM) -> bytes:
    """The sheets as the pages of a PDF document; `page_mm` is their width and height."""
    embed_fonts()
    buffer = io.BytesIO()
    canvas = Canvas(buffer, pagesize=(page_mm[0] * mm, page_mm[1] * mm), invariant=1)
    canvas.setTitle(title)
    # Viewers must not shrink the page when it is printed.
    canvas.setViewerPreference("PrintScaling", "None")
    for shapes in sheets:
        canvas.translate(0, page_mm[1] * mm)
        canvas.scale(mm, mm)
        canvas.setLineCap(1)
        for shape in shapes:
            _put(canvas, shape)
        canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def _put(canvas: Canvas, shape: Shape) -> None:
    """One shape; the canvas' origin is the sheet's top left corner, its unit the millimetre, y up."""
    match shape:
        case Stroke(start=(x1, y1), end=(x2, y2)):
            _pen(canvas, shape.width, shape.colour)
            canvas.setDash(list(shape.dash))
            canvas.line(x1, -y1, x2, -y2)
            canvas.setDash([])
        case Ring(centre=(x, y)):
            _pen(canvas, shape.width, shape.colour)
            canvas.setFillColor(HexColor(shape.fill))
            canvas.circle(x, -y, shape.radius, fill=1)
        case Area(points=points):
            _pen(canvas, shape.width, shape.colour)
            canvas.setFillColor(HexColor(shape.fill))
            path = canvas.beginPath()
            path.moveTo(points[0][0], -points[0][1])
            for x, y in points[1:]:
                path.lineTo(x, -y)
            path.close()
            canvas.drawPath(path, stroke=int(shape.width > 0), fill=1)
        case Label(at=(x, y), text=text):
            canvas.setFont(REGULAR, shape.size)
            canvas.setFillColor(HexColor(shape.colour))
            draw = {
                "start": canvas.drawString,
                "middle": canvas.drawCentredString,
                "end": canvas.drawRightString,
            }
            draw[shape.anchor](x, -y, text)


def _pen(canvas: Canvas, width_mm: float, colour: str) -> None:
    canvas.setLineWidth(width_mm)
    canvas.setStrokeColor(HexColor(colour))
