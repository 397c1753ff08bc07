"""A drawing replayed: the account that costs least is how it was made."""

from dataclasses import replace

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.construction.graph import evaluate
from reference.construction.mistakes import Drawing, Mistake, commit
from reference.construction.uncertainty import Skill, acts
from reference.plan import exact_plan
from reference.replay.explanations import Observation, Observations
from reference.replay.replay import Root, replay

USUAL = Skill(angle_deg=0.3, place_mm=0.25, mark_mm=0.1)
READ_MM2 = (0.02, 0.0, 0.02)
CARES = (0.6, 1.0, 1.6, 2.5, 4.0)
SURE_COST = 10.0
"""Least extra cost of the next explanation: odds of 150 to one."""


def pump(n: int = 7) -> Drawing:
    assignment = load_assignment("pump")
    drawing = exact_plan(assignment, [assignment.variant(n, None)]).drawing
    known = {name: np.asarray(np.ravel(value)[0]) for name, value in drawing.parameters.items()}
    return Drawing(drawing.construction, known)


def drawn(drawing: Drawing, *mistakes: Mistake, care: float = 0.0, seed: int = 1) -> dict[str, complex]:
    """The nodes as a hand draws them, so many times as careless as a usual one."""
    for mistake in mistakes:
        drawing = commit(mistake, drawing)
    lot = np.random.default_rng(seed)
    errors = {
        act: np.asarray(care * USUAL.deviation(act[2]) * lot.standard_normal())
        for act in acts(drawing.construction)
    }
    nodes = evaluate(drawing.construction, drawing.parameters, errors=errors)
    return {name: complex(place) for name, place in nodes.items()}


def nodes_of(drawing: Drawing, places: dict[str, complex]) -> Observations:
    given = {*drawing.construction.poles.values(), "O1", "O2"}
    return Observations(
        tuple(Observation(name, None, at, READ_MM2) for name, at in places.items() if name not in given)
    )


def lengths_of(drawing: Drawing, places: dict[str, complex], spread_mm2: float = 0.15) -> Observations:
    spread = (spread_mm2, 0.0, spread_mm2)
    return Observations(
        tuple(
            Observation(
                one.head, one.tail, abs(places[one.head] - places[one.tail]), spread, has_direction=False
            )
            for one in drawing.construction.vectors.values()
        )
    )


SINGLE = [
    Mistake("parallel_for_perpendicular", "b", 0),
    Mistake("wrong_link", "d", 0, other=("A", "B")),
    Mistake("normal_missing", "n_B"),
    Mistake("normal_reversed", "n_DC"),
    Mistake("normal_from_absolute", "n_BA"),
    Mistake("wrong_intersection", "b'", 1, other=("o'",)),
    Mistake("image_mirrored", "c"),
    Mistake("other_assembly", "B"),
]


@pytest.mark.parametrize("mistake", SINGLE, ids=lambda one: f"{one.code} at {one.at}")
@pytest.mark.parametrize("care", [0.0, 1.0])
def test_the_cheapest_account_of_nodes_names_what_was_done(mistake, care):
    right = pump()
    accounts = replay(right, nodes_of(right, drawn(right, mistake, care=care)), [Root()], USUAL, cares=CARES)
    assert [(one.code, one.at) for one in accounts[0].made] == [(mistake.code, mistake.at)]
    assert not accounts[0].unexplained
    innocent = [one.cost for one in accounts if one.is_innocent]
    assert min(innocent, default=np.inf) > accounts[0].cost + SURE_COST


def test_three_mistakes_in_three_steps_do_not_hide_each_other():
    right = pump()
    made = (SINGLE[0], SINGLE[3], SINGLE[5])
    best = replay(right, nodes_of(right, drawn(right, *made, care=0.7)), [Root()], USUAL, cares=CARES)[0]
    assert {(one.code, one.at) for one in best.made} == {(one.code, one.at) for one in made}


@pytest.mark.parametrize("care", [0.5, 1.0, 3.0])
def test_a_right_drawing_is_innocent_by_the_hand_that_drew_it(care):
    right = pump()
    for seed in range(12):
        work = nodes_of(right, drawn(right, care=care, seed=seed))
        best = replay(right, work, [Root()], USUAL, cares=CARES)[0]
        assert best.is_innocent
        assert care / 2.0 <= best.care <= 2.0 * care


