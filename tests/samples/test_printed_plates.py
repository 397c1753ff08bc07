"""Printed plates of 1911 and 1885: their strokes, corners, directions and letters, at an assumed scale.

The plates are 100 to 450 pixels wide and no sheets of ours, so that a scale is assumed (4 pixels to the
millimetre) and nothing is said of lengths. What must hold is a law: the sides of a velocity polygon are
perpendicular to the links. Both engravers turned the polygon against the mechanism as a whole, by 5 and
by 12 degrees, so that the law holds after one turn common to all sides. Corners are where fitted strokes
meet; they were clicked by hand in pictures twice as large, to a pixel.

Not read on the plate of 1885: the letters b with primes and numbers, which touch their strokes, and the
chain lines of the acceleration diagram's short sides. Two radii of its velocity diagram that run nearly
straight on through the pole (b1 p b3, and b5 p b4) are one stroke each. Its radius p b2, 39 pixels long
under its letter, comes out 3 degrees off, and the corner b2 with it 2.4 pixels: not asserted.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from grader.records import Sheet
from grader.scan.decode.pages import page_of
from grader.scan.handwriting.letters import find_letters
from grader.scan.strokes.ink import find_ink

PLATES = Path(__file__).resolve().parents[3] / "shared" / "real" / "eb1911"
PX_PER_MM = 4.0
CLICK_PX, DIRECTION_DEG = 2.0, 2.0
CROSSING = 0.5
"""Sine of an angle from which strokes settle their corner; sharper ones do so as much less."""
SHORT_CRANK_DEG = 3.0
"""The crank of 1885 is 33 pixels long: a pixel is 1.7 degrees."""
NEAR_PX = 18.0
"""Largest distance of a printed letter's middle from its node."""
SHARE = 0.05
"""An engraver's error of where x divides bc."""

FOUR_BAR = {
    "A": (11.0, 183.5), "B": (25.3, 145.0), "C": (126.5, 104.7), "D": (178.5, 183.5), "X": (94.5, 117.0),
    "O": (264.5, 68.0), "b": (401.5, 135.0), "c": (365.5, 10.0), "x": (378.0, 52.5),
}  # fmt: skip
FERGUSON = {
    "P1": (250.0, 189.0), "A1": (236.5, 158.5), "B1": (353.5, 137.5), "P2": (416.5, 245.0),
    "p": (111.0, 159.0), "a1": (24.3, 174.0), "b1": (24.3, 187.0), "a2": (79.5, 243.0), "b2": (78.5, 181.0),
    "a3": (186.0, 203.0), "b3": (166.0, 141.0), "a4": (174.0, 111.0), "b4": (193.0, 154.0),
    "a5": (57.0, 96.0), "b5": (57.5, 161.5),
}  # fmt: skip


@pytest.fixture(scope="module")
def ink_of():
    if not PLATES.is_dir():
        pytest.skip("the plates are not here")
    found = {}
    for name in ("img1009a.jpg", "fig-33.jpg"):
        page = page_of(PLATES / name, 1)
        size = page.grey.shape[1] / PX_PER_MM, page.grey.shape[0] / PX_PER_MM
        scale = np.array([[PX_PER_MM, 0.0, -0.5], [0.0, PX_PER_MM, -0.5], [0.0, 0.0, 1.0]])
        sheet = Sheet(scale, size, "combined", PX_PER_MM, 0.0, 0.0, 0.0, (0.0, 0.0, *size))
        found[name] = find_ink(page, sheet)
    return found


def stroke_along(ink, tail, head):
    """The longest stroke on the line between two clicked corners, as (a point, a unit vector), pixels."""
    way = np.subtract(head, tail)
    u = way / np.hypot(*way)
    ends = ink.strokes.ends * PX_PER_MM - 0.5
    off = np.abs((ends - tail) @ np.array([-u[1], u[0]])).max(axis=1)
    span = np.sort(np.clip((ends - tail) @ u / np.hypot(*way), 0.0, 1.0), axis=1)
    drawn = np.where(off < CLICK_PX + 1.0, span[:, 1] - span[:, 0], 0.0)
    best = int(drawn.argmax())
    assert drawn[best] > 0.5, f"no stroke from {tail} to {head}"
    d = ends[best, 1] - ends[best, 0]
    return ends[best, 0], d / np.hypot(*d) * np.sign(d @ u)


