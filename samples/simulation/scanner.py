"""A drawn sheet as a scanner, a copier or a phone sees it: light, paper, ink, noise.

Ink is rendered on the final pixel grid (`raster`), so that nothing is resampled afterwards; blurs
are symmetric. Faults of the paper (grain, dust, folds, smudges) are made at a lower resolution
where their sharpness does not matter.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from samples.simulation.raster import render
from samples.simulation.settings import Colour, PenStyle, Scan
from samples.simulation.sketch import MAIN_LAYER, PLAN_LAYER, PRINT_LAYER, SQUARES_LAYER
from samples.simulation.strokes import FloatArray, GreyImage, InkStroke, Rng
from samples.simulation.view import PaperView

Float32Array = NDArray[np.float32]


def hand_shadow(u: Float32Array, v: Float32Array, depth: float, rng: Rng) -> Float32Array:
    """The soft-edged shadow of a phone and an arm over part of the sheet."""
    angle, at = rng.uniform(0, 2 * np.pi), rng.uniform(-0.15, 0.35)
    distance = u * np.cos(angle) + v * np.sin(angle) - at + 0.08 * np.sin(5 * (u - v) + rng.uniform(0, 6))
    return np.asarray(1.0 - depth / (1.0 + np.exp(-distance / rng.uniform(0.01, 0.06))), dtype=np.float32)


def stain(mx: Float32Array, my: Float32Array, rng: Rng) -> Float32Array:
    """A ring where a cup stood, or a drop: brown with a darker rim."""
    x, y = rng.uniform(30, 390), rng.uniform(20, 277)
    ring = rng.random() < 0.5
    radius = rng.uniform(32.0, 42.0) if ring else rng.uniform(3.0, 12.0)
    uneven = 1.0 + 0.03 * np.sin(3 * np.arctan2(my - y, mx - x) + rng.uniform(0, 6))
    distance = np.hypot(mx - x, my - y) * uneven
    rim = np.exp(-0.5 * ((distance - radius) / rng.uniform(0.6, 1.5)) ** 2)
    inside = 0.0 if ring else 1.0 / (1.0 + np.exp(np.clip((distance - radius) / 0.4, -30.0, 30.0)))
    depth = rng.uniform(0.05, 0.16)
    return np.asarray(1.0 - depth * np.maximum(rim, 0.6 * inside), dtype=np.float32)


def smudge(mx: Float32Array, my: Float32Array, rng: Rng) -> Float32Array:
    """A long soft spot where a hand rubbed."""
    x, y, angle = rng.uniform(40, 380), rng.uniform(30, 260), rng.uniform(0, np.pi)
    along = (mx - x) * np.cos(angle) + (my - y) * np.sin(angle)
    across = -(mx - x) * np.sin(angle) + (my - y) * np.cos(angle)
    blob = np.exp(-0.5 * ((along / rng.uniform(6, 25)) ** 2 + (across / rng.uniform(2, 7)) ** 2))
    return np.asarray(1.0 - rng.uniform(0.01, 0.06) * blob, dtype=np.float32)


_TONER: Colour = (22, 22, 24)
_UNSHARP_PX = 1.6
"""Radius of scanners' unsharp masks."""
_COARSE = 8
"""Pixels per sample of the soft faults (light, smudges, folds)."""


@dataclass(frozen=True, slots=True)
class Background:
    """A printed sheet: (h, w) uint8 at `px_per_mm`, covering the whole page from its top left corner."""

    grey: GreyImage
    px_per_mm: float


@dataclass(frozen=True, slots=True)
class DrawnPaper:
    """A sheet on the glass: its strokes, the pens that made them, and the print below them."""

    strokes: Sequence[InkStroke]
    pens: PenStyle
    background: Background | None = None
    squares: Colour = (150, 190, 225)
    squares_broken: float = 0.0


def digitise(paper: DrawnPaper, scan: Scan, view: PaperView, rng: Rng) -> NDArray[np.uint8]:
    """The stored image: (h, w) grey, (h, w, 3) RGB, or for one bit (h, w) of 0 and 255."""
    light = _light(scan, view, rng, paper.pens.smudges)
    mask = _paper_mask(view, scan)
    inks = _inks(paper, view, rng)
    printed = None if paper.background is None else _printed(paper.background, view)
    ghost = _show_through(paper.strokes, view, scan)
    specks = _dust(scan, view.size, rng)
    channels = range(3) if scan.mode == "colour" else (None,)
    planes = []
    for channel in channels:
        plane = np.full(view.size, _of(scan.paper, channel), np.float32)
        if printed is not None:
            plane *= printed
        if ghost is not None:
            plane *= ghost
        for cover, colour in inks:
            plane *= 1.0 - cover * np.float32(1.0 - _of(colour, channel) / 255.0)
        bed = np.float32(_of(scan.bed, channel))
        plane = bed + (plane - bed) * mask if mask is not None else plane
        plane *= light
        planes.append(_sensed(plane, scan, rng, specks))
    image = planes[0] if len(planes) == 1 else np.dstack(planes)
    return _one_bit(image, scan, rng) if scan.mode == "bilevel" else image


