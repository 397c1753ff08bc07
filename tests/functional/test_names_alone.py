"""A class on plain paper with a roster of names alone: what stands on the sheets settles the rest."""

import csv
from dataclasses import replace

import pytest

from grader.folder.batch import Batch, graded
from grader.rubric import rubric_of
from grader.tables.scale_text import Declared, parse_scale
from reference.authored.assignment import Variant, load_assignment
from samples.simulation import CAREFUL, CLEAN_SCAN, PageStyle, Settings, simulate

pytestmark = pytest.mark.slow
STUDENTS = {"m01": ("Munteanu Elena", 7), "m02": ("Rotaru Ion", 12)}
FILES = {"m01": "m01", "m02": "scan"}
"""The second student's file does not say whose it is."""


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    folder = tmp_path_factory.mktemp("class")
    assignment = load_assignment("pump")
    page = PageStyle(language="ro", calculations=False, scales_written="title", letter_mm=4.5)
    settings = Settings(hand=CAREFUL, scan=replace(CLEAN_SCAN, dpi_tag=CLEAN_SCAN.dpi), page=page)
    for seed, (student, (name, n)) in enumerate(STUDENTS.items(), start=31):
        for sheet in simulate(assignment, Variant(n), seed, settings, student_id=name):
            sheet.save(folder / FILES[student])
    with (folder / "roster.csv").open("w", newline="", encoding="utf-8") as file:
        names = [[student, name] for student, (name, _) in STUDENTS.items()]
        csv.writer(file).writerows([["student_id", "name"], *names, ["m03", "Munteanu Ion"]])
    batch = Batch(assignment, rubric_of(assignment), folder, folder.parent / "out")
    return {report.student_id: report for report in graded(batch, lambda *_: None).results.reports}


def test_every_page_finds_its_student_by_its_file_or_by_the_name_on_it(reports):
    pages = {student: len(report.reading.sheets) for student, report in reports.items()}
    assert pages == {"m01": 1, "m02": 1, "m03": 0}


def test_the_number_on_the_sheet_counts_where_the_drawing_agrees(reports):
    for student, (_, n) in STUDENTS.items():
        assert reports[student].variant == {"n": n}
        assert [one.code for one in reports[student].problems if one.code.startswith("number")] == [
            "number_read"
        ]


def test_scales_on_the_sheet_are_the_declared_ones(reports):
    read = 0
    for student in STUDENTS:
        for name, scale in reports[student].scales.items():
            if scale.source is not None:
                assert scale.source == "box"
                parsed = parse_scale(name, scale.text or "")
                assert isinstance(parsed, Declared)
                assert scale.used == pytest.approx(parsed.per_mm)
                read += 1
    assert read >= 3


def test_who_handed_nothing_in_is_missing(reports):
    assert reports["m03"].status == "missing"
