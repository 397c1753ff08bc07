"""Describe one student's page, from the report."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from markupsafe import Markup

from grader.documents import (
    CriterionDocument,
    MistakeDocument,
    Quantity,
    ReportDocument,
    RivalDocument,
    ScaleDocument,
    ScaleName,
)
from grader.feedback import words
from grader.feedback.mistakes import MISTAKES, mistake_title
from grader.feedback.numbers import (
    quantity_cells,
    scale_text,
    tolerance_cells,
)
from grader.feedback.words import environment
from grader.files import write_whole
from grader.language import N_, Tongue, symbols, tongue
from grader.options import Level
from grader.outcomes import CHARGED, EVEN
from grader.overlay.closeup import PageView, detail, page_views, scan_element, svg
from grader.overlay.scene import Arrow, Picture
from grader.texts.spoken import PLACES, place
from reference.construction.graph import ON_SKETCH

NUMBER, POSITION, PAGE = N_("number"), N_("position"), N_("page")
WIDENED = N_("widened")
FROM_OWN = N_("from your own values")
"""Shown beside the expected value if it follows from the student's own earlier values."""
MAY_BE_WRONG = N_("What may be wrong")
AS_MEASURED = N_("drawn from the entered measurements")
SHEET = N_("the sheet")
DETAIL = N_("a closer look")
OR = N_("or")
MOST_TITLES = 2
"""Mistakes named in one heading, the likeliest ones; the text below it names them all."""
PRINTED = "feedback.pdf"
"""A file that earlier versions wrote; it is removed because it may show more than the page does now."""

GroupName = Literal["lost", "waiting", "right", "not_judged"]
GROUPS: Mapping[GroupName, tuple[str, ...]] = {
    "lost": (N_("What is wrong"), "none", "partial"),
    "waiting": (N_("What a person must still look at"), "review"),
    "right": ("", "full", "follow_through"),
    "not_judged": ("", "not_judged"),
}
"""Verdicts of the groups of rows, after the titles of those that are not folded."""
WAITING: dict[str, str] = {
    "other_variant": N_("drawn with another student's data"),
    "data_misread": N_("drawn with a crank angle that was misread"),
    "data_unclear": N_("perhaps drawn with other data"),
    "entry_refused": N_("it depends on an unusable entry"),
    "doubtful": N_("read with too little certainty"),
    "near_limit": N_("too close to the limit of the tolerance to decide from the scan"),
    "hand_may_miss": N_("an error that even careful drawing can make where lines meet at a small angle"),
    "unread": N_("not read on the sheet"),
    "not_measured": N_("nothing was handed in for it"),
    "readings_disagree": N_("the drawing and the entered measurement differ"),
    "written_disagrees": N_("the drawing and the length written on the sheet differ"),
    "cells_off": N_("the number read in the sheet's cells does not fit"),
    "scale_assumed": N_("no scale was declared, and the drawing follows another than the assignment's own"),
    "scale_off": N_("the declared scale does not fit the drawing"),
    "follows": N_("it depends on an open question"),
    "": N_("open"),
}
"""Reasons for a person to look, by the code of the reason; a criterion's first code listed here counts."""


@dataclass(frozen=True, slots=True)
class About:
    """The names of a submission's student and assignment, which its report does not hold."""

    title: str = ""
    student_name: str = ""
    names: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Action:
    """A mistake: what happened, what to redo, what it explains, and its pictures.

    Attributes
    ----------
    alternatives : other explanations that fit nearly as well
    is_open : whether no criterion that it explains has lost points yet, and one waits for a person
    """

    title: str
    at: str
    said: str
    alternatives: tuple[str, ...] = ()
    redo: tuple[str, ...] = ()
    explains: tuple[str, ...] = ()
    view: PageView | None = None
    is_open: bool = False


@dataclass(frozen=True, slots=True)
class Group:
    """Rows shown together: those that lost points, that wait, that are right, that do not count."""

    title: str
    verdict: str
    rows: tuple[CriterionDocument, ...]


