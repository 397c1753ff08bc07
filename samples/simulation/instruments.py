"""A person with ruler, set squares, protractor and compasses: how each of them errs.

There are three kinds of error; a single normal distribution would not describe them:

- slips: most are small, a few are several times larger (Student's t with four degrees of freedom);
- habits: one person reads every length off the same edge of the same ruler, and squares every line with the
  same set square, so that these errors are the same in the whole drawing;
- graduation: lengths are read to half a millimetre, by hasty people to a whole one.

Lengths are millimetres on paper, places complex, y up.
"""

import cmath
import math
from dataclasses import dataclass, field

from samples.simulation.settings import HandStyle
from samples.simulation.strokes import Rng

FREEDOM = 4.0
"""Degrees of freedom of a slip: one in forty is larger than 3.5 times its size."""
LARGEST_SLIP = 6.0
"""Times its size: what is worse is noticed at once and drawn again."""
HABIT = 0.5
"""Size of a person's constant error, as a share of a single one."""
STRETCH = 0.0007
"""Relative error of a ruler's or of the paper's length, one standard deviation."""
CARRIED_MM = (40.0, 250.0)
"""Usual distances over which set squares slide from a line of the sketch to the plan."""
SHORTEST_EDGE_MM = 15.0
"""On a shorter line nobody aligns an edge: it is prolonged first."""
SHARPEST = 0.15
"""Sine of the sharpest crossing of two lines that is still marked as their crossing."""
PROTRACTOR_STEP_DEG = 0.5


@dataclass(slots=True)
class Instruments:
    """One person's instruments for one drawing.

    Attributes
    ----------
    zero_mm, stretch, square_rad : the constant errors of reading lengths and of squaring lines
    """

    hand: HandStyle
    rng: Rng
    zero_mm: float = field(init=False)
    stretch: float = field(init=False)
    square_rad: float = field(init=False)

    def __post_init__(self) -> None:
        is_exact = self.hand.graduation_mm == 0.0
        self.zero_mm = HABIT * self.hand.reading_mm * float(self.rng.standard_normal())
        self.stretch = 0.0 if is_exact else STRETCH * float(self.rng.standard_normal())
        self.square_rad = HABIT * math.radians(self.hand.square_deg) * float(self.rng.standard_normal())

    def slip(self, size: float) -> float:
        """A random slip of this size."""
        slip = float(self.rng.standard_t(FREEDOM))
        return size * max(-LARGEST_SLIP, min(LARGEST_SLIP, slip))

    def dot(self, at: complex) -> complex:
        """A point as marked by pencil, or pricked by a needle."""
        return at + complex(self.slip(self.hand.mark_mm), self.slip(self.hand.mark_mm))

    def length(self, exact_mm: float) -> float:
        """A length as set on or read off the ruler, with its sign; zero stays zero."""
        if exact_mm == 0.0:
            return 0.0
        size = abs(exact_mm) * (1.0 + self.stretch) + self.zero_mm + self.slip(self.hand.reading_mm)
        step = self.hand.graduation_mm
        read = round(size / step) * step if step else size
        return math.copysign(max(read, 0.0), exact_mm)

    def protracted(self, angle_rad: float) -> complex:
        """The direction of an angle set with the protractor; along and across the axes with a set square."""
        quarters = angle_rad / (0.5 * math.pi)
        if abs(quarters - round(quarters)) < 1e-6:
            return cmath.rect(1.0, angle_rad + math.radians(self.slip(0.5 * self.hand.square_deg)))
        set_deg = math.degrees(angle_rad) + self.slip(self.hand.square_deg)
        if self.hand.graduation_mm:
            set_deg = round(set_deg / PROTRACTOR_STEP_DEG) * PROTRACTOR_STEP_DEG
        return cmath.rect(1.0, math.radians(set_deg))

    def carried(self, link: complex, quarters: int) -> complex:
        """The direction along a drawn line, or across it, carried over to another place with set squares.

        The edge is aligned to the line at two points, so a short line gives a larger error; the farther it is
        carried, the more it turns; an inaccurate set square shows in lines drawn across.
        """
        edge = max(abs(link), SHORTEST_EDGE_MM)
        aligned = (self.slip(self.hand.edge_mm) - self.slip(self.hand.edge_mm)) / edge
        far = float(self.rng.uniform(*CARRIED_MM)) / 100.0
        slid = math.radians(self.slip(self.hand.square_deg)) * math.sqrt(far)
        squared = self.square_rad if quarters % 2 else 0.0
        return link / abs(link) * 1j**quarters * cmath.rect(1.0, aligned + slid + squared)

    def beside(self, foot: complex, along: complex) -> complex:
        """A point on the line as drawn, beside the point that it should pass through."""
        return foot + 1j * along * self.slip(self.hand.edge_mm)

    def crossing(self, p: complex, u: complex, q: complex, v: complex) -> complex:
        """The marked crossing of the lines through p along u and through q along v.

        Raises ValueError where they are parallel. A sharp crossing is marked badly along both lines.
        """
        sine = (u.conjugate() * v).imag
        if abs(sine) < 1e-9:
            raise ValueError("parallel lines do not cross")
        at = p + u * (((q - p).conjugate() * v).imag / sine)
        between = u + v if (u.conjugate() * v).real >= 0.0 else u - v
        along = between / abs(between)
        return self.dot(at) + along * self.slip(self.hand.mark_mm) * (1.0 / max(abs(sine), SHARPEST) - 1.0)

    def arcs(self, centres: tuple[complex, complex], radii_mm: tuple[float, float], side: float) -> complex:
        """The marked crossing of two arcs, left of the line between their centres for a positive side.

        Raises ValueError where they do not meet.
        """
        (p, q), (r, s) = (self.dot(centres[0]), self.dot(centres[1])), (self.length(one) for one in radii_mm)
        distance = abs(q - p)
        foot = (distance**2 + r**2 - s**2) / (2.0 * distance)
        if abs(foot) > r:
            raise ValueError("the arcs do not meet")
        along = (q - p) / distance
        return self.dot(p + along * complex(foot, math.copysign(math.sqrt(r**2 - foot**2), side)))

    def arc_on_line(
        self, centre: complex, radius_mm: float, line: tuple[complex, complex], side: float
    ) -> complex:
        """The marked crossing of an arc with a line (a point, a direction), ahead of the centre or behind.

        Raises ValueError where they do not meet.
        """
        at, along = line
        needle, radius = self.dot(centre), self.length(radius_mm)
        reach = (needle - at) * along.conjugate()
        if abs(reach.imag) > radius:
            raise ValueError("the arc does not reach the line")
        return self.dot(at + along * (reach.real + math.copysign(math.sqrt(radius**2 - reach.imag**2), side)))
