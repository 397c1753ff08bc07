"""The reference drawing as PDF, and the solution step by step as HTML and PDF."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from reportlab.lib.units import mm
from reportlab.platypus import CondPageBreak, Flowable, KeepTogether, Spacer, Table

from grader.language import N_, Tongue
from grader.printed.pdf import Drawing, PdfDrawing, a4_document, paragraph, put_shapes
from grader.solution.formulas import (
    Formula,
    Grid,
    grid_html,
    grid_shapes,
    grid_text,
    mathml,
    plain,
    typeset,
    unicode_name,
)
from grader.solution.steps import CENTRES, NOTES, ExplainedStep, PlanSection, explain
from reference.drawing import sheets
from reference.drawing.canvas import A3_MM, Bounds, Shape, bounds, picture_svg
from reference.drawing.forces import LEVER, lever_of, scheme_of
from reference.drawing.sheets import figures_of
from reference.drawing.subject import DrawnFigure, Subject

# Shapes on a PDF page -----------------------------------------------------------------------------


def pdf(sheets: Sequence[Sequence[Shape]], title: str) -> bytes:
    """Return the sheets as the A3 pages of a PDF document."""
    drawing = PdfDrawing.begin(title)
    for shapes in sheets:
        put_shapes(drawing.canvas, shapes, (0.0, A3_MM[1] * mm), mm)
        drawing.next_page()
    return drawing.finish()


# Steps with their pictures ------------------------------------------------------------------------

MARGIN_MM = 2.5
LEAST_PICTURE_MM = (40.0, 12.0)
COLUMN_MM, GAP_MM, TALLEST_MM = 88.0, 6.0, 105.0
EXAMPLE = N_("Worked example: %(title)s")
EQUATION_MM, FORMULA_MM, INDENT_MM = 3.2, 2.9, 4.0
"""Size of letters in equations and formulas, and a formula's indent."""
MODEL_SHARE, MODEL_TALLEST_MM = 0.45, 45.0
"""Largest share of its printed size, and largest height, of the mechanism beside a plan's step."""


@dataclass(frozen=True, slots=True)
class Cutout:
    """Shapes and their visible box, sheet millimetres."""

    shapes: tuple[Shape, ...]
    box: Bounds

    @property
    def svg(self) -> Markup:
        """It as an SVG element of a page."""
        return Markup(picture_svg(self.shapes, self.box))  # noqa: S704 - written by the canvas

    @property
    def size(self) -> tuple[float, float]:
        """Width and height."""
        return self.box[2] - self.box[0], self.box[3] - self.box[1]


@dataclass(frozen=True, slots=True)
class Illustrated:
    """A step's words, its figure so far, and the parts of the mechanism that it uses."""

    explanation: ExplainedStep
    picture: Cutout | None
    model: Cutout | None


@dataclass(frozen=True, slots=True)
class Chapter:
    """A section with its pictures; `picture` shows what its table is about."""

    section: PlanSection
    steps: tuple[Illustrated, ...]
    picture: Cutout | None = None


def chapters(subject: Subject, tongue: Tongue) -> list[Chapter]:
    """Return every figure's steps with their pictures."""
    figures = figures_of(subject)
    return [
        Chapter(section, tuple(_illustrated(subject, figures, section)), _scheme(subject, section))
        for section in explain(subject, tongue)
    ]


def _scheme(subject: Subject, section: PlanSection) -> Cutout | None:
    """Return the picture of the forces in a section's table."""
    if section.table is None:
        return None
    drawn = lever_of(subject) if section.figure == LEVER else scheme_of(subject, section.figure)
    return Cutout(drawn.shapes, _box(drawn.shapes))


def _illustrated(
    subject: Subject, figures: dict[str, DrawnFigure], section: PlanSection
) -> Iterator[Illustrated]:
    if section.figure == CENTRES:
        yield from _centres(subject, figures["mechanism"], section)
        return
    if not section.steps:
        return
    figure, mechanism = figures[section.figure], figures["mechanism"]
    nodes = subject.nodes(section.figure)
    base = sheets.grey(mechanism)
    model_box = _box(base)
    earlier: list[str] = []
    for explanation in section.steps:
        step = explanation.step
        shapes = (*sheets.stage(figure, earlier, step.node), *sheets.compasses(step, nodes))
        marked = tuple(sheets.models(subject, step)) if section.figure != "mechanism" else ()
        model = Cutout((*base, *marked), model_box) if marked else None
        yield Illustrated(explanation, Cutout(shapes, _box(shapes)), model)
        earlier.append(step.node)


def _centres(subject: Subject, mechanism: DrawnFigure, section: PlanSection) -> Iterator[Illustrated]:
    """Yield each centre with its triangle on the finished sketch; one far off the sheet has no picture."""
    base = sheets.grey(mechanism)
    for explanation in section.steps:
        shapes = (*base, *sheets.centre(subject, explanation.step.node))
        box = _box(shapes)
        fits = max(box[2] - box[0], box[3] - box[1]) <= A3_MM[0]
        yield Illustrated(explanation, Cutout(shapes, box) if fits else None, None)


