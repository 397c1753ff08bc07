"""Moodle's offline grading worksheet."""

import csv
import io

import pytest

from grader.lms.export import export
from grader.lms.grades import Options, Person, grades_of
from grader.lms.moodle import LOCKED, fill_worksheet
from reference.errors import CallError, InputFileError
from tests.unit.lms.classroom import criterion, report, results

HEADER = (
    "Identifier,Full name,Email address,Status,Grade,Maximum grade,Grade can be changed,"
    "Last modified (submission),Online text,Last modified (grade),Feedback comments"
)
PEOPLE = {
    "s01": Person(name="Ion Popescu", email="ion@x.ro"),
    "s02": Person(name="Ana Ionescu", email="ana@x.ro"),
}


def line(
    number, name="Ion Popescu", email="ion@x.ro", *, grade="", maximum="10.00", changeable="Yes", text="-"
):
    who = f'Participant {number},"{name}",{email},"No submission - "'
    return f"{who},{grade},{maximum},{changeable},-,{text},-,"


def worksheet(*lines, header=HEADER, end="\r\n"):
    return end.join([header, *lines, ""]).encode()


def graded(*reports):
    return grades_of(results(*reports))


def filled_in(data, *reports, people=PEOPLE, comments=None, **how):
    options = Options(to="moodle", people=people, **how)
    grades = graded(*reports)
    return fill_worksheet(data, "grades.csv", grades, options, comments or {}).among(grades)


def rows(data):
    return list(csv.DictReader(io.StringIO(data.decode("utf-8-sig"), newline="")))


def test_only_grade_and_feedback_change_and_the_rest_stays_to_the_byte():
    data = worksheet(line(101, text='"a\n""b"", c"'), line(102, "=Ana", "ana@x.ro"), end="\r\n")
    data = b"\xef\xbb\xbf" + data
    found = filled_in(data, report("s01", 7.5), comments={"s01": "<p>Good, mostly</p>"})
    expected = data.decode().replace(',,10.00,Yes,-,"a', ',7.5,10.00,Yes,-,"a')
    expected = expected.replace('""b"", c",-,', '""b"", c",-,"<p>Good, mostly</p>"', 1)
    assert found.content.decode() == expected
    assert found.written == ("s01",)


def test_a_worksheet_without_changes_comes_back_as_it_was():
    data = worksheet(line(101), line(102, "Ana Ionescu", "ana@x.ro", grade='"3.00"'))
    assert filled_in(data, report("s01", None, status="needs_review")).content == data


def test_grades_have_decimal_dots():
    assert rows(filled_in(worksheet(line(101)), report("s01", 7.25)).content)[0]["Grade"] == "7.25"


def test_grades_that_moodle_holds_already_are_changed_and_told():
    found = filled_in(worksheet(line(101, grade="3.00")), report("s01", 5.0))
    assert rows(found.content)[0]["Grade"] == "5"
    assert found.notes[0].startswith("1 grade(s) that Moodle holds already")


def test_a_grade_that_moodle_holds_already_stays_as_it_is_written():
    data = worksheet(line(101, grade="5.00"))
    found = filled_in(data, report("s01", 5.0))
    assert (found.content, found.written, found.notes) == (data, ("s01",), ())


def test_what_waits_for_a_person_stays_blank():
    data = worksheet(line(101), line(102, "Ana Ionescu", "ana@x.ro"))
    found = filled_in(data, report("s01", 5.0), report("s02", None, status="needs_review"))
    assert [row["Grade"] for row in rows(found.content)] == ["5", ""]


def test_a_grade_that_moodle_holds_for_a_withheld_student_stays_and_is_told():
    data = worksheet(line(101, grade="3.00"), line(102, "Ana Ionescu", "ana@x.ro"))
    waiting = report("s01", None, status="needs_review"), report("s02", None, status="missing")
    found = filled_in(data, *waiting)
    assert found.content == data
    assert found.notes == ("withheld, and a grade is there already, which stays: s01 (3.00)",)


def test_comments_that_moodle_holds_already_are_replaced_and_told():
    data = worksheet(line(101) + "well done", line(102, "Ana Ionescu", "ana@x.ro"))
    comments = {"s01": "<p>a</p>", "s02": "<p>b</p>"}
    found = filled_in(data, report("s01", 5.0), report("s02", 5.0), comments=comments)
    assert found.notes == ("1 comment(s) that Moodle holds already are replaced",)
    again = filled_in(found.content, report("s01", 5.0), report("s02", 5.0), comments=comments)
    assert again.notes == ()


def test_students_are_found_by_address_before_name():
    data = worksheet(line(101, "Ana Ionescu", "ion@x.ro"), line(102, "Ion Popescu", "ana@x.ro"))
    found = filled_in(data, report("s01", 5.0), report("s02", 6.0))
    assert [row["Grade"] for row in rows(found.content)] == ["5", "6"]


def test_names_that_two_rows_bear_are_nobodys_and_told():
    data = worksheet(line(101, email="a@x.ro"), line(102, email="b@x.ro"))
    found = filled_in(data, report("s01", 5.0), people={"s01": Person(name="ion  popescu")})
    assert found.written == ()
    assert "rows 2, 3" in found.unplaced["s01"]


def test_a_row_that_fits_two_students_is_given_to_neither():
    twin = {"s01": Person(email="ion@x.ro"), "s02": Person(name="Ion Popescu")}
    found = filled_in(worksheet(line(101)), report("s01", 5.0), report("s02", 6.0), people=twin)
    assert found.written == ()
    assert set(found.unplaced) == {"s01", "s02"}


