"""The student's page: mistakes first, each where it is seen, and open criteria with their reasons."""

import re
from dataclasses import replace

from grader.documents import (
    DecidedDocument,
    MistakeDocument,
    Quantity,
    RivalDocument,
    Tolerance,
)
from grader.feedback.student_page import GROUPS, About, StudentPage, feedback_page
from grader.language import tongue
from grader.overlay.scene import Arrow
from tests.unit.feedback.parsed import Page
from tests.unit.feedback.works import criterion, picture, report


def page_of(one, pictures=(), level="full"):
    return StudentPage(one, tuple(pictures), tongue("en"), level, About(names={}))


def mistake(code, at, explains):
    return MistakeDocument(code=code, at=at, explains=explains, confidence=0.9, feedback=f"{code} said")


def test_mistakes_come_in_the_order_of_the_drawing_not_of_their_certainty():
    one = report(
        criteria=[criterion("v_A", "none", 0.0), criterion("v_B", "none", 0.0)],
        mistakes=[mistake("wrong_link", "b", ["v_B"]), mistake("sense_reversed", "a", ["v_A"])],
    )
    assert [action.at for action in page_of(one).actions] == ["a", "b"]


def test_what_no_mistake_explains_is_told_too_with_a_closer_look():
    one = report(criteria=[criterion("v_B", "none", 0.0), criterion("v_C", "partial", 1.0)], mistakes=[])
    page = page_of(one, [picture()])
    assert page.actions == []
    assert [row.id for row in page.group("lost").rows] == ["v_B", "v_C"]
    assert set(page.view_of_others.names) <= {"v_B", "v_C"}
    explained = report(
        criteria=[criterion("v_B", "none", 0.0)], mistakes=[mistake("wrong_link", "b", ["v_B"])]
    )
    assert page_of(explained, [picture()]).view_of_others is None


def test_a_heading_names_the_two_likeliest_mistakes_and_no_more():
    rivals = [
        RivalDocument(code=code, at="b", confidence=0.2)
        for code in ("sense_reversed", "normal_missing", "wrong_intersection")
    ]
    doubtful = mistake("wrong_link", "b", ["v_B"]).model_copy(update={"rivals": rivals})
    (action,) = page_of(report(criteria=[criterion("v_B", "none", 0.0)], mistakes=[doubtful])).actions
    assert action.title == "Line drawn by the wrong link or sense reversed"


def test_a_mistake_of_which_everything_waits_is_not_called_certain():
    waits = [criterion("v_A", "review", None), criterion("v_B", "review", None)]
    one = report(criteria=waits, mistakes=[mistake("wrong_link", "b", ["v_A", "v_B"])])
    assert page_of(one).actions[0].is_open
    told = Page(feedback_page(one, [], "en")).text
    assert "What may be wrong Wrong link" in told.replace("Line drawn by the wrong link", "Wrong link")
    assert "Not certain yet" in told
    beside = [waits[0], criterion("v_B")]
    assert page_of(one.model_copy(update={"criteria": beside})).actions[0].is_open
    lost = [waits[0], criterion("v_B", "none", 0.0)]
    assert not page_of(one.model_copy(update={"criteria": lost})).actions[0].is_open


def test_what_is_wrong_comes_first_then_what_waits_and_what_is_right_is_folded():
    rows = [criterion("v_A"), criterion("v_B", "review", None), criterion("v_C", "none", 0.0)]
    text = feedback_page(report(criteria=rows, mistakes=[]), [picture()], "en")
    places = [
        text.index(words) for words in ("What is wrong", "What a person must still look at", "The drawing")
    ]
    assert places == sorted(places)
    right = text[text.index("The drawing") :]
    assert re.search(r"<details class=.card.>\s*<summary>.*Right: 1</b>.*5 <span[^>]*>/ 5", right)
    assert "Vector" not in right.partition("<details")[0]


def test_every_criterion_stands_in_one_group():
    verdicts = ["full", "partial", "none", "follow_through", "review", "not_judged"]
    rows = [criterion(f"v_{verdict[0].upper()}", verdict, None) for verdict in verdicts]
    page = page_of(report(criteria=rows, mistakes=[]))
    shown = [row.verdict for name in GROUPS for row in page.group(name).rows]
    assert sorted(shown) == sorted(verdicts)


