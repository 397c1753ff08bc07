"""Colour to grey so that graphite, blue and red strokes all stay dark on paper of any tint."""

from collections.abc import Callable

import cv2
import numpy as np
from PIL import Image

from grader.records import GreyImage

_BYTE = 8
_BAND_ROWS = 512
"""A band of an A3 page at 600 dpi in colour is 15 MB."""


def to_grey(image: np.ndarray, *, rgb: bool = False) -> GreyImage:
    """Grey of a decoded image: (h, w), or (h, w, 2..4) with blue, green, red[, alpha], or red first.

    The pixels are bool, uint8, uint16 or float of 0..1.

    Transparent pixels become paper. Colour becomes luma: its weights keep blue (0.11) and red (0.30)
    ink at over half of full contrast, and, unlike the least channel, it does not carry the coarser
    sampling of chroma into the strokes' edges.
    """
    if image.dtype == np.uint8 and image.ndim == 2:
        return np.ascontiguousarray(image)
    # Sensors of 10 to 14 bits are stored in 16 without being stretched.
    used = max(int(image.max()).bit_length(), _BYTE) if image.dtype == np.uint16 else _BYTE
    return _in_bands(image, lambda band: _luma(_eight_bit(band, used), rgb=rgb))


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


def _luma(pixels: GreyImage, *, rgb: bool) -> np.ndarray:
    if pixels.ndim == 2:
        return pixels
    channels: int = pixels.shape[2]
    if channels <= 2:
        grey = pixels[..., 0]
    else:
        code = cv2.COLOR_RGB2GRAY if rgb else cv2.COLOR_BGR2GRAY
        grey = np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels[..., :3]), code), dtype=np.uint8)
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
