"""Catalogues: complete, compiled, and with the same placeholders as the English texts."""

import re
from pathlib import Path

import pytest
from babel.messages.catalog import Catalog
from babel.messages.extract import extract_from_dir
from babel.messages.frontend import parse_mapping_cfg
from babel.messages.mofile import read_mo
from babel.messages.pofile import read_po

LOCALE = Path(__file__).parents[3] / "grader" / "locale"
PROJECT = LOCALE.parents[1]
PLACEHOLDER = re.compile(r"%\(\w+\)[sd]|\{\w+\}")
TRANSLATED = ("ro", "ru")


def catalogue(lang):
    with (LOCALE / lang / "LC_MESSAGES" / "planmark.po").open("rb") as file:
        return read_po(file, locale=lang, abort_invalid=True)


@pytest.fixture(scope="module")
def in_the_code():
    with (LOCALE / "babel.cfg").open(encoding="utf-8") as file:
        methods, options = parse_mapping_cfg(file)
    keywords = {"_": None, "gettext": None, "ngettext": (1, 2), "N_": None}
    catalogue = Catalog()
    for _file, _line, message, _comments, _context in extract_from_dir(
        str(PROJECT / "grader"), [(pattern.removeprefix("grader/"), how) for pattern, how in methods],
        {pattern.removeprefix("grader/"): how for pattern, how in options.items()}, keywords,
    ):  # fmt: skip
        catalogue.add(message)
    found = {message.id for message in catalogue if message.id}
    assert len(found) > 100, "extraction found hardly anything"
    return found


@pytest.mark.parametrize("lang", TRANSLATED)
def test_every_text_in_the_code_is_translated(lang, in_the_code):
    known = {message.id: message.string for message in catalogue(lang)}
    untranslated = [
        text for text in in_the_code
        if not known.get(text) or (isinstance(known[text], tuple) and not all(known[text]))
    ]  # fmt: skip
    assert untranslated == []


@pytest.mark.parametrize("lang", TRANSLATED)
def test_no_translation_is_left_over_or_uncertain(lang, in_the_code):
    found = catalogue(lang)
    assert not found.obsolete
    assert [message.id for message in found if message.id and message.fuzzy] == []
    assert {message.id for message in found if message.id} - in_the_code == set()


@pytest.mark.parametrize("lang", TRANSLATED)
def test_translations_keep_the_placeholders(lang):
    for message in catalogue(lang):
        if not message.id:
            continue
        wanted = set(PLACEHOLDER.findall(str(message.id)))
        forms = message.string if isinstance(message.string, tuple) else (message.string,)
        for form in forms:
            assert set(PLACEHOLDER.findall(form)) == wanted, message.id


@pytest.mark.parametrize("lang", TRANSLATED)
def test_the_compiled_catalogue_is_that_of_the_source(lang):
    with (LOCALE / lang / "LC_MESSAGES" / "planmark.mo").open("rb") as file:
        compiled = {as_key(message.id): as_key(message.string) for message in read_mo(file) if message.id}
    source = {as_key(message.id): as_key(message.string) for message in catalogue(lang) if message.id}
    assert compiled == source


def as_key(text):
    return text if isinstance(text, str) else tuple(text)


@pytest.mark.parametrize("lang", TRANSLATED)
def test_sentences_end_as_the_english_ones_do(lang):
    for message in catalogue(lang):
        if isinstance(message.id, str) and message.id.endswith((".", "?", ":")):
            assert message.string.endswith(message.id[-1]), message.id
