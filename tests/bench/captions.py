"""What is read of captions and title blocks: a class on plain paper with a roster of names alone.

    python -m tests.bench.captions [--seed S] [--scenes pump,press,engine] [--students 12,6,2]

The roster has the students' names, those of as many others, and nothing else: the number of the variant
and the scales can only come from what stands on the sheets. Counted is what was used and what was told;
and names, as they are read where a file's name does not say whose it is.
"""

import argparse
import contextlib
import csv
import tempfile
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from grader.documents import ReportDocument
from grader.folder.batch import Batch, graded
from grader.owners.title_block import SURELY, names_of
from grader.records import PageRef, ScannedPage
from grader.scan.handwriting.captions import (
    NUMBER_WORDS,
    captioned_scales,
    written_name,
    written_number,
)
from grader.scan.page import open_page, writing_on
from grader.tables.roster import read_roster
from grader.tables.scale_text import Declared, parse_scale
from reference.authored.assignment import SCALE_NAMES, Variant
from samples.simulation import CAREFUL, SLOPPY, TYPICAL, SimulatedSheet, any_settings, simulate
from tests.bench.plain_text import Table, as_text
from tests.bench.reading_scenes import task_named

GIVEN = {
    "ro": "Ana Ion Maria Andrei Elena Mihai Ioana Radu Cristina Victor Diana Sergiu Alina Vasile".split(),
    "ru": "Анна Иван Мария Андрей Елена Михаил Ольга Павел Ирина Виктор Дарья Сергей Алина Антон".split(),
    "en": "Anna John Mary Andrew Helen Michael Grace Paul Irene Victor Laura Simon Alice Peter".split(),
}
FAMILY = {
    "ro": "Popescu Popa Rusu Ceban Munteanu Lungu Rotaru Moraru Ursu Cojocaru Croitoru Olaru".split(),
    "ru": "Иванов Петров Смирнов Кузнецов Соколов Морозов Волков Новиков Козлов Лебедев Орлов".split(),
    "en": "Smith Brown Carter Hughes Turner Morris Parker Cooper Bennett Foster Palmer Stone".split(),
}
"""Common names, put together by lot."""
SAME = 1e-3
"""Relative: scales are written to four digits."""


@dataclass(slots=True)
class CaptionTally:
    """What became of one scene's sheets; each pair is of what stands on the sheets."""

    scene: str
    students: int = 0
    sheets: int = 0
    graded: int = 0
    person: int = 0
    names: int = 0
    names_right: int = 0
    names_wrong: int = 0
    numbers: int = 0
    numbers_right: int = 0
    numbers_wrong: int = 0
    numbers_told: int = 0
    scales: int = 0
    scales_right: int = 0
    scales_wrong: int = 0
    scales_told: int = 0
    ms: list[float] = field(default_factory=list)
    close_ms: list[float] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class PlainStudent:
    """Somebody with a name, and the sheets handed in."""

    student_id: str
    name: str
    variant: Variant
    sheets: Sequence[SimulatedSheet]

    @property
    def has_title(self) -> bool:
        """Whether there is a title block to write in."""
        return self.sheets[0].settings.page.title_block != "none"


def plain_class(scene: str, count: int, first_seed: int) -> Iterator[PlainStudent]:
    """So many students of an assignment on plain paper, flatbed, 300 dpi, any hand; no mistakes."""
    assignment, _ = task_named(scene)
    variants = assignment.variants()
    for number, seed in enumerate(range(first_seed, first_seed + count), start=1):
        lot = np.random.default_rng([seed, 9])
        variant = variants[int(lot.integers(len(variants)))]
        settings = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.0, work=(assignment, variant))
        hand = (CAREFUL, TYPICAL, SLOPPY)[int(lot.integers(3))]
        name = _name(settings.page.language, lot)
        settings = replace(settings, hand=hand)
        sheets = simulate(assignment, variant, seed, settings, student_id=name)
        yield PlainStudent(f"m{number:02d}", name, variant, sheets)


def _name(language: str, lot: np.random.Generator) -> str:
    return f"{lot.choice(FAMILY[language])} {lot.choice(GIVEN[language])}"


