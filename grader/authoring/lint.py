"""An assignment and its rubric held against every variant at once, before students get it.

A row of figures for each variant, all findings, and the JSON document of both.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel

from grader.authoring.findings import SEVERITIES, LintFinding, mechanism_place
from grader.authoring.round_scales import (
    SCALE_OF,
    WELL_READ_MM,
    AskedVectors,
    PageRoom,
    Proposal,
    asked_vectors,
    extents_of,
    length_findings,
    pages_of,
    proposals,
    room_findings,
    room_of,
    scale_findings,
)
from grader.authoring.variant_checks import (
    LEAST_CROSSING_DEG,
    LEAST_TRANSMISSION,
    Broken,
    Conditions,
    broken_findings,
    broken_variants,
    condition_findings,
    conditions_of,
    tie_findings,
    ties_of,
)
from grader.documents import (
    LintDocument,
    LintFindingDocument,
    LintLeast,
    LintScales,
    LintVariant,
    LintWorst,
    VariantDocument,
)
from grader.rubric import RubricFile, check_rubric
from reference.assignment import Assignment, Variant
from reference.assignment_file import TRADITIONS
from reference.construction import Construction, ancestors
from reference.derivation import construction_of
from reference.draft import image_name
from reference.formula import Formula
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
    return Row(broken.variant, broken.error.message)


def _rows(
    plan: Plan, conditions: Conditions, asked: AskedVectors, rooms: Mapping[int, PageRoom]
) -> list[Row]:
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


# Names in the files: unknown, unused, not told to the student -------------------------------------


def formulas_in(thing: object) -> Iterator[Formula]:
    """Every formula of an authored table, however deep."""
    if isinstance(thing, Formula):
        yield thing
    elif isinstance(thing, BaseModel):
        for name in type(thing).model_fields:
            yield from formulas_in(getattr(thing, name))
    elif isinstance(thing, dict):
        for value in thing.values():
            yield from formulas_in(value)
    elif isinstance(thing, list | tuple):
        for value in thing:
            yield from formulas_in(value)


def names_in(thing: object) -> set[str]:
    """The names that the formulas of a table need."""
    return {name for formula in formulas_in(thing) for name in formula.names}


def data_findings(
    assignment: Assignment, rubric: RubricFile, construction: Construction
) -> Iterator[LintFinding]:
    """Rubric and assignment against the construction: names unknown, unused, twice, not told."""
    yield from _rubric_faults(rubric, construction)
    yield from _unused_values(assignment)
    yield from _not_told(assignment)
    yield from _unknown_names(assignment, construction)
    yield from _unneeded(assignment, rubric, construction)


def _rubric_faults(rubric: RubricFile, construction: Construction) -> Iterator[LintFinding]:
    for fault in check_rubric(rubric, construction):
        yield LintFinding("fault", "unknown_in_rubric", "rubric", fault.path, fault.message)
    seen: dict[str, str] = {}
    for index, criterion in enumerate(rubric.criterion):
        if criterion.name in seen:
            told = f"{criterion.name} is judged by {seen[criterion.name]} already"
            yield LintFinding("hint", "asked_twice", "rubric", f"$.criterion[{index}]", told)
        seen.setdefault(criterion.name, criterion.id)


def _with_their_own(assignment: Assignment, names: Iterable[str]) -> set[str]:
    """Names, and the names that their formulas are made of."""
    values = assignment.file.variant.values
    found, waiting = set(), list(names)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(values[name].names if name in values else ())
    return found


def _unused_values(assignment: Assignment) -> Iterator[LintFinding]:
    file = assignment.file
    outside = names_in(assignment.mechanism_file) | names_in(file.scales) | names_in(file.given)
    needed = _with_their_own(assignment, outside)
    for name in file.variant.values:
        if name not in needed:
            path = f"$.variant.values.{name}"
            yield LintFinding("hint", "unused", "assignment", path, "no formula uses this value")
    drawn = _with_their_own(assignment, names_in(assignment.mechanism_file))
    for name in ("n", "position"):
        if getattr(file.variant, name) is not None and name not in drawn:
            told = f"the mechanism does not depend on {name}: every student has the same"
            yield LintFinding("warning", "same_for_all", "assignment", f"$.variant.{name}", told)


def _not_told(assignment: Assignment) -> Iterator[LintFinding]:
    """Data that differ between students and set the mechanism, but that no [[given]] tells them."""
    values, given = assignment.file.variant.values, assignment.file.given
    told = names_in(given)

    def is_told(name: str) -> bool:
        if name in told or name not in values:
            # A number that stands in the mechanism itself is told where a formula with it is: 45*position.
            return name in told
        own = values[name].names
        return not own or all(is_told(one) for one in own)

    missing = [name for name in sorted(names_in(assignment.mechanism_file)) if not is_told(name)]
    if missing:
        message = f"{', '.join(missing)}: sets the mechanism, and no [[given]] tells it to the student"
        yield LintFinding("hint", "not_told", "assignment", "$.given", message)


def _unknown_names(assignment: Assignment, construction: Construction) -> Iterator[LintFinding]:
    known = {step.node for step in construction.steps} | construction.vectors.keys()
    known |= construction.rates.keys() | set(SCALE_OF.values())
    known |= TRADITIONS.get(assignment.file.tradition, {}).keys()
    for name in assignment.file.names:
        if name not in known:
            told = "is neither a node nor a vector nor a scale of this assignment"
            yield LintFinding("hint", "unused", "assignment", f'$.names."{name}"', told)


def _unneeded(
    assignment: Assignment, rubric: RubricFile, construction: Construction
) -> Iterator[LintFinding]:
    """Joints and figures that nothing asked for depends on."""
    asked = [construction.vectors[name] for name in rubric.vectors if name in construction.vectors]
    asked += [
        construction.vectors[construction.rates[name].vector]
        for name in (criterion.angular for criterion in rubric.criterion)
        if name is not None and name in construction.rates
    ]
    if not asked:
        told = "asks for no vector: only what is declared can be marked"
        yield LintFinding("hint", "no_vector_asked", "rubric", "$.criterion", told)
        return
    needed = ancestors(construction, {end for vector in asked for end in (vector.tail, vector.head)})
    for index, table in enumerate(assignment.mechanism_file.group):
        joint = table.node
        if needed.isdisjoint({joint, image_name(joint), image_name(joint, primed=True)}):
            told = f"nothing that the rubric asks for depends on {joint}"
            yield LintFinding("hint", "unused", *mechanism_place(assignment, f".group[{index}]"), told)
    figures = {construction.figure_of(vector.head) for vector in asked}
    for index, page in enumerate(assignment.file.page):
        for figure in page.figures:
            if figure != "mechanism" and figure not in figures:
                told = f"the rubric asks for nothing in the {figure.replace('_', ' ')}"
                yield LintFinding("hint", "unused", "assignment", f"$.page[{index}].figures", told)


# JSON document ------------------------------------------------------------------------------------


def lint_document(result: Lint) -> LintDocument:
    """The document of `planmark lint --json`."""
    worst = None
    if result.worst is not None and result.plan is not None:
        worst = LintWorst(**_variant(result.plan.variants[result.worst.index]), why=result.worst.why)
    return LintDocument(
        assignment=result.assignment.id,
        needs_a_person=result.needs_a_person,
        findings=[
            LintFindingDocument(
                severity=finding.severity,
                code=finding.code,
                file=finding.file,
                path=finding.path,
                message=finding.message,
                variants=[VariantDocument(**_variant(variant)) for variant in finding.variants],
            )
            for finding in result.findings
        ],
        variants=[_row(row) for row in result.rows],
        scales=[_scales(proposal) for proposal in result.scales],
        worst=worst,
    )


def _variant(variant: Variant) -> dict[str, int | None]:
    return {"n": variant.n, "position": variant.position}


def _row(row: Row) -> LintVariant:
    return LintVariant(
        n=row.variant.n,
        position=row.variant.position,
        assembles=row.problem is None,
        problem=row.problem,
        transmission=_least_document(row.transmission),
        crossing_deg=_least_document(row.crossing_deg),
        shortest_mm=_least_document(row.shortest_mm),
        under_8_mm=row.short,
        room=_least_document(row.room),
        predicted_error=row.error,
    )


def _least_document(figure: Least | None) -> LintLeast | None:
    return None if figure is None else LintLeast(value=figure.value, at=figure.at)


def _scales(proposal: Proposal) -> LintScales:
    return LintScales(
        name=proposal.name,
        kL=_ends(proposal.scales.kL),
        kv=_ends(proposal.scales.kv),
        ka=_ends(proposal.scales.ka),
        room=proposal.room,
        shortest_mm=None
        if proposal.shortest_mm is None
        else LintLeast(value=proposal.shortest_mm, at=proposal.shortest),
        under_8_mm=proposal.under_8_mm,
        asked=proposal.asked,
        shortest_link_mm=proposal.link_mm,
    )


def _ends(values: FloatArray) -> tuple[float, float]:
    return float(np.min(values)), float(np.max(values))
