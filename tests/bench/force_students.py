"""Simulated students who draw force plans and measure them: a model of its own, group by group.

A student draws the sketch with errors, measures arms on it, computes the parts across the links, draws each
polygon in an order of the given forces of one's own, and measures every vector with ruler and protractor.
Only given forces, names and positions are taken from the reference (its closed form); what is judged, the
construction, is not used. `StudentForces.due` is the entry that the right step gives from the student's own
earlier vectors.
"""

import cmath
import math
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from grader.comparison.evidence import Submission
from grader.rubric import RubricFile, load_both
from grader.tables.measurements import reading_of
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.construction.forces import reaction
from reference.mechanism import (
    GROUND,
    Crank,
    Dyad,
    FixedGuide,
    Slider,
    SlottedLink,
    carriers,
    named_links,
    short_names,
)
from reference.plan import construction_for, exact_plan

RUBRICS = Path(__file__).parents[2] / "rubrics"
BODIES = {
    "pump": """
[[body]]
link = "2"
mass = 3
inertia = 0.0225
centre = { base = ["O2", "B"], ratio = 0.5 }
[[body]]
link = "3"
mass = 4
inertia = 0.06
centre = { base = ["A", "B"], at = [17.9, 4.84] }
[[body]]
link = "4"
mass = 1.2
inertia = 0.004
centre = { base = ["C", "D"], ratio = 0.5 }
[[body]]
link = "slider_D"
mass = 2.5
[[load]]
link = "slider_D"
force = "2000 + 50*n"
motion = "against"
""",
    "press": """
[[body]]
link = "2"
mass = 90
inertia = 17
centre = "B"
[[body]]
link = "3"
mass = 60
inertia = 8
centre = { base = ["A", "B"], ratio = 0.5 }
[[body]]
link = "4"
mass = 20
inertia = 0.3
centre = { base = ["C", "D"], ratio = 0.5 }
[[body]]
link = "slider_D"
mass = 110
[[load]]
link = "slider_D"
force = 2400
motion = "against"
""",
    "shaper": """
[[body]]
link = "3"
mass = 25
inertia = 0.5
centre = { base = ["O2", "D"], ratio = 0.5 }
[[body]]
link = "4"
mass = 3
centre = { base = ["D", "E"], ratio = 0.5 }
[[body]]
link = "slider_E"
mass = 40
[[load]]
link = "slider_E"
force = 1200
motion = "against"
""",
}
FORCE_SCALES = {"pump": 50, "press": 40, "shaper": 20}
WEIGHED = {"press", "shaper"}
"""Mechanisms in which the links weigh something."""


def with_masses(name: str, masses: str, joints: Sequence[str], scale: str, *, weighs: bool) -> str:
    """Return a built-in assignment's text with bodies, loads and one page of force plans."""
    text = (RUBRICS / f"{name}.assignment.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?ms)^\[\[page\]\].*?(?=^\[)", "", text).replace(
        "[scales]\n", f"[scales]\nkF = {scale}\n"
    )
    figures = ", ".join(f'"{figure}"' for figure in ("mechanism", *(f"force_plan_{one}" for one in joints)))
    gravity = "gravity = 9.81\n" if weighs else ""
    return f'{gravity}{text}{masses}[[page]]\nkind = "forces"\nfigures = [{figures}]\n'


@cache
def force_task(name: str) -> tuple[Assignment, RubricFile]:
    """Return an assignment with force plans by given accelerations, and a rubric that asks for everything."""
    folder = Path(tempfile.mkdtemp())
    joints = {"pump": "DBA", "press": "DBA", "shaper": ["E", "A3", "A"]}[name]
    text = with_masses(name, BODIES[name], joints, str(FORCE_SCALES[name]), weighs=name in WEIGHED)
    text = re.sub(r"(?m)^rubric = .*$", 'rubric = "forces"', text)
    path = folder / f"{name}.assignment.toml"
    path.write_text(text, encoding="utf-8")
    construction = construction_for(load_assignment(path))
    asked = {"kF": "scale"} | dict.fromkeys(construction.vectors, "vector")
    asked |= dict.fromkeys(construction.moments, "moment")
    rows = [
        f'[[criterion]]\nid = "{one}"\ntitle = {{ en = "{one}", ro = "{one}", ru = "{one}" }}\n'
        f'points = 1\n{key} = "{one}"\n'
        for one, key in asked.items()
    ]
    head = 'schema_version = 1\nid = "forces"\ntitle = { en = "F", ro = "F", ru = "F" }\n'
    (folder / "forces.rubric.toml").write_text(head + "\n".join(rows), encoding="utf-8")
    return load_both(path)


