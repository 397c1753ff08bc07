"""Mistakes with where and by which link, and what else it may be."""

import re

import pytest

from grader.comparison.evidence import Submission
from grader.feedback.mistakes import PRECISE, PRECISE_ALONG_GUIDE
from grader.feedback.redo_steps import with_mistakes_explained
from grader.feedback.sentences import mistake_feedback, question
from grader.language import LANGUAGES, tongue
from grader.marking.mark import judge
from grader.marking.report import report_of
from grader.outcomes import NamedMistake
from reference.authored.assignment import load_assignment
from reference.construction.mistakes import CODES, Mistake
from tests.hands import measured, task_for

BY_O2B = Mistake("wrong_link", "d'", other=("O2", "B"))
LINE = {"from": "n_DC", "link": "CD"}
WRONG_LINK = NamedMistake(BY_O2B, ("a_D",), 0.9, LINE)
RIVAL = NamedMistake(Mistake("normal_missing", "n_DC"), (), 0.3)


def named(code, at, line=None, **details):
    """A mistake as it is told, with these details."""
    return NamedMistake(Mistake(code, at, **details), (), 0.9, line or {})


def test_a_line_by_the_wrong_link_is_told_with_both_links():
    told = mistake_feedback(WRONG_LINK, "en")
    assert told.startswith("The line from n_DC to d' was drawn perpendicular to O2B instead of to CD.")


@pytest.mark.parametrize(("lang", "either"), [("en", " or: "), ("ro", " sau: "), ("ru", " или: ")])
def test_rivals_follow_after_an_or(lang, either):
    both = NamedMistake(BY_O2B, ("a_D",), 0.6, LINE, (RIVAL,))
    told = mistake_feedback(both, lang)
    assert told.count(either) == 1
    assert either + mistake_feedback(RIVAL, lang) in told


@pytest.mark.parametrize("lang", LANGUAGES)
def test_rivals_are_told_with_their_odds_and_the_question_that_tells_them_apart(lang):
    both = NamedMistake(BY_O2B, ("a_D",), 0.6, LINE, (RIVAL,))
    told = mistake_feedback(both, lang)
    assert told.index("60\N{NO-BREAK SPACE}%") < told.index("30\N{NO-BREAK SPACE}%")
    assert told.endswith(question(both, tongue(lang)))
    assert told.endswith("?")
    assert "%" not in mistake_feedback(WRONG_LINK, lang)


@pytest.mark.parametrize("lang", LANGUAGES)
@pytest.mark.parametrize("code", CODES)
def test_every_mistake_has_its_question(code, lang):
    asked = question(named(code, "n_DC"), tongue(lang))
    assert asked.endswith("?")
    assert "%(" not in asked


def test_two_rivals_that_are_told_alike_are_told_once():
    both = NamedMistake(BY_O2B, ("a_D",), 0.5, LINE, (RIVAL, RIVAL))
    assert mistake_feedback(both, "en").count(" or: ") == 1


def test_a_mistake_without_its_details_is_told_more_roughly():
    assert "its own" in mistake_feedback(named("wrong_link", "d'"), "en")


def test_a_line_along_a_guide_is_told_as_such():
    told = mistake_feedback(named("parallel_for_perpendicular", "d", {"from": "o", "line": "guide"}), "en")
    assert told.startswith("The line from o to d was drawn perpendicular to the guide instead of along it.")


@pytest.mark.parametrize("lang", LANGUAGES)
def test_factors_and_other_numbers_are_for_those_who_may_see_answers(lang):
    told = named("scale_wrong", "kv", factor=0.318)
    assert re.search(r"0[.,]318", mistake_feedback(told, lang))
    assert not re.search(r"\d", mistake_feedback(told, lang, "hint"))


def test_other_positions_and_numbers_are_told_apart():
    assert "number 20" in mistake_feedback(named("other_variant", "mechanism", n=20), "en")
    other = named("other_variant", "mechanism", position=3)
    assert "position 3" in mistake_feedback(other, "en")


@pytest.mark.parametrize(("at", "vector"), [("a", "v_A"), ("a'", "a_A")])
def test_a_reversed_vector_is_named(at, vector):
    assert f"The vector {vector} was" in mistake_feedback(named("sense_reversed", at), "en")


@pytest.mark.parametrize(("at", "line", "words"), [
    ("a", "driving across", "along the link instead of perpendicular"),
    ("a'", "driving along", "perpendicular to the link instead of along"),
    ("a", "driven across", "along the link instead of perpendicular"),  # as in results of earlier versions
    ("a'", "driven along", "perpendicular to the link instead of along"),
])  # fmt: skip
def test_the_driving_links_vector_is_told_as_it_should_lie(at, line, words):
    assert words in mistake_feedback(named("parallel_for_perpendicular", at, {"line": line}), "en")


def test_a_point_on_another_vectors_line_is_told_with_that_vector():
    told = mistake_feedback(named("wrong_intersection", "d'", LINE, other=("a_BA_n",)), "en")
    assert told.startswith("d' was taken on the line of a_BA_n instead of on its own line from n_DC.")


@pytest.mark.parametrize("lang", LANGUAGES)
def test_every_precise_text_is_filled_in_every_language(lang):
    for codes, guide in ((PRECISE, {}), (PRECISE_ALONG_GUIDE, {"line": "guide"})):
        for code in codes:
            other = ("b", "c") if code == "labels_swapped" else ("O2", "B")
            details = {"other": other, "factor": 2.0, "quarters": 1, "n": 3, "position": 1}
            told = mistake_feedback(named(code, "n_DC", {**LINE, **guide}, **details), lang)
            assert "%(" not in told
            assert len(told) > 40


@pytest.mark.parametrize(("name", "n", "position"), [("pump", 7, None), ("press", None, 1)])
@pytest.mark.parametrize("level", ["hint", "full"])
def test_a_reversed_normal_names_the_half_turn_where_the_right_triangle_holds(name, n, position, level):
    """It holds for the pump; for the press kL ka is 0.556 kv^2."""
    task = task_for(name, n, position)
    reading = measured(task, directions=True, mistakes=(Mistake("normal_reversed", "n_DC"),))
    judgement = judge(task, Submission(measured=reading))
    report = report_of(task, judgement, "s01", language="en", sentences={})
    explained = with_mistakes_explained(report, judgement, load_assignment(name), task.variant, "en", level)
    (mistake,) = explained.mistakes
    assert mistake.code == "normal_reversed"
    assert ("the half turn about D is missing" in mistake.feedback) == (name == "pump")


@pytest.mark.parametrize("lang", LANGUAGES)
@pytest.mark.parametrize("level", ["hint", "full"])
def test_a_normal_by_the_right_triangle_is_told_with_the_ratio_of_the_scales(lang, level):
    task = task_for("press", None, 1)
    reading = measured(task, mistakes=(Mistake("arithmetic", "n_B", other=("right_triangle",)),))
    judgement = judge(task, Submission(measured=reading))
    report = report_of(task, judgement, "s01", language=lang, sentences={})
    explained = with_mistakes_explained(
        report, judgement, load_assignment("press"), task.variant, lang, level
    )
    (mistake,) = explained.mistakes
    assert "kL·ka = kv²" in mistake.feedback
    assert "a_B_n" in mistake.feedback
    assert (tongue(lang).number(0.556, 3) in mistake.feedback) == (level == "full")
