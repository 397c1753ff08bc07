"""Read the printed boxes of an answer sheet: scales, measured lengths and computed values."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import product

import cv2
import numpy as np

from grader.printed.layout import SCALE_BOXES, TENTH_CELLS, ValuePlace
from grader.records import Box, FloatArray, GreyImage, Page, Sheet, Written
from grader.scan.handwriting.model import (
    COLUMN,
    JUNK,
    SIGNS,
    Lattice,
    Segment,
    lattice_of,
    normalised,
    recognise,
)
from grader.scan.pixels import cut_out
from grader.tables.scale_text import ByRule, Declared, ParsedScale, parse_scale
from reference.quantities import OF_MOTION, scale_of, value_name

# What may stand in a scale's box, sign by sign ----------------------------------------------------

_DIGIT_SIGNS: Mapping[str, str] = {"0": "o", **{digit: digit for digit in "123456789"}}
"""The sign that each digit looks like."""
_MARKS: Mapping[str, str] = {".": ".", ",": "'"}
_LENGTHS = ("m", "cm", "mm")
_FORCES = ("N", "kN", "H", "kH")
"""H is the Cyrillic letter of the newton."""
_POINTS = ("·", "*")
_SPELT: Mapping[str, tuple[str, ...]] = {
    "m": ("m", "M"),
    "s": ("s", "c"),
    "L": ("L", "1"),
    "·": (".",),
    "*": ("x",),
    ",": ("'",),
}
"""Signs that a letter of the text may resemble: a Cyrillic m is a small M, a Cyrillic s a c."""
_MOST_DIGITS = 7
"""Most digits of a number that are followed, decimals included."""
_BEAM = 60
"""Number of the likeliest texts up to a piece of ink that are followed further."""
_MISSHAPEN = -4.0
"""Log likelihood of an unrecognised letter of a unit, or of two that touch, against the likeliest sign."""
_MARK_LOST = -3.0
"""Log likelihood of a decimal mark behind a leading nought that left no ink."""
_FAR = 18.0
"""Nats: texts this much less likely than signs at will are not followed."""
_SKIPPED, _SIGN_SKIPPED = -2.0, -5.0
"""Log likelihood of ink taken for no sign, as low as a point and as high as a sign, besides its own
probability of being none."""
_MISPLACED = -4.0
"""Log likelihood of a sign whose size or position in the line is another sign's."""
_SMALL = 0.35
"""Share of the line's height: anything lower is a point or a comma, no digit."""
_TALL = 0.6
"""Share of the line's height: anything higher is no point."""
_DOTS = frozenset(".'")
_FLAT = frozenset("-=:")
_LOW, _HIGH = 0.72, 0.35
"""Shares of the line's height from its top: middles below the first are low, above the second high."""
_FOOT = 0.45
"""Share of the line's height: a smaller piece low in the line is a point or a comma, by `_CERTAIN`."""
_CERTAIN = float(np.log(0.95))
_BAR, _WIDE_BAR, _HIGHEST_PAIR = 0.3, 0.3, 0.95
"""Shares of the line's height: bars and points are lower; bars are wider; stacked signs are this high."""
_MERGED = -0.7
"""Log likelihood of each further piece of ink that a sign is made of."""


@dataclass(frozen=True, slots=True)
class Move:
    """One written sign: its column, the text that it adds, and the state after it."""

    sign: str
    text: str
    state: "State"
    in_tail: bool = False
    cost: float = 0.0


