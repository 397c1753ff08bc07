"""``planmark plan`` and what every command has in common."""

import json

import jsonschema
import pypdfium2
import pytest
import typer
from typer.testing import CliRunner

from grader.cli.app import app
from grader.cli.exporting import MODELS, schema
from reference.authored.assignment import library


def test_the_table_of_the_press_shows_the_five_printed_segments(planmark):
    ran = planmark("plan", "press", "--position", 1)
    assert ran.returncode == 0
    assert ran.stderr == ""
    for vector, segment in (
        ("v_B", "46.40"),
        ("v_BA", "47.17"),
        ("v_C", "92.80"),
        ("v_D", "89.36"),
        ("v_DC", "21.61"),
    ):
        line = next(line for line in ran.stdout.splitlines() if line.split()[:1] == [vector])
        assert line.split()[1] == segment


@pytest.mark.parametrize(
    "call", ["pump --n 1", "press --position 0", "engine --n 24", "pump-collinear --n 30"]
)
def test_the_plan_as_json_is_what_its_schema_says(planmark, call):
    ran = planmark("plan", *call.split(), "--json")
    assert ran.returncode == 0
    document = json.loads(ran.stdout)
    jsonschema.validate(document, schema("plan"))
    assert document["schema_version"] == 1
    assert document["assignment"] == call.split()[0]


def test_masses_and_loads_give_forces_as_json_and_in_the_table(planmark, tmp_path):
    text = (library() / "pump.assignment.toml").read_text(encoding="utf-8")
    masses = '[[body]]\nlink = "slider_D"\nmass = 20\n[[load]]\nlink = "slider_D"\nforce = 900\n'
    path = tmp_path / "own.assignment.toml"
    path.write_text(f'{text}\n{masses}motion = "against"\n', encoding="utf-8")
    document = json.loads(planmark("plan", path.name, "--n", 7, "--json").stdout)
    jsonschema.validate(document, schema("plan"))
    forces, drive = document["forces"], document["vectors"]["a_D"]
    assert forces["inertia"]["slider_D"]["force_N"] == pytest.approx(20 * drive["value"])
    turned = forces["inertia"]["slider_D"]["direction_deg"] - drive["direction_deg"]
    assert abs(turned) == pytest.approx(180.0)
    assert set(forces["guides"]["D"]) == {
        "on", "by", "x_N", "y_N", "value_N", "direction_deg", "moment_Nm", "at_m",
    }  # fmt: skip
    # The crank gives what the piston takes: the moment times omega is the power of the load and of inertia.
    load = 900 + 20 * drive["value"] * (
        1 if drive["direction_deg"] == document["vectors"]["v_D"]["direction_deg"] else -1
    )
    omega = document["angular"]["omega_1"]
    power = load * document["vectors"]["v_D"]["value"]
    assert forces["balancing"] == {"on": "1", "moment_Nm": pytest.approx(power / omega)}
    assert abs(forces["power_residual"]) < 1e-12
    (row,) = [
        line.split()
        for line in planmark("plan", path.name, "--n", 7).stdout.splitlines()
        if "balancing" in line
    ]
    assert float(row[-1]) == pytest.approx(power / omega, rel=1e-3)


def test_a_zero_vector_has_no_direction(planmark):
    document = json.loads(planmark("plan", "press", "--position", 0, "--json").stdout)
    assert document["vectors"]["v_B"]["direction_deg"] is None
    assert document["vectors"]["v_BA"]["drawn_mm"] == pytest.approx(50.0)


def test_the_scales_follow_from_the_crank_as_drawn(planmark):
    document = json.loads(planmark("plan", "pump", "--n", 7, "--crank-mm", 50, "--json").stdout)
    assert document["scales"]["kL"] == pytest.approx(0.30 / 50)
    assert document["vectors"]["v_A"]["drawn_mm"] == pytest.approx(50.0)


@pytest.mark.parametrize("name", [*MODELS, "lti"])
def test_every_schema_is_a_schema(planmark, name):
    ran = planmark("schema", name)
    assert ran.returncode == 0
    jsonschema.Draft202012Validator.check_schema(json.loads(ran.stdout))


@pytest.mark.parametrize("command", sorted(typer.main.get_command(app).commands))
def test_every_command_explains_itself(command):
    told = CliRunner().invoke(app, [command, "--help"])
    assert told.exit_code == 0
    assert len(told.output) > 200


def test_the_program_tells_its_version_and_its_commands(planmark):
    assert planmark("--version").stdout.startswith("planmark 0.")
    assert planmark("--help").returncode == 0
    assert planmark().returncode == 2
    assert planmark("frobnicate").returncode == 2


CRANK_ALONE = """
schema_version = 1
id = "crank"
rubric = "crank"
title = { en = "Crank" }
task = { en = "Draw it" }

[mechanism]
schema_version = 1
id = "crank"
title = { en = "Crank" }
length_unit = "cm"
ground = { O1 = [0, 0] }
crank = { pivot = "O1", pin = "A", length = 10, angle_deg = 30, omega = -5, epsilon = 3 }

[scales]
crank_mm = 50
kL = "crank_m / crank_mm"
kv = "omega * kL"
ka = "omega**2 * kL"

[[page]]
kind = "all"
figures = ["mechanism", "velocity_plan", "acceleration_plan"]
"""


def test_a_crank_alone_that_turns_clockwise_and_speeds_down_is_a_mechanism_too(planmark, tmp_path):
    (tmp_path / "crank.assignment.toml").write_text(CRANK_ALONE, encoding="utf-8")
    table = planmark("plan", "crank.assignment.toml", "--svg", "crank.svg")
    assert table.returncode == 0, table.stderr
    vectors = json.loads(planmark("plan", "crank.assignment.toml", "--json").stdout)["vectors"]
    assert vectors["v_A"]["drawn_mm"] == pytest.approx(50.0)
    assert vectors["v_A"]["direction_deg"] == pytest.approx(300)
    assert vectors["a_A_n"]["direction_deg"] == pytest.approx(210)
    assert vectors["a_A_t"]["direction_deg"] == pytest.approx(120)
    assert vectors["a_A_t"]["value"] == pytest.approx(0.3)


def test_a_handout_has_a_worked_example_of_a_variant_that_nobody_has(planmark, tmp_path):
    out = tmp_path / "tasks.pdf"
    planmark("handout", "press", "--position", "2", "--example", "1", "--out", out)
    document = pypdfium2.PdfDocument(out)
    text = "".join(page.get_textpage().get_text_range() for page in document)
    assert "Worked example: Press mechanism" in text
    assert "46.40" in text
    out.unlink()
    refused = planmark("handout", "press", "--position", "1", "--example", "1", "--out", out)
    assert refused.returncode == 2
    assert "position = 1 is a student's own" in refused.stderr
    assert not out.exists()


def test_the_steps_are_printed_in_the_terminal(planmark):
    printed = planmark("plan", "pump", "--n", "7", "--steps", "-").stdout
    assert "v̅_B   = v̅_A    + v̅_BA" in printed
    assert "⊥ O₂B" in printed


def test_a_handout_is_written_for_one_number_and_nothing_for_a_wrong_one(planmark, tmp_path):
    assert planmark("handout", "pump", "--n", 7, "--out", tmp_path / "task.pdf").returncode == 0
    assert (tmp_path / "task.pdf").read_bytes().startswith(b"%PDF")
    ran = planmark("handout", "pump", "--n", 99, "--out", tmp_path / "none.pdf")
    assert ran.returncode == 2
    assert "n = 1..30" in ran.stderr
    assert not (tmp_path / "none.pdf").exists()
