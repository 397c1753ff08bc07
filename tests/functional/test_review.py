"""`planmark review` as a command: what it refuses, and how it ends."""

import json
import re
import signal
import socket
import urllib.error
import urllib.request

import pytest

from tests.functional.conftest import start
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
