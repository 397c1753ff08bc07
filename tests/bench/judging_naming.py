"""Find the mistakes that a fair judge should name, and check that those it names were made.

A mistake is *visible* if the drawing without it, by a perfect hand, differs in some observed vector by
more than 2.5 tolerances (or in a declared scale, or in a missing vector); below that it need not be
named, and naming it is no false accusation. With lengths alone only lengths count.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from grader.outcomes import NamedMistake as Named
from reference.construction.mistakes import Mistake
from samples.simulation.mistakes import CODES_OF_FORCES, StudentMistake
from tests.bench.judging_handed_in import CLEAR, Visible, off
from tests.bench.judging_students import (
    ALIKE_MM,
    ON_SHEETS,
    Asked,
    Source,
    StudentWork,
    is_same,
    meant,
    vectors_of,
)


@dataclass(frozen=True, slots=True)
class Made:
    """One mistake that was made, and its size in the vectors that are seen.

    `shows` is the largest deviation of the drawing without it, in tolerances; infinite if the mistake
    shows in another way (a declared scale, a missing vector).
    """

    mistake: StudentMistake
    shows: float

    @property
    def visible(self) -> bool:
        """True if it should be named."""
        return self.shows > CLEAR


def mistakes_due(work: StudentWork, source: Source, visible: Visible) -> list[Made]:
    """The mistakes made, in order of construction."""
    order = sorted(work.task.mistakes, key=lambda one: _place(work, one))
    return [Made(one, _shows(work, source, visible, one)) for one in order]


def _place(work: StudentWork, mistake: StudentMistake) -> int:
    """The index of the construction's step where a mistake is made; -1 for data and kL."""
    construction = work.construction
    nodes = [step.node for step in construction.steps]
    match mistake.code, mistake.at:
        case "other_variant", _:
            return -1
        case _, "kL":
            return -1
        case "vector_missing", name:
            return nodes.index(construction.vectors[name].head)
        case "labels_swapped", _:
            return min(nodes.index(node) for node in mistake.other)
        case code, _ if code in CODES_OF_FORCES:
            return min((nodes.index(node) for node in work.changed_by(mistake)), default=-1)
        case _, ("kv" | "ka") as scale:
            return nodes.index(construction.poles["velocity_plan" if scale == "kv" else "acceleration_plan"])
        case _, at if at in construction.poles:
            return nodes.index(construction.poles[at])
    return nodes.index(mistake.at)


def _shows(work: StudentWork, source: Source, visible: Visible, mistake: StudentMistake) -> float:
    if mistake.code == "vector_missing":
        needed = {one.name for one in work.rubric.criterion if not one.optional}
        return math.inf if source in ON_SHEETS and mistake.at in needed else 0.0
    if mistake.code == "rpm_not_converted":
        return math.inf if work.declares else 0.0
    if mistake.code == "scale_wrong" and not work.declares:
        return 0.0
    if mistake.code == "labels_swapped" and work.by_letters(source):
        return math.inf
    if mistake.code in CODES_OF_FORCES:
        # People draw polygons that nobody asks for, and err there.
        asked = {one.name for one in work.rubric.criterion}
        visible = Visible({name: how for name, how in visible.directed.items() if name in asked})
    rest = [one for one in work.task.mistakes if one is not mistake]
    return _most_apart(
        work, visible, as_handed_in(work, source, work.task.mistakes), _try(work, source, rest)
    )


def as_handed_in(
    work: StudentWork, source: Source, mistakes: Sequence[Mistake | StudentMistake]
) -> dict[str, complex]:
    """Vectors by a perfect hand with these mistakes in them, as this source gives them."""
    if work.by_letters(source):
        mistakes = [one for one in mistakes if one.code != "labels_swapped"]
    return vectors_of(work.task.right, mistakes)


def _try(
    work: StudentWork, source: Source, mistakes: Sequence[Mistake | StudentMistake]
) -> dict[str, complex]:
    """Return `as_handed_in`; empty if the mistakes cannot all be made."""
    try:
        return as_handed_in(work, source, mistakes)
    except (KeyError, ValueError):  # a plate's image by similarity has no normal components
        return {}


def _most_apart(
    work: StudentWork, visible: Visible, one: Mapping[str, complex], other: Mapping[str, complex]
) -> float:
    """The largest difference of two drawings in the vectors seen, in tolerances."""
    return max(
        (
            off(one[name], other[name], work.rubric.tolerance, directed=directed)
            for name, directed in visible.directed.items()
            if name in other
        ),
        default=0.0,
    )


def is_named(work: StudentWork, source: Source, visible: Visible, made: StudentMistake, named: Named) -> bool:
    """Return whether a report names this mistake, or one that gives the same drawing as seen."""
    if is_same(made, named):
        return True
    if made.code in CODES_OF_FORCES and made.code == named.code:
        vector = work.construction.vectors.get(named.at)
        is_there = vector is not None and vector.head in work.changed_by(made)
        return is_there or made.at.startswith(named.at)
    if {made.code, named.code} & {"vector_missing", "rpm_not_converted"}:
        return False
    asked = Asked(work.assignment, work.variant, work.task.right)
    really = as_handed_in(work, source, work.task.mistakes)
    for other in meant(asked, named):
        instead = [other if one is made else one for one in work.task.mistakes]
        if _is_alike(visible, really, _try(work, source, instead)):
            return True
    return False


def _is_alike(visible: Visible, one: Mapping[str, complex], other: Mapping[str, complex]) -> bool:
    apart = (
        abs(one[name] - other[name]) if directed else abs(abs(one[name]) - abs(other[name]))
        for name, directed in visible.directed.items()
        if name in other
    )
    return bool(other) and all(gap <= ALIKE_MM for gap in apart)


def first_of(made: Iterable[Made]) -> StudentMistake | None:
    """The first mistake that should be named."""
    return next((one.mistake for one in made if one.visible), None)
