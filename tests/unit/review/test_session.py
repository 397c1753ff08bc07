"""A class under review: what is asked, what is decided, and what follows at once."""

import io
import json
import threading
from dataclasses import replace

import pytest
from PIL import Image

from grader.folder.decisions import basis_of
from grader.records import ACCELERATION_PLAN
from grader.review.records import mark_of
from grader.review.server import application
from grader.review.session import Session
from grader.tables.decisions import Decision, DecisionFile
from tests.examples import slow
from tests.unit.marking.test_answers import unsure
from tests.unit.review.conftest import PUMP, Page, silent
from tests.waiting import until

SCANNED, ENTERED = "s02", "s09"


def decided(session):
    return {
        (row.student_id, row.criterion): row
        for row in DecisionFile(session.batch.folder / "decisions.csv").all()
    }


def test_the_page_is_there_in_every_language(session):
    for lang, word in (("en", "undo"), ("ro", "anulează"), ("ru", "отменить")):
        text = Page(application(session, lang), base_url="http://127.0.0.1:8321").get("/").text
        assert f'lang="{lang}"' in text
        assert word in text


def test_every_criterion_of_every_student_is_a_row(page, session):
    rows = page.rows()
    wanted = {
        (student.key, criterion.id) for student in session.students for criterion in student.report.criteria
    }
    assert set(rows) == wanted
    assert all(row["stake"] > 0.0 for row in rows.values() if row["verdict"] == "review")


def test_a_question_says_what_was_measured_and_shows_where(page):
    question = page.get("/api/question", params={"student": SCANNED, "criterion": "v_B"}).json()
    assert [name for name, _ in question["numbers"]] == ["Measured", "Expected", "Tolerance", "Points"]
    look = question["look"]
    x, y, w, h = look["box"]
    inside = {node["name"] for node in look["nodes"] if x <= node["x"] <= x + w and y <= node["y"] <= y + h}
    assert {"o", "b"} <= inside
    assert look["marks"].startswith("<")


def test_why_a_verdict_waits_is_told_in_the_reviewers_language(session):
    told = {}
    for lang in ("en", "ro", "ru"):
        page = Page(application(session, lang), base_url="http://127.0.0.1:8321")
        rows = page.rows().values()
        waiting = [row for row in rows if row["verdict"] == "review" and row["proposed"] in {"full", "none"}]
        asked = {"student": waiting[0]["student"], "criterion": waiting[0]["criterion"]}
        told[lang] = page.get("/api/question", params=asked).json()["why"]
    assert len(set(told.values())) == 3
    assert set("абвгдежзиклмнопрст") & set(told["ru"])
    assert not set("абвгдежзиклмнопрст") & set(told["ro"])


def test_a_question_says_why_it_waits_and_what_the_student_will_read(page):
    rows = page.rows().values()
    waiting = [row for row in rows if row["verdict"] == "review" and row["proposed"] in {"full", "none"}]
    assert waiting
    asked = {"student": waiting[0]["student"], "criterion": waiting[0]["criterion"]}
    question = page.get("/api/question", params=asked).json()
    assert question["why"]
    assert question["sentence"] != question["why"]
    page.answer(**asked, verdict=question["proposed"])
    settled = page.get("/api/question", params=asked).json()
    assert (settled["sentence"], settled["why"]) == (question["sentence"], "")


def test_what_is_expected_of_a_stroke_is_judged_with_the_likeliest_answer(page, session):
    student = session.student(SCANNED)
    student.pages = [
        replace(one, reading=unsure(one.reading, "a'", figure=ACCELERATION_PLAN))
        for one in session.pages_of(student)
        if ACCELERATION_PLAN in one.reading.figures
    ]
    student.report, student.version = session.report_if(student, ()), student.version + 1
    offered = [one for one in session.doubts(student) if one.kind == "node" and one.default]
    assert offered
    for doubt in offered:
        question = page.get("/api/question", params={"student": SCANNED, "criterion": doubt.id}).json()
        after = session.report_if(student, doubt.default.rows)
        vector = next(one.vector for one in doubt.choices if one.vector)
        expected = next(one.expected for one in after.criteria if one.vector == vector)
        assert f"{expected.length_mm:.1f}" in dict(question["numbers"])["Expected"]


