"""The quantities of a mechanism and its plans, one table: kind, letter, unit, scale, figure."""

from dataclasses import dataclass
from typing import Literal

KindName = Literal["length", "velocity", "acceleration", "omega", "epsilon"]


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of quantity.

    Attributes
    ----------
    letter : start of the kind's names, before the first underscore
    unit : SI, as written in files: ``m/s^2``
    scale : the scale at which it is drawn; empty if it is not drawn
    figure : the figure in which it is drawn; empty if it is not drawn
    """

    name: KindName
    letter: str
    unit: str
    scale: str = ""
    figure: str = ""

    @property
    def unit_per_mm(self) -> str:
        """The unit of its scale, per millimetre on paper."""
        return f"({self.unit})/mm" if "/" in self.unit else f"{self.unit}/mm"


KINDS = (
    Kind("length", "l", "m", "kL", "mechanism"),
    Kind("velocity", "v", "m/s", "kv", "velocity_plan"),
    Kind("acceleration", "a", "m/s^2", "ka", "acceleration_plan"),
    Kind("omega", "omega", "rad/s"),
    Kind("epsilon", "epsilon", "rad/s^2"),
)
DRAWN = tuple(kind for kind in KINDS if kind.scale)
SCALE_OF = {kind.figure: kind.scale for kind in DRAWN}
"""The scale at which each figure is drawn."""
SCALE_UNITS = {kind.scale: kind.unit_per_mm for kind in DRAWN}
_KNOWN = {key: kind for kind in KINDS for key in (kind.letter, kind.scale) if key}


def value_name(vector: str) -> str:
    """Return the name of a vector's computed value, as measurement files have it: ``v_B_value``."""
    return f"{vector}_value"


def vector_of_value(name: str) -> str | None:
    """Return the vector whose computed value has this name; None for any other name."""
    return name.removesuffix("_value") if name.endswith("_value") else None


def kind_of(name: str) -> Kind:
    """Return the kind of a vector, angular quantity or scale; a length for other names, such as a link's."""
    return _KNOWN.get(name.partition("_")[0], KINDS[0])


def unit_of(name: str) -> str:
    """Return the SI unit of a vector, angular quantity or link; of a scale, per millimetre on paper."""
    return SCALE_UNITS.get(name) or kind_of(name).unit
