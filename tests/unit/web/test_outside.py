"""Requests of the server itself: to checked addresses alone, with limits, nothing of their answers told."""

import socket
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
import requests

from grader.web import outside
from grader.web.outside import caller, is_outside, why_not_asked
from tests.unit.web.conftest import Browser
from tests.unit.web.platform import CLAIM, ROLE, Platform

PUBLIC = "93.184.215.14"


@pytest.fixture
def leads(monkeypatch):
    """The addresses given by look-ups, one after the other, and the addresses connected to."""
    answers, connected = [], []

    def looked_up(_host, port, **_known):
        found = answers.pop(0) if len(answers) > 1 else answers[0]
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, port)) for address in found]

    def connect(address, *_arguments, **_known):
        connected.append(address[0])
        raise ConnectionRefusedError

    monkeypatch.setattr(outside.socket, "getaddrinfo", looked_up)
    monkeypatch.setattr(outside, "create_connection", connect)
    return answers, connected


@pytest.mark.parametrize("is_local", [True, False])
def test_a_name_that_leads_inside_is_never_connected_to(leads, is_local):
    answers, connected = leads
    for inside in ("10.0.0.5", "127.0.0.1", "169.254.169.254", "::1", "fe80::1%eth0", "fd00::1", "0.0.0.0"):  # noqa: S104
        answers[:] = [[PUBLIC, inside]]
        assert why_not_asked("https://platform.example/jwks", is_local=is_local) == "address_inside"
        with pytest.raises(requests.RequestException):
            caller(is_local=is_local).get("https://platform.example/jwks")
    assert connected == []


@pytest.mark.parametrize(("is_asked_before", "expected"), [(False, [PUBLIC, "8.8.8.8"]), (True, [])])
def test_what_counts_is_where_a_name_leads_for_this_connection(leads, is_asked_before, expected):
    """DNS rebinding: the connection goes to an address that was checked, and to no later one."""
    answers, connected = leads
    answers[:] = [[PUBLIC, "8.8.8.8"], ["127.0.0.1"]]
    if is_asked_before:
        assert why_not_asked("https://platform.example/jwks", is_local=False) is None
    with pytest.raises(requests.RequestException):
        caller(is_local=False).get("https://platform.example/jwks")
    assert connected == expected


def test_http_is_for_the_own_machine_of_a_server_of_the_own_machine(leads):
    answers, connected = leads
    answers[:] = [[PUBLIC]]
    for is_local in (True, False):
        with pytest.raises(requests.RequestException):
            caller(is_local=is_local).get("http://platform.example/items")
    assert why_not_asked("http://127.0.0.1/jwks", is_local=False) == "address_not_https"
    with pytest.raises(requests.RequestException):
        caller(is_local=False).get("http://127.0.0.1/items")
    assert connected == []


@pytest.mark.parametrize(
    ("address", "expected"),
    [
        (PUBLIC, True), ("2606:4700::1111", True), ("64:ff9b::5db8:d70e", True), ("64:ff9b::a00:5", False),
        ("2002:a00:5::1", False), ("2001:0:a00:5::1", False), ("::ffff:10.0.0.5", False), ("ff02::1", False),
        ("100.64.0.1", False), ("239.1.1.1", False), ("255.255.255.255", False), ("::", False),
    ],
)  # fmt: skip
def test_an_address_is_inside_however_it_is_wrapped(address, expected):
    assert is_outside(address) is expected


@pytest.fixture
def foreign():
    """A server that answers with a text of its own, as long as is asked for."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()
            length = int(self.path.strip("/") or 0)
            self.wfile.write(b"secret of the inside" + b"x" * length)

        def log_message(self, *_arguments):
            """Nothing is printed."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


def test_an_answer_without_end_is_not_kept(foreign):
    assert len(caller(is_local=True).get(f"{foreign}/1000").content) == 1020
    with pytest.raises(requests.ConnectionError):
        caller(is_local=True).get(f"{foreign}/{outside.MOST_BYTES}")


@pytest.fixture
def platform():
    made = Platform()
    yield made
    made.stop()


def test_nothing_of_a_foreign_answer_is_told(admin, app, foreign, platform):
    asked = {**platform.registration, "key_set_url": f"{foreign}/0"}
    assert admin.act("POST", "/lti/platforms", json=asked).status_code == 201
    answer = platform.launch(Browser(app), **{f"{CLAIM}roles": [f"{ROLE}Instructor"]})
    assert answer.status_code == 403
    assert "secret" not in answer.text
    assert "keys cannot be fetched" in answer.text


def test_keys_are_fetched_only_for_a_message_that_may_be_right(admin, app, platform, monkeypatch):
    fetched = []
    assert admin.act("POST", "/lti/platforms", json=platform.registration).status_code == 201
    monkeypatch.setattr("grader.web.launch.caller", lambda **_: fetched.append(1) or caller(is_local=True))
    for changed in (
        {"nonce": "x"}, {"aud": "x"}, {"iss": "x"}, {"exp": 5}, {"iat": 5}, {"azp": "x"}, {"sub": None},
        {f"{CLAIM}deployment_id": "x"}, {f"{CLAIM}roles": [1]}, {f"{CLAIM}resource_link": None},
    ):  # fmt: skip
        assert platform.launch(Browser(app), **changed).status_code in {400, 403}
    asked = platform.begun(browser := Browser(app))
    unsigned = {
        "state": asked["state"],
        "id_token": platform.signed(platform.claims(asked), algorithm="none"),
    }
    assert browser.post("/lti/launch", data=unsigned).status_code == 403
    assert fetched == []
    platform.launch(Browser(app))
    assert fetched == [1]
