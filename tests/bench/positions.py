"""Read all positions from two sheets, compared with a sheet for each position.

    OMP_NUM_THREADS=1 python -m tests.bench.positions --students 6
    OMP_NUM_THREADS=1 python -m tests.bench.positions --class 20

Students with careful and typical hands draw the press in eight positions: each on an answer sheet of its own
(`press`), all on two answer sheets, and all on two plain sheets (`press-all`); flatbed scans at 300 dpi.
Counts are those of `tests.bench.reading_truth`, of the velocities. With `--class` such students' printed
sheets, every fourth plan with a mistake, are graded as a folder.
"""

import argparse
import csv
import json
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from grader.pipeline import read_submission
from grader.printed.answer_sheet import make_sheets
from grader.records import VELOCITY_PLAN, PageRef
from grader.rubric import asked_of
from grader.scan.page import open_page
from grader.tables.measurements import StudentSubmission
from grader.tables.roster import RosterRow
from reference.authored.assignment import Assignment, Variant
from reference.construction.derive import construction_of
from samples.simulation import CAREFUL, TYPICAL, Settings, any_settings
from samples.simulation.desk import Printed
from samples.simulation.hand import possible_mistakes
from samples.simulation.positions import simulate_positions
from samples.simulation.printing import printed_sheets
from samples.simulation.student import drawn_by, scanned
from tests.bench.plain_text import as_text
from tests.bench.reading_scenes import answer_sheets, task_named
from tests.bench.reading_tally import ReadingTally, reading_tables, row_of
from tests.bench.reading_truth import figures_of

ALL, SINGLE = "press-all", "press"


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
        for title, paper in (("two answer sheets", printed), ("two plain sheets", None)):
            tally = ReadingTally()
            for seed in students:
                pages = simulate_positions(assignment, None, seed, settings_of(seed), printed=paper)
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


def grade_class(count: int, folder: Path) -> str:
    """Grade a class of students whose every fourth plan has a mistake; what became of it."""
    assignment, _ = task_named(ALL)
    made: dict[tuple[str, int], tuple[str, ...]] = {}
    scans = folder / "scans"
    scans.mkdir(parents=True)
    with (folder / "roster.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["student_id", "name", "position"])
        for seed in range(1, count + 1):
            student, settings = f"s{seed:02d}", settings_of(seed)
            rows.writerows([student, f"Student {seed}", position] for position in assignment.shared_positions)
            wrong = _mistakes(assignment, settings, seed)
            printed = sheets_of(assignment, student)
            pages = simulate_positions(
                assignment, None, seed, settings, student_id=student, printed=printed, mistakes=wrong
            )
            for k, page in enumerate(pages):
                page.sheet.save(scans / f"scan{seed:02d}_{k}")
            for position, truth in pages[-1].truths.items():
                nodes = truth["figures"][VELOCITY_PLAN]["nodes"]
                codes = tuple(one["code"] for one in truth["mistakes"] if one["at"] in nodes)
                made |= {(student, position): codes} if codes else {}
    start = time.perf_counter()
    out = folder / "out"
    call = ["grade", scans, "--assignment", ALL, "--roster", folder / "roster.csv", "--out", out, "--jobs", 1]
    program = [sys.executable, "-m", "grader", *map(str, call)]
    subprocess.run(program, check=False, stdout=subprocess.DEVNULL)  # noqa: S603 - our own program
    results = json.loads((out / "results.json").read_text(encoding="utf-8"))
    return _told(results, made, time.perf_counter() - start)


def _mistakes(assignment: Assignment, settings: Settings, seed: int) -> dict[int, tuple[str, ...]]:
    """One mistake in every fourth plan of the velocities."""
    rng = np.random.default_rng([seed, 30])
    chosen: dict[int, tuple[str, ...]] = {}
    for position in assignment.shared_positions[seed % 4 :: 4]:
        able = possible_mistakes(assignment, Variant(None, position), settings.student, VELOCITY_CODES)
        if able:
            chosen[position] = (str(rng.choice(able)),)
    return chosen


VELOCITY_CODES = ("parallel_for_perpendicular", "sense_reversed", "wrong_link")


def _told(results: dict[str, Any], made: dict[tuple[str, int], tuple[str, ...]], seconds: float) -> str:
    """Return the counts of a graded class."""
    status = Counter(report["status"] for report in results["reports"])
    drawn = re.compile("[va]_")
    verdicts = Counter(
        criterion["verdict"]
        for report in results["reports"]
        for criterion in report["criteria"]
        if drawn.match(criterion["vector"] or "")
    )
    accused, found = 0, Counter[str]()
    for report in results["reports"]:
        codes = made.get((report["student_id"], report["position"]), ())
        named = {mistake["code"] for mistake in report["mistakes"]}
        accused += bool(named) and not codes
        found["named" if named & set(codes) else "not named"] += bool(codes)
    lines = [
        f"{len(results['reports'])} positions in {seconds:.0f} s, unmatched: {len(results['unmatched'])}",
        f"status: {dict(status)}",
        f"verdicts on vectors: {dict(verdicts)}",
        f"mistakes: {dict(found)}; right plans accused: {accused}",
    ]
    return "\n".join(lines)


def main() -> None:
    """Print the tables, or the counts of a class."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--students", type=int, default=6)
    parser.add_argument("--class", dest="count", type=int)
    parser.add_argument("--folder", type=Path, help="where the class is kept, else a temporary folder")
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    if asked.count:
        with tempfile.TemporaryDirectory() as folder:
            print(grade_class(asked.count, asked.folder or Path(folder)))
        return
    rows = []
    for title, tally in measure(range(1, asked.students + 1)):
        rows.append(row_of(title, title, tally, None))
        print(f"{title}: done", file=sys.stderr)
    print(as_text(list(reading_tables(rows))[:1]))


if __name__ == "__main__":
    main()
