"""Infer from a drawing its page's scale and orientation.

The links of the sketch, v_A and a_A are known from the variant and the declared scales. Each may be drawn
wrongly; if all are longer or shorter by one factor, the registration's millimetres are wrong.
"""

import cmath
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from grader.records import (
    MECHANISM,
    Figure,
    FloatArray,
    OtherReading,
    Reading,
    ReadNode,
    ReadVector,
    Reason,
    ScannedPage,
    Sheet,
    Value,
)
from reference.construction.graph import evaluate, pair
from reference.construction.mistakes import Drawing

Read = TypeVar("Read", ReadNode, ReadVector, OtherReading)
DRAWN_MM = 0.35
"""Standard error of a length drawn by a student, in addition to that of its reading: its two ends."""
SAME_DEVICE = 0.002
"""Pages whose registered resolutions differ by no more than this went through one scanner or copier."""
LEAST_MM = 15.0
"""A shorter length is weaker than other evidence."""
SAME_LINKS = 0.002
"""Links of one sketch are drawn with one ruler, at one scale: together they are no surer than this."""
STRAY, STRAY_DENSITY = 0.1, 2.0
"""Probability that a length is wrong by its own mistake, and its density over the factor's logarithm."""
TOGETHER, TOGETHER_SPREAD = 0.01, 0.02
"""Probability that all are wrong by one factor, as by compasses set to the crank's length; its spread."""
WRONG, WRONG_SPREAD = 0.002, 0.03
"""Probability that a plain page's registration is wrong by more than its standard error; its spread."""
WIDEST, STEP = 0.15, 0.0005
"""Factors to try, by their logarithm: a page outside the range has no readable figure."""
CLUSTER = 0.01
"""Factors that differ by less belong to one explanation."""
RIVAL = 0.05
"""If other factors together are this probable, lengths may be off by as much; no factor is half-way."""
UNKNOWN, SURELY = "scale_unknown", 0.008
"""A problem of registration, and the standard error at which a drawing settles it."""
ONE_LINE_RAD = math.radians(15.0)
"""Forces that differ by less are laid off as if in one line: their corner is no mark."""
ENOUGH = 2
"""Number of lengths of different figures that settle it; one alone may be drawn wrongly."""
NEGLIGIBLE = 0.001
"""Scales that differ by less are the same: 0.1 mm in 100 mm."""
TELLING = 1.4
"""Factor from which the scale's standard error counts as changed."""
LEVEL_RAD = math.radians(0.25)
"""Standard error of a sheet's turn from which its drawing is asked."""
DRAWN_RAD, SAME_EDGE_RAD = math.radians(0.6), math.radians(0.1)
"""Standard error of a drawn direction, in addition to that of its ends, and of what all were set out from."""
UPRIGHT_UNSURE = "upright_unsure"
"""A problem of registration: neither title block nor letters show which way up the page is."""
UPSIDE_DOWN_RAD = math.radians(135.0)
"""Figures turned by more are upside down: nobody turns a drawing so far on its sheet."""
BY_PLANS = 0.85
"""Highest confidence on a page whose plans alone show which way up it is: a person checks it."""


def is_upside_down(reading: Reading, drawing: Drawing | None) -> bool:
    """Return whether two figures of a page lie as on a sheet turned by half.

    A single one may have been drawn so: a sense is easily reversed.

    Arguments: `drawing` is the student's right drawing; without it the answer is False.
    """
    if drawing is None:
        return False
    turned = [abs(cmath.phase(sum(turns))) > UPSIDE_DOWN_RAD for turns in _turns_of_figures(reading, drawing)]
    return sum(turned) > 1


def drawn_tilt(page: ScannedPage, reading: Reading, drawing: Drawing | None) -> tuple[float, float] | None:
    """Return the tilt of a page without a frame by its drawing, as in `PageRef`; None if that is known.

    Links and components have their directions from the mechanism alone, whatever was drawn before them. If
    all are turned by one angle, the sheet lay so: nobody turns each line by the same degree.
    """
    sheet = page.sheet
    if drawing is None or sheet is None or sheet.turn_se_rad < LEVEL_RAD or page.ref.tilt_rad:
        return None
    # A turn is fitted as the logarithm of a scale is: most lines are turned alike, some are drawn wrongly.
    told = [
        _Length("", math.remainder(cmath.phase(turn), math.pi), math.hypot(DRAWN_MM / size_mm, DRAWN_RAD))
        for turns in _turns_of_figures(reading, drawing)
        for turn in turns
        if (size_mm := math.sqrt(abs(turn))) > LEAST_MM
    ]
    shown = _page_scale(told, sheet.turn_se_rad)
    tilt = math.remainder(math.radians(sheet.rotation_deg), math.pi / 2.0) - math.log(shown.factor)
    return tilt, math.hypot(shown.se, SAME_EDGE_RAD)