def test_what_a_person_decided_is_told_with_the_comment():
    decided = DecidedDocument(
        by="A. B.", at="2026-11-22T10:00:00+00:00", before="review", comment="Well seen."
    )
    row = criterion("v_A").model_copy(update={"decided": decided})
    one = report(criteria=[row], mistakes=[], comment="Use a sharper pencil.", added=0.5)
    text = Page(feedback_page(one, [], "en")).text
    assert "checked by a person" in text
    for words in ("Use a sharper pencil.", "Vector v A : Well seen.", "A person added 0.5."):
        assert words in text
    assert "A. B." not in text


def test_one_comment_on_several_criteria_is_told_once():
    decided = DecidedDocument(by="x", at="2026-11-22T10:00:00+00:00", before=None, comment="It is here.")
    rows = [
        criterion(name, feedback="A person has decided this.").model_copy(
            update={"decided": decided, "reasons": ["decided"], "mistake": None}
        )
        for name in ("v_A", "v_B")
    ]
    page = page_of(report(criteria=rows, mistakes=[]))
    assert page.remarks_of_people == [("Vector v_A, Vector v_B", "It is here.")]
    assert page.sentence(rows[0]) == ""


def test_what_waits_is_told_with_what_it_is_likely_to_be():
    rows = [
        criterion(name, "review", None).model_copy(update={"proposed": proposed, "probability": probability})
        for name, proposed, probability in (
            ("v_A", "full", 0.9),
            ("v_B", "full", 0.9),
            ("v_C", "none", 0.9),
            # Nothing speaks for this one.
            ("v_D", "follow_through", 0.5),
        )
    ]
    assert page_of(report(criteria=rows, mistakes=[])).likely == [("full", 2), ("none", 1)]
    assert (
        "Most likely: ✓ 2 right, ✗ 1 wrong"
        in Page(feedback_page(report(criteria=rows, mistakes=[]), [], "en")).text
    )


def test_what_was_read_is_not_called_unread():
    unsure = criterion("v_B", "review", None).model_copy(update={"reasons": ["unread"]})
    nothing = unsure.model_copy(update={"measured": Quantity()})
    told = [page_of(report(criteria=[row], mistakes=[])).waiting[0][0] for row in (unsure, nothing)]
    assert told == ["read with too little certainty", "not read on the sheet"]


def test_what_was_expected_from_own_values_says_so():
    own = criterion("v_B", "follow_through").model_copy(update={"reasons": ["follows"]})
    assert page_of(report(criteria=[own], mistakes=[])).tolerance(own)[-1] == "from your own values"


def test_no_direction_is_shown_where_none_is_judged():
    short = criterion("v_B").model_copy(
        update={
            "expected": Quantity(length_mm=0.4, direction_deg=90.0),
            "reasons": ["right", "too_short_to_judge"],
        }
    )
    page = page_of(report(criteria=[short], mistakes=[]))
    assert page.expected(short) == ["0.4\u00a0mm"]
    assert page.tolerance(short) == ["±1.0\u00a0mm"]


def test_a_right_drawing_has_nothing_to_put_right():
    one = report(criteria=[criterion("v_B")], mistakes=[])
    assert page_of(one).actions == []
    assert page_of(one).waiting == []


def test_a_mistake_is_shown_close_up_with_what_was_expected():
    one = report(criteria=[criterion("v_B", "none", 0.0)], mistakes=[mistake("wrong_link", "b", ["v_B"])])
    (action,) = page_of(one, [picture()]).actions
    assert action.view.names == ("v_B",)
    x, y, wide, high = action.view.box
    tip_and_aim = ((160.0, 130.0), (160.0, 150.0))
    assert all(x < at[0] < x + wide and y < at[1] < y + high for at in tip_and_aim)


