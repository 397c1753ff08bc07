"""Printable answer sheets of a class, and the calibration page."""

import html
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import segno
from reportlab.lib.units import mm

from grader.language import N_, SIDES, Tongue, symbols, tongue
from grader.printed.layout import (
    CALIBRATION,
    CODE_MM,
    PAGE_MM,
    SCALE_BOXES,
    TENTH_CELLS,
    Layout,
    PageLayout,
    Template,
    TemplateFit,
    ValuePlace,
    best_template,
    boxes_of,
    calibration_segments,
    code_of,
    comb_cells,
    combs_of,
    marker_places,
    measured_on,
    page_construction,
    poles_mm,
    position_zones,
    values_asked,
    values_of,
)
from grader.printed.pdf import (
    BOLD,
    GREY,
    REGULAR,
    PdfDrawing,
    fitted,
    number,
    pieces_width_mm,
    put_shapes,
    runs,
    unprintable,
    width_mm,
    wrap,
)
from grader.records import ACCELERATION_PLAN, MECHANISM, VELOCITY_PLAN, Box, Identity, Reason, Value
from grader.tables.roster import RosterRow
from reference.authored.assignment import Assignment, PageKind, PageTable, Variant
from reference.drawing.canvas import Piece, pieces_of, scale_pieces
from reference.drawing.symbols import sense
from reference.errors import AuthoredFileError, CallError, Finding
from reference.quantities import FORCE_PLANS, scale_of, unit_of

# One page -----------------------------------------------------------------------------------------

FIGURES = {
    MECHANISM: N_("Mechanism"),
    VELOCITY_PLAN: N_("Velocity plan"),
    ACCELERATION_PLAN: N_("Acceleration plan"),
    FORCE_PLANS: N_("Force plans"),
}
KINDS = {
    "mechanism": N_("Mechanism"),
    "all": N_("Mechanism, velocities and accelerations"),
    "velocity": N_("Velocities"),
    "acceleration": N_("Accelerations"),
    "forces": N_("Forces"),
}

_STUDENT_MM: Box = (39.0, 12.5, 103.0, 36.0)
_TASK_MM: Box = (159.0, 12.5, 113.0, 36.0)
_ADVICE = (
    N_("Draw with a dark, sharp pencil or pen, inside the zones."),
    N_("Draw lines through the joints, arrowheads up to 4 mm long, letters 3 mm clear of lines."),
)
_FROM_CROSS = N_("Draw with a dark, sharp pencil or pen, inside the zones; a plan best from the grey cross.")
_ADVICE_MM: Box = (39.0, 37.8, 103.0, 11.7)
_CLEAR = N_("Leave the black squares and the code free of ink.")
_CLEAR_MM: Box = (289.0, 43.0, 118.0, 6.0)
_MEASURED = N_(
    "Lengths measured on the drawing, in millimetres with one decimal: one digit in each cell, nothing else"
)
_COMPUTED = N_("Values computed from them, in the unit beside the cells; the last cells may stay empty")
_TICKED = N_("Tick the sense of the moment")
_CELLS_AT_MM = (39.0, 265.9)
_TICK_MM = 5.0
"""Long enough to be seen, too short to be taken for a stroke."""
_POLE_MM = (2.0, 4.5)
"""Ends of the arms of the cross for a pole: open in the middle, where lines are to begin."""
_FAINT, _FAINT_PEN_MM = 0.9, 0.25
"""Lighter than any pencil: people see it, but no stroke is found in it on a scan."""
_CELL_GREY = 0.6
"""Light enough that the digits' ink stands out."""
_VALUE_PT = 6.5
_RULER_MM = (24.0, 291.0, 100.0)
"""Left end, height and length of the line that must measure 100 mm."""
_PT = 1.0 / mm
"""Millimetres in a point."""


@dataclass(frozen=True, slots=True)
class PageText:
    """The student's own texts on a page.

    Attributes
    ----------
    variants : of the drawings on the page
    sheet, sheets : this page's number among the student's, from 1, and how many there are
    poles : the names and best positions of the plans' poles, x, y in sheet mm
    """

    identity: Identity
    name: str
    variants: Sequence[Variant]
    sheet: int
    sheets: int
    poles: Sequence[tuple[str, tuple[float, float]]] = ()


