"""Read again the nodes that a person has moved, from the ink there, and the vectors between them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from grader.reading.expected import Edge, Expected
from grader.reading.lines import Lines, lines_of
from grader.reading.matching import StrokeAssignment
from grader.reading.nodes import LINK_ENDS, PLAN_ENDS, fit_nodes
from grader.reading.orders import corners_of, ends_on_sheet, ring_of
from grader.reading.vectors import LEAST_VECTOR_MM, NEAR_MM
from grader.records import (
    MECHANISM,
    Figure,
    FloatArray,
    Ink,
    Reading,
    ReadNode,
    ScannedPage,
)
from reference.construction.graph import Construction
from reference.geometry import ComplexArray

REACH_MM = 2.0
"""A person points at a node within this; the next node is farther away."""
ON_MM = 0.6
"""A stroke this near to a node belongs to it: a pencil line and a half."""
THROUGH_MM = 0.3
"""Each further stroke at a point compensates for this much distance."""
MOST_THROUGH = 3
"""Largest number of further strokes that count so."""
POINTED_MM = 0.3
"""Standard error of a point marked by a person, if no ink determines it better."""
BEYOND_MM, BEYOND_JOINT_MM = 1.0, 3.0
"""Distance by which a stroke may stop short of its node, and a link of its joint, at the circle around it."""
LEAST_STROKE_MM = 5.0
"""Shorter strokes are those of letters and arrowheads; they count only if there are no others."""
LEAST_SINE = 0.17
"""Sine of 10 degrees: strokes at a smaller angle do not determine their intersection."""
DOUBT = 3.0
"""Factor of the fit's covariance, which is valid for strokes that surely belong: with it, squared errors on
simulated scans have the median of the covariance (pointed at within half a millimetre)."""
DRAWN_SHARE = 0.5
"""A vector with ink along less of it is not drawn."""


def snapped(ink: Ink | None, x_mm: float, y_mm: float, figure: str = "") -> ReadNode:
    """Return the node at which a person points, fitted to the strokes that meet or end there.

    Arguments: a position on the sheet, mm, y down; the figure: in a sketch strokes stop short of their
    joints.

    Returns the position as pointed at if no ink within `REACH_MM` determines it better.
    """
    at, is_sketch = complex(x_mm, -y_mm), figure == MECHANISM
    pointed = ReadNode(at, np.eye(2) * POINTED_MM**2, 1.0)
    if ink is None:
        return pointed
    beyond_mm = BEYOND_JOINT_MM if is_sketch else BEYOND_MM
    lines = _near(lines_of(ink), at, beyond_mm)
    centres = ink.circles[:, 0] - 1j * ink.circles[:, 1] if is_sketch else np.zeros(0, complex)
    start = _likeliest(lines, centres, at, beyond_mm)
    if start is None:
        return pointed
    through = lines.take(np.flatnonzero(_distance(lines, start, beyond_mm) < ON_MM))
    fit = fit_nodes(_star(through, start), through, LINK_ENDS if is_sketch else PLAN_ENDS, {0: start})
    node = ReadNode(complex(fit.at[0]), DOUBT * fit.cov[:2, :2], 1.0)
    return node if abs(node.at - at) <= REACH_MM else pointed


def _near(lines: Lines, at: complex, beyond_mm: float) -> Lines:
    """Return the single strokes within reach of a point; short ones only if there are no others."""
    single = (lines.members == lines.members[:, :1]).all(axis=1)
    near = single & (_distance(lines, at, beyond_mm) < REACH_MM)
    long = near & (lines.length >= LEAST_STROKE_MM)
    return lines.take(np.flatnonzero(long if long.any() else near))


def _distance(lines: Lines, at: complex, beyond_mm: float) -> FloatArray:
    """Return (n,) mm from a point to the nearest point of each stroke, lengthened at both ends."""
    along = np.clip(_along(lines, at), -beyond_mm, lines.length + beyond_mm)
    return np.abs(lines.start + along * lines.along - at)


def _along(lines: Lines, at: complex) -> FloatArray:
    """Return (n,) mm from the start of each stroke to the foot of a point on its line."""
    return np.asarray(((at - lines.start) * np.conj(lines.along)).real)


def _likeliest(lines: Lines, centres: ComplexArray, at: complex, beyond_mm: float) -> complex | None:
    """Return the likeliest point within reach: the centre of a circle; else where strokes cross or end.

    Of several the nearest one, adjusted by the number of its strokes; else the nearest point of a stroke.
    """
    circled = centres[np.abs(centres - at) < REACH_MM]
    if len(circled):
        return complex(circled[np.argmin(np.abs(circled - at))])
    places = np.array([*_crossings(lines, beyond_mm), *lines.start, *lines.end], dtype=complex)
    places = places[np.abs(places - at) < REACH_MM]
    if not len(places):
        places = lines.start + np.clip(_along(lines, at), 0.0, lines.length) * lines.along
    strokes = [np.count_nonzero(_distance(lines, complex(place), beyond_mm) < ON_MM) for place in places]
    further = np.clip(np.array(strokes) - 1, 0, MOST_THROUGH)
    return complex(places[np.argmin(np.abs(places - at) - THROUGH_MM * further)]) if len(places) else None


def _crossings(lines: Lines, beyond_mm: float) -> list[complex]:
    """Return the intersections of two strokes, lengthened a little."""
    sine = (np.conj(lines.along)[:, None] * lines.along[None, :]).imag
    first, second = np.nonzero(np.triu(np.abs(sine) > LEAST_SINE, 1))
    between = lines.start[second] - lines.start[first]
    along = (np.conj(between) * lines.along[second]).imag / sine[first, second]
    crossings = lines.start[first] + along * lines.along[first]
    return [
        complex(place)
        for one, other, place in zip(first, second, crossings, strict=True)
        if max(_distance(lines.take(np.array([one, other])), complex(place), beyond_mm)) < ON_MM
    ]


def _star(lines: Lines, at: complex) -> StrokeAssignment:
    """Return the strokes as edges from one node to their far ends."""
    far = np.where(np.abs(lines.start - at) > np.abs(lines.end - at), lines.start, lines.end)
    places = np.array([at, *far], dtype=complex)
    edges = tuple(Edge(str(row), 0, row) for row in range(1, len(places)))
    names = tuple(str(row) for row in range(len(places)))
    expected = Expected(names, places, np.eye(2 * len(places)), edges)
    return StrokeAssignment(expected, np.arange(len(lines)), np.zeros(len(lines), dtype=bool), 0.0)


# Readings with nodes in their places ----------------------------------------------------------------


def corrected(
    pages: Sequence[ScannedPage],
    places: Mapping[tuple[str, str], tuple[float, float]],
    construction: Construction,
) -> tuple[list[ScannedPage], list[tuple[str, str]]]:
    """Return a student's pages with moved nodes, and the nodes that lie on none of the pages.

    Arguments: `places` by figure and node, mm on the sheet, y down.

    A moved node has confidence 1. The vectors that start or end there are recomputed, as sure as their other
    end; one that was not read before is read if ink lies along it.
    """
    changed, astray = list(pages), []
    moved: dict[int, dict[str, dict[str, ReadNode]]] = {}
    for (figure, node), (x, y) in places.items():
        index = _page_of(pages, figure, node)
        if index is None:
            astray.append((figure, node))
        else:
            there = moved.setdefault(index, {}).setdefault(figure, {})
            there[node] = snapped(pages[index].ink, x, y, figure)
    for index, figures in moved.items():
        page = pages[index]
        reading = page.reading
        for figure, nodes in figures.items():
            reading = _with_nodes(reading, figure, nodes, page, construction)
        changed[index] = replace(page, reading=reading)
    return changed, astray


def _page_of(pages: Sequence[ScannedPage], figure: str, node: str) -> int | None:
    """Return the page of a node: where it was read, else its figure's page; else the only page there is."""
    with_figure = [index for index, page in enumerate(pages) if figure in page.reading.figures]
    with_node = [index for index in with_figure if node in pages[index].reading.figures[figure].nodes]
    registered = [index for index, page in enumerate(pages) if page.sheet is not None]
    found = with_node or with_figure or (registered if len(registered) == 1 else [])
    return found[0] if found else None


