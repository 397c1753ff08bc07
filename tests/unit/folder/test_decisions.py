"""Decisions are applied to a class, survive changes of other things, and are out of date otherwise."""

import json
from dataclasses import replace

import pytest

from grader.folder.batch import Batch, grade, graded, needs_person
from grader.folder.decisions import ClassDecisions, basis_of, decided, page_basis
from grader.lms.grades import Grade, Person
from grader.lms.marks import marks_of
from grader.records import PageRef
from grader.rubric import load_rubric, rubric_of
from grader.solution.document import plan_document
from grader.tables.decisions import COLUMNS, Decision, DecisionFile
from grader.tables.measurements import StudentSubmission
from grader.tables.roster import Roster, RosterRow
from reference.authored.assignment import Variant, load_assignment
from reference.errors import InputFileError
from reference.plan import exact_plan
from tests.inline import Inline

PUMP = load_assignment("pump")
RUBRIC = load_rubric("pump-velocity")
BY = "S. Popa"
AT = "2026-11-22T18:00:00+02:00"


def measured(n, **changes):
    plan = plan_document(PUMP, exact_plan(PUMP, [Variant(n=n)]))
    lengths = {name: one.drawn_mm for name, one in plan.vectors.items() if name.startswith("v")}
    return {"n": n, "scales": {"kL": "1:5", "kv": "kv = omega kL"}, "segments_mm": lengths | changes}


def hand_in(folder, student, n, **changes):
    (folder / f"{student}.json").write_text(json.dumps({"student_id": student, **measured(n, **changes)}))


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    hand_in(folder, "s1", 4, v_D=3.0)
    hand_in(folder, "s2", 9)
    (folder / "roster.csv").write_text("student_id,name,n\ns1,Ana,4\ns2,Ion,9\ns3,Ilie,5\n")
    return folder


def run(folder, rubric=RUBRIC, **changes):
    batch = Batch(PUMP, rubric, folder, folder.parent / "out", **changes)
    return grade(batch, lambda *_: None, Inline())


def decide(folder, *rows):
    DecisionFile(folder / "decisions.csv").add(*rows)


def row(criterion, verdict="", student="s1", points=None, comment="", basis=""):
    return Decision(student, None, criterion, verdict, points, comment, BY, AT, basis)


def report_of(results, student):
    return next(report for report in results.reports if report.student_id == student)


def criterion_of(results, student, name):
    return next(one for one in report_of(results, student).criteria if one.id == name)


def messages(results):
    return [problem.message for problem in results.unmatched]


# Applied ------------------------------------------------------------------------------------------


def test_a_verdict_is_the_persons_and_says_what_it_was_before(folder):
    before = run(folder)
    assert criterion_of(before, "s1", "v_D").verdict == "none"
    decide(folder, row("v_D", "full", comment="a slip of the pen"))
    results = run(folder)
    after = criterion_of(results, "s1", "v_D")
    assert (after.verdict, after.points, after.probability, after.mistake) == (
        "full",
        after.max_points,
        1.0,
        None,
    )
    assert after.feedback == "A person has decided this."
    decided = after.decided
    assert (decided.by, decided.at, decided.before, decided.comment) == (BY, AT, "none", "a slip of the pen")
    report = report_of(results, "s1")
    assert (report.status, report.score) == ("graded", RUBRIC.max_score)
    assert not [one for one in report.mistakes if one.explains == ["v_D"]]
    assert report.decisions[0].verdict == "full"


def test_a_partial_verdict_has_the_share_of_the_nearest_band_or_the_points_given(folder):
    decide(folder, row("v_D", "partial"), row("v_B", "partial", points=0.25, student="s2"))
    results = run(folder)
    one = criterion_of(results, "s1", "v_D")
    assert one.points == pytest.approx(RUBRIC.tolerance.partial_share * one.max_points)
    assert criterion_of(results, "s2", "v_B").points == 0.25


def test_a_settled_verdict_is_overridden_too(folder):
    decide(folder, row("v_B", "none", student="s2"), row("v_C", "not_judged", student="s2"))
    results = run(folder)
    assert criterion_of(results, "s2", "v_B").points == 0.0
    assert criterion_of(results, "s2", "v_C").points is None
    report = report_of(results, "s2")
    judged = [one for one in report.criteria if one.verdict != "not_judged"]
    whole = sum(one.max_points for one in judged)
    lost = RUBRIC.points["v_B"]
    assert report.score == pytest.approx((whole - lost) / whole * RUBRIC.max_score, abs=1e-6)


