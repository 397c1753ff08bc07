"""The command line as people use it: a class's file, common options, logs, pipes, interrupts, help."""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import time

import pytest
import typer.main

from grader.cli.app import app
from tests.examples import slow
from tests.functional.conftest import ENVIRONMENT, PROGRAM, ROOT, run, start
from tests.inline import planmark
from tests.waiting import PATIENCE_S

COMMANDS = sorted(typer.main.get_command(app).commands)
SAMPLES = ROOT / "samples" / "pump"


def told(folder, *arguments):
    """The status of a command in a folder, and what it says."""
    ran = planmark(*arguments, cwd=folder)
    return ran.returncode, ran.stdout, ran.stderr


def measured(n):
    return json.dumps({"student_id": f"s{n:02}", "n": n, "segments_mm": {"v_A": 60.0}})


@pytest.fixture
def course(tmp_path):
    """A class of two with entered measurements, and its file."""
    folder = tmp_path / "class"
    folder.mkdir()
    for n in (7, 8):
        (folder / f"s{n:02}.json").write_text(measured(n), encoding="utf-8")
    (folder / "list.csv").write_text("student_id,name,n\ns07,Ana,7\ns08,Ion,8\n", encoding="utf-8")
    (folder / "planmark.toml").write_text(
        'assignment = "pump"\nroster = "list.csv"\nlanguage = "ro"\nplatform = "csv"\nlog = "class.log"\n',
        encoding="utf-8",
    )
    return folder


# A class's file -----------------------------------------------------------------------------------


def test_a_class_is_graded_and_exported_without_options(course):
    status, out, err = told(course, "grade", "--jobs", "1")
    assert status in {0, 1}, err
    first = out.splitlines()[0]
    assert set("assignment pump, roster list.csv, language ro".split(", ")) <= set(
        first.removeprefix("planmark.toml: ").split(", ")
    )
    results = json.loads((course / "results" / "results.json").read_bytes())
    assert [report["student_id"] for report in results["reports"]] == ["s07", "s08"]
    assert results["unmatched"] == []
    assert 'lang="ro"' in (course / "results" / "s07" / "feedback.html").read_text(encoding="utf-8")
    status, out, err = told(course, "export")
    assert status in {0, 1}, err
    assert (course / "results" / "export-csv.csv").is_file()
    assert "urmează: deschideți results/export-csv.csv" in out
    # The results know whose they are, wherever the command is given.
    elsewhere = course.parent
    (course / "results" / "export-csv.csv").unlink()
    assert told(elsewhere, "export", "class/results")[0] == status
    assert (course / "results" / "export-csv.csv").is_file()


def test_the_command_line_wins_over_the_file(course):
    status, out, err = told(course.parent, "grade", "class", "--lang", "ru", "-o", "other", "--jobs", "1")
    assert status in {0, 1}, err
    assert "language" not in out.splitlines()[0]
    assert "assignment pump" in out.splitlines()[0]
    assert not (course / "results").exists()
    assert 'lang="ru"' in (course.parent / "other" / "s07" / "feedback.html").read_text(encoding="utf-8")


def test_a_wrong_file_stops_the_command_before_anything_is_written(course):
    (course / "planmark.toml").write_text('assignmnt = "pump"\n', encoding="utf-8")
    status, out, err = told(course, "grade")
    assert (status, out) == (2, "")
    assert "planmark.toml" in err
    assert "$.assignmnt" in err
    assert "did you mean assignment?" in err
    assert not (course / "results").exists()


def test_without_folder_and_file_the_call_is_wrong(tmp_path):
    for command in ("grade", "export", "match", "review"):
        status, _, err = told(tmp_path, command)
        assert status == 2
        assert "planmark.toml" in err


# Options of every command -------------------------------------------------------------------------


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_the_short_options(command):
    options = {name for one in typer.main.get_command(app).commands[command].params for name in one.opts}
    assert {"-q", "--quiet", "-v", "--verbose", "--log"} <= options
    assert ("-o" in options) == bool({"--out", "--file"} & options)


