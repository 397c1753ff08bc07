"""``planmark plan --all``: every variant, for the instructor's own records."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from grader.authoring.variant_checks import broken_findings, broken_variants
from grader.authoring.variant_table import class_csv
from grader.cli.app import check_language
from grader.cli.plans import check_crank
from grader.cli.progress import new_table, progress
from grader.files import write_whole
from grader.i18n import tongue
from grader.plan_document import plan_documents
from reference.assignment import Assignment, Variant, load_assignment
from reference.errors import CallError, MechanismError
from reference.plan import Plan, exact_plan

if TYPE_CHECKING:
    from grader.authoring.variant_table import Tell

LONG = 20
"""So many drawings take seconds: their progress is shown."""


def refuse_single(*, every: bool, options: Mapping[str, object]) -> None:
    """Refuse `--all` with options for one variant, and `--csv` for one."""
    given = [name for name, value in options.items() if value is not None]
    if not every:
        raise CallError("all_or_one", "--csv is a table of all variants: add --all")
    if given:
        told = "--all is every variant, and" if given != ["--svg"] else "drawings of --all go into --pdf:"
        raise CallError("all_or_one", f"{told} {' and '.join(given)} one of them: leave out either")


def show_class(
    name: str,
    crank_mm: float | None,
    *,
    as_json: bool,
    csv: Path | None,
    pdf: Path | None,
    drawings: bool,
    lang: str,
) -> bool:
    """Write the plans of all variants as JSON, as a table, or on pages; without any, a short table.

    Variants that cannot be solved are told and left out; whether there are any.
    """
    check_crank(crank_mm)
    check_language(lang)
    assignment = load_assignment(name)
    variants = _sound(assignment)
    plan = exact_plan(assignment, variants, assignment.scales(variants, crank_mm=crank_mm))
    is_open = len(variants) < len(assignment.variants())
    if csv is not None:
        write_whole(csv, class_csv(plan, decimal_comma=tongue(lang).decimal_mark == ","))
    if pdf is not None:
        _print_pages(assignment, plan, pdf, drawings=drawings, lang=lang)
    if as_json:
        documents = [one.model_dump(mode="json") for one in plan_documents(assignment, plan)]
        typer.echo(json.dumps(documents, indent=2, ensure_ascii=False))
        return is_open
    if csv is None and pdf is None:
        _show_table(assignment, plan)
    for file in (csv, pdf):
        if file is not None:
            typer.echo(f"{len(variants)} variants written to {file}")
    return is_open


def _sound(assignment: Assignment) -> list[Variant]:
    """The variants that can be solved; the others are told."""
    variants = assignment.variants()
    broken = broken_variants(assignment, variants)
    without = {one.variant for one in broken}
    if len(without) == len(variants):
        error = broken[0].error
        told = f"no variant can be solved; {variants[0]}: {error.told}"
        raise MechanismError(error.code, told, group=error.group, gap_m=error.gap_m)
    for finding in broken_findings(assignment, broken):
        typer.secho(f"left out: {finding}", err=True, fg="red")
    return [variant for variant in variants if variant not in without]


def _print_pages(assignment: Assignment, plan: Plan, pdf: Path, *, drawings: bool, lang: str) -> None:
    from grader.authoring.variant_table import class_pages, numbered, table_pages
    from grader.plan_pdf import pdf as as_pdf
    from grader.plan_steps.words import wording_of

    words = tongue(lang)
    pages = table_pages(assignment, plan, words)
    if drawings:
        with _told(len(plan.variants) >= LONG) as tell:
            pages = class_pages(pages, assignment, plan, wording_of(words), tell)
    write_whole(pdf, as_pdf(numbered(pages), f"{assignment.file.title.in_language(lang)} ({assignment.id})"))


@contextmanager
def _told(is_long: bool) -> "Iterator[Tell | None]":
    if not is_long:
        yield None
        return
    with progress() as tell:
        yield lambda done, total: tell("drawings", done, total)


def _show_table(assignment: Assignment, plan: Plan) -> None:
    """Scales, and the drawn lengths of absolute vectors: what is asked for most while correcting."""
    from rich.console import Console

    console = Console()
    console.print(f"[bold]{assignment.file.title.en}[/bold], drawn lengths in mm", highlight=False)
    joints = {joint for joint in plan.motion.position if not plan.mechanism.is_ground(joint)}
    names = [name for name in plan.vectors_si if name.removeprefix(name[:2]) in joints]
    table = new_table("variant", "kL\nm/mm", "kv\n(m/s)/mm", "ka\n(m/s^2)/mm", *names)
    lengths = {name: abs(plan.drawn_mm(name)) for name in names}
    for index, variant in enumerate(plan.variants):
        scales = [f"{getattr(plan.scales, name)[index]:.4g}" for name in ("kL", "kv", "ka")]
        table.add_row(str(variant), *scales, *(f"{lengths[name][index]:.2f}" for name in names))
    console.print(table)
    console.print("all vectors, values and directions: --csv FILE, --pdf FILE or --json", style="dim")
