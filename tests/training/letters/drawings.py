"""Windows of drawings with letters, to train the detector: random line work, and simulated sheets.

A window is a piece of the ink map, 96 x 96 pixels at 6 a millimetre, with the boxes of the signs on it.
The letters are those of handwriting fonts; the background is drawn here at random, or is a simulated
sheet without its letters.
"""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from unittest import mock

import cv2
import numpy as np

from grader.records import PageRef
from grader.scan.handwriting.letters import DETECTED, PX_PER_MM
from grader.scan.page import open_page
from reference.authored.assignment import load_assignment
from samples.simulation import any_settings, simulate
from samples.simulation.lettering import WrittenText, write
from tests.training.letters.glyphs import Glyph

SIDE_PX = 96
FINE = 2
"""Windows are drawn at twice their resolution."""
_UNIT = FINE * PX_PER_MM
_SIDE = FINE * SIDE_PX
_CAPITAL_PX = 66.0
"""Height of capitals in the glyphs' pictures."""
_NODES = "oabcdABCDpπ"
_COMMON = "eEFfGKsknMOr12345"
_DEVICES = ("flatbed", "flatbed", "copier", "phone")
_RESOLUTIONS_DPI = (150.0, 200.0, 300.0, 300.0)
_TASKS = ("pump", "press", "engine", "shaper", "piston")


@dataclass(slots=True)
class Window:
    """A window being drawn.

    Attributes
    ----------
    ink : (192, 192) share of light taken, 0..1
    signs : class, and left, top, right, bottom in pixels of the drawing
    places : points that letters are written beside
    """

    ink: np.ndarray = field(default_factory=lambda: np.zeros((_SIDE, _SIDE), np.float32))
    signs: list[tuple[int, np.ndarray]] = field(default_factory=list)
    places: list[np.ndarray] = field(default_factory=list)

    def add(self, layer: np.ndarray, left: int = 0, top: int = 0) -> None:
        """Add ink; where it overlaps other ink, the darker one counts."""
        high, wide = layer.shape
        x, y = max(left, 0), max(top, 0)
        right, low = min(left + wide, _SIDE), min(top + high, _SIDE)
        if x < right and y < low:
            part = self.ink[y:low, x:right]
            np.maximum(part, layer[y - top : low - top, x - left : right - left], out=part)


class Alphabet:
    """Glyphs by sign and family, and digits that people wrote."""

    def __init__(self, families: Sequence[Sequence[Glyph]], written: Sequence[Glyph]) -> None:
        self.families = []
        for glyphs in families:
            ways: dict[str, list[Glyph]] = {}
            for glyph in glyphs:
                ways.setdefault(glyph.sign, []).append(glyph)
            self.families.append(ways)
        self.digits: dict[str, list[Glyph]] = {}
        for glyph in written:
            self.digits.setdefault(glyph.sign, []).append(glyph)

    def hand(self, rng: np.random.Generator) -> dict[str, list[Glyph]]:
        """The signs of one hand; its digits are sometimes a real person's."""
        own = self.families[rng.integers(len(self.families))]
        return own | self.digits if self.digits and rng.random() < 0.25 else own


# Writing ------------------------------------------------------------------------------------------


def text_of(rng: np.random.Generator) -> list[tuple[str, float, float]]:
    """Signs of a short text, with size and height above the base line in capitals."""
    lot = rng.random()
    if lot < 0.6:
        letters = _NODES if rng.random() < 0.75 else _COMMON
        signs = [(_one(letters, rng), 1.0, 0.0)]
        if rng.random() < 0.3:
            signs += [("'", 1.0, 0.0)] * (1 + (rng.random() < 0.15))
        if rng.random() < 0.25:
            signs.append((_one("123456789ABCD", rng), 0.66, -0.32))
        return signs
    if lot < 0.8:
        below = [(_one("ABCDEFabcd1234", rng), 0.66, -0.32) for _ in range(rng.integers(1, 3))]
        above = [(_one("ntrk", rng), 0.66, 0.52)] if rng.random() < 0.35 else []
        return [(_one("vanωεk", rng), 1.0, 0.0), *below, *above]
    if lot < 0.9:
        return [(_one("".join(DETECTED), rng), 1.0, 0.0)]
    return [(_one("0123456789,.-=/:()abcdnvkLMmsx", rng), 1.0, 0.0) for _ in range(rng.integers(2, 6))]


