"""Measure how many segments, arrow tips and circles, located by eye, are found on real drawings.

    python -m tests.bench.real_paper FOLDER...

A folder holds pictures, and for some of them a `truth-*.json` in pixels: `segments` with ends `a` and `b`,
and the kind of each end: `o` the centre of a joint's circle, `>` an arrow's tip, `.` a dot, `-` a plain end.
They are not sheets of an assignment: the resolution gives the map to millimetres, and ink is sought on the
whole page.
"""

import json
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from grader.records import HEAD_AHEAD, HEAD_BACK, FloatArray, Ink, Page, Sheet, Unread
from grader.scan.decode.pages import page_of
from grader.scan.handwriting.letters import find_letters
from grader.scan.pixels import BoolArray, lengths_and_directions
from grader.scan.register.homography import UNSET_DPI
from grader.scan.strokes.ink import find_ink
from reference.drawing.canvas import MM_PER_INCH
from tests.bench.plain_text import NOTHING, Table, as_text

OFF_MM, FREEHAND_MM = 0.6, 2.0
"""Largest distance of a stroke from its segment: for ruled lines, and for freehand ones."""
END_MM, WHOLE = 3.5, 0.85
"""A segment is found whole by one stroke that reaches this near to both its ends, since lines stop at joints'
circles; drawn freehand, by strokes that cover so much of it."""
TIP_MM, CIRCLE_MM = 1.0, 0.5
SURE = 0.5
"""Least probability of a tip, and of a letter."""
DEFAULT_DPI = 300.0
PICTURES = (".png", ".jpg")


@dataclass(slots=True)
class PageFigures:
    """Counts of items on one picture and of those found; lengths in mm, time in processor seconds."""

    name: str
    strokes: int = 0
    segments: int = 0
    whole: int = 0
    off_mm: list[float] = field(default_factory=list)
    heads: int = 0
    tips: int = 0
    tips_wrong: int = 0
    joints: int = 0
    circles: int = 0
    letters: int = 0
    problems: tuple[str, ...] = ()
    seconds: float = 0.0


def measure(folder: Path) -> list[PageFigures]:
    """A row for each picture of the folder, by its name."""
    truths = [json.loads(path.read_text()) for path in sorted(folder.glob("truth-*.json"))]
    by_picture = {truth["picture"]: truth for truth in truths}
    pictures = sorted(path for path in folder.iterdir() if path.suffix in PICTURES)
    return [measure_page(path, by_picture.get(path.name)) for path in pictures]


def measure_page(path: Path, truth: Mapping[str, Any] | None) -> PageFigures:
    """Compare the ink of one picture with the truth read by eye; without a truth, count what is found."""
    start = time.process_time()
    page = page_of(path, 1)
    stated = page.dpi[0] if page.dpi and page.dpi[0] >= UNSET_DPI else DEFAULT_DPI
    sheet = whole_picture(page, truth["dpi_assumed"] if truth else stated)
    ink = find_ink(page, sheet)
    row = PageFigures(path.name)
    if isinstance(ink, Unread):
        row.problems = ("refused",)
    else:
        row.strokes = len(ink.strokes)
        row.problems = tuple(problem.code for problem in ink.problems)
        row.letters = int((find_letters(ink).probability.max(axis=1, initial=0.0) > SURE).sum())
        if truth is not None:
            _count(row, ink, truth, sheet.px_per_mm)
    row.seconds = time.process_time() - start
    return row


def whole_picture(page: Page, dpi: float) -> Sheet:
    """A sheet as large as the picture, upright, at a resolution."""
    unit = dpi / MM_PER_INCH
    size = page.grey.shape[1] / unit, page.grey.shape[0] / unit
    matrix = np.array([[unit, 0.0, -0.5], [0.0, unit, -0.5], [0.0, 0.0, 1.0]])
    return Sheet(matrix, size, "combined", unit, 0.0, 0.0, 0.0, (0.0, 0.0, *size))


