"""Nodes fitted to the strokes assigned to them, with standard errors and confidence."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.reading.lines import TIP_MM, BoolArray, Lines
from grader.reading.matching import Explanation
from grader.records import FloatArray
from reference.geometry import ComplexArray

ROUNDS = 6
LEAST_REDRAW_MM = 0.12
MOST_REDRAW_MM = 0.6
USUAL_REDRAW_MM = 0.25
DOUBT = 4.0
"""The usual redraw error counts as much as this many spare observations."""
SHARED_MM = 0.5
WIDE_MM = 0.7
AT_MM = 0.2
"""How far a stroke that ends at its node ends from it, but for the error of seeing its end."""
HIDDEN_MM = 0.5
"""Standard errors above this say that other ink goes on beyond the end."""
END_REACH_MM = 5.0
CENTRE_MM = 0.2
"""How far a circle drawn around a node is off it."""
SUREST = 0.97
TIP_REACH_MM = 3.5
THROUGH = 0.02
"""Per mm: how likely a stroke runs on past a node, beyond reach."""
TIED_MM = 0.02
"""Nodes that lie in one place are one place."""
BUNDLE_COSINE = 0.87
"""Of 30 degrees: strokes at less lie on one another for 1 mm and more from their node."""
SPREAD = 0.7
"""Standard errors beside those of the model: with it, errors of lengths read rightly have a root mean
square of 0.8 to 0.95 of their standard errors on sheets drawn by two simulations."""
LOOSE_MM = 6.0
"""Standard error of the belief that keeps unseen nodes from running away: it decides nothing else."""


@dataclass(frozen=True, slots=True)
class EndModel:
    """Where strokes end about their nodes: at it, run on a little or far, or short of it.

    Attributes
    ----------
    at_mm : how far a stroke that ends at its node ends from it
    shares : of ends at the node, run on a little, run on far, and short of it
    reach_mm : mean lengths of the last three
    merged : the same two where other ink hides the end
    """

    at_mm: float = AT_MM
    shares: tuple[float, float, float, float] = (0.45, 0.3, 0.2, 0.05)
    reach_mm: tuple[float, float, float] = (0.6, 4.0, 1.2)
    merged_shares: tuple[float, float, float, float] = (0.35, 0.25, 0.2, 0.2)
    merged_reach_mm: tuple[float, float, float] = (1.0, 4.0, 2.5)

    def density(self, gap: FloatArray, se_end: FloatArray) -> FloatArray:
        """Per mm, of ends `gap` mm beyond their nodes; `se_end` is the end's own standard error."""
        hidden = se_end > HIDDEN_MM
        shares = np.where(hidden[None], _columns(self.merged_shares), _columns(self.shares))
        little, far, short = np.where(hidden[None], _columns(self.merged_reach_mm), _columns(self.reach_mm))
        sigma = np.hypot(self.at_mm, se_end)
        at = np.exp(-0.5 * (gap / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))
        beyond = 1.0 / (1.0 + np.exp(-np.clip(1.7 * gap / sigma, -60.0, 60.0)))
        over, under = np.maximum(gap, 0.0), np.minimum(gap, 0.0)
        return np.asarray(
            shares[0] * at
            + shares[1] * beyond * np.exp(-over / little) / little
            + shares[2] * beyond * np.exp(-over / far) / far
            + shares[3] * (1.0 - beyond) * np.exp(under / short) / short
        )


def _columns(values: tuple[float, ...]) -> FloatArray:
    return np.array(values)[:, None, None]


PLAN_ENDS = EndModel()
LINK_ENDS = EndModel(1.5, (0.7, 0.1, 0.1, 0.1), (2.0, 6.0, 3.0), (0.7, 0.1, 0.1, 0.1), (2.0, 6.0, 3.0))


@dataclass(frozen=True, slots=True)
class Fit:
    """Nodes fitted to strokes.

    Attributes
    ----------
    at, cov : (n,) complex mm and (2n, 2n) covariance
    redraw_mm : how far strokes miss their nodes on this figure
    residual_mm : (edges, 2) distance of the tail and the head from the edge's stroke, nan without one
    """

    at: ComplexArray
    cov: FloatArray
    redraw_mm: float
    residual_mm: FloatArray


@dataclass(frozen=True, slots=True)
class _Lines:
    """Rows: a node lies on a stroke's line: `design` @ nodes should equal `goal`, to `sigma` mm.

    `own` where the stroke is this edge's alone: then it also misses its nodes by the redraw error.
    """

    design: FloatArray
    goal: FloatArray
    sigma: FloatArray
    own: BoolArray


