"""Make the sample classes: scans, entered measurements, rosters, and the truth of what was drawn.

    python -m samples.make_samples FOLDER

Everything follows from the seeds below. The bundled classes were made with an earlier model of a student's
hand: their drawings differ from those of this script.
"""

import csv
import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from grader.printed.answer_sheet import make_sheets
from grader.rubric import rubric_of
from grader.tables.roster import RosterRow
from reference.authored.assignment import Assignment, load_assignment
from reference.construction.elements import View
from reference.construction.graph import evaluate
from reference.plan import exact_plan
from reference.quantities import unit_of
from samples.simulation import (
    CAREFUL,
    PENS,
    SLOPPY,
    TYPICAL,
    HandStyle,
    PageStyle,
    Scan,
    Settings,
    SimulatedSheet,
    Student,
    blank_back,
    measured_by,
    simulate,
    write_pdf,
    write_truth,
)
from samples.simulation.printing import printed_sheets
from samples.simulation.wording import SCALE_UNITS

QUIET = Scan(dpi=150.0, dpi_tag=150.0, noise=1.0, tint_grain=0.5, jpeg_quality=62, dust=8)
"""A good flatbed, frugal with bytes."""
COPY = replace(QUIET, mode="bilevel", container="tif", dpi=300.0, dpi_tag=300.0, device="copier", dust=30)
PHOTO = replace(
    QUIET,
    device="phone",
    mode="colour",
    dpi=170.0,
    dpi_tag=72.0,
    tilt_deg=4.0,
    lens_k1=0.012,
    shading=0.15,
    shadow=0.15,
    bed=(128, 96, 66),
    skew_deg=1.0,
)
WRITTEN_ONLY = replace(QUIET, dpi=20.0, dpi_tag=20.0)
"""For students who hand in numbers: the drawing stays at home."""
ROMANIAN = PageStyle(letter_mm=4.2)
PRINTED_FRAME = PageStyle(letter_mm=4.2, frame_by="print")
RUSSIAN = PageStyle(letter_mm=4.2, language="ru", frame="gost")
RUSSIAN_FORM = PageStyle(letter_mm=4.2, language="ru", frame="gost", frame_by="print", title_block="form")


@dataclass(frozen=True, slots=True)
class Pupil:
    """One line of the roster and what this student hands in."""

    number: int
    variant: int
    settings: Settings
    seed: int
    hands_in: frozenset[str] = field(default=frozenset({"scans"}))
    """Some of: scans, class pdf, answer sheet, csv, json, nothing."""

    @property
    def student_id(self) -> str:
        """The id: s01, s02, ..."""
        return f"s{self.number:02d}"


def settings_of(
    pen: str,
    student: Student | None = None,
    scan: Scan = QUIET,
    page: PageStyle = ROMANIAN,
    hand: HandStyle = CAREFUL,
) -> Settings:
    """A student's settings in one line."""
    return Settings(hand, student or Student(), PENS[pen], page, scan)


SCANS, PDF, SHEET = frozenset({"scans"}), frozenset({"class pdf"}), frozenset({"answer sheet"})
CSV, JSON, NOTHING = frozenset({"csv"}), frozenset({"json"}), frozenset[str]()
TWO = Student(sheets=2)

PUMP = [
    Pupil(1, 7, settings_of("fine pencil", TWO, replace(QUIET, dpi=200.0, dpi_tag=200.0)), 11, SCANS | CSV),
    Pupil(
        2,
        12,
        settings_of("soft pencil", Student(sheets=2, mistakes=("normal_reversed",)), hand=TYPICAL),
        12,
    ),
    Pupil(3, 3, settings_of("ink", Student(sheets=2, ka_ratio=1.25), COPY, PRINTED_FRAME), 13),
    Pupil(4, 18, settings_of("fine pencil"), 14, PDF),
    Pupil(5, 24, settings_of("soft pencil", Student(sheets=2, mistakes=("wrong_link",))), 15, PDF),
    Pupil(6, 9, settings_of("fine pencil", TWO), 16, SHEET),
    Pupil(7, 15, settings_of("ballpoint", TWO, PHOTO), 17),
    Pupil(8, 21, settings_of("fine pencil", TWO, WRITTEN_ONLY), 18, JSON),
    Pupil(9, 27, settings_of("fine pencil", Student(mistakes=("normal_missing",)), WRITTEN_ONLY), 19, CSV),
    Pupil(10, 30, settings_of("fine pencil"), 20, NOTHING),
    Pupil(11, 6, settings_of("soft pencil", TWO, hand=SLOPPY), 25, SCANS),
]
PRESS = [
    Pupil(1, 1, settings_of("fine pencil", TWO, QUIET, RUSSIAN), 31, SCANS | CSV),
    Pupil(
        2,
        2,
        settings_of("ink", TWO, replace(COPY, container="png", dpi=200.0, dpi_tag=200.0), RUSSIAN_FORM),
        32,
    ),
    Pupil(
        3,
        3,
        settings_of(
            "soft pencil",
            Student(sheets=2, mistakes=("wrong_link",)),
            replace(QUIET, quarter_turns=2),
            RUSSIAN,
        ),
        33,
    ),
    Pupil(4, 5, settings_of("fine pencil", TWO, WRITTEN_ONLY, RUSSIAN), 34, CSV),
    Pupil(5, 0, settings_of("fine pencil", TWO, WRITTEN_ONLY, RUSSIAN), 35, CSV),
]


