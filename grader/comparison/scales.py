"""The scales: as declared, as the assignment's rule gives them, as the drawing shows them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, cast

from grader.comparison.evidence import DrawnVector, Evidence, Submission, gather
from grader.comparison.task import Task, Yardstick
from grader.comparison.verdicts import ALL_RIGHT, FULL, NONE, Limit, MarkRange, by_rule, mark
from grader.outcomes import EVEN, UsedScale
from grader.records import Reading, Reason, Unread, Value, Written
from grader.rubric import ToleranceTable
from grader.tables.scale_text import (
    EXAMPLES,
    SURE,
    ByRule,
    Declared,
    ParsedScale,
    Refused,
    parse_scale,
)
from reference.construction.uncertainty import spread
from reference.quantities import unit_of

TELLING = 2
"""Number of vectors of the right length that confirm a scale as well as the crank's vector."""


@dataclass(frozen=True, slots=True)
class Scale:
    """One scale, settled.

    Attributes
    ----------
    used : as declared and as used, for the report
    other : the scale that the drawing follows instead, where it contradicts the one used
    mark : on what was declared; None where nothing was declared or nothing can contradict it
    reasons : remarks beside the mark's
    """

    used: UsedScale
    other: float | None
    mark: MarkRange | None
    reasons: tuple[Reason, ...] = ()

    @property
    def followed(self) -> float:
        """The scale that the drawing follows."""
        return self.other or self.used.used


def settle(task: Task, evidence: Evidence, declared: Mapping[str, str]) -> dict[str, Scale]:
    """The assignment's scales, in the order in which each may follow from those before."""
    settled: dict[str, Scale] = {}
    for name in task.assignment.scale_names:
        scale, said = _settled_scale(task, evidence, name, declared.get(name), settled), evidence.verdicts
        settled[name] = _as_decided(scale, said[name]) if name in said else scale
    return settled


def _as_decided(scale: Scale, verdict: str) -> Scale:
    """A scale that a person has judged: the one drawn with, or another, which costs points once."""
    used = scale.used
    if verdict == "full":
        right = scale.other if used.assumed and scale.other else used.used
        return Scale(replace(used, used=right, assumed=False), None, ALL_RIGHT)
    off = () if scale.mark is None else tuple(one for one in scale.mark.reasons if one.code != "unread")
    return Scale(replace(used, assumed=False), scale.other, MarkRange(NONE, NONE, NONE, off))


def _settled_scale(
    task: Task, evidence: Evidence, name: str, text: str | None, before: Mapping[str, Scale]
) -> Scale:
    parsed = _parsed(task, name, text)
    rule = _by_rule(task, evidence, name, before)
    if parsed is None:
        used = UsedScale(None, None, rule, assumed=True)
        assumed = Reason("scale_assumed", {"used": rule, "unit": unit_of(name)})
        return Scale(used, _contradiction(task, evidence, name, rule), None, (assumed,))
    if isinstance(parsed, Refused):
        used = UsedScale(text, None, rule, assumed=True, refused=parsed.why)
        why = parsed.why
        reason = Reason("scale_refused", {"text": text or "", "why": why.code, **why.parameters})
        open_mark = MarkRange(NONE, NONE, FULL, (reason,), EVEN)
        return Scale(used, _contradiction(task, evidence, name, rule), open_mark)
    if isinstance(parsed, ByRule):
        followed = {each: scale.followed for each, scale in before.items()}
        value = parsed.per_mm({"omega": task.omega or 0.0, **followed})
    else:
        value = parsed.per_mm
    return _hold_declared(task, evidence, name, UsedScale(text, value, value, assumed=False), rule)


def _parsed(task: Task, name: str, text: str | None) -> ParsedScale | None:
    if text is None or not text.strip():
        return None
    parsed = _parsed_text(task, name, text)
    if isinstance(parsed, ByRule) and "omega" in parsed.powers and task.omega is None:
        return Refused(Reason("no_omega", {"examples": EXAMPLES[name][:1]}))
    return parsed


