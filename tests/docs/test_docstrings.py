"""Docstrings begin with a statement: what a function returns or does, not a question word."""

import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("grader", "reference", "samples", "tests", "docs")
QUESTION = re.compile(r'^ *r?"""(What|Where|When|Who|Whose|Of|How|Why|Whether|Which|That)\b', re.MULTILINE)


def test_docstrings_begin_with_a_statement():
    found: Counter[str] = Counter()
    for room in ROOMS:
        for path in (ROOT / room).rglob("*.py"):
            name = path.relative_to(ROOT).as_posix()
            found[name] += len(QUESTION.findall(path.read_text(encoding="utf-8")))
    assert not +found
