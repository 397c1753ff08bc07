"""The charges: what earlier mistakes have cost, and the one choice among expectations that depends on it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from grader.comparison.evidence import Evidence
from grader.comparison.follow_through import FollowThrough
from grader.comparison.scales import Scale
from grader.comparison.task import Task, TaskSegment
from grader.comparison.verdicts import (
    FULL,
    NONE,
    OPENING,
    SHORT_MM,
    Expectation,
    Held,
    MarkRange,
    at_worst,
    the_better,
)
from grader.outcomes import CHARGED, CREDITED, EVEN
from grader.records import VELOCITY_PLAN, Reason
from reference.construction.elements import Coriolis, Normal
from reference.construction.steps import Given
from reference.quantities import group_of

BY_HAND = frozenset({"hand_may_miss", "near_limit"})
"""Reasons why a vector's verdict is open although it was read well."""


@dataclass(frozen=True, slots=True)
class Choice:
    """The expectation that counts, and the mark against it.

    Attributes
    ----------
    is_followed : it follows from the student's own values
    adds_up : it follows from small errors, each within its tolerance, and from nothing charged
    is_trivial : an earlier mistake makes it so short that it shows nothing: it is not judged
    shown : mistakes that this criterion is the first to show; they are charged here
    """

    mark: MarkRange
    expectation: Expectation
    is_followed: bool = False
    adds_up: bool = False
    is_trivial: bool = False
    shown: frozenset[str] = frozenset()


def choose(
    charges: "Charges", segment: TaskSegment, expectations: Iterable[Expectation], held: Held
) -> Choice:
    """The first expectation that gives full marks for certain, else the one that leaves most.

    What follows from a mistake counts only after the mistake has cost something.
    """
    following, shown = charges.following, set[str]()
    given: Choice | None = None
    for one in expectations:
        mark = held.against(one)
        if given is None or one.what == "given":
            # As the task asks for it; the second time with its propagated drafting error.
            given = chosen = Choice(mark, one)
        elif one.may_add_up and not charges.is_wrong(one):
            # Every earlier step is within its propagated uncertainty: this step alone counts.
            if mark.is_full:
                small = Reason("follows", {"what": "small_errors", "of": ""})
                chosen = Choice(the_better(mark, given.mark, small), one, is_followed=True, adds_up=True)
            elif mark.is_better(chosen.mark):
                chosen = replace(given, mark=replace(mark, reasons=given.mark.reasons))
        else:
            mark, unpaid = charges.credited(one, mark)
            shown |= unpaid
            if mark.is_better(chosen.mark) or mark.best > chosen.mark.best:
                better = the_better(mark, chosen.mark, *charges.why(one))
                if following.is_trivial(segment, one.vector):
                    by_hand = mark.best == FULL and any(why.code == "hand_may_miss" for why in mark.reasons)
                    chosen = replace(chosen, is_trivial=chosen.is_trivial or by_hand or better.share > NONE)
                else:
                    is_trivial = chosen.is_trivial and not better.is_full
                    chosen = Choice(better, one, is_followed=True, is_trivial=is_trivial)
        if chosen.mark.is_full:
            return chosen
    if not chosen.is_trivial and not chosen.mark.is_certain and charges.is_known(segment, chosen.mark):
        chosen = replace(chosen, mark=at_worst(chosen.mark))
    return replace(chosen, shown=frozenset(shown))