def _by_rule(task: Task, evidence: Evidence, name: str, before: Mapping[str, Scale]) -> float:
    """The scale by the assignment's rule; a length scale by the drawn yardstick where that was read."""
    known = {each: scale.followed for each, scale in before.items()}
    if name == "kL":
        shown = _evidence_of(task, evidence, name)
        if shown is not None:
            # A crank that agrees with the scale proposed was drawn at that one, a little off.
            proposed = task.rule_scales["kL"]
            return proposed if _is_confirmed(task, evidence, name, proposed, shown) else shown[0] / shown[1]
    key = ("rule", *known.items())
    scales = task.cached(key, lambda: task.assignment.scales([task.variant], **known))
    return float(getattr(scales, name)[0])


# What the drawing shows ----------------------------------------------------------------------------


def _evidence_of(
    task: Task, evidence: Evidence, name: str, *, however_doubtful: bool = False
) -> tuple[float, float, float] | None:
    """Return the evidence of a scale: real value, drawn millimetres, standard error; None without any.

    Arguments: `however_doubtful` takes a vector whatever its confidence.
    """
    if name == "kL":
        if task.yardstick is None or evidence.yardstick_mm is None or evidence.yardstick_mm[0] <= 0.0:
            return None
        return (task.yardstick.length_m, *evidence.yardstick_mm)
    vector = _telling(task, evidence, name)
    drawn = evidence.vector(vector)
    if drawn is None or drawn.length_mm <= 0.0 or not task.real.get(vector):
        return None
    shown = abs(task.real[vector]), drawn.length_mm, drawn.se_mm
    least = task.rubric.least_confidence
    if drawn.confidence >= least or however_doubtful:
        return shown
    if drawn.remarks:
        return None  # the length in its cells is another
    # Where others that were surely read are right at its scale, it was read rightly.
    return shown if _fitting(task, evidence, name, shown[0] / shown[1], least) >= TELLING else None


def _telling(task: Task, evidence: Evidence, name: str) -> str:
    """Return the vector that shows a scale other than that of lengths: of those by the data the largest.

    Where that is drawn at another scale than most of them, it is the largest of these.
    """
    largest = task.driving_vector(name)
    sizes = {one: abs(task.real[one]) for one in task.vectors_by_data(name) if task.real.get(one)}
    least = task.rubric.least_confidence
    drawn = {one: own for one in sizes if (own := evidence.vector(one)) and own.confidence >= least}

    def alike(one: str) -> list[str]:
        per_size = drawn[one].length_mm / sizes[one]
        due = {other: per_size * sizes[other] for other in drawn}
        return [each for each, mm in due.items() if _fits(drawn[each], mm, task.rubric.tolerance_of(each))]

    # A short one fits the scale of many, but does not tell it: of those alike the largest does.
    most = max(map(alike, drawn), key=lambda one: (len(one), largest in one), default=[])
    return largest if largest in most else max(most, key=sizes.__getitem__, default=largest)


def _contradiction(task: Task, evidence: Evidence, name: str, used: float) -> float | None:
    """The scale that the drawing follows, where more vectors fit that one than the one used; else None."""
    shown = _evidence_of(task, evidence, name)
    if shown is None or name == "kL":
        return None
    if _is_confirmed(task, evidence, name, used, shown):
        return None
    other = shown[0] / shown[1]
    # Where vectors by the data differ, those that follow from them say nothing more.
    by_data, each = (
        [_fitting(task, evidence, name, scale, data=data) for scale in (other, used)]
        for data in (True, False)
    )
    return other if (by_data[0], each[0]) > (by_data[1], each[1]) else None


