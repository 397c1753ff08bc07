"""Handed in under the own number, drawn with another's data: nobody is graded so without a person."""

import csv
import json
from pathlib import Path

import pytest

from reference.authored.assignment import load_assignment
from tests.functional.conftest import Run
from tests.functional.test_grade import perfect_rows, results_of, write_roster, write_table

SAMPLES = Path(__file__).resolve().parents[2] / "samples" / "pump"
VECTORS = ("v_", "a_")


def with_data_of(row: dict, other: dict, kinds: tuple[str, ...]) -> dict:
    """A student's line with another's vectors of some kinds in it; scales stay the own ones."""
    return {**row, **{name: value for name, value in other.items() if name.startswith(kinds)}}


def test_a_copied_table_of_measurements_is_told_with_its_number(planmark: Run, tmp_path: Path) -> None:
    rows = perfect_rows("pump")[:12]
    write_roster(tmp_path / "roster.csv", rows)
    copied = {"s07": VECTORS, "s09": ("v_",), "s11": ("a_",)}
    source = next(row for row in rows if row["student_id"] == "s02")
    handed_in = [with_data_of(row, source, copied.get(row["student_id"], ())) for row in rows]
    write_table(tmp_path / "in" / "measured.csv", handed_in)
    planmark("grade", "in", "--assignment", "pump", "--roster", "roster.csv", "--out", "out", "--jobs", 1)
    parts = {"s07": "mechanism", "s09": "velocity_plan", "s11": "acceleration_plan"}
    for report in results_of(tmp_path / "out")["reports"]:
        part = parts.get(report["student_id"])
        if part is None:
            assert report["score"] == pytest.approx(report["max_score"])
            continue
        assert (report["status"], report["score"]) == ("needs_review", None)
        (mistake,) = report["mistakes"]
        assert (mistake["code"], mistake["at"]) == ("other_variant", part)
        assert mistake["detail"].startswith("n = 2")


@pytest.mark.slow
def test_a_scan_under_another_name_is_told_with_its_number(planmark: Run, tmp_path: Path) -> None:
    """The roster holds the scales of the name under which it is handed in, as an answer sheet does."""
    with (SAMPLES / "roster.csv").open(encoding="utf-8") as file:
        drawn = next(row for row in csv.DictReader(file) if row["student_id"] == "s01")
    assignment = load_assignment("pump")
    own = assignment.variant(int(drawn["n"]) + 9)
    scales = assignment.scales([own])
    units = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s^2)/mm"}
    told = ",".join(f"{float(getattr(scales, name)[0])} {unit}" for name, unit in units.items())
    (tmp_path / "roster.csv").write_text(
        f"student_id,name,n,kL,kv,ka\ns01,Student 1,{own.n},{told}\n", encoding="utf-8"
    )
    (tmp_path / "in").mkdir()
    for scan in SAMPLES.glob("s01_*"):
        (tmp_path / "in" / scan.name).write_bytes(scan.read_bytes())
    planmark("grade", "in", "--assignment", "pump", "--roster", "roster.csv", "--out", "out", "--jobs", 1)
    (report,) = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))["reports"]
    assert (report["status"], report["score"]) == ("needs_review", None)
    assert (report["mistakes"][0]["code"], report["mistakes"][0]["detail"]) == (
        "other_variant",
        f"n = {drawn['n']}",
    )
