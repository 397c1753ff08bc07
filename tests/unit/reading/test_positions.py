"""Sheets with all positions: whose they are, and each position read in its own zone."""

from dataclasses import replace

import numpy as np
import pytest

from grader.owners.pages import assign_pages
from grader.pipeline import read_submission
from grader.printed.answer_sheet import make_sheets
from grader.reading import another
from grader.records import Identity, PageRef, Reason
from grader.rubric import asked_of, rubric_of
from grader.scan.page import open_page
from grader.tables.measurements import StudentSubmission
from grader.tables.roster import Roster, RosterRow, ScanRef
from reference.authored.assignment import AssignmentFile, Variant, load_assignment
from samples.simulation import CAREFUL, CLEAN_SCAN, PenStyle, Settings
from samples.simulation.positions import Numbering, simulate_positions
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


def test_a_sheet_that_is_named_on_several_lines_belongs_to_their_positions():
    rows = [replace(row, scans=(ScanRef("IMG_1.jpg"),) if row.position != 0 else ()) for row in ROWS]
    found = owners(PageRef("IMG_1.jpg"), Roster("roster.csv", tuple(rows)))
    assert [one.position for one in found.owned] == list(POSITIONS)[1:]


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


def _drawn(folder, printed, numbering=None):
    """The two sheets of one student, opened, and their truths."""
    pen = PenStyle(erased=0.0, construction_lines=0.3, smudges=0)
    own = Settings(CAREFUL, pen=pen, scan=replace(CLEAN_SCAN, dpi=200.0, dpi_tag=200.0))
    opened, truths = [], []
    for number, page in enumerate(
        simulate_positions(ALL, None, 5, own, printed=printed, numbering=numbering)
    ):
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


MIXED = (2, 6, 4, 1, 0, 7, 5, 3)
"""Positions in the order of their plans, with the two dead points among others."""


def _without_letters(pages, signs):
    """The pages with these signs alone beside the plans: boxes' corners and what is written."""
    letters = pages[1].ink.letters
    probability = np.zeros((len(signs), letters.probability.shape[1]))
    for row, (_, sign) in enumerate(signs):
        probability[row, letters.column[sign]] = 1.0
    box = np.array([[x + 2, y, 2, 3] for (x, y), _ in signs]).reshape(-1, 4)
    own = replace(letters, box_mm=box, probability=probability, whole=np.ones(len(signs), bool))
    return [pages[0], replace(pages[1], ink=replace(pages[1].ink, letters=own))]


def _pole(truths, position):
    return truths[1][position]["figures"]["velocity_plan"]["nodes"]["o"]


def _lies_at(page, truths, position):
    """Return whether the velocity plan was read at a position's place."""
    plan, (x, y) = page.reading.figures["velocity_plan"], _pole(truths, position)
    middle = (plan.nodes["o"].at + plan.nodes["a"].at) / 2.0
    return abs(middle - complex(x, -y)) < 40.0


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    return _drawn(tmp_path_factory.mktemp("mixed"), None, Numbering("none", MIXED))


@pytest.mark.parametrize(("first", "second"), [(0, 4), (4, 0)])
def test_the_numbers_beside_plans_tell_the_positions(mixed, first, second):
    """Two dead points have one shape: of two numbers beside them, 4 is read, and 0 is no number."""
    pages, truths = mixed
    signed = _without_letters(pages, [(_pole(truths, first), "4")])
    assert _lies_at(_read(signed, 4)[1], truths, first)
    assert _lies_at(_read(signed, 0)[1], truths, second)


def test_numbers_that_count_from_one_tell_the_positions(mixed):
    pages, truths = mixed
    signs = [(_pole(truths, position), str(position + 1)) for position in (1, 2, 3, 5, 6, 7)]
    signed = _without_letters(pages, [*signs, (_pole(truths, 0), "5"), (_pole(truths, 4), "1")])
    assert _lies_at(_read(signed, 4)[1], truths, 0)


def test_a_plan_that_may_be_another_positions_is_told(mixed):
    pages, _ = mixed
    page = _read(_without_letters(pages, []), 4)[1]
    assert Reason("position_unclear", {"positions": ("0", "4")}, page.ref.file) in page.problems
    vectors = page.reading.figures["velocity_plan"].vectors.values()
    assert max(vector.confidence for vector in vectors) < 0.9


@pytest.mark.parametrize("position", [0, 4])
def test_the_order_of_the_plans_tells_the_positions(plain, position):
    """Without letters and numbers, six other plans stand in order."""
    pages, truths = plain
    page = _read(_without_letters(pages, []), position)[1]
    assert _lies_at(page, truths, position)
    assert "position_unclear" not in {problem.code for problem in page.problems}


def test_a_dead_point_is_not_held_against_other_assignments(plain, monkeypatch):
    asked = []
    monkeypatch.setattr(another, "_shown", lambda *arguments: asked.append(arguments))
    _read(_without_letters(plain[0], []), 4)
    assert asked == []


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
