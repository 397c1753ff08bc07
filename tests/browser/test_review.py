"""A person reviews a class of 30: by keys, by mouse on a phone, in two windows, through a power cut."""

import math
from dataclasses import replace

import pytest

from grader.records import Figure
from tests.browser.test_serve import violations

pytestmark = pytest.mark.slow

SHEETS = 30


def test_a_class_is_settled_by_keys_alone(open_window, server):
    window = open_window(server, student="s02")
    was_open = window.open
    assert was_open > SHEETS
    while not window.is_done:
        window.press("Enter" if window.page.is_enabled("#accept") else "1")
    assert window.open == 0
    # One look and one key for each question; where one end of a vector lies may bring up the other end.
    assert window.keys <= 1.2 * was_open
    assert len(window.screens) <= 1.2 * was_open + 1
    assert window.keys / SHEETS < 2.0
    assert len(server.decisions()) >= window.keys
    # The last answer brings the pages up to date by itself.
    window.page.wait_for_selector("#finished:visible")
    assert "s02" in window.page.inner_text("#changes")
    assert "planmark export" in window.page.inner_text("#commands")
    assert "needs review" not in (server.top / "out" / "export-csv-grades.csv").read_text(encoding="utf-8")


def test_every_key_does_what_the_page_says(open_window, server):
    window = open_window(server, student="m03")
    page, first = window.page, window.shown
    window.press("3")
    student, criterion = first.split("/")
    assert next(iter(server.decisions().values())).verdict == "none"
    window.press("u")
    assert window.shown == first
    assert not server.decisions()
    window.press("ArrowRight")
    assert window.shown != first
    window.press("ArrowLeft")
    assert window.shown == first
    page.keyboard.press(" ")
    assert page.locator("#view.bare").count() == 1
    page.keyboard.press(" ")
    assert page.locator("#view.bare").count() == 0
    page.keyboard.press("c")
    page.keyboard.type("look at the arrow 2")
    page.keyboard.press("Escape")
    window.press("2")
    (row,) = server.decisions().values()
    assert (row.criterion, row.verdict, row.comment) == (criterion, "partial", "look at the arrow 2")
    assert student == "m03"


def test_a_comment_is_given_again_by_one_key_and_changed_for_all_who_have_it(open_window, server):
    window = open_window(server, student="m01")
    page = window.page
    page.fill("#comment", "no arrow")
    page.fill("#points", "1")
    page.click("#choices [data-key='2']")
    page.wait_for_selector("body:not([data-busy])")
    other = open_window(server, student="m02")
    other.press("5")
    rows = [(key, row.verdict, row.points, row.comment) for key, row in server.decisions().items()]
    assert rows == [((student, "v_DC"), "partial", 1.0, "no arrow") for student in ("m01", "m02")]
    page = open_window(server, 320, 800, student="m04").page
    page.locator("#comments [aria-label]").first.click()
    assert page.inner_text("#kept-count") == "Changes 2 students"
    assert not violations(page)
    page.fill("#kept-points", "0.5")
    page.keyboard.press("Enter")
    page.wait_for_selector("#comments :text('0.5')")
    assert [row.points for row in server.decisions().values()] == [0.5, 0.5]
    assert page.evaluate("document.documentElement.scrollWidth") <= 320


def test_a_class_is_settled_by_mouse_on_a_phone(open_window, server):
    window = open_window(server, 390, 844)
    page, clicks = window.page, 0
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    while not window.is_done:
        shown = page.evaluate("document.body.dataset.shown")
        button = "#accept" if page.is_enabled("#accept") else "#choices [data-key='1']"
        box = page.locator(button).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
        assert box["y"] + box["height"] <= 844  # without scrolling
        page.click(button)
        clicks += 1
        page.wait_for_function(
            "shown => !document.body.dataset.busy && (document.body.dataset.shown !== shown"
            " || !document.getElementById('done').hidden)",
            arg=shown,
        )
    assert len(server.decisions()) >= clicks
    assert window.open == 0


def test_a_touch_settles_and_takes_back(open_window, server):
    window = open_window(server, 390, 844, student="m03", has_touch=True, is_mobile=True)
    first = window.shown
    window.page.tap("#choices [data-key='3']")
    window.page.wait_for_function("first => !document.body.dataset.shown.startsWith(first + ' ')", arg=first)
    assert len(server.decisions()) == 1
    window.page.tap("#undo")
    window.page.wait_for_function("first => document.body.dataset.shown.startsWith(first + ' ')", arg=first)
    assert not server.decisions()


