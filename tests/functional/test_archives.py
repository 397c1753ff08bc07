"""A platform's ZIP is graded as it is, and a newer one changes what changed in it."""

import json
import zipfile
from pathlib import Path
from typing import Any

from grader.files import samples_folder
from tests.inline import planmark

GOOD = json.loads((samples_folder() / "pump" / "s08.json").read_text(encoding="utf-8"))
VALUES = {key: value for key, value in GOOD.items() if key != "student_id"}
ROSTER = "student_id,name,n\n" + "".join(
    f"s0{number},{name},{GOOD['n']}\n"
    for number, name in enumerate(["Ștefan Țurcanu", "Иван Русу", "Ana Pop", "Ana Pop", "Radu Lungu"], 1)
)


def archive(path: Path, **changed: float) -> Path:
    values = json.dumps(VALUES | {"segments_mm": VALUES["segments_mm"] | changed})
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("Stefan Turcanu_101_assignsubmission_file_/values.json", json.dumps(VALUES))
        made.writestr("Русу Иван_102_assignsubmission_file_/values.json", values)
        made.writestr("Ana Pop_103_assignsubmission_file_/values.json", json.dumps(VALUES))
        made.writestr("Radu Lungu_105_assignsubmission_file_/all.zip", "photos")
        made.writestr("Radu Lungu_105_assignsubmission_onlinetext_/onlinetext.html", "See the ZIP.")
    return path


def graded(folder: Path, *call: object) -> dict[str, Any]:
    ran = planmark("grade", *call, "--assignment", "pump", "--out", "out", "--jobs", 1, cwd=folder)
    assert ran.returncode == 1, ran.stderr
    return json.loads((folder / "out" / "results.json").read_text(encoding="utf-8"))


def test_a_zip_is_matched_to_the_roster_and_a_newer_one_changes_what_changed(tmp_path: Path) -> None:
    (tmp_path / "roster.csv").write_text(ROSTER, encoding="utf-8")
    sent = archive(tmp_path / "submissions.zip")
    results = graded(tmp_path, sent)
    reports = {report["student_id"]: report for report in results["reports"]}
    states = {student: report["status"] for student, report in reports.items()}
    assert states == {
        "s01": "graded",
        "s02": "graded",
        "s03": "missing",
        "s04": "missing",
        "s05": "unreadable",
    }
    assert "archive_nested" in str(reports["s05"]["problems"])
    assert {one["code"]: one["file"] for one in results["unmatched"]} == {
        "owner_name": "submissions.zip/Ana Pop_103_assignsubmission_file_/values.json"
    }
    files = {path.name for path in tmp_path.iterdir()}
    assert files == {"roster.csv", "submissions.zip", "out"}
    first = (tmp_path / "out" / "s01" / "report.json").stat().st_mtime_ns

    archive(sent, v_B=VALUES["segments_mm"]["v_B"] + 9.0)
    moved = graded(tmp_path, sent)["moved"]
    assert [(one["student_id"], one["why"]) for one in moved] == [("s02", ["submission"])]
    assert (tmp_path / "out" / "s01" / "report.json").stat().st_mtime_ns == first


def test_zips_lie_in_a_folder_among_other_files_and_one_that_is_broken_stops_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "roster.csv").write_text(ROSTER, encoding="utf-8")
    archive(folder / "submissions.zip")
    (folder / "older.zip").write_bytes(b"PK cut off")
    (folder / "s03.json").write_text(json.dumps(VALUES), encoding="utf-8")
    results = graded(tmp_path, folder)
    assert [one["status"] for one in results["reports"]].count("graded") == 3
    told = {one["file"]: one for one in results["unmatched"]}
    assert "archive_damaged" in str(told["older.zip"])
    assert "see the ZIP" not in str(results)
