"""Masses and loads in an assignment's file: the mechanism with them, and every fault with its path."""

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.errors import AuthoredFileError
from reference.kinematics.motion import move
from reference.kinetics import forces_of
from reference.mechanism import Crank, FixedGuide, Load, Mechanism, PointOnLine, Slider, SlotPoint
from reference.plan import exact_plan
from tests import every_group
from tests.laws.mechanisms import array
from tests.told import by_path

MASSES = """
gravity = 10
[[body]]
link = "1"
mass = 2
inertia = "n / 10"
centre = "O1"
[[body]]
link = "3"
mass = "1 + n"
centre = { base = ["O2", "A3"], at = [250, 10] }
[[body]]
link = "6"
mass = 3
inertia = 0.01
centre = { base = ["A", "B"], ratio = 0.5 }
pins = ["B"]
[[body]]
link = "slider_E"
mass = 5
[[load]]
link = "slider_E"
force = "100*n"
motion = "against"
[[load]]
link = "8"
point = "G"
force = 30
angle_deg = 90
[[load]]
link = "7"
couple = -5
"""


@pytest.fixture
def write(tmp_path):
    """Writes the assignment about every group, with masses, and returns its path."""

    def written(masses: str, *changes: tuple[str, str]):
        for old, new in changes:
            assert old in masses
            masses = masses.replace(old, new, 1)
        (tmp_path / "every.mechanism.toml").write_text(every_group.MECHANISM, encoding="utf-8")
        text = every_group.ASSIGNMENT.replace("page =", 'mechanism = "every"\npage =')
        path = tmp_path / "every.assignment.toml"
        path.write_text(text + masses, encoding="utf-8")
        return path

    return written


def faults(path) -> dict[str, str]:
    with pytest.raises(AuthoredFileError) as error:
        load_assignment(path)
    assert error.value.exit_status == 2
    return by_path(error.value.findings)


def test_masses_and_loads_are_formulas_of_the_variant(write):
    assignment = load_assignment(write(MASSES))
    mechanism = assignment.mechanism(assignment.variants())
    bodies = {body.link: body for body in mechanism.bodies}
    np.testing.assert_array_equal(bodies["3"].mass, np.arange(2.0, 22.0))
    assert {link: body.centre for link, body in bodies.items()} == {
        "1": "O1", "3": "S3", "6": "S6", "slider_E": "E",
    }  # fmt: skip
    against, pull, couple = mechanism.loads
    assert (against.name, against.slider, against.force[2]) == ("E", "E", -300.0)
    assert (pull.name, pull.slider, pull.couple) == ("G", None, None)
    assert abs(pull.force[0] - 30j) < 1e-14
    assert (couple.name, couple.couple[0], couple.force) == ("7", -5.0, None)
    assert mechanism.pins == {"B": "6"}
    assert mechanism.gravity is not None
    assert mechanism.gravity[0] == 10.0


def test_centres_of_mass_are_points_of_their_links_in_both_plans(write):
    assignment = load_assignment(write(MASSES))
    first = assignment.variants()[:1]
    plan = exact_plan(assignment, first)
    slot, line = plan.mechanism.groups[-2:]
    assert isinstance(slot, SlotPoint)
    assert isinstance(line, PointOnLine)
    assert {"v_S3", "a_S3", "v_S6", "a_S6"} <= plan.vectors_si.keys()
    assert plan.forces is not None
    inertia = next(one for one in plan.forces.given if one.name == "F_i6")
    np.testing.assert_allclose(inertia.force, -3.0 * plan.vectors_si["a_S6"], rtol=1e-12)
    pinned = plan.forces.hinges["B"]
    assert (pinned.on, pinned.by) == ("7", "6")


def test_an_assignment_without_masses_has_no_forces_and_no_further_points(write):
    assignment = load_assignment(write(""))
    plan = exact_plan(assignment, assignment.variants()[:1])
    assert plan.forces is None
    assert plan.mechanism.groups[-1].node == "L"


