"""Errors of authored files and of mechanisms that cannot be solved.

PlanmarkError            caught once, at the rim
|- AuthoredFileError     a mechanism, assignment, rubric or roster is wrong (exit status 2)
|- CallError             the call is wrong: unknown assignment, n out of range (exit status 2)
|- MechanismError        the mechanism does not assemble, or is singular there (exit status 3)
|- InputFileError        a scan or measurement file cannot be used (exit status 2 where the
                         call names it; in a folder that is graded, a problem of its report)
"""

import difflib
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

MOST_FINDINGS = 20
"""Findings shown at once: a hostile file may have a million."""
_LONGEST_NAME = 64
"""Longer names match no known name, and comparing them takes the square of their length."""


Parameter = float | str | tuple[str, ...]
"""A value that a sentence names."""


def writable(text: str) -> str:
    """Return text that can be written: the bytes in a file's name that are no text become escapes."""
    return text.encode("utf-8", "backslashreplace").decode()


class PlanmarkError(Exception):
    """An error that says what is wrong, where, and what to do. `code` is stable; the message is for people.

    Attributes
    ----------
    message : empty where only the sentence of the code, made of the parameters, tells it
    parameters : what the message names, from which it can be told in another language; empty where it cannot
    faults : reasons that are listed below its sentence
    """

    exit_status = 2
    faults: tuple[Any, ...] = ()

    def __init__(self, code: str, message: str = "", **parameters: Parameter) -> None:
        self.message, self.code = writable(message), code
        self.parameters = {k: writable(one) if isinstance(one, str) else one for k, one in parameters.items()}
        super().__init__(self.message or f"{code} {parameters or ''}".strip())

    def __reduce__(self) -> tuple[object, ...]:
        # Errors return from worker processes unchanged, whatever arguments their classes take.
        return (type(self).__new__, (type(self), *self.args), self.__dict__)


class CallError(PlanmarkError):
    """The call cannot be carried out as it was given."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One fault of an authored file, as data: `grader.texts` makes its sentence in the reader's language.

    Attributes
    ----------
    path : in the file, such as ``$.criteria[3].points``; in a table's file a column, or nothing
    code, parameters : of its sentence in `grader.texts.authored`, and the values that this names
    line : of a table's file, from 1; 0 where the fault is of no single line
    """

    path: str
    code: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    line: int = 0


class FaultError(ValueError):
    """A fault whose place in the file is not known where it is found; validators raise it, too.

    Attributes
    ----------
    code, parameters : as those of a `Finding`
    """

    def __init__(self, code: str, **parameters: Parameter) -> None:
        super().__init__(f"{code} {parameters or ''}".strip())
        self.code, self.parameters = code, parameters

    def at(self, path: str, line: int = 0, /, **more: Parameter) -> Finding:
        """Return the finding at its place."""
        return Finding(path, self.code, {**self.parameters, **more}, line)


def near_names(name: str, known: Iterable[str], *, most: int = 2, cutoff: float = 0.6) -> list[str]:
    """Return the known names that a misspelt name may stand for, nearest first, ignoring case.

    Arguments: `cutoff` is the least similarity, 0..1, as `difflib` counts it.
    """
    if len(name) > _LONGEST_NAME:
        return []
    by_lower = {each.lower(): each for each in known}
    return [by_lower[near] for near in difflib.get_close_matches(name.lower(), by_lower, most, cutoff)]


def nearest(name: str, known: Iterable[str], most: int = 1) -> dict[str, Parameter]:
    """Return, as a parameter, the known names that a misspelt name may stand for; or nothing."""
    near = tuple(near_names(name, known, most=most))
    return {"near": near} if near else {}


def runs_of(numbers: Sequence[int]) -> list[list[int]]:
    """Group ascending whole numbers into runs of consecutive ones."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return runs


def ranges_of(numbers: Sequence[int]) -> str:
    """Describe ascending whole numbers: ``1..30``, or with gaps ``1..9, 11, 13, 14``."""
    runs = runs_of(numbers)
    return ", ".join(f"{run[0]}..{run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs)


def look_alikes(text: str) -> dict[str, Parameter]:
    """Return, as a parameter, the first letters that only look Latin, such as the Cyrillic А; or nothing."""
    foreign = dict.fromkeys(letter for letter in text if letter.isalpha() and not letter.isascii())
    letters = tuple(f"'{one}' is {unicodedata.name(one, 'no letter')}" for one in [*foreign][:3])
    return {"letters": letters} if letters else {}


class AuthoredFileError(PlanmarkError):
    """All faults of a mechanism, assignment or rubric file and of the files with it."""

    def __init__(
        self, file: str, findings: tuple[Finding, ...], others: Sequence["AuthoredFileError"] = ()
    ) -> None:
        super().__init__("authored_file")
        self.file, self.findings, self.others = file, findings, tuple(others)

    def __str__(self) -> str:
        return "\n".join(f"{one.file}: {one.findings}" for one in (self, *self.others))


class Faults:
    """Gather the faults of several files, so that one error reports them all.

    Used in a `with` block, it catches AuthoredFileError, and the next block runs; `tell` raises all of them.
    """

    def __init__(self) -> None:
        self.errors: list[AuthoredFileError] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if isinstance(error, AuthoredFileError):
            self.errors += [AuthoredFileError(error.file, error.findings), *error.others]
        return isinstance(error, AuthoredFileError)

    def add(self, file: Path, findings: Iterable[Finding]) -> None:
        """Add the findings of one file, if there are any."""
        if found := tuple(findings):
            self.errors.append(AuthoredFileError(str(file), found))

    def pass_to(self, others: "Faults | None") -> None:
        """Add everything gathered to others; raise it if there are none."""
        if others is None:
            self.tell()
        else:
            others.errors += self.errors

    def tell(self) -> None:
        """Raise AuthoredFileError with everything gathered, by file; do nothing if there is nothing."""
        found: dict[str, dict[str, Finding]] = {}
        for error in self.errors:
            found.setdefault(error.file, {}).update((str(one), one) for one in error.findings)
        told = [AuthoredFileError(file, tuple(findings.values())) for file, findings in found.items()]
        if told:
            raise AuthoredFileError(told[0].file, told[0].findings, told[1:])


class MechanismError(PlanmarkError):
    """The mechanism has no position here, or its velocities are not determined.

    Attributes
    ----------
    template : the message, with ``{gap}`` where the gap stands in it, or the directions of the assemblies
    group : the joint that the failing group places; None where no single group is meant
    gap_m : by how much the group's links miss each other; None where they meet
    texts : what stands for ``{gap}``
    """

    exit_status = 3

    def __init__(
        self,
        code: str,
        template: str,
        *,
        group: str | None = None,
        gap_m: float | None = None,
        texts: str = "",
    ) -> None:
        texts = texts if gap_m is None else f"{gap_m:.6g} m"
        known: dict[str, Parameter] = {"texts": texts} if texts else {}
        message = template.replace("{gap}", texts)
        super().__init__(code, message, **{} if group is None else {"node": group}, **known)
        self.template, self.group, self.gap_m, self.texts = template, group, gap_m, texts

    def after(self, told: str) -> "MechanismError":
        """Return the same error with something told before its message."""
        code, template = self.code, f"{told}{self.template}"
        return MechanismError(code, template, group=self.group, gap_m=self.gap_m, texts=self.texts)


class InputFileError(PlanmarkError):
    """A file handed in cannot be used."""
