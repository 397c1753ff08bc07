"""Calls on the workers of a Dask cluster, which read submissions through fsspec.

A task holds some calls and the files of the cache that they need. A worker carries them out in a process
of its own with the run's limits, in a folder of its own, and sends back the results with the files that
were written there; the client writes them beside the results. No file system need be shared: paths below
the folder of submissions and the folder of results are replaced by the worker's own on the way there and
back. A task whose worker was lost is done by another.
"""

import asyncio
import concurrent.futures
import contextlib
import importlib.metadata
import io
import logging
import multiprocessing
import os
import pickle
import platform
import re
import secrets
import shutil
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from itertools import islice
from pathlib import Path, PurePath, PurePosixPath
from typing import Any, Self, TypeVar
from urllib.parse import quote, unquote

import distributed
import fsspec
from distributed.comm.addressing import get_address_host_port
from fsspec.implementations.local import LocalFileSystem

from grader.files import write_whole
from grader.folder.batch import Job
from grader.folder.cache import MARK_STAGE, PageCache, digest_of, stage_digest
from grader.folder.changes import CACHE_FOLDER
from grader.folder.workers import Limits, Workers
from grader.records import PageRef, Reason
from grader.scan.decode.limits import MAX_FILE_BYTES
from grader.tables.decisions import FILE_NAME as DECISIONS
from grader.texts.spoken import failure, message
from reference.errors import CallError, PlanmarkError

Result = TypeVar("Result")
_Future = Any
"""Dask's, which has no types where it is not installed."""

_LOST = (concurrent.futures.CancelledError, asyncio.CancelledError, distributed.comm.CommClosedError)
"""Errors that Dask raises, by its version and by what it was doing, when its scheduler has ended."""
CONNECT_S = 10.0
"""A scheduler in the same network answers within milliseconds; one behind a slow name service in seconds."""
WAIT_S = 60.0
"""Without any worker for so long, a run ends: a worker that was killed is back within 5 s by its nanny."""
_LOOK_S = 1.0
"""The number of workers is asked for at this interval."""
_AHEAD = 3
"""Tasks at the scheduler for each worker: one is worked on, one has arrived, one is on its way back."""
_TASK_S = 1.0
"""Short calls share a task that takes so long: the scheduler's millisecond is nothing against it."""
_MOST_CALLS = 32
"""In a task: their files are in memory together."""
_RETRIES = 2
"""A storage that does not answer is asked again by so many workers."""
_STORES = 4
"""Runs whose sheets a worker holds: several people may use a cluster at once."""
IMAGE = "handed-in"
"""Below a run's notes: empty files with the names of those that lie elsewhere."""
ADDRESS = "address"
"""Beside it: the address of the folder that it is of."""


# A folder elsewhere -------------------------------------------------------------------------------


def image_of(address: str, out: Path) -> Path:
    """An image of a folder elsewhere: empty files of the same names, and the roster as it is.

    A file's time stands for its content: it is another one when the storage has another file under the
    name. Decisions are copied beside the results, unless there are some. A file that `fill` has copied
    stays while it is the same. Raises CallError for a folder that cannot be read or holds nothing.
    """
    image = out / CACHE_FOLDER / IMAGE
    with _storage(address):
        files, root = fsspec.core.url_to_fs(address)
        entries = (one for one in files.find(root, detail=True).values() if one["type"] == "file")
        listed = ((entry["name"].removeprefix(root).strip("/"), entry) for entry in entries)
        names = {unquote(name) if _is_web(files) else name: entry for name, entry in listed}
        for name, entry in names.items():
            _imagine(_inside(image, name), entry)
        for path in image.rglob("*"):
            if path.is_file() and path.relative_to(image).as_posix() not in names:
                path.unlink()
        write_whole(image.with_name(ADDRESS), address)
        if "roster.csv" in names:
            write_whole(image / "roster.csv", files.cat_file(_address_in(files, root, "roster.csv")))
        if DECISIONS in names and not (out / DECISIONS).exists():
            write_whole(out / DECISIONS, files.cat_file(_address_in(files, root, DECISIONS)))
    if not names:
        raise failure(CallError, "folder_missing", "folder_empty", folder=address)
    return image


