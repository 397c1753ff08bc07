"""Normal components drawn by the right triangle at scales that do not allow it, and other slips beside it."""

import pytest

from grader.marking.mark import judge
from reference.construction.mistakes import Mistake
from samples.simulation.wording import declared_texts
from tests.hands import SOURCES, drawn_nodes, handed_in, rule_scales, task_for

SCALED = [
    ("press", 1, {}, ("n_BA", "n_B", "n_DC")),
    ("pump", None, {"ka": 1.25}, ("n_B", "n_DC")),
    ("shaper", None, {"ka": 1.5}, ("n_A3", "n_ED")),
    ("piston", None, {"kv": 0.8}, ("n_AB", "n_A")),
]
"""Task, position, the student's own scales as multiples of the assignment's, normal components."""


def of(name, position):
    return task_for(name, None if position else 7, position)


def own_scales(task, factors):
    return {scale: value * factors.get(scale, 1.0) for scale, value in rule_scales(task).items()}


def ratio_of(scales):
    return scales["kL"] * scales["ka"] / scales["kv"] ** 2


def mistakes_in(task, scales, lengths, source):
    """The mistakes named where components are drawn so many times as long as they should be."""
    made = tuple(Mistake("arithmetic", node, factor=factor) for node, factor in lengths.items())
    submission = handed_in(task, drawn_nodes(task, scales, made), source, declared=declared_texts(scales))
    return judge(task, submission).mistakes


def causes(mistakes):
    return {one.at: one.detail.get("slip", one.code) for one in mistakes}


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize(("name", "position", "factors", "nodes"), SCALED, ids=str)
def test_a_component_by_the_triangle_is_named_alone_and_with_the_others(
    name, position, factors, nodes, source
):
    task = of(name, position)
    scales = own_scales(task, factors)
    ratio = ratio_of(scales)
    for some in (nodes[:1], nodes):
        found = mistakes_in(task, scales, dict.fromkeys(some, ratio), source)
        assert causes(found) == dict.fromkeys(some, "right_triangle")
        assert all(one.confidence > 0.6 for one in found)


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize(("name", "position", "factors", "nodes"), SCALED, ids=str)
def test_no_right_plan_is_accused_at_scales_that_do_not_allow_the_triangle(
    name, position, factors, nodes, source
):
    task = of(name, position)
    assert mistakes_in(task, own_scales(task, factors), dict.fromkeys(nodes, 1.0), source) == ()


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("factor", [0.1, 0.5, 0.8, 1.5, 2.0])
def test_another_factor_is_a_slip_of_unknown_cause(factor, source):
    """0.5 is a tenth from the press's own ratio, 0.556."""
    press = of("press", 1)
    (found,) = mistakes_in(press, rule_scales(press), {"n_B": factor}, source)
    assert (found.code, found.detail) == ("arithmetic", {"factor": pytest.approx(factor, rel=0.06)})
    assert not found.rivals


def test_where_the_ratio_is_that_of_a_usual_slip_both_are_named():
    """Once it is the slip, with the triangle as its rival; twice it is one cause rather than two slips."""
    pump = of("pump", None)
    scales = own_scales(pump, {"ka": 2.0})
    (found,) = mistakes_in(pump, scales, {"n_B": 2.0}, "sheet")
    assert found.detail == {"factor": 2.0}
    assert [one.detail for one in found.rivals] == [{"slip": "right_triangle"}]
    both = mistakes_in(pump, scales, {"n_B": 2.0, "n_DC": 2.0}, "sheet")
    assert causes(both) == {"n_B": "right_triangle", "n_DC": "right_triangle"}


def test_where_the_scales_allow_the_triangle_it_explains_nothing():
    pump = of("pump", None)
    (found,) = mistakes_in(pump, rule_scales(pump), {"n_B": 1.15}, "sheet")
    assert (found.code, found.detail) == ("arithmetic", {"factor": pytest.approx(1.15, rel=0.01)})
    assert not found.rivals


def test_what_follows_from_the_triangles_is_credited():
    press = of("press", 1)
    ratio = ratio_of(rule_scales(press))
    made = tuple(Mistake("arithmetic", node, factor=ratio) for node in ("n_BA", "n_B"))
    judgement = judge(press, handed_in(press, drawn_nodes(press, mistakes=made), "sheet"))
    verdicts = {one.name: one.verdict for one in judgement.outcomes}
    assert {name for name, verdict in verdicts.items() if verdict in {"none", "partial"}} == {
        "a_BA_n",
        "a_B_n",
    }
    assert verdicts["a_D"] == "follow_through"
