"""Check an assignment and its rubric against every variant at once, before students get it.

The result has a row of figures for each variant, all findings, and the JSON document of both.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from grader.authoring.findings import SEVERITIES, File, LintFinding, first_of, mechanism_place
from grader.authoring.round_scales import (
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
    Conditions,
    assembly_findings,
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
    LintVariant,
    LintWorst,
    VariantDocument,
)
from grader.language import LANGUAGES, Tongue
from grader.records import Reason
from grader.rubric import RubricFile, check_accelerations, check_rubric, plans_asked
from grader.texts.spoken import ENGLISH, as_json, at_terminal, clause
from reference.authored.assignment import SCALE_NAMES, TRADITIONS, Assignment, Variant, file_kind
from reference.authored.formula import Formula
from reference.authored.toml_file import LENGTH_UNITS_M, SideText, Text
from reference.authored.variant_table import KEYS, LENGTHS, formulas_in
from reference.construction.draft import image_name
from reference.construction.graph import Construction, ancestors
from reference.errors import AuthoredFileError, Parameter
from reference.geometry import FloatArray
from reference.plan import Plan, construction_for, exact_plan

ODD_RATIO = 200.0
"""Largest ratio of the longest link to another: no drawing shows both, and metres are a thousand mm."""
SMALLEST_M, LARGEST_M = 0.002, 50.0
"""Smallest and largest link: between a watch and a crane."""


@dataclass(frozen=True, slots=True)
class Lint:
    """The result of lint.

    Attributes
    ----------
    rows : the figures of every variant
    findings : the gravest first
    scales : the proposed ones, and round ones; none if no variant can be solved
    plan : of the variants that can be solved
    worst : the variant of those that is hardest to draw, and why; None if there are none
    """

    assignment: Assignment
    rows: tuple[LintVariant, ...]
    findings: tuple[LintFinding, ...]
    scales: tuple[Proposal, ...] = ()
    plan: Plan | None = None
    worst: tuple[Variant, Reason] | None = None

    @property
    def needs_a_person(self) -> bool:
        """True if there are findings graver than hints."""
        return any(finding.severity != "hint" for finding in self.findings)


def lint(assignment: Assignment, rubric: RubricFile, speaker: Tongue = ENGLISH) -> Lint:
    """Check an assignment and its rubric against every variant.

    Everything is evaluated on arrays over the variants; those that cannot be solved are excluded, and only
    these are examined one by one, and told in the language of `speaker`.
    """
    variants = assignment.variants()
    needed = plans_asked(assignment, rubric)
    needed["accelerations"] |= "acceleration_plan" in assignment.figures
    construction = construction_for(assignment, variants, **needed)
    broken = broken_variants(assignment, variants)
    findings = [*broken_findings(assignment, broken), *_odd_sizes(assignment)]
    findings += data_findings(assignment, rubric, construction)
    rows = {variant: _row(variant, problem=at_terminal(error, speaker)) for variant, error in broken.items()}
    sound = [variant for variant in variants if variant not in rows]
    if not sound:
        return Lint(assignment, tuple(rows.values()), _sorted(findings))
    plan = exact_plan(assignment, sound, **needed)
    conditions, asked, extents = conditions_of(plan), asked_vectors(rubric, plan), extents_of(plan)
    rooms = {
        index: room_of(figures, extents, assignment.file.page[index].grid)
        for index, figures in pages_of(assignment, plan)
    }
    scales = proposals(assignment, plan, extents, asked, rooms)
    findings += [
        *assembly_findings(assignment, sound),
        *condition_findings(assignment, plan, conditions),
        *length_findings(rubric, plan, asked),
        *room_findings(assignment, plan, asked, rooms),
        *tie_findings(plan, ties_of(rubric, plan, asked)),
        *scale_findings(assignment, plan, scales),
        *_told_results(assignment, rubric, plan),
    ]
    solved = _rows(plan, conditions, asked, rooms)
    rows |= dict(zip(sound, solved, strict=True))
    ordered = tuple(rows[variant] for variant in variants)
    return Lint(assignment, ordered, _sorted(findings), tuple(scales), plan, _worst(solved))


def _sorted(findings: Sequence[LintFinding]) -> tuple[LintFinding, ...]:
    return tuple(sorted(findings, key=lambda finding: SEVERITIES.index(finding.severity)))


def _numbers(variant: Variant | LintVariant) -> dict[str, int | None]:
    return {"n": variant.n, "position": variant.position}


def _row(variant: Variant, problem: str | None = None, **figures: Any) -> LintVariant:  # noqa: ANN401
    """Return one variant's figures; none if it cannot be solved."""
    row: dict[str, Any] = dict.fromkeys(LintVariant.model_fields)
    row |= {**_numbers(variant), "assembles": problem is None, "problem": problem, "under_8_mm": 0}
    return LintVariant.model_validate(row | figures)


