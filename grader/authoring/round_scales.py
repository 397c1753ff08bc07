"""Sizes of drawings at the proposed scales, and round scales: the largest that fit every variant.

They consider short vectors, room on the answer sheet and on a plain A3 sheet, and the scales customary in
drawing.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from grader.authoring.findings import BoolArray, LintFinding, Severity, chosen, first_of
from grader.documents import LintLeast, LintScales
from grader.language import N_, Tongue
from grader.printed.layout import (
    FRAME_MM,
    MARGIN_MM,
    TEMPLATES,
    Extents,
    Size,
    Template,
    by_zone,
    lines_of,
    template_for,
)
from grader.records import MECHANISM, Box
from grader.rubric import RubricFile
from reference.authored.assignment import SCALE_NAMES, Assignment, Scales, Variant
from reference.errors import Parameter
from reference.geometry import FloatArray
from reference.plan import ZERO_SHARE, Plan
from reference.quantities import group_of, scale_of, unit_of, zone_of

WELL_READ_MM = 8.0
WELL_READ: dict[str, Parameter] = {"least_number": WELL_READ_MM}
"""Shorter vectors are read from scans with less certainty."""
Sheet = tuple[Template, Sequence[str]]
"""A printed page's division and its figures."""
IntArray = NDArray[np.intp]
STEPS = (1.0, 2.0, 2.5, 4.0, 5.0, 10.0)
"""Factors of 10^k by which a ruler's millimetres are easily multiplied. ISO 5455 has 1, 2, 5 for lengths;
GOST 2.302 adds 2.5 and 4."""
LEAST_LINK_MM = 20.0
"""The plans' directions come from the sketch: a shorter link gives them less exactly than a person draws."""
LEAST_DRAWN_MM = 2.0
"""A shorter link cannot be drawn: more likely the scale is in another unit."""
_SLACK = 1e-9
"""Relative rounding error of a scale that is a round step: 0.005 computed as 0.0050000000001 is 0.005."""


# Lengths of vectors -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class AskedVectors:
    """Drawn lengths of the vectors that a rubric asks for.

    Attributes
    ----------
    criteria : index of each vector's criterion
    names : of the vectors, V of them
    length_mm : (V, N)
    is_zero : (V, N), of true length zero (a dead point): no scale makes it longer
    least_mm : (V,), the direction of shorter ones is not judged
    """

    criteria: tuple[int, ...]
    names: tuple[str, ...]
    length_mm: FloatArray
    is_zero: BoolArray
    least_mm: FloatArray

    def short(self, limit_mm: FloatArray | float) -> BoolArray:
        """(V, N): drawn shorter than a limit, though not zero."""
        return np.asarray((self.length_mm < limit_mm) & ~self.is_zero)

    @property
    def mostly_short(self) -> BoolArray:
        """(V,): in half of the variants or more, zero or too short for its direction to be judged."""
        short = self.is_zero | self.short(self.least_mm[:, None])
        return np.asarray(2 * short.sum(axis=1) >= short.shape[1])


def asked_vectors(rubric: RubricFile, plan: Plan) -> AskedVectors:
    """Return the requested vectors that the mechanism has."""
    asked = {
        index: criterion
        for index, criterion in enumerate(rubric.criterion)
        if criterion.vector is not None and criterion.vector in plan.vectors_si
    }
    names = tuple(criterion.vector or "" for criterion in asked.values())
    least_mm = np.array([rubric.tolerance_of(criterion).least_mm for criterion in asked.values()])
    return AskedVectors(tuple(asked), names, *_lengths(plan, names), least_mm)


def _lengths(plan: Plan, names: tuple[str, ...]) -> tuple[FloatArray, BoolArray]:
    """Return (V, N) drawn lengths, and whether each is zero."""
    shape = (len(names), len(plan.variants))
    lengths = np.array([np.abs(plan.drawn_mm(name)) for name in names]).reshape(shape)
    return lengths, np.array([plan.is_zero(name) for name in names], dtype=np.bool_).reshape(shape)


