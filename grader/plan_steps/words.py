"""Names, numbers and directions as the steps' sentences say them; the drawing's own words."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

from grader.i18n import N_, UNITS, Tongue
from reference.drawing.subject import SCALE_UNITS, VECTOR_UNITS, Subject, Wording
from reference.elements import Along, Direction, Fixed, View
from reference.lettering import Piece, pieces_of, scale_pieces

PERPENDICULAR = N_("perpendicular to %(link)s")
PARALLEL = N_("parallel to %(link)s")
TOWARDS = N_("parallel to %(link)s, from %(tail)s towards %(head)s")
TURNED_LEFT = N_(
    "perpendicular to %(link)s, a quarter turn counter-clockwise from the direction %(tail)s→%(head)s"
)
TURNED_RIGHT = N_("perpendicular to %(link)s, a quarter turn clockwise from the direction %(tail)s→%(head)s")
GUIDE = N_("parallel to the guide of %(joint)s")
ACROSS_GUIDE = N_("perpendicular to the guide of %(joint)s")
SLOT = N_("parallel to the slot of %(joint)s")
AT_ANGLE = N_("in the direction %(angle)s")
ALONG_GUIDE = N_("along the guide of %(joint)s, in the direction %(angle)s")
TITLES = {
    "mechanism": N_("Mechanism"),
    "velocity_plan": N_("Velocity plan"),
    "acceleration_plan": N_("Acceleration plan"),
    "centres": N_("Instantaneous centres and acceleration poles"),
}
VARIANT = {"n": N_("n"), "position": N_("position")}
COLUMNS = (N_("vector"), N_("on paper"), N_("mm"), N_("real value"), N_("direction"))
TOO_LARGE = N_("does not fit A3 at these scales")
OTHER_UNITS = (N_("rev/min"), N_("cm"), N_("rad"))
DIGITS = 5
NEXT_TO_NOTHING = 1e-9
"""Of a figure's size: shorter lengths are told as zero; triangles flatter than this as lines."""


def wording_of(tongue: Tongue) -> Wording:
    """The drawing's words in a language."""
    _ = tongue.gettext
    first, second, third, fourth, fifth = (_(column) for column in COLUMNS)
    return Wording(
        lang=tongue.lang,
        decimal_mark=tongue.number(0.5, 1)[1],
        titles={figure: _(title) for figure, title in TITLES.items()},
        variant={name: _(word) for name, word in VARIANT.items()},
        columns=(first, second, third, fourth, fifth),
        too_large=_(TOO_LARGE),
        units={unit: _(unit) for unit in (*UNITS, *OTHER_UNITS)},
    )


def markup_of(pieces: tuple[Piece, ...]) -> Markup:
    """A name with its indices, its letter slanted."""
    marks = {0: "<i>{}</i>", -1: "<sub>{}</sub>", 1: "<sup>{}</sup>"}
    return Markup("").join(Markup(marks[piece.height]).format(piece.text) for piece in pieces)  # noqa: S704


Value = Markup | str | tuple[str, ...] | complex | float
"""Of a sentence: a text, a name, names side by side, a direction, a drawn length in millimetres."""


