"""Grading folders as an instructor does, and checking values as a student does."""

import csv
import json
import shutil
from pathlib import Path

import cv2
import jsonschema
import numpy as np
import pytest

from grader.cli.exporting import schema
from reference.authored.assignment import built_in, load_assignment
from reference.construction.mistakes import Mistake
from reference.plan import exact_plan
from tests.examples import slow
from tests.hands import measured, task_for

ROOT = Path(__file__).resolve().parent.parent.parent
SAMPLES = ROOT / "samples"


def perfect_rows(name: str) -> list[dict[str, str]]:
    """Every variant of an assignment as a perfect hand would measure it, to six decimals."""
    assignment = load_assignment(name)
    variants = assignment.variants()
    plan = exact_plan(assignment, variants)
    rows = []
    for index, variant in enumerate(variants):
        row = {"student_id": f"s{index + 1:02d}", "n": variant.n, "position": variant.position}
        for scale, unit in (("kL", "m/mm"), ("kv", "(m/s)/mm"), ("ka", "(m/s^2)/mm")):
            row[scale] = f"{getattr(plan.scales, scale)[index]:.12g} {unit}"
        for vector in plan.vectors_si:
            row[vector] = f"{abs(plan.drawn_mm(vector)[index]):.6f}"
            angle = plan.direction_deg(vector)[index]
            row[f"{vector}_deg"] = "" if np.isnan(angle) else f"{angle:.6f}"
        for rate, values in plan.rates.items():
            row[f"{rate}_value"] = f"{values[index]:.9g}"
        rows.append({key: "" if value is None else str(value) for key, value in row.items()})
    return rows


