"""Verdicts to points: nothing is counted while it is under review, nothing that was not judged."""

from collections.abc import Mapping, Sequence

from grader.documents import Verdict
from grader.outcomes import Outcome, Score
from grader.rubric import CriterionTable, RubricFile

DECIMALS = 6
"""Points are told to so many decimals; more is the computer's rounding."""


def share_of(rubric: RubricFile, criterion: CriterionTable, verdict: Verdict) -> float:
    """The share of a criterion's points that a verdict gives."""
    shares: Mapping[str, float] = {
        "full": 1.0,
        "follow_through": 1.0,
        "partial": rubric.tolerance_of(criterion).partial_share,
        "none": 0.0,
    }
    return shares[verdict]


def score(rubric: RubricFile, outcomes: Sequence[Outcome]) -> Score:
    """The points of all criteria and their total.

    What was not judged counts neither for nor against: the total is scaled to the rubric's. While
    anything is under review there is no total, only what it lies between. Where nothing at all was
    judged, the score is open between nothing and everything.
    """
    criteria = {criterion.id: criterion for criterion in rubric.criterion}
    points: dict[str, float | None] = {}
    low = high = judged = 0.0
    is_open = False
    for outcome in outcomes:
        criterion = criteria[outcome.criterion]
        if outcome.verdict == "not_judged":
            points[criterion.id] = None
            continue
        worst, best = (share_of(rubric, criterion, end) * criterion.points for end in outcome.possible)
        low, high, judged = low + worst, high + best, judged + criterion.points
        under_review = outcome.verdict == "review"
        points[criterion.id] = None if under_review else round(worst, DECIMALS)
        is_open = is_open or under_review
    maximum = rubric.max_score
    if judged == 0.0:
        return Score(points, None, 0.0, maximum, maximum)
    low, high = (round(total * maximum / judged, DECIMALS) for total in (low, high))
    return Score(points, None if is_open else low, low, high, maximum)