@dataclass(frozen=True, slots=True)
class _Ends:
    """Rows: a stroke ends about a node: along its outward direction, `design`, it ends at `end`.

    `end` is nan where the stroke runs on beyond reach. `tip` and `sure` (rows, t): where the vector
    itself seems to end, by an arrowhead or what else marks the node.
    """

    design: FloatArray
    end: FloatArray
    se: FloatArray
    tip: FloatArray
    sure: FloatArray


def fit_nodes(
    found: Explanation,
    lines: Lines,
    ends: EndModel = PLAN_ENDS,
    centres: Mapping[int, complex] | None = None,
) -> Fit:
    """Weighted least squares over all strokes taken, with large misfits held back.

    A stroke's end near its node may be the node or a line run on past it. Each end's own density is
    replaced by a Gaussian with the moments that it has in the light of everything else (expectation
    propagation; Minka 2001), so that the covariance owns up to what ends cannot tell.

    Arguments: `centres` of circles drawn around nodes, by node.
    """
    at = found.expected.at.copy()
    count = 2 * len(at)
    redraw = USUAL_REDRAW_MM
    about = _end_rows(found, lines, at)
    sites = _Sites(np.zeros(len(about.end)), np.zeros(len(about.end)))
    cov = np.eye(count) * LOOSE_MM**2
    rows = _line_rows(found, lines, at, centres or {})
    for _ in range(ROUNDS):
        sigma = np.sqrt(rows.sigma**2 + np.where(rows.own, redraw**2, 0.0))
        misfit = np.abs(rows.goal - rows.design @ _pairs(at)) / sigma
        weight = np.minimum(1.0, 2.0 / np.maximum(misfit, 1e-9)) / sigma**2
        normal = rows.design.T @ (rows.design * weight[:, None]) + np.eye(count) / LOOSE_MM**2
        right = rows.design.T @ (rows.goal * weight) + _pairs(found.expected.at) / LOOSE_MM**2
        normal = normal + about.design.T @ (about.design * sites.precision[:, None])
        right = right + about.design.T @ sites.pull
        cov = np.asarray(np.linalg.inv(normal), dtype=np.float64)
        state = cov @ right
        at = state[0::2] + 1j * state[1::2]
        redraw = _redraw((rows.goal - rows.design @ state)[rows.own], count)
        used, sites = sites, _renewed(sites, about, state, cov, ends)
    bundled = normal - about.design.T @ (about.design * (used.precision * _repeated(about))[:, None])
    return Fit(at, SPREAD**2 * np.linalg.inv(bundled), redraw, _residuals(found, lines, at))


def _repeated(about: _Ends) -> FloatArray:
    """Share of each end's evidence that other ends of its bundle give already.

    Strokes that reach a node side by side run into one another's ink, and end by mistake together:
    for the covariance all their ends count as one.
    """
    alike = about.design @ about.design.T > BUNDLE_COSINE
    return np.asarray(1.0 - 1.0 / np.maximum(alike.sum(axis=1), 1))


@dataclass(frozen=True, slots=True)
class _Sites:
    """The Gaussian that stands for each end: its precision, and precision times place."""

    precision: FloatArray
    pull: FloatArray


def _renewed(sites: _Sites, about: _Ends, state: FloatArray, cov: FloatArray, ends: EndModel) -> _Sites:
    """Half a step towards the moments of each end's own density in the light of everything else."""
    if not len(about.end):
        return sites
    mean = about.design @ state
    variance = np.maximum(np.einsum("ij,jk,ik->i", about.design, cov, about.design), 1e-6)
    rest = np.maximum(1.0 / variance - sites.precision, 1.0 / LOOSE_MM**2)
    rest_mean = (mean / variance - sites.pull) / rest
    grid = np.linspace(-4.0, 4.0, 241)
    place = rest_mean[:, None] + grid / np.sqrt(rest)[:, None]
    weight = np.exp(-0.5 * grid**2) * _density(about, place, ends)
    weight /= weight.sum(axis=1, keepdims=True)
    new_mean = (weight * place).sum(axis=1)
    spread = np.sqrt((weight * (place - new_mean[:, None]) ** 2).sum(axis=1))
    # Where little else tells, the likeliest place: the mean would lie where no end is likely.
    likeliest = np.take_along_axis(place, weight.argmax(axis=1)[:, None], axis=1)[:, 0]
    new_mean = np.where(spread > WIDE_MM, likeliest, new_mean)
    new_variance = np.maximum((weight * (place - new_mean[:, None]) ** 2).sum(axis=1), 1e-4)
    fresh = np.maximum(1.0 / new_variance - rest, 0.0)
    fresh_pull = np.where(fresh > 0.0, new_mean / new_variance - rest_mean * rest, 0.0)
    return _Sites(0.5 * (sites.precision + fresh), 0.5 * (sites.pull + fresh_pull))


