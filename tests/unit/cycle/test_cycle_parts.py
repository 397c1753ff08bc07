"""Parts of the cycle's telling: names, strokes, axes, places of labels and marks."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from grader.cycle.diagram import STYLE, Setting, cycle_figure, marks_of, mathtext
from grader.cycle.quantities import CycleSubject, extremes, strokes_of
from grader.language import tongue
from reference.authored.assignment import load_assignment
from reference.kinematics.cycle import cycle
from reference.kinematics.motion import WHAT_IS_IN_LINE
from reference.mechanism import FixedGuide, Yoke
from tests.examples import slow

ROUNDING = 1e-12


def subject_of(name, n=None, position=None, samples=361):
    assignment = load_assignment(name)
    return CycleSubject(cycle(assignment.mechanism([assignment.variant(n, position)]), samples))


def figure_of(name, n, position, of, lang, speed=None):
    """The diagram of a variant, and its subject; at a crank speed that gives about the largest value."""
    assignment = load_assignment(name)
    variant = assignment.variant(n, position)
    mechanism = assignment.mechanism([variant])
    if speed is not None:
        factor = speed / (0.15 * mechanism.crank.omega[0])
        mechanism = replace(mechanism, driver=replace(mechanism.driver, omega=factor * mechanism.crank.omega))
    subject = CycleSubject(cycle(mechanism))
    with rc_context(STYLE):
        setting = Setting(assignment, variant, tongue(lang))
        return cycle_figure(subject, subject.select(of.split(",") if of else []), setting), subject


@pytest.fixture(scope="module")
def press():
    return subject_of("press", position=1)


def test_every_name_of_the_plans_can_be_asked_for(press):
    names = [*press.construction.vectors, *press.construction.rates]
    selection = press.select(names)
    assert [quantity.name for quantity in selection.quantities] == names
    for quantity in selection.quantities:
        assert np.isfinite(press.values(quantity)).all(), quantity.name


def test_components_make_up_the_length(press):
    for name in ("v_C", "a_BA_n", "a_D"):
        length, x, y = (
            press.values(quantity) for quantity in press.select([name, f"{name}_x", f"{name}_y"]).quantities
        )
        assert np.hypot(x, y) == pytest.approx(length, rel=ROUNDING, abs=ROUNDING)


def test_normal_and_tangential_parts_make_up_the_relative_acceleration(press):
    parts = press.select(["a_BA_n_x", "a_BA_t_x", "a_B_x", "a_A_x"]).quantities
    normal, tangential, of_b, of_a = (press.values(quantity) for quantity in parts)
    assert normal + tangential == pytest.approx(of_b - of_a, abs=1e-10)


def test_what_is_asked_twice_is_told_once(press):
    assert len(press.select(["v_B", "v_B"]).quantities) == 1


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
    subject = CycleSubject(cycle(replace(mechanism, groups=(lifted, point))))
    (stroke,) = (one for one in strokes_of(subject) if not one.is_angle)
    inner, outer = (np.arcsin(offset / (0.6 + sign * 0.15)) for sign in (-1, 1))
    back = np.pi + inner - outer
    assert stroke.time_ratio == pytest.approx(back / (2 * np.pi - back), abs=1e-9)
    ends = [np.sqrt((0.6 + sign * 0.15) ** 2 - offset**2) for sign in (-1, 1)]
    assert stroke.travel == pytest.approx(ends[1] - ends[0], abs=1e-9)


def test_a_scotch_yoke_goes_and_returns_alike():
    """Yokes and crossed guides: the pin's height above the pivot is r sin(phi), 2 r from end to end."""
    engine = load_assignment("engine").mechanism([load_assignment("engine").variant(1)])
    upright = FixedGuide(np.zeros(1, complex), np.array([np.pi / 2]))
    yoke = Yoke("B", "A", np.zeros(1), upright)
    subject = CycleSubject(cycle(replace(engine, groups=(yoke,))))
    (stroke,) = strokes_of(subject)
    assert (stroke.name, stroke.is_angle) == ("B", False)
    assert stroke.dead_points == pytest.approx((np.pi / 2, 3 * np.pi / 2), abs=1e-9)
    assert stroke.travel == pytest.approx(0.3, abs=1e-12)
    assert stroke.time_ratio == pytest.approx(1.0, abs=1e-9)


def test_extremes_do_not_hang_on_the_samples():
    """They are found between the samples, from few as from many."""
    coarse, fine = (subject_of("shaper", n=3, samples=samples) for samples in (37, 1441))
    for quantity in fine.select(["v_E", "a_E", "omega_3", "epsilon_3"]).quantities:
        largest = [extremes(subject, quantity)[1] for subject in (coarse, fine)]
        assert largest[0].value == pytest.approx(largest[1].value, rel=1e-7), quantity.name


def test_a_quantity_without_bound_is_told_at_the_ends_where_it_grows():
    subject = subject_of("pump", n=7)
    speed, crank, component = subject.select(["v_B", "v_A", "omega_3"]).quantities
    stops = tuple(stop.at for stop in subject.cycle.following.stops)
    assert extremes(subject, speed)[1].value == np.inf
    assert extremes(subject, speed)[1].at == stops
    assert np.isfinite(extremes(subject, crank)[1].value)
    least, largest = extremes(subject, component)
    assert (least.value, largest.value) == (-np.inf, np.inf)
    assert {least.at, largest.at} == {stops[:1], stops[1:]}


