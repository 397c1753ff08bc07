"""``planmark serve``."""

import logging
import os
import socket
from pathlib import Path
from urllib.parse import urlsplit

import typer
import uvicorn

from grader.cli import terminal
from grader.cli.reviewing import listener_on
from reference.errors import CallError

MISSING = "planmark serve needs its extra: install it with pip install 'planmark[web]'"


def serve(
    data: Path, *, host: str, port: int, address: str | None, database: str | None, jobs: int | None
) -> None:
    """Serve the web application until it is ended.

    Raises CallError where the extra is missing, for a port that is taken, a data base that cannot be opened,
    a host that others reach without an address.
    """
    try:
        from grader.web.app import application, first_invitation
        from grader.web.settings import LOOPBACK, settings_of
    except ImportError as error:
        raise CallError("extra_missing", f"{MISSING} ({error})") from error
    if address is None and host not in LOOPBACK:
        why = "say under which name students reach it: --address https://NAME"
        raise CallError("address_needed", f"--host {host} opens the server to other machines: {why}")
    with listener_on(host, port) as listener:
        shown = f"[{host}]" if ":" in host else host
        settings = settings_of(
            data,
            address or f"http://{shown}:{listener.getsockname()[1]}",
            database,
            jobs=jobs or os.cpu_count() or 1,
        )
        app = application(settings)
        invitation = first_invitation(settings)
        terminal.say(f"planmark serves {settings.address}/ from {data}; Ctrl+C ends it.")
        if invitation:
            terminal.say(f"next: make your account at {invitation}")
        if urlsplit(settings.address).scheme == "http" and host not in LOOPBACK:
            typer.secho(
                "Passwords travel unencrypted: put it behind a proxy with https.", fg="yellow", err=True
            )
        _run(app, listener)


def _run(app: object, listener: socket.socket) -> None:
    logging.getLogger("uvicorn").setLevel(logging.WARNING)
    config = uvicorn.Config(
        app, log_level="warning", access_log=False, ws="none", timeout_graceful_shutdown=2,  # type: ignore[arg-type]
        server_header=False, limit_concurrency=1000, timeout_keep_alive=20,
    )  # fmt: skip
    try:
        uvicorn.Server(config).run(sockets=[listener])
    except KeyboardInterrupt:
        terminal.say("The server has ended; what was queued goes on with the next start.")
