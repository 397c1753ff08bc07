"""Mechanisms of other kinds: each is refused with its reason, or solved whatever the order of its groups."""

import itertools

import pytest

from grader.texts.spoken import fault
from reference.authored.mechanism import MechanismFile, check_mechanism
from reference.authored.toml_file import validate
from reference.errors import AuthoredFileError

CRANK = {"pivot": "O1", "pin": "A", "length": 50, "angle_deg": 30, "omega": 1}
SLIDER = {"pin": "A", "guide": {"through": [0, 0], "angle_deg": 0}, "displacement": 1, "speed": 1}
MOVING = {"joints": ["O2", "B"], "coincident": "A3"}
ONE = "planmark solves mechanisms with one driving link"


def two(node: str, pins: str, links: str) -> dict:
    """An RRR of two links; names of one letter or, of pivots, two."""
    first, second = pins.split()
    table = {"type": "RRR", "node": node, "pins": [first, second], "links": links.split()}
    return table | {"lengths": [200, 200], "side": "left"}


def third(node: str, base: str, link: str) -> dict:
    table = {"type": "plate", "node": node, "base": base.split(), "link": link}
    return table | {"lengths": [200, 100], "side": "left"}


def mechanism(*groups: dict, **more: object) -> dict:
    table = {"schema_version": 1, "id": "x", "title": {"en": "X"}, "length_unit": "mm", "crank": CRANK}
    table["ground"] = {"O1": [0, 0], "O2": [300, 0], "O3": [400, 200]}
    return table | {"group": list(groups)} | more


def told(table: dict) -> list[str]:
    """All findings about a file, of its form or of how it fits together, each with its path."""
    try:
        file = validate(MechanismFile, table, "the file")
    except AuthoredFileError as error:
        return [fault(finding) for finding in error.findings]
    return [fault(finding) for finding in check_mechanism(file)]


# The six-bar chains of Stephenson and Watt: the crank's further point, then groups in an order of assembly.
SOLVED = {
    "Stephenson I": (
        third("B", "O1 A", "1"),
        two("C", "A O2", "2 3"),
        third("D", "O2 C", "3"),
        two("E", "B D", "4 5"),
    ),
    "Stephenson III by a crank of its four-bar": (
        two("B", "A O2", "2 3"),
        third("C", "A B", "2"),
        two("D", "C O3", "4 5"),
    ),
    "Watt I by its ternary link": (
        third("B", "O1 A", "1"),
        two("C", "A O2", "2 3"),
        third("D", "A C", "2"),
        two("E", "B D", "4 5"),
    ),
    "Watt I by its binary link": (
        two("B", "A O2", "2 3"),
        third("C", "A B", "2"),
        third("D", "O2 B", "3"),
        two("E", "C D", "4 5"),
    ),
    "Watt II": (two("B", "A O2", "2 3"), third("C", "O2 B", "3"), two("D", "C O3", "4 5")),
}


@pytest.mark.parametrize("name", SOLVED)
def test_six_bars_of_the_second_class_are_accepted_in_any_order_of_their_groups(name):
    for groups in itertools.permutations(SOLVED[name]):
        table = mechanism(*groups)
        assert told(table) == []
        ordered = validate(MechanismFile, table, "the file").in_order
        nodes = [group.node for _, group in ordered]
        assert {group["node"] for group in groups} == {*nodes}
        assert [groups[index]["node"] for index, _ in ordered] == nodes


TRIAD = {
    "type": "triad", "nodes": ["B", "C", "D"], "pins": ["A", "O2", "O3"], "links": ["2", "3", "4", "5"],
    "lengths": [200, 200, 200, 100, 100, 100], "side": "left", "angle_deg": 0, "assur_point": "S",
}  # fmt: skip


def test_a_six_bar_with_a_triad_is_accepted():
    assert told(mechanism(TRIAD)) == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pins": ["O2", "A", "O3"]}, "$.group[0].pins[0]: O2 is fixed: write first a leg from a joint that"),
        ({"pins": ["A", "O2", "O2"]}, "$.group[0].pins: must be two different joints"),
        ({"links": ["2", "3", "3", "5"]}, "$.group[0].links[2]: '3'"),
        ({"assur_point": "D"}, "$.group[0].assur_point: D has a place already"),
        ({"lengths": [200, 200, 200]}, "$.group[0].lengths"),
    ],
)
def test_faults_of_a_triad_are_told(change, words):
    found = told(mechanism(TRIAD | change))
    assert any(words in one or words.replace("'3'", "") in one for one in found), found


