"""Letters of nodes: one for each, several on one point side by side."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from reference.canvas import Shape
from reference.drawing.labelling import Wanted, place_labels
from reference.drawing.subject import TOUCHING_MM, Part, Subject
from reference.drawing.symbols import point
from reference.lettering import Piece


@dataclass(frozen=True, slots=True)
class Style:
    """How a figure's letters are written, and how far its points' marks reach."""

    size: float
    small: float
    colour: str
    radius: float

    def of(self, nodes: Sequence[str]) -> float:
        """The size: ends of components are written smaller."""
        return self.small if all("_" in node for node in nodes) else self.size


def letters(
    subject: Subject,
    nodes: dict[str, complex],
    drawn: Sequence[Shape],
    style: Style,
    others: Sequence[Wanted] = (),
) -> Iterator[Part]:
    """The letters of nodes, and other texts to be placed with them, clear of what is drawn."""
    middle = sum(nodes.values()) / len(nodes)
    points = list(_together(nodes))
    wanted = [
        Wanted(same[0], point(at), text, style.of(same), style.colour, style.radius, at - middle)
        for same, at in points
        for text in (_joined(subject, same),)
    ]
    standing = place_labels([*wanted, *others], drawn)
    for (same, _), one in zip(points, standing, strict=False):
        for k, node in enumerate(same):
            label = replace(one.label, text=_joined(subject, same[: k + 1]))
            yield Part(node, label, same[k + 1] if k + 1 < len(same) else "")
        if one.leader is not None:
            yield Part(same[0], one.leader)
    for one in standing[len(points) :]:
        for shape in one.shapes:
            yield Part(one.wanted.node, shape)


def _together(nodes: dict[str, complex]) -> Iterator[tuple[tuple[str, ...], complex]]:
    """Nodes gathered where they fall on one point of the paper."""
    left = dict(nodes)
    while left:
        at = next(iter(left.values()))
        same = tuple(node for node, place in left.items() if abs(place - at) <= TOUCHING_MM)
        yield same, at
        for node in same:
            del left[node]


def _joined(subject: Subject, nodes: Sequence[str]) -> tuple[Piece, ...]:
    """The letters of nodes that fall on one point."""
    pieces: list[Piece] = []
    for node in nodes:
        pieces += [*([Piece(", ")] if pieces else []), *subject.letter(node)]
    return tuple(pieces)
