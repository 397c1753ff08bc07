"""One class file dealt out in the roster's order, so many pages to each student.

The pages carry no names here, so that one missing sheet would shift everybody behind it: the order
is used only where the numbers of pages come out even, and where no other way of counting them that
comes out even says otherwise.
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
    for candidates in (rows, waiting):
        ways = [
            way
            for way in (_drawn(blank), _fronts(blank), list(range(len(blank))))
            if candidates and way is not None
        ]
        even = [dict(_dealt(way, candidates, each)) for way in ways if len(way) == each * len(candidates)]
        dealt = [{place: row for place, row in way.items() if not blank[place]} for way in even]
        if dealt and any(way != dealt[0] for way in dealt):
            return OrderRefused("passing over blank pages and counting all sheets give different owners")
        if dealt:
            return dealt[0]
    drawn = len(_drawn(blank))
    return OrderRefused(
        f"{drawn} pages that are not blank cannot be {each} for each of {len(rows)} lines of the roster;"
        " name the pages in the roster's scans, `planmark match` makes a draft"
    )


def _drawn(blank: Sequence[bool]) -> list[int]:
    """Places of the pages that are not blank."""
    return [place for place, empty in enumerate(blank) if not empty]


def _fronts(blank: Sequence[bool]) -> list[int] | None:
    """Places of the fronts of a duplex scan whose backs are all blank; None for anything else."""
    if len(blank) % 2 or not all(blank[1::2]) or not blank:
        return None
    return list(range(0, len(blank), 2))


def _dealt(places: list[int], rows: Sequence[Row], each: int) -> list[tuple[int, Row]]:
    return [(place, rows[index // each]) for index, place in enumerate(places)]