def _rows(
    plan: Plan, conditions: Conditions, asked: AskedVectors, rooms: Mapping[int, PageRoom]
) -> list[LintVariant]:
    """Return the figures of each variant of a plan."""
    count = len(plan.variants)
    lengths = {
        name: np.where(asked.is_zero[row], np.inf, asked.length_mm[row])
        for row, name in enumerate(asked.names)
    }
    zones, pages = {}, {}
    for index, page in rooms.items():
        for figure, room in page.zones.items():
            name = f"{figure.replace('_', ' ')} on page {index + 1}"
            zones[name], pages[name] = room, index + 1
    transmission, crossing = _least(conditions.transmission, count), _least(conditions.crossing_deg, count)
    shortest, least_room = _least(lengths, count), _least(zones, count, **pages)
    short = asked.short(WELL_READ_MM).sum(axis=0) if asked.names else np.zeros(count, dtype=int)
    return [
        _row(
            variant,
            transmission=transmission[index],
            crossing_deg=crossing[index],
            shortest_mm=shortest[index],
            under_8_mm=int(short[index]),
            room=least_room[index],
            predicted_error=float(conditions.error[index]),
        )
        for index, variant in enumerate(plan.variants)
    ]


def _least(figures: Mapping[str, FloatArray], count: int, **pages: int) -> list[LintLeast | None]:
    """Return the least of several arrays for each variant, on `pages` by name; None if none is finite."""
    if not figures:
        return [None] * count
    names, values = list(figures), np.stack([np.broadcast_to(each, (count,)) for each in figures.values()])
    which = np.argmin(values, axis=0)
    least = values[which, np.arange(count)]
    return [
        LintLeast(value=value, at=at, page=pages.get(at)) if np.isfinite(value) else None
        for value, at in zip(least.tolist(), (names[index] for index in which), strict=True)
    ]


_REASONS = (
    ("transmission", LEAST_TRANSMISSION, "worst_transmission", "least_number"),
    ("crossing_deg", LEAST_CROSSING_DEG, "worst_crossing", "angle_deg"),
    ("room", 1.0, "worst_room", "size_number"),
    ("shortest_mm", np.inf, "worst_shortest", "length_number"),
    ("crossing_deg", np.inf, "worst_crossing", "angle_deg"),
)
"""Figures of a row, the limit below which each makes a variant hard to draw, the code of the reason and the
parameter that holds the figure; the gravest first."""


def _worst(rows: Sequence[LintVariant]) -> tuple[Variant, Reason]:
    """Return the variant that is hardest to draw: badly conditioned before too large before too short."""
    for name, limit, code, figure in _REASONS:
        known = [(least, row) for row in rows if (least := getattr(row, name)) is not None]
        least, row = min(known, key=lambda entry: entry[0].value, default=(None, rows[0]))
        if least is not None and least.value < limit:
            told: dict[str, Parameter] = {"name": least.at, figure: least.value}
            if least.page is not None:
                told["page"] = least.page
            return Variant(row.n, row.position), Reason(code, told)
    return Variant(rows[0].n, rows[0].position), Reason("worst_none")


# Names in the files: unknown, unused, not told to the student -------------------------------------


def names_in(thing: object) -> set[str]:
    """Return the names that the formulas of an authored table need, at any depth."""
    leaves = (leaf.side if isinstance(leaf, SideText) else leaf for _, _, leaf in formulas_in(thing, ""))
    return {name for leaf in leaves if isinstance(leaf, Formula) for name in leaf.names}


def data_findings(
    assignment: Assignment, rubric: RubricFile, construction: Construction
) -> Iterator[LintFinding]:
    """Report names in rubric and assignment that are unknown, unused, repeated, or not given to students."""
    yield from _rubric_faults(assignment, rubric, construction)
    yield from _unused_values(assignment)
    yield from _not_told(assignment)
    yield from _unknown_names(assignment, construction)
    yield from _unneeded(assignment, rubric, construction)
    yield from _untranslated(assignment, rubric)


def texts_in(thing: object, path: str) -> Iterator[tuple[str, Text]]:
    """Yield the texts of an authored table, at any depth, each with its path in the file."""
    inside: Iterable[tuple[str, object]] = ()
    if isinstance(thing, Text):
        yield path, thing
    elif isinstance(thing, BaseModel):
        inside = ((f".{name}", getattr(thing, name)) for name in type(thing).model_fields)
    elif isinstance(thing, list):
        inside = ((f"[{index}]", one) for index, one in enumerate(thing))
    for key, one in inside:
        yield from texts_in(one, path + key)


