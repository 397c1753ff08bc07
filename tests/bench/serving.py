"""Load on `planmark serve`, on loopback: ``python -m tests.bench.serving``.

Measures how long a page takes while 1,200 half heads are sent, 200 students who check values at once, the
memory of the server and its workers at and after 20 photos at once, three times over, and what is left of a
class that is graded and of photos that wait when the server is killed.
"""

import argparse
import asyncio
import multiprocessing
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import psutil

from grader.files import samples_folder
from reference.authored.assignment import Variant, load_assignment
from reference.plan import exact_plan

SAMPLES = samples_folder() / "pump"
PASSWORD = "four words make one"  # noqa: S105 - of a server that lasts a minute
SECONDS_FOR_ALL = 1200.0
"""After which a measurement has failed."""


class Server:
    """`planmark serve` in a process of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.peak_mb = folder, 0.0
        self.start(0)

    def start(self, port: int) -> None:
        """Start, at a port that is free or known."""
        command = [sys.executable, "-u", "-m", "grader", "serve", str(self.folder), "--port", str(port)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)  # noqa: S603 - our own
        assert self.process.stdout is not None
        said = self.process.stdout.readline()
        self.address = str(re.search(r"http://[^/]+", said)[0])  # type: ignore[index]
        if port == 0:
            self.invitation = self.process.stdout.readline().strip().rpartition(" ")[2]
        threading.Thread(target=self._watch, args=(psutil.Process(self.process.pid),), daemon=True).start()

    def _watch(self, server: psutil.Process) -> None:
        while server.is_running():
            total = 0
            for one in _family(server):
                try:
                    total += one.memory_info().rss
                except psutil.Error:
                    continue
            self.peak_mb = max(self.peak_mb, total / 1e6)
            time.sleep(0.1)

    def memory_mb(self) -> list[float]:
        """What the server, and each of its workers, takes now."""
        family = _family(psutil.Process(self.process.pid))
        return [round(one.memory_info().rss / 1e6) for one in family]

    def kill(self) -> None:
        """As by a power cut: the server and its workers."""
        for one in _family(psutil.Process(self.process.pid)):
            one.kill()
        self.process.wait()


def _family(server: psutil.Process) -> list[psutil.Process]:
    try:
        return [server, *server.children(recursive=True)]
    except psutil.Error:
        return []


class Client:
    """A browser, or a program with a token."""

    def __init__(self, session: aiohttp.ClientSession, address: str, token: str = "") -> None:
        self.session, self.address = session, address
        self.headers = {"Authorization": f"Bearer {token}"} if token else {}

    async def open(self, page: str) -> None:
        """Open a page, whose forms are then this browser's."""
        async with self.session.get(self.address + page) as answer:
            found = re.search(r'name="form-token" content="(\w+)"', await answer.text())
        assert found is not None, page
        self.headers = {"X-Planmark-Form": found[1]}

    async def act(self, method: str, path: str, **known: Any) -> Any:
        """What the API answers."""
        url = f"{self.address}/api/v1{path}"
        async with self.session.request(method, url, headers=self.headers, **known) as answer:
            answer.raise_for_status()
            return await answer.json(content_type=None)


def browser() -> aiohttp.ClientSession:
    """A session with cookies of its own."""
    return aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True))


async def prepared(server: Server) -> tuple[str, str]:
    """A token of the first administrator, and an open publication of the pump."""
    async with browser() as session:
        client = Client(session, server.address)
        await client.open("/join")
        who = {"token": server.invitation.partition("token=")[2], "name": "admin", "password": PASSWORD}
        await client.act("POST", "/accounts/join", json=who)
        await client.open("/")
        token = (await client.act("POST", "/tokens?title=bench"))["token"]
        asked = {"assignment": "pump", "is_open": True}
        return token, (await client.act("POST", "/publications", json=asked))["key"]


def cells_of(n: int) -> dict[str, str]:
    """20 values that a student with a number measured."""
    plan = exact_plan(load_assignment("pump"), [Variant(n=n)])
    cells = {}
    for name, real in plan.vectors_si.items():
        scale = plan.scales.kv if name.startswith("v") else plan.scales.ka
        length = float(np.abs(real).item() / np.asarray(scale).item())
        cells[name] = f"{length + 0.3:.1f}".replace(".", ",")
    return dict(list(cells.items())[:20])


async def measured(name: str, count: int, one: Callable[[int], Awaitable[Any]]) -> None:
    """Do something so many times at once, and print how long each took."""
    took: list[float] = []
    failed: list[str] = []

    async def timed(index: int) -> None:
        began = time.perf_counter()
        try:
            await one(index)
        except (aiohttp.ClientError, RuntimeError) as error:
            failed.append(str(error))
        else:
            took.append(time.perf_counter() - began)

    began = time.perf_counter()
    await asyncio.gather(*(timed(index) for index in range(count)))
    whole = time.perf_counter() - began
    p50, p99 = np.percentile(took, [50.0, 99.0])
    print(
        f"{name}: {len(took)} answered, {len(failed)} failed {failed[:1]}, p50 {p50:.2f} s,"
        f" p99 {p99:.2f} s, {len(took) / whole:.1f} a second"
    )


async def checks(server: Server, key: str, students: int) -> None:
    """So many students check values at once; each has opened the page before."""
    numbers = load_assignment("pump").numbers("n") or [0]
    sessions = [browser() for _ in range(students)]
    clients = [Client(session, server.address) for session in sessions]
    await measured("pages opened", students, lambda index: clients[index].open(f"/c/{key}"))
    bodies = [{"n": n, "cells": cells_of(n)} for n in (numbers[i % len(numbers)] for i in range(students))]

    async def one(index: int) -> None:
        await clients[index].act("POST", f"/publications/{key}/checks", json=bodies[index])

    await measured("values checked", students, one)
    await measured("values checked again", students, one)
    for session in sessions:
        await session.close()


