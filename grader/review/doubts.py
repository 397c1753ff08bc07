"""Questions to a person about a submission: one for each doubt, however many criteria it concerns.

Whose drawing it is comes first, then scales, then where a node lies, then single verdicts. A question has
choices; each is a bundle of rows for the file of decisions, and judging the submission with them shows what
else the answer settles.
"""

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from grader.comparison.task import Task
from grader.documents import CriterionDocument, FigureDocument, ReadingDocument, ReportDocument
from grader.marking.answers import OFF_AS_READ, along_of
from grader.outcomes import CREDITED, EVEN
from grader.records import MECHANISM, Figure, Reading, ReadNode, ReadVector, ScannedPage, on_sheet
from grader.tables.decision_texts import place_text
from reference.authored.assignment import SCALE_NAMES
from reference.construction.graph import Vector

Kind = Literal["owner", "scale", "node", "verdict"]
ORDER: Mapping[Kind, int] = {"owner": 0, "scale": 1, "node": 2, "verdict": 3}
OPEN = "review"
OF_OWNER = ("other_variant", "data_misread", "data_unclear", "not_explained")
"""Reasons of a doubt that concerns a whole drawing."""
SURE = 0.8
"""A choice of this probability is the default, which Enter takes; below it a person is not led."""
APART_MM = 1.0
"""Two places nearer than this are one: the tolerance of a short vector is a little more."""
MOST_PLACES = 3
OTHERWISE = 0.6
"""The share of misread nodes that lie at one of the other places offered."""
LIKELY_WHOLE = 2
"""So many open verdicts or more with one reason are one question."""


@dataclass(frozen=True, slots=True)
class Choice:
    """One answer to a question.

    Attributes
    ----------
    key : ``a``, ``b`` for places, ``neither``, else a verdict or ``follow``
    rows : what it writes, verdicts or places by criterion
    probability : that it is the right answer, None where nothing is known
    at : of a place, mm on the sheet, y down
    start : the other end of a vector that starts or ends at that place
    vector : its name
    is_tail : whether it starts at that place
    """

    key: str
    rows: tuple[tuple[str, str], ...]
    probability: float | None = None
    at: tuple[float, float] | None = None
    start: tuple[float, float] | None = None
    vector: str = ""
    is_tail: bool = False

    @property
    def along(self) -> complex | None:
        """The vector as it would be drawn, complex mm, y up; None where its other end is not known."""
        if self.at is None or self.start is None:
            return None
        along = complex(self.at[0] - self.start[0], self.start[1] - self.at[1])
        return -along if self.is_tail else along


@dataclass(frozen=True, slots=True)
class Doubt:
    """One question.

    Attributes
    ----------
    id : of the criterion, or ``owner`` or ``node:FIGURE:NODE``
    criteria : the open criteria that it is about
    choices : the likeliest first, but for verdicts, whose order is always the same
    settles : how many open criteria its likeliest answer settles; 0 where that was not counted
    """

    id: str
    kind: Kind
    criteria: tuple[str, ...]
    choices: tuple[Choice, ...] = ()
    settles: int = 0

    @property
    def default(self) -> Choice | None:
        """The choice that Enter takes."""
        return next((one for one in self.choices if (one.probability or 0.0) >= SURE), None)

    @property
    def likeliest(self) -> Choice | None:
        """The choice whose consequences are counted."""
        known = [one for one in self.choices if one.probability is not None]
        return max(known, key=lambda one: one.probability or 0.0, default=None) or next(
            iter(self.choices), None
        )


def doubts_of(task: Task, report: ReportDocument, figures: Mapping[str, Figure]) -> list[Doubt]:
    """Return the questions of a report, those that concern most first.

    Arguments: `figures` as read on the sheets, with what else each vector may be.
    """
    waiting = [one for one in report.criteria if one.verdict == OPEN]
    vectors, found = task.construction.vectors, list[Doubt]()
    heads = [(vectors[one.drawn].head, one.verdict) for one in report.criteria if one.drawn in vectors]
    right = {head for head, verdict in heads if verdict == "full"}
    right -= {head for head, verdict in heads if verdict not in {"full", "not_judged"}}
    vouched = task.construction.needed_for(right) | right
    for make in (_owners, _scales, _nodes):
        covered = {name for doubt in found for name in doubt.criteria}
        left = [one for one in waiting if one.id not in covered]
        found.extend(make(_Asked(task, left, figures, vouched)))
    covered = {name for doubt in found for name in doubt.criteria}
    found.extend(of_verdict(one) for one in waiting if one.id not in covered)
    return in_order(found)


