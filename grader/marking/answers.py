"""Evidence in people's verdicts: positions of doubtful nodes, and the scale that was used.

Only a verdict that waited is such an answer. One in the place of a verdict that was settled is a person's own
decision on points, and says nothing of the reading.
"""

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from grader.comparison.task import Task
from grader.documents import Quantity
from grader.outcomes import CREDITED, Judgement, Outcome
from grader.reading.orders import corners_of, ends_on_sheet
from grader.records import Figure, ReadNode, ScannedPage, on_sheet
from grader.tables.decisions import Decision

Places = dict[tuple[str, str], tuple[float, float]]
"""Places of nodes, mm on the sheet, y down, by figure and node."""

OFF_AS_READ = frozenset(
    {"too_long", "too_short", "turned_left", "turned_right", "reversed", "should_be_zero"}
)
"""Reasons of what is off as it was read."""
OF_READING = frozenset({"doubtful", "unread"})
"""Reasons of doubt that knowing where a node lies removes."""
NONE_DECIDED: Mapping[str, str] = {}


@dataclass(frozen=True, slots=True)
class Answers:
    """Facts known from verdicts; false if there are none.

    Attributes
    ----------
    places : where nodes lie
    verdicts : by vector, angular quantity or scale
    """

    places: Places = field(default_factory=dict)
    verdicts: Mapping[str, str] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.places or self.verdicts)


def answers_of(task: Task, own: Judgement, pages: Sequence[ScannedPage], rows: Sequence[Decision]) -> Answers:
    """Return what the verdicts in some rows say of reading and scales.

    Arguments: `own` is the program's judgement without them, on `pages`.
    """
    verdicts = {row.criterion: row.verdict for row in rows if row.kind == "verdict"}
    said = [(one, verdicts[one.criterion]) for one in own.outcomes if one.criterion in verdicts]
    waited = {one.name: verdict for one, verdict in said if _has_waited(own, one) and verdict != "not_judged"}
    moved = {row.node for row in rows if row.kind == "node"}
    places: Places = {}
    for outcome, verdict in said:
        for place in _places(task, outcome, verdict, pages):
            if place[0] not in moved:
                places.setdefault(*place)
    return Answers(places, waited)


def _has_waited(own: Judgement, outcome: Outcome) -> bool:
    """Return whether a verdict was open, or is on a scale that nobody declared."""
    scale = own.scales.get(outcome.name)
    return outcome.verdict == "review" or (scale is not None and scale.assumed)


# Nodes ----------------------------------------------------------------------------------------------


def _places(
    task: Task, outcome: Outcome, verdict: str, pages: Sequence[ScannedPage]
) -> Iterator[tuple[tuple[str, str], tuple[float, float]]]:
    """Yield the places of a vector's ends that the verdict on it implies."""
    vector = task.construction.vectors.get(outcome.name)
    codes = outcome.codes
    if vector is None or outcome.verdict != "review" or not codes & OF_READING or "counted_for_you" in codes:
        return
    name = task.construction.figure_of(vector.head)
    figure = next((page.reading.figures[name] for page in pages if name in page.reading.figures), None)
    if figure is None:
        return
    is_read = outcome.measured.length_mm is not None
    is_off = bool(codes & OFF_AS_READ) and "follows" not in codes
    if is_read and is_off != (verdict in CREDITED):
        at = ends_on_sheet(task.construction, name, figure)
        for node in corners_of(task.construction, name, figure).get(vector.name, ()):
            if node in at:
                yield (name, node), on_sheet(at[node])
    elif verdict == "full" and (is_off or not is_read) and not figure.drawn:
        end = end_in_doubt(figure, vector.tail, vector.head, task.rubric.least_confidence)
        along = along_of(outcome.expected)
        if end is not None and along is not None:
            node, other, sign = end
            yield (name, node), on_sheet(other.at + sign * along)


def end_in_doubt(figure: Figure, tail: str, head: str, least: float) -> tuple[str, ReadNode, float] | None:
    """The end of a vector that was not read for certain, the other end, and the sign from there.

    None where both are in doubt, or neither.
    """
    unsure = [
        name for name in (tail, head) if name not in figure.nodes or figure.nodes[name].confidence < least
    ]
    if len(unsure) != 1:
        return None
    (node,) = unsure
    return (node, figure.nodes[tail], 1.0) if node == head else (node, figure.nodes[head], -1.0)


def along_of(quantity: Quantity) -> complex | None:
    """A vector on its sheet, complex mm; None where its length or direction is not known."""
    length, direction = quantity.length_mm, quantity.direction_deg
    if length is None or direction is None:
        return 0j if length is not None and length < 1e-6 else None
    return cmath.rect(length, math.radians(direction))
