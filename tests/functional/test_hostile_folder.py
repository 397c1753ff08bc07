"""A folder in which good work lies beside files that no program should trust: each is told, none is lost."""

import json
import os
import re
from pathlib import Path

import pikepdf
import pytest

from tests import hostile
from tests.inline import planmark

REFUSED = {
    "s10_zero.jpg": "file_empty",
    "s11.jpg": "file_type_unsupported",
    "s12.png": "image_too_large",
    "s13.pdf": "pages_too_many",
    "s14.pdf": "pdf_encrypted",
    "s15.gif": "file_type_unsupported",
    "s16.heic": "image_damaged",
    "s17.pdf": "file_missing",
    "s18.jpg": "file_missing",
    "s19_două pagini 'x' \"y\" ж.jpg": "image_truncated",
    "s21.pdf": "file_missing",
    "s22.jpg": "file_missing",
    "s23.jpg": "link_leads_out",
    "s24_\\n\\x1b[2J\\u202e.jpg": "file_type_unsupported",
    "s25_Петров_1.jpg": "file_type_unsupported",
}
"""The fault of each file, by its owner's name."""
NOBODYS = "bad\udcff\udcfename.jpg"
"""As an archive from a system with another alphabet unpacks it."""


def graded(folder, out, *more):
    return planmark("grade", folder, "--assignment", "pump", "--out", out, *more, cwd=out.parent)


def pdf_of(path, pages, encryption=False):
    document = pikepdf.new()
    first = document.make_indirect(pikepdf.Dictionary(Type=pikepdf.Name.Page, MediaBox=[0, 0, 100, 100]))
    for _ in range(pages):
        document.pages.append(pikepdf.Page(first))
    document.save(path, encryption=encryption)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "s10_zero.jpg").write_bytes(b"")
    (folder / "s11.jpg").write_text("this is my homework\n", encoding="utf-8")
    (folder / "s12.png").write_bytes(hostile.png_of(100_000, 100_000))
    pdf_of(folder / "s13.pdf", 5000)
    pdf_of(folder / "s14.pdf", 1, pikepdf.Encryption(user="a", owner="b"))
    (folder / "s15.gif").write_bytes(b"GIF89a" + bytes(30))
    (folder / "s16.heic").write_bytes(b"\0\0\0\x18ftypheic" + bytes(3000))
    (folder / "s17.pdf").mkdir()
    hostile.pipe(folder / "s18.jpg")
    (folder / "s19_două pagini 'x' \"y\" ж.jpg").write_bytes(b"\xff\xd8\xff\xe0junk")
    hostile.link_to_itself(folder / "s21.pdf")
    hostile.link_to_nothing(folder / "s22.jpg")
    hostile.link_out(folder / "s23.jpg")
    (folder / "s24_\n\x1b[2J\u202e.jpg").write_bytes(b"junk")
    (folder / "s25_Петров_1.jpg").write_bytes(b"junk")
    try:
        (folder / NOBODYS).write_bytes(b"junk")
    except OSError:  # a file system that takes text only
        (folder / NOBODYS.encode("utf-8", "backslashreplace").decode()).write_bytes(b"junk")
    (folder / "s20.json").write_text('{"student_id": "s20", "n": 7, "segments_mm": {"v_A": 60.0}}')
    rows = "".join(f"s{number},Student {number},{'' if number == 16 else 7}\n" for number in range(10, 26))
    (folder / "roster.csv").write_text("student_id,name,n\n" + rows, encoding="utf-8")
    out = folder.parent / (folder.name + "-out")
    assert graded(folder, out).returncode == 1
    return out, json.loads((out / "results.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("name", "code"), REFUSED.items())
def test_what_is_wrong_with_a_file_stands_in_its_owners_report(results, name, code):
    report = next(one for one in results[1]["reports"] if one["student_id"] == name[:3])
    assert report["status"] == "unreadable"
    assert any(problem["code"] == code and name in problem["file"] for problem in report["problems"])
    assert (results[0] / name[:3] / "feedback.html").is_file()


def test_a_damaged_file_is_told_before_a_number_that_nothing_says(results):
    report = next(one for one in results[1]["reports"] if one["student_id"] == "s16")
    assert [problem["code"] for problem in report["problems"]] == ["image_damaged", "variant_unknown"]


def test_a_file_whose_name_is_no_text_is_told_and_is_nobodys(results):
    told = [one["file"] for one in results[1]["unmatched"]]
    assert told == [NOBODYS.encode("utf-8", "backslashreplace").decode()]
    assert "name.jpg" in (results[0] / "index.html").read_text(encoding="utf-8")


def test_the_good_work_beside_them_is_graded(results):
    report = next(one for one in results[1]["reports"] if one["student_id"] == "s20")
    assert report["status"] in {"graded", "needs_review"}
    assert report["criteria"]


@pytest.mark.parametrize("name", ["s1_\n\x1b[2J\u202e.csv", "s1_\n\x1b[2J\u202e.jpg"])
def test_no_name_moves_the_cursor_or_begins_a_line(tmp_path, name):
    folder, out = tmp_path / "in", tmp_path / "out"
    folder.mkdir()
    (folder / name).write_bytes(b"junk")
    run = graded(folder, out, "--log", out / "run.log")
    shown = "s1_\\n\\x1b[2J\\u202e"
    assert shown in run.stdout
    assert shown in (out / "results.json").read_text("utf-8").replace("\\\\", "\\")
    written = [(out / name).read_text("utf-8") for name in ("summary.csv", "run.log")]
    for text in (run.stdout, run.stderr, *written):
        assert not re.search("\x1b|\u202e|s1_\n", text)


def test_a_pipe_with_the_name_of_measurements_is_told_and_not_waited_for(tmp_path: Path):
    folder = tmp_path / "in"
    folder.mkdir()
    os.mkfifo(folder / "class.csv")
    run = graded(folder, tmp_path / "out")
    assert run.returncode == 1
    assert "class.csv: cannot be read: it is a folder or a pipe, not a file" in run.stdout
