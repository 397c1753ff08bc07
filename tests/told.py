"""The sentences of faults, for tests that compare them."""

import re
from collections.abc import Callable, Iterable

from grader.texts.spoken import ENGLISH, clause, in_english
from reference.authored.formula import FormulaError
from reference.errors import Finding, PlanmarkError


def by_path(findings: Iterable[Finding]) -> dict[str, str]:
    """Return the sentences of findings by their places: a path, or a line of a table and a column."""
    return {
        ", ".join(filter(None, (f"line {one.line}" * bool(one.line), one.path))): clause(one, ENGLISH)
        for one in findings
    }


def tells(pattern: str | None) -> Callable[[Exception], bool]:
    """Return a check for `pytest.raises`: whether the error's sentence has this pattern, if any."""

    def check(error: Exception) -> bool:
        if isinstance(error, FormulaError):
            told = f"{error.path}: {clause(error, ENGLISH)}"
        else:
            told = in_english(error) if isinstance(error, PlanmarkError) else str(error)
        return pattern is None or re.search(pattern, told) is not None

    return check
