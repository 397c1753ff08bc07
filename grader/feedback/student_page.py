"""What one student's page says: one description, from the report."""

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from pathlib import Path

from markupsafe import Markup

from grader.documents import (
    CriterionDocument,
    MistakeDocument,
    QuantityDocument,
    ReportDocument,
    RivalDocument,
    ScaleDocument,
    ScaleName,
    ToleranceDocument,
)
from grader.feedback import words
from grader.feedback.mistakes import MISTAKES, words_of
from grader.feedback.sentences import HINTS, PLACES, Level, place
from grader.feedback.words import ProblemText, environment, problem_sentence, score_text
from grader.files import write_whole
from grader.language import N_, Tongue, tongue
from grader.overlay.closeup import PageView, detail, page_views, scan_element, svg
from grader.overlay.scene import COLOURS, Picture
from reference.drawing.subject import SCALE_UNITS

NUMBER, POSITION, PAGE = N_("number"), N_("position"), N_("page")
WIDENED = N_("widened")
AS_MEASURED = N_("drawn from the entered measurements")
SHEET = N_("the sheet")
DETAIL = N_("a closer look")
OTHERS = N_("Also off, without a single likely cause")
OTHERS_SAID = N_(
    "What is off is told below, beside each criterion. Begin with the first of them:"
    " others may follow from it."
)
OR = N_("or")
WHY_WIDENED = N_(
    "Widened: small errors of a careful hand add up to more than the rubric's tolerance here, as they do"
    " where lines meet at a small angle."
)
UNITS = N_(
    "Lengths are millimetres on paper; directions count counter-clockwise from the horizontal to the right."
)
MOST_WAITING_DETAILS = 3
"""Close-ups of what waits for a person: they stand in one row."""
PRINTED = "feedback.pdf"
"""Earlier versions wrote it; an old one is removed, it may show more than the page does now."""

WAITING: dict[str, str] = {
    "other_variant": N_("drawn with another student's data"),
    "entry_refused": N_("an entry that it rests on cannot be used"),
    "doubtful": N_("read with too little certainty"),
    "near_limit": N_("so near the limit of the tolerance that the scan cannot decide"),
    "hand_may_miss": N_("off by no more than a careful hand may be where lines meet at a small angle"),
    "unread": N_("not read on the sheet"),
    "not_measured": N_("nothing was handed in for it"),
    "readings_disagree": N_("the drawing and the entered measurement differ"),
    "written_disagrees": N_("the drawing and the length written on the sheet differ"),
    "scale_assumed": N_("no scale was declared, and the drawing follows another than the assignment's own"),
    "scale_off": N_("the declared scale does not fit the drawing"),
    "follows": N_("it hangs on what is still open"),
    "": N_("open"),
}
"""Why a person must look, by the code of the reason; the first of these that a criterion has counts."""


@dataclass(frozen=True, slots=True)
class About:
    """What is known of a submission beside its report: how its student and assignment are called."""

    title: str = ""
    student_name: str = ""
    names: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Action:
    """A mistake, or what is off without one: what happened, what to redo, what it explains, where to see it.

    `alternatives` would explain the same nearly as well.
    """

    title: str
    at: str
    said: str
    alternatives: tuple[str, ...] = ()
    redo: tuple[str, ...] = ()
    explains: tuple[str, ...] = ()
    view: PageView | None = None