def test_a_killed_server_has_kept_every_key(open_window, process):
    server, window = process, open_window(process, student="m03")
    was_open = window.open
    for key in ("1", "3", "2"):
        window.press(key)
    server.kill()
    window.page.keyboard.press("1")
    window.page.wait_for_selector("#note:visible")
    assert sorted(row.verdict for row in server.decisions().values()) == ["full", "none", "partial"]
    server.start()
    again = open_window(process)
    # What was decided is evidence for other verdicts, and may leave one of them open.
    assert again.open <= was_open - 2
    assert len(server.decisions()) == 3


def test_two_windows_lose_nothing_and_show_the_clash(open_window, server):
    ana, ion = open_window(server, student="m03"), open_window(server, student="m03")
    assert ana.shown == ion.shown
    student, criterion = ana.shown.split("/")
    for window, name in ((ana, "Ana"), (ion, "Ion")):
        window.page.evaluate("name => { document.getElementById('by').value = name; }", name)
    ana.press("1")
    ion.page.keyboard.press("3")
    ion.page.wait_for_function("() => document.getElementById('note').textContent.includes('Ana')")
    (row,) = server.decisions().values()
    assert (row.criterion, row.verdict, row.by) == (criterion, "full", "Ana")
    ion.page.click("#note button")
    ion.ready()
    assert ion.page.is_hidden("#note")
    assert "Ana" in ion.page.inner_text("#state")
    ion.press("Enter")
    ion.press("3")
    assert sorted(row.by for row in server.decisions().values()) == ["Ana", "Ion"]
    assert student == "m03"


def test_a_dragged_node_snaps_and_the_marks_follow(open_window, server):
    window = open_window(server, student="s02")
    page = window.page
    page.wait_for_selector("#view[data-loaded]")
    page.wait_for_selector("body:not([data-busy])")
    before = page.inner_text("#numbers")
    moved = []
    # The vector in question is in the middle of the view: one of the nearest nodes is its own.
    while page.inner_text("#numbers") == before and len(moved) < 4:
        shown = page.evaluate("() => document.body.dataset.shown")
        name, (x, y) = nearest_node(page, moved)
        moved.append(name)
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 60, y + 45, steps=4)
        page.mouse.up()
        page.wait_for_function("shown => document.body.dataset.shown !== shown", arg=shown)
        page.wait_for_selector("body:not([data-busy])")
        assert len([row for row in server.decisions().values() if row.kind == "node"]) == len(moved)
    assert page.inner_text("#numbers") != before


def test_what_is_drawn_quickly_is_all_kept(open_window, server):
    window = open_window(server, student="s02")
    page = window.page
    page.click("#pen")
    box = page.locator("#view").bounding_box()
    for number in range(4):
        x, y = box["x"] + 150 + 60 * number, box["y"] + 200
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 30, y + 40, steps=5)
        page.mouse.up()
    page.wait_for_function("() => !state.ink.length && !state.busy")
    assert len([row for row in server.decisions().values() if row.kind == "ink"]) == 4
    assert not violations(page)
    page.click("#wipe")
    page.wait_for_function("() => !state.ink.length && !state.busy")
    assert not server.decisions()


def nearest_node(page, besides):
    """The node nearest to the middle of the view, by its name, and where its circle is."""
    view = page.locator("#view").bounding_box()
    middle = view["x"] + view["width"] / 2, view["y"] + view["height"] / 2
    places = {}
    for node in page.locator(".node").all():
        box = node.bounding_box()
        places[node.get_attribute("data-node")] = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    name = min(places.keys() - set(besides), key=lambda one: math.dist(places[one], middle))
    return name, places[name]


def test_wheel_and_buttons_zoom_into_the_scan(open_window, server):
    window = open_window(server, student="s02")
    page = window.page
    page.wait_for_selector("#view[data-loaded]")

    def width():
        return float(page.get_attribute("#view", "viewBox").split()[2])

    start = width()
    page.mouse.move(400, 400)
    page.mouse.wheel(0, -300)
    page.wait_for_function(
        "start => document.getElementById('view').viewBox.baseVal.width < start", arg=start
    )
    nearer = width()
    page.click("#wider")
    assert width() > nearer
    page.click("#whole")
    assert width() > 400.0
    assert not violations(page)


def test_eight_to_a_screen(open_window, server):
    window = open_window(server, student="s02")
    page = window.page
    page.click("[data-mode=eight]")
    page.wait_for_selector(".tile.now")
    assert page.locator(".tile").count() == 8
    page.keyboard.press("ArrowRight")
    page.keyboard.press("1")
    page.wait_for_function("() => document.querySelectorAll('.tile.settled').length === 1")
    assert len(server.decisions()) == 1
    page.keyboard.press("u")
    page.wait_for_function(
        "() => document.querySelectorAll('.tile.settled').length === 0 && !document.body.dataset.busy"
    )
    assert not server.decisions()


