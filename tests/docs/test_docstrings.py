"""Docstrings begin with a statement: what a function returns or does, not a question word."""

import re
from collections import Counter

from docs import make_architecture as architecture

QUESTION = re.compile(r'^ *r?"""(What|Where|When|Who|Whose|Of|How|Why|Whether|Which|That)\b', re.MULTILINE)


def test_docstrings_begin_with_a_statement():
    found: Counter[str] = Counter()
    for path in architecture.modules().values():
        found[architecture.room_of(path)] += len(QUESTION.findall(path.read_text(encoding="utf-8")))
    assert not +found
