"""The page's scale by what is drawn on it: lengths off by one factor move the page, one alone does not."""

from dataclasses import replace

import numpy as np
import pytest

from grader import pipeline
from grader.reading.page_scale import (
    BY_PLANS,
    UPRIGHT_UNSURE,
    at_drawn_scales,
    drawn_tilt,
    is_drawn_otherwise,
    is_upside_down,
    no_surer_than_turn,
)
from grader.reading.sketch import drawings
from grader.records import (
    ACCELERATION_PLAN,
    MECHANISM,
    NO_TIPS,
    VELOCITY_PLAN,
    Figure,
    Ink,
    InkMap,
    OtherReading,
    PageRef,
    Reading,
    ReadNode,
    ReadVector,
    Reason,
    ScannedPage,
    Sheet,
    Strokes,
)
from reference.authored.assignment import load_assignment
from reference.construction.graph import evaluate

ALL = ("kL", "kv", "ka")
PUMP = load_assignment("pump")
(RIGHT,) = drawings(PUMP, [PUMP.variant(7)], None)
NO_STROKES = Strokes(
    np.array([[[100.0, 50.0], [120.0, 50.0]]]), *(np.full(shape, 0.3) for shape in (1, 1, 1, (1, 2), 1))
)


def page(scale_se: float, *problems: Reason) -> ScannedPage:
    ink = Ink(
        NO_STROKES, np.zeros((0, 3)), np.zeros((0, 4)), InkMap(np.zeros((9, 9), np.uint8), 6.0), tips=NO_TIPS
    )
    sheet = Sheet(
        np.diag([12.0, 12.0, 1.0]), (420.0, 297.0), "combined", 12.0, 0.0, 0.1, scale_se, (10, 10, 400, 277)
    )
    return ScannedPage(PageRef("a.png"), sheet=sheet, ink=ink, problems=problems)


def drawn(
    links: float = 1.0, velocities: float = 1.0, accelerations: float = 1.0, turn: complex = 1.0
) -> Reading:
    """The right drawing with the lengths of each figure so many times longer, turned."""
    exact = {
        name: complex(np.ravel(at)[0]) for name, at in evaluate(RIGHT.construction, RIGHT.parameters).items()
    }
    factors = {MECHANISM: links, VELOCITY_PLAN: velocities, ACCELERATION_PLAN: accelerations}
    figures = {}
    for figure, factor in factors.items():
        nodes = {
            name: ReadNode(turn * factor * at, np.eye(2) * 0.01, 0.99)
            for name, at in exact.items()
            if RIGHT.construction.figure_of(name) == figure
        }
        vectors = {}
        for vector in RIGHT.construction.vectors_of(figure) if figure != MECHANISM else ():
            span = nodes[vector.head].at - nodes[vector.tail].at
            vectors[vector.name] = ReadVector(abs(span), 0.1, float(np.degrees(np.angle(span))), 0.1, 0.95)
        figures[figure] = Figure(nodes, vectors)
    return Reading(figures)


def answered(reading: Reading, one: ScannedPage, declared=ALL) -> ScannedPage:
    return at_drawn_scales([one], [reading], RIGHT, declared)[0]


@pytest.mark.parametrize("longer", [0.97, 0.99, 1.02, 1.04])
def test_lengths_that_are_all_off_by_one_factor_correct_a_page_of_doubtful_scale(longer):
    before = page(0.02)
    after = answered(drawn(longer, longer, longer), before)
    assert after.sheet.px_per_mm / before.sheet.px_per_mm == pytest.approx(longer, abs=0.003)
    assert abs(np.log(after.sheet.px_per_mm / 12.0 / longer)) < 3.0 * after.sheet.scale_se < 0.03
    assert [problem.code for problem in after.problems] == ["scale_by_drawing"]
    assert after.ink.strokes.ends == pytest.approx(before.ink.strokes.ends * 12.0 / after.sheet.px_per_mm)


def test_the_same_on_a_surely_registered_page_is_a_doubt_and_no_correction():
    after = answered(drawn(1.02, 1.02, 1.02), page(0.001))
    assert after.sheet.px_per_mm == 12.0
    assert after.sheet.scale_se > 0.003
    assert [problem.code for problem in after.problems] == ["scale_doubtful"]


