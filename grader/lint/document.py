"""What lint found, as a JSON document."""

import numpy as np

from grader.documents import (
    LintDocument,
    LintFindingDocument,
    LintLeast,
    LintScales,
    LintVariant,
    LintWorst,
    VariantDocument,
)
from grader.lint.inspection import Least, Lint, Row
from grader.lint.scales import Proposal
from reference.assignment import Variant
from reference.geometry import FloatArray


def lint_document(found: Lint) -> LintDocument:
    """The document of `planmark lint --json`."""
    worst = None
    if found.worst is not None and found.plan is not None:
        worst = LintWorst(**_variant(found.plan.variants[found.worst.index]), why=found.worst.why)
    return LintDocument(
        assignment=found.assignment.id,
        needs_a_person=found.needs_a_person,
        findings=[
            LintFindingDocument(
                severity=finding.severity,
                code=finding.code,
                file=finding.file,
                path=finding.path,
                message=finding.message,
                variants=[VariantDocument(**_variant(variant)) for variant in finding.variants],
            )
            for finding in found.findings
        ],
        variants=[_row(row) for row in found.rows],
        scales=[_scales(one) for one in found.scales],
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
        transmission=_least(row.transmission),
        crossing_deg=_least(row.crossing_deg),
        shortest_mm=_least(row.shortest_mm),
        under_8_mm=row.short,
        room=_least(row.room),
        predicted_error=row.error,
    )


def _least(figure: Least | None) -> LintLeast | None:
    return None if figure is None else LintLeast(value=figure.value, at=figure.at)


def _scales(one: Proposal) -> LintScales:
    return LintScales(
        name=one.name,
        kL=_ends(one.scales.kL),
        kv=_ends(one.scales.kv),
        ka=_ends(one.scales.ka),
        room=one.room,
        shortest_mm=None if one.shortest_mm is None else LintLeast(value=one.shortest_mm, at=one.shortest),
        under_8_mm=one.under_8_mm,
        asked=one.asked,
        shortest_link_mm=one.link_mm,
    )


def _ends(values: FloatArray) -> tuple[float, float]:
    return float(np.min(values)), float(np.max(values))
