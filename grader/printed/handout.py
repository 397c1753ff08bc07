"""Task sheets: the given data and the tables to fill in, without any of the solution."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

import numpy as np
from markupsafe import Markup
from reportlab.lib.colors import grey, whitesmoke
from reportlab.lib.pagesizes import A4
from reportlab.lib.units import mm
from reportlab.platypus import Flowable, PageBreak, Spacer, Table

from grader.language import N_, Tongue, symbols, tongue
from grader.printed.answer_sheet import given_data, variants_of
from grader.printed.pdf import BOLD, Drawing, a4_document, number, paragraph
from grader.rubric import SECTIONS, RubricFile, accelerations_of, scales_asked
from grader.tables.roster import RosterRow
from reference.authored.assignment import Assignment, Variant
from reference.authored.toml_file import LENGTH_UNITS_M
from reference.construction.forces import reaction
from reference.drawing.canvas import Piece, bounds, pieces_of, scale_pieces
from reference.drawing.sketch import scheme
from reference.drawing.subject import Subject
from reference.errors import MechanismError
from reference.geometry import ComplexArray, FloatArray
from reference.mechanism import GROUND, Body, DrivingSlider, FixedGuide, guides_of, short_names
from reference.plan import Plan, exact_plan
from reference.quantities import DRAWN, kind_of, unit_of

NAME, GROUP, DATE = N_("Name"), N_("Group"), N_("Date")
NUMBER = {"n": N_("number"), "position": N_("position")}
GIVEN, FIXED = N_("Given data"), N_("Fixed points and guides (x; y)")
SCHEME = N_("Scheme of the mechanism, not to scale and not in the given position")
OWN_SCHEME = N_("Scheme of the mechanism, not to scale")
GUIDE = N_("guide of %(joint)s through %(point)s, %(angle)s to the horizontal")
TABLES = {
    "scales": N_("Scales"),
    "velocity_plan": N_("Velocities"),
    "acceleration_plan": N_("Accelerations"),
    "angular": N_("Angular velocities and accelerations"),
    "force_plans": N_("Forces"),
    "moments": N_("Moments"),
}
SCALE, VALUE, VECTOR, LENGTH = N_("Scale"), N_("Value"), N_("Vector"), N_("Drawn, mm")
DIRECTION, QUANTITY = N_("Direction, °"), N_("Quantity")
SIGNS = N_(
    "Directions count counter-clockwise from the horizontal to the right; angular quantities are positive"
    " counter-clockwise."
)
BODIES = {True: N_("Masses, and accelerations of the centres of mass"), False: N_("Masses")}
LOADS, LINK, CENTRE = N_("Loads"), N_("Link"), N_("Centre of mass")
LOAD = (N_("Load"), LINK, N_("Point"), VALUE, DIRECTION)
ON_THE_LINE = {
    False: N_("%(point)s on %(link)s, %(along)s from %(tail)s"),
    True: N_("%(point)s on %(link)s extended beyond %(tail)s, %(along)s from %(tail)s"),
}
BESIDE = {
    True: N_("%(point)s: %(along)s from %(tail)s along %(link)s, %(across)s to the left"),
    False: N_("%(point)s: %(along)s from %(tail)s along %(link)s, %(across)s to the right"),
}
MOTIONS = {True: N_("along its motion"), False: N_("against its motion")}
OWN = N_("Take accelerations of the centres of mass and angular accelerations from your acceleration plan.")
REACTION = N_("%(vector)s is the force of link %(by)s on link %(on)s; 0 stands for the frame.")

WIDE_MM = 182.0
"""Width of A4 between margins of 14 mm."""
FRAME_PT = 6.0
"""Space that reportlab leaves on each side of a page's text."""
SCHEME_MM = (104.0, 78.0)
"""Room for the scheme: the data stand beside it."""
SYMBOLS_MM = 34.0
"""Part of that room for grounds, guides and letters around the joints."""
ROW_MM, GAP_MM = 6.2, 6.0
"""Rows are high enough to write in by hand."""
EVERY_POSITION = N_("Results of all positions")
WRITING_MM = 8.0
"""Height of a row of that table: numbers of four digits are written in narrow columns."""
MOST_ROWS = 38
"""Rows in a column of tables: as many as a page is high; longer tables stand below one another."""


