"""How many examples a law is tried with: few in the README's command, all of them in `.ci/run`."""

import os
from collections.abc import Iterable
from typing import TypeVar

Case = TypeVar("Case")

PROFILE = os.environ.get("HYPOTHESIS_PROFILE", "quick")
"""`quick`; `full` with all examples; `fresh` with as many that are drawn anew."""
FULL = PROFILE in {"full", "fresh"}
SHARE = 5
"""Of so many examples the README's command tries one: what breaks a law mostly breaks it at once."""


def examples(number: int) -> int:
    """The examples of this run, of so many."""
    return number if FULL else max(number // SHARE, 2)


def sample(cases: Iterable[Case]) -> list[Case]:
    """The cases of this run, of all."""
    return list(cases)[:: 1 if FULL else SHARE]
