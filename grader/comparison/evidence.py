"""Bring readings and measurements into one frame, the assignment's."""

import cmath
import math
import statistics
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np

from grader.comparison.task import Task
from grader.records import MECHANISM, Figure, OtherReading, Reading, ReadNode, Reason
from grader.rubric import ToleranceTable
from reference.construction.graph import Construction
from reference.quantities import group_of, value_name


@dataclass(frozen=True, slots=True)
class Submission:
    """Everything one student handed in for one variant.

    Attributes
    ----------
    readings : what was read on each sheet
    measured : what the student (or an instructor) measured, directions from the assignment's +x
    values : computed values, SI, by vector or angular quantity
    declared : scales as declared, text by ``kL``, ``kv``, ``ka``
    verdicts : what a person decided of what waited, by vector, angular quantity or scale
    """

    readings: tuple[Reading, ...] = ()
    measured: Reading | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    declared: Mapping[str, str] = field(default_factory=dict)
    verdicts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DrawnVector:
    """A vector as drawn; direction in radians from the assignment's +x, None where not known.

    Inside, a vector that closes a force polygon has the direction in which it is drawn.
    """

    length_mm: float
    se_mm: float
    direction_rad: float | None
    se_deg: float
    confidence: float
    turn_rad: float = 0.0
    """Turn of the sketch on its sheet, and half a turn of a vector that closes a polygon: what was entered or
    read, and what is told of it, is `direction_rad` + this."""
    others: tuple[OtherReading, ...] = ()
    """Other readings, the likeliest first, as on the sheet."""
    is_doubted: bool = False
    """True if it is laid off in a force polygon that may be another one than was read."""
    remarks: tuple[Reason, ...] = ()
    """A reason to give where the length in the sheets' cells is another."""

    def if_others(self) -> Iterator["DrawnVector"]:
        """The vector as each of the others, with the confidence that it is this one or one before it."""
        for other in self.others:
            direction = math.radians(other.direction_deg) - self.turn_rad
            yield replace(
                self, length_mm=other.length_mm, direction_rad=direction, confidence=other.confidence
            )

    @property
    def as_complex(self) -> complex | None:
        """The vector in millimetres, where its direction is known."""
        return None if self.direction_rad is None else cmath.rect(self.length_mm, self.direction_rad)


@dataclass(frozen=True, slots=True)
class Evidence:
    """Everything that was read and measured, for one submission.

    Attributes
    ----------
    drawn : vectors and links read on the sheets
    measured : vectors measured by hand
    nodes : the student's own nodes, complex mm; plans about their pole, the mechanism about its
        assignment's origin
    se_mm : their standard errors of reading
    sketches : by plan, the mechanism's nodes as drawn beside it
    yardstick_mm : drawn length of the task's yardstick (the crank) and its standard error, or None
    unread : why something asked for was not read, by name
    blank : vectors without ink where they must be
    has_sheets : whether any sheet was handed in
    has_sketch : whether the mechanism was read on any
    refused : what was entered by hand for a vector, angular quantity or scale and cannot be used, by name
    verdicts : what a person decided of what waited, by name
    sure : the probability that a value was read rightly in a sheet's cells, by name; others were entered
    """

    drawn: Mapping[str, DrawnVector]
    measured: Mapping[str, DrawnVector]
    nodes: Mapping[str, complex]
    yardstick_mm: tuple[float, float] | None
    unread: Mapping[str, Reason]
    has_sheets: bool
    values: Mapping[str, float]
    se_mm: Mapping[str, float] = field(default_factory=dict)
    sketches: Mapping[str, Mapping[str, complex]] = field(default_factory=dict)
    has_sketch: bool = False
    refused: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    blank: frozenset[str] = frozenset()
    verdicts: Mapping[str, str] = field(default_factory=dict)
    sure: Mapping[str, float] = field(default_factory=dict)

    def vector(self, name: str) -> DrawnVector | None:
        """The vector as read, else as measured."""
        return self.drawn.get(name) or self.measured.get(name)