@dataclass(frozen=True, slots=True)
class Hand:
    """Standard deviations of one act: of lines, lengths and points drawn, of ruler and protractor."""

    angle_deg: float
    place_mm: float
    mark_mm: float
    ruler_mm: float
    protractor_deg: float


HANDS = {"careful": Hand(0.2, 0.2, 0.1, 0.2, 0.3), "typical": Hand(0.35, 0.3, 0.15, 0.3, 0.5)}


@dataclass(frozen=True, slots=True)
class ForceMistake:
    """One mistake.

    Attributes
    ----------
    kind : see `MISTAKES`
    at : the vector, couple or link
    factor, turn_deg : of a force, of a line
    """

    kind: str
    at: str
    factor: float = 1.0
    turn_deg: float = 0.0


@dataclass(slots=True)
class Acting:
    """A force on a link: where it acts, what the student takes it for, and what it should be."""

    name: str
    point: str
    force: complex
    right: complex


@dataclass
class StudentForces:
    """A student's force sheet: entries, what is due by the right steps, and where the mistake was made.

    Attributes
    ----------
    drawn, due : by vector, complex mm in its own sense; `due` from the student's own earlier vectors
    wrong : the vectors in which the mistake was made
    moment, moment_due : N m
    """

    task: Assignment
    variant: Variant
    hand: Hand
    mistake: ForceMistake | None
    rng: np.random.Generator
    drawn: dict[str, complex] = field(default_factory=dict)
    due: dict[str, complex] = field(default_factory=dict)
    wrong: set[str] = field(default_factory=set)
    entered: dict[str, tuple[float, float]] = field(default_factory=dict)
    moment: float | None = None
    moment_due: float | None = None
    scale: float = 1.0

    def __post_init__(self) -> None:
        plan = exact_plan(self.task, [self.variant], accelerations=False)
        assert plan.forces is not None
        assert plan.scales.kF is not None
        self.mechanism, self.names = plan.mechanism, short_names(plan.mechanism)
        self.carriers, self.links = carriers(plan.mechanism), named_links(plan.mechanism)
        self.kl, self.kf = float(plan.scales.kL[0]), float(np.ravel(plan.scales.kF)[0])
        self.declared = self.kf
        exact = {name: complex(np.ravel(at)[0]) / self.kl for name, at in plan.motion.position.items()}
        self.exact = exact
        self.sketch = {name: at + self.noise(self.hand.place_mm) for name, at in exact.items()}
        self.acting: dict[str, list[Acting]] = {}
        self.couples: dict[str, list[tuple[float, float]]] = {}
        self.known = set(plan.construction.vectors)
        self.exactly = {name: complex(plan.drawn_mm(name)[0]) for name in plan.construction.vectors}
        made = self.mistake or ForceMistake("", "")
        if made.kind == "scale":
            self.kf *= made.factor
            self.wrong.add("kF")
        for one in plan.forces.given:
            right = complex(np.ravel(one.force)[0]) / self.kf
            if right:
                self.acting.setdefault(one.link, []).append(
                    Acting(one.name, one.point, right * self.changed(one.name), right)
                )
            couple = float(np.ravel(one.couple)[0])
            if couple:
                name = f"M_{one.name.partition('_')[2]}"
                self.couples.setdefault(one.link, []).append((couple * self.factor(name), couple))
        self.draw()

    # Errors and mistakes --------------------------------------------------------------------------

    def noise(self, sigma: float) -> complex:
        """Return an error in the plane."""
        return complex(*self.rng.normal(0.0, sigma, 2))

    def made(self, kind: str, at: str) -> bool:
        """Return whether the mistake was made here."""
        return self.mistake is not None and (self.mistake.kind, self.mistake.at) == (kind, at)

    def factor(self, name: str) -> float:
        """Return the factor of a force or couple that acts, by the mistake."""
        if self.mistake is None:
            return 1.0
        alike = self.mistake.at == name or (self.mistake.at == "F_i" and name.startswith("F_i"))
        of = {"reversed": -1.0, "missing": 0.0, "slip": self.mistake.factor, "turned": 1.0}
        return of.get(self.mistake.kind, 1.0) if alike else 1.0

    def changed(self, name: str) -> complex:
        """Return that factor, with the turn of a force laid off in a wrong direction."""
        turn = self.mistake.turn_deg if self.mistake and self.made("turned", name) else 0.0
        if self.factor(name) != 1.0 or turn:
            self.wrong.add(name)
        return self.factor(name) * cmath.rect(1.0, math.radians(turn))

    def line(self, along: complex) -> complex:
        """Return a direction as it is drawn."""
        return along / abs(along) * cmath.rect(1.0, self.rng.normal(0.0, math.radians(self.hand.angle_deg)))

    def laid(self, vector: complex) -> complex:
        """Return a vector as it is laid off."""
        if not vector:
            return 0j
        size = abs(vector) + self.rng.normal(0.0, self.hand.place_mm)
        return self.line(vector) * size + self.noise(self.hand.mark_mm)

    # Drawing --------------------------------------------------------------------------------------

    def note(self, name: str, drawn: complex, due: complex) -> None:
        """Keep a vector, if the sheet asks for it."""
        if name in self.known:
            self.drawn[name], self.due[name] = drawn, due

    def moment_of(self, link: str, about: str, *, right: bool, arms: Mapping[str, complex]) -> float:
        """Return the moment of what acts on a link, N m by kF and kL; as it was computed, or rightly."""
        total = sum(couple[1 if right else 0] for couple in self.couples.get(link, ())) / (self.kf * self.kl)
        for one in self.acting.get(link, ()):
            arm, force = arms[one.point] - arms[about], one.force
            share = (arm.conjugate() * force).imag
            if not right:
                share += self.rng.normal(0.0, self.hand.ruler_mm) * abs(force) * (abs(arm) > 0)
                if self.made("wrong_arm", f"{link} {one.name}"):
                    share = math.copysign(abs(arm) * abs(force), share)
            total += share
        return total

    def across(self, link: str, pin: str, inner: str) -> tuple[complex, complex] | None:
        """Return the part across a link of the reaction at its pin, as drawn and as due."""
        if not self.acting.get(link) and not self.couples.get(link):
            return None
        found = []
        for right, at in ((False, self.sketch), (True, self.exact)):
            axis = (at[inner] - at[pin]) / abs(at[inner] - at[pin]) * 1j
            lever = ((at[pin] - at[inner]).conjugate() * axis).imag
            found.append(axis * (-self.moment_of(link, inner, right=right, arms=at) / lever))
        name = f"{self.reaction(pin, link)}_t"
        drawn, due = found
        if self.made("part", name) and self.mistake:
            drawn *= self.mistake.factor
            self.wrong.add(name)
        if self.mistake and self.mistake.kind == "wrong_arm" and self.mistake.at.split()[0] == link:
            self.wrong.add(name)
        if self.mistake and self.mistake.at == f"M_i{self.names[link]}":
            self.wrong.add(name)
        drawn = self.laid(drawn)
        self.note(name, drawn, due)
        return drawn, due

    def reaction(self, joint: str, on: str) -> str:
        """Return the name of the reaction at a joint on a link, of the link that carries the joint."""
        return reaction(self.names, self.carriers[joint], on)

    def chain(self, link: str) -> complex:
        """Lay off what acts on a link, in any order; return their sum as drawn."""
        total = 0j
        acting = self.acting.get(link, [])
        for index in self.rng.permutation(len(acting)):
            one = acting[index]
            drawn = self.laid(one.force)
            total += drawn
            self.note(one.name, drawn, one.right)
        return total

    def handed_over(self, joint: str, on: str, force: complex) -> None:
        """Let the opposite of a drawn reaction act on the link that carries the joint."""
        carrier = self.carriers[joint]
        if carrier != GROUND:
            other = reaction(self.names, on, carrier)
            taken = -force * self.changed(other)
            self.acting.setdefault(carrier, []).append(Acting(other, joint, taken, -force))

    def draw(self) -> None:
        """Draw all polygons, from the last group to the crank, and measure."""
        for group in reversed(self.mechanism.groups):
            links = self.links.get(group.node, ())
            match group:
                case Dyad(node=node, pins=pins):
                    self.two_lines(node, (*links,), pins, None)
                case Slider(node=node, pin=pin, guide=FixedGuide() as guide):
                    along = cmath.rect(1.0, float(np.ravel(guide.angle_rad)[0]))
                    self.two_lines(node, (*links,), (pin,), along)
                case SlottedLink():
                    self.slotted(group, links)
        self.crank()
        self.measure()

    def two_lines(self, inner: str, links: Sequence[str], pins: Sequence[str], guide: complex | None) -> None:
        """Draw the polygon of two links that are closed by two lines of known direction."""
        first, second = links
        part = self.across(first, pins[0], inner)
        one = self.chain(first)
        other = self.chain(second)
        last = self.across(second, pins[1], inner) if guide is None else None
        start = (part[0] if part else 0j) + one + other + (last[0] if last else 0j)
        at, to = self.sketch, self.exact
        first_line, first_due = at[inner] - at[pins[0]], to[inner] - to[pins[0]]
        if guide is None:
            name = self.reaction(pins[1], second)
            second_line, second_due = at[inner] - at[pins[1]], to[inner] - to[pins[1]]
            second_name = f"{name}_n" if last else name
        else:
            name = second_name = reaction(self.names, GROUND, second)
            second_line = second_due = guide * 1j
        first_name = self.reaction(pins[0], first)
        closing = f"{first_name}_n" if part else first_name
        for line_name in (closing, second_name):
            if self.mistake and self.mistake.kind in {"line", "askew"} and self.mistake.at == line_name:
                turn = cmath.rect(1.0, math.radians(self.mistake.turn_deg))
                self.wrong.add(line_name)
                if line_name == closing:
                    first_line *= turn
                else:
                    second_line *= turn
        x, y = _met(start, self.line(second_line), self.line(first_line))
        p, q = _met(start, second_due / abs(second_due), first_due / abs(first_due))
        mark = self.noise(self.hand.mark_mm)
        x, y = x + mark, y - mark
        self.note(second_name, x, p)
        self.note(closing, y, q)
        whole, due = (y + part[0], q + part[0]) if part else (y, q)
        if part:
            self.note(first_name, whole, due)
        on_second, due_second = (x + last[0], p + last[0]) if last else (x, p)
        if last:
            self.note(name, on_second, due_second)
        inner_name = reaction(self.names, second, first)
        self.note(inner_name, -(whole + one), -(due + one))
        self.handed_over(pins[0], first, whole)
        if guide is None:
            self.handed_over(pins[1], second, on_second)

    def slotted(self, group: SlottedLink, links: Sequence[str]) -> None:
        """Draw the polygon of a link with a slot: the block's reaction across it, then the pivot's."""
        (link, block), pivot, pin = links, group.pivot, group.pin
        found = []
        for right, at in ((False, self.sketch), (True, self.exact)):
            axis = (at[pin] - at[pivot]) / abs(at[pin] - at[pivot]) * 1j
            lever = abs(at[pin] - at[pivot])
            found.append(axis * (-self.moment_of(link, pivot, right=right, arms=at) / lever))
        name = reaction(self.names, block, link)
        drawn, due = found
        if self.made("part", name) and self.mistake:
            drawn *= self.mistake.factor
            self.wrong.add(name)
        if self.mistake and (
            (self.mistake.kind == "wrong_arm" and self.mistake.at.split()[0] == link)
            or self.mistake.at == f"M_i{self.names[link]}"
        ):
            self.wrong.add(name)
        drawn = self.laid(drawn)
        self.note(name, drawn, due)
        total = drawn + self.chain(link)
        self.note(self.reaction(pivot, link), -total, -total)
        carrier = self.carriers[pin]
        other = reaction(self.names, block, carrier)
        taken = -drawn * self.changed(other)
        self.acting.setdefault(carrier, []).append(Acting(other, pin, taken, -drawn))

    def crank(self) -> None:
        """Draw the crank's polygon and compute its moment."""
        driver = self.mechanism.driver
        assert isinstance(driver, Crank)
        link, pivot = driver.link, driver.pivot
        total = self.chain(link)
        self.note(reaction(self.names, GROUND, link), -total, -total)
        factor = self.kf * self.kl
        self.moment = -self.moment_of(link, pivot, right=False, arms=self.sketch) * factor
        self.moment_due = -self.moment_of(link, pivot, right=True, arms=self.exact) * factor
        if self.made("slip", "M_b") and self.mistake:
            self.moment *= self.mistake.factor
            self.wrong.add("M_b")

    def measure(self) -> None:
        """Measure every vector with ruler and protractor, to a tenth of a millimetre and degree."""
        for name, vector in self.drawn.items():
            length = abs(abs(vector) + self.rng.normal(0.0, self.hand.ruler_mm))
            turn = math.degrees(cmath.phase(vector)) + self.rng.normal(0.0, self.hand.protractor_deg)
            if self.made("arrow", name):
                turn += 180.0
                self.wrong.add(name)
            if self.made("entry", name) and self.mistake:
                length *= self.mistake.factor
                turn += self.mistake.turn_deg
                self.wrong.add(name)
            self.entered[name] = round(length, 1), round(turn, 1) % 360.0

    @property
    def submission(self) -> Submission:
        """Everything as it is entered; a vector left out is left blank."""
        plans = {}
        construction = construction_for(self.task, accelerations=False)
        for name, vector in construction.vectors.items():
            plans[name] = construction.figure_of(vector.head)
        shown = {name: one for name, one in self.entered.items() if self.drawn[name]}
        reading = reading_of(
            plans,
            {name: one[0] for name, one in shown.items()},
            {name: one[1] for name, one in shown.items()},
        )
        values = {"M_b": float(f"{self.moment:.3g}")} if self.moment is not None else {}
        return Submission(measured=reading, values=values, declared={"kF": f"{self.declared:g} N/mm"})


