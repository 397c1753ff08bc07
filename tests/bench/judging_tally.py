"""Results of judging: for each student, summed up, and as tables."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from grader.comparison.evidence import Submission
from grader.outcomes import Judgement, NamedMistake
from samples.simulation.mistakes import StudentMistake
from tests.bench.judging_handed_in import Due, Visible, computed
from tests.bench.judging_naming import Made, first_of, is_named, mistakes_due
from tests.bench.judging_students import SOURCES, Source, StudentKey, StudentWork
from tests.bench.judging_truth import charged_once, verdicts_due
from tests.bench.plain_text import NOTHING, Table

CHARGED, CREDITED = frozenset({"none", "partial"}), frozenset({"full", "follow_through"})


@dataclass(frozen=True, slots=True)
class MarkedCriterion:
    """One criterion: the verdict due and the judge's verdict."""

    criterion: str
    due: Due
    verdict: str

    @property
    def counts(self) -> bool:
        """True if there was anything to judge."""
        return self.due != "absent" and self.verdict != "not_judged"

    @property
    def is_false_charge(self) -> bool:
        """True if it was charged although right or following."""
        return self.due in {"right", "follows"} and self.verdict in CHARGED

    @property
    def is_false_credit(self) -> bool:
        """True if it was credited although clearly wrong."""
        return self.due == "wrong" and self.verdict in CREDITED


@dataclass(frozen=True, slots=True)
class Result:
    """One submission's judgement, compared with the truth.

    Attributes
    ----------
    first : the first mistake that should be named, None if there is none
    named : it was named; `surest` as the surest, `among_rivals` only as a rival of one named
    not_made : mistakes that were named and not made
    unpunished : a visible mistake cost no points and is not referred to a person
    """

    key: StudentKey
    source: Source
    criteria: tuple[MarkedCriterion, ...]
    made: tuple[StudentMistake, ...]
    mistakes: tuple[NamedMistake, ...]
    first: StudentMistake | None
    named: bool
    surest: bool
    among_rivals: bool
    not_made: tuple[NamedMistake, ...]
    unpunished: bool

    @property
    def is_clean(self) -> bool:
        """True if nothing went wrong in judging."""
        missed = self.first is not None and not self.named
        return not (
            missed or self.not_made or any(m.is_false_charge or m.is_false_credit for m in self.criteria)
        )

    def __str__(self) -> str:
        wrong = [m for m in self.criteria if m.is_false_charge or m.is_false_credit]
        parts = [
            f"{self.key} {self.source}",
            "made: " + ("; ".join(told(one) for one in self.made) or "nothing"),
            "named: " + ("; ".join(_named(one) for one in self.mistakes) or "nothing"),
        ]
        if self.first is not None and not self.named:
            parts.append(f"not named: {told(self.first)}" + (" (a rival)" if self.among_rivals else ""))
        if wrong:
            parts.append("verdicts: " + ", ".join(f"{m.criterion} {m.verdict} (due: {m.due})" for m in wrong))
        return " | ".join(parts)


def told(mistake: StudentMistake) -> str:
    """A mistake as one line of text."""
    usual = StudentMistake(mistake.code, mistake.at)
    details = ("slot", "other", "factor", "quarters", "n", "position")
    differ = [
        (name, getattr(mistake, name)) for name in details if getattr(mistake, name) != getattr(usual, name)
    ]
    return " ".join([mistake.code, mistake.at, *(f"{name}={value}" for name, value in differ)])


def _named(mistake: NamedMistake) -> str:
    detail = " ".join(f"{name}={value}" for name, value in mistake.detail.items())
    rivals = f" or {len(mistake.rivals)} rivals" if mistake.rivals else ""
    return f"{mistake.code} {mistake.at} {detail} {mistake.confidence:.2f}{rivals}"


