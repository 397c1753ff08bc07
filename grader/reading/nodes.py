"""Nodes fitted to the strokes assigned to them, with standard errors and confidence."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from grader.reading.expected import Expected, xy
from grader.reading.lines import TIP_MM, BoolArray, Lines
from grader.reading.matching import StrokeAssignment
from grader.records import FloatArray, IntArray
from reference.geometry import ComplexArray

LINE_ROUNDS, ROUNDS = 3, 6
"""Rounds of the fit by lines alone, then with ends: of these each takes half a step of the ends' moments."""
LEAST_REDRAW_MM, MOST_REDRAW_MM = 0.12, 0.6
"""Bounds of the redraw error, a stroke's distance from its nodes: a sharp pencil, a careless student."""
USUAL_REDRAW_MM = 0.25
"""The redraw error while nothing is known about the sheet."""
REDRAW_WEIGHT = 4.0
"""The usual redraw error counts as much as this many spare observations; as one beside lines alone."""
EXACTEST_MM, EXACT_MM = 0.05, 0.12
"""Lines that meet to the second were drawn by a program or with great care: nodes are where they meet, to the
first at least, though arrowheads end 0.2 mm short of them."""
SHARED_MM = 0.5
"""Standard error of a stroke that serves two edges, as a distance from their nodes."""
AT_MM = 0.2
"""Standard error of an end at its node, in addition to the error of the end in the ink."""
HIDDEN_MM = 0.5
"""Standard errors above this mean that other ink continues beyond the end."""
END_REACH_MM = 5.0
"""An end farther from a node does not belong to it."""
CENTRE_MM = 0.2
"""Standard error of a node by the centre of the circle around it, on each axis: on real drawings lines miss
the centres by 0.26 mm in the median, which is 0.22 mm on each axis."""
SUREST = 0.9
"""Largest probability of all tips near a node together: with 0.97, and as much for each tip, six instead of
four of 1,042 vectors were misread."""
TIP_REACH_MM = 3.5
"""A tip farther from a node does not belong to it."""
THROUGH = 0.02
"""Density per mm of strokes that extend past a node, beyond reach."""
TIED_MM = 0.02
"""Standard error of the distance between nodes that lie at one point."""
BUNDLE_COSINE = 0.87
"""Cosine of 30 degrees: strokes at less overlap for 1 mm and more from their node."""
SPREAD = 0.7
"""Factor of the model's standard errors: with it, errors of correctly read lengths have a root mean square of
0.8 to 0.95 of their standard errors on sheets drawn by two simulations."""
LOOSE_MM = 6.0
"""Standard error of the prior, which is needed only for nodes without strokes."""
UNSEEN = 1e-9
"""Density per mm that is left to other places, however well an end is seen."""


