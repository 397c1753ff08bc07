"""An assignment and its rubric held against every variant, before students get it."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from grader.answer_sheet.fit import best_template
from grader.rubric import RubricFile, check_rubric
from reference.assignment import Assignment, Variant
from reference.derivation import construction_of
from reference.errors import Finding, MechanismError
from reference.plan import Plan, conditioning, exact_plan

LEAST_TRANSMISSION = 0.25
"""|sin| of a transmission angle of about 15 degrees: below it, plans are hard to draw."""
LEAST_CROSSING_DEG = 20.0
"""Construction lines that meet at less are hard to intersect by hand."""
NAMED = 5

BoolArray = NDArray[np.bool_]


def lint(assignment: Assignment, rubric: RubricFile) -> list[Finding]:
    """Everything that a teacher should know: assembly, conditioning, short vectors, sheets too small."""
    construction = construction_of(assignment.mechanism(assignment.variants()[:1]))
    findings = check_rubric(rubric, construction)
    broken = list(_broken(assignment))
    sound = [variant for variant in assignment.variants() if variant not in {one for one, _ in broken}]
    findings += [Finding("$.mechanism", f"{variant}: {told}") for variant, told in broken]
    if not sound:
        return findings
    plan = exact_plan(assignment, sound)
    findings += _conditioning(plan)
    findings += _short_vectors(plan, rubric)
    if not broken:
        findings += _too_large(assignment)
    return findings


def _broken(assignment: Assignment) -> Iterator[tuple[Variant, str]]:
    """Variants that do not assemble, each with why."""
    try:
        exact_plan(assignment, assignment.variants())
    except MechanismError:
        for variant in assignment.variants():
            try:
                exact_plan(assignment, [variant])
            except MechanismError as error:
                yield variant, error.message


def _conditioning(plan: Plan) -> Iterator[Finding]:
    for name, values in conditioning(plan).items():
        kind, _, node = name.partition(" ")
        if kind == "transmission":
            weak = values < LEAST_TRANSMISSION
            if np.any(weak):
                told = f"near a singular position: the sine of the transmission angle at {node} falls to"
                yield Finding("$.mechanism", f"{told} {np.min(values):.2g} ({_named(plan, weak)})")
        elif kind == "crossing":
            flat = values < LEAST_CROSSING_DEG
            if np.any(flat):
                told = f"the construction lines of {node} meet at only {np.min(values):.1f} degrees"
                yield Finding("$.mechanism", f"{told} ({_named(plan, flat)})")


def _short_vectors(plan: Plan, rubric: RubricFile) -> Iterator[Finding]:
    """Vectors asked for that are too short, at the proposed scales, to have a direction."""
    for index, criterion in enumerate(rubric.criterion):
        if criterion.vector is None or criterion.vector not in plan.construction.vectors:
            continue
        least = rubric.tolerance_of(criterion).least_mm
        length = np.abs(plan.drawn_mm(criterion.vector))
        short = length < least
        if np.any(short):
            told = f"{criterion.vector} is shorter than {least:g} mm at the proposed scales, down to"
            yield Finding(
                f"rubric $.criterion[{index}]", f"{told} {np.min(length):.2g} mm ({_named(plan, short)})"
            )


def _too_large(assignment: Assignment) -> Iterator[Finding]:
    for index, page in enumerate(assignment.file.page):
        fit = best_template(assignment, page.figures)
        for figure, room in fit.room.items():
            if room < 1.0:
                told = f"the {figure.replace('_', ' ')} does not fit its zone on A3 at the proposed scales"
                yield Finding(f"$.page[{index}]", f"{told}: it fits at {room:.2f} of that size")


def _named(plan: Plan, which: BoolArray) -> str:
    """The variants meant, the first of many by name."""
    chosen: Sequence[Variant] = [one for one, is_so in zip(plan.variants, which, strict=True) if is_so]
    told = "; ".join(str(variant) for variant in chosen[:NAMED])
    more = len(chosen) - NAMED
    return f"{told} and {more} more of {len(plan.variants)}" if more > 0 else told
