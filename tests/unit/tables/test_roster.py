import pytest

from grader.records import Reason
from grader.tables.reader import TableError
from grader.tables.roster import ScanRef, parse_roster, parse_scan
from grader.texts.spoken import fault, message


def faults(text: str) -> list[str]:
    with pytest.raises(TableError) as caught:
        parse_roster(text)
    return [fault(one) for one in caught.value.faults]


def test_a_line_becomes_a_row_with_what_it_says_and_no_more():
    roster = parse_roster(
        "student_id,name,n,position,email,kL,kv,ka,lang,scans\n"
        's07,"Pop, Ana",7,,ana@example.org,1:5,0.185 (m/s)/mm,,ro,class.pdf#3;class.pdf#4;extra.jpg\n'
    )
    (row,) = roster.rows
    assert (row.student_id, row.name, row.n, row.position) == ("s07", "Pop, Ana", 7, None)
    assert row.scales == {"kL": "1:5", "kv": "0.185 (m/s)/mm"}
    assert row.scans == (ScanRef("class.pdf", 3), ScanRef("class.pdf", 4), ScanRef("extra.jpg"))
    assert (row.lang, row.line) == ("ro", 2)


def test_the_columns_may_stand_in_any_order_and_blank_lines_do_not_count():
    roster = parse_roster("\nname,n,student_id\n\nAna,7,s07\n,,\nIon,,s08\n")
    assert [(row.student_id, row.name, row.n) for row in roster.rows] == [
        ("s07", "Ana", 7),
        ("s08", "Ion", None),
    ]


def test_a_semicolon_separated_file_has_decimal_commas_and_quotes_several_scans():
    roster = parse_roster('student_id;name;n;kv;scans\ns1;A;7,0;0,036 (м/с)/мм;"a.pdf#1;b.jpg"\n')
    (row,) = roster.rows
    assert row.n == 7
    assert row.scales["kv"] == "0,036 (м/с)/мм"
    assert row.scans == (ScanRef("a.pdf", 1), ScanRef("b.jpg"))


def test_all_faults_are_told_at_once_each_with_its_line():
    told = faults(
        "student_id,name,n,position,lang,scans\n"
        "s 1,A,7.5,,xx,a.pdf#0\n"
        "s2,B,7,two,,a.pdf#1\n"
        ",C,,,,\n"
        "../x,D,,,,\n"
    )
    assert [one.split(":")[0] for one in told] == [
        "line 2, student_id",
        "line 2, n",
        "line 2, lang",
        "line 2, scans",
        "line 3, position",
        "line 4, student_id",
        "line 5, student_id",
    ]


def test_line_numbers_count_the_lines_of_the_file_even_within_quotes():
    (told,) = faults('student_id,name\ns1,"two\nlines"\n\ns 2,B\n')
    assert told.startswith("line 5, student_id: 's 2'")


@pytest.mark.parametrize("student", ["..", ".", "a/b", "a\\b", "ș1", "a" * 65, "s1;s2", "s#1", "s\u20071"])
def test_a_student_id_that_could_not_name_a_folder_everywhere_is_refused(student):
    assert any("student_id" in one for one in faults(f'student_id,name\n"{student}",A\n'))


def test_a_student_twice_in_one_position_is_a_fault_and_in_two_positions_is_none():
    (told,) = faults("student_id,name,position\ns1,A,1\ns1,A,2\ns1,A,1\n")
    assert told == "line 4, student_id: s1 in position 1 is on line 2 already"
    assert len(parse_roster("student_id,name,position\ns1,A,1\ns1,A,2\n").rows_of("s1")) == 2


def test_a_student_on_two_lines_needs_a_position_on_each():
    (told,) = faults("student_id,name,position\ns1,A,1\ns1,A,\n")
    assert told.startswith("line 3, position")


