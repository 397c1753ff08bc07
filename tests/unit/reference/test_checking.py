"""A newcomer's mistakes in a mechanism file: each is told at its place, in words that say what to do."""

import pytest

from reference.authored.assembly import build_mechanism
from reference.authored.formula import FormulaError
from reference.authored.mechanism import MechanismFile, check_mechanism
from reference.authored.toml_file import validate
from reference.errors import AuthoredFileError, MechanismError
from reference.kinematics.motion import Motion, move
from reference.mechanism import DrivingSlider, joints_of
from tests.every_group import mechanism_table
from tests.told import by_path, tells

MISSING = object()
A_SLIDER = {
    "pin": "A",
    "guide": {"through": [0, 0], "angle_deg": 30},
    "displacement": 120,
    "speed": 1000,
    "acceleration": 200,
}


def edited(*changes: tuple) -> dict:
    """The file with every group, each change a path and the value put there."""
    table = mechanism_table()
    for *path, last, value in changes:
        owner = table
        for key in path:
            owner = owner[key]
        if value is MISSING:
            del owner[last]
        elif last == "append":
            owner.append(value)
        else:
            owner[last] = value
    return table


def moved(table: dict) -> Motion:
    file = validate(MechanismFile, table, "the file")
    assert not list(check_mechanism(file))
    return move(build_mechanism(file, {"n": 1}, 1))


def told(table: dict) -> dict[str, str]:
    """All that is told of a file: of its form, or else of how it fits together."""
    try:
        file = validate(MechanismFile, table, "the file")
    except AuthoredFileError as error:
        return by_path(error.findings)
    return by_path(check_mechanism(file))


def test_a_file_with_every_group_moves():
    table = mechanism_table()
    motion = moved(table)
    placed = {*table["ground"], "A", *(group["node"] for group in table["group"]), "G7", "H4", "P"}
    assert set(motion.position) == placed
    assert set(motion.omega) == {"1", "3", "4", "6", "7", "8", "9"}


def test_a_crank_behind_a_gear_turns_by_its_ratio_more_slowly():
    assert moved(mechanism_table()).omega["1"][0] == pytest.approx(3.141592653589793 * 90 / 30 / 1.5)


@pytest.mark.parametrize("name", ["driving_slider", "driven_slider"])  # the second is its older name
def test_a_slider_may_drive_in_place_of_the_crank(name):
    table = edited(("crank", MISSING), (name, A_SLIDER))
    file = validate(MechanismFile, table, "the file")
    assert not list(check_mechanism(file))
    mechanism = build_mechanism(file, {"n": 1}, 1)
    assert isinstance(mechanism.driver, DrivingSlider)
    velocity = move(mechanism).velocity["A"][0]
    assert (velocity.real, velocity.imag) == pytest.approx((0.75**0.5, 0.5))
    with pytest.raises(ValueError, match="a driving slider, not a crank"):
        _ = mechanism.crank


@pytest.mark.parametrize(
    ("changes", "path", "words"),
    [
        (
            [(3, "pins", ["A", "O4"])],
            "[3].pins[1]",
            "O4 is not placed by any group: known are A, A3, B, C, C9, D",
        ),
        ([(3, "pins", ["A", "A"])], "[3].pins", "two different joints"),
        ([(3, "links", ["6", "6"])], "[3].links[1]", "each link needs a name of its own"),
        ([(3, "links", ["6", "1"])], "[3].links[1]", "each link needs a name of its own"),
        (
            [(8, "node", "B")],
            "[8].node",
            "B has a place already: over-constrained; a group places a new joint",
        ),
        ([(6, "guide", "coincident", "O1")], "[6].guide.coincident", "O1 has a place already"),
        ([(2, "link", "3")], "[2].link", "there is a link 3 already: each link needs a name of its own"),
        ([(2, "link", "1")], "[2].link", "there is a link 1 already"),
        ([(0, "pivot", "A")], "[0].pivot", "two different joints"),
        ([(4, "link", "66")], "[4].base", "must be two joints of link 66"),
        ([(4, "base", ["A", "O2"])], "[4].base", "must be two joints of link 6 (A, B)"),
        ([(1, "base", ["A3", "O2"])], "[1].base", "the pivot comes first"),
        ([(1, "base", ["O2", "A"])], "[1].base", 'by type = "point" from O2, A3'),
        (
            [(6, "guide", "joints", ["A", "O3"])],
            "[6].guide.joints",
            "A, O3 must be two joints of one moving link (links of each: A: 1, 6; O3: 7)",
        ),
        ([(6, "guide", "joints", ["O1", "O3"])], "[6].guide.joints", "one moving link"),
        (
            [(7, "guides", 0, {"joints": ["O2", "A3"], "coincident": "H3"})],
            "[7].guides[0].joints",
            "A3 is on link 3 for this instant only",
        ),
        (
            [(7, "guides", 0, {"through": [0, 0], "angle_deg": 40})],
            "[7].guides",
            "two fixed guides cross in a fixed point: one of them must be on a moving link",
        ),
    ],
)
def test_what_does_not_fit_together_is_told_at_its_place(changes, path, words):
    found = told(edited(*(("group", *change) for change in changes)))
    assert words in found[f"$.group{path}"]