@dataclass(frozen=True, slots=True)
class PageForm:
    """The part of a page that is the same for every student.

    Attributes
    ----------
    kind : of the assignment's page
    template : the page's
    fields : boxes to write in, by scale or vector
    poles : the names of the plans' poles, by figure
    values : places of computed values, by vector or moment
    positions : the zone of each position where the page has all of them, else empty
    """

    kind: PageKind
    template: Template
    fields: dict[str, Box]
    poles: dict[str, str]
    values: dict[str, ValuePlace] = field(default_factory=dict)
    positions: Mapping[int, Box] = field(default_factory=dict)


def draw_page(
    drawing: PdfDrawing,
    assignment: Assignment,
    text: PageText,
    form: PageForm,
    tongue: Tongue,
) -> None:
    """Draw a page and end it."""
    drawing.frame()
    drawing.markers(form.template)
    _code(drawing, text.identity)
    _student(drawing, assignment, text, tongue)
    _task(drawing, assignment, text.variants, tongue)
    _advice(drawing, tongue, has_cross=bool(text.poles))
    for figure, zone in form.template.zones.items():
        title = tongue.gettext(FIGURES[figure])
        apart = set(form.positions.values()) - {zone}
        for position, cell in form.positions.items() if apart else ((None, zone),):
            _zone(drawing, cell, title if position is None else f"{title}, {_position(position, tongue)}")
    for name, at in text.poles:
        _pole(drawing, at, name)
    _fields(drawing, assignment, form.fields, tongue)
    _values(drawing, assignment, form.values, tongue)
    _about_cells(drawing, form, tongue)
    draw_ruler(drawing, tongue)
    drawing.next_page()


def _code(drawing: PdfDrawing, identity: Identity) -> None:
    x, y, side, _ = CODE_MM
    modules = [list(map(bool, row)) for row in segno.make(code_of(identity), error="m", micro=False).matrix]
    quiet = 4
    module = side / (len(modules) + 2 * quiet)
    drawing.cells((x + quiet * module, y + quiet * module), module, runs(modules), 0.0)


def _student(drawing: PdfDrawing, assignment: Assignment, text: PageText, tongue: Tongue) -> None:
    x, y, wide, _ = _STUDENT_MM
    identity = text.identity
    title = [assignment.file.title.in_language(tongue.lang)]
    drawing.paragraphs((x, y + 3.5, wide, 9.0), title, (10.0, 9.0, 8.0), BOLD)
    positions = [one.position for one in text.variants if one.position is not None]
    variant = [] if identity.n is None else [f"n = {identity.n}"]
    variant += [_position(", ".join(map(str, positions)), tongue)] if positions else []
    sheet = tongue.gettext(N_("sheet {number} of {count}")).format(number=text.sheet, count=text.sheets)
    name = wrap(text.name, BOLD, 12.0, wide)[:1] or [""]
    drawing.text((x, y + 13.5), name[0], 12.0, BOLD)
    whose = [",  ".join([identity.student_id, *variant])]
    drawing.paragraphs((x, y + 18.8, wide, 4.6), whose, (10.0, 8.0, 6.5))
    drawing.text((x, y + 23.6), f"{tongue.gettext(KINDS[identity.kind])}, {sheet}", 9.0)


def _position(position: object, tongue: Tongue) -> str:
    return f"{tongue.gettext(N_('position'))} = {position}"


def _task(drawing: PdfDrawing, assignment: Assignment, variants: Sequence[Variant], tongue: Tongue) -> None:
    """Draw the task in words at the largest size that leaves room for the data below it.

    Of several positions on a page, the data that they have in common.
    """
    x, y, wide, high = _TASK_MM
    task = assignment.file.task.in_language(tongue.lang)
    data, *others = [given_data(assignment, variant, tongue) for variant in variants]
    data = [datum for datum in data if all(datum in other for other in others)]
    for size in (8.5, 8.0, 7.5, 7.0, 6.5, 6.0):
        step = 1.3 * size * _PT
        rows = _flow(data, size, wide)
        if len(wrap(task, REGULAR, size, wide)) * step + len(rows) * step <= high:
            break
    _, lines = fitted([task], REGULAR, (size,), (wide, high - len(rows) * step))
    base = y + size * _PT
    for line in lines:
        drawing.pieces((x, base), _with_indices(line), size)
        base += step
    base += min(1.0, y + high - base)
    for row in rows:
        at = x
        for datum in row:
            at = drawing.pieces((at, base), datum, size, BOLD) + _SPACE_MM
        base += step


_SPACE_MM = 3.0


def _with_indices(line: str) -> Iterator[Piece]:
    """Yield the pieces of a line in which names of vectors and scales have their indices."""
    height = 0
    for part in re.split("(<[^>]*>)", str(symbols(line))):
        if part.startswith("<"):
            height = {"<sub>": -1, "<sup>": 1}.get(part, 0)
        elif part:
            yield Piece(html.unescape(part), height)


