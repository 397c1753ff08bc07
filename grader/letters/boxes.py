"""What is written in the printed boxes for the scales: the text, its meaning, and how sure that is."""

from collections.abc import Mapping

import cv2
import numpy as np

from grader.layout import SCALE_BOXES
from grader.letters.decode import Text, texts_of
from grader.letters.line import Lattice, lattice_of
from grader.quantities import ByRule, Declared, ParsedScale, parse_scale
from grader.records import ACCELERATION_PLAN, MECHANISM, VELOCITY_PLAN, Box, GreyImage, Page, Sheet, Written

PX_PER_MM = 12.0
_BORDER_MM = 0.55
"""Inside of the printed line, with the print's and the registration's error."""
_FOREIGN = 0.25
"""Log likelihood by sign that a text may lack against signs at will, before it is doubted."""
_LARGE, _HARDLY = 1000.0, -4.0
"""From here on, a number lost its decimal point more likely than that anybody chose the scale."""
_MOST_TEXTS = 200
_SCALE_OF: Mapping[str, str] = {MECHANISM: "kL", VELOCITY_PLAN: "kv", ACCELERATION_PLAN: "ka"}


def written_scales(page: Page, sheet: Sheet, units: Mapping[str, str] | None = None) -> dict[str, Written]:
    """What stands in the boxes of a printed sheet, by scale; empty boxes, and a plain sheet, give nothing.

    Arguments: `units` are the units of bare numbers where the assignment says them, by scale.
    """
    names = [_SCALE_OF[figure] for figure in sheet.zones if figure in _SCALE_OF]
    if not names:
        return {}
    found = {}
    for name in names:
        lattice = lattice_of(_crop(page.grey, sheet, SCALE_BOXES[name]), PX_PER_MM)
        if lattice.count:
            found[name] = read_scale(lattice, name, (units or {}).get(name))
    return found


def read_scale(lattice: Lattice, name: str, bare_unit: str | None = None) -> Written:
    """The likeliest scale in a line of writing."""
    texts, at_will = texts_of(lattice, name)
    meant = _by_meaning(texts[:_MOST_TEXTS], name, bare_unit)
    if not meant:
        return Written("", 0.0)
    best = max(log for _, log in meant.values())
    shares = {meaning: (text, float(np.exp(log - best))) for meaning, (text, log) in meant.items()}
    total = sum(share for _, share in shares.values())
    fits = float(np.exp(min(0.0, best - at_will + _FOREIGN * lattice.count)))
    ranked = sorted(
        ((text, fits * share / total) for text, share in shares.values()), key=lambda one: -one[1]
    )
    return Written(ranked[0][0], ranked[0][1], tuple(ranked[1:4]))


def _by_meaning(texts: list[Text], name: str, bare_unit: str | None) -> dict[object, tuple[str, float]]:
    """Texts that mean the same put together: the likeliest spelling, and the log of their sum."""
    found: dict[object, tuple[str, float]] = {}
    for one in texts:
        parsed = parse_scale(name, one.text, bare_unit=bare_unit)
        meaning = _meaning(parsed)
        if meaning is None:
            continue
        unlikely = _HARDLY if isinstance(meaning, float) and meaning >= _LARGE else 0.0
        text, log = found.get(meaning, (one.text, -np.inf))
        found[meaning] = (text, float(np.logaddexp(log, one.log + unlikely)))
    return found


def _meaning(parsed: ParsedScale) -> object | None:
    match parsed:
        case Declared(per_mm=value):
            return float(f"{value:.9g}")
        case ByRule(powers=powers):
            return tuple(sorted(powers.items()))
        case _:
            return None


def _crop(grey: GreyImage, sheet: Sheet, box: Box) -> GreyImage:
    """Contrast inside a box, upright, 12 px/mm."""
    x, y, w, h = box
    size = round((w - 2.0 * _BORDER_MM) * PX_PER_MM), round((h - 2.0 * _BORDER_MM) * PX_PER_MM)
    # Pixel q of the crop is at its middle, (q + 0.5) / 12 mm from the inner edge.
    place = np.array(
        [
            [1.0 / PX_PER_MM, 0.0, x + _BORDER_MM + 0.5 / PX_PER_MM],
            [0.0, 1.0 / PX_PER_MM, y + _BORDER_MM + 0.5 / PX_PER_MM],
            [0.0, 0.0, 1.0],
        ]
    )
    to_px = sheet.mm_to_px @ place
    corners = np.array([[0, 0, 1], [size[0], 0, 1], [0, size[1], 1], [size[0], size[1], 1]], dtype=np.float64)
    seen = corners @ to_px.T
    seen = seen[:, :2] / seen[:, 2:]
    left, top = (int(np.floor(side)) - 3 for side in seen.min(axis=0))
    right, bottom = (int(np.ceil(side)) + 4 for side in seen.max(axis=0))
    left, top = max(0, left), max(0, top)
    part = grey[top:bottom, left:right]
    if part.size == 0:
        return np.zeros((0, 0), dtype=np.uint8)
    shift = np.array([[1.0, 0.0, -left], [0.0, 1.0, -top], [0.0, 0.0, 1.0]])
    upright = cv2.warpPerspective(
        part, shift @ to_px, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    paper = float(np.quantile(upright, 0.8))
    return np.asarray(np.clip(255.0 * (1.0 - upright / max(paper, 1.0)), 0.0, 255.0), dtype=np.uint8)