def gather(task: Task, submission: Submission) -> Evidence:
    """All readings of a submission in the assignment's frame."""
    written = {name: one for reading in submission.readings for name, one in reading.lengths.items()}
    sheets = _Sheets(task, _turn_of_sketches(task, submission.readings), written)
    for reading in submission.readings:
        sheets.take(reading)
    measured = _measured(task, submission.measured)
    own = sheets.nodes if submission.readings else _nodes_from(task, measured)
    entered = submission.values
    columns = {value_name(name): name for name in (*task.rubric.values, *task.rubric.moments)}
    columns |= {(sense := f"{name}_sense"): sense for name in task.rubric.moments if name not in entered}
    values = {name: written[column] for column, name in columns.items() if column in written}
    return Evidence(
        drawn=sheets.drawn,
        measured=measured,
        nodes=own,
        yardstick_mm=min(sheets.lengths, key=lambda one: one[1], default=None),
        unread={gap.name: gap.reason for reading in submission.readings for gap in reading.unread},
        has_sheets=bool(submission.readings),
        values={name: value for name, (value, _) in values.items()} | dict(entered),
        sure={name: sure for name, (_, sure) in values.items() if name not in entered},
        verdicts=submission.verdicts,
        se_mm=sheets.se_mm,
        sketches=sheets.sketches,
        has_sketch=any(MECHANISM in reading.figures for reading in submission.readings),
        refused=_refused(submission.measured, task.rubric.values),
        blank=frozenset(
            gap.name
            for reading in submission.readings
            for gap in reading.unread
            if gap.is_blank or (submission.verdicts.get(gap.name) == "none" and gap.name not in sheets.drawn)
        ),
    )


@dataclass(slots=True)
class _Sheets:
    """The readings of the sheets so far; of a figure on two sheets the nodes of the first one count."""

    task: Task
    turn: tuple[float, float]
    written: Mapping[str, tuple[float, float]]
    drawn: dict[str, DrawnVector] = field(default_factory=dict)
    nodes: dict[str, complex] = field(default_factory=dict)
    se_mm: dict[str, float] = field(default_factory=dict)
    sketches: dict[str, dict[str, complex]] = field(default_factory=dict)
    lengths: list[tuple[float, float]] = field(default_factory=list)

    def take(self, reading: Reading) -> None:
        """Add one sheet."""
        sketch = reading.figures.get(MECHANISM)
        turn, se_turn = turn_of(self.task, sketch) if sketch else self.turn
        is_likely = sketch is not None and abs(turn) < FAR_TURNED_RAD
        if not is_likely and not _agrees_with_plans(self.task, reading, turn):
            turn, se_turn = NOT_TURNED
        joints: dict[str, complex] = {}
        if sketch:
            self.lengths.extend(_yardstick(self.task, sketch))
            self.add_vectors(_links(self.task, sketch, turn, se_turn))
            self.add_vectors(_vectors(self.task, sketch, sketch.vectors, turn, se_turn))
            joints = _mechanism_nodes(self.task, sketch, turn)
            self.add_nodes(joints, sketch)
        for figure, read in reading.figures.items():
            if figure != MECHANISM:
                names = [vector.name for vector in self.task.construction.vectors_of(figure)]
                vectors = _vectors(self.task, read, names, turn, se_turn)
                vectors = _doubted(self.task, figure, vectors) if group_of(figure) else vectors
                held = self.held_against_cells(vectors)
                self.add_vectors(held)
                if group_of(figure):
                    blank = frozenset(gap.name for gap in reading.unread if gap.is_blank)
                    sums = _between_parts(self.task, figure, read, blank, turn)
                    for name, one in self.held_against_cells(sums).items():
                        sure = min(one.confidence, sums[name].confidence)
                        self.add_vectors({name: replace(one, confidence=sure)})
                surer = {
                    name: one.confidence
                    for name, one in held.items()
                    if one.confidence > vectors[name].confidence and not group_of(figure)
                }
                read = at_least(read, surer, self.task.construction)  # noqa: PLW2901 - the same figure
                self.add_nodes(_plan_nodes(self.task, figure, read, turn), read)
                if joints:
                    self.sketches.setdefault(figure, joints)

    def held_against_cells(self, drawn: Mapping[str, DrawnVector]) -> dict[str, DrawnVector]:
        """Weigh vectors by the lengths in the cells, by name."""
        rubric = self.task.rubric
        return {
            name: held_against_cells(
                one, *self.written[name], rubric.tolerance_of(name), rubric.least_confidence
            )
            if name in self.written
            else one
            for name, one in drawn.items()
        }

    def add_vectors(self, vectors: Mapping[str, DrawnVector]) -> None:
        """Add vectors; of one on two sheets the more certain reading counts."""
        for name, vector in vectors.items():
            if name not in self.drawn or vector.confidence > self.drawn[name].confidence:
                self.drawn[name] = vector

    def add_nodes(self, positions: Mapping[str, complex], read: Figure) -> None:
        """Add the nodes that are not known yet."""
        for name, place in positions.items():
            if name not in self.nodes:
                self.nodes[name] = place
                self.se_mm[name] = read.nodes[name].se_mm


