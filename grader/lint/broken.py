"""Variants whose mechanism cannot be solved: which, at which group, by how much."""

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from grader.lint.findings import LintFinding
from grader.lint.places import group_place
from reference.assignment import Assignment, Variant
from reference.motion import move_where_possible
from reference.refusal import reason

_GAP = re.compile(r"\bby ([0-9.]+(?:e[-+]?[0-9]+)?) m\b")
_ABOUT_ARRAYS = re.compile(r" \(1 of \d+ variant\(s\), the first at index \d+\)")
"""What a message says of how many variants of how many: here it is always one."""
_GROUP = re.compile(r"the group of (\w+)")


@dataclass(frozen=True, slots=True)
class Broken:
    """A variant that cannot be solved, and why."""

    variant: Variant
    code: str
    message: str


def broken_variants(assignment: Assignment, variants: list[Variant]) -> list[Broken]:
    """The variants that do not assemble or are singular: all at once, the reason of each by itself."""
    mechanism = assignment.mechanism(variants)
    lost = ~np.isfinite(move_where_possible(mechanism).predicted_error)
    found = []
    for index in np.flatnonzero(lost):
        error = reason(mechanism, np.arange(len(variants)) == index)
        found.append(Broken(variants[index], error.code, _ABOUT_ARRAYS.sub("", error.message)))
    return found


def broken_findings(assignment: Assignment, broken: Sequence[Broken]) -> Iterator[LintFinding]:
    """A fault for each group and reason, with all its variants and the range of the gaps."""
    alike: dict[tuple[str, str], list[Broken]] = defaultdict(list)
    for one in broken:
        alike[one.code, _GAP.sub("by {}", one.message)].append(one)
    for (code, _), ones in alike.items():
        group = _GROUP.search(ones[0].message)
        file, path = group_place(assignment, group.group(1) if group else None)
        variants = tuple(one.variant for one in ones)
        yield LintFinding("fault", code, file, path, _together([one.message for one in ones]), variants)


def _together(messages: Sequence[str]) -> str:
    """Messages that differ only in the gap as one, with the gap's range."""
    gaps = [float(found.group(1)) for message in messages if (found := _GAP.search(message))]
    if not gaps or max(gaps) == min(gaps):
        return messages[0]
    return _GAP.sub(f"by {min(gaps):.3g} to {max(gaps):.3g} m", messages[0], count=1)
