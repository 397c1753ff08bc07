"""Reasons and mistakes as sentences."""

import re
from dataclasses import replace

import pytest

from grader import outcomes
from grader.documents import Quantity, Tolerance
from grader.feedback.mistakes import MISTAKES
from grader.feedback.sentences import criterion_feedback, mistake_feedback
from grader.language import LANGUAGES, tongue
from grader.outcomes import NamedMistake, Outcome
from grader.records import Reason
from grader.solution.sentences import wording_of
from grader.texts.reasons import FULL, HINTS, reason_sentence
from grader.texts.spoken import place
from reference.authored.assignment import load_assignment
from reference.construction.mistakes import CODES, Mistake

TOO_LONG = Reason("too_long", {"measured_mm": 49.5, "expected_mm": 47.2, "off_mm": 2.3, "tolerance_mm": 1.0})
VALUE = Reason(
    "value_too_large", {"measured": 1.91, "expected": 1.67, "off": 0.24, "tolerance": 0.03, "unit": "m/s"}
)


def outcome(verdict, *reasons, mistake=None):
    return Outcome(
        "v_B", "v_B", verdict, Quantity(), Quantity(), Tolerance(), 0.99, reasons, (verdict, verdict), mistake
    )


def documented_codes():
    text = outcomes.__doc__.split("said when")[1].rsplit("=====", 1)[0]
    codes = set()
    for row in text.splitlines():
        codes |= set(re.findall(r"[a-z_]+", row[:22]))
    return {code for code in codes if code}


def test_every_reason_that_judging_may_give_has_a_sentence():
    assert documented_codes() >= {"right", "too_long", "turned_right", "follows", "scale_assumed"}
    assert documented_codes() - set(HINTS) == set()
    assert set(FULL) <= set(HINTS)


def test_every_mistake_of_the_contract_has_words():
    assert set(MISTAKES) == set(CODES)


@pytest.mark.parametrize(
    ("lang", "text"),
    [
        ("en", "It is too long by 2.3\u00a0mm (tolerance ±1.0\u00a0mm)."),
        ("ro", "Segmentul este prea lung cu 2,3\u00a0mm (toleranță ±1,0\u00a0mm)."),
        ("ru", "Отрезок длиннее, чем нужно, на 2,3\u00a0мм (допуск ±1,0\u00a0мм)."),
    ],
)
def test_a_length_off_is_told_in_the_language_with_its_decimal_mark(lang, text):
    assert criterion_feedback(outcome("none", TOO_LONG), lang) == text


@pytest.mark.parametrize("lang", LANGUAGES)
@pytest.mark.parametrize("code", sorted(HINTS))
def test_hints_say_no_number(lang, code):
    params = {
        "measured_mm": 49.5, "expected_mm": 47.2, "off_mm": 2.3, "tolerance_mm": 1.0, "off_deg": 3.3,
        "measured": 1.91, "expected": 1.67, "off": 0.24, "tolerance": 0.03, "unit": "m/s", "se": 0.4,
        "confidence": 0.62, "first": 47.0, "second": 49.0, "used": 0.2, "declared": 0.3, "what": "nodes",
        "length_mm": 2.0, "least_mm": 3.0, "text": "1:5?", "why": "9", "reason": "8", "of": "v_A",
    }  # fmt: skip
    assert not re.search(r"\d", reason_sentence(Reason(code, params), tongue(lang), "hint"))


def test_the_symbol_level_says_nothing():
    assert criterion_feedback(outcome("none", TOO_LONG), "en", "symbol") == ""
    assert mistake_feedback(NamedMistake(Mistake("arithmetic", "v_B"), (), 0.9), "en", "symbol") == ""


def test_a_wrong_value_is_told_with_what_is_right_only_in_full():
    assert "1.670\u00a0m/s" in criterion_feedback(outcome("none", VALUE), "en")
    assert criterion_feedback(outcome("none", VALUE), "en", "hint") == "The value is too large."


