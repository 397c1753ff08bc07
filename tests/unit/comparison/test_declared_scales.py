"""The scale that counts as declared if boxes, roster and drawing agree or do not."""

import numpy as np
import pytest

from grader.comparison.scales import BEYOND_DOUBT, declarations
from grader.comparison.scales import LIKELY as LEAST
from grader.comparison.task import task_of
from grader.records import MECHANISM, Figure, Reading, ReadNode, Written
from grader.rubric import load_rubric
from grader.tables.scale_text import SURE, sure_texts
from grader.texts.spoken import message
from reference.authored.assignment import load_assignment

FIRM, LIKELY, FAIR, DOUBTFUL = (
    (BEYOND_DOUBT + 1.0) / 2.0,
    (SURE + BEYOND_DOUBT) / 2.0,
    SURE / 2.0,
    LEAST / 2.0,
)
RULED, OTHER = "0.005 m/mm", "0.0061 m/mm"
"""The kL that the assignment's rule proposes, and another that nothing bears out."""


@pytest.fixture(scope="module")
def task():
    assignment = load_assignment("pump")
    variant = assignment.variant(7)
    assert float(assignment.scales([variant]).kL[0]) == pytest.approx(0.005)
    return task_of(assignment, load_rubric(assignment.file.rubric, beside=assignment.path), variant)


def reading(text: str, confidence: float, name: str = "kL") -> Reading:
    return Reading({}, written={name: Written(text, confidence)})


def codes(found) -> list[str]:
    return [problem.code for problem in found.problems]


def test_a_box_read_surely_and_borne_out_counts(task):
    found = declarations(task, {"roster": {}}, [reading(RULED, LIKELY)])
    assert found.texts == {"kL": RULED}
    assert found.sources == {"kL": "box"}
    assert not found.problems


def test_a_box_that_nothing_bears_out_needs_to_be_read_beyond_doubt(task):
    likely = declarations(task, {}, [reading(OTHER, LIKELY)])
    firm = declarations(task, {}, [reading(OTHER, FIRM)])
    assert (likely.texts, codes(likely)) == ({}, ["scale_box_doubtful"])
    assert (firm.texts, codes(firm)) == ({"kL": OTHER}, [])


def test_a_doubtful_box_is_told_with_what_it_seems_to_read_and_not_used(task):
    found = declarations(task, {}, [reading(RULED, DOUBTFUL)])
    assert found.texts == {}
    assert codes(found) == ["scale_box_doubtful"]
    assert RULED in message(found.problems[0])


def test_a_fairly_read_box_counts_only_where_it_says_the_very_scale_of_the_rule(task):
    very = declarations(task, {}, [reading(RULED, FAIR)])
    near = declarations(task, {}, [reading("0.00505 m/mm", FAIR)])
    assert (very.texts, codes(very)) == ({"kL": RULED}, [])
    assert (near.texts, codes(near)) == ({}, ["scale_box_doubtful"])


def test_an_unreadable_box_is_told(task):
    found = declarations(task, {}, [reading("", 0.0)])
    assert found.texts == {}
    assert codes(found) == ["scale_box_unread"]


def test_the_roster_counts_before_the_box_and_a_contradiction_is_told(task):
    agreeing = declarations(task, {"roster": {"kL": "1:5"}}, [reading(RULED, LIKELY)])
    contrary = declarations(task, {"roster": {"kL": OTHER}}, [reading(RULED, LIKELY)])
    assert (agreeing.texts, codes(agreeing)) == ({"kL": "1:5"}, [])
    assert (contrary.texts, codes(contrary)) == ({"kL": OTHER}, ["scale_box_disagrees"])
    assert contrary.sources == {"kL": "roster"}


def test_an_unreadable_box_does_not_matter_where_the_roster_says_the_scale(task):
    found = declarations(task, {"roster": {"kL": RULED}}, [reading("", 0.0)])
    assert not found.problems


@pytest.mark.parametrize(
    ("roster", "entered"),
    [("1:5", "5 cm/cm"), (RULED, "0.00501 m/mm"), ("1:5", "kL = 1:5")],
)
def test_roster_and_measurements_that_mean_one_scale_agree(task, roster, entered):
    found = declarations(task, {"roster": {"kL": roster}, "measurements": {"kL": entered}}, [])
    assert found.sources == {"kL": "measurements"}
    assert found.texts == {"kL": entered}
    assert not found.problems


def test_a_rule_and_the_value_that_it_gives_are_one_scale(task):
    value = f"{task.omega * task.rule_scales['kL']:.6f} (m/s)/mm"
    found = declarations(task, {"roster": {"kv": "omega kL"}, "measurements": {"kv": value}}, [])
    assert found.texts == {"kv": value}


@pytest.mark.parametrize("entered", [RULED, "five", "0.0052 m/mm"])
def test_of_two_scales_that_contradict_each_other_none_counts_nor_does_the_box(task, entered):
    sources = {"roster": {"kL": OTHER}, "measurements": {"kL": entered}}
    found = declarations(task, sources, [reading(RULED, FIRM)])
    assert (found.texts, codes(found)) == ({}, ["scale_disagrees"])
    assert f"'{OTHER}' in the roster, '{entered}' in the measurements" in message(found.problems[0])
    assert [(gap.name, *gap.reason.parameters["entries"]) for gap in found.unread] == [
        ("kL", f"'{OTHER}' / '{entered}'")
    ]


def test_two_files_of_measurements_may_contradict_each_other(task):
    found = declarations(task, {"measurements": {"kL": RULED}}, [], [{"kL": RULED}, {"kL": OTHER}])
    assert codes(found) == ["scale_disagrees"]
    assert found.texts == {}


def test_two_sheets_whose_boxes_contradict_each_other_give_nothing(task):
    found = declarations(task, {}, [reading(RULED, FIRM), reading(OTHER, FIRM)])
    assert found.texts == {}
    assert codes(found) == ["scale_box_disagrees"]


def test_a_rule_written_in_the_box_counts(task):
    found = declarations(task, {}, [reading("ωkL", LIKELY, "kv")])
    assert found.texts == {"kv": "ωkL"}


def test_a_scale_by_the_rule_follows_the_drawn_crank_where_nobody_declares_the_scale_of_lengths(task):
    def nodes(crank_mm):
        ends = {task.yardstick.tail: 0j, task.yardstick.head: complex(crank_mm)}
        return {name: ReadNode(at, 0.01 * np.eye(2), 0.99) for name, at in ends.items()}

    text = f"{task.omega * 0.006:.4f} (m/s)/mm"
    written = {"kv": Written(text, LIKELY)}
    found = [
        declarations(task, {}, [Reading({MECHANISM: Figure(nodes(crank), {})}, written=written)])
        for crank in (50.0, 60.0)
    ]
    assert [one.texts for one in found] == [{"kv": text}, {}]


def test_before_the_drawing_is_read_only_sure_boxes_are_taken():
    sure, unsure = {"kL": Written(RULED, LIKELY)}, {"kL": Written(OTHER, DOUBTFUL)}
    assert sure_texts([sure]) == {"kL": RULED}
    assert sure_texts([sure, unsure]) == {}
    assert sure_texts([]) == {}