def length_findings(rubric: RubricFile, plan: Plan, asked: AskedVectors) -> Iterator[LintFinding]:
    """Report short vectors: each one that is asked for, the others together."""
    for row, name in enumerate(asked.names):
        path = f"$.criterion[{asked.criteria[row]}]"
        least = float(asked.least_mm[row])
        short, zero = asked.short(least)[row], asked.is_zero[row]
        if np.any(short):
            shortest = float(np.min(asked.length_mm[row][short]))
            known: dict[str, Parameter] = {"name": name, "least_number": least, "length_number": shortest}
            grave: Severity = "warning" if asked.mostly_short[row] else "hint"
            yield LintFinding(grave, "short_vector", "rubric", path, known, chosen(plan.variants, short))
        if np.any(zero):
            meant = chosen(plan.variants, zero)
            yield LintFinding("hint", "zero_vector", "rubric", path, {"name": name}, meant)
    few = asked.short(WELL_READ_MM)
    if np.any(few):
        counts = {"each": int(few.sum()), "count": int((~asked.is_zero).sum())}
        meant = chosen(plan.variants, np.any(few, axis=0))
        yield LintFinding("hint", "hard_to_read", "assignment", "$.scales", WELL_READ | counts, meant)
    yield from _unasked_findings(rubric, plan, asked)


def _unasked_findings(rubric: RubricFile, plan: Plan, asked: AskedVectors) -> Iterator[LintFinding]:
    names = tuple(name for name in plan.vectors_si if name not in asked.names)
    lengths, zeros = _lengths(plan, names)
    lengths[zeros] = 0.0
    short, count = lengths < rubric.tolerance.least_mm, len(plan.variants)
    unasked = [
        f"{name} ({few.sum()}/{count}, {np.min(length[few]):.2g} mm)"
        for name, length, few in zip(names, lengths, short, strict=True)
        if np.any(few)
    ]
    if unasked:
        known: dict[str, Parameter] = {"least_number": rubric.tolerance.least_mm, "texts": tuple(unasked)}
        meant = chosen(plan.variants, np.any(short, axis=0))
        yield LintFinding("hint", "short_unasked", "assignment", "$.scales", known, meant)


# Room on the sheets -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PageRoom:
    """Room for a page's figures at the proposed scales; 1 is just enough, arrays of shape (N,).

    Attributes
    ----------
    zones : by zone of the answer sheet, the factor by which what is in it could be enlarged
    frame : the factor by which all of them side by side could be enlarged in a plain A3 sheet's frame
    """

    zones: Mapping[str, FloatArray]
    frame: FloatArray


def extents_of(plan: Plan) -> dict[str, Size]:
    """Return width and height of each figure of every variant, mm."""
    count = len(plan.variants)
    extents = {}
    for figure, nodes in plan.nodes_mm.items():
        places = np.stack([np.broadcast_to(place, (count,)) for place in nodes.values()])
        extents[figure] = (np.ptp(places.real, axis=0), np.ptp(places.imag, axis=0))
    return extents


def pages_of(assignment: Assignment, plan: Plan) -> list[tuple[int, tuple[str, ...]]]:
    """Return the assignment's pages with their index, and those of their figures that the plan has."""
    pages = [
        (index, tuple(figure for figure in page.figures if figure in plan.nodes_mm))
        for index, page in enumerate(assignment.file.page)
    ]
    return [(index, figures) for index, figures in pages if figures]


def room_of(figures: Sequence[str], extents: Extents, grid: Sequence[int] | None = None) -> PageRoom:
    """Return the room for a page's figures, in the layout of the answer sheet printed for them."""
    sizes = {figure: extents[figure] for figure in figures}
    template = template_for(sizes, grid).template.of_one(grid)
    zones = {zone: growth(template.zones[zone], inside) for zone, inside in by_zone(sizes).items()}
    return PageRoom(zones, growth(FRAME_MM, [*sizes.values()]))


def growth(box: Box, sizes: Sequence[Size]) -> FloatArray:
    """Return the factor by which figures side by side, on one line or two, could be enlarged in a box; (N,).

    Each has margins for letters around it.
    """
    options = []
    for lines in lines_of(len(sizes)):
        for along, across in ((0, 1), (1, 0)):
            long = [np.sum([sizes[k][along] for k in line], axis=0) for line in lines]
            wide = np.sum([np.max([sizes[k][across] for k in line], axis=0) for line in lines], axis=0)
            limits = [(box[2 + along], len(line), size) for line, size in zip(lines, long, strict=True)]
            limits.append((box[2 + across], len(lines), wide))
            with np.errstate(divide="ignore"):
                factors = [(whole - 2 * MARGIN_MM * count) / size for whole, count, size in limits]
            options.append(np.min(factors, axis=0))
    return np.asarray(np.max(options, axis=0))


