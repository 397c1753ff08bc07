"""Laws that hold for every submission, however odd."""

import json

import jsonschema
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from grader.cli.exporting import schema
from grader.comparison.evidence import Submission
from grader.marking.mark import judge
from grader.marking.report import report_of
from grader.records import Figure, Reading, ReadVector
from reference.construction.mistakes import Mistake, line_of
from tests.examples import examples
from tests.hands import changed, measured, sheet, task_for

TASKS = (task_for("pump", 7), task_for("press", position=0), task_for("pump-collinear", 16))
SCHEMA = schema("report")

lengths = st.floats(0.0, 2000.0)
degrees = st.floats(0.0, 360.0, exclude_max=True)
vectors = st.builds(
    ReadVector,
    length_mm=st.none() | lengths,
    se_mm=st.floats(0.0, 5.0),
    direction_deg=st.none() | degrees,
    se_deg=st.none() | st.floats(0.0, 90.0),
    confidence=st.floats(0.0, 1.0),
)
scales = st.sampled_from(
    ["", "1:5", "0.2", "0.2 (m/s)/mm", "1e-9 (m/s)/mm", "1e9 m/s2·mm", "ω²kL", "kv = omega kL"]
)
finite = st.floats(allow_nan=False, allow_infinity=False)


ONE_VECTOR_AND_A_HUGE_VALUE = Submission(
    measured=Reading({"acceleration_plan": Figure({}, {"a_BA_n": ReadVector(192.5, 7.0, 308.6, 0.0, 0.9)})}),
    values={"omega_3": 4e236},
)


@st.composite
def submissions(draw):
    number = draw(st.sampled_from(range(len(TASKS))))
    task = TASKS[number]
    figures = {}
    for plan in task.construction.poles:
        names = [vector.name for vector in task.construction.vectors_of(plan)]
        figures[plan] = Figure({}, draw(st.dictionaries(st.sampled_from(names), vectors)))
    values = st.dictionaries(st.sampled_from([*task.real, *task.rates]), finite, max_size=4)
    declared = draw(st.dictionaries(st.sampled_from(["kL", "kv", "ka"]), scales))
    # A whole task in the case would be written out with each example.
    return number, Submission(measured=Reading(figures), values=draw(values), declared=declared)


@given(submissions())
@example((1, ONE_VECTOR_AND_A_HUGE_VALUE))
def test_every_submission_is_judged_and_its_report_holds_to_the_schema(case):
    number, submission = case
    task = TASKS[number]
    judgement = judge(task, submission)
    score = judgement.score
    assert 0.0 <= score.low <= score.high <= score.maximum
    assert (score.total is None) or (score.low == score.high == score.total)
    assert {one.criterion for one in judgement.outcomes} == {one.id for one in task.rubric.criterion}
    report = report_of(task, judgement, "s01")
    jsonschema.validate(json.loads(report.model_dump_json()), SCHEMA)


@given(st.floats(-180.0, 180.0), st.floats(0.5, 2.0))
def test_marks_do_not_depend_on_the_sheets_turn_and_the_scale_drawn_at(turn_deg, factor):
    task = TASKS[0]
    own = {name: float(task.parameters[name]) / factor for name in ("kL", "kv", "ka")}
    declared = {"kL": f"{own['kL']!r} m/mm", "kv": f"{own['kv']!r} m/s/mm", "ka": f"{own['ka']!r} m/s2/mm"}
    reading = sheet(task, own, turn_deg=turn_deg)
    judgement = judge(task, Submission(readings=(reading,), declared=declared))
    assert judgement.score.total == judgement.score.maximum


@settings(max_examples=examples(8))
@given(st.sampled_from(["v_A", "v_B", "v_D", "a_B", "a_D"]), st.floats(2.2, 20.0))
def test_a_larger_error_never_gives_a_better_mark(name, off_mm):
    task = TASKS[0]
    right = measured(task)
    plan = "velocity_plan" if name.startswith("v") else "acceleration_plan"
    length = right.figures[plan].vectors[name].length_mm
    totals = [
        judge(task, Submission(measured=changed(right, name, length_mm=length + share * off_mm))).score.high
        for share in (0.0, 0.3, 0.6, 1.0)
    ]
    assert totals == sorted(totals, reverse=True)


@pytest.mark.parametrize(
    ("node", "slot"), [("b", 0), ("b", 1), ("c", 0), ("c", 1), ("d", 0), ("b'", 0), ("c'", 1)]
)
def test_a_wrong_line_costs_the_vector_on_it_and_nothing_below(node, slot):
    task = TASKS[0]
    mistake = Mistake("parallel_for_perpendicular", node, slot)
    judgement = judge(task, Submission(readings=(sheet(task, mistakes=(mistake,)),)))
    construction = task.construction
    line = (construction.step(node).first, construction.step(node).second)[slot]
    on_it = {one.name for one in construction.vectors.values() if line_of(one, construction) == line}
    lost = {one.name for one in judgement.outcomes if one.verdict in {"none", "partial"}}
    assert lost == {name for name in on_it if construction.vectors[name].head == node}
