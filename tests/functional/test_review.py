"""`planmark review` as a command: what it refuses, and how it ends."""

import csv
import json
import math
import re
import signal
import socket
import urllib.error
import urllib.request
from dataclasses import replace

import numpy as np
import pytest

from grader.folder.batch import Batch
from grader.printed.answer_sheet import make_sheets
from grader.printed.layout import values_of
from grader.review.questions import look_of
from grader.review.records import Answer
from grader.review.session import Session
from grader.rubric import load_rubric
from grader.tables.decision_texts import place_text
from grader.tables.roster import RosterRow
from reference.authored.assignment import load_assignment
from samples.simulation import CAREFUL, any_settings, simulate
from samples.simulation.forces import any_drawer_of_forces
from samples.simulation.printing import printed_sheets
from samples.simulation.wording import declared_texts
from tests.functional.conftest import start
from tests.inline import Inline
from tests.waiting import PATIENCE_S


@pytest.fixture
def graded(planmark, tmp_path):
    folder = tmp_path / "class"
    folder.mkdir()
    entered = {"student_id": "s07", "n": 7, "segments_mm": {"v_A": 60.0}}
    (folder / "s07.json").write_text(json.dumps(entered), encoding="utf-8")
    done = planmark("grade", "class", "--assignment", "pump", "--out", "out", "--jobs", "1")
    assert done.returncode in {0, 1}, done.stderr
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "no such folder"),
        (["."], "run planmark grade first"),
        (["out", "--host", "0.0.0.0"], "--token"),  # noqa: S104 - refused
        (["out", "--host", "0.0.0.0", "--token", "short"], "8 characters"),  # noqa: S104 - refused
        (["out", "--lang", "fr"], "en, ro, ru"),
    ],
)
def test_a_call_that_cannot_be_carried_out_says_why(planmark, tmp_path, arguments, said):
    (tmp_path / "out").mkdir()
    done = planmark("review", *arguments)
    assert done.returncode == 2
    assert said in done.stderr


@pytest.mark.usefixtures("graded")
def test_a_port_that_is_taken_is_told(planmark):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = planmark("review", "out", "--port", port)
    assert done.returncode == 2
    assert "--port" in done.stderr


def test_a_decision_is_in_the_results_when_the_review_has_ended(graded):
    served = start(graded, "review", "class", "--port", "0", "--jobs", "1")
    address = re.search(r"http://\S+", served.stdout.readline())[0]
    answer = {"student": "s07", "criterion": "v_A", "verdict": "none", "seen": ""}
    request = urllib.request.Request(  # noqa: S310 - this machine's
        f"{address}api/decide",
        json.dumps({"by": "Ana", "window": "w", "answers": [answer]}).encode(),
        {"Content-Type": "application/json", "X-Planmark": "review"},
    )
    with urllib.request.urlopen(request) as response:  # noqa: S310 - this machine's
        assert json.load(response)["version"] > 0
    with pytest.raises(urllib.error.HTTPError):
        urllib.request.urlopen(f"{address}api/question")  # noqa: S310 - this machine's
    served.send_signal(signal.SIGINT)
    said, _ = served.communicate(timeout=PATIENCE_S)
    assert served.returncode == 0, said
    assert "1 submission: " in said
    report = json.loads((graded / "out" / "s07" / "report.json").read_text(encoding="utf-8"))
    decided = {one["id"]: one["decided"] for one in report["criteria"] if one["decided"]}
    assert decided["v_A"]["by"] == "Ana"
    assert (graded / "class" / "decisions.csv").is_file()


FORCE_SHEETS = {"s01": (96501, ""), "s02": (96502, ""), "s03": (96515, "wrong_arm")}
"""Seeds and mistakes of students; the first has a printed sheet. None uses the usual order of forces."""
AT_CORNER_MM = 2.0
"""A force shorter than this may be left out, and its corner with it."""


