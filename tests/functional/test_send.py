"""``planmark send`` against servers that do what the platforms do, and fail in places.

Canvas: app/models/rubric.rb, generate_criteria; app/models/rubric_association.rb, assert_uniqueness (a second
rubric takes the points of the first away) and assess. Moodle 4.5: mod/assign/externallib.php,
mod_assign_external::save_grade and save_grade_parameters; mod/assign/locallib.php,
assign::apply_grade_to_user, which stores points before plugins are asked; feedback/comments/locallib.php,
is_feedback_modified, which reads an editor that was not sent; lib/classes/grading_external.php,
core_grading_external::save_definitions.
"""

import json
import signal
import socket
import threading
import zipfile
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qsl

import jsonschema
import pytest

from grader.cli.exporting import schema
from grader.lms.export import export
from grader.lms.grades import Options, Person
from tests.functional.conftest import start
from tests.unit.lms.classroom import marked, moodle, results
from tests.waiting import PATIENCE_S

TOKEN = "very-secret-7"  # noqa: S105 - a test's
STUDENTS = [f"s{at:02}" for at in range(1, 8)]


class Server(BaseHTTPRequestHandler):
    """Answers a call by the first trouble that waits for the end of its address, else as the platform does.

    A trouble is a status with headers; `lost` is carried out, and its answer dropped; `dropped` is not.
    """

    def log_message(self, *args):
        """Nothing on the terminal."""

    def do_GET(self):
        length = int(self.headers.get("Content-Length", 0))
        sent, where = self.rfile.read(length), self.path.partition("?")[0]
        self.server.asked.append(f"{self.command} {where.rpartition('/')[2]}")
        waiting = next((each for end, each in self.server.trouble.items() if where.endswith(end)), [])
        status, headers = waiting.pop(0) if waiting else (200, {})
        if status == "lost":
            self.answer(sent)
        if status in {"lost", "dropped"}:
            self.connection.shutdown(socket.SHUT_RDWR)
            return
        if status == "hangs":
            self.server.hangs.set()
            self.server.goes_on.wait(PATIENCE_S)
        if isinstance(status, int) and status >= 300:
            # Some servers show what they were sent.
            body = {"errors": [{"message": f"trouble with {self.headers['Authorization']}"}]}
        else:
            status, body = self.answer(sent)
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body if isinstance(body, bytes) else json.dumps(body).encode())

    do_POST = do_PUT = do_PATCH = do_GET  # noqa: N815 - http.server's names


class Canvas(Server):
    def answer(self, sent):
        server, body, last = self.server, json.loads(sent or b"null"), self.path.rpartition("/")[2]
        if self.headers["Authorization"] != f"Bearer {TOKEN}":
            return 401, {"errors": [{"message": "Invalid access token."}]}
        if last == "rubrics":
            server.made, server.points = server.made + 1, {}
            criteria = body["rubric"]["criteria"].values()
            server.rubric = [{**each, "id": server.prefix + each["id"]} for each in criteria]
            return 200, {"rubric": {"id": server.made}, "rubric_association": {"id": 4}}
        if self.command == "GET":
            shown = {"rubric": server.rubric, "rubric_settings": {"id": server.made}} if server.rubric else {}
            return 200, {"id": 345, "name": "Pump", "description": "<p>Draw.</p>", **shown}
        given = body["rubric_assessment"]
        known = {each["id"] for each in server.rubric}
        server.grades[last] = body["submission"]["posted_grade"]
        server.points[last] = {name: one["points"] for name, one in given.items() if name in known}
        return 200, {"id": 7, "score": float(server.grades[last])}


class OpenEdx(Server):
    def answer(self, sent):
        who = self.path.rpartition("=")[2]
        if "/lock?" in self.path:
            self.server.locked.add(who)
            return 200, {"lockStatus": "in-progress"}
        if who not in self.server.locked:
            return 409, {"error": "ERR_GRADE_CONTESTED"}
        self.server.locked.discard(who)
        self.server.grades[who] = json.loads(sent)
        return 200, {"gradeStatus": "graded"}


class Graph(Server):
    def answer(self, sent):
        server, body = self.server, json.loads(sent or b"null")
        if self.path.endswith("/rubrics"):
            server.made += 1
            qualities = [{**each, "qualityId": f"q{at}"} for at, each in enumerate(body["qualities"])]
            server.rubric = {**body, "id": "r 1", "qualities": qualities}
            return 201, server.rubric
        if self.path.endswith("$ref"):
            server.grades["attached"] = body["@odata.id"]
            return 204, b""
        return (200, server.rubric) if server.grades else (404, {"error": {"code": "NotFound"}})


