"""Archives are unpacked within limits: nothing is lost, and nothing is written elsewhere."""

import io
import zipfile
from pathlib import Path

import pytest

from grader.folder import archives
from grader.records import Reason

PICTURE = bytes(range(256)) * 40


def zipped(path: Path, files: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def codes(found: archives.Unpacked) -> dict[str, str]:
    return {name: one.code if isinstance(one, Reason) else "" for name, one in found}


def test_what_cannot_be_taken_is_a_problem_and_the_rest_is_there(tmp_path: Path) -> None:
    inner = io.BytesIO()
    zipfile.ZipFile(inner, "w").close()
    moodles, long = "Ana Pop_1_assignsubmission_file_/скан.jpg", "a" * 3000 + ".jpg"
    out = ["../../outside.jpg", "C:\\outside.jpg", "/outside.jpg"]
    passed_over = dict.fromkeys(["__MACOSX/a.jpg", "b/.DS_Store", "b/onlinetext.html"], b"")
    files = dict.fromkeys([moodles, *out, long, "two\nlines.jpg"], PICTURE) | passed_over
    files |= {"inner.ZIP": inner.getvalue(), "bomb.tif": bytes(40_000_000)}
    into = tmp_path / "out" / "unpacked"
    found = codes(archives.unpack(zipped(tmp_path / "a.zip", files), into))
    assert found == {
        **{name.replace("\\", "/"): "archive_name" for name in out},
        "inner.ZIP": "archive_nested",
        "bomb.tif": "archive_too_large",
        **dict.fromkeys([moodles, long, "two\\nlines.jpg"], ""),
    }
    assert not list(tmp_path.rglob("outside*"))
    assert len(list(into.iterdir())) == 3
    assert {path.suffix for path in into.iterdir()} == {".jpg"}


def test_encrypted_cut_off_and_changed_archives_are_told(tmp_path: Path) -> None:
    archive = zipped(tmp_path / "a.zip", {"s01.jpg": PICTURE, "s02.jpg": PICTURE})
    whole = bytearray(archive.read_bytes())
    for at in (whole.find(b"PK\3\4") + 6, whole.find(b"PK\1\2") + 8):
        whole[at] |= 1
    archive.write_bytes(whole)
    assert codes(archives.unpack(archive, tmp_path / "u")) == {"s01.jpg": "archive_encrypted", "s02.jpg": ""}
    whole = bytearray(zipped(archive, {"s01.jpg": PICTURE, "s02.jpg": PICTURE}).read_bytes())
    whole[60] ^= 255
    archive.write_bytes(whole)
    assert codes(archives.unpack(archive, tmp_path / "u")) == {"s01.jpg": "archive_damaged", "s02.jpg": ""}
    for content in (whole[:-30], b"", b"no archive"):
        archive.write_bytes(content)
        assert codes(archives.unpack(archive, tmp_path / "u")) == {"": "archive_damaged"}
    assert codes(archives.unpack(zipped(archive, {}), tmp_path / "u")) == {"": "archive_damaged"}
    assert not list((tmp_path / "u").iterdir())


def test_too_many_files_or_bytes_are_refused_before_any_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    archive = zipped(tmp_path / "a.zip", {f"{number}.jpg": PICTURE for number in range(4)})
    monkeypatch.setattr(archives, "MOST_FILES", 3)
    assert codes(archives.unpack(archive, tmp_path / "u")) == {"": "archive_too_large"}
    monkeypatch.undo()
    monkeypatch.setattr(archives, "_MOST_BYTES", 3 * len(PICTURE))
    assert codes(archives.unpack(archive, tmp_path / "u")) == {"": "archive_too_large"}
    assert not (tmp_path / "u").exists()


@pytest.mark.parametrize(("encoding", "name"), [("utf-8", "Ștefan_1_x.jpg"), ("cp866", "Иванов Пётр.jpg")])
def test_names_in_other_encodings_are_read(tmp_path: Path, encoding: str, name: str) -> None:
    archive = zipped(tmp_path / "a.zip", {"x" * len(name.encode(encoding)): PICTURE})
    raw = archive.read_bytes().replace(b"x" * len(name.encode(encoding)), name.encode(encoding))
    archive.write_bytes(raw)
    assert codes(archives.unpack(archive, tmp_path / "u")) == {name: ""}


def test_gradescopes_list_says_in_the_names_whose_the_files_are(tmp_path: Path) -> None:
    told = (
        "submission_1:\n  :submitters:\n  - :name: Pop, Ana\n    :sid: '101'\n    :email: ana@x.ro\n"
        "  :score: 2.0\n22.pdf:\n  :submitters:\n  - :name: A B\n  - :name: C D\n    :sid: s02\n"
        "submission_3:\n  :submitters: []\n"
    )
    files = {"export/submission_metadata.yml": told.encode()}
    files |= {f"export/{name}": PICTURE for name in ("submission_1/a.jpg", "22.pdf", "submission_3/b.jpg")}
    assert set(codes(archives.unpack(zipped(tmp_path / "a.zip", files), tmp_path / "u"))) == {
        "export/submission_1 [Pop  Ana, 101, ana@x.ro]/a.jpg",
        "export/22 [A B; C D, s02].pdf",
        "export/submission_3/b.jpg",
    }  # fmt: skip
