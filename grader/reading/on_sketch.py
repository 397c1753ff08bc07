"""Read what is added to a sketch from the finished plans: links' centres, and vectors at their points.

They are sought where the student's own plans (or the exact ones) put them, the other way round or mirrored,
too. What lies elsewhere, or is shown by too little ink, is not read: nobody is charged for it.
"""

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from operator import itemgetter

import numpy as np

from grader.reading.lines import Lines
from grader.records import MECHANISM, Figure, InkMap, IntArray, Reading, ReadVector
from reference.construction.elements import View
from reference.construction.graph import ON_SKETCH, evaluate
from reference.construction.mistakes import Drawing
from reference.geometry import ComplexArray, degrees

NEAR_MM = 1.5
"""A line leads to a joint if it passes it within this."""
REACH_MM = 3.0
"""A stroke may begin or end so far from a joint's centre: at its circle, which hides what is within."""
TILT_RAD = math.radians(6.0)
"""Largest angle between a stroke and the vector that is expected on it."""
LENGTH_RATIO = 1.25
"""Largest ratio of a vector's length and the expected one: other arrowheads are on the same line."""
LEAST_MM = 6.0
"""A shorter vector is hidden by the joint's symbol and its letter."""
SURE_TIP = 0.5
"""Probability from which an arrowhead shows where a vector ends."""
SE_MM = 0.35
"""Standard error of an end that an arrowhead, a circle or two lines give."""
PLACE_MM, PLACE_SHARE = 4.0, 0.05
"""A centre is sought within this distance of where it is expected, and this share of the longer way there."""
RAY_RAD = math.radians(3.0)
"""Largest angle between a line to a centre and its direction, besides that; least angle at which two meet."""
SURE_POINT = 0.93
"""Confidence in a centre where a circle is on a line from a joint, or where lines from two joints meet."""


@dataclass(frozen=True, slots=True)
class SketchPage:
    """A page with a sketch.

    Attributes
    ----------
    lines : its strokes; `links` are the numbers of those that the sketch's links are made of
    circles : (c,) centres of circles, complex mm
    turn_rad : the sketch's turn
    where : the ink map
    """

    lines: Lines
    links: IntArray
    circles: ComplexArray
    turn_rad: float
    where: InkMap


@dataclass(frozen=True, slots=True)
class _Expected:
    """The sources of additions: joints as read, vectors as read in the plans, exact nodes as turned."""

    drawing: Drawing
    joints: Mapping[str, complex]
    own: Mapping[str, complex]
    exact: Mapping[str, complex]

    def vectors(self, name: str) -> Iterator[complex]:
        """Yield a vector of the plans, as the student drew it and as it should be, each both ways."""
        vector = self.drawing.construction.vectors[name]
        found = [self.own[name]] if name in self.own else []
        for along in (*found, self.exact[vector.head] - self.exact[vector.tail]):
            yield from (along, -along)

    def centres(self, name: str) -> Iterator[complex]:
        """Yield the places of a centre by the student's own triangle and the exact one, and mirrored."""
        step, vectors = self.drawing.construction.centres[name], self.drawing.construction.vectors.values()
        pole = step.model[-1]
        own = {one.head: self.own[one.name] for one in vectors if one.tail == pole and one.name in self.own}
        for plan, mirrored in product(({**own, pole: 0j}, self.exact), (False, True)):
            if set(step.model) <= plan.keys():
                nodes = {name: np.asarray(at) for name, at in {**plan, **self.joints}.items()}
                with np.errstate(all="ignore"):
                    yield complex(replace(step, mirrored=mirrored).place(View(nodes, {})))

    def is_clear(self, at: complex) -> bool:
        """Return whether a place is at no joint, where other strokes end and other circles are."""
        return all(abs(at - joint) > REACH_MM for joint in self.joints.values())


def with_additions(
    readings: Sequence[Reading], pages: Sequence[SketchPage], drawing: Drawing, names: Sequence[str]
) -> list[Reading]:
    """Return the readings with the centres and vectors of these names that are found on their sketches."""
    figures = [figure for read in readings for figure in read.figures.values()]
    own = {
        name: cmath.rect(one.length_mm, math.radians(one.direction_deg))
        for figure in figures
        for name, one in figure.vectors.items()
        if one.length_mm is not None and one.direction_deg is not None
    }
    exact = evaluate(drawing.construction, drawing.parameters)
    found = []
    for reading, page in zip(readings, pages, strict=True):
        found.append(reading)
        sketch = reading.figures.get(MECHANISM)
        if sketch is not None:
            turn = cmath.rect(1.0, page.turn_rad)
            turned = {name: complex(np.ravel(at)[0]) * turn for name, at in exact.items()}
            joints = {name: node.at for name, node in sketch.nodes.items()}
            expected = _Expected(drawing, joints, own, turned)
            vectors = dict(_additions(page, sketch, expected, names))
            added = Figure(sketch.nodes, {**sketch.vectors, **vectors})
            found[-1] = replace(reading, figures={**reading.figures, MECHANISM: added})
    return found


