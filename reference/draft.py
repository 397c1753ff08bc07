"""A construction while it is being written down: nodes, lines through them, and the vectors along these.

Each condition on a joint (it turns about a pin, it slides on a guide) gives a line of the velocity plan
and one of the acceleration plan; two conditions place its images where their lines meet.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from reference.construction import AngularRate, Vector
from reference.elements import Along, Coriolis, Fixed, FixedLine, Line, Normal
from reference.mechanism import FixedGuide, Guide, Mechanism
from reference.parameters import pair
from reference.steps import Coincide, Divide, Given, Similar, Step, TwoLines

VELOCITY_POLE, ACCELERATION_POLE = "o", "o'"


@dataclass(slots=True)
class Draft:
    """The construction while it is being written down."""

    mechanism: Mechanism
    plate_by_similarity: bool
    sketch: list[Step] = field(default_factory=list)
    velocity: list[Step] = field(default_factory=list)
    acceleration: list[Step] = field(default_factory=list)
    vectors: dict[str, Vector] = field(default_factory=dict)
    rates: dict[str, AngularRate] = field(default_factory=dict)
    images: dict[str, Similar] = field(default_factory=dict)

    def image(self, joint: str, *, primed: bool = False) -> str:
        """The node of a joint in the velocity (or acceleration) plan."""
        if self.mechanism.is_ground(joint):
            return ACCELERATION_POLE if primed else VELOCITY_POLE
        return image_name(joint, primed=primed)

    def relative(self, node: str, pin: str) -> str:
        """The subscript of a vector of `node` about `pin`: B about A is BA, about the ground B."""
        return node if self.mechanism.is_ground(pin) else f"{node}{pin}"

    def vector(self, name: str, tail: str, head: str, **about: object) -> None:
        """Note a vector; `about` are further attributes of `Vector`."""
        scale = "kv" if name.startswith("v") else "ka"
        self.vectors[name] = Vector(name, tail, head, scale, **about)  # type: ignore[arg-type]


def image_name(joint: str, *, primed: bool = False) -> str:
    """The lower-case image of a moving joint, primed in the acceleration plan."""
    return joint.lower() + ("'" if primed else "")


@dataclass(frozen=True, slots=True)
class Lines:
    """One condition on a node: a line of each plan, and the vectors that lie along them.

    `vectors` are names, tails and attributes; their heads are the node's images.
    """

    velocity: Line
    acceleration: Line
    vectors: tuple[tuple[str, str, Mapping[str, object]], ...]


def images_at(draft: Draft, node: str, lines: Sequence[Lines]) -> None:
    """Both images of a node, where the two lines of each plan meet."""
    image, image_primed = draft.image(node), draft.image(node, primed=True)
    first, second = lines
    draft.velocity.append(TwoLines(image, first.velocity, second.velocity))
    draft.acceleration.append(TwoLines(image_primed, first.acceleration, second.acceleration))
    for line in lines:
        for name, tail, about in line.vectors:
            draft.vector(name, tail, image if name.startswith("v") else image_primed, **about)
    absolute(draft, node)


def rotations(draft: Draft, node: str, links: Mapping[str, str]) -> list[Lines]:
    """A node that turns about each pin: across the link, from the pin's image."""
    found = []
    for pin, link in links.items():
        across, about = Along(pin, node, 1), draft.relative(node, pin)
        end = normal_component(draft, node, pin, Normal(draft.image(pin), draft.image(node), pair(pin, node)))
        found.append(turning(draft, (pin, node), end, across))
        rates_of(draft, link, about, (pin, node))
    return found


def turning(draft: Draft, link: tuple[str, str], end: str, across: Along) -> Lines:
    """Across a link from a pin's image, and from the end of the normal component."""
    pin, node = link
    about = draft.relative(node, pin)
    return Lines(
        Line(draft.image(pin), across),
        Line(end, across),
        (
            (f"v_{about}", draft.image(pin), {"link": link}),
            (f"a_{about}_t", end, {"link": link, "part": "t"}),
        ),
    )


def normal_component(draft: Draft, node: str, pin: str, length: Normal) -> str:
    """Lay off a_(node about pin)^n from the pin's image towards the pin; its end."""
    about = draft.relative(node, pin)
    end, start = f"n_{about}", draft.image(pin, primed=True)
    draft.acceleration.append(Given(end, start, length, Along(node, pin)))
    draft.vector(f"a_{about}_n", start, end, link=(pin, node), part="n")
    return end


def guide_line(node: str, guide: Guide) -> Line | FixedLine:
    """A guide on the sketch."""
    if isinstance(guide, FixedGuide):
        return FixedLine(f"guide {node}")
    return Line(guide.base[0], Along(*guide.base))


