"""What earlier mistakes have cost, and what may follow through from them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from grader.comparison import verdicts
from grader.comparison.evidence import Evidence
from grader.comparison.following import Expectation, expectations, with_own_lengths
from grader.comparison.limits import Mark
from grader.comparison.marking import length_tolerance
from grader.comparison.scales import Scale, followed_scales, used_scales
from grader.comparison.task import Task
from grader.outcomes import Reason


def open_ledger(task: Task, evidence: Evidence, settled: Mapping[str, Scale]) -> "Ledger":
    """The ledger of a submission before anything is marked."""
    used = used_scales(settled)
    ledger = Ledger(task, evidence, settled, used, followed_scales(settled), _deviating(task, evidence, used))
    # What was drawn contradicts a scale that nobody declared, or that nobody understood.
    ledger.doubtful.update(name for name, scale in settled.items() if scale.other and scale.used.assumed)
    return ledger


def _deviating(task: Task, evidence: Evidence, used: Mapping[str, float]) -> frozenset[str]:
    """The student's own nodes that are further from their right places than a length may be off."""
    exact = task.nodes(with_own_lengths(task, evidence, used))
    tolerance = task.rubric.tolerance
    return frozenset(
        name
        for name, own in evidence.nodes.items()
        if abs(own - exact[name]) > length_tolerance(tolerance, abs(exact[name]))
    )


@dataclass(frozen=True, slots=True)
class Ledger:
    """What has been charged while criteria are marked in the order of construction.

    What relies on a wrong node or scale may follow through only when that mistake has cost something:
    `charged` holds those. `cleared` holds the nodes that were judged and are within their tolerance,
    `doubtful` the nodes and scales whose verdict is open.
    """

    task: Task
    evidence: Evidence
    settled: Mapping[str, Scale]
    used: Mapping[str, float]
    followed: Mapping[str, float]
    deviating: frozenset[str]
    charged: set[str] = field(default_factory=set)
    cleared: set[str] = field(default_factory=set)
    doubtful: set[str] = field(default_factory=set)

    def best(self, name: str, against: Callable[[complex], Mark]) -> tuple[Mark, complex, bool]:
        """The mark on the original data, or a better one on what follows from own earlier values.

        Returns the mark, the expectation that it was held against, and whether that follows.
        """
        task = self.task
        exact = chosen = task.drawn(name, self.used)
        mark = original = against(exact)
        is_drift = False
        if original.worst != "full" and task.rubric.follow_through:
            for one in expectations(task, self.evidence, name, self.used, self.followed):
                candidate = self.allowed(one.relies_on, against(one.vector))
                if verdicts.is_better(candidate, mark):
                    mark = verdicts.the_better(candidate, original, *self.why(one))
                    chosen, is_drift = one.vector, not self.wrong(one.relies_on)
        self.remember(task.construction.vectors[name].head, mark)
        if is_drift and mark.worst == "full" and original.level != "none":
            # Every earlier step is within its tolerance, and so is this one: nothing is wrong.
            return Mark("full", "full", "full"), exact, False
        return mark, chosen, chosen is not exact

    def opened(self, name: str, mark: Mark) -> Mark:
        """A loss on a sheet is open while what it may follow from was not read for certain."""
        unknown = self.unknown_upstream(name) if self.task.rubric.follow_through else ()
        if mark.worst == "full" or not unknown:
            return mark
        head = self.task.construction.vectors[name].head
        self.charged.discard(head)
        self.doubtful.add(head)
        told = f"{', '.join(unknown)}, on which it hangs, was not read for certain"
        return Mark(mark.level, mark.worst, "full", (*mark.reasons, Reason("unread", {"reason": told})))

    def unknown_upstream(self, name: str) -> tuple[str, ...]:
        """The nodes that a vector's head is made from and that were not read, of figures that were."""
        construction, nodes = self.task.construction, self.evidence.nodes
        read = {
            figure
            for figure, steps in construction.figures.items()
            if any(step.node in nodes for step in steps)
        }
        needs = construction.step(construction.vectors[name].head).needs
        return tuple(
            dict.fromkeys(
                need for need in needs if need not in nodes and construction.figure_of(need) in read
            )
        )

    def wrong(self, relies_on: frozenset[str]) -> frozenset[str]:
        """What is wrong of the nodes and scales relied on: off, and not judged to be within tolerance."""
        off = relies_on & self.deviating | relies_on - self.evidence.nodes.keys()
        return frozenset(off - self.cleared | relies_on & self.charged)

    def allowed(self, relies_on: frozenset[str], mark: Mark) -> Mark:
        """Credit for following only where the earlier mistake has been charged; else it is charged here."""
        wrong = self.wrong(relies_on)
        has_doubtful_scale = bool(wrong & self.doubtful & self.settled.keys())
        if not wrong or (wrong & self.charged and not has_doubtful_scale):
            return mark
        if wrong & self.doubtful:
            return Mark("none", "none", mark.best, mark.reasons)
        if mark.worst == "full":
            self.charged.update(wrong)
        return Mark("none", "none", "none", mark.reasons)

    def remember(self, name: str, mark: Mark) -> None:
        """Whether a node or scale has cost something, or may have, or is right."""
        if not mark.is_certain:
            self.doubtful.add(name)
        elif mark.level != "full":
            self.charged.add(name)
        else:
            self.cleared.add(name)

    def why(self, one: Expectation) -> tuple[Reason, ...]:
        """What an expectation follows from, and that its scale is not known where it is not."""
        follows = Reason("follows", {"what": one.what, "of": one.of or self.named(one)})
        assumed = self.settled[one.of].reasons if one.what == "scale" and one.of in self.doubtful else ()
        return (*assumed, follows)

    def named(self, one: Expectation) -> str:
        """The last vector charged that an expectation relies on, or the mechanism."""
        blamed = one.relies_on & (self.charged | self.doubtful)
        names = [v.name for v in self.task.construction.vectors.values() if v.head in blamed]
        return names[-1] if names else "mechanism"
