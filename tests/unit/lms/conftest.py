"""Fixtures of exports."""

import pytest

from tests.unit.lms import classroom


@pytest.fixture
def a_class():
    return classroom.a_class()
