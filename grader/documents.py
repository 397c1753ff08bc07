"""Every JSON document that enters or leaves, as pydantic models with a published schema.

Coordinates in documents are millimetres from the upright sheet's top left corner (x right, y down);
nodes of an exact plan are relative to their pole, y up. Directions are degrees counter-clockwise
from +x, 0 <= d < 360. Real values are SI; scales are real units per millimetre on paper.
"""

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from reference.construction.mistakes import Code
from reference.quantities import FIGURE, value_name

SCHEMA_VERSION = 1

Version = Literal[1]
Verdict = Literal["full", "partial", "none", "follow_through", "review", "not_judged"]
Status = Literal["graded", "needs_review", "unreadable", "missing"]
ScaleName = Literal["kL", "kv", "ka", "kF"]
FigureName = Annotated[str, Field(pattern=FIGURE)]
Cause = Literal["assignment", "rubric", "submission", "roster", "decision", "program", "new", "gone"]
"""Cause of a changed mark."""
Sign = Literal["hand_errors", "same_place", "same_numbers", "same_picture", "other_number"]
"""Sign of similarity between sheets."""
Share = Annotated[float, Field(ge=0.0, le=1.0)]


def _with_english(titles: dict[str, str]) -> dict[str, str]:
    if "en" not in titles:
        raise ValueError("has no English title (en)")
    return titles


Titles = Annotated[dict[str, str], AfterValidator(_with_english)]
"""Titles by language, English among them."""
Parameters = dict[str, int | float | str | list[str]]
"""Values in a reason or problem: numbers (the name ends in the unit), vector names, texts as written."""


_GIVEN: dict[tuple[type, frozenset[str]], set[str]] = {}
"""Fields given to documents of each kind; a document's fields never change."""


class Document(BaseModel):
    """A table of a JSON document: frozen, no unknown fields, only finite numbers.

    A record with attributes of these names is accepted as it is, without copying field by field.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True, from_attributes=True
    )

    def model_post_init(self, _context: object) -> None:
        """Share the set of given fields with other documents of the kind: it is half of their memory."""
        given = self.__pydantic_fields_set__
        shared = _GIVEN.setdefault((type(self), frozenset(given)), given)
        object.__setattr__(self, "__pydantic_fields_set__", shared)


# Measurements: what a student measured ------------------------------------------------------------


class MeasurementsDocument(Document):
    """One student's measurements: drawn lengths and directions, and values computed from them."""

    model_config = ConfigDict(strict=True)

    schema_version: Version = 1
    student_id: str | None = None
    n: int | None = None
    position: int | None = None
    scales: dict[ScaleName, str | float] = {}
    """As the student declares them, with their units."""
    segments_mm: dict[str, Annotated[float, Field(ge=0.0)]] = {}
    directions_deg: dict[str, float] = {}
    """Counter-clockwise from the assignment's +x."""
    values: dict[str, float | str] = {}
    """SI; angular values counter-clockwise positive, or with a sense: ``2.09 cw``, or ``omega_2_sense``."""


# Reading: what was read on one sheet --------------------------------------------------------------


class ReasonDocument(Document):
    """A reason: its code, a sentence in English, and the sentence's parameters."""

    code: str
    message: str
    parameters: Parameters = {}


class ProblemDocument(ReasonDocument):
    """Something a person should know."""

    file: str | None = None


class SheetDocument(Document):
    """Position of the sheet in its image."""

    method: str
    px_per_mm: float
    rotation_deg: float
    residual_mm: float
    mm_to_px: list[list[float]]
    """(3, 3) homography; the centre of the stored image's top left pixel is (0, 0)."""


class NodeDocument(Document):
    """A node as drawn, sheet millimetres."""

    x_mm: float
    y_mm: float
    se_mm: float
    confidence: Share


class OtherReadingDocument(Document):
    """Another reading of a vector; the confidence is that it is this one or one listed before it."""

    length_mm: float
    direction_deg: float
    confidence: Share