@dataclass(frozen=True, slots=True)
class StudentPage:
    """A report and its pictures in the student's language; `level` says how much may be shown.

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
        """True if the answers may be shown."""
        return self.level == "full"

    @property
    def details(self) -> list[str]:
        """The student's number and position, if there are any."""
        known = ((NUMBER, self.report.variant.get("n")), (POSITION, self.report.position))
        return [f"{self.speaker.gettext(word)} {value}" for word, value in known if value is not None]

    @property
    def tally(self) -> list[tuple[str, int]]:
        """Count the criteria by verdict; verdicts that do not occur are left out."""
        verdicts = [criterion.verdict for criterion in self.report.criteria]
        return [(verdict, verdicts.count(verdict)) for verdict in words.VERDICTS if verdict in verdicts]

    def shown(self, name: str) -> str:
        """Return a vector, computed value, link or scale as students know it."""
        return place(name, self.speaker, self.about.names).removesuffix(ON_SKETCH)

    # Criteria and scales --------------------------------------------------------------------------

    def group(self, name: GroupName) -> Group:
        """Return the rows of a group, without optional ones that were not handed in."""
        title, *verdicts = GROUPS[name]
        rows = (row for row in self.report.criteria if row.verdict in verdicts and not _is_left_out(row))
        return Group(self.speaker.gettext(title), verdicts[0], tuple(rows))

    @property
    def remarks_of_people(self) -> list[tuple[str, str]]:
        """List a person's remarks: on the whole, then on criteria, each text once with their titles."""
        titles: dict[str, list[str]] = {}
        for row in self.report.criteria:
            if row.decided and row.decided.comment:
                titles.setdefault(row.decided.comment, []).append(row.title)
        whole = [("", self.report.comment)] if self.report.comment else []
        return [*whole, *((", ".join(about), text) for text, about in titles.items())]

    @property
    def not_required(self) -> list[Markup]:
        """List optional criteria that were not handed in, with the right value if it may be shown."""
        names = []
        for criterion in filter(_is_left_out, self.report.criteria):
            name = symbols(self.shown(criterion.drawn or criterion.id))
            value = quantity_cells(criterion.expected, self.speaker)[-1:] if self.shows_expected else []
            names.append(Markup("{} ({})").format(name, *value) if value else name)
        return names

    def name(self, criterion: CriterionDocument) -> str:
        """Return a criterion's subject, if its title does not name it."""
        is_needed = criterion.drawn and criterion.drawn not in criterion.title
        return self.shown(criterion.drawn) if is_needed else ""

    def sentence(self, criterion: CriterionDocument) -> str:
        """Return the sentence on a criterion; empty if its mark says all: right, or checked by a person."""
        is_said = criterion.reasons in (["right"], ["decided"]) and criterion.mistake is None
        return "" if is_said else criterion.feedback

    def expected(self, criterion: CriterionDocument) -> list[str]:
        """Return the right values as lines of a cell; a vector below its tolerance has no direction."""
        if not self.shows_expected:
            return []
        expected = criterion.expected
        if (expected.length_mm or 0.0) <= (criterion.tolerance.length_mm or -1.0):
            expected = expected.model_copy(update={"direction_deg": None})
        return quantity_cells(expected, self.speaker)

    def tolerance(self, criterion: CriterionDocument) -> list[str]:
        """Return the tolerance of full marks, and why. A tolerance in per cent would give the answer away."""
        if not self.shows_expected:
            return []
        unit = criterion.expected.unit or criterion.measured.unit or ""
        tolerance = criterion.tolerance
        if "too_short_to_judge" in criterion.reasons:
            tolerance = tolerance.model_copy(update={"direction_deg": None})
        cells = tolerance_cells(tolerance, unit, self.speaker)
        if cells and tolerance.widened:
            cells.append(self.speaker.gettext(WIDENED))
        if cells and "follows" in criterion.reasons:
            cells.append(self.speaker.gettext(FROM_OWN))
        return cells

    def remarks(self, scale: ScaleDocument) -> list[str]:
        """Say how and where a scale was written, and why it was refused."""
        source = self.speaker.gettext(words.SOURCES[scale.source]) if scale.source else ""
        return [remark for remark in (scale.text, source, scale.refused) if remark]

    def used(self, name: ScaleName) -> str:
        """Return a scale as used; one that was not declared is an answer."""
        return scale_text(self.report.scales[name].used, name, self.speaker) if self.shows_expected else ""

    # Pictures -------------------------------------------------------------------------------------

    @property
    def scans(self) -> list[Markup]:
        """Each scan once; every view of it refers to it by its name."""
        return [scan_element(picture, index) for index, picture in enumerate(self.pictures)]

    @property
    def views(self) -> tuple[list[PageView], list[PageView]]:
        """Choose the pictures to show at once, and the whole sheets to show by themselves."""
        pages = [page_views(picture, index, self.about.names) for index, picture in enumerate(self.pictures)]
        views = [view for page in pages for view in page]
        whole = [page[0] for page in pages if len(page) > 1 and page[0].kind == "sheet" and not page[0].names]
        return [view for view in views if view not in whole], whole

    @property
    def arrows(self) -> list[Arrow]:
        """The vectors and links on the drawing."""
        return [arrow for picture in self.pictures for arrow in picture.scene.arrows]

    @property
    def marked(self) -> list[str]:
        """The verdicts that occur on the drawing."""
        shown = {arrow.verdict for arrow in self.arrows}
        return [verdict for verdict in words.VERDICTS if verdict in shown]

    def draw(self, view: PageView) -> Markup:
        """Return a view as an element of the page."""
        return svg(view, self.pictures[view.picture], self.description(view))

    def description(self, view: PageView) -> str:
        """Describe a view in words, for readers who cannot see it."""
        verdicts = {
            criterion.drawn: self.speaker.gettext(words.VERDICTS[criterion.verdict])
            for criterion in self.report.criteria
        }
        parts = (f"{name}: {verdicts[name]}" for name in view.names if name in verdicts)
        return f"{self._caption(view)}. {'; '.join(parts)}".rstrip(". ")

    def below(self, view: PageView) -> Markup:
        """Return the caption below a view: the names in a detail, the page of other views."""
        caption, picture = self._caption(view), self.pictures[view.picture]
        said = Markup.escape(caption[:1].upper() + caption[1:])
        if view.kind == "sheet":
            return Markup.escape(self._source(picture) + self._placed(picture))
        if view.kind == "detail":
            return Markup("{}: {}").format(said, Markup(", ").join(map(symbols, view.names)))
        return Markup("{}: {}").format(said, self._source(picture))

    def _caption(self, view: PageView) -> str:
        titles = {**PLACES, "sheet": SHEET, "detail": DETAIL}
        return self.speaker.titled(titles, view.kind, self.about.names)

    def _source(self, picture: Picture) -> str:
        """Return the file and the page."""
        if not picture.scan:
            return f"{picture.source}, {self.speaker.gettext(AS_MEASURED)}"
        return f"{picture.source}, {self.speaker.gettext(PAGE)} {picture.page}"

    def _placed(self, picture: Picture) -> str:
        """Explain to instructors how the page's millimetres were found."""
        for reading in self.report.reading.sheets if self.shows_expected else ():
            sheet = reading.sheet
            is_this = (reading.source, reading.page) == (picture.source, picture.page)
            if is_this and sheet is not None and sheet.method in words.METHODS:
                method = self.speaker.gettext(words.METHODS[sheet.method])
                return f" · {method}, ±{self.speaker.quantity(sheet.residual_mm, 2, 'mm')}"
        return ""

    # What to put right ----------------------------------------------------------------------------

    @property
    def actions(self) -> list[Action]:
        """The mistakes in the order of construction."""
        if self.level == "symbol":
            return []
        order = {criterion.id: number for number, criterion in enumerate(self.report.criteria)}

        def first(mistake: MistakeDocument) -> int:
            return min((order[name] for name in mistake.explains if name in order), default=-1)

        known = (mistake for mistake in self.report.mistakes if mistake.code in MISTAKES)
        return [self._action(mistake) for mistake in sorted(known, key=first)]

    @property
    def title_of_wrong(self) -> str:
        """The heading of the errors; while nothing has lost points they are not certain."""
        is_certain = self.group("lost").rows or not all(action.is_open for action in self.actions)
        return self.group("lost").title if is_certain else self.speaker.gettext(MAY_BE_WRONG)

    def _action(self, mistake: MistakeDocument) -> Action:
        criteria = {criterion.id: criterion for criterion in self.report.criteria}
        explained = [criteria[name] for name in mistake.explains if name in criteria]
        verdicts = {one.verdict for one in explained}
        off = {one.drawn for one in explained if one.verdict in CHARGED | {"review"}}
        causes: list[MistakeDocument | RivalDocument] = [mistake, *mistake.rivals]
        titles = dict.fromkeys(self.speaker.gettext(mistake_title(cause)) for cause in causes)
        joined = f" {self.speaker.gettext(OR)} ".join(list(titles)[:MOST_TITLES])
        return Action(
            title=joined[:1].upper() + joined[1:],
            at=place(mistake.at, self.speaker, self.about.names),
            said=mistake.feedback,
            alternatives=tuple(rival.feedback for rival in mistake.rivals if rival.feedback),
            redo=tuple(mistake.redo),
            explains=tuple(self.shown(one.drawn or one.id) for one in explained),
            view=detail(self.pictures, off, self.about.names),
            is_open="review" in verdicts and not verdicts & CHARGED,
        )

    @property
    def view_of_others(self) -> PageView | None:
        """A detail of the errors without a named mistake, in the figure of the first of them."""
        named = {name for mistake in self.report.mistakes for name in mistake.explains}
        lost = [row for row in self.group("lost").rows if row.drawn and row.id not in named]
        first = {row.drawn for row in lost if (row.vector or "")[:1] == (lost[0].vector or "")[:1]}
        return detail(self.pictures, first, self.about.names)

    # What waits for a person ----------------------------------------------------------------------

    @property
    def waiting(self) -> list[tuple[str, list[str]]]:
        """The reasons for which a person must look, each with its open criteria."""
        groups: dict[str, list[str]] = {}
        for row in self.group("waiting").rows:
            why = next((code for code in WAITING if code in row.reasons), "")
            if why == "unread" and row.measured != Quantity():
                why = "doubtful"
            groups.setdefault(why, []).append(self.shown(row.drawn or row.id))
        return [(self.speaker.gettext(WAITING[why]), names) for why, names in groups.items()]

    @property
    def likely(self) -> list[tuple[str, int]]:
        """Count open criteria by their likeliest verdict, if one is likely."""
        proposed = [row.proposed for row in self.group("waiting").rows if row.probability != EVEN]
        return [(verdict, proposed.count(verdict)) for verdict in words.VERDICTS if verdict in proposed]


