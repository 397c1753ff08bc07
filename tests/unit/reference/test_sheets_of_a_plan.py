"""Sheets of the reference drawing: figures do not overlap, tables are complete, senses are shown."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from reference.authored.assignment import library, load_assignment
from reference.drawing import symbols
from reference.drawing.canvas import Area, Curve, Label, Ring, Stroke, set_pieces, shifted
from reference.drawing.labels import segments_of
from reference.drawing.sheets import (
    CELL_MM,
    FRAME,
    LEAST_GAP_MM,
    figures_of,
    lay_out,
    reference_drawing,
)
from reference.drawing.sketch import support_direction
from reference.drawing.subject import Subject, Wording
from reference.drawing.symbols import bars
from reference.drawing.tables import column, table_rows
from reference.mechanism import SlottedLink
from reference.plan import exact_plan
from tests.drawn import CASES, planned

SAMPLES = 40


def text_of(label):
    return "".join(piece.text for piece in set_pieces(label.text, 1.0))


def labels_of(shapes):
    return [text_of(shape) for shape in shapes if isinstance(shape, Label)]


def labels(sheets):
    return [text for sheet in sheets for text in labels_of(sheet.shapes)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sheets")


def points_of(shapes):
    """Points along every stroke."""
    edges = segments_of(shapes)
    share = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    axes = [edges[:, axis] + share * (edges[:, axis + 2] - edges[:, axis]) for axis in (0, 1)]
    return np.stack(axes, axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("position", range(8))
def test_figures_on_one_sheet_keep_apart(position):
    press = load_assignment("press")
    subject = Subject(press, exact_plan(press, [press.variant(None, position)]))
    figures = list(figures_of(subject).values())
    beside = column(subject, [figure.name for figure in figures], (FRAME[2], FRAME[1]), FRAME[3])
    moves, fits = lay_out(figures, FRAME, beside.box)
    if not fits:
        assert position in {0, 2}, "the acceleration plan is 270 mm wide beside a mechanism of 230 mm"
        return
    clouds = [
        points_of([shifted(shape, by) for shape in figure.shapes])
        for figure, by in zip(figures, moves, strict=True)
    ]
    left, top, right, bottom = FRAME
    for k, cloud in enumerate(clouds):
        assert np.all((cloud >= (left, top)) & (cloud <= (right, bottom)))
        x0, y0, _, y1 = beside.box
        assert not np.any((cloud[:, 0] > x0) & (cloud[:, 1] > y0) & (cloud[:, 1] < y1))
        for other in clouds[k + 1 :]:
            near = min(np.min(np.hypot(*(other - point).T)) for point in cloud[::7])
            assert near >= LEAST_GAP_MM - CELL_MM


@pytest.mark.parametrize("case", CASES)
def test_the_table_has_every_vector_with_its_segment_and_every_rate(case, folder):
    assignment, plan = planned(case, folder)
    subject = Subject(assignment, plan)
    rows = list(table_rows(subject, list(plan.nodes_mm)))[1:]
    names = ["".join(piece.text for piece in set_pieces(row.name, 1.0)) for row in rows]
    wanted = [*plan.construction.vectors, *plan.rates]
    assert sorted(names) == sorted("".join(p.text for p in subject.letter(name)) for name in wanted)
    for vector, row in zip(plan.construction.vectors, rows, strict=False):
        drawn = float(row.drawn)
        assert abs(drawn - abs(plan.drawn_mm(vector)[0])) <= 0.0051
        assert (row.direction == "–") == subject.is_zero(vector)
    turning = {
        name: row.turns for name, row in zip(plan.rates, rows[len(plan.construction.vectors) :], strict=True)
    }
    for name, turns in turning.items():
        if not subject.is_zero(plan.construction.rates[name].vector):
            assert np.sign(turns) == np.sign(plan.rates[name][0])


@pytest.mark.parametrize("case", CASES)
def test_every_node_has_its_letter_and_every_figure_its_scale(case, folder):
    assignment, plan = planned(case, folder)
    subject = Subject(assignment, plan)
    told = [part for text in labels(reference_drawing(assignment, plan)) for part in text.split(", ")]
    for figure, nodes in plan.nodes_mm.items():
        for node in nodes:
            assert "".join(piece.text for piece in subject.letter(node)) in told, node
        assert any(text.startswith(subject.wording.titles[figure]) for text in told)


def test_the_press_is_lettered_in_the_other_tradition_everywhere():
    press = load_assignment("press")
    told = labels(reference_drawing(press, exact_plan(press, [press.variant(None, 1)])))
    assert {"p", "π", "p a", "π a'"} <= set(told)
    assert not [text for text in told if text.split(" ")[0] in {"o", "o'"}]
    assert any("μv = 0.036095 (m/s)/mm" in text for text in told)
    assert not [text for text in told if "kv" in text or "kL" in text]


def test_the_data_of_the_variant_stand_on_the_sheet():
    pump = load_assignment("pump")
    told = " ".join(labels(reference_drawing(pump, exact_plan(pump, [pump.variant(7)]))))
    for datum in ("n = 7", "φ = 44°", "n1 = 370 rev/min", "AB = 40 cm", "CD = 20 cm"):
        assert datum.replace(" cm", "\N{NO-BREAK SPACE}cm").replace(" rev", "\N{NO-BREAK SPACE}rev") in told


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_sign_of_a_sense_turns_that_way(sign):
    bow, head = symbols.sense(0j, sign)
    assert isinstance(bow, Curve)
    assert isinstance(head, Area)
    turns = [complex(x, -y) for x, y in bow.points]
    area = sum((p.conjugate() * q).imag for p, q in itertools.pairwise(turns))
    assert np.sign(area) == sign
    tip = complex(head.points[0][0], -head.points[0][1])
    assert np.sign((turns[-1].conjugate() * tip).imag) == sign


@pytest.mark.parametrize("omega", [10, -10])
def test_the_arrow_at_the_crank_turns_as_the_crank_does(omega, folder):
    case = "slotted link with an offset, crank slowing down clockwise"
    assignment, plan = planned(case, folder)
    crank = replace(plan.mechanism.crank, omega=np.array([float(omega)]))
    turned = replace(plan, mechanism=replace(plan.mechanism, driver=crank))
    bows = [
        part.shape
        for part in figures_of(Subject(assignment, turned))["mechanism"].parts
        if part.node == crank.pin and isinstance(part.shape, Curve)
    ]
    assert len(bows) == 1
    (x0, y0), (x1, y1) = bows[0].points[0], bows[0].points[-1]
    assert np.sign((complex(x0, -y0).conjugate() * complex(x1, -y1)).imag) == np.sign(omega)


@pytest.mark.parametrize("case", ["pump 7", "driving slider"])
def test_a_driving_link_that_stands_still_has_no_arrow(case, folder):
    assignment, plan = planned(case, folder)
    driver = plan.mechanism.driver
    rate = "speed" if case == "driving slider" else "omega"
    still = replace(plan.mechanism, driver=replace(driver, **{rate: np.array([0.0])}))
    moving, stopped = (
        labels_of(figures_of(Subject(assignment, one))["mechanism"].shapes)
        for one in (plan, replace(plan, mechanism=still))
    )
    assert set(moving) - set(stopped) == {"vA" if rate == "speed" else "ω1"}


@pytest.mark.parametrize(("case", "reaches"), [("slider on a moving link", 1), ("two crossed guides", 0)])
def test_a_moving_guide_goes_on_to_the_slider_beyond_its_joints(case, reaches, folder):
    assignment, plan = planned(case, folder)
    subject = Subject(assignment, plan)
    nodes = subject.nodes("mechanism")
    beyond = [bar for bar in bars(subject, nodes) if bar.node in {"D3", "D2"}]
    assert len(beyond) == reaches
    for bar in beyond:
        line = [bar.ends[0], nodes["D3"], bar.ends[1]]
        along = line[2] - line[0]
        assert abs((along.conjugate() * (line[1] - line[0])).imag) <= 1e-9 * abs(along) ** 2
        assert 0.0 < ((line[1] - line[0]) / along).real < 1.0


@pytest.mark.parametrize("name", ["pump", "shaper"])
def test_the_altitude_construction_is_drawn_true_to_the_normal_components(name):
    assignment = load_assignment(name)
    plan = exact_plan(assignment, [assignment.variant(7)])
    subject = Subject(assignment, plan, altitude=True)
    sketch = figures_of(subject)["mechanism"]
    nodes = subject.nodes("mechanism")
    normals = [v for v in plan.construction.vectors.values() if v.part == "n"]
    for vector in normals:
        tips = [
            complex(*part.shape.points[0]).conjugate()
            for part in sketch.parts
            if part.node == vector.head and isinstance(part.shape, Area)
        ]
        drawn = complex(plan.drawn_mm(vector.name)[0])
        assert min(abs(tip - nodes[vector.link[1]] - drawn) for tip in tips) <= 1e-9 * abs(drawn)
    marks = [text_of(part.shape) for part in sketch.parts if isinstance(part.shape, Label)]
    assert sum("IV" in mark for mark in marks) == len(normals)


def test_arrowheads_are_shorter_on_short_vectors():
    long, short = (list(symbols.arrow(0j, complex(length), 0.3, "#000000")) for length in (40.0, 2.0))
    for shapes, length in ((long, 40.0), (short, 2.0)):
        shaft, head = shapes
        assert isinstance(shaft, Stroke)
        assert isinstance(head, Area)
        assert head.points[0] == (length, -0.0)
        assert 0.0 < length - shaft.end[0] < length
    assert short[0].end[0] >= 1.0


def test_the_ground_of_a_pivot_lies_where_no_link_goes():
    at = 3 + 2j
    assert support_direction(at, []) == -1j
    assert support_direction(at, [(at, at + 5j)]) == -1j
    assert support_direction(at, [(at, at - 5j)]) == 1j
    away = support_direction(at, [(at, at - 5j), (at, at + 5j), (at, at + 5.0)])
    assert away == -1.0


def test_a_point_about_which_a_slotted_link_turns_is_drawn_as_a_hinge(folder):
    assignment, plan = planned("slotted link with an offset, crank slowing down clockwise", folder)
    turning = SlottedLink("A3", "A", "C", "5", np.zeros(1), None, 1)
    hinged = replace(plan, mechanism=replace(plan.mechanism, groups=(*plan.mechanism.groups, turning)))
    radii = [
        part.shape.radius
        for one in (plan, hinged)
        for part in figures_of(Subject(assignment, one))["mechanism"].parts
        if part.node == "C" and isinstance(part.shape, Ring)
    ]
    assert radii == [symbols.POINT_RADIUS_MM, symbols.JOINT_RADIUS_MM]


@pytest.mark.parametrize("case", CASES)
def test_blocks_lie_along_their_guides(case, folder):
    assignment, plan = planned(case, folder)
    figure = figures_of(Subject(assignment, plan))["mechanism"]
    sliding = [
        vector for vector in plan.construction.vectors.values()
        if vector.scale == "kv" and vector.link and plan.nodes_mm["mechanism"][vector.link[0]][0]
        == pytest.approx(plan.nodes_mm["mechanism"][vector.link[1]][0], abs=1e-9)
    ]  # fmt: skip
    blocks = [
        shape for shape in figure.shapes
        if isinstance(shape, Area) and len(shape.points) == 4 and shape.width > 0.0
    ]  # fmt: skip
    for vector in sliding:
        drawn = complex(plan.drawn_mm(vector.name)[0])
        sides = [complex(*b.points[0]) - complex(*b.points[1]) for b in blocks]
        assert min(abs((side * drawn).imag) / abs(side) / abs(drawn) for side in sides) < 1e-9, vector.name


def test_words_and_decimal_mark_of_the_drawing_can_be_changed():
    pump = load_assignment("pump")
    wording = Wording(decimal_mark=",", titles={**Wording().titles, "mechanism": "Mecanismul"})
    told = labels(reference_drawing(pump, exact_plan(pump, [pump.variant(7)]), wording=wording))
    assert any(text.startswith("Mecanismul") and "0,005" in text for text in told)
    assert "49,78" in told


def test_a_table_too_long_for_the_sheet_is_told():
    pump = load_assignment("pump")
    subject = Subject(pump, exact_plan(pump, [pump.variant(7)]))
    names = list(subject.plan.nodes_mm)
    assert column(subject, names, (FRAME[2], FRAME[1]), FRAME[3]).fits
    assert not column(subject, names, (FRAME[2], FRAME[1]), FRAME[1] + 60.0).fits


@pytest.mark.parametrize("pages", [True, False])
def test_a_centre_of_mass_is_a_named_dot_to_which_no_bar_leads(tmp_path, pages):
    text = (library() / "pump-forces.assignment.toml").read_text(encoding="utf-8")
    if not pages:
        text = text.replace('"forces"', '"velocity"').replace(
            '"force_plan_D", "force_plan_B"', '"velocity_plan"'
        )
    path = tmp_path / "dots.assignment.toml"
    path.write_text(text.replace('id = "pump-forces"', 'id = "dots"'), encoding="utf-8")
    assignment = load_assignment(path)
    subject = Subject(assignment, exact_plan(assignment, [assignment.variant(7)]))
    nodes = subject.nodes("mechanism")
    assert not any("S3" in bar.joints for bar in bars(subject, nodes))
    shapes = figures_of(subject)["mechanism"].shapes
    assert {"S2", "S3", "S4"} < set(labels_of(shapes))
    assert symbols.marked_point(nodes["S3"]) in shapes
