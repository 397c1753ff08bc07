"""Task sheets: what a student is given is there, and nothing of the solution."""

import re

import numpy as np
import pypdfium2
import pytest

from grader.printed import handout
from grader.printed.handout import make_handout
from grader.rubric import rubric_of
from grader.tables.roster import RosterRow
from reference.authored.assignment import Variant, built_in, library, load_assignment
from reference.errors import AuthoredFileError
from reference.plan import exact_plan
from tests.told import tells

A4_POINTS = (595.3, 841.9)


def pages_of(assignment, *rows, lang="en"):
    """The text of every page."""
    document = pypdfium2.PdfDocument(make_handout(assignment, rubric_of(assignment), rows, lang))
    assert all(page.get_size() == pytest.approx(A4_POINTS, abs=0.5) for page in document)
    return [page.get_textpage().get_text_bounded() for page in document]


def first_row(assignment, **known):
    variant = assignment.variants()[0]
    return RosterRow("s07", "Ana Țîrlea", variant.n, variant.position, line=2, **known)


@pytest.mark.parametrize("name", built_in())
def test_a_sheet_has_task_data_and_tables_and_no_number_of_the_solution(name):
    assignment = load_assignment(name)
    row = first_row(assignment)
    words = " ".join(" ".join(pages_of(assignment, row)).split())
    assert assignment.file.title.en in words
    assert "Ana Țîrlea (s07)" in words
    assert ("Velocities" if assignment.forces is None else "Forces") in words
    variant = Variant(row.n, row.position)
    given = {
        abs(float(np.ravel(one.value(assignment.values([variant])))[0])) for one in assignment.file.given
    }
    plan = exact_plan(assignment, [variant])
    solution = {float(np.abs(plan.drawn_mm(name))[0]) for name in plan.construction.vectors}
    solution |= {float(np.abs(value)[0]) for value in plan.rates.values()}
    if plan.forces is not None:
        told = {one.name for one in plan.forces.given if one.kind == "load"}
        solution |= {float(np.abs(value[0])) for name, value in plan.vectors_si.items() if name not in told}
        given |= masses_of(assignment, plan)
    printed = {float(number) for number in re.findall(r"\d+\.\d+", words)}
    for number in printed - given:
        assert not any(number == pytest.approx(value, rel=1e-3) for value in solution if value > 1.0)


def masses_of(assignment, plan):
    """Masses, inertias, centres and accelerations."""
    given = {float(one[0]) for body in plan.mechanism.bodies for one in (body.mass, body.inertia) if one}
    centres = [body.centre for body in assignment.file.body if body.centre]
    return given | {float(part.text) for centre in centres for part in centre.at or ()}


def with_own_accelerations(folder):
    """The pump's force plans after an acceleration plan of the student's own."""
    for kind, given, own in (
        ("rubric", 'accelerations = "given"', 'accelerations = "own"'),
        (
            "assignment",
            "[[page]]",
            '[[page]]\nkind = "acceleration"\nfigures = ["acceleration_plan"]\n\n[[page]]',
        ),
    ):
        path = library() / f"pump-forces.{kind}.toml"
        text = path.read_text(encoding="utf-8").replace(given, own, 1)
        (folder / path.name).write_text(text, encoding="utf-8")
    return folder / "pump-forces.assignment.toml"


def test_a_sheet_of_forces_tells_masses_loads_and_the_given_accelerations():
    (text,) = pages_of(load_assignment("pump-forces"), RosterRow("", n=7))
    words = re.sub(r"\s+", " ", text)
    for told in (
        "S2 on O2B, 15 cm from O2",
        "S3: 17.9 cm from A along AB, 4.84 cm to the left",
        # Accelerations of S3 and of the piston, by the solver.
        "404.3 221.1 −243.6",
        "162.9 180 –",
        # Against the piston's motion, which is to the left.
        "2650 N 0",
        "R23 is the force of link 2 on link 3",
    ):
        assert told in words, (told, words)


def test_a_centre_of_mass_behind_its_base_is_not_told_as_one_on_the_link(tmp_path):
    text = (library() / "pump-forces.assignment.toml").read_text(encoding="utf-8")
    path = tmp_path / "mine.assignment.toml"
    path.write_text(text.replace("ratio = 0.5", "ratio = -0.5").replace("17.9,", "-17.9,"), encoding="utf-8")
    words = re.sub(r"\s+", " ", *pages_of(load_assignment(path), RosterRow("", n=7)))
    assert "S2 on O2B extended beyond O2, 15 cm from O2" in words
    assert "S3: −17.9 cm from A along AB, 4.84 cm to the left" in words


def test_students_with_an_acceleration_plan_of_their_own_are_not_told_its_results(tmp_path):
    assignment = load_assignment(with_own_accelerations(tmp_path))
    words = re.sub(r"\s+", " ", " ".join(pages_of(assignment, RosterRow("", n=7))))
    assert "from your acceleration plan" in words
    assert "against its motion" in words
    assert "404.3" not in words
    assert "2650 N" in words


def test_each_student_reads_their_own_language():
    assignment = load_assignment("pump")
    rows = [first_row(assignment, lang=lang) for lang in ("ro", "ru", "en")]
    for text, lang in zip(pages_of(assignment, *rows), ("ro", "ru", "en"), strict=True):
        assert assignment.file.title.in_language(lang) in " ".join(text.split())


def test_a_sheet_without_a_student_has_lines_for_the_name():
    (text,) = pages_of(load_assignment("pump"), RosterRow("", n=7))
    assert "Name ____" in text


def test_the_scheme_is_not_in_the_position_that_the_student_has_to_draw():
    assignment = load_assignment("press")
    own = assignment.variant(None, 3)
    picture, title = handout._scheme(assignment, own)
    assert title == handout.SCHEME
    assert picture.shapes != handout._drawn(handout._fitted(assignment, own)).shapes


def test_many_vectors_take_several_pages(monkeypatch):
    monkeypatch.setattr(handout, "MOST_ROWS", 8)
    assignment = load_assignment("pump")
    assert len(pages_of(assignment, first_row(assignment))) == 2


def test_a_row_that_does_not_suit_the_assignment_is_told_with_its_line():
    with pytest.raises(AuthoredFileError, check=tells("line 2, s07")):
        pages_of(load_assignment("pump"), RosterRow("s07", "Ana", 77, line=2))


def test_a_student_with_several_positions_has_a_page_for_the_results_of_all():
    assignment = load_assignment("press")
    rows = [RosterRow("s07", "Ana", position=position, line=2) for position in (0, 1, 5)]
    *_, table, other = pages_of(assignment, *rows, RosterRow("s08", "Ion", position=2, line=5))
    assert "Results of all positions" in table
    assert [line for line in table.splitlines() if line.strip() in {"0", "1", "5"}]
    heads = " ".join(table.split())
    for head in ("vB, mm", "vDC, mm", "vB, m/s", "vDC, m/s", "aBA n , mm"):
        assert head in heads
    assert "vA, mm" not in heads
    assert "Results of all positions" not in other


def test_a_sheet_says_which_values_are_to_be_computed():
    (text,) = pages_of(load_assignment("press"), RosterRow("", position=1))
    # Of the velocities v_A alone is not asked for as a value; of the accelerations no value is asked for.
    assert text.count("–") == 1
