"""Letters read on simulated sheets: `python -m tests.bench.letters --students 10`.

A node's letter is the first sign of the text beside it. It counts as read if the likeliest sign of the box
over its middle is the right one. A box is wrong if it names, with more than 0.9, a sign that is not there.
The simulation's alphabet is not among the fonts that the detector was trained on.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from grader.reading.lettering import COMPONENTS, lettered
from grader.records import (
    MECHANISM,
    Figure,
    FloatArray,
    Letters,
    PageRef,
    Reading,
    ReadNode,
    Sheet,
)
from grader.scan.handwriting.letters import find_letters
from grader.scan.page import open_page
from grader.scan.pixels import mapped
from reference.construction.derive import construction_of
from tests.bench.plain_text import NOTHING, as_text
from tests.bench.reading_scenes import SceneWork, scene_named, works
from tests.bench.reading_truth import true_places

_COV = 0.01 * np.eye(2)
SCENES = ("plain", "printed", "sloppy", "hard", "150", "copies", "phone", "press", "engine", "shaper")
SURE = 0.9
NEAR_MM = 0.4
"""A box's middle may lie so far outside of the sign it is said to be."""

ABOUT_MM = 8.0
"""Boxes farther from every node are not counted: captions, calculations, what is printed on the sheet."""


@dataclass(slots=True)
class LettersTally:
    """Counts of nodes' letters read on some sheets.

    Attributes
    ----------
    nodes, read : letters of nodes, and those of them that were read
    said : boxes near nodes that name a sign with more than 0.9
    wrong, stray : those of them on another sign, and on none
    ms : processor time of a sheet
    """

    nodes: int = 0
    read: int = 0
    said: int = 0
    wrong: int = 0
    stray: int = 0
    ms: list[float] = field(default_factory=list)

    def add(self, truth: Mapping[str, Any], letters: Letters) -> None:
        """Count one sheet. Arguments: `letters` with their boxes in true mm."""
        places = np.column_stack([letters.at.real, -letters.at.imag])
        signs = [sign for label in truth["labels"] for sign in label["signs"]]
        names = {name for figure in truth["figures"].values() for name in figure["nodes"]}
        first = [label["signs"][0] for label in truth["labels"] if label["names"] in names and label["signs"]]
        at = np.array([xy for figure in truth["figures"].values() for xy in figure["nodes"].values()])
        near = np.hypot(*np.moveaxis(places[:, None] - at, 2, 0)).min(axis=1) < ABOUT_MM
        over = _over(places, np.array([sign[1:] for sign in signs]).reshape(-1, 4))
        columns = np.array([letters.column.get(sign[0], -1) for sign in signs])
        # Among boxes on the same ink the one likeliest to be a sign counts, as when names are read.
        likeliest = letters.probability.argmax(axis=1)
        sign_at_all = 1.0 - letters.probability[:, letters.column[""]]
        for sign in first:
            here = np.flatnonzero(over[:, signs.index(sign)])
            self.nodes += 1
            if len(here):
                best = here[np.argmax(sign_at_all[here])]
                self.read += bool(likeliest[best] == letters.column.get(sign[0], -1))
        sure = np.flatnonzero(
            (letters.probability.max(axis=1) > SURE) & (likeliest != letters.column[""]) & near
        )
        self.said += len(sure)
        for row in sure:
            if not over[row].any():
                self.stray += 1
            elif not (columns[over[row]] == likeliest[row]).any():
                self.wrong += 1


