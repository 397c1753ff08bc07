"""``planmark plan``: one variant."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from grader.cli import terminal
from grader.cli.app import new_table
from grader.files import write_whole
from grader.language import tongue
from grader.solution.document import plan_document
from reference.authored.assignment import Assignment, load_assignment
from reference.errors import CallError
from reference.plan import Plan, exact_plan

STEP_FILES = (".html", ".pdf")


@dataclass(frozen=True, slots=True)
class Drawings:
    """The files that a plan is drawn into, and how."""

    svg: Path | None = None
    pdf: Path | None = None
    steps: Path | None = None
    lang: str = "en"
    altitude: bool = False

    @property
    def files(self) -> tuple[Path, ...]:
        """Those that are asked for."""
        return tuple(file for file in (self.svg, self.pdf, self.steps) if file is not None)

    def check(self) -> None:
        """Refuse what cannot be drawn before anything is computed."""
        tongue(self.lang)
        if self.steps is not None and self.steps.suffix.lower() not in STEP_FILES:
            raise CallError(
                "steps_file", f"--steps {self.steps}: the name must end in {' or '.join(STEP_FILES)}"
            )
        if self.altitude and self.svg is None and self.pdf is None:
            raise CallError("altitude", "--altitude is drawn on the sketch: name a file by --svg or --pdf")


def show_plan(
    name: str,
    n: int | None,
    position: int | None,
    crank_mm: float | None,
    *,
    as_json: bool,
    drawings: Drawings,
) -> None:
    """Print the exact plan of a variant, and draw it where files are named."""
    check_crank(crank_mm)
    drawings.check()
    assignment = load_assignment(name)
    variants = [assignment.variant(n, position)]
    plan = exact_plan(assignment, variants, assignment.scales(variants, crank_mm=crank_mm))
    _draw(assignment, plan, drawings)
    if as_json:
        terminal.say(plan_document(assignment, plan).model_dump_json(indent=2))
        return
    _print_table(assignment, plan)
    for file in drawings.files:
        terminal.say(f"Drawn in {file}")


def check_crank(crank_mm: float | None) -> None:
    """Refuse a drawn length that no crank on paper has."""
    if crank_mm is not None and not 0.0 < crank_mm < 1000.0:
        raise CallError(
            "crank_mm", f"--crank-mm {crank_mm:g}: a length in mm above 0 and below 1000 is needed"
        )


def _draw(assignment: Assignment, plan: Plan, drawings: Drawings) -> None:
    """Draw everything before the first file is written: what fails leaves none behind."""
    if not drawings.files:
        return
    from grader.solution.sentences import wording_of
    from reference.drawing.canvas import svg as as_svg
    from reference.drawing.sheets import reference_drawing
    from reference.drawing.subject import Subject

    speaker = tongue(drawings.lang)
    subject = Subject(assignment, plan, 0, wording_of(speaker))
    written: dict[Path, str | bytes] = {}
    if drawings.svg is not None or drawings.pdf is not None:
        drawn = reference_drawing(assignment, plan, wording=subject.wording, altitude=drawings.altitude)
        sheets = [sheet.shapes for sheet in drawn]
        if drawings.svg is not None:
            written[drawings.svg] = as_svg(sheets)
        if drawings.pdf is not None:
            from grader.solution.pages import pdf as as_pdf

            written[drawings.pdf] = as_pdf(sheets, subject.title)
    if drawings.steps is not None:
        from grader.solution.pages import html_page, pdf_pages

        printed = drawings.steps.suffix.lower() == ".pdf"
        written[drawings.steps] = pdf_pages(subject, speaker) if printed else html_page(subject, speaker)
    for file, content in written.items():
        write_whole(file, content)


def _print_table(assignment: Assignment, plan: Plan) -> None:
    from rich.console import Console

    document = plan_document(assignment, plan)
    scales = document.scales
    console = Console()
    console.print(f"[bold]{assignment.file.title.en}[/bold], {plan.variants[0]}", highlight=False)
    console.print(
        f"kL = {scales.kL:.6g} m/mm   kv = {scales.kv:.6g} (m/s)/mm   ka = {scales.ka:.6g} (m/s^2)/mm",
        highlight=False,
    )
    table = new_table("vector", "drawn mm", "value", "unit", "direction deg", left=("unit",))
    for vector, row in document.vectors.items():
        direction = "-" if row.direction_deg is None else f"{row.direction_deg:.2f}"
        table.add_row(vector, f"{row.drawn_mm:.2f}", f"{row.value:.4f}", row.unit, direction)
    for rate, value in document.angular.items():
        unit = "rad/s" if rate.startswith("omega") else "rad/s^2"
        table.add_row(rate, "", f"{value + 0.0:.4f}", unit, "")
    console.print(table)
    worst = min((float(np.min(sine)) for sine in plan.motion.transmission.values()), default=1.0)
    if worst < 0.2:
        console.print(
            f"near a singular position: the sine of a transmission angle is {worst:.3f}", style="yellow"
        )
