"""Readings and measurements brought into one frame: the assignment's, y up, plans about their poles.

A sketch that is turned on its sheet is legitimate: directions on a sheet are turned back by the
turn of the mechanism as drawn there, where it was read; else the sheet's x axis counts.
"""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from grader.comparison.task import Task
from grader.records import MECHANISM, Figure, Reading, ReadNode

FIT_MM = 1.0
"""Root mean square misfit up to which the drawn mechanism is the right one, turned and scaled."""
LEAST_GROUND_MM = 20.0
"""Two pivots nearer than this do not tell the sketch's turn."""


@dataclass(frozen=True, slots=True)
class Submission:
    """Everything one student handed in for one variant.

    Attributes
    ----------
    readings : what was read on each sheet
    measured : what the student (or an instructor) measured, directions from the assignment's +x
    values : computed values, SI, by vector or angular quantity
    declared : scales as declared, text by ``kL``, ``kv``, ``ka``
    """

    readings: tuple[Reading, ...] = ()
    measured: Reading | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    declared: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DrawnVector:
    """A vector as drawn; direction in radians from the assignment's +x, None where not known."""

    length_mm: float
    se_mm: float
    direction_rad: float | None
    se_deg: float
    confidence: float
    turn_rad: float = 0.0
    """Of the sketch on its sheet: the sheet's direction is `direction_rad` + this."""

    @property
    def as_complex(self) -> complex | None:
        """The vector in millimetres, where its direction is known."""
        return None if self.direction_rad is None else cmath.rect(self.length_mm, self.direction_rad)


@dataclass(frozen=True, slots=True)
class Evidence:
    """What there is to judge by.

    Attributes
    ----------
    drawn : vectors read on the sheets
    measured : vectors measured by hand
    nodes : the student's own nodes, complex mm; plans about their pole, the mechanism about its
        assignment's origin
    yardstick_mm : drawn length of the task's yardstick (the crank) and its standard error, or None
    unread : why something asked for was not read, by name
    has_sheets : whether any sheet was handed in
    written : lengths that stand in the sheets' cells, mm, and the probability that they do, by vector
    """

    drawn: Mapping[str, DrawnVector]
    measured: Mapping[str, DrawnVector]
    nodes: Mapping[str, complex]
    yardstick_mm: tuple[float, float] | None
    unread: Mapping[str, str]
    has_sheets: bool
    values: Mapping[str, float]
    written: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def vector(self, name: str) -> DrawnVector | None:
        """The vector as read, else as measured."""
        return self.drawn.get(name) or self.measured.get(name)


def gather(task: Task, submission: Submission) -> Evidence:
    """All readings of a submission in the assignment's frame."""
    drawn: dict[str, DrawnVector] = {}
    nodes: dict[str, complex] = {}
    lengths: list[tuple[float, float]] = []
    turns: dict[str, float] = {}
    for reading in submission.readings:
        sketch = reading.figures.get(MECHANISM)
        turn, se_turn = turn_of(task, sketch) if sketch else (0.0, 0.0)
        for figure, read in reading.figures.items():
            if figure == MECHANISM:
                continue
            for name, vector in _vectors(task, figure, read, turn, se_turn).items():
                if name not in drawn or vector.confidence > drawn[name].confidence:
                    drawn[name] = vector
            turns.setdefault(figure, turn)
            for name, place in _plan_nodes(task, figure, read, turn).items():
                nodes.setdefault(name, place)
        if sketch:
            lengths.extend(_yardstick(task, sketch))
            for name, place in _mechanism_nodes(task, sketch, turn).items():
                nodes.setdefault(name, place)
    measured = _measured(submission.measured)
    own = nodes if submission.readings else _nodes_from(task, measured)
    length = min(lengths, key=lambda one: one[1], default=None)
    unread = {gap.name: gap.reason for reading in submission.readings for gap in reading.unread}
    written = {name: one for reading in submission.readings for name, one in reading.lengths.items()}
    return Evidence(
        drawn, measured, own, length, unread, bool(submission.readings), submission.values, written
    )


# The turn of a sketch -----------------------------------------------------------------------------


def turn_of(task: Task, sketch: Figure) -> tuple[float, float]:
    """How far the mechanism is turned on its sheet, radians counter-clockwise, and its standard error.

    The whole mechanism tells it where it is the right one; where it is not, its pivots alone, that
    no mistake moves; where there are none, zero.
    """
    exact = task.nodes({"kL": 1.0, "kv": 1.0, "ka": 1.0})
    sure = {
        name: node
        for name, node in sketch.nodes.items()
        if name in exact and node.confidence >= task.rubric.least_confidence
    }
    whole = _fit(sure, exact)
    if whole is not None and whole[2] <= FIT_MM:
        return whole[0], whole[1]
    pivots = {name: node for name, node in sure.items() if name in task.ground}
    ground = _fit(pivots, exact)
    return (ground[0], ground[1]) if ground is not None else (0.0, 0.0)


