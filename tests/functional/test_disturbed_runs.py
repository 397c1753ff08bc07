"""Runs that are killed, find no room, or whose scans are replaced: nothing is lost, a rerun is as one run."""

import json
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

from tests.functional.conftest import ENVIRONMENT
from tests.waiting import PATIENCE_S

pytestmark = pytest.mark.slow

SAMPLES = Path(__file__).resolve().parents[2] / "samples" / "pump"
ROSTER = "student_id,name,n\ns01,A,7\ns02,B,12\ns08,C,21\ng08,D,21\n"


def call(folder, out):
    """The command that grades a folder."""
    return [
        sys.executable, "-m", "grader", "grade", str(folder), "--assignment", "pump", "--out", str(out),
        "--jobs", "2",
    ]  # fmt: skip


def filled(folder, *scanned):
    """The folder with these students' scans and two students' values."""
    folder.mkdir()
    for path in (path for student in scanned for path in SAMPLES.glob(f"{student}_*")):
        shutil.copy(path, folder / path.name)
    entered = (SAMPLES / "s08.json").read_text(encoding="utf-8")
    for student in ("s08", "g08"):
        (folder / f"{student}.json").write_text(entered.replace("s08", student), encoding="utf-8")
    (folder / "roster.csv").write_text(ROSTER, encoding="utf-8")
    return folder


def graded(folder, out):
    """A run without disturbance; its results without times and without what the run before was."""
    ended = subprocess.run(call(folder, out), capture_output=True, text=True, timeout=PATIENCE_S, check=False)  # noqa: S603 - our own program
    assert ended.returncode in {0, 1}, ended.stderr
    return results_of(out)


def results_of(out):
    """The results in a folder, without times and without what has moved."""
    results = json.loads((out / "results.json").read_text(encoding="utf-8"))
    for report in results["reports"]:
        for sheet in report["reading"]["sheets"]:
            sheet["timing_ms"] = None
    results["moved"] = []
    assert not list(out.rglob("*.part"))
    return results


@pytest.fixture(scope="module")
def handed_in(tmp_path_factory):
    """Two students' scans and two students' values, which no test changes."""
    return filled(tmp_path_factory.mktemp("class") / "in", "s01", "s02")


@pytest.fixture(scope="module")
def undisturbed(handed_in):
    """The results of what is handed in."""
    return graded(handed_in, handed_in.with_name("out"))


@pytest.fixture(scope="module")
def entered(tmp_path_factory):
    """Values alone, and the folder with their results."""
    folder = filled(tmp_path_factory.mktemp("entered") / "in")
    graded(folder, folder.with_name("out"))
    return folder, folder.with_name("out")


RUN = """
import sys
from pathlib import Path

from grader.folder.batch import Batch, grade
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment
from tests.waiting import PATIENCE_S, until


def pause(what, done, total):
    if (what, done) == (sys.argv[3], 1):
        print("one is done", flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    pump = load_assignment("pump")
    grade(Batch(pump, rubric_of(pump), Path(sys.argv[1]), Path(sys.argv[2]), jobs=2), pause)
"""


@contextmanager
def paused(folder, out, what):
    """A run that waits where one of several is opened or marked, until its input ends."""
    script = out.with_name("run.py")
    script.write_text(RUN, encoding="utf-8")
    command = [sys.executable, script, folder, out, what]
    with subprocess.Popen(  # noqa: S603 - our own program
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=ENVIRONMENT, text=True
    ) as process:
        assert process.stdout.readline() == "one is done\n"
        yield process


def test_a_run_killed_on_the_way_is_finished_by_the_next(handed_in, undisturbed, tmp_path):
    out = tmp_path / "out"
    with paused(handed_in, out, "marking") as process:
        process.send_signal(signal.SIGKILL)
    assert list((out / ".planmark").glob("*.key"))
    assert not (out / "results.json").exists()
    assert graded(handed_in, out) == undisturbed


def test_a_killed_worker_costs_nothing(handed_in, undisturbed, tmp_path):
    out = tmp_path / "out"
    with paused(handed_in, out, "opening") as process:
        workers = [
            child
            for child in psutil.Process(process.pid).children()
            if "spawn_main" in " ".join(child.cmdline())
        ]
        workers[0].kill()
        process.stdin.close()
        assert process.wait(600) == 0
    assert results_of(out) == undisturbed


@pytest.mark.parametrize("lacking", ["s08/feedback.html", "results.json"])
def test_without_room_the_run_ends_with_a_message_and_the_next_one_completes_it(entered, tmp_path, lacking):
    """A limit for each file stands for a full disk: first a report has no room, then the results alone."""
    resource = pytest.importorskip("resource")
    (folder, undisturbed), out = entered, tmp_path / "out"
    room = (undisturbed / lacking).stat().st_size - 1000
    ended = subprocess.run(  # noqa: S603 - our own program
        call(folder, out), capture_output=True, text=True, timeout=PATIENCE_S, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)),
    )  # fmt: skip
    assert ended.returncode == 5
    assert "cannot be written" in ended.stderr
    assert "Traceback" not in ended.stderr
    assert not (out / "results.json").exists()
    assert not list(out.rglob("*.part"))
    assert graded(folder, out) == results_of(undisturbed)


def test_a_scan_replaced_on_the_way_is_told_or_read_whole_and_the_next_run_has_the_new_one(tmp_path):
    handed_in = filled(tmp_path / "in", "s01", "s02")
    out, other = tmp_path / "out", tmp_path / "other.jpg"
    shutil.copy(SAMPLES / "s02_1.jpg", other)
    with other.open("ab") as file:
        file.write(b"another scan")
    with subprocess.Popen(  # noqa: S603 - our own program
        call(handed_in, out), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    ) as process:
        for line in process.stderr:
            if line.startswith("opening"):
                other.replace(handed_in / "s02_1.jpg")
                break
        process.stderr.read()
    report = next(each for each in results_of(out)["reports"] if each["student_id"] == "s02")
    codes = {problem["code"] for problem in report["problems"]}
    assert "file_changed" in codes or len(report["reading"]["sheets"]) == 2
    assert graded(handed_in, out) == graded(handed_in, tmp_path / "undisturbed")
