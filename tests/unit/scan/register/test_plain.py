"""Plain sheets painted with a known map, registered again: scans, copies and photos."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from grader.records import Page, Ruling
from grader.scan.decode.pages import page_of
from grader.scan.register.distortion import straight, straighten, straightened
from grader.scan.register.registration import rectify
from grader.texts.spoken import message
from tests.unit.scan.register import places
from tests.unit.scan.register.places import apply

SHARED = Path(__file__).resolve().parents[5] / "shared"
RULED_MM = 0.06
"""Bound on the place of any point: everything ruled exactly, 150 dpi."""
HAND_MM = 0.6
SCALE_SES = 3.5
ISO, GOST = (20, 10, 410, 287), (20, 5, 415, 292)
PX_PER_MM = 150 / 25.4
SUBPIXEL = 6
GRID_MM = np.stack(np.meshgrid(np.linspace(10, 410, 6), np.linspace(10, 287, 5)), axis=-1).reshape(-1, 2)


def scanner(*, turns=0, skew_deg=0.0, scale=(1.0, 1.0), bed_mm=0.0):
    """(map from mm to px, image shape) of a sheet laid askew on a bed `bed_mm` larger on each side."""
    wide, high = (420, 297) if turns % 2 == 0 else (297, 420)
    shape = round((high + 2 * bed_mm) * PX_PER_MM), round((wide + 2 * bed_mm) * PX_PER_MM)
    angle = np.radians(skew_deg - 90 * turns)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    linear = PX_PER_MM * np.diag(scale) @ turn
    middle = np.array([shape[1] - 1, shape[0] - 1]) / 2
    shift = middle - linear @ [210, 148.5]
    return np.vstack([np.c_[linear, shift], [0, 0, 1]]), shape


def painted(matrix, shape, *, frame=ISO, block=True, bed=250, errors=None, noise=2.0):
    """A sheet with frame, title block and a few strokes, seen through `matrix`."""
    grey = np.full(shape, bed, dtype=np.uint8)
    outline = [(0, 0), (420, 0), (420, 297), (0, 297)]
    cv2.fillConvexPoly(grey, fixed(apply(matrix, outline)), 248, cv2.LINE_AA, SUBPIXEL)
    lines = [((60, 80), (150, 60)), ((150, 60), (110, 160)), ((250, 100), (330, 170))]
    if frame is not None:
        x0, y0, x1, y1 = frame
        corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)
        corners += 0.0 if errors is None else errors
        lines += list(zip(corners, np.roll(corners, -1, axis=0), strict=True))
    if block:
        right, bottom = (410, 287) if frame is None else frame[2:]
        lines += [((right - 150, bottom - h), (right, bottom - h)) for h in (0, 9, 18, 27)]
        lines += [((right - x, bottom - 27), (right - x, bottom)) for x in (150, 0)]
    for ends in lines:
        stroke(grey, apply(matrix, ends))
    soft = cv2.GaussianBlur(grey, (0, 0), 0.6)
    noisy = soft + np.random.default_rng(0).normal(0, noise, shape)
    return np.clip(noisy, 0, 255).astype(np.uint8)


def stroke(grey, points, *, dark=60, thick=3, closed=False):
    pen = {"color": dark, "thickness": thick, "lineType": cv2.LINE_AA, "shift": SUBPIXEL}
    cv2.polylines(grey, [fixed(points)], isClosed=closed, **pen)


def fixed(points):
    return np.rint(np.asarray(points) * 2**SUBPIXEL).astype(np.int32)


def off_mm(sheet, matrix):
    """Largest distance on the sheet between where points are and where the registration says."""
    return places.off_mm(sheet.mm_to_px, matrix, GRID_MM)


def scale_off(sheet, matrix):
    """Relative error of lengths, in standard errors."""
    found = np.sqrt(abs(np.linalg.det(sheet.mm_to_px[:2, :2]) / np.linalg.det(matrix[:2, :2])))
    return abs(found - 1.0) / sheet.scale_se


@pytest.mark.parametrize("frame", [ISO, GOST])
@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_a_ruled_frame_tells_place_scale_and_which_way_up(frame, turns):
    matrix, shape = scanner(turns=turns, skew_deg=0.9)
    sheet = rectify(Page("a.png", 1, painted(matrix, shape, frame=frame), (150.0, 150.0)))
    assert off_mm(sheet, matrix) < RULED_MM
    assert (sheet.rotation_deg - (0.9 - 90 * turns) + 180) % 360 - 180 == pytest.approx(0, abs=0.03)
    assert sheet.drawable_mm == (frame[0], frame[1], frame[2] - frame[0], frame[3] - frame[1])
    assert sheet.method == "combined"
    assert not sheet.problems


def test_unequal_scales_of_a_scanner_are_found():
    matrix, shape = scanner(scale=(1.003, 0.998))
    sheet = rectify(Page("a.png", 1, painted(matrix, shape, errors=None), None))
    assert off_mm(sheet, matrix) < 2 * RULED_MM


@pytest.mark.parametrize("seed", range(4))
def test_a_hand_ruled_frame_misleads_no_further_than_is_said(seed):
    rng = np.random.default_rng(seed)
    matrix, shape = scanner(skew_deg=-0.6, scale=tuple(1 + rng.normal(0, 0.0015, 2)))
    grey = painted(matrix, shape, errors=rng.normal(0, 0.25, (4, 2)))
    sheet = rectify(Page("a.png", 1, grey, (150.0, 150.0)))
    assert off_mm(sheet, matrix) < HAND_MM
    assert scale_off(sheet, matrix) < SCALE_SES
    assert 2e-4 < sheet.scale_se < 3e-3


def test_a_false_resolution_is_told_and_not_followed():
    matrix, shape = scanner()
    sheet = rectify(Page("a.png", 1, painted(matrix, shape), (200.0, 200.0)))
    assert off_mm(sheet, matrix) < RULED_MM
    assert [problem.code for problem in sheet.problems] == ["resolution_wrong"]


@pytest.mark.parametrize("bed", [30, 215])
def test_the_papers_edges_do_without_a_frame(bed):
    matrix, shape = scanner(skew_deg=0.7, bed_mm=7)
    sheet = rectify(Page("a.png", 1, painted(matrix, shape, frame=None, bed=bed), (150.0, 150.0)))
    # A filled polygon is half a pixel larger all round than its corners say.
    assert off_mm(sheet, matrix) < 3 * RULED_MM
    assert sheet.drawable_mm == (10, 10, 400, 277)


def test_a_shadow_along_the_edge_lies_outside_the_paper():
    matrix, shape = scanner(bed_mm=6)
    grey = painted(matrix, shape, frame=None, bed=249)
    outer = apply(matrix, [(-0.3, -0.3), (420.3, -0.3), (420.3, 297.3), (-0.3, 297.3)])
    stroke(grey, outer, dark=120, thick=4, closed=True)
    sheet = rectify(Page("a.png", 1, grey, (150.0, 150.0)))
    assert off_mm(sheet, matrix) < 4 * RULED_MM
    assert scale_off(sheet, matrix) < SCALE_SES


def test_the_resolution_alone_gives_a_scale_and_says_so():
    matrix, shape = scanner(skew_deg=0.4)
    sheet = rectify(Page("a.png", 1, painted(matrix, shape, frame=None, bed=248), (150.0, 150.0)))
    assert sheet.px_per_mm == pytest.approx(PX_PER_MM, rel=2e-3)
    assert sheet.rotation_deg == pytest.approx(0.4, abs=0.1)
    assert "frame_missing" in {problem.code for problem in sheet.problems}
    assert sheet.scale_se >= 1e-3


def test_links_that_slope_a_little_do_not_tilt_a_sheet_without_a_frame():
    matrix, shape = scanner(skew_deg=0.4)
    grey = painted(matrix, shape, frame=None, block=False, bed=248)
    for x, top, bottom in ((100, 100, 149), (230, 90, 127)):
        slope = np.radians(4.6)
        stroke(grey, apply(matrix, [(x, top), (x + (bottom - top) * np.tan(slope), bottom)]))
    sheet = rectify(Page("a.png", 1, grey, (150.0, 150.0)))
    assert sheet.rotation_deg == pytest.approx(0.4, abs=0.5)


def test_without_a_frame_lines_hardly_show_the_turn_and_squares_near_level_do():
    """Links and the vectors across them agree with each other, not with the sheet."""
    matrix, shape = scanner()
    page = Page("a.png", 1, painted(matrix, shape, frame=None, bed=248), (150.0, 150.0))
    assert np.degrees(rectify(page).turn_se_rad) >= 1.0
    for tilt, least, most in ((0.1, 0.0, 0.2), (2.5, 2.4, 2.6)):
        # Squares far from level may be turned themselves.
        along = 0.0333 * np.exp(1j * np.radians(tilt))
        ruling = Ruling(np.array([[along.real, along.imag], [-along.imag, along.real]]))
        sheet = rectify(replace(page, ruling=ruling))
        assert sheet.rotation_deg == pytest.approx(tilt, abs=0.01)
        assert least < np.degrees(sheet.turn_se_rad) < most


def test_a_sheet_lies_as_its_drawing_has_shown():
    matrix, shape = scanner()
    page = Page("a.png", 1, painted(matrix, shape, frame=None, bed=248), (150.0, 150.0))
    sheet = rectify(replace(page, tilt_rad=(np.radians(-1.3), 0.003)))
    assert sheet.rotation_deg == pytest.approx(358.7, abs=0.01)
    assert sheet.turn_se_rad == 0.003


@pytest.mark.parametrize("dpi", [None, (72.0, 72.0)])
def test_a_usual_resolution_is_assumed_where_none_is_stated_and_said_to_be(dpi):
    matrix, shape = scanner()
    sheet = rectify(Page("a.png", 1, painted(matrix, shape, frame=None, bed=248), dpi))
    assert {"resolution_assumed", "frame_missing"} <= {problem.code for problem in sheet.problems}
    assert sheet.scale_se >= 3e-3


def test_an_image_of_exactly_a3s_pixels_has_that_resolution_where_none_is_stated():
    """A scanner was set to both; the title block says that it is a drawing."""
    matrix, shape = scanner()
    grey = painted(matrix, shape, frame=None)
    sheet = rectify(Page("scan.png", 1, grey))
    assert sheet.px_per_mm == pytest.approx(PX_PER_MM, rel=0.003)


def test_a_frame_at_the_scanners_scale_tells_which_way_up_without_a_title_block():
    matrix, shape = scanner(turns=2, bed_mm=6)
    sheet = rectify(Page("scan.png", 1, painted(matrix, shape, block=False, bed=215), (150.0, 150.0)))
    assert off_mm(sheet, matrix) < HAND_MM
    assert "frame_missing" not in {problem.code for problem in sheet.problems}


@pytest.mark.parametrize("dpi", [None, (72.0, 72.0)])
def test_a_cameras_picture_is_not_taken_for_a_scan_of_a_larger_window(dpi):
    """A 4 to 3 picture: at 240 dpi as wide as A3, and 20 mm higher."""
    matrix = np.array([[8.4, 0.02, 250.0], [0.03, 8.2, 300.0], [0.0, 0.0, 1.0]])
    assert not rectify(Page("photo.jpg", 1, painted(matrix, (2992, 3990), frame=None), dpi))


def photo():
    corners = np.float32([(310, 160), (2700, 240), (2790, 1990), (190, 1900)])
    outline = np.float32([(0, 0), (420, 0), (420, 297), (0, 297)])
    return cv2.getPerspectiveTransform(outline, corners).astype(float), (2200, 3000)


@pytest.mark.parametrize("frame", [ISO, None])
def test_a_photo_is_registered_through_its_perspective(frame):
    matrix, shape = photo()
    sheet = rectify(Page("a.jpg", 1, painted(matrix, shape, frame=frame, bed=90), None))
    assert off_mm(sheet, matrix) < 3 * RULED_MM
    assert ("paper_assumed" in {problem.code for problem in sheet.problems}) == (frame is None)


@pytest.mark.parametrize("bend", [-0.012, 0.01])
def test_a_bent_photo_is_straightened(bend):
    matrix, shape = photo()
    # The inverse of a small bend is, to first order, the opposite bend.
    bent = straightened(painted(matrix, shape, bed=90), -bend)
    page = Page("a.jpg", 1, bent, None)
    sheet = rectify(page)
    assert sheet.lens is not None
    assert sheet.lens.bend == pytest.approx(bend, abs=0.0015)
    _, flat = straighten(page, sheet)
    assert off_mm(flat, matrix) < 0.2
    assert off_mm(flat, matrix) < 0.4 * off_mm(sheet, matrix)


def unknown_because(sheet) -> str:
    """The reason why print or stated resolution do not give the page's scale; empty if one does."""
    if not sheet:
        return message(sheet.reason)
    return next((message(problem) for problem in sheet.problems if problem.code == "scale_unknown"), "")


