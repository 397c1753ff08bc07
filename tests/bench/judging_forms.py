"""Every vector and link of one student in all the forms that it is held against."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reference.construction.elements import Scaled, View
from reference.construction.graph import Construction, evaluate
from reference.construction.mistakes import Drawing, Mistake, commit
from reference.construction.steps import Given
from tests.bench.judging_redrawn import SCALES
from tests.bench.judging_students import Source, Work

Ends = tuple[str, str]
"""Tail and head."""


@dataclass(frozen=True, slots=True)
class Forms:
    """A vector or link in all its forms, complex mm.

    Attributes
    ----------
    named : as it is handed in, under the names that stand beside its ends
    drawn : as the hand drew it
    due : as its step rightly makes it from the student's own nodes before it
    due_as_named : the same from the nodes under the names that stand beside them
    made : as the mistaken step makes it from the same nodes
    exact, told : by the exact plan, at the scales that the drawing follows, and at those it is meant to
    """

    named: complex
    drawn: complex
    due: complex
    due_as_named: complex
    made: complex
    exact: complex
    told: complex


def ends_of(construction: Construction) -> dict[str, Ends]:
    """Tail and head of every vector, and of every link of the sketch, by name."""
    vectors = {name: (one.tail, one.head) for name, one in construction.vectors.items()}
    return {**vectors, **construction.links}


def is_driven(construction: Construction, node: str) -> bool:
    """Whether a node of a plan is laid off from the data alone: the driven link's."""
    step = construction.step(node)
    is_of_plan = node not in {one.node for one in construction.figures["mechanism"]}
    return is_of_plan and isinstance(step, Given) and isinstance(step.length, Scaled)


def cranks_of(construction: Construction) -> set[str]:
    """Links that the data alone give: the crank."""
    made = {step.node for step in construction.figures["mechanism"] if isinstance(step, Given)}
    return {name for name, (_, head) in construction.links.items() if head in made}


@dataclass(frozen=True, slots=True)
class Held:
    """One student's drawing beside the ones that it is held against."""

    work: Work
    source: Source
    right: Drawing
    following: Drawing

    @classmethod
    def of(cls, work: Work, source: Source) -> "Held":
        """At the scales that the drawing follows; what follows is turned where its plan is turned."""
        right = _at_scales_followed(work.task.right, work.task.mistakes)
        following = right
        for mistake in work.task.mistakes:
            if mistake.code == "figure_rotated":
                following = commit(mistake, following)
        return cls(work, source, right, following)

    def links(self) -> dict[str, tuple[Forms, ...]]:
        """Every link, as often as the sketch was drawn."""
        sketches = [
            figure.nodes
            for sheet in self.work.sheets
            for figure in sheet.figures
            if figure.name == "mechanism"
        ]
        found = [self._forms(self.right.construction.links, dict(nodes), of_data=False) for nodes in sketches]
        return {name: tuple(one[name] for one in found) for name in self.right.construction.links}

    def vectors(self, *, data_charged: bool) -> dict[str, tuple[Forms, ...]]:
        """Every vector. Another student's data are charged at the driven link unless they are already."""
        of_another = any(one.code == "other_variant" for one in self.work.task.mistakes)
        found: dict[str, tuple[Forms, ...]] = {}
        for figure in self.right.construction.poles:
            ends = {one.name: (one.tail, one.head) for one in self.right.construction.vectors_of(figure)}
            forms = self._forms(ends, self.work.own(figure), of_data=of_another and not data_charged)
            found.update({name: (one,) for name, one in forms.items()})
        return found

    def _forms(
        self, ends: Mapping[str, Ends], own: Mapping[str, complex], *, of_data: bool
    ) -> dict[str, Forms]:
        construction = self.right.construction
        exact = evaluate(construction, self.right.parameters)
        told = evaluate(construction, self.work.task.right.parameters)
        named = self.work.named(own, self.source)
        heads = {head for _, head in ends.values()}
        driven = {head for head in heads if is_driven(construction, head)}
        due_at = {head: _head(self.right if head in driven else self.following, own, head) for head in heads}
        named_at = due_at if named == own else {head: _head(self.following, named, head) for head in heads}
        made_at = {head: _head(self.work.task.wrong, own, head) for head in heads}
        forms = {}
        for name, (tail, head) in ends.items():
            exactly = complex(exact[head] - exact[tail])
            forms[name] = Forms(
                named=named[head] - named[tail],
                drawn=own[head] - own[tail],
                due=exactly if of_data and head in driven else due_at[head] - own[tail],
                due_as_named=named_at[head] - named[tail],
                made=made_at[head] - own[tail],
                exact=exactly,
                told=complex(told[head] - told[tail]),
            )
        return forms


def _at_scales_followed(right: Drawing, mistakes: Sequence[Mistake]) -> Drawing:
    """The right drawing at the scales that the student's follows.

    Of rev/min taken for rad/s the drawing knows nothing: its speeds and its scales are both too large.
    """
    for mistake in mistakes:
        if mistake.code == "scale_wrong" and mistake.at in SCALES:
            right = commit(mistake, right)
    return right


def _head(drawing: Drawing, own: Mapping[str, complex], head: str) -> complex:
    """A node as a drawing makes it from the student's own nodes before it."""
    nodes = {name: np.asarray(place) for name, place in own.items()}
    with np.errstate(invalid="ignore", divide="ignore"):
        return complex(drawing.construction.step(head).place(View(nodes, drawing.parameters)))
