"""The details of a named mistake have the names that reports and sentences use."""

import pytest

from grader.outcomes import NamedMistake
from reference.construction.mistakes import Mistake
from reference.geometry import degrees


@pytest.mark.parametrize(
    ("mistake", "detail"),
    [
        (Mistake("labels_swapped", "b", other=("b", "c")), {"first": "b", "second": "c"}),
        (Mistake("other_variant", "all", n=8), {"n": 8}),
        (Mistake("other_variant", "all", n=8, position=2), {"n": 8, "position": 2}),
        (Mistake("figure_rotated", "velocity_plan", quarters=3), {"degrees": 270.0}),
        (Mistake("wrong_link", "b", other=("A", "B")), {"other": "AB"}),
        (Mistake("arithmetic", "b", factor=2.0), {"factor": 2.0}),
        (Mistake("arithmetic", "n_B", other=("right_triangle",)), {"slip": "right_triangle"}),
        (Mistake("data_misread", "all", parameters={"angle crank": 6.2825}), {"crank_deg": 0.0}),
        (Mistake("normal_reversed", "n_BA"), {}),
    ],
)
def test_a_mistake_tells_what_its_sentence_needs(mistake, detail):
    assert NamedMistake(mistake, (), 1.0).detail == detail
    assert NamedMistake(mistake, (), 1.0, {"from": "b"}).detail == {**detail, "from": "b"}


def test_a_direction_is_never_a_full_turn():
    assert degrees(-1e-17) == 0.0
    assert degrees(7.0) == pytest.approx(41.0705, abs=1e-4)
