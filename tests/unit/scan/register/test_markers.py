"""Printed sheets rasterised, degraded, and registered: the truth is known exactly."""

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from grader.printed.answer_sheet import make_calibration, make_sheets
from grader.printed.layout import MARKER_CORNERS, TEMPLATES
from grader.records import Identity, Page
from grader.scan.decode.pages import pages_of
from grader.scan.register.distortion import straighten
from grader.scan.register.markers import register
from grader.scan.register.registration import register as register_page
from grader.tables.roster import RosterRow
from reference.authored.assignment import load_assignment
from tests.rendered import rendered
from tests.unit.scan.register import places
from tests.unit.scan.register.places import apply

REAL = Path(__file__).resolve().parents[5] / "shared" / "real"
CLEAN_MM, HARD_MM = 0.02, 0.08
"""Bounds on the place of any point of the drawing area: a clean scan; one marker pair, 150 dpi."""
STUDENT = Identity("pump", "s07", 7, None, "velocity")
GRID_MM = np.stack(np.meshgrid(np.linspace(23, 407, 7), np.linspace(51, 263, 5)), axis=-1).reshape(-1, 2)


@cache
def printed(dpi, page=0):
    """The printed sheet's pixels and the true map from millimetres."""
    pdf = make_sheets(load_assignment("pump"), [RosterRow("s07", "Ana", 7)]).pdf
    return rasterised(pdf, dpi, page)


def rasterised(pdf, dpi, page=0):
    grey = rendered(pdf, dpi, page)
    high, wide = grey.shape
    return grey, np.array([[wide / 420.0, 0.0, -0.5], [0.0, high / 297.0, -0.5], [0.0, 0.0, 1.0]])


def off_mm(sheet, truth):
    """Largest distance on paper between where points are and where the sheet says."""
    return places.off_mm(sheet.mm_to_px, truth, GRID_MM)


def scanned(grey, *, blur=0.7, noise=5.0, quality=80):
    soft = cv2.GaussianBlur(grey, (0, 0), blur)
    noisy = np.clip(soft + np.random.default_rng(1).normal(0.0, noise, grey.shape), 0, 255).astype(np.uint8)
    return cv2.imdecode(
        cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_GRAYSCALE
    )


def warped(grey, matrix, background=255):
    size = grey.shape[1], grey.shape[0]
    return cv2.warpPerspective(grey, matrix, size, flags=cv2.INTER_LINEAR, borderValue=background)


def without(grey, truth, markers):
    """The page with markers torn off."""
    torn = grey.copy()
    for marker in markers:
        cv2.fillConvexPoly(torn, apply(truth, MARKER_CORNERS[marker]).round().astype(np.int32), 190)
    return torn


@pytest.mark.parametrize("dpi", [150, 300])
def test_a_scanned_sheet_is_placed_to_a_few_hundredths_of_a_millimetre(dpi):
    grey, truth = printed(dpi)
    sheet = register(Page("s.jpg", 1, scanned(grey), (dpi, dpi)))
    assert off_mm(sheet, truth) < CLEAN_MM
    assert sheet.method == "markers"
    assert sheet.identity == STUDENT
    assert sheet.problems == ()
    assert sheet.px_per_mm == pytest.approx(dpi / 25.4, rel=1e-3)


def test_a_sheet_out_of_focus_still_says_whose_it_is():
    grey, truth = printed(150)
    sheet = register(Page("s.jpg", 1, scanned(grey, blur=2.5)))
    assert sheet.identity == STUDENT
    assert off_mm(sheet, truth) < HARD_MM


def test_a_code_too_fine_for_a_quick_look_is_read_in_its_place():
    student = RosterRow("s" * 64, "Ana", 7)
    pdf = make_sheets(load_assignment("pump"), [student]).pdf
    page = Page("s.jpg", 1, scanned(rasterised(pdf, 150)[0], blur=1.2))
    assert register_page(page)[1].student_id == student.student_id
    assert register_page(Page("s.jpg", 1, np.full((300, 400), 255, np.uint8)))[1] is None


