"""Laws that hold for every score."""

import cmath
import json

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from grader.comparison.criteria import compare
from grader.comparison.evidence import Submission
from grader.documents import Quantity, ResultsDocument, Tolerance
from grader.lms.assessments import documents, rubric_document
from grader.marking.mark import judge, score
from grader.marking.report import report_of
from grader.outcomes import Judgement, Outcome
from grader.records import Figure, Reading, ReadNode
from grader.rubric import RubricFile, WeightsTable
from reference.construction.mistakes import Mistake
from tests.examples import examples
from tests.hands import sheet, task_for
from tests.unit.comparison.rubrics import with_rubric

PUMP = task_for("pump", 7)
NODES = [step.node for plan in PUMP.construction.poles for step in PUMP.construction.figures[plan][1:]]
FEW = 12
nodes = st.sampled_from(NODES)
angles = st.floats(-3.14, 3.14)
verdicts = st.sampled_from(["full", "follow_through", "partial", "none", "not_judged", "review"])


def total(task, reading):
    found = judge(task, Submission(readings=(reading,))).score
    return found.low, found.high


@given(nodes, angles, st.lists(st.floats(0.1, 12.0), min_size=3, max_size=3))
@example("c'", -0.2, [1.25, 2.0, 2.3254945585944586])
@settings(max_examples=examples(FEW))
def test_without_following_through_a_score_never_rises_when_a_node_gets_worse(node, angle, distances):
    task = with_rubric(PUMP, follow_through=False)
    # A person is asked where another's data fit too, which a node that is farther off may rule out again: of
    # the points that are certain, the law holds without that question.
    unasked = with_rubric(task, doubt=PUMP.rubric.doubt.model_copy(update={"other_variant": "follow"}))
    drawn = [0j, *(distance * cmath.exp(1j * angle) for distance in sorted(distances))]
    sheets = [sheet(task, moved={node: by}) for by in drawn]
    low, high = [total(unasked, one)[0] for one in sheets], [total(task, one)[1] for one in sheets]
    assert low == sorted(low, reverse=True)
    assert high == sorted(high, reverse=True)


@given(st.dictionaries(nodes, st.complex_numbers(max_magnitude=30.0), max_size=4))
@settings(max_examples=examples(FEW))
def test_with_following_through_a_score_is_never_lower_than_without_nor_above_full_marks(moved):
    reading = sheet(PUMP, moved=moved)
    (low, high), (strict_low, strict_high) = (
        total(PUMP, reading),
        total(with_rubric(PUMP, follow_through=False), reading),
    )
    assert strict_low <= low + 1e-9
    assert strict_high <= high + 1e-9
    assert high <= PUMP.rubric.max_score


def shifted(reading, by):
    """Each figure somewhere else on the paper, its pole with it."""
    figures = {
        name: Figure(
            {
                node: ReadNode(one.at + by[name], one.cov, one.confidence)
                for node, one in figure.nodes.items()
            },
            figure.vectors,
        )
        for name, figure in reading.figures.items()
    }
    return Reading(figures)


places = st.complex_numbers(max_magnitude=200.0)


@given(
    st.fixed_dictionaries(dict.fromkeys(("mechanism", "velocity_plan", "acceleration_plan"), places)), nodes
)
@settings(max_examples=examples(FEW))
def test_the_same_drawing_elsewhere_on_the_paper_with_other_poles_has_the_same_mark(by, node):
    reading = sheet(PUMP, moved={node: 5.0 + 3.0j}, mistakes=(Mistake("normal_missing", "n_B"),))
    assert total(PUMP, shifted(reading, by)) == pytest.approx(total(PUMP, reading))


@given(st.randoms(use_true_random=False), nodes)
@settings(max_examples=examples(FEW))
def test_the_order_of_criteria_does_not_matter(lot, node):
    reading = sheet(PUMP, moved={node: 4.0 - 4.0j})
    criteria = list(PUMP.rubric.criterion)
    lot.shuffle(criteria)
    mixed = with_rubric(PUMP, criterion=criteria)
    found, other = (compare(task, Submission(readings=(reading,))).outcomes for task in (PUMP, mixed))
    assert {one.criterion: one for one in found} == {one.criterion: one for one in other}


def outcome(criterion, verdict):
    ends = ("none", "full") if verdict == "review" else (verdict, verdict)
    return Outcome(criterion.id, criterion.name, verdict, Quantity(), Quantity(), Tolerance(), 1.0, (), ends)


all_verdicts = st.lists(verdicts, min_size=len(PUMP.rubric.criterion), max_size=len(PUMP.rubric.criterion))
section_weights = st.dictionaries(st.sampled_from(sorted(PUMP.rubric.sections)), st.floats(0.5, 50.0))


@given(all_verdicts, section_weights)
def test_weights_give_a_section_what_they_say_and_missing_ones_are_scaled(found, weights):
    rubric: RubricFile = PUMP.rubric.model_copy(update={"weights": WeightsTable(**weights)})
    for section, weight in weights.items():
        own = [rubric.points[one.id] for one in rubric.criterion if one.section == section]
        assert sum(own) == pytest.approx(weight)
    outcomes = [outcome(one, verdict) for one, verdict in zip(rubric.criterion, found, strict=True)]
    counted = score(rubric, outcomes)
    assert 0.0 <= counted.low <= counted.high <= rubric.max_score * (1.0 + 1e-9)
    judged = [one for one in found if one != "not_judged"]
    if judged and set(judged) <= {"full", "follow_through"}:
        assert counted.total == pytest.approx(rubric.max_score)
    if judged and set(judged) == {"none"}:
        assert counted.total == 0.0


@given(all_verdicts, section_weights)
@settings(max_examples=examples(FEW))
def test_a_score_is_the_sum_of_an_assessments_points_times_their_factors(found, weights):
    task = with_rubric(PUMP, weights=WeightsTable(**weights))
    outcomes = [outcome(one, verdict) for one, verdict in zip(task.rubric.criterion, found, strict=True)]
    counted = score(task.rubric, outcomes)
    report = report_of(task, Judgement(tuple(outcomes), (), {}, counted), "s1")
    kept = rubric_document(PUMP.assignment, task.rubric)
    told = documents(ResultsDocument(assignment="pump", rubric=kept, reports=[report]))["assessments.json"]
    (one,) = json.loads(told)["assessments"]
    points = sum((row["points"] or 0.0) * row["factor"] for row in one["criteria"])
    assert points == pytest.approx(counted.low, abs=1e-3)
    assert one["score"] == counted.total