def _one(of: str, rng: np.random.Generator) -> str:
    return of[rng.integers(len(of))]


def _shape(glyph: Glyph, rng: np.random.Generator, hand: dict[str, float]) -> np.ndarray:
    """The sign in a hand's slant, proportions and pen, 0..255, cut to its ink."""
    picture = glyph.picture
    if glyph.bones is not None and hand["pen"] > 0.0:
        pen = max(2, round(hand["pen"]))
        picture = cv2.dilate(glyph.bones, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (pen, pen)))
    scale = hand["scale"] * np.exp(rng.normal(0.0, 0.06))
    turn = hand["turn"] + rng.normal(0.0, 0.04)
    shape = (
        scale
        * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        @ np.array([[hand["aspect"], -hand["slant"]], [0.0, 1.0]])
    )
    high, wide = picture.shape
    side = int(1.5 * scale * max(high, wide)) + 6
    inverse = np.linalg.inv(shape)
    y, x = np.mgrid[0:side, 0:side].astype(np.float32) - side / 2.0
    wobble = rng.normal(0.0, hand["wobble"], (2, 4, 4)) * max(high, wide)
    dx, dy = (cv2.resize(plane, (side, side), interpolation=cv2.INTER_CUBIC) for plane in wobble)
    u = inverse[0, 0] * x + inverse[0, 1] * y + wide / 2.0 + dx
    v = inverse[1, 0] * x + inverse[1, 1] * y + high / 2.0 + dy
    if scale < 0.7:
        picture = cv2.GaussianBlur(picture, (0, 0), 0.4 / scale)
    drawn = cv2.remap(picture, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR)
    ink = drawn > 70
    rows, columns = np.flatnonzero(ink.any(axis=1)), np.flatnonzero(ink.any(axis=0))
    if len(rows) == 0:
        return np.zeros((0, 0), np.float32)
    cut = drawn[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].astype(np.float32) / 255.0
    return np.minimum(1.0, 1.3 * cut)


def hand_of(rng: np.random.Generator, capital_mm: float) -> dict[str, float]:
    """A random style of writing: size, pen, slant, proportions, darkness."""
    scale = capital_mm * _UNIT / _CAPITAL_PX
    # The pen is 0.2 to 0.7 mm, whatever the size of the letters.
    pen = rng.uniform(0.2, 0.65) * _UNIT / scale
    return {
        "scale": scale,
        "pen": min(pen, 16.0) if rng.random() < 0.8 else 0.0,
        "slant": rng.uniform(-0.1, 0.35) if rng.random() < 0.7 else 0.0,
        "aspect": float(np.exp(rng.uniform(-0.35, 0.25))),
        "turn": rng.normal(0.0, 0.06),
        "wobble": rng.uniform(0.0, 0.025),
        "gap": rng.uniform(0.05, 0.25),
        "dark": rng.uniform(0.45, 1.0),
    }


