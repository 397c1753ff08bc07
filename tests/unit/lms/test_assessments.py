"""rubric.json and assessments.json: CASE's form, stable identifiers, levels, and scores that add up."""

import json

import jsonschema
import pytest

from grader.cli.exporting import schema
from grader.documents import ResultsDocument
from grader.folder.batch import Batch, grade
from grader.language import LANGUAGES
from grader.lms.assessments import documents, rubric_document
from grader.lms.export import read_results
from grader.rubric import Band, ToleranceTable, rubric_of
from grader.solution.document import plan_document
from grader.tables.decisions import Decision, DecisionFile
from reference.authored.assignment import Variant, built_in, load_assignment
from reference.plan import exact_plan
from tests.inline import Inline

# CASE 1.1: the fields that 1EdTech allows, with * those that it requires, and the forms of their values.
# Source: purl.imsglobal.org/spec/case/v1p1/schema/json/case_v1p1_cfpackage-jsonschema1.json, January 2025.
FIELDS = {
    "CFRubric": "identifier* uri* title description lastChangeDateTime* CFRubricCriteria extensions",
    "CFRubricCriterion": "identifier* uri* category description CFItemURI weight position rubricId"
    " lastChangeDateTime* CFRubricCriterionLevels extensions",
    "CFRubricCriterionLevel": "identifier* uri* description quality score feedback position rubricCriterionId"
    " lastChangeDateTime* extensions",
}
TEXT, OBJECT = {"type": "string"}, {"type": "object"}
UUID = TEXT | {"pattern": "^[0-9a-f]{8}-[0-9a-f]{4}-[1-5][0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$"}
LINE = TEXT | {"pattern": "^[^\n\r\t]*$"}
MOMENT = (
    r"^[0-9]{4}-[01][0-9]-[0-3][0-9]T[0-2][0-9]:[0-5][0-9]:[0-5][0-9](\.[0-9]+)?(Z|[+-][0-9]{2}:[0-9]{2})$"
)
FORMS = {
    "identifier": UUID, "rubricId": UUID, "rubricCriterionId": UUID,
    "uri": TEXT | {"pattern": "^[a-z][a-z0-9+.-]*:[^ ]+$"},
    "lastChangeDateTime": TEXT | {"pattern": MOMENT},
    "title": LINE, "category": LINE, "quality": LINE, "description": TEXT, "feedback": TEXT,
    "weight": {"type": "number"}, "score": {"type": "number"}, "position": {"type": "integer"},
    "CFItemURI": OBJECT, "extensions": OBJECT,
    "CFRubricCriteria": {"type": "array", "items": {"$ref": "#/$defs/CFRubricCriterion"}},
    "CFRubricCriterionLevels": {"type": "array", "items": {"$ref": "#/$defs/CFRubricCriterionLevel"}},
}  # fmt: skip
DEFINED = {
    kind: {
        "type": "object",
        "additionalProperties": False,
        "required": [name[:-1] for name in names.split() if name.endswith("*")],
        "properties": {name.rstrip("*"): FORMS[name.rstrip("*")] for name in names.split()},
    }
    for kind, names in FIELDS.items()
}
# A level alone has several extensions.
DEFINED["CFRubricCriterionLevel"]["properties"]["extensions"] = {"type": "array", "items": OBJECT}
CASE = {"$ref": "#/$defs/CFRubric", "$defs": DEFINED}


def both(results):
    """The two documents, held against their schemas."""
    rubric, assessments = (json.loads(text) for text in documents(results).values())
    jsonschema.validate(rubric, CASE)
    jsonschema.validate(rubric, schema("cf-rubric"))
    jsonschema.validate(assessments, schema("assessments"))
    return rubric, assessments


def rubric_alone(assignment, rubric):
    kept = rubric_document(assignment, rubric)
    return both(ResultsDocument(assignment=assignment.id, rubric=kept, reports=[]))[0]


def levels_of(criterion):
    return {one["identifier"]: one for one in criterion["CFRubricCriterionLevels"]}


# The rubric ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", built_in())
def test_each_built_in_rubric_is_a_cfrubric_with_all_its_criteria(name):
    assignment = load_assignment(name)
    authored = rubric_of(assignment)
    rubric = rubric_alone(assignment, authored)
    criteria = rubric["CFRubricCriteria"]
    assert [one["extensions"]["criterion"] for one in criteria] == [one.id for one in authored.criterion]
    for one, own in zip(criteria, authored.criterion, strict=True):
        told = one["extensions"]
        assert told["titles"] == {lang: own.title.in_language(lang) for lang in LANGUAGES}
        assert told["max_points"] == authored.points[own.id]
        scores = {
            level["extensions"][0]["level"]: level.get("score") for level in one["CFRubricCriterionLevels"]
        }
        most = told["max_points"]
        half = pytest.approx(authored.tolerance_of(own).all_bands[0][1] * most)
        expected = {"full": most, "follow_through": most, "partial": half, "none": 0.0, "not_judged": None}
        assert scores == expected
        assert {level["rubricCriterionId"] for level in levels_of(one).values()} == {one["identifier"]}
        assert one["rubricId"] == rubric["identifier"]
    assert rubric["extensions"]["max_score"] == pytest.approx(authored.max_score)
    identifiers = [name for one in criteria for name in (one["identifier"], *levels_of(one))]
    assert len(identifiers) == len(set(identifiers))