# The lengths written beside the drawing -------------------------------------------------------------

MISWRITTEN, BY_CHANCE = 0.1, 0.05
"""Probabilities that a length in the cells is not that of the vector drawn (measured to another node, or a
slip), and that it agrees with what was read although that is another stroke."""


def held_against_cells(
    drawn: DrawnVector, length_mm: float, certain: float, tolerance: ToleranceTable, least: float
) -> DrawnVector:
    """Return the drawn vector, as sure as the length in the sheet's cells leaves it.

    The length speaks for each reading of the vector that has it, and against the rest. Another reading of
    that length stays as likely beside this one: a length shows no direction. One that ends within the
    tolerance of this one is no other vector, and counts with the rest. Digits that are less sure say
    less, and nothing against this one: where they differ, they were misread more often than the vector. A
    ruler's error is below the tolerance of a short length; up to that of the length nothing is said.

    Arguments: `certain` is the probability that the length is what stands in the cells, `least` that from
    which digits are sure.
    """
    lengths = np.array([drawn.length_mm, *(one.length_mm for one in drawn.others)])
    beyond_mm = np.abs(lengths - length_mm) - tolerance.certain_errors * drawn.se_mm
    agree, differ = beyond_mm <= tolerance.length_mm, beyond_mm > tolerance.length_at(length_mm)
    if certain < least and not agree[0]:
        return drawn
    told = certain * (1.0 - MISWRITTEN)
    slip = (1.0 - told) * BY_CHANCE
    weight = np.select([agree, differ], [told + slip, slip], BY_CHANCE)
    apart = [abs((one.as_complex or 0j) - (drawn.as_complex or 0j)) for one in drawn.if_others()]
    weight[1:][np.array(apart) <= tolerance.length_mm] = BY_CHANCE
    prior = np.maximum.accumulate([drawn.confidence, *(one.confidence for one in drawn.others)])
    together = np.cumsum(np.diff(prior, prepend=0.0) * weight)
    sure = (together / (together[-1] + (1.0 - prior[-1]) * BY_CHANCE)).tolist()
    others = tuple(replace(one, confidence=p) for one, p in zip(drawn.others, sure[1:], strict=True))
    is_doubted = drawn.is_doubted and sure[0] <= drawn.confidence
    params: dict[str, float | str] = {"drawn": drawn.length_mm, "written": length_mm, "unit": "mm"}
    remarks = (Reason("written_disagrees", params),) if differ[0] else ()
    return replace(drawn, confidence=sure[0], others=others, is_doubted=is_doubted, remarks=remarks)


