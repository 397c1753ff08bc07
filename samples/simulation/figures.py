"""The mechanism's sketch and the two plans as a student draws them."""

import cmath
import math
import re
from collections.abc import Iterator, Mapping

import numpy as np

from reference.construction.elements import FixedLine, Line, View
from reference.construction.graph import ON_SKETCH, Vector, coincident, evaluate
from reference.construction.steps import ArcAndLine, Divide, Given, OnGuide, Similar, Step, TwoArcs, TwoLines
from reference.construction.triangles import triangles
from reference.mechanism import (
    Crank,
    Dyad,
    FixedGuide,
    Group,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Triad,
    Yoke,
    moving_guides,
    slotted_links,
)
from samples.simulation import symbols
from samples.simulation.hand import DrawingTask, DrawnFigure, Nodes
from samples.simulation.settings import MECHANISM, Student
from samples.simulation.sketch import CHAIN, DASHES, SheetSketch
from samples.simulation.strokes import Dash, arc


def links_of(task: DrawingTask) -> Iterator[tuple[str, str, str]]:
    """Strokes of the sketch: name, tail and head joint."""
    only_marked = task.mechanism.dots
    driver = task.mechanism.driver
    if isinstance(driver, Crank):
        yield f"{driver.pivot}{driver.pin}", driver.pivot, driver.pin
    for group in task.mechanism.groups:
        for tail, head in _bars(task, group) if group.node not in only_marked else ():
            yield f"{tail}{head}", tail, head


def _bars(task: DrawingTask, group: Group) -> Iterator[tuple[str, str]]:
    match group:
        case SlottedLink(pivot=pivot, foot=foot):
            yield foot or pivot, _end_of_slot(task, group)
            if foot is not None:
                yield pivot, foot
        case SlotPoint(node=node, link=name):
            link = slotted_links(task.mechanism)[name]
            if node != _end_of_slot(task, link):
                yield link.pivot, node
        case PointOnLine(node=node, base=(p, q), ratio=ratio):
            if not 0.0 < float(np.mean(ratio)) < 1.0:
                yield (q if float(np.mean(ratio)) > 1.0 else p), node
        case Triad():
            yield from ((start, end) for _, start, end in group.bars)
        case Dyad(node=node, pins=pins) | Plate(node=node, base=pins):
            yield from ((pin, node) for pin in pins)
        case Slider(node=node, pin=pin) | Yoke(node=node, pin=pin, guide=FixedGuide()):
            yield pin, node


def _end_of_slot(task: DrawingTask, link: SlottedLink) -> str:
    """The point in which a slotted link's bar ends: beyond the block where the link goes on in line."""
    points = (g for g in task.mechanism.groups if isinstance(g, SlotPoint) and g.slotted == link.node)
    in_line = [one for one in points if np.all(one.local_m.imag == np.mean(link.offset_m))]
    ahead = [one for one in in_line if float(np.mean(one.local_m.real)) * float(np.mean(link.side)) > 0.0]
    return max(ahead, key=lambda one: float(np.mean(abs(one.local_m))), default=link).node


def blocks_of(task: DrawingTask, group: Group) -> Iterator[tuple[str, str, str]]:
    """The joint of each block on a moving guide, and two joints of that guide."""
    if isinstance(group, SlottedLink):
        yield group.pin, group.foot or group.pivot, _end_of_slot(task, group)
    yield from ((group.node, *guide.base) for guide in moving_guides(group))


def fixed_guides(step: Step) -> list[FixedLine]:
    """The guides on the ground along which a step's node slides."""
    match step:
        case ArcAndLine(guide=guide) | OnGuide(guide=guide):
            found = [guide]
        case TwoLines(first=first, second=second):
            found = [first, second]
        case _:
            found = []
    return [guide for guide in found if isinstance(guide, FixedLine)]


def lines_of(step: TwoLines) -> list[Line]:
    """The lines of a step that are drawn from a node."""
    return [line for line in (step.first, step.second) if isinstance(line, Line)]


TOO_SHORT_MM = 0.8


def at_origin(figure: DrawnFigure, origin: complex) -> dict[str, complex]:
    """The figure's nodes on the sheet."""
    return {name: origin + node for name, node in figure.nodes.items()}


# Mechanism ----------------------------------------------------------------------------------------


