"""Reading measured on scanned drawings with known truth, made by others.

    python -m tests.bench.shared_sheets [FOLDER ...]     (folders below ../shared/sheets)

A vector is right where its end minus its start lies within 0.5 mm of what was drawn: node to node,
or the stroke itself, which may miss the nodes that it joins (no reader can know which is meant).
"""

import json
import resource
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from grader.inputs.roster import read_roster
from grader.pipeline import open_page, read_pages
from grader.records import PageRef
from grader.rubric import load_rubric
from reference.authored.assignment import load_assignment

SHEETS = Path(__file__).resolve().parents[3] / "shared" / "sheets"
PLANS = ("velocity_plan", "acceleration_plan")
RIGHT_MM, WRONG_MM, LEAST_MM, SURE = 0.5, 1.0, 5.0, 0.9


@dataclass
class Tally:
    plans: dict = field(default_factory=lambda: defaultdict(list))
    sheets: list = field(default_factory=list)
    nodes_mm: list = field(default_factory=list)
    vectors: list = field(default_factory=list)
    seconds: list = field(default_factory=list)
    misreads: list = field(default_factory=list)


def complex_of(point) -> complex:
    return complex(point[0], -point[1])


def truths(folder: Path) -> dict[str, list[dict]]:
    found = defaultdict(list)
    for line in (folder / "truth.jsonl").read_text().splitlines():
        truth = json.loads(line)
        found[truth["student_id"]].append(truth)
    return found


def true_vectors(figure: dict) -> Iterator[tuple[str, list[complex]]]:
    """Each vector as complex mm: node to node, and along its stroke."""
    for name, vector in figure["vectors"].items():
        ends = [figure["nodes"][vector[end]] for end in ("tail", "head")]
        ways = [complex_of(ends[1]) - complex_of(ends[0])]
        if vector.get("line_mm"):
            start, end = vector["line_mm"]
            ways.append(complex_of(end) - complex_of(start))
        yield name, ways


def node_name(name: str, figure: str) -> str:
    return name if name.startswith("n_") or figure == "velocity_plan" else f"{name}'"


def measure(folder: Path, name: str, tally: Tally) -> None:
    assignment = load_assignment(name)
    wanted = load_rubric(assignment.file.rubric).vectors
    roster = read_roster(folder / "roster.csv")
    for student, sheets in truths(folder).items():
        row = roster.rows_of(student)[0]
        start = time.perf_counter()
        seen = [open_page(PageRef(t["class_file"], t["page"], path=folder / t["class_file"])) for t in sheets]
        variant = assignment.variant(row.n, row.position)
        readings = [page.reading for page in read_pages(seen, assignment, variant, row.scales, wanted)]
        tally.seconds.append((time.perf_counter() - start) / len(sheets))
        for truth, reading in zip(sheets, readings, strict=True):
            right = [
                compare(truth, reading, figure, tally, f"{folder.name}/{student}")
                for figure in PLANS
                if figure in truth["figures"]
            ]
            tally.sheets.append(all(right))


def compare(truth: dict, reading, figure: str, tally: Tally, where: str) -> bool:
    drawn, found = truth["figures"][figure], reading.figures.get(figure)
    all_right, all_sure = True, True
    for name, ways in true_vectors(drawn):
        vector = found.vectors.get(name) if found else None
        error, sure = np.inf, 0.0
        if vector is not None and vector.length_mm is not None:
            as_read = vector.length_mm * np.exp(1j * np.radians(vector.direction_deg or 0.0))
            error = min(abs(as_read - way) for way in ways)
            sure = vector.confidence
        if sure >= SURE and error > WRONG_MM:
            tally.misreads.append((where, truth["page"], name, round(error, 2), round(sure, 3)))
        if abs(ways[0]) >= LEAST_MM:
            tally.vectors.append((error <= RIGHT_MM, sure >= SURE))
            all_right &= error <= RIGHT_MM
            all_sure &= sure >= SURE
    for name, at in drawn["nodes"].items():
        node = found.nodes.get(node_name(name, figure)) if found else None
        if node is not None:
            tally.nodes_mm.append((abs(node.at - complex_of(at)), node.confidence))
    tally.plans[figure].append((all_right, all_right and all_sure))
    return all_right


def tell(name: str, tally: Tally) -> None:
    def share(flags) -> str:
        flags = list(flags)
        return f"{100 * np.mean(flags):3.0f} % of {len(flags)}" if flags else "-"

    nodes = np.array([error for error, _ in tally.nodes_mm])
    print(f"{name}:")
    for figure in PLANS:
        told = tally.plans[figure]
        print(
            f"  {figure}: right {share(r for r, _ in told)}, right and confident {share(s for _, s in told)}"
        )
    print(f"  sheets right {share(tally.sheets)}")
    right, certain = share(r for r, _ in tally.vectors), share(s for _, s in tally.vectors)
    print(f"  vectors >= 5 mm: right {right}, confident {certain}")
    sure = np.array([error for error, confidence in tally.nodes_mm if confidence >= SURE])
    for label, errors in (("all", nodes), ("confident", sure)):
        if len(errors):
            print(
                f"  node error ({label}, {len(errors)}): median {np.median(errors):.3f} mm,"
                f" p95 {np.percentile(errors, 95):.2f} mm"
            )
    print(f"  seconds a sheet: median {np.median(tally.seconds):.2f}, worst {max(tally.seconds):.2f}")
    print(f"  confident and wrong by more than 1 mm: {len(tally.misreads)} {tally.misreads}", flush=True)


def main() -> None:
    if not SHEETS.is_dir():
        sys.exit(f"{SHEETS} is not there: nothing to measure")
    names = sys.argv[1:] or sorted(path.name for path in SHEETS.iterdir() if path.is_dir())
    for name in names:
        tally = Tally()
        measure(SHEETS / name, name.split("-")[0], tally)
        tell(name, tally)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory {peak:.0f} MB")


if __name__ == "__main__":
    main()
