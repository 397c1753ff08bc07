"""A course whose data stand in a table, as docs/course.md shows it: from the files to the marks."""

import json
import re
import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pypdfium2
import pytest
from typer.testing import CliRunner

from grader.cli.app import app
from grader.cli.exporting import schema
from reference.authored.assignment import load_assignment
from reference.kinematics.cycle import cycle
from reference.plan import exact_plan
from tests.functional.broken_files import Case
from tests.functional.test_grade import perfect_rows, results_of, write_roster, write_table

DOCS = Path(__file__).resolve().parents[2] / "docs" / "course.md"
RUBRIC = """
schema_version = 1
id = "conveyor"
title = { en = "Shaking conveyor", ro = "Transportor oscilant", ru = "Качающийся конвейер" }
"""
ASKED = ["v_A", "v_B", "v_BA", "v_C", "v_CB", "a_A", "a_BA_t", "a_B_n", "a_B_t", "a_B", "a_C"]
DEAD_POINT = """
[variant.values]
dead_deg = "degrees(acos(((a + b)**2 + d**2 - c**2) / (2*(a + b)*d)))"
phi_deg = "dead_deg + 30*position"
"""


@pytest.fixture
def conveyor(tmp_path) -> Path:
    """The files of the example, and a rubric."""
    text = DOCS.read_text(encoding="utf-8")
    shown = re.findall(r"(?m)^`(conveyor\.[\w.]+)`:\n\n```\w+\n(.*?)^```$", text, re.DOTALL)
    shown += re.findall(r"`(conveyor\.csv)`:\n\n```csv\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    assert {name for name, _ in shown} == {
        "conveyor.csv", "conveyor.mechanism.toml", "conveyor.assignment.toml",
    }  # fmt: skip
    criteria = [
        f'[[criterion]]\nid = "{name}"\n'
        f'title = {{ en = "{name}", ro = "{name}", ru = "{name}" }}\npoints = 2\nvector = "{name}"\n'
        for name in ASKED
    ]
    for name, content in (*shown, ("conveyor.rubric.toml", RUBRIC + "\n".join(criteria))):
        (tmp_path / name).write_text(content, encoding="utf-8")
    return tmp_path / "conveyor.assignment.toml"


def test_the_example_follows_the_schemas(conveyor):
    for kind in ("assignment", "mechanism"):
        text = conveyor.with_name(f"conveyor.{kind}.toml").read_text(encoding="utf-8")
        jsonschema.validate(tomllib.loads(text), schema(kind))
    inline = {**tomllib.loads(conveyor.read_text(encoding="utf-8"))}
    jsonschema.validate(
        {**inline, "variant": {"table": {"columns": ["n"], "rows": [[1]]}}}, schema("assignment")
    )
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**inline, "variant": {"table": 3}}, schema("assignment"))


def test_the_example_is_accepted_in_all_variants(planmark, conveyor):
    ran = planmark("lint", conveyor)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert "15 variants" in ran.stdout
    assert not re.search("(?m)^(fault|warning)", ran.stdout)


def test_every_row_is_graded_with_full_marks_and_another_row_is_not(planmark, conveyor, tmp_path):
    rows = perfect_rows(str(conveyor))
    write_roster(tmp_path / "roster.csv", rows)
    # The tenth hands in the plan of the first, which is in the other assembly.
    rows[9] = {**rows[0], "student_id": "s10", "n": "10"}
    write_table(tmp_path / "in" / "measured.csv", rows)
    planmark("grade", "in", "--assignment", conveyor, "--roster", "roster.csv", "--out", "out", "--jobs", 1)
    reports = {report["student_id"]: report for report in results_of(tmp_path / "out")["reports"]}
    assert len(reports) == 15
    copied = reports.pop("s10")
    assert all(report["score"] == pytest.approx(report["max_score"]) for report in reports.values())
    (mistake,) = copied["mistakes"]
    assert (mistake["code"], mistake["detail"]) == ("other_variant", "n = 1")