@dataclass(frozen=True, slots=True)
class EndDensity:
    """The density of a node near a stroke's end: a mixture of four Gaussians.

    Attributes
    ----------
    at_mm : standard error of an end at its node
    shares : of ends at the node, a little beyond, far beyond, and short of it
    reach_mm : mean distances of the last three, and their standard deviations
    merged_shares, merged_reach_mm : the same two if other ink hides the end
    """

    at_mm: float = AT_MM
    shares: tuple[float, float, float, float] = (0.45, 0.3, 0.2, 0.05)
    reach_mm: tuple[float, float, float] = (0.6, 4.0, 1.2)
    merged_shares: tuple[float, float, float, float] = (0.35, 0.25, 0.2, 0.2)
    merged_reach_mm: tuple[float, float, float] = (1.0, 4.0, 2.5)

    def before(self, se_end: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return means, mm from the ends inward, variances and shares of the four (r, 4).

        Arguments: `se_end` (r,) are the ends' own standard errors.
        """
        hidden = (se_end > HIDDEN_MM)[:, None]
        little, far, short = np.where(hidden, self.merged_reach_mm, self.reach_mm).T
        mean = np.column_stack([np.zeros_like(little), little, far, -short])
        variance = mean**2 + (self.at_mm**2 + se_end**2)[:, None]
        return mean, variance, np.where(hidden, self.merged_shares, self.shares)


PLAN_ENDS = EndDensity()
"""For a plan's vectors, whose strokes end at their nodes or extend past them."""
LINK_ENDS = EndDensity(1.5, (0.7, 0.1, 0.1, 0.1), (2.0, 6.0, 3.0), (0.7, 0.1, 0.1, 0.1), (2.0, 6.0, 3.0))
"""For a sketch's links, which stop at joint circles, short of the joint by the circle's radius."""


@dataclass(frozen=True, slots=True)
class NodeFit:
    """Nodes fitted to strokes.

    Attributes
    ----------
    at, cov : (n,) complex mm and (2n, 2n) covariance
    residual_mm : (edges, 2) distance of the tail and the head from the edge's stroke, nan without one
    """

    at: ComplexArray
    cov: FloatArray
    residual_mm: FloatArray


@dataclass(frozen=True, slots=True)
class _Taken:
    """The edges that have strokes, a row each: indices, tail and head (k, 2), strokes, whether shared."""

    edge: IntArray
    nodes: IntArray
    lines: Lines
    shared: BoolArray

    def from_middle(self, at: ComplexArray) -> ComplexArray:
        """Return (k, 2) tail and head relative to the stroke's middle: x along it, y to its left, mm."""
        from_middle = at[self.nodes] - self.lines.middle[:, None]
        return np.asarray(from_middle * np.conj(self.lines.along)[:, None])


@dataclass(frozen=True, slots=True)
class _LineRows:
    """Observations (r,) that a node lies on a stroke's line: `design` @ nodes equals `goal`, to `sigma` mm.

    `own` if the stroke serves this edge alone: then the redraw error is added.
    """

    design: FloatArray
    goal: FloatArray
    sigma: FloatArray
    own: BoolArray


@dataclass(frozen=True, slots=True)
class _EndRows:
    """Observations (r,) of a node along a stroke's outward direction, `design`.

    Its position has one of some Gaussians (r, c), by the stroke's end and by marks of the vector's own end:
    their means, variances and shares. What the shares lack of 1 is for a stroke that extends beyond reach.
    """

    design: FloatArray
    mean: FloatArray
    variance: FloatArray
    share: FloatArray


@dataclass(frozen=True, slots=True)
class _Sites:
    """The Gaussian that replaces each end's density: its precision, and precision times mean."""

    precision: FloatArray
    pull: FloatArray


def fit_nodes(
    assignment: StrokeAssignment,
    lines: Lines,
    density: EndDensity = PLAN_ENDS,
    centres: Mapping[int, complex] | None = None,
    prior: Expected | None = None,
) -> NodeFit:
    """Fit nodes by weighted least squares over all strokes taken, with large residuals down-weighted.

    A stroke's end near its node may be the node or a line extended past it. Each end's own density is
    replaced by a Gaussian with its moments given everything else (expectation propagation; Minka 2001), so
    that the covariance contains the doubt about ends.

    Arguments: `centres` of circles drawn around nodes, by node; `prior`, the figure before strokes were
    assigned, if it says where nodes lie that no stroke shows; without it the fit is by the strokes alone.
    """
    expected = assignment.expected
    taken = _taken(assignment, lines)
    rows, ends = _line_rows(assignment, taken, centres or {}), _end_rows(taken, expected.at, density)
    every = np.eye(2 * len(expected.at))
    before = xy(expected.at if prior is None else prior.at)
    loose = every / LOOSE_MM**2 if prior is None else np.linalg.inv(prior.cov + TIED_MM**2 * every)
    redraw = by_lines = USUAL_REDRAW_MM
    sites = _Sites(*np.zeros((2, len(ends.design))))
    state = xy(expected.at)
    for turn in range(LINE_ROUNDS + ROUNDS):
        sigma = np.sqrt(rows.sigma**2 + np.where(rows.own, redraw**2, 0.0))
        residual = np.abs(rows.goal - rows.design @ state) / sigma
        weight = np.minimum(1.0, 2.0 / np.maximum(residual, 1e-9)) / sigma**2
        normal = rows.design.T @ (rows.design * weight[:, None]) + loose
        normal = normal + ends.design.T @ (ends.design * sites.precision[:, None])
        right = rows.design.T @ (rows.goal * weight) + loose @ before + ends.design.T @ sites.pull
        cov = np.asarray(np.linalg.inv(normal), dtype=np.float64)
        state = cov @ right
        residual_mm = (rows.goal - rows.design @ state)[rows.own]
        if turn < LINE_ROUNDS:
            redraw = by_lines = _redraw_by_lines(residual_mm, len(state))
            continue
        redraw = by_lines if by_lines < EXACT_MM else _redraw(residual_mm, len(state))
        used, sites = sites, _renewed(sites, ends, state, cov)
    repeated = ends.design.T @ (ends.design * (used.precision * _repeated(ends.design))[:, None])
    at = state[0::2] + 1j * state[1::2]
    residual_mm = np.full((len(assignment.stroke), 2), np.nan)
    residual_mm[taken.edge] = taken.from_middle(at).imag
    return NodeFit(at, SPREAD**2 * np.linalg.inv(normal - repeated), residual_mm)


def _repeated(design: FloatArray) -> FloatArray:
    """Return the share of each end's evidence that other ends of its bundle already give.

    Strokes that reach a node side by side merge their ink, and end wrongly together: for the covariance all
    their ends count as one.
    """
    bundled = design @ design.T > BUNDLE_COSINE
    return np.asarray(1.0 - 1.0 / np.maximum(bundled.sum(axis=1), 1))


def _redraw(residual_mm: FloatArray, unknowns: int) -> float:
    """Return the redraw error of this figure, mm, from the residuals beyond the unknowns."""
    spare = len(residual_mm) - unknowns
    if spare <= 0:
        return USUAL_REDRAW_MM
    squares = np.sum(np.minimum(residual_mm**2, 1.0)) + REDRAW_WEIGHT * USUAL_REDRAW_MM**2
    return float(np.clip(np.sqrt(squares / (spare + REDRAW_WEIGHT)), LEAST_REDRAW_MM, MOST_REDRAW_MM))


def _redraw_by_lines(residual_mm: FloatArray, unknowns: int) -> float:
    """Return the redraw error of this figure, mm, from the median residual of lines that no end pulls."""
    spare = len(residual_mm) - unknowns
    if spare <= 0:
        return USUAL_REDRAW_MM
    squares = len(residual_mm) * (1.4826 * np.median(np.abs(residual_mm))) ** 2 + USUAL_REDRAW_MM**2
    return max(float(np.sqrt(squares / (spare + 1.0))), EXACTEST_MM)


# Ends of strokes ----------------------------------------------------------------------------------


def _renewed(sites: _Sites, ends: _EndRows, state: FloatArray, cov: FloatArray) -> _Sites:
    """Return half a step towards the moments of each end's own density given everything else."""
    mean = ends.design @ state
    variance = np.maximum(np.einsum("ij,jk,ik->i", ends.design, cov, ends.design), 1e-6)
    rest = np.maximum(1.0 / variance - sites.precision, 1.0 / LOOSE_MM**2)
    rest_mean = (mean / variance - sites.pull) / rest
    off, spread = ends.mean - rest_mean[:, None], ends.variance + 1.0 / rest[:, None]
    weight = ends.share * np.exp(-0.5 * off**2 / spread) / np.sqrt(2.0 * np.pi * spread)
    elsewhere = THROUGH * np.maximum(1.0 - ends.share.sum(axis=1), 0.0) + UNSEEN
    weight /= (weight.sum(axis=1) + elsewhere)[:, None]
    # Each Gaussian moves the rest's mean by its gain times the distance, and takes as much of its variance.
    gain = 1.0 / (rest[:, None] * spread)
    moved = (weight * gain * off).sum(axis=1)
    variance = 1.0 / rest - moved**2 + (weight * gain**2 * (off**2 - spread)).sum(axis=1)
    variance = np.maximum(variance, 1e-4)
    fresh = np.maximum(1.0 / variance - rest, 0.0)
    fresh_pull = np.where(fresh > 0.0, (rest_mean + moved) / variance - rest_mean * rest, 0.0)
    return _Sites(0.5 * (sites.precision + fresh), 0.5 * (sites.pull + fresh_pull))


# Observations -------------------------------------------------------------------------------------


def _taken(assignment: StrokeAssignment, lines: Lines) -> _Taken:
    nodes = np.array([(edge.tail, edge.head) for edge in assignment.expected.edges]).reshape(-1, 2)
    edge = np.flatnonzero(assignment.stroke >= 0)
    return _Taken(edge, nodes[edge], lines.take(assignment.stroke[edge]), assignment.shared[edge])


def _design(nodes: IntArray, direction: ComplexArray, count: int) -> FloatArray:
    """Return (r, 2n) rows that give a node's coordinate along a direction, of x and y of n nodes in turn."""
    design, row = np.zeros((len(nodes), 2 * count)), np.arange(len(nodes))
    design[row, 2 * nodes], design[row, 2 * nodes + 1] = direction.real, direction.imag
    return design


def _line_rows(assignment: StrokeAssignment, taken: _Taken, centres: Mapping[int, complex]) -> _LineRows:
    """Return rows for nodes on their strokes' lines, tied nodes, and nodes at their circles' centres."""
    at, lines = assignment.expected.at, taken.lines
    across = np.repeat(1j * lines.along, 2)
    loose = np.where(taken.shared, SHARED_MM, 0.0)
    tilt = lines.se_angle[:, None] * taken.from_middle(at).real
    observed = _LineRows(
        _design(taken.nodes.ravel(), across, len(at)),
        (np.repeat(lines.middle, 2) * np.conj(across)).real,
        np.sqrt((loose**2 + lines.se_offset**2)[:, None] + tilt**2).ravel(),
        np.repeat(~taken.shared, 2),
    )
    first, second = np.array(assignment.expected.tied, dtype=np.int64).reshape(-1, 2).T
    apart = _both_axes(first, len(at)) - _both_axes(second, len(at))
    zero = np.zeros(len(apart))
    ties = _LineRows(apart, zero, zero + TIED_MM, zero > 0.0)
    place = xy(np.array(list(centres.values()), dtype=complex))
    circled = _both_axes(np.array(list(centres), dtype=np.int64), len(at))
    circles = _LineRows(circled, place, np.full(len(place), CENTRE_MM), np.zeros(len(place), dtype=bool))
    return _LineRows(
        *(
            np.concatenate([getattr(rows, name) for rows in (observed, ties, circles)])
            for name in _LineRows.__slots__
        )
    )


def _both_axes(nodes: IntArray, count: int) -> FloatArray:
    """Return (2r, 2n) rows that give the coordinates of nodes, along x and along y of each node in turn."""
    return _design(np.repeat(nodes, 2), np.tile([1.0 + 0j, 1j], len(nodes)), count)


def _end_rows(taken: _Taken, at: ComplexArray, density: EndDensity) -> _EndRows:
    """Return rows for ends of strokes that serve one edge, and tips on any stroke, within reach of a node."""
    lines, rows, slots = taken.lines, np.arange(len(taken.edge)), []
    for slot in (0, 1):
        node, other = at[taken.nodes[:, slot]], at[taken.nodes[:, 1 - slot]]
        forward = ((node - other) * np.conj(lines.along)).real > 0
        outward = np.where(forward, lines.along, -lines.along)
        ends = np.stack([lines.start, lines.end])
        nearer = np.abs(ends - node).argmin(axis=0)
        end, place = ((points * np.conj(outward)).real for points in (ends[nearer, rows], node))
        along, sure = lines.tips_towards(rows, forward)
        tip = ((lines.start[:, None] + along * lines.along[:, None]) * np.conj(outward)[:, None]).real
        sure = np.where(np.abs(tip - place[:, None]) < TIP_REACH_MM, sure, 0.0)
        sure = sure * np.minimum(1.0, SUREST / np.maximum(sure.sum(axis=1), 1e-9))[:, None]
        here = (np.abs(end - place) < END_REACH_MM) & ~taken.shared
        before, variance, share = density.before(lines.se_end[rows, nearer])
        unmarked = here * (1.0 - sure.sum(axis=1))
        slots.append((
            _design(taken.nodes[:, slot], outward, len(at)),
            np.column_stack([end[:, None] - before, tip]),
            np.column_stack([variance, np.full(tip.shape, TIP_MM**2)]),
            np.column_stack([share * unmarked[:, None], sure]),
        ))  # fmt: skip
    every = _EndRows(*(np.concatenate(parts) for parts in zip(*slots, strict=True)))
    near = every.share.any(axis=1)
    return _EndRows(every.design[near], every.mean[near], every.variance[near], every.share[near])