PUMP = load_assignment("pump")
PUMP_RUBRIC = rubric_of(PUMP)
BANDS = ToleranceTable(bands=[Band(factor=2.0, share=0.75), Band(factor=3.0, share=0.5)])


def test_identifiers_are_of_names_alone_and_stay_what_they_were_when_first_published():
    rubric = rubric_alone(PUMP, PUMP_RUBRIC)
    assert rubric["identifier"] == "9912610f-dea6-5a67-b442-fd669837ca3c"
    known = {one["extensions"]["criterion"]: one for one in rubric["CFRubricCriteria"]}
    assert known["v_B"]["identifier"] == "7e4743e7-b0a2-5ae9-9e82-28cfd2f84d1a"
    codes = {one["extensions"][0]["level"]: name for name, one in levels_of(known["v_B"]).items()}
    assert codes["partial"] == "06ba37fe-ff1d-5a70-8a69-c8d6d6d6566f"
    dearer = [
        one.model_copy(update={"points": 7.0 * one.points, "title": one.title.model_copy(update={"en": "X"})})
        for one in reversed(PUMP_RUBRIC.criterion)
    ]
    changed = rubric_alone(PUMP, PUMP_RUBRIC.model_copy(update={"criterion": dearer, "tolerance": BANDS}))
    assert changed["identifier"] == rubric["identifier"]
    for one in changed["CFRubricCriteria"]:
        before = known[one["extensions"]["criterion"]]
        assert one["identifier"] == before["identifier"]
        assert set(levels_of(before)) < set(levels_of(one))  # the second band's is new


# Assessments --------------------------------------------------------------------------------------

PRESS = load_assignment("press")
PRESS_RUBRIC = rubric_of(PRESS)


def hand_in(folder, student, position, **changes):
    plan = plan_document(PRESS, exact_plan(PRESS, [Variant(position=position)]))
    lengths = {name: one.drawn_mm for name, one in plan.vectors.items()} | changes
    told = {"student_id": student, "position": position, "segments_mm": lengths}
    (folder / f"{student}_{position}.json").write_text(json.dumps(told))


def run(folder, out="out", **how):
    """The results of a class, and its two files as they were written."""
    rubric = how.pop("rubric", PRESS_RUBRIC)
    results = grade(Batch(PRESS, rubric, folder, folder.parent / out, **how), lambda *_: None, Inline())
    written = {name: (folder.parent / out / name).read_bytes() for name in documents(results)}
    assert written == documents(results) == documents(read_results(folder.parent / out))
    return results, *both(results), written


def assessed(assessments, student, position=1):
    return next(
        one
        for one in assessments["assessments"]
        if (one["student_id"], one["position"]) == (student, position)
    )


def row(assessment, criterion):
    return next(one for one in assessment["criteria"] if one["criterion"] == criterion)


def summed(assessment):
    return sum((one["points"] or 0.0) * one["factor"] for one in assessment["criteria"]) + assessment["added"]


@pytest.fixture
def folder(tmp_path):
    """A class: s1 with two positions, of which one is wrong; a value of s2 is of no use; s3 is missing."""
    folder = tmp_path / "in"
    folder.mkdir()
    hand_in(folder, "s1", 1)
    hand_in(folder, "s1", 2, v_B=3.0)
    hand_in(folder, "s2", 1, v_B="?")
    roster = "student_id,name,position,lang\ns1,Ana,1,ro\ns1,Ana,2,ro\ns2,Ion,1,ru\ns3,Ilie,1,\n"
    (folder / "roster.csv").write_text(roster)
    return folder


