"""The verdicts that a fair judge should give: one for each criterion.

The truth follows from the intent and the student's own earlier nodes. Each vector has three forms:
as its right step makes it from the student's own earlier nodes (*due*), as the mistaken step makes
it from the same nodes (*made*), and as it is in the exact plan at the scales that the drawing
follows (*exact*). They are compared by the rubric's plain tolerances, without any widening:

- *wrong*: made differs from due by more than 2.5 tolerances. It must be charged: ``none`` or ``partial``.
  If several vectors show one mistake where it was made, one charge is enough (`charged_once`).
- *right*: made is within one tolerance of due; *follows*: the same, and due differs from exact by more
  than 2.5 tolerances. It must be credited, as full or as following.
- *either*: between the two; a wrong step that came out nearly right; a vector of which a mistake leaves
  next to nothing (the rubric's guard against trivial follow-through); the first vectors that show a
  mistake which no criterion shows where it was made.
- *missed*: rightly meant, but drafting errors alone exceed the plain tolerance. Either verdict is accepted,
  and counted separately: a wider tolerance where a construction is ill-conditioned credits it.

By code:

- `sense_reversed`, `normal_reversed`, `normal_missing`, `normal_from_absolute`, `arithmetic`,
  `parallel_for_perpendicular`, `wrong_link`, `wrong_intersection`, `image_mirrored`: the vectors that
  end in the node of the changed step, as above; everything drawn from it follows.
- `other_variant`: the crank as sketched, if the sketch is seen and asked for; else the driving link's
  first vector, compared with the exact plan. Its other vectors are either (the same mistake again); the
  rest is judged by the student's own nodes, so only data that differ (lengths, guides) make a step wrong.
  If the driving link's speed differs too, a declared scale looks wrong instead: then either.
- `other_assembly`: the links of the joint that lies on the wrong side. If no criterion asks for them,
  or no sketch is seen, either verdict for the vectors of the first node that shows it; the rest follows.
- `figure_rotated`: the driving link's vector of that plan; the rest is drawn rightly in the turned plan.
- `scale_wrong`: the criterion of the scale if one was declared, or instead the driving link's vector; all
  else is right by the scale that it follows. An undeclared scale may be the student's choice: either
  for the driving link's vector of that plan, and no mistake must be named.
- `rpm_not_converted`: velocities and scales are both too large, so the drawing is right: the declared
  kv is wrong, ka either (the same mistake again). Undeclared, nothing shows.
- `vector_missing`: nothing to judge; crediting it in full is wrong unless it is optional.
- mistakes in forces: the vectors that end in nodes that are laid off otherwise, as above. A couple or an arm
  changes only parts across links; a force its own side, and those parts: one mistake.
- angular quantities, computed from the student's own drawing (`tests.bench.judging_handed_in`): right or
  following, whatever was drawn; either if the submission does not show the sense. A *slip* in computing
  one value is wrong there and nowhere else.
- `labels_swapped`: the vectors that begin or end in the two nodes, as named compared with as they should
  be; either if they follow from the nodes as named, or if the letters are handed in separately, with
  nodes named by their lines.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from grader.rubric import CriterionTable
from reference.construction.elements import Scaled, View
from reference.construction.graph import Construction, Vector, ancestors, evaluate
from reference.construction.steps import ArcAndLine, Given, Pivot, TwoArcs
from reference.geometry import ComplexArray
from samples.simulation.mistakes import CODES_OF_FORCES, Intent, StudentMistake, with_mistake
from tests.bench.judging_handed_in import CLEAR, PLAIN, Due, Visible, computed, off, rate_due
from tests.bench.judging_students import ON_SHEETS, SCALES, Source, StudentWork

Ends = tuple[str, str]
"""Tail and head."""


@dataclass(frozen=True, slots=True)
class Forms:
    """A vector or link in all its forms, complex mm.

    Attributes
    ----------
    named : as handed in, by the letters written beside its ends
    drawn : as the hand drew it
    due : as its right step makes it from the student's own earlier nodes
    due_as_named : the same from the nodes by the letters written beside them
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


def is_driving(construction: Construction, node: str) -> bool:
    """Return whether a node of a plan is laid off from the data alone: the driving link's."""
    step = construction.step(node)
    is_of_plan = node not in {one.node for one in construction.figures["mechanism"]}
    return is_of_plan and isinstance(step, Given) and isinstance(step.length, Scaled)


def cranks_of(construction: Construction) -> set[str]:
    """Links given by the data alone: the crank."""
    made = {step.node for step in construction.figures["mechanism"] if isinstance(step, Given)}
    return {name for name, (_, head) in construction.links.items() if head in made}


