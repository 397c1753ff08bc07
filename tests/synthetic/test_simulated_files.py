"""Simulated sheets as files: the program's intake reads back what was made."""

from dataclasses import replace

import numpy as np
import pikepdf
import pytest
from PIL import Image

from grader.printed.answer_sheet import make_sheets
from grader.tables.roster import RosterRow
from reference.authored.assignment import load_assignment
from samples.simulation import Scan, Settings, Student, blank_back, simulate, write_pdf
from samples.simulation.printing import printed_sheets

pytestmark = pytest.mark.slow
SMALL = Scan(dpi=40.0, dpi_tag=40.0)


@pytest.fixture(scope="module")
def assignment():
    return load_assignment("pump")


@pytest.mark.parametrize(
    ("container", "mode", "opened_as"),
    [
        ("jpg", "grey", "L"),
        ("jpg", "colour", "RGB"),
        ("png", "grey", "L"),
        ("png", "bilevel", "1"),
        ("tif", "bilevel", "1"),
        ("tif", "colour", "RGB"),
    ],
)
def test_a_file_keeps_size_kind_and_stated_resolution(tmp_path, assignment, container, mode, opened_as):
    scan = replace(SMALL, container=container, mode=mode)
    sheet = simulate(assignment, assignment.variant(1), 2, Settings(scan=scan))[0]
    path = sheet.save(tmp_path / "s1.two")
    assert path.name == f"s1.two.{container}"
    assert sheet.truth["file"] == path.name
    with Image.open(path) as picture:
        assert list(picture.size) == sheet.truth["image_size"]
        assert picture.mode == opened_as
        assert float(picture.info["dpi"][0]) == pytest.approx(40.0, abs=0.01)


def test_a_file_may_be_silent_about_its_resolution(tmp_path, assignment):
    scan = replace(SMALL, dpi_tag=None, container="png")
    path = simulate(assignment, assignment.variant(1), 2, Settings(scan=scan))[0].save(tmp_path / "s1")
    with Image.open(path) as picture:
        assert "dpi" not in picture.info


def test_a_phone_says_by_exif_how_to_turn_its_picture(tmp_path, assignment):
    scan = replace(SMALL, device="phone", quarter_turns=1, mode="colour")
    path = simulate(assignment, assignment.variant(1), 2, Settings(scan=scan))[0].save(tmp_path / "s1")
    with Image.open(path) as picture:
        assert picture.getexif()[0x0112] == 6  # turn clockwise


def test_a_class_pdf_holds_fronts_and_blank_backs_at_their_size(tmp_path, assignment):
    sheets = simulate(assignment, assignment.variant(1), 2, Settings(scan=SMALL, student=Student(sheets=2)))
    rng = np.random.default_rng(1)
    pages = []
    for sheet in sheets:
        pages += [(sheet.image, 40.0, 0), (blank_back(SMALL, sheet.image.shape[:2], rng), 40.0, 0)]
    write_pdf(tmp_path / "class.pdf", pages)
    with pikepdf.open(tmp_path / "class.pdf") as document:
        assert len(document.pages) == 4
        width, height = (float(v) / 72 * 25.4 for v in document.pages[0].MediaBox[2:])
    assert width == pytest.approx(420.0, abs=13.0)
    assert height == pytest.approx(297.0, abs=10.0)


def test_a_printed_sheet_is_drawn_on_inside_its_zones(assignment):
    document = make_sheets(assignment, [RosterRow("s1", "Student 1", n=6)], "en")
    printed = printed_sheets(document.pdf, document.layout)
    sheets = simulate(assignment, assignment.variant(6), 3, Settings(scan=SMALL), printed=printed)
    assert [sheet.truth["kind"] for sheet in sheets] == ["velocity", "acceleration"]
    for sheet in sheets:
        zones = printed[sheet.truth["kind"]].zones
        for name, figure in sheet.truth["figures"].items():
            x, y, w, h = zones[name]
            for node_x, node_y in figure["nodes"].values():
                assert x < node_x < x + w
                assert y < node_y < y + h
        assert {"kL", "v_A" if sheet.truth["kind"] == "velocity" else "a_A"} <= set(sheet.truth["fields"])