@dataclass(frozen=True, slots=True)
class StudentPage:
    """A report and its pictures in the student's language; `level` says what may be told.

    The report's own texts (`feedback`, `redo`) are shown as they stand. At levels below `full` no method
    gives an expected value, a tolerance or a scale that was used without being declared.
    """

    report: ReportDocument
    pictures: tuple[Picture, ...]
    speaker: Tongue
    level: Level = "full"
    about: About = field(default_factory=About)

    @property
    def shows_expected(self) -> bool:
        """Whether the answers may be seen."""
        return self.level == "full"

    @property
    def details(self) -> list[str]:
        """The student's number and position, where there are some."""
        known = ((NUMBER, self.report.variant.get("n")), (POSITION, self.report.position))
        return [f"{self.speaker.gettext(word)} {value}" for word, value in known if value is not None]

    @property
    def score(self) -> str:
        """The score, or the range that it lies in."""
        return score_text(self.report, self.speaker)

    @property
    def tally(self) -> list[tuple[str, int]]:
        """How many criteria have each verdict that occurs."""
        verdicts = [criterion.verdict for criterion in self.report.criteria]
        return [(verdict, verdicts.count(verdict)) for verdict in words.VERDICTS if verdict in verdicts]

    @property
    def problems(self) -> list[ProblemText]:
        """What is wrong with files and sheets."""
        return [problem_sentence(problem, self.speaker) for problem in self.report.problems]

    def shown(self, name: str) -> str:
        """A vector, link or scale as students know it."""
        return self.about.names.get(name, name)

    # Criteria and scales --------------------------------------------------------------------------

    @property
    def criteria(self) -> list[CriterionDocument]:
        """The rows of the table."""
        return [criterion for criterion in self.report.criteria if not _is_left_out(criterion)]

    @property
    def not_required(self) -> list[Markup]:
        """What need not be handed in and was not; with the right value where it may be told."""
        names = []
        for criterion in filter(_is_left_out, self.report.criteria):
            name = words.symbols(self.shown(criterion.drawn or criterion.id))
            value = quantity_cells(criterion.expected, self.speaker)[-1:] if self.shows_expected else []
            names.append(Markup("{} ({})").format(name, *value) if value else name)
        return names

    def name(self, criterion: CriterionDocument) -> str:
        """What a criterion is about, where its title does not say it."""
        is_needed = criterion.drawn and criterion.drawn not in criterion.title
        return self.shown(criterion.drawn) if is_needed else ""

    def sentence(self, criterion: CriterionDocument) -> str:
        """What is said of a criterion; nothing where it is just right."""
        return "" if criterion.feedback == self.speaker.gettext(HINTS["right"]) else criterion.feedback

    def measured(self, criterion: CriterionDocument) -> list[str]:
        """What was handed in, as lines of a cell."""
        return quantity_cells(criterion.measured, self.speaker)

    def expected(self, criterion: CriterionDocument) -> list[str]:
        """What is right, as lines of a cell."""
        return quantity_cells(criterion.expected, self.speaker) if self.shows_expected else []

    def tolerance(self, criterion: CriterionDocument) -> list[str]:
        """What full marks allow; a tolerance in per cent of what is expected would give that away."""
        if not self.shows_expected:
            return []
        unit = criterion.expected.unit or criterion.measured.unit or ""
        cells = tolerance_cells(criterion.tolerance, unit, self.speaker)
        return [*cells, self.speaker.gettext(WIDENED)] if cells and criterion.tolerance.widened else cells

    @property
    def widening(self) -> str:
        """Why a tolerance is wider than the rubric's; empty where none is."""
        is_wider = any(criterion.tolerance.widened for criterion in self.report.criteria)
        return self.speaker.gettext(WHY_WIDENED) if self.shows_expected and is_wider else ""

    @property
    def footer(self) -> str:
        """How lengths and directions are to be understood."""
        return self.speaker.gettext(UNITS)

    def declared(self, name: ScaleName) -> str:
        """A scale as it was declared."""
        return scale_text(self.report.scales[name].declared, name, self.speaker)

    def remarks(self, scale: ScaleDocument) -> list[str]:
        """How a scale was written, where it was found, why it was refused."""
        source = self.speaker.gettext(words.SOURCES[scale.source]) if scale.source else ""
        return [remark for remark in (scale.text, source, scale.refused) if remark]

    def used(self, name: ScaleName) -> str:
        """A scale as it was used; one that was not declared is an answer."""
        return scale_text(self.report.scales[name].used, name, self.speaker) if self.shows_expected else ""

    # Pictures -------------------------------------------------------------------------------------

    @property
    def scans(self) -> list[Markup]:
        """Each scan once; every view of it shows it by its name."""
        return [scan_element(picture, index) for index, picture in enumerate(self.pictures)]

    @property
    def sheets(self) -> list[tuple[str, list[PageView]]]:
        """Each page: its name, and the views of it."""
        return [
            (self._source(picture), page_views(picture, index, self.about.names))
            for index, picture in enumerate(self.pictures)
        ]

    @property
    def has_marks(self) -> bool:
        """Whether anything is marked in a picture."""
        return any(picture.scene.arrows for picture in self.pictures)

    @property
    def has_ghosts(self) -> bool:
        """Whether any expected vector is drawn."""
        return any(picture.scene.ghosts for picture in self.pictures)

    def draw(self, view: PageView) -> Markup:
        """A view as an element of the page."""
        return svg(view, self.pictures[view.picture], self.description(view))

    def description(self, view: PageView) -> str:
        """The description of a view in words, for readers who cannot see it."""
        verdicts = {
            criterion.drawn: self.speaker.gettext(words.VERDICTS[criterion.verdict])
            for criterion in self.criteria
        }
        parts = (f"{name}: {verdicts[name]}" for name in view.names if name in verdicts)
        return f"{self._caption(view)}. {'; '.join(parts)}".rstrip(". ")

    def below(self, view: PageView) -> Markup:
        """The caption below a view; of a detail with the names in it."""
        caption = self._caption(view)
        said = Markup.escape(caption[:1].upper() + caption[1:])
        if view.kind != "detail" or not view.names:
            return said
        return Markup("{}: {}").format(said, Markup(", ").join(map(words.symbols, view.names)))

    def _caption(self, view: PageView) -> str:
        return self.speaker.gettext({**PLACES, "sheet": SHEET, "detail": DETAIL}[view.kind])

    def _source(self, picture: Picture) -> str:
        """Which page of which file it is, and for instructors how its millimetres were found."""
        if not picture.scan:
            return f"{picture.source}: {self.speaker.gettext(AS_MEASURED)}"
        page = f"{picture.source}, {self.speaker.gettext(PAGE)} {picture.page}"
        for reading in self.report.reading.sheets if self.shows_expected else ():
            sheet = reading.sheet
            is_this = (reading.source, reading.page) == (picture.source, picture.page)
            if is_this and sheet is not None and sheet.method in words.METHODS:
                method = self.speaker.gettext(words.METHODS[sheet.method])
                return f"{page} · {method}, ±{self.speaker.quantity(sheet.residual_mm, 2, 'mm')}"
        return page

    def _detail(self, concerned: AbstractSet[str]) -> PageView | None:
        return detail(self.pictures, concerned, self.about.names)

    # What to put right ----------------------------------------------------------------------------

    @property
    def actions(self) -> list[Action]:
        """The mistakes in the order of construction, then what is off without one."""
        if self.level == "symbol":
            return []
        order = {criterion.id: number for number, criterion in enumerate(self.report.criteria)}

        def first(mistake: MistakeDocument) -> int:
            return min((order[name] for name in mistake.explains if name in order), default=-1)

        mistakes = sorted(self.report.mistakes, key=first)
        actions = [self._action(mistake) for mistake in mistakes if mistake.code in MISTAKES]
        explained = {name for mistake in mistakes for name in mistake.explains}
        others = [
            criterion
            for criterion in self.report.criteria
            if criterion.verdict in {"none", "partial"} and criterion.id not in explained
        ]
        return [*actions, self._others(others)] if others else actions

    def _action(self, mistake: MistakeDocument) -> Action:
        criteria = {criterion.id: criterion for criterion in self.report.criteria}
        explained = [criteria[name] for name in mistake.explains if name in criteria]
        off = {one.drawn for one in explained if one.verdict in {"none", "partial", "review"}}
        causes: list[MistakeDocument | RivalDocument] = [mistake, *mistake.rivals]
        titles = dict.fromkeys(_title(cause, self.speaker) for cause in causes)
        joined = f" {self.speaker.gettext(OR)} ".join(titles)
        return Action(
            title=joined[:1].upper() + joined[1:],
            at=place(mistake.at, self.speaker, self.about.names),
            said=mistake.feedback,
            alternatives=tuple(rival.feedback for rival in mistake.rivals if rival.feedback),
            redo=tuple(mistake.redo),
            explains=tuple(criteria[name].title if name in criteria else name for name in mistake.explains),
            view=self._detail(off),
        )

    def _others(self, criteria: Sequence[CriterionDocument]) -> Action:
        """What no mistake explains, with a look at the figure in which the first of it is."""
        drawn = [criterion for criterion in criteria if criterion.drawn]
        first = {one.drawn for one in drawn if (one.vector or "")[:1] == (drawn[0].vector or "")[:1]}
        say = self.speaker.gettext
        titles = tuple(criterion.title for criterion in criteria)
        return Action(say(OTHERS), "", say(OTHERS_SAID), explains=titles, view=self._detail(first))

    # What waits for a person ----------------------------------------------------------------------

    @property
    def waiting(self) -> list[tuple[str, list[str]]]:
        """Reasons for which a person must look, each with the criteria that wait for it."""
        groups: dict[str, list[str]] = {}
        for criterion in self._open:
            why = next((code for code in WAITING if code in criterion.reasons), "")
            groups.setdefault(why, []).append(self.shown(criterion.drawn or criterion.id))
        return [(self.speaker.gettext(WAITING[why]), names) for why, names in groups.items()]

    @property
    def waiting_views(self) -> list[PageView]:
        """Details of some of what waits for a person; vectors that meet are in one detail."""
        names = [criterion.drawn for criterion in self._open if criterion.drawn]
        views: list[PageView] = []
        for name in names:
            if len(views) < MOST_WAITING_DETAILS and not any(name in view.names for view in views):
                view = self._detail(_near(name, names, self.pictures))
                views += [view] if view is not None else []
        return views

    @property
    def _open(self) -> Iterator[CriterionDocument]:
        return (criterion for criterion in self.report.criteria if criterion.verdict == "review")


