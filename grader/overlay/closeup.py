"""Close-ups of a sheet as SVG: the whole, each plan, and the part that a mistake concerns."""

import base64
import math
from collections.abc import Collection, Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace

from markupsafe import Markup

from grader.language import NO_NAMES
from grader.outcomes import CHARGED
from grader.overlay.scene import XY, Arrow, Ghost, Layer, Picture, Scene, between, is_in, layers_of
from grader.records import MECHANISM, Box
from reference.authored.assignment import SCALE_NAMES
from reference.drawing.canvas import FONTS, elements
from reference.quantities import scale_of

CLOSE_UP_MARGIN_MM = 12.0
LEAST_CLOSE_UP_MM = 60.0
CLOSE_UP_BELOW = 0.55
"""A plan smaller than this share of the sheet gets a close-up."""
WIDE_TO_HIGH = (1.3, 1.9)
"""Aspect ratios of close-ups that fit a page well."""
DETAIL_MARGIN_MM = 8.0
LEAST_DETAIL_MM = 36.0
LONG_MM, LITTLE_SHARE = 30.0, 0.25
"""For a vector this long with a smaller relative error, only the end is shown."""
SAME_PLACE_MM = 0.05
CUTS = 64
MOST_DETAIL_SHARE = 0.8
"""A detail as large as this share of the sheet shows no more than the whole."""
WHOLE_SIZE_PER_MM = 0.0041
CLOSE_UP_SIZE_PER_MM = 0.0105
DETAIL_SIZE_PER_MM = 0.0145
"""Size of marks and letters by the width shown: close-ups stand two in a row, details up to three."""
LEAST_SIZE, LARGEST_SIZE = 0.3, 3.0


@dataclass(frozen=True, slots=True)
class PageView:
    """A part of a page, or all of it, with its marks.

    Attributes
    ----------
    kind : ``sheet``, ``velocity_plan``, ``acceleration_plan`` or ``detail``
    picture : index of the page among the submission's pictures, from 0
    box : the visible part of the page
    names : the vectors that are named in it
    """

    kind: str
    picture: int
    box: Box
    layers: tuple[Layer, ...]
    names: tuple[str, ...]


def page_views(picture: Picture, index: int, names: Mapping[str, str] = NO_NAMES) -> list[PageView]:
    """Return the whole sheet, then close-ups of plans that are small on it; `names` as students know them."""
    scene = picture.scene
    plans = {arrow.figure for arrow in scene.arrows} - {MECHANISM}
    close_ups = {
        figure: box
        for figure in sorted(plans, key=lambda figure: (SCALE_NAMES.index(scale_of(figure)), figure))
        if (box := _close_up(_part(scene, figure))) is not None
    }
    if not picture.scan:
        # The page contains only the plans themselves.
        figures = dict.fromkeys(arrow.figure for arrow in scene.arrows)
        boxes = {
            figure: _box(_arrows_of(scene, figure), scene, CLOSE_UP_MARGIN_MM, LEAST_CLOSE_UP_MM)
            for figure in figures
        }
        return [_plan(scene, index, figure, box, names) for figure, box in boxes.items()]
    whole = (0.0, 0.0, *scene.page_mm)
    named = [arrow for arrow in scene.arrows if arrow.figure not in close_ups and arrow.is_named]
    layers = _marks(scene, whole, WHOLE_SIZE_PER_MM, named, names)
    return [
        PageView("sheet", index, whole, layers, tuple(arrow.name for arrow in named)),
        *(_plan(scene, index, figure, box, names) for figure, box in close_ups.items()),
    ]


def _plan(scene: Scene, index: int, figure: str, box: Box, names: Mapping[str, str]) -> PageView:
    part = _part(scene, figure)
    layers = _marks(part, box, CLOSE_UP_SIZE_PER_MM, part.arrows, names)
    return PageView(figure, index, box, layers, tuple(arrow.name for arrow in part.arrows))


