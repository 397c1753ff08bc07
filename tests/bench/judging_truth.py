"""What a fair judge should find: the verdict due to each criterion.

Truth goes by intent, held against the student's own earlier nodes. Of each vector there are three
forms: as its step rightly makes it from the student's own nodes before it (*due*), as the mistaken
step makes it from the same nodes (*made*), and as it is in the exact plan at the scales that the
drawing follows (*exact*). They are compared by the rubric's plain tolerances, without any widening:

- *wrong*: made is off due by more than 2.5 tolerances. It is to be charged: ``none`` or ``partial``. Of
  several vectors that show one mistake where it was made, one is enough (`charged_once`).
- *right*, or *follows* where due is off the exact by more than 2.5 tolerances: made is within one
  tolerance of due. It is to be credited, as full or as following.
- *either*: between the two; what was wrongly made and came out nearly right; what follows from a mistake so
  far that next to nothing is left of it (the rubric's guard against trivial follow-through); the
  first vectors that show a mistake which no criterion shows where it was made.
- *missed*: rightly meant, and off by more than the plain tolerance by the hand alone. Either verdict is
  accepted, and counted apart: a wider tolerance where a construction is ill-conditioned credits it.

By code:

- `sense_reversed`, `normal_reversed`, `normal_missing`, `normal_from_absolute`, `arithmetic`,
  `parallel_for_perpendicular`, `wrong_link`, `wrong_intersection`, `image_mirrored`: the vectors that
  end in the node of the changed step, as above; what is drawn from it follows.
- `other_variant`: the crank as sketched, where the sketch is seen and asked for; else the driving link's
  first vector, held against the exact plan. Its other vectors are either (the same mistake again), all
  else is by the student's own nodes, where only data that differ (lengths, guides) make a step wrong.
  Where the driving link's speed differs too, a declared scale looks wrong instead: then either.
- `other_assembly`: the links of the joint that lies on the wrong side. Where no criterion asks for them,
  or no sketch is seen, either verdict for the vectors of the first node that shows it; the rest follows.
- `figure_rotated`: the driving link's vector of that plan; the rest is drawn rightly in the turned plan.
- `scale_wrong`: the criterion of the scale where one was declared, or in its place the driving link's
  vector; all else is right by the scale that it follows. Undeclared it may be the student's choice:
  either for the driving link's vector of that plan, and nothing that must be named.
- `rpm_not_converted`: velocities and scales are both too large, so the drawing is right: the declared
  kv is wrong, ka either (the same mistake again). Undeclared, nothing shows.
- `vector_missing`: nothing to judge; to credit it in full is wrong where it is not optional.
- angular quantities, computed from the own drawing (`tests.bench.judging_handed_in`): right or following,
  whatever was drawn; either where what was handed in does not tell the sense. A *slip* in computing one
  value is wrong there and nowhere else.
- `labels_swapped`: the vectors that begin or end in the two nodes, as named against as they should be;
  either where they follow from the nodes as named, and where the letters themselves are told beside
  nodes named by their lines.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from grader.rubric import CriterionTable
from reference.construction.elements import Scaled, View
from reference.construction.graph import Construction, Vector, ancestors, evaluate
from reference.construction.steps import ArcAndLine, Given, Pivot, TwoArcs
from reference.geometry import ComplexArray
from samples.simulation.mistakes import Intent, StudentMistake, with_mistake
from tests.bench.judging_handed_in import CLEAR, PLAIN, Due, Visible, computed, off, rate_due
from tests.bench.judging_students import ON_SHEETS, SCALES, Source, StudentWork

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
    exact, declared : by the exact plan, at the scales that the drawing follows, and at those declared
    """

    named: complex
    drawn: complex
    due: complex
    due_as_named: complex
    made: complex
    exact: complex
    declared: complex


def ends_of(construction: Construction) -> dict[str, Ends]:
    """Tail and head of every vector, and of every link of the sketch, by name."""
    vectors = {name: (one.tail, one.head) for name, one in construction.vectors.items()}
    return {**vectors, **construction.links}


