"""Differences between two checkouts: every report of the same submissions, compared field by field.

    python -m tests.bench.frozen CHECKOUT_BEFORE [CHECKOUT_AFTER] [--sheets DIR] [--out DIR] [--students N]
                                 [--marks]

Both checkouts (the second is this one by default) grade

- the bundled samples of this checkout;
- with `--sheets`, each folder `ASSIGNMENT-...` of scans below it;
- simulated students entered as measurements: seven assignments, three hands, right drawings, each with one
  mistake, with two, and with a slip in computing; every other one without directions.

Reports are compared without times and version, numbers to 1e-9 of their size. Every difference is printed
with its path in the report; the exit status is 0 where there is none. With `--marks` only the verdicts that
changed are printed, by their reason, and for simulated students whether they are nearer to the verdicts due.
"""

import argparse
import csv
import json
import math
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.bench.judging_handed_in import Due, Visible, measured_line, submission
from tests.bench.judging_students import HANDS, KINDS, Source, StudentKey, student
from tests.bench.judging_tally import CHARGED, CREDITED
from tests.bench.judging_truth import charged_once, verdicts_due

ROOT = Path(__file__).resolve().parents[2]
ASSIGNMENTS = ("pump", "press", "engine", "shaper", "piston", "pump-collinear", "pump-230")
STUDENTS = 24
"""Number for each kind, hand and assignment: 2,016 in all."""
VOLATILE = frozenset({"timing_ms", "schema_version"})
"""Fields that may differ between two runs of the same program."""
RELATIVE = 1e-9
"""Numbers differ from here on: rounding of another order of summation stays below."""
SHOWN = 12
"""Differences of one report that are printed."""

Difference = tuple[str, Any, Any]
"""Path in the report, before, after."""


# Submissions --------------------------------------------------------------------------------------


