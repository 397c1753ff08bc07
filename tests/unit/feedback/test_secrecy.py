"""Things that a student may not see yet are nowhere: not in the page, the picture, or its description."""

import re

import numpy as np
import pytest

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.feedback.numbers import quantity_cells
from grader.feedback.redo_steps import with_mistakes_explained
from grader.feedback.sentences import criterion_feedback
from grader.feedback.student_page import About, StudentPage, feedback_page
from grader.language import LANGUAGES, tongue
from grader.marking.mark import judge
from grader.marking.report import report_of
from grader.overlay.measured import measured_picture
from grader.records import Figure, Reading, ReadVector
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment

PUMP = load_assignment("pump")
VARIANT = PUMP.variant(12)
OFF = 1.137
"""Every length is off by this factor, so that none is right by chance,"""
TURNED_DEG = 7.3
"""and every direction by this angle."""


def handed_in():
    """All vectors off; so are computed values."""
    task = task_of(PUMP, rubric_of(PUMP), VARIANT)
    scales = {name: float(np.ravel(task.parameters[name])[0]) for name in ("kL", "kv", "ka")}
    figures = {}
    for figure in task.construction.poles:
        vectors = {}
        for vector in task.construction.vectors_of(figure):
            drawn = task.segments[vector.name].drawn(scales)
            direction = float(np.degrees(np.angle(drawn))) + TURNED_DEG
            vectors[vector.name] = ReadVector(OFF * abs(drawn), 0.0, direction % 360.0, 0.0, 1.0)
        figures[figure] = Figure({}, vectors)
    values = {name: OFF * rate for name, rate in task.rates.items()}
    units = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s^2)/mm"}
    declared = {name: f"{OFF * OFF * scale:.6g} {units[name]}" for name, scale in scales.items()}
    return task, Submission(measured=Reading(figures), values=values, declared=declared)


@pytest.fixture(scope="module")
def judged():
    task, submission = handed_in()
    return task, submission, judge(task, submission)


def told(judged, level, lang="en"):
    task, submission, judgement = judged
    names = PUMP.file.names
    sentences = {one.criterion: criterion_feedback(one, lang, level, names) for one in judgement.outcomes}
    report = report_of(task, judgement, "s07", language=lang, sentences=sentences)
    report = with_mistakes_explained(report, judgement, PUMP, VARIANT, lang, level)
    outcomes = {one.name: one for one in judgement.outcomes}
    picture = measured_picture(
        "s07.json", submission.measured, task.construction, outcomes, show_expected=level == "full"
    )
    return StudentPage(report, (picture,), tongue(lang), level, About("Pump", "X", names))


def numbers(text):
    """Every number with a decimal mark: those without are indices and counts."""
    return {one.replace(",", ".") for one in re.findall(r"\d+[.,]\d+", text)}


def answers(judged):
    """The expected numbers as pages write them, those of the vectors that were handed in wrongly."""
    _task, _submission, judgement = judged
    speaker = tongue("en")
    found = set()
    for one in judgement.outcomes:
        expected, measured = one.expected, one.measured
        for right, own, write in (
            (expected.length_mm, measured.length_mm, lambda x: speaker.number(x, 1)),
            (expected.direction_deg, measured.direction_deg, lambda x: speaker.number(x, 1)),
            (expected.value, measured.value, lambda x: speaker.significant(abs(x), 4)),
        ):
            if right is not None and own is not None and write(right) != write(own):
                found.add(write(right))
    return {one for one in found if "." in one} - {"0.0"}


def html_of(page):
    return feedback_page(page.report, page.pictures, page.speaker.lang, page.level, page.about)


def shown(student_page):
    """All that can be read of a page, but for coordinates of what the student drew."""
    page = html_of(student_page)
    words = re.sub(r"(?s)<style>.*?</style>|<svg.*?</svg>", " ", page)
    words += " ".join(re.findall(r'aria-label="([^"]*)"|<title>([^<]*)', page)[0])
    words += " ".join(re.findall(r"<text[^>]*>(.*?)</text>", page))
    return re.sub(r"<[^>]*>", " ", words)


def test_the_full_level_shows_them(judged):
    # The test of the tests below: answers are found where they are.
    assert len(answers(judged)) > 20
    assert answers(judged) <= numbers(shown(told(judged, "full")))


@pytest.mark.parametrize("level", ["hint", "symbol"])
@pytest.mark.parametrize("lang", LANGUAGES)
def test_no_expected_number_is_told(judged, level, lang):
    found = numbers(shown(told(judged, level, lang))) & answers(judged)
    page = told(judged, level, "en")
    own = numbers(
        " ".join(" ".join(quantity_cells(row.measured, page.speaker)) for row in page.report.criteria)
    )
    assert found - own == set()


@pytest.mark.parametrize("level", ["hint", "symbol"])
def test_the_picture_shows_nothing_expected(judged, level):
    page = told(judged, level)
    assert told(judged, "full").pictures[0].scene.ghosts
    assert page.pictures[0].scene.ghosts == ()
    assert 'stroke-dasharray="0.3' not in html_of(page)


@pytest.mark.parametrize("level", ["hint", "symbol"])
def test_lengths_without_directions_are_not_drawn_along_the_right_ones(judged, level):
    task, submission, judgement = judged
    bare = {
        figure: Figure({}, {
            name: ReadVector(one.length_mm, 0.0, None, None, 1.0) for name, one in read.vectors.items()
        })
        for figure, read in submission.measured.figures.items()
    }  # fmt: skip
    outcomes = {one.name: one for one in judgement.outcomes}
    shows = level == "full"
    assert measured_picture("x", Reading(bare), task.construction, outcomes, show_expected=shows) is None
    seen = measured_picture("x", Reading(bare), task.construction, outcomes, show_expected=True)
    assert len(seen.scene.arrows) > 10


@pytest.mark.parametrize("level", ["hint", "symbol"])
def test_neither_tolerances_nor_scales_used_are_told_where_they_follow_from_the_answers(judged, level):
    page = told(judged, level)
    assert page.report.criteria
    assert all(page.tolerance(row) == page.expected(row) == [] for row in page.report.criteria)
    assert all(page.used(name) == "" for name in page.report.scales)


def test_hints_say_what_to_redo_without_a_number(judged):
    for action in told(judged, "hint").actions:
        assert numbers(" ".join((action.said, *action.redo))) == set()
