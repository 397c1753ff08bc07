"""Pictures of signs: from files of handwriting fonts, and real digits."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from fontTools.ttLib import TTFont
from PIL import Image, ImageDraw, ImageFont
from skimage.morphology import skeletonize

from grader.scan.handwriting.model import JUNK, SIGNS, TWINS

LEFT_OUT = (
    "cedarville-cursive", "indie-flower", "kalam", "neucha", "playpen-sans", "reenie-beanie", "schoolbell",
    "the-girl-next-door",
)  # fmt: skip
TRAINED_ON = (
    "annie-use-your-telescope", "architects-daughter", "bad-script", "caveat", "caveat-brush", "chilanka",
    "comfortaa", "covered-by-your-grace", "delicious-handrawn", "delius", "gaegu", "gloria-hallelujah",
    "gochi-hand", "handlee", "itim", "long-cang", "mansalva", "marck-script", "nanum-pen-script",
    "patrick-hand", "poor-story", "shadows-into-light", "short-stack", "sriracha", "sue-ellen-francisco",
    "swanky-and-moo-moo", "yomogi", "zen-kurenaido", "zhi-mang-xing",
)  # fmt: skip
SIZE_PX = 96
"""Type size of the pictures: large against what is scanned, so that pens can be made thick and thin."""


@dataclass(frozen=True, slots=True)
class Glyph:
    """A sign of a font.

    Attributes
    ----------
    sign : its class
    picture : uint8, 255 = ink, cut to the ink
    bones : the middle lines of its strokes, of the same size, to be written with any pen; None for
        pictures too small to have any
    """

    sign: str
    picture: np.ndarray
    bones: np.ndarray | None


def texts_of() -> dict[str, str]:
    """The class of each text drawn: signs, and texts that look like them."""
    return {sign: sign for sign in SIGNS if sign != JUNK} | TWINS


def font_files(folder: Path) -> list[Path]:
    """The upright files of a font family in its package, regular and bold, all alphabets."""
    found = [path for path in sorted(folder.glob("files/*.woff")) if "-normal" in path.name]
    weights = {path.name.rsplit("-", 2)[-2] for path in found}
    usual = "400" if "400" in weights else min(weights)
    return [path for path in found if path.name.rsplit("-", 2)[-2] in {usual, "700"}]


def glyphs_of(folder: Path) -> Iterator[Glyph]:
    """Every sign that a family has, once for each of its weights."""
    seen: set[tuple[str, bytes]] = set()
    for path in font_files(folder):
        known = TTFont(path).getBestCmap() or {}
        wanted = {text: sign for text, sign in texts_of().items() if ord(text) in known}
        font = ImageFont.truetype(str(path), SIZE_PX) if wanted else None
        for text, sign in wanted.items():
            picture = _drawn(font, text)
            if picture is None or (sign, picture.tobytes()) in seen:
                continue
            seen.add((sign, picture.tobytes()))
            yield Glyph(sign, picture, (skeletonize(picture > 127) * 255).astype(np.uint8))


def _drawn(font: ImageFont.FreeTypeFont, text: str) -> np.ndarray | None:
    image = Image.new("L", (3 * SIZE_PX, 3 * SIZE_PX), 0)
    ImageDraw.Draw(image).text((SIZE_PX, SIZE_PX), text, fill=255, font=font)
    picture = np.asarray(image)
    rows, columns = np.flatnonzero(picture.max(axis=1) > 60), np.flatnonzero(picture.max(axis=0) > 60)
    if len(rows) < 3 or len(columns) < 3:
        return None
    cut = picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return cv2.copyMakeBorder(cut, 12, 12, 12, 12, cv2.BORDER_CONSTANT)


def digits(folder: Path) -> Iterator[Glyph]:
    """Digits written by people, from the package `mnist`."""
    for digit in range(10):
        data = np.array(json.loads((folder / "src" / "digits" / f"{digit}.json").read_text())["data"])
        for picture in (255.0 * data.reshape(-1, 28, 28)).astype(np.uint8):
            yield Glyph("o" if digit == 0 else str(digit), cv2.resize(picture, (84, 84)), None)