def test_lengths_alone_tell_a_reversed_normal_component_by_what_follows():
    right = pump()
    work = lengths_of(right, drawn(right, Mistake("normal_reversed", "n_B")))
    best = replay(right, work, [Root()], USUAL, blind=True)[0]
    assert [(one.code, one.at) for one in best.made] == [("normal_reversed", "n_B")]


def test_a_slip_is_told_with_its_factor():
    right = pump()
    made = Mistake("arithmetic", "n_B", factor=1.4)
    best = replay(right, nodes_of(right, drawn(right, made)), [Root()], USUAL)[0]
    assert [(one.code, one.at) for one in best.made] == [("arithmetic", "n_B")]
    assert best.made[0].factor == pytest.approx(1.4, rel=0.02)


def test_what_no_known_mistake_makes_is_something_else():
    right = pump()
    places = drawn(right)
    moved = {**places, "d'": places["d'"] + complex(9.0, 14.0)}
    best = replay(right, nodes_of(right, moved), [Root()], USUAL)[0]
    assert best.unexplained == ("d'",)
    assert not best.made


def test_a_plan_turned_as_a_whole_is_one_mistake():
    right = pump()
    turned = Mistake("figure_rotated", "acceleration_plan", quarters=1)
    root = Root((turned,), turned={"acceleration_plan": 1j}, cost=14.0)
    best = replay(right, nodes_of(right, drawn(right, turned)), [Root(), root], USUAL)[0]
    assert best.made == (turned,)


def test_a_second_sketch_is_what_its_plan_is_drawn_from():
    right = pump()
    first = drawn(right)
    second = {name: first[name] for name in ("O1", "A", "O2", "B", "C", "D")}
    second["D"] += 1.5j
    velocities = {
        one.node: np.asarray(first[one.node]) for one in right.construction.figures["velocity_plan"]
    }
    joints = {name: np.asarray(place) for name, place in second.items()}
    again = evaluate(right.construction, right.parameters, given={**velocities, **joints})
    accelerations = [one.node for one in right.construction.figures["acceleration_plan"]]
    places = {**first, **{name: complex(again[name]) for name in accelerations}}
    seen = nodes_of(right, places).entries
    beside = replay(right, Observations(seen, {"acceleration_plan": second}), [Root()], USUAL)[0]
    without = replay(right, Observations(seen), [Root()], USUAL)[0]
    assert beside.is_innocent
    assert beside.cost < without.cost - SURE_COST


def test_errors_of_measured_nodes_are_passed_on_to_what_is_drawn_from_them():
    right = pump()
    places = drawn(right)
    rough = {**places, "n_DC": places["n_DC"] + 1.5 + 1.0j}
    seen = nodes_of(right, rough).entries
    measured = tuple(replace(one, spread=(1.0, 0.0, 1.0)) if one.node == "n_DC" else one for one in seen)
    exact, passed_on = (
        replay(right, Observations(entries), [Root()], USUAL)[0].right["d'"] for entries in (seen, measured)
    )
    assert passed_on < 0.7 * exact


def test_errors_of_a_sketch_that_was_not_handed_in_are_passed_on():
    right = pump()
    places = drawn(right)
    moved = {**places, "b": places["b"] + 2.0}
    plans = tuple(one for one in nodes_of(right, moved).entries if one.node[0].islower())
    off_rad = {("A", "B"): 0.05, ("O2", "B"): 0.05}
    known, unknown = (
        replay(right, Observations(plans, directions_rad=one), [Root()], USUAL)[0].right["b"]
        for one in ({}, off_rad)
    )
    assert unknown < 0.5 * known


def test_what_an_observation_costs_is_added_to_every_explanation():
    right = pump()
    seen = nodes_of(right, drawn(right))
    plain, dear = (replay(right, replace(seen, cost=cost), [Root()], USUAL)[0].cost for cost in (0.0, 7.0))
    assert dear == pytest.approx(plain + 7.0)
