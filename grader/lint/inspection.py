"""The inspection as a whole: every variant at once, a row of figures for each, all findings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.lint.broken import Broken, broken_findings, broken_variants
from grader.lint.conditions import (
    LEAST_CROSSING_DEG,
    LEAST_TRANSMISSION,
    Conditions,
    condition_findings,
    conditions_of,
)
from grader.lint.data import data_findings
from grader.lint.findings import SEVERITIES, LintFinding
from grader.lint.lengths import WELL_READ_MM, Asked, asked_vectors, length_findings
from grader.lint.room import PageRoom, extents_of, pages_of, room_findings, room_of
from grader.lint.scales import Proposal, proposals, scale_findings
from grader.lint.ties import tie_findings, ties_of
from grader.rubric import RubricFile
from reference.assignment import Assignment, Variant
from reference.derivation import construction_of
from reference.geometry import FloatArray
from reference.plan import Plan, exact_plan


@dataclass(frozen=True, slots=True)
class Least:
    """The least of several figures, and whose it is (a joint, a node, a vector, a drawing)."""

    value: float
    at: str


@dataclass(frozen=True, slots=True)
class Row:
    """One variant's figures; `problem` says why there are none.

    Attributes
    ----------
    transmission : least |sin| of a transmission angle
    crossing_deg : least angle at which construction lines meet
    shortest_mm : the shortest asked vector as drawn at the proposed scales, zero vectors apart
    short : how many asked vectors are under 8 mm
    room : how many times as large the tightest figure could be drawn in its zone
    error : predicted relative error of the computed plan
    """

    variant: Variant
    problem: str | None = None
    transmission: Least | None = None
    crossing_deg: Least | None = None
    shortest_mm: Least | None = None
    short: int = 0
    room: Least | None = None
    error: float | None = None


@dataclass(frozen=True, slots=True)
class Worst:
    """The variant that is hardest to draw: its index in the plan, and why."""

    index: int
    why: str


@dataclass(frozen=True, slots=True)
class Lint:
    """What lint found.

    Attributes
    ----------
    rows : one for every variant
    findings : the gravest first
    scales : the proposed ones, and round ones; none where no variant can be solved
    plan : of the variants that can be solved
    worst : of those; None where there are none
    """

    assignment: Assignment
    rows: tuple[Row, ...]
    findings: tuple[LintFinding, ...]
    scales: tuple[Proposal, ...] = ()
    plan: Plan | None = None
    worst: Worst | None = None

    @property
    def needs_a_person(self) -> bool:
        """Whether there is more than hints."""
        return any(finding.severity != "hint" for finding in self.findings)


def lint(assignment: Assignment, rubric: RubricFile) -> Lint:
    """Hold an assignment and its rubric against every variant.

    Everything is evaluated on arrays over the variants; those that cannot be solved are left out of the
    rest, and only they are looked at one by one.
    """
    variants = assignment.variants()
    accelerations = rubric.needs_accelerations or any(
        "acceleration_plan" in page.figures for page in assignment.file.page
    )
    construction = construction_of(
        assignment.mechanism(variants),
        accelerations=accelerations,
        plate_by_similarity=assignment.file.plate_images == "similarity",
    )
    broken = broken_variants(assignment, variants)
    findings = [*broken_findings(assignment, broken), *data_findings(assignment, rubric, construction)]
    without = {one.variant for one in broken}
    sound = [variant for variant in variants if variant not in without]
    if not sound:
        return Lint(assignment, tuple(_row_of(one) for one in broken), _sorted(findings))
    plan = exact_plan(assignment, sound, accelerations=accelerations)
    return _inspected(assignment, rubric, plan, broken, findings)


def _inspected(
    assignment: Assignment,
    rubric: RubricFile,
    plan: Plan,
    broken: Sequence[Broken],
    findings: list[LintFinding],
) -> Lint:
    conditions, asked, extents = conditions_of(plan), asked_vectors(rubric, plan), extents_of(plan)
    rooms = {index: room_of(figures, extents) for index, figures in pages_of(assignment, plan)}
    scales = proposals(assignment, plan, extents, asked, rooms)
    found = [
        *findings,
        *condition_findings(assignment, plan, conditions),
        *length_findings(rubric, plan, asked),
        *room_findings(assignment, plan, rooms),
        *tie_findings(plan, ties_of(rubric, plan, asked)),
        *scale_findings(assignment, plan, scales),
    ]
    rows = {row.variant: row for row in _rows(plan, conditions, asked, rooms)}
    rows |= {one.variant: _row_of(one) for one in broken}
    ordered = tuple(rows[variant] for variant in assignment.variants())
    worst = _worst([rows[variant] for variant in plan.variants])
    return Lint(assignment, ordered, _sorted(found), tuple(scales), plan, worst)


def _sorted(findings: Sequence[LintFinding]) -> tuple[LintFinding, ...]:
    return tuple(sorted(findings, key=lambda finding: SEVERITIES.index(finding.severity)))


def _row_of(broken: Broken) -> Row:
    return Row(broken.variant, broken.message)


def _rows(plan: Plan, conditions: Conditions, asked: Asked, rooms: Mapping[int, PageRoom]) -> list[Row]:
    count = len(plan.variants)
    lengths = {
        name: np.where(asked.is_zero[row], np.inf, asked.length_mm[row])
        for row, name in enumerate(asked.names)
    }
    zones = {
        f"{figure.replace('_', ' ')} on page {index + 1}": room
        for index, page in rooms.items()
        for figure, room in page.zones.items()
    }
    transmission, crossing = _least(conditions.transmission, count), _least(conditions.crossing_deg, count)
    shortest, room = _least(lengths, count), _least(zones, count)
    short = asked.short(WELL_READ_MM).sum(axis=0) if asked.names else np.zeros(count, dtype=int)
    figures = zip(
        transmission, crossing, shortest, short.tolist(), room, conditions.error.tolist(), strict=True
    )
    return [Row(variant, None, *told) for variant, told in zip(plan.variants, figures, strict=True)]


def _least(figures: Mapping[str, FloatArray], count: int) -> list[Least | None]:
    """The least of several arrays for each variant; None where there is none that is finite."""
    if not figures:
        return [None] * count
    names, values = list(figures), np.stack([np.broadcast_to(one, (count,)) for one in figures.values()])
    which = np.argmin(values, axis=0)
    least = values[which, np.arange(count)]
    return [
        Least(float(value), names[index]) if np.isfinite(value) else None
        for value, index in zip(least, which, strict=True)
    ]


def _worst(rows: Sequence[Row]) -> Worst:
    """The variant that is hardest to draw: badly conditioned before too large before too short."""

    def least(name: str) -> tuple[int, Least] | None:
        known = [(index, figure) for index, row in enumerate(rows) if (figure := getattr(row, name))]
        return min(known, key=lambda one: one[1].value, default=None)

    for name, limit, told in (
        ("transmission", LEAST_TRANSMISSION, "the sine of the transmission angle at {at} is {value:.2g}"),
        ("crossing_deg", LEAST_CROSSING_DEG, "the construction lines of {at} meet at {value:.1f} degrees"),
        ("room", 1.0, "the {at} would fit its zone at only {value:.2f} of its size"),
        ("shortest_mm", np.inf, "{at} is the shortest vector asked for, {value:.2g} mm"),
        (
            "crossing_deg",
            np.inf,
            "the construction lines of {at} meet at {value:.1f} degrees, the least of all",
        ),
    ):
        found = least(name)
        if found is not None and found[1].value < limit:
            return Worst(found[0], told.format(at=found[1].at, value=found[1].value))
    return Worst(0, "all are alike")
