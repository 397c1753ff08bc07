"""The command line as people use it: a class's file, common options, logs, pipes, interrupts, help."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest
import typer.main

from grader.cli.app import app
from tests.functional.conftest import ROOT

COMMANDS = sorted(typer.main.get_command(app).commands)
SAMPLES = ROOT / "samples" / "pump"


def start(folder, *arguments, **variables):
    """A command in a process group of its own."""
    known = {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "COLUMNS": "80"}
    return subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-m", "grader", *arguments], cwd=folder, env={**os.environ, **known, **variables},
        text=True, encoding="utf-8", stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip


def run(folder, *arguments, **variables):
    process = start(folder, *arguments, **variables)
    out, err = process.communicate(timeout=300)
    return process.returncode, out, err


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
    status, out, err = run(course, "grade", "--jobs", "1")
    assert status in {0, 1}, err
    first = out.splitlines()[0]
    assert first.startswith("planmark.toml: assignment pump, roster list.csv, language ro")
    results = json.loads((course / "results" / "results.json").read_bytes())
    assert [report["student_id"] for report in results["reports"]] == ["s07", "s08"]
    assert results["unmatched"] == []
    assert 'lang="ro"' in (course / "results" / "s07" / "feedback.html").read_text(encoding="utf-8")
    status, out, err = run(course, "export")
    assert status in {0, 1}, err
    assert (course / "results" / "export-csv.csv").is_file()
    assert "next: open results/export-csv.csv" in out
    # The results know whose they are, wherever the command is given.
    elsewhere = course.parent
    (course / "results" / "export-csv.csv").unlink()
    assert run(elsewhere, "export", "class/results")[0] == status
    assert (course / "results" / "export-csv.csv").is_file()


def test_the_command_line_wins_over_the_file(course):
    status, out, err = run(course.parent, "grade", "class", "--lang", "ru", "-o", "other", "--jobs", "1")
    assert status in {0, 1}, err
    assert "language" not in out.splitlines()[0]
    assert "assignment pump" in out.splitlines()[0]
    assert not (course / "results").exists()
    assert 'lang="ru"' in (course.parent / "other" / "s07" / "feedback.html").read_text(encoding="utf-8")


def test_a_wrong_file_stops_the_command_before_anything_is_written(course):
    (course / "planmark.toml").write_text('assignmnt = "pump"\n', encoding="utf-8")
    status, out, err = run(course, "grade")
    assert (status, out) == (2, "")
    assert "planmark.toml" in err
    assert "$.assignmnt" in err
    assert "did you mean assignment?" in err
    assert not (course / "results").exists()


def test_without_folder_and_file_the_call_is_wrong(tmp_path):
    for command in ("grade", "export", "match", "review"):
        status, _, err = run(tmp_path, command)
        assert status == 2
        assert "planmark.toml" in err


# Options of every command -------------------------------------------------------------------------


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_the_short_options(command):
    options = {name for one in typer.main.get_command(app).commands[command].params for name in one.opts}
    assert {"-q", "--quiet", "-v", "--verbose", "--log"} <= options
    assert ("-o" in options) == bool({"--out", "--file"} & options)


@pytest.mark.parametrize("width", ["40", "60", "80", "200"])
def test_help_keeps_every_option_in_one_piece(tmp_path, width):
    for command in ("grade", "export", "plan"):
        status, out, _ = run(tmp_path, command, "-h", COLUMNS=width)
        assert status == 0
        assert max(map(len, out.splitlines())) <= max(int(width), 44)
        options = {
            name
            for one in typer.main.get_command(app).commands[command].params
            if not getattr(one, "hidden", False)
            for name in (*one.opts, *one.secondary_opts)
            if name.startswith("--")
        }
        assert options <= set(re.findall(r"--[a-z0-9-]*[a-z0-9]", out))
        assert not re.search(r"-$", out, re.MULTILINE)


def test_quiet_leaves_what_needs_a_person_alone(course):
    (course / "nobody.jpg").touch()
    status, out, err = run(course, "grade", "-q", "--jobs", "1")
    assert (status, err) == (1, "")
    assert out.startswith("A person must look at:")
    assert "next:" not in out
    status, out, err = run(course, "plan", "pump", "--n", "7", "--json", "-q")
    assert status == 0
    assert json.loads(out)["assignment"] == "pump"


def test_verbose_details_go_to_standard_error(course):
    status, out, err = run(course, "plan", "pump", "--n", "7", "--json", "-v")
    assert status == 0
    assert json.loads(out)["assignment"] == "pump"
    assert "Python" in err
    assert "planmark plan pump --n 7 --json -v" in err


def test_a_log_holds_versions_call_outcomes_and_time(course):
    run(course, "grade", "--jobs", "1")
    log = (course / "class.log").read_text(encoding="utf-8")
    for part in ("planmark grade --jobs 1", "Python", "s07: ", "s08: ", "ended after"):
        assert part in log
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d", line) for line in log.splitlines())
    run(course, "export", "--file", "missing\0.csv" if os.name == "nt" else "/dev/null/x.csv")
    added = (course / "class.log").read_text(encoding="utf-8").removeprefix(log)
    assert "Traceback (most recent call last)" in added
    assert "exit status 5" in added


def test_a_log_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").touch()
    status, _, err = run(tmp_path, "plan", "pump", "--n", "7", "--log", "file/x.log")
    assert status == 5
    assert "the log cannot be written" in err


# What comes next ----------------------------------------------------------------------------------


def test_each_command_tells_the_one_that_comes_next(tmp_path, course):
    def following(*arguments):
        status, out, err = run(tmp_path, *arguments)
        assert status in {0, 1}, err
        lines = [line for line in out.splitlines() if line.startswith("next: ")]
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
    _, right, _ = run(tmp_path, "check", "pump", "--measured", str(path))
    assert "✓" in right
    assert "x1b" not in right
    (tmp_path / "other.json").write_text(json.dumps({**entered, "n": entered["n"] - 1}), encoding="utf-8")
    _, other, _ = run(tmp_path, "check", "pump", "--measured", "other.json")
    assert other.count("another student's data") == 1
    assert "Look at your number" in other
    assert "Right" not in other


def test_a_path_with_spaces_is_told_so_that_it_can_be_typed(tmp_path):
    _, out, _ = run(tmp_path, "new", "my class/mine")
    assert "next: change them, then planmark lint 'my class/mine.assignment.toml'" in out


# Terminals, pipes, encodings ----------------------------------------------------------------------


def test_progress_in_a_pipe_is_lines(course):
    _, _, err = run(course, "grade", "--jobs", "1")
    assert "\r" not in err
    assert "\x1b" not in err
    assert "marking: 2 of 2" in err.splitlines()
    assert len(err.splitlines()) < 10


@pytest.mark.skipif(os.name == "nt", reason="a terminal is asked for")
@pytest.mark.parametrize(("variables", "coloured"), [({}, True), ({"NO_COLOR": "1"}, False)])
def test_no_color_leaves_out_colours(tmp_path, variables, coloured):
    screen, terminal = os.openpty()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm", **variables}
    for arguments in (["plan", "nothing"], ["lint", "pump"]):
        subprocess.run(  # noqa: S603 - our own program
            [sys.executable, "-m", "grader", *arguments], cwd=tmp_path, env=environment, stdout=terminal,
            stderr=terminal, check=False, timeout=300,
        )  # fmt: skip
        shown = os.read(screen, 100_000)
        assert (re.search(rb"\x1b\[[0-9;]*3[0-7]m", shown) is not None) == coloured, arguments
    os.close(terminal)
    os.close(screen)


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "pump", "--measured", "class/s07.json", "--lang", "ru"],
        ["plan", "pump", "--n", "7"],
        ["plan", "pump", "--n", "7", "--json"],
        ["lint", "pump"],
        ["cycle", "pump", "--n", "7", "--lang", "ro"],
        ["schema", "report"],
        ["--help"],
    ],
)
@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_an_encoding_without_our_letters_stops_nothing(course, arguments, encoding):
    process = start(course.parent, *arguments, PYTHONIOENCODING=encoding, PYTHONUTF8="0")
    _, err = process.communicate(timeout=300)
    assert process.returncode in {0, 1}, err
    assert "Traceback" not in err


# Interrupts ---------------------------------------------------------------------------------------


def first_line(process):
    """Wait until a command has begun its work."""
    return process.stderr.readline()


@pytest.mark.skipif(os.name == "nt", reason="sends a signal to a group of processes")
def test_ctrl_c_ends_grading_with_one_line_and_its_workers(tmp_path):
    shutil.copytree(SAMPLES, tmp_path / "class")
    process = start(tmp_path, "grade", "class", "--assignment", "pump", "-o", "out", "--jobs", "2")
    assert first_line(process).startswith("opening")
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    (line,) = [line for line in err.splitlines() if " of " not in line or line.startswith("planmark")]
    assert line.startswith("planmark: interrupted")
    assert "the same command goes on" in line
    assert not list((tmp_path / "out").rglob("*.part"))
    for _ in range(100):
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            break
        time.sleep(0.1)
    else:
        pytest.fail("a worker lives on")


@pytest.mark.skipif(os.name == "nt", reason="sends a signal to a group of processes")
def test_ctrl_c_ends_a_benchmark_with_one_line(tmp_path):
    process = start(tmp_path, "bench")
    assert first_line(process).startswith("solver")
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert [line for line in err.splitlines() if "interrupted" in line] == err.splitlines()[-1:]
    assert "Traceback" not in err


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
    _, out, _ = run(tmp_path, **asked)
    assert completed <= set(out.split())
    assert all(word.startswith(words.rpartition(" ")[2]) for word in out.split())
