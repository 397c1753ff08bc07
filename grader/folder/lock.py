"""One run at a time in a folder of results, and one class.

The system releases the lock of a process that ends, however it ends. Who holds it stands in a file beside
it, for the message.
"""

import json
import logging
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from grader.files import make_folder, remove_parts, write_whole
from grader.folder.changes import CACHE_FOLDER, earlier_run
from grader.texts.spoken import failure
from reference.errors import CallError

LOG = logging.getLogger("planmark")
_LOCK, _HOLDER = "run.lock", "running.json"


@contextmanager
def only_run(out: Path, folder: Path, assignment: str) -> Iterator[None]:
    """Hold a folder of results while a run over a folder of submissions writes into it.

    Raises CallError where another run holds it (`results_in_use`), and where it has the results of another
    assignment or of another folder that is still there (`results_of_another`); OutputError where it cannot
    be made.
    """
    from filelock import FileLock, Timeout  # noqa: PLC0415 - slow to import, and only needed here

    notes = out / CACHE_FOLDER
    make_folder(notes)
    lock = FileLock(notes / _LOCK, timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise _in_use(out, notes / _HOLDER) from None
    except (OSError, NotImplementedError) as error:
        why = getattr(error, "strerror", None) or error
        LOG.warning("%s: takes no lock (%s): let no other run write into it meanwhile", out, why)
    try:
        _check_same_class(out, folder, assignment)
        if (notes / _HOLDER).is_file():  # of a run that was killed
            remove_parts(out)
        holder = {"pid": os.getpid(), "host": socket.gethostname(), "folder": str(folder.resolve())}
        began = datetime.now().astimezone().isoformat(timespec="seconds")
        write_whole(notes / _HOLDER, json.dumps({**holder, "began": began}))
        yield
    finally:
        if lock.is_locked:
            (notes / _HOLDER).unlink(missing_ok=True)
            lock.release()


def _in_use(out: Path, holder: Path) -> CallError:
    """Return the error of a second run."""
    try:
        known = json.loads(holder.read_bytes())
        who = {name: known[name] for name in ("pid", "host", "began")}
        return failure(CallError, "results_in_use", folder=out, sheets=known["folder"], **who)
    except (OSError, ValueError, KeyError, TypeError):
        return failure(CallError, "results_in_use", "in_use_unsaid", folder=out)


def _check_same_class(out: Path, folder: Path, assignment: str) -> None:
    """Raise CallError for results of another class: this run would take the place of them."""
    before = earlier_run(out)
    if before is None:
        return
    if before.assignment_id not in {"", assignment}:
        known = {"folder": out, "there": before.assignment_id, "given": assignment}
        raise failure(CallError, "results_of_another", "of_another_assignment", **known)
    # A class that was copied with its results is no other class.
    if before.was_at == before.out and before.folder != folder.resolve() and before.folder.exists():
        known = {"folder": out, "there": before.folder}
        raise failure(CallError, "results_of_another", "of_another_folder", **known)