def room_findings(
    assignment: Assignment, plan: Plan, asked: AskedVectors, rooms: Mapping[int, PageRoom]
) -> Iterator[LintFinding]:
    """Report figures too large for their zone, and pages whose figures do not fit a plain A3 sheet either."""
    for index, room in rooms.items():
        for zone, factor in {**room.zones, "": room.frame}.items():
            if np.any(factor < 1.0):
                code = "does_not_fit" if zone else "does_not_fit_a3"
                known: dict[str, Parameter] = {"figure": zone} if zone else {}
                known |= {"size_number": float(np.min(factor))}
                meant = chosen(plan.variants, factor < 1.0)
                yield LintFinding("warning", code, "assignment", f"$.page[{index}]", known, meant)
    shown = {figure for page in assignment.file.page for figure in page.figures}
    built = plan.construction
    needed = {built.figure_of(built.vectors[name].head) for name in asked.names}
    for figure in plan.nodes_mm:
        # Of force plans only those are needed whose vectors are asked for.
        if figure not in shown and (not group_of(figure) or figure in needed):
            yield LintFinding("warning", "no_page", "assignment", "$.page", {"figure": figure})


# Round scales -------------------------------------------------------------------------------------


ProposalName = Literal["proposed", "round", "round_each"]


@dataclass(frozen=True, slots=True)
class Proposal:
    """Scales and their effect.

    Attributes
    ----------
    over_all : over all variants, as it is published
    short : (N,) number of requested vectors of each variant that are shorter than 8 mm
    still_short : names of the vectors that are, the most frequent first
    """

    scales: Scales
    over_all: LintScales
    short: IntArray
    still_short: tuple[str, ...]


def round_up(values: FloatArray) -> FloatArray:
    """Round up to the next of `STEPS` times a power of ten (positive, any shape)."""
    decade = 10.0 ** np.floor(np.log10(values) + _SLACK)
    ladder = decade[..., None] * np.asarray(STEPS)
    reached = ladder >= values[..., None] * (1.0 - _SLACK)
    return np.asarray(np.take_along_axis(ladder, np.argmax(reached, axis=-1)[..., None], axis=-1)[..., 0])


def proposals(
    assignment: Assignment, plan: Plan, extents: Extents, asked: AskedVectors, rooms: Mapping[int, PageRoom]
) -> list[Proposal]:
    """Return the assignment's own scales, round ones for all, and round ones for each variant."""
    factors = [factor for room in rooms.values() for factor in room.zones.values()]
    own_room = min((float(np.min(factor)) for factor in factors), default=np.inf)
    links = _shortest_link_m(plan)
    sheets = []
    for index, figures in pages_of(assignment, plan):
        template = _best_template(figures, plan, extents, links)
        sheets.append((template.of_one(assignment.file.page[index].grid), figures))
    proposed = [_judged("proposed", plan.scales, plan, asked, own_room)]
    names: tuple[ProposalName, ...] = ("round", "round_each")
    for name in names:
        scales = _round_scales(sheets, plan, extents, together=name == "round")
        proposed.append(_judged(name, scales, plan, asked, _room(sheets, _redrawn(extents, plan, scales))))
    return proposed


def _shortest_link_m(plan: Plan) -> FloatArray:
    """Return the shortest distance (m) from which a direction of the plans is taken, (N,)."""
    at = plan.motion.position
    links = {vector.link for vector in plan.construction.vectors.values() if vector.link}
    count = len(plan.variants)
    known = [np.abs(at[head] - at[tail]) for tail, head in links if {tail, head} <= at.keys()]
    # A slider coincides with the point under it: there is no link between them.
    lengths = [length for length in known if np.all(length > ZERO_SHARE * np.max(known))]
    if not lengths:
        return np.ones(count)
    return np.asarray(np.min([np.broadcast_to(length, (count,)) for length in lengths], axis=0))


