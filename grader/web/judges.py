"""Processes that judge values while a request waits."""

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from grader.folder.workers import guarded
from grader.records import Reason

MOST_JUDGES = 4
"""Of 110 MB each: 100 values a second and more."""
Result = TypeVar("Result")


class Judges:
    """A pool for short calls without limits: requests that share one interpreter only take turns."""

    def __init__(self, jobs: int) -> None:
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(jobs, context, initializer=end_with_parent)
        for _ in range(jobs):  # each call lets one more process start
            self._pool.submit(int)

    def run(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], sheets: Iterable[int] = ()
    ) -> Iterator[tuple[int, Result | Reason]]:
        """As `grader.folder.workers.Pool.run`; where a process was killed, in this one."""
        del sheets
        for index, call in enumerate(calls):
            try:
                yield index, self._pool.submit(guarded, function, *call).result()
            except BrokenProcessPool:
                yield index, guarded(function, *call)

    def end(self) -> None:
        """End the processes."""
        self._pool.shutdown(cancel_futures=True)


def end_with_parent() -> None:
    """Let this process end with its parent."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    from multiprocessing.connection import wait  # noqa: PLC0415

    wait([sentinel])
    os._exit(1)
