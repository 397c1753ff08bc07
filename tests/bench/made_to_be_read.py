"""What a sheet made to be read gains: the same simulated students with and without each advice.

    python -m tests.bench.made_to_be_read [--students N] [--seed S] [--assignments pump,press]

Everybody draws on a flatbed at 300 dpi, without mistakes, on

- plain paper at the assignment's scales, letters where people put them;
- the printed answer sheet;
- the same with letters 3 mm clear of all lines, arrowheads up to 4 mm, lines through the joints;
- the same at the round scales that `planmark sheet` and `lint` propose for each variant of its own.

Counted are all vectors that the rubric asks for, of whatever length, but for those of length zero.
Right: length within 0.3 mm of what was drawn, and direction within 0.3 degrees or 0.3 mm across,
node to node or along the stroke. Misread: reported with 0.9 and more, and 1 mm or more off.
"""

import argparse
import contextlib
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from grader.authoring.lint import lint
from grader.pipeline import read_pages
from grader.printed.answer_sheet import make_sheets
from grader.records import PageRef
from grader.rubric import load_rubric
from grader.scan.page import open_page
from grader.tables.roster import RosterRow
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.authored.formula import parse
from samples.simulation import any_settings, simulate
from samples.simulation.desk import Desk
from samples.simulation.lettering import write
from samples.simulation.printing import printed_sheets
from samples.simulation.sketch import SheetSketch, WrittenLabel
from samples.simulation.wording import SCALE_UNITS, declared_texts

RIGHT_MM, RIGHT_DEG, WRONG_MM, SURE, ZERO_MM = 0.3, 0.3, 1.0, 0.9, 0.4
SHORT_MM = 8.0
CLEAR_MM, REACH_MM = 3.0, 14.0


@contextlib.contextmanager
def letters_clear() -> Iterator[None]:
    """Students who write their letters last, where there is room for them."""
    usual_letter, usual_figures = SheetSketch.letter, Desk._figures
    waiting = []

    def later(_sketch, near, text, height_mm, *, names, distance_mm):
        waiting.append((near, text, height_mm, names, distance_mm))

    def figures(desk, sketch, sheet, origins):
        missing = usual_figures(desk, sketch, sheet, origins)
        for letter in waiting:
            write_clear(sketch, *letter)
        waiting.clear()
        return missing

    SheetSketch.letter, Desk._figures = later, figures
    try:
        yield
    finally:
        SheetSketch.letter, Desk._figures = usual_letter, usual_figures


def write_clear(
    sketch: SheetSketch, near: complex, text: str, height_mm: float, names: str, distance_mm: float
):
    """A letter at the nearest place with 3 mm of paper around it; where there is none, the emptiest."""
    written = write(sketch.rng, sketch.pen("text"), text, height_mm, sketch.writing)
    middle, half = (written.low + written.high) / 2.0, (written.high - written.low) / 2.0
    ink = np.concatenate([stroke.points for stroke in sketch.strokes])
    ink = ink[np.abs(ink - near) < REACH_MM + 12.0]
    best, most = near, -1.0
    for reach in np.arange(distance_mm + abs(half), REACH_MM, 1.0):
        for angle in sketch.rng.uniform(0, 2 * np.pi) + np.arange(16) * (2 * np.pi / 16):
            centre = near + reach * complex(np.exp(1j * angle))
            apart = ink - centre
            gap = np.hypot(
                np.maximum(np.abs(apart.real) - half.real, 0.0),
                np.maximum(np.abs(apart.imag) - half.imag, 0.0),
            ).min(initial=np.inf)
            if gap > most + 0.3:
                best, most = centre, float(gap)
        if most >= CLEAR_MM:
            break
    placed = written.moved(best - middle)
    sketch.strokes.extend(placed.strokes)
    sketch.labels.append(WrittenLabel(text, names, placed.low, placed.high))


def at_own_scales(assignment: Assignment, variant: Variant) -> Assignment:
    """The assignment with the round scales that lint proposes for one variant."""
    found = lint(assignment, load_rubric(assignment.file.rubric, beside=assignment.path))
    assert found.plan is not None
    (proposal,) = [one for one in found.scales if one.name == "round_each"]
    index = found.plan.variants.index(variant)
    values = {name: parse(repr(float(getattr(proposal.scales, name)[index]))) for name in SCALE_UNITS}
    scales = assignment.file.scales.model_copy(update=values)
    return replace(assignment, file=assignment.file.model_copy(update={"scales": scales}))


