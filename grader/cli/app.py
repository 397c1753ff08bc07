"""The application: its commands, and the handling of errors.

Exit status: 0 all done; 1 done, but something needs a person; 2 the call or an authored file is
wrong; 3 a mechanism does not assemble or is singular; 5 a file cannot be written; 130 interrupted.
"""

import inspect
import shutil
import signal
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import MISSING
from functools import cache, wraps
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_origin, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from grader import __version__
from grader.cli import class_folder, terminal
from grader.language import LANGUAGES, N_
from grader.options import CommonOptions, is_record, offered
from reference.errors import PlanmarkError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def new_table(*headings: str, left: Collection[str] = ()) -> "Table":
    """An empty table: names in the first column and those of `left`, numbers aligned right in the others.

    Headings are told in the language of the call.
    """
    from rich.table import Table

    table = Table(terminal.gettext(headings[0]), box=None, header_style="bold")
    for heading in headings[1:]:
        table.add_column(terminal.gettext(heading), justify="left" if heading in left else "right")
    return table


def show_table(console: "Console", table: "Table") -> None:
    """Print a table as wide as it is: a narrower terminal breaks its lines, and no number is cut."""
    whole = console.measure(table, options=console.options.update(width=WHOLE))
    console.width = max(console.width, whole.maximum)
    console.print(table)


WHOLE = 10_000
"""Columns, more than any table takes."""
STEP_S = 5.0
"""A file or a pipe gets a line of progress at most so often, besides the last one of each kind of work."""


@contextmanager
def progress() -> Iterator[Callable[[str, int, int], None]]:
    """Show progress; what it gives is called with a kind of work, how much is done, and of how much.

    A bar on a terminal, lines in a pipe or a file, nothing with `--quiet`.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn

    console = Console(stderr=True, quiet=terminal.is_quiet())
    if not console.is_terminal or console.is_dumb_terminal:
        yield terminal.StepLines(STEP_S)
        return
    pace = terminal.Pace()
    columns = (
        TextColumn("{task.description:>8}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[pace]}"),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        tasks: dict[str, TaskID] = {}

        def tell(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(terminal.gettext(terminal.WORK[what]), total=total, pace="")
            bar.update(tasks[what], completed=done, total=total, pace=pace(what, done, total))

        yield tell


LONGEST = 500
"""Letters of a command's first sentence in the list of commands: no sentence is cut."""
WIDEST, NARROWEST = 100, 30
"""Columns of the help: longer lines are hard to read, and no word of it is longer than the least."""
UNBROKEN = "\N{NON-BREAKING HYPHEN}"
"""Stands for a hyphen while lines are broken: an option's name stays in one piece."""


class _Help:
    """Help that keeps options in one piece, and descriptions wide in a narrow terminal."""

    def format_help(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 - click's own signature
        """Write the help as click does, with room for descriptions and unbroken options."""
        write_dl, write_text, widest = formatter.write_dl, formatter.write_text, formatter.width // 3

        def write_rows(rows: Collection[tuple[str, str]]) -> None:
            write_dl([(name, text.replace("-", UNBROKEN)) for name, text in rows], col_max=widest)

        formatter.write_dl = write_rows
        formatter.write_text = lambda text: write_text(text.replace("-", UNBROKEN))
        super().format_help(ctx, formatter)  # type: ignore[misc]
        formatter.buffer = [text.replace(UNBROKEN, "-") for text in formatter.buffer]


class Command(_Help, TyperCommand):
    """A command."""


USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]
"""Base of the parser's errors, which typer does not name."""


class Commands(_Help, TyperGroup):
    """The group of commands; errors of planmark end in one message and their exit status."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 - click's own signature
        """List every command with the whole of its first sentence."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl([(name, one.get_short_help_str(LONGEST)) for name, one in commands if one])

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - as above
        """Read the program's own options, and know the language of the call from then on."""
        terminal.speak(class_folder.language_of(args))
        ctx.obj = args
        with self._told(ctx):
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401 - as above
        """Run a command."""
        with self._told(ctx):
            return super().invoke(ctx)

    @contextmanager
    def _told(self, ctx: Any) -> Iterator[None]:  # noqa: ANN401 - as above
        """Tell a known error in words instead of a traceback."""
        try:
            yield
        except USAGE_ERROR as error:
            from grader.cli.usage import told_of

            if not (told := told_of(error, ctx)):
                raise
            self._end(ctx, told, PlanmarkError.exit_status)
        except PlanmarkError as error:
            from grader.texts.spoken import at_terminal  # pydantic and documents: only for an error

            terminal.LOG.debug("%s", error.code, exc_info=error)
            self._end(ctx, at_terminal(error, terminal.speaker()), error.exit_status)
        except KeyboardInterrupt:
            # A second Ctrl+C would only break the end of this one.
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            told = N_("interrupted; every file that was written is whole; run the same command to continue")
            self._end(ctx, terminal.gettext(told), terminal.INTERRUPTED)

    @staticmethod
    def _end(ctx: Any, message: str, status: int) -> None:  # noqa: ANN401 - as above
        typer.secho(f"planmark: {terminal.shown(message)}", err=True, fg="red", color=terminal.color())
        terminal.LOG.debug("exit status %d: %s", status, message)
        ctx.exit(status)


