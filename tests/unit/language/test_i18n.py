"""Numbers, units and texts in three languages."""

import pytest

from grader.language import LANGUAGES, UNITS, tongue
from reference.errors import CallError


@pytest.mark.parametrize(
    ("lang", "text"), [("en", "the velocity plan"), ("ro", "planul vitezelor"), ("ru", "план скоростей")]
)
def test_terms_of_the_field_are_those_of_the_language(lang, text):
    assert tongue(lang).gettext("the velocity plan") == text


@pytest.mark.parametrize(("lang", "text"), [("en", "0.50"), ("ro", "0,50"), ("ru", "0,50")])
def test_the_decimal_mark_is_that_of_the_language(lang, text):
    assert tongue(lang).number(0.5, 2) == text


def test_large_numbers_are_not_grouped():
    assert tongue("en").number(12345.6, 1) == "12345.6"


def test_there_is_no_minus_zero():
    assert tongue("ro").number(-0.001, 2) == "0,00"
    assert tongue("ro").trimmed(-0.001, 2) == "0"


def test_negative_numbers_have_a_minus_sign():
    assert tongue("ru").number(-1.5, 1) == "−1,5"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.036, "0.03600"), (1.2345678, "1.235"), (856.04, "856.0"), (12345.6, "12346"), (0.0, "0")],
)
def test_significant_digits_follow_the_size_of_the_number(value, text):
    assert tongue("en").significant(value, 4) == text


def test_units_have_the_letters_of_the_language():
    assert tongue("ru").quantity(1.5, 1, "m/s^2") == "1,5\u00a0м/с²"
    assert tongue("ro").quantity(1.5, 1, "m/s") == "1,5\u00a0m/s"


def test_every_unit_is_cyrillic_in_russian():
    assert [unit for unit in UNITS if tongue("ru").unit(unit).isascii()] == []


@pytest.mark.parametrize(
    ("lang", "forms"),
    [("ro", ["o lucrare", "2 lucrări", "20 de lucrări"]), ("ru", ["1 работа", "2 работы", "5 работ"])],
)
def test_plurals_have_the_forms_of_the_language(lang, forms):
    speaker = tongue(lang)
    counts = [1, 2, 20] if lang == "ro" else [1, 2, 5]
    found = [speaker.ngettext("%(num)d submission", "%(num)d submissions", n) % {"num": n} for n in counts]
    assert [text.split()[-1] for text in found] == [text.split()[-1] for text in forms]


def test_a_regional_code_is_its_language():
    assert tongue("ro-RO").lang == "ro"
    assert tongue("RU_ru").lang == "ru"


def test_an_unknown_language_is_refused_with_the_known_ones():
    with pytest.raises(CallError, match="en, ro, ru"):
        tongue("de")


def test_an_empty_text_is_not_the_catalogues_header():
    assert [tongue(lang).gettext("") for lang in LANGUAGES] == ["", "", ""]
