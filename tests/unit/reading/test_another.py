"""Pages that do not read as their student's drawing: mirrored ones, and another assignment's."""

from dataclasses import replace

import pytest

from grader.reading.another import told_instead
from grader.reading.read import read_figures
from grader.reading.vectors import MOST_OPEN
from grader.records import ACCELERATION_PLAN, Figure, Ink, PageRef, Reading, ReadVector, Reason, ScannedPage
from reference.authored.assignment import Assignment, Variant, load_assignment
from tests.unit.reading.drawn import PLACES, Pen, blank_sheet, draw, ink_of, task

PUMP = load_assignment("pump")
OWN = PUMP.variant(7)
ALONE = replace(PUMP, path=PUMP.path.parent / "no" / PUMP.path.name)
"""With no assignment beside it in its folder."""


def drawn(name: str, variant: Variant) -> Ink:
    _, _, drawing = task(name, variant)
    return draw(drawing, PLACES, Pen(redraw_mm=0.1)).ink


def page(ink: Ink, assignment: Assignment, variant: Variant) -> ScannedPage:
    (reading,) = read_figures([(ink, blank_sheet())], assignment, variant, None, ())
    return ScannedPage(PageRef("s.png"), sheet=blank_sheet(), ink=ink, reading=reading)


def told(one: ScannedPage, variant: Variant | None = OWN, assignment: Assignment = ALONE) -> list:
    (page,) = told_instead([one], assignment, variant)
    return list(page.problems)


def test_a_mirrored_sheet_is_told_where_its_variant_is_known():
    one = page(drawn("pump", PUMP.variant(7)).mirrored(), PUMP, OWN)
    assert told(one) == [Reason("sheet_mirrored", {}, "s.png")]
    assert told(one, None) == []


def test_pages_of_which_one_was_read_are_not_told():
    ink = drawn("pump", OWN)
    pages = [page(each, PUMP, OWN) for each in (ink, ink.mirrored())]
    assert [list(one.problems) for one in told_instead(pages, ALONE, OWN)] == [[], []]


def test_a_sheet_of_forces_whose_sense_alone_is_open_is_not_compared(monkeypatch):
    monkeypatch.setattr("grader.reading.another._shown", lambda *_: pytest.fail("the sheet was read"))
    forces = {name: ReadVector(30.0, 0.1, 20.0, 0.5, MOST_OPEN) for name in ("F_D", "F_iD", "R_0D", "R_34")}
    reading = Reading({"force_plan_D": Figure({}, forces)})
    assert told(ScannedPage(PageRef("s.png"), sheet=blank_sheet(), ink=ink_of([]), reading=reading)) == []


def test_a_velocity_plan_alone_is_not_told_as_mirrored():
    _, _, drawing = task("pump", OWN)
    places = {name: at for name, at in PLACES.items() if name != ACCELERATION_PLAN}
    one = page(draw(drawing, places).ink.mirrored(), PUMP, OWN)
    assert told(one) == []


def test_the_mirror_image_of_a_mirror_image_is_the_sheet():
    ink = drawn("pump", PUMP.variant(7))
    twice = ink.mirrored().mirrored()
    assert twice.strokes.ends == pytest.approx(ink.strokes.ends)
    assert twice.circles == pytest.approx(ink.circles)
    assert (twice.where.ink == ink.where.ink).all()


def test_a_sheet_of_another_assignment_is_told_with_its_name():
    press = load_assignment("press")
    one = page(drawn("press", press.variants()[3]), PUMP, OWN)
    (problem,) = told(one, assignment=PUMP)
    assert problem.code == "sheet_of_another"
    assert problem.parameters["other"] in {"press", "press-all"}
    assert problem.parameters["own"] == "pump"


def test_assignments_elsewhere_are_not_compared():
    press = load_assignment("press")
    one = page(drawn("press", press.variants()[3]), PUMP, OWN)
    assert told(one) == []


@pytest.mark.parametrize("n", [7, 9])
def test_another_students_sheet_is_neither(n):
    one = page(drawn("pump", PUMP.variant(n)), PUMP, OWN)
    assert told(one) == []


def test_lines_that_are_no_drawing_fit_nothing():
    ink = ink_of([(complex(40 * k, -30 * k), complex(40 * k + 70, -200)) for k in range(1, 7)])
    one = ScannedPage(PageRef("s.png"), sheet=blank_sheet(), ink=ink, reading=Reading({}))
    assert told(one) == []
