"""Moodle's offline grading worksheet, its gradebook import, and the archive of feedback files."""

import csv
import io
import zipfile
from datetime import UTC, datetime

import pytest

from grader.lms.grades import Options, Person, grades_of
from grader.lms.moodle import fill_worksheet
from grader.lms.moodle import gradebook as drafted
from grader.records import Reason
from reference.errors import CallError, InputFileError
from tests.unit.lms import importers
from tests.unit.lms.classroom import criterion, left_out, marked, moodle, notes, report, results

# The worksheet -------------------------------------------------------------------------------------
HEADER = (
    "Identifier,Full name,Email address,Status,Grade,Maximum grade,Grade can be changed,"
    "Last modified (submission),Online text,Last modified (grade),Feedback comments"
)
DOWNLOADED = datetime(2026, 3, 2, 10, 30, tzinfo=UTC)
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


def filled_in(data, *reports, people=PEOPLE, comments=None, **how):
    options = Options(to="moodle", people=people, **how)
    grades = grades_of(results(*reports), options)
    return fill_worksheet(data, "grades.csv", grades, options, comments or {}, DOWNLOADED).among(grades)


def rows(data):
    return list(csv.DictReader(io.StringIO(data.decode("utf-8-sig"), newline="")))


def test_only_grade_and_feedback_change_and_the_rest_stays_to_the_byte():
    data = worksheet(line(101, text='"a\n""b"", c"'), line(102, "=Ana", "ana@x.ro"), end="\r\n")
    data = b"\xef\xbb\xbf" + data
    delivery = filled_in(data, report("s01", 7.5), comments={"s01": "<p>Good, mostly</p>"})
    expected = data.decode().replace(',,10.00,Yes,-,"a', ',7.5,10.00,Yes,-,"a')
    expected = expected.replace('""b"", c",-,', '""b"", c",-,"<p>Good, mostly</p>"', 1)
    expected = expected[: expected.index("Participant 102")]
    assert delivery.content.decode() == expected
    assert delivery.written == ("s01",)


def test_grades_that_moodle_holds_already_are_changed_and_told():
    delivery = filled_in(worksheet(line(101, grade="3.00")), report("s01", 5.0))
    assert rows(delivery.content)[0]["Grade"] == "5"
    assert notes(delivery)[1].startswith("grades changed that Moodle has already: 1")


def test_a_grade_that_moodle_holds_already_stays_as_it_is_written():
    data = worksheet(line(101, grade="5.00"))
    delivery = filled_in(data, report("s01", 5.0))
    assert (delivery.content, delivery.written) == (data, ("s01",))
    assert delivery.notes == (Reason("updates", {"count": 0}),)


def test_comments_that_moodle_holds_already_are_replaced_and_told():
    data = worksheet(line(101) + "well done", line(102, "Ana Ionescu", "ana@x.ro"))
    comments = {"s01": "<p>a</p>", "s02": "<p>b</p>"}
    delivery = filled_in(data, report("s01", 5.0), report("s02", 5.0), comments=comments)
    assert notes(delivery)[1:] == ["comments replaced that Moodle has already: 1"]
    # Moodle shows a comment without its tags.
    shown = delivery.content.replace(b"<p>a</p>", b"a ")
    again = filled_in(shown, report("s01", 5.0), report("s02", 5.0), comments=comments)
    assert notes(again)[1:] == []


def test_students_are_found_by_address_before_name():
    data = worksheet(line(101, "Ana Ionescu", "ion@x.ro"), line(102, "Ion Popescu", "ana@x.ro"))
    delivery = filled_in(data, report("s01", 5.0), report("s02", 6.0))
    assert [row["Grade"] for row in rows(delivery.content)] == ["5", "6"]


def test_names_that_two_rows_bear_are_nobodys_and_told():
    data = worksheet(line(101, email="a@x.ro"), line(102, email="b@x.ro"))
    delivery = filled_in(data, report("s01", 5.0), people={"s01": Person(name="ion  popescu")})
    assert delivery.written == ()
    assert "rows 2 (Ion Popescu, a@x.ro), 3 (Ion Popescu, b@x.ro)" in left_out(delivery)["s01"]