def meeting(one, other):
    (p, u), (q, v) = one, other
    return p + np.linalg.solve(np.column_stack([u, -v]), q - p)[0] * u


def direction_deg(stroke):
    return np.degrees(np.arctan2(-stroke[1][1], stroke[1][0]))


def turns_deg(ink, at, pairs):
    """By how much each side of a velocity polygon is turned against the perpendicular to its link."""
    turned = []
    for side, link in pairs:
        found = [direction_deg(stroke_along(ink, at[tail], at[head])) for tail, head in (side, link)]
        turned.append((found[0] - found[1]) % 180.0 - 90.0)
    return np.array(turned)


@pytest.mark.parametrize(
    ("plate", "at", "around"),
    [
        ("img1009a.jpg", FOUR_BAR, ["A", "B", "C", "D", "A"]),
        ("img1009a.jpg", FOUR_BAR, ["O", "b", "c", "O"]),
        ("img1009a.jpg", FOUR_BAR, ["O", "x", "b", "O"]),
        ("fig-33.jpg", FERGUSON, ["P1", "A1", "B1", "P2", "P1"]),
        *(("fig-33.jpg", FERGUSON, ["p", f"a{k}", f"b{k}", "p"]) for k in (1, 3, 4, 5)),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, list) else "",
)
def test_the_corners_of_a_polygon_are_where_its_strokes_meet(ink_of, plate, at, around):
    sides = [stroke_along(ink_of[plate], at[tail], at[head]) for tail, head in pairwise(around)]
    for corner, before, after in zip(around, [sides[-1], *sides], sides, strict=False):
        u, v = before[1], after[1]
        sharp = min(1.0, abs(u[0] * v[1] - u[1] * v[0]) / CROSSING)
        assert np.hypot(*(meeting(before, after) - at[corner])) < CLICK_PX / sharp, corner


def test_the_velocity_polygon_of_1911_is_perpendicular_to_the_links_after_one_turn(ink_of):
    sides = [("Ob", "AB"), ("Oc", "DC"), ("bc", "BC")]
    turned = turns_deg(ink_of["img1009a.jpg"], FOUR_BAR, sides)
    assert np.abs(turned - turned.mean()).max() < DIRECTION_DEG


def test_the_velocity_polygon_of_1885_is_perpendicular_to_the_links_after_one_turn(ink_of):
    sides = [(("p", "a1"), ("P1", "A1")), (("p", "b1"), ("P2", "B1")), (("a1", "b1"), ("A1", "B1"))]
    turned = turns_deg(ink_of["fig-33.jpg"], FERGUSON, sides)
    assert np.abs(turned - turned.mean()).max() < SHORT_CRANK_DEG


def test_x_divides_bc_as_the_point_x_divides_the_coupler(ink_of):
    ink = ink_of["img1009a.jpg"]
    to_x, to_b, to_c, side = (
        stroke_along(ink, FOUR_BAR[tail], FOUR_BAR[head]) for tail, head in ("Ox", "Ob", "Oc", "bc")
    )
    b, x, c = (meeting(ray, side) for ray in (to_b, to_x, to_c))
    coupler = np.hypot(*np.subtract(FOUR_BAR["C"], FOUR_BAR["B"]))
    share = np.hypot(*np.subtract(FOUR_BAR["X"], FOUR_BAR["B"])) / coupler
    assert np.hypot(*(x - b)) / np.hypot(*(c - b)) == pytest.approx(share, abs=SHARE)


@pytest.mark.parametrize("letter", FOUR_BAR)
def test_the_letters_of_1911_are_read_beside_their_nodes(ink_of, letter):
    letters = find_letters(ink_of["img1009a.jpg"], None)
    away = np.abs(letters.at * PX_PER_MM - complex(FOUR_BAR[letter][0], -FOUR_BAR[letter][1]))
    likeliest = letters.probability[away < NEAR_PX].argmax(axis=1)
    assert letters.column[letter] in likeliest