def at_least(read: Figure, sure: Mapping[str, float], construction: Construction) -> Figure:
    """Return the figure with vectors at least as sure as given, and nodes as the surest of these there."""
    ends: dict[str, float] = {}
    for name in sure:
        for node in (construction.vectors[name].tail, construction.vectors[name].head):
            ends[node] = max(ends.get(node, 0.0), sure[name])
    nodes = {
        name: replace(one, confidence=max(one.confidence, ends.get(name, 0.0)))
        for name, one in read.nodes.items()
    }
    vectors = {
        name: replace(one, confidence=max(one.confidence, sure.get(name, 0.0)))
        for name, one in read.vectors.items()
    }
    return replace(read, nodes=nodes, vectors=vectors)


# Vectors and nodes --------------------------------------------------------------------------------


def _vectors(
    task: Task, read: Figure, names: Iterable[str], turn: float = 0.0, se_turn: float = 0.0
) -> dict[str, DrawnVector]:
    """Vectors of a figure whose lengths are known, by name; `turn` is that of its sheet."""
    found = {}
    for name in names:
        one = read.vectors.get(name)
        if one is not None and one.length_mm is not None:
            whole = turn + _own_turn(task, name)
            direction = None if one.direction_deg is None else math.radians(one.direction_deg) - whole
            se_deg = math.hypot(one.se_deg or 0.0, math.degrees(se_turn))
            found[name] = DrawnVector(
                one.length_mm, one.se_mm, direction, se_deg, one.confidence, whole, one.others
            )
    return found


EITHER = 0.5
"""Most confidence in each of two opposite forces that make a polygon."""
MOSTLY_DOUBTED, DOUBTED = 0.79, 0.6
"""Median confidence of a force polygon's sides below which the polygon was mostly read in doubt; and that of
one force: of 13 that seemed right one had been left out."""


def _doubted(task: Task, figure: str, drawn: Mapping[str, DrawnVector]) -> dict[str, DrawnVector]:
    """Return the vectors of a force polygon, those laid off `is_doubted` where it may be another polygon.

    Not all its sides were found, and it does not close; or it was mostly read in doubt; or its forces do not
    show its sense, as all of them reversed leave the same lines: only two or more do that all point as the
    data have them. Sides too short to have a direction show nothing.
    """
    sides = task.construction.polygon_of(figure)
    if len({frozenset((one.tail, one.head)) for one in sides}) == 1:
        # Two opposite forces: only their names, which are not read, tell which is which.
        either = {name: min(one.confidence, EITHER) for name, one in drawn.items()}
        return {name: replace(drawn[name], confidence=sure, is_doubted=True) for name, sure in either.items()}
    laid_off = {one.name for one in sides if task.construction.laid_off(one.tail, one.head) is not None}
    shown = {
        one.name: at
        for one in sides
        if one.name in drawn
        and (at := drawn[one.name].as_complex)
        and abs(at) >= task.rubric.tolerance_of(one.name).least_mm
    }
    forward = [
        (at * task.segments[name].real.conjugate()).real > 0.0
        for name, at in shown.items()
        if name in laid_off
    ]
    is_told = len(forward) > 1 and all(forward)
    is_closed = all(one.name in drawn for one in sides)
    is_doubtful = (
        not (is_told and is_closed)
        or statistics.median(drawn[name].confidence for name in shown) < MOSTLY_DOUBTED
    )
    return {
        name: replace(one, is_doubted=name in laid_off and (is_doubtful or one.confidence < DOUBTED))
        for name, one in drawn.items()
    }


def _between_parts(
    task: Task, figure: str, read: Figure, blank: frozenset[str], turn: float
) -> dict[str, DrawnVector]:
    """Return the sums of forces that are asked for but not drawn out: their ends on the polygon show them."""
    asked = blank & {one.name for one in task.rubric.criterion if not one.optional}
    sums = {
        one.name: read.nodes[one.arrow[0]].vector_to(read.nodes[one.arrow[1]])
        for one in task.construction.vectors_of(figure)
        if one.is_sum and one.name in asked and read.nodes.keys() >= {*one.arrow}
    }
    return _vectors(task, replace(read, vectors=sums), sums, turn)


def _own_turn(task: Task, name: str) -> float:
    """The angle from a vector's order of drawing to its own sense."""
    vector = task.construction.vectors.get(name)
    return 0.0 if vector is None else vector.turn_rad


