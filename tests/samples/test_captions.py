"""Captions and title blocks of simulated plain sheets: what is read at least, and next to nothing wrongly."""

from dataclasses import replace

import pytest

from grader.pipeline import read_submission
from grader.records import PageRef
from grader.rubric import Asked
from grader.scan.handwriting.captions import NUMBER_WORDS, captioned_scales, written_number
from grader.scan.page import open_page, writing_on
from grader.tables.measurements import StudentSubmission
from grader.tables.scale_text import SURE, Declared, parse_scale
from reference.authored.assignment import SCALE_NAMES, load_assignment
from samples.simulation import CAREFUL, TYPICAL, any_settings, simulate

pytestmark = pytest.mark.slow
PUMP = load_assignment("pump")
STUDENTS = {
    41: (19, TYPICAL, "Соколов Алина"),
    42: (25, TYPICAL, "Lungu Diana"),
    43: (17, TYPICAL, "Петров Алина"),
    44: (22, CAREFUL, "Lungu Radu"),
}
"""Their numbers, hands and names, by seed; they draw on plain paper, scanned on a flatbed at 300 dpi."""
LEAST_NUMBERS, LEAST_SCALES = 2, 2
"""Read surely and rightly on these students' sheets at least."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Each student's variant, the sheets as drawn, and as opened."""
    folder, pages = tmp_path_factory.mktemp("plain"), []
    for seed, (n, hand, name) in STUDENTS.items():
        variant = PUMP.variant(n)
        settings = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.0, work=(PUMP, variant))
        drawn = simulate(PUMP, variant, seed, replace(settings, hand=hand), student_id=name)
        for number, sheet in enumerate(drawn):
            path = sheet.save(folder / f"{seed}_{number}")
            pages.append((variant, sheet, open_page(PageRef(path.name, path=path))))
    return pages


def test_numbers_are_read_and_none_wrongly(pages):
    read = [
        (written_number(writing_on(page, closely=True), range(1, 31), NUMBER_WORDS), variant.n)
        for variant, _, page in pages
    ]
    sure = [(number.text, str(n)) for number, n in read if number is not None and number.confidence >= SURE]
    assert [pair for pair in sure if pair[0] != pair[1]] == []
    assert len(sure) >= LEAST_NUMBERS


def test_scales_are_read_and_few_wrongly(pages):
    right, wrong = 0, 0
    for _, sheet, page in pages:
        declared = sheet.truth["scales"]["declared"]
        for name, read in captioned_scales(writing_on(page, closely=True), SCALE_NAMES).items():
            parsed = parse_scale(name, read.text)
            if read.confidence >= SURE:
                is_right = isinstance(parsed, Declared) and abs(parsed.per_mm / declared[name] - 1.0) < 1e-3
                right, wrong = right + is_right, wrong + (not is_right)
    assert right >= LEAST_SCALES
    assert wrong <= 1


def test_nothing_is_looked_for_that_the_roster_says(pages, monkeypatch):
    variant, sheet, page = pages[0]
    declared = {name: f"{value} m/mm" for name, value in sheet.truth["scales"]["declared"].items()}
    submission = StudentSubmission("m01", variant, (page.ref,), declared=declared)
    monkeypatch.setattr("grader.scan.page.spotters", None)
    assert not {*submission.undeclared} & {*PUMP.scale_names}
    (read,) = read_submission(submission, [page], PUMP, Asked())
    assert read.reading.written == {}
