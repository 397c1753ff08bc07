"""What the QR code of a printed page says: ``planmark1|assignment|student_id|n=7|p=|velocity``."""

import re

from grader.records import Identity

VERSION = "planmark1"
KINDS = ("all", "velocity", "acceleration")
MAX_LENGTH = 200
_NAME = r"[A-Za-z0-9._-]{1,64}"
_NUMBER = r"(?:-?[0-9]{1,9})?"
_CODE = re.compile(
    rf"{VERSION}\|(?P<assignment>{_NAME})\|(?P<student>{_NAME})\|n=(?P<n>{_NUMBER})\|p=(?P<position>{_NUMBER})"
    rf"\|(?P<kind>{'|'.join(KINDS)})"
)


def code_of(identity: Identity) -> str:
    """The text of the code. Raises ValueError for an identity that could not be read back."""
    n = "" if identity.n is None else identity.n
    position = "" if identity.position is None else identity.position
    code = f"{VERSION}|{identity.assignment}|{identity.student_id}|n={n}|p={position}|{identity.kind}"
    if identity_of(code) != identity:
        raise ValueError(f"an identity with names of A-Z a-z 0-9 . _ - is expected, not {identity}")
    return code


def identity_of(code: str) -> Identity | None:
    """The identity in a code's text, None for anything that is no code of a printed page."""
    match = _CODE.fullmatch(code) if len(code) <= MAX_LENGTH else None
    if match is None or set(match["student"]) == {"."}:
        return None
    n, position = (int(match[name]) if match[name] else None for name in ("n", "position"))
    return Identity(match["assignment"], match["student"], n, position, match["kind"])
