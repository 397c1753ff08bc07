"""Letters exchanged in a plan: the drawing is judged under the right letters, the exchange charged once.

Where letters were read at each other's node without certainty, a person decides the vector that would pay.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from grader.comparison.evidence import Submission
from grader.comparison.outcomes import left_open, verdict_of
from grader.comparison.task import Task
from grader.comparison.verdicts import FULL, NONE, OPENING
from grader.marking.settling import settled
from grader.outcomes import CREDITED, NamedMistake, Outcome
from grader.records import Figure, Reading, ReadNode, ReadVector, Reason
from reference.construction.graph import Vector
from reference.construction.mistakes import Mistake

CERTAIN = 0.9
"""From this confidence on lines are judged under the right letters; below it each vector as it is named."""
Pair = tuple[str, str]


def exchanged_pair(mistakes: Sequence[NamedMistake]) -> Pair | None:
    """The two nodes whose letters were certainly exchanged, in a drawing named by letters; else None."""
    for one in mistakes:
        if one.code == "labels_swapped" and one.confidence >= CERTAIN:
            return one.mistake.other[0], one.mistake.other[1]
    return None


def with_letters_exchanged(
    task: Task, submission: Submission, pair: Pair, scales: Mapping[str, float]
) -> Submission:
    """The submission as it is with these two letters at each other's node.

    Arguments: `scales` are those used, real units per drawn millimetre.
    """
    measured, exact = submission.measured, task.nodes(scales)
    return replace(
        submission,
        readings=tuple(_reading(task, one, pair, exact) for one in submission.readings),
        measured=None if measured is None else _reading(task, measured, pair, exact),
    )


def with_turned(submission: Submission, turned: str) -> Submission:
    """The submission with the arrow of one vector at its other end, as entered and as read."""

    def changed(reading: Reading) -> Reading:
        figures = {
            plan: replace(
                one, vectors={name: _reversed(v) if name == turned else v for name, v in one.vectors.items()}
            )
            for plan, one in reading.figures.items()
        }
        return replace(reading, figures=figures)

    measured = submission.measured and changed(submission.measured)
    return replace(submission, readings=tuple(map(changed, submission.readings)), measured=measured)


def _reading(task: Task, reading: Reading, pair: Pair, exact: Mapping[str, complex]) -> Reading:
    plan = task.construction.figure_of(pair[0])
    if plan not in reading.figures:
        return reading
    figure, other = reading.figures[plan], {pair[0]: pair[1], pair[1]: pair[0]}
    nodes = {other.get(name, name): node for name, node in figure.nodes.items()}
    vectors = dict(figure.vectors)
    for vector in task.construction.vectors_of(plan):
        if {vector.tail, vector.head} & set(pair):
            vectors.pop(vector.name, None)
            ends = (other.get(vector.tail, vector.tail), other.get(vector.head, vector.head))
            found = _renamed(task, vector, figure, nodes, ends) or _by_its_length(
                task, vector, ends, figure, exact
            )
            if found is not None:
                vectors[vector.name] = found
    return replace(reading, figures={**reading.figures, plan: Figure(nodes, vectors)})


def _renamed(
    task: Task, vector: Vector, figure: Figure, nodes: Mapping[str, ReadNode], ends: Pair
) -> ReadVector | None:
    """A vector under its right letters: as entered between the wrong ones, else between its nodes."""
    for one in task.construction.vectors_of(task.construction.figure_of(vector.head)):
        entered = figure.vectors.get(one.name)
        if entered is not None and {one.tail, one.head} == set(ends) and one.part == vector.part:
            return entered if one.tail == ends[0] else _reversed(entered)
    if vector.tail in nodes and vector.head in nodes and vector.name in figure.vectors:
        return nodes[vector.tail].vector_to(nodes[vector.head])
    return None


def _reversed(entered: ReadVector) -> ReadVector:
    turn = None if entered.direction_deg is None else (entered.direction_deg + 180.0) % 360.0
    return replace(entered, direction_deg=turn, others=())


def _by_its_length(
    task: Task, vector: Vector, ends: Pair, figure: Figure, exact: Mapping[str, complex]
) -> ReadVector | None:
    """The exact length, where the entry is the exact length between the wrong letters; else the entry."""
    entered = figure.vectors.get(vector.name)
    if entered is None or entered.length_mm is None:
        return entered
    right, wrong = exact[vector.head] - exact[vector.tail], exact[ends[1]] - exact[ends[0]]
    allowed = 2.0 * task.rubric.tolerance_of(vector.name).length_at(abs(wrong))
    if abs(entered.length_mm - abs(wrong)) > allowed:
        return entered
    return replace(entered, length_mm=abs(right), direction_deg=None, se_deg=None)


def letters_charged(
    task: Task,
    outcomes: Sequence[Outcome],
    mistakes: Sequence[NamedMistake],
    read: Sequence[NamedMistake],
    as_lettered: Callable[[Pair], Sequence[Outcome]],
) -> tuple[Outcome, ...]:
    """Return the outcomes with one vector charged for each certain exchange of letters, and its reason.

    Arguments: `as_lettered` gives the outcomes under the letters as they stand; the charged one is of these.
    `read` are the exchanges of letters that were read beside nodes named by their lines: an uncertain one
    opens the vector that it would charge.
    """
    found = list(outcomes)
    for one in mistakes:
        is_certain = one.confidence >= CERTAIN
        if one.code == "labels_swapped" and (is_certain or one in read):
            first, second = one.mistake.other
            code = "letters_exchanged" if is_certain else "letters_unclear"
            reason = Reason(code, {"first": first, "second": second})
            touched = [place for place in _in_order(task, found) if _touches(task, found[place], one.mistake)]
            paying = [place for place in touched if found[place].verdict in CREDITED]
            lettered = as_lettered((first, second)) if paying else ()
            shown = [place for place in paying if lettered[place].verdict not in CREDITED]
            for place in touched if is_certain else ():
                found[place] = replace(found[place], reasons=(reason, *found[place].reasons))
            for place in (shown or paying)[:1]:
                if not is_certain:
                    found[place] = _open(lettered[place], found[place], one.confidence, reason)
                    continue
                lost = settled(lettered[place], NONE, one.confidence)
                reasons = tuple(other for other in lost.reasons if other.code != "right") or (reason,)
                found[place] = replace(lost, reasons=reasons, mistake=one.code, cause=one)
    return tuple(found)


def _open(lettered: Outcome, named: Outcome, probability: float, reason: Reason) -> Outcome:
    """A vector that pays with this probability, shown as lettered; else it is worth what its lines say."""
    share = named.shares[-1]
    reasons = (reason, *(other for other in lettered.reasons if other.code not in {"right", *OPENING}))
    best = verdict_of(share, followed=named.verdict == "follow_through")
    opened = left_open(lettered, best, share, reasons, probability)
    return replace(opened, proposed=NONE, mistake=None, cause=None)


def _in_order(task: Task, outcomes: Sequence[Outcome]) -> Iterator[int]:
    """The places of vectors' outcomes in the order of construction."""
    order = list(task.construction.vectors)
    vectors = [place for place, one in enumerate(outcomes) if one.name in task.construction.vectors]
    yield from sorted(vectors, key=lambda place: order.index(outcomes[place].name))


def _touches(task: Task, outcome: Outcome, mistake: Mistake) -> bool:
    vector = task.construction.vectors[outcome.name]
    is_judged = outcome.measured.length_mm is not None and outcome.shares[-1:] == (FULL,)
    return is_judged and bool({vector.tail, vector.head} & set(mistake.other))
