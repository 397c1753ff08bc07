"""Connections: the head of a request comes in time, and one address does not take all of them."""

import socket
import threading

import pytest
import uvicorn

from grader.cli import serving
from grader.cli.reviewing import listener_on
from tests.waiting import PATIENCE_S, until

ANSWER = [(b"content-length", b"2")]


async def application(_scope, receive, send):
    await receive()
    await send({"type": "http.response.start", "status": 200, "headers": ANSWER})
    await send({"type": "http.response.body", "body": b"ok"})


@pytest.fixture
def server():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        config = uvicorn.Config(
            application, log_level="error", lifespan="off", ws="none", http=serving.Bounded
        )
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        until(lambda: server.started)
        server.port = listener.getsockname()[1]
        yield server
        server.should_exit = True
        thread.join()


def opened(server, text):
    connection = socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S)
    connection.sendall(text)
    return connection


def is_closed(connection):
    """Wait for the server to close a connection; return whether it does."""
    try:
        return connection.recv(1000) == b""
    except ConnectionError:
        return True


def answered(connection):
    connection.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
    text = b""
    while not text.endswith(b"ok"):
        text += connection.recv(1000)
    return text.startswith(b"HTTP/1.1 200")


@pytest.mark.parametrize("head", [b"", b"GET / HTTP/1.1\r\nHost: x\r\n"])
def test_half_a_head_is_waited_for_no_longer(server, monkeypatch, head):
    monkeypatch.setattr(serving, "HEAD_S", 0.1)
    with opened(server, head) as first:
        assert is_closed(first)


def test_half_a_head_after_a_request_is_waited_for_no_longer(server, monkeypatch):
    with opened(server, b"") as connection:
        assert answered(connection)
        monkeypatch.setattr(serving, "HEAD_S", 0.1)
        connection.sendall(b"GET / HT")
        assert is_closed(connection)


def test_nothing_is_waited_for_once_a_head_is_there(server):
    with opened(server, b"") as connection:
        assert answered(connection)
        (protocol,) = server.server_state.connections
        assert protocol._head is None


def test_one_address_has_some_connections_only(server, monkeypatch):
    for name, value in (("MOST_OF_ONE", 2), ("REFUSED_S", 0.1), ("HEAD_S", PATIENCE_S)):
        monkeypatch.setattr(serving, name, value)
    waiting = [opened(server, b"GET") for _ in range(2)]
    with opened(server, b"") as third:
        assert is_closed(third)
    for one in waiting:
        one.sendall(b" / HTTP/1.1\r\nHost: x\r\n\r\n")
        assert one.recv(1000).startswith(b"HTTP/1.1 200")
        one.close()


def test_a_connection_too_many_waits_for_its_end_and_the_next_one_does_not(server, monkeypatch):
    """Whoever opens one after the other is slowed down, and the files that stay open have a bound."""
    known = {"MOST_OF_ONE": 1, "REFUSED_S": PATIENCE_S, "MOST_REFUSED": 1, "HEAD_S": PATIENCE_S}
    for name, value in known.items():
        monkeypatch.setattr(serving, name, value)
    with opened(server, b"GET"), opened(server, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n") as second:
        with opened(server, b"") as third:
            assert is_closed(third)
        second.settimeout(0.2)
        with pytest.raises(TimeoutError):
            second.recv(1000)
        assert len(server.server_state.connections) == 1


def test_an_answer_does_not_wait_for_the_browser_to_confirm_its_head():
    with (
        listener_on("127.0.0.1", 0) as listener,
        socket.create_connection(listener.getsockname()),
    ):
        accepted, _ = listener.accept()
        with accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
