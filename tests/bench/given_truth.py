"""The gain from perfect parts: sheets read with tips or strokes given from the truth.

    python -m tests.bench.given_truth [--scene plain --scene press ...] [--students 12] [--first 1]

Each row is the same sheets read by today's program with one part replaced: *tips*, both ends of every vector
along the strokes found; *strokes*, every drawn vector a stroke of its own, beside the others found; *both*.
The part with the largest gain is the one to improve next.
"""

import argparse
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from grader.pipeline import read_pages
from grader.records import HEAD_AHEAD, TAIL_AHEAD, FloatArray, PageRef, ScannedPage, Strokes, Tips
from grader.scan.page import open_page
from grader.scan.pixels import lengths_and_directions
from reference.construction.derive import construction_of
from tests.bench.plain_text import as_text
from tests.bench.reading_scenes import SceneWork, scene_named, works
from tests.bench.reading_tally import percent
from tests.bench.reading_truth import Judged, OnPaper, TrueFigure, each_vector, figures_of

SCENES = ("plain", "press", "wrong", "pencil-5")
ALONG_MM, TILT, SHARED = 0.6, 0.16, 0.35
"""A vector lies on a stroke so near to it, so little tilted, and over so much of its length."""
SURE = 0.97
LEAST_MM, LONG_MM = 1.0, 12.0
GOOD = 0.2
"""Quantile of the found long strokes' standard errors that a given stroke has."""


@dataclass(frozen=True, slots=True)
class TruePage:
    """A page with its plans as drawn, and vectors (k, 2, 2) in millimetres as read, y down."""

    page: ScannedPage
    figures: Mapping[str, TrueFigure]
    vectors: FloatArray


def measured(work: SceneWork, pages: Sequence[TruePage], part: str) -> list[list[Judged]]:
    """Read a student's pages with a part given; a list of judged vectors for each page."""
    given = [PARTS[part](page) for page in pages]
    read = read_pages(given, work.assignment, work.variant, work.declared, work.rubric.vectors)
    return [
        [one for one in each_vector(true.figures, work.rubric.vectors, page.reading.figures) if one.counts]
        for true, page in zip(pages, read, strict=True)
    ]


def opened(work: SceneWork) -> list[TruePage]:
    """A student's sheets as scanned, with their truth."""
    construction = construction_of(work.assignment.mechanism([work.variant]))
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for number, sheet in enumerate(work.sheets):
            path = sheet.save(Path(folder) / f"{number}")
            page = open_page(PageRef(path.name, path=path))
            found.append(true_page(page, sheet.truth, figures_of(sheet.truth, construction)))
    return found


def true_page(page: ScannedPage, truth: Mapping[str, Any], figures: Mapping[str, TrueFigure]) -> TruePage:
    """A page with its truth."""
    strokes = [one.stroke for figure in figures.values() for one in figure.vectors.values() if one.stroke]
    if page.sheet is None or page.image is None or not strokes:
        return TruePage(page, figures, np.zeros((0, 2, 2)))
    at = OnPaper(truth, page.sheet, page.image.grey.shape).back(np.array(strokes).ravel())
    return TruePage(page, figures, np.stack([at.real, -at.imag], axis=-1).reshape(-1, 2, 2))


# Parts given --------------------------------------------------------------------------------------


def with_tips(true: TruePage) -> ScannedPage:
    """The page with both ends of every vector as tips, along each stroke that lies on it."""
    ink = true.page.ink
    if ink is None:
        return true.page
    found: list[tuple[int, float, int, float]] = []
    for row, stroke in enumerate(ink.strokes.ends):
        for vector in true.vectors:
            place = along(stroke, vector)
            if place is not None:
                back = int(place[1] < place[0])
                found += [(row, place[1], HEAD_AHEAD + back, SURE), (row, place[0], TAIL_AHEAD + back, SURE)]
    columns = [np.array(column) for column in zip(*found, strict=True)] if found else [np.zeros(0)] * 4
    tips = Tips(columns[0].astype(np.int64), columns[1], columns[2].astype(np.int64), columns[3])
    return replace(true.page, ink=replace(ink, tips=tips))


