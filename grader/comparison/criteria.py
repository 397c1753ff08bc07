"""All criteria of a rubric, marked in the order of construction so that earlier mistakes are known."""

from collections.abc import Mapping
from dataclasses import dataclass

from grader.comparison import verdicts
from grader.comparison.evidence import DrawnVector, Evidence, Submission, gather
from grader.comparison.following import from_rate
from grader.comparison.ledger import Ledger, open_ledger
from grader.comparison.limits import Mark
from grader.comparison.marking import length_tolerance, mark_value, mark_vector, tolerances
from grader.comparison.scales import Scale, settle
from grader.comparison.task import Task, unit_of
from grader.comparison.written import held_against_written
from grader.outcomes import Outcome, Quantity, Reason, Tolerance, UsedScale
from grader.rubric import CriterionTable


@dataclass(frozen=True, slots=True)
class Comparison:
    """All outcomes in the rubric's order, the scales used, and the evidence they rest on."""

    outcomes: tuple[Outcome, ...]
    scales: Mapping[str, UsedScale]
    followed: Mapping[str, float]
    """The scales that the drawing follows, where they contradict those used."""
    evidence: Evidence


def compare(task: Task, submission: Submission) -> Comparison:
    """Mark every criterion of the task's rubric."""
    evidence = gather(task, submission)
    settled = settle(task, evidence, submission.declared)
    marking = _Marking(task, evidence, settled, open_ledger(task, evidence, settled))
    order = [*settled, *_in_order(task)]
    criteria = sorted(task.rubric.criterion, key=lambda criterion: order.index(criterion.name))
    found = {criterion.id: marking.outcome(criterion) for criterion in criteria}
    outcomes = tuple(found[criterion.id] for criterion in task.rubric.criterion)
    scales = {name: scale.used for name, scale in settled.items()}
    return Comparison(outcomes, scales, marking.ledger.followed, evidence)


def _in_order(task: Task) -> list[str]:
    """Vectors and angular quantities as they are found: accelerations hang on angular velocities."""
    names = [*task.construction.vectors, *task.construction.rates]
    return sorted(names, key=lambda name: ("v", "omega", "a", "epsilon").index(name.partition("_")[0]))


