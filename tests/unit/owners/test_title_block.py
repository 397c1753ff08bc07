"""A page's owner and number are found by the texts on it and by the drawing."""

from pathlib import Path

import numpy as np
import pytest

from grader.owners.draft_roster import LIKE_MM
from grader.owners.pages import How, assign_pages
from grader.owners.title_block import chosen_variant, names_of
from grader.records import PageRef
from grader.tables.roster import Roster, RosterRow
from grader.texts.spoken import message
from reference.authored.assignment import Variant

VARIANTS = [Variant(n) for n in range(1, 6)]
CLEARLY = np.array([0.2, 0.3, 4.0, 0.5, 0.2]) * LIKE_MM
"""A drawing that looks like n = 3 and no other."""
NOTHING = np.zeros(5)


def chances(**known: float) -> list[float]:
    return [known.get(f"n{variant.n}", 0.0) for variant in VARIANTS]


@pytest.mark.parametrize(
    ("written", "similar", "n", "code"),
    [
        ({"n3": 0.95}, CLEARLY, 3, "number_read"),
        ({"n3": 0.3}, CLEARLY, 3, "number_read"),
        ({"n3": 0.3, "n2": 0.5}, CLEARLY, 3, "number_read"),
        ({"n3": 0.95}, NOTHING, 3, "number_read"),
        ({"n3": 0.6}, NOTHING, None, "number_doubtful"),
        ({"n2": 0.97}, CLEARLY, None, "number_contradicted"),
        ({"n2": 0.5}, CLEARLY, None, "number_contradicted"),
        ({"n3": 0.1}, CLEARLY, None, "number_doubtful"),
        ({}, CLEARLY, None, "number_doubtful"),
        ({}, NOTHING, None, "number_doubtful"),
    ],
)
def test_a_number_counts_where_writing_and_drawing_agree(written, similar, n, code):
    variant, problem = chosen_variant(VARIANTS, chances(**written), similar)
    assert (None if variant is None else variant.n, problem.code) == (n, code)


def test_a_contradiction_is_told_with_both_numbers():
    _, problem = chosen_variant(VARIANTS, chances(n2=0.97), CLEARLY)
    assert "n = 2" in message(problem)
    assert "n = 3" in message(problem)


def test_a_surely_read_number_may_have_a_neighbour_that_looks_a_little_more_alike():
    similar = np.array([0.0, 2.5, 4.0, 0.0, 0.0]) * LIKE_MM
    assert chosen_variant(VARIANTS, chances(n2=0.95), similar)[0] == Variant(2)
    assert chosen_variant(VARIANTS, chances(n2=0.5), similar)[0] is None


ROSTER = Roster("roster.csv", (RosterRow("s1", "Popa Ștefan Ion"), RosterRow("ab", "X"), RosterRow("s07xx")))


def test_names_are_written_in_either_order_by_initials_and_without_diacritic_signs():
    names = names_of(ROSTER)
    assert {"PopaStefan", "StefanPopa", "PopaS", "SPopa", "PopaStefanIon"} <= set(names["s1"])
    assert names["s07xx"] == ["s07xx"]


def test_a_written_name_decides_only_where_nothing_else_speaks():
    pages = [PageRef("scan1.jpg", path=Path("scan1.jpg")), PageRef("s1_1.jpg", path=Path("s1_1.jpg"))]
    written = {("scan1.jpg", 1): "s1", ("s1_1.jpg", 1): "ab"}
    owners = assign_pages(pages, ROSTER, "pump", written=written)
    assert [(owned.source.file, owned.student_id, owned.how) for owned in owners.owned] == [
        ("scan1.jpg", "s1", (How.WRITTEN,)),
        ("s1_1.jpg", "s1", (How.NAME,)),
    ]
    assert not owners.unmatched