CRITERIA = [{"id": at, "shortname": f"c{at}: Vector {at}", "maxscore": 5} for at in (1, 2)]
GUIDE = {"id": 3, "method": "guide", "guide": {"guide_criteria": CRITERIA}}
OTHER = {"id": 3, "method": "guide", "guide": {"guide_criteria": CRITERIA[:1]}}
FILLED = {"id": 1, "itemid": 7, "guide": {"criteria": [{"criterionid": 1}, {"criterionid": 2}]}}
REQUIRED = {"assignmentid", "userid", "grade", "attemptnumber", "addattempt", "workflowstate", "applytoall"}
PEOPLE = {f"s{at}": Person(platform_id=str(at)) for at in (1, 2, 3)}


class Moodle(Server):
    def answer(self, sent):
        fields = dict(parse_qsl(sent.decode(), keep_blank_values=True))
        assert fields.pop("moodlewsrestformat") == "json"
        if fields.pop("wstoken") != TOKEN:
            return 200, {"exception": "core\\exception\\moodle_exception", "errorcode": "invalidtoken"}
        return 200, getattr(self, fields.pop("wsfunction"))(fields)

    def mod_assign_save_grade(self, sent):
        server, user = self.server, sent["userid"]
        names = {name.partition("[")[0] for name in sent}
        if names - REQUIRED - {"plugindata", "advancedgradingdata"} or REQUIRED - names:
            return {"exception": "invalid_parameter_exception", "message": "Invalid parameter value"}
        if user in server.unknown:
            return {"exception": "dml_missing_record_exception", "message": f"no user {user}"}
        before = "advancedgradingdata[guide][criteria]"
        server.points[user] = [float(sent[f"{before}[{at}][fillings][0][score]"]) for at in range(2)]
        comment = sent.get("plugindata[assignfeedbackcomments_editor][text]")
        if comment is None and user in server.comments:
            return {"exception": "dml_write_exception", "message": "Error writing to database"}
        assert sent.get("plugindata[assignfeedbackcomments_editor][format]", "1") == "1"
        if comment is not None:
            server.comments[user] = comment
        return None

    def core_grading_get_definitions(self, sent):
        assert sent == {"cmids[0]": "31", "areaname": "submissions"}
        return {"areas": [{"cmid": 31, "contextid": 57, "definitions": self.server.guides}], "warnings": []}

    def core_grading_get_gradingform_instances(self, sent):
        assert sent == {"definitionid": "3"}
        return {"instances": [FILLED, {"id": 2, "itemid": 8}], "warnings": []}

    def core_grading_save_definitions(self, sent):
        before = "areas[0][definitions][0][guide][guide_criteria]"
        pairs = [(sent[f"{before}[{at}][shortname]"], sent[f"{before}[{at}][maxscore]"]) for at in range(2)]
        named = [
            {"id": 10 + at, "shortname": name, "maxscore": float(most)}
            for at, (name, most) in enumerate(pairs)
        ]
        self.server.guides = [{**GUIDE, "guide": {"guide_criteria": named}}]
        self.server.made += 1


# The desk -----------------------------------------------------------------------------------------


@contextmanager
def served(kind):
    server = ThreadingHTTPServer(("127.0.0.1", 0), kind)
    server.asked, server.trouble, server.made, server.rubric, server.prefix = [], {}, 0, [], ""
    server.grades, server.points, server.comments, server.locked, server.unknown = {}, {}, {}, set(), set()
    server.guides, server.hangs, server.goes_on = [], threading.Event(), threading.Event()
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    try:
        yield server
    finally:
        server.goes_on.set()
        server.shutdown()
        thread.join()
        server.server_close()


@pytest.fixture
def canvas():
    with served(Canvas) as server:
        yield server


@pytest.fixture
def site():
    with served(Moodle) as server:
        yield server


@pytest.fixture
def waits(monkeypatch):
    """Return the waits that were asked for, without waiting."""
    monkeypatch.setenv("PLANMARK_TOKEN", TOKEN)
    waited = []
    monkeypatch.setattr("grader.cli.sending.time.sleep", waited.append)
    return waited


