"""The steps of a construction in the words of the textbook, in each language."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

from grader.language import N_, SIDES, UNITS, Tongue
from grader.solution.formulas import Name
from reference import geometry
from reference.construction.elements import (
    Along,
    AnyLine,
    Coriolis,
    Direction,
    Fixed,
    FixedLine,
    Length,
    Line,
    Parallel,
    Scaled,
    View,
    side_at,
)
from reference.construction.graph import Vector
from reference.construction.steps import (
    ArcAndLine,
    Coincide,
    Divide,
    Given,
    Local,
    OnGuide,
    Pivot,
    Pole,
    Similar,
    Step,
    Tangent,
    TwoArcs,
    TwoLines,
)
from reference.drawing.canvas import pieces_of, scale_pieces
from reference.drawing.subject import Subject, Wording
from reference.mechanism import hinged_at
from reference.quantities import group_of

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
ACROSS_SLOT = N_("perpendicular to the slot of %(joint)s")
OPPOSITE = N_("opposite to %(vector)s, in the direction %(angle)s")
AT_ANGLE = N_("in the direction %(angle)s")
ALONG_GUIDE = N_("along the guide of %(joint)s, in the direction %(angle)s")
TITLES = {
    "mechanism": N_("Mechanism"),
    "velocity_plan": N_("Velocity plan"),
    "acceleration_plan": N_("Acceleration plan"),
    "force_plan": N_("Force plan of the group of {group}"),
    "driving_force_plan": N_("Force plan of the driving link"),
    "scheme": N_("Links of the group of {group}"),
    "driving_scheme": N_("Driving link"),
    "lever": N_("Zhukovsky's lever"),
    "centres": N_("Instantaneous centres and acceleration poles"),
}
VARIANT = {"n": N_("n"), "position": N_("position")}
COLUMNS = (N_("vector"), N_("on paper"), N_("mm"), N_("real value"), N_("direction"))
TOO_LARGE = N_("does not fit A3 at these scales")
DIGITS = 5
NEXT_TO_NOTHING = 1e-9
"""Share of a figure's size below which lengths are stated as zero, and triangles as lines."""


def wording_of(tongue: Tongue) -> Wording:
    """Return the drawing's words in a language."""
    _ = tongue.gettext
    first, second, third, fourth, fifth = (_(column) for column in COLUMNS)
    return Wording(
        lang=tongue.lang,
        decimal_mark=tongue.number(0.5, 1)[1],
        titles={figure: _(title) for figure, title in TITLES.items()},
        variant={name: _(word) for name, word in VARIANT.items()},
        columns=(first, second, third, fourth, fifth),
        too_large=_(TOO_LARGE),
        sides={side: _(words) for side, words in SIDES.items()},
        units={unit: _(unit) for unit in UNITS},
    )


def markup_of(name: Name) -> Markup:
    """Return a name with its indices, its letter slanted."""
    marks = {0: "<i>{}</i>", -1: "<sub>{}</sub>", 1: "<sup>{}</sup>"}
    return Markup("").join(Markup(marks[piece.height]).format(piece.text) for piece in name.pieces)  # noqa: S704


Value = Markup | str | tuple[str, ...] | complex | float
"""A value in a sentence: a text, a name, names side by side, a direction, a drawn length in millimetres."""