def test_names_are_hidden_where_that_is_asked_for(open_window, server):
    window = open_window(server, student="s02")
    page = window.page
    assert "s02" in page.inner_text("#who")
    page.click("#settings summary")
    page.check("#anonymous")
    page.wait_for_function("!document.getElementById('who').textContent.includes('s02')")
    assert "s02" not in page.inner_text("body")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_focus_is_seen(open_window, server, scheme):
    window = open_window(server, color_scheme=scheme)
    page = window.page
    page.keyboard.press("Tab")
    style = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    assert style == "solid"
    grounds = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (sum(int(part) for part in grounds[4:-1].split(",")) < 200) == (scheme == "dark")


def test_a_page_that_is_nobodys_is_given_an_owner_and_corners(open_window, server):
    window = open_window(server, student="s02")
    page = window.page
    page.click("[data-mode=pages]")
    page.wait_for_selector("#page-view image")
    assert "nobody.jpg" in page.inner_text("#page-list")
    page.select_option("#owner", label="m05 Student")
    page.click("#turn-left")
    page.check("#corners")
    handle = page.locator(".handle").first.bounding_box()
    x, y = handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y + 20, steps=3)
    page.mouse.up()
    page.click("#save-page")
    page.wait_for_function("() => document.getElementById('page-list').textContent.includes('owner=m05')")
    (row,) = server.decisions().values()
    assert (row.criterion, row.page.owner, row.page.turn) == ("page:nobody.jpg#1", "m05", 90)
    assert len(row.page.corners) == 4
    page.click("#read-again")
    page.wait_for_function("() => document.body.dataset.finished")
    assert "nobody.jpg" not in [page.file for page in server.session.graded.results.unmatched]


def test_sure_proposals_are_listed_before_they_are_accepted(open_window, server):
    chances = {"m03": 0.97, "m06": 0.95, "m09": 0.5}
    for student in server.session.students:
        if student.key in chances:
            said = {"proposed": "full", "probability": chances[student.key]}
            criteria = [
                one.model_copy(update=said) if one.id == "v_DC" else one for one in student.report.criteria
            ]
            student.report = student.report.model_copy(update={"criteria": criteria})
    window = open_window(server, student="s02")
    page = window.page

    def listed():
        items = page.locator("#sure-list li").all_inner_texts()
        return [item.split(":")[0].split()[1] for item in items if " m" in item]

    page.click("#settings summary")
    page.click("#proposals")
    assert listed() == ["m03", "m06"]
    assert not server.decisions()
    page.fill("#least", "96")
    assert listed() == ["m03"]
    page.fill("#least", "90")
    page.click("#sure-accept")
    page.wait_for_selector("#sure", state="hidden")
    window.ready()
    decided = {key for key in server.decisions() if key[0].startswith("m")}
    assert decided == {("m03", "v_DC"), ("m06", "v_DC")}
    window.press("u")
    assert not server.decisions()


def test_a_comment_on_the_whole_is_kept(open_window, server):
    window = open_window(server, student="s02")
    page = window.page
    page.click("#whole-student summary")
    page.fill("#remark", "drawn with care")
    page.fill("#added", "1.5")
    page.click("#save-whole")
    page.wait_for_selector("#note:visible")
    rows = {row.criterion: row for row in server.decisions().values()}
    assert (rows["comment"].comment, rows["total"].points) == ("drawn with care", 1.5)


# A class shared among several people ------------------------------------------------------------------


def settled_in(window):
    """Settle all that a window asks, and return whose questions they were."""
    seen = set()
    while not window.is_done:
        seen.add(window.shown.split("/")[0])
        window.press("Enter" if window.page.is_enabled("#accept") else "1")
    return seen


def test_a_class_is_shared_by_student_and_all_settle_into_the_same_decisions(open_window, server):
    windows = [open_window(server, part=f"{share}/3") for share in (1, 2, 3)]
    asked = sum(window.open for window in windows)
    for window, name in zip(windows, ("Ana", "Ion", "Maria"), strict=True):
        window.page.evaluate("name => { document.getElementById('by').value = name; }", name)
    ana, ion, maria = (settled_in(window) for window in windows)
    assert len(ana) + len(ion) + len(maria) == len(ana | ion | maria) == SHEETS
    assert len(server.decisions()) >= asked - 2
    page = open_window(server).page
    assert page.get_attribute("#progress", "data-open") == "0"
    page.click("#share")
    page.fill("#parts", "3")
    whole, *parts = page.locator("#share-list tr").all_inner_texts()
    assert all(name in whole for name in ("Ana", "Ion", "Maria"))
    assert [part.split("\n")[1].split()[0] for part in parts[:3]] == ["Ana", "Ion", "Maria"]