def _links(task: Task, sketch: Figure, turn: float, se_turn: float) -> dict[str, DrawnVector]:
    """Links between joints that were read, by the links' names."""
    found = {}
    for name, (tail, head) in task.construction.links.items():
        if tail not in sketch.nodes or head not in sketch.nodes:
            continue
        one, other = sketch.nodes[tail], sketch.nodes[head]
        length, along = abs(other.at - one.at), cmath.phase(other.at - one.at)
        se_mm = math.hypot(one.se_mm, other.se_mm)
        se_deg = math.degrees(math.hypot(se_mm / length, se_turn)) if length > se_mm else 180.0
        # Half of the doubt in a joint is about its place, and that is in its standard error.
        confidence = 0.5 + min(one.confidence, other.confidence) / 2.0
        found[name] = DrawnVector(length, se_mm, along - turn, se_deg, confidence, turn)
    return found


def _plan_nodes(task: Task, figure: str, read: Figure, turn: float) -> dict[str, complex]:
    pole = read.nodes.get(task.construction.poles.get(figure, ""))
    if pole is None:
        return {}
    back = cmath.rect(1.0, -turn)
    return {name: (node.at - pole.at) * back for name, node in _sure(task, read).items()}


def _mechanism_nodes(task: Task, sketch: Figure, turn: float) -> dict[str, complex]:
    """The sketch's nodes about the assignment's origin; none where its scale or its pivots are not known."""
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


def _measured(task: Task, reading: Reading | None) -> dict[str, DrawnVector]:
    figures = reading.figures.values() if reading else ()
    return {name: one for read in figures for name, one in _vectors(task, read, read.vectors).items()}


def _refused(reading: Reading | None, values: Collection[str]) -> dict[str, tuple[str, ...]]:
    """Entries that cannot be used, by name; those for one of `values` that is judged alone by its column."""
    entries: dict[str, tuple[str, ...]] = {}
    for gap in reading.unread if reading else ():
        for given in cast("tuple[str, ...]", gap.reason.parameters["entries"]):
            column = value_name(gap.name)
            name = column if gap.name in values and given.startswith(f"{column}:") else gap.name
            entries[name] = (*entries.get(name, ()), given)
    return entries


def _nodes_from(task: Task, measured: Mapping[str, DrawnVector]) -> dict[str, complex]:
    """The nodes that measured vectors with directions give, from the poles on along the fewest vectors."""
    nodes = dict.fromkeys(task.construction.poles.values(), 0j)
    steps = {name: step for name, one in measured.items() if (step := one.as_complex) is not None}
    vectors = [task.construction.vectors[name] for name in steps if name in task.construction.vectors]
    found = True
    while found:
        further = {
            vector.head: nodes[vector.tail] + steps[vector.name]
            for vector in reversed(vectors)
            if vector.tail in nodes and vector.head not in nodes
        }
        nodes.update(further)
        found = bool(further)
    return nodes


# The turn of a sketch on its sheet ---------------------------------------------------------------


NOT_TURNED = (0.0, math.radians(1.0))
"""The turn without a sketch, and its standard error: people draw along the frame, to about a degree."""
FAR_TURNED_RAD = math.radians(90.0)
"""Nobody turns a sketch by more than this on its sheet."""
LEAST_TURNED_MM = 10.0
"""A shorter vector tells a sheet's turn too vaguely."""
FIT_MM = 1.0
"""Root mean square misfit up to which the drawn mechanism is the right one, turned and scaled."""
LEAST_GROUND_MM = 20.0
"""Pivots nearer to each other than this do not determine the sketch's turn."""
CERTAINLY_UPRIGHT_RAD = 1e-3
"""A smaller turn is far below every tolerance of a direction."""
LEAST_JOINTS = 3
"""Number of joints that fit together and so determine the turn of a sketch with other, wrong joints."""