def draw_mechanism(sketch: SheetSketch, task: DrawingTask, nodes: Nodes, student: Student) -> None:
    """Draw links, joints, supports, sliders, letters, and extras that some people add."""
    turn = complex(np.exp(1j * np.radians(student.turn_deg)))
    _compass_arcs(sketch, task, nodes)
    for name, tail, head in links_of(task):
        _link(sketch, name, nodes[tail], nodes[head])
    for group in task.mechanism.groups:
        is_plate = isinstance(group, Plate) and group.node not in task.mechanism.dots
        if isinstance(group, Plate) and is_plate and group.line_ratio is None and sketch.style.plate_hatched:
            p, q = group.base
            corners = (nodes[p], nodes[q], nodes[group.node])
            symbols.inside_hatching(sketch, corners, sketch.rng.uniform(2.5, 5.0))
    _sliders(sketch, task, nodes, turn)
    # A joint that coincides with another has no symbol or letter of its own.
    under = coincident(task.right.construction)
    named = [joint for joint in task.mechanism.joints if joint not in under]
    if not sketch.with_supports:
        named = [joint for joint in named if not task.mechanism.is_ground(joint)]
    for joint in named:
        if task.mechanism.is_ground(joint):
            symbols.support(sketch, nodes[joint], turn)
        elif joint in task.mechanism.dots:
            symbols.dot(sketch, nodes[joint], sketch.rng.uniform(0.4, 0.6))
        else:
            symbols.circle(sketch, nodes[joint], symbols.JOINT_RADIUS_MM, sketch.pen("line"))
    _crank_extras(sketch, task, nodes)
    if student.vectors_on_mechanism:
        _vectors_at_pin(sketch, task, nodes)
    if student.from_plans:
        _from_plans(sketch, task, nodes)
    if student.altitude:
        _altitude(sketch, task, nodes, every=student.every_altitude)
    for joint in named:
        index = joint[1:] or sketch.index
        text = joint[0] + (f"_{{{index}}}" if index else "")
        sketch.letter(nodes[joint], text, sketch.page.letter_mm, names=joint, distance_mm=2.0)


def _sliders(sketch: SheetSketch, task: DrawingTask, nodes: Nodes, turn: complex) -> None:
    """Draw blocks: those on fixed guides with their guides, those on moving links without."""
    for node, step in ((step.node, step) for step in task.wrong.construction.figures[MECHANISM]):
        for guide in fixed_guides(step):
            angle = float(task.wrong.parameters[f"angle {guide.guide}"])
            symbols.slider(sketch, nodes[node], turn * complex(np.exp(1j * angle)))
    for group in task.mechanism.groups:
        for at, tail, head in blocks_of(task, group):
            along = nodes[head] - nodes[tail]
            beyond = ((nodes[at] - nodes[tail]) / along).real
            if not 0.0 <= beyond <= 1.0:
                sketch.line(sketch.pen("line"), nodes[head if beyond > 1.0 else tail], nodes[at])
            symbols.block(sketch, nodes[at], along / abs(along))


def _link(sketch: SheetSketch, name: str, tail: complex, head: complex) -> None:
    p, q = sketch.redrawn(tail, head)
    along = (q - p) / max(abs(q - p), 1e-9)
    if sketch.style.links_stop_short and abs(q - p) > 5 * symbols.JOINT_RADIUS_MM:
        gaps = symbols.JOINT_RADIUS_MM + sketch.rng.normal(0.05, 0.12, 2)
        p, q = p + along * gaps[0], q - along * gaps[1]
    sketch.line(sketch.pen("line"), p, q)
    sketch.lines[MECHANISM, name] = (p, q)
    if sketch.chance(sketch.style.erased):
        miss = 1j * along * sketch.rng.choice([-1, 1]) * sketch.rng.uniform(0.8, 4.0)
        sketch.line(sketch.pen("ghost"), p + 0.2 * miss, q + miss)


def _compass_arcs(sketch: SheetSketch, task: DrawingTask, nodes: Nodes) -> None:
    """Draw the compass arcs where two of them met."""
    for step in task.wrong.construction.figures[MECHANISM]:
        if isinstance(step, TwoArcs) and sketch.chance(sketch.style.arcs):
            for centre in step.centres:
                reach = nodes[step.node] - nodes[centre]
                sweep = sketch.rng.uniform(5.0, 14.0) / abs(reach)
                points = arc(nodes[centre], abs(reach), float(np.angle(reach)) - sweep / 2, sweep)
                sketch.curve(sketch.pen("thin"), points)