def make_class(assignment: Assignment, pupils: Iterable[Pupil], folder: Path, delimiter: str) -> None:
    """Write all files of one class."""
    folder.mkdir(parents=True, exist_ok=True)
    truths: list[dict[str, Any]] = []
    roster: list[dict[str, Any]] = []
    numbers: list[dict[str, Any]] = []
    pdf_pages: list[tuple[SimulatedSheet, str]] = []
    for pupil in pupils:
        sheets = sheets_of(assignment, pupil)
        line = roster_line(pupil, sheets)
        if "class pdf" in pupil.hands_in:
            first = 2 * len(pdf_pages) + 1
            line["scans"] = ";".join(f"class.pdf#{first + 2 * k}" for k in range(len(sheets)))
            pdf_pages += [(sheet, pupil.student_id) for sheet in sheets]
        if pupil.hands_in & {"scans", "answer sheet"}:
            save(sheets, pupil, folder)
        if pupil.hands_in & {"scans", "answer sheet", "class pdf"}:
            truths += [sheet.truth for sheet in sheets]
        measured = measured_line(pupil, sheets)
        if "csv" in pupil.hands_in:
            numbers.append(measured)
        if "json" in pupil.hands_in:
            write_json(folder / f"{pupil.student_id}.json", measured)
        roster.append(line)
    if pdf_pages:
        write_class_pdf(folder / "class.pdf", [sheet for sheet, _ in pdf_pages])
    write_csv(folder / "roster.csv", roster, ",")
    write_csv(folder / "measurements.csv", numbers, delimiter)
    write_truth(folder / "truth.jsonl", truths)


def sheets_of(assignment: Assignment, pupil: Pupil) -> list[SimulatedSheet]:
    """Simulate the student's sheets, on printed paper where the student got some."""
    by_position = assignment.numbers("position") is not None
    variant = assignment.variant(None, pupil.variant) if by_position else assignment.variant(pupil.variant)
    printed = None
    if "answer sheet" in pupil.hands_in:
        row = RosterRow(pupil.student_id, f"Student {pupil.number}", variant.n, variant.position)
        document = make_sheets(assignment, [row], "ro")
        printed = printed_sheets(document.pdf, document.layout)
    return simulate(
        assignment, variant, pupil.seed, pupil.settings, student_id=pupil.student_id, printed=printed
    )


def save(sheets: list[SimulatedSheet], pupil: Pupil, folder: Path) -> None:
    """Save the student's scans, one file each."""
    for number, sheet in enumerate(sheets, start=1):
        name = pupil.student_id if len(sheets) == 1 else f"{pupil.student_id}_{number}"
        sheet.save(folder / name)
        sheet.truth["page"] = 1


def write_class_pdf(path: Path, sheets: list[SimulatedSheet]) -> None:
    """Write one PDF as from a copier: every sheet followed by its blank back."""
    rng = np.random.default_rng(5)
    pages = []
    for index, sheet in enumerate(sheets):
        scan = sheet.settings.scan
        pages += [(sheet.image, scan.dpi, 0), (blank_back(scan, sheet.image.shape[:2], rng), scan.dpi, 0)]
        sheet.truth.update({"file": path.name, "page": 2 * index + 1})
    write_pdf(path, pages, quality=QUIET.jpeg_quality)


def scales_of(sheets: list[SimulatedSheet]) -> dict[str, str]:
    """The scales as declared, with their units."""
    declared = sheets[0].truth["scales"]["declared"]
    return {name: f"{value:.6g} {SCALE_UNITS[name]}" for name, value in declared.items()}


def variant_columns(sheets: list[SimulatedSheet]) -> dict[str, Any]:
    """N and position, blank where the assignment has none."""
    truth = sheets[0].truth
    return {key: "" if truth[key] is None else truth[key] for key in ("n", "position")}


