"""One deviation against one tolerance, and what its standard error leaves open.

A mark is the share of a criterion's points that it leaves: 1 full marks, 0 none, between them the
shares of the tolerance's bands.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from grader.outcomes import Reason
from grader.rubric import ToleranceTable

FULL, NONE = 1.0, 0.0
ROUNDING = 1e-9
"""Relative: a deviation this little above its tolerance is on it."""


@dataclass(frozen=True, slots=True)
class Limit:
    """A deviation held against its tolerance.

    Attributes
    ----------
    what : ``length``, ``direction``, ``value`` or ``scale``
    off : deviation without its sign, in the unit of `tolerance`
    plain : the tolerance without what it was widened by
    se : standard error of the deviation
    table : the rubric's: bands of partial marks, and how many standard errors a verdict must be away
        from changing
    reason : said where the mark is not full
    share, worst, best : the mark on the deviation as it is, at the far and at the near end of its error
    """

    what: str
    off: float
    tolerance: float
    plain: float
    se: float
    table: ToleranceTable
    reason: Reason
    share: float = field(init=False)
    worst: float = field(init=False)
    best: float = field(init=False)

    def __post_init__(self) -> None:
        margin, share = self.table.certain_errors * self.se, self.share_at(self.off)
        object.__setattr__(self, "share", share)
        object.__setattr__(self, "worst", self.share_at(self.off + margin) if margin else share)
        object.__setattr__(self, "best", self.share_at(max(self.off - margin, 0.0)) if margin else share)

    def share_at(self, off: float) -> float:
        """The share of the points at a deviation; bands are as wide as the plain tolerance says."""
        slack = 1.0 + ROUNDING
        if off <= self.tolerance * slack:
            return FULL
        for factor, share in self.table.all_bands:
            if off <= (self.tolerance + (factor - 1.0) * self.plain) * slack:
                return share
        return NONE


@dataclass(frozen=True, slots=True)
class Mark:
    """Several limits together: the worst of them counts.

    Attributes
    ----------
    share : of the points, as measured
    worst, best : the shares that the standard errors leave open
    reasons : the losses, worst first; then remarks that cost nothing
    """

    share: float
    worst: float
    best: float
    reasons: tuple[Reason, ...] = ()

    @property
    def is_certain(self) -> bool:
        """Whether the standard errors leave only one verdict."""
        return self.worst == self.best

    @property
    def is_full(self) -> bool:
        """Whether it is full marks for certain."""
        return self.worst == FULL

    def is_better(self, other: "Mark") -> bool:
        """Whether it leaves more than another, first for certain, then at best."""
        return (self.worst, self.best) > (other.worst, other.best)


ALL_RIGHT = Mark(FULL, FULL, FULL)


def mark(limits: Sequence[Limit], remarks: tuple[Reason, ...] = ()) -> Mark:
    """The mark that several limits give; full where there are none."""
    if not limits:
        return Mark(FULL, FULL, FULL, remarks)
    by_loss = sorted(limits, key=lambda limit: limit.share)
    losses = tuple(limit.reason for limit in by_loss if limit.share != FULL)
    near = tuple(
        Reason(
            "near_limit",
            {"what": limit.what, "off": limit.off, "tolerance": limit.tolerance, "se": limit.se},
        )
        for limit in by_loss
        if limit.worst != limit.best
    )
    return Mark(
        min(limit.share for limit in limits),
        min(limit.worst for limit in limits),
        min(limit.best for limit in limits),
        (*losses, *near, *remarks),
    )


def open_between(low: float, high: float, found: Mark, *reasons: Reason) -> Mark:
    """A mark that is open between two shares whatever was measured, with the reasons first."""
    return Mark(found.share, low, high, (*reasons, *found.reasons))


def left_open(found: Mark, by_hand: Mark) -> Mark:
    """A mark that a careful hand's errors alone leave open; `by_hand` is it with all that they allow."""
    if by_hand.best <= found.best:
        return found
    return open_between(found.worst, by_hand.best, found, Reason("hand_may_miss"))


def the_better(found: Mark, other: Mark, *reasons: Reason) -> Mark:
    """Two marks of which the better counts; the reasons are those of `other`, after `reasons`."""
    return Mark(
        max(found.share, other.share),
        max(found.worst, other.worst),
        max(found.best, other.best),
        (*reasons, *other.reasons),
    )


def the_worse(found: Mark, other: Mark) -> Mark:
    """Two marks of which the worse counts."""
    return Mark(
        min(found.share, other.share),
        min(found.worst, other.worst),
        min(found.best, other.best),
        (*found.reasons, *other.reasons),
    )
