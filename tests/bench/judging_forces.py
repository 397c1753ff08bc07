"""Measure judging of entered force sheets: simulated students of `tests.bench.force_students`.

A verdict is clear where the truth is: a vector within its tolerance of what its right step gives must be
credited, one in which the mistake was made must be charged if it is off that, and the exact vector, by more
than 2.5 tolerances (of several such vectors of one mistake, one charge is enough). All else may be judged
either way::

    python -m tests.bench.judging_forces --students 20
"""

import argparse
import cmath
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.outcomes import CHARGED, CREDITED, Judgement
from tests.bench.force_students import (
    BODIES,
    HANDS,
    ForceMistake,
    StudentForces,
    force_task,
    mistakes_for,
    others_for,
)

CLEAR = 2.5
"""Tolerances beyond which a wrong vector must be charged."""
RELATIVE = 0.02
"""Tolerance of the balancing moment."""
NAMES: Mapping[str, frozenset[str]] = {
    "reversed": frozenset({"inertia_reversed", "force_reversed", "couple_reversed"}),
    "missing": frozenset({"force_missing", "couple_missing"}),
    "slip": frozenset({"arithmetic"}),
    "part": frozenset({"sense_reversed", "arithmetic"}),
    "line": frozenset({"parallel_for_perpendicular"}),
    "wrong_arm": frozenset({"wrong_arm"}),
    "arrow": frozenset({"force_reversed"}),
    "scale": frozenset({"scale_wrong"}),
}
"""The codes by which each kind of mistake may be named."""


@dataclass(slots=True)
class Tally:
    """Verdicts against the truth, and single mistakes named."""

    clear: int = 0
    wrong: list[str] = field(default_factory=list)
    waiting: int = 0
    made: Counter[str] = field(default_factory=Counter)
    named: Counter[str] = field(default_factory=Counter)
    missed: list[str] = field(default_factory=list)
    false: list[str] = field(default_factory=list)


def tolerances_off(student: StudentForces, name: str, due: complex | None = None) -> float:
    """Return by how many tolerances an entry is off what its right step gives, or off another vector."""
    due, (length, turn) = due or student.due[name], student.entered[name]
    size = abs(due)
    off = abs(length - size) / max(1.0, 0.02 * size)
    if size >= 3.0 and length >= 3.0:
        turned = abs(math.degrees(math.remainder(math.radians(turn) - cmath.phase(due), math.tau)))
        off = max(off, turned / max(1.5, math.degrees(math.atan(0.5 / size))))
    return off


def count(tally: Tally, label: str, student: StudentForces, judgement: Judgement) -> None:
    """Add one sheet."""
    said = {one.name: one.verdict for one in judgement.outcomes}
    wrong = {
        name
        for name in student.wrong & student.due.keys()
        if tolerances_off(student, name) > CLEAR < tolerances_off(student, name, student.exactly[name])
    }
    wrong |= student.wrong & {"M_b", "kF"}
    charged = {name for name in wrong if said[name] in CHARGED}
    if wrong:
        tally.clear += 1
        if not charged and any(said[name] in CREDITED for name in wrong):
            tally.wrong.append(f"{label}: {sorted(wrong)} credited")
    moment, due = student.moment or 0.0, student.moment_due or 0.0
    if "M_b" not in student.wrong and abs(moment - due) <= RELATIVE * abs(due):
        tally.clear += 1
        if said["M_b"] in CHARGED:
            tally.wrong.append(f"{label}: M_b {said['M_b']}")
    for name, verdict in said.items():
        tally.waiting += verdict == "review"
        if name in student.wrong or name not in student.due or not student.drawn[name]:
            continue
        if tolerances_off(student, name) <= 1.0:
            tally.clear += 1
            if verdict in CHARGED:
                tally.wrong.append(f"{label}: {name} {verdict}")


def count_names(tally: Tally, label: str, student: StudentForces, judgement: Judgement) -> None:
    """Add whether the mistake of a sheet was named, where it shows."""
    made, told = student.mistake, {(one.code, one.at) for one in judgement.mistakes}
    if made is None or made.kind not in NAMES:
        tally.false += [f"{label}: {one}" for one in told if one[0] != "arithmetic"]
        return
    shows = any(tolerances_off(student, name) > CLEAR for name in student.wrong if name in student.due)
    if not shows and made.kind != "scale" and made.at != "M_b":
        return
    at = made.at.split()[-1] if made.kind != "wrong_arm" else ""
    tally.made[made.kind] += 1
    if any(code in NAMES[made.kind] and (where.startswith(at) or not at) for code, where in told):
        tally.named[made.kind] += 1
    else:
        tally.missed.append(f"{label}: {sorted(told)}")


def sheets(assignment: str, hand: str, seed: int, kinds: str) -> Iterator[tuple[str, StudentForces]]:
    """Yield a student's right sheet, and one with each mistake in turn."""
    task, _ = force_task(assignment)
    rng = np.random.default_rng(seed)
    variant = task.variants()[int(rng.integers(len(task.variants())))]
    mistakes: list[ForceMistake | None] = [None]
    if kinds == "known":
        every = list(mistakes_for(assignment, variant))
        mistakes = [every[index] for index in rng.choice(len(every), min(12, len(every)), replace=False)]
    elif kinds == "others":
        every = list(others_for(assignment, variant, rng))
        mistakes = [every[index] for index in rng.choice(len(every), min(6, len(every)), replace=False)]
    for index, mistake in enumerate(mistakes):
        own = np.random.default_rng((seed, index))
        label = f"{assignment} {hand} {seed} {variant.n or variant.position} {mistake}"
        yield label, StudentForces(task, variant, HANDS[hand], mistake, own)


def measure_forces(
    students: int, first_seed: int = 97001, kinds: Sequence[str] = ("right", "known", "others")
) -> dict[str, Tally]:
    """Judge students of each assignment and hand; return the tallies by kind of sheet."""
    found = {kind: Tally() for kind in kinds}
    for kind in kinds:
        for assignment in BODIES:
            for hand in HANDS:
                for seed in range(first_seed, first_seed + students):
                    for label, student in sheets(assignment, hand, seed, kind):
                        task, rubric = force_task(assignment)
                        judgement = judge(task_of(task, rubric, student.variant), student.submission)
                        count(found[kind], label, student, judgement)
                        count_names(found[kind], label, student, judgement)
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description="Judging of entered force sheets.")
    parser.add_argument("--students", type=int, default=4)
    parser.add_argument("--seed", type=int, default=97001)
    parser.add_argument("--kinds", nargs="+", default=["right", "known", "others"])
    parser.add_argument("--failures", type=int, default=0)
    chosen = parser.parse_args(arguments)
    for kind, tally in measure_forces(chosen.students, chosen.seed, chosen.kinds).items():
        named, made = sum(tally.named.values()), sum(tally.made.values())
        print(f"{kind}: {len(tally.wrong)} wrong of {tally.clear} clear verdicts, {tally.waiting} waiting;")
        print(f"  {named} of {made} single mistakes named; {len(tally.false)} named that were not made")
        print("  " + ", ".join(f"{one}: {tally.named[one]} of {many}" for one, many in tally.made.items()))
        for line in (*tally.wrong, *tally.missed, *tally.false)[: chosen.failures]:
            print("   ", line)


if __name__ == "__main__":
    main()
