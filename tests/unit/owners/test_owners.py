import pytest

from grader.owners.pages import How, assign_pages, student_of_name
from grader.records import Identity, PageRef
from grader.tables.roster import parse_roster
from grader.texts.spoken import message

THREE = parse_roster("student_id,name,n\ns1,A,1\ns2,B,2\ns_3,C,3\n")


def code(student, n=None, position=None, assignment="pump", kind="velocity"):
    return Identity(assignment, student, n, position, kind)


def class_file(marks, file="class.pdf"):
    """A page per character: x drawn on, b blank."""
    return [PageRef(file, page, len(marks), blank=mark == "b") for page, mark in enumerate(marks, start=1)]


def owners(ownership):
    return {str(owned.source): owned.student_id for owned in ownership.owned}


def codes(ownership):
    return {str(loose.source): loose.problem.code for loose in ownership.unmatched}


@pytest.mark.parametrize(
    ("file", "student"),
    [
        ("s1.jpg", "s1"),
        ("s1_2.jpg", "s1"),
        ("s_3.jpg", "s_3"),
        ("s_3_2.jpg", "s_3"),
        ("s_3_page_2.tif", "s_3"),
        ("in/s1.jpg", "s1"),
        ("s.jpg", None),
        ("s11.jpg", None),
        ("S1.jpg", None),
        ("2_s1.jpg", None),
    ],
)
def test_a_file_name_tells_its_student_by_its_stem_or_its_longest_part_before_an_underscore(file, student):
    assert student_of_name(file, THREE.student_ids) == student


def test_the_longer_of_two_ids_that_begin_alike_is_meant():
    assert student_of_name("a_b_1.jpg", ["a", "a_b"]) == "a_b"


def test_every_page_ends_in_exactly_one_place():
    pages = [
        *class_file("xbx"),
        PageRef("s1.jpg", 1, 1),
        PageRef("who.jpg", 1, 1),
        PageRef("s2.jpg", 1, 1, blank=True),
    ]
    found = assign_pages(pages, THREE, "pump")
    told = [*(o.source for o in found.owned), *(u.source for u in found.unmatched), *found.blank]
    assert sorted(map(str, told)) == sorted(map(str, pages))
    assert owners(found) == {"s1.jpg": "s1"}
    assert set(codes(found).values()) == {"owner_unknown"}
    assert sorted(map(str, found.blank)) == ["class.pdf#2", "s2.jpg"]


def test_a_code_decides_and_brings_n_and_position():
    roster = parse_roster("student_id,name\ns1,A\n")
    (owned,) = assign_pages([PageRef("scan0001.jpg", 1, 1, identity=code("s1", 7, 2))], roster, "pump").owned
    assert (owned.student_id, owned.n, owned.position, owned.how) == ("s1", 7, 2, (How.CODE,))


def test_sources_that_agree_are_all_told():
    roster = parse_roster("student_id,name,scans\ns1,A,s1.jpg\n")
    (owned,) = assign_pages([PageRef("s1.jpg", 1, 1, identity=code("s1"))], roster, "pump").owned
    assert owned.how == (How.CODE, How.SCANS, How.NAME)


@pytest.mark.parametrize(
    ("roster", "page"),
    [
        ("student_id,name\ns1,A\ns2,B\n", PageRef("s1.jpg", 1, 1, identity=code("s2"))),
        ("student_id,name,scans\ns1,A,x.jpg\ns2,B,\n", PageRef("x.jpg", 1, 1, identity=code("s2"))),
        ("student_id,name,scans\ns1,A,s2.jpg\ns2,B,\n", PageRef("s2.jpg", 1, 1)),
        ("student_id,name,n\ns2,B,3\ns1,A,1\n", PageRef("x.jpg", 1, 1, identity=code("s2", n=4))),
        (
            "student_id,name,position\ns2,B,3\ns1,A,1\n",
            PageRef("s2.jpg", 1, 1, identity=code("s2", position=4)),
        ),
    ],
)
def test_two_sources_that_disagree_leave_the_page_unmatched_with_both_told(roster, page):
    found = assign_pages([page], parse_roster(roster), "pump")
    assert not found.owned
    (loose,) = found.unmatched
    assert loose.problem.code == "owner_disagree"
    assert "s2" in message(loose.problem)
    assert ";" in message(loose.problem)


