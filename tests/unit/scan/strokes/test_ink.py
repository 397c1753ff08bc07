"""Drawings painted with a known truth, and what is found of them."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from grader.records import HEAD_AHEAD, HEAD_BACK, Page, Sheet, Unread
from grader.scan.decode.pages import page_of
from grader.scan.decode.ruling import without_ruling
from grader.scan.register.registration import rectify
from grader.scan.strokes.ink import find_ink
from grader.texts.spoken import message
from tests.examples import slow

SHARED = Path(__file__).resolve().parents[5] / "shared"
PX_PER_MM = 200 / 25.4
SHAPE = (round(297 * PX_PER_MM), round(420 * PX_PER_MM))
SUBPIXEL = 6
PEN_MM = 0.4
CENTRE_MM = 0.02
DIRECTION_DEG = 0.1
END_MM = 0.5
HAND_WOBBLE_MM = 0.05
MANY_SES = 4.0


@cache
def noise():
    return np.random.default_rng(0).normal(0, 3, SHAPE)


class Paper:
    """A sheet to draw on in millimetres, upright or turned by half."""

    def __init__(self, *, half_turn=False):
        turn = -1.0 if half_turn else 1.0
        middle = (np.array(SHAPE[::-1]) - 1) / 2
        shift = middle - turn * PX_PER_MM * np.array([210, 148.5])
        self.matrix = np.array([[turn * PX_PER_MM, 0, shift[0]], [0, turn * PX_PER_MM, shift[1]], [0, 0, 1]])
        self.grey = np.full(SHAPE, 245, dtype=np.uint8)

    def at(self, points):
        mapped = np.asarray(points, dtype=float) @ self.matrix[:2, :2].T + self.matrix[:2, 2]
        return np.rint(mapped * 2**SUBPIXEL).astype(np.int32)

    def line(self, start, end, *, dark=60, pen=PEN_MM):
        """A stroke of uniform width with flat ends, as a polygon."""
        start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        u = (end - start) / np.hypot(*(end - start))
        aside = pen / 2 * np.array([-u[1], u[0]])
        self.area([start + aside, end + aside, end - aside, start - aside], dark=dark)

    def area(self, corners, *, dark=60):
        corners = self.at(corners)
        first = np.maximum((corners.min(axis=0) >> SUBPIXEL) - 2, 0)
        beyond = (corners.max(axis=0) >> SUBPIXEL) + 4
        part = self.grey[first[1] : beyond[1], first[0] : beyond[0]]
        layer = np.full(part.shape, 245, dtype=np.uint8)
        cv2.fillPoly(layer, [corners - (first << SUBPIXEL)], dark, cv2.LINE_AA, SUBPIXEL)
        np.minimum(part, layer, out=part)

    def wobbly(self, start, end, rng):
        """A hand's line: slow waves about the straight one."""
        start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        count = int(np.hypot(*(end - start)) / 0.5)
        noise = np.convolve(rng.normal(size=count + 8), np.ones(9) / 3.0, mode="valid") * HAND_WOBBLE_MM
        u = (end - start) / np.hypot(*(end - start))
        v = np.array([-u[1], u[0]])
        path = start + np.linspace(0, 1, count)[:, None] * (end - start) + noise[:, None] * v
        self.area([*(path + PEN_MM / 2 * v), *(path - PEN_MM / 2 * v)[::-1]])

    def ring(self, centre, radius):
        """A circle drawn with the pen; to be drawn before what is inside it."""
        angle = np.linspace(0, 2 * np.pi, 80)
        unit = np.column_stack([np.cos(angle), np.sin(angle)])
        self.area(np.asarray(centre) + (radius + PEN_MM / 2) * unit)
        inner = np.asarray(centre) + (radius - PEN_MM / 2) * unit
        cv2.fillPoly(self.grey, [self.at(inner)], 245, cv2.LINE_AA, SUBPIXEL)

    def text(self, words, where, *, size=1.0):
        cv2.putText(
            self.grey,
            words,
            tuple(int(v) for v in self.at(where) / 2**SUBPIXEL),
            cv2.FONT_HERSHEY_SIMPLEX,
            size,
            60,
            2,
            cv2.LINE_AA,
        )

    def ink(self, boxes=None):
        soft = cv2.GaussianBlur(self.grey, (0, 0), 0.6)
        noisy = np.clip(soft + noise(), 0, 255).astype(np.uint8)
        sheet = Sheet(
            mm_to_px=self.matrix,
            page_mm=(420.0, 297.0),
            method="combined",
            px_per_mm=PX_PER_MM,
            rotation_deg=0.0,
            residual_mm=0.0,
            scale_se=1e-3,
            drawable_mm=(20.0, 10.0, 390.0, 277.0),
        )
        return find_ink(Page("a.png", 1, noisy), sheet, boxes)


