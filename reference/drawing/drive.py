"""The arrow that says how the driven link moves: a turning one at the crank, a straight one at the slider."""

from collections.abc import Iterator

import numpy as np

from reference.canvas import INK, Curve, Shape, Stroke
from reference.drawing import symbols
from reference.drawing.labelling import Wanted, lengths_inside, segments_of
from reference.drawing.links import bars, blocks
from reference.drawing.subject import Subject
from reference.drawing.symbols import THIN_MM, point
from reference.geometry import FloatArray
from reference.lettering import pieces_of
from reference.mechanism import Crank, DrivenSlider

RADIUS_MM, SWEEP, THRUST_MM = 9.0, 0.9, 10.0
LETTER_MM = 3.4
CLEAR_MM = 0.8
STARTS = (0.25, -0.25 - SWEEP, 1.5, -1.5 - SWEEP, 2.5)
"""Where a turning arrow may start, from the crank on in its sense, the best first."""
Turn = tuple[float, float, float]
"""Radius, start and sweep."""


def drive_arrow(subject: Subject, nodes: dict[str, complex]) -> Iterator[Shape]:
    """The arrow, unless the driven link stands still."""
    driver = subject.plan.mechanism.driver
    if _stands(subject):
        return
    if isinstance(driver, DrivenSlider):
        yield from symbols.arrow(*_thrust(subject, driver, nodes), THIN_MM, INK)
    else:
        yield from symbols.turning(nodes[driver.pivot], *_turn(subject, driver, nodes))


def drive_letter(subject: Subject, nodes: dict[str, complex]) -> Iterator[Wanted]:
    """The angular velocity or the velocity that the arrow stands for."""
    driver = subject.plan.mechanism.driver
    if _stands(subject):
        return
    if isinstance(driver, DrivenSlider):
        at = point(sum(_thrust(subject, driver, nodes)) / 2.0)
        yield Wanted(driver.pin, at, subject.letter(f"v_{driver.pin}"), LETTER_MM, INK, 0.6)
    else:
        radius, start, sweep = _turn(subject, driver, nodes)
        outward = complex(np.exp(1j * (start + 0.5 * sweep)))
        at = point(nodes[driver.pivot] + radius * outward)
        yield Wanted(driver.pin, at, pieces_of(f"omega_{driver.link}"), LETTER_MM, INK, 0.6, outward)


def _rate(subject: Subject) -> float:
    """The crank's angular velocity, or the driven slider's speed."""
    driver = subject.plan.mechanism.driver
    return subject.one(np.asarray(driver.speed if isinstance(driver, DrivenSlider) else driver.omega))


def _stands(subject: Subject) -> bool:
    return _rate(subject) == 0.0


def _thrust(subject: Subject, driver: DrivenSlider, nodes: dict[str, complex]) -> tuple[complex, complex]:
    """Beside the block, in the sense of its velocity, where it meets the fewest links."""
    block = next(block for block in blocks(subject, nodes) if block.node == driver.pin)
    along = block.along * float(np.sign(_rate(subject)))
    above = 1j * block.along * (1 if block.along.real >= 0.0 else -1)
    length, width = symbols.BLOCK_MM
    starts = (
        block.at + above * (width + up) + along * ahead
        for up in (3.0, 7.0)
        for ahead in (-length, 2.0, -THRUST_MM - 2.0)
    )
    links = _links(subject, nodes)
    ways = [(start, start + THRUST_MM * along) for start in starts]
    return min(ways, key=lambda way: _meets(Curve((point(way[0]), point(way[1]))), links))


def _turn(subject: Subject, crank: Crank, nodes: dict[str, complex]) -> Turn:
    """About the crank's pivot, in the sense in which it turns, where it meets the fewest links."""
    centre = nodes[crank.pivot]
    arm = nodes[crank.pin] - centre
    sign, largest = float(np.sign(_rate(subject))), min(RADIUS_MM, 0.45 * abs(arm))
    links = _links(subject, nodes)
    turns = [
        (radius, float(np.angle(arm)) + sign * start, sign * SWEEP)
        for radius in (largest, 0.7 * largest)
        for start in STARTS
    ]

    def met(turn: Turn) -> int:
        radius, start, sweep = turn
        return _meets(symbols.arc(centre, radius, start, sweep, THIN_MM), links)

    return min(turns, key=met)


def _links(subject: Subject, nodes: dict[str, complex]) -> FloatArray:
    """The links as segments, millimetres, y down."""
    return segments_of(Stroke(point(bar.ends[0]), point(bar.ends[1])) for bar in bars(subject, nodes))


def _meets(curve: Curve, links: FloatArray) -> int:
    """How many links a curve meets, or nearly so."""
    corners = np.array(curve.points)
    share = np.linspace(0.0, len(corners) - 1.0, 24)
    places = np.stack(
        [np.interp(share, np.arange(len(corners)), corners[:, axis]) for axis in (0, 1)], axis=1
    )
    boxes = np.hstack([places - CLEAR_MM, places + CLEAR_MM])
    return int(np.any(lengths_inside(boxes, links) > 0.0, axis=0).sum())
