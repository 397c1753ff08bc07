"""What one student handed in, as far as likeness between students is concerned."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from grader.documents import ReportDocument
from grader.measurements import Measurements
from reference.assignment import Variant

Nodes = Mapping[str, Mapping[str, complex]]
"""By figure and name, x - i y in sheet millimetres."""


@dataclass(frozen=True, slots=True)
class Handed:
    """One student's submission for one position.

    Attributes
    ----------
    sheets : the nodes read on each sheet
    numbers : entered lengths (mm), ``NAME_deg`` directions and ``NAME_value`` SI values
    used : scales used for marking, real units per millimetre; empty where marking came to none
    fits : the variant that diagnosis says was drawn instead, with its confidence, or None
    printed : whether it is drawn on printed answer sheets, that say where poles are best put
    excused : nodes and vectors at which a mistake was named: what is off there is no hand's error
    """

    student_id: str
    variant: Variant
    sheets: tuple[Nodes, ...] = ()
    numbers: Mapping[str, float] = field(default_factory=dict)
    used: Mapping[str, float] = field(default_factory=dict)
    fits: tuple[Variant, float] | None = None
    excused: frozenset[str] = frozenset()
    printed: bool = False

    @property
    def key(self) -> tuple[str, int | None]:
        """Student and position."""
        return self.student_id, self.variant.position


def handed_in(report: ReportDocument, variant: Variant, measured: Measurements | None) -> Handed:
    """A submission that was marked."""
    return Handed(
        student_id=report.student_id,
        variant=variant,
        sheets=tuple(
            {
                figure: {name: complex(node.x_mm, -node.y_mm) for name, node in read.nodes.items()}
                for figure, read in sheet.figures.items()
            }
            for sheet in report.reading.sheets
            if sheet.figures
        ),
        numbers={} if measured is None else measured.numbers,
        used={name: one.used for name, one in report.scales.items() if one.used},
        fits=_fits(variant, report),
        excused=frozenset(mistake.at for mistake in report.mistakes),
        printed=any(one.sheet is not None and one.sheet.method == "markers" for one in report.reading.sheets),
    )


def _fits(variant: Variant, report: ReportDocument) -> tuple[Variant, float] | None:
    """The other variant that diagnosis names."""
    for mistake in report.mistakes:
        if mistake.code == "other_variant":
            told = dict(part.split(" = ", 1) for part in mistake.detail.split(", ") if " = " in part)
            n, position = told.get("n"), told.get("position")
            drawn = Variant(
                n=variant.n if n is None else int(n),
                position=variant.position if position is None else int(position),
            )
            return (drawn, mistake.confidence) if drawn != variant else None
    return None
