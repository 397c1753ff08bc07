"""Count the sheets of a scanned class that are finished, and the settled verdicts that are wrong.

::

    python -m tests.bench.settling --students 300 --kept FOLDER

reads the scans of 300 simulated students of each kind of sheet (some 5 s each; kept in the folder), judges
them, and compares every verdict with the one due (`judging_truth`). Verdicts have a probability: the
second table shows how often those of each probability are right. The third counts mistakes named; with
`--failures` sheets with a wrong verdict or name are listed::

    python -m tests.bench.settling --kinds forces forces-printed --students 18 --seed 99101 --failures
"""

import argparse
import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from grader.comparison.evidence import Submission
from grader.outcomes import Judgement, Outcome
from grader.pipeline import judged
from grader.records import PageRef, Reason
from grader.tables.measurements import StudentSubmission
from tests.bench.judging_handed_in import Due, Visible
from tests.bench.judging_scans import SHEET_KINDS, ReadWork, read_works
from tests.bench.judging_tally import CHARGED, CREDITED, Result, result_of
from tests.bench.judging_truth import charged_once, verdicts_due
from tests.bench.plain_text import Table, as_text

FIRST_SEED = 1001
"""Students before it were used to set the probabilities of doubtful readings."""
BINS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.97, 0.99, 0.999)
LENGTHS_MM = (0.0, 5.0, 20.0, 1e9)


@dataclass(frozen=True, slots=True)
class Verdict:
    """One verdict: settled, or proposed to a person.

    Attributes
    ----------
    is_right : None if either verdict is fair
    """

    is_settled: bool
    is_right: bool | None
    is_charge: bool
    probability: float
    length_mm: float


@dataclass(frozen=True, slots=True)
class Marked:
    """One student's sheets, judged."""

    kind: str
    hand: str
    is_drawn_right: bool
    of_another: bool
    was_read: bool
    verdicts: tuple[Verdict, ...] = ()
    result: Result | None = None

    @property
    def waiting(self) -> int:
        """The number of verdicts that wait for a person."""
        return sum(not one.is_settled for one in self.verdicts)

    @property
    def wrong(self) -> list[Verdict]:
        """Settled verdicts that are wrong."""
        return [one for one in self.verdicts if one.is_settled and one.is_right is False]

    @property
    def is_finished(self) -> bool:
        """True if nobody needs to look at it."""
        return self.was_read and not self.waiting


def marked(read: ReadWork) -> Marked:
    """Judge a student's sheets and compare with the truth."""
    work, declared = read.work, read.declared
    of_another = any(one.code == "other_variant" for one in work.task.mistakes)
    about = read.kind, work.key.hand, work.key.kind == "right", of_another
    submission = StudentSubmission("s", work.variant, (PageRef("scan"),), declared)
    judged_or_reason = judged(submission, work.assignment, work.rubric, read.readings)
    if isinstance(judged_or_reason, Reason):
        return Marked(*about, was_read=False)
    _, judgement, _ = judged_or_reason
    due = _due(read, judgement)
    verdicts = [
        _verdict(one, due[one.criterion]) for one in judgement.outcomes if one.verdict != "not_judged"
    ]
    drawn = Submission(tuple(one for one in read.readings if one.figures), declared=declared)
    found = result_of(work, "scans", drawn, judgement)
    result = replace(found, criteria=tuple(replace(one, due=due[one.criterion]) for one in found.criteria))
    return Marked(*about, was_read=True, verdicts=tuple(verdicts), result=result)


def _due(read: ReadWork, judgement: Judgement) -> dict[str, Due]:
    """The verdicts due to the whole drawing, read or not; a vector left out by mistake is wrong."""
    work = read.work
    names = {*work.construction.vectors, *work.construction.links} - work.left_out
    said = {one.criterion: one.verdict for one in judgement.outcomes}
    due = charged_once(work, verdicts_due(work, "scans", Visible(dict.fromkeys(names, True))), said)
    missing = {one.id for one in work.rubric.criterion if one.name in work.task.missing}
    return {name: "wrong" if name in missing else one for name, one in due.items()}


def _verdict(outcome: Outcome, due: Due) -> Verdict:
    is_settled = outcome.verdict != "review"
    said = outcome.verdict if is_settled else outcome.proposed_verdict
    fair = {"right": CREDITED, "follows": CREDITED, "wrong": CHARGED}.get(due)
    length = outcome.expected.length_mm
    return Verdict(
        is_settled, None if fair is None else said in fair, said in CHARGED,
        outcome.probability, 0.0 if length is None else length,
    )  # fmt: skip


# Tables --------------------------------------------------------------------------------------------

HEADS = (
    "sheets", "students", "finished", "right drawings finished", "criteria waiting",
    "charged wrongly", "credited wrongly", "right drawings that lose", "not read",
)  # fmt: skip


