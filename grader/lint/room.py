"""Whether the figures fit: their zones on the printed answer sheet, and a plain A3 sheet's frame."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.answer_sheet.fit import MARGIN_MM, template_for
from grader.layout import FRAME_MM
from grader.lint.findings import LintFinding, chosen
from grader.records import Box
from reference.assignment import Assignment
from reference.geometry import FloatArray
from reference.plan import Plan

Extents = Mapping[str, tuple[FloatArray, FloatArray]]
"""Width and height of each figure, millimetres, (N,) each."""


@dataclass(frozen=True, slots=True)
class PageRoom:
    """How a page's figures fit at the proposed scales; 1 is just enough, arrays of shape (N,).

    Attributes
    ----------
    zones : by figure, how many times as large it could be drawn in its zone of the answer sheet
    frame : how many times as large all of them could be drawn side by side in a plain A3 sheet's frame
    """

    zones: Mapping[str, FloatArray]
    frame: FloatArray


def extents_of(plan: Plan) -> dict[str, tuple[FloatArray, FloatArray]]:
    """How wide and high each figure of every variant is drawn."""
    count = len(plan.variants)
    found = {}
    for figure, nodes in plan.nodes_mm.items():
        places = np.stack([np.broadcast_to(place, (count,)) for place in nodes.values()])
        found[figure] = (np.ptp(places.real, axis=0), np.ptp(places.imag, axis=0))
    return found


def pages_of(assignment: Assignment, plan: Plan) -> list[tuple[int, tuple[str, ...]]]:
    """The assignment's pages with their index, and those of their figures that the plan has."""
    pages = [
        (index, tuple(figure for figure in page.figures if figure in plan.nodes_mm))
        for index, page in enumerate(assignment.file.page)
    ]
    return [(index, figures) for index, figures in pages if figures]


def room_of(figures: Sequence[str], extents: Extents) -> PageRoom:
    """How the figures of one page fit, in the division of the answer sheet that is printed for them."""
    largest = {
        figure: (float(extents[figure][0].max()), float(extents[figure][1].max())) for figure in figures
    }
    template = template_for(largest).template
    zones = {figure: growth(template.zones[figure], *extents[figure]) for figure in figures}
    return PageRoom(zones, _frame_growth([extents[figure] for figure in figures]))


def growth(box: Box, wide: FloatArray, high: FloatArray) -> FloatArray:
    """By what factor figures could be enlarged to fill a box, margins for letters kept; (N,)."""
    _, _, box_wide, box_high = box
    with np.errstate(divide="ignore"):
        return np.asarray(np.minimum((box_wide - 2 * MARGIN_MM) / wide, (box_high - 2 * MARGIN_MM) / high))


def _frame_growth(sizes: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """The same for all figures of a page in the frame: in a row, in a column, or one beside two."""
    wide, high = FRAME_MM[2], FRAME_MM[3]
    options = [_in_line(sizes, wide, high)]
    options.append(_in_line([size[::-1] for size in sizes], high, wide))
    if len(sizes) == 3:
        for alone in range(3):
            pair = [size for index, size in enumerate(sizes) if index != alone]
            options.append(_beside_pair(sizes[alone], pair, wide, high))
            turned = [size[::-1] for size in pair]
            options.append(_beside_pair(sizes[alone][::-1], turned, high, wide))
    return np.asarray(np.max(options, axis=0))


def _in_line(sizes: Sequence[tuple[FloatArray, FloatArray]], along: float, across: float) -> FloatArray:
    free = along - 2 * MARGIN_MM * len(sizes)
    lengths, widths = sum(size[0] for size in sizes), np.max([size[1] for size in sizes], axis=0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.minimum(free / lengths, (across - 2 * MARGIN_MM) / widths))


def _beside_pair(
    alone: tuple[FloatArray, FloatArray], pair: Sequence[tuple[FloatArray, FloatArray]],
    along: float, across: float,
) -> FloatArray:  # fmt: skip
    """One figure, and beside it two that share the sheet's other dimension."""
    longer = np.max([size[0] for size in pair], axis=0)
    total = pair[0][1] + pair[1][1]
    with np.errstate(divide="ignore"):
        return np.asarray(
            np.min(
                [
                    (along - 4 * MARGIN_MM) / (alone[0] + longer),
                    (across - 2 * MARGIN_MM) / alone[1],
                    (across - 4 * MARGIN_MM) / total,
                ],
                axis=0,
            )
        )


def room_findings(assignment: Assignment, plan: Plan, rooms: Mapping[int, PageRoom]) -> Iterator[LintFinding]:
    """Figures too large for their zone, and pages whose figures do not fit a plain A3 sheet either."""
    for index, room in rooms.items():
        path = f"$.page[{index}]"
        for figure, factor in room.zones.items():
            tight = factor < 1.0
            if np.any(tight):
                told = f"the {figure.replace('_', ' ')} does not fit its zone on the A3 answer sheet"
                yield LintFinding(
                    "warning", "does_not_fit", "assignment", path,
                    f"{told}: it would at {np.min(factor):.2f} of the proposed size",
                    chosen(plan.variants, tight),
                )  # fmt: skip
        tight = room.frame < 1.0
        if np.any(tight):
            told = "the page's figures do not fit side by side into the frame of a plain A3 sheet"
            yield LintFinding(
                "warning", "does_not_fit_a3", "assignment", path,
                f"{told}: they would at {np.min(room.frame):.2f} of the proposed size",
                chosen(plan.variants, tight),
            )  # fmt: skip
    shown = {figure for page in assignment.file.page for figure in page.figures}
    for figure in plan.nodes_mm:
        if figure not in shown:
            told = f"no page has the {figure.replace('_', ' ')}, which the rubric needs"
            yield LintFinding("warning", "no_page", "assignment", "$.page", told)
