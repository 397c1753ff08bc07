"""Scales, numbers and names written on plain paper, in the simulated hand, which nothing was trained on."""

import cv2
import numpy as np
import pytest

from grader.records import InkMap, Page, Sheet
from grader.scan.handwriting.captions import (
    NUMBER_WORDS,
    captioned_scales,
    spotters,
    written_name,
    written_number,
)
from grader.scan.handwriting.fields import writing
from grader.scan.handwriting.lines import find_lines
from grader.tables.scale_text import SURE, parse_scale
from samples.simulation.lettering import Handwriting, write
from samples.simulation.strokes import PenWidth

UNIT, FINE = 6.0, 12.0
HAND = Handwriting(slant=0.1, aspect=0.9, jitter=0.01, unevenness=0.02, gap=0.24)
PEN = PenWidth("line", 0.4, 0.9, 0.0, 0.0)
NAMES = {
    "s1": ["PopescuAna", "AnaPopescu"],
    "s2": ["PopescuIon", "IonPopescu"],
    "s3": ["RotaruAna", "AnaRotaru"],
}


def page(*texts: str, ruled: bool = False, height_mm: float = 4.0, seed: int = 5):
    """The ink map of a page with lines of writing, in cells or not, and what looks at its pixels."""
    ink = np.zeros((round(100 * FINE), round(200 * FINE)), dtype=np.uint8)
    rng = np.random.default_rng(seed)
    for row, text in enumerate(texts):
        base = complex(20.0, -(20.0 + 11.0 * row))
        for stroke in write(rng, PEN, text, height_mm, HAND).moved(base).strokes:
            at = np.column_stack([stroke.points.real, -stroke.points.imag]) * FINE * 16
            line = [np.rint(at).astype(np.int32)]
            cv2.polylines(ink, line, isClosed=False, color=230, thickness=4, lineType=cv2.LINE_AA, shift=4)
        if ruled:
            left, top, right, bottom = (
                round(side * FINE) for side in (17, 13 + 11 * row, 120, 24 + 11 * row)
            )
            cv2.rectangle(ink, (left, top), (right, bottom), 230, 5)
    return on_paper(ink)


def on_paper(ink):
    size = round(ink.shape[1] * UNIT / FINE), round(ink.shape[0] * UNIT / FINE)
    where = InkMap(cv2.resize(ink, size, interpolation=cv2.INTER_AREA), UNIT)
    sheet = Sheet(
        np.diag([FINE, FINE, 1.0]), (200.0, 100.0), "combined", FINE, 0.0, 0.0, 0.0, (0, 0, 200, 100)
    )
    picture = Page("page.png", 1, 255 - ink)
    return where, lambda box: writing(picture, sheet, box, 0.0)


def scales(*texts: str, names=("kL", "kv", "ka"), **how):
    return captioned_scales(spotters(*page(*texts, **how)), names)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("kL", "k_L = 0.005 m/mm"),
        ("kL", "k_L = 1:5"),
        ("kL", "μ_l = 0,0075 м/мм"),
        ("kv", "k_v = 0,05 (m/s)/mm"),
        ("kv", "k_v = 0.1885 m/s·mm"),
        ("ka", "k_a = 5,615 (m/s^2)/mm"),
        ("ka", "μ_a = 0,1357 (м/с^2)/мм"),
    ],
)
def test_a_scale_behind_its_label_is_read(name, text):
    read = scales(text)
    assert set(read) == {name}
    written = text.replace("_", "").partition("=")[2]
    assert parse_scale(name, read[name].text) == parse_scale(name, written)
    assert read[name].confidence > 0.2


def test_a_ratio_is_the_scale_of_lengths_with_the_word_alone():
    assert scales("Scale 1:5")["kL"].text == "1:5"
    assert scales("5 cm/cm") == {}


