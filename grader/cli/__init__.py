"""The command line. Each command's work is imported only when the command runs."""

import gc
import os
import sys
from collections.abc import Sequence

from typer.models import CommandInfo

from grader.cli import commands  # noqa: F401 - registers the commands on the application
from grader.cli.app import app
from grader.cli.terminal import INTERRUPTED, set_encoding

COLLECT_FROM = 150_000
"""New objects before Python searches them for cycles: a short command makes fewer, most of which stay."""


def commands_called(arguments: Sequence[str]) -> list[CommandInfo]:
    """The command that is named first, which needs the options of no other; else all commands."""
    every = app.registered_commands
    return [one for one in every if getattr(one.callback, "__name__", "") in arguments[:1]] or every


def main() -> None:
    """Run ``planmark``; see `grader.cli.app` for exit statuses."""
    gc.set_threshold(COLLECT_FROM)
    # planmark has no plugins of pydantic; a search for them reads the metadata of every installed package.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    set_encoding()
    app.registered_commands = commands_called(sys.argv[1:])
    try:
        app(prog_name="planmark")
    except SystemExit as end:
        if end.code == INTERRUPTED:
            # At once and with this status: Python ends by a signal where exec() was interrupted.
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(INTERRUPTED)
        raise
    finally:
        # Without it Python searches all objects for cycles before it ends: a tenth of a short command's time.
        gc.freeze()
