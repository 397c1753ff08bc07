"""What a student is told: mistakes first, each where it is seen, and what waits with its reason."""

from dataclasses import replace

from grader.documents import MistakeDocument, ToleranceDocument
from grader.feedback.student_page import About, StudentPage
from grader.language import tongue
from grader.overlay.scene import Arrow
from tests.unit.feedback.works import criterion, picture, report


def page_of(one, pictures=(), level="full", names=None):
    return StudentPage(one, tuple(pictures), tongue("en"), level, About(names=names or {}))


def mistake(code, at, explains):
    return MistakeDocument(code=code, at=at, explains=explains, confidence=0.9, feedback=f"{code} said")


def test_mistakes_come_in_the_order_of_the_drawing_not_of_their_certainty():
    one = report(
        criteria=[criterion("v_A", "none", 0.0), criterion("v_B", "none", 0.0)],
        mistakes=[mistake("wrong_link", "b", ["v_B"]), mistake("sense_reversed", "a", ["v_A"])],
    )
    assert [action.at for action in page_of(one).actions] == ["a", "b"]


def test_what_no_mistake_explains_is_told_too():
    one = report(criteria=[criterion("v_B", "none", 0.0), criterion("v_C", "partial", 1.0)], mistakes=[])
    (action,) = page_of(one).actions
    assert list(action.explains) == ["Vector v_B", "Vector v_C"]


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
    _source, views = page.sheets[0]
    plan = next(view for view in views if view.kind == "velocity_plan")
    assert page.description(plan) == "the velocity plan. v_A: right; v_B: wrong"


def test_plans_as_measured_have_no_sheet_beneath_them():
    page = page_of(report(), [picture(scanned=False)])
    source, views = page.sheets[0]
    assert [view.kind for view in views] == ["velocity_plan"]
    assert "entered measurements" in source


def test_what_is_not_required_and_not_there_takes_one_line():
    omega = criterion("omega_2", "not_judged", None).model_copy(
        update={"reasons": ["optional", "not_measured"]}
    )
    page = page_of(report(criteria=[criterion("v_A"), omega], mistakes=[]))
    assert [row.vector for row in page.criteria] == ["v_A"]
    assert [one.striptags() for one in page.not_required] == ["ω2 (1.670 m/s)"]
    hinted = page_of(report(criteria=[omega], mistakes=[]), level="hint")
    assert [one.striptags() for one in hinted.not_required] == ["ω2"]


def test_a_widened_tolerance_is_told_as_such_with_the_reason():
    wider = criterion("v_B").model_copy(
        update={"tolerance": ToleranceDocument(length_mm=2.4, direction_deg=3.0, widened=True)}
    )
    page = page_of(report(criteria=[wider, criterion("v_A")], mistakes=[]))
    assert [page.tolerance(row) for row in page.criteria] == [
        ["±2.4\u00a0mm ±3.0°", "widened"],
        ["±1.0\u00a0mm ±1.5°"],
    ]
    assert "small angle" in page.widening
    assert page_of(report(criteria=[wider], mistakes=[]), level="hint").widening == ""
    assert page_of(report(mistakes=[])).widening == ""


def test_a_link_that_is_off_is_shown_on_the_sketch():
    link = criterion("v_B", "none", 0.0).model_copy(
        update={"vector": None, "link": "O1A", "title": "Link O1A"}
    )
    sketched = picture()
    arrow = Arrow("O1A", "mechanism", (200.0, 200.0), (250.0, 220.0), "none", doubtful=False, is_link=True)
    sketched = replace(sketched, scene=replace(sketched.scene, arrows=(*sketched.scene.arrows, arrow)))
    (action,) = page_of(report(criteria=[link], mistakes=[]), [sketched]).actions
    assert action.view.names == ("O1A",)


def test_what_hangs_on_something_open_says_so_unless_there_is_a_better_reason():
    hangs = criterion("v_C", "review", None).model_copy(update={"reasons": ["follows", "too_long"]})
    near = criterion("v_D", "review", None).model_copy(update={"reasons": ["follows", "near_limit"]})
    waiting = page_of(report(criteria=[hangs, near], mistakes=[])).waiting
    assert waiting[0][0] == "it hangs on what is still open"
    assert waiting[1][0].startswith("so near the limit")
