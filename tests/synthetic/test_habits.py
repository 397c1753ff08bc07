"""Habits, paper and scanners show on the sheet, and the true vectors stay as they were."""

from dataclasses import replace

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from samples.simulation import (
    HABITS,
    HARDSHIPS,
    PERFECT,
    PageStyle,
    Scan,
    Settings,
    Student,
    simulate,
    with_hardships,
)

pytestmark = pytest.mark.slow
SMALL = Scan(dpi=45.0, noise=0.0, tint_grain=0.0, dust=0)


class Only:
    """A random generator that gives one hardship and no other."""

    def __init__(self, name):
        self.drawn = iter([0.0 if one == name else 1.0 for one in HARDSHIPS])

    def random(self):
        return next(self.drawn)

    def uniform(self, _low, _high, count):
        return np.full(count, 0.7)


def drawn(scan=SMALL, page=None, hardship=None, **student):
    settings = Settings(PERFECT, Student(**student), page=page or PageStyle(), scan=scan)
    assignment = load_assignment("pump")
    return simulate(assignment, assignment.variant(9), 3, with_hardships(settings, Only(hardship)))[0]


@pytest.mark.parametrize(
    "changes", [*({"habits": (habit,)} for habit in HABITS), *({"hardship": name} for name in HARDSHIPS)]
)
def test_a_habit_and_a_hardship_are_seen_and_leave_the_true_vectors(changes):
    one, plain = drawn(**changes), drawn()
    assert one.image.shape == plain.image.shape
    assert np.any(one.image != plain.image)
    for figure in ("velocity_plan", "acceleration_plan"):
        vectors, usual = (sheet.truth["figures"][figure]["vectors"] for sheet in (one, plain))
        if "hardship" in changes:
            assert vectors == usual
        for name, vector in usual.items():
            assert vectors[name]["length_mm"] == pytest.approx(vector["length_mm"], abs=1e-3)


def test_long_helper_lines_stand_in_the_truth():
    one, plain = drawn(habits=("long helpers",)), drawn()
    counts = [len(sheet.truth["figures"]["velocity_plan"]["construction"]) for sheet in (one, plain)]
    assert counts[0] == counts[1] + 2


def test_an_unsharp_mask_makes_edges_overshoot():
    paper = drawn(scan=replace(SMALL, shading=0.0, fold=False)).image
    sharp = drawn(scan=replace(SMALL, shading=0.0, fold=False, sharpen=1.5)).image
    assert sharp.max() > paper.max() or sharp.min() < paper.min()


def test_a_dithered_page_has_two_values_and_tones():
    scan = replace(SMALL, device="copier", mode="bilevel", container="png", dpi=100.0)
    plain, tones = drawn(scan=scan).image, drawn(scan=replace(scan, dithered=True)).image
    assert set(np.unique(tones)) == {0, 255}
    changes = [
        np.count_nonzero(image[:, 1:] != image[:, :-1]) / (image == 0).sum() for image in (plain, tones)
    ]
    assert changes[1] > 1.5 * changes[0]


def test_millimetre_paper_has_its_colour():
    page = PageStyle(squared_mm=1.0, squares=(240, 170, 110))
    image = drawn(scan=replace(SMALL, mode="colour", dpi=100.0), page=page).image.astype(float)
    assert image[..., 0].mean() > image[..., 2].mean() + 10.0
