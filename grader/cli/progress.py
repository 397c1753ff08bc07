"""What the terminal shows: tables, and a progress bar."""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

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
