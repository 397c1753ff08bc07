"""A construction while it is written down: conditions on joints, and the lines that they give.

Each condition on a joint (it turns about a pin, it slides on a guide) gives a line of the velocity plan
and one of the acceleration plan; two conditions place the joint's images where their lines meet.

Node names: a joint's image is its letter in lower case (``B`` -> ``b``, ``b'`` in the acceleration
plan), ground joints have the pole for their image, a normal component a_BA_n ends in ``n_BA``, a
Coriolis component a_B3B_c in ``k_B3B``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from reference.construction.elements import Along, Coriolis, Fixed, FixedLine, Line, Normal
from reference.construction.graph import AngularRate, Part, Vector, pair
from reference.construction.steps import Coincide, Given, Similar, Step, TwoLines
from reference.mechanism import FixedGuide, Guide, Mechanism

VELOCITY_POLE, ACCELERATION_POLE = "o", "o'"
"""Names of the plans' poles."""


@dataclass(slots=True)
class Draft:
    """A construction while it is being written down."""

    mechanism: Mechanism
    plate_by_similarity: bool
    sketch: list[Step] = field(default_factory=list)
    velocity: list[Step] = field(default_factory=list)
    acceleration: list[Step] = field(default_factory=list)
    vectors: dict[str, Vector] = field(default_factory=dict)
    rates: dict[str, AngularRate] = field(default_factory=dict)
    images: dict[str, Similar] = field(default_factory=dict)

    def image(self, joint: str, *, primed: bool = False) -> str:
        """Return the node of a joint in the velocity (or acceleration) plan."""
        if self.mechanism.is_ground(joint):
            return ACCELERATION_POLE if primed else VELOCITY_POLE
        return image_name(joint, primed=primed)

    def images_of(self, base: tuple[str, str], *, primed: bool) -> tuple[str, str]:
        """Return the nodes of two joints in that plan."""
        return self.image(base[0], primed=primed), self.image(base[1], primed=primed)

    def add_images(self, velocity: Step, acceleration: Step) -> None:
        """Add a step to each plan."""
        self.velocity.append(velocity)
        self.acceleration.append(acceleration)

    def relative(self, node: str, pin: str) -> str:
        """Return the subscript of a vector of `node` relative to `pin`: BA relative to A, B to the ground."""
        return node if self.mechanism.is_ground(pin) else f"{node}{pin}"

    def vector(
        self,
        name: str,
        tail: str,
        head: str,
        link: tuple[str, str] | None = None,
        part: Part = "",
        turning: str | None = None,
    ) -> None:
        """Add a vector, see `Vector`."""
        scale = "kv" if name.startswith("v") else "ka"
        self.vectors[name] = Vector(name, tail, head, scale, link, part, turning)


def image_name(joint: str, *, primed: bool = False) -> str:
    """Return the lower-case image of a moving joint, primed in the acceleration plan."""
    return joint.lower() + ("'" if primed else "")


# Conditions on a joint ----------------------------------------------------------------------------

Condition = tuple[Line, Line]
"""A line of the velocity plan and one of the acceleration plan, on which the joint's images lie."""


def images_at(draft: Draft, node: str, conditions: Sequence[Condition]) -> None:
    """Add both images of a node, at the intersection of the two lines of each plan."""
    velocity_lines, acceleration_lines = zip(*conditions, strict=True)
    draft.add_images(
        TwoLines(draft.image(node), *velocity_lines),
        TwoLines(draft.image(node, primed=True), *acceleration_lines),
    )
    absolute(draft, node)


def rotations(draft: Draft, node: str, links: Mapping[str, str]) -> list[Condition]:
    """Add a node that turns about each pin: across the link, from the pin's image."""
    conditions = []
    for pin, link in links.items():
        length = Normal(draft.image(pin), draft.image(node), pair(pin, node))
        conditions.append(turning(draft, (pin, node), length))
        rates_of(draft, link, draft.relative(node, pin), (pin, node))
    return conditions


def turning(draft: Draft, link: tuple[str, str], length: Normal) -> Condition:
    """Return the lines across a link: from a pin's image, and from the end of its normal component."""
    pin, node = link
    about, across = draft.relative(node, pin), Along(pin, node, 1)
    start, end = draft.image(pin, primed=True), f"n_{about}"
    draft.acceleration.append(Given(end, start, length, Along(node, pin)))
    draft.vector(f"a_{about}_n", start, end, link, "n")
    draft.vector(f"a_{about}_t", end, draft.image(node, primed=True), link, "t")
    relative(draft, link)
    return Line(draft.image(pin), across), Line(end, across)


