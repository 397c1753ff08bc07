"""Resolution and orientation as files state them."""

import io
import struct
from dataclasses import dataclass

import numpy as np
from PIL import Image

from grader.pixels import MM_PER_INCH
from grader.records import GreyImage

_ORIENTATION_TAG = 274
"""EXIF 2.3 and TIFF 6.0."""
_INCH, _CENTIMETRE = 2, 3
"""TIFF's units of the resolution."""
_TURN_CCW = {1: 0, 2: 0, 3: 180, 4: 180, 5: 90, 6: 270, 7: 270, 8: 90}
"""EXIF/TIFF orientation to the counter-clockwise turn that a viewer applies, after undoing the mirror."""
_MIRRORED = frozenset({2, 4, 5, 7})
_PLAUSIBLE_DPI = (30.0, 4800.0)
"""Below and above, a file states a number that is no resolution."""

Dpi = tuple[float, float]


def plausible(dpi: tuple[float, float] | None) -> Dpi | None:
    """The resolution, or None where it is absent or cannot be one."""
    if dpi is None:
        return None
    try:
        horizontal, vertical = float(dpi[0]), float(dpi[1])
    except (ArithmeticError, TypeError, ValueError):
        return None
    low, high = _PLAUSIBLE_DPI
    good = low <= horizontal <= high and low <= vertical <= high
    return (horizontal, vertical) if good else None


def from_unit(x: float, y: float, unit: int) -> Dpi | None:
    """Resolution from TIFF's two numbers and unit (2 inch, 3 cm; 1 means no absolute unit)."""
    if unit == _INCH:
        return plausible((x, y))
    if unit == _CENTIMETRE:
        return plausible((x * (MM_PER_INCH / 10.0), y * (MM_PER_INCH / 10.0)))
    return None


@dataclass(frozen=True, slots=True)
class Tags:
    """What a file says of its picture: its resolution, and how a viewer shows it.

    `mirrored` pictures (a selfie's camera, a scan through film) are mirrored left to right first, then
    turned by `turn_deg` counter-clockwise.
    """

    dpi: Dpi | None
    turn_deg: int
    mirrored: bool = False

    def unmirrored(self, grey: GreyImage) -> GreyImage:
        """The pixels as drawn: a mirrored drawing is another drawing."""
        return np.ascontiguousarray(grey[:, ::-1]) if self.mirrored else grey


def tags_of(dpi: Dpi | None, orientation: int) -> Tags:
    """From a resolution and an EXIF orientation; an unknown one counts as upright."""
    return Tags(dpi, _TURN_CCW.get(orientation, 0), orientation in _MIRRORED)


def tags_within(content: bytes) -> Tags:
    """From JFIF, EXIF or pHYs of an image file; only its header is read."""
    with Image.open(io.BytesIO(content)) as image:
        return tags_of(plausible(image.info.get("dpi")), _orientation(image))


def _orientation(image: Image.Image) -> int:
    """As the EXIF says; 1 where there is none, or none that can be read."""
    try:
        return int(image.getexif().get(_ORIENTATION_TAG, 1) or 1)
    except (OSError, SyntaxError, ValueError, TypeError, KeyError, struct.error):
        return 1