def test_each_position_is_assessed_by_the_one_rubric_with_points_that_make_its_score(folder):
    results, rubric, assessments, _ = run(folder)
    assert assessments["rubric"] == rubric["identifier"]
    known = {one["identifier"]: one for one in rubric["CFRubricCriteria"]}
    students = [(one["student_id"], one["position"], one["status"]) for one in assessments["assessments"]]
    assert students == [
        ("s1", 1, "graded"), ("s1", 2, "graded"), ("s2", 1, "needs_review"), ("s3", 1, "missing")
    ]  # fmt: skip
    for one, report in zip(assessments["assessments"], results.reports, strict=True):
        assert (one["score"], one["max_score"]) == (report.score, report.max_score)
        assert [each["comment"] for each in one["criteria"]] == [each.feedback for each in report.criteria]
        if one["score"] is not None:
            assert summed(one) == pytest.approx(one["score"], abs=1e-4)
        for each in one["criteria"]:
            level = levels_of(known[each["criterion_identifier"]]).get(each["level_identifier"], {})
            assert level.get("score") == each["points"]
            assert each["level"] == (level["extensions"][0]["level"] if level else None)
    wrong = row(assessed(assessments, "s1", 2), "v_B")
    assert (wrong["status"], wrong["level"], wrong["points"]) == ("settled", "none", 0.0)
    assert "prea scurt" in wrong["comment"]
    assert row(assessed(assessments, "s1"), "kL")["level"] == "not_judged"
    assert assessed(assessments, "s1")["criteria"][0]["factor"] > 1.0


def test_what_waits_has_no_level_and_no_points_and_missing_work_no_criteria(folder):
    _, _, assessments, _ = run(folder)
    waits = assessed(assessments, "s2")
    open_one = row(waits, "v_B")
    assert (waits["score"], open_one["status"]) == (None, "needs_review")
    assert [open_one[key] for key in ("level", "level_identifier", "points", "decided")] == [None] * 4
    assert summed(waits) == pytest.approx(waits["score_range"][0], abs=1e-4)
    missing = assessed(assessments, "s3")
    assert (missing["status"], missing["score"], missing["criteria"]) == ("missing", None, [])


def decide(folder, whose, criterion, verdict="", points=None, comment=""):
    told = (*whose, criterion, verdict, points, comment, "S. Popa", "2026-11-22T18:00:00+02:00", "")
    DecisionFile(folder / "decisions.csv").add(Decision(*told))


def test_the_files_are_current_after_decisions_which_say_who_decided(folder):
    run(folder)
    decide(folder, ("s1", 2), "v_B", "partial", 0.2, "the arrow is there")
    decide(folder, ("s2", 1), "v_B", "full")
    decide(folder, ("s1", 1), "total", points=-1.5, comment="late")
    _, rubric, assessments, _ = run(folder)
    changed = row(assessed(assessments, "s1", 2), "v_B")
    assert (changed["status"], changed["level"], changed["points"]) == ("decided", "partial", 0.2)
    assert changed["decided"] == {
        "by": "S. Popa", "at": "2026-11-22T18:00:00+02:00", "before": "none", "comment": "the arrow is there"
    }  # fmt: skip
    criterion = next(
        one for one in rubric["CFRubricCriteria"] if one["identifier"] == changed["criterion_identifier"]
    )
    level = levels_of(criterion)[changed["level_identifier"]]
    assert (level["quality"], level["score"]) == ("nearly right", changed["max_points"] / 2.0)
    settled = assessed(assessments, "s2")
    assert settled["status"] == "graded"
    assert row(settled, "v_B")["decided"]["before"] == "review"
    late = assessed(assessments, "s1")
    assert (late["added"], late["comment"], late["decisions"][0]["by"]) == (-1.5, "late", "S. Popa")
    for one in (settled, late):
        assert summed(one) == pytest.approx(one["score"], abs=1e-4)


def test_of_several_bands_the_level_is_the_nearest_to_the_points_and_without_bands_there_is_one(folder):
    decide(folder, ("s1", 1), "v_B", "partial", 0.76 * PRESS_RUBRIC.points["v_B"])
    decide(folder, ("s1", 2), "v_B", "partial", 0.1 * PRESS_RUBRIC.points["v_B"])
    for bands, shares in ((BANDS, [0.75, 0.5]), (ToleranceTable(bands=[]), [0.0, 0.0])):
        authored = PRESS_RUBRIC.model_copy(update={"tolerance": bands})
        _, rubric, assessments, _ = run(folder, rubric=authored)
        levels = {name: one for each in rubric["CFRubricCriteria"] for name, one in levels_of(each).items()}
        rows = [row(assessed(assessments, "s1", position), "v_B") for position in (1, 2)]
        scores = [levels[one["level_identifier"]]["score"] for one in rows]
        assert scores == pytest.approx([share * PRESS_RUBRIC.points["v_B"] for share in shares])


def test_the_same_results_make_the_same_bytes_and_the_classes_language_no_other_rubric(folder):
    _, _, _, first = run(folder)
    _, _, _, again = run(folder)
    russian, _, _, elsewhere = run(folder, "other", lang="ru")
    assert again == first
    assert russian.lang == "ru"
    assert elsewhere["rubric.json"] == first["rubric.json"]
