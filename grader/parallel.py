"""One function over many inputs, in several processes; one failure stops nothing."""

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from grader.records import Problem
from reference.errors import PlanmarkError

Result = TypeVar("Result")


def in_parallel(
    function: Callable[..., Result], calls: Sequence[tuple[object, ...]], jobs: int
) -> Iterator[tuple[int, Result | Problem]]:
    """Results as they come, each with its index; a failure is a Problem in the place of its result.

    Where the caller stops (an interrupt, a full disk), what has not begun is not begun.
    """
    if jobs <= 1 or len(calls) <= 1:
        for index, call in enumerate(calls):
            yield index, _guarded(function, *call)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(jobs, len(calls)), mp_context=context, initializer=_one_thread) as pool:
        futures = {pool.submit(_guarded, function, *call): index for index, call in enumerate(calls)}
        try:
            for future in as_completed(futures):
                yield futures[future], _outcome(future)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _outcome(future: Future[Result | Problem]) -> Result | Problem:
    try:
        return future.result()
    except BrokenProcessPool:
        told = "the process that worked on it was ended by the system, most likely for want of memory"
        return Problem("process_ended", f"{told}; grade again with fewer --jobs")


def _guarded(function: Callable[..., Result], *call: object) -> Result | Problem:
    """The function's result, or the Problem that stopped it: one bad file never stops the rest."""
    try:
        return function(*call)
    except PlanmarkError as error:
        return Problem(error.code, error.message)
    except Exception as error:  # noqa: BLE001 - whatever a hostile file brings about stays with that file
        return Problem("internal_error", f"could not be processed ({type(error).__name__}: {error})")


def _one_thread() -> None:
    """The processes share the machine: OpenCV must not start threads of its own in each."""
    import cv2  # noqa: PLC0415 - only in worker processes

    cv2.setNumThreads(1)
