"""``planmark plan``: one variant."""

import cmath
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from grader.cli import terminal
from grader.cli.app import new_table, show_table
from grader.cli.terminal import gettext, unit
from grader.files import write_whole
from grader.language import N_, Tongue
from grader.options import PlanOptions
from grader.solution.document import ForceDocument, ForcesDocument, GuideDocument, plan_document
from reference.authored.assignment import Assignment, load_assignment
from reference.errors import CallError
from reference.geometry import degrees
from reference.plan import Plan, exact_plan
from reference.quantities import unit_of

if TYPE_CHECKING:
    from rich.table import Table

STEP_FILES = (".html", ".pdf", ".txt")
TERMINAL = Path("-")


def show_plan(name: str, options: PlanOptions) -> None:
    """Print the exact plan of a variant, and draw it where files are named.

    What cannot be drawn is refused before anything is computed.
    """
    check_crank(options.crank_mm)
    steps = options.steps
    if steps is not None and steps != TERMINAL and steps.suffix.lower() not in STEP_FILES:
        raise _refused("steps_file", "ending", option="--steps", file=steps, names=STEP_FILES)
    if options.altitude and options.svg is None and options.pdf is None:
        raise _refused("altitude")
    assignment = load_assignment(name)
    variants = [assignment.variant(options.n, options.position)]
    plan = exact_plan(assignment, variants, assignment.scales(variants, crank_mm=options.crank_mm))
    _draw(assignment, plan, options)
    if options.as_json:
        document = plan_document(assignment, plan)
        terminal.say(document.model_dump_json(indent=2, exclude=document.unused))
        return
    _print_table(assignment, plan)
    for file in (one for one in options.drawn if one != TERMINAL):
        terminal.say(gettext("drawn in %(file)s", file=file))


def _refused(code: str, cause: str = "", **known: object) -> CallError:
    """Return the error of a call that cannot be drawn; the sentences load only then, since they take time."""
    from grader.texts.spoken import failure

    return failure(CallError, code, cause, **known)


def check_crank(crank_mm: float | None) -> None:
    """Refuse a drawn length that no crank on paper has."""
    if crank_mm is not None and not 0.0 < crank_mm < 1000.0:
        raise _refused("crank_mm", value=crank_mm)


def _draw(assignment: Assignment, plan: Plan, options: PlanOptions) -> None:
    """Draw everything before the first file is written: what fails leaves none behind."""
    if not options.drawn:
        return
    from grader.solution.sentences import wording_of
    from reference.drawing.canvas import svg as as_svg
    from reference.drawing.sheets import reference_drawing
    from reference.drawing.subject import Subject

    speaker = terminal.speaker()
    subject = Subject(assignment, plan, 0, wording_of(speaker))
    written: dict[Path, str | bytes] = {}
    if options.svg is not None or options.pdf is not None:
        drawn = reference_drawing(assignment, plan, wording=subject.wording, altitude=options.altitude)
        sheets = [sheet.shapes for sheet in drawn]
        if options.svg is not None:
            written[options.svg] = as_svg(sheets)
        if options.pdf is not None:
            from grader.solution.pages import pdf as as_pdf

            written[options.pdf] = as_pdf(sheets, subject.title)
    if options.steps is not None:
        from grader.solution.pages import html_page, pdf_pages, text_page

        makers: dict[str, Callable[[Subject, Tongue], str | bytes]] = {".pdf": pdf_pages, ".html": html_page}
        made = makers.get(options.steps.suffix.lower(), text_page)(subject, speaker)
        if options.steps == TERMINAL:
            terminal.say(str(made))
        else:
            written[options.steps] = made
    for file, content in written.items():
        write_whole(file, content)


def _print_table(assignment: Assignment, plan: Plan) -> None:
    from rich.console import Console

    document = plan_document(assignment, plan)
    scales = document.scales
    console = Console()
    title = assignment.file.title.in_language(terminal.speaker().lang)
    console.print(f"[bold]{title}[/bold], {terminal.named(plan.variants[0].numbers)}", highlight=False)
    told = [f"{name} = {scale:.6g} {unit(unit_of(name))}" for name, scale in scales.items()]
    console.print("   ".join(told), highlight=False)
    head = N_("vector, point"), N_("drawn, mm"), N_("value"), N_("unit"), N_("direction, °")
    table = new_table(*head, left=("unit",))
    for vector, row in document.vectors.items():
        direction = "-" if row.direction_deg is None else f"{row.direction_deg:.2f}"
        table.add_row(vector, f"{row.drawn_mm:.2f}", f"{row.value:.4f}", unit(row.unit), direction)
    for rate, value in document.angular.items():
        table.add_row(rate, "", f"{value:z.4f}", unit(unit_of(rate)), "")
    pivot = plan.construction.pivot
    for name in plan.construction.centres:
        if (point := document.centres_m[name]) is not None:
            at = complex(*point) - complex(*document.points_m[pivot])
            real, mm, angle = abs(at), abs(at) / scales["kL"], degrees(cmath.phase(at))
            place = gettext("%(name)s from %(pivot)s", name=name, pivot=pivot)
            table.add_row(place, f"{mm:.2f}", f"{real:.4f}", unit("m"), f"{angle:.2f}")
    show_table(console, table)
    if document.forces is not None:
        show_table(console, _table_of_forces(document.forces))
    worst = min((float(np.min(sine)) for sine in plan.motion.transmission.values()), default=1.0)
    if worst < 0.2:
        near = N_("near a singular position: the sine of a transmission angle is %(sine).3f")
        console.print(gettext(near, sine=worst), style="yellow")


def _table_of_forces(forces: ForcesDocument) -> "Table":
    """Return inertia forces, reactions and the balancing moment or force, a row each."""
    from reference.drawing.tables import four_digits

    def direction(degrees: float | None) -> str:
        return "-" if degrees is None else f"{degrees:.2f}"

    table = new_table(N_("force"), N_("at"), "N", N_("direction, °"), "N m", left=("at",))
    for link, one in forces.inertia.items():
        row = (four_digits(one.force_N), direction(one.direction_deg), four_digits(one.moment_Nm))
        table.add_row(gettext("inertia of %(link)s", link=link), one.at, *row)
    # A further hinge at a joint has the link in its name, too: B_4.
    joints = ((name.partition("_")[0], joint) for name, joint in forces.joints.items())
    for name, joint in (*joints, *forces.guides.items()):
        moment = four_digits(joint.moment_Nm) if isinstance(joint, GuideDocument) else ""
        row = (four_digits(joint.value_N), direction(joint.direction_deg), moment)
        table.add_row(gettext("%(by)s on %(link)s", by=joint.by, link=joint.on), name, *row)
    last = forces.balancing
    if isinstance(last, ForceDocument):
        row = (four_digits(last.value_N), direction(last.direction_deg), "")
    else:
        row = ("", "", four_digits(last.moment_Nm))
    table.add_row(gettext("balancing on %(link)s", link=last.on), "", *row)
    return table