@pytest.mark.parametrize(
    ("command", "width"),
    [("grade", "40"), ("export", "40"), ("plan", "40"), ("grade", "60"), ("export", "80"), ("grade", "200")],
)
def test_help_keeps_every_option_in_one_piece(tmp_path, command, width):
    ran = run(tmp_path, command, "-h", COLUMNS=width)
    assert ran.returncode == 0
    assert max(map(len, ran.stdout.splitlines())) <= max(int(width), 44)
    options = {
        name
        for one in typer.main.get_command(app).commands[command].params
        if not getattr(one, "hidden", False)
        for name in (*one.opts, *one.secondary_opts)
        if name.startswith("--")
    }
    assert options <= set(re.findall(r"--[a-z0-9-]*[a-z0-9]", ran.stdout))
    assert not re.search(r"-$", ran.stdout, re.MULTILINE)


def test_quiet_leaves_what_needs_a_person_alone(course):
    (course / "nobody.jpg").touch()
    (course / "nobodys.csv").write_text("n,v_A\n7,60\n", encoding="utf-8")
    status, out, err = told(course, "grade", "-q", "--jobs", "1")
    assert (status, err) == (1, "")
    # In the language of the class.
    assert out.startswith("Trebuie verificate de profesor:")
    assert "\n  nobodys.csv: " in out
    assert "student_id" in out
    assert "next:" not in out
    status, out, err = told(course, "plan", "pump", "--n", "7", "--json", "-q")
    assert status == 0
    assert json.loads(out)["assignment"] == "pump"


def test_verbose_details_go_to_standard_error(course):
    status, out, err = told(course, "plan", "pump", "--n", "7", "--json", "-v")
    assert status == 0
    assert json.loads(out)["assignment"] == "pump"
    assert "Python" in err
    assert "planmark plan pump --n 7 --json -v" in err


def test_a_log_holds_versions_call_outcomes_and_time(course):
    told(course, "grade", "--jobs", "1")
    log = (course / "class.log").read_text(encoding="utf-8")
    for part in ("planmark grade --jobs 1", "Python", "s07: ", "s08: ", "ended after"):
        assert part in log
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d", line) for line in log.splitlines())
    told(course, "export", "--file", "missing\0.csv" if os.name == "nt" else "/dev/null/x.csv")
    added = (course / "class.log").read_text(encoding="utf-8").removeprefix(log)
    assert "Traceback (most recent call last)" in added
    assert "exit status 5" in added


def test_a_log_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").touch()
    status, _, err = told(tmp_path, "plan", "pump", "--n", "7", "--log", "file/x.log")
    assert status == 5
    assert "cannot be written" in err


# What comes next ----------------------------------------------------------------------------------


def test_each_command_tells_the_one_that_comes_next(tmp_path, course):
    def following(*arguments):
        status, out, err = told(tmp_path, *arguments)
        assert status in {0, 1}, err
        lines = [line for line in out.splitlines() if line.startswith(("next: ", "urmează: "))]
        return lines[0].partition("planmark ")[2] if lines else None

    assert following("new", "mine") == "lint mine.assignment.toml"
    assert following("lint", "mine.assignment.toml").startswith("sheet mine.assignment.toml ")
    assert following("lint", "mine.assignment.toml", "--json") is None
    assert following("lint", "mine.assignment.toml", "-q") is None
    sheet = ("sheet", "pump", "--roster", "class/list.csv", "-o", "sheets.pdf")
    assert following(*sheet) == "grade SCANS --assignment pump --roster class/list.csv -o results"
    assert following("grade", "class", "--jobs", "1") == "export class/results --to csv"
    (course / "nobody.jpg").touch()
    assert following("grade", "class", "--jobs", "1") == "review class/results"
    assert following("check", "pump", "--measured", "class/s07.json") is None


def test_a_check_has_its_own_marks_and_says_once_that_the_data_are_another_students(tmp_path):
    path = SAMPLES / "s08.json"
    entered = json.loads(path.read_text(encoding="utf-8"))
    _, right, _ = told(tmp_path, "check", "pump", "--measured", str(path))
    assert "✓" in right
    assert "x1b" not in right
    (tmp_path / "other.json").write_text(json.dumps({**entered, "n": entered["n"] - 1}), encoding="utf-8")
    _, other, _ = told(tmp_path, "check", "pump", "--measured", "other.json")
    assert other.count("another student's data") == 1
    assert "Look at your number" in other
    assert "Right" not in other