def measure(scene: str, count: int, first_seed: int, folder: Path) -> CaptionTally:
    """A class graded by its sheets, in files named by the students' ids, and a roster of names alone.

    Names on sheets are read as for files whose names say nothing.
    """
    tally, students = CaptionTally(scene), list(plain_class(scene, count, first_seed))
    scans = folder / scene
    scans.mkdir(parents=True)
    _write_roster(scans / "roster.csv", students, first_seed)
    names = names_of(read_roster(scans / "roster.csv"))
    for student in students:
        for number, sheet in enumerate(student.sheets, start=1):
            path = sheet.save(scans / f"{student.student_id}_{number}")
            _count_page(tally, student, open_page(PageRef(path.name, path=path)), names)
    assignment, rubric = task_named(scene)
    batch = Batch(assignment, rubric, scans, folder / f"{scene}-results")
    reports = {report.student_id: report for report in graded(batch, lambda *_: None).results.reports}
    for student in students:
        _count(tally, student, reports[student.student_id])
    return tally


def _count_page(
    tally: CaptionTally, student: PlainStudent, page: ScannedPage, names: Mapping[str, Collection[str]]
) -> None:
    """A page's name, and the processor time of reading all that its captions say."""
    page, owner, chance = replace(page, image=None), None, 0.0
    for closely, spent in ((False, tally.ms), (True, tally.close_ms)):
        start = time.process_time()
        lines = writing_on(page, closely=closely)
        if chance < SURELY:
            owner, chance = written_name(lines, names)
        captioned_scales(lines, SCALE_NAMES)
        written_number(lines, range(1, 31), NUMBER_WORDS)
        spent.append(1000.0 * (time.process_time() - start))
    owner = owner if chance >= SURELY else None
    tally.sheets += 1
    tally.names += student.has_title
    tally.names_right += owner == student.student_id
    tally.names_wrong += owner not in {None, student.student_id}


def _write_roster(path: Path, students: Sequence[PlainStudent], seed: int) -> None:
    """The students' names and as many others'."""
    lot = np.random.default_rng([seed, 21])
    names = [student.name for student in students]
    languages = [next(lang for lang, given in GIVEN.items() if name.split()[1] in given) for name in names]
    others = dict.fromkeys(_name(language, lot) for language in languages)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["student_id", "name"])
        writer.writerows([student.student_id, student.name] for student in students)
        absent = [name for name in others if name not in names]
        writer.writerows([f"z{number:02d}", name] for number, name in enumerate(absent, start=1))


def _count(tally: CaptionTally, student: PlainStudent, report: ReportDocument) -> None:
    """One student's report against what was written and drawn."""
    codes = [problem.code for problem in report.problems]
    tally.students += 1
    tally.graded += report.status == "graded"
    tally.person += report.status != "graded"
    if student.has_title:
        tally.numbers += 1
    used = report.variant.get("n") if student.variant.n is not None else report.position
    true = student.variant.n if student.variant.n is not None else student.variant.position
    tally.numbers_right += used == true
    tally.numbers_wrong += used not in {None, true}
    tally.numbers_told += any(code in {"number_doubtful", "number_contradicted"} for code in codes)
    tally.scales_told += sum(code.startswith("scale_box") for code in codes)
    written = {name for sheet in student.sheets for name in sheet.truth["scales"]["written"]}
    declared = student.sheets[0].truth["scales"]["declared"]
    tally.scales += len(written)
    for name, scale in report.scales.items():
        if scale.source == "box":
            parsed = parse_scale(name, scale.text or "")
            right = isinstance(parsed, Declared) and abs(parsed.per_mm / declared[name] - 1.0) < SAME
            tally.scales_right += right
            tally.scales_wrong += not right


def table(tallies: Sequence[CaptionTally]) -> Table:
    """The tallies, a row each."""
    heads = [
        "class", "students", "settled", "names: right", "wrong", "numbers: right", "wrong", "told",
        "scales: right", "wrong", "told", "ms a page", "closely",
    ]  # fmt: skip
    rows = [
        [
            t.scene, str(t.students), str(t.graded), f"{t.names_right} of {t.names}", str(t.names_wrong),
            f"{t.numbers_right} of {t.numbers}", str(t.numbers_wrong), str(t.numbers_told),
            f"{t.scales_right} of {t.scales}", str(t.scales_wrong), str(t.scales_told),
            f"{np.median(t.ms):.0f}", f"{np.median(t.close_ms):.0f}",
        ]
        for t in tallies
    ]  # fmt: skip
    return "Captions: plain sheets, a roster of names alone", heads, rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=9001)
    parser.add_argument("--scenes", default="pump,press,engine,piston,shaper")
    parser.add_argument("--students", default="12,6,2,2,2")
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    with contextlib.ExitStack() as stack:
        folder = options.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        counts = map(int, options.students.split(","))
        tallies = [
            measure(scene, count, options.seed, folder)
            for scene, count in zip(options.scenes.split(","), counts, strict=True)
        ]
    print(as_text([table(tallies)]))


if __name__ == "__main__":
    main()
