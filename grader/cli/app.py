"""The application: its commands, and what becomes of errors.

Exit status: 0 all done; 1 done, but something needs a person; 2 the call or an authored file is
wrong; 3 a mechanism does not assemble or is singular; 5 a file cannot be written; 130 interrupted.
"""

import sys
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from grader import __version__
from reference.errors import CallError, PlanmarkError

if TYPE_CHECKING:
    from rich.table import Table


def new_table(*headings: str, left: Collection[str] = ()) -> "Table":
    """An empty table: names in the first column and those of `left`, numbers aligned right in the others."""
    from rich.table import Table

    table = Table(headings[0], box=None, header_style="bold")
    for heading in headings[1:]:
        table.add_column(heading, justify="left" if heading in left else "right")
    return table


@contextmanager
def progress() -> Iterator[Callable[[str, int, int], None]]:
    """A progress bar; what it gives is called with a kind of work, how much is done, and of how much."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description:>8}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks: dict[str, TaskID] = {}

        def tell(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=total)
            bar.update(tasks[what], completed=done, total=total)

        yield tell


LONGEST = 500
"""Letters of a command's first sentence in the list of commands: no sentence is cut."""


class Commands(TyperGroup):
    """The group of commands; errors of planmark end in one message and their exit status."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 - click's own signature
        """List every command with the whole of its first sentence."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl([(name, one.get_short_help_str(LONGEST)) for name, one in commands if one])

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401 - click's own signature
        """Run a command, and tell a known error in words instead of a traceback."""
        try:
            return super().invoke(ctx)
        except PlanmarkError as error:
            typer.secho(f"planmark: {error.message}", err=True, fg="red")
            ctx.exit(error.exit_status)
        except KeyboardInterrupt:
            typer.secho("planmark: interrupted; every file that was written is whole", err=True, fg="red")
            ctx.exit(130)


app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    rich_markup_mode=None,  # frames around the help cost more time than all else that --help does
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Marks velocity and acceleration plans of planar mechanisms drawn on A3 sheets.",
)


def _tell_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"planmark {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_tell_version, is_eager=True, help="Tell the version and end."),
    ] = False,
) -> None:
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure:
            reconfigure(encoding="utf-8", errors="replace")


AssignmentArgument = Annotated[
    str, typer.Argument(metavar="ASSIGNMENT", help="A built-in name (pump, press, ...) or a .toml file.")
]
NumberOption = Annotated[
    int | None, typer.Option("--n", help="The student's number, where data depend on it.")
]
PositionOption = Annotated[int | None, typer.Option("--position", help="The position, where there are some.")]
AssignmentOption = Annotated[str, typer.Option("--assignment", help="A built-in name or a .toml file.")]
FolderArgument = Annotated[Path, typer.Argument(help="The folder with what was handed in.")]
OutOption = Annotated[Path, typer.Option("--out", help="The folder for the results.")]
RosterOption = Annotated[Path | None, typer.Option("--roster", help="The class: roster.csv.")]
JobsOption = Annotated[int | None, typer.Option("--jobs", min=1, help="Processes; all processors if absent.")]
LanguageOption = Annotated[str, typer.Option("--lang", help="Language of feedback: en, ro or ru.")]


def check_language(lang: str) -> None:
    """Refuse a language that there is no feedback in."""
    from grader.language import LANGUAGES

    if lang not in LANGUAGES:
        raise CallError("unknown_language", f"--lang {lang}: known are {', '.join(LANGUAGES)}")