@dataclass(frozen=True, slots=True)
class State:
    """The position in a box's text.

    Attributes
    ----------
    kind : `start`, `number`, `tail` or `end`
    digits : number of digits written so far
    marked : whether its decimal mark is written
    bare_mark : whether nothing stands behind the mark yet
    is_nought : whether a leading nought stands alone: nobody writes more digits without a mark then
    after : texts that may follow, spelt sign by sign
    """

    kind: str
    digits: int = 0
    marked: bool = False
    bare_mark: bool = False
    is_nought: bool = False
    after: tuple[str, ...] = ()
    known_hash: int = field(init=False, repr=False, compare=False, default=0)

    def __post_init__(self) -> None:
        content = (self.kind, self.digits, self.marked, self.bare_mark, self.is_nought, self.after)
        object.__setattr__(self, "known_hash", hash(content))

    def __hash__(self) -> int:
        return self.known_hash

    @property
    def is_end(self) -> bool:
        """True if the text may stop here."""
        number = self.kind == "number" and self.digits > 0 and not self.bare_mark and not self.is_nought
        return "" in self.after and (self.kind == "tail" or number)


@cache
def units(name: str) -> tuple[str, ...]:
    """Return the units of a scale as people write them, and none."""
    spellings = [""]
    for real, paper in product(_FORCES if name == "kF" else _LENGTHS, _LENGTHS[1:]):
        if name not in OF_MOTION:
            spellings.append(f"{real}/{paper}")
            continue
        for second in ("s",) if name == "kv" else ("s2", "s^2"):
            spellings += [f"({real}/{second})/{paper}", f"{real}/{second}/{paper}"]
            spellings += [f"{real}/({second}{point}{paper})" for point in _POINTS]
            spellings += [f"{real}/{second}{point}{paper}" for point in _POINTS]
    return tuple(spellings)


@cache
def rules(name: str) -> tuple[str, ...]:
    """Return rules by which a scale may be declared."""
    if name not in OF_MOTION:
        return ()
    speeds = ("ω",) if name == "kv" else ("ω2", "ω^2")
    spellings = [f"{speed}{point}kL" for speed in speeds for point in ("", *_POINTS)]
    if name == "ka":
        spellings += [f"ω{point}kv" for point in ("", *_POINTS)]
        spellings += ["kv2/kL", "kv^2/kL"]
    return tuple(spellings)


def start(name: str) -> State:
    """Return the state before the first sign of the box of a scale."""
    texts = [f"{label}{rest}" for label in ("", f"{name}=") for rest in ("#", *rules(name))]
    texts += [f"{rule}=#" for rule in rules(name)]
    if name == "kL":
        texts += ["1:#", "M1:#"]
    return State("tail", after=tuple(dict.fromkeys(texts)))


@cache
def moves(name: str, state: State) -> tuple[Move, ...]:
    """Return every sign that may come next. `#` in `after` stands for a number and its unit."""
    return tuple(_moves(name, state))


def _moves(name: str, state: State) -> Iterable[Move]:
    if state.kind == "number":
        yield from _digits(state)
        if state.digits and not state.bare_mark and not state.is_nought:
            yield from _tails(name, state.after)
        return
    yield from _tails(name, state.after)


def _digits(state: State) -> Iterable[Move]:
    if state.digits < _MOST_DIGITS and not state.is_nought:
        after = State("number", state.digits + 1, state.marked, after=state.after)
        nought = replace(after, is_nought=state.digits == 0)
        for digit, sign in _DIGIT_SIGNS.items():
            yield Move(sign, digit, nought if digit == "0" else after)
    if state.is_nought and not state.marked:
        behind = State("number", state.digits + 1, marked=True, after=state.after)
        for digit, sign in _DIGIT_SIGNS.items():
            yield Move(sign, f".{digit}", behind, cost=_MARK_LOST)
    if state.digits and not state.marked:
        marked = State("number", state.digits, marked=True, bare_mark=True, after=state.after)
        for text, sign in _MARKS.items():
            yield Move(sign, text, marked)


