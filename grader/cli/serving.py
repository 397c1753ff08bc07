"""``planmark serve``."""

import asyncio
import contextlib
import os
import socket
from collections import Counter
from pathlib import Path
from typing import ClassVar
from urllib.parse import urlsplit

import h11
import typer
from uvicorn.protocols.http.h11_impl import H11Protocol

from grader.cli import terminal
from grader.cli.reviewing import answer, listener_on
from grader.cli.terminal import gettext
from grader.language import N_
from grader.options import ServeOptions
from grader.review.server import LOOPBACK
from grader.texts.spoken import failure
from reference.errors import CallError

HEAD_S = 10.0
"""For the lines before a body: a browser sends them at once."""
MOST_CONNECTIONS = 1000
MOST_OF_ONE = 500
"""Connections of one address: the others always have as many."""
REFUSED_S, MOST_REFUSED = 1.0, 1000
"""A connection too many is closed after this time, while there are not more of them: whoever opens them over
and over would otherwise open the next at once, which costs more than one that waits."""
REFUSED = "refused"
MOST_FILES = 4096
"""Open files of the process, where the system lets it: connections, the data base's and the workers'."""


class Bounded(H11Protocol):
    """HTTP in which the head of a request must come in time, and one address has some connections only."""

    _head: asyncio.TimerHandle | None = None
    _sender = ""
    _open: ClassVar[Counter[str]] = Counter()
    """Connections by address; under `REFUSED` those that are closed soon."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request, unless its sender has too many: then nothing is heard."""
        self._sender = (transport.get_extra_info("peername") or ("",))[0]
        if self._open[self._sender] >= MOST_OF_ONE:
            self._sender = REFUSED
            self.loop.call_later(REFUSED_S if self._open[REFUSED] < MOST_REFUSED else 0.0, transport.abort)
        else:
            super().connection_made(transport)
            self._watch()
        self._open[self._sender] += 1

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        self._open[self._sender] -= 1
        if not self._open[self._sender]:
            del self._open[self._sender]
        if self._sender != REFUSED:
            self._stop_watching()
            super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take a part of a request in."""
        if self._sender != REFUSED:
            super().data_received(data)
            self._watch()

    def _watch(self) -> None:
        if self.conn.their_state is not h11.IDLE:
            self._stop_watching()
        elif self._head is None:
            self._head = self.loop.call_later(HEAD_S, self.transport.abort)

    def _stop_watching(self) -> None:
        if self._head is not None:
            self._head.cancel()
            self._head = None


def serve(data: Path, options: ServeOptions) -> None:
    """Serve the web application until it is ended.

    Raises CallError where the extra is missing, for a port that is taken, a data base that cannot be opened,
    a host that others reach without an address.
    """
    host, address = options.host, options.address
    try:
        from grader.web.app import application, first_invitation
        from grader.web.settings import settings_of
    except ImportError as error:
        raise failure(CallError, "extra_missing", extra="web", error=error) from error
    if address is None and host not in LOOPBACK:
        raise failure(CallError, "address_needed", host=host)
    with listener_on(host, options.port) as listener:
        shown = f"[{host}]" if ":" in host else host
        settings = settings_of(
            data,
            address or f"http://{shown}:{listener.getsockname()[1]}",
            options.database,
            options.mail,
            jobs=options.jobs or os.cpu_count() or 1,
        )
        app = application(settings)
        invitation = first_invitation(settings)
        told = N_("planmark serves %(address)s/ from %(folder)s; Ctrl+C ends it.")
        terminal.say(gettext(told, address=settings.address, folder=data))
        if invitation:
            terminal.say(gettext("next: make your account at %(address)s", address=invitation))
        if urlsplit(settings.address).scheme == "http" and host not in LOOPBACK:
            told = gettext("Passwords travel unencrypted: put it behind a proxy with https.")
            typer.secho(told, fg="yellow", err=True)
        _run(app, listener)


def _run(app: object, listener: socket.socket) -> None:
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource  # not on Windows

        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = MOST_FILES if hard == resource.RLIM_INFINITY else min(MOST_FILES, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, wanted), hard))
    farewell = gettext("The server has ended; queued work continues at the next start.")
    bounds = {"limit_concurrency": MOST_CONNECTIONS, "timeout_keep_alive": 20, "http": Bounded}
    answer(app, listener, farewell, **bounds)
