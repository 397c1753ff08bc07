"""The signs that are told apart. Signs that look alike at any size are one: `o` is also O and 0.

Size and place settle what the shape cannot: whether an `o` is a pole, a capital or a zero, whether a
`'` is a prime or a comma.
"""

JUNK = ""
"""No sign at all: pieces of strokes, arrowheads, arcs, crossings, two letters run together."""
SIGNS: tuple[str, ...] = (
    *"o123456789",
    *"aAbBcdDeEfFgGhHJkLmMnNprRstTuvxyz",
    *"πωεμ",
    *".'-/:=()",
    JUNK,
)
TWINS: dict[str, str] = {
    **dict.fromkeys("0OОо", "o"),
    **dict.fromkeys("lI|", "1"),
    **dict.fromkeys("CСс", "c"),
    **dict.fromkeys("SЅ", "s"),
    **dict.fromkeys("Vν", "v"),
    **dict.fromkeys("XХх×", "x"),
    **dict.fromkeys("KКк", "k"),
    **dict.fromkeys("wWϖ", "ω"),
    **dict.fromkeys("Мм", "M"),
    **dict.fromkeys(",’", "'"),
    **dict.fromkeys("·", "."),
    **dict.fromkeys("−–", "-"),
    **dict.fromkeys("а", "a"),
    **dict.fromkeys("А", "A"),
    **dict.fromkeys("В", "B"),
    **dict.fromkeys("Ее", "e"),
    **dict.fromkeys("PрР", "p"),
    **dict.fromkeys("Т", "T"),
    **dict.fromkeys("Н", "H"),
    **dict.fromkeys("у", "y"),
    **dict.fromkeys("п", "π"),
    **dict.fromkeys("²", "2"),
}
TWINS["Е"] = "E"
_OWN = {sign: column for column, sign in enumerate(SIGNS)}
COLUMN: dict[str, int] = {**_OWN, **{sign: _OWN[twin] for sign, twin in TWINS.items()}}
"""The column of each sign, and of those that look like it, among the probabilities."""
