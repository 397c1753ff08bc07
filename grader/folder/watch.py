"""A folder that a scanner fills: files completed since the last grading."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from grader.files import Stamp, stamp_of
from grader.folder.batch import Batch, files_of
from grader.folder.inventory import shown_name


def arrivals(
    batch: Batch, seconds: float, sleep: Callable[[float], None] = time.sleep
) -> Iterator[tuple[Batch, list[str]]]:
    """Yield what to grade whenever files have come, changed or gone, and their names; without end.

    A file is whole when two looks, `seconds` apart, find it the same; until then the batch passes it over.
    The roster and the decisions count as well. Raises CallError for a folder that is not there.
    """
    graded: dict[Path, Stamp | None] = {}
    before = _looked_at(batch)
    while True:
        sleep(seconds)
        now = _looked_at(batch)
        whole = {path: stamp for path, stamp in now.items() if path in before and before[path] == stamp}
        before = now
        changed = [path for path, stamp in whole.items() if path not in graded or graded[path] != stamp]
        changed += [path for path in graded if path not in now]
        if changed:
            graded = whole
            growing = tuple(path for path in now if path not in whole)
            top = batch.base
            names = [shown_name(one, top) if one.is_relative_to(top) else one.name for one in changed]
            yield replace(batch, growing=growing), names


def _looked_at(batch: Batch) -> dict[Path, Stamp | None]:
    """The files that a run takes in, and by what a change of each shows."""
    others = [path for path in (batch.roster_path, batch.decisions_path) if path.is_file()]
    return {path: stamp_of(path) for path in (*files_of(replace(batch, growing=())), *others)}
