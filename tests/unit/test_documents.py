"""Documents: their schemas hold what is written, and nothing else."""

import json

import jsonschema
import pytest
from pydantic import ValidationError

from grader.cli.exporting import MODELS, WRITTEN, schema
from grader.comparison.evidence import Submission
from grader.documents import (
    SCHEMA_VERSION,
    MeasurementsDocument,
    ReportDocument,
    ResultsDocument,
    SheetDocument,
)
from grader.marking.mark import judge
from grader.marking.report import report_of, unjudged_report
from grader.records import Reason
from reference.construction.mistakes import Mistake
from reference.errors import CallError
from tests.hands import changed, measured, task_for

PUMP = task_for("pump", 7)
PRESS = task_for("press", position=1)


@pytest.mark.parametrize("name", [*MODELS, *WRITTEN])
def test_every_schema_is_one(name):
    jsonschema.Draft202012Validator.check_schema(schema(name))
    assert schema(name)["$id"] == f"urn:planmark:{name}:{SCHEMA_VERSION}"


def test_an_unknown_schema_is_a_wrong_call():
    with pytest.raises(CallError, match="measurements, reading, report"):
        schema("reprot")


def report(task, reading, **more):
    judgement = judge(task, Submission(measured=reading, **more))
    return report_of(task, judgement, "s07", language="ro", sentences={"v_A": "Corect."})


@pytest.mark.parametrize("task", [PUMP, PRESS], ids=["pump", "press"])
def test_a_report_holds_to_its_schema_and_comes_back_the_same(task):
    written = report(task, measured(task), declared={"kv": "0.036"})
    text = written.model_dump_json()
    jsonschema.validate(json.loads(text), schema("report"))
    assert ReportDocument.model_validate_json(text) == written
    results = ResultsDocument(assignment=task.assignment.id, reports=[written])
    jsonschema.validate(json.loads(results.model_dump_json()), schema("results"))


def test_a_report_says_who_what_and_how_much():
    written = report(PUMP, measured(PUMP))
    assert (written.student_id, written.assignment, written.variant, written.position) == (
        "s07",
        "pump",
        {"n": 7},
        None,
    )
    assert (written.status, written.score, written.score_range, written.max_score) == (
        "graded",
        PUMP.rubric.max_score,
        (PUMP.rubric.max_score, PUMP.rubric.max_score),
        PUMP.rubric.max_score,
    )
    by_id = {one.id: one for one in written.criteria}
    assert by_id["v_A"].feedback == "Corect."
    assert by_id["v_A"].title == "Viteza punctului A"
    assert by_id["v_A"].vector == "v_A"
    assert by_id["kv"].vector is None
    assert by_id["omega_3"].points is None
    assert written.scales["kv"].assumed
    assert report(PRESS, measured(PRESS)).variant == {}


def test_a_report_under_review_has_no_score_but_a_range():
    written = report(PUMP, changed(measured(PUMP), "v_D", confidence=0.5), declared={"kv": "0.2"})
    assert (written.status, written.score) == ("needs_review", None)
    assert written.score_range[0] < written.score_range[1]
    assert [one.code for one in written.problems] == ["scale_refused"]


def test_a_mistake_is_in_the_report_with_what_it_explains():
    made = measured(PUMP, mistakes=(Mistake("wrong_link", "b", 1, other=("C", "D")),))
    written = report(PUMP, made)
    assert [(one.code, one.at, one.detail) for one in written.mistakes] == [
        ("wrong_link", "b", "other = CD, from = o, link = O2B")
    ]
    rotated = measured(PUMP, mistakes=(Mistake("figure_rotated", "velocity_plan", quarters=1),))
    assert report(PUMP, rotated).mistakes[0].detail == "degrees = 90"


def test_a_report_of_nothing_has_its_reason():
    problem = Reason("not_an_image", {"detail": "cannot be opened"}, "s07.png")
    written = unjudged_report(
        PUMP.assignment, PUMP.rubric, PUMP.variant, "s07", "unreadable", problems=[problem]
    )
    assert (written.status, written.score, written.score_range, written.max_score) == (
        "unreadable",
        None,
        None,
        PUMP.rubric.max_score,
    )
    assert written.problems[0].file == "s07.png"
    jsonschema.validate(json.loads(written.model_dump_json()), schema("report"))


def test_documents_refuse_what_they_do_not_know_and_what_is_not_finite():
    with pytest.raises(ValidationError):
        MeasurementsDocument(segments={"v_A": 1.0})
    with pytest.raises(ValidationError):
        SheetDocument(method="markers", px_per_mm=float("nan"), rotation_deg=0, residual_mm=0, mm_to_px=[])


def test_every_reason_and_problem_has_its_code_its_message_and_its_parameters():
    written = report(PUMP, changed(measured(PUMP), "v_D", confidence=0.5), declared={"kv": "0,22"})
    for one in written.criteria:
        assert [reason.code for reason in one.why] == one.reasons
        assert all(reason.message for reason in one.why)
    (refused,) = (one for one in written.problems if one.code == "scale_refused")
    assert (refused.parameters["why"], refused.parameters["scale"]) == ("no_unit", "kv")
    assert "no unit" in refused.message
    assert written.scales["kv"].refused.startswith("“0.22” has no unit")