class VectorDocument(Document):
    """A vector as drawn; a zero vector has no direction."""

    length_mm: float | None
    se_mm: float
    direction_deg: float | None
    se_deg: float | None
    confidence: Share
    others: list[OtherReadingDocument] = []


class FigureDocument(Document):
    """A mechanism sketch or a plan as read."""

    nodes: dict[str, NodeDocument]
    vectors: dict[str, VectorDocument]
    drawn: dict[str, list[tuple[float, float]]] = {}
    """Both ends of each vector on the sheet, mm, of a force polygon in another order than the usual.

    The nodes are where the vectors put them in the usual order.
    """


class AltitudeDocument(Document):
    """A right triangle on the sketch: the velocity laid off at a joint, and the distance of the foot."""

    velocity_mm: float
    foot_mm: float


class UnreadDocument(Document):
    """A requested vector or length that was not read, and the reason in English."""

    name: str
    reason: str
    code: str = ""
    parameters: Parameters = {}


class TimingDocument(Document):
    """Milliseconds by stage."""

    decode: float
    sheet: float
    ink: float
    reading: float
    total: float


class ReadingDocument(Document):
    """The reading of one page; `sheet` is null if the page could not be registered."""

    schema_version: Version = 1
    source: str
    page: int
    student_id: str | None
    sheet: SheetDocument | None
    figures: dict[FigureName, FigureDocument]
    altitudes: dict[str, AltitudeDocument] = {}
    """By the normal component that the triangle gives."""
    unread: list[UnreadDocument] = []
    problems: list[ProblemDocument] = []
    timing_ms: TimingDocument | None = None


# Report: a submission's verdicts ------------------------------------------------------------------


class Quantity(Document):
    """A drawn or expected vector, an angular value or a scale; None if not known or meaningless.

    Length and direction are on paper, the value is in SI.
    """

    length_mm: float | None = None
    direction_deg: float | None = None
    value: float | None = None
    unit: str | None = None


class Tolerance(Document):
    """The deviation that full marks allow."""

    length_mm: float | None = None
    direction_deg: float | None = None
    value: float | None = None
    """For scales, angular quantities and computed values, in the unit of the expected value."""
    widened: bool = False
    """True if it is more than the rubric states, because small errors of careful drawing add up here."""


class DecidedDocument(Document):
    """The decision of a person: who, when (ISO 8601), the verdict before, and why."""

    by: str
    at: str
    before: Verdict | None
    """Null if the decision moved a node and the verdict follows from it."""
    comment: str = ""


class AppliedDecisionDocument(Document):
    """A row of the decisions as applied; `criterion` may be a node, a page, `total` or `comment`."""

    criterion: str
    verdict: str
    points: float | None
    comment: str
    by: str
    at: str


class SaidDocument(Document):
    """The program's own verdict on a criterion that a person decided or an audit opened."""

    verdict: Verdict
    """Settled, or proposed to a person."""
    settled: bool
    probability: Share
    mistake: str | None = None


class CriterionDocument(Document):
    """The verdict on one criterion of the rubric."""

    id: str
    title: str
    vector: str | None
    """The vector or angular quantity judged; null for a scale, a link and a computed value."""
    points: float | None
    """Null while under review, and if not judged."""
    max_points: float
    verdict: Verdict
    measured: Quantity
    expected: Quantity
    tolerance: Tolerance
    confidence: Share
    probability: Share | None = None
    """Probability that the verdict is right; under review, of the likeliest one. Null in older reports."""
    proposed: Verdict | None = None
    """Under review, the likeliest verdict."""
    decided: DecidedDocument | None = None
    """Null if no person decided."""
    mistake: str | None = None
    """Code of the mistake that explains a loss."""
    feedback: str = ""
    reasons: list[str] = []
    """Codes of the reasons for the verdict, most important first."""
    why: list[ReasonDocument] = []
    """The same reasons with their parameters."""
    link: str | None = None
    """The link of the mechanism judged."""
    value: str | None = None
    """The vector whose computed value is judged."""
    on_sketch: str | None = None
    """The point judged (``J3``), or the vector drawn again on the sketch (``a_D_sketch``)."""
    section: str | None = None
    """The section of the rubric that it belongs to, if that has a weight of its own."""

    @property
    def drawn(self) -> str:
        """The vector, link, point, or ``NAME_value`` judged; empty for a scale."""
        return self.vector or self.link or self.on_sketch or (value_name(self.value) if self.value else "")