def with_strokes(true: TruePage) -> ScannedPage:
    """The page with every vector as a stroke of its own, instead of those found along it."""
    ink = true.page.ink
    if ink is None or not len(true.vectors):
        return true.page
    hidden = np.array([
        any(along(stroke, vector) is not None for vector in true.vectors)
        for stroke in ink.strokes.ends
    ], dtype=bool)  # fmt: skip
    kept = ink.strokes
    sure = np.hypot(*(kept.ends[:, 1] - kept.ends[:, 0]).T) > LONG_MM
    drawn = true.vectors[np.hypot(*(true.vectors[:, 1] - true.vectors[:, 0]).T) >= LEAST_MM]
    good = {"darkness": 1.0 - GOOD, "width": 1.0 - GOOD}
    like = {
        field.name: np.full(
            (len(drawn), *getattr(kept, field.name).shape[1:]),
            np.quantile(getattr(kept, field.name)[sure], good.get(field.name, GOOD)),
        )
        for field in fields(Strokes)
    }
    # Ink extends half a pen's width beyond a vector's ends.
    size, unit = lengths_and_directions(drawn)
    cap = np.minimum(like["width"] / 2.0, size / 4.0)[:, None] * unit
    new = Strokes(**{**like, "ends": drawn + np.stack([-cap, cap], axis=1)})
    strokes = Strokes(**{
        field.name: np.concatenate([getattr(kept, field.name)[~hidden], getattr(new, field.name)])
        for field in fields(Strokes)
    })  # fmt: skip
    number = np.cumsum(~hidden) - 1
    tips = ink.tips
    still = ~hidden[tips.stroke] if len(hidden) else np.zeros(0, dtype=bool)
    renumbered = Tips(number[tips.stroke[still]], tips.along[still], tips.kind[still], tips.sure[still])
    return replace(true.page, ink=replace(ink, strokes=strokes, tips=renumbered))


def with_both(true: TruePage) -> ScannedPage:
    """The page with strokes from the truth, and tips along them."""
    return with_tips(replace(true, page=with_strokes(true)))


def along(stroke: FloatArray, vector: FloatArray) -> tuple[float, float] | None:
    """The positions of a vector's tail and head along a stroke, mm; None if it is not on the stroke."""
    size, length = (float(np.hypot(*(line[1] - line[0]))) for line in (vector, stroke))
    if size < LEAST_MM or length < LEAST_MM:
        return None
    u = (stroke[1] - stroke[0]) / length
    relative = vector - stroke[0]
    place, off = relative @ u, relative @ np.array([-u[1], u[0]])
    shared = min(float(place.max()), length) - max(float(place.min()), 0.0)
    on_it = np.abs(off).max() < ALONG_MM and abs(off[1] - off[0]) < TILT * size and shared > SHARED * size
    return (float(place[0]), float(place[1])) if on_it else None


PARTS: Mapping[str, Callable[[TruePage], ScannedPage]] = {
    "nothing": lambda true: true.page,
    "tips": with_tips,
    "strokes": with_strokes,
    "both": with_both,
}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--scene", action="append", dest="scenes")
    parser.add_argument("--students", type=int, default=12)
    parser.add_argument("--first", type=int, default=1)
    told = parser.parse_args()
    read: dict[str, list[list[Judged]]] = {part: [] for part in PARTS}
    for name in told.scenes or SCENES:
        for work in works(scene_named(name), told.students, told.first):
            pages = opened(work)
            for part, sheets in read.items():
                sheets.extend(measured(work, pages, part))
    heads = ["given from the truth", "sheets", "right", "vectors", "right", "asserted", "misread", "finished"]
    print(as_text([("Reading with perfect parts", heads, list(_rows(read)))]))


def _share(of: Sequence[bool]) -> str:
    return percent(float(np.mean(of)))


def _rows(read: Mapping[str, list[list[Judged]]]) -> Iterator[list[str]]:
    for part, sheets in read.items():
        long = [[one for one in sheet if not one.short] for sheet in sheets]
        each = [one for sheet in long for one in sheet]
        yield [
            part, str(len(sheets)), _share([all(one.right for one in sheet) for sheet in long]),
            str(len(each)), _share([one.right for one in each]),
            _share([one.sure for one in each]),
            str(sum(one.misread for sheet in sheets for one in sheet)),
            _share([all(one.right and one.sure for one in sheet) for sheet in long]),
        ]  # fmt: skip


if __name__ == "__main__":
    main()
