"""Whatever is handed in, no page is lost and none has two owners."""

from hypothesis import given
from hypothesis import strategies as st

from grader.owners.pages import assign_pages
from grader.records import Identity, PageRef
from grader.tables.roster import Roster, RosterRow, ScanRef
from grader.texts.spoken import ENGLISH, sentence

STUDENTS = ("s1", "s2", "s_3", "s")
FILES = ("s1.jpg", "s_3_2.jpg", "class.pdf", "other.pdf", "S2.png", "x.tif")
POSITIONS = st.none() | st.integers(0, 2)

identities = st.builds(
    Identity,
    assignment=st.sampled_from(["pump", "pump", "press"]),
    student_id=st.sampled_from([*STUDENTS, "stranger"]),
    n=st.none() | st.integers(1, 2),
    position=POSITIONS,
    kind=st.just("all"),
)
refs = st.builds(ScanRef, st.sampled_from([*FILES, "gone.pdf"]), st.none() | st.integers(1, 5))


@st.composite
def rosters(draw):
    keys = draw(
        st.lists(st.tuples(st.sampled_from(STUDENTS), POSITIONS), unique=True, min_size=1, max_size=5)
    )
    return Roster(
        "roster.csv",
        tuple(
            RosterRow(student, n=draw(st.none() | st.integers(1, 2)), position=position, line=line,
                      scans=tuple(draw(st.lists(refs, max_size=2))))
            for line, (student, position) in enumerate(keys, start=2)
        ),
    )  # fmt: skip


@st.composite
def folders(draw):
    pages = []
    for file in draw(st.lists(st.sampled_from(FILES), unique=True, max_size=4)):
        count = draw(st.integers(1, 5))
        for number in range(1, count + 1):
            identity = draw(st.none() | st.none() | identities)
            pages.append(PageRef(file, number, count, draw(st.booleans()), identity))
    return pages


@given(folders(), st.none() | rosters(), st.none() | st.integers(1, 3))
def test_every_page_ends_in_exactly_one_place_and_in_the_order_given(pages, roster, each):
    found = assign_pages(pages, roster, "pump", pages_per_student=each)
    places = (
        [owned.source for owned in found.owned],
        [loose.source for loose in found.unmatched],
        list(found.blank),
    )
    assert sorted(map(pages.index, (page for place in places for page in place))) == list(range(len(pages)))
    for place in places:
        assert list(map(pages.index, place)) == sorted(map(pages.index, place))


@given(folders(), rosters(), st.none() | st.integers(1, 3))
def test_an_owner_is_a_row_of_the_roster_and_no_code_says_otherwise(pages, roster, each):
    rows = {(row.student_id, row.position) for row in roster.rows}
    for owned in assign_pages(pages, roster, "pump", pages_per_student=each).owned:
        assert (owned.student_id, owned.position) in rows or (owned.student_id, None) in rows
        identity = owned.source.identity
        if identity is not None:
            assert (identity.assignment, identity.student_id) == ("pump", owned.student_id)
            assert identity.position in (None, owned.position)
            assert identity.n in (None, owned.n)


@given(folders(), rosters(), st.none() | st.integers(1, 3))
def test_a_page_that_is_unmatched_says_why_and_where(pages, roster, each):
    for loose in assign_pages(pages, roster, "pump", pages_per_student=each).unmatched:
        assert loose.problem.file == loose.source.file
        assert loose.problem.code.startswith(("owner_", "order_"))
        assert sentence(loose.problem, ENGLISH)
