"""The command: what it refuses, and what it says when it serves."""

import socket
from dataclasses import replace

import pytest

from grader.cli import serving
from grader.options import ServeOptions
from grader.web.settings import SECRET
from reference.errors import CallError

CALL = ServeOptions(port=0, jobs=1)


@pytest.fixture
def served(monkeypatch):
    """The applications that would be served: nothing listens longer than the test."""
    apps = []

    def run(app, listener):
        apps.append(app)
        app.state.service.store.close()
        listener.close()

    monkeypatch.setattr(serving, "_run", run)
    return apps


def test_it_says_where_it_serves_and_how_to_begin(served, tmp_path, capsys):
    serving.serve(tmp_path / "data", CALL)
    said = capsys.readouterr().out
    assert "http://127.0.0.1:" in said
    assert "/join?token=" in said
    assert (tmp_path / "data" / "secret").stat().st_mode & 0o077 == 0
    assert len(served) == 1


def test_a_server_for_others_needs_its_name(tmp_path):
    with pytest.raises(CallError, match="--address https://NAME"):
        serving.serve(tmp_path, replace(CALL, host="0.0.0.0"))  # noqa: S104 - what is refused
    for address in ("marks.example.org", "ftp://marks.example.org", "https://marks.example.org/a/b"):
        with pytest.raises(CallError, match="https://NAME"):
            serving.serve(tmp_path, replace(CALL, address=address))


@pytest.mark.usefixtures("served")
def test_passwords_without_https_are_warned_of(tmp_path, capsys):
    serving.serve(tmp_path, replace(CALL, host="0.0.0.0", address="http://marks.example.org"))  # noqa: S104
    assert "unencrypted" in capsys.readouterr().err


def test_a_port_that_is_taken_and_a_short_secret_are_told(tmp_path, monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(CallError, match="--port"):
        serving.serve(tmp_path, replace(CALL, port=taken.getsockname()[1]))
    monkeypatch.setenv(SECRET, "short")
    with pytest.raises(CallError, match="32 characters"):
        serving.serve(tmp_path, CALL)