@dataclass(frozen=True, slots=True)
class Speaker:
    """Says a variant's names and numbers in a language; `view` has all nodes, the centres too."""

    subject: Subject
    tongue: Tongue
    view: View

    def say(self, text: str, **values: Value) -> Markup:
        """A sentence of the catalogue with its values in place, each as `Value` says."""
        placed = {name: self._set(value) for name, value in values.items()}
        return Markup(escape(self.tongue.gettext(text))) % placed  # noqa: S704 - just escaped

    def _set(self, value: Value) -> Markup | str:
        match value:
            case Markup():
                return value
            case str():
                return self.name(value)
            case tuple():
                return self.name(*value)
            case complex():
                return self.degrees(value)
            case _:
                return self.mm(value)

    def name(self, *names: str) -> Markup:
        """A node, a vector, or several nodes side by side."""
        return Markup("").join(markup_of(self.subject.letter(name)) for name in names)

    def names(self, names: tuple[str, ...]) -> Markup:
        """Nodes one by one."""
        return Markup(", ").join(self.name(name) for name in names)

    def scale(self, scale: str) -> Markup:
        """A scale's name."""
        return markup_of(scale_pieces(self.subject.shown(scale)))

    def rate(self, name: str) -> Markup:
        """An angular velocity or acceleration."""
        return markup_of(pieces_of(self.subject.shown(name)))

    def bare(self, value: float) -> str:
        """A number with five significant digits, or all of a shorter one."""
        text = f"{value:.{DIGITS}g}"
        if float(text) == round(value, 12):
            return self.tongue.trimmed(value, 12)
        return self.tongue.significant(value, DIGITS)

    def real(self, value: float, unit: str) -> Markup:
        """A real value with its unit."""
        return escape(f"{self.bare(value)}\N{NO-BREAK SPACE}{self.tongue.unit(unit)}")

    def mm(self, value: float) -> str:
        """A drawn length."""
        return self.tongue.quantity(value, 2, "mm")

    def degrees(self, direction: complex) -> str:
        """A direction counter-clockwise from +x."""
        angle = float(np.degrees(np.angle(direction))) % 360.0
        return f"{self.tongue.number(0.0 if round(angle, 2) == 360.0 else angle, 2)}°"

    def place(self, node: str) -> complex:
        """Where a node is, complex millimetres."""
        return complex(self.view.nodes[node])

    def distance(self, p: str, q: str) -> float:
        """The drawn distance of two nodes, mm."""
        return abs(self.place(q) - self.place(p))

    def is_nothing(self, node: str, mm: float) -> bool:
        """Whether a length is zero against the size of the figure that a node is in."""
        figure = self.subject.plan.construction.figure_of(node)
        size = float(np.max(np.abs(list(self.subject.nodes(figure).values()))))
        return abs(mm) <= NEXT_TO_NOTHING * size

    def vector(self, tail: str, head: str) -> Markup:
        """The vector between two nodes of a plan."""
        vectors = self.subject.plan.construction.vectors.values()
        return next(
            self.name(vector.name) for vector in vectors if (vector.tail, vector.head) == (tail, head)
        )

    def link_of(self, node: str) -> Markup:
        """The link of the normal component that ends in a node."""
        vectors = self.subject.plan.construction.vectors.values()
        return next(self.name(*vector.link) for vector in vectors if vector.head == node and vector.link)

    def carrier_of(self, node: str) -> str:
        """The link that carries the guide of the Coriolis component that ends in a node."""
        vectors = self.subject.plan.construction.vectors.values()
        return next(vector.turning or "" for vector in vectors if vector.head == node)

    def scale_value(self, scale: str) -> float:
        """A scale, real units per millimetre."""
        return self.subject.one(getattr(self.subject.plan.scales, scale))

    def scale_told(self, scale: str) -> Markup:
        """A scale with its value."""
        value = self.real(self.scale_value(scale), SCALE_UNITS[scale])
        return Markup("{} = {}").format(self.scale(scale), value)

    def unit_of(self, scale: str) -> str:
        """The unit of what is drawn at a scale."""
        return VECTOR_UNITS.get(scale, "m")

    def line_direction(self, along: Direction) -> Markup:
        """Where a line runs, without a sense."""
        if isinstance(along, Along):
            text = PERPENDICULAR if along.quarters % 2 else PARALLEL
            return self.say(text, link=(along.tail, along.head))
        kind, joint = _guided(along)
        if kind == "slot":
            return self.say(SLOT, joint=joint)
        return self.say(ACROSS_GUIDE if along.quarters % 2 else GUIDE, joint=joint)

    def vector_direction(self, along: Direction, sign: float) -> Markup:
        """Where a vector points: a negative length turns it about."""
        if not isinstance(along, Along):
            angle = complex(along.at(self.view)) * (-1.0 if sign < 0.0 else 1.0)
            kind, joint = _guided(along)
            if kind == "guide":
                return self.say(ALONG_GUIDE, joint=joint, angle=angle)
            return self.say(AT_ANGLE, angle=angle)
        turns = (along.quarters + (2 if sign < 0.0 else 0)) % 4
        ends = (along.head, along.tail) if turns == 2 else (along.tail, along.head)
        text = {0: TOWARDS, 1: TURNED_LEFT, 2: TOWARDS, 3: TURNED_RIGHT}[turns]
        return self.say(text, link=(along.tail, along.head), tail=ends[0], head=ends[1])


def speaker_of(subject: Subject, tongue: Tongue) -> Speaker:
    """Who says a variant's steps."""
    view = subject.view
    nodes = {**view.nodes, **{name: np.asarray(at) for name, at in subject.centres.items()}}
    return Speaker(subject, tongue, View(nodes, view.parameters))


def _guided(along: Fixed) -> tuple[str, str]:
    """Guide or slot, and whose: of the angle's name among the parameters."""
    kind, _, joint = along.angle.removeprefix("angle ").partition(" ")
    return kind, joint