def _turns_of_figures(reading: Reading, drawing: Drawing) -> Iterator[list[complex]]:
    """Yield `_turns` of each figure: of its links, or of its vectors without sums."""
    vectors = drawing.construction.vectors
    for name, figure in reading.figures.items():
        ends = drawing.construction.links if name == MECHANISM else {
            one: (vectors[one].tail, vectors[one].head) for one in figure.vectors if not vectors[one].is_sum
        }  # fmt: skip
        yield _turns(figure, ends, drawing)


def turn_doubts(page: ScannedPage) -> tuple[Reason, ...]:
    """Return registration's doubts about which way up a page is."""
    return tuple(problem for problem in page.problems if problem.code == UPRIGHT_UNSURE)


def no_surer_than_turn(reading: Reading, page: ScannedPage) -> Reading:
    """Limit the confidences of a page whose plans alone showed which way up it is."""
    is_sure = page.ref.turn_deg is None or not turn_doubts(page)
    return reading if is_sure else no_surer(reading, BY_PLANS)


def no_surer(reading: Reading, most: float) -> Reading:
    """Return the reading with no node, vector or other reading of a higher confidence."""

    def bounded(one: Read) -> Read:
        return replace(one, confidence=min(one.confidence, most))

    figures = {}
    for name, figure in reading.figures.items():
        nodes = {key: bounded(one) for key, one in figure.nodes.items()}
        vectors = {
            key: replace(bounded(one), others=tuple(map(bounded, one.others)))
            for key, one in figure.vectors.items()
        }
        figures[name] = replace(figure, nodes=nodes, vectors=vectors)
    return replace(reading, figures=figures)


OTHER_RAD = math.radians(4.0)
"""A link turned by more against the others is another variant's, or drawn wrongly."""


def is_drawn_otherwise(reading: Reading, drawing: Drawing) -> bool:
    """Return whether the sketch has a link in another direction than it should, relative to the others."""
    sketch = reading.figures.get(MECHANISM)
    links = drawing.construction.links
    turns = [] if sketch is None else [cmath.phase(turn) for turn in _turns(sketch, links, drawing)]
    middle = float(np.median(turns)) if turns else 0.0
    return any(abs(math.remainder(turn - middle, math.tau)) > OTHER_RAD for turn in turns)


def _turns(figure: Figure, ends: Mapping[str, tuple[str, str]], drawing: Drawing) -> list[complex]:
    """Return for each line between read nodes: drawn times the conjugate of expected."""
    nodes = evaluate(drawing.construction, drawing.parameters)
    return [
        (figure.nodes[head].at - figure.nodes[tail].at)
        * complex(np.ravel(nodes[head] - nodes[tail])[0]).conjugate()
        for tail, head in ends.values()
        if {tail, head} <= figure.nodes.keys()
    ]


@dataclass(frozen=True, slots=True)
class PageScale:
    """The scale of a page according to the drawing.

    Attributes
    ----------
    factor : ratio of the true lengths on the page to the registered ones
    se : relative standard error of lengths after correction
    by : the lengths that determine it
    """

    factor: float
    se: float
    by: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Length:
    """The log ratio of a right length to the drawn one, with its standard error."""

    name: str
    off: float
    se: float


def at_drawn_scales(
    pages: Sequence[ScannedPage],
    readings: Sequence[Reading],
    drawing: Drawing | None,
    declared: Collection[str],
) -> list[ScannedPage]:
    """Return the pages, those at other scales by their drawings to be read again.

    A page of unknown scale is refused if its drawing does not determine it.

    Arguments
    ---------
    readings : of each page, at the scale of its registration
    drawing : the student's right drawing, at the declared scales; None if that is not known
    declared : the scales that were surely declared, by name; lengths at other scales are not used
    """
    result = []
    for page in pages:
        sheet = page.sheet
        if page.ink is None or sheet is None or sheet.zones:
            result.append(page)
            continue
        told = [] if drawing is None else _lengths(sheet, pages, readings, drawing, declared)
        shown = _page_scale(told, sheet.scale_se) if told else None
        result.append(_at_drawn_scale(page, sheet, shown))
    return result


