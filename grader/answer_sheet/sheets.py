"""Answer sheets of a class, and the layout that all of them share."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from grader.answer_sheet.drawing import Drawing
from grader.answer_sheet.fit import Fit, best_template, construction_for, poles_mm
from grader.answer_sheet.page import PageForm, PageText, draw_page
from grader.answer_sheet.words import unprintable
from grader.i18n import tongue
from grader.layout import (
    EASY_FIELDS,
    SCALE_BOXES,
    Layout,
    PageLayout,
    combs_of,
    field_boxes,
    marker_places,
)
from grader.records import ACCELERATION_PLAN, MECHANISM, VELOCITY_PLAN, Box, Identity, Problem
from grader.roster import RosterRow
from grader.rubric import RubricFile
from reference.assignment import Assignment, Variant
from reference.assignment_file import PageTable
from reference.derivation import construction_of
from reference.errors import AuthoredFileError, CallError, Finding

_SCALE_OF = {MECHANISM: "kL", VELOCITY_PLAN: "kv", ACCELERATION_PLAN: "ka"}


@dataclass(frozen=True, slots=True)
class Sheets:
    """A printable document.

    Attributes
    ----------
    pdf : the file's bytes
    layout : what `layout.json` says
    problems : what the instructor should know: figures that are too large for their zones
    """

    pdf: bytes
    layout: Layout
    problems: tuple[Problem, ...] = ()


@dataclass(frozen=True, slots=True)
class _PagePlan:
    """One page of the assignment: its template and boxes, the same for every student."""

    table: PageTable
    form: PageForm


def make_sheets(
    assignment: Assignment,
    rows: Sequence[RosterRow],
    lang: str = "en",
    *,
    roster: str = "roster.csv",
    asked: Collection[str] | None = None,
) -> Sheets:
    """Answer sheets for every row of a roster: a page per page of the assignment, in the rows' order.

    Arguments
    ---------
    rows : their `lang`, where given, goes before `lang`
    roster : the file's name, for messages
    asked : the vectors that have a box for the measured length, all by default

    Raises AuthoredFileError with every row whose n or position does not suit the assignment.
    """
    variants = _variants(assignment, rows, roster)
    plans, problems = _plans(assignment, asked)
    poles = [poles_mm(assignment, plan.form.template, variants) for plan in plans]
    drawing = Drawing.begin(assignment.file.title.in_language(lang))
    for index, (row, variant) in enumerate(zip(rows, variants, strict=True)):
        for number, plan in enumerate(plans, start=1):
            identity = Identity(assignment.id, row.student_id, variant.n, variant.position, plan.table.kind)
            own = {figure: places[index] for figure, places in poles[number - 1].items()}
            text = PageText(identity, row.name, number, len(plans), own)
            draw_page(drawing, assignment, text, plan.form, tongue(row.lang or lang))
    layout = Layout(pages=[_layout(plan) for plan in plans])
    return Sheets(drawing.finish(), layout, (*problems, *_unprintable(rows, roster)))


def _unprintable(rows: Sequence[RosterRow], roster: str) -> Iterator[Problem]:
    for row in rows:
        letters = unprintable(row.name)
        if letters:
            message = f"line {row.line}: the font has no {letters}; {row.student_id}'s name has boxes instead"
            yield Problem("sheet_letters", message, roster)


def page_layouts(assignment: Assignment, asked: Collection[str] | None = None) -> Layout:
    """The layout of an assignment's pages, without printing any; `asked` as for `make_sheets`."""
    return Layout(pages=[_layout(plan) for plan in _plans(assignment, asked)[0]])


def _variants(assignment: Assignment, rows: Sequence[RosterRow], roster: str) -> list[Variant]:
    findings: list[Finding] = []
    variants: list[Variant] = []
    for row in rows:
        try:
            variants.append(assignment.variant(row.n, row.position))
        except CallError as error:
            findings.append(Finding(f"line {row.line}, {row.student_id}", error.message))
    if findings:
        raise AuthoredFileError(roster, tuple(findings))
    return variants


