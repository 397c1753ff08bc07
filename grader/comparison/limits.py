"""One deviation against one tolerance, and what its standard error leaves open."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from grader.outcomes import Reason
from grader.rubric import ToleranceTable

Level = Literal["none", "partial", "full"]
LEVELS: tuple[Level, ...] = ("none", "partial", "full")
ROUNDING = 1e-9
"""Relative: a deviation this little above its tolerance is on it."""


def worse(levels: Iterable[Level]) -> Level:
    """The worst level."""
    return LEVELS[min(LEVELS.index(level) for level in levels)]


def better(levels: Iterable[Level]) -> Level:
    """The best level."""
    return LEVELS[max(LEVELS.index(level) for level in levels)]


@dataclass(frozen=True, slots=True)
class Limit:
    """A deviation held against its tolerance.

    Attributes
    ----------
    what : ``length``, ``direction``, ``value`` or ``scale``
    off : deviation without its sign, in the unit of `tolerance`
    se : standard error of the deviation
    allowance : the tolerances that it is held against: the band of partial marks, and how many
        standard errors a verdict must be away from changing
    reason : said where the verdict is not full
    """

    what: str
    off: float
    tolerance: float
    se: float
    allowance: ToleranceTable
    reason: Reason

    def level_at(self, off: float) -> Level:
        """The verdict if the deviation were this."""
        limit = self.tolerance * (1.0 + ROUNDING)
        if off <= limit:
            return "full"
        return "partial" if off <= limit * self.allowance.partial_factor else "none"

    @property
    def level(self) -> Level:
        """The verdict on the deviation as it is."""
        return self.level_at(self.off)

    @property
    def worst(self) -> Level:
        """The verdict at the far end of the standard error."""
        return self.level_at(self.off + self.allowance.certain_errors * self.se)

    @property
    def best(self) -> Level:
        """The verdict at the near end of the standard error."""
        return self.level_at(max(self.off - self.allowance.certain_errors * self.se, 0.0))


@dataclass(frozen=True, slots=True)
class Mark:
    """Several limits together: the worst of them counts.

    Attributes
    ----------
    level : the verdict as measured
    worst, best : the verdicts that the standard errors leave open
    reasons : the losses, worst first; then remarks that cost nothing
    """

    level: Level
    worst: Level
    best: Level
    reasons: tuple[Reason, ...] = ()

    @property
    def is_certain(self) -> bool:
        """Whether the standard errors leave only one verdict."""
        return self.worst == self.best


def mark(limits: list[Limit], remarks: tuple[Reason, ...] = ()) -> Mark:
    """The mark that several limits give; full where there are none."""
    if not limits:
        return Mark("full", "full", "full", remarks)
    by_loss = sorted(limits, key=lambda limit: LEVELS.index(limit.level))
    losses = tuple(limit.reason for limit in by_loss if limit.level != "full")
    near = tuple(
        Reason(
            "near_limit",
            {"what": limit.what, "off": limit.off, "tolerance": limit.tolerance, "se": limit.se},
        )
        for limit in by_loss
        if limit.worst != limit.best
    )
    return Mark(
        worse(limit.level for limit in limits),
        worse(limit.worst for limit in limits),
        worse(limit.best for limit in limits),
        (*losses, *near, *remarks),
    )
