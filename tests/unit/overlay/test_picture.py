"""Overlay pictures: in the right place, upright, and legible without colours."""

import itertools
from dataclasses import replace

import cv2
import numpy as np
import pytest

from grader.documents import Quantity, Tolerance
from grader.outcomes import Outcome
from grader.overlay.backdrop import backdrop
from grader.overlay.picture import overlay, paint
from grader.overlay.scene import ARROW_WIDTH_MM, COLOURS, MARKS, Arrow, Ghost, Scene, labels_of, scene_of
from grader.records import Figure, Page, Reading, ReadNode, ReadVector, Sheet
from reference.construction.graph import Vector

PAGE_MM = (420.0, 297.0)
PX_PER_MM = 4.0
VECTORS = {"v_A": Vector("v_A", "o", "a", "kv"), "v_BA": Vector("v_BA", "a", "b", "kv")}
NODES_MM = {"o": (100.0, 200.0), "a": (160.0, 200.0), "b": (160.0, 150.0)}


def sheet(rotation_deg=0.0, px_per_mm=PX_PER_MM):
    """Upright sheet millimetres to the pixels of a scan that was turned by quarter turns."""
    upright = np.array([[px_per_mm, 0, -0.5], [0, px_per_mm, -0.5], [0, 0, 1.0]])
    width, height = PAGE_MM[0] * px_per_mm, PAGE_MM[1] * px_per_mm
    turns = {
        0.0: np.eye(3),
        90.0: np.array([[0, -1, height - 1], [1, 0, 0], [0, 0, 1.0]]),
        180.0: np.array([[-1, 0, width - 1], [0, -1, height - 1], [0, 0, 1.0]]),
    }
    return Sheet(
        turns[rotation_deg] @ upright,
        PAGE_MM,
        "markers",
        px_per_mm,
        rotation_deg,
        0.0,
        0.0,
        (20, 10, 390, 277),
    )


def drawn_page(sheet_of_it):
    """A scan with small black squares at the three nodes."""
    corners = np.array([[0, 0, 1], [*PAGE_MM, 1.0]]).T
    x, y = np.abs(np.diff((sheet_of_it.mm_to_px @ corners)[:2], axis=1)).ravel()
    grey = np.full((round(y), round(x)), 235, np.uint8)
    for at in NODES_MM.values():
        px, py, _ = sheet_of_it.mm_to_px @ (*at, 1.0)
        cv2.rectangle(grey, (round(px) - 6, round(py) - 6), (round(px) + 6, round(py) + 6), 20, -1)
    return Page("s07.png", 1, grey)


def reading(confidence=0.99):
    nodes = {
        name: ReadNode(complex(x, -y), np.eye(2) * 0.01, confidence) for name, (x, y) in NODES_MM.items()
    }
    vectors = {
        "v_A": ReadVector(60.0, 0.05, 0.0, 0.1, confidence),
        "v_BA": ReadVector(50.0, 0.05, 90.0, 0.1, 0.99),
    }
    return Reading({"velocity_plan": Figure(nodes, vectors)})


def outcome(name, verdict, expected=None):
    return Outcome(
        name, name, verdict, Quantity(), expected or Quantity(), Tolerance(), 0.99, (), (verdict, verdict)
    )


def decoded(data):
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)


def colour_at(image, at, px_per_mm):
    x, y = round(at[0] * px_per_mm - 0.5), round(at[1] * px_per_mm - 0.5)
    return image[y, x].astype(int)


def bgr(verdict):
    return np.array([int(COLOURS[verdict][i : i + 2], 16) for i in (5, 3, 1)])


@pytest.mark.parametrize("rotation_deg", [0.0, 90.0, 180.0])
@pytest.mark.parametrize("px_per_mm", [4.0, 11.8])
def test_the_scan_is_shown_upright_with_every_point_in_its_place(rotation_deg, px_per_mm):
    registered = sheet(rotation_deg, px_per_mm)
    picture = overlay(backdrop(drawn_page(registered), registered, width_px=1680), None, {}, {})
    scan = cv2.cvtColor(decoded(picture.scan), cv2.COLOR_BGR2GRAY)
    assert scan.shape == (1188, 1680)
    for at in NODES_MM.values():
        x, y = round(at[0] * 4), round(at[1] * 4)
        ink = 255.0 - scan[y - 20 : y + 20, x - 20 : x + 20].astype(float)
        rows, columns = np.indices(ink.shape)
        assert (rows * ink).sum() / ink.sum() == pytest.approx(19.5, abs=0.6)
        assert (columns * ink).sum() / ink.sum() == pytest.approx(19.5, abs=0.6)