@pytest.mark.parametrize(
    ("roster", "there"),
    [
        ("Ștefan Țurcanu", "Ştefan Ţurcanu"), ("Соловьёв Пётр", "Петр Соловьев"),
        ("O’Brien Seán", "Sean O'Brien"), ("Мар'яна Коваль", "Марʼяна Коваль"),
        ("POPESCU, Ion", "Ion Popescu"),
        ("Иванова Мария Петровна", "Мария Иванова"), ("Ana-Maria Ciobanu", "Ciobanu Ana Maria"),
    ],
)  # fmt: skip
def test_names_fit_over_accents_order_and_apostrophes(roster, there):
    data = worksheet(line(101, there), line(102, "Ana Ionescu", "ana@x.ro"))
    delivery = filled_in(data, report("s01", 5.0), people={"s01": Person(name=roster)})
    assert [row["Grade"] for row in rows(delivery.content)] == ["5"]
    assert "found by name alone" in notes(delivery)[-1]


def test_a_name_that_fits_two_rows_in_part_is_nobodys():
    data = worksheet(line(101, "Мария Иванова"), line(102, "Мария Петровна", "ana@x.ro"))
    people = {"s01": Person(name="Иванова Мария Петровна")}
    assert filled_in(data, report("s01", 5.0), people=people).unplaced.keys() == {"s01"}


def test_a_locked_grade_is_left_and_told():
    data = worksheet(line(101, changeable="No"))
    delivery = filled_in(data, report("s01", 5.0))
    assert (rows(delivery.content), delivery.unplaced) == ([], {"s01": Reason("grade_locked")})


def test_a_worksheet_that_states_no_maximum_needs_one():
    russian = "Идентификатор,Полное имя,Адрес электронной почты,Оценка,Последнее изменение (оценка)"
    data = worksheet("Участник 7,Ion Popescu,ion@x.ro,,-", header=russian)
    with pytest.raises(CallError, match="no maximum grade"):
        filled_in(data, report("s01", 8.5))
    assert b",8.5,-" in filled_in(data, report("s01", 8.5), maximum=10.0).content
    with pytest.raises(CallError, match="maximum there is 100"):
        filled_in(data, report("s01", 8.5), maximum=100.0)


DATED = "Identificator,Nume complet,Adresa de e-mail,Notă,Notă maximă,Ultima modificare (nota)"


@pytest.mark.parametrize(
    ("written", "local"),
    [
        ("luni, 23 noiembrie 2026, 20:35", "2026-11-23 20:35"),
        ("Luni, 23 Noiembrie 2026, 8:35 PM", "2026-11-23 20:35"),
        ("marți, 3 martie 2026, 08:05", "2026-03-03 08:05"),
        ("marti, 3 martie 2026, 12:05 a.m.", "2026-03-03 00:05"),
        ("sâmbătă, 2 mai 2026, 12:05 p.m.", "2026-05-02 12:05"),
        ("понедельник, 23 ноября 2026, 20:35", "2026-11-23 20:35"),
        ("Понедельник, 23 Ноябрь 2026, 20:35", "2026-11-23 20:35"),
        ("понедельник, 23 ноября 2026 г., 8:35 после полудня", "2026-11-23 20:35"),
        ("суббота 2 мая 2026 12:05 до полудня", "2026-05-02 00:05"),
        ("вторник, 3\u00a0марта 2026, 8:05", "2026-03-03 08:05"),
        ("Montag, 2. März 2026, 10:15", None), ("maanantai, 2 marraskuuta 2026, 10:15", None),
        ("marți, 31 februarie 2026, 08:05", None), ("luni, 23 noiembrie 2026, 20:35 GMT", None),
        ("luni, 23 noiembrie 2026, 28:35", None),
    ],
)  # fmt: skip
def test_a_romanian_or_russian_date_becomes_the_same_time_and_another_that_of_the_file(written, local):
    """PHP's strtotime knows English: importgradeslib.php, assignfeedback_offline_grade_importer::next."""
    row = f'Participant7,Ion Popescu,ion@x.ro,"3,00","10,00","{written}"'
    delivery = filled_in(worksheet(row, header=DATED), report("s01", 5.0))
    last = local or "2026-03-02T10:30:00+00:00"
    assert delivery.content.decode().splitlines()[1].endswith(f',5,"10,00",{last}')
    assert any("grades given in between are overwritten" in note for note in notes(delivery)) == (not local)


