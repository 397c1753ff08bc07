"""JPEG streams by simplejpeg, which tells damage inside a stream; by Pillow where there is no wheel of it.

Pillow gives the same pixels. It refuses a stream that is cut off, but says nothing of damage inside.
"""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

try:
    import simplejpeg
except ModuleNotFoundError:
    simplejpeg = None


def header(data: bytes) -> tuple[int, int, str, str]:
    """Height, width, colour space (such as ``Gray``), subsampling (``420``, empty if unknown) of a stream.

    Raises ValueError for what is none.
    """
    if simplejpeg is not None:
        high, wide, space, sampling = simplejpeg.decode_jpeg_header(data, strict=False)
        return high, wide, str(space), str(sampling)
    with _opened(data) as image:
        return image.height, image.width, {"L": "Gray", "CMYK": "CMYK"}.get(image.mode, "YCbCr"), ""


def pixels(data: bytes, *, strict: bool) -> NDArray[np.uint8]:
    """(h, w, 3) blue green red, or (h, w, 1) grey; raises ValueError for a stream that cannot be decoded.

    Arguments: warnings of libjpeg are errors where `strict`.
    """
    if simplejpeg is not None:
        space = "GRAY" if header(data)[2] == "Gray" else "BGR"
        return np.asarray(simplejpeg.decode_jpeg(data, colorspace=space, strict=strict))
    with _opened(data) as image:
        try:
            decoded = np.asarray(image if image.mode == "L" else image.convert("RGB"))
        except OSError as error:
            raise ValueError(f"premature end: {error}") from error
    return decoded[:, :, None] if decoded.ndim == 2 else np.ascontiguousarray(decoded[:, :, ::-1])


def _opened(data: bytes) -> Image.Image:
    try:
        return Image.open(io.BytesIO(data), formats=["JPEG"])
    except (OSError, SyntaxError) as error:
        raise ValueError(f"no JPEG: {error}") from error
