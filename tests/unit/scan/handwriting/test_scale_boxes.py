"""Scales read in the answer sheet's boxes, written by the simulated hand, which nothing was trained on."""

import cv2
import numpy as np
import pytest

from grader.printed.answer_sheet import make_sheets
from grader.printed.layout import values_of
from grader.records import Page, Sheet, Written
from grader.rubric import rubric_of
from grader.scan.handwriting.fields import moves, read_scale, start, written_numbers, written_scales
from grader.scan.handwriting.model import lattice_of
from grader.scan.register.registration import rectify
from grader.tables.roster import RosterRow
from grader.tables.scale_text import Refused, parse_scale
from reference.authored.assignment import load_assignment
from samples.simulation import CAREFUL, CLEAN_SCAN, PageStyle, Settings, simulate, wording
from samples.simulation.printing import printed_sheets

SURE = 0.9


def walked(name: str, text: str) -> set[bool]:
    """For each path of the state machine that spells a text, whether it may end there; empty without one."""
    states = {(start(name), "")}
    while any(told != text for _, told in states):
        states = {
            (move.state, told + move.text)
            for state, told in states
            for move in moves(name, state)
            if text.startswith(told + move.text)
        }
        if not states:
            return set()
    return {state.is_end for state, _ in states}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("kL", "1:5"),
        ("kL", "0.005m/mm"),
        ("kL", "kL=0,005m/mm"),
        ("kL", "5cm/cm"),
        ("kv", "0,036(m/s)/mm"),
        ("kv", "0.036m/s·mm"),
        ("kv", "ωkL"),
        ("ka", "0.108(m/s2)/mm"),
        ("ka", "ω^2kL"),
        ("ka", "ω2kL=16,59(m/s2)/mm"),
    ],
)
def test_what_people_write_can_be_walked_through_and_is_understood(name, text):
    assert True in walked(name, text)
    assert not isinstance(parse_scale(name, text), Refused)


@pytest.mark.parametrize(
    ("name", "text"), [("kL", "0075m/mm"), ("kL", "0.005m/s"), ("kv", "1:5"), ("kL", "5.m/mm"), ("kL", "ωkL")]
)
def test_what_nobody_means_is_not_spelt(name, text):
    assert True not in walked(name, text)


def test_an_empty_line_holds_nothing():
    assert lattice_of(np.zeros((80, 600), dtype=np.uint8), 12.0).count == 0


def test_a_line_of_scribble_is_not_believed():
    rng = np.random.default_rng(3)
    grey = np.zeros((80, 600), dtype=np.uint8)
    for left in range(20, 560, 45):
        for _ in range(30):
            y, x = rng.integers(8, 70), left + rng.integers(0, 30)
            grey[y - 2 : y + 3, x - 2 : x + 3] = 255
    assert read_scale(lattice_of(grey, 12.0), "kv").confidence < SURE


UNITS = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s^2)/mm"}


def _read_boxes(*units):
    """The scales read in the boxes of a student's printed sheets by each of some units, and those there."""
    assignment = load_assignment("pump")
    document = make_sheets(assignment, [RosterRow("s1", "Student 1", n=6)], "en")
    printed = printed_sheets(document.pdf, document.layout)
    settings = Settings(hand=CAREFUL, scan=CLEAN_SCAN, page=PageStyle(language="en", decimal_comma=True))
    found = []
    for drawn in simulate(assignment, assignment.variant(6), 3, settings, printed=printed):
        page = Page("s.png", 1, np.ascontiguousarray(drawn.image), (300.0, 300.0))
        placed = rectify(page)
        assert isinstance(placed, Sheet)
        read = [written_scales(page, placed, one) for one in units]
        found.append((*read, drawn.truth["scales"]["written"]))
    return found


@pytest.fixture(scope="module")
def sheets():
    return _read_boxes(None)


