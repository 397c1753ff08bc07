import numpy as np
import pytest
import simplejpeg

from grader.contact_sheet import contact_sheet, thumbnail
from grader.matching import draft_csv, suggest
from grader.ownership import PageSource
from grader.records import Identity
from grader.roster import parse_roster
from reference.assignment import load_assignment

PUMP = load_assignment("pump")
ROSTER = parse_roster("student_id,name,n,kv,scans\ns1,Ana,1,0.2 (m/s)/mm,\ns2,Ion,10,,\ns3,Eva,20,,\n")


def page(number, pages=3, file="class.pdf", **more):
    return PageSource(file, number, pages, **more)


def code(student, n):
    return Identity("pump", student, n, None, "velocity")


def by_page(draft):
    return {str(s.source): (s.row.student_id if s.row else None, s.sure) for s in draft.suggestions}


def test_codes_and_names_are_sure_and_the_rest_is_to_be_checked():
    pages = [
        page(1, identity=code("s2", 10)),
        page(2),
        page(3, blank=True),
        PageSource("s3.jpg", 1, 1),
        PageSource("x.jpg", 1, 1),
    ]
    draft = suggest(pages, ROSTER, PUMP)
    assert by_page(draft) == {
        "class.pdf#1": ("s2", True),
        "class.pdf#2": (None, False),
        "s3.jpg": ("s3", True),
        "x.jpg": (None, False),
    }


def test_a_crank_drawn_at_one_students_angle_suggests_that_student():
    # phi = 30 + 2n degrees: 32, 50 and 70.
    drawn = page(1)
    draft = suggest([drawn, page(2)], ROSTER, PUMP, crank_deg={drawn: 50.6})
    (suggestion, other) = draft.suggestions
    assert suggestion.row.student_id == "s2"
    assert not suggestion.sure
    assert "50.6" in suggestion.why
    assert other.row is None


@pytest.mark.parametrize("angle", [41.0, 200.0])
def test_a_crank_at_nobodys_angle_suggests_nobody(angle):
    drawn = page(1)
    assert suggest([drawn, page(2)], ROSTER, PUMP, crank_deg={drawn: angle}).suggestions[0].row is None


def test_neighbours_that_a_hand_cannot_tell_apart_are_all_named():
    roster = parse_roster("student_id,name,n\ns1,A,5\ns2,B,6\ns3,C,5\n")
    drawn = PageSource("x.jpg", 1, 1)
    (suggestion,) = suggest([drawn], roster, PUMP, crank_deg={drawn: 40.2}).suggestions
    assert suggestion.row is None
    assert "s1" in suggestion.why
    assert "s3" in suggestion.why


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


def test_sources_that_disagree_are_left_to_the_person_whatever_the_crank_says():
    contested = PageSource("s1.jpg", 1, 1, identity=code("s2", 10))
    (suggestion,) = suggest([contested], ROSTER, PUMP, crank_deg={contested: 32.0}).suggestions
    assert suggestion.row is None
    assert "s1" in suggestion.why
    assert "s2" in suggestion.why


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
    hostile = PageSource("<img src=x onerror=alert(1)>.jpg", 1, 1)
    draft = suggest([page(1, identity=code("s2", 10)), hostile], ROSTER, PUMP)
    picture = thumbnail(np.full((300, 400), 200, np.uint8))
    html = contact_sheet([(suggestion, picture) for suggestion in draft.suggestions])
    assert html.count("data:image/jpeg;base64,") == 2
    assert "s2, Ion, n = 10" in html
    assert "<img src=x" not in html
    assert "http" not in html


def test_a_thumbnail_is_turned_upright():
    grey = np.full((100, 200), 255, np.uint8)
    grey[:, :50] = 0
    turned = decoded(thumbnail(grey, quarter_turns=1).jpeg)
    assert turned.shape == (200, 100)
    assert turned[-20:].mean() < 30
    assert turned[:20].mean() > 220


def decoded(jpeg):
    return simplejpeg.decode_jpeg(jpeg, colorspace="GRAY")[:, :, 0]
