"""Which scales count as declared: entered ones, else what stands in the printed sheet's boxes.

What a box holds counts where it is surely read and the drawing or the assignment's rule bears it out,
or where it is read beyond doubt. Otherwise it is told and not used: nothing is marked by a guess.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from grader.comparison import Submission, Task
from grader.comparison.evidence import Evidence, gather
from grader.quantities import SCALE_NAMES, SURE, ByRule, Declared, ParsedScale, parse_scale
from grader.records import Problem, Reading, Unread, Written

LIKELY, BEYOND_DOUBT = 0.2, 0.985
"""Confidence at which a box is believed where the drawing or the rule has the very scale (a misreading
would hit it once in hundreds), and where they have another; `SURE` where they have nearly that scale."""
SAME = 0.005
"""Relative: two scales that differ less are one, rounded."""
BORNE_OUT = 0.02
"""Relative: as near as that the drawing or the rule bears a scale out."""
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
    problems: tuple[Problem, ...] = ()
    unread: tuple[Unread, ...] = ()


def declarations(
    task: Task,
    entered: Mapping[Source, Mapping[str, str]],
    readings: Sequence[Reading],
    further: Sequence[Mapping[str, str]] = (),
) -> Declarations:
    """What counts, from what was entered (later sources before earlier ones) and from the boxes.

    Arguments: `further` are the scales of further files of measurements.
    """
    evidence = gather(task, Submission(readings=tuple(readings)))
    texts: dict[str, str] = {}
    sources: dict[str, Source] = {}
    problems: list[Problem] = []
    unread: list[Unread] = []
    known: dict[str, float] = {}
    for name in SCALE_NAMES:
        given = [(declared.get(name, "").strip(), source) for source, declared in entered.items()]
        given += [(declared.get(name, "").strip(), "measurements") for declared in further]
        given = [(text, source) for text, source in given if text]
        if any(not _is_certainly_same(task, name, text, given[0][0], known) for text, _ in given):
            problems.append(_differ(name, given))
            unread.append(Unread(name, " / ".join(dict.fromkeys(f"'{text}'" for text, _ in given))))
            continue
        if given:
            texts[name], sources[name] = given[-1]
        boxes = [reading.written[name] for reading in readings if name in reading.written]
        box, told = _believed(task, evidence, name, boxes, known)
        if name not in texts:
            problems.extend(told)
            if box is not None:
                texts[name], sources[name] = box.text, "box"
        elif box is not None and not _is_same(task, name, box.text, texts[name], known):
            problems.append(_contradicts(name, box, texts[name], sources[name]))
        if name in texts:
            known.update(_value(task, name, texts[name], known))
    return Declarations(texts, sources, tuple(problems), tuple(unread))


def _believed(
    task: Task, evidence: Evidence, name: str, boxes: Sequence[Written], known: Mapping[str, float]
) -> tuple[Written | None, list[Problem]]:
    """The box that counts, or why none does."""
    if not boxes:
        return None, []
    best = max(boxes, key=lambda box: box.confidence)
    if not best.text:
        told = f"{name}'s box could not be read; enter {name} in the roster or with the measurements"
        return None, [Problem("scale_box_unread", told)]
    told = f"{name}'s box seems to read '{best.text}' ({100 * best.confidence:.0f} %)"
    very = best.confidence >= LIKELY and _is_borne_out(task, evidence, name, best.text, known, SAME)
    if best.confidence < SURE and not very:
        return None, [Problem("scale_box_doubtful", f"{told}, too unsure to be used; look, and enter {name}")]
    sure = [box for box in boxes if box.confidence >= SURE]
    if any(not _is_same(task, name, box.text, best.text, known) for box in sure):
        each = " and ".join(f"'{box.text}'" for box in sure)
        return None, [Problem("scale_box_disagrees", f"{name}'s boxes read {each}: none is used; look")]
    if _is_borne_out(task, evidence, name, best.text, known):
        return best, []
    if best.confidence < BEYOND_DOUBT:
        why = "which neither the drawing nor the assignment's rule bears out"
        return None, [Problem("scale_box_doubtful", f"{told}, {why}; look, and enter {name}")]
    return best, []


def _contradicts(name: str, box: Written, text: str, source: Source) -> Problem:
    message = f"{name}'s box reads '{box.text}' ({100 * box.confidence:.0f} %)"
    return Problem("scale_box_disagrees", f"{message}, {SOURCES[source]} '{text}', which is used")


def _differ(name: str, given: Sequence[tuple[str, Source]]) -> Problem:
    texts = ", ".join(dict.fromkeys(f"'{text}' in {SOURCES[source]}" for text, source in given))
    return Problem("scale_disagrees", f"{name} is {texts}: none is used; correct one of them")


SOURCES: Mapping[Source, str] = {
    "roster": "the roster",
    "measurements": "the measurements",
    "box": "the box",
}
"""What messages call them."""


# Values -------------------------------------------------------------------------------------------


def _parsed(task: Task, name: str, text: str) -> ParsedScale:
    units = task.assignment.file.scales.bare_units
    return parse_scale(name, text, bare_unit=next((unit for one, unit in units.items() if one == name), None))


def _value(task: Task, name: str, text: str, known: Mapping[str, float]) -> dict[str, float]:
    """The scale in real units per millimetre, by its name; empty where it cannot be told."""
    match _parsed(task, name, text):
        case Declared(per_mm=value):
            return {name: value}
        case ByRule() as rule:
            values = {**({} if task.omega is None else {"omega": task.omega}), **known}
            return {name: rule.per_mm(values)} if rule.powers.keys() <= values.keys() else {}
        case _:
            return {}


def _is_same(task: Task, name: str, one: str, other: str, known: Mapping[str, float]) -> bool:
    """Whether two texts mean one scale; what cannot be understood contradicts nothing."""
    first, second = (_value(task, name, text, known).get(name) for text in (one, other))
    return first is None or second is None or abs(first / second - 1.0) <= SAME


def _is_certainly_same(task: Task, name: str, text: str, other: str, known: Mapping[str, float]) -> bool:
    """Whether two texts surely mean the same scale; a rule takes undeclared scales from the assignment."""
    if text == other or _parsed(task, name, text) == _parsed(task, name, other):
        return True
    known = {**task.rule_scales, **known}
    first, second = (_value(task, name, each, known).get(name) for each in (text, other))
    return first is not None and second is not None and abs(first / second - 1.0) <= SAME


def _is_borne_out(
    task: Task,
    evidence: Evidence,
    name: str,
    text: str,
    known: Mapping[str, float],
    within: float = BORNE_OUT,
) -> bool:
    """Whether the drawn crank, v_A or a_A, or the assignment's rule, has nearly this scale.

    A rule of the student's own, such as omega kL, needs nothing else to bear it out.
    """
    value = _value(task, name, text, known).get(name)
    if value is None:
        return isinstance(_parsed(task, name, text), ByRule)
    ruled = float(getattr(task.assignment.scales([task.variant], **known), name)[0])
    tried = [ruled, *_drawn(task, evidence, name)]
    return any(abs(value / one - 1.0) <= within for one in tried if one > 0.0)


def _drawn(task: Task, evidence: Evidence, name: str) -> list[float]:
    """The scale that the drawing shows, where it can be told."""
    if name == "kL":
        if task.yardstick is None or evidence.yardstick_mm is None or evidence.yardstick_mm[0] <= 0.0:
            return []
        return [task.yardstick.length_m / evidence.yardstick_mm[0]]
    vector = f"{name[1]}_{task.pin}"
    drawn = evidence.vector(vector)
    if drawn is None or drawn.length_mm <= 0.0 or not task.real.get(vector):
        return []
    return [abs(task.real[vector]) / drawn.length_mm]
