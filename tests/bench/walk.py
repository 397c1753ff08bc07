"""Trace one scanned sheet through the program, from `grade` to ``feedback.html``.

    python -m tests.bench.walk [--list]

A sample sheet is graded in this process, without workers, while every call is observed. The output lists

- the modules of which a function ran (what runs on import does not count), and the arrows between them;
- the kinds of record (dataclasses and pydantic models of the packages) that crossed from room to room as an
  argument or a result, alone or in a container; apart, those in the pipeline's own calls;
- files and lines of each room, as `docs.make_architecture` counts them.
"""

import argparse
import dataclasses
import shutil
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from pydantic import BaseModel

from docs.make_architecture import PACKAGES, ROOT, modules, room_of, rooms
from grader.folder.batch import Batch, grade
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment

PIPELINE = "grader.pipeline"
STUDENT, SHEET, ROSTER = "s01", "s01_1.jpg", "student_id,name,n\ns01,Student 1,7\n"
"""A flatbed scan of the sample class."""


@dataclass(slots=True)
class Walk:
    """Modules entered, and the kinds of record in the calls from one module to another."""

    modules: set[str] = field(default_factory=set)
    records: dict[tuple[str, str], set[type]] = field(default_factory=lambda: defaultdict(set))

    def observe(self, frame: FrameType, event: str, result: object) -> None:
        """Record one event of `sys.setprofile`."""
        module, code = our_module(frame), frame.f_code
        if event not in {"call", "return"} or not module or code.co_name == "<module>":
            return
        self.modules.add(module)
        caller = frame.f_back
        while caller is not None and not our_module(caller):  # past a library's own frames
            caller = caller.f_back
        if caller is not None and (calling := our_module(caller)) != module:
            names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
            values = [frame.f_locals.get(name) for name in names] if event == "call" else [result]
            self.records[calling, module].update(records_in(values))

    def kinds(self, *, by_pipeline: bool) -> set[type]:
        """Kinds of record that cross from room to room, or are in calls of the pipeline."""
        where = {name: room_of(path) for name, path in modules().items()}
        found: set[type] = set()
        for (caller, called), kinds in self.records.items():
            if caller == PIPELINE if by_pipeline else where[caller] != where[called]:
                found |= kinds
        return found


def our_module(frame: FrameType) -> str:
    """The packages' module that a frame runs in; empty if it is another."""
    name = str(frame.f_globals.get("__name__", ""))
    return name if name.partition(".")[0] in PACKAGES else ""


def records_in(value: object) -> Iterator[type]:
    """The packages' kinds of record in a value."""
    kind = type(value)
    if kind.__module__.partition(".")[0] in PACKAGES:
        if dataclasses.is_dataclass(kind) or issubclass(kind, BaseModel):
            yield kind
    elif isinstance(value, list | tuple | set | frozenset | dict):
        for one in value.values() if isinstance(value, dict) else value:
            yield from records_in(one)


class InProcess:
    """Runs calls in this process instead of workers."""

    def run(self, function: Callable[..., Any], calls: Iterable[Any], *_: object) -> Iterator[Any]:
        """Run the calls; each result with its index."""
        return ((index, function(*call)) for index, call in enumerate(calls))


def walk_of_a_sheet(folder: Path) -> Walk:
    """Grade the sample sheet into a folder. Raises FileNotFoundError if there is no feedback."""
    handed_in, out, walk = folder / "in", folder / "out", Walk()
    handed_in.mkdir()
    shutil.copy(ROOT / "samples" / "pump" / SHEET, handed_in)
    (handed_in / "roster.csv").write_text(ROSTER, encoding="utf-8")
    assignment = load_assignment("pump")
    sys.setprofile(walk.observe)
    try:
        grade(Batch(assignment, rubric_of(assignment), handed_in, out), lambda *_: None, InProcess())
    finally:
        sys.setprofile(None)
    (out / STUDENT / "feedback.html").stat()
    return walk


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="The walk of one scanned sheet through the program.")
    parser.add_argument("--list", action="store_true", help="name modules and kinds of record")
    with tempfile.TemporaryDirectory() as temporary:
        seen = walk_of_a_sheet(Path(temporary))
    between, piped = (seen.kinds(by_pipeline=flag) for flag in (False, True))
    print(f"modules entered: {len(seen.modules)}; arrows: {len(seen.records)}")
    print(f"kinds of record between rooms: {len(between)}; in calls of the pipeline: {len(piped)}")
    if parser.parse_args().list:
        print(*sorted(seen.modules), *sorted(map(str, between | piped)), sep="\n")
    for room in rooms():
        print(f"{room.name:28}{room.lines:7} lines")