class RivalDocument(Document):
    """Another mistake that would explain the same losses nearly as well."""

    code: Code
    at: str
    confidence: Share
    detail: str = ""
    parameters: Parameters = {}
    feedback: str = ""


class MistakeDocument(Document):
    """A mistake that explains errors: its code, where it was made, the criteria it explains.

    `feedback` says what was done and what to redo, `redo` lists the steps of the construction from there on,
    both in the student's language at the requested level of feedback.
    """

    code: Code
    at: str
    explains: list[str]
    confidence: Share
    detail: str = ""
    parameters: Parameters = {}
    """Values named by `detail`."""
    rivals: list[RivalDocument] = []
    feedback: str = ""
    redo: list[str] = []


class ScaleDocument(Document):
    """A scale: as declared (real units per millimetre), as used for marking, and whether assumed."""

    declared: float | None
    used: float | None
    assumed: bool
    text: str | None = None
    """As the student wrote it."""
    refused: str | None = None
    """Reason why a declared scale was not accepted."""
    source: Literal["roster", "measurements", "box"] | None = None
    """Place of the declaration (``box``: on the printed sheet); null if it was not declared."""


class ReadSheets(Document):
    """The pages read for a report."""

    sheets: list[ReadingDocument] = []


class ReportDocument(Document):
    """A submission's report."""

    schema_version: Version = 1
    student_id: str
    assignment: str
    variant: dict[str, int]
    """``{"n": 7}``; empty where the assignment has no n."""
    position: int | None
    status: Status
    score: float | None
    """Null while anything is under review, and for a submission missing or unreadable."""
    score_range: tuple[float, float] | None
    max_score: float
    expected_score: float | None = None
    """Mean of the score over the possible verdicts; null if nothing was judged."""
    added: float = 0.0
    """Points that a person added to the score, or subtracted."""
    comment: str = ""
    """A person's comment on the whole submission."""
    decisions: list[AppliedDecisionDocument] = []
    """All decisions of people about it that were applied."""
    criteria: list[CriterionDocument] = []
    said: dict[str, SaidDocument] = {}
    """The program's own verdict, by criterion, if a person decided or the verdict has changed."""
    mistakes: list[MistakeDocument] = []
    scales: dict[ScaleName, ScaleDocument] = {}
    problems: list[ProblemDocument] = []
    reading: ReadSheets = ReadSheets()


class UnmatchedDocument(Document):
    """A page or file without an owner, or claimed by two sources that disagree."""

    file: str
    page: int | None = None
    code: str
    message: str
    parameters: Parameters = {}


class StandingDocument(Document):
    """The state of a submission: its status and points, or the range in which they lie."""

    status: Status
    score: float | None
    score_range: tuple[float, float] | None


class CriterionMovedDocument(Document):
    """A criterion with a changed mark; null before or after if it was not asked for.

    Points are out of `max_points`, null under review and if not judged.
    """

    id: str
    title: str
    before: Verdict | None
    after: Verdict | None
    points_before: float | None = None
    points_after: float | None = None


class MovedDocument(Document):
    """A submission that changed since the run before; null before (new) or after (gone).

    `why`: the causes of the change; empty if none is known.
    """

    student_id: str
    position: int | None = None
    before: StandingDocument | None
    after: StandingDocument | None
    why: list[Cause] = []
    criteria: list[CriterionMovedDocument] = []