def _with_nodes(
    reading: Reading,
    figure: str,
    moved: Mapping[str, ReadNode],
    page: ScannedPage,
    construction: Construction,
) -> Reading:
    before = reading.figures.get(figure, Figure({}, {}))
    at = ends_on_sheet(construction, figure, before)
    there = {name: replace(node, at=at[name]) for name, node in before.nodes.items() if name in at}
    nodes, drawn = {**there, **moved}, dict(before.drawn)
    corners = corners_of(construction, figure, before) if figure != MECHANISM else {}
    vectors = dict(before.vectors)
    for name, arrow in corners.items():
        if moved.keys().isdisjoint(arrow) or not nodes.keys() >= {*arrow}:
            continue
        tail, head = (nodes[node] for node in arrow)
        if drawn:
            drawn[name] = tail.at, head.at
        known = vectors.get(name)
        if known is None and not _is_drawn(page.ink, tail.at, head.at):
            continue
        stays = all(abs(nodes[end].at - at[end]) < NEAR_MM for end in arrow if end in at)
        cov = head.cov if page.sheet is None else head.cov + page.sheet.cov_of(head.at - tail.at)
        between = tail.vector_to(replace(head, cov=cov))
        sure = known.confidence if known is not None and stays else 0.0
        vectors[name] = replace(between, confidence=max(between.confidence, sure))
    if drawn:
        nodes = _in_usual_order(Figure(before.nodes, vectors, drawn), figure, construction)
    order = [step.node for step in construction.figures[figure]]
    kept = {name: nodes[name] for name in order if name in nodes}
    figures = {**reading.figures, figure: Figure(kept, vectors, drawn)}
    found = {*moved, *vectors}
    unread = tuple(gap for gap in reading.unread if gap.name not in found)
    return replace(reading, figures=figures, unread=unread)


