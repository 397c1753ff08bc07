"""Report why vectors are not read, scene by scene, with a picture of each.

    python -m tests.bench.why_missed [--scene plain --scene press ...] [--students 12]
    python -m tests.bench.why_missed --shared ../shared/sheets/pump-clean [--pictures /tmp/missed]

For each vector asked for and drawn, unless right and confident, the first cause that applies is given:

    sheet    the page was refused, or its scale or turn is off
    ink      no stroke was found along it (60 % of its length within 0.3 mm of a found stroke)
    plan     the whole plan was not found, or was explained by another one (most of its nodes are off)
    choice   a stroke was found along it, but another one or none was taken for it
    place    its own stroke was taken, but a node or an end is off
    doubt    right, but with a confidence below 0.9

Silent misreads are listed separately. In a close-up the truth is green (its stroke thick, from node
to node thin), the reading is red, strokes found are blue.
"""

import argparse
import json
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from grader.pipeline import read_pages
from grader.records import Figure, PageRef, Reading, ScannedPage
from grader.rubric import load_rubric
from grader.scan.page import open_page
from grader.tables.roster import read_roster
from grader.texts.spoken import message
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.construction.derive import construction_of
from tests.bench.reading_scenes import SCENES, scene_named, works
from tests.bench.reading_truth import (
    RIGHT_MM,
    Judged,
    OnPaper,
    Segment,
    TrueFigure,
    figures_of,
    judged,
)

CAUSES = ("sheet", "ink", "plan", "choice", "place", "doubt")
FOUND_SHARE = 0.6
NEAR_NODE_MM = 1.0
OFF_SCALE, OFF_TURN_DEG = 0.003, 0.5
CLOSE_UP_MM, CLOSE_UP_PX_PER_MM = 6.0, 14.0
END_MM, END_PX_PER_MM = 4.0, 60.0


@dataclass
class StudentPages:
    """One student's pages, simulated or shared, with their truth."""

    name: str
    assignment: Assignment
    variant: Variant
    declared: dict[str, str]
    wanted: tuple[str, ...]
    truths: list[dict[str, Any]]
    places: list[PageRef]


def simulated(scene: str, students: int, first: int, folder: Path) -> Iterator[StudentPages]:
    for work in works(scene_named(scene), students, first):
        name = f"{scene}-{work.seed}"
        paths = [sheet.save(folder / f"{name}_{number}") for number, sheet in enumerate(work.sheets, 1)]
        yield StudentPages(
            name, work.assignment, work.variant, work.declared, work.rubric.vectors,
            [sheet.truth for sheet in work.sheets], [PageRef(path.name, path=path) for path in paths],
        )  # fmt: skip


def from_folder(folder: Path, students: int | None) -> Iterator[StudentPages]:
    truths = defaultdict(list)
    for line in (folder / "truth.jsonl").read_text(encoding="utf-8").splitlines():
        truth = json.loads(line)
        truths[truth["student_id"]].append(truth)
    roster = read_roster(folder / "roster.csv")
    for student, own in list(truths.items())[:students]:
        assignment = load_assignment(own[0]["assignment"])
        row = roster.rows_of(student)[0]
        wanted = load_rubric(assignment.file.rubric, beside=assignment.path).vectors
        places = [PageRef(t["class_file"], t["page"], path=folder / t["class_file"]) for t in own]
        variant = assignment.variant(row.n, row.position)
        yield StudentPages(
            f"{folder.name}-{student}", assignment, variant, dict(row.scales), wanted, own, places
        )


def found_along(true: Segment, strokes: np.ndarray) -> float:
    """The share of a segment covered within `RIGHT_MM` by the strokes found (n, 2)."""
    tail, head = true
    length = abs(head - tail)
    if length == 0.0 or not len(strokes):
        return 0.0
    local = (strokes - tail) / ((head - tail) / length)
    low, high = local.real.min(axis=1), local.real.max(axis=1)
    start, end = np.maximum(low, 0.0), np.minimum(high, length)
    slope = (local[:, 1].imag - local[:, 0].imag) / np.where(
        np.abs(local[:, 1].real - local[:, 0].real) < 1e-6, 1e-6, local[:, 1].real - local[:, 0].real
    )
    off = [np.abs(local[:, 0].imag + slope * (x - local[:, 0].real)) for x in (start, end)]
    near = (end > start) & (np.maximum(*off) <= RIGHT_MM)
    grid = np.linspace(0.0, length, 100)
    covered = ((grid[:, None] >= start[near]) & (grid[:, None] <= end[near])).any(axis=1)
    return float(covered.mean())


# Causes -----------------------------------------------------------------------------------------------


@dataclass
class Miss:
    """A vector that is not right, or not confident, and the cause."""

    student: str
    page: int
    cause: str
    judged: Judged
    read: Segment | None
    """As read, in true millimetres."""


def cause_of(one: Judged, read: Segment | None, strokes: np.ndarray, plan_is_off: bool) -> str:
    true = one.true.stroke or one.true.ends
    if one.right:
        return "doubt"
    if true is None or found_along(true, strokes) < FOUND_SHARE:
        return "ink"
    if plan_is_off:
        return "plan"
    if read is None or found_along(read, np.array([true])) < FOUND_SHARE:
        return "choice"
    return "place"


