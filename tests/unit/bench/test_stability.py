"""The stability table: outcomes are told apart, distances are as asked, fsolve is asked fairly."""

import math
from statistics import median

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.kinematics.motion import move
from tests.bench.peers import Answer, Fsolve, NoAnswerError, error_of, one_of, plain_of, sketch, stacked
from tests.bench.singular import KINDS
from tests.bench.speed import spread
from tests.bench.stability import EPSILON, Outcomes, _count, measure_stability, truth_of

PEER_ERROR = 1e-6
"""fsolve stops its iteration there."""
PLAIN = [kind for kind in KINDS if kind.plain]


def case_of(kind, delta=0.1, seed=5):
    return kind.draw(np.random.default_rng(seed), delta)


def right(truth):
    return Answer(truth.position, truth.velocity, truth.acceleration)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.id)
@pytest.mark.parametrize("delta", [1e-1, 1e-8, 1e-14])
def test_a_case_lies_at_about_the_distance_asked_for(kind, delta):
    assert case_of(kind, delta).delta == pytest.approx(delta, rel=0.1)


def test_the_right_answer_has_no_error_and_its_unit_is_the_one_given():
    truth = truth_of(case_of(KINDS[0]).mechanism)
    off = {joint: rate * (1.0 + 1e-10) for joint, rate in truth.velocity.items()}
    outcomes = Outcomes()
    _count(outcomes, right(truth), truth, EPSILON)
    _count(outcomes, Answer(truth.position, off, truth.acceleration), truth, 1e-10)
    assert outcomes.velocity == [0.0, pytest.approx(1.0, rel=1e-5)]
    assert outcomes.wrong == outcomes.refused == outcomes.silent == 0


@pytest.mark.parametrize(
    "kind", [kind for kind in KINDS if kind.id[:3] in ("rrr", "rrp", "rpr")], ids=lambda k: k.id
)
def test_the_mirrored_assembly_is_a_wrong_branch(kind):
    truth = truth_of(case_of(kind).mechanism)
    outcomes = Outcomes()
    _count(outcomes, Answer(truth.mirrored, truth.velocity, truth.acceleration), truth, EPSILON)
    assert (outcomes.wrong, outcomes.velocity) == (1, [])


def test_an_error_larger_than_the_one_predicted_is_counted():
    truth = truth_of(case_of(KINDS[0]).mechanism)
    off = {joint: rate * (1.0 + 1e-10) for joint, rate in truth.velocity.items()}
    outcomes = Outcomes()
    for predicted in (1e-9, 1e-11, None):
        _count(outcomes, Answer(truth.position, off, truth.acceleration, predicted), truth, EPSILON)
    assert (outcomes.beyond, len(outcomes.velocity)) == (1, 3)


def test_nan_is_silent_and_a_refusal_is_told():
    truth = truth_of(case_of(KINDS[0]).mechanism)
    nothing = {joint: complex(math.nan) for joint in truth.velocity}
    outcomes = Outcomes()
    _count(outcomes, Answer(truth.position, nothing, nothing), truth, EPSILON)
    _count(outcomes, None, truth, EPSILON)
    assert (outcomes.silent, outcomes.refused, outcomes.velocity) == (1, 1, [])
    assert math.isnan(error_of(nothing, truth.velocity))


def test_ours_is_never_on_a_wrong_branch_nor_silent_and_its_usual_error_is_below_the_conditioning():
    for row in measure_stability(quick=True, kinds=PLAIN[:3]):
        for ours in (row.outcomes["closed form"], row.outcomes["on arrays"]):
            assert ours.wrong == ours.silent == ours.refused == 0
            assert max(median(ours.velocity), median(ours.acceleration)) <= 1.0


def test_fsolve_solves_the_pump_as_the_closed_form_does():
    mechanism = spread(load_assignment("pump"), 3)
    motion = move(mechanism)
    starts = sketch(mechanism, motion.position)
    solver = Fsolve(mechanism)
    for index in range(3):
        start = {joint: complex(places[index]) for joint, places in starts.items()}
        answer = solver.solve(index, start)()
        for found, ours in (
            (answer.position, motion.position),
            (answer.velocity, motion.velocity),
            (answer.acceleration, motion.acceleration),
        ):
            assert error_of(found, {joint: complex(at[index]) for joint, at in ours.items()}) <= PEER_ERROR


def test_a_mechanism_without_a_plain_form_is_no_answer():
    slotted = next(kind for kind in KINDS if not kind.plain)
    with pytest.raises(NoAnswerError, match="no plain form of SlottedLink"):
        plain_of(case_of(slotted).mechanism)


def test_a_sketch_shows_the_side_plainly():
    case = case_of(PLAIN[0], 1e-12)
    truth = truth_of(case.mechanism)
    start = sketch(case.mechanism, {joint: np.array([z]) for joint, z in truth.position.items()})
    assert abs(start["B"][0] - truth.position["B"]) < abs(start["B"][0] - truth.mirrored["B"])
    assert abs(truth.position["B"] - truth.mirrored["B"]) < 1e-4 * abs(start["B"][0] - truth.position["B"])


def test_variants_put_together_can_be_taken_out_again():
    cases = [case_of(PLAIN[0], seed=seed).mechanism for seed in (1, 2, 3)]
    together = stacked(cases)
    assert together.crank.length_m.shape == (3,)
    again = one_of(together, 1, np.atleast_1d)
    assert again.ground_m == cases[1].ground_m
    assert again.groups[0].lengths_m == cases[1].groups[0].lengths_m
    assert float(again.groups[0].side[0]) == cases[1].groups[0].side