def in_order(doubts: Sequence[Doubt]) -> list[Doubt]:
    """Return questions in the order in which they are asked: by kind, then by what they settle.

    A verdict on which others hang is asked with the nodes.
    """

    def place(doubt: Doubt) -> tuple[int, int]:
        kind: Kind = "node" if len(doubt.criteria) > 1 else doubt.kind
        return min(ORDER[kind], ORDER[doubt.kind]), -doubt.settles

    return sorted(doubts, key=place)


@dataclass(frozen=True, slots=True)
class _Asked:
    """The criteria that wait, what was read, and the nodes from which vectors were made that are right."""

    task: Task
    waiting: Sequence[CriterionDocument]
    figures: Mapping[str, Figure]
    vouched: frozenset[str]

    @property
    def least(self) -> float:
        """The confidence from which a node counts as read."""
        return self.task.rubric.least_confidence


def of_verdict(criterion: CriterionDocument) -> Doubt:
    """Return the question of one verdict."""
    order = ("full", "partial", "none", "follow_through")
    choices = tuple(
        Choice(
            verdict,
            ((criterion.id, verdict),),
            known_probability(criterion) if verdict == criterion.proposed else None,
        )
        for verdict in order
    )
    return Doubt(criterion.id, "verdict", (criterion.id,), choices)


def known_probability(criterion: CriterionDocument) -> float | None:
    """Return the probability of the proposed verdict; None if nothing speaks for it."""
    return None if criterion.probability == EVEN else criterion.probability


# Whose drawing it is --------------------------------------------------------------------------------


def _owners(asked: _Asked) -> Iterator[Doubt]:
    """Yield one question for all verdicts that wait because the drawing may be of another task."""
    for code in OF_OWNER:
        about = [one for one in asked.waiting if code in one.reasons]
        if len(about) < LIKELY_WHOLE:
            continue
        names = tuple(one.id for one in about)
        follow = tuple((one.id, one.proposed or "none") for one in about)
        none = tuple((name, "none") for name in names)
        yield Doubt("owner", "owner", names, (Choice("none", none), Choice("follow", follow)))
        return


# Scales ---------------------------------------------------------------------------------------------


def _scales(asked: _Asked) -> Iterator[Doubt]:
    """Yield the scales that wait, each with the vectors that wait for it."""
    by_scale = {one.name: one.id for one in asked.task.rubric.criterion if one.name in SCALE_NAMES}
    for scale in asked.task.assignment.scale_names:
        own = [one for one in asked.waiting if one.id == by_scale.get(scale)]
        undecided = [one for one in asked.waiting if _waits_for(asked.task, one, scale)]
        if not own and len(undecided) < LIKELY_WHOLE:
            continue
        names = (*(one.id for one in own), *(one.id for one in undecided))
        if scale in by_scale:
            likely = own[0].proposed if own else None
            sure = known_probability(own[0]) if own else None
            choices = tuple(
                Choice(verdict, ((by_scale[scale], verdict),), sure if verdict == likely else None)
                for verdict in ("full", "partial", "none")
            )
            yield Doubt(by_scale[scale], "scale", names, choices)
        else:
            right = tuple((one.id, "follow_through") for one in undecided)
            wrong = tuple((one.id, "none") for one in undecided)
            yield Doubt(f"scale:{scale}", "scale", names, (Choice("full", right), Choice("none", wrong)))


def _waits_for(task: Task, criterion: CriterionDocument, scale: str) -> bool:
    """Return whether a vector is right at the scale drawn with, and wrong at the one that was assumed."""
    segment = task.segments.get(criterion.vector or "")
    codes = set(criterion.reasons)
    return segment is not None and segment.scale == scale and {"scale_assumed", "follows"} <= codes


# Nodes ----------------------------------------------------------------------------------------------


