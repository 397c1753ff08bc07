"""`planmark.toml`: what is taken from it, and what is told about its faults."""

import pytest

from grader.tables.class_file import read_class_file
from grader.texts.spoken import fault, in_english
from reference.errors import AuthoredFileError
from tests.told import by_path

PLATFORMS = ("csv", "moodle")


def write(folder, text):
    path = folder / "planmark.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_paths_are_relative_to_the_file_and_names_are_the_commands(tmp_path):
    (tmp_path / "roster.csv").touch()
    settings = read_class_file(
        write(
            tmp_path,
            'assignment = "pump"\nroster = "roster.csv"\nlanguage = "ro"\npages = 2\nplatform = "moodle"\n'
            'log = "a/class.log"\n',
        ),
        PLATFORMS,
    )
    assert settings.values == {
        "assignment": "pump",
        "roster": str(tmp_path / "roster.csv"),
        "lang": "ro",
        "pages_per_student": 2,
        "to": "moodle",
        "out": str(tmp_path / "results"),
        "log": str(tmp_path / "a" / "class.log"),
    }
    assert settings.out == tmp_path / "results"


@pytest.mark.parametrize("written", [r"'lists\roster.csv'", '"lists/roster.csv"', r'"lists\\roster.csv"'])
def test_a_path_has_slashes_or_backslashes(tmp_path, written):
    (tmp_path / "lists").mkdir()
    (tmp_path / "lists" / "roster.csv").touch()
    settings = read_class_file(write(tmp_path, f"roster = {written}\n"), PLATFORMS)
    assert settings.values["roster"] == str(tmp_path / "lists" / "roster.csv")


def test_an_absolute_path_stays(tmp_path):
    roster = tmp_path / "elsewhere.csv"
    roster.touch()
    settings = read_class_file(write(tmp_path, f"roster = '{roster}'\n"), PLATFORMS)
    assert settings.values["roster"] == str(roster)


@pytest.mark.parametrize(
    ("text", "path", "advice"),
    [
        ('assignmnt = "pump"', "$.assignmnt", "did you mean assignment?"),
        ('assignment = "pmup"', "$.assignment", "built-in ones are"),
        ('assignment = "mine.toml"', "$.assignment", "the path of a .toml file"),
        ('roster = "r.csv"', "$.roster", "relative to the folder of this file"),
        ('roster = ""', "$.roster", "is no path"),
        ('roster = "lists\\roster.csv"', "$.roster", "between single quotes"),
        ('roster = "C:\\Users\\ana.csv"', "line 1", "between single quotes"),
        ('language = "de"', "$.language", "'en', 'ro', 'ru'"),
        ("pages = 0", "$.pages", "must be >= 1"),
        ('pages = "2"', "$.pages", "without quotes"),
        ('platform = "canva"', "$.platform", "csv, moodle"),
        ("roster = ", "line 1", "is not TOML: roster = (the value behind the equals sign is missing)"),
    ],
)
def test_a_fault_is_told_with_file_key_and_what_to_do(tmp_path, text, path, advice):
    file = write(tmp_path, f"{text}\n")
    with pytest.raises(AuthoredFileError) as caught:
        read_class_file(file, PLATFORMS)
    (finding,) = caught.value.findings
    assert list(by_path([finding])) == [path]
    assert advice in fault(finding)
    assert str(file) in in_english(caught.value)


def test_all_faults_are_told_at_once(tmp_path):
    with pytest.raises(AuthoredFileError) as caught:
        read_class_file(write(tmp_path, 'assignment = "pmup"\nroster = "r.csv"\nplatform = "x"\n'), PLATFORMS)
    assert [finding.path for finding in caught.value.findings] == ["$.assignment", "$.roster", "$.platform"]
