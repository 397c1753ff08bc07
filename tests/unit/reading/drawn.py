"""Ink of a drawing without pixels: strokes of every vector as a hand draws them, with known truth."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from grader.reading.expected import links_of
from grader.records import MECHANISM, FloatArray, Ink, InkMap, Sheet, Strokes
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.construction.derive import construction_of
from reference.construction.graph import evaluate, parameters_of
from reference.construction.mistakes import Drawing

PLACES = {MECHANISM: 120 - 190j, "velocity_plan": 280 - 70j, "acceleration_plan": 330 - 200j}
"""Origins on the sheet, mm, y up (so y is negative)."""
JOINT_MM = 1.5
PEN_MM = 0.5


@dataclass(frozen=True)
class Drawn:
    """One sheet as drawn: its ink, and the true nodes and vectors."""

    ink: Ink
    sheet: Sheet
    nodes: Mapping[str, complex]
    vectors: Mapping[str, complex]


@dataclass
class Pen:
    """A hand that redraws lines with small errors, what it leaves out, and whether it draws the sums."""

    redraw_mm: float = 0.08
    seed: int = 1
    left_out: frozenset[str] = frozenset()
    sums: bool = False
    extra: list[tuple[complex, complex]] = field(default_factory=list)


def task(name: str = "pump", variant: Variant | None = None) -> tuple[Assignment, Variant, Drawing]:
    """An assignment, a variant (the first by default) and its drawing at the proposed scales."""
    assignment = load_assignment(name)
    chosen = variant or assignment.variants()[0]
    scales = assignment.scales([chosen])
    mechanism = assignment.mechanism([chosen])
    return (
        assignment,
        chosen,
        Drawing(construction_of(mechanism), parameters_of(mechanism, scales.kL, scales.kv, scales.ka)),
    )


def draw(drawing: Drawing, figures: Mapping[str, complex] | None = None, pen: Pen | None = None) -> Drawn:
    """Draw the figures, each with its origin at a place on the sheet."""
    places, pen = PLACES if figures is None else figures, pen or Pen()
    exact = {name: complex(np.ravel(at)[0]) for name, at in evaluate(*_parts(drawing)).items()}
    construction = drawing.construction
    nodes: dict[str, complex] = {}
    lines: list[tuple[complex, complex]] = list(pen.extra)
    circles: list[complex] = []
    vectors: dict[str, complex] = {}
    for figure, origin in places.items():
        names = [step.node for step in construction.figures[figure]]
        nodes.update({name: origin + exact[name] for name in names})
        if figure == MECHANISM:
            circles.extend(nodes[name] for name in names)
            for edge in links_of(construction):
                tail, head = nodes[names[edge.tail]], nodes[names[edge.head]]
                short = JOINT_MM * (head - tail) / abs(head - tail)
                lines.append((tail + short, head - short))
            continue
        for vector in construction.vectors_of(figure) if pen.sums else construction.polygon_of(figure):
            tail, head = nodes[vector.tail], nodes[vector.head]
            if vector.name not in pen.left_out:
                vectors[vector.name] = head - tail
                if abs(head - tail) > 1.5:
                    lines.append((tail, head))
    return Drawn(_ink(lines, circles, pen), blank_sheet(), nodes, vectors)


def _parts(drawing: Drawing) -> tuple[object, object]:
    return drawing.construction, drawing.parameters


def blank_sheet() -> Sheet:
    """An A3 sheet that is known exactly."""
    return Sheet(
        mm_to_px=np.diag([10.0, 10.0, 1.0]),
        page_mm=(420.0, 297.0),
        method="markers",
        px_per_mm=10.0,
        rotation_deg=0.0,
        residual_mm=0.0,
        scale_se=0.0,
        drawable_mm=(20.0, 10.0, 390.0, 277.0),
    )


def ink_of(lines: list[tuple[complex, complex]]) -> Ink:
    """Ink of given lines, exactly."""
    return _ink(lines, [], Pen(redraw_mm=0.0))


def _ink(lines: list[tuple[complex, complex]], circles: list[complex], pen: Pen) -> Ink:
    rng = np.random.default_rng(pen.seed)
    ends = np.array(lines, dtype=np.complex128).reshape(-1, 2)
    span = ends[:, 1] - ends[:, 0]
    cap = 0.5 * PEN_MM * span / np.maximum(np.abs(span), 1e-9)
    ends = ends + np.column_stack([-cap, cap])
    ends = ends + pen.redraw_mm * (rng.normal(size=ends.shape) + 1j * rng.normal(size=ends.shape))
    count = len(ends)
    strokes = Strokes(
        ends=np.stack([ends.real, -ends.imag], axis=-1),
        width=np.full(count, PEN_MM),
        se_offset=np.full(count, 0.02),
        se_angle=0.02 / np.maximum(np.abs(span), 1.0),
        se_end=np.full((count, 2), 0.2),
        darkness=np.full(count, 0.7),
    )
    round_ones: FloatArray = np.array([[at.real, -at.imag, JOINT_MM] for at in circles]).reshape(-1, 3)
    nothing = InkMap(np.zeros((297, 420), dtype=np.uint8), 1.0)
    return Ink(strokes, round_ones, np.zeros((0, 4)), nothing)