def _tails(name: str, after: tuple[str, ...]) -> Iterable[Move]:
    firsts: dict[str, list[str]] = {}
    for text in after:
        if text.startswith("#"):
            ratio = text == "#:"
            yield from _digits(State("number", after=("",) if ratio else units(name)))
        elif text:
            firsts.setdefault(text[0], []).append(text[1:])
    for first, rests in firsts.items():
        if first == "^":
            # People write only the raised 2; the sign for a power is internal.
            for rest in rests:
                yield Move(rest[0], f"^{rest[0]}", State("tail", after=(rest[1:],)), in_tail=True)
            continue
        if first == ":":
            yield Move(":", ":", State("tail", after=tuple("#:" for _ in rests)))
            continue
        for sign in _SPELT.get(first, (first,)):
            yield Move(sign, first, State("tail", after=tuple(rests)), in_tail=True)


# The likeliest texts ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ScaleText:
    """A possible text, and its log likelihood."""

    text: str
    log: float


def texts_of(lattice: Lattice, name: str) -> tuple[list[ScaleText], float]:
    """Return texts that a scale's box may hold, likeliest first; and the log likelihood of signs at will.

    The second value is what the ink would be worth if any signs might stand in any order: a much less likely
    text is an over-interpretation of the ink.
    """
    by_piece: list[list[_Candidate]] = [[] for _ in range(lattice.count)]
    high = _BAR * _line(lattice)[0]
    for segment, log in placed(lattice):
        by_piece[segment.first].append(_candidate(segment, log, dust=segment.box[3] < high))
    free = [0.0, *(-np.inf for _ in by_piece)]
    for piece, candidates in enumerate(by_piece):
        for sign in candidates:
            free[sign.last] = max(free[sign.last], free[piece] + sign.best, free[piece] + sign.alone)
    beams: list[dict[tuple[State, str], float]] = [{} for _ in range(lattice.count + 1)]
    beams[0][start(name), ""] = 0.0
    for piece, candidates in enumerate(by_piece):
        best = sorted(beams[piece].items(), key=lambda item: -item[1])[:_BEAM]
        for sign in candidates:
            target, least = beams[sign.last], free[sign.last] - _FAR
            for (state, text), score in best:
                for column, added, after, cost, in_tail in _steps(name, state):
                    worth = score + (sign.log[column] + cost if column >= 0 else -np.inf)
                    if in_tail and (column >= 0 or sign.is_one):
                        worth = max(worth, score + sign.best + _MISSHAPEN)
                    if worth > least:
                        _keep(target, (after, text + added), worth)
                if score + sign.alone > least:
                    _keep(target, (state, text), score + sign.alone)
    ended: dict[str, float] = {}
    for (state, text), score in beams[-1].items():
        if state.is_end:
            ended[text] = max(score, ended.get(text, -np.inf))
    texts = sorted((ScaleText(text, score) for text, score in ended.items()), key=lambda text: -text.log)
    return texts, float(free[-1])


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A sign that pieces may make up.

    Attributes
    ----------
    last : the piece behind it
    log : log likelihood of each sign
    best : of the likeliest
    alone : of a piece that is no sign; minus infinity for several
    is_one : whether it is one piece, so that two letters may touch in it
    """

    last: int
    log: list[float]
    best: float
    alone: float
    is_one: bool


def _candidate(segment: Segment, log: FloatArray, *, dust: bool) -> _Candidate:
    is_one = segment.last == segment.first + 1
    none = float(segment.log[COLUMN[JUNK]]) + (_SKIPPED if dust else _SIGN_SKIPPED)
    best = float(log[: COLUMN[JUNK]].max())
    return _Candidate(segment.last, log.tolist(), best, none if is_one else -np.inf, is_one)


@cache
def _steps(name: str, state: State) -> tuple[tuple[int, str, State, float, bool], ...]:
    """Return the next signs: column, text, state after it, cost, and whether it is in a unit.

    Two letters of a unit that touch have no column.
    """
    first = moves(name, state)
    single = [(COLUMN[move.sign], move.text, move.state, move.cost, move.in_tail) for move in first]
    pairs = [
        (-1, move.text + touching.text, touching.state, 0.0, True)
        for move in first
        if move.in_tail
        for touching in moves(name, move.state)
        if touching.in_tail
    ]
    return (*single, *pairs)


def _keep(target: dict[tuple[State, str], float], key: tuple[State, str], score: float) -> None:
    if score > target.get(key, -np.inf):
        target[key] = score


def _line(lattice: Lattice) -> tuple[float, float, float]:
    """Return the height of the line's signs, and its top and bottom, px."""
    boxes = np.array([s.box for s in lattice.segments if s.last == s.first + 1], dtype=np.float64)
    if len(boxes) == 0:
        return 1.0, 0.0, 1.0
    high = float(np.quantile(boxes[:, 3], 0.75))
    tall = boxes[boxes[:, 3] > 0.5 * high]
    return high, float(np.median(tall[:, 1])), float(np.median(tall[:, 1] + tall[:, 3]))