class AlikeDocument(Document):
    """Sheets that look more alike than independent drawings do: a person should look at both.

    Attributes
    ----------
    students, positions : of the similar sheets; more than two if several look alike
    why : `hand_errors` (the same small drafting errors), `same_place` (figures lie alike on the sheet),
        `same_numbers` (entered values are the same although independent ones differ), `same_picture` (the ink
        lies alike), `other_number` (drawn with the other's number)
    measure : number of such pairs expected by chance in a class of this size if everybody worked alone; null
        for `other_number` by itself, which is no coincidence but may be a slip
    share, compared : agreement of the errors or numbers compared, 0..1, and how many there were
    """

    students: list[str]
    positions: list[int | None]
    why: list[Sign]
    measure: float | None
    share: Share | None = None
    compared: int = 0


class StaleDecisionDocument(Document):
    """A decision that was not applied because its subject has changed since: its line and why."""

    line: int
    student_id: str
    position: int | None = None
    criterion: str
    verdict: str
    by: str = ""
    at: str = ""
    comment: str = ""
    code: str = ""
    reason: str
    """Reason in English."""


class LikeDocument(Document):
    """Settled verdicts that are no longer trusted: those of probability `most` or less.

    `criterion`, `verdict` and `mistake` narrow them down; without a criterion, all of that probability.
    """

    criterion: str | None = None
    verdict: Verdict | None = None
    mistake: str | None = None
    most: Share


class OpenedDocument(Document):
    """Verdicts that an audit reopened: which, why, and how many."""

    like: LikeDocument
    student_id: str
    """The student whose verdict was found wrong; empty if `settle` was raised."""
    count: int


Source = Literal["printed", "plain", "photo", "entered"]
"""Source of verdicts: scans of printed sheets or of plain paper, photos, entered values."""


class ReliabilityDocument(Document):
    """Verdicts that a person checked, compared with the probabilities stated for them.

    Attributes
    ----------
    source : where the values were read
    kind : settled verdicts that were audited, or proposals that were decided
    count, right : their number, and how many of them a person found right
    said : the mean of the stated probabilities
    """

    source: Source
    kind: Literal["settled", "proposed"]
    count: int
    right: int
    said: Share


class TrustDocument(Document):
    """The result of auditing a class.

    Attributes
    ----------
    settled : verdicts that the program settled by itself
    audited, right, unclear : of the random sample: checked, found right, not decidable
    at_most : share of the settled verdicts that are wrong, with 95 % confidence whenever the audit stops;
        undecidable ones count as wrong. Null while nothing is audited
    least_sure, least_sure_right : checked in addition because they were least sure: no random sample
    settle, raised : the probability from which the rubric settles verdicts; the higher one used for this
        class if the audit proves more errors than `settle` allows, else null
    opened : verdicts that wait for a person again
    reliability : stated probabilities compared with what people found
    moved : points of drawings that a person moved
    """

    settled: int
    audited: int
    right: int
    unclear: int
    at_most: Share | None
    least_sure: int
    least_sure_right: int
    settle: Share
    raised: Share | None
    opened: list[OpenedDocument] = []
    reliability: list[ReliabilityDocument] = []
    moved: int = 0


class LevelDocument(Document):
    """A level of a criterion: its verdict, and the points that it gives; null if it counts neither way."""

    verdict: Verdict
    points: float | None


class RubricCriterionDocument(Document):
    """A criterion of the rubric: titles by language, levels from the best to the worst, then `not_judged`."""

    id: str
    titles: Titles
    section: str
    max_points: float
    levels: list[LevelDocument]


class RubricDocument(Document):
    """The rubric by which a class is marked; `changed`: when its file was last changed (ISO 8601, UTC)."""

    titles: Titles
    changed: str
    criteria: list[RubricCriterionDocument]


