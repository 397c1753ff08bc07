"""A scene as SVG over the scan: sharp at every size, and with names to point at."""

import base64
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from markupsafe import Markup

from grader.records import Box
from grader.scene import (
    ARROW_WIDTH_MM,
    BADGE_MM,
    COLOURS,
    DASH_MM,
    GHOST_COLOUR,
    MARKS,
    Arrow,
    Picture,
    Scene,
)

CLOSE_UP_MARGIN_MM = 9.0
LEAST_CLOSE_UP_MM = 70.0
CLOSE_UP_BELOW = 0.5
"""A plan smaller than this share of the sheet's width is worth a close-up."""


@dataclass(frozen=True, slots=True)
class View:
    """One look at a sheet: the whole, or a plan close up."""

    kind: str
    """``sheet``, ``velocity_plan`` or ``acceleration_plan``."""
    caption: str
    svg: Markup


def views(picture: Picture, number: int, captions: Mapping[str, str]) -> list[View]:
    """The whole sheet, then each plan that is small on it close up; the scan is stored once."""
    scan = f"scan-{number}"
    width, height = picture.scene.page_mm
    data = base64.b64encode(picture.jpeg).decode("ascii")
    image = Markup(
        '<image id="{}" width="{}" height="{}" preserveAspectRatio="none" href="data:image/jpeg;base64,{}"/>'
    ).format(scan, width, height, data)
    shapes = _shapes(picture.scene)
    whole = _svg((0.0, 0.0, width, height), image, shapes, captions["sheet"])
    found = [View("sheet", captions["sheet"], whole)]
    again = Markup('<use href="#{}"/>').format(scan)
    for kind, letter in (("velocity_plan", "v"), ("acceleration_plan", "a")):
        box = _close_up([arrow for arrow in picture.scene.arrows if arrow.name[0] == letter], picture.scene)
        if box is not None:
            found.append(View(kind, captions[kind], _svg(box, again, shapes, captions[kind])))
    return found


def _svg(box: Box, image: Markup, shapes: Markup, caption: str) -> Markup:
    return Markup(
        '<svg class="sheet" viewBox="{:.1f} {:.1f} {:.1f} {:.1f}" role="img" aria-label="{}">'
        '{}<g class="marks">{}</g></svg>'
    ).format(*box, caption, image, shapes)


def _close_up(arrows: list[Arrow], scene: Scene) -> Box | None:
    """A box around some arrows and their labels in the sheet's aspect, None where it shows no more."""
    if not arrows:
        return None
    xs = [x for arrow in arrows for x in (arrow.tail[0], arrow.tip[0], arrow.label[0], arrow.label[0] + arrow.label[2])]
    ys = [y for arrow in arrows for y in (arrow.tail[1], arrow.tip[1], arrow.label[1], arrow.label[1] + arrow.label[3])]
    wide, high = scene.page_mm
    width = max(max(xs) - min(xs) + 2 * CLOSE_UP_MARGIN_MM, LEAST_CLOSE_UP_MM)
    height = max(max(ys) - min(ys) + 2 * CLOSE_UP_MARGIN_MM, LEAST_CLOSE_UP_MM * 0.6)
    if width > CLOSE_UP_BELOW * wide and height > CLOSE_UP_BELOW * high:
        return None
    x = min(max((min(xs) + max(xs) - width) / 2, 0.0), max(wide - width, 0.0))
    y = min(max((min(ys) + max(ys) - height) / 2, 0.0), max(high - height, 0.0))
    return (x, y, width, height)


def _shapes(scene: Scene) -> Markup:
    ghosts = (
        Markup(
            '<line x1="{:.2f}" y1="{:.2f}" x2="{:.2f}" y2="{:.2f}" stroke="{}" stroke-width=".45"'
            ' stroke-dasharray=".9 .9"/><circle cx="{:.2f}" cy="{:.2f}" r=".9" fill="none" stroke="{}"'
            ' stroke-width=".3"/>'
        ).format(*ghost.tail, *ghost.tip, GHOST_COLOUR, *ghost.tip, GHOST_COLOUR)
        for ghost in scene.ghosts
    )
    dots = (
        Markup(
            '<circle cx="{:.2f}" cy="{:.2f}" r=".8" fill="none" stroke="{}" stroke-width=".3">'
            "<title>{}</title></circle>"
        ).format(*dot.at, COLOURS["review"] if dot.doubtful else "#24303c", dot.name)
        for dot in scene.dots
    )
    arrows = (_arrow(arrow) for arrow in scene.arrows)
    labels = (_label(arrow) for arrow in scene.arrows)
    return _joined(ghosts) + _joined(arrows) + _joined(dots) + _joined(labels)


def _joined(parts: Iterable[Markup]) -> Markup:
    return Markup("").join(parts)


def _arrow(arrow: Arrow) -> Markup:
    colour = COLOURS[arrow.verdict]
    dashes = Markup(' stroke-dasharray="{} {}"').format(*DASH_MM) if arrow.doubtful else Markup("")
    corners = " ".join(f"{x:.2f},{y:.2f}" for x, y in arrow.head)
    return Markup(
        '<g opacity=".85"><title>{}</title><line x1="{:.2f}" y1="{:.2f}" x2="{:.2f}" y2="{:.2f}"'
        ' stroke="{}" stroke-width="{}"{}/><polygon points="{}" fill="{}"/></g>'
    ).format(arrow.name, *arrow.tail, *arrow.neck, colour, ARROW_WIDTH_MM, dashes, corners, colour)


def _label(arrow: Arrow) -> Markup:
    """The mark in a disc and the name on a whitened ground, with a thin line to an arrow far off."""
    x, y, width, height = arrow.label
    colour = COLOURS[arrow.verdict]
    leader = Markup("")
    if arrow.leader is not None:
        (x1, y1), (x2, y2) = arrow.leader
        leader = Markup(
            '<line x1="{:.2f}" y1="{:.2f}" x2="{:.2f}" y2="{:.2f}" stroke="{}" stroke-width=".2"/>'
        ).format(x1, y1, x2, y2, colour)
    radius = BADGE_MM / 2 - 0.15
    letter, _, rest = arrow.name.partition("_")
    return leader + Markup(
        '<rect x="{:.2f}" y="{:.2f}" width="{:.2f}" height="{:.2f}" rx="1.6" fill="#fff" opacity=".82"/>'
        '<circle cx="{:.2f}" cy="{:.2f}" r="{:.2f}" fill="{}"/>'
        '<text x="{:.2f}" y="{:.2f}" class="mark">{}</text>'
        '<text x="{:.2f}" y="{:.2f}" class="name" fill="{}">{}<tspan class="index" dy=".7">{}</tspan></text>'
    ).format(
        x, y, width, height, x + BADGE_MM / 2 + 0.1, y + height / 2, radius, colour,
        x + BADGE_MM / 2 + 0.1, y + height / 2 + 0.95, MARKS[arrow.verdict],
        x + BADGE_MM + 0.6, y + height - 1.25, colour, letter, rest.replace("_", " "),
    )  # fmt: skip
