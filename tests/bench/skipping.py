"""Measure the time saved by not repeating work: the verdicts must stay the same.

    python -m tests.bench.skipping [--students N] [--seed S]

A class on printed sheets of `pump`, a page for the velocities and one for the accelerations, is
graded; then again after each kind of change; last a node is moved in the review, until its new marks are
there. Each row has the processor seconds of the whole run, and says whether its reports equal those of a
run that skips nothing.
"""

import argparse
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from grader.folder.batch import Batch, grade
from grader.printed.answer_sheet import make_sheets
from grader.review.records import Answer, mark_of
from grader.review.session import Session
from grader.rubric import load_rubric
from grader.tables.decision_texts import place_text
from grader.tables.roster import RosterRow
from reference.authored.assignment import load_assignment
from samples.simulation import any_settings, simulate
from samples.simulation.printing import printed_sheets
from tests.inline import Inline

PUMP = load_assignment("pump")
HEAD = "student_id,name,n,kL,kv,ka"
PLAN, NODE = "velocity_plan", "b"
MOVES = 5


def draw(folder: Path, student: str, n: int, seed: int) -> str:
    """Draw one student's scans; return the line of the roster."""
    made = make_sheets(PUMP, [RosterRow(student, "", n)])
    settings = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.3)
    sheets = simulate(
        PUMP, PUMP.variant(n), seed, settings, student_id=student,
        printed=printed_sheets(made.pdf, made.layout),
    )  # fmt: skip
    for sheet in sheets:
        sheet.save(folder / f"{student}_{sheet.truth['kind']}")
    scales = sheets[0].truth["scales"]["declared"]
    told = (f"{scales['kL']!r} m/mm", f"{scales['kv']!r} (m/s)/mm", f"{scales['ka']!r} (m/s^2)/mm")
    return f"{student},{student},{n},{','.join(told)}"


def timed(folder: Path, out: Path, rubric, lines) -> tuple[list, float]:
    """Grade; the reports without times, and the processor's seconds."""
    (folder / "roster.csv").write_text("\n".join([HEAD, *lines]) + "\n")
    start = time.process_time()
    results = grade(Batch(PUMP, rubric, folder, out), lambda *_: None, Inline())
    return [_verdicts(report) for report in results.reports], time.process_time() - start


def _verdicts(report) -> tuple:
    told = [(one.id, one.verdict, one.points, one.measured.length_mm) for one in report.criteria]
    return report.student_id, report.status, report.score, report.score_range, told


def with_wider_tolerance(rubric):
    """The rubric with wider tolerances."""
    table = rubric.tolerance.model_copy(update={"length_mm": 1.5, "direction_deg": 2.0})
    return rubric.model_copy(update={"tolerance": table})


def shares(one: list, other: list) -> str:
    """The comparison of two runs as text: same verdicts or not, largest difference of lengths."""
    if one == other:
        return "yes"
    verdicts = [[[c[:3] for c in told] for *_, told in reports] for reports in (one, other)]
    lengths = [[c[3] or 0.0 for *_, told in reports for c in told] for reports in (one, other)]
    apart = float(np.max(np.abs(np.subtract(*lengths)))) if len(lengths[0]) == len(lengths[1]) else np.nan
    return f"{'yes' if verdicts[0] == verdicts[1] else 'NO'}, lengths within {apart:.2g} mm"


def moved_node(batch: Batch) -> tuple[list, float]:
    """Move a node in the review of a graded class; the reports after it, and the seconds it took."""
    session = Session(batch, Inline())
    session.bring_up_to_date(lambda *_: None)
    student = session.students[0]
    sheets = enumerate(student.report.reading.sheets)
    number, nodes = next((k, sheet.figures[PLAN].nodes) for k, sheet in sheets if PLAN in sheet.figures)
    node = nodes[NODE]
    spent = []
    for step in range(MOVES):
        start = time.process_time()
        at = session.snapped(student.key, number, PLAN, (node.x_mm + 5.0 * step, node.y_mm))
        there = session.standing().of(student, f"node:{PLAN}:{NODE}")
        moved = Answer(student.key, f"node:{PLAN}:{NODE}", place_text(*at), seen=mark_of(there))
        session.decide([moved], "", "bench")
        spent.append(time.process_time() - start)
    return [_verdicts(one.report) for one in session.students], float(np.median(spent))


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--students", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    told = parser.parse_args()
    cv2.setNumThreads(1)
    rubric = load_rubric("pump")
    wider = with_wider_tolerance(rubric)
    with tempfile.TemporaryDirectory() as place:
        top = Path(place)
        folder = top / "in"
        folder.mkdir()
        lines = [draw(folder, f"s{k}", 3 + 2 * k, told.seed + k) for k in range(told.students)]

        def fresh(name, by, roster):
            return timed(folder, top / name, by, roster)

        print("| run | s | of a run that skips nothing | same verdicts |\n|---|---|---|---|", flush=True)

        def row(name, found, whole):
            share = f"{100.0 * found[1] / whole[1]:.1f} %"
            print(f"| {name} | {found[1]:.2f} | {share} | {shares(found[0], whole[0])} |", flush=True)

        first = fresh("out", rubric, lines)
        row("first, all that the rubric asks", first, first)
        row("nothing changed", fresh("out", rubric, lines), first)
        again, whole = fresh("out", wider, lines), fresh("other", wider, lines)
        row("another tolerance in the rubric", again, whole)
        changed = [lines[0].replace("s0,s0", "s0,Ana"), *lines[1:]]
        row("a name in the roster corrected", fresh("out", wider, changed), whole)
        moved = moved_node(Batch(PUMP, wider, folder, top / "out"))
        row("a node moved in the review", moved, fresh("moved", wider, lines))


if __name__ == "__main__":
    main()