def _growths(sheet: Sheet, extents: Extents) -> dict[str, FloatArray]:
    """Return the factor by which what is in each zone of a sheet could be enlarged, (N,)."""
    template, figures = sheet
    sizes = by_zone({figure: extents[figure] for figure in figures})
    return {zone: growth(template.zones[zone], inside) for zone, inside in sizes.items()}


def _needed(sheet: Sheet, plan: Plan, extents: Extents) -> dict[str, FloatArray]:
    """Return the finest scale at which what is in each zone of a sheet fits it, (N,)."""
    needed = {}
    for zone, factor in _growths(sheet, extents).items():
        # A figure that is a single point fits at any scale.
        scale = getattr(plan.scales, scale_of(zone))
        needed[zone] = np.where(np.isfinite(factor), scale / factor, scale)
    return needed


def _best_template(figures: Sequence[str], plan: Plan, extents: Extents, links_m: FloatArray) -> Template:
    """Return the layout with the largest plans whose sketch is not too small to take directions from."""

    def worth(template: Template) -> tuple[float, ...]:
        scales = {
            figure: float(round_up(np.asarray(np.max(values))))
            for figure, values in _needed((template, figures), plan, extents).items()
        }
        sketch = scales.pop(MECHANISM, None)
        link_mm = LEAST_LINK_MM if sketch is None else float(np.min(links_m)) / sketch
        plans = -sum(np.log(scale) for scale in scales.values())
        return (min(link_mm, LEAST_LINK_MM), float(plans), link_mm)

    return max((each for each in TEMPLATES if each.figures == set(map(zone_of, figures))), key=worth)


def _round_scales(sheets: Sequence[Sheet], plan: Plan, extents: Extents, *, together: bool) -> Scales:
    """Return round scales that fit every page; a scale that no page needs is unchanged."""
    scales = plan.scales.by_name
    finest: dict[str, FloatArray] = {}
    for sheet in sheets:
        for zone, values in _needed(sheet, plan, extents).items():
            name = scale_of(zone)
            finest[name] = np.maximum(finest[name], values) if name in finest else values
    for name, values in finest.items():
        common = np.full_like(values, np.max(values)) if together else values
        scales[name] = round_up(common)
    return Scales(**scales)


def _redrawn(extents: Extents, plan: Plan, scales: Scales) -> dict[str, Size]:
    """Return the figures' sizes at other scales."""
    factors = {name: one / getattr(scales, name) for name, one in plan.scales.by_name.items()}
    return {
        figure: (wide * factors[scale_of(figure)], high * factors[scale_of(figure)])
        for figure, (wide, high) in extents.items()
    }


def _room(sheets: Sequence[Sheet], extents: Extents) -> float:
    rooms = [factor for sheet in sheets for factor in _growths(sheet, extents).values()]
    return min((float(np.min(factor)) for factor in rooms), default=np.inf)


def _judged(name: ProposalName, scales: Scales, plan: Plan, asked: AskedVectors, room: float) -> Proposal:
    lengths = np.array(asked.length_mm)
    for row, vector in enumerate(asked.names):
        own = plan.construction.vectors[vector].scale
        lengths[row] *= getattr(plan.scales, own) / getattr(scales, own)
    real = np.where(asked.is_zero, np.inf, lengths)
    shortest = None
    if np.isfinite(real).any():
        least = int(np.argmin(real.min(axis=1)))
        shortest = LintLeast(value=float(real[least].min()), at=asked.names[least])
    short = real < WELL_READ_MM
    often = sorted(zip(asked.names, short.sum(axis=1).tolist(), strict=True), key=lambda entry: -entry[1])
    over_all = LintScales(
        name=name,
        **{each: ends_of(one) for each, one in scales.by_name.items()},
        room=room,
        shortest_mm=shortest,
        under_8_mm=int(np.sum(short)),
        asked=int(real.size - asked.is_zero.sum()),
        shortest_link_mm=float(np.min(_shortest_link_m(plan) / scales.kL)),
    )
    of_each = np.asarray(short.sum(axis=0), dtype=np.intp).reshape(len(plan.variants))
    return Proposal(scales, over_all, of_each, tuple(vector for vector, count in often if count))


