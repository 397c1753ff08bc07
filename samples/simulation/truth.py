"""The truth of a sheet's drawing, as one JSON object.

Positions are sheet millimetres from the top left corner, x right, y down; directions are degrees
counter-clockwise from +x. `nodes` are the construction's points as this hand drew them; a stroke
may miss them by the redraw error (`line_mm`). `intended` is the drawing of a perfect hand with the
same mistakes: follow-through should expect it. The whole drawing is turned by `turn_deg`.
"""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from samples.simulation.figures import at_origin, pole_text
from samples.simulation.hand import DrawingTask, DrawnFigure, DrawnSheet
from samples.simulation.lettering import WrittenSign
from samples.simulation.mistakes import StudentMistake
from samples.simulation.page import Frame
from samples.simulation.settings import MECHANISM, Settings
from samples.simulation.sketch import SheetSketch, WrittenLabel
from samples.simulation.view import PaperView

SCHEMA_VERSION = 1


def xy(at: complex) -> list[float]:
    """A point as written to the file: x, y down, to 0.1 um."""
    return [round(at.real, 4), round(-at.imag, 4)]


def direction(vector: complex) -> float | None:
    """Degrees counter-clockwise from +x, 0 <= d < 360; None for a zero vector."""
    if abs(vector) < 1e-6:
        return None
    return round(float(np.degrees(np.angle(vector))) % 360.0, 4) % 360.0


def drawing_truth(
    task: DrawingTask,
    sheet: DrawnSheet,
    sketch: SheetSketch,
    origins: Mapping[str, complex],
    missing: Mapping[str, Mapping[str, str]],
) -> dict[str, Any]:
    """The truth of the drawing on the paper, independent of the scanner."""
    figures = {
        figure.name: _figure(task, figure, sketch, origins[figure.name], missing.get(figure.name, {}))
        for figure in sheet.figures
    }
    return {
        "schema_version": SCHEMA_VERSION,
        "assignment": task.assignment.id,
        "n": task.variant.n,
        "position": task.variant.position,
        "kind": sheet.kind,
        "figures": figures,
        "poles": {name: pole_text(task, name) for name in figures if name != MECHANISM},
        "scales": {"declared": _rounded(task.declared), "used": _rounded(task.used)},
        "turn_deg": round(float(np.degrees(task.right.parameters.get("turn", 0.0))), 4),
        "mistakes": [_mistake(mistake) for mistake in task.mistakes],
        "labels": [_label(label) for label in sketch.labels],
    }


def _label(label: WrittenLabel) -> dict[str, Any]:
    signs = [[sign.sign, *_box(sign)] for sign in label.signs]
    return {"text": label.text, "names": label.names, "box_mm": _box(label), "signs": signs}


def _box(of: WrittenLabel | WrittenSign) -> list[float]:
    """Left, top, right, bottom."""
    return [*xy(complex(of.low.real, of.high.imag)), *xy(complex(of.high.real, of.low.imag))]


def _rounded(scales: Mapping[str, float]) -> dict[str, float]:
    return {name: float(f"{value:.9g}") for name, value in scales.items()}


def _mistake(mistake: StudentMistake) -> dict[str, Any]:
    usual = StudentMistake(mistake.code, mistake.at)
    details = ("slot", "other", "factor", "quarters", "n", "position")
    told = {name: getattr(mistake, name) for name in details}
    unusual = {name: value for name, value in told.items() if value != getattr(usual, name)}
    return {"code": mistake.code, "at": mistake.at, **unusual}


def _figure(
    task: DrawingTask, figure: DrawnFigure, sketch: SheetSketch, origin: complex, missing: Mapping[str, str]
) -> dict[str, Any]:
    nodes = at_origin(figure, origin)
    lines = {name: [xy(p), xy(q)] for (owner, name), (p, q) in sketch.lines.items() if owner == figure.name}
    truth: dict[str, Any] = {
        "origin_mm": xy(origin),
        "nodes": {name: xy(at) for name, at in nodes.items()},
    }
    if figure.name == MECHANISM:
        extras = {name: line for name, line in lines.items() if name[1] == "_"}
        return {**truth, "links": {n: line for n, line in lines.items() if n not in extras}, "extras": extras}
    vectors, ends = {}, {}
    for vector in task.wrong.construction.vectors_of(figure.name):
        ends[vector.name] = [vector.tail, vector.head]
        if vector.name in missing or (vector.is_sum and vector.name not in lines):
            continue
        tail, head = (vector.head, vector.tail) if vector.reversed else (vector.tail, vector.head)
        drawn = nodes[head] - nodes[tail]
        meant = figure.intended[head] - figure.intended[tail]
        vectors[vector.name] = {
            "tail": tail,
            "head": head,
            "length_mm": round(abs(drawn), 4),
            "direction_deg": direction(drawn),
            "line_mm": lines.get(vector.name),
            "intended": {"length_mm": round(abs(meant), 4), "direction_deg": direction(meant)},
        }
    sides = {name: line for name, line in lines.items() if name.startswith("side ")}
    thin = [[xy(p), xy(q)] for p, q in sketch.construction.get(figure.name, [])]
    told = {"vectors": vectors, "missing": dict(missing), "ends": ends, "sides": sides, "construction": thin}
    return {**truth, **told}


def scan_truth(view: PaperView, frame: Frame | None, settings: Settings) -> dict[str, Any]:
    """The paper's position in the image."""
    grid = np.array([[x, y] for y in (10.0, 102.0, 194.0, 286.0) for x in np.linspace(10.0, 410.0, 6)])
    pixels = view.to_px(grid)
    lens = {"k1": view.k1, "centre": view.centre.tolist(), "r": view.radius} if view.k1 else None
    scan = settings.scan
    return {
        "homography": [[float(cell) for cell in row] for row in view.homography],
        "lens": lens,
        "curl_mm": view.curl_mm,
        "grid_mm_px": [[a.tolist(), np.round(b, 4).tolist()] for a, b in zip(grid, pixels, strict=True)],
        "image_size": [view.size[1], view.size[0]],
        "px_per_mm": round(view.px_per_mm, 5),
        "rotation_deg": (-90 * view.turns) % 360,
        "frame": None
        if frame is None
        else {
            "kind": frame.kind,
            "by": frame.by,
            "corners_mm": None if frame.corners is None else [xy(c) for c in frame.corners],
        },
        "scan": {
            "device": scan.device,
            "dpi": scan.dpi,
            "mode": scan.mode,
            "dpi_tag": scan.dpi_tag,
            "copy_scale": scan.copy_scale,
            "quarter_turns": scan.quarter_turns,
        },
        "hand": asdict(settings.hand),
    }