def _fitting(
    task: Task, evidence: Evidence, name: str, scale: float, least: float = 0.0, *, data: bool = False
) -> int:
    """Count the drawn vectors of such a confidence, without the crank's, with the right length at a scale.

    Arguments: with `data` only those that are laid off from the data.
    """
    known, shown_by = task.parameters if data else task.real, _telling(task, evidence, name)
    vectors = [v for v in task.construction.vectors.values() if v.scale == name and v.name in known]
    drawn_as = [(v.name, evidence.vector(v.name)) for v in vectors if v.name != shown_by]
    return sum(
        _fits(drawn, abs(task.real[vector]) / scale, task.rubric.tolerance_of(vector))
        for vector, drawn in drawn_as
        if drawn is not None and drawn.confidence >= least
    )


def _links_at(task: Task, evidence: Evidence, scale: float) -> int:
    """Count the links without the yardstick that have the right length at a scale of lengths."""
    yardstick = None if task.yardstick is None else {task.yardstick.tail, task.yardstick.head}
    return sum(
        _fits(evidence.drawn[name], abs(task.segments[name].real) / scale, task.rubric.tolerance_of(name))
        for name, ends in task.construction.links.items()
        if name in evidence.drawn and set(ends) != yardstick
    )


def _fits(drawn: DrawnVector, expected_mm: float, tolerance: ToleranceTable) -> bool:
    is_telling = expected_mm > tolerance.length_mm and drawn.length_mm > tolerance.length_mm
    return is_telling and abs(drawn.length_mm - expected_mm) <= tolerance.length_at(expected_mm)


# A declared scale compared with the drawing --------------------------------------------------------


def _hold_declared(task: Task, evidence: Evidence, name: str, scale: UsedScale, rule: float) -> Scale:
    """A declared scale compared with the drawing, or with the rule where nothing was drawn.

    Another scale than the rule's cannot be judged where nothing was drawn: it may be the student's choice.
    """
    tolerance = task.rubric.tolerance_of(name)
    is_rule = abs(scale.used - rule) <= tolerance.scale_relative * rule
    shown = _evidence_of(task, evidence, name)
    if shown is None:
        doubtful = _evidence_of(task, evidence, name, however_doubtful=True)
        if doubtful is not None and _is_confirmed(task, evidence, name, scale.used, doubtful):
            # A stroke that was misread would have its very length by chance alone, and few scales are wrong.
            return Scale(scale, None, ALL_RIGHT)
        if _is_unseen(task, evidence, name, scale.used):
            return _unseen(task, evidence, name, scale, doubtful)
        return Scale(scale, None, ALL_RIGHT if is_rule else None)
    other = _followed_instead(task, evidence, name, scale.used, None if is_rule else rule)
    if other is None:
        return Scale(scale, None, ALL_RIGHT)
    real, drawn_mm, se_mm = shown
    params: dict[str, float | str] = {"declared": scale.used, "expected": other, "unit": unit_of(name)}
    limit = Limit(
        what="scale",
        residual=abs(real / scale.used - drawn_mm),
        tolerance=_allowed_mm(task, evidence, tolerance, _ends(task, evidence, name), drawn_mm),
        plain=tolerance.length_at(drawn_mm),
        se=se_mm,
        table=tolerance,
        reason=Reason("scale_off", params),
    )
    return Scale(scale, other, by_rule(mark([limit]), task.rubric.doubt.in_doubt))


def _unseen(
    task: Task, evidence: Evidence, name: str, scale: UsedScale, doubtful: tuple[float, float, float] | None
) -> Scale:
    """Return a declared scale that waits for a person: its evidence was not read for certain.

    Arguments: `doubtful` is what shows it as read, where that contradicts it.
    """
    unread = Reason("unread", {"why": "scale_vector_unsure", "vector": _telling(task, evidence, name)})
    other = None if doubtful is None else doubtful[0] / doubtful[1]
    off = 0.0 if other is None else _is_off(task, evidence, name, scale.used, other)
    if other is None or off < EVEN:
        return Scale(scale, None, MarkRange(FULL, NONE, FULL, (unread,), min(1.0 - off, 1.0 - WRONG_SCALE)))
    params: dict[str, float | str] = {"declared": scale.used, "expected": other, "unit": unit_of(name)}
    return Scale(scale, other, MarkRange(NONE, NONE, FULL, (Reason("scale_seems_off", params), unread), off))