def _at_drawn_scale(page: ScannedPage, sheet: Sheet, shown: PageScale | None) -> ScannedPage:
    """Return a page with the scale of its drawing; the page itself if that changes nothing."""
    unknown = next((problem for problem in page.problems if problem.code == UNKNOWN), None)
    if unknown is not None and (shown is None or shown.se > SURELY or len(shown.by) < ENOUGH):
        why = {**unknown.parameters, "advice": "not_by_drawing"}
        return replace(page, sheet=None, ink=None, problems=(Reason("sheet_refused", why, page.ref.file),))
    if shown is None or not _is_news(shown, sheet):
        return page
    if shown.se > sheet.scale_se and len(shown.by) < ENOUGH:
        return page
    factor = 1.0 if abs(shown.factor - 1.0) < NEGLIGIBLE else shown.factor
    told: tuple[Reason, ...] = ()
    known: dict[str, Value] = {"by": tuple(shown.by), "se_percent": 100.0 * shown.se}
    if factor == 1.0 and shown.se > sheet.scale_se:
        told = (Reason("scale_doubtful", known, page.ref.file),)
    elif factor != 1.0 or unknown is not None:
        known["longer_percent" if factor >= 1.0 else "shorter_percent"] = 100.0 * abs(factor - 1.0)
        told = (Reason("scale_by_drawing", known, page.ref.file),)
    kept = tuple(problem for problem in page.problems if problem is not unknown)
    return replace(page.longer(factor, shown.se), problems=(*kept, *told))


def _is_news(shown: PageScale, sheet: Sheet) -> bool:
    """Return whether a page must be read again with this scale."""
    is_other = abs(shown.factor - 1.0) > max(NEGLIGIBLE, 0.5 * shown.se)
    ratio = max(shown.se, NEGLIGIBLE) / max(sheet.scale_se, NEGLIGIBLE)
    return is_other or not 1.0 / TELLING < ratio < TELLING


def _lengths(
    sheet: Sheet,
    pages: Sequence[ScannedPage],
    readings: Sequence[Reading],
    drawing: Drawing,
    declared: Collection[str],
) -> list[_Length]:
    """Return the lengths that determine a page's scale: its own, and those of pages made in the same way."""
    found: list[_Length] = []
    for page, reading in zip(pages, readings, strict=True):
        other = page.sheet
        if other is not None and abs(other.px_per_mm / sheet.px_per_mm - 1.0) < SAME_DEVICE:
            each = [*_links(reading, drawing), *_givens(reading, drawing, other.scale_se)]
            found += [one for scale, one in each if scale in declared]
    return found


def _page_scale(lengths: Sequence[_Length], scale_se: float) -> PageScale:
    """Infer by Bayes the registration's scale, or another, from lengths that may be drawn wrongly."""
    off = np.arange(-WIDEST, WIDEST + STEP / 2.0, STEP)
    likely = np.ones_like(off)
    for one in lengths:
        likely *= (1.0 - STRAY) * _normal(off - one.off, one.se) + STRAY * STRAY_DENSITY
    together = np.convolve(likely, _normal(off, TOGETHER_SPREAD) * STEP, mode="same")
    likely = (1.0 - TOGETHER) * likely + TOGETHER * together
    before = (1.0 - WRONG) * _normal(off, max(scale_se, STEP)) + WRONG * _normal(off, WRONG_SPREAD)
    chance = before * likely
    chance /= chance.sum()
    near = np.abs(off - off[int(np.argmax(chance))]) < CLUSTER
    centre = float(np.sum(off[near] * chance[near]) / chance[near].sum())
    apart = float(chance[~near].sum())
    spread = chance if apart < RIVAL else np.where(near, 0.0, chance) / apart
    se = float(np.sqrt(np.sum(spread * (off - centre) ** 2)))
    return PageScale(math.exp(centre), max(se, min(scale_se, STEP)), tuple(one.name for one in lengths))


def _normal(off: FloatArray, se: float) -> FloatArray:
    return np.asarray(np.exp(-0.5 * (off / se) ** 2) / (se * math.sqrt(2.0 * math.pi)))