@pytest.fixture
def send(planmark, waits):
    del waits

    def send(path, server, *more):
        return planmark(
            "send", path, "--site", f"http://127.0.0.1:{server.server_port}", *(more or ["--yes"])
        )

    return send


def exported(tmp_path, to="canvas-api", points=2.5, students=STUDENTS, **how):
    """An export of a class, in which the last student has some points."""
    path = tmp_path / "marks" / f"export-{to}.zip"
    path.parent.mkdir(exist_ok=True)
    reports = [marked(student, 5.0, points if student == students[-1] else 1.0) for student in students]
    export(results(*reports), path, Options(to=to, **{"course_id": "12", "assignment_id": "345"} | how))
    return path


def refused(status, times=1, **headers):
    return [(status, {name.replace("_", "-"): value for name, value in headers.items()})] * times


# Canvas -------------------------------------------------------------------------------------------


def test_everything_else_arrives_and_running_it_again_changes_nothing(tmp_path, canvas, send, waits):
    soon = format_datetime(datetime.now(UTC) + timedelta(seconds=90), usegmt=True)
    canvas.trouble = {
        ":s02": refused(404, 2), ":s03": refused(429, Retry_After="7"), ":s04": refused(500),
        ":s05": refused("dropped"), ":s06": refused("lost"), ":s07": refused(429, Retry_After=soon),
    }  # fmt: skip
    path = exported(tmp_path)
    ran = send(path, canvas, "--yes", "--log", tmp_path / "a.log", "-v")
    assert ran.returncode == 1
    assert [line for line in ran.stdout.splitlines() if line.startswith("  ")] == [
        '  s02 (grade): the platform answered 404: {"errors": [{"message": "trouble with Bearer (token)"}]}'
    ]
    assert "sent: 7 / 7" in ran.stderr
    assert set(canvas.grades) == {f"sis_user_id:{each}" for each in STUDENTS if each != "s02"}
    assert canvas.points["sis_user_id:s07"] == {"c1": 5.0, "c2": 2.5}
    assert waits[:4] == [7.0, 1.0, 1.0, 1.0]
    assert 30 < waits[4] <= 90
    canvas.asked.clear()
    assert send(path, canvas).returncode == 1
    # What is there is looked up, so that no second rubric is made.
    assert canvas.asked == ["GET 345", "PUT sis_user_id:s02"]
    assert send(path, canvas).returncode == 0
    canvas.asked.clear()
    assert send(path, canvas).returncode == 0
    assert (canvas.asked, canvas.made, len(canvas.points)) == ([], 1, 7)
    written = [each for each in tmp_path.rglob("*") if each.is_file()]
    assert {each.name for each in written} >= {"a.log", "sent.json"}
    assert TOKEN not in ran.stdout + ran.stderr
    assert not [each for each in written if TOKEN.encode() in each.read_bytes()]
    record = json.loads((path.parent / "sent.json").read_bytes())
    jsonschema.validate(record, schema("sent"))
    assert {call["status"] for call in record["calls"].values()} == {200}


def test_after_a_regrade_the_changed_alone_are_sent_and_the_rubric_stays(tmp_path, canvas, send):
    canvas.prefix = "9_"
    assert send(exported(tmp_path), canvas).returncode == 0
    assert canvas.points["sis_user_id:s01"] == {"9_c1": 5.0, "9_c2": 1.0}
    canvas.asked.clear()
    path = exported(tmp_path, points=4.0)
    ran = send(path, canvas, "-q")
    assert ran.returncode == 1
    assert (
        "1 grade\n  students (1): s07\n  calls sent before and unchanged: 7\nnothing was sent" in ran.stdout
    )
    assert canvas.asked == []
    assert send(path, canvas).returncode == 0
    assert canvas.asked == ["GET 345", "PUT sis_user_id:s07"]
    assert canvas.points["sis_user_id:s07"] == {"9_c1": 5.0, "9_c2": 4.0}
    # Without the record everything is sent again, and no rubric.
    (path.parent / "sent.json").unlink()
    assert (send(path, canvas).returncode, canvas.made, len(canvas.points)) == (0, 1, 7)


def test_what_a_lost_answer_leaves_open_is_sent_again_though_the_mark_goes_back(tmp_path, canvas, send):
    assert send(exported(tmp_path), canvas).returncode == 0
    canvas.trouble = {":s07": refused("lost", 5)}
    assert send(exported(tmp_path, points=4.0), canvas).returncode == 1
    assert canvas.grades["sis_user_id:s07"] == "9"
    assert send(exported(tmp_path), canvas).returncode == 0
    assert canvas.grades["sis_user_id:s07"] == "7.5"