def _nodes(asked: _Asked) -> Iterator[Doubt]:
    """Yield the doubtful nodes on which open verdicts depend, in the order of construction."""
    left = {one.id: one for one in asked.waiting if one.vector is not None}
    for step in asked.task.construction.steps:
        figure = asked.task.construction.figure_of(step.node)
        if figure not in asked.figures or not left:
            continue
        about = [one for one in left.values() if step.node in _in_doubt(asked, one)]
        unread = next((one for one in left.values() if _is_unread_end(asked, one, step.node)), None)
        if about and unread is not None:
            # Whether the vector is there at all: what hangs on it follows from the answer.
            yield replace(of_verdict(unread), criteria=(unread.id, *(one.id for one in about)))
            left = {name: one for name, one in left.items() if one not in [unread, *about]}
            continue
        make = _joint if figure == MECHANISM else _places
        # A node of a polygon in another order is at no single place of the sheet: each vector is asked for.
        places = () if asked.figures[figure].drawn or not about else make(asked, about, step.node, figure)
        choices = (_credit(about) if about else ()) or places
        if choices:
            kind: Kind = "verdict" if choices[0].at is None else "node"
            yield Doubt(f"node:{figure}:{step.node}", kind, tuple(one.id for one in about), choices)
            left = {name: one for name, one in left.items() if one not in about}


def _vector(asked: _Asked, criterion: CriterionDocument) -> Vector:
    return asked.task.construction.vectors[criterion.vector or ""]


def _in_doubt(asked: _Asked, criterion: CriterionDocument) -> set[str]:
    """Return the doubtful nodes on which an open vector depends, above all its ends.

    It is empty if the vector is open for another reason than its reading.
    """
    codes, vector = set(criterion.reasons), _vector(asked, criterion)
    figure = asked.figures.get(asked.task.construction.figure_of(vector.head))
    if figure is None or not {"doubtful", "unread"} & codes or criterion.measured.length_mm is None:
        return set()
    needs = set(asked.task.construction.step(vector.head).needs) - asked.vouched if "unread" in codes else ()
    unsure = {one for one in (vector.tail, vector.head, *needs) if _sure(asked, one) < asked.least}
    known = {end: _sure(asked, end) for end in (vector.tail, vector.head)}
    weakest = min(known, key=lambda end: known[end])
    return unsure or ({weakest} if "doubtful" in codes and known[weakest] < 1.0 else set())


def _is_unread_end(asked: _Asked, criterion: CriterionDocument, node: str) -> bool:
    """Return whether a criterion is of a vector that was not read and ends at a node."""
    return criterion.measured.length_mm is None and _vector(asked, criterion).head == node


def _sure(asked: _Asked, node: str) -> float:
    """Return the confidence in a node; 0 if it was not read."""
    figure = asked.figures.get(asked.task.construction.figure_of(node))
    return figure.nodes[node].confidence if figure is not None and node in figure.nodes else 0.0


def _places(asked: _Asked, about: Sequence[CriterionDocument], node: str, figure: str) -> tuple[Choice, ...]:
    """Return the places where a node may lie: as read, as read otherwise, as expected; then none of these."""
    read = asked.figures[figure].nodes.get(node)
    touching = [one for one in about if node in {_vector(asked, one).tail, _vector(asked, one).head}]
    candidates = [] if read is None else [read.at]
    for place in _elsewhere(asked, touching, node, figure):
        if all(abs(place - one) > APART_MM for one in candidates):
            candidates.append(place)
    sure = _right_as_read(touching, read)
    likely = sorted(_shared(candidates[:MOST_PLACES], sure), key=lambda one: -one[1])
    starts = (
        (vector, found[0])
        for least in (asked.least, 0.0)
        for vector in (_vector(asked, one) for one in touching)
        if (found := _start(asked, vector, node, least)) is not None
    )
    vector, start = next(starts, (None, None))
    known: tuple[tuple[str, str], ...] = ()
    if vector is not None and start is not None:
        other = vector.tail if node == vector.head else vector.head
        if _sure(asked, other) < 1.0:
            # The stroke that is chosen has two ends.
            known = ((f"node:{figure}:{other}", place_text(*on_sheet(start))),)
    places = tuple(
        Choice(
            key,
            ((f"node:{figure}:{node}", place_text(*on_sheet(at))), *known),
            None if read is None else each,
            on_sheet(at),
            None if start is None else on_sheet(start),
            "" if vector is None else vector.name,
            is_tail=vector is not None and vector.tail == node,
        )
        for key, (at, each) in zip("abc", likely, strict=False)
    )
    optional = {one.id for one in asked.task.rubric.criterion if one.optional}
    missing = tuple((one.id, "not_judged" if one.id in optional else "none") for one in touching)
    is_stroke = read is not None and start is not None
    return (*places, Choice("neither", missing)) if len(places) > 1 or is_stroke else ()


