"""Files are written whole or not at all."""

import os
import stat

import pytest

from grader.files import OutputError, write_whole


def test_text_is_stored_as_utf8_with_its_line_ends_untouched(tmp_path):
    write_whole(tmp_path / "deep" / "er" / "a.csv", "ș;é\r\nб\n")
    assert (tmp_path / "deep" / "er" / "a.csv").read_bytes() == "ș;é\r\nб\n".encode()


def test_a_failed_write_leaves_the_old_file_and_no_litter(tmp_path, monkeypatch):
    target = tmp_path / "results.json"
    write_whole(target, "old")

    def no_room(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_room)
    with pytest.raises(OutputError, match="No space left"):
        write_whole(target, "new")
    assert target.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["results.json"]


def test_an_interrupted_write_leaves_no_litter(tmp_path, monkeypatch):
    def interrupt(_descriptor):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_whole(tmp_path / "a", "new")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_a_file_is_told_with_its_name(tmp_path):
    (tmp_path / "out").write_text("in the way")
    with pytest.raises(OutputError, match=r"report\.json"):
        write_whole(tmp_path / "out" / "report.json", "{}")


def test_others_may_read_what_was_written(tmp_path):
    mask = os.umask(0o022)
    try:
        write_whole(tmp_path / "a", b"x")
    finally:
        os.umask(mask)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o644