def _of(colour: Colour, channel: int | None) -> float:
    """One channel of a colour, or its luminance."""
    if channel is None:
        return 0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2]
    return float(colour[channel])


# Ink ----------------------------------------------------------------------------------------------


def _inks(paper: DrawnPaper, view: PaperView, rng: Rng) -> list[tuple[Float32Array, Colour]]:
    """Coverage 0..1 and colour of each layer that is on the sheet."""
    pens = paper.pens
    colours: Mapping[str, Colour] = {
        MAIN_LAYER: pens.colour,
        PLAN_LAYER: pens.plan_colour or pens.colour,
        PRINT_LAYER: _TONER,
        SQUARES_LAYER: paper.squares,
    }
    inks = []
    for layer, colour in colours.items():
        own = [stroke for stroke in paper.strokes if stroke.layer == layer]
        if own:
            cover = render(own, view.to_px, view.size).astype(np.float32) / np.float32(255.0)
            grain = {PRINT_LAYER: 0.0, SQUARES_LAYER: paper.squares_broken}.get(layer, pens.grain)
            if grain > 0:
                _grain(cover, grain, view.px_per_mm, rng)
            if layer in {MAIN_LAYER, PLAN_LAYER} and pens.smear > 0:
                _smear(cover, pens.smear, view.px_per_mm, rng)
            inks.append((cover, colour))
    return inks


def _grain(cover: Float32Array, amount: float, px_per_mm: float, rng: Rng) -> None:
    """Add the speckle of graphite on rough paper, about a tenth of a millimetre, in place."""
    side = 512
    tile = rng.standard_normal((side, side)).astype(np.float32)
    sigma = max(0.4, 0.06 * px_per_mm)
    tile = np.asarray(cv2.GaussianBlur(tile, (0, 0), sigma), dtype=np.float32)
    tile *= np.float32(amount) / tile.std()
    where = np.flatnonzero(cover)
    rows, columns = np.divmod(where, cover.shape[1])
    flat = cover.reshape(-1)
    speckle = 1.0 + tile[rows % side, columns % side]
    flat[where] = np.clip(flat[where] * speckle, 0.0, 1.0)


def _smear(cover: Float32Array, amount: float, px_per_mm: float, rng: Rng) -> None:
    """Add soft lead smeared by the hand: a faint trail to one side of every stroke, in place."""
    small = np.asarray(cv2.resize(cover, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA))
    reach = max(2, round(rng.uniform(1.5, 4.0) * px_per_mm / 4.0))
    trail = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    angle = rng.uniform(0.0, 2.0 * np.pi)
    tip = (round(reach + reach * np.cos(angle)), round(reach + reach * np.sin(angle)))
    cv2.line(trail, (reach, reach), tip, 1.0, 1)
    trail = np.asarray(cv2.GaussianBlur(trail, (0, 0), max(0.5, 0.08 * reach)), dtype=np.float32)
    spread = cv2.filter2D(small, -1, trail / trail.sum() * 2.0, borderType=cv2.BORDER_REPLICATE)
    size = (cover.shape[1], cover.shape[0])
    full = np.asarray(cv2.resize(spread, size, interpolation=cv2.INTER_LINEAR), dtype=np.float32)
    np.maximum(cover, np.clip(full, 0.0, 1.0) * np.float32(amount), out=cover)


