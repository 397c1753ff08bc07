"""Explain a judgement's mistakes in the student's words: what was done and what to redo.

The steps are the construction's own from a wrong node on. Names are written as in reports, `a_BA_n`, so that
pages set them with their indices. Without numbers the sentences say which line goes where, and by what
formula a length is found, but give no answer away.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from markupsafe import Markup, escape

from grader.documents import ReportDocument
from grader.feedback.sentences import mistake_sentences
from grader.language import N_, Tongue, tongue
from grader.options import Level
from grader.outcomes import Judgement, NamedMistake
from grader.solution import sentences
from grader.solution.equations import grid_of
from grader.solution.formulas import plain
from grader.solution.sentences import Speaker, speaker_of, wording_of
from grader.solution.steps import computed
from reference.authored.assignment import Assignment, Variant
from reference.construction.elements import Along, Coriolis
from reference.construction.equations import Equation, equations
from reference.construction.graph import evaluate
from reference.construction.mistakes import RIGHT_TRIANGLE
from reference.construction.steps import Coincide, Divide, Given, Similar, Step, TwoLines
from reference.construction.triangles import triangles
from reference.drawing.subject import Subject
from reference.plan import exact_plan

LAY_OFF_UNMEASURED = N_("From %(start)s lay off %(segment)s, %(direction)s; it ends in %(node)s.")
SIMILAR_UNMEASURED = N_(
    "On %(base)s draw the triangle similar to %(model)s, its letters following in the same sense. "
    "Its third corner is %(node)s."
)
DIVIDE_UNMEASURED = N_("Take %(node)s on the line through %(p)s and %(q)s as the link's points divide it.")
MOST_STEPS = 8
"""Number of a figure's steps that are described in full; later ones are only named."""
THEN = N_("Then redo what follows from it: %(nodes)s.")
HALF_TURN = N_(
    "If it was found by the right triangle on the sketch, the half turn about %(joint)s is missing."
)
RATIO = N_("With your scales kL·ka / kv² = %(ratio)s: it is drawn %(ratio)s times as long as it should be.")
RATIO_WITHIN = 0.02
"""Relative: scales at which the right triangle holds, as students round them."""

SHIFT_MM, UNCHANGED_MM = complex(0.0083, 0.0056), 1e-6
"""A shift, along no line of a plan, that shows what follows from a node; a smaller change is rounding."""


def redo(subject: Subject, tongue: Tongue, node: str, *, with_numbers: bool) -> list[str]:
    """Return the steps from a node on: those of its figure in full, all else that follows by name.

    Of a link's centre, its own step. Empty if it is no node of the construction. A force that only moves
    along in its plan stays. Without numbers, steps of the mechanism are left out: they are given lengths.
    """
    construction = subject.plan.construction
    speaker = speaker_of(subject, tongue, lambda name: escape(name.plain))
    if node in construction.centres:
        return [_text(speaker, construction.centres[node], with_numbers=with_numbers).unescape()]
    ends = [*_following(subject, node)]
    touched = [*dict.fromkeys(step for step, _ in ends)]
    own = [step for step in touched if construction.figure_of(step.node) == construction.figure_of(node)]
    told = [*_told_steps(speaker, own[:MOST_STEPS], with_numbers=with_numbers)]
    sums = {one.name for one in construction.vectors.values() if one.is_sum}
    later = [name for step, name in ends if step not in own[:MOST_STEPS] or name in sums]
    if touched and not speaker.has_letters(touched[-1].node):
        later += construction.moments
    if later:
        told.append(speaker.say(THEN, nodes=speaker.names(tuple(later))))
    return [line.unescape() for line in told if line]


def _told_steps(speaker: Speaker, steps: Sequence[Step], *, with_numbers: bool) -> Iterator[Markup]:
    """Yield each equation before the first step that draws a part of it: rows of cells, then the steps."""
    known, written = equations(speaker.subject.plan.construction), set[Equation]()
    for step in steps:
        equation = known.get(step.node)
        if equation is not None and equation.sums and equation not in written:
            written.add(equation)
            rows = grid_of(speaker, equation, with_numbers=with_numbers).rows
            yield escape("\n".join("\t".join(map(plain, row)) for row in rows))
        yield _text(speaker, step, with_numbers=with_numbers)


def _following(subject: Subject, node: str) -> Iterator[tuple[Step, str]]:
    """Yield each step that follows from a node, with the node or vector that it makes and that changes."""
    construction, parameters = subject.plan.construction, subject.plan.drawing.parameters
    right = evaluate(construction, parameters)
    moved = evaluate(construction, parameters, given={node: np.asarray(right.get(node, 0j) + SHIFT_MM)})
    for step in construction.steps:
        for name in construction.drawn_at(step.node):
            vector, change = construction.vectors.get(name), moved[step.node] - right[step.node]
            if vector is not None:
                change = change - moved[vector.tail] + right[vector.tail]
            if not np.all(abs(change) <= UNCHANGED_MM):
                yield step, name


