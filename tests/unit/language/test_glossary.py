"""Catalogues and built-in files use the terms of `docs/glossary.md`."""

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from babel.messages.pofile import read_po

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "glossary.md"
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.read_text(encoding="utf-8").splitlines()
    if line.startswith("|")
][2:]
COLUMN = {"ro": 1, "ru": 2}
NAMES = re.compile(
    r"%\(\w+\)s|--replace-guide|--what rubric|\"\w+\"|\[\w+\]|\{[^}]*\}|joints and coincident|needs link,"
)
"""Placeholders, options, and keys and values of files: no words of the language."""
OTHER_SENSES = {
    "link": r"personal links?|link to (?:a|choose)|no such link|this link is|slotted link|the link's pivot",
    "block": r"title block",
    "guide": r"marking guide|(?:a|this) guide|the guide there",
    "scale": r"graded by a scale",
    "pole": r"acceleration poles?",
    "rod": r"its rod's end",
}
"""The same English word for something else, or within another term of the table."""
OTHER_WAYS = {
    ("ru", "mechanism assembled the other way"),
    ("ru", "At %(at)s, the links were assembled in their other possible position."),
}
"""Sentences that say it by another term: a group, not its mechanism or links, is assembled."""
STEMS = {
    "угол": "уг[оа]?л",
    "камень": "кам(?:ен|н)",
    "поршень": "порш(?:ен|н)",
    "scară": "sc[aă]r",
    "placă": "pl[aă]c",
    "greșeală": "greșe",
}
"""Stems of words whose vowels change when they are declined."""


def in_english(term: str) -> re.Pattern[str]:
    words = [word.strip() for word in term.split(",")]
    forms = [
        f"{re.escape(word[:-1])}(?:y|ies)" if word[-1] == "y" else f"{re.escape(word)}s?" for word in words
    ]
    return re.compile(rf"(?<![\w-])(?:{'|'.join(forms)})(?![\w-])", re.IGNORECASE)


def has_a_form(text: str, terms: str) -> bool:
    """True if every longer word of one of the terms stands in the text, whatever its ending."""
    for term in terms.split(","):
        words = [word for word in term.split() if len(word) > 3] or term.split()
        stems = [STEMS.get(word, re.escape(word[: max(3, len(word) - 2)])) for word in words]
        if all(re.search(rf"(?<!\w){stem}", text, re.IGNORECASE) for stem in stems):
            return True
    return False


def authored(node: object, lang: str) -> Iterator[tuple[str, str]]:
    """Yield English texts of a TOML file, each with its translation."""
    if isinstance(node, dict):
        if "en" in node and lang in node:
            yield node["en"], node[lang]
        for part in node.values():
            yield from authored(part, lang)
    if isinstance(node, list):
        for part in node:
            yield from authored(part, lang)


@cache
def texts(lang: str) -> list[tuple[str, str]]:
    with (ROOT / "grader" / "locale" / lang / "LC_MESSAGES" / "planmark.po").open("rb") as file:
        found = [
            (one.id if isinstance(one.id, str) else one.id[0], form)
            for one in read_po(file, locale=lang)
            if one.id
            for form in ([one.string] if isinstance(one.string, str) else one.string)
        ]
    for path in sorted((ROOT / "rubrics").rglob("*.toml")):
        found += authored(tomllib.loads(path.read_text(encoding="utf-8")), lang)
    return found


@pytest.mark.parametrize("lang", COLUMN)
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_a_term_is_translated_by_the_words_of_the_glossary(row, lang):
    term = in_english(row[0])
    others = re.compile(OTHER_SENSES.get(row[0], "(?!)"), re.IGNORECASE)
    wrong = [
        (english, translated)
        for english, translated in texts(lang)
        if term.search(others.sub("", NAMES.sub("", english)))
        and (lang, english) not in OTHER_WAYS
        and not has_a_form(translated, row[COLUMN[lang]])
    ]
    assert wrong == []


@pytest.mark.parametrize(
    ("lang", "others"),
    [
        ("ro", "antiorar|pi[ae]tr|depune|[şţ]|sensul acelor"),
        ("ru", " [–-] |касательное ускорение|опор[аеуы]"),
    ],
)
def test_one_word_is_used_for_one_thing(lang, others):
    assert [text for _, text in texts(lang) if re.search(others, text, re.IGNORECASE)] == []


def test_every_term_has_its_words_in_three_languages_once():
    assert len(ROWS) > 50
    assert all(len(row) == 5 and all(row[:3]) for row in ROWS)
    assert len({row[0] for row in ROWS}) == len(ROWS)


def test_another_word_than_the_glossary_s_is_noticed():
    assert has_a_form("Viteza unghiulară a elementului 3", "viteză unghiulară")
    assert not has_a_form("Sunt rotite în sens antiorar", "sens trigonometric")
    assert not has_a_form("Угловая скорость тела 3", "звено")