def test_a_grade_is_rounded_as_moodle_shows_it_and_the_same_grade_is_no_change():
    data = worksheet(line(101, grade="6.67", maximum="10.00"), line(102, "Ana", "ana@x.ro", maximum="10.0"))
    delivery = filled_in(data, report("s01", 20.0 / 3.0), report("s02", 20.0 / 3.0))
    assert [row["Grade"] for row in rows(delivery.content)] == ["6.67", "6.7"]
    assert delivery.notes[0] == Reason("updates", {"count": 1})


@pytest.mark.parametrize("feedback", ["Comentarii de feedback", "Comentarii feedback", "Feedback comments"])
def test_columns_of_people_are_known_by_what_stands_in_them_where_their_names_are_not(feedback):
    header = f"Identificator,Numele,Poșta,Notă,Notă maximă,Ultima modificare (nota),{feedback}"
    data = worksheet(
        'Participant 7,Ion Popescu,x@x.ro,,"10,00",-,',
        'Participant 8,Ana Ionescu,ana@x.ro,,"10,00",-,',
        header=header,
    )
    delivery = filled_in(data, report("s01", 8.5), report("s02", 6.0), comments={"s01": "<p>a</p>"})
    assert delivery.written == ("s02",)
    assert "another email" in left_out(delivery)["s01"]
    people = {"s01": Person(name="Ion Popescu")}
    delivery = filled_in(data, report("s01", 8.5), people=people, comments={"s01": "<p>a</p>"})
    assert b'x@x.ro,8.5,"10,00",-,<p>a</p>' in delivery.content


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "empty"),
        (worksheet(line("x"), header=HEADER.replace("Identifier", "Id")), "column Identifier is missing"),
        (worksheet("Participant 7,x", header="Identifier,Mark"), "column Grade is missing"),
        (worksheet("Participant 7,7.0,10.0", header="Identifier,Grade,Maximum grade"), "Last modified"),
        (worksheet(line(101) + ",extra"), "row 2: has 12 fields"),
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
        (worksheet(line(101)).replace(b",", b";"), "is missing"),
    ],
)
def test_what_moodle_would_swallow_is_refused(data, why):
    with pytest.raises(InputFileError, match=why):
        filled_in(data, report("s01", 5.0))


def test_empty_lines_are_passed_over_as_moodle_does():
    data = worksheet(line(101), "", "")
    assert filled_in(data, report("s01", 5.0)).written == ("s01",)


# The gradebook -------------------------------------------------------------------------------------


def lines(text):
    return list(csv.reader(io.StringIO(text, newline="")))


def gradebook(*reports, people=None, item="Pump", **how):
    options = Options(to="moodle", people=people or {}, item=item, **how)
    return drafted(grades_of(results(*reports), options), options).content


def users_and_grades(text):
    return [row[:2] for row in lines(text)]


def test_a_score_under_review_is_withheld_too():
    text = gradebook(report("s01", 7.5), report("s02", 5.0, status="needs_review"))
    assert users_and_grades(text)[1:] == [["s01", "7.5"]]


def test_users_by_address_come_from_the_roster():
    text = gradebook(report("s01", 7.5), people={"s01": Person(email="ion@x.ro")}, identity="email")
    assert users_and_grades(text)[1] == ["ion@x.ro", "7.5"]