def given_data(assignment: Assignment, variant: Variant, tongue: Tongue) -> list[tuple[Piece, ...]]:
    """Return the given data, each as label = value unit."""
    data = []
    for datum, given in assignment.given(variant):
        is_side = given if isinstance(given, str) else None
        value = tongue.gettext(SIDES[is_side]) if is_side else number(float(given), tongue.decimal_mark)
        unit = tongue.unit(datum.unit)
        gap = "" if unit in {"", "°"} else "\N{NO-BREAK SPACE}"
        data.append((*pieces_of(datum.label), Piece(f" = {value}{gap}{unit}")))
    return data


def _flow(data: list[tuple[Piece, ...]], size_pt: float, wide_mm: float) -> list[list[tuple[Piece, ...]]]:
    """Set data side by side in as many rows as they need."""
    rows: list[list[tuple[Piece, ...]]] = []
    used = wide_mm + 1.0
    for datum in data:
        wide = pieces_width_mm(datum, BOLD, size_pt)
        if used + wide > wide_mm:
            rows.append([])
            used = 0.0
        rows[-1].append(datum)
        used += wide + _SPACE_MM
    return rows


def _advice(drawing: PdfDrawing, tongue: Tongue, *, has_cross: bool) -> None:
    """Draw advice on making a drawing easy to read, and on what the registration of the scan needs."""
    advice = (_FROM_CROSS, *_ADVICE[1:]) if has_cross else _ADVICE
    for texts, box in ((advice, _ADVICE_MM), ((_CLEAR,), _CLEAR_MM)):
        words = [tongue.gettext(text) for text in texts]
        drawing.paragraphs(box, words, (7.5, 7.0, 6.5, 6.0, 5.5), lines_down=1)


def _zone(drawing: PdfDrawing, zone: Box, title: str) -> None:
    """Draw ticks just outside the zone's corners: no printed ink where strokes are looked for."""
    x, y, w, h = zone
    for cx, across in ((x - 0.6, 1.0), (x + w + 0.6, -1.0)):
        for cy, down in ((y - 0.6, 1.0), (y + h + 0.6, -1.0)):
            drawing.line((cx, cy, cx + across * _TICK_MM, cy), 0.2, GREY)
            drawing.line((cx, cy, cx, cy + down * _TICK_MM), 0.2, GREY)
    drawing.text((x + _TICK_MM + 1.5, y - 0.5), title, 6.5, REGULAR, GREY)


def _pole(drawing: PdfDrawing, at: tuple[float, float], name: str) -> None:
    """Draw a faint cross, open in the middle, with the pole's letter."""
    x, y = at
    near, far = _POLE_MM
    for dx, dy in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        drawing.line((x + near * dx, y + near * dy, x + far * dx, y + far * dy), _FAINT_PEN_MM, _FAINT)
    drawing.text((x - 5.0, y + 5.5), name, 8.0, REGULAR, _FAINT)


def _fields(drawing: PdfDrawing, assignment: Assignment, fields: dict[str, Box], tongue: Tongue) -> None:
    names = assignment.file.names
    for name, box in fields.items():
        x, y, _, h = box
        shown = names.get(name, name)
        label = (*scale_pieces(shown), Piece(" =")) if name in SCALE_BOXES else pieces_of(shown)
        size = 10.0 if name in SCALE_BOXES else 8.0
        wide = pieces_width_mm(label, REGULAR, size)
        drawing.pieces((x - wide - 0.8, y + 0.68 * h), label, size)
        if name in SCALE_BOXES:
            drawing.box(box, 0.25)
        else:
            _comb(drawing, box, tongue)


def _values(
    drawing: PdfDrawing, assignment: Assignment, values: Mapping[str, ValuePlace], tongue: Tongue
) -> None:
    """Draw the cells for computed values, each with its name and unit, and a moment's two senses to tick."""
    for name, place in values.items():
        x, y, _, h = place.box
        unit = Piece(f", {tongue.unit(unit_of(name))}")
        label = (*pieces_of(assignment.file.names.get(name, name)), unit)
        wide = pieces_width_mm(label, REGULAR, _VALUE_PT)
        drawing.pieces((x - wide - 0.6, y + 0.7 * h), label, _VALUE_PT)
        _comb(drawing, place.box, tongue, place.decimals)
        for box, sign in zip(place.senses, (1.0, -1.0), strict=False):
            drawing.box(box, 0.25)
            at = complex(box[0] - 2.6, -(box[1] + box[3] / 2.0))
            put_shapes(drawing.canvas, sense(at, sign), (0.0, PAGE_MM[1] * mm), mm)


