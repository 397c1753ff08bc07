"""Parts of the cycle's telling: names, strokes, axes, places of labels and marks."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.cycle import Subject, extremes, strokes_of
from grader.cycle.axes import Frame, Labelling, cut, decimals_of, dense, step_of, ticks
from grader.cycle.flags import Across, flags_of
from grader.cycle.marks import REASONS, Mark, marks_of
from grader.cycle.page import NAME_MM, Setting
from grader.cycle.plot import cycle_diagram
from grader.i18n import tongue
from reference.assignment import load_assignment
from reference.canvas import Curve, Label
from reference.cycle import cycle
from reference.mechanism import FixedGuide, Yoke
from reference.refusal import WHAT_IS_IN_LINE

ROUNDING = 1e-12


def subject_of(name, n=None, position=None, samples=361):
    assignment = load_assignment(name)
    return Subject(cycle(assignment.mechanism([assignment.variant(n, position)]), samples))


@pytest.fixture(scope="module")
def press():
    return subject_of("press", position=1)


def test_every_name_of_the_plans_can_be_asked_for(press):
    names = [*press.construction.vectors, *press.construction.rates]
    asked = press.asked(names)
    assert [quantity.name for quantity in asked.quantities] == names
    for quantity in asked.quantities:
        assert np.isfinite(press.values(quantity)).all(), quantity.name


def test_components_make_up_the_length(press):
    for name in ("v_C", "a_BA_n", "a_D"):
        length, x, y = (
            press.values(quantity) for quantity in press.asked([name, f"{name}_x", f"{name}_y"]).quantities
        )
        assert np.hypot(x, y) == pytest.approx(length, rel=ROUNDING, abs=ROUNDING)


def test_normal_and_tangential_parts_make_up_the_relative_acceleration(press):
    parts = press.asked(["a_BA_n_x", "a_BA_t_x", "a_B_x", "a_A_x"]).quantities
    normal, tangential, of_b, of_a = (press.values(quantity) for quantity in parts)
    assert normal + tangential == pytest.approx(of_b - of_a, abs=1e-10)


def test_what_is_asked_twice_is_told_once(press):
    assert len(press.asked(["v_B", "v_B"]).quantities) == 1


def test_dead_points_are_where_the_output_stands_still(press):
    strokes = {stroke.name: stroke for stroke in strokes_of(press)}
    assert set(strokes) == {"2", "D"}
    for stroke in strokes.values():
        assert stroke.dead_points == pytest.approx((0.0, np.pi), abs=1e-9)
        assert stroke.time_ratio == pytest.approx(1.0, abs=1e-9)
    # The rocker's two ends: |O1B| = AB + O1A and AB - O1A, by the law of cosines about O2.
    ground, rocker = np.hypot(1.2, np.sqrt(0.55)), 0.8
    ends = [np.arccos((ground**2 + rocker**2 - far**2) / (2 * ground * rocker)) for far in (1.5, 0.9)]
    assert strokes["2"].travel == pytest.approx(ends[0] - ends[1], abs=1e-9)


def test_an_engine_off_its_guide_returns_quicker():
    """Slider-crank with an offset e: the dead points are where crank and rod are in line."""
    assignment = load_assignment("engine")
    mechanism = assignment.mechanism([assignment.variant(1)])
    (slider, point) = mechanism.groups
    offset = 0.2
    lifted = replace(slider, guide=replace(slider.guide, through_m=np.array([1j * offset])))
    subject = Subject(cycle(replace(mechanism, groups=(lifted, point))))
    (stroke,) = (one for one in strokes_of(subject) if not one.is_angle)
    inner, outer = (np.arcsin(offset / (0.6 + sign * 0.15)) for sign in (-1, 1))
    back = np.pi + inner - outer
    assert stroke.time_ratio == pytest.approx(back / (2 * np.pi - back), abs=1e-9)
    ends = [np.sqrt((0.6 + sign * 0.15) ** 2 - offset**2) for sign in (-1, 1)]
    assert stroke.travel == pytest.approx(ends[1] - ends[0], abs=1e-9)


def test_a_scotch_yoke_goes_and_returns_alike():
    """Of yokes and crossed guides: the pin's height above the pivot, r sin(phi), 2 r from end to end."""
    engine = load_assignment("engine").mechanism([load_assignment("engine").variant(1)])
    upright = FixedGuide(np.zeros(1, complex), np.array([np.pi / 2]))
    yoke = Yoke("B", "A", np.zeros(1), upright)
    subject = Subject(cycle(replace(engine, groups=(yoke,))))
    (stroke,) = strokes_of(subject)
    assert (stroke.name, stroke.is_angle) == ("B", False)
    assert stroke.dead_points == pytest.approx((np.pi / 2, 3 * np.pi / 2), abs=1e-9)
    assert stroke.travel == pytest.approx(0.3, abs=1e-12)
    assert stroke.time_ratio == pytest.approx(1.0, abs=1e-9)


