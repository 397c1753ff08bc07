"""Findings of lint: severity, place in a file, message, and the variants concerned."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from grader.language import Tongue
from grader.records import Reason
from grader.texts.spoken import ENGLISH, clause
from reference.authored.assignment import Assignment, Variant
from reference.errors import Parameter, runs_of

Severity = Literal["fault", "warning", "hint"]
"""fault: some student cannot be set or marked; warning: something a teacher should change or accept;
hint: good to know."""
SEVERITIES: tuple[Severity, ...] = ("fault", "warning", "hint")
File = Literal["assignment", "mechanism", "rubric", "table"]
BoolArray = NDArray[np.bool_]
NAMED = 6
"""Ranges of numbers named in a message; the rest is only counted."""


@dataclass(frozen=True, slots=True)
class LintFinding:
    """A finding: its severity, a stable code, its path (such as ``$.criterion[3]``), what its sentence names.

    `variants` is empty if the finding concerns the files as such; `names_them` is true if the sentence names
    the variants itself; `why` is the code of the sentence where several share the code.
    """

    severity: Severity
    code: str
    file: File
    path: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    variants: tuple[Variant, ...] = ()
    names_them: bool = False
    why: str = ""

    def message(self, speaker: Tongue = ENGLISH) -> str:
        """Return the finding's sentence."""
        return clause(Reason(self.why or self.code, self.parameters), speaker)

    def told(self, speaker: Tongue = ENGLISH) -> str:
        """Return the finding in one line: its place, its sentence, its variants."""
        numbered = [variant for variant in self.variants if variant.numbers]
        concerned = f" ({named(numbered)})" if numbered and not self.names_them else ""
        return f"{self.file} {self.path}: {self.message(speaker)}{concerned}"


def chosen(variants: Sequence[Variant], which: BoolArray) -> tuple[Variant, ...]:
    """Return the variants where `which` (N,) is true."""
    return tuple(variant for variant, is_so in zip(variants, which, strict=True) if is_so)


def named(variants: Iterable[Variant]) -> str:
    """Name variants as people do: ``n = 3..7, 12``; with positions ``n = 3, 4, position = 0``."""
    numbers_with: dict[tuple[int, ...], list[int]] = {}
    for n, group in groupby(variants, key=lambda variant: variant.n):
        positions = tuple(variant.position for variant in group if variant.position is not None)
        numbers_with.setdefault(positions, []).extend([] if n is None else [n])
    parts = [
        ", ".join(
            f"{name} = {_ranges(numbers)}"
            for name, numbers in (("n", known), ("position", positions))
            if numbers
        )
        for positions, known in numbers_with.items()
    ]
    return first_of(parts, "; ") or "the only variant"


def first_of(texts: Sequence[str], between: str = ", ") -> str:
    """Join the first six texts, and say how many more there are."""
    more = len(texts) - NAMED
    return between.join(texts[:NAMED]) + (f"{between}... (+{more})" if more > 0 else "")


def _ranges(numbers: Sequence[int]) -> str:
    """Format ascending whole numbers, with runs of three and more as ranges."""
    runs = runs_of(numbers)
    texts: list[str] = []
    for run in runs:
        texts.extend([f"{run[0]}..{run[-1]}"] if len(run) > 2 else map(str, run))
    if len(texts) <= NAMED + 2:
        return ", ".join(texts)
    counted = sum(len(run) for run in runs[NAMED:])
    return ", ".join(texts[:NAMED]) + f", ... (+{counted})"


# Places in files ----------------------------------------------------------------------------------


def mechanism_place(assignment: Assignment, key: str = "") -> tuple[File, str]:
    """Return the file and path of a key of the mechanism, which may be in the assignment's file."""
    if isinstance(assignment.file.mechanism, str):
        return "mechanism", f"${key}"
    return "assignment", f"$.mechanism{key}"


def group_place(assignment: Assignment, joint: str | None) -> tuple[File, str]:
    """Return the file and path of the group that adds a joint, of the driving link, or of the mechanism."""
    tables = assignment.mechanism_file.group
    for index, table in enumerate(tables):
        if joint is not None and joint == getattr(table, "node", None):
            return mechanism_place(assignment, f".group[{index}]")
    return mechanism_place(assignment)


def group_of_image(assignment: Assignment, node: str) -> tuple[File, str]:
    """Return the path of the group whose joint has this image in a plan: ``b'`` is made by the group of B."""
    joint = node.removesuffix("'")
    known = {table.node.lower(): table.node for table in assignment.mechanism_file.group}
    return group_place(assignment, known.get(joint))
