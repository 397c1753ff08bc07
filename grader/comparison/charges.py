"""The charges: what earlier mistakes have cost, and which later values may follow from them."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

from grader.comparison.evidence import DrawnVector, Evidence
from grader.comparison.follow_through import NO_SPREAD, Expectation, Explain, FollowThrough
from grader.comparison.own import known
from grader.comparison.scales import Scale, followed_scales, used_scales
from grader.comparison.task import Task, TaskSegment
from grader.comparison.verdicts import (
    EVEN,
    FULL,
    NONE,
    OPENING,
    MarkRange,
    at_worst,
    the_better,
    tolerances,
    widened,
)
from grader.records import Reason
from reference.construction.mistakes import line_of
from reference.construction.steps import Given
from reference.construction.uncertainty import EndSpread

BY_HAND = frozenset({"hand_may_miss", "near_limit"})
"""Reasons why a vector's verdict is open although it was read well."""


class Against(Protocol):
    """Marks a criterion against one expectation."""

    def __call__(
        self, expected: complex, uncertainty: EndSpread = NO_SPREAD, se: EndSpread = NO_SPREAD
    ) -> MarkRange:
        """The mark; `uncertainty` is the propagated drafting error, `se` are standard errors of reading."""


@dataclass(frozen=True, slots=True)
class ComparedMark:
    """A mark with the expectation that gave it.

    Attributes
    ----------
    adds_up : it follows from small errors, each within its tolerance, and from nothing charged
    is_trivial : an earlier mistake makes it so short that it shows nothing: it is not judged
    """

    mark: MarkRange
    expected: complex
    uncertainty: EndSpread = NO_SPREAD
    is_followed: bool = False
    adds_up: bool = False
    is_trivial: bool = False


def new_charges(task: Task, evidence: Evidence, settled: Mapping[str, Scale], explain: Explain) -> "Charges":
    """The charges of a submission before anything is marked."""
    used, followed = used_scales(settled), followed_scales(settled)
    following = FollowThrough(task, evidence, used, followed, lambda: explain(task, evidence, settled))
    charges = Charges(task, evidence, settled, used, followed, following)
    # What was drawn contradicts a scale that nobody declared, or that nobody understood.
    charges.doubtful.update(name for name, scale in settled.items() if scale.other and scale.used.assumed)
    return charges