def _text(speaker: Speaker, step: Step, *, with_numbers: bool) -> Markup:
    if not with_numbers:
        return Markup(". ").join(_text_without_numbers(speaker, step))
    computing = "; ".join(map(plain, computed(speaker, step)))
    drawing = sentences.sentence(speaker, step)
    return Markup("{}. {}").format(computing, drawing) if computing else drawing


def _text_without_numbers(speaker: Speaker, step: Step) -> Iterator[Markup]:
    """Describe what is drawn in a step without a number."""
    match step:
        case Given() | TwoLines() if not speaker.has_letters(step.node):
            yield sentences.force(speaker, step, with_numbers=False)
        case TwoLines() | Coincide():
            yield sentences.sentence(speaker, step)
        case Given(along=Along()) | Given(length=Coriolis()):
            segment, direction = (step.start, step.node), sentences.direction_of(speaker, step)
            yield speaker.say(
                LAY_OFF_UNMEASURED, start=step.start, node=step.node, segment=segment, direction=direction
            )
        case Similar(base=base, model=model):
            yield speaker.say(SIMILAR_UNMEASURED, base=base, model=model, node=step.node)
        case Divide(base=(p, q)):
            yield speaker.say(DIVIDE_UNMEASURED, node=step.node, p=p, q=q)


def with_mistakes_explained(
    report: ReportDocument,
    judgement: Judgement,
    assignment: Assignment,
    variant: Variant,
    lang: str,
    level: Level = "full",
) -> ReportDocument:
    """Return the report with its mistakes explained: `feedback` and, step by step, what to `redo`.

    The steps are those of the right plan at the scales that the student used.

    Arguments: `report` is that of the `judgement`, its mistakes in the same order. At level `symbol` nothing
    is explained, at `hint` no number is shown.
    """
    if not judgement.mistakes or level == "symbol":
        return report
    speaker, names = tongue(lang), assignment.names
    used = {name: scale.used for name, scale in judgement.scales.items()}
    plan = exact_plan(assignment, [variant], assignment.scales([variant], **used))
    subject = Subject(assignment, plan, 0, wording_of(speaker))
    told, seen = [], {one.criterion for one in judgement.outcomes if "half_turn_missing" in one.codes}
    for document, mistake in zip(report.mistakes, judgement.mistakes, strict=True):
        said, *others = mistake_sentences(mistake, speaker, level, names)
        # A triangle that was read is told with its criterion.
        said += _by_triangle(subject, mistake, speaker, level) if seen.isdisjoint(mistake.explains) else ""
        known = zip(document.rivals, others, strict=True)
        rivals = [rival.model_copy(update={"feedback": text}) for rival, text in known]
        redrawn = _redo(subject, mistake, speaker, level)
        told.append(document.model_copy(update={"feedback": said, "rivals": rivals, "redo": redrawn}))
    return report.model_copy(update={"mistakes": told})


def _by_triangle(subject: Subject, mistake: NamedMistake, speaker: Tongue, level: Level) -> str:
    """Return what the right triangle has to do with a wrong normal component; empty if nothing."""
    scales = subject.plan.scales
    ratio = float(np.ravel(scales.kL * scales.ka / scales.kv**2)[0])
    if level == "full" and mistake.detail.get("slip") == RIGHT_TRIANGLE:
        return " " + speaker.gettext(RATIO) % {"ratio": speaker.trimmed(ratio, 3)}
    known = triangles(subject.plan.construction) if abs(ratio - 1.0) <= RATIO_WITHIN else ()
    joint = next((one.joint for one in known if mistake.at in (one.vector.head, one.vector.name)), "")
    reversed_at = joint if mistake.code == "normal_reversed" else ""
    return " " + speaker.gettext(HALF_TURN) % {"joint": reversed_at} if reversed_at else ""


def _redo(subject: Subject, mistake: NamedMistake, speaker: Tongue, level: Level) -> list[str]:
    """Return the steps from the mistake on; none if it was made at no single step."""
    vector = subject.plan.construction.vectors.get(mistake.at)
    is_value = mistake.code == "arithmetic" and not mistake.line
    is_arrow = mistake.code == "force_reversed" and len(mistake.explains) == 1
    if vector and (is_value or is_arrow or mistake.code == "units"):
        # The drawing can stay.
        return []
    return redo(subject, speaker, vector.head if vector else mistake.at, with_numbers=level == "full")
