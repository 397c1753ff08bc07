"""``planmark plan --all``."""

import csv
import json

import jsonschema
import pypdfium2

from grader.cli.exporting import schema
from reference.authored.assignment import library


def test_all_variants_are_written_for_the_instructor(planmark, tmp_path):
    ran = planmark(
        "plan", "engine", "--all", "--csv", "e.csv", "--pdf", "e.pdf", "--no-drawings", "--lang", "ro"
    )
    assert (ran.returncode, ran.stderr) == (0, "")
    with (tmp_path / "e.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file, delimiter=";"))
    assert len(rows) == 25
    assert {len(row) for row in rows} == {len(rows[0])}
    document = pypdfium2.PdfDocument(tmp_path / "e.pdf")
    text = document[0].get_textpage().get_text_range()
    document.close()
    assert "Mecanism bielă-manivelă" in text


def test_the_plans_of_all_variants_as_json(planmark):
    documents = json.loads(planmark("plan", "press", "--all", "--json").stdout)
    assert [document["position"] for document in documents] == list(range(8))
    for document in documents:
        jsonschema.validate(document, schema("plan"))


def test_without_a_file_all_variants_are_a_table(planmark):
    lines = planmark("plan", "press", "--all").stdout.splitlines()
    assert not any("…" in line for line in lines)  # 80 columns are too few, and no number is cut
    row = next(line for line in lines if "position = 1 " in line)
    assert "46.40" in row
    assert "89.36" in row


def test_variants_that_cannot_be_solved_are_told_and_the_others_written(planmark, tmp_path):
    for kind in ("assignment", "mechanism", "rubric"):
        text = (library() / f"pump.{kind}.toml").read_text(encoding="utf-8")
        (tmp_path / f"own.{kind}.toml").write_text(text.replace("to = 30", "to = 70"), encoding="utf-8")
    ran = planmark("plan", "own.assignment.toml", "--all", "--csv", "own.csv")
    assert ran.returncode == 1
    assert ran.stdout.startswith("variants written to own.csv: 65")
    assert "the group of B does not assemble" in ran.stderr
    assert "n = 66..70" in ran.stderr
    with (tmp_path / "own.csv").open(encoding="utf-8", newline="") as file:
        assert [row["n"] for row in csv.DictReader(file)] == [str(n) for n in range(1, 66)]


def test_where_no_variant_can_be_solved_nothing_is_written(planmark, tmp_path):
    planmark("new", "own")
    path = tmp_path / "own.mechanism.toml"
    text = path.read_text(encoding="utf-8").replace("lengths = [40, 30]", "lengths = [4, 3]")
    path.write_text(text, encoding="utf-8")
    ran = planmark("plan", "own.assignment.toml", "--all", "--csv", "own.csv")
    assert ran.returncode == 3
    assert "no variant can be solved" in ran.stderr
    assert not (tmp_path / "own.csv").exists()
