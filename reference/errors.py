"""Errors of authored files and of mechanisms that cannot be solved.

PlanmarkError            caught once, at the rim
|- AuthoredFileError     a mechanism, assignment, rubric or roster is wrong (exit status 2)
|- CallError             the call is wrong: unknown assignment, n out of range (exit status 2)
|- MechanismError        the mechanism does not assemble, or is singular there (exit status 3)
|- InputFileError        a scan or measurement file cannot be used (exit status 2 where the
                         call names it; in a folder that is graded, a problem of its report)
"""

from dataclasses import dataclass


class PlanmarkError(Exception):
    """What is wrong, where, and what to do. `code` is stable; the message is for people."""

    exit_status = 2

    def __init__(self, code: str, message: str) -> None:
        # A file's name may hold bytes that are no text; told as they are, no report could be written.
        self.message = message.encode("utf-8", "backslashreplace").decode()
        super().__init__(self.message)
        self.code = code

    def __reduce__(self) -> tuple[object, ...]:
        return (type(self), (self.code, self.message))


class CallError(PlanmarkError):
    """The call cannot be carried out as it was given."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One fault of an authored file: where (a path such as ``$.criteria[3].points``), what is right."""

    path: str
    message: str

    def __str__(self) -> str:
        return f"{self.path}: {self.message}"


class AuthoredFileError(PlanmarkError):
    """A mechanism, assignment or rubric file: all its faults at once."""

    def __init__(self, file: str, findings: tuple[Finding, ...]) -> None:
        lines = "\n".join(f"  {finding}" for finding in findings)
        super().__init__("authored_file", f"{file}: {len(findings)} fault(s)\n{lines}")
        self.file = file
        self.findings = findings

    def __reduce__(self) -> tuple[object, ...]:
        return (type(self), (self.file, self.findings))


class MechanismError(PlanmarkError):
    """The mechanism has no position here, or its velocities are not determined."""

    exit_status = 3


class InputFileError(PlanmarkError):
    """A file handed in cannot be used."""
