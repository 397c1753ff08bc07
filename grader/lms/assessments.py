"""The rubric, and everybody's assessment by it, as JSON for programs: `rubric.json` and `assessments.json`.

The rubric is a CFRubric of 1EdTech's CASE 1.1 (purl.imsglobal.org/spec/case/v1p1/schema/json, CFPackage).
CASE has no place for titles in several languages, maxima and codes: they stand in its `extensions`.
Identifiers are made from the names of the assignment, the criterion and the level: they are the same in
every run, every class and every language, also where points or titles change.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

from pydantic import TypeAdapter

from grader.documents import (
    CriterionDocument,
    LevelDocument,
    ReportDocument,
    ResultsDocument,
    RubricCriterionDocument,
    RubricDocument,
    Verdict,
)
from grader.feedback.numbers import parts_of
from grader.files import write_whole
from grader.language import LANGUAGES, tongue
from grader.lms.marks import DECIMALS
from grader.rubric import CriterionTable, RubricFile
from grader.texts.spoken import failure
from reference.authored.assignment import Assignment, locate
from reference.authored.toml_file import Text, is_file
from reference.errors import InputFileError

# The rubric ---------------------------------------------------------------------------------------


def rubric_document(assignment: Assignment, rubric: RubricFile) -> RubricDocument:
    """The rubric of an assignment with its levels, as the results keep it."""
    path, points = locate("rubric", assignment.file.rubric, assignment.path), rubric.points
    changed = datetime.fromtimestamp(int(path.stat().st_mtime) if is_file(path) else 0, UTC)
    return RubricDocument(
        titles=_titles(rubric.title),
        changed=f"{changed:%Y-%m-%dT%H:%M:%SZ}",
        criteria=[
            RubricCriterionDocument(
                id=one.id,
                titles=_titles(one.title),
                section=one.section,
                max_points=points[one.id],
                levels=[*_levels(rubric, one, points[one.id])],
            )
            for one in rubric.criterion
        ],
    )


def _titles(text: Text) -> dict[str, str]:
    """A title by language, English where a language has none; in one line."""
    return {lang: " ".join(text.in_language(lang).split()) for lang in LANGUAGES}


def _levels(rubric: RubricFile, criterion: CriterionTable, most: float) -> Iterator[LevelDocument]:
    """All verdicts that the program or a person may give; a partial one for each band of the tolerance."""
    bands = rubric.tolerance_of(criterion).all_bands or ((1.0, 0.0),)
    shares: list[tuple[Verdict, float]] = [("full", 1.0), ("follow_through", 1.0)]
    for verdict, share in [*shares, *(("partial", share) for _, share in bands), ("none", 0.0)]:
        yield LevelDocument(verdict=verdict, points=round(share * most, DECIMALS))
    yield LevelDocument(verdict="not_judged", points=None)


# As CASE has it -----------------------------------------------------------------------------------


def _case_rubric(assignment: str, rubric: RubricDocument) -> dict[str, object]:
    """The rubric as a CFRubric."""
    whole = _identifier(assignment)
    words = _level_words()
    criteria = []
    for place, one in enumerate(rubric.criteria, start=1):
        parent = _identifier(assignment, one.id)
        levels = [
            _record(
                identifier,
                rubric.changed,
                quality=words[level.verdict]["en"],
                **({} if level.points is None else {"score": level.points}),
                position=number,
                rubricCriterionId=parent,
                extensions=[{"level": level.verdict, "qualities": words[level.verdict]}],
            )
            for number, (identifier, level) in enumerate(_identified(assignment, one), start=1)
        ]
        criteria.append(
            _record(
                parent,
                rubric.changed,
                category=one.section,
                description=one.titles["en"],
                weight=1.0,
                position=place,
                rubricId=whole,
                CFRubricCriterionLevels=levels,
                extensions={"criterion": one.id, "titles": one.titles, "max_points": one.max_points},
            )
        )
    told = {
        "schema_version": 1,
        "assignment": assignment,
        "titles": rubric.titles,
        "max_score": math.fsum(one.max_points for one in rubric.criteria),
    }
    titles = {"title": rubric.titles["en"], "CFRubricCriteria": criteria, "extensions": told}
    return _record(whole, rubric.changed, **titles)


def _record(identifier: str, changed: str, **content: object) -> dict[str, object]:
    head = {"identifier": identifier, "uri": f"urn:uuid:{identifier}"}
    return {**head, **content, "lastChangeDateTime": changed}


@lru_cache(4096)
def _identifier(*names: str) -> str:
    """The identifier of an assignment's rubric, of a criterion of it, or of a level of that."""
    return str(uuid5(NAMESPACE_URL, f"urn:planmark:rubric:{'/'.join(names)}"))


