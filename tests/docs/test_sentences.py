"""Every text that people read is on one of the pages of sentences, in all languages, with an example."""

import re

import pytest
from babel.messages.pofile import read_po

from docs import make_sentences as sentences
from grader.language import LANGUAGES, tongue

CATALOGUE = sentences.ROOT / "grader/locale/planmark.pot"


def messages():
    with CATALOGUE.open("rb") as file:
        return [message.id for message in read_po(file) if message.id]


def test_every_text_of_the_catalogues_is_on_it_in_every_language():
    rows = {row for group in sentences.texts().values() for row in group}
    for message in messages():
        assert tuple(sentences.in_language(tongue(lang), message) for lang in LANGUAGES) in rows


def test_every_parameter_has_an_example():
    named = {one for text in messages() for one in re.findall(r"%\((\w+)\)s", str(text))}
    assert named - set(sentences.EXAMPLES) == set()
    assert not re.search(r"%\(\w+\)|\{\w+\}", "".join(sentences.pages().values()))


@pytest.mark.parametrize(
    ("start", "lang", "told"),
    [
        ("It is too long by", "ro", "cu 2,3\u00a0mm (toleranță ±1,0\u00a0mm)"),
        ("All of %(at)s is turned by %(degrees)s", "ru", "(план скоростей)"),
    ],
)
def test_examples_are_in_the_letters_of_the_language(start, lang, told):
    text = next(message for message in messages() if str(message).startswith(start))
    assert told in sentences.in_language(tongue(lang), text)


def test_titles_of_built_in_files_are_in_every_language():
    assert [row for group in sentences.authored().values() for row in group if not all(row)] == []