WRONG_SCALE, FITS_BY_CHANCE = 0.05, 0.1
"""Probabilities that a declared scale is not the one drawn with, and that a vector has the right length at a
scale that it was not drawn at."""


def _is_off(task: Task, evidence: Evidence, name: str, declared: float, other: float) -> float:
    """The probability that the scale shown by a doubtful crank's vector was drawn with, not the declared one.

    Else that vector was misread; the other vectors of the plan fit one or the other.
    """
    drawn = evidence.vector(_telling(task, evidence, name))
    confidence = 0.0 if drawn is None else drawn.confidence
    more = _fitting(task, evidence, name, other) - _fitting(task, evidence, name, declared)
    is_other, is_misread = WRONG_SCALE * confidence, FITS_BY_CHANCE**more * (1.0 - confidence)
    return is_other / (is_other + is_misread) if is_other else 0.0


def _is_unseen(task: Task, evidence: Evidence, name: str, scale: float) -> bool:
    """Return whether a plan was read without its crank's vector, and nothing else confirms its scale.

    Vectors confirm it that have the right length within the tolerance by which they are marked, unless that
    is so large a share of it that they would fit many scales.
    """
    telling, fitting = _telling(task, evidence, name), 0
    plan = [v for v in task.construction.vectors.values() if v.scale == name and v.name in evidence.drawn]
    for one in plan:
        expected_mm, table = abs(task.real.get(one.name, 0.0)) / scale, task.rubric.tolerance_of(one.name)
        allowed = _allowed_mm(task, evidence, table, (one.tail, one.head), expected_mm)
        residual = abs(evidence.drawn[one.name].length_mm - expected_mm)
        fitting += one.name != telling and residual <= allowed <= FITS_BY_CHANCE * expected_mm
    return bool(plan) and fitting < TELLING


def _followed_instead(
    task: Task, evidence: Evidence, name: str, declared: float, rule: float | None
) -> float | None:
    """The scale that the drawing follows where that is not the declared one.

    Arguments: `rule` is the assignment's, None where the declared one is that.
    """
    shown = _evidence_of(task, evidence, name)
    if shown is None or _is_confirmed(task, evidence, name, declared, shown):
        return None
    other = shown[0] / shown[1]
    if name == "kL":
        # A crank drawn too long beside links that are right is a wrong crank, no wrong scale.
        return None if _links_at(task, evidence, declared) > _links_at(task, evidence, other) else other
    # A drawing that follows the rule contradicts another declaration.
    follows_rule = rule is not None and _is_confirmed(task, evidence, name, rule, shown)
    return other if follows_rule else _contradiction(task, evidence, name, declared)


def _is_confirmed(
    task: Task, evidence: Evidence, name: str, scale: float, shown: tuple[float, float, float]
) -> bool:
    """Return whether a scale agrees with the drawn length within its tolerance and uncertainty.

    Arguments: `shown` is what `_evidence_of` the scale gives.
    """
    expected_mm = shown[0] / scale
    residual = abs(expected_mm - shown[1])
    table, ends = task.rubric.tolerance_of(name), _ends(task, evidence, name)
    plain = table.length_at(expected_mm)
    return residual <= plain or residual <= _allowed_mm(task, evidence, table, ends, expected_mm)


def _allowed_mm(
    task: Task, evidence: Evidence, table: ToleranceTable, ends: tuple[str, str], expected_mm: float
) -> float:
    """The tolerance (mm) of the length between two nodes, widened by its propagated drafting error."""
    plain, hand = table.length_at(expected_mm), task.rubric.hand
    drawn = task.traced(task.rule_scales)
    uncertainty = hand.sigmas * spread(drawn.shifts(*ends), drawn.vector(*ends)).along
    if not evidence.has_sheets:
        uncertainty = math.hypot(uncertainty, hand.sigmas * hand.ruler_mm)
    return max(plain, min(uncertainty, hand.at_most * plain))