def tables(students: Sequence[Marked]) -> Iterator[Table]:
    """Tables of finished sheets and wrong verdicts; then of probabilities and shares that were right."""
    groups = {
        sheets.title: [one for one in students if one.kind == kind] for kind, sheets in SHEET_KINDS.items()
    }
    groups = {title: own for title, own in groups.items() if own}
    yield "Settling: a class of scans", HEADS, [_row(title, own) for title, own in groups.items()]
    for hand in dict.fromkeys(one.hand for one in students):
        groups[f"{hand} hands"] = [one for one in students if one.hand == hand]
    found = {name: _fair(own) for name, own in groups.items()}
    for low, high in itertools.pairwise(LENGTHS_MM):
        name = f"vectors from {low:g} mm" if high > 1e3 else f"vectors of {low:g} to {high:g} mm"
        found[name] = [one for one in _fair(students) if low <= one.length_mm < high]
    bins = [*itertools.pairwise(BINS), (BINS[-1], 1.1)]
    heads = ["verdicts", *(f"{low:g}-{min(high, 1.0):g}" for low, high in bins)]
    rows = [
        [name, *(_share([one for one in verdicts if low <= one.probability < high]) for low, high in bins)]
        for name, verdicts in found.items()
    ]
    yield "Settling: right verdicts, by their probability", heads, rows
    heads = ["sheets", "with a mistake that shows", "named", "other mistakes named", "right drawings accused"]
    yield "Settling: mistakes named", heads, [_names(title, own) for title, own in groups.items()]


def _row(title: str, students: Sequence[Marked]) -> list[str]:
    own = [one for one in students if not one.of_another]
    right = [one for one in students if one.is_drawn_right]
    verdicts = [verdict for one in own for verdict in one.verdicts]
    settled = [one for one in verdicts if one.is_settled]
    wrong = Counter(one.is_charge for student in own for one in student.wrong)
    losing = sum(any(one.is_charge for one in student.wrong) for student in right)
    return [
        title, str(len(students)), _percent(sum(one.is_finished for one in own), len(own)),
        _percent(sum(one.is_finished for one in right), len(right)),
        _percent(len(verdicts) - len(settled), len(verdicts)),
        f"{wrong[True]} of {len(settled)}", f"{wrong[False]} of {len(settled)}",
        f"{losing} of {len(right)}", str(sum(not one.was_read for one in students)),
    ]  # fmt: skip


def _names(title: str, students: Sequence[Marked]) -> list[str]:
    results = [one.result for one in students if one.result is not None]
    shown = [one for one in results if one.first is not None]
    accused = [bool(one.mistakes) for one in results if not one.made]
    others = sum(len(one.not_made) for one in results if one.made)
    return [
        title, str(len(shown)), str(sum(one.named for one in shown)), str(others),
        f"{sum(accused)} of {len(accused)}",
    ]  # fmt: skip


def _fair(students: Iterable[Marked]) -> list[Verdict]:
    """The verdicts where only one would be fair."""
    return [one for student in students for one in student.verdicts if one.is_right is not None]


def _share(verdicts: Sequence[Verdict]) -> str:
    right = sum(one.is_right is True for one in verdicts)
    return f"{100.0 * right / len(verdicts):.1f} % of {len(verdicts)}" if verdicts else "-"


def _percent(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f} %" if whole else "-"


# Running it ----------------------------------------------------------------------------------------


def _marked_seed(kept: Path | None, task: tuple[str, int]) -> list[Marked]:
    kind, seed = task
    return [marked(read) for read in read_works(kind, [seed], kept)]


def measure(
    students: int, kinds: Sequence[str], kept: Path | None, jobs: int, first_seed: int = FIRST_SEED
) -> list[Marked]:
    """Read and judge students of each kind, in several processes."""
    tasks = [(kind, seed) for seed in range(first_seed, first_seed + students) for kind in kinds]
    with ProcessPoolExecutor(jobs) as pool:
        found = pool.map(partial(_marked_seed, kept), tasks, chunksize=4)
        return [one for some in found for one in some]


def main(arguments: Sequence[str] | None = None) -> None:
    """The benchmark as text."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else "")
    parser.add_argument("--students", type=int, default=20, help="of each kind of sheet")
    parser.add_argument("--kinds", nargs="+", default=list(SHEET_KINDS), choices=list(SHEET_KINDS))
    parser.add_argument("--kept", type=Path, help="folder in which readings are kept")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=FIRST_SEED)
    parser.add_argument("--failures", action="store_true", help="list sheets with a wrong verdict or name")
    chosen = parser.parse_args(arguments)
    students = measure(chosen.students, chosen.kinds, chosen.kept, chosen.jobs, chosen.seed)
    print(as_text(tables(students)))
    for one in students if chosen.failures else ():
        if one.result is not None and not one.result.is_clean:
            print(one.result)


if __name__ == "__main__":
    main()
