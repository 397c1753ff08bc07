"""One function over many inputs in worker processes; a crash, a time or memory limit costs one input only."""

import contextlib
import importlib
import logging
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Protocol, Self, TypeVar

import psutil
from pebble import ProcessExpired, ProcessPool
from pebble.pool.process import WORKERS_NAME

from grader.files import CANNOT_WRITE, OutputError, log_to
from grader.records import Reason, as_error, of_error
from grader.texts.spoken import message
from reference.errors import PlanmarkError

Result = TypeVar("Result")
LOG = logging.getLogger("planmark")

ENDED = frozenset({"crashed", "too_slow", "too_much_memory"})
"""Problems for which a call is tried once more, alone: another sheet may have taken time or memory."""
_END_S = 3.0
"""Seconds in which the threads of a pool end; they are daemons, and hold nothing up after that."""
_WATCH_S = 0.05
"""The workers' memory is measured at this interval: a worker fills at most some 100 MB in this time."""
_LOOK_S = 0.5
"""Windows tells an interrupt only between waits: Ctrl+C ends a run within this time."""
_STALLED_S = 30.0
"""Past every time limit without any result: a worker was killed while it took its task, which is lost."""
_AHEAD = 4
"""Tasks of each process that the pool holds: it never waits for one, and thousands are not held at once."""
_ROUNDS = 3
"""Pools started one after the other without a single result: then what is left has the problem `crashed`."""
_PATIENCE = 4
"""Times the limit by the clock: a machine that is busy with other work takes longer, and refuses nobody."""
_KILLED = -9
"""Exit code of a process that somebody else killed: the system for want of memory, or a person."""
_OUT_OF_TIME = -getattr(signal, "SIGPROF", 0) or None
"""Exit code of a process that has used up its processor time; none on Windows."""
_LOST = object()
"""In the place of a result that there is not; None is a result."""
_MEGABYTE = 1_000_000


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits for one file or sheet: seconds of processor time, and megabytes of memory.

    By the clock it may take `_PATIENCE` times as long; so may, where the system measures no other time, all.
    """

    seconds: float = 60.0
    memory_mb: int = 1500


class Pool(Protocol):
    """Something that runs calls."""

    def run(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], sheets: Iterable[int] = ()
    ) -> Iterator[tuple[int, Result | Reason]]:
        """Results as they come, each with its index; a failure is a Reason in the place of its result."""
        ...


def result_of(pool: Pool, function: Callable[..., Result], *call: object, sheets: int = 1) -> Result:
    """Return the result of one call; raises InputFileError for the Reason in its place."""
    ((_, result),) = pool.run(function, [call], [sheets])
    if isinstance(result, Reason):
        raise as_error(result)
    return result


@dataclass(frozen=True, slots=True)
class Whole:
    """A pool in which a file that cannot be written ends the run: that is no fault of what was handed in.

    Raises OutputError from `run`.
    """

    pool: Pool

    def run(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], sheets: Iterable[int] = ()
    ) -> Iterator[tuple[int, Result | Reason]]:
        """As `Pool.run`."""
        for index, result in self.pool.run(function, calls, sheets):
            if isinstance(result, Reason) and result.code == CANNOT_WRITE:
                raise OutputError(result.code, message(result))
            yield index, result


class Workers:
    """Worker processes that end with their parent; to be used in a `with` statement.

    Arguments
    ---------
    jobs : number of processes
    module : imported by each worker before its first task, so that no time limit pays for it
    """

    def __init__(self, jobs: int, limits: Limits, module: str = __name__) -> None:
        self._jobs, self._limits, self._module = jobs, limits, module
        self._pool: ProcessPool | None = None
        self._over_memory: set[int] = set()
        self._closed = threading.Event()
        self._starting = threading.Lock()

    def __enter__(self) -> Self:
        threading.Thread(target=self._watch_memory, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closed.set()
        self._end_pool()

    def run(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], sheets: Iterable[int] = ()
    ) -> Iterator[tuple[int, Result | Reason]]:
        """As `Pool.run`; calls that end their worker are tried once more at the end, one at a time.

        Arguments: `sheets` of each call multiply its time limit; 1 where not given.
        """
        seconds = [self._limits.seconds] * len(calls)
        for index, count in enumerate(sheets):
            seconds[index] *= max(1, count)
        tasks = [(function, *call) for call in calls]
        again: list[int] = []
        for index, result in self._finished(tasks, seconds, range(len(calls))):
            if isinstance(result, Reason) and result.code in ENDED:
                again.append(index)
            else:
                yield index, result
        for index in sorted(again):
            yield from self._finished(tasks, seconds, [index])

    def _finished(
        self, tasks: Sequence[tuple[Any, ...]], seconds: Sequence[float], indices: Iterable[int]
    ) -> Iterator[tuple[int, Any]]:
        """Results of the chosen tasks; what a broken pool or a killed worker left is done by a new pool."""
        left = set(indices)
        rounds = _ROUNDS
        while left and rounds and not self._closed.is_set():
            rounds -= 1
            waiting, futures = deque(sorted(left)), dict[Future[Any], int]()
            longest = _PATIENCE * max(seconds[index] for index in left)
            while waiting or futures:
                self._fill(futures, waiting, tasks, seconds)
                if not futures:
                    break
                ended = self._ended(futures, longest + _STALLED_S)
                if not ended:
                    break
                for future in ended:
                    index = futures.pop(future)
                    result = self._result(future)
                    if result is not _LOST:
                        left.discard(index)
                        rounds = _ROUNDS
                        yield index, result
            if left:
                self._end_pool()
        for index in sorted(left):
            yield index, Reason("crashed", {"why": "killed"})

    def _ended(self, futures: Iterable[Future[Any]], seconds: float) -> set[Future[Any]]:
        """The futures that have ended as soon as there are any; none after so many seconds.

        None, too, of a pool that is broken, since its workers cannot start: it ends no future.
        """
        deadline, pool = time.monotonic() + seconds, self._started_pool()
        while not (ended := wait(futures, _LOOK_S, FIRST_COMPLETED).done):
            if time.monotonic() > deadline or not pool.active:
                break
        return ended

    def _fill(
        self,
        futures: dict[Future[Any], int],
        waiting: deque[int],
        tasks: Sequence[tuple[Any, ...]],
        seconds: Sequence[float],
    ) -> None:
        """Give the pool some of the tasks that wait, unless it is broken: what it has will tell so."""
        pool = self._started_pool()
        with contextlib.suppress(RuntimeError):
            while waiting and len(futures) < self._jobs * _AHEAD:
                limit = seconds[waiting[0]]
                future = pool.schedule(_timed, (limit, *tasks[waiting[0]]), timeout=_PATIENCE * limit)
                futures[future] = waiting.popleft()

    def _result(self, future: "Future[Any]") -> Any:  # noqa: ANN401 - whatever the function returns
        """A finished call's result or Reason; `_LOST` where it was ended from outside, or the pool broke."""
        try:
            return future.result()
        except TimeoutError:
            return self._too_slow()
        except ProcessExpired as error:
            if error.exitcode == _OUT_OF_TIME:
                return self._too_slow()
            if error.pid in self._over_memory:
                return self._too_much_memory()
            if error.exitcode == _KILLED:
                return _LOST
            return Reason("crashed", {"exit": error.exitcode})
        except MemoryError:
            return self._too_much_memory()
        except BrokenProcessPool:
            return _LOST

    def _too_slow(self) -> Reason:
        return Reason("too_slow", {"limit_s": self._limits.seconds})

    def _too_much_memory(self) -> Reason:
        return Reason("too_much_memory", {"limit": self._limits.memory_mb})

    def _started_pool(self) -> ProcessPool:
        with self._starting:
            if self._pool is None:
                context = multiprocessing.get_context("spawn")
                prepared = (self._module, _log_file(), LOG.isEnabledFor(logging.DEBUG))
                self._pool = ProcessPool(self._jobs, initializer=_start, initargs=prepared, context=context)
            return self._pool

    def _end_pool(self) -> None:
        """Kill the workers, whatever they do: a polite end would wait for native code."""
        with self._starting:
            pool, self._pool = self._pool, None
        if pool is not None:
            for worker in _workers():
                worker.kill()
            pool.stop()  # type: ignore[no-untyped-call]
            # Interrupted while it starts, the pool's scheduler may wait for a call that never comes.
            ending = threading.Thread(target=pool.join, daemon=True)
            ending.start()
            ending.join(_END_S)
            for worker in _workers():
                worker.kill()

    def _watch_memory(self) -> None:
        limit = self._limits.memory_mb * _MEGABYTE
        while not self._closed.wait(_WATCH_S):
            for worker in _workers():
                with contextlib.suppress(psutil.NoSuchProcess):
                    if psutil.Process(worker.pid).memory_info().rss > limit:
                        self._over_memory.add(worker.pid or 0)
                        worker.kill()