def test_scales_in_the_cells_of_a_title_block_are_read():
    read = scales("k_L = 0.005 m/mm", "k_v = 0.05 (m/s)/mm", ruled=True)
    assert {name: one.text.startswith("0.") for name, one in read.items()} == {"kL": True, "kv": True}


def test_only_scales_that_are_asked_for_are_read():
    assert set(scales("k_L = 0.005 m/mm", "k_v = 0.05 (m/s)/mm", names=["kv"])) == {"kv"}


@pytest.mark.parametrize(
    "text", ["v_A = 6,28 m/s", "ω_1 = π n/30 = 35,6", "Planul vitezelor", "Grupa M2-04", "0.005 m/mm"]
)
def test_what_has_no_label_of_a_scale_is_none(text):
    assert all(read.confidence < 0.2 for read in scales(text).values())


def test_two_captions_of_one_scale_support_each_other_and_contradict_each_other():
    once = scales("k_v = 0,05 (m/s)/mm")["kv"]
    twice = scales("k_v = 0,05 (m/s)/mm", "k_v = 0,05 (m/s)/mm")["kv"]
    against = scales("k_v = 0,05 (m/s)/mm", "k_v = 0,08 (m/s)/mm")["kv"]
    assert twice.confidence >= once.confidence
    assert against.confidence < SURE


def number(*texts: str, numbers=range(1, 31)):
    return written_number(spotters(*page(*texts)), numbers, NUMBER_WORDS)


@pytest.mark.parametrize(
    ("text", "n"),
    [
        ("Nr. 7", "7"),
        ("No. 12", "12"),
        ("Вариант 4", "4"),
        ("n = 7", "7"),
        ("Вар. 21", "21"),
        ("Variant 3", "3"),
    ],
)
def test_the_number_behind_its_word_is_read(text, n):
    read = number(text, "Grupa M2-04")
    assert read is not None
    assert read.text == n
    assert read.confidence > 0.5


def test_a_number_that_no_variant_has_is_none():
    found = [number("Nr. 7", numbers=range(10, 20)), number("n = 320")]
    assert all(read is None or read.confidence < 0.2 for read in found)
    assert number("Grupa M2-04") is None


def test_two_numbers_leave_it_open():
    read = number("Nr. 7", "Nr. 4")
    assert read is not None
    assert read.confidence < SURE
    assert {read.text, read.others[0][0]} == {"4", "7"}


@pytest.mark.parametrize(("text", "student"), [("Nume: Popescu Ana", "s1"), ("Ion Popescu", "s2")])
def test_a_name_of_the_roster_is_told_from_others_like_it(text, student):
    found, chance = written_name(spotters(*page("Mecanism", text)), NAMES)
    assert found == student
    assert chance > 0.97


@pytest.mark.parametrize("text", ["Nume: Ursu Vasile", "Nume: Popescu Mihai", "Grupa M2-04"])
def test_a_name_that_is_not_on_the_roster_is_nobodys(text):
    _, chance = written_name(spotters(*page("Mecanism", text)), NAMES)
    assert chance < 0.97


def test_lines_are_found_with_their_powers_and_points_and_without_ruled_lines():
    plain, ruled = (find_lines(*page("k_a = 5,6 (m/s^2)/mm", ruled=ruled)) for ruled in (False, True))
    assert len(plain) == len(ruled) == 1
    assert abs(plain[0].signs.count - ruled[0].signs.count) <= 1
    x, y, wide, high = plain[0].box
    assert (x, y) == (pytest.approx(20.0, abs=1.5), pytest.approx(14.5, abs=2.0))
    assert wide > 5 * high


def test_letters_of_nodes_and_an_empty_page_are_no_lines():
    assert find_lines(*page("A", "B")) == []
    assert find_lines(*on_paper(np.zeros((1200, 1800), np.uint8))) == []


def test_pieces_without_end_are_no_writing():
    grey = np.zeros((2400, 2400), dtype=np.uint8)
    grey[::12, :] = 200
    grey[:, ::7] = 0
    assert find_lines(*on_paper(grey)) == []
