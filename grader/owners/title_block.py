"""Read the title block of plain paper: the page's owner, and the number of the variant.

Handwriting alone decides nothing: a name counts if it is surely one of the roster's, a number if the drawing
looks like that number's variant. Codes of the problems:

| code | meaning |
|---|---|
| number_read | the number is as written on the sheet, and the drawing looks like it |
| number_contradicted | the drawing looks like another number's |
| number_doubtful | the number could not be read, or not surely |
"""

import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations
from typing import Any, Protocol

import numpy as np

from grader.owners.draft_roster import CLEAR, LIKE_MM, figure_similarity
from grader.owners.pages import Unmatched
from grader.records import FloatArray, PageRef, Reason, ScannedPage, Value, Written
from grader.scan.handwriting.captions import (
    NUMBER_WORDS,
    POSITION_WORDS,
    surer,
    written_name,
    written_number,
)
from grader.scan.page import writing_on
from grader.tables.measurements import StudentSubmission
from grader.tables.roster import Roster, RosterRow
from grader.tables.scale_text import SURE
from reference.authored.assignment import Assignment, Variant


class Pages(Protocol):
    """A source of pages as they were scanned."""

    def page(self, ref: PageRef) -> ScannedPage:
        """Return the page."""


Run = Callable[[Callable[..., Any], Sequence[tuple[Any, ...]]], Iterable[tuple[int, Any]]]
"""Runs a function on many argument tuples, and yields the index and result of each."""

# Whose page it is ---------------------------------------------------------------------------------

SURELY = 0.97
"""Probability from which a name read on a page is one of the roster's."""
_LEAST_LETTERS = 4
"""A shorter name may be any word."""


def written_owners(
    unmatched: Sequence[Unmatched], roster: Roster | None, cache: Pages, run: Run
) -> dict[tuple[str, int], str]:
    """Return the students whose names surely stand on pages of otherwise unknown owner.

    By file and page. A name that two students of the roster share belongs to nobody.
    """
    names = {} if roster is None else names_of(roster)
    pages = [
        one.source for one in unmatched if one.problem.code == "owner_unknown" and not one.source.problem
    ]
    if not names or not pages:
        return {}
    found = run(_owner, [(cache, page, names) for page in pages])
    return {
        (pages[index].file, pages[index].page): student
        for index, student in found
        if isinstance(student, str)
    }


def _owner(cache: Pages, ref: PageRef, names: Mapping[str, Collection[str]]) -> str | None:
    """Return the student whose name surely stands on a plain page."""
    for closely in (False, True):
        student, chance = written_name(writing_on(cache.page(ref), closely=closely), names)
        if chance >= SURELY:
            return student
    return None


def names_of(roster: Roster) -> dict[str, list[str]]:
    """Return the ways in which each student may write the name, or the id, by student."""
    rows: dict[str, RosterRow] = {row.student_id: row for row in roster.rows}
    spelt = {student: [*dict.fromkeys(_spellings(row))] for student, row in rows.items()}
    return {student: ways for student, ways in spelt.items() if ways}


def _spellings(row: RosterRow) -> Iterator[str]:
    """Yield first names before and behind the surname, in full and by initials, without diacritics."""
    plain = "".join(
        sign for sign in unicodedata.normalize("NFKD", row.name) if not unicodedata.combining(sign)
    )
    words = [word for word in plain.replace("-", " ").replace(".", " ").split() if word]
    if len(words) == 1 and len(words[0]) >= _LEAST_LETTERS:
        yield words[0]
    for first, second in permutations(words[:3], 2):
        yield first + second
        if len(first) >= _LEAST_LETTERS:
            yield first + second[0]
            yield second[0] + first
    if len(words) > 2:
        yield "".join(words)
    if len(row.student_id) >= _LEAST_LETTERS:
        yield row.student_id


# Which number -------------------------------------------------------------------------------------

_LIKELY = 0.2
"""Probability from which a number counts if the drawing looks more like its variant than like any other."""
_AGREES = 0.5
"""Share of the best variant's matched lines that a number's must match: neighbours may lie a degree apart."""
_MOST = 400
"""Most variants that a drawing is compared with, the likeliest by the writing: 1.5 ms each."""
_NAMED = 4


def with_written_numbers(
    students: Sequence[StudentSubmission],
    roster: Roster | None,
    assignment: Assignment,
    cache: Pages,
    run: Run,
) -> list[StudentSubmission]:
    """Give submissions without a number the one on their sheets, and a problem that says how sure it is."""
    lacking = [index for index, student in enumerate(students) if _lacks_number(student)]
    calls = [
        (cache, students[index].pages, assignment, _possible(students[index], roster, assignment))
        for index in lacking
    ]
    result = list(students)
    for place, read in run(_number, calls):
        if not isinstance(read, Reason):
            variant, problems = read
            student = students[lacking[place]]
            told = replace(student, variant=variant, problems=(*student.problems, *problems))
            result[lacking[place]] = told
    return result


