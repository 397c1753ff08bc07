"""``planmark plan --all`` and ``planmark cycle``: every variant, every position."""

import json
import math
from collections.abc import Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import typer

from grader.authoring.variant_checks import broken_findings, broken_variants
from grader.authoring.variant_table import class_csv
from grader.cli import terminal
from grader.cli.app import new_table, progress, show_table
from grader.cli.plans import check_crank
from grader.cli.terminal import gettext, named, unit
from grader.cycle.quantities import CycleSubject, Extreme, Selection, cycle_csv, extremes, strokes_of
from grader.files import write_whole
from grader.language import N_, Tongue, tongue
from grader.options import CycleOptions, PlanOptions
from grader.solution.document import plan_documents
from grader.texts.spoken import failure
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.errors import CallError
from reference.kinematics.cycle import cycle
from reference.plan import Plan, exact_plan
from reference.quantities import unit_of

if TYPE_CHECKING:
    from rich.table import Table


# All variants -------------------------------------------------------------------------------------

LONG = 20
"""So many drawings take seconds: their progress is shown."""


def _refuse_single(options: PlanOptions) -> None:
    """Refuse `--all` with options for one variant, and `--csv` for one."""
    if not options.every:
        raise failure(CallError, "all_or_one")
    single = ("n", "position", "svg", "steps", "altitude")
    given = [f"--{name}" for name in single if getattr(options, name) not in (None, False)]
    if given:
        cause = "all_on_pages" if given == ["--svg"] else "unused_beside"
        raise failure(CallError, "all_or_one", cause, option=tuple(given), other="--all")


def show_class(name: str, options: PlanOptions) -> bool:
    """Write the plans of all variants as JSON, as a table, or on pages; without any, a short table.

    Variants that cannot be solved are listed and left out; returns whether there are any.
    """
    _refuse_single(options)
    crank_mm, csv, pdf, lang = options.crank_mm, options.csv, options.pdf, options.lang
    check_crank(crank_mm)
    assignment = load_assignment(name)
    variants = _sound(assignment)
    plan = exact_plan(assignment, variants, assignment.scales(variants, crank_mm=crank_mm))
    is_open = len(variants) < len(assignment.variants())
    if csv is not None:
        write_whole(csv, class_csv(plan, decimal_comma=tongue(lang).decimal_mark == ","))
    if pdf is not None:
        _print_pages(assignment, plan, pdf, drawings=options.drawings, lang=lang)
    if options.as_json:
        plans = plan_documents(assignment, plan)
        documents = [one.model_dump(mode="json", exclude=one.unused) for one in plans]
        terminal.say(json.dumps(documents, indent=2, ensure_ascii=False))
        return is_open
    if csv is None and pdf is None:
        _show_table(assignment, plan)
    for file in (csv, pdf):
        if file is not None:
            terminal.say(gettext("variants written to %(file)s: %(count)s", file=file, count=len(variants)))
    return is_open


def _sound(assignment: Assignment) -> list[Variant]:
    """The variants that can be solved; the others are printed as left out."""
    variants = assignment.variants()
    broken = broken_variants(assignment, variants)
    if len(broken) == len(variants):
        first = broken[variants[0]]
        error = first.after(f"no variant can be solved; {variants[0]}: ")
        error.parameters |= {"variant": named(variants[0].numbers), "more": len(variants) - 1}
        raise error
    for finding in broken_findings(assignment, broken):
        text = finding.told(terminal.speaker())
        typer.secho(gettext("left out: %(text)s", text=text), err=True, fg="red")
    return [variant for variant in variants if variant not in broken]


def _print_pages(assignment: Assignment, plan: Plan, pdf: Path, *, drawings: bool, lang: str) -> None:
    from grader.authoring.variant_table import class_pages, numbered, table_pages
    from grader.solution.pages import pdf as as_pdf
    from grader.solution.sentences import wording_of

    words = tongue(lang)
    pages = table_pages(assignment, plan, words)
    if drawings:
        with progress() if len(plan.variants) >= LONG else nullcontext() as bar:
            tell = None if bar is None else partial(bar, "drawings")
            pages = class_pages(pages, assignment, plan, wording_of(words), tell)
    write_whole(pdf, as_pdf(numbered(pages), f"{assignment.file.title.in_language(lang)} ({assignment.id})"))


