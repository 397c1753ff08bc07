"""Reports and results of earlier versions load, are exported, and regraded against."""

import json
import shutil
from pathlib import Path

import jsonschema
import pytest

from grader.cli.exporting import schema
from grader.documents import ReportDocument, ResultsDocument
from grader.folder.batch import Batch, grade
from grader.lms.export import export, read_results
from grader.lms.grades import Options
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment
from reference.errors import InputFileError
from tests.inline import Inline

HERE = Path(__file__).parent
FOLDERS = sorted(path.parent for path in HERE.glob("*/results.json"))
GRADED = [folder for folder in FOLDERS if folder.name > "2026-11-21-0227"]
SAMPLE = Path(__file__).parents[3] / "samples" / "pump" / "s08.json"
each = pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
each_graded = pytest.mark.parametrize("folder", GRADED, ids=lambda folder: folder.name)


def told(folder):
    return json.loads((folder / "results.json").read_bytes())


def test_there_are_results_of_earlier_versions():
    assert len(FOLDERS) == 2
    assert GRADED


@each
def test_results_of_an_earlier_version_load_with_nothing_lost(folder):
    results = read_results(folder)
    again = results.model_dump(mode="json")
    for before, after in zip(told(folder)["reports"], again["reports"], strict=True):
        assert holds(after, before)


def holds(after, before):
    """Return whether everything there before is still there; keys may have been added."""
    if isinstance(before, dict):
        return all(key in after and holds(after[key], one) for key, one in before.items())
    if isinstance(before, list):
        return len(after) == len(before) and all(map(holds, after, before))
    return after == before


@each
def test_what_an_earlier_version_wrote_holds_to_its_own_schema_and_loaded_to_todays(folder):
    today = jsonschema.Draft202012Validator(schema("results"))
    own = told(folder)
    # Keys that were added since stand in every document of today, and in no earlier one.
    full = ResultsDocument.model_validate(own).model_dump(mode="json")
    assert not list(today.iter_errors(full))
    for published in folder.glob("results.schema.json"):
        jsonschema.validate(own, json.loads(published.read_bytes()))


@each
def test_a_report_of_an_earlier_version_loads_by_itself(folder):
    for one in told(folder)["reports"]:
        assert ReportDocument.model_validate_json(json.dumps(one)).student_id == one["student_id"]


@each_graded
@pytest.mark.parametrize("to", ["csv", "moodle", "canvas", "gradescope", "lti"])
def test_results_of_an_earlier_version_are_exported(folder, to, tmp_path):
    delivery = export(read_results(folder), tmp_path / "export.zip", Options(to=to))
    assert "s08" in delivery.written


@each
def test_a_regrade_says_what_moved_against_an_earlier_version(folder, tmp_path):
    (tmp_path / "in").mkdir()
    shutil.copy(SAMPLE, tmp_path / "in" / "s08.json")
    out = tmp_path / "out"
    out.mkdir()
    shutil.copy(folder / "results.json", out / "results.json")
    pump = load_assignment("pump")
    results = grade(Batch(pump, rubric_of(pump), tmp_path / "in", out), lambda *_: None, Inline())
    before = {one.student_id: one.before for one in results.moved}
    now = {report.student_id: report.score for report in results.reports}
    gone = {one["student_id"] for one in told(folder)["reports"]} - {"s08"}
    assert gone <= set(before)
    was = next(one for one in told(folder)["reports"] if one["student_id"] == "s08")
    assert ("s08" in before) == ((was["status"], was["score"]) != ("graded", now["s08"]))


# Versions to come ---------------------------------------------------------------------------------


def test_results_of_a_later_version_are_refused_with_what_to_do(tmp_path):
    (tmp_path / "results.json").write_text('{"schema_version": 2, "assignment": "pump", "reports": []}')
    with pytest.raises(InputFileError, match=r"schema_version 2, known is 1.*update planmark"):
        read_results(tmp_path)
