"""Published results of force analysis: source and error beside each case.

``R_1-2`` is the force of link 1 on link 2 (sliders by their joints, the frame by 0), ``F_i2`` an inertia
force, ``M_b`` the balancing moment, counter-clockwise positive.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from reference.authored.assembly import LENGTH_UNITS_M, Numbers, build_mechanism
from reference.authored.bodies import Masses, check_masses, with_centres, with_masses
from reference.authored.formula import parse
from reference.authored.mechanism import MechanismFile, check_mechanism
from reference.authored.toml_file import validate
from reference.kinematics.motion import move
from reference.kinetics import Forces, forces_of
from reference.mechanism import short_name

CASES = json.loads((Path(__file__).parent / "published_forces.json").read_text(encoding="utf-8"))
ROUNDING = 1e-11


def solved(case: dict) -> Forces:
    table = {"schema_version": 1, "id": "case", "title": {"en": "case"}, **case["mechanism"]}
    file = validate(MechanismFile, table, case["id"])
    masses = validate(Masses, case["assignment"], case["id"])
    assert not list(check_mechanism(file))
    assert not list(check_masses(masses, file, build_mechanism(file, {}, 1)))
    mechanism = build_mechanism(with_centres(file, masses.body), {}, 1)
    mechanism = with_masses(mechanism, Numbers({}, 1, LENGTH_UNITS_M[file.length_unit]), masses)
    return forces_of(mechanism, move(mechanism))


def value(forces: Forces, name: str) -> complex:
    """By the name in the table: of a reaction, an inertia force, the balancing moment."""
    kind, _, about = name.partition("_")
    if kind == "M":
        return complex(forces.balancing.moment[0])
    if kind == "F":
        return complex(next(one.force[0] for one in forces.given if one.name == name))
    by, on = about.split("-")
    for one in (*forces.hinges.values(), *forces.guides.values()):
        pair = short_name(one.by), short_name(one.on)
        if pair in {(by, on), (on, by)}:
            return complex(one.force[0] if pair == (by, on) else -one.force[0])
    raise KeyError(name)


def number(written: str | float) -> float:
    return float(parse(written)({})) if isinstance(written, str) else written


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_published_forces_are_met_within_the_error_of_their_print(case):
    forces = solved(case)
    for name, printed in case["published"].items():
        expected = complex(*map(number, printed)) if isinstance(printed, list) else complex(number(printed))
        # A vector's two components may each be rounded.
        allowed = case.get("relative", 0.0) * abs(expected) + case.get("absolute", 0.0) * np.sqrt(2.0)
        assert abs(value(forces, name) - expected) <= allowed, name


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_the_power_of_forces_in_published_examples_is_in_balance(case):
    assert abs(solved(case).power_residual[0]) <= ROUNDING


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_every_case_says_where_it_is_from_and_how_exact_it_is(case):
    assert case["source"]
    assert case["accuracy"]
    assert case["language"] in {"en", "ru"}
    assert len({"absolute", "relative"} & case.keys()) == 1


def test_published_forces_are_of_more_than_one_language():
    assert len({case["language"] for case in CASES}) > 1