def test_a_partial_verdict_says_so_and_what_is_off_but_not_that_it_is_right():
    text = criterion_feedback(outcome("partial", Reason("right"), TOO_LONG), "en")
    assert text.startswith("It is too long by")
    assert "Right." not in text


def test_of_a_zero_vector_no_direction_is_spoken_of():
    zero = Reason("should_be_zero", {"measured_mm": 4.0, "tolerance_mm": 1.0})
    short = Reason("too_short_to_judge", {"length_mm": 0.0, "least_mm": 3.0})
    assert "direction" not in criterion_feedback(outcome("none", zero, short), "en")


def test_what_waits_for_a_person_says_why():
    doubt = Reason("doubtful", {"confidence": 0.62})
    lost = outcome("review", doubt)
    told = criterion_feedback(replace(lost, probability=0.5), "en")
    assert told == "It was read with a certainty of 62\u00a0%: too little to decide without a person."
    assert "too little to take points away without a person" in criterion_feedback(lost, "en")


@pytest.mark.parametrize(("confidence", "told"), [(0.8, "It was probably misread"), (1.0, "These vectors")])
def test_only_what_was_read_is_called_misread(confidence, told):
    unexplained = Reason("not_explained", {"unfit": "2", "of": "24"})
    waiting = replace(outcome("review", unexplained, TOO_LONG), proposed=1.0, confidence=confidence)
    assert criterion_feedback(waiting, "en").startswith(told)


@pytest.mark.parametrize(
    ("known", "told"),
    [
        ({"why": "no_stroke", "start": "o'", "end": "b'"}, "nu s-a distins nicio linie între o' și b'"),
        ({"why": "no_velocity_plan"}, "nu s-a găsit planul vitezelor"),
        ({"why": "by_similarity", "node": "c"}, "c a fost găsit prin asemănare"),
        (
            {"why": "scale_vector_unsure", "vector": "v_A"},
            "v_A, care o arată, nu a fost citit cu certitudine",
        ),
    ],
)
def test_why_something_was_not_read_is_told_in_the_language(known, told):
    assert told in reason_sentence(Reason("unread", known), tongue("ro"), "full")


def test_of_several_limits_that_are_near_one_is_told():
    near = [
        Reason("near_limit", {"what": "length", "off": 1.0, "tolerance": 1.0, "se": se}) for se in (0.2, 0.3)
    ]
    told = criterion_feedback(outcome("review", *near), "en")
    assert told.count("too close to the limit") == 1
    assert "0.20" in told


def test_a_doubt_about_an_undeclared_scale_is_told_as_one():
    reasons = (
        Reason("scale_assumed", {"used": 0.036, "unit": "m/s"}),
        Reason("follows", {"what": "scale"}),
        TOO_LONG,
    )
    told = criterion_feedback(outcome("review", *reasons), "en")
    assert told.startswith("No scale was declared")
    assert "too long" not in told


def test_what_is_not_required_is_not_called_missing_too():
    told = criterion_feedback(outcome("not_judged", Reason("optional"), Reason("not_measured")), "en")
    assert told == "It was not handed in, and is not required."


def test_what_was_read_is_not_called_unread():
    unread = Reason("unread", {"why": "upstream_unsure", "nodes": ("n_BA",)})
    doubtful = Reason("doubtful", {"confidence": 0.4})
    read = replace(
        outcome("review", doubtful, unread), measured=Quantity(length_mm=48.1, direction_deg=255.0)
    )
    told = "It was read with too little certainty (n_BA, on which it depends, was not read for certain)."
    assert criterion_feedback(read, "en") == told
    assert criterion_feedback(read, "en", "hint") == "It was read with too little certainty."
    assert criterion_feedback(outcome("review", unread), "en").startswith("It could not be read")


