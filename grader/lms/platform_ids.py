"""The platform's numbers: of students from a small table, of criteria from its own answer or a table."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from grader.lms.documents import PlatformCriterion
from grader.lms.faults import listed
from grader.lms.grades import Person
from grader.lms.marks import Criterion
from reference.errors import InputFileError

STUDENT_COLUMNS = ("student_id", "id", "username", "participant")
CRITERION_COLUMNS = ("criterion", "id")


def with_ids(people: Mapping[str, Person], path: Path) -> dict[str, Person]:
    """People with what a table says of them: ``student_id``, and ``id``, ``username`` or ``participant``.

    Raises InputFileError with every fault of the table.
    """
    rows = _rows(path, STUDENT_COLUMNS, "student_id")
    faults = list(_twice(rows, [name for name in STUDENT_COLUMNS if name in rows[0][1]]))
    found = dict(people)
    for line, row in rows:
        number = row.get("participant", "")
        if number and not (number.isascii() and number.isdigit()):
            faults.append(f"line {line}: '{number}' is no participant's number")
            continue
        person = found.get(row["student_id"], Person())
        found[row["student_id"]] = replace(
            person,
            platform_id=row.get("id", ""),
            username=row.get("username", "") or person.username,
            participant=int(number) if number else None,
        )
    if faults:
        raise InputFileError("ids", f"{path}: is no table of the platform's numbers{listed(faults)}")
    return found


def _rows(path: Path, columns: Sequence[str], key: str) -> list[tuple[int, dict[str, str]]]:
    """Rows of a small table, with their lines; blank lines are passed over."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputFileError("ids", f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputFileError("ids", f"{path}: is not UTF-8 text; save it as CSV in UTF-8") from error
    first = text.partition("\n")[0]
    delimiter = ";" if first.count(";") > first.count(",") else ","
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        lines = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader]
    except csv.Error as error:
        raise InputFileError("ids", f"{path}, line {reader.line_num}: {error}") from error
    lines = [(line, cells) for line, cells in lines if any(cells)]
    header = lines[0][1] if lines else []
    wrong = [name for name in header if name not in columns or header.count(name) > 1]
    if key not in header or wrong or len(lines) < 2:
        raise InputFileError(
            "ids",
            f"{path}: the first line must name columns out of {', '.join(columns)}, {key} among them, and a"
            f" row follow for each (found: {', '.join(header) or 'nothing'}; rows: {max(len(lines) - 1, 0)})",
        )
    faults = [f"line {line}: has {len(cells)} cells" for line, cells in lines if len(cells) != len(header)]
    faults += [f"line {line}: no {key}" for line, cells in lines if not cells[header.index(key)]]
    if faults:
        raise InputFileError("ids", f"{path}: {len(header)} columns are named{listed(faults)}")
    return [(line, dict(zip(header, cells, strict=True))) for line, cells in lines[1:]]


def _twice(rows: Sequence[tuple[int, Mapping[str, str]]], columns: Sequence[str]) -> Iterable[str]:
    for column in columns:
        seen: dict[str, int] = {}
        for line, row in rows:
            cell = row[column].casefold()
            if cell and cell in seen:
                yield f"line {line}: the same {column} '{row[column]}' as in line {seen[cell]}"
            seen.setdefault(cell, line)


# Criteria -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Known:
    """A criterion as the platform tells it."""

    id: str
    name: str
    max_points: float | None = None


@dataclass(frozen=True, slots=True)
class Place:
    """An activity as Moodle tells it: its numbers, how it is graded, the criteria of its marking guide."""

    cmid: int | None
    context_id: int | None
    criteria: tuple[Known, ...]
    method: str = ""


def place_of(path: Path) -> Place:
    """Where an activity is, from Moodle's answer to core_grading_get_definitions."""
    told = _json(path)
    areas = told.get("areas") if isinstance(told, dict) else None
    if not isinstance(areas, list) or len(areas) != 1 or not isinstance(areas[0], dict):
        raise InputFileError(
            "criteria", f"{path}: is not Moodle's answer to core_grading_get_definitions for one activity"
        )
    area = areas[0]
    method = area.get("activemethod") or ""
    return Place(_whole(area.get("cmid")), _whole(area.get("contextid")), tuple(_told(told)), str(method))


def numbered(criteria: Sequence[Criterion], path: Path) -> list[PlatformCriterion]:
    """The platform's number of each criterion, from a table ``criterion,id`` or the platform's own JSON.

    Raises InputFileError where one is missing, stands there twice, or has other points there.
    """
    known = _known(path)
    faults: list[str] = []
    found: list[PlatformCriterion] = []
    for one in criteria:
        same = [other for other in known if one.is_named(other.name)]
        if len(same) != 1:
            told = ", ".join(f"'{other.name}'" for other in known) if not same else f"{len(same)} times"
            faults.append(f"{one.name}: {'not there' if not same else 'there'} ({told})")
            continue
        points = same[0].max_points
        if points is not None and abs(points - one.max_points) > 1e-4:
            faults.append(f"{one.name}: {points:g} points there, {one.max_points:g} in the rubric")
        found.append(PlatformCriterion(criterion=one.id, id=same[0].id, max_points=one.max_points))
    taken = {one.id for one in found}
    faults += [f"'{one.name}': there, and not in the rubric" for one in known if one.id not in taken]
    if len(taken) < len(found):
        faults.append("two criteria have one number")
    if faults:
        raise InputFileError("criteria", f"{path}: these are not the rubric's criteria{listed(faults)}")
    return found


def _known(path: Path) -> list[Known]:
    if path.suffix.lower() == ".csv":
        rows = _rows(path, CRITERION_COLUMNS, "criterion")
        return [Known(row.get("id", ""), row["criterion"]) for _, row in rows if row.get("id")]
    found = list(_told(_json(path)))
    if not found:
        raise InputFileError(
            "criteria",
            f"{path}: no criteria are in this answer; ask Moodle for core_grading_get_definitions, Canvas for"
            " the rubric, or write a CSV table with the columns criterion,id",
        )
    return found


def _json(path: Path) -> Any:  # noqa: ANN401 - whatever a platform answers
    try:
        return json.loads(path.read_bytes())
    except OSError as error:
        raise InputFileError("criteria", f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise InputFileError("criteria", f"{path}: is not JSON ({error})") from error


_LISTS = ("guide_criteria", "criteria", "data", "rubric")
_NESTS = ("areas", "definitions", "guide", "rubric")


def _told(told: object) -> Iterable[Known]:
    """Criteria in an answer: Moodle's of a marking guide, Canvas's of a rubric or of an assignment."""
    if isinstance(told, list):
        for one in told:
            yield from _told(one)
        return
    if not isinstance(told, dict):
        return
    name, number = told.get("shortname", told.get("description")), told.get("id")
    if isinstance(name, str) and isinstance(number, str | int) and ("maxscore" in told or "points" in told):
        points = told.get("maxscore", told.get("points"))
        yield Known(str(number), name, float(points) if isinstance(points, int | float) else None)
        return
    # A Canvas rubric tells its criteria as `data` and again as `criteria`: the first that is there counts.
    for key in _LISTS:
        if isinstance(told.get(key), list):
            yield from _told(told[key])
            return
    for key in _NESTS:
        if key in told:
            yield from _told(told[key])


def _whole(told: object) -> int | None:
    return told if isinstance(told, int) and not isinstance(told, bool) and told > 0 else None
