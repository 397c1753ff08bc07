from pathlib import Path

from grader.measurements import Measurements
from grader.ownership import How, Owned, Ownership, PageSource
from grader.records import Reading
from grader.roster import Roster, RosterRow
from grader.works import works_of
from reference.assignment import Variant, load_assignment

PUMP = load_assignment("pump")
PRESS = load_assignment("press")


def owned(file, student, n=None, position=None):
    return Owned(PageSource(file, 1, 1), student, n, position, (How.NAME,))


def ownership(*pages, blank=()):
    return Ownership(tuple(pages), (), tuple(blank))


def entered(student, n=None, position=None, source="class.csv"):
    return Measurements(student, n, position, {}, Reading({}), {"v_A": 1.0}, source, 2)


def works(assignment, roster, pages, measured=()):
    paths = {page.source.file: Path("in") / page.source.file for page in pages.owned}
    paths |= {source.file: Path("in") / source.file for source in pages.blank}
    return works_of(assignment, roster, pages, list(measured), paths, "en")


def test_everybody_on_the_roster_has_a_work_even_with_nothing_handed_in():
    roster = Roster("roster.csv", (RosterRow("s1", "Ana", n=3), RosterRow("s2", "Ion", n=4)))
    found, strangers = works(PUMP, roster, ownership(owned("s1.jpg", "s1", n=3)))
    assert [(work.student_id, len(work.pages)) for work in found] == [("s1", 1), ("s2", 0)]
    assert not strangers
    assert found[0].variant == Variant(n=3)
    assert found[0].name == "Ana"


def test_pages_and_measurements_of_one_student_come_together():
    roster = Roster("roster.csv", (RosterRow("s1", n=3),))
    found, _ = works(PUMP, roster, ownership(owned("s1.jpg", "s1", n=3)), [entered("s1")])
    assert len(found) == 1
    assert found[0].pages
    assert found[0].measured is not None


def test_a_number_on_which_two_sources_differ_is_not_guessed():
    roster = Roster("roster.csv", (RosterRow("s1", n=3),))
    found, _ = works(PUMP, roster, ownership(owned("s1.jpg", "s1", n=3)), [entered("s1", n=4)])
    assert found[0].variant is None
    assert [problem.code for problem in found[0].problems] == ["n_disagrees", "n_needed"]


def test_measurements_of_somebody_who_is_not_on_the_roster_are_told():
    roster = Roster("roster.csv", (RosterRow("s1", n=3),))
    found, strangers = works(PUMP, roster, ownership(), [entered("zz", n=5)])
    assert [work.student_id for work in found] == ["s1"]
    assert strangers[0].code == "measurements_unmatched"
    assert "line 2" in strangers[0].message


def test_without_a_roster_each_measured_student_has_a_work():
    found, strangers = works(PUMP, None, ownership(), [entered("a", n=1), entered("b", n=2)])
    assert [(work.student_id, work.variant) for work in found] == [("a", Variant(n=1)), ("b", Variant(n=2))]
    assert not strangers


def test_a_student_has_a_work_for_each_position():
    rows = (RosterRow("s1", position=0), RosterRow("s1", position=1))
    pages = ownership(owned("a.jpg", "s1", position=0), owned("b.jpg", "s1", position=1))
    found, _ = works(PRESS, Roster("roster.csv", rows), pages, [entered("s1", position=1)])
    assert [(work.variant, len(work.pages), work.measured is not None) for work in found] == [
        (Variant(position=0), 1, False),
        (Variant(position=1), 1, True),
    ]


def test_measurements_without_a_position_go_to_the_only_one():
    roster = Roster("roster.csv", (RosterRow("s1", position=2),))
    found, strangers = works(PRESS, roster, ownership(), [entered("s1")])
    assert found[0].measured is not None
    assert not strangers


def test_a_second_file_of_measurements_is_told_and_not_counted():
    first, second = entered("s1", n=3), entered("s1", n=3, source="other.csv")
    found, _ = works(PUMP, None, ownership(), [first, second])
    assert found[0].measured is first
    assert [problem.code for problem in found[0].problems] == ["measurements_twice"]


def test_a_blank_page_that_is_all_a_student_handed_in_is_looked_at():
    roster = Roster("roster.csv", (RosterRow("s1", n=3), RosterRow("s2", n=4)))
    blank = PageSource("s1.png", 1, 1, blank=True)
    back = PageSource("s2_back.png", 1, 1, blank=True)
    found, _ = works(PUMP, roster, ownership(owned("s2.jpg", "s2", n=4), blank=(blank, back)))
    assert [len(work.pages) for work in found] == [1, 1]
    assert found[0].pages[0].name == "s1.png"
