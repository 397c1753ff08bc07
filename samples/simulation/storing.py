"""Simulated sheets as files: JPEG, PNG, TIFF, one PDF for a class, and the truth beside them."""

import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pikepdf
from numpy.typing import NDArray
from PIL import Image

from samples.simulation.settings import Scan

_EXIF_ORIENTATION = {1: 6, 2: 3, 3: 8}
"""The tag that undoes so many quarter turns counter-clockwise."""

Pixels = NDArray[np.uint8]


def encoded(image: Pixels, scan: Scan, *, exif: bool = False) -> bytes:
    """The file's bytes in the scan's container (a PDF's pages are JPEG)."""
    picture = Image.fromarray(image)
    if scan.mode == "bilevel":
        picture = picture.convert("1", dither=Image.Dither.NONE)
    tags: dict[str, Any] = {} if scan.dpi_tag is None else {"dpi": (scan.dpi_tag, scan.dpi_tag)}
    buffer = io.BytesIO()
    if scan.container == "png":
        picture.save(buffer, "PNG", compress_level=6, **tags)
    elif scan.container == "tif":
        compression = "group4" if scan.mode == "bilevel" else "tiff_lzw"
        picture.save(buffer, "TIFF", compression=compression, **tags)
    else:
        if exif and scan.quarter_turns % 4:
            marks = Image.Exif()
            marks[0x0112] = _EXIF_ORIENTATION[scan.quarter_turns % 4]
            tags["exif"] = marks
        flat = picture.convert("L") if scan.mode == "bilevel" else picture
        flat.save(buffer, "JPEG", quality=scan.jpeg_quality, **tags)
    return buffer.getvalue()


def blank_back(scan: Scan, shape: tuple[int, int], rng: np.random.Generator) -> Pixels:
    """The scan of an empty back: paper, noise, a few specks."""
    grey = 0.299 * scan.paper[0] + 0.587 * scan.paper[1] + 0.114 * scan.paper[2]
    plane = np.full(shape, grey, np.float32) + rng.standard_normal(shape, dtype=np.float32) * scan.noise
    for _ in range(6):
        row, column = rng.integers(0, shape[0]), rng.integers(0, shape[1])
        plane[row : row + 3, column : column + 2] -= 70
    return np.asarray(np.clip(plane, 0, 255).astype(np.uint8))


def write_pdf(path: Path, pages: Iterable[tuple[Pixels, float, int]], quality: int = 80) -> None:
    """One PDF of many pages, a JPEG each.

    Arguments: pages as (image, dpi, quarter turns that viewers are to undo).
    """
    document = pikepdf.new()
    for image, dpi, turns in pages:
        height, width = image.shape[:2]
        scan = Scan(jpeg_quality=quality, dpi_tag=None, mode="colour" if image.ndim == 3 else "grey")
        stream = pikepdf.Stream(document, encoded(image, scan))
        stream.stream_dict = pikepdf.Dictionary(
            Type=pikepdf.Name.XObject,
            Subtype=pikepdf.Name.Image,
            Width=width,
            Height=height,
            ColorSpace=pikepdf.Name.DeviceRGB if image.ndim == 3 else pikepdf.Name.DeviceGray,
            BitsPerComponent=8,
            Filter=pikepdf.Name.DCTDecode,
        )
        w, h = width / dpi * 72.0, height / dpi * 72.0
        content = pikepdf.Stream(document, f"q {w:.4f} 0 0 {h:.4f} 0 0 cm /Im0 Do Q".encode())
        page = pikepdf.Dictionary(
            Type=pikepdf.Name.Page,
            MediaBox=[0, 0, w, h],
            Rotate=90 * (turns % 4),
            Resources=pikepdf.Dictionary(XObject=pikepdf.Dictionary(Im0=document.make_indirect(stream))),
            Contents=document.make_indirect(content),
        )
        document.pages.append(pikepdf.Page(document.make_indirect(page)))
    document.save(path, deterministic_id=True)


def write_truth(path: Path, truths: Sequence[dict[str, Any]]) -> None:
    """JSON lines, a sheet each."""
    lines = [json.dumps(truth, ensure_ascii=False, sort_keys=True) for truth in truths]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
