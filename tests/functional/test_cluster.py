"""A class graded on a Dask cluster: as on this machine, with a worker killed, with a folder elsewhere."""

import contextlib
import functools
import http.server
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest

from grader.folder.batch import Batch, grade
from grader.folder.workers import Limits
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment
from reference.errors import CallError
from tests.functional.conftest import ROOT
from tests.waiting import PATIENCE_S

distributed = pytest.importorskip("distributed")
fsspec = pytest.importorskip("fsspec")
cluster = pytest.importorskip("grader.folder.cluster")

pytestmark = pytest.mark.slow
PATIENT = Limits(seconds=300.0)
"""The tests may run beside much else."""


def without_times(value):
    """A document without what the clock said."""
    if isinstance(value, dict):
        return {key: without_times(item) for key, item in value.items() if key != "timing_ms"}
    return [without_times(item) for item in value] if isinstance(value, list) else value


def results_in(out):
    """The results without times, and the page of the class, wherever it was written."""
    page = (out / "index.html").read_text("utf-8").replace(str(out), "OUT")
    return without_times(json.loads((out / "results.json").read_bytes())), page


@pytest.fixture(scope="module")
def handed_in(tmp_path_factory):
    """Two sheets, entered measurements, a broken file, and one that is no plan."""
    folder = tmp_path_factory.mktemp("class")
    for name in ("s01_1.jpg", "s01_2.jpg", "measurements.csv", "s08.json", "roster.csv"):
        shutil.copy(ROOT / "samples" / "pump" / name, folder)
    (folder / "s02.jpg").write_bytes((folder / "s01_1.jpg").read_bytes()[:20_000])
    (folder / "s07.pdf").write_bytes(b"no PDF")
    (folder / "кто.jpg").write_bytes(b"no JPEG")
    return folder


@pytest.fixture(scope="module")
def local(handed_in, tmp_path_factory):
    """The results of a run on this machine."""
    out = tmp_path_factory.mktemp("local")
    grade(batch_of(handed_in, out), lambda *_: None)
    return results_in(out)


def batch_of(folder, out):
    assignment = load_assignment("pump")
    return Batch(assignment, rubric_of(assignment), folder, out, jobs=2, limits=PATIENT)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def dask(*arguments):
    """A process started as the page on clusters says."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    words = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
    return subprocess.Popen(  # noqa: S603 - our own call
        words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


@contextlib.contextmanager
def running(workers):
    """The address of a scheduler with some workers, and its process."""
    where = f"tcp://127.0.0.1:{free_port()}"
    processes = [
        dask("scheduler", "--host", "127.0.0.1", "--port", where.rpartition(":")[2]),
        dask("worker", where, "--nworkers", str(workers), "--nthreads", "1", "--host", "127.0.0.1"),
    ]
    try:
        with distributed.Client(where, timeout=PATIENCE_S, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=PATIENCE_S)
        yield where, processes[0]
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait(timeout=PATIENCE_S)


@pytest.fixture(scope="module")
def address():
    """A scheduler with two workers."""
    with running(2) as (where, _):
        yield where


def test_a_lost_scheduler_is_told_and_what_was_done_is_kept(handed_in, tmp_path):
    with running(1) as (where, scheduler), cluster.Cluster(where, handed_in, tmp_path, PATIENT) as pool:
        results = pool.run(time.sleep, [(0.0,)] * 100)
        assert next(results)[1] is None
        scheduler.kill()
        scheduler.wait(timeout=PATIENCE_S)
        with pytest.raises(CallError, match=r"the scheduler has ended.*finished marks are kept") as caught:
            list(results)
    assert caught.value.code == "cluster_lost"


def test_a_killed_worker_changes_nothing(address, handed_in, local, tmp_path):
    killed = []
    with cluster.Cluster(address, handed_in, tmp_path, PATIENT) as pool:
        workers = list(pool._client.run(os.getpid).values())

        def kill_one(what, done, _):
            if what == "marking" and done and not killed:
                os.kill(workers[0], signal.SIGKILL)
                killed.append(workers[0])

        grade(batch_of(handed_in, tmp_path), kill_one, pool)
    assert killed
    assert results_in(tmp_path) == local
    assert (tmp_path / "s01" / "feedback.html").is_file()
    assert not list(tmp_path.rglob("*.part"))


def test_a_folder_elsewhere(address, handed_in, local, tmp_path, planmark):
    handler = functools.partial(_Quiet, directory=str(handed_in))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        elsewhere = f"http://127.0.0.1:{server.server_address[1]}"
        call = ("grade", elsewhere, "--assignment", "pump", "--out", tmp_path / "out", "--time-limit", "300")
        ran = planmark(*call, "--cluster", address)
        assert ran.returncode == 1, ran.stderr
        assert results_in(tmp_path / "out") == local
        image = tmp_path / "out" / ".planmark" / "handed-in"
        assert not (image / "s01_1.jpg").stat().st_size
        cluster.fill(image)
        assert (image / "s01_1.jpg").read_bytes() == (handed_in / "s01_1.jpg").read_bytes()
        server.shutdown()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def test_a_worker_with_another_program_is_refused(address, handed_in, tmp_path, monkeypatch):
    versions = {**cluster.program(), "planmark": "of long ago"}
    monkeypatch.setattr(cluster, "program", lambda: versions)
    with pytest.raises(CallError, match=r"worker .* planmark [0-9a-f]{12} / of long ago.*install the same"):
        cluster.Cluster(address, handed_in, tmp_path, PATIENT).__enter__()


def test_a_folder_that_workers_do_not_see_is_refused(address, tmp_path):
    fsspec.filesystem("memory").pipe("/unseen/s01.json", b"{}")
    image = cluster.image_of("memory://unseen", tmp_path)
    with pytest.raises(CallError, match=r"worker .* cannot read memory://unseen .* all workers see"):
        cluster.Cluster(address, image, tmp_path, PATIENT, "memory://unseen").__enter__()


def test_no_scheduler(handed_in, tmp_path, planmark):
    call = ("grade", handed_in, "--assignment", "pump", "--out", tmp_path / "out", "--cluster")
    ran = planmark(*call, f"127.0.0.1:{free_port()}")
    assert ran.returncode == 2
    assert "no scheduler answers in 10 s; start one: dask scheduler" in ran.stderr
    ran = planmark(*call, "nonsense")
    assert ran.returncode == 2
    assert "nonsense" in ran.stderr
    ran = planmark("grade", "s3://bucket/class", "--assignment", "pump", "--out", tmp_path / "out")
    assert ran.returncode == 2
    assert "s3://bucket/class: workers of a cluster read a folder elsewhere" in ran.stderr
    assert not (tmp_path / "out" / "results.json").exists()