def write_table(path: Path, rows: list[dict[str, str]]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def write_roster(path: Path, rows: list[dict[str, str]]) -> None:
    write_table(
        path,
        [
            {
                "student_id": row["student_id"],
                "name": row["student_id"].upper(),
                "n": row["n"],
                "position": row["position"],
            }
            for row in rows
        ],
    )


def results_of(folder: Path) -> dict:
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    jsonschema.validate(results, schema("results"))
    return results


@pytest.mark.parametrize("name", ["press", *slow(*(one for one in built_in() if one != "press"))])
def test_a_table_of_a_perfect_hand_has_full_marks(planmark, tmp_path, name):
    rows = perfect_rows(name)[:3]
    write_table(tmp_path / "in" / "measured.csv", rows)
    write_roster(tmp_path / "roster.csv", rows)
    ran = planmark("grade", "in", "--assignment", name, "--roster", "roster.csv", "--out", "out", "--jobs", 1)
    reports = results_of(tmp_path / "out")["reports"]
    assert len(reports) == len(rows)
    lost = {
        (report["student_id"], one["id"]): one["verdict"]
        for report in reports
        for one in report["criteria"]
        if one["verdict"] not in {"full", "not_judged"}
    }
    assert not lost
    assert all(report["score"] == pytest.approx(report["max_score"]) for report in reports)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_a_sample_sheet_is_graded_with_report_feedback_and_picture(planmark, tmp_path):
    (tmp_path / "in").mkdir()
    for page in ("s01_1.jpg", "s01_2.jpg"):
        shutil.copy(SAMPLES / "pump" / page, tmp_path / "in" / page)
    roster = (SAMPLES / "pump" / "roster.csv").read_text(encoding="utf-8").splitlines()[:2]
    (tmp_path / "in" / "roster.csv").write_text("\n".join(roster) + "\n", encoding="utf-8")
    ran = planmark("grade", "in", "--assignment", "pump", "--out", "out", "--jobs", 1, "--lang", "ro")
    assert ran.returncode in {0, 1}, ran.stderr
    folder = tmp_path / "out" / "s01"
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    jsonschema.validate(report, schema("report"))
    assert len(report["reading"]["sheets"]) == 2
    assert report["status"] in {"graded", "needs_review"}
    assert (folder / "overlay.png").is_file()
    assert (folder / "overlay_2.png").is_file()
    page = (folder / "feedback.html").read_text(encoding="utf-8")
    assert 'lang="ro"' in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    text = (tmp_path / "out" / "summary.csv").read_text(encoding="utf-8-sig")
    summary = list(csv.DictReader(text.splitlines()))
    assert summary[0]["student_id"] == "s01"
    for target in ("csv", "moodle"):
        sent = planmark("export", "out", "--to", target, "--file", f"{target}.csv")
        assert sent.returncode in {0, 1}, sent.stderr
        assert (tmp_path / f"{target}.csv").is_file()


def test_what_is_read_is_printed_as_its_schema_says(planmark):
    scan = SAMPLES / "press" / "s01_1.jpg"
    ran = planmark("read", scan, "--assignment", "press", "--position", 1, "--json")
    assert ran.returncode in {0, 1}, ran.stderr
    sheets = json.loads(ran.stdout)
    assert len(sheets) == 1
    jsonschema.validate(sheets[0], schema("reading"))
    assert sheets[0]["source"] == "s01_1.jpg"
    assert sheets[0]["sheet"]["px_per_mm"] == pytest.approx(150 / 25.4, rel=0.01)


@pytest.mark.parametrize("name", ["empty.png", "photo.jpg"])
def test_a_page_that_is_no_drawing_is_read_as_nothing(planmark, tmp_path, name):
    rng = np.random.default_rng(3)
    blank = np.full((1240, 1754), 250, np.uint8)
    noise = cv2.GaussianBlur(rng.integers(0, 255, (900, 1200, 3), np.uint8), (0, 0), 9)
    cv2.imwrite(str(tmp_path / name), blank if name == "empty.png" else noise)
    ran = planmark("read", name, "--assignment", "pump", "--n", 3, "--json")
    assert ran.returncode == 1
    (sheet,) = json.loads(ran.stdout)
    assert sheet["figures"] == {}
    assert sheet["unread"] or sheet["problems"]


def one_student(tmp_path: Path, **changes: float) -> Path:
    row = perfect_rows("pump")[6]
    plan = {key: float(row[key]) for key in row if key.startswith(("v_", "a_")) and "_deg" not in key}
    document = {"student_id": "s07", "n": 7, "scales": {k: row[k] for k in ("kL", "kv", "ka")}}
    document["segments_mm"] = plan | changes
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_a_students_wrong_value_is_told_without_giving_the_answer_away(planmark, tmp_path):
    right_mm = float(perfect_rows("pump")[6]["v_D"])
    ran = planmark("check", "pump", "--n", 7, "--measured", one_student(tmp_path, v_D=right_mm + 9.0))
    assert ran.returncode == 1
    assert "✗" in ran.stdout
    assert f"{right_mm:.1f}" not in ran.stdout
    assert f"{right_mm:.0f} mm" not in ran.stdout


def forgotten_two(tmp_path: Path) -> Path:
    """A student's own values with a Coriolis component of omega v instead of 2 omega v."""
    reading = measured(task_for("shaper", 7), mistakes=(Mistake("arithmetic", "k_A3A", factor=0.5),))
    vectors = {name: one for figure in reading.figures.values() for name, one in figure.vectors.items()}
    document = {
        "n": 7,
        "segments_mm": {name: one.length_mm for name, one in vectors.items()},
        "directions_deg": {name: one.direction_deg for name, one in vectors.items()},
    }
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


@pytest.mark.parametrize(("lang", "told"), [("en", "half of what it should be"), ("ro", "jumătate din cât")])
def test_the_likely_mistake_is_told_to_instructors_alone(planmark, tmp_path, lang, told):
    call = ("check", "shaper", "--measured", forgotten_two(tmp_path), "--lang", lang)
    student, instructor = planmark(*call), planmark(*call, "--level", "full")
    assert student.returncode == instructor.returncode == 1
    assert "arithmetic" not in student.stdout
    assert "arithmetic" in instructor.stdout
    assert told in " ".join(instructor.stdout.split())


@pytest.mark.parametrize(
    "call",
    [
        "grade nowhere --assignment pump --out out",
        "grade . --assignment pmup --out out",
        "grade . --assignment pump --roster nowhere.csv --out out",
        "grade . --assignment pump --out out --lang xx",
        "check pump --n 7 --measured nowhere.json",
        "read nowhere.jpg --assignment pump",
        "export nowhere --to csv",
    ],
)
def test_a_call_that_names_what_there_is_not_is_refused(planmark, tmp_path, call):
    ran = planmark(*call.split())
    assert ran.returncode == 2, ran.stdout + ran.stderr
    assert ran.stderr.strip()
    assert "Traceback" not in ran.stderr
    assert not (tmp_path / "out").exists()


def test_a_student_fills_in_the_template_and_needs_no_student_id(planmark, tmp_path):
    ran = planmark("check", "pump", "--n", 7, "--template", tmp_path / "mine.csv", "--lang", "ro")
    assert ran.returncode == 0
    file = tmp_path / "mine.csv"
    header, *comments, last = file.read_text(encoding="utf-8-sig").splitlines()
    assert header.startswith("n;kL;kv;ka;v_A;v_A_deg;")
    assert all(line.lstrip('"').startswith("#") for line in comments)
    assert "student_id" not in header
    assert "(0,005 m/mm)" in comments[-1]
    assert "student_id" in comments[-1]
    assert planmark("check", "pump", "--n", 7, "--template", file).returncode == 2
    untouched = planmark("check", "pump", "--measured", file)
    assert untouched.returncode == 1
    assert "nothing" in untouched.stdout
    filled = last.split(";")
    filled[header.split(";").index("v_A")] = "60,0"
    file.write_text("\r\n".join([header, *comments, ";".join(filled)]), encoding="utf-8")
    assert planmark("check", "pump", "--measured", file).returncode == 0


PRINTED = {
    "0": {"v_BA_value": "1,8", "a_BA_n": "25"},
    "1": {
        "v_B": "46,4", "v_BA": "47,17", "v_C": "92,8", "v_D": "89,36", "v_DC": "21,61",
        "v_B_value": "1,67", "v_BA_value": "1,7", "v_C_value": "3,34", "v_D_value": "3,22",
        "v_DC_value": "0,78",
        "a_BA_n": "22,2", "a_B_n": "32,4", "a_DC_n": "15,7",
    },
}  # fmt: skip
"""The table of results in the source of the press's course work, as printed."""


def test_the_printed_rows_of_the_press_typed_into_its_template_earn_all_their_criteria(planmark, tmp_path):
    file, work = tmp_path / "mine.csv", tmp_path / "class"
    assert planmark("check", "press", "--template", file, "--lang", "ru").returncode == 0
    header, *comments = file.read_text(encoding="utf-8-sig").splitlines()
    lines = [line.split(";") for line in comments if not line.lstrip('"').startswith("#")]
    names = header.split(";")
    assert [line[names.index("position")] for line in lines] == [str(position) for position in range(8)]
    for line in lines[:2]:
        scales = {"kL": "0,00667 м/мм", "kv": "0,036 (м/с)/мм", "ka": "0,108 (м/с2)/мм"}
        for name, text in {**scales, **PRINTED[line[0]]}.items():
            line[names.index(name)] = text
    work.mkdir()
    typed = [f"student_id;{header}", *(f"s01;{';'.join(line)}" for line in lines[:2])]
    (work / "s01.csv").write_text("\n".join(typed), encoding="utf-8")
    planmark("grade", work, "--assignment", "press", "--out", tmp_path / "out")
    reports = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))["reports"]
    for report in reports:
        entered = PRINTED[str(report["position"])]
        found = {one["id"]: (one["verdict"], one["points"], one["max_points"]) for one in report["criteria"]}
        for name in ("kL", "kv", "ka", *entered):
            verdict, points, most = found[name]
            assert (verdict, points) == ("full", most), (report["position"], name)
    # A student's own check skips the positions that are still blank.
    file.write_text("\n".join([header, *(";".join(line) for line in lines)]), encoding="utf-8")
    told = planmark("check", "press", "--measured", file).stdout
    assert "position = 1" in told
    assert "position = 2" not in told


