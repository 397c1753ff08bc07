"""Random mechanisms of all groups in any order: the joints' places first, lengths and sides read off them."""

from dataclasses import dataclass, field, replace

import numpy as np
from hypothesis import strategies as st

from reference.mechanism import (
    Body,
    Crank,
    CrossSlider,
    DrivingSlider,
    Dyad,
    FixedGuide,
    Load,
    Mechanism,
    MovingGuide,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Triad,
    Yoke,
    hinged_at,
    moving_guides,
    points_of,
    sliders_of,
)

KINDS = (
    "RRR", "RRP", "RRP on a link", "RPR", "RPR with offset", "PRP", "PRP on two links", "RPP",
    "RPP on a link", "plate", "point on line", "slot point", "triad",
)  # fmt: skip
LEAST_TRIAD = 0.1
"""Least determinant of a triad, 1 at best, in place of such a sine."""
LEAST_SINE = 0.25
"""Least sine of the angle that a group's accuracy depends on; other tests go nearer to singularities."""
LEAST_SPAN, FARTHEST = 0.2, 6.0
TRIES = 60
NAMES = "ABCDEFGHIJKLMPQRSTUVW"
TRIAD_NAMES = ("KLM", "PQR", "TUV", "XYZ", ("NK", "NL", "NM"), ("NP", "NQ", "NR"), ("NT", "NU", "NV"))
"""Two corners of the ternary link, and the Assur point."""


def array(value):
    return np.array([value])


def cross(u: complex, v: complex) -> float:
    return (u.conjugate() * v).imag


def turn_to(angle: float) -> complex:
    return complex(np.cos(angle), np.sin(angle))


def sign_of(number: float) -> int:
    return 1 if number > 0 else -1