def test_squared_paper_has_no_title_block():
    matrix, shape = scanner()
    grey = painted(matrix, shape, frame=None, block=False, bed=248)
    squares = [[(x, 0), (x, 297)] for x in range(0, 420, 10)]
    squares += [[(0, y), (420, y)] for y in range(0, 297, 10)]
    for ends in squares:
        stroke(grey, apply(matrix, ends), dark=150, thick=2)
    assert unknown_because(rectify(Page("a.png", 1, grey, None)))


def on_squares(pitch_mm, dpi=None):
    """A sheet without frame on squares that were taken out; by its edges alone, or a stated resolution."""
    matrix, shape = scanner(bed_mm=12.0)
    per_px = 1.0 / (pitch_mm * PX_PER_MM)
    ruling = Ruling(np.array([[0.0, per_px], [per_px, 0.0]]))
    return rectify(Page("a.png", 1, painted(matrix, shape, frame=None, bed=120), dpi, ruling=ruling))


def test_squares_are_a_second_witness_of_the_scale():
    sheet, off = on_squares(5.0), on_squares(5.02)
    assert sheet.problems[-1].code == "squared_paper"
    assert sheet.problems[-1].parameters == {"pitch_mm": 5.0}
    assert 0.0025 < sheet.scale_se < 0.003
    # Half-way between edges, known to 0.4 per cent, and squares, which are known as well as they.
    assert 0.4 * 0.004 < off.px_per_mm / sheet.px_per_mm - 1.0 < 0.6 * 0.004