def test_the_markers_say_where_the_zones_are():
    layout = make_sheets(load_assignment("pump"), [RosterRow("s07", "Ana", 7)]).layout
    for number, page in enumerate(layout.pages):
        sheet = register(Page("s.jpg", 1, printed(150, number)[0]))
        assert sheet.zones == {name: zone for name, zone in page.zones.items() if name != "fields"}
        assert sheet.identity.kind == page.kind


@pytest.mark.parametrize("turns", range(4))
def test_any_of_the_four_turns_is_seen(turns):
    grey, truth = printed(150)
    high, wide = grey.shape
    turn = {
        0: np.eye(3),
        1: np.array([[0.0, 1, 0], [-1, 0, wide - 1], [0, 0, 1]]),
        2: np.array([[-1.0, 0, wide - 1], [0, -1, high - 1], [0, 0, 1]]),
        3: np.array([[0.0, -1, high - 1], [1, 0, 0], [0, 0, 1]]),
    }[turns]
    sheet = register(Page("s.jpg", 1, np.ascontiguousarray(np.rot90(grey, turns))))
    assert off_mm(sheet, turn @ truth) < CLEAN_MM
    # Turning back what was turned counter-clockwise by `turns` quarters makes it upright.
    assert (sheet.rotation_deg + 90.0 * turns + 1.0) % 360.0 == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("angle_deg", [-2.0, 0.7, 5.0])
def test_a_skewed_sheet_is_followed(angle_deg):
    grey, truth = printed(150)
    centre = (grey.shape[1] / 2, grey.shape[0] / 2)
    skew = np.vstack([cv2.getRotationMatrix2D(centre, angle_deg, 0.95), [0, 0, 1]])
    sheet = register(Page("s.jpg", 1, scanned(warped(grey, skew))))
    assert off_mm(sheet, skew @ truth) < HARD_MM
    assert (sheet.rotation_deg + angle_deg + 180.0) % 360.0 == pytest.approx(180.0, abs=0.02)


@pytest.mark.parametrize("slant", [0.05, 0.12])
def test_a_slanted_photo_is_followed(slant):
    grey, truth = printed(150)
    high, wide = grey.shape
    corners = np.array([[0, 0], [wide, 0], [wide, high], [0, high]], np.float32)
    moved = (
        corners * 0.8
        + np.array([wide, high]) * 0.1
        + np.array([[slant, 0], [-slant, 0], [0, 0], [0, -slant]]) * wide
    )
    photo = cv2.getPerspectiveTransform(corners, moved.astype(np.float32))
    sheet = register(Page("s.jpg", 1, scanned(warped(grey, photo, background=90))))
    assert off_mm(sheet, photo @ truth) < HARD_MM


@pytest.mark.parametrize("torn", [(0,), (3, 4), (0, 3, 4, 7), (0, 1, 2, 3, 4, 5), (1, 2, 3, 4, 5, 6)])
def test_a_torn_marker_is_not_missed(torn):
    grey, truth = printed(150)
    sheet = register(Page("s.jpg", 1, scanned(without(grey, truth, torn))))
    assert off_mm(sheet, truth) < HARD_MM
    assert sheet.identity == STUDENT


def test_strokes_across_markers_do_not_move_the_sheet():
    grey, truth = printed(150)
    drawn = grey.copy()
    for start, end in (((20, 12), (300, 22)), ((27, 5), (27, 290)), ((390, 275), (415, 279))):
        ends = apply(truth, np.array([start, end])).round().astype(int).tolist()
        cv2.line(drawn, ends[0], ends[1], 60, 4)
    assert off_mm(register(Page("s.jpg", 1, drawn)), truth) < HARD_MM


@pytest.mark.parametrize("torn", [range(8), range(7), (0, 1, 2, 3, 4, 5, 7)])
def test_fewer_than_two_markers_register_nothing(torn):
    grey, truth = printed(150)
    assert register(Page("s.jpg", 1, without(grey, truth, torn))) is None


def test_a_bilevel_copy_is_placed():
    grey, truth = printed(300)
    copied = np.where(scanned(grey, noise=25.0) > 110, 255, 0).astype(np.uint8)
    assert off_mm(register(Page("s.png", 1, copied)), truth) < HARD_MM


