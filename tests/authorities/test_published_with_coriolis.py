"""Published results of mechanisms with slotted links and moving guides: source and error beside each case."""

import json
from pathlib import Path

import numpy as np
import pytest

from reference.authored.assembly import build_mechanism
from reference.authored.mechanism import MechanismFile, check_mechanism
from reference.authored.toml_file import validate
from reference.construction.derive import construction_of
from reference.construction.graph import evaluate, parameters_of
from reference.kinematics.motion import move

CASES = json.loads((Path(__file__).parent / "published.json").read_text(encoding="utf-8"))


class Solved:
    """A case's mechanism: its motion, and the vectors of its plans as the construction draws them."""

    def __init__(self, case: dict) -> None:
        table = {"schema_version": 1, "id": "case", "title": {"en": "case"}, **case["mechanism"]}
        file = validate(MechanismFile, table, case["id"])
        assert not list(check_mechanism(file))
        mechanism = build_mechanism(file, {}, 1)
        self.motion = move(mechanism)
        self.construction = construction_of(mechanism)
        self.nodes = evaluate(self.construction, parameters_of(mechanism, *map(np.asarray, (1.0, 1.0, 1.0))))

    def vector(self, name: str) -> complex:
        vector = self.construction.vectors[name]
        return complex(np.ravel(self.nodes[vector.head] - self.nodes[vector.tail])[0])

    def value(self, name: str):
        """By the name in the table: of a joint, a vector, a rate; a difference; a magnitude."""
        if name.startswith("|"):
            return abs(self.value(name.strip("|")))
        if " - " in name:
            one, other = name.split(" - ")
            return self.value(one) - self.value(other)
        kind, _, about = name.partition("_")
        if kind in {"omega", "epsilon"}:
            return float(getattr(self.motion, kind)[about][0])
        return complex(self.motion.position[about][0]) if kind == "r" else self.vector(name)

    def size(self, name: str) -> float:
        """The size of the figure in which a value is measured: of a plan its longest vector."""
        kind = name.strip("|")[0]
        if kind == "r":
            return max(float(np.abs(place)[0]) for place in self.motion.position.values())
        names = (one for one in self.construction.vectors if one[0] == kind)
        return max(abs(self.vector(one)) for one in names)


def allowed(case: dict, name: str, value, solved: Solved) -> float:
    if "absolute" in case:
        return case["absolute"] * (2**0.5 if isinstance(value, complex) else 1.0)
    if "relative" in case:
        return case["relative"] * abs(value)
    # A hand's error is a share of the plan it draws, not of the vector it measures.
    return case["share_of_plan"] * solved.size(name)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_published_values_are_met_within_the_error_of_their_print(case):
    solved = Solved(case)
    for name, printed in case["published"].items():
        value = complex(*printed) if isinstance(printed, list) else printed
        assert abs(solved.value(name) - value) <= allowed(case, name, value, solved), name


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_every_case_says_where_it_is_from_and_how_exact_it_is(case):
    assert case["source"]
    assert case["accuracy"]
    assert len({"absolute", "relative", "share_of_plan"} & case.keys()) == 1
