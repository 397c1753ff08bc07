"""What stands on a sketch as strokes, for every kind of group."""

import pytest

from reference.authored.assignment import load_assignment
from reference.construction.derive import construction_of
from reference.construction.graph import bars, coincident


def construction(name):
    assignment = load_assignment(name)
    return construction_of(assignment.mechanism(assignment.variants()[:1]))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("pump", {"O1A", "AB", "O2B", "AC", "BC", "CD"}),
        ("press", {"O1A", "AB", "O2B", "O2C", "CD"}),
        ("shaper", {"O1A", "O2A3", "O2D", "DE"}),
        ("piston", {"BA", "O1A", "BC"}),
    ],
)
def test_every_bar_of_a_sketch_is_told_once(name, expected):
    found = ["".join(pair) for pair in bars(construction(name))]
    assert sorted(found) == sorted(expected)


def test_a_point_under_a_block_lies_where_the_block_does():
    assert coincident(construction("shaper")) == {"A3": "A"}
    assert not coincident(construction("pump"))