def test_a_part_by_criterion_asks_of_that_alone_and_says_what_is_left(open_window, server):
    window = open_window(server, 320, 800, criterion="a_DC_t")
    page, was_open = window.page, window.open
    assert page.inner_text("#share") == "a_DC_t"
    settled_in(window)
    assert {criterion for _, criterion in server.decisions()} == {"a_DC_t"}
    assert len(server.decisions()) == was_open
    assert "rest of the class: 3" in page.inner_text("#done-title")
    page.click("#share")
    assert not violations(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= 320


@pytest.mark.parametrize("part", [{"part": "4/3"}, {"part": "half"}, {"criterion": "v_Q"}])
def test_a_part_that_there_is_not_is_told_and_hides_nothing(open_window, server, part):
    window = open_window(server, **part)
    assert "no part of this class" in window.page.inner_text("#note")
    assert window.open > SHEETS


# Questions of reading ---------------------------------------------------------------------------------


def places_asked(window):
    """Go on to a question about where a node lies."""
    for _ in range(window.open):
        if window.shown.split("/")[1].startswith("node:") and window.page.locator(".place").count() > 1:
            return
        window.press("ArrowRight")
    pytest.fail("no question about a place")


def test_a_reading_is_asked_between_strokes_and_the_verdict_follows(open_window, server):
    for one in server.session.students:
        spread_confidence(server.session, one)
    window = open_window(server, student="s02")
    places_asked(window)
    page, shown = window.page, window.shown
    assert page.locator(".place").count() == page.locator("#choices [data-key]").count() - 1
    window.press("a")
    rows = server.decisions().values()
    assert {row.kind for row in rows} == {"node"}
    # A stroke has two ends.
    assert 1 <= len(rows) <= 2
    assert any(shown.endswith(row.criterion) for row in rows)
    assert window.shown != shown


def spread_confidence(session, student):
    """A plan's node as good as unread, and its vectors off, so that a person must say where it lies."""
    if student.key != "s02":
        return
    pages = [doubtful(page) for page in session.pages_of(student)]
    student.pages = pages
    session._marked_anew({student.key})


def doubtful(page):
    figure = page.reading.figures.get("velocity_plan")
    if figure is None:
        return page
    moved = replace(figure.nodes["c"], at=figure.nodes["c"].at + 6.0 + 4.0j, confidence=0.4)
    vectors = {
        name: replace(one, confidence=0.4, length_mm=one.length_mm + 6.0) if "C" in name else one
        for name, one in figure.vectors.items()
    }
    plan = Figure({**figure.nodes, "c": moved}, vectors)
    return replace(
        page, reading=replace(page.reading, figures={**page.reading.figures, "velocity_plan": plan})
    )


def test_enter_does_nothing_where_no_proposal_is_sure(open_window, server):
    window = open_window(server, student="m03")
    page = window.page
    assert not page.is_enabled("#accept")
    assert "80" in page.inner_text("#accept") or "proposal" in page.inner_text("#accept").lower()
    page.keyboard.press("Enter")
    page.wait_for_selector("#note:visible")
    assert not server.decisions()


def test_buttons_stay_where_they_are(open_window, server):
    for width, height in ((1280, 800), (390, 844)):
        window = open_window(server, width, height)
        page, seen = window.page, set()
        for _ in range(6):
            box = page.locator("#choices [data-key='1']").bounding_box()
            seen.add((round(box["x"]), round(box["y"])))
            view, bar = page.locator("#view").bounding_box(), page.locator(".answers").bounding_box()
            covered = view and width < 500 and view["y"] + view["height"] > bar["y"]
            assert not covered
            window.press("ArrowRight")
        assert len(seen) == 1


def test_keys_wait_for_the_picture(open_window, server):
    window = open_window(server, student="s02")
    page = window.page
    page.route("**/scan?*", lambda _route: None)
    page.evaluate("() => { state.fetched.clear(); showQuestion(); }")
    page.wait_for_function("() => !document.body.dataset.ready")
    page.keyboard.press("1")
    page.wait_for_selector("#note:visible")
    assert not server.decisions()
