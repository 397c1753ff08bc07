"""``planmark lint``."""

from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

import typer
from rich.console import Console
from rich.table import Table

from grader.authoring.findings import named
from grader.authoring.lint import Lint, faults_document, lint, lint_document
from grader.authoring.round_scales import ratio_text
from grader.cli import terminal
from grader.cli.app import new_table
from grader.documents import LintLeast, LintScales, LintVariant
from grader.files import write_whole
from grader.language import N_, Tongue
from grader.records import Reason
from grader.rubric import load_both
from grader.texts.spoken import clause
from reference.authored.assignment import Variant
from reference.drawing.canvas import Label
from reference.drawing.canvas import svg as as_svg
from reference.drawing.sheets import FRAME, reference_drawing
from reference.errors import AuthoredFileError

SHOWN_ROWS = 40
"""More variants than that stand in ranges."""
REASON_MM, REASON_COLOUR = 4.0, "#a03014"
"""Height and colour of the line under the drawing's frame that says why this variant is drawn."""
SEVERITIES = {"fault": N_("fault"), "warning": N_("warning"), "hint": N_("hint")}
COLOURS = {"fault": "bold red", "warning": "yellow", "hint": "cyan"}


def lint_assignment(name: str, *, as_json: bool, svg: Path | None) -> bool:
    """Print every finding on an assignment and its rubric; whether any needs a person."""
    speaker = terminal.speaker()
    try:
        assignment, rubric = load_both(name)
    except AuthoredFileError as error:
        if not as_json:
            raise
        terminal.say(faults_document(error, name, speaker).model_dump_json(indent=2))
        raise typer.Exit(error.exit_status) from error
    result = lint(assignment, rubric, speaker)
    if svg is not None and result.plan is not None and result.worst is not None:
        worst = result.worst[0]
        why = _hardest(result.worst, speaker)
        reason = Label((FRAME[0], FRAME[3] + 1.5 * REASON_MM), why, REASON_MM, colour=REASON_COLOUR)
        drawing = reference_drawing(assignment, result.plan, result.plan.variants.index(worst))
        sheets = [(*sheet.shapes, reason) for sheet in drawing]
        write_whole(svg, as_svg(sheets))
    if as_json:
        terminal.say(lint_document(result, speaker).model_dump_json(indent=2))
        return result.needs_a_person
    console = Console()
    console.print(f"[bold]{assignment.file.title.in_language(speaker.lang)}[/bold]", highlight=False)
    console.print(_variants_table(result.rows, speaker))
    if result.scales and result.plan is not None:
        console.print()
        console.print(_scales_table([proposal.over_all for proposal in result.scales], speaker))
    console.print()
    # A line each, which terminals break and programs can search.
    wide = max(len(speaker.gettext(word)) for word in SEVERITIES.values())
    for finding in result.findings:
        severity = speaker.gettext(SEVERITIES[finding.severity])
        console.print(f"[{COLOURS[finding.severity]}]{severity:<{wide}}[/] ", end="")
        console.print(finding.told(speaker), markup=False, highlight=False, soft_wrap=True)
    _tell_end(result, svg, speaker)
    return result.needs_a_person


def _variants_table(rows: Sequence[LintVariant], speaker: Tongue) -> Table:
    _ = speaker.gettext
    table = new_table(
        _("variant"), _("assembles"), _("transmis-\nsion sine"), _("crossing\ndegrees"),
        _("shortest\nasked mm"), _("under\n8 mm"), _("fits\ntimes"), left=(_("assembles"),),
    )  # fmt: skip
    table.columns[0].no_wrap = True
    for group in _ranges(rows):
        broken = [row for row in group if row.problem]
        some = _("%(count)s do not") % {"count": len(broken)}
        assembles = _("yes") if not broken else _("no") if len(broken) == len(group) else some
        table.add_row(
            terminal.named(_variant_of(group[0]).numbers)
            if len(group) == 1
            else named(map(_variant_of, group)),
            f"[red]{assembles}[/red]" if broken else assembles,
            _worst_of([row.transmission for row in group], "{:.2f}"),
            _worst_of([row.crossing_deg for row in group], "{:.1f}"),
            _worst_of([row.shortest_mm for row in group], "{:.2f}"),
            str(sum(row.under_8_mm for row in group)),
            _room_of([row.room for row in group], speaker),
        )
    return table