def test_rows_that_are_missing_are_refused_wherever_n_is_given(planmark, conveyor, tmp_path):
    table = tmp_path / "conveyor.csv"
    lines = table.read_text(encoding="utf-8").splitlines()
    table.write_text("\n".join(lines[:4] + lines[5:]) + "\n", encoding="utf-8")
    (tmp_path / "roster.csv").write_text("student_id,name,n\ns1,Ana,3\ns2,Ion,4\n", encoding="utf-8")
    (tmp_path / "m.csv").write_text("student_id,n,v_A\ns2,4,50\n", encoding="utf-8")
    (tmp_path / "in").mkdir()
    known = re.compile(r"n = 1\.\.3, 5\.\.15(, by | \()conveyor\.csv")
    for call in (
        ("plan", conveyor, "--n", 4, "--json"),
        ("check", conveyor, "--n", 4, "--measured", "m.csv"),
        ("sheet", conveyor, "--roster", "roster.csv", "--out", "sheets.pdf"),
        ("cycle", conveyor, "--n", 4),
    ):
        ran = planmark(*call)
        assert (ran.returncode, bool(known.search(ran.stderr))) == (2, True), (call, ran.stderr, ran.stdout)
    ran = planmark("grade", "in", "--assignment", conveyor, "--roster", "roster.csv", "--out", "out")
    assert (ran.returncode, bool(known.search(ran.stdout))) == (1, True), ran.stdout


def test_sheets_say_the_side_in_the_students_language(planmark, conveyor, tmp_path):
    (tmp_path / "roster.csv").write_text(
        "student_id,name,n,lang\ns1,Ana,1,en\ns9,Ion,9,ro\n", encoding="utf-8"
    )
    ran = planmark("sheet", conveyor, "--roster", "roster.csv", "--out", "sheets.pdf")
    assert ran.returncode == 0, ran.stderr

    texts = [page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(tmp_path / "sheets.pdf")]
    assert "on the left" in texts[0]
    assert "la dreapta" in texts[-1]


def test_position_0_at_a_dead_point_as_documented(conveyor):
    assert DEAD_POINT.strip() in re.sub(r"(?m)^    ", "", DOCS.read_text(encoding="utf-8"))
    text = conveyor.read_text(encoding="utf-8")
    text = re.sub(r"(?m)^\[variant.values\]\n", DEAD_POINT.lstrip(), text)
    text = text.replace("[variant]\n", "[variant]\nposition = { from = 0, to = 11 }\n").replace(
        '"phi"', '"phi_deg"'
    )
    conveyor.write_text(text, encoding="utf-8")
    mechanism = conveyor.with_name("conveyor.mechanism.toml")
    turned = mechanism.read_text(encoding="utf-8").replace('angle_deg = "phi"', 'angle_deg = "phi_deg"')
    mechanism.write_text(turned.replace('side = "side_B"', 'side = "left"'), encoding="utf-8")
    assignment = load_assignment(conveyor)
    first = [variant for variant in assignment.variants() if variant.position == 0]
    plan = exact_plan(assignment, first)
    assert plan.is_zero("v_B").all()
    assert np.abs(plan.rates["omega_3"]).max() < 1e-9 * np.abs(plan.mechanism.crank.omega).min()
    reach = np.abs(plan.motion.position["B"])
    found = cycle(assignment.mechanism(first[:1]))
    assert reach[0] == pytest.approx(np.abs(found.motion.position["B"]).max(), rel=1e-4)


def test_an_assignment_like_it_has_a_table_of_its_own(planmark, conveyor, tmp_path):
    assert planmark("new", "own/mine", "--like", conveyor).returncode == 0
    assert (tmp_path / "own" / "conveyor.csv").read_text() == (tmp_path / "conveyor.csv").read_text()
    assert (
        load_assignment(tmp_path / "own" / "mine.assignment.toml").variants()
        == load_assignment(conveyor).variants()
    )
    assert planmark("new", "second", "--like", conveyor).returncode == 0


def test_the_courses_own_files_in_the_folder_are_no_submissions(tmp_path, monkeypatch):
    Case("", "", "", "", "").write(tmp_path)
    for path in (tmp_path / "class").iterdir():
        path.rename(tmp_path / path.name)
    for name in ("decisions.csv", "ids.csv", "worksheet.csv"):
        (tmp_path / name).unlink()
    monkeypatch.chdir(tmp_path)
    CliRunner().invoke(app, "grade . --assignment course.assignment.toml --out marks -q".split())
    results = json.loads((tmp_path / "marks" / "results.json").read_bytes())
    assert results["unmatched"] == []
    assert [report["student_id"] for report in results["reports"]] == ["s01", "s02"]
