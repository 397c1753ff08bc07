"""E-mail: links to new passwords, by the operator's mail server.

A request only lets an address wait here: nobody waits for the mail server, and whether an address is an
account's cannot be seen by the answer or its time.
"""

import contextlib
import logging
import queue
import smtplib
import ssl
import threading
import time
from email.message import EmailMessage
from email.utils import formatdate, make_msgid
from urllib.parse import unquote, urlsplit

from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError

from grader.language import N_, tongue
from grader.review.server import LOOPBACK
from grader.web.guard import MAILED, issued
from grader.web.settings import Settings
from grader.web.store import Account, Store, Visit

LOG = logging.getLogger("planmark")
TIMEOUT_S = 10.0
"""For each answer of the mail server."""
AGAIN_S = 600.0
"""An account is sent one link in this time, however often one is asked for."""
MOST_WAITING = 50
"""Addresses that wait while the mail server is slow; more are not taken."""
SUBJECT = N_("A new password for planmark")
TEXT = N_(
    "Somebody, probably you, has asked for a new password of the account %(name)s at %(address)s. Choose it"
    " within an hour:"
)
UNASKED = N_("If it was not you, do nothing: your password stays as it is.")


class Mail:
    """Sends links, one after the other, in a thread of its own."""

    def __init__(self, settings: Settings, store: Store) -> None:
        self._settings, self._store = settings, store
        self._waiting: queue.Queue[tuple[str, str]] = queue.Queue(MOST_WAITING)

    def start(self) -> None:
        """Begin to send, where there is a mail server."""
        if self._settings.mail:
            threading.Thread(target=self._work, daemon=True).start()

    def put(self, address: str, lang: str) -> None:
        """Let an address wait for a link."""
        with contextlib.suppress(queue.Full):
            self._waiting.put_nowait((address, lang))

    def _work(self) -> None:
        while True:
            try:
                self._send(self._letters(*self._waiting.get()))
            except (OSError, ValueError, smtplib.SMTPException, SQLAlchemyError) as error:
                LOG.warning("a link to a new password was not sent: %s", error)

    def _letters(self, address: str, lang: str) -> list[EmailMessage]:
        """A letter to each account of an address, with the only link that is good from now on."""
        speaker, now, letters = tongue(lang), time.time(), []
        own = select(Account).where(Account.email == address, Account.password != "")
        with self._store.session() as session:
            for account in session.scalars(own):
                sent = select(Visit).where(Visit.account_id == account.id, Visit.title == MAILED)
                before = session.scalars(sent).all()
                if any(now - one.created < AGAIN_S for one in before):
                    continue
                for one in before:
                    session.delete(one)
                token, site = issued(session, account, MAILED), self._settings.address
                self._store.note(session, "planmark", "reset mailed", account.name)
                text = speaker.gettext(TEXT) % {"name": account.name, "address": site}
                letter = EmailMessage()
                letter["From"], letter["To"] = urlsplit(self._settings.mail).path.strip("/"), address
                letter["Subject"], letter["Date"] = speaker.gettext(SUBJECT), formatdate()
                letter["Message-ID"], letter["Auto-Submitted"] = make_msgid(), "auto-generated"
                letter.set_content(f"{text}\n\n{site}/reset?token={token}\n\n{speaker.gettext(UNASKED)}\n")
                letters.append(letter)
        return letters

    def _send(self, letters: list[EmailMessage]) -> None:
        """Send letters, encrypted but to this machine."""
        if not letters:
            return
        server, context = urlsplit(self._settings.mail), ssl.create_default_context()
        host, is_tls = server.hostname or "", server.scheme == "smtps"
        with (
            smtplib.SMTP_SSL(host, server.port or 465, timeout=TIMEOUT_S, context=context)
            if is_tls
            else smtplib.SMTP(host, server.port or 587, timeout=TIMEOUT_S)
        ) as client:
            if not is_tls and host not in LOOPBACK:
                client.starttls(context=context)
            if server.username:
                client.login(unquote(server.username), unquote(server.password or ""))
            for letter in letters:
                client.send_message(letter)