def _crank_extras(sketch: SheetSketch, task: DrawingTask, nodes: Nodes) -> None:
    crank = task.mechanism.driver
    if not isinstance(crank, Crank):
        return
    pivot, pin = nodes[crank.pivot], nodes[crank.pin]
    sense = float(np.mean(crank.omega))
    radius = abs(pin - pivot)
    if sketch.style.crank_circle:
        start, sweep = sketch.rng.uniform(0, 6), sketch.rng.choice([2 * np.pi, 2.0])
        sketch.curve(sketch.pen("thin"), arc(pivot, radius, start, sweep), DASHES)
    start = float(np.angle(pin - pivot)) + sketch.rng.uniform(0.2, 0.5) * np.sign(sense)
    symbols.turning_arrow(sketch, pivot, start, min(radius * 0.5, sketch.rng.uniform(7, 12)), sense)


def _vectors_at_pin(sketch: SheetSketch, task: DrawingTask, nodes: Nodes) -> None:
    """Draw v_A and a_A at the crank's pin as well."""
    known, crank = task.wrong.parameters, task.mechanism.driver
    if not isinstance(crank, Crank):
        return
    arm = nodes[crank.pin] - nodes[crank.pivot]
    along = arm / abs(arm)
    speed = float(known[f"v_{crank.pin}"] / known["kv"])
    pull = float(known[f"a_{crank.pin}_n"] / known["ka"])
    for name, vector in ((f"v_{crank.pin}", 1j * along * speed), (f"a_{crank.pin}", -along * pull)):
        if sketch.chance(0.75):
            p, q = sketch.redrawn(nodes[crank.pin], nodes[crank.pin] + vector)
            sketch.line(sketch.pen("line", plan=True), p, q)
            symbols.arrowhead(sketch, sketch.pen("line", plan=True), p, q, sketch.style.arrow_mm)
            sketch.lines[MECHANISM, name] = (p, q)
            height = 0.85 * sketch.page.letter_mm
            sketch.letter(q, vector_text(sketch, name), height, names=name, distance_mm=1.5)


ALLOWED, MOST_FOOT_MM = 0.01, 100.0
"""Largest error of the ratio kL ka / kv^2 for a single right triangle; the farthest foot that is drawn."""
POLE_MM, NEAR_POLE_MM = 1.2, 150.0
"""Radius of the circle that marks a pole, and the longest way to one that is drawn."""


def _from_plans(sketch: SheetSketch, task: DrawingTask, nodes: Nodes) -> None:
    """Draw the last joint's acceleration at it, and the acceleration poles that lie near enough."""
    construction = task.wrong.construction
    plan = {name: complex(at) for name, at in evaluate(construction, task.wrong.parameters).items()}
    accelerations = [name for name in construction.on_sketch if name.startswith("a_")]
    for again in accelerations[-1:]:
        name, joint = again.removesuffix(ON_SKETCH), nodes[construction.on_sketch[again]]
        vector = construction.vectors[name]
        p, q = sketch.redrawn(joint, joint + plan[vector.head] - plan[vector.tail])
        pen = sketch.pen("line", plan=True)
        sketch.line(pen, p, q)
        symbols.arrowhead(sketch, pen, p, q, sketch.style.arrow_mm)
        sketch.lines[MECHANISM, name] = (p, q)
    for name, step in construction.centres.items():
        joints = [nodes[joint] for joint in step.base]
        corners = {**plan, **dict(zip(step.base, joints, strict=True))}
        view = View({key: np.asarray(at) for key, at in corners.items()}, {})
        at = complex(step.place(view))
        if name.startswith("J") and max(abs(at - joint) for joint in joints) < NEAR_POLE_MM:
            at += complex(*sketch.rng.normal(0.0, sketch.hand.reading_mm, 2))
            for joint in joints:
                sketch.line(sketch.pen("thin"), *sketch.redrawn(joint, at))
            symbols.circle(sketch, at, POLE_MM, sketch.pen("line"))
            sketch.lines[MECHANISM, f"J_{name[1:]}"] = (at, at)


def _altitude(sketch: SheetSketch, task: DrawingTask, nodes: Nodes, *, every: bool) -> None:
    """Draw right triangles whose altitudes give normal components: at the first moving link, or at every one.

    A single one is drawn only at scales that allow it, each only where its foot is near enough.
    """
    construction, known = task.wrong.construction, task.wrong.parameters
    holds = abs(float(known["kL"] * known["ka"] / known["kv"] ** 2) - 1.0) <= ALLOWED
    found = [one for one in triangles(construction) if every or not task.mechanism.is_ground(one.pin)]
    ends = evaluate(construction, known, wanted=[node for one in found for node in one.velocity])
    for one in found if every else found[:holds]:
        tail, head = nodes[one.pin], nodes[one.joint]
        speed = abs(complex(ends[one.velocity[1]]) - complex(ends[one.velocity[0]]))
        link = head - tail
        if speed < TOO_SHORT_MM or speed**2 > MOST_FOOT_MM * abs(link):
            continue
        laid = sketch.rng.choice([-1.0, 1.0]) * (speed + sketch.rng.normal(0.0, sketch.hand.reading_mm))
        tip = head + 1j * laid * link / abs(link)
        slip = math.radians(sketch.hand.square_deg) * sketch.rng.normal() * abs(tip - tail) / 100.0
        across = 1j * (tip - tail) * cmath.exp(1j * slip)
        foot = head + link * (np.conj(across) * (tip - head)).imag / (np.conj(across) * link).imag
        pen = sketch.pen("thin")
        for p, q in ((head, tip), (tail, tip), (tip, foot), (head, foot)):
            sketch.line(pen, *sketch.redrawn(p, q))
        sketch.lines[MECHANISM, f"f_{one.vector.name}"] = (head, foot)