def test_where_there_is_a_verdict_no_doubt_is_told():
    near = Reason("near_limit", {"what": "direction", "off": 3.2, "tolerance": 1.5, "se": 0.2})
    assert criterion_feedback(outcome("none", TOO_LONG, near), "en") == criterion_feedback(
        outcome("none", TOO_LONG), "en"
    )


def test_what_was_hardly_read_is_not_called_near_a_limit():
    near = Reason("near_limit", {"what": "length", "off": 5.1, "tolerance": 1.2, "se": 3.6})
    told = criterion_feedback(
        outcome("review", Reason("doubtful", {"confidence": 0.07}), TOO_LONG, near), "en"
    )
    assert "close to the limit" not in told


def test_what_is_not_judged_says_why_also_without_a_reason():
    assert criterion_feedback(outcome("not_judged"), "en") == "There is no drawing to compare it with."


def test_what_follows_rightly_is_not_called_off():
    told = criterion_feedback(outcome("follow_through", TOO_LONG, Reason("follows", {"what": "nodes"})), "en")
    assert "too long" not in told


def test_the_likely_cause_is_named_where_points_are_lost():
    told = criterion_feedback(outcome("none", TOO_LONG, mistake="normal_reversed"), "en")
    assert told.endswith("Likely cause: normal component reversed.")


@pytest.mark.parametrize("what", ["nodes", "scale", "vector", "value", "something new"])
def test_following_from_an_earlier_value_says_that_it_is_charged_once(what):
    told = criterion_feedback(outcome("follow_through", Reason("follows", {"what": what, "of": "v_A"})), "en")
    assert "costs points only once" in told


def test_a_reason_without_a_sentence_is_told_by_its_code():
    assert reason_sentence(Reason("brand_new"), tongue("ro"), "full") == "brand_new"


def test_a_reason_without_its_numbers_falls_back_to_the_hint():
    assert reason_sentence(Reason("too_long"), tongue("en"), "full") == "It is too long."


def test_a_limit_of_direction_is_told_in_degrees():
    near = Reason("near_limit", {"what": "direction", "off": 1.4, "tolerance": 1.5, "se": 0.25})
    assert "0.25°" in reason_sentence(near, tongue("en"), "full")


@pytest.mark.parametrize("lang", LANGUAGES)
@pytest.mark.parametrize("code", sorted(MISTAKES))
def test_every_mistake_says_what_was_done_and_what_to_redo(lang, code):
    told = mistake_feedback(NamedMistake(Mistake(code, "velocity_plan"), (), 0.9), lang)
    assert len(told) > 40
    assert "%(" not in told
    assert "velocity_plan" not in told


@pytest.mark.parametrize(
    ("at", "word"),
    [("F_i3", "acceleration"), ("F_D", "the task"), ("R_43", "another group"), ("R_13_n", "closed")],
)
def test_a_reversed_force_is_told_what_sets_its_own_sense(at, word):
    told = mistake_feedback(NamedMistake(Mistake("force_reversed", at), (), 0.9), "en")
    assert word in told
    assert ("R_34" in told) == (at == "R_43")


def test_names_are_those_that_the_students_know():
    told = mistake_feedback(NamedMistake(Mistake("scale_wrong", "kv"), (), 0.9), "ru", names={"kv": "μv"})
    assert "μv" in told
    assert "kv" not in told


@pytest.mark.parametrize("lang", LANGUAGES)
def test_force_plans_are_called_as_in_the_steps(lang):
    names, titles = load_assignment("pump-forces").names, wording_of(tongue(lang)).titles
    for figure, key in (("force_plan_A", "driving_force_plan"), ("force_plan_B", "force_plan")):
        title = titles[key].replace("{group}", "B")
        assert place(figure, tongue(lang), names).lower().endswith(title.lower())


def test_a_students_text_with_a_per_cent_sign_does_no_harm():
    refused = Reason("scale_refused", {"text": "50%(x)s", "why": "beside_equals", "examples": ("1:5",)})
    assert "50%(x)s" in reason_sentence(refused, tongue("en"), "full")
