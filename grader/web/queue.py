"""Jobs that take longer than a request: a class is graded, a photo is checked.

A job is a row of the data base and files; what was queued or running when the server ended begins again
with the next start, and a class goes on where it was. A class is graded in a process of its own, which a
person may cancel; photos are checked in workers with limits of time and memory. Classes take turns: of each
one photo after the other is checked, and one that is graded for long lets those that wait go first.
"""

import logging
import multiprocessing
import os
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any, TypeVar

from sqlalchemy import select, update

from grader.folder.batch import Batch, grade
from grader.folder.workers import Workers, end_with_parent, guarded, result_of
from grader.records import Reason, as_error
from grader.review.session import moves
from grader.texts.spoken import failure, in_english
from grader.web.places import batch_of, places_of
from grader.web.settings import Settings
from grader.web.store import UNFINISHED, Job, Store
from reference.errors import PlanmarkError

LOG = logging.getLogger("planmark")
_TELL_S = 0.5
"""Progress is written at this interval: a person cannot read faster."""
TURN_S = 120.0
"""A class is graded for so long where others wait; the next time twice, then three times as long."""
MOST_JUDGES = 4
"""Processes of 110 MB each: they judge 100 values a second and more."""
MOST_POOLS = 3
"""Pools in which a call is tried when its pool breaks: another call may have killed the process."""
Result = TypeVar("Result")
Photo = Callable[..., dict[str, Any]]
"""Checks a photo: its path, the assignment, n, position, language and level."""


