"""Convert a colour picture to grey: strokes of any pencil are dark, the paper's own rulings are not."""

from dataclasses import dataclass
from functools import reduce

import cv2
import numpy as np

from grader.records import GreyImage

COLOUR_STEP = 3
"""Every third pixel of every third row tells the colours of a page."""
_COARSE = 8
"""Every eighth of these tells the paper's."""
_COLOURED = 24
"""Difference of a pixel's channels, of 255, from which it has a colour: grey scans in colour have 5 to 15."""
_LEAST_SHARE = 3e-4
"""Share of the page's pixels: 40 mm of a pencil's stroke."""
_HUES = 12
_BLOCKS = (16, 24)
_IN_BLOCKS, _OF_BLOCK = 0.75, (0.004, 0.5)
"""Rulings are in so many of the blocks, in each with such a share of its pixels: two lines, no tint."""
_DARKER = 20
"""Pixels darker than nearly all of the rulings by this much of 255 are drawn on them."""
_YELLOW = 0.6
"""Share of its darkness in blue that a stroke keeps: of yellow 0.9, beside a luma of 0.1. Of all pencils it
alone is lost in luma."""


@dataclass(frozen=True, slots=True)
class Colours:
    """The conversion of a page's colours to grey.

    Attributes
    ----------
    rgb : whether red is the first channel, not blue
    has_strokes : whether some of them are drawn
    white : the paper, in blue
    clear : the channel in which the paper's rulings are bright, None for paper without
    darkest : luma below which nothing belongs to the rulings
    """

    rgb: bool
    has_strokes: bool = False
    white: float = 255.0
    clear: int | None = None
    darkest: int = 0

    def grey(self, pixels: GreyImage) -> GreyImage:
        """(h, w) grey of (h, w, 3) bytes: luma, its weights keep blue (0.11) and red (0.30) ink in sight.

        Unlike the least channel it does not carry the coarser sampling of chroma into the strokes' edges.
        """
        pixels = np.ascontiguousarray(pixels)
        luma = cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY if self.rgb else cv2.COLOR_BGR2GRAY)
        if self.clear is not None:
            bright = cv2.max(luma, cv2.extractChannel(pixels, self.clear))
            luma = np.where(luma < self.darkest, luma, bright)
        elif self.has_strokes:
            blue = cv2.extractChannel(pixels, 2 if self.rgb else 0)
            alpha, beta = _YELLOW * 255.0 / self.white, 255.0 * (1.0 - _YELLOW)
            luma = cv2.min(luma, cv2.convertScaleAbs(blue, alpha=alpha, beta=beta))
        return np.asarray(luma, dtype=np.uint8)


def colours_of(sample: GreyImage, *, rgb: bool) -> Colours:
    """Return what has colours on a page (h, w, 3): nothing, strokes, or rulings that are all over it.

    Arguments: `sample` is every `COLOUR_STEP`-th pixel of every such row.
    """
    down, across = _BLOCKS
    if sample.shape[0] < down or sample.shape[1] < across:
        return Colours(rgb)
    channels = cv2.split(np.ascontiguousarray(sample))
    least, most = (reduce(of, channels) for of in (cv2.min, cv2.max))
    chroma = cv2.subtract(most, least)
    paper = sample[::_COARSE, ::_COARSE].reshape(-1, 3)
    usual = int(np.median(chroma[::_COARSE, ::_COARSE]))
    row, column = np.nonzero(chroma > usual + _COLOURED)
    if len(row) < _LEAST_SHARE * chroma.size:
        return Colours(rgb)
    coloured = sample[row, column][None]
    hue = cv2.cvtColor(coloured, cv2.COLOR_RGB2HSV_FULL if rgb else cv2.COLOR_BGR2HSV_FULL)[0, :, 0]
    hue = hue.astype(np.int64) * _HUES // 256
    block = row * down // chroma.shape[0] * across + column * across // chroma.shape[1]
    count = np.zeros((down * across, _HUES), dtype=np.int64)
    np.add.at(count, (block, hue), 1)
    # Neighbouring hues together: a colour may lie on the border of two.
    share = (count + np.roll(count, -1, axis=1)) * down * across / chroma.size
    everywhere = np.mean((share > _OF_BLOCK[0]) & (share < _OF_BLOCK[1]), axis=0)
    common = int(np.argmax(everywhere))
    if everywhere[common] < _IN_BLOCKS:
        white = max(float(np.percentile(paper[:, 2 if rgb else 0], 80)), 1.0)
        return Colours(rgb, has_strokes=True, white=white)
    ruled = coloured[:, (hue == common) | (hue == (common + 1) % _HUES)]
    luma = cv2.cvtColor(ruled, cv2.COLOR_RGB2GRAY if rgb else cv2.COLOR_BGR2GRAY)
    darkest = max(int(np.percentile(luma, 10)) - _DARKER, 0)
    return Colours(rgb, has_strokes=True, clear=int(ruled.mean(axis=(0, 1)).argmax()), darkest=darkest)