def test_no_question_waits_until_all_others_are_judged(session, monkeypatch):
    student = max(session.students, key=lambda one: len(session.doubts(one)))
    student.doubts, judged, judge = None, [], Session.report_if
    monkeypatch.setattr(Session, "report_if", lambda *args: judged.append(args) or judge(*args))
    questions = session.doubts(student, until=0.0)
    assert len(questions) > 1
    assert judged == []
    assert session.doubt(student, questions[-1].id).id == questions[-1].id
    assert len(judged) <= 1


def test_without_a_scan_there_is_nothing_to_look_at(page):
    question = page.get("/api/question", params={"student": ENTERED, "criterion": "v_B"}).json()
    assert question["look"] is None


def test_a_part_of_a_scan_is_cut_as_large_as_asked(page):
    asked = {"student": SCANNED, "sheet": 0, "x": 20, "y": 30, "w": 40, "h": 20, "scale": 5}
    answer = page.get("/scan", params=asked)
    assert answer.headers["content-type"] == "image/jpeg"
    assert Image.open(io.BytesIO(answer.content)).size == (200, 100)


NOT_THERE = [
    ("/scan", {"student": "s02", "sheet": 7, "x": 0, "y": 0, "w": 9, "h": 9, "scale": 1}),
    ("/scan", {"student": "s70", "sheet": 0, "x": 0, "y": 0, "w": 9, "h": 9, "scale": 1}),
    ("/scan", {"student": "s02", "sheet": 0, "x": 0, "y": 0, "w": 0, "h": 9, "scale": 1}),
    ("/scan", {"student": "s02", "sheet": 0, "x": 0, "y": 0, "w": 9e5, "h": 9e5, "scale": 99}),
    ("/scan", {"student": "s02", "sheet": 0, "x": "nan", "y": 0, "w": 9, "h": 9, "scale": 1}),
    ("/scan", {"student": "s02", "sheet": 0}),
    ("/page", {"file": "../roster.csv", "page": 1}),
    ("/page", {"file": "/etc/passwd", "page": 1}),
    ("/api/question", {"student": "s02", "criterion": "nothing"}),
    ("/api/question", {"student": "x", "criterion": "v_B"}),
    ("/api/question", {}),
]


def test_what_is_not_there_is_refused_in_words(page):
    for path, asked in NOT_THERE:
        answer = page.get(path, params=asked)
        assert answer.status_code == 400, asked
        assert answer.json()["message"], asked


def test_only_pages_and_tables_of_the_results_are_served(page):
    for path in ("results.json", ".planmark/run.json", "../in/roster.csv", "%2e%2e/in/roster.csv", "s02"):
        assert page.get(f"/out/{path}").status_code == 404, path


# Decisions ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("verdict", ["partial", *slow("full", "none", "follow_through", "not_judged")])
def test_a_verdict_is_written_and_counts_at_once(page, session, verdict):
    answer = page.answer(SCANNED, "v_D", verdict, comment="seen")
    assert answer.status_code == 200
    row = decided(session)["s02", "v_D"]
    assert (row.verdict, row.by, row.comment) == (verdict, "Ana", "seen")
    student = session.student(SCANNED).job.submission
    assert row.basis == basis_of(student, PUMP, session.batch.rubric, "v_D")
    after = {one["criterion"]: one for one in answer.json()["students"][0]["rows"]}["v_D"]
    assert (after["verdict"], after["decided"], after["stake"]) == (verdict, True, 0.0)
    assert "Ana" in page.get("/api/question", params={"student": SCANNED, "criterion": "v_D"}).json()["state"]


def test_undo_brings_back_what_stood_there_before(page, session):
    own = page.rows()[ENTERED, "v_D"]["verdict"]
    page.answer(ENTERED, "v_D", "full", comment="first")
    page.answer(ENTERED, "v_D", "none")
    undone = page.said("/api/undo").json()
    assert undone["undone"] == "s09/v_D"
    assert (decided(session)["s09", "v_D"].verdict, decided(session)["s09", "v_D"].comment) == (
        "full",
        "first",
    )
    page.said("/api/undo")
    assert not decided(session)
    assert page.rows()[ENTERED, "v_D"]["verdict"] == own
    assert page.said("/api/undo").json()["undone"] == ""


def test_the_undo_of_one_window_leaves_the_others_alone(page, session):
    page.answer(ENTERED, "v_D", "full")
    assert page.said("/api/undo", window="another").json()["undone"] == ""
    assert decided(session)