def _about_cells(drawing: PdfDrawing, form: PageForm, tongue: Tongue) -> None:
    """Say above the foot what is written into the page's cells."""
    told = [_MEASURED] if form.fields.keys() - SCALE_BOXES.keys() else []
    told += [_COMPUTED] if form.values else []
    told += [_TICKED] if any(place.senses for place in form.values.values()) else []
    drawing.text(_CELLS_AT_MM, ". ".join(map(tongue.gettext, told)), 6.5, REGULAR, GREY)


def _comb(drawing: PdfDrawing, box: Box, tongue: Tongue, decimals: int = TENTH_CELLS) -> None:
    """Draw a cell for each digit, light so that digits stand out, and the decimal mark."""
    cells = comb_cells(box, decimals)
    for cell in cells:
        drawing.box(cell, 0.18, _CELL_GREY)
    if not decimals:
        return
    x, y, wide, high = cells[-decimals - 1]
    middle = (x + wide + cells[-decimals][0]) / 2.0
    mark = tongue.decimal_mark
    drawing.text((middle - width_mm(mark, BOLD, 11.0) / 2.0, y + high - 1.0), mark, 11.0, BOLD)


def draw_ruler(drawing: PdfDrawing, tongue: Tongue) -> None:
    """Draw a line of exactly 100 mm below the frame, which shows whether the printer shrank the page."""
    x, y, long = _RULER_MM
    drawing.line((x, y, x + long, y), 0.2, GREY)
    for end in (x, x + long):
        drawing.line((end, y - 1.2, end, y + 1.2), 0.2, GREY)
    words = tongue.gettext(N_("This line must measure 100 mm: print at 100 %, without fitting to the page."))
    drawing.text((x + long + 3.0, y + 0.8), words, 6.5, REGULAR, GREY)


# The sheets of a class ----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Sheets:
    """A printable document.

    Attributes
    ----------
    pdf : the file's bytes
    layout : the contents of `layout.json`
    problems : for the instructor: figures that are too large for their zones
    """

    pdf: bytes
    layout: Layout
    problems: tuple[Reason, ...] = ()


def make_sheets(
    assignment: Assignment,
    rows: Sequence[RosterRow],
    lang: str = "en",
    *,
    roster: str = "roster.csv",
    asked: Collection[str] | None = None,
) -> Sheets:
    """Make answer sheets for every row of a roster: a page per page of the assignment, in the rows' order.

    Arguments
    ---------
    rows : their `lang`, if given, overrides `lang`
    roster : the file's name, for messages
    asked : the vectors that have a box for the measured length, all by default; and ``NAME_value`` of those
        vectors and moments that have a place for the computed value

    Raises AuthoredFileError with every row whose n or position the assignment does not have.
    """
    variants = variants_of(assignment, rows, roster)
    forms, problems = _forms(assignment, asked)
    poles = [poles_mm(assignment, form.template, variants) for form in forms]
    drawing = PdfDrawing.begin(assignment.file.title.in_language(lang))
    of_student: dict[tuple[str, int | None], list[int]] = {}
    for index, row in enumerate(rows):
        of_student.setdefault((row.student_id, row.n), []).append(index)
    for index, (row, variant) in enumerate(zip(rows, variants, strict=True)):
        together = of_student[row.student_id, row.n]
        for page, form in enumerate(forms, start=1):
            if form.positions and index != together[0]:
                continue
            meant = together if form.positions else [index]
            position = None if form.positions else variant.position
            identity = Identity(assignment.id, row.student_id, variant.n, position, form.kind)
            own = [
                (_pole_name(assignment, form, figure, variants[k]), places[k])
                for figure, places in poles[page - 1].items()
                for k in meant
            ]
            text = PageText(identity, row.name, [variants[k] for k in meant], page, len(forms), own)
            draw_page(drawing, assignment, text, form, tongue(row.lang or lang))
    layout = Layout(pages=[_layout(form) for form in forms])
    return Sheets(drawing.finish(), layout, (*problems, *_unprintable(rows, roster)))


def _pole_name(assignment: Assignment, form: PageForm, figure: str, variant: Variant) -> str:
    """Return the pole's letter, with the position's number where the page has all of them."""
    pole = form.poles[figure]
    return f"{assignment.file.names.get(pole, pole)}{variant.position if form.positions else ''}"


