"""Simulated students' sheets for training, of any assignment, hand, pen and scanner; command line."""

import argparse
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from grader.records import PageRef, ScannedPage
from grader.scan.page import open_page
from reference.authored.assignment import load_assignment
from samples.simulation import any_settings, simulate

ASSIGNMENTS = ("pump", "press", "engine", "shaper", "piston", "pump-230")
DEVICES = ("flatbed", "flatbed", "flatbed", "copier", "phone")
RESOLUTIONS_DPI = (150.0, 200.0, 300.0, 300.0, 300.0, 400.0)


def simulated_pages(seed: int) -> Iterator[tuple[ScannedPage, dict[str, Any]]]:
    """One student's pages as opened, with their truth; refused ones are left out."""
    assignment = load_assignment(ASSIGNMENTS[seed % len(ASSIGNMENTS)])
    variants = assignment.variants()
    variant = variants[(seed * 7) % len(variants)]
    rng = np.random.default_rng(seed)
    device, dpi = str(rng.choice(DEVICES)), float(rng.choice(RESOLUTIONS_DPI))
    settings = any_settings(seed, device=device, dpi=dpi, work=(assignment, variant))
    try:
        sheets = simulate(assignment, variant, seed, settings)
    except ValueError as cannot:  # a random mistake that this variant does not admit
        print(seed, cannot)
        return
    for sheet in sheets:
        with tempfile.TemporaryDirectory() as place:
            page = open_page(PageRef("sheet", path=sheet.save(Path(place) / "sheet")))
        if page.ink is not None and page.image is not None and page.sheet is not None:
            yield page, sheet.truth


def run(
    description: str | None,
    keep: Callable[[Path, int], None],
    train: Callable[[Path, int, Path], None],
    steps: int,
) -> None:
    """Carry out a training script's command: `keep` each student's sheets in a folder, or `train` on them."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawTextHelpFormatter)
    acts = parser.add_subparsers(dest="act", required=True)
    sheets, network = acts.add_parser("sheets"), acts.add_parser("network")
    for act in (sheets, network):
        act.add_argument("folder", type=Path)
    sheets.add_argument("--first", type=int, default=0)
    sheets.add_argument("--last", type=int, default=300)
    network.add_argument("--steps", type=int, default=steps)
    network.add_argument("--out", type=Path, required=True)
    told = parser.parse_args()
    if told.act == "sheets":
        told.folder.mkdir(parents=True, exist_ok=True)
        for seed in range(told.first, told.last):
            keep(told.folder, seed)
    else:
        train(told.folder, told.steps, told.out)