def _identified(assignment: str, criterion: RubricCriterionDocument) -> Iterator[tuple[str, LevelDocument]]:
    """The levels of a criterion with their identifiers; those of a verdict that comes again are numbered."""
    known: list[Verdict] = []
    for level in criterion.levels:
        known.append(level.verdict)
        count = known.count(level.verdict)
        name = level.verdict if count == 1 else f"{level.verdict}_{count}"
        yield _identifier(assignment, criterion.id, name), level


def _level_words() -> dict[str, dict[str, str]]:
    """The verdicts as people read them, by language."""
    from grader.feedback.words import VERDICTS  # noqa: PLC0415 - loads jinja2, for this alone

    return {
        verdict: {lang: tongue(lang).gettext(text) for lang in LANGUAGES}
        for verdict, text in VERDICTS.items()
    }


# Assessments --------------------------------------------------------------------------------------


def _assessment(
    report: ReportDocument, assignment: str, levels: Mapping[str, Sequence[tuple[str, LevelDocument]]]
) -> dict[str, object]:
    """One submission: the points of its rows times their factors, and `added`, make its score."""
    factors = {part.section: part.factor for part in parts_of(report)}
    return {
        "student_id": report.student_id,
        "variant": report.variant,
        "position": report.position,
        "status": report.status,
        "score": report.score,
        "score_range": report.score_range,
        "max_score": report.max_score,
        "added": report.added,
        "comment": report.comment,
        "decisions": [one for one in report.decisions if one.criterion in {"total", "comment"}],
        "criteria": [
            {
                "criterion": one.id,
                "criterion_identifier": _identifier(assignment, one.id),
                **_level_of(one, levels.get(one.id, ())),
                "points": one.points,
                "max_points": one.max_points,
                "factor": factors.get(one.section, 0.0),
                "comment": one.feedback,
                "decided": one.decided,
            }
            for one in report.criteria
        ],
    }


def _level_of(one: CriterionDocument, levels: Sequence[tuple[str, LevelDocument]]) -> dict[str, object]:
    """The status and the level of a criterion: of several with its verdict that of the nearest points."""
    if one.verdict == "review":
        return {"status": "needs_review", "level": None, "level_identifier": None}
    same = [(identifier, level) for identifier, level in levels if level.verdict == one.verdict]
    nearest = min(same, key=lambda each: abs((each[1].points or 0.0) - (one.points or 0.0)), default=None)
    return {
        "status": "settled" if one.decided is None else "decided",
        "level": one.verdict,
        "level_identifier": None if nearest is None else nearest[0],
    }


# Both ---------------------------------------------------------------------------------------------

_TEXT = TypeAdapter(dict[str, object])
"""Writes JSON eight times as fast as the standard library."""


def documents(results: ResultsDocument) -> dict[str, bytes]:
    """Both files by their names; InputFileError for results of a version that kept no rubric."""
    if results.rubric is None:
        raise failure(InputFileError, "results_wrong", "results_without_rubric")
    name = results.assignment
    levels = {one.id: list(_identified(name, one)) for one in results.rubric.criteria}
    assessments = {
        "schema_version": 1,
        "assignment": name,
        "rubric": _identifier(name),
        "assessments": [_assessment(report, name, levels) for report in results.reports],
    }
    both = {"rubric.json": _case_rubric(name, results.rubric), "assessments.json": assessments}
    return {file: _TEXT.dump_json(content, indent=2) + b"\n" for file, content in both.items()}


def write_documents(folder: Path, results: ResultsDocument) -> None:
    """Write both files into a folder of results, in the place of those that are there."""
    for name, data in documents(results).items():
        write_whole(folder / name, data)