def test_extremes_do_not_hang_on_the_samples():
    """They are found between the samples, from few as from many."""
    coarse, fine = (subject_of("shaper", n=3, samples=samples) for samples in (37, 1441))
    for quantity in fine.asked(["v_E", "a_E", "omega_3", "epsilon_3"]).quantities:
        largest = [extremes(subject, quantity)[1] for subject in (coarse, fine)]
        assert largest[0].value == pytest.approx(largest[1].value, rel=1e-7), quantity.name


def test_a_quantity_without_bound_is_told_at_the_ends_where_it_grows():
    subject = subject_of("pump", n=7)
    speed, crank, component = subject.asked(["v_B", "v_A", "omega_3"]).quantities
    stops = tuple(stop.at for stop in subject.cycle.following.stops)
    assert extremes(subject, speed)[1].value == np.inf
    assert extremes(subject, speed)[1].at == stops
    assert np.isfinite(extremes(subject, crank)[1].value)
    least, largest = extremes(subject, component)
    assert (least.value, largest.value) == (-np.inf, np.inf)
    assert {least.at, largest.at} == {stops[:1], stops[1:]}


def test_every_reason_of_a_flat_position_is_translated():
    assert set(WHAT_IS_IN_LINE.values()) == set(REASONS)
    for lang in ("ro", "ru"):
        assert all(tongue(lang).gettext(reason) != reason for reason in REASONS)


@given(span=st.floats(1e-6, 1e9), most=st.floats(2.0, 20.0))
def test_ticks_are_round_and_no_more_than_wanted(span, most):
    step = step_of(span, most)
    assert span / step <= most * (1 + 1e-9)
    assert span / step > most / 2.51
    digits = step / 10.0 ** np.floor(np.log10(step) + 1e-12)
    assert min(abs(digits - part) for part in (1.0, 2.0, 2.5, 5.0, 10.0)) < 1e-9


def test_ticks_reach_from_end_to_end():
    assert ticks(-0.3, 0.3, 0.1) == pytest.approx([-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3])
    assert [decimals_of(step) for step in (100.0, 1.0, 0.5, 0.25, 0.02)] == [0, 0, 1, 2, 2]


FRAME = Frame((0.0, 0.0, 100.0, 50.0), (0.0, 10.0), (-1.0, 1.0))


def test_a_curve_is_cut_exactly_at_its_frame():
    x = np.linspace(0.0, 10.0, 11)
    first, second = cut(FRAME, x, np.where(x < 5.5, 0.5 * x, 5.0 - 0.5 * x))
    assert np.array(first) == pytest.approx(np.array([(0.0, 25.0), (10.0, 12.5), (20.0, 0.0)]))
    # From 2.5 at x = 5 (above the frame) to 2 at 6 and on: down through 1 at x = 8, to 0 at x = 10.
    assert np.array(second) == pytest.approx(np.array([(80.0, 0.0), (90.0, 12.5), (100.0, 25.0)]))


def test_samples_without_a_value_are_bridged():
    x = np.linspace(0.0, 10.0, 5)
    (piece,) = cut(FRAME, x, np.array([0.1, 0.2, np.nan, 0.4, 0.5]))
    assert [round(place[0]) for place in piece] == [0, 25, 75, 100]


@given(seed=st.integers(0, 1000), curves=st.integers(1, 4))
def test_names_of_curves_stand_in_the_frame_and_not_on_each_other(seed, curves):
    lots = np.random.default_rng(seed)
    x = np.linspace(0.0, 10.0, 200)
    pieces = [
        list(cut(FRAME, x, lots.uniform(0.2, 0.9) * np.sin(lots.uniform(0.3, 1.5) * x + lots.uniform(0, 6))))
        for _ in range(curves)
    ]
    labelling = Labelling(FRAME.box, [dense(one) for one in pieces], np.zeros((0, 2)), [])
    boxes = [labelling.beside(k, Label((0.0, 0.0), f"v{k}", 3.8)).bounds for k in range(curves)]
    for k, (left, top, right, bottom) in enumerate(boxes):
        assert left >= 0.0
        assert top >= 0.0
        assert right <= 100.0
        assert bottom <= 50.0
        for other in boxes[:k]:
            assert right <= other[0] or other[2] <= left or bottom <= other[1] or other[3] <= top
    if curves == 1:
        own = dense(pieces[0])
        left, top, right, bottom = boxes[0]
        under = (own[:, 0] > left) & (own[:, 0] < right) & (own[:, 1] > top) & (own[:, 1] < bottom)
        assert not under.any()


