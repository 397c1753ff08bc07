"""Errors travel between processes; names that are near are found."""

import pickle

import pytest

from reference.errors import AuthoredFileError, CallError, Finding, MechanismError, near_names


@pytest.mark.parametrize(
    "error",
    [
        CallError("n_needed", "needs --n"),
        MechanismError("singular", "in line", group="B"),
        MechanismError("does_not_assemble", "the links of B miss each other by {gap}", group="B", gap_m=0.5),
        AuthoredFileError("my.toml", (Finding("$.id", "key_missing"),)),
    ],
)
def test_an_error_is_the_same_after_a_journey_between_processes(error):
    again = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own pickle
    assert type(again) is type(error)
    assert (again.code, again.message, again.exit_status) == (error.code, error.message, error.exit_status)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


def test_a_name_of_endless_length_is_near_to_none():
    assert near_names("lengt", ["length"]) == ["length"]
    assert near_names("length" * 1000, ["length" * 1000]) == []