@dataclass
class Sketch:
    """A mechanism while it is being drawn: where its joints are, and which link carries which of them.

    `least_sine` bounds how near to a singular position each group may be; below `LEAST_SINE` its sine
    is drawn with an even logarithm, so that every order of nearness is met.
    """

    lot: np.random.Generator
    least_sine: float = LEAST_SINE
    ground: dict[str, complex] = field(default_factory=dict)
    at: dict[str, complex] = field(default_factory=dict)
    """Joints that may carry further groups: not those that coincide with another for an instant."""
    links: dict[str, list[str]] = field(default_factory=dict)
    slots: list[tuple[SlottedLink, complex]] = field(default_factory=list)
    groups: list = field(default_factory=list)

    def number(self, low: float, high: float) -> float:
        return float(self.lot.uniform(low, high))

    def sign(self) -> int:
        return int(self.lot.choice([-1, 1]))

    def choose(self, things):
        things = list(things)
        return things[int(self.lot.integers(len(things)))] if things else None

    def sine(self) -> float:
        if self.least_sine >= LEAST_SINE:
            return self.number(self.least_sine, 1.0)
        return float(10.0 ** self.number(np.log10(self.least_sine), 0.0))

    def near(self, place: complex) -> complex:
        """A place at a link's length from another."""
        return place + self.number(0.3, 1.5) * turn_to(self.number(-np.pi, np.pi))

    def node(self) -> str:
        return NAMES[len([group for group in self.groups if group.node[0] in NAMES]) + 1]

    def link(self) -> str:
        return str(len(self.links) + 1)

    def pivot(self, place: complex) -> str:
        name = f"O{len(self.ground) + 1}"
        self.ground[name] = self.at[name] = place
        return name

    def moving(self) -> str:
        return self.choose(joint for joint in self.at if joint not in self.ground)

    def partner(self, of: str) -> str | None:
        """A joint far enough from another, or a new pivot on the ground."""
        if self.number(0, 1) < 0.4:
            return self.pivot(self.near(self.at[of]))
        return self.choose(j for j in self.at if j != of and abs(self.at[j] - self.at[of]) > LEAST_SPAN)

    def base(self, but: str = "") -> tuple[str, str, str] | None:
        """A link and two of its joints, none of them `but`."""
        found = [
            (link, p, q)
            for link, joints in self.links.items()
            for p in joints
            for q in joints
            if p != q and but not in joints and abs(self.at[p] - self.at[q]) > LEAST_SPAN
        ]
        return self.choose(found)

    def add(self, group, place: complex, links: dict[str, list[str]]) -> bool:
        """Keep a group if it is within bounds."""
        if abs(place) > FARTHEST:
            return False
        self.groups.append(group)
        if not isinstance(group, SlottedLink) and not getattr(group, "link", "").startswith("Y"):
            self.at[group.node] = place
        for link, joints in links.items():
            self.links.setdefault(link, []).extend(joints)
        return True

    def fixed_guide(self, place: complex, along: complex) -> FixedGuide:
        return FixedGuide(array(place + self.number(-2, 2) * along), array(float(np.angle(along))))

    def moving_guide(self, but: str = "") -> tuple[MovingGuide, complex, complex] | None:
        """A guide on a link, a point of it and its direction."""
        found = self.base(but)
        if found is None:
            return None
        link, p, q = found
        along = (self.at[q] - self.at[p]) / abs(self.at[q] - self.at[p])
        return MovingGuide(link, (p, q), f"{self.node()}{link}"), self.at[p], along

    # A way to add each kind of group; False where this lot does not give one.

    def rrr(self) -> bool:
        p = self.moving()
        q = self.partner(p)
        if q is None:
            return False
        z = complex(self.number(-0.8, 1.8), self.sign() * self.sine() * 1.5)
        if min(abs(z), abs(z - 1)) < LEAST_SPAN:
            return False
        start, base = self.at[p], self.at[q] - self.at[p]
        if self.least_sine >= LEAST_SINE and abs(z.imag) < LEAST_SINE * abs(z) * abs(z - 1):
            return False
        place = start + base * z
        first = self.link()
        second = str(int(first) + 1)
        lengths = (array(abs(base * z)), array(abs(base * (z - 1))))
        group = Dyad(self.node(), (p, q), (first, second), lengths, sign_of(z.imag))
        return self.add(group, place, {first: [p, group.node], second: [q, group.node]})

    def rrp(self) -> bool:
        pin = self.moving()
        place, sine = self.near(self.at[pin]), self.sine()
        rod = place - self.at[pin]
        along = rod / abs(rod) * complex(self.sign() * sine, self.sign() * np.sqrt(1 - sine * sine))
        guide = self.fixed_guide(place, along)
        return self.slider(pin, place, guide, along)

    def rrp_on_a_link(self) -> bool:
        pin = self.moving()
        found = self.moving_guide(but=pin)
        if found is None:
            return False
        guide, foot, along = found
        height, sine = cross(along, self.at[pin] - foot), self.sine()
        if abs(height) < 0.1 or sine > 0.98:
            return False
        foot += along * (along.conjugate() * (self.at[pin] - foot)).real
        place = foot + along * self.sign() * abs(height) * sine / np.sqrt(1 - sine * sine)
        return self.slider(pin, place, guide, along)

    def slider(self, pin: str, place: complex, guide, along: complex) -> bool:
        rod, link = place - self.at[pin], self.link()
        ahead = sign_of((along.conjugate() * rod).real)
        group = Slider(self.node(), pin, link, array(abs(rod)), guide, ahead)
        return self.add(group, place, {link: [pin, group.node]})

    def rpr(self, *, offset: bool = False) -> bool:
        pin = self.moving()
        pivot = self.partner(pin)
        if pivot is None:
            return False
        arm, sine, link = self.at[pin] - self.at[pivot], self.sine(), self.link()
        aside = self.sign() * abs(arm) * np.sqrt(1 - sine * sine) if offset else 0.0
        if offset and abs(aside) < 0.05:
            return False
        side = self.sign()
        foot = f"Y{link}" if offset else None
        group = SlottedLink(f"X{link}", pin, pivot, link, array(aside), foot, side)
        reach = side * np.sqrt((abs(arm) - aside) * (abs(arm) + aside))
        along = arm / complex(reach, aside)
        if foot:
            self.at[foot] = self.at[pivot] + 1j * along * aside
        self.slots.append((group, along))
        return self.add(group, self.at[pin], {link: [pivot, *([foot] if foot else [])]})

    def rpr_with_offset(self) -> bool:
        return self.rpr(offset=True)

    def prp(self) -> bool:
        found = self.moving_guide()
        if found is None:
            return False
        guide, foot, along = found
        place, sine = foot + along * self.number(-1, 2), self.sine()
        other = along * complex(self.sign() * np.sqrt(1 - sine * sine), self.sign() * sine)
        guides = [guide, self.fixed_guide(place, other)]
        if self.sign() > 0:
            guides.reverse()
        return self.add(CrossSlider(self.node(), tuple(guides)), place, {})

    def prp_on_two_links(self) -> bool:
        one, two = self.moving_guide(), self.moving_guide()
        if one is None or two is None or one[0].link == two[0].link:
            return False
        (guide, p, u), (other, q, v) = one, two
        if abs(cross(u, v)) < max(self.least_sine, 1e-3):
            return False
        return self.add(CrossSlider(self.node(), (guide, other)), p + u * cross(q - p, v) / cross(u, v), {})

    def rpp(self) -> bool:
        pin, sine = self.moving(), self.sine()
        slot = turn_to(self.number(-np.pi, np.pi))
        place = self.at[pin] + slot * self.number(-1.5, 1.5)
        along = slot * complex(self.sign() * np.sqrt(1 - sine * sine), self.sign() * sine)
        guide = self.fixed_guide(place, along)
        return self.add(Yoke(self.node(), pin, array(float(np.angle(slot))), guide), place, {})

    def rpp_on_a_link(self) -> bool:
        pin = self.choose(self.at)
        found = self.moving_guide(but=pin)
        if found is None:
            return False
        guide = replace(found[0], coincident=f"W{len(self.groups)}")
        yoke = Yoke(f"Z{len(self.groups)}", pin, array(0.0), guide, f"YY{len(self.groups)}")
        return self.add(yoke, self.at[pin], {})

    def plate(self) -> bool:
        found = self.base()
        if found is None:
            return False
        link, p, q = found
        shape = complex(self.number(-1, 2), self.sign() * self.number(0.3, 1.2))
        base = self.at[q] - self.at[p]
        lengths = (array(abs(shape * base)), array(abs((shape - 1) * base)))
        group = Plate(self.node(), (p, q), link, lengths, sign_of(shape.imag), array(shape))
        return self.add(group, self.at[p] + shape * base, {link: [group.node]})

    def point_on_line(self) -> bool:
        found = self.base()
        if found is None:
            return False
        link, p, q = found
        ratio = self.number(-1, 2)
        group = PointOnLine(self.node(), (p, q), link, array(ratio))
        return self.add(group, self.at[p] + ratio * (self.at[q] - self.at[p]), {link: [group.node]})

    def triad(self) -> bool:
        a = self.moving()
        b = self.partner(a)
        if b is None:
            return False
        d, e = self.near(self.at[a]), self.near(self.at[b])
        f = self.near(d)
        first, second, sides = d - self.at[a], e - self.at[b], (e - d, f - e, d - f)
        crossing = cross(first, second) / abs(first * second)
        if abs(crossing) < LEAST_SINE or abs(cross(*sides[:2])) < LEAST_SPAN**2:
            return False
        s = self.at[a] + first * cross(self.at[b] - self.at[a], second) / cross(first, second)
        lever, sine = abs(s - f), self.sine()
        if min(map(abs, (*sides, s - d, s - e, s - f))) < LEAST_SPAN or abs(s) > FARTHEST:
            return False
        if self.least_sine >= LEAST_SINE and abs(crossing) * lever * sine < LEAST_TRIAD * max(
            map(abs, sides)
        ):
            return False
        along = (s - f) / lever * complex(self.sign() * np.sqrt(1 - sine * sine), self.sign() * sine)
        reach = self.number(0.3, 1.5)
        c = self.pivot(f + along * reach)
        links = tuple(str(int(self.link()) + more) for more in range(4))
        *others, point = TRIAD_NAMES[sum(isinstance(group, Triad) for group in self.groups)]
        corners = (*others, self.node())
        self.at |= {corners[0]: d, corners[1]: e}
        shape = (f - d) / (e - d)
        group = Triad(
            corners, (a, b, c), point, links, (array(abs(first)), array(abs(second)), array(reach)),
            tuple(array(abs(side)) for side in sides), sign_of(shape.imag), array(shape),
            array(float(np.angle(e - d))),
        )  # fmt: skip
        ends = {leg: [*joints] for leg, *joints in zip(links[:3], (a, b, c), corners, strict=True)}
        return self.add(group, f, ends | {links[3]: [*corners]})

    def slot_point(self) -> bool:
        found = self.choose(self.slots)
        if found is None:
            return False
        slotted, along = found
        local = complex(self.number(-1, 2), self.number(-1, 1))
        group = SlotPoint(self.node(), slotted.node, slotted.link, array(local))
        return self.add(group, self.at[slotted.pivot] + along * local, {slotted.link: [group.node]})