def test_what_waits_is_told_by_its_reason():
    near = criterion("v_B", "review", None).model_copy(update={"reasons": ["near_limit"]})
    doubtful = [
        criterion(name, "review", None).model_copy(update={"reasons": ["doubtful", "near_limit"]})
        for name in ("v_A", "v_C")
    ]
    waiting = page_of(report(criteria=[near, *doubtful], mistakes=[])).waiting
    assert [names for _why, names in waiting] == [["v_B"], ["v_A", "v_C"]]
    assert waiting[1][0] == "read with too little certainty"


def test_a_review_for_a_reason_without_words_is_told_as_open():
    odd = criterion("v_B", "review", None).model_copy(update={"reasons": ["brand_new"]})
    assert page_of(report(criteria=[odd], mistakes=[])).waiting[0][0] == "open"


def test_a_picture_is_told_in_words_for_those_who_do_not_see_it():
    one = report(criteria=[criterion("v_A"), criterion("v_B", "none", 0.0)], mistakes=[])
    page = page_of(one, [picture()])
    plan = next(view for view in page.views[0] if view.kind == "velocity_plan")
    assert page.description(plan) == "the velocity plan. v_A: right; v_B: wrong"


def test_plans_as_measured_have_no_sheet_beneath_them():
    page = page_of(report(), [picture(scanned=False)])
    views, whole = page.views
    assert [view.kind for view in views] == ["velocity_plan"]
    assert whole == []
    assert "entered measurements" in page.below(views[0])


def test_a_sheet_that_shows_no_more_than_its_plans_is_folded():
    views, whole = page_of(report(), [picture(), picture("s07_2.jpg", spread=250.0)]).views
    assert [view.kind for view in views] == ["velocity_plan", "sheet"]
    assert [view.picture for view in whole] == [0]


def test_what_is_not_required_and_not_there_takes_one_line():
    omega = criterion("omega_2", "not_judged", None).model_copy(
        update={"reasons": ["optional", "not_measured"]}
    )
    page = page_of(report(criteria=[criterion("v_A"), omega], mistakes=[]))
    assert page.group("not_judged").rows == ()
    assert [one.striptags() for one in page.not_required] == ["ω2 (1.670 m/s)"]
    hinted = page_of(report(criteria=[omega], mistakes=[]), level="hint")
    assert [one.striptags() for one in hinted.not_required] == ["ω2"]


def test_a_widened_tolerance_is_told_as_such_with_the_reason():
    wider = criterion("v_B").model_copy(
        update={"tolerance": Tolerance(length_mm=2.4, direction_deg=3.0, widened=True)}
    )
    page = page_of(report(criteria=[wider, criterion("v_A")], mistakes=[]))
    assert [page.tolerance(row) for row in page.report.criteria] == [
        ["±2.4\u00a0mm ±3.0°", "widened"],
        ["±1.0\u00a0mm ±1.5°"],
    ]
    assert "small angle" in feedback_page(page.report, [], "en")
    assert "small angle" not in feedback_page(page.report, [], "en", "hint")
    assert "small angle" not in feedback_page(report(mistakes=[]), [], "en")


def test_a_link_that_is_off_is_shown_on_the_sketch():
    link = criterion("v_B", "none", 0.0).model_copy(
        update={"vector": None, "link": "O1A", "title": "Link O1A"}
    )
    sketched = picture()
    arrow = Arrow("O1A", "mechanism", (200.0, 200.0), (250.0, 220.0), "none", doubtful=False, is_link=True)
    sketched = replace(sketched, scene=replace(sketched.scene, arrows=(*sketched.scene.arrows, arrow)))
    page = page_of(report(criteria=[link], mistakes=[]), [sketched])
    assert page.view_of_others.names == ("O1A",)


def test_what_hangs_on_something_open_says_so_unless_there_is_a_better_reason():
    hangs = criterion("v_C", "review", None).model_copy(update={"reasons": ["follows", "too_long"]})
    near = criterion("v_D", "review", None).model_copy(update={"reasons": ["follows", "near_limit"]})
    waiting = page_of(report(criteria=[hangs, near], mistakes=[])).waiting
    assert waiting[0][0] == "it depends on an open question"
    assert waiting[1][0].startswith("too close to the limit")
