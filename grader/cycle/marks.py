"""What is marked along the driven coordinate: the variant's own position, dead points, flat ones, ends."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from grader.cycle.quantities import Subject
from grader.cycle.strokes import strokes_of
from grader.i18n import N_, Tongue

OWN, DEAD, FLAT, END = "#1b1f24", "#7a5c00", "#8e3b8c", "#b42318"
SAME = 1e-3
"""Degrees or millimetres: what lies nearer together is marked once."""
REASONS = (
    N_("its links are in line"),
    N_("its rod is perpendicular to the guide"),
    N_("the pin is at the link's pivot, or as near to it as the offset lets it"),
    N_("its guides are parallel"),
    N_("slot and guide are parallel"),
)
"""Why a group stops or is passed, as `reference.refusal` says it."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A line across the diagram at a driven coordinate (degrees or mm), with a text over it or none."""

    at: float
    text: str
    colour: str
    width: float
    dash: tuple[float, ...]


def told(subject: Subject, driven: float, words: Tongue) -> str:
    """A driven coordinate as people read it: degrees or millimetres."""
    if subject.cycle.is_turned:
        return f"{words.trimmed(float(np.degrees(driven)), 2)}°"
    return words.quantity(1e3 * driven, 2, "mm")


def marks_of(subject: Subject, words: Tongue) -> list[Mark]:
    """All marks; at one place the names of what is dead there stand together."""
    start = subject.cycle.start
    letter = "φ" if subject.cycle.is_turned else "s"
    own = words.gettext("this variant")
    text = f"{own}: {letter} = {told(subject, start, words)}"
    return [
        Mark(_told_at(subject, start), text, OWN, 0.25, (4.0, 1.0, 0.6, 1.0)),
        *_dead_points(subject, words),
        *_flat_positions(subject, words),
        *_ends(subject, words),
    ]


def _told_at(subject: Subject, driven: float) -> float:
    return float(np.degrees(driven)) if subject.cycle.is_turned else 1e3 * driven


def _dead_points(subject: Subject, words: Tongue) -> Iterator[Mark]:
    cycle, title = subject.cycle, words.gettext("dead point")
    dead: dict[float, list[str]] = {}
    for stroke in strokes_of(subject):
        whose = words.gettext("link %(name)s") % {"name": stroke.name} if stroke.is_angle else stroke.name
        for at in stroke.dead_points:
            place = next((known for known in dead if abs(_told_at(subject, known - at)) < SAME), at)
            dead.setdefault(place, []).append(whose)
    for at, names in dead.items():
        text = f"{title} ({', '.join(names)}): {told(subject, at, words)}"
        yield Mark(_told_at(subject, at), text, DEAD, 0.18, (1.6, 1.2))
        if cycle.turns and _told_at(subject, at) < SAME:
            yield Mark(_told_at(subject, float(cycle.driven[-1])), "", DEAD, 0.18, (1.6, 1.2))


def _flat_positions(subject: Subject, words: Tongue) -> Iterator[Mark]:
    cycle, title = subject.cycle, words.gettext("flat position")
    for event in cycle.passed:
        text = f"{title} ({event.node}): {told(subject, event.at, words)}"
        yield Mark(_told_at(subject, event.at), text, FLAT, 0.18, (0.6, 1.2))
        if cycle.turns and _told_at(subject, event.at) < SAME:
            yield Mark(_told_at(subject, float(cycle.driven[-1])), "", FLAT, 0.18, (0.6, 1.2))


def _ends(subject: Subject, words: Tongue) -> Iterator[Mark]:
    for stop in () if subject.cycle.turns else subject.cycle.following.stops:
        if stop is not None:
            text = f"{told(subject, stop.at, words)}, {stop.node}: {words.gettext(stop.why)}"
            yield Mark(_told_at(subject, stop.at), text, END, 0.3, ())
