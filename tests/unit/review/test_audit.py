"""Settled verdicts are checked one by one; a wrong one opens those like it at once, and can be corrected."""

import json

import pytest

from grader.language import tongue
from grader.overlay.scene import COLOURS
from grader.review.audit import LEAST_FOR_AC1, SHORT, agreement
from grader.review.server import application
from grader.tables.decisions import VERDICTS
from tests.unit.review.conftest import Page


def checked(page, question, answer, **said):
    about = {name: question[name] for name in ("student", "criterion", "said")} | {
        "seen": question["checked"]
    }
    return page.said("/api/audit", **{**about, "answer": answer, **said})


def test_a_verdict_is_shown_without_its_probability_and_answered_with_one_key(page, session):
    facts = page.get("/api/audit").json()
    question = facts["question"]
    assert (facts["checked"], facts["found"]) == (0, "")
    assert facts["short"] <= SHORT
    assert "%" not in question["asks"]
    assert not {"probability", "proposed", "state", "why"} & set(question)
    after = checked(page, question, "right").json()
    assert after["checked"] == 1
    assert after["found"].startswith("1 of 1 verdicts checked at random were right")
    assert (after["question"]["student"], after["question"]["criterion"]) != (
        question["student"], question["criterion"],
    )  # fmt: skip
    (row,) = session._file.all()
    assert (row.criterion, row.verdict) == (
        f"audit:{question['criterion']}",
        f"right; said={question['said']}",
    )
    assert row.basis.startswith("b")
    assert row.by == "Ana"
    assert not any(row["decided"] for row in page.rows().values())


def test_the_same_sample_is_gone_on_with_and_an_answer_is_taken_back(page, session):
    first = page.get("/api/audit").json()["question"]
    second = checked(page, first, "unclear").json()["question"]
    assert page.get("/api/audit").json()["question"]["criterion"] == second["criterion"]
    undone = page.said("/api/undo").json()["undone"]
    assert undone == f"{first['student']}/audit:{first['criterion']}"
    again = page.get("/api/audit").json()
    assert (again["question"]["student"], again["question"]["criterion"]) == (
        first["student"],
        first["criterion"],
    )
    assert again["checked"] == 0
    assert not session._file.all()


def test_a_wrong_verdict_waits_at_once_until_it_is_corrected(page):
    question = page.get("/api/audit").json()["question"]
    key = question["student"], question["criterion"]
    assert page.rows()[key]["verdict"] == question["said"]
    checked(page, question, "wrong")
    assert page.rows()[key]["verdict"] == "review"
    page.answer(*key, "none")
    assert page.rows()[key]["verdict"] == "none"


@pytest.mark.slow
def test_taking_a_wrong_answer_back_settles_what_it_had_opened(page):
    before = {key: row["verdict"] for key, row in page.rows().items()}
    checked(page, page.get("/api/audit").json()["question"], "wrong")
    assert {key: row["verdict"] for key, row in page.rows().items()} != before
    page.said("/api/undo")
    assert {key: row["verdict"] for key, row in page.rows().items()} == before


def test_all_can_be_checked_and_then_nothing_is_open_about_them(page):
    facts, count = page.get("/api/audit").json(), 0
    while facts["question"]:
        facts = checked(page, facts["question"], "right").json()
        count += 1
    assert facts["checked"] == count
    assert "at most 0\N{NO-BREAK SPACE}%" in facts["found"]


def test_what_somebody_else_has_checked_in_the_meantime_is_told_and_not_written_over(page, session):
    question = page.get("/api/audit").json()["question"]
    checked(page, question, "wrong", by="Ion")
    late = checked(page, question, "right")
    assert late.status_code == 409
    assert "Ion has decided this" in late.json()["message"]
    (row,) = session._file.all()
    assert row.verdict.startswith("wrong")


def test_what_is_no_answer_is_refused(page):
    question = page.get("/api/audit").json()["question"]
    assert checked(page, question, "perhaps").status_code == 400
    assert checked(page, question, "right", said="splendid").status_code == 400
    assert checked(page, question, "right", criterion="v_X").status_code == 400
    assert checked(page, question, "right", student="nobody").status_code == 400


