import unicodedata

import pytest

from grader.folder.cache import PageCache
from grader.folder.inventory import (
    is_tool_file,
    natural_key,
    shown_name,
    shown_names,
    submissions,
    take_inventory,
)
from grader.owners.pages import assign_pages
from grader.records import PageRef
from grader.tables.measurements import names_of
from grader.tables.roster import parse_roster
from reference.authored.assignment import load_assignment
from tests.inline import Inline

NAMES = names_of(load_assignment("pump"))


def test_the_roster_and_files_of_tools_are_no_submissions(tmp_path):
    for name in (
        "s10.jpg",
        "s2.jpg",
        "notes.txt",
        "roster.csv",
        "class.csv",
        ".DS_Store",
        "Thumbs.db",
        "~$a.csv",
        "layout.json",
    ):
        (tmp_path / name).write_bytes(b"x")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "results.png").write_bytes(b"x")
    (tmp_path / "late").mkdir()
    (tmp_path / "late" / "s3.jpg").write_bytes(b"x")
    found = submissions(tmp_path, tmp_path / "class.csv", [tmp_path / "out"])
    assert [path.relative_to(tmp_path).as_posix() for path in found] == [
        "late/s3.jpg",
        "notes.txt",
        "s2.jpg",
        "s10.jpg",
    ]


def test_results_of_other_runs_are_no_submissions_and_a_students_folder_is_one(tmp_path):
    of_results = ("a/.planmark/run.json", "a/s1/report.json", "b/results.json", "b/summary.csv")
    for name in (*of_results, "b/s1/report.json", "s1/results.json", "s1/sheet.jpg"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    assert submissions(tmp_path) == [tmp_path / "s1" / "sheet.jpg"]


def told_of(folder):
    """An inventory's result for each file of a folder, by the file's name."""
    files = submissions(folder)
    cache = PageCache(folder.parent / "notes")
    contents = take_inventory(files, folder, NAMES, Inline(), lambda *_: None, cache)
    return {
        name: content.refused or content.pages[0].problem
        for name, content in zip(shown_names(files, folder, {}), contents, strict=True)
    }


def test_links_that_lead_elsewhere_or_nowhere_are_told_and_nothing_is_read(tmp_path):
    (tmp_path / "secret.csv").write_text("student_id,v_A\ns99,60\n")
    (tmp_path / "others").mkdir()
    folder = tmp_path / "in"
    folder.mkdir()
    for name, target in {
        "s1.csv": tmp_path / "secret.csv", "s2.jpg": "/nowhere.jpg", "others": tmp_path / "others",
        "loop.pdf": "loop.pdf", "loop.csv": "loop.csv", "gone.jpg": "gone-away.jpg",
    }.items():  # fmt: skip
        (folder / name).symlink_to(target)
    told = told_of(folder)
    assert {name: problem.code for name, problem in told.items()} == {
        "s1.csv": "link_leads_out", "s2.jpg": "link_leads_out", "others": "link_leads_out",
        "loop.pdf": "file_missing", "loop.csv": "measurements_unreadable", "gone.jpg": "file_missing",
    }  # fmt: skip
    assert all(problem.file == name for name, problem in told.items())


def test_a_folder_behind_a_link_is_read_as_any_other(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "s1.jpg").write_bytes(b"x")
    (tmp_path / "link").symlink_to(tmp_path / "in")
    assert told_of(tmp_path / "link")["s1.jpg"].code == "file_type_unsupported"


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("Иванов.jpg", "Иванов.jpg"),
        ("s1\n\x1b[2Jx.jpg", "s1\\n\\x1b[2Jx.jpg"),
        ("s1\u202egpj.pdf", "s1\\u202egpj.pdf"),
        ("S\u0327tefan.jpg", "\u015etefan.jpg"),
        ("شكل.png", "شكل.png"),
        ("CON.jpg", "CON.jpg"),
        ("\U0001f469\u200d\U0001f527.png", "\U0001f469\u200d\U0001f527.png"),
    ],
)
def test_a_name_is_shown_in_its_own_script_and_in_one_line(tmp_path, name, shown):
    assert shown_name(tmp_path / name, tmp_path) == shown


def test_two_names_that_look_the_same_are_told_apart(tmp_path):
    paths = [tmp_path / name for name in ("e\u0301.jpg", "\u00e9.jpg", "a\n.pdf", "a\\n.pdf")]
    assert shown_names(paths, tmp_path, {}) == ["é.jpg", "é (2).jpg", "a\\n.pdf", "a\\n (2).pdf"]


def test_a_roster_finds_scans_however_their_letters_are_composed(tmp_path):
    (tmp_path / "Ştefan.jpg").write_bytes(b"x")
    (tmp_path / unicodedata.normalize("NFD", "é.jpg")).write_bytes(b"x")
    roster = parse_roster(f"student_id,name,scans\ns1,A,{unicodedata.normalize('NFD', 'Ştefan.jpg')};é.jpg\n")
    pages = [PageRef(name) for name in shown_names(submissions(tmp_path), tmp_path, {})]
    owners = assign_pages(pages, roster, "pump")
    assert len(owners.owned) == 2
    assert not owners.problems


def test_numbers_in_names_sort_as_numbers():
    assert sorted(["s10", "s9", "S1", "b"], key=natural_key) == ["b", "S1", "s9", "s10"]


def test_an_ordinary_scan_is_no_tool_file():
    assert not is_tool_file("s07.jpg")