def _printed(background: Background, view: PaperView) -> Float32Array:
    """The printed sheet's brightness 0..1 on the view's grid."""
    scale = min(1.0, view.px_per_mm / background.px_per_mm)
    page = background.grey
    if scale < 1.0:
        size = (round(page.shape[1] * scale), round(page.shape[0] * scale))
        page = np.asarray(cv2.resize(page, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    pitch = np.array([page.shape[1] / background.grey.shape[1], page.shape[0] / background.grey.shape[0]])
    pitch = pitch * background.px_per_mm
    if view.k1 == 0.0 and view.curl_mm == 0.0:
        to_page = np.array([[pitch[0], 0.0, -0.5], [0.0, pitch[1], -0.5], [0.0, 0.0, 1.0]])
        warp = view.homography @ np.linalg.inv(to_page)
        seen = cv2.warpPerspective(page, warp, view.size[::-1], flags=cv2.INTER_LINEAR, borderValue=255)
        return np.asarray(seen.astype(np.float32) / np.float32(255.0))
    return _through_lens(page, pitch, view)


def _through_lens(page: GreyImage, pitch: FloatArray, view: PaperView) -> Float32Array:
    """The page's brightness looked up for every pixel, in blocks of rows."""
    height, width = view.size
    result = np.empty(view.size, np.float32)
    for top in range(0, height, 256):
        rows = np.arange(top, min(top + 256, height))
        x, y = np.meshgrid(np.arange(width, dtype=float), rows.astype(float))
        source = view.to_mm(np.column_stack([x.ravel(), y.ravel()])) * pitch - 0.5
        maps = [source[:, k].astype(np.float32).reshape(x.shape) for k in (0, 1)]
        result[rows] = cv2.remap(page, maps[0], maps[1], cv2.INTER_LINEAR, borderValue=255)
    return np.asarray(result / np.float32(255.0))


def _show_through(strokes: Sequence[InkStroke], view: PaperView, scan: Scan) -> Float32Array | None:
    """The drawing on the back showing through: faint, mirrored and blurred."""
    if scan.show_through <= 0.0:
        return None
    back = [
        InkStroke(np.asarray(414.0 - np.conj(s.points), dtype=np.complex128), s.width, s.dark, s.layer)
        for s in strokes[::2]
    ]
    small = (view.size[0] // 3, view.size[1] // 3)
    cover = render(back, lambda xy: (view.to_px(xy) + 0.5) / 3.0 - 0.5, small)
    blurred = cv2.GaussianBlur(cover, (0, 0), max(0.6, 0.12 * view.px_per_mm))
    full = cv2.resize(blurred, (view.size[1], view.size[0]), interpolation=cv2.INTER_LINEAR)
    return 1.0 - full.astype(np.float32) * np.float32(scan.show_through / 255.0)


# Paper and light ----------------------------------------------------------------------------------


def _outline(view: PaperView) -> FloatArray:
    """The paper's outline in pixels, fine enough for a bent edge."""
    x0, y0, x1, y1 = view.paper_mm
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    share = np.linspace(0.0, 1.0, 24, endpoint=False)[:, None]
    edges = [p + (q - p) * share for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    return view.to_px(np.concatenate(edges))


def _paper_mask(view: PaperView, scan: Scan) -> Float32Array | None:
    """1 on the paper, 0 on the bed (and through punched holes); None where the paper fills the image."""
    height, width = view.size
    polygon = np.round(_outline(view) * 16).astype(np.int32)
    mask = np.zeros((height, width), np.uint8)
    cv2.fillPoly(mask, [polygon], 255, lineType=cv2.LINE_AA, shift=4)
    if scan.punched:
        for y in (108.5, 188.5):
            angles = np.linspace(0, 2 * np.pi, 40, endpoint=False)
            rim = np.column_stack([12.0 + 2.9 * np.cos(angles), y + 2.9 * np.sin(angles)])
            hole = np.round(view.to_px(rim) * 16).astype(np.int32)
            cv2.fillPoly(mask, [hole], 0, lineType=cv2.LINE_AA, shift=4)
    if mask.min() == 255:
        return None
    return np.asarray(mask.astype(np.float32) / np.float32(255.0))


def _light(scan: Scan, view: PaperView, rng: Rng, smudges: int) -> Float32Array:
    """Illumination with folds, smudges, shadows and the paper's edge, about 1."""
    height, width = (max(2, side // _COARSE) for side in view.size)
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    u, v = x / width - 0.5, y / height - 0.5
    tilt = rng.normal(0.0, 0.5, 5) * scan.shading
    light = 1.0 + tilt[0] * u + tilt[1] * v - abs(tilt[2]) * (u * u + v * v) * 2
    light += tilt[3] * np.sin(3 * u + 6 * tilt[4])
    light *= min(1.0, 1.02 / float(light.max()))  # a camera exposes for the brightest part
    if scan.shadow > 0:
        light *= hand_shadow(u, v, scan.shadow, rng)
    xy_mm = view.to_mm(np.column_stack([x.ravel(), y.ravel()]).astype(float) * _COARSE).astype(np.float32)
    mx, my = xy_mm[:, 0].reshape(x.shape), xy_mm[:, 1].reshape(x.shape)
    if scan.fold:
        for at, along in ((rng.normal(210, 4), mx), (rng.normal(148.5, 4), my)):
            distance = (along - np.float32(at)) / 1.6
            soft, sharp = 0.07 * distance * np.exp(-0.5 * distance**2), 0.03 * np.exp(-2 * distance**2)
            light *= 1.0 - np.float32(scan.crease) * (soft + sharp)
    for _ in range(scan.stains):
        light *= stain(mx, my, rng)
    for _ in range(smudges):
        light *= smudge(mx, my, rng)
    if scan.device != "phone":
        inside = np.minimum.reduce([mx, 420 - mx, my, 297 - my])
        light *= 1.0 - 0.25 * np.exp(-(((inside + 1.2) / 0.9) ** 2))
    full = cv2.resize(light.astype(np.float32), (view.size[1], view.size[0]), interpolation=cv2.INTER_LINEAR)
    return np.asarray(full, dtype=np.float32)


# Sensor -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Speck:
    """A speck or hair on the glass: points in pixels (a speck has one), radius, brightness."""

    points: FloatArray
    radius_px: float
    value: float


def _sensed(plane: Float32Array, scan: Scan, rng: Rng, specks: Sequence[_Speck]) -> GreyImage:
    """Dust, blur, grain and noise, then eight bits."""
    for speck in specks:
        fixed = np.round(speck.points * 16).astype(np.int32)
        if len(fixed) > 1:
            cv2.polylines(plane, [fixed], isClosed=False, color=speck.value, lineType=cv2.LINE_AA, shift=4)
        else:
            x, y = (int(v) for v in fixed[0])
            cv2.circle(plane, (x, y), round(speck.radius_px * 16), speck.value, -1, cv2.LINE_AA, 4)
    if scan.blur_px > 0:
        plane = np.asarray(cv2.GaussianBlur(plane, (0, 0), scan.blur_px), dtype=np.float32)
    if scan.sharpen > 0:
        soft = np.asarray(cv2.GaussianBlur(plane, (0, 0), _UNSHARP_PX), dtype=np.float32)
        plane = plane + np.float32(scan.sharpen) * (plane - soft)
    spread = float(np.hypot(scan.noise, scan.tint_grain))
    if spread > 0:
        plane = plane + _noise(plane.shape, spread, rng)
    black, white = scan.levels
    plane = (plane - np.float32(black)) * np.float32(255.0 / (white - black))
    return np.asarray(np.clip(plane + np.float32(0.5), 0.0, 255.0).astype(np.uint8))


def _noise(shape: tuple[int, ...], spread: float, rng: Rng) -> Float32Array:
    """Gaussian noise, a large tile of it laid at random."""
    side = 1499
    tile = rng.standard_normal((side, side), dtype=np.float32) * np.float32(spread)
    repeats = (shape[0] // side + 1, shape[1] // side + 1)
    return np.asarray(np.tile(tile, repeats)[: shape[0], : shape[1]])


def _dust(scan: Scan, size: tuple[int, int], rng: Rng) -> list[_Speck]:
    """Specks and hairs, dark or bright."""
    pitch = scan.dpi / 25.4
    specks = []
    for _ in range(scan.streaks):
        x = rng.uniform(0.0, size[1])
        line = np.array([[x, -9.0], [x + rng.normal(0.0, 0.5), size[0] + 9.0]])
        specks.append(_Speck(line, 1.0, float(rng.uniform(110.0, 200.0))))
    for _ in range(scan.dust):
        place = rng.uniform(0.0, 1.0, 2) * np.array([size[1], size[0]])
        value = float(rng.choice([60.0, 120.0, 180.0, 252.0]))
        points = place[None, :]
        if rng.random() < 0.15:
            angle = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.normal(0, 0.25, 24))
            steps = np.column_stack([np.cos(angle), np.sin(angle)])
            points = place + np.cumsum(steps, axis=0) * 0.15 * pitch
        specks.append(_Speck(points, max(0.5, float(rng.exponential(0.12)) * pitch), value))
    return specks


def _one_bit(image: GreyImage, scan: Scan, rng: Rng) -> GreyImage:
    """One bit by a copier's threshold, with ragged edges and pepper; or by error diffusion."""
    if scan.dithered:
        white = np.float32(255.0 / (0.93 * _of(scan.paper, None)))
        bright = np.clip(image.astype(np.float32) * white, 0.0, 255.0).astype(np.uint8)
        return np.asarray(Image.fromarray(bright).convert("1").convert("L"), dtype=np.uint8)
    level = rng.uniform(0.68, 0.82) * 0.96 * _of(scan.paper, None)
    ragged = image.astype(np.float32) + _noise(image.shape, 7.0, rng)
    bits = np.where(ragged > level, 255, 0).astype(np.uint8)
    pepper = rng.integers(0, bits.size, int(rng.uniform(0, 8e-6) * bits.size))
    bits.reshape(-1)[pepper] = 0
    return bits
