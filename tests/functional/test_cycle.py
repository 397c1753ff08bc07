"""``planmark cycle``: extremes, table, diagram."""

import csv
import io
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from grader.language import tongue
from reference.authored.assignment import library, load_assignment
from reference.kinematics.motion import move
from tests.examples import slow

ROUNDING = 1e-12
PRINTED = 5e-6
"""Relative: six digits are printed."""


def table(text, delimiter=","):
    """Columns by their heads: the notes as they are, numbers as numbers, nan for blanks."""
    head, *rows = csv.reader(io.StringIO(text), delimiter=delimiter)
    columns = dict(zip(head, zip(*rows, strict=True), strict=True))
    notes = columns.pop("note")
    numbers = {name: [float(cell.replace(",", ".") or "nan") for cell in columns[name]] for name in columns}
    return {**numbers, "note": notes}


def row_of(ran, name):
    """The cells of a row of the printed table."""
    return next(line.split() for line in ran.stdout.splitlines() if line.split()[:1] == [name])


def test_the_csv_holds_the_closed_form_of_every_position_to_the_last_digit(planmark, tmp_path):
    ran = planmark(
        "cycle", "press", "--position", 1, "--csv", "c.csv", "--of", "v_B,a_D_x,omega_2,epsilon_4,D"
    )
    assert ran.returncode == 0
    assert ran.stderr == ""
    text = (tmp_path / "c.csv").read_bytes().decode()
    head = (
        "crank angle [deg],v_B [m/s],a_D_x [m/s^2],omega_2 [rad/s],epsilon_4 [rad/s^2],x_D [m],y_D [m],note"
    )
    assert text.splitlines()[0] == head
    assert text.count("\r\n") == 362
    told = table(text)
    assert told["crank angle [deg]"] == pytest.approx(range(361), abs=1e-12)
    press = load_assignment("press")
    for position in range(8):
        motion = move(press.mechanism([press.variant(None, position)]))
        row = 45 * position
        expected = {
            "v_B [m/s]": abs(motion.velocity["B"][0]),
            "a_D_x [m/s^2]": motion.acceleration["D"][0].real,
            "omega_2 [rad/s]": motion.omega["2"][0],
            "epsilon_4 [rad/s^2]": motion.epsilon["4"][0],
            "x_D [m]": motion.position["D"][0].real,
        }
        for name, value in expected.items():
            assert told[name][row] == pytest.approx(value, abs=1e-10), (name, position)


def test_the_printed_table_tells_extremes_between_the_samples(planmark):
    """Slider-crank: the piston's acceleration is greatest at the dead point, r omega^2 (1 + r / l)."""
    ran = planmark("cycle", "engine", "--n", 24, "--samples", 19)
    engine = load_assignment("engine")
    omega = float(engine.mechanism([engine.variant(24)]).crank.omega[0])
    assert ran.returncode == 0
    _, unit, _, _, largest, at, _ = row_of(ran, "a_B")
    assert unit == "m/s²"
    assert float(largest) == pytest.approx(0.150 * omega**2 * (1 + 150 / 600), rel=PRINTED)
    assert float(at) in {0.0, 360.0}
    assert "B: dead points at 0.00°, 180.00°, travel 300.000 mm" in ran.stdout
    assert row_of(ran, "v_A")[2] == "constant"


def test_the_quick_return_of_the_shaper_is_that_of_its_crank_and_ground(planmark):
    """Whitworth's: the crank turns 2 acos(r / d) on the way back; the time ratio is (360 - x) / x."""
    shaper = load_assignment("shaper")
    mechanism = shaper.mechanism([shaper.variant(3)])
    pivots = [complex(place[0]) for place in mechanism.ground_m.values()]
    back = 2.0 * np.arccos(float(mechanism.crank.length_m[0]) / abs(pivots[0] - pivots[1]))
    ratio = (2.0 * np.pi - back) / back
    ran = planmark("cycle", "shaper", "--n", 3)
    assert ran.stdout.count(f"time ratio of the strokes {ratio:.4f}") == 2


def test_a_crank_that_cannot_turn_fully_has_its_range_told(planmark, tmp_path):
    ran = planmark("cycle", "pump", "--n", 7)
    limit = np.degrees(2.0 * np.arccos(1.0 / 6.0))
    assert f"moves from -{limit:.2f}° to {limit:.2f}°; this variant: 44.00°" in ran.stdout
    assert "B, its links are in line" in ran.stdout
    assert "∞" in row_of(ran, "v_D")
    planmark("cycle", "pump", "--n", 7, "--csv", "pump.csv", "--of", "v_D")
    told = table((tmp_path / "pump.csv").read_bytes().decode())
    assert np.isnan(told["v_D [m/s]"][0])
    assert told["note"][0] == "B: its links are in line"
    assert not any(told["note"][1:-1])
    assert np.isfinite(told["v_D [m/s]"][1:-1]).all()


