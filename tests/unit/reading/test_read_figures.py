"""Drawings whose truth is known, without pixels: are they named rightly, and as wrong as they are?"""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

from grader.reading.altitudes import _drawn
from grader.reading.lines import lines_of
from grader.reading.plans import PlanProblem, best_plan, regular_plans
from grader.reading.read import read_figures
from grader.reading.vectors import CLOSE_MM, INKED, MOST_OPEN, ON_IT_PX, SHORT_MM, figure_of_plan
from grader.records import ACCELERATION_PLAN, HEAD_AHEAD, MECHANISM, VELOCITY_PLAN, InkMap, Reading, Tips
from reference.authored.assignment import Assignment, Variant, built_in, load_assignment
from reference.construction.elements import View
from reference.construction.mistakes import Mistake, commit
from tests.examples import slow
from tests.unit.reading.drawn import PLACES, Drawn, Pen, draw, ink_of, task

SURE = 0.9
NEAR_MM = 0.5
ALONG_MM = 0.7
"""A stroke's end that no other line crosses tells this much."""
SILENTLY_WRONG_MM = 1.0
TOGETHER_MM = 0.05
MEASURABLE_MM = 5.0


def read(
    drawn: Drawn, assignment: Assignment, variant: Variant | None, wanted: tuple[str, ...] = ()
) -> Reading:
    return read_figures([(drawn.ink, drawn.sheet)], assignment, variant, None, wanted)[0]


def vectors_read(reading: Reading) -> dict[str, tuple[complex, float]]:
    """Vectors as complex numbers, and confidences."""
    found = {}
    for figure in reading.figures.values():
        for name, vector in figure.vectors.items():
            length, direction = vector.length_mm or 0.0, math.radians(vector.direction_deg or 0.0)
            found[name] = cmath.rect(length, direction), vector.confidence
    return found


def built_in_variant(n: int) -> Variant:
    """One of the pump's variants."""
    return load_assignment("pump").variant(n)


def right_share(drawn: Drawn, reading: Reading) -> float:
    """Share of the measurable vectors that are read within half a millimetre."""
    found = vectors_read(reading)
    asked = [name for name, vector in drawn.vectors.items() if abs(vector) >= MEASURABLE_MM]
    right = [name for name in asked if name in found and abs(found[name][0] - drawn.vectors[name]) < ALONG_MM]
    return len(right) / len(asked)


def silently_wrong(drawn: Drawn, reading: Reading) -> list[str]:
    """Vectors given with confidence that are not what was drawn."""
    return [
        name
        for name, (vector, sure) in vectors_read(reading).items()
        if sure >= SURE and abs(vector - drawn.vectors.get(name, 0j)) > SILENTLY_WRONG_MM
    ]