def _untranslated(assignment: Assignment, rubric: RubricFile) -> Iterator[LintFinding]:
    """Report texts that some students would read in English: one finding for each file."""
    file = assignment.file
    files: dict[File, BaseModel] = {"assignment": file, "rubric": rubric}
    if isinstance(file.mechanism, str):
        files["mechanism"] = assignment.mechanism_file
    for name, authored in files.items():
        # The first language is English, which is required.
        missing = [
            f"{path}.{language}"
            for path, text in texts_in(authored, "$")
            for language in LANGUAGES[1:]
            if not getattr(text, language)
        ]
        if missing:
            yield LintFinding("hint", "not_translated", name, missing[0], {"texts": first_of(missing)})


def _rubric_faults(
    assignment: Assignment, rubric: RubricFile, construction: Construction
) -> Iterator[LintFinding]:
    for fault in (*check_rubric(rubric, construction), *check_accelerations(assignment, rubric)):
        known, why = fault.parameters, fault.code
        yield LintFinding("fault", "unknown_in_rubric", "rubric", fault.path, known, why=why)
    judged_by: dict[str, str] = {}
    for index, criterion in enumerate(rubric.criterion):
        if criterion.name in judged_by:
            known = {"name": criterion.name, "other": judged_by[criterion.name]}
            yield LintFinding("hint", "asked_twice", "rubric", f"$.criterion[{index}]", known)
        judged_by.setdefault(criterion.name, criterion.id)


def _odd_sizes(assignment: Assignment) -> Iterator[LintFinding]:
    """Report lengths that seem to be in another unit than the file's."""
    file = assignment.mechanism_file
    values, unit = assignment.values(assignment.variants()), file.length_unit
    lengths = {
        path: float(np.max(leaf(values)))
        for path, key, leaf in formulas_in(file, "")
        if key in LENGTHS and isinstance(leaf, Formula)
    }
    longest = max(lengths.values(), default=0.0)
    for path, length in lengths.items():
        if length * ODD_RATIO < longest:
            known = {"text": f"{length:g}", "length": f"{longest:g} {unit}"}
            yield LintFinding("warning", "odd_size", *mechanism_place(assignment, path), known)
    if lengths and not SMALLEST_M <= longest * LENGTH_UNITS_M[unit] <= LARGEST_M:
        known = {"length": f"{longest:g} {unit}"}
        yield LintFinding("warning", "odd_size", *mechanism_place(assignment, ".length_unit"), known)


def _with_their_own(assignment: Assignment, names: Iterable[str]) -> set[str]:
    """Return names, and the names that their formulas use."""
    values = assignment.file.variant.values
    needed, waiting = set(), list(names)
    while waiting:
        name = waiting.pop()
        if name not in needed:
            needed.add(name)
            waiting.extend(values[name].names if name in values else ())
    return needed


def _unused_values(assignment: Assignment) -> Iterator[LintFinding]:
    file = assignment.file
    outside = names_in(
        [assignment.mechanism_file, file.scales, file.given, file.body, file.load, file.gravity]
    )
    needed = _with_their_own(assignment, outside)
    for name in file.variant.values:
        if name not in needed:
            path = f"$.variant.values.{name}"
            yield LintFinding("hint", "unused", "assignment", path, {"text": name}, why="unused_name")
    for name in assignment.rows.columns if assignment.rows else ():
        if name not in needed:
            path = "$.variant.table"
            yield LintFinding("hint", "unused", "assignment", path, {"text": name}, why="unused_name")
    drawn = _with_their_own(assignment, names_in(assignment.mechanism_file))
    for name, in_table in zip(KEYS, assignment.rows.has if assignment.rows else (False, False), strict=True):
        by_row = in_table and not drawn.isdisjoint(assignment.rows.columns if assignment.rows else ())
        if assignment.numbers(name) is not None and name not in drawn and not by_row:
            known = {"name": name}
            yield LintFinding("warning", "same_for_all", "assignment", f"$.variant.{name}", known)


def _not_told(assignment: Assignment) -> Iterator[LintFinding]:
    """Report data that differ between students and set the mechanism, but that no [[given]] states."""
    values, given = assignment.file.variant.values, assignment.file.given
    stated = names_in(given)

    def is_stated(name: str) -> bool:
        if name in stated or name not in values:
            # A number used in the mechanism itself counts as given if a formula with it is: 45*position.
            return name in stated
        parts = values[name].names
        return not parts or all(map(is_stated, parts))

    missing = [name for name in sorted(names_in(assignment.mechanism_file)) if not is_stated(name)]
    if missing:
        yield LintFinding("hint", "not_told", "assignment", "$.given", {"texts": tuple(missing)})


