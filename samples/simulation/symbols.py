"""Signs of a kinematic sketch: joints, supports, sliders, hatching, arrowheads, turning arrows."""

import numpy as np

from samples.simulation.sketch import CHAIN, SheetSketch
from samples.simulation.strokes import PenWidth, arc

JOINT_RADIUS_MM = 1.3


def arrowhead(sketch: SheetSketch, pen: PenWidth, tail: complex, tip: complex, size_mm: float) -> None:
    """Draw an arrowhead at `tip` in this person's way; smaller on short vectors, none on tiny ones."""
    length = abs(tip - tail)
    kind = sketch.style.arrow
    if kind == "none" or length < 1.5:
        return
    rng = sketch.rng
    size = min(size_mm * rng.uniform(0.85, 1.15), 0.6 * length)
    back = -(tip - tail) / length
    spread = np.radians(sketch.style.arrow_half_deg * rng.uniform(0.8, 1.2))
    left, right = (tip + size * back * np.exp(1j * s * spread * rng.uniform(0.8, 1.2)) for s in (1, -1))
    fine = PenWidth(pen.layer, 0.75 * pen.width_mm, pen.dark, pen.pressure, 0.0)
    if kind == "filled":
        for share in np.linspace(0.0, 1.0, max(3, int(size / 0.5))):
            sketch.line(fine, tip, left + (right - left) * share)
        sketch.line(fine, left, right)
    elif kind == "half":
        sketch.line(fine, tip, left)
    elif kind == "closed":
        for p, q in ((tip, left), (left, right), (right, tip)):
            sketch.line(fine, p, q)
    else:
        sketch.line(fine, tip, left)
        sketch.line(fine, tip, right)


def circle(sketch: SheetSketch, centre: complex, radius_mm: float, pen: PenWidth) -> None:
    """Draw a circle, by compass or by hand: nearly closed."""
    rng = sketch.rng
    sweep = 2 * np.pi + rng.normal(0.0, 0.15)
    points = arc(centre, radius_mm, rng.uniform(0, 2 * np.pi), sweep)
    wobble = 1.0 + 0.02 * np.cos(2 * np.angle(points - centre) + rng.uniform(0, 6))
    sketch.curve(pen, centre + (points - centre) * wobble)


def dot(sketch: SheetSketch, centre: complex, radius_mm: float) -> None:
    """Draw a dot."""
    pen = sketch.pen("line", plan=True)
    fine = PenWidth(pen.layer, 0.7 * radius_mm, pen.dark, pen.pressure, 0.0)
    sketch.curve(fine, arc(centre, 0.55 * radius_mm, sketch.rng.uniform(0, 2 * np.pi), 4 * np.pi))


def hatching(sketch: SheetSketch, p: complex, q: complex, depth_mm: float, gap_mm: float = 1.6) -> None:
    """Draw short slanted strokes to the right of the line from p to q (below, if it runs rightwards)."""
    length = abs(q - p)
    along = (q - p) / max(length, 1e-9)
    pen = sketch.pen("thin")
    at = 0.0
    while at < length:
        foot = p + along * at
        lean = depth_mm * sketch.rng.uniform(0.8, 1.2)
        sketch.line(pen, foot, foot + lean * along * np.exp(-1j * sketch.rng.normal(2.3, 0.08)))
        at += gap_mm * sketch.rng.uniform(0.75, 1.3)


def support(sketch: SheetSketch, at: complex, turn: complex) -> None:
    """Draw a fixed pivot; `turn` is a unit vector along the ground."""
    pen = sketch.pen("line")
    wide, high = sketch.rng.uniform(3.2, 4.6), sketch.rng.uniform(4.5, 6.5)
    circle(sketch, at, JOINT_RADIUS_MM, pen)
    left, right = at + turn * complex(-wide, -high), at + turn * complex(wide, -high)
    match sketch.style.support:
        case "triangle":
            sketch.line(pen, at - 1j * turn * JOINT_RADIUS_MM, left)
            sketch.line(pen, at - 1j * turn * JOINT_RADIUS_MM, right)
        case "arch":
            inner = 0.65 * wide
            sketch.curve(pen, arc(at, inner, float(np.angle(turn)), np.pi))
            sketch.line(pen, at + turn * inner, at + turn * complex(inner, -high))
            sketch.line(pen, at - turn * inner, at + turn * complex(-inner, -high))
        case _:
            sketch.line(pen, at - 1j * turn * JOINT_RADIUS_MM, at - 1j * turn * high)
    ends = left - turn * 1.5, right + turn * 1.5
    sketch.line(pen, *ends)
    hatching(sketch, *ends, depth_mm=2.4)