def detail(
    pictures: Collection[Picture], concerned: AbstractSet[str], names: Mapping[str, str] = NO_NAMES
) -> PageView | None:
    """Return a view of some vectors and the expected ones; None if none of them is drawn.

    For a long vector with a small error it shows the end of the first.
    """
    for index, picture in enumerate(pictures):
        arrows = [arrow for arrow in picture.scene.arrows if arrow.name in concerned]
        if not arrows:
            continue
        figure = arrows[0].figure
        part = replace(
            _part(picture.scene, figure),
            arrows=tuple(arrow for arrow in arrows if arrow.figure == figure),
            ghosts=tuple(
                ghost for ghost in picture.scene.ghosts if ghost.name in concerned and ghost.figure == figure
            ),
        )
        box = _box_of_tips(part) or _box(
            [*part.arrows, *part.ghosts], part, DETAIL_MARGIN_MM, LEAST_DETAIL_MM
        )
        if picture.scan and box[2] > MOST_DETAIL_SHARE * part.page_mm[0]:
            return None
        others = [arrow for arrow in _arrows_of(picture.scene, figure) if arrow not in part.arrows]
        named = [cut for arrow in part.arrows if (cut := _within(arrow, box)) is not None]
        layers = _marks(part, box, DETAIL_SIZE_PER_MM, named, names, others)
        return PageView("detail", index, box, layers, tuple(arrow.name for arrow in named))
    return None


def _box_of_tips(part: Scene) -> Box | None:
    """Return a box around the first vector's end and its right position, None if the whole shows more."""
    first = part.arrows[0]
    ends = [arrow for arrow in part.arrows if math.dist(arrow.tip, first.tip) < SAME_PLACE_MM]
    aims = [ghost for ghost in part.ghosts if ghost.name in {arrow.name for arrow in ends}]
    longest = max(arrow.length for arrow in ends)
    residual = max((math.dist(ghost.tip, first.tip) for ghost in aims), default=0.0)
    if not aims or longest < LONG_MM or residual > LITTLE_SHARE * longest:
        return None
    points = [Ghost("", "", first.tip, ghost.tip) for ghost in aims]
    return _box(points, part, 2 * DETAIL_MARGIN_MM, LEAST_DETAIL_MM)


def _within(arrow: Arrow, box: Box) -> Arrow | None:
    """Return the part of an arrow inside a box, to be named there; None if all of it is outside."""
    steps = [between(arrow.tail, arrow.tip, share / CUTS) for share in range(CUTS + 1)]
    inside = [step for step in steps if is_in(step, box)]
    return replace(arrow, tail=inside[0], tip=inside[-1]) if inside else None


def _arrows_of(scene: Scene, figure: str) -> list[Arrow]:
    return [arrow for arrow in scene.arrows if arrow.figure == figure]


def _part(scene: Scene, figure: str) -> Scene:
    """Return a figure of a scene; ghosts of vectors under review appear only in its close-ups."""
    return replace(
        scene,
        arrows=tuple(_arrows_of(scene, figure)),
        ghosts=tuple(ghost for ghost in scene.ghosts if ghost.figure == figure and ghost.verdict in CHARGED),
        dots=tuple(dot for dot in scene.dots if dot.figure in {"", figure}),
    )


# Where to look ------------------------------------------------------------------------------------


def _close_up(part: Scene) -> Box | None:
    """Return a box around a plan, None if it would show hardly more than the whole sheet."""
    if not part.arrows:
        return None
    box = _box([*part.arrows, *part.ghosts], part, CLOSE_UP_MARGIN_MM, LEAST_CLOSE_UP_MM)
    wide, high = part.page_mm
    if box[2] > CLOSE_UP_BELOW * wide or box[3] > CLOSE_UP_BELOW * high * 1.3:
        return None
    return box


def _box(things: Collection[Arrow | Ghost], scene: Scene, margin_mm: float, least_mm: float) -> Box:
    """Return a box around arrows and ghosts, of a shape that fits a page well, inside the sheet."""
    points = [point for one in things for point in (one.tail, one.tip)]
    return box_around(points, margin_mm, least_mm, scene.page_mm)


