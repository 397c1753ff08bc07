"""Gradebooks of Canvas, Brightspace, Blackboard and ILIAS; Canvas's rubric and points in it."""

import json
import zipfile
from dataclasses import replace

import pytest

from grader.lms.export import export
from grader.lms.grades import Options, Person
from reference.errors import CallError, InputFileError
from tests.unit.lms import importers
from tests.unit.lms.classroom import NAMES_APART, form, left_out, marked, notes, report, results

EXPORTED = (
    "Student,ID,SIS User ID,SIS Login ID,Section,Quiz (7),Pump (12345),Current Score,Final Score\r\n"
    "    Points Possible,,,,,5,10.00,(read only),(read only)\r\n"
    '"Popescu, Ion",4711,s01,ion@x.ro,"Group ""A"", 2",3,,55,55\r\n'
    '"Șerban, Țuțu",4712,S-02,tutu@x.ro,1,4,6.00,,\r\n'
    '"Student, Test",4713,,abcdef,1,,,,\r\n'
)

WRITTEN = "Student,ID,SIS User ID,SIS Login ID,Section,Pump (12345)\r\n    Points Possible,,,,,10.00\r\n"
"""The columns of it that are written: those that identify a row, and the assignment asked for."""
GRADED = WRITTEN + '"Popescu, Ion",4711,s01,ion@x.ro,"Group ""A"", 2",7.5\r\n'


def canvas(out, *reports, form=None, text=EXPORTED, what=None, **how):
    if form is not None:
        form.write_bytes(text if isinstance(text, bytes) else text.encode())
    delivery = export(results(*reports), out, Options(to="canvas", what=what, form=form, **how))
    return delivery, out.read_bytes().decode()


def filled(tmp_path, *reports, text=EXPORTED, **how):
    how.setdefault("item", "Pump (12345)")
    return canvas(tmp_path / "out.csv", *reports, form=tmp_path / "in.csv", text=text, **how)


# The teacher's own file ---------------------------------------------------------------------------


def test_only_the_cells_of_those_who_have_a_grade_change(tmp_path):
    delivery, text = filled(tmp_path, report("s01", 7.5), report("s02", None, status="needs_review"))
    assert text == GRADED
    assert (delivery.written, left_out(delivery)) == (("s01",), {"s02": "needs review"})


def test_a_mark_and_bare_line_ends_are_kept(tmp_path):
    data = b"\xef\xbb\xbf" + EXPORTED.replace("\r\n", "\n").encode()
    _, text = filled(tmp_path, report("s01", 7.5), text=data)
    assert text.encode() == b"\xef\xbb\xbf" + GRADED.replace("\r\n", "\n").encode()


def test_a_semicolon_file_with_decimal_commas_is_understood(tmp_path):
    semi = (
        "Student;ID;SIS User ID;SIS Login ID;Section;Pump (12345)\n"
        "    Points Possible;;;;;10,00\n"
        "Popescu, Ion;4711;s01;ion@x.ro;1;7,50\n"
        "Popa, Ana;4712;s02;ana@x.ro;1;\n"
    )
    delivery, text = filled(tmp_path, report("s01", 7.5), report("s02", 2.25), text=semi)
    assert text == semi.replace("ana@x.ro;1;", "ana@x.ro;1;2.25")
    assert notes(delivery) == []


@pytest.mark.parametrize(
    ("student", "person"),
    [
        ("x1", Person(platform_id="4712")),
        ("x1", Person(username="TUTU@x.ro")),
        ("x1", Person(email="tutu@x.ro")),
        ("s-02", Person()),
        ("x1", Person(name="Țuțu Șerban")),
        ("x1", Person(name="Șerban, Țuțu")),
    ],
)
def test_students_are_found_by_number_login_and_name(tmp_path, student, person):
    delivery, text = filled(tmp_path, report(student, 7.5), people={student: person})
    assert delivery.written == (student,)
    assert "tutu@x.ro,1,7.5\r\n" in text
    assert notes(delivery)[0] == "grades changed that Canvas has already: 1"
    assert ("found by name alone" in notes(delivery)[-1]) == bool(person.name)


