"""Captions and title blocks of simulated plain sheets: what is read at least, and next to nothing wrongly."""

import pytest

from grader.pipeline import missing_scales, read_submission
from grader.records import PageRef
from grader.rubric import Asked
from grader.scan.handwriting.captions import NUMBER_WORDS, captioned_scales, written_number
from grader.scan.page import open_page, writing_on
from grader.tables.measurements import StudentSubmission
from grader.tables.scale_text import SURE, Declared, parse_scale
from reference.authored.assignment import SCALE_NAMES, load_assignment
from tests.bench.captions import plain_class

pytestmark = pytest.mark.slow
STUDENTS, FIRST = 4, 41
LEAST_NUMBERS, LEAST_SCALES = 2, 2
"""Read surely and rightly on these students' sheets at least."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    pages = []
    for student in plain_class("pump", STUDENTS, FIRST):
        for number, sheet in enumerate(student.sheets):
            path = sheet.save(folder / f"{student.student_id}_{number}")
            pages.append((student, sheet, open_page(PageRef(path.name, path=path))))
    return pages


def test_numbers_are_read_and_none_wrongly(pages):
    read = [
        (written_number(writing_on(page, closely=True), range(1, 31), NUMBER_WORDS), student.variant.n)
        for student, _, page in pages
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
    student, sheet, page = pages[0]
    declared = {name: f"{value} m/mm" for name, value in sheet.truth["scales"]["declared"].items()}
    submission = StudentSubmission("m01", student.variant, (page.ref,), declared=declared)
    monkeypatch.setattr("grader.pipeline.spotters", None)
    assert missing_scales(submission) == ()
    (read,) = read_submission(submission, [page], load_assignment("pump"), Asked())
    assert read.reading.written == {}