def _is_left_out(criterion: CriterionDocument) -> bool:
    """Whether it was not handed in and need not be."""
    return criterion.verdict == "not_judged" and criterion.reasons[:1] == ["optional"]


def _title(cause: MistakeDocument | RivalDocument, speaker: Tongue) -> str:
    known = dict(part.split(" = ", 1) for part in cause.detail.split(", ") if " = " in part)
    return speaker.gettext(words_of(cause.code, cause.at, known.get("line", "")).title)


def _near(name: str, names: Sequence[str], pictures: Sequence[Picture]) -> set[str]:
    """A vector and those that end or start where it ends."""
    for picture in pictures:
        arrows = {arrow.name: arrow for arrow in picture.scene.arrows}
        if name in arrows:
            tip = arrows[name].tip
            known = [other for other in names if other in arrows]
            return {name, *(other for other in known if tip in {arrows[other].tail, arrows[other].tip})}
    return {name}


# Cells --------------------------------------------------------------------------------------------


def quantity_cells(quantity: QuantityDocument, speaker: Tongue) -> list[str]:
    """Length and direction on paper, real value: a line each."""
    drawn = []
    if quantity.length_mm is not None:
        drawn.append(speaker.quantity(quantity.length_mm, 1, "mm"))
    if quantity.direction_deg is not None:
        # 359.96 is written as 0.0, not as 360.0.
        rounded = round(quantity.direction_deg, 1) % 360.0
        drawn.append(f"∠\N{NO-BREAK SPACE}{speaker.number(rounded, 1)}°")
    lines = [" ".join(drawn)] if drawn else []
    if quantity.value is not None:
        lines.append(speaker.value(quantity.value, quantity.unit or ""))
    return lines