def test_who_is_not_there_or_shares_a_row_is_told(tmp_path):
    people = {
        "s01": Person(username="ion@x.ro"),
        "s02": Person(platform_id="4712"),
        "S-02": Person(),
        "s08": Person(name="Popescu, Ion"),
        "s09": Person(name="Nobody"),
    }
    delivery, text = filled(tmp_path, *(report(one, 7.5) for one in people), people=people)
    assert text == GRADED
    assert delivery.written == ("s01",)
    assert "fits several students: s02 (4712, s02), S-02 (S-02)" in left_out(delivery)["s02"]
    assert "has the name, but another student_id" in left_out(delivery)["s08"]
    assert "nobody in the platform's file has" in left_out(delivery)["s09"]


def test_a_grade_that_canvas_holds_for_a_withheld_student_stays_and_is_told(tmp_path):
    delivery, text = filled(tmp_path, report("S-02", None, status="needs_review"))
    assert text == WRITTEN
    assert "withheld, and a grade is there already, which stays: S-02 (6.00)" in notes(delivery)


@pytest.mark.parametrize("cell", ["EX", "ex", "N/A"])
def test_excused_students_are_left(tmp_path, cell):
    text = EXPORTED.replace('2",3,,55', f'2",3,{cell},55')
    delivery, after = filled(tmp_path, report("s01", 7.5), text=text)
    assert after == WRITTEN
    assert "excused" in left_out(delivery)["s01"]


@pytest.mark.parametrize("item", ["Pump (12345)", "Pump", "12345"])
def test_the_assignment_is_named_by_header_title_or_number(tmp_path, item):
    assert filled(tmp_path, report("s01", 7.5), item=item)[0].written == ("s01",)


@pytest.mark.parametrize(
    ("item", "message"),
    [
        ("", r"which assignment\? Name it with --item: 'Quiz \(7\)', 'Pump \(12345\)'"),
        ("Press", "0 assignments fit 'Press'"),
    ],
)
def test_an_assignment_that_is_not_told_is_refused(tmp_path, item, message):
    with pytest.raises(CallError, match=message):
        filled(tmp_path, report("s01", 7.5), item=item)
    assert not (tmp_path / "out.csv").exists()


def test_another_maximum_needs_leave_to_rescale(tmp_path):
    with pytest.raises(CallError, match="maximum there is 10, the rubric's is 40"):
        filled(tmp_path, report("s01", 30.0, max_score=40.0))
    _, text = filled(tmp_path, report("s01", 30.0, max_score=40.0), rescale=True)
    assert text == GRADED


def test_the_gradebook_states_its_own_maximum(tmp_path):
    with pytest.raises(CallError, match="leave out --maximum: --gradebook already states"):
        filled(tmp_path, report("s01", 7.5), maximum=10.0)


def test_a_row_of_nobody_below_the_points_is_left(tmp_path):
    text = EXPORTED.replace('"Popescu, Ion"', 'Manual Posting,,,,,,,,\r\n"Popescu, Ion"', 1)
    assert filled(tmp_path, report("s01", 7.5), text=text)[1] == GRADED


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no platform's columns"),
        (EXPORTED[: EXPORTED.index('"Popescu')], "no students"),
        ("a,b\n1,2\n", "no platform's columns"),
        (EXPORTED.replace("    Points Possible", "x"), "no row 'Points Possible'"),
        (EXPORTED.replace("10.00", "(read only)"), "has '\\(read only\\)' points possible"),
        (EXPORTED.replace("10.00", "0"), "has '0' points possible"),
        (EXPORTED.replace("55,55", "55"), "row 3: has 8 fields"),
        (EXPORTED.encode("utf-16"), "not UTF-8"),
        (EXPORTED + '"open', "never closed"),
    ],
)
def test_a_file_that_is_no_exported_gradebook_is_refused(tmp_path, text, message):
    with pytest.raises(InputFileError, match=message):
        filled(tmp_path, report("s01", 7.5), text=text)
    assert not (tmp_path / "out.csv").exists()


# Brightspace, Blackboard, ILIAS -------------------------------------------------------------------