def placed(lattice: Lattice) -> list[tuple[Segment, FloatArray]]:
    """Return each segment with (signs,) log probabilities that include its size and position in the line.

    Shapes alone do not tell a point from an o: a small mark at the foot of the line is a point or a
    comma, whatever it looks like; two small marks over each other are a colon or an equals sign.
    """
    line = _line(lattice)
    high = max(line[0], 1.0)
    alone = {s.first: s.box for s in lattice.segments if s.last == s.first + 1}
    return [
        (
            segment,
            _placed(segment, [alone[piece] for piece in range(segment.first, segment.last)], line, high),
        )
        for segment in lattice.segments
    ]


def _placed(
    segment: Segment,
    pieces: Sequence[tuple[int, int, int, int]],
    line: tuple[float, float, float],
    high: float,
) -> FloatArray:
    _, top, bottom = line
    _, y, w, h = segment.box
    share = h / high
    middle = (y + h / 2.0 - top) / max(bottom - top, 1.0)
    log = segment.log + _MERGED * (len(pieces) - 1)
    sure = ""
    if len(pieces) == 1 and share < _FOOT and middle > _LOW:
        sure = ".'"
    elif len(pieces) == 1 and share < _BAR and _HIGH < middle < _LOW:
        sure = "-" if w > _WIDE_BAR * high else "."
    elif len(pieces) == 2 and max(piece[3] for piece in pieces) < _BAR * high and share < _HIGHEST_PAIR:
        sure = "=" if w > _WIDE_BAR * high else ":"
    for column, sign in enumerate(SIGNS[: COLUMN[JUNK]]):
        if sign in sure:
            log[column] = _CERTAIN
        elif sign in _DOTS:
            log[column] += _MISPLACED * (float(share > _TALL) + float(middle < _HIGH))
        elif sign not in _FLAT and share < _SMALL:
            log[column] += _MISPLACED
    return log


# Scales -------------------------------------------------------------------------------------------

PX_PER_MM = 12.0
"""Resolution at which writing is read: a digit of 3 mm is at least as high as the recogniser's picture."""
_BORDER_MM, _CELL_BORDER_MM = 0.55, 0.4
"""Margin inside a box's and a cell's printed line, for the errors of print and registration."""
_PAPER = 0.8
"""Quantile of a box's pixels that is paper: writing never fills a fifth of it."""
_FOREIGN = 0.25
"""Log likelihood per sign that a text may lack against signs at will before it is doubted."""
_LARGE, _HARDLY = 1000.0, -4.0
"""From this value on, a lost decimal point is more likely than that anybody chose the scale."""
_RARE, _RARE_UNITS = -2.0, ("mm/s", "cm/s", "cm/mm", "mm/mm", "/cm", "·cm", "*cm")
"""Log prior of scales that few people write, for each such unit in the text."""
_MOST_TEXTS = 200
"""Number of the likeliest texts among which those of equal meaning are combined."""
_DIGITS = "0123456789"
_LEAST_PEAK = 40
"""Contrast of 255: a cell whose darkest ink is fainter is empty."""
_INK = 0.4
"""Share of a cell's darkest ink: anything fainter is blur."""
_LEAST_MM = 1.0
"""Ink no higher than this is no digit: dust, a dot, the border of the next cell."""
_DUST_MM = 0.35
"""Nor is ink this low a part of one."""
_SOFTEN_MM = 0.11
"""A pencil's grain breaks strokes: they are closed before dust is left out."""
_FULL = 0.97
"""Share of a cell that is less inked than the middle of a stroke."""
_NO_TENTHS = 0.5
"""Confidence in a whole number if the cells of the decimals are empty: a shifted number looks the same."""


