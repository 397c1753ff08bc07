"""A file that may not be read, or a folder in its place: told with its name, whoever runs the tests."""

import builtins
import errno
import io
import os

import pytest

from grader.folder.batch import Batch, grade
from grader.rubric import rubric_of
from grader.tables.class_file import read_class_file
from grader.tables.decisions import read_table
from grader.tables.roster import read_roster
from grader.texts.spoken import in_english
from reference.authored.assignment import load_assignment
from reference.errors import PlanmarkError
from tests.inline import Inline

READ = {
    "roster.csv": read_roster,
    "planmark.toml": lambda path: read_class_file(path, ()),
    "decisions.csv": read_table,
    "mine.assignment.toml": load_assignment,
}


@pytest.fixture
def denied(monkeypatch):
    """Names of files that may not be opened: root may open all."""
    names = set()

    def guarded(opened):
        def checked(file, *arguments, **known):
            if str(file).rpartition(os.sep)[2] in names:
                raise PermissionError(errno.EACCES, "Permission denied", str(file))
            return opened(file, *arguments, **known)

        return checked

    for module in (builtins, io, os):
        monkeypatch.setattr(module, "open", guarded(module.open))
    return names


@pytest.mark.parametrize("is_folder", [False, True])
@pytest.mark.parametrize("name", READ)
def test_what_cannot_be_read_is_told_by_its_name(tmp_path, denied, name, is_folder):
    path = tmp_path / name
    if is_folder:
        path.mkdir()
    else:
        path.write_text("student_id\ns1\n")
        denied.add(name)
    with pytest.raises(PlanmarkError) as raised:
        READ[name](path)
    told = in_english(raised.value)
    assert "cannot be read" in told
    assert name in told
    assert ("Permission denied" in told) is not is_folder


def test_an_unreadable_sheet_is_that_students_problem_alone(tmp_path, denied):
    folder = tmp_path / "class"
    folder.mkdir()
    for student in ("s1", "s2"):
        text = '{"student_id": "%s", "n": 7, "segments_mm": {"v_A": 60}}' % student  # noqa: UP031 - braces
        (folder / f"{student}.json").write_text(text)
    (folder / "s3.jpg").write_bytes(b"\xff\xd8\xff")
    (folder / "roster.csv").write_text("student_id,name\ns1,A\ns2,B\ns3,C\n")
    denied |= {"s1.json", "s3.jpg"}
    pump = load_assignment("pump")
    batch = Batch(pump, rubric_of(pump), folder, tmp_path / "out")
    reports = {one.student_id: one for one in grade(batch, lambda *_: None, Inline()).reports}
    for student, file in (("s1", "s1.json"), ("s3", "s3.jpg")):
        assert reports[student].status == "unreadable"
        problems = [(one.file, one.message) for one in reports[student].problems]
        assert any(name == file and "Permission denied" in message for name, message in problems), problems
    assert reports["s2"].status != "unreadable"
