"""``planmark plan --all``."""

import csv
import json

import jsonschema
import pypdfium2
import pytest

from grader.documents import schema


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
    row = next(line for line in lines if "position = 1 " in line)
    assert "46.40" in row
    assert "89.36" in row


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ("pump --all --n 3", "--n one of them"),
        ("press --all --position 3", "--position one of them"),
        ("pump --all --svg x.svg", "--pdf"),
        ("pump --n 3 --csv x.csv", "add --all"),
        ("pump --all --csv x.csv --lang de", "known are en, ro, ru"),
        ("pump --all --crank-mm -3", "above 0"),
    ],
)
def test_a_call_for_all_and_for_one_is_refused(planmark, tmp_path, call, words):
    ran = planmark("plan", *call.split())
    assert ran.returncode == 2
    assert words in ran.stderr
    assert not list(tmp_path.iterdir())