def random_mechanism(
    seed: int, chain: list[str], *, slider_drives: bool = False, least_sine: float = LEAST_SINE
) -> Mechanism:
    """A mechanism with the groups of `chain`, those left out that the lot gives no place to."""
    sketch = Sketch(np.random.default_rng(seed), least_sine)
    pin = complex(sketch.number(-1, 1), sketch.number(-1, 1))
    if slider_drives:
        along, reach = turn_to(sketch.number(-np.pi, np.pi)), sketch.number(-1, 1)
        rates = (array(sketch.number(-3, 3)), array(sketch.number(-20, 20)))
        guide = (array(pin - along * reach), array(float(np.angle(along))))
        driver = DrivingSlider("1", "A", *guide, array(reach), *rates)
        sketch.links["1"] = []
    else:
        pivot = sketch.near(pin)
        arm = pin - pivot
        rates = (array(sketch.sign() * sketch.number(0.1, 30.0)), array(sketch.number(-50, 50)))
        place = (array(abs(arm)), array(float(np.angle(arm))))
        driver = Crank("1", sketch.pivot(pivot), "A", *place, *rates, accelerated=True)
        sketch.links["1"] = ["O1", "A"]
    sketch.at["A"] = pin
    for kind in chain:
        way = getattr(sketch, kind.lower().replace(" ", "_"))
        next((True for _ in range(TRIES) if way()), False)
    ground = {name: array(place) for name, place in sketch.ground.items()}
    return Mechanism(ground, driver, tuple(sketch.groups))