def test_a_rubric_that_was_deleted_is_made_again_with_everybodys_points(tmp_path, canvas, send):
    assert send(exported(tmp_path), canvas).returncode == 0
    canvas.rubric, canvas.points = [], {}
    assert send(exported(tmp_path, points=4.0), canvas).returncode == 0
    assert (canvas.made, len(canvas.points)) == (2, 7)


def test_another_rubric_is_never_replaced(tmp_path, canvas, send):
    canvas.rubric = [{"id": "x", "description": "c1: Vector 1", "points": 4.0}]
    ran = send(exported(tmp_path), canvas)
    assert (ran.returncode, canvas.made, canvas.grades) == (1, 0, {})
    assert "rubric: the assignment has another rubric" in ran.stdout
    assert "4 points there, 5 in the rubric" in ran.stdout
    assert f"not tried: {', '.join(STUDENTS)}" in ran.stdout


@pytest.mark.parametrize("how", ["lost", "dropped", 500])
def test_a_rubric_that_may_have_arrived_is_not_sent_again_before_a_look(tmp_path, canvas, send, how):
    canvas.trouble = {"/rubrics": refused(how)}
    path = exported(tmp_path)
    ran = send(path, canvas)
    assert (ran.returncode, canvas.grades) == (1, {})
    assert "rubric: it may have arrived" in ran.stdout
    assert canvas.asked.count("POST rubrics") == 1
    assert (send(path, canvas).returncode, canvas.made, len(canvas.points)) == (0, 1, 7)


@pytest.mark.parametrize(
    ("trouble", "asked", "told"),
    [
        ({"345": refused(401)}, 1, "the token is refused (401)"),
        ({"345": refused(302, Location="//a@elsewhere.org/")}, 1, "redirects to http://elsewhere.org, and"),
        ({":s03": refused(401)}, 6, "s03 (grade): the token is refused"),
        ({f":s0{at}": refused(403) for at in range(1, 8)}, 6, "not tried: s04, s05, s06, s07"),
        ({f":s0{at}": refused(503, 5) for at in range(2, 8)}, 19, "not tried: s05, s06, s07"),
        ({":s03": refused(429, Retry_After="3600")}, 6, "asks to wait 3600\u00a0s"),
        ({":s03": refused(403, 9), ":s04": refused(403, 9)}, 10, "s04 (grade): the platform answered 403"),
    ],
)
def test_it_stops_where_all_others_would_fail_too(tmp_path, canvas, send, trouble, asked, told):
    canvas.trouble = trouble
    ran = send(exported(tmp_path), canvas)
    assert (ran.returncode, len(canvas.asked)) == (1, asked), ran.stdout
    assert told in ran.stdout


def test_nothing_is_sent_to_where_the_site_leads(tmp_path, canvas, send):
    with served(Canvas) as other:
        place = f"http://127.0.0.1:{other.server_port}/api"
        canvas.trouble = {"345": refused(307, Location=place), "/rubrics": refused(307, Location=place)}
        assert send(exported(tmp_path), canvas).returncode == 1
        assert other.asked == []


def test_a_page_that_is_no_answer_of_the_platform_is_no_success(tmp_path, canvas, send, monkeypatch):
    monkeypatch.setattr(Canvas, "answer", lambda *_: (200, b"<html>Sign in</html>"))
    ran = send(exported(tmp_path), canvas)
    assert (ran.returncode, len(canvas.asked)) == (1, 1)
    assert "is not one of the platform's API; check --site: <html>Sign in" in ran.stdout


def test_a_server_that_is_not_there_is_told(tmp_path, send, waits):
    path = exported(tmp_path)
    with served(Canvas) as gone:
        pass
    ran = send(path, gone)
    assert (ran.returncode, waits) == (1, [1.0, 2.0, 4.0, 8.0])
    assert "rubric: no answer ([Errno" in ran.stdout