@dataclass(frozen=True, slots=True)
class Speaker:
    """Writes a variant's names and numbers in a language; `view` has all nodes, including the centres."""

    subject: Subject
    tongue: Tongue
    view: View
    write: Callable[[Name], Markup] = markup_of
    """Makes a name into markup of sentences."""

    def say(self, text: str, **values: Value) -> Markup:
        """Return a sentence of the catalogue with its values filled in, each as `Value` says."""
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

    def symbol(self, *names: str) -> Name:
        """Return the name of a node, a vector or a rate, or of several nodes side by side."""
        shown = [self.subject.shown(name) for name in names]
        return Name(tuple(piece for name in shown for piece in pieces_of(name)), "".join(shown))

    def scale(self, scale: str) -> Name:
        """Return a scale's name."""
        shown = self.subject.shown(scale)
        return Name(scale_pieces(shown), shown)

    def name(self, *names: str) -> Markup:
        """Return the name of a node, a vector, or several nodes side by side, as sentences show it."""
        return self.write(self.symbol(*names))

    def names(self, names: tuple[str, ...]) -> Markup:
        """Return a list of nodes."""
        return Markup(", ").join(self.name(name) for name in names)

    def bare(self, value: float) -> str:
        """Format a number with five significant digits, or all of a shorter one."""
        text = f"{value:.{DIGITS}g}"
        if float(text) == round(value, 12):
            return self.tongue.trimmed(value, 12)
        return self.tongue.significant(value, DIGITS)

    def real(self, value: float, unit: str) -> str:
        """Format a real value with its unit."""
        return f"{self.bare(value)}\N{NO-BREAK SPACE}{self.tongue.unit(unit)}"

    def mm(self, value: float) -> str:
        """Format a drawn length."""
        return self.tongue.quantity(value, 2, "mm")

    def degrees(self, direction: complex) -> str:
        """Format a direction counter-clockwise from +x."""
        angle = float(np.degrees(np.angle(direction))) % 360.0
        return f"{self.tongue.number(0.0 if round(angle, 2) == 360.0 else angle, 2)}°"

    def place(self, node: str) -> complex:
        """Return the position of a node, complex millimetres."""
        return complex(self.view.nodes[node])

    def distance(self, p: str, q: str) -> float:
        """Return the drawn distance of two nodes, mm."""
        return abs(self.place(q) - self.place(p))

    def is_flat(self, p: str, q: str, third: str) -> bool:
        """Return whether three nodes lie in line."""
        base, arm = (np.asarray(self.place(corner) - self.place(p)) for corner in (q, third))
        return bool(abs(geometry.cross(base, arm)) <= NEXT_TO_NOTHING * abs(base) ** 2)

    def is_nothing(self, node: str, mm: float) -> bool:
        """Return whether a length is zero compared with the size of the figure that a node is in."""
        figure = self.subject.plan.construction.figure_of(node)
        size = float(np.max(np.abs(list(self.subject.nodes(figure).values()))))
        return abs(mm) <= NEXT_TO_NOTHING * size

    def vector(self, tail: str, head: str) -> str:
        """Return the name of the vector between two nodes of a plan."""
        vectors = self.subject.plan.construction.vectors.values()
        return next(vector.name for vector in vectors if (vector.tail, vector.head) == (tail, head))

    def has_letters(self, node: str) -> bool:
        """Return whether the nodes of a node's figure have letters; those of a force plan have none."""
        return not group_of(self.subject.plan.construction.figure_of(node))

    def link_of(self, node: str) -> Name:
        """Return the link of the normal component that ends in a node."""
        vectors = self.subject.plan.construction.vectors.values()
        return next(self.symbol(*vector.link) for vector in vectors if vector.head == node and vector.link)

    def carrier_of(self, node: str) -> str:
        """Return the link that carries the guide of the Coriolis component that ends in a node."""
        vectors = self.subject.plan.construction.vectors.values()
        return next(vector.turning or "" for vector in vectors if vector.head == node)

    def scale_value(self, scale: str) -> float:
        """Return a scale, real units per millimetre."""
        return self.subject.number(getattr(self.subject.plan.scales, scale))

    def line_direction(self, along: Direction) -> Markup:
        """Describe the direction of a line, without a sense."""
        if isinstance(along, Along | Parallel):
            text = PERPENDICULAR if along.quarters % 2 else PARALLEL
            return self.say(text, link=(along.tail, along.head))
        kind, joint = guided(along)
        if kind == "slot":
            return self.say(ACROSS_SLOT if along.quarters % 2 else SLOT, joint=joint)
        return self.say(ACROSS_GUIDE if along.quarters % 2 else GUIDE, joint=joint)

    def vector_direction(self, along: Direction, sign: float) -> Markup:
        """Describe the direction of a vector: a negative length reverses it."""
        if isinstance(along, Parallel):
            vector = self.vector(along.tail, along.head)
            return self.say(OPPOSITE, vector=vector, angle=complex(along.at(self.view)))
        if not isinstance(along, Along):
            angle = complex(along.at(self.view)) * (-1.0 if sign < 0.0 else 1.0)
            kind, joint = guided(along)
            if kind == "guide":
                return self.say(ALONG_GUIDE, joint=joint, angle=angle)
            return self.say(AT_ANGLE, angle=angle)
        turned = sign * side_at(along.side, self.view) < 0.0
        turns = (along.quarters + (2 if turned else 0)) % 4
        ends = (along.head, along.tail) if turns == 2 else (along.tail, along.head)
        text = {0: TOWARDS, 1: TURNED_LEFT, 2: TOWARDS, 3: TURNED_RIGHT}[turns]
        return self.say(text, link=(along.tail, along.head), tail=ends[0], head=ends[1])