def mechanisms():
    """A strategy: chains of one to six groups, driven by a crank or a slider."""
    return st.builds(
        random_mechanism,
        st.integers(0, 2**32 - 1),
        st.lists(st.sampled_from(KINDS), min_size=1, max_size=6),
        slider_drives=st.booleans(),
    )


# The same as an authored file ---------------------------------------------------------------------


def authored(mechanism: Mechanism) -> dict:
    """The table that a person would have written, in metres and degrees."""
    table = {"schema_version": 1, "id": "random", "title": {"en": "random"}, "length_unit": "m"}
    driver, ground = mechanism.driver, mechanism.ground_m
    if isinstance(driver, Crank):
        table["crank"] = {
            "pivot": driver.pivot,
            "pin": driver.pin,
            "length": float(driver.length_m[0]),
            "angle_deg": degrees(driver.angle_rad),
            "omega": float(driver.omega[0]),
            "epsilon": float(driver.epsilon[0]),
        }
    else:
        table["driving_slider"] = {
            "pin": driver.pin,
            "guide": fixed_table(FixedGuide(driver.guide_m, driver.guide_rad)),
            "displacement": float(driver.displacement_m[0]),
            "speed": float(driver.speed[0]),
            "acceleration": float(driver.acceleration[0]),
        }
        # A file has a ground pivot, whether anything turns about it or not.
        ground = ground or {"O1": array(0j)}
    table["ground"] = {name: point_table(place) for name, place in ground.items()}
    return table | {"group": [group_table(group, mechanism) for group in mechanism.groups]}


