"""JPEG and PNG files, grey levels and resolution tags."""

import contextlib
import io
import struct
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from PIL import Image, PngImagePlugin
from PIL.ExifTags import IFD, Base

from grader.records import GreyImage, Page
from grader.scan.decode import jpeg
from grader.scan.decode.colour import COLOUR_STEP, Colours, colours_of
from grader.scan.decode.limits import Door, InputFile, check_memory, check_size, damaged, truncated
from reference.drawing.canvas import MM_PER_INCH
from reference.errors import InputFileError

# Grey levels --------------------------------------------------------------------------------------

_BYTE = 8
_BAND_ROWS = 512
"""A band of an A3 page at 600 dpi in colour is 15 MB."""


def to_grey(image: np.ndarray, *, rgb: bool = False) -> GreyImage:
    """Grey of a decoded image: (h, w), or (h, w, 2..4) with blue, green, red[, alpha], or red first.

    The pixels are bool, uint8, uint16 or float of 0..1.

    Transparent pixels become paper.
    """
    if image.dtype == np.uint8 and image.ndim == 2:
        return np.ascontiguousarray(image)
    # Sensors of 10 to 14 bits are stored in 16 without being stretched.
    used = max(int(image.max()).bit_length(), _BYTE) if image.dtype == np.uint16 else _BYTE
    colours = Colours(rgb)
    if image.ndim == 3 and image.shape[2] >= 3:
        colours = colours_of(_eight_bit(image[::COLOUR_STEP, ::COLOUR_STEP, :3], used), rgb=rgb)
    return _in_bands(image, lambda band: _grey(_eight_bit(band, used), colours))


def of_four_inks(image: np.ndarray) -> GreyImage:
    """Grey of cyan, magenta, yellow and black, (h, w, 4..) with 0 for no ink: light passes through all."""
    used = max(int(image.max()).bit_length(), _BYTE) if image.dtype == np.uint16 else _BYTE
    return _in_bands(image, lambda band: _light(_eight_bit(band, used)))


def _in_bands(image: np.ndarray, grey: Callable[[np.ndarray], np.ndarray]) -> GreyImage:
    """(h, w) made a band of rows at a time: what is needed on the way takes little memory."""
    result = np.empty(image.shape[:2], dtype=np.uint8)
    for top in range(0, len(image), _BAND_ROWS):
        result[top : top + _BAND_ROWS] = grey(image[top : top + _BAND_ROWS])
    return result


def _grey(pixels: GreyImage, colours: Colours) -> np.ndarray:
    if pixels.ndim == 2:
        return pixels
    channels: int = pixels.shape[2]
    grey = pixels[..., 0] if channels <= 2 else colours.grey(pixels[..., :3])
    return _on_white(grey, pixels[..., -1]) if channels in (2, 4) else grey