def _lacks_number(student: StudentSubmission) -> bool:
    """Return whether a number is missing that may stand on the student's pages, and none is disputed."""
    disputed = any(problem.code.endswith(("_disagrees", "_range")) for problem in student.problems)
    return student.variant is None and bool(student.pages) and not disputed


def _possible(student: StudentSubmission, roster: Roster | None, assignment: Assignment) -> list[Variant]:
    """Return the variants that the roster leaves open."""
    rows = () if roster is None else roster.rows_of(student.student_id)
    row = rows[0] if len(rows) == 1 else RosterRow(student.student_id)
    return [
        variant
        for variant in assignment.variants()
        if row.n in {None, variant.n} and row.position in {None, variant.position}
    ]


def _number(
    cache: Pages, refs: Sequence[PageRef], assignment: Assignment, possible: Sequence[Variant]
) -> tuple[Variant | None, tuple[Reason, ...]]:
    """Apply `chosen_variant` to what is written and drawn on those pages that were not refused."""
    pages = [page for page in map(cache.page, refs) if page.ink is not None]
    if not pages:
        return None, ()
    numbers = {variant.n for variant in possible}, {variant.position for variant in possible}
    both = all(len(each) > 1 for each in numbers)
    words = NUMBER_WORDS, POSITION_WORDS if both else (*NUMBER_WORDS, *POSITION_WORDS)
    read = _read_numbers(pages, numbers, words)
    chances = [
        _chance(read.get(0), variant.n, numbers[0]) * _chance(read.get(1), variant.position, numbers[1])
        for variant in possible
    ]
    order = np.argsort(-np.array(chances), kind="stable")[:_MOST]
    compared, chance = [possible[index] for index in order], [chances[index] for index in order]
    drawn = [page.ink.strokes.ends for page in pages if page.ink is not None]
    similar = sum(
        (figure_similarity(ends, assignment, compared) for ends in drawn), start=np.zeros(len(compared))
    )
    variant, problem = chosen_variant(compared, chance, similar)
    return variant, (problem,)


def _read_numbers(
    pages: Sequence[ScannedPage], numbers: Sequence[Collection[int | None]], words: Sequence[Sequence[str]]
) -> dict[int, Written | None]:
    """Read the numbers behind the words, by their row; look closely at doubtful ones."""
    read: dict[int, Written | None] = {row: None for row, choice in enumerate(numbers) if len(choice) > 1}
    for closely in (False, True):
        doubtful = [row for row, one in read.items() if one is None or one.confidence < SURE]
        if doubtful:
            lines = [line for page in pages for line in writing_on(page, closely=closely)]
            for row in doubtful:
                choice = [number for number in numbers[row] if number is not None]
                read[row] = surer(read[row], written_number(lines, choice, words[row]))
    return read


def _chance(read: Written | None, number: int | None, numbers: Collection[int | None]) -> float:
    """Return the probability that this number is written; 1 if there is only one."""
    if len(numbers) == 1:
        return 1.0
    known = () if read is None else ((read.text, read.confidence), *read.others)
    return next((chance for text, chance in known if text == str(number)), 0.0)


def chosen_variant(
    variants: Sequence[Variant], chances: Sequence[float], similar: FloatArray
) -> tuple[Variant | None, Reason]:
    """Return the variant whose number is written and drawn, None if open; and the problems.

    Arguments
    ---------
    chances : the probability of each variant's number by the writing
    similar : how much the drawing looks like each variant, as returned by `figure_similarity`
    """
    likely = int(np.argmax(chances))
    drawn = int(np.argmax(similar))
    shows = float(similar[drawn]) >= LIKE_MM
    near = np.flatnonzero(similar > CLEAR * similar[drawn]).tolist() if shows else []
    agrees = shows and similar[likely] > _AGREES * similar[drawn]
    looks: dict[str, Value] = {}
    if near:
        looks = {"looks": tuple(str(variants[index]) for index in near[:_NAMED])}

    def read(index: int) -> dict[str, Value]:
        return {"read": str(variants[index]), "confidence": float(chances[index])}

    if chances[likely] >= SURE and (agrees or not shows):
        why = "drawn_like_it" if shows else "drawn_unclear"
        return variants[likely], Reason("number_read", {**read(likely), "why": why})
    if shows and chances[drawn] >= _LIKELY:
        return variants[drawn], Reason("number_read", {**read(drawn), "why": "drawn_like_it"})
    if chances[likely] >= _LIKELY:
        code = "number_contradicted" if near else "number_doubtful"
        return None, Reason(code, {**read(likely), **looks})
    return None, Reason("number_doubtful", looks)