def _ranges(rows: Sequence[LintVariant]) -> list[list[LintVariant]]:
    """A row each; of many variants about thirty stretches, all positions of a number in one."""
    if len(rows) <= SHOWN_ROWS:
        return [[row] for row in rows]
    has_both = rows[0].n is not None and rows[0].position is not None
    units = [list(unit) for _, unit in groupby(rows, key=lambda row: row.n if has_both else id(row))]
    long = -(-len(units) // 30)
    return [
        [row for unit in units[start : start + long] for row in unit] for start in range(0, len(units), long)
    ]


def _variant_of(row: LintVariant) -> Variant:
    return Variant(row.n, row.position)


def _worst_of(figures: Sequence[LintLeast | None], form: str) -> str:
    least = _least(figures)
    return "-" if least is None else f"{form.format(least.value)} {least.at}"


def _room_of(figures: Sequence[LintLeast | None], speaker: Tongue) -> str:
    """Return how the tightest figure fits, and its page if it does not."""
    least = _least(figures)
    page = f" {speaker.gettext('page')} {least.page}" if least is not None and least.value < 1.0 else ""
    return "-" if least is None else f"{least.value:.2f}{page}"


def _least(figures: Sequence[LintLeast | None]) -> LintLeast | None:
    known = [figure for figure in figures if figure is not None]
    return min(known, key=lambda figure: figure.value, default=None)


def _scales_table(scales: Sequence[LintScales], speaker: Tongue) -> Table:
    """Quantities in rows: three columns stay readable in a narrow terminal."""
    _ = speaker.gettext
    titles = {"proposed": _("as proposed"), "round": _("round"), "round_each": _("round, each its own")}
    table = Table(_("scales"), box=None, header_style="bold")
    for proposal in scales:
        table.add_column(titles[proposal.name], justify="right", no_wrap=True)
    rows: dict[str, list[str]] = {
        "kL": ["..".join(dict.fromkeys(map(ratio_text, proposal.kL))) for proposal in scales],
        f"kv, {speaker.unit('(m/s)/mm')}": [_span(proposal.kv) for proposal in scales],
        f"ka, {speaker.unit('(m/s^2)/mm')}": [_span(proposal.ka) for proposal in scales],
        f"kF, {speaker.unit('N/mm')}": [_span(one.kF) for one in scales if one.kF],
        _("fits, times"): [f"{proposal.room:.2f}" for proposal in scales],
        _("shortest asked, mm"): [_worst_of([proposal.shortest_mm], "{:.2f}") for proposal in scales],
        _("asked under 8 mm"): [f"{proposal.under_8_mm} / {proposal.asked}" for proposal in scales],
        _("shortest link, mm"): [f"{proposal.shortest_link_mm:.1f}" for proposal in scales],
    }
    for name, cells in rows.items():
        if cells:
            table.add_row(name, *cells)
    return table


def _span(ends: tuple[float, float]) -> str:
    low, high = (f"{end:.0f}" if end >= 1e4 else f"{end:.4g}" for end in ends)
    return low if low == high else f"{low}..{high}"


def _hardest(worst: tuple[Variant, Reason], speaker: Tongue) -> str:
    """Return the variant that is hardest to draw, and why."""
    return f"{terminal.named(worst[0].numbers)}: {clause(worst[1], speaker)}"


def _tell_end(result: Lint, svg: Path | None, speaker: Tongue) -> None:
    _ = speaker.gettext
    if result.worst is not None and result.plan is not None:
        terminal.say(_("hardest to draw: %(text)s") % {"text": _hardest(result.worst, speaker)})
        if svg is not None:
            terminal.say(_("drawn in %(file)s") % {"file": svg})
    elif svg is not None:
        terminal.say(_("nothing drawn: no variant can be solved"))
    counts = Counter[str](finding.severity for finding in result.findings)
    faults, warnings, hints = (counts[severity] for severity in COLOURS)
    told = {
        speaker.ngettext("%d fault", "%d faults", faults) % faults: faults,
        speaker.ngettext("%d warning", "%d warnings", warnings) % warnings: warnings,
        speaker.ngettext("%d hint", "%d hints", hints) % hints: hints,
    }
    many = speaker.ngettext("%d variant", "%d variants", len(result.rows)) % len(result.rows)
    found = ", ".join(text for text, count in told.items() if count) or _("no findings")
    terminal.say(f"{result.assignment.id}: {many}, {found}")