def roster_line(pupil: Pupil, sheets: list[SimulatedSheet]) -> dict[str, Any]:
    """The student's line of the roster."""
    scales = scales_of(sheets) if pupil.hands_in else {}
    return {
        "student_id": pupil.student_id,
        "name": f"Student {pupil.number}",
        **variant_columns(sheets),
        **scales,
        "scans": "",
    }


def measured_line(pupil: Pupil, sheets: list[SimulatedSheet]) -> dict[str, Any]:
    """The student's measurements on the drawing, to half a millimetre."""
    measured = measured_by(sheets, np.random.default_rng([pupil.seed, 9]), spread_mm=0.15)
    return {"student_id": pupil.student_id, **variant_columns(sheets), **scales_of(sheets), **measured}


def write_csv(path: Path, lines: list[dict[str, Any]], delimiter: str) -> None:
    """Write a table with the columns of all lines; with semicolons as delimiter, decimal commas."""
    columns = list(dict.fromkeys(name for line in lines for name in line))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, delimiter=delimiter, lineterminator="\n")
        writer.writerow(columns)
        for line in lines:
            cells = [str(line.get(name, "")) for name in columns]
            if delimiter == ";":
                cells = [cell.replace(".", ",") if cell[:1].isdigit() else cell for cell in cells]
            writer.writerow(cells)


def write_json(path: Path, line: dict[str, Any]) -> None:
    """Write one student's measurements as JSON."""
    taken = {"student_id", "n", "position", *SCALE_UNITS}
    lengths = {name: value for name, value in line.items() if name not in taken and not name.endswith("_deg")}
    directions = {name.removesuffix("_deg"): value for name, value in line.items() if name.endswith("_deg")}
    document: dict[str, Any] = {
        "student_id": line["student_id"],
        "n": line["n"],
        "scales": {name: line[name] for name in SCALE_UNITS if name in line},
        "segments_mm": lengths,
        "directions_deg": directions,
        "values": {},
    }
    path.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


# Force plans, entered as measured -----------------------------------------------------------------

FORCES: dict[str, tuple[int, dict[str, float], dict[str, float]]] = {
    "s01": (7, {}, {}),
    "s02": (12, {"angle F_i3": np.pi}, {}),
    "s03": (20, {}, {"kF": 125.0}),
    "s04": (25, {"angle F_iD": np.pi}, {}),
}
"""Each student's n, angles (rad) by which a given force is turned wrongly, and scales of their own."""


def forces_line(assignment: Assignment, student_id: str) -> dict[str, Any]:
    """A student's force plans, drawn from the data as they took them, and measured to half a millimetre."""
    n, turned, own = FORCES[student_id]
    variant, rng = assignment.variant(n), np.random.default_rng([n, 41])
    plan = exact_plan(assignment, [variant], assignment.scales([variant], **own))
    parameters = {**plan.drawing.parameters}
    parameters |= {name: parameters[name] + angle for name, angle in turned.items()}
    construction, nodes = plan.construction, evaluate(plan.construction, parameters)
    line: dict[str, Any] = {"student_id": student_id, "n": n}
    line |= {name: f"{getattr(plan.scales, name)[0]:.6g} {unit_of(name)}" for name in assignment.scale_names}
    for name in rubric_of(assignment).vectors:
        vector = construction.vectors[name]
        drawn = complex((nodes[vector.head] - nodes[vector.tail])[0]) * (-1.0 if vector.reversed else 1.0)
        line[name] = round(2.0 * (abs(drawn) + rng.normal(0.0, 0.15))) / 2.0
        line[f"{name}_deg"] = round(np.degrees(np.angle(drawn)) + rng.normal(0.0, 0.4)) % 360
    moment = construction.moments["M_b"].at(View(nodes, parameters))
    return {**line, "M_b_value": f"{float(moment[0]):.4g}"}


def make_forces(assignment: Assignment, folder: Path) -> None:
    """Write the class that has entered its force plans."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = [forces_line(assignment, student_id) for student_id in FORCES]
    columns = ("student_id", "name", "n", *assignment.scale_names)
    named = [
        {name: line.get(name, f"Student {number}") for name in columns}
        for number, line in enumerate(lines, 1)
    ]
    write_csv(folder / "roster.csv", named, ",")
    write_csv(folder / "measurements.csv", lines, ",")


def main(folder: Path) -> None:
    """Make the classes."""
    make_class(load_assignment("pump"), PUMP, folder / "pump", ",")
    make_class(load_assignment("press"), PRESS, folder / "press", ";")
    make_forces(load_assignment("pump-forces"), folder / "pump-forces")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("python -m samples.make_samples FOLDER")
    main(Path(sys.argv[1]))