def count(
    assignment: Assignment, seed: int, tally: Counter, *, printed: bool, clear: bool, own: bool
) -> None:
    """One student's sheets drawn, scanned, read, and held against the truth."""
    variants = assignment.variants()
    variant = variants[seed * 7 % len(variants)]
    if own:
        assignment = at_own_scales(assignment, variant)
    settings = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.0)
    # The assignment's scales are what is compared: nobody chooses others.
    student = replace(settings.student, crank_mm=None, kv_ratio=1.0, ka_ratio=1.0, abandoned=False)
    settings = replace(settings, student=student)
    if clear:
        short = min(settings.pen.arrow_mm, 4.0)
        settings = replace(settings, pen=replace(settings.pen, links_stop_short=False, arrow_mm=short))
    paper = None
    if printed:
        made = make_sheets(assignment, [RosterRow("s01", "", variant.n, variant.position)])
        paper = printed_sheets(made.pdf, made.layout)
    with letters_clear() if clear else contextlib.nullcontext():
        sheets = simulate(assignment, variant, seed, settings, printed=paper)
    rubric = load_rubric(assignment.file.rubric, beside=assignment.path)
    told = sheets[0].truth["scales"]["declared"]
    declared = declared_texts(told)
    with tempfile.TemporaryDirectory() as folder:
        paths = [sheet.save(Path(folder) / f"s{index}") for index, sheet in enumerate(sheets)]
        seen = [open_page(PageRef(path.name, path=path)) for path in paths]
    readings = [page.reading for page in read_pages(seen, assignment, variant, declared, rubric.vectors)]
    whole = True
    for sheet, reading in zip(sheets, readings, strict=True):
        for name, figure in sheet.truth["figures"].items():
            found = reading.figures.get(name)
            for vector in set(figure.get("vectors", {})) & set(rubric.vectors):
                truth = figure["vectors"][vector]
                if truth["length_mm"] >= ZERO_MM:
                    kind = judged(truth, found.vectors.get(vector) if found else None, tally)
                    whole &= kind in {"right", "unsure"}
    tally["students"] += 1
    tally["whole"] += whole


def judged(truth, found, tally: Counter) -> str:
    """How one vector fared."""
    tally["vectors"] += 1
    tally["short"] += truth["length_mm"] < SHORT_MM
    if found is None or found.length_mm is None:
        kind = "unread"
    else:
        kind = "right" if any(is_right(way, found) for way in ways(truth)) else "off"
        off = min(abs(arrow(found) - way) for way in ways(truth))
        sure = found.confidence >= SURE
        tally["misread"] += sure and off > WRONG_MM
        tally["right"] += kind == "right"
        tally["sure"] += kind == "right" and sure
        if kind == "right" and not sure:
            kind = "unsure"
    tally[f"is {kind}"] += 1
    return kind


def ways(truth) -> list[complex]:
    """The vector as complex mm: node to node, and along its stroke."""
    found = [truth["length_mm"] * np.exp(1j * np.radians(truth["direction_deg"] or 0.0))]
    if truth["line_mm"] is not None:
        (x1, y1), (x2, y2) = truth["line_mm"]
        found.append(complex(x2 - x1, y1 - y2))
    return found


def arrow(found) -> complex:
    """A vector as read."""
    return found.length_mm * np.exp(1j * np.radians(found.direction_deg or 0.0))


def is_right(way: complex, found) -> bool:
    """Length within 0.3 mm, direction within 0.3 degrees or 0.3 mm across."""
    turn = abs(np.angle(arrow(found) / way)) if found.length_mm else np.pi
    across = abs(way) * np.sin(min(turn, np.pi / 2))
    return abs(found.length_mm - abs(way)) <= RIGHT_MM and (
        np.degrees(turn) <= RIGHT_DEG or across <= RIGHT_MM
    )


CASES = {
    "plain paper": (False, False, False),
    "plain paper, own round scales": (False, False, True),
    "printed sheet": (True, False, False),
    "printed, letters clear": (True, True, False),
    "printed, own round scales": (True, False, True),
    "printed, clear, own round scales": (True, True, True),
}


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--students", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--assignments", default="pump,press,engine")
    parser.add_argument("--cases", default="", help="those whose names hold this")
    told = parser.parse_args()
    cv2.setNumThreads(1)
    print("| sheet | students | vectors | under 8 mm | right | right and sure | misread | all right |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    for case, (printed, clear, own) in CASES.items():
        if told.cases not in case:
            continue
        tally: Counter = Counter()
        for name in told.assignments.split(","):
            assignment = load_assignment(name)
            for seed in range(told.seed, told.seed + told.students):
                count(assignment, seed, tally, printed=printed, clear=clear, own=own)
        many = tally["vectors"]
        shares = [f"{100.0 * tally[key] / many:.1f} %" for key in ("short", "right", "sure")]
        print(
            f"| {case} | {tally['students']} | {many} | {' | '.join(shares)} | {tally['misread']}"
            f" | {100.0 * tally['whole'] / tally['students']:.0f} % |",
            flush=True,
        )


if __name__ == "__main__":
    main()