def _ends(task: Task, evidence: Evidence, name: str) -> tuple[str, str]:
    """Tail and head of what shows a scale; there must be evidence of it."""
    if name == "kL":
        yardstick = cast("Yardstick", task.yardstick)
        return yardstick.tail, yardstick.head
    vector = task.construction.vectors[_telling(task, evidence, name)]
    return vector.tail, vector.head


# Which of the declarations count -------------------------------------------------------------------

LIKELY, BEYOND_DOUBT = 0.2, 0.985
"""Confidence at which a box is believed where the drawing or the rule has the very scale (a misreading
would hit it once in hundreds), and where they have another; `SURE` where they have nearly that scale."""
SAME = 0.005
"""Relative difference up to which two scales are the same one, rounded."""
BORNE_OUT = 0.02
"""Relative difference up to which the drawing or the rule confirms a scale."""
Source = Literal["roster", "measurements", "box"]


@dataclass(frozen=True, slots=True)
class Declarations:
    """The scales that count as declared.

    Attributes
    ----------
    texts : as written, by scale
    sources : where each is from
    problems : boxes that were not believed, or that contradict what was entered
    unread : scales that were entered in two ways, of which none counts
    """

    texts: Mapping[str, str]
    sources: Mapping[str, Source]
    problems: tuple[Reason, ...] = ()
    unread: tuple[Unread, ...] = ()


def declarations(
    task: Task,
    entered: Mapping[Source, Mapping[str, str]],
    readings: Sequence[Reading],
    further: Sequence[Mapping[str, str]] = (),
) -> Declarations:
    """The declarations that count, from entries (later sources before earlier ones) and from the boxes.

    Arguments: `further` are the scales of further files of measurements.
    """
    evidence = gather(task, Submission(readings=tuple(readings)))
    texts: dict[str, str] = {}
    sources: dict[str, Source] = {}
    problems: list[Reason] = []
    unread: list[Unread] = []
    known: dict[str, float] = {}
    for name in task.assignment.scale_names:
        given = [(declared.get(name, "").strip(), source) for source, declared in entered.items()]
        given += [(declared.get(name, "").strip(), "measurements") for declared in further]
        given = [(text, source) for text, source in given if text]
        if any(not _is_certainly_same(task, name, text, given[0][0], known) for text, _ in given):
            problems.append(_differ(name, given))
            texts_given = " / ".join(dict.fromkeys(f"'{text}'" for text, _ in given))
            unread.append(Unread(name, Reason("entry", {"entries": (texts_given,)})))
            continue
        if given:
            texts[name], sources[name] = given[-1]
        boxes = [reading.written[name] for reading in readings if name in reading.written]
        box, box_problems = _believed(task, evidence, name, boxes, known)
        if name not in texts:
            problems.extend(box_problems)
            if box is not None:
                texts[name], sources[name] = box.text, "box"
        elif box is not None and not _is_same(task, name, box.text, texts[name], known):
            seen: dict[str, Value] = {"scale": name, "read": box.text, "confidence": box.confidence}
            problems.append(Reason("scale_box_disagrees", {**seen, sources[name]: texts[name]}))
        if name in texts:
            known.update(_value(task, name, texts[name], known))
    return Declarations(texts, sources, tuple(problems), tuple(unread))


