"""Files of any content: filled in as meant, or refused; never anything else."""

import csv
import io
import json
import zipfile
from contextlib import suppress
from datetime import UTC, datetime

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from grader.lms.api.requests import submissions_in
from grader.lms.export import draft, export, read_results
from grader.lms.gradebooks import fill_gradebook
from grader.lms.grades import Options, Person, grades_of
from grader.lms.marks import numbered
from grader.lms.moodle import fill_worksheet
from grader.lms.table import with_ids
from reference.errors import PlanmarkError
from tests.examples import examples
from tests.unit.lms import importers
from tests.unit.lms.classroom import marked, report, results

HEADER = ("Identifier", "Full name", "Grade", "Maximum grade", "Last modified (grade)", "Feedback comments")
CANVAS = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Pump (1)", "Final Score")

CANVAS_OPTIONS = Options(to="canvas")

texts = st.text(alphabet=st.sampled_from("ăȘИя<>&;,\"'\n\r =+-@0"), max_size=8)
scores = st.integers(0, 1_000_000).map(lambda one: one / 100_000)
classes = st.lists(st.tuples(texts, texts, scores), min_size=1, max_size=6)
styles = st.sampled_from([("\n", csv.QUOTE_ALL), ("\r\n", csv.QUOTE_ALL), ("\r\n", csv.QUOTE_MINIMAL)])
quick = settings(max_examples=examples(100), suppress_health_check=[HealthCheck.function_scoped_fixture])


def written(rows, style, mark):
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator=style[0], quoting=style[1]).writerows(rows)
    return ("\ufeff" if mark else "").encode() + buffer.getvalue().encode()


def read(data):
    return list(csv.reader(io.StringIO(data.decode("utf-8-sig"), newline="")))


@quick
@given(classes, styles, st.booleans())
def test_moodle_stores_what_was_meant_in_any_worksheet(people, style, mark):
    rows = [[f"Participant {at}", name, "", "10.00", "-", old] for at, (name, old, _) in enumerate(people)]
    graded = [report(f"s{at}", score) for at, (*_, score) in enumerate(people)]
    known = {f"s{at}": Person(participant=at) for at in range(len(people))}
    comments = {student: f"<p>{student}, said</p>" for student in known}
    data = written([HEADER, *rows], style, mark)
    options = Options(to="moodle", people=known)
    filled = fill_worksheet(
        data, "w.csv", grades_of(results(*graded), options), options, comments, datetime.now(UTC)
    )
    site = importers.MoodleSite(10.0).upload(filled.content)
    assert site.comments == {at: comments[f"s{at}"] for at in range(len(people))}
    stored = {at: grade for at, (grade, _) in site.grades.items()}
    assert stored == {at: round(people[at][2], 2) for at in range(len(people))}
    for before, after in zip(read(data)[1:], read(filled.content)[1:], strict=True):
        assert before[:2] + before[3:5] == after[:2] + after[3:5]


@quick
@given(classes, styles, st.booleans())
def test_canvas_reads_what_was_meant_in_any_gradebook(people, style, mark):
    rows = [
        [name or "x", str(at + 1), f"s{at}", login, "1", "", "n/a"]
        for at, (name, login, _) in enumerate(people)
    ]
    points = ["    Points Possible", "", "", "", "", "10.00", "(read only)"]
    graded = grades_of(
        results(*(report(f"s{at}", score) for at, (*_, score) in enumerate(people))), CANVAS_OPTIONS
    )
    data = written([CANVAS, points, *rows], style, mark)
    draft = fill_gradebook(data, "g.csv", graded, CANVAS_OPTIONS)
    after = read(draft.content)
    assert [row[:5] for row in after] == [row[:5] for row in read(data)]
    assert [float(row[5]) for row in after[2:]] == [score for *_, score in people]


anything = st.one_of(
    st.binary(max_size=60),
    texts.map(str.encode),
    st.lists(texts, max_size=12).map(lambda cells: ",".join([*HEADER, *cells]).encode()),
    st.lists(texts, max_size=12).map(lambda cells: ",".join([*CANVAS, *cells]).encode()),
    st.lists(texts, max_size=6).map(lambda cells: ",".join(["student_id,id", *cells]).encode()),
)


@quick
@given(anything)
def test_a_file_of_any_content_is_used_or_refused(tmp_path, data):
    path = tmp_path / "file.csv"
    path.write_bytes(data)
    graded = grades_of(results(report("s0", 5.0)), CANVAS_OPTIONS)
    with suppress(PlanmarkError):
        fill_worksheet(data, "w.csv", graded, Options(to="moodle"), {}, datetime.now(UTC))
    with suppress(PlanmarkError):
        fill_gradebook(data, "g.csv", graded, CANVAS_OPTIONS)
    with suppress(PlanmarkError):
        with_ids({}, path)
    with suppress(PlanmarkError):
        numbered([], path)


keys = st.sampled_from(
    "areas cmid contextid definitions guide guide_criteria data criteria rubric id shortname description"
    " id userId recipient outcomes levels qualityId maxscore points schema_version reports student_id score"
    " assignment".split()
)
answers = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(-2, 3), st.floats(), texts),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(keys, inner, max_size=5)),
    max_leaves=15,
)


@quick
@given(answers)
def test_an_answer_of_any_shape_is_used_or_refused(tmp_path, document):
    path = tmp_path / "answer.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    assert all(one.user for one in submissions_in(document))
    with suppress(PlanmarkError):
        numbered([], path)
    with suppress(PlanmarkError):
        draft(results(marked("s01", 5.0)), Options(to="moodle", what="rubric", criteria=path))
    (tmp_path / "results.json").write_text(json.dumps(document), encoding="utf-8")
    with suppress(PlanmarkError):
        read_results(tmp_path)


@quick
@given(st.lists(st.sampled_from([5.0, 2.5, 0.0, 1.25, None]), min_size=1, max_size=6), texts, st.booleans())
def test_points_of_any_marks_are_told_alike_to_all_platforms(tmp_path, points, title, waits):
    if all(one is None for one in points):
        return
    one = marked("s01", *points, status="needs_review" if waits else "graded", title=title + " {}")
    path = tmp_path / "out.json"
    export(results(one), path, Options(to="lti"))
    (score,) = json.loads(path.read_bytes())["scores"]
    given_points = score.get("scoreGiven")
    assert (given_points is None) == waits
    table = tmp_path / "criteria.csv"
    numbers = [f"c{at},{at}" for at in range(1, len(points) + 1)]
    table.write_text("\n".join(["criterion,id", *numbers]))
    path = tmp_path / "out.zip"
    export(results(one), path, Options(to="canvas-api", course_id="1", assignment_id="2", criteria=table))
    with zipfile.ZipFile(path) as archive:
        bodies = [json.loads(archive.read(name)) for name in archive.namelist() if name != "plan.json"]
    assert (not bodies) == waits
    for body in bodies:
        total = sum(mark["points"] for mark in body["rubric_assessment"].values())
        assert abs(total - given_points) < 1e-4
        assert abs(float(body["submission"]["posted_grade"]) - given_points) < 1e-5
