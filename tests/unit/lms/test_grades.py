"""The grade that a student gets, and results as they are read."""

import pytest

from grader.lms.export import draft, read_results
from grader.lms.grades import Options, grades_of, in_a_row
from grader.lms.marks import comment
from grader.records import Reason
from reference.errors import CallError, InputFileError
from tests.unit.lms.classroom import a_class, criterion, report, results

OPTIONS = Options(to="lti")


def test_several_positions_need_a_choice():
    both = results(report("s01", 4.0, position=1), report("s01", 5.0, position=2))
    with pytest.raises(CallError, match="has 2 positions"):
        grades_of(both, OPTIONS)
    assert [grade.score for grade in grades_of(both, Options(to="lti", combine="sum"))] == [9.0]
    assert [(g.score, g.max_score) for g in grades_of(both, Options(to="lti", combine="mean"))] == [
        (4.5, 10.0)
    ]
    assert [grade.score for grade in grades_of(both, Options(to="lti", position=2))] == [5.0]


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"combine": "best"}, "sum or mean"),
        ({"combine": "sum", "position": 1}, "not both"),
        ({"position": 7}, "no report"),
    ],
)
def test_a_choice_that_is_none_is_refused(choice, message):
    with pytest.raises(CallError, match=message):
        grades_of(results(report("s01", 4.0, position=1)), Options(to="lti", **choice))


def test_a_sum_waits_for_all_its_parts():
    half = results(report("s01", 4.0, position=1), report("s01", None, position=2, status="missing"))
    (grade,) = grades_of(half, Options(to="lti", combine="sum"))
    assert (grade.score, grade.withheld) == (None, (Reason("missing", {"position": 2}),))


@pytest.mark.parametrize(
    ("reports", "message"),
    [
        ([report("s01", 12.0)], "12 is not between 0 and 10"),
        ([report("s01", 0.0, max_score=0.0)], "maximum is 0"),
        ([report("s01", 1.0), report("s01", 2.0)], "s01: has two reports"),
        ([report("..", 1.0)], "is refused: "),
        ([report("a/b", 1.0)], "is refused: "),
    ],
)
def test_results_that_contradict_themselves_are_refused(reports, message):
    with pytest.raises(InputFileError, match=message):
        grades_of(results(*reports), OPTIONS)


def test_results_are_read_back_as_they_were_written(tmp_path):
    (tmp_path / "results.json").write_text(a_class().model_dump_json(), encoding="utf-8")
    assert read_results(tmp_path) == a_class()


@pytest.mark.parametrize("content", [None, "", "[]", '{"schema_version": 1}', "\udcff"])
def test_results_that_are_none_are_refused_with_what_to_do(content, tmp_path):
    if content is not None:
        (tmp_path / "results.json").write_text(content, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(InputFileError, match="grade"):
        read_results(tmp_path)


def test_comments_on_several_positions_say_which_is_which():
    both = [
        report("s01", 4.0, position=1, criteria=[criterion("v_A", "full", 5.0)]),
        report("s01", 5.0, position=2, criteria=[criterion("v_B", "none", 0.0, "Too long.")]),
    ]
    (grade,) = grades_of(results(*both), Options(to="lti", combine="sum", lang="ro"))
    assert comment(grade) == (
        "<p><b>Poziție 1</b></p><p>Totul este corect.</p>"
        "<p><b>Poziție 2</b></p><ul><li>✗ <b>Vector v_B</b>: Too long.</li></ul>"
    )


@pytest.mark.parametrize(("lang", "said"), [(None, "Totul este corect."), ("en", "Everything is right.")])
def test_comments_are_in_the_language_of_the_class_unless_another_is_asked_for(lang, said):
    romanian = results(report("s01", 5.0)).model_copy(update={"lang": "ro"})
    content = draft(romanian, Options(to="lti", lang=lang)).content
    assert said in (content if isinstance(content, str) else content.decode())


def test_a_long_row_of_names_ends_with_how_many_more():
    assert in_a_row(["a", "b"]) == "a, b"
    assert in_a_row(20 * ["a"] + ["b", "c"]).endswith("a and 2 more")
