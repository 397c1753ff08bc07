"""Gradescope's results.json and LTI's scores."""

import json
import re
import zipfile
from datetime import datetime, timedelta, timezone

import jsonschema
import pytest

from grader.cli.exporting import schema
from grader.lms.export import export
from grader.lms.grades import Options, Person
from grader.records import Reason
from reference.errors import CallError, InputFileError
from tests.unit.lms.classroom import left_out, marked, report, results

WAITING = report("s02", None, status="needs_review", score_range=(1.0, 2.0))
UNREADABLE = report("s03", None, status="unreadable")
MISSING = report("s04", None, status="missing")
CLASS = (marked("s01", 5.0, 2.5, None), WAITING, UNREADABLE, MISSING)


# Gradescope ---------------------------------------------------------------------------------------


def gradescope(path, *reports, **how):
    return export(results(*reports), path, Options(to="gradescope", **how))


def test_each_student_with_a_grade_has_a_results_file(tmp_path):
    delivery = gradescope(tmp_path / "out.zip", *CLASS)
    with zipfile.ZipFile(tmp_path / "out.zip") as archive:
        assert archive.namelist() == ["s01/results.json"]
        document = json.loads(archive.read("s01/results.json"))
    jsonschema.validate(document, schema("gradescope"))
    assert (document["score"], document["visibility"], document["stdout_visibility"]) == (
        11.25,
        "visible",
        "hidden",
    )
    assert [(one["score"], one["max_score"], one["status"]) for one in document["tests"]] == [
        (5.0, 5.0, "passed"),
        (2.5, 5.0, "failed"),
    ]
    assert [one["number"] for one in document["tests"]] == ["1", "2"]
    assert {one["output_format"] for one in document["tests"]} == {"text"}
    assert document["tests"][1]["output"] == "~ Told <why> & how."
    assert document["output"].splitlines()[-1] == "c3: Vector 3: – not judged: Told <why> & how."
    assert document["extra_data"]["schema_version"] == 1
    assert list(delivery.withheld) == ["s02", "s03", "s04"]


def test_a_folder_is_written_whole_and_never_over_another(tmp_path):
    gradescope(tmp_path / "out", *CLASS)
    assert json.loads((tmp_path / "out" / "s01" / "results.json").read_bytes())["score"] == 11.25
    with pytest.raises(CallError, match="already exists"):
        gradescope(tmp_path / "out", *CLASS)


def test_a_files_name_is_for_one_student(tmp_path):
    gradescope(tmp_path / "results.json", *CLASS)
    assert json.loads((tmp_path / "results.json").read_bytes())["score"] == 11.25
    with pytest.raises(CallError, match=r"2 files; name a \.zip, or a folder"):
        gradescope(tmp_path / "other.json", *CLASS, marked("s09", 5.0, 5.0, 5.0))
    assert not (tmp_path / "other.json").exists()


def test_comments_are_in_the_students_own_language(tmp_path):
    people = {"s01": Person(lang="ro"), "s02": Person(lang="ru")}
    _, scores = lti(tmp_path, marked("s01", 5.0), marked("s02", 5.0), marked("s03", 5.0), people=people)
    assert [one["comment"] for one in scores] == [
        "Totul este corect.",
        "Всё верно.",
        "Everything is right.",
    ]


def test_positions_are_tests_of_their_own(tmp_path):
    both = marked("s01", 5.0, position=1), marked("s01", 2.5, position=2)
    gradescope(tmp_path / "sum", *both, combine="sum")
    document = json.loads((tmp_path / "sum" / "s01" / "results.json").read_bytes())
    assert document["score"] == 7.5
    assert [one["name"] for one in document["tests"]] == ["c1: Vector 1 (1)", "c1: Vector 1 (2)"]
    gradescope(tmp_path / "mean", *both, combine="mean")
    document = json.loads((tmp_path / "mean" / "s01" / "results.json").read_bytes())
    assert (document["score"], document["extra_data"]["max_score"]) == (3.75, 5.0)
    assert [one["status"] for one in document["tests"]] == ["passed", "failed"]


def test_an_unknown_visibility_is_refused(tmp_path):
    with pytest.raises(CallError, match="choose hidden, after_due_date, visible, after_published"):
        gradescope(tmp_path / "out.zip", *CLASS, visibility="shown")
    gradescope(tmp_path / "out", *CLASS, visibility="after_published")
    document = json.loads((tmp_path / "out" / "s01" / "results.json").read_bytes())
    assert {document["visibility"], *(one["visibility"] for one in document["tests"])} == {"after_published"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"score": 7.0}, "the criteria give 7.5 points together, the score is 7"),
        ({"points": 6.0}, "c1: 6 of 5 points"),
        ({"points": -1.0}, "c1: −1 of 5 points"),
    ],
)
def test_points_that_there_are_not_are_refused(tmp_path, changes, message):
    right = marked("s01", 5.0, 2.5)
    first = right.criteria[0].model_copy(update={"points": changes.get("points", 5.0)})
    score = changes.get("score", first.points + 2.5)
    wrong = right.model_copy(update={"score": score, "criteria": [first, right.criteria[1]]})
    with pytest.raises(InputFileError, match=message):
        gradescope(tmp_path / "out", wrong)
    assert not (tmp_path / "out").exists()


