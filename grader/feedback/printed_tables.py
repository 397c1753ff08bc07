"""The tables of printed feedback: criteria, and scales."""

from collections.abc import Sequence
from xml.sax.saxutils import escape

from reportlab.lib.units import mm
from reportlab.platypus import Table

from grader.answer_sheet.words import BOLD, REGULAR
from grader.feedback.leaflet import Leaflet, Row
from grader.feedback.printed_pieces import INK, LINE, PLAIN, SOFT, Badge, printed, text
from grader.i18n import N_
from grader.plan_pdf import ink
from grader.scene import COLOURS

Style = list[tuple[object, ...]]

CRITERIA_MM = (6.0, 72.0, 30.0, 30.0, 29.0, 15.0)
"""Mark, criterion, measured, expected, tolerance, points,"""
WITHOUT_ANSWERS_MM = (6.0, 100.0, 46.0, 30.0)
"""and without expected and tolerance."""
SCALES_MM, DECLARED_MM = (20.0, 102.0, 60.0), (20.0, 162.0)
ASSUMED = N_("assumed")


def criteria_table(leaflet: Leaflet) -> Table:
    """A row for each criterion, and what is to be said below it; its head is repeated on every page."""
    full = leaflet.shows_expected
    widths = CRITERIA_MM if full else WITHOUT_ANSWERS_MM
    rows: list[Sequence[object]] = [_head(leaflet)]
    style: Style = [
        *PLAIN,
        ("BOTTOMPADDING", (0, 0), (-1, -1), 1.6),
        ("TOPPADDING", (0, 0), (-1, -1), 2.2),
        ("RIGHTPADDING", (1, 0), (1, -1), 6),
        ("FONT", (2, 1), (-1, -1), REGULAR, 8.5, 11.2),
        ("TEXTCOLOR", (2, 1), (-1, -1), ink(INK)),
        ("TEXTCOLOR", (-2, 1), (-2, -1), ink(SOFT if full else INK)),
        ("ALIGN", (-1, 0), (-1, -1), "RIGHT"),
    ]
    for row in leaflet.rows:
        here = len(rows)
        style.append(("LINEABOVE", (0, here), (-1, here), 0.4, ink(LINE)))
        rows.append(_cells(row, full=full))
        if row.said:
            style += [("SPAN", (1, here + 1), (-1, here + 1)), ("NOSPLIT", (0, here), (-1, here + 1))]
            rows.append(["", text(printed(row.said), 8, as_markup=True), *[""] * (len(widths) - 2)])
    return Table(rows, colWidths=[one * mm for one in widths], style=style, repeatRows=1)


def _head(leaflet: Leaflet) -> list[object]:
    answers = [N_("Expected"), N_("Tolerance")] if leaflet.shows_expected else []
    titles = [N_("Criterion"), N_("Measured"), *answers, N_("Points")]
    say = leaflet.speaker.gettext
    return ["", *(text(say(one), 7.5, BOLD, colour=SOFT, right=one == titles[-1]) for one in titles)]


def _cells(row: Row, *, full: bool) -> list[object]:
    colour = COLOURS[row.verdict]
    name = f' <font color="{SOFT}">{printed(row.name)}</font>' if row.name else ""
    verdict = f'<font color="{colour}">{escape(row.verdict_told)}</font>'
    title = f'<font name="{BOLD}">{printed(row.title)}</font>{name} {verdict}'
    cells: list[object] = [Badge(row.verdict), text(title, 8.5, as_markup=True)]
    columns = [row.measured, *([row.expected, row.tolerance] if full else [])]
    return [*cells, *("\n".join(column) for column in columns), f"{row.points} / {row.most}"]


def scales_table(leaflet: Leaflet) -> Table:
    """The scales as declared, and where answers may be seen as used."""
    say, full = leaflet.speaker.gettext, leaflet.shows_expected
    titles = [N_("Scale"), N_("Declared"), *([N_("Used for marking")] if full else [])]
    rows = [[text(say(title), 7.5, BOLD, colour=SOFT) for title in titles]]
    for scale in leaflet.scales:
        declared = "  ·  ".join([scale.declared, *scale.remarks])
        used = f"{scale.used}  ({say(ASSUMED)})" if scale.assumed else scale.used
        told = [text(printed(scale.name), 8.5, as_markup=True), text(declared, 8.5)]
        rows.append([*told, text(used, 8.5)] if full else told)
    style: Style = [
        *PLAIN,
        ("LINEABOVE", (0, 1), (-1, -1), 0.4, ink(LINE)),
        ("TOPPADDING", (0, 0), (-1, -1), 2),
    ]
    widths = SCALES_MM if full else DECLARED_MM
    return Table(rows, colWidths=[one * mm for one in widths], style=style)