def _in_usual_order(read: Figure, figure: str, construction: Construction) -> dict[str, ReadNode]:
    """Return the nodes of a force polygon of another order, where its sides put them in the usual one.

    They are as sure as the surest vector that starts or ends there.
    """
    nodes, sure = dict(read.nodes), dict.fromkeys(read.nodes, 0.0)
    ring = ring_of(construction, figure)
    for vector in construction.vectors_of(figure):
        for node in vector.arrow if vector.name in read.vectors else ():
            sure[node] = max(sure.get(node, 0.0), read.vectors[vector.name].confidence)
    if ring is None or len(nodes) < len(ring.vectors):
        return nodes
    for side, (start, node) in zip(ring.vectors, pairwise(nodes), strict=False):
        ends = dict(zip(side.arrow, read.drawn[side.name], strict=True))
        at = nodes[start].at + ends[node] - ends[start]
        nodes[node] = replace(nodes[node], at=at, confidence=sure[node])
    return nodes


def _is_drawn(ink: Ink | None, tail: complex, head: complex) -> bool:
    """Return whether strokes lie along a vector; one too short to be drawn counts as drawn."""
    length = abs(head - tail)
    if length <= LEAST_VECTOR_MM:
        return True
    if ink is None or not len(ink.strokes):
        return False
    ends = (ink.strokes.ends[..., 0] - 1j * ink.strokes.ends[..., 1] - tail) / ((head - tail) / length)
    on_it = np.abs(ends.imag).max(axis=1) < ON_MM
    covered = np.sort(np.clip(ends.real[on_it], 0.0, length), axis=1)
    inked, end = 0.0, 0.0
    for low, high in sorted(map(tuple, covered.tolist())):
        inked += max(0.0, high - max(low, end))
        end = max(end, high)
    return inked >= DRAWN_SHARE * length
