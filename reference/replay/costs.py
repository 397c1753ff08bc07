"""What an account of a drawing costs: -2 log of its probability, up to a constant.

The squared misfit of what was seen, with how wide it is spread, and for each mistake how rare it is.
"""

import math
from collections.abc import Mapping

RARITY: Mapping[str, float] = {
    "parallel_for_perpendicular": 13.0,
    "wrong_link": 15.0,
    "sense_reversed": 12.0,
    "normal_reversed": 12.0,
    "normal_missing": 12.0,
    "normal_from_absolute": 12.5,
    "wrong_intersection": 14.0,
    "image_mirrored": 12.0,
    "other_assembly": 12.0,
    "other_variant": 14.0,
    "labels_swapped": 16.0,
    "figure_rotated": 14.0,
    "scale_wrong": 10.0,
    "arithmetic": 22.0,
}
"""One step in a hundred or so goes wrong, in one of ten or so ways; a slip in a computation may give any
length."""
SOMETHING_ELSE = 9.0
"""What a step costs that went wrong in a way nobody knows, beside what it makes likely: any place."""
ANYWHERE = 2.0 * math.log(100.0)
"""A length may then be anything within some 100 mm; a place costs twice that."""
SUSPECT = 9.0
"""From this squared misfit on (three standard errors) wrong ways are tried."""
WITHIN = 24.0
"""Accounts dearer than the cheapest by a hand of the same care by more than this are dropped."""
AT_MOST = 40
"""Accounts kept by a hand of one care."""