def test_one_length_alone_makes_no_sure_page_doubtful():
    sure = page(0.001)
    assert answered(drawn(velocities=1.02), sure, ["kv"]) is sure


@pytest.mark.parametrize(
    "mistake",
    [{"links": 1.02}, {"links": 1.25}, {"velocities": 0.98}, {"velocities": 1.047, "accelerations": 1.096}],
    ids=["another kL", "another kL by far", "v_A alone", "another omega"],
)
@pytest.mark.parametrize("scale_se", [0.001, 0.02])
def test_a_students_own_mistake_moves_no_page(mistake, scale_se):
    after = answered(drawn(**mistake), page(scale_se))
    assert abs(np.log(after.sheet.px_per_mm / 12.0)) < 2.0 * after.sheet.scale_se
    assert abs(np.log(after.sheet.px_per_mm / 12.0)) < 0.015


def test_a_right_drawing_makes_a_doubtful_scale_sure_and_leaves_a_sure_one_alone():
    assert answered(drawn(), page(0.02)).sheet.scale_se < 0.005
    sure = page(0.001)
    assert answered(drawn(), sure) is sure


def test_lengths_at_scales_that_nobody_declared_tell_nothing():
    doubtful = page(0.02)
    assert answered(drawn(1.03, 1.03, 1.03), doubtful, ()) is doubtful


def test_a_page_of_unknown_scale_is_refused_unless_its_drawing_tells_it():
    unknown = page(0.03, Reason("scale_unknown", {"detail": "no frame was found"}))
    assert answered(drawn(1.03, 1.03, 1.03), unknown).sheet.px_per_mm == pytest.approx(12.36, abs=0.04)
    for refused in (
        answered(Reading({}), unknown),
        answered(drawn(), unknown, ()),
        answered(drawn(), unknown, ["kv"]),
    ):
        assert refused.sheet is None
        assert refused.ink is None
        assert [problem.code for problem in refused.problems] == ["sheet_refused"]


def sheet_of_forces(longer: float, corner_mm: float) -> ScannedPage:
    """A page of unknown scale with a right sketch, its forces so many times longer, F_iD's corner moved."""
    assignment = load_assignment("pump-forces")
    (right,) = drawings(assignment, [assignment.variant(3)], None)
    exact = {
        name: complex(np.ravel(at)[0]) for name, at in evaluate(right.construction, right.parameters).items()
    }
    joints = {
        step.node: ReadNode(exact[step.node], np.eye(2) * 0.01, 0.99)
        for step in right.construction.figures[MECHANISM]
    }
    moved = {"F_iD": corner_mm, "F_D": -corner_mm}
    vectors = {
        vector.name: ReadVector(
            longer * abs(exact[vector.head] - exact[vector.tail]) + moved.get(vector.name, 0.0),
            1.2,
            0.0,
            1.0,
            0.5,
        )
        for vector in right.construction.vectors.values()
        if vector.scale == "kF"
    }
    reading = Reading({MECHANISM: Figure(joints, {}), "force_plan_D": Figure({}, vectors)})
    unknown = page(0.03, Reason("scale_unknown", {"detail": "no frame was found"}))
    return at_drawn_scales([unknown], [reading], right, ["kL", "kF"])[0]


def test_an_unmarked_corner_between_forces_in_one_line_hides_no_scale():
    after = sheet_of_forces(1.0, 2.5)
    assert after.sheet is not None
    assert after.sheet.px_per_mm == pytest.approx(12.0, abs=0.06)
    assert sheet_of_forces(1.06, 0.0).sheet is None


def test_two_figures_turned_by_half_say_that_the_page_lies_upside_down():
    assert is_upside_down(drawn(turn=-1.0), RIGHT)
    assert not is_upside_down(drawn(), RIGHT)
    alone = drawn()
    turned = {**alone.figures, VELOCITY_PLAN: drawn(turn=-1.0).figures[VELOCITY_PLAN]}
    assert not is_upside_down(replace(alone, figures=turned), RIGHT)


