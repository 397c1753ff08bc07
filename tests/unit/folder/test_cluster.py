"""Data sent to remote workers and received from them: paths, files, images of folders."""

import pickle
from pathlib import Path

import pytest

from grader.cli.grading import address_of
from reference.errors import CallError

fsspec = pytest.importorskip("fsspec")
cluster = pytest.importorskip("grader.folder.cluster")


@pytest.mark.parametrize(
    ("given", "address"),
    [
        ("s3://bucket/class", "s3://bucket/class"),
        ("file:///srv/class", "file:///srv/class"),
        ("memory://class", "memory://class"),
        ("simplecache::s3://bucket/class", "simplecache::s3://bucket/class"),
        ("http://host:80/class", "http://host:80/class"),
        ("class", None),
        ("/srv/class", None),
        ("C:/class", None),
    ],
)
def test_addresses(given, address):
    assert address_of(Path(given)) == address


def test_paths_are_another_folders_on_the_other_side(tmp_path):
    here = {"sheets": tmp_path / "class", "out": tmp_path / "class" / "out"}
    there = {"sheets": Path("/a"), "out": Path("/b")}
    paths = (here["sheets"] / "x" / "s01.pdf", here["out"] / "s01", here["sheets"], Path("elsewhere.toml"))
    data, _ = cluster._pickled(paths, here)
    unpickler = cluster._Unpickler(data, there)
    assert unpickler.load() == (Path("/a/x/s01.pdf"), Path("/b/s01"), Path("/a"), Path("elsewhere.toml"))
    assert unpickler.names == {"x/s01.pdf", "."}
    with pytest.raises(pickle.UnpicklingError):
        pickle.loads(data)  # noqa: S301 - our own


@pytest.fixture
def elsewhere():
    files = fsspec.filesystem("memory")
    files.pipe(
        {"/class/s01.pdf": b"one", "/class/in/s02.pdf": b"two", "/class/roster.csv": b"student_id,name\n"}
    )
    yield files
    files.rm("/class", recursive=True)


def test_an_image_follows_its_folder(elsewhere, tmp_path):
    elsewhere.pipe("/class/decisions.csv", b"of the storage")
    image = cluster.image_of("memory://class", tmp_path)
    names = {path.relative_to(image).as_posix() for path in image.rglob("*") if path.is_file()}
    assert names == {"s01.pdf", "in/s02.pdf", "roster.csv", "decisions.csv"}
    assert (image / "roster.csv").read_bytes() == b"student_id,name\n"
    assert (tmp_path / "decisions.csv").read_bytes() == b"of the storage"
    before = (image / "s01.pdf").stat()
    (tmp_path / "decisions.csv").write_bytes(b"of the review")
    cluster.fill(image)
    assert (image / "s01.pdf").read_bytes() == b"one"

    elsewhere.rm("/class/in/s02.pdf")
    cluster.image_of("memory://class", tmp_path)
    assert not (image / "in" / "s02.pdf").exists()
    assert (image / "s01.pdf").read_bytes() == b"one"
    assert (image / "s01.pdf").stat().st_mtime_ns == before.st_mtime_ns
    assert (tmp_path / "decisions.csv").read_bytes() == b"of the review"

    elsewhere.pipe("/class/s01.pdf", b"another")
    cluster.image_of("memory://class", tmp_path)
    assert not (image / "s01.pdf").stat().st_size
    assert (image / "s01.pdf").stat().st_mtime_ns != before.st_mtime_ns


def test_a_folder_that_is_not_there_or_cannot_be_read(tmp_path):
    with pytest.raises(CallError, match=r"memory://nothing: there is no such folder, or nothing in it"):
        cluster.image_of("memory://nothing", tmp_path)
    with pytest.raises(CallError, match=r"nosuch://x: cannot be read \(ValueError"):
        cluster.image_of("nosuch://x", tmp_path)


@pytest.mark.parametrize("name", ["../x", "a/../../x", "/etc/x"])
def test_no_name_leads_out_of_a_folder(name, tmp_path):
    with pytest.raises(CallError, match="no name of a file below the folder"):
        cluster._inside(tmp_path, name)


def test_a_worker_copies_what_it_needs_once(elsewhere, tmp_path, monkeypatch):
    store = cluster._Store("memory://class", str(tmp_path))
    store.fetch("in/s02.pdf")
    assert (store.folder / "in" / "s02.pdf").read_bytes() == b"two"
    elsewhere.pipe("/class/in/s02.pdf", b"replaced")
    store.fetch("in/s02.pdf")
    assert (store.folder / "in" / "s02.pdf").read_bytes() == b"two"
    store.fetch("gone.pdf")
    assert not (store.folder / "gone.pdf").exists()
    monkeypatch.setattr(cluster, "MAX_FILE_BYTES", 2)
    store.fetch("s01.pdf")
    assert (store.folder / "s01.pdf").read_bytes() == bytes(3)