OTHER_UNITS = frozenset({"m", "cm", "mm", "°", "rev/min"})
"""Units of data that no result is in."""


def _told_results(assignment: Assignment, rubric: RubricFile, plan: Plan) -> Iterator[LintFinding]:
    """Report given data that are results: a student need not compute what the rubric asks for."""
    values, results = assignment.values(list(plan.variants)), {**plan.rates, **plan.vectors_si}
    driving = f"_{plan.mechanism.driver.pin}"
    asked = [one.name for one in rubric.criterion if one.name in results and not one.name.endswith(driving)]
    for index, datum in enumerate(assignment.file.given):
        told = np.abs(datum.value(values)) if datum.unit not in OTHER_UNITS else np.nan
        for name in (name for name in asked if np.allclose(told, np.abs(results[name]), rtol=1e-3)):
            yield LintFinding("warning", "result_told", "assignment", f"$.given[{index}]", {"name": name})


def _unknown_names(assignment: Assignment, construction: Construction) -> Iterator[LintFinding]:
    known = {step.node for step in construction.steps} | construction.vectors.keys()
    known |= construction.rates.keys() | set(SCALE_NAMES)
    known |= TRADITIONS.get(assignment.file.tradition, {}).keys()
    for name in assignment.file.names:
        if name not in known:
            yield LintFinding("hint", "unused", "assignment", f'$.names."{name}"', why="names_nothing")


def _unneeded(
    assignment: Assignment, rubric: RubricFile, construction: Construction
) -> Iterator[LintFinding]:
    """Report joints and figures that no criterion depends on."""
    asked = [construction.vectors[name] for name in rubric.vectors if name in construction.vectors]
    asked += [
        construction.vectors[construction.rates[name].vector]
        for name in (criterion.angular for criterion in rubric.criterion)
        if name is not None and name in construction.rates
    ]
    if not asked:
        yield LintFinding("hint", "no_vector_asked", "rubric", "$.criterion")
        return
    needed = ancestors(construction, {end for vector in asked for end in (vector.tail, vector.head)})
    for index, table in enumerate(assignment.mechanism_file.group):
        joint = table.node
        if needed.isdisjoint({joint, image_name(joint), image_name(joint, primed=True)}):
            place = mechanism_place(assignment, f".group[{index}]")
            yield LintFinding("hint", "unused", *place, {"joint": joint}, why="unused_joint")
    figures = {construction.figure_of(vector.head) for vector in asked}
    for index, page in enumerate(assignment.file.page):
        for figure in page.figures:
            if figure != "mechanism" and figure not in figures:
                path, known = f"$.page[{index}].figures", {"figure": figure}
                yield LintFinding("hint", "unused", "assignment", path, known, why="unused_figure")


# JSON document ------------------------------------------------------------------------------------


def faults_document(error: AuthoredFileError, name: str, speaker: Tongue) -> LintDocument:
    """Return the document of files that have faults, as errors list them."""
    findings = [
        _finding(
            LintFinding("fault", one.code, file_kind(Path(told.file)), one.path, one.parameters),
            speaker,
            one.line,
        )
        for told in (error, *error.others)
        for one in told.findings
    ]
    return LintDocument(
        assignment=name, needs_a_person=True, findings=findings, variants=[], scales=[], worst=None
    )


def _finding(one: LintFinding, speaker: Tongue, line: int = 0) -> LintFindingDocument:
    return LintFindingDocument(
        severity=one.severity,
        code=one.code,
        file=one.file,
        path=one.path,
        line=line or None,
        message=one.message(speaker),
        parameters=as_json(one.parameters),
        variants=[VariantDocument(**_numbers(variant)) for variant in one.variants],
    )


def lint_document(result: Lint, speaker: Tongue = ENGLISH) -> LintDocument:
    """Return the document of `planmark lint --json`, with messages in a language."""
    worst = None
    if result.worst is not None:
        variant, why = result.worst
        parameters = as_json(why.parameters)
        worst = LintWorst(**_numbers(variant), why=clause(why, speaker), code=why.code, parameters=parameters)
    return LintDocument(
        assignment=result.assignment.id,
        needs_a_person=result.needs_a_person,
        findings=[_finding(one, speaker) for one in result.findings],
        variants=list(result.rows),
        scales=[proposal.over_all for proposal in result.scales],
        worst=worst,
    )
