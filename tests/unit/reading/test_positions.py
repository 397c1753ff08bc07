"""Sheets with all positions: whose they are, and each position read in its own zone."""

from dataclasses import replace

import numpy as np
import pytest

from grader.owners.pages import assign_pages
from grader.pipeline import read_submission
from grader.printed.answer_sheet import make_sheets
from grader.records import Identity, PageRef
from grader.rubric import asked_of, rubric_of
from grader.scan.page import open_page
from grader.tables.measurements import StudentSubmission
from grader.tables.roster import Roster, RosterRow
from reference.authored.assignment import AssignmentFile, Variant, load_assignment
from samples.simulation import CAREFUL, CLEAN_SCAN, PenStyle, Settings
from samples.simulation.positions import simulate_positions
from samples.simulation.printing import printed_sheets

ALL = load_assignment("press-all")
POSITIONS = ALL.shared_positions
ROWS = tuple(RosterRow("s01", "Ana", position=position) for position in POSITIONS)
CODE = Identity("press-all", "s01", None, None, "velocity")


def owners(page, roster=None, **more):
    return assign_pages([page], roster, "press-all", shared_positions=POSITIONS, **more)


@pytest.mark.parametrize("page", [PageRef("scan.jpg", identity=CODE), PageRef("s01_2.jpg")])
def test_a_sheet_with_all_positions_belongs_to_each_of_the_students(page):
    roster = Roster("roster.csv", (*ROWS, RosterRow("s02", "Ion", position=1)))
    assert [(one.student_id, one.position) for one in owners(page, roster).owned] == [
        ("s01", position) for position in POSITIONS
    ]


def test_without_a_roster_such_a_sheet_still_has_all_positions():
    assert [one.position for one in owners(PageRef("x.jpg", identity=CODE)).owned] == list(POSITIONS)


def test_the_rosters_order_counts_students_where_sheets_are_shared():
    roster = Roster("roster.csv", (*ROWS, *(replace(row, student_id="s02") for row in ROWS)))
    pages = [PageRef("class.pdf", number, 4) for number in (1, 2, 3, 4)]
    found = assign_pages(pages, roster, "press-all", shared_positions=POSITIONS, pages_per_student=2)
    assert {(one.source.page, one.student_id) for one in found.owned} == {
        (1, "s01"), (2, "s01"), (3, "s02"), (4, "s02"),
    }  # fmt: skip
    assert len(found.owned) == 4 * len(POSITIONS)


def test_a_sheet_for_one_position_stays_unmatched_where_the_position_is_open():
    roster = Roster("roster.csv", ROWS)
    (loose,) = assign_pages([PageRef("s01.jpg")], roster, "press-all").unmatched
    assert loose.problem.code == "owner_ambiguous"


@pytest.mark.parametrize(
    ("page", "said"),
    [
        ({"grid": [2, 2]}, "grid_small"),
        ({"figures": ["mechanism", "velocity_plan"]}, "grid_one_figure"),
    ],
)
def test_a_grid_that_cannot_be_printed_is_refused(page, said):
    told = ALL.file.model_dump(by_alias=True)
    told["page"] = [{**told["page"][1], **page}]
    with pytest.raises(ValueError, match=said):
        AssignmentFile.model_validate(told)


def _drawn(folder, printed):
    """The two sheets of one student, opened, and their truths."""
    pen = PenStyle(erased=0.0, construction_lines=0.3, smudges=0)
    own = Settings(CAREFUL, pen=pen, scan=replace(CLEAN_SCAN, dpi=200.0, dpi_tag=200.0))
    opened, truths = [], []
    for number, page in enumerate(simulate_positions(ALL, None, 5, own, printed=printed)):
        path = page.sheet.save(folder / f"s01_{number}")
        opened.append(open_page(PageRef(path.name, path=path)))
        truths.append(page.truths)
    return opened, truths


def _read(pages, position):
    submission = StudentSubmission("s01", Variant(None, position), tuple(page.ref for page in pages), {})
    return read_submission(submission, pages, ALL, asked_of(ALL, rubric_of(ALL)))


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    sheets = make_sheets(ALL, ROWS)
    return _drawn(tmp_path_factory.mktemp("all"), printed_sheets(sheets.pdf, sheets.layout))


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return _drawn(tmp_path_factory.mktemp("plain"), None)


@pytest.mark.parametrize("position", [0, 3, 4])
def test_plans_on_plain_paper_are_told_apart(plain, position):
    """Positions 0 and 4 are dead points: both plans are one upright line."""
    pages, truths = plain
    plan, true = _read(pages, position)[1].reading.figures["velocity_plan"], truths[1][position]
    for name in ("o", "a"):
        at = complex(*np.multiply(true["figures"]["velocity_plan"]["nodes"][name], (1, -1)))
        assert abs(plan.nodes[name].at - at) < 1.0


@pytest.mark.parametrize(("written", "stands"), [("4", True), ("1", False), ("o", None)])
def test_the_number_beside_a_plan_tells_the_position(plain, written, stands):
    """The plan of position 0 taken for that of 4 by a number alone; without one nothing of either is sure."""
    pages, truths = plain
    letters = pages[1].ink.letters
    x, y = truths[1][0]["figures"]["velocity_plan"]["nodes"]["o"]
    probability = np.zeros((1, letters.probability.shape[1]))
    probability[0, letters.column[written]] = 1.0
    one = replace(
        letters, box_mm=np.array([[x + 2, y, 2, 3]]), probability=probability, whole=np.ones(1, bool)
    )
    pages = [pages[0], replace(pages[1], ink=replace(pages[1].ink, letters=one))]
    plan = _read(pages, 4)[1].reading.figures["velocity_plan"]
    middle = (plan.nodes["o"].at + plan.nodes["a"].at) / 2.0
    if stands is None:
        assert max(vector.confidence for vector in plan.vectors.values()) < 0.9
    else:
        assert (abs(middle - complex(x, -y)) < 40.0) is stands


@pytest.mark.parametrize("position", [1, 5, 7])
def test_each_position_is_read_in_its_own_zone(scans, position):
    pages, truths = scans
    read = _read(pages, position)
    assert [page.ref.identity.position for page in read] == [None, None]
    plan, true = read[1].reading.figures["velocity_plan"], truths[1][position]["figures"]["velocity_plan"]
    for name, vector in true["vectors"].items():
        assert plan.vectors[name].length_mm == pytest.approx(vector["length_mm"], abs=0.5)
        off = plan.vectors[name].direction_deg - vector["direction_deg"]
        assert np.cos(np.radians(off)) > 0.999
    pole = plan.nodes["o"].at
    assert abs(pole - complex(*np.multiply(true["nodes"]["o"], (1, -1)))) < 1.0


def test_the_ink_of_a_zone_is_that_zones_alone(scans):
    (_, page), _ = scans
    box = (148.333, 51.0, 125.333, 68.0)
    ink = page.ink.within(box)
    middles = ink.strokes.ends.mean(axis=1)
    assert 0 < len(ink.strokes) < len(page.ink.strokes) / 4
    assert np.all((middles > (130.0, 40.0)) & (middles < (290.0, 130.0)))
    assert np.all(ink.tips.stroke < len(ink.strokes))
    whole = page.ink.strokes.ends[page.ink.tips.stroke]
    for row, stroke in enumerate(ink.strokes.ends[ink.tips.stroke]):
        assert np.any(np.all(np.isclose(whole, stroke), axis=(1, 2))), row
