import shutil
from contextlib import suppress
from functools import partial
from itertools import islice

import pytest

from grader.folder.batch import Batch, files_of
from grader.folder.watch import arrivals
from grader.rubric import load_rubric
from reference.authored.assignment import load_assignment

PUMP = load_assignment("pump")
RUBRIC = load_rubric("pump-velocity")


@pytest.fixture
def batch(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "s1.jpg").write_bytes(b"whole")
    return Batch(PUMP, RUBRIC, folder, tmp_path / "out")


def watched(batch, *events):
    """The arrivals reported while one event after another happens between two looks."""
    happening = iter(events)

    def sleep(seconds):
        assert seconds == 2.0
        event = next(happening, None)
        if event is None:
            raise KeyboardInterrupt
        event()

    came = []
    with suppress(KeyboardInterrupt):
        for now, names in islice(arrivals(batch, 2.0, sleep), 20):
            came.append((names, sorted(path.name for path in files_of(now))))
    return came


def nothing():
    """Do nothing between two looks."""


def more(path):
    with path.open("ab") as file:
        file.write(b"more")


def test_a_file_is_taken_when_it_has_stopped_growing(batch):
    grow = partial(more, batch.folder / "s2.jpg")
    came = watched(batch, nothing, grow, grow, nothing, nothing)
    assert came == [(["s1.jpg"], ["s1.jpg"]), (["s2.jpg"], ["s1.jpg", "s2.jpg"])]


def test_what_still_grows_does_not_keep_the_others_waiting(batch):
    slow, quick = batch.folder / "s2.jpg", batch.folder / "s3.jpg"

    def both():
        quick.write_bytes(b"whole")
        more(slow)

    came = watched(batch, both, partial(more, slow), nothing)
    assert came[0] == (["s1.jpg"], ["s1.jpg"])
    assert came[1] == (["s3.jpg"], ["s1.jpg", "s3.jpg"])
    assert came[2] == (["s2.jpg"], ["s1.jpg", "s2.jpg", "s3.jpg"])


def test_changes_of_the_roster_and_files_that_go_are_told(batch):
    def roster():
        (batch.folder / "roster.csv").write_text("student_id,name,n\ns1,A,7\n")

    came = watched(batch, nothing, roster, nothing, (batch.folder / "s1.jpg").unlink, nothing)
    assert [names for names, _ in came] == [["s1.jpg"], ["roster.csv"], ["s1.jpg"]]


def test_a_folder_that_is_taken_away_is_an_error(batch):
    shutil.rmtree(batch.folder)
    with pytest.raises(Exception, match="no such folder"):
        next(arrivals(batch, 1.0, lambda _: None))
