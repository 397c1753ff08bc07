"""Random mechanisms for tests that ask for a `Mechanism`."""

from hypothesis import strategies as st

from reference.mechanism import Mechanism
from tests.laws.mechanisms import mechanisms


def pytest_configure(config):  # noqa: ARG001 - pytest's signature
    st.register_type_strategy(Mechanism, mechanisms())