@pytest.mark.parametrize(
    ("people", "identity", "message"),
    [
        ({}, "email", "s01: has no email; the roster gives"),
        ({"s01": Person(email="ion")}, "email", "is no email"),
        ({"s01": Person(email="=1@x.ro")}, "email", "formula"),
        ({"s01": Person(username="Ion Pop")}, "username", "is no username"),
        ({}, "username", "has no username; .*--ids"),
        ({}, "id", "is no id"),
        ({}, "phone", "not by 'phone'"),
    ],
)
def test_a_row_that_would_abort_moodles_import_is_refused(people, identity, message):
    with pytest.raises(CallError, match=message):
        gradebook(report("s01", 7.5), people=people, identity=identity)


def test_two_students_with_one_address_are_refused_together_with_all_other_faults():
    people = {"s01": Person(email="a@x.ro"), "s02": Person(email="A@x.ro")}
    with pytest.raises(CallError, match=r"(?s)s02: 'A@x.ro' is already the email of s01.*s03: has no email"):
        gradebook(report("s01", 1.0), report("s02", 2.0), report("s03", 3.0), people=people, identity="email")


def test_users_by_moodles_own_number_come_from_the_table_of_ids():
    text = gradebook(report("s01", 7.5), people={"s01": Person(platform_id="42")}, identity="id")
    assert users_and_grades(text)[1] == ["42", "7.5"]


def test_a_grade_item_is_called_as_the_assignment_where_nothing_is_said_and_never_as_a_formula():
    assert users_and_grades(gradebook(report("s01", 7.5), item=" "))[0][1] == "pump"
    with pytest.raises(CallError, match="grade item"):
        gradebook(report("s01", 7.5), item="=1")


def test_grades_above_a_hundred_are_told_to_be_more_than_most_sites_allow():
    options = Options(to="moodle")
    draft = drafted(grades_of(results(report("s01", 150.0, max_score=200.0)), options), options)
    assert "worksheet is the better way" in notes(draft)[0]
    assert "out of 200" in notes(draft)[1]
    assert "above 100" in notes(draft)[2]


def test_a_comment_longer_than_moodle_stores_is_refused():
    long = report("s01", 5.0, criteria=[criterion("v_A", "none", 0.0, 61_000 * "x")])
    with pytest.raises(CallError, match="s01: the comment has more than 60000 characters"):
        gradebook(long)


def test_another_maximum_needs_leave_to_rescale():
    with pytest.raises(CallError, match="rescaling"):
        gradebook(report("s01", 7.5), maximum=100.0)
    assert users_and_grades(gradebook(report("s01", 7.5), maximum=100.0, rescale=True))[1] == ["s01", "75"]


# Feedback files, and what Moodle stores ------------------------------------------------------------
WORKSHEET = (
    "Identifier,Full name,Email address,Grade,Maximum grade,Grade can be changed,Last modified (grade)\r\n"
    "Participant 101,A,a@x.ro,,10.00,Yes,-\r\n"
    "Participant 102,B,b@x.ro,,10.00,No,-\r\n"
    "Participant 103,C,c@x.ro,,10.00,Yes,-\r\n"
)
BY_MAIL = {
    "s01": Person(email="a@x.ro"),
    "s02": Person(email="b@x.ro"),
    "s_3": Person(email="c@x.ro"),
    "s09": Person(email="none@x.ro"),
}


def pages(out, report, text="page", where=None, printable=None):
    folder = out / (where or report.student_id)
    folder.mkdir(parents=True)
    (folder / "report.json").write_text(report.model_dump_json(), encoding="utf-8")
    (folder / "feedback.html").write_text(text, encoding="utf-8")
    if printable is not None:
        (folder / "feedback.pdf").write_bytes(printable)


def archive(tmp_path, *reports, worksheet=WORKSHEET, name="out.zip", **how):
    form = tmp_path / "w.csv"
    form.write_text(worksheet, encoding="utf-8", newline="")
    return moodle(
        tmp_path, "feedback", *reports, name=name, out=tmp_path / "marks", form=form, people=BY_MAIL, **how
    )


