"""Documents of earlier versions of the program, brought up to today's; those of later ones refused.

`schema_version` is raised where keys change their meaning or go. Keys that are only added have a
default and need nothing here.
"""

from collections.abc import Callable, Mapping
from typing import Any

from grader.documents import SCHEMA_VERSION
from reference.errors import InputFileError

Step = Callable[[dict[str, Any]], dict[str, Any]]
STEPS: Mapping[int, Step] = {}
"""By version, what makes a class's results of it those of the next. There has been one version so far:
a second one brings its step."""


def current(
    told: Any,  # noqa: ANN401 - whatever a JSON file holds
    file: str,
    steps: Mapping[int, Step] = STEPS,
    newest: int = SCHEMA_VERSION,
) -> Any:  # noqa: ANN401 - the same
    """Results as read from a file, in today's version; what is no such document comes back as it is.

    Raises InputFileError for results of a later version.
    """
    version = told.get("schema_version") if isinstance(told, dict) else None
    if not isinstance(version, int) or version < 1:
        return told
    if version > newest:
        raise InputFileError(
            "results_newer",
            f"{file}: a later version of planmark wrote this (schema_version {version}, known"
            f" is {newest}); update planmark, or grade again with this one",
        )
    for step in range(version, newest):
        told = {**steps[step](told), "schema_version": step + 1}
    return told
