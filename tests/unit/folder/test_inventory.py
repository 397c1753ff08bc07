from grader.folder.inventory import is_tool_file, natural_key, submissions


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


def test_a_link_out_of_the_folder_is_no_submission(tmp_path):
    (tmp_path / "secret.jpg").write_bytes(b"x")
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "s1.jpg").symlink_to(tmp_path / "secret.jpg")
    assert submissions(folder) == []


def test_numbers_in_names_sort_as_numbers():
    assert sorted(["s10", "s9", "S1", "b"], key=natural_key) == ["b", "S1", "s9", "s10"]


def test_an_ordinary_scan_is_no_tool_file():
    assert not is_tool_file("s07.jpg")