def degrees(angle_rad) -> str:
    return f"degrees({float(angle_rad[0])!r})"


def point_table(place) -> list[float]:
    return [float(place[0].real), float(place[0].imag)]


def fixed_table(guide: FixedGuide) -> dict:
    return {"through": point_table(guide.through_m), "angle_deg": degrees(guide.angle_rad)}


def guide_table(guide) -> dict:
    if isinstance(guide, FixedGuide):
        return fixed_table(guide)
    return {"joints": list(guide.base), "coincident": guide.coincident}


def group_table(group, mechanism: Mechanism) -> dict:
    """One group's table; in every second mechanism a plate's point is given by its local coordinates."""
    told = {"node": group.node}
    match group:
        case Dyad(pins=pins, links=links, lengths_m=lengths, side=side):
            told |= {"type": "RRR", "pins": list(pins), "links": list(links)}
            told |= {"lengths": [float(one[0]) for one in lengths], "side": "left" if side > 0 else "right"}
        case Slider(pin=pin, link=link, length_m=length, side=side):
            told |= {"type": "RRP", "pin": pin, "link": link, "length": float(length[0])}
            told |= {"guide": guide_table(group.guide), "side": "ahead" if side > 0 else "behind"}
        case SlottedLink(pin=pin, pivot=pivot, link=link, offset_m=offset, foot=foot, side=side):
            told |= {"type": "RPR", "pin": pin, "pivot": pivot, "link": link}
            told |= {"side": "ahead" if side > 0 else "behind"}
            told |= {"offset": float(offset[0]), "foot": foot} if foot else {}
        case CrossSlider(guides=guides):
            told |= {"type": "PRP", "guides": [guide_table(guide) for guide in guides]}
        case Yoke(pin=pin, guide=MovingGuide(), link=link):
            told |= {"type": "RPP", "pin": pin, "link": link, "guide": guide_table(group.guide)}
        case Yoke(pin=pin, slot_rad=slot):
            told |= {"type": "RPP", "pin": pin, "slot_deg": degrees(slot), "guide": guide_table(group.guide)}
        case Plate(base=base, link=link, lengths_m=lengths, side=side) if len(mechanism.groups) % 2:
            told |= {"type": "plate", "base": list(base), "link": link}
            told |= {"lengths": [float(one[0]) for one in lengths], "side": "left" if side > 0 else "right"}
        case Plate(base=base, link=link, lengths_m=lengths, shape=shape):
            along = lengths[0] * shape / abs(shape)
            told |= {"type": "point", "base": list(base), "link": link, "at": point_table(along)}
        case PointOnLine(base=base, link=link, ratio=ratio):
            told |= {"type": "point_on_line", "base": list(base), "link": link, "ratio": float(ratio[0])}
        case Triad():
            told = {
                "type": "triad",
                "nodes": [*group.corners],
                "pins": [*group.pins],
                "links": [*group.links],
            }
            told |= {"lengths": [float(one[0]) for one in (*group.legs_m, *group.sides_m)]}
            told |= {"side": "left" if group.turned > 0 else "right", "assur_point": group.assur_point}
            told |= {"angle_deg": degrees(group.direction_rad)}
        case SlotPoint(slotted=slotted, link=link, local_m=local):
            pivot = next(one.pivot for one in mechanism.groups if one.node == slotted)
            told |= {"type": "point", "base": [pivot, slotted], "link": link, "at": point_table(local)}
    return told


# What a mechanism says of itself, and what may be done to it ------------------------------------


