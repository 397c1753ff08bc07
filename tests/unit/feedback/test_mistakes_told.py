"""Mistakes with where and by which link, and what else it may be."""

import re

import pytest

from grader.feedback.mistakes import PRECISE, PRECISE_ALONG_GUIDE
from grader.feedback.sentences import mistake_feedback
from grader.i18n import LANGUAGES
from grader.outcomes import Mistake

WRONG_LINK = Mistake("wrong_link", "d'", ("a_D",), 0.9, {"from": "n_DC", "link": "CD", "other": "O2B"})


def test_a_line_by_the_wrong_link_is_told_with_both_links():
    told = mistake_feedback(WRONG_LINK, "en")
    assert told.startswith("The line from n_DC to d' was drawn perpendicular to O2B instead of to CD.")


@pytest.mark.parametrize(("lang", "either"), [("en", " or: "), ("ro", " sau: "), ("ru", " или: ")])
def test_rivals_follow_after_an_or(lang, either):
    rival = Mistake("normal_missing", "n_DC", (), 0.3)
    both = Mistake("wrong_link", "d'", ("a_D",), 0.6, WRONG_LINK.detail, (rival,))
    told = mistake_feedback(both, lang)
    assert told.count(either) == 1
    assert told.endswith(mistake_feedback(rival, lang))


def test_two_rivals_that_are_told_alike_are_told_once():
    rival = Mistake("normal_missing", "n_DC", (), 0.3)
    both = Mistake("wrong_link", "d'", ("a_D",), 0.5, WRONG_LINK.detail, (rival, rival))
    assert mistake_feedback(both, "en").count(" or: ") == 1


def test_a_mistake_without_its_details_is_told_more_roughly():
    assert "its own" in mistake_feedback(Mistake("wrong_link", "d'", ("a_D",), 0.9), "en")


def test_a_line_along_a_guide_is_told_as_such():
    detail = {"from": "o", "line": "guide"}
    told = mistake_feedback(Mistake("parallel_for_perpendicular", "d", (), 0.9, detail), "en")
    assert told.startswith("The line from o to d was drawn perpendicular to the guide instead of along it.")


@pytest.mark.parametrize("lang", LANGUAGES)
def test_factors_and_other_numbers_are_for_those_who_may_see_answers(lang):
    told = Mistake("scale_wrong", "kv", (), 0.9, {"factor": 0.318})
    assert re.search(r"0[.,]318", mistake_feedback(told, lang))
    assert not re.search(r"\d", mistake_feedback(told, lang, "hint"))


def test_other_positions_and_numbers_are_told_apart():
    assert "number 20" in mistake_feedback(Mistake("other_variant", "mechanism", (), 0.9, {"n": 20}), "en")
    other = Mistake("other_variant", "mechanism", (), 0.9, {"position": 3})
    assert "position 3" in mistake_feedback(other, "en")


@pytest.mark.parametrize(("at", "vector"), [("a", "v_A"), ("a'", "a_A")])
def test_a_reversed_vector_is_named(at, vector):
    assert f"The vector {vector} was" in mistake_feedback(Mistake("sense_reversed", at, (), 0.9), "en")


@pytest.mark.parametrize("lang", LANGUAGES)
def test_every_precise_text_is_filled_in_every_language(lang):
    detail = {
        "from": "n_DC", "link": "CD", "other": "O2B", "factor": 2.0, "first": "b", "second": "c",
        "degrees": 90.0, "n": 3, "position": 1,
    }  # fmt: skip
    for codes, extra in ((PRECISE, {}), (PRECISE_ALONG_GUIDE, {"line": "guide"})):
        for code in codes:
            told = mistake_feedback(Mistake(code, "n_DC", (), 0.9, {**detail, **extra}), lang)
            assert "%(" not in told
            assert len(told) > 40
