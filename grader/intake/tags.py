"""Resolution and orientation as files state them."""

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image

from grader.intake.limits import check_size, damaged, too_large

_ORIENTATION_TAG = 274
_INCH, _CENTIMETRE = 2, 3
_CM_PER_INCH = 2.54
_TURN_CCW = {1: 0, 3: 180, 6: 270, 8: 90}
"""EXIF/TIFF orientation to the counter-clockwise turn that a viewer applies; mirrored ones are not
made by cameras or scanners and count as unturned."""
_PLAUSIBLE_DPI = (30.0, 4800.0)

Dpi = tuple[float, float]


def plausible(dpi: tuple[float, float] | None) -> Dpi | None:
    """The resolution, or None where it is absent or cannot be one."""
    if dpi is None:
        return None
    horizontal, vertical = float(dpi[0]), float(dpi[1])
    low, high = _PLAUSIBLE_DPI
    good = low <= horizontal <= high and low <= vertical <= high
    return (horizontal, vertical) if good else None


def from_unit(x: float, y: float, unit: int) -> Dpi | None:
    """Resolution from TIFF's two numbers and unit (2 inch, 3 cm; 1 means no absolute unit)."""
    if unit == _INCH:
        return plausible((x, y))
    if unit == _CENTIMETRE:
        return plausible((x * _CM_PER_INCH, y * _CM_PER_INCH))
    return None


def turn_of(orientation: int) -> int:
    """Counter-clockwise turn in degrees for an EXIF orientation."""
    return _TURN_CCW.get(orientation, 0)


@contextmanager
def opened(path: Path, data: bytes) -> Iterator[Image.Image]:
    """An image's header, its size within bounds; InputFileError where it cannot be read."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data)) as image:
                check_size(path, 1, *image.size)
                yield image
    except Image.DecompressionBombError as error:
        raise too_large(path, 1) from error
    except (OSError, ValueError, SyntaxError) as error:
        raise damaged(path, 1, "its header cannot be read") from error


def of_image(image: Image.Image) -> tuple[Dpi | None, int]:
    """(dpi, turn_deg) from JFIF, EXIF or pHYs of an opened image."""
    dpi = image.info.get("dpi")
    orientation = int(image.getexif().get(_ORIENTATION_TAG, 1) or 1)
    return plausible(dpi), turn_of(orientation)