def _show_table(assignment: Assignment, plan: Plan) -> None:
    """Scales, and the drawn lengths of absolute vectors and reactions: what is asked for most."""
    from rich.console import Console

    console = Console()
    title = f"[bold]{assignment.file.title.in_language(terminal.speaker().lang)}[/bold]"
    console.print(gettext("%(title)s, drawn lengths in mm", title=title), highlight=False)
    joints = {joint for joint in plan.motion.position if not plan.mechanism.is_ground(joint)}
    wholes = (name for name in plan.vectors_si if name.count("_") == 1)
    names = [name for name in wholes if name.startswith("R_") or name.removeprefix(name[:2]) in joints]
    scale_names = assignment.scale_names
    table = new_table(N_("variant"), *(f"{name}\n{unit(unit_of(name))}" for name in scale_names), *names)
    lengths = {name: abs(plan.drawn_mm(name)) for name in names}
    for index, variant in enumerate(plan.variants):
        scales = [f"{getattr(plan.scales, name)[index]:.4g}" for name in scale_names]
        table.add_row(named(variant.numbers), *scales, *(f"{lengths[name][index]:.2f}" for name in names))
    show_table(console, table)
    told = gettext("all vectors, values and directions: --csv FILE, --pdf FILE or --json")
    console.print(told, style="dim")


# A cycle ------------------------------------------------------------------------------------------

CONSTANT = 1e-9
"""A quantity that changes by less over a cycle, against the largest of its kind, is constant."""
ZERO = 1e-8
"""Against the largest of its kind: a least value below it is zero but for rounding."""


def show_cycle(name: str, options: CycleOptions) -> None:
    """Write a variant's cycle as a table or a diagram; without files, print its extremes and strokes."""
    words, csv = tongue(options.lang), options.csv
    assignment = load_assignment(name)
    variant = assignment.variant(options.n, options.position)
    if (crank := assignment.mechanism_file.crank) is not None and crank.cylinder is not None:
        raise failure(CallError, "cycle_of_cylinder", name=name)
    subject = CycleSubject(cycle(assignment.mechanism([variant]), options.samples))
    names = [part.strip() for text in options.of or () for part in text.split(",")]
    selection = subject.select([name for name in names if name])
    drawn_in = {kind: file for kind, file in (("svg", options.svg), ("pdf", options.pdf)) if file is not None}
    diagrams = _diagrams(assignment, variant, subject, selection, words, list(drawn_in))
    if csv is not None:
        write_whole(csv, cycle_csv(subject, selection, decimal_comma=words.decimal_mark == ","))
        terminal.say(gettext("written to %(file)s", file=csv))
    for file, diagram in zip(drawn_in.values(), diagrams, strict=True):
        write_whole(file, diagram)
        terminal.say(gettext("drawn in %(file)s", file=file))
    if csv is None and not drawn_in:
        _print(assignment, variant, subject, selection)


def _diagrams(
    assignment: Assignment,
    variant: Variant,
    subject: CycleSubject,
    selection: Selection,
    words: Tongue,
    formats: list[str],
) -> list[bytes]:
    """The diagram as files of some formats; raises CallError where matplotlib is not installed."""
    if not formats:
        return []
    try:
        from grader.cycle.diagram import Setting, cycle_diagram
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        raise failure(CallError, "matplotlib_needed", "extra_missing", extra="plots", error=error) from error
    return cycle_diagram(subject, selection, Setting(assignment, variant, words), formats)


def _print(assignment: Assignment, variant: Variant, subject: CycleSubject, selection: Selection) -> None:
    """The range, strokes, and the extremes of the selected quantities."""
    from rich.console import Console

    console = Console()
    title = assignment.file.title.in_language(terminal.speaker().lang)
    console.print(f"[bold]{title}[/bold], {named(variant.numbers)}", highlight=False)
    for line in (*_range(subject), *_strokes(subject)):
        console.print(line, highlight=False, soft_wrap=True)
    where = N_("at °") if subject.cycle.is_turned else N_("at mm")
    head = "", N_("unit"), N_("least"), where, N_("largest"), where, N_("here")
    table = new_table(*head, left=("unit",))
    for quantity in selection.quantities:
        least, largest = extremes(subject, quantity)
        here = float(subject.values_at(quantity, np.array([subject.cycle.start]))[0])
        in_unit, size = unit(quantity.unit), subject.size(quantity)
        if largest.value - least.value <= CONSTANT * size:
            told = here if abs(here) > ZERO * size else 0.0
            table.add_row(quantity.name, in_unit, gettext("constant"), "", "", "", f"{told:.6g}")
            continue
        ends = [cell for end in (least, largest) for cell in _extreme_cells(subject, end, size)]
        table.add_row(quantity.name, in_unit, *ends, f"{here + 0.0:.6g}")
    for point in selection.points:
        _path_rows(subject, point, table)
    show_table(console, table)
    files = gettext("every position: --csv FILE; as a diagram: --svg FILE, --pdf FILE")
    console.print(files, style="dim")