def test_a_code_of_a_stranger_or_of_another_assignment_matches_nobody():
    pages = [
        PageRef("a.jpg", 1, 1, identity=code("s99")),
        PageRef("s1.jpg", 1, 1, identity=code("s1", assignment="press")),
    ]
    assert codes(assign_pages(pages, THREE, "pump")) == {
        "a.jpg": "owner_not_listed",
        "s1.jpg": "owner_other_assignment",
    }


def test_a_code_on_an_otherwise_blank_page_is_still_a_submission():
    found = assign_pages([PageRef("a.jpg", 1, 1, blank=True, identity=code("s1"))], THREE, "pump")
    assert owners(found) == {"a.jpg": "s1"}


@pytest.mark.parametrize(
    ("marks", "expected"),
    [
        ("xxxxxx", {1: "s1", 2: "s1", 3: "s2", 4: "s2", 5: "s_3", 6: "s_3"}),
        ("xbxbxbxbxbxb", {1: "s1", 3: "s1", 5: "s2", 7: "s2", 9: "s_3", 11: "s_3"}),
        ("xbbbxbxbxbxb", {1: "s1", 5: "s2", 7: "s2", 9: "s_3", 11: "s_3"}),
        ("xxbxxx", {1: "s1", 2: "s1", 4: "s2", 5: "s_3", 6: "s_3"}),
        ("bxxxxxx", {2: "s1", 3: "s1", 4: "s2", 5: "s2", 6: "s_3", 7: "s_3"}),
    ],
)
def test_a_class_file_is_dealt_out_in_the_rosters_order_and_blank_pages_are_passed_over(marks, expected):
    found = assign_pages(class_file(marks), THREE, "pump", pages_per_student=2)
    assert {owned.source.page: owned.student_id for owned in found.owned} == expected
    assert [page.page for page in found.blank] == [
        place for place, mark in enumerate(marks, start=1) if mark == "b"
    ]
    assert not found.unmatched


@pytest.mark.parametrize("marks", ["xxxxx", "xxxxxxx", "xbxbxbxbxb", "bbbb"])
def test_a_class_file_whose_pages_do_not_come_out_even_is_not_dealt_out_at_all(marks):
    found = assign_pages(class_file(marks), THREE, "pump", pages_per_student=2)
    assert not found.owned
    assert {loose.problem.code for loose in found.unmatched} <= {"order_refused"}
    assert len(found.unmatched) == marks.count("x")


def test_an_empty_sheet_handed_in_shifts_nobody():
    roster = parse_roster("student_id,name\ns1,A\ns2,B\ns3,C\n")
    simplex = assign_pages(class_file("bxx"), roster, "pump", pages_per_student=1)
    assert owners(simplex) == {"class.pdf#2": "s2", "class.pdf#3": "s3"}
    duplex = assign_pages(class_file("bbxbxb"), roster, "pump", pages_per_student=1)
    assert owners(duplex) == {"class.pdf#3": "s2", "class.pdf#5": "s3"}


def test_a_code_that_disproves_the_order_stops_it_for_pages_that_nothing_else_names():
    pages = class_file("xxxxxx")
    pages[2] = PageRef("class.pdf", 3, 6, identity=code("s1"))
    pages[4] = PageRef("class.pdf", 5, 6, identity=code("s_3"))
    found = assign_pages(pages, THREE, "pump", pages_per_student=2)
    assert owners(found) == {"class.pdf#5": "s_3"}
    assert codes(found)["class.pdf#3"] == "owner_disagree"
    assert codes(found)["class.pdf#4"] == "order_refused"