def slides(draft: Draft, node: str, guides: Sequence[Guide]) -> list[Lines]:
    """A node that slides on guides: along each, from the image of the point under it."""
    found = []
    for guide in guides:
        if isinstance(guide, FixedGuide):
            along = FixedLine(f"guide {node}").along
            found.append(Lines(Line(VELOCITY_POLE, along), Line(ACCELERATION_POLE, along), ()))
            continue
        under, (g, h) = guide.coincident, guide.base
        draft.sketch.append(Coincide(under, node))
        for primed, steps in ((False, draft.velocity), (True, draft.acceleration)):
            ends = (draft.image(g, primed=primed), draft.image(h, primed=primed))
            steps.append(Similar(draft.image(under, primed=primed), ends, (g, h, under)))
        absolute(draft, under)
        turn = (draft.image(g), draft.image(h))
        found.append(sliding(draft, (under, node), Along(g, h), turn, (guide.link, g, h)))
    return found


def sliding(
    draft: Draft, link: tuple[str, str], guide: Along, turn: tuple[str, str], turning: tuple[str, str, str]
) -> Lines:
    """The second joint slides about the first along a turning guide: Coriolis, then along the guide.

    Arguments: `turn`, ends of a velocity that turns the guide's link; `turning`, that link and the two
    joints of it that the velocity belongs to.
    """
    other, node = link
    about, name = f"{node}{other}", turning[0]
    start, end = draft.image(other, primed=True), f"k_{node}{other}"
    length = Coriolis((draft.image(other), draft.image(node)), guide, turn, turning[1:])
    draft.acceleration.append(Given(end, start, length, guide.perpendicular))
    draft.vector(f"a_{about}_c", start, end, link=link, part="c", turning=name)
    return Lines(
        Line(draft.image(other), guide),
        Line(end, guide),
        (
            (f"v_{about}", draft.image(other), {"link": link}),
            (f"a_{about}_r", end, {"link": link, "part": "r"}),
        ),
    )


def in_slot(draft: Draft, node: str, pin: str, slot: Fixed) -> Lines:
    """A yoke's point about the block in its slot: along the slot, which does not turn."""
    image, image_primed = draft.image(pin), draft.image(pin, primed=True)
    link = (pin, node)
    return Lines(
        Line(image, slot),
        Line(image_primed, slot),
        (
            (f"v_{node}{pin}", image, {"link": link}),
            (f"a_{node}{pin}_r", image_primed, {"link": link, "part": "r"}),
        ),
    )


def rigid_images(draft: Draft, node: str, base: tuple[str, str]) -> None:
    """Both images of a link's point by similarity, without relative vectors."""
    note_similar_images(draft, node, base)
    draft.velocity.append(draft.images[draft.image(node)])
    draft.acceleration.append(draft.images[draft.image(node, primed=True)])
    absolute(draft, node)


def note_similar_images(draft: Draft, node: str, base: tuple[str, str]) -> None:
    """The similarity steps of a plate's third point, for both plans."""
    p, q = base
    for primed in (False, True):
        ends = (draft.image(p, primed=primed), draft.image(q, primed=primed))
        image = draft.image(node, primed=primed)
        draft.images[image] = Similar(image, ends, (p, q, node))


def similar_images(draft: Draft, node: str, base: tuple[str, str]) -> None:
    """Both images of a plate's point by similarity, and the velocities about its base."""
    rigid_images(draft, node, base)
    for pin in base:
        if not draft.mechanism.is_ground(pin):
            draft.vector(f"v_{node}{pin}", draft.image(pin), draft.image(node), link=(pin, node))


def images_on_line(draft: Draft, node: str, base: tuple[str, str]) -> None:
    """Both images of a point that divides a link."""
    p, q = base
    for primed, steps in ((False, draft.velocity), (True, draft.acceleration)):
        ends = (draft.image(p, primed=primed), draft.image(q, primed=primed))
        steps.append(Divide(draft.image(node, primed=primed), ends, f"ratio {node}"))
    absolute(draft, node)


def absolute(draft: Draft, node: str) -> None:
    """The velocity and the acceleration of a joint, from the poles."""
    if f"v_{node}" not in draft.vectors:
        draft.vector(f"v_{node}", VELOCITY_POLE, draft.image(node))
    draft.vector(f"a_{node}", ACCELERATION_POLE, draft.image(node, primed=True))


def rates_of(draft: Draft, link: str, about: str, joints: tuple[str, str]) -> None:
    """Omega and epsilon of a link, from the first vector found that turns it."""
    for name, vector in ((f"omega_{link}", f"v_{about}"), (f"epsilon_{link}", f"a_{about}_t")):
        draft.rates.setdefault(name, AngularRate(name, vector, joints, pair(*joints)))