def turn_of(task: Task, sketch: Figure) -> tuple[float, float]:
    """Return the turn of the mechanism on its sheet, radians counter-clockwise, and its standard error.

    It is fitted to the whole mechanism where that is right, else to what is right without one joint and
    those drawn from it, else to the pivots alone, which no mistake moves; `NOT_TURNED` without any.
    """
    exact = task.nodes(dict.fromkeys(task.assignment.scale_names, 1.0))
    sure = {
        name: node
        for name, node in sketch.nodes.items()
        if name in exact and node.confidence >= task.rubric.least_confidence
    }
    for nodes in _subsets(task, sure):
        fit = _fit(nodes, exact)
        if fit is not None and fit[2] <= FIT_MM:
            # A turn that may be a drafting error is none, but counts as the uncertainty.
            is_error = _is_drafting_error(task, nodes, fit[0])
            return (0.0, math.hypot(fit[1], fit[0])) if is_error else (fit[0], fit[1])
    ground = _fit({name: node for name, node in sure.items() if name in task.ground}, exact)
    return (ground[0], ground[1]) if ground is not None else NOT_TURNED


def _agrees_with_plans(task: Task, reading: Reading, turn: float) -> bool:
    """Return whether as many vectors of the sheet's plans fit a sketch's turn as fit none.

    People draw plans beside the sketch as it lies. One that looks upside down among plans that are not
    has been misread.
    """
    off = _turns(task, reading)
    turned, upright = (
        sum(abs(math.remainder(one - by, math.tau)) < abs(turn) / 4.0 for one in off) for by in (turn, 0.0)
    )
    return turned >= upright


def _turn_of_sketches(task: Task, readings: Sequence[Reading]) -> tuple[float, float]:
    """The turn of a student's first sketch, for sheets that have none: people lay each sheet alike."""
    sketch = next((one.figures[MECHANISM] for one in readings if MECHANISM in one.figures), None)
    turn, se = NOT_TURNED if sketch is None else turn_of(task, sketch)
    return turn, math.hypot(se, NOT_TURNED[1])


def _turns(task: Task, reading: Reading) -> list[float]:
    """Return the turn of each vector of a sheet's plans from the exact one, radians, -pi to pi."""
    return [
        math.remainder(
            math.radians(drawn.direction_deg) - _own_turn(task, name) - cmath.phase(task.real[name]), math.tau
        )
        for figure in reading.figures.values()
        for name, drawn in figure.vectors.items()
        if drawn.direction_deg is not None
        and (drawn.length_mm or 0.0) > LEAST_TURNED_MM
        and task.real.get(name)
    ]


def _is_drafting_error(task: Task, nodes: Iterable[str], turn: float) -> bool:
    """Return whether careful drafting errors may turn an upright sketch as much."""
    if abs(turn) <= CERTAINLY_UPRIGHT_RAD:
        return True
    drawn = task.traced(task.rule_scales).nodes
    positions = {name: drawn[name] for name in nodes}
    centre = sum(one.at for one in positions.values()) / len(positions)
    arms = np.array([one.at - centre for one in positions.values()])
    shifts = np.array([one.shifts for one in positions.values()])
    turned = np.imag(np.conj(arms) @ (shifts - shifts.mean(axis=0))) / np.sum(np.abs(arms) ** 2)
    return bool(abs(turn) <= task.rubric.hand.sigmas * np.sqrt(np.sum(turned**2)))


def _subsets(task: Task, sure: Mapping[str, ReadNode]) -> Iterator[Mapping[str, ReadNode]]:
    """All nodes, then those left without one of them and all drawn from it, the largest subset first."""
    yield sure
    upstream = {name: task.construction.upstream(name) for name in sure}
    kept = [
        {name: node for name, node in sure.items() if wrong not in upstream[name]}
        for wrong in sure
        if wrong not in task.ground
    ]
    yield from (nodes for nodes in sorted(kept, key=len, reverse=True) if len(nodes) >= LEAST_JOINTS)


def _fit(nodes: Mapping[str, ReadNode], exact: Mapping[str, complex]) -> tuple[float, float, float] | None:
    """Turn (rad), its standard error, and RMS residual (mm) of the similarity from exact to drawn nodes."""
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
