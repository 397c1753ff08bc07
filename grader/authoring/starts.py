"""Mechanisms to start from: assignments in the library's folder `starts`, without a rubric of their own."""

from pathlib import Path

from reference.assignment import SUFFIXES, Assignment, library, load_assignment
from reference.errors import CallError


def folder() -> Path:
    """Where they lie."""
    return library() / "starts"


def starts() -> list[str]:
    """Their names."""
    suffix = SUFFIXES["assignment"]
    return sorted(path.name.removesuffix(suffix) for path in folder().glob(f"*{suffix}"))


def load_start(name: str) -> Assignment:
    """One of them; CallError for an unknown name."""
    if name not in starts():
        raise CallError(
            "unknown_mechanism",
            f"--mechanism {name}: there are {', '.join(starts())}; or --like an assignment",
        )
    return load_assignment(folder() / f"{name}{SUFFIXES['assignment']}")
