"""The quantities of a mechanism and its plans, one table: kind, letter, unit, scale, figure."""

from dataclasses import dataclass
from typing import Literal

GREEK = {"omega": "ω", "epsilon": "ε", "phi": "φ"}
"""Starts of names that are shown as Greek letters."""
KindName = Literal["length", "velocity", "acceleration", "omega", "epsilon", "force", "moment"]


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of quantity.

    Attributes
    ----------
    letters : starts of the kind's names, before the first underscore, the usual one first
    unit : SI, as written in files: ``m/s^2``
    scale : the scale at which it is drawn; empty if it is not drawn
    figure : the figure in which it is drawn (of force plans, the start of their names); empty if it is not
    omegas : the power of the crank's speed with which it grows; None for one that has another cause
    """

    name: KindName
    letters: tuple[str, ...]
    unit: str
    scale: str = ""
    figure: str = ""
    omegas: int | None = None

    @property
    def letter(self) -> str:
        """The usual start of its names."""
        return self.letters[0]

    @property
    def unit_per_mm(self) -> str:
        """The unit of its scale, per millimetre on paper."""
        return f"({self.unit})/mm" if "/" in self.unit else f"{self.unit}/mm"


KINDS = (
    Kind("length", ("l",), "m", "kL", "mechanism", 0),
    Kind("velocity", ("v",), "m/s", "kv", "velocity_plan", 1),
    Kind("acceleration", ("a",), "m/s^2", "ka", "acceleration_plan", 2),
    Kind("omega", ("omega",), "rad/s", omegas=1),
    Kind("epsilon", ("epsilon",), "rad/s^2", omegas=2),
    Kind("force", ("F", "G", "R"), "N", "kF", "force_plan"),
    Kind("moment", ("M",), "N m"),
)
DRAWN = {kind.scale: kind for kind in KINDS if kind.scale}
"""The kinds that are drawn, by scale."""
OF_MOTION = tuple(scale for scale, kind in DRAWN.items() if kind.omegas)
"""The scales of the plans in which the driving link has a vector."""
SCALE_UNITS = {scale: kind.unit_per_mm for scale, kind in DRAWN.items()}
_BY_LETTER = {letter: kind for kind in KINDS for letter in kind.letters}
FORCE_PLANS = "force_plans"
"""The zone that all force plans share on a printed sheet."""
_BY_FIGURE = {kind.figure: kind for kind in DRAWN.values()} | {FORCE_PLANS: DRAWN["kF"]}
FORCE_PLAN = "force_plan_"
"""Starts the names of force plans: each Assur group has one, named by its joint (``force_plan_D``)."""
FIGURE = f"^(mechanism|velocity_plan|acceleration_plan|{FORCE_PLAN}[A-Za-z0-9]+)$"
"""The names of figures, as a regular expression."""


def value_name(vector: str) -> str:
    """Return the name of a vector's computed value, as measurement files have it: ``v_B_value``."""
    return f"{vector}_value"


def vector_of_value(name: str) -> str | None:
    """Return the vector whose computed value has this name; None for any other name."""
    return name.removesuffix("_value") if name.endswith("_value") else None


def kind_of(name: str) -> Kind:
    """Return the kind of a vector, rate, moment or scale; a length for other names, such as a link's."""
    letter, _, rest = name.partition("_")
    return DRAWN.get(name) or (_BY_LETTER.get(letter) if rest else None) or KINDS[0]


def unit_of(name: str) -> str:
    """Return the SI unit of a vector, angular quantity or link; of a scale, per millimetre on paper."""
    return SCALE_UNITS.get(name) or kind_of(name).unit


def group_of(figure: str) -> str:
    """Return the joint that names the group of a force plan; empty for another figure."""
    return figure.removeprefix(FORCE_PLAN) if figure.startswith(FORCE_PLAN) else ""


def sort_of(figure: str) -> str:
    """Return the name that figures of one sort share: ``force_plan`` of all force plans; else its own."""
    return FORCE_PLAN.rstrip("_") if group_of(figure) else figure


def zone_of(figure: str) -> str:
    """Return the zone of a printed sheet in which a figure is drawn: its own, or that of all force plans."""
    return FORCE_PLANS if group_of(figure) else figure


def kind_of_figure(figure: str) -> Kind | None:
    """Return the kind of quantity that a figure shows; None for what is no figure."""
    return _BY_FIGURE.get(sort_of(figure))


def scale_of(figure: str) -> str:
    """Return the scale at which a figure is drawn; empty for what is no figure."""
    kind = kind_of_figure(figure)
    return kind.scale if kind else ""