def written(
    window: Window,
    signs: Sequence[tuple[str, float, float]],
    glyphs: dict[str, list[Glyph]],
    hand: dict[str, float],
    middle: np.ndarray,
    rng: np.random.Generator,
) -> bool:
    """Write a text about a middle; False where it would lie on other letters or a sign is missing."""
    capital = hand["scale"] * _CAPITAL_PX
    at, parts = 0.0, []
    for sign, size, lift in signs:
        known = "o" if sign in "O0" else "'" if sign == "," else sign
        ways = glyphs.get(known)
        if not ways:
            return False
        glyph = ways[rng.integers(len(ways))]
        shape = _shape(glyph, rng, hand | {"scale": hand["scale"] * size, "pen": hand["pen"] / size})
        if shape.size == 0:
            return False
        high, wide = shape.shape
        drop = 0.3 * capital * size if sign in "gpyμ" and high > 0.7 * capital * size else 0.0
        raised = 0.7 * capital if sign == "'" else 0.3 * capital if sign in "-=" else 0.0
        top = -lift * capital - raised + drop - high + rng.normal(0.0, 0.04) * capital
        parts.append((known, shape, at, top))
        at += wide + hand["gap"] * capital * size
    low = np.array([min(part[2] for part in parts), min(part[3] for part in parts)])
    far = np.array([max(p[2] + p[1].shape[1] for p in parts), max(p[3] + p[1].shape[0] for p in parts)])
    shift = np.rint(middle - (low + far) / 2.0)
    boxes = [
        np.array([x, y, x + shape.shape[1], y + shape.shape[0]]) + np.tile(shift, 2)
        for _, shape, x, y in parts
    ]
    if any(_shared(box, other) > 0.25 for box in boxes for _, other in window.signs):
        return False
    for (sign, shape, x, y), box in zip(parts, boxes, strict=True):
        window.add(hand["dark"] * shape, round(x + shift[0]), round(y + shift[1]))
        if sign in DETECTED:
            window.signs.append((DETECTED.index(sign), box))
    if rng.random() < 0.04:
        bar = np.ones((max(1, round(0.3 * _UNIT)), max(2, round(far[0] - low[0]))), np.float32)
        window.add(hand["dark"] * bar, round(low[0] + shift[0]), round(low[1] + shift[1] - 0.25 * capital))
    return True


def _shared(one: np.ndarray, other: np.ndarray) -> float:
    """Share of the smaller box that lies in the other."""
    size = np.minimum(one[2:], other[2:]) - np.maximum(one[:2], other[:2])
    area = min(np.prod(one[2:] - one[:2]), np.prod(other[2:] - other[:2]))
    return float(np.prod(np.maximum(size, 0.0)) / max(area, 1.0))


# Line work ----------------------------------------------------------------------------------------


def _stroke(
    window: Window, points: Sequence[np.ndarray], width_mm: float, dark: float, *, fill: bool = False
) -> None:
    layer = np.zeros((_SIDE, _SIDE), np.uint8)
    px = np.rint(np.array(points) * 16.0).astype(np.int32).reshape(-1, 1, 2)
    if fill:
        cv2.fillPoly(layer, [px], 255, cv2.LINE_AA, 4)
    cv2.polylines(layer, [px], fill, 255, max(1, round(width_mm * _UNIT)), cv2.LINE_AA, 4)
    window.add(layer.astype(np.float32) * (dark / 255.0))


def _unit(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def _place(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(0.05, 0.95, 2) * _SIDE


def _dashed(
    window: Window, p: np.ndarray, q: np.ndarray, width: float, dark: float, rng: np.random.Generator
) -> None:
    length = float(np.hypot(*(q - p)))
    along, at = (q - p) / max(length, 1.0), 0.0
    dash, gap = rng.uniform(1.5, 9.0) * _UNIT, rng.uniform(0.6, 2.0) * _UNIT
    chain = rng.random() < 0.4
    while at < length:
        _stroke(window, [p + at * along, p + min(at + dash, length) * along], width, dark)
        if chain:
            middle = at + dash + gap / 2.0
            _stroke(window, [p + middle * along, p + (middle + 0.3 * _UNIT) * along], width, dark)
        at += dash + gap * (2.0 if chain else 1.0)


def _line(
    window: Window, p: np.ndarray, q: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]
) -> None:
    thin = rng.random() < 0.35
    width, dark = (0.6 * pen[0], 0.6 * pen[1]) if thin else pen
    if rng.random() < 0.15:
        _dashed(window, p, q, width, dark, rng)
        return
    bow = rng.normal(0.0, 0.15) * _UNIT * np.array([-(q - p)[1], (q - p)[0]]) / max(np.hypot(*(q - p)), 1.0)
    _stroke(window, [p, (p + q) / 2.0 + bow, q], width, dark)


def _arrowhead(
    window: Window, tip: np.ndarray, angle: float, rng: np.random.Generator, pen: tuple[float, float]
) -> None:
    length, spread = rng.uniform(1.8, 6.0) * _UNIT, rng.uniform(0.12, 0.5)
    left, right = tip - length * _unit(angle - spread), tip - length * _unit(angle + spread)
    kind = rng.integers(4)
    if kind == 0:
        _stroke(window, [left, tip, right], pen[0], pen[1])
    elif kind == 1:
        _stroke(window, [left, tip, right], 0.15, pen[1], fill=True)
    elif kind == 2:
        _stroke(window, [left, tip], pen[0], pen[1])
    else:
        _stroke(window, [left, tip, right, left], 0.8 * pen[0], pen[1])


def _circle(window: Window, at: np.ndarray, radius_mm: float, width_mm: float, dark: float) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 33)
    points = at + radius_mm * _UNIT * np.column_stack([np.cos(angles), np.sin(angles)])
    _stroke(window, list(points), width_mm, dark)