BRIGHTSPACE = (
    "OrgDefinedId,Username,Last Name,First Name,Email,Quiz Points Grade <Numeric MaxPoints:5>,"
    "Pump Points Grade <Numeric MaxPoints:10 Weight:50 Category:Plans CategoryWeight:10>,"
    "Final Grade,End-of-Line Indicator\r\n"
    "#s01,#ion,Popescu,Ion,ion@x.ro,4,,,#\r\n"
    '#s02,#tutu,"Șerban",Țuțu,tutu@x.ro,3,6,,#\r\n'
)
BLACKBOARD = (
    '"Last Name"\t"First Name"\t"Username"\t"Student ID"\t"Availability"\t"Total [Total Pts: 43 Score] |11"\t'
    '"Pump [Total Pts: 10 Score] |12"\t"Note [Total Pts: 0 Text] |13"\r\n'
    '"Popescu"\t"Ion"\t"ion"\t"s01"\t"Yes"\t"20"\t""\t""\r\n'
    '"Șerban"\t"Țuțu"\t"tutu"\t"s02"\t"Yes"\t""\t"Needs Grading"\t""\r\n'
)
ILIAS = (
    '"update","usr_id","login","lastname","firstname","status","mark","notice","comment","plagiarism",'
    '"plag_comment"\n'
    '"0","7","ion","Popescu","Ion","passed","","","","",""\n'
    '"0","8","tutu","Șerban","Țuțu","notgraded","6","n","","",""\n'
)


def other(tmp_path, to, data, *reports, **how):
    form = tmp_path / "in"
    form.write_bytes(data if isinstance(data, bytes) else data.encode())
    delivery = export(results(*reports), tmp_path / "out", Options(to=to, form=form, **how))
    return delivery, (tmp_path / "out").read_bytes()


PEOPLE = {
    "s01": Person(name="Ion Popescu", username="ion"),
    "s02": Person(name="Șerban, Țuțu", username="tutu"),
}
TWO = (report("s01", 7.5), report("s02", 0.0))


def test_brightspace_has_the_users_the_item_and_the_end_of_its_lines(tmp_path):
    delivery, data = other(tmp_path, "brightspace", BRIGHTSPACE, *TWO, item="Pump", people=PEOPLE)
    header, first, second = [line.split(",") for line in data.decode().splitlines()]
    assert header[:3] == ["OrgDefinedId", "Username", "Email"]
    assert header[3].startswith("Pump Points Grade <Numeric MaxPoints:10 ")
    assert header[4] == "End-of-Line Indicator"
    assert first == ["#s01", "#ion", "ion@x.ro", "7.5", "#"]
    assert second == ["#s02", "#tutu", "tutu@x.ro", "0", "#"]
    assert notes(delivery)[0] == "grades changed that Brightspace has already: 1"


def test_a_new_file_for_brightspace_names_users_item_and_maximum(tmp_path):
    out = tmp_path / "new.csv"
    delivery = export(results(*TWO), out, Options(to="brightspace", item="Pump", people=PEOPLE))
    assert out.read_text(encoding="utf-8").splitlines() == [
        "OrgDefinedId,Username,Pump Points Grade <Numeric MaxPoints:10>,End-of-Line Indicator",
        "#s01,#ion,7.5,#",
        "#s02,#tutu,0,#",
    ]
    assert "must be out of 10" in notes(delivery)[1]
    with pytest.raises(CallError, match="cannot have '%'"):
        export(results(*TWO), out, Options(to="brightspace", item="50% Pump"))


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-8"])
def test_blackboards_tabs_quotes_and_encoding_stay(tmp_path, encoding):
    data = ("\ufeff" + BLACKBOARD).encode(encoding)
    _, after = other(tmp_path, "blackboard", data, *TWO, item="12", people=PEOPLE)
    assert after.decode(encoding) == (
        '\ufeff"Last Name"\t"First Name"\t"Username"\t"Student ID"\t"Pump [Total Pts: 10 Score] |12"\r\n'
        '"Popescu"\t"Ion"\t"ion"\t"s01"\t"7.5"\r\n'
        '"Șerban"\t"Țuțu"\t"tutu"\t"s02"\t"0"\r\n'
    )


def test_blackboards_file_with_commas_is_one_too(tmp_path):
    _, after = other(tmp_path, "blackboard", BLACKBOARD.replace("\t", ","), *TWO, item="Pump", people=PEOPLE)
    assert after.decode().splitlines()[1] == '"Popescu","Ion","ion","s01","7.5"'


def test_a_status_file_of_ilias_stays_whole_and_says_which_rows_count(tmp_path):
    waiting = report("s02", None, status="needs_review")
    delivery, after = other(tmp_path, "ilias", ILIAS, TWO[0], waiting, people=PEOPLE, maximum=10.0)
    (first,) = after.decode().splitlines()[1:]
    assert first.startswith('"1","7","ion","Popescu","Ion","passed","7.5","","')
    assert set(delivery.withheld) == {"s02"}