def _plans(
    assignment: Assignment, asked: Collection[str] | None
) -> tuple[list[_PagePlan], tuple[Problem, ...]]:
    plans: list[_PagePlan] = []
    problems: list[Problem] = []
    for table in assignment.file.page:
        figures = list(dict.fromkeys(table.figures))
        fit = best_template(assignment, figures)
        construction = construction_for(assignment, figures)
        names = [vector.name for figure in figures for vector in construction.vectors_of(figure)]
        boxes = _boxes(names, asked)
        if names and not boxes and (asked is None or set(names) & set(asked)):
            message = f"page {table.kind}: {len(names)} lengths are too many for boxes; none are printed"
            problems.append(Problem("sheet_boxes", message, str(assignment.path)))
        problems.extend(_too_small(assignment, table, fit))
        scales = {_SCALE_OF[figure]: SCALE_BOXES[_SCALE_OF[figure]] for figure in figures}
        plans.append(_PagePlan(table, PageForm(fit.template, scales | boxes, dict(construction.poles))))
    return plans, tuple(problems)


def cells_of(
    assignment: Assignment, figures: Sequence[str], asked: Collection[str] | None = None
) -> dict[str, tuple[Box, ...]]:
    """The cells for measured lengths on a page with these figures, in the order of its zones; by vector."""
    table = next((page for page in assignment.file.page if set(page.figures) == set(figures)), None)
    if table is None:
        return {}
    construction = construction_for(assignment, table.figures)
    ordered = dict.fromkeys(table.figures)
    return combs_of(_boxes([v.name for figure in ordered for v in construction.vectors_of(figure)], asked))


@dataclass(frozen=True, slots=True)
class Asked:
    """What a rubric asks to be read on pages; everything where it asks for no vector.

    Attributes
    ----------
    figures : those that it asks anything of, and the sketch
    vectors : all vectors of these figures
    cells : the printed boxes for measured lengths, by vector, for each page of the answer sheet
    """

    figures: frozenset[str] = frozenset()
    vectors: tuple[str, ...] = ()
    cells: Mapping[frozenset[str], Mapping[str, tuple[Box, ...]]] = field(default_factory=dict)


def asked_of(assignment: Assignment, rubric: RubricFile) -> Asked:
    """What a rubric asks to be read."""
    construction = construction_of(
        assignment.mechanism(assignment.variants()[:1]),
        accelerations=rubric.needs_accelerations,
        plate_by_similarity=assignment.file.plate_images == "similarity",
    )
    known = [construction.vectors[name] for name in rubric.vectors if name in construction.vectors]
    plans = dict.fromkeys(construction.figure_of(vector.head) for vector in known)
    return Asked(
        frozenset({MECHANISM, *plans} if plans else ()),
        tuple(vector.name for plan in plans for vector in construction.vectors_of(plan)),
        {
            frozenset(page.figures): cells_of(assignment, page.figures, rubric.vectors)
            for page in assignment.file.page
        },
    )


def _boxes(names: Sequence[str], asked: Collection[str] | None) -> dict[str, Box]:
    """The boxes for the lengths asked for.

    A vector's box is where it would be if all had one: a rubric that asks for others tomorrow finds
    those printed today in their places. Only where all would be too small are those asked for alone
    counted.
    """
    if asked is None:
        return field_boxes(tuple(names))
    wanted = [name for name in names if name in asked]
    boxes = field_boxes(tuple(names if len(names) <= EASY_FIELDS else wanted))
    return {name: boxes[name] for name in wanted if name in boxes}


def _too_small(assignment: Assignment, table: PageTable, fit: Fit) -> list[Problem]:
    problems: list[Problem] = []
    for figure, share in fit.room.items():
        if share >= 1.0:
            continue
        wide, high = fit.need_mm[figure]
        _, _, zone_wide, zone_high = fit.template.zones[figure]
        message = (
            f"page {table.kind}: {figure} needs up to {wide:.0f} x {high:.0f} mm at the assignment's scales,"
            f" its zone has {zone_wide:.0f} x {zone_high:.0f} mm; it fits at {100 * share:.0f} % of that size"
        )
        problems.append(Problem("sheet_zone_small", message, str(assignment.path)))
    return problems


def _layout(plan: _PagePlan) -> PageLayout:
    zones: dict[str, Box | dict[str, Box]] = {**plan.form.template.zones, "fields": plan.form.fields}
    return PageLayout(
        kind=plan.table.kind,
        markers=marker_places(plan.form.template),
        zones=zones,
        cells=combs_of(plan.form.fields),
    )