def speaker_of(subject: Subject, tongue: Tongue, write: Callable[[Name], Markup] = markup_of) -> Speaker:
    """Return the speaker for a variant's steps."""
    view = subject.view
    nodes = {**view.nodes, **{name: np.asarray(at) for name, at in subject.centres.items()}}
    return Speaker(subject, tongue, View(nodes, view.parameters), write)


def guided(along: Fixed) -> tuple[str, str]:
    """Return guide or slot, and its joint, from the angle's name among the parameters."""
    kind, _, joint = along.angle.removeprefix("angle ").partition(" ")
    return kind, joint


POLE = N_("Mark the pole %(node)s. It is the image of all fixed points: %(fixed)s.")
PIVOT = N_("Mark the fixed joint %(node)s at x = %(x)s, y = %(y)s (real %(real_x)s and %(real_y)s).")
LAY_OFF = N_("From %(start)s lay off %(segment)s = %(length)s, %(direction)s; it ends in %(node)s.")
NOTHING_TO_LAY_OFF = N_("%(name)s is zero here: %(node)s falls on %(start)s.")
CORIOLIS_DIRECTION = N_(
    "perpendicular to the guide: the sliding velocity %(slide)s turned by 90° in the sense of %(rate)s"
)
ON_GUIDE = N_(
    "On the guide of %(node)s lay off %(length)s from the guide's own point, in the direction "
    "%(angle)s: this is %(node)s."
)
TWO_LINES = N_(
    "Through %(first)s draw a line %(first_direction)s, and through %(second)s a line "
    "%(second_direction)s. They meet in %(node)s."
)
TWO_GUIDES = N_("Draw %(first)s and %(second)s. They meet in %(node)s.")
LINE_ON_GUIDE = N_("the guide of %(joint)s")
LINE_OF_JOINTS = N_("the line through %(tail)s and %(head)s")
LINE_THROUGH = N_("the line through %(through)s %(direction)s")
ARC_LEFT = N_(
    "Draw an arc about %(p)s with the radius %(p_radius)s and an arc about %(q)s with the radius "
    "%(q_radius)s. They meet in two points: %(node)s is the one to the left of the line from %(p)s to "
    "%(q)s."
)
ARC_RIGHT = N_(
    "Draw an arc about %(p)s with the radius %(p_radius)s and an arc about %(q)s with the radius "
    "%(q_radius)s. They meet in two points: %(node)s is the one to the right of the line from %(p)s to "
    "%(q)s."
)
ARC_AND_LINE = N_(
    "Draw an arc about %(centre)s with the radius %(radius)s. It meets %(line)s in two points: %(node)s "
    "is the one farther on in the direction %(angle)s."
)
DIVIDE = N_(
    "On the line through %(p)s and %(q)s take %(node)s: %(segment)s = %(ratio)s · %(base)s = "
    "%(length)s, measured from %(p)s."
)
DIVIDE_BACK = N_(
    "On the line through %(p)s and %(q)s take %(node)s on the far side of %(p)s: %(segment)s = "
    "%(ratio)s · %(base)s = %(length)s."
)
SIMILAR = N_(
    "On %(base)s draw the triangle similar to %(model)s, its letters following in the same sense: "
    "%(first)s = %(first_length)s, %(second)s = %(second_length)s. Its third corner is %(node)s."
)
SIMILAR_FLAT = N_(
    "%(node)s divides %(base)s as %(third)s divides %(model)s: %(first)s = %(first_length)s, %(second)s "
    "= %(second_length)s."
)
SIMILAR_TO_NOTHING = N_(
    "%(p)s and %(q)s coincide, and so does %(node)s: the image of a link that does not turn is one point."
)
COINCIDE = N_("Mark %(node)s, the point of link %(link)s that lies under %(other)s at this moment.")
TANGENT = N_(
    "Draw the circle about %(centre)s with the radius %(radius)s and the tangent to it through "
    "%(start)s, which touches it to the right of the way from %(start)s to %(centre)s: it touches in "
    "%(node)s."
)
TANGENT_LEFT = N_(
    "Draw the circle about %(centre)s with the radius %(radius)s and the tangent to it through "
    "%(start)s, which touches it to the left of the way from %(start)s to %(centre)s: it touches in "
    "%(node)s."
)
LOCAL = N_(
    "From %(origin)s go %(x)s in the direction %(x_direction)s, then %(y)s in the direction "
    "%(y_direction)s: this is %(node)s."
)
LOCAL_ON_AXIS = N_("From %(origin)s lay off %(x)s in the direction %(x_direction)s: this is %(node)s.")


