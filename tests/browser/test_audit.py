"""A person checks settled verdicts in a browser: one key each, the drawing in sight."""

import pytest

from tests.browser.test_serve import violations

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)])
def test_settled_verdicts_are_checked_with_one_key_each(chromium, server, width, height):
    page = chromium.new_page(viewport={"width": width, "height": height})
    faults = []
    page.on("pageerror", lambda error: faults.append(str(error)))

    def press(key):
        page.wait_for_function("() => state.ready && !state.busy")
        shown = page.evaluate("document.body.dataset.shown")
        page.keyboard.press(key)
        return shown

    def moved_on(shown):
        page.wait_for_function("before => !state.busy && document.body.dataset.shown !== before", arg=shown)

    page.goto(f"{server.address}audit")
    page.wait_for_selector("#question:visible")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("#answers button").last.bounding_box()["y"] < height
    first = press("1")
    moved_on(first)
    second = press("3")
    moved_on(second)
    third = press("2")
    page.wait_for_selector("#instead:visible")
    moved_on(press("3"))
    (right, unclear, wrong, corrected) = server.decisions().values()
    assert [row.verdict.partition(";")[0] for row in (right, unclear, wrong)] == ["right", "unclear", "wrong"]
    assert first == f"{right.student_id}/{right.criterion.removeprefix('audit:')}"
    assert third == f"{corrected.student_id}/{corrected.criterion}"
    assert corrected.verdict == "none"
    assert "3" in page.inner_text("#progress")
    press("u")
    page.wait_for_function("() => !state.busy")
    assert len(server.decisions()) == 3
    assert not faults
    page.close()


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (320, 800)])
def test_another_person_marks_a_share_again_and_both_find_where_they_differ(chromium, server, width, height):
    page = chromium.new_page(viewport={"width": width, "height": height})
    page.goto(f"{server.address}?student=m01")
    page.wait_for_selector("#choices button")
    page.evaluate("document.getElementById('by').value = 'Ana'")
    page.click("#choices [data-key='1']")
    page.wait_for_function(
        "() => document.body.dataset.shown && !document.body.dataset.shown.startsWith('m01')"
    )
    page.goto(f"{server.address}audit")
    page.click("a.of-audit")
    page.fill("#by", "Ion")
    page.keyboard.press("Tab")
    page.wait_for_function("() => state.question && !state.busy")
    assert "Ana" not in page.inner_text("body")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert not violations(page)
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("3")
    page.wait_for_selector("#differ-list a")
    assert "Ana: right, Ion: wrong" in page.inner_text("#differ-list")
    assert not violations(page)
    page.click("#differ-list a")
    page.wait_for_selector("#choices [aria-pressed=true]")
    assert page.evaluate("document.body.dataset.shown").startswith("m01/v_DC")
    assert "Ion" in page.inner_text("#why")
    page.close()
