"""Shapes on paper in millimetres (x right, y down), and their writing as SVG, true to size."""

from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

A3_MM = (420.0, 297.0)

INK = "#1b1f24"
CONSTRUCTION = "#9aa3ad"
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Stroke:
    """A straight line."""

    start: Point
    end: Point
    width: float = 0.35
    colour: str = INK
    dash: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Ring:
    """A circle, filled with paper white or with a colour."""

    centre: Point
    radius: float
    width: float = 0.35
    colour: str = INK
    fill: str = "#ffffff"


@dataclass(frozen=True, slots=True)
class Area:
    """A filled polygon."""

    points: tuple[Point, ...]
    fill: str
    width: float = 0.0
    colour: str = INK


@dataclass(frozen=True, slots=True)
class Label:
    """A text; `size` is the height of its line, `anchor` one of start, middle, end."""

    at: Point
    text: str
    size: float = 4.0
    anchor: str = "start"
    colour: str = INK
    italic: bool = False


Shape = Stroke | Ring | Area | Label


def svg(sheets: Sequence[Sequence[Shape]], page_mm: tuple[float, float] = A3_MM) -> str:
    """The sheets, one under another, as one SVG; one user unit is one millimetre."""
    width, height = page_mm
    total = height * len(sheets)
    size = f'width="{width:g}mm" height="{total:g}mm" viewBox="0 0 {width:g} {total:g}"'
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="DejaVu Sans, Arial, sans-serif">',
        f'<rect width="{width:g}" height="{total:g}" fill="#ffffff"/>',
    ]
    for row, shapes in enumerate(sheets):
        lines.append(f'<g transform="translate(0 {row * height:g})">')
        lines.extend(_element(shape) for shape in shapes)
        lines.append("</g>")
    return "\n".join([*lines, "</svg>"]) + "\n"


def _element(shape: Shape) -> str:
    match shape:
        case Stroke(start=(x1, y1), end=(x2, y2), width=width, colour=colour, dash=dash):
            dashes = f' stroke-dasharray="{" ".join(f"{d:g}" for d in dash)}"' if dash else ""
            return (
                f'<line x1="{x1:.3f}" y1="{y1:.3f}" x2="{x2:.3f}" y2="{y2:.3f}" stroke="{colour}"'
                f' stroke-width="{width:g}" stroke-linecap="round"{dashes}/>'
            )
        case Ring(centre=(x, y), radius=radius, width=width, colour=colour, fill=fill):
            return (
                f'<circle cx="{x:.3f}" cy="{y:.3f}" r="{radius:g}" fill="{fill}" stroke="{colour}"'
                f' stroke-width="{width:g}"/>'
            )
        case Area(points=points, fill=fill, width=width, colour=colour):
            corners = " ".join(f"{x:.3f},{y:.3f}" for x, y in points)
            edge = f' stroke="{colour}" stroke-width="{width:g}"' if width else ""
            return f'<polygon points="{corners}" fill="{fill}"{edge}/>'
        case Label(at=(x, y), text=text, size=size, anchor=anchor, colour=colour, italic=italic):
            style = ' font-style="italic"' if italic else ""
            return (
                f'<text x="{x:.3f}" y="{y:.3f}" font-size="{size:g}" text-anchor="{anchor}"'
                f' fill="{colour}"{style}>{escape(text)}</text>'
            )
