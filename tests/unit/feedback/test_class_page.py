"""The class's page: everybody linked, everything that waits told, for classes of any size."""

import re

import pytest

from grader.documents import (
    AlikeDocument,
    CriterionMovedDocument,
    MovedDocument,
    ProblemDocument,
    ReadingDocument,
    ReadSheets,
    StaleDecisionDocument,
    StandingDocument,
)
from grader.feedback.class_page import index_page, write_demo_page
from grader.files import result_folders
from grader.language import LANGUAGES
from tests.unit.feedback.parsed import Page
from tests.unit.feedback.works import HOSTILE, criterion, report, results


def test_the_index_links_every_report_where_it_is():
    reports = [
        report(), report(student_id="s08", position=1), report(student_id="s08", position=2),
        report(student_id="s08", position=None),
    ]  # fmt: skip
    text = index_page(results(*reports), "en")
    for folder in ("s07", "s08/1", "s08/2", "s08/unknown"):
        assert f'href="{folder}/feedback.html"' in text
    assert result_folders(reports) == ["s07", "s08/1", "s08/2", "s08/unknown"]


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


def in_class(count, **changes):
    return [report(student_id=f"s{k:03d}", **changes) for k in range(count)]


@pytest.mark.parametrize("lang", LANGUAGES)
@pytest.mark.parametrize("count", [0, 1, 3, 30])
@pytest.mark.parametrize("state", ["graded", "needs_review", "missing", "unreadable"])
def test_classes_of_any_size_and_state_have_a_page(count, state, lang):
    score = 7.5 if state == "graded" else None
    page = Page(index_page(results(*in_class(count, status=state, score=score)), lang))
    assert page.open == []
    assert page.text.count("/feedback.html") == 0
    links = {attributes.get("href") for _tag, attributes in page.tags}
    assert {f"s{k:03d}/feedback.html" for k in range(count)} <= links


def told_alike(**changes):
    fields = {"students": ["s001", "s002"], "positions": [None, None], "why": ["hand_errors"],
              "measure": 0.00004, "share": 0.82, "compared": 31}  # fmt: skip
    return AlikeDocument(**{**fields, **changes})


def with_sheets(one):
    read = ReadingDocument(source="a.jpg", page=1, student_id=one.student_id, sheet=None, figures={})
    return one.model_copy(update={"reading": ReadSheets(sheets=[read])})


def test_look_alikes_are_no_accusation_and_link_both_pictures():
    made = results(*[with_sheets(one) for one in in_class(3)]).model_copy(update={"alike": [told_alike()]})
    page = Page(index_page(made, "ru"))
    assert "Это не обвинение" in page.text
    assert "совпадение 82 %, сравнено: 31" in page.text
    assert "0,00004" in page.text
    links = {attributes.get("href") for _tag, attributes in page.tags}
    assert {"s001/overlay.png", "s002/overlay.png"} <= links


def test_a_number_that_is_anothers_has_no_measure():
    alone = told_alike(why=["other_number"], measure=None, share=None, compared=0)
    text = Page(index_page(results(*in_class(3)).model_copy(update={"alike": [alone]}), "en")).text
    assert "drawn with the other's number" in text
    assert "By chance" not in text


def test_what_moved_tells_standing_criteria_and_why():
    before = StandingDocument(status="needs_review", score=None, score_range=(5.0, 7.5))
    after = StandingDocument(status="graded", score=7.5, score_range=(7.5, 7.5))
    change = CriterionMovedDocument(
        id="v_D", title="Vector v_D", before="review", after="full", points_after=2.5
    )
    moves = [
        MovedDocument(student_id="s001", before=before, after=after, why=["rubric"], criteria=[change]),
        MovedDocument(student_id="s777", before=before, after=None, why=["gone"]),
    ]
    text = Page(index_page(results(*in_class(3)).model_copy(update={"moved": moves}), "ro")).text
    assert "baremul a fost schimbat (1)" in text
    assert "s001 5–7,5 7,5 baremul a fost schimbat Vector v D : ? " in text
    assert "✓ corect (2,5)" in text
    assert "s777 5–7,5 – nu mai există" in text


def test_tiles_name_what_they_count():
    standing = StandingDocument(status="graded", score=7.5, score_range=(7.5, 7.5))
    for count, said in ((1, "1 → changed mark "), (2, "2 → changed marks ")):
        moves = [MovedDocument(student_id=f"s{k}", before=standing, after=None) for k in range(count)]
        waits = [report(student_id=f"w{k}", status="needs_review", score=None) for k in range(count)]
        text = Page(index_page(results(*waits).model_copy(update={"moved": moves}), "en")).text
        assert said in text
        assert f"{count} ? waiting for review" in text


