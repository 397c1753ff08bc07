"""What is tried: a part of the examples in the README's command, all of them in `.ci/run`."""

import os
from collections.abc import Iterable
from typing import TypeVar

import pytest
from _pytest.mark.structures import ParameterSet

Case = TypeVar("Case")

PROFILE = os.environ.get("HYPOTHESIS_PROFILE", "quick")
"""`quick`; `full` with all examples; `fresh` with as many that are drawn anew."""
FULL = PROFILE in {"full", "fresh"}
SHARE = 5
"""Of so many examples the README's command tries one: what breaks a law mostly breaks it at once."""


def examples(number: int) -> int:
    """The examples of this run, of so many."""
    return number if FULL else max(number // SHARE, 2)


def slow(*cases: object) -> list[ParameterSet]:
    """Cases that `.ci/run` alone tries, beside those of every run."""
    return [
        pytest.param(*(one if isinstance(one, tuple) else (one,)), marks=pytest.mark.slow) for one in cases
    ]


def sample(cases: Iterable[Case]) -> list[Case]:
    """The cases of this run, of all."""
    return list(cases)[:: 1 if FULL else SHARE]
