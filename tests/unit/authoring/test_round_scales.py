"""Round scales: round, the finest that fit, and right once they stand in the file; room on the sheets."""

import re
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from grader.authoring.lint import lint
from grader.authoring.round_scales import (
    STEPS,
    extents_of,
    growth,
    ratio_text,
    room_of,
    round_up,
    suggestions,
)
from grader.language import tongue
from grader.printed.layout import FRAME_MM, MARGIN_MM, best_template
from grader.rubric import load_rubric
from reference.authored.assignment import built_in, library, load_assignment
from reference.plan import exact_plan

ROUNDING = 1e-9


def test_rounding_up_gives_the_least_round_number_that_is_not_below():
    values = np.geomspace(1e-6, 1e6, 2001)
    rounded = round_up(values)
    assert np.all(rounded >= values * (1 - ROUNDING))
    mantissa = rounded / 10.0 ** np.floor(np.log10(rounded) + ROUNDING)
    assert np.all(np.min(np.abs(mantissa[:, None] - np.array(STEPS)), axis=1) < 1e-6)
    np.testing.assert_allclose(round_up(rounded), rounded, rtol=ROUNDING)
    # The next step down is below the value.
    ladder = np.sort(np.unique(np.outer(10.0 ** np.arange(-8, 8), STEPS).ravel().round(12)))
    below = ladder[np.searchsorted(ladder, rounded * (1 - 1e-6)) - 1]
    assert np.all(below < values)


@pytest.mark.parametrize("scale", [0.004, 0.0004, 0.04, 0.02, 0.2, 2.0, 0.0025, 0.005, 0.1 * 0.2])
def test_scales_as_courses_use_them_are_round(scale):
    np.testing.assert_allclose(round_up(np.array([scale])), [scale], rtol=ROUNDING)


@pytest.mark.parametrize(
    ("scale", "told"), [(0.005, "1:5"), (0.004, "1:4"), (0.0025, "1:2.5"), (0.001, "1:1"), (1e-4, "10:1")]
)
def test_a_scale_of_lengths_is_told_as_a_ratio(scale, told):
    assert ratio_text(scale) == told


def with_round_scales(tmp_path: Path, name: str) -> Path:
    """A built-in assignment with the round scales that lint proposes for it in its file."""
    assignment = load_assignment(name)
    found = lint(assignment, load_rubric(assignment.file.rubric, beside=assignment.path))
    scales = found.scales[1].scales.by_name
    text = assignment.path.read_text(encoding="utf-8")
    crank = "" if assignment.mechanism_file.crank is None else f'crank_mm = "crank_m / {scales["kL"][0]}"\n'
    told = "".join(f"{scale} = {float(np.max(value))!r}\n" for scale, value in scales.items())
    proposed = f"[scales]\n{crank}{told}\n"
    text, count = re.subn(r"\[scales\].*?(?=\n\[)", proposed, text, flags=re.DOTALL)
    assert count == 1
    (tmp_path / f"{name}.assignment.toml").write_text(text, encoding="utf-8")
    return tmp_path / f"{name}.assignment.toml"


@pytest.mark.parametrize("name", built_in())
def test_round_scales_put_into_the_file_fit_and_are_proposed_again(tmp_path, name):
    assignment = load_assignment(with_round_scales(tmp_path, name))
    found = lint(assignment, load_rubric(assignment.file.rubric, beside=library() / "any.toml"))
    codes = {finding.code for finding in found.findings}
    assert not codes & {"does_not_fit", "does_not_fit_a3", "round_scales"}
    own, round_, _each = found.scales
    for scale in ("kL", "kv", "ka"):
        np.testing.assert_allclose(getattr(round_.scales, scale), getattr(own.scales, scale), rtol=ROUNDING)
    assert own.over_all.under_8_mm == round_.over_all.under_8_mm


@pytest.mark.parametrize("name", built_in())
def test_scales_of_each_variants_own_are_never_coarser_than_the_common_ones(name):
    assignment = load_assignment(name)
    found = lint(assignment, load_rubric(assignment.file.rubric, beside=assignment.path))
    _own, together, each = found.scales
    for scale in ("kL", "kv", "ka"):
        own, common = getattr(each.scales, scale), getattr(together.scales, scale)
        assert np.all(own <= common * (1 + ROUNDING))
        assert np.min(own) > 0.0
    assert together.over_all.room >= 1.0 - ROUNDING
    assert each.over_all.room >= 1.0 - ROUNDING
    assert each.over_all.under_8_mm <= together.over_all.under_8_mm


def test_round_scales_that_do_not_fit_are_told_with_those_that_do(tmp_path):
    path = with_round_scales(tmp_path, "engine")
    text = path.read_text(encoding="utf-8")
    larger = re.sub(r"kv = (.*)", lambda found: f"kv = {float(found.group(1)) / 10}", text)
    path.write_text(larger, encoding="utf-8")
    assignment = load_assignment(path)
    found = lint(assignment, load_rubric("engine"))
    (told,) = [one for one in found.findings if one.code == "round_scales"]
    assert "do not fit" in told.message()
    assert f"kv = {float(found.scales[1].scales.kv[0]):g} (m/s)/mm" in told.message()
    assert any(one.code == "does_not_fit" and "velocity plan" in one.message() for one in found.findings)


@pytest.mark.parametrize("name", built_in())
def test_scales_of_a_variants_own_are_suggested_where_fewer_vectors_are_short_and_they_fit(name):
    assignment = load_assignment(name)
    found = lint(assignment, load_rubric(assignment.file.rubric, beside=assignment.path))
    own, _, each = found.scales
    figures = ("mechanism", "velocity_plan", "acceleration_plan")
    told = suggestions(found.scales, found.plan, figures, tongue("en"))
    assert each.over_all.room >= 1.0
    for index, variant in enumerate(found.plan.variants):
        better = each.short[index] < own.short[index] or own.over_all.room < 1.0
        assert (variant in told) == bool(better)
    assert own.short.sum() == own.over_all.under_8_mm
    codes = {finding.code for finding in found.findings}
    assert ("short_at_any_scale" in codes) == bool(own.over_all.under_8_mm and each.over_all.under_8_mm)
    assert ("scales_of_its_own" in codes) == bool(own.over_all.under_8_mm and not each.over_all.under_8_mm)


# Room on the sheets, held against boxes laid out by hand -----------------------------------------

WIDE, HIGH = FRAME_MM[2], FRAME_MM[3]


def fits(boxes: list[tuple[float, float]]) -> bool:
    """Return whether boxes with margins fit the frame: in a row, in a column, or one beside two."""
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
        factor = float(growth(FRAME_MM, [(np.array([wide]), np.array([high])) for wide, high in boxes])[0])
        assert fits([tuple(factor * box) for box in boxes])
        assert not fits([tuple(1.001 * factor * box) for box in boxes])


def test_a_figure_grows_to_the_edge_of_its_zone_less_the_margins():
    wide, high = np.array([50.0, 50.0, 0.0]), np.array([20.0, 90.0, 10.0])
    factor = growth((0.0, 0.0, 124.0, 104.0), [(wide, high)])
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
