"""The program without processes of its own: it runs in the test, which can watch or replace what it does."""

from contextlib import ExitStack, chdir, contextmanager
from subprocess import CompletedProcess
from unittest.mock import patch

from typer.testing import CliRunner

from grader.cli.commands import app
from grader.folder.workers import guarded
from reference.authored import assignment

STARTING = ("grader.cli.grading", "grader.cli.sheets", "grader.folder.batch", "grader.folder.workers")
"""Modules by whose names workers are started."""


class Inline:
    """Stands in for `grader.folder.workers.Workers` where processes are not what a test is about."""

    def __init__(self, *_arguments):
        """Nothing is limited."""

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        """Nothing to end."""

    end = __exit__

    def run(self, function, calls, sheets=()):
        del sheets
        for index, call in enumerate(calls):
            yield index, guarded(function, *call)


@contextmanager
def without_workers():
    """Nothing that runs meanwhile starts a process of its own for its work."""
    with ExitStack() as changed:
        for module in STARTING:
            changed.enter_context(patch(f"{module}.Workers", Inline))
        yield


def planmark(*arguments, cwd):
    """The status and the texts with which ``planmark ...`` ends in a folder; raises faults of the program."""
    assignment._load.cache_clear()  # it knows by the time of the assignment's file alone what was changed
    words = [str(part) for part in arguments]
    with without_workers(), chdir(cwd), patch("sys.argv", ["planmark", *words]):
        ran = CliRunner(env={"COLUMNS": "120"}).invoke(app, words, prog_name="planmark")
    if not isinstance(ran.exception, SystemExit | None):
        raise ran.exception
    return CompletedProcess(arguments, ran.exit_code, ran.stdout, ran.stderr)