def _met(start: complex, along: complex, back: complex) -> tuple[complex, complex]:
    """Return the sides of a triangle along two directions that close a chain: start + x + y = 0."""
    rows = np.array([[along.real, back.real], [along.imag, back.imag]])
    x, y = np.linalg.solve(rows, [-start.real, -start.imag])
    return x * along, y * back


def mistakes_for(name: str, variant: Variant) -> Iterator[ForceMistake]:
    """Yield the known mistakes that a student of an assignment can make."""
    assignment, _ = force_task(name)
    right = StudentForces(assignment, variant, HANDS["careful"], None, np.random.default_rng(0))
    sizes = {one: abs(vector) for one, vector in right.drawn.items()}
    for one, size in sizes.items():
        if size < 6.0:
            continue
        if one.startswith(("F_", "G_")):
            kinds = ("missing",) if one.startswith("G_") else ("reversed", "missing")
            yield from (ForceMistake(kind, one) for kind in kinds)
            yield ForceMistake("slip", one, factor=2.0)
            yield ForceMistake("slip", one, factor=1.4)
        elif one.endswith("_t"):
            yield ForceMistake("part", one, factor=-1.0)
            yield ForceMistake("part", one, factor=0.5)
        elif one.endswith("_n") or one.startswith("R_0"):
            yield ForceMistake("line", one, turn_deg=90.0)
        yield ForceMistake("arrow", one)
    for force in right.acting.values():
        yield from (ForceMistake("reversed", one.name) for one in force if one.name.startswith("R_"))
    for link, forces in right.acting.items():
        yield from (ForceMistake("wrong_arm", f"{link} {one.name}") for one in forces)
    for link in right.couples:
        yield ForceMistake("missing", f"M_i{right.names[link]}")
        yield ForceMistake("reversed", f"M_i{right.names[link]}")
    yield ForceMistake("reversed", "F_i")
    yield ForceMistake("missing", "F_i")
    yield from (ForceMistake("scale", "kF", factor=factor) for factor in (0.5, 2.0, 1.25))
    yield ForceMistake("slip", "M_b", factor=1.5)


def others_for(name: str, variant: Variant, rng: np.random.Generator) -> Iterator[ForceMistake]:
    """Yield mistakes that are none of the known ones."""
    assignment, _ = force_task(name)
    right = StudentForces(assignment, variant, HANDS["careful"], None, np.random.default_rng(0))
    for one, vector in right.drawn.items():
        turn = float(rng.uniform(25.0, 65.0) * rng.choice((-1.0, 1.0)))
        if abs(vector) < 6.0:
            continue
        if one.startswith("F_"):
            yield ForceMistake("turned", one, turn_deg=turn)
        elif one.endswith("_n"):
            yield ForceMistake("askew", one, turn_deg=turn)
        yield ForceMistake("entry", one, factor=float(rng.uniform(1.3, 1.8)), turn_deg=turn)
