"""A sentence for each kind of step: what is drawn, with its lengths and directions. No mechanism's own."""

from collections.abc import Iterator

import numpy as np
from markupsafe import Markup

from grader.plan_steps import texts
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

NEXT_TO_NOTHING = 1e-9
"""Of a figure's size: shorter lengths are told as zero; triangles flatter than this as lines."""


def sentence(speaker: Speaker, step: Step) -> Markup:
    """What a step draws; raises ValueError for a kind of step without words."""
    match step:
        case Pole(node=node):
            fixed = tuple(speaker.subject.plan.mechanism.ground_m)
            return speaker.say(texts.POLE, node=speaker.name(node), fixed=speaker.names(fixed))
        case Pivot(node=node):
            return _pivot(speaker, node)
        case Given():
            return _given(speaker, step)
        case OnGuide(node=node, length=length, guide=guide):
            mm, along = _length(speaker, length), _direction(speaker, guide)
            return speaker.say(
                texts.ON_GUIDE, node=speaker.name(node), length=speaker.mm(abs(mm)),
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
            return speaker.say(texts.COINCIDE, node=speaker.name(node), other=speaker.name(other), link=link)
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
        texts.PIVOT, node=speaker.name(node), x=speaker.mm(at.real), y=speaker.mm(at.imag),
        real_x=speaker.real(at.real * scale, "m"), real_y=speaker.real(at.imag * scale, "m"),
    )  # fmt: skip


def _given(speaker: Speaker, step: Given) -> Markup:
    start, node = speaker.name(step.start), speaker.name(step.node)
    mm = _length(speaker, step.length)
    if is_nothing(speaker, step.node, mm):
        return speaker.say(texts.NOTHING_TO_LAY_OFF, name=named_vector(speaker, step), node=node, start=start)
    return speaker.say(
        texts.LAY_OFF, start=start, node=node, segment=speaker.name(step.start, step.node),
        length=speaker.mm(abs(mm)), direction=direction_told(speaker, step),
    )  # fmt: skip


def direction_told(speaker: Speaker, step: Given) -> Markup:
    """Where the vector of a step points."""
    if isinstance(step.length, Coriolis):
        slide = named(speaker, *step.length.slide)
        rate = speaker.rate(f"omega_{coriolis_link(speaker, step)}")
        return speaker.say(texts.CORIOLIS_DIRECTION, slide=slide, rate=rate)
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
            texts.TWO_LINES, node=node,
            first=speaker.name(step.first.through), second=speaker.name(step.second.through),
            first_direction=speaker.line_direction(step.first.along),
            second_direction=speaker.line_direction(step.second.along),
        )  # fmt: skip
    return speaker.say(
        texts.TWO_GUIDES, node=node, first=_line(speaker, step.first), second=_line(speaker, step.second)
    )


def _line(speaker: Speaker, line: AnyLine) -> Markup:
    """Which line of the sketch it is."""
    if isinstance(line, FixedLine):
        return speaker.say(texts.LINE_ON_GUIDE, joint=speaker.name(line.guide.removeprefix("guide ")))
    along = line.along
    tail, head = getattr(along, "tail", None), getattr(along, "head", None)
    if tail == line.through and head is not None:
        return speaker.say(texts.LINE_OF_JOINTS, tail=speaker.name(tail), head=speaker.name(head))
    return speaker.say(
        texts.LINE_THROUGH, through=speaker.name(line.through), direction=speaker.line_direction(along)
    )


def _arcs(speaker: Speaker, step: TwoArcs | ArcAndLine | Tangent) -> Markup:
    node = speaker.name(step.node)
    if isinstance(step, TwoArcs):
        p, q = step.centres
        p_mm, q_mm = (_length(speaker, radius) for radius in step.radii)
        return speaker.say(
            texts.ARC_LEFT if side_of(speaker, step.side) > 0 else texts.ARC_RIGHT,
            node=node, p=speaker.name(p), q=speaker.name(q),
            p_radius=_radius(speaker, p, step.node, p_mm), q_radius=_radius(speaker, q, step.node, q_mm),
        )  # fmt: skip
    mm = abs(_length(speaker, step.radius))
    radius = _radius(speaker, step.centre, step.node, mm)
    if isinstance(step, Tangent):
        way = place(speaker, step.centre) - place(speaker, step.start)
        left = (np.conj(way) * (place(speaker, step.node) - place(speaker, step.start))).imag > 0.0
        return speaker.say(
            texts.TANGENT_LEFT if left else texts.TANGENT, node=node, centre=speaker.name(step.centre),
            radius=radius, start=speaker.name(step.start),
        )  # fmt: skip
    ahead = _direction(speaker, step.guide) * side_of(speaker, step.side)
    return speaker.say(
        texts.ARC_AND_LINE, node=node, centre=speaker.name(step.centre), radius=radius,
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
        texts.DIVIDE if ratio >= 0.0 else texts.DIVIDE_BACK,
        p=speaker.name(p), q=speaker.name(q), node=speaker.name(step.node),
        segment=speaker.name(p, step.node), base=speaker.name(p, q),
        ratio=speaker.tongue.trimmed(abs(ratio), 4), length=speaker.mm(distance(speaker, p, step.node)),
    )  # fmt: skip


def _similar(speaker: Speaker, step: Similar) -> Markup:
    (p, q), (model_p, model_q, third) = step.base, step.model
    node = speaker.name(step.node)
    if is_nothing(speaker, p, distance(speaker, p, q)):
        return speaker.say(texts.SIMILAR_TO_NOTHING, p=speaker.name(p), q=speaker.name(q), node=node)
    base, arm = (place(speaker, corner) - place(speaker, model_p) for corner in (model_q, third))
    flat = abs(geometry.cross(np.asarray(base), np.asarray(arm))) <= NEXT_TO_NOTHING * abs(base) ** 2
    lengths = {
        "first": speaker.name(p, step.node), "first_length": speaker.mm(distance(speaker, p, step.node)),
        "second": speaker.name(q, step.node), "second_length": speaker.mm(distance(speaker, q, step.node)),
    }  # fmt: skip
    if flat:
        return speaker.say(
            texts.SIMILAR_FLAT, node=node, base=speaker.name(p, q), third=speaker.name(third),
            model=speaker.name(model_p, model_q), **lengths,
        )  # fmt: skip
    return speaker.say(
        texts.SIMILAR,
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
    text = texts.LOCAL_ON_AXIS if is_nothing(speaker, step.node, y) else texts.LOCAL
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
