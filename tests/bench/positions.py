"""Read all positions from two sheets, compared with a sheet for each position.

    OMP_NUM_THREADS=1 python -m tests.bench.positions --students 6

Students with careful and typical hands draw the press in eight positions: each on an answer sheet of its own
(`press`), all on two answer sheets, and all on two plain sheets (`press-all`), numbered and in rows or with
any of the habits of people (numbers behind letters, beside the pole or nowhere, from one; plans in columns,
mixed, one left out); flatbed scans at 300 dpi.
Counts are those of `tests.bench.reading_truth`, of the velocities.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2

from grader.pipeline import read_submission
from grader.printed.answer_sheet import make_sheets
from grader.records import PageRef
from grader.rubric import asked_of
from grader.scan.page import open_page
from grader.tables.measurements import StudentSubmission
from grader.tables.roster import RosterRow
from reference.authored.assignment import Assignment, Variant
from reference.construction.derive import construction_of
from samples.simulation import CAREFUL, TYPICAL, Settings, any_settings
from samples.simulation.desk import Printed
from samples.simulation.positions import Numbering, any_numbering, simulate_positions
from samples.simulation.printing import printed_sheets
from samples.simulation.student import drawn_by, scanned
from tests.bench.plain_text import as_text
from tests.bench.reading_scenes import answer_sheets, task_named
from tests.bench.reading_tally import ReadingTally, reading_tables, row_of
from tests.bench.reading_truth import figures_of

ALL, SINGLE = "press-all", "press"
ANYHOW = "two plain sheets, numbered and ordered anyhow"


def settings_of(seed: int) -> Settings:
    """A random student with a careful or a typical hand, who draws at the proposed scales."""
    own = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.0, hardship=0.0)
    student = replace(
        own.student, turn_deg=0.0, shrunk=1.0, crank_mm=None, kv_ratio=1.0, ka_ratio=1.0, abandoned=False
    )
    return replace(own, hand=(CAREFUL, TYPICAL)[seed % 2], student=student)


def sheets_of(assignment: Assignment, student_id: str) -> Printed:
    """The answer sheets with all positions that this student gets."""
    rows = [RosterRow(student_id, position=position) for position in assignment.shared_positions]
    sheets = make_sheets(assignment, rows)
    return printed_sheets(sheets.pdf, sheets.layout)


def measure(students: Sequence[int]) -> Iterator[tuple[str, ReadingTally]]:
    """Yield each kind of sheet with its counts."""
    assignment, rubric = task_named(ALL)
    single, asked = task_named(SINGLE)[0], asked_of(assignment, rubric)
    printed = sheets_of(assignment, "s01")
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder) / "s01"
        tally = ReadingTally()
        for seed in students:
            for variant in single.variants():
                desk, drawn = drawn_by(
                    single, variant, seed, settings_of(seed), printed=answer_sheets(single, variant)
                )
                sheet = scanned(desk, drawn[0], (1, 2))
                _add(tally, single, variant, [sheet.save(at)], [sheet.truth], asked.vectors)
        yield "a sheet for each position", tally
        for title, paper in (("two answer sheets", printed), ("two plain sheets", None), (ANYHOW, None)):
            tally = ReadingTally()
            for seed in students:
                habits = any_numbering(seed, assignment.shared_positions) if title == ANYHOW else Numbering()
                pages = simulate_positions(
                    assignment, None, seed, settings_of(seed), printed=paper, numbering=habits
                )
                paths = [page.sheet.save(at.with_name(f"s01_{k}")) for k, page in enumerate(pages)]
                for variant in assignment.variants():
                    truths = [page.truths[variant.position or 0] for page in pages]
                    _add(tally, assignment, variant, paths, truths, asked.vectors)
            yield title, tally


def _add(
    tally: ReadingTally,
    assignment: Assignment,
    variant: Variant,
    paths: Sequence[Path],
    truths: Sequence[dict[str, Any]],
    wanted: Sequence[str],
) -> None:
    """Read one position and compare its velocities with the truth."""
    start = time.process_time()
    pages = [open_page(PageRef(path.name, path=path)) for path in paths]
    submission = StudentSubmission("s01", variant, tuple(page.ref for page in pages), {})
    asked = asked_of(*task_named(ALL))
    read = read_submission(submission, pages, assignment, asked)
    tally.students += 1
    tally.add_times({}, 1.0, 1000.0 * (time.process_time() - start) / len(pages))
    construction = construction_of(assignment.mechanism([variant]))
    for truth, page in zip(truths, read, strict=True):
        if "velocity_plan" in truth["figures"]:
            tally.add_sheet(truth, figures_of(truth, construction), wanted, page, page.reading)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--students", type=int, default=6)
    parser.add_argument("--first", type=int, default=1, help="seed of the first student")
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    rows = []
    for title, tally in measure(range(asked.first, asked.first + asked.students)):
        rows.append(row_of(title, title, tally, None))
        print(f"{title}: done", file=sys.stderr)
    print(as_text(list(reading_tables(rows))[:1]))


if __name__ == "__main__":
    main()