def _eight_bit(image: np.ndarray, used: int) -> GreyImage:
    """Bytes of pixels; `used` is the bits that 16-bit ones make use of."""
    if image.dtype == np.bool_:
        return image.astype(np.uint8) * np.uint8(255)
    if image.dtype == np.uint16:
        return (image >> (used - _BYTE)).astype(np.uint8)
    if image.dtype in (np.float32, np.float64):
        return np.asarray(np.clip(np.nan_to_num(image), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    if image.dtype != np.uint8:
        message = f"pixels of the type {image.dtype} are not read"
        raise ValueError(message)
    return image


def _light(inks: GreyImage) -> np.ndarray:
    clear = 255.0 - inks[..., :4].astype(np.float32)
    light = clear[..., :3].min(axis=2) * clear[..., 3] / np.float32(255.0)
    return np.asarray(light + np.float32(0.5))


def _on_white(grey: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    if alpha.min() == 255:
        return grey
    share = alpha.astype(np.float32) / 255.0
    return np.asarray(255.0 - (255.0 - grey.astype(np.float32)) * share + 0.5)


def from_pillow(image: Image.Image) -> GreyImage:
    """Grey of an image that only Pillow decodes (CMYK, palettes, odd bit depths)."""
    if image.mode in ("P", "PA", "LA", "RGBA"):
        return to_grey(np.asarray(image.convert("RGBA")), rgb=True)
    return np.asarray(image.convert("L"), dtype=np.uint8).copy()


# Resolution and orientation -----------------------------------------------------------------------

_ORIENTATION_TAG = 274
"""EXIF 2.3 and TIFF 6.0."""
_INCH, _CENTIMETRE = 2, 3
"""TIFF's units of the resolution."""
_TURN_CCW = {1: 0, 2: 0, 3: 180, 4: 180, 5: 90, 6: 270, 7: 270, 8: 90}
"""EXIF/TIFF orientation to the counter-clockwise turn that a viewer applies, after undoing the mirror."""
_MIRRORED = frozenset({2, 4, 5, 7})
_SOURCES = {b"\1": "scanner", b"\2": "scanner", b"\3": "camera"}
"""EXIF 2.3, FileSource: a scanner of film or of prints, a camera."""
_OF_LENS = {Base.ExposureTime, Base.FNumber, Base.FocalLength, Base.LensModel}
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
    """A file's statements about its picture: its resolution, and how a viewer shows it.

    `mirrored` pictures (a selfie's camera, a scan through film) are mirrored left to right first, then
    turned by `turn_deg` counter-clockwise. `device` is as in `Page`.
    """

    dpi: Dpi | None
    turn_deg: int
    mirrored: bool = False
    device: str = ""

    def page(self, file: InputFile, grey: GreyImage) -> Page:
        """The one page of a file, its pixels as drawn: a mirrored drawing is another drawing."""
        grey = np.ascontiguousarray(grey[:, ::-1]) if self.mirrored else grey
        return Page(file.name, 1, grey, self.dpi, self.turn_deg, device=self.device)


def tags_of(dpi: Dpi | None, orientation: int, device: str = "") -> Tags:
    """From a resolution and an EXIF orientation; an unknown one counts as upright."""
    return Tags(dpi, _TURN_CCW.get(orientation, 0), orientation in _MIRRORED, device)


def tags_within(image: Image.Image) -> Tags:
    """From JFIF, EXIF or pHYs of an image that is opened; nothing is decoded."""
    return tags_of(plausible(image.info.get("dpi")), *_by_exif(image))


def _by_exif(image: Image.Image) -> tuple[int, str]:
    """Return orientation and device as the EXIF says; 1 and none where there is none that can be read."""
    orientation, device = 1, ""
    with contextlib.suppress(OSError, SyntaxError, ValueError, TypeError, KeyError, struct.error):
        # That of PNG would decode the picture to look behind it.
        exif = Image.Image.getexif(image)
        orientation = int(exif.get(_ORIENTATION_TAG, 1) or 1)
        taken = exif.get_ifd(IFD.Exif)
        device = _SOURCES.get(taken.get(Base.FileSource, b""), "camera" if _OF_LENS & taken.keys() else "")
    return orientation, device


# JPEG ---------------------------------------------------------------------------------------------

_HARMLESS = ("extraneous bytes", "Invalid SOS parameters", "unknown Adobe color transform")
"""Warnings of libjpeg that leave the picture whole."""
_JPEG_END = b"\xff\xd9"
_SCAN = b"\xff\xda"
_MAX_SCANS = 100
"""Progressive files of cameras and programs have about 10; each scan costs a pass over all blocks."""
_PLANES = {"Gray": 1.0, "444": 3.0, "422": 2.0, "440": 2.0, "420": 1.5, "411": 1.5}
"""Coefficients for a pixel, of two bytes; held in memory where a file has more than one scan."""
FOUR_INKS = ("CMYK", "YCCK")
_LEAST_BYTES = 600
"""A header with its tables is longer than this."""
_CUT_OFF = ("remature end", "exhausted", "mpty input")


def _jpeg_page(file: InputFile, number: int) -> Page | None:
    if number > 1:
        return None
    if not file.data.rstrip(b"\0").endswith(_JPEG_END) and len(file.data) < _LEAST_BYTES:
        raise truncated(file)
    four_inks = check_header(file, file.data) in FOUR_INKS
    with Image.open(io.BytesIO(file.data)) as image:
        tags = tags_within(image)
        grey = from_pillow(image) if four_inks else decode(file, file.data)
    return tags.page(file, grey)


def check_header(file: InputFile, data: bytes, *, least: bool = True) -> str:
    """Colour space of a JPEG stream; raises InputFileError for one that costs too much, or is too small.

    Arguments: it may be of any size without `least`, as a part of a page.
    """
    high, wide, space, sampling = jpeg.header(data)
    # Counts those of a thumbnail too: more never harms a picture of a sheet's size.
    scans = data.count(_SCAN)
    if scans > _MAX_SCANS:
        raise InputFileError("image_too_large", scans=scans, most=_MAX_SCANS, file=file.name)
    planes = _PLANES.get(sampling, 3.0) if space not in FOUR_INKS else 4.0
    decoded = 9.0 if space in FOUR_INKS else 0.0 if space == "Gray" else 3.0
    pixel_bytes = decoded + (2.0 * planes if scans > 1 else 0.0)
    check_memory(file, wide * high, int(wide * high * pixel_bytes))
    if least:
        check_size(file, wide, high)
    return space


def decode(file: InputFile, data: bytes) -> GreyImage:
    """Grey of a JPEG stream, (h, w) uint8; raises InputFileError where it is cut off or damaged.

    libjpeg fills what is missing with grey and only warns: the warning is an error here.
    """
    try:
        return to_grey(jpeg.pixels(data, strict=True))
    except ValueError as error:
        message = str(error)
    if any(sign in message for sign in _CUT_OFF):
        raise truncated(file)
    if not any(harmless in message for harmless in _HARMLESS):
        raise InputFileError("image_damaged", error=message, file=file.name)
    return to_grey(jpeg.pixels(data, strict=False))


JPEG = Door(_jpeg_page)

# PNG ----------------------------------------------------------------------------------------------

PngImagePlugin.MAX_TEXT_CHUNK = 8_000_000
"""Bytes that a profile or a text may unpack to; Pillow allows 1 MB, which profiles of printers reach."""
_HEADER, _HEADER_AT, _PNG_END = struct.Struct(">IIBB"), 16, b"IEND\xaeB`\x82"
_CHANNELS = {0: 1, 2: 3, 3: 4, 4: 4, 6: 4}
"""As decoded, by the type of colour: palettes and grey with alpha come as four."""


def _png_page(file: InputFile, number: int) -> Page | None:
    if number > 1:
        return None
    if _PNG_END not in file.data:
        raise truncated(file)
    wide, high, bits, colour = _HEADER.unpack_from(file.data, _HEADER_AT)
    if colour not in _CHANNELS:
        raise damaged(file, "no_header")
    check_size(file, wide, high, _CHANNELS[colour] * max(bits // 8, 1))
    with PngImagePlugin.PngImageFile(io.BytesIO(file.data)) as image:
        tags = tags_within(image)
        image.verify()
    pixels = cv2.imdecode(np.frombuffer(file.data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise damaged(file, "undecodable")
    return tags.page(file, to_grey(pixels))


PNG = Door(_png_page)
