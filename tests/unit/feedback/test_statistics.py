"""The class in figures."""

from grader.feedback.charts import distribution_svg
from grader.feedback.statistics import commonest, hardest, histogram, shares
from grader.i18n import tongue
from tests.unit.feedback.works import criterion, report, results


def test_scores_that_wait_are_not_in_the_distribution():
    waiting = report(score=None, status="needs_review")
    assert shares(results(report(score=5.0), waiting)) == [0.5]


def test_bins_hold_their_lower_end_and_the_last_one_full_marks():
    assert histogram([0.0, 0.1, 0.3, 0.7, 0.999, 1.0]) == [1, 1, 0, 1, 0, 0, 0, 1, 0, 2]


def test_every_score_is_in_some_bin():
    values = [k / 997 for k in range(998)]
    assert sum(histogram(values)) == len(values)


def test_what_was_not_judged_makes_a_criterion_no_harder():
    one = report(criteria=[criterion("v_A", "not_judged", None), criterion("v_B", "review", None)])
    assert hardest(results(one)) == []


def test_the_hardest_criterion_comes_first():
    one = report(criteria=[criterion("v_A", "partial", 2.5), criterion("v_B", "none", 0.0)])
    two = report(criteria=[criterion("v_A", "full", 5.0), criterion("v_B", "partial", 2.5)])
    found = hardest(results(one, two))
    assert [(hard.vector, hard.earned, hard.judged) for hard in found] == [("v_B", 0.25, 2), ("v_A", 0.75, 2)]


def test_a_mistake_made_twice_by_one_student_counts_once():
    twice = report(mistakes=[*report().mistakes, *report().mistakes])
    assert commonest(results(twice, report())) == [("normal_reversed", [0, 1])]


def test_there_is_no_chart_without_scores():
    assert distribution_svg(results(), tongue("en")) == ""
