import io

import numpy as np
import pytest
from PIL import Image

from grader.owners.draft_roster import contact_sheet, draft_csv, figure_similarity, said, suggest, thumbnail
from grader.records import Identity, PageRef
from grader.tables.roster import parse_roster
from grader.texts.spoken import ENGLISH
from reference.authored.assignment import load_assignment
from reference.construction.derive import construction_of
from reference.construction.graph import evaluate, parameters_of

PUMP = load_assignment("pump")
ROSTER = parse_roster("student_id,name,n,kv,scans\ns1,Ana,1,0.2 (m/s)/mm,\ns2,Ion,10,,\ns3,Eva,20,,\n")


def page(number, pages=3, file="class.pdf", **more):
    return PageRef(file, number, pages, **more)


def code(student, n):
    return Identity("pump", student, n, None, "velocity")


def by_page(draft):
    return {str(s.source): (s.row.student_id if s.row else None, s.sure) for s in draft.suggestions}


def test_codes_and_names_are_sure_and_the_rest_is_to_be_checked():
    pages = [
        page(1, identity=code("s2", 10)),
        page(2),
        page(3, blank=True),
        PageRef("s3.jpg", 1, 1),
        PageRef("x.jpg", 1, 1),
    ]
    draft = suggest(pages, ROSTER, PUMP)
    assert by_page(draft) == {
        "class.pdf#1": ("s2", True),
        "class.pdf#2": (None, False),
        "s3.jpg": ("s3", True),
        "x.jpg": (None, False),
    }


def drawn(n, *, turn_deg=0.0, seed=0, hand_mm=0.2):
    """A careful student's strokes of mechanism and velocity plan, among scribbles; (n, 2, 2) mm, y down."""
    construction = construction_of(PUMP.mechanism([PUMP.variant(n)]), accelerations=False)
    scales = PUMP.scales([PUMP.variant(n)], crank_mm=55.0)
    nodes = evaluate(
        construction, parameters_of(PUMP.mechanism([PUMP.variant(n)]), scales.kL, scales.kv, scales.ka)
    )
    rng = np.random.default_rng(seed)
    at = {"mechanism": 150.0 - 150.0j, "velocity_plan": 300.0 - 120.0j}
    pairs = [
        ("mechanism", *pair)
        for pair in ("O1 A", "A B", "O2 B", "A C", "B C", "C D")
        for pair in [pair.split()]
    ]
    pairs += [
        ("velocity_plan", vector.tail, vector.head) for vector in construction.vectors_of("velocity_plan")
    ]
    turn = np.exp(1j * np.radians(turn_deg))
    ends = np.array(
        [
            [at[figure] + turn * complex(np.ravel(nodes[name])[0]) for name in names]
            for figure, *names in pairs
        ]
    )
    ends = np.concatenate([ends, rng.uniform(20, 400, (40, 2)) - 1j * rng.uniform(50, 260, (40, 2))])
    ends = ends + rng.normal(0.0, hand_mm, ends.shape) + 1j * rng.normal(0.0, hand_mm, ends.shape)
    return np.stack([ends.real, -ends.imag], axis=-1)


@pytest.mark.parametrize("n", [1, 10, 20])
def test_a_drawing_of_one_students_variant_suggests_that_student(n):
    sheet = PageRef("x.jpg", 1, 1)
    (suggestion,) = suggest([sheet], ROSTER, PUMP, strokes_of=lambda _: drawn(n)).suggestions
    assert suggestion.row.n == n
    assert not suggestion.sure
    assert suggestion.row.student_id in said(suggestion.why, ENGLISH)


def test_likeness_tells_neighbours_apart_by_two_degrees():
    variants = PUMP.variants()
    for n in (2, 15, 29):
        assert variants[int(np.argmax(figure_similarity(drawn(n), PUMP, variants)))].n == n


@pytest.mark.parametrize("strokes", [None, np.zeros((0, 2, 2)), drawn(15), drawn(10)[-40:]])
def test_a_drawing_that_looks_like_nobodys_variant_suggests_nobody(strokes):
    (suggestion,) = suggest([PageRef("x.jpg", 1, 1)], ROSTER, PUMP, strokes_of=lambda _: strokes).suggestions
    assert suggestion.row is None
    assert "looks like" not in said(suggestion.why, ENGLISH)


def test_students_of_one_variant_are_all_named_and_only_an_order_chooses():
    roster = parse_roster("student_id,name,n\ns1,A,5\ns2,B,16\ns3,C,5\n")
    pages = [page(1), page(2)]
    draft = suggest(pages, roster, PUMP, strokes_of=lambda source: drawn((16, 5)[source.page - 1]))
    other = suggest(pages[::-1], roster, PUMP, strokes_of=lambda source: drawn((16, 5)[source.page - 1]))
    assert by_page(draft) == {"class.pdf#1": ("s2", False), "class.pdf#2": ("s3", False)}
    assert by_page(other) == {"class.pdf#2": ("s1", False), "class.pdf#1": ("s2", False)}
    backwards = suggest(
        [page(1), page(2), page(3, 3)], roster, PUMP, strokes_of=lambda s: drawn((16, 5, 16)[s.page - 1])
    )
    assert backwards.suggestions[1].row is None
    assert "s1, s3" in said(backwards.suggestions[1].why, ENGLISH)


