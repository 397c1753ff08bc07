"""Damaged rows of a fax (ITU-T T.4 and T.6): libtiff and pdfium fill them without a word."""

import re
from dataclasses import dataclass
from functools import cache
from itertools import product

_WHITE = """
00110101 000111 0111 1000 1011 1100 1110 1111 10011 10100 00111 01000 001000 000011 110100 110101 101010
101011 0100111 0001100 0001000 0010111 0000011 0000100 0101000 0101011 0010011 0100100 0011000 00000010
00000011 00011010 00011011 00010010 00010011 00010100 00010101 00010110 00010111 00101000 00101001
00101010 00101011 00101100 00101101 00000100 00000101 00001010 00001011 01010010 01010011 01010100
01010101 00100100 00100101 01011000 01011001 01011010 01011011 01001010 01001011 00110010 00110011
00110100 11011 10010 010111 0110111 00110110 00110111 01100100 01100101 01101000 01100111 011001100
011001101 011010010 011010011 011010100 011010101 011010110 011010111 011011000 011011001 011011010
011011011 010011000 010011001 010011010 011000 010011011
"""
"""ITU-T T.4, tables 2 and 3a: codes of white runs of 0 to 63 and of 64, 128 .. 1728 pixels."""
_BLACK = """
0000110111 010 11 10 011 0011 0010 00011 000101 000100 0000100 0000101 0000111 00000100 00000111
000011000 0000010111 0000011000 0000001000 00001100111 00001101000 00001101100 00000110111 00000101000
00000010111 00000011000 000011001010 000011001011 000011001100 000011001101 000001101000 000001101001
000001101010 000001101011 000011010010 000011010011 000011010100 000011010101 000011010110 000011010111
000001101100 000001101101 000011011010 000011011011 000001010100 000001010101 000001010110 000001010111
000001100100 000001100101 000001010010 000001010011 000000100100 000000110111 000000111000 000000100111
000000101000 000001011000 000001011001 000000101011 000000101100 000001011010 000001100110 000001100111
0000001111 000011001000 000011001001 000001011011 000000110011 000000110100 000000110101 0000001101100
0000001101101 0000001001010 0000001001011 0000001001100 0000001001101 0000001110010 0000001110011
0000001110100 0000001110101 0000001110110 0000001110111 0000001010010 0000001010011 0000001010100
0000001010101 0000001011010 0000001011011 0000001100100 0000001100101
"""
_LONG = """
00000001000 00000001100 00000001101 000000010010 000000010011 000000010100 000000010101 000000010110
000000010111 000000011100 000000011101 000000011110 000000011111
"""
"""Table 3b: runs of 1792, 1856 .. 2560 pixels of either colour."""
_WINDOW = 13
"""Bits of the longest code."""
_MODE = re.compile("(1+)|(001)|(011)|(010)|(0001)|(000011)|(000010)|(0000011)|(0000010)")
"""T.6, table 1: vertical modes on the spot; horizontal; vertical 1, -1; pass; vertical 2, -2, 3, -3."""
_STRAIGHT, _HORIZONTAL, _PASS = 1, 2, 5
_SHIFT = (0, 0, 0, 1, -1, 0, 2, -2, 3, -3)
_LINE_END = re.compile("0{11,}1")
_MAX_PADDING = 64
"""Zero bits behind the last row: to the byte, or to the word of a writer that aligns."""


@dataclass(frozen=True, slots=True)
class Coding:
    """The coding of rows.

    Attributes
    ----------
    k : below 0 two-dimensional (T.6), 0 one-dimensional, above 0 a bit behind each end-of-line says which
    aligned : each row starts at a byte
    """

    k: int = -1
    aligned: bool = False


class _DamageError(Exception):
    """No row of the declared width stands here."""