def along(strokes, start, end, *, within_mm=0.3, turn_deg=2.0):
    """Rows of strokes on a line, with offset at its middle (mm), turn (deg) and share covered."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = np.hypot(*(end - start))
    u = (end - start) / length
    v = np.array([-u[1], u[0]])
    t, d = (strokes.ends - start) @ u, (strokes.ends - start) @ v
    span = strokes.ends[:, 1] - strokes.ends[:, 0]
    turn = (np.degrees(np.arctan2(span @ v, span @ u)) + 90) % 180 - 90
    low, high = np.clip(t.min(1), 0, length), np.clip(t.max(1), 0, length)
    middle = d[:, 0] + (length / 2 - t[:, 0]) * np.tan(np.radians(turn))
    near = (np.abs(d.mean(1)) < within_mm) & (np.abs(turn) < turn_deg) & (high - low > 0.15 * length)
    return [(int(row), middle[row], turn[row], (high - low)[row] / length) for row in np.flatnonzero(near)]


def only_stroke(strokes, start, end):
    """The one stroke that covers a line; fails where it is missing or in pieces."""
    found = along(strokes, start, end)
    assert len(found) == 1, found
    assert found[0][3] > 0.9
    return found[0]


SEGMENTS = [((50, 50), (120, 83)), ((150, 60), (150, 130)), ((60, 200), (140, 200)), ((200, 100), (203, 96))]


def test_a_line_is_one_stroke_on_its_centre_line():
    paper = Paper()
    for start, end in SEGMENTS:
        paper.line(start, end)
    strokes = paper.ink().strokes
    assert len(strokes) == len(SEGMENTS)
    for start, end in SEGMENTS[:3]:
        row, off, turn, _ = only_stroke(strokes, start, end)
        assert abs(off) < CENTRE_MM
        assert abs(turn) < DIRECTION_DEG
        assert strokes.width[row] == pytest.approx(PEN_MM + 1 / PX_PER_MM, abs=0.1)
        truth = sorted([start, end])
        assert np.abs(np.array(sorted(strokes.ends[row].tolist())) - truth).max() < END_MM


def test_a_short_stroke_in_a_cluster_is_found():
    paper = Paper()
    lines = [
        ((200, 100), (204, 103)),
        ((204, 103), (206, 99)),
        ((206, 99), (240, 140)),
        ((200, 100), (235, 70)),
    ]
    for start, end in lines:
        paper.line(start, end)
    strokes = paper.ink().strokes
    for start, end in lines:
        assert max(share for *_, share in along(strokes, start, end, turn_deg=5)) > 0.7


@pytest.mark.parametrize("apart_mm", [0.7, 1.2])
def test_two_strokes_side_by_side_stay_two(apart_mm):
    paper = Paper()
    paper.line((60, 150), (150, 190), pen=0.3)
    paper.line((100, 100), (150, 110), pen=0.3)
    paper.line((100, 100 + apart_mm), (150, 110 + apart_mm), pen=0.3)
    strokes = paper.ink().strokes
    for shift in (0.0, apart_mm):
        found = along(strokes, (100, 100 + shift), (150, 110 + shift), within_mm=0.2)
        assert max(share for *_, share in found) > 0.9


def test_strokes_that_part_at_a_small_angle_stay_two():
    paper = Paper()
    ends = ((180, 118), (180, 123))
    for end in ends:
        paper.line((100, 100), end)
    strokes = paper.ink().strokes
    for end in ends:
        _, off, turn, _ = max(along(strokes, (100, 100), end), key=lambda one: one[3])
        assert abs(off) < 3 * CENTRE_MM
        assert abs(turn) < 3 * DIRECTION_DEG


def test_a_dashed_line_is_one_stroke_with_gaps():
    paper = Paper()
    start, end = np.array([60.0, 60.0]), np.array([130.0, 90.0])
    u = (end - start) / np.hypot(*(end - start))
    for first in np.arange(0, 74, 4.2):
        paper.line(start + first * u, start + (first + 3.0) * u)
    strokes = paper.ink().strokes
    only_stroke(strokes, start, end)


def test_a_vector_over_its_construction_line_ends_where_it_is_dark():
    paper = Paper()
    paper.line((100, 100), (200, 140), dark=190, pen=0.25)
    vector = (np.array([130.0, 112.0]), np.array([170.0, 128.0]))
    paper.line(*vector, dark=60)
    strokes = paper.ink().strokes
    dark = [row for row, *_ in along(strokes, *vector) if strokes.darkness[row] > 0.5]
    assert len(dark) == 1
    ends = np.array(sorted(strokes.ends[dark[0]].tolist()))
    assert np.hypot(*(ends - np.array(vector)).T).max() < 2 * END_MM


def test_a_faint_line_is_found_with_its_darkness():
    paper = Paper()
    paper.line((100, 100), (200, 140), dark=200, pen=0.25)
    paper.line((100, 180), (200, 220), dark=60)
    strokes = paper.ink().strokes
    faint, *_ = only_stroke(strokes, (100, 100), (200, 140))
    dark, *_ = only_stroke(strokes, (100, 180), (200, 220))
    assert strokes.darkness[faint] < 0.4 * strokes.darkness[dark]


def test_standard_errors_of_hand_drawn_lines_are_honest():
    rng = np.random.default_rng(5)
    paper = Paper()
    lines = [
        ((40 + 8 * i, 40), (60 + 8 * i + rng.uniform(-9, 9), 40 + rng.uniform(20, 90))) for i in range(24)
    ]
    for start, end in lines[::2]:
        paper.wobbly(start, end, rng)
    strokes = paper.ink().strokes
    found = [along(strokes, start, end)[0] for start, end in lines[::2]]
    off = np.array([off / strokes.se_offset[row] for row, off, _, _ in found])
    turn = np.array([np.radians(turn) / strokes.se_angle[row] for row, _, turn, _ in found])
    for ses in (off, turn):
        assert np.abs(ses).max() < MANY_SES
        assert np.sqrt(np.mean(ses**2)) > 0.2


@pytest.mark.parametrize("radius", [1.0, 1.5, 2.5, 3.8])
def test_a_joint_is_a_circle_and_links_stop_short_of_it(radius):
    paper = Paper()
    joint = np.array([150.0, 120.0])
    paper.ring(joint, radius)
    for angle in (0.4, 2.0, 4.1):
        u = np.array([np.cos(angle), np.sin(angle)])
        paper.line(joint + radius * u, joint + 50 * u)
    ink = paper.ink()
    assert ink.circles.shape == (1, 3)
    assert np.abs(ink.circles[0] - [*joint, radius]).max() < 0.1
    assert len(ink.strokes) == 3
    assert np.hypot(*(ink.strokes.ends - joint).reshape(-1, 2).T).min() > radius - 0.6


def test_a_small_ring_with_the_compass_point_in_it_is_a_circle():
    paper = Paper()
    paper.ring((150, 120), 0.85)
    paper.line((149.93, 120), (150.07, 120), pen=0.14)
    for end in ((190, 120), (140, 170)):
        u = (np.array(end) - [150, 120]) / np.hypot(*(np.array(end) - [150, 120]))
        paper.line([150, 120] + 0.85 * u, end)
    circles = paper.ink().circles
    assert circles.shape == (1, 3)
    assert np.abs(circles[0] - [150, 120, 0.85]).max() < 0.1


def test_a_loop_of_a_letter_beside_a_line_is_no_circle():
    paper = Paper()
    paper.line((110, 123), (190, 123))
    for column, word in enumerate(("a", "b", "d", "g", "6", "8", "B", "D")):
        paper.text(word, (115 + 9 * column, 121.5), size=0.8)
    assert len(paper.ink().circles) == 0


def test_a_joint_with_links_through_it_is_a_circle():
    paper = Paper()
    paper.ring((150, 120), 1.8)
    paper.line((110, 110), (190, 130))
    paper.line((150, 120), (140, 170))
    ink = paper.ink()
    assert ink.circles.shape == (1, 3)
    assert np.abs(ink.circles[0] - [150, 120, 1.8]).max() < 0.15


def head(paper, tip, direction_rad, *, filled, length=3.2, half_deg=14):
    back = [
        np.asarray(tip) - length * np.array([np.cos(direction_rad + turn), -np.sin(direction_rad + turn)])
        for turn in np.radians([-half_deg, half_deg])
    ]
    if filled:
        paper.area([tip, *back])
    else:
        for end in back:
            paper.line(tip, end, pen=0.3)


TIP_ERROR_MM = 0.4


@pytest.mark.parametrize("mark", ["filled", "open", "dot"])
@pytest.mark.parametrize("direction_deg", [17, 163, 250])
def test_a_vector_ends_at_its_arrowhead_though_its_line_runs_on(mark, direction_deg):
    paper = Paper()
    direction = np.radians(direction_deg)
    u = np.array([np.cos(direction), -np.sin(direction)])
    tip = np.array([200.0, 140.0])
    paper.line(tip - 45 * u, tip)
    paper.line(tip, tip + 9 * u, pen=0.2, dark=170)
    if mark == "dot":
        turns = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
        paper.area([tip + 0.5 * np.array([np.cos(turn), np.sin(turn)]) for turn in turns])
    else:
        head(paper, tip, direction, filled=mark == "filled")
    ink = paper.ink()
    found = [(sure, abs(place - tip @ u)) for place, sure in tips_at(ink, u)]
    surest = max(found)
    assert surest[1] < TIP_ERROR_MM


def tips_at(ink, u):
    """(place along u, probability) of heads of vectors that point along u."""
    strokes, tips = ink.strokes, ink.tips
    for row, along, kind, sure in zip(tips.stroke, tips.along, tips.kind, tips.sure, strict=True):
        start, end = strokes.ends[row]
        way = (end - start) / np.hypot(*(end - start))
        if abs(way @ u) > 0.99 and kind == (HEAD_AHEAD if way @ u > 0 else HEAD_BACK):
            yield (start + along * way) @ u, sure


def test_letters_and_hatching_are_marks():
    paper = Paper()
    paper.text("Schema cinematica n=12", (60, 60))
    paper.line((100, 150), (160, 150))
    for x in np.arange(102, 160, 2.5):
        paper.line((x, 150), (x - 2, 153), pen=0.25)
    ink = paper.ink()
    only_stroke(ink.strokes, (100, 150), (160, 150))
    assert len(ink.strokes) <= 4
    centres = ink.marks[:, :2] + ink.marks[:, 2:] / 2
    assert ((centres[:, 1] < 70) & (centres[:, 1] > 50)).sum() >= 12
    assert ((centres[:, 1] > 150) & (centres[:, 1] < 154)).sum() >= 15


def test_frame_and_title_block_are_no_drawing_but_a_plan_beside_them_is():
    paper = Paper()
    corners = [(20, 10), (410, 10), (410, 287), (20, 287)]
    for first, second in zip(corners, corners[1:] + corners[:1], strict=True):
        paper.line(first, second, pen=0.6)
    for y in (257, 267, 277):
        paper.line((260, y), (410, y))
    for x in (260, 330):
        paper.line((x, 257), (x, 287))
    paper.text("Nume", (265, 265))
    paper.line((225, 200), (300, 250))
    paper.line((225, 200), (255, 262))
    strokes = paper.ink().strokes
    assert len(strokes) == 2
    only_stroke(strokes, (225, 200), (300, 250))


def test_only_the_boxes_asked_for_are_looked_at():
    paper = Paper()
    paper.line((50, 50), (90, 70))
    paper.line((250, 50), (290, 70))
    strokes = paper.ink(boxes=[(30, 30, 100, 100)]).strokes
    assert len(strokes) == 1
    only_stroke(strokes, (50, 50), (90, 70))


def test_a_sheet_upside_down_reads_the_same():
    found = []
    for half_turn in (False, True):
        paper = Paper(half_turn=half_turn)
        paper.line((50, 50), (120, 83))
        paper.ring((200, 100), 1.5)
        paper.line((200, 101.5), (200, 160))
        found.append(paper.ink())
    upright, turned = found
    assert len(upright.strokes) == len(turned.strokes) == 2
    assert np.abs(upright.circles - turned.circles).max() < 0.05
    assert np.abs(upright.where.ink.astype(int) - turned.where.ink).mean() < 2
    assert upright.where.ink.shape == (297 * 6, 420 * 6)
    assert upright.where.ink[6 * 130, 6 * 200] > 100
    assert upright.where.ink[6 * 130, 6 * 204] < 30


def test_an_empty_sheet_has_no_ink():
    ink = Paper().ink()
    assert (len(ink.strokes), len(ink.circles), len(ink.tips)) == (0, 0, 0)


FLOOR = {"pump-clean/s04.jpg": 0.9, "pump-copy/s04.png": 0.9, "pump-flatbed/s11.jpg": 0.85}
"""Least share of vectors of 3 mm and more with one stroke along 70 % of them."""


@pytest.mark.skipif(not (SHARED / "sheets").is_dir(), reason="the folder ../shared/sheets is absent")
@pytest.mark.parametrize("name", sorted(FLOOR))
def test_strokes_of_others_drawings_are_found(name):
    folder, file = name.split("/")
    lines = (SHARED / "sheets" / folder / "truth.jsonl").read_text().splitlines()
    truth = next(one for one in map(json.loads, lines) if one["class_file"] == file)
    page = page_of(SHARED / "sheets" / name, 1)
    sheet = replace(rectify(page), mm_to_px=np.array(truth["homography"]))
    strokes = find_ink(page, sheet).strokes
    drawn = [
        vector["line_mm"]
        for figure in truth["figures"].values()
        for vector in figure.get("vectors", {}).values()
        if vector.get("line_mm") and vector["length_mm"] >= 3
    ]
    covered = [max((one[3] for one in along(strokes, *line)), default=0.0) for line in drawn]
    assert np.mean(np.array(covered) >= 0.7) >= FLOOR[name]


BAND_MM = 0.06
LONG_MM, SHORT_MM = 60.0, 34.0
"""Two vectors from one pole that part by 0.35 mm where the shorter one ends: one band of ink."""


def pole_with_two_vectors():
    paper = Paper()
    pole, turn = np.array([60.0, 120.0]), 0.35 / SHORT_MM
    lines = [
        (pole, pole + np.array([LONG_MM, 0.0])),
        (pole, pole + SHORT_MM * np.array([np.cos(turn), np.sin(turn)])),
    ]
    for start, end in lines:
        paper.line(start, end)
    return paper.ink().strokes, lines


def test_a_stroke_is_led_through_the_band_that_it_shares_to_the_pole():
    strokes, (long, _) = pole_with_two_vectors()
    whole = [found for found in along(strokes, *long, within_mm=0.1, turn_deg=0.3) if found[3] > 0.97]
    assert len(whole) == 1
    row, off, turn, _ = whole[0]
    assert abs(off) < BAND_MM
    assert abs(np.radians(turn)) * LONG_MM / 2 < BAND_MM
    assert abs(off) < MANY_SES * strokes.se_offset[row]


def test_a_crossing_short_of_the_pole_does_not_lead_a_stroke_on():
    paper = Paper()
    paper.line((60, 100), (90, 100))
    paper.line((90, 80), (90, 120))
    strokes = paper.ink().strokes
    row, _, _, _ = only_stroke(strokes, (60, 100), (90, 100))
    assert strokes.ends[row, :, 0].max() < 90 + END_MM


def test_a_stroke_seen_alone_at_one_end_only_is_known_the_less_at_the_other():
    strokes, (long, _) = pole_with_two_vectors()
    paper = Paper()
    paper.line(*long)
    alone = paper.ink().strokes
    row = next(found[0] for found in along(strokes, *long, within_mm=0.1) if found[3] > 0.97)
    assert strokes.se_angle[row] > alone.se_angle[only_stroke(alone, *long)[0]]


def refusal(paper):
    ink = paper.ink()
    assert isinstance(ink, Unread)
    assert not ink
    return message(ink.reason)


def test_noise_has_more_strokes_than_a_drawing():
    paper = Paper()
    paper.grey = np.where(np.random.default_rng(4).random(SHAPE) < 0.5, 245, 20).astype(np.uint8)
    paper.grey = cv2.resize(paper.grey[::6, ::6], SHAPE[::-1], interpolation=cv2.INTER_NEAREST)
    reason = refusal(paper)
    assert "straight strokes" in reason
    assert "greyscale" in reason


def test_a_negative_is_refused_by_its_darkness():
    paper = Paper()
    for start, end in SEGMENTS:
        paper.line(start, end)
    assert len(paper.ink().strokes) == len(SEGMENTS)
    paper.grey = 255 - paper.grey
    assert "inverted" in refusal(paper)


def test_strokes_are_counted_before_any_is_fitted(monkeypatch):
    monkeypatch.setattr("grader.scan.strokes.ink._MOST_STROKES", 100)
    paper = Paper()
    for row in range(10):
        paper.line((60, 30 + 5 * row), (100 + 7 * row, 60 + 6 * row))
    assert len(paper.ink().strokes) == 10
    for x, y in np.ndindex(12, 12):
        paper.line((180 + 15 * x, 30 + 15 * y), (190 + 15 * x, 34 + 15 * y))
    monkeypatch.setattr("grader.scan.strokes.ink.fit_centre", lambda *_: pytest.fail("strokes were fitted"))
    assert "straight strokes" in refusal(paper)


@pytest.mark.parametrize("pitch", [5, *slow(1)])
def test_squares_that_were_taken_out_are_no_strokes(pitch):
    paper = Paper()
    for step in range(0, 420, pitch):
        paper.line((step, 0), (step, 297), pen=0.12, dark=190)
    for step in range(0, 297, pitch):
        paper.line((0, step), (420, step), pen=0.12, dark=190)
    for start, end in SEGMENTS:
        paper.line(start, end)
    paper.grey, ruling = without_ruling(paper.grey)
    assert ruling is not None
    strokes = paper.ink().strokes
    assert len(strokes) == len(SEGMENTS)
    for start, end in SEGMENTS:
        only_stroke(strokes, start, end)


TABLE = [((266, y), (410, y)) for y in (240, 255, 270)] + [((266, 240), (266, 287))]


@pytest.mark.parametrize("words", ["Nr. 7", ""])
def test_a_table_without_text_is_no_title_block(words):
    paper = Paper()
    for start, end in TABLE:
        paper.line(start, end)
    paper.text(words, (272, 250))
    assert len(paper.ink().strokes) == (0 if words else len(TABLE))


def test_an_area_larger_than_a_title_block_is_told_where_it_is_left_out():
    paper = Paper()
    for start, end in [
        ((206, 218), (206, 292)),
        ((206, 218), (415, 218)),
        ((206, 240), (415, 240)),
        ((206, 260), (415, 260)),
    ]:
        paper.line(start, end)
    paper.text("Nume", (212, 230))
    assert [problem.code for problem in paper.ink().problems] == ["title_block_unsure"]
