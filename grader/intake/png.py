"""PNG files: one page."""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from grader.intake.grey import to_grey
from grader.intake.limits import Door, damaged, truncated
from grader.intake.tags import of_image, opened
from grader.records import Page

_END = b"IEND"
_END_WITHIN = 64


def _pages(path: Path, first: int) -> Iterator[Page]:
    if first > 1:
        return
    data = path.read_bytes()
    if _END not in data[-_END_WITHIN:]:
        # The decoder would fill the missing rows with black or nothing.
        raise truncated(path, 1)
    with opened(path, data) as image:
        tags = of_image(image)
    pixels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise damaged(path, 1, "it cannot be decoded")
    yield Page(path.name, 1, tags.unmirrored(to_grey(pixels)), tags.dpi, tags.turn_deg)


def _count(path: Path) -> int:
    del path
    return 1


DOOR = Door(_pages, _count)
