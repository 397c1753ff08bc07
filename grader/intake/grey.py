"""Colour to grey so that graphite, blue and red strokes all stay dark on paper of any tint."""

import cv2
import numpy as np
from PIL import Image

from grader.records import GreyImage

_HIGH_BYTE = 8


def to_grey(image: np.ndarray) -> GreyImage:
    """Grey of a decoded image: (h, w), (h, w, 2..4) with blue, green, red[, alpha]; bool, uint8 or uint16.

    Transparent pixels become paper. Colour becomes luma: its weights keep blue (0.11) and red (0.30)
    ink at over half of full contrast, and, unlike the least channel, it does not carry the coarser
    sampling of chroma into the strokes' edges.
    """
    pixels = _eight_bit(image)
    if pixels.ndim == 2:
        return np.ascontiguousarray(pixels)
    channels = pixels.shape[2]
    if channels in (2, 4):
        grey = pixels[..., 0] if channels == 2 else cv2.cvtColor(pixels[..., :3].copy(), cv2.COLOR_BGR2GRAY)
        return _on_white(grey, pixels[..., -1])
    if channels == 1:
        return np.ascontiguousarray(pixels[..., 0])
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels[..., :3]), cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _eight_bit(image: np.ndarray) -> GreyImage:
    if image.dtype == np.bool_:
        return image.astype(np.uint8) * 255
    if image.dtype == np.uint16:
        return (image >> _HIGH_BYTE).astype(np.uint8)
    if image.dtype != np.uint8:
        message = f"expected bool, uint8 or uint16 pixels, got {image.dtype}"
        raise ValueError(message)
    return image


def _on_white(grey: np.ndarray, alpha: np.ndarray) -> GreyImage:
    if alpha.min() == 255:
        return np.ascontiguousarray(grey)
    share = alpha.astype(np.float32) / 255.0
    return np.asarray(255.0 - (255.0 - grey.astype(np.float32)) * share + 0.5, dtype=np.uint8)


def from_pillow(image: Image.Image) -> GreyImage:
    """Grey of an image that only Pillow decodes (CMYK, palettes, odd bit depths)."""
    if image.mode in ("P", "PA", "LA", "RGBA"):
        rgba = np.asarray(image.convert("RGBA"))
        return to_grey(rgba[..., [2, 1, 0, 3]])
    return np.asarray(image.convert("L"), dtype=np.uint8).copy()