@given(places=st.lists(st.integers(0, 360), min_size=1, max_size=8, unique=True))
def test_texts_of_marks_never_overlap(places):
    marks = [Mark(float(at), f"dead point (B): {at}°", "#000000", 0.2, ()) for at in places]
    flags = flags_of(marks, Across((20.0, 280.0), (0.0, 360.0)))
    assert len(flags) == len(marks)
    for k, flag in enumerate(flags):
        assert flag.start >= 5.0
        assert flag.end <= 289.0
        for other in flags[:k]:
            assert flag.row != other.row or flag.end < other.start or other.end < flag.start


def test_dead_points_at_one_place_are_marked_once(press):
    texts = [mark.text for mark in marks_of(press, tongue("en"))]
    assert texts.count("dead point (link 2, D): 180°") == 1
    assert "this variant: φ = 45°" in texts


@pytest.mark.parametrize("lang", ["en", "ru"])
@pytest.mark.parametrize(
    ("name", "n", "position", "of"),
    [
        ("pump", 7, None, ""),
        ("pump", 30, None, "v_B,v_D_x,omega_2,omega_3,epsilon_3"),
        ("pump-collinear", 3, None, ""),
        ("press", None, 1, ""),
        ("press", None, 0, "B,C,D"),
        ("engine", 24, None, "v_B_x,v_D,a_B_x,a_D_y,omega_2,epsilon_2,D"),
        ("shaper", 3, None, "v_E,v_D,a_E_x,a_E,D"),
    ],
)
def test_names_in_a_diagram_keep_clear_of_curves_and_of_each_other(name, n, position, of, lang):
    assignment = load_assignment(name)
    subject = subject_of(name, n, position)
    setting = Setting(assignment, assignment.variant(n, position), tongue(lang))
    diagram = cycle_diagram(subject, subject.asked(of.split(",") if of else []), setting)
    curves = dense(
        [shape.points for shape in diagram.shapes if isinstance(shape, Curve) and shape.width == 0.5]
    )
    names = [shape.bounds for shape in diagram.shapes if isinstance(shape, Label) and shape.size == NAME_MM]
    texts = [shape.bounds for shape in diagram.shapes if isinstance(shape, Label)]
    assert names
    for left, top, right, bottom in names:
        under = (
            (curves[:, 0] > left) & (curves[:, 0] < right) & (curves[:, 1] > top) & (curves[:, 1] < bottom)
        )
        assert not under.any()
    for k, (left, top, right, bottom) in enumerate(texts):
        assert min(left, top) >= 0.0
        assert right <= diagram.page_mm[0]
        assert bottom <= diagram.page_mm[1]
        for other in texts[:k]:
            assert right <= other[0] or other[2] <= left or bottom <= other[1] or other[3] <= top


def test_of_very_many_samples_some_are_drawn():
    assignment = load_assignment("engine")
    subject = subject_of("engine", n=1, samples=20_001)
    setting = Setting(assignment, assignment.variant(1), tongue("en"))
    diagram = cycle_diagram(subject, subject.asked(["v_B_x"]), setting)
    (curve,) = (shape for shape in diagram.shapes if isinstance(shape, Curve) and shape.width == 0.5)
    assert 1000 < len(curve.points) <= 1600


def test_what_is_smaller_than_its_own_error_is_zero(press):
    """The horizontal slider's velocity has no upright part, and at the dead points none at all."""
    upright, along = (press.values(quantity) for quantity in press.asked(["v_D_y", "v_D_x"]).quantities)
    assert not upright.any()
    assert along[[0, 180, 360]].tolist() == [0.0, 0.0, 0.0]
    assert np.count_nonzero(along) == 358


@pytest.mark.parametrize("samples", [3, 5, 37])
def test_dead_points_do_not_hang_on_the_samples(samples):
    for name, n in (("pump", 7), ("shaper", 3)):
        coarse, fine = (strokes_of(subject_of(name, n=n, samples=count)) for count in (samples, 721))
        assert [stroke.name for stroke in coarse] == [stroke.name for stroke in fine]
        for one, other in zip(coarse, fine, strict=True):
            assert one.dead_points == pytest.approx(other.dead_points, abs=1e-9)
