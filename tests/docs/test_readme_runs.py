"""The commands of the README and of the walk, run in folders prepared as these pages suppose."""

import csv
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from reference.authored.assignment import library, load_assignment
from reference.plan import exact_plan
from tests.waiting import PATIENCE_S

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parent.parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = [line.strip() for line in README.splitlines() if re.match(r" +planmark ", line)]


@pytest.fixture(scope="module")
def desk(tmp_path_factory) -> Path:
    """A roster, a folder with one student's measurements, a scan, and an assignment of one's own."""
    here = tmp_path_factory.mktemp("desk")
    (here / "roster.csv").write_text("student_id,name,n\ns07,Student 7,7\n", encoding="utf-8")
    shutil.copy(ROOT / "samples" / "pump" / "s01_1.jpg", here / "scan.jpg")
    shutil.copy(library() / "engine.assignment.toml", here / "my.assignment.toml")
    pump = load_assignment("pump")
    plan = exact_plan(pump, [pump.variant(7)])
    scales = {
        name: f"{float(getattr(plan.scales, name)[0])} {unit}"
        for name, unit in (("kL", "m/mm"), ("kv", "(m/s)/mm"), ("ka", "(m/s^2)/mm"))
    }
    lengths = {name: round(float(abs(plan.drawn_mm(name)[0])), 3) for name in plan.vectors_si}
    measured = json.dumps({"student_id": "s07", "n": 7, "scales": scales, "segments_mm": lengths})
    (here / "mine.json").write_text(measured, encoding="utf-8")
    (here / "folder").mkdir()
    shutil.copy(here / "mine.json", here / "folder" / "s07.json")
    return here


def _serves(command: list[str], desk: Path, environment: dict[str, str]) -> None:
    """A server's command says where it listens, and ends on Ctrl+C."""
    with subprocess.Popen(  # noqa: S603 - our own program
        command, cwd=desk, env=environment, stdout=subprocess.PIPE, text=True, encoding="utf-8"
    ) as server:
        try:
            said = [server.stdout.readline() for _ in range(2)]
        finally:
            server.send_signal(signal.SIGINT)
        try:
            server.wait(timeout=PATIENCE_S)
        finally:
            server.kill()
    assert "http://127.0.0.1:" in "".join(said)


def _run(command: str, desk: Path, statuses: set[int]) -> None:
    """A command of a page ends with one of these statuses, and says something; a server serves."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    arguments = shlex.split(command)[1:]
    if arguments[0] == "review":
        _serves([sys.executable, "-m", "grader", *arguments], desk, environment)
        return
    ran = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-m", "grader", *arguments],
        cwd=desk,
        env=environment,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=PATIENCE_S,
        check=False,
    )
    assert ran.returncode in statuses, f"{command}\n{ran.stdout}\n{ran.stderr}"
    assert ran.stdout


def test_every_command_of_the_readme_does_what_it_says(desk):
    assert len(COMMANDS) > 8
    for command in COMMANDS:
        # Lint and reading find things that need a person: that is status 1; all else here is right.
        _run(command, desk, {0, 1} if command.split()[1] in {"lint", "read", "match"} else {0})
    written = {path.name for path in desk.iterdir()}
    assert {"plan.svg", "sheets.pdf", "marks", "draft.csv"} <= written
    assert (desk / "marks" / "index.html").is_file()
    assert (desk / "marks" / "s07" / "feedback.html").is_file()


def test_every_command_of_the_page_of_the_source_texts_does_what_it_says(desk):
    page = (ROOT / "docs" / "sources.md").read_text(encoding="utf-8")
    commands = sorted(set(re.findall(r"`(planmark [^`]+)`", page)))
    assert len(commands) > 10
    for command in commands:
        _run(command, desk, {0, 1} if command.split()[1] == "lint" else {0})
    assert {"steps.html", "press.html", "task.pdf", "pump.csv", "press.csv"} <= {
        one.name for one in desk.iterdir()
    }


def test_every_equation_and_figure_of_the_source_texts_has_its_row():
    page = (ROOT / "docs" / "sources.md").read_text(encoding="utf-8")
    cells = [line.split("|")[1] for line in page.splitlines() if line.startswith("|")]
    named = [
        range(int(first), int(last or first) + 1)
        for first, last in re.findall(r"(?<!below )(?<!above )\((\d+)\)(?:–\((\d+)\))?", " ".join(cells))
    ]
    assert sorted(number for numbers in named for number in numbers) == [*range(1, 29)]
    assert re.findall(r"figure (\d)", " ".join(cells)) == list("12345")


def test_the_walk_from_scans_to_moodle_ends_with_a_worksheet_of_grades(tmp_path):
    shutil.copytree(ROOT / "samples" / "pump", tmp_path / "samples" / "pump")
    shutil.copytree(ROOT / "docs" / "assets", tmp_path / "docs" / "assets")
    walk = re.findall(r"(?m)^    (planmark .+)$", (ROOT / "docs" / "index.md").read_text(encoding="utf-8"))
    assert [command.split()[1] for command in walk] == ["grade", "review", "export", "export"]
    for command in walk:
        # One student has handed in nothing: a person must look, status 1.
        _run(command, tmp_path, {1})
    with (tmp_path / "marks" / "export-moodle.csv").open(encoding="utf-8-sig", newline="") as file:
        grades = {row["ID number"]: row["Grade"] for row in csv.DictReader(file)}
    assert set(grades) == {f"s{number:02d}" for number in range(1, 10)}
    assert float(grades["s05"]) < 46.0
    assert (tmp_path / "marks" / "export-moodle-feedback.zip").is_file()