@dataclass(frozen=True, slots=True)
class _Marking:
    """One submission while it is being marked."""

    task: Task
    evidence: Evidence
    settled: Mapping[str, Scale]
    ledger: Ledger

    @property
    def used(self) -> Mapping[str, float]:
        """The scales used."""
        return self.ledger.used

    def outcome(self, criterion: CriterionTable) -> Outcome:
        """The verdict on one criterion; what it costs is remembered for the later ones."""
        if criterion.scale is not None:
            return self.scale(criterion)
        if criterion.angular is not None:
            return self.rate(criterion)
        sources = [
            found
            for found in (self.evidence.drawn.get(criterion.name), self.evidence.measured.get(criterion.name))
            if found is not None
        ]
        outcomes = [self.vector(criterion, drawn) for drawn in sources]
        if len(outcomes) == 2:
            allowed = self.task.tolerance(criterion).length_mm
            return verdicts.both(outcomes[0], outcomes[1], allowed)
        if outcomes:
            return outcomes[0]
        return self.value_of_vector(criterion)

    # Scales ---------------------------------------------------------------------------------------

    def scale(self, criterion: CriterionTable) -> Outcome:
        """A declared scale, as it was settled."""
        name, unit = criterion.name, unit_of(criterion.name)
        scale = self.settled[name]
        right = self.ledger.followed[name]
        expected = Quantity(value=right, unit=unit)
        if scale.mark is None:
            if scale.used.text is None and not criterion.optional:
                return self.absent(criterion, expected)
            return verdicts.unjudged(criterion, "not_judged", scale.reasons, expected=expected)
        self.ledger.remember(name, scale.mark)
        measured = Quantity(value=scale.used.declared, unit=unit)
        allowed = Tolerance(value=self.task.tolerance(criterion).scale_relative * right)
        return verdicts.outcome(criterion, scale.mark, measured, expected, allowed)

    # Vectors --------------------------------------------------------------------------------------

    def vector(self, criterion: CriterionTable, drawn: DrawnVector) -> Outcome:
        """A vector that was drawn (or measured)."""
        name, tolerance = criterion.name, self.task.tolerance(criterion)
        least = self.task.rubric.least_confidence

        def against(expected: complex) -> Mark:
            found = mark_vector(drawn, expected, tolerance, with_direction=criterion.direction)
            if drawn is self.evidence.drawn.get(name):
                written = self.evidence.written.get(name)
                found = held_against_written(found, drawn, written, tolerance, least)
            return verdicts.with_confidence(found, drawn.confidence, least)

        mark, expected, followed = self.ledger.best(name, against)
        if drawn is self.evidence.drawn.get(name):
            mark = self.ledger.opened(name, mark)
        scale = self.used[self.task.scale_of(name)]
        value = drawn.length_mm * scale
        wrong_value = None
        if name in self.evidence.values:
            value = self.evidence.values[name]
            wrong_value = self.wrong_value(criterion, abs(value), expected, drawn)
        arithmetic = wrong_value is not None and mark.level == "full"
        if wrong_value is not None:
            mark = verdicts.the_worse(mark, wrong_value)
        direction = drawn.direction_rad
        on_sheet = None if direction is None else direction + drawn.turn_rad
        asked = criterion.direction and direction is not None
        return verdicts.outcome(
            criterion,
            mark,
            verdicts.quantity(name, drawn.length_mm, on_sheet, value),
            verdicts.expected_quantity(name, expected, scale, drawn.turn_rad),
            tolerances(tolerance, abs(expected), with_direction=asked),
            confidence=drawn.confidence,
            followed=followed,
            mistake="arithmetic" if arithmetic else None,
        )

    def wrong_value(
        self, criterion: CriterionTable, value: float, expected: complex, drawn: DrawnVector
    ) -> Mark | None:
        """The mark on a computed value; None where it is right, or right by the student's drawing."""
        scale = self.used[self.task.scale_of(criterion.name)]
        tolerance = self.task.tolerance(criterion)
        real = abs(self.task.real[criterion.name])
        marks = []
        for right in (real, abs(expected) * scale, drawn.length_mm * scale):
            allowed = length_tolerance(tolerance, right / scale) * scale
            marks.append(mark_value(value, right, allowed, tolerance, unit_of(criterion.name)))
        best = marks[0]
        for mark in marks[1:]:
            best = mark if verdicts.is_better(mark, best) else best
        return None if best.level == "full" else best

    def value_of_vector(self, criterion: CriterionTable) -> Outcome:
        """A vector of which only the computed value was handed in, or nothing."""
        name, tolerance = criterion.name, self.task.tolerance(criterion)
        scale = self.used[self.task.scale_of(name)]
        if name not in self.evidence.values:
            exact = self.task.drawn(name, self.used)
            return self.absent(criterion, verdicts.expected_quantity(name, exact, scale, 0.0))
        value = abs(self.evidence.values[name])

        def against(expected: complex) -> Mark:
            allowed = length_tolerance(tolerance, abs(expected)) * scale
            right = abs(expected) * scale
            return mark_value(value, right, allowed, tolerance, unit_of(name))

        mark, expected, followed = self.ledger.best(name, against)
        right = Quantity(value=abs(expected) * scale, unit=unit_of(name))
        measured = Quantity(value=self.evidence.values[name], unit=unit_of(name))
        allowed = Tolerance(value=length_tolerance(tolerance, abs(expected)) * scale)
        return verdicts.outcome(criterion, mark, measured, right, allowed, followed=followed)

    # Angular quantities ---------------------------------------------------------------------------

    def rate(self, criterion: CriterionTable) -> Outcome:
        """An angular velocity or acceleration that the student computed."""
        task, name, unit = self.task, criterion.name, unit_of(criterion.name)
        right = task.rates[name]
        if name not in self.evidence.values:
            return self.absent(criterion, Quantity(value=right, unit=unit))
        value, tolerance = self.evidence.values[name], task.tolerance(criterion)
        rate = task.construction.rates[name]
        scale = self.used[task.scale_of(rate.vector)]
        per_mm = scale / task.lengths_m[name]

        def against(expected: float) -> Mark:
            allowed = length_tolerance(tolerance, abs(expected) / per_mm) * per_mm
            return mark_value(value, expected, allowed, tolerance, unit)

        mark, followed = against(right), False
        self.ledger.remember(name, mark)
        own = from_rate(task, self.evidence, rate, scale) if task.rubric.follow_through else None
        if mark.level != "full" and own is not None:
            head = task.construction.vectors[rate.vector].head
            candidate = self.ledger.allowed(frozenset({head}), against(own))
            if verdicts.is_better(candidate, mark):
                follows = Reason("follows", {"what": "vector", "of": rate.vector})
                mark, right, followed = verdicts.the_better(candidate, mark, follows), own, True
        allowed = Tolerance(value=length_tolerance(tolerance, abs(right) / per_mm) * per_mm)
        measured, expected = Quantity(value=value, unit=unit), Quantity(value=right, unit=unit)
        return verdicts.outcome(criterion, mark, measured, expected, allowed, followed=followed)

    # What is not there ----------------------------------------------------------------------------

    def absent(self, criterion: CriterionTable, expected: Quantity) -> Outcome:
        """A criterion that nothing was handed in for, or that was not read."""
        unread = self.why_unread(criterion)
        reason = Reason("not_measured") if unread is None else Reason("unread", {"reason": unread})
        if criterion.optional:
            return verdicts.unjudged(criterion, "not_judged", (Reason("optional"), reason), expected=expected)
        least, length = self.task.tolerance(criterion).least_mm, expected.length_mm
        if length is not None and length < least:
            told = {"length_mm": length, "least_mm": least}
            short = Reason("too_short_to_judge", told)
            return verdicts.unjudged(criterion, "not_judged", (short, reason), expected=expected)
        if criterion.vector is not None:
            # Later criteria may hang on what nobody has seen.
            self.ledger.doubtful.add(self.task.construction.vectors[criterion.vector].head)
        verdict = self.task.rubric.missing if unread is None else "review"
        return verdicts.unjudged(criterion, verdict, (reason,), expected=expected)

    def why_unread(self, criterion: CriterionTable) -> str | None:
        """Why a vector was not read, None where no sheet could show it."""
        if criterion.vector is None or not self.evidence.has_sheets:
            return None
        vector = self.task.construction.vectors[criterion.vector]
        for name in (vector.name, vector.head, vector.tail):
            if name in self.evidence.unread:
                return self.evidence.unread[name]
        return f"{vector.name} was not found on the sheets"
