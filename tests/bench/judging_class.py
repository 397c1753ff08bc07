"""A class's measurements through the whole of `planmark grade`, timed in one process."""

import csv
import tempfile
import time
from pathlib import Path

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.folder.batch import Batch, grade
from grader.inputs.measurements import names_of, read_measurements
from grader.marking.mark import judge
from grader.records import Reading
from grader.rubric import RubricFile
from reference.authored.assignment import Assignment
from tests.bench.judging_assignments import assignment_named
from tests.bench.judging_handed_in import submission
from tests.bench.judging_students import Key, student
from tests.bench.judging_tally import ClassTime

MANY = 40
"""So many different students; the class repeats them under other names."""


def measure_class(rows: int, assignment: str = "pump") -> ClassTime:
    """Half of the class draw rightly, half with a mistake; measured with ruler and protractor."""
    task, rubric = assignment_named(assignment)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "handed-in").mkdir()
        _write(place / "handed-in" / "class.csv", assignment, rows)
        start = time.process_time()
        _judge_all(place / "handed-in" / "class.csv", task, rubric)
        judging = time.process_time() - start
        batch = Batch(task, rubric, place / "handed-in", place / "out", jobs=1)
        start, clock = time.process_time(), time.perf_counter()
        results = grade(batch, _silent)
        spent, passed = time.process_time() - start, time.perf_counter() - clock
    return ClassTime(assignment, rows, len(results.reports), judging, spent, passed)


def _judge_all(path: Path, assignment: Assignment, rubric: RubricFile) -> None:
    """The file read and every line of it judged, nothing written."""
    for line in read_measurements(path, names_of(assignment)):
        variant = assignment.variant(line.n, line.position)
        handed_in = Submission(measured=line.reading, values=line.values, declared=line.scales)
        judge(task_of(assignment, rubric, variant), handed_in)


def _silent(what: str, done: int, of: int) -> None:
    del what, done, of


def _write(path: Path, assignment: str, rows: int) -> None:
    keys = [Key(assignment, "typical", "right" if seed % 2 else "single", seed) for seed in range(MANY)]
    lines = [_line(key) for key in keys]
    heads = list(dict.fromkeys(name for line in lines for name in line))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["student_id", *heads], restval="")
        writer.writeheader()
        writer.writerows({"student_id": f"s{row:04d}", **lines[row % len(lines)]} for row in range(rows))


def _line(key: Key) -> dict[str, object]:
    work = student(key)
    handed_in = submission(work, "directions")
    line: dict[str, object] = {"n": work.variant.n, "position": work.variant.position, **handed_in.declared}
    reading = handed_in.measured or Reading({})
    for figure in reading.figures.values():
        for name, vector in figure.vectors.items():
            line[name] = vector.length_mm
            if vector.direction_deg is not None:
                line[f"{name}_deg"] = vector.direction_deg
    return {name: value for name, value in line.items() if value is not None}