def make_handout(
    assignment: Assignment,
    rubric: RubricFile,
    rows: Sequence[RosterRow],
    lang: str = "en",
    *,
    roster: str = "roster.csv",
    example: Iterable[Flowable] = (),
) -> bytes:
    """Make A4 task sheets as PDF, in the rows' order; a row without a student has lines for a name.

    A page with a table of all positions follows where a student has several.

    Arguments
    ---------
    rows : their `lang`, if given, overrides `lang`
    roster : the file's name, for messages
    example : a worked example, printed once after the sheets

    Raises AuthoredFileError with every row whose n or position the assignment does not have, and
    MechanismError if no variant assembles.
    """
    variants = variants_of(assignment, rows, roster)
    story: list[Flowable] = []
    for _, group in groupby(zip(rows, variants, strict=True), lambda one: (one[0].student_id, one[1].n)):
        own = list(group)
        for row, variant in own:
            story += _sheet(assignment, rubric, row, variant, tongue(row.lang or lang))
        if len(own) > 1 and own[0][1].position is not None:
            positions = [str(variant.position) for _, variant in own]
            story += _every_position(assignment, rubric, own[0][0], positions, tongue(own[0][0].lang or lang))
    margin = (A4[0] - WIDE_MM * mm) / 2.0 - FRAME_PT
    worked = [*example]
    title = assignment.file.title.in_language(lang)
    return a4_document(title, [*story, *worked] if worked else story[:-1], margin, 12 * mm)


def _sheet(
    assignment: Assignment, rubric: RubricFile, row: RosterRow, variant: Variant, speaker: Tongue
) -> Iterator[Flowable]:
    """Yield everything that one student is given."""
    file = assignment.file
    yield paragraph(file.title.in_language(speaker.lang), 14, BOLD)
    yield Spacer(1, 1.5 * mm)
    yield paragraph(_whose(row, variant, speaker), 10, BOLD)
    yield Spacer(1, 2.5 * mm)
    yield paragraph(symbols(file.task.in_language(speaker.lang)), 10)
    yield Spacer(1, 2.5 * mm)
    drawn, title = _scheme(assignment, variant)
    caption = paragraph(speaker.gettext(title), 8)
    data: list[Flowable] = [paragraph(speaker.gettext(GIVEN), 10, BOLD)]
    data += [paragraph(_letters(datum), 10) for datum in given_data(assignment, variant, speaker)]
    gravity = assignment.mechanism([variant]).gravity
    if gravity is not None:
        data.append(
            paragraph(f"g = {number(float(gravity[0]), speaker.decimal_mark)} {speaker.unit('m/s²')}", 10)
        )
    data += [Spacer(1, 2 * mm), paragraph(speaker.gettext(FIXED), 10, BOLD)]
    data += [paragraph(line, 9) for line in _fixed(assignment, variant, speaker)]
    yield _side_by_side(data, [drawn, caption], WIDE_MM - SCHEME_MM[0] - GAP_MM)
    yield Spacer(1, 3 * mm)
    if accelerations_of(assignment, rubric):
        yield from _masses(assignment, rubric, variant, speaker)
    yield from _tables(assignment, rubric, speaker)
    yield Spacer(1, 2 * mm)
    yield paragraph(speaker.gettext(SIGNS), 8)
    yield PageBreak()