def _count(row: PageFigures, ink: Ink, truth: Mapping[str, Any], px_per_mm: float) -> None:
    row.segments = len(truth["segments"])
    within = OFF_MM if truth["ruled"] else FREEHAND_MM
    centres = set()
    for segment in truth["segments"]:
        ends = (np.array([segment["a"], segment["b"]], dtype=float) + 0.5) / px_per_mm
        along, across, length = _axes(ink.strokes.ends, ends)
        span = np.sort(along, axis=1)
        on = (np.abs(across).max(axis=1) < within) & (span[:, 1] > 0.0) & (span[:, 0] < length)
        if truth["ruled"]:
            whole = on & (span[:, 0] < END_MM) & (span[:, 1] > length - END_MM)
            row.whole += bool(whole.any())
            row.off_mm += [float(np.abs(across[whole].mean(axis=1)).min())] if whole.any() else []
        else:
            places = np.linspace(0.0, length, 200)
            covered = (span[on, :1] <= places) & (places <= span[on, 1:])
            row.whole += bool(covered.any(axis=0).mean() > WHOLE)
        for end, kind in enumerate(segment["ends"]):
            if kind == "o":
                centres.add((float(ends[end, 0]), float(ends[end, 1])))
            elif kind == ">":
                row.heads += 1
                away, sure = _head(ink, on, ends, end)
                row.tips += away < TIP_MM
                row.tips_wrong += bool(away >= TIP_MM and sure > SURE)
    row.joints = len(centres)
    row.circles = sum(
        bool((np.hypot(*(ink.circles[:, :2] - centre).T) < CIRCLE_MM).any()) for centre in centres
    )


def _axes(strokes: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """(n, 2) positions of strokes' ends along and across a segment, and its length."""
    (length,), (u,) = lengths_and_directions(ends[None])
    relative = strokes - ends[0]
    along = relative @ u
    across = relative @ np.array([-u[1], u[0]])
    return along, across, float(length)


def _head(ink: Ink, on: BoolArray, ends: FloatArray, end: int) -> tuple[float, float]:
    """The distance (mm) from an end of the likeliest head on the strokes `on`, and its probability."""
    strokes = ink.strokes.ends[ink.tips.stroke]
    _, u = lengths_and_directions(strokes)
    forward = (u @ (ends[1] - ends[0]) > 0) == (end == 1)
    heads = on[ink.tips.stroke] & (ink.tips.kind == np.where(forward, HEAD_AHEAD, HEAD_BACK))
    if not heads.any():
        return np.inf, 0.0
    best = int(np.where(heads, ink.tips.sure, -1.0).argmax())
    at = strokes[best, 0] + ink.tips.along[best] * u[best]
    return float(np.hypot(*(at - ends[end]))), float(ink.tips.sure[best])


HEADS = (
    "picture", "segments", "off, mm", "tips", "tips wrong", "circles", "letters", "strokes", "s", "problems",
)  # fmt: skip


def table(title: str, rows: list[PageFigures]) -> Table:
    """The figures of each picture, and their sum."""
    return title, HEADS, [_cells(row) for row in [*rows, _total(rows)]]


def _cells(row: PageFigures) -> list[str]:
    off = f"{np.median(row.off_mm):.2f}, {np.max(row.off_mm):.2f}" if row.off_mm else NOTHING
    return [
        row.name, f"{row.whole} of {row.segments}", off, f"{row.tips} of {row.heads}", str(row.tips_wrong),
        f"{row.circles} of {row.joints}", str(row.letters), str(row.strokes), f"{row.seconds:.1f}",
        ", ".join(row.problems) or NOTHING,
    ]  # fmt: skip


def _total(rows: list[PageFigures]) -> PageFigures:
    total = PageFigures("all")
    for row in rows:
        total.off_mm += row.off_mm
        for name in (
            "strokes",
            "segments",
            "whole",
            "heads",
            "tips",
            "tips_wrong",
            "joints",
            "circles",
            "letters",
        ):
            setattr(total, name, getattr(total, name) + getattr(row, name))
        total.seconds += row.seconds
    return total


if __name__ == "__main__":
    cv2.setNumThreads(1)
    print(as_text(table(f"Real drawings: {name}", measure(Path(name))) for name in sys.argv[1:]))