@pytest.mark.parametrize("name", [name for name in built_in() if not load_assignment(name).forces])
def test_a_right_drawing_of_any_mechanism_is_read_whole(name):
    assignment, _, _ = task(name)
    variant = assignment.variants()[len(assignment.variants()) // 3]
    _, _, drawing = task(name, variant)
    drawn = draw(drawing)
    reading = read(drawn, assignment, variant)
    assert right_share(drawn, reading) == 1.0
    assert not silently_wrong(drawn, reading)


def test_joints_in_one_place_are_read_as_one():
    assignment, variant, drawing = task("shaper")
    drawn = draw(drawing)
    joints = read(drawn, assignment, variant).figures[MECHANISM].nodes
    assert abs(joints["A"].at - joints["A3"].at) < TOGETHER_MM
    assert abs(joints["A3"].at - drawn.nodes["A"]) < NEAR_MM


def test_joints_are_found_in_their_circles():
    assignment, variant, drawing = task()
    drawn = draw(drawing)
    joints = read(drawn, assignment, variant).figures[MECHANISM].nodes
    assert set(joints) == {"O1", "O2", "A", "B", "C", "D"}
    assert max(abs(joint.at - drawn.nodes[name]) for name, joint in joints.items()) < NEAR_MM


def test_most_of_a_careful_drawing_is_read_with_confidence():
    assignment, variant, drawing = task()
    found = vectors_read(read(draw(drawing, pen=Pen(redraw_mm=0.05)), assignment, variant))
    sure = [name for name, (_, confidence) in found.items() if confidence >= SURE]
    assert len(sure) > 0.6 * len(found)


def test_long_vectors_of_a_careful_drawing_need_no_arrowheads():
    assignment, variant, drawing = task("shaper")
    found = vectors_read(read(draw(drawing, pen=Pen(redraw_mm=0.05)), assignment, variant)).values()
    assert min(confidence for vector, confidence in found if abs(vector) > SHORT_MM) >= SURE


@pytest.mark.parametrize(
    "mistake",
    [
        Mistake("parallel_for_perpendicular", "b"),
        Mistake("sense_reversed", "a"),
        Mistake("image_mirrored", "c"),
        Mistake("normal_reversed", "n_B"),
        Mistake("figure_rotated", ACCELERATION_PLAN, quarters=1),
        Mistake("scale_wrong", "kv", factor=0.7),
        Mistake("scale_wrong", "ka", factor=1.4),
    ],
    ids=lambda mistake: f"{mistake.code} {mistake.at}",
)
def test_a_wrong_drawing_is_read_as_wrong_as_it_is(mistake):
    assignment, variant, drawing = task("pump", Variant(n=9))
    wrong = commit(mistake, drawing)
    drawn = draw(wrong)
    reading = read(drawn, assignment, variant)
    assert right_share(drawn, reading) >= 0.8
    assert not silently_wrong(drawn, reading)


@pytest.mark.parametrize("turn_deg", [-25.0, 25.0])
def test_a_short_vector_in_a_wrong_direction_is_not_drawn_towards_the_right_one(turn_deg):
    assignment, variant, drawing = task("pump", Variant(n=28))
    right = draw(drawing)
    nodes, vector = right.nodes, right.vectors["a_BA_n"]
    wrong = cmath.rect(abs(vector), cmath.phase(vector) + math.radians(turn_deg))
    extra = [(nodes["a'"], nodes["a'"] + wrong), (nodes["a'"] + wrong, nodes["b'"])]
    pen = Pen(left_out=frozenset({"a_BA_n", "a_BA_t"}), extra=extra)
    found, _ = vectors_read(read(draw(drawing, pen=pen), assignment, variant))["a_BA_n"]
    assert abs(vector) < 6.0
    assert abs(found - wrong) < NEAR_MM


def test_two_known_mistakes_in_one_plan_leave_its_vectors_sure_without_letters():
    assignment, variant, drawing = task("pump", Variant(n=9))
    wrong = commit(Mistake("normal_missing", "n_B"), drawing)
    drawn = draw(commit(Mistake("normal_reversed", "n_DC"), wrong), pen=Pen(redraw_mm=0.05))
    reading = read(drawn, assignment, variant)
    found = vectors_read(reading).values()
    assert not silently_wrong(drawn, reading)
    assert sum(confidence >= SURE for _, confidence in found) > 0.7 * len(drawn.vectors)


def test_nodes_near_each_other_are_told_apart_by_letters_alone():
    _, _, drawing = task("pump", Variant(n=28))
    drawn = draw(drawing)
    problem = PlanProblem(lines_of(drawn.ink), ACCELERATION_PLAN, drawn.nodes)
    plan = best_plan(problem, drawing, regular_plans(problem, drawing))
    by_strokes, by_letters = (
        figure_of_plan(replace(plan, told=told), drawn.sheet, drawn.ink.where)[0].vectors
        for told in (1.0, 0.2)
    )
    assert abs(drawn.nodes["a'"] - drawn.nodes["c'"]) < CLOSE_MM
    assert by_letters["a_A"].confidence < by_strokes["a_A"].confidence
    assert by_letters["a_D"].confidence == by_strokes["a_D"].confidence


def test_another_students_variant_is_read_as_drawn():
    assignment, _, drawing = task("pump", Variant(n=20))
    drawn = draw(drawing)
    reading = read(drawn, assignment, Variant(n=12))
    assert right_share(drawn, reading) >= 0.8
    assert not silently_wrong(drawn, reading)


def test_an_unknown_variant_is_read_too():
    assignment, _, drawing = task("press", Variant(position=2))
    drawn = draw(drawing)
    assert right_share(drawn, read(drawn, assignment, None)) == 1.0


def test_a_vector_that_is_not_drawn_is_unread_with_its_reason():
    assignment, variant, drawing = task("pump", Variant(n=9))
    drawn = draw(drawing, pen=Pen(left_out=frozenset({"v_C"})))
    reading = read(drawn, assignment, variant, ("v_B", "v_C"))
    reasons = {one.name: one.reason for one in reading.unread}
    assert "v_C" in reasons or vectors_read(reading)["v_C"][1] < SURE
    assert "v_B" not in reasons


def test_a_vector_of_which_only_a_part_of_its_line_is_drawn_is_unread():
    assignment, variant, drawing = task("pump", Variant(n=9))
    drawn = draw(drawing)
    tail, head = (drawn.nodes[end] for end in ("o", "b"))
    pen = Pen(left_out=frozenset({"v_B"}), extra=[(tail, tail + 0.6 * (head - tail))])
    found = vectors_read(read(draw(drawing, pen=pen), assignment, variant))
    assert "v_B" not in found
    assert found["v_A"][1] > SURE


def test_a_vector_under_the_line_of_another_may_be_drawn_or_not():
    """Without a normal component the whole relative acceleration lies along the tangential one."""
    assignment, variant, drawing = task("press", Variant(position=6))
    drawn = draw(drawing)
    inked = replace(drawn.ink, where=InkMap(np.full((297, 420), 255, np.uint8), 1.0))
    found = vectors_read(read(replace(drawn, ink=inked), assignment, variant))
    assert abs(found["a_DC"][0] - found["a_DC_t"][0]) < NEAR_MM
    assert found["a_DC"][1] <= MOST_OPEN


def test_the_sides_of_a_similar_triangle_are_not_read_as_tangential_components():
    assignment, variant, drawing = task("pump", Variant(n=22))
    nodes = draw(drawing).nodes
    sides = [(nodes[start], nodes["c'"]) for start in ("a'", "b'")]
    left_out = frozenset({"a_CA_n", "a_CA_t", "a_CB_n", "a_CB_t"})
    reading = read(draw(drawing, pen=Pen(left_out=left_out, extra=sides)), assignment, variant)
    reasons = {one.name: one.reason.code for one in reading.unread}
    assert {name: reasons.get(name) for name in left_out} == dict.fromkeys(left_out, "by_similarity")


def test_a_line_that_leaves_a_vector_by_a_degree_is_not_its_stroke():
    ink = np.zeros((60, 480), np.uint8)
    ink[29:32, 30:390] = 255
    where = InkMap(ink, px_per_mm=6.0)
    start, on_it, beside = 5.0 - 5.0j, 65.0 - 5.1j, 65.0 - 5.8j
    assert where.share_inked(start, on_it, ON_IT_PX) > INKED
    assert where.share_inked(start, beside) > INKED > where.share_inked(start, beside, ON_IT_PX)


def test_sketch_and_plans_on_different_sheets_are_read_together():
    assignment, variant, drawing = task()
    first = draw(drawing, {name: PLACES[name] for name in (MECHANISM, VELOCITY_PLAN)})
    second = draw(drawing, {ACCELERATION_PLAN: PLACES[ACCELERATION_PLAN]})
    drawn = [(page.ink, page.sheet) for page in (first, second)]
    readings = read_figures(drawn, assignment, variant, None, ())
    assert set(readings[0].figures) == {MECHANISM, VELOCITY_PLAN}
    assert set(readings[1].figures) == {ACCELERATION_PLAN}
    assert right_share(second, readings[1]) == 1.0


def test_an_empty_sheet_leaves_everything_unread_with_a_reason():
    assignment, variant, drawing = task()
    empty = draw(drawing, {})
    wanted = tuple(drawing.construction.vectors)
    reading = read(empty, assignment, variant, wanted)
    assert not reading.figures
    assert [one.name for one in reading.unread] == list(wanted)
    assert all(one.reason for one in reading.unread)


@pytest.mark.parametrize("seed", [0, *slow(1, 2)])
def test_lines_by_chance_are_read_as_nothing_sure(seed):
    assignment, variant, drawing = task()
    rng = np.random.default_rng(seed)
    starts = rng.uniform(30, 390, 60) - 1j * rng.uniform(20, 280, 60)
    lines = [(start, start + cmath.rect(rng.uniform(3, 60), rng.uniform(0, 6.3))) for start in starts]
    drawn = draw(drawing, {})
    chance = Drawn(ink_of(lines), drawn.sheet, {}, {})
    found = vectors_read(read(chance, assignment, variant))
    assert not [name for name, (_, sure) in found.items() if sure >= SURE]


def test_only_velocities_are_looked_for_where_only_they_are_wanted():
    assignment, variant, drawing = task()
    reading = read(draw(drawing), assignment, variant, ("v_B", "v_D"))
    assert ACCELERATION_PLAN not in reading.figures
    assert VELOCITY_PLAN in reading.figures


def test_every_vector_asked_for_is_read_or_unread():
    assignment, variant, drawing = task("press")
    wanted = (*drawing.construction.vectors, "v_X")
    reading = read(draw(drawing), assignment, variant, wanted)
    told = {*vectors_read(reading), *(one.name for one in reading.unread)}
    assert set(wanted) <= told


def test_a_full_relative_acceleration_is_read_where_it_is_drawn_and_else_missed_only_if_asked_for():
    assignment, variant, drawing = task("press")
    sums = {name for name, vector in drawing.construction.vectors.items() if vector.is_sum}
    drawn = draw(drawing, pen=Pen(sums=True))
    found = vectors_read(read(drawn, assignment, variant))
    assert sums == {"a_BA", "a_DC"}
    assert {name for name in found if abs(found[name][0] - drawn.vectors[name]) < ALONG_MM} >= sums
    plain = draw(drawing)
    assert not sums & vectors_read(read(plain, assignment, variant)).keys()
    asked = read(plain, assignment, variant, ("a_B", "a_BA"))
    assert [(one.name, one.reason.code) for one in asked.unread] == [("a_BA", "blank")]


def test_the_strokes_of_full_relative_accelerations_are_not_taken_for_others():
    assignment, _, _ = task()
    lost = []
    for variant in assignment.variants()[::6]:
        _, _, drawing = task("pump", variant)
        drawn = draw(drawing, pen=Pen(redraw_mm=0.15, seed=2, sums=True))
        found = vectors_read(read(drawn, assignment, variant))
        asked = [name for name, vector in drawn.vectors.items() if abs(vector) >= MEASURABLE_MM]
        lost += [
            name
            for name in asked
            if name not in found or abs(found[name][0] - drawn.vectors[name]) > ALONG_MM
        ]
    assert len(lost) <= 2, lost


def test_the_position_is_complex_with_y_up():
    assignment, variant, drawing = task()
    drawn = draw(drawing)
    pole = read(drawn, assignment, variant).figures[VELOCITY_PLAN].nodes["o"]
    assert abs(pole.at - PLACES[VELOCITY_PLAN]) < NEAR_MM
    assert pole.cov.shape == (2, 2)


def test_a_sheet_of_unsure_scale_gives_no_confidence_in_long_vectors():
    assignment, variant, drawing = task()
    drawn = draw(drawing)
    vague = Drawn(drawn.ink, replace(drawn.sheet, scale_se=0.02), drawn.nodes, drawn.vectors)
    assert vectors_read(read(vague, assignment, variant))["v_A"][1] < SURE


def test_a_vector_is_no_surer_than_the_scale_allows_half_a_millimetre_of_its_length():
    assignment, variant, drawing = task()
    drawn, scale_se = draw(drawing), 0.008
    vague = Drawn(drawn.ink, replace(drawn.sheet, scale_se=scale_se), drawn.nodes, drawn.vectors)
    found = read(vague, assignment, variant).figures[VELOCITY_PLAN].vectors.values()
    allowed = [math.erf(NEAR_MM / (scale_se * one.length_mm * math.sqrt(2.0))) for one in found]
    assert min(allowed) < SURE
    assert all(one.confidence <= most for one, most in zip(found, allowed, strict=True))


def test_where_a_node_was_drawn_twice_the_other_place_is_told_with_what_it_adds():
    assignment, variant, drawing = task()
    once = draw(drawing)
    away = 1.5j * once.vectors["v_DC"] / abs(once.vectors["v_DC"])
    again = [(once.nodes[end], once.nodes["d"] + away) for end in ("o", "c")]
    found = read(draw(drawing, pen=Pen(extra=again)), assignment, variant).figures[VELOCITY_PLAN]
    drawn_mm = sorted(abs(head - once.nodes["o"]) for head in (once.nodes["d"], once.nodes["d"] + away))
    vector = found.vectors["v_D"]
    told_mm = sorted([vector.length_mm, vector.others[0].length_mm])
    assert np.allclose(told_mm, drawn_mm, atol=ALONG_MM)
    sure = [vector.confidence, *(other.confidence for other in vector.others)]
    assert sure == sorted(sure)
    assert sure[1] > sure[0] + 0.05


@pytest.mark.parametrize("redraw_mm", [0.05, 0.4])
def test_a_node_is_no_surer_than_the_surest_vector_that_ends_there(redraw_mm):
    assignment, variant, drawing = task("pump", Variant(n=9))
    reading = read(draw(drawing, pen=Pen(redraw_mm=redraw_mm)), assignment, variant)
    construction = drawing.construction
    for figure in (VELOCITY_PLAN, ACCELERATION_PLAN):
        found = reading.figures[figure]
        for name, node in found.nodes.items():
            touching = [
                found.vectors[vector.name].confidence
                for vector in construction.vectors_of(figure)
                if name in {vector.tail, vector.head} and vector.name in found.vectors
            ]
            assert node.confidence <= max(touching, default=0.0)


@pytest.mark.parametrize(
    "mistake",
    [Mistake("normal_missing", "k_A3A"), Mistake("normal_reversed", "k_A3A"), Mistake("sense_reversed", "a")],
    ids=lambda one: f"{one.code} at {one.at}",
)
def test_a_wrong_drawing_of_a_slotted_link_is_read_as_wrong_as_it_is(mistake):
    assignment, variant, drawing = task("shaper")
    drawn = draw(commit(mistake, drawing))
    reading = read(drawn, assignment, variant)
    assert right_share(drawn, reading) >= 0.8
    assert not silently_wrong(drawn, reading)


# What is added to the sketch ----------------------------------------------------------------------

ADDED = ("v_A_sketch", "a_D_sketch", "J4")


def with_additions(mistake: str = "") -> tuple[dict[str, tuple[complex, float]], dict[str, complex]]:
    """Vectors at joints, and a pole with lines from its joints: as read, and as drawn."""
    assignment, variant, drawing = task("pump", built_in_variant(4))
    plain = draw(drawing)
    step = drawing.construction.centres["J4"]
    nodes = {name: np.asarray(at) for name, at in plain.nodes.items()}
    pole = complex(replace(step, mirrored=mistake == "mirrored").place(View(nodes, {})))
    sense = -1.0 if mistake == "reversed" else 1.0
    along = [plain.vectors["v_A"], sense * plain.vectors["a_D"]]
    starts = [plain.nodes["A"], plain.nodes["D"]]
    arrows = [(start, start + vector) for start, vector in zip(starts, along, strict=True)]
    rays = [(plain.nodes[joint], pole) for joint in step.base]
    drawn = draw(drawing, pen=Pen(extra=[*arrows, *rays]))
    heads = np.full(2, HEAD_AHEAD)
    tips = Tips(np.arange(2), np.abs(along) + 0.25, heads, np.full(2, 0.95))
    ink = replace(drawn.ink, tips=tips)
    wanted = (*drawn.vectors, *ADDED)
    found = vectors_read(read_figures([(ink, drawn.sheet)], assignment, variant, None, wanted)[0])
    return found, dict(zip(ADDED, (*along, pole - plain.nodes["O1"]), strict=True))


@pytest.mark.parametrize("mistake", ["", "reversed", "mirrored"])
def test_what_is_added_to_the_sketch_is_read_as_it_was_drawn(mistake):
    found, truth = with_additions(mistake)
    assert [name for name, at in truth.items() if abs(found[name][0] - at) >= SILENTLY_WRONG_MM] == []


def test_nothing_is_read_where_nothing_was_added_and_nothing_else_changes():
    assignment, variant, drawing = task("pump", built_in_variant(4))
    drawn = draw(drawing)
    names = tuple(drawn.vectors)
    plain, asked = (read(drawn, assignment, variant, wanted) for wanted in (names, (*names, *ADDED)))
    assert vectors_read(plain) == vectors_read(asked)
    assert plain.unread == asked.unread


# Right triangles on the sketch --------------------------------------------------------------------


def sides_of_triangle(drawn: Drawn, *, velocity: float = 1.0, square_deg: float = 0.0):
    """The sides of the triangle of a_DC_n, its velocity so many times too long, its right angle off."""
    pin, joint = drawn.nodes["C"], drawn.nodes["D"]
    link, laid = joint - pin, velocity * abs(drawn.vectors["v_DC"])
    tip = joint + 1j * laid * link / abs(link)
    across = 1j * (tip - pin) * cmath.rect(1.0, math.radians(square_deg))
    foot = joint + link * (across.conjugate() * (tip - joint)).imag / (across.conjugate() * link).imag
    return [(joint, tip), (pin, tip), (tip, foot)], laid, abs(foot - joint)


def altitudes_read(sides: list[tuple[complex, complex]]) -> dict[str, tuple[float, float]]:
    """Velocities and feet as read where these sides are drawn on the sketch."""
    assignment, variant, drawing = task("pump", built_in_variant(4))
    drawn = draw(drawing, pen=Pen(extra=sides))
    at = np.concatenate([np.linspace(*side, 2000) for side in sides])
    ink = np.zeros((6 * 297, 6 * 420), dtype=np.uint8)
    ink[np.rint(-6.0 * at.imag).astype(int), np.rint(6.0 * at.real).astype(int)] = 255
    inked = replace(drawn, ink=replace(drawn.ink, where=InkMap(ink, 6.0)))
    found = read(inked, assignment, variant).altitudes
    return {name: (one.velocity_mm, one.foot_mm) for name, one in found.items()}


@pytest.mark.parametrize("velocity", [1.0, 0.8])
@pytest.mark.parametrize("square_deg", [0.0, 1.5])
def test_a_right_triangle_on_the_sketch_is_read_as_it_was_drawn(velocity, square_deg):
    plain = draw(task("pump", built_in_variant(4))[2])
    sides, laid, foot = sides_of_triangle(plain, velocity=velocity, square_deg=square_deg)
    assert altitudes_read(sides) == {"a_DC_n": pytest.approx((laid, foot), abs=0.6)}


@pytest.mark.parametrize("left_out", [0, 1, 2])
def test_two_sides_are_no_triangle(left_out):
    sides, _, _ = sides_of_triangle(draw(task("pump", built_in_variant(4))[2]))
    assert not altitudes_read([side for index, side in enumerate(sides) if index != left_out])


def test_a_link_of_which_an_end_was_not_read_has_no_triangle():
    ink = draw(task("pump", built_in_variant(4))[2]).ink
    with np.errstate(all="raise"):
        assert not [*_drawn(lines_of(ink), ink.where, complex("nan+nanj"), 0j)]


def test_sides_at_another_angle_than_a_right_one_are_no_triangle():
    plain = draw(task("pump", built_in_variant(4))[2])
    assert not altitudes_read(sides_of_triangle(plain, square_deg=8.0)[0])


def test_a_sheet_that_may_lie_turned_leaves_the_directions_of_its_vectors_open_by_as_much():
    assignment, _, drawing = task("pump", built_in_variant(7))
    drawn = draw(drawing, PLACES)
    turned = replace(drawn, sheet=replace(drawn.sheet, turn_se_rad=math.radians(1.0)))
    for before, after in zip(
        *(
            read(one, assignment, built_in_variant(7)).figures[VELOCITY_PLAN].vectors.values()
            for one in (drawn, turned)
        ),
        strict=True,
    ):
        assert after.se_deg == pytest.approx(math.hypot(before.se_deg, 1.0), rel=0.01)
        assert after.se_mm == pytest.approx(before.se_mm)
        assert after.confidence <= before.confidence
