"""Plans that no construction explains: their letters name the nodes, their strokes measure."""

import math
from dataclasses import replace

import numpy as np
import pytest

from grader.reading.read import read_figures
from grader.records import ACCELERATION_PLAN, VELOCITY_PLAN, Ink, Letters
from reference.authored.assignment import Assignment, Variant
from tests.examples import slow
from tests.unit.reading.drawn import Pen, blank_sheet, draw, ink_of, task

SIGNS = {sign: column for column, sign in enumerate([*"oabcdnpπABCD'"])} | {"": 13}
PLAN_MM, APART_MM, POLE = 60.0, 18.0, 200 - 120j
NEAR_MM, SURE, SILENTLY_WRONG_MM = 0.5, 0.9, 1.0


def scattered(names: tuple[str, ...], seed: int) -> dict[str, complex]:
    """Nodes anywhere about a pole, apart from one another: no mechanism moves like that."""
    lot, places = np.random.default_rng(seed), [POLE]
    while len(places) < len(names):
        at = POLE + complex(*lot.uniform(-PLAN_MM, PLAN_MM, 2))
        if min(abs(at - other) for other in places) > APART_MM:
            places.append(at)
    return dict(zip(names, places, strict=True))


def lettered_ink(ink: Ink, nodes: dict[str, complex], sure: float = 0.95) -> Ink:
    """The ink with a letter beside each node."""
    boxes = np.array([[at.real + 1.0, -at.imag - 3.5, 2.0, 3.0] for at in nodes.values()])
    probability = np.full((len(nodes), len(SIGNS)), (1.0 - sure) / (len(SIGNS) - 1))
    for row, name in enumerate(nodes):
        probability[row, SIGNS[name]] = sure
    return replace(ink, letters=Letters(boxes, probability, np.ones(len(nodes), dtype=bool), SIGNS))


def with_primes(ink: Ink, nodes: dict[str, complex]) -> Ink:
    """The same with a prime behind each letter, as an acceleration plan has them."""
    boxes = np.array([[at.real + 3.3, -at.imag - 3.8, 0.4, 1.0] for at in nodes.values()])
    probability = np.full((len(nodes), len(SIGNS)), 0.01)
    probability[:, SIGNS["'"]] = 1.0 - 0.01 * (len(SIGNS) - 1)
    both = (
        np.concatenate(pair)
        for pair in (
            (ink.letters.box_mm, boxes),
            (ink.letters.probability, probability),
            (ink.letters.whole, np.ones(len(nodes), dtype=bool)),
        )
    )
    return replace(ink, letters=Letters(*both, SIGNS))


def drawn_and_read(assignment: Assignment, seed: int, *, letters: bool, primes: bool = False):
    """(vectors as drawn, as read, confidences) of a plan of scattered nodes."""
    variant = assignment.variants()[0]
    construction = task("pump", variant)[2].construction
    nodes = scattered(tuple(step.node for step in construction.figures[VELOCITY_PLAN]), seed)
    vectors = {v.name: (nodes[v.tail], nodes[v.head]) for v in construction.vectors_of(VELOCITY_PLAN)}
    ink = ink_of(list(vectors.values()))
    ink = lettered_ink(ink, nodes) if letters else ink
    ink = with_primes(ink, nodes) if primes else ink
    reading = read_figures([(ink, blank_sheet())], assignment, variant, None, tuple(vectors))[0]
    figure = reading.figures.get(VELOCITY_PLAN)
    found = {} if figure is None else figure.vectors
    read = {
        name: one.length_mm * np.exp(1j * math.radians(one.direction_deg or 0.0))
        for name, one in found.items()
    }
    return (
        {name: head - tail for name, (tail, head) in vectors.items()},
        read,
        {name: one.confidence for name, one in found.items()},
    )


@pytest.mark.parametrize("seed", [0, 1, *slow(*range(2, 6))])
def test_a_plan_that_no_mechanism_explains_is_read_by_its_letters(seed):
    drawn, read, _ = drawn_and_read(task("pump")[0], seed, letters=True)
    right = [name for name, way in drawn.items() if name in read and abs(read[name] - way) < NEAR_MM]
    assert len(right) >= 0.8 * len(drawn)


