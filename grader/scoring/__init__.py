"""Verdicts to points: nothing is counted while it is under review, nothing that was not judged."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from grader.documents import Verdict
from grader.outcomes import Outcome, Score
from grader.rubric import CriterionTable, RubricFile

DECIMALS = 6
"""Points are told to so many decimals; more is the computer's rounding."""


def share_of(rubric: RubricFile, criterion: CriterionTable, verdict: Verdict) -> float:
    """The share of a criterion's points that a verdict gives: of a partial one, that of the nearest band."""
    bands = rubric.tolerance_of(criterion).all_bands
    shares: Mapping[str, float] = {
        "full": 1.0,
        "follow_through": 1.0,
        "partial": bands[0][1] if bands else 0.0,
        "none": 0.0,
    }
    return shares[verdict]


def score(rubric: RubricFile, outcomes: Sequence[Outcome]) -> Score:
    """The points of all criteria and their total.

    What was not judged counts neither for nor against: a section that has a weight keeps it as long as
    any of it was judged, and the total is scaled to the rubric's. While anything is under review there
    is no total, only what it lies between. Where nothing at all was judged, the score is open between
    nothing and everything.
    """
    criteria, worth = {one.id: one for one in rubric.criterion}, rubric.points
    weighted = {section for section in rubric.sections if getattr(rubric.weights, section) is not None}
    points: dict[str, float | None] = {}
    totals: dict[str, _Total] = {}
    for outcome in outcomes:
        criterion = criteria[outcome.criterion]
        section = criterion.section if criterion.section in weighted else ""
        total = totals.setdefault(section, _Total(is_weighted=bool(section)))
        total.whole += worth[criterion.id]
        points[criterion.id] = None
        if outcome.verdict != "not_judged":
            given = total.add(worth[criterion.id], *_shares(rubric, criterion, outcome))
            points[criterion.id] = None if outcome.verdict == "review" else given
    maximum = rubric.max_score
    judged = sum(total.in_full for total in totals.values())
    if judged == 0.0:
        return Score(points, None, 0.0, maximum, maximum)
    low, high = (
        round(sum(ends) * maximum / judged, DECIMALS)
        for ends in zip(*(total.ends for total in totals.values()), strict=True)
    )
    is_open = any(outcome.verdict == "review" for outcome in outcomes)
    return Score(points, None if is_open else low, low, high, maximum)


def _shares(rubric: RubricFile, criterion: CriterionTable, outcome: Outcome) -> tuple[float, float]:
    """The shares of a criterion's points that its verdict leaves, at worst and at best."""
    if outcome.shares:
        return outcome.shares[0], outcome.shares[-1]
    worst, best = (share_of(rubric, criterion, end) for end in outcome.possible)
    return worst, best


@dataclass(slots=True)
class _Total:
    """The points of a section with a weight of its own, or of all that have none."""

    low: float = 0.0
    high: float = 0.0
    judged: float = 0.0
    whole: float = 0.0
    is_weighted: bool = False

    def add(self, worth: float, worst: float, best: float) -> float:
        """Count one criterion; its points at worst."""
        self.low, self.high = self.low + worst * worth, self.high + best * worth
        self.judged += worth
        return round(worst * worth, DECIMALS)

    @property
    def scale(self) -> float:
        """What its points are multiplied by for what was not judged of it."""
        return self.whole / self.judged if self.is_weighted and self.judged else 1.0

    @property
    def in_full(self) -> float:
        """What it could give."""
        return self.judged * self.scale

    @property
    def ends(self) -> tuple[float, float]:
        """What it gives at worst and at best."""
        return self.low * self.scale, self.high * self.scale
