"""The roster's door: whatever the file holds, there is a roster or a list of its faults."""

from hypothesis import given
from hypothesis import strategies as st

from grader.files import shown_text
from grader.owners.draft_roster import RosterDraft, draft_csv
from grader.records import Reason
from grader.tables.reader import TableError
from grader.tables.roster import Roster, RosterRow, ScanRef, parse_roster, parse_scan

HEADER = st.lists(
    st.sampled_from(["student_id", "name", "n", "position", "scans", "lang", "kv", "what", ""]), max_size=8
)
CELLS = st.text(alphabet='s1;,#"\n\r\t\x00 .-é7', max_size=8)


@given(HEADER, st.lists(st.lists(CELLS, max_size=8), max_size=4), st.sampled_from(",;"))
def test_any_table_is_a_roster_or_its_faults(header, rows, delimiter):
    text = "\n".join(delimiter.join(cells) for cells in [header, *rows])
    faults: tuple[Reason, ...] = ()
    roster = Roster("", ())
    try:
        roster = parse_roster(text)
    except TableError as error:
        faults = error.faults
    assert bool(faults) != bool(roster.rows)
    assert all(fault.parameters["line"] for fault in faults)
    assert all(set(row.student_id) <= set("s1.-7") for row in roster.rows)


@given(st.text(max_size=30) | st.text(alphabet="a#.1", max_size=6))
def test_any_text_is_a_scan_or_a_page_written_wrongly(text):
    found = parse_scan(text)
    if isinstance(found, Reason):
        assert (found.code, "#" in text) == ("no_scan", True)
    else:
        assert str(found) == shown_text(text) or found.page is not None


names = st.text(alphabet=st.characters(exclude_categories=["Cs", "Cc"]), max_size=12).map(str.strip)
files = st.text(alphabet="ab_#., -7", min_size=1, max_size=8).map(str.strip).filter(
    lambda name: name and isinstance(parse_scan(name), ScanRef) and parse_scan(name).page is None
)  # fmt: skip


@given(st.lists(names, min_size=1, max_size=4), st.lists(files, unique=True, max_size=3))
def test_a_draft_read_back_is_the_roster_it_was_made_of(students, scans):
    rows = [
        RosterRow(
            f"s{number}",
            name,
            n=number,
            line=number + 2,
            scans=(ScanRef(scans[number], 2),) if number < len(scans) else (),
        )
        for number, name in enumerate(students)
    ]
    again = parse_roster(draft_csv(Roster("roster.csv", tuple(rows)), RosterDraft(())))
    assert [(row.student_id, row.name, row.n, row.scans) for row in again.rows] == [
        (row.student_id, row.name, row.n, row.scans) for row in rows
    ]
