from dataclasses import replace

import pytest

from grader.folder.submissions import Unusable, submissions_of
from grader.owners.pages import How, Owned, PageOwners, Unmatched
from grader.records import PageRef, Reading, Reason
from grader.tables.measurements import Measurements
from grader.tables.roster import Roster, RosterRow
from reference.authored.assignment import Variant, load_assignment

PUMP = load_assignment("pump")
PRESS = load_assignment("press")


def owned(file, student, n=None, position=None):
    return Owned(PageRef(file, 1, 1), student, n, position, (How.NAME,))


def owners(*pages, blank=()):
    return PageOwners(tuple(pages), (), tuple(blank))


def entered(student, n=None, position=None, source="class.csv"):
    return Measurements(student, n, position, {}, Reading({}), {"v_A": 1.0}, source, 2)


def works(assignment, roster, pages, measured=()):
    return submissions_of(assignment, roster, pages, list(measured), "en")


def test_everybody_on_the_roster_has_a_work_even_with_nothing_handed_in():
    roster = Roster("roster.csv", (RosterRow("s1", "Ana", n=3), RosterRow("s2", "Ion", n=4)))
    found, strangers = works(PUMP, roster, owners(owned("s1.jpg", "s1", n=3)))
    assert [(work.student_id, len(work.pages)) for work in found] == [("s1", 1), ("s2", 0)]
    assert not strangers
    assert found[0].variant == Variant(n=3)
    assert found[0].name == "Ana"


def test_a_line_of_a_table_with_nothing_in_it_is_not_handed_in():
    roster = Roster("roster.csv", (RosterRow("s1", n=3, scales={"kL": "0.005 m/mm"}),))
    ((work,), _) = works(PUMP, roster, owners(), [replace(entered("s1", n=3), values={})])
    assert work.measured is None
    assert work.variant == Variant(n=3)


def test_pages_and_measurements_of_one_student_come_together():
    roster = Roster("roster.csv", (RosterRow("s1", n=3),))
    found, _ = works(PUMP, roster, owners(owned("s1.jpg", "s1", n=3)), [entered("s1")])
    assert len(found) == 1
    assert found[0].pages
    assert found[0].measured is not None


def test_a_number_on_which_two_sources_differ_is_not_guessed():
    roster = Roster("roster.csv", (RosterRow("s1", n=3),))
    found, _ = works(PUMP, roster, owners(owned("s1.jpg", "s1", n=3)), [entered("s1", n=4)])
    assert found[0].variant is None
    assert [problem.code for problem in found[0].problems] == ["n_disagrees"]


def test_measurements_of_somebody_who_is_not_on_the_roster_are_told():
    roster = Roster("roster.csv", (RosterRow("s1", n=3),))
    found, strangers = works(PUMP, roster, owners(), [entered("zz", n=5)])
    assert [work.student_id for work in found] == ["s1"]
    assert strangers[0].code == "measurements_unmatched"
    assert "Line 2" in strangers[0].message


def test_without_a_roster_each_measured_student_has_a_work():
    found, strangers = works(PUMP, None, owners(), [entered("a", n=1), entered("b", n=2)])
    assert [(work.student_id, work.variant) for work in found] == [("a", Variant(n=1)), ("b", Variant(n=2))]
    assert not strangers


def test_a_student_has_a_work_for_each_position():
    rows = (RosterRow("s1", position=0), RosterRow("s1", position=1))
    pages = owners(owned("a.jpg", "s1", position=0), owned("b.jpg", "s1", position=1))
    found, _ = works(PRESS, Roster("roster.csv", rows), pages, [entered("s1", position=1)])
    assert [(work.variant, len(work.pages), work.measured is not None) for work in found] == [
        (Variant(position=0), 1, False),
        (Variant(position=1), 1, True),
    ]


def test_measurements_without_a_position_go_to_the_only_one():
    roster = Roster("roster.csv", (RosterRow("s1", position=2),))
    found, strangers = works(PRESS, roster, owners(), [entered("s1")])
    assert found[0].measured is not None
    assert not strangers


def test_two_files_of_measurements_are_taken_together_and_told():
    first, second = entered("s1", n=3), entered("s1", n=3, source="other.csv")
    found, _ = works(PUMP, None, owners(), [first, second])
    assert found[0].measured is not None
    assert found[0].measured.values == {"v_A": 1.0}
    assert [problem.code for problem in found[0].measured.problems] == ["measurements_twice"]


ROSTER = Roster("roster.csv", (RosterRow("s1", n=3), RosterRow("s2", n=4)))


def json_of(student, source):
    return Measurements(student, 3, None, {}, Reading({}), {"v_A": 1.0}, source)


def codes(work):
    return [problem.code for problem in work.problems]


def test_a_file_whose_name_and_content_name_two_students_is_used_for_neither():
    own = json_of("s2", "s2.json")
    found, strangers = works(PUMP, ROSTER, owners(), [json_of("s2", "s1.json"), own])
    first, second = found
    assert (first.measured, second.measured) == (None, own)
    assert first.has_unusable
    assert codes(first)[0] == codes(second)[0] == "owner_disagree"
    assert dict(first.problems[0].parameters) == {"by_name": "s1", "by_content": "s2"}
    assert [(one.file, one.code) for one in strangers] == [("s1.json", "owner_disagree")]


