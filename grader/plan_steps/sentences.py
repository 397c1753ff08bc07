"""A sentence for each kind of step: what is drawn, with its lengths and directions. No mechanism's own."""

from collections.abc import Iterator

import numpy as np
from markupsafe import Markup, escape

from grader.i18n import N_
from grader.plan_steps.words import NEXT_TO_NOTHING, Speaker
from reference import geometry
from reference.elements import Along, AnyLine, Coriolis, FixedLine, Length, Line, Scaled
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


def sentence(speaker: Speaker, step: Step) -> Markup:
    """What a step draws; raises ValueError for a kind of step without words."""
    match step:
        case Pole(node=node):
            return speaker.say(
                POLE, node=node, fixed=speaker.names(tuple(speaker.subject.plan.mechanism.ground_m))
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
            return speaker.say(COINCIDE, node=node, other=other, link=escape(_link_under(speaker, node)))
        case Local():
            return _local(speaker, step)
        case _:
            raise ValueError(f"a step with words is expected, not {type(step).__name__}")


def _length(speaker: Speaker, length: Length) -> float:
    return float(length.at(speaker.view))


def _direction(speaker: Speaker, line: AnyLine) -> complex:
    return complex(line.along.at(speaker.view))


def _pivot(speaker: Speaker, node: str) -> Markup:
    at, scale = speaker.place(node), speaker.scale_value("kL")
    real_x, real_y = (speaker.real(value * scale, "m") for value in (at.real, at.imag))
    return speaker.say(PIVOT, node=node, x=at.real, y=at.imag, real_x=real_x, real_y=real_y)


def _given(speaker: Speaker, step: Given) -> Markup:
    mm = _length(speaker, step.length)
    if speaker.is_nothing(step.node, mm):
        name = speaker.vector(step.start, step.node)
        return speaker.say(NOTHING_TO_LAY_OFF, name=name, node=step.node, start=step.start)
    return speaker.say(
        LAY_OFF, start=step.start, node=step.node, segment=(step.start, step.node), length=abs(mm),
        direction=direction_of(speaker, step),
    )  # fmt: skip


def direction_of(speaker: Speaker, step: Given) -> Markup:
    """Where the vector of a step points."""
    if isinstance(step.length, Coriolis):
        rate = speaker.rate(f"omega_{speaker.carrier_of(step.node)}")
        return speaker.say(CORIOLIS_DIRECTION, slide=speaker.vector(*step.length.slide), rate=rate)
    return speaker.vector_direction(step.along, _length(speaker, step.length))


def _two_lines(speaker: Speaker, step: TwoLines) -> Markup:
    if isinstance(step.first, Line) and isinstance(step.second, Line):
        return speaker.say(
            TWO_LINES, node=step.node, first=step.first.through, second=step.second.through,
            first_direction=speaker.line_direction(step.first.along),
            second_direction=speaker.line_direction(step.second.along),
        )  # fmt: skip
    first, second = (_line(speaker, line) for line in (step.first, step.second))
    return speaker.say(TWO_GUIDES, node=step.node, first=first, second=second)


def _line(speaker: Speaker, line: AnyLine) -> Markup:
    """Which line of the sketch it is."""
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
    text = ARC_LEFT if _side(speaker, step.side) > 0 else ARC_RIGHT
    return speaker.say(text, node=step.node, p=p, q=q, p_radius=p_radius, q_radius=q_radius)


def _arc(speaker: Speaker, step: ArcAndLine | Tangent) -> Markup:
    radius = _radius(speaker, step.centre, step.node, abs(_length(speaker, step.radius)))
    if isinstance(step, Tangent):
        way = speaker.place(step.centre) - speaker.place(step.start)
        left = (np.conj(way) * (speaker.place(step.node) - speaker.place(step.start))).imag > 0.0
        text = TANGENT_LEFT if left else TANGENT
        return speaker.say(text, node=step.node, centre=step.centre, radius=radius, start=step.start)
    angle, line = _direction(speaker, step.guide) * _side(speaker, step.side), _line(speaker, step.guide)
    return speaker.say(
        ARC_AND_LINE, node=step.node, centre=step.centre, radius=radius, line=line, angle=angle
    )


def _radius(speaker: Speaker, centre: str, node: str, mm: float) -> Markup:
    return Markup("{} = {}").format(speaker.name(centre, node), speaker.mm(mm))


def _side(speaker: Speaker, side: object) -> float:
    """The variant's own side of a group."""
    return speaker.subject.one(np.asarray(side, dtype=np.float64))


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
    base, arm = (speaker.place(corner) - speaker.place(model_p) for corner in (model_q, third))
    is_flat = abs(geometry.cross(np.asarray(base), np.asarray(arm))) <= NEXT_TO_NOTHING * abs(base) ** 2
    return speaker.say(
        SIMILAR_FLAT if is_flat else SIMILAR, node=step.node, base=step.base, third=third,
        model=(model_p, model_q) if is_flat else step.model,
        first=(p, step.node), first_length=speaker.distance(p, step.node),
        second=(q, step.node), second_length=speaker.distance(q, step.node),
    )  # fmt: skip


def _link_under(speaker: Speaker, node: str) -> str:
    """The link of a point that lies under another only at this moment."""
    groups = speaker.subject.plan.mechanism.groups
    links = {group.node: group.link for group in groups if isinstance(group, SlottedLink)}
    links |= {guide.coincident: guide.link for group in groups for guide in moving_guides(group)}
    return links[node]


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
