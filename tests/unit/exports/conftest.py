"""Fixtures of exports."""

import pytest

from tests.unit.exports import classroom


@pytest.fixture
def a_class():
    return classroom.a_class()