@pytest.mark.parametrize(
    ("call", "told"),
    [
        ("pump --measured nowhere.csv", "нет такого файла"),
        ("pump --measured bare.csv", "нужен параметр --n"),
        ("pump --n 77 --measured bare.csv", "n = 77"),
        ("pump --n 7", "--measured"),
        ("pumpp --n 7 --measured bare.csv", "нет задания «pumpp»"),
        ("pump --n 7 --measured bare.csv --level all", "--level all"),
        ("pump --n 7 --measured bare.csv --page mine.pdf", ".html"),
        ("pump --n 7 --measured bare.csv --page mine", ".html"),
        ("pump-forces --n 7 --measured nowhere.csv", "kL, kF, R_34_t"),
        ("pump --n 7 --template mine.txt", ".csv"),
        ("pump --n 8 --measured both.csv", "n 7"),
    ],
)
def test_errors_of_a_self_check_are_in_the_students_language(planmark, tmp_path, call, told):
    (tmp_path / "bare.csv").write_text("v_A\n60\n", encoding="utf-8")
    (tmp_path / "both.csv").write_text("n,v_A\n7,60\n", encoding="utf-8")
    ran = planmark("check", *call.split(), "--lang", "ru")
    assert ran.returncode == 2
    assert told in ran.stderr
    assert any("а" <= letter <= "я" for letter in ran.stderr)


def test_the_page_of_a_self_check_has_no_points_and_sends_nobody_to_a_person(planmark, tmp_path):
    file = tmp_path / "mine.csv"
    file.write_text("v_A,v_B,v_D,kv\n60,5,99,0.3\n", encoding="utf-8")
    page = tmp_path / "mine.html"
    assert planmark("check", "pump", "--n", 7, "--measured", file, "--page", page).returncode == 1
    text = page.read_text(encoding="utf-8")
    for word in ("waiting for review", "Points", "score is", "/ 44"):
        assert word not in text
    assert 'class="score' not in text
    assert "Look at" in text


def test_the_page_of_a_force_sheet_calls_the_driving_link_no_group(planmark, tmp_path):
    file, page = tmp_path / "mine.csv", tmp_path / "mine.html"
    file.write_text("R_31,R_31_deg,R_43,R_43_deg\n50,203,40,199\n", encoding="utf-8")
    planmark("check", "pump-forces", "--n", 3, "--measured", file, "--page", page)
    text = page.read_text(encoding="utf-8")
    assert "force plan of the driving link:" in text
    assert "force plan of the group of A" not in text


def test_a_column_that_is_not_known_costs_no_class(planmark, tmp_path):
    (tmp_path / "in").mkdir()
    table = "student_id,n,v_A,remark\ns01,7,60,good\ns02,8,60,\n"
    (tmp_path / "in" / "class.csv").write_text(table, encoding="utf-8")
    planmark("grade", "in", "--assignment", "pump", "--out", "out")
    results = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert not results["unmatched"]
    first, second = results["reports"]
    assert [problem["code"] for problem in first["problems"]] == ["measurement_columns"]
    assert not second["problems"]