@pytest.mark.parametrize("least", [4, 5])
def test_moodle_finds_everybodys_pages_in_the_archive(tmp_path, least):
    first, locked, third = marked("s01", 5.0), marked("s02", 5.0), marked("s_3", 2.5)
    for one, printable in ((first, b"%PDF"), (locked, None), (third, None)):
        pages(tmp_path / "marks", one, f"page of {one.student_id}", printable=printable)
    waiting = report("s04", None, status="needs_review")
    delivery, path = archive(tmp_path, first, locked, third, waiting, marked("s09", 5.0))
    assert importers.moodle_feedback(path.read_bytes(), {101, 102, 103}, least) == {
        101: {"feedback.html": b"page of s01", "feedback.pdf": b"%PDF"},
        103: {"feedback.html": b"page of s_3"},
    }
    assert delivery.written == ("s01", "s_3")
    assert left_out(delivery)["s04"] == "needs review"
    assert "cannot be changed" in left_out(delivery)["s02"]
    assert set(delivery.unplaced) == {"s02", "s09"}
    with zipfile.ZipFile(path) as opened:
        assert all("_" not in name.partition("/")[2] for name in opened.namelist())


def test_pages_too_are_kept_back_by_a_marking_workflow(tmp_path):
    one = marked("s01", 5.0)
    pages(tmp_path / "marks", one)
    sheet = WORKSHEET.replace("Grade can", "Marking workflow state,Grade can").replace("10.00,", "10.00,-,")
    delivery, _ = archive(tmp_path, one, worksheet=sheet)
    assert any("marking workflow" in note for note in notes(delivery))


def test_the_same_pages_make_the_same_archive(tmp_path):
    one = marked("s01", 5.0)
    pages(tmp_path / "marks", one)
    _, path = archive(tmp_path, one)
    first = path.read_bytes()
    archive(tmp_path, one)
    assert path.read_bytes() == first


def test_numbers_may_come_from_the_table_of_ids(tmp_path):
    one = marked("s01", 5.0)
    pages(tmp_path / "marks", one)
    people = {"s01": Person(participant=7)}
    _, path = moodle(
        tmp_path, "feedback", one, marked("s02", 5.0), name="o.zip", out=tmp_path / "marks", people=people
    )
    assert list(importers.moodle_feedback(path.read_bytes(), {7})) == [7]
    with pytest.raises(CallError, match="--worksheet"):
        moodle(tmp_path, "feedback", one, name="o.zip", out=tmp_path / "marks")


def test_pages_of_several_positions_stand_side_by_side(tmp_path):
    both = marked("s01", 5.0, position=1), marked("s01", 2.5, position=2)
    for one in both:
        pages(tmp_path / "marks", one, where=f"s01/{one.position}")
    _, path = archive(tmp_path, *both, combine="sum")
    assert set(importers.moodle_feedback(path.read_bytes(), {101})[101]) == {
        "position-1-feedback.html",
        "position-2-feedback.html",
    }
    _, path = archive(tmp_path, *both, position=2)
    assert set(importers.moodle_feedback(path.read_bytes(), {101})[101]) == {"feedback.html"}


@pytest.mark.parametrize("broken", ["feedback.html", "report.json", None])
def test_pages_that_are_missing_or_of_another_run_are_refused(tmp_path, broken):
    one = marked("s01", 5.0)
    pages(tmp_path / "marks", one if broken else marked("s01", 2.5))
    if broken:
        (tmp_path / "marks" / "s01" / broken).unlink()
    with pytest.raises(InputFileError, match=r"grade again, nothing was written\n  .*s01"):
        archive(tmp_path, one)
    assert not (tmp_path / "out.zip").exists()


def test_moodle_takes_no_folder(tmp_path):
    one = marked("s01", 5.0)
    pages(tmp_path / "marks", one)
    with pytest.raises(CallError, match=r"end with \.zip"):
        archive(tmp_path, one, name="folder")
    assert not (tmp_path / "folder").exists()


def test_a_class_that_moodle_does_not_know_has_no_archive(tmp_path):
    one = marked("s77", 5.0)
    pages(tmp_path / "marks", one)
    with pytest.raises(CallError, match="no student has a number in Moodle"):
        archive(tmp_path, one)