def test_points_are_added_within_nothing_and_everything(folder):
    decide(folder, row("total", points=3.0, comment="bonus", student="s2"), row("total", points=-50.0))
    results = run(folder)
    full, empty = report_of(results, "s2"), report_of(results, "s1")
    assert (full.score, full.added, full.comment) == (RUBRIC.max_score, 0.0, "bonus")
    assert empty.score == 0.0
    judged = [one for one in empty.criteria if one.points is not None]
    scale = RUBRIC.max_score / sum(one.max_points for one in judged)
    assert empty.added == pytest.approx(-scale * sum(one.points for one in judged), abs=1e-6)


def test_the_points_of_criteria_are_exported_beside_added_ones(folder):
    decide(folder, row("total", points=-2.0, student="s2"))
    report = report_of(run(folder), "s2")
    assert report.score == RUBRIC.max_score - 2.0
    grade = Grade("s2", report.score, RUBRIC.max_score, (report,), Person(lang="en"))
    assert sum(mark.points for mark in marks_of(grade)) == pytest.approx(RUBRIC.max_score - 2.0)


def test_a_comment_on_the_whole_is_in_the_report(folder):
    decide(folder, row("comment", comment="Tidy work."))
    assert report_of(run(folder), "s1").comment == "Tidy work."


def test_what_was_not_handed_in_can_be_marked_by_hand(folder):
    decide(folder, row("v_A", "full", student="s3"), row("total", points=1.0, student="s3"))
    report = report_of(run(folder), "s3")
    assert report.status == "needs_review"
    assert {one.verdict for one in report.criteria} <= {"full", "review", "not_judged"}
    open_ones = [one.id for one in report.criteria if one.verdict == "review"]
    decide(folder, *(row(name, "none", student="s3") for name in open_ones))
    report = report_of(run(folder), "s3")
    assert (report.status, report.added) == ("graded", 1.0)


def test_the_cause_of_the_change_is_the_decision(folder):
    run(folder)
    decide(folder, row("v_D", "full"))
    (moved,) = run(folder).moved
    assert (moved.student_id, moved.why) == ("s1", ["decision"])
    assert run(folder).moved == []


def test_a_second_run_marks_nothing_again_whatever_line_a_decision_is_on(folder):
    decide(folder, row("v_D", "full"))
    run(folder)
    report = folder.parent / "out" / "s1" / "report.json"
    before = report.stat().st_mtime_ns
    path = folder / "decisions.csv"
    header, line = path.read_text("utf-8-sig").splitlines()
    path.write_text(f'{header}\n\ns2,,comment,,,"Well, done",,,\n{line}')
    run(folder)
    assert report.stat().st_mtime_ns == before


# Not applied --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bad", "where", "what"),
    [
        (row("v_DD", "full"), "line 2, criterion", "is v_D meant?"),
        (row("v_D", "full", student="s11"), "line 2, student_id", "is s1 meant?"),
        (replace(row("v_D", "full"), position=3), "line 2, position", "has no positions"),
        (row("v_D", "full", points=99.0), "line 2, points", "99 points are more"),
        (row("v_D", "full", points=0.5), "line 2, points", "write partial"),
        (row("v_D", "none", points=0.5), "line 2, points", "the points of none are 0"),
        (row("v_D", "not_judged", points=0.0), "line 2, points", "leave them blank"),
        (row("node:velocity:c", "1.0,2.0"), "line 2, criterion", "no figure"),
        (row("node:velocity_plan:q", "1.0,2.0"), "line 2, criterion", "no node"),
        (row("node:velocity_plan:c", "900.0,2.0"), "line 2, verdict", "beside the sheet"),
        (row("node:velocity_plan:c", "90.0,2.0"), "line 2, criterion", "none of the student's pages"),
        (row("total", points=1.0, student="s3"), "line 2, criterion", "nothing was judged"),
        (Decision("", None, "page:s9.jpg#1", "turn=90"), "line 2, criterion", "no page 1 of s9.jpg"),
    ],
)  # fmt: skip
def test_a_row_that_cannot_be_applied_is_an_error_with_its_line_and_the_others_are_applied(
    folder, bad, where, what
):
    decide(folder, bad, row("v_B", "none", student="s2"))
    results = run(folder)
    (message,) = messages(results)
    assert message.startswith(where)
    assert what in message
    assert [problem.file for problem in results.unmatched] == ["decisions.csv"]
    assert criterion_of(results, "s2", "v_B").verdict == "none"
    assert needs_person(results)


