"""Measure the reading of simulated force sheets whose truth is known.

``python -m tests.bench.force_sheets 20 --seed 95001`` reads 20 sheets of each mechanism.
`tests.bench.reading_truth` defines right readings and silent misreads. The masses are invented.
"""

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from grader.pipeline import read_pages
from grader.records import PageRef, ScannedPage
from grader.scan.page import open_page
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.plan import construction_for
from samples.simulation import CAREFUL, TYPICAL, SimulatedSheet, any_settings, simulate
from samples.simulation.forces import any_drawer_of_forces
from samples.simulation.mistakes import CODES_OF_FORCES
from samples.simulation.wording import declared_texts
from tests.bench.force_students import BODIES, with_masses
from tests.bench.reading_truth import Judged, each_vector, figures_of

MASSES: Mapping[str, tuple[str, Sequence[str]]] = {
    "pump": (
        BODIES["pump"],
        ("D", "B", "A"),
    ),
    "press": (
        """
[[body]]
link = "2"
mass = 120
inertia = 30
centre = { base = ["O2", "C"], ratio = 0.5 }

[[body]]
link = "3"
mass = 60
inertia = 7
centre = { base = ["A", "B"], ratio = 0.5 }

[[body]]
link = "4"
mass = 25
inertia = 0.3
centre = { base = ["C", "D"], ratio = 0.5 }

[[body]]
link = "slider_D"
mass = 150

[[load]]
link = "slider_D"
force = 6000
angle_deg = 180
""",
        ("D", "B", "A"),
    ),
    "shaper": (
        """
[[body]]
link = "3"
mass = 25
inertia = 0.6
centre = { base = ["O2", "A3"], at = [225, 0] }

[[body]]
link = "4"
mass = 4
inertia = 0.004
centre = { base = ["D", "E"], ratio = 0.5 }

[[body]]
link = "slider_E"
mass = 45

[[load]]
link = "slider_E"
force = 900
angle_deg = 180
""",
        ("E", "A3", "A"),
    ),
    "engine": (
        """
[[body]]
link = "2"
mass = 3
inertia = 0.12
centre = "D"

[[body]]
link = "slider_B"
mass = 4

[[load]]
link = "slider_B"
force = 3000
angle_deg = 180
""",
        ("B", "A"),
    ),
}
WEIGHED = {"press", "engine"}
"""Mechanisms in which the links weigh something."""


@cache
def task_with_forces(name: str) -> Assignment:
    """A built-in assignment with masses, a load and one page with force plans, its accelerations given."""
    masses, joints = MASSES[name]
    text = with_masses(name, masses, joints, '"force / 50"', weighs=name in WEIGHED)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}-forces.assignment.toml"
        path.write_text(text, encoding="utf-8")
        return load_assignment(str(path))


@dataclass(frozen=True, slots=True)
class ForceWork:
    """One student's force sheets."""

    assignment: Assignment
    variant: Variant
    seed: int
    sheets: Sequence[SimulatedSheet]


HANDS = (CAREFUL, TYPICAL)


def work(name: str, seed: int, mistake: str = "", order: str = "") -> ForceWork:
    """One student's work; the same seed gives the same sheets.

    Arguments: `mistake`, a code; `order`, of `samples.simulation.force_orders`, in place of a random one.
    """
    assignment = task_with_forces(name)
    variants = assignment.variants()
    variant = variants[seed % len(variants)]
    settings = any_settings(seed, device="flatbed", dpi=300.0, mistakes=0.0)
    student = any_drawer_of_forces(settings.student, np.random.default_rng([seed, 12]))
    student = replace(student, mistakes=(mistake,) if mistake else ())
    student = replace(student, force_order=order or student.force_order)
    if settings.pen.arrow == "none":
        # A force without an arrowhead is none.
        settings = replace(settings, pen=replace(settings.pen, arrow="open"))
    settings = replace(settings, hand=HANDS[seed % len(HANDS)], student=student)
    sheets = simulate(assignment, variant, seed, settings)
    return ForceWork(assignment, variant, seed, sheets)