def result_of(work: StudentWork, source: Source, handed_in: Submission, judgement: Judgement) -> Result:
    """Compare a judgement with the truth."""
    visible = Visible.of(handed_in, work.construction.links)
    due = verdicts_due(work, source, visible)
    said = {one.criterion: one.verdict for one in judgement.outcomes}
    due = charged_once(work, due, said)
    marked = tuple(MarkedCriterion(name, due[name], verdict) for name, verdict in said.items())
    made = mistakes_due(work, source, visible)
    told = computed(work)
    if told.slip is not None and source in SOURCES:
        made.append(Made(StudentMistake("arithmetic", told.slip, factor=told.factor), math.inf))
    first = first_of(made)

    def names(mistake: NamedMistake, one: StudentMistake) -> bool:
        if told.slip is not None:
            return mistake.code == one.code and one.at in {mistake.at, *mistake.explains}
        return is_named(work, source, visible, one, mistake)

    told_first = [first is not None and names(mistake, first) for mistake in judgement.mistakes]
    if any(one.name == told.slip and one.mistake == "arithmetic" for one in judgement.outcomes):
        told_first.append(True)
    rivals = [rival for mistake in judgement.mistakes for rival in mistake.rivals]
    not_made = [
        mistake
        for mistake, is_first in zip(judgement.mistakes, told_first, strict=False)
        if not is_first
        and not any(names(mistake, one.mistake) for one in made)
        # A blank entry counts as missing, whatever the reason.
        and not (mistake.code == "vector_missing" and mistake.at not in visible.directed)
    ]
    charged = any(one.verdict in CHARGED | {"review"} for one in judgement.outcomes)
    by_letters = work.by_letters(source) and first is not None and first.code == "labels_swapped"
    return Result(
        work.key, source, marked, tuple(one.mistake for one in made), judgement.mistakes, first,
        named=any(told_first),
        surest=bool(told_first) and told_first[0],
        among_rivals=first is not None and not any(told_first) and any(names(one, first) for one in rivals),
        not_made=tuple(not_made),
        unpunished=first is not None and not charged and not by_letters,
    )  # fmt: skip


@dataclass(slots=True)
class Times:
    """Processor milliseconds of each judgement; of making the task, separately."""

    right: list[float] = field(default_factory=list)
    wrong: list[float] = field(default_factory=list)
    task: list[float] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class ClassTime:
    """Seconds for a class's file of measurements.

    Attributes
    ----------
    judging_s : processor time to read the file and judge every line
    processor_s, wall_s : for all that `planmark grade` does with it, pages and results included
    """

    assignment: str
    rows: int
    graded: int
    judging_s: float
    processor_s: float
    wall_s: float


@dataclass(slots=True)
class Count:
    """A number of hits out of a number of cases."""

    hits: int = 0
    of: int = 0

    def add(self, hit: bool) -> None:
        """Count one more case."""
        self.hits += hit
        self.of += 1

    @property
    def share(self) -> float | None:
        """The share of hits; None without cases."""
        return self.hits / self.of if self.of else None


@dataclass(slots=True)
class JudgingTally:
    """All results of one kind of student and source.

    Attributes
    ----------
    false_charges, false_credits : of the criteria due to be credited, and due to be charged
    reviews : of criteria judged
    followed : credit given for vectors that follow from a mistake
    missed : criteria off by drafting errors alone that were charged
    blank : criteria with nothing to judge by that go to a person
    named, surest, rivals : of drawings with a mistake to be named
    accused : of right drawings; misnamed : of wrong ones, with a mistake named that was not made
    """

    students: int = 0
    false_charges: Count = field(default_factory=Count)
    false_credits: Count = field(default_factory=Count)
    reviews: Count = field(default_factory=Count)
    followed: Count = field(default_factory=Count)
    missed: Count = field(default_factory=Count)
    blank: Count = field(default_factory=Count)
    named: Count = field(default_factory=Count)
    surest: Count = field(default_factory=Count)
    rivals: Count = field(default_factory=Count)
    accused: Count = field(default_factory=Count)
    misnamed: Count = field(default_factory=Count)
    unpunished: Count = field(default_factory=Count)
    codes: dict[str, Count] = field(default_factory=dict)
    instead: Counter[tuple[str, str]] = field(default_factory=Counter)

    def add(self, result: Result) -> None:
        """Count one more submission."""
        self.students += 1
        for one in result.criteria:
            self._add_criterion(one)
        if not result.made:
            self.accused.add(bool(result.mistakes))
        else:
            self.misnamed.add(bool(result.not_made))
        if result.first is not None:
            self.named.add(result.named)
            self.surest.add(result.surest)
            self.rivals.add(result.among_rivals)
            self.unpunished.add(result.unpunished)
            self.codes.setdefault(result.first.code, Count()).add(result.named)
        made = "+".join(sorted(one.code for one in result.made)) or "nothing"
        self.instead.update((made, named.code) for named in result.not_made)

    def _add_criterion(self, one: MarkedCriterion) -> None:
        if one.due == "absent":
            self.blank.add(one.verdict == "review")
        if not one.counts:
            return
        self.reviews.add(one.verdict == "review")
        match one.due:
            case "right" | "follows":
                self.false_charges.add(one.is_false_charge)
            case "wrong":
                self.false_credits.add(one.is_false_credit)
            case "missed":
                self.missed.add(one.verdict in CHARGED)
        if one.due == "follows":
            self.followed.add(one.verdict in CREDITED)