def test_paper_becomes_white_in_a_shadow():
    registered = sheet()
    page = drawn_page(registered)
    shadow = np.linspace(0.55, 1.0, page.grey.shape[1])
    shaded = Page("s.png", 1, (page.grey * shadow).astype(np.uint8))
    picture = overlay(backdrop(shaded, registered, width_px=1680), None, {}, {})
    scan = cv2.cvtColor(decoded(picture.scan), cv2.COLOR_BGR2GRAY)
    assert np.median(scan[:, :100]) > 250
    assert scan.min() < 120


def test_arrows_lie_on_what_was_read_in_the_colour_of_their_verdict():
    registered = sheet()
    verdicts = {"v_A": outcome("v_A", "none"), "v_BA": outcome("v_BA", "full")}
    picture = overlay(
        backdrop(drawn_page(registered), registered, width_px=1680), reading(), VECTORS, verdicts
    )
    image = decoded(picture.png)
    assert np.abs(colour_at(image, (120.0, 200.0), 4.0) - bgr("none")).max() < 70
    assert np.abs(colour_at(image, (160.0, 180.0), 4.0) - bgr("full")).max() < 70


def test_doubtful_arrows_are_dashed():
    outcomes = {"v_A": outcome("v_A", "full")}
    scene = scene_of(PAGE_MM, reading(confidence=0.5), VECTORS, outcomes, show_expected=False)
    assert [arrow.doubtful for arrow in scene.arrows] == [True, False]
    image = paint(np.full((1188, 1680), 255, np.uint8), scene)
    along = image[round(200 * 4 - 0.5), 420:600].min(axis=1)
    inked = along < 200
    assert np.count_nonzero(np.diff(inked.astype(int))) > 3
    solid = image[620:760, round(160 * 4 - 0.5)].min(axis=1) < 200
    assert solid.all()


def test_what_a_person_must_look_at_is_dashed_however_surely_it_was_read():
    scene = scene_of(PAGE_MM, reading(), VECTORS, {"v_A": outcome("v_A", "review")}, show_expected=False)
    assert scene.arrows[0].doubtful


def test_the_expected_vector_is_ghosted_only_where_asked_for_and_only_where_it_is_off():
    expected = Quantity(length_mm=50.0, direction_deg=90.0)
    outcomes = {"v_A": outcome("v_A", "none", expected), "v_BA": outcome("v_BA", "full", expected)}
    hidden = scene_of(PAGE_MM, reading(), VECTORS, outcomes, show_expected=False)
    shown = scene_of(PAGE_MM, reading(), VECTORS, outcomes, show_expected=True)
    assert hidden.ghosts == ()
    (ghost,) = shown.ghosts
    assert ghost.tail == (100.0, 200.0)
    assert ghost.tip == pytest.approx((100.0, 150.0))


def test_vectors_of_unread_nodes_are_left_out():
    whole = reading()
    nodes = {name: node for name, node in whole.figures["velocity_plan"].nodes.items() if name != "b"}
    torn = Reading({"velocity_plan": Figure(nodes, whole.figures["velocity_plan"].vectors)})
    scene = scene_of(PAGE_MM, torn, VECTORS, {}, show_expected=False)
    assert [arrow.name for arrow in scene.arrows] == ["v_A"]


def test_every_verdict_has_its_own_mark_and_colour():
    assert len(set(MARKS.values())) == len(MARKS) == len(set(COLOURS.values()))


def linear(verdict):
    channels = bgr(verdict)[::-1] / 255
    return np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)


def test_colours_stand_out_from_paper():
    # 4.5 : 1 is the contrast that WCAG 2 asks of text.
    for verdict in COLOURS:
        assert 1.05 / (linear(verdict) @ [0.2126, 0.7152, 0.0722] + 0.05) >= 4.5, verdict


