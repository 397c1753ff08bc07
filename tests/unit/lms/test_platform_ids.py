"""The platform's numbers of students."""

import pytest

from grader.lms.grades import Person
from grader.lms.table import with_ids
from reference.errors import InputFileError


def told(tmp_path, text, people=None):
    path = tmp_path / "ids.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return with_ids(people or {}, path)


def test_numbers_join_what_the_roster_tells(tmp_path):
    people = {"s01": Person(name="Ion", email="ion@x.ro"), "s02": Person(name="Ana")}
    found = told(tmp_path, "student_id,id,username,participant\ns01,4711,ion,103\ns03,,,\n", people)
    assert found == {
        "s01": Person("Ion", "ion@x.ro", "ion", "4711", 103),
        "s02": Person(name="Ana"),
        "s03": Person(),
    }


@pytest.mark.parametrize(
    "text",
    ["\ufeffstudent_id;id\r\ns01;4711\r\n", "student_id,id\n\ns01,4711\n\n", "id,student_id\n4711, s01\n"],
)
def test_marks_semicolons_and_blank_lines_do_not_matter(tmp_path, text):
    assert told(tmp_path, text)["s01"].platform_id == "4711"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "found: nothing"),
        ("student_id,id\n", "rows: 0"),
        ("student,id\ns01,1\n", "columns out of student_id, id, username, participant"),
        ("student_id,mail\ns01,1\n", "columns out of"),
        ("student_id,id,id\ns01,1,2\n", "columns out of"),
        ("student_id,id\ns01\n", "line 2: has 1 cells"),
        ("student_id,id\n,5\n", "line 2: no student_id"),
        ("student_id,id\ns01,1\nS01,2\n", "line 3: the same student_id 'S01' as in line 2"),
        ("student_id,id\ns01,1\ns02,1\n", "line 3: the same id '1' as in line 2"),
        ("student_id,participant\ns01,Participant 5\n", "'Participant 5' is no participant's number"),
        ('student_id,id\n"s01,1\n', "line 2"),
        (b"\xff\xfe", "not UTF-8"),
    ],
)
def test_a_table_with_faults_is_refused_with_the_line(tmp_path, text, why):
    with pytest.raises(InputFileError, match=why):
        told(tmp_path, text)


def test_a_table_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputFileError, match="cannot be read"):
        with_ids({}, tmp_path / "none.csv")