@pytest.mark.parametrize(
    ("to", "data", "how", "message"),
    [
        ("brightspace", BRIGHTSPACE, {"item": "Quiz"}, "maximum there is 5, the rubric's is 10"),
        ("blackboard", BLACKBOARD, {"item": "Total"}, "maximum there is 43, the rubric's is 10"),
        ("blackboard", BLACKBOARD, {"item": "Note"}, "0 assignments fit 'Note'"),
        ("brightspace", BLACKBOARD, {"item": "Pump"}, "it is a file of Blackboard"),
        ("brightspace", EXPORTED, {"item": "Pump"}, "it is a file of Canvas"),
        (
            "brightspace",
            BRIGHTSPACE.replace(" <Numeric MaxPoints:5>", ""),
            {"item": "Quiz"},
            "no maximum grade",
        ),
        ("ilias", ILIAS, {}, "no maximum grade"),
        ("ilias", ILIAS, {"maximum": 20.0}, "maximum there is 20, the rubric's is 10"),
        ("brightspace", BRIGHTSPACE.replace(",#\r", ",#,x\r", 1), {"item": "Pump"}, "row 2: has 10 fields"),
        ("blackboard", b"\xff\xfe\x00", {}, "no platform's columns"),
    ],
)
def test_what_these_platforms_would_swallow_is_refused(tmp_path, to, data, how, message):
    with pytest.raises((CallError, InputFileError), match=message):
        other(tmp_path, to, data, *TWO, people=PEOPLE, **how)
    assert not (tmp_path / "out").exists()


def test_a_page_goes_into_the_students_own_folder_of_ilias(tmp_path):
    where = tmp_path / "marks" / "s01"
    where.mkdir(parents=True)
    (where / "feedback.html").write_text("<p>page</p>")
    (where / "report.json").write_text(TWO[0].model_dump_json())
    archive = tmp_path / "structure.zip"
    with zipfile.ZipFile(archive, "w") as written:
        for folder in ("Popescu_Ion_ion_7", "Serban_Tutu_Maria_tutu_8"):
            written.writestr(f"multi_feedback_Pump_3/{folder}/", b"")
    options = Options(
        to="ilias", what="feedback", form=archive, out=tmp_path / "marks",
        people={"s01": Person(username="ion"), "s02": Person(username="nobody")},
    )  # fmt: skip
    with pytest.raises(InputFileError, match="not all feedback is there"):
        export(results(*TWO), tmp_path / "o.zip", replace(options, people=PEOPLE))
    delivery = export(results(*TWO), tmp_path / "o.zip", options)
    with zipfile.ZipFile(tmp_path / "o.zip") as written:
        assert written.namelist() == ["multi_feedback_Pump_3/Popescu_Ion_ion_7/feedback.html"]
    assert "nobody in the platform's file has" in left_out(delivery)["s02"]
    archive.write_bytes(b"no archive")
    with pytest.raises(InputFileError, match="is no archive of ILIAS"):
        export(results(*TWO), tmp_path / "o.zip", options)


# A new file ---------------------------------------------------------------------------------------


def test_canvas_reads_a_new_file_as_it_is_meant(tmp_path):
    people = {
        "s01": Person(name="Popescu, Ion", platform_id="4711", username="ion"),
        "s02": Person(name="Țuțu"),
    }
    _, text = canvas(
        tmp_path / "out.csv",
        report("s01", 1234.5, max_score=2000.0),
        report("s02", 0.0, max_score=2000.0),
        report("s03", None, status="needs_review", max_score=2000.0),
        item="Pump (12345)",
        people=people,
    )
    possible, stored = importers.canvas_gradebook(
        text, "Pump (12345)", by_id={"4711": "Ion"}, by_sis={"s02": "T"}
    )
    assert possible == 2000.0
    assert stored == {"Ion": "1234.5", "T": "0"}


def test_a_title_without_its_number_is_told_to_be_a_new_assignment(tmp_path):
    delivery, _ = canvas(tmp_path / "out.csv", report("s01", 7.5))
    assert any("new assignment" in note for note in notes(delivery))
    delivery, _ = canvas(tmp_path / "out.csv", report("s01", 7.5), item="Pump (12345)")
    assert not any("new assignment" in note for note in notes(delivery))