@dataclass(slots=True)
class Charges:
    """The findings on nodes, scales and angular quantities so far, criteria in the order of construction.

    A value may follow through only when every mistake that it depends on has cost something.

    Attributes
    ----------
    charged : what has cost something
    cleared : what was judged and is within its tolerance
    by_length : nodes whose direction is not known: they may be laid off the wrong way
    inherited : nodes that are right only as they follow from something charged
    doubtful : what has an open verdict
    either : what drafting errors or a mistake may explain, read for certain: what follows from it counts
    """

    task: Task
    evidence: Evidence
    settled: Mapping[str, Scale]
    following: FollowThrough
    charged: set[str] = field(default_factory=set)
    cleared: set[str] = field(default_factory=set)
    by_length: set[str] = field(default_factory=set)
    inherited: set[str] = field(default_factory=set)
    doubtful: set[str] = field(default_factory=set)
    either: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        # What was drawn contradicts a scale that nobody declared, or that nobody understood.
        self.doubtful |= {name for name, scale in self.settled.items() if scale.other and scale.used.assumed}

    # What is recorded -----------------------------------------------------------------------------

    def record(self, segment: TaskSegment, choice: Choice) -> None:
        """Record what a vector or link has shown of the node where it ends."""
        self.charged |= choice.shown
        if choice.is_trivial:
            # It follows from what was charged.
            self.cleared.add(segment.head)
            self.inherited.add(segment.head)
            return
        self.remember(segment.head, choice.mark)
        if any(one.code == "too_short_to_judge" for one in choice.mark.reasons):
            self.cleared.discard(segment.head)  # its direction was not judged
        drawn = self.evidence.vector(segment.name)
        is_laid_off = isinstance(self.task.construction.step(segment.head), Given)
        if is_laid_off and drawn is not None and drawn.direction_rad is None:
            self.by_length.add(segment.head)
        if choice.is_followed and choice.mark.is_full and not choice.adds_up:
            self.inherited.add(segment.head)

    def remember(self, name: str, mark: MarkRange) -> None:
        """Record whether something has cost points, is in doubt, or is right."""
        if not mark.is_certain:
            self.doubtful.add(name)
            opening = {reason.code for reason in mark.reasons} & OPENING
            if opening and opening <= BY_HAND:
                self.either.add(name)
        elif mark.share != FULL:
            self.charged.add(name)
        else:
            self.cleared.add(name)

    def decided(self, name: str, verdict: str) -> None:
        """Record the verdict on a vector, angular quantity or scale after all: a person's, or `review`."""
        node = self.forget(name)
        if verdict == "review":
            self.doubtful.add(node)
        elif verdict in CHARGED:
            self.charged.add(node)
        elif verdict in CREDITED:
            self.cleared.add(node)
        if verdict == "follow_through":
            self.inherited.add(node)

    def forget(self, name: str) -> str:
        """The node, quantity or scale of a name, of which nothing is recorded any more."""
        segment = self.task.segments.get(name)
        node = name if segment is None else segment.head
        for judged in (self.charged, self.cleared, self.by_length, self.inherited, self.doubtful):
            judged.discard(node)
        return node

    # What follows from it -------------------------------------------------------------------------

    def causes(self, one: Expectation) -> frozenset[str]:
        """The causes of what an expectation relies on, charged or not."""
        right = self.cleared - self.by_length
        nodes = {step.node for step in self.task.construction.steps}
        wrong, found = frozenset(self.charged | self.doubtful), set[str]()
        for name in one.relies_on - right:
            # Of a vector whose length was judged right only its sense is open.
            sense = name in self.by_length & self.cleared
            found |= self.following.causes_at(name, wrong, only_sense=sense) if name in nodes else {name}
        # A wrong step may have left one vector within its tolerance and show in another.
        return frozenset(found - right) | one.causes | (one.relies_on & self.charged)

    def is_wrong(self, one: Expectation) -> bool:
        """Return whether anything that an expectation relies on is wrong, or right only as it follows."""
        return bool(self.causes(one) or one.relies_on & self.inherited)

    def credited(self, one: Expectation, mark: MarkRange) -> tuple[MarkRange, frozenset[str]]:
        """The mark for what follows, if every mistake that it follows from has been charged.

        Else nothing, or an open mark where one of them is in doubt; and the first one not charged, if the
        mark shows it.
        """
        causes = self.causes(one)
        unpaid = causes - self.charged - self.either - self.inherited
        if unpaid:  # of a mistake made at several nodes one charge is enough
            found = self.following.explanation.repeated
            unpaid -= {node for nodes in found if nodes & self.charged for node in nodes}
        if not unpaid and not causes & self.doubtful & self.settled.keys():
            return mark, frozenset()
        if not unpaid or causes & (self.doubtful - self.either):
            return MarkRange(NONE, NONE, mark.best, mark.reasons, min(mark.sure, EVEN)), frozenset()
        # Scales and data come before nodes.
        order = {step.node: place for place, step in enumerate(self.task.construction.steps)}
        first = min(unpaid, key=lambda name: (order.get(name, -1), name))
        shown = frozenset({first} if mark.share > NONE else ())
        return MarkRange(NONE, NONE, NONE, mark.reasons, mark.sure), shown

    def is_known(self, segment: TaskSegment, mark: MarkRange) -> bool:
        """Return whether it is nearly certain which mistake was made in a vector."""
        # A force polygon is read by known mistakes: they confirm nothing that was read in doubt.
        is_doubtful = self._is_force(segment) and any(reason.code == "doubtful" for reason in mark.reasons)
        return segment.name in self.following.explanation.blamed and not is_doubtful

    def _is_force(self, segment: TaskSegment) -> bool:
        return bool(group_of(self.task.construction.figure_of(segment.head)))

    def opened(self, segment: TaskSegment, mark: MarkRange) -> MarkRange:
        """Return a mark; a loss on a sheet is open while one of its sources was not read for certain."""
        is_known = self._is_force(segment) and self.is_known(segment, mark)
        unknown = (() if is_known else self._unknown_upstream(segment)) + self._unread_beside(segment)
        if mark.share == FULL or not unknown:
            return mark
        self.charged.discard(segment.head)
        self.doubtful.add(segment.head)
        unread = Reason("unread", {"why": "upstream_unsure", "nodes": unknown})
        return replace(mark, best=FULL, reasons=(*mark.reasons, unread), sure=min(mark.sure, EVEN))

    def _unknown_upstream(self, segment: TaskSegment) -> tuple[str, ...]:
        """Return the unknown sources of a vector: its scale; nodes in doubt, of figures read, of forces.

        Known are nodes that were read (but not for a length computed from velocities in doubt), those from
        which a vector was made that is right, and those at which it is nearly certain what was done.
        """
        construction, nodes = self.task.construction, self.evidence.nodes
        scale = self.settled[segment.scale].mark
        is_unseen = scale is not None and any(reason.code == "unread" for reason in scale.reasons)
        read = {construction.figure_of(node) for node in nodes}
        read |= {figure for figure in construction.figures if group_of(figure)}
        step, explained = construction.step(segment.head), self.following.explanation.explained
        unread = [
            need
            for need in dict.fromkeys(step.needs)
            if need not in {*nodes, *self.charged, *self.cleared}
            and (need in self.doubtful or construction.figure_of(need) in read)
        ]
        if unread:
            right = self.cleared - self.by_length - self.charged - self.doubtful
            sure = construction.needed_for(right) | explained
            unread = [need for need in unread if need not in sure]
        if isinstance(step, Given) and isinstance(step.length, Normal | Coriolis):
            velocities = {one for one in step.length.needs if construction.figure_of(one) == VELOCITY_PLAN}
            unread += sorted(velocities & self.doubtful - self.either - explained - {*unread})
        return (*((segment.scale,) if is_unseen else ()), *unread)

    def _unread_beside(self, segment: TaskSegment) -> tuple[str, ...]:
        """Return the forces of the same polygon that were not read: one may be read as a part of another."""
        construction, following = self.task.construction, self.following
        polygon = construction.polygon_of(construction.figure_of(segment.head))
        return tuple(
            side.name
            for side in (polygon if self._is_force(segment) else ())
            if self.evidence.vector(side.name) is None
            and side.head not in following.explanation.explained
            and abs(self.task.segments[side.name].drawn(following.used)) >= SHORT_MM
        )

    def why(self, one: Expectation) -> tuple[Reason, ...]:
        """The reasons for an expectation: what it follows from, and whether its scale was assumed."""
        of = one.of
        if not of:
            # The last vector charged that it relies on, or the mechanism.
            blamed = (one.relies_on | one.causes) & (self.charged | self.doubtful)
            names = [v.name for v in self.task.construction.vectors.values() if v.head in blamed]
            of = names[-1] if names else "mechanism"
        is_assumed = one.what == "scale" and of in self.doubtful
        assumed = self.settled[of].reasons if is_assumed else ()
        return (*assumed, Reason("follows", {"what": one.what, "of": of}))