def _box(shapes: Sequence[Shape]) -> Bounds:
    """Return the box that shapes fill, with a margin; a single point has some paper around it."""
    left, top, right, bottom = bounds(shapes)
    across, down = (
        MARGIN_MM + max(0.0, least - size) / 2.0
        for least, size in zip(LEAST_PICTURE_MM, (right - left, bottom - top), strict=True)
    )
    return (left - across, top - down, right + across, bottom + down)


# As HTML ------------------------------------------------------------------------------------------


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("grader.solution.steps"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip


def html_page(subject: Subject, tongue: Tongue) -> str:
    """Return the steps as one self-contained page."""
    return (
        _environment()
        .get_template("steps.html")
        .render(
            lang=tongue.lang,
            title=subject.title,
            notes=[tongue.gettext(note) for note in NOTES],
            chapters=chapters(subject, tongue),
            mathml=mathml,
            grid_html=grid_html,
        )
    )


# As text ------------------------------------------------------------------------------------------


def text_page(subject: Subject, tongue: Tongue) -> str:
    """Return the steps as text for a terminal."""
    parts = [subject.title, *(tongue.gettext(note) for note in NOTES)]
    for section in explain(subject, tongue, lambda name: escape(unicode_name(name))):
        formulas, rates = (
            [plain(one, in_unicode=True) for one in group] for group in (section.formulas, section.rates)
        )
        parts += [section.title.upper(), "\n".join((*formulas, section.introduction.unescape()))]
        parts += [grid_text(section.table)] if section.table else []
        parts += [f"{step.number}.\n{step.text}" for step in section.steps]
        parts.append("\n".join(rates))
    return "\n\n".join(part for part in parts if part) + "\n"


# As PDF -------------------------------------------------------------------------------------------

_paragraph = partial(paragraph, leading=1.4)


def _drawn(
    picture: Cutout, share: float = 1.0, tallest_mm: float = TALLEST_MM, widest_mm: float = COLUMN_MM
) -> Drawing:
    """Return a picture on the printed page, true to size unless it is larger than its place."""
    width, height = picture.size
    return Drawing(picture.shapes, picture.box, mm * min(share, widest_mm / width, tallest_mm / height))


def pdf_pages(subject: Subject, tongue: Tongue) -> bytes:
    """Return the steps as an A4 document."""
    title = subject.title
    return a4_document(title, printed_steps(subject, tongue, title), 12 * mm, 14 * mm)


def printed_steps(subject: Subject, tongue: Tongue, title: str) -> Iterator[Flowable]:
    """Yield the steps as parts of an A4 document."""
    yield _paragraph(title, 14)
    yield Spacer(1, 2 * mm)
    yield from (_paragraph(tongue.gettext(note), 8.5) for note in NOTES)
    for chapter in chapters(subject, tongue):
        yield from _printed_chapter(chapter)


def _printed_chapter(chapter: Chapter) -> Iterator[Flowable]:
    section = chapter.section
    yield CondPageBreak(70 * mm)
    yield Spacer(1, 6 * mm)
    yield _paragraph(section.title, 12)
    yield Spacer(1, 1 * mm)
    yield from map(_formula, section.formulas)
    yield _paragraph(section.introduction, 9)
    if section.table is not None:
        yield from (Spacer(1, 2 * mm), _grid(section.table))
    if chapter.picture is not None:
        yield from (Spacer(1, 2 * mm), _drawn(chapter.picture))
    for step in chapter.steps:
        yield Spacer(1, 4 * mm)
        yield KeepTogether([*_printed_step(step)])
    yield Spacer(1, 4 * mm)
    yield KeepTogether([*map(_formula, section.rates)])


def _printed_step(step: Illustrated) -> Iterator[Flowable]:
    explanation = step.explanation
    if explanation.equation is not None:
        yield from (_grid(explanation.equation), Spacer(1, 1 * mm))
    head = Markup("{}. {}").format(explanation.number, explanation.sentence)
    words: list[Flowable] = [*map(_formula, explanation.before)]
    words += [_paragraph(head, 9.5), *map(_formula, explanation.after)]
    if step.model is not None:
        words += [Spacer(1, 2 * mm), _drawn(step.model, MODEL_SHARE, MODEL_TALLEST_MM)]
    widths = ((COLUMN_MM + GAP_MM) * mm, COLUMN_MM * mm)
    style = [("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0)]
    picture = _drawn(step.picture) if step.picture is not None else ""
    yield Table([[words, picture]], colWidths=widths, style=style)


def _grid(grid: Grid) -> Flowable:
    """Return an equation or a table, as wide as the page at most."""
    shapes = grid_shapes(grid, EQUATION_MM)
    return _drawn(Cutout(shapes, bounds(shapes)), widest_mm=2 * COLUMN_MM + GAP_MM)


def _formula(formula: Formula) -> Flowable:
    """Return a formula as a line of the printed page, smaller if it is too long."""
    found = typeset(formula, FORMULA_MM)
    gap = 0.3 * FORMULA_MM
    box = (-INDENT_MM, -found.rise - gap, max(found.width, 1.0), found.fall + gap)
    return _drawn(Cutout(found.shapes, box))