def test_every_reason_of_a_flat_position_is_translated():
    for lang in ("ro", "ru"):
        assert all(tongue(lang).gettext(reason) != reason for reason in WHAT_IS_IN_LINE.values())


def test_dead_points_at_one_place_are_marked_once(press):
    texts = [mark.text for mark in marks_of(press, tongue("en"))]
    assert texts.count("dead point (link 2, D): 180°") == 1
    assert "this variant: φ = 45°" in texts


@pytest.mark.parametrize("lang", ["ru", *slow("en")])
@pytest.mark.parametrize(
    ("name", "n", "position", "of"),
    [
        ("pump", 7, None, ""),
        ("pump", 30, None, "v_B,v_D_x,omega_2,omega_3,epsilon_3"),
        ("pump-collinear", 3, None, ""),
        ("press", None, 0, "B,C,D"),
        ("engine", 24, None, "v_B_x,v_D,a_B_x,a_D_y,omega_2,epsilon_2,D"),
        ("shaper", 3, None, "v_E,v_D,a_E_x,a_E,D"),
    ],
)
def test_texts_of_a_diagram_stay_on_the_page_and_off_each_other(name, n, position, of, lang):
    figure, _ = figure_of(name, n, position, of, lang)
    figure.draw_without_rendering()
    width, height = figure.bbox.size
    texts = list(figure.texts)
    for axes in figure.axes:
        names = axes.get_legend().get_texts() if axes.get_legend() else []
        texts += [*axes.texts, *names, axes.xaxis.label, axes.yaxis.label]
    # A text's own box, without the line of a mark.
    boxes = [Text.get_window_extent(text) for text in texts if text.get_text()]
    assert len(boxes) > 5
    for k, box in enumerate(boxes):
        assert min(box.x0, box.y0) >= 0.0
        assert box.x1 <= width
        assert box.y1 <= height
        assert not any(box.overlaps(other) for other in boxes[:k]), texts[k]


def test_a_panel_shows_each_quantity_by_name_with_its_unit_and_the_value_of_the_variant():
    figure, subject = figure_of("engine", 1, None, "v_B_x,v_B", "ru")
    (panel,) = figure.findobj(Axes)
    assert panel.get_ylabel() == "Скорости,\nм/с"
    assert [text.get_text() for text in panel.get_legend().get_texts()] == ["${v}_{B}^{x}$", "${v}_{B}$"]
    curves = [line for line in panel.get_lines() if len(line.get_xdata()) > 1000]
    rings = [line.get_ydata()[0] for line in panel.get_lines() if line.get_marker() == "o"]
    for quantity, curve, ring in zip(subject.select(["v_B_x", "v_B"]).quantities, curves, rings, strict=True):
        driving = np.radians(curve.get_xdata())
        assert curve.get_ydata() == pytest.approx(subject.values_at(quantity, driving), abs=1e-9)
        assert ring == pytest.approx(subject.values_at(quantity, np.array([subject.cycle.start]))[0])


def test_a_panel_shows_the_part_of_an_unbounded_quantity_between_the_ends():
    figure, subject = figure_of("pump", 7, None, "v_D", "en")
    (panel,) = figure.findobj(Axes)
    hump = np.nanmax(subject.values(subject.select(["v_D"]).quantities[0])[100:220])
    assert hump < panel.get_ylim()[1] < 20 * hump
    ends = [stop.at for stop in subject.cycle.following.stops]
    assert panel.get_xlim()[0] < np.degrees(min(ends)) < np.degrees(max(ends)) < panel.get_xlim()[1]


def test_paths_are_true_to_their_scale():
    figure, _ = figure_of("press", None, 0, "D", "en")
    (paths,) = figure.findobj(Axes)
    assert paths.get_title(loc="left") == "Paths of points, 1 : 15"
    figure.draw_without_rendering()
    width_mm = paths.get_window_extent().width / figure.dpi * 25.4
    assert np.ptp(paths.get_xlim()) / width_mm == pytest.approx(15.0, rel=1e-6)


@pytest.mark.parametrize(
    ("largest", "label"), [(2.5e6, "$10^{6}$ m/s"), (0.025, "$10^{-3}$ m/s"), (25, "m/s")]
)
def test_a_power_of_ten_stands_with_the_unit_where_numbers_would_be_long(largest, label):
    figure, _ = figure_of("engine", 1, None, "v_B_x", "en", speed=largest)
    (panel,) = figure.findobj(Axes)
    assert panel.get_ylabel() == f"Velocities,\n{label}"
    assert all(len(tick.get_text()) <= 6 for tick in panel.get_yticklabels())


def test_any_name_can_stand_in_a_diagram():
    figure = Figure()
    figure.text(0.1, 0.1, mathtext("a$b\\c{d}_Ж%_#&^~ e"))
    figure.draw_without_rendering()


def test_what_is_smaller_than_its_own_error_is_zero(press):
    """The horizontal slider's velocity has no upright part, and at the dead points none at all."""
    upright, along = (press.values(quantity) for quantity in press.select(["v_D_y", "v_D_x"]).quantities)
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
