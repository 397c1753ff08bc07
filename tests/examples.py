"""The examples of a run: a part of them in the README's command, all of them in `.ci/run`."""

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
"""The README's command tries one of this many examples: most faults break a law at once."""


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