def _is_web(files: fsspec.AbstractFileSystem) -> bool:
    """Return whether files are named by web addresses, which have escapes for what is not ASCII."""
    known = files.protocol
    return not {"http", "https"}.isdisjoint([known] if isinstance(known, str) else known)


@contextlib.contextmanager
def _storage(address: str) -> Iterator[None]:
    """Raises CallError for whatever a storage raises."""
    try:
        yield
    except PlanmarkError:
        raise
    except Exception as error:
        why = f"{type(error).__name__}: {error}"
        raise failure(CallError, "storage_unreadable", folder=address, error=why) from error


def _address_in(files: fsspec.AbstractFileSystem, root: str, name: str) -> str:
    """The address of a file by its name in a folder."""
    return f"{root}/{quote(name) if _is_web(files) else name}"


def _inside(folder: Path, name: str) -> Path:
    """A file's path in a folder. Raises CallError for a name that leads out of it."""
    if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts:
        raise failure(CallError, "name_unusable", name=name)
    return folder / name


def _imagine(path: Path, entry: Mapping[str, Any]) -> None:
    """An empty file whose time stands for what the storage says of the file, unless it is there already."""
    known = {key: entry.get(key) for key in ("ETag", "etag", "LastModified", "mtime", "created", "size")}
    says = any(value is not None for key, value in known.items() if key != "size")
    # A time of long ago, or now where the storage does not say when the file has changed.
    time_ns = int(digest_of([known])[:14], 16) if says else time.time_ns()
    if not path.is_file() or path.stat().st_mtime_ns != time_ns:
        write_whole(path, b"")
        os.utime(path, ns=(time_ns, time_ns))


def fill(folder: Path) -> None:
    """Copy what an image lacks, for a review on this machine; nothing for any other folder.

    Raises CallError where the storage cannot be read.
    """
    note = folder.with_name(ADDRESS)
    if folder.name != IMAGE or not note.is_file():
        return
    address = note.read_text(encoding="utf-8")
    with _storage(address):
        files, root = fsspec.core.url_to_fs(address)
        for path in folder.rglob("*"):
            if path.is_file() and not (known := path.stat()).st_size:
                write_whole(
                    path, files.cat_file(_address_in(files, root, path.relative_to(folder).as_posix()))
                )
                os.utime(path, ns=(known.st_mtime_ns, known.st_mtime_ns))


# What both sides know -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Run:
    """The data that all tasks of a run share.

    Attributes
    ----------
    number : no other run has it
    sheets : address of the folder of submissions
    """

    number: str
    sheets: str
    limits: Limits


@dataclass(frozen=True, slots=True)
class Task:
    """Some calls of one function.

    Attributes
    ----------
    calls : function and calls, pickled
    counts : sheets of each call
    files : of the folder of results, by their paths in it
    """

    calls: bytes
    counts: tuple[int, ...]
    files: Mapping[str, bytes]


@cache
def program() -> dict[str, str]:
    """Versions of all that results depend on beside what is handed in, by name."""
    versions = {"Python": platform.python_version().rpartition(".")[0], "planmark": stage_digest(MARK_STAGE)}
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        for line in importlib.metadata.requires("planmark") or ():
            if "extra ==" not in line and (name := re.match(r"[\w.-]+", line)):
                versions[name[0]] = importlib.metadata.version(name[0])
    return versions


