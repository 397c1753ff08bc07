"""Simulated classes: what independent hands draw and measure, and what copies look like."""

from dataclasses import replace
from functools import cache

import numpy as np

from grader.similarity.submission import ComparedSubmission
from reference.authored.assignment import load_assignment
from reference.plan import construction_for
from samples.simulation import CAREFUL, SLOPPY, TYPICAL, Student
from samples.simulation.hand import draw, task_of

HANDS = {"careful": CAREFUL, "typical": TYPICAL, "sloppy": SLOPPY}
READ_MM = 0.06
"""Standard deviation of a node's reading."""
UNREAD = 0.08
"""Share of the nodes that are not read."""


@cache
def drawing(name, variant_index, seed, hand="typical", mistakes=()):
    """A student's sheet: figures placed freely, and the scales used."""
    assignment = load_assignment(name)
    variant = assignment.variants()[variant_index % len(assignment.variants())]
    return any_drawing(assignment, variant, seed, hand, mistakes)


def any_drawing(assignment, variant, seed, hand="typical", mistakes=()):
    """A drawing of any assignment's variant."""
    rng = np.random.default_rng([seed, 7])
    student = Student(mistakes=mistakes)
    task = task_of(assignment, variant, student, rng)
    figures = {}
    for figure in (figure for sheet in draw(task, HANDS[hand], student, rng) for figure in sheet.figures):
        place = complex(rng.normal(200.0, 25.0), -rng.normal(150.0, 20.0))
        figures[figure.name] = {node: place + at for node, at in figure.nodes.items()}
    return ComparedSubmission(f"s{seed}", variant, (figures,), {}, task.declared)


def scanned(drawn, seed, student_id=None, moved_mm=0.0, scale=1.0):
    """A sheet as read from a scan of it; `moved_mm`: traced by hand, each point by so much."""
    rng = np.random.default_rng([seed, 9])
    (figures,) = drawn.sheets
    spread = np.hypot(READ_MM, moved_mm)
    read = {
        figure: {
            node: scale * at + complex(*rng.normal(0.0, spread, 2))
            for node, at in nodes.items()
            if rng.random() > UNREAD
        }
        for figure, nodes in figures.items()
    }
    return replace(drawn, student_id=student_id or drawn.student_id, sheets=(read,))


@cache
def scanned_class(name, count, hand="typical", variants="same", mistakes=()):
    """Independent students; `variants`: all the same, or each the next."""
    places = [1 if variants == "same" else k for k in range(count)]
    made = [drawing(name, place, seed, hand, mistakes) for seed, place in enumerate(places)]
    return [scanned(one, seed) for seed, one in enumerate(made)]


def measured(drawn, seed, step_mm=0.5, spread_mm=0.1, *, directions=True):
    """The readings of a student's ruler and protractor on a drawing."""
    rng = np.random.default_rng([seed, 21])
    (figures,) = drawn.sheets
    nodes = {node: at for figure in figures.values() for node, at in figure.items()}
    assignment = load_assignment("press" if drawn.variant.n is None else "pump")
    construction = construction_for(assignment)
    numbers = {}
    for name, vector in construction.vectors.items():
        at = nodes[vector.head] - nodes[vector.tail]
        length = abs(at) + rng.normal(0.0, spread_mm)
        numbers[name] = round(round(length / step_mm) * step_mm, 3)
        if directions and abs(at) > 5.0:
            numbers[f"{name}_deg"] = round(np.degrees(np.angle(at)) + rng.normal(0.0, 3 * spread_mm)) % 360
    return replace(drawn, sheets=(), numbers=numbers)


def changed(submissions, seed, count, student_id="copy"):
    """A copy of measured values with some of them changed by a step or two."""
    rng = np.random.default_rng([seed, 3])
    numbers = dict(submissions.numbers)
    for name in rng.choice(sorted(numbers), count, replace=False):
        numbers[name] = round(numbers[name] + float(rng.choice([-1.0, -0.5, 0.5, 1.0])), 3)
    return replace(submissions, student_id=student_id, numbers=numbers)