@dataclass(frozen=True, slots=True)
class Held:
    """One student's drawing, and the right ones that it is compared with."""

    work: StudentWork
    source: Source
    right: Intent
    following: Intent

    @classmethod
    def of(cls, work: StudentWork, source: Source) -> "Held":
        """Make them at the scales that the drawing follows; a turned plan stays turned."""
        right = _at_scales_followed(work.task.right, work.task.mistakes)
        following = right
        for mistake in work.task.mistakes:
            if mistake.code == "figure_rotated":
                following = with_mistake(following, mistake)
        return cls(work, source, right, following)

    def links(self) -> dict[str, tuple[Forms, ...]]:
        """Every link, once for each sketch drawn."""
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
        driving = {head for head in heads if is_driving(construction, head)}
        due_at = {head: _head(self.right if head in driving else self.following, own, head) for head in heads}
        named_at = due_at if named == own else {head: _head(self.following, named, head) for head in heads}
        made_at = {head: _head(self.work.task.wrong, own, head) for head in heads}
        forms = {}
        for name, (tail, head) in ends.items():
            exactly = complex(exact[head] - exact[tail])
            forms[name] = Forms(
                named=named[head] - named[tail],
                drawn=own[head] - own[tail],
                due=exactly if of_data and head in driving else due_at[head] - own[tail],
                due_as_named=named_at[head] - named[tail],
                made=made_at[head] - own[tail],
                exact=exactly,
                declared=complex(declared[head] - declared[tail]),
            )
        return forms


def _at_scales_followed(right: Intent, mistakes: Sequence[StudentMistake]) -> Intent:
    """The right drawing at the scales that the student's drawing follows.

    Rev/min mistaken for rad/s do not change the drawing: its speeds and its scales are both too large.
    """
    for mistake in mistakes:
        if mistake.code == "scale_wrong" and mistake.at in SCALES:
            right = with_mistake(right, mistake)
    return right


def _head(drawing: Intent, own: Mapping[str, complex], head: str) -> complex:
    """A node as a drawing makes it from the student's own earlier nodes."""
    nodes = {name: np.asarray(place) for name, place in own.items()}
    with np.errstate(invalid="ignore", divide="ignore"):
        return complex(drawing.construction.step(head).place(View(nodes, drawing.parameters)))


def verdicts_due(work: StudentWork, source: Source, visible: Visible) -> dict[str, Due]:
    """The verdict due to each criterion of the rubric, by its id."""
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
    """The verdicts due, with each mistake charged at only one of the criteria that show it.

    A wrong line moves its node, and all vectors that end there; exchanged letters affect several vectors: one
    is charged. A plan at a wrong scale may also be charged at the driving link's vector, from which the rest
    follows.

    Arguments: `said` is the judge's verdict by criterion.
    """
    found, vectors, ends = dict(due), work.construction.vectors, ends_of(work.construction)
    for mistake in work.task.mistakes:
        nodes = {*mistake.other} if mistake.code == "labels_swapped" else {mistake.at}
        nodes |= _nodes_of(work, mistake) if mistake.code in CODES_OF_FORCES else set()
        shown = [
            one.id
            for one in work.rubric.criterion
            if one.name in vectors
            and due[one.id] == "wrong"
            and nodes & (set(ends[one.name]) if mistake.code == "labels_swapped" else {ends[one.name][1]})
        ]
        # Of a force that waits a person says whether it is wrong; what follows from it is right then.
        asked = {"review"} if mistake.code in CODES_OF_FORCES else set()
        paying = [name for name in shown if said[name] in {"none", "partial"} | asked]
        if paying:
            found.update(dict.fromkeys(set(shown) - set(paying), "either"))
    for scale in (one for one in work.rubric.criterion if one.scale and due[one.id] == "wrong"):
        first = [
            one.id
            for one in work.rubric.criterion
            if (vector := vectors.get(one.name)) is not None
            and vector.scale == scale.scale
            and is_driving(work.construction, vector.head)
        ]
        if said[scale.id] == "full" and any(said[name] in {"none", "partial"} for name in first):
            found.update(dict.fromkeys([scale.id, *first], "either"))
    return found


def _scale_due(work: StudentWork, source: Source, name: str, by_vector: Mapping[str, Due]) -> Due:
    """The verdict due to a declared scale; missed if drafting errors spoilt the length that shows it."""
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
    tells = {one for one in by_vector if one in vectors and is_driving(work.construction, vectors[one].head)}
    misses = any(vectors[one].scale == name and by_vector[one] == "missed" for one in tells)
    is_sketch = name == "kL" and source in ON_SHEETS
    return "missed" if misses or (is_sketch and _is_yardstick_off(work)) else "right"


