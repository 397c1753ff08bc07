"""Any mechanism can be drawn and told: letters clear, every node and number in words."""

from pathlib import Path

import numpy as np
from hypothesis import assume, given, reject
from hypothesis import strategies as st

from grader.language import tongue
from grader.solution.pages import html_page
from grader.solution.sentences import wording_of
from grader.solution.steps import explain
from reference.authored.assignment import Assignment, AssignmentFile
from reference.authored.mechanism import MechanismFile, check_mechanism
from reference.authored.toml_file import validate
from reference.drawing.canvas import Label
from reference.drawing.labels import lengths_inside, segments_of
from reference.drawing.sheets import reference_drawing
from reference.drawing.subject import Subject
from reference.errors import MechanismError
from reference.mechanism import Mechanism
from reference.plan import exact_plan
from tests.laws.mechanisms import authored

SCALES = {"crank_mm": 40, "kL": 0.03, "kv": 0.5, "ka": 20}
FIGURES = ["mechanism", "velocity_plan", "acceleration_plan"]
CLEARANCE_MM = 1e-6
"""Letters are placed clear of strokes by far more; no stroke passes under one by more than rounding."""
CROWDED = 0.01
"""On a sheet with hundreds of letters one in a hundred may find no free place; with fewer, none."""


def assignment_of(mechanism):
    table = authored(mechanism)
    file = validate(MechanismFile, table, "the mechanism")
    assume(not list(check_mechanism(file)))
    words = {"id": "any", "title": {"en": "Any"}, "task": {"en": "Draw it"}, "rubric": "any"}
    page = [{"kind": "all", "figures": FIGURES}]
    whole = {"schema_version": 1, **words, "mechanism": table, "scales": SCALES, "page": page}
    return Assignment(validate(AssignmentFile, whole, "the assignment"), file, Path("any"))


def planned(mechanism):
    assignment = assignment_of(mechanism)
    try:
        return assignment, exact_plan(assignment, assignment.variants())
    except MechanismError:
        reject()


@given(st.from_type(Mechanism))
def test_no_letter_of_a_sheet_lies_on_a_stroke_but_on_crowded_sheets_one_in_a_hundred(mechanism):
    assignment, plan = planned(mechanism)
    for sheet in reference_drawing(assignment, plan):
        if sheet.fits:
            boxes = np.array([shape.bounds for shape in sheet.shapes if isinstance(shape, Label)])
            inside = lengths_inside(boxes, segments_of(sheet.shapes), 0.0)
            assert np.count_nonzero(np.any(inside > CLEARANCE_MM, axis=1)) <= CROWDED * len(boxes)


@given(st.from_type(Mechanism), st.sampled_from(["en", "ro", "ru"]))
def test_every_step_is_told_and_pictured(mechanism, lang):
    assignment, plan = planned(mechanism)
    subject = Subject(assignment, plan, wording=wording_of(tongue(lang)))
    told = [step for section in explain(subject, tongue(lang)) for step in section.steps]
    assert [step.step for step in told][: len(plan.construction.steps)] == list(plan.construction.steps)
    assert not any("nan" in step.text for step in told)
    assert html_page(subject, tongue(lang)).count("<svg") >= len(plan.construction.steps)