def _density(about: _Ends, place: FloatArray, ends: EndModel) -> FloatArray:
    """Per mm, (rows, n): how likely what is seen along each stroke is for nodes at `place` (rows, n)."""
    gap = about.end[:, None] - place
    inked = np.where(np.isnan(gap), THROUGH, ends.density(np.nan_to_num(gap), about.se[:, None]))
    off = about.tip[:, None, :] - place[:, :, None]
    sure = about.sure[:, None, :]
    marked = (sure * np.exp(-0.5 * (off / TIP_MM) ** 2) / (TIP_MM * np.sqrt(2.0 * np.pi))).sum(axis=2)
    return np.asarray(marked + (1.0 - about.sure.sum(axis=1))[:, None] * inked)


def _pairs(values: ComplexArray) -> FloatArray:
    return np.column_stack([values.real, values.imag]).ravel()


def _line_rows(found: Explanation, lines: Lines, at: ComplexArray, centres: Mapping[int, complex]) -> _Lines:
    design, goal, sigma, own = [], [], [], []
    middles = lines.middle
    for index, edge in enumerate(found.expected.edges):
        row = int(found.stroke[index])
        if row < 0:
            continue
        along, middle = complex(lines.along[row]), complex(middles[row])
        loose = SHARED_MM if found.shared[index] else 0.0
        for node in (edge.tail, edge.head):
            arm = float(((at[node] - middle) * np.conj(along)).real)
            design.append(_row(len(at), node, 1j * along))
            goal.append(float((middle * np.conj(1j * along)).real))
            tilt = lines.se_angle[row] * arm
            sigma.append(float(np.sqrt(loose**2 + lines.se_offset[row] ** 2 + tilt**2)))
            own.append(not found.shared[index])
    for first, second in found.expected.tied:
        for axis in (1.0 + 0j, 1j):
            design.append(_row(len(at), first, axis) - _row(len(at), second, axis))
            goal.append(0.0)
            sigma.append(TIED_MM)
            own.append(False)
    for node, centre in centres.items():
        for axis, value in ((1.0 + 0j, centre.real), (1j, centre.imag)):
            design.append(_row(len(at), node, axis))
            goal.append(value)
            sigma.append(CENTRE_MM)
            own.append(False)
    if not design:
        return _Lines(np.zeros((0, 2 * len(at))), np.zeros(0), np.zeros(0), np.zeros(0, dtype=bool))
    return _Lines(np.array(design), np.array(goal), np.array(sigma), np.array(own))


def _end_rows(found: Explanation, lines: Lines, at: ComplexArray) -> _Ends:
    """The ends of strokes of their own, and the tips on any, that lie within reach of a node."""
    design, goal, errors, tips, sures = [], [], [], [], []
    for index, edge in enumerate(found.expected.edges):
        row = int(found.stroke[index])
        if row < 0:
            continue
        for node, other, head in ((edge.tail, edge.head, False), (edge.head, edge.tail, True)):
            along = complex(lines.along[row])
            forward = ((at[node] - at[other]) * np.conj(along)).real > 0
            along = along if forward else -along
            end, error = lines.nearer_end(row, complex(at[node]))
            tip, sure = _near_tips(lines, row, complex(at[node]), along, head=head)
            here = abs(((end - at[node]) * np.conj(along)).real) < END_REACH_MM and not found.shared[index]
            if here or sure.any():
                design.append(_row(len(at), node, along))
                goal.append(float((end * np.conj(along)).real) if here else np.nan)
                errors.append(error)
                tips.append(tip)
                sures.append(sure)
    if not design:
        return _Ends(np.zeros((0, 2 * len(at))), np.zeros(0), np.zeros(0), *np.zeros((2, 0, 0)))
    told = _telling(np.array(tips), np.array(sures))
    return _Ends(np.array(design), np.array(goal), np.array(errors), *told)