def damaged_row(data: bytes, width: int, rows: int, coding: Coding) -> int | None:
    """The first row, from 0, that is not coded as T.4 or T.6 ask; None where all rows are whole.

    A row is whole where all its codes exist and its runs fill its width exactly. Behind the last row there
    must be an end-of-block, or no more than padding. A code in place of another valid one that leaves all
    this in order (an edge that steps aside by some pixels, and stays there) cannot be told from a drawing.
    """
    bits = bin(int.from_bytes(b"\1" + data, "big"))[3:]
    line_ends = _LINE_END.match(bits) is not None
    end, bits = len(bits), bits + "0" * _WINDOW
    edges: list[int] = []
    at = 0
    for row in range(rows):
        try:
            flat, at = _row_start(bits, at, coding, line_ends=line_ends)
            edges, at = _flat_row(bits, at, width) if flat else _row_below(bits, at, edges, width)
        except _DamageError:
            return row
        if at > end:
            return row
    padded = end - at < _MAX_PADDING and "1" not in bits[at:]
    return None if padded or _LINE_END.match(bits, at) else rows - 1


def _row_start(bits: str, at: int, coding: Coding, *, line_ends: bool) -> tuple[bool, int]:
    """Return whether the next row is one-dimensional, and where it starts."""
    if line_ends:
        line_end = _LINE_END.match(bits, at)
        if line_end is None:
            raise _DamageError
        at = line_end.end()
        if coding.k > 0:
            return bits[at : at + 1] == "1", at + 1
    elif coding.aligned:
        at = -(-at // 8) * 8
    return coding.k >= 0, at


def _flat_row(bits: str, at: int, width: int) -> tuple[list[int], int]:
    """A one-dimensional row's edges, white to black first, and where it ends."""
    edges: list[int] = []
    x, black = 0, 0
    while x < width:
        run, at = _run(bits, at, black)
        x, black = x + run, 1 - black
        _add(edges, x)
    return _within(edges, width), at


def _row_below(bits: str, at: int, above: list[int], width: int) -> tuple[list[int], int]:
    """A two-dimensional row's edges, by those of the row above, and where it ends."""
    last = len(above)
    above = [*above, width, width, width]
    edges: list[int] = []
    x, below = -1, 0  # how far the row has come; index above of the next edge of its colour
    while x < width:
        while below >= 2 and above[below - 2] > x:
            below -= 2
        while above[below] <= x:
            below += 2
        mode = _MODE.match(bits, at)
        if mode is None:
            raise _DamageError
        kind, at = mode.lastindex, mode.end()
        if kind == _STRAIGHT:
            # Each follows the edge above it; the one at the border ends the row.
            straight = mode.end() - mode.start()
            if below + straight > last + 1:
                at -= straight
                straight = last + 1 - below if below <= last else 1
                at += straight
            edges += above[below : below + straight]
            x, below = edges[-1], below + straight
        elif kind == _HORIZONTAL:
            black = len(edges) % 2
            first, at = _run(bits, at, black)
            second, at = _run(bits, at, 1 - black)
            x = max(x, 0) + first
            _add(edges, x)
            x += second
            _add(edges, x)
        elif kind == _PASS:
            x = above[below + 1]
            if x >= width:
                raise _DamageError
        else:
            shifted = above[below] + _SHIFT[kind or 0]
            if shifted <= x:
                raise _DamageError
            x, below = shifted, below + 1
            edges.append(x)
    return _within(edges, width), at


def _add(edges: list[int], x: int) -> None:
    """Add an edge; a run of no pixels takes the edge before it away."""
    if edges and edges[-1] == x:
        edges.pop()
    else:
        edges.append(x)


def _within(edges: list[int], width: int) -> list[int]:
    """The edges inside a row that must end at its width."""
    if edges and edges[-1] > width:
        raise _DamageError
    return edges[:-1] if edges and edges[-1] == width else edges


def _run(bits: str, at: int, black: int) -> tuple[int, int]:
    """A run's length in pixels, and where its codes end."""
    codes, total = _codes()[black], 0
    while True:
        code = codes.get(bits[at : at + _WINDOW])
        if code is None:
            raise _DamageError
        at += code[1]
        if code[0] < 64:
            return total + code[0], at
        total += code[0]


@cache
def _codes() -> tuple[dict[str, tuple[int, int]], ...]:
    """Run and length of the code that stands first in each possible window, for white and for black."""
    runs = [*range(64), *range(64, 2561, 64)]
    tables = []
    for text in (_WHITE + _LONG, _BLACK + _LONG):
        table = {}
        for code, run in zip(text.split(), runs, strict=True):
            for rest in product("01", repeat=_WINDOW - len(code)):
                table[code + "".join(rest)] = (run, len(code))
        tables.append(table)
    return tuple(tables)
