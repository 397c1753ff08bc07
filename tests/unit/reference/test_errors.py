"""Errors: they travel between processes, and singular mechanisms are named."""

import pickle

import pytest

from reference.authored.assembly import build_mechanism
from reference.authored.mechanism import MechanismFile
from reference.authored.toml_file import validate
from reference.errors import AuthoredFileError, CallError, Finding, MechanismError, near_names
from reference.kinematics.motion import move


@pytest.mark.parametrize(
    "error",
    [
        CallError("n_needed", "needs --n"),
        MechanismError("singular", "in line", group="B"),
        MechanismError("does_not_assemble", "the links of B miss each other by {gap}", group="B", gap_m=0.5),
        AuthoredFileError("my.toml", (Finding("$.id", "is missing"),)),
    ],
)
def test_an_error_is_the_same_after_a_journey_between_processes(error):
    again = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own pickle
    assert type(again) is type(error)
    assert (again.code, again.message, again.exit_status) == (error.code, error.message, error.exit_status)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


def test_a_mechanism_says_which_group_fails_and_by_how_much():
    apart = {"type": "RRR", "node": "B", "pins": ["A", "O2"], "links": ["3", "4"], "lengths": [0.5, 0.5]}
    with pytest.raises(MechanismError, match=r"miss each other by 1 m;") as caught:
        move(build_mechanism(flat({**apart, "side": "left"}), {}, 1))
    assert (caught.value.group, caught.value.gap_m) == ("B", pytest.approx(1.0))


def flat(group: dict, angle_deg: float = 0.0) -> MechanismFile:
    data = {
        "schema_version": 1,
        "id": "flat",
        "title": {"en": "flat"},
        "length_unit": "m",
        "ground": {"O1": [0, 0], "O2": [3, 0]},
        "crank": {"pivot": "O1", "pin": "A", "length": 1, "angle_deg": angle_deg, "omega": 1},
        "group": [group],
    }
    return validate(MechanismFile, data, "flat")


def test_a_dyad_in_line_is_singular_and_named():
    file = flat(
        {
            "type": "RRR",
            "node": "B",
            "pins": ["A", "O2"],
            "links": ["3", "2"],
            "lengths": [1, 1],
            "side": "left",
        }
    )
    with pytest.raises(MechanismError, match="group of B are not determined: its links are in line") as error:
        move(build_mechanism(file, {}, 1))
    assert error.value.code == "singular"


def test_a_rod_square_to_its_guide_is_singular_and_named():
    guide = {"through": [0, 3], "angle_deg": 0}
    file = flat(
        {"type": "RRP", "node": "B", "pin": "A", "link": "2", "length": 3, "guide": guide, "side": "ahead"}
    )
    with pytest.raises(MechanismError, match="group of B are not determined") as error:
        move(build_mechanism(file, {}, 1))
    assert error.value.code == "singular"


def test_a_name_of_endless_length_is_near_to_none():
    assert near_names("lengt", ["length"]) == ["length"]
    assert near_names("length" * 1000, ["length" * 1000]) == []
