"""Text on the printed sheet: the embedded font, numbers, indices, wrapping."""

from collections.abc import Iterable
from functools import cache
from importlib.resources import files

from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont

from reference.lettering import Piece

REGULAR, BOLD = "DejaVuSansCondensed", "DejaVuSansCondensed-Bold"
_DECIMAL_COMMA = frozenset({"ro", "ru"})


@cache
def embed_fonts() -> None:
    """Make the fonts known to reportlab; they hold Latin, Romanian, Greek and Cyrillic letters."""
    for name in (REGULAR, BOLD):
        path = files("grader") / "data" / "fonts" / f"{name}.ttf"
        pdfmetrics.registerFont(TTFont(name, str(path)))


def width_mm(text: str, font: str, size_pt: float) -> float:
    """How wide a text is printed."""
    embed_fonts()
    return float(pdfmetrics.stringWidth(text, font, size_pt) / mm)


def unprintable(text: str) -> str:
    """Letters of a text that the font does not have."""
    embed_fonts()
    known = pdfmetrics.getFont(BOLD).face.charToGlyph
    return "".join(
        dict.fromkeys(letter for letter in text if not letter.isspace() and ord(letter) not in known)
    )


def number(value: float, lang: str) -> str:
    """A datum to six significant digits, as it is written in a language."""
    text = f"{value:.6g}"
    if "e" in text and 1e-6 < abs(value) < 1e9:
        text = f"{value:.6f}".rstrip("0").rstrip(".") if abs(value) < 1.0 else f"{value:.0f}"
    return text.replace(".", decimal_mark(lang))


def decimal_mark(lang: str) -> str:
    """Comma or point."""
    return "," if lang in _DECIMAL_COMMA else "."


def pieces_width_mm(pieces: Iterable[Piece], font: str, size_pt: float) -> float:
    """How wide a name is printed."""
    return sum(width_mm(piece.text, font, piece.size(size_pt)) for piece in pieces)


def wrap(text: str, font: str, size_pt: float, wide_mm: float) -> list[str]:
    """Lines that are no wider than `wide_mm`; a single long word is cut."""
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
    """The largest of some sizes at which paragraphs fit a box, and their lines; cut at the smallest."""
    wide, high = box_mm
    for size in sizes_pt:
        lines = [line for text in texts for line in wrap(text, font, size, wide)]
        room = int(high / (1.25 * size / mm))
        if len(lines) <= room:
            return size, lines
    cut = lines[: max(room, 1)]
    return size, [*cut[:-1], f"{cut[-1].rstrip('.,;')} …"] if cut else []