def test_nothing_is_hinged_to_an_assur_point():
    found = told(mechanism(TRIAD, two("E", "S O1", "6 7")))
    assert any("S is a point of link 5 for this instant only" in one for one in found), found


def test_a_triad_with_a_slider_is_refused():
    slide = {"type": "RRP", "node": "D", "pin": "B", "link": "3", "length": 100, "side": "ahead"}
    slide |= {"guide": {"through": [0, 0], "angle_deg": 0}}
    groups = (two("B", "A C", "2 3"), third("D", "B C", "3"), two("C", "O2 D", "4 3"), slide)
    assert "of class III: not solved; velocities can be found by Assur points" in " ".join(
        told(mechanism(*groups))
    )


# Groups as an author might write them; the refusal in any order of theirs, and what it says in this order.
REFUSED = {
    "Stephenson II by its ternary link": (
        (third("B", "O1 A", "1"), two("C", "A D", "2 3"), two("D", "B E", "4 3"), two("E", "C O2", "3 5")),
        'form a triad, a group of class III: write one group of type = "triad"',
        "AC, DCE, BD, O2E",
    ),
    "Stephenson II by its binary link": (
        (
            third("D", "A C", "5"),
            two("C", "A E", "5 3"),
            two("E", "O2 C", "2 3"),
            third("F", "O2 E", "2"),
            two("D", "F C", "4 5"),
        ),
        "form a group of class IV: not solved",
        "ACD, EC, O2EF, FD",
    ),
    "Stephenson III by its third pivot": (
        (two("B", "A C", "2 3"), third("D", "B C", "3"), two("C", "O2 D", "4 3"), two("D", "O3 B", "5 3")),
        'form a triad, a group of class III: write one group of type = "triad"',
        "AB, CBD, O2C, O3D",
    ),
    "a five-bar": (
        (two("B", "A C", "2 3"), two("C", "B O2", "3 4")),
        f"degrees of freedom: 2 (links with the ground: 5, pairs: 5); {ONE}",
        "$.group",
    ),
    "a five-bar whose middle link has two names": (
        (two("B", "A C", "2 3"), two("C", "B O2", "5 4")),
        f"degrees of freedom: 2 (links with the ground: 5, pairs: 5); {ONE}",
        "$.group",
    ),
    "a link too many": (
        (two("B", "A O2", "2 3"), third("C", "A B", "2"), two("C", "A O3", "4 5")),
        "degrees of freedom: 0 (links with the ground: 5, pairs: 6); nothing moves",
        "C has a place already",
    ),
    "groups written about the wrong joints": (
        (two("C", "A D", "2 4"), two("B", "C O2", "2 3"), two("D", "C O3", "4 5"), third("B", "A C", "2")),
        "all groups are of the second class: write one for each",
        "in this order: ACB + O2B, DC + O3D",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_mechanisms_that_are_not_of_the_second_class_are_refused_with_their_mobility_or_class(name):
    groups, reason, words = REFUSED[name]
    assert words in " ".join(told(mechanism(*groups)))
    for permuted in itertools.permutations(groups):
        assert reason in " ".join(told(mechanism(*permuted)))


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (
            mechanism(crank=[CRANK, CRANK | {"pivot": "O2"}]),
            "$.crank: needs one driving link",
        ),
        (mechanism(driving_slider=SLIDER), "or [driving_slider]; planmark solves mechanisms with one"),
        (
            mechanism(crank2=CRANK),
            f"$.crank2: 'crank2': a second driving link makes 2 degrees of freedom, and {ONE}",
        ),
        (
            mechanism(two("B", "A O2", "2 3") | {"type": "planetary gear"}),
            "'planetary gear': a gear before the crank is its gear_ratio",
        ),
        (
            mechanism(gears={"teeth": [20, 40]}),
            "'gears': a gear before the crank is its gear_ratio; replace a pair of gears",
        ),
        (
            mechanism({"type": "cam", "node": "B"}),
            "'cam': replace a cam by its equivalent linkage for the instant, see Cams and gears",
        ),
        (
            mechanism({"type": "Geneva", "node": "B"}),
            "a Geneva wheel is a slotted link",
        ),
        (mechanism({"type": "RRR-RRR", "node": "B"}), "only a ternary link on three legs"),
        (mechanism({"type": "oldham_coupling", "node": "B"}), 'a block in a yoke on a guide is type = "RPP"'),
        (
            mechanism(driving_slider=SLIDER | {"guide": MOVING}, crank=None),
            "$.driving_slider: a driving slider's guide is fixed",
        ),
        (
            mechanism(crank=CRANK | {"cylinder": {"pivot": "O2", "length": 1, "speed": 1, "side": "left"}}),
            "angle, speed and acceleration come from the cylinder",
        ),
    ],
)
def test_other_kinds_of_parts_are_refused_with_what_to_write_instead(table, words):
    table = {key: value for key, value in table.items() if value is not None}
    assert any(words in one for one in told(table)), told(table)


