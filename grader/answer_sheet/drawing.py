"""Vector drawing in millimetres from the top left corner, y down, on a reportlab canvas."""

import io
from collections.abc import Iterable
from dataclasses import dataclass

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from grader import aruco
from grader.answer_sheet.words import REGULAR, embed_fonts, fitted, width_mm
from grader.layout import FRAME_MM, MARKER_CORNERS, MARKER_MM, PAGE_MM, Template
from grader.records import Box
from reference.lettering import Piece

BLACK, GREY = 0.0, 0.55
_FRAME_PEN_MM = 0.7


@dataclass(frozen=True, slots=True)
class Drawing:
    """A PDF being drawn."""

    canvas: Canvas
    buffer: io.BytesIO

    @classmethod
    def begin(cls, title: str) -> "Drawing":
        """An empty A3 landscape document. It says the same, byte for byte, for the same input."""
        embed_fonts()
        buffer = io.BytesIO()
        canvas = Canvas(buffer, pagesize=(PAGE_MM[0] * mm, PAGE_MM[1] * mm), pageCompression=1, invariant=1)
        canvas.setTitle(title)
        canvas.setCreator("planmark")
        # Viewers must not shrink the page when it is printed.
        canvas.setViewerPreference("PrintScaling", "None")
        return cls(canvas, buffer)

    def finish(self) -> bytes:
        """The document."""
        self.canvas.save()
        return self.buffer.getvalue()

    def next_page(self) -> None:
        """End this page."""
        self.canvas.showPage()

    def line(self, ends: tuple[float, float, float, float], pen_mm: float, grey: float = BLACK) -> None:
        """A line from x, y to x, y."""
        x0, y0, x1, y1 = ends
        self.canvas.setLineWidth(pen_mm * mm)
        self.canvas.setStrokeGray(grey)
        self.canvas.line(x0 * mm, _up(y0), x1 * mm, _up(y1))

    def box(self, box: Box, pen_mm: float, grey: float = BLACK) -> None:
        """A rectangle, its pen centred on the edge."""
        x, y, w, h = box
        self.canvas.setLineWidth(pen_mm * mm)
        self.canvas.setStrokeGray(grey)
        self.canvas.rect(x * mm, _up(y + h), w * mm, h * mm)

    def cells(
        self, corner: tuple[float, float], cell_mm: float, filled: Iterable[tuple[int, int, int]], grey: float
    ) -> None:
        """Rows of filled cells (row, first column, number of columns), as one path without seams."""
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
        """Text whose base line begins at a point."""
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
        """Wrapped texts at the largest size that fits a box.

        The first base line is `lines_down` lines below the box's upper side; lines are `pitch` times
        their size apart.
        """
        x, y, wide, high = box
        size, lines = fitted(texts, font, sizes_pt, (wide, high))
        for row, line in enumerate(lines):
            self.text((x, y + (row + lines_down) * pitch * size / mm), line, size, font)

    def pieces(
        self, at: tuple[float, float], pieces: Iterable[Piece], size_pt: float, font: str = REGULAR
    ) -> float:
        """A name with its indices; gives the x where it ends. An index above stands over one below."""
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
        """The drawing frame of ISO 5457."""
        self.box(FRAME_MM, _FRAME_PEN_MM)

    def markers(self, template: Template) -> None:
        """All markers of a template."""
        side = MARKER_MM / aruco.CELLS
        for number, corners in zip(template.marker_ids, MARKER_CORNERS, strict=True):
            corner = (float(corners[0, 0]), float(corners[0, 1]))
            self.cells(corner, side, ((row, 0, aruco.CELLS) for row in range(aruco.CELLS)), BLACK)
            self.cells(corner, side, runs(aruco.cells(number).tolist()), 1.0)


def runs(rows: Iterable[Iterable[bool]]) -> Iterable[tuple[int, int, int]]:
    """Stretches of True in a grid: row, first column, number of columns."""
    for number, row in enumerate(rows):
        cells = [*row, False]
        first = None
        for column, filled in enumerate(cells):
            if filled and first is None:
                first = column
            elif not filled and first is not None:
                yield number, first, column - first
                first = None


def _up(y_mm: float) -> float:
    """PDF points from the bottom edge."""
    return float((PAGE_MM[1] - y_mm) * mm)