def is_off(figure: TrueFigure, found: Figure | None, on_paper: OnPaper) -> bool:
    """Return whether most of a plan's nodes were read at wrong places."""
    if found is None:
        return True
    common = [name for name in figure.nodes if name in found.nodes]
    if not common:
        return True
    read = on_paper(np.array([found.nodes[name].at for name in common]))
    true = np.array([figure.nodes[name] for name in common])
    return bool((np.abs(read - true) > NEAR_NODE_MM).mean() > 0.5)


def paper_of(truth: dict[str, Any], seen: ScannedPage) -> OnPaper | None:
    """The map from the reading to the paper; None if the page was refused."""
    if seen.sheet is None or seen.image is None or seen.ink is None:
        return None
    return OnPaper(truth, seen.sheet, seen.image.grey.shape)


def fault_of(on_paper: OnPaper) -> str:
    """The fault of scale or turn; empty if they are good."""
    scale, turn = on_paper.scale_and_turn()
    if np.all(np.abs(scale) <= OFF_SCALE) and np.all(np.abs(turn) <= OFF_TURN_DEG):
        return ""
    return (
        f"scale off by {100 * scale[0]:.2f} % along, {100 * scale[1]:.2f} % across,"
        f" turned by {turn[0]:.2f} and {turn[1]:.2f} deg"
    )


def sheet_fault(seen: ScannedPage, on_paper: OnPaper | None) -> str:
    """The reason why the page's millimetres cannot be used; empty if they can."""
    if on_paper is not None:
        return fault_of(on_paper)
    return "; ".join(message(problem) for problem in seen.problems) or "no sheet"


def misses_of(
    student: StudentPages, seen: ScannedPage, reading: Reading, truth: dict[str, Any]
) -> Iterator[tuple]:
    """Every vector asked for on a page: its judgement, and the miss, if it is one."""
    construction = construction_of(student.assignment.mechanism([student.variant]))
    on_paper = paper_of(truth, seen)
    strokes = np.empty((0, 2), complex)
    if on_paper is not None:
        ends = seen.ink.strokes.ends.reshape(-1, 2)
        strokes = on_paper(ends[:, 0] - 1j * ends[:, 1]).reshape(-1, 2)
    fault = sheet_fault(seen, on_paper)
    for name, figure in figures_of(truth, construction).items():
        found = reading.figures.get(name)
        plan_is_off = on_paper is None or is_off(figure, found, on_paper)
        for vector in (v for v in figure.vectors.values() if v.name in student.wanted):
            one = judged(vector, found.vectors.get(vector.name) if found else None)
            ends = construction.vectors[vector.name]
            segment = None
            if one.reported and on_paper and {ends.tail, ends.head} <= found.nodes.keys():
                at = on_paper(np.array([found.nodes[ends.tail].at, found.nodes[ends.head].at]))
                segment = complex(at[0]), complex(at[1])
            if vector.missing or (one.right and one.sure):
                yield one, None
                continue
            off_sheet = fault and not one.right
            cause = "sheet" if off_sheet else cause_of(one, segment, strokes, plan_is_off)
            yield one, Miss(student.name, truth.get("page", 1), cause, one, segment)


# Pictures -----------------------------------------------------------------------------------------------


def close_up(miss: Miss, seen: ScannedPage, truth: dict[str, Any], path: Path) -> None:
    """Draw the miss as a whole, and below it the surroundings of its two ends."""
    on_paper = OnPaper(truth, seen.sheet, seen.image.grey.shape)
    segments = [*filter(None, (miss.judged.true.ends, miss.judged.true.stroke, miss.read))]
    places = on_paper.back(np.array(segments).ravel())
    low = complex(places.real.min(), places.imag.min()) - complex(CLOSE_UP_MM, CLOSE_UP_MM)
    high = complex(places.real.max(), places.imag.max()) + complex(CLOSE_UP_MM, CLOSE_UP_MM)
    span = max((high - low).real, (high - low).imag)
    whole = panel(miss, seen, on_paper, (low, high, min(CLOSE_UP_PX_PER_MM, 1200.0 / span)))
    half = complex(END_MM, END_MM)
    ends = [panel(miss, seen, on_paper, (at - half, at + half, END_PX_PER_MM)) for at in places[:2].tolist()]
    below = np.hstack([ends[0], np.zeros((ends[0].shape[0], 4, 3), np.uint8), ends[1]])
    wide = max(whole.shape[1], below.shape[1])
    padded = [np.pad(one, ((0, 4), (0, wide - one.shape[1]), (0, 0))) for one in (whole, below)]
    cv2.imwrite(str(path), np.vstack(padded))