def work_with_mistake(name: str, seed: int, order: str = "") -> ForceWork:
    """One student's work with one mistake in forces: by its seed, the next that the drawing admits."""
    for code in (*CODES_OF_FORCES[seed % len(CODES_OF_FORCES) :], *CODES_OF_FORCES):
        with suppress(ValueError):
            return work(name, seed, code, order)
    raise ValueError(f"no mistake in forces can be made in {name}, seed {seed}")


def read(one: ForceWork, folder: Path) -> list[ScannedPage]:
    """The student's pages as read."""
    paths = [sheet.save(folder / f"{number}") for number, sheet in enumerate(one.sheets)]
    pages = [open_page(PageRef(path.name, path=path)) for path in paths]
    declared = declared_texts(one.sheets[0].truth["scales"]["declared"])
    construction = construction_for(one.assignment, [one.variant])
    wanted = [name for name, vector in construction.vectors.items() if vector.scale == "kF"]
    return read_pages(pages, one.assignment, one.variant, declared, wanted)


def judged(one: ForceWork, pages: Sequence[ScannedPage]) -> Iterator[Judged]:
    """Every vector of the force plans compared with the truth."""
    construction = construction_for(one.assignment, [one.variant])
    for sheet, page in zip(one.sheets, pages, strict=True):
        figures = figures_of(sheet.truth, construction)
        yield from each_vector(figures, list(construction.vectors), page.reading.figures)


@dataclass(slots=True)
class ForceTally:
    """Counts of vectors of 5 mm and more, and silent misreads of all."""

    counts: Counter[str] = field(default_factory=Counter)

    def add(self, one: Judged) -> None:
        """Add a vector."""
        self.counts["misread"] += one.misread
        self.counts["sure"] += one.counts and one.sure
        if one.true.missing or one.short:
            return
        self.counts["vectors"] += 1
        self.counts["right"] += one.right
        self.counts["right and sure"] += one.right and one.sure
        self.counts["waiting"] += not one.sure
        self.counts["unread"] += not one.reported

    def line(self, name: str) -> str:
        """The counts as a line of text."""
        count = self.counts
        share = {key: f"{100 * count[key] / max(1, count['vectors']):.1f} %" for key in count}
        told = ", ".join(f"{key} {share[key]}" for key in ("right", "right and sure", "waiting", "unread"))
        return f"{name}: {count['vectors']} vectors, {told}; misread {count['misread']} of {count['sure']}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Read sheets of each mechanism and print what was right."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=95001)
    parser.add_argument("--names", nargs="*", default=["pump", "press", "shaper"])
    parser.add_argument("--mistake", default="")
    parser.add_argument("--mistakes", action="store_true", help="one mistake on each sheet, of all in turn")
    parser.add_argument("--order", default="")
    parser.add_argument("-v", action="store_true")
    options = parser.parse_args(arguments)
    every = ForceTally()
    for name in options.names:
        tally = ForceTally()
        for seed in range(options.seed, options.seed + options.count):
            one = (
                work_with_mistake(name, seed, options.order)
                if options.mistakes
                else work(name, seed, options.mistake, options.order)
            )
            started = time.process_time()
            with tempfile.TemporaryDirectory() as folder:
                pages = read(one, Path(folder))
            spent = time.process_time() - started
            student = one.sheets[0].settings.student
            told = f"{student.force_order} {' '.join(student.mistakes)}"
            own = ForceTally()
            for vector in judged(one, pages):
                for tallied in (tally, every, own):
                    tallied.add(vector)
                if options.v and not (vector.right and vector.sure) and not vector.short and vector.counts:
                    true = vector.true
                    what = f"{true.figure} {true.name} {true.length_mm:.1f} {true.missing}"
                    print("   ", what, f"confidence {vector.confidence:.2f} error {vector.error_mm:.2f}")
            print(own.line(f"  {seed} {told} {spent:.0f} s"))
        print(tally.line(name))
    print(every.line("all"))


if __name__ == "__main__":
    main()
