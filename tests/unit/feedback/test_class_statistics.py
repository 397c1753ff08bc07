"""The class in figures."""

import re

from grader.documents import DecidedDocument, MistakeDocument, Quantity, ScaleDocument
from grader.feedback.class_page import index_page
from grader.feedback.class_statistics import (
    commonest,
    follow_through,
    hardest,
    histogram,
    open_shares,
    settled,
    shares,
    spread,
    waiting,
    wrong_scales,
)
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
    assert [(hard.title, hard.earned) for hard in found] == [("Vector v_B", 0.25), ("Vector v_A", 0.75)]


def test_a_mistake_made_twice_by_one_student_counts_once():
    twice = report(mistakes=[*report().mistakes, *report().mistakes])
    made = results(twice, report())
    assert commonest(made) == [("normal component reversed", made.reports)]


def test_a_slip_of_known_cause_is_counted_apart():
    slips = [
        report(
            mistakes=[
                MistakeDocument(code="arithmetic", at="n_B", explains=[], confidence=0.9, parameters=found)
            ]
        )
        for found in ({"factor": 0.5}, {"slip": "right_triangle"}, {"slip": "right_triangle"})
    ]
    assert [(title, len(reports)) for title, reports in commonest(results(*slips))] == [
        ("right triangle at scales that do not allow it", 2),
        ("slip in the arithmetic", 1),
    ]


def test_there_is_no_chart_without_scores():
    assert 'class="chart"' not in index_page(results(), "en")


def test_what_waits_is_in_the_chart_at_the_middle_of_its_range():
    waiting = report(score=None, status="needs_review", score_range=(2.0, 6.0))
    assert open_shares(results(waiting, report(), report(status="missing", score=None))) == [0.4]
    assert 'class="waits"' in index_page(results(waiting), "en")


def test_a_bar_is_as_high_as_its_count_beside_the_tallest():
    made = results(*[report(score=9.5)] * 4, report(score=1.5))
    heights = re.findall(r'class="final" [^>]*height="([\d.]+)"', index_page(made, "en"))
    assert heights == ["20.0", "80.0"]


def test_mean_and_median_are_of_final_scores_alone():
    found = spread(results(report(score=2.0), report(score=4.0), report(score=9.0), report(score=None)))
    assert (found.mean, found.median, found.least, found.largest) == (0.5, 0.4, 0.2, 0.9)
    assert spread(results()) is None


def test_that_comes_first_which_one_look_decides_most_of():
    little = report(student_id="a", status="needs_review", score=None, score_range=(9.0, 10.0))
    much = report(student_id="b", status="needs_review", score=None, score_range=(2.0, 8.0))
    lost = report(student_id="c", status="unreadable", score=None, score_range=None, criteria=[])
    found = waiting(results(little, report(), much, lost))
    assert [(one.report.student_id, one.points) for one in found] == [("c", 10.0), ("b", 6.0), ("a", 1.0)]


def test_follow_through_is_counted_by_points_students_and_criteria():
    one = report(criteria=[criterion("v_B", "follow_through", 5.0), criterion("v_D", "follow_through", 2.0)])
    two = report(criteria=[criterion("v_B", "follow_through", 5.0), criterion("v_D", "full", 5.0)])
    found = follow_through(results(report(), one, two))
    assert (found.points, found.reports) == (12.0, [one, two])
    assert found.criteria == [("Vector v_B", 2), ("Vector v_D", 1)]


def test_scales_lost_or_not_understood_are_told_and_links_are_no_scales():
    def about(name, verdict, unit):
        quantity = Quantity(value=0.05, unit=unit)
        return criterion(name, verdict, 0.0).model_copy(update={"vector": None, "expected": quantity})

    refused = {"ka": ScaleDocument(declared=None, used=1.0, assumed=True, text="bla", refused="why")}
    one = report(criteria=[about("kv", "none", "(m/s)/mm"), about("AB", "none", None)], scales={})
    two = report(criteria=[about("kv", "full", "(m/s)/mm")], scales=refused)
    found = wrong_scales(results(report(), one, two))
    assert [(of, [c.id for c in lost], text) for of, lost, text in found] == [
        (one, ["kv"], []), (two, [], ["ka = bla"]),
    ]  # fmt: skip


def test_titles_are_those_of_the_class_not_of_a_students_language():
    russian = report(criteria=[criterion("v_A", "none", 0.0, title="Скорость точки A")])
    made = results(russian).model_copy(update={"titles": {"v_A": "Velocity of A"}})
    assert hardest(made)[0].title == "Velocity of A"


def test_verdicts_that_a_person_decided_are_not_the_programs():
    decided = DecidedDocument(by="x", at="2026-11-22T10:00:00+00:00", before="review")
    rows = [
        criterion("v_A"),
        criterion("v_B").model_copy(update={"decided": decided}),
        criterion("v_C", "review", None),
    ]
    assert settled(results(report(criteria=rows))) == 1