def test_a_choice_between_students_of_one_variant_follows_the_rosters_order_where_all_pages_do():
    roster = parse_roster("student_id,name,n\ns1,A,5\ns2,B,16\ns3,C,5\ns4,D,25\n")
    pages = [page(number, 5) for number in range(1, 6)]
    in_order = suggest(
        pages, roster, PUMP, strokes_of=lambda source: drawn((5, 5, 16, 5, 25)[source.page - 1])
    )
    assert [student for student, _ in by_page(in_order).values()] == ["s1", "s1", "s2", "s3", "s4"]
    assert not any(suggestion.sure for suggestion in in_order.suggestions)
    mixed = suggest(pages, roster, PUMP, strokes_of=lambda source: drawn((25, 5, 16, 5, 16)[source.page - 1]))
    assert [student for student, _ in by_page(mixed).values()] == ["s4", None, "s2", None, "s2"]


def test_only_pages_that_are_not_certain_are_looked_at():
    looked = []
    pages = [page(1, identity=code("s2", 10)), page(2), page(3, blank=True)]
    suggest(pages, ROSTER, PUMP, strokes_of=looked.append)
    assert looked == [pages[1]]


def test_a_drawing_that_speaks_against_the_order_is_believed_and_both_are_told():
    order = {1: 10, 2: 1, 3: 20}
    draft = suggest(
        [page(1), page(2), page(3)], ROSTER, PUMP, strokes_of=lambda source: drawn(order[source.page])
    )
    assert by_page(draft) == {
        "class.pdf#1": ("s2", False),
        "class.pdf#2": ("s1", False),
        "class.pdf#3": ("s3", False),
    }
    assert "the roster's order: s1" in said(draft.suggestions[0].why, ENGLISH)
    assert "roster's order; the drawing looks like" in said(draft.suggestions[2].why, ENGLISH)


def test_pages_that_come_out_even_are_suggested_in_order_to_be_checked():
    draft = suggest([page(number, 12, blank=number % 2 == 0) for number in range(1, 13)], ROSTER, PUMP)
    assert by_page(draft) == {
        "class.pdf#1": ("s1", False),
        "class.pdf#3": ("s1", False),
        "class.pdf#5": ("s2", False),
        "class.pdf#7": ("s2", False),
        "class.pdf#9": ("s3", False),
        "class.pdf#11": ("s3", False),
    }


def test_sources_that_disagree_are_left_to_the_person_whatever_is_drawn():
    contested = PageRef("s1.jpg", 1, 1, identity=code("s2", 10))
    (suggestion,) = suggest([contested], ROSTER, PUMP, strokes_of=lambda _: drawn(1)).suggestions
    assert suggestion.row is None
    assert "s1" in said(suggestion.why, ENGLISH)
    assert "s2" in said(suggestion.why, ENGLISH)


def test_the_draft_is_a_roster_again_with_the_scans_filled_in():
    pages = [
        page(1, identity=code("s2", 10)),
        page(2, identity=code("s2", 10)),
        page(3, identity=code("s1", 1)),
    ]
    text = draft_csv(ROSTER, suggest(pages, ROSTER, PUMP))
    again = parse_roster(text)
    assert [[str(ref) for ref in row.scans] for row in again.rows] == [
        ["class.pdf#3"],
        ["class.pdf#1", "class.pdf#2"],
        [],
    ]
    assert [(row.student_id, row.name, row.n, dict(row.scales)) for row in again.rows] == [
        (row.student_id, row.name, row.n, dict(row.scales)) for row in ROSTER.rows
    ]
    assert text.splitlines()[0].endswith("scans,why,sure")
    assert [line.rsplit(",", 1)[1] for line in text.splitlines()[1:]] == ["yes", "yes", "check"]


def test_scans_that_the_roster_has_already_stay_and_are_not_doubled():
    roster = parse_roster("student_id,name,n,scans\ns1,A,1,class.pdf;late.jpg\n")
    pages = [page(1, 2), page(2, 2)]
    (row,) = parse_roster(draft_csv(roster, suggest(pages, roster, PUMP))).rows
    assert [str(ref) for ref in row.scans] == ["class.pdf", "late.jpg"]


def test_the_contact_sheet_shows_every_page_with_its_reason_and_nothing_from_outside():
    hostile = PageRef("<img src=x onerror=alert(1)>.jpg", 1, 1)
    draft = suggest([page(1, identity=code("s2", 10)), hostile], ROSTER, PUMP)
    picture = thumbnail(np.full((300, 400), 200, np.uint8))
    html = contact_sheet([(suggestion, picture) for suggestion in draft.suggestions])
    assert html.count("data:image/jpeg;base64,") == 2
    assert "s2, Ion, n = 10" in html
    assert "codul QR" in contact_sheet([(draft.suggestions[0], picture)], "ro")
    assert "<img src=x" not in html
    assert "://" not in html


def test_a_thumbnail_is_a_small_picture_of_the_whole_page():
    grey = np.full((1500, 2000), 255, np.uint8)
    grey[:, :500] = 0
    small = decoded(thumbnail(grey))
    assert small.shape == (480, 640)
    assert small[:, :150].mean() < 30
    assert small[:, 170:].mean() > 220


def decoded(jpeg):
    return np.asarray(Image.open(io.BytesIO(jpeg)))