def box_around(points: Collection[XY], margin_mm: float, least_mm: float, page_mm: XY) -> Box:
    """Return a box around some points, of a shape that fits a page well, inside the sheet."""
    xs, ys = [x for x, _ in points], [y for _, y in points]
    wide, high = page_mm
    width = max(max(xs) - min(xs) + 2 * margin_mm, least_mm)
    height = max(max(ys) - min(ys) + 2 * margin_mm, width / WIDE_TO_HIGH[1])
    width = max(width, height * WIDE_TO_HIGH[0])
    x = min(max((min(xs) + max(xs) - width) / 2, 0.0), max(wide - width, 0.0))
    y = min(max((min(ys) + max(ys) - height) / 2, 0.0), max(high - height, 0.0))
    return (x, y, width, height)


def _marks(
    scene: Scene,
    box: Box,
    size_per_mm: float,
    named: Collection[Arrow],
    names: Mapping[str, str],
    faint: Collection[Arrow] = (),
) -> tuple[Layer, ...]:
    """Return the marks in a box, in a size that suits its width on the page."""
    size = min(max(size_per_mm * box[2], LEAST_SIZE), LARGEST_SIZE)
    return layers_of(scene, box, named, names, size=size, faint=faint)


# As elements of a page ----------------------------------------------------------------------------


def scan_element(picture: Picture, index: int) -> Markup:
    """Return the scan, which every view of the page shows by its name; empty if there is none."""
    if not picture.scan:
        return Markup("")
    width, height = picture.scene.page_mm
    kind = "png" if picture.scan.startswith(b"\x89PNG") else "jpeg"
    return Markup(
        '<image id="scan-{}" width="{}" height="{}" preserveAspectRatio="none"'
        ' href="data:image/{};base64,{}"/>'
    ).format(index, width, height, kind, base64.b64encode(picture.scan).decode("ascii"))


def svg(view: PageView, picture: Picture, description: str) -> Markup:
    """Return a view as SVG; `description` is its text. The scan comes from the page's `scan_element`."""
    image = Markup('<use href="#scan-{}"/>').format(view.picture) if picture.scan else Markup("")
    return Markup(
        '<svg class="sheet" viewBox="{:.1f} {:.1f} {:.1f} {:.1f}" role="img" aria-label="{}"'
        ' font-family="{}">{}<g class="marks">{}</g></svg>'
    ).format(*view.box, description, FONTS, image, Markup("").join(_elements(view)))


def _elements(view: PageView) -> Iterator[Markup]:
    for layer in view.layers:
        shapes = Markup("".join(elements(layer.shapes)))  # noqa: S704 - written by the canvas
        opaque = layer.opacity == 1.0
        yield shapes if opaque else Markup('<g opacity="{:g}">{}</g>').format(layer.opacity, shapes)


# A question about one vector ----------------------------------------------------------------------

LOOK_MARGIN_MM = 14.0
LEAST_LOOK_MM = 45.0
LOOK_SIZE_PER_MM = 0.0095
"""A review view fills a screen: its marks are smaller than those of details shown three in a row."""


def look(
    scene: Scene, name: str, ghost: Ghost | None, names: Mapping[str, str] = NO_NAMES
) -> tuple[Box, Markup] | None:
    """Return a box around a vector or link and the expected one, and its figure's marks as SVG elements.

    The others of its figure are faint. None if it is not drawn and its expected position is unknown.
    """
    arrows = tuple(one for one in scene.arrows if one.name == name)[:1]
    ghosts = () if ghost is None else (ghost,)
    if not arrows and not ghosts:
        return None
    figure = (*arrows, *ghosts)[0].figure
    box = _box([*arrows, *ghosts], scene, LOOK_MARGIN_MM, LEAST_LOOK_MM)
    part = replace(scene, arrows=arrows, ghosts=ghosts, dots=())
    others = [one for one in _arrows_of(scene, figure) if one not in arrows]
    layers = _marks(part, box, LOOK_SIZE_PER_MM, arrows, names, others)
    return box, Markup("").join(_elements(PageView("detail", 0, box, layers, (name,))))