def _assignments() -> list[str]:
    """The built-in names, for a shell that completes them."""
    from reference.authored.assignment import built_in

    return built_in()


def _platforms() -> list[str]:
    """The platforms of exports, for a shell that completes them."""
    from grader.lms.export import TARGETS

    return list(TARGETS)


_COMPLETED = {"lang": lambda: list(LANGUAGES), "to": _platforms}
"""Options whose values a shell completes."""
_KEYWORD = inspect.Parameter.KEYWORD_ONLY


@cache
def _parameters(record: type) -> tuple[inspect.Parameter, ...]:
    """The parameters of a command for the options of a record; what a choice may be, the command checks."""
    types, made = get_type_hints(record), []
    for one, told in offered(record):
        flags = told.flags or (f"--{one.name.replace('_', '-')}",)
        offer = typer.Option(
            *flags, help=told.help, min=told.least, max=told.most, metavar=told.metavar, hidden=told.hidden,
            autocompletion=_COMPLETED.get(one.name),
        )  # fmt: skip
        kind = str if get_origin(types[one.name]) is Literal else types[one.name]
        default = inspect.Parameter.empty if one.default is MISSING else one.default
        made.append(inspect.Parameter(one.name, _KEYWORD, default=default, annotation=Annotated[kind, offer]))
    return tuple(made)


class _Application(typer.Typer):
    """An application in which every command has the common options."""

    def command(  # type: ignore[override]
        self, name: str | None = None
    ) -> Callable[[Callable[..., None]], Callable[..., None]]:
        register = super().command(name, cls=Command)

        def add(function: Callable[..., None]) -> Callable[..., None]:
            own = inspect.signature(function, eval_str=True).parameters
            annotations = {whole: one.annotation for whole, one in own.items()}
            records = {whole: one for whole, one in annotations.items() if is_record(one)}
            mine = {one.name for record in records.values() for one in _parameters(record)}
            common = [one for one in _parameters(CommonOptions) if one.name not in mine]

            @wraps(function)
            def run(context: typer.Context, **values: Any) -> None:  # noqa: ANN401 - the commands' options
                given = {one.name: values.pop(one.name) for one in common}
                lang = given.pop("lang", None) or values.get("lang")
                terminal.set_up(**given)
                terminal.note_call()
                class_folder.tell_used(context)
                code = None if lang is None else terminal.speak(lang)
                values |= {"lang": code} if "lang" in values else {}
                for whole, record in records.items():
                    values[whole] = record(**{one.name: values.pop(one.name) for one, _ in offered(record)})
                start = time.monotonic()
                try:
                    function(**values)
                except (typer.Exit, PlanmarkError):
                    raise
                except Exception:
                    terminal.LOG.debug("a fault of planmark", exc_info=True)
                    raise
                finally:
                    terminal.LOG.debug("ended after %.1f s", time.monotonic() - start)

            every = [_parameters(one.annotation) if name in records else (one,) for name, one in own.items()]
            parameters = [*chain.from_iterable(every), *common]
            first = inspect.signature(run, follow_wrapped=False).parameters["context"]
            first = first.replace(kind=_KEYWORD, annotation=typer.Context)
            parameters = [one.replace(kind=_KEYWORD) for one in parameters]
            run.__signature__ = inspect.Signature([*parameters, first])  # type: ignore[attr-defined]
            run.__annotations__ = {one.name: one.annotation for one in (*parameters, first)}
            register(run)
            return function

        return add


def _width() -> int:
    """Columns of the help: the terminal's, within what can be read."""
    return max(min(shutil.get_terminal_size().columns, WIDEST) - 2, NARROWEST)


app = _Application(
    cls=Commands,
    no_args_is_help=True,
    rich_markup_mode=None,  # frames around the help cost more time than all else that --help does
    context_settings={"help_option_names": ["-h", "--help"], "terminal_width": _width()},
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
        typer.Option("--version", callback=_tell_version, is_eager=True, help="Show the version and exit."),
    ] = False,
) -> None:
    """Options of the program itself."""


AssignmentArgument = Annotated[
    str,
    typer.Argument(
        metavar="ASSIGNMENT",
        help="A built-in name (pump, press, ...) or a .toml file.",
        autocompletion=_assignments,
    ),
]
AssignmentOption = Annotated[
    str,
    typer.Option("--assignment", help="A built-in name or a .toml file.", autocompletion=_assignments),
]
FolderArgument = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER",
        help="The folder with the submissions; the working folder if it has a planmark.toml.",
        default_factory=lambda: None,
        is_eager=True,  # its planmark.toml gives the options that are absent
        callback=class_folder.class_folder,
        show_default=False,
    ),
]
ResultsArgument = Annotated[
    Path,
    typer.Argument(
        metavar="OUT",
        help="The folder that `planmark grade` wrote, or the class's folder; the working folder if it has"
        " a planmark.toml.",
        default_factory=lambda: None,
        is_eager=True,  # as above
        callback=class_folder.class_results,
        show_default=False,
    ),
]
OutOption = Annotated[Path, typer.Option("--out", "-o", help="The folder for the results.")]
RosterOption = Annotated[Path | None, typer.Option("--roster", help="The class: roster.csv.")]
JobsOption = Annotated[
    int | None, typer.Option("--jobs", min=1, help="Number of processes (default: all processors).")
]