def test_a_bare_number_is_a_scale_where_the_assignment_says_its_unit(monkeypatch):
    monkeypatch.setattr(wording, "scale_text", lambda _name, value, *_rest: f"{value:.4f}")
    told = 0
    for read, bare, written in _read_boxes(UNITS, None):
        assert all(one.confidence < SURE for one in bare.values())
        for name, text in written.items():
            if read[name].confidence >= SURE:
                told += 1
                assert parse_scale(name, read[name].text, bare_unit=UNITS[name]) == parse_scale(
                    name, text, bare_unit=UNITS[name]
                )
    assert told >= 1


def test_what_is_surely_read_is_what_was_written(sheets):
    told = 0
    for read, written in sheets:
        for name, text in written.items():
            assert name in read
            if read[name].confidence >= SURE:
                told += 1
                assert parse_scale(name, read[name].text) == parse_scale(name, text)
    assert told >= 1


def test_boxes_that_the_page_does_not_have_are_not_looked_at(sheets):
    for read, written in sheets:
        assert read.keys() <= written.keys()
        assert all(isinstance(one, Written) for one in read.values())


def test_computed_values_written_in_a_sheets_cells_are_read_as_they_were_written():
    press = load_assignment("press")
    entries = rubric_of(press).entries
    document = make_sheets(press, [RosterRow("s1", "Student 1", position=3)], "en", asked=entries)
    printed = printed_sheets(document.pdf, document.layout)
    settings = Settings(hand=CAREFUL, scan=CLEAN_SCAN, page=PageStyle(language="en"))
    drawn = simulate(press, press.variant(None, 3), 3, settings, printed=printed, most=1)[0]
    page = Page("s.png", 1, np.ascontiguousarray(drawn.image), (300.0, 300.0))
    placed = rectify(page)
    assert isinstance(placed, Sheet)
    places = values_of(press, tuple(placed.zones), entries)
    read = written_numbers(page, placed, {}, places)
    written = {f"{name}_value": float(drawn.truth["fields"][f"{name}_value"]) for name in places}
    right = [name for name, (value, _) in read.items() if value == pytest.approx(written[name])]
    assert len(written) == 5
    assert len(right) >= 4
    assert all(read[name][1] < SURE for name in written.keys() - right)


@pytest.mark.parametrize(
    ("ticked", "sense", "sign", "sure"),
    [((), 0.0, 1.0, True), ((0,), 1.0, 1.0, True), ((1,), -1.0, -1.0, True), ((0, 1), 1.0, 1.0, False)],
)
def test_a_moment_in_a_sheets_cells_has_the_sense_that_is_ticked(ticked, sense, sign, sure):
    pump = load_assignment("pump-forces")
    entries = rubric_of(pump).entries
    document = make_sheets(pump, [RosterRow("s1", "Student 1", 7)], "en", asked=entries)
    grey = printed_sheets(document.pdf, document.layout)["forces"].background.grey.copy()
    place = document.layout.pages[0].values["M_b"]

    def stroke(box, *ends):
        x, y, w, h = box
        points = [(round((x + u * w) * 300 / 25.4), round((y + v * h) * 300 / 25.4)) for u, v in ends]
        cv2.polylines(grey, [np.array(points)], isClosed=False, color=40, thickness=5)

    for cell in place.cells[1:]:
        stroke(cell, (0.25, 0.2), (0.75, 0.2), (0.45, 0.85))  # a seven
    for k in ticked:
        stroke(place.senses[k], (0.2, 0.5), (0.4, 0.75), (0.8, 0.2))
    page = Page("s.png", 1, grey, (300.0, 300.0))
    placed = rectify(page)
    assert isinstance(placed, Sheet)
    read = written_numbers(page, placed, {}, values_of(pump, tuple(placed.zones), entries))
    assert read.keys() == {"M_b_value", "M_b_sense"}
    assert read["M_b_value"][0] == sign * 777.0
    assert read["M_b_sense"][0] == sense
    assert (read["M_b_sense"][1] > SURE) == sure