def test_two_windows_and_neither_loses_anything(page, session):
    row = page.rows()[ENTERED, "v_D"]
    answer = {"student": ENTERED, "criterion": "v_D", "seen": row["seen"]}
    first = page.said("/api/decide", answers=[{**answer, "verdict": "full"}], by="Ana", window="a")
    second = page.said("/api/decide", answers=[{**answer, "verdict": "none"}], by="Ion", window="b")
    assert first.status_code == 200
    assert second.status_code == 409
    assert "Ana" in second.json()["message"]
    assert "right" in second.json()["message"]
    assert decided(session)["s09", "v_D"].verdict == "full"


def test_answers_together_are_written_all_or_none(page, session):
    page.answer(ENTERED, "v_D", "full")
    rows = page.rows()
    answers = [
        {"student": ENTERED, "criterion": name, "verdict": "none", "seen": ""} for name in ("v_DC", "v_D")
    ]
    assert page.said("/api/decide", answers=answers).status_code == 409
    assert ("s09", "v_DC") not in decided(session)
    answers[1]["seen"] = rows[ENTERED, "v_D"]["seen"]
    assert page.said("/api/decide", answers=answers).status_code == 200
    assert {row.verdict for row in decided(session).values()} == {"none"}


@pytest.mark.slow
def test_many_at_once_lose_nothing(page, session):
    rows = page.rows()
    names = [name for student, name in rows if student == SCANNED][:12]

    def settle(name, verdict):
        answer = {
            "student": SCANNED,
            "criterion": name,
            "verdict": verdict,
            "seen": rows[SCANNED, name]["seen"],
        }
        page.said("/api/decide", answers=[answer], window=verdict)

    threads = [
        threading.Thread(target=settle, args=(name, verdict))
        for name in names
        for verdict in ("full", "none")
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {criterion for _, criterion in decided(session)} == set(names)


NO_ANSWERS = [
    {"student": "s02", "criterion": "v_D", "verdict": "perfect", "seen": ""},
    {"student": "s02", "criterion": "nothing", "verdict": "full", "seen": ""},
    {"student": "s90", "criterion": "v_D", "verdict": "full", "seen": ""},
    {"student": 0, "criterion": "v_D", "verdict": "full", "seen": ""},
    {"student": 0.5, "criterion": "v_D", "verdict": "full", "seen": ""},
    {"student": "s02", "criterion": ["v_D"], "verdict": "full", "seen": ""},
    {"student": "s02", "criterion": "v_D", "verdict": "full", "comment": 7, "seen": ""},
    {"student": "s02", "criterion": "v_D", "verdict": "full", "comment": "c" * 5000, "seen": ""},
    {"student": "s02", "criterion": "total", "verdict": "full", "seen": ""},
]


def test_an_answer_that_cannot_be_used_is_refused_and_nothing_written(page, session):
    for answer in NO_ANSWERS:
        refused = page.said("/api/decide", answers=[answer])
        assert refused.status_code == 400, answer
    assert refused.json()["message"]
    assert not decided(session)


def test_no_answer_is_refused(page):
    for said in ({}, {"answers": []}, {"answers": {}}, {"answers": [7]}):
        assert page.said("/api/decide", **said).status_code == 400, said


# Comments kept for reuse ----------------------------------------------------------------------------


def commented(page, *, points=1.5):
    """Two students have one comment on v_D, one has another; the first is what the page is told of it."""
    for student in (ENTERED, SCANNED):
        page.answer(student, "v_D", "partial", comment="no arrow", points=points)
    page.answer(ENTERED, "v_A", "partial", comment="no arrow")
    return page.get("/api/class").json()["comments"][0]


def changed(page, kept, **said):
    about = {name: kept[name] for name in ("criterion", "verdict", "comment", "points", "students")}
    return page.said("/api/comment", **{**about, "words": kept["comment"], "worth": kept["points"], **said})


def test_a_comment_is_offered_again_at_its_criterion_the_commonest_first(page):
    first = commented(page)
    kept = page.get("/api/class").json()["comments"]
    assert [(one["criterion"], one["points"], one["students"]) for one in kept] == [
        ("v_D", 1.5, [ENTERED, SCANNED]),
        ("v_A", None, [ENTERED]),
    ]
    assert (first["verdict"], first["comment"], first["changes"]) == (
        "partial",
        "no arrow",
        "Changes 2 students",
    )


def test_other_points_of_a_comment_count_for_all_who_have_it(page, session):
    kept = commented(page)
    before = decided(session)
    students = changed(page, kept, words="arrow missing", worth=1, by="Ion").json()["students"]
    assert {one["key"] for one in students} == {ENTERED, SCANNED}
    for student in (ENTERED, SCANNED):
        was, now = before[student, "v_D"], decided(session)[student, "v_D"]
        # The verdict is still that of whoever decided it, about what was handed in then.
        assert now == replace(was, comment="arrow missing", points=1.0)
        assert session.student(student).criterion("v_D").points == 1.0
    assert decided(session)["s09", "v_A"].comment == "no arrow"
    page.said("/api/undo", window="another")
    page.said("/api/undo")
    assert decided(session) == before


def test_a_comment_is_not_changed_for_others_than_those_who_were_shown(page, session):
    kept = commented(page)
    page.answer(SCANNED, "v_D", "none")
    refused = changed(page, kept, worth=1)
    assert refused.status_code == 409
    assert decided(session)["s09", "v_D"].points == 1.5


def test_a_stale_decision_stays_stale_under_a_changed_comment(page, session):
    DecisionFile(session.batch.decisions_path).add(
        Decision("s09", None, "v_D", "partial", 1.5, "no arrow", basis="b0.1.2.3")
    )
    (kept,) = page.get("/api/class").json()["comments"]
    assert changed(page, kept, worth=1).status_code == 200
    row = decided(session)["s09", "v_D"]
    assert (row.points, row.basis) == (1.0, "b0.1.2.3")


def test_points_that_contradict_the_verdict_are_refused_in_words(page, session):
    assert page.answer(ENTERED, "v_D", "full", points=0.5).status_code == 400
    assert "v_D" in page.answer(ENTERED, "v_D", "partial", points=50).json()["message"]
    assert not decided(session)
    assert changed(page, commented(page), worth=50).status_code == 400
    assert decided(session)["s09", "v_D"].points == 1.5


def test_a_comment_on_the_whole_and_points_added(page, session):
    page.said("/api/whole", student=ENTERED, comment="well drawn", added=1.5)
    rows = decided(session)
    assert rows["s09", "comment"].comment == "well drawn"
    assert rows["s09", "total"].points == 1.5
    seen = page.get("/api/class").json()["students"][1]["seen"]
    assert page.said("/api/whole", student=ENTERED, comment="", added=0).status_code == 409
    page.said("/api/whole", student=ENTERED, comment="", added=0, seen=seen)
    assert not decided(session)
    page.said("/api/undo")
    assert set(decided(session)) == {("s09", "comment"), ("s09", "total")}


def test_a_row_that_people_wrote_without_a_position_is_replaced(page, session):
    """A second row on the same would make both of them faults."""
    path = session.batch.folder / "decisions.csv"
    DecisionFile(path).add(Decision("s09", None, "v_D", "partial", by="by hand"))
    page.answer(ENTERED, "v_D", "none")
    assert [row.verdict for row in DecisionFile(path).all()] == ["none"]


def test_of_what_others_write_into_the_file_only_those_whom_it_concerns_are_marked_anew(page, session):
    version = page.get("/api/class").json()["version"]
    path = session.batch.folder / "decisions.csv"
    DecisionFile(path).add(Decision("s09", None, "v_A", "partial", by="by hand"))
    told = page.get("/api/class", params={"since": version}).json()
    assert [one["key"] for one in told["students"]] == [ENTERED]
    assert page.rows()[ENTERED, "v_A"]["verdict"] == "partial"


def test_a_file_that_people_broke_is_told_and_left_alone(page, session):
    path = session.batch.folder / "decisions.csv"
    path.write_text("who,what\n1,2\n", encoding="utf-8")
    answer = {"student": SCANNED, "criterion": "v_D", "verdict": "full", "seen": ""}
    told = page.said("/api/decide", answers=[answer])
    assert told.status_code == 400
    assert "decisions.csv" in told.json()["message"]
    assert path.read_text(encoding="utf-8") == "who,what\n1,2\n"


def test_a_page_that_knows_all_is_told_nothing_again(page):
    version = page.get("/api/class").json()["version"]
    assert page.get("/api/class", params={"since": version}).json()["students"] == []


# Nodes ----------------------------------------------------------------------------------------------


def test_a_node_snaps_to_the_ink_and_marks_follow_it_away_and_back(page, session):
    look = page.get("/api/question", params={"student": SCANNED, "criterion": "v_B"}).json()["look"]
    node = next(one for one in look["nodes"] if one["name"] == "b")
    said = {"student": SCANNED, "sheet": look["sheet"], "node": "velocity_plan:b"}
    places, verdicts = [], []
    for dx, dy in ((0.8, -0.5), (25.0, 0.0), (0.0, 0.0)):
        seen = mark_of(decided(session).get(("s02", "node:velocity_plan:b")))
        moved = page.said("/api/node", **said, x=node["x"] + dx, y=node["y"] + dy, seen=seen)
        marks = moved.json()["students"][0]["rows"]
        verdicts.append({one["criterion"]: one["verdict"] for one in marks})
        places.append(complex(*decided(session)["s02", "node:velocity_plan:b"].place))
    assert abs(places[0] - complex(node["x"], node["y"])) < 0.4
    assert verdicts[0] == verdicts[2] != verdicts[1]
    assert verdicts[1]["v_B"] != "full"
    assert page.said("/api/node", **said, x=node["x"], y=node["y"]).status_code == 409


# Ink ------------------------------------------------------------------------------------------------

RING = [[100.0, 200.0], [120.0, 200.0], [120.0, 220.0], [100.0, 200.0]]


def drawn(page, strokes=(RING,), **said):
    return page.said("/api/ink", **{"student": SCANNED, "sheet": 0, "strokes": list(strokes), **said})


def ink_of(page):
    return page.get("/api/question", params={"student": SCANNED, "criterion": "v_B"}).json()["look"]["ink"]


def test_ink_is_kept_in_millimetres_shown_and_taken_back(page, session):
    rows = page.rows()
    drawn(page, [RING, RING[:2]])
    drawn(page)
    assert [row.criterion for row in decided(session).values()] == [f"ink:{k}:s02_1.jpg#1" for k in (1, 2, 3)]
    assert decided(session)["s02", "ink:2:s02_1.jpg#1"].stroke == ((100.0, 200.0), (120.0, 200.0))
    assert ink_of(page).count("<polyline") == 3
    assert page.rows() == rows
    page.said("/api/undo")
    page.said("/api/undo")
    assert ink_of(page) == ""
    drawn(page)
    drawn(page, [])
    assert not decided(session)
    page.said("/api/undo")
    assert ink_of(page).count("<polyline") == 1


def test_the_student_sees_the_ink_until_the_scan_is_replaced(page, session):
    drawn(page)
    session.bring_up_to_date(silent)
    feedback = (session.batch.out / "s02" / "feedback.html").read_text(encoding="utf-8")
    assert "100.000,200.000 120.000,200.000" in feedback
    overlay = Image.open(session.batch.out / "s02" / "overlay.png").convert("RGB")
    red, green, blue = overlay.getpixel(
        (round(110.0 * overlay.width / 420.0), round(200.0 * overlay.width / 420.0))
    )
    assert red > green + 100 < blue + 100
    scan = session.batch.folder / "s02_1.jpg"
    Image.open(scan).rotate(0.3, fillcolor="white").save(scan, quality=90)
    session.bring_up_to_date(silent)
    (stale,) = session.graded.results.stale
    assert (stale.criterion, stale.code) == ("ink:1:s02_1.jpg#1", "handed_in_changed")
    assert ink_of(page) == ""
    scan.unlink()


NO_INK = [
    {"strokes": [[[1, 1]]]}, {"strokes": [[[1, 1], [-5, 1]]]}, {"strokes": [[[1, 1]] * 251]}, {"sheet": 7},
    {"student": "s90"}, {"strokes": [[[1, 1], ["a", 1]]]}, {"student": ENTERED},
]  # fmt: skip


def test_what_is_no_stroke_on_a_sheet_is_refused(page, session):
    for said in NO_INK:
        assert drawn(page, **said).status_code == 400, said
    assert not decided(session)


# Pages ----------------------------------------------------------------------------------------------


def test_a_page_that_is_nobodys_is_offered_and_assigned(page, session):
    told = page.get("/api/pages").json()
    (stranger,) = told["pages"]
    assert (stranger["file"], stranger["owner"]) == ("stranger.jpg", "")
    assert page.get(stranger["picture"]).headers["content-type"] == "image/jpeg"
    corners = [[10, 10], [900, 12], [905, 600], [8, 610]]
    said = {"file": "stranger.jpg", "page": 1, "owner": "s09", "turn": 90, "corners": corners}
    assert page.said("/api/page", **said).status_code == 200
    row = next(row for row in decided(session).values() if row.kind == "page")
    assert (row.page.owner, row.page.turn, len(row.page.corners)) == ("s09", 90, 4)
    again = page.get("/api/pages").json()["pages"][0]
    assert (again["owner"], again["turn"], again["corners"]) == (
        "s09",
        90,
        [list(map(float, one)) for one in corners],
    )
    page.said("/api/undo")
    assert not decided(session)


def test_decisions_that_were_not_applied_are_told(session):
    path = session.batch.folder / "decisions.csv"
    DecisionFile(path).add(
        Decision("s02", None, "v_D", "full", basis="b0.1.2.3"), Decision("nobody", None, "v_D", "full")
    )
    session.bring_up_to_date(silent)
    page = Page(application(session), base_url="http://127.0.0.1:8321")
    stale, fault = page.get("/api/pages").json()["idle"]
    assert "s02 v_D: right" in stale
    assert "nobody" in fault
    said = page.get("/api/question", params={"student": SCANNED, "criterion": "v_D"}).json()
    assert "has changed since" in said["state"]


NO_PAGES = [
    {"file": "stranger.jpg", "page": 1},
    {"file": "nothing.jpg", "page": 1, "turn": 90},
    {"file": "stranger.jpg", "page": 2, "turn": 90},
    {"file": "stranger.jpg", "page": 1, "turn": 45},
    {"file": "stranger.jpg", "page": 1, "owner": "s90"},
    {"file": "stranger.jpg", "page": 1, "corners": [[0, 0], [1]]},
    {"file": "stranger.jpg", "page": 1, "corners": 7},
    {"file": "stranger.jpg", "page": 1, "corners": [[0, 0], [1, 1], [2, 2], [3, 3]]},
]


def test_a_page_decision_that_cannot_be_used_is_refused(page, session):
    for said in NO_PAGES:
        assert page.said("/api/page", **said).status_code == 400, said
    assert not decided(session)


# The end --------------------------------------------------------------------------------------------


def finished(page):
    page.said("/api/finish")

    def told():
        now = page.get("/api/finish").json()
        return None if now["running"] else now

    return until(told)


def test_finishing_brings_the_pages_up_to_date_and_exports(page, session):
    page.answer(ENTERED, "v_A", "none", comment="look again")
    assert session.made == 1
    told = finished(page)
    assert told["message"] == ""
    assert session.made == 0
    assert [one["href"] for one in told["files"]] == ["out/index.html", "out/export-csv-grades.csv"]
    assert all(page.get(one["href"]).status_code == 200 for one in told["files"])
    assert any("--to moodle" in line for line in told["commands"])
    (change,) = told["changes"]
    assert change.startswith(f"{ENTERED}: ")
    assert told["summary"] == "1 mark has changed:"
    report = json.loads((session.batch.out / "s09" / "report.json").read_text(encoding="utf-8"))
    written = next(one for one in report["criteria"] if one["id"] == "v_A")
    assert (written["verdict"], written["decided"]["by"]) == ("none", "Ana")
    assert written["decided"]["comment"] == "look again"
    assert page.rows()[ENTERED, "v_A"]["verdict"] == "none"


def test_a_run_that_fails_is_told(page, session):
    (session.batch.folder / "roster.csv").write_text("nothing\n1\n", encoding="utf-8")
    assert "roster.csv" in finished(page)["message"]


def test_what_could_not_be_read_is_settled_by_hand(session):
    """The only student's only page is not a drawing of this assignment."""
    folder = session.batch.folder
    for name in ("s02_1.jpg", "s02_2.jpg"):
        (folder / name).unlink()
    Image.new("L", (1600, 1100), 255).save(folder / "s02.png")
    session.bring_up_to_date(silent)
    page = Page(application(session), base_url="http://127.0.0.1:8321")
    before = {name: row for (student, name), row in page.rows().items() if student == SCANNED}
    assert {"v_A", "v_D", "a_D"} <= {name for name, row in before.items() if row["verdict"] == "review"}
    page.answer(SCANNED, "v_D", "full")
    after = {name: row for (student, name), row in page.rows().items() if student == SCANNED}
    assert (after["v_D"]["verdict"], after["a_D"]["verdict"]) == ("full", "review")