def _workers() -> list[BaseProcess]:
    """The pool's processes that live."""
    return [child for child in multiprocessing.active_children() if child.name == WORKERS_NAME]


def _log_file() -> Path | None:
    """The file that is logged to."""
    files = (one.baseFilename for one in LOG.handlers if isinstance(one, logging.FileHandler))
    return next(map(Path, files), None)


def _start(module: str, log: Path | None, is_verbose: bool) -> None:
    """Prepare a worker: end with the parent, the same log, one thread for OpenCV, the module imported."""
    if log is not None:
        log_to(log)
    elif is_verbose:
        LOG.addHandler(logging.StreamHandler())
    LOG.setLevel(logging.DEBUG)
    end_with_parent()
    import cv2  # noqa: PLC0415 - only in worker processes

    cv2.setNumThreads(1)
    importlib.import_module(module)


def end_with_parent() -> None:
    """Let this process end with its parent, if it has one."""

    def end() -> None:
        if (parent := multiprocessing.parent_process()) is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=end, daemon=True).start()


def _timed(seconds: float, function: Callable[..., Result], *call: object) -> Result | Reason:
    """As `guarded`, in a process that the system ends after so many seconds of its processor time."""
    if not hasattr(signal, "setitimer"):  # Windows
        return guarded(function, *call)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return guarded(function, *call)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def guarded(function: Callable[..., Result], *call: object) -> Result | Reason:
    """The function's result, or the Reason that stopped it: one bad file never stops the rest."""
    try:
        return function(*call)
    except MemoryError:
        raise
    except PlanmarkError as error:
        return of_error(error)
    except Exception as error:
        LOG.debug("internal_error in %s", function.__name__, exc_info=True)
        return Reason("internal_error", {"error": f"{type(error).__name__}: {error}"})
