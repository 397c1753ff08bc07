"""Mutated files at every door: each is taken or refused with a message, within the limits of a worker.

    python -m tests.fuzz.doors --seconds 60 [--inputs N] [--door DOOR ...] [--seed N]

Inputs that bring about a new answer join the corpus of the run; those that fail are written to
`tests/fuzz/corpus/DOOR`, which every run begins with and the tests replay.
"""

import argparse
import collections
import hashlib
import random
import re
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from grader.folder.changes import earlier
from grader.folder.workers import Limits, Workers
from grader.lms.export import KINDS, TARGETS, draft, read_results
from grader.lms.gradebooks import LAYOUTS
from grader.lms.grades import Options, Person, grades_of
from grader.lms.moodle import fill_worksheet
from grader.records import Reason
from grader.rubric import load_rubric
from grader.scan.decode.pages import count_pages, is_blank, page_of
from grader.scan.register.registration import register
from grader.tables.class_file import read_class_file
from grader.tables.decisions import Decision, DecisionFile, read_table
from grader.tables.measurements import names_of, read_measurements
from grader.tables.roster import read_roster
from grader.tables.scale_text import parse_scale
from grader.texts.spoken import in_english, message
from reference.authored.assignment import load_assignment
from reference.authored.variant_table import DataTable, read_rows
from reference.errors import PlanmarkError
from tests.fuzz.seeds import seeds
from tests.fuzz.shaped import SHAPED, shaped
from tests.unit.lms.classroom import report, results

CORPUS = Path(__file__).parent / "corpus"
DOORS = (
    "pictures", "measurements", "roster", "decisions", "authored", "variants", "settings", "scales",
    "worksheet", "gradebook", "results",
)  # fmt: skip
LIMITS = Limits(seconds=60.0, memory_mb=1500)
SLOW_S = 20.0
"""One input may take this long: a third of a worker's limit, on a busy machine."""
BATCH = {"pictures": 100, "measurements": 400, "roster": 400, "decisions": 400, "authored": 150,
         "variants": 200, "settings": 400, "scales": 2000, "worksheet": 400, "gradebook": 400,
         "results": 200}  # fmt: skip
WELL_FORMED = 2 / 3
"""The share of inputs whose form is kept, where a file has one: what is broken anywhere is refused early."""
MOST_PAGES = 3
NOW = datetime(2026, 11, 22, tzinfo=UTC)
_WORDS = (
    b"", b"0", b"-1", b"1e400", b"nan", b"inf", b"NaN", b"999999999999999999999", b"1_0", b"0x10",
    b"2026-01-01", b"9**9**9", b"\x00", b"\xff\xfe", b"\xd0\x90", b'"', b"{", b"[", b"[[", b"'''", b"\r",
    b"\n", b";", b",", b"=", b"^", b"<<", b">>", b"endobj", b"stream", b"/Length 999999999", b"/Count -1",
    b"/Width 100000",
)  # fmt: skip


@dataclass
class Findings:
    """The results of a batch of inputs: answers with an example of each, and failures."""

    answers: dict[str, bytes] = field(default_factory=dict)
    failures: list[tuple[str, bytes]] = field(default_factory=list)


# The doors ----------------------------------------------------------------------------------------