class ResultsDocument(Document):
    """A class's results; `moved` against the run before, empty after the first; `alike` sheets."""

    schema_version: Version = 1
    assignment: str
    titles: dict[str, str] = {}
    """The criteria's titles in the language of the class, by id; a report's are in its student's."""
    lang: str | None = None
    """The language of the class; null in results of earlier versions."""
    rubric: RubricDocument | None = None
    """Null in results of earlier versions."""
    reports: list[ReportDocument]
    unmatched: list[UnmatchedDocument] = []
    moved: list[MovedDocument] = []
    alike: list[AlikeDocument] = []
    stale: list[StaleDecisionDocument] = []
    """Decisions that wait for a person to look again."""
    expected_wrong: float | None = None
    """Expected number of wrong verdicts among the settled ones, by their probabilities."""
    trust: TrustDocument | None = None
    """Reliability of the verdicts according to people's checks; null before the first check."""


# Lint: an assignment held against every variant ---------------------------------------------------


class VariantDocument(Document):
    """A variant; null if the assignment has no such number."""

    n: int | None
    position: int | None


class LintFindingDocument(Document):
    """A finding: its severity, a stable code, where, what, for which variants (none: the files as such)."""

    severity: Literal["fault", "warning", "hint"]
    code: str
    file: Literal["assignment", "mechanism", "rubric", "table"]
    path: str
    line: int | None = None
    """Line of a table, or of a file that is not TOML; null elsewhere."""
    message: str
    parameters: Parameters = {}
    variants: list[VariantDocument]


class LintLeast(Document):
    """The least of several figures, whose it is, and the page of the answer sheets that it is on, if any."""

    value: float
    at: str
    page: int | None = None


class LintVariant(VariantDocument):
    """One variant's figures; without figures if it cannot be solved, `problem` says why.

    `transmission` is a sine, `room` the factor by which the tightest figure could be enlarged in its zone of
    the answer sheet.
    """

    assembles: bool
    problem: str | None
    transmission: LintLeast | None
    crossing_deg: LintLeast | None
    shortest_mm: LintLeast | None
    under_8_mm: int
    room: LintLeast | None
    predicted_error: float | None


class LintScales(Document):
    """Scales, the least and the largest over all variants, and their effect."""

    name: Literal["proposed", "round", "round_each"]
    kL: tuple[float, float]  # noqa: N815 - the field's own name for it
    kv: tuple[float, float]
    ka: tuple[float, float]
    kF: tuple[float, float] | None = None  # noqa: N815
    room: float
    shortest_mm: LintLeast | None
    under_8_mm: int
    asked: int
    shortest_link_mm: float


class LintWorst(VariantDocument):
    """The variant that is hardest to draw, and why, as a sentence and as data."""

    why: str
    code: str
    parameters: Parameters = {}


class LintDocument(Document):
    """The findings of `planmark lint`; without variants and scales if the files have faults."""

    schema_version: Version = 1
    assignment: str
    needs_a_person: bool
    findings: list[LintFindingDocument]
    variants: list[LintVariant]
    scales: list[LintScales]
    worst: LintWorst | None


class CalibrationPoint(Document):
    """The residual of a point of the calibration page, sheet mm, y down."""

    kind: Literal["marker", "segment"]
    at_mm: tuple[float, float]
    off_mm: tuple[float, float]


class CalibrationSegments(Document):
    """Errors of the calibration page's segments, null if none was read."""

    printed: int
    read: int
    length_mean_mm: float | None = None
    length_rms_mm: float | None = None
    length_worst_mm: float | None = None
    direction_rms_deg: float | None = None
    place_rms_mm: float | None = None
    place_worst_mm: float | None = None


class CalibrationDocument(Document):
    """The measurements of `planmark calibrate`: scales over true lengths, along the upright sheet's axes.

    `scale_x` and `scale_y` are null without a stated resolution; so are they and the rest of a scanner's map
    for a photo (`camera`). `skew_deg` is the error of the sheet's right angle.
    """

    schema_version: Version = 1
    source: str
    page: int
    camera: bool
    px_per_mm: float
    scale_x: float | None = None
    scale_y: float | None = None
    unequal: float | None = None
    scale_se: float | None = None
    skew_deg: float | None = None
    turn_deg: float | None = None
    residual_mm: float
    segments: CalibrationSegments
    points: list[CalibrationPoint]
    advice: list[str]