# Plans --------------------------------------------------------------------------------------------


def draw_plan(
    sketch: SheetSketch, task: DrawingTask, figure: str, nodes: Nodes, student: Student
) -> dict[str, str]:
    """Draw a plan: construction lines, vectors, letters. Return the vectors not drawn, with reasons."""
    missing = {name: "mistake" for name in task.missing if name in _names(task, figure)}
    draw_construction_lines(sketch, task, figure, nodes)
    _unnamed_sides(sketch, task, figure, nodes)
    for vector in task.wrong.construction.polygon_of(figure):
        reason = _left_out(sketch, task, vector, nodes, student)
        if reason:
            missing[vector.name] = reason
        else:
            _vector(sketch, task, figure, vector, nodes)
    for vector in task.wrong.construction.vectors_of(figure) if sketch.style.sums != "none" else ():
        if vector.is_sum and abs(nodes[vector.head] - nodes[vector.tail]) >= TOO_SHORT_MM:
            _vector(sketch, task, figure, vector, nodes, DASHES if sketch.style.sums == "dashed" else None)
    _letters(sketch, task, figure, nodes)
    return missing


def _names(task: DrawingTask, figure: str) -> set[str]:
    return {vector.name for vector in task.right.construction.polygon_of(figure)}


def _left_out(
    sketch: SheetSketch, task: DrawingTask, vector: Vector, nodes: Nodes, student: Student
) -> str | None:
    if abs(nodes[vector.head] - nodes[vector.tail]) < TOO_SHORT_MM:
        return "too short to draw"
    if _is_result(task, vector) and sketch.chance(student.omitted):
        return "not drawn out"
    return None


def _is_result(task: DrawingTask, vector: Vector) -> bool:
    """Return whether a vector only joins two nodes drawn before it (pole and c, pole and b')."""
    step = task.wrong.construction.step(vector.head)
    if isinstance(step, TwoLines):
        return vector.tail not in {line.through for line in lines_of(step)}
    return vector.link is None and not isinstance(step, Given)


def _vector(
    sketch: SheetSketch,
    task: DrawingTask,
    figure: str,
    vector: Vector,
    nodes: Nodes,
    dash: Dash | None = None,
) -> None:
    p, q = sketch.redrawn(nodes[vector.tail], nodes[vector.head])
    pen = sketch.pen("line", plan=True)
    if not vector.is_sum and sketch.style.dashed_absolutes and abs(q - p) > 12 and _is_result(task, vector):
        dash = DASHES
    sketch.line(pen, p, q, dash)
    if dash is None and sketch.chance(sketch.style.doubled):
        sketch.line(pen, *sketch.redrawn(p, q))
    symbols.arrowhead(sketch, pen, p, q, sketch.style.arrow_mm)
    sketch.lines[figure, vector.name] = (p, q)
    if sketch.chance(0.4 * sketch.style.erased):
        slip = complex(*sketch.rng.normal(0.0, 1.2, 2))
        sketch.line(sketch.pen("ghost"), p, q + slip)
    if abs(q - p) > 9.0 and sketch.chance(sketch.page.vector_labels):
        text = vector_text(sketch, vector.name)
        middle = p + (q - p) * sketch.rng.uniform(0.35, 0.65)
        sketch.letter(middle, text, 0.75 * sketch.page.letter_mm, names=vector.name, distance_mm=0.9)


def draw_construction_lines(sketch: SheetSketch, task: DrawingTask, figure: str, nodes: Nodes) -> None:
    """Draw thin lines that run past the points they gave."""
    for step in task.wrong.construction.figures[figure]:
        if not isinstance(step, TwoLines):
            continue
        for line in lines_of(step):
            reach = nodes[step.node] - nodes[line.through]
            if abs(reach) < 0.3 or not sketch.chance(sketch.style.construction_lines):
                continue
            along = reach / abs(reach)
            past = sketch.rng.exponential(sketch.style.overrun_mm + 0.5, 2)
            before = past[0] if sketch.chance(0.4) else 0.0
            ends = nodes[line.through] - before * along, nodes[step.node] + past[1] * along
            sketch.line(sketch.pen("thin", plan=True), *ends, _construction_dash(sketch))
            sketch.construction.setdefault(figure, []).append(ends)


