"""The one table of quantities, and that no code takes a unit or a kind from a name by itself."""

import re
from pathlib import Path

import pytest

import grader
from reference.quantities import SCALE_UNITS, group_of, kind_of, scale_of, sort_of, unit_of

SOURCES = [
    path
    for room in ("grader", "reference")
    for path in Path(grader.__file__).parents[1].glob(f"{room}/**/*.py")
]
BY_LETTERS = re.compile(r'"(?:rad/s|m/s)[^"]*" if |\bf"\{\w+\[[01]\]\}_')


@pytest.mark.parametrize(
    ("name", "kind", "unit", "scale"),
    [
        ("v_BA", "velocity", "m/s", "kv"),
        ("a_BA_n", "acceleration", "m/s^2", "ka"),
        ("omega_3", "omega", "rad/s", ""),
        ("epsilon_3", "epsilon", "rad/s^2", ""),
        ("kL", "length", "m/mm", "kL"),
        ("kv", "velocity", "(m/s)/mm", "kv"),
        ("ka", "acceleration", "(m/s^2)/mm", "ka"),
        ("O1A", "length", "m", "kL"),
        ("F", "length", "m", "kL"),
        ("R_31_t", "force", "N", "kF"),
        ("F_i3", "force", "N", "kF"),
        ("G_3", "force", "N", "kF"),
        ("kF", "force", "N/mm", "kF"),
        ("M_b", "moment", "N m", ""),
    ],
)
def test_a_name_tells_kind_unit_and_scale(name, kind, unit, scale):
    assert (kind_of(name).name, unit_of(name), kind_of(name).scale) == (kind, unit, scale)


def test_scales_come_in_the_order_of_files():
    assert list(SCALE_UNITS) == ["kL", "kv", "ka", "kF"]


@pytest.mark.parametrize(
    ("figure", "scale", "sort", "group"),
    [
        ("mechanism", "kL", "mechanism", ""),
        ("acceleration_plan", "ka", "acceleration_plan", ""),
        ("force_plan_D", "kF", "force_plan", "D"),
        ("centres", "", "centres", ""),
        ("force_plan_", "", "force_plan_", ""),
    ],
)
def test_a_figure_s_name_tells_scale_sort_and_group(figure, scale, sort, group):
    assert (scale_of(figure), sort_of(figure), group_of(figure)) == (scale, sort, group)


def test_no_unit_is_chosen_by_a_name_s_letters_elsewhere():
    assert [path.name for path in SOURCES if BY_LETTERS.search(path.read_text(encoding="utf-8"))] == []
