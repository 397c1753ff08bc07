"""``planmark review``."""

import logging
import os
import socket
from dataclasses import replace
from pathlib import Path
from typing import Any

import uvicorn

from grader.cli import terminal
from grader.cli.app import progress
from grader.cli.grading import fill_image, tell_class, tell_next_of_class
from grader.cli.terminal import gettext
from grader.folder.batch import noted_batch
from grader.options import ReviewOptions
from grader.review.server import LOOPBACK, application
from grader.review.session import Session
from grader.texts.spoken import failure
from reference.errors import CallError

LEAST_TOKEN = 8
"""Letters of a token: fewer could be tried out."""


def review_class(folder: Path, options: ReviewOptions) -> None:
    """Serve the review of a class until it is ended; then bring the results up to date.

    Raises CallError for a folder of which nothing is known, a host without a token, a port that is taken.
    """
    host, token = options.host, options.token
    if host not in LOOPBACK and not token:
        raise failure(CallError, "token_needed", host=host)
    if token and len(token) < LEAST_TOKEN:
        raise failure(CallError, "token_short", "secret_short", option="--token", least=LEAST_TOKEN)
    batch = replace(noted_batch(folder), jobs=options.jobs or os.cpu_count() or 1)
    lang = terminal.speak(options.lang or batch.lang)
    fill_image(batch.folder)
    listener = listener_on(host, options.port)
    session = Session(batch)
    with progress() as tell:
        session.bring_up_to_date(tell)
    shown = f"[{host}]" if ":" in host else host
    address = f"http://{shown}:{listener.getsockname()[1]}/"
    terminal.say(gettext("Review: %(address)s", address=f"{address}{f'?token={token}' if token else ''}"))
    terminal.say(gettext("Decisions go to %(file)s; Ctrl+C ends the review.", file=batch.decisions_path))
    app = application(session, lang, token)
    answer(app, listener, gettext("The review has ended."), lifespan="off")
    if session.made:
        with progress() as tell:
            results = session.bring_up_to_date(tell).results
        tell_class(results, batch.out)
        tell_next_of_class(results, batch.out)


def listener_on(host: str, port: int) -> socket.socket:
    """A socket that listens; raises CallError for a port that is taken."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, port), family=family)
    except OSError as error:
        known = {"host": host, "port": port, "error": error.strerror or error}
        raise failure(CallError, "port_taken", **known) from error
    # Head and body of an answer are two packets: the second would wait until the first is confirmed.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listener


def answer(app: Any, listener: socket.socket, farewell: str, **settings: Any) -> None:  # noqa: ANN401 - uvicorn's
    """Answer requests until the process is interrupted; then print the farewell."""
    logging.getLogger("uvicorn").setLevel(logging.WARNING)
    config = uvicorn.Config(
        app, log_level="warning", access_log=False, ws="none", timeout_graceful_shutdown=2,
        server_header=False, **settings,
    )  # fmt: skip
    try:
        uvicorn.Server(config).run(sockets=[listener])
    except KeyboardInterrupt:
        terminal.say(farewell)
