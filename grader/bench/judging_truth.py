"""What a fair judge should find: the verdict due to each criterion.

Truth goes by intent, held against the student's own earlier nodes. Of each vector there are three
forms: as its step rightly makes it from the student's own nodes before it (*due*), as the mistaken
step makes it from the same nodes (*made*), and as it is in the exact plan at the scales that the
drawing follows (*exact*). They are compared by the rubric's plain tolerances, without any widening:

- *wrong*: made is off due by more than 2.5 tolerances. It is to be charged: ``none`` or ``partial``.
- *right*, or *follows* where due is off the exact by more than 2.5 tolerances: made is within one
  tolerance of due. It is to be credited, as full or as following.
- *either*: between the two; what was wrongly made and came out right; what follows from a mistake so
  far that next to nothing is left of it (the rubric's guard against trivial follow-through); the
  first vectors that show a mistake which no criterion shows where it was made.
- *missed*: rightly meant, and off by more than the plain tolerance by the hand alone. Either verdict is
  accepted, and counted apart: a wider tolerance where a construction is ill-conditioned credits it.

By code:

- `sense_reversed`, `normal_reversed`, `normal_missing`, `normal_from_absolute`, `arithmetic`,
  `parallel_for_perpendicular`, `wrong_link`, `wrong_intersection`, `image_mirrored`: the vectors that
  end in the node of the changed step, as above; what is drawn from it follows.
- `other_variant`: the driven link's own vectors, held against the exact plan, the first of them to be
  charged, the others either (the same mistake again); all else by the student's own nodes, where only
  data that differ (lengths, guides) make a step wrong. Where the driven link's speed differs too, a
  declared scale looks wrong instead: then either for scale and vector.
- `other_assembly`: only the sketch is wrong, and no criterion asks for it: either verdict for the
  vectors of the first node that shows it, the rest follows.
- `figure_rotated`: the driven link's vector of that plan; the rest is drawn rightly in the turned plan.
- `scale_wrong`: the criterion of the scale where one was declared; the vectors are right by the scale
  that they follow. Undeclared it may be the student's choice: either for the driven link's vector of that
  plan, and nothing that must be named.
- `rpm_not_converted`: velocities and scales are both too large, so the drawing is right: the declared
  kv is wrong, ka either (the same mistake again). Undeclared, nothing shows.
- `vector_missing`: nothing to judge; to credit it in full is wrong where it is not optional.
- angular quantities, computed from the own drawing (`grader.bench.judging_values`): right or following,
  whatever was drawn; either where what was handed in does not tell the sense. A *slip* in computing one
  value is wrong there and nowhere else.
- `labels_swapped`: the vectors that begin or end in the two nodes, as named against as they should be;
  either where the letters themselves are told beside nodes named by their lines.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.bench.judging_redrawn import SCALES
from grader.bench.judging_rules import CLEAR, PLAIN, Due, Seen, off
from grader.bench.judging_students import ON_SHEETS, Source, Work
from grader.bench.judging_values import computed, rate_due
from grader.rubric import CriterionTable
from reference.construction import Construction, Vector, ancestors, evaluate
from reference.elements import Scaled, View
from reference.geometry import ComplexArray
from reference.mistakes import Drawing, Mistake, commit
from reference.steps import ArcAndLine, Given, Pivot, TwoArcs


@dataclass(frozen=True, slots=True)
class _Forms:
    """One vector in all its forms, complex mm; `named` as it is handed in."""

    named: complex
    drawn: complex
    due: complex
    made: complex
    exact: complex
    told: complex
    """The exact one at the scales that the student meant to follow."""


def verdicts_due(work: Work, source: Source, seen: Seen) -> dict[str, Due]:
    """What is due to each criterion of the rubric, by its id."""
    found: dict[str, Due] = {}
    forms = _forms(work, source)
    by_vector: dict[str, Due] = {}
    moved: dict[str, float] = {}
    for criterion in work.rubric.criterion:
        name = criterion.name
        if criterion.vector and name in seen.directed and name in forms:
            by_vector[name] = _due(work, source, criterion, forms[name], seen)
            directed = seen.directed[name] and criterion.direction
            one, tolerance = forms[name], work.rubric.tolerance_of(criterion)
            moved[name] = off(one.due, one.told, tolerance, directed=directed)
    for mistake in work.task.mistakes:
        _open_first_shown(work, mistake, by_vector, moved)
    told = computed(work)
    for criterion in work.rubric.criterion:
        if criterion.scale:
            found[criterion.id] = _scale_due(work, source, criterion.name, by_vector)
        elif criterion.name == told.slip:
            found[criterion.id] = "wrong"
        elif criterion.angular:
            found[criterion.id] = rate_due(work, source, criterion, told, seen)
        else:
            found[criterion.id] = by_vector.get(criterion.name, "absent")
    return found


def _scale_due(work: Work, source: Source, name: str, by_vector: Mapping[str, Due]) -> Due:
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
    tells = {one for one in by_vector if is_driven(work.construction, vectors[one].head)}
    misses = any(vectors[one].scale == name and by_vector[one] == "missed" for one in tells)
    is_sketch = name == "kL" and source in ON_SHEETS
    return "missed" if misses or (is_sketch and _is_yardstick_off(work)) else "right"


def _is_yardstick_off(work: Work) -> bool:
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


def _scales_of_another(work: Work) -> set[str]:
    """Scales at which another student's driven link looks as if only the scale was wrong."""
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