@pytest.mark.parametrize("order", [1, -1])
def test_without_a_roster_a_file_named_as_another_student_is_used_for_neither(order):
    measured = [json_of("s2", "s1.json"), json_of("s2", "s2.json")][::order]
    found, _ = works(PUMP, None, owners(), measured)
    assert {work.student_id: work.measured is not None for work in found} == {"s1": False, "s2": True}


def test_without_a_roster_a_name_that_is_not_made_as_ids_are_says_nothing():
    found, strangers = works(PUMP, None, owners(), [json_of("s2", "measured.json")])
    assert [(work.student_id, work.measured is not None) for work in found] == [("s2", True)]
    assert not strangers


def test_the_name_of_a_class_file_says_nothing_of_its_students():
    measured = [entered("s1", n=3, source="s1_all.csv"), entered("s2", n=4, source="s1_all.csv")]
    found, strangers = works(PUMP, ROSTER, owners(), measured)
    assert all(work.measured is not None for work in found)
    assert not strangers


def test_a_students_file_that_names_nobody_belongs_to_whom_its_name_tells():
    for roster in (ROSTER, None):
        found, strangers = works(PUMP, roster, owners(), [json_of(None, "s1.json")])
        assert found[0].student_id == "s1"
        assert found[0].measured is not None
        assert not strangers


def test_a_line_whose_student_is_refused_belongs_to_nobody():
    line = replace(
        entered(None), problems=(Reason("measurement_fault", {"detail": "line 2: 'CON' is refused"}),)
    )
    found, strangers = works(PUMP, ROSTER, owners(), [line])
    assert not any(work.measured or work.has_unusable for work in found)
    assert (strangers[0].file, strangers[0].message) == ("class.csv", "line 2: 'CON' is refused")


def test_a_line_of_which_nothing_can_be_used_is_its_students():
    fault = Reason("measurement_fault", {"detail": "line 2: has 9 fields"}, "class.csv")
    found, strangers = works(
        PUMP, ROSTER, owners(), [replace(entered("s1"), is_usable=False, problems=(fault,))]
    )
    assert (found[0].measured, found[0].has_unusable, found[0].problems[0]) == (None, True, fault)
    assert [one.message for one in strangers] == ["line 2: has 9 fields"]


def test_a_file_that_cannot_be_used_is_told_to_those_whom_its_name_or_content_tells():
    fault = Reason("measurements", {"detail": "s1.json: cannot be used"}, "s1.json")
    class_file = Reason("measurements", {"detail": "class.csv: cannot be used"}, "class.csv")
    refused = [Unusable((fault,)), Unusable((class_file,), ("s2", "zz"))]
    found, strangers = submissions_of(PUMP, ROSTER, owners(), [], "en", refused=refused)
    assert [(work.student_id, work.has_unusable, codes(work)) for work in found] == [
        ("s1", True, ["measurements"]),
        ("s2", True, ["measurements"]),
    ]
    assert not strangers


def test_without_a_roster_a_students_file_that_cannot_be_used_is_a_submission():
    fault = Reason("measurements", {"detail": "s1.json: cannot be used"}, "s1.json")
    found, _ = submissions_of(PUMP, None, owners(), [], "en", refused=[Unusable((fault,))])
    assert [(work.student_id, work.has_unusable) for work in found] == [("s1", True)]


def test_a_position_that_the_roster_does_not_give_the_student_is_told_to_the_student():
    roster = Roster("roster.csv", (RosterRow("s1", position=1), RosterRow("s2", position=1)))
    found, strangers = works(PRESS, roster, owners(), [entered("s1", position=2)])
    assert [(work.has_unusable, codes(work)) for work in found] == [
        (True, ["position_disagrees"]),
        (False, []),
    ]
    assert strangers[0].code == "position_disagrees"


def test_measurements_that_may_be_of_several_positions_are_told_at_each():
    roster = Roster("roster.csv", (RosterRow("s1", position=1), RosterRow("s1", position=2)))
    found, strangers = works(PRESS, roster, owners(), [entered("s1")])
    assert [codes(work) for work in found] == [["owner_ambiguous"], ["owner_ambiguous"]]
    assert strangers[0].code == "owner_ambiguous"


def test_a_page_on_whose_owner_sources_disagree_is_told_to_each_of_them():
    problem = Reason("owner_disagree", {"detail": "x.jpg: the QR code: s1; the file's name: s2"}, "x.jpg")
    pages = PageOwners((), (Unmatched(PageRef("x.jpg", 1, 1), problem, ("s1", "s2")),), ())
    found, strangers = works(PUMP, ROSTER, pages)
    assert all(work.has_unusable and work.problems[0] == problem for work in found)
    assert not strangers


def test_without_a_roster_an_id_that_only_case_tells_from_another_is_nobodys():
    found, strangers = works(PUMP, None, owners(), [entered("s1", n=3), entered("S1", n=3)])
    assert [work.student_id for work in found] == ["s1"]
    assert "S1 differs in case only from s1" in strangers[0].message


def test_a_blank_page_that_is_all_a_student_handed_in_is_looked_at():
    roster = Roster("roster.csv", (RosterRow("s1", n=3), RosterRow("s2", n=4)))
    blank = PageRef("s1.png", 1, 1, blank=True)
    back = PageRef("s2_back.png", 1, 1, blank=True)
    found, _ = works(PUMP, roster, owners(owned("s2.jpg", "s2", n=4), blank=(blank, back)))
    assert [len(work.pages) for work in found] == [1, 1]
    assert found[0].pages[0].file == "s1.png"