def test_squares_of_a_size_that_no_paper_has_say_that_the_scale_is_wrong():
    assert on_squares(5.85).reason.parameters["why"] == "odd_squares"


@pytest.mark.parametrize(
    ("shape", "dpi"),
    [((1754, 2480), None), ((2480, 3508), None), ((2480, 3508), (300.0, 300.0)), ((300, 400), None)],
)
def test_paper_with_nothing_on_it_is_refused_with_a_reason(shape, dpi):
    reason = unknown_because(rectify(Page("a.png", 1, np.full(shape, 250, dtype=np.uint8), dpi)))
    assert len(reason) > 20


SCANS = [
    "pump-flatbed/s01.jpg",
    "pump-flatbed/s11.jpg",
    "pump-copy/s04.png",
    "press-mix/s05.jpg",
    "pump-phone/s04.jpg",
]
WORST_MM = {"pump-flatbed": 0.7, "pump-copy": 0.7, "press-mix": 0.7, "pump-phone": 0.2}


@pytest.mark.skipif(not (SHARED / "sheets").is_dir(), reason="the folder ../shared/sheets is absent")
@pytest.mark.parametrize("name", SCANS)
def test_scans_of_others_are_registered_upright(name):
    folder, file = name.split("/")
    lines = (SHARED / "sheets" / folder / "truth.jsonl").read_text().splitlines()
    truth = next(one for one in map(json.loads, lines) if one["class_file"] == file)
    page = page_of(SHARED / "sheets" / name, 1)
    page, sheet = straighten(page, rectify(page))
    known = np.array(truth["grid_mm_px"])
    pixels = known[:, 1]
    if sheet.lens is not None:
        pixels = straight(pixels, sheet.lens.bend, page.grey.shape)
    off = np.hypot(*(apply(np.linalg.inv(sheet.mm_to_px), pixels) - known[:, 0]).T)
    assert off.max() < WORST_MM[folder]


