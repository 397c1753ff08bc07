"""The audit of a class: how many settled verdicts may be wrong, and which ones are reopened.

The settled verdicts of a class stand in an order that depends on nothing but their names: the ones checked
first are a random sample, whatever their probability, and a review that is started again goes on with it.
How many of all are wrong is bounded by a confidence sequence for sampling without replacement: it holds
whenever the teacher stops, also because the figure looks good [1]. With W wrong verdicts among N and a prior
on W, the ratio of prior to posterior probability of the true W is a martingale that starts at 1; by Ville's
inequality it reaches 20 with a probability of 5 % at most. What has not reached it is the confidence set.

[1] I. Waudby-Smith, A. Ramdas: Confidence sequences for sampling without replacement. NeurIPS 2020.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Literal, get_args

import numpy as np
import scipy

from grader.comparison.outcomes import left_open
from grader.comparison.verdicts import FULL
from grader.documents import (
    CriterionDocument,
    LikeDocument,
    OpenedDocument,
    ReliabilityDocument,
    ReportDocument,
    SaidDocument,
    Source,
    TrustDocument,
    Verdict,
)
from grader.marking.decided import FOR_THE_STUDENT
from grader.marking.mark import score
from grader.outcomes import CHARGED, CREDITED, Judgement, Outcome
from grader.records import FloatArray, Reason
from grader.rubric import RubricFile
from grader.tables.decision_texts import audit_answer
from reference.drawing.canvas import A3_MM

CONFIDENCE = 0.95
PRIOR_NONE = 0.5
"""Prior probability that no verdict is wrong: an audit that finds nothing then comes near the bound of a
sample of fixed size (24 right: 12.6 instead of 11.7 %). Every prior is valid; it only moves the width."""
PRIOR_FEW = 32.0
"""Otherwise W is beta-binomial with parameters 1 and this: 3 % are wrong in the mean, which is what a rubric
that settles from 0.97 promises."""
LEAST_SURE = 5
"""Verdicts offered because they are least sure; more of them are no sample of anything."""
NOT_CHECKED = frozenset({"not_measured", "optional", "at_stake"})
"""Reasons of a verdict that nobody can find wrong: nothing was handed in, or too little is at stake."""
NO_LONGER_SAID = FOR_THE_STUDENT | {"right"}
"""Reasons of a settled verdict that would contradict an open one."""
OPENED = "found_wrong_elsewhere"
"""The reason of a verdict that an audit opened."""
SLANTED = 2e-3
"""From such a change of scale across the sheet on a camera took it."""
Answer = Literal["right", "wrong", "unclear"]


# The bound ----------------------------------------------------------------------------------------


def wrong_between(total: int, wrong: int, right: int) -> tuple[int, int]:
    """The least and the largest number of wrong ones among `total`, after some were checked at random.

    Each of the two holds with 95 % confidence, at every moment of the audit at once.
    """
    numbers = np.arange(total + 1.0)
    checked = wrong + right
    is_possible = (numbers >= wrong) & (numbers <= total - right)
    log = np.full(total + 1, -np.inf)
    some = numbers[is_possible]
    log[is_possible] = _log_choose(some, wrong) + _log_choose(total - some, right)
    log -= _log_choose(np.array([float(total)]), checked)
    prior = np.log1p(-PRIOR_NONE) + _log_choose(np.full(total + 1, float(total)), numbers)
    betaln = scipy.special.betaln
    prior += betaln(numbers + 1.0, total - numbers + PRIOR_FEW) - betaln(1.0, PRIOR_FEW)
    prior[0] = np.logaddexp(prior[0], np.log(PRIOR_NONE))
    left = np.flatnonzero(scipy.special.logsumexp(prior + log) - log < -np.log1p(-CONFIDENCE))
    return int(left[0]), int(left[-1])


def _log_choose(of: FloatArray, some: FloatArray | float) -> FloatArray:
    log = scipy.special.gammaln
    return np.asarray(log(of + 1.0) - log(some + 1.0) - log(of - some + 1.0))


# The verdicts that can be checked -----------------------------------------------------------------


def order_of(student: str, position: int | None, criterion: str) -> bytes:
    """Return a criterion's place in the random order, which depends on nothing but names."""
    return sha256(f"{student}/{position}/{criterion}".encode()).digest()


@dataclass(frozen=True, slots=True)
class Checkable:
    """A verdict that the program settled, and what a person found of it.

    Attributes
    ----------
    student, position, criterion : whose, and on what
    answer : None where nobody has looked
    by_audit : whether the answer was asked for, and not a verdict that a person decided by the way
    """

    student: str
    position: int | None
    criterion: str
    source: Source
    said: SaidDocument
    answer: Answer | None
    by_audit: bool

    @property
    def order(self) -> bytes:
        """Its place in the random order."""
        return order_of(self.student, self.position, self.criterion)


