"""Commands import no heavy library for work that is not asked for. mpmath refines dead points."""

import json
import subprocess
import sys
from functools import cache

import pytest

from grader.cli import commands_called
from grader.cli.app import app
from tests.examples import slow
from tests.functional.conftest import ENVIRONMENT
from tests.waiting import PATIENCE_S

HEAVY = frozenset(
    "scipy cv2 reportlab pikepdf pypdfium2 PIL tifffile imagecodecs simplejpeg zxingcpp jinja2 rich"
    " mpmath pebble psutil filelock segno babel starlette uvicorn".split()
)
SCANS = frozenset("scipy cv2 PIL pypdfium2 simplejpeg zxingcpp".split())
PAGES = frozenset({"jinja2", "reportlab"})
JUDGING = (
    "cli comparison documents feedback files given_data language marking options outcomes records"
    " rubric self_check tables texts"
)
"""The rooms of the program that entered measurements pass through."""

PROGRAM = """
import atexit, gc, sys

def tell():
    searched = f"{len(searches)} searches", "frozen" if gc.get_freeze_count() > 10_000 else ""
    with open("imported.txt", "w") as file:
        file.write("\\n".join([*sys.modules, *searched]))

searches = []
atexit.register(tell)
from grader.cli import main
gc.callbacks.append(lambda phase, _: searches.append(phase))
main()
"""


@cache
def imported(folder, command):
    """The modules that a command has imported when it ends."""
    run = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", PROGRAM, *command.split()], cwd=folder, env=ENVIRONMENT, capture_output=True,
        text=True, encoding="utf-8", timeout=PATIENCE_S, check=False,
    )  # fmt: skip
    assert run.returncode in {0, 1}, run.stderr
    modules = (folder / "imported.txt").read_text().split("\n")
    assert "grader.cli.commands" in modules
    return set(modules)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with one student's measurements to check, and a class's to grade."""
    tmp_path = tmp_path_factory.mktemp("desk")
    (tmp_path / "class").mkdir()
    drawn = {
        "segments_mm": {"v_A": 60.0, "v_B": 49.8, "v_BA": 23.4},
        "directions_deg": {"v_A": 134.0, "v_B": 156.2, "v_BA": 260.5},
    }
    measured = {"student_id": "s07", "n": 7, **drawn}
    for path in (tmp_path / "measured.json", tmp_path / "class" / "s07.json"):
        path.write_text(json.dumps(measured), encoding="utf-8")
    (tmp_path / "class" / "roster.csv").write_text("student_id,name,n\ns07,Ana,7\n", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("command", "allowed"),
    [
        ("--help", set()),
        ("plan pump --n 7 --json", set()),
        ("check pump --measured measured.json", set()),
        *slow(
            ("plan pump --n 7", {"rich"}),
            ("plan pump --n 7 --svg plan.svg", {"rich"}),
            ("plan pump --all --csv all.csv", set()),
            ("plan pump --all", {"rich"}),
            ("lint pump", {"rich", "scipy"}),
            ("schema report", set()),
            ("cycle pump --n 7 --csv cycle.csv", set()),
            ("cycle pump --n 7", {"rich", "mpmath"}),
            ("cycle pump --n 7 --svg cycle.svg", {"mpmath", "PIL"}),
        ),
    ],
)
def test_a_command_imports_no_heavy_library_that_it_does_not_use(folder, command, allowed):
    assert HEAVY & imported(folder, command) <= allowed


def test_a_check_loads_no_masked_arrays(folder):
    # They come with the first np.unique or np.median, and take as long as five rooms of ours.
    assert "numpy.ma" not in imported(folder, "check pump --measured measured.json")


@pytest.mark.parametrize(
    ("command", "needed"),
    [
        ("--help", "cli files language options"),
        ("plan pump --n 7 --json", "cli files language options solution"),
        ("check pump --measured measured.json", JUDGING),
    ],
)
def test_a_command_imports_no_room_of_the_program_that_it_does_not_use(folder, command, needed):
    modules = (module.split(".") for module in imported(folder, command))
    assert {names[1] for names in modules if names[0] == "grader" and len(names) > 1} <= set(needed.split())


def test_a_short_command_never_searches_its_objects_for_cycles(folder):
    # Each search, and the one at the end, costs a tenth of the command's time.
    assert {"0 searches", "frozen"} <= imported(folder, "check pump --measured measured.json")


def test_a_command_that_is_named_builds_the_options_of_no_other():
    assert [one.callback.__name__ for one in commands_called(["schema", "plan"])] == ["schema"]
    for arguments in ([], ["--version"], ["scheme"]):
        assert commands_called(arguments) == app.registered_commands


def test_grading_imports_no_heavy_library_beyond_those_of_scans_pages_and_processes(folder):
    allowed = {*SCANS, *PAGES, "rich", "pebble", "psutil", "filelock"}
    call = "grade class --assignment pump --roster class/roster.csv --out out --jobs 1"
    modules = imported(folder, call)
    assert HEAVY & modules <= allowed


SCANNER = """
import importlib, pkgutil, sys
import grader.scan
for module in pkgutil.walk_packages(grader.scan.__path__, "grader.scan."):
    importlib.import_module(module.name)
print(*sys.modules)
"""
SCANNED = "documents files language printed.layout records scan tables.scale_text"
"""Modules that a scan may import: of the printed sheets their layout alone, not the code that prints them."""


def test_the_scanner_loads_where_things_are_printed_and_not_the_pdf_writer():
    run = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", SCANNER],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=True,
    )
    modules = set(run.stdout.split())
    assert not {"reportlab", "segno", "jinja2", "typer", "rich"} & modules
    rooms = {name.removeprefix("grader.") for name in modules if name.startswith("grader.")}
    allowed = set(SCANNED.split())
    assert {name for name in rooms if not name.startswith("scan.")} == allowed | {"printed", "tables"}


def test_who_marks_or_serves_loads_scipy_with_the_first_scan_alone():
    program = "import sys, grader.pipeline; print(*sys.modules)"
    run = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", program], env=ENVIRONMENT, capture_output=True, text=True, check=True
    )
    heavy = {f"scipy.{name}" for name in ("ndimage", "optimize", "sparse", "spatial", "special")}
    assert not heavy & set(run.stdout.split())