def test_a_load_against_a_slider_at_its_dead_point_opposes_the_motion_to_come(tmp_path):
    text = every_group.ASSIGNMENT.replace("n = { from = 1, to = 20 }", "position = { from = 0, to = 1 }")
    mechanism = """
schema_version = 1
id = "piston"
title = { en = "Piston" }
length_unit = "m"
ground = { O1 = [0, 0] }
crank = { pivot = "O1", pin = "A", length = 0.1, angle_deg = "180*position", omega = 10 }
[[group]]
type = "RRP"
node = "B"
pin = "A"
link = "2"
length = 0.4
guide = { through = [0, 0], angle_deg = 0 }
side = "ahead"
"""
    (tmp_path / "piston.mechanism.toml").write_text(mechanism, encoding="utf-8")
    load = '[[load]]\nlink = "slider_B"\nforce = 100\nmotion = "against"\n'
    path = tmp_path / "piston.assignment.toml"
    path.write_text(text.replace("page =", 'mechanism = "piston"\npage =') + load, encoding="utf-8")
    assignment = load_assignment(path)
    plan = exact_plan(assignment, assignment.variants())
    assert plan.forces is not None
    # At the outer dead point the piston is about to move inwards, at the inner one outwards.
    np.testing.assert_allclose(plan.forces.given[0].force, [100.0, -100.0], atol=1e-12)
    np.testing.assert_allclose(plan.forces.balancing.moment, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "path", "words"),
    [
        (('link = "slider_E"', 'link = "E"'), "$.body[3].link", "did you mean slider_E"),
        (('link = "6"', 'link = "66"'), "$.body[2].link", "known are 1, 3, slider_A"),
        (('link = "6"', 'link = "0"'), "$.body[2].link", "0 is not a moving link"),
        (('link = "6"', 'link = "3"'), "$.body[2].link", "already: leave one of them out"),
        (("mass = 3", "mass = -3"), "$.body[2].mass", "must be >= 0"),
        (("mass = 3", 'mass = "n - 10"'), "$.body[2].mass", "for n = 1 and 8 more"),
        (("gravity = 10", "gravity = -10"), "$.gravity", "must be >= 0"),
        (('centre = "O1"', 'centre = "B"'), "$.body[0].centre", "link 1: it carries O1, A"),
        (('centre = "O1"', ""), "$.body[0].centre", 'is "C", a joint of the link'),
        (('centre = "O1"', 'centre = { base = ["O1", "A"] }'), "$.body[0].centre", "or base with at"),
        (('centre = "O1"', "centre = [1, 2]"), "$.body[0].centre", "a joint of the link, or"),
        (('["A", "B"]', '["A", "G"]'), "$.body[2].centre.base", "must be two joints of link 6"),
        (('pins = ["B"]', 'pins = ["A"]'), "$.body[2].pins[0]", "its pin is on one of the links 1"),
        (('pins = ["B"]', 'pins = ["E"]'), "$.body[2].pins[0]", "no point that is fixed on link 6"),
        (("mass = 5", 'mass = 5\ncentre = "D"'), "$.body[3].centre", "at its joint E: leave out centre"),
        (("mass = 5", ""), "$.body[3]", "needs mass"),
        (("[[load]]", "[[loads]]"), "$.loads", "did you mean [[load]]?"),
        (('point = "G"', 'point = "A"'), "$.load[1].point", "it carries C, G"),
        (('point = "G"', ""), "$.load[1].point", "is missing"),
        (("force = 30", "force = 30\ncouple = 2"), "$.load[1]", "needs one of force"),
        (("couple = -5", ""), "$.load[2]", "needs one of force"),
        (("angle_deg = 90", ""), "$.load[1]", "needs a direction"),
        (
            ("angle_deg = 90", 'motion = "along"'),
            "$.load[1].motion",
            ": give angle_deg in place of",
        ),
        (('"slider_E"\nforce', '"slider_H"\nforce'), "$.load[0].motion", "is no slider on a fixed guide"),
        (("couple = -5", 'couple = -5\nname = "E"'), "$.load[2].name", "of another force already"),
        (("couple = -5", 'couple = -5\nname = "b"'), "$.load[2].name", "of another force already"),
    ],
)
def test_each_fault_of_a_body_or_load_is_told_with_its_path(write, change, path, words):
    told = faults(write(MASSES, change))
    assert words in told[path]
    assert len(told) == 1


