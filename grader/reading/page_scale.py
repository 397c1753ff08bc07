"""What a drawing tells of its page: the scale, and which way up it is.

The links of the sketch, v_A and a_A are known from the variant and the declared scales. Each may be drawn
wrongly; all of them longer or shorter by one factor say that the page's millimetres are not what its
registration takes them for.
"""

import cmath
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grader.records import MECHANISM, Figure, FloatArray, Reading, Reason, ScannedPage, Sheet, Value
from reference.construction.graph import evaluate, pair
from reference.construction.mistakes import Drawing

DRAWN_MM = 0.35
"""Standard error of a length set off and drawn by a student, beside that of its reading: its two ends."""
SAME_DEVICE = 0.002
"""Pages that registration has at so nearly the same resolution went through one scanner or copier."""
LEAST_MM = 15.0
"""A shorter length tells less than other evidence."""
SAME_LINKS = 0.002
"""Links of one sketch are drawn with one ruler, and at one scale: together they are no surer than this."""
STRAY, STRAY_DENSITY = 0.1, 2.0
"""Probability that a length is off by a mistake of its own, and its density over the factor's logarithm."""
TOGETHER, TOGETHER_SPREAD = 0.01, 0.02
"""The same of all of them by one factor, as by compasses that the crank's length set; how far off."""
WRONG, WRONG_SPREAD = 0.002, 0.03
"""Probability that a plain page's registration is off by more than its standard error says; how far."""
WIDEST, STEP = 0.15, 0.0005
"""Factors that are tried, by their logarithm: a page off by more has no figure that is read."""
CLUSTER = 0.01
"""Factors that differ by less are of one explanation."""
RIVAL = 0.05
"""Other factors of such a probability together are what lengths may be off by: half-way is none of them."""
UNKNOWN, SURELY = "scale_unknown", 0.008
"""A problem of registration, and the standard error at which a drawing answers it."""
ENOUGH = 2
"""So many lengths of different figures answer it; one alone may be drawn wrongly."""
NEGLIGIBLE = 0.001
"""Scales that differ by less are one: 0.1 mm in 100 mm."""
TELLING = 1.4
"""The scale's standard error counts as another from this factor on."""
UPRIGHT_UNSURE = "upright_unsure"
"""A problem of registration: neither title block nor letters tell which way up the page is."""
UPSIDE_DOWN_RAD = math.radians(135.0)
"""Figures turned by more lie the other way up: nobody turns a drawing so far on its sheet."""
BY_PLANS = 0.85
"""Most confidence in what is read on a page whose plans alone tell which way up it is: a person looks."""


def is_upside_down(reading: Reading, drawing: Drawing | None) -> bool:
    """Whether two figures of a page lie as on a sheet turned by half.

    One alone may have been drawn so: a sense is easily reversed.

    Arguments: `drawing` is what the student was to draw; without it nothing tells.
    """
    if drawing is None:
        return False
    vectors = drawing.construction.vectors
    turned = []
    for name, figure in reading.figures.items():
        ends = drawing.construction.links if name == MECHANISM else {
            vector: (vectors[vector].tail, vectors[vector].head) for vector in figure.vectors
        }  # fmt: skip
        turned.append(abs(cmath.phase(sum(_turns(figure, ends, drawing)))) > UPSIDE_DOWN_RAD)
    return sum(turned) > 1


def turn_doubts(page: ScannedPage) -> tuple[Reason, ...]:
    """What registration says of not knowing which way up a page is."""
    return tuple(problem for problem in page.problems if problem.code == UPRIGHT_UNSURE)


def no_surer_than_turn(reading: Reading, page: ScannedPage) -> Reading:
    """A page's reading, with nothing asserted where its plans alone told which way up the page is."""
    if page.ref.turn_deg is None or not turn_doubts(page):
        return reading
    figures = {}
    for name, figure in reading.figures.items():
        nodes = {
            key: replace(one, confidence=min(one.confidence, BY_PLANS)) for key, one in figure.nodes.items()
        }
        vectors = {
            key: replace(one, confidence=min(one.confidence, BY_PLANS)) for key, one in figure.vectors.items()
        }
        figures[name] = Figure(nodes, vectors)
    return replace(reading, figures=figures)


OTHER_RAD = math.radians(4.0)
"""A link turned by more against the others is another variant's, or drawn wrongly: no hand misses so far."""


def is_drawn_otherwise(reading: Reading, drawing: Drawing) -> bool:
    """Whether the sketch has a link in another direction than it should, against the others."""
    sketch = reading.figures.get(MECHANISM)
    links = drawing.construction.links
    turns = [] if sketch is None else [cmath.phase(turn) for turn in _turns(sketch, links, drawing)]
    middle = float(np.median(turns)) if turns else 0.0
    return any(abs(math.remainder(turn - middle, math.tau)) > OTHER_RAD for turn in turns)