def test_a_path_with_spaces_is_told_so_that_it_can_be_typed(tmp_path):
    _, out, _ = told(tmp_path, "new", "my class/mine")
    assert "next: change them, then planmark lint 'my class/mine.assignment.toml'" in out


# Terminals, pipes, encodings ----------------------------------------------------------------------


def test_progress_in_a_pipe_is_lines(course):
    _, _, err = told(course, "grade", "--jobs", "1")
    assert "\r" not in err
    assert "\x1b" not in err
    assert "notare: 2 / 2" in err.splitlines()
    assert len(err.splitlines()) < 10


@pytest.mark.skipif(os.name == "nt", reason="a terminal is asked for")
@pytest.mark.parametrize(("variables", "coloured"), [({}, True), ({"NO_COLOR": "1"}, False)])
def test_no_color_leaves_out_colours(tmp_path, variables, coloured):
    screen, terminal = os.openpty()
    environment = ENVIRONMENT | {"TERM": "xterm", **variables}
    for arguments in (["plan", "nothing"], ["lint", "pump"]):
        subprocess.run(  # noqa: S603 - our own program
            [*PROGRAM, *arguments], cwd=tmp_path, env=environment, stdout=terminal, stderr=terminal,
            check=False, timeout=PATIENCE_S,
        )  # fmt: skip
        shown = os.read(screen, 100_000)
        assert (re.search(rb"\x1b\[[0-9;]*3[0-7]m", shown) is not None) == coloured, arguments
    os.close(terminal)
    os.close(screen)


@pytest.mark.parametrize(
    ("arguments", "encoding"),
    [
        ("check pump --measured class/s07.json --lang ru", "ascii"),
        ("plan pump --n 7", "ascii"),
        *slow(
            ("check pump --measured class/s07.json --lang ru", "cp1252"),
            ("plan pump --n 7 --json", "ascii"),
            ("lint pump", "ascii"),
            ("cycle pump --n 7 --lang ro", "ascii"),
            ("schema report", "ascii"),
            ("--help", "ascii"),
        ),
    ],
)
def test_an_encoding_without_our_letters_stops_nothing(course, arguments, encoding):
    ran = run(course.parent, *arguments.split(), PYTHONIOENCODING=encoding, PYTHONUTF8="0")
    assert ran.returncode in {0, 1}, ran.stderr
    assert "Traceback" not in ran.stderr


# Interrupts ---------------------------------------------------------------------------------------


def interrupted(process, begins):
    """The lines that a command still prints when interrupted as soon as it has begun its work."""
    assert process.stderr.readline().startswith(begins)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    return err.splitlines()


@pytest.mark.skipif(os.name == "nt", reason="sends a signal to a group of processes")
def test_ctrl_c_ends_grading_with_one_line_and_its_workers(tmp_path):
    shutil.copytree(SAMPLES, tmp_path / "class")
    process = start(tmp_path, "grade", "class", "--assignment", "pump", "-o", "out", "--jobs", "2")
    said = interrupted(process, "opening")
    (line,) = [line for line in said if " of " not in line or line.startswith("planmark")]
    assert line.startswith("planmark: interrupted")
    assert "run the same command to continue" in line
    assert not list((tmp_path / "out").rglob("*.part"))
    with contextlib.suppress(ProcessLookupError):
        while True:  # until no worker is left of the group
            os.killpg(process.pid, 0)
            time.sleep(0.05)


@pytest.mark.skipif(os.name == "nt", reason="sends a signal to a group of processes")
def test_ctrl_c_ends_a_benchmark_with_one_line(tmp_path):
    said = interrupted(start(tmp_path, "bench"), "solver")
    assert [line for line in said if "interrupted" in line] == said[-1:]
    assert "Traceback" not in "".join(said)


# Completion ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("planmark gr", {"grade"}),
        ("planmark plan pu", {"pump"}),
        ("planmark plan pump --lang r", {"ro", "ru"}),
    ],
)
def test_a_shell_completes_commands_assignments_and_languages(tmp_path, words, completed):
    asked = {"_PLANMARK_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    out = run(tmp_path, **asked).stdout
    assert completed <= set(out.split())
    assert all(word.startswith(words.rpartition(" ")[2]) for word in out.split())