def test_an_interrupted_run_loses_nothing(tmp_path, canvas, send):
    canvas.trouble = {":s04": refused("hangs")}
    path = exported(tmp_path)
    site = f"http://127.0.0.1:{canvas.server_port}"
    with start(tmp_path, "send", path, "--site", site, "--yes", PLANMARK_TOKEN=TOKEN) as process:
        assert canvas.hangs.wait(PATIENCE_S)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    canvas.goes_on.set()
    canvas.asked.clear()
    assert send(path, canvas).returncode == 0
    assert canvas.asked == ["GET 345", *(f"PUT sis_user_id:s0{at}" for at in (4, 5, 6, 7))]
    assert (canvas.made, len(canvas.points)) == (1, 7)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["none.zip"], "none.zip: cannot be read"),
        (["results.json"], "results.json: holds no calls to send"),
        (["old.zip"], "old.zip: holds no calls to send"),
        (["marks/export-canvas-api.zip"], "give the address of your Canvas: --site"),
        (["marks/export-canvas-api.zip", "--site", "http://canvas.uni.ro"], "others could read the token"),
        (["marks/export-canvas-api.zip", "--site", "canvas.uni.ro"], "write it as https://NAME"),
        (["marks/export-canvas-api.zip", "--site", "https://a:b@uni.ro"], "--site uni.ro: write it as"),
        (["marks/export-canvas-api.zip", "--site", "https://uni.ro:x"], "write it as https://NAME"),
        (["marks/export-canvas-api.zip", "--site", "http://localhost:1", "--yes"], "as PLANMARK_TOKEN"),
    ],
)
def test_a_wrong_call_is_told_and_sends_nothing(tmp_path, planmark, monkeypatch, words, told):
    monkeypatch.setenv("PLANMARK_TOKEN", "two words")
    path = exported(tmp_path)
    (tmp_path / "results.json").write_text("{}")
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(tmp_path / "old.zip", "w") as old:
        for name in archive.namelist():
            document = json.loads(archive.read(name))
            for call in document.get("calls", []):
                call.pop("unless", None)
            old.writestr(name, json.dumps(document))
    ran = planmark("send", *words)
    assert (ran.returncode, told in ran.stderr) == (2, True), ran.stderr
    assert not (path.parent / "sent.json").exists()


def test_a_damaged_record_and_one_that_is_used_are_told(tmp_path, canvas, send):
    path = exported(tmp_path)
    (path.parent / "sent.json").write_text("{")
    ran = send(path, canvas)
    assert (ran.returncode, canvas.asked) == (2, [])
    assert "sent.json: is no record of what was sent" in ran.stderr


def test_a_folder_is_sent_as_its_archive_is(tmp_path, canvas, send):
    path = exported(tmp_path)
    with zipfile.ZipFile(path) as archive:
        archive.extractall(path.parent / "calls")
    assert send(path.parent / "calls" / "plan.json", canvas).returncode == 0
    canvas.asked.clear()
    assert [send(each, canvas).returncode for each in (path, path.parent / "calls")] == [0, 0]
    assert canvas.asked == []


# Open edX, Graph ----------------------------------------------------------------------------------


def test_all_calls_of_a_student_are_sent_again_where_one_failed(tmp_path, send):
    submissions = tmp_path / "submissions.json"
    known = [{"submissionUUID": f"u-{each}", "username": each} for each in ("s01", "s02", "s03")]
    submissions.write_text(json.dumps({"submissions": known}))
    path = exported(
        tmp_path, "openedx", students=["s01", "s02", "s03"], course_id=None, submissions=submissions
    )
    with served(OpenEdx) as server:
        server.trouble = {
            "/grade": [(200, {}), *refused("lost")],
            "/lock": [(200, {}), (200, {}), *refused(409)],
        }
        ran = send(path, server)
        assert (ran.returncode, set(server.grades)) == (1, {"u-s01", "u-s02"})
        assert "s02 (grade): it may have arrived" in ran.stdout
        assert "s03 (lock): the platform answered 409" in ran.stdout
        server.asked.clear()
        assert send(path, server).returncode == 0
        assert server.asked == ["POST lock", "POST grade"] * 2
        assert set(server.grades) == {"u-s01", "u-s02", "u-s03"}


def test_graphs_rubric_is_made_once_and_attached_by_the_id_that_it_got(tmp_path, send):
    path = exported(tmp_path, "ms-education")
    with served(Graph) as server:
        server.trouble = {"$ref": refused(400)}
        assert send(path, server).returncode == 1
        ran = send(path, server)
        assert (ran.returncode, server.made) == (0, 1)
        assert server.grades["attached"] == "https://graph.microsoft.com/v1.0/education/me/rubrics/r%201"
        answer = path.with_name("export-ms-education-answer.json")
        assert f"export the marks with --criteria {answer}" in ran.stdout
        assert json.loads(answer.read_bytes())["qualities"][1]["qualityId"] == "q1"
        server.asked.clear()
        assert (send(path, server).returncode, server.asked) == (0, [])