@pytest.mark.parametrize("told", [0, 180])
@pytest.mark.parametrize("frame", [ISO, None], ids=["frame", "no frame"])
def test_where_nothing_drawn_tells_a_half_turn_the_file_does_and_it_is_said_to_be_unsure(frame, told):
    matrix, shape = scanner()
    page = Page("s.jpg", 1, painted(matrix, shape, frame=frame, block=False), (150.0, 150.0), told)
    sheet = rectify(page)
    assert abs((sheet.rotation_deg - told + 180.0) % 360.0 - 180.0) < 1.0
    assert "upright_unsure" in [problem.code for problem in sheet.problems]


def test_a_title_block_counts_more_than_the_turn_that_the_file_asks_for():
    matrix, shape = scanner()
    sheet = rectify(Page("s.jpg", 1, painted(matrix, shape), (150.0, 150.0), 180))
    assert abs((sheet.rotation_deg + 180.0) % 360.0 - 180.0) < 1.0


def test_a_bent_photo_of_paper_without_a_frame_keeps_the_doubt_whether_it_is_a3():
    matrix, shape = photo()
    page = Page("s.jpg", 1, straightened(painted(matrix, shape, frame=None, bed=60), -0.02))
    sheet = rectify(page)
    assert "paper_assumed" in [problem.code for problem in sheet.problems]
    assert sheet.lens is not None
    assert straighten(page, sheet)[1].scale_se > 0.003


@pytest.mark.parametrize("axis", [0, 1])
def test_two_sheets_on_one_picture_are_told_as_two(axis):
    matrix, shape = scanner(bed_mm=4)
    one = painted(matrix, shape, bed=215)
    two = np.concatenate([one, one], axis=axis)
    sheet = rectify(Page("a.png", 1, two, (150.0, 150.0)))
    assert sheet.reason.parameters["why"] == "two_sheets"


def test_a_larger_sheet_is_not_told_as_two():
    _, shape = scanner(bed_mm=4)
    blank = np.full(shape, 248, dtype=np.uint8)
    sheet = rectify(Page("a.png", 1, np.concatenate([blank, blank], axis=0), (150.0, 150.0)))
    assert sheet.reason.parameters["why"] != "two_sheets"
