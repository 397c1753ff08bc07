"""The class's page: everybody linked, everything that waits told, for classes of any size."""

from grader.documents import ProblemDocument
from grader.feedback import write_index
from grader.feedback.class_page import folders_of, index_page
from tests.unit.feedback.parsed import Page
from tests.unit.feedback.works import HOSTILE, criterion, report, results


def test_the_index_links_every_report_where_it_is(tmp_path):
    reports = [
        report(), report(student_id="s08", position=1), report(student_id="s08", position=2),
        report(student_id="s08", position=None),
    ]  # fmt: skip
    write_index(results(*reports), tmp_path, "en")
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    for folder in ("s07", "s08/1", "s08/2", "s08/unknown"):
        assert f'href="{folder}/feedback.html"' in text
    assert folders_of(reports) == ["s07", "s08/1", "s08/2", "s08/unknown"]


def test_the_index_counts_states_and_lists_what_matches_nobody():
    text = Page(
        index_page(results(report(), report(student_id="s09", status="missing", score=None)), "en")
    ).text
    assert "1 ✓ graded" in text
    assert "1 – nothing handed in" in text
    assert HOSTILE in text


def test_the_index_names_the_hardest_criteria_and_commonest_mistakes():
    hard = report(criteria=[criterion("v_D", "none", 0.0), criterion("v_A", "full", 5.0)])
    text = Page(index_page(results(hard), "en")).text
    after = text.split("Hardest criteria")[1].split("Students")[0]
    assert "v D 0 %" in after
    assert "v A" not in after
    assert "Normal component reversed" in after


def test_the_same_problem_many_times_is_told_once_with_its_number():
    many = [ProblemDocument(code="measurement_fault", message=f"line {k}", file="m.csv") for k in range(9)]
    text = Page(index_page(results(report(problems=many)), "en")).text
    assert text.count("could not be used") == 1
    assert "×9" in text


def test_an_empty_class_has_a_page():
    assert Page(index_page(results(), "ru")).open == []