def sentence(speaker: Speaker, step: Step) -> Markup:
    """Describe a step; raises ValueError for a kind of step without words."""
    match step:
        case Pole(node=node):
            return speaker.say(
                POLE if speaker.has_letters(node) else START,
                node=node,
                fixed=speaker.names(tuple(speaker.subject.plan.mechanism.ground_m)),
            )
        case Pivot(node=node):
            return _pivot(speaker, node)
        case Given():
            return _given(speaker, step)
        case OnGuide(node=node, length=length, guide=guide):
            mm = _length(speaker, length)
            angle = _direction(speaker, guide) * (1.0 if mm >= 0.0 else -1.0)
            return speaker.say(ON_GUIDE, node=node, length=abs(mm), angle=angle)
        case TwoLines():
            return _two_lines(speaker, step)
        case TwoArcs():
            return _two_arcs(speaker, step)
        case ArcAndLine() | Tangent():
            return _arc(speaker, step)
        case Divide():
            return _divide(speaker, step)
        case Similar():
            return _similar(speaker, step)
        case Coincide(node=node, other=other):
            link, *_ = hinged_at(speaker.subject.plan.mechanism)[node]
            return speaker.say(COINCIDE, node=node, other=other, link=escape(link))
        case Local():
            return _local(speaker, step)
        case _:
            raise ValueError(f"a step with words is expected, not {type(step).__name__}")


START = N_("Mark the point at which the force plan begins.")
LAY_FIRST = N_("From the beginning of the plan lay off %(force)s, %(direction)s.")
LAY_NEXT = N_("From the end of %(other)s lay off %(force)s, %(direction)s.")
LAY_TO_END = N_("Lay off %(force)s, %(direction)s, so that it ends where %(other)s ends.")
LAY_TO_START = N_("Lay off %(force)s, %(direction)s, so that it ends where %(other)s begins.")
ITS_DIRECTION = N_("in its direction")
NO_FORCE = N_("%(name)s is zero here: nothing is laid off.")
MEET = N_(
    "From the end of %(last)s draw a line %(first_direction)s for %(first)s, and from the beginning of the "
    "plan a line %(second_direction)s for %(second)s. Where they meet, %(first)s ends and %(second)s begins."
)
MEET_HERE = N_(
    "From the end of %(last)s draw a line %(first_direction)s for %(first)s, and from the end of %(other)s a "
    "line %(second_direction)s for %(second)s. Both end where they meet."
)
CLOSING = N_("%(name)s closes the polygon.")
INNER = N_("%(name)s runs from the end of %(other)s to the same point.")


def force(speaker: Speaker, step: Given | TwoLines, *, with_numbers: bool = True) -> Markup:
    """Describe a step of a force plan, whose nodes have no letters, by the vectors that it draws."""
    construction = speaker.subject.plan.construction
    whole = construction.vectors_of(construction.figure_of(step.node))
    vectors = [one for one in whole if not one.is_sum]
    ends = {(one.tail, one.head): one.name for one in reversed(vectors)}
    if isinstance(step, Given):
        drawn = {name := ends[step.start, step.node]}
        told = _lay_off(speaker, step, construction.vectors[name], vectors, with_numbers=with_numbers)
    else:
        lines = [line for line in (step.first, step.second) if isinstance(line, Line)]
        drawn = {ends[line.through, step.node] for line in lines}
        first, second = (speaker.line_direction(line.along) for line in lines)
        is_closing = lines[1].through in construction.poles.values()
        told = speaker.say(
            MEET if is_closing else MEET_HERE, other=_ending(lines[1].through, vectors),
            last=_ending(lines[0].through, vectors), first_direction=first, second_direction=second,
            first=ends[lines[0].through, step.node], second=ends[lines[1].through, step.node],
        )  # fmt: skip
    closing = [
        speaker.say(CLOSING, name=one.name)
        for one in vectors
        if one.head == step.node and one.name not in drawn
    ]
    inner = [
        speaker.say(INNER, name=one.name, other=other)
        for one in whole
        if one.is_sum
        and one.head == step.node
        and f"{one.name}_n" not in construction.vectors
        and (other := _ending(one.tail, vectors))
    ]
    return Markup(" ").join((told, *closing, *inner))