def _due(work: Work, source: Source, criterion: CriterionTable, forms: _Forms, seen: Seen) -> Due:
    tolerance = work.rubric.tolerance_of(criterion)
    directed = seen.directed[criterion.name] and criterion.direction
    vector = work.construction.vectors[criterion.name]

    def apart(one: complex, other: complex) -> float:
        return off(one, other, tolerance, directed=directed)

    if _touches_swap(work, vector):
        if work.by_letters(source):
            return "either"
        nearest = min(apart(forms.named, forms.due), apart(forms.named, forms.exact))
        return "wrong" if nearest > CLEAR else "right" if nearest < PLAIN else "either"
    changed = apart(forms.made, forms.due)
    by_hand = min(apart(forms.drawn, one) for one in (forms.due, forms.exact, forms.told))
    if changed > CLEAR:
        return "either" if by_hand < PLAIN or _is_charged_before(work, vector) else "wrong"
    if changed > PLAIN or _is_scale_unknown(work, vector):
        return "either"
    if by_hand > PLAIN:
        return "missed"
    moved = apart(forms.due, forms.told)
    least = max(tolerance.least_mm, work.rubric.least_followed_share * abs(forms.told))
    if moved > PLAIN and abs(forms.due) < least:
        return "either"
    return "follows" if moved > CLEAR else "right"


def _touches_swap(work: Work, vector: Vector) -> bool:
    return any({vector.tail, vector.head} & set(pair) for pair in work.swaps())


def _is_charged_before(work: Work, vector: Vector) -> bool:
    """Of another student's data: charged at the first vector of the driven link, or at its scale."""
    if not any(one.code == "other_variant" for one in work.task.mistakes):
        return False
    vectors = work.construction.vectors.values()
    first = next(one for one in vectors if is_driven(work.construction, one.head))
    is_later = is_driven(work.construction, vector.head) and vector.head != first.head
    return is_later or (work.declares and vector.scale in _scales_of_another(work))


def _is_scale_unknown(work: Work, vector: Vector) -> bool:
    """The driven link's vector, drawn at a scale that nobody declared and the rule does not give."""
    wrong = {one.at for one in work.task.mistakes if one.code == "scale_wrong"}
    return not work.declares and vector.scale in wrong and is_driven(work.construction, vector.head)


def is_driven(construction: Construction, node: str) -> bool:
    """Whether a node of a plan is laid off from the data alone: the driven link's."""
    step = construction.step(node)
    return isinstance(step, Given) and isinstance(step.length, Scaled)


def _forms(work: Work, source: Source) -> dict[str, _Forms]:
    """Every vector in its forms."""
    task = work.task
    right = _at_scales_followed(task.right, task.mistakes)
    following = right
    for mistake in task.mistakes:
        if mistake.code == "figure_rotated":
            following = commit(mistake, following)
    exact = evaluate(right.construction, right.parameters)
    told = evaluate(right.construction, task.right.parameters)
    of_another = any(one.code == "other_variant" for one in task.mistakes)
    forms = {}
    for figure in right.construction.poles:
        own = work.own(figure)
        named = work.named(own, source)
        vectors = right.construction.vectors_of(figure)
        heads = {vector.head for vector in vectors}
        driven = {head for head in heads if is_driven(right.construction, head)}
        due_at = {head: _head(right if head in driven else following, own, head) for head in heads}
        made_at = {head: _head(task.wrong, own, head) for head in heads}
        for vector in vectors:
            tail = own[vector.tail]
            of_data = vector.head in driven and of_another
            forms[vector.name] = _Forms(
                named=named[vector.head] - named[vector.tail],
                drawn=own[vector.head] - tail,
                due=_between(exact, vector) if of_data else due_at[vector.head] - tail,
                made=made_at[vector.head] - tail,
                exact=_between(exact, vector),
                told=_between(told, vector),
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


def _between(nodes: Mapping[str, ComplexArray], vector: Vector) -> complex:
    return complex(nodes[vector.head]) - complex(nodes[vector.tail])


def _open_first_shown(work: Work, mistake: Mistake, due: dict[str, Due], moved: Mapping[str, float]) -> None:
    """Where a mistake does not show at its own node, either verdict up to the first node that shows it.

    Arguments: `moved` is how far what is due lies from the exact vector, in tolerances.
    """
    node = _node_of(work.construction, mistake)
    vectors = work.construction.vectors
    if node is None or _shows_where_made(work, mistake, node, due):
        return
    plan = work.construction.figures[mistake.at] if mistake.code == "figure_rotated" else ()
    for step in work.construction.steps:
        hangs_on_it = step in plan or node in ancestors(work.construction, [step.node])
        if step.node == node or not hangs_on_it:
            continue
        here = [name for name in due if vectors[name].head == step.node and moved[name] > PLAIN]
        due.update(dict.fromkeys((name for name in here if due[name] in {"right", "follows"}), "either"))
        if any(moved[name] > CLEAR for name in here):
            return


def _shows_where_made(work: Work, mistake: Mistake, node: str, due: Mapping[str, Due]) -> bool:
    """Whether it is charged at its own node; another student's data at the driven link's vectors."""
    construction = work.construction
    heads = {name: construction.vectors[name].head for name in due}
    if mistake.code == "other_variant":
        driven = {name for name, head in heads.items() if is_driven(construction, head)}
        return any(due[name] in {"wrong", "either"} for name in driven)
    return any(one == "wrong" and heads[name] == node for name, one in due.items())


def _node_of(construction: Construction, mistake: Mistake) -> str | None:
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