def test_the_cylinder_that_drives_is_drawn_too():
    crank = {"pivot": "O2", "pin": "A", "length": 50, "link": "2"}
    crank |= {"cylinder": {"pivot": "O1", "length": 290, "speed": 10, "side": "left"}}
    assert told(mechanism(crank=crank)) == [
        '$.crank.cylinder: the cylinder itself is missing: a group of type = "RPR", its pin A, its pivot O1'
    ]
    cylinder = {"type": "RPR", "node": "A1", "pin": "A", "pivot": "O1", "link": "1"}
    assert told(mechanism(cylinder, crank=crank)) == []
    crank["cylinder"] |= {"pivot": "O2"}
    assert "$.crank.cylinder.pivot: the cylinder needs a pivot of its own" in told(mechanism(crank=crank))


def test_a_part_that_is_rigid_beside_one_that_is_free_is_named():
    """One degree of freedom in all: link 4 holds the four-bar, and link 5 hangs at B."""
    found = " ".join(told(mechanism(two("B", "A O2", "2 3"), two("B", "O3 C", "4 5"))))
    assert "C is not placed by any group" in found
    assert "O3B cannot move: a joint too many; and another part is free" in found


@pytest.mark.parametrize(
    "groups",
    [
        [two(f"P{k}", f"P{(k + 1) % 25} P{(k + 2) % 25}", f"a{k} b{k}") for k in range(25)],
        [
            {"type": "RRP", "node": "B", "pin": "A", "link": "2", "length": 1, "side": "ahead",
             "guide": {"joints": ["C", "D"], "coincident": "B3"}},
            two("C", "B O2", "3 4"), two("D", "B O3", "5 6"),
        ],
    ],
)  # fmt: skip
def test_groups_that_wait_for_one_another_are_named_where_their_links_cannot_be_counted(groups):
    (found,) = told(mechanism(*groups))
    first = ", ".join(group["node"] for group in groups[:6])
    assert found == f"$.group: the groups of {first} wait for one another: none of them can be placed first"


def test_sliding_pairs_count_as_hinges_do():
    """A slider and a block in a slot whose rods wait for each other's joint, and a yoke beside them."""
    slider = {"type": "RRP", "node": "B", "pin": "C", "link": "2", "length": 1, "side": "ahead"}
    slider |= {"guide": {"through": [0, 0], "angle_deg": 0}}
    yoke = {
        "type": "RPP",
        "node": "D",
        "pin": "B",
        "slot_deg": 90,
        "guide": {"through": [0, 0], "angle_deg": 0},
    }
    crossed = {
        "type": "PRP",
        "node": "E",
        "guides": [slider["guide"], {"joints": ["B", "C"], "coincident": "E2"}],
    }
    slotted = {"type": "RPR", "node": "B5", "pin": "B", "pivot": "O2", "link": "5"}
    table = mechanism(slider, two("C", "B O3", "3 4"), yoke, crossed, slotted)
    free = "$.group: degrees of freedom: 2 (links with the ground: 11, pairs: 14)"
    assert told(table)[0].startswith(free)
    driven = {key: value for key, value in table.items() if key != "crank"}
    assert told(driven | {"driving_slider": SLIDER})[0].startswith(
        "$.group: degrees of freedom: 2 (links with the ground: 11"
    )


def test_a_yoke_on_a_moving_guide_is_accepted_and_nothing_is_hinged_to_it():
    four_bar = two("B", "A O2", "2 3")
    yoke = {"type": "RPP", "node": "E5", "pin": "E", "link": "5"}
    yoke |= {"guide": {"joints": ["O2", "B"], "coincident": "E3"}}
    point = {"type": "point_on_line", "node": "E", "base": ["O1", "A"], "link": "1", "ratio": 1.5}
    assert told(mechanism(yoke, point, four_bar)) == []
    found = told(mechanism(yoke, point, four_bar, two("F", "E5 O3", "6 7")))
    detail = "a yoke on a moving guide carries no further joint"
    assert found == [f"$.group[3]: E5 is a point of link 5 for this instant only: {detail}"]
    assert told(mechanism(yoke | {"link": "3"}, point, four_bar)) != []