def test_what_is_read_on_a_page_that_its_plans_alone_turned_is_not_asserted():
    unsure = page(0.001, Reason(UPRIGHT_UNSURE))
    turned = replace(unsure, ref=replace(unsure.ref, turn_deg=180))
    for sure in (unsure, replace(turned, problems=())):
        assert no_surer_than_turn(reading := drawn(), sure) is reading
    plan = drawn().figures[VELOCITY_PLAN]
    # Another reading and those before it are likely together, and no surer either.
    several = {
        name: replace(one, others=(OtherReading(one.length_mm, 0.0, 0.98),))
        for name, one in plan.vectors.items()
    }
    read = replace(drawn(), figures={**drawn().figures, VELOCITY_PLAN: replace(plan, vectors=several)})
    for figure in no_surer_than_turn(read, turned).figures.values():
        others = [other for one in figure.vectors.values() for other in one.others]
        of_all = (*figure.nodes.values(), *figure.vectors.values(), *others)
        assert {one.confidence for one in of_all} == {BY_PLANS}


def test_only_a_sketch_with_a_link_in_another_direction_looks_like_another_variants():
    assert not is_drawn_otherwise(drawn(), RIGHT)
    assert not is_drawn_otherwise(drawn(turn=1j, links=1.3), RIGHT)
    assert not is_drawn_otherwise(Reading({}), RIGHT)
    (other,) = drawings(PUMP, [PUMP.variant(12)], None)
    assert is_drawn_otherwise(drawn(), other)


# The turn of a page without a frame --------------------------------------------------------------


def frameless(se_deg: float = 1.0) -> ScannedPage:
    one = page(0.0015)
    return replace(one, sheet=replace(one.sheet, rotation_deg=180.5, turn_se_rad=np.radians(se_deg)))


@pytest.mark.parametrize("turn_deg", [-1.8, 0.0, 1.2])
def test_a_drawing_that_is_turned_as_a_whole_shows_how_its_sheet_lies(turn_deg):
    tilt, se = drawn_tilt(frameless(), drawn(turn=np.exp(1j * np.radians(turn_deg))), RIGHT)
    assert np.degrees(tilt) == pytest.approx(0.5 - turn_deg, abs=0.2)
    assert 0.1 < np.degrees(se) < 0.3


def test_a_few_lines_drawn_in_wrong_directions_do_not_tilt_the_sheet():
    right, turned = drawn(), drawn(turn=np.exp(1j * np.radians(6.0)))
    nodes = {**right.figures[VELOCITY_PLAN].nodes, "b": turned.figures[VELOCITY_PLAN].nodes["b"]}
    figures = {**right.figures, VELOCITY_PLAN: replace(right.figures[VELOCITY_PLAN], nodes=nodes)}
    assert np.degrees(drawn_tilt(frameless(), Reading(figures), RIGHT)[0]) == pytest.approx(0.5, abs=0.3)


def test_a_page_whose_frame_shows_its_turn_is_not_turned_by_its_drawing():
    reading = drawn(turn=np.exp(1j * np.radians(1.0)))
    assert drawn_tilt(frameless(0.1), reading, RIGHT) is None
    assert drawn_tilt(frameless(), reading, None) is None
    before = frameless()
    known = replace(before, ref=replace(before.ref, tilt_rad=(0.0, 0.003)))
    assert drawn_tilt(known, reading, RIGHT) is None


def test_an_empty_page_is_as_level_as_it_was_and_no_surer():
    tilt, se = drawn_tilt(frameless(), Reading({}), RIGHT)
    assert np.degrees(tilt) == pytest.approx(0.5, abs=0.05)
    assert np.degrees(se) > 0.9


def test_a_sheet_that_is_turned_as_its_drawing_lies_stays_the_way_up_that_it_was_read(monkeypatch):
    opened = []
    monkeypatch.setattr(pipeline, "open_page", lambda ref: opened.append(ref) or frameless())
    pipeline._level([frameless()], [drawn()], RIGHT)
    assert [one.turn_deg for one in opened] == [180]