def summed(results: Iterable[Result], by: Sequence[str]) -> dict[tuple[str, ...], JudgingTally]:
    """Tallies by assignment, hand, kind or source."""
    tallies: dict[tuple[str, ...], JudgingTally] = {}
    for result in results:
        tallies.setdefault(where(result, by), JudgingTally()).add(result)
    return tallies


def where(result: Result, by: Sequence[str]) -> tuple[str, ...]:
    """The key under which a result is counted."""
    return tuple(result.source if name == "source" else str(getattr(result.key, name)) for name in by)


@dataclass(slots=True)
class JudgingFigures:
    """All that was measured."""

    results: list[Result] = field(default_factory=list)
    times: Times = field(default_factory=Times)
    classes: list[ClassTime] = field(default_factory=list)

    @property
    def failures(self) -> list[Result]:
        """All results in which something went wrong."""
        return [result for result in self.results if not result.is_clean]


PLACE = ("source", "hand")
"""The fields by which the rows of the tables differ."""


def judging_tables(figures: JudgingFigures) -> Iterator[Table]:
    """Tables of verdicts, mistakes named, codes, times."""
    results = figures.results
    yield _verdicts(results)
    yield _names(results)
    yield _codes(results)
    yield _instead(results)
    yield _times(figures.times)
    if figures.classes:
        yield _classes(figures.classes)


def _of(count: Count) -> str:
    return f"{count.hits} of {count.of}"


def _percent(count: Count) -> str:
    return NOTHING if count.share is None else f"{100.0 * count.share:.1f} %"


def _verdicts(results: Sequence[Result]) -> Table:
    heads = [
        *PLACE, "students", "charged wrongly", "credited wrongly", "review", "follow-through credited",
        "hand's own miss charged", "unpunished", "nothing to judge by: review",
    ]  # fmt: skip
    rows = [
        [
            *place, str(one.students), _of(one.false_charges), _of(one.false_credits), _percent(one.reviews),
            f"{_percent(one.followed)} of {one.followed.of}", _of(one.missed), _of(one.unpunished),
            _of(one.blank),
        ]
        for place, one in summed(results, PLACE).items()
    ]  # fmt: skip
    return "Judging: verdicts", heads, rows


def _names(results: Sequence[Result]) -> Table:
    """Single mistakes, pairs and slips side by side; in brackets those named only as a rival of another."""
    heads = [
        *PLACE, "one mistake", "the first of two", "as the surest of two", "a slip in computing",
        "wrong names: one mistake", "two", "right drawings accused",
    ]  # fmt: skip
    rows = []
    for place in dict.fromkeys(where(one, PLACE) for one in results):
        here = [one for one in results if where(one, PLACE) == place]
        kinds = {kind: tally for (kind,), tally in summed(here, ("kind",)).items()}
        right, single, pair, slip = (
            kinds.get(kind, JudgingTally()) for kind in ("right", "single", "pair", "slip")
        )
        rows.append(
            [
                *place, _named_share(single), _named_share(pair), _percent(pair.surest), _named_share(slip),
                _of(single.misnamed), _of(pair.misnamed), _of(right.accused),
            ]
        )  # fmt: skip
    return "Judging: the first mistake named", heads, rows


def _named_share(tally: JudgingTally) -> str:
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


def _code(tally: JudgingTally, code: str) -> str:
    return _of(tally.codes[code]) if code in tally.codes else NOTHING


def _instead(results: Sequence[Result]) -> Table:
    """Mistakes named and not made, in drawings with one mistake and right ones."""
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
