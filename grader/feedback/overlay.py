"""A scene as SVG over the scan: sharp at every size, and with names to point at."""

import base64
from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace

from markupsafe import Markup

from grader.labels import Label, labels_of
from grader.records import ACCELERATION_PLAN, VELOCITY_PLAN, Box
from grader.scene import (
    ARROW_WIDTH_MM,
    COLOURS,
    DASH_MM,
    GHOST_COLOUR,
    MARKS,
    NODE_COLOUR,
    Arrow,
    Dot,
    Ghost,
    Picture,
    Scene,
)

CLOSE_UP_MARGIN_MM = 12.0
LEAST_CLOSE_UP_MM = 60.0
CLOSE_UP_BELOW = 0.55
"""A plan smaller than this share of the sheet is worth a close-up."""
WIDE_TO_HIGH = (1.3, 1.9)
"""Aspects of close-ups that sit well on a page."""
WHOLE_SIZE_PER_MM = 0.0062
CLOSE_UP_SIZE_PER_MM = 0.0105
"""Size of marks and letters by the width shown: close-ups stand two in a row."""


@dataclass(frozen=True, slots=True)
class View:
    """One look at a sheet: the whole, or a plan close up."""

    kind: str
    """``sheet``, ``velocity_plan`` or ``acceleration_plan``."""
    caption: str
    svg: Markup


def views(picture: Picture, number: int, captions: Mapping[str, str]) -> list[View]:
    """The whole sheet, then each plan that is small on it close up; the scan is stored once."""
    scene = picture.scene
    width, height = scene.page_mm
    name = f"scan-{number}"
    image = Markup(
        '<image id="{}" width="{}" height="{}" preserveAspectRatio="none" href="data:image/jpeg;base64,{}"/>'
    ).format(name, width, height, base64.b64encode(picture.jpeg).decode("ascii"))
    again = Markup('<use href="#{}"/>').format(name)
    close_ups = {
        figure: box
        for figure in (VELOCITY_PLAN, ACCELERATION_PLAN)
        if (box := _close_up([arrow for arrow in scene.arrows if arrow.figure == figure], scene)) is not None
    }
    whole = _svg(
        (0.0, 0.0, width, height), image, scene, captions["sheet"], WHOLE_SIZE_PER_MM, without=set(close_ups)
    )
    return [
        View("sheet", captions["sheet"], whole),
        *(
            View(
                figure,
                captions[figure],
                _svg(box, again, _part(scene, figure), captions[figure], CLOSE_UP_SIZE_PER_MM),
            )
            for figure, box in close_ups.items()
        ),
    ]


def _part(scene: Scene, figure: str) -> Scene:
    return replace(scene, arrows=tuple(arrow for arrow in scene.arrows if arrow.figure == figure))


def _svg(
    box: Box,
    image: Markup,
    scene: Scene,
    caption: str,
    size_per_mm: float,
    without: AbstractSet[str] = frozenset(),
) -> Markup:
    """One look; arrows of figures that have a close-up of their own go `without` names there."""
    size = min(max(size_per_mm * box[2], 0.3), 1.7)
    labels = labels_of([arrow for arrow in scene.arrows if arrow.figure not in without], box, size)
    shapes = (
        *(_ghost(ghost, size) for ghost in scene.ghosts),
        *(_arrow(arrow, size) for arrow in scene.arrows),
        *(_dot(dot, size) for dot in scene.dots),
        *(_label(label) for label in labels),
    )
    return Markup(
        '<svg class="sheet" viewBox="{:.1f} {:.1f} {:.1f} {:.1f}" role="img" aria-label="{}">'
        '{}<g class="marks">{}</g></svg>'
    ).format(*box, caption, image, Markup("").join(shapes))


