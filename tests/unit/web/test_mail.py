"""Links to new passwords by e-mail: nothing is told of accounts, and nobody waits for the mail server."""

import queue
import re
import socket
import socketserver
import threading
from dataclasses import replace
from email import message_from_bytes
from email.policy import default

import pytest

from grader.web import mail
from grader.web.settings import MAIL, settings_of
from grader.web.store import Visit
from reference.errors import CallError
from tests.unit.web.conftest import ADDRESS, PASSWORD, Browser
from tests.waiting import PATIENCE_S

NEW = "quite another sentence"
SENDER = "planmark@marks.example"


@pytest.fixture
def letters():
    """The letters sent to a mail server on this machine."""
    found = queue.Queue()

    class Dialogue(socketserver.StreamRequestHandler):
        def handle(self):
            self.wfile.write(b"220 here\r\n")
            for line in self.rfile:
                if line.upper().startswith(b"DATA"):
                    self.wfile.write(b"354 go on\r\n")
                    lines = list(iter(self.rfile.readline, b".\r\n"))
                    found.put(message_from_bytes(b"".join(lines), policy=default))
                self.wfile.write(b"250 ok\r\n")

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Dialogue) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        found.port = server.server_address[1]
        yield found
        server.shutdown()


@pytest.fixture
def settings(settings, letters):
    return replace(settings, mail=f"smtp://127.0.0.1:{letters.port}/{SENDER}")


def asked(browser, email):
    answer = browser.act("POST", "/accounts/forgotten", json={"email": email})
    return answer.status_code, answer.text


@pytest.fixture
def known(colleague):
    """Ion, who has said where a link may be sent."""
    said = {"email": "Ion@example.org", "password": "wrong wrong wrong"}
    assert colleague.act("PUT", "/account/email", json=said).status_code == 403
    assert colleague.act("PUT", "/account/email", json={**said, "password": PASSWORD}).status_code == 200
    return colleague


def test_a_link_by_mail_gives_a_new_password_and_tells_nobody_of_the_account(known, letters, app, service):
    browser = Browser(app)
    assert "/forgotten" in browser.get("/sign-in").text
    assert 'name="email"' in browser.get("/forgotten").text
    assert asked(browser, "nobody@example.org") == asked(browser, "ion@EXAMPLE.org")
    letter = letters.get(timeout=PATIENCE_S)
    assert (letter["To"], letter["From"]) == ("ion@example.org", SENDER)
    assert "Ion" in letter.get_content()
    link = re.search(rf"{re.escape(ADDRESS)}/reset\?token=(\S+)", letter.get_content())
    head = {"Authorization": f"Bearer {link[1]}"}
    assert browser.get("/api/v1/accounts", headers=head).status_code == 401
    said = {"token": link[1], "password": NEW}
    with service.store.session() as session:
        session.query(Visit).filter_by(title="mailed").update({"created": Visit.created - 3700.0})
    assert browser.act("POST", "/accounts/reset", json=said).status_code == 403, "it is good for an hour"
    assert asked(browser, "ion@example.org")[0] == 202
    token = re.search(r"token=(\S+)", letters.get(timeout=PATIENCE_S).get_content())[1]
    assert browser.act("POST", "/accounts/reset", json={**said, "token": token}).status_code == 200
    assert browser.act("POST", "/accounts/reset", json={**said, "token": token}).status_code == 403
    assert known.get("/api/v1/publications").status_code == 401
    assert browser.sign_in("Ion", NEW).status_code == 200
    assert letters.empty(), "nobody's address has had no letter"


@pytest.mark.usefixtures("known")
def test_an_account_is_not_flooded_with_letters(letters, app):
    browser = Browser(app)
    for _ in range(3):
        assert asked(browser, "ion@example.org")[0] == 202
    assert letters.get(timeout=PATIENCE_S)
    assert [asked(browser, "x@example.org")[0] for _ in range(20)][-1] == 429
    assert letters.empty()


def test_a_change_of_the_password_ends_links_that_were_sent(known, letters, app):
    assert asked(Browser(app), "ion@example.org")[0] == 202
    token = re.search(r"token=(\S+)", letters.get(timeout=PATIENCE_S).get_content())[1]
    changed = known.act("PUT", "/account/password", json={"old": PASSWORD, "password": NEW})
    assert changed.status_code == 200
    late = {"token": token, "password": PASSWORD}
    assert Browser(app).act("POST", "/accounts/reset", json=late).status_code == 403


class TestWithoutAnAnswer:
    @pytest.fixture
    def settings(self, settings):
        with socket.create_server(("127.0.0.1", 0)) as silent:
            yield replace(settings, mail=f"smtp://127.0.0.1:{silent.getsockname()[1]}/{SENDER}")

    @pytest.mark.usefixtures("known")
    def test_nobody_waits_for_a_mail_server_that_does_not_answer(self, app, service, monkeypatch):
        monkeypatch.setattr(mail, "TIMEOUT_S", 3600.0)
        assert asked(Browser(app), "ion@example.org")[0] == 202
        for number in range(mail.MOST_WAITING + 5):
            service.mail.put(f"{number}@example.org", "en")
        assert asked(Browser(app), "other@example.org")[0] == 202


@pytest.mark.parametrize(("scheme", "first"), [("smtp", "starttls"), ("smtps", "SMTP_SSL")])
def test_letters_and_passwords_travel_encrypted(settings, monkeypatch, scheme, first):
    done, here = [], threading.get_ident()

    class Client:
        def __init__(self, kind, *_arguments, **known):
            # The server of a test before this one may still be sending.
            self.done = done if threading.get_ident() == here else []
            self.done.append(kind)
            assert known["timeout"] == mail.TIMEOUT_S

        def __enter__(self):
            return self

        def __exit__(self, *_error):
            """Nothing to end."""

        def __getattr__(self, name):
            return lambda *given, **_: self.done.append((name, *given) if name == "login" else name)

    for kind in ("SMTP", "SMTP_SSL"):
        monkeypatch.setattr(
            mail.smtplib, kind, lambda *given, kind=kind, **known: Client(kind, *given, **known)
        )
    made = replace(settings, mail=f"{scheme}://me%40x:p%2Fw@mail.example.org/{SENDER}")
    mail.Mail(made, None)._send(["letter"])
    assert [one for one in done if one != "SMTP"] == [first, ("login", "me@x", "p/w"), "send_message"]


def test_a_mail_server_is_said_as_an_address_and_its_password_is_never_told(tmp_path, monkeypatch):
    good = f"smtps://me:hidden@mail.example.org:465/{SENDER}"
    monkeypatch.setenv(MAIL, good)
    made = settings_of(tmp_path, ADDRESS)
    assert made.mail == good
    assert "hidden" not in repr(made)
    for wrong in (
        "mail.example.org",
        f"http://x/{SENDER}",
        "smtps://me:hidden@x",
        f"smtps://me:hidden@x:y/{SENDER}",
    ):
        with pytest.raises(CallError, match="smtps://USER") as raised:
            settings_of(tmp_path, ADDRESS, mail=wrong)
        assert "hidden" not in str(raised.value)


class TestWithoutAServer:
    @pytest.fixture
    def settings(self, settings):
        return replace(settings, mail="")

    def test_nothing_is_offered(self, admin, visitor):
        assert "/forgotten" not in visitor.get("/sign-in").text
        assert "/account/email" not in admin.get("/account").text
        assert asked(visitor, "ana@example.org")[0] == 404
