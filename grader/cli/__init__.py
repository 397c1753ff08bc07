"""The command line. Each command's work is imported only when the command runs."""

from grader.cli import commands, exporting  # noqa: F401 - they register the commands on the application
from grader.cli.app import app


def main() -> None:
    """Run ``planmark``; see `grader.cli.app` for exit statuses."""
    app()