def relative(draft: Draft, link: tuple[str, str]) -> None:
    """Add velocity and full acceleration of a joint relative to another: v_BA, a_BA; v_B to the ground."""
    pin, node = link
    about = draft.relative(node, pin)
    draft.vector(f"v_{about}", draft.image(pin), draft.image(node), link)
    if not draft.mechanism.is_ground(pin):
        draft.vector(f"a_{about}", draft.image(pin, primed=True), draft.image(node, primed=True), link)


def slides(draft: Draft, node: str, guides: Sequence[Guide], at: str = "") -> list[Condition]:
    """Add a node that slides on guides: along each, from the image of the point under it.

    Arguments: `at`, the joint with which the node itself coincides.
    """
    conditions = []
    for guide in guides:
        if isinstance(guide, FixedGuide):
            along = FixedLine(f"guide {node}").along
            conditions.append((Line(VELOCITY_POLE, along), Line(ACCELERATION_POLE, along)))
            continue
        under, (g, h) = guide.coincident, guide.base
        draft.sketch.append(Coincide(under, at or node))
        draft.add_images(*similar_images(draft, under, (g, h)))
        absolute(draft, under)
        turn = (draft.image(g), draft.image(h))
        conditions.append(sliding(draft, (under, node), Along(g, h), turn, (guide.link, g, h)))
    return conditions


def sliding(
    draft: Draft, link: tuple[str, str], guide: Along, turn: tuple[str, str], turning_: tuple[str, str, str]
) -> Condition:
    """Return the lines of a joint that slides along a turning guide: Coriolis, then along the guide.

    Arguments: `turn`, ends of a velocity that turns the guide's link; `turning_`, that link and the two
    joints of it that the velocity belongs to.
    """
    other, node = link
    about, name = draft.relative(node, other), turning_[0]
    start, end = draft.image(other, primed=True), f"k_{node}{other}"
    length = Coriolis((draft.image(other), draft.image(node)), guide, turn, turning_[1:])
    draft.acceleration.append(Given(end, start, length, replace(guide, quarters=guide.quarters + 1)))
    draft.vector(f"a_{about}_c", start, end, link, "c", name)
    draft.vector(f"a_{about}_r", end, draft.image(node, primed=True), link, "r")
    relative(draft, link)
    return Line(draft.image(other), guide), Line(end, guide)


def in_slot(draft: Draft, node: str, pin: str, slot: Fixed) -> Condition:
    """Return the lines of a yoke's point relative to the block: along the slot, which does not turn."""
    image, image_primed = draft.image(pin), draft.image(pin, primed=True)
    draft.vector(f"v_{node}{pin}", image, draft.image(node), (pin, node))
    draft.vector(f"a_{node}{pin}_r", image_primed, draft.image(node, primed=True), (pin, node), "r")
    return Line(image, slot), Line(image_primed, slot)


# Points of links ----------------------------------------------------------------------------------


def guide_line(node: str, guide: Guide) -> Line | FixedLine:
    """Return a guide on the sketch."""
    if isinstance(guide, FixedGuide):
        return FixedLine(f"guide {node}")
    return Line(guide.base[0], Along(*guide.base))


def similar_images(draft: Draft, node: str, base: tuple[str, str]) -> tuple[Similar, Similar]:
    """Return the similarity steps of a link's third point, for both plans."""
    velocity, acceleration = (
        Similar(draft.image(node, primed=primed), draft.images_of(base, primed=primed), (*base, node))
        for primed in (False, True)
    )
    return velocity, acceleration


def note_similar_images(draft: Draft, node: str, base: tuple[str, str]) -> None:
    """Record how both images of a plate's third point would be found by similarity."""
    draft.images.update({step.node: step for step in similar_images(draft, node, base)})


def rigid_images(draft: Draft, node: str, base: tuple[str, str]) -> None:
    """Add both images of a link's point by similarity, without relative vectors."""
    note_similar_images(draft, node, base)
    draft.add_images(*similar_images(draft, node, base))
    absolute(draft, node)


def absolute(draft: Draft, node: str) -> None:
    """Add the velocity and the acceleration of a joint, from the poles."""
    if f"v_{node}" not in draft.vectors:
        draft.vector(f"v_{node}", VELOCITY_POLE, draft.image(node))
    draft.vector(f"a_{node}", ACCELERATION_POLE, draft.image(node, primed=True))


def rates_of(draft: Draft, link: str, about: str, joints: tuple[str, str], *, drives: bool = False) -> None:
    """Add omega and epsilon of a link, from the first vector that turns it."""
    for name, vector in ((f"omega_{link}", f"v_{about}"), (f"epsilon_{link}", f"a_{about}_t")):
        draft.rates.setdefault(name, AngularRate(name, vector, joints, pair(*joints), drives))
