"""The results of judging a submission, as data without text in any language.

`grader.comparison` makes an `Outcome` per rubric criterion, `grader.marking.naming` a `NamedMistake`
per mistake, `grader.marking.mark` the points; `grader.feedback` turns the `Reason`s into sentences in the
student's language.

Codes of reasons, with their parameters (numbers in mm, degrees or SI; names as in the assignment):

===================== ====================================================== =========================
code                  parameters                                             said when
===================== ====================================================== =========================
right                                                                        within the tolerance
too_long, too_short   measured_mm, expected_mm, off_mm, tolerance_mm         the drawn length is off
turned_left,          measured_deg, expected_deg, off_deg, tolerance_deg     the direction is off:
turned_right                                                                 must turn back right/left
reversed                                                                     points the opposite way
place_off             off_mm, tolerance_mm                                   a point lies elsewhere
off_sheet                                                                    a centre off the sheet
should_be_zero        measured_mm, tolerance_mm                              a zero vector was drawn
too_short_to_judge    length_mm, least_mm                                    no direction is asked of it
made_trivial                                                                 an earlier mistake leaves it
                                                                             too short: not judged
value_too_large,      measured, expected, off, tolerance, unit               a computed value is off
value_too_small
value_reversed        measured, expected, unit                               its sign is wrong
sense_wrong                                                                  the sense alone is wrong
sense_missing                                                                a magnitude without sense
not_measured                                                                 nothing was handed in
optional                                                                     not handed in, not asked
unread                reason                                                 asked for, not read
not_drawn                                                                    no ink between nodes read
no_line                                                                      no ink to a point's place by
                                                                             similarity
value_alone                                                                  computed, and not drawn
triangle_shows        at, foot_mm                                            unread; its triangle was read
half_turn_missing     at                                                     reversed, long as its triangle
                                                                             on the sketch gives it
right_triangle        at                                                     so long by its triangle, at
                                                                             scales that do not allow that
triangle_wrong        at                                                     so long by a wrong triangle
not_carried_over      at, foot_mm, measured_mm                               not as its right triangle has it
by_similarity         of                                                     replaced by a right image
letters_exchanged     first, second                                          named by exchanged letters
letters_unclear       first, second                                          letters may be exchanged
entry_refused         reason                                                 an entry cannot be used
doubtful              confidence                                             read without confidence
near_limit            se, good_to, off, tolerance, what                      the error straddles a limit
counted_for_you       beyond, good_to, tolerance, what                       beyond a limit by less than the
                                                                             reading's error: counted
not_certainly_within  beyond, good_to, tolerance, what                       within it by less: not counted
at_stake                                                                     too little is left open
other_variant,        whose                                                  another student's data; the own
data_misread                                                                 ones misread
data_unclear          whose, confidence                                      it may follow other data
not_explained         unfit, of                                              no explanation fits the plan
hand_may_miss                                                                off by no more than a careful
                                                                             hand may miss what is
                                                                             ill-conditioned, or a mistake
readings_disagree     first, second, unit                                    scan and measurements differ
follows               what, of                                               right from own earlier value
                      (what: nodes, small_errors, scale, vector, value; of: its name)
decided                                                                      a person decided otherwise
found_wrong_elsewhere                                                        an audit found one like it wrong
scale_refused         text, why                                              declared, not understood
scale_off             declared, expected, unit                               declared, contradicted
scale_seems_off       declared, expected, unit                               contradicted by what was
                                                                             not read for certain
scale_assumed         used, unit                                             not declared
===================== ====================================================== =========================
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from grader.documents import Quantity, Tolerance, Verdict
from grader.records import Reason
from reference.construction.mistakes import Mistake
from reference.quantities import kind_of

CREDITED: frozenset[str] = frozenset({"full", "follow_through"})
CHARGED: frozenset[str] = frozenset({"none", "partial"})
"""Verdicts with all points, and those that cost some; the others are open, or not judged."""
EVEN = 0.5
"""Probability of a mark that is open for a reason without a known probability."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The verdict on one criterion.

    Attributes
    ----------
    criterion : id in the rubric
    name : the vector, its value (``v_B_value``), angular quantity or scale judged
    verdict : full, partial, none, follow_through, review, not_judged
    possible : under review, the verdicts it lies between (worst, best); else twice the verdict
    measured, expected, tolerance : the evidence; `expected` follows the original data, or the student's own
        earlier values if the verdict is follow_through
    confidence : that the verdict is right
    reasons : most important first; empty only for a declared scale that cannot be compared with anything
    mistake : code of the mistake that explains a loss, or None
    cause : that mistake, if the diagnosis found it
    shares : shares of the points for `possible`; empty if the verdicts alone determine them
    probability : that the verdict is right; under review, that the proposed share is
    proposed : the likeliest share of the points
    """

    criterion: str
    name: str
    verdict: Verdict
    measured: Quantity
    expected: Quantity
    tolerance: Tolerance
    confidence: float
    reasons: tuple[Reason, ...]
    possible: tuple[Verdict, Verdict]
    mistake: str | None = None
    cause: "NamedMistake | None" = None
    shares: tuple[float, ...] = ()
    probability: float = 1.0
    proposed: float = 0.0

    @property
    def codes(self) -> frozenset[str]:
        """The codes of its reasons."""
        return frozenset(reason.code for reason in self.reasons)

    @property
    def proposed_verdict(self) -> Verdict:
        """The verdict that corresponds to the proposed share."""
        if self.proposed == 1.0:
            return "follow_through" if "follow_through" in self.possible else "full"
        return "none" if self.proposed == 0.0 else "partial"


@dataclass(frozen=True, slots=True)
class NamedMistake:
    """A mistake that is named to a student, because it explains errors.

    Attributes
    ----------
    mistake : what was done instead of the right thing
    explains : the criteria that lost points by it
    confidence : the probability that it was made
    line : how a line was drawn wrongly: ``from`` a node, the ``link`` that gives its direction, and ``line =
        guide`` if it follows a guide, ``driving across`` or ``driving along`` for the driving link
    rivals : mistakes that explain it nearly as well: the submission (lengths alone, say) cannot tell them
        apart
    """

    mistake: Mistake
    explains: tuple[str, ...]
    confidence: float
    line: Mapping[str, str] = field(default_factory=dict)
    rivals: "tuple[NamedMistake, ...]" = ()

    @property
    def code(self) -> str:
        """The code of the contract."""
        return self.mistake.code

    @property
    def at(self) -> str:
        """The node, vector, scale or figure where it was made."""
        return self.mistake.at

    @property
    def detail(self) -> dict[str, float | str]:
        """Details of it besides code and place, by the names that reports and sentences use."""
        return {**_detail(self.mistake), **self.line}


def _detail(mistake: Mistake) -> dict[str, float | str]:
    match mistake:
        case Mistake(code="units", other=("typing", entered, meant)):
            return {"slip": "typing", "entered": float(entered), "meant": float(meant)}
        case Mistake(code="units", other=("entries", other)):
            return {"slip": "entries", "other": other}
        case Mistake(code="units", other=(slip, *more), factor=factor):
            found: dict[str, float | str] = {"slip": slip}
            found |= {"axis" if slip == "axis" else "unit": one for one in more}
            return found if abs(factor) == 1.0 else {**found, "factor": factor}
        case Mistake(code="rpm_not_converted", other=(slip, formula, right), factor=factor):
            return {"factor": factor, "slip": slip, "formula": formula, "instead_of": right}
        case Mistake(code="arithmetic", other=(slip,)):
            return {"slip": slip}
        case Mistake(code="scale_wrong" | "rpm_not_converted" | "arithmetic", factor=factor):
            return {} if factor == 1.0 else {"factor": factor}
        case Mistake(code="wrong_intersection", other=(name,)) if kind_of(name).name != "length":
            return {"instead": name}
        case Mistake(code="labels_swapped", other=(first, second)):
            return {"first": first, "second": second}
        case Mistake(code="other_variant", n=n, position=position, at=at):
            whose = (("n", n), ("position", position), ("part", at if at.endswith("_plan") else None))
            return {key: value for key, value in whose if value is not None}
        case Mistake(code="data_misread", parameters={"angle crank": angle}):
            return {"crank_deg": round(math.degrees(float(angle)), 1) % 360.0}
        case Mistake(code="figure_rotated", quarters=quarters) if quarters:
            return {"degrees": 90.0 * quarters}
        case Mistake(other=other) if other:
            return {"other": "".join(other)}
    return {}


@dataclass(frozen=True, slots=True)
class UsedScale:
    """A scale as declared and as used for marking, real units per millimetre.

    Attributes
    ----------
    text : as the student wrote it, None if not declared
    declared : parsed, None if not declared or refused
    used : the scale used for marking
    assumed : whether `used` comes from the assignment's rule or the drawn crank instead of the declaration
    refused : why a declared text was not accepted, or None
    """

    text: str | None
    declared: float | None
    used: float
    assumed: bool
    refused: Reason | None = None


@dataclass(frozen=True, slots=True)
class Score:
    """Points: `total` is None while anything is under review; `low` and `high` are its limits.

    Attributes
    ----------
    points : by criterion; None if under review or not judged
    expected : the mean of the total over the possible verdicts; None if nothing was judged
    maximum : the rubric's total; `total`, `low` and `high` are scaled to it if criteria were not judged
    """

    points: Mapping[str, float | None]
    total: float | None
    low: float
    high: float
    maximum: float
    expected: float | None = None


@dataclass(frozen=True, slots=True)
class Unfit:
    """The number of vectors that fit no explanation, `of` the number handed in."""

    vectors: int
    of: int


@dataclass(frozen=True, slots=True)
class Judgement:
    """All results of marking one submission.

    `unfit` : the vectors that no explanation reaches; None if one reaches every plan
    """

    outcomes: tuple[Outcome, ...]
    mistakes: tuple[NamedMistake, ...]
    scales: Mapping[str, UsedScale]
    score: Score
    unfit: Unfit | None = None

    @property
    def needs_review(self) -> bool:
        """True if a person must look before the score counts."""
        return self.score.total is None
