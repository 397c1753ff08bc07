"""Texts of a decision that are more than a word: a node's place; a page's owner and corners; an audit."""

import re
from dataclasses import dataclass

from grader.tables.reader import short, why_no_id
from grader.tables.scale_text import TextError

TURNS = (0, 90, 180, 270)
LARGEST = 100_000.0
"""Largest coordinate, and most points: scans have fewer pixels a side."""
_NUMBER = r"[+-]?[0-9]+(?:[.][0-9]+)?"
_PAIR = re.compile(rf"({_NUMBER})\s*[,;\s]\s*({_NUMBER})")
_DECIMAL_COMMAS = re.compile(r"([+-]?[0-9]+,[0-9]+)\s*[;\s]\s*([+-]?[0-9]+,[0-9]+)")
"""Two numbers with decimal commas, which a comma between them could not part."""


@dataclass(frozen=True, slots=True)
class PageDecision:
    """A person's decision on a page.

    Attributes
    ----------
    owner : the student's id; None where it stays as it was found
    turn : counter-clockwise turn in degrees that makes the stored image upright; None where not said
    corners : the sheet's corners as it lies upright, from the top left clockwise, pixels (x, y) of the stored
        image (the centre of its first pixel is 0, 0); empty where not said
    """

    owner: str | None = None
    turn: int | None = None
    corners: tuple[tuple[float, float], ...] = ()

    def __str__(self) -> str:
        owner = [f"owner={self.owner}"] if self.owner is not None else []
        turn = [f"turn={self.turn}"] if self.turn is not None else []
        places = " ".join(f"{x:.1f},{y:.1f}" for x, y in self.corners)
        return "; ".join([*owner, *turn, *([f"corners={places}"] if places else [])])


def page_decision(text: str) -> PageDecision:
    """Owner, turn and corners as a row has them. Raises TextError."""
    said: dict[str, str] = {}
    for part in filter(None, (part.strip() for part in text.split(";"))):
        name, mark, value = (piece.strip() for piece in part.partition("="))
        if not mark or name not in {"owner", "turn", "corners"} or name in said:
            raise TextError("page_words", text=short(part))
        said[name] = value
    if not said:
        raise TextError("page_nothing")
    owner, turn, corners = (said.get(name) for name in ("owner", "turn", "corners"))
    if owner is not None and (why := why_no_id(owner)) is not None:
        raise TextError("id_refused", text=short(owner), advice=why.code)
    if turn is not None and turn not in map(str, TURNS):
        raise TextError("turn_unknown", text=short(turn), names=tuple(map(str, TURNS)))
    return PageDecision(
        owner, None if turn is None else int(turn), () if corners is None else _corners(corners)
    )


def _corners(text: str) -> tuple[tuple[float, float], ...]:
    corners = tuple(place(each) for each in re.sub(r"\s*,\s*", ",", text).split())
    if len(corners) != 4:
        raise TextError("corners_count", count=len(corners))
    edges = [
        complex(*there) - complex(*here)
        for here, there in zip(corners, corners[1:] + corners[:1], strict=True)
    ]
    turns = [(one.conjugate() * other).imag for one, other in zip(edges, edges[1:] + edges[:1], strict=True)]
    if min(turns) <= 0.0:
        raise TextError("corners_order")
    return corners


ANSWERS = ("right", "wrong", "unclear")
"""To the question whether a settled verdict is right; `unclear`: what was handed in does not tell."""


@dataclass(frozen=True, slots=True)
class AuditAnswer:
    """A check of a settled verdict, one of `ANSWERS`, or a second person's verdict; and the first verdict."""

    answer: str
    said: str

    def __str__(self) -> str:
        return f"{self.answer}; said={self.said}"


def audit_answer(text: str, known: tuple[str, ...] = ANSWERS) -> AuditAnswer:
    """The answer that a row has, one of those `known`. Raises TextError."""
    answer, _, rest = (part.strip() for part in text.partition(";"))
    name, _, said = (part.strip() for part in rest.partition("="))
    if answer not in known or name != "said" or not said:
        raise TextError("audit_unknown", text=short(text), names=known)
    return AuditAnswer(answer, said)


def place_text(x_mm: float, y_mm: float) -> str:
    """A node's place as a row has it, to a thousandth of a millimetre.

    Always with decimals: a spreadsheet would take ``61,20`` for one number.
    """
    return f"{x_mm:.3f},{y_mm:.3f}"


def place(text: str) -> tuple[float, float]:
    """The two numbers of a place x,y. Raises TextError."""
    found = _PAIR.fullmatch(text.strip()) or _DECIMAL_COMMAS.fullmatch(text.strip())
    if found is None:
        raise TextError("no_place", text=short(text))
    x, y = (float(number.replace(",", ".")) for number in found.groups())
    if max(abs(x), abs(y)) > LARGEST:
        raise TextError("place_outside", text=short(text))
    return x, y
