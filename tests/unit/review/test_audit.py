"""Settled verdicts are checked one by one; a wrong one opens those like it at once, and can be corrected."""

import pytest

from grader.review.audit import SHORT


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