def _close_up(arrows: list[Arrow], scene: Scene) -> Box | None:
    """A box around some arrows, None where it would show hardly more than the whole sheet."""
    if not arrows:
        return None
    xs = [x for arrow in arrows for x in (arrow.tail[0], arrow.tip[0])]
    ys = [y for arrow in arrows for y in (arrow.tail[1], arrow.tip[1])]
    wide, high = scene.page_mm
    width = max(max(xs) - min(xs) + 2 * CLOSE_UP_MARGIN_MM, LEAST_CLOSE_UP_MM)
    height = max(max(ys) - min(ys) + 2 * CLOSE_UP_MARGIN_MM, width / WIDE_TO_HIGH[1])
    width = max(width, height * WIDE_TO_HIGH[0])
    if width > CLOSE_UP_BELOW * wide or height > CLOSE_UP_BELOW * high * 1.3:
        return None
    x = min(max((min(xs) + max(xs) - width) / 2, 0.0), max(wide - width, 0.0))
    y = min(max((min(ys) + max(ys) - height) / 2, 0.0), max(high - height, 0.0))
    return (x, y, width, height)


def _ghost(ghost: Ghost, size: float) -> Markup:
    return Markup(
        '<line x1="{:.2f}" y1="{:.2f}" x2="{:.2f}" y2="{:.2f}" stroke="{}" stroke-width="{:.2f}"'
        ' stroke-dasharray="{:.2f}"/><circle cx="{:.2f}" cy="{:.2f}" r="{:.2f}" fill="none" stroke="{}"'
        ' stroke-width="{:.2f}"/>'
    ).format(
        *ghost.tail, *ghost.tip, GHOST_COLOUR, 0.45 * size, 0.9 * size,
        *ghost.tip, 0.9 * size, GHOST_COLOUR, 0.3 * size,
    )  # fmt: skip


def _dot(dot: Dot, size: float) -> Markup:
    return Markup(
        '<circle cx="{:.2f}" cy="{:.2f}" r="{:.2f}" fill="none" stroke="{}" stroke-width="{:.2f}">'
        "<title>{}</title></circle>"
    ).format(*dot.at, 0.8 * size, COLOURS["review"] if dot.doubtful else NODE_COLOUR, 0.3 * size, dot.name)


def _arrow(arrow: Arrow, size: float) -> Markup:
    colour = COLOURS[arrow.verdict]
    dash, gap = (length * size for length in DASH_MM)
    dashes = Markup(' stroke-dasharray="{:.2f} {:.2f}"').format(dash, gap) if arrow.doubtful else Markup("")
    corners = " ".join(f"{x:.2f},{y:.2f}" for x, y in arrow.head(size))
    return Markup(
        '<g opacity=".85"><title>{}</title><line x1="{:.2f}" y1="{:.2f}" x2="{:.2f}" y2="{:.2f}"'
        ' stroke="{}" stroke-width="{:.2f}"{}/><polygon points="{}" fill="{}"/></g>'
    ).format(
        arrow.name, *arrow.tail, *arrow.neck(size), colour, ARROW_WIDTH_MM * size, dashes, corners, colour
    )


def _label(label: Label) -> Markup:
    """The mark in a disc and the name on a whitened ground, with a thin line to an arrow far off."""
    arrow, size = label.arrow, label.size
    colour = COLOURS[arrow.verdict]
    (x, y), radius = label.badge
    letter, _, rest = arrow.name.partition("_")
    return _leader(label, colour) + Markup(
        '<rect x="{:.2f}" y="{:.2f}" width="{:.2f}" height="{:.2f}" rx="{:.2f}" fill="#fff" opacity=".82"/>'
        '<circle cx="{:.2f}" cy="{:.2f}" r="{:.2f}" fill="{}"/>'
        '<text x="{:.2f}" y="{:.2f}" class="mark" font-size="{:.2f}">{}</text>'
        '<text x="{:.2f}" y="{:.2f}" font-size="{:.2f}" fill="{}">{}<tspan font-size="{:.2f}" dy="{:.2f}">{}'
        "</tspan></text>"
    ).format(
        *label.box, 1.6 * size, x, y, radius, colour, x, y + 0.95 * size, 2.7 * size, MARKS[arrow.verdict],
        *label.foot, 3.0 * size, colour, letter, 2.2 * size, 0.7 * size, rest.replace("_", " "),
    )  # fmt: skip


def _leader(label: Label, colour: str) -> Markup:
    if label.leader is None:
        return Markup("")
    start, end = label.leader
    return Markup(
        '<line x1="{:.2f}" y1="{:.2f}" x2="{:.2f}" y2="{:.2f}" stroke="{}" stroke-width="{:.2f}"/>'
    ).format(*start, *end, colour, 0.2 * label.size)