def write_students(folder: Path, count: int) -> None:
    """Write a folder for each assignment with its simulated students' measurements in ``class.csv``."""
    for assignment in ASSIGNMENTS:
        rows = [row for row in _rows(assignment, count) if row]
        names = list(dict.fromkeys(name for row in rows for name in row))
        (folder / assignment).mkdir(parents=True, exist_ok=True)
        with (folder / assignment / "class.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, names, restval="")
            writer.writeheader()
            writer.writerows(rows)


def _rows(assignment: str, count: int) -> Iterator[dict[str, object]]:
    """A line for each student, except those that cannot be drawn."""
    for hand in HANDS:
        for kind in KINDS:
            for seed in range(count):
                key = StudentKey(assignment, hand, kind, seed)
                try:
                    measured = measured_line(key, with_directions=seed % 2 == 1)
                except ValueError:
                    continue
                yield {"student_id": f"{hand}-{kind}-{seed:02d}", **measured}


def submissions(students: Path, sheets: Path | None) -> Iterator[tuple[str, Path, str]]:
    """All that is graded: name, folder, assignment."""
    for assignment in ("pump", "press"):
        yield f"samples-{assignment}", ROOT / "samples" / assignment, assignment
    for folder in sorted(sheets.iterdir()) if sheets else ():
        if folder.is_dir() and folder.name.partition("-")[0] in ASSIGNMENTS:
            yield f"sheets-{folder.name}", folder, folder.name.partition("-")[0]
    for assignment in ASSIGNMENTS:
        if (students / assignment).is_dir():
            yield f"students-{assignment}", students / assignment, assignment


def grade(checkout: Path, folder: Path, assignment: str, out: Path) -> None:
    """Grade a folder with a checkout's program. Raises RuntimeError if the program fails."""
    command = [sys.executable, "-m", "grader", "grade", str(folder), "--assignment", assignment]
    surroundings = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(checkout)}
    done = subprocess.run(  # noqa: S603 - this project's own program
        [*command, "--out", str(out), "--jobs", "1"],
        cwd=checkout, env=surroundings, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode not in {0, 1}:
        raise RuntimeError(f"{checkout} does not grade {folder}: {done.stderr.strip()[-500:]}")


# Comparison ---------------------------------------------------------------------------------------


def differences(before: object, after: object, path: str = "$") -> Iterator[Difference]:
    """Every path at which two JSON documents differ."""
    match before, after:
        case dict(), dict():
            for name in sorted((before.keys() | after.keys()) - VOLATILE):
                if name in before and name in after:
                    yield from differences(before[name], after[name], f"{path}.{name}")
                else:
                    yield f"{path}.{name}", before.get(name, "(absent)"), after.get(name, "(absent)")
        case list(), list() if len(before) == len(after):
            for index, (old, new) in enumerate(zip(before, after, strict=True)):
                yield from differences(old, new, f"{path}[{index}]")
        case (bool(), _) | (_, bool()):
            if before is not after:
                yield path, before, after
        case ((int() | float()), (int() | float())):
            if not math.isclose(before, after, rel_tol=RELATIVE, abs_tol=RELATIVE):
                yield path, before, after
        case _ if before != after:
            yield path, before, after


def compare(before: Path, after: Path) -> tuple[int, int]:
    """Print the differences of the reports below two folders; return the number of equal ones and of all."""
    names = {path.relative_to(root) for root in (before, after) for path in root.rglob("report.json")}
    same = 0
    for name in sorted(names):
        if not ((before / name).is_file() and (after / name).is_file()):
            print(f"{name}: only {'before' if (before / name).is_file() else 'after'}")
            continue
        documents = [json.loads((root / name).read_text(encoding="utf-8")) for root in (before, after)]
        moved = list(differences(*documents))
        same += not moved
        if moved:
            print(f"{name}: {len(moved)} differences")
        for path, old, new in moved[:SHOWN]:
            print(f"    {path}: {str(old)[:90]} -> {str(new)[:90]}")
    return same, len(names)


# Marks that moved ---------------------------------------------------------------------------------

FALSE, OPEN, ALLOWED = 0, 1, 2
"""Grades of a verdict: wrong; left to a person or not judged; as due."""


def print_moved_marks(before: Path, after: Path) -> None:
    """Print the verdicts that changed, counted by their new reason; those for the worse one by one."""
    counts: Counter[tuple[str, ...]] = Counter()
    worse = []
    for path in sorted(after.rglob("report.json")):
        name = path.relative_to(after)
        if not (before / name).is_file():
            continue
        said = [
            {one["id"]: one for one in json.loads((root / name).read_text(encoding="utf-8"))["criteria"]}
            for root in (before, after)
        ]
        kind, due = _due(name, {one: row["verdict"] for one, row in said[1].items()})
        for criterion in said[0].keys() & said[1].keys():
            old, new = (rows[criterion]["verdict"] for rows in said)
            if old == new:
                continue
            why = ", ".join(dict.fromkeys(str(one) for one in said[1][criterion]["reasons"]))
            direction = ""
            if criterion in due:
                was, is_now = (_goodness(due[criterion], verdict) for verdict in (old, new))
                direction = "same" if was == is_now else "better" if is_now > was else "worse"
            counts[kind, direction, f"{old} -> {new}", why] += 1
            if direction == "worse":
                worse.append(f"    {name.parent} {criterion}: {old} -> {new}, due {due[criterion]} ({why})")
    for row, count in sorted(counts.items(), key=lambda one: (one[0][:2], -one[1])):
        print(f"{count:5d}  " + "  ".join(part for part in row if part))
    print("for the worse:", *worse or ["none"], sep="\n")


def _due(name: Path, said: dict[str, str]) -> tuple[str, dict[str, Due]]:
    """A student's kind and the verdicts due by criterion; empty for scans, whose truth is not known."""
    folder, student_id = name.parts[0], name.parts[1]
    if not folder.startswith("students-"):
        return "scan", {}
    hand, kind, seed = student_id.split("-")
    work = student(StudentKey(folder.removeprefix("students-"), hand, kind, int(seed)))  # type: ignore[arg-type]
    source: Source = "directions" if int(seed) % 2 else "lengths"
    visible = Visible.of(submission(work, source), work.construction.links)
    return kind, charged_once(work, verdicts_due(work, source, visible), said)


def _goodness(due: Due, verdict: str) -> int:
    if due not in {"right", "follows", "wrong"}:
        return ALLOWED
    if verdict in {"review", "not_judged"}:
        return OPEN
    is_false = verdict in CHARGED if due in {"right", "follows"} else due == "wrong" and verdict in CREDITED
    return FALSE if is_false else ALLOWED


def main() -> int:
    """Grade with both checkouts and compare; return the exit status."""
    parser = argparse.ArgumentParser(description="What moves between two checkouts.")
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path, nargs="?", default=ROOT)
    parser.add_argument(
        "--sheets", type=Path, help="folders of scans, their names beginning with the assignment"
    )
    parser.add_argument(
        "--out", type=Path, help="keep the results here: a second run grades only what changed"
    )
    parser.add_argument("--students", type=int, default=STUDENTS, help="of each kind, hand and assignment")
    parser.add_argument("--marks", action="store_true", help="the verdicts that moved, by their reason")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        out = (chosen.out or Path(temporary)).resolve()
        write_students(out / "students", chosen.students)
        for name, folder, assignment in submissions(out / "students", chosen.sheets):
            for side, checkout in (("before", chosen.before), ("after", chosen.after)):
                grade(checkout.resolve(), folder.resolve(), assignment, out / side / name)
            print(f"{name}: graded", file=sys.stderr)
        if chosen.marks:
            print_moved_marks(out / "before", out / "after")
            return 0
        same, of = compare(out / "before", out / "after")
    print(f"{same} of {of} the same")
    return 0 if same == of else 1


if __name__ == "__main__":
    sys.exit(main())
