"""A mechanism written down as an authored file is the same mechanism."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from reference.authored.assembly import build_mechanism
from reference.authored.mechanism import MechanismFile, check_mechanism
from reference.authored.toml_file import validate
from reference.kinematics.motion import move
from reference.mechanism import Mechanism
from tests.laws.mechanisms import authored

ROUNDING = 1e-9
"""Relative; an angle goes through degrees, a plate's shape through its sides."""


@given(st.from_type(Mechanism))
def test_a_mechanism_as_a_file_moves_as_the_mechanism(mechanism):
    file = validate(MechanismFile, authored(mechanism), "the file")
    findings = list(check_mechanism(file))
    # The lot may hinge a group to one link twice; a file must not.
    assume("all_on_link" not in {finding.code for finding in findings})
    assert not findings
    built = build_mechanism(file, {}, 1)
    motion, other = move(mechanism), move(built)
    assert motion.position.keys() <= other.position.keys()
    assert motion.omega.keys() == other.omega.keys()
    for what in ("position", "velocity", "acceleration"):
        rates, others = getattr(motion, what), getattr(other, what)
        size = max(4.0, *(float(np.abs(z)[0]) for z in rates.values()))
        assert all(np.abs(rates[name] - others[name])[0] <= ROUNDING * size for name in rates)
