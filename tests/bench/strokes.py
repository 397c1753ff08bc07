"""Strokes found on scanned drawings held against those drawn, made by others.

    python -m tests.bench.strokes [FOLDER ...]     (folders below ../shared/sheets)

A vector is found where a stroke covers 70 % of it and both true ends lie within 0.3 mm of its line. The
page is laid by its true map, so that only the strokes' own errors count.
"""

import json
import sys
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

from grader.records import Sheet
from grader.scan.decode.pages import page_of
from grader.scan.register.registration import rectify
from grader.scan.strokes.ink import find_ink

SHEETS = Path(__file__).resolve().parents[3] / "shared" / "sheets"
CLASSES_MM = ((2.0, 4.0), (4.0, 8.0), (8.0, 20.0), (20.0, 1000.0))
FOUND_MM, COVERED, MOST_TURN_RAD = 0.3, 0.7, 0.5


def nearest(strokes, start, end):
    """Of the strokes along a line: the larger distance of its ends (mm), and offset and turn in errors."""
    u = (end - start) / np.hypot(*(end - start))
    v = np.array([-u[1], u[0]])
    span = strokes.ends[:, 1] - strokes.ends[:, 0]
    turn = np.arctan2(span @ v, span @ u)
    turn = (turn + np.pi / 2) % np.pi - np.pi / 2
    length = np.hypot(*(end - start))
    t = np.clip(np.sort((strokes.ends - start) @ u, axis=1), 0.0, length)
    along = (t[:, 1] - t[:, 0] > COVERED * length) & (np.abs(turn) < MOST_TURN_RAD)
    aside = np.column_stack([-span[:, 1], span[:, 0]]) / np.hypot(*span.T)[:, None]
    off = [np.abs(((end_ - strokes.ends[:, 0]) * aside).sum(axis=1)) for end_ in (start, end)]
    worst = np.where(along, np.maximum(*off), np.inf)
    row = int(worst.argmin())
    middle = abs((strokes.ends[row].mean(axis=0) - start) @ v)
    return worst[row], middle / strokes.se_offset[row], abs(turn[row]) / strokes.se_angle[row]


def measure(folder: Path, found: dict, seconds: list) -> None:
    for line in (folder / "truth.jsonl").read_text().splitlines():
        truth = json.loads(line)
        page = page_of(folder / truth["class_file"], truth["page"])
        sheet = rectify(page)
        if not isinstance(sheet, Sheet):
            continue
        start = time.process_time()
        strokes = find_ink(page, replace(sheet, mm_to_px=np.array(truth["homography"]))).strokes
        seconds.append(time.process_time() - start)
        vectors = [v for figure in truth["figures"].values() for v in figure.get("vectors", {}).values()]
        for ends in (np.array(v["line_mm"]) for v in vectors if v.get("line_mm")):
            length = np.hypot(*(ends[1] - ends[0]))
            for low, high in CLASSES_MM:
                if low <= length < high:
                    found[low, high].append(nearest(strokes, *ends))


def main() -> None:
    if not SHEETS.is_dir():
        sys.exit(f"{SHEETS} is not there: nothing to measure")
    found, seconds = defaultdict(list), []
    for name in sys.argv[1:] or ("pump-clean", "pump-flatbed"):
        measure(SHEETS / name, found, seconds)
    for low, high in CLASSES_MM:
        errors = np.array(found[low, high]).reshape(-1, 3)
        hit = errors[errors[:, 0] < FOUND_MM]
        if len(hit):
            offset, turn = np.median(hit[:, 1:], axis=0) / 0.6745
            print(
                f"{low:.0f}-{high:.0f} mm: found {100 * len(hit) / len(errors):.0f} % of {len(errors)}, "
                f"off at the ends {np.median(hit[:, 0]):.3f} mm (p95 {np.percentile(hit[:, 0], 95):.2f}), "
                f"errors in standard errors: across {offset:.2f}, turned {turn:.2f}"
            )
    print(f"{1000 * np.median(seconds):.0f} ms a page")


if __name__ == "__main__":
    main()