def _whose(row: RosterRow, variant: Variant, speaker: Tongue) -> str:
    """Return the student and the variant; lines to write on if there is no student."""
    blank = "_" * 14
    parts = [f"{speaker.gettext(NUMBER[name])} {value}" for name, value in variant.numbers.items()]
    if row.student_id:
        name = f"{row.name} ({row.student_id})" if row.name else row.student_id
        return " · ".join([name, *parts])
    return "   ".join([*parts, *(f"{speaker.gettext(word)} {blank}" for word in (NAME, GROUP, DATE))])


# The scheme ---------------------------------------------------------------------------------------


def _scheme(assignment: Assignment, variant: Variant) -> tuple[Flowable, str]:
    """Return the mechanism in a position that is not the student's own, if the assignment has another.

    Drawing the mechanism is part of the task: the scheme shows which joints and links there are and how they
    are assembled, but not their positions. It uses the variant farthest in the list that assembles with the
    same sides.
    """
    every = assignment.variants()
    own = every.index(variant)
    others = [every[(own + len(every) // 2 + shift) % len(every)] for shift in range(len(every))]
    error: MechanismError | None = None
    for other in (*(one for one in others if one != variant), variant):
        if _sides(assignment, other) != _sides(assignment, variant):
            continue
        try:
            return _drawn(_fitted(assignment, other)), OWN_SCHEME if other == variant else SCHEME
        except MechanismError as refused:
            error = refused
    raise error or ValueError("a variant has its own sides")


def _drawn(subject: Subject) -> Drawing:
    """Return the scheme as large as its room allows, but not larger than on paper."""
    shapes, (wide, high) = scheme(subject).shapes, (side * mm for side in SCHEME_MM)
    box = bounds(shapes)
    unit = min(mm, wide / (box[2] - box[0]), high / (box[3] - box[1]))
    return Drawing(shapes, box, unit, room=wide)


def _sides(assignment: Assignment, variant: Variant) -> list[float]:
    groups = assignment.mechanism([variant]).groups
    return [float(np.ravel(getattr(group, "side", 0))[0]) for group in groups]


def _fitted(assignment: Assignment, variant: Variant) -> Subject:
    """Return the mechanism at the scale at which it fills the room for the scheme."""
    plan = exact_plan(assignment, [variant], accelerations=False)
    at = np.array([np.ravel(place)[0] for place in plan.nodes_mm["mechanism"].values()])
    needed = max(
        float(np.ptp(part)) / (room - SYMBOLS_MM)
        for part, room in zip((at.real, at.imag), SCHEME_MM, strict=True)
    )
    scales = assignment.scales([variant], kL=plan.scales.kL * needed)
    return Subject(assignment, exact_plan(assignment, [variant], scales, accelerations=False))


# Data ---------------------------------------------------------------------------------------------


def _length_unit(assignment: Assignment) -> str:
    """Return the unit of the given lengths."""
    return next((one.unit for one in assignment.file.given if one.unit in LENGTH_UNITS_M), "m")


def _fixed(assignment: Assignment, variant: Variant, speaker: Tongue) -> Iterator[Markup]:
    """Yield the positions of the ground's joints and guides, in the unit of the given lengths."""
    mechanism = assignment.mechanism([variant])
    unit = _length_unit(assignment)

    def point(at: ComplexArray) -> str:
        place = complex(np.ravel(at)[0]) / LENGTH_UNITS_M[unit]
        x, y = (number(round(part, 6) + 0.0, speaker.decimal_mark) for part in (place.real, place.imag))
        return f"({x}; {y})\N{NO-BREAK SPACE}{speaker.unit(unit)}"

    def letter(name: str) -> Markup:
        return _letters(pieces_of(assignment.file.names.get(name, name)))

    for joint, at in mechanism.ground_m.items():
        yield Markup("{} {}").format(letter(joint), point(at))
    driver = mechanism.driver
    guides = [
        (group.node, guide.through_m, guide.angle_rad)
        for group in mechanism.groups
        for guide in guides_of(group)
        if isinstance(guide, FixedGuide)
    ]
    if isinstance(driver, DrivingSlider):
        guides.insert(0, (driver.pin, driver.guide_m, driver.guide_rad))
    for joint, through, angle in guides:
        degrees = number(float(np.degrees(np.ravel(angle)[0])), speaker.decimal_mark)
        known = {"joint": letter(joint), "point": point(through), "angle": f"{degrees}°"}
        yield Markup(speaker.gettext(GUIDE)) % known  # noqa: S704 - our own sentence


# Masses and loads ---------------------------------------------------------------------------------


def _masses(
    assignment: Assignment, rubric: RubricFile, variant: Variant, speaker: Tongue
) -> Iterator[Flowable]:
    """Yield tables of the masses, with accelerations if they are given, and of the loads: no other forces."""
    _, mark, unit = speaker.gettext, speaker.decimal_mark, speaker.unit
    plan, are_given = exact_plan(assignment, [variant]), accelerations_of(assignment, rubric) == "given"
    mechanism, short = plan.mechanism, short_names(plan.mechanism)
    acts = {one.name: one for one in plan.forces.given} if plan.forces else {}

    def told(value: FloatArray | None, digits: int = 6) -> str:
        return "–" if value is None else number(float(f"{float(value[0]):.{digits}g}"), mark)

    def direction(vector: ComplexArray) -> str:
        return number(round(float(np.degrees(np.angle(vector[0]))) % 360.0, 1) % 360.0, mark)

    bodies = []
    for body in mechanism.bodies:
        name, moving = short[body.link], plan.motion.acceleration[body.centre]
        row = [name, told(body.mass), told(body.inertia), _centre(assignment, plan, body, speaker)]
        if are_given:
            is_moved = body.mass is not None and bool(np.any(moving))
            row += [told(np.abs(moving), 4), direction(moving)] if is_moved else ["–", "–"]
            row.append("–" if body.inertia is None else told(-acts[f"F_i{name}"].couple / body.inertia, 4))
        bodies.append(row)
    head = [_(LINK), f"m, {unit('kg')}", f"I, {unit('kg m²')}", _(CENTRE)]
    head += [f"a, {unit('m/s²')}", _(DIRECTION), f"ε, {unit('rad/s²')}"] if are_given else []
    loads = []
    for load in mechanism.loads:
        act, names = acts[f"F_{load.name}"], [short[load.link], _letters(pieces_of(load.point))]
        if load.force is None:
            couple = f"{told(act.couple)} {unit('N m')}"
            loads.append([_letters(pieces_of(f"M_{load.name}")), names[0], "–", couple, "–"])
            continue
        along = _(MOTIONS[bool(load.force.real[0] > 0.0)]) if load.slider else ""
        where = direction(act.force) if are_given or not along else along
        value = f"{told(np.abs(act.force))} {unit('N')}"
        loads.append([_letters(pieces_of(act.name)), *names, value, where])
    shares = [0.09, 0.1, 0.13, 0.32, 0.12, 0.12, 0.12] if are_given else [0.12, 0.14, 0.16, 0.58]
    for title, heads, rows, widths in (
        (BODIES[are_given], head, bodies, shares),
        (LOADS, [*map(_, LOAD)], loads, [0.12, 0.12, 0.12, 0.2, 0.44]),
    ):
        if rows:
            yield from (paragraph(_(title), 10, BOLD), Spacer(1, mm))
            yield _empty(heads, rows, WIDE_MM, shares=widths)
            yield Spacer(1, 2 * mm)
    if not are_given:
        yield paragraph(_(OWN), 9)
    hinges = plan.forces.hinges.values() if plan.forces else ()
    for one in hinges:
        by, on = short[one.by], short[one.on]
        if reaction(short, one.by, one.on) in rubric.vectors and GROUND not in (by, on):
            vector = _letters(pieces_of(reaction(short, one.by, one.on)))
            yield paragraph(Markup(_(REACTION)) % {"vector": vector, "by": by, "on": on}, 9)  # noqa: S704
            break
    yield Spacer(1, 2 * mm)


def _centre(assignment: Assignment, plan: Plan, body: Body, speaker: Tongue) -> Markup:
    """Return where a link's centre of mass is."""
    tables = {one.link: one.centre for one in assignment.file.body}
    point, centre = _letters(pieces_of(body.centre)), tables[body.link]
    if centre is None or centre.base is None:
        return point
    at, unit = plan.motion.position, _length_unit(assignment)
    start, end = (at[joint][0] for joint in centre.base)
    place = (at[body.centre][0] - start) * abs(end - start) / (end - start) / LENGTH_UNITS_M[unit]

    def length(value: float) -> str:
        told = number(float(f"{round(value, 9) + 0.0:.5g}"), speaker.decimal_mark)
        return f"{told}\N{NO-BREAK SPACE}{speaker.unit(unit)}"

    line = Markup("").join(_letters(pieces_of(joint)) for joint in centre.base)
    least = 1e-6 * abs(end - start) / LENGTH_UNITS_M[unit]
    is_on_it = abs(place.imag) < least
    known: dict[str, str] = {"along": length(abs(place.real) if is_on_it else place.real)}
    known |= {"point": point, "link": line, "tail": _letters(pieces_of(centre.base[0]))}
    known["across"] = length(abs(place.imag))
    sentence = ON_THE_LINE[place.real < -least] if is_on_it else BESIDE[place.imag > 0.0]
    return Markup(speaker.gettext(sentence)) % known  # noqa: S704 - our own sentence


# Tables to fill in --------------------------------------------------------------------------------


def _tables(assignment: Assignment, rubric: RubricFile, speaker: Tongue) -> Iterator[Flowable]:
    """Yield an empty table for each kind of quantity that the rubric asks for."""
    names = assignment.file.names
    asked: dict[str, list[str]] = {title: [] for title in TABLES}
    for criterion in rubric.criterion:
        name = criterion.value or criterion.name
        table_of = "moments" if kind_of(name).name == "moment" else criterion.section
        if name not in asked.get(table_of, [name]):
            asked[table_of].append(name)
    asked["scales"] = [*scales_asked(assignment, rubric)]

    def table(kind: str, wide_mm: float) -> list[Flowable]:
        if not asked[kind]:
            return []
        _ = speaker.gettext
        shown = [(name, names.get(name, name)) for name in asked[kind]]
        if kind in {"scales", "angular", "moments"}:
            word, pieces = (SCALE, scale_pieces) if kind == "scales" else (QUANTITY, pieces_of)
            head = [_(word), _(VALUE)]
            rows = [[_cell(pieces(one), unit_of(name), speaker), ""] for name, one in shown]
        else:
            unit = speaker.unit(unit_of(asked[kind][0]))
            head = [_(VECTOR), _(LENGTH), _(DIRECTION), f"{_(VALUE)}, {unit}"]
            values = [name for name in asked[kind] if name in rubric.values] or asked[kind]
            rows = [[_letters(pieces_of(one)), "", "", "" if name in values else "–"] for name, one in shown]
        return [
            paragraph(_(TABLES[kind]), 10, BOLD),
            Spacer(1, mm),
            _empty(head, rows, wide_mm),
            Spacer(1, 3 * mm),
        ]

    half = (WIDE_MM - GAP_MM) / 2.0
    first = ("velocity_plan", "scales", "angular", *(["moments"] if asked["moments"] else []))
    second = ("acceleration_plan", *(["force_plans"] if asked["force_plans"] else []))
    if max(sum(len(asked[kind]) + 2 for kind in kinds) for kinds in (first, second)) > MOST_ROWS:
        for kind in (*first, *second):
            yield from table(kind, WIDE_MM)
        return
    left, right = ([part for kind in kinds for part in table(kind, half)] for kinds in (first, second))
    yield _side_by_side(left, right, half)


def _every_position(
    assignment: Assignment, rubric: RubricFile, row: RosterRow, positions: Sequence[str], speaker: Tongue
) -> Iterator[Flowable]:
    """Yield one page's tables of results, a row for each position: drawn lengths, then computed values.

    What the driving link has is the same in all positions, and left out.
    """
    names, pin, _ = assignment.file.names, assignment.mechanism_file.driver.pin, speaker.gettext
    yield paragraph(assignment.file.title.in_language(speaker.lang), 14, BOLD)
    yield paragraph(_whose(row, Variant(row.n), speaker), 10, BOLD)
    yield paragraph(_(EVERY_POSITION), 12, BOLD)
    for kind in DRAWN.values():
        drawn = [name for name in rubric.vectors if kind_of(name) is kind and name != f"{kind.letter}_{pin}"]
        values = [name for name in rubric.values if kind_of(name) is kind]
        units = [(name, "mm") for name in drawn] + [(name, unit_of(name)) for name in values]
        if not units:
            continue
        heads = [_cell(pieces_of(names.get(name, name)), unit, speaker) for name, unit in units]
        rows = [[one, *[""] * len(heads)] for one in positions]
        yield from (Spacer(1, 4 * mm), paragraph(_(TABLES[SECTIONS[kind.name]]), 10, BOLD), Spacer(1, mm))
        yield _empty([_(NUMBER["position"]), *heads], rows, WIDE_MM, WRITING_MM)
    yield PageBreak()


def _cell(pieces: Iterable[Piece], unit: str, speaker: Tongue) -> Markup:
    """Return a quantity, as students see it, with its unit."""
    return Markup("{}, {}").format(_letters(pieces), speaker.unit(unit))


def _empty(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    wide_mm: float,
    high_mm: float = ROW_MM,
    shares: Sequence[float] = (),
) -> Table:
    first = {2: 0.4, 4: 0.16}.get(len(head), 1.0 / len(head))
    rest = (1.0 - first) / (len(head) - 1)
    widths = [share * wide_mm * mm for share in shares or (first, *[rest] * (len(head) - 1))]
    cells = [
        [paragraph(word, 6.5) for word in head],
        *([paragraph(cell, 10) for cell in row] for row in rows),
    ]
    style = [
        ("GRID", (0, 0), (-1, -1), 0.4, grey), ("BACKGROUND", (0, 0), (-1, 0), whitesmoke),
        ("VALIGN", (0, 0), (-1, -1), "MIDDLE"), ("TOPPADDING", (0, 0), (-1, -1), 0),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 0), ("LEFTPADDING", (0, 0), (-1, -1), 3),
        ("RIGHTPADDING", (0, 0), (-1, -1), 1),
    ]  # fmt: skip
    # Cells that are printed, not to be filled in, may have several lines.
    heights = [None if shares else high_mm * mm] * len(cells)
    return Table(cells, colWidths=widths, rowHeights=heights, style=style, repeatRows=1)


def _side_by_side(left: list[Flowable], right: list[Flowable], left_mm: float) -> Table:
    widths = ((left_mm + GAP_MM) * mm, (WIDE_MM - left_mm - GAP_MM) * mm)
    style = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0),
        ("RIGHTPADDING", (0, 0), (0, 0), GAP_MM * mm), ("RIGHTPADDING", (1, 0), (1, 0), 0),
    ]  # fmt: skip
    return Table([[left, right]], colWidths=widths, style=style)


# Texts --------------------------------------------------------------------------------------------


def _letters(pieces: Iterable[Piece]) -> Markup:
    """Return a name with its indices."""
    marks = {0: "{}", -1: "<sub>{}</sub>", 1: "<sup>{}</sup>"}
    return Markup("").join(Markup(marks[piece.height]).format(piece.text) for piece in pieces)  # noqa: S704