def test_a_line_that_cannot_be_read_is_an_error_too(folder):
    (folder / "decisions.csv").write_text(f"{','.join(COLUMNS)}\ns1,,v_D,splendid,,,,,\ns2,,v_B,none,,,,,\n")
    results = run(folder)
    assert messages(results)[0].startswith("line 2, verdict: 'splendid'")
    assert criterion_of(results, "s2", "v_B").verdict == "none"


def test_a_file_that_cannot_be_read_stops_the_run(folder):
    (folder / "decisions.csv").write_text("student;criterion\n")
    with pytest.raises(InputFileError, match="column student_id is missing"):
        run(folder)
    assert not (folder.parent / "out").exists()


def test_the_file_may_lie_elsewhere_and_is_no_submission(folder):
    decide(folder, row("v_D", "full"))
    other = folder / "mine.csv"
    (folder / "decisions.csv").rename(other)
    assert criterion_of(run(folder, decisions=other), "s1", "v_D").verdict == "full"
    assert messages(run(folder, decisions=other)) == []


# Out of date --------------------------------------------------------------------------------------


def based(folder, decision):
    """The decision as the program writes it, with its basis."""
    run_ = graded(Batch(PUMP, RUBRIC, folder, folder.parent / "other"), lambda *_: None, Inline())
    submission = next(job.submission for job in run_.jobs if job.submission.student_id == decision.student_id)
    return replace(decision, basis=basis_of(submission, PUMP, RUBRIC, decision.criterion))


@pytest.fixture
def decided_folder(folder):
    rows = [row("v_D", "full"), row("total", points=-1.0), row("comment", comment="Well.")]
    decide(folder, *(based(folder, one) for one in rows))
    results = run(folder)
    assert (criterion_of(results, "s1", "v_D").verdict, results.stale) == ("full", [])
    return folder


def stands(results):
    report = report_of(results, "s1")
    return (criterion_of(results, "s1", "v_D").verdict, report.added, report.comment) == (
        "full",
        -1.0,
        "Well.",
    )


def test_decisions_survive_what_they_are_not_about(decided_folder):
    folder, out = decided_folder, decided_folder.parent / "out"
    assert stands(run(folder))
    (out / "results.json").unlink()
    assert stands(run(folder))
    (folder / "roster.csv").write_text("student_id,name,n\ns1,Anna-Maria,4\ns2,Ion,9\ns3,Ilie,5\n")
    assert stands(run(folder))
    (folder / "s1.json").rename(folder / "s1_again.json")
    assert stands(run(folder))
    changed = RUBRIC.criterion[-1].model_copy(update={"points": 7.0, "title": RUBRIC.criterion[0].title})
    rubric = RUBRIC.model_copy(update={"criterion": [*RUBRIC.criterion[:-1], changed]})
    results = run(folder, rubric)
    assert stands(results)
    assert results.stale == []


def test_decisions_are_out_of_date_when_what_was_handed_in_changes(decided_folder):
    hand_in(decided_folder, "s1", 4, v_D=30.0)
    results = run(decided_folder)
    assert [(one.line, one.criterion, one.by, one.comment) for one in results.stale] == [
        (2, "v_D", BY, ""), (3, "total", BY, ""), (4, "comment", BY, "Well."),
    ]  # fmt: skip
    assert results.stale[0].reason == "what was handed in has changed since"
    assert criterion_of(results, "s1", "v_D").decided is None
    assert needs_person(results)
    hand_in(decided_folder, "s1", 4, v_D=3.0)
    assert stands(run(decided_folder))


def test_decisions_are_out_of_date_with_another_variant(decided_folder):
    for path in (decided_folder / "s1.json", decided_folder / "roster.csv"):
        text = path.read_text().replace('"n": 4', '"n": 6').replace("Ana,4", "Ana,6")
        path.write_text(text)
    reasons = {one.reason for one in run(decided_folder).stale}
    assert len(reasons) == 1
    assert "the student's number" in reasons.pop()


