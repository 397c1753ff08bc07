"""The steps to draw again: from the wrong point on, all that depends on it, with or without numbers."""

import re

import pytest

from grader.feedback.redo_steps import redo
from grader.language import LANGUAGES, tongue
from grader.solution.sentences import wording_of
from reference.authored.assignment import load_assignment
from reference.construction.graph import ancestors, evaluate
from reference.drawing.subject import Subject
from reference.plan import exact_plan
from reference.quantities import group_of
from tests.drawn import loaded


def subject(name="pump", n=12, position=None, lang="en"):
    assignment = load_assignment(name)
    plan = exact_plan(assignment, [assignment.variant(n, position)])
    return Subject(assignment, plan, 0, wording_of(tongue(lang)))


def test_the_first_step_is_that_of_the_wrong_point():
    equation, first, *_ = redo(subject(), tongue("en"), "b", with_numbers=False)
    rows = ["\tv_B\t=\tv_A\t+\tv_BA", "size\t?\t\t✓\t\t?", "direction\t⊥ O2B\t\t✓\t\t⊥ AB"]
    assert equation == "\n".join(rows)
    drawn = "Through a draw a line perpendicular to AB, and through o a line perpendicular to O2B."
    assert first == f"{drawn} They meet in b."


@pytest.mark.parametrize("node", ["a", "b", "c", "d", "n_BA", "b'", "c'", "d'"])
def test_all_that_hangs_on_the_point_is_named_and_nothing_else(node):
    one = subject()
    construction = one.plan.construction
    hanging = {step.node for step in construction.steps if node in ancestors(construction, [step.node])}
    lines = redo(one, tongue("en"), node, with_numbers=False)
    ends = set(re.findall(r"(?:meet in|ends in|corner is) (\S+?)\.(?:\s|$)", " ".join(lines)))
    later = re.search(r"what follows from it: (.*)\.$", lines[-1])
    named = ends | set(later[1].split(", ") if later else [])
    assert named == hanging


@pytest.mark.parametrize("lang", LANGUAGES)
@pytest.mark.parametrize(
    ("name", "n", "position"), [("pump", 12, None), ("press", None, 1), ("shaper", 3, None)]
)
def test_without_numbers_no_step_says_one(name, n, position, lang):
    one = subject(name, n, position, lang)
    for step in one.plan.construction.steps:
        for line in redo(one, tongue(lang), step.node, with_numbers=False):
            assert not re.search(r"\d[.,]\d|\d\s*(?:mm|мм|°)", line.replace("90°", "")), line


@pytest.mark.parametrize("lang", LANGUAGES)
@pytest.mark.parametrize("own", [False, True])
def test_steps_of_force_plans_name_vectors_and_say_no_number(own, lang, tmp_path):
    assignment, plan = loaded("slider on a moving link", tmp_path, own=own)
    one = Subject(assignment, plan, 0, wording_of(tongue(lang)))
    for step in plan.construction.steps:
        for line in redo(one, tongue(lang), step.node, with_numbers=False):
            assert not re.search(r"\d[.,]\d|\d\s*(?:mm|мм|°)", line.replace("90°", "")), line


@pytest.mark.parametrize("own", [False, True])
def test_every_force_and_moment_that_changes_is_named_and_no_given_force(own, tmp_path):
    assignment, plan = loaded("slider on a moving link", tmp_path, own=own)
    one, construction = Subject(assignment, plan, 0, wording_of(tongue("en"))), plan.construction
    right = evaluate(construction, plan.drawing.parameters)
    for node in (step.node for step in construction.steps if group_of(construction.figure_of(step.node))):
        lines = redo(one, tongue("en"), node, with_numbers=False)
        told = set(re.findall(r"[FGRM]_\w+", " ".join(lines)))
        drawn = evaluate(construction, plan.drawing.parameters, given={node: right[node] + complex(2, 3)})
        vectors = construction.vectors.values()
        moved = {v.name for v in vectors if abs(v_of(v, drawn) - v_of(v, right)).max() > 0.01}
        assert moved <= told, node
        laid_off = {name for line in lines for name in re.findall(r"lay off ([FG]_\w+)", line)}
        assert laid_off <= {v.name for v in vectors if v.head == node}


def v_of(vector, nodes):
    return nodes[vector.head] - nodes[vector.tail]


def test_with_numbers_the_lengths_are_those_of_the_plan():
    one = subject()
    equation, line, *_ = redo(one, tongue("en"), "n_BA", with_numbers=True)
    length = abs(one.plan.drawn_mm("a_BA_n")[0])
    assert f"\t{length:.2f}\t" in equation
    assert f"{length:.2f}\u00a0mm" in line
    assert line.startswith("a_BA_n = v_BA² / AB")


def test_what_is_no_point_has_no_steps():
    for where in ("kv", "velocity_plan", "nowhere"):
        assert redo(subject(), tongue("en"), where, with_numbers=True) == []
