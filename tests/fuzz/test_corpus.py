"""Files that once broke a door, or were made to break it, are taken or refused within a worker's limits."""

import inspect
import json
from functools import partial

import pytest

from grader.folder.workers import ENDED, Limits, Workers
from grader.records import Reason
from tests import hostile
from tests.fuzz.doors import DOORS, corpus, try_files
from tests.fuzz.seeds import seeds

LIMITS = Limits(seconds=60.0, memory_mb=1500)


def made_to_break():
    """Files that were made to break a door, by their names, and what makes each."""
    for name, make in inspect.getmembers(hostile, inspect.isfunction):
        whole = all(one.default is not one.empty for one in inspect.signature(make).parameters.values())
        left_out = make in (hostile.paper, *hostile.HEAVY)
        if make.__module__ == hostile.__name__ and whole and not left_out:
            yield "pictures", name, make
    head, row = seeds("measurements")[1].splitlines()[:2]
    wide = b"student_id," + b",".join(b"what_%d" % k for k in range(20_000))
    yield "measurements", "csv of 19.8 MB", lambda: b"\n".join([head, *[row] * (19_800_000 // len(row))])
    yield "measurements", "csv of 20,000 unknown columns", lambda: wide + b"\ns1" + b",1" * 20_000
    yield "measurements", "json that nests deeply", lambda: b'{"values": ' + b"[" * 100_000
    document = json.loads(seeds("measurements")[0])
    for value in (float("nan"), 10**400, "1e400", None, [], {}):
        entered = json.dumps({**document, "segments_mm": {"v_A": value}}).encode()
        yield "measurements", f"a length of {value!r:.10}", partial(bytes, entered)
    pump = next(data for data in seeds("authored") if b'id = "pump"' in data and b"[variant" in data)
    endless = pump.replace(b"to = 30", b"to = 1_000_000_000_000")
    assert endless != pump
    yield "authored", "10^12 variants", lambda: endless
    yield "authored", "a formula of towers", lambda: pump.replace(b"30 + 2*n", b"9**9**9**9")
    yield "variants", "csv of a million columns", lambda: b"n%s\n1%s" % (b",a" * 10**6, b",1" * 10**6)
    yield "settings", "tables in tables", lambda: b"a = " + b"{a = " * 2000
    yield "authored", "tables in tables", lambda: b"a = " + b"{a = " * 2000


FILES = [
    *made_to_break(),
    *((door, f"corpus {k}", partial(bytes, data)) for door in DOORS for k, data in enumerate(corpus(door))),
]


@pytest.fixture(scope="module")
def answers():
    with Workers(1, LIMITS, try_files.__module__) as workers:
        return dict(workers.run(try_files, [(door, [make()]) for door, _, make in FILES]))


@pytest.mark.parametrize("index", range(len(FILES)), ids=[f"{door}: {name}" for door, name, _ in FILES])
def test_no_file_breaks_a_door(answers, index):
    assert not isinstance(answers[index], Reason), answers[index].message
    assert not answers[index].failures, answers[index].failures[0][0]
    assert len(answers[index].answers) == 1


@pytest.mark.slow
def test_a_page_that_takes_too_long_ends_its_worker_and_costs_no_other_file():
    healthy = seeds("pictures")[0]
    files = [healthy, *(make() for make in hostile.HEAVY), healthy]
    with Workers(1, Limits(seconds=1.0, memory_mb=1500), try_files.__module__) as workers:
        answers = dict(workers.run(try_files, [("pictures", [data]) for data in files]))
    for index, make in enumerate(hostile.HEAVY, 1):
        assert isinstance(answers[index], Reason), make.__name__
        assert answers[index].code in ENDED
    for index in (0, len(files) - 1):
        assert not answers[index].failures
