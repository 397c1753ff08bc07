"""One call that breaks its process, or its limits, costs nothing but itself."""

import os
import random
import re
import signal
import subprocess
import sys
import time
from multiprocessing import active_children
from pathlib import Path

import psutil
import pytest
from pebble.pool.process import WORKERS_NAME

from grader.folder import workers as workers_module
from grader.folder.workers import Limits, Workers, result_of
from grader.records import Reason
from grader.texts.spoken import in_english
from reference.errors import InputFileError
from tests.examples import slow
from tests.unit.folder import calls
from tests.waiting import PATIENCE_S

LIMITS = Limits(memory_mb=400)
ROOT = Path(__file__).parents[3]
KILLED, CALLS = 0.05, 80
"""Share of the results after which a process is killed, and of how many: each new process takes seconds."""


def codes(jobs, work, limits=LIMITS):
    """Each call's result, or the code of its problem."""
    with Workers(jobs, limits, calls.__name__) as workers:
        results = dict(workers.run(calls.does, work))
    assert sorted(results) == list(range(len(work)))
    return [
        results[index].code if isinstance(results[index], Reason) else results[index]
        for index in range(len(work))
    ]


@pytest.mark.parametrize("jobs", [1, *slow(2)])
def test_what_breaks_a_process_or_a_limit_costs_that_call_alone(jobs):
    broken = {
        "crashes": "crashed",
        "is_killed": "crashed",
        "fills_memory": "too_much_memory",
        "asks_for_too_much": "too_much_memory",
        "is_refused": "image_damaged",
        "has_a_bug": "internal_error",
    }
    work = [pair for name in broken for pair in ((name, 1), ("doubled", 21))]
    assert codes(jobs, work) == [answer for code in broken.values() for answer in (code, 42)]


def test_what_takes_too_long_is_ended_though_it_would_go_on_for_minutes(monkeypatch):
    monkeypatch.setattr(workers_module, "_PATIENCE", 1)
    assert codes(1, [("sleeps", 600), ("doubled", 1)], Limits(seconds=2.0)) == ["too_slow", 2]


def test_processor_time_ends_a_call_and_waiting_for_a_busy_machine_does_not(monkeypatch):
    monkeypatch.setattr(workers_module, "_PATIENCE", 100)
    with Workers(1, Limits(seconds=0.5), calls.__name__) as workers:
        results = dict(workers.run(calls.does, [("sleeps", 1.0), ("spins", 600)]))
    assert results[0] == 1.0
    assert results[1].code == "too_slow"


def test_a_call_of_several_sheets_has_the_time_of_all_of_them(monkeypatch):
    monkeypatch.setattr(workers_module, "_PATIENCE", 1)
    with Workers(1, Limits(seconds=1.0), calls.__name__) as workers:
        assert result_of(workers, calls.sleeps, 1.5, sheets=3) == 1.5
        with pytest.raises(InputFileError) as error:
            result_of(workers, calls.sleeps, 600)
        assert re.search(r"more than 1\ss", in_english(error.value))


def test_a_call_that_ended_its_process_is_tried_once_more(tmp_path):
    path = tmp_path / "tried"
    assert codes(1, [("crashes_once", str(path))]) == ["answered"]


def test_a_call_that_gives_none_has_ended():
    with Workers(1, LIMITS, calls.__name__) as workers:
        assert dict(workers.run(print, [(), ()])) == {0: None, 1: None}


def test_processes_that_cannot_start_end_the_calls_before_any_time_limit():
    with Workers(1, LIMITS, "grader.no_such_room") as workers:
        begun = time.monotonic()
        ((_, result),) = workers.run(print, [()])
    assert result.code == "crashed"
    assert time.monotonic() - begun < workers_module._PATIENCE * LIMITS.seconds


@pytest.mark.slow
def test_processes_killed_at_any_moment_lose_no_call():
    """Also between two calls, and while one is handed over; some results come between two kills."""
    dice, results = random.Random(7), {}
    with Workers(2, LIMITS, calls.__name__) as workers:
        for index, result in workers.run(calls.sleeps, [(0.02,)] * CALLS):
            results[index] = result
            children = [child for child in active_children() if child.name == WORKERS_NAME]
            if children and dice.random() < KILLED:
                time.sleep(dice.uniform(0.0, 0.03))
                dice.choice(children).kill()
    assert sorted(results) == list(range(CALLS))
    assert set(results.values()) == {0.02}


PARENT = """
from grader.folder.workers import Limits, Workers
from tests.unit.folder import calls
if __name__ == "__main__":
    with Workers(2, Limits(), calls.__name__) as workers:
        for index, _ in workers.run(calls.sleeps, [(0.01,), (0.01,), (600,), (600,)]):
            print(index, flush=True)
"""


@pytest.mark.parametrize(
    "sent", [pytest.param(signal.SIGKILL, marks=pytest.mark.slow), signal.SIGTERM, signal.SIGINT]
)
def test_the_processes_end_with_their_parent(tmp_path, sent):
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(  # noqa: S603 - this very Python
        [sys.executable, str(script)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=env
    ) as parent:
        for _ in range(2):
            parent.stdout.readline()
        children = psutil.Process(parent.pid).children(recursive=True)
        assert len(children) >= 2
        parent.send_signal(sent)
        parent.wait(timeout=PATIENCE_S)
    _, alive = psutil.wait_procs(children, timeout=PATIENCE_S)
    assert not alive


def test_the_pool_closes_at_once_though_its_processes_are_busy():
    with Workers(1, Limits(), calls.__name__) as workers:
        result_of(workers, calls.doubled, 1)
        running = workers.run(calls.sleeps, [(0.01,), (600,)])
        assert next(running) == (0, 0.01)
        processes = [psutil.Process(child.pid) for child in active_children() if child.name == WORKERS_NAME]
        assert processes
    _, alive = psutil.wait_procs(processes, timeout=PATIENCE_S)
    assert not alive
