"""What may stand in a scale's box, sign by sign: a machine of states that reading may walk through.

    [kL =] number unit | number | 1 : number | omega kL [= number unit] | ...

Only what is written is restricted, not what it is worth: which number stands there is left to the ink.
Units are those that `grader.quantities` understands; the machine spells them as they are parsed.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import product

_DIGITS: Mapping[str, str] = {"0": "o", **{digit: digit for digit in "123456789"}}
"""The sign that each digit looks like."""
_MARKS: Mapping[str, str] = {".": ".", ",": "'"}
_LENGTHS = ("m", "cm", "mm")
_POINTS = ("·", "*")
_SPELT: Mapping[str, tuple[str, ...]] = {
    "m": ("m", "M"),
    "s": ("s", "c"),
    "L": ("L", "1"),
    "·": (".",),
    "*": ("x",),
    ",": ("'",),
}
"""Signs that a letter of the text may look like: a Cyrillic m is a small M, a Cyrillic s a c."""
_MOST_DIGITS = 7


@dataclass(frozen=True, slots=True)
class Move:
    """One sign written: the column's sign, what it adds to the text, and the state after it."""

    sign: str
    text: str
    state: "State"


@dataclass(frozen=True, slots=True)
class State:
    """Where in the box's text one stands.

    Attributes
    ----------
    kind : `start`, `number`, `tail` or `end`
    digits : how many of the number are written
    marked : whether its decimal mark is
    bare_mark : whether nothing stands behind the mark yet
    is_nought : whether a leading nought stands alone: nobody writes more digits without a mark then
    after : what may follow, texts spelt sign by sign
    """

    kind: str
    digits: int = 0
    marked: bool = False
    bare_mark: bool = False
    is_nought: bool = False
    after: tuple[str, ...] = ()
    known_hash: int = field(init=False, repr=False, compare=False, default=0)

    def __post_init__(self) -> None:
        told = (self.kind, self.digits, self.marked, self.bare_mark, self.is_nought, self.after)
        object.__setattr__(self, "known_hash", hash(told))

    def __hash__(self) -> int:
        return self.known_hash

    @property
    def is_end(self) -> bool:
        """Whether the text may stop here."""
        number = self.kind == "number" and self.digits > 0 and not self.bare_mark and not self.is_nought
        return "" in self.after and (self.kind == "tail" or number)


@cache
def units(name: str) -> tuple[str, ...]:
    """The units of a scale as people write them, and none."""
    found = [""]
    for real, paper in product(_LENGTHS, _LENGTHS):
        if name == "kL":
            found.append(f"{real}/{paper}")
            continue
        for second in ("s",) if name == "kv" else ("s2", "s^2"):
            found += [f"({real}/{second})/{paper}", f"{real}/{second}/{paper}"]
            found += [f"{real}/({second}{point}{paper})" for point in _POINTS]
            found += [f"{real}/{second}{point}{paper}" for point in _POINTS]
    return tuple(found)


@cache
def rules(name: str) -> tuple[str, ...]:
    """Rules by which a scale may be declared."""
    if name == "kL":
        return ()
    speeds = ("ω",) if name == "kv" else ("ω2", "ω^2")
    found = [f"{speed}{point}kL" for speed in speeds for point in ("", *_POINTS)]
    if name == "ka":
        found += [f"ω{point}kv" for point in ("", *_POINTS)]
        found += ["kv2/kL", "kv^2/kL"]
    return tuple(found)


def start(name: str) -> State:
    """Before the first sign of the box of `kL`, `kv` or `ka`."""
    texts = [f"{label}{rest}" for label in ("", f"{name}=") for rest in ("#", *rules(name))]
    texts += [f"{rule}=#" for rule in rules(name)]
    if name == "kL":
        texts += ["1:#", "M1:#"]
    return State("tail", after=tuple(dict.fromkeys(texts)))


@cache
def moves(name: str, state: State) -> tuple[Move, ...]:
    """Every sign that may come next. `#` in `after` stands for a number and its unit."""
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
        for digit, sign in _DIGITS.items():
            yield Move(sign, digit, nought if digit == "0" else after)
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
            # The raised 2 alone is written; the sign for a power is only ours.
            for rest in rests:
                yield Move(rest[0], f"^{rest[0]}", State("tail", after=(rest[1:],)))
            continue
        if first == ":":
            yield Move(":", ":", State("tail", after=tuple("#:" for _ in rests)))
            continue
        for sign in _SPELT.get(first, (first,)):
            yield Move(sign, first, State("tail", after=tuple(rests)))