def panel(
    miss: Miss, seen: ScannedPage, on_paper: OnPaper, box: tuple[complex, complex, float]
) -> np.ndarray:
    """A box of the sheet (low and high corner as read, px/mm) with truth, reading and strokes found."""
    low, high, scale = box
    size = round((high - low).real * scale), round((high - low).imag * scale)
    window = np.array([[1 / scale, 0, low.real], [0, 1 / scale, -high.imag], [0, 0, 1.0]])
    warp, flags = on_paper.sheet.mm_to_px @ window, cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    grey = cv2.warpPerspective(seen.image.grey, warp, size, flags=flags, borderValue=255)
    canvas = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)

    def line(ends, colour, thick) -> None:
        at = np.array(ends) - complex(low.real, high.imag)
        px = np.round(np.column_stack([at.real, -at.imag]) * scale * 16)
        p, q = (tuple(int(v) for v in np.clip(x, -(2**20), 2**20)) for x in px)
        cv2.line(canvas, p, q, colour, thick, cv2.LINE_AA, shift=4)
        cv2.circle(canvas, q, 3 * 16, colour, -1, cv2.LINE_AA, shift=4)

    strokes = seen.ink.strokes.ends
    for ends in strokes[..., 0] - 1j * strokes[..., 1]:
        line(ends, (230, 140, 60), 1)
    for ends, thick in ((miss.judged.true.stroke, 2), (miss.judged.true.ends, 1)):
        if ends is not None:
            line(on_paper.back(np.array(ends)), (60, 170, 0), thick)
    if miss.read is not None:
        line(on_paper.back(np.array(miss.read)), (40, 40, 220), 1)
    return canvas


# Counting -----------------------------------------------------------------------------------------------


def look_at(title: str, students: Iterator[StudentPages], pictures: Path | None, *, tell: bool) -> None:
    counts: dict[str, Counter[str]] = {"long": Counter(), "short": Counter()}
    sheets = Counter()
    for student in students:
        seen = [open_page(place) for place in student.places]
        seen = read_pages(seen, student.assignment, student.variant, student.declared, student.wanted)
        readings = [page.reading for page in seen]
        for page, reading, truth in zip(seen, readings, student.truths, strict=True):
            right = True
            fault = sheet_fault(page, paper_of(truth, page))
            if fault:
                print(f"  page not registered: {student.name} page {truth.get('page', 1)}: {fault}")
            for one, miss in misses_of(student, page, reading, truth):
                if not one.true.missing:
                    size = "short" if one.short else "long"
                    counts[size]["of" if miss is None else miss.cause] += 1
                    right &= one.right or one.short
                if one.misread:
                    counts["long"]["misread"] += 1
                    print(f"  silent misread: {told(student.name, truth, one)}", flush=True)
                if miss is None:
                    continue
                if tell:
                    print(f"  {miss.cause:7s} {told(student.name, truth, one)}", flush=True)
                if pictures is not None and miss.cause != "doubt" and page.ink is not None:
                    name = f"{student.name}_{truth.get('page', 1)}_{one.true.name}_{miss.cause}.png"
                    close_up(miss, page, truth, pictures / name)
            sheets[right] += 1
    report(title, counts, sheets)


def told(student: str, truth: dict[str, Any], one: Judged) -> str:
    mistakes = ",".join(m.get("code") or m.get("id") for m in truth.get("mistakes", []))
    state = one.true.missing or f"{one.true.length_mm:.1f} mm"
    error = f"error {one.error_mm:.2f} mm" if one.reported else "unread"
    return (
        f"{student} page {truth.get('page', 1)} {one.true.name} ({state}): {error}"
        f" at {one.confidence:.2f} {mistakes}"
    )


def report(title: str, counts: dict[str, Counter[str]], sheets: Counter) -> None:
    print(f"{title}: sheets right {sheets[True]} of {sum(sheets.values())}")
    for size, words in (("long", "5 mm and more"), ("short", "shorter")):
        misreads = counts[size].pop("misread", 0)
        total = max(1, sum(counts[size].values()))
        causes = ", ".join(
            f"{cause} {counts[size][cause]} ({100 * counts[size][cause] / total:.1f} %)" for cause in CAUSES
        )
        good = counts[size]["of"]
        print(f"  {words}: right and confident {good} of {total} ({100 * good / total:.1f} %); {causes}")
        if size == "long":
            print(f"  silent misreads: {misreads}", flush=True)


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    asked.add_argument("--scene", action="append", choices=[scene.name for scene in SCENES])
    asked.add_argument("--students", type=int, help="12 of a scene, all of a folder")
    asked.add_argument("--first", type=int, default=1, help="first seed")
    asked.add_argument("--shared", action="append", type=Path, help="a folder of sheets with truth.jsonl")
    asked.add_argument("--pictures", type=Path, help="folder for close-ups of misses")
    asked.add_argument("--quiet", action="store_true", help="only counts, and silent misreads")
    options = asked.parse_args()
    cv2.setNumThreads(1)
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
    for folder in options.shared or []:
        students = from_folder(folder, options.students)
        look_at(folder.name, students, options.pictures, tell=not options.quiet)
    scenes = options.scene or ([] if options.shared else [scene.name for scene in SCENES])
    for scene in scenes:
        with tempfile.TemporaryDirectory() as folder:
            students = simulated(scene, options.students or 12, options.first, Path(folder))
            look_at(scene, students, options.pictures, tell=not options.quiet)


if __name__ == "__main__":
    main()