@pytest.mark.parametrize(
    ("student", "person", "item", "message"),
    [
        ("1.2.3", Person(), "", "takes this for a number"),
        ("s01", Person(platform_id="x"), "", "no number of a user of Canvas"),
        ("s01", Person(name="Points Possible"), "", "the row of points"),
        ("s01", Person(name="=cmd()"), "", "formula"),
        ("s01", Person(), "=Pump", "no title"),
        ("s01", Person(), "Section", "no title"),
    ],
)
def test_what_canvas_would_misread_is_refused(tmp_path, student, person, item, message):
    with pytest.raises(CallError, match=message):
        canvas(tmp_path / "out.csv", report(student, 7.5), people={student: person}, item=item)
    assert not (tmp_path / "out.csv").exists()


def test_two_students_with_one_number_are_refused(tmp_path):
    people = {"s01": Person(platform_id="1"), "s02": Person(platform_id="1")}
    with pytest.raises(CallError, match="s02: '1' is already the ID of s01"):
        canvas(tmp_path / "out.csv", report("s01", 7.5), report("s02", 7.5), people=people)


# Rubric -------------------------------------------------------------------------------------------


def test_the_rubric_has_a_range_of_points_for_each_criterion(tmp_path):
    delivery, text = canvas(
        tmp_path / "out.csv", marked("s01", 5.0, 2.5), marked("s02", 5.0, None), what="rubric", item="Pump"
    )
    assert not text.startswith("\ufeff")
    (criteria,) = importers.canvas_rubric(text).values()
    assert [(name, is_range) for name, is_range, _ in criteria] == [
        ("c1: Vector 1", True), ("c2: Vector 2", True),
    ]  # fmt: skip
    for _, _, ratings in criteria:
        shown = [importers.canvas_rating(ratings, points) for points in (5.0, 4.99, 2.5, 0.01, 0.0)]
        assert shown == ["Full marks", *(3 * ["Partial marks"]), "No marks"]
    assert delivery.is_complete


def test_a_class_without_criteria_has_no_rubric(tmp_path):
    with pytest.raises(CallError, match="no report has criteria"):
        canvas(tmp_path / "out.csv", report("s01", 7.5), what="rubric")


def test_points_that_canvas_would_round_are_refused(tmp_path):
    rough = marked("s01", 5.0)
    rough = rough.model_copy(
        update={"criteria": [one.model_copy(update={"max_points": 1.125}) for one in rough.criteria]}
    )
    with pytest.raises(CallError, match="two decimals"):
        canvas(tmp_path / "out.csv", rough, what="rubric")


# Points in it -------------------------------------------------------------------------------------

RUBRIC = {
    "id": 1,
    "title": "Pump",
    "data": [
        {"id": "_1", "description": "c1: Vector 1", "points": 5.0, "ratings": [{"id": "a", "points": 5.0}]},
        {"id": "_2", "description": "Vector 2", "points": 5.0, "ratings": []},
    ],
}


@pytest.fixture
def rubric(tmp_path):
    path = tmp_path / "rubric.json"
    path.write_text(json.dumps(RUBRIC), encoding="utf-8")
    return path


def points(tmp_path, rubric, *reports, **how):
    options = Options(to="canvas-api", criteria=rubric, course_id="12", assignment_id="345", **how)
    delivery = export(results(*reports), tmp_path / "marks.zip", options)
    with zipfile.ZipFile(tmp_path / "marks.zip") as archive:
        return delivery, [json.loads(archive.read(name)) for name in archive.namelist()[1:]]


def test_points_add_up_to_the_grade_and_go_to_canvass_own_criteria(tmp_path, rubric):
    _, (first, second) = points(tmp_path, rubric, marked("s01", 5.0, 2.5), marked("s02", 3.0, None))
    assert first["submission"] == {"posted_grade": "7.5"}
    assert first["rubric_assessment"]["_2"]["points"] == 2.5
    assert "Told <why> & how." in first["rubric_assessment"]["_2"]["comments"]
    assert {name: one["points"] for name, one in second["rubric_assessment"].items()} == {
        "_1": 3.0, "_2": 3.0,
    }  # fmt: skip
    assert second["submission"] == {"posted_grade": "6"}
    assert second["rubric_assessment"]["_2"]["comments"].startswith("– not judged: ")


@pytest.mark.parametrize("number", ["0", "a/b", "sis_user_id:", "sis_user_id:a/../b", "name"])
def test_a_number_that_canvas_would_not_take_is_refused(tmp_path, rubric, number):
    with pytest.raises(CallError, match="no number of a user of Canvas"):
        points(tmp_path, rubric, marked("s01", 5.0, 2.5), people={"s01": Person(platform_id=number)})