def is_driven(construction: Construction, node: str) -> bool:
    """Whether a node of a plan is laid off from the data alone: the driving link's."""
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

    work: StudentWork
    source: Source
    right: Intent
    following: Intent

    @classmethod
    def of(cls, work: StudentWork, source: Source) -> "Held":
        """At the scales that the drawing follows; what follows is turned where its plan is turned."""
        right = _at_scales_followed(work.task.right, work.task.mistakes)
        following = right
        for mistake in work.task.mistakes:
            if mistake.code == "figure_rotated":
                following = with_mistake(following, mistake)
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
        """Every vector. Another student's data are charged at the driving link unless they are already."""
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
        declared = evaluate(construction, self.work.task.right.parameters)
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
                declared=complex(declared[head] - declared[tail]),
            )
        return forms


def _at_scales_followed(right: Intent, mistakes: Sequence[StudentMistake]) -> Intent:
    """The right drawing at the scales that the student's follows.

    Of rev/min taken for rad/s the drawing knows nothing: its speeds and its scales are both too large.
    """
    for mistake in mistakes:
        if mistake.code == "scale_wrong" and mistake.at in SCALES:
            right = with_mistake(right, mistake)
    return right


def _head(drawing: Intent, own: Mapping[str, complex], head: str) -> complex:
    """A node as a drawing makes it from the student's own nodes before it."""
    nodes = {name: np.asarray(place) for name, place in own.items()}
    with np.errstate(invalid="ignore", divide="ignore"):
        return complex(drawing.construction.step(head).place(View(nodes, drawing.parameters)))


def verdicts_due(work: StudentWork, source: Source, visible: Visible) -> dict[str, Due]:
    """What is due to each criterion of the rubric, by its id."""
    held = Held.of(work, source)
    drawn = _Drawn(work, source, visible)
    drawn.judge(held.links())
    data_charged = any(drawn.due.get(name) == "wrong" for name in cranks_of(work.construction))
    drawn.judge(held.vectors(data_charged=data_charged), data_charged=data_charged)
    for mistake in work.task.mistakes:
        drawn.open_first_shown(mistake)
    handed_in, found = computed(work), {}
    for criterion in work.rubric.criterion:
        if criterion.scale:
            found[criterion.id] = _scale_due(work, source, criterion.name, drawn.due)
        elif criterion.name == handed_in.slip:
            found[criterion.id] = "wrong"
        elif criterion.angular:
            found[criterion.id] = rate_due(work, source, criterion, handed_in, visible)
        else:
            found[criterion.id] = drawn.due.get(criterion.name, "absent")
    return found


def charged_once(work: StudentWork, due: Mapping[str, Due], said: Mapping[str, str]) -> dict[str, Due]:
    """The verdicts due, where a mistake is charged at one of several criteria that show it.

    A wrong line moves its node, and all vectors that end there; letters exchanged touch several vectors: one
    of them pays. A plan at a wrong scale is as well charged at the driving link's vector, from which the rest
    follows.

    Arguments: `said` is the judge's verdict by criterion.
    """
    found, vectors, ends = dict(due), work.construction.vectors, ends_of(work.construction)
    for mistake in work.task.mistakes:
        nodes = set(mistake.other) if mistake.code == "labels_swapped" else {mistake.at}
        shown = [
            one.id
            for one in work.rubric.criterion
            if one.name in vectors
            and due[one.id] == "wrong"
            and nodes & (set(ends[one.name]) if mistake.code == "labels_swapped" else {ends[one.name][1]})
        ]
        paying = [name for name in shown if said[name] in {"none", "partial"}]
        if paying:
            found.update(dict.fromkeys(set(shown) - set(paying), "either"))
    for scale in (one for one in work.rubric.criterion if one.scale and due[one.id] == "wrong"):
        first = [
            one.id
            for one in work.rubric.criterion
            if (vector := vectors.get(one.name)) is not None
            and vector.scale == scale.scale
            and is_driven(work.construction, vector.head)
        ]
        if said[scale.id] == "full" and any(said[name] in {"none", "partial"} for name in first):
            found.update(dict.fromkeys([scale.id, *first], "either"))
    return found