def _believed(
    task: Task, evidence: Evidence, name: str, boxes: Sequence[Written], known: Mapping[str, float]
) -> tuple[Written | None, list[Reason]]:
    """The box that counts, or why none does."""
    if not boxes:
        return None, []
    best = max(boxes, key=lambda box: box.confidence)
    if not best.text:
        return None, [Reason("scale_box_unread", {"scale": name})]
    seems: dict[str, Value] = {"scale": name, "read": best.text, "confidence": best.confidence}
    if best.confidence < SURE:
        likely = (
            Written(*read) for read in ((best.text, best.confidence), *best.others) if read[1] >= LIKELY
        )
        very = (one for one in likely if _is_borne_out(task, evidence, name, one.text, known, SAME))
        chosen = next(very, None)
        if chosen is None:
            return None, [Reason("scale_box_doubtful", {**seems, "why": "too_unsure"})]
        best = chosen
    sure = [box for box in boxes if box.confidence >= SURE]
    if any(not _is_same(task, name, box.text, best.text, known) for box in sure):
        readings = tuple(f"'{box.text}'" for box in sure)
        return None, [Reason("scale_box_disagrees", {"scale": name, "readings": readings})]
    if _is_borne_out(task, evidence, name, best.text, known):
        return best, []
    if best.confidence < BEYOND_DOUBT:
        return None, [Reason("scale_box_doubtful", {**seems, "why": "not_borne_out"})]
    return best, []


def _differ(name: str, given: Sequence[tuple[str, Source]]) -> Reason:
    said: dict[str, tuple[str, ...]] = {}
    for text, source in given:
        said[source] = tuple(dict.fromkeys([*said.get(source, ()), f"'{text}'"]))
    return Reason("scale_disagrees", {"scale": name, **said})


_understood = lru_cache(maxsize=4096)(parse_scale)
"""The scale that a text declares; cached, since a class declares the same few scales."""


def _parsed_text(task: Task, name: str, text: str) -> ParsedScale:
    units = task.assignment.file.scales.bare_units.items()
    return _understood(name, text, bare_unit=next((unit for scale, unit in units if scale == name), None))


def _value(task: Task, name: str, text: str, known: Mapping[str, float]) -> dict[str, float]:
    """The scale in real units per millimetre, by its name; empty where it is not determined."""
    match _parsed_text(task, name, text):
        case Declared(per_mm=value):
            return {name: value}
        case ByRule() as rule:
            values = {**({} if task.omega is None else {"omega": task.omega}), **known}
            return {name: rule.per_mm(values)} if rule.powers.keys() <= values.keys() else {}
        case _:
            return {}


def _is_same(task: Task, name: str, one: str, other: str, known: Mapping[str, float]) -> bool:
    """Return whether two texts mean the same scale, as far as both can be understood."""
    first, second = (_value(task, name, text, known).get(name) for text in (one, other))
    return first is None or second is None or abs(first / second - 1.0) <= SAME


def _is_certainly_same(task: Task, name: str, text: str, other: str, known: Mapping[str, float]) -> bool:
    """Return whether two texts surely mean one scale; a rule takes undeclared scales from the assignment."""
    if text == other or _parsed_text(task, name, text) == _parsed_text(task, name, other):
        return True
    known = {**task.rule_scales, **known}
    are_known = all(_value(task, name, each, known) for each in (text, other))
    return are_known and _is_same(task, name, text, other, known)


def _is_borne_out(
    task: Task,
    evidence: Evidence,
    name: str,
    text: str,
    known: Mapping[str, float],
    within: float = BORNE_OUT,
) -> bool:
    """Return whether the drawn crank, v_A or a_A, or the assignment's rule, has nearly this scale.

    A rule of the student's own, such as omega kL, needs nothing else to bear it out.
    """
    value = _value(task, name, text, known).get(name)
    if value is None:
        return isinstance(_parsed_text(task, name, text), ByRule)
    if "kL" not in known and name != "kL":
        # The rule takes the length scale from the crank as drawn, where nobody declares it.
        known = {**known, "kL": _by_rule(task, evidence, "kL", {})}
    ruled = float(getattr(task.assignment.scales([task.variant], **known), name)[0])
    shown = _evidence_of(task, evidence, name, however_doubtful=True)
    tried = [ruled] if shown is None else [ruled, shown[0] / shown[1]]
    return any(abs(value / one - 1.0) <= within for one in tried if one > 0.0)
