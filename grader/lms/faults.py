"""Refusals that name everything that is wrong at once."""

from collections.abc import Sequence

from pydantic import ValidationError

from grader.files import OutputError

MOST = 20
"""Faults told; of a class of hundreds the rest are alike."""


def listed(faults: Sequence[str]) -> str:
    """Faults a line each, below a message's first."""
    lines = [f"\n  {fault}" for fault in faults[:MOST]]
    if len(faults) > MOST:
        lines.append(f"\n  and {len(faults) - MOST} more")
    return "".join(lines)


def in_a_row(names: Sequence[str]) -> str:
    """Names in one line, the first of many."""
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    return ", ".join(names[:MOST]) + more


def faults_of(error: ValidationError) -> list[str]:
    """What a model found wrong, with the path in the document."""
    return [f"{_path(one['loc'])}: {_plain(one['msg'])}" for one in error.errors()]


def _path(parts: Sequence[int | str]) -> str:
    return "$" + "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts)


def _plain(message: str) -> str:
    return message.removeprefix("Value error, ")


def not_as_meant(what: str) -> OutputError:
    """The last check before a file is written has failed."""
    return OutputError("not_as_meant", f"{what} does not read back as it was meant; nothing was written")