def slider(sketch: SheetSketch, at: complex, along: complex) -> None:
    """Draw a slider on a guide: a rectangle, the guide's centre line, ground below or on both sides."""
    pen, thin = sketch.pen("line"), sketch.pen("thin")
    high = block(sketch, at, along)
    reach = sketch.rng.uniform(14.0, 26.0)
    sides = (-1, 1) if sketch.chance(0.3) else (-1,)
    for side in sides:
        p, q = (at + along * complex(sx * reach, side * (high + 0.3)) for sx in (-1, 1))
        sketch.line(pen, p, q)
        hatching(sketch, *((p, q) if side < 0 else (q, p)), depth_mm=2.2)
    if sketch.chance(0.6):
        sketch.line(thin, at - along * reach * 1.2, at + along * reach * 1.3, CHAIN)


def block(sketch: SheetSketch, at: complex, along: complex) -> float:
    """Draw a sliding block; return half its height."""
    pen = sketch.pen("line")
    wide, high = sketch.rng.uniform(4.5, 7.5), sketch.rng.uniform(2.4, 3.8)
    corners = [at + along * complex(sx * wide, sy * high) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    for p, q in zip(corners, corners[1:] + corners[:1], strict=True):
        sketch.line(pen, p, q)
    return float(high)


def turning_arrow(
    sketch: SheetSketch, centre: complex, start_rad: float, radius_mm: float, sense: float
) -> None:
    """Draw a curved arrow about a pivot, with the letter omega."""
    pen = sketch.pen("text")
    points = arc(centre, radius_mm, start_rad, np.sign(sense) * sketch.rng.uniform(0.9, 1.5))
    sketch.curve(pen, points)
    tip, before = complex(points[-1]), complex(points[-3])
    arrowhead(sketch, pen, tip + 4.0 * (before - tip) / abs(before - tip), tip, 2.2)
    middle = complex(points[len(points) // 2])
    sketch.letter(middle, "ω_1", 0.8 * sketch.page.letter_mm, names="", distance_mm=1.0)


def cross_out(sketch: SheetSketch, low: complex, high: complex) -> None:
    """Draw two or three long strokes through something that does not count."""
    pen = sketch.pen("line")
    rng = sketch.rng
    for p, q in ((low, high), (complex(low.real, high.imag), complex(high.real, low.imag))):
        bend = (p + q) / 2 + complex(*rng.normal(0, 2.0, 2))
        sketch.curve(pen, np.array([p, bend, q]))


def inside_hatching(sketch: SheetSketch, corners: tuple[complex, complex, complex], gap_mm: float) -> None:
    """Draw parallel thin lines across a triangular plate."""
    points = np.array(corners)
    lean = complex(np.exp(1j * sketch.rng.uniform(0.5, 1.2)))
    height = (points * np.conj(lean)).imag
    at = float(height.min()) + gap_mm
    while at < height.max() - 0.4 * gap_mm:
        crossings = _crossings(points, height, at)
        if len(crossings) == 2:
            sketch.line(sketch.pen("thin"), crossings[0], crossings[1])
        at += gap_mm * sketch.rng.uniform(0.85, 1.15)


def _crossings(points: np.ndarray, height: np.ndarray, at: float) -> list[complex]:
    found = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        if (height[i] - at) * (height[j] - at) < 0:
            share = (at - height[i]) / (height[j] - height[i])
            found.append(complex(points[i] + (points[j] - points[i]) * share))
    return found