def force_sheets(folder):
    """A class of force sheets with its roster; returns the truth of each sheet."""
    assignment, truths, lines = load_assignment("pump-forces"), {}, ["student_id,name,n,kL,kF"]
    for student_id, (seed, mistake) in FORCE_SHEETS.items():
        variant = assignment.variant(seed % 30 + 1)
        settings = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.0)
        hand = any_drawer_of_forces(settings.student, np.random.default_rng([seed, 12]))
        hand = replace(hand, mistakes=(mistake,) if mistake else (), force_order="backwards")
        settings = replace(settings, hand=CAREFUL, student=hand, pen=replace(settings.pen, arrow="open"))
        printed = None
        if student_id == "s01":
            asked = load_rubric("pump-forces").entries
            row = RosterRow(student_id, "A", variant.n, None)
            document = make_sheets(assignment, [row], "ro", asked=asked)
            printed = printed_sheets(document.pdf, document.layout)
        (sheet,) = simulate(assignment, variant, seed, settings, student_id=student_id, printed=printed)
        sheet.save(folder / student_id)
        truths[student_id] = sheet.truth
        scales = declared_texts(sheet.truth["scales"]["declared"])
        lines.append(f"{student_id},{student_id},{variant.n},{scales['kL']},{scales['kF']}")
    (folder / "roster.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return truths


@pytest.mark.slow
def test_force_sheets_are_graded_reviewed_and_exported(planmark, tmp_path):
    folder, out = tmp_path / "class", tmp_path / "out"
    folder.mkdir()
    truths = force_sheets(folder)
    done = planmark("grade", "class", "--assignment", "pump-forces", "--out", "out", "--jobs", "1")
    assert done.returncode in {0, 1}, done.stderr
    session = Session(
        Batch(load_assignment("pump-forces"), load_rubric("pump-forces"), folder, out), Inline()
    )
    session.bring_up_to_date(lambda *_: None)
    first = session.students[0]
    moment = next(one for one in first.report.criteria if one.id == "M_b")
    assert moment.measured.value == float(truths["s01"]["fields"]["M_b_value"])
    assert moment.verdict in {"full", "follow_through"}
    x, y, wide, high = look_of(session, first, moment)["box"]
    batch = session.batch
    place = values_of(batch.assignment, ("mechanism", "force_plans"), batch.rubric.entries)["M_b"]
    for left, top, w, h in (place.box, *place.senses):
        assert x < left < left + w < x + wide
        assert y < top < top + h < y + high
    moved = 0
    for student in session.students:
        figures = truths[student.key]["figures"]
        for kind, read in student.report.reading.sheets[0].figures.items():
            ends = [end for one in figures[kind].get("vectors", {}).values() for end in one["line_mm"]]
            for node, _, at in session.nodes_of(student, kind, read) if read.drawn else ():
                assert min(math.dist(at, end) for end in ends) < AT_CORNER_MM, (student.key, node)
                answer = Answer(student.key, f"node:{kind}:{node}", place_text(*at))
                session.decide([answer], "Ana", "w")
                moved += 1
        wrong = {one.id: one.verdict for one in student.report.criteria if one.verdict in {"none", "partial"}}
        undrawn = {name for figure in figures.values() for name in figure.get("missing", {})}
        assert wrong.keys() <= undrawn | ({"R_0D"} if truths[student.key]["mistakes"] else set()), wrong
        while doubts := session.doubts(student):
            rows = doubts[0].likeliest.rows
            session.decide([Answer(student.key, *row, seen="") for row in rows], "Ana", "w")
    assert moved > 8
    session.bring_up_to_date(lambda *_: None)
    for form in ("csv", "json", "moodle"):
        assert planmark("export", "out", "--to", form).returncode == 0
    rows = csv.DictReader((out / "export-csv.csv").read_text(encoding="utf-8-sig").splitlines())
    assert {(row["student_id"], row["status"]) for row in rows} == {(one, "graded") for one in FORCE_SHEETS}
    reports = json.loads((out / "results.json").read_text(encoding="utf-8"))["reports"]
    assert all(one["score"] > 0.6 * one["max_score"] for one in reports)