@dataclass(slots=True)
class SwapsTally:
    """Counts of pairs of letters in plans, each pair once as it is and once exchanged.

    Attributes
    ----------
    right, falsely : pairs as they should be, and those reported as swapped
    pairs, found : pairs exchanged, and those of them reported
    """

    right: int = 0
    falsely: int = 0
    pairs: int = 0
    found: int = 0

    def add(self, truth: Mapping[str, Any], letters: Letters, work: SceneWork) -> None:
        """Count one sheet; the names of its true nodes are exchanged instead of its letters."""
        construction = construction_of(work.assignment.mechanism([work.variant]))
        at = {
            figure: {name: complex(x, -y) for name, (x, y) in drawn["nodes"].items()}
            for figure, drawn in truth["figures"].items()
        }

        def told(places: Mapping[str, Mapping[str, complex]]) -> list[set[str]]:
            nodes = {
                figure: Figure({name: ReadNode(place, _COV, 1.0) for name, place in of.items()}, {})
                for figure, of in places.items()
            }
            reading = lettered(Reading(nodes), letters, construction, work.assignment.file.names)
            return [{swap.first, swap.second} for swap in reading.swapped]

        self.falsely += len(told(at))
        written = {name for label in truth["labels"] for name in [label["names"]]}
        for figure in set(at) - {MECHANISM}:
            usual = written.intersection(at[figure]) - set(construction.poles.values())
            for p, q in combinations(sorted(n for n in usual if not n.startswith(COMPONENTS)), 2):
                self.right += 1
                self.pairs += 1
                exchanged = at[figure] | {p: at[figure][q], q: at[figure][p]}
                self.found += {p, q} in told(at | {figure: exchanged})


def _over(places: FloatArray, boxes: FloatArray) -> np.ndarray:
    """(k, m) True where a point lies in a box (left, top, right, bottom) or close to it."""
    low, high = boxes[:, :2] - NEAR_MM, boxes[:, 2:] + NEAR_MM
    return np.asarray(((places[:, None] > low) & (places[:, None] < high)).all(axis=2))


def in_true_mm(letters: Letters, sheet: Sheet, truth: Mapping[str, Any]) -> Letters:
    """The letters with their boxes in millimetres of the true sheet."""
    low, far = letters.box_mm[:, :2], letters.box_mm[:, :2] + letters.box_mm[:, 2:]
    low, far = (true_places(truth, mapped(sheet.mm_to_px, corner)) for corner in (low, far))
    return replace(letters, box_mm=np.concatenate([low, far - low], axis=1))


def measured(name: str, students: int, first_seed: int) -> tuple[LettersTally, SwapsTally]:
    """Read a scene's letters, and the same with letters exchanged."""
    tally, swaps = LettersTally(), SwapsTally()
    for work in works(scene_named(name), students, first_seed):
        with tempfile.TemporaryDirectory() as folder:
            for number, sheet in enumerate(work.sheets):
                page = open_page(PageRef("sheet", path=sheet.save(Path(folder) / f"{number}")))
                if page.ink is not None and page.sheet is not None:
                    start = time.process_time()
                    letters = find_letters(page.ink)
                    tally.ms.append(1000.0 * (time.process_time() - start))
                    letters = in_true_mm(letters, page.sheet, sheet.truth)
                    tally.add(sheet.truth, letters)
                    swaps.add(sheet.truth, letters, work)
    return tally, swaps


def rows(names: Sequence[str], students: int, first_seed: int) -> Iterator[list[str]]:
    """A row of the table for each scene."""
    for name in names:
        tally, swaps = measured(name, students, first_seed)
        yield [
            scene_named(name).title,
            str(tally.nodes),
            _share(tally.read, tally.nodes),
            str(tally.said),
            _share(tally.wrong, tally.said),
            _share(tally.stray, tally.said),
            str(swaps.pairs),
            _share(swaps.found, swaps.pairs),
            str(swaps.falsely),
            f"{np.median(tally.ms):.0f}" if tally.ms else NOTHING,
        ]


def _share(part: int, of: int) -> str:
    return f"{100.0 * part / of:.1f}" if of else NOTHING


HEADS = (
    "scene", "letters of nodes", "read, %", "said above 0.9", "another sign, %", "no sign, %", "pairs",
    "swaps found, %", "swaps falsely", "ms a sheet",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser("python -m tests.bench.letters", description=__doc__)
    parser.add_argument("--scenes", nargs="*", default=SCENES)
    parser.add_argument("--students", type=int, default=10)
    parser.add_argument("--first", type=int, default=1)
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    print(as_text([("Letters of nodes", HEADS, list(rows(asked.scenes, asked.students, asked.first)))]))


if __name__ == "__main__":
    main()
