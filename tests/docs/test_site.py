"""The site of the documentation: every page is in its navigation, and nothing is loaded from elsewhere."""

import re
from pathlib import Path

from docs.make_sentences import ASSIGNMENTS, TOPICS

ROOT = Path(__file__).resolve().parent.parent.parent
SETTINGS = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
MADE = {"faults.md", f"{ASSIGNMENTS[0]}.md", *(f"{name}.md" for name in TOPICS)}
"""Pages that are made when the site is built."""


def test_every_page_is_in_the_navigation_once():
    named = re.findall(r"(?m)^ +- (?:.*: )?(\S+\.md)$", SETTINGS)
    pages = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert sorted(named) == sorted(pages | MADE)


def test_the_pages_load_nothing_from_elsewhere():
    pages = [*(ROOT / "docs").rglob("*.md"), *(ROOT / "docs" / "assets").glob("*.[cj]s*")]
    loaded = re.compile(r"!\[[^]]*\]\(https?:|<(?:img|script|link)\b|@import|url\(https?:")
    assert "https://" not in SETTINGS
    assert "font: false" in SETTINGS
    assert [page.name for page in pages if loaded.search(page.read_text(encoding="utf-8"))] == []


def test_pictures_of_the_pages_are_all_used():
    texts = [page.read_text(encoding="utf-8") for page in (ROOT / "docs").rglob("*.md")]
    shown = {name for text in texts for name in re.findall(r"pictures/([\w.-]+)", text)}
    assert shown == {path.name for path in (ROOT / "docs" / "pictures").iterdir()}