class Turns:
    """Jobs that wait, of one kind: one of each class comes in turn."""

    def __init__(self) -> None:
        self._waiting: dict[int, deque[int]] = {}
        self._changed = threading.Condition()
        self._has_ended = False

    def put(self, job: Job) -> None:
        """Let a job wait behind those of its class."""
        with self._changed:
            self._waiting.setdefault(job.publication_id, deque()).append(job.id)
            self._changed.notify()

    def get(self) -> int | None:
        """Return the id of the next job as soon as there is one; None at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._has_ended)
            if self._has_ended:
                return None
            publication, jobs = next(iter(self._waiting.items()))
            del self._waiting[publication]
            job = jobs.popleft()
            if jobs:
                self._waiting[publication] = jobs
            return job

    def before(self, job: Job) -> int:
        """Return the number of jobs that come first; 0 for one that does not wait."""
        with self._changed:
            own, classes = self._waiting.get(job.publication_id, deque()), list(self._waiting)
            if job.id not in own:
                return 0
            place, first = own.index(job.id), classes.index(job.publication_id)
            others = (
                min(len(self._waiting[one]), place + (index < first))
                for index, one in enumerate(classes)
                if index != first
            )
            return place + sum(others)

    def is_empty(self) -> bool:
        """Return whether nothing waits."""
        return not self._waiting

    def end(self) -> None:
        """Let `get` return None from now on."""
        with self._changed:
            self._has_ended = True
            self._changed.notify_all()


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


@dataclass(slots=True)
class Queue:
    """The jobs of a server.

    Arguments: `photo` is the function that checks a photo, in a worker process.
    """

    settings: Settings
    store: Store
    photo: Photo
    _classes: Turns = field(default_factory=Turns)
    _photos: Turns = field(default_factory=Turns)
    _turns: Counter[int] = field(default_factory=Counter)
    """Number of times that each class has let others go first."""
    _threads: list[threading.Thread] = field(default_factory=list)
    _workers: Workers | None = None
    judges: Judges = field(init=False)
    """Processes that judge values while a request waits."""
    _running: dict[int, SpawnProcess] = field(default_factory=dict)

    def start(self) -> None:
        """Begin to work, first at what an earlier server left."""
        self.judges = Judges(min(os.cpu_count() or 1, MOST_JUDGES))
        self._workers = Workers(self.settings.photos, self.settings.limits, __name__).__enter__()
        with self.store.session() as session:
            left = session.scalars(select(Job).where(Job.state.in_(UNFINISHED)).order_by(Job.id)).all()
            session.execute(update(Job).where(Job.state == "running").values(state="queued"))
        for job in left:
            self.put(job)
        self._threads = [
            threading.Thread(target=self._work, args=(jobs,), daemon=True)
            for jobs in (self._classes, *[self._photos] * self.settings.photos)
        ]
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """End all work at once; what was running begins again with the next start."""
        workers, self._workers = self._workers, None
        running = list(self._running.values())
        for process in running:
            process.terminate()
        self._classes.end()
        self._photos.end()
        for process in running:
            process.join()
        if workers is not None:
            workers.__exit__(None, None, None)
            self.judges.end()
        for thread in self._threads:
            thread.join()

    @property
    def workers(self) -> Workers:
        """Processes with limits, for whatever must not run in the server itself."""
        if self._workers is None:
            raise _StoppedError
        return self._workers

    def put(self, job: Job) -> None:
        """Queue a job that is committed."""
        self._of_kind(job).put(job)

    def _of_kind(self, job: Job) -> Turns:
        return self._classes if job.kind == "grade" else self._photos

    def cancel(self, job_id: int) -> None:
        """End a job, wherever it is; what was marked is kept."""
        self.store.change_job(job_id, UNFINISHED, state="cancelled", ended=time.time())
        process = self._running.get(job_id)
        if process is not None:
            process.terminate()

    def waiting_before(self, job: Job) -> int:
        """Return the number of jobs of its kind that come first."""
        return self._of_kind(job).before(job)

    # Work -----------------------------------------------------------------------------------------

    def _work(self, jobs: Turns) -> None:
        while (job_id := jobs.get()) is not None:
            if not self.store.change_job(job_id, {"queued"}, state="running", started=time.time()):
                continue
            with self.store.session() as session:
                job = session.get_one(Job, job_id)
            try:
                self._end(job, "done", self._grade(job) if job.kind == "grade" else self._check(job))
            except _StoppedError:
                continue
            except _TurnOverError:
                self._again(job)
            except PlanmarkError as error:
                shown = self.settings.without_folder
                known = {
                    name: shown(one) if isinstance(one, str) else one
                    for name, one in error.parameters.items()
                }
                self._end(job, "failed", {"code": error.code, "parameters": known}, in_english(error))
            except Exception as error:
                LOG.exception("job %d", job_id)
                self._end(job, "failed", {"code": "internal_error"}, f"a fault of planmark ({error})")

    def _end(self, job: Job, state: str, result: dict[str, Any], message: str = "") -> None:
        message = self.settings.without_folder(message)
        known = {"result": result, "message": message, "ended": time.time()}
        self.store.change_job(job.id, {"running"}, state=state, **known)

    def _again(self, job: Job) -> None:
        """Let a class that others wait for wait behind them, unless it was cancelled."""
        self._turns[job.id] += 1
        if self.store.change_job(job.id, {"running"}, state="queued"):
            self.put(job)

    def _check(self, job: Job) -> dict[str, Any]:
        """Check a photo, and delete it."""
        path = places_of(self.settings.data, job.publication).photos / job.asked["file"]
        try:
            return result_of(self.workers, self.photo, path, job.asked)
        except PlanmarkError:
            if self._workers is None:
                raise _StoppedError from None
            raise
        finally:
            if self._workers is not None:
                path.unlink(missing_ok=True)

    def _grade(self, job: Job) -> dict[str, Any]:
        """Grade a class in a process of its own."""
        batch = batch_of(self.settings.data, job.publication, self.settings.jobs)
        context = multiprocessing.get_context("spawn")
        mine, theirs = context.Pipe(duplex=False)
        process = context.Process(target=_graded, args=(batch, theirs))
        process.start()
        theirs.close()
        self._running[job.id] = process
        try:
            return self._followed(job, mine)
        except _TurnOverError:
            process.terminate()
            raise
        finally:
            del self._running[job.id]
            process.join()

    def _followed(self, job: Job, reports: Connection) -> dict[str, Any]:
        """Follow the reports of a process that grades until its end; return the last one."""
        told, began = 0.0, time.monotonic()
        while True:
            try:
                said = reports.recv()
            except EOFError:
                with self.store.session() as session:
                    state = session.get_one(Job, job.id).state
                if state != "running" or self._workers is None:
                    raise _StoppedError from None
                raise failure(PlanmarkError, "crashed", "process_ended") from None
            match said:
                case ("progress", stage, done, total):
                    turn_s = TURN_S * (1 + self._turns[job.id])
                    if time.monotonic() - began > turn_s and not self._classes.is_empty():
                        raise _TurnOverError
                    if time.monotonic() - told > _TELL_S or done == total:
                        told = time.monotonic()
                        self.store.change_job(job.id, {"running"}, stage=stage, done=done, total=total)
                case ("moved", about, before, after):
                    self.store.note_mark(job.publication.key, job.asked.get("by", ""), about, before, after)
                case ("done", result):
                    return result  # type: ignore[no-any-return]
                case ("failed", Reason() as problem):
                    raise as_error(problem)


class _StoppedError(Exception):
    """The job was cancelled, or the server ends."""


class _TurnOverError(Exception):
    """Another class waits, and this one was graded for long."""


def _graded(batch: Batch, reports: Connection) -> None:
    """Grade in a process of its own, which ends with its parent."""
    end_with_parent()

    def tell(stage: str, done: int, total: int) -> None:
        reports.send(("progress", stage, done, total))

    results = guarded(grade, batch, tell)
    if isinstance(results, Reason):
        reports.send(("failed", results))
        return
    for move in moves(results):
        reports.send(("moved", *move))
    states = [report.status for report in results.reports]
    counts = {state: states.count(state) for state in dict.fromkeys(states)}
    reports.send(("done", {"states": counts, "unmatched": len(results.unmatched)}))