def said_of(report: ReportDocument, criterion: CriterionDocument) -> SaidDocument | None:
    """The program's own verdict on a criterion; None where it had none."""
    if criterion.id in report.said or criterion.decided is not None:
        return report.said.get(criterion.id)
    is_open = criterion.verdict == "review"
    verdict = criterion.proposed if is_open else criterion.verdict
    if verdict not in CREDITED | CHARGED or criterion.probability is None:
        return None
    return SaidDocument(
        verdict=verdict, settled=not is_open, probability=criterion.probability, mistake=criterion.mistake
    )


def checkable(reports: Sequence[ReportDocument]) -> list[Checkable]:
    """The settled verdicts of a class in the order in which an audit asks for them."""
    found = [one for report in reports for one in _of_report(report) if one.said.settled]
    return sorted(found, key=lambda one: one.order)


def _of_report(report: ReportDocument) -> Iterator[Checkable]:
    source = _source_of(report)
    answers = {row.criterion: row.verdict for row in report.decisions if row.criterion.startswith("audit:")}
    for criterion in report.criteria:
        said = said_of(report, criterion)
        if said is None or NOT_CHECKED & {*criterion.reasons}:
            continue
        answer, row = None, answers.get(f"audit:{criterion.id}")
        if row is not None and audit_answer(row).said == said.verdict:
            answer = audit_answer(row).answer
        by_audit = answer is not None
        if criterion.decided is not None:
            # What a person decided says more than what the same person had answered.
            answer = _answer_by(criterion, said)
        yield Checkable(
            report.student_id, report.position, criterion.id, source, said, answer, by_audit  # type: ignore[arg-type]
        )  # fmt: skip


def _source_of(report: ReportDocument) -> Source:
    """The source of a submission; a photo shows one side of the sheet nearer than the other."""
    sheets = [one.sheet for one in report.reading.sheets if one.sheet is not None]
    if not sheets:
        return "entered"
    slants = (abs(one.mm_to_px[2][0]) + abs(one.mm_to_px[2][1]) for one in sheets)
    if max(slants) * A3_MM[0] > SLANTED:
        return "photo"
    return "printed" if any(one.method == "markers" for one in sheets) else "plain"


def _answer_by(criterion: CriterionDocument, said: SaidDocument) -> Answer:
    """Return whether a person's verdict on a criterion is the program's."""
    if criterion.verdict not in CREDITED | CHARGED:
        return "unclear"
    same = criterion.verdict == said.verdict or {criterion.verdict, said.verdict} <= CREDITED
    return "right" if same else "wrong"


def sample(verdicts: Sequence[Checkable]) -> list[Checkable]:
    """The random sample so far: the verdicts before the first one that nobody has looked at."""
    first = next((index for index, one in enumerate(verdicts) if one.answer is None), len(verdicts))
    return list(verdicts[:first])


def next_to_check(verdicts: Sequence[Checkable], count: int) -> list[Checkable]:
    """The verdicts to ask for next: the random sample's next `count`, then the least sure of all."""
    waiting = [one for one in verdicts if one.answer is None]
    least = sorted(verdicts, key=lambda one: one.said.probability)[:LEAST_SURE]
    return list(dict.fromkeys([*waiting[:count], *(one for one in least if one.answer is None)]))


# What follows -------------------------------------------------------------------------------------


def trust_of(reports: Sequence[ReportDocument], settle: float) -> TrustDocument | None:
    """The result of the checks in a class; None before anybody has checked anything.

    Arguments: `settle` is the rubric's.
    """
    if not any(report.decisions for report in reports):
        return None
    verdicts = checkable(reports)
    checked = sample(verdicts)
    further = [one for one in verdicts if one.by_audit and one not in checked]
    moved = sum(row.criterion.startswith("node:") for report in reports for row in report.decisions)
    proposals = [
        one for report in reports for one in _of_report(report) if not one.said.settled and one.answer
    ]
    if not (checked or further or proposals or moved):
        return None
    count = Counter(one.answer for one in checked)
    low, high = wrong_between(len(verdicts), count["wrong"], count["right"])
    _, high = wrong_between(len(verdicts), count["wrong"] + count["unclear"], count["right"])
    raised = None
    promised = max((1.0 - settle) * len(verdicts), sum(1.0 - one.said.probability for one in verdicts))
    if low > promised:
        raised = _raised([*checked, *further], settle)
    return TrustDocument(
        settled=len(verdicts),
        audited=len(checked),
        right=count["right"],
        unclear=count["unclear"],
        at_most=high / len(verdicts) if checked else None,
        least_sure=len(further),
        least_sure_right=sum(one.answer == "right" for one in further),
        settle=settle,
        raised=raised,
        opened=list(_opened(verdicts, [*checked, *further], raised)),
        reliability=list(_reliability([*checked, *further], proposals)),
        moved=moved,
    )


