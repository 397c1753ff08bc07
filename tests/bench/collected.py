"""Measure how well points are read on sheets that departments donated (`planmark collect`).

    python -m tests.bench --collected F.zip [--assignment FILE]

Each page is read again from its pixels; the truth is known from the donors' decisions. Points that only the
program confirmed are counted apart: they show how stable a reading is, not how right. Points whose verdict
a person found wrong have no known position, and are left out.
"""

import json
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from grader.overlay.covered import reopened
from grader.pipeline import read_pages
from grader.records import Page, PageRef, Reading, ScannedPage, Sheet, Unread
from grader.rubric import asked_of, rubric_of
from grader.scan.handwriting.letters import find_letters
from grader.scan.strokes.ink import find_ink
from reference.authored.assignment import load_assignment
from samples.simulation.wording import declared_texts
from tests.bench.plain_text import NOTHING, Table, as_text

WITHIN_MM = (0.3, 0.5, 1.0)
SURELY = 0.9
"""Confidence from which a point is asserted, as of a vector in `grader.pipeline`."""
KINDS = (("by a person", ("moved", "audited", "decided")), ("by the program alone", ("program",)))


@dataclass(frozen=True, slots=True)
class Point:
    """A point of a figure: who confirmed it, the error of its reading, and the reading's confidence.

    `off_mm` is None where it was not read.
    """

    by: str
    off_mm: float | None
    confidence: float = 0.0

    @property
    def is_misread(self) -> bool:
        """True if it was read with confidence at a wrong place."""
        return self.off_mm is not None and self.confidence >= SURELY and self.off_mm > WITHIN_MM[-1]


def points_of(file: Path, assignment: str | None = None) -> Iterator[Point]:
    """The points of all pages; `assignment` is a file to use instead of the one named in them."""
    with zipfile.ZipFile(file) as archive:
        for line in archive.read("truth.jsonl").decode().splitlines():
            row = json.loads(line)
            grey = reopened(archive.read(row["page"]))
            if grey is not None:
                yield from _of_page(row, Page(row["page"], 1, grey), assignment or row["assignment"])


def _of_page(row: dict[str, Any], image: Page, name: str) -> Iterator[Point]:
    assignment = load_assignment(name)
    page, sheet = ScannedPage(PageRef(row["page"]), image), sheet_of(row)
    ink = find_ink(image, sheet)
    read = Reading({})
    if not isinstance(ink, Unread):
        page = replace(page, sheet=sheet, ink=replace(ink, letters=find_letters(ink)))
        variant = assignment.variant(row["n"], row["position"])
        declared = declared_texts({name: value for name, value in row["scales"].items() if value})
        wanted = asked_of(assignment, rubric_of(assignment)).vectors
        (done,) = read_pages([page], assignment, variant, declared, wanted)
        read = done.reading
    for figure, nodes in row["figures"].items():
        found = read.figures[figure].nodes if figure in read.figures else {}
        for node, (x, y, by) in nodes.items():
            one = found.get(node)
            yield Point(by, None) if one is None else Point(by, abs(one.at - complex(x, -y)), one.confidence)


def sheet_of(row: dict[str, Any]) -> Sheet:
    """A page's registration."""
    known = row["sheet"]
    zones = {name: tuple(box) for name, box in known["zones"].items()}
    return Sheet(
        np.array(row["mm_to_px"]), tuple(known["page_mm"]), known["method"], known["px_per_mm"], 0.0,
        known["residual_mm"], known["scale_se"], tuple(known["drawable_mm"]), zones,
    )  # fmt: skip


def collected_table(points: Sequence[Point]) -> Table:
    """The shares of the points that are read, within which errors, and with confidence."""
    heads = ("known", "points", "read", *(f"within {mm} mm" for mm in WITHIN_MM), "asserted", "misread")
    rows = []
    for kind, names in KINDS:
        own = [one for one in points if one.by in names]
        off = [one.off_mm for one in own if one.off_mm is not None]
        shares = [len(off), *(sum(one <= mm for one in off) for mm in WITHIN_MM)]
        sure = sum(one.confidence >= SURELY for one in own)
        told = [f"{100.0 * count / len(own):.1f} %" if own else NOTHING for count in (*shares, sure)]
        rows.append((kind, str(len(own)), *told, f"{sum(one.is_misread for one in own)} of {sure}"))
    return "Points of collected sheets", heads, rows


def measured(file: Path, assignment: str | None = None) -> str:
    """The table of a file as text."""
    return as_text([collected_table(list(points_of(file, assignment)))])
