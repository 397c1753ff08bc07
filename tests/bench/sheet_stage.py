"""Registration measured on sheets whose map is known: how far millimetres are off, and how long it takes.

    python -m tests.bench.sheet_stage [FOLDER ...] [--each]

A folder holds images with a `NAME.json` each (as `samples.simulation` writes its truth) or a `truth.jsonl`;
without one the folders of ../shared/sheets are measured. Told for each folder: grid points on the
sheet in millimetres, as placed and after the best rigid motion (what lengths and angles feel: a sheet
without a frame has no place of its own); |scale error| / `scale_se`; pages refused, turned wrongly,
and warned of; milliseconds of process time for decoding, registering and straightening.
"""

import argparse
import json
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from grader.records import Page, Sheet, Unread
from grader.scan.decode.pages import page_of
from grader.scan.register.distortion import straight, straighten
from grader.scan.register.registration import rectify

SHEETS = Path(__file__).resolve().parents[3] / "shared" / "sheets"
TURNED_DEG = 45.0
BAD_SCALE = 0.01


@dataclass
class Row:
    """One page: what came of it."""

    file: str
    refused: str = ""
    turned: bool = False
    off_mm: tuple[float, float] = (0.0, 0.0)
    shape_mm: tuple[float, float] = (0.0, 0.0)
    scale_error: float = 0.0
    scale_se: float = 1.0
    problems: str = ""
    method: str = ""
    ms: tuple[float, float, float] = (0.0, 0.0, 0.0)


def pages(folder: Path) -> Iterator[tuple[Path, int, dict]]:
    """Files with page numbers and truths."""
    listed = folder / "truth.jsonl"
    if listed.exists():
        for line in listed.read_text().splitlines():
            truth = json.loads(line)
            yield folder / truth["class_file"], truth["page"], truth
        return
    for path in sorted(folder.glob("*.json")):
        truth = json.loads(path.read_text())
        yield folder / truth["file"], truth["page"], truth


def measure(path: Path, number: int, truth: dict) -> Row:
    """Register one page and hold it against its truth."""
    clock = [time.process_time()]
    page = page_of(path, number)
    clock.append(time.process_time())
    sheet = rectify(page)
    clock.append(time.process_time())
    row = Row(f"{path.name}#{number}")
    if isinstance(sheet, Unread):
        row.refused = sheet.reason
    else:
        _, straightened = straighten(page, sheet)
        compare(row, page, sheet, straightened, truth)
    clock.append(time.process_time())
    row.ms = tuple(1000.0 * float(step) for step in np.diff(clock))
    return row


def compare(row: Row, page: Page, stored: Sheet, sheet: Sheet, truth: dict) -> None:
    """Errors of the grid's points on the sheet, and of the mean scale."""
    mm = np.array([pair[0] for pair in truth["grid_mm_px"]], dtype=float)
    px = np.array([pair[1] for pair in truth["grid_mm_px"]], dtype=float)
    if sheet.lens is not None:
        px = straight(px, sheet.lens.bend, page.grey.shape[:2])
    found = mapped(np.linalg.inv(sheet.mm_to_px), px)
    size = float(np.sqrt(np.mean(np.sum((found - found.mean(axis=0)) ** 2, axis=1))))
    true = float(np.sqrt(np.mean(np.sum((mm - mm.mean(axis=0)) ** 2, axis=1))))
    row.scale_error = np.log(size / true)
    row.scale_se, row.method = sheet.scale_se, stored.method
    row.problems = " ".join(sorted({problem.code for problem in sheet.problems}))
    rigid = _rigid(found, mm)
    row.turned = abs(rigid[1]) > TURNED_DEG
    off = np.hypot(*(found - mm).T)
    shape = np.hypot(*(rigid[0] - mm).T)
    row.off_mm = (float(np.median(off)), float(np.percentile(off, 95)))
    row.shape_mm = (float(np.median(shape)), float(np.percentile(shape, 95)))