def _unprintable(rows: Sequence[RosterRow], roster: str) -> Iterator[Reason]:
    for row in rows:
        letters = unprintable(row.name)
        if letters:
            known: dict[str, Value] = {"line": row.line, "letters": letters, "student": row.student_id}
            yield Reason("sheet_letters", known, roster)


def variants_of(assignment: Assignment, rows: Sequence[RosterRow], roster: str) -> list[Variant]:
    """Return the variant of each row; raises AuthoredFileError with every row without one."""
    findings: list[Finding] = []
    variants: list[Variant] = []
    for row in rows:
        try:
            variants.append(assignment.variant(row.n, row.position))
        except CallError as error:
            findings.append(Finding(row.student_id, "row_variant", error.parameters, row.line))
    if findings:
        raise AuthoredFileError(roster, tuple(findings))
    return variants


def _forms(
    assignment: Assignment, asked: Collection[str] | None
) -> tuple[list[PageForm], tuple[Reason, ...]]:
    forms: list[PageForm] = []
    problems: list[Reason] = []
    for table in assignment.file.page:
        figures = list(dict.fromkeys(table.figures))
        fit = best_template(assignment, figures, table.grid)
        construction = page_construction(assignment, figures)
        names = [] if table.grid else [vector.name for vector in measured_on(construction, figures)]
        boxes = boxes_of(names, asked)
        if names and not boxes and (asked is None or set(names) & set(asked)):
            known: dict[str, Value] = {"form": table.kind, "lengths": len(names)}
            problems.append(Reason("sheet_boxes", known, str(assignment.path)))
        values = values_of(assignment, figures, asked or ())
        wanted = [] if table.grid else values_asked(assignment, table, construction, asked or ())
        if len(values) < len(wanted):
            known = {"form": table.kind, "values": tuple(one for one in wanted if one not in values)}
            problems.append(Reason("sheet_values", known, str(assignment.path)))
        problems.extend(_too_small(assignment, table, fit))
        scales = {scale: SCALE_BOXES[scale] for scale in map(scale_of, figures)}
        cells = position_zones(assignment, fit.template.zones) if table.grid else {}
        forms.append(
            PageForm(table.kind, fit.template, scales | boxes, dict(construction.poles), values, cells)
        )
    return forms, tuple(problems)


def _too_small(assignment: Assignment, table: PageTable, fit: TemplateFit) -> list[Reason]:
    problems: list[Reason] = []
    for figure, share in fit.room.items():
        if share >= 1.0:
            continue
        wide, high = fit.need_mm[figure]
        _, _, zone_wide, zone_high = fit.template.of_one(table.grid).zones[figure]
        sides = {"wide": wide, "high": high, "zone_wide": zone_wide, "zone_high": zone_high}
        known: dict[str, Value] = {f"{name}_mm": round(side) for name, side in sides.items()}
        known |= {"form": table.kind, "figure": figure, "fits_percent": round(100 * share)}
        problems.append(Reason("sheet_zone_small", known, str(assignment.path)))
    return problems


def _layout(form: PageForm) -> PageLayout:
    zones: dict[str, Box | dict[str, Box]] = {**form.template.zones, "fields": form.fields}
    markers = marker_places(form.template)
    cells, positions = combs_of(form.fields), dict(form.positions)
    return PageLayout(
        kind=form.kind, markers=markers, zones=zones, cells=cells, values=form.values, positions=positions
    )


# The calibration page -----------------------------------------------------------------------------

_PEN_MM = 0.3
_CALIBRATION_TEXT = N_(
    "Calibration page of planmark. Print it on A3 at 100 %, scan it as the drawings will be scanned, and let"
    " planmark read it: the segments are known, so their errors are the printer's and the scanner's."
)


def make_calibration(lang: str = "en") -> Sheets:
    """Make the page that `planmark sheet --calibration` prints."""
    words = tongue(lang)
    drawing = PdfDrawing.begin(words.gettext(N_("Calibration page")))
    drawing.frame()
    drawing.markers(CALIBRATION)
    drawing.paragraphs(
        (39.0, 16.0, 103.0, 36.0), [words.gettext(_CALIBRATION_TEXT)], (9.0, 8.0, 7.0), pitch=1.3
    )
    for (x0, y0), (x1, y1) in calibration_segments().tolist():
        drawing.line((x0, y0, x1, y1), _PEN_MM)
    draw_ruler(drawing, words)
    drawing.next_page()
    page = PageLayout(kind="calibration", markers=marker_places(CALIBRATION), zones={"fields": {}})
    return Sheets(drawing.finish(), Layout(pages=[page]))