def _raised(checked: Sequence[Checkable], settle: float) -> float:
    """The least probability of a wrong verdict above which as few are wrong as promised, else the largest."""
    wrong = sorted(one.said.probability for one in checked if one.answer == "wrong")
    for most in wrong:
        above = [one for one in checked if one.said.probability > most and one.answer != "unclear"]
        if above and sum(one.answer == "wrong" for one in above) <= (1.0 - settle) * len(above):
            return most
    return wrong[-1]


def _opened(
    verdicts: Sequence[Checkable], checked: Sequence[Checkable], raised: float | None
) -> Iterator[OpenedDocument]:
    """List what is no longer trusted: verdicts like those found wrong, and those that are not sure enough."""
    likes = {
        LikeDocument(
            criterion=one.criterion, verdict=one.said.verdict, mistake=one.said.mistake,
            most=one.said.probability,
        ): one.student
        for one in checked
        if one.answer == "wrong" and one.by_audit
    }  # fmt: skip
    if raised is not None:
        likes[LikeDocument(most=raised)] = ""
    for like, student in likes.items():
        count = sum(is_like(one.criterion, one.said, like) for one in verdicts)
        yield OpenedDocument(like=like, student_id=student, count=count)


def is_like(criterion: str, said: SaidDocument, like: LikeDocument) -> bool:
    """Return whether a verdict is one of those that are no longer trusted."""
    if said.probability > like.most:
        return False
    return like.criterion is None or (criterion, said.verdict, said.mistake) == (
        like.criterion, like.verdict, like.mistake
    )  # fmt: skip


def opened_in(report: ReportDocument, trust: TrustDocument | None) -> tuple[LikeDocument, ...]:
    """The kinds of verdicts that an audit opens in one submission."""
    likes = () if trust is None else tuple(one.like for one in trust.opened)
    own = [one for one in _of_report(report) if one.said.settled] if likes else []
    return tuple(like for like in likes if any(is_like(one.criterion, one.said, like) for one in own))


def with_said(report: ReportDocument, own: Judgement, decided: Collection[str]) -> ReportDocument:
    """The report with what the program itself said, where the verdict is another one or a person's.

    Arguments: `own` is the program's judgement, `decided` are the criteria that a person decided.
    """
    if all(one.confidence == 0.0 or one.verdict == "not_judged" for one in own.outcomes):
        return report
    now = {one.id: one.verdict for one in report.criteria}
    said = {
        one.criterion: found
        for one in own.outcomes
        if (one.criterion in decided or now.get(one.criterion) != one.verdict)
        and (found := said_by(one)) is not None
    }
    return report.model_copy(update={"said": said}) if said else report


def _reliability(
    settled: Sequence[Checkable], proposals: Sequence[Checkable]
) -> Iterator[ReliabilityDocument]:
    """Compare stated probabilities with results, by source; undecidable verdicts are left out."""
    for kind, verdicts in (("settled", settled), ("proposed", proposals)):
        for source in get_args(Source):
            own = [one for one in verdicts if one.source == source and one.answer != "unclear"]
            if own:
                said = sum(one.said.probability for one in own) / len(own)
                right = sum(one.answer == "right" for one in own)
                yield ReliabilityDocument(source=source, kind=kind, count=len(own), right=right, said=said)


# Marking ------------------------------------------------------------------------------------------


def opened_by_audit(judgement: Judgement, rubric: RubricFile, likes: Sequence[LikeDocument]) -> Judgement:
    """The judgement in which what an audit no longer trusts waits for a person."""
    outcomes = tuple(
        _open(one) if any(_is_opened(one, like) for like in likes) else one for one in judgement.outcomes
    )
    if outcomes == judgement.outcomes:
        return judgement
    return replace(judgement, outcomes=outcomes, score=score(rubric, outcomes))


def _is_opened(outcome: Outcome, like: LikeDocument) -> bool:
    said = said_by(outcome)
    is_checkable = not NOT_CHECKED & outcome.codes
    return said is not None and said.settled and is_checkable and is_like(outcome.criterion, said, like)


def said_by(outcome: Outcome) -> SaidDocument | None:
    """The verdict of an outcome as it stands in a report; None where nothing was judged."""
    is_open = outcome.verdict == "review"
    verdict = outcome.proposed_verdict if is_open else outcome.verdict
    if verdict == "not_judged":
        return None
    return SaidDocument(
        verdict=verdict, settled=not is_open, probability=outcome.probability, mistake=outcome.mistake
    )


def _open(outcome: Outcome) -> Outcome:
    """A settled outcome, open between nothing and all points: a wrong one may be wrong in any way."""
    best: Verdict = "follow_through" if outcome.verdict == "follow_through" else "full"
    reasons = (Reason(OPENED), *(one for one in outcome.reasons if one.code not in NO_LONGER_SAID))
    return replace(left_open(outcome, best, FULL, reasons), confidence=0.0)