def mapped(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    lifted = np.c_[points, np.ones(len(points))] @ matrix.T
    return lifted[:, :2] / lifted[:, 2:]


def _rigid(found: np.ndarray, true: np.ndarray) -> tuple[np.ndarray, float]:
    """`found` moved onto `true` by the best turn and shift, and the turn in degrees."""
    z, w = (points @ np.array([1.0, 1.0j]) for points in (found, true))
    turn = np.vdot(z - z.mean(), w - w.mean())
    turn /= abs(turn)
    laid = (z - z.mean()) * turn + w.mean()
    return np.column_stack([laid.real, laid.imag]), float(np.degrees(np.angle(turn)))


def tell(name: str, rows: list[Row]) -> None:
    """Figures of one folder or kind."""
    seen = [row for row in rows if not row.refused]
    right = [row for row in seen if not row.turned]
    ratio = np.array([row.scale_error / row.scale_se for row in right])
    silent = [row for row in right if abs(row.scale_error) > BAD_SCALE and row.scale_se < BAD_SCALE / 2]
    ms = np.array([row.ms for row in rows])
    print(
        f"{name}: {len(rows)} pages, {len(rows) - len(seen)} refused, {len(seen) - len(right)} turned wrongly"
    )
    if right:
        for label in ("off_mm", "shape_mm"):
            values = np.array([getattr(row, label) for row in right])
            print(
                f"  {label:8} page medians: median {np.median(values[:, 0]):.3f}, "
                f"p95 {np.percentile(values[:, 0], 95):.3f}; worst tenth of a page's points (p95):"
                f" median {np.median(values[:, 1]):.3f}, p95 {np.percentile(values[:, 1], 95):.3f}"
            )
        within = [float(np.mean(np.abs(ratio) < k)) for k in (1.0, 2.0, 3.0)]
        print(
            f"  scale error / se: rms {np.sqrt(np.mean(ratio**2)):.2f}, within 1 / 2 / 3 se:"
            f" {within[0]:.2f} {within[1]:.2f} {within[2]:.2f}; rms error"
            f" {100 * np.sqrt(np.mean([row.scale_error**2 for row in right])):.3f} %;"
            f" silently off by over 1 %: {[row.file for row in silent]}"
        )
    print(
        "  ms (median, p95): "
        + ", ".join(
            f"{what} {np.median(ms[:, k]):.0f} {np.percentile(ms[:, k], 95):.0f}"
            for k, what in enumerate(("decode", "register", "straighten"))
        ),
        flush=True,
    )


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("folders", nargs="*", type=Path)
    options.add_argument("--each", action="store_true", help="a line for each page")
    given = options.parse_args()
    folders = given.folders or [path for path in sorted(SHEETS.iterdir()) if path.is_dir()]
    if not folders:
        sys.exit(f"{SHEETS} is not there: nothing to measure")
    cv2.setNumThreads(1)
    for folder in folders:
        kinds: dict[str, list[Row]] = defaultdict(list)
        for path, number, truth in pages(folder):
            row = measure(path, number, truth)
            kind = folder.name if (folder / "truth.jsonl").exists() else path.stem.rpartition("_")[0]
            kinds[kind or folder.name].append(row)
            if given.each:
                print(
                    f"    {row.file:18} {row.method:8} off {row.off_mm[0]:6.3f} {row.off_mm[1]:6.3f} shape"
                    f" {row.shape_mm[0]:6.3f} {row.shape_mm[1]:6.3f} scale {100 * row.scale_error:+.3f} %"
                    f" se {100 * row.scale_se:.3f} % {'TURNED ' if row.turned else ''}"
                    f"ms {row.ms[0]:.0f} {row.ms[1]:.0f} {row.ms[2]:.0f} {row.problems} {row.refused}",
                    flush=True,
                )
        for kind, rows in kinds.items():
            tell(kind, rows)


if __name__ == "__main__":
    main()
