"""Components that a right image of a link's point replaces: by similar triangles they need not be drawn."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from grader.comparison.task import Task
from grader.comparison.verdicts import FULL
from grader.outcomes import Outcome
from grader.records import Reason
from reference.construction.elements import Line
from reference.construction.graph import Construction
from reference.construction.steps import Divide, Given, Similar, TwoLines

LEFT_OUT = frozenset({"not_measured", "not_drawn", "unread"})
"""Reasons why a vector was not judged: it was left out, or not found."""
CREDITED = frozenset({"full", "follow_through"})


def with_images(task: Task, outcomes: Mapping[str, Outcome]) -> dict[str, Outcome]:
    """The outcomes by criterion, with full marks for components that a right image replaces.

    None of the components of a point may be drawn, and the point's own vector must be right.
    """
    found = dict(outcomes)
    by_name = {one.name: key for key, one in outcomes.items()}
    for node in task.construction.images:
        replaced = [name for name in _replaced(task.construction, node) if name in by_name]
        own = [
            outcomes[by_name[vector.name]]
            for vector in task.construction.vectors.values()
            if vector.head == node and vector.name not in replaced and vector.name in by_name
        ]
        is_right = any(one.verdict in CREDITED and one.measured.length_mm is not None for one in own)
        if is_right and all(outcomes[by_name[name]].measured.length_mm is None for name in replaced):
            for name in replaced:
                found[by_name[name]] = _earned(outcomes[by_name[name]], own[0].name)
    return found


def _replaced(construction: Construction, node: str) -> Iterator[str]:
    """The components by which a point's image is made with perpendiculars, or which join it to its base."""
    step = construction.step(node)
    feet: set[str] = set()
    match step:
        case TwoLines(first=first, second=second):
            feet = {line.through for line in (first, second) if isinstance(line, Line)}
        case Similar(base=base) | Divide(base=base):
            feet = set(base)
    components = {foot for foot in feet if isinstance(construction.step(foot), Given)}
    poles = construction.poles.values()
    for vector in construction.vectors.values():
        is_component = vector.head in components and vector.part == "n"
        if is_component or (vector.head == node and vector.tail in feet and vector.tail not in poles):
            yield vector.name


def _earned(outcome: Outcome, of: str) -> Outcome:
    if outcome.verdict == "not_judged" or not LEFT_OUT & {reason.code for reason in outcome.reasons}:
        return outcome
    return replace(
        outcome,
        verdict="full",
        possible=("full", "full"),
        shares=(FULL, FULL),
        proposed=FULL,
        probability=1.0,
        confidence=1.0,
        reasons=(Reason("by_similarity", {"of": of}),),
    )
