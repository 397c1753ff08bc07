"""Measure the cost of a sheet for client and scheduler: it limits how grading on a cluster scales.

``python -m tests.bench.cluster [--sheets 60] [--seconds 0.5] [--workers 1 2 4]`` starts a scheduler and
workers as the page on clusters says. A call sleeps for a sheet's time and writes as many bytes as a sheet
does, so that the communication is measured and not this machine's processors. Processor times per sheet
give the rates at which client, scheduler and network are saturated.
"""

import argparse
import os
import secrets
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import distributed
import psutil

from grader.files import write_whole
from grader.folder.cluster import Cluster
from grader.folder.workers import Limits

ROOT = Path(__file__).resolve().parents[2]
SHEET_BYTES = 1_200_000
"""Data of one sample sheet: cached scan 650 kB, pages for the student 550 kB."""
NETWORK_BYTES_S = 110e6
"""Gigabit Ethernet, less its headers."""
REAL_SHEET_S = 1.8
"""Time of all stages for one sample sheet, by one process on an otherwise idle machine."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run: workers, sheets, seconds, and processor seconds of client and scheduler."""

    workers: int
    sheets: int
    seconds: float
    client_s: float
    scheduler_s: float


def sheet(out: Path, number: int, seconds: float, size: int) -> int:
    """Stand in for grading a sheet: sleep for its time, and write as many bytes."""
    time.sleep(seconds)
    write_whole(out / f"{number}.bin", secrets.token_bytes(size))
    return number


def _dask(*arguments: str) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(  # noqa: S603 - our own call
        [sys.executable, "-m", "dask", *arguments, "--no-dashboard"],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _measured(workers: int, sheets: int, seconds: float, port: int) -> Run:
    from tests.bench.cluster import sheet  # noqa: PLC0415 - by a name that workers know, not __main__

    address = f"tcp://127.0.0.1:{port}"
    scheduler = _dask("scheduler", "--host", "127.0.0.1", "--port", str(port))
    hands = _dask("worker", address, "--nworkers", str(workers), "--nthreads", "1", "--host", "127.0.0.1")
    try:
        with distributed.Client(address, timeout=120, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=120)
        with tempfile.TemporaryDirectory() as name:
            out = Path(name, "out")
            out.mkdir()
            with Cluster(address, Path(name), out, Limits(seconds=300.0)) as pool:
                # The workers' own processes start before the clock does.
                list(pool.run(sheet, [(out, -1 - number, 0.0, 1) for number in range(4 * workers)]))
                known = psutil.Process(scheduler.pid)
                before = sum(known.cpu_times()[:2])
                start, own = time.monotonic(), time.process_time()
                calls = [(out, number, seconds, SHEET_BYTES) for number in range(sheets)]
                assert len([one for one in pool.run(sheet, calls) if one[0] == one[1]]) == sheets
                return Run(
                    workers,
                    sheets,
                    time.monotonic() - start,
                    time.process_time() - own,
                    sum(known.cpu_times()[:2]) - before,
                )
    finally:
        for process in (hands, scheduler):
            process.terminate()
            process.wait()


def report(runs: Sequence[Run], seconds: float) -> str:
    """The measurements as a table, and the rates at which each part is saturated."""
    lines = ["workers  sheets/min  of perfect  client ms/sheet  scheduler ms/sheet"]
    for run in runs:
        rate = run.sheets / run.seconds
        share = rate * seconds / run.workers
        client, scheduler = run.client_s / run.sheets * 1e3, run.scheduler_s / run.sheets * 1e3
        lines.append(f"{run.workers:7d} {rate * 60:11.0f} {share:11.2f} {client:16.1f} {scheduler:19.1f}")
    sheets = sum(run.sheets for run in runs)
    client, scheduler = (
        sum(run.client_s for run in runs) / sheets,
        sum(run.scheduler_s for run in runs) / sheets,
    )
    # A cached page is also sent to the worker that marks it.
    network = 1.5 * SHEET_BYTES / NETWORK_BYTES_S
    lines.append("full at, sheets/s (and workers that do so many):")
    for name, cost in (("client", client), ("scheduler", scheduler), ("gigabit network", network)):
        lines.append(f"  {name:16} {1 / cost:7.0f}  ({REAL_SHEET_S / cost:5.0f} workers)")
    most = max(client, scheduler, network)
    for count in (3_000, 100_000, 1_000_000):
        hours = [count * max(REAL_SHEET_S / workers, most) / 3600 for workers in (1, 4, 16, 64, 256)]
        lines.append(
            f"{count:9,d} sheets, hours with 1, 4, 16, 64, 256: " + ", ".join(f"{h:.2f}" for h in hours)
        )
    return "\n".join(lines)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sheets", type=int, default=60)
    parser.add_argument("--seconds", type=float, default=0.5)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--port", type=int, default=18790)
    given = parser.parse_args()
    runs = [
        _measured(workers, given.sheets, given.seconds, given.port + number)
        for number, workers in enumerate(given.workers)
    ]
    print(report(runs, given.seconds))


if __name__ == "__main__":
    main()