class _Pickler(pickle.Pickler):
    """Writes paths below some folders as the folder's name and the rest; collects pages and jobs."""

    def __init__(self, file: io.BytesIO, folders: Mapping[str, Path]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        # The innermost first: one may lie in the other.
        self._folders = sorted(folders.items(), key=lambda item: -len(item[1].parts))
        self.found: list[PageRef | PageCache | Job] = []

    def persistent_id(self, value: object) -> tuple[str, str] | None:
        """Return the folder's name and the rest of a path; None for all else."""
        if isinstance(value, PurePath):
            for name, folder in self._folders:
                if value.is_relative_to(folder):
                    return name, value.relative_to(folder).as_posix()
        elif isinstance(value, PageRef | PageCache | Job):
            self.found.append(value)
        return None


class _Unpickler(pickle.Unpickler):
    """Puts paths below other folders; `names` are those of the folder of submissions."""

    def __init__(self, data: bytes, folders: Mapping[str, Path]) -> None:
        super().__init__(io.BytesIO(data))
        self._folders = folders
        self.names: set[str] = set()

    def persistent_load(self, place: tuple[str, str]) -> Path:
        """The path again."""
        name, rest = place
        if name == "sheets":
            self.names.add(rest)
        return self._folders[name] / rest


def _pickled(value: object, folders: Mapping[str, Path]) -> tuple[bytes, _Pickler]:
    buffer = io.BytesIO()
    pickler = _Pickler(buffer, folders)
    pickler.dump(value)
    return buffer.getvalue(), pickler


# On a worker --------------------------------------------------------------------------------------


@dataclass(slots=True)
class _Hands:
    """The process of a worker that carries out calls; one at a time."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    limits: Limits | None = None
    workers: Workers | None = None

    def of(self, limits: Limits) -> Workers:
        """The process with these limits; to be used with the lock held."""
        if self.workers is None or self.limits != limits:
            if self.workers is not None:
                self.workers.__exit__(None, None, None)
            # Dask starts its workers as daemons, which may have no processes of their own; this one ends
            # by itself when its parent does.
            multiprocessing.current_process().daemon = False
            self.workers = Workers(1, limits, "grader.folder.batch").__enter__()
            self.limits = limits
        return self.workers


_HANDS = _Hands()


class _Store:
    """The files handed in, as a worker sees them: the folder itself, or copies of those that it needs."""

    def __init__(self, address: str, top: str | None) -> None:
        self.files, self._root = fsspec.core.url_to_fs(address)
        copies = tempfile.mkdtemp(prefix="planmark-", dir=top)
        weakref.finalize(self, shutil.rmtree, copies, ignore_errors=True)
        is_local = isinstance(self.files, LocalFileSystem)
        self.folder = Path(self._root) if is_local else Path(copies)
        self._is_local = is_local

    def fetch(self, name: str) -> None:
        """Copy a file that is not there yet; one that the storage has no more is left out.

        Raises OSError where the storage cannot be read.
        """
        path = self.folder / name
        if self._is_local or path.exists():
            return
        source = _address_in(self.files, self._root, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(f".{path.name[:40]}.part")
        with contextlib.suppress(FileNotFoundError):
            size = self.files.size(source) or 0
            if size > MAX_FILE_BYTES:
                # It is refused by its size; nothing of it need come here.
                with part.open("wb") as file:
                    file.truncate(size)
            else:
                self.files.get_file(source, str(part))
            part.replace(path)


@lru_cache(maxsize=_STORES)
def _store(run: Run) -> _Store:
    try:
        top = distributed.get_worker().local_directory
    except ValueError:
        top = None
    return _Store(run.sheets, top)


def probe(run: Run, name: str | None) -> tuple[dict[str, str], str]:
    """A worker's program, and why it cannot read what was handed in; empty where it can.

    Arguments: `name` of a file in the folder, None where there is none.
    """
    try:
        store = _store(run)
        if name is None:
            is_there = store.files.exists(run.sheets)
        else:
            store.fetch(name)
            is_there = os.path.lexists(store.folder / name)
    except Exception as error:  # noqa: BLE001 - a storage raises whatever its library does
        return program(), f"{type(error).__name__}: {error}"
    return program(), "" if is_there else "there is no such folder or file"


def work(run: Run, task: Task, versions: Mapping[str, str]) -> tuple[bytes, dict[str, bytes]] | Reason:
    """The results of a task's calls, pickled, and the files that these wrote, by their paths.

    The Reason is for a worker whose program is another than the client's.
    """
    if versions != program():
        return Reason("cluster_versions", {"detail": _difference(versions, program())})
    with _HANDS.lock, tempfile.TemporaryDirectory(prefix="planmark-") as out:
        store = _store(run)
        folders = {"sheets": store.folder, "out": Path(out)}
        for name, data in task.files.items():
            path = Path(out, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        unpickler = _Unpickler(task.calls, folders)
        function, calls = unpickler.load()
        for name in unpickler.names - {"."}:
            store.fetch(name)
        results = list(_HANDS.of(run.limits).run(function, calls, task.counts))
        written = {
            path.relative_to(out).as_posix(): path.read_bytes()
            for path in Path(out).rglob("*")
            if path.is_file() and path.suffix != ".part"
        }
        changed = {name: data for name, data in written.items() if task.files.get(name) != data}
        return _pickled(results, folders)[0], changed


def _difference(here: Mapping[str, str], there: Mapping[str, str]) -> str:
    """Describe the differences between the client's versions and a worker's."""
    names = sorted(name for name in {*here, *there} if here.get(name) != there.get(name))
    told = [f"{name} {there.get(name, '-')[:12]} / {here.get(name, '-')[:12]}" for name in names]
    return "; ".join(told[:4])


# On the client ------------------------------------------------------------------------------------


class Cluster:
    """A pool whose processes are the workers of a Dask cluster; to be used in a `with` statement.

    Arguments
    ---------
    address : of the scheduler, such as `tcp://127.0.0.1:8786`
    folder : of submissions as the calls' paths have it
    out : the folder of results
    sheets : address of the folder of submissions, where that is no local one

    Raises CallError at the start for a scheduler that does not answer, no worker, a worker with another
    program, and a worker that cannot read the folder.
    """

    def __init__(
        self, address: str, folder: Path, out: Path, limits: Limits, sheets: str | None = None
    ) -> None:
        self._address = address
        self._folders = {"sheets": folder, "out": out}
        self._run = Run(secrets.token_hex(8), sheets or str(folder.absolute()), limits)
        self._versions = program()
        self._client: Any = None
        self._size, self._asked = 1, 0.0

    def __enter__(self) -> Self:
        known = {"address": self._address, "limit": CONNECT_S}
        for name in ("distributed", "distributed.client"):
            # What it logs of a lost scheduler are tracebacks; the run says it in a sentence.
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            get_address_host_port(self._address)
            self._client = distributed.Client(self._address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise failure(CallError, "cluster_unreachable", **known) from error
        try:
            with self._connected():
                self._client.wait_for_workers(1, timeout=CONNECT_S)
                self._check()
        except TimeoutError as error:
            self._client.close()
            raise failure(CallError, "cluster_unreachable", "no_workers", **known) from error
        except BaseException:
            self._client.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def _check(self) -> None:
        """Hold all workers against the client before anything is done."""
        folder = self._folders["sheets"]
        files = (path for path in folder.rglob("*") if path.is_file())
        first = next((path.relative_to(folder).as_posix() for path in files), None)
        answers = self._client.run(probe, self._run, first, on_error="return")
        for worker, answer in sorted(answers.items()):
            if isinstance(answer, BaseException):
                raise failure(CallError, "cluster_versions", "not_installed", worker=worker, error=answer)
            versions, unread = answer
            if versions != self._versions:
                raise self._other_program(worker, _difference(self._versions, versions))
            if unread:
                known = {"worker": worker, "folder": self._run.sheets, "error": unread}
                raise failure(CallError, "cluster_folder", **known)

    @staticmethod
    def _other_program(worker: str, difference: str) -> CallError:
        return failure(CallError, "cluster_versions", worker=worker, versions=difference)

    def run(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], sheets: Iterable[int] = ()
    ) -> Iterator[tuple[int, Result | Reason]]:
        """As `grader.folder.workers.Pool.run`; raises CallError where the cluster is lost on the way."""
        counts = [*sheets, *[1] * len(calls)]
        left = iter(range(len(calls)))
        pending: dict[_Future, list[int]] = {}
        done, started = 0, time.monotonic()

        def submit(indices: list[int]) -> None:
            task = self._task(
                function, [calls[index] for index in indices], [counts[index] for index in indices]
            )
            future = self._client.submit(work, self._run, task, self._versions, pure=False, retries=_RETRIES)
            pending[future] = indices

        try:
            with self._connected():
                while True:
                    workers = self._workers()
                    seconds = (time.monotonic() - started) * workers / done if done else _TASK_S
                    most = max(1, min(_MOST_CALLS, int(_TASK_S / seconds)))
                    while len(pending) < _AHEAD * workers and (chosen := [*islice(left, most)]):
                        submit(chosen)
                    if not pending:
                        return
                    for future in self._ended(pending):
                        indices = pending.pop(future)
                        results = self._results(future)
                        if isinstance(results, Reason) and len(indices) > 1:
                            # One of them did it: each alone.
                            for index in indices:
                                submit([index])
                            continue
                        for number, result in [(0, results)] if isinstance(results, Reason) else results:
                            done += 1
                            yield indices[number], result
        finally:
            with contextlib.suppress(*_LOST, Exception):
                self._client.cancel(list(pending), force=True)

    def _task(self, function: Callable[..., Any], calls: list[tuple[Any, ...]], counts: list[int]) -> Task:
        """The calls with what the cache has of their pages and readings."""
        data, pickler = _pickled((function, calls), self._folders)
        out, found = self._folders["out"], pickler.found
        pages = [one for one in found if isinstance(one, PageRef)]
        paths = {cache.path_of(page) for cache in found if isinstance(cache, PageCache) for page in pages}
        readings = out / CACHE_FOLDER / "readings"
        paths |= {readings / f"{job.name}.reading" for job in found if isinstance(job, Job)}
        files = {path.relative_to(out).as_posix(): path.read_bytes() for path in paths if path.is_file()}
        return Task(data, tuple(counts), files)

    def _results(self, future: _Future) -> list[tuple[int, Any]] | Reason:
        """A task's results, with the files that it wrote in their places; the Reason that it ended with."""
        try:
            answer = future.result()
        except distributed.KilledWorker:
            return Reason("crashed", {"why": "workers_lost"})
        except _LOST:
            raise
        except Exception as error:  # noqa: BLE001 - a storage raises whatever its library does
            return Reason("storage_unreadable", {"error": f"{type(error).__name__}: {error}"})
        finally:
            future.release()
        if isinstance(answer, Reason):
            raise self._other_program("that has come", message(answer))
        data, files = answer
        # A key stands for all of a submission's files: it comes last.
        for name in sorted(files, key=lambda name: (name.endswith(".key"), name)):
            write_whole(_inside(self._folders["out"], name), files[name])
        results: list[tuple[int, Any]] = _Unpickler(data, self._folders).load()
        return results

    def _ended(self, pending: Iterable[_Future]) -> Iterable[_Future]:
        """The tasks that have ended as soon as there are any. Raises CallError where no worker is left."""
        alive = time.monotonic()
        while True:
            with contextlib.suppress(TimeoutError), self._client.as_current():
                ended = distributed.wait(list(pending), timeout=_LOOK_S, return_when="FIRST_COMPLETED")
                return set(ended.done)
            if self._workers():
                alive = time.monotonic()
            elif time.monotonic() - alive > WAIT_S:
                raise self._lost()

    def _workers(self) -> int:
        """Return the present number of workers."""
        if time.monotonic() - self._asked > _LOOK_S:
            with self._connected(OSError, TimeoutError):
                self._size = len(self._client.nthreads())
            self._asked = time.monotonic()
        return self._size

    @contextlib.contextmanager
    def _connected(self, *more: type[Exception]) -> Iterator[None]:
        """Asks the scheduler. Raises CallError where it is there no more, and for `more` errors."""
        try:
            yield
        except (*_LOST, *more) as error:
            raise self._lost() from error

    def _lost(self) -> CallError:
        return failure(CallError, "cluster_lost", address=self._address, limit=WAIT_S)
