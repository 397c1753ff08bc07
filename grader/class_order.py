"""One class file dealt out in the roster's order, so many pages to each student.

The pages carry no names here, so that one missing sheet would shift everybody behind it: the order
is used only where the numbers of pages come out even. Pages that are drawn on are counted first;
where they are too few (a student handed in an empty sheet) all sheets are, or all fronts of a duplex
scan.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

Row = TypeVar("Row")


@dataclass(frozen=True, slots=True)
class OrderRefused:
    """Why the order says nothing. False in a condition."""

    reason: str

    def __bool__(self) -> bool:
        return False


def deal(
    blank: Sequence[bool], rows: Sequence[Row], waiting: Sequence[Row], each: int
) -> dict[int, Row] | OrderRefused:
    """The row of each page, by the page's place in the file from 0; blank pages are dealt to nobody.

    Arguments
    ---------
    blank : for each page of the file
    rows : the roster's rows in order
    waiting : those of them that have no pages elsewhere; dealt to where all `rows` do not come out even
    each : pages per row
    """
    if each < 1:
        raise ValueError(f"pages per student must be 1 or more, not {each}")
    ways = (_drawn(blank), list(range(len(blank))), _fronts(blank))
    for candidates in (rows, waiting):
        for places in ways:
            if candidates and len(places) == each * len(candidates):
                dealt = zip(places, (row for row in candidates for _ in range(each)), strict=True)
                return {place: row for place, row in dealt if not blank[place]}
    drawn = len(_drawn(blank))
    return OrderRefused(
        f"{drawn} pages that are not blank cannot be {each} for each of {len(rows)} lines of the roster;"
        " name the pages in the roster's scans, `planmark match` makes a draft"
    )


def _drawn(blank: Sequence[bool]) -> list[int]:
    """Places of the pages that are not blank."""
    return [place for place, empty in enumerate(blank) if not empty]


def _fronts(blank: Sequence[bool]) -> list[int]:
    """Places of the fronts of a duplex scan whose backs are all blank; none for anything else."""
    return list(range(0, len(blank), 2)) if len(blank) % 2 == 0 and all(blank[1::2]) else []