def _is_yardstick_off(work: StudentWork) -> bool:
    """Return whether the crank, or the first link where a slider drives, is off on one of the sketches."""
    right = evaluate(work.construction, work.task.right.parameters)
    tail, head = _yardstick(work.construction)
    sketches = [figure.nodes for sheet in work.sheets for figure in sheet.figures if tail in figure.nodes]
    return any(
        off(one[head] - one[tail], complex(right[head] - right[tail]), work.rubric.tolerance, directed=False)
        > PLAIN
        for one in sketches
    )


def _yardstick(construction: Construction) -> tuple[str, str]:
    """The two joints whose distance shows the scale of lengths."""
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
    """Scales that alone seem wrong when another student's driving link is drawn."""
    if not any(one.code == "other_variant" for one in work.task.mistakes):
        return set()
    right, tolerance = work.task.right, work.rubric.tolerance
    exact, meant = (evaluate(one.construction, one.parameters) for one in (right, work.task.wrong))
    return {
        vector.scale
        for vector in right.construction.vectors.values()
        if is_driving(right.construction, vector.head)
        and off(_between(meant, vector), _between(exact, vector), tolerance, directed=False) > PLAIN
    }


@dataclass(frozen=True, slots=True)
class _Drawn:
    """The verdict due to each vector and link drawn, and its distance from the exact one.

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
        """Judge every criterion of these names; if one of two sketches is missed, so is the criterion."""
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
        """Allow either verdict up to the first node that shows the mistake, if its own node does not."""
        construction = self.work.construction
        nodes = _nodes_of(self.work, mistake)
        if not nodes or self._shows_where_made(mistake, nodes):
            return
        ends = ends_of(construction)
        plan = construction.figures[mistake.at] if mistake.code == "figure_rotated" else ()
        for step in construction.steps:
            hangs_on_it = step in plan or nodes & {*ancestors(construction, [step.node])}
            if step.node in nodes or not hangs_on_it:
                continue
            here = [name for name in self.due if ends[name][1] == step.node and self.moved[name] > PLAIN]
            open_ones = [name for name in here if self.due[name] in {"right", "follows"}]
            self.due.update(dict.fromkeys(open_ones, "either"))
            if any(self.moved[name] > CLEAR for name in here):
                return

    def _shows_where_made(self, mistake: StudentMistake, nodes: Collection[str]) -> bool:
        """Return whether it is charged at its own nodes, or another student's data at the driving link."""
        ends = ends_of(self.work.construction)
        if any(one == "wrong" and ends[name][1] in nodes for name, one in self.due.items()):
            return True
        driving = {name for name in self.due if is_driving(self.work.construction, ends[name][1])}
        of_another = mistake.code == "other_variant"
        return of_another and any(self.due[name] in {"wrong", "either"} for name in driving)


def _touches_swap(work: StudentWork, name: str) -> bool:
    return any(set(ends_of(work.construction)[name]) & set(pair) for pair in work.swaps())


def _is_charged_before(work: StudentWork, name: str, *, data_charged: bool) -> bool:
    """Return whether another student's data are charged before: at the crank, the first vector or a scale."""
    vectors = work.construction.vectors
    of_another = any(one.code == "other_variant" for one in work.task.mistakes)
    if not of_another or name not in vectors or not is_driving(work.construction, vectors[name].head):
        return False
    first = next(one for one in vectors.values() if is_driving(work.construction, one.head))
    by_scale = work.declares and vectors[name].scale in _scales_of_another(work)
    return data_charged or vectors[name].head != first.head or by_scale


def _is_scale_unknown(work: StudentWork, name: str) -> bool:
    """Return whether it is the driving link's vector at a scale neither declared nor given by the rule."""
    wrong = {one.at for one in work.task.mistakes if one.code == "scale_wrong"}
    vector = work.construction.vectors.get(name)
    if vector is None or work.declares or vector.scale not in wrong:
        return False
    return is_driving(work.construction, vector.head)


def _nodes_of(work: StudentWork, mistake: StudentMistake) -> frozenset[str]:
    """The nodes at which a mistake is made; none for scales, letters and what is not drawn."""
    construction = work.construction
    if mistake.code in CODES_OF_FORCES:
        return work.changed_by(mistake)
    if mistake.code in {"rpm_not_converted", "labels_swapped", "vector_missing"}:
        return frozenset()
    if mistake.code == "scale_wrong" and mistake.at in SCALES:
        return frozenset()
    steps = construction.figures.get("mechanism" if mistake.code == "other_variant" else mistake.at, ())
    if mistake.code == "other_variant":
        return frozenset((next(s.node for s in steps if not isinstance(s, Pivot)),))
    if mistake.at in construction.poles:
        return frozenset((next(s.node for s in steps if isinstance(s, Given)),))
    return frozenset((mistake.at,))
