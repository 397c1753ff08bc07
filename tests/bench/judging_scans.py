"""The same held against pictures: simulated scans, read and judged as `planmark grade` does."""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.pipeline import open_page, read_pages
from grader.records import PageRef, Reading
from samples.simulation import Settings, SimulatedSheet, any_settings, simulate
from samples.simulation.student import drawn_by
from tests.bench.judging_assignments import assignment_named
from tests.bench.judging_handed_in import texts
from tests.bench.judging_students import HANDS, Key, Work, codes_of, is_hidden
from tests.bench.judging_tally import Result, Times, result_of

_TRIES = 40


def judged_scan(key: Key, times: Times) -> list[Result]:
    """One student's scans (flatbed, 300 dpi), read and judged, against what was due.

    Raises ValueError where no drawing of this kind comes about.
    """
    work, pages = _drawn(key)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        readings = _read(work, pages)
    finally:
        cv2.setNumThreads(threads)
    handed_in = Submission(
        readings=tuple(one for one in readings if one.figures), declared=texts(work.task.declared)
    )
    task = task_of(work.assignment, work.rubric, work.variant)
    start = time.process_time()
    judgement = judge(task, handed_in)
    times.scans.append(1000.0 * (time.process_time() - start))
    return [result_of(work, "scans", handed_in, judgement)]


def _drawn(key: Key) -> tuple[Work, list[SimulatedSheet]]:
    assignment, rubric = assignment_named(key.assignment)
    variants = assignment.variants()
    lot = key.lot("scan")
    variant = variants[int(lot.integers(len(variants)))]
    for _ in range(_TRIES):
        seed = int(lot.integers(1_000_000))
        settings = _settings(key, seed, lot)
        try:
            desk, drawn = drawn_by(assignment, variant, seed, settings)
        except ValueError:  # a mistake that cannot be made here
            continue
        if is_hidden(desk.task):
            continue
        pages = simulate(assignment, variant, seed, settings)
        left_out = {
            name
            for page in pages
            for figure in page.truth["figures"].values()
            for name in figure.get("missing", {})
        }
        left = frozenset(left_out) | desk.task.missing
        work = Work(key, assignment, rubric, desk.task, drawn, declares=True, letters=True, left_out=left)
        return work, pages
    raise ValueError(f"{key}: no such drawing in {_TRIES} tries")


def _settings(key: Key, seed: int, lot: np.random.Generator) -> Settings:
    """Habits, pen, page and scan by lot; the hand and the mistakes by the key."""
    settings = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.0)
    habits = replace(settings.student, mistakes=codes_of(key, lot))
    return replace(settings, hand=HANDS[key.hand], student=habits)


def _read(work: Work, pages: Sequence[SimulatedSheet]) -> list[Reading]:
    with tempfile.TemporaryDirectory() as folder:
        paths = [page.save(Path(folder) / str(number)) for number, page in enumerate(pages)]
        seen = [open_page(PageRef(path.name, path=path)) for path in paths]
        return [
            page.reading
            for page in read_pages(
                seen, work.assignment, work.variant, texts(work.task.declared), work.rubric.vectors
            )
        ]
