"""The reference drawing: its lengths measured in the SVG, in millimetres."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.drawing.canvas import A3_MM, INK, Label, svg
from reference.drawing.forces import acting_on
from reference.drawing.sheets import reference_drawing
from reference.drawing.sketch import polygon
from reference.drawing.subject import PLAN_COLOURS, Subject
from reference.plan import exact_plan
from tests.drawn import WITH_FORCES, loaded

COLOURS = {"mechanism": INK, **PLAN_COLOURS}
PRINTED_MM = 0.0015
"""The SVG tells thousandths of a millimetre: two ends, half a unit each in x and y."""
SVG = "{http://www.w3.org/2000/svg}"


def drawing(name, n=None, position=None):
    assignment = load_assignment(name)
    plan = exact_plan(assignment, [assignment.variant(n, position)])
    sheets = reference_drawing(assignment, plan)
    return plan, sheets, ET.fromstring(svg([sheet.shapes for sheet in sheets]))


def segments(root, colour):
    """Ends of strokes of a colour, complex, y up; an arrow's tip completes its stroke."""
    lines = []
    for line in root.iter(f"{SVG}line"):
        if line.get("stroke") == colour:
            x1, y1, x2, y2 = (float(line.get(key)) for key in ("x1", "y1", "x2", "y2"))
            lines.append((complex(x1, -y1), complex(x2, -y2)))
    return lines


def tips(root, colour):
    points = []
    for area in root.iter(f"{SVG}polygon"):
        if area.get("fill") == colour:
            corners = [complex(*map(float, pair.split(","))) for pair in area.get("points").split()]
            points.append(corners[0].conjugate())
    return points


@pytest.mark.parametrize(
    ("name", "n", "position"), [("pump", 7, None), ("press", None, 1), ("engine", 5, None)]
)
def test_every_vector_is_drawn_true_to_its_length_and_direction(name, n, position):
    plan, _, root = drawing(name, n, position)
    for figure in plan.construction.poles:
        colour = COLOURS[figure]
        starts = [start for start, _ in segments(root, colour)]
        drawn = [tip - start for start, tip in zip(starts, tips(root, colour), strict=True)]
        wanted = [plan.drawn_mm(v.name)[0] for v in plan.construction.vectors_of(figure)]
        wanted = [vector for vector in wanted if abs(vector) > 1e-6]
        assert len(wanted) == len(drawn)
        for vector, line in zip(wanted, drawn, strict=True):
            assert abs(line - vector) <= PRINTED_MM


def test_the_links_of_the_mechanism_are_drawn_true_to_scale():
    plan, _, root = drawing("pump", 7)
    lengths = [abs(end - start) for start, end in segments(root, COLOURS["mechanism"])]
    k_length = plan.scales.kL[0]
    for link_m in (0.30, 0.40, 0.20):
        assert min(abs(length - link_m / k_length) for length in lengths) <= PRINTED_MM


def test_the_page_is_a3_and_one_unit_is_one_millimetre():
    _, sheets, root = drawing("pump", 7)
    width, height = A3_MM
    assert root.get("width") == f"{width:g}mm"
    assert root.get("height") == f"{height * len(sheets):g}mm"
    assert root.get("viewBox") == f"0 0 {width:g} {height * len(sheets):g}"


@pytest.mark.parametrize("name", ["pump", "pump-230", "pump-collinear", "press", "engine"])
def test_every_variant_fits_its_sheets_and_stays_inside_the_frame(name):
    assignment = load_assignment(name)
    variants = assignment.variants()
    plan = exact_plan(assignment, variants)
    for index in range(0, len(variants), 5):
        for sheet in reference_drawing(assignment, plan, index):
            assert sheet.fits
            root = ET.fromstring(svg([sheet.shapes]))
            for line in root.iter(f"{SVG}line"):
                for x, y in ((line.get("x1"), line.get("y1")), (line.get("x2"), line.get("y2"))):
                    assert 0 <= float(x) <= A3_MM[0]
                    assert 0 <= float(y) <= A3_MM[1]


def test_a_plan_too_large_for_its_sheet_is_told_in_red():
    pump = load_assignment("pump")
    variants = [pump.variant(7)]
    plan = exact_plan(pump, variants, pump.scales(variants, crank_mm=400.0))
    sheets = reference_drawing(pump, plan)
    assert not all(sheet.fits for sheet in sheets)
    assert "does not fit A3" in svg([sheet.shapes for sheet in sheets])


def test_zero_vectors_are_not_drawn_at_a_dead_point():
    plan, _, root = drawing("press", position=0)
    shown = [v for v in plan.construction.vectors_of("velocity_plan") if abs(plan.drawn_mm(v.name)[0]) > 1e-6]
    assert len(tips(root, COLOURS["velocity_plan"])) == len(shown) < 5
    assert np.isfinite(plan.size_mm("velocity_plan")[0])


# Force plans ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", WITH_FORCES)
def test_every_force_is_drawn_true_with_its_arrowhead_and_its_name(case, tmp_path_factory):
    assignment, plan = loaded(case, tmp_path_factory.mktemp("forces"), own=False)
    subject = Subject(assignment, plan)
    for figure in plan.construction.poles:
        drawn = polygon(subject, figure)
        root = ET.fromstring(svg([drawn.shapes]))
        starts = [start for start, _ in segments(root, COLOURS["force_plan"])]
        arrows = [tip - start for start, tip in zip(starts, tips(root, COLOURS["force_plan"]), strict=True)]
        wanted = [one for one in plan.construction.vectors_of(figure) if not subject.is_zero(one.name)]
        assert len(arrows) == len(wanted)
        for vector, arrow in zip(wanted, arrows, strict=True):
            assert abs(arrow - plan.drawn_mm(vector.name)[0]) <= PRINTED_MM
        names = " ".join(
            "".join(piece.text for piece in one.text)
            for one in drawn.shapes
            if isinstance(one, Label) and one.italic
        )
        for vector in wanted:
            assert "".join(piece.text for piece in subject.letter(vector.name)) in names
            assert not any(mark in names for mark in (vector.tail, vector.head))


@pytest.mark.parametrize("case", WITH_FORCES)
def test_the_forces_on_a_scheme_are_in_balance(case, tmp_path_factory):
    assignment, plan = loaded(case, tmp_path_factory.mktemp("forces"), own=False)
    subject = Subject(assignment, plan)
    at = {joint: place[0] for joint, place in plan.motion.position.items()}
    for figure in plan.construction.poles:
        acting = acting_on(subject, figure)
        total = sum(one.force for one in acting)
        turning = sum(
            one.moment + float(np.imag(np.conj(at[one.at] + one.aside_m) * one.force)) for one in acting
        )
        size = max(abs(one.force) for one in acting)
        assert abs(total) <= 1e-9 * size
        assert abs(turning) <= 1e-9 * size