def test_the_page_and_its_script_are_there(page):
    assert "audit.js" in page.get("/audit").text
    assert "use strict" in page.get("/audit.js").text
    assert 'href="audit"' in page.get("/").text


# A second marking -----------------------------------------------------------------------------------


def second(page, by="Ion", share=100):
    return page.get("/api/second", params={"by": by, "share": share}).json()


def marked(page, question, verdict, **said):
    about = {name: question[name] for name in ("student", "criterion", "seen")}
    return page.said("/api/second", **{**about, "verdict": verdict, "share": 100, "by": "Ion", **said})


def test_a_decision_is_marked_again_by_another_person_who_does_not_see_it(page, session):
    page.answer("s02", "v_B", "none", comment="turned round")
    page.said("/api/ink", student="s02", sheet=0, strokes=[[[100, 200], [120, 220]]])
    assert second(page, by=" ana")["question"] is None
    question = second(page)["question"]
    assert (question["student"], question["criterion"]) == ("s02", "v_B")
    shown = json.dumps(question, ensure_ascii=False)
    assert not [told for told in ("Ana", "wrong", "turned round", COLOURS["none"]) if told in shown]
    assert COLOURS["review"] in question["look"]["marks"]
    assert question["look"]["ink"] == ""
    rows = page.rows()
    told = marked(page, question, "full").json()
    assert page.rows() == rows
    row = session._file.all()[-1]
    assert (row.criterion, row.verdict, row.by) == ("second:v_B", "full; said=none", "Ion")
    assert row.points == session.student("s02").criterion("v_B").max_points
    assert told["question"] is None
    assert told["found"].startswith("Equal verdicts: 0 of 1")
    (pair,) = told["differ"]
    assert pair["said"] == "Ana: wrong, Ion: right"


def test_a_disagreement_is_settled_by_a_later_decision_and_stays_in_the_figures(page):
    page.answer("s09", "v_B", "none")
    marked(page, second(page)["question"], "full")
    question = page.get("/api/question", params={"student": "s09", "criterion": "v_B"}).json()
    assert "Ion" in question["why"]
    page.answer("s09", "v_B", "full")
    assert second(page)["differ"] == []
    assert second(page)["found"].startswith("Equal verdicts: 0 of 1")


def test_other_points_of_the_same_verdict_are_a_disagreement(page):
    page.answer("s09", "v_B", "partial", points=1)
    told = marked(page, second(page)["question"], "partial", points=0.5).json()
    assert "second minus first: −0.5" in told["found"]
    assert len(told["differ"]) == 1


def test_the_share_is_drawn_alike_for_everybody_and_a_larger_one_has_the_smaller(page):
    for name in ("v_A", "v_B", "v_D", "v_DC", "a_D"):
        page.answer("s09", name, "full")
    assert [second(page, share=share)["short"] for share in (1, 20, 21, 40, 100)] == [1, 1, 2, 2, 5]
    assert second(page, by="Maria", share=20)["question"] == second(page, share=100)["question"]
    marked(page, second(page, share=20)["question"], "full")
    assert second(page, share=20)["question"] is None
    assert second(page, share=40)["question"]


def test_what_is_no_second_marking_is_refused(page, session):
    page.answer("s09", "v_B", "none")
    question = second(page)["question"]
    assert marked(page, question, "full", by="Ana").status_code == 400
    assert marked(page, question, "perfect").status_code == 400
    assert marked(page, question, "partial", points=50).status_code == 400
    assert marked(page, {**question, "criterion": "v_D"}, "full").status_code == 400
    assert len(session._file.all()) == 1


def test_agreement_beyond_chance_is_told_of_enough_criteria():
    english = tongue("en")
    same = [("full", "full", 0.0)] * LEAST_FOR_AC1
    assert agreement(same, english).endswith("(Gwet's AC1): 1.")
    assert "AC1" not in agreement(same[1:], english)
    by_chance = [(first, again, None) for first in VERDICTS for again in VERDICTS] * 2
    assert agreement(by_chance, english).endswith("(Gwet's AC1): 0.")


def test_on_a_server_the_account_marks_whoever_the_page_says(session):
    page = Page(application(session, by="Ana"), base_url="http://127.0.0.1:8321")
    page.answer("s09", "v_B", "none")
    assert second(page, by="Ion")["question"] is None
