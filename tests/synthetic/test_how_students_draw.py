"""The student's own way of drawing: instruments that err, and mistakes as students make them."""

from dataclasses import replace

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.construction import mistakes as operators
from reference.construction.graph import evaluate
from samples.simulation import CAREFUL, PERFECT, SLOPPY, TYPICAL, Student
from samples.simulation.drawing import drawn_nodes
from samples.simulation.hand import task_of
from samples.simulation.instruments import Instruments
from samples.simulation.mistakes import (
    CODES,
    CODES_OF_FORCES,
    Occasion,
    possible,
    with_mistake,
)
from tests.drawn import MECHANISMS, planned

pytestmark = pytest.mark.slow
ROUNDING_MM = 1e-6
PEN_WIDTH_MM = 0.5


def occasion_of(name, **student):
    assignment = load_assignment(name)
    variant = assignment.variants()[6 % len(assignment.variants())]
    task = task_of(assignment, variant, Student(**student), np.random.default_rng(1))
    return Occasion(assignment, variant, task.right)


# Drawing ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MECHANISMS)
def test_exact_instruments_draw_every_kind_of_step_exactly(name, tmp_path):
    assignment, _ = planned(name, tmp_path)
    task = task_of(assignment, assignment.variants()[0], Student(turn_deg=7.0), np.random.default_rng(1))
    nodes = drawn_nodes(task.right.construction, task.right.parameters, PERFECT, np.random.default_rng(2))
    for node, exact in evaluate(task.right.construction, task.right.parameters).items():
        assert abs(nodes[node] - complex(exact)) < ROUNDING_MM, node


def test_slips_are_mostly_small_and_sometimes_several_times_larger():
    tools = Instruments(TYPICAL, np.random.default_rng(3))
    slips = np.abs([tools.slip(1.0) for _ in range(20_000)])
    assert np.median(slips) == pytest.approx(0.74, abs=0.03)
    assert 0.015 < np.mean(slips > 3.5) < 0.035
    assert slips.max() <= 6.0


@pytest.mark.parametrize(("hand", "step_mm"), [(CAREFUL, 0.5), (SLOPPY, 1.0)])
def test_lengths_are_read_to_the_rulers_graduation(hand, step_mm):
    tools = Instruments(hand, np.random.default_rng(4))
    read = np.array([tools.length(exact) for exact in np.linspace(5.0, 120.0, 200)])
    assert np.allclose(read / step_mm, np.round(read / step_mm))
    assert tools.length(0.0) == 0.0
    assert tools.length(-40.0) < 0.0


def test_one_person_reads_all_lengths_with_the_same_constant_error():
    """Rounding and slips average out over many readings; the constant error of the person does not."""
    hand = replace(TYPICAL, reading_mm=0.4)
    means = []
    for seed in range(12):
        tools = Instruments(hand, np.random.default_rng(seed))
        means.append(np.mean([tools.length(40.0) - 40.0 for _ in range(400)]))
    assert np.std(means) > 0.1


def test_a_direction_is_carried_over_worse_from_a_short_line():
    tools = Instruments(TYPICAL, np.random.default_rng(5))
    spread = [
        np.std([np.angle(tools.carried(complex(length), 0)) for _ in range(800)]) for length in (20.0, 200.0)
    ]
    assert spread[0] > 1.5 * spread[1]


def test_lines_that_cross_sharply_are_marked_badly_along_both():
    tools = Instruments(TYPICAL, np.random.default_rng(6))

    def along_and_across(turn):
        other = complex(np.cos(turn), np.sin(turn))
        marks = [tools.crossing(0j, 1 + 0j, 0j, other) for _ in range(800)]
        return np.std(np.real(marks)), np.std(np.imag(marks))

    sharp, square = along_and_across(0.2), along_and_across(np.pi / 2)
    assert sharp[0] > 2.0 * sharp[1]
    assert square[0] < sharp[0]
    with pytest.raises(ValueError, match="parallel"):
        tools.crossing(0j, 1 + 0j, 1j, 1 + 0j)


# Mistakes -----------------------------------------------------------------------------------------


def test_the_codes_are_those_of_the_published_formats():
    entered = {"units"}  # not drawn: a slip in the numbers entered
    of_the_data = {"data_misread"}  # another crank angle, drawn in tests/unit/given_data
    assert {*CODES, *CODES_OF_FORCES} == set(operators.CODES) - entered - of_the_data


def test_mistakes_go_beyond_those_that_the_program_looks_for():
    occasion = occasion_of("pump")
    drawing = operators.Drawing(occasion.construction, occasion.right.parameters)
    looked_for = {
        (one.code, one.at, one.slot, one.other)
        for figure in occasion.construction.figures
        for one in operators.single_mistakes(drawing, figure)
    }
    for code in ("wrong_link", "wrong_intersection", "parallel_for_perpendicular"):
        made = {(one.code, one.at, one.slot, one.other) for one in possible(code, occasion)}
        assert made & looked_for, code
        assert made - looked_for, code


def test_a_component_forgotten_ends_where_it_starts_and_the_rest_follows():
    occasion = occasion_of("pump")
    mistake = next(one for one in possible("normal_missing", occasion) if one.at == "n_BA")
    wrong = with_mistake(occasion.right, mistake)
    nodes = drawn_nodes(wrong.construction, wrong.parameters, SLOPPY, np.random.default_rng(7))
    assert nodes["n_BA"] == nodes["a'"]
    right = evaluate(occasion.construction, occasion.right.parameters)
    assert abs(nodes["b'"] - complex(right["b'"])) > PEN_WIDTH_MM
