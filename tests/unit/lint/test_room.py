"""Whether figures fit: held against boxes laid out by hand."""

from itertools import permutations

import numpy as np
import pytest

from grader.answer_sheet.fit import MARGIN_MM, best_template
from grader.layout import FRAME_MM
from grader.lint.room import _frame_growth, extents_of, growth, room_of
from reference.assignment import built_in, load_assignment
from reference.plan import exact_plan

ROUNDING = 1e-9
WIDE, HIGH = FRAME_MM[2], FRAME_MM[3]


def fits(boxes: list[tuple[float, float]]) -> bool:
    """Whether boxes with margins fit the frame: in a row, in a column, or one beside two."""
    padded = [(wide + 2 * MARGIN_MM, high + 2 * MARGIN_MM) for wide, high in boxes]
    arrangements = [
        (sum(wide for wide, _ in padded), max(high for _, high in padded)),
        (max(wide for wide, _ in padded), sum(high for _, high in padded)),
    ]
    if len(boxes) == 3:
        for alone, first, second in permutations(padded):
            arrangements += [
                (alone[0] + max(first[0], second[0]), max(alone[1], first[1] + second[1])),
                (max(alone[0], first[0] + second[0]), alone[1] + max(first[1], second[1])),
            ]
    return any(wide <= WIDE + ROUNDING and high <= HIGH + ROUNDING for wide, high in arrangements)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_figures_fit_a_plain_sheet_at_the_size_told_and_at_no_larger_one(count):
    rng = np.random.default_rng(count)
    for _ in range(200):
        boxes = rng.uniform(5.0, 300.0, (count, 2))
        factor = float(_frame_growth([(np.array([wide]), np.array([high])) for wide, high in boxes])[0])
        assert fits([tuple(factor * box) for box in boxes])
        assert not fits([tuple(1.001 * factor * box) for box in boxes])


def test_a_figure_grows_to_the_edge_of_its_zone_less_the_margins():
    wide, high = np.array([50.0, 50.0, 0.0]), np.array([20.0, 90.0, 10.0])
    factor = growth((0.0, 0.0, 124.0, 104.0), wide, high)
    np.testing.assert_allclose(factor, [2.0, 80.0 / 90.0, 8.0])


@pytest.mark.parametrize("name", built_in())
def test_lint_and_the_printed_sheet_agree_on_what_fits(name):
    assignment = load_assignment(name)
    extents = extents_of(exact_plan(assignment, assignment.variants()))
    for page in assignment.file.page:
        printed = best_template(assignment, page.figures)
        room = room_of(page.figures, extents)
        for figure, factor in printed.room.items():
            assert (factor >= 1.0) == bool(np.min(room.zones[figure]) >= 1.0)
