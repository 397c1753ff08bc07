"""The script of docs/exports.md that sends calls to Moodle, against a server with Moodle's rules.

Moodle 4.5: mod/assign/externallib.php, mod_assign_external::save_grade and save_grade_parameters;
mod/assign/locallib.php, assign::apply_grade_to_user, which stores points before plugins are asked;
feedback/comments/locallib.php, assign_feedback_comments::is_feedback_modified, which reads an editor that
was not sent; lib/classes/grading_external.php, core_grading_external::save_definitions.
"""

import json
import re
import subprocess
import sys
import textwrap
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from urllib.parse import parse_qsl

import pytest

from grader.lms.grades import Person
from tests.unit.lms.classroom import marked, moodle

DOCUMENT = (Path(__file__).parents[2] / "docs" / "exports.md").read_text(encoding="utf-8")
(SCRIPT,) = re.findall(r"(?ms)^    import json, sys, urllib.*?^        print\(\"stored\"\)$", DOCUMENT)
CRITERIA = [{"id": at, "shortname": f"c{at}: Vector {at}", "maxscore": 5} for at in (1, 2)]
GUIDE = {"id": 3, "method": "guide", "guide": {"guide_criteria": CRITERIA}}
FILLED = {"id": 1, "itemid": 7, "guide": {"criteria": [{"criterionid": 1}, {"criterionid": 2}]}}
REQUIRED = {"assignmentid", "userid", "grade", "attemptnumber", "addattempt", "workflowstate", "applytoall"}
PEOPLE = {f"s{at}": Person(platform_id=str(at)) for at in (1, 2, 3)}


class Moodle(BaseHTTPRequestHandler):
    """What is stored: points and comments by user, guides by activity."""

    def do_POST(self):
        sent = dict(
            parse_qsl(self.rfile.read(int(self.headers["Content-Length"])).decode(), keep_blank_values=True)
        )
        assert sent.pop("wstoken") == "secret"
        assert sent.pop("moodlewsrestformat") == "json"
        answer = getattr(self, sent.pop("wsfunction"))(sent)
        body = json.dumps(answer).encode()
        self.send_response(200)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *args):
        """Nothing on the terminal."""

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
        self.server.saved.append(sent["areas[0][definitions][0][guide][guide_criteria][0][shortname]"])


@pytest.fixture
def site():
    server = HTTPServer(("127.0.0.1", 0), Moodle)
    server.points, server.comments, server.unknown, server.guides, server.saved = {}, {}, set(), [], []
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def send(tmp_path, site, path):
    script = tmp_path / "send.py"
    script.write_text(textwrap.dedent(SCRIPT), encoding="utf-8")
    address = f"http://127.0.0.1:{site.server_port}"
    return subprocess.run(  # noqa: S603 - the documentation's own script
        [sys.executable, script, address, "secret", path], capture_output=True, text=True, check=False
    )


def definitions(tmp_path, *guides):
    path = tmp_path / "definitions.json"
    area = {"cmid": 31, "contextid": 57, "activemethod": "guide", "definitions": list(guides)}
    path.write_text(json.dumps({"areas": [area]}), encoding="utf-8")
    return path


def marks(tmp_path):
    reports = [marked(f"s{at}", 5.0, 1.0 * at) for at in (1, 2, 3)]
    how = {"criteria": definitions(tmp_path, GUIDE), "people": PEOPLE, "assignment_id": "17"}
    return moodle(tmp_path, "marks", *reports, **how)[1]


def test_points_and_comments_are_stored_where_comments_are_there_already(tmp_path, site):
    site.comments.update({"1": "well done", "3": "see me"})
    ran = send(tmp_path, site, marks(tmp_path))
    assert (ran.returncode, ran.stdout) == (0, "s1: stored\ns2: stored\ns3: stored\n")
    assert site.points == {"1": [5.0, 1.0], "2": [5.0, 2.0], "3": [5.0, 3.0]}
    assert all("Vector 2" in comment for comment in site.comments.values())


def test_without_a_comment_in_the_call_half_of_it_would_be_stored(tmp_path, site):
    path = marks(tmp_path)
    document = json.loads(path.read_bytes())
    del document["calls"][0]["arguments"]["plugindata"]
    path.write_text(json.dumps(document))
    site.comments["1"] = "well done"
    ran = send(tmp_path, site, path)
    assert "Error writing to database" in ran.stderr
    assert (site.points, site.comments) == ({"1": [5.0, 1.0]}, {"1": "well done"})


def test_the_script_stops_at_the_first_error_and_tells_it_and_can_be_run_again(tmp_path, site):
    site.unknown.add("2")
    path = marks(tmp_path)
    ran = send(tmp_path, site, path)
    assert (ran.returncode, ran.stdout) == (1, "s1: stored\ns2: ")
    assert "no user 2" in ran.stderr
    assert list(site.points) == list(site.comments) == ["1"]
    site.unknown.clear()
    assert send(tmp_path, site, path).returncode == 0
    assert list(site.points) == list(site.comments) == ["1", "2", "3"]


def test_a_guide_that_came_meanwhile_is_not_deleted_with_its_fillings(tmp_path, site):
    report = marked("s1", 5.0, 1.0)
    _, path = moodle(tmp_path, "rubric", report, criteria=definitions(tmp_path))
    site.guides = [GUIDE]
    ran = send(tmp_path, site, path)
    assert (ran.returncode, site.saved) == (1, [])
    assert "has 2 fillings of 2 grades" in ran.stdout
    assert "export with --replace-guide" in ran.stderr
    points = tmp_path / "instances.json"
    how = {"criteria": definitions(tmp_path, GUIDE), "replace_guide": points}
    for instances, stored in (([], []), ([FILLED], ["c1: Vector 1"])):
        points.write_text(json.dumps({"instances": instances}))
        _, path = moodle(tmp_path, "rubric", report, **how)
        send(tmp_path, site, path)
        assert site.saved == stored


def test_a_guide_is_made_where_there_is_none(tmp_path, site):
    _, path = moodle(tmp_path, "rubric", marked("s1", 5.0, 1.0), criteria=definitions(tmp_path))
    ran = send(tmp_path, site, path)
    assert (ran.returncode, ran.stdout, site.saved) == (0, "marking guide: stored\n", ["c1: Vector 1"])