def _scale_due(work: StudentWork, source: Source, name: str, by_vector: Mapping[str, Due]) -> Due:
    """Of a declared scale; missed where the hand was off in what the scale is told by."""
    if not work.declares:
        return "absent"
    codes = {one.code for one in work.task.mistakes}
    if "rpm_not_converted" in codes and name in {"kv", "ka"}:
        return "wrong" if name == "kv" else "either"
    if any(one.code == "scale_wrong" and one.at == name for one in work.task.mistakes):
        return "wrong"
    if name in _scales_of_another(work):
        return "either"
    vectors = work.construction.vectors
    tells = {one for one in by_vector if one in vectors and is_driven(work.construction, vectors[one].head)}
    misses = any(vectors[one].scale == name and by_vector[one] == "missed" for one in tells)
    is_sketch = name == "kL" and source in ON_SHEETS
    return "missed" if misses or (is_sketch and _is_yardstick_off(work)) else "right"


def _is_yardstick_off(work: StudentWork) -> bool:
    """Whether the crank, or the first link where a slider drives, is off on one of the sketches."""
    right = evaluate(work.construction, work.task.right.parameters)
    tail, head = _yardstick(work.construction)
    sketches = [figure.nodes for sheet in work.sheets for figure in sheet.figures if tail in figure.nodes]
    return any(
        off(one[head] - one[tail], complex(right[head] - right[tail]), work.rubric.tolerance, directed=False)
        > PLAIN
        for one in sketches
    )


def _yardstick(construction: Construction) -> tuple[str, str]:
    """The joints between which the scale of lengths is read off."""
    for step in construction.figures["mechanism"]:
        match step:
            case Given(start=start, node=node):
                return start, node
            case TwoArcs(centres=(start, _), node=node) | ArcAndLine(centre=start, node=node):
                return start, node
    raise ValueError("no link of given length")


def _between(nodes: Mapping[str, ComplexArray], vector: Vector) -> complex:
    return complex(nodes[vector.head]) - complex(nodes[vector.tail])


def _scales_of_another(work: StudentWork) -> set[str]:
    """Scales at which another student's driving link looks as if only the scale was wrong."""
    if not any(one.code == "other_variant" for one in work.task.mistakes):
        return set()
    right, tolerance = work.task.right, work.rubric.tolerance
    exact, meant = (evaluate(one.construction, one.parameters) for one in (right, work.task.wrong))
    return {
        vector.scale
        for vector in right.construction.vectors.values()
        if is_driven(right.construction, vector.head)
        and off(_between(meant, vector), _between(exact, vector), tolerance, directed=False) > PLAIN
    }