def _additions(
    page: SketchPage, sketch: Figure, expected: _Expected, names: Sequence[str]
) -> Iterator[tuple[str, ReadVector]]:
    """Yield what is found, from the joint where it begins."""
    construction = expected.drawing.construction
    for name in names:
        start = sketch.nodes.get(construction.on_sketch[name])
        step = construction.centres.get(name)
        if start is None or (step is not None and not set(step.base) <= sketch.nodes.keys()):
            continue
        joints = [sketch.nodes[joint].at for joint in step.base] if step else []
        heads = _heads(page.lines, start.at, expected, name)
        places = _points(page, joints, expected, name) if step else heads
        clear = (one for one in places if expected.is_clear(one[1]))
        sure, at = max(clear, default=(0.0, 0j), key=itemgetter(0))
        if sure:
            along = at - start.at
            direction, se_deg = degrees(cmath.phase(along)), math.degrees(SE_MM / abs(along))
            yield name, ReadVector(abs(along), SE_MM, direction, se_deg, sure * start.confidence)


def _heads(lines: Lines, joint: complex, expected: _Expected, name: str) -> Iterator[tuple[float, complex]]:
    """Yield arrowheads of vectors from a joint along the expected ones, each with its probability."""
    for along in expected.vectors(name.removesuffix(ON_SKETCH)):
        if not abs(along) >= LEAST_MM:
            continue
        way = along / abs(along)
        from_start = (joint - lines.start) * np.conj(lines.along)
        tilt = np.abs(np.angle((lines.along * np.conj(way)) ** 2)) / 2.0
        passes = (np.abs(from_start.imag) < NEAR_MM) & (tilt < TILT_RAD)
        passes &= (from_start.real > -REACH_MM) & (from_start.real < lines.length + REACH_MM)
        rows = np.flatnonzero(passes)
        forward = (lines.along[rows] * np.conj(way)).real > 0.0
        tips, sure = lines.tips_towards(rows, forward, head=True)
        lengths = np.where(forward, 1.0, -1.0)[:, None] * (tips - from_start.real[rows, None])
        fits = (lengths < LENGTH_RATIO * abs(along)) & (LENGTH_RATIO * lengths > abs(along))
        for row, column in np.argwhere(fits & (sure >= SURE_TIP)):
            line = rows[row]
            yield float(sure[row, column]), complex(lines.start[line] + tips[row, column] * lines.along[line])


def _points(
    page: SketchPage, joints: Sequence[complex], expected: _Expected, name: str
) -> Iterator[tuple[float, complex]]:
    """Yield places near an expected centre where lines from both joints, or a line and a circle, meet.

    The nearer ones have a slightly higher probability.
    """
    free = page.lines.take(np.flatnonzero(~np.isin(page.lines.members, page.links).any(axis=1)))
    for at in filter(cmath.isfinite, expected.centres(name)):
        largest = PLACE_MM + PLACE_SHARE * max(abs(at - joint) for joint in joints)
        for place in _meetings(free, page.circles, joints, at):
            if abs(place - at) < largest:
                yield SURE_POINT * (1.0 - 0.01 * abs(place - at) / largest), place


def _meetings(
    lines: Lines, circles: ComplexArray, joints: Sequence[complex], at: complex
) -> Iterator[complex]:
    first, second = (_rays(lines, joint, at) for joint in joints)
    for one, other in product(first, second):
        across = float((np.conj(lines.along[one]) * lines.along[other]).imag)
        if abs(across) > math.sin(RAY_RAD):
            apart = np.conj(lines.start[other] - lines.start[one]) * lines.along[other]
            yield complex(lines.start[one] + apart.imag / across * lines.along[one])
    for one in (*first, *second):
        residual = np.abs(((circles - lines.start[one]) * np.conj(lines.along[one])).imag)
        yield from map(complex, circles[residual < NEAR_MM])


def _rays(lines: Lines, joint: complex, at: complex) -> IntArray:
    """Return the lines that lead from a joint to a place, or most of the way."""
    span = at - joint
    if abs(span) < LEAST_MM:
        return np.zeros(0, np.int64)
    ends = np.stack([lines.start - joint, lines.end - joint]) * np.conj(span) / abs(span)
    offset = np.abs(((joint - lines.start) * np.conj(lines.along)).imag)
    tilt = np.abs(np.angle((lines.along * np.conj(span)) ** 2)) / 2.0
    is_ray = (offset < NEAR_MM) & (tilt < RAY_RAD + math.atan(PLACE_MM / abs(span)) + PLACE_SHARE / 2.0)
    is_ray &= (ends.real.min(axis=0) < REACH_MM) & (ends.real.max(axis=0) > 0.8 * abs(span))
    return np.flatnonzero(is_ray)