HALF_HEADS = 1200
"""Connections of the attack, each opened again as soon as it is closed."""
ATTACKER = "127.0.0.2"
"""Another address than that of the others, who have connections of their own."""


def send_half_heads(port: int) -> None:
    """Attack the server, for ever; in a process of its own."""
    resource.setrlimit(
        resource.RLIMIT_NOFILE, (2 * HALF_HEADS, resource.getrlimit(resource.RLIMIT_NOFILE)[1])
    )

    async def one() -> None:
        while True:
            try:
                reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(ATTACKER, 0))
                writer.write(b"GET / HTTP/1.1\r\nHost: x\r\n")
                await reader.read(100)
                writer.close()
            except OSError:
                await asyncio.sleep(0.01)

    async def all_of_them() -> None:
        await asyncio.gather(*(one() for _ in range(HALF_HEADS)))

    asyncio.run(all_of_them())


async def half_heads(server: Server) -> None:
    """How long a page takes, one after the other, without and with the attack."""
    port = int(server.address.rpartition(":")[2])
    attack = multiprocessing.get_context("spawn").Process(target=send_half_heads, args=(port,), daemon=True)
    async with browser() as session:
        client = Client(session, server.address)
        for name in ("alone", "with half heads"):
            took = []
            until = time.monotonic() + 6.0
            while time.monotonic() < until:
                began = time.perf_counter()
                await client.open("/sign-in")
                took.append(1e3 * (time.perf_counter() - began))
                await asyncio.sleep(0.02)
            cuts = statistics.quantiles(took[5:], n=20)
            mean = statistics.mean(took[5:])
            print(f"a page {name}: mean {mean:.0f} ms, p50 {cuts[9]:.0f} ms, p95 {cuts[18]:.0f} ms")
            if name == "alone":
                attack.start()
                await asyncio.sleep(3.0)  # for the process, and all its connections
    attack.kill()


async def photo_ended(client: Client, job: dict[str, Any]) -> dict[str, Any]:
    """The job of a photo when it has ended."""
    until = time.monotonic() + SECONDS_FOR_ALL
    while job["state"] in {"queued", "running"}:
        if time.monotonic() > until:
            raise RuntimeError("a photo does not end")
        await asyncio.sleep(0.5)
        job = await client.act("GET", f"/photos/{job['key']}")
    return job


async def photos(server: Server, key: str, count: int, picture: bytes) -> None:
    """So many students send a photo at once."""
    sessions = [browser() for _ in range(count)]
    clients = [Client(session, server.address) for session in sessions]
    for client in clients:
        await client.open(f"/c/{key}")
    server.peak_mb = 0.0

    async def one(index: int) -> None:
        job = await clients[index].act("POST", f"/publications/{key}/photos?n=7", data=picture)
        if (await photo_ended(clients[index], job))["state"] != "done":
            raise RuntimeError("a photo failed")

    await measured("photos", count, one)
    await asyncio.sleep(2.0)
    print(f"photos: server and workers took {server.peak_mb:.0f} MB at most, after them {server.memory_mb()}")
    for session in sessions:
        await session.close()


async def killed(server: Server, key: str, token: str, picture: bytes) -> None:
    """Kill the server while a class is graded and photos wait; start it again, and count what is there."""
    async with browser() as session, browser() as other:
        client, student = Client(session, server.address, token), Client(other, server.address)
        sent_in = [f"files/{one}" for one in ("s01_1.jpg", "s02_1.jpg", "s08.json")]
        for name in ("roster/files/roster.csv", *sent_in):
            content = (SAMPLES / name.rpartition("/")[2]).read_bytes()
            await client.act("PUT", f"/publications/{key}/{name}", data=content)
        await student.open(f"/c/{key}")
        path = f"/publications/{key}/photos?n=7"
        sent = [await student.act("POST", path, data=picture) for _ in range(3)]
        job = await client.act("POST", f"/publications/{key}/jobs")
        while job["done"] == 0:
            await asyncio.sleep(0.2)
            job = await client.act("GET", f"/publications/{key}/jobs/{job['key']}")
        print(f"killed: a class at {job['stage']} {job['done']} of {job['total']}, {len(sent)} photos sent")
        server.kill()
        server.start(int(server.address.rpartition(":")[2]))
        states = [(await photo_ended(student, one))["state"] for one in sent]
        while job["state"] in {"queued", "running"}:
            await asyncio.sleep(0.5)
            job = await client.act("GET", f"/publications/{key}/jobs/{job['key']}")
        results = await client.act("GET", f"/publications/{key}/results")
        there = sum(report["status"] != "missing" for report in results["reports"])
        print(f"after the next start: class {job['state']}, {there} of 3 submissions there, photos {states}")


async def main() -> None:
    """Measure all, and print it."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--students", type=int, default=200)
    arguments.add_argument("--photos", type=int, default=20)
    arguments.add_argument("--rounds", type=int, default=3, help="of photos")
    asked = arguments.parse_args()
    picture = (SAMPLES / "s01_1.jpg").read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        server = Server(Path(folder) / "data")
        try:
            token, key = await prepared(server)
            await half_heads(server)
            await checks(server, key, asked.students)
            print(f"memory before photos: {server.memory_mb()} MB")
            for _ in range(asked.rounds):
                await photos(server, key, asked.photos, picture)
            await killed(server, key, token, picture)
        finally:
            server.kill()


if __name__ == "__main__":
    asyncio.run(main())
