"""``planmark plan`` as it draws: files, languages, the steps, the altitude construction, wrong calls."""

import xml.etree.ElementTree as ET

import pypdfium2
import pytest

from tests.functional.conftest import run

A3_POINTS = (420.0 / 25.4 * 72.0, 297.0 / 25.4 * 72.0)
A4_POINTS = (210.0 / 25.4 * 72.0, 297.0 / 25.4 * 72.0)
POINT = 0.01


@pytest.mark.parametrize("call", ["pump --n 7", "press --position 0"])
def test_the_drawing_is_a_document_of_a3_pages(planmark, tmp_path, call):
    ran = planmark("plan", *call.split(), "--pdf", "plan.pdf")
    assert ran.returncode == 0, ran.stderr
    for page in pypdfium2.PdfDocument(tmp_path / "plan.pdf"):
        assert page.get_size() == pytest.approx(A3_POINTS, abs=POINT)


def test_drawing_steps_and_table_speak_the_language_asked_for(planmark, tmp_path):
    ran = planmark("plan", "pump", "--n", 7, "--lang", "ro", "--svg", "plan.svg", "--steps", "steps.html")
    assert ran.returncode == 0, ran.stderr
    drawing = "".join(ET.parse(tmp_path / "plan.svg").getroot().itertext())
    assert "Planul vitezelor" in drawing
    assert "0,19373" in drawing
    steps = (tmp_path / "steps.html").read_text(encoding="utf-8")
    assert "Marcați polul" in steps
    assert "planmark:" not in ran.stderr
    assert ran.stdout.count("desenul este în") == 2


def test_a_drawing_is_the_same_in_every_run(tmp_path):
    for seed in ("1", "2"):
        call = ("plan", "press-forces", "--position", 2, "--svg", f"{seed}.svg")
        assert run(tmp_path, *call, PYTHONHASHSEED=seed).returncode == 0
    assert (tmp_path / "1.svg").read_bytes() == (tmp_path / "2.svg").read_bytes()


def test_steps_are_printed_on_a4(planmark, tmp_path):
    assert planmark("plan", "press", "--position", 1, "--steps", "steps.pdf").returncode == 0
    document = pypdfium2.PdfDocument(tmp_path / "steps.pdf")
    assert document[0].get_size() == pytest.approx(A4_POINTS, abs=POINT)


def test_the_altitude_construction_is_drawn_where_the_scales_allow_it(planmark, tmp_path):
    assert planmark("plan", "pump", "--n", 7, "--altitude", "--svg", "plan.svg").returncode == 0
    letters = ["".join(text.itertext()) for text in ET.parse(tmp_path / "plan.svg").getroot().iter()]
    assert {"d''", "d'''", "dIV", "b''BA", "bBIV"} <= set(letters)