@pytest.mark.parametrize("seed", [0, 1, *slow(*range(2, 6))])
def test_without_letters_such_a_plan_is_not_believed(seed):
    drawn, read, sure = drawn_and_read(task("pump")[0], seed, letters=False)
    assert not [
        name for name in read if sure[name] > SURE and abs(read[name] - drawn[name]) > SILENTLY_WRONG_MM
    ]


@pytest.mark.parametrize("seed", range(3))
def test_nodes_with_primes_are_no_velocity_plan(seed):
    drawn, read, sure = drawn_and_read(task("pump")[0], seed, letters=True, primes=True)
    assert not [name for name in read if sure[name] > SURE and abs(read[name] - drawn[name]) < NEAR_MM]


def test_letters_elsewhere_name_no_plan_that_is_drawn_as_constructed():
    assignment, variant, drawing = task("pump")
    drawn = draw(drawing, {VELOCITY_PLAN: 90 - 200j}, Pen(left_out=frozenset({"v_CB"})))
    names = tuple(step.node for step in drawing.construction.figures[VELOCITY_PLAN])
    nodes = scattered(names, seed=0)
    others = [(nodes[v.tail], nodes[v.head]) for v in drawing.construction.vectors_of(VELOCITY_PLAN)]
    pen = Pen(left_out=frozenset({"v_CB"}), extra=others)
    ink = lettered_ink(draw(drawing, {VELOCITY_PLAN: 90 - 200j}, pen).ink, nodes)
    reading = read_figures([(ink, blank_sheet())], assignment, variant, None, tuple(drawn.vectors))[0]
    read = reading.figures[VELOCITY_PLAN].nodes
    assert abs(read["o"].at - drawn.nodes["o"]) < NEAR_MM


def test_an_acceleration_plan_is_not_read_as_velocities_that_are_a_single_stroke():
    """At a dead point; the primes of its letters were not seen."""
    assignment, variant, drawing = task("press", Variant(position=4))
    pen = Pen(left_out=frozenset({"v_BA"}))
    drawn = draw(drawing, {VELOCITY_PLAN: 90 - 200j, ACCELERATION_PLAN: 220 - 100j}, pen)
    names = [step.node for step in drawing.construction.figures[ACCELERATION_PLAN]]
    ink = lettered_ink(drawn.ink, {name[0]: drawn.nodes[name] for name in names if "_" not in name})
    read = read_figures([(ink, blank_sheet())], assignment, variant, None, tuple(drawn.vectors))[0].figures
    assert VELOCITY_PLAN not in read
    assert abs(read[ACCELERATION_PLAN].vectors["a_D"].length_mm - abs(drawn.vectors["a_D"])) < NEAR_MM


@pytest.mark.parametrize("is_crossed", [False, True])
@pytest.mark.parametrize("is_lettered", [False, True])
def test_of_a_plan_drawn_twice_letters_and_strokes_across_tell_which_counts(is_lettered, is_crossed):
    """The other one is whole: a first attempt, or crossed out."""
    assignment, variant, drawing = task("pump")
    pen = Pen(left_out=frozenset({"v_CB"}))
    drawn, away = draw(drawing, {VELOCITY_PLAN: 90 - 200j}, pen), 160 + 80j
    whole = drawing.construction.polygon_of(VELOCITY_PLAN)
    pen.extra = [(drawn.nodes[one.tail] + away, drawn.nodes[one.head] + away) for one in whole]
    pen.extra += [(208 - 123j, 254 - 66j), (212 - 69j, 250 - 120j)] if is_crossed else []
    ink = draw(drawing, {VELOCITY_PLAN: 90 - 200j}, pen).ink
    ink = lettered_ink(ink, drawn.nodes) if is_lettered else ink
    found = read_figures([(ink, blank_sheet())], assignment, variant, None, tuple(drawn.vectors))[0]
    read = found.figures[VELOCITY_PLAN]
    is_told = is_lettered or is_crossed
    assert is_told == (abs(read.nodes["o"].at - drawn.nodes["o"]) < NEAR_MM)
    assert is_told == any(one.confidence > 0.8 for one in read.vectors.values())