def test_many_changed_criteria_of_a_student_unfold():
    standing = StandingDocument(status="graded", score=7.5, score_range=(7.5, 7.5))
    change = CriterionMovedDocument(id="v_D", title="Vector v_D", before="review", after="full")
    for count in (3, 4):
        move = MovedDocument(student_id="s001", before=standing, after=standing, criteria=[change] * count)
        text = index_page(results(*in_class(1)).model_copy(update={"moved": [move]}), "en")
        assert (f"<summary>{count} criteria</summary>" in text) == (count == 4)


def test_the_many_of_a_table_unfold_in_its_own_columns():
    waits = [report(student_id=f"w{k:02}", status="needs_review", score=None) for k in range(20)]
    section = index_page(results(*waits), "en").split('id="waits"')[1].split("</section>")[0]
    assert section.count("<table") == 1
    first, rest = section.split('<tbody class="rest">')
    assert re.search(r"<summary>and (\d+) more</summary>", first)[1] == str(rest.count("<tr>"))


def test_students_who_made_a_common_mistake_are_named_and_the_many_unfold():
    text = index_page(results(*in_class(30)), "en")
    before = text.split("Students</h2>")[0]
    assert "s011/feedback.html" in before
    assert "and 18 more" in Page(text).text


def test_several_positions_of_a_student_are_told_apart_everywhere():
    reports = [
        report(student_id="s1", position=k, status="needs_review", score=None, score_range=(k, 10.0))
        for k in (1, 2)
    ]
    text = Page(index_page(results(*reports), "en")).text
    assert text.index("s1, 1 9 1–10") < text.index("s1, 2 8 2–10")


def test_the_page_says_what_to_do_next_with_the_folder_as_a_command_names_it():
    waits = report(status="needs_review", score=None, score_range=(5.0, 7.5))
    text = Page(index_page(results(waits, report(student_id="s08")), "en", out="my marks")).text
    assert "planmark review 'my marks'" in text
    assert "planmark export" in text


def test_on_a_server_the_next_steps_are_links_and_neither_commands_nor_folders():
    waits = report(status="needs_review", score=None, score_range=(5.0, 7.5))
    links = ("/review/KEY/", "/publications/KEY#export")
    page = Page(index_page(results(waits, report(student_id="s08")), "en", out="/srv/marks", addresses=links))
    found = {attributes.get("href") for tag, attributes in page.tags if tag == "a"}
    assert set(links) <= found
    assert "planmark " not in page.text
    assert "/srv" not in page.text
    assert "Decide the open questions" in page.text


def test_a_finished_class_asks_for_no_review():
    finished = results(report()).model_copy(update={"unmatched": []})
    text = Page(index_page(finished, "en")).text
    assert "planmark review" not in text
    assert "planmark export OUT --to moodle" in text


def test_how_many_verdicts_may_be_wrong_is_told_where_it_is_known():
    made = results(report())
    assert "may be wrong" not in index_page(made, "en")
    told = index_page(made.model_copy(update={"expected_wrong": 0.0312}), "en")
    assert "Of 2 verdicts that nobody has checked, about 0.03 may be wrong." in told


def test_outdated_decisions_are_listed_with_line_and_reason():
    stale = StaleDecisionDocument(
        line=4, student_id="s07", criterion="v_B", verdict="full", by=HOSTILE, at="2026-11-22T10:00:00+00:00",
        reason="what was handed in has changed since",
    )  # fmt: skip
    made = results(report()).model_copy(update={"stale": [stale], "titles": {"v_B": "Velocity of B"}})
    text = Page(index_page(made, "en")).text
    assert f"4 Velocity of B: right {HOSTILE}, 2026-11-22 what was handed in has changed since" in text
    assert "ceea ce s-a predat s-a schimbat" in index_page(made, "ro")


def test_on_a_phone_every_table_with_more_than_two_columns_is_cards():
    made = results(*in_class(3)).model_copy(update={"alike": [told_alike()]})
    for tag, attributes in Page(index_page(made, "en")).tags:
        if tag == "table" and "id" in attributes:
            assert "cards" in attributes["class"]
    assert 'class="card scroll"' not in index_page(made, "en")


def test_the_demos_page_leads_to_every_class(tmp_path):
    waits = report(status="needs_review", score=None, score_range=(5.0, 7.5))
    classes = {"pump": ("Pump", results(waits)), "press": (HOSTILE, results(report()))}
    write_demo_page(classes, tmp_path, "en")
    page = Page((tmp_path / "index.html").read_text(encoding="utf-8"))
    assert page.open == []
    links = {attributes.get("href") for tag, attributes in page.tags if tag == "a"}
    assert links == {"pump/index.html", "press/index.html"}
    assert f"planmark review {tmp_path}/pump" in page.text


def test_what_waits_has_its_likely_score_where_that_is_known():
    waits = report(status="needs_review", score=None, score_range=(5.0, 7.5), expected_score=7.1)
    assert "5–7.5 ≈ 7.1" in Page(index_page(results(waits), "en")).text
    unknown = waits.model_copy(update={"expected_score": None})
    assert "≈ 7" not in Page(index_page(results(unknown), "en")).text