@pytest.mark.parametrize("name", ["BA", "O2B"])
def test_a_joint_whose_name_reads_like_two_joints_is_refused(name):
    assert (
        f"{name} would have two meanings, one of them {name[:-1]} about {name[-1]}"
        in told(edited(("group", 8, "node", name)))["$"]
    )


def test_the_crank_needs_a_ground_pivot_and_a_new_pin_and_letters_differ_by_more_than_case():
    found = told(edited(("crank", "pivot", "O9"), ("crank", "pin", "O2")))
    assert {"$.crank.pivot", "$.crank.pin"} <= set(found)
    found = told(edited(("ground", "Ab", [0, 0]), ("group", 8, "node", "AB")))
    assert any("another case" in message for message in found.values())


@pytest.mark.parametrize(
    ("index", "change", "body"),
    [
        (3, {"pins": ["O2", "O3"]}, "ground"),
        (3, {"pins": ["A", "O1"]}, "1"),
        (2, {"pin": "O2"}, "ground"),
        (8, {"pin": "O2"}, "ground"),
        (6, {"pin": "F"}, "7"),
        (9, {"pin": "B", "pivot": "O3"}, "7"),
        (9, {"pin": "O1", "pivot": "O3"}, "ground"),
        (
            7,
            {"guides": [{"joints": pair, "coincident": f"H{pair[1]}6"} for pair in (["A", "C"], ["A", "B"])]},
            "6",
        ),
    ],
)
def test_a_group_between_points_of_one_body_is_told_to_be_rigid(index, change, body):
    found = told(edited(*(("group", index, key, value) for key, value in change.items())))
    assert f"all on one link ({body}): nothing moves between" in found[f"$.group[{index}]"]
    assert 'type = "plate" or "point"' in found[f"$.group[{index}]"]


@pytest.mark.parametrize(("joint", "link"), [("A3", "3"), ("G7", "7")])
def test_nothing_is_hinged_to_a_point_that_lies_under_a_slider_for_an_instant(joint, link):
    dyad = {"type": "RRR", "node": "Q", "pins": [joint, "O1"], "links": ["21", "22"], "lengths": [300, 300]}
    found = told(edited(("group", "append", dyad | {"side": "left"})))
    message = found["$.group[11]"]
    assert f"{joint} is a point of link {link} for this instant only" in message
    assert f'hinge it to a fixed point of the link, a group of type = "point" on link {link}' in message