def points_of_links(mechanism: Mechanism) -> dict[str, list[str]]:
    """By link: its joints, and its points that coincide with a slider at this instant."""
    links: dict[str, list[str]] = {}

    def carry(link: str, *joints: str) -> None:
        links.setdefault(link, []).extend(joint for joint in joints if joint not in links.get(link, []))

    if isinstance(mechanism.driver, Crank):
        carry(mechanism.driver.link, mechanism.driver.pivot, mechanism.driver.pin)
    for group in mechanism.groups:
        match group:
            case Dyad(node=node, pins=(p, q), links=(first, second)):
                carry(first, p, node)
                carry(second, q, node)
            case Slider(node=node, pin=pin, link=link):
                carry(link, pin, node)
            case Triad(links=(*legs, ternary)):
                for leg, *joints in zip(legs, group.pins, group.corners, strict=True):
                    carry(leg, *joints)
                carry(ternary, *group.corners, group.assur_point)
            case SlottedLink(node=node, pivot=pivot, link=link, foot=foot):
                carry(link, pivot, node, *([foot] if foot else []))
            case (
                Plate(node=node, link=link)
                | PointOnLine(node=node, link=link)
                | SlotPoint(node=node, link=link)
            ):
                carry(link, node)
        for guide in moving_guides(group):
            carry(guide.link, *guide.base, guide.coincident)
    return links


# With masses and loads ----------------------------------------------------------------------------


def loaded(mechanism: Mechanism, seed: int) -> Mechanism:
    """The mechanism with random bodies, loads and gravity; links with random pins; a cylinder that drives."""
    lot = np.random.default_rng(seed)
    points, hinged, slots = points_of(mechanism), hinged_at(mechanism), {}
    for group in mechanism.groups:
        if isinstance(group, SlottedLink):
            slots[group.link] = group
    more, bodies, loads = [], [], []
    for link, held in points.items():
        joints = [*held]
        if link in slots:
            more.append(SlotPoint(f"S{link}", slots[link].node, link, array(complex(*lot.uniform(-1, 1, 2)))))
            joints.append(more[-1].node)
        elif len(joints) > 1 and lot.random() < 0.7:
            more.append(PointOnLine(f"S{link}", (joints[0], joints[1]), link, array(lot.uniform(-1, 2))))
            joints.append(more[-1].node)
        if lot.random() < 0.8:
            size = 10.0 ** lot.uniform(-1, 2)
            inertia = lot.choice([0.0, size * lot.uniform(0, 1)])
            bodies.append(Body(link, str(lot.choice(joints)), array(size), array(inertia)))
        if lot.random() < 0.4:
            force = 10.0 ** lot.uniform(0, 4) * turn_to(lot.uniform(-np.pi, np.pi))
            loads.append(Load(f"L{len(loads)}", link, str(lot.choice(joints)), array(force)))
        if lot.random() < 0.2:
            couple = array(lot.uniform(-100, 100))
            loads.append(Load(f"L{len(loads)}", link, joints[0], couple=couple))
        if isinstance(sliders_of(mechanism).get(link), FixedGuide):
            force = array(complex(lot.uniform(-1000, 1000)))
            loads.append(Load(f"L{len(loads)}", link, joints[0], force, slider=joints[0]))
    driver = mechanism.driver
    for group in slots.values():
        grounded = mechanism.ground_m.keys() - {getattr(driver, "pivot", "")}
        if isinstance(driver, Crank) and group.pin == driver.pin and group.pivot in grounded:
            driver = replace(driver, cylinder=group.link)
    pins = {joint: str(lot.choice(links)) for joint, links in hinged.items() if len(links) > 1}
    gravity = array(9.81) if lot.random() < 0.5 else None
    groups = (*mechanism.groups, *more)
    return replace(
        mechanism, driver=driver, groups=groups, bodies=tuple(bodies), loads=tuple(loads),
        gravity=gravity, pins=pins,
    )  # fmt: skip


def after(mechanism: Mechanism, time_s) -> Mechanism:
    """The mechanism a moment later (or at many moments), its driver's acceleration held."""
    driver = mechanism.driver
    if isinstance(driver, Crank):
        angle = driver.angle_rad + driver.omega * time_s + driver.epsilon * time_s**2 / 2
        later = replace(driver, angle_rad=angle, omega=driver.omega + driver.epsilon * time_s)
    else:
        place = driver.displacement_m + driver.speed * time_s + driver.acceleration * time_s**2 / 2
        speed = driver.speed + driver.acceleration * time_s
        later = replace(driver, displacement_m=place, speed=speed)
    return replace(mechanism, driver=later)


