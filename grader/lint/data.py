"""What stands in the files and is not used, or is used and not told to the student."""

from collections.abc import Iterable, Iterator

from pydantic import BaseModel

from grader.lint.findings import LintFinding
from grader.lint.places import mechanism_place
from grader.rubric import RubricFile, check_rubric
from reference.assignment import Assignment
from reference.assignment_file import TRADITIONS
from reference.construction import Construction, ancestors
from reference.draft import image_name
from reference.formula import Formula

SCALES = ("kL", "kv", "ka")


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
    known |= construction.rates.keys() | set(SCALES)
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
