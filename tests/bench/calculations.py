"""Count pages of writing that are told from drawings, and drawings that are taken for writing.

    OMP_NUM_THREADS=1 python -m tests.bench.calculations --pages 40 [FOLDER...]

Simulated pages of calculations: A4 and A3, plain, squared and ruled paper, several hands, scanners, phones.
Drawings for several assignments, with faint pencil too; a drawing taken for writing would be lost. With
folders, the pages of their files are drawings as well.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from grader.records import Page
from grader.scan.decode.limits import SUFFIXES
from grader.scan.decode.pages import is_writing, pages_of
from grader.scan.decode.ruling import without_ruling
from reference.authored.assignment import load_assignment
from reference.errors import InputFileError
from samples.simulation import any_settings, simulate
from samples.simulation.lettering import any_handwriting
from samples.simulation.mixture import any_scan
from samples.simulation.page import print_squares
from samples.simulation.scanner import DrawnPaper, digitise
from samples.simulation.settings import MECHANISM, VELOCITY, Settings
from samples.simulation.sketch import SheetSketch
from samples.simulation.strokes import Rng
from samples.simulation.view import view_of

DRAWINGS = ("pump", "press", "engine", "shaper", "piston")
_WORDS = (
    "Viteza punctului B", "Скорость точки A", "Положение 1", "Velocity of C", "scara vitezelor", "Rezolvare",
    "Ускорение точки D", "Дано", "Найти", "din planul vitezelor", "из треугольника", "so that", "откуда",
)  # fmt: skip
_SIGNS = (
    "v_B v_{BA} a_A a_{BA}^n ω_2 ε_3 k_v l_{AB} = + - · 0,036 47,17 46.4 1,67 3.14 m/s m/s^2 n/30".split()
)


def page_of_writing(seed: int) -> Page:
    """A page of calculations, its paper, hand and scanner by the seed: every third one A3, the others A4."""
    rng = np.random.default_rng([seed, 20])
    own = any_settings(seed, mistakes=0.0, hardship=0.0)
    is_a3 = seed % 3 == 0
    # The image of an A4 page is that of an A3 page on its side, with all lengths 1.41 times as large.
    size = 1.0 if is_a3 else 2.0**0.5
    squared = float(rng.choice([0.0, 0.0, 5.0, 4.0])) * size
    page = replace(own.page, squared_mm=squared, squares_width_mm=0.12 * size, squares_turn_deg=0.0)
    pen = replace(own.pen, line_mm=float(rng.uniform(0.35, 0.6)) * size, dark=float(rng.uniform(0.5, 0.9)))
    sketch = SheetSketch(rng, own.hand, pen, page, any_handwriting(rng))
    print_squares(sketch)
    wide, high = (420.0, 297.0) if is_a3 else (297.0, 420.0)
    turn = 1.0 if is_a3 else 1j
    corner = 0j if is_a3 else complex(0.0, -297.0)
    if not squared and rng.random() < 0.5:
        for y in np.arange(20.0, high - 10.0, 8.0 * size):
            sketch.line(
                sketch.pen("ghost"), corner + turn * complex(4.0, -y), corner + turn * complex(wide - 4.0, -y)
            )
    before = len(sketch.strokes)
    for left in (20.0, 215.0) if is_a3 else (30.0,):
        _column(sketch, rng, left, high, min(170.0, wide - left - 20.0), float(rng.uniform(2.8, 5.0)) * size)
    sketch.strokes[before:] = [
        replace(one, points=corner + turn * one.points) for one in sketch.strokes[before:]
    ]
    scan = replace(any_scan(rng, None, None), dpi=float(rng.choice([150, 200, 300])) / size)
    image = digitise(DrawnPaper(sketch.strokes, pen, None, page.squares), scan, view_of(scan, rng), rng)
    grey, ruling = without_ruling(
        np.asarray(image if image.ndim == 2 else image.mean(axis=2), dtype=np.uint8)
    )
    return Page(f"writing {seed}", 1, grey, (scan.dpi * size, scan.dpi * size), ruling=ruling)


def _column(sketch: SheetSketch, rng: Rng, left: float, high: float, wide: float, letter: float) -> None:
    """Write a column of sentences, formulas and fractions, as far down as the seed says."""
    y, end = 24.0, high * float(rng.uniform(0.55, 0.93))
    while y < end:
        at = complex(left, -y)
        if rng.random() < 0.25:
            words = sketch.text(at, " ".join(rng.choice(_WORDS, 2)), letter)
            if rng.random() < 0.2:
                base = complex(0.0, -0.5 * letter)
                sketch.line(
                    sketch.pen("text"), at + base, complex(min(words.high.real, left + 42.0), at.imag) + base
                )
        elif rng.random() < 0.4:
            head = sketch.text(at, " ".join(rng.choice(_SIGNS, 2)), letter)
            start = complex(head.high.real + letter, -y + 0.5 * letter)
            over = sketch.text(start + 0.4j * letter, " ".join(rng.choice(_SIGNS, 2)), 0.8 * letter)
            sketch.line(sketch.pen("text"), start, complex(over.high.real, start.imag))
            sketch.text(start - 1.2j * letter, " ".join(rng.choice(_SIGNS, 2)), 0.8 * letter)
            y += 1.2 * letter
        else:
            most = max(3, int(wide / (4.0 * letter)))
            sketch.text(at, " ".join(rng.choice(_SIGNS, int(rng.integers(3, most + 1)))), letter)
        y += 2.2 * letter


def drawings(count: int) -> Iterator[tuple[str, Page]]:
    """Simulated drawings of every assignment, every third in faint pencil, on plain paper."""
    for seed in range(count):
        assignment = load_assignment(DRAWINGS[seed % len(DRAWINGS)])
        variants = assignment.variants()
        own: Settings = any_settings(seed, mistakes=0.3, hardship=2.0)
        own = replace(own, student=replace(own.student, mistakes=()))
        if seed % 3 == 0:
            own = replace(own, pen=replace(own.pen, dark=0.25, thin_dark=0.12, line_mm=0.3))
        for sheet in simulate(assignment, variants[seed % len(variants)], seed, own):
            image = sheet.image if sheet.image.ndim == 2 else sheet.image.mean(axis=2)
            grey, ruling = without_ruling(np.asarray(image, dtype=np.uint8))
            figures = ", ".join(name for name in sheet.truth["figures"] if name not in {MECHANISM, VELOCITY})
            yield f"{assignment.id} {seed} {figures}", Page("", 1, grey, ruling=ruling)


def files_in(folders: Sequence[Path]) -> Iterator[tuple[str, Page]]:
    """The pages of the scans in some folders."""
    for path in sorted(path for folder in folders for path in folder.rglob("*")):
        if path.suffix.lower() in SUFFIXES:
            try:
                yield from ((f"{path.name} {page.page}", page) for page in pages_of(path))
            except InputFileError:
                continue


def main() -> None:
    """Print the counts, and the name of each drawing taken for writing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pages", type=int, default=40)
    parser.add_argument("folders", nargs="*", type=Path)
    asked = parser.parse_args()
    found = sum(is_writing(page_of_writing(seed)) for seed in range(asked.pages))
    print(f"pages of calculations: {found} of {asked.pages} recognised")
    for what, pages in (("simulated drawings", drawings(asked.pages)), ("files", files_in(asked.folders))):
        taken = [(name, is_writing(page)) for name, page in pages]
        print(f"{what}: {sum(wrong for _, wrong in taken)} of {len(taken)} taken for calculations")
        print("".join(f"  {name}\n" for name, wrong in taken if wrong), end="")


if __name__ == "__main__":
    main()