def _fit(nodes: Mapping[str, ReadNode], exact: Mapping[str, complex]) -> tuple[float, float, float] | None:
    """Turn, its standard error, and misfit in mm of the similarity from exact to drawn nodes."""
    if len(nodes) < 2:
        return None
    drawn = [node.at for node in nodes.values()]
    model = [exact[name] for name in nodes]
    centre, middle = sum(drawn) / len(drawn), sum(model) / len(model)
    drawn = [place - centre for place in drawn]
    model = [place - middle for place in model]
    spread = math.sqrt(sum(abs(place) ** 2 for place in drawn))
    if spread < LEAST_GROUND_MM / math.sqrt(2.0):
        return None
    turn_and_scale = sum(d * m.conjugate() for d, m in zip(drawn, model, strict=True))
    turn_and_scale /= sum(abs(m) ** 2 for m in model)
    misfit = [abs(d - turn_and_scale * m) ** 2 for d, m in zip(drawn, model, strict=True)]
    se = math.sqrt(sum(node.se_mm**2 for node in nodes.values()) / len(nodes)) / spread
    return cmath.phase(turn_and_scale), se, math.sqrt(sum(misfit) / len(misfit))


# Vectors and nodes --------------------------------------------------------------------------------


def _vectors(task: Task, figure: str, read: Figure, turn: float, se_turn: float) -> dict[str, DrawnVector]:
    found = {}
    for vector in task.construction.vectors_of(figure):
        one = read.vectors.get(vector.name)
        if one is None or one.length_mm is None:
            continue
        direction = None if one.direction_deg is None else math.radians(one.direction_deg) - turn
        se_deg = math.hypot(one.se_deg or 0.0, math.degrees(se_turn))
        found[vector.name] = DrawnVector(one.length_mm, one.se_mm, direction, se_deg, one.confidence, turn)
    return found


def _plan_nodes(task: Task, figure: str, read: Figure, turn: float) -> dict[str, complex]:
    pole = read.nodes.get(task.construction.poles.get(figure, ""))
    if pole is None:
        return {}
    back = cmath.rect(1.0, -turn)
    return {name: (node.at - pole.at) * back for name, node in _sure(task, read).items()}


def _mechanism_nodes(task: Task, sketch: Figure, turn: float) -> dict[str, complex]:
    """The sketch about the assignment's origin, for which its scale and one of its pivots must be known."""
    sure, drawn = _sure(task, sketch), _yardstick(task, sketch)
    pivot = next((name for name in task.ground if name in sure), None)
    if task.yardstick is None or not drawn or pivot is None:
        return {}
    origin = task.ground[pivot] * drawn[0][0] / task.yardstick.length_m
    back = cmath.rect(1.0, -turn)
    return {name: (node.at - sure[pivot].at) * back + origin for name, node in sure.items()}


def _sure(task: Task, read: Figure) -> dict[str, ReadNode]:
    least = task.rubric.least_confidence
    return {name: node for name, node in read.nodes.items() if node.confidence >= least}


def _yardstick(task: Task, sketch: Figure) -> list[tuple[float, float]]:
    sure, link = _sure(task, sketch), task.yardstick
    if link is None or link.tail not in sure or link.head not in sure:
        return []
    tail, head = sure[link.tail], sure[link.head]
    length = abs(head.at - tail.at)
    return [(length, math.hypot(tail.se_mm, head.se_mm))] if length > 0.0 else []


def _measured(reading: Reading | None) -> dict[str, DrawnVector]:
    found: dict[str, DrawnVector] = {}
    for figure in reading.figures.values() if reading else ():
        for name, one in figure.vectors.items():
            if one.length_mm is not None:
                direction = None if one.direction_deg is None else math.radians(one.direction_deg)
                found[name] = DrawnVector(
                    one.length_mm, one.se_mm, direction, one.se_deg or 0.0, one.confidence
                )
    return found


def _nodes_from(task: Task, measured: Mapping[str, DrawnVector]) -> dict[str, complex]:
    """The nodes that measured vectors with directions lead to, from the poles on."""
    nodes = dict.fromkeys(task.construction.poles.values(), 0j)
    found = True
    while found:
        found = False
        for name, vector in task.construction.vectors.items():
            one = measured.get(name)
            step = one.as_complex if one else None
            if step is not None and vector.tail in nodes and vector.head not in nodes:
                nodes[vector.head] = nodes[vector.tail] + step
                found = True
    return nodes