def _links(reading: Reading, drawing: Drawing) -> Iterator[tuple[str, _Length]]:
    """Yield the sketch's links of given length, as one: a scale of their own changes them all."""
    nodes = reading.figures[MECHANISM].nodes if MECHANISM in reading.figures else {}
    found: list[_Length] = []
    for name, (tail, head) in drawing.construction.links.items():
        if not drawing.construction.dots.isdisjoint((tail, head)):
            continue
        real = drawing.parameters.get(pair(tail, head), drawing.parameters.get(pair(head, tail)))
        if real is not None and tail in nodes and head in nodes:
            drawn_mm = abs(nodes[head].at - nodes[tail].at)
            se_mm = math.hypot(nodes[head].se_mm, nodes[tail].se_mm)
            found += _length(name, _scalar(real) / _scalar(drawing.parameters["kL"]), drawn_mm, se_mm)
    yield from (("kL", one) for one in _together(found))


def _together(found: Sequence[_Length]) -> Iterator[_Length]:
    """Yield lengths at one scale as one, without those that differ from most."""
    if found:
        off, se = np.array([(one.off, one.se) for one in sorted(found, key=lambda one: one.off)]).T
        middle = off[np.searchsorted(np.cumsum(1.0 / se), np.sum(0.5 / se))]
        alike = [one for one in found if abs(one.off - middle) < 3.0 * one.se]
        weights = np.array([one.se**-2.0 for one in alike])
        mean = float(np.average([one.off for one in alike], weights=weights))
        se_mean = math.hypot(float(weights.sum()) ** -0.5, SAME_LINKS)
        yield _Length(" ".join(one.name for one in alike), mean, se_mean)


def _givens(reading: Reading, drawing: Drawing, scale_se: float) -> Iterator[tuple[str, _Length]]:
    """Yield the given vectors of each plan; `scale_se` is the page's, which they share.

    Forces of nearly one direction are one length: nothing marks their common corner. All forces are one.
    """
    nodes = evaluate(drawing.construction, drawing.parameters)
    forces: list[_Length] = []
    for figure in reading.figures.values():
        ones = [
            _Laid(name, vector.scale, complex(np.ravel(nodes[vector.head] - nodes[vector.tail])[0]), drawn)
            for name, drawn in figure.vectors.items()
            if (vector := drawing.construction.vectors.get(name)) is not None
            and drawn.length_mm
            and given_length(drawing.parameters, name)
        ]
        while ones:
            first = max(ones, key=lambda one: abs(one.span))
            along = [one for one in ones if abs(cmath.phase(one.span / first.span)) < ONE_LINE_RAD]
            ones = [one for one in ones if one not in along]
            drawn_mm = [one.drawn.length_mm or 0.0 for one in along]
            own = [one.drawn.se_mm**2 - (scale_se * mm) ** 2 for one, mm in zip(along, drawn_mm, strict=True)]
            names, expected_mm = " ".join(one.name for one in along), sum(abs(one.span) for one in along)
            for length in _length(names, expected_mm, sum(drawn_mm), math.sqrt(max(0.0, *own))):
                if first.scale == "kF":
                    forces.append(length)
                else:
                    yield first.scale, length
    yield from (("kF", one) for one in _together(forces))


@dataclass(frozen=True, slots=True)
class _Laid:
    """A given vector: its name and scale, the span to lay off, complex mm, and what was drawn."""

    name: str
    scale: str
    span: complex
    drawn: ReadVector


def given_length(parameters: Mapping[str, FloatArray], vector: str) -> float | None:
    """Return the size of a vector given at the start of a plan, SI; None for one that must be found."""
    if vector in parameters:
        return abs(_scalar(parameters[vector]))
    if f"{vector}_n" in parameters:
        return math.hypot(_scalar(parameters[f"{vector}_n"]), _scalar(parameters[f"{vector}_t"]))
    return None


def _scalar(value: FloatArray) -> float:
    return float(np.ravel(value)[0])


def _length(name: str, expected_mm: float, drawn_mm: float, se_mm: float) -> Iterator[_Length]:
    """Yield a length if it is long enough to determine the scale."""
    if min(expected_mm, drawn_mm) > LEAST_MM:
        yield _Length(name, math.log(expected_mm / drawn_mm), math.hypot(se_mm, DRAWN_MM) / expected_mm)