# LTI ----------------------------------------------------------------------------------------------

NOW = datetime(2026, 11, 22, 7, 1, 2, 345678, tzinfo=timezone(timedelta(hours=2)))


def lti(tmp_path, *reports, **how):
    path = tmp_path / "lti.json"
    delivery = export(results(*reports), path, Options(to="lti", now=NOW, **how))
    document = json.loads(path.read_bytes())
    jsonschema.validate(document, schema("lti"))
    return delivery, document["scores"]


def test_a_score_is_given_only_when_fully_graded(tmp_path):
    delivery, scores = lti(tmp_path, *CLASS)
    assert scores == [
        {
            "userId": "s01",
            "timestamp": "2026-11-22T07:01:02.345+02:00",
            "activityProgress": "Completed",
            "gradingProgress": "FullyGraded",
            "scoreGiven": 11.25,
            "scoreMaximum": 15.0,
            "comment": "~ Vector 2: Told <why> & how.",
        },
        *(
            {
                "userId": who,
                "timestamp": "2026-11-22T07:01:02.345+02:00",
                "activityProgress": "Completed",
                "gradingProgress": "PendingManual",
            }
            for who in ("s02", "s03")
        ),
    ]
    assert delivery.written == ("s01",)
    assert left_out(delivery) == {
        "s02": "needs review",
        "s03": "unreadable",
        "s04": "nothing handed in",
    }


def test_the_clocks_time_has_a_zone_and_a_fraction(tmp_path):
    path = tmp_path / "lti.json"
    export(results(*CLASS), path, Options(to="lti"))
    stamp = json.loads(path.read_bytes())["scores"][0]["timestamp"]
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}\+00:00", stamp)


def test_users_are_named_by_the_table_of_ids_and_who_is_not_in_it_is_told(tmp_path):
    people = {"s01": Person(platform_id="a-b"), "s02": Person(name="Somebody")}
    delivery, scores = lti(tmp_path, *CLASS, people=people)
    assert [one["userId"] for one in scores] == ["a-b"]
    assert set(delivery.unplaced) == {"s02", "s03"}
    assert Reason("users_by_id") not in delivery.notes


def test_scores_are_converted_only_with_leave(tmp_path):
    with pytest.raises(CallError, match="--rescale"):
        lti(tmp_path, *CLASS, maximum=100.0)
    _, scores = lti(tmp_path, *CLASS, maximum=100.0, rescale=True)
    assert (scores[0]["scoreGiven"], scores[0]["scoreMaximum"]) == (75.0, 100.0)


@pytest.mark.parametrize("maximum", [0.0, -5.0, float("nan"), float("inf")])
def test_a_maximum_is_a_positive_number(tmp_path, maximum):
    with pytest.raises(CallError, match="a positive number"):
        lti(tmp_path, *CLASS, maximum=maximum, rescale=True)


def test_two_students_with_one_user_are_refused(tmp_path):
    people = {"s01": Person(platform_id="a"), "s02": Person(platform_id="a")}
    with pytest.raises(InputFileError, match="userId a appears twice"):
        lti(tmp_path, *CLASS, people=people)
    assert not (tmp_path / "lti.json").exists()


GOOD = {
    "userId": "u",
    "timestamp": "2026-11-22T07:01:02.345Z",
    "activityProgress": "Completed",
    "gradingProgress": "FullyGraded",
    "scoreGiven": 1.0,
    "scoreMaximum": 2.0,
}


def taken(score):
    jsonschema.validate({"schema_version": 1, "assignment": "pump", "scores": [score]}, schema("lti"))


def test_a_good_score_is_taken():
    taken(GOOD)
    taken({key: one for key, one in GOOD.items() if "score" not in key} | {"gradingProgress": "Pending"})


@pytest.mark.parametrize(
    "wrong",
    [
        {"timestamp": "2026-11-22T07:01:02.345"},
        {"timestamp": "2026-11-22T07:01:02Z"},
        {"timestamp": "22.11.2026"},
        {"scoreGiven": -1.0},
        {"scoreMaximum": 0.0},
        {"scoreMaximum": None},
        {"scoreGiven": None, "scoreMaximum": None},
        {"gradingProgress": "PendingManual"},
        {"gradingProgress": "Graded"},
        {"activityProgress": "Done"},
        {"userId": ""},
        {"score": 1.0},
    ],
)
def test_a_score_that_a_platform_would_misread_is_none(wrong):
    with pytest.raises(jsonschema.ValidationError):
        taken({key: one for key, one in {**GOOD, **wrong}.items() if one is not None})


def test_the_line_item_of_the_scores_is_there_to_be_posted_first(tmp_path):
    out = tmp_path / "scores.json"
    options = Options(to="lti", item="Pump", maximum=100.0, rescale=True)
    export(results(marked("s01", 5.0, 2.5)), out, options)
    document = json.loads(out.read_bytes())
    jsonschema.validate(document, schema("lti"))
    assert document["lineItem"] == {
        "label": "Pump", "scoreMaximum": 100.0, "resourceId": "pump", "tag": "grade",
    }  # fmt: skip
    assert document["scores"][0]["scoreMaximum"] == 100.0