def _ending(node: str, vectors: Sequence[Vector]) -> str:
    """Return the first vector of a force plan whose arrow ends in a node; empty if none does."""
    return next((one.name for one in vectors if node == (one.tail if one.reversed else one.head)), "")


def _lay_off(
    speaker: Speaker, step: Given, own: Vector, vectors: Sequence[Vector], *, with_numbers: bool
) -> Markup:
    mm = _length(speaker, step.length)
    if speaker.is_nothing(step.node, mm):
        return speaker.say(NO_FORCE, name=own.name)
    others = [one for one in vectors if one is not own]
    other = _ending(step.start, others)
    text = LAY_FIRST if step.start in speaker.subject.plan.construction.poles.values() else LAY_NEXT
    if own.reversed:
        text = LAY_TO_END if other else LAY_TO_START
        other = other or next(one.name for one in others if step.start == one.head)
    told = Markup("{} = {}").format(speaker.name(own.name), speaker.mm(abs(mm)))
    direction = speaker.say(ITS_DIRECTION)
    if with_numbers or isinstance(step.along, Along):
        direction = speaker.vector_direction(step.along, mm * (-1.0 if own.reversed else 1.0))
    return speaker.say(
        text, force=told if with_numbers else own.name, direction=direction,
        other=other,
    )  # fmt: skip


def _length(speaker: Speaker, length: Length) -> float:
    return float(length.at(speaker.view))


def _direction(speaker: Speaker, line: AnyLine) -> complex:
    return complex(line.along.at(speaker.view))


def _pivot(speaker: Speaker, node: str) -> Markup:
    at, scale = speaker.place(node), speaker.scale_value("kL")
    real_x, real_y = (escape(speaker.real(value * scale, "m")) for value in (at.real, at.imag))
    return speaker.say(PIVOT, node=node, x=at.real, y=at.imag, real_x=real_x, real_y=real_y)


def _given(speaker: Speaker, step: Given) -> Markup:
    if not speaker.has_letters(step.node):
        return force(speaker, step)
    mm = _length(speaker, step.length)
    if speaker.is_nothing(step.node, mm):
        name = speaker.vector(step.start, step.node)
        return speaker.say(NOTHING_TO_LAY_OFF, name=name, node=step.node, start=step.start)
    return speaker.say(
        LAY_OFF, start=step.start, node=step.node, segment=(step.start, step.node), length=abs(mm),
        direction=direction_of(speaker, step),
    )  # fmt: skip


def direction_of(speaker: Speaker, step: Given) -> Markup:
    """Describe the direction of a step's vector."""
    if isinstance(step.length, Coriolis):
        rate = f"omega_{speaker.carrier_of(step.node)}"
        return speaker.say(CORIOLIS_DIRECTION, slide=speaker.vector(*step.length.slide), rate=rate)
    return speaker.vector_direction(step.along, _length(speaker, step.length))


def _two_lines(speaker: Speaker, step: TwoLines) -> Markup:
    if not speaker.has_letters(step.node):
        return force(speaker, step)
    if isinstance(step.first, Line) and isinstance(step.second, Line):
        return speaker.say(
            TWO_LINES, node=step.node, first=step.first.through, second=step.second.through,
            first_direction=speaker.line_direction(step.first.along),
            second_direction=speaker.line_direction(step.second.along),
        )  # fmt: skip
    first, second = (_line(speaker, line) for line in (step.first, step.second))
    return speaker.say(TWO_GUIDES, node=step.node, first=first, second=second)


