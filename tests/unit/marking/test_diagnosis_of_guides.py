"""Mistakes where a block slides on a turning link: found, and told in the words of such a link."""

import pytest

from grader.comparison.evidence import Submission
from grader.feedback.mistakes import words_of
from grader.feedback.sentences import criterion_feedback, mistake_feedback
from grader.feedback.student_page import feedback_page
from grader.marking.mark import judge
from grader.marking.report import report_of
from reference.construction.mistakes import Drawing, Mistake, single_mistakes
from tests.hands import measured, sheet, task_for

SHAPER = task_for("shaper", 7)
CORIOLIS = [
    Mistake("normal_missing", "k_A3A"),
    Mistake("normal_reversed", "k_A3A"),
    Mistake("arithmetic", "k_A3A", factor=0.5),
]


def found(mistake, seen):
    if seen == "sheet":
        return judge(SHAPER, Submission(readings=(sheet(SHAPER, mistakes=(mistake,)),)))
    return judge(SHAPER, Submission(measured=measured(SHAPER, mistakes=(mistake,))))


@pytest.mark.parametrize("seen", ["sheet", "measured"])
@pytest.mark.parametrize(
    "mistake",
    [
        *CORIOLIS,
        Mistake("normal_missing", "n_A3"),
        Mistake("parallel_for_perpendicular", "e", 0),
        Mistake("wrong_link", "a3'", 0, other=("D", "E")),
        Mistake("wrong_link", "a3", 1, other=("D", "E")),
        Mistake("wrong_intersection", "a3'", 1, other=("a'",)),
    ],
    ids=lambda one: f"{one.code} at {one.at}" if isinstance(one, Mistake) else one,
)
def test_a_mistake_at_a_slotted_link_is_found_where_it_was_made(mistake, seen):
    assert [(one.code, one.at) for one in found(mistake, seen).mistakes] == [(mistake.code, mistake.at)]


@pytest.mark.parametrize("lang", ["en", "ro", "ru"])
@pytest.mark.parametrize("mistake", CORIOLIS, ids=lambda one: one.code)
def test_a_mistake_in_the_coriolis_component_is_told_as_that(mistake, lang):
    judgement = found(mistake, "sheet")
    word = {"en": "Coriolis", "ro": "Coriolis", "ru": "Кориолиса"}[lang]
    assert word in mistake_feedback(judgement.mistakes[0], lang)
    lost = next(one for one in judgement.outcomes if one.criterion == "a_A3A_c")
    assert word in criterion_feedback(lost, lang)
    report = report_of(SHAPER, judgement, "s01", language=lang)
    assert report.mistakes[0].at == "k_A3A"
    assert word in feedback_page(report, (), lang)


def test_a_line_along_a_guide_is_told_apart_from_one_across_a_link():
    along = found(Mistake("wrong_link", "a3", 1, other=("D", "E")), "sheet").mistakes[0]
    across = found(Mistake("wrong_link", "a3", 0, other=("D", "E")), "sheet").mistakes[0]
    assert along.detail["line"] == "guide"
    assert "instead of along the guide" in mistake_feedback(along, "en")
    assert "line" not in across.detail
    assert "perpendicular to DE instead of to O2A3" in mistake_feedback(across, "en")


def test_no_mistake_is_offered_that_changes_nothing():
    drawing = Drawing(SHAPER.construction, SHAPER.parameters)
    offered = [one for figure in SHAPER.construction.figures for one in single_mistakes(drawing, figure)]
    assert not [one for one in offered if one.code == "image_mirrored"]
    assert not [one for one in offered if one.at == "a3" and one.slot == 1 and set(one.other) == {"O2", "A3"}]
    assert not [one for one in offered if set(one.other) == {"A", "A3"}]


@pytest.mark.parametrize(
    ("factor", "told"), [(0.5, "is half of"), (2.0, "does not follow"), (0.7, "does not follow")]
)
def test_a_coriolis_component_is_called_half_only_where_it_is(factor, told):
    slip = Mistake("arithmetic", "k_A3A", factor=factor)
    (named,) = found(slip, "measured").mistakes
    assert told in mistake_feedback(named, "en")


def test_words_are_those_of_the_code_but_at_guides():
    assert words_of("normal_missing", "n_A3").title == "normal component left out"
    assert words_of("normal_missing", "k_A3A").title == "Coriolis component left out"
    assert (
        words_of("parallel_for_perpendicular", line="guide").title
        == "perpendicular instead of along the guide"
    )
