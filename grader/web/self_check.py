"""A student's self-check of values and photos, as data: right and wrong values, and the drawing as measured.

Nothing in it gives the answer away: the level says how much is told, and no expected vector is drawn.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader.comparison.task import task_of
from grader.feedback.student_page import AS_MEASURED, SHEET
from grader.language import Tongue, symbols, tongue
from grader.options import Level
from grader.outcomes import Outcome
from grader.overlay.closeup import page_views, scan_element, svg
from grader.overlay.measured import measured_picture
from grader.overlay.scene import Picture
from grader.records import Reason
from grader.rubric import rubric_of
from grader.self_check.advice import RESULTS, CheckedLine
from grader.self_check.values import check_values
from grader.tables.measurements import NOTHING_MEASURED, columns_of, measurements_in, names_of
from grader.texts.reasons import reason_sentence
from grader.texts.spoken import PLACES, RefusedError, clause, message
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.quantities import SCALE_UNITS, unit_of

_BARE = re.compile(r"\d*[.,]?\d+([eE][+-]?\d+)?", re.ASCII)


def variant_of(assignment: Assignment, n: int | None, position: int | None) -> Variant:
    """Return the variant that a student asks for; a number that the assignment does not have is ignored.

    Raises RefusedError for one that there is not.
    """
    chosen: list[int | None] = []
    for what, value in (("n", n), ("position", position)):
        known = assignment.numbers(what)
        if known is not None and value not in known:
            raise RefusedError(422, f"{what}_range", first=known[0], last=known[-1])
        chosen.append(None if known is None else value)
    return assignment.variant(*chosen)


def form_of(assignment: Assignment, lang: str) -> dict[str, Any]:
    """Return the fields of a form, each with its name, group, unit and column, and the ranges of numbers."""
    speaker, names = tongue(lang), assignment.names
    fields = []
    for column, unit in columns_of(assignment, rubric_of(assignment)).items():
        name = column.removesuffix("_deg").removesuffix("_value")
        group = (
            "scales" if name in SCALE_UNITS
            else "directions" if column.endswith("_deg")
            else "values" if column.endswith(("_value", "_sense")) else "lengths"
        )  # fmt: skip
        shown = names.get(name, name)
        fields.append({"column": column, "name": shown, "group": group, "unit": speaker.unit(unit)})
    ranges = {what: assignment.numbers(what) for what in ("n", "position")}
    return {
        "title": assignment.file.title.in_language(lang),
        "fields": fields,
        **{what: None if known is None else [min(known), max(known)] for what, known in ranges.items()},
    }


def checked_values(
    name: str, variant: Variant, cells: Mapping[str, str], lang: str, level: Level
) -> dict[str, Any]:
    """Check typed values, texts by the names of a measurement file's columns.

    Raises CallError for a variant whose mechanism does not assemble, InputFileError for unusable columns.

    Arguments: `name` of the assignment, or the path of its file.
    """
    assignment = load_assignment(name)
    filled = {column: _with_unit(column, text.strip()) for column, text in cells.items() if text.strip()}
    entered = measurements_in(filled, names_of(assignment), "", lang) if filled else NOTHING_MEASURED
    check = check_values(entered, assignment, variant, tongue(lang), level)
    outcomes = {} if check.judgement is None else {one.name: one for one in check.judgement.outcomes}
    speaker = tongue(lang)
    told = (*entered.problems, *entered.reading.problems)
    fields = dict(_faults(told, outcomes, speaker))
    construction = task_of(assignment, rubric_of(assignment), variant).construction
    picture = measured_picture("", entered.reading, construction, outcomes, show_expected=False)
    return {
        "lines": [line for line in _lines(check.lines, lang) if line["name"] not in fields],
        "is_right": check.is_all_right and not fields,
        "problems": [message(one, speaker) for one in told if "cell" not in one.parameters],
        "fields": fields,
        "drawing": [] if picture is None else _drawings([picture], assignment, lang),
    }


def _faults(
    problems: Sequence[Reason], outcomes: Mapping[str, Outcome], speaker: Tongue
) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with a field that cannot be used, by its column."""
    for one in problems:
        if "cell" in one.parameters:
            why = replace(one, code=str(one.parameters["why"]))
            yield str(one.parameters["cell"]), clause(why, speaker)
    for name, outcome in outcomes.items():
        for one in outcome.reasons:
            if one.code == "scale_refused":
                yield name, reason_sentence(one, speaker, "hint")


def _with_unit(column: str, text: str) -> str:
    """Return a scale's text, a bare number with the unit that stands beside its field."""
    return f"{text} {unit_of(column)}" if column in SCALE_UNITS and _BARE.fullmatch(text) else text


def checked_photo(path: Path, asked: Mapping[str, Any]) -> dict[str, Any]:
    """Check a photo.

    Arguments: `asked` has the ``assignment``, ``n``, ``position``, ``lang`` and ``level``.
    """
    from grader.self_check.photo import photo_check  # noqa: PLC0415 - processes that judge values need no reading

    assignment, lang = load_assignment(asked["assignment"]), asked["lang"]
    variant = variant_of(assignment, asked["n"], asked["position"])
    check = photo_check(path, assignment, rubric_of(assignment), variant, lang, asked["level"])
    return {
        "lines": _lines(check.lines, lang),
        "is_right": check.is_all_right,
        "is_read": check.judgement is not None,
        "problems": [*check.flaws.values(), *check.problems],
        "drawing": _drawings(check.pictures, assignment, lang),
        "attempts_left": asked.get("attempts_left"),
    }


def _drawings(pictures: Sequence[Picture], assignment: Assignment, lang: str) -> list[str]:
    """Return the plans as drawn, or a sheet without plans, each an SVG element with its own scan in it."""
    speaker, names = tongue(lang), assignment.names
    drawings = []
    for index, picture in enumerate(pictures):
        views = page_views(picture, index, names)
        wanted = [view for view in views if view.kind != "sheet"] or views
        shared = "" if picture.scan else f", {speaker.gettext(AS_MEASURED)}"
        scan = (
            f'<svg width="0" height="0" aria-hidden="true"><defs>{scan_element(picture, index)}</defs></svg>'
        )
        drawings += [scan] if picture.scan else []
        for view in wanted:
            what = speaker.titled({**PLACES, "sheet": SHEET, "detail": SHEET}, view.kind, names)
            drawings.append(str(svg(view, picture, what + shared)))
    return drawings


def _lines(lines: Sequence[CheckedLine], lang: str) -> list[dict[str, str]]:
    speaker = tongue(lang)
    return [
        {
            "name": line.name,
            "html": str(symbols(line.name)),
            "result": line.result,
            "mark": RESULTS[line.result][0],
            "word": speaker.gettext(RESULTS[line.result][1]),
            "hint": str(symbols(line.hint)),
            "advice": str(symbols(line.advice)),
        }
        for line in lines
    ]
