"""Force polygons as students draw them: named beside their vectors, tiny forces as dots or left out."""

from dataclasses import replace

import numpy as np

from reference.construction.graph import Vector
from samples.simulation import symbols
from samples.simulation.figures import draw_construction_lines, vector_text
from samples.simulation.force_orders import HABITS
from samples.simulation.hand import DrawingTask, Nodes
from samples.simulation.settings import Student
from samples.simulation.sketch import DASHES, SheetSketch
from samples.simulation.strokes import Rng

LEFT_OUT_MM, DOT_MM = 0.5, 2.0
"""Forces below the first are left out, those below the second are dots as often as tiny vectors."""


def draw_force_plan(
    sketch: SheetSketch, task: DrawingTask, figure: str, nodes: Nodes, student: Student
) -> dict[str, str]:
    """Draw a force polygon: lines, vectors, their names. Return the vectors not drawn, with reasons."""
    construction = task.wrong.construction
    missing = {name: "mistake" for name in task.missing if name in construction.vectors}
    missing |= {
        vector.name: "not in this order"
        for vector in task.right.construction.vectors_of(figure)
        if vector.name not in construction.vectors
    }
    draw_construction_lines(sketch, task, figure, nodes)
    if student.arrows_in_middle:
        for node in nodes.values():
            symbols.dot(sketch, node, sketch.rng.uniform(0.35, 0.55))
    taken: set[frozenset[str]] = set()
    for vector in construction.vectors_of(figure):
        size = abs(nodes[vector.head] - nodes[vector.tail])
        if size < LEFT_OUT_MM:
            missing[vector.name] = "too short to draw"
        elif vector.is_sum and student.whole_reactions == "none":
            missing[vector.name] = "not drawn out"
        elif size < DOT_MM and sketch.chance(0.6):
            missing[vector.name] = "too short to draw"
            if sketch.chance(0.5):
                symbols.dot(sketch, nodes[vector.head], sketch.rng.uniform(0.35, 0.55))
        else:
            is_beside = frozenset((vector.tail, vector.head)) in taken
            taken.add(frozenset((vector.tail, vector.head)))
            _force(sketch, figure, vector, nodes, student, is_beside=is_beside)
    return missing


def _force(
    sketch: SheetSketch, figure: str, vector: Vector, nodes: Nodes, student: Student, *, is_beside: bool
) -> None:
    """Draw one force with its arrowhead and its name; one on another's line beside that, if at all apart."""
    tail, head = nodes[vector.tail], nodes[vector.head]
    tail, head = (head, tail) if vector.reversed else (tail, head)
    p, q = sketch.redrawn(tail, head)
    along = (q - p) / abs(q - p)
    if is_beside and sketch.chance(0.5):
        aside = 1j * along * float(sketch.rng.choice([-1.0, 1.0]) * sketch.rng.uniform(0.8, 1.8))
        p, q = p + aside, q + aside
    pen = sketch.pen("line", plan=True)
    sketch.line(pen, p, q, DASHES if vector.is_sum and student.whole_reactions == "dashed" else None)
    if not vector.is_sum and sketch.chance(sketch.style.doubled):
        sketch.line(pen, *sketch.redrawn(p, q))
    tip = q
    if student.arrows_in_middle and abs(q - p) > 3.0 * sketch.style.arrow_mm:
        tip = p + (q - p) * sketch.rng.uniform(0.5, 0.62)
    symbols.arrowhead(sketch, pen, p, tip, sketch.style.arrow_mm)
    sketch.lines[figure, vector.name] = (p, q)
    if sketch.chance(student.force_names):
        middle = p + (q - p) * sketch.rng.uniform(0.35, 0.65)
        text, height = vector_text(sketch, vector.name), 0.8 * sketch.page.letter_mm
        sketch.letter(middle, text, height, names=vector.name, distance_mm=0.9)


NAMED = (0.0, 0.6, 0.9, 1.0)
"""Shares of forces with their names."""


def any_drawer_of_forces(student: Student, rng: Rng) -> Student:
    """A student with random habits in force polygons."""
    return replace(
        student,
        force_order=str(rng.choice(np.array(HABITS), p=[0.35, 0.3, 0.15, 0.12, 0.08])),
        whole_reactions=("none", "dashed", "full")[rng.choice(3, p=[0.35, 0.4, 0.25])],
        force_names=float(rng.choice(np.array(NAMED), p=[0.1, 0.2, 0.3, 0.4])),
        arrows_in_middle=bool(rng.random() < 0.15),
        largest_force_mm=float(rng.uniform(80.0, 125.0)),
        crank_mm=float(rng.choice([30.0, 40.0])),
        sheets=1,
        vectors_on_mechanism=False,
        from_plans=False,
        altitude=False,
    )