def test_markers_of_a_foreign_page_register_nothing():
    foreign = np.full((1754, 2481), 255, np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    for number, (x, y) in enumerate([(100, 100), (2200, 150), (150, 1500), (2200, 1500)]):
        marker = cv2.aruco.generateImageMarker(dictionary, TEMPLATES[3].marker_ids[number], 150)
        foreign[y : y + 150, x : x + 150] = marker
    assert register(Page("s.jpg", 1, foreign)) is None


def test_a_mirrored_sheet_registers_nothing():
    assert register(Page("s.jpg", 1, np.ascontiguousarray(printed(150)[0][:, ::-1]))) is None


def test_a_sheet_printed_too_small_is_told_and_its_lengths_are_less_sure():
    grey, truth = printed(150)
    shrink = np.diag([0.97, 0.97, 1.0])
    sheet = register(Page("s.jpg", 1, warped(grey, shrink), (150.0, 150.0)))
    assert [problem.code for problem in sheet.problems] == ["print_scaled"]
    assert sheet.scale_se > 0.01
    assert off_mm(sheet, shrink @ truth) < HARD_MM


def test_a_sheet_printed_on_a4_is_told():
    grey, _ = printed(150)
    sheet = register(Page("s.jpg", 1, warped(grey, np.diag([0.707, 0.707, 1.0])), (150.0, 150.0)))
    assert [problem.code for problem in sheet.problems] == ["print_scaled"]
    assert sheet.problems[0].parameters["size_percent"] == pytest.approx(70.7, abs=0.1)


def test_a_resolution_that_is_plainly_wrong_says_nothing_about_the_print():
    assert register(Page("s.jpg", 1, printed(150)[0], (72.0, 72.0))).problems == ()


def test_the_calibration_page_is_told_from_a_drawing():
    sheet = register(Page("c.jpg", 1, rasterised(make_calibration().pdf, 150)[0]))
    assert [problem.code for problem in sheet.problems] == ["calibration_page"]


def test_pictures_of_other_things_register_nothing():
    if not REAL.is_dir():
        pytest.skip("no foreign pictures beside the project")
    for name in (
        "omrchecker/sheet1.jpg",
        "omrchecker/IMG_20201116_143512.jpg",
        "noteshrink/graph-paper-pencil-only.jpg",
    ):
        for page in pages_of(REAL / name):
            assert register(page) is None


def bent(grey, bend):
    """The picture as a lens with a bend stores it, and where it puts points (n, 2)."""
    high, wide = grey.shape
    centre, radius = np.array([(wide - 1) / 2, (high - 1) / 2]), np.hypot(wide / 2, high / 2)

    def put(points):
        off = (points - centre) / radius
        return centre + (points - centre) * (1 + bend * (off**2).sum(axis=-1, keepdims=True))

    table = np.linspace(0.0, 1.2, 4000)
    x, y = (
        (axis.astype(np.float32) - middle) / radius
        for axis, middle in zip(np.meshgrid(np.arange(wide), np.arange(high)), centre, strict=True)
    )
    stored = np.hypot(x, y)
    # The model gives where a point is stored; the picture needs where a stored point comes from.
    share = np.interp(stored, table * (1 + bend * table**2), table) / np.maximum(stored, 1e-9)
    x, y = (
        (middle + axis * share * radius).astype(np.float32)
        for axis, middle in zip((x, y), centre, strict=True)
    )
    return cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderValue=255), put


@pytest.mark.parametrize("bend", [-0.013, 0.02])
def test_a_lens_that_bends_is_found_and_the_page_straightened(bend):
    grey, truth = printed(150)
    photo, put = bent(grey, bend)
    page = Page("s.jpg", 1, scanned(photo))
    sheet = register(page)
    straight_page, straight_sheet = straighten(page, sheet)
    assert sheet.lens.bend == pytest.approx(bend, abs=0.001)
    assert off_mm(straight_sheet, truth) < HARD_MM
    # The picture itself is straight too: its markers are found where the straight map says.
    again = register(straight_page)
    assert again.lens is None
    assert off_mm(again, truth) < HARD_MM
    # The map of the stored picture is off by the bend, and says that lengths are less sure.
    stored_off = apply(np.linalg.inv(sheet.mm_to_px), put(apply(truth, GRID_MM))) - GRID_MM
    assert sheet.scale_se > 2 * straight_sheet.scale_se
    assert np.hypot(*stored_off.T).max() > 0.2


