"""What printed feedback is made of: texts, tables, badges, looks at a page."""

from collections.abc import Sequence
from xml.sax.saxutils import escape

from markupsafe import Markup
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.lib.utils import ImageReader
from reportlab.platypus import Flowable, Paragraph, Table

from grader.answer_sheet.words import REGULAR
from grader.feedback.looks import Look
from grader.plan_pdf import ink, put_shapes
from grader.scene import COLOURS, MARK_STROKES, Picture

INK, SOFT, LINE = "#1c2733", "#5b6673", "#dfe3e8"
BADGE_MM = 3.6
TALLEST_MM = 120.0

PLAIN: list[tuple[object, ...]] = [
    ("VALIGN", (0, 0), (-1, -1), "TOP"),
    *((f"{side}PADDING", (0, 0), (-1, -1), 0) for side in ("LEFT", "RIGHT", "TOP", "BOTTOM")),
]
_STYLES: dict[tuple[object, ...], ParagraphStyle] = {}


def table(rows: Sequence[Sequence[object]], widths_mm: Sequence[float]) -> Table:
    """Cells side by side, without lines."""
    return Table(rows, colWidths=[wide * mm for wide in widths_mm], style=PLAIN, hAlign="LEFT")


def text(  # noqa: PLR0913 - how a text is set
    said: str,
    size: float,
    font: str = REGULAR,
    *,
    colour: str = INK,
    right: bool = False,
    indent: float = 0.0,
    as_markup: bool = False,
) -> Paragraph:
    """A paragraph; without `as_markup` whatever stands in the text is printed as it is."""
    key = (size, font, colour, right, indent)
    if key not in _STYLES:
        _STYLES[key] = ParagraphStyle(
            str(key), fontName=font, fontSize=size, leading=1.32 * size, textColor=ink(colour),
            alignment=2 if right else 0, leftIndent=indent * mm,
        )  # fmt: skip
    return Paragraph(str(said) if as_markup else escape(said), _STYLES[key])


def printed(said: Markup) -> str:
    """Markup as the PDF's paragraphs read it; the embedded font has no slanted letters."""
    written = str(said)
    for mark, printed in (
        ("<i>", ""),
        ("</i>", ""),
        ("<sub>", '<sub rise="2" size="70%">'),
        ("<sup>", '<super rise="3" size="70%">'),
        ("</sup>", "</super>"),
    ):
        written = written.replace(mark, printed)
    return written


class Badge(Flowable):  # type: ignore[misc]
    """A verdict's mark in its disc."""

    def __init__(self, verdict: str) -> None:
        super().__init__()
        self.verdict = verdict
        self.width = self.height = BADGE_MM * mm

    def draw(self) -> None:
        """Draw it where the page is."""
        canvas, radius = self.canv, BADGE_MM * mm / 2
        canvas.setFillColor(ink(COLOURS[self.verdict]))
        canvas.circle(radius, radius, radius, stroke=0, fill=1)
        canvas.setStrokeColor(ink("#ffffff"))
        canvas.setLineWidth(0.42 * mm)
        canvas.setLineCap(1)
        for stroke in MARK_STROKES[self.verdict]:
            path = canvas.beginPath()
            for number, (x, y) in enumerate(stroke):
                (path.lineTo if number else path.moveTo)(radius + 0.95 * x * mm, radius - 0.95 * y * mm)
            canvas.drawPath(path)


class Drawn(Flowable):  # type: ignore[misc]
    """A look at a page, scaled to a width; the `scan` is the page's own."""

    def __init__(self, look: Look, picture: Picture, scan: ImageReader | None, wide_mm: float) -> None:
        super().__init__()
        self.look, self.picture, self.scan = look, picture, scan
        _, _, width, height = look.box
        self.unit = mm * min(wide_mm / width, TALLEST_MM / height)
        self.width, self.height = width * self.unit, height * self.unit

    def wrap(self, _width: float, _height: float) -> tuple[float, float]:
        """Its size, whatever room there is."""
        return self.width, self.height

    def draw(self) -> None:
        """Draw the part of the scan and the shapes over it."""
        canvas, (left, top, _, _) = self.canv, self.look.box
        wide, high = (side * self.unit for side in self.picture.scene.page_mm)
        canvas.saveState()
        frame = canvas.beginPath()
        frame.rect(0, 0, self.width, self.height)
        canvas.clipPath(frame, stroke=0, fill=0)
        corner = (-left * self.unit, self.height + top * self.unit)
        if self.scan is not None:
            canvas.drawImage(self.scan, corner[0], corner[1] - high, wide, high)
        for layer in self.look.layers:
            canvas.setFillAlpha(layer.opacity)
            canvas.setStrokeAlpha(layer.opacity)
            put_shapes(canvas, layer.shapes, corner, self.unit)
        canvas.restoreState()
        canvas.setStrokeColor(ink(LINE))
        canvas.setLineWidth(0.5)
        canvas.rect(0, 0, self.width, self.height)