@pytest.mark.parametrize(
    ("first", "second"), [("c.pdf#1", "c.pdf#1"), ("c.pdf", "c.pdf#2"), ("c.pdf#2", "c.pdf")]
)
def test_a_page_cannot_belong_to_two_students(first, second):
    (told,) = faults(f"student_id,name,scans\ns1,A,{first}\ns2,B,{second}\n")
    assert told.startswith("line 3, scans")


def test_a_students_positions_may_share_a_sheet_that_no_line_names_twice():
    text = "student_id,name,position,scans\ns1,A,0,c.pdf#1;d.jpg\ns1,A,1,c.pdf#1;d.jpg{more}\n"
    assert [len(row.scans) for row in parse_roster(text.format(more="")).rows] == [2, 2]
    (told,) = faults(text.format(more=";c.pdf"))
    assert told.startswith("line 3, scans")


def test_a_misspelt_column_is_a_fault_and_a_foreign_one_is_passed_over_and_told():
    (told,) = faults("student_id,name,postion\ns1,A,1\n")
    assert "did you mean position" in told
    roster = parse_roster("student_id,name,group\ns1,A,131\n")
    assert [problem.code for problem in roster.problems] == ["roster_columns"]


@pytest.mark.parametrize(
    "text",
    ["", "\n\n", "name\nA\n", "student_id\ns1\n", "student_id,name\n", "student_id,name,n,n\ns1,A,1,2\n"],
)
def test_a_file_that_is_no_roster_is_refused(text):
    assert faults(text)


def test_too_many_fields_are_told_with_the_likely_reason():
    (told,) = faults("student_id;name;scans\ns1;A;a.pdf#1;b.jpg\n")
    assert "quote a field" in told


def test_a_hash_may_be_part_of_a_file_name():
    assert parse_scan("lab#2.pdf") == ScanRef("lab#2.pdf")
    assert parse_scan("lab#2.pdf#3") == ScanRef("lab#2.pdf", 3)
    assert isinstance(parse_scan("#3"), Reason)
    assert isinstance(parse_scan("lab.pdf#3-4"), Reason)


def test_ids_that_only_case_tells_apart_are_refused():
    (told,) = faults("student_id,name\ns1,A\nS1,B\n")
    assert told.startswith("line 3, student_id: S1 differs in case only from s1 on line 2")


@pytest.mark.parametrize(
    "student", ["results.json", "Assessments.json", "Index.HTML", "summary.csv", "decisions.csv"]
)
def test_an_id_that_a_file_of_the_results_has_for_its_name_is_refused(student):
    (told,) = faults(f"student_id,name\n{student},A\n")
    assert told == (
        f"line 2, student_id: '{student}' is refused: it cannot name a folder:"
        " a file of the results has that name"
    )


@pytest.mark.parametrize("student", ["CON", "aux", "nul.txt", "com1", "LPT9.a.b", "s1.", ".planmark"])
def test_an_id_that_names_a_device_or_a_hidden_folder_is_refused(student):
    (told,) = faults(f"student_id,name\n{student},A\n")
    assert "it cannot name a folder" in told


@pytest.mark.parametrize("student", ["con1", "com10", "auxiliary", "s1.x", "results", "-1"])
def test_an_id_that_only_begins_like_a_device_is_none(student):
    assert parse_roster(f"student_id,name\n{student},A\n").student_ids == (student,)


def test_columns_without_number_are_passed_over_without_being_listed_one_by_one():
    columns = ",".join(f"extra{number}" for number in range(20_000))
    (problem,) = parse_roster(f"student_id,name,{columns}\ns1,A\n").problems
    assert message(problem).endswith("extra19, and 19980 more.")


def test_a_page_is_one_students_however_many_lines_name_the_file():
    lines = "".join(f"s{page},A,class.pdf#{page}\n" for page in range(1, 6000))
    (told,) = faults(f"student_id,name,scans\n{lines}x,B,class.pdf#5\n")
    assert told == "line 6001, scans: class.pdf#5 is named on line 6 already (class.pdf#5)"