def scale_findings(assignment: Assignment, plan: Plan, proposed: Sequence[Proposal]) -> Iterator[LintFinding]:
    """Suggest round scales, and report whether normals can be constructed by the triangle."""
    drawn = {scale_of(figure) for _, figures in pages_of(assignment, plan) for figure in figures}
    names = [name for name in SCALE_NAMES if name in drawn]
    own, round_, each = (proposal.over_all for proposal in proposed)
    if own.shortest_link_mm < LEAST_DRAWN_MM:
        known: dict[str, Parameter] = {"length_number": own.shortest_link_mm}
        yield LintFinding("warning", "tiny_sketch", "assignment", "$.scales.kL", known)
    values = {name: np.asarray(getattr(plan.scales, name)) for name in names}
    is_round = all(np.allclose(round_up(scale), scale, rtol=1e-6) for name, scale in values.items())
    if own.room < 1.0 or not is_round:
        counts = (round_.under_8_mm, round_.asked, own.under_8_mm, each.under_8_mm)
        known = WELL_READ | dict(zip(("left", "count", "now", "each"), counts, strict=True))
        known |= {"why": "scales_do_not_fit" if own.room < 1.0 else "scales_not_round"}
        known |= {"texts": written(proposed[1].scales, names)}
        yield LintFinding("hint", "round_scales", "assignment", "$.scales", known)
    yield from _short_findings(plan, own, proposed[2])
    if "acceleration_plan" in plan.nodes_mm and any("_n" in name for name in plan.vectors_si):
        ratio = plan.scales.kL * plan.scales.ka / plan.scales.kv**2
        if not np.allclose(ratio, 1.0, rtol=1e-6):
            yield LintFinding("hint", "no_altitude_method", "assignment", "$.scales")


def _short_findings(plan: Plan, own: LintScales, each: Proposal) -> Iterator[LintFinding]:
    """Report whether each variant's own scales make all requested vectors long enough, and what none does."""
    if own.under_8_mm == 0:
        return
    if each.over_all.under_8_mm == 0:
        yield LintFinding("hint", "scales_of_its_own", "assignment", "$.scales", WELL_READ)
        return
    left, still = each.short > 0, each.over_all.under_8_mm
    known = WELL_READ | {"left": still, "count": own.asked, "texts": first_of(each.still_short)}
    meant = chosen(plan.variants, left)
    yield LintFinding("hint", "short_at_any_scale", "assignment", "$.scales", known, meant)


BETTER = N_("%(scales)s: %(left)s asked vectors under %(least)s mm instead of %(now)s")


def suggestions(
    proposed: Sequence[Proposal], plan: Plan, figures: Collection[str], speaker: Tongue
) -> dict[Variant, str]:
    """Return, as text, round scales for each variant that leave fewer requested vectors under 8 mm."""
    own, _, each = proposed
    names = [name for name in SCALE_NAMES if name in {*map(scale_of, figures)}]
    texts = {}
    for index, variant in enumerate(plan.variants):
        if each.short[index] < own.short[index] or own.over_all.room < 1.0:
            scales = Scales(**{name: one[index : index + 1] for name, one in each.scales.by_name.items()})
            texts[variant] = speaker.gettext(BETTER) % {
                "scales": written(scales, names), "left": each.short[index], "now": own.short[index],
                "least": f"{WELL_READ_MM:g}",
            }  # fmt: skip
    return texts


def written(scales: Scales, names: Sequence[str]) -> str:
    """Write scales that are the same for all variants, as people do."""
    texts = []
    for name in names:
        value = float(np.ravel(getattr(scales, name))[0])
        text = f"{value:g} {unit_of(name)}"
        texts.append(f"kL = {ratio_text(value)} ({text})" if name == "kL" else f"{name} = {text}")
    return ", ".join(texts)


def ratio_text(scale_m_per_mm: float) -> str:
    """Write a scale of lengths as a ratio: 1:5, 1:2.5, 10:1."""
    ratio = 1000.0 * scale_m_per_mm
    return f"1:{ratio:.4g}" if ratio >= 1.0 - _SLACK else f"{1.0 / ratio:.4g}:1"


def ends_of(values: FloatArray) -> tuple[float, float]:
    """Return the least and the largest of a scale over the variants."""
    return float(np.min(values)), float(np.max(values))