def tolerance_cells(tolerance: ToleranceDocument, unit: str, speaker: Tongue) -> list[str]:
    """What full marks allow, in length and direction or in the value, which is in this unit."""
    drawn = []
    if tolerance.length_mm is not None:
        drawn.append(f"±{speaker.quantity(tolerance.length_mm, 1, 'mm')}")
    if tolerance.direction_deg is not None:
        drawn.append(f"±{speaker.number(tolerance.direction_deg, 1)}°")
    if tolerance.value is not None and not drawn:
        drawn.append(f"±{speaker.value(tolerance.value, unit, digits=2)}")
    return [" ".join(drawn)] if drawn else []


def scale_text(value: float | None, name: str, speaker: Tongue) -> str:
    """A scale with its unit; a dash where there is none."""
    return "–" if value is None else speaker.value(value, SCALE_UNITS[name])


# Files --------------------------------------------------------------------------------------------


def write_feedback(
    report: ReportDocument,
    pictures: Sequence[Picture],
    out_dir: Path,
    lang: str,
    level: Level = "full",
    about: About | None = None,
) -> None:
    """Write `feedback.html` and `overlay.png`, `overlay_2.png`, ... into a folder.

    Arguments
    ---------
    report : its criteria's and mistakes' `feedback` is shown as it stands (see `criterion_feedback`)
    pictures : of its pages, in order; for entered measurements of the plans as measured
    level : `full` shows what was expected; `hint` and `symbol` do not

    Raises OutputError where a file cannot be written.
    """
    scanned = [picture for picture in pictures if picture.png]
    files = ["overlay.png" if k == 1 else f"overlay_{k}.png" for k in range(1, len(scanned) + 1)]
    for file, picture in zip(files, scanned, strict=True):
        write_whole(out_dir / file, picture.png)
    write_whole(out_dir / "feedback.html", feedback_page(report, pictures, lang, level, about))
    for old in (*out_dir.glob("overlay*.png"), out_dir / PRINTED):
        # Of an earlier run: of pages that are no longer handed in, or at another level.
        if old.name not in files:
            old.unlink(missing_ok=True)


def feedback_page(
    report: ReportDocument,
    pictures: Sequence[Picture],
    lang: str,
    level: Level = "full",
    about: About | None = None,
) -> str:
    """The page of one submission; arguments as of `write_feedback`."""
    page = StudentPage(report, tuple(pictures), tongue(lang), level, about or About())
    template = environment(page.speaker.lang).get_template("feedback.html")
    return template.render(
        page=page,
        report=report,
        title=page.about.title or report.assignment,
        student=page.about.student_name,
        colours=COLOURS,
    )