def test_students_with_a_file_of_their_own_are_left_out_where_the_order_then_comes_out_even():
    pages = [PageRef("s2.jpg", 1, 1), *class_file("xxxx")]
    found = assign_pages(pages, THREE, "pump", pages_per_student=2)
    assert [owned.student_id for owned in found.owned] == ["s2", "s1", "s1", "s_3", "s_3"]


def test_the_rosters_scans_go_before_its_order():
    roster = parse_roster("student_id,name,scans\ns1,A,class.pdf#3\ns2,B,\ns3,C,\n")
    found = assign_pages(class_file("xxx"), roster, "pump", pages_per_student=1)
    assert owners(found) == {"class.pdf#3": "s1", "class.pdf#1": "s2", "class.pdf#2": "s3"}


def test_two_class_files_have_no_order():
    pages = [*class_file("xx", "a.pdf"), *class_file("xx", "b.pdf")]
    assert set(codes(assign_pages(pages, THREE, "pump", pages_per_student=1)).values()) == {"order_refused"}


def test_each_position_of_a_student_is_a_place_in_the_order():
    roster = parse_roster("student_id,name,position\ns1,A,1\ns1,A,2\n")
    found = assign_pages(class_file("xx"), roster, "press", pages_per_student=1)
    assert [(owned.student_id, owned.position) for owned in found.owned] == [("s1", 1), ("s1", 2)]


def test_a_name_alone_does_not_tell_which_of_several_positions():
    roster = parse_roster("student_id,name,position,scans\ns1,A,1,\ns1,A,2,s1_b.jpg\n")
    found = assign_pages([PageRef("s1_a.jpg", 1, 1), PageRef("s1_b.jpg", 1, 1)], roster, "press")
    assert codes(found) == {"s1_a.jpg": "owner_ambiguous"}
    assert [(owned.student_id, owned.position) for owned in found.owned] == [("s1", 2)]


def test_scans_that_are_not_there_are_told():
    roster = parse_roster("student_id,name,scans\ns1,A,Scan.jpg\ns2,B,class.pdf#9\n")
    found = assign_pages([*class_file("x"), PageRef("scan.jpg", 1, 1)], roster, "pump")
    assert [problem.code for problem in found.problems] == ["scan_missing", "scan_missing"]
    assert "Is scan.jpg meant?" in message(found.problems[0])


def test_without_a_roster_codes_and_names_say_who_the_students_are():
    pages = [
        PageRef("s1.jpg", 1, 1),
        PageRef("s1_2.jpg", 1, 1),
        PageRef("scan.jpg", 1, 1, identity=code("s7", 7)),
        PageRef("not valid.jpg", 1, 1),
    ]
    found = assign_pages(pages, None, "pump")
    assert owners(found) == {"s1.jpg": "s1", "s1_2.jpg": "s1", "scan.jpg": "s7"}
    assert codes(found) == {"not valid.jpg": "owner_unknown"}


def test_without_a_roster_nobody_is_called_as_no_folder_can_be():
    files = ["results.json.jpg", "CON.jpg", "s1.jpg", "S1.png"]
    found = assign_pages([PageRef(file, 1, 1) for file in files], None, "pump")
    assert sorted([*owners(found), *codes(found)]) == sorted(files)
    assert len(owners(found)) == 1
    told = {str(loose.source): message(loose.problem) for loose in found.unmatched}
    assert "a file of the results has that name" in told["results.json.jpg"]
    assert "Windows has a device of that name" in told["CON.jpg"]


def test_a_page_that_two_students_may_own_names_both():
    page = PageRef("s2.jpg", 1, 1, identity=code("s1", 1))
    (loose,) = assign_pages([page], THREE, "pump").unmatched
    assert loose.problem.code == "owner_disagree"
    assert loose.students == ("s1", "s2")
