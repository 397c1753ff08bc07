"""Letters beside nodes: what they say of the names that the construction gave."""

import numpy as np
import pytest

from grader.reading.lettering import lettered, lettering, support
from grader.records import VELOCITY_PLAN, Figure, Letters, Reading, ReadNode, ReadVector
from reference.authored.assignment import load_assignment
from reference.construction.derive import construction_of

SIGNS = {sign: column for column, sign in enumerate([*"oabcdnpπABCD'"])} | {"": 13}
PLACES = {"o": 50 - 50j, "a": 90 - 60j, "b": 60 - 100j, "c": 100 - 110j, "d": 55 - 140j}
OWN = {name: name for name in PLACES}
SWAPPED = OWN | {"b": "c", "c": "b"}
SURE, HEIGHT_MM, GAP_MM = 0.97, 3.0, 1.5
HARDLY = 0.5
"""So surely a letter is read that hardly tells of a swap."""


def letters(written: dict[str, str], sure: float = SURE, gap_mm: float = GAP_MM) -> Letters:
    """A letter to the right of each node, and nothing else."""
    boxes, rows = [], []
    for node, sign in written.items():
        at = PLACES[node]
        boxes.append([at.real + gap_mm, -at.imag - HEIGHT_MM / 2.0, 2.0, HEIGHT_MM])
        row = np.full(len(SIGNS), (1.0 - sure) / (len(SIGNS) - 1))
        row[SIGNS[sign]] = sure
        rows.append(row)
    probability = np.array(rows).reshape(-1, len(SIGNS))
    return Letters(np.array(boxes).reshape(-1, 4), probability, np.ones(len(boxes), dtype=bool), SIGNS)


@pytest.fixture(scope="module")
def construction():
    assignment = load_assignment("pump")
    return construction_of(assignment.mechanism(assignment.variants()[:1]))


@pytest.fixture(scope="module")
def reading(construction) -> Reading:
    nodes = {name: ReadNode(at, np.eye(2) * 1e-4, 0.99) for name, at in PLACES.items()}
    vectors = {
        vector.name: ReadVector(abs(PLACES[vector.head] - PLACES[vector.tail]), 0.05, 0.0, 0.1, 0.99)
        for vector in construction.vectors_of(VELOCITY_PLAN)
    }
    return Reading({VELOCITY_PLAN: Figure(nodes, vectors)})


def nats(reading: Reading, written: Letters) -> float:
    """By how much the writing is likelier than letters at random."""
    nodes = {(VELOCITY_PLAN, name): node.at for name, node in reading.figures[VELOCITY_PLAN].nodes.items()}
    writing = lettering(nodes, written, ["o"])
    assert writing is not None
    return writing.log()


def pairs(reading: Reading) -> list[set[str]]:
    return [{one.first, one.second} for one in reading.swapped]


def test_letters_at_their_own_nodes_bear_them_out_and_change_no_confidence(reading, construction):
    assert nats(reading, letters(OWN)) > 0.0
    found = lettered(reading, letters(OWN), construction, {})
    assert (found.figures, found.swapped) == (reading.figures, ())


def test_two_letters_at_each_others_node_are_told_and_the_strokes_are_read_as_surely(reading, construction):
    found = lettered(reading, letters(SWAPPED), construction, {})
    assert pairs(found) == [{"b", "c"}]
    assert found.figures == reading.figures


def test_letters_that_may_be_swapped_leave_less_confidence_in_their_vectors(reading, construction):
    found = lettered(reading, letters(SWAPPED, HARDLY), construction, {})
    assert pairs(found) == []
    vectors = found.figures[VELOCITY_PLAN].vectors
    ends = {name: {construction.vectors[name].tail, construction.vectors[name].head} for name in vectors}
    for name, read in vectors.items():
        assert (read.confidence < reading.figures[VELOCITY_PLAN].vectors[name].confidence) == bool(
            ends[name] & {"b", "c"}
        )


def test_one_strange_letter_alone_is_no_swap(reading, construction):
    found = lettered(reading, letters({"b": "c"}), construction, {})
    assert found.swapped == ()
    assert nats(reading, letters({"b": "c"})) < 0.0


@pytest.mark.parametrize(("sure", "gap_mm"), [(0.3, GAP_MM), (SURE, 12.0)])
def test_letters_hard_to_read_or_far_off_say_little(reading, construction, sure, gap_mm):
    assert lettered(reading, letters(SWAPPED, sure, gap_mm), construction, {}).swapped == ()


@pytest.mark.parametrize("pole", ["o", "p", "π"])
def test_a_pole_may_have_the_letter_of_any_school(reading, pole):
    assert nats(reading, letters({"o": pole})) > 0.0


def test_without_letters_nothing_is_said(reading, construction):
    assert lettered(reading, None, construction, {}) == reading
    assert lettered(reading, letters({}), construction, {}) == reading
    assert lettering({(VELOCITY_PLAN, "o"): 0j}, None) is None


def test_capitals_bear_out_joints_named_rightly_and_not_two_changed_over():
    written = letters({"a": "A", "b": "B", "d": "D"})
    joints = {"A": PLACES["a"], "B": PLACES["b"], "D": PLACES["d"]}
    changed = joints | {"A": PLACES["b"], "B": PLACES["a"]}
    assert support(joints, written) > 0.0 > support(changed, written)
    assert support(joints, None) == 0.0