def driven(mechanism: Mechanism, speed, acceleration) -> Mechanism:
    """The mechanism driven at another speed and acceleration (rad/s, or m/s of a slider)."""
    speed, acceleration = array(speed), array(acceleration)
    driver = mechanism.driver
    if isinstance(driver, Crank):
        return replace(mechanism, driver=replace(driver, omega=speed, epsilon=acceleration))
    return replace(mechanism, driver=replace(driver, speed=speed, acceleration=acceleration))


def rates_of(mechanism: Mechanism) -> tuple[float, float]:
    """The driver's speed and acceleration."""
    driver = mechanism.driver
    if isinstance(driver, Crank):
        return float(driver.omega[0]), float(driver.epsilon[0])
    return float(driver.speed[0]), float(driver.acceleration[0])


def transformed(mechanism: Mechanism, turn: complex, *, mirror=False, factor=1.0, shift=0j):
    """The mechanism mirrored in the x axis, turned by a unit number, enlarged, shifted; the map itself."""
    sign, angle = -1 if mirror else 1, float(np.angle(turn))

    def place(z):
        return (np.conj(z) if mirror else z) * turn * factor + shift

    def guide_of(guide):
        if isinstance(guide, MovingGuide):
            return guide
        return FixedGuide(place(guide.through_m), sign * guide.angle_rad + angle)

    def group_of(group):
        match group:
            case Dyad(lengths_m=lengths):
                return replace(
                    group, lengths_m=tuple(one * factor for one in lengths), side=sign * group.side
                )
            case Plate(lengths_m=lengths, shape=shape):
                shape = np.conj(shape) if mirror else shape
                lengths = tuple(one * factor for one in lengths)
                return replace(group, lengths_m=lengths, shape=shape, side=sign * group.side)
            case Slider():
                return replace(group, length_m=group.length_m * factor, guide=guide_of(group.guide))
            case SlottedLink():
                return replace(group, offset_m=sign * factor * group.offset_m)
            case Triad(legs_m=legs, sides_m=sides, shape=shape):
                legs, sides = (tuple(one * factor for one in each) for each in (legs, sides))
                return replace(
                    group, legs_m=legs, sides_m=sides, shape=np.conj(shape) if mirror else shape,
                    turned=sign * group.turned, direction_rad=sign * group.direction_rad + angle,
                )  # fmt: skip
            case SlotPoint(local_m=local):
                return replace(group, local_m=factor * (np.conj(local) if mirror else local))
            case CrossSlider(guides=guides):
                return replace(group, guides=tuple(guide_of(one) for one in guides))
            case Yoke():
                return replace(group, slot_rad=sign * group.slot_rad + angle, guide=guide_of(group.guide))
        return group

    driver = mechanism.driver
    if isinstance(driver, Crank):
        driver = replace(
            driver,
            length_m=driver.length_m * factor,
            angle_rad=sign * driver.angle_rad + angle,
            omega=sign * driver.omega,
            epsilon=sign * driver.epsilon,
        )
    else:
        driver = replace(
            driver,
            guide_m=place(driver.guide_m),
            guide_rad=sign * driver.guide_rad + angle,
            displacement_m=driver.displacement_m * factor,
            speed=driver.speed * factor,
            acceleration=driver.acceleration * factor,
        )

    def load_of(load):
        if load.force is None:
            return replace(load, couple=sign * load.couple)
        return (
            load
            if load.slider
            else replace(load, force=(np.conj(load.force) if mirror else load.force) * turn)
        )

    ground = {joint: place(z) for joint, z in mechanism.ground_m.items()}
    groups, loads = (tuple(map(*each)) for each in ((group_of, mechanism.groups), (load_of, mechanism.loads)))
    return replace(mechanism, ground_m=ground, driver=driver, groups=groups, loads=loads), place