def _is_left_out(criterion: CriterionDocument) -> bool:
    """Return whether it is optional and was not handed in."""
    return criterion.verdict == "not_judged" and criterion.reasons[:1] == ["optional"]


# Files --------------------------------------------------------------------------------------------


def write_feedback(page: str, pictures: Sequence[Picture], out_dir: Path) -> None:
    """Write a page as `feedback.html`, its pictures as `overlay.png`, `overlay_2.png`, ..., into a folder.

    Raises OutputError if a file cannot be written.
    """
    scanned = [picture for picture in pictures if picture.png]
    files = ["overlay.png" if k == 1 else f"overlay_{k}.png" for k in range(1, len(scanned) + 1)]
    for file, picture in zip(files, scanned, strict=True):
        write_whole(out_dir / file, picture.png)
    write_whole(out_dir / "feedback.html", page)
    for old in (*out_dir.glob("overlay*.png"), out_dir / PRINTED):
        # Remove files of an earlier run: of pages no longer handed in, or at another level.
        if old.name not in files:
            old.unlink(missing_ok=True)


def feedback_page(
    report: ReportDocument,
    pictures: Sequence[Picture],
    lang: str,
    level: Level = "full",
    about: About | None = None,
) -> str:
    """Return the page of one submission.

    Arguments
    ---------
    report : its criteria's and mistakes' `feedback` is shown as it stands (see `criterion_feedback`)
    pictures : of its pages, in order; for entered measurements, the plans as measured
    level : `full` shows the expected values; `hint` and `symbol` do not
    """
    page = StudentPage(report, tuple(pictures), tongue(lang), level, about or About())
    template = environment(page.speaker.lang).get_template("feedback.html")
    return template.render(
        page=page,
        report=report,
        title=page.about.title or report.assignment,
        student=page.about.student_name,
    )
