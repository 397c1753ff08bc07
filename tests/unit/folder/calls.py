"""Calls that the tests give to workers."""

import ctypes
import os
import signal
import time
from pathlib import Path

import numpy as np

from grader.folder.lock import only_run
from reference.errors import InputFileError


def doubled(number):
    return 2 * number


def crashes(_):
    ctypes.string_at(0)


def sleeps(seconds):
    time.sleep(seconds)
    return seconds


def spins(seconds):
    """Uses the processor for so long, whatever the clock says."""
    until = time.process_time() + seconds
    while time.process_time() < until:
        pass
    return seconds


def fills_memory(_):
    blocks = []
    while True:
        blocks.append(np.ones(2_000_000))


def asks_for_too_much(_):
    raise MemoryError


def is_killed(_):
    os.kill(os.getpid(), signal.SIGKILL)


def is_refused(name):
    raise InputFileError("image_damaged", f"{name}: the image is damaged")


def has_a_bug(_):
    raise ZeroDivisionError("no such luck")


def crashes_once(path):
    """Dies on its first call, and answers on the second."""
    path = Path(path)
    if path.exists():
        return "answered"
    path.touch()
    os.kill(os.getpid(), signal.SIGKILL)
    return None


def does(name, argument):
    return globals()[name](argument)


def holds(out, folder, ready):
    """Holds a folder of results until it is killed."""
    with only_run(Path(out), Path(folder), "pump"):
        ready.set()
        time.sleep(600)
