"""Broken files are told by their own names and places, with what to do, in the words of the author."""

import re

import pytest

from tests.functional.broken_files import CASES, FILES, Case, M, R, T, told

HINTS = {"no translation", "no translation of a criterion"}


@pytest.fixture(scope="module")
def messages():
    return {one.case: one for one in told(CASES)}


def test_there_are_a_hundred_cases_of_different_names():
    assert len(CASES) >= 100
    assert len({case.title + case.file for case in CASES}) == len(CASES)


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.file}: {case.title}")
def test_a_broken_file_is_told_with_its_name_and_its_place(case, messages):
    one = messages[case]
    assert one.error is None
    assert one.line, "\n".join(one.lines)
    assert (one.status == 0) == (case.title in HINTS)
    text = "\n".join(one.lines)
    assert not re.search(r"Traceback|/tmp/|rubrics/|Input should|List should|String should|NoneType", text)


def test_faults_of_several_files_are_told_together():
    cases = [
        Case("", M, 'type = "RRR"', 'type = "rrr"', ""),
        Case("", T, "2,90,250", "2,9O,250", ""),
        Case("", R, "points = 2.0", 'points = "2"', ""),
    ]

    class All(Case):
        def write(self, folder):
            Case.write(self, folder)
            for case in cases:
                (folder / case.file).write_text(case.broken(FILES[case.file]), encoding="utf-8")

    (one,) = told([All("", "", "", "", "")])
    named = [line for line in one.lines if re.search(r"\.(toml|csv):$", line)]
    assert ["mechanism" in named[0], "course.csv" in named[1], "rubric" in named[2]] == [True] * 3
    assert any("did you mean RRR?" in line for line in one.lines)
