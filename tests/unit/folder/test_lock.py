import json
import multiprocessing
import os
import shutil
import signal

import pytest

from grader.folder.changes import CACHE_FOLDER, RunNote, note_run
from grader.folder.lock import only_run
from reference.errors import CallError
from tests.unit.folder.calls import holds


@pytest.fixture
def places(tmp_path):
    out, folder = tmp_path / "out", tmp_path / "in"
    folder.mkdir()
    return out, folder


def started(out, folder):
    """A process that holds the folder."""
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    process = context.Process(target=holds, args=(str(out), str(folder), ready), daemon=True)
    process.start()
    assert ready.wait(60)
    return process


def test_a_second_run_is_refused_while_the_first_goes_on_and_a_killed_one_does_not_block(places):
    out, folder = places
    process = started(out, folder)
    with pytest.raises(CallError) as error, only_run(out, folder, "pump"):
        pass
    assert error.value.code == "results_in_use"
    for word in (str(out), f"process {process.pid} on ", str(folder), "wait until it ends"):
        assert word in error.value.message
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    part = out / "s1" / ".report.json.0123456789ab.part"
    part.parent.mkdir()
    part.write_text("{")
    with only_run(out, folder, "pump"):
        assert not part.exists()
        assert json.loads((out / CACHE_FOLDER / "running.json").read_text())["pid"] == os.getpid()
    assert not (out / CACHE_FOLDER / "running.json").exists()


def test_a_holder_that_cannot_be_read_is_still_a_holder(places):
    out, folder = places
    with only_run(out, folder, "pump"):
        (out / CACHE_FOLDER / "running.json").write_text("{")
        with (
            pytest.raises(CallError, match="another run writes its results here; wait"),
            only_run(out, folder, "pump"),
        ):
            pass
        assert (out / CACHE_FOLDER / "running.json").exists()


@pytest.mark.parametrize(
    ("assignment", "other_folder", "message"),
    [
        ("press", False, "assignment press, not of pump"),
        ("pump", True, "results of .*other"),
        ("", False, None),
    ],
)
def test_the_results_of_another_class_are_left_alone(places, tmp_path, assignment, other_folder, message):
    out, folder = places
    other = tmp_path / "other"
    other.mkdir()
    before = RunNote(
        assignment="a.toml", assignment_id=assignment, folder=(other if other_folder else folder), out=out
    )
    note_run(before, out / CACHE_FOLDER)
    if message is None:
        with only_run(out, folder, "pump"):
            pass
        return
    with pytest.raises(CallError, match=message) as error, only_run(out, folder, "pump"):
        pass
    assert error.value.code == "results_of_another"


def test_a_class_whose_folder_was_moved_goes_on(places, tmp_path):
    out, folder = places
    note_run(RunNote(assignment="a", assignment_id="pump", folder=folder, out=out), out / CACHE_FOLDER)
    moved = tmp_path / "moved"
    shutil.move(folder, moved)
    with only_run(out, moved, "pump"):
        pass