def test_students_who_are_not_in_the_worksheet_are_told():
    found = filled_in(worksheet(line(101)), report("s01", 5.0), report("s09", 6.0))
    assert list(found.unplaced) == ["s09"]


def test_a_locked_grade_is_left_and_told():
    data = worksheet(line(101, changeable="No"))
    found = filled_in(data, report("s01", 5.0))
    assert (found.content, found.unplaced) == (data, {"s01": LOCKED})


def test_another_maximum_is_refused_unless_rescaling_is_asked_for():
    data = worksheet(line(101, maximum="100.00"))
    with pytest.raises(CallError, match="maximum there is 100"):
        filled_in(data, report("s01", 7.5))
    assert rows(filled_in(data, report("s01", 7.5), rescale=True).content)[0]["Grade"] == "75"


def test_a_worksheet_downloaded_in_romanian_or_russian_is_understood():
    romanian = (
        "Identificator,Nume complet,Adresă de email,Notă,Notă maximă,Nota poate fi schimbată,"
        "Ultima modificare (nota)"
    )
    data = worksheet('Participant 7,Ion Popescu,ion@x.ro,,"10,00",Da,-', header=romanian)
    assert b",8.5," in filled_in(data, report("s01", 8.5)).content
    russian = "Идентификатор,Полное имя,Адрес электронной почты,Оценка,Последнее изменение (оценка)"
    data = worksheet("Участник 7,Ion Popescu,ion@x.ro,,-", header=russian)
    assert b",8.5,-" in filled_in(data, report("s01", 8.5)).content


@pytest.mark.parametrize("feedback", ["Comentarii de feedback", "Comentarii feedback", "Feedback comments"])
def test_columns_of_people_are_known_by_what_stands_in_them_where_their_names_are_not(feedback):
    header = f"Identificator,Numele,Poșta,Notă,Notă maximă,Ultima modificare (nota),{feedback}"
    data = worksheet(
        'Participant 7,Ion Popescu,x@x.ro,,"10,00",-,',
        'Participant 8,Ana Ionescu,ana@x.ro,,"10,00",-,',
        header=header,
    )
    found = filled_in(data, report("s01", 8.5), report("s02", 6.0), comments={"s01": "<p>a</p>"})
    assert found.written == ("s02",)
    assert "another email" in found.unplaced["s01"]
    people = {"s01": Person(name="Ion Popescu")}
    found = filled_in(data, report("s01", 8.5), people=people, comments={"s01": "<p>a</p>"})
    assert b'x@x.ro,8.5,"10,00",-,<p>a</p>' in found.content


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "empty"),
        (worksheet(line(101), header=HEADER.replace("Identifier", "Id")), "no column 'Identifier'"),
        (worksheet(line(101), header=HEADER.replace("Grade,Max", "Mark,Max")), "no column 'Grade'"),
        (worksheet(line(101), header=HEADER.replace("Last modified (grade)", "x")), "Last modified"),
        (worksheet(line(101) + ",extra"), "row 2: has 12 cells"),
        (worksheet(line(101), line(101, email="b@x.ro")), "same participant"),
        (worksheet(line("x")), "is not 'Participant' and a number"),
        (worksheet(line(101, maximum="ten")), "maximum grade 'ten'"),
        (worksheet(line(101, maximum="0.00")), "maximum grade '0.00' is no positive"),
        (worksheet(line(101), line(102, grade='"7,5"')), "row 3: the grade '7,5' has a comma.*would store 7"),
        (worksheet(line(101), line(102, grade="abc")), "row 3: the grade 'abc' is no number"),
        (worksheet(line(101), line(102, grade="10.5")), "row 3: the grade '10.5' is above the maximum"),
        (worksheet(line(101), header=HEADER.replace("Status", "Grade")), "2 columns 'Grade'"),
        (
            worksheet(",Participant 1,,-", header="Feedback comments,Identifier,Grade,Last modified (grade)"),
            "first column",
        ),
        (worksheet(line(101), header=HEADER.replace("Maximum grade", "Scale")), "graded by a scale"),
        (worksheet(line(101)).decode().encode("utf-16"), "not UTF-8"),
        (worksheet(line(101)).replace(b",", b";"), "no column"),
    ],
)
def test_what_moodle_would_swallow_is_refused(data, told):
    with pytest.raises(InputFileError, match=told):
        filled_in(data, report("s01", 5.0))


def test_empty_lines_are_passed_over_as_moodle_does():
    data = worksheet(line(101), "", "")
    assert filled_in(data, report("s01", 5.0)).written == ("s01",)


def test_nothing_is_written_when_the_worksheet_is_refused(tmp_path):
    sheet = tmp_path / "grades.csv"
    sheet.write_bytes(worksheet(line(101) + ",extra"))
    with pytest.raises(InputFileError):
        export(
            results(report("s01", 5.0)), tmp_path / "out.csv", Options(to="moodle", form=sheet, people=PEOPLE)
        )
    assert not (tmp_path / "out.csv").exists()


def test_the_delivery_lists_who_is_withheld_and_why(tmp_path):
    sheet = tmp_path / "grades.csv"
    sheet.write_bytes(worksheet(line(101), line(102, "Ana Ionescu", "ana@x.ro")))
    told = export(
        results(
            report("s01", 5.0, criteria=[criterion("v_A", "none", 0.0, 'Off by <b> & "more"')]),
            report("s02", None, status="needs_review"),
        ),
        tmp_path / "out.csv",
        Options(to="moodle", form=sheet, people=PEOPLE, lang="ro"),
    )  # fmt: skip
    assert told.withheld == {"s02": "needs review"}
    assert not told.is_complete
    assert "&lt;b&gt; &amp;" in rows((tmp_path / "out.csv").read_bytes())[0]["Feedback comments"]