def written_scales(page: Page, sheet: Sheet, units: Mapping[str, str] | None = None) -> dict[str, Written]:
    """Return the contents of a printed sheet's boxes, by scale; nothing for empty boxes or a plain sheet.

    Arguments: `units` are the units of bare numbers if the assignment gives them, by scale.
    """
    names = [*dict.fromkeys(filter(None, map(scale_of, sheet.zones)))]
    if not names:
        return {}
    scales = {}
    for name in names:
        lattice = lattice_of(writing(page, sheet, SCALE_BOXES[name], _BORDER_MM), PX_PER_MM)
        if lattice.count:
            scales[name] = read_scale(lattice, name, (units or {}).get(name))
    return scales


def read_scale(lattice: Lattice, name: str, bare_unit: str | None = None) -> Written:
    """Return the likeliest scale in a line of writing."""
    texts, at_will = texts_of(lattice, name)
    meant = _by_meaning(texts[:_MOST_TEXTS], name, bare_unit)
    if not meant:
        return Written("", 0.0)
    best = max(log for _, log in meant.values())
    shares = {meaning: (text, float(np.exp(log - best))) for meaning, (text, log) in meant.items()}
    total = sum(share for _, share in shares.values())
    fits = float(np.exp(min(0.0, best - at_will + _FOREIGN * lattice.count)))
    ranked = sorted(
        ((text, fits * share / total) for text, share in shares.values()), key=lambda spelling: -spelling[1]
    )
    return Written(ranked[0][0], ranked[0][1], tuple(ranked[1:4]))


def _by_meaning(texts: list[ScaleText], name: str, bare_unit: str | None) -> dict[object, tuple[str, float]]:
    """Combine texts of equal meaning: the likeliest spelling, and the log of their sum."""
    meanings: dict[object, tuple[str, float]] = {}
    for candidate in texts:
        meaning = meaning_of(parse_scale(name, candidate.text, bare_unit=bare_unit))
        if meaning is None:
            continue
        unlikely = _HARDLY if isinstance(meaning, float) and meaning >= _LARGE else 0.0
        unlikely += _RARE * sum(rare in candidate.text for rare in _RARE_UNITS)
        text, log = meanings.get(meaning, (candidate.text, -np.inf))
        meanings[meaning] = (text, float(np.logaddexp(log, candidate.log + unlikely)))
    return meanings


def meaning_of(parsed: ParsedScale) -> object | None:
    """Return a key that is equal for all texts that declare the same scale; None if they declare none."""
    match parsed:
        case Declared(per_mm=value):
            return float(f"{value:.9g}")
        case ByRule(powers=powers):
            return tuple(sorted(powers.items()))
        case _:
            return None


def writing(page: Page, sheet: Sheet, box: Box, border_mm: float) -> GreyImage:
    """Return the contrast inside a printed box without its border, upright, 12 px/mm; empty if outside."""
    x, y, wide, high = box
    inner = x + border_mm, y + border_mm, wide - 2.0 * border_mm, high - 2.0 * border_mm
    grey = cut_out(page.grey, sheet.mm_to_px, inner, PX_PER_MM)
    if grey.size == 0:
        return grey
    paper = max(float(np.quantile(grey, _PAPER)), 1.0)
    return np.asarray(np.clip(255.0 * (1.0 - grey / paper), 0.0, 255.0), dtype=np.uint8)