def _construction_dash(sketch: SheetSketch) -> Dash | None:
    """The dash pattern of a construction line; None for a solid one."""
    share = sketch.style.construction_dashed
    if not share or not sketch.chance(share):
        return None
    return DASHES if sketch.chance(0.6) else CHAIN


def draw_helpers(sketch: SheetSketch, task: DrawingTask, mechanism: Nodes, plan: Nodes, count: int) -> None:
    """Draw thin lines of no meaning: a link's direction carried to the plan, a ruler set wrongly."""
    links = list(links_of(task))
    points = list(plan.values())
    low, high = extent(plan)
    for _ in range(count):
        _, tail, head = links[sketch.rng.integers(len(links))]
        along = mechanism[head] - mechanism[tail]
        along *= complex(np.exp(1j * sketch.rng.choice([0.0, np.pi / 2]))) / abs(along)
        if sketch.chance(0.5):
            foot = points[sketch.rng.integers(len(points))]
            foot += complex(*sketch.rng.normal(0.0, 2.0, 2))
        else:
            share = sketch.rng.uniform(-0.1, 1.1, 2)
            foot = low + complex(share[0] * (high - low).real, share[1] * (high - low).imag)
        before, past = sketch.rng.uniform(2.0, 25.0, 2)
        sketch.line(sketch.pen("thin", plan=True), foot - before * along, foot + past * along)


def _unnamed_sides(sketch: SheetSketch, task: DrawingTask, figure: str, nodes: Nodes) -> None:
    """Draw the sides of a similar triangle that no named vector draws."""
    drawn = {frozenset((v.tail, v.head)) for v in task.wrong.construction.polygon_of(figure)}
    for step in task.wrong.construction.figures[figure]:
        if isinstance(step, Similar | Divide):
            for end in step.base:
                length = abs(nodes[end] - nodes[step.node])
                if frozenset((end, step.node)) not in drawn and length > TOO_SHORT_MM:
                    p, q = sketch.redrawn(nodes[end], nodes[step.node])
                    sketch.line(sketch.pen("line", plan=True), p, q)
                    sketch.lines[figure, f"side {end} {step.node}"] = (p, q)


def _letters(sketch: SheetSketch, task: DrawingTask, figure: str, nodes: Nodes) -> None:
    circles = sketch.chance(sketch.style.node_circles)
    dots = not circles and sketch.chance(sketch.style.node_dots)
    for node, at in nodes.items():
        letter = task.letter_of(node)
        if node.startswith(("n_", "k_")):
            if sketch.chance(sketch.page.end_labels):
                text, height = f"{letter[0]}_{{{letter[2:]}}}", 0.7 * sketch.page.letter_mm
                sketch.letter(at, text, height, names=node, distance_mm=0.8)
            continue
        if circles:
            symbols.circle(sketch, at, sketch.rng.uniform(0.5, 1.1), sketch.pen("thin"))
        elif dots:
            symbols.dot(sketch, at, sketch.rng.uniform(0.35, 0.55))
        is_pole = node == task.wrong.construction.poles[figure]
        text = pole_text(task, figure) if is_pole else re.sub(r"(\d+)", r"_{\1}", letter)
        index = sketch.index or (sketch.pole_index if is_pole else "")
        text += f"_{{{index}}}" if index else ""
        sketch.letter(at, text, sketch.page.letter_mm, names=node, distance_mm=1.2)


def pole_text(task: DrawingTask, figure: str) -> str:
    """The letter of a plan's pole as the assignment has it."""
    pole = task.wrong.construction.poles[figure]
    return task.assignment.file.names.get(pole, pole)


def vector_text(sketch: SheetSketch, name: str) -> str:
    """The name of a vector as written beside it."""
    kind, about, *part = name.split("_")
    bar = "\u0304" if sketch.page.bar_over_vectors else ""
    return f"{kind}{bar}_{{{about}}}" + (f"^{part[0]}" if part else "")


def extent(nodes: Mapping[str, complex]) -> tuple[complex, complex]:
    """Low and high corner of the nodes."""
    points = np.array(list(nodes.values()))
    return (complex(points.real.min(), points.imag.min()), complex(points.real.max(), points.imag.max()))