def _joint(asked: _Asked, about: Sequence[CriterionDocument], node: str, figure: str) -> tuple[Choice, ...]:
    """Return the place where a joint was read; a person may put it elsewhere."""
    read = asked.figures[figure].nodes.get(node)
    if read is None:
        return ()
    at = on_sheet(read.at)
    here = Choice("a", ((f"node:{figure}:{node}", place_text(*at)),), read.confidence, at)
    return (here, Choice("neither", tuple((one.id, "none") for one in about)))


def _credit(about: Sequence[CriterionDocument]) -> tuple[Choice, ...]:
    """Return the choices if every vector at a node is right as read, however doubtful; else none.

    Wherever the node lies, the verdicts are the same: there is nothing to tell apart.
    """
    for one in about:
        is_off = OFF_AS_READ & set(one.reasons) and "counted_for_you" not in one.reasons
        if one.proposed not in CREDITED or is_off or one.probability == EVEN:
            return ()
    right = tuple((one.id, one.proposed or "full") for one in about)
    wrong = tuple((one.id, "none") for one in about)
    sure = min(one.probability or 0.0 for one in about)
    return (Choice("full", right, sure), Choice("none", wrong))


def _shared(places: Sequence[complex], sure: float) -> list[tuple[complex, float]]:
    """Return the places with their probabilities: `sure` of the first, the rest shared among the others."""
    rest = OTHERWISE * (1.0 - sure) / max(len(places) - 1, 1)
    return [(place, rest if index else sure) for index, place in enumerate(places)]


def _right_as_read(about: Sequence[CriterionDocument], read: ReadNode | None) -> float:
    """Return the probability that a node lies where it was read: that of its surest vector."""
    if read is None:
        return EVEN
    return max((one.confidence for one in about), default=read.confidence)


def _elsewhere(
    asked: _Asked, about: Sequence[CriterionDocument], node: str, figure: str
) -> Iterator[complex]:
    """Yield the places of a node by other readings of its vectors, then those expected of them."""
    starts = [(one, _start(asked, _vector(asked, one), node, asked.least)) for one in about]
    known = [(one, *start) for one, start in starts if start is not None]
    for criterion, start, sign in known:
        read = asked.figures[figure].vectors.get(criterion.vector or "")
        for other in () if read is None else read.others:
            yield start + sign * cmath.rect(other.length_mm, math.radians(other.direction_deg))
    for criterion, start, sign in known:
        along = along_of(criterion.expected)
        if along is not None:
            yield start + sign * along


def _start(asked: _Asked, vector: Vector, node: str, least: float) -> tuple[complex, float] | None:
    """Return the other end of one of a node's vectors, and the vector's sign from there.

    None if the confidence in that end is less than `least`.
    """
    other, sign = (vector.tail, 1.0) if node == vector.head else (vector.head, -1.0)
    figure = asked.figures[asked.task.construction.figure_of(other)]
    if other not in figure.nodes or _sure(asked, other) < least:
        return None
    return figure.nodes[other].at, sign


# What was read --------------------------------------------------------------------------------------


def reading_of(document: ReadingDocument) -> Reading:
    """Return the record of a document, with covariances that are equal in all directions."""
    return Reading({kind: figure_of(figure) for kind, figure in document.figures.items()})


def figure_of(document: FigureDocument) -> Figure:
    """Return the record of a figure's document."""
    nodes = {
        name: ReadNode(complex(node.x_mm, -node.y_mm), np.eye(2) * node.se_mm**2, node.confidence)
        for name, node in document.nodes.items()
    }
    vectors = {
        name: ReadVector(one.length_mm, one.se_mm, one.direction_deg, one.se_deg, one.confidence)
        for name, one in document.vectors.items()
    }
    drawn = {
        name: (complex(x, -y), complex(to_x, -to_y))
        for name, ((x, y), (to_x, to_y)) in document.drawn.items()
    }
    return Figure(nodes, vectors, drawn)


def figures_read(report: ReportDocument, pages: Sequence[ScannedPage]) -> dict[str, Figure]:
    """Return the figures of a report, with the other readings of each vector on its pages."""
    found: dict[str, Figure] = {}
    for document, page in zip(report.reading.sheets, pages, strict=False):
        for name, figure in reading_of(document).figures.items():
            first = page.reading.figures.get(name)
            others = {} if first is None else {key: one.others for key, one in first.vectors.items()}
            vectors = {key: replace(one, others=others.get(key, ())) for key, one in figure.vectors.items()}
            found.setdefault(name, replace(figure, vectors=vectors))
    return found