def _line(speaker: Speaker, line: AnyLine) -> Markup:
    """Describe a line of the sketch."""
    if isinstance(line, FixedLine):
        return speaker.say(LINE_ON_GUIDE, joint=line.guide.removeprefix("guide "))
    if isinstance(line.along, Along) and line.along.tail == line.through:
        return speaker.say(LINE_OF_JOINTS, tail=line.along.tail, head=line.along.head)
    return speaker.say(LINE_THROUGH, through=line.through, direction=speaker.line_direction(line.along))


def _two_arcs(speaker: Speaker, step: TwoArcs) -> Markup:
    p, q = step.centres
    p_radius, q_radius = (
        _radius(speaker, centre, step.node, _length(speaker, radius))
        for centre, radius in zip(step.centres, step.radii, strict=True)
    )
    text = ARC_LEFT if side_at(step.side, speaker.view) > 0 else ARC_RIGHT
    return speaker.say(text, node=step.node, p=p, q=q, p_radius=p_radius, q_radius=q_radius)


def _arc(speaker: Speaker, step: ArcAndLine | Tangent) -> Markup:
    radius = _radius(speaker, step.centre, step.node, abs(_length(speaker, step.radius)))
    if isinstance(step, Tangent):
        way = speaker.place(step.centre) - speaker.place(step.start)
        left = (np.conj(way) * (speaker.place(step.node) - speaker.place(step.start))).imag > 0.0
        text = TANGENT_LEFT if left else TANGENT
        return speaker.say(text, node=step.node, centre=step.centre, radius=radius, start=step.start)
    angle, line = (
        complex(_direction(speaker, step.guide) * side_at(step.side, speaker.view)),
        _line(speaker, step.guide),
    )
    return speaker.say(
        ARC_AND_LINE, node=step.node, centre=step.centre, radius=radius, line=line, angle=angle
    )


def _radius(speaker: Speaker, centre: str, node: str, mm: float) -> Markup:
    return Markup("{} = {}").format(speaker.name(centre, node), speaker.mm(mm))


def _divide(speaker: Speaker, step: Divide) -> Markup:
    p, q = step.base
    ratio = float(speaker.view.parameters[step.ratio])
    return speaker.say(
        DIVIDE if ratio >= 0.0 else DIVIDE_BACK, p=p, q=q, node=step.node, segment=(p, step.node),
        base=step.base, ratio=escape(speaker.tongue.trimmed(abs(ratio), 4)),
        length=speaker.distance(p, step.node),
    )  # fmt: skip


def _similar(speaker: Speaker, step: Similar) -> Markup:
    (p, q), (model_p, model_q, third) = step.base, step.model
    if speaker.is_nothing(p, speaker.distance(p, q)):
        return speaker.say(SIMILAR_TO_NOTHING, p=p, q=q, node=step.node)
    is_flat = speaker.is_flat(*step.model)
    return speaker.say(
        SIMILAR_FLAT if is_flat else SIMILAR, node=step.node, base=step.base, third=third,
        model=(model_p, model_q) if is_flat else step.model,
        first=(p, step.node), first_length=speaker.distance(p, step.node),
        second=(q, step.node), second_length=speaker.distance(q, step.node),
    )  # fmt: skip


def _local(speaker: Speaker, step: Local) -> Markup:
    axis = complex(step.axis.at(speaker.view))
    x, y = _length(speaker, step.x), _length(speaker, step.y)
    text = LOCAL_ON_AXIS if speaker.is_nothing(step.node, y) else LOCAL
    return speaker.say(
        text, origin=step.origin, node=step.node,
        x=abs(x), x_direction=axis * (1.0 if x >= 0.0 else -1.0),
        y=abs(y), y_direction=axis * (1j if y >= 0.0 else -1j),
    )  # fmt: skip


def scaled_names(step: Step) -> Iterator[Scaled]:
    """Yield the lengths of a step that are real data drawn at a scale."""
    match step:
        case (
            Given(length=length) | OnGuide(length=length) | ArcAndLine(radius=length) | Tangent(radius=length)
        ):
            lengths: tuple[Length, ...] = (length,)
        case TwoArcs(radii=radii):
            lengths = radii
        case Local(x=x, y=y):
            lengths = (x, y)
        case _:
            return
    yield from (length for length in lengths if isinstance(length, Scaled))
