"""Hardships have their frequencies, and a class makes only mistakes that its mechanism admits."""

from dataclasses import replace

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from samples.simulation import HARDSHIPS, PERFECT, Scan, Settings, any_settings, simulate
from samples.simulation.hand import draw, task_of

pytestmark = pytest.mark.slow
SMALL = Scan(dpi=45.0, noise=0.0, tint_grain=0.0, dust=0)


def test_hardships_come_as_often_as_they_say():
    plain = [any_settings(seed, hardship=0.0) for seed in range(400)]
    usual = [any_settings(seed) for seed in range(400)]
    stray = sum(one.student.helpers > 0 for one in usual) / len(usual)
    assert stray == pytest.approx(HARDSHIPS["stray lines"], abs=0.06)
    assert all(one.student.helpers == 0 and one.scan.stains == 0 for one in plain)


@pytest.mark.parametrize("name", ["shaper", "pump", "press", "engine", "piston"])
def test_a_mixed_class_makes_only_mistakes_that_its_mechanism_offers(name):
    assignment = load_assignment(name)
    variants = assignment.variants()
    made = 0
    for seed in range(15):
        variant = variants[seed % len(variants)]
        settings = any_settings(seed, mistakes=2.0, work=(assignment, variant))
        task = task_of(assignment, variant, settings.student, np.random.default_rng([seed, 0]))
        draw(task, settings.hand, settings.student, np.random.default_rng([seed, 1]))
        made += len(task.mistakes)
    assert made > 0


def test_thin_construction_lines_stand_in_the_truth():
    assignment = load_assignment("engine")
    settings = Settings(PERFECT, scan=SMALL)
    with_lines = replace(settings, pen=replace(settings.pen, construction_lines=1.0))
    without = replace(settings, pen=replace(settings.pen, construction_lines=0.0))
    counts = [
        len(simulate(assignment, assignment.variants()[1], 2, one)[0].truth["figures"]["velocity_plan"]
            ["construction"])
        for one in (with_lines, without)
    ]  # fmt: skip
    assert counts[0] > counts[1] == 0
