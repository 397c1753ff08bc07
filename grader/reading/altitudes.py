"""Read right triangles on a sketch whose altitudes give normal components.

A velocity v stands at the joint B, perpendicular to the link AB; a line leads from A to its end, another from
there, perpendicular to it, to the line AB beyond B. By the altitude theorem the foot lies v^2 / AB beyond B.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from grader.reading.lines import Lines
from grader.reading.on_sketch import LEAST_MM, NEAR_MM, SketchPage
from grader.records import MECHANISM, Altitude, InkMap, Reading
from reference.construction.graph import Construction
from reference.construction.triangles import triangles

SQUARE_RAD = math.radians(3.0)
"""Largest error of the right angle between the two lines that meet at the velocity's end."""
LEAST_FOOT_MM, MOST_FOOT_MM = 3.0, 200.0
"""Distances of feet from the joint: a nearer one is hidden by its symbol, a farther one is off the sheet."""
SAME_FOOT_MM = 1.0
"""Feet that lie further apart leave open which one was meant."""
INKED, PLAINER = 0.7, 0.4
"""Least share of a side with ink on it, and by how much that is more than beside it: in hatching ink is
everywhere. With 0.6 a stroke beside a side in faint pencil was taken for it; no other lines had 0.3 each."""
BESIDE_MM, MIDDLE = 1.3, (0.08, 0.92)
"""Distance of the places beside it, and the part of a side that is looked at: symbols stand at its ends."""


def with_altitudes(
    readings: Sequence[Reading], pages: Sequence[SketchPage], construction: Construction
) -> list[Reading]:
    """Return the readings with the right triangles on their sketches, by the normal components they give."""
    found = []
    for reading, page in zip(readings, pages, strict=True):
        nodes = reading.figures[MECHANISM].nodes if MECHANISM in reading.figures else {}
        free = page.lines.take(np.flatnonzero(~np.isin(page.lines.members, page.links).any(axis=1)))
        drawn = {
            one.vector.name: [*_drawn(free, page.where, nodes[one.pin].at, nodes[one.joint].at)]
            for one in triangles(construction)
            if one.pin in nodes and one.joint in nodes
        }
        feet = {name: [one.foot_mm for one in some] for name, some in drawn.items() if some}
        sure = [name for name, some in feet.items() if max(some) - min(some) < SAME_FOOT_MM]
        found.append(replace(reading, altitudes={name: drawn[name][0] for name in sure}))
    return found


def _drawn(lines: Lines, where: InkMap, pin: complex, joint: complex) -> Iterator[Altitude]:
    """Yield the triangles at a joint of a link: two strokes at a right angle, and ink along all three sides.

    In their frame the joint is the origin, and the link comes to it along the real axis.
    """
    length = abs(joint - pin)
    if not length >= LEAST_MM:  # nan where an end was not read
        return
    turn = (joint - pin) / length
    start, along = (lines.start - joint) / turn, lines.along / turn
    with np.errstate(all="ignore"):
        feet = start.real - start.imag * along.real / along.imag
    may_end = (lines.length > LEAST_MM) & (feet > LEAST_FOOT_MM) & (feet < MOST_FOOT_MM)
    from_pin = np.abs(((start + length) * np.conj(along)).imag) < NEAR_MM
    for row in np.flatnonzero(from_pin & (lines.length > LEAST_MM)):
        way = along[row]
        rows = np.flatnonzero(may_end & (np.abs((along * np.conj(way)).real) < math.sin(SQUARE_RAD)))
        apart = (start[rows] - start[row]) * np.conj(along[rows])
        corners = start[row] + apart.imag / (way * np.conj(along[rows])).imag * way
        for corner, foot in zip(corners.tolist(), feet[rows].tolist(), strict=True):
            tip, end = joint + corner * turn, joint + foot * turn
            is_upright = abs(corner.real) < NEAR_MM and abs(corner.imag) > LEAST_MM
            if is_upright and all(_is_drawn(where, at, tip) for at in (pin, joint, end)):
                yield Altitude(abs(corner.imag), foot)


def _is_drawn(where: InkMap, first: complex, last: complex) -> bool:
    """Return whether a side is a line of its own: ink on it, and less of it beside."""
    along = first + np.linspace(*MIDDLE, max(int(2.0 * abs(last - first)), 4)) * (last - first)
    across = 1j * (last - first) / abs(last - first)

    def share(offset_mm: float, within_px: int) -> float:
        offsets = offset_mm + np.arange(-within_px, within_px + 1) / where.px_per_mm
        return float(where.is_inked(along[:, None] + across * offsets).any(axis=1).mean())

    on_it = share(0.0, 2)
    return on_it >= INKED and on_it - min(share(BESIDE_MM, 1), share(-BESIDE_MM, 1)) >= PLAINER