def test_a_decision_is_out_of_date_when_its_criterion_asks_for_something_else(decided_folder):
    criteria = [
        one.model_copy(update={"vector": "v_DC"}) if one.id == "v_D" else one for one in RUBRIC.criterion
    ]
    results = run(decided_folder, RUBRIC.model_copy(update={"criterion": criteria}))
    assert [(one.criterion, one.reason[:13]) for one in results.stale] == [("v_D", "the criterion")]


# Pages --------------------------------------------------------------------------------------------

PAGES = [
    PageRef("class.pdf", number, 2, digest="f1", content=f"c{number}") for number in (1, 2)
] + [PageRef("x.jpg", digest="f2", content="c3")]  # fmt: skip


def page_row(page, verdict, position=None, basis=""):
    return Decision("", position, f"page:{page}", verdict, basis=basis, line=2)


def placed(*rows):
    decisions = ClassDecisions("decisions.csv", rows)
    return decisions, decisions.place(PAGES)


def test_a_page_is_turned_and_has_its_corners():
    corners = "corners=0,0 9,0 9,6 0,6"
    _, pages = placed(page_row("class.pdf#2", "turn=90"), page_row("x.jpg", corners))
    assert [page.turn_deg for page in pages] == [None, 90, None]
    assert pages[2].corners_px == ((0, 0), (9, 0), (9, 6), (0, 6))


def test_of_a_file_with_several_pages_one_must_be_named():
    decisions, pages = placed(page_row("class.pdf", "turn=90"))
    assert pages == PAGES
    assert "has 2 pages" in decisions.problems()[0].message


def test_a_pages_decision_is_out_of_date_when_neither_file_nor_pixels_are_the_same():
    page = PAGES[1]
    basis = page_basis(page)
    for same in (page, replace(page, digest="f9"), replace(page, content="c9")):
        decisions = ClassDecisions("", [page_row("class.pdf#2", "turn=90", basis=basis)])
        assert decisions.place([same])[0].turn_deg == 90
    decisions = ClassDecisions("", [page_row("class.pdf#2", "turn=90", basis=basis)])
    assert decisions.place([replace(page, digest="f9", content="c9")])[0].turn_deg is None
    assert [one.reason for one in decisions.stale] == ["what was handed in has changed since"]


def test_a_page_that_is_gone_is_out_of_date():
    decisions, _ = placed(page_row("y.jpg", "turn=90", basis="b1.2"))
    assert [one.reason for one in decisions.stale] == ["the page is not in the folder any more"]
    assert decisions.problems() == []


def test_an_owner_is_on_the_roster_and_in_one_position():
    roster = Roster(
        "roster.csv", (RosterRow("s1", n=4), RosterRow("s2", position=0), RosterRow("s2", position=3))
    )
    decisions, _ = placed(
        page_row("class.pdf#1", "owner=s2", position=3), page_row("class.pdf#2", "owner=s2"),
        page_row("x.jpg", "owner=s9"),
    )  # fmt: skip
    owners = decisions.owners(roster)
    assert owners == {("class.pdf", 1): roster.rows[2]}
    told = [problem.message for problem in decisions.problems()]
    assert "s2 has the positions 0, 3: write which" in told[0]
    assert "s9 is not on the roster" in told[1]
    assert decisions.owners(None)["x.jpg", 1].student_id == "s9"


def test_one_submission_is_given_what_is_about_it():
    submission = StudentSubmission("s1", Variant(n=4), (PAGES[2],))
    rows = [row("v_D", "full"), row("v_B", "full", student="s2"), page_row("x.jpg#1", "owner=s1")]
    found = decided(submission, rows, PUMP, RUBRIC).decided
    assert [one.criterion for one in found] == ["page:x.jpg#1", "v_D"]


# Several positions --------------------------------------------------------------------------------


def test_of_a_student_with_several_positions_the_row_says_which():
    press = load_assignment("press")
    rubric = rubric_of(press)
    students = [StudentSubmission("s1", Variant(position=place)) for place in (0, 3)]
    name = rubric.criterion[0].id
    rows = [
        replace(row(name, "full"), position=3, line=2), replace(row(name, "none"), line=3),
        replace(row(name, "none"), position=5, line=4),
        replace(row("comment", comment="Well."), position=0, line=5),
    ]  # fmt: skip
    decisions = ClassDecisions("decisions.csv", rows)
    first, second = decisions.give(students, press, rubric)
    assert [one.criterion for one in first.decided] == ["comment"]
    assert [one.verdict for one in second.decided] == ["full"]
    told = [problem.message for problem in decisions.problems()]
    assert told == [
        f"line {line}, position: s1 has the positions 0, 3: write which" for line in (3, 4)
    ]  # fmt: skip


