"""Right triangles on the sketch as the source of normal components: they show which of the two is wrong."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from grader.comparison.criteria import Comparison
from grader.comparison.task import Task
from grader.outcomes import CHARGED, NamedMistake, Outcome
from grader.records import Altitude, Reading, Reason
from reference.construction.graph import Construction
from reference.construction.mistakes import RIGHT_TRIANGLE, SLIP, Mistake
from reference.construction.triangles import Triangle, triangles

LAID_OFF_MM = 0.5
"""Error of a velocity laid off at a joint; relatively, the foot has twice of it."""
CAUSES = frozenset({RIGHT_TRIANGLE, "triangle_wrong", "not_carried_over"})
"""Reasons that say why a length is wrong."""
HOLDS = 0.02
"""Largest error of kL ka / kv^2, as students round scales, at which a triangle gives the component at ka."""


def with_sources(
    task: Task, comparison: Comparison, readings: Sequence[Reading], outcomes: Sequence[Outcome]
) -> list[Outcome]:
    """Return the outcomes; a normal component that is wrong or unread with what its triangle shows of it."""
    drawn = {name: one for reading in reversed(readings) for name, one in reading.altitudes.items()}
    known = {one.vector.name: one for one in triangles(task.construction)} if drawn else {}
    return [
        replace(one, reasons=(*one.reasons[:1], *shown, *one.reasons[1:]))
        if one.name in drawn.keys() & known.keys()
        and (shown := [*_shown(task, comparison, one, known[one.name], drawn[one.name])])
        else one
        for one in outcomes
    ]


def with_causes(
    construction: Construction, outcomes: Sequence[Outcome], mistakes: Sequence[NamedMistake]
) -> tuple[NamedMistake, ...]:
    """Return the mistakes; a slip in a length gets its cause, if a triangle on the sketch shows it."""
    causes = {construction.vectors[one.name].head: code for one in outcomes for code in one.codes & CAUSES}
    return tuple(
        replace(one, mistake=Mistake(SLIP, one.at, other=(causes[one.at],)), rivals=())
        if one.code == SLIP and one.at in causes
        else one
        for one in mistakes
    )


def _shown(
    task: Task, comparison: Comparison, outcome: Outcome, triangle: Triangle, drawn: Altitude
) -> Iterator[Reason]:
    """Yield what a triangle shows of its component; nothing where that is in doubt."""
    used, nodes = comparison.scales, comparison.evidence.nodes
    holds = abs(used["kL"].used * used["ka"].used / used["kv"].used ** 2 - 1.0) <= HOLDS
    at, foot, read = {"at": triangle.joint}, drawn.foot_mm, outcome.measured.length_mm
    if read is None and holds and "unread" in outcome.codes:
        yield Reason("triangle_shows", {**at, "foot_mm": foot})
    if read is None or outcome.verdict not in CHARGED:
        return
    error = 2.0 * LAID_OFF_MM * foot / drawn.velocity_mm
    allowed = task.rubric.tolerance_of(outcome.name).length_at(read) + error
    is_source, is_other = abs(foot - read) <= allowed, abs(foot - read) > 2.0 * allowed
    is_off = outcome.codes & {"too_long", "too_short"}
    if is_source and "reversed" in outcome.codes:
        yield Reason("half_turn_missing", at)
    elif is_off and {*triangle.velocity, triangle.pin, triangle.joint} <= nodes.keys():
        tail, head, pin, joint = (nodes[name] for name in (*triangle.velocity, triangle.pin, triangle.joint))
        residual = abs(abs(head - tail) ** 2 / abs(joint - pin) - foot)
        if is_source and residual > 2.0 * allowed:
            yield Reason("triangle_wrong", at)
        elif is_source and residual <= allowed and not holds:
            yield Reason(RIGHT_TRIANGLE, at)
        elif is_other and residual <= allowed and holds:
            yield Reason("not_carried_over", {**at, "foot_mm": foot, "measured_mm": read})