@pytest.mark.parametrize(
    ("changes", "path", "words"),
    [
        ([("group", 3, "side", MISSING)], "$.group[3].side", "without it two assemblies are possible"),
        ([("group", 2, "side", MISSING)], "$.group[2].side", "without it two assemblies are possible"),
        ([("group", 2, "side", "left")], "$.group[2].side", "sides are ahead, behind"),
        ([("group", 9, "foot", MISSING)], "$.group[9]", "offset and foot go together"),
        ([("group", 9, "offset", MISSING)], "$.group[9]", "offset and foot go together"),
        (
            [("crank", "rpm", MISSING), ("crank", "omega", 3)],
            "$.crank",
            "gear_ratio goes with rpm: the crank then turns at rpm / gear_ratio",
        ),
        ([("crank", "omega", 3)], "$.crank", "needs one speed: either omega (rad/s) or rpm (rev/min)"),
        ([("crank", "rpm", MISSING)], "$.crank", "needs one speed"),
        ([("crank", MISSING)], "$", "needs one driving link: either [crank] or [driving_slider]"),
        ([("driving_slider", A_SLIDER)], "$", "needs one driving link"),
        (
            [("crank", MISSING), ("driving_slider", {**A_SLIDER, "speed": "1e"})],
            "$.driving_slider.speed",
            "'1e'",
        ),
        ([("group", 6, "guide", {"joints": ["O3", "B"]})], "$.group[6].guide", "or joints and coincident"),
        (
            [("group", 6, "guide", "through", [0, 0])],
            "$.group[6].guide",
            "needs through and angle_deg (a fixed guide)",
        ),
        (
            [("group", 7, "guides", [{"joints": ["D", "E"], "coincident": "H4"}])],
            "$.group[7].guides",
            "at least 2 of its entries, not 1",
        ),
        ([("group", 8, "guide", "joints", ["D", "E"])], "$.group[8].guide", "(a fixed guide), or joints"),
        ([("group", 8, "link", "12")], "$.group[8]", "a yoke on a fixed guide needs slot_deg"),
        ([("group", 8, "guide", {"joints": ["D", "E"], "coincident": "K4"})], "$.group[8]", "no slot_deg"),
        ([("group", 8, "slot", 90)], "$.group[8].slot", "did you mean slot_deg?"),
        ([("group", 8, "type", "RTR")], "$.group[8].type", "types are RRR, RRP, RPR"),
        ([("group", 8, "type", MISSING)], "$.group[8].type", "types are RRR, RRP, RPR"),
        ([("group", 8, "node", "k")], "$.group[8].node", "a capital, then letters or digits"),
        ([("ground", {})], "$.ground", "at least 1 of its entries"),
    ],
)  # fmt: skip
def test_faults_of_form_are_told_with_what_is_expected(changes, path, words):
    assert words in told(edited(*changes))[path]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("group", 2, "length", -5), r"group\[2\]: '-5' \(E\) must be > 0"),
        (("group", 3, "lengths", [350, 0]), r"group\[3\]: '0' \(B\) must be > 0"),
        (("crank", "length", 0), r"'0' \(crank\) must be > 0"),
        (("crank", "gear_ratio", 0), r"gear_ratio\) must be != 0"),
        (("group", 9, "offset", 0), r"group\[9\]: the offset of link 9 is zero: leave out offset and foot"),
        (("crank", "angle_deg", "fi"), "unknown name fi"),
        (
            ("group", 4, "side", MISSING),
            r"group\[4\]: side of C is missing: C may lie to the left or to the right",
        ),
    ],
)
def test_numbers_that_no_mechanism_has_are_told_with_their_group(change, words):
    with pytest.raises(FormulaError, check=tells(words)):
        moved(edited(change))


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        (
            ("group", 3, "lengths", [35, 25]),
            "does_not_assemble",
            r"group of B .* miss each other by 0\.\d+ m",
        ),
        (
            ("group", 3, "lengths", [900, 25]),
            "does_not_assemble",
            r"group of B .* miss each other by 0\.\d+ m",
        ),
        (
            ("group", 2, "length", 20),
            "does_not_assemble",
            r"group of E .* check the lengths, the crank angle",
        ),
        (("group", 4, "lengths", [20, 26]), "does_not_assemble", r"group of C .* by 0\.304 m"),
        (("group", 9, "offset", 500), "does_not_assemble", r"group of C9 .* by 0\.2\d+ m"),
        (("group", 8, "slot_deg", 180), "singular", "slot and guide are parallel.* two directions"),
    ],
)
def test_what_does_not_close_or_move_is_told_by_its_group_and_by_how_much(change, code, words):
    with pytest.raises(MechanismError, match=words) as error:
        moved(edited(change))
    assert error.value.code == code


def test_a_plate_in_line_needs_no_side():
    table = edited(("group", 4, "lengths", [100, 250]), ("group", 4, "side", MISSING))
    at = moved(table).position
    assert at["C"][0] == pytest.approx(at["A"][0] + (at["B"][0] - at["A"][0]) * 100 / 350, rel=1e-12)


def test_where_a_slider_drives_its_displacement_is_what_to_check():
    table = edited(("crank", MISSING), ("driving_slider", A_SLIDER), ("group", 3, "lengths", [35, 25]))
    with pytest.raises(MechanismError, match="check the lengths, the displacement of the driving slider"):
        moved(table)


def test_every_joint_of_a_group_is_named():
    file = validate(MechanismFile, mechanism_table(), "the file")
    mechanism = build_mechanism(file, {"n": 1}, 1)
    assert [joints_of(group) for group in mechanism.groups] == [
        ("A3",), ("D",), ("E",), ("B",), ("C",), ("F",), ("G", "G7"), ("H", "H4"), ("K",), ("P", "C9"), ("L",)
    ]  # fmt: skip
