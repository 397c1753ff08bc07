"""A sentence for each kind of step: what is drawn, with its lengths and directions. No mechanism's own."""

from collections.abc import Iterator

import numpy as np
from markupsafe import Markup

from grader.i18n import N_
from grader.plan_steps.words import Speaker
from reference import geometry
from reference.elements import AnyLine, Coriolis, FixedLine, Length, Line, Scaled
from reference.mechanism import SlottedLink, moving_guides
from reference.steps import (
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
NEXT_TO_NOTHING = 1e-9
"""Of a figure's size: shorter lengths are told as zero; triangles flatter than this as lines."""


def sentence(speaker: Speaker, step: Step) -> Markup:
    """What a step draws; raises ValueError for a kind of step without words."""
    match step:
        case Pole(node=node):
            fixed = tuple(speaker.subject.plan.mechanism.ground_m)
            return speaker.say(POLE, node=speaker.name(node), fixed=speaker.names(fixed))
        case Pivot(node=node):
            return _pivot(speaker, node)
        case Given():
            return _given(speaker, step)
        case OnGuide(node=node, length=length, guide=guide):
            mm, along = _length(speaker, length), _direction(speaker, guide)
            return speaker.say(
                ON_GUIDE, node=speaker.name(node), length=speaker.mm(abs(mm)),
                angle=speaker.degrees(along * (1.0 if mm >= 0.0 else -1.0)),
            )  # fmt: skip
        case TwoLines():
            return _two_lines(speaker, step)
        case TwoArcs() | ArcAndLine() | Tangent():
            return _arcs(speaker, step)
        case Divide():
            return _divide(speaker, step)
        case Similar():
            return _similar(speaker, step)
        case Coincide(node=node, other=other):
            link = _link_under(speaker, node)
            return speaker.say(COINCIDE, node=speaker.name(node), other=speaker.name(other), link=link)
        case Local():
            return _local(speaker, step)
        case _:
            raise ValueError(f"a step with words is expected, not {type(step).__name__}")


def place(speaker: Speaker, node: str) -> complex:
    """Where a node is, complex millimetres."""
    return complex(speaker.view.nodes[node])


def distance(speaker: Speaker, p: str, q: str) -> float:
    """The drawn distance of two nodes, mm."""
    return abs(place(speaker, q) - place(speaker, p))


def _length(speaker: Speaker, length: Length) -> float:
    return float(length.at(speaker.view))


def _direction(speaker: Speaker, line: AnyLine) -> complex:
    return complex(line.along.at(speaker.view))


def _pivot(speaker: Speaker, node: str) -> Markup:
    at, scale = place(speaker, node), speaker.scale_value("kL")
    return speaker.say(
        PIVOT, node=speaker.name(node), x=speaker.mm(at.real), y=speaker.mm(at.imag),
        real_x=speaker.real(at.real * scale, "m"), real_y=speaker.real(at.imag * scale, "m"),
    )  # fmt: skip


def _given(speaker: Speaker, step: Given) -> Markup:
    start, node = speaker.name(step.start), speaker.name(step.node)
    mm = _length(speaker, step.length)
    if is_nothing(speaker, step.node, mm):
        return speaker.say(NOTHING_TO_LAY_OFF, name=named_vector(speaker, step), node=node, start=start)
    return speaker.say(
        LAY_OFF, start=start, node=node, segment=speaker.name(step.start, step.node),
        length=speaker.mm(abs(mm)), direction=direction_told(speaker, step),
    )  # fmt: skip


def direction_told(speaker: Speaker, step: Given) -> Markup:
    """Where the vector of a step points."""
    if isinstance(step.length, Coriolis):
        slide = named(speaker, *step.length.slide)
        rate = speaker.rate(f"omega_{coriolis_link(speaker, step)}")
        return speaker.say(CORIOLIS_DIRECTION, slide=slide, rate=rate)
    return speaker.vector_direction(step.along, _length(speaker, step.length))


def is_nothing(speaker: Speaker, node: str, mm: float) -> bool:
    """Whether a length is zero against its figure's size."""
    figure = speaker.subject.plan.construction.figure_of(node)
    size = float(np.max(np.abs(list(speaker.subject.nodes(figure).values()))))
    return abs(mm) <= NEXT_TO_NOTHING * size


def named_vector(speaker: Speaker, step: Given) -> Markup:
    """The vector that a step lays off."""
    return named(speaker, step.start, step.node)


def named(speaker: Speaker, tail: str, head: str) -> Markup:
    """The vector between two nodes of a plan."""
    vectors = speaker.subject.plan.construction.vectors.values()
    return next(speaker.name(one.name) for one in vectors if (one.tail, one.head) == (tail, head))


def link_of(speaker: Speaker, step: Given) -> Markup:
    """The link of a normal component."""
    vectors = speaker.subject.plan.construction.vectors.values()
    return next(speaker.name(*vector.link) for vector in vectors if vector.head == step.node and vector.link)


def coriolis_link(speaker: Speaker, step: Given) -> str:
    """The link that carries the guide of a Coriolis component."""
    vectors = speaker.subject.plan.construction.vectors.values()
    return next(vector.turning or "" for vector in vectors if vector.head == step.node)


def _two_lines(speaker: Speaker, step: TwoLines) -> Markup:
    node = speaker.name(step.node)
    if isinstance(step.first, Line) and isinstance(step.second, Line):
        return speaker.say(
            TWO_LINES, node=node,
            first=speaker.name(step.first.through), second=speaker.name(step.second.through),
            first_direction=speaker.line_direction(step.first.along),
            second_direction=speaker.line_direction(step.second.along),
        )  # fmt: skip
    return speaker.say(
        TWO_GUIDES, node=node, first=_line(speaker, step.first), second=_line(speaker, step.second)
    )


def _line(speaker: Speaker, line: AnyLine) -> Markup:
    """Which line of the sketch it is."""
    if isinstance(line, FixedLine):
        return speaker.say(LINE_ON_GUIDE, joint=speaker.name(line.guide.removeprefix("guide ")))
    along = line.along
    tail, head = getattr(along, "tail", None), getattr(along, "head", None)
    if tail == line.through and head is not None:
        return speaker.say(LINE_OF_JOINTS, tail=speaker.name(tail), head=speaker.name(head))
    return speaker.say(
        LINE_THROUGH, through=speaker.name(line.through), direction=speaker.line_direction(along)
    )


def _arcs(speaker: Speaker, step: TwoArcs | ArcAndLine | Tangent) -> Markup:
    node = speaker.name(step.node)
    if isinstance(step, TwoArcs):
        p, q = step.centres
        p_mm, q_mm = (_length(speaker, radius) for radius in step.radii)
        return speaker.say(
            ARC_LEFT if side_of(speaker, step.side) > 0 else ARC_RIGHT,
            node=node, p=speaker.name(p), q=speaker.name(q),
            p_radius=_radius(speaker, p, step.node, p_mm), q_radius=_radius(speaker, q, step.node, q_mm),
        )  # fmt: skip
    mm = abs(_length(speaker, step.radius))
    radius = _radius(speaker, step.centre, step.node, mm)
    if isinstance(step, Tangent):
        way = place(speaker, step.centre) - place(speaker, step.start)
        left = (np.conj(way) * (place(speaker, step.node) - place(speaker, step.start))).imag > 0.0
        return speaker.say(
            TANGENT_LEFT if left else TANGENT, node=node, centre=speaker.name(step.centre),
            radius=radius, start=speaker.name(step.start),
        )  # fmt: skip
    ahead = _direction(speaker, step.guide) * side_of(speaker, step.side)
    return speaker.say(
        ARC_AND_LINE, node=node, centre=speaker.name(step.centre), radius=radius,
        line=_line(speaker, step.guide), angle=speaker.degrees(ahead),
    )  # fmt: skip


def _radius(speaker: Speaker, centre: str, node: str, mm: float) -> Markup:
    return Markup("{} = {}").format(speaker.name(centre, node), speaker.mm(mm))


def side_of(speaker: Speaker, side: object) -> float:
    """The variant's own side of a group."""
    return speaker.subject.one(np.asarray(side, dtype=np.float64))


def _divide(speaker: Speaker, step: Divide) -> Markup:
    p, q = step.base
    ratio = float(speaker.view.parameters[step.ratio])
    return speaker.say(
        DIVIDE if ratio >= 0.0 else DIVIDE_BACK,
        p=speaker.name(p), q=speaker.name(q), node=speaker.name(step.node),
        segment=speaker.name(p, step.node), base=speaker.name(p, q),
        ratio=speaker.tongue.trimmed(abs(ratio), 4), length=speaker.mm(distance(speaker, p, step.node)),
    )  # fmt: skip


def _similar(speaker: Speaker, step: Similar) -> Markup:
    (p, q), (model_p, model_q, third) = step.base, step.model
    node = speaker.name(step.node)
    if is_nothing(speaker, p, distance(speaker, p, q)):
        return speaker.say(SIMILAR_TO_NOTHING, p=speaker.name(p), q=speaker.name(q), node=node)
    base, arm = (place(speaker, corner) - place(speaker, model_p) for corner in (model_q, third))
    flat = abs(geometry.cross(np.asarray(base), np.asarray(arm))) <= NEXT_TO_NOTHING * abs(base) ** 2
    lengths = {
        "first": speaker.name(p, step.node), "first_length": speaker.mm(distance(speaker, p, step.node)),
        "second": speaker.name(q, step.node), "second_length": speaker.mm(distance(speaker, q, step.node)),
    }  # fmt: skip
    if flat:
        return speaker.say(
            SIMILAR_FLAT, node=node, base=speaker.name(p, q), third=speaker.name(third),
            model=speaker.name(model_p, model_q), **lengths,
        )  # fmt: skip
    return speaker.say(
        SIMILAR,
        node=node,
        base=speaker.name(p, q),
        model=speaker.name(model_p, model_q, third),
        **lengths,
    )


def _link_under(speaker: Speaker, node: str) -> str:
    """The link of a point that lies under another only at this moment."""
    groups = speaker.subject.plan.mechanism.groups
    links = {group.node: group.link for group in groups if isinstance(group, SlottedLink)}
    links |= {guide.coincident: guide.link for group in groups for guide in moving_guides(group)}
    return links[node]


def _local(speaker: Speaker, step: Local) -> Markup:
    axis = complex(step.axis.at(speaker.view))
    x, y = _length(speaker, step.x), _length(speaker, step.y)
    text = LOCAL_ON_AXIS if is_nothing(speaker, step.node, y) else LOCAL
    return speaker.say(
        text, origin=speaker.name(step.origin), node=speaker.name(step.node),
        x=speaker.mm(abs(x)), x_direction=speaker.degrees(axis * (1.0 if x >= 0.0 else -1.0)),
        y=speaker.mm(abs(y)), y_direction=speaker.degrees(axis * (1j if y >= 0.0 else -1j)),
    )  # fmt: skip


def scaled_names(step: Step) -> Iterator[Scaled]:
    """The lengths of a step that are real data drawn at a scale."""
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
