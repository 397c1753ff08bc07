"""Names that platforms give to files are matched to the roster, or to nobody."""

import pytest

from grader.owners.pages import How, assign_pages
from grader.owners.platforms import owners_by_platform
from grader.records import PageRef, Reason
from grader.tables.roster import parse_roster

ROSTER = parse_roster(
    "student_id,name,email\n"
    "s01,Ștefan Țurcanu,st@x.md\n"
    "s02,Ion Rusu,\n"
    "s03,Ion Rusu,\n"
    "s04,Пётр Сергеевич Иванов,\n"
    "s05,Ana-Maria O'Brien,\n"
    "101,Vasile Munteanu,vm@x.md\n"
)


def told(*files: str) -> list[str | None]:
    """The student of each file; the problem's code where there is none."""
    found = owners_by_platform(files, ROSTER)
    return [one.code if isinstance(one := found.get(file), Reason) else one for file in files]


@pytest.mark.parametrize(
    ("file", "student"),
    [
        ("a.zip/Stefan Turcanu_103_assignsubmission_file_/scan.pdf", "s01"),
        ("Ştefan Ţurcanu_103_assignsubmission_file/deep/scan.pdf", "s01"),
        ("a.zip/Ţurcanu Ştefan_103_assignsubmission_file_scan_1.pdf", "s01"),
        ("Иванов Петр_7_assignsubmission_file_/скан.jpg", "s04"),
        ("Участник_7_assignsubmission_file_/скан.jpg", "owner_name"),
        ("Ion Rusu_5_assignsubmission_file_/a.jpg", "owner_name"),
        ("Maria Pop_5_assignsubmission_file_/a.jpg", "owner_name"),
        ("c.zip/obrienanamaria_LATE_4711_98765_scan.pdf", "s05"),
        ("c.zip/ţurcanuştefan_4711_98765_scan-1.pdf", "s01"),
        ("c.zip/rusuion_4711_98765_scan.pdf", "owner_name"),
        ("g.zip/submission_1 [V. M., 101, other@x.md]/a.jpg", "101"),
        ("g.zip/22 [Nobody, VM@x.md].pdf", "101"),
        ("g.zip/22 [Vasile Munteanu, 101; Stefan Turcanu, s01].pdf", "owner_name"),
        ("class/Munteanu Vasile/1.jpg", "101"),
        ("class/s05/1.jpg", "s05"),
        ("class/group A/1.jpg", None),
        ("class/Ion Rusu/1.jpg", None),
        ("s01_2_3_scan.jpg", None),
    ],
)
def test_names_of_platforms_and_folders_tell_students_for_certain_or_nobody(
    file: str, student: str | None
) -> None:
    assert told(file) == [student]


def test_two_participants_of_one_name_are_nobodys_and_two_files_of_one_are_both_his() -> None:
    name = "Stefan Turcanu_{}_assignsubmission_file_/{}.jpg"
    assert told(name.format(1, "a"), name.format(1, "b")) == ["s01", "s01"]
    assert told(name.format(1, "a"), name.format(2, "b")) == ["owner_name"] * 2
    assert told("v.zip/" + name.format(1, "a"), "a.zip/" + name.format(2, "b")) == ["s01", "s01"]


def test_pages_are_the_students_unless_another_source_disagrees_or_there_is_no_roster() -> None:
    folder = "a.zip/Stefan Turcanu_1_assignsubmission_file_/"
    pages = [
        PageRef(folder + "scan.pdf", 1, 2),
        PageRef(folder + "s05.jpg"),
        PageRef("Q R_1_assignsubmission_file_/a.jpg"),
    ]
    owners = assign_pages(pages, ROSTER, "pump")
    assert [(one.source.file, one.student_id, one.how) for one in owners.owned] == [
        (pages[0].file, "s01", (How.PLATFORM,))
    ]
    assert [(one.problem.code, one.students) for one in owners.unmatched] == [
        ("owner_disagree", ("s05", "s01")),
        ("owner_name", ()),
    ]
    without = assign_pages(pages, None, "pump")
    assert not without.owned
    assert {one.problem.code for one in without.unmatched} == {"owner_name"}