def _telling(tips: FloatArray, sures: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same without the columns of tips that tell nothing."""
    most = int(np.count_nonzero(sures, axis=1).max())
    first = np.argsort(-sures, axis=1, kind="stable")[:, :most]
    return np.take_along_axis(tips, first, axis=1), np.take_along_axis(sures, first, axis=1)


def _near_tips(
    lines: Lines, row: int, node: complex, along: complex, *, head: bool
) -> tuple[FloatArray, FloatArray]:
    """Places along the outward direction, and probabilities, of one stroke's tips near a node."""
    forward = np.array([(along * np.conj(lines.along[row])).real > 0])
    place, sure = lines.tips_towards(np.array([row]), forward, head=head)
    tip = ((lines.start[row] + place[0] * lines.along[row]) * np.conj(along)).real
    near = np.abs(tip - (node * np.conj(along)).real) < TIP_REACH_MM
    sure = np.where(near, sure[0], 0.0)
    return tip, sure * min(1.0, SUREST / max(float(sure.sum()), 1e-9))


def _row(count: int, node: int, along: complex) -> FloatArray:
    row = np.zeros(2 * count)
    row[2 * node : 2 * node + 2] = (along.real, along.imag)
    return row


def _residuals(found: Explanation, lines: Lines, at: ComplexArray) -> FloatArray:
    off = np.full((len(found.stroke), 2), np.nan)
    middles = lines.middle
    for index, edge in enumerate(found.expected.edges):
        row = int(found.stroke[index])
        if row >= 0:
            for slot, node in enumerate((edge.tail, edge.head)):
                off[index, slot] = ((at[node] - middles[row]) * np.conj(lines.along[row])).imag
    return off


def _redraw(off: FloatArray, unknowns: int) -> float:
    """How far strokes miss nodes here, from what is left over beyond the unknowns."""
    spare = len(off) - unknowns
    if spare <= 0:
        return USUAL_REDRAW_MM
    squares = np.sum(np.minimum(off**2, 1.0)) + DOUBT * USUAL_REDRAW_MM**2
    return float(np.clip(np.sqrt(squares / (spare + DOUBT)), LEAST_REDRAW_MM, MOST_REDRAW_MM))


NEAR_MM = 0.5
"""A node is right within this of what was drawn."""
ELSEWHERE_MM = 0.5
TEMPERATURE = 3.0
"""Scores are this much too sure of themselves: strokes of one hand err alike."""
FARTHEST = 12.0
"""Nats: rivals worse by more weigh nothing."""
HIGHEST = 0.995
WEIGHTS = {
    "placed": 0.34,
    "named": 0.34,
    "off_mm": -1.73,
    "mistaken": -0.23,
    "thin": -0.4,
    "marked": 1.47,
    "elsewhere": -1.86,
}
CONSTANT = -0.8
"""Of a logistic regression on sheets drawn by two simulations, the constant lowered by 0.1."""
PLACED_AND = 0.1
"""No surer than the geometric probability by more than this."""


@dataclass(frozen=True, slots=True)
class Rival:
    """Another explanation: its nodes by name, its score."""

    at: Mapping[str, complex]
    score: float


@dataclass(frozen=True, slots=True)
class Signs:
    """What tells how sure a vector (or node) is.

    Attributes
    ----------
    placed : geometric probability of lying within half a millimetre, from the fit's covariance
    named : share of the explanations that have it there
    off_mm : largest distance of its nodes from its stroke
    thin, mistaken : on a line thin as a construction line; in a plan explained by a mistake
    marked : probability of the less likely of the tips that mark the vector's two ends on its stroke
    elsewhere : probability of the likeliest other tip near by that might be meant
    """

    placed: float
    named: float
    off_mm: float = 0.1
    thin: bool = False
    mistaken: bool = False
    marked: float = 0.4
    elsewhere: float = 0.0


def sureness(signs: Signs) -> float:
    """Probability that the name is right and the vector read within half a millimetre."""
    told = CONSTANT
    told += WEIGHTS["placed"] * _log_odds(signs.placed) + WEIGHTS["named"] * _log_odds(signs.named)
    told += WEIGHTS["off_mm"] * min(signs.off_mm, 1.5)
    told += WEIGHTS["marked"] * signs.marked + WEIGHTS["elsewhere"] * signs.elsewhere
    told += WEIGHTS["mistaken"] * signs.mistaken + WEIGHTS["thin"] * signs.thin
    return min(1.0 / (1.0 + math.exp(-told)), signs.placed + PLACED_AND, HIGHEST)


def _log_odds(probability: float) -> float:
    return math.log((probability + 0.002) / (1.002 - probability))


def within(cov: FloatArray, radius_mm: float = NEAR_MM) -> float:
    """Probability that a Gaussian error of this covariance is shorter than the radius."""
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(cov), 1e-12))
    first, second = (math.erf(radius_mm / (s * math.sqrt(2.0))) for s in spread)
    return float(first * second)


def of_names(names: Sequence[str], at: ComplexArray, score: float, rivals: Sequence[Rival]) -> FloatArray:
    """Share of the explanations, by their scores, that have each node where it is read."""
    agree, total = np.ones(len(names)), np.ones(len(names))
    for rival in rivals:
        weight = math.exp(min(0.0, rival.score - score) / TEMPERATURE)
        for place, name in enumerate(names):
            if name not in rival.at or np.isnan(rival.at[name]):
                continue
            total[place] += weight
            agree[place] += weight * (abs(rival.at[name] - at[place]) < ELSEWHERE_MM)
    return np.asarray(agree / total)


def of_places(fit: Fit) -> FloatArray:
    """Probability for every node that it lies within half a millimetre of where it was drawn."""
    return np.array(
        [within(fit.cov[2 * node : 2 * node + 2, 2 * node : 2 * node + 2]) for node in range(len(fit.at))]
    )
