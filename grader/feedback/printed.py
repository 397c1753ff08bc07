"""A leaflet as an A4 document for the printer: the same content as the page for the screen."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from xml.sax.saxutils import escape

from reportlab import rl_config
from reportlab.lib.pagesizes import A4
from reportlab.lib.units import mm
from reportlab.lib.utils import ImageReader
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    BaseDocTemplate,
    CondPageBreak,
    Flowable,
    Frame,
    KeepTogether,
    PageTemplate,
    Spacer,
    Table,
)

from grader.answer_sheet.words import BOLD, REGULAR, embed_fonts
from grader.feedback import words
from grader.feedback.leaflet import Action, Leaflet, Sheetful
from grader.feedback.looks import Look
from grader.feedback.printed_pieces import (
    BADGE_MM,
    PLAIN,
    SOFT,
    Badge,
    Drawn,
    printed,
    table,
    text,
)
from grader.feedback.printed_tables import criteria_table, scales_table
from grader.feedback.sentences import OR, RIVALS
from grader.i18n import N_
from grader.plan_pdf import ink
from grader.scene import COLOURS

MARGIN_MM = 14.0
WIDE_MM = A4[0] / mm - 2 * MARGIN_MM
GAP_MM = 4.0
ORIENTING_SHARE = 0.66
"""Of the width, for a sheet whose plans are seen close up below."""
HALF_MM = (WIDE_MM - GAP_MM) / 2
STATE_COLOURS = {"graded": "full", "needs_review": "review", "unreadable": "none", "missing": "not_judged"}


def pdf_of(leaflet: Leaflet) -> bytes:
    """The document, a few A4 pages."""
    embed_fonts()
    buffer = io.BytesIO()
    document = BaseDocTemplate(
        buffer, pagesize=A4, title=f"{leaflet.title} · {leaflet.student_id}", lang=leaflet.speaker.lang,
        invariant=1, leftMargin=MARGIN_MM * mm, rightMargin=MARGIN_MM * mm,
        topMargin=MARGIN_MM * mm, bottomMargin=(MARGIN_MM + 4) * mm,
    )  # fmt: skip
    frame = Frame(
        document.leftMargin, document.bottomMargin, document.width, document.height,
        leftPadding=0, rightPadding=0, topPadding=0, bottomPadding=0,
    )  # fmt: skip
    foot = f"{leaflet.title} · {leaflet.student or leaflet.student_id}"

    def numbered(canvas: Canvas, _document: BaseDocTemplate) -> None:
        canvas.setFont(REGULAR, 7)
        canvas.setFillColor(ink(SOFT))
        canvas.drawString(MARGIN_MM * mm, 9 * mm, foot)
        canvas.drawRightString(A4[0] - MARGIN_MM * mm, 9 * mm, str(canvas.getPageNumber()))

    document.addPageTemplates([PageTemplate(frames=[frame], onPage=numbered)])
    with _plain_images():
        document.build(list(_Story(leaflet).parts()))
    return buffer.getvalue()


@contextmanager
def _plain_images() -> Iterator[None]:
    """Scans go in as they are: by default they are written as text, a quarter larger and far slower."""
    before = rl_config.useA85
    rl_config.useA85 = 0
    try:
        yield
    finally:
        rl_config.useA85 = before


class _Story:
    """A leaflet's parts, one after another."""

    def __init__(self, leaflet: Leaflet) -> None:
        self.leaflet = leaflet
        self.say = leaflet.speaker.gettext
        self.scans = [ImageReader(io.BytesIO(one.scan)) if one.scan else None for one in leaflet.pictures]

    def parts(self) -> Iterator[Flowable]:
        """The whole document."""
        yield self.head()
        yield from self.problems()
        yield from self.actions()
        yield from self.waiting()
        yield from self.drawing()
        yield from self.criteria()
        yield from self.scales()
        if self.leaflet.rows:
            yield Spacer(1, 5 * mm)
            yield text(self.leaflet.footer, 7, colour=SOFT)

    def head(self) -> Flowable:
        """Title, student, state and score."""
        leaflet = self.leaflet
        who = leaflet.student or leaflet.student_id
        behind = [f"({leaflet.student_id})"] if leaflet.student else []
        about = " · ".join([" ".join([escape(who), *map(escape, behind)]), *leaflet.about])
        state = COLOURS[STATE_COLOURS[leaflet.status]]
        told = [
            text(leaflet.title, 14, BOLD),
            Spacer(1, 1 * mm),
            text(about, 10, as_markup=True),
            Spacer(1, 1 * mm),
            text(self.say(words.STATES[leaflet.status]), 10, BOLD, colour=state),
        ]
        score: list[Flowable] = [text(f"{leaflet.score} / {leaflet.most}", 18, BOLD, right=True)]
        if leaflet.status == "needs_review":
            final = self.say(N_("The score is final after a person has looked."))
            score += [Spacer(1, 1 * mm), text(final, 7.5, colour=SOFT, right=True)]
        head = table([[told, score]], [WIDE_MM - 70, 70])
        if not leaflet.tally:
            return head
        counts = [
            part
            for verdict, count in leaflet.tally
            for part in (Badge(verdict), text(f"{count} {self.say(words.VERDICTS[verdict])}", 8))
        ]
        widths = [BADGE_MM + 1.4, (WIDE_MM / max(len(leaflet.tally), 4)) - BADGE_MM - 1.4] * len(
            leaflet.tally
        )
        return Table(
            [[head], [Spacer(1, 2 * mm)], [table([counts], widths)]], colWidths=[WIDE_MM * mm], style=PLAIN
        )

    def problems(self) -> Iterator[Flowable]:
        """What a person should know."""
        if not self.leaflet.problems:
            return
        lines = [text(self.say(N_("Problems")), 9, BOLD)]
        for problem in self.leaflet.problems:
            told = " ".join(part for part in (problem.text, problem.file, problem.detail) if part)
            lines.append(text(f"• {told}", 8.5))
        style = [
            ("BACKGROUND", (0, 0), (-1, -1), ink("#fbf6ea")),
            ("BOX", (0, 0), (-1, -1), 0.5, ink("#e6d5a8")),
        ]
        yield Spacer(1, 3 * mm)
        yield Table([[line] for line in lines], colWidths=[WIDE_MM * mm], style=style)

    def actions(self) -> Iterator[Flowable]:
        """What happened, and what to redo."""
        if not self.leaflet.actions:
            return
        yield from self.heading(N_("What happened, and what to redo"))
        for number, action in enumerate(self.leaflet.actions, start=1):
            yield from self.action(number, action)

    def action(self, number: int, action: Action) -> Iterator[Flowable]:
        """One mistake, its picture beside it."""
        wide = WIDE_MM if action.look is None else WIDE_MM * 0.54
        at = f' <font color="{SOFT}">– {printed(action.at)}</font>' if action.at else ""
        told = [text(f"{number}. {printed(action.title)}{at}", 9.5, BOLD, as_markup=True)]
        told.append(text(printed(action.said), 9, as_markup=True))
        if action.alternatives:
            told.append(text(self.say(RIVALS), 9))
            either = escape(self.say(OR))
            told += [text(f"• {either} {printed(one)}", 9, as_markup=True) for one in action.alternatives]
        if action.explains:
            what = N_("This explains:") if action.redo or action.at else N_("These are:")
            named = ", ".join(printed(one) for one in action.explains)
            told.append(text(f"{escape(self.say(what))} {named}", 8, colour=SOFT, as_markup=True))
        beside = [told, self.look(action.look, WIDE_MM - wide) if action.look else ""]
        steps = [
            text(f"{step}. {printed(line)}", 8, indent=4, as_markup=True)
            for step, line in enumerate(action.redo, start=1)
        ]
        yield Spacer(1, 2 * mm)
        style = [*PLAIN, ("RIGHTPADDING", (0, 0), (0, 0), GAP_MM * mm)]
        widths = [wide * mm, (WIDE_MM - wide) * mm]
        yield KeepTogether([Table([beside], colWidths=widths, style=style, hAlign="LEFT")])
        if steps:
            again = text(self.say(N_("Draw again, from the first wrong point on:")), 8, BOLD)
            yield KeepTogether([again, *steps])

    def waiting(self) -> Iterator[Flowable]:
        """What a person must still look at."""
        if not self.leaflet.waiting:
            return
        yield from self.heading(N_("What a person must still look at"))
        for one in self.leaflet.waiting:
            named = ", ".join(printed(name) for name in one.names)
            yield text(f'• {named} <font color="{SOFT}">– {escape(one.why)}</font>', 8.5, as_markup=True)
        looks = self.leaflet.waiting_looks
        if looks:
            third = (WIDE_MM - 2 * GAP_MM) / 3
            cells = [self.look(look, third) for look in looks]
            yield Spacer(1, 2 * mm)
            yield table([cells], [third + GAP_MM] * len(cells))

    def drawing(self) -> Iterator[Flowable]:
        """The sheets with their marks."""
        if not self.leaflet.sheets:
            return
        yield CondPageBreak(90 * mm)
        yield from self.heading(N_("The drawing"))
        if self.leaflet.has_marks:
            yield from self.legend()
        for sheet in self.leaflet.sheets:
            yield from self.sheetful(sheet)

    def legend(self) -> Iterator[Flowable]:
        """What colours, marks and lines mean."""
        legend = [
            part
            for verdict, word in words.VERDICTS.items()
            for part in (Badge(verdict), text(self.say(word), 7.5, colour=SOFT))
        ]
        width = WIDE_MM / len(words.VERDICTS)
        yield table([legend], [BADGE_MM + 1.4, width - BADGE_MM - 1.4] * len(words.VERDICTS))
        lines = [f"- - -  {self.say(N_('doubtful'))}"]
        lines += [f"· · · ·  {self.say(N_('expected'))}"] if self.leaflet.has_ghosts else []
        yield text("     ".join(lines), 7.5, colour=SOFT)

    def sheetful(self, sheet: Sheetful) -> Iterator[Flowable]:
        """The whole page, then its plans two in a row."""
        whole = [look for look in sheet.looks if look.kind == "sheet"]
        plans = [look for look in sheet.looks if look.kind != "sheet"]
        if len(whole) == len(plans) == 1:
            rows: list[list[Look]] = [[whole[0], plans[0]]]
        else:
            rows = [[look] for look in whole] + [plans[k : k + 2] for k in range(0, len(plans), 2)]
        for number, row in enumerate(rows):
            beside = WIDE_MM if not plans else ORIENTING_SHARE * WIDE_MM
            wide = beside if len(row) == 1 and row[0] in whole else HALF_MM
            cells = [self.look(look, wide, sheet.source if look in whole else "") for look in row]
            parts: list[Flowable] = [Spacer(1, 2 * mm), table([cells], [wide + GAP_MM] * len(cells))]
            if number == 0 and not whole:
                parts.append(text(sheet.source, 7.5, colour=SOFT))
            yield KeepTogether(parts)

    def look(self, look: Look, wide_mm: float, below: str = "") -> list[Flowable]:
        """A look with its caption."""
        picture = self.leaflet.pictures[look.picture]
        drawn = Drawn(look, picture, self.scans[look.picture], wide_mm)
        return [
            drawn,
            text(escape(below) or printed(self.leaflet.below(look)), 7, colour=SOFT, as_markup=True),
        ]

    def criteria(self) -> Iterator[Flowable]:
        """The table of criteria, and what is to be said of all of it."""
        leaflet = self.leaflet
        if not leaflet.rows:
            return
        yield CondPageBreak(50 * mm)
        yield from self.heading(N_("Criteria"))
        yield criteria_table(leaflet)
        if leaflet.widening:
            yield Spacer(1, 2 * mm)
            yield text(leaflet.widening, 8, colour=SOFT)
        if leaflet.not_required:
            said = self.say(N_("Not handed in, and not required:"))
            named = ", ".join(printed(one) for one in leaflet.not_required)
            yield Spacer(1, 2 * mm)
            yield text(f"{escape(said)} {named}", 8, colour=SOFT, as_markup=True)

    def scales(self) -> Iterator[Flowable]:
        """The scales as declared and as used."""
        if self.leaflet.scales:
            yield CondPageBreak(30 * mm)
            yield from self.heading(N_("Scales"))
            yield scales_table(self.leaflet)

    def heading(self, title: str) -> Iterator[Flowable]:
        """A heading that does not stand alone at a page's foot."""
        yield CondPageBreak(28 * mm)
        yield Spacer(1, 5 * mm)
        yield text(self.say(title), 11.5, BOLD)
        yield Spacer(1, 1.5 * mm)