def test_the_same_submission_decided_by_two_rows_is_not_guessed():
    rows = [replace(row("v_D", "full"), line=2), replace(row("v_D", "none"), position=0, line=3)]
    press = load_assignment("press")
    rubric = rubric_of(press)
    rows = [replace(one, criterion=rubric.criterion[0].id) for one in rows]
    decisions = ClassDecisions("decisions.csv", rows)
    (student,) = decisions.give([StudentSubmission("s1", Variant(position=0))], press, rubric)
    assert student.decided == ()
    assert [problem.message[:6] for problem in decisions.problems()] == ["line 2", "line 3"]


# Audit --------------------------------------------------------------------------------------------


def test_a_wrong_verdict_that_was_checked_opens_those_like_it_and_says_so(folder):
    hand_in(folder, "s3", 5)
    first = run(folder)
    assert first.trust is None
    scores = [report.score for report in first.reports]
    decide(folder, row("audit:v_B", "right; said=full", "s3"), row("audit:v_A", "wrong; said=full", "s2"))
    results = run(folder)
    (opened,) = results.trust.opened
    assert (opened.student_id, opened.like.criterion) == ("s2", "v_A")
    waiting = {report.student_id: report for report in results.reports if report.status == "needs_review"}
    assert len(waiting) == opened.count == 3
    for report in waiting.values():
        (criterion,) = [one for one in report.criteria if one.verdict == "review"]
        assert (criterion.id, criterion.proposed, report.said[criterion.id].settled) == ("v_A", "full", True)
        assert "found wrong" in criterion.feedback
    page = (folder.parent / "out" / "index.html").read_text(encoding="utf-8")
    assert "A settled verdict of s2 was wrong" in page
    decide(folder, row("v_A", "full", "s1"), row("v_A", "none", "s2"), row("v_A", "full", "s3"))
    results = run(folder)
    now = [report.score for report in results.reports]
    assert [score == before for score, before in zip(now, scores, strict=True)] == [True, False, True]
    assert results.trust.opened == [opened]
    # Who finds in the end that it was right closes the others again.
    path = folder / "decisions.csv"
    path.write_text(
        path.read_text(encoding="utf-8-sig").replace("s2,,v_A,none", "s2,,v_A,full"), encoding="utf-8"
    )
    results = run(folder)
    assert [report.score for report in results.reports] == scores
    assert results.trust.opened == []


def test_a_right_one_changes_no_mark_and_counts_for_what_the_program_still_says(folder):
    before = run(folder)
    decide(folder, row("audit:v_B", "right; said=full", "s2"), row("second:v_B", "none; said=full", "s2"))
    results = run(folder)
    assert results.moved == []
    assert [one.criteria for one in results.reports] == [one.criteria for one in before.reports]
    hand_in(folder, "s2", 9, v_B=3.0)
    assert run(folder).trust is None


def test_an_answer_on_what_was_handed_in_before_is_passed_over_and_nobody_is_asked_again(folder):
    stands = basis_of(StudentSubmission("s2", None), PUMP, RUBRIC, "audit:v_B")
    decide(folder, row("audit:v_B", "right; said=full", "s2", basis=stands))
    results = run(folder)
    assert (results.trust, results.stale) == (None, [])


@pytest.mark.parametrize("verdict", ["right", "right; said=", "good; said=full", "right; full", ""])
def test_an_audit_that_cannot_be_read_is_an_error_with_its_line(folder, verdict):
    path = folder / "decisions.csv"
    path.write_text(
        f"{','.join(COLUMNS)}\ns1,,audit:v_A,{verdict},,,,,\ns1,,audit:v_X,right; said=full,,,,,\n"
        f"s1,,second:v_A,{verdict},,,,,\n"
    )
    messages = [one.message for one in run(folder).unmatched]
    assert messages[0].startswith("line 2, verdict: ")
    assert messages[1].startswith("line 3, criterion: 'v_X' is not in this rubric")
    assert messages[2].startswith("line 4, verdict: ")