def test_a_page_without_bend_is_left_as_it_is():
    page = Page("s.jpg", 1, printed(150)[0])
    sheet = register(page)
    assert sheet.lens is None
    assert straighten(page, sheet) == (page, sheet)


def test_paper_that_was_not_flat_is_told():
    grey, _ = printed(150)
    high, wide = grey.shape
    x, y = np.meshgrid(np.arange(wide, dtype=np.float32), np.arange(high, dtype=np.float32))
    curled = cv2.remap(grey, x + 5 * np.sin(x / wide * np.pi) ** 2, y, cv2.INTER_LINEAR, borderValue=255)
    sheet = register(Page("s.jpg", 1, curled))
    assert [problem.code for problem in sheet.problems] == ["sheet_not_flat"]
    assert sheet.scale_se > 0.002


def scribbled(grey, truth, marker):
    """The page with pen strokes to and fro across a whole marker."""
    rng = np.random.default_rng(marker)
    low, high = MARKER_CORNERS[marker].min(axis=0) - 2, MARKER_CORNERS[marker].max(axis=0) + 2
    written = grey.copy()
    path = apply(truth, rng.uniform(low, high, (25, 2))).round().astype(np.int32)
    cv2.polylines(written, [path], isClosed=False, color=50, thickness=4, lineType=cv2.LINE_AA)
    return written


@pytest.mark.parametrize("marker", [0, 2, 5, 7])
def test_a_marker_written_over_does_not_move_the_sheet(marker):
    grey, truth = printed(150)
    sheet = register(Page("s.jpg", 1, scanned(scribbled(grey, truth, marker))))
    assert off_mm(sheet, truth) < HARD_MM
    assert sheet.problems == ()


@pytest.mark.parametrize("corners", [(0,), (0, 2), (0, 1)])
def test_corners_cut_off_are_not_missed(corners):
    grey, truth = printed(150)
    cut = grey.copy()
    for corner in corners:
        x, y = [(0.0, 0.0), (420.0, 0.0), (420.0, 297.0), (0.0, 297.0)][corner]
        inward = np.array([70.0 if x == 0.0 else -70.0, 70.0 if y == 0.0 else -70.0])
        triangle = np.array([(x, y), (x + inward[0], y), (x, y + inward[1])])
        cv2.fillConvexPoly(cut, apply(truth, triangle).round().astype(np.int32), 40)
    assert off_mm(register(Page("s.jpg", 1, scanned(cut))), truth) < HARD_MM


@pytest.mark.parametrize("shift_mm", [0.6, 1.5])
def test_a_fold_that_hides_a_strip_of_paper_is_told(shift_mm):
    grey, _ = printed(150)
    at, hidden = grey.shape[1] // 3, round(shift_mm * 150 / 25.4)
    folded = np.hstack([grey[:, :at], grey[:, at + hidden :], np.full((len(grey), hidden), 255, np.uint8)])
    sheet = register(Page("s.jpg", 1, scanned(np.ascontiguousarray(folded))))
    assert [problem.code for problem in sheet.problems] == ["sheet_not_flat"]
    assert sheet.scale_se > shift_mm / 420.0


@pytest.mark.parametrize("printer", [0.997, 1.003])
def test_a_printers_own_scale_is_within_what_is_said_of_lengths(printer):
    """Drawn lengths are true millimetres, markers the printer's: against the resolution it shows."""
    grey, truth = printed(150)
    scaled = np.diag([printer, printer, 1.0])
    sheet = register(Page("s.jpg", 1, warped(grey, scaled), (150.0, 150.0)))
    length = np.diff(
        apply(np.linalg.inv(sheet.mm_to_px), apply(truth, [[160.0, 150.0], [260.0, 150.0]])), axis=0
    )
    error = np.hypot(*length[0]) / 100.0 - 1.0
    assert abs(error) == pytest.approx(0.003, abs=3e-4)
    assert abs(error) < 2.0 * sheet.scale_se
    assert sheet.scale_se < 0.003