def enter(door: str, data: bytes) -> str:
    """Hand one file in; a short name of the result. Raises any error that the door does not catch."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / _name(door, data)
        path.write_bytes(data)
        try:
            return _ENTER[door](path)
        except PlanmarkError as error:
            message = in_english(error).replace(folder, "")  # its name is another for every file
            return f"{error.code}: {' '.join(re.findall(r'[a-z]{4,}', message)[:8])}"


def _name(door: str, data: bytes) -> str:
    if door == "authored":
        table = re.search(rb"(?m)^\[?\[?(criterion|driver|crank|link|mechanism|rubric)", data)
        return {b"criterion": "input.rubric.toml", b"mechanism": "input.assignment.toml", b"rubric":
                "input.assignment.toml"}.get(table[1] if table else b"", "input.mechanism.toml")  # fmt: skip
    if door == "measurements":
        return "input.json" if data.lstrip()[:1] in {b"{", b"["} else "input.csv"
    names = {
        "pictures": "input.bin",
        "settings": "planmark.toml",
        "scales": "input.txt",
        "results": "results.json",
    }
    return names.get(door, "input.csv")


def _pictures(path: Path) -> str:
    answers = []
    for number in range(1, min(count_pages(path), MOST_PAGES) + 1):
        try:
            page = page_of(path, number)
        except PlanmarkError as error:
            answers.append(error.code)
            continue
        answers.append("blank" if is_blank(page) else "drawn")
        register(page)
    return " ".join(answers)


_NAMES = names_of(load_assignment("pump"))


def _measurements(path: Path) -> str:
    rows = read_measurements(path, _NAMES)
    return f"{len(rows)} rows, {len({problem.code for row in rows for problem in row.problems})} problems"


def _roster(path: Path) -> str:
    return f"{len(read_roster(path).rows)} rows"


def _decisions(path: Path) -> str:
    file = DecisionFile(path)
    table = read_table(file.path)
    added = Decision("s1", None, "v_A", "full", comment="=1+1")
    file.add(added)
    again = read_table(file.path)
    kept = [row for row in table.rows if row.key != added.key]
    if [row for row in again.rows if row.key != added.key] != kept or added not in again.rows:
        raise AssertionError("a decision was lost or changed when another one was written")
    return f"{len(table.rows)} rows, {len(table.faults)} faults"


def _authored(path: Path) -> str:
    if path.name.endswith(".rubric.toml"):
        load_rubric(path)
        return "a rubric"
    if path.name.endswith(".mechanism.toml"):
        assignment = path.with_name("input.assignment.toml")
        text = (CORPUS.parents[2] / "rubrics" / "pump.assignment.toml").read_text(encoding="utf-8")
        assignment.write_text(
            re.sub(r'mechanism = "[^"]*"', 'mechanism = "input.mechanism.toml"', text), "utf-8"
        )
        path = assignment
    assignment = load_assignment(path)
    variants = assignment.variants()
    return f"{len(variants)} variants of {len(assignment.mechanism(variants[:3]).joints)} joints"


def _variants(path: Path) -> str:
    table = read_rows(DataTable(file=path.name), path.with_name("input.assignment.toml"), 0.001)[0]
    return f"{len(table.rows or ())} rows of {len(table.columns or ())} columns"


def _settings(path: Path) -> str:
    return " ".join(read_class_file(path, TARGETS).keys)


def _scales(path: Path) -> str:
    text = path.read_bytes().decode(errors="replace")
    return " ".join(type(parse_scale(name, text)).__name__ for name in ("kL", "kv", "ka"))


_ANA = Person(name="Popa, Ana", email="ana@example.org", username="ana", platform_id="12", participant=101)
_PEOPLE = {"s1": _ANA}
_GRADES = grades_of(results(report("s1", 7.5)), Options(to="canvas"))


def _worksheet(path: Path) -> str:
    options = Options(to="moodle", people=_PEOPLE)
    filled = fill_worksheet(path.read_bytes(), path.name, _GRADES, options, {"s1": "<p>Right.</p>"}, NOW)
    return f"{len(filled.written)} written, {len(filled.unplaced)} unplaced"


def _gradebook(path: Path) -> str:
    """Fill in a gradebook for each platform, as an instructor would."""
    answers = []
    for to in LAYOUTS:
        item = "Plan 1" if "item" in KINDS[to, "grades"].used else ""
        options = Options(to=to, form=path, people=_PEOPLE, item=item, rescale=True)
        try:
            filled = draft(results(report("s1", 7.5)), options)
        except PlanmarkError as error:
            answers.append(error.code)
        else:
            answers.append(f"{len(filled.written)} written, {len(filled.unplaced)} unplaced")
    return " ".join(answers)


def _results(path: Path) -> str:
    """Read results as the next run does, and export them to every platform."""
    before = earlier(path, "pump")
    read, answers = read_results(path.parent), [str(len(before or ()))]
    for to, what in KINDS:
        try:
            filled = draft(read, Options(to=to, what=what, out=path.parent, people=_PEOPLE, now=NOW))
        except PlanmarkError as error:
            answers.append(error.code)
        else:
            answers.append(str(len(filled.written)))
    return " ".join(answers)


_ENTER = {
    "pictures": _pictures, "measurements": _measurements, "roster": _roster, "authored": _authored,
    "decisions": _decisions, "variants": _variants, "settings": _settings, "scales": _scales,
    "worksheet": _worksheet, "gradebook": _gradebook, "results": _results,
}  # fmt: skip


# Mutation -----------------------------------------------------------------------------------------


def mutated(data: bytes, other: bytes, dice: random.Random) -> bytes:
    """A file changed in one to eight places."""
    changed = bytearray(data)
    for _ in range(dice.choice((1, 1, 1, 2, 3, 5, 8))):
        _change(changed, other, dice)
    return bytes(changed)


def _change(data: bytearray, other: bytes, dice: random.Random) -> None:
    at, size = dice.randrange(len(data) + 1), dice.choice((1, 1, 2, 4, 8, 32, 200))
    match dice.randrange(9):
        case 0:
            if data:
                data[at % len(data)] ^= 1 << dice.randrange(8)
        case 1:
            data[at : at + size] = dice.randbytes(min(size, 8))
        case 2:
            data[at : at + size] = b""
        case 3:
            data[at:at] = data[at : at + size] * dice.choice((1, 2, 50))
        case 4:
            data[at : at + 4] = dice.choice((0, 1, 0x7F, 0xFF, 0x7FFFFFFF, 0xFFFFFFFF, 65535)).to_bytes(
                4, dice.choice(("little", "big"))
            )
        case 5:
            data[at:at] = dice.choice(_WORDS)
        case 6:
            numbers = list(re.finditer(rb"\d+", data[:20000]))
            if numbers:
                data[slice(*dice.choice(numbers).span())] = dice.choice(_WORDS)
        case 7:
            start = dice.randrange(len(other) + 1)
            data[at : at + size] = other[start : start + 8 * size]
        case 8:
            if dice.random() < 0.3:
                del data[at:]


def _inputs(door: str, pool: Sequence[bytes], seed: str, count: int) -> Iterator[bytes]:
    dice = random.Random(f"{door} {seed}")
    for _ in range(count):
        if door in SHAPED and dice.random() < WELL_FORMED:
            yield shaped(dice.choice(pool), dice)
        else:
            yield mutated(dice.choice(pool), dice.choice(pool), dice)


# A run --------------------------------------------------------------------------------------------


def try_batch(door: str, pool: Sequence[bytes], seed: str, count: int) -> Findings:
    """Hand in some mutated files in this process."""
    return try_files(door, list(_inputs(door, pool, seed, count)))


def try_files(door: str, files: Sequence[bytes]) -> Findings:
    """Hand in these files in this process."""
    findings = Findings()
    for data in files:
        start = time.monotonic()
        try:
            answer = enter(door, data)
        except Exception:  # noqa: BLE001 - this is what is looked for
            findings.failures.append((traceback.format_exc(limit=-4), data))
            continue
        findings.answers.setdefault(answer, data)
        seconds = time.monotonic() - start
        if seconds > SLOW_S:
            findings.failures.append((f"took {seconds:.0f} s: {answer}", data))
    return findings


def corpus(door: str) -> list[bytes]:
    """The files found by earlier runs."""
    return [path.read_bytes() for path in sorted((CORPUS / door).glob("*")) if path.is_file()]


def fuzz(
    doors: Sequence[str], seconds: float, inputs: int | None, seed: int, jobs: int
) -> list[tuple[str, str, bytes]]:
    """Failures (door, what, file) of a run over doors, with so many inputs at each."""
    start, tried = time.monotonic(), collections.Counter[str]()
    pools = {door: seeds(door) + corpus(door) for door in doors}
    answers: dict[str, set[str]] = {door: set() for door in doors}
    failures: list[tuple[str, str, bytes]] = []
    with Workers(jobs, LIMITS, __name__) as workers:
        for turn in range(10**6):
            left = [door for door in doors if inputs is None or tried[door] < inputs]
            if time.monotonic() - start > seconds or not left:
                break
            calls = [
                (door, pools[door], f"{seed} {turn} {k}", BATCH[door]) for door in left for k in range(jobs)
            ]
            for index, result in workers.run(try_batch, calls):
                door = calls[index][0]
                tried[door] += BATCH[door]
                whole = isinstance(result, Findings)
                for found in [result] if whole else _singly(workers, calls[index], result):
                    failures += [(door, what, data) for what, data in found.failures]
                    new = found.answers.keys() - answers[door]
                    answers[door] |= new
                    pools[door] += [found.answers[answer] for answer in sorted(new)]
    for door in doors:
        print(f"{door}: {tried[door]} inputs, {len(answers[door])} answers, "
              f"{sum(one == door for one, *_ in failures)} failures")  # fmt: skip
    return failures


def _singly(
    workers: Workers, call: tuple[str, Sequence[bytes], str, int], problem: Reason
) -> Iterator[Findings]:
    """The inputs of a batch that ended its worker, one by one."""
    door, *rest = call
    files = list(_inputs(door, *rest))
    for index, result in workers.run(try_files, [(door, [data]) for data in files]):
        if isinstance(result, Reason):
            yield Findings(failures=[(f"{result.code}: {result.message}", files[index])])
    if problem.code == "internal_error":
        yield Findings(failures=[(message(problem), b"")])


def main() -> int:
    """Fuzz, write what fails into the corpus, and tell; 1 where anything failed."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--inputs", type=int, help="at each door")
    parser.add_argument("--door", nargs="+", choices=DOORS, default=DOORS)
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    print(f"seed {asked.seed}")
    failures = fuzz(asked.door, asked.seconds, asked.inputs, asked.seed, asked.jobs)
    shown = collections.Counter[str]()
    for door, what, data in failures:
        shown[what] += 1
        if shown[what] == 1:
            path = CORPUS / door / hashlib.sha256(data).hexdigest()[:16]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            print(f"\n{path}\n{what}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
