"""The figures of judging as tables."""

from collections.abc import Iterator, Sequence

import numpy as np

from tests.bench.judging_tally import ClassTime, Count, JudgingFigures, Result, Tally, Times, summed, where
from tests.bench.plain_text import Table

NOTHING = "-"


def judging_tables(figures: JudgingFigures) -> Iterator[Table]:
    """Verdicts, mistakes named, codes, times."""
    results = figures.results
    yield _verdicts(results, ("source", "hand"), "Judging: verdicts")
    yield _verdicts(results, ("source", "assignment"), "Judging: verdicts by mechanism")
    yield _names(results, ("source", "hand"), "Judging: the first mistake named")
    yield _names(results, ("source", "assignment"), "Judging: the first mistake named, by mechanism")
    yield _codes(results)
    yield _instead(results)
    yield _times(figures.times)
    if figures.classes:
        yield _classes(figures.classes)


def _of(count: Count) -> str:
    return f"{count.hits} of {count.of}"


def _percent(count: Count) -> str:
    return NOTHING if count.share is None else f"{100.0 * count.share:.1f} %"


def _verdicts(results: Sequence[Result], by: Sequence[str], title: str) -> Table:
    heads = [
        *by, "students", "charged wrongly", "credited wrongly", "review", "follow-through credited",
        "hand's own miss charged", "unpunished", "nothing to judge by: review",
    ]  # fmt: skip
    rows = [
        [
            *place, str(one.students), _of(one.false_charges), _of(one.false_credits), _percent(one.reviews),
            f"{_percent(one.followed)} of {one.followed.of}", _of(one.missed), _of(one.unpunished),
            _of(one.blank),
        ]
        for place, one in summed(results, by).items()
    ]  # fmt: skip
    return title, heads, rows


def _names(results: Sequence[Result], by: Sequence[str], title: str) -> Table:
    """Singles, pairs and slips beside each other; in brackets what is named only as a rival of another."""
    heads = [
        *by, "one mistake", "the first of two", "as the surest of two", "a slip in computing",
        "wrong names: one mistake", "two", "right drawings accused",
    ]  # fmt: skip
    rows = []
    for place in dict.fromkeys(where(one, by) for one in results):
        here = [one for one in results if where(one, by) == place]
        kinds = {kind: tally for (kind,), tally in summed(here, ("kind",)).items()}
        right, single, pair, slip = (kinds.get(kind, Tally()) for kind in ("right", "single", "pair", "slip"))
        rows.append(
            [
                *place, _named(single), _named(pair), _percent(pair.surest), _named(slip),
                _of(single.misnamed), _of(pair.misnamed), _of(right.accused),
            ]
        )  # fmt: skip
    return title, heads, rows


def _named(tally: Tally) -> str:
    if not tally.named.of:
        return NOTHING
    return f"{_percent(tally.named)} (+ {_percent(tally.rivals)}) of {tally.named.of}"


def _codes(results: Sequence[Result]) -> Table:
    """Single mistakes of careful and typical hands, by code."""
    singles = [one for one in results if one.key.kind == "single" and one.key.hand != "sloppy"]
    tallies = summed(singles, ("source",))
    codes = sorted({code for tally in tallies.values() for code in tally.codes})
    heads = ["code", *(source for (source,) in tallies)]
    rows = [[code, *(_code(tally, code) for tally in tallies.values())] for code in codes]
    return "Judging: single mistakes of careful and typical hands named, by code", heads, rows


def _code(tally: Tally, code: str) -> str:
    return _of(tally.codes[code]) if code in tally.codes else NOTHING


def _instead(results: Sequence[Result]) -> Table:
    """What was named and not made, of single mistakes and right drawings."""
    rows = [
        [source, made, named, str(count)]
        for (source, kind), tally in summed(results, ("source", "kind")).items()
        if kind != "pair"
        for (made, named), count in tally.instead.most_common(6)
    ]
    return "Judging: named and not made", ["source", "made", "named", "times"], rows


def _times(times: Times) -> Table:
    rows = [
        [name, f"{np.median(spent):.1f}", f"{np.percentile(spent, 95):.1f}", str(len(spent))]
        for name, spent in (
            ("right drawings", times.right),
            ("wrong drawings", times.wrong),
            ("read from scans", times.scans),
            ("making the task", times.task),
        )
        if spent
    ]
    return "Judging: processor time, ms", ["what", "median", "95 % within", "of"], rows


def _classes(classes: Sequence[ClassTime]) -> Table:
    heads = [
        "assignment",
        "rows",
        "graded",
        "read and judged, s",
        "with pages and results written, s",
        "wall, s",
    ]
    rows = [
        [
            one.assignment, str(one.rows), str(one.graded), f"{one.judging_s:.1f}", f"{one.processor_s:.1f}",
            f"{one.wall_s:.1f}",
        ]
        for one in classes
    ]  # fmt: skip
    return "Judging: a class's measurements through the whole program, one process", heads, rows