def _path_rows(subject: CycleSubject, point: str, table: "Table") -> None:
    """Add rows on the extent of a point's path, by its samples."""
    place = np.broadcast_to(subject.cycle.motion.position[point], subject.cycle.driving.shape)
    here = complex(subject.motion_at(np.array([subject.cycle.start])).position[point][0])
    for axis, values, own in (("x", place.real, here.real), ("y", place.imag, here.imag)):
        ends = [int(np.nanargmin(values)), int(np.nanargmax(values))]
        cells = [
            cell
            for end in ends
            for cell in (f"{values[end] + 0.0:.6g}", _number(subject, float(subject.cycle.driving[end])))
        ]
        table.add_row(f"{axis}_{point}", unit("m"), *cells, f"{own + 0.0:.6g}")


def _extreme_cells(subject: CycleSubject, extreme: Extreme, size: float) -> tuple[str, str]:
    value = extreme.value if abs(extreme.value) > ZERO * size else 0.0
    if math.isinf(value):
        text = "∞" if value > 0.0 else "-∞"
    else:
        text = "-" if math.isnan(value) else f"{value + 0.0:.6g}"
    return text, ", ".join(_number(subject, at) for at in extreme.at)


def _at(subject: CycleSubject, driving: float) -> str:
    """A driving coordinate with its unit."""
    return _number(subject, driving) + ("°" if subject.cycle.is_turned else f" {unit('mm')}")


def _number(subject: CycleSubject, driving: float) -> str:
    """A driving coordinate in degrees or millimetres, without a minus zero."""
    if subject.cycle.is_turned:
        return f"{round(math.degrees(driving), 2) + 0.0:.2f}"
    return f"{round(1e3 * driving, 3) + 0.0:.3f}"


IN_LINE = (
    N_("its links are in line"), N_("its rod is perpendicular to the guide"), N_("its guides are parallel"),
    N_("the pin is at the link's pivot, or as near to it as the offset lets it"),
    N_("slot and guide are parallel"), N_("its base has no length"),
    N_("the lines of its three legs meet in one point, or those of the first two are parallel"),
)  # fmt: skip
"""Texts of `reference.kinematics` on a flat position, for the catalogues."""


def _range(subject: CycleSubject) -> Iterator[str]:
    """Yield lines on the range of the driving link, what stops it, and what it passes."""
    cycle = subject.cycle
    here = _at(subject, cycle.start)
    if cycle.turns:
        yield gettext("the crank turns fully; this variant: %(here)s", here=here)
    else:
        first, last = (_at(subject, float(cycle.driving[end])) for end in (0, -1))
        told = N_("the driving link moves from %(first)s to %(last)s; this variant: %(here)s")
        yield gettext(told, first=first, last=last, here=here)
        for stop in cycle.following.stops:
            where = "" if stop is None else f"{_at(subject, stop.at)}: {stop.node}, {gettext(stop.why)}"
            yield "  " + (where or gettext("nothing stops it on one side"))
    if cycle.turns > 1:
        yield gettext("after a turn it is in its other assembly: the cycle is two turns")
    for low, high in cycle.elsewhere:
        told = N_("it also assembles from %(first)s to %(last)s, out of reach from here")
        yield gettext(told, first=_at(subject, low), last=_at(subject, high))
    flat: dict[str, list[str]] = {}
    for event in cycle.passed:
        flat.setdefault(event.node, []).append(_at(subject, event.at))
    for node, places in flat.items():
        told = N_("flat position of %(node)s at %(places)s: passed smoothly, no values there")
        yield gettext(told, node=node, places=", ".join(places))


def _strokes(subject: CycleSubject) -> Iterator[str]:
    """Yield a line on each point or link that goes to and fro."""
    for stroke in strokes_of(subject):
        name = gettext("link %(name)s", name=stroke.name) if stroke.is_angle else stroke.name
        places = ", ".join(_at(subject, at) for at in stroke.dead_points)
        text = gettext("%(name)s: dead points at %(places)s", name=name, places=places)
        if stroke.travel is not None and stroke.time_ratio is not None:
            factor, sign = (math.degrees(1.0), "°") if stroke.is_angle else (1e3, f" {unit('mm')}")
            travel, told = (
                factor * stroke.travel,
                N_(", travel %(travel).3f%(unit)s, time ratio of the strokes %(ratio).4f"),
            )
            text += gettext(told, travel=travel, unit=sign, ratio=stroke.time_ratio)
        yield text