def _turns(figure: Figure, ends: Mapping[str, tuple[str, str]], drawing: Drawing) -> list[complex]:
    """Of each line between nodes that were read: drawn times the conjugate of expected."""
    nodes = evaluate(drawing.construction, drawing.parameters)
    return [
        (figure.nodes[head].at - figure.nodes[tail].at)
        * complex(np.ravel(nodes[head] - nodes[tail])[0]).conjugate()
        for tail, head in ends.values()
        if {tail, head} <= figure.nodes.keys()
    ]


@dataclass(frozen=True, slots=True)
class PageScale:
    """What the drawing says of a page's scale.

    Attributes
    ----------
    factor : by which lengths on the page are longer than they were taken for
    se : relative standard error of lengths after that
    by : the lengths that tell it
    """

    factor: float
    se: float
    by: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Length:
    """A length's logarithm of the right one to the one drawn, with its standard error."""

    name: str
    off: float
    se: float


def at_drawn_scales(
    pages: Sequence[ScannedPage],
    readings: Sequence[Reading],
    drawing: Drawing | None,
    declared: Collection[str],
) -> list[ScannedPage] | None:
    """The pages at the scales that their drawings tell, to be read again; None where nothing changes.

    A page of which registration does not know the scale is refused where its drawing does not tell it.

    Arguments
    ---------
    readings : of each page, at the scale of its registration
    drawing : what the student was to draw, at the declared scales; None where that is not known
    declared : the scales that were surely declared, by name; the lengths of others tell nothing
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
    return result if any(one is not page for one, page in zip(result, pages, strict=True)) else None


def _at_drawn_scale(page: ScannedPage, sheet: Sheet, shown: PageScale | None) -> ScannedPage:
    """A page with what the drawing says of its scale; the page itself where that is nothing new."""
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
    """Whether a page is to be read again with this scale."""
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
    """The lengths that tell a page's scale: its own, and those of pages made in the same way."""
    found: list[_Length] = []
    for page, reading in zip(pages, readings, strict=True):
        other = page.sheet
        if other is not None and abs(other.px_per_mm / sheet.px_per_mm - 1.0) < SAME_DEVICE:
            each = [*_links(reading, drawing), *_givens(reading, drawing, other.scale_se)]
            found += [one for scale, one in each if scale in declared]
    return found


def _page_scale(lengths: Sequence[_Length], scale_se: float) -> PageScale:
    """By Bayes: the registration's scale, or any other, with lengths of which some may be drawn wrongly."""
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
    """The sketch's links of given length, as one: a scale of their own moves them all."""
    nodes = reading.figures[MECHANISM].nodes if MECHANISM in reading.figures else {}
    found: list[_Length] = []
    for name, (tail, head) in drawing.construction.links.items():
        real = drawing.parameters.get(pair(tail, head), drawing.parameters.get(pair(head, tail)))
        if real is not None and tail in nodes and head in nodes:
            drawn_mm = abs(nodes[head].at - nodes[tail].at)
            se_mm = math.hypot(nodes[head].se_mm, nodes[tail].se_mm)
            found += _length(name, _scalar(real) / _scalar(drawing.parameters["kL"]), drawn_mm, se_mm)
    if found:
        middle = float(np.median([one.off for one in found]))
        alike = [one for one in found if abs(one.off - middle) < 3.0 * one.se] or found
        weights = np.array([one.se**-2.0 for one in alike])
        off = float(np.average([one.off for one in alike], weights=weights))
        se = math.hypot(float(weights.sum()) ** -0.5, SAME_LINKS)
        yield "kL", _Length(" ".join(one.name for one in alike), off, se)


def _givens(reading: Reading, drawing: Drawing, scale_se: float) -> Iterator[tuple[str, _Length]]:
    """The vectors that are given at the start of each plan; `scale_se` is the page's, which theirs have."""
    for vector in drawing.construction.vectors.values():
        real = given_length(drawing.parameters, vector.name)
        for figure in reading.figures.values():
            drawn = figure.vectors.get(vector.name)
            if real is not None and drawn is not None and drawn.length_mm is not None:
                expected_mm = real / _scalar(drawing.parameters[vector.scale])
                own_mm = math.sqrt(max(drawn.se_mm**2 - (scale_se * drawn.length_mm) ** 2, 0.0))
                for length in _length(vector.name, expected_mm, drawn.length_mm, own_mm):
                    yield vector.scale, length


def given_length(parameters: Mapping[str, FloatArray], vector: str) -> float | None:
    """The size of a vector that is given at the start of a plan, SI; None of one that is to be found."""
    if vector in parameters:
        return abs(_scalar(parameters[vector]))
    if f"{vector}_n" in parameters:
        return math.hypot(_scalar(parameters[f"{vector}_n"]), _scalar(parameters[f"{vector}_t"]))
    return None


def _scalar(value: FloatArray) -> float:
    return float(np.ravel(value)[0])


def _length(name: str, expected_mm: float, drawn_mm: float, se_mm: float) -> Iterator[_Length]:
    """A length long enough to tell the scale."""
    if min(expected_mm, drawn_mm) > LEAST_MM:
        yield _Length(name, math.log(expected_mm / drawn_mm), math.hypot(se_mm, DRAWN_MM) / expected_mm)