def _node(window: Window, at: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    """Draw a point where lines end or cross, with arrowheads, a dot or a circle."""
    window.places.append(at)
    circle = rng.uniform(0.4, 1.5) if rng.random() < 0.3 else 0.0
    for _ in range(rng.integers(1, 5)):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        inner = circle * _UNIT * (rng.random() < 0.5)
        start = at + rng.normal(0.0, 0.25, 2) * _UNIT
        _line(
            window, start + inner * _unit(angle), start + rng.choice([60, 150, 300]) * _unit(angle), rng, pen
        )
        if rng.random() < 0.3:
            _line(window, start, start - rng.uniform(5, 80) * _unit(angle), rng, pen)
        if rng.random() < 0.3:
            _arrowhead(window, start, angle + np.pi, rng, pen)
    if circle:
        _circle(window, at, circle, 0.8 * pen[0], pen[1])
    elif rng.random() < 0.3:
        radius = rng.uniform(0.3, 0.7) * _UNIT
        angles = np.linspace(0.0, 2.0 * np.pi, 13)
        _stroke(
            window,
            list(at + radius * np.column_stack([np.cos(angles), np.sin(angles)])),
            0.1,
            pen[1],
            fill=True,
        )


def _other(window: Window, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    """Draw hatching, blocks, supports, arcs, right angles, ticks, scrawls."""
    kinds = (_hatching, _block, _support, _arc, _right_angle, _ticks, _scrawl, _parallels)
    kinds[rng.integers(len(kinds))](window, _place(rng), rng, pen)


def _hatching(window: Window, at: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    angle, pitch = rng.uniform(0.5, 2.6), rng.uniform(0.8, 2.5) * _UNIT
    for index in range(rng.integers(3, 9)):
        start = at + np.array([index * pitch, rng.normal(0.0, 2.0)])
        end = start + rng.uniform(1.5, 5.0) * _UNIT * _unit(angle)
        _stroke(window, [start, end], 0.6 * pen[0], pen[1])
    if rng.random() < 0.7:
        _stroke(window, [at, at + np.array([9 * pitch, 0.0])], pen[0], pen[1])


def _block(window: Window, at: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    wide, high, turn = rng.uniform(3, 12) * _UNIT, rng.uniform(2, 7) * _UNIT, rng.uniform(0, np.pi)
    u, v = wide * _unit(turn), high * _unit(turn + np.pi / 2)
    _stroke(window, [at, at + u, at + u + v, at + v, at], pen[0], pen[1])


def _support(window: Window, at: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    half = rng.uniform(1.0, 3.0) * _UNIT
    feet = [at + np.array([-half, 2 * half]), at + np.array([half, 2 * half])]
    _stroke(window, [at, *feet, at], pen[0], pen[1])


def _arc(window: Window, at: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    radius, start, span = rng.uniform(3, 60) * _UNIT, rng.uniform(0, 2 * np.pi), rng.uniform(0.1, 2.5)
    angles = start + np.linspace(0.0, span, 40)
    middle = at - radius * _unit(start + span / 2)
    arc = middle + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    _stroke(window, list(arc), pen[0] * rng.uniform(0.5, 1.0), pen[1])
    if rng.random() < 0.5:
        _arrowhead(window, arc[-1], angles[-1] + np.pi / 2, rng, pen)


def _right_angle(window: Window, at: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    turn, size = rng.uniform(0, np.pi), rng.uniform(1.0, 3.0) * _UNIT
    u, v = size * _unit(turn), size * _unit(turn + np.pi / 2)
    _stroke(window, [at + u, at + u + v, at + v], 0.7 * pen[0], pen[1])


def _ticks(window: Window, at: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    for _ in range(rng.integers(1, 4)):
        start = at + rng.normal(0.0, 2.0, 2) * _UNIT
        end = start + rng.uniform(0.5, 2.5) * _UNIT * _unit(rng.uniform(0, np.pi))
        _stroke(window, [start, end], pen[0], pen[1])


def _scrawl(window: Window, at: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    steps = np.cumsum(rng.normal(0.0, 0.9, (rng.integers(3, 9), 2)) * _UNIT, axis=0)
    _stroke(window, list(at + steps), pen[0], pen[1])


def _parallels(window: Window, at: np.ndarray, rng: np.random.Generator, pen: tuple[float, float]) -> None:
    apart, angle = rng.uniform(0.5, 2.5) * _UNIT, rng.uniform(0, np.pi)
    for index in range(rng.integers(2, 4)):
        middle = at + index * apart * _unit(angle + np.pi / 2)
        _line(window, middle - 300 * _unit(angle), middle + 300 * _unit(angle), rng, pen)


# Scanning -----------------------------------------------------------------------------------------


def scanned(ink: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(96, 96) uint8 of the ink map: grain, blur, noise, JPEG, 1 bit."""
    soft = ink
    if rng.random() < 0.6:
        grain = cv2.GaussianBlur(rng.random(ink.shape).astype(np.float32), (0, 0), rng.uniform(0.5, 1.8))
        grain = np.clip((grain - grain.mean()) / grain.std() / 2.0 + 0.5, 0.0, 1.0)
        soft = ink * (1.0 - rng.uniform(0.0, 0.75) * grain)
    soft = cv2.GaussianBlur(soft, (0, 0), float(np.exp(rng.uniform(np.log(0.4), np.log(2.6)))))
    lot, gain = rng.random(), 255.0 * rng.uniform(0.45, 1.0)
    if lot < 0.25:
        speckle = cv2.GaussianBlur(rng.normal(0.0, 1.0, soft.shape).astype(np.float32), (0, 0), 0.7)
        bits = soft + rng.uniform(0.0, 0.2) * speckle > rng.uniform(0.12, 0.45)
        coarse = rng.random() < 0.4
        bits = cv2.resize(bits.astype(np.float32), None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        return (255.0 * (bits > 0.45 if coarse else bits)).astype(np.uint8)
    soft = cv2.resize(soft, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) * gain
    soft += rng.normal(0.0, np.exp(rng.uniform(np.log(0.5), np.log(14.0))), soft.shape)
    grey = np.clip(soft, 0.0, 255.0).astype(np.uint8)
    if lot < 0.6:
        coded = cv2.imencode(".jpg", 255 - grey, [cv2.IMWRITE_JPEG_QUALITY, int(rng.uniform(35, 92))])[1]
        grey = 255 - cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE)
    return grey


Labels = np.ndarray
"""(n, 5) class, left, top, right, bottom in pixels of the window."""


def own_window(alphabet: Alphabet, rng: np.random.Generator) -> tuple[np.ndarray, Labels]:
    """A window of random line work."""
    window, pen = Window(), (rng.uniform(0.2, 0.8), rng.uniform(0.45, 1.0))
    for _ in range(rng.integers(0, 4)):
        _node(window, _place(rng), rng, pen)
    for _ in range(rng.integers(0, 3)):
        p = _place(rng)
        window.places.append(p)
        angle = rng.uniform(0, np.pi)
        _line(window, p - 300 * _unit(angle), p + 300 * _unit(angle), rng, pen)
    for _ in range(rng.integers(0, 3)):
        _other(window, rng, pen)
    hand = hand_of(rng, float(np.exp(rng.uniform(np.log(1.7), np.log(6.0)))))
    glyphs = alphabet.hand(rng)
    for _ in range(rng.integers(1, 6)):
        middle = _place(rng)
        if window.places and rng.random() < 0.75:
            near = window.places[rng.integers(len(window.places))]
            middle = near + rng.uniform(0.0, 4.5) * _UNIT * _unit(rng.uniform(0, 2 * np.pi))
        written(window, text_of(rng), glyphs, hand, middle, rng)
    return scanned(window.ink, rng), labels_of(window)


def labels_of(window: Window) -> Labels:
    """The signs in pixels of the window."""
    # Pixel q of the window covers 2 q and 2 q + 1 of the drawing.
    rows = [(index, *((box - 0.5) / FINE)) for index, box in window.signs]
    return np.array(rows, dtype=np.float32).reshape(-1, 5)


# Simulated sheets ---------------------------------------------------------------------------------


def _unwritten(*given: object, **named: object) -> WrittenText:
    """The box of a text without its ink."""
    text = write(*given, **named)
    return WrittenText((), text.low, text.high)


def backgrounds(seeds: Sequence[int]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Ink maps of simulated sheets without letters, and the middles of the texts in pixels."""
    for seed in seeds:
        rng = np.random.default_rng([seed, 31])
        assignment = load_assignment(_TASKS[seed % len(_TASKS)])
        variants = assignment.variants()
        device = str(rng.choice(_DEVICES))
        settings = any_settings(
            seed, device=device, dpi=None if device == "phone" else float(rng.choice(_RESOLUTIONS_DPI)),
            hardship=2.0,
        )  # fmt: skip
        try:
            with mock.patch("samples.simulation.sketch.write", _unwritten):
                sheets = simulate(assignment, variants[(7 * seed) % len(variants)], seed, settings)
        except ValueError:  # a random mistake that this variant does not admit
            continue
        for sheet in sheets:
            with tempfile.TemporaryDirectory() as place:
                page = open_page(PageRef("sheet", path=sheet.save(Path(place) / "sheet")))
            if page.ink is None:
                continue
            boxes = [np.array(label["box_mm"]) for label in sheet.truth["labels"] if label["names"]]
            middles = np.array([(box[:2] + box[2:]) / 2.0 for box in boxes]).reshape(-1, 2) * PX_PER_MM
            yield page.ink.where.ink, middles


def sheet_window(
    background: tuple[np.ndarray, np.ndarray], alphabet: Alphabet, rng: np.random.Generator
) -> tuple[np.ndarray, Labels] | None:
    """A window of a simulated sheet with letters of a font, where letters stood and at random."""
    picture, middles = background
    size = np.array(picture.shape[::-1]) - SIDE_PX
    if len(middles) and rng.random() < 0.88:
        corner = middles[rng.integers(len(middles))] - rng.uniform(15, SIDE_PX - 15, 2)
    else:
        corner = rng.uniform(0, 1, 2) * size
    left, top = np.clip(np.rint(corner), 0, size).astype(int)
    below = picture[top : top + SIDE_PX, left : left + SIDE_PX]
    ink = below[below > 60]
    if len(ink) < 40:
        return None
    window = Window()
    hand = hand_of(rng, float(np.exp(rng.uniform(np.log(1.8), np.log(5.5)))))
    glyphs = alphabet.hand(rng)
    inside = [m for m in middles - [left, top] if (m > 5).all() and (m < SIDE_PX - 5).all()]
    for middle in inside:
        if rng.random() < 0.85:
            near = FINE * (middle + rng.normal(0.0, 4.0, 2))
            written(window, text_of(rng), glyphs, hand, near, rng)
    if rng.random() < 0.3:
        written(window, text_of(rng), glyphs, hand, _place(rng), rng)
    letters = scanned(window.ink, rng).astype(np.float32)
    # The letters are about as dark as the lines that they stand on.
    dark = float(np.quantile(ink, 0.8)) * rng.uniform(0.7, 1.15)
    letters *= min(
        1.0,
        dark / max(float(np.quantile(letters[letters > 60], 0.8)) if (letters > 60).any() else 255.0, 1.0),
    )
    together = np.maximum(below, letters) * rng.uniform(0.8, 1.2)
    return np.clip(together, 0, 255).astype(np.uint8), labels_of(window)