@dataclass(frozen=True, slots=True)
class _Drawn:
    """What is due to each vector and link that was drawn, and how far it is moved from the exact one.

    Attributes
    ----------
    due, moved : by name; `moved` in tolerances
    """

    work: StudentWork
    source: Source
    visible: Visible
    due: dict[str, Due] = field(default_factory=dict)
    moved: dict[str, float] = field(default_factory=dict)

    def judge(self, forms: Mapping[str, tuple[Forms, ...]], *, data_charged: bool = False) -> None:
        """Every criterion of these names; two sketches of which only one is missed by hand are missed."""
        for criterion in self.work.rubric.criterion:
            name = criterion.name
            if name not in forms or name not in self.visible.directed:
                continue
            verdicts = {self._due(criterion, one, data_charged=data_charged) for one in forms[name]}
            by_hand: Due = "missed" if verdicts <= {"right", "follows", "missed"} else "either"
            self.due[name] = verdicts.pop() if len(verdicts) == 1 else by_hand
            self.moved[name] = max(self._off(criterion, one.due, one.declared) for one in forms[name])

    def _off(self, criterion: CriterionTable, one: complex, other: complex) -> float:
        directed = self.visible.directed[criterion.name] and criterion.direction
        return off(one, other, self.work.rubric.tolerance_of(criterion), directed=directed)

    def _due(self, criterion: CriterionTable, forms: Forms, *, data_charged: bool) -> Due:
        tolerance, name = self.work.rubric.tolerance_of(criterion), criterion.name

        def apart(one: complex, other: complex) -> float:
            return self._off(criterion, one, other)

        if _touches_swap(self.work, name):
            if self.work.by_letters(self.source):
                return "either"
            nearest = min(apart(forms.named, forms.due), apart(forms.named, forms.exact))
            if apart(forms.named, forms.due_as_named) <= CLEAR and nearest > PLAIN:
                return "either"
            return "wrong" if nearest > CLEAR else "right" if nearest < PLAIN else "either"
        changed = apart(forms.made, forms.due)
        by_hand = min(apart(forms.drawn, one) for one in (forms.due, forms.exact, forms.declared))
        if changed > CLEAR:
            is_open = by_hand <= CLEAR or _is_charged_before(self.work, name, data_charged=data_charged)
            return "either" if is_open else "wrong"
        if changed > PLAIN or _is_scale_unknown(self.work, name):
            return "either"
        if by_hand > PLAIN:
            return "missed"
        moved = apart(forms.due, forms.declared)
        least = max(tolerance.least_mm, self.work.rubric.least_followed_share * abs(forms.declared))
        if moved > PLAIN and abs(forms.due) < least:
            return "either"
        return "follows" if moved > CLEAR else "right"

    def open_first_shown(self, mistake: StudentMistake) -> None:
        """Where a mistake does not show at its own node: either verdict up to the first that shows it."""
        construction = self.work.construction
        node = _node_of(construction, mistake)
        if node is None or self._shows_where_made(mistake, node):
            return
        ends = ends_of(construction)
        plan = construction.figures[mistake.at] if mistake.code == "figure_rotated" else ()
        for step in construction.steps:
            hangs_on_it = step in plan or node in ancestors(construction, [step.node])
            if step.node == node or not hangs_on_it:
                continue
            here = [name for name in self.due if ends[name][1] == step.node and self.moved[name] > PLAIN]
            open_ones = [name for name in here if self.due[name] in {"right", "follows"}]
            self.due.update(dict.fromkeys(open_ones, "either"))
            if any(self.moved[name] > CLEAR for name in here):
                return

    def _shows_where_made(self, mistake: StudentMistake, node: str) -> bool:
        """Whether it is charged at its own node; another student's data at the driving link's vectors."""
        ends = ends_of(self.work.construction)
        if any(one == "wrong" and ends[name][1] == node for name, one in self.due.items()):
            return True
        driven = {name for name in self.due if is_driven(self.work.construction, ends[name][1])}
        of_another = mistake.code == "other_variant"
        return of_another and any(self.due[name] in {"wrong", "either"} for name in driven)


def _touches_swap(work: StudentWork, name: str) -> bool:
    return any(set(ends_of(work.construction)[name]) & set(pair) for pair in work.swaps())


def _is_charged_before(work: StudentWork, name: str, *, data_charged: bool) -> bool:
    """Of another student's data: charged at the crank, the driving link's first vector, or at its scale."""
    vectors = work.construction.vectors
    of_another = any(one.code == "other_variant" for one in work.task.mistakes)
    if not of_another or name not in vectors or not is_driven(work.construction, vectors[name].head):
        return False
    first = next(one for one in vectors.values() if is_driven(work.construction, one.head))
    by_scale = work.declares and vectors[name].scale in _scales_of_another(work)
    return data_charged or vectors[name].head != first.head or by_scale


def _is_scale_unknown(work: StudentWork, name: str) -> bool:
    """The driving link's vector, drawn at a scale that nobody declared and the rule does not give."""
    wrong = {one.at for one in work.task.mistakes if one.code == "scale_wrong"}
    vector = work.construction.vectors.get(name)
    if vector is None or work.declares or vector.scale not in wrong:
        return False
    return is_driven(work.construction, vector.head)


def _node_of(construction: Construction, mistake: StudentMistake) -> str | None:
    """The node at which a mistake is made; None for scales, letters and what is not drawn."""
    if mistake.code in {"rpm_not_converted", "labels_swapped", "vector_missing"}:
        return None
    if mistake.code == "scale_wrong" and mistake.at in SCALES:
        return None
    if mistake.code == "other_variant":
        return next(s.node for s in construction.figures["mechanism"] if not isinstance(s, Pivot))
    if mistake.at in construction.poles:
        return next(s.node for s in construction.figures[mistake.at] if isinstance(s, Given))
    return mistake.at