@dataclass(slots=True)
class Charges:
    """The charges while criteria are marked in the order of construction.

    A value may follow through only when every mistake that it depends on has cost something.

    Attributes
    ----------
    charged : nodes and scales that have cost something
    cleared : nodes that were judged and are within their tolerance
    by_length : those of them whose direction is not known: they may be laid off the wrong way
    inherited : nodes that are right only as they follow from something charged
    doubtful : nodes and scales whose verdict is open
    either : nodes that drafting errors may explain, or a mistake: read well, what follows from them is right
    shown : what the current criterion is the first to show; it is charged there, and followed after it
    known_causes : by node, and whether only its sense is open, the causes of its position (cache)
    factors : by scale, the common factor by which all values are wrong, or None (cache)
    """

    task: Task
    evidence: Evidence
    settled: Mapping[str, Scale]
    used: Mapping[str, float]
    followed: Mapping[str, float]
    following: FollowThrough
    charged: set[str] = field(default_factory=set)
    cleared: set[str] = field(default_factory=set)
    by_length: set[str] = field(default_factory=set)
    inherited: set[str] = field(default_factory=set)
    doubtful: set[str] = field(default_factory=set)
    either: set[str] = field(default_factory=set)
    shown: set[str] = field(default_factory=set)
    known_causes: dict[tuple[str, bool], frozenset[str]] = field(default_factory=dict)
    factors: dict[str, float | None] = field(default_factory=dict)

    def best(self, segment: TaskSegment, against: Against, *, follows_through: bool) -> ComparedMark:
        """The mark on the original data, or a better one on what follows from own earlier values."""
        self.charge_shown()
        exact = segment.drawn(self.used)
        marked = ComparedMark(against(exact), exact)
        if not marked.mark.is_full:
            uncertainty = self.following.uncertainty_of(segment, exact)
            marked = ComparedMark(against(exact, uncertainty), exact, uncertainty)
        if not marked.mark.is_full and follows_through:
            marked = self.followed_through(segment, against, marked)
        if marked.mark.is_full:
            self.shown.clear()
        self.charge_shown()
        if marked.is_trivial:
            return marked
        if marked.mark.worst != marked.mark.best and self.following.is_blamed(segment.name):
            marked = replace(marked, mark=at_worst(marked.mark))
        self.remember(segment.head, marked.mark)
        if self.is_by_length(segment):
            self.by_length.add(segment.head)
        if marked.is_followed and marked.mark.is_full and not marked.adds_up:
            self.inherited.add(segment.head)
        return marked

    def charge_shown(self) -> None:
        """Charge what the last criterion was the first to show."""
        self.charged.update(self.shown)
        self.shown.clear()

    def followed_through(
        self, segment: TaskSegment, against: Against, original: ComparedMark
    ) -> ComparedMark:
        """The best of what follows: from the scale drawn at, from own nodes, from anything else."""
        marked, following = original, self.following
        at_scale = following.at_followed_scale(segment)
        if at_scale is not None:
            marked = self.the_better(marked, at_scale, against)
        if not marked.mark.is_full:
            marked = self.from_own_nodes(segment, against, marked, original)
        if not marked.mark.is_full:
            for expectation in (*self.at_charged_head(segment), *following.expectations(segment)):
                marked = self.unless_trivial(segment, marked, expectation, against)
        return marked

    def unless_trivial(
        self, segment: TaskSegment, marked: ComparedMark, expectation: Expectation, against: Against
    ) -> ComparedMark:
        """As `the_better`; what follows rightly and is trivially short is neither credited nor charged."""
        if marked.mark.is_full:
            return marked
        following, better = self.following, self.the_better(marked, expectation, against)
        if better is marked or not following.is_trivial(segment, expectation.vector):
            return better
        return replace(marked, is_trivial=better.mark.is_full)

    def at_charged_head(self, segment: TaskSegment) -> Iterator[Expectation]:
        """What follows at a node whose wrong line has been charged to another vector."""
        if segment.scale != "kL" and segment.head in self.charged | self.doubtful:
            following = self.following
            found = (following.on_own_line(segment), following.between_own_nodes(segment))
            yield from (one for one in found if one is not None)

    def rank(self, segment: TaskSegment) -> int:
        """The order of vectors that end at one node: first those on wrong lines, then those on right ones.

        A node that is made rightly needs no order.
        """
        head = segment.head
        known_nodes = self.evidence.nodes.keys() | known(self.following.own(self.used))
        if segment.scale == "kL" or head not in known_nodes or head not in self.causes_at(head):
            return 0
        if line_of(self.task.construction.vectors[segment.name], self.task.construction) is None:
            return 2
        expected, own = self.following.on_own_line(segment), self.evidence.vector(segment.name)
        if expected is None or own is None:
            basis = self.following.drawn_instead()
            return int(basis is not None and not basis.blames(segment.name, head))
        return int(self.is_along(segment, own, expected))

    def is_along(self, segment: TaskSegment, own: DrawnVector, line: Expectation) -> bool:
        """Whether a drawn vector lies along its line, one way or the other; a very short one may."""
        table, size = self.task.rubric.tolerance_of(segment.name), own.length_mm
        if size < table.least_mm:
            return True
        plain = tolerances(table, size, with_direction=True)
        allowed = widened(plain, size, line.uncertainty, self.task.rubric.hand.at_most).direction_deg
        return math.degrees(math.acos(min(abs(line.vector) / size, 1.0))) <= (allowed or 0.0)

    def from_own_nodes(
        self, segment: TaskSegment, against: Against, marked: ComparedMark, original: ComparedMark
    ) -> ComparedMark:
        """The mark by the own nodes from which this step started, where they are known."""
        expectation = self.following.from_nodes(segment, self.used)
        if not expectation.relies_on:
            return marked
        if self.causes(expectation) or expectation.relies_on & self.inherited:
            return self.unless_trivial(segment, marked, expectation, against)
        # Every earlier step is within its propagated uncertainty: this step alone counts.
        mark = against(expectation.vector, expectation.uncertainty, expectation.se)
        if not mark.is_better(marked.mark):
            return marked
        if not mark.is_full:
            return replace(original, mark=replace(mark, reasons=original.mark.reasons))
        return ComparedMark(
            the_better(mark, original.mark, Reason("follows", {"what": "small_errors", "of": ""})),
            expectation.vector,
            expectation.uncertainty,
            is_followed=True,
            adds_up=True,
        )

    def the_better(self, marked: ComparedMark, expectation: Expectation, against: Against) -> ComparedMark:
        """The mark so far, with that against an expectation where it leaves more, for certain or at best."""
        candidate = self.allowed(
            expectation, against(expectation.vector, expectation.uncertainty, expectation.se)
        )
        if not candidate.is_better(marked.mark) and candidate.best <= marked.mark.best:
            return marked
        return ComparedMark(
            the_better(candidate, marked.mark, *self.why(expectation)),
            expectation.vector,
            expectation.uncertainty,
            is_followed=True,
        )

    def opened(self, segment: TaskSegment, mark: MarkRange, *, follows_through: bool) -> MarkRange:
        """A loss on a sheet is open while what it may follow from was not read for certain."""
        unknown = self.unknown_upstream(segment) if follows_through else ()
        if mark.share == FULL or not unknown:
            return mark
        self.charged.discard(segment.head)
        self.doubtful.add(segment.head)
        unread = Reason("unread", {"why": "upstream_unsure", "nodes": unknown})
        return replace(mark, best=FULL, reasons=(*mark.reasons, unread), sure=min(mark.sure, EVEN))

    def unknown_upstream(self, segment: TaskSegment) -> tuple[str, ...]:
        """What a vector is made from and is not known: nodes, of figures that were read, and its scale.

        Known are nodes that were read, those from which a vector was made that is right, and those at which
        it is nearly certain what was done.
        """
        construction, nodes = self.task.construction, self.evidence.nodes
        scale = self.settled[segment.scale].mark
        is_unseen = scale is not None and any(reason.code == "unread" for reason in scale.reasons)
        needs = [
            need
            for need in construction.step(segment.head).needs
            if need not in {*nodes, *self.charged, *self.cleared}
        ]
        read = {construction.figure_of(node) for node in nodes} if needs else set()
        unread = dict.fromkeys(need for need in needs if construction.figure_of(need) in read)
        if unread:
            right = self.cleared - self.by_length - self.charged - self.doubtful
            sure = construction.needed_for(right) | self.following.explained()
            unread = {need: None for need in unread if need not in sure}
        return (*((segment.scale,) if is_unseen else ()), *unread)

    # What is wrong --------------------------------------------------------------------------------

    def causes_at(self, node: str) -> frozenset[str]:
        """The causes of an own node's position, see `FollowThrough.causes_at`.

        Of a vector whose length was judged right only its sense is open.
        """
        key = node, node in self.by_length & self.cleared
        if key not in self.known_causes:
            self.known_causes[key] = self.following.causes_at(node, only_sense=key[1])
        return self.known_causes[key]

    def is_by_length(self, segment: TaskSegment) -> bool:
        """Whether only the length is known of a vector that is laid off: its sense may be wrong."""
        drawn = self.evidence.vector(segment.name)
        is_laid_off = isinstance(self.task.construction.step(segment.head), Given)
        return is_laid_off and drawn is not None and drawn.direction_rad is None

    def causes(self, expectation: Expectation) -> frozenset[str]:
        """The causes of what an expectation relies on, charged or not."""
        right = self.cleared - self.by_length
        nodes = {step.node for step in self.task.construction.steps}
        found: set[str] = set()
        for name in expectation.relies_on - right:
            found |= self.causes_at(name) if name in nodes else {name}
        # A wrong step may have left one vector within its tolerance and show in another.
        return frozenset(found - right) | expectation.causes | (expectation.relies_on & self.charged)

    def allowed(self, expectation: Expectation, mark: MarkRange) -> MarkRange:
        """The mark for what follows, where every mistake that it follows from has been charged.

        The first mistake that has not been is charged here.
        """
        causes = self.causes(expectation)
        unpaid = causes - self.charged - self.either
        if not unpaid and not causes & self.doubtful & self.settled.keys():
            return mark
        if causes & (self.doubtful - self.either):
            return MarkRange(NONE, NONE, mark.best, mark.reasons, min(mark.sure, EVEN))
        if mark.share > NONE:
            self.shown.add(self.first(unpaid))
        return MarkRange(NONE, NONE, NONE, mark.reasons, mark.sure)

    def first(self, names: frozenset[str]) -> str:
        """The earliest of some causes in the order of construction; scales and data come before nodes."""
        order = {step.node: index for index, step in enumerate(self.task.construction.steps)}
        return min(names, key=lambda name: (order.get(name, -1), name))

    def remember(self, name: str, mark: MarkRange) -> None:
        """Record whether a node or scale has cost something, is in doubt, or is right."""
        if not mark.is_certain:
            self.doubtful.add(name)
            opening = {reason.code for reason in mark.reasons} & OPENING
            if opening and opening <= BY_HAND:
                self.either.add(name)
        elif mark.share != FULL:
            self.charged.add(name)
        else:
            self.cleared.add(name)

    def leave_open(self, name: str) -> None:
        """Record that the verdict on a vector, angular quantity or scale is open after all."""
        self.doubtful.add(self.forget(name))

    def decided(self, name: str, verdict: str) -> None:
        """Record what a person decided of an open verdict: what follows from it is in doubt no more."""
        node = self.forget(name)
        if verdict in {"none", "partial"}:
            self.charged.add(node)
        elif verdict in {"full", "follow_through"}:
            self.cleared.add(node)
        if verdict == "follow_through":
            self.inherited.add(node)

    def forget(self, name: str) -> str:
        """The node, quantity or scale of a name, of which nothing is recorded any more."""
        segment = self.task.segments.get(name)
        node = name if segment is None else segment.head
        self.shown.clear()
        for judged in (self.charged, self.cleared, self.by_length, self.inherited, self.doubtful):
            judged.discard(node)
        return node

    # Why ------------------------------------------------------------------------------------------

    def why(self, expectation: Expectation) -> tuple[Reason, ...]:
        """The reasons for an expectation: what it follows from, and whether its scale was assumed."""
        follows = Reason(
            "follows", {"what": expectation.what, "of": expectation.of or self.named(expectation)}
        )
        assumed = (
            self.settled[expectation.of].reasons
            if expectation.what == "scale" and expectation.of in self.doubtful
            else ()
        )
        return (*assumed, follows)

    def named(self, expectation: Expectation) -> str:
        """The last vector charged that an expectation relies on, or the mechanism."""
        blamed = (expectation.relies_on | expectation.causes) & (self.charged | self.doubtful)
        names = [v.name for v in self.task.construction.vectors.values() if v.head in blamed]
        return names[-1] if names else "mechanism"