# Moodle -------------------------------------------------------------------------------------------


def definitions(tmp_path, *guides):
    path = tmp_path / "definitions.json"
    area = {"cmid": 31, "contextid": 57, "activemethod": "guide", "definitions": list(guides)}
    path.write_text(json.dumps({"areas": [area]}), encoding="utf-8")
    return path


def points(tmp_path, **how):
    reports = [marked(f"s{at}", 5.0, 1.0 * at) for at in (1, 2, 3)]
    how = {"criteria": definitions(tmp_path, GUIDE), "people": PEOPLE, "assignment_id": "17"} | how
    return moodle(tmp_path, "marks", *reports, **how)[1]


def test_moodles_points_and_comments_are_stored_where_comments_are_there_already(tmp_path, site, send):
    site.comments.update({"1": "well done", "3": "see me"})
    site.trouble = {"server.php": refused("lost")}
    assert send(points(tmp_path), site).returncode == 0
    assert site.points == {"1": [5.0, 1.0], "2": [5.0, 2.0], "3": [5.0, 3.0]}
    assert all("Vector 2" in comment for comment in site.comments.values())


def test_without_a_comment_in_the_call_moodle_would_store_half_of_it(tmp_path, site, send):
    path = points(tmp_path)
    document = json.loads(path.read_bytes())
    del document["calls"][0]["arguments"]["plugindata"]
    path.write_text(json.dumps(document))
    site.comments["1"] = "well done"
    ran = send(path, site)
    assert "s1 (points): the platform answered 200" in ran.stdout
    assert "Error writing to database" in ran.stdout
    assert (site.points["1"], site.comments["1"]) == ([5.0, 1.0], "well done")


def test_an_exception_of_moodle_is_a_failure_of_that_student_alone(tmp_path, site, send):
    site.unknown.add("2")
    path = points(tmp_path)
    ran = send(path, site)
    assert (ran.returncode, list(site.points)) == (1, ["1", "3"])
    assert "s2 (points)" in ran.stdout
    assert "no user 2" in ran.stdout
    site.unknown.clear()
    site.asked.clear()
    assert (send(path, site).returncode, len(site.asked), len(site.comments)) == (0, 1, 3)


def test_a_token_that_moodle_does_not_know_ends_it(tmp_path, site, send, monkeypatch):
    monkeypatch.setenv("PLANMARK_TOKEN", "other")
    ran = send(points(tmp_path), site)
    assert (ran.returncode, len(site.asked)) == (1, 1)
    assert "the token is refused" in ran.stdout


def test_a_guide_that_came_meanwhile_is_not_deleted_with_its_fillings(tmp_path, site, send):
    report = marked("s1", 5.0, 1.0)
    _, path = moodle(tmp_path, "rubric", report, criteria=definitions(tmp_path))
    site.guides = [OTHER]
    ran = send(path, site)
    assert (ran.returncode, site.made) == (1, 0)
    assert "has 2 fillings of 2 grades" in ran.stdout
    assert "--replace-guide of export" in ran.stdout
    given = tmp_path / "instances.json"
    how = {"criteria": definitions(tmp_path, OTHER), "replace_guide": given}
    for instances, made in (([], 0), ([FILLED], 1)):
        given.write_text(json.dumps({"instances": instances}))
        _, path = moodle(tmp_path, "rubric", report, **how)
        assert (send(path, site).returncode, site.made) == (1 - made, made)


def test_a_guide_is_made_once_and_its_numbers_lead_to_the_points(tmp_path, site, send):
    _, path = moodle(tmp_path, "rubric", marked("s1", 5.0, 1.0), criteria=definitions(tmp_path))
    ran = send(path, site)
    assert (ran.returncode, site.made) == (0, 1)
    answer = tmp_path / "out-answer.json"
    assert f"--criteria {answer}" in ran.stdout
    # An export that is written anew has another time in it; the same guide is there already.
    moodle(tmp_path, "rubric", marked("s1", 5.0, 2.0), criteria=definitions(tmp_path), item="New")
    assert (send(path, site).returncode, site.made) == (0, 1)
    assert send(points(tmp_path, criteria=answer), site).returncode == 0
    assert list(site.points) == ["1", "2", "3"]