@pytest.mark.parametrize(
    ("heading", "words"),
    [("m [kg]", None), ("m [кг]", None), ("m", None), ("m [N]", "holds N; here it must hold kg")],
)
def test_masses_come_from_a_table_with_their_unit(write, heading, words):
    path = write(MASSES, ("mass = 3", 'mass = "m"'))
    rows = f'variant = {{ table = {{ columns = ["n", "{heading}"], rows = [[1, 4], [2, 5]] }} }}'
    text = path.read_text(encoding="utf-8").replace("variant = { n = { from = 1, to = 20 } }", rows)
    path.write_text(text, encoding="utf-8")
    if words is not None:
        assert words in faults(path)["$.body[2].mass"]
        return
    assignment = load_assignment(path)
    body = next(one for one in assignment.mechanism(assignment.variants()).bodies if one.link == "6")
    assert body.mass.tolist() == [4.0, 5.0]


def test_gravity_without_a_mass_is_a_fault(write):
    assert "no [[body]]" in faults(write("\ngravity = 9.81\n"))["$.gravity"]


def test_all_faults_of_bodies_are_told_at_once(write):
    changes = (
        ('link = "6"', 'link = "66"'),
        ('centre = "O1"', 'centre = "B"'),
        ('point = "G"', 'point = "A"'),
    )
    assert faults(write(MASSES, *changes)).keys() == {"$.body[2].link", "$.body[0].centre", "$.load[1].point"}


def test_forces_are_those_of_a_known_slider_crank():
    """A crank of 0.3 m at 90 degrees, a rod of 0.5 m, 400 N against the piston, no masses: by hand."""
    crank = Crank("1", "O", "A", array(0.3), array(np.pi / 2), array(1.0), array(0.0), accelerated=False)
    guide = FixedGuide(array(0j), array(0.0))
    load = Load("B", "slider_B", "B", array(-400 + 0j), array(0.0))
    group = Slider("B", "A", "2", array(0.5), guide, 1)
    mechanism = Mechanism({"O": array(0j)}, crank, (group,), loads=(load,))
    forces = forces_of(mechanism, move(mechanism))
    # The rod, 3-4-5, is pressed with 500 N; the guide carries 300 N; the moment is 400 N times 0.3 m.
    assert forces.hinges["A"].force[0] == pytest.approx(400 - 300j)
    assert forces.guides["B"].force[0] == pytest.approx(300j)
    assert forces.balancing.moment[0] == pytest.approx(-120.0)


def test_a_cylinder_balances_the_crank_that_it_drives(tmp_path):
    mechanism = """
schema_version = 1
id = "arm"
title = { en = "Arm" }
length_unit = "m"
ground = { O1 = [0, 0], O2 = [0.5, 0] }
[crank]
pivot = "O2"
pin = "A"
length = 0.3
cylinder = { pivot = "O1", length = 0.4, speed = 0.1, side = "left" }
[[group]]
type = "RPR"
node = "A2"
pin = "A"
pivot = "O1"
link = "2"
"""
    (tmp_path / "arm.mechanism.toml").write_text(mechanism, encoding="utf-8")
    text = every_group.ASSIGNMENT.replace("page =", 'mechanism = "arm"\npage =')
    path = tmp_path / "arm.assignment.toml"
    path.write_text(text + '[[load]]\nlink = "1"\ncouple = 12\n', encoding="utf-8")
    assignment = load_assignment(path)
    plan = exact_plan(assignment, assignment.variants()[:1])
    assert plan.forces is not None
    thrust = plan.forces.balancing
    assert (thrust.on, thrust.by) == ("slider_A", "2")
    # 3-4-5: the cylinder meets the crank at right angles, with its thrust at 0.3 m from the pivot.
    assert np.abs(thrust.force[0]) == pytest.approx(12 / 0.3)
    assert thrust.moment[0] == 0.0
    for joint in ("A", "O1"):
        assert np.abs(plan.forces.hinges[joint].force[0]) == pytest.approx(12 / 0.3)