@pytest.mark.parametrize(
    "seen",
    [
        # Red- and green-blind vision: Vienot, Brettel and Mollon 1999, linear RGB.
        [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
        [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
    ],
)
def test_right_and_wrong_look_different_to_the_colour_blind(seen):
    assert apart(seen, "full", "none") > 10 * JUST_NOTICEABLE


JUST_NOTICEABLE = 2.3


def apart(seen, *verdicts):
    """The perceived distance of two verdicts' colours, CIE L*a*b*."""
    shown = np.clip(np.array([np.array(seen) @ linear(one) for one in verdicts]), 0, 1)
    gamma = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)
    lab = cv2.cvtColor(gamma[None].astype(np.float32), cv2.COLOR_RGB2LAB)[0]
    return np.linalg.norm(lab[0] - lab[1])


@pytest.mark.parametrize(
    "seen",
    [
        np.eye(3),
        # No long, middle or short cones: Machado, Oliveira and Fernandes 2009, severity 1, linear RGB.
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    ],
)
def test_all_verdicts_look_different_to_every_eye(seen):
    pairs = itertools.combinations(COLOURS, 2)
    assert min(apart(seen, *pair) for pair in pairs) > 6 * JUST_NOTICEABLE


def test_verdicts_differ_in_a_grey_print():
    # By mark everywhere; wrong, nearly right and doubtful arrows by their lines, too.
    assert ARROW_WIDTH_MM["none"] > 1.5 * ARROW_WIDTH_MM["full"]
    right = Arrow("v_A", "velocity_plan", (0.0, 0.0), (50.0, 0.0), "full", doubtful=False)
    lines = [right.dash, replace(right, verdict="partial").dash, replace(right, doubtful=True).dash]
    assert len(set(lines)) == 3


def test_a_page_that_could_not_be_registered_is_shown_as_its_file_asks():
    grey = np.full((300, 200), 240, np.uint8)
    grey[:20, :20] = 0
    picture = overlay(backdrop(Page("x.jpg", 1, grey, turn_deg=90), None), None, {}, {})
    scan = cv2.cvtColor(decoded(picture.scan), cv2.COLOR_BGR2GRAY)
    assert scan.shape == (200, 300)
    assert scan[190, 10] < 128 < scan[10, 10]


def test_zero_vectors_and_far_away_nodes_do_no_harm():
    scene = Scene(
        PAGE_MM,
        (
            Arrow("v_A", "velocity_plan", (5.0, 5.0), (5.0, 5.0), "full", doubtful=False),
            Arrow("v_B", "velocity_plan", (5.0, 5.0), (9000.0, -9000.0), "review", doubtful=True),
        ),
        (Ghost("v_A", "velocity_plan", (0.0, 0.0), (-50.0, -50.0)),),
    )
    assert paint(np.full((297, 420), 255, np.uint8), scene).shape == (297, 420, 3)


# Labels -------------------------------------------------------------------------------------------


def star(count):
    tips = [(200 + 60 * np.cos(a), 150 - 60 * np.sin(a)) for a in np.linspace(0, np.pi, count)]
    return [
        Arrow(f"v_{chr(65 + k)}", "velocity_plan", (200.0, 150.0), tip, "full", doubtful=False)
        for k, tip in enumerate(tips)
    ]


def test_labels_stay_on_the_sheet_and_off_each_other():
    labels = labels_of(star(9), (0.0, 0.0, *PAGE_MM))
    boxes = [label.box for label in labels]
    for index, (x, y, width, height) in enumerate(boxes):
        assert 0 <= x <= PAGE_MM[0] - width
        assert 0 <= y <= PAGE_MM[1] - height
        for other in boxes[:index]:
            apart_x = x >= other[0] + other[2] or other[0] >= x + width
            apart_y = y >= other[1] + other[3] or other[1] >= y + height
            assert apart_x or apart_y


def test_every_arrow_has_its_label():
    assert {label.arrow.name for label in labels_of(star(7), (0.0, 0.0, *PAGE_MM))} == {
        arrow.name for arrow in star(7)
    }


def test_a_label_far_from_its_arrow_has_a_leader_to_it():
    crowd = [*star(5)] * 6
    far = [label for label in labels_of(crowd, (0.0, 0.0, *PAGE_MM)) if label.leader is not None]
    assert far
    for label in far:
        _start, end = label.leader
        middle = [0.45 * a + 0.55 * b for a, b in zip(label.arrow.tail, label.arrow.tip, strict=True)]
        assert end == pytest.approx(middle)


# Links ---------------------------------------------------------------------------------------------


def sketch_scene(verdict):
    nodes = {
        name: ReadNode(complex(x, -y), np.eye(2) * 0.01, 0.99)
        for name, (x, y) in {"O1": (100.0, 200.0), "A": (160.0, 200.0)}.items()
    }
    drawn = Reading({"mechanism": Figure(nodes, {})})
    links = {"O1A": ("O1", "A"), "AB": ("A", "B")}
    return scene_of(PAGE_MM, drawn, {}, {"O1A": outcome("O1A", verdict)}, show_expected=True, links=links)


def test_links_that_were_judged_are_marked_on_the_sketch():
    (link,) = sketch_scene("none").arrows
    assert (link.name, link.verdict, link.is_link, link.is_named) == ("O1A", "none", True, True)
    assert (link.tail, link.tip) == ((100.0, 200.0), (160.0, 200.0))


def test_right_links_have_no_name_and_what_is_not_judged_no_line():
    assert not sketch_scene("full").arrows[0].is_named
    assert sketch_scene("not_judged").arrows == ()
