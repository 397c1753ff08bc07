"""Colour to grey so that graphite, blue and red strokes all stay dark on paper of any tint."""

import cv2
import numpy as np
from PIL import Image

from grader.records import GreyImage

_BYTE = 8


def to_grey(image: np.ndarray) -> GreyImage:
    """Grey of a decoded image: (h, w), or (h, w, 2..4) with blue, green, red[, alpha].

    The pixels are bool, uint8, uint16 or float of 0..1.

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
        # Sensors of 10 to 14 bits are stored in 16 without being stretched.
        used = max(int(image.max()).bit_length(), _BYTE)
        return (image >> (used - _BYTE)).astype(np.uint8)
    if image.dtype in (np.float32, np.float64):
        return np.asarray(np.clip(np.nan_to_num(image), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    if image.dtype != np.uint8:
        message = f"pixels of the type {image.dtype} are not read"
        raise ValueError(message)
    return image


def of_four_inks(image: np.ndarray) -> GreyImage:
    """Grey of cyan, magenta, yellow and black, (h, w, 4..) with 0 for no ink: light passes through all."""
    inks = 255.0 - _eight_bit(image)[..., :4].astype(np.float32)
    light = inks[..., :3].min(axis=2) * inks[..., 3] / np.float32(255.0)
    return np.asarray(light + 0.5, dtype=np.uint8)


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