# Measured lengths ---------------------------------------------------------------------------------


def written_numbers(
    page: Page, sheet: Sheet, cells: Mapping[str, Sequence[Box]], values: Mapping[str, ValuePlace]
) -> dict[str, tuple[float, float]]:
    """Return numbers with the probability that they are as written, by name; nothing for empty boxes.

    Arguments: `cells` are the boxes of a length's digits (sheet mm, the last one for tenths) by vector,
    `values` the places of computed values, which are returned as ``NAME_value``. Anything that is no number
    (a gap between digits, a sign that is no digit) has the probability 0. A moment has the sign that is
    ticked, and ``NAME_sense`` is 1 (counter-clockwise), -1, or 0 where none is.
    """
    cells = {**cells, **{value_name(name): place.cells for name, place in values.items()}}
    decimals = {value_name(name): place.decimals for name, place in values.items()}
    pictures: list[GreyImage] = []
    sizes: list[tuple[float, float]] = []
    filled: dict[str, list[int | None]] = {}
    for name, boxes in cells.items():
        filled[name] = []
        for box in boxes:
            sign = _sign(writing(page, sheet, box, _CELL_BORDER_MM))
            filled[name].append(None if sign is None else len(pictures))
            if sign is not None:
                pictures.append(normalised(sign))
                sizes.append((sign.shape[1], sign.shape[0]))
    probability = recognise(pictures, np.array(sizes, dtype=np.float64).reshape(-1, 2))
    found = {
        name: _number(places, probability, decimals.get(name, TENTH_CELLS))
        for name, places in filled.items()
        if any(place is not None for place in places)
    }
    for name, place in values.items():
        is_ticked = [_sign(writing(page, sheet, box, _CELL_BORDER_MM)) is not None for box in place.senses]
        if not is_ticked:
            continue
        value, told = value_name(name), float(is_ticked[0]) or -float(is_ticked[1])
        if value in found and told:
            found[value] = found[value][0] * told, found[value][1]
        if value in found or told:
            found[f"{name}_sense"] = told, 0.0 if all(is_ticked) else 1.0
    return found


def _sign(grey: GreyImage) -> GreyImage | None:
    """Cut out the sign written in a cell; None if it is empty."""
    if grey.size == 0 or grey.max() < _LEAST_PEAK:
        return None
    soft = cv2.GaussianBlur(grey, (0, 0), _SOFTEN_MM * PX_PER_MM)
    full = max(float(np.quantile(soft, _FULL)), 1.0)
    even = np.asarray(np.clip(soft * (255.0 / full), 0.0, 255.0), dtype=np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats((even > _INK * 255.0).astype(np.uint8))
    heights = stats[1:, cv2.CC_STAT_HEIGHT] / PX_PER_MM
    if count == 1 or heights.max() < _LEAST_MM:
        return None
    rows, columns = np.nonzero(np.isin(labels, 1 + np.flatnonzero(heights >= _DUST_MM)))
    part = even[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    return np.ascontiguousarray(part)


def _number(places: Sequence[int | None], probability: FloatArray, decimals: int) -> tuple[float, float]:
    """Return the number in a row of cells, and the probability that every digit of it is right."""
    columns = [COLUMN[digit] for digit in _DIGITS]
    value, sure = 0.0, 1.0
    for place in places:
        value *= 10.0
        if place is not None:
            row = probability[place, columns]
            best = int(np.argmax(row))
            sure *= float(row[best] / max(row.sum() + probability[place, COLUMN[JUNK]], 1e-9))
            value += best
    filled = [index for index, place in enumerate(places) if place is not None]
    last, ones = filled[-1], len(places) - decimals - 1
    if last - filled[0] >= len(filled) or last < ones:
        sure = 0.0
    elif last == ones and decimals:
        sure *= _NO_TENTHS
    return value / 10.0**decimals, sure
