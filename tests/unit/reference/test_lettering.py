"""Names as they are set: indices, widths against the font's own."""

import pytest

from grader.printed.pdf import REGULAR, width_mm
from reference.drawing.canvas import (
    DESCENT,
    pieces_of,
    rise_and_fall,
    scale_pieces,
    set_pieces,
    width_of,
    wrapped,
)

WIDTH_SHARE = 0.02
"""Widths are kept to fiftieths of the letter size; over a word the errors even out."""
POINTS_OF_A_MM = 72.0 / 25.4
LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789'ωεπμφ²°·"
WORDS = (
    "Velocity plan",
    "Planul accelerațiilor",
    "План скоростей",
    "v = 11.62 m/s",
    "ω = 38,75 рад/с",
    LETTERS,
)


@pytest.mark.parametrize("text", WORDS)
def test_a_text_is_as_wide_as_the_font_prints_it(text):
    size = 4.0
    printed = width_mm(text, REGULAR, size * POINTS_OF_A_MM)
    assert width_of(text, size) == pytest.approx(printed, rel=WIDTH_SHARE)


@pytest.mark.parametrize(
    ("name", "pieces"),
    [
        ("o'", [("o'", 0)]),
        ("a3'", [("a", 0), ("3", -1), ("'", 0)]),
        ("O1A", [("O", 0), ("1", -1), ("A", 0)]),
        ("n_BA", [("n", 0), ("BA", -1)]),
        ("a_B3B_c", [("a", 0), ("B3B", -1), ("c", 1)]),
        ("omega_2", [("ω", 0), ("2", -1)]),
        ("epsilon_3", [("ε", 0), ("3", -1)]),
        ("phi_k", [("φ", 0), ("k", -1)]),
        ("ωk", [("ω", 0), ("k", -1)]),
        ("ε2a", [("ε", 0), ("2a", -1)]),
        ("φ(guide B2)", [("φ(guide B", 0), ("2", -1), (")", 0)]),
        ("a_BA_n", [("a", 0), ("BA", -1), ("n", 1)]),
        ("O1A = O2B", [("O", 0), ("1", -1), ("A = O", 0), ("2", -1), ("B", 0)]),
        ("π", [("π", 0)]),
        ("φ", [("φ", 0)]),
    ],
)
def test_a_name_has_its_indices_below_and_above(name, pieces):
    assert [(piece.text, piece.height) for piece in pieces_of(name)] == pieces


@pytest.mark.parametrize(("name", "letters"), [("kL", ["k", "L"]), ("μv", ["μ", "v"]), ("m", ["m"])])
def test_a_scale_has_its_index_below(name, letters):
    assert [piece.text for piece in scale_pieces(name)] == letters


def test_the_index_above_stands_over_the_one_below():
    letter, below, above = set_pieces(pieces_of("a_BA_n"), 4.0)
    assert above.right == below.right > letter.right
    assert above.above > 0.0 > below.above


def test_indices_and_tails_reach_above_and_below_the_line():
    rise, fall = rise_and_fall("a", 4.0)
    assert fall == 0.0
    assert rise_and_fall("p", 4.0)[1] == pytest.approx(DESCENT * 4.0)
    assert rise_and_fall(pieces_of("a_BA_n"), 4.0)[0] > rise
    assert rise_and_fall(pieces_of("v_A"), 4.0)[1] > 0.0


def test_a_long_title_is_broken_where_the_column_ends():
    title = "Press mechanism: plans of velocities and accelerations"
    lines = wrapped(title, 4.0, 60.0)
    assert len(lines) > 1
    assert " ".join(lines) == title
    assert all(width_of(line, 4.0) <= 60.0 for line in lines)