@pytest.mark.parametrize(
    "answer",
    [
        {"rubric": RUBRIC["data"], "id": 345, "description": "<p>", "points_possible": 10},
        RUBRIC["data"],
        {"criteria": RUBRIC["data"], "id": 1},
        {"rubric": {"id": 1, "title": "x", "criteria": RUBRIC["data"]}},
    ],
)
def test_canvass_answers_of_every_shape_are_understood(tmp_path, rubric, answer):
    rubric.write_text(json.dumps(answer), encoding="utf-8")
    assert points(tmp_path, rubric, marked("s01", 5.0, 2.5))[0].written == ("s01",)


def test_criteria_may_be_told_in_a_table(tmp_path):
    table = tmp_path / "criteria.csv"
    table.write_text("criterion,id\nc1,_8\nc2,_9\n", encoding="utf-8")
    _, bodies = points(tmp_path, table, marked("s01", 5.0, 2.5))
    assert list(bodies[0]["rubric_assessment"]) == ["_8", "_9"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"description": "v_X"}, "c1: Vector 1: not there; .*'v_X': there, and not in the rubric"),
        ({"points": 4.0}, "4 points there, 5 in the rubric"),
        ({"description": "c2: Vector 2"}, "2 times"),
        ({"id": "_2"}, "two criteria have one number"),
    ],
)
def test_criteria_that_are_not_the_rubrics_are_refused(tmp_path, rubric, change, message):
    first, second = RUBRIC["data"]
    rubric.write_text(json.dumps([{**first, **change}, second]), encoding="utf-8")
    with pytest.raises(InputFileError, match=f"(?s){message}"):
        points(tmp_path, rubric, marked("s01", 5.0, 2.5))
    assert not (tmp_path / "marks.zip").exists()


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"id": 1}', "nonsense", "[" * 100_000])
def test_an_answer_without_criteria_is_refused(tmp_path, rubric, content):
    rubric.write_text(content, encoding="utf-8")
    with pytest.raises(InputFileError, match=r"rubric\.json"):
        points(tmp_path, rubric, marked("s01", 5.0, 2.5))


def test_students_marked_by_other_criteria_are_refused(tmp_path, rubric):
    other = marked("s02", 5.0, 2.5)
    other = other.model_copy(
        update={"criteria": [one.model_copy(update={"id": f"x_{one.id}"}) for one in other.criteria]}
    )
    with pytest.raises(InputFileError, match="s02: other criteria or points than s01"):
        points(tmp_path, rubric, marked("s01", 5.0, 2.5), other)


def test_titles_in_several_languages_are_one_criterion(tmp_path, rubric):
    delivery, _ = points(
        tmp_path, rubric, marked("s01", 5.0, 2.5), marked("s02", 5.0, 0.0, title="Vectorul {}")
    )
    assert delivery.written == ("s01", "s02")


def test_a_rubric_has_the_titles_of_the_class(tmp_path):
    made = results(marked("s01", 5.0, 2.5, title="Vectorul {}")).model_copy(
        update={"titles": {"c1": "Velocity of A", "c2": "Velocity of B"}}
    )
    path = tmp_path / "rubric.csv"
    export(made, path, Options(to="canvas", what="rubric"))
    text = path.read_text(encoding="utf-8")
    assert "c1: Velocity of A" in text
    assert "Vectorul" not in text


def test_positions_are_summed_or_averaged_criterion_by_criterion(tmp_path, rubric):
    both = marked("s01", 5.0, 2.5, position=1), marked("s01", 0.0, 5.0, position=2)
    _, (body,) = points(tmp_path, rubric, *both, combine="mean")
    assert [one["points"] for one in body["rubric_assessment"].values()] == [2.5, 3.75]
    assert body["submission"]["posted_grade"] == "6.25"
    assert "1: ✓" in body["rubric_assessment"]["_1"]["comments"]
    with pytest.raises(InputFileError, match="5 points there, 10 in the rubric"):
        points(tmp_path, rubric, *both, combine="sum")


def test_a_gradebook_with_names_apart_is_filled_in(tmp_path):
    path = form(tmp_path, NAMES_APART)
    for people in ({}, {"x1": Person(name="Ion Popescu")}, {"x1": Person(name="Popescu, Ion")}):
        student = next(iter(people), "s01")
        export(
            results(report(student, 7.5)), tmp_path / "o.csv", Options(to="canvas", form=path, people=people)
        )
        assert (tmp_path / "o.csv").read_text() == NAMES_APART.replace("s01,,1,", "s01,,1,7.5")