def test_in_russian_fields_are_told_apart_by_semicolons(planmark, tmp_path):
    planmark(
        "cycle", "press", "--position", 1, "--csv", "c.csv", "--of", "v_B", "--samples", 5, "--lang", "ru"
    )
    told = table((tmp_path / "c.csv").read_bytes().decode(), ";")
    assert told["crank angle [deg]"] == [0.0, 90.0, 180.0, 270.0, 360.0]


@pytest.mark.parametrize(
    ("call", "page", "lang"),
    [
        ("press --position 0 --of B,D", "297x210", "en"),
        *slow(
            ("pump --n 7", "297x210", "en"),
            ("shaper --n 3 --of v_E,a_E,omega_3,epsilon_3", "210x297", "ro"),
            ("shaper --n 3 --of v_E_x,a_E,omega_3,epsilon_3,D", "420x297", "ru"),
        ),
    ],
)
def test_the_diagram_is_drawn_on_a_page_of_its_size(planmark, tmp_path, call, page, lang):
    ran = planmark("cycle", *call.split(), "--svg", "c.svg", "--pdf", "c.pdf", "--lang", lang)
    assert ran.returncode == 0
    told = tongue(lang).gettext("drawn in %(file)s")
    assert ran.stdout.splitlines() == [told % {"file": file} for file in ("c.svg", "c.pdf")]
    root = ET.parse(tmp_path / "c.svg").getroot()
    size = [float(root.get(side).removesuffix("pt")) / 72 * 25.4 for side in ("width", "height")]
    assert size == pytest.approx([float(edge) for edge in page.split("x")], abs=0.01)
    texts = "".join(root.itertext())
    assert {"en": "this variant", "ro": "această variantă", "ru": "этот вариант"}[
        lang
    ] in texts or "--of B" in call
    assert (tmp_path / "c.pdf").read_bytes().startswith(b"%PDF")


@pytest.fixture
def kite(tmp_path):
    """An assignment of one's own: crank = ground, coupler = rocker."""
    text = (library() / "press.assignment.toml").read_text(encoding="utf-8")
    (tmp_path / "kite.assignment.toml").write_text(
        text.replace('mechanism = "press"', 'mechanism = "kite"'), encoding="utf-8"
    )
    (tmp_path / "kite.mechanism.toml").write_text(KITE, encoding="utf-8")


KITE = """
schema_version = 1
id = "kite"
length_unit = "m"
title = { en = "Kite" }
ground = { O1 = [0, 0], O2 = [0.1, 0] }
crank = { pivot = "O1", pin = "A", length = 0.1, angle_deg = "45*position + 5", omega = 10 }

[[group]]
type = "RRR"
node = "B"
pins = ["A", "O2"]
links = ["3", "2"]
lengths = [0.2, 0.2]
side = "left"
"""


@pytest.mark.usefixtures("kite")
def test_a_kite_is_followed_over_two_turns_and_silent_where_it_is_flat(planmark, tmp_path):
    ran = planmark("cycle", "kite.assignment.toml", "--position", 1)
    assert "the cycle is two turns" in ran.stdout
    assert "flat position of B at 0.00°, 360.00°" in ran.stdout
    planmark(
        "cycle", "kite.assignment.toml", "--position", 1, "--csv", "k.csv", "--samples", 9, "--of", "omega_2"
    )
    told = table((tmp_path / "k.csv").read_bytes().decode())
    assert told["crank angle [deg]"][-1] == 720.0
    assert [bool(note) for note in told["note"]] == [True, *[False] * 3, True, *[False] * 3, True]
    assert np.isnan(told["omega_2 [rad/s]"][4])
    drawn = planmark("cycle", "kite.assignment.toml", "--position", 1, "--svg", "k.svg")
    assert drawn.returncode == 0
    assert "flat position (B): 360°" in (tmp_path / "k.svg").read_text(encoding="utf-8")


def test_without_matplotlib_a_diagram_says_what_to_install_and_tables_are_written_all_the_same(
    planmark, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "grader.cycle.diagram", raising=False)
    call = ("cycle", "press", "--position", 1, "--csv", "c.csv")
    ran = planmark(*call, "--svg", "c.svg")
    assert ran.returncode == 2
    assert "pip install 'planmark[plots]'" in " ".join(ran.stderr.split())
    assert not list(tmp_path.iterdir())
    assert planmark(*call).returncode == 0
    assert (tmp_path / "c.csv").exists()
