"""Positions of one motion: a parallelogram or kite goes on through its flat positions as `cycle` does."""

from contextlib import suppress

import numpy as np
import pytest

from reference.authored.assignment import AssignmentFile, Variant, load_assignment
from reference.authored.flat_positions import other_assemblies
from reference.authored.formula import parse
from reference.construction.graph import evaluate
from reference.errors import MechanismError
from reference.kinematics.cycle import cycle
from reference.kinematics.motion import move
from reference.plan import exact_plan
from tests.drawn import HEAD

FILE = (
    HEAD.replace("{name}", "four-bar")
    + """
ground = {{ O1 = [0, 0], O2 = [{ground}, 0] }}
crank = {{ pivot = "O1", pin = "A", length = {crank}, angle_deg = "{angle}", omega = 10 }}
[variant]
{variant}
[[mechanism.group]]
type = "RRR"
node = "B"
pins = ["A", "O2"]
links = ["2", "3"]
lengths = [{coupler}, {rocker}]
side = "{side}"
"""
)
PARALLELOGRAM = {"ground": 100, "crank": 40, "coupler": 100, "rocker": 40, "side": "left"}
KITE = {"ground": 40, "crank": 40, "coupler": 100, "rocker": 100, "side": "left"}
TWELVE = "position = { from = 0, to = 11 }"


@pytest.fixture
def bars(tmp_path):
    def write(angle: str, variant: str = TWELVE, **data):
        path = tmp_path / "bars.assignment.toml"
        text = FILE.format(angle=angle, variant=variant, **(PARALLELOGRAM | data))
        path.write_text(text, encoding="utf-8")
        return load_assignment(path)

    return write


def rocker_rates(assignment, n=None):
    """omega_3 by position; nan where the position is flat."""
    rates = {}
    for variant in assignment.variants():
        if variant.n != n:
            continue
        rates[variant.position] = np.nan
        with suppress(MechanismError):
            rates[variant.position] = float(exact_plan(assignment, [variant]).rates["omega_3"][0])
    return rates


@pytest.mark.parametrize(
    ("angle", "side"),
    [
        ("30*position", "left"),
        ("15 + 30*position", "left"),
        ("(200 + 30*position) % 360", "right"),
        ("-30*position", "right"),
    ],
)
def test_a_parallelogram_stays_one_through_its_flat_positions(bars, angle, side):
    rates = rocker_rates(bars(angle, side=side))
    sound = {position: rate for position, rate in rates.items() if not np.isnan(rate)}
    assert sound == pytest.approx(dict.fromkeys(sound, 10.0), rel=1e-9)
    flat = [k for k in range(12) if abs(np.sin(np.radians(float(parse(angle)({"position": k}))))) < 1e-9]
    assert [position for position, rate in rates.items() if np.isnan(rate)] == flat


def test_positions_are_those_of_the_cycle(bars):
    assignment = bars("205 + 30*position", **KITE)
    assert assignment.signs
    first = cycle(assignment.mechanism([Variant(position=0)]), 1441)
    for variant in assignment.variants():
        mechanism = assignment.mechanism([variant])
        plan = exact_plan(assignment, [variant])
        on_cycle = exact_at(first, float(mechanism.crank.angle_rad[0]))
        assert plan.motion.position["B"][0] == pytest.approx(on_cycle, abs=1e-9)


def exact_at(found, angle):
    return move(found.following.at(np.array([angle]))).position["B"][0]


def test_positions_of_all_and_of_one_are_the_same(bars):
    assignment = bars("15 + 30*position")
    together = exact_plan(assignment, assignment.variants())
    np.testing.assert_allclose(together.rates["omega_3"], 10.0, rtol=1e-9)
    assert together.construction is exact_plan(assignment, [Variant(position=8)]).construction


def test_each_student_has_a_motion_of_his_own(bars):
    variant = "n = { from = 1, to = 3 }\nposition = { from = 0, to = 5 }"
    assignment = bars("60*position + 15*n", variant, crank='"30 + 10*n"', rocker='"30 + 10*n"')
    for n in (1, 2, 3):
        assert rocker_rates(assignment, n) == pytest.approx(dict.fromkeys(range(6), 10.0), rel=1e-9)


