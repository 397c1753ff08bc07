"""The data of submissions that are compared between students: nodes, entered values, scales."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from grader.documents import ReportDocument
from grader.records import FloatArray
from grader.tables.measurements import Measurements
from reference.authored.assignment import Assignment, Scales, Variant
from reference.authored.variant_table import KEYS
from reference.construction.uncertainty import Skill
from reference.geometry import ComplexArray
from reference.plan import exact_plan

Nodes = Mapping[str, Mapping[str, complex]]
"""By figure and name, x - i y in sheet millimetres."""
UNKNOWN = complex(np.nan, np.nan)
FITS_MM = 2.0
"""RMS distance (mm) from a variant's exact figures up to which a drawing may be of that variant."""
FITS_BETTER = 0.5
"""Largest ratio of that distance to the one from the student's own variant."""
LEAST_NODES = 6
"""A drawing of fewer nodes is not compared with other variants."""
USUAL = Skill(angle_deg=0.3, place_mm=0.3, mark_mm=0.15)
"""Drafting errors of a usual student, and of reading the marks."""


@dataclass(frozen=True, slots=True)
class ComparedSubmission:
    """One student's submission for one position.

    Attributes
    ----------
    sheets : the nodes read on each sheet
    numbers : entered lengths (mm), ``NAME_deg`` directions and ``NAME_value`` SI values
    used : scales used for marking, real units per millimetre; empty if marking did not happen
    fits : the variant drawn instead, according to the diagnosis, with its confidence, or None
    printed : whether it is drawn on printed answer sheets, which have a cross for each pole
    excused : nodes and vectors at which a mistake was named: residuals there are no drafting errors
    """

    student_id: str
    variant: Variant
    sheets: tuple[Nodes, ...] = ()
    numbers: Mapping[str, float] = field(default_factory=dict)
    used: Mapping[str, float] = field(default_factory=dict)
    fits: tuple[Variant, float] | None = None
    excused: frozenset[str] = frozenset()
    printed: bool = False


def compared_submission(
    report: ReportDocument, variant: Variant, measured: Measurements | None
) -> ComparedSubmission:
    """Return the data of a marked submission."""
    return ComparedSubmission(
        student_id=report.student_id,
        variant=variant,
        sheets=tuple(
            {
                figure: {name: complex(node.x_mm, -node.y_mm) for name, node in read.nodes.items()}
                for figure, read in sheet.figures.items()
            }
            for sheet in report.reading.sheets
            if sheet.figures
        ),
        numbers={} if measured is None else measured.numbers,
        used={name: scale.used for name, scale in report.scales.items() if scale.used},
        fits=_fits(variant, report),
        excused=frozenset(mistake.at for mistake in report.mistakes),
        printed=any(
            read.sheet is not None and read.sheet.method == "markers" for read in report.reading.sheets
        ),
    )


def _fits(variant: Variant, report: ReportDocument) -> tuple[Variant, float] | None:
    """Return the other variant that the diagnosis names, and its confidence; None without one."""
    for mistake in report.mistakes:
        if mistake.code == "other_variant":
            known = ((name, mistake.parameters.get(name)) for name in KEYS)
            drawn = replace(variant, **{name: value for name, value in known if isinstance(value, int)})
            return (drawn, mistake.confidence) if drawn != variant else None
    return None


@dataclass(frozen=True, slots=True)
class Drawn:
    """The nodes of one figure in all submissions.

    Attributes
    ----------
    names : (nodes,)
    at : (students, nodes) x - i y in sheet millimetres, nan if not read
    sheet : (students,) index of the sheet with the figure, -1 if there was none
    """

    names: tuple[str, ...]
    at: ComplexArray
    sheet: np.ndarray


def drawn_of(
    submissions: Sequence[ComparedSubmission], nodes: Mapping[str, Sequence[str]]
) -> dict[str, Drawn]:
    """Return each figure's nodes from the sheet with most of them; a student may hand in two sketches."""
    drawn = {}
    for figure, names in nodes.items():
        chosen = [_fullest(each, figure) for each in submissions]
        at = [
            [UNKNOWN if k < 0 else each.sheets[k][figure].get(name, UNKNOWN) for name in names]
            for each, k in zip(submissions, chosen, strict=True)
        ]
        drawn[figure] = Drawn(tuple(names), np.array(at).reshape(len(submissions), -1), np.array(chosen))
    return drawn


def _fullest(submission: ComparedSubmission, figure: str) -> int:
    having = [k for k, sheet in enumerate(submission.sheets) if figure in sheet]
    return max(having, key=lambda k: len(submission.sheets[k][figure]), default=-1)


def fitting(
    assignment: Assignment, submissions: Sequence[ComparedSubmission], drawn: Mapping[str, Drawn]
) -> list[tuple[Variant, float] | None]:
    """Return for each student another variant of the class that the drawing fits, and the residual in mm."""
    variants = list(dict.fromkeys(each.variant for each in submissions))
    plan = exact_plan(assignment, variants)
    square, count = np.zeros((len(submissions), len(variants))), np.zeros((len(submissions), 1))
    for figure, nodes in drawn.items():
        exact = [np.broadcast_to(plan.nodes_mm[figure][name], len(variants)) for name in nodes.names]
        known = np.isfinite(nodes.at)
        square += _misfit(np.where(known, nodes.at, 0.0), known, np.array(exact).T)
        count += known.sum(axis=1, keepdims=True)
    residual = np.sqrt(square / np.maximum(count, 1.0))
    students = np.arange(len(submissions))
    own = residual[students, [variants.index(each.variant) for each in submissions]]
    best = residual.argmin(axis=1)
    least = residual[students, best]
    fits = (count[:, 0] >= LEAST_NODES) & (least < FITS_MM) & (least < FITS_BETTER * own)
    return [(variants[k], float(mm)) if good else None for k, mm, good in zip(best, least, fits, strict=True)]


def _misfit(at: ComplexArray, known: np.ndarray, exact: ComplexArray) -> FloatArray:
    """Return (students, variants) sums of squares, mm^2, of figures moved and scaled onto exact ones."""
    weight = known.astype(np.float64)
    count = np.maximum(weight.sum(axis=1), 1.0)
    sum_at, sum_exact = at.sum(axis=1), weight @ exact.T
    spread = (np.abs(at) ** 2).sum(axis=1) - np.abs(sum_at) ** 2 / count
    sizes = weight @ (np.abs(exact) ** 2).T - np.abs(sum_exact) ** 2 / count[:, None]
    joint = at @ exact.conj().T - sum_at[:, None] * sum_exact.conj() / count[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        explained = np.nan_to_num(np.abs(joint) ** 2 / sizes)
    return np.asarray(np.maximum(spread[:, None] - explained, 0.0))


def scales_used(
    assignment: Assignment, submissions: Sequence[ComparedSubmission], variants: list[Variant]
) -> Scales:
    """Return the scales used for marking each submission, (submissions,); the proposed ones if unknown."""
    proposed = assignment.scales(variants)
    scales = {
        name: [each.used.get(name, usual) for each, usual in zip(submissions, values, strict=True)]
        for name, values in proposed.by_name.items()
    }
    return Scales(**{name: np.array(values) for name, values in scales.items()})
