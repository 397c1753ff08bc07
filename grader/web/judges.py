"""Processes that judge values while a request waits."""

import multiprocessing
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from grader.folder.workers import end_with_parent, guarded
from grader.records import Reason

MOST_JUDGES = 4
"""Processes of 110 MB each: they judge 100 values a second and more."""
MOST_POOLS = 3
"""Pools in which a call is tried when its pool breaks: another call may have killed the process."""
Result = TypeVar("Result")


class Judges:
    """A pool for short calls without limits: requests that share one interpreter only take turns."""

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs
        self._renewing = threading.Lock()
        self._pool = self._started()

    def _started(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(self._jobs, context, initializer=end_with_parent)
        for _ in range(self._jobs):  # each call lets one more process start
            pool.submit(int)
        return pool

    def run(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], sheets: Iterable[int] = ()
    ) -> Iterator[tuple[int, Result | Reason]]:
        """As `grader.folder.workers.Pool.run`."""
        del sheets
        for index, call in enumerate(calls):
            yield index, self._result(function, *call)

    def _result(self, function: Callable[..., Result], *call: object) -> Result | Reason:
        """Return the result of a call; where a process was killed, which breaks the pool, from a new one."""
        for _ in range(MOST_POOLS):
            pool = self._pool
            try:
                return pool.submit(guarded, function, *call).result()
            except BrokenProcessPool:
                with self._renewing:  # one of all that wait
                    if self._pool is pool:
                        pool.shutdown(wait=False)
                        self._pool = self._started()
        return Reason("crashed", {"why": "killed"})

    def end(self) -> None:
        """End the processes."""
        self._pool.shutdown(cancel_futures=True)