def test_a_near_parallelogram_and_other_mechanisms_keep_their_side(bars):
    assert not bars("15 + 30*position", coupler=100.5).signs
    assert not bars("15 + 30*position", coupler=120, rocker=80).signs


def test_positions_that_differ_in_a_length_are_no_motion(bars):
    grown = bars("15 + 30*position", crank='"40 + position"', rocker='"40 + position"')
    assert not grown.signs


def test_what_lies_beyond_a_stop_keeps_the_authored_side(bars):
    assignment = bars("60 + 30*position", ground=100, crank=60, coupler=50, rocker=40)
    assert not assignment.signs


@pytest.mark.parametrize(
    ("angle", "side", "behind"),
    [
        ("15 + 30*n", "left", [6, 7, 8, 9, 10, 11]),
        ("30*n", "left", [7, 8, 9, 10, 11]),
        ("15 + 30*n", "5.5 - n", []),
        ("200 + 20*n", "left", [9, 10, 11]),
        ("15 + 150*n", "left", [2, 4, 6, 7, 9, 11]),
    ],
)
def test_variants_in_another_assembly_than_their_neighbours_are_found(bars, angle, side, behind):
    assignment = bars(angle, "n = { from = 0, to = 11 }", side=side)
    found = other_assemblies(assignment.mechanism(assignment.variants()), range(12))
    assert found == ({"B": behind} if behind else {})


def test_other_mechanisms_have_one_assembly(bars):
    assignment = bars("15 + 30*n", "n = { from = 0, to = 11 }", coupler=101)
    assert not other_assemblies(assignment.mechanism(assignment.variants()), range(12))


def test_files_without_positions_are_not_followed(bars):
    assert isinstance(bars("30", "").file, AssignmentFile)
    assert not bars("15 + 30*n", "n = { from = 0, to = 11 }").signs


SLIDER = """
[[mechanism.group]]
type = "RRP"
node = "B"
pin = "A"
link = "2"
length = 40
guide = { through = [0, 0], angle_deg = 0 }
side = "ahead"
"""
SLOT = """
[[mechanism.group]]
type = "RPR"
node = "A3"
pin = "A"
pivot = "O2"
link = "3"
side = "behind"
"""


def with_group(tmp_path, group: str, angle: str):
    text = FILE.format(angle=angle, variant=TWELVE, **(PARALLELOGRAM | {"ground": 40}))
    text = text[: text.index("[[mechanism.group]]")] + group
    path = tmp_path / f"{len(group)}.assignment.toml"
    path.write_text(text, encoding="utf-8")
    return load_assignment(path)


def test_an_isosceles_slider_crank_goes_on_beyond_its_pivot(tmp_path):
    assignment = with_group(tmp_path, SLIDER, "15 + 30*position")
    motion = exact_plan(assignment, assignment.variants()).motion
    angle = np.radians(15 + 30 * np.arange(12))
    np.testing.assert_allclose(motion.position["B"], 0.08 * np.cos(angle), atol=1e-12)
    np.testing.assert_allclose(motion.velocity["B"], -0.8 * np.sin(angle), atol=1e-12)


def test_a_slotted_link_goes_on_where_the_pin_passes_its_pivot(tmp_path):
    assignment = with_group(tmp_path, SLOT, "205 + 30*position")
    assert assignment.signs
    together = exact_plan(assignment, assignment.variants())
    np.testing.assert_allclose(together.rates["omega_3"], 5.0, rtol=1e-9)
    for index, variant in enumerate(assignment.variants()):
        alone = exact_plan(assignment, [variant])
        for name, vector in together.vectors_si.items():
            assert vector[index] == pytest.approx(alone.vectors_si[name][0], abs=1e-9), name


def test_the_construction_is_drawn_on_the_side_that_the_motion_has(tmp_path, bars):
    for assignment in (
        bars("15 + 30*position"),
        bars("205 + 30*position", **KITE),
        with_group(tmp_path, SLIDER, "15 + 30*position"),
        with_group(tmp_path, SLOT, "205 + 30*position"),
    ):
        assert assignment.signs
        plan = exact_plan(assignment, assignment.variants())
        nodes = evaluate(plan.construction, plan.drawing.parameters)
        for figure in plan.nodes_mm.values():
            for name, place in figure.items():
                np.testing.assert_allclose(nodes[name], place, atol=1e-8)
